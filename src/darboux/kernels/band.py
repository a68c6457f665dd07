"""Symmetric band matrices of half-bandwidth 10: L D L^T without pivoting, its inertia, and solutions.

A symmetric matrix A of n rows is kept by its lower band, column after column, in one flat array of 11 n:

    lower[11 j + (i - j)] = A[i, j]            0 <= i - j <= 10

A general one keeps both sides of its diagonal; `general.reshape(n, 21).T` is LAPACK's and SciPy's form of it:

    general[21 j + (10 + i - j)] = A[i, j]      -10 <= i - j <= 10

The unknowns of a discrete rod come in blocks of four, and no column reaches below the seventh row after its block: that of
column j is j - j % 4 + 10. The factorisation takes block by block, and reads nothing that lies lower, nor below the last row.
There is no pivoting: near a singular matrix the pivot, not the solution, tells the truth.

Source: G. H. Golub, C. F. Van Loan, Matrix Computations, 4th ed., section 4.3.6; the count of negative pivots is
Sylvester's law of inertia (section 8.1.5).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.jit import inline, jit

Array = NDArray[np.float64]
Four = tuple[float, float, float, float]

REACH = 10  # the half-bandwidth
LOWER = REACH + 1  # numbers kept per column, lower band
FULL = 2 * REACH + 1  # numbers kept per column, general band
BLOCK = 4  # columns that reach down to the same row

# Where A[i, 4 j + p] of block j stands, with i counted from the block's first row: at 44 j + 10 p + i. Unsigned, as an
# index that never counts from the end, which the compiler would look for.
COLUMN1, COLUMN2, COLUMN3 = np.uint64(REACH), np.uint64(2 * REACH), np.uint64(3 * REACH)
ONE, TWO, THREE, FOUR = np.uint64(1), np.uint64(2), np.uint64(3), np.uint64(BLOCK)
BELOW = np.uint64(LOWER)  # one past the last row of a block
SPAN = np.uint64(LOWER * BLOCK)


@inline
def blocks(n: int) -> int:
    """How many blocks of n columns have all their rows below them; the columns that are left are done one by one."""
    return (n - REACH + BLOCK - 1) // BLOCK if n > REACH else 0


@inline
def eliminate_block(lower: Array, o: np.uint64) -> Four:
    """L D L^T of the four columns at o, and A -= L D L^T on the seven rows below them; return the four pivots."""
    o1, o2, o3 = o + COLUMN1, o + COLUMN2, o + COLUMN3
    a10, a20, a30 = lower[o + ONE], lower[o + TWO], lower[o + THREE]
    d0 = lower[o]
    r0 = 1.0 / d0
    l10, l20, l30 = a10 * r0, a20 * r0, a30 * r0
    d1 = lower[o1 + ONE] - l10 * a10
    r1 = 1.0 / d1
    a21, a31 = lower[o1 + TWO] - l20 * a10, lower[o1 + THREE] - l30 * a10
    l21, l31 = a21 * r1, a31 * r1
    d2 = lower[o2 + TWO] - l20 * a20 - l21 * a21
    r2 = 1.0 / d2
    a32 = lower[o2 + THREE] - l30 * a20 - l31 * a21
    l32 = a32 * r2
    d3 = lower[o3 + THREE] - l30 * a30 - l31 * a31 - l32 * a32
    r3 = 1.0 / d3
    lower[o + ONE], lower[o + TWO], lower[o + THREE] = l10, l20, l30
    lower[o1 + ONE], lower[o1 + TWO], lower[o1 + THREE] = d1, l21, l31
    lower[o2 + TWO], lower[o2 + THREE], lower[o3 + THREE] = d2, l32, d3
    for i in range(FOUR, BELOW):
        x0 = lower[o + i]
        x1 = lower[o1 + i] - l10 * x0
        x2 = lower[o2 + i] - l20 * x0 - l21 * x1
        x3 = lower[o3 + i] - l30 * x0 - l31 * x1 - l32 * x2
        lower[o + i], lower[o1 + i], lower[o2 + i], lower[o3 + i] = x0 * r0, x1 * r1, x2 * r2, x3 * r3
        for k in range(FOUR, i + ONE):  # A[i, k] stands 10 k after A[i, 0]
            at = o + COLUMN1 * k + i
            lower[at] = lower[at] - x0 * lower[o + k] - x1 * lower[o1 + k] - x2 * lower[o2 + k] - x3 * lower[o3 + k]
    return d0, d1, d2, d3


@inline
def eliminate(lower: Array, j: int, reach: int) -> None:
    """A[j+i, j+k] -= l_i d l_k for the `reach` rows below the pivot d = A[j, j]; then l replaces the column."""
    column = LOWER * j
    inverse = 1.0 / lower[column]
    for k in range(1, reach + 1):
        scale = lower[column + k] * inverse
        target = column + REACH * k
        for i in range(k, reach + 1):
            lower[target + i] -= scale * lower[column + i]
    for k in range(1, reach + 1):
        lower[column + k] *= inverse


@inline
def is_pivot(d: float) -> bool:
    """Neither zero nor infinite nor no number."""
    return 0.0 < abs(d) < np.inf


@jit
def factor(lower: Array, n: int) -> int:
    """A = L D L^T in place: D on the diagonal, L below it; return how many pivots are negative.

    That is the number of negative eigenvalues of A. A pivot that is zero or not finite returns -1.
    """
    negative = 0
    for block in range(np.uint64(blocks(n))):
        d0, d1, d2, d3 = eliminate_block(lower, SPAN * block)
        if not (is_pivot(d0) and is_pivot(d1) and is_pivot(d2) and is_pivot(d3)):
            return -1
        negative += int(d0 < 0.0) + int(d1 < 0.0) + int(d2 < 0.0) + int(d3 < 0.0)
    for j in range(BLOCK * blocks(n), n):
        pivot = lower[LOWER * j]
        if not is_pivot(pivot):
            return -1
        if pivot < 0.0:
            negative += 1
        eliminate(lower, j, min(n - 1 - j, REACH - j % BLOCK))
    return negative


@inline
def forward(lower: Array, b: Array, j: np.uint64) -> None:
    """L y = b for the four rows from j on, and b -= L y on the seven rows below."""
    o = BELOW * j
    o1, o2, o3 = o + COLUMN1, o + COLUMN2, o + COLUMN3
    y0 = b[j]
    y1 = b[j + ONE] - lower[o + ONE] * y0
    y2 = b[j + TWO] - lower[o + TWO] * y0 - lower[o1 + TWO] * y1
    y3 = b[j + THREE] - lower[o + THREE] * y0 - lower[o1 + THREE] * y1 - lower[o2 + THREE] * y2
    b[j + ONE], b[j + TWO], b[j + THREE] = y1, y2, y3
    for i in range(FOUR, BELOW):
        b[j + i] = b[j + i] - lower[o + i] * y0 - lower[o1 + i] * y1 - lower[o2 + i] * y2 - lower[o3 + i] * y3


@inline
def backward(lower: Array, b: Array, j: np.uint64) -> None:
    """D L^T x = y for the four rows from j on, the nearest of those below last."""
    o = BELOW * j
    o1, o2, o3 = o + COLUMN1, o + COLUMN2, o + COLUMN3
    x0, x1 = b[j] / lower[o], b[j + ONE] / lower[o1 + ONE]
    x2, x3 = b[j + TWO] / lower[o2 + TWO], b[j + THREE] / lower[o3 + THREE]
    for k in range(BELOW - FOUR):
        i = COLUMN1 - k
        x = b[j + i]
        x0 -= lower[o + i] * x
        x1 -= lower[o1 + i] * x
        x2 -= lower[o2 + i] * x
        x3 -= lower[o3 + i] * x
    x2 -= lower[o2 + THREE] * x3
    x1 -= lower[o1 + THREE] * x3 + lower[o1 + TWO] * x2
    x0 -= lower[o + THREE] * x3 + lower[o + TWO] * x2 + lower[o + ONE] * x1
    b[j], b[j + ONE], b[j + TWO], b[j + THREE] = x0, x1, x2, x3


@jit
def substitute_back(lower: Array, n: int, b: Array) -> None:
    """D L^T x = b, by the factors that `factor` left; x replaces b."""
    whole = blocks(n)
    for j in range(n - 1, BLOCK * whole - 1, -1):
        b[j] /= lower[LOWER * j]
        for k in range(1, min(n - 1 - j, REACH - j % BLOCK) + 1):
            b[j] -= lower[LOWER * j + k] * b[j + k]
    for block in range(np.uint64(whole)):
        backward(lower, b, FOUR * (np.uint64(whole) - ONE - block))


@jit
def solve(lower: Array, n: int, b: Array) -> None:
    """L D L^T x = b, by the factors that `factor` left; x replaces b."""
    whole = blocks(n)
    for block in range(np.uint64(whole)):
        forward(lower, b, FOUR * block)
    for j in range(BLOCK * whole, n):
        for k in range(1, min(n - 1 - j, REACH - j % BLOCK) + 1):
            b[j + k] -= lower[LOWER * j + k] * b[j]
    substitute_back(lower, n, b)


@jit
def fix(lower: Array, gradient: Array, fixed: NDArray[np.bool_]) -> None:
    """Hold the unknowns where `fixed` is true: row and column become the unit matrix's, the gradient's entry 0.

    The unit pivot is positive, so that the inertia stays that of the free unknowns.
    """
    n = gradient.size
    for j in range(n):
        for k in range(min(LOWER, n - j)):
            if fixed[j] or fixed[j + k]:
                lower[LOWER * j + k] = 0.0
        if fixed[j]:
            lower[LOWER * j] = 1.0
            gradient[j] = 0.0


@jit
def fix_general(general: Array, residual: Array, fixed: NDArray[np.bool_]) -> None:
    """The same for a general band and its residual."""
    n = residual.size
    for j in range(n):
        for i in range(max(0, j - REACH), min(n, j + LOWER)):
            if fixed[j] or fixed[i]:
                general[FULL * j + REACH + i - j] = 0.0
        if fixed[j]:
            general[FULL * j + REACH] = 1.0
            residual[j] = 0.0


@jit
def expand(lower: Array, n: int, general: Array) -> None:
    """Write a symmetric matrix's both sides: A[j+k, j] = A[j, j+k], and 0 where the band leaves the matrix."""
    for k in range(FULL * n):
        general[k] = 0.0
    for j in range(n):
        for k in range(min(LOWER, n - j)):
            general[FULL * j + REACH + k] = lower[LOWER * j + k]
            general[FULL * (j + k) + REACH - k] = lower[LOWER * j + k]


@jit
def solve_general(general: Array, n: int, b: Array) -> bool:
    """A x = b for a general band, which L U without pivoting replaces, as x replaces b; False at a pivot that is none."""
    for j in range(n):
        column, reach = FULL * j + REACH, np.uint64(min(REACH - j % BLOCK, n - 1 - j))
        if not is_pivot(general[column]):
            return False
        inverse, y = 1.0 / general[column], b[j]
        l, below = general[column + 1 :], b[j + 1 :]
        for i in range(reach):
            l[i] *= inverse
            below[i] -= l[i] * y
        for k in range(1, np.int64(reach) + 1):
            target = column + (FULL - 1) * k
            u, rest = general[target], general[target + 1 :]
            for i in range(reach):
                rest[i] -= l[i] * u
    for j in range(n - 1, -1, -1):
        column = FULL * j + REACH
        b[j] /= general[column]
        for i in range(1, min(REACH, j) + 1):
            b[j - i] -= general[column - i] * b[j]
    return True
