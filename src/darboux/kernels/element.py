r"""One element of collocation whose loads depend neither on the place nor on the frame: the stages' quaternions alone are unknown.

From the node y_0 to the node y_1, h behind it, with Gauss' weights a and b and the stages j,

    n_j = n_0 + h sum_l a_jl n'_l                                                                    (1)
    r_j = r_0 + h sum_l a_jl r'_l,    m_j = m_0 + h sum_l a_jl m'_l                                  (2)
    h q'_j = sum_l (a^-1)_jl (q_l - q_0)                                                             (3)

n' is given, r' and m' need q and n, and q' needs q and m: so (1) and (2) are explicit. Newton's equations of (3) are solved for

    dq_j = D_j (phi, dn, dm, 1, dlambda)                                                             (4)

with the steps of y_0 and of the load factor; and behind the element

    n_1 = n_0 + h sum_l b_l n'_l,   r_1 and m_1 likewise,   q_1 = q_0 + sum_l (b a^-1)_l (q_l - q_0) (5)

Rows are worked on by four numbers at once, for the compiler's vectors.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.algebra import half_product, put_quaternion, quaternion, turn, vector
from darboux.kernels.fours import NOTHING, Four, four, four_plus, put_four
from darboux.kernels.gauss import inverse_weight, point, weight
from darboux.kernels.jit import allocating, inline, jit
from darboux.kernels.profile import Profile, columns, evaluate
from darboux.kernels.rod_equations import (
    DEAD_FORCE,
    DEAD_MOMENT,
    FORCE,
    FORCE_GRADIENT,
    MOMENT,
    POSITION,
    ROTATION,
    STATES,
    UNIT,
    WIDTH,
    section,
    write_derivative,
    write_jacobian,
    write_rate,
)
from darboux.kernels.system import FREE, M_, N_, PHI, R_, ROW, SIDES, System

Array = NDArray[np.float64]

LINE = 12  # columns that a row carries along: those of (4), and one that is empty
C_PHI, C_N, C_M, C_SIDE = 0, 3, 6, 9  # where they begin
SQUARE = STATES * STATES


class Bench(NamedTuple):
    """Where an element is worked on; rows of LINE numbers are affine in the columns of (4)."""

    c: Array  # (stages, WIDTH), the coefficients at the stages
    rate: Array  # their rates
    g: Array  # (stages, 2, 13), the slopes, and how they change with the load factor at a fixed state
    J: Array  # (stages, 13, 13), their Jacobians
    Q: Array  # (4, 3), dq_0 by phi
    slopes: Array  # (stages, 6, LINE), r' and m' less the part of dq
    moment: Array  # (3, LINE), dm at a stage, likewise
    V: Array  # (4 stages, 4 stages + LINE), Newton's equations of (3)
    end: Array  # (10, LINE), dr, dq and dm of (5)
    piece: NDArray[
        np.int64
    ]  # the piece of the table that was found last, and those of which c and rate are (1 + stages,)


@allocating
def bench(stages: int) -> Bench:
    """Return an empty one for elements of so many stages."""
    s = stages
    return Bench(
        np.empty(s * WIDTH),
        np.empty(s * WIDTH),
        np.empty(s * 2 * STATES),
        np.zeros(s * SQUARE),
        np.empty(12),
        np.empty(s * 6 * LINE),
        np.empty(3 * LINE),
        np.empty(4 * s * (4 * s + LINE)),
        np.empty(10 * LINE),
        np.full(s + 1, -1),
    )


@inline
def acts(table: Profile, first: int, end: int) -> bool:
    """Whether any of these columns differs from zero anywhere."""
    width = columns(table)
    for k in range(0, table.coefficients.size, width):
        for j in range(first, end):
            if table.coefficients[k + j] != 0.0:
                return True
    return False


@inline
def is_explicit(system: System) -> bool:
    """Whether n' depends on neither r nor q, and k and v on one of n and m each."""
    of_shape = system.shaped.size > 0 or acts(system.table, FORCE_GRADIENT, DEAD_MOMENT)
    return columns(system.table) == WIDTH and not of_shape


