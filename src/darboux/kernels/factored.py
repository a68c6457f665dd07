r"""The whole matrix of Newton's equations of a mesh, factored once: for any right sides, transposed too, and with borders.

    [C_0              ]         6 rows at the start
    [E_0 F_0          ]         12 rows of each element or joint, on the nodes on either side
    [    E_1 F_1      ]
    [        ...      ]
    [            C_N  ]         6 rows at the end

Six rows are carried from node to node. The first twelve of the 18 at hand are eliminated, P_i V_i = L_i U_i with partial pivoting,
as `sweep` does it; here the multipliers and pivots are kept. What is left at the last node is twelve rows: where the matrix is
singular they are, and nothing else is. With a border of k columns B and k rows D,

    [A  B] [delta]   [b]
    [D  G] [p    ] = [e]                                                                              (1)

the columns go along as right sides, the rows are reduced by U_i, but give no pivots, and the last 12 + k equations are solved by
complete pivoting. So (1) is solved soundly where A is singular and the border repairs it, at a fold or a buckling point.

Reference: W. J. F. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria (SIAM, 2000), section 3.1: block elimination
by A alone fails there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.jit import jit

Array = NDArray[np.float64]

FREE, HALF, HAND = 12, 6, 18  # unknowns of a node, rows carried, rows at hand
TWO = 2 * FREE


class Factors(NamedTuple):
    """L_i, U_i and the exchanges of rows, N times, and the twelve rows that are left, all flat."""

    L: Array  # (N, 18, 12), the multipliers
    U: Array  # (N, 12, 24), of the node and of the next one
    pivots: NDArray[np.int64]  # (N, 12), with which row row k was exchanged
    last: Array  # (12, 12)


def new_factors(elements: int) -> Factors:
    """Return room for the factors of so many elements and joints."""
    sizes = elements * HAND * FREE, elements * FREE * TWO, FREE * FREE
    L, U, last = (np.empty(size) for size in sizes)
    return Factors(L, U, np.empty(elements * FREE, np.int64), last)


@jit
def factor(start: Array, blocks: Array, end: Array, factors: Factors) -> None:
    """Factor the matrix: start (6 x 12,), blocks (N x 12 x 24,) the rows [E_i, F_i], end (6 x 12,)."""
    L, U, pivots, last = factors
    V = np.zeros(HAND * TWO)
    carried = start.copy()
    for i in range(pivots.size // FREE):
        for row in range(HALF):
            for k in range(FREE):
                V[row * TWO + k], V[row * TWO + FREE + k] = carried[row * FREE + k], 0.0
        for k in range(FREE * TWO):
            V[HALF * TWO + k] = blocks[i * FREE * TWO + k]
        multipliers = L[i * HAND * FREE : (i + 1) * HAND * FREE]
        multipliers[:] = 0.0
        for k in range(FREE):
            pivot = k
            for row in range(k + 1, HAND):
                if abs(V[row * TWO + k]) > abs(V[pivot * TWO + k]):
                    pivot = row
            pivots[i * FREE + k] = pivot
            for j in range(TWO):
                V[k * TWO + j], V[pivot * TWO + j] = V[pivot * TWO + j], V[k * TWO + j]
            for j in range(k):
                here, there = k * FREE + j, pivot * FREE + j
                multipliers[here], multipliers[there] = multipliers[there], multipliers[here]
            for row in range(k + 1, HAND):
                multiple = V[row * TWO + k] / V[k * TWO + k]
                multipliers[row * FREE + k] = multiple
                for j in range(k, TWO):
                    V[row * TWO + j] -= multiple * V[k * TWO + j]
        for k in range(FREE * TWO):
            U[i * FREE * TWO + k] = V[k]
        for row in range(HALF):
            for k in range(FREE):
                carried[row * FREE + k] = V[(FREE + row) * TWO + FREE + k]
    last[: HALF * FREE] = carried
    last[HALF * FREE :] = end


@jit
def forward(factors: Factors, b: Array, sides: int) -> None:
    """Replace right sides by L^-1 P b, in place: b (6 + 12 N + 6, sides) flat, in the order of the rows of the matrix.

    Then the twelve numbers of element i belong to its U_i, and the last twelve to the rows that are left.
    """
    L, pivots = factors.L, factors.pivots
    for i in range(pivots.size // FREE):
        first = i * FREE * sides  # of the 18 at hand: six carried, twelve of the element
        for k in range(FREE):
            pivot = pivots[i * FREE + k]
            for side in range(sides):
                here, there = first + k * sides + side, first + pivot * sides + side
                b[here], b[there] = b[there], b[here]
        for k in range(FREE):
            for row in range(k + 1, HAND):
                multiple = L[i * HAND * FREE + row * FREE + k]
                for side in range(sides):
                    b[first + row * sides + side] -= multiple * b[first + k * sides + side]


@jit
def backward(factors: Factors, b: Array, sides: int) -> None:
    """Replace what `forward` left by the unknowns, but for the last twelve, which are known: in place, node by node."""
    U = factors.U
    for i in range(factors.pivots.size // FREE - 1, -1, -1):
        here, there, first = i * FREE * sides, (i + 1) * FREE * sides, i * FREE * TWO
        for row in range(FREE - 1, -1, -1):
            for side in range(sides):
                value = b[here + row * sides + side]
                for k in range(FREE):
                    value -= U[first + row * TWO + FREE + k] * b[there + k * sides + side]
                for k in range(row + 1, FREE):
                    value -= U[first + row * TWO + k] * b[here + k * sides + side]
                b[here + row * sides + side] = value / U[first + row * TWO + row]


@jit
def forward_transposed(factors: Factors, g: Array, sides: int) -> None:
    """Replace g (N + 1, 12, sides) flat by U^-T g, in place; the last twelve are left for the last rows."""
    U = factors.U
    for i in range(factors.pivots.size // FREE):
        here, there, first = i * FREE * sides, (i + 1) * FREE * sides, i * FREE * TWO
        for side in range(sides):
            for k in range(FREE):
                value = g[here + k * sides + side]
                for row in range(k):
                    value -= U[first + row * TWO + k] * g[here + row * sides + side]
                g[here + k * sides + side] = value / U[first + k * TWO + k]
            for k in range(FREE):
                for row in range(FREE):
                    g[there + k * sides + side] -= U[first + row * TWO + FREE + k] * g[here + row * sides + side]


@jit
def backward_transposed(factors: Factors, g: Array, sides: int) -> None:
    """Replace U^-T g by the factors of the matrix's rows, P^T L^-T of it, in place: the last twelve are known."""
    L, pivots = factors.L, factors.pivots
    for i in range(pivots.size // FREE - 1, -1, -1):
        first = i * FREE * sides
        for k in range(FREE - 1, -1, -1):
            for row in range(k + 1, HAND):
                multiple = L[i * HAND * FREE + row * FREE + k]
                for side in range(sides):
                    g[first + k * sides + side] -= multiple * g[first + row * sides + side]
        for k in range(FREE - 1, -1, -1):
            pivot = pivots[i * FREE + k]
            for side in range(sides):
                here, there = first + k * sides + side, first + pivot * sides + side
                g[here], g[there] = g[there], g[here]


@jit
def solve_completely(A: Array, b: Array, sides: int) -> float:
    """Solve a few equations A x = b by complete pivoting, in place: A (n x n,) is lost, b (n x sides,) becomes x.

    Returns the least pivot over the largest: how near to singular they are.
    """
    n = int(np.sqrt(A.size))
    order, least, largest = np.arange(n), 0.0, 0.0
    for k in range(n):
        best, pivot, column = -1.0, k, k
        for i in range(k, n):
            for j in range(k, n):
                if abs(A[i * n + j]) > best:
                    best, pivot, column = abs(A[i * n + j]), i, j
        largest, least = max(largest, best), best
        if not best > 0.0:
            return 0.0
        for j in range(n):
            A[k * n + j], A[pivot * n + j] = A[pivot * n + j], A[k * n + j]
        for i in range(n):
            A[i * n + k], A[i * n + column] = A[i * n + column], A[i * n + k]
        order[k], order[column] = order[column], order[k]
        for side in range(sides):
            b[k * sides + side], b[pivot * sides + side] = b[pivot * sides + side], b[k * sides + side]
        for i in range(k + 1, n):
            multiple = A[i * n + k] / A[k * n + k]
            for j in range(k, n):
                A[i * n + j] -= multiple * A[k * n + j]
            for side in range(sides):
                b[i * sides + side] -= multiple * b[k * sides + side]
    x = np.empty(n * sides)
    for side in range(sides):
        for k in range(n - 1, -1, -1):
            value = b[k * sides + side]
            for j in range(k + 1, n):
                value -= A[k * n + j] * x[order[j] * sides + side]
            x[order[k] * sides + side] = value / A[k * n + k]
    b[:] = x
    return float(least / largest)


class Border(NamedTuple):
    """k more unknowns and rows: (1)."""

    B: Array  # (N + 1, 12, k), in the order of the rows of the matrix
    D: Array  # (N + 1, 12, k), in that of its unknowns: the rows of D, each as a column
    G: Array  # (k, k)


@jit
def _last_equations(factors: Factors, border: Border, B: Array, D: Array) -> Array:
    """The 12 + k equations that are left of (1); B becomes L^-1 P B and D becomes U^-T D^T, in place."""
    k = int(np.sqrt(border.G.size))
    n, at_end = FREE + k, factors.pivots.size
    forward(factors, B, k)
    forward_transposed(factors, D, k)
    S = np.empty(n * n)
    for row in range(FREE):
        for column in range(FREE):
            S[row * n + column] = factors.last[row * FREE + column]
        for p in range(k):
            S[row * n + FREE + p] = B[(at_end + row) * k + p]
            S[(FREE + p) * n + row] = D[(at_end + row) * k + p]
    for p in range(k):
        for q in range(k):
            value = border.G[p * k + q]
            for i in range(at_end):
                value -= D[i * k + p] * B[i * k + q]
            S[(FREE + p) * n + FREE + q] = value
    return S


@jit
def _reduce(of: Array, b: Array, e: Array, at_end: int, sides: int) -> Array:
    """The right sides of the last 12 + k equations: those of the last node, and the border's less what its rows meet before."""
    k = e.size // sides
    right = np.empty((FREE + k) * sides)
    right[: FREE * sides] = b[at_end * sides :]
    for p in range(k):
        for side in range(sides):
            value = e[p * sides + side]
            for i in range(at_end):
                value -= of[i * k + p] * b[i * sides + side]
            right[(FREE + p) * sides + side] = value
    return right


@jit
def _put_back(of: Array, right: Array, b: Array, e: Array, at_end: int, sides: int) -> None:
    """Write the last node's unknowns and the border's, and take the border's columns off what is before."""
    k = e.size // sides
    b[at_end * sides :] = right[: FREE * sides]
    e[:] = right[FREE * sides :]
    for i in range(at_end):
        for side in range(sides):
            for p in range(k):
                b[i * sides + side] -= of[i * k + p] * e[p * sides + side]


@jit
def solve(factors: Factors, border: Border, b: Array, e: Array, sides: int) -> float:
    """(1): b (N + 1, 12, sides) flat becomes delta, and e (k, sides) becomes p; without a border k is 0.

    b in the order of the rows of the matrix. Returns the least pivot of the last equations over the largest: near 0 they are singular.
    """
    at_end, B, D = factors.pivots.size, border.B.copy(), border.D.copy()
    S = _last_equations(factors, border, B, D)
    forward(factors, b, sides)
    right = _reduce(D, b, e, at_end, sides)
    pivot = solve_completely(S, right, sides)
    _put_back(B, right, b, e, at_end, sides)
    backward(factors, b, sides)
    return pivot


@jit
def solve_transposed(factors: Factors, border: Border, g: Array, h: Array, sides: int) -> float:
    """The transpose of (1): [A^T, D^T; B^T, G^T] [z; s] = [g; h]. g (N + 1, 12, sides) becomes z, h (k, sides) becomes s.

    g in the order of the unknowns, z in that of the rows of the matrix. Returns as `solve` does.
    """
    at_end, B, D = factors.pivots.size, border.B.copy(), border.D.copy()
    S = _last_equations(factors, border, B, D)
    n = int(np.sqrt(S.size))
    forward_transposed(factors, g, sides)
    right = _reduce(B, g, h, at_end, sides)
    pivot = solve_completely(S.reshape(n, n).T.copy().reshape(n * n), right, sides)
    _put_back(D, right, g, h, at_end, sides)
    backward_transposed(factors, g, sides)
    return pivot
