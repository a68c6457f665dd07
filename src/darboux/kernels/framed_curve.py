"""A framed curve from its curvature and twist."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.algebra import add, column, plus, quaternion, rotation, scaled, vector
from darboux.kernels.jit import jit

Array = NDArray[np.float64]


@jit
def lay_out(h: Array, k: Array, r: Array, q: Array) -> None:
    """Write places and frames of a curve that leaves the origin with d_i = e_i.

    h (2 n,) the lengths of half steps; k (2 n, 3) flat the curvature and twist in their middles; out r (n + 1, 3) and q (n + 1, 4)
    flat. The frame turns by k h over a half step, exactly; the places follow by Simpson's rule.
    """
    w, a, b, c = 1.0, 0.0, 0.0, 0.0
    q[0], q[1], q[2], q[3] = w, a, b, c
    r[0] = r[1] = r[2] = 0.0
    directions = np.zeros(9)
    directions[2] = 1.0
    for i in range(h.size):
        u = scaled(h[i], vector(k, 3 * i))
        angle = np.sqrt(u[0] ** 2 + u[1] ** 2 + u[2] ** 2)
        e, p = np.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / np.pi)
        f, g, j = scaled(p, u)
        w, a, b, c = (
            w * e - a * f - b * g - c * j,
            w * f + a * e + b * j - c * g,
            w * g - a * j + b * e + c * f,
            w * j + a * g - b * f + c * e,
        )
        at = i // 2
        if i % 2 == 0:
            q[4 * at + 4], q[4 * at + 5], q[4 * at + 6], q[4 * at + 7] = w, a, b, c
            d3 = column(rotation(quaternion(q, 4 * at + 4)), 2)
            directions[3], directions[4], directions[5] = d3
            continue
        q[4 * at + 4], q[4 * at + 5], q[4 * at + 6], q[4 * at + 7] = w, a, b, c
        d3 = column(rotation(quaternion(q, 4 * at + 4)), 2)
        directions[6], directions[7], directions[8] = d3
        mean = plus(plus(vector(directions, 0), scaled(4.0, vector(directions, 3))), vector(directions, 6))
        for m in range(3):
            r[3 * at + 3 + m] = r[3 * at + m]
        add(r, 3 * at + 3, scaled((h[i - 1] + h[i]) / 6.0, mean))
        directions[0], directions[1], directions[2] = d3