@inline
def _explicit(system: System, i: int, s: int, at: Bench) -> None:
    """(1) and (2): write n, r and m of the stages, from the states of the node and the stages' q, and the slopes there."""
    y, Y, h, first = i * STATES, i * s * STATES, system.x[i + 1] - system.x[i], system.x[i]
    piece, breaks = max(at.piece[0], 0), system.table.breaks
    for l in range(s):
        x = first + h * point(s, l)
        while piece < breaks.size - 2 and breaks[piece + 1] <= x:
            piece += 1
        while piece > 0 and breaks[piece] > x:
            piece -= 1
        if piece != at.piece[l + 1] or system.table.degree > 0:
            evaluate(system.table, piece, x, at.c[l * WIDTH : (l + 1) * WIDTH])
            evaluate(system.rate, piece, x, at.rate[l * WIDTH : (l + 1) * WIDTH])
            at.piece[l + 1] = piece
    at.piece[0] = piece
    for j in range(s):
        for a in range(3):
            n = system.y[y + FORCE + a]
            for l in range(s):
                n -= h * weight(s, j, l) * at.c[l * WIDTH + DEAD_FORCE + a]
            system.Y[Y + j * STATES + FORCE + a] = n
    for l in range(s):
        write_derivative(system.Y, Y + l * STATES, at.c[l * WIDTH : (l + 1) * WIDTH], at.g, 2 * l * STATES, 1)
    for j in range(s):
        for a in range(3):
            r, m = system.y[y + POSITION + a], system.y[y + MOMENT + a]
            for l in range(s):
                r += h * weight(s, j, l) * at.g[2 * l * STATES + POSITION + a]
                m += h * weight(s, j, l) * at.g[2 * l * STATES + MOMENT + a]
            system.Y[Y + j * STATES + POSITION + a] = r
            system.Y[Y + j * STATES + MOMENT + a] = m


@inline
def _linearise(system: System, i: int, s: int, at: Bench) -> None:
    """Write q' of the stages, the Jacobians, and what the load factor changes in n, r' and m' at a fixed q."""
    h = system.x[i + 1] - system.x[i]
    for l in range(s):
        y, g = (i * s + l) * STATES, 2 * l * STATES
        c, rate = at.c[l * WIDTH : (l + 1) * WIDTH], at.rate[l * WIDTH : (l + 1) * WIDTH]
        x = section(system.Y, y, c)
        put_quaternion(at.g, g + ROTATION, 1, half_product(x.q, x.k))
        write_rate(system.Y, y, rate, at.g, g + STATES)
        write_jacobian(system.Y, y, c, at.J[l * SQUARE : (l + 1) * SQUARE])
    for l in range(s):
        for part in range(2):
            of = POSITION if part == 0 else MOMENT
            for a in range(3):
                row, J = (6 * l + 3 * part + a) * LINE, l * SQUARE + (of + a) * STATES + FORCE
                value = at.g[(2 * l + 1) * STATES + of + a]
                for b in range(3):
                    n = 0.0  # of the load factor's, at this stage
                    for k in range(s):
                        n += h * weight(s, l, k) * at.g[(2 * k + 1) * STATES + FORCE + b]
                    value += at.J[J + b] * n
                for k in range(LINE):
                    at.slopes[row + k] = 0.0
                for b in range(3):
                    at.slopes[row + C_N + b] = at.J[J + b]
                at.slopes[row + C_SIDE + 1] = value


@inline
def _write_rows(system: System, i: int, s: int, at: Bench) -> None:
    """(3): Newton's equations of the stages' quaternions, h dq'_j - sum_l (a^-1)_jl (dq_l - dq_0), and their residuals."""
    h, width, V, J = system.x[i + 1] - system.x[i], 4 * s + LINE, at.V, at.J
    for j in range(s):
        _write_moment(h, j, s, at)
        for a in range(4):
            of_j, row = j * SQUARE + (ROTATION + a) * STATES, (4 * j + a) * width
            g0, g1, g2 = h * J[of_j + MOMENT], h * J[of_j + MOMENT + 1], h * J[of_j + MOMENT + 2]
            sums, residual = 0.0, h * at.g[2 * j * STATES + ROTATION + a]
            for k in range(s):
                f, M = h * weight(s, j, k), k * SQUARE + MOMENT * STATES + ROTATION
                put_four(V, row + 4 * k, _combined(f * g0, f * g1, f * g2, J, M, STATES))
                of = inverse_weight(s, j, k)
                V[row + 4 * k + a] -= of
                sums += of
                residual -= of * (system.Y[(i * s + k) * STATES + ROTATION + a] - system.y[i * STATES + ROTATION + a])
            put_four(V, row + 4 * j, four_plus(four(V, row + 4 * j), h, four(J, of_j + ROTATION)))
            line = row + 4 * s
            for k in range(0, LINE, 4):
                put_four(V, line + k, _combined(g0, g1, g2, at.moment, k, LINE))
            for b in range(3):
                V[line + C_PHI + b] += sums * at.Q[3 * a + b]
            V[line + C_SIDE] += residual
            V[line + C_SIDE + 1] += h * at.g[(2 * j + 1) * STATES + ROTATION + a]


