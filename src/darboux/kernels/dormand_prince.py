"""Initial value problems of rods by the method of Dormand and Prince, order 5(4), with adaptive steps.

A step never crosses a break of the coefficients: it lands on it and goes on with the next piece. Outputs come from
the continuous extension of order 4. The error of a step is measured by the lengths of the vectors r, q, n, m, so
that neither the axes nor |q| matter. Sensitivities are the exact derivative of the discrete map, steps held fixed.

References:
    J. R. Dormand, P. J. Prince, A family of embedded Runge-Kutta formulae, J. Comput. Appl. Math. 6 (1980) 19-26.
    E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., Springer 1993,
    sections II.4 (first step, step control) and II.6 (continuous extension).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.jit import allocating, inline
from darboux.kernels.profile import Profile, evaluate, piece_at
from darboux.kernels.rod_equations import (
    FORCE,
    MOMENT,
    POSITION,
    ROTATION,
    STATES,
    WIDTH,
    jacobian_times,
    write_derivative,
    write_jacobian,
)

Array = NDArray[np.float64]
Counts = NDArray[np.int64]
Report = tuple[int, int, int, int]  # status, steps accepted, steps rejected, evaluations of the derivative

OK, TOO_MANY_STEPS, STEP_TOO_SMALL, NOT_FINITE = 0, 1, 2, 3

# The method: nodes c_i; weights a_ij, of which the last row is the solution's too; the error's weights; and the
# weights of the highest term of the continuous extension.
NODES = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
A21 = 1 / 5
A31, A32 = 3 / 40, 9 / 40
A41, A42, A43 = 44 / 45, -56 / 15, 32 / 9
A51, A52, A53, A54 = 19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729
A61, A62, A63, A64, A65 = 9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656
A71, A73, A74, A75, A76 = 35 / 384, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84
E1, E3, E4, E5, E6, E7 = 71 / 57600, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40
D1, D3, D4 = -12715105075 / 11282082432, 87487479700 / 32700410799, -10690763975 / 1880347072
D5, D6, D7 = 701980252875 / 199316789632, -1453857185 / 822651844, 69997945 / 29380423

# Step control: the next step is SAFETY error^-EXPONENT previous^BETA times this one, within bounds.
SAFETY, BETA = 0.9, 0.04
EXPONENT = 1 / 5 - 0.75 * BETA
SHRINK, GROW = 0.2, 10.0
LEAST_ERROR = 1e-4  # a lucky step does not make the next one timid
STRETCH = 1.01  # rather one step a little longer than a sliver after it
SMALLEST = 16 * 2.0**-52  # steps shorter than this fraction of s are lost in rounding
GROUPS = np.array([POSITION, ROTATION, FORCE, MOMENT, STATES])
TINY = 1e-300  # 0 / 0 for a vector that is zero and whose tolerance is zero

# The workspace: the state at the step's start and at a stage, two rows more, the slopes, and scalars. The seven slopes
# of one component lie side by side: what one slope writes, the next stage reads number by number, which processors
# forward at once, while a vector that spans fresh scalars has to wait for them.
STATE, STAGE, ERROR, EXTENSION, SLOPES = 0, STATES, 2 * STATES, 3 * STATES, 7 * STATES
APART = 8
S, S_NEW, H, PROPOSAL, PREVIOUS, WORK = 200, 201, 202, 203, 204, 208
PIECE, STEPS, REJECTED, EVALUATIONS, COUNTS = 0, 1, 2, 3, 4

# The workspace of the sensitivity: 13 rows, padded to whole vectors, of the matrix at the step's start and at a stage,
# the slope there (at a fixed place, so that the compiler sees that nothing overlaps and uses vectors), and six slopes.
ROW = 16
MATRIX = STATES * ROW
PHI, PHI_STAGE, PHI_SLOPE, PHI_SLOPES, PHI_WORK = 0, MATRIX, 2 * MATRIX, 3 * MATRIX, 9 * MATRIX


@inline
def _stage(w: Array, y: int, k: int, size: int, along: int, apart: int, i: int, h: float, out: int) -> None:
    """w[out + x] = w[y + x] + h sum_j a_ij k_j[x], for stage i = 2, ..., 7, with k_j[x] = w[k + x along + j apart]."""
    for x in range(size):
        k1 = k + x * along
        k2, k3, k4, k5, k6 = k1 + apart, k1 + 2 * apart, k1 + 3 * apart, k1 + 4 * apart, k1 + 5 * apart
        if i == 2:
            slope = A21 * w[k1]
        elif i == 3:
            slope = A31 * w[k1] + A32 * w[k2]
        elif i == 4:
            slope = A41 * w[k1] + A42 * w[k2] + A43 * w[k3]
        elif i == 5:
            slope = A51 * w[k1] + A52 * w[k2] + A53 * w[k3] + A54 * w[k4]
        elif i == 6:
            slope = A61 * w[k1] + A62 * w[k2] + A63 * w[k3] + A64 * w[k4] + A65 * w[k5]
        else:
            slope = A71 * w[k1] + A73 * w[k3] + A74 * w[k4] + A75 * w[k5] + A76 * w[k6]
        w[out + x] = w[y + x] + h * slope


@inline
def _slope(w: Array, c: Array, profile: Profile, p: int, s: float, k: int) -> None:
    """The slope y'(s) of the state in the stage, into w[k], w[k + APART], ...."""
    if profile.degree > 0:
        evaluate(profile, p, s, c)
    write_derivative(w, STAGE, c, w, k, APART)


