"""Heavy rods between two supports are cables: solved cold, by where a chain would hang.

Reference: the catenary, inextensible and elastic (H. M. Irvine, Cable Structures, MIT Press, 1981, ch. 2), which a cable leaves by
its bending within sqrt(EI / T) of its ends, and elsewhere by about EI / (w L^3).
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq, root

import darboux as dx
from darboux.statics import hanging_chain

STEEL = dx.Material(E=210e9, nu=0.3, density=7850)
RUBBER = dx.Material(E=1e6, nu=0.5, density=1000)
WEIGHT = dx.Gravity((0, 0, -9.81))


def cable(length: float, radius: float, *, stretch: bool, material: dx.Material = STEEL) -> dx.Rod:
    return dx.Rod(length, dx.Circle(radius), material, stretch=stretch)


def elastic_catenary(rod: dx.Rod, span: float) -> float:
    """The sag in m of a cable between pins at one height: w s = H sinh, with the stretch T / EA."""
    L, c = rod.length, rod.stiffness(np.zeros(1))
    w = float(rod.mass(np.zeros(1), "test")[0]) * 9.81
    soft = 1.0 / float(c.EA[0]) if rod.stretch else 0.0
    half = 0.5 * w * L

    def gap(H: float) -> float:
        return 2.0 * H / w * np.arcsinh(half / H) + H * L * soft - span

    H = brentq(gap, 1e-3 * half, 1e4 * half)
    return float((np.hypot(H, half) - H) / w + w * (0.5 * L) ** 2 / 2.0 * soft)


@pytest.mark.parametrize("stretch", [False, True])
@pytest.mark.parametrize(
    ("length", "radius", "span"), [(10.0, 1e-3, 9.0), (30.0, 2e-3, 25.0), (1e3, 0.02, 950.0), (1e3, 0.02, 999.0)]
)
def test_a_steel_cable_between_two_pins(length: float, radius: float, span: float, *, stretch: bool) -> None:
    rod = cable(length, radius, stretch=stretch)
    problem = dx.Equilibrium(rod, dx.Pinned(), dx.Pinned((span, 0, 0)), [WEIGHT])
    bending = 210e9 * np.pi * radius**4 / 4 / (7850 * 9.81 * np.pi * radius**2 * length**3)
    exact = dx.solve(problem)
    assert exact.stable
    assert "the chain that hangs between its supports" in exact.status.message
    assert exact.statistics["load_steps"] <= 6
    assert abs(-exact.r(0.5 * length)[2] - elastic_catenary(rod, span)) < 3.0 * bending * length
    found = dx.solve(problem, dx.DiscreteRod(400))
    assert found.stable
    np.testing.assert_allclose(found.r(0.5 * length), exact.r(0.5 * length), atol=3e-6 * length)


@pytest.mark.parametrize(("stretch", "tension"), [(True, 394222.861137458), (False, 623815.424848046)])
def test_the_tension_of_a_taut_cable_is_as_exact_as_it_says(tension: float, *, stretch: bool) -> None:
    """It is 1e7 EI / L^2, and was once taken for a free motion: off by 1e-4 N where the estimate said 1e-8, the end by 1e-9 m.

    References, in N: of the cable that stretches its half, guided where it hangs lowest, on another mesh, within 2e-9; of the
    other one this same problem by uncompiled and by compiled kernels.
    """
    rod = cable(1e3, 0.02, stretch=stretch)
    problem = dx.Equilibrium(rod, dx.Pinned(), dx.Pinned((999.0, 0, 0)), [WEIGHT])
    exact = dx.solve(problem, dx.Collocation(rtol=1e-12))
    assert exact.error.reactions < 3e-8
    assert exact.error.tip < 1e-10
    np.testing.assert_allclose(exact.r(1e3), (999.0, 0.0, 0.0), rtol=0, atol=exact.error.tip)
    start, end, weight = exact.reactions.start.force, exact.reactions.end.force, 7850 * 9.81 * np.pi * 0.02**2 * 1e3
    np.testing.assert_allclose(start, (-tension, 0.0, 0.5 * weight), rtol=0, atol=10.0 * exact.error.reactions)
    np.testing.assert_allclose(end, (tension, 0.0, 0.5 * weight), rtol=0, atol=10.0 * exact.error.reactions)


ENDS = {
    "clamps, level": (dx.Clamped(tangent=(1, 0, 0)), dx.Clamped((90, 0, 0), tangent=(1, 0, 0))),
    "clamps, upright": (dx.Clamped(tangent=(0, 0, 1)), dx.Clamped((50, 0, 0), tangent=(0, 0, -1))),
    "clamps, twisted": (dx.Clamped(tangent=(1, 0, 0)), dx.Clamped((90, 0, 0), tangent=(1, 0, 0), twist=7.0)),
    "one above the other": (dx.Pinned(), dx.Pinned((0, 0, 60))),
    "in one place": (dx.Pinned(), dx.Pinned()),
    "on a slope": (dx.Pinned(), dx.Pinned((50, 0, 60))),
}


@pytest.mark.parametrize("stretch", [False, True])
@pytest.mark.parametrize("name", ENDS)
def test_cables_held_in_other_ways(name: str, *, stretch: bool) -> None:
    """Both methods find the same stable shape, cold, the discrete rod with order 2; the balance is integrated independently."""
    problem = dx.Equilibrium(cable(100.0, 0.01, stretch=stretch), *ENDS[name], [WEIGHT])
    fine = 4 if name == "clamps, upright" else 1  # these bend within a metre
    exact, *found = (dx.solve(problem, m) for m in (None, dx.DiscreteRod(200 * fine), dx.DiscreteRod(400 * fine)))
    assert all(x.stable for x in (exact, *found))
    gaps = [float(np.linalg.norm(x.r(50.0) - exact.r(50.0))) for x in found]
    assert gaps[1] < 4e-3
    assert 1.7 < np.log2(gaps[0] / gaps[1]) < 2.3, f"gaps {gaps}, declared order 2"
    assert np.max(np.abs(exact.balance.force)) < 1e-9
    for at, support in (("start", problem.start), ("end", problem.end)):
        if support.clamps and support.twist == 0.0:
            np.testing.assert_allclose(exact.R(0.0 if at == "start" else 100.0), support.R, atol=1e-9)


def test_a_cable_under_wind_and_a_hanging_mass() -> None:
    """The plane of the sag leans by the wind over the weight; a mass bends it where it hangs."""
    rod = cable(100.0, 0.01, stretch=False)
    w = 7850 * 9.81 * np.pi * 0.01**2
    pins = (dx.Pinned(), dx.Pinned((90, 0, 0)))
    leaning = dx.solve(dx.Equilibrium(rod, *pins, [WEIGHT, dx.LineForce((0, 10.0, 0))])).r(50.0)
    assert leaning[1] / -leaning[2] == pytest.approx(10.0 / w, rel=1e-6)
    mass = dx.solve(dx.Equilibrium(rod, *pins, [WEIGHT, dx.PointForce((0, 0, -2000), 30.0)]))
    jump = mass.n(30.0 + 1e-6) - mass.n(30.0 - 1e-6)
    np.testing.assert_allclose(jump, (0, 0, 2000), atol=0.01)


@pytest.mark.parametrize("stretch", [False, True])
def test_a_power_line_over_three_poles(*, stretch: bool) -> None:
    """Each span hangs as it would alone; the pole between them carries half of either, and what bending over it adds."""
    rod = cable(120.0, 0.01, stretch=stretch)
    poles = {50.0: dx.Pinned((46, 0, 0))}
    problem = dx.Equilibrium(rod, dx.Pinned(), dx.Pinned((110, 0, 0)), [WEIGHT], between=poles)
    exact, found = dx.solve(problem), dx.solve(problem, dx.DiscreteRod(480))
    assert exact.stable
    assert found.stable
    np.testing.assert_allclose(found.r(25.0), exact.r(25.0), atol=0.02)
    spans = [cable(length, 0.01, stretch=stretch) for length in (50.0, 70.0)]
    for s, span, chord in ((25.0, spans[0], 46.0), (85.0, spans[1], 64.0)):
        assert -exact.r(s)[2] == pytest.approx(elastic_catenary(span, chord), rel=5e-3)
    w = 7850 * 9.81 * np.pi * 0.01**2
    M = float(np.linalg.norm(exact.m(50.0)))
    assert exact.reactions.between[50.0].force[2] == pytest.approx(60.0 * w + M / 46.0 + M / 64.0, rel=5e-3)


@pytest.mark.parametrize("stretch", [False, True])
@pytest.mark.parametrize("weight", [(), (WEIGHT,)], ids=["weightless", "heavy"])
def test_a_skipping_rope(weight, *, stretch: bool) -> None:
    """Turning steadily it bows out by a half wave: the force along the axis is the same all along it, and it misses no other."""
    rod = cable(3.0, 5e-3, stretch=stretch, material=dx.Material(E=5e7, nu=0.4, density=1100))
    problem = dx.Equilibrium(rod, dx.Pinned(), dx.Pinned((2, 0, 0)), [dx.Rotation((15, 0, 0)), *weight])
    exact, found = dx.solve(problem), dx.solve(problem, dx.DiscreteRod(200))
    assert exact.stable
    assert found.stable
    n = exact.n(np.linspace(0.0, 3.0, 31))
    np.testing.assert_allclose(n[:, 0], n[0, 0], rtol=1e-9)
    bow = np.linalg.norm(exact.r(1.5)[1:])
    assert 0.95 < bow < 1.1
    np.testing.assert_allclose(np.linalg.norm(found.r(1.5)[1:]), bow, rtol=1e-3)
    mass = 1100 * np.pi * 5e-3**2
    s = np.linspace(0.0, 3.0, 301)
    pull = mass * 15**2 * np.trapezoid(exact.r(s)[:, 2], s) - mass * 9.81 * 3.0 * len(weight)
    np.testing.assert_allclose(n[0, 2] - n[-1, 2], pull, rtol=1e-3)


@pytest.mark.parametrize("pull", [(), (dx.Gravity((0, 1, -2)),)], ids=["weightless", "heavy"])
def test_a_skipping_rope_bows_to_the_same_side_wherever_the_origin_lies(pull) -> None:
    rod, shapes = cable(3.0, 5e-3, stretch=False, material=dx.Material(E=5e7, nu=0.4, density=1100)), []
    for x, y, z in ((0.0, 0.0, 0.0), (0.3, -2.1, 5.7)):
        turning = dx.Rotation((15, 0, 0), point=(7.0, y, z))
        rope = dx.Equilibrium(rod, dx.Pinned((x, y, z)), dx.Pinned((x + 2.0, y, z)), [turning, *pull])
        shape = hanging_chain.hung(rope)
        assert shape is not None
        shapes.append(shape.states(np.linspace(0.0, 1.0, 9))[0])
    np.testing.assert_allclose(shapes[0], shapes[1], atol=1e-9)
    assert not pull or shapes[0][4] @ (0, 1, -2) > 0.1  # where gravity pulls


def test_a_thread_of_rubber() -> None:
    rod = cable(1.0, 5e-4, stretch=True, material=RUBBER)
    found = dx.solve(dx.Equilibrium(rod, dx.Pinned(), dx.Pinned((0.7, 0, 0)), [WEIGHT]))
    assert found.stable
    assert -found.r(0.5)[2] == pytest.approx(elastic_catenary(rod, 0.7), rel=1e-3)


@pytest.mark.parametrize("soft", [0.0, 1e-4])
def test_the_chain_is_the_catenary(soft: float) -> None:
    x, chord = np.linspace(0.0, 1.0, 513), np.array([0.6, 0.0, 0.2])
    f, a = np.tile((0.0, 0.0, -5e3), (513, 1)), np.full(513, soft)
    t = hanging_chain._tangents(x, f, chord, a, 1e-3)
    assert t is not None
    slope = t[:, 2] / t[:, 0]  # of a catenary it grows evenly with s, by w / H
    np.testing.assert_allclose(np.diff(slope), np.mean(np.diff(slope)), rtol=1e-3)
    H = 5e3 / (slope[-1] - slope[0])
    stretch = 1.0 + soft * H / t[:, :1]
    np.testing.assert_allclose(np.trapezoid(stretch * t, x, axis=0), chord, atol=1e-9)


def test_what_is_no_cable_begins_as_it_did() -> None:
    light = dx.Rod(0.3, dx.Circle(2e-3), dx.Material(E=1e7, nu=0.5, density=1000))
    steel = cable(30.0, 2e-3, stretch=True)
    pins = (dx.Pinned(), dx.Pinned((0.2, 0, 0)))
    for problem in (
        dx.Equilibrium(light, *pins, [WEIGHT]),
        dx.Equilibrium(steel, dx.Pinned(), dx.Pinned((30.1, 0, 0)), [WEIGHT]),  # taut: there is no sag
        dx.Equilibrium(steel, dx.Clamped(tangent=(1, 0, 0)), loads=[WEIGHT]),
        dx.Equilibrium(steel, dx.Pinned(), dx.Pinned((25, 0, 0)), [WEIGHT, dx.Foundation(1.0)]),
    ):
        assert hanging_chain.hung(problem) is None


@pytest.mark.parametrize("EI", [1e-3, 1e-2, 1.0, 50.0])
@pytest.mark.parametrize("end", [(0, 0, 0), (0, 0, 3.0), (1e-4, 0, -9.0), (0.01, 0, 0)])
def test_ends_in_one_place_or_above_one_another(EI: float, end: tuple[float, float, float]) -> None:
    """A cable of length 10 and weight 10 hangs in a loop, whose width bending sets; no horizontal force holds it together.

    As a chain it hangs straight down from both ends: the lower end carries half the weight less half the height's.
    """
    rod = dx.Rod(10.0, dx.Stiffness(EI1=EI, GJ=EI))
    found = dx.solve(dx.Equilibrium(rod, dx.Pinned(), dx.Pinned(end), [dx.LineForce((0, 0, -1.0))]))
    assert found.index == 0
    start, other = found.reactions.start.force, found.reactions.end.force
    assert start[2] + other[2] == pytest.approx(10.0, abs=1e-7)
    if EI < 0.1:
        loop = (EI / 1.0) ** (1 / 3)  # m
        assert other[2] == pytest.approx(5.0 + 0.5 * end[2], abs=2.0 * loop)
        lowest = float(np.min(found.r(np.linspace(0.0, 10.0, 2001))[:, 2]))
        assert lowest == pytest.approx(-5.0 + 0.5 * end[2] if end[2] > -9.0 else -9.5, abs=2.0 * loop)


@pytest.mark.parametrize("seed", range(6))
def test_a_mass_hangs_from_a_cable_in_the_wind(seed: int) -> None:
    """Forces and moments balance; the chain that carries the mass too gives the pull at the ends, but for what bends."""
    rng = np.random.default_rng(seed)
    L, w = 30.0, float(10.0 ** rng.uniform(0.5, 3.0))
    span, at = L / (1.0 + float(10.0 ** rng.uniform(-3.0, -0.3))), float(rng.uniform(0.2, 0.8)) * L
    mass, wind = w * L * float(rng.uniform(0.1, 2.0)), w * float(rng.uniform(0.0, 1.0))
    loads = [dx.LineForce((0, wind, -w)), dx.PointForce((0, 0, -mass), at=at)]
    found = dx.solve(
        dx.Equilibrium(dx.Rod(L, dx.Stiffness(EI1=1.0, GJ=1.0)), dx.Pinned(), dx.Pinned((span, 0, 0)), loads)
    )
    assert found.index == 0

    def off(n0: np.ndarray) -> np.ndarray:
        """Where the chain ends that pulls at its start with n0, less where it should."""
        s = np.concatenate([np.linspace(0.0, at, 4001), np.linspace(at, L, 4001)])
        n = n0 + np.outer(s, (0.0, -wind, w)) + np.where(np.arange(len(s)) > 4000, mass, 0.0)[:, None] * (0, 0, 1)
        return np.trapezoid(n / np.linalg.norm(n, axis=1)[:, None], s, axis=0) - (span, 0, 0)

    ours = np.array(found.n(0.0))
    chain = root(off, ours, tol=1e-12).x
    bends = (
        np.sqrt(1.0 / np.linalg.norm(chain)) / L
    )  # over the length: where a direction dies away at a pin or the mass
    assert np.linalg.norm(ours - chain) < 5.0 * bends * np.linalg.norm(chain)


def test_a_seabed_carries_a_part_of_a_mooring_line() -> None:
    """B1: H = 97 367.76 N, V = 238 585.13 N at the upper end, by shooting with another integrator."""
    line = dx.Rod(500.0, dx.Stiffness(EI1=1e6, GJ=1e6))

    def seabed(s: np.ndarray, r: np.ndarray, R: np.ndarray) -> np.ndarray:
        return np.stack([0.0 * s, 0.0 * s, 1e3 * np.maximum(0.0, -r[:, 2])], axis=1)

    loads = [dx.LineForce((0, 0, -800.0)), dx.LineForce(seabed)]
    found = dx.solve(dx.Equilibrium(line, dx.Pinned(), dx.Pinned((400.0, 0, 200.0)), loads))
    np.testing.assert_allclose(found.reactions.end.force, (97_367.76, 0.0, 238_585.13), atol=0.01)
