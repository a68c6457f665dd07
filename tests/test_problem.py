"""Loads, supports and what a problem makes of them; the checks beneath."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from darboux import checks
from tests import cases

VARYING = {
    "charge": [dx.ElectricField((0, -4, 0), lambda s: 1.0 - 3.0 * s)],
    "couple": [dx.LineCouple(lambda s: np.column_stack([0 * s, 0 * s, np.sin(9 * s)])), dx.EndForce((2, 2, 0))],
    "force": [dx.LineForce(lambda s: np.column_stack([3 * s, -8 * np.cos(3 * s), 0 * s]))],
    "nothing but the natural shape": [dx.EndForce((1, -3, 0))],
}


@pytest.mark.parametrize("name", VARYING)
def test_each_varying_quantity_alone_against_the_elastica(name) -> None:
    natural = (lambda s: np.column_stack([0 * s, 4 * s - 1, 0 * s])) if "natural" in name else None
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0), natural=natural)
    problem = dx.Equilibrium(rod, start=dx.Clamped(tangent=(1, 0, 0), d1=(0, 1, 0)), loads=VARYING[name])
    assert not problem.uniform
    exact = dx.solve(problem, dx.Elastica())
    assert np.linalg.norm(dx.solve(problem).tip - exact.tip) < 1e-9
    assert np.linalg.norm(dx.solve(problem, dx.DiscreteRod(200)).tip - exact.tip) < 1e-3


def test_loads_of_one_kind_add_up() -> None:
    one = dx.Equilibrium(cases.UNIT, loads=[dx.EndForce((1, 2, 0)), dx.EndMoment((0, 1, 0))])
    two = one.with_load(dx.EndForce((0, 0, 3))).with_load(dx.EndMoment((2, 0, 0)))
    np.testing.assert_array_equal(two.end_load("end").force, (1, 2, 3))
    np.testing.assert_array_equal(two.end_load("end").moment, (2, 1, 0))
    np.testing.assert_array_equal(two.end_load("start").force, (0, 0, 0))


def test_breaks_of_a_problem_are_the_inner_knots_of_all_its_tables() -> None:
    natural = dx.Table([0, 0.3, 1], np.zeros((3, 3)), "linear")
    rod = dx.Rod(1.0, dx.Stiffness(EI1=dx.Table([0, 0.6, 1], [1, 2, 1], "linear"), GJ=1.0), natural=natural)
    loads = [
        dx.LineForce(dx.Table([0, 0.2, 1], np.zeros((3, 3)))),
        dx.LineCouple(dx.Table([0, 0.4, 1], np.zeros((3, 3)))),
        dx.ElectricField((1, 0, 0), dx.Table([0, 0.5, 1], [0, 1, 0])),
    ]
    assert dx.Equilibrium(rod, loads=loads).breaks == (0.2, 0.3, 0.4, 0.5, 0.6)


def test_a_clamps_frame_is_orthonormal_whatever_its_d1() -> None:
    R = dx.Clamped(tangent=(0, 0, 2), d1=(3, 0, 4)).R
    np.testing.assert_allclose(R, np.eye(3), atol=1e-15)
    R = dx.Clamped(tangent=(1, 2, 3), d1=(1, 0, -1)).R
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-15)
    assert np.linalg.det(R) == pytest.approx(1.0)


def test_a_load_table_must_run_from_end_to_end() -> None:
    for ends in ([0.1, 1.0], [0.0, 0.9], [0.0, 1.1]):
        with pytest.raises(dx.InvalidInput, match=r"loads\[0\] has a Table"):
            dx.Equilibrium(cases.UNIT, loads=[dx.LineForce(dx.Table(ends, np.zeros((2, 3))))])


def test_a_rod_that_stretches_may_be_drawn_longer_than_it_is() -> None:
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0, EA=50.0), stretch=True)
    problem = dx.Equilibrium(rod, end=dx.Clamped(position=(0, 0, 1.1)))
    for method in (dx.Shooting(), dx.DiscreteRod(10)):
        solution = dx.solve(problem, method)
        np.testing.assert_allclose(solution.reactions.end.force, (0, 0, 5.0), atol=1e-8)
        np.testing.assert_allclose(solution.reactions.start.force, (0, 0, -5.0), atol=1e-8)


def test_a_frame_is_mended_to_rounding_and_refused_beyond_it() -> None:
    off = np.eye(3) + 1e-7 * np.ones((3, 3))
    R = dx.Clamped(frame=off).R
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=2e-15)
    with pytest.raises(dx.InvalidInput, match="orthonormal"):
        dx.Clamped(frame=np.eye(3) + 1e-3 * np.ones((3, 3)))


def test_true_is_no_number() -> None:
    with pytest.raises(dx.InvalidInput, match=r"section\.radius is True; it must be a number"):
        dx.Circle(radius=True)
    with pytest.raises(dx.InvalidInput, match=r"shooting\.pieces is True; it must be a whole number"):
        dx.Shooting(pieces=True)


def test_a_direction_may_be_as_short_as_it_likes() -> None:
    assert checks.direction("x", (0.0, 1e-9, 0.0)) == (0.0, 1.0, 0.0)
