"""How the collocation equations of a mesh change with anything: with its unknowns, with slopes at stages, with parameters.

With T_i as in (3) of `collocation`, and with the response W_i of an element's gap to slopes g_l at its stages,

    d gap_i = T_i delta_i - delta_i+1 + sum_l W_il dg_l                                              (1)

The stages are eliminated: W_i holds what they do. A parameter p acts through coefficients c, in which g is affine, through loads
f, l that are functions of the shape, and through the width h of an element, as (1), (2) of `collocation` hold h g alone:

    dg_l / dp = g(y; dc/dp) - g(y; 0) - lambda (0, 0, df/dp, dl/dp) + (h' / h) g(y; c)               (2)

The conditions of a support, a change du of its numbers and dy of the state give in differences of order 8 along both,

    d values = 1/t sum_k w_k (values(u + k t du, y + k t dy) - values(u - k t du, y - k t dy))       (3)

in which t is so small that axes, frames and turns change by a hundredth at most; all else enters as a polynomial.

References: B. Fornberg, Math. Comp. 51 (1988) 699, table 1 (the weights w).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.algebra import half_product, put_quaternion, quaternion, turn, vector
from darboux.kernels.bordered import HALF, Matrix
from darboux.kernels.collocation import BEGIN, M, N, Plan, Q, R, _condense, _eliminate, _linearise, _planned, _row
from darboux.kernels.gauss import weight
from darboux.kernels.jit import allocating, inline, jit
from darboux.kernels.rod_equations import FORCE, POSITION, ROTATION, STATES, UNIT, write_rate
from darboux.kernels.support import (
    CONDITIONS,
    FRAME,
    FRAME_RATE,
    GROOVE,
    LINEAR,
    NUMBERS,
    PLACE_RATE,
    SLIDING_AXES,
    SPRUNG,
    conditions,
    joint,
    values,
)
from darboux.kernels.support import ROW as OF_CONDITIONS
from darboux.kernels.system import FREE, M_, N_, PHI, R_, SIDES, System

Array = NDArray[np.float64]

TURNED = 0.01  # by how much axes, frames and turns change at most, in differences of order 8: exact to rounding
ORDER_8 = np.array([4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0])
LOADS = 6  # f and l, of a load that is a function of the shape


class Rates(NamedTuple):
    """How what a mesh's equations hold changes with P parameters, flat."""

    c: Array  # (P, N, stages, columns), the coefficients at Gauss' points; nothing at joints
    widths: Array  # (P, N), h' / h; 0 at joints
    shaped: Array  # (P, N, stages, 6), f and l of loads that are functions of the shape, at fixed states; or none
    supports: Array  # (P, supports, NUMBERS), the numbers of what holds the rod, in their order along it


@inline
def _begin(system: System, i: int, plan: Plan, answers: int) -> None:
    """Write the right sides of (1) and (2) of `collocation`: a step of the start, and unit slopes at the stages where asked for."""
    X, width, count = plan.X, plan.width, plan.stages
    q = quaternion(system.y, i * STATES + ROTATION)
    X[:] = 0.0
    for j in range(count + 1):
        for part, unknown in ((R, R_), (N, N_), (M, M_)):
            for a in range(3):
                X[(_row(plan, part, j) + a) * width + plan.unknowns + unknown + a] = 1.0
        for a in range(3):
            at = _row(plan, Q, j) * width + plan.unknowns + PHI + a
            put_quaternion(X, at, width, half_product(q, vector(UNIT, 3 - a)))
    if answers > 0:
        _add_unit_slopes(plan, system.x[i + 1] - system.x[i])


@jit
def _add_unit_slopes(plan: Plan, h: float) -> None:
    """A slope of 1 at stage l, in one number of the state, moves stage j by h a_jl, and y_i+1 by h b_l."""
    for part in range(4):
        for a in range(4 if part == Q else 3):
            for l in range(plan.stages):
                side = plan.unknowns + FREE + l * STATES + BEGIN[part] + a
                for j in range(plan.stages + 1):
                    plan.X[(_row(plan, part, j) + a) * plan.width + side] = h * weight(plan.stages, j, l)


