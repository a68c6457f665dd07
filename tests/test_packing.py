"""What methods read of a problem: the same numbers in any units, from any place, and by parts as together."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from darboux.packing.loads import COUPLE, DEAD, FOLLOWER, GRADIENT, LOADS, SECTION_COUPLE
from darboux.packing.problem import Packing
from tests import cases

X = np.linspace(0.0, 1.0, 7)
NODES = np.array([0.0, 0.15, 0.3, 0.5, 0.75, 1.0])


def bent_rod() -> dx.Rod:
    return dx.Rod(1.3, dx.Stiffness(EI1=1.0, EI2=1.7, GJ=0.7, mass=2.0), natural=(0.3, 0.5, 0.7))


def stated(L: float, F: float, place: np.ndarray) -> dx.Equilibrium:
    """One problem in which lengths are L times and forces F times as large, and which lies elsewhere."""
    section = dx.Stiffness(EI1=lambda s: F * L**2 * (1.0 + s / L), EI2=2.0 * F * L**2, GJ=0.8 * F * L**2, EA=40.0 * F)
    rod = dx.Rod(L, section, natural=(0.3 / L, 0.2 / L, 0.5 / L), stretch=True)
    loads = [
        dx.LineForce((0.4 * F / L, 0.0, -F / L)),
        dx.LineForce((0.0, 0.3 * F / L, 0.0), frame="section"),
        dx.LineCouple((0.1 * F, 0.2 * F, 0.0), frame="section"),
        dx.Foundation(3.0 * F / L**2, point=place + np.array([0.0, 0.1 * L, 0.0])),
        dx.PointForce((F, 0.0, 0.5 * F), at=0.3 * L, offset=(0.0, 0.1 * L, 0.0)),
        dx.EndMoment((0.0, 0.2 * F * L, 0.1 * F * L), follower=True),
        dx.EndMoment((0.3 * F * L, 0.0, 0.0)),
    ]
    spring = dx.Spring(linear=5.0 * F / L, rotational=0.2 * F * L, position=place + np.array([0.0, 0.1, 0.9]) * L)
    return dx.Equilibrium(rod, dx.Clamped(position=place), spring, loads)


def test_units_and_the_origin_leave_no_trace() -> None:
    one, other = Packing(stated(1.0, 1.0, np.zeros(3))), Packing(stated(300.0, 7e-5, np.array([40.0, -900.0, 70.0])))
    largest = np.max(np.abs(one.columns(X)), axis=0)
    np.testing.assert_allclose(other.columns(X), one.columns(X), rtol=1e-11, atol=1e-11 * np.max(largest))
    for (x, a), (y, b) in zip(one.supports, other.supports, strict=True):
        assert x == y
        np.testing.assert_allclose(b.numbers(0.7), a.numbers(0.7), rtol=1e-11, atol=1e-11)
    for part, value in vars(one.stations[0][1].load).items():
        np.testing.assert_allclose(vars(other.stations[0][1].load)[part], value, rtol=1e-13)
    assert [x for x, _ in one.supports] == [0.0, 1.0]
    assert one.points == pytest.approx([0.3])
    assert not one.has_potential


def test_the_columns_of_loads_are_their_law() -> None:
    problem = dx.Equilibrium(bent_rod(), loads=[dx.LineForce((1.0, 2.0, -3.0)), dx.Foundation(3.0)])
    packing, scale = Packing(problem), Packing(problem).scale
    c, r = packing.columns(X)[:, LOADS], np.random.default_rng(0).normal(size=(len(X), 3))
    f = c[:, DEAD] + np.einsum("nij,nj->ni", c[:, GRADIENT].reshape(-1, 3, 3), r)
    given = problem.distributed(X * scale.length).force(scale.origin + scale.length * r, np.zeros((len(X), 3, 3)))
    np.testing.assert_allclose(f * scale.force / scale.length, given, rtol=1e-13)
    for rest in (FOLLOWER, COUPLE, SECTION_COUPLE):
        assert not np.any(c[:, rest])


def test_loads_by_themselves_add_up_to_all_of_them() -> None:
    loads = [load for load in cases.LOADS.values() if not load.of_shape]
    problem = dx.Equilibrium(bent_rod(), loads=loads)
    packing = Packing(problem)
    groups = [packing.group(some) for some in (loads[::2], loads[1::2])]
    np.testing.assert_allclose(sum(g.columns(X) for g in groups), packing.columns(X)[:, LOADS], rtol=1e-12, atol=1e-14)
    for name, end in zip(("start", "end"), packing.ends, strict=True):
        for part, whole in vars(end.load).items():
            np.testing.assert_allclose(sum(getattr(g.at_end(name), part) for g in groups), whole, atol=1e-14)
    at_points = [station.load for _, station in packing.stations]
    for own, whole in zip(zip(*(g.at_points() for g in groups), strict=True), at_points, strict=True):
        np.testing.assert_allclose(own[0].force + own[1].force, whole.force, atol=1e-14)
        np.testing.assert_allclose(own[0].eccentric + own[1].eccentric, whole.eccentric, atol=1e-14)


def test_means_over_edges_and_cells() -> None:
    """Gauss' rule is exact for cubics, and between the places at which the data jump."""
    jump = dx.Table((0.0, 0.4, 0.4001, 1.0), (1.0, 1.0, 2.0, 2.0))
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.0, GJ=jump, mass=1.0))
    cells = Packing(dx.Equilibrium(rod)).cells(NODES)
    cubic = lambda x: np.stack([x**3, np.where(x < 0.4, 1.0, 3.0)], axis=1)  # noqa: E731
    a, b = NODES[:-1], NODES[1:]
    found = cells.on_edges(cubic)
    np.testing.assert_allclose(found[:, 0], (b**4 - a**4) / (4.0 * (b - a)), rtol=1e-13)
    np.testing.assert_allclose(found[:, 1], [1.0, 1.0, 2.0, 3.0, 3.0], rtol=1e-3)
    np.testing.assert_allclose(cells.at_vertices(cubic)[:, 0] @ cells.V, 0.25, rtol=1e-13)
    np.testing.assert_allclose(cells.V.sum(), 1.0)


