"""The path that a kernel follows: a column's buckling load lies in the span that it names, steps and predictor keep their rules."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import darboux as dx
from darboux.kernels import path, step_control
from darboux.kernels.rod_equations import STATES
from darboux.kernels.support import NUMBERS
from darboux.kernels.system import FREE
from darboux.statics import collocation_path
from darboux.statics.collocation_equations import Equations
from tests import cases


def test_a_column_turns_unstable_at_eulers_load() -> None:
    """Clamped and free, P_cr = pi^2 EI / (4 L^2), in two planes at once; exact to the length of a crossing."""
    equations = Equations(dx.Equilibrium(cases.UNIT, loads=[dx.EndForce((0, 0, -4.0))]), 2)
    found = collocation_path.follow(equations, equations.unloaded())
    ((before, behind),) = found.crossings
    assert before < np.pi**2 / 16.0 < behind
    assert behind - before <= step_control.CROSSING_STEP
    assert (found.load_factor, found.index) == (1.0, 2)
    assert found.unstable is not None


@pytest.mark.parametrize("corrected", [1e-4, 1e-2, 0.08, 0.3])
@pytest.mark.parametrize("predicted", [1e-3, 0.2, 0.6])
@pytest.mark.parametrize("order", [1, 2])
def test_the_corrector_would_turn_the_rod_as_wanted(order: int, predicted: float, corrected: float) -> None:
    """What it turns grows with the power order + 1 of the step, what the predictor turns with the step."""
    growth = step_control.growth(predicted, corrected, 1e-5, order)
    next_turn, next_share = corrected * growth ** (order + 1), corrected * growth**order / predicted
    assert 0.5 <= growth <= 4.0
    if growth > 0.5:
        assert next_turn <= step_control.WANTED_CORRECTED_TURN * 1.0000001
        assert next_share <= step_control.WANTED_SHARE * 1.0000001
    if growth < 4.0:
        assert max(next_turn / step_control.WANTED_CORRECTED_TURN, next_share / step_control.WANTED_SHARE) > 0.9999999


def test_the_corrector_may_turn_the_rod_by_a_share_of_what_was_predicted() -> None:
    assert step_control.growth(0.1, 1e-6, 1e-5, 2) == 4.0
    assert step_control.allowed(0.2, 1e-5) == 0.1
    assert step_control.allowed(1e-9, 1e-5) == 1e-5
    assert step_control.allowed(10.0, 1e-5) == step_control.LARGEST_CORRECTED_TURN


# -- the predictor -----------------------------------------------------------------------------------------------------


def reals(last: float, factor: float, goal: float, first: float) -> np.ndarray:
    real = np.full(path.REALS, np.nan)
    real[[path.LAST, path.FACTOR, path.GOAL, path.FIRST]] = last, factor, goal, first
    return real


def predicted(
    tangent: Callable[[float], np.ndarray], last: float, factor: float, goal: float, first: float
) -> np.ndarray:
    """What two tangents say of the step from `factor` to `goal`."""
    here, before = tangent(factor), tangent(last)
    lengths = float(np.linalg.norm(here)), float(np.linalg.norm(before))
    share, last_share = path._shares(reals(last, factor, goal, first), *lengths)
    return share * here + last_share * before


@pytest.mark.parametrize("p", [-3.0, -2.0, -1.0, -0.5, 0.0, 0.3, 1.0, 3.0])
@pytest.mark.parametrize("first", [1e-9, 0.01, 0.2])
def test_what_goes_with_a_power_of_the_load_is_predicted_exactly(p: float, first: float) -> None:
    """A tangent that goes with (load + first step)^p, and for p = 0 what goes with the load itself."""
    last, factor, goal = 0.2, 0.3, 0.47
    direction, (a, b) = np.array([0.6, -0.3, 0.2]), (factor + first, goal + first)
    exact = np.log(b / a) if p == -1.0 else (b ** (p + 1.0) - a ** (p + 1.0)) / (p + 1.0)
    found = predicted(lambda x: (x + first) ** p * direction, last, factor, goal, first)
    np.testing.assert_allclose(found, exact * direction, rtol=1e-12)


def test_a_tangent_that_turns_is_predicted_with_order_two() -> None:
    """Along a circle, and along one whose speed grows: what is left over falls with the third power of the steps."""
    for speed in (0.0, 1.5):

        def place(x: float, speed: float = speed) -> np.ndarray:
            angle = (x + 0.1) ** (speed + 1.0)
            return np.array([np.cos(angle), np.sin(angle), 0.0])

        def tangent(x: float, speed: float = speed) -> np.ndarray:
            u = place(x)
            return (speed + 1.0) * (x + 0.1) ** speed * np.array([-u[1], u[0], 0.0])

        gaps = []
        for h in (0.02, 0.01):
            last, goal = 0.5 - 0.7 * h, 0.5 + h
            gaps.append(np.linalg.norm(place(0.5) + predicted(tangent, last, 0.5, goal, 0.1) - place(goal)))
        assert gaps[0] / gaps[1] == pytest.approx(8.0, rel=0.05)


def test_steeper_powers_are_taken_for_the_third() -> None:
    steep, third = (path._shares(reals(0.2, 0.3, 0.4, 0.0), 1.0, (2.0 / 3.0) ** p) for p in (5.0, 3.0))
    np.testing.assert_allclose(steep, third, rtol=1e-12)


@pytest.mark.parametrize(("last", "length", "last_length"), [(np.nan, 1.0, 1.0), (0.1, 0.0, 1.0), (0.1, 1.0, 0.0)])
def test_one_tangent_serves_where_there_are_no_two(last: float, length: float, last_length: float) -> None:
    share, last_share = path._shares(reals(last, 0.3, 0.5, 0.1), length, last_length)
    assert (share, last_share) == (pytest.approx(0.2, rel=1e-15), 0.0)


HALVES = [0.0, 0.2, 0.5, 0.5, 0.8, 1.0]
FINER = [0.0, 0.1, 0.15, 0.35, 0.5, 0.5, 0.6, 0.65, 0.8, 0.9, 1.0]
COARSER = [0.0, 0.5, 0.5, 1.0]


def course_of(nodes: list[float], room: int) -> path.Course:
    course = collocation_path._course(room, 2, 1, np.zeros(3 * NUMBERS), shaped=False)
    course.here.x[: len(nodes)], course.whole[path.HERE] = nodes, len(nodes) - 1
    return course


@pytest.mark.parametrize("better", [HALVES, FINER, COARSER], ids=["same", "finer", "coarser"])
def test_the_last_tangent_on_a_better_mesh_is_the_old_ones_interpolation(better: list[float]) -> None:
    """Between two nodes their mean by distance; at a joint both sides keep their own."""
    course, rng = course_of(HALVES, 12), np.random.default_rng(1)
    old = rng.normal(size=(len(HALVES), FREE))
    course.tangent[: old.size] = old.ravel()
    course.tried.x[: len(better)], course.whole[path.TRIED] = better, len(better) - 1
    path._keep_last_tangent(course)
    x, y = np.array(HALVES), np.array(better)
    joint, k = HALVES.index(0.5) + 1, better.index(0.5) + 1
    sides = ((y[:k], x[:joint], old[:joint]), (y[k:], x[joint:], old[joint:]))
    expected = [np.array([np.interp(at, nodes, part[:, a]) for a in range(FREE)]).T for at, nodes, part in sides]
    found = course.last_tangent[: len(better) * FREE].reshape(-1, FREE)
    np.testing.assert_allclose(found, np.concatenate(expected), atol=1e-15)


DEAD = [dx.EndForce((3.0, 0.5, -4.0)), dx.LineForce((2.0, -1.0, 3.0)), dx.PointForce((1.0, 2.0, -1.0), at=0.4)]
BENT = dx.Rod(1.0, dx.Stiffness(EI1=1.4, EI2=1.0, GJ=0.7), natural=(0.5, 0.2, 1.0))


def stepwise(
    monkeypatch: pytest.MonkeyPatch, problem: dx.Equilibrium, each: Callable[[path.Rod, path.Course], None]
) -> int:
    """Follow a path, `each` called before each of its steps; return how many steps it took."""
    follow = path.follow

    def one(rod: path.Rod, course: path.Course, most: int) -> int:
        if course.whole[path.PHASE] == path.BEGINNING:
            follow(rod, course, 0)  # which only begins
        if course.whole[path.PHASE] == path.PREDICTING and course.real[path.FACTOR] < 1.0:
            each(rod, course)
        return int(follow(rod, course, most))

    monkeypatch.setattr(collocation_path, "TRIES", 1)
    monkeypatch.setattr(collocation_path.kernel, "follow", one)
    equations = Equations(problem, 2)
    found = collocation_path.follow(equations, equations.unloaded())
    assert found.load_factor == 1.0
    return found.steps


def test_forces_that_go_with_the_load_are_predicted_exactly(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a cantilever under dead loads, whatever its shape does."""
    before, forces = [], []

    def look(rod: path.Rod, course: path.Course) -> None:
        copy = path.Course(*(_copy(part) for part in course))
        assert path._predict(rod, copy) == path.GO_ON
        elements = copy.whole[path.TRIED] + 1
        here, tried = (nodes.y[: elements * STATES].reshape(-1, STATES) for nodes in (copy.here, copy.tried))
        before.append(np.isfinite(copy.real[path.LAST]))
        if copy.real[path.FACTOR] > 0.0:
            grown = copy.real[path.GOAL] / copy.real[path.FACTOR]
            forces.append(np.max(np.abs(tried[:, 7:10] - grown * here[:, 7:10])) / np.max(np.abs(tried[:, 7:10])))

    assert stepwise(monkeypatch, dx.Equilibrium(BENT, loads=DEAD), look) == len(before)
    assert before == [False] + [True] * (len(before) - 1)
    assert len(forces) >= 3
    assert max(forces) < 1e-12