@inline
def _combined(a: float, b: float, c: float, x: Array, i: int, step: int) -> Four:
    """The sum of three rows of x, of which four numbers count."""
    return four_plus(four_plus(four_plus(NOTHING, a, four(x, i)), b, four(x, i + step)), c, four(x, i + 2 * step))


@inline
def _write_moment(h: float, j: int, s: int, at: Bench) -> None:
    """dm of stage j, or of the node behind for j = s, less the part of dq."""
    for a in range(3):
        for k in range(0, LINE, 4):
            dm = NOTHING
            for l in range(s):
                dm = four_plus(dm, h * weight(s, j, l), four(at.slopes, (6 * l + 3 + a) * LINE + k))
            put_four(at.moment, a * LINE + k, dm)
        at.moment[a * LINE + C_M + a] += 1.0


@inline
def _solve_rows(V: Array, unknowns: int, width: int) -> None:
    """Solve for the unknowns by Gauss' elimination with the largest pivot of each column: in the last columns."""
    for k in range(unknowns):
        pivot, row = k, k * width
        for i in range(k + 1, unknowns):
            if abs(V[i * width + k]) > abs(V[pivot * width + k]):
                pivot = i
        if pivot != k:
            for j in range(0, width, 4):
                here, there = four(V, row + j), four(V, pivot * width + j)
                put_four(V, row + j, there)
                put_four(V, pivot * width + j, here)
        over = 1.0 / V[row + k]
        for i in range(k + 1, unknowns):
            factor = -over * V[i * width + k]
            for j in range(0, width, 4):
                put_four(V, i * width + j, four_plus(four(V, i * width + j), factor, four(V, row + j)))
    for k in range(unknowns - 1, -1, -1):
        row = k * width
        over = 1.0 / V[row + k]
        for j in range(unknowns, width, 4):
            put_four(V, row + j, four_plus(NOTHING, over, four(V, row + j)))
        for i in range(k):
            factor = -V[i * width + k]
            for j in range(unknowns, width, 4):
                put_four(V, i * width + j, four_plus(four(V, i * width + j), factor, four(V, row + j)))


@jit
def _solve(V: Array, stages: int) -> None:
    """Solve Newton's equations of the stages: with constant sizes the compiler uses vectors."""
    if stages == 2:
        _solve_rows(V, 8, 8 + LINE)
    elif stages == 4:
        _solve_rows(V, 16, 16 + LINE)
    else:
        _solve_rows(V, 4 * stages, 4 * stages + LINE)


@inline
def _write_end(system: System, i: int, s: int, at: Bench) -> None:
    """(5) by (4): the steps of r, q and m behind the element, less what the states there fall short of."""
    h, width, E, y, J = system.x[i + 1] - system.x[i], 4 * s + LINE, at.end, i * STATES, at.J
    _write_moment(h, s, s, at)
    for a in range(3):
        for k in range(0, LINE, 4):
            dr, dm = NOTHING, four(at.moment, a * LINE + k)
            for l in range(s):
                f, V, of = h * weight(s, s, l), 4 * l * width + 4 * s + k, l * SQUARE + a * STATES + ROTATION
                dr = four_plus(dr, f, four(at.slopes, (6 * l + a) * LINE + k))
                for b in range(4):
                    dq = four(at.V, V + b * width)
                    dr = four_plus(dr, -f * J[of + POSITION * STATES + b], dq)
                    dm = four_plus(dm, -f * J[of + MOMENT * STATES + b], dq)
            put_four(E, a * LINE + k, dr)
            put_four(E, (7 + a) * LINE + k, dm)
        for l in range(s):
            f, g = h * weight(s, s, l), 2 * l * STATES
            E[a * LINE + C_SIDE] += f * at.g[g + POSITION + a]
            E[(7 + a) * LINE + C_SIDE] += f * at.g[g + MOMENT + a]
        E[a * LINE + C_SIDE] += system.y[y + POSITION + a] - system.y[y + STATES + POSITION + a]
        E[(7 + a) * LINE + C_SIDE] += system.y[y + MOMENT + a] - system.y[y + STATES + MOMENT + a]
    for a in range(4):
        for k in range(0, LINE, 4):
            dq = NOTHING
            for l in range(s):
                dq = four_plus(dq, -inverse_weight(s, s, l), four(at.V, (4 * l + a) * width + 4 * s + k))
            put_four(E, (3 + a) * LINE + k, dq)
        rest, gap = 1.0, system.y[y + ROTATION + a] - system.y[y + STATES + ROTATION + a]
        for l in range(s):
            f = inverse_weight(s, s, l)
            rest -= f
            gap += f * (system.Y[(i * s + l) * STATES + ROTATION + a] - system.y[y + ROTATION + a])
        for b in range(3):
            E[(3 + a) * LINE + C_PHI + b] += rest * at.Q[3 * a + b]
        E[(3 + a) * LINE + C_SIDE] += gap


