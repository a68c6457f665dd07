r"""Gauss collocation of the rod equations: Newton's equations of a whole mesh, condensed and eliminated in one sweep.

On the element from x_i to x_i + h the states Y_j at Gauss' points meet

    Y_j = y_i + h sum_l a_jl g(Y_l)                                                                  (1)
    y_i+1 = y_i + h sum_l b_l g(Y_l)                                                                 (2)

Newton's unknowns at a node are the 12 numbers (dr, phi, dn, dm), with the small rotation phi in the section's frame,
dq = 1/2 q (0, phi). The stages are eliminated element by element, which leaves

    T_i delta_i - delta_i+1 = -g_i                                                                   (3)

By (1) most parts of the stages' steps are explicit: n, r and m follow one from the other and from q, which alone is
unknown, but for n where r and n depend on each other, and for m in coupled sections. (2) is one row more of (1).

At a station, where a support holds the rod or a point load acts, the node stands twice; the joint between the two is an
element of no width, whose twelve equations are given. All are eliminated forward with six conditions carried along; rows
are exchanged within the 18 at hand, which is Gaussian elimination with partial pivoting of the whole matrix. Two right
sides: the residual, and minus its derivative with respect to the load factor.

References: U. M. Ascher, R. M. M. Mattheij, R. D. Russell, Numerical Solution of Boundary Value Problems (SIAM, 1995),
sections 5.6 and 7.2; E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, 2nd ed. (Springer, 2006),
theorem IV.2.1 (Gauss' methods keep quadratic invariants: |q|, and of unloaded rods m + r x n and m . n).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.algebra import (
    add_multiple,
    add_row_times,
    dot,
    half_product,
    put,
    put_quaternion,
    quaternion,
    rotate,
    rotation,
    times,
    turn,
    vector,
)
from darboux.kernels.element import LINE, acts, bench, is_explicit, keep, write_element, write_stages, write_steps
from darboux.kernels.gauss import point, weight
from darboux.kernels.jit import allocating, inline, jit
from darboux.kernels.profile import columns, evaluate
from darboux.kernels.rod_equations import (
    DEAD_MOMENT,
    FOLLOWER_FORCE,
    FORCE,
    FORCE_GRADIENT,
    K0,
    MOMENT,
    POSITION,
    ROTATION,
    SINV,
    STATES,
    UNIT,
    WIDTH,
    write_derivative,
    write_jacobian,
    write_rate,
)
from darboux.kernels.support import NUMBERS, conditions, joint
from darboux.kernels.system import FREE, M_, N_, PHI, R_, ROW, SIDES, System

Array = NDArray[np.float64]

SHAPED_COUPLE, SHAPED = 21, 42  # of a load that is a function of the shape: f, df/dr, df/dphi, then l likewise
SQUARE = FREE * FREE
WIDE = ROW + 2  # numbers of such a row where they are eliminated: a multiple of four, for the compiler's vectors

# The parts of a state, where they begin and how many numbers they have.
R, Q, N, M, PARTS = 0, 1, 2, 3, 4
BEGIN, SIZE = np.array([POSITION, ROTATION, FORCE, MOMENT]), np.array([3, 4, 3, 3])


class Plan(NamedTuple):
    """The steps of an element's stages as affine functions of the unknown ones and of the right sides, part by part.

    Rows, `width` each: the parts in their order, the explicit ones first, each stage by stage; then y_i+1 likewise.
    Columns: the unknowns, in the order of their rows; the right sides.
    """

    stages: int  # how many
    order: NDArray[np.int64]  # the parts, explicit ones first
    before: NDArray[np.int64]  # how many numbers stand before each part in that order
    links: NDArray[np.bool_]  # whether a part's slope depends on another part, (PARTS, PARTS)
    explicit: int  # how many numbers of a state are explicit
    unknowns: int  # how many numbers of all stages are not
    width: int
    X: Array  # the rows
    F: Array  # the slope of one part at one stage, in such rows
    J: Array  # the Jacobians at the stages
    g: Array  # the slopes at the stages, each followed by its derivative by the load factor
    c: Array  # the coefficients, and behind them their rates
    piece: NDArray[np.int64]  # the piece of the table that was found last (1,)


@allocating
def _planned(system: System, stages: int, sides: int) -> Plan:
    """Find an order in which as many parts as possible are explicit: given by those before them and by unknown ones.

    For no stages it takes no room: an element may need no plan, see `element.py`.
    """
    table, shaped = system.table, system.shaped.size > 0
    coupled, stretches = columns(table) > WIDTH, acts(table, SINV, K0)
    by_place, by_turn = (
        shaped or acts(table, FORCE_GRADIENT, FOLLOWER_FORCE),
        shaped or acts(table, FOLLOWER_FORCE, DEAD_MOMENT),
    )
    links = np.array(
        [
            [False, True, stretches, coupled],  # of r' on r, q, n, m
            [False, True, coupled, True],
            [by_place, by_turn, False, False],
            [shaped, True, True, coupled],
        ]
    )
    if not by_place:
        order = np.array([N, R, M, Q])
    elif not stretches:
        order = np.array([R, N, M, Q])
    else:
        order = np.array([R, M, N, Q])
    explicit = 9 - (3 if by_place and stretches else 0) - (3 if coupled else 0)
    before, numbers = np.empty(PARTS, np.int64), 0
    for part in order:
        before[part] = numbers
        numbers += SIZE[part]
    unknowns = (STATES - explicit) * stages
    width = unknowns + sides
    X, F, J = np.empty(STATES * (stages + 1) * width), np.empty(4 * width), np.zeros(stages * STATES * STATES)
    g, c = np.empty(stages * SIDES * STATES), np.empty(2 * columns(table))
    return Plan(stages, order, before, links, explicit, unknowns, width, X, F, J, g, c, np.zeros(1, np.int64))


@inline
def _add_shaped(Y: Array, y: int, shaped: Array, k: int, load_factor: float, g: Array, j: int, J: Array) -> None:
    """Add the loads that are functions of the shape to the slope, to its derivative by the load factor, to its Jacobian."""
    q = quaternion(Y, y + ROTATION)
    for part in range(2):
        f, row = k + part * SHAPED_COUPLE, (FORCE if part == 0 else MOMENT)
        for a in range(3):
            g[j + row + a] -= load_factor * shaped[f + a]
            g[j + STATES + row + a] -= shaped[f + a]
            for b in range(3):
                k_ab = (row + a) * STATES + POSITION + b
                before = J[k_ab] if part == 0 else 0.0  # dm'/dr is of the shape's couple alone
                J[k_ab] = before - load_factor * shaped[f + 3 + 3 * a + b]
        for b in range(4):
            phi = turn(q, quaternion(UNIT, 3 - b))
            by_turn = times(shaped, f + 12, phi)
            for a in range(3):
                J[(row + a) * STATES + ROTATION + b] -= load_factor * by_turn[a]


@jit
def _linearise(system: System, i: int, plan: Plan) -> None:
    """Write the slopes at the stages, their derivatives by the load factor, and their Jacobians."""
    Y, table, g, piece = system.Y, system.table, plan.g, plan.piece[0]
    c, rate = plan.c[: plan.c.size // 2], plan.c[plan.c.size // 2 :]
    h = system.x[i + 1] - system.x[i]
    for l in range(system.stages):
        y, j = (i * system.stages + l) * STATES, l * SIDES * STATES
        J = plan.J[l * STATES * STATES : (l + 1) * STATES * STATES]
        place = system.x[i] + h * point(system.stages, l)
        while piece < table.breaks.size - 2 and table.breaks[piece + 1] <= place:
            piece += 1
        evaluate(table, piece, place, c)
        evaluate(system.rate, piece, place, rate)
        write_derivative(Y, y, c, g, j, 1)
        write_rate(Y, y, rate, g, j + STATES)
        write_jacobian(Y, y, c, J)
        if system.shaped.size > 0:
            _add_shaped(Y, y, system.shaped, (y // STATES) * SHAPED, system.load_factor, g, j, J)
    plan.piece[0] = piece


@inline
def _row(plan: Plan, part: int, j: int) -> int:
    """The first row of a part at stage j, or of y_i+1 for the stage behind the last one."""
    before, stages = plan.before[part], plan.stages
    row: int = before * stages + j * SIZE[part] if j < stages else STATES * stages + before
    return row


@inline
def _slope(plan: Plan, part: int, l: int) -> None:
    """F: the slope of a part at stage l, J X + g."""
    X, F, J, g, width = plan.X, plan.F, plan.J, plan.g, plan.width
    for k in range(F.size):
        F[k] = 0.0
    for a in range(SIZE[part]):
        for side in range(SIDES):
            F[(a + 1) * width - SIDES + side] = g[(l * SIDES + side) * STATES + BEGIN[part] + a]
    for other in range(PARTS):
        if not plan.links[part, other]:
            continue
        row = _row(plan, other, l)
        unknown = row - plan.explicit * plan.stages
        for a in range(SIZE[part]):
            j = (l * STATES + BEGIN[part] + a) * STATES + BEGIN[other]
            if unknown < 0:
                add_row_times(F, a * width, vector(J, j), X, row * width, width)
            else:
                for b in range(SIZE[other]):
                    F[a * width + unknown + b] += J[j + b]


@jit
def _condense(system: System, i: int, start: Array, plan: Plan) -> None:
    """Write the rows of (1) and of y_i+1, part by part, from a start whose residuals alone stand on the right side."""
    X, F, width, count = plan.X, plan.F, plan.width, plan.stages
    h = system.x[i + 1] - system.x[i]
    for part in plan.order:
        size = SIZE[part]
        for j in range(count + 1):
            x = _row(plan, part, j) * width
            y, at = (system.Y, i * count + j) if j < count else (system.y, i + 1)
            for a in range(size):
                number = BEGIN[part] + a
                X[x + (a + 1) * width - SIDES] += start[number] - y[at * STATES + number]
        for l in range(count):
            _slope(plan, part, l)
            for j in range(count + 1):
                x = _row(plan, part, j) * width
                add_multiple(X, x, h * weight(count, j, l), F, 0, size * width)
    for k in range(plan.unknowns):
        X[(plan.explicit * count + k) * width + k] -= 1.0


@jit
def _eliminate(V: Array, unknowns: int, candidates: int, rows: int, width: int) -> float:
    """Eliminate the first columns of all rows, with pivots from the first rows; return the sign of the pivots."""
    sign = 1.0
    for k in range(unknowns):
        best, pivot = abs(V[k * width + k]), k
        for i in range(k + 1, candidates):
            if abs(V[i * width + k]) > best:
                best, pivot = abs(V[i * width + k]), i
        if pivot != k:
            sign = -sign
            for j in range(width):
                V[k * width + j], V[pivot * width + j] = V[pivot * width + j], V[k * width + j]
        if V[k * width + k] < 0.0:
            sign = -sign
        over = 1.0 / V[k * width + k]
        for i in range(k + 1, rows):
            factor = V[i * width + k] * over
            if factor != 0.0:
                add_multiple(V, i * width + k + 1, -factor, V, k * width + k + 1, width - k - 1)
    return sign


@jit
def _eliminate_node(V: Array) -> float:
    """Eliminate a node's columns from the 18 rows at hand; return the sign of the pivots."""
    sign = 1.0
    for k in range(FREE):
        pivot = k
        for i in range(k + 1, 18):
            if abs(V[i * WIDE + k]) > abs(V[pivot * WIDE + k]):
                pivot = i
        at = np.uint64(k * WIDE)
        if pivot != k:
            other, sign = np.uint64(pivot * WIDE), -sign
            for j in range(np.uint64(WIDE)):
                V[at + j], V[other + j] = V[other + j], V[at + j]
        over = 1.0 / V[k * WIDE + k]
        sign = -sign if over < 0.0 else sign
        for i in range(k + 1, 18):
            to, factor = np.uint64(i * WIDE), V[i * WIDE + k] * over
            if factor != 0.0:
                for j in range(np.uint64(WIDE)):
                    V[to + j] -= factor * V[at + j]
    return sign


