"""The path that a kernel follows: a column's buckling load lies in the span that it names, and steps keep their rules."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from darboux.kernels import step_control
from darboux.statics.collocation_equations import Equations
from darboux.statics.collocation_path import follow
from tests import cases


def test_a_column_turns_unstable_at_eulers_load() -> None:
    """Clamped and free, P_cr = pi^2 EI / (4 L^2), in two planes at once; exact to the length of a crossing."""
    equations = Equations(dx.Equilibrium(cases.UNIT, loads=[dx.EndForce((0, 0, -4.0))]), 2)
    path = follow(equations, equations.unloaded())
    ((before, behind),) = path.crossings
    assert before < np.pi**2 / 16.0 < behind
    assert behind - before <= step_control.CROSSING_STEP
    assert (path.load_factor, path.index) == (1.0, 2)
    assert path.unstable is not None


@pytest.mark.parametrize("corrected", [1e-4, 1e-2, 0.08, 0.3])
@pytest.mark.parametrize("predicted", [1e-3, 0.2, 0.6])
@pytest.mark.parametrize("order", [1, 2])
def test_the_corrector_would_turn_the_rod_as_wanted(order: int, predicted: float, corrected: float) -> None:
    """What it turns grows with the power order + 1 of the step, what the predictor turns with the step."""
    growth = step_control.growth(predicted, corrected, 1e-5, order)
    next_turn, next_share = corrected * growth ** (order + 1), corrected * growth**order / predicted
    assert 0.5 <= growth <= 4.0
    if growth > 0.5:
        assert next_turn <= step_control.WANTED_CORRECTED_TURN * 1.0000001
        assert next_share <= step_control.WANTED_SHARE * 1.0000001
    if growth < 4.0:
        assert max(next_turn / step_control.WANTED_CORRECTED_TURN, next_share / step_control.WANTED_SHARE) > 0.9999999


def test_the_corrector_may_turn_the_rod_by_a_share_of_what_was_predicted() -> None:
    assert step_control.growth(0.1, 1e-6, 1e-5, 2) == 4.0
    assert step_control.allowed(0.2, 1e-5) == 0.1
    assert step_control.allowed(1e-9, 1e-5) == 1e-5
    assert step_control.allowed(10.0, 1e-5) == step_control.LARGEST_CORRECTED_TURN
