"""Problems of the catalogue come out the same whatever the rounding; `make processors` tries all of them, in more ways."""

from __future__ import annotations

import numpy as np
import pytest

from tests.catalogue.problems import CATALOGUE, Entry
from tests.rounding import answer, difference, disturbed, turned_to

BUCKLED = ["round column, clamped, free, 1.02 Pcr", "flat column, clamped, slider, 1.3 Pcr", "round, pushed by 0.1"]
SNAPPED = ["round, pushed to 0.1, 1 turns", "flat, pushed to 0.1, 3 turns"]
SAMPLE = [entry for i, entry in enumerate(CATALOGUE) if i % 9 == 0 or entry.name in BUCKLED + SNAPPED]


@pytest.mark.parametrize("entry", SAMPLE, ids=str)
def test_the_same_branch_from_disturbed_states(entry: Entry) -> None:
    undisturbed = answer(entry.problem)
    with disturbed(seed=1):
        assert difference(undisturbed, answer(entry.problem), entry.family) == ""


def test_the_samples_are_there() -> None:
    assert len(SAMPLE) > 15
    assert {*BUCKLED, *SNAPPED} <= {entry.name for entry in SAMPLE}


def test_a_turn_about_the_axis_of_a_family_is_no_difference() -> None:
    rng = np.random.default_rng(0)
    a, (x, y) = rng.normal(size=(9, 3)), rng.normal(size=2)
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    angle = np.hypot(x, y)
    K = np.cross(np.eye(3), axis)
    turn = np.eye(3) - np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K
    np.testing.assert_allclose(turned_to(a, a @ turn.T, axis), a @ turn.T, atol=1e-14)
    assert np.max(np.abs(turned_to(a, a * (1.0, 1.0, -1.0), axis) - a * (1.0, 1.0, -1.0))) > 0.1
    for name, changed in (("code", "folded"), ("index", 1)):
        one = {"code": "converged", "index": 0, "r": a.tolist()}
        assert difference(one, one | {name: changed}) != ""
        assert difference(one, one) == ""