@jit
def _element(system: System, i: int, plan: Plan, start: Array, T: Array) -> None:
    """(3): write the rows [T_i, -1, -gap, -d gap / d load factor] of one element, (12 x ROW,)."""
    X, width, count, sides = plan.X, plan.width, system.stages, plan.unknowns
    for k in range(STATES):
        start[k] = system.y[i * STATES + k]
    X[:] = 0.0
    q = quaternion(start, ROTATION)
    for j in range(count + 1):
        for part, unknown in ((R, R_), (N, N_), (M, M_)):
            for a in range(3):
                X[(_row(plan, part, j) + a) * width + sides + unknown + a] = 1.0
        for a in range(3):
            put_quaternion(X, _row(plan, Q, j) * width + sides + PHI + a, width, half_product(q, vector(UNIT, 3 - a)))
    _linearise(system, i, plan)
    _condense(system, i, start, plan)
    V = X[plan.explicit * count * width :]
    _eliminate(V, sides, sides, sides + STATES, width)
    for k in range(FREE * ROW):
        T[k] = 0.0
    for row in range(FREE):
        T[row * ROW + FREE + row] = -1.0
    following = quaternion(system.y, (i + 1) * STATES + ROTATION)
    r, dq, n, m = (
        _row(plan, R, count) * width,
        _row(plan, Q, count) * width,
        _row(plan, N, count) * width,
        _row(plan, M, count) * width,
    )
    for k in range(FREE + SIDES):
        column, sign, at = (k if k < FREE else FREE + k), (1.0 if k < FREE else -1.0), sides + k
        phi = turn(following, (X[dq + at], X[dq + width + at], X[dq + 2 * width + at], X[dq + 3 * width + at]))
        for a in range(3):
            T[(R_ + a) * ROW + column] = sign * X[r + a * width + at]
            T[(PHI + a) * ROW + column] = sign * phi[a]
            T[(N_ + a) * ROW + column] = sign * X[n + a * width + at]
            T[(M_ + a) * ROW + column] = sign * X[m + a * width + at]


