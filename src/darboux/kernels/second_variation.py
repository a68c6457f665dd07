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
from darboux.kernels.fours import NOTHING, four, four_plus, put_four
from darboux.kernels.inertia import BLOCK, SQUARE, negative_eigenvalues
from darboux.kernels.jit import allocating, inline, jit

Array = NDArray[np.float64]

HALF = BLOCK // 2
LINE, INVERSE, OF_B = (
    20,
    HALF,
    BLOCK,
)  # of [1, A^-1, A^-1 B]: numbers in a row, a multiple of four, and where the parts begin
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
def _solve_piece(T: Array, at: int, M: Array, S: Array) -> None:
    """Write A^-1 and A^-1 B, by Gauss and Jordan's elimination with the largest pivot of each column, and C A^-1.

    T (12 x 12,) from `at` on is [A, B; C, D]; out: M (6 x LINE,) = [1, A^-1, A^-1 B], S (6 x 8,), of which six columns count.
    """
    for a in range(HALF):
        for b in range(HALF):
            M[a * LINE + b] = T[at + a * BLOCK + b]
            M[a * LINE + INVERSE + b] = 1.0 if a == b else 0.0
            M[a * LINE + OF_B + b] = T[at + a * BLOCK + HALF + b]
    for k in range(HALF):
        pivot, row = k, k * LINE
        for i in range(k + 1, HALF):
            if abs(M[i * LINE + k]) > abs(M[pivot * LINE + k]):
                pivot = i
        over = 1.0 / M[pivot * LINE + k]
        for j in range(0, LINE, 4):
            here = four(M, row + j)
            put_four(M, row + j, four_plus(NOTHING, over, four(M, pivot * LINE + j)))
            if pivot != k:
                put_four(M, pivot * LINE + j, here)
        for i in range(HALF):
            factor = -M[i * LINE + k]
            if i != k and factor != 0.0:
                for j in range(0, LINE, 4):
                    put_four(M, i * LINE + j, four_plus(four(M, i * LINE + j), factor, four(M, row + j)))
    for a in range(HALF):
        for j in range(0, 8, 4):
            line = NOTHING
            for k in range(HALF):
                line = four_plus(line, T[at + (HALF + a) * BLOCK + k], four(M, k * LINE + INVERSE + j))
            put_four(S, a * 8 + j, line)


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


@allocating
def assemble(
    T: Array, x: Array, m: Array, lent: Array, diagonal: Array, below: Array, weights: Array
) -> tuple[int, float]:
    """Write the sum of (1) over the pieces, of nodes that nothing holds; return how many forces count, and the softest piece.

    T (N x 144,) the transfers of (dr, theta, dn, dm), which are changed; x (N + 1,) the nodes; m (N x 3,) the moments at the
    starts; lent (N x 9,) what is added to the compliance by dn, or none. Out, all zero on entry: diagonal (N + 1 x 144,), of the
    displacements and the forces at a node; below (N x 144,); weights (N + 1 x 12,) the lengths that belong to a node's
    displacements. A negative eigenvalue belongs to each force whose compliance is positive; the softest piece is that of the
    largest compliance of bending and twist over h, or 1.
    """
    M, S, G = np.zeros(HALF * LINE), np.empty(HALF * 8), np.empty(HALF * HALF)
    work, size = np.empty(SQUARE), np.full(1, HALF)
    of_forces, softest = 0, 1.0
    for i in range(x.size - 1):
        at, h = i * SQUARE, x[i + 1] - x[i]
        _from_rotation_vectors(T, at, m, 3 * i)
        _solve_piece(T, at, M, S)
        soft = 1.0
        for a in range(HALF):
            for b in range(a + 1):
                g = 0.5 * (M[a * LINE + OF_B + b] + M[b * LINE + OF_B + a])
                if a < 3 and lent.size > 0:
                    g += lent[9 * i + 3 * a + b]
                s = 0.5 * (S[a * 8 + b] + S[b * 8 + a])
                G[a * HALF + b] = G[b * HALF + a] = g
                diagonal[at + (HALF + a) * BLOCK + HALF + b] = diagonal[at + (HALF + b) * BLOCK + HALF + a] = -g
                diagonal[at + SQUARE + a * BLOCK + b] = diagonal[at + SQUARE + b * BLOCK + a] = s
                if b >= 3:
                    soft = max(soft, abs(g) / h)
        for a in range(HALF):
            diagonal[at + a * BLOCK + HALF + a] = diagonal[at + (HALF + a) * BLOCK + a] = -1.0
            for b in range(HALF):
                below[at + a * BLOCK + HALF + b] = M[b * LINE + INVERSE + a]
            weights[i * BLOCK + a] += 0.5 * h / soft
            weights[(i + 1) * BLOCK + a] += 0.5 * h / soft
        softest = max(softest, soft)
        of_forces += _positive(G, h, work, size)
    return of_forces, softest


@allocating
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


@allocating
def index(
    diagonal: Array, below: Array, weights: Array, sizes: NDArray[np.int64], foundation: float, of_forces: int
) -> int:
    """Return how many directions lower the energy on a foundation of that stiffness: by Sylvester's and Haynsworth's laws."""
    on_it = diagonal.copy()
    for i in range(sizes.size):
        for k in range(BLOCK):
            on_it[i * SQUARE + k * (BLOCK + 1)] += foundation * weights[i * BLOCK + k]
    return negative_eigenvalues(on_it, below, sizes) - of_forces
