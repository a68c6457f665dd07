"""Closed rings: closed forms of the twisted circle, Michell's instability, natural curvature."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx

GJ = 0.75
ROUND = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=GJ))
FLAT = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=3.0, GJ=GJ))
CRITICAL = np.sqrt(3.0) / GJ  # turns: 2 pi sqrt(3) B / C (J. H. Michell, Messenger of Math. 19 (1890) 181)
POINTS = np.linspace(0.0, 1.0, 41)


@pytest.mark.parametrize("link", [0.0, 0.25, 1.0, -2.0])
def test_a_twisted_ring_is_a_circle(link: float) -> None:
    """E = 2 pi^2 EI / L + 1/2 GJ (2 pi link)^2 / L, |m|^2 = (2 pi EI)^2 + (2 pi link GJ)^2 over L^2."""
    x = dx.solve(dx.Ring(ROUND, link=link))
    assert x.energy.total == pytest.approx(2.0 * np.pi**2 + 0.5 * GJ * (2.0 * np.pi * link) ** 2, rel=1e-10)
    moment = 2.0 * np.pi * np.hypot(1.0, GJ * link)
    np.testing.assert_allclose(np.linalg.norm(x.m(POINTS), axis=1), moment, rtol=1e-9)
    np.testing.assert_allclose(x.k(POINTS)[:, 2], 2.0 * np.pi * link, atol=1e-8)
    np.testing.assert_allclose(x.tip, 0.0, atol=1e-10)
    np.testing.assert_allclose(x.reactions.start.force + x.reactions.end.force, 0.0, atol=1e-9)
    assert x.stable


def test_a_link_that_is_all_but_zero() -> None:
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=2.0, GJ=GJ), natural=(0, 1, 0))
    assert dx.solve(dx.Ring(rod, link=1e-6)).link == pytest.approx(1e-6, rel=1e-4)


@pytest.mark.parametrize(("link", "stable"), [(0.97 * CRITICAL, True), (1.03 * CRITICAL, False)])
def test_michells_ring(link: float, stable: bool) -> None:
    """The circle loses its stability at 2 pi sqrt(3) EI / GJ; beyond, it passes through itself."""
    assert dx.solve(dx.Ring(ROUND, link=link), dx.Collocation(stable=False)).stable == stable
    assert dx.solve(dx.Ring(ROUND, link=link)).stable


@pytest.mark.parametrize(("share", "index"), [(0.998, 0), (1.002, 2), (-1.002, 2)])
def test_the_index_of_a_discrete_ring_on_both_sides_of_michells(share: float, index: int) -> None:
    """Two waves around the ring, in two places: two directions. That the ring may roll about its centreline is none."""
    assert dx.solve(dx.Ring(ROUND, link=share * CRITICAL), dx.DiscreteRod(200, stable=False)).index == index


@pytest.mark.parametrize("segments", [3, 4, 5])
def test_the_coarsest_ring_is_stable(segments: int) -> None:
    """Bending half way between edges is the same whatever the twist; along their mean directors it would fall with it."""
    assert dx.solve(dx.Ring(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=2 / 3))), dx.DiscreteRod(segments)).index == 0


def test_a_discrete_ring_under_load_is_discrete() -> None:
    """A flat ring, twisted by half a turn, hangs from a section: places, forces and moments against Collocation."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.3, GJ=GJ), natural=(0.3, 1.0, 0.0))
    problem = dx.Ring(rod, link=0.5, start=dx.Clamped(tangent=(1, 0, 0)), loads=[dx.LineForce((0, 3.0, -20.0))])
    exact = dx.solve(problem)
    found = [dx.solve(problem, dx.DiscreteRod(N)) for N in (60, 120)]
    for name in "rnm":
        wanted = getattr(exact, name)(POINTS)
        gaps = [np.max(np.abs(getattr(x, name)(POINTS) - wanted)) for x in found]
        assert 1.8 < np.log2(gaps[0] / gaps[1]) < 2.2, f"{name}: {gaps}, declared order 2"
    np.testing.assert_allclose(
        found[1].reactions.start.force + found[1].reactions.end.force, (0, -3.0, 20.0), atol=1e-7
    )


@pytest.mark.parametrize("ratio", [1.0, 2.0 / 3.0])
def test_vibrations_of_a_ring(ratio: float) -> None:
    """Free of stress, n waves around, R = EI = rhoA = 1: n^2 (n^2 - 1)^2 / (n^2 + 1) in its plane, / (n^2 + EI / GJ) out of it.

    A. E. H. Love, Mathematical Theory of Elasticity, art. 293. First come six rigid motions, then every mode twice.
    """
    rod = dx.Rod(2.0 * np.pi, dx.Stiffness(EI1=1.0, GJ=ratio, mass=1.0), natural=(0, 1.0, 0))
    found = dx.natural_modes(dx.Ring(rod), 14, segments=198).frequencies * dx.turn
    n = np.array([2.0, 3.0])
    wanted = np.concatenate([n * (n**2 - 1.0) / np.sqrt(n**2 + more) for more in (1.0, 1.0 / ratio)])
    np.testing.assert_allclose(found, np.sort([*[0.0] * 6, *wanted, *wanted]), rtol=1e-4)


