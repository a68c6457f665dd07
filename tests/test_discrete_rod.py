"""Discrete elastic rods: the literature's discrete digits, orders of both clamps, stability, inextensibility."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from darboux.paper.cases import figure6
from darboux.statics.discrete_chain import nodes_along
from tests import cases
from tests.cases import ALONG_X, UNIT

INEXTENSIBLE = cases.heavy(613.125)
STRETCH = cases.STRETCHED[0]


def tip_error(case: cases.Case, method: dx.DiscreteRod) -> float:
    return float(np.linalg.norm(dx.solve(case.problem, method).tip - case.tip)) / case.problem.rod.length


# Case D01: tips (x / L, down / L) of a discrete rod with N inextensible edges, vertex curvature 2 tan(phi / 2), half of
# a cell's weight at the tip; computed by another Newton code on the same energy, uncertainty 1e-10.
D01 = {
    ("half_cell", 1.0, 8): (0.9910633041, 0.12532202163),
    ("half_cell", 1.0, 64): (0.99124361128, 0.12350000866),
    ("half_cell", 10.0, 32): (0.65664619358, 0.70021212064),
    ("half_cell", 613.125, 16): (0.059073385998, 0.98259559752),
    ("half_cell", 613.125, 64): (0.05978006167, 0.97616301839),
    ("half_cell", 613.125, 256): (0.05929643126, 0.97579203757),
    ("two_vertices", 1.0, 8): (0.99443377516, 0.094853561169),
    ("two_vertices", 10.0, 64): (0.66650701865, 0.68863907122),
    ("two_vertices", 613.125, 16): (0.10727927113, 0.92804210624),
    ("two_vertices", 613.125, 256): (0.061358210037, 0.97370513962),
}


@pytest.mark.parametrize(("key", "tip"), D01.items(), ids=str)
def test_tips_of_another_discrete_code(key: tuple[str, float, int], tip: tuple[float, float]) -> None:
    clamp, w, N = key
    solution = dx.solve(cases.heavy(w), dx.DiscreteRod(N, clamp))
    np.testing.assert_allclose((solution.tip[0], -solution.tip[1]), tip, atol=2e-10)


@pytest.mark.parametrize(
    ("N", "tip"),
    # Case D04, closed form: M = (EI / l) 2 t (1 + t^2), t = tan(phi / 2), the root's spring half a cell long; M = 2 pi.
    [
        (10, (-0.1082492260556, 0.03327732040587)),
        (20, (-0.03147554546879, 0.002920229518616)),
        (40, (-0.00813924860027, 0.0002025119491006)),
    ],
)
def test_the_discrete_circle_in_closed_form(N: int, tip: tuple[float, float]) -> None:
    solution = dx.solve(cases.rolled(1.0), dx.DiscreteRod(N))
    np.testing.assert_allclose(solution.tip, (*tip, 0.0), atol=1e-10)


def test_figure_5_with_stretch() -> None:
    """Below 1.1e-3 L at 50 equal segments and 2e-5 L at 512; order above 1.9 from 512 to 1024."""
    assert tip_error(STRETCH, dx.DiscreteRod(50)) < 1.1e-3
    at_512, at_1024 = (tip_error(STRETCH, dx.DiscreteRod(N)) for N in (512, 1024))
    assert at_512 < 2e-5
    order = np.log2(at_512 / at_1024)
    assert 1.9 < order < 2.1, f"order {order:.3f}, declared 2"


def test_two_fixed_vertices_are_of_first_order() -> None:
    """The paper's own clamp holds half a segment too much."""
    errors = [tip_error(STRETCH, dx.DiscreteRod(N, "two_vertices")) for N in (512, 1024)]
    order = np.log2(errors[0] / errors[1])
    assert 0.95 < order < 1.1, f"order {order:.3f}, declared {dx.DiscreteRod(8, 'two_vertices').order}"
    assert errors[1] > 100 * tip_error(STRETCH, dx.DiscreteRod(1024))


def test_segments_graded_towards_the_clamp_do_better() -> None:
    """Figure 5's curvature lives in a layer of L / 8.5 at the clamp; graded segments keep order 2."""
    assert tip_error(STRETCH, dx.DiscreteRod(50, grading=8.0)) < 0.2 * tip_error(STRETCH, dx.DiscreteRod(50))
    errors = [tip_error(STRETCH, dx.DiscreteRod(N, grading=8.0)) for N in (128, 256)]
    order = np.log2(errors[0] / errors[1])
    assert 1.9 < order < 2.1, f"order {order:.3f}, declared 2"