@inline
def _trial_step(w: Array, c: Array, profile: Profile, p: int, h: float) -> None:
    """The slopes k_2, ..., k_7 of a step h from the state and its slope k_1; the last stage is the new state."""
    if profile.degree == 0:  # nothing comes between the stages: the compiler unrolls them
        for i in range(2, 8):
            _stage(w, STATE, SLOPES, STATES, APART, 1, i, h, STAGE)
            write_derivative(w, STAGE, c, w, SLOPES + i - 1, APART)
    else:
        for i in range(2, 8):
            _stage(w, STATE, SLOPES, STATES, APART, 1, i, h, STAGE)
            _slope(w, c, profile, p, w[S] + NODES[i - 1] * h, SLOPES + i - 1)


@inline
def _scaled_norm(w: Array, x: int, along: int, rtol: float, atol: float) -> float:
    """Root mean square of |x_g| / (atol + rtol |y_g|) over g = r, n, m, and of |x_q| / ((atol + rtol) |q|).

    |y_g| is the larger one of the state and the stage.
    """
    total = 0.0
    for g in range(4):
        xx, yy, zz = 0.0, 0.0, 0.0
        for i in range(GROUPS[g], GROUPS[g + 1]):
            xx += w[x + i * along] * w[x + i * along]
            yy += w[STATE + i] * w[STATE + i]
            zz += w[STAGE + i] * w[STAGE + i]
        length = math.sqrt(max(yy, zz))
        scale = atol * (length if GROUPS[g] == ROTATION else 1.0) + rtol * length
        square = scale * scale + TINY
        total += (xx + 0.0 * square) / square  # beyond the largest number 0 inf makes it not a number, rather than 0
    return math.sqrt(0.25 * total)


@inline
def _error(w: Array, h: float, rtol: float, atol: float) -> float:
    """The scaled norm of h sum_j e_j k_j, the difference of the solutions of order 5 and 4."""
    for x in range(STATES):
        k = SLOPES + x * APART
        slope = E1 * w[k] + E3 * w[k + 2] + E4 * w[k + 3] + E5 * w[k + 4] + E6 * w[k + 5] + E7 * w[k + 6]
        w[ERROR + x] = h * slope
    error: float = _scaled_norm(w, ERROR, 1, rtol, atol)
    return error


