"""Rings: chains of N + 1 edges whose last edge, with its two vertices, is the first one once more.

    x_N = x_0     x_{N+1} = x_1     t_{N+1} = t_1     d1_{N+1} = d1_1 turned about t_1 by the angle of the link

So the last seven of a chain's packed unknowns are its first seven, b, over again, and a chain's A and g make a ring's J^T A J
and J^T g, J the matrix that repeats them. The others, y, are left as a band, to which the seven are a border:

    A_yy y + A_yb b = g_y,     A_by y + A_bb b = g_b     hence     (A_bb - A_by A_yy^-1 A_yb) b = g_b - A_by A_yy^-1 g_y      (1)

With A_yy = L D L^T only L^-1 (A_yb, g_y) is needed of the border, which is found for its eight columns side by side. The work
is linear in N.

Source: G. H. Golub, C. F. Van Loan, Matrix Computations, 4th ed., section 2.1.4 (block elimination).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels import band
from darboux.kernels.algebra import cross, mix, store, vector
from darboux.kernels.band import BELOW, FOUR, LOWER, ONE, REACH, THREE, TWO
from darboux.kernels.jit import inline, jit

Array = NDArray[np.float64]

SHARED = 7  # unknowns of the edge that stands twice
LANES = SHARED + 1  # columns of the border, the right-hand side the last
CORNER = LANES * SHARED  # numbers of (A_bb, g_b)
SEVEN, EIGHT = np.uint64(SHARED), np.uint64(LANES)


@inline
def close(t: Array, d1: Array, turn: Array) -> None:
    """Give the repeated edge the first one's frame, turned by the angle whose cosine and sine are `turn`."""
    last, tangent, director = t.size - 6, vector(t, 3), vector(d1, 3)
    store(t, last, tangent)
    store(d1, last, mix(turn[0], director, turn[1], cross(tangent, director)))


@inline
def share(residual: Array, mass: Array, A: Array) -> None:
    """A = -g / m of the seven that stand twice, g and m the sums of both."""
    last = A.size - SHARED
    for p in range(SHARED):
        A[p] = A[last + p] = -(residual[p] + residual[last + p]) / (mass[p] + mass[last + p])


@inline
def entry(lower: Array, i: int, j: int) -> float:
    """A[i, j], i >= j; 0 outside of the band."""
    return lower[LOWER * j + i - j] if i - j <= REACH else 0.0


@jit
def take_border(lower: Array, b: Array, border: Array, corner: Array) -> None:
    """Move (A_yb, g_y) into the border's rows and (A_bb, g_b) into the corner; A keeps the unit matrix's rows in their place."""
    n = b.size
    last = n - SHARED
    border[:] = 0.0
    for i in range(SHARED, last):
        border[LANES * i + SHARED] = b[i]
    for q in range(SHARED):
        for p in range(SHARED):
            i, j = max(p, q), min(p, q)
            corner[LANES * p + q] = entry(lower, i, j) + entry(lower, last + i, last + j)
            corner[LANES * p + q] += entry(lower, last + p, q) + entry(lower, last + q, p)
        corner[LANES * q + SHARED] = b[q] + b[last + q]
        for i in range(SHARED, min(last, q + LOWER)):
            border[LANES * i + q] += entry(lower, i, q)
        for i in range(max(SHARED, last + q - REACH), last):
            border[LANES * i + q] += entry(lower, last + q, i)
    for j in range(max(0, last - REACH), last):
        for k in range(last - j, LOWER):
            lower[LOWER * j + k] = 0.0
    for j in range(SHARED):
        for column in (LOWER * j, LOWER * (last + j)):
            for k in range(LOWER):
                lower[column + k] = 0.0
            lower[column] = 1.0


@jit
def sweep_border(lower: Array, n: int, border: Array) -> None:
    """Z = L^-1 (A_yb, g_y) in the border's place."""
    for j in range(SEVEN, np.uint64(n) - SEVEN):
        o, column = EIGHT * j, BELOW * j
        for k in range(ONE, BELOW - j % FOUR):
            l, row = lower[column + k], o + EIGHT * k
            for q in range(EIGHT):
                border[row + q] -= l * border[o + q]


@jit
def take_from_corner(lower: Array, n: int, border: Array, corner: Array) -> None:
    """corner -= Z^T D^-1 Z, four rows at a time; the first three of the first four belong to none, and are zero."""
    for j in range(FOUR, np.uint64(n) - SEVEN, FOUR):
        o, d = EIGHT * j, BELOW * j
        o1, o2, o3 = o + EIGHT, o + TWO * EIGHT, o + THREE * EIGHT
        r, r1, r2, r3 = lower[d], lower[d + BELOW], lower[d + TWO * BELOW], lower[d + THREE * BELOW]
        for p in range(SEVEN):
            z, z1, z2, z3 = border[o + p] / r, border[o1 + p] / r1, border[o2 + p] / r2, border[o3 + p] / r3
            row = EIGHT * p
            for q in range(EIGHT):
                corner[row + q] -= z * border[o + q] + z1 * border[o1 + q] + z2 * border[o2 + q] + z3 * border[o3 + q]


@inline
def solve_corner(corner: Array) -> bool:
    """The seven unknowns of (1) in the place of their right-hand side; without pivoting, like the band. False at a zero pivot."""
    for p in range(SHARED):
        pivot = corner[LANES * p + p]
        if not band.is_pivot(pivot):
            return False
        for i in range(SHARED):
            if i != p:
                l = corner[LANES * i + p] / pivot
                for q in range(p + 1, LANES):
                    corner[LANES * i + q] -= l * corner[LANES * p + q]
    for p in range(SHARED):
        corner[LANES * p + SHARED] /= corner[LANES * p + p]
    return True


@jit
def solve(lower: Array, b: Array, border: Array, corner: Array) -> bool:
    """Solve J^T A J u = J^T b by eq. (1); J u replaces b, the band is used up. False where a pivot is zero or no number."""
    n = b.size
    take_border(lower, b, border, corner)
    if band.factor(lower, n) < 0:
        return False
    sweep_border(lower, n, border)
    take_from_corner(lower, n, border, corner)
    if not solve_corner(corner):
        return False
    for i in range(n):
        b[i] = border[LANES * i + SHARED]
        for q in range(SHARED):
            b[i] -= border[LANES * i + q] * corner[LANES * q + SHARED]
    band.substitute_back(lower, n, b)
    for q in range(SHARED):
        b[q] = b[n - SHARED + q] = corner[LANES * q + SHARED]
    return True
