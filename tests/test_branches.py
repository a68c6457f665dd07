"""Which equilibrium is found: branches that nearly cross, folds, unstable directions, and data that is easily overlooked."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from darboux.comparison import Entry, _sentence, distance

UNIT = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7, mass=1.0))
METHODS = [dx.Shooting(), dx.Elastica(), dx.DiscreteRod(200)]


def column(load: float, kind: str = "weight", tilt: float = 0.0) -> dx.Equilibrium:
    loads = [dx.Gravity((0, 0, -load)) if kind == "weight" else dx.EndForce((0, 0, -load))]
    return dx.Equilibrium(UNIT, start=dx.Clamped(tangent=(np.sin(tilt), 0, np.cos(tilt))), loads=loads)


@pytest.mark.parametrize("kind", ["weight", "force"])
@pytest.mark.parametrize("tilt", [1e-3, 0.02, 0.05])
@pytest.mark.parametrize("load", [9.0, 30.0, 100.0])
def test_a_nearly_straight_column_buckles_to_its_side(kind: str, tilt: float, load: float) -> None:
    """Both sheets of the broken pitchfork look straight just past the buckling load; only one follows from no load."""
    problem = column(load if kind == "weight" else load / 3.0, kind, tilt)
    ours = dx.solve(problem)
    assert np.linalg.norm(ours.tip - dx.solve(problem, dx.Elastica()).tip) < 1e-9
    assert ours.tip[0] > 0.0
    assert ours.stable


CRITICAL = {  # problem, critical load, the load factor's power of it, and how many directions are unstable on either side:
    # the load at which a further pair of directions (one where the section is not round) turns unstable
    "Euler, pi^2 / 4": (lambda load: column(load, "force"), np.pi**2 / 4.0, 1, 0, 2),
    "Euler, 9 pi^2 / 4": (lambda load: column(load, "force"), 9.0 * np.pi**2 / 4.0, 1, 2, 4),
    "Greenhill, 7.8373": (column, 7.837347438943, 1, 0, 2),
    "whirling, 3.5160": (
        lambda w: dx.Equilibrium(
            dx.Rod(1.0, dx.Stiffness(EI1=1, EI2=1.5, GJ=0.7, mass=1)), loads=[dx.Rotation((0, 0, w))]
        ),
        3.51601526850015,
        2,
        0,
        1,
    ),
}


@pytest.mark.parametrize("method", [dx.Shooting(), dx.DiscreteRod(400, stable=False)], ids=str)
@pytest.mark.parametrize("name", CRITICAL)
def test_unstable_directions_on_both_sides_of_a_critical_load(name: str, method: object) -> None:
    """A. E. H. Love (1927), art. 264; A. G. Greenhill, Proc. Camb. Phil. Soc. 4 (1881) 65; S. P. Timoshenko, Vibration
    Problems in Engineering (1937), art. 57: 1.8751^2 = 3.5160."""
    problem, critical, power, before, after = CRITICAL[name]
    below, above = (dx.solve(problem(factor * critical), method) for factor in (0.998, 1.002))
    assert (below.index, above.index) == (before, after)
    assert "unstable" in above.status.message
    low, high = above.statistics["crossings"][-1]
    assert low <= 1.002**-power <= high
    assert high - low <= (1e-3 if before == 0 else 0.02)


def test_no_index_without_a_potential() -> None:
    bent = dx.Equilibrium(UNIT, loads=[dx.EndMoment((0, 1, 0))])
    assert dx.solve(bent).index is None
    assert dx.solve(bent).stable is None


def strip_bent_to_a_u() -> dx.Equilibrium:
    rod = dx.Rod(0.5, dx.Rectangle(0.004, 0.002), dx.Material(E=1e7, nu=0.4, density=1100.0))
    return dx.Equilibrium(
        rod, end=dx.Clamped(position=(0.3, 0, 0), tangent=(0, 0, -1)), loads=[dx.Gravity((1, 0, -2.0))]
    )


def test_methods_meet_the_same_fold() -> None:
    """Neither may jump over it: found by halving every step of the path."""
    shooting, chain = (
        dx.solve(strip_bent_to_a_u(), m, throw=False) for m in (dx.Shooting(), dx.DiscreteRod(200, stable=False))
    )
    assert shooting.status.code == chain.status.code == "folded"
    assert shooting.load_factor == pytest.approx(chain.load_factor, abs=1e-3)
    assert shooting.load_factor == pytest.approx(0.9737, abs=2e-4)


def test_an_inextensible_rod_held_at_both_ends_goes_all_the_way() -> None:
    material = dx.Material(E=1e7, nu=0.4, density=1100.0)
    rod = dx.Rod(0.5, dx.Rectangle(lambda s: 0.004 - 0.004 * s, 0.002), material, natural=(1.0, 2.0, 3.0))
    start = dx.Clamped(position=(0.1, -0.2, 0.3), tangent=(1, 2, 0.5), d1=(0, 0, 1))
    loads = [dx.Gravity(), dx.Rotation((1.0, 2.0, 12.0), point=(0.3, 0.1, 0.0))]
    problem = dx.Equilibrium(rod, start=start, end=dx.Clamped(position=(0.3, 0, 0.4), tangent=(0, 1, 1)), loads=loads)
    shooting, chain = dx.solve(problem), dx.solve(problem, dx.DiscreteRod(200))
    assert np.linalg.norm(shooting.r(0.25) - chain.r(0.25)) < 3e-4
    assert chain.stable
    assert shooting.stable


@pytest.mark.parametrize("radius", [1e-3, 2e-4])
def test_a_steel_wire_held_at_both_ends(radius: float) -> None:
    """Rounding of n is EA L^2 / EI = 4 (L / r)^2 times that of a place: no reason to give up."""
    steel = dx.Material(E=210e9, nu=0.3, density=7850)
    clamps = (dx.Clamped(position=(x, 0, 0), tangent=(1, 0, 0)) for x in (0.0, 1.0))
    wire = dx.Equilibrium(dx.Rod(1.0, dx.Circle(radius), steel, stretch=True), *clamps, loads=[dx.Gravity()])
    solution = dx.solve(wire)
    weight = 7850 * 9.81 * np.pi * radius**2
    np.testing.assert_allclose(solution.reactions.start.force[2] + solution.reactions.end.force[2], weight, rtol=1e-6)


@pytest.mark.parametrize("method", METHODS, ids=str)
@pytest.mark.parametrize("width", [0.08, 0.005])
def test_a_narrow_load_given_as_a_function_is_not_overlooked(method: object, width: float) -> None:
    hat = dx.LineForce(lambda s: np.stack([np.where((s > 0.44) & (s < 0.44 + width), 10.0, 0.0), 0 * s, 0 * s], -1))
    solution = dx.solve(dx.Equilibrium(UNIT, loads=[hat]), method)
    assert solution.reactions.start.force[0] == pytest.approx(-10.0 * width, rel=1e-9)


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_a_narrow_soft_place_is_not_overlooked(method: object) -> None:
    """A cantilever under a small end force: the tip moves by int (1 - s)^2 / EI ds."""
    soft = dx.Rod(1.0, dx.Stiffness(EI1=lambda s: np.where(np.abs(s - 0.44) < 0.02, 0.01, 1.0), GJ=1.0))
    tip = dx.solve(dx.Equilibrium(soft, loads=[dx.EndForce((1e-6, 0, 0))]), method).tip[0]
    a, b = 1.0 - 0.46, 1.0 - 0.42
    assert tip == pytest.approx(1e-6 * (1.0 + 99.0 * (b**3 - a**3)) / 3.0, rel=1e-4)


@pytest.mark.parametrize("method", [dx.Shooting(), dx.DiscreteRod(20)], ids=str)
def test_a_rod_compressed_to_nothing_is_refused(method: object) -> None:
    rod = dx.Rod(1.0, dx.Stiffness(EI1=10.0, GJ=1.0, EA=1.0), stretch=True)
    solution = dx.solve(dx.Equilibrium(rod, loads=[dx.EndForce((0, 0, -2.0))]), method, throw=False)
    assert solution.status.code == "no_convergence"
    assert "compressed to nothing" in solution.status.message
    assert np.all(np.isfinite(solution.tip))


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_a_load_beyond_all_units_is_named(method: object) -> None:
    with pytest.raises(dx.InvalidInput, match="Check the units"):
        dx.solve(dx.Equilibrium(UNIT, loads=[dx.EndForce((1e50, 0, 0))]), method)


def test_energy_of_a_chain_with_a_loaded_free_end_is_discrete() -> None:
    problem = dx.Equilibrium(UNIT, loads=[dx.EndMoment((0, 1, 0)), dx.EndForce((0.5, 0, 0))])
    exact = dx.solve(problem).energy.elastic
    errors = [dx.solve(problem, dx.DiscreteRod(n)).energy.elastic - exact for n in (50, 100)]
    order = np.log2(errors[0] / errors[1])
    assert 1.9 < order < 2.1, order


def test_pieces_that_are_too_long_are_halved() -> None:
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0, mass=1.0), natural=(1, 2, 3))
    loads = [dx.Gravity((0, 0, -20)), dx.EndForce((1, 2, 0))]
    problem = dx.Equilibrium(rod, start=dx.Clamped(tangent=(1, 0, 0)), loads=loads)
    np.testing.assert_allclose(dx.solve(problem, dx.Shooting(pieces=1)).tip, dx.solve(problem).tip, atol=1e-10)


def test_an_integrated_curve_can_be_asked_for_any_s() -> None:
    rough, sharp = (dx.integrate(UNIT, k=(3, 4, 1), n=(5, 1, 1), rtol=rtol) for rtol in (1e-8, 1e-13))
    s = np.linspace(0.0, 1.0, 301)
    assert np.max(np.abs(rough.r(s) - sharp.r(s))) < 1e-8


def test_comparison_says_when_a_coarse_method_found_another_equilibrium() -> None:
    """The mirror image of the answer, given as if it were a method's own."""
    ours, other = dx.solve(column(30.0, tilt=0.05)), dx.solve(column(30.0, tilt=-0.05), dx.DiscreteRod(50))
    reference = Entry(ours, distance(ours, ours), None, 0.0)
    assert "different equilibria" in _sentence(Entry(other, distance(other, ours), -0.01, 0.0), reference)


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_a_straight_rod_pushed_along_itself_is_refused_in_words(method: object) -> None:
    """It would stay straight on its branch, which an inextensible rod can't: no answer may be called converged."""
    pushed = dx.Equilibrium(UNIT, end=dx.Clamped(position=(0, 0, 0.8)))
    solution = dx.solve(pushed, method, throw=False)
    assert not solution.converged
    assert "across" in solution.status.message


def test_a_straight_rod_held_taut_has_no_determined_tension() -> None:
    laid = dx.Equilibrium(UNIT, end=dx.Clamped(position=(0, 0, 1.0)))
    for problem in (laid, laid.with_load(dx.Gravity((1, 0, 0)))):
        assert "taut" in dx.solve(problem, dx.Shooting(), throw=False).status.message


def test_the_order_between_two_clamps_is_that_of_the_centreline() -> None:
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7))
    between = dx.Equilibrium(rod, end=dx.Clamped(position=(0.4, 0, 0.6), tangent=(1, 0, 0)))
    order = dx.compare(between, [dx.Shooting(), dx.DiscreteRod(50)]).entries[1].order
    assert order == pytest.approx(2.0, abs=0.1)