@inline
def _first_step(w: Array, c: Array, profile: Profile, p: int, longest: float, rtol: float, atol: float) -> float:
    """Hairer's guess: min(100 h0, h1), h0 = 0.01 |y| / |y'|, h1^5 = 0.01 / max(|y'|, |y''|), y'' by Euler's step h0."""
    slope: float = _scaled_norm(w, SLOPES, APART, rtol, atol)
    h0: float = min(longest, 0.01 * _scaled_norm(w, STATE, 1, rtol, atol) / slope)
    for x in range(STATES):
        w[STAGE + x] = w[STATE + x] + h0 * w[SLOPES + x * APART]
    _slope(w, c, profile, p, w[S] + h0, SLOPES + 1)
    for x in range(STATES):
        w[ERROR + x] = (w[SLOPES + x * APART + 1] - w[SLOPES + x * APART]) / h0
    bend: float = _scaled_norm(w, ERROR, 1, rtol, atol)
    h1: float = (0.01 / max(slope, bend)) ** 0.2
    return min(longest, 100.0 * h0, h1)


@inline
def _enter(w: Array, c: Array, counts: Counts, profile: Profile, p: int) -> None:
    """Begin piece p of the coefficients: the slope at its start is the first of the next step."""
    counts[PIECE] = p
    counts[EVALUATIONS] += 1
    if profile.degree == 0:
        evaluate(profile, p, w[S], c)  # once for the whole piece
    for x in range(STATES):
        w[STAGE + x] = w[STATE + x]
    _slope(w, c, profile, p, w[S], SLOPES + 0)


@inline
def _begin(
    w: Array, c: Array, counts: Counts, profile: Profile, y0: Array, s0: float, s1: float, rtol: float, atol: float
) -> int:
    """Set out from y(s0) = y0 towards s1; return the status."""
    for x in range(STATES):
        w[STATE + x] = y0[x]
    w[S] = s0
    p = piece_at(profile.breaks, s0)
    _enter(w, c, counts, profile, p)
    if not math.isfinite(_scaled_norm(w, SLOPES, APART, rtol, atol)):
        return NOT_FINITE
    if s1 > s0:
        counts[EVALUATIONS] += 1
        w[PROPOSAL] = _first_step(w, c, profile, p, min(s1, profile.breaks[p + 1]) - s0, rtol, atol)
    w[PREVIOUS] = LEAST_ERROR
    return OK


@inline
def _next_step(
    w: Array, c: Array, counts: Counts, profile: Profile, s1: float, rtol: float, atol: float, max_steps: int
) -> int:
    """Try steps until one is accepted, from w[S] to w[S_NEW] <= s1, its result in the last stage; return the status."""
    if counts[STEPS] == max_steps:
        return TOO_MANY_STEPS
    end = min(s1, profile.breaks[counts[PIECE] + 1])
    status, most = STEP_TOO_SMALL, GROW
    while w[PROPOSAL] > SMALLEST * max(abs(w[S]), abs(end)):
        lands = STRETCH * w[PROPOSAL] >= end - w[S]
        h = end - w[S] if lands else w[PROPOSAL]
        _trial_step(w, c, profile, counts[PIECE], h)
        counts[EVALUATIONS] += 6
        error = _error(w, h, rtol, atol)
        if error <= 1.0:
            counts[STEPS] += 1
            growth = SAFETY * max(error, TINY) ** -EXPONENT * w[PREVIOUS] ** BETA
            grown = h * min(most, max(SHRINK, growth))
            w[PROPOSAL] = max(grown, w[PROPOSAL]) if h < w[PROPOSAL] else grown  # a cut step says nothing of the next
            w[PREVIOUS] = max(error, LEAST_ERROR)
            w[H], w[S_NEW] = h, end if lands else w[S] + h
            return OK
        counts[REJECTED] += 1
        finite = math.isfinite(error)
        status, most = STEP_TOO_SMALL if finite else NOT_FINITE, 1.0
        w[PROPOSAL] = h * (max(SHRINK, SAFETY * error**-EXPONENT) if finite else SHRINK)
    return status