def test_a_ring_of_a_naturally_round_rod_is_free_of_stress() -> None:
    x = dx.solve(dx.Ring(dx.Rod(1.0, ROUND.section, natural=(0, 2 * np.pi, 0))))
    np.testing.assert_allclose(x.m(POINTS), 0.0, atol=1e-10)


def test_an_overcurved_ring_leaves_the_plane() -> None:
    """A round rod curved three times as much as its ring: it coils to three loops, free of stress (Audoly and Seffen 2015)."""
    x = dx.solve(dx.Ring(dx.Rod(1.0, ROUND.section, natural=(0, 6 * np.pi, 0))))
    assert x.stable
    assert x.energy.total < 1e-8
    assert np.max(np.linalg.norm(x.r(POINTS), axis=1)) == pytest.approx(1.0 / (3 * np.pi), rel=1e-3)


def test_a_flat_ring_bends_about_its_soft_side() -> None:
    x = dx.solve(dx.Ring(FLAT))
    assert x.energy.total == pytest.approx(2.0 * np.pi**2, rel=1e-10)


def test_a_twisted_flat_ring_is_no_circle() -> None:
    """A Moebius-like strip: below the circle's energy with mean stiffness, closed in place and frame."""
    x = dx.solve(dx.Ring(FLAT, link=0.5))
    np.testing.assert_allclose(x.tip, 0.0, atol=1e-9)
    half = np.diag([-1.0, -1.0, 1.0])  # the section is back after half a turn about d3
    np.testing.assert_allclose(x.R(1.0), x.R(0.0) @ half, atol=1e-9)
    stiff = 1.0 / (0.5 * (1.0 + 1.0 / 3.0))  # a circle whose section turns evenly bends with the harmonic mean at best
    assert 2.0 * np.pi**2 < x.energy.bending + x.energy.twist < 2.0 * np.pi**2 * 2.0 + 0.5 * GJ * np.pi**2
    assert x.energy.total < 2.0 * np.pi**2 * stiff + 0.5 * GJ * np.pi**2 * 4.0


def test_a_loaded_ring_balances() -> None:
    """Under its weight a ring that hangs from one section: the reactions carry it."""
    ring = dx.Ring(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=GJ, mass=1.0)), start=dx.Clamped(tangent=(1, 0, 0)))
    x = dx.solve(ring.with_load(dx.Gravity((0, 0, -30.0))))
    np.testing.assert_allclose(x.reactions.start.force + x.reactions.end.force, (0, 0, 30.0), atol=1e-7)
    assert x.r(0.5)[2] < -1.0 / np.pi  # longer than the circle


def test_what_a_ring_refuses() -> None:
    with pytest.raises(dx.InvalidInput, match=r"Ring has no argument 'end'"):
        dx.Ring(ROUND, end=dx.Free())
    with pytest.raises(dx.InvalidInput, match=r"ring.start is Pinned.*a Clamped"):
        dx.Ring(ROUND, start=dx.Pinned())
    with pytest.raises(dx.InvalidInput, match=r"ring.link is 'two'"):
        dx.Ring(ROUND, link="two")
    for method in (dx.Shooting(), dx.Elastica()):
        with pytest.raises(dx.InvalidInput, match=r"closed to a Ring.*use Collocation"):
            dx.solve(dx.Ring(ROUND), method)
    soft = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=GJ, EA=100.0), stretch=True)
    with pytest.raises(dx.InvalidInput, match=r"ring stretches.*use Collocation"):
        dx.solve(dx.Ring(soft), dx.DiscreteRod(20))
    with pytest.raises(dx.InvalidInput, match=r"a Ring on equal segments; leave out grading"):
        dx.solve(dx.Ring(ROUND), dx.DiscreteRod(20, grading=2.0))
    with pytest.raises(dx.InvalidInput, match=r"leave out about"):
        dx.natural_modes(dx.Ring(ROUND), about="equilibrium")


def test_a_ring_is_a_value() -> None:
    assert dx.Ring(ROUND, link=2) == dx.Ring(ROUND, link=2.0) != dx.Ring(ROUND, link=3)
    assert dx.Ring(ROUND, link=2).with_load(dx.LineForce((0, 0, 1))).link == 2.0
