"""Discrete elastic rods under every support and load, against Collocation; their index, their modes, their fall."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest

import darboux as dx
from darboux.comparison import _order
from darboux.frames import rotation
from darboux.statics.discrete_branch import ChainBranch
from darboux.statics.discrete_chain import Chain, nodes_along
from tests import cases

UP = (0, 0, 1)
SECTION = dx.Stiffness(EI1=1.0, EI2=1.4, GJ=0.75, EA=30.0, mass=1.0)
BENT = dx.Rod(1.0, SECTION, natural=(0.3, 0.2, 0.4))
FLAT = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.3, GJ=0.75, mass=1.0))
ALONG_THE_ROD = np.linspace(0.0, 1.0, 11)

SUPPORTS = {
    "clamped": dx.Clamped(position=(0.1, 0.2, 0.8), tangent=(0.1, 0.2, 1)),
    "clamped, twisted": dx.Clamped(position=(0.1, 0.2, 0.9), tangent=(0.1, 0.2, 1), twist=1.5 * dx.turn),
    "pinned": dx.Pinned(position=(0.1, 0.1, 0.9)),
    **cases.ENDS,
}


def orders(problem: dx.Equilibrium, names: str = "rnm") -> dict[str, float]:
    """The order of the error from 50 to 100 segments, of the places, forces and moments along the rod."""
    exact = dx.solve(problem)
    found = [dx.solve(problem, dx.DiscreteRod(N)) for N in (50, 100)]
    gaps = {
        name: [np.max(np.abs(getattr(x, name)(ALONG_THE_ROD) - getattr(exact, name)(ALONG_THE_ROD))) for x in found]
        for name in names
    }
    return {name: float(np.log2(a / b)) for name, (a, b) in gaps.items() if b > 1e-7}


@pytest.mark.parametrize("name", SUPPORTS)
def test_order_2_under_every_support(name: str) -> None:
    """In space, on an anisotropic rod that is bent and twisted at rest, under a line load, an end force and an end moment."""
    loads = [dx.LineForce((1.0, 0.8, -0.6))]
    if "clamped" not in name:
        loads += [dx.EndForce((0.4, 0.3, -0.5)), dx.EndMoment((0.2, -0.3, 0.1))]
    found = orders(dx.Equilibrium(BENT, end=SUPPORTS[name], loads=loads))
    assert all(1.8 < order < 2.2 for order in found.values()), f"order {found}, declared 2"


@pytest.mark.parametrize("name", ["hinge", "universal", "groove", "slider", "spring"])
def test_order_2_under_a_support_at_the_start(name: str) -> None:
    support = SUPPORTS[name]
    moved = dataclasses.replace(support, position=(0.1, 0.1, 0.1))
    problem = dx.Equilibrium(BENT, start=moved, end=dx.Clamped(position=UP), loads=[dx.LineForce((1.0, 0.8, -0.6))])
    found = orders(problem)
    assert all(1.8 < order < 2.2 for order in found.values()), f"order {found}, declared 2"


LOADS = cases.LOADS | {"end force off the centre": dx.EndForce((1, 1, -1), offset=(0.2, -0.1, 0.3))}


@pytest.mark.parametrize("name", LOADS)
def test_extrapolated_answers_under_every_load(name: str) -> None:
    """Richardson's extrapolation of 100 and 200 graded segments is within 1e-6 of Collocation, in r, n and m."""
    problem = dx.Equilibrium(BENT, loads=[LOADS[name]])
    exact, found = dx.solve(problem), dx.solve(problem, dx.DiscreteRod(100, grading=2.0, extrapolate=True))
    for field in "rnmR":
        value, wanted = (getattr(x, field)(ALONG_THE_ROD) for x in (found, exact))
        np.testing.assert_allclose(value, wanted, atol=1e-6, err_msg=field)
    assert np.linalg.norm(found.tip - exact.tip) < found.error.tip


FOLLOWING = [load for name, load in LOADS.items() if "follower" in name or "couple" in name or "shape" in name]


@pytest.mark.parametrize("name", ["groove", "spring"])
def test_derivatives_of_a_support(name: str) -> None:
    """Gradient and second derivative by (phi, dx) of what a groove and a spring add, against differences of the energy."""
    chain = Chain(dx.Equilibrium(BENT, end=SUPPORTS[name]), nodes_along(4, 1.0, True, True), two_vertices=False)
    end, penalty = chain.ends[1], 40.0
    R = rotation(np.array([0.3, -0.5, 0.4])) @ end.R
    x = end.position + 0.3 * R @ end.conditions.place_axes[:, 0]  # in the groove
    reaction = np.array([2.0, -3.0])

    def energy(v: np.ndarray) -> float:
        return end.energy(x + v[3:], rotation(v[:3]) @ R, reaction, penalty)

    e, h = np.eye(6), 1e-3
    first = [(energy(h * a) - energy(-h * a)) / (2.0 * h) for a in e]
    second = [
        [sum(i * j * energy(h * (i * a + j * b)) for i in (1, -1) for j in (1, -1)) / (4.0 * h**2) for a in e]
        for b in e
    ]
    terms = end.terms(x, R, reaction, penalty)
    np.testing.assert_allclose(terms.gradient, first, atol=1e-4)
    np.testing.assert_allclose(terms.tangent, second, atol=1e-4)


