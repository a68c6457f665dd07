"""Symmetric band matrices of half-bandwidth 10: L D L^T without pivoting, its inertia, and solutions.

A symmetric matrix A of n rows is kept by its lower band, column after column, in one flat array of 11 n:

    lower[11 j + (i - j)] = A[i, j]            0 <= i - j <= 10

A general one keeps both sides of its diagonal; `general.reshape(n, 21).T` is LAPACK's and SciPy's form of it:

    general[21 j + (10 + i - j)] = A[i, j]      -10 <= i - j <= 10

Entries of a column that would lie below the last row or above the first are never read nor written by the
factorisation. There is no pivoting: near a singular matrix the pivot, not the solution, tells the truth.

Source: G. H. Golub, C. F. Van Loan, Matrix Computations, 4th ed., section 4.3.6; the count of negative pivots is
Sylvester's law of inertia (section 8.1.5).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.jit import inline, jit

Array = NDArray[np.float64]

REACH = 10  # the half-bandwidth
LOWER = REACH + 1  # numbers kept per column, lower band
FULL = 2 * REACH + 1  # numbers kept per column, general band


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


@jit
def factor(lower: Array, n: int) -> int:
    """A = L D L^T in place: D on the diagonal, L below it; return how many pivots are negative.

    That is the number of negative eigenvalues of A. A pivot that is zero or not finite returns -1.
    """
    negative = 0
    for j in range(n):
        pivot = lower[LOWER * j]
        if not 0.0 < abs(pivot) < np.inf:
            return -1
        if pivot < 0.0:
            negative += 1
        if j < n - REACH:
            eliminate(lower, j, REACH)
        else:
            eliminate(lower, j, n - 1 - j)
    return negative


@inline
def forward(lower: Array, b: Array, j: int, reach: int) -> None:
    """y_j = b_j - sum_k L[j, j-k] y_{j-k}, nearest last so that it waits for one product only."""
    total = b[j]
    for k in range(reach, 0, -1):
        total -= lower[LOWER * (j - k) + k] * b[j - k]
    b[j] = total


@inline
def backward(lower: Array, b: Array, j: int, reach: int) -> None:
    """x_j = y_j / d_j - sum_k L[j+k, j] x_{j+k}, nearest last."""
    total = b[j] / lower[LOWER * j]
    for k in range(reach, 0, -1):
        total -= lower[LOWER * j + k] * b[j + k]
    b[j] = total


@jit
def solve(lower: Array, n: int, b: Array) -> None:
    """L D L^T x = b, by the factors that `factor` left; x replaces b."""
    for j in range(min(n, REACH)):
        forward(lower, b, j, j)
    for j in range(REACH, n):
        forward(lower, b, j, REACH)
    for j in range(n - 1, max(n - 1 - REACH, -1), -1):
        backward(lower, b, j, n - 1 - j)
    for j in range(n - 1 - REACH, -1, -1):
        backward(lower, b, j, REACH)


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
