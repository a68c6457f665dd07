"""The whole matrix of a mesh, factored once: any number of right sides, its transpose, and borders.

A mesh of N elements has N + 1 nodes of 12 unknowns, and as many equations: six at the start, twelve of each element or joint,
six at the end. With k columns and k rows more, the borders, they read

    [ S             | B ]           S, E: the conditions of start and end (6 x 12)
    [ G0 H0         |   ]           Gi, Hi: an element's equations, by the unknowns of its two nodes (12 x 12 each)
    [    G1 H1      |   ]
    [       .  .    |   ]  = M                                                                       (1)
    [            E  |   ]
    [ C             | D ]

Each node is eliminated with pivots from the 18 rows at hand: six that are left over from the node before, and its element's
twelve. That is Gaussian elimination with partial pivoting of all rows but the borders', which are reduced and never chosen. The
last node and the borders come last, 12 + k equations, and are solved by complete pivoting. A matrix that is singular without
its borders is so in its last node alone, and there they make it regular: no block elimination divides by what is small. One
case is left out: a part between two places that are clamped and singular by itself has its small pivot on the way. The
steps E are kept, E M = U, and so M^T z = c is U^T w = c, z = E^T w.

References: U. M. Ascher, R. M. M. Mattheij, R. D. Russell, Numerical Solution of Boundary Value Problems (SIAM, 1995), section
7.2; W. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria (SIAM, 2000), chapter 3.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.algebra import add_multiple
from darboux.kernels.jit import allocating, inline, jit
from darboux.kernels.system import FREE

Array = NDArray[np.float64]
Whole = NDArray[np.int64]

HALF = 6  # conditions of an end, and rows that are left over from node to node
ROWS = HALF + FREE  # those from which pivots are chosen


class Matrix(NamedTuple):
    """(1) without its borders, flat."""

    start: Array  # S (6, 12)
    blocks: Array  # (N, 12, 24), Gi and Hi side by side
    end: Array  # E (6, 12)


class Borders(NamedTuple):
    """The borders of (1), flat: k columns and k rows more; empty for none."""

    columns: Array  # B (12 (N + 1), k)
    rows: Array  # C (k, 12 (N + 1))
    corner: Array  # D (k, k)


class Factors(NamedTuple):
    """What `factor` writes and the solutions read, flat, with k borders."""

    reduced: Array  # (N, 18 + k, 12): U on the diagonal and above, the multipliers below
    beyond: Array  # (N, 12, 12 + k): the pivots' rows by the next node's unknowns, and by the borders'
    pivots: Whole  # (N, 12): the rows that were exchanged with rows 0, 1, ...
    last: Array  # (12 + k, 12 + k): the last equations, factored likewise
    sizes: Array  # (12 + k,): the lengths by which their rows were divided
    order: Whole  # (2, 12 + k): their rows, and their columns, in the order of the pivots


def new_factors(elements: int, k: int) -> Factors:
    """Return the room for the factors of so many elements and borders."""
    own = FREE + k
    reduced, beyond = np.empty(elements * (ROWS + k) * FREE), np.empty(elements * FREE * own)
    pivots, order = np.empty(elements * FREE, np.int64), np.empty(2 * own, np.int64)
    return Factors(reduced, beyond, pivots, np.empty(own * own), np.empty(own), order)


@inline
def _borders(factors: Factors) -> int:
    """How many borders there are."""
    k: int = factors.sizes.size - FREE
    return k


@inline
def _swap(x: Array, i: int, j: int, width: int) -> None:
    """Exchange the rows i and j."""
    for a in range(width):
        x[i * width + a], x[j * width + a] = x[j * width + a], x[i * width + a]


@allocating
def _begin(matrix: Matrix, borders: Borders, k: int, carried: Array) -> None:
    """Write the rows that are there before the first element: the start's and the borders', (6 + k x 12 + k,)."""
    width, unknowns = FREE + k, matrix.blocks.size // (2 * FREE) + FREE
    for row in range(HALF):
        carried[row * width : row * width + FREE] = matrix.start[row * FREE : (row + 1) * FREE]
        carried[row * width + FREE : (row + 1) * width] = borders.columns[row * k : (row + 1) * k]
    for row in range(k):
        at = (HALF + row) * width
        carried[at : at + FREE] = borders.rows[row * unknowns : row * unknowns + FREE]
        carried[at + FREE : at + width] = borders.corner[row * k : (row + 1) * k]


@allocating
def _gather(matrix: Matrix, borders: Borders, i: int, k: int, carried: Array, V: Array) -> None:
    """Put an element's rows between those that are left over and the borders': V (18 + k x 24 + k,)."""
    width, own, unknowns = 2 * FREE + k, FREE + k, matrix.blocks.size // (2 * FREE) + FREE
    for row in range(HALF + k):
        to, of = (row if row < HALF else FREE + row) * width, row * own
        V[to : to + FREE] = carried[of : of + FREE]
        V[to + FREE : to + 2 * FREE] = 0.0
        V[to + 2 * FREE : to + width] = carried[of + FREE : of + own]
        if row >= HALF:
            there = (row - HALF) * unknowns + (i + 1) * FREE
            V[to + FREE : to + 2 * FREE] = borders.rows[there : there + FREE]
    for row in range(FREE):
        to, of, border = (HALF + row) * width, (i * FREE + row) * 2 * FREE, (HALF + i * FREE + row) * k
        V[to : to + 2 * FREE] = matrix.blocks[of : of + 2 * FREE]
        V[to + 2 * FREE : to + width] = borders.columns[border : border + k]


@jit
def _eliminate_node(V: Array, k: int, pivots: Whole) -> float:
    """Eliminate a node's columns, with pivots from the first 18 rows, and keep the multipliers; return the sign of the pivots."""
    sign, width = 1.0, 2 * FREE + k
    for j in range(FREE):
        pivot = j
        for row in range(j + 1, ROWS):
            if abs(V[row * width + j]) > abs(V[pivot * width + j]):
                pivot = row
        pivots[j] = pivot
        if pivot != j:
            sign = -sign
            _swap(V, j, pivot, width)
        if V[j * width + j] < 0.0:
            sign = -sign
        for row in range(j + 1, ROWS + k):
            V[row * width + j] /= V[j * width + j]
            if V[row * width + j] != 0.0:
                at, of = row * width + j + 1, j * width + j + 1
                add_multiple(V, at, -V[row * width + j], V, of, width - j - 1)
    return sign


