"""What a solution says: reactions, energies, strains, its text."""

from __future__ import annotations

import dataclasses
import tracemalloc

import numpy as np
import pytest

import darboux as dx
from darboux.solution import ErrorEstimate
from tests import cases

METHODS = [dx.Shooting(), dx.DiscreteRod(30)]


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_reactions_of_two_clamps_balance_the_load(method) -> None:
    """sum F = 0 and sum M = 0, with the weight of the shape that was found."""
    problem = dataclasses.replace(cases.posed(), loads=[dx.LineForce((3.0, -2.0, 4.0))])
    solution = dx.solve(problem, method)
    start, end = solution.reactions.start, solution.reactions.end
    load = np.array([3.0, -2.0, 4.0])
    np.testing.assert_allclose(start.force + end.force + load, 0.0, atol=1e-8)
    if isinstance(method, dx.DiscreteRod):
        weights = np.full(31, 1.0 / 30.0)
        weights[[0, -1]] /= 2.0
        centre = weights @ solution.r(solution.s)
    else:
        x, w = np.polynomial.legendre.leggauss(200)
        centre = 0.5 * w @ solution.r(0.5 + 0.5 * x)
    moment = start.moment + end.moment + np.cross(solution.r(1.0), end.force) + np.cross(centre, load)
    np.testing.assert_allclose(moment, 0.0, atol=1e-7)


@pytest.mark.parametrize("clamp", ["half_cell", "two_vertices"])
def test_a_discrete_rod_that_hangs_from_its_end_balances(clamp) -> None:
    """The clamp at s = L carries all the weight, and its moment."""
    problem = dx.Equilibrium(cases.UNIT, dx.Free(), dx.Clamped(tangent=(1, 0, 0)), [dx.LineForce((0, -4, 1))])
    solution = dx.solve(problem, dx.DiscreteRod(30, clamp))
    weights = np.full(31, 1.0 / 30.0)
    weights[[0, -1]] /= 2.0
    load = np.array([0, -4.0, 1.0])
    np.testing.assert_allclose(solution.reactions.end.force, -load, atol=1e-8)
    moment = np.sum(np.cross(solution.r(solution.s) - solution.r(1.0), weights[:, None] * load), axis=0)
    np.testing.assert_allclose(solution.reactions.end.moment, -moment, atol=1e-7)


@pytest.mark.parametrize("follower", [False, True])
def test_a_load_on_a_held_end_is_no_reaction(follower: bool) -> None:
    """A roller pushes across its line only, and bears no moment; the load along it is carried by the other end."""
    push, pull = (0, 0, -1.0), np.array([0.5, 0, 0])
    loads = [dx.EndForce(push, follower=follower), dx.EndMoment((0, 0.1, 0)), dx.LineForce(pull)]
    beam = dx.Equilibrium(cases.UNIT, dx.Pinned(), dx.Roller(along=(0, 0, 1), position=(0, 0, 1)), loads)
    solution = dx.solve(beam)
    start, end = solution.reactions.start, solution.reactions.end
    assert end.force[2] == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose([start.moment, end.moment], 0.0, atol=1e-9)
    force = solution.R(1.0) @ push if follower else push
    np.testing.assert_allclose(start.force + end.force + force + pull, 0.0, atol=1e-9)


def test_a_free_end_has_no_reaction() -> None:
    for start, end, at in ((dx.Clamped(), dx.Free(), "end"), (dx.Free(), dx.Clamped(), "start")):
        solution = dx.solve(
            dx.Equilibrium(cases.UNIT, start, end, [dx.EndForce((1, 0, 0), at), dx.EndMoment((0, 0, 1), at)])
        )
        np.testing.assert_array_equal(
            [getattr(solution.reactions, at).force, getattr(solution.reactions, at).moment], 0.0
        )


@pytest.mark.parametrize("at", ["start", "end"])
@pytest.mark.parametrize("method", [dx.Shooting(), dx.DiscreteRod(10)], ids=str)
def test_energy_of_a_rod_that_is_pulled_and_twisted(method, at) -> None:
    """F = 5, EA = 50: stretch F^2 L / 2 EA = 0.25; M = 0.3, GJ = 0.6: twist M^2 L / 2 GJ = 0.075; load -F r(end)."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.6, EA=50.0), stretch=True)
    sign = 1.0 if at == "end" else -1.0
    supports = (dx.Clamped(), dx.Free()) if at == "end" else (dx.Free(), dx.Clamped())
    loads = [dx.EndForce((0, 0, sign * 5.0), at), dx.EndMoment((0, 0, sign * 0.3), at)]
    solution = dx.solve(dx.Equilibrium(rod, *supports, loads), method)
    energy = solution.energy
    np.testing.assert_allclose(
        [energy.bending, energy.twist, energy.stretch, energy.load], [0, 0.075, 0.25, -5.5], atol=1e-8
    )
    np.testing.assert_allclose(solution.v(0.3), (0, 0, 1.1), atol=1e-9)
    half = dataclasses.replace(solution, load_factor=0.5)  # the potential is that of the loads that act
    assert half.energy.load == pytest.approx(0.5 * energy.load)


def test_energy_of_a_rotating_rod() -> None:
    """A straight rod across the axis: -1/2 rho A omega^2 int (r - p)^2 ds = -1/2 * 2 * 9 * (1/3 - p + p^2)."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0, mass=2.0))
    for p in (0.0, 0.25):
        problem = dx.Equilibrium(rod, start=dx.Clamped(tangent=(1, 0, 0)), loads=[dx.Rotation((0, 0, 3.0), (p, 0, 0))])
        assert dx.solve(problem).energy.load == pytest.approx(-9.0 * (1.0 / 3.0 - p + p**2), rel=1e-10)


