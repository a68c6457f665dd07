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
WEIGHTS = (5.0, 10.0, 15.0, 20.0)


def states(weight: float, method: Any) -> bytes:
    return dx.solve(cases.heavy(weight), method).curve.y.tobytes()


def positions(weight: float) -> bytes:
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7, EA=1e3, mass=1.0))
    hanging = dx.Equilibrium(rod, start=cases.ALONG_X, loads=[dx.Gravity((0, -weight, 0))])
    return dx.simulate(dx.Motion(hanging, duration=0.02), dx.ImplicitMidpoint(20, step=1e-3)).positions.tobytes()


@pytest.mark.parametrize("method", METHODS, ids=lambda method: type(method).__name__)
def test_threads_do_not_disturb_each_other(method: Any) -> None:
    alone = [states(weight, method) for weight in WEIGHTS]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(states, WEIGHTS * 3, [method] * 12))
    assert together == alone * 3


def test_motions_in_threads() -> None:
    alone = [positions(weight) for weight in WEIGHTS]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(positions, WEIGHTS)) == alone


@pytest.mark.parametrize("method", METHODS, ids=lambda method: type(method).__name__)
def test_solutions_pickle(method: Any) -> None:
    solution = dx.solve(cases.heavy(5.0), method)
    copy = pickle.loads(pickle.dumps(solution))
    assert copy == solution
    np.testing.assert_array_equal(copy.m(0.3), solution.m(0.3))
    assert copy.stable == solution.stable


def test_trajectories_pickle() -> None:
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7, EA=1e3, mass=1.0), stretch=True)
    motion = dx.Motion(dx.Equilibrium(rod, loads=[dx.Gravity((1, 0, 0))]), duration=0.01)
    trajectory = dx.simulate(motion, dx.TRBDF2(8))
    assert pickle.loads(pickle.dumps(trajectory)) == trajectory


def test_another_process_finds_the_same_bits() -> None:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        there = list(pool.map(states, WEIGHTS[:2], [dx.Collocation(), dx.DiscreteRod(30)]))
    assert there == [states(WEIGHTS[0], dx.Collocation()), states(WEIGHTS[1], dx.DiscreteRod(30))]
