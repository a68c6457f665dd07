"""Stability next to close places, on tapers and across steps of the stiffness, and fields on either side of a jump.

Critical loads are closed forms: L. Euler; A. N. Dinnik, Trans. ASME 51 (1929) 105 (tapers EI ~ x^2 and x^4, and others by
integration); S. P. Timoshenko and J. M. Gere, Theory of Elastic Stability (1961), sections 2.1, 2.12 and 2.14 (tan x = x,
stepped and tapered columns). DARBOUX_FUZZ (`make fuzz`) compares the methods on 300 random problems, the test run on 20.
"""

from __future__ import annotations

import os
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import darboux as dx
from darboux.packing.laying import placed

UP = (0.0, 0.0, 1.0)
FLAT = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.5, GJ=0.7))  # buckles along y
EULER, CLAMPED_PINNED = np.pi**2 / 4.0, 4.493409457909064**2
METHODS = [dx.Collocation(), dx.DiscreteRod(100, stable=False)]
GAPS = [pytest.param(1e-4, marks=pytest.mark.long), 1e-6, 1e-9]
RANDOM = 300 if "DARBOUX_FUZZ" in os.environ else 20
TOGETHER, MOST_UNCOMPARED = 20, 2
STEEPEST = -6.0  # ramps of tables, over L, as a power of ten


def sideways(x: dx.EquilibriumSolution) -> float:
    s = np.linspace(0.0, x.problem.rod.length, 17)
    return float(np.max(np.hypot(*x.r(s)[:, :2].T))) / x.problem.rod.length


def assert_critical(problem_at: Callable[[float], dx.Equilibrium], directions: int, method: object) -> None:
    """At 0.99 of the critical load the column stands; at 1.01 it has left its line, or is unstable, from the critical load on."""
    below, above = (dx.solve(problem_at(share), method) for share in (0.99, 1.01))
    assert (below.index, below.statistics["crossings"]) == (0, ())
    assert sideways(below) < 1e-6
    if isinstance(method, dx.Collocation):
        assert above.index == 0
        assert sideways(above) > 0.01
        assert "turns unstable" in above.status.message
        return
    assert above.index == directions
    ((low, high),) = above.statistics["crossings"]
    assert high > 0.998 / 1.01
    assert low < 1.002 / 1.01


def force_at(gap: float) -> Callable[[float], dx.Equilibrium]:
    force = EULER / (1.0 - gap) ** 2
    return lambda share: dx.Equilibrium(FLAT, loads=[dx.PointForce((0, 0, -share * force), at=1.0 - gap)])


def two_forces(gap: float) -> Callable[[float], dx.Equilibrium]:
    """Both at the middle but for the gap: a column of half the length below them."""
    force = (0, 0, -0.5 * EULER / (0.5 + 0.5 * gap) ** 2)

    def problem(share: float) -> dx.Equilibrium:
        scaled = tuple(share * x for x in force)
        return dx.Equilibrium(FLAT, loads=[dx.PointForce(scaled, at=0.5), dx.PointForce(scaled, at=0.5 + gap)])

    return problem


def two_supports(gap: float) -> Callable[[float], dx.Equilibrium]:
    """A pin and a guide next to it clamp a rod that is free otherwise."""
    between = {0.3: dx.Pinned((0, 0, 0.3)), 0.3 + gap: dx.Roller(along=UP, position=(0, 0, 0.3 + gap))}
    force = EULER / (0.7 - gap) ** 2 * (1.0 - gap)
    free = {"start": dx.Free(), "end": dx.Free(), "between": between}
    return lambda share: dx.Equilibrium(FLAT, **free, loads=[dx.EndForce((0, 0, -share * force))])


def guide_near_the_end(gap: float) -> Callable[[float], dx.Equilibrium]:
    guide = {1.0 - gap: dx.Roller(along=UP, position=(0, 0, 1.0 - gap))}
    return lambda share: dx.Equilibrium(FLAT, between=guide, loads=[dx.EndForce((0, 0, -share * CLAMPED_PINNED))])


