"""Any problem ends in an equilibrium that an independent balance confirms, or in words: never in an exception or a NaN.

Where the loads have a potential the energy of a stable one changes, as loads and springs grow, by what these store.

DARBOUX_FUZZ=2000 (`make fuzz`) tries that many, drawn anew each time; the test run a hundred, always the same.
"""

from __future__ import annotations

import dataclasses
import os
from typing import Any

import numpy as np
from hypothesis import HealthCheck, given, settings

import darboux as dx
from tests.strategies import problems

EXAMPLES = int(os.environ.get("DARBOUX_FUZZ", "0"))
MOST_ITERATIONS = 50_000  # a solve takes some tens, one that gives up at full length some thousands
CODES = {"converged", "no_convergence", "folded"}
GROWTH = 1e-3
SIZES = {"Gravity": "g", "LineForce": "force", "Foundation": "stiffness", "EndForce": "force", "PointForce": "force"}
NEAR = 0.02  # of the length, within which the equilibrium beside one is its neighbour


def grown(problem: dx.Equilibrium, factor: float) -> dx.Equilibrium:
    """Return a problem whose loads and springs are stronger by a factor."""

    def stronger(part: Any) -> Any:
        if isinstance(part, dx.Rotation):
            return dataclasses.replace(part, omega=np.sqrt(factor) * np.array(part.omega))
        name = "linear" if isinstance(part, dx.Spring) else SIZES.get(type(part).__name__)
        return dataclasses.replace(part, **{name: factor * np.array(getattr(part, name))}) if name else part

    between = {s: stronger(support) for s, support in problem.between}
    loads = [stronger(load) for load in problem.loads]
    return dataclasses.replace(problem, end=stronger(problem.end), loads=loads, between=between)


def check_energy(solution: dx.EquilibriumSolution) -> None:
    problem, s = solution.problem, solution.s
    sides = [dx.solve(grown(problem, 1.0 + sign * GROWTH), start=solution, throw=False) for sign in (-1.0, 1.0)]
    for side in sides:
        gap = np.max(np.linalg.norm(side.r(s) - solution.r(s), axis=1))
        if not side.converged or side.index != 0 or gap > NEAR * problem.rod.length:
            return
    less, more = (side.energy.total for side in sides)
    here = solution.energy
    size = abs(here.load) + here.elastic + here.supports
    assert abs((more - less) / (2.0 * GROWTH) - here.load - here.supports) <= 1e-5 * size + solution.error.energy, (
        solution
    )


@settings(
    max_examples=EXAMPLES or 100,
    derandomize=not EXAMPLES,
    deadline=None,
    database=None,
    print_blob=True,
    suppress_health_check=list(HealthCheck),
)
@given(problem=problems())
def test_any_problem_is_solved_or_said_why_not(problem: dx.Equilibrium) -> None:
    try:
        solution = dx.solve(problem, throw=False)
    except dx.InvalidInput:
        return
    assert solution.status.code in CODES
    assert solution.statistics["newton_iterations"] < MOST_ITERATIONS
    assert np.all(np.isfinite(solution.curve.y))
    assert str(solution)
    if solution.converged:
        assert max(solution.balance.force, solution.balance.moment) < 1e-6, solution
        assert solution.error.tip <= 1e-8 * problem.rod.length
        if solution.index == 0 and problem.loads and not isinstance(problem, dx.Ring):
            check_energy(solution)
    else:
        assert solution.status.message.endswith((".", "?"))
        assert solution.load_factor < 1.0 or "settle" in solution.status.message
