"""Every problem of the catalogue, solved cold by the default method with its defaults."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from tests.catalogue.problems import CATALOGUE, Entry, tip

ROUNDING = 1e-11  # of the reference digits, and of what is read


@pytest.mark.parametrize("entry", CATALOGUE, ids=str)
def test_solved_cold(entry: Entry) -> None:
    solution = dx.solve(entry.problem)
    assert isinstance(solution.method, dx.Collocation)
    value = entry.value
    if hasattr(value, "refuses"):
        value = entry.read(dx.solve(entry.problem, value))
    elif isinstance(value, dx.Equilibrium):
        value = entry.read(dx.solve(value))
    gap = np.max(np.abs(np.array(entry.read(solution)) - np.array(value)))
    assert gap <= entry.tolerance * max(1.0, float(np.max(np.abs(value)))), f"{gap:.2e} off"
    if entry.read is tip and not hasattr(
        entry.value, "refuses"
    ):  # exact digits of the tip: the estimate must cover them
        assert gap <= 3.0 * solution.error.tip / entry.problem.rod.length + max(ROUNDING, entry.tolerance - 3e-10)
    if solution.index is not None:
        assert solution.stable


def test_the_catalogue_is_as_large_as_it_says() -> None:
    assert len(CATALOGUE) >= 80
    assert len({entry.name for entry in CATALOGUE}) == len(CATALOGUE)