def stiff_spring_near_the_end(gap: float) -> Callable[[float], dx.Equilibrium]:
    spring = {1.0 - gap: dx.Spring(linear=np.diag([1e9, 1e9, 0.0]).tolist(), position=(0, 0, 1.0 - gap))}
    return lambda share: dx.Equilibrium(FLAT, between=spring, loads=[dx.EndForce((0, 0, -share * CLAMPED_PINNED))])


CLOSE = [force_at, two_forces, two_supports, guide_near_the_end, stiff_spring_near_the_end]


@pytest.mark.parametrize("gap", GAPS)
@pytest.mark.parametrize("method", METHODS, ids=str)
@pytest.mark.parametrize("column", CLOSE)
def test_columns_with_places_close_together(column: Callable[..., object], method: object, gap: float) -> None:
    problem_at = column(gap)
    if isinstance(method, dx.DiscreteRod) and gap == 1e-9 and problem_at(1.0).between:
        with pytest.raises(dx.InvalidInput, match="or rounding hides the rest; use Collocation"):
            dx.solve(problem_at(1.0), method)
    else:
        assert_critical(problem_at, 1, method)


def test_it_buckles_across_its_weaker_axis() -> None:
    x, y, _ = dx.solve(force_at(1e-9)(1.01)).tip
    assert abs(x) < 1e-9
    assert abs(y) > 0.1


def test_the_buckled_shape_hardly_depends_on_the_gap() -> None:
    tips = [dx.solve(force_at(gap)(1.05)).tip for gap in (1e-6, 1e-9)]
    end = dx.solve(dx.Equilibrium(FLAT, loads=[dx.EndForce((0, 0, -1.05 * EULER))])).tip
    for tip in tips:
        np.testing.assert_allclose(tip * [1.0, np.sign(tip[1] * end[1]), 1.0], end, atol=1e-5)


@pytest.mark.parametrize("segments", [50, 400])
def test_a_stiff_end_with_a_spring_next_to_it_keeps_its_index(segments: int) -> None:
    """The spring of a free end's half cell, of 1e-6 L, has a rounding above the rod's own stiffness."""
    along = lambda EI: dx.Table([0.0, 0.5, 0.5, 1.0], [EI, EI, 7.3 * EI, 7.3 * EI], "linear")  # noqa: E731
    rod = dx.Rod(1.0, dx.Stiffness(EI1=along(1.0), EI2=along(1.5), GJ=1.0))
    spring = {1.0 - 2e-6: dx.Spring(linear=958.0, position=(0, 0, 1.0 - 2e-6))}
    chain = dx.solve(dx.Equilibrium(rod, between=spring, loads=[dx.EndForce((0, 0, -12.3))]), dx.DiscreteRod(segments))
    assert (chain.index, chain.statistics["crossings"]) == (0, ())


# -- tapers and steps ---------------------------------------------------------------------------------------------


def dinnik(c: float, power: int) -> float:
    """P of EI y'' + P y = 0 with EI = x^power, x = 1 - c s: y = 0 at the tip, y' = 0 at the clamp.

    Power 4: y = x sin(k / x - k / x_tip), k = sqrt(P) / c;   power 2: y = sqrt(x) sin(a ln(x / x_tip)), a^2 = P / c^2 - 1/4.
    """
    if power == 4:
        over = c / (1.0 - c)
        k = brentq(lambda k: np.sin(k * over) + k * np.cos(k * over), 0.5 * np.pi / over, np.pi / over)
        return float(k**2 * c**2)
    ln = -np.log(1.0 - c)
    a = brentq(lambda a: np.sin(a * ln) + 2.0 * a * np.cos(a * ln), 0.5 * np.pi / ln, np.pi / ln)
    return float((a**2 + 0.25) * c**2)


def stiffness(EI: Callable[..., object], **more: object) -> dx.Rod:
    return dx.Rod(1.0, dx.Stiffness(EI1=EI, EI2=lambda s: 1.5 * EI(s), GJ=lambda s: 0.7 * EI(s), **more))


