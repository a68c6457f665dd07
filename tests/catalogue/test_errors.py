"""The estimated error against the true one, over the catalogue."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from darboux.statics.collocation_equations import Equations
from tests.catalogue.problems import CATALOGUE

ROUNDING = 1e-12  # of forces, moments and energies over their largest: no claim is tested below it


def _ratios(problem: dx.Equilibrium, method: dx.Collocation, exact: dx.EquilibriumSolution) -> list[float]:
    """True error over the estimated one: of places, reactions, moments and energy."""
    x, L = dx.solve(problem, method), problem.rod.length
    place = float(np.max(np.linalg.norm(x.r(x.s) - exact.r(x.s), axis=1)))
    result = [place / max(x.error.tip, ROUNDING * L)]
    for name, kind, unit in (("reactions", "force", 1.0 / L), ("moments", "moment", 1.0)):
        ours, theirs = (
            np.array([getattr(getattr(y.reactions, end), kind) for end in ("start", "end")]) for y in (x, exact)
        )
        largest = max(float(np.max(np.abs(theirs))), float(np.max(np.abs(exact.m(exact.s)))) * unit)
        result.append(float(np.max(np.abs(ours - theirs))) / max(getattr(x.error, name), ROUNDING * largest))
    unit = float(problem.rod.stiffness(np.zeros(1)).EI1[0]) / L
    energy = abs(x.energy.total - exact.energy.total)
    return [*result, energy / max(x.error.energy, ROUNDING * max(unit, abs(exact.energy.total)))]


METHODS = (dx.Collocation(rtol=1e-3, stages=3), dx.Collocation(rtol=1e-6, stages=2))


@pytest.mark.slow
def test_the_estimate_is_never_far_below_the_error_and_seldom_far_above() -> None:
    """Where nothing is free to turn: of a family of equilibria two solves may find different members."""
    ratios: dict[dx.Collocation, list[float]] = {method: [] for method in METHODS}
    for entry in CATALOGUE[::3]:
        exact = dx.solve(entry.problem, dx.Collocation(rtol=1e-12, stages=5))
        equations = Equations(entry.problem, stages=5)
        if equations.free_motions(equations.mesh_of(exact)) == 0:
            for method in METHODS:
                found = _ratios(entry.problem, method, exact)
                assert max(found) < 3.0, f"{entry.name} by {method}: true over estimated error {found}"
                ratios[method].append(found[0])
    for method, found in ratios.items():
        assert len(found) > 20
        assert np.median(found) > 0.1, f"{method}: {np.sort(found)}"
