"""Stiff wires pushed together: with a stretch of a millionth all their buckling loads are met within the first of the way."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx

STEEL = dx.Material(E=210e9, nu=0.3, density=7850)
PINS = (dx.Pinned(), dx.Pinned((0.9, 0, 0)))
CLAMPS = (dx.Clamped(tangent=(1, 0, 0)), dx.Clamped((0.9, 0, 0), tangent=(1, 0, 0)))


def wire(radius: float, *, stretch: bool) -> dx.Rod:
    return dx.Rod(1.0, dx.Circle(radius), STEEL, stretch=stretch)


@pytest.mark.parametrize("radius", [5e-4, 2e-3, 1e-2])
@pytest.mark.parametrize("ends", [PINS, CLAMPS], ids=["pins", "clamps"])
@pytest.mark.parametrize("loads", [[], [dx.Gravity()]], ids=["buckled", "hanging"])
def test_stretch_changes_little(radius: float, ends, loads) -> None:
    """The stable bow of a wire that stretches is that of one that does not, but for EI / EA L^2 and its weight."""
    exact, found = (dx.solve(dx.Equilibrium(wire(radius, stretch=s), *ends, loads)) for s in (False, True))
    assert exact.stable
    assert found.stable
    off = abs(abs(found.r(0.5)[2]) - abs(exact.r(0.5)[2]))
    assert off < 50.0 * (radius**2 / 4.0)  # of the axial strain, pi^2 EI / EA L^2 or four times that
    assert abs(exact.r(0.5)[2]) > 0.19


@pytest.mark.parametrize("method", [dx.DiscreteRod(100), dx.Shooting()], ids=str)
@pytest.mark.parametrize("radius", [5e-4, 2e-3])
def test_other_methods_find_it_too(method, radius: float) -> None:
    problem = dx.Equilibrium(wire(radius, stretch=True), *CLAMPS, [dx.Gravity()])
    exact, found = dx.solve(problem), dx.solve(problem, method)
    assert found.stable
    np.testing.assert_allclose(found.r(0.5), exact.r(0.5), atol=1e-4 if isinstance(method, dx.DiscreteRod) else 1e-7)


@pytest.mark.parametrize("span", [1.0, 1.0001, 1.01])
def test_a_taut_wire_carries_its_weight_by_tension(span: float) -> None:
    """T = EA (span / L - 1), from where on the sag is w L^2 / 8 T; straight between the pins it is T^3 = EA w^2 L^2 / 24."""
    rod = wire(5e-4, stretch=True)
    found = dx.solve(dx.Equilibrium(rod, dx.Pinned(), dx.Pinned((span, 0, 0)), [dx.Gravity()]))
    EA, w = 210e9 * np.pi * 5e-4**2, 7850 * 9.80665 * np.pi * 5e-4**2
    T = EA * (span - 1.0) if span > 1.0 else (EA * w**2 / 24.0) ** (1.0 / 3.0)
    assert found.stable
    assert -found.r(0.5)[2] == pytest.approx(w / (8.0 * T), rel=0.05)


def test_a_taut_wire_takes_ten_turns() -> None:
    """Its tension, 1.7 per mille of EA, keeps it straight far beyond Greenhill's twist of the slack one."""
    wire = dx.Rod(0.3, dx.Circle(0.175e-3), dx.Material(E=60e9, nu=0.33, density=6450), stretch=True)
    found = dx.solve(dx.Equilibrium(wire, dx.Clamped(), dx.Clamped((0, 0, 0.3005), twist=10 * dx.turn)))
    np.testing.assert_allclose(found.r(0.15), (0, 0, 0.15025), atol=1e-9)
    assert found.stable
    assert found.statistics["crossings"] == ()