@pytest.mark.parametrize(
    ("c", "power"),
    [
        pytest.param(0.5, 2, marks=pytest.mark.long),
        (0.99, 2),
        pytest.param(0.9, 4, marks=pytest.mark.long),
        (0.99, 4),
    ],
)
def test_dinniks_tapered_columns(c: float, power: int) -> None:
    rod, force = stiffness(lambda s: (1.0 - c * s) ** power), dinnik(c, power)
    problem_at = lambda share: dx.Equilibrium(rod, loads=[dx.EndForce((0, 0, -share * force))])  # noqa: E731
    below, above = (dx.solve(problem_at(share)) for share in (0.99, 1.01))
    assert (below.index, above.index) == (0, 0)
    assert sideways(below) < 1e-9
    assert sideways(above) > 1e-3
    if c < 0.99:
        assert_critical(problem_at, 1, dx.DiscreteRod(200, stable=False))


@pytest.mark.parametrize("c", [pytest.param(0.9, marks=pytest.mark.long), 0.99])
def test_a_tapered_column_under_its_weight(c: float) -> None:
    """(EI theta')' + q W theta = 0, theta(0) = 0, theta'(1) = 0, W the weight above, integrated by another integrator."""
    above = lambda s: ((1.0 - c * s) ** 3 - (1.0 - c) ** 3) / (3.0 * c)  # noqa: E731

    def moment_at_the_tip(q: float) -> float:
        right = lambda s, y: [y[1] / (1.0 - c * s) ** 4, -q * above(s) * y[0]]  # noqa: E731
        return float(solve_ivp(right, (0.0, 1.0), [0.0, 1.0], "DOP853", rtol=1e-10, atol=1e-12).y[1, -1])

    weight = brentq(moment_at_the_tip, 20.0, 32.0)
    rod = stiffness(lambda s: (1.0 - c * s) ** 4, mass=lambda s: (1.0 - c * s) ** 2)
    for method in METHODS:
        problem_at = lambda share: dx.Equilibrium(rod, loads=[dx.Gravity((0, 0, -share * weight))])  # noqa: E731
        assert_critical(problem_at, 1, method)


def test_a_taper_that_its_weight_bends_has_no_false_branches() -> None:
    EI = lambda s: (1.0 - 0.99 * s) ** 4  # noqa: E731
    rod = dx.Rod(1.0, dx.Stiffness(EI1=EI, GJ=lambda s: 0.7 * EI(s), mass=lambda s: EI(s) ** 0.5))
    bent = dx.solve(dx.Equilibrium(rod, loads=[dx.Gravity(g=(10, 0, 0))]))
    assert (bent.index, bent.statistics["crossings"]) == (0, ())
    chain = dx.solve(bent.problem, dx.DiscreteRod(400))
    assert chain.index == 0
    np.testing.assert_allclose(bent.tip, chain.tip, atol=1e-4)


@pytest.mark.parametrize(
    ("lower", "upper"),
    [
        (1.0, 1e-6),
        pytest.param(1e-6, 1.0, marks=pytest.mark.long),
        pytest.param(1.0, 1e-9, marks=pytest.mark.long),
        (1e-9, 1.0),
    ],
)
def test_a_step_of_the_stiffness(lower: float, upper: float) -> None:
    """Two halves: sqrt(EI_1) cos a cos b = sqrt(EI_2) sin a sin b with a, b = sqrt(P / EI) / 2 of each."""

    def determinant(P: float) -> float:
        a, b = 0.5 * np.sqrt(P / lower), 0.5 * np.sqrt(P / upper)
        return float(np.sqrt(lower) * np.cos(a) * np.cos(b) - np.sqrt(upper) * np.sin(a) * np.sin(b))

    least = min(lower, upper) * np.pi**2
    force = brentq(determinant, 1e-6 * least, (1.0 - 1e-9) * least, xtol=1e-20)
    rod = stiffness(lambda s: np.where(s < 0.5, lower, upper))
    mild = max(lower, upper) / min(lower, upper) < 1e7  # a chain's rounding hides more
    for method in METHODS if mild else METHODS[:1]:
        problem_at = lambda share: dx.Equilibrium(rod, loads=[dx.EndForce((0, 0, -share * force))])  # noqa: E731
        assert_critical(problem_at, 1, method)


