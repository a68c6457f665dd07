"""What must not change an answer: turning and moving the whole problem, swapping the ends, changing the units."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import darboux as dx
from darboux import frames

METHODS = [dx.Collocation(), dx.Shooting(), dx.DiscreteRod(20)]
S = np.linspace(0.0, 1.0, 11)
QUICK = settings(max_examples=12, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
ALL = pytest.mark.parametrize("method", METHODS, ids=lambda m: type(m).__name__)


def near(method: object) -> float:
    """How near two answers must be: the solver of record's to 1e-10."""
    return 1e-10 if isinstance(method, dx.Collocation) else 3e-9


numbers = st.floats(-1.5, 1.5).map(lambda x: round(x, 3))
vectors = st.tuples(numbers, numbers, numbers)
stiffnesses = st.floats(0.5, 3.0).map(lambda x: round(x, 3))


@st.composite
def problems(draw: st.DrawFn) -> dx.Equilibrium:
    """A clamped, anisotropic, naturally curved rod under weight, a tip force and a tip moment."""
    section = dx.Stiffness(EI1=draw(stiffnesses), EI2=draw(stiffnesses), GJ=draw(stiffnesses), EA=500.0, mass=0.3)
    rod = dx.Rod(1.0, section, natural=draw(vectors), stretch=draw(st.booleans()))
    loads = [
        dx.Gravity(),
        dx.EndForce(draw(vectors), offset=0.2 * np.array(draw(vectors))),
        dx.EndMoment(draw(vectors)),
        dx.Rotation(draw(vectors), draw(vectors)),
    ]
    return dx.Equilibrium(rod, loads=loads)


def mapped(load, turn, force=1.0, moment=1.0, length=1.0, swap=False):
    """The load in a turned frame, in other units, or with the ends exchanged."""
    at = {"at": "start"} if swap else {}
    match load:
        case dx.EndForce():
            offset = np.array(load.offset) * length * ((1.0, -1.0, -1.0) if swap else 1.0)
            return dx.EndForce(turn @ load.force * force, offset=offset, **at)
        case dx.EndMoment():
            return dx.EndMoment(turn @ load.moment * moment, **at)
        case dx.Gravity():
            return dx.Gravity(turn @ load.g)
        case dx.Rotation():
            return dx.Rotation(turn @ load.omega, turn @ load.point * length)
    raise AssertionError(load)


@ALL
@QUICK
@given(problem=problems(), q=st.tuples(numbers, numbers, numbers, st.just(1.0)), shift=vectors)
def test_turning_and_moving_the_whole_problem(method, problem, q, shift) -> None:
    R = frames.matrix_of_quaternion(np.array(q))
    loads = [mapped(load, R) for load in problem.loads]
    loads = [dx.Rotation(x.omega, np.array(x.point) + shift) if isinstance(x, dx.Rotation) else x for x in loads]
    turned = dataclasses.replace(problem, start=dx.Clamped(position=shift, frame=R), loads=loads)
    a, b = dx.solve(problem, method), dx.solve(turned, method)
    np.testing.assert_allclose(b.r(S), a.r(S) @ R.T + shift, atol=near(method))
    np.testing.assert_allclose(b.m(S), a.m(S) @ R.T, atol=10 * near(method))


@ALL
@QUICK
@given(problem=problems())
def test_swapping_the_ends(method, problem) -> None:
    """Run backwards: d3 and d2 turn round (d1 stays), k1 keeps its sign, k2 and k3 too by the same half turn.

    With s' = L - s and d' = (d1, -d2, -d3): u' = -u, so k' = (-k1, k2, k3).
    """
    k0 = np.array(problem.rod.natural) * (-1.0, 1.0, 1.0)
    rod = dataclasses.replace(problem.rod, natural=k0)
    half_turn = np.diag([1.0, -1.0, -1.0])
    loads = [mapped(load, np.eye(3), swap=True) for load in problem.loads]
    swapped = dx.Equilibrium(rod, start=dx.Free(), end=dx.Clamped(frame=half_turn), loads=loads)
    a, b = dx.solve(problem, method), dx.solve(swapped, method)
    np.testing.assert_allclose(b.r(1.0 - S), a.r(S), atol=near(method))
    np.testing.assert_allclose(b.m(1.0 - S), -a.m(S), atol=10 * near(method))
    np.testing.assert_allclose(b.tip, a.tip, atol=near(method))


@ALL
@pytest.mark.parametrize("length", [1e-6, 1e6])
@QUICK
@given(problem=problems(), stiffness=st.sampled_from([1e-24, 1.0, 1e15]))
def test_a_micrometre_filament_and_a_kilometre_of_cable(method, length, problem, stiffness) -> None:
    """Lengths times c, stiffnesses times b: forces b / c^2, moments b / c, the same shape times c."""
    old = problem.rod.section
    force, moment = stiffness / length**2, stiffness / length
    mass = 0.3 * force / length  # the weight per length, at the same g
    EI = {name: getattr(old, name) * stiffness for name in ("EI1", "EI2", "GJ")}
    section = dx.Stiffness(**EI, EA=500.0 * force, mass=mass)
    rod = dx.Rod(length, section, natural=np.array(problem.rod.natural) / length, stretch=problem.rod.stretch)
    loads = [mapped(load, np.eye(3), force, moment, length) for load in problem.loads]
    # The centrifugal force goes with mass omega^2 length: the speed falls by the root of the length.
    loads = [
        dx.Rotation(np.array(x.omega) / np.sqrt(length), x.point) if isinstance(x, dx.Rotation) else x for x in loads
    ]
    scaled = dx.Equilibrium(rod, loads=loads)
    a, b = dx.solve(problem, method), dx.solve(scaled, method)
    np.testing.assert_allclose(b.r(S * length) / length, a.r(S), atol=1e-10)
    np.testing.assert_allclose(b.energy.elastic / moment, a.energy.elastic, rtol=1e-9, atol=1e-12)


@QUICK
@given(problem=problems())
def test_random_rods_by_both_methods(problem) -> None:
    """Every random rod: Shooting and the discrete rod close in on each other with order 2."""
    exact = dx.solve(problem).r(S)
    gaps = [np.max(np.linalg.norm(dx.solve(problem, dx.DiscreteRod(N)).r(S) - exact, axis=1)) for N in (100, 200)]
    assert gaps[1] < 1e-3
    assert gaps[1] < 1e-8 or 1.7 < np.log2(gaps[0] / gaps[1]) < 2.4