@inline
def _accept(w: Array, c: Array, counts: Counts, profile: Profile, s1: float) -> None:
    """The end of this step is the start of the next: y, s and y', anew where a piece of the coefficients begins."""
    for x in range(STATES):
        w[STATE + x] = w[STAGE + x]
        w[SLOPES + x * APART] = w[SLOPES + x * APART + 6]
    w[S] = w[S_NEW]
    p = counts[PIECE] + 1
    if w[S] < s1 and w[S] >= profile.breaks[p]:
        _enter(w, c, counts, profile, p)


@inline
def _write_outputs(w: Array, outputs: Array, first: int, result: Array) -> int:
    """y(s + t h) = y + t (e1 + (1 - t) (e2 + t (e3 + (1 - t) e4))) at the outputs in this step; return the next one."""
    h, e1, e2, e3, e4 = w[H], EXTENSION, EXTENSION + STATES, EXTENSION + 2 * STATES, EXTENSION + 3 * STATES
    for x in range(STATES):
        k = SLOPES + x * APART
        rise = w[STAGE + x] - w[STATE + x]
        w[e1 + x] = rise
        w[e2 + x] = h * w[k] - rise
        w[e3 + x] = 2.0 * rise - h * (w[k] + w[k + 6])
        w[e4 + x] = h * (D1 * w[k] + D3 * w[k + 2] + D4 * w[k + 3] + D5 * w[k + 4] + D6 * w[k + 5] + D7 * w[k + 6])
    i = first
    while i < outputs.size and outputs[i] <= w[S_NEW]:
        t = (outputs[i] - w[S]) / h
        for x in range(STATES):
            inner = w[e2 + x] + t * (w[e3 + x] + (1.0 - t) * w[e4 + x])
            result[i * STATES + x] = w[STATE + x] + t * (w[e1 + x] + (1.0 - t) * inner)
        i += 1
    return i


@inline
def _write_node(w: Array, i: int, nodes: Array, states: Array, slopes: Array) -> None:
    """Node i of the mesh: s, y and y' at the start of the next step."""
    nodes[i] = w[S]
    for x in range(STATES):
        states[i * STATES + x] = w[STATE + x]
        slopes[i * STATES + x] = w[SLOPES + x * APART]


@inline
def _step_sensitivity(w: Array, c: Array, profile: Profile, p: int, phi: Array, J: Array) -> None:
    """Phi over the accepted step: the variational equations Phi' = J(y) Phi by the same stages."""
    h = w[H]
    for i in range(1, 7):
        if i == 1:
            for x in range(MATRIX):
                phi[PHI_STAGE + x] = phi[PHI + x]
            for x in range(STATES):
                w[ERROR + x] = w[STATE + x]
        else:
            _stage(phi, PHI, PHI_SLOPES, MATRIX, 1, MATRIX, i, h, PHI_STAGE)
            _stage(w, STATE, SLOPES, STATES, APART, 1, i, h, ERROR)
        if profile.degree > 0:
            evaluate(profile, p, w[S] + NODES[i - 1] * h, c)
        write_jacobian(w, ERROR, c, J)
        jacobian_times(J, phi, PHI_STAGE, ROW, phi, PHI_SLOPE)
        for x in range(MATRIX):
            phi[PHI_SLOPES + (i - 1) * MATRIX + x] = phi[PHI_SLOPE + x]
    _stage(phi, PHI, PHI_SLOPES, MATRIX, 1, MATRIX, 7, h, PHI)


