"""Newton's method on a mesh: steps until they are small, or until they no longer contract.

It returns to Python only where something is asked of it: loads that are functions of the shape. Called again, it goes on.

Where the last equations are almost singular, singular values tell which motions are free, so that these are left alone: a rod
that may turn about its axis, or about the line through its ends, or buckle in any plane. Such a motion has a singular value of
rounding and nothing to do, which is the phase condition. Where the equations do ask for a step along it, as near a
bifurcation, they get it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.collocation import advance, back, measure, solve_last, sweep
from darboux.kernels.element import LINE
from darboux.kernels.jit import allocating, jit
from darboux.kernels.mesh import units
from darboux.kernels.rod_equations import FORCE, MOMENT, STATES
from darboux.kernels.singular_values import solve_by_singular_values
from darboux.kernels.system import FREE, M_, N_, ROW, SIDES, System

Array = NDArray[np.float64]

SINGULAR = 1e-6  # of the last equations' pivots: below, singular values tell what is free
UNSURE_MOTION = 1e-3  # of the tolerance: a singular value, and what is asked for along it, below which a motion is free
UNSURE, SAFE = 1e4, 10.0  # how the next of Newton's steps is foreseen: UNSURE length^2, or SAFE times the quadratic law

# Why `newton` returns.
CONVERGED, LOST, LOADS = 0, 1, 2


class Work(NamedTuple):
    """What Newton's method writes: flat arrays, and what it keeps between two calls."""

    factors: Array  # (N, 12, ROW)
    last: Array  # (12, 14), the equations that are left for the end
    delta: Array  # (N + 1, 12, SIDES), the last step, and the derivative by the load factor
    steps: Array  # (N, 4 stages, LINE), how the stages follow from the nodes
    y: Array  # (N + 1, 13)
    Y: Array  # (N, stages, 13)
    transfer: Array  # (N, 12, 12) of the elements that have a width, or none
    kept: Array  # (KEPT,)


# What is kept: the last step's length (infinite before the first), the sum of the steps' turns, how many steps, the sign of the
# determinant, the last step's turn and that of the derivative by the load factor, how many motions are free, the length of the
# next step as foreseen.
LENGTH, TURNED, STEPS, SIGN, TURN, TANGENT_TURN, IDLE_MOTIONS, LEFT, KEPT = range(9)


def new_work(elements: int, stages: int, transfers: bool = False) -> Work:
    """Return the work of so many elements."""
    factors, last = np.empty(elements * FREE * ROW), np.empty(FREE * (FREE + SIDES))
    delta, steps = np.empty((elements + 1) * FREE * SIDES), np.empty(elements * 4 * stages * LINE)
    y, Y = np.empty((elements + 1) * STATES), np.empty(elements * stages * STATES)
    transfer = np.empty(elements * FREE * FREE if transfers else 0)
    return Work(factors, last, delta, steps, y, Y, transfer, np.zeros(KEPT))


@jit
def begin(work: Work) -> None:
    """Forget the steps that were taken."""
    work.kept[:] = 0.0
    work.kept[LENGTH] = np.inf


@allocating
def newton(system: System, supports: Array, work: Work, tolerance: float, floor: float, most: int) -> int:
    """Take at most `most` steps from the states of the system, which are moved; return why it ends.

    A step must be at most half as long as the one before, or within 10 tolerances, or within the floor that rounding sets. It is
    the last one if it, or the next one as foreseen, is below both. With `most` = 0 a step is solved for, but not taken.
    """
    kept, unit, of_state = work.kept, np.ones(FREE), np.empty(STATES)
    while True:
        sign = sweep(system, supports, work.last, work.factors, work.steps, work.transfer)
        at_end = work.delta[work.delta.size - FREE * SIDES :]
        pivot = solve_last(work.last.copy(), at_end)
        kept[SIGN], kept[IDLE_MOTIONS] = sign * np.sign(pivot), 0.0
        if abs(pivot) < SINGULAR:
            units(system.y[system.y.size - STATES :], of_state)
            unit[N_:M_], unit[M_:] = of_state[FORCE], of_state[MOMENT]
            unsure = UNSURE_MOTION * tolerance if np.isfinite(tolerance) else 0.0
            kept[IDLE_MOTIONS] = solve_by_singular_values(work.last, unit, unsure, at_end)
        back(work.factors, work.delta)
        last = kept[LENGTH]
        length, kept[TURN] = measure(system.y, work.delta, 0)
        tangent_length, kept[TANGENT_TURN] = measure(system.y, work.delta, 1)
        kept[LENGTH] = length
        kept[STEPS] += 1.0
        if not np.isfinite(length + tangent_length) or length > max(0.5 * last, 10.0 * tolerance, floor):
            return LOST
        if most == 0:
            return CONVERGED
        advance(system, work.delta, 0.0, 1.0, work.steps, work.y, work.Y)
        system.y[:] = work.y
        system.Y[:] = work.Y
        kept[TURNED] += kept[TURN]
        foreseen = min(UNSURE * length, SAFE * (length / last) ** 2 if np.isfinite(last) else np.inf)
        kept[LEFT] = length * min(1.0, foreseen)
        if kept[LEFT] <= max(tolerance, floor):
            return CONVERGED
        if kept[STEPS] >= most:
            return LOST
        if system.shaped.size > 0:
            return LOADS