@allocating
def _keep(V: Array, i: int, k: int, factors: Factors, carried: Array) -> None:
    """Keep an element's factors, and the rows that are left over."""
    width, own = 2 * FREE + k, FREE + k
    for row in range(ROWS + k):
        at = (i * (ROWS + k) + row) * FREE
        factors.reduced[at : at + FREE] = V[row * width : row * width + FREE]
        rest = V[row * width + FREE : (row + 1) * width]
        if row < FREE:
            at = (i * FREE + row) * own
            factors.beyond[at : at + own] = rest
        else:
            carried[(row - FREE) * own : (row - FREE + 1) * own] = rest


@allocating
def _gather_last(matrix: Matrix, borders: Borders, k: int, carried: Array, A: Array) -> None:
    """Put the conditions of the end between the rows that are left over and the borders': A (12 + k x 12 + k,)."""
    own, first = FREE + k, matrix.blocks.size // (2 * FREE) + HALF
    A[: HALF * own] = carried[: HALF * own]
    A[FREE * own :] = carried[HALF * own :]
    for row in range(HALF):
        at, border = (HALF + row) * own, (first + row) * k
        A[at : at + FREE] = matrix.end[row * FREE : (row + 1) * FREE]
        A[at + FREE : at + own] = borders.columns[border : border + k]


