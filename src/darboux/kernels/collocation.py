r"""Gauss collocation of the rod equations: Newton's equations of a whole mesh, condensed and eliminated in one sweep.

On the element from x_i to x_i + h the states Y_j at Gauss' points meet

    Y_j = y_i + h sum_l a_jl g(Y_l)                                                                  (1)
    y_i+1 = y_i + sum_j d_j (Y_j - y_i),      d = b A^-1                                             (2)

Newton's unknowns at a node are the 12 numbers (dr, phi, dn, dm), with the small rotation phi in the section's frame,
dq = 1/2 q (0, phi). The stages are eliminated element by element (r, n and m first: then little fills in), which leaves

    T_i delta_i - delta_i+1 = -g_i                                                                   (3)

At a station, where a support holds the rod or a point load acts, the node stands twice; the joint between the two is an
element of no width, whose twelve equations are given. All are eliminated forward with six conditions carried along; rows
are exchanged within the 18 at hand, which is Gaussian elimination with partial pivoting of the whole matrix. Two right
sides: the residual, and minus its derivative with respect to the load factor.

References: U. M. Ascher, R. M. M. Mattheij, R. D. Russell, Numerical Solution of Boundary Value Problems (SIAM, 1995),
sections 5.6 and 7.2; E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, 2nd ed. (Springer, 2006),
theorem IV.2.1 (Gauss' methods keep quadratic invariants: |q|, and of unloaded rods m + r x n and m . n).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.algebra import (
    add,
    column,
    cross,
    dot,
    half_product,
    quaternion,
    rotate,
    rotation,
    scaled,
    times,
    turn,
    vector,
)
from darboux.kernels.jit import inline, jit
from darboux.kernels.profile import Profile, columns, evaluate
from darboux.kernels.rod_equations import (
    DEAD_FORCE,
    DEAD_MOMENT,
    FOLLOWER_FORCE,
    FOLLOWER_MOMENT,
    FORCE,
    FORCE_GRADIENT,
    MOMENT,
    POSITION,
    ROTATION,
    STATES,
    UNIT,
    WIDTH,
    write_derivative,
    write_jacobian,
)

Array = NDArray[np.float64]

FREE = 12  # unknowns of a node: dr, phi, dn, dm
SIDES = 2  # right sides: the residual, and the load factor's
R_, PHI, N_, M_ = 0, 3, 6, 9  # where the parts of the unknowns begin
FEWEST_STAGES, MOST_STAGES = 2, 5
SHAPED_COUPLE, SHAPED = 21, 42  # of a load that is a function of the shape: f, df/dr, df/dphi, then l likewise
ROW = 2 * FREE + SIDES  # of the eliminated rows: 12 columns of the node, 12 of the next one, the right sides

# The order in which the parts of a state are eliminated.
ORDER = np.array([0, 1, 2, 9, 10, 11, 12, 3, 4, 5, 6, 7, 8])


def _gauss(stages: int) -> tuple[Array, Array, Array]:
    """Return the points c, the weights a and d = b A^-1 of Gauss' method on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(stages)
    c, b = 0.5 * (x + 1.0), 0.5 * w
    powers = np.arange(1, stages + 1)
    a = (c[:, None] ** powers / powers) @ np.linalg.inv(c[:, None] ** (powers - 1))
    return c, np.asarray(a), np.asarray(np.linalg.solve(a.T, b))


# One row of numbers per method, by its stages: c, a row by row, d.
PER_METHOD = 2 * MOST_STAGES + MOST_STAGES**2
METHODS = np.zeros((MOST_STAGES + 1) * PER_METHOD)
for _stages in range(FEWEST_STAGES, MOST_STAGES + 1):
    _numbers = np.concatenate([part.ravel() for part in _gauss(_stages)])
    METHODS[_stages * PER_METHOD : _stages * PER_METHOD + _numbers.size] = _numbers


@inline
def _coefficients(table: Profile, piece: int, x: float, load_factor: float, c: Array) -> None:
    """The rod's coefficients at x; the load's columns are scaled by the load factor."""
    evaluate(table, piece, x, c)
    for j in range(DEAD_FORCE, WIDTH):
        c[j] *= load_factor


