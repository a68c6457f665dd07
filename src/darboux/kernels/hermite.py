"""Hermite's interpolation: the polynomial that fits values and slopes at a few nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.jit import allocating, jit

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


@jit
def _differences(x: Array, y: Array, dy: Array, first: int, count: int, z: Array, c: Array) -> None:
    """Write the nodes, each of them twice, and the divided differences of Newton's form, for the nodes from `first` on."""
    width, twice = y.size // x.size, 2 * count
    for i in range(twice):
        z[i] = x[first + i // 2]
        for a in range(width):
            c[i * width + a] = y[(first + i // 2) * width + a]
    for k in range(1, twice):
        for i in range(twice - 1, k - 1, -1):
            if k == 1 and i % 2 == 1:
                for a in range(width):
                    c[i * width + a] = dy[(first + i // 2) * width + a]
            else:
                over = 1.0 / (z[i] - z[i - k])
                for a in range(width):
                    c[i * width + a] = (c[i * width + a] - c[(i - 1) * width + a]) * over


@allocating
def interpolate(x: Array, y: Array, dy: Array, at: Array, first: Whole, count: Whole, out: Array) -> None:
    """Write the values at some places by the polynomials that fit y and dy at the nodes.

    x (n,) the nodes; y and dy (n x w,); at (m,) the places; first and count (m,) which nodes and how many are fitted there; out
    (m x w,).
    """
    width, most = y.size // x.size, np.max(count)
    z, c, f, n = np.empty(2 * most), np.empty(2 * most * width), -1, 0
    for p in range(at.size):
        if first[p] != f or count[p] != n:
            f, n = first[p], count[p]
            _differences(x, y, dy, f, n, z, c)
        for a in range(width):
            out[p * width + a] = c[(2 * n - 1) * width + a]
        for k in range(2 * n - 2, -1, -1):
            s = at[p] - z[k]
            for a in range(width):
                out[p * width + a] = c[k * width + a] + s * out[p * width + a]