def test_energies_by_kind_of_the_discrete_rod() -> None:
    problem = cases.anisotropic((1.5, -1, -0.8), (0.4, 0.6, 0.9), stretch=True)
    a, b = (dx.solve(problem, method).energy for method in (dx.Shooting(), dx.DiscreteRod(200)))
    for kind in ("bending", "twist", "stretch", "load"):
        assert getattr(b, kind) == pytest.approx(getattr(a, kind), rel=2e-3), kind


def test_stretch_and_shear_are_those_of_the_centreline() -> None:
    """v = R^T r', the derivative by differences."""
    solution = dx.solve(cases.anisotropic((1.5, -1, -0.8), (0.4, 0.6, 0.9), **cases.COSSERAT))
    s, h = np.array([0.2, 0.5, 0.8]), 1e-4
    slope = (solution.r(s + h) - solution.r(s - h)) / (2.0 * h)
    np.testing.assert_allclose(solution.v(s), np.einsum("nji,nj->ni", solution.R(s), slope), atol=1e-7)


def test_before_the_rod_is_outside_too() -> None:
    with pytest.raises(dx.InvalidInput, match=r"s is -0\.5 m"):
        dx.solve(dx.Equilibrium(cases.UNIT)).r(-0.5)


def test_the_largest_moment_is_named() -> None:
    """A cantilever under a tip force: at the clamp."""
    assert "at s = 0 m" in str(dx.solve(cases.tip_force(1.0)))


def test_the_estimated_error_is_a_length() -> None:
    """The same rod a thousand times longer: the estimate too."""
    small, large = (
        dx.solve(
            dx.Equilibrium(dx.Rod(L, dx.Stiffness(EI1=1.0, GJ=1.0)), loads=[dx.EndForce((5.0 / L**2, 0, 0))]),
            dx.Shooting(rtol=1e-6),
        )
        for L in (1.0, 1024.0)
    )
    assert large.error.tip == pytest.approx(1024.0 * small.error.tip, rel=1e-6)


@pytest.mark.parametrize("method", [dx.Collocation(), dx.DiscreteRod(20)], ids=str)
def test_a_data_set_holds_the_fields_with_their_units(method) -> None:
    solution = dx.solve(cases.anisotropic((1.5, -1, -0.8), (0.4, 0.6, 0.9), stretch=True), method)
    data = solution.to_dataset()
    np.testing.assert_array_equal(data.s, solution.s)
    some = solution.to_dataset(s=[0.0, 0.3, 1.0])
    for name, unit in (("r", "m"), ("R", "1"), ("k", "1/m"), ("v", "1"), ("n", "N"), ("m", "N m")):
        np.testing.assert_array_equal(data[name], getattr(solution, name)(solution.s))
        np.testing.assert_array_equal(some[name], getattr(solution, name)(np.array([0.0, 0.3, 1.0])))
        assert data[name].attrs["units"] == unit
        assert data[name].attrs["long_name"]
    assert data.s.attrs["units"] == "m"
    assert float(data.r.sel(component="y").isel(s=-1)) == solution.tip[1]
    np.testing.assert_array_equal(data.R.sel(director=3), solution.R(solution.s)[:, :, 2])
    assert data.attrs["status"] == "converged"
    assert data.attrs["method"] == str(method)
    assert data.attrs["model"] == "stretch"
    assert data.attrs["energy_bending"] == solution.energy.bending
    assert all(isinstance(value, str | int | float) for value in data.attrs.values())  # what a file can hold
    assert solution.to_dataset(0.5).sizes["s"] == 1
    with pytest.raises(dx.InvalidInput, match=r"s is 1\.5 m"):
        solution.to_dataset([1.5])


def test_the_text_names_what_is_known() -> None:
    """Reactions of both ends; error, stability and stress only where there are any; no rounding shown as a number."""
    text = str(dx.solve(cases.posed()))
    for line in ("start force", "start moment", "end   force", "end   moment", "energy"):
        assert f"\n{line}" in text
    assert "MPa" not in text
    assert "error" not in str(dx.solve(cases.tip_force(1.0), dx.DiscreteRod(10)))
    bent = dx.solve(cases.tip_force(1.0))
    lines = {line[:14].strip(): line[14:] for line in str(bent).splitlines()}
    assert lines["tip"] == f"({bent.tip[0]:.9g}, {bent.tip[1]:.9g}, 0) m"
    known = dataclasses.replace(bent, error=ErrorEstimate(1e-12, 2e-10, 3e-11, 4e-13))
    assert "tip 1.0e-12 m, reactions 2.0e-10 N, moments 3.0e-11 N m, energy 4.0e-13 J (estimated)" in str(known)


def test_the_energy_of_a_load_that_jumps_between_vertices() -> None:
    """A straight rod under its own weight up to 0.37 L: -int w s ds, though no vertex stands at the jump."""
    load = dx.LineForce(lambda s: np.outer(s < 0.37, (0, 0, 2.0)))
    for method in (dx.Collocation(), dx.DiscreteRod(10)):
        assert dx.solve(dx.Equilibrium(cases.UNIT, loads=[load]), method).energy.load == pytest.approx(
            -(0.37**2), rel=1e-8
        )


def test_many_places_are_interpolated_in_little_memory() -> None:
    """Beside the result: what lies between takes 5 KB for each place at once, and the last part must not be left out."""
    curve = dx.solve(cases.heavy(10.0)).curve
    s = np.linspace(0.0, curve.s[-1], 20_001)
    tracemalloc.start()
    together = curve(s)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2.0 * together.nbytes + 20e6, f"{peak / 1e6:.0f} MB for {together.nbytes / 1e6:.0f} MB"
    np.testing.assert_array_equal(together, np.concatenate([curve(part) for part in np.array_split(s, 100)]))
