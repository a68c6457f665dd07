r"""The second variation of an equilibrium's energy, as a block tridiagonal matrix: from transfer matrices, piece by piece.

Over one piece of the rod small changes go from start to end by d_1 = A d_0 + B p_0, p_1 = C d_0 + D p_0, with the
displacements d = (dr, theta) and the forces p = (dn, dm), all in the fixed frame. The energy of the change is

    p_0 . (A^-1 d_1 - d_0) - 1/2 p_0 . G p_0 + 1/2 d_1 . S d_1,     G = A^-1 B,  S = C A^-1                      (1)

stationary in p_0. No B is inverted, so that a piece may be as short and as stiff as it likes: A is near 1, B and C near 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.algebra import cross, vector
from darboux.kernels.inertia import BLOCK, SQUARE, negative_eigenvalues
from darboux.kernels.jit import inline, jit

Array = NDArray[np.float64]

HALF = BLOCK // 2
ROUNDING = 1e-12  # of a piece's compliance


@inline
def _from_rotation_vectors(T: Array, at: int, m: Array, k: int) -> None:
    """Replace dm by dm + 1/2 m x theta, the force that a rotation vector works on, at the start of a piece.

    At its end that would add to S what is antisymmetric.
    """
    start = vector(m, k)
    for row in range(BLOCK):
        first = at + row * BLOCK
        more = cross(vector(T, first + 9), start)  # a row times [m x] is the row x m
        for a in range(3):
            T[first + 3 + a] -= 0.5 * more[a]


@jit
def _invert(A: Array, inverse: Array) -> None:
    """Invert A (6 x 6,) by Gauss and Jordan's elimination with the largest pivot of each column."""
    for k in range(HALF * HALF):
        inverse[k] = 0.0
    for k in range(HALF):
        inverse[k * (HALF + 1)] = 1.0
    for k in range(HALF):
        pivot = k
        for i in range(k + 1, HALF):
            if abs(A[i * HALF + k]) > abs(A[pivot * HALF + k]):
                pivot = i
        over = 1.0 / A[pivot * HALF + k]
        for j in range(HALF):
            A[k * HALF + j], A[pivot * HALF + j] = A[pivot * HALF + j], A[k * HALF + j]
            inverse[k * HALF + j], inverse[pivot * HALF + j] = inverse[pivot * HALF + j], inverse[k * HALF + j]
        for j in range(HALF):
            A[k * HALF + j] *= over
            inverse[k * HALF + j] *= over
        for i in range(HALF):
            factor = A[i * HALF + k]
            if i == k or factor == 0.0:
                continue
            for j in range(HALF):
                A[i * HALF + j] -= factor * A[k * HALF + j]
                inverse[i * HALF + j] -= factor * inverse[k * HALF + j]


@inline
def _product(T: Array, at: int, inverse: Array, i: int, j: int, left: bool) -> float:
    """The element (i, j) of A^-1 B, or of C A^-1, with the 6 x 6 block of T that begins at `at`."""
    value = 0.0
    for k in range(HALF):
        if left:
            value += inverse[i * HALF + k] * T[at + k * BLOCK + j]
        else:
            value += T[at + i * BLOCK + k] * inverse[k * HALF + j]
    return value


@inline
def _is_definite(A: Array) -> bool:
    """Whether Cholesky's factorisation of A (6 rows of 12,) goes through; the lower half of A is lost."""
    for k in range(HALF):
        for i in range(k):
            A[k * BLOCK + k] -= A[k * BLOCK + i] ** 2
        if not A[k * BLOCK + k] > 0.0:
            return False
        root = np.sqrt(A[k * BLOCK + k])
        A[k * BLOCK + k] = root
        for j in range(k + 1, HALF):
            for i in range(k):
                A[j * BLOCK + k] -= A[j * BLOCK + i] * A[k * BLOCK + i]
            A[j * BLOCK + k] /= root
    return True


@jit
def _positive(G: Array, h: float, work: Array, size: NDArray[np.int64]) -> int:
    """Return how many eigenvalues of a piece's compliance G (6 x 6,) are not negative, forces taken by their moments over h."""
    largest = 0.0
    for again in range(2):
        for a in range(HALF):
            for b in range(HALF):
                unit = (1.0 / h if a < 3 else 1.0) * (1.0 / h if b < 3 else 1.0)
                work[a * BLOCK + b] = unit * G[a * HALF + b]
                largest = max(largest, abs(work[a * BLOCK + b]))
        if again == 0 and _is_definite(work):
            return HALF
    for a in range(HALF):  # a piece so long that it would not stand with one end free
        work[a * (BLOCK + 1)] += ROUNDING * largest
    return HALF - negative_eigenvalues(work, work[:0], size)