def test_a_groove_takes_few_iterations() -> None:
    problem = dx.Equilibrium(BENT, end=SUPPORTS["groove"], loads=[dx.LineForce((1.0, 0.8, -0.6))])
    assert dx.solve(problem, dx.DiscreteRod(50)).statistics["newton_iterations"] < 25


@pytest.mark.parametrize("name", SUPPORTS)
def test_newtons_method_is_quadratic_under_every_support_and_load(name: str) -> None:
    """The size of each step is the square of the last, which holds for exact derivatives only."""
    ends = [] if "clamped" in name else [load for load in FOLLOWING if load.place]
    loads = [dx.LineForce((1.0, 0.8, -0.6)), *ends, *(load for load in FOLLOWING if not load.place)]
    rod = dataclasses.replace(BENT, stretch=True)
    problem = dx.Equilibrium(rod, end=SUPPORTS[name], loads=loads)
    chain = Chain(problem, nodes_along(12, 1.0, True, True, [0.37]), two_vertices=False)
    branch, factor = ChainBranch(chain), 0.2
    shape = chain.unloaded()
    tangent, _ = branch.tangent(shape, 0.0)
    shape = chain.posed(branch.predict(shape, tangent, factor), factor)
    sizes = []
    for _ in range(12):
        branch.assemble(shape, factor)
        branch.hold(shape, factor)
        step = chain.packed(shape, branch._solve(branch._factor()[1], -branch.gradient))
        sizes.append(chain.turn(step))
        shape = chain.moved(shape, step, 1.0)
        chain.settled(shape)
    late = [size for size in sizes if size < 0.03]
    assert all(b < 30.0 * a**2 + 1e-11 for a, b in itertools.pairwise(late)), sizes
    assert sizes[-1] < 1e-11, sizes


PI2 = np.pi**2
COLUMNS = {  # Euler's columns: the supports and P L^2 / EI; S. P. Timoshenko and J. M. Gere (1961), art. 2.1 to 2.3
    "clamped, free": ({}, PI2 / 4.0),
    "pinned, roller": ({"start": dx.Pinned(), "end": dx.Roller(along=UP)}, PI2),
    "clamped, roller": ({"end": dx.Roller(along=UP)}, 20.190728556426629),
    "clamped, slider": ({"end": dx.Slider(along=UP)}, 4.0 * PI2),
    "clamped, guided": ({"end": dx.Guided()}, PI2),
}


@pytest.mark.parametrize("name", COLUMNS)
def test_the_index_on_both_sides_of_eulers_columns(name: str) -> None:
    supports, P = COLUMNS[name]
    for share, index in ((0.998, 0), (1.002, 1)):
        column = dx.solve(
            dx.Equilibrium(FLAT, **supports, loads=[dx.EndForce((0, 0, -share * P))]), dx.DiscreteRod(100, stable=False)
        )
        assert column.index == index
        assert ("unstable" in column.status.message) == (index > 0)
        assert (column.modes().stiffness[0] < 0.0) == (index > 0) or name == "pinned, roller"


@pytest.mark.parametrize(
    ("problem", "after"),
    [
        # A. G. Greenhill (1881): w L^3 / EI = 7.8373, of a heavy column.
        (lambda share: dx.Equilibrium(FLAT, loads=[dx.Gravity((0, 0, -7.837347439 * share))]), 1),
        # The same, 1883: a rod twisted between two clamps that slide on its line, tan(x) = x with x = M L / 2 EI = 4.4934.
        (
            lambda share: dx.Equilibrium(
                dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.75)), end=dx.Slider(along=UP, twist=8.986818916 * share / 0.75)
            ),
            2,
        ),
        # A. G. M. Michell (1899), L. Prandtl (1899): a deep cantilever, P L^2 / sqrt(EI GJ) = 4.0126.
        (
            lambda share: dx.Equilibrium(
                dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1e5, GJ=1.0)), loads=[dx.EndForce((4.0126 * share, 0, 0))]
            ),
            1,
        ),
    ],
    ids=["heavy column", "twist", "lateral-torsional"],
)
def test_the_index_on_both_sides(problem: object, after: int) -> None:
    assert [dx.solve(problem(share), dx.DiscreteRod(200, stable=False)).index for share in (0.998, 1.002)] == [0, after]