def _copy(part: Any) -> Any:
    """A copy of what a course holds."""
    if isinstance(part, tuple):
        return type(part)(*(_copy(inner) for inner in part))
    return part.copy() if isinstance(part, np.ndarray) else part


@pytest.mark.parametrize("loads", [DEAD, [dx.EndForce((60.0, 20.0, -40.0))]], ids=["soft", "hard"])
def test_the_next_step_follows_from_what_the_corrector_did(monkeypatch: pytest.MonkeyPatch, loads: list) -> None:
    """The first by the order of one tangent, the others by that of two."""
    turns, taken = [], []

    def look(rod: path.Rod, course: path.Course) -> None:
        real = course.real
        if course.whole[path.TAKEN] > len(taken):
            step = real[path.FACTOR] - real[path.LAST]
            order = 1 if len(taken) == 0 else 2
            growth = step_control.growth(turns[-1] * step, real[path.CORRECTED], rod.unseen, order)
            np.testing.assert_allclose(real[path.STEP], growth * step, rtol=1e-12)
            taken.append(growth)
        turns.append(real[path.TURN])

    assert stepwise(monkeypatch, dx.Equilibrium(BENT, loads=loads), look) == len(turns) == len(taken) + 1
    assert any(0.5 < growth < 4.0 for growth in taken[1:])