# -- either side of a jump ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", [dx.Collocation(), dx.DiscreteRod(20)], ids=str)
@pytest.mark.parametrize("length", [47.4144, 1.0, 3.3e-6])
def test_fields_at_a_station_are_those_of_one_side(length: float, method: object) -> None:
    """A moment of 1 at a fifth of the rod, 2 at its end: 3 before and 2 behind, wherever rounding puts the place."""
    for share in (0.1 * 3, 0.3, 1 / 3, 0.7):
        s = share * length
        loads = [dx.PointMoment((0, 1 / length, 0), at=s), dx.EndMoment((0, 2 / length, 0))]
        x = dx.solve(dx.Equilibrium(dx.Rod(length, dx.Stiffness(EI1=1.0, GJ=0.7)), loads=loads), method)
        for place in (s, np.nextafter(s, 0.0), np.nextafter(s, length), s / length * length):
            assert x.m(place)[1] * length == pytest.approx(2.0, rel=1e-6)
            assert x.m(place, side="before")[1] * length == pytest.approx(3.0, rel=1e-6)
            assert x.k(place, side="before")[1] * length == pytest.approx(3.0, rel=1e-6)
        row = x.to_dataset([s], side="before").m.values[0]
        np.testing.assert_allclose(row, x.m(s, side="before"))
    assert x.m(length)[1] * length == pytest.approx(2.0, rel=1e-6)


def test_the_section_at_a_step_is_that_of_one_side() -> None:
    """The radius doubles at s = 0.3, where the function's own value is the smaller: curvature by 16, stress by 8."""
    rod = dx.Rod(1.0, dx.Circle(lambda s: np.where(s > 0.3, 0.02, 0.01)), dx.Material(E=1e9, nu=0.3, density=1000.0))
    x = dx.solve(dx.Equilibrium(rod, loads=[dx.EndForce((0.1, 0, 0))]))
    assert x.k(0.3, side="before")[1] == pytest.approx(16.0 * x.k(0.3)[1], rel=1e-9)
    assert x.stress(0.3, side="before").bending == pytest.approx(8.0 * x.stress(0.3).bending, rel=1e-9)
    assert x.m(0.3, side="before") == pytest.approx(x.m(0.3), rel=1e-9)
    with pytest.raises(dx.InvalidInput, match="side is 'left'; allowed are 'before', 'behind'"):
        x.m(0.3, side="left")


def test_the_largest_stress_is_found_on_the_side_where_it_is() -> None:
    """A couple in the middle turns the moment's sign: 1 before it, -2 behind it."""
    rod = dx.Rod(1.0, dx.Circle(0.01), dx.Material(E=1e9, nu=0.3, density=1000.0))
    for couple, end in ((3.0, -2.0), (-3.0, 2.0), (3.0, -1.0)):
        loads = [dx.PointMoment((0, couple, 0), at=0.1 * 3), dx.EndMoment((0, end, 0))]
        x = dx.solve(dx.Equilibrium(rod, loads=loads))
        largest = max(abs(couple + end), abs(end))
        assert x.largest_stress.von_mises == pytest.approx(4.0 * largest / (np.pi * 1e-6), rel=1e-9)