def test_a_hanging_helix_from_cold() -> None:
    """25 L / pitch of wire, soft as rubber: what other discrete codes need half a minute for, or do not find."""
    helix = dx.Helix(radius=0.02, pitch=0.02)
    rod = dx.Rod(0.5, dx.Circle(1e-3), dx.Material(E=1e7, nu=0.5, density=1100), natural=helix)
    half_a_turn = np.diag([-1.0, -1.0, 1.0])
    clamp = dx.Clamped(frame=half_a_turn @ helix.frame(axis=(0, 0, -1)))
    solution = dx.solve(dx.Equilibrium(rod, start=clamp, loads=[dx.Gravity()]), dx.DiscreteRod(400, stable=False))
    reference = (-0.0057314858801, 0.0094571603323, -0.276898936118)
    assert np.linalg.norm(solution.tip - reference) < 2e-3 * 0.5
    assert solution.statistics["newton_iterations"] < 50
    assert solution.stable


def test_supports_between_the_ends() -> None:
    between = {0.37: dx.Roller(along=UP, position=(0, 0, 0.37)), 0.7: dx.Spring(linear=30.0, position=(0, 0.1, 0.7))}
    problem = dx.Equilibrium(FLAT, loads=[dx.LineForce((3, 1, -2))], between=between)
    exact, found = dx.solve(problem), dx.solve(problem, dx.DiscreteRod(100))
    for s in between:
        np.testing.assert_allclose(found.reactions.between[s].force, exact.reactions.between[s].force, atol=4e-3)
    order = orders(problem)
    assert all(1.8 < p < 2.2 for p in order.values()), f"order {order}, declared 2"
    clamped = dx.Equilibrium(FLAT, between={0.5: dx.Clamped(position=(0, 0, 0.5))})
    with pytest.raises(dx.InvalidInput, match="no frame; use Collocation"):
        dx.solve(clamped, dx.DiscreteRod(10))


STEEL = dx.Material(E=210e9, nu=0.3, density=7850)


BENDING = {  # beta L of cos beta cosh beta = -1, 0 and others: R. D. Blevins (1979), table 8-1
    "clamped, free": ({}, (1.8751040687, 4.6940911330, 7.8547574382)),
    "pinned, pinned": ({"start": dx.Pinned(), "end": dx.Pinned(position=UP)}, (np.pi, 2.0 * np.pi, 3.0 * np.pi)),
    "clamped, pinned": ({"end": dx.Pinned(position=UP)}, (3.9266023120, 7.0685827456, 10.2101761228)),
}
BAR = dx.Rod(1.0, dx.Circle(5e-3), STEEL, stretch=True)


@pytest.mark.parametrize("name", BENDING)
def test_frequencies_of_bending(name: str) -> None:
    supports, betas = BENDING[name]
    modes = dx.solve(dx.Equilibrium(BAR, **supports), dx.DiscreteRod(200)).modes(7)
    wanted = np.repeat(np.array(betas) ** 2, 2) * np.sqrt(210e9 * 0.005**2 / 4.0 / 7850) / dx.turn
    found = modes.frequencies[modes.frequencies > 0.0]  # between two ball joints the bar spins freely
    np.testing.assert_allclose(found[:6], wanted, rtol=1e-4)


def test_extrapolated_frequencies() -> None:
    """Between clamps the error is the largest, that of the trapezoidal rule at either end; 100 segments and 200."""
    modes = dx.solve(dx.Equilibrium(BAR, end=dx.Clamped(position=UP)), dx.DiscreteRod(100, extrapolate=True)).modes(6)
    betas = np.repeat([4.7300407449, 7.8532046241, 10.9956078380], 2)
    np.testing.assert_allclose(
        modes.frequencies * dx.turn, betas**2 * np.sqrt(210e9 * 0.005**2 / 4.0 / 7850), rtol=1e-6
    )


def test_frequencies_of_torsion_and_stretch() -> None:
    """c / 4 L with c^2 = G / rho and E / rho, clamped and free."""
    modes = dx.solve(dx.Equilibrium(BAR), dx.DiscreteRod(200)).modes(24)
    for frequency in (np.sqrt(210e9 / 2.6 / 7850) / 4.0, np.sqrt(210e9 / 7850) / 4.0):
        assert np.min(np.abs(modes.frequencies / frequency - 1.0)) < 1e-4
    np.testing.assert_allclose(modes.stiffness, modes.frequencies**2 * dx.turn**2 * 7850 * np.pi * 0.005**2, rtol=1e-12)