@allocating
def sweep(system: System, supports: Array, last: Array, factors: Array, kept: Array, transfer: Array) -> float:
    """Eliminate all elements; return the sign of the pivots.

    supports (those of the start, of each station, of the end, NUMBERS each); last (12 x 14,) out, the twelve equations that are
    left for the end and their right sides; factors (N x 12 x ROW,) out, for `back`; kept (N x 4 stages x LINE,) out, for `advance`;
    transfer (N x 144,) out or none, as `transfers` writes it, for the elements that have a width.
    """
    explicit, at, start = is_explicit(system), bench(system.stages), np.empty(STATES)
    plan = _planned(system, 0 if explicit else system.stages, FREE + SIDES)
    V, T = np.zeros(18 * WIDE), np.empty(FREE * ROW)
    sign, elements, station, wide = 1.0, system.x.size - 1, 0, 0
    size = 4 * system.stages * LINE
    conditions(supports[:NUMBERS], system.y[:STATES], system.load_factor, last)
    for i in range(elements):
        for row in range(6):
            for k in range(FREE):
                V[row * WIDE + k] = last[row * (FREE + SIDES) + k]
                V[row * WIDE + FREE + k] = 0.0
            for k in range(SIDES):
                V[row * WIDE + 2 * FREE + k] = last[row * (FREE + SIDES) + FREE + k]
        if system.x[i + 1] == system.x[i]:
            station += 1
            here = i * STATES
            before, behind = system.y[here : here + STATES], system.y[here + STATES : here + 2 * STATES]
            joint(supports[station * NUMBERS : (station + 1) * NUMBERS], before, behind, system.load_factor, T)
        elif explicit:
            write_element(system, i, at, T)
            keep(at, system.stages, kept[i * size : (i + 1) * size])
        else:
            _element(system, i, plan, start, T)
        if transfer.size > 0 and system.x[i + 1] > system.x[i]:
            _keep_transfer(system, i, T, transfer, wide)
            wide += SQUARE
        for row in range(FREE):
            for k in range(ROW):
                V[(6 + row) * WIDE + k] = T[row * ROW + k]
        sign *= _eliminate_node(V)
        for row in range(FREE):
            for k in range(ROW):
                factors[(i * FREE + row) * ROW + k] = V[row * WIDE + k]
        for row in range(6):
            for k in range(FREE + SIDES):
                last[row * (FREE + SIDES) + k] = V[(FREE + row) * WIDE + FREE + k]
    at_end = system.y[elements * STATES :]
    conditions(supports[supports.size - NUMBERS :], at_end, system.load_factor, last[6 * (FREE + SIDES) :])
    return sign


