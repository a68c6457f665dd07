"""Meshes of collocation: what their polynomials are between the nodes, and what they leave out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.jit import jit
from darboux.kernels.rod_equations import STATES

Array = NDArray[np.float64]


@jit
def interpolate(x: Array, y: Array, Y: Array, c: Array, weights: Array, at: Array, out: Array) -> None:
    """Write the states at places by the polynomials through the start and the stages of each element.

        sum_j w_j prod_(k != j) (t - c_k) Y_j,     t from 0 to 1 along the element

    x (N + 1,) the nodes; y (N + 1, 13) flat; Y (N, stages, 13) flat; c and weights (stages + 1,), of 0 and Gauss' points; at (n,)
    ascending; out (n, 13) flat.
    """
    stages, i = c.size - 1, 0
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


@jit
def roughness(x: Array, y: Array, Y: Array, breaks: Array, weights: Array, units: Array, out: Array) -> None:
    """Write what the polynomials of each element leave out: h^(stages + 1) times the next derivative, the largest of all states.

    That is taken from the jumps of the highest derivatives at the nodes, but for those at breaks (n,), ascending. Arguments as for
    `interpolate`; units (13,) of the states; out (elements with a width,).
    """
    stages, element = weights.size - 1, 0
    highest, before = np.zeros(STATES), np.zeros(STATES)
    last, next_break = 0.0, 0
    for i in range(x.size - 1):
        h = x[i + 1] - x[i]
        if h == 0.0:
            continue
        while next_break < breaks.size and breaks[next_break] < x[i]:
            next_break += 1
        jump = 0.0
        for a in range(STATES):
            value = weights[0] * y[i * STATES + a]
            for j in range(stages):
                value += weights[j + 1] * Y[(i * stages + j) * STATES + a]
            highest[a] = value / (units[a] * h**stages)
            jump = max(jump, abs(highest[a] - before[a]))
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
            out[element] *= (x[i + 1] - x[i]) ** (stages + 1)
            element += 1


@jit
def spread(density: Array, steepest: float) -> None:
    """Raise the density of elements where neighbours differ by more than a factor."""
    for i in range(1, density.size):
        density[i] = max(density[i], density[i - 1] / steepest)
    for i in range(density.size - 2, -1, -1):
        density[i] = max(density[i], density[i + 1] / steepest)