@allocating
def integrate(
    y0: Array,
    outputs: Array,
    breaks: Array,
    coefficients: Array,
    degree: int,
    rtol: float,
    atol: float,
    max_steps: int,
    result: Array,
) -> Report:
    """Integrate from y(outputs[0]) = y0, and write y at the outputs.

    Args:
        y0: state at the start, (13,)
        outputs: ascending, (n,), within the breaks; the last is where the integration ends
        breaks, coefficients, degree: the coefficients c(s), as in `Profile`
        rtol, atol: what the error of one step may be, by vector, relative to its length and besides
        max_steps: how many steps may be accepted
        result: the states at the outputs, (n x 13,), written; after a failure only up to where it came

    Returns:
        status (0 ok, 1 too many steps, 2 step too small, 3 not finite), steps accepted, rejected, evaluations
    """
    w, c, counts = np.zeros(WORK), np.empty(WIDTH), np.zeros(COUNTS, np.int64)
    profile = Profile(breaks, coefficients, degree)
    s1 = outputs[-1]
    status = _begin(w, c, counts, profile, y0, outputs[0], s1, rtol, atol)
    i = 0
    while i < outputs.size and outputs[i] <= w[S]:
        for x in range(STATES):
            result[i * STATES + x] = y0[x]
        i += 1
    while status == OK and w[S] < s1:
        status = _next_step(w, c, counts, profile, s1, rtol, atol, max_steps)
        if status == OK:
            if outputs[i] <= w[S_NEW]:
                i = _write_outputs(w, outputs, i, result)
            _accept(w, c, counts, profile, s1)
    return status, counts[STEPS], counts[REJECTED], counts[EVALUATIONS]


@allocating
def integrate_mesh(
    y0: Array,
    s0: float,
    s1: float,
    breaks: Array,
    coefficients: Array,
    degree: int,
    rtol: float,
    atol: float,
    nodes: Array,
    states: Array,
    slopes: Array,
) -> Report:
    """Integrate from y(s0) = y0 to s1, and write every step; the other arguments as for `integrate`.

    Args:
        nodes: s0 and the end of each step, (capacity,), written
        states, slopes: y and y' at the nodes, (capacity x 13,), written; y' at a break is that of the piece it begins

    Returns:
        status (1 when the capacity is reached before s1), nodes written, steps rejected, evaluations
    """
    w, c, counts = np.zeros(WORK), np.empty(WIDTH), np.zeros(COUNTS, np.int64)
    profile = Profile(breaks, coefficients, degree)
    status = _begin(w, c, counts, profile, y0, s0, s1, rtol, atol)
    _write_node(w, 0, nodes, states, slopes)
    while status == OK and w[S] < s1:
        status = _next_step(w, c, counts, profile, s1, rtol, atol, nodes.size - 1)
        if status == OK:
            _accept(w, c, counts, profile, s1)
            _write_node(w, counts[STEPS], nodes, states, slopes)
    return status, counts[STEPS] + 1, counts[REJECTED], counts[EVALUATIONS]


@allocating
def integrate_sensitivity(
    y0: Array,
    s0: float,
    s1: float,
    breaks: Array,
    coefficients: Array,
    degree: int,
    rtol: float,
    atol: float,
    max_steps: int,
    y1: Array,
    sensitivity: Array,
) -> Report:
    """Integrate from y(s0) = y0 to s1, with the derivative of the end by the start; the rest as for `integrate`.

    Args:
        y1: y(s1), (13,), written
        sensitivity: dy(s1)/dy0, (13 x 13,) row by row, written
    """
    w, c, counts = np.zeros(WORK), np.empty(WIDTH), np.zeros(COUNTS, np.int64)
    phi, J = np.zeros(PHI_WORK), np.zeros(STATES * STATES)
    for x in range(STATES):
        phi[PHI + x * ROW + x] = 1.0
    profile = Profile(breaks, coefficients, degree)
    status = _begin(w, c, counts, profile, y0, s0, s1, rtol, atol)
    while status == OK and w[S] < s1:
        status = _next_step(w, c, counts, profile, s1, rtol, atol, max_steps)
        if status == OK:
            _step_sensitivity(w, c, profile, counts[PIECE], phi, J)
            _accept(w, c, counts, profile, s1)
    for x in range(STATES):
        y1[x] = w[STATE + x]
        for z in range(STATES):
            sensitivity[x * STATES + z] = phi[PHI + x * ROW + z]
    return status, counts[STEPS], counts[REJECTED], counts[EVALUATIONS]