@jit
def _respond(system: System, i: int, plan: Plan, start: Array, answers: int, out: Array) -> None:
    """(1): write how the gap changes with the first node's step and the slopes, and the gap: rows (12 x 12 + answers + SIDES,)."""
    X, width, count, unknowns = plan.X, plan.width, plan.stages, plan.unknowns
    for k in range(STATES):
        start[k] = system.y[i * STATES + k]
    _begin(system, i, plan, answers)
    _linearise(system, i, plan)
    _condense(system, i, start, plan)
    _eliminate(X[plan.explicit * count * width :], unknowns, unknowns, unknowns + STATES, width)
    following, sides = quaternion(system.y, (i + 1) * STATES + ROTATION), FREE + answers + SIDES
    r, q, n, m = _row(plan, R, count), _row(plan, Q, count), _row(plan, N, count), _row(plan, M, count)
    for k in range(sides):
        at = unknowns + k
        dq = X[q * width + at], X[(q + 1) * width + at], X[(q + 2) * width + at], X[(q + 3) * width + at]
        phi = turn(following, dq)
        for a in range(3):
            out[(R_ + a) * sides + k] = X[(r + a) * width + at]
            out[(PHI + a) * sides + k] = phi[a]
            out[(N_ + a) * sides + k] = X[(n + a) * width + at]
            out[(M_ + a) * sides + k] = X[(m + a) * width + at]


@allocating
def _place(out: Array, i: int, answers: int, matrix: Matrix, sides: Array, response: Array) -> None:
    """Put an element's rows where they belong."""
    width = FREE + answers + SIDES
    for row in range(FREE):
        block, of = (i * FREE + row) * 2 * FREE, row * width
        matrix.blocks[block : block + FREE] = out[of : of + FREE]
        matrix.blocks[block + FREE : block + 2 * FREE] = 0.0
        matrix.blocks[block + FREE + row] = -1.0
        answer = (i * FREE + row) * answers
        response[answer : answer + answers] = out[of + FREE : of + FREE + answers]
        for side in range(SIDES):
            sides[(HALF + i * FREE + row) * SIDES + side] = -out[of + FREE + answers + side]


@allocating
def _place_joint(out: Array, i: int, answers: int, matrix: Matrix, sides: Array, response: Array) -> None:
    """Put a joint's rows (12 x 26,) where they belong."""
    for row in range(FREE):
        block, of = (i * FREE + row) * 2 * FREE, row * (2 * FREE + SIDES)
        matrix.blocks[block : block + 2 * FREE] = out[of : of + 2 * FREE]
        for side in range(SIDES):
            sides[(HALF + i * FREE + row) * SIDES + side] = out[of + 2 * FREE + side]
    response[i * FREE * answers : (i + 1) * FREE * answers] = 0.0


@jit
def _small_enough(du: Array, delta: Array) -> float:
    """The t of (3)."""
    largest = 0.0
    for k in range(SLIDING_AXES, LINEAR):
        largest = max(largest, abs(du[k]))
    for k in range(FRAME, PLACE_RATE):
        largest = max(largest, abs(du[k]))
    for k in range(PHI, N_):
        largest = max(largest, abs(delta[k]))
    return TURNED / largest if largest > 0.0 else 1.0


@allocating
def change_of_values(
    support: Array, du: Array, y: Array, delta: Array, load_factor: float, by_factor: float, out: Array
) -> None:
    """(3), with a change of the load factor too: out (6,).

    du (NUMBERS,) of the support's numbers; delta (12,) of the unknowns at the state y (13,).
    """
    t, moved, shifted, found = _small_enough(du, delta), y.copy(), support.copy(), np.empty(CONDITIONS)
    dq = half_product(quaternion(y, ROTATION), vector(delta, PHI))
    out[:] = 0.0
    for k in range(1, ORDER_8.size + 1):
        for sign in (1.0, -1.0):
            by = sign * k * t
            for a in range(NUMBERS):
                shifted[a] = support[a] + by * du[a]
            for a in range(3):
                moved[POSITION + a] = y[POSITION + a] + by * delta[R_ + a]
            for a in range(4):
                moved[ROTATION + a] = y[ROTATION + a] + by * dq[a]
            for a in range(6):
                moved[FORCE + a] = y[FORCE + a] + by * delta[N_ + a]
            values(shifted, moved, load_factor + by * by_factor, found)
            for row in range(CONDITIONS):
                out[row] += sign * ORDER_8[k - 1] / t * found[row]