def test_an_end_that_is_released_holds_nothing_and_keeps_its_load() -> None:
    problem = dx.Equilibrium(bent_rod(), end=dx.Pinned((0, 0, 1.2)), loads=[dx.EndMoment((0.0, 0.3, 0.0))])
    packing = Packing(problem)
    free = packing.released(["start", "end"])
    assert [x for x, _ in packing.supports] == [0.0, 1.0]
    assert free.supports == []
    np.testing.assert_array_equal(free.end.load.moment, packing.end.load.moment)
    assert free.end.load.moment[1] > 0.0


def test_mass_and_what_resists_twisting() -> None:
    disc = Packing(dx.Equilibrium(dx.Rod(2.0, dx.Circle(0.01), dx.Material(E=1e9, nu=0.3, density=1000.0))))
    np.testing.assert_allclose(disc.masses(X, "test"), 1000.0 * np.pi * 1e-4 * 2.0, rtol=1e-14)
    np.testing.assert_allclose(disc.masses.gyration(X), 0.5 * 1e-4 / 4.0, rtol=1e-12)  # radius^2 / 2, over L^2
    np.testing.assert_allclose(disc.masses.rotary(X, None), disc.masses(X, "test") * 0.5e-4, rtol=1e-12)
    np.testing.assert_allclose(disc.masses.rotary(X, 3.0), 6.0)
    bare = Packing(dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.0, GJ=1.0))))
    assert not bare.masses.known
    assert not bare.masses.rotary_is_known(None)
    with pytest.raises(dx.InvalidInput, match="rotary_inertia"):
        bare.masses.rotary(X, None)
