"""Where a solve sets out from: other solutions, curves, points; and the search for several equilibria."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import darboux as dx
from tests import cases

FLAT = dx.Rod(1.0, dx.Stiffness(EI1=1.4, EI2=1.0, GJ=0.75))
COLUMN = dx.Equilibrium(FLAT, loads=[dx.EndForce((0, 0, -1.2 * np.pi**2 / 4.0))])


def changed(problem: dx.Equilibrium, factor: float) -> dx.Equilibrium:
    (load,) = problem.loads
    return dataclasses.replace(problem, loads=[dx.LineForce(tuple(factor * f for f in load.force))])


@pytest.mark.parametrize("weight", [1.0, 613.125, 1e5])
def test_a_load_changed_by_one_percent_takes_few_iterations(weight: float) -> None:
    """Newton's method on the coarse mesh and on the fine one, together; the same answer as from a cold start."""
    problem = cases.heavy(weight)
    first = dx.solve(problem)
    more = changed(problem, 1.01)
    warm, cold = dx.solve(more, start=first), dx.solve(more)
    assert warm.statistics["newton_iterations"] <= 4, warm.statistics
    assert warm.statistics["load_steps"] == 0
    assert "next to the one that was given" in warm.status.message
    np.testing.assert_allclose(warm.tip, cold.tip, atol=1e-10)
    assert np.linalg.norm(warm.tip - first.tip) > 1e-8


def test_a_start_of_another_resolution_and_with_stations() -> None:
    between = {0.4: dx.Roller(along=(0, 0, 1), position=(0, 0, 0.4))}
    problem = dx.Equilibrium(
        FLAT, loads=[dx.EndForce((0.4, 0.3, 0)), dx.PointForce((0, 1, 0), at=0.7)], between=between
    )
    coarse = dx.solve(problem, dx.Collocation(rtol=1e-3))
    np.testing.assert_allclose(dx.solve(problem, start=coarse).tip, dx.solve(problem).tip, atol=1e-10)


def test_points_choose_the_side_to_which_a_column_buckles() -> None:
    right = dx.solve(COLUMN)
    side = np.sign(right.tip[0])
    for sign in (1.0, -1.0):
        points = [(0, 0, 0), (sign * 0.2, 0, 0.4), (sign * 0.6, 0, 0.7)]
        x = dx.solve(COLUMN, start=points)
        np.testing.assert_allclose(x.tip, right.tip * (sign * side, 1, 1), atol=1e-9)
        assert x.stable
        assert "follows from the given start" in x.status.message


def test_a_curve_leads_to_the_other_arch() -> None:
    """A clamped arch pushed through: the inverted one is another stable equilibrium, mirrored where nothing loads it."""
    problem = dx.Equilibrium(FLAT, end=dx.Clamped(position=(0, 0, 0.9)))
    arch = dx.solve(problem)
    mirrored = arch.r(np.linspace(0, 1, 30)) * (-1, -1, 1)
    other = dx.solve(problem, start=mirrored)
    np.testing.assert_allclose(other.r(0.5), arch.r(0.5) * (-1, -1, 1), atol=1e-9)
    assert arch.stable
    assert other.stable


def test_a_solution_too_far_away_still_serves_as_a_shape() -> None:
    """From the bow under a small weight straight to a large one: Newton's method alone does not get there."""
    far = dx.solve(cases.heavy(1e4), start=dx.solve(cases.heavy(0.01)))
    np.testing.assert_allclose(far.tip, dx.solve(cases.heavy(1e4)).tip, atol=1e-9)


@pytest.mark.parametrize(
    ("start", "words"),
    [
        ("straight", "solve.start is 'straight'; it must be a solution"),
        ([(0, 0, 0)], "two or more points"),
        ([(0, 0, 0), (0, 0, 0), (0, 0, 1)], "the same point twice in a row"),
        ([(0, 0, 0), (0, 0, np.nan)], "two or more points"),
    ],
)
def test_starts_that_are_none(start: object, words: str) -> None:
    with pytest.raises(dx.InvalidInput, match=words):
        dx.solve(COLUMN, start=start)


def test_the_search_refuses_what_the_solver_refuses() -> None:
    with pytest.raises(dx.InvalidInput, match="Check the units"):
        dx.solve_all(dx.Equilibrium(FLAT, loads=[dx.EndMoment((1e6, 0, 0))]))


def test_other_methods_set_out_from_the_unloaded_rod() -> None:
    with pytest.raises(dx.InvalidInput, match="sets out from the unloaded rod; use Collocation"):
        dx.solve(COLUMN, dx.Shooting(), start=dx.solve(COLUMN))


# -- several equilibria ------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(("weight", "count"), [(40.0, 1), (43.0, 3)])
def test_a_heavy_rod_has_one_equilibrium_before_its_first_fold_and_three_behind(weight: float, count: int) -> None:
    """The fold lies near w L^3 / EI = 41.4; energies ascend, and the least of them is stable."""
    found = dx.solve_all(cases.heavy(weight))
    assert len(found) == count
    assert [x.index for x in found] == list(range(count))
    np.testing.assert_allclose(found[0].tip, dx.solve(cases.heavy(weight)).tip, atol=1e-9)
    for x in found:
        s = np.linspace(0, 1, 9)
        np.testing.assert_allclose(x.n(s)[:, 1], -weight * (1.0 - s), atol=1e-7 * weight)


@pytest.mark.slow
def test_a_flat_column_has_its_straight_and_its_two_buckled_shapes() -> None:
    """Between its first critical load and the second one: two mirrored shapes, and the straight one, unstable."""
    found = dx.solve_all(COLUMN)
    energies = [x.energy.total for x in found]
    assert [x.index for x in found] == [0, 0, 1]
    assert energies[0] == pytest.approx(energies[1], abs=1e-9)
    np.testing.assert_allclose(found[0].tip * (-1, -1, 1), found[1].tip, atol=1e-9)
    np.testing.assert_allclose(found[2].tip, (0, 0, 1), atol=1e-9)