@inline
def _by_load_factor(y: Array, i: int, c: Array, dn: Array, dm: Array) -> None:
    """The derivative of n' and m' with respect to the load factor, from the coefficients at load factor 1."""
    r = vector(y, i + POSITION)
    R = rotation(quaternion(y, i + ROTATION))
    b, lb = rotate(R, vector(c, FOLLOWER_FORCE)), rotate(R, vector(c, FOLLOWER_MOMENT))
    for a in range(3):
        G = FORCE_GRADIENT + 3 * a
        dn[a] = -(c[DEAD_FORCE + a] + c[G] * r[0] + c[G + 1] * r[1] + c[G + 2] * r[2] + b[a])
        dm[a] = -(c[DEAD_MOMENT + a] + lb[a])


@inline
def _add_shaped(Y: Array, y: int, shaped: Array, k: int, load_factor: float, g: Array, J: Array) -> None:
    """Add the loads that are functions of the shape to the slope and to its Jacobian."""
    q = quaternion(Y, y + ROTATION)
    for part in range(2):
        f, row = k + part * SHAPED_COUPLE, (FORCE if part == 0 else MOMENT)
        for a in range(3):
            g[row + a] -= load_factor * shaped[f + a]
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
def _solve(W: Array, n: int, width: int) -> None:
    """Solve W[:, :n] X = W[:, n:] in place, rows of `width`: elimination with row exchanges that skips zeros."""
    for k in range(n):
        best, pivot = abs(W[k * width + k]), k
        for i in range(k + 1, n):
            if abs(W[i * width + k]) > best:
                best, pivot = abs(W[i * width + k]), i
        if pivot != k:
            for j in range(k, width):
                W[k * width + j], W[pivot * width + j] = W[pivot * width + j], W[k * width + j]
        over = 1.0 / W[k * width + k]
        for i in range(k + 1, n):
            factor = W[i * width + k] * over
            if factor != 0.0:
                for j in range(k + 1, width):
                    W[i * width + j] -= factor * W[k * width + j]
    for k in range(n - 1, -1, -1):
        for i in range(k + 1, n):
            factor = W[k * width + i]
            if factor != 0.0:
                for j in range(n, width):
                    W[k * width + j] -= factor * W[i * width + j]
        over = 1.0 / W[k * width + k]
        for j in range(n, width):
            W[k * width + j] *= over


