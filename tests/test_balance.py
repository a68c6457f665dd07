"""The balance of forces and moments, integrated independently of the method; the loads of every kind are in it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import darboux as dx
from darboux.curve import Curve
from tests import cases

ROD = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.4, GJ=0.7, mass=1.0), natural=(0.0, 0.5, 0.3))
LOADS = {
    "dead": [dx.LineForce((2.0, 1.0, -1.0)), dx.LineCouple((0.5, -0.2, 0.3))],
    "of the place": [dx.Rotation((0.5, 2.0, 0.0), (0.1, 0, 0)), dx.Foundation(3.0)],
    "turning": [dx.LineForce((1.0, 0.5, 0), frame="section"), dx.LineCouple((0.2, 0.4, 0.1), frame="section")],
    "of the shape": [
        dx.LineForce(lambda s, r, R: -2.0 * r + R[:, :, 0]),
        dx.LineCouple(lambda s, r, R: 0.3 * R[:, :, 1] * s[:, None]),
    ],
    "at points": [
        dx.PointForce((1.0, 0, 0.5), at=0.3),
        dx.PointForce((0.5, 1.0, 0), at=0.61, follower=True),
        dx.PointMoment((0, 0.5, 0.1), at=0.3),
        dx.PointMoment((0.2, 0.1, 0.3), at=0.8, follower=True),
    ],
    "with a jump": [dx.LineForce(lambda s: np.outer(s < 0.37, (0, -5.0, 0)))],
}


@pytest.mark.parametrize("kind", LOADS)
def test_what_is_missing_is_rounding(kind) -> None:
    problem = dx.Equilibrium(ROD, loads=[*LOADS[kind], dx.EndForce((0.5, -0.3, 0.4))])
    found = dx.solve(problem).balance
    assert found.force < 1e-9
    assert found.moment < 1e-9


@pytest.mark.parametrize("kind", LOADS)
def test_each_load_left_out_is_missed(kind) -> None:
    """The same curve, asked with one load less: what is missing is that load."""
    problem = dx.Equilibrium(ROD, loads=[*LOADS[kind], dx.EndForce((0.5, -0.3, 0.4))])
    solution = dx.solve(problem)
    for i in range(len(LOADS[kind])):
        fewer = dataclasses.replace(problem, loads=problem.loads[:i] + problem.loads[i + 1 :])
        found = dataclasses.replace(solution, problem=fewer).balance
        assert max(found.force, found.moment) > 1e-3, problem.loads[i]


def test_the_loads_that_act_are_those_of_the_load_factor() -> None:
    solution = dx.solve(cases.heavy(5.0))
    assert dataclasses.replace(solution, load_factor=0.5).balance.force == pytest.approx(0.5, rel=1e-9)


def test_a_shape_that_is_off_is_found_out_and_by_how_much() -> None:
    """The place of the tip moved by 1e-4 L under the force P across, with |n| = P: the moment's balance misses P 1e-4 L."""
    solution = dx.solve(cases.tip_force(0.1))
    y = solution.curve.y.copy()
    y[-1, 0] += 1e-4
    moved = dataclasses.replace(solution, curve=Curve(solution.curve.s, y, solution.curve.dy)).balance
    assert moved.force < 1e-12
    assert moved.moment == pytest.approx(1e-4, rel=1e-6)


def test_the_other_methods_balance_too() -> None:
    """Shooting and Elastica to their tolerance; the discrete rod with the order of its error, two."""
    problem = cases.heavy(5.0)
    for method in (dx.Shooting(), dx.Elastica()):
        found = dx.solve(problem, method).balance
        assert max(found.force, found.moment) < 1e-8, method
    coarse, fine = (dx.solve(problem, dx.DiscreteRod(N)).balance for N in (40, 80))
    assert fine.force < 1e-9
    assert 1.7 < np.log2(coarse.moment / fine.moment) < 2.3, (coarse, fine)


def test_an_unloaded_rod_misses_nothing() -> None:
    found = dx.solve(dx.Equilibrium(ROD)).balance
    assert max(found.force, found.moment) < 1e-12


def test_balance_has_no_unit() -> None:
    """The same rod, a thousand times as long and as stiff, misses the same share."""
    missing = []
    for L, EI in ((1.0, 1.0), (1e3, 7.0)):
        rod = dx.Rod(L, dx.Stiffness(EI1=EI, GJ=EI))
        problem = dx.Equilibrium(rod, loads=[dx.LineForce((0, 5.0 * EI / L**3, 0))])
        missing.append(dx.solve(problem, dx.DiscreteRod(30)).balance.moment)
    assert missing[1] == pytest.approx(missing[0], rel=1e-6)
