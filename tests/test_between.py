"""Supports between the ends: beams on several supports, and what they may not change."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx

ROD = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.75, mass=1.0))
FLAT = dx.Rod(1.0, dx.Stiffness(EI1=1.4, EI2=1.0, GJ=0.75))
ALONG = (0, 0, 1)


def on_line(s: float) -> dx.Roller:
    return dx.Roller(along=ALONG, position=(0, 0, s))


@pytest.mark.parametrize(
    ("places", "shares"),  # of w L: the three-moment equation (Timoshenko, Strength of Materials I, 1955, art. 49)
    [
        ((0.5,), [3 / 16, 10 / 16, 3 / 16]),
        ((1 / 3, 2 / 3), [0.4 / 3, 1.1 / 3, 1.1 / 3, 0.4 / 3]),
        ((0.25, 0.5, 0.75), [11 / 112, 32 / 112, 26 / 112, 32 / 112, 11 / 112]),
    ],
)
def test_a_beam_on_several_supports(places: tuple[float, ...], shares: list[float]) -> None:
    """Small load: the reactions of the continuous beam, which deflect by second order only."""
    w = 1e-3
    between = {s: on_line(s) for s in places}
    x = dx.solve(dx.Equilibrium(ROD, dx.Pinned(), on_line(1.0), [dx.LineForce((w, 0, 0))], between))
    reactions = [x.reactions.start, *x.reactions.between.values(), x.reactions.end]
    assert list(x.reactions.between) == pytest.approx(places)
    np.testing.assert_allclose([-r.force[0] / w for r in reactions], shares, rtol=1e-7)
    for r in reactions[1:-1]:
        np.testing.assert_allclose(r.moment, 0.0, atol=1e-15)
        assert abs(r.force[2]) < 1e-15


def test_reactions_balance_the_loads_at_large_deflections() -> None:
    load, point = np.array([3.0, 2.0, -4.0]), np.array([1.0, -5.0, 0.5])
    between = {0.4: dx.Pinned((0.1, 0.05, 0.35)), 0.7: dx.Spring(linear=50.0, position=(0, 0, 0.6))}
    loads = [dx.EndForce(load), dx.PointForce(point, at=0.4), dx.PointForce((0, 2, 0), at=0.55), dx.Gravity((0, 0, 1))]
    x = dx.solve(dx.Equilibrium(ROD, loads=loads, between=between))
    np.testing.assert_allclose(x.r(0.4), (0.1, 0.05, 0.35), atol=1e-11)
    forces = [x.reactions.start.force, *(r.force for r in x.reactions.between.values())]
    np.testing.assert_allclose(sum(forces) + load + point + (0, 2, 0) + (0, 0, 1), 0.0, atol=1e-8)
    np.testing.assert_allclose(x.reactions.between[0.7].force, -50.0 * (x.r(0.7) - np.array([0, 0, 0.6])), atol=1e-8)
    s = np.linspace(0, 1, 4001)
    weight = np.trapezoid(np.cross(x.r(s), (0, 0, 1.0)), s, axis=0)
    moments = [x.reactions.start.moment, np.cross(x.r(0.4), point), np.cross(x.r(0.55), (0, 2, 0)), weight]
    moments += [np.cross(x.tip, load), *(np.cross(x.r(s), r.force) for s, r in x.reactions.between.items())]
    np.testing.assert_allclose(sum(moments), 0.0, atol=1e-6)


def test_a_clamp_between_the_ends_parts_the_rod_in_two() -> None:
    """Beyond the clamp is a cantilever of half the length, before it nothing happens."""
    clamp = dx.Clamped(position=(0, 0, 0.5))
    section = dx.Stiffness(EI1=1.0, GJ=0.75, EA=1e3)
    whole, part = (dx.Rod(length, section, stretch=True) for length in (1.0, 0.5))
    x = dx.solve(dx.Equilibrium(whole, loads=[dx.EndForce((3, 0, 0))], between={0.5: clamp}))
    half = dx.solve(dx.Equilibrium(part, start=clamp, loads=[dx.EndForce((3, 0, 0))]))
    np.testing.assert_allclose(x.tip, half.tip, atol=1e-10)
    np.testing.assert_allclose(x.reactions.between[0.5].moment, half.reactions.start.moment, atol=1e-9)
    np.testing.assert_allclose(x.r(0.25), (0, 0, 0.25), atol=1e-12)


def test_a_taut_part_is_named() -> None:
    problem = dx.Equilibrium(ROD, loads=[dx.EndForce((3, 0, 0))], between={0.5: dx.Clamped(position=(0, 0, 0.5))})
    with pytest.raises(dx.NotConverged, match="taut"):
        dx.solve(problem)


@pytest.mark.parametrize(("load", "stable"), [(0.98, True), (1.02, False)])
def test_a_support_in_the_middle_makes_eulers_column_four_times_stronger(load: float, stable: bool) -> None:
    P = load * 4.0 * np.pi**2 * 1.0
    problem = dx.Equilibrium(FLAT, dx.Pinned(), on_line(1.0), [dx.EndForce((0, 0, -P))], {0.5: on_line(0.5)})
    x = dx.solve(problem)
    straight = np.max(np.abs(x.r(np.linspace(0, 1, 21))[:, :2])) < 1e-6
    assert straight == stable
    assert x.stable
    np.testing.assert_allclose(x.r(0.5)[:2], 0.0, atol=1e-10)


def test_a_rod_that_only_supports_between_its_ends_hold() -> None:
    """A mast on two pins, its ends free: moments balance about the first pin."""
    w = 0.01
    between = {0.3: dx.Pinned((0, 0, 0.3)), 0.7: on_line(0.7)}
    x = dx.solve(dx.Equilibrium(ROD, dx.Free(), dx.Free(), [dx.LineForce((w, 0, 0))], between))
    forces = [r.force[0] for r in x.reactions.between.values()]
    np.testing.assert_allclose(forces, [-0.5 * w, -0.5 * w], rtol=1e-4)
    np.testing.assert_allclose(x.m(0.0), 0.0, atol=1e-14)


def test_moved_supports_bend_the_rod() -> None:
    """A pin of small displacement u in the middle of a pinned rod: F = 48 EI u / L^3."""
    u = 1e-4
    problem = dx.Equilibrium(ROD, dx.Pinned(), on_line(1.0), between={0.5: dx.Roller(ALONG, (u, 0, 0.5))})
    assert dx.solve(problem).reactions.between[0.5].force[0] == pytest.approx(48.0 * u, rel=1e-6)


@pytest.mark.parametrize(
    ("between", "words"),
    [
        ({1.2: dx.Pinned()}, r"problem.between has a support at s = 1.2 m, but the rod runs from 0 to 1 m"),
        ({0.5: dx.Free()}, r"problem.between\[0.5\] is Free\(\), which holds nothing"),
        ({0.5: dx.Gravity()}, r"problem.between\[0.5\] is Gravity.*a support"),
        (
            {0.5: dx.Pinned((0, 0, 0.8))},
            r"the supports at s = 0 and 0.5 m are 0.8 m apart, but the rod between them is 0.5 m",
        ),
        (dx.Pinned(), "problem.between is Pinned.*supports by their s"),
    ],
)
def test_mistakes_are_named(between: object, words: str) -> None:
    with pytest.raises(dx.InvalidInput, match=words):
        dx.Equilibrium(ROD, between=between)


@pytest.mark.parametrize("method", [dx.Shooting(), dx.Elastica()])
def test_other_methods_say_that_they_have_no_support_there(method: object) -> None:
    with pytest.raises(dx.InvalidInput, match=r"between its ends, at s = 0.5 m; use Collocation"):
        dx.solve(dx.Equilibrium(ROD, between={0.5: on_line(0.5)}), method)