def test_figure_6() -> None:
    """A terminal moment winds a straight rod into a helix: order 2 from 50 segments on."""
    problem = figure6()
    tip = dx.solve(problem).tip
    errors = [np.linalg.norm(dx.solve(problem, dx.DiscreteRod(N)).tip - tip) / problem.rod.length for N in (100, 200)]
    order = np.log2(errors[0] / errors[1])
    assert 1.9 < order < 2.1, f"order {order:.3f}, declared 2; errors {errors}"


@pytest.mark.parametrize("problem", [cases.heavy(10.0), cases.posed()], ids=["clamped and free", "two clamps"])
def test_the_order_of_what_is_extrapolated(problem: dx.Equilibrium) -> None:
    """Order 3: the half cell at a clamp turns by half of what others do, and its strain, 2 tan(phi / 2), errs less than half."""
    exact, methods = dx.solve(problem).r(0.5), [dx.DiscreteRod(N, extrapolate=True) for N in (40, 80)]
    errors = [np.linalg.norm(dx.solve(problem, method).r(0.5) - exact) for method in methods]
    order = np.log2(errors[0] / errors[1])
    assert order == pytest.approx(methods[0].order, abs=0.25), f"order {order:.2f}, declared {methods[0].order}"


@pytest.mark.parametrize("held", [(True, False), (False, True), (True, True)])
def test_graded_nodes(held: tuple[bool, bool]) -> None:
    widths = np.diff(nodes_along(64, 10.0, *held))
    assert widths.sum() == pytest.approx(1.0)
    assert widths.max() / widths.min() == pytest.approx(10.0, rel=0.1)
    shortest = {(True, False): [0], (False, True): [63], (True, True): [0, 63]}[held]
    np.testing.assert_allclose(widths[shortest], widths.min())


def test_inextensible_edges_keep_their_length() -> None:
    """The multipliers make the penalty exact: every edge has its rest length, and a stretching rod tends to it."""
    solution = dx.solve(INEXTENSIBLE, dx.DiscreteRod(40))
    edges = np.linalg.norm(np.diff(solution.r(solution.s), axis=0), axis=1)
    np.testing.assert_allclose(edges, 1.0 / 40.0, rtol=1e-12)
    section = dx.Stiffness(EI1=1.0, GJ=0.75, EA=1e9)
    stiff = dx.Equilibrium(dx.Rod(1.0, section, stretch=True), start=ALONG_X, loads=INEXTENSIBLE.loads)
    assert np.linalg.norm(dx.solve(stiff, dx.DiscreteRod(40)).tip - solution.tip) < 1e-5


@pytest.mark.parametrize(
    ("EI2", "P", "index"),
    # Euler's column, clamped and free: P_n = (2 n - 1)^2 pi^2 EI / 4 L^2 = 2.4674, 22.2066, 61.69 for each plane.
    [(1.0, 2.40, 0), (1.0, 2.53, 2), (1.3, 2.53, 1), (1.3, 3.3, 2), (1.3, 23.0, 3), (1.0, 23.0, 4)],
)
def test_unstable_directions_of_a_column(EI2: float, P: float, index: int) -> None:
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=EI2, GJ=0.75))
    solution = dx.solve(dx.Equilibrium(rod, loads=[dx.EndForce((0, 0, -P))]), dx.DiscreteRod(80, stable=False))
    np.testing.assert_allclose(solution.tip, (0, 0, 1.0), atol=1e-12)
    assert solution.index == index
    assert solution.stable == (index == 0)
    assert ("unstable" in solution.status.message) == (index > 0)


@pytest.mark.parametrize(("w", "index"), [(7.7, 0), (8.0, 2)])
def test_a_heavy_column_buckles_at_its_own_weight(w: float, index: int) -> None:
    """Greenhill (1881): w L^3 / EI = 7.8373."""
    problem = dx.Equilibrium(UNIT, loads=[dx.LineForce((0, 0, -w))])
    assert dx.solve(problem, dx.DiscreteRod(80, stable=False)).index == index