@inline
def _write_transfer(system: System, i: int, s: int, at: Bench, T: Array) -> None:
    """Write the rows [T_i, -1, -gap, -d gap / d load factor] of (5), with the small rotation phi behind the element."""
    h, y, E = system.x[i + 1] - system.x[i], i * STATES, at.end
    q1 = quaternion(system.y, y + STATES + ROTATION)
    for k in range(FREE * ROW):
        T[k] = 0.0
    for row in range(FREE):
        T[row * ROW + FREE + row] = -1.0
    for a in range(3):
        T[(R_ + a) * ROW + R_ + a] = T[(N_ + a) * ROW + N_ + a] = 1.0
        gap, rate = system.y[y + FORCE + a] - system.y[y + STATES + FORCE + a], 0.0
        for l in range(s):
            f = h * weight(s, s, l)
            gap += f * at.g[2 * l * STATES + FORCE + a]
            rate += f * at.g[(2 * l + 1) * STATES + FORCE + a]
        T[(N_ + a) * ROW + 2 * FREE] = -gap
        T[(N_ + a) * ROW + 2 * FREE + 1] = -rate
    for k in range(LINE - 1):
        column, sign = (PHI + k, 1.0) if k < C_SIDE else (2 * FREE + k - C_SIDE, -1.0)
        phi = turn(q1, (E[3 * LINE + k], E[4 * LINE + k], E[5 * LINE + k], E[6 * LINE + k]))
        for a in range(3):
            T[(R_ + a) * ROW + column] = sign * E[a * LINE + k]
            T[(PHI + a) * ROW + column] = sign * phi[a]
            T[(M_ + a) * ROW + column] = sign * E[(7 + a) * LINE + k]


@jit
def write_element(system: System, i: int, at: Bench, T: Array) -> None:
    """Write an element's rows [T_i, -1, -gap, -d gap / d load factor], (12 x ROW,), and keep D on the bench.

    n, r and m of its stages are written too.
    """
    s = system.stages
    q0 = quaternion(system.y, i * STATES + ROTATION)
    for b in range(3):
        put_quaternion(at.Q, b, 3, half_product(q0, vector(UNIT, 3 - b)))
    _explicit(system, i, s, at)
    _linearise(system, i, s, at)
    _write_rows(system, i, s, at)
    _solve(at.V, s)
    _write_end(system, i, s, at)
    _write_transfer(system, i, s, at, T)


@inline
def keep(at: Bench, stages: int, kept: Array) -> None:
    """Write the D of the element on the bench: kept (4 stages x LINE,)."""
    for row in range(4 * stages):
        for k in range(LINE):
            kept[row * LINE + k] = -at.V[row * (4 * stages + LINE) + 4 * stages + k]


@inline
def write_steps(kept: Array, delta: Array, change: float, dq: Array) -> None:
    """(4): write the steps of an element's stages, (stages x 4,), by its D, for a change of the load factor.

    delta (12 x SIDES,), the first side of which is the step of the node before the element.
    """
    for row in range(kept.size // LINE):
        value = kept[row * LINE + C_SIDE] + change * kept[row * LINE + C_SIDE + 1]
        for k in range(C_SIDE):
            value += kept[row * LINE + k] * delta[(PHI + k) * SIDES]
        dq[row] = value


@inline
def write_stages(system: System, i: int, at: Bench) -> None:
    """(1) and (2): write n, r and m of an element's stages."""
    _explicit(system, i, system.stages, at)