def test_places_that_rounding_parts_are_one_place() -> None:
    assert 0.1 * 3 != 0.3
    guide = {0.3: dx.Roller(along=UP, position=(0, 0, 0.3))}
    problem = dx.Equilibrium(
        FLAT, between=guide, loads=[dx.PointForce((1, 0, 0), at=0.1 * 3), dx.EndForce((0.1, 0, 0))]
    )
    assert list(problem.stations) == list(problem.points) == [0.3]
    same = dx.Equilibrium(FLAT, between=guide, loads=[dx.PointForce((1, 0, 0), at=0.3), dx.EndForce((0.1, 0, 0))])
    forces = [dx.solve(x).reactions.between[0.3].force for x in (problem, same)]
    np.testing.assert_allclose(*forces, rtol=1e-9, atol=1e-12)
    with pytest.raises(dx.InvalidInput, match=r"two supports at s = 0.3 m, apart by rounding"):
        dx.Equilibrium(FLAT, between=guide | {0.1 * 3: dx.Pinned((0, 0, 0.3))})
    with pytest.raises(dx.InvalidInput, match=r"loads\[0\].at is 1 m, but the rod ends at 1 m"):
        dx.Equilibrium(FLAT, loads=[dx.PointForce((1, 0, 0), at=np.nextafter(1.0, 0.0))])


# -- narrow bends -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", [dx.Collocation(), dx.Shooting(), dx.DiscreteRod(200), dx.DiscreteRod(400)], ids=str)
def test_a_rod_with_a_narrow_bend(method: object) -> None:
    """A quarter of a circle over 1 mm of a metre between straight parts, out of both planes: by geometry."""
    tip = narrow_bend_tip()
    x = dx.solve(dx.Equilibrium(narrow_bend()), method)
    np.testing.assert_allclose(x.tip, tip, atol=1e-3 if isinstance(method, dx.DiscreteRod) else 1e-9)


def test_a_motion_and_a_picture_begin_at_a_narrow_bend() -> None:
    problem = dx.Equilibrium(narrow_bend())
    x = dx.simulate(dx.Motion(problem, 0.02, "unloaded", rotary_inertia=1e-4), dx.ImplicitMidpoint(200, step=0.01))
    np.testing.assert_allclose(x.tip, np.broadcast_to(narrow_bend_tip(), x.tip.shape), atol=1e-3)
    np.testing.assert_allclose(placed(problem, np.array([1.0]))[0][0], narrow_bend_tip(), atol=1e-5)
    np.testing.assert_allclose(
        placed(dx.Equilibrium(narrow_bend(1e-6)), np.array([1.0]))[0][0], narrow_bend_tip(1e-6), atol=1e-5
    )


WAY = np.array([3.0, 4.0, 0.0]) / 5.0  # axis of the bend


def narrow_bend(width: float = 1e-3) -> dx.Rod:
    none, bent = (0.0, 0.0, 0.0), tuple(0.5 * np.pi / width * WAY)
    natural = dx.Table([0.0, 0.5, 0.5, 0.5 + width, 0.5 + width, 1.0], [none, none, bent, bent, none, none], "linear")
    return dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7, mass=1.0), natural=natural)


def narrow_bend_tip(width: float = 1e-3) -> np.ndarray:
    radius, out = 2.0 * width / np.pi, np.cross(WAY, UP)
    return (0.5 + radius) * np.array(UP) + (radius + 0.5 - width) * out


# -- random problems ----------------------------------------------------------------------------------------------


def stiffness_along(rng: np.random.Generator, L: float) -> object:
    """One of: the same all along, a taper, a table with steep ramps; without a unit."""
    kind = rng.integers(4)
    if kind == 0:
        return np.ones_like
    if kind == 1:
        c, power = rng.uniform(0.0, 0.97), rng.integers(1, 5)
        return lambda s: (1.0 - c * s / L) ** power
    n = rng.integers(2, 5)
    at = np.sort(rng.uniform(0.05, 0.95, n))
    knots = np.sort(np.concatenate([[0.0], at, at + 10.0 ** rng.uniform(STEEPEST, -2.0, n), [1.0]]))
    return dx.Table(L * knots, np.repeat(10.0 ** rng.uniform(-1.0, 1.0, n + 1), 2), "linear")


