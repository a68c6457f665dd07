"""The same input gives the same bits: run after run, from several threads at once, and in another process."""

from __future__ import annotations

import pickle
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np
import pytest

import darboux as dx
from tests import cases

METHODS = [dx.Collocation(), dx.Shooting(), dx.Elastica(), dx.DiscreteRod(30)]
MOTIONS = [dx.ImplicitMidpoint(20, step=1e-3), dx.TRBDF2(20), dx.StormerVerlet(12)]
WEIGHTS = (5.0, 10.0, 15.0, 20.0)


def states(weight: float, method: Any) -> bytes:
    return dx.solve(cases.heavy(weight), method).curve.y.tobytes()


def motion(weight: float) -> dx.Motion:
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7, EA=1e3, mass=1.0), stretch=True)
    hanging = dx.Equilibrium(rod, start=cases.ALONG_X, loads=[dx.Gravity((0, -weight, 0)), dx.EndForce((0, 0, 1.0))])
    growing = dx.Table([0.0, 0.02], [0.0, 1.0])
    return dx.Motion(
        hanging, duration=0.02, load_factor=[None, growing], damping=[dx.MassDamping(1.0)], release={"start": 0.01}
    )


def trajectory(weight: float, method: Any) -> bytes:
    found = dx.simulate(motion(weight), method, records=10)
    return b"".join(
        part.tobytes() for part in (found.positions, found.velocities, found.directors, found.energy.balance)
    )


@pytest.mark.parametrize("method", METHODS, ids=lambda method: type(method).__name__)
def test_threads_do_not_disturb_each_other(method: Any) -> None:
    alone = [states(weight, method) for weight in WEIGHTS]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(states, WEIGHTS * 3, [method] * 12))
    assert together == alone * 3


@pytest.mark.parametrize("method", MOTIONS, ids=lambda method: type(method).__name__)
def test_motions_in_threads(method: Any) -> None:
    alone = [trajectory(weight, method) for weight in WEIGHTS]
    assert len(set(alone)) == len(WEIGHTS)
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(trajectory, WEIGHTS * 2, [method] * 8)) == alone * 2


@pytest.mark.parametrize("method", METHODS, ids=lambda method: type(method).__name__)
def test_solutions_pickle(method: Any) -> None:
    solution = dx.solve(cases.heavy(5.0), method)
    copy = pickle.loads(pickle.dumps(solution))
    assert copy == solution
    np.testing.assert_array_equal(copy.m(0.3), solution.m(0.3))
    assert copy.stable == solution.stable


@pytest.mark.parametrize("method", MOTIONS, ids=lambda method: type(method).__name__)
def test_motions_and_trajectories_pickle(method: Any) -> None:
    asked = motion(5.0)
    assert pickle.loads(pickle.dumps(asked)) == asked
    found = dx.simulate(asked, method, records=4)
    copy = pickle.loads(pickle.dumps(found))
    assert copy == found
    np.testing.assert_array_equal(copy.at(0.011).r, found.at(0.011).r)


def test_another_process_finds_the_same_bits() -> None:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        there = list(pool.map(states, WEIGHTS[:2], [dx.Collocation(), dx.DiscreteRod(30)]))
        moved = list(pool.map(trajectory, WEIGHTS[:3], MOTIONS))
    assert there == [states(WEIGHTS[0], dx.Collocation()), states(WEIGHTS[1], dx.DiscreteRod(30))]
    assert moved == list(map(trajectory, WEIGHTS[:3], MOTIONS))