@pytest.mark.parametrize(("share", "index"), [(0.999, 0), (1.006, 2)])
def test_twist_does_not_weaken_bending(share: float, index: int) -> None:
    """A. G. Greenhill (1883): B y'''' - i M y''' - T y'' = 0 with clamped ends, M L / B = 10.42885644 for T L^2 / B = 10."""
    critical = 10.428856439276949 / (2 / 3)
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=2 / 3))
    end = dx.Slider(along=(0, 0, 1), twist=share * critical)
    x = dx.solve(dx.Equilibrium(rod, end=end, loads=[dx.EndForce((0, 0, 10.0))]), dx.DiscreteRod(50, stable=False))
    assert x.index == index


@pytest.mark.parametrize(("Lambda", "index"), [(12.2, 0), (12.5, 1)])
def test_a_rotating_column_bends_out_at_its_whirling_speed(Lambda: float, index: int) -> None:
    """Case S11b: rho A Omega^2 L^4 / EI = beta_1^4 = 12.3624, seen in the turning frame, one bending plane stiffened."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.05, GJ=0.75, mass=1.0))
    problem = dx.Equilibrium(rod, loads=[dx.Rotation((0, 0, np.sqrt(Lambda)))])
    assert dx.solve(problem, dx.DiscreteRod(80, stable=False)).index == index


def test_couples_leave_no_index() -> None:
    """A dead moment has no potential in space, so an index would mean nothing."""
    assert dx.solve(cases.rolled(0.25), dx.DiscreteRod(20)).index is None


def test_forces_and_moments_balance() -> None:
    """Reactions of the discrete rod: the whole weight, and its moment about the clamp, exactly (discrete balance)."""
    for clamp in ("half_cell", "two_vertices"):
        solution = dx.solve(cases.hanging_helix(20.0), dx.DiscreteRod(60, clamp))
        reaction = solution.reactions.start
        np.testing.assert_allclose(reaction.force, (0, 0, 20.0), atol=1e-8)
        r = solution.r(solution.s)
        weight = np.full(61, 20.0 / 60.0)
        weight[[0, -1]] /= 2.0
        moment = np.sum(np.cross(r, weight[:, None] * np.array([0, 0, -1.0])), axis=0)
        np.testing.assert_allclose(reaction.moment, -moment, atol=1e-7)


@pytest.mark.parametrize("name", ["r", "n", "m", "k"])
def test_fields_along_the_rod_are_discrete(name: str) -> None:
    """Not the tip alone: position, force, moment and curvature at the quarter points, against Shooting."""
    problem = cases.SPATIAL[0].problem
    s = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
    exact = getattr(dx.solve(problem), name)(s)
    gaps = []
    for N in (64, 128):
        value = getattr(dx.solve(problem, dx.DiscreteRod(N)), name)(s)
        gaps.append(np.max(np.linalg.norm(value - exact, axis=1)) / np.max(np.linalg.norm(exact, axis=1)))
    assert gaps[1] < 2e-3
    assert gaps[1] < 1e-9 or np.log2(gaps[0] / gaps[1]) > 1.8, gaps


def test_both_ends_clamped() -> None:
    """Case S14, an equilibrium of a rod clamped at both ends: order 2 towards the continuous one."""
    reference = dx.solve(cases.posed())
    gaps = [
        np.linalg.norm(dx.solve(cases.posed(), dx.DiscreteRod(N)).r(0.5) - reference.r(0.5)) for N in (50, 100, 200)
    ]
    assert gaps[-1] < 1e-4
    assert 1.8 < np.log2(gaps[1] / gaps[2]) < 2.2, gaps


def test_a_stiff_wire_takes_no_more_iterations_than_a_soft_one() -> None:
    """Slenderness 1e5 (EA L^2 / EI = 4e10): edges turn without being stretched, so stretching never slows Newton's method."""
    steel = dx.Material(E=210e9, nu=0.3, density=7850.0)
    counts = []
    for radius in (1e-2, 1e-5):
        rod = dx.Rod(1.0, dx.Circle(radius), steel, stretch=True)
        EI = float(rod.stiffness(np.zeros(1)).EI1[0])
        problem = dx.Equilibrium(rod, loads=[dx.EndForce((5.0 * EI, 0, 0))])
        solution = dx.solve(problem, dx.DiscreteRod(50))
        assert solution.stable
        counts.append(solution.statistics["newton_iterations"])
    assert counts[1] <= 1.5 * counts[0]