def places(rng: np.random.Generator, L: float) -> list[float]:
    """Places between the ends, many of them 1e-6 to 1e-2 L from another or from an end."""
    found = [L * rng.uniform(0.05, 0.95)]
    for _ in range(rng.integers(1, 4)):
        gap, base = L * 10.0 ** rng.uniform(-6.0, -2.0), rng.choice([*found, 0.0, L])
        side = 1.0 if base < gap else -1.0 if base > L - gap else rng.choice([-1.0, 1.0])
        found.append(float(base + side * gap if rng.random() < 0.7 else L * rng.uniform(0.05, 0.95)))
    return found


def random_problem(seed: int) -> dx.Equilibrium:
    """A straight rod, often under more than its critical load, or a bent one, with loads, springs and guides at places."""
    rng = np.random.default_rng([17, seed])
    L, EI, wider = 10.0 ** rng.uniform(-4.0, 3.0), 10.0 ** rng.uniform(-8.0, 6.0), rng.uniform(1.0, 3.0)
    along, straight = stiffness_along(rng, L), rng.random() < 0.6

    def times(x: float) -> object:
        if isinstance(along, dx.Table):
            return dx.Table(along.s, x * np.array(along.values), "linear")
        return lambda s: x * along(s)

    section = dx.Stiffness(EI1=times(EI), EI2=times(wider * EI), GJ=times(0.7 * EI), mass=times(1.0))
    rod = dx.Rod(L, section, natural=None if straight else tuple(rng.normal(size=3) / L))
    force = EI / L**2 * float(np.min(along(np.linspace(0.0, L, 101)))) ** 0.5
    push = force * (rng.uniform(2.0, 25.0) if straight else rng.uniform(0.0, 6.0))
    across = 0.0 if straight else force
    loads: list[object] = [dx.EndForce((across * rng.normal(), 0.0, -push))]
    between: dict[float, object] = {}
    for s in places(rng, L):
        if rng.random() < 0.6:
            loads.append(
                dx.PointForce((across * rng.normal(), across * rng.normal(), 4.0 * force * rng.normal()), at=s)
            )
        elif straight and rng.random() < 0.5:
            between[s] = dx.Roller(along=UP, position=(0.0, 0.0, s))
        else:
            between[s] = dx.Spring(linear=10.0 ** rng.uniform(-1.0, 4.0) * EI / L**3, position=(0.0, 0.0, s))
    ends = [dx.Free(), dx.Free(), dx.Roller(along=UP, position=(0.0, 0.0, L)), dx.Guided()]
    end = ends[rng.integers(4) if straight else 0]
    if rng.random() < 0.5:
        loads.append(dx.Gravity((0.0, 0.0, 5.0 * force / L * rng.normal())))
    return dx.Equilibrium(rod, end=end, loads=loads, between=between)


def compared(problem: dx.Equilibrium) -> tuple[object, ...] | None:
    """Return how the methods differ, index and shape of both, () where they agree; None where the chain has no equilibrium.

    Collocation starts from the chain's equilibrium, stable or not; a finer chain has a second say.
    """
    s, found = np.linspace(0.0, problem.rod.length, 41), None
    for segments in (100, 400):
        chain = dx.solve(problem, dx.DiscreteRod(segments), throw=False)
        if not chain.converged:  # a rod that rolls up, or snaps
            continue
        ours = dx.solve(problem, start=chain)
        gap = float(np.max(np.linalg.norm(ours.r(s) - chain.r(s), axis=1))) / problem.rod.length
        found = () if ours.index == chain.index and gap < 5e-3 else (segments, ours.index, chain.index, gap)
        if not found:
            break
    return found


@pytest.mark.parametrize("first", range(0, RANDOM, TOGETHER))
def test_collocation_and_the_discrete_rod_agree_on_random_problems(first: int) -> None:
    """Index and shape are the same; problems that can't be compared are counted, and are few."""
    found = {seed: compared(random_problem(seed)) for seed in range(first, first + TOGETHER)}
    assert not {seed: differs for seed, differs in found.items() if differs}
    assert [seed for seed, differs in found.items() if differs is None][MOST_UNCOMPARED:] == []
