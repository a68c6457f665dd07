"""How many eigenvalues of a symmetric block tridiagonal matrix are negative, whose blocks may be indefinite or singular.

L D L^T block by block, with pivots of one and of two rows: Sylvester's law of inertia counts those of D. A pivot must be at
least PIVOT times what stands beside it in all rows, those of the next block among them, so that nothing grows; rows without
such a pivot wait for the next block, as in a frontal method.

Source: I. S. Duff and J. K. Reid, The multifrontal solution of indefinite sparse symmetric linear equations, ACM Trans.
Math. Softw. 9 (1983) 302, sections 2 and 3; G. H. Golub and C. F. Van Loan, Matrix Computations, 4th ed. (2013), section 8.1.5.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.fours import four, four_plus, put_four
from darboux.kernels.jit import allocating, inline, jit

Array = NDArray[np.float64]

BLOCK = 12  # rows of a block; a block may use fewer
SQUARE = BLOCK * BLOCK
FRONT = 4 * BLOCK  # rows at hand: a block, the next one, and what waits
PIVOT = 0.1  # a pivot over the largest entry beside it: growth is at most 1 + 1 / PIVOT per row


@inline
def _swap(F: Array, n: int, i: int, j: int) -> None:
    """Exchange rows and columns i and j of the first n."""
    for k in range(n):
        F[i * FRONT + k], F[j * FRONT + k] = F[j * FRONT + k], F[i * FRONT + k]
    for k in range(n):
        F[k * FRONT + i], F[k * FRONT + j] = F[k * FRONT + j], F[k * FRONT + i]


@inline
def _look(F: Array, n: int, i: int, beside: Array) -> float:
    """Write what stands beside the diagonal in row i; return the diagonal's size over that."""
    largest, at, second = 0.0, -1, 0.0
    for k in range(n):
        size = abs(F[i * FRONT + k]) if k != i else 0.0
        if size > largest:
            largest, at, second = size, k, largest
        elif size > second:
            second = size
    beside[3 * i], beside[3 * i + 1], beside[3 * i + 2] = largest, at, second
    size = abs(F[i * FRONT + i])
    return size / largest if largest > 0.0 else (np.inf if size > 0.0 else 0.0)


@inline
def _pair(F: Array, i: int, j: int, beside: Array) -> float:
    """Return the size of the pivot of rows i and j over what stands beside it."""
    a, b, c = F[i * FRONT + i], F[i * FRONT + j], F[j * FRONT + j]
    x = beside[3 * i + 2] if beside[3 * i + 1] == j else beside[3 * i]
    y = beside[3 * j + 2] if beside[3 * j + 1] == i else beside[3 * j]
    growth = max(abs(c) * x + abs(b) * y, abs(b) * x + abs(a) * y)
    det = abs(a * c - b * b)
    return det / growth if growth > 0.0 else (np.inf if det > 0.0 else 0.0)


@jit
def _pivot(F: Array, first: int, n: int, beside: Array) -> tuple[int, int, float]:
    """Return a pivot among the rows from `first` on, one row (i, i) or two, and its size over what stands beside it.

    It is the first one that is large enough, or else the best; a row's largest entry tells the row that is tried beside it first.
    beside (FRONT x 3,) out: of each row the largest entry beside the diagonal, where it stands, and the next one.
    """
    best_i, best_j, best = first, first, -1.0
    for i in range(first, n):
        ratio = _look(F, n, i, beside)
        if ratio > best:
            best_i, best_j, best = i, i, ratio
        partner = int(beside[3 * i + 1])
        if best < PIVOT and partner > i:
            _look(F, n, partner, beside)
            ratio = _pair(F, i, partner, beside)
            if ratio > best:
                best_i, best_j, best = partner, i, ratio
        for j in range(first, i):
            if best >= PIVOT:
                break
            ratio = _pair(F, i, j, beside)
            if ratio > best:
                best_i, best_j, best = i, j, ratio
        if best >= PIVOT:
            break
    return best_i, best_j, best


@inline
def _take_off(F: Array, rows: int, i: int, factor: float, pivot: int) -> None:
    """Take a multiple of the pivot's row off the first entries of row i; up to three more are lost."""
    to, of = i * FRONT, pivot * FRONT
    for k in range(0, rows, 4):
        put_four(F, to + k, four_plus(four(F, to + k), -factor, four(F, of + k)))


@jit
def _eliminate(F: Array, n: int, two: bool) -> int:
    """Eliminate the last row of n, or the last two; return how many of the pivot's eigenvalues are negative."""
    p = n - 1
    if not two:
        d = F[p * FRONT + p]
        if d == 0.0:
            return 0
        over = 1.0 / d
        for i in range(p):
            if F[p * FRONT + i] != 0.0:
                _take_off(F, p, i, F[p * FRONT + i] * over, p)
        return 1 if d < 0.0 else 0
    q = n - 2
    a, b, c = F[q * FRONT + q], F[q * FRONT + p], F[p * FRONT + p]
    det = a * c - b * b
    over = 1.0 / det
    for i in range(q):
        x, y = F[q * FRONT + i], F[p * FRONT + i]
        if x != 0.0 or y != 0.0:
            _take_off(F, q, i, (c * x - b * y) * over, q)
            _take_off(F, q, i, (a * y - b * x) * over, p)
    return 1 if det < 0.0 else (2 if a < 0.0 else 0)


@allocating
def negative_eigenvalues(diagonal: Array, below: Array, sizes: NDArray[np.int64]) -> int:
    """Count the negative eigenvalues.

    diagonal (N x 144,); below (N - 1 x 144,), each block's coupling with the one before it; sizes (N,) how many rows and columns
    of a block count.
    """
    F, new, beside = np.zeros(FRONT * FRONT + 3), np.zeros(FRONT * FRONT + 3), np.empty(3 * FRONT)
    negative, n = 0, sizes[0]
    for a in range(n):
        for b in range(n):
            F[a * FRONT + b] = diagonal[a * BLOCK + b]
    for i in range(sizes.size):
        # `n` rows at hand: those of block i first, then the ones that wait. Those of block i + 1 go in front of them.
        ahead = sizes[i + 1] if i + 1 < sizes.size else 0
        for a in range(n):
            for b in range(0, n, 4):
                put_four(new, (ahead + a) * FRONT + ahead + b, four(F, a * FRONT + b))
        for a in range(ahead):
            for b in range(ahead):
                new[a * FRONT + b] = diagonal[(i + 1) * SQUARE + a * BLOCK + b]
            for b in range(n):
                value = below[i * SQUARE + a * BLOCK + b] if b < sizes[i] else 0.0
                new[a * FRONT + ahead + b] = value
                new[(ahead + b) * FRONT + a] = value
        F, new = new, F
        n += ahead
        while n > ahead:
            p, q, size = _pivot(F, ahead, n, beside)
            if size < PIVOT and ahead > 0 and n <= FRONT - BLOCK:
                break
            _swap(F, n, p, n - 1)
            two = p != q
            if two:
                _swap(F, n, p if q == n - 1 else q, n - 2)
            negative += _eliminate(F, n, two)
            n -= 2 if two else 1
    return negative
