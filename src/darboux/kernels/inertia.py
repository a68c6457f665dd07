"""How many eigenvalues of a symmetric block tridiagonal matrix are negative.

Block elimination keeps the number (Sylvester's law of inertia): S_0 = D_0, S_i = D_i - E_i S_i-1^-1 E_i^T. A block that
has a Cholesky factor has none; of the few others the eigenvalues are computed by Jacobi's rotations.

Source: G. H. Golub and C. F. Van Loan, Matrix Computations, 4th ed. (2013), sections 4.2, 8.1.5 and 8.5.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.jit import jit

Array = NDArray[np.float64]

BLOCK = 6  # rows of a block; a block may use fewer
SQUARE = BLOCK * BLOCK
MOST_SWEEPS = 30
SMALL = 1e-15  # of the largest entry: what Jacobi's rotations leave off the diagonal


@jit
def _inverse_by_cholesky(S: Array, n: int, inverse: Array) -> bool:
    """Write S^-1 and return True, or return False where S is not positive definite."""
    L = np.zeros(SQUARE)
    for j in range(n):
        square = S[j * BLOCK + j]
        for k in range(j):
            square -= L[j * BLOCK + k] ** 2
        if not square > 0.0:
            return False
        L[j * BLOCK + j] = np.sqrt(square)
        for i in range(j + 1, n):
            value = S[i * BLOCK + j]
            for k in range(j):
                value -= L[i * BLOCK + k] * L[j * BLOCK + k]
            L[i * BLOCK + j] = value / L[j * BLOCK + j]
    for column in range(n):
        for i in range(n):
            value = 1.0 if i == column else 0.0
            for k in range(i):
                value -= L[i * BLOCK + k] * inverse[k * BLOCK + column]
            inverse[i * BLOCK + column] = value / L[i * BLOCK + i]
        for i in range(n - 1, -1, -1):
            value = inverse[i * BLOCK + column]
            for k in range(i + 1, n):
                value -= L[k * BLOCK + i] * inverse[k * BLOCK + column]
            inverse[i * BLOCK + column] = value / L[i * BLOCK + i]
    return True


@jit
def _inverse_by_jacobi(S: Array, n: int, inverse: Array, tolerance: float) -> int:
    """Write S^-1 and return how many eigenvalues lie below -tolerance; S is overwritten."""
    V = np.zeros(SQUARE)
    largest = 0.0
    for i in range(n):
        V[i * BLOCK + i] = 1.0
        for j in range(n):
            largest = max(largest, abs(S[i * BLOCK + j]))
    for _ in range(MOST_SWEEPS):
        off = 0.0
        for p in range(n):
            for q in range(p + 1, n):
                off = max(off, abs(S[p * BLOCK + q]))
        if off <= SMALL * largest:
            break
        for p in range(n):
            for q in range(p + 1, n):
                if S[p * BLOCK + q] == 0.0:
                    continue
                theta = (S[q * BLOCK + q] - S[p * BLOCK + p]) / (2.0 * S[p * BLOCK + q])
                t = (1.0 if theta >= 0.0 else -1.0) / (abs(theta) + np.sqrt(theta * theta + 1.0))
                c = 1.0 / np.sqrt(t * t + 1.0)
                s = t * c
                for k in range(n):
                    a, b = S[k * BLOCK + p], S[k * BLOCK + q]
                    S[k * BLOCK + p], S[k * BLOCK + q] = c * a - s * b, s * a + c * b
                for k in range(n):
                    a, b = S[p * BLOCK + k], S[q * BLOCK + k]
                    S[p * BLOCK + k], S[q * BLOCK + k] = c * a - s * b, s * a + c * b
                for k in range(n):
                    a, b = V[k * BLOCK + p], V[k * BLOCK + q]
                    V[k * BLOCK + p], V[k * BLOCK + q] = c * a - s * b, s * a + c * b
    negative = 0
    for i in range(n):
        for j in range(n):
            value = 0.0
            for k in range(n):
                value += V[i * BLOCK + k] * V[j * BLOCK + k] / S[k * BLOCK + k]
            inverse[i * BLOCK + j] = value
        if S[i * BLOCK + i] < -tolerance:
            negative += 1
    return negative


@jit
def negative_eigenvalues(
    diagonal: Array, beside: Array, sizes: NDArray[np.int64], tolerance: float, rounding: float
) -> int:
    """Count the eigenvalues of the blocks below -tolerance, or -rounding times the block's own largest entry.

    diagonal (N x 36,); beside (N - 1 x 36,), below the diagonal; sizes (N,) how many rows and columns of a block count.
    """
    S, inverse, product = np.zeros(SQUARE), np.zeros(SQUARE), np.zeros(SQUARE)
    negative = 0
    for i in range(sizes.size):
        n = sizes[i]
        largest = 0.0
        for a in range(n):
            for b in range(n):
                S[a * BLOCK + b] = diagonal[i * SQUARE + a * BLOCK + b]
                largest = max(largest, abs(S[a * BLOCK + b]))
        if i > 0 and n > 0 and sizes[i - 1] > 0:
            before, E = sizes[i - 1], (i - 1) * SQUARE
            for a in range(n):
                for b in range(before):
                    value = 0.0
                    for k in range(before):
                        value += beside[E + a * BLOCK + k] * inverse[k * BLOCK + b]
                    product[a * BLOCK + b] = value
            for a in range(n):
                for b in range(a + 1):
                    value = 0.0
                    for k in range(before):
                        value += product[a * BLOCK + k] * beside[E + b * BLOCK + k]
                    S[a * BLOCK + b] -= value
                    S[b * BLOCK + a] = S[a * BLOCK + b]
        if n > 0 and not _inverse_by_cholesky(S, n, inverse):
            negative += _inverse_by_jacobi(S, n, inverse, max(tolerance, rounding * largest))
    return negative