@jit
def assemble(T: Array, x: Array, m: Array, diagonal: Array, below: Array, weights: Array) -> tuple[int, float]:
    """Write the sum of (1) over the pieces, of nodes that nothing holds; return how many forces count, and the softest piece.

    T (N x 144,) the transfers of (dr, theta, dn, dm), which are changed; x (N + 1,) the nodes; m (N x 3,) the moments at the
    starts. Out, all zero on entry: diagonal (N + 1 x 144,), of the displacements and the forces at a node; below
    (N x 144,); weights (N + 1 x 12,) the lengths that belong to a node's displacements. A negative eigenvalue belongs to each
    force whose compliance is positive; the softest piece is that of the largest compliance of bending and twist over h, or 1.
    """
    A, inverse, G = np.empty(HALF * HALF), np.empty(HALF * HALF), np.empty(HALF * HALF)
    work, size = np.empty(SQUARE), np.full(1, HALF)
    of_forces, softest = 0, 1.0
    for i in range(x.size - 1):
        at, h = i * SQUARE, x[i + 1] - x[i]
        _from_rotation_vectors(T, at, m, 3 * i)
        for a in range(HALF):
            for b in range(HALF):
                A[a * HALF + b] = T[at + a * BLOCK + b]
        _invert(A, inverse)
        soft = 1.0
        for a in range(HALF):
            for b in range(a + 1):
                g = 0.5 * (_product(T, at + HALF, inverse, a, b, True) + _product(T, at + HALF, inverse, b, a, True))
                s = 0.5 * (
                    _product(T, at + HALF * BLOCK, inverse, a, b, False)
                    + _product(T, at + HALF * BLOCK, inverse, b, a, False)
                )
                G[a * HALF + b] = G[b * HALF + a] = g
                diagonal[at + (HALF + a) * BLOCK + HALF + b] = diagonal[at + (HALF + b) * BLOCK + HALF + a] = -g
                diagonal[at + SQUARE + a * BLOCK + b] = diagonal[at + SQUARE + b * BLOCK + a] = s
                if b >= 3:
                    soft = max(soft, abs(g) / h)
        for a in range(HALF):
            diagonal[at + a * BLOCK + HALF + a] = diagonal[at + (HALF + a) * BLOCK + a] = -1.0
            for b in range(HALF):
                below[at + a * BLOCK + HALF + b] = inverse[b * HALF + a]
            weights[i * BLOCK + a] += 0.5 * h / soft
            weights[(i + 1) * BLOCK + a] += 0.5 * h / soft
        softest = max(softest, soft)
        of_forces += _positive(G, h, work, size)
    return of_forces, softest


@jit
def hold(
    node: int, motions: Array, count: int, stiffness: Array, diagonal: Array, below: Array, weights: Array
) -> None:
    """Leave a node only `count` motions, columns of (6 x 6,), and add the stiffness (6 x 6,) of its springs.

    The motions come first, then the forces.
    """
    D = diagonal[node * SQUARE : (node + 1) * SQUARE]
    for a in range(HALF):
        for b in range(HALF):
            D[a * BLOCK + b] += stiffness[a * HALF + b]
    line = np.empty(BLOCK)
    _to_motions(D, BLOCK, 1, motions, count, line)
    _to_motions(D, 1, BLOCK, motions, count, line)
    for k in range(count, HALF):
        weights[node * BLOCK + k] = 0.0
    if node > 0:
        _to_motions(below[(node - 1) * SQUARE : node * SQUARE], 1, BLOCK, motions, count, line)
    if (node + 1) * SQUARE <= below.size:
        _to_motions(below[node * SQUARE : (node + 1) * SQUARE], BLOCK, 1, motions, count, line)


@inline
def _to_motions(D: Array, across: int, along: int, motions: Array, count: int, line: Array) -> None:
    """Replace D by D C, row by row (across BLOCK, along 1), or by C^T D, column by column (across 1, along BLOCK).

    C leads from the free motions and the forces of a node to its displacements and forces.
    """
    for i in range(BLOCK):
        first = i * across
        for k in range(BLOCK):
            line[k] = D[first + k * along]
            D[first + k * along] = 0.0
        for k in range(count):
            for a in range(HALF):
                D[first + k * along] += line[a] * motions[a * HALF + k]
        for a in range(HALF):
            D[first + (count + a) * along] = line[HALF + a]


@jit
def index(
    diagonal: Array, below: Array, weights: Array, sizes: NDArray[np.int64], foundation: float, of_forces: int
) -> int:
    """Return how many directions lower the energy on a foundation of that stiffness: by Sylvester's and Haynsworth's laws."""
    on_it = diagonal.copy()
    for i in range(sizes.size):
        for k in range(BLOCK):
            on_it[i * SQUARE + k * (BLOCK + 1)] += foundation * weights[i * BLOCK + k]
    return negative_eigenvalues(on_it, below, sizes) - of_forces