@jit
def _factor_last(A: Array, sizes: Array, order: Whole) -> float:
    """Factor the last equations in their place, their rows divided by their lengths, by complete pivoting.

    Returns the least pivot over the largest, with the sign of the determinant; 0 where one is nothing, and then nothing is solved.
    """
    n = sizes.size
    sign, first, least = 1.0, 0.0, 0.0
    for row in range(n):
        square = 0.0
        for j in range(n):
            square += A[row * n + j] ** 2
        sizes[row], order[row], order[n + row] = np.sqrt(square), row, row
        for j in range(n):
            A[row * n + j] /= sizes[row]
    for j in range(n):
        least, pivot, column = -1.0, j, j
        for row in range(j, n):
            for a in range(j, n):
                if abs(A[row * n + a]) > least:
                    least, pivot, column = abs(A[row * n + a]), row, a
        first = least if j == 0 else first
        if not least > 0.0:
            return 0.0
        if pivot != j:
            sign = -sign
            _swap(A, j, pivot, n)
            order[j], order[pivot] = order[pivot], order[j]
        if column != j:
            sign = -sign
            for row in range(n):
                A[row * n + j], A[row * n + column] = A[row * n + column], A[row * n + j]
            order[n + j], order[n + column] = order[n + column], order[n + j]
        sign = -sign if A[j * n + j] < 0.0 else sign
        for row in range(j + 1, n):
            A[row * n + j] /= A[j * n + j]
            add_multiple(A, row * n + j + 1, -A[row * n + j], A, j * n + j + 1, n - j - 1)
    return sign * least / first


@allocating
def factor(matrix: Matrix, borders: Borders, factors: Factors) -> float:
    """Factor (1); return the least pivot of the last equations over their largest, with the sign of the determinant.

    Where it is near 0 the whole is almost singular; where it is 0 nothing can be solved.
    """
    k, elements = _borders(factors), matrix.blocks.size // (2 * FREE * FREE)
    V, carried = np.empty((ROWS + k) * (2 * FREE + k)), np.empty((HALF + k) * (FREE + k))
    sign = 1.0
    _begin(matrix, borders, k, carried)
    for i in range(elements):
        _gather(matrix, borders, i, k, carried, V)
        sign *= _eliminate_node(V, k, factors.pivots[i * FREE : (i + 1) * FREE])
        _keep(V, i, k, factors, carried)
    _gather_last(matrix, borders, k, carried, factors.last)
    return sign * _factor_last(factors.last, factors.sizes, factors.order)


@jit
def _forward(factors: Factors, i: int, v: Array, sides: int) -> None:
    """v = E_i v: the steps of an element, on (18 + k x sides,)."""
    rows = ROWS + _borders(factors)
    for j in range(FREE):
        if factors.pivots[i * FREE + j] != j:
            _swap(v, j, factors.pivots[i * FREE + j], sides)
    for j in range(FREE):
        for row in range(j + 1, rows):
            add_multiple(v, row * sides, -factors.reduced[(i * rows + row) * FREE + j], v, j * sides, sides)


@jit
def _forward_transposed(factors: Factors, i: int, v: Array, sides: int) -> None:
    """v = E_i^T v: the same steps, transposed, the last one first."""
    rows = ROWS + _borders(factors)
    for j in range(FREE - 1, -1, -1):
        for row in range(j + 1, rows):
            add_multiple(v, j * sides, -factors.reduced[(i * rows + row) * FREE + j], v, row * sides, sides)
    for j in range(FREE - 1, -1, -1):
        if factors.pivots[i * FREE + j] != j:
            _swap(v, j, factors.pivots[i * FREE + j], sides)


@jit
def _back(factors: Factors, i: int, x: Array, sides: int) -> None:
    """Solve an element's pivot rows for its node, whose right sides stand in x, where the next node and the borders are solved."""
    k = _borders(factors)
    own, rows, last = FREE + k, ROWS + k, x.size // sides - k
    for j in range(FREE - 1, -1, -1):
        to = (i * FREE + j) * sides
        for a in range(own):
            of = ((i + 1) * FREE + a if a < FREE else last + a - FREE) * sides
            add_multiple(x, to, -factors.beyond[(i * FREE + j) * own + a], x, of, sides)
        for a in range(j + 1, FREE):
            add_multiple(x, to, -factors.reduced[(i * rows + j) * FREE + a], x, (i * FREE + a) * sides, sides)
        for side in range(sides):
            x[to + side] /= factors.reduced[(i * rows + j) * FREE + j]


@jit
def _back_transposed(factors: Factors, i: int, w: Array, sides: int) -> None:
    """Solve an element's part of U^T w = c, and take it from what comes behind."""
    k = _borders(factors)
    own, rows, last = FREE + k, ROWS + k, w.size // sides - k
    for j in range(FREE):
        of = (i * FREE + j) * sides
        for side in range(sides):
            w[of + side] /= factors.reduced[(i * rows + j) * FREE + j]
        for a in range(j + 1, FREE):
            add_multiple(w, (i * FREE + a) * sides, -factors.reduced[(i * rows + j) * FREE + a], w, of, sides)
        for a in range(own):
            to = ((i + 1) * FREE + a if a < FREE else last + a - FREE) * sides
            add_multiple(w, to, -factors.beyond[(i * FREE + j) * own + a], w, of, sides)