@jit
def back(factors: Array, delta: Array) -> None:
    """Fill delta (N + 1, 12, SIDES) flat from its last node backward, with the factors of `sweep`."""
    elements = factors.size // (FREE * ROW)
    for i in range(elements - 1, -1, -1):
        here, there = i * FREE * SIDES, (i + 1) * FREE * SIDES
        for row in range(FREE - 1, -1, -1):
            f = (i * FREE + row) * ROW
            one, two = factors[f + 2 * FREE], factors[f + 2 * FREE + 1]
            for k in range(FREE):
                one -= factors[f + FREE + k] * delta[there + k * SIDES]
                two -= factors[f + FREE + k] * delta[there + k * SIDES + 1]
            for k in range(row + 1, FREE):
                one -= factors[f + k] * delta[here + k * SIDES]
                two -= factors[f + k] * delta[here + k * SIDES + 1]
            delta[here + row * SIDES], delta[here + row * SIDES + 1] = one / factors[f + row], two / factors[f + row]


@inline
def _solve(plan: Plan, change: float) -> None:
    """Write the steps of all stages, for a change of the load factor, in the place of their residuals."""
    X, width, unknowns, first = plan.X, plan.width, plan.unknowns, plan.explicit * plan.stages
    _eliminate(X[first * width :], unknowns, unknowns, unknowns, width)
    for row in range(first + unknowns - 1, -1, -1):
        x = row * width
        value = X[x + unknowns] + change * X[x + unknowns + 1]
        for k in range(max(row - first + 1, 0), unknowns):
            value += X[x + k] * X[(first + k) * width + unknowns]
        X[x + unknowns] = value if row < first else -value / X[x + row - first]