@allocating
def _sharpen(support: Array, y: Array, load_factor: float, own: Array) -> None:
    """Write the rows of a groove or of a spring that turns anew, which `conditions` takes by differences of order 2."""
    if support[GROOVE] == 0.0 and support[SPRUNG] == 0.0:
        return
    du, delta, change = np.zeros(NUMBERS), np.zeros(FREE), np.empty(CONDITIONS)
    for k in range(FREE + 1):
        if k < FREE:
            delta[k] = 1.0
        else:
            du[FRAME - 3 : PLACE_RATE] = support[PLACE_RATE : FRAME_RATE + 4]
        change_of_values(support, du, y, delta, load_factor, 0.0 if k < FREE else 1.0, change)
        for row in range(CONDITIONS):
            own[row * OF_CONDITIONS + (k if k < FREE else FREE + 1)] = change[row] if k < FREE else -change[row]
        delta[:] = 0.0


@allocating
def _at_joint(system: System, i: int) -> Array:
    """The state whose conditions are those of a joint: with the jumps of n and m for both."""
    y = system.y[i * STATES : (i + 1) * STATES].copy()
    for k in range(FORCE, STATES):
        y[k] -= system.y[(i + 1) * STATES + k]
    return y


@allocating
def _write_joint(system: System, i: int, support: Array, out: Array) -> None:
    """Write the twelve equations of a joint, (12 x 26,)."""
    here, width, own = i * STATES, 2 * FREE + SIDES, np.empty(CONDITIONS * OF_CONDITIONS)
    before, behind = system.y[here : here + STATES], system.y[here + STATES : here + 2 * STATES]
    joint(support, before, behind, system.load_factor, out)
    for row in range(CONDITIONS):
        for k in range(FREE):
            own[row * OF_CONDITIONS + k] = out[(HALF + row) * width + k]
        for k in range(SIDES):
            own[row * OF_CONDITIONS + FREE + k] = out[(HALF + row) * width + 2 * FREE + k]
    _sharpen(support, _at_joint(system, i), system.load_factor, own)
    for row in range(CONDITIONS):
        for k in range(FREE):
            out[(HALF + row) * width + k] = own[row * OF_CONDITIONS + k]
            out[(HALF + row) * width + FREE + k] = -own[row * OF_CONDITIONS + k] if k >= N_ else 0.0
        for k in range(SIDES):
            out[(HALF + row) * width + 2 * FREE + k] = own[row * OF_CONDITIONS + FREE + k]


@allocating
def _write_end(support: Array, y: Array, load_factor: float, rows: Array, sides: Array) -> None:
    """Write the six conditions of an end, rows (6 x 12,) and sides (6 x SIDES,)."""
    own = np.empty(CONDITIONS * OF_CONDITIONS)
    conditions(support, y, load_factor, own)
    _sharpen(support, y, load_factor, own)
    for row in range(CONDITIONS):
        rows[row * FREE : (row + 1) * FREE] = own[row * OF_CONDITIONS : row * OF_CONDITIONS + FREE]
        sides[row * SIDES : (row + 1) * SIDES] = own[row * OF_CONDITIONS + FREE : (row + 1) * OF_CONDITIONS]