@allocating
def _solve_last(factors: Factors, x: Array, sides: int) -> None:
    """Solve the last equations in the place of their right sides."""
    A, n, order, y = factors.last, factors.sizes.size, factors.order, np.empty(x.size)
    for j in range(n):
        for side in range(sides):
            y[j * sides + side] = x[order[j] * sides + side] / factors.sizes[order[j]]
        for a in range(j):
            add_multiple(y, j * sides, -A[j * n + a], y, a * sides, sides)
    for j in range(n - 1, -1, -1):
        for a in range(j + 1, n):
            add_multiple(y, j * sides, -A[j * n + a], y, a * sides, sides)
        for side in range(sides):
            y[j * sides + side] /= A[j * n + j]
    for j in range(n):
        for side in range(sides):
            x[order[n + j] * sides + side] = y[j * sides + side]


@allocating
def _solve_last_transposed(factors: Factors, x: Array, sides: int) -> None:
    """The same for the transposed equations."""
    A, n, order, y = factors.last, factors.sizes.size, factors.order, np.empty(x.size)
    for j in range(n):
        for side in range(sides):
            y[j * sides + side] = x[order[n + j] * sides + side]
        for a in range(j):
            add_multiple(y, j * sides, -A[a * n + j], y, a * sides, sides)
        for side in range(sides):
            y[j * sides + side] /= A[j * n + j]
    for j in range(n - 1, -1, -1):
        for a in range(j + 1, n):
            add_multiple(y, j * sides, -A[a * n + j], y, a * sides, sides)
    for j in range(n):
        for side in range(sides):
            x[order[j] * sides + side] = y[j * sides + side] / factors.sizes[order[j]]


@allocating
def solve(factors: Factors, b: Array, x: Array) -> None:
    """Solve M x = b: b by equations, x by unknowns, both (12 (N + 1) + k, sides) flat, the borders' last."""
    k, elements = _borders(factors), factors.pivots.size // FREE
    sides = b.size // (FREE * (elements + 1) + k)
    half, node, chosen, end = HALF * sides, FREE * sides, ROWS * sides, FREE * (elements + 1) * sides
    v, at = np.empty((ROWS + k) * sides), elements * node
    v[:half] = b[:half]
    v[chosen:] = b[end:]
    for i in range(elements):
        v[half:chosen] = b[half + i * node : half + (i + 1) * node]
        _forward(factors, i, v, sides)
        x[i * node : (i + 1) * node] = v[:node]
        v[:half] = v[node:chosen]
    x[at : at + half] = v[:half]
    x[at + half : end] = b[at + half : end]
    x[end:] = v[chosen:]
    _solve_last(factors, x[at:], sides)
    for i in range(elements - 1, -1, -1):
        _back(factors, i, x, sides)


@allocating
def solve_transposed(factors: Factors, c: Array, z: Array) -> None:
    """Solve M^T z = c: c by unknowns, z by equations, both (12 (N + 1) + k, sides) flat, the borders' last."""
    k, elements = _borders(factors), factors.pivots.size // FREE
    sides = c.size // (FREE * (elements + 1) + k)
    half, node, chosen, end = HALF * sides, FREE * sides, ROWS * sides, FREE * (elements + 1) * sides
    w, v, at = c.copy(), np.empty((ROWS + k) * sides), elements * node
    for i in range(elements):
        _back_transposed(factors, i, w, sides)
    _solve_last_transposed(factors, w[at:], sides)
    v[:half] = w[at : at + half]
    z[at + half : end] = w[at + half : end]
    v[chosen:] = w[end:]
    for i in range(elements - 1, -1, -1):
        v[node:chosen] = v[:half]
        v[:node] = w[i * node : (i + 1) * node]
        _forward_transposed(factors, i, v, sides)
        z[half + i * node : half + (i + 1) * node] = v[half:chosen]
    z[:half] = v[:half]
    z[end:] = v[chosen:]