@allocating
def advance(system: System, delta: Array, change: float, part: float, kept: Array, y_new: Array, Y_new: Array) -> None:
    """Write the nodes and stages moved by `part` of a step and of the load factor's change.

    delta (N + 1, 12, SIDES) flat, of which the first side is the step; kept as `sweep` wrote it, or none.
    """
    stages, x, y, Y = system.stages, system.x, system.y, system.Y
    explicit, at, T, dq = is_explicit(system), bench(stages), np.empty(FREE * ROW), np.empty(4 * stages)
    plan, start, moved = _planned(system, 0 if explicit else stages, SIDES), np.empty(STATES), np.empty(STATES)
    new, size, of_element = _with_states(system, y_new, Y_new), 4 * stages * LINE, np.empty(4 * stages * LINE)
    for i in range(x.size):
        _moved(y, i * STATES, delta, i * FREE * SIDES, 1.0, start)
        _moved(y, i * STATES, delta, i * FREE * SIDES, part, moved)
        square = 0.0
        for a in range(ROTATION, FORCE):
            square += moved[a] ** 2
        for a in range(STATES):
            over = np.sqrt(square) if ROTATION <= a < FORCE else 1.0
            y_new[i * STATES + a] = moved[a] / over
        if i + 1 == x.size:
            break
        first = i * stages * STATES
        if x[i + 1] == x[i]:
            for k in range(stages * STATES):
                Y_new[first + k] = Y[first + k]
        elif explicit:
            if kept.size == 0:
                write_element(system, i, at, T)
                keep(at, stages, of_element)
            else:
                of_element = kept[i * size : (i + 1) * size]
            write_steps(of_element, delta[i * FREE * SIDES : (i + 1) * FREE * SIDES], change, dq)
            for k in range(4 * stages):
                q = first + k // 4 * STATES + ROTATION + k % 4
                Y_new[q] = Y[q] + part * dq[k]
            write_stages(new, i, at)
        else:
            plan.X[:] = 0.0
            _linearise(system, i, plan)
            _condense(system, i, start, plan)
            _solve(plan, change)
            for p in range(PARTS):
                for j in range(stages):
                    for a in range(SIZE[p]):
                        k = first + j * STATES + BEGIN[p] + a
                        Y_new[k] = Y[k] + part * plan.X[(_row(plan, p, j) + a) * plan.width + plan.unknowns]


@allocating
def _with_states(system: System, y: Array, Y: Array) -> System:
    parts = (system.table, system.rate, system.shaped, system.load_factor)
    return System(system.stages, system.x, y, Y, *parts)


@inline
def _moved(y: Array, at: int, delta: Array, k: int, part: float, out: Array) -> None:
    """The state at `at` moved by a part of the step that begins at k; its quaternion is not of unit length."""
    phi = (delta[k + PHI * SIDES], delta[k + (PHI + 1) * SIDES], delta[k + (PHI + 2) * SIDES])
    dq = half_product(quaternion(y, at + ROTATION), phi)
    for a in range(4):
        out[ROTATION + a] = y[at + ROTATION + a] + part * dq[a]
    for a in range(3):
        out[POSITION + a] = y[at + POSITION + a] + part * delta[k + (R_ + a) * SIDES]
        out[FORCE + a] = y[at + FORCE + a] + part * delta[k + (N_ + a) * SIDES]
        out[MOMENT + a] = y[at + MOMENT + a] + part * delta[k + (M_ + a) * SIDES]