@jit
def _stage_matrix(
    method: int, stages: int, h: float, x: float, start: Array, Y: Array, at: int, table: Profile, relaxing: Profile,
    piece: int, shaped: Array, load_factor: float, yielding: float, W: Array, width: int, residual: int, by_load: int,
    w: Array,
) -> int:  # fmt: skip
    """Write 1 - h A (x) J, the residual of (1) and its derivative by the load factor; return the table's last piece."""
    n = STATES * stages
    c, g, J = w[: columns(table)], w[48 : 48 + STATES], w[64 : 64 + STATES * STATES]
    dn, dm = w[250:253], w[253:256]
    for k in range(n * width):
        W[k] = 0.0
    for k in range(STATES * STATES):
        J[k] = 0.0
    for comp in range(STATES):
        row = ORDER[comp] * stages
        for j in range(stages):
            W[(row + j) * width + row + j] = 1.0
            W[(row + j) * width + residual] = start[comp] - Y[at + j * STATES + comp]
    for l in range(stages):
        y = at + l * STATES
        place = x + h * METHODS[method + l]
        while piece < table.breaks.size - 2 and table.breaks[piece + 1] <= place:
            piece += 1
        _coefficients(table, piece, place, load_factor, c)
        write_derivative(Y, y, c, g, 0, 1)
        write_jacobian(Y, y, c, J)
        if shaped.size > 0:
            _add_shaped(Y, y, shaped, (y // STATES) * SHAPED, load_factor, g, J)
        for j in range(stages):
            weight = h * METHODS[method + stages + j * stages + l]
            for comp in range(STATES):
                row = (ORDER[comp] * stages + j) * width
                W[row + residual] += weight * g[comp]
                for other in range(STATES):
                    if J[comp * STATES + other] != 0.0:
                        W[row + ORDER[other] * stages + l] -= weight * J[comp * STATES + other]
        evaluate(table, piece, place, c)
        _by_load_factor(Y, y, c, dn, dm)
        if yielding != 0.0:
            force, d3 = vector(Y, y + FORCE), column(rotation(quaternion(Y, y + ROTATION)), 2)
            dr = scaled(yielding * dot(force, d3), d3)
            add(dm, 0, cross(force, dr))
            for j in range(stages):
                weight = h * METHODS[method + stages + j * stages + l]
                for a in range(3):
                    W[(ORDER[POSITION + a] * stages + j) * width + by_load] += weight * dr[a]
        if relaxing.coefficients.size > 0:
            evaluate(relaxing, piece, place, w[256:259])
            dq = half_product(quaternion(Y, y + ROTATION), vector(w, 256))
            for j in range(stages):
                weight = h * METHODS[method + stages + j * stages + l]
                for a in range(4):
                    W[(ORDER[ROTATION + a] * stages + j) * width + by_load] += weight * dq[a]
        if shaped.size > 0:
            at_shape = (y // STATES) * SHAPED
            for a in range(3):
                dn[a] -= shaped[at_shape + a]
                dm[a] -= shaped[at_shape + SHAPED_COUPLE + a]
        for j in range(stages):
            weight = h * METHODS[method + stages + j * stages + l]
            for a in range(3):
                W[(ORDER[FORCE + a] * stages + j) * width + by_load] += weight * dn[a]
                W[(ORDER[MOMENT + a] * stages + j) * width + by_load] += weight * dm[a]
    return piece


@inline
def _response_sides(stages: int, start: Array, W: Array, width: int, column: int) -> None:
    """Write the right sides of the response of the stages to the 12 unknowns of the element's start."""
    q = quaternion(start, ROTATION)
    for j in range(stages):
        for a in range(3):
            W[(ORDER[POSITION + a] * stages + j) * width + column + R_ + a] = 1.0
            W[(ORDER[FORCE + a] * stages + j) * width + column + N_ + a] = 1.0
            W[(ORDER[MOMENT + a] * stages + j) * width + column + M_ + a] = 1.0
            dq = half_product(q, vector(UNIT, 3 - a))
            for b in range(4):
                W[(ORDER[ROTATION + b] * stages + j) * width + column + PHI + a] = dq[b]


@jit
def _element(
    method: int, stages: int, i: int, x: Array, y: Array, Y: Array, table: Profile, relaxing: Profile, piece: int,
    shaped: Array, load_factor: float, yielding: float, start: Array, W: Array, w: Array, T: Array,
) -> int:  # fmt: skip
    """(3): write the rows [T_i, -1, -gap, -d gap / d load factor] of one element, (12 x ROW,); return the table's piece."""
    n = STATES * stages
    width = n + FREE + SIDES
    node, h = i * STATES, x[i + 1] - x[i]
    for k in range(STATES):
        start[k] = y[node + k]
    at = i * stages * STATES
    piece = _stage_matrix(
        method, stages, h, x[i], start, Y, at, table, relaxing, piece, shaped, load_factor, yielding, W, width,
        n + FREE, n + FREE + 1, w,
    )  # fmt: skip
    _response_sides(stages, start, W, width, n)
    _solve(W, n, width)
    d = method + stages + stages * stages
    total = 0.0
    for j in range(stages):
        total += METHODS[d + j]
    columns = FREE + SIDES
    S = w[64 : 64 + STATES * columns]  # what the 13 numbers of y_i+1 answer to the unknowns, the residual, the factor
    for comp in range(STATES):
        row = ORDER[comp] * stages
        for k in range(columns):
            S[comp * columns + k] = 0.0
        gap = (1.0 - total) * start[comp]
        for j in range(stages):
            weight = METHODS[d + j]
            gap += weight * Y[at + j * STATES + comp]
            for k in range(columns):
                S[comp * columns + k] += weight * W[(row + j) * width + n + k]
        S[comp * columns + FREE] += gap - y[node + STATES + comp]
    q = quaternion(start, ROTATION)
    for a in range(3):
        S[(POSITION + a) * columns + R_ + a] += 1.0 - total
        S[(FORCE + a) * columns + N_ + a] += 1.0 - total
        S[(MOMENT + a) * columns + M_ + a] += 1.0 - total
        dq = half_product(q, vector(UNIT, 3 - a))
        for b in range(4):
            S[(ROTATION + b) * columns + PHI + a] += (1.0 - total) * dq[b]
    for k in range(FREE * ROW):
        T[k] = 0.0
    for row in range(FREE):
        T[row * ROW + FREE + row] = -1.0
    following = quaternion(y, node + STATES + ROTATION)
    for k in range(columns):
        column = k if k < FREE else FREE + k
        sign = 1.0 if k < FREE else -1.0
        phi = turn(
            following,
            (S[3 * columns + k], S[4 * columns + k], S[5 * columns + k], S[6 * columns + k]),
        )
        for a in range(3):
            T[(R_ + a) * ROW + column] = sign * S[(POSITION + a) * columns + k]
            T[(PHI + a) * ROW + column] = sign * phi[a]
            T[(N_ + a) * ROW + column] = sign * S[(FORCE + a) * columns + k]
            T[(M_ + a) * ROW + column] = sign * S[(MOMENT + a) * columns + k]
    return piece


@jit
def _eliminate(V: Array, rows: int) -> float:
    """Eliminate the first 12 columns of `rows` rows with row exchanges; return the sign of what it does to the determinant."""
    sign = 1.0
    for k in range(FREE):
        best, pivot = abs(V[k * ROW + k]), k
        for i in range(k + 1, rows):
            if abs(V[i * ROW + k]) > best:
                best, pivot = abs(V[i * ROW + k]), i
        if pivot != k:
            sign = -sign
            for j in range(ROW):
                V[k * ROW + j], V[pivot * ROW + j] = V[pivot * ROW + j], V[k * ROW + j]
        if V[k * ROW + k] < 0.0:
            sign = -sign
        over = 1.0 / V[k * ROW + k]
        for i in range(k + 1, rows):
            factor = V[i * ROW + k] * over
            if factor != 0.0:
                for j in range(k + 1, ROW):
                    V[i * ROW + j] -= factor * V[k * ROW + j]
    return sign


@jit
def sweep(
    stages: int, x: Array, y: Array, Y: Array, breaks: Array, coefficients: Array, degree: int, relaxing: Array,
    shaped: Array, load_factor: float, yielding: float, joints: Array, carried: Array, factors: Array,
) -> float:  # fmt: skip
    """Eliminate all elements; return the sign of the pivots.

    x (N + 1,) nodes; y (N + 1, 13) flat; Y (N, stages, 13) flat; breaks, coefficients and degree of the rod's table;
    relaxing (like the coefficients, of 3 columns) the derivative of k0 by the load factor, or empty; shaped
    (N x stages x SHAPED,) the loads that are functions of the shape, or empty; yielding the derivative of the compliance
    of stretch by the load factor; joints (12 x ROW for each element of no width,) their equations; carried
    (6 x 14,) the six conditions at the start and their right sides on entry, six conditions at the end on return;
    factors (N x 12 x ROW,) out, for `back`.
    """
    table, relaxed = Profile(breaks, coefficients, degree), Profile(breaks, relaxing, degree)
    method = stages * PER_METHOD
    n = STATES * stages
    W, w, start = np.empty(n * (n + FREE + SIDES)), np.empty(320), np.empty(STATES)
    V = np.zeros(18 * ROW)
    T = V[6 * ROW :]
    sign = 1.0
    piece, joint = 0, 0
    for i in range(x.size - 1):
        for row in range(6):
            for k in range(FREE):
                V[row * ROW + k] = carried[row * (FREE + SIDES) + k]
                V[row * ROW + FREE + k] = 0.0
            for k in range(SIDES):
                V[row * ROW + 2 * FREE + k] = carried[row * (FREE + SIDES) + FREE + k]
        if x[i + 1] > x[i]:
            piece = _element(
                method, stages, i, x, y, Y, table, relaxed, piece, shaped, load_factor, yielding, start, W, w, T
            )
        else:
            for k in range(FREE * ROW):
                T[k] = joints[joint * FREE * ROW + k]
            joint += 1
        sign *= _eliminate(V, 18)
        for k in range(FREE * ROW):
            factors[i * FREE * ROW + k] = V[k]
        for row in range(6):
            for k in range(FREE + SIDES):
                carried[row * (FREE + SIDES) + k] = V[(FREE + row) * ROW + FREE + k]
    return sign


@jit
def back(factors: Array, delta: Array) -> None:
    """Fill delta (N + 1, 12, SIDES) flat from its last node backward, with the factors of `sweep`."""
    elements = factors.size // (FREE * ROW)
    for i in range(elements - 1, -1, -1):
        here, there = i * FREE * SIDES, (i + 1) * FREE * SIDES
        for row in range(FREE - 1, -1, -1):
            f = (i * FREE + row) * ROW
            for side in range(SIDES):
                value = factors[f + 2 * FREE + side]
                for k in range(FREE):
                    value -= factors[f + FREE + k] * delta[there + k * SIDES + side]
                for k in range(row + 1, FREE):
                    value -= factors[f + k] * delta[here + k * SIDES + side]
                delta[here + row * SIDES + side] = value / factors[f + row]


@jit
def advance(
    stages: int, x: Array, y: Array, Y: Array, breaks: Array, coefficients: Array, degree: int, relaxing: Array,
    shaped: Array, load_factor: float, yielding: float, delta: Array, change: float, part: float, y_new: Array, Y_new: Array,
) -> None:  # fmt: skip
    """Write the nodes and stages moved by `part` of the Newton step delta (N + 1, 12) flat and the load factor's change."""
    table, relaxed = Profile(breaks, coefficients, degree), Profile(breaks, relaxing, degree)
    method = stages * PER_METHOD
    n = STATES * stages
    width = n + 2
    W, w, start = np.empty(n * width), np.empty(320), np.empty(STATES)
    dstart = np.empty(STATES)
    piece = 0
    for i in range(x.size - 1):
        node, at, h = i * STATES, i * stages * STATES, x[i + 1] - x[i]
        if h == 0.0:
            for k in range(stages * STATES):
                Y_new[at + k] = Y[at + k]
            continue
        for k in range(STATES):
            start[k] = y[node + k]
        piece = _stage_matrix(
            method, stages, h, x[i], start, Y, at, table, relaxed, piece, shaped, load_factor, yielding, W, width,
            n, n + 1, w,
        )  # fmt: skip
        dq = half_product(quaternion(y, node + ROTATION), vector(delta, i * FREE + PHI))
        for a in range(4):
            dstart[ROTATION + a] = dq[a]
        for a in range(3):
            dstart[POSITION + a] = delta[i * FREE + R_ + a]
            dstart[FORCE + a] = delta[i * FREE + N_ + a]
            dstart[MOMENT + a] = delta[i * FREE + M_ + a]
        for comp in range(STATES):
            for j in range(stages):
                row = (ORDER[comp] * stages + j) * width
                W[row + n] += dstart[comp] + change * W[row + n + 1]
        _solve(W, n, width)
        for j in range(stages):
            for comp in range(STATES):
                k = at + j * STATES + comp
                Y_new[k] = Y[k] + part * W[(ORDER[comp] * stages + j) * width + n]
    for i in range(x.size):
        node, free = i * STATES, i * FREE
        for a in range(3):
            y_new[node + POSITION + a] = y[node + POSITION + a] + part * delta[free + R_ + a]
            y_new[node + FORCE + a] = y[node + FORCE + a] + part * delta[free + N_ + a]
            y_new[node + MOMENT + a] = y[node + MOMENT + a] + part * delta[free + M_ + a]
        dq = half_product(quaternion(y, node + ROTATION), vector(delta, free + PHI))
        square = 0.0
        for a in range(4):
            y_new[node + ROTATION + a] = y[node + ROTATION + a] + part * dq[a]
            square += y_new[node + ROTATION + a] ** 2
        for a in range(4):
            y_new[node + ROTATION + a] /= np.sqrt(square)


@jit
def transfers(
    stages: int, x: Array, y: Array, Y: Array, breaks: Array, coefficients: Array, degree: int, relaxing: Array,
    shaped: Array, load_factor: float, yielding: float, transfer: Array,
) -> None:  # fmt: skip
    """Write T_i of (3) for every element that has a width into transfer (12 x 12 each,); else as for `sweep`."""
    table, relaxed = Profile(breaks, coefficients, degree), Profile(breaks, relaxing, degree)
    n = STATES * stages
    W, w, start, T = np.empty(n * (n + FREE + SIDES)), np.empty(320), np.empty(STATES), np.empty(FREE * ROW)
    piece, at = 0, 0
    for i in range(x.size - 1):
        if x[i + 1] == x[i]:
            continue
        piece = _element(
            stages * PER_METHOD,
            stages,
            i,
            x,
            y,
            Y,
            table,
            relaxed,
            piece,
            shaped,
            load_factor,
            yielding,
            start,
            W,
            w,
            T,
        )
        for row in range(FREE):
            for k in range(FREE):
                transfer[at + row * FREE + k] = T[row * ROW + k]
        at += FREE * FREE


@jit
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


@jit
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