def test_modes_of_a_beam_on_two_supports() -> None:
    beam = dx.Equilibrium(FLAT, dx.Hinge(axis=(1, 0, 0)), dx.Roller(along=UP))
    modes = dx.solve(beam, dx.DiscreteRod(200)).modes(2)
    np.testing.assert_allclose(modes.stiffness[0], np.pi**4, rtol=2e-4)
    shape = modes.displacements[0, :, 1]
    np.testing.assert_allclose(np.abs(shape), np.sqrt(2.0) * np.sin(np.pi * modes.s), atol=2e-3)
    with pytest.raises(dx.InvalidInput, match="potential"):
        dx.solve(beam.with_load(dx.EndMoment((0.1, 0, 0))), dx.DiscreteRod(20)).modes()
    with pytest.raises(dx.InvalidInput, match=r"solution\.modes is there for DiscreteRod"):
        dx.solve(beam).modes()


@pytest.mark.parametrize("supports", [{}, {"start": dx.Hinge(axis=(1, 0, 0)), "end": dx.Roller(along=UP)}])
def test_a_rod_falls_from_an_unstable_equilibrium(supports: dict[str, object]) -> None:
    """Down to the elastica that Collocation takes past the bifurcation."""
    problem = dx.Equilibrium(FLAT, **supports, loads=[dx.EndForce((0, 0, -1.2 * (PI2 if supports else PI2 / 4.0)))])
    column, fallen = (dx.solve(problem, dx.DiscreteRod(100, stable=stable)) for stable in (False, True))
    assert column.index == 1
    assert fallen.stable
    assert "fell" in fallen.status.message
    wanted = dx.solve(problem).tip
    np.testing.assert_allclose(np.abs(fallen.tip), np.abs(wanted), atol=2e-3)
    assert fallen.energy.total < column.energy.total


ROUND = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.75, mass=1.0))
ALONG_X = dx.Clamped(tangent=(1, 0, 0))
FALLING = {
    "flat column": dx.Equilibrium(
        dx.Rod(1.0, dx.Stiffness(EI1=10.0, EI2=1.0, GJ=10.0)), loads=[dx.EndForce((0, 0, -3.2))]
    ),
    "round column": dx.Equilibrium(ROUND, loads=[dx.EndForce((0, 0, -3.2))]),
    "round column along x": dx.Equilibrium(ROUND, ALONG_X, loads=[dx.EndForce((-3.2, 0, 0))]),
    "spinning": dx.Equilibrium(ROUND, loads=[dx.Rotation((0, 0, 4.0))]),
    "two spans": dx.Equilibrium(
        ROUND, dx.Pinned(), dx.Roller(along=UP), [dx.EndForce((0, 0, -45.0))], between={0.5: dx.Roller(along=UP)}
    ),
}


@pytest.mark.parametrize("name", FALLING)
def test_meshes_fall_to_one_side_and_are_extrapolated_there(name: str) -> None:
    """By distances that neither side nor plane changes, of the answer of Collocation."""
    problem = FALLING[name]
    found, wanted = dx.solve(problem, dx.DiscreteRod(50, extrapolate=True)), dx.solve(problem)
    axis = problem.start.R[:, 2]
    for s in (0.25, 0.75, 1.0):
        ours, right = ((x.r(s) @ axis, np.linalg.norm(np.cross(x.r(s), axis))) for x in (found, wanted))
        np.testing.assert_allclose(ours, right, atol=1e-4)
    assert found.stable
    assert found.error.tip < 2e-3


def test_mirror_images_are_not_extrapolated() -> None:
    tilted = [dx.Clamped(tangent=(tilt, 0, 1)) for tilt in (0.02, -0.02)]
    problems = [dx.Equilibrium(ROUND, start, loads=[dx.EndForce((0, 0, -10.0))]) for start in tilted]
    method = dx.DiscreteRod(20, extrapolate=True)
    one, same, other = (dx.solve(problems[i], dx.DiscreteRod(N)) for i, N in ((0, 20), (0, 40), (1, 40)))
    apart = method._extrapolated(one, other, 2)
    assert apart.converged
    assert "It is not extrapolated" in apart.status.message
    assert "20 and 40 segments" in apart.status.message
    assert apart.error.tip is None
    np.testing.assert_array_equal(apart.tip, other.tip)
    assert method._extrapolated(one, same, 2).error.tip < 0.01

    class Other:
        refined = staticmethod(lambda factor: Other)
        solve = staticmethod(lambda problem: other)

    assert _order(Other, problems[0], one, dx.solve(problems[0])) is None
    assert _order(dx.DiscreteRod(20), problems[0], one, dx.solve(problems[0])) == pytest.approx(2.0, abs=0.2)