@allocating
def transfers(system: System, transfer: Array) -> None:
    """Write T_i of (3), with rotations in the fixed frame, for every element that has a width: transfer (12 x 12 each,)."""
    x, explicit, at, start = system.x, is_explicit(system), bench(system.stages), np.empty(STATES)
    plan = _planned(system, 0 if explicit else system.stages, FREE + SIDES)
    T, first = np.empty(FREE * ROW), 0
    for i in range(x.size - 1):
        if x[i + 1] == x[i]:
            continue
        if explicit:
            write_element(system, i, at, T)
        else:
            _element(system, i, plan, start, T)
        _keep_transfer(system, i, T, transfer, first)
        first += SQUARE


@inline
def _keep_transfer(system: System, i: int, T: Array, transfer: Array, at: int) -> None:
    """Write T_i of the rows of an element, with rotations in the fixed frame, from `at` on."""
    R0 = rotation(quaternion(system.y, i * STATES + ROTATION))
    R1 = rotation(quaternion(system.y, (i + 1) * STATES + ROTATION))
    for row in range(FREE):
        for k in range(FREE):
            transfer[at + row * FREE + k] = T[row * ROW + k]
    for k in range(FREE):
        here = at + PHI * FREE + k
        put(transfer, here, FREE, rotate(R1, (transfer[here], transfer[here + FREE], transfer[here + 2 * FREE])))
    for row in range(FREE):
        here = at + row * FREE + PHI
        put(transfer, here, 1, rotate(R0, vector(transfer, here)))


@allocating
def solve_last(last: Array, delta: Array) -> float:
    """Solve the last twelve equations (12 x 14,) for delta (12 x SIDES,), by complete pivoting.

    Returns the least pivot over the largest, with the sign of the determinant: where it is small, a free motion or a
    bifurcation is near.
    """
    width = FREE + SIDES
    order = np.arange(FREE)
    sign, first, least = 1.0, 0.0, 0.0
    for row in range(FREE):
        size = 0.0
        for k in range(FREE):
            size += last[row * width + k] ** 2
        over = 1.0 / np.sqrt(size)
        for k in range(width):
            last[row * width + k] *= over
    for k in range(FREE):
        best, pivot, column = -1.0, k, k
        for i in range(k, FREE):
            for j in range(k, FREE):
                if abs(last[i * width + j]) > best:
                    best, pivot, column = abs(last[i * width + j]), i, j
        if k == 0:
            first = best
        least = best
        if not best > 0.0:
            return 0.0
        if pivot != k:
            sign = -sign
            for j in range(width):
                last[k * width + j], last[pivot * width + j] = last[pivot * width + j], last[k * width + j]
        if column != k:
            sign = -sign
            order[k], order[column] = order[column], order[k]
            for i in range(FREE):
                last[i * width + k], last[i * width + column] = last[i * width + column], last[i * width + k]
        if last[k * width + k] < 0.0:
            sign = -sign
        over = 1.0 / last[k * width + k]
        for i in range(k + 1, FREE):
            factor = last[i * width + k] * over
            for j in range(k, width):
                last[i * width + j] -= factor * last[k * width + j]
    for side in range(SIDES):
        for k in range(FREE - 1, -1, -1):
            value = last[k * width + FREE + side]
            for j in range(k + 1, FREE):
                value -= last[k * width + j] * delta[order[j] * SIDES + side]
            delta[order[k] * SIDES + side] = value / last[k * width + k]
    return sign * least / first


@allocating
def measure(y: Array, delta: Array, side: int) -> tuple[float, float]:
    """Return the largest step of a vector at a node, in the units of the states, and the largest turn.

    y (N + 1, 13) flat; delta (N + 1, 12, SIDES) flat, of which one side is measured. Places and frames are measured by 1,
    forces and moments by 1 + their own largest. Not finite where a number is not.
    """
    steps, sizes = np.zeros(4), np.zeros(4)
    total = 0.0
    for i in range(y.size // STATES):
        for part in range(4):
            square = 0.0
            for a in range(3):
                square += delta[(i * FREE + 3 * part + a) * SIDES + side] ** 2
            total += square
            steps[part] = max(steps[part], square)
        for part in range(2):
            n = vector(y, i * STATES + FORCE + 3 * part)
            sizes[2 + part] = max(sizes[2 + part], dot(n, n))
    turn = np.sqrt(steps[1])
    length = max(np.sqrt(steps[0]), 0.5 * turn)
    for part in range(2, 4):
        length = max(length, np.sqrt(steps[part]) / (1.0 + np.sqrt(sizes[part])))
    return length + 0.0 * total, turn + 0.0 * total
