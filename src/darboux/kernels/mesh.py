"""Meshes of collocation: what their polynomials are between the nodes, what they leave out, and how a better mesh is laid.

At a station the node stands twice, for the states before and behind it: an element of no width, a joint.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.gauss import FEWEST_STAGES, METHODS, MOST_STAGES, PER_METHOD, point
from darboux.kernels.jit import allocating, inline, jit
from darboux.kernels.rod_equations import FORCE, MOMENT, POSITION, ROTATION, STATES

Array = NDArray[np.float64]

EVENNESS = 0.3  # this part of the elements is laid evenly, the rest where the solution asks for them
STEEPEST = 3.0  # neighbouring elements differ at most by this factor in the density that is asked for

# One row of numbers per method, by its stages: 0 and Gauss' points, then the weights 1 / prod (c_j - c_k) of the polynomials.
PER_POLYNOMIAL = 2 * (MOST_STAGES + 1)
POLYNOMIALS = np.zeros((MOST_STAGES + 1) * PER_POLYNOMIAL)
for _stages in range(FEWEST_STAGES, MOST_STAGES + 1):
    _c = np.append(0.0, METHODS[_stages * PER_METHOD : _stages * PER_METHOD + _stages])
    _weights = [1.0 / np.prod(_c[j] - np.delete(_c, j)) for j in range(_stages + 1)]
    POLYNOMIALS[_stages * PER_POLYNOMIAL : _stages * PER_POLYNOMIAL + 2 * (_stages + 1)] = np.append(_c, _weights)


@allocating
def _points(stages: int) -> Array:
    return POLYNOMIALS[stages * PER_POLYNOMIAL : stages * PER_POLYNOMIAL + stages + 1]


@allocating
def _weights_of(stages: int) -> Array:
    return POLYNOMIALS[stages * PER_POLYNOMIAL + stages + 1 : stages * PER_POLYNOMIAL + 2 * (stages + 1)]


@jit
def units(y: Array, out: Array) -> None:
    """Write by what the 13 states of the nodes y (N + 1, 13) are measured: r and q by 1, n and m by 1 + their own largest."""
    force, moment = 0.0, 0.0
    for i in range(0, y.size, STATES):
        force = max(force, y[i + FORCE] ** 2 + y[i + FORCE + 1] ** 2 + y[i + FORCE + 2] ** 2)
        moment = max(moment, y[i + MOMENT] ** 2 + y[i + MOMENT + 1] ** 2 + y[i + MOMENT + 2] ** 2)
    out[:FORCE] = 1.0
    out[FORCE:MOMENT] = 1.0 + np.sqrt(force)
    out[MOMENT:] = 1.0 + np.sqrt(moment)


@allocating
def size(change: Array, y: Array) -> float:
    """Return the largest change of a vector at a node, change (N + 1, 13), in the units of the nodes y (M + 1, 13)."""
    unit, largest = np.empty(STATES), np.zeros(4)
    units(y, unit)
    for i in range(0, change.size, STATES):
        for part in range(4):
            first = (POSITION, ROTATION, FORCE, MOMENT)[part]
            square = 0.0
            for a in range(first, (ROTATION, FORCE, MOMENT, STATES)[part]):
                square += (change[i + a] / unit[a]) ** 2
            largest[part] = max(largest[part], square)
    return float(np.sqrt(np.max(largest)))


@allocating
def interpolate(x: Array, y: Array, Y: Array, stages: int, at: Array, out: Array) -> None:
    """Write the states at places by the polynomials through the start and the stages of each element.

        sum_j w_j prod_(k != j) (t - c_k) Y_j,     t from 0 to 1 along the element

    x (N + 1,) the nodes; y (N + 1, 13) flat; Y (N, stages, 13) flat; at (n,) ascending; out (n, 13) flat.
    """
    c, weights, i = _points(stages), _weights_of(stages), 0
    for p in range(at.size):
        while i < x.size - 2 and (x[i + 1] <= at[p] or x[i + 1] == x[i]):
            i += 1
        t = (at[p] - x[i]) / (x[i + 1] - x[i])
        for a in range(STATES):
            out[p * STATES + a] = 0.0
        for j in range(stages + 1):
            share = weights[j]
            for k in range(stages + 1):
                if k != j:
                    share *= t - c[k]
            values, first = (y, i * STATES) if j == 0 else (Y, (i * stages + j - 1) * STATES)
            for a in range(STATES):
                out[p * STATES + a] += share * values[first + a]


@allocating
def roughness(x: Array, y: Array, Y: Array, stages: int, breaks: Array, out: Array) -> None:
    """Write what the polynomials of each element leave out: h^(stages + 1) times the next derivative, the largest of all states.

    That is taken from the jumps of the highest derivatives at the nodes, but for those at breaks (n,), ascending; of an element
    between two breaks from the highest derivative itself. Arguments as for `interpolate`; out (elements with a width,).
    """
    weights, own, element = _weights_of(stages), np.empty(out.size), 0
    highest, before, unit = np.zeros(STATES), np.zeros(STATES), np.empty(STATES)
    units(y, unit)
    last, next_break = 0.0, 0
    for i in range(x.size - 1):
        h = x[i + 1] - x[i]
        if h == 0.0:
            continue
        while next_break < breaks.size and breaks[next_break] < x[i]:
            next_break += 1
        jump = own[element] = 0.0
        for a in range(STATES):
            value = weights[0] * y[i * STATES + a]
            for j in range(stages):
                value += weights[j + 1] * Y[(i * stages + j) * STATES + a]
            highest[a] = value / (unit[a] * h**stages)
            jump = max(jump, abs(highest[a] - before[a]))
            own[element] = max(own[element], abs(highest[a]))
            before[a] = highest[a]
        jump /= 0.5 * (h + last)
        out[element] = 0.0
        if element > 0 and not (next_break < breaks.size and breaks[next_break] == x[i]):
            out[element - 1] = max(out[element - 1], jump)
            out[element] = jump
        last = h
        element += 1
    element = 0
    for i in range(x.size - 1):
        if x[i + 1] > x[i]:
            h = x[i + 1] - x[i]
            out[element] = (out[element] if out[element] > 0.0 else own[element] / h) * h ** (stages + 1)
            element += 1


@jit
def spread(density: Array, steepest: float) -> None:
    """Raise the density of elements where neighbours differ by more than a factor."""
    for i in range(1, density.size):
        density[i] = max(density[i], density[i - 1] / steepest)
    for i in range(density.size - 2, -1, -1):
        density[i] = max(density[i], density[i + 1] / steepest)


@inline
def _read_off(measure: Array, x: Array, value: float, i: int) -> tuple[float, int]:
    """Return the place where the ascending measure at the places x has a value, and the piece; i: one not behind it."""
    while i < measure.size - 2 and measure[i + 1] < value:
        i += 1
    over = measure[i + 1] - measure[i]
    part = (value - measure[i]) / over if over > 0.0 else 0.0
    return x[i] + min(max(part, 0.0), 1.0) * (x[i + 1] - x[i]), i


@allocating
def lay(x: Array, wanted: Array, elements: int, breaks: Array, nodes: Array) -> int:
    """Write nodes so that the sum of `wanted` (per old element) is about the same on every new one; return how many they are.

    x (N + 1,) the old nodes, each once; breaks (n,), ascending, become nodes; nodes (elements + 2 n + 2,) or more, out.
    """
    density, total = np.empty(wanted.size), np.sum(wanted)
    for i in range(wanted.size):
        density[i] = wanted[i] / ((x[i + 1] - x[i]) * total) if total > 0.0 else 1.0
    spread(density, STEEPEST)
    total = np.sum(density * np.diff(x))
    measure = np.zeros(x.size)
    for i in range(wanted.size):
        measure[i + 1] = measure[i] + ((1.0 - EVENNESS) * density[i] / total + EVENNESS) * (x[i + 1] - x[i])
    nodes[0] = x[0]
    count, first, piece, old = 1, 0.0, 0, 0
    for k in range(breaks.size + 1):
        place = breaks[k] if k < breaks.size else x[-1]
        while piece < x.size - 2 and x[piece + 1] < place:
            piece += 1
        part = (place - x[piece]) / (x[piece + 1] - x[piece])
        last = measure[piece] + part * (measure[piece + 1] - measure[piece])
        pieces = max(1, round((last - first) * elements))
        for j in range(1, pieces):
            nodes[count], old = _read_off(measure, x, first + (last - first) * j / pieces, old)
            count += 1
        nodes[count] = place
        count, first = count + 1, last
    return count


@allocating
def lay_on(
    x: Array, y: Array, Y: Array, stages: int, x_new: Array, y_new: Array, Y_new: Array, stages_new: int
) -> None:
    """Write the same solution on other nodes, as the guess of a new one: x_new (N_new + 1,) holds each station twice.

    Ends and stations keep their states.
    """
    points = np.empty((x_new.size - 1) * stages_new)
    for i in range(x_new.size - 1):
        for j in range(stages_new):
            points[i * stages_new + j] = x_new[i] + (x_new[i + 1] - x_new[i]) * point(stages_new, j)
    interpolate(x, y, Y, stages, x_new, y_new)
    interpolate(x, y, Y, stages, points, Y_new)
    for i in range(x_new.size):
        square = 0.0
        for a in range(i * STATES + ROTATION, i * STATES + FORCE):
            square += y_new[a] ** 2
        for a in range(i * STATES + ROTATION, i * STATES + FORCE):
            y_new[a] /= np.sqrt(square)
    last, last_new = y.size - STATES, y_new.size - STATES
    y_new[:STATES], y_new[last_new:] = y[:STATES], y[last:]
    i = 0
    for k in range(x_new.size - 1):
        if x_new[k + 1] == x_new[k]:
            while x[i + 1] > x[i]:
                i += 1
            y_new[k * STATES : (k + 2) * STATES] = y[i * STATES : (i + 2) * STATES]
            i += 1
