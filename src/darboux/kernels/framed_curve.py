"""A framed curve from its curvature and twist."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.algebra import column, dot, plus, put, put_quaternion, rotation, scaled, vector
from darboux.kernels.jit import jit

Array = NDArray[np.float64]


@jit
def lay_out(h: Array, k: Array, r: Array, q: Array) -> None:
    """Write places and frames of a curve that leaves the origin with d_i = e_i.

    h (2 n,) the lengths of half steps; k (2 n, 3) flat the curvature and twist in their middles; out r (n + 1, 3) and q (n + 1, 4)
    flat. The frame turns by k h over a half step, exactly; the places follow by Simpson's rule.
    """
    w, a, b, c = 1.0, 0.0, 0.0, 0.0
    put_quaternion(q, 0, 1, (w, a, b, c))
    put(r, 0, 1, (0.0, 0.0, 0.0))
    start = middle = (0.0, 0.0, 1.0)  # d3 where a step begins, and half way
    for i in range(h.size):
        u = scaled(h[i], vector(k, 3 * i))
        angle = np.sqrt(dot(u, u))
        e, (f, g, j) = np.cos(0.5 * angle), scaled(0.5 * np.sinc(0.5 * angle / np.pi), u)
        w, a, b, c = (
            w * e - a * f - b * g - c * j,
            w * f + a * e + b * j - c * g,
            w * g - a * j + b * e + c * f,
            w * j + a * g - b * f + c * e,
        )
        d3 = column(rotation((w, a, b, c)), 2)
        if i % 2 == 0:
            middle = d3
            continue
        at = i // 2
        mean = plus(plus(start, scaled(4.0, middle)), d3)
        put(r, 3 * at + 3, 1, plus(vector(r, 3 * at), scaled((h[i - 1] + h[i]) / 6.0, mean)))
        put_quaternion(q, 4 * at + 4, 1, (w, a, b, c))
        start = d3