@allocating
def linearise(system: System, supports: Array, matrix: Matrix, sides: Array, response: Array) -> None:
    """Write the matrix of a mesh, its right sides, and how each element's gap answers to the slopes at its stages.

    supports (those of the start, of each station, of the end, NUMBERS each). Out: matrix; sides (12 (N + 1), SIDES), minus the
    residual and minus its derivative by the load factor, row by row as in (1) of `bordered`; response (N, 12, 13 stages), zero at
    joints, or none where it is not asked for.
    """
    answers = STATES * system.stages if response.size > 0 else 0
    plan, start = _planned(system, system.stages, FREE + answers + SIDES), np.empty(STATES)
    out, of_joint = np.empty(FREE * (FREE + answers + SIDES)), np.empty(FREE * (2 * FREE + SIDES))
    elements, station = system.x.size - 1, 0
    _write_end(supports[:NUMBERS], system.y[:STATES], system.load_factor, matrix.start, sides)
    for i in range(elements):
        if system.x[i + 1] > system.x[i]:
            _respond(system, i, plan, start, answers, out)
            _place(out, i, answers, matrix, sides, response)
        else:
            station += 1
            _write_joint(system, i, supports[station * NUMBERS : (station + 1) * NUMBERS], of_joint)
            _place_joint(of_joint, i, answers, matrix, sides, response)
    last = supports[supports.size - NUMBERS :]
    rest = sides[(HALF + elements * FREE) * SIDES :]
    _write_end(last, system.y[elements * STATES :], system.load_factor, matrix.end, rest)


@jit
def _write_slopes(system: System, rates: Rates, at: int, by_width: float, plan: Plan, dg: Array) -> None:
    """(2) at the stages of an element, whose first stage is number `at` among those of all parameters: dg (stages, 13)."""
    stages = system.stages
    width, first = plan.c.size // 2, (at % (system.Y.size // STATES)) * STATES
    for l in range(stages):
        c = rates.c[(at + l) * width : (at + l + 1) * width]
        write_rate(system.Y, first + l * STATES, c, dg, l * STATES)
        for a in range(STATES):
            dg[l * STATES + a] += by_width * plan.g[l * SIDES * STATES + a]
        if rates.shaped.size > 0:
            for a in range(LOADS):
                dg[l * STATES + FORCE + a] -= system.load_factor * rates.shaped[(at + l) * LOADS + a]


@allocating
def _write_support(system: System, i: int, support: Array, du: Array, joined: bool, change: Array) -> None:
    """Write how the conditions at node i change with du, of the support's numbers: those of a joint, or of an end."""
    y = _at_joint(system, i) if joined else system.y[i * STATES : (i + 1) * STATES].copy()
    change_of_values(support, du, y, np.zeros(FREE), system.load_factor, 0.0, change)


@allocating
def right_sides(system: System, supports: Array, response: Array, rates: Rates, out: Array) -> None:
    """Write minus the derivatives of a mesh's equations by P parameters: out (12 (N + 1), P), row by row as `linearise`.

    At an equilibrium; elsewhere what the response itself does is missing. supports and response as for and from `linearise`.
    """
    elements, stages = system.x.size - 1, system.stages
    count, answers = rates.widths.size // elements, STATES * stages
    plan, dg, change = _planned(system, system.stages, SIDES), np.empty(answers), np.empty(CONDITIONS)
    places = supports.size // NUMBERS
    station = 0
    for i in range(elements + 1):
        joined = i < elements and system.x[i + 1] == system.x[i]
        if i < elements and not joined:
            _linearise(system, i, plan)
            for p in range(count):
                _write_slopes(system, rates, (p * elements + i) * stages, rates.widths[p * elements + i], plan, dg)
                for row in range(FREE):
                    total, of = 0.0, (i * FREE + row) * answers
                    for k in range(answers):
                        total += response[of + k] * dg[k]
                    out[(HALF + i * FREE + row) * count + p] = -total
        if i == 0 or joined or i == elements:
            support = supports[station * NUMBERS : (station + 1) * NUMBERS]
            first = 0 if i == 0 else HALF + i * FREE + (HALF if joined else 0)
            for p in range(count):
                du = rates.supports[(p * places + station) * NUMBERS : (p * places + station + 1) * NUMBERS]
                _write_support(system, i, support, du, joined, change)
                for row in range(CONDITIONS):
                    out[(first + row) * count + p] = -change[row]
                    if joined:
                        out[(first - HALF + row) * count + p] = 0.0
            station += 1
