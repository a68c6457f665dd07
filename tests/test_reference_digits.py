"""Every reference case through every method that states it, with a tolerance that follows from the method."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from tests import cases
from tests.cases import ALL, Case

# Method, and what its error may be relative to L: near rounding for the continuous ones. A discrete rod's constant
# depends on the case, so there the bound is on the order, below.
CONTINUOUS = [(dx.Collocation(), 3e-10), (dx.Shooting(), 3e-10), (dx.Elastica(), 3e-11)]
STATED = [
    pytest.param(method, tolerance, case, id=f"{type(method).__name__}-{case.id}")
    for method, tolerance in CONTINUOUS
    for case in ALL
    if method.refuses(case.problem) is None
]
DISCRETE = [pytest.param(case, id=case.id) for case in ALL if dx.DiscreteRod().refuses(case.problem) is None]


@pytest.mark.parametrize(("method", "tolerance", "case"), STATED)
def test_tip_and_root_moment(method, tolerance: float, case: Case) -> None:
    solution = dx.solve(case.problem, method)
    L = case.problem.rod.length
    assert np.linalg.norm(solution.tip - case.tip) / L < tolerance + case.digits
    if case.root_moment is not None:
        gap = np.linalg.norm(-solution.reactions.start.moment - case.root_moment)
        assert gap / np.linalg.norm(case.root_moment) < tolerance + 10.0 * case.digits


@pytest.mark.parametrize("case", DISCRETE)
def test_discrete_rod_is_of_second_order(case: Case) -> None:
    """The order is measured where it has set in: figure 5's layer at the clamp delays it to 512 segments (case D01)."""
    segments = (128, 256, 512, 1024)
    L = case.problem.rod.length
    errors = [np.linalg.norm(dx.solve(case.problem, dx.DiscreteRod(N)).tip - case.tip) / L for N in segments]
    order = np.log2(errors[-2] / errors[-1])
    assert 1.9 < order < 2.2, f"order {order:.3f}, declared 2; errors {errors} at {segments} segments"
    assert errors[-1] < 5e-4


def test_every_exported_method_is_held_to_the_reference_digits() -> None:
    exported = {name for name in dx.__all__ if hasattr(getattr(dx, name), "refuses")}
    tested = {type(p.values[0]).__name__ for p in STATED} | {"DiscreteRod"}
    assert tested == exported
    stated_by_shooting = [p for p in STATED if isinstance(p.values[0], dx.Shooting)]
    assert len(stated_by_shooting) == len(ALL)
    assert len([p for p in STATED if isinstance(p.values[0], dx.Elastica)]) >= len(cases.PLANAR)


def test_both_ends_clamped() -> None:
    """Case S14: the branch from the quarter circle; another path of the end pose may reach another equilibrium.

    Root force, root moment and energy of the equilibrium that our path reaches; uncertainty 1e-10.
    """
    solution = dx.solve(cases.posed(), dx.Shooting())
    np.testing.assert_allclose(
        -solution.reactions.start.force, (-16.186072684, -5.4574714172, -22.145698563), atol=2e-9
    )
    np.testing.assert_allclose(
        -solution.reactions.start.moment, (-0.510038263324, -4.80479601974, 1.19036574067), atol=1e-9
    )
    np.testing.assert_allclose(solution.energy.total, 7.49221578222, rtol=1e-10)
    np.testing.assert_allclose(solution.r(0.5), (-0.140232273798, 0.0919047150864, 0.450685758075), atol=1e-10)
