"""Natural vibrations against what shares nothing with them: transfer matrices, characteristic equations, closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import chebyshev
from scipy.linalg import eig, expm
from scipy.optimize import brentq

import darboux as dx
from darboux.dynamics.system import System
from darboux.statics.vibrations import Found, extrapolated

UP = (0.0, 0.0, 1.0)
PLANE = dx.Stiffness(EI1=1e6, EI2=1.0, GJ=1e6, EA=1e9, mass=1.0)  # bends about d2 alone
FLAT = dx.Rod(1.0, PLANE, stretch=True)
ROUND = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.8, EA=1e6, mass=1.0))
STATE = np.eye(4)  # of a beam in its plane: w, w', M = EI w'', V = M'
CLAMPED, PINNED, GUIDED, FREE = STATE[:2], STATE[[0, 2]], STATE[[1, 3]], STATE[2:]  # what is zero at an end


def along(EI: float, mass: float, length: float, omega: float) -> np.ndarray:
    """The transfer matrix of a uniform beam, EI w'''' = mass omega^2 w."""
    A = np.array([[0, 1, 0, 0], [0, 0, 1 / EI, 0], [0, 0, 0, 1], [mass * omega**2, 0, 0, 0]])
    return expm(A * length)


def null_space(rows: np.ndarray) -> np.ndarray:
    return np.linalg.svd(rows)[2][len(rows) :].T


def frequencies(beam, start: np.ndarray, end: np.ndarray, below: float, count: int = 2) -> np.ndarray:
    """The lowest omega at which the transfer matrix beam(omega) takes what ``start`` leaves free to what ``end`` holds at zero."""

    def determinant(omega: float) -> float:
        return float(np.linalg.det(np.array(end) @ beam(omega) @ null_space(start)))

    omega = np.linspace(0.05, below, 600)
    signs = np.sign([determinant(x) for x in omega])
    places = np.flatnonzero(signs[1:] != signs[:-1])[:count]
    return np.array([brentq(determinant, omega[i], omega[i + 1], xtol=1e-13) for i in places])


def uniform(omega: float) -> np.ndarray:
    return along(1.0, 1.0, 1.0, omega)


def hinge(**where) -> dx.Hinge:
    return dx.Hinge(axis=(0, 1, 0), **where)


K, C = 3.0, 0.7
HELD = {  # supports at both ends, and what is zero there
    "clamped, free": ({}, CLAMPED, FREE),
    "clamped, hinge": ({"end": hinge(position=UP)}, CLAMPED, PINNED),
    "hinge, roller": ({"start": hinge(), "end": dx.Roller(along=UP, position=UP)}, PINNED, PINNED),
    "clamped, slider along": ({"end": dx.Slider(along=UP, position=UP)}, CLAMPED, CLAMPED),
    "clamped, slider across": ({"end": dx.Slider(along=(1, 0, 0), position=UP)}, CLAMPED, GUIDED),
    "hinge, guided": ({"start": hinge(), "end": dx.Guided()}, PINNED, GUIDED),
    "clamped, universal": ({"end": dx.Universal((0, 1, 0), (1, 0, 0), position=UP)}, CLAMPED, PINNED),
    "clamped, groove": ({"end": dx.Roller(along=UP, position=UP, sliding="section")}, CLAMPED, PINNED),
    "clamped, spring": ({"end": dx.Spring(linear=K, position=UP)}, CLAMPED, [STATE[2], STATE[3] - K * STATE[0]]),
    "clamped, rotating spring": ({"end": dx.Spring(rotational=C, position=UP)}, CLAMPED, [STATE[2] + C * STATE[1], STATE[3]]),
}  # fmt: skip


@pytest.mark.parametrize("name", HELD)
def test_every_support(name: str) -> None:
    supports, start, end = HELD[name]
    exact = frequencies(uniform, start, end, 70.0)
    found = dx.natural_modes(dx.Equilibrium(FLAT, **supports), 2, segments=100)
    np.testing.assert_allclose(found.frequencies * dx.turn, exact, rtol=3e-6)
    assert not np.any(found.growth)


@pytest.mark.parametrize("stiffness", [None, 50.0])
def test_a_support_between_the_ends(stiffness: float | None) -> None:
    """A pin at 0.4, or a spring, whose force makes V jump."""

    def beam(omega: float) -> np.ndarray:
        jump = np.eye(4)
        jump[3, 0] = -(1e12 if stiffness is None else stiffness)
        return along(1.0, 1.0, 0.6, omega) @ jump @ along(1.0, 1.0, 0.4, omega)

    place = (0, 0, 0.4)
    held = dx.Roller(along=UP, position=place) if stiffness is None else dx.Spring(linear=stiffness, position=place)
    found = dx.natural_modes(dx.Equilibrium(FLAT, between={0.4: held}), 2, segments=60)
    np.testing.assert_allclose(found.frequencies * dx.turn, frequencies(beam, CLAMPED, FREE, 70.0), rtol=1e-5)


# Segments, jumps


CANTILEVER = brentq(lambda b: np.cos(b) * np.cosh(b) + 1.0, 1.8, 2.0, xtol=1e-15) ** 2


def test_no_number_of_segments_loses_the_lowest_frequency() -> None:
    """Of order 2 alone, to the last of 2,000; extrapolated of order 4, until all digits are right."""
    sizes = np.array([100, 200, 400, 800, 1600, 2000])
    problem = dx.Equilibrium(ROUND)
    errors = [dx.solve(problem, dx.DiscreteRod(N)).modes(1).stiffness[0] / CANTILEVER**2 - 1.0 for N in sizes]
    scaled = np.array(errors) * sizes**2
    np.testing.assert_allclose(scaled, scaled[0], rtol=2e-3, err_msg=f"{errors}, declared order 2")
    left = [
        dx.natural_modes(problem, 1, segments=N).frequencies[0] * dx.turn / CANTILEVER - 1.0 for N in (50, 100, 2000)
    ]
    assert 3.9 < np.log2(left[0] / left[1]) < 4.1, f"{left}, declared order 4"
    assert abs(left[2]) < 1e-11


@pytest.mark.parametrize("stretch", [True, False])
def test_few_segments_have_as_many_modes(stretch: bool) -> None:
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.4, GJ=0.7, EA=1e5, mass=1.0), stretch=stretch)
    exact = frequencies(uniform, CLAMPED, CLAMPED, 30.0, 1)[0]
    for segments in (6, 7):
        found = dx.natural_modes(dx.Equilibrium(rod, end=dx.Clamped(UP)), 6, segments=segments, rotary_inertia=1e-2)
        assert found.frequencies[0] * dx.turn == pytest.approx(exact, rel=0.04)
        assert found.shapes.shape == (6, segments + 1, 3)
        assert found.turns.shape == (6, segments)
        assert found.s.shape == (segments + 1,)


def stepped(s: np.ndarray, values: tuple[float, ...]) -> np.ndarray:
    return np.choose(np.searchsorted([0.37, 0.612345], s, side="right"), values)


@pytest.mark.parametrize("by", ["natural_modes", "DiscreteRod", "extrapolate"])
def test_jumps_of_mass_and_stiffness_leave_the_order(by: str) -> None:
    EI, mass, l = (1.0, 3.0, 0.5), (1.0, 0.2, 4.0), (0.37, 0.242345, 0.387655)

    def beam(omega: float) -> np.ndarray:
        return np.linalg.multi_dot([along(*part, omega) for part in zip(EI[::-1], mass[::-1], l[::-1], strict=True)])

    exact = frequencies(beam, CLAMPED, FREE, 25.0)
    section = dx.Stiffness(EI1=lambda s: stepped(s, EI), EI2=1e4, GJ=1e4, mass=lambda s: stepped(s, mass))
    problem = dx.Equilibrium(dx.Rod(1.0, section))

    def found(N: int) -> np.ndarray:
        if by == "natural_modes":
            return dx.natural_modes(problem, 2, segments=2 * N, rotary_inertia=1e-3).frequencies * dx.turn
        return dx.solve(problem, dx.DiscreteRod(N, extrapolate=by == "extrapolate")).modes(2).frequencies * dx.turn

    coarse, fine = (np.max(np.abs(found(N) / exact - 1.0)) for N in (40, 80))
    order = 2 if by == "DiscreteRod" else 4
    assert order - 0.4 < np.log2(coarse / fine) < order + 0.8, f"{coarse}, {fine}, declared order {order}"
    assert fine < (1e-4 if order == 2 else 1e-8)


def test_a_lump_at_the_end() -> None:
    """Nearly all mass in the last 1.5 % of the length, by functions; 4.88797 Hz by transfer matrices."""
    section = dx.Stiffness(EI1=8.0, GJ=6.0, EA=1e6, mass=lambda s: np.where(s > 0.66, 8.5, 0.01))
    problem = dx.Equilibrium(dx.Rod(0.67, section, stretch=True))
    exact = frequencies(lambda w: along(8.0, 8.5, 0.01, w) @ along(8.0, 0.01, 0.66, w), CLAMPED, FREE, 100.0, 1)[0]
    assert exact / dx.turn == pytest.approx(4.88797, abs=1e-5)
    for N, rtol in ((67, 1e-4), (100, 1e-6)):  # an odd number meets the jump, but has no half
        found = dx.natural_modes(problem, 1, segments=N).frequencies[0] * dx.turn
        assert found == pytest.approx(exact, rel=rtol)


def test_more_jumps_than_nodes_are_not_extrapolated() -> None:
    """31 pieces of two masses: what is within a segment is integrated, and of order 2 at best."""

    def beam(omega: float) -> np.ndarray:
        light, heavy = (along(1.0, mass, 1 / 31, omega) for mass in (1.0, 3.0))
        return light @ np.linalg.matrix_power(heavy @ light, 15)

    exact = frequencies(beam, CLAMPED, FREE, 20.0)
    section = dx.Stiffness(EI1=1.0, EI2=1e4, GJ=1e4, mass=lambda s: np.where((31 * s).astype(int) % 2 == 0, 1.0, 3.0))
    found = dx.natural_modes(dx.Equilibrium(dx.Rod(1.0, section)), 2, segments=40, rotary_inertia=1e-3)
    np.testing.assert_allclose(found.frequencies * dx.turn, exact, rtol=4e-3)


def test_the_mass_of_a_motion_is_that_of_the_rod() -> None:
    """Vertices and edges have what lies in their cells, wherever it jumps."""
    section = dx.Stiffness(EI1=1.0, GJ=1.0, EA=1e4, mass=lambda s: np.where(s > 0.777, 8.5, 0.01))
    system = System(dx.Motion(dx.Equilibrium(dx.Rod(1.0, section, stretch=True)), 1.0), 10)
    unit = system.units.mass
    masses = np.append(system.mass, 0.0).reshape(-1, 4)[:, 0] * unit
    wanted = [0.0005, *[0.001] * 7, 0.01 * 0.027 + 8.5 * 0.073, 0.85, 0.425]
    np.testing.assert_allclose(masses, wanted, rtol=1e-9)
    np.testing.assert_allclose(system.sixth[7] * 6.0 * unit, 0.01 * 0.077 + 8.5 * 0.023, rtol=1e-9)


# Which mode is which


def test_modes_that_change_places_are_told_by_their_shapes() -> None:
    """The second mode of one plane and the third of the other, so close that half as many segments have them in the other order."""
    clamped = [
        brentq(lambda b: np.cos(b) * np.cosh(b) - 1.0, *ends, xtol=1e-15) ** 2 for ends in ((4, 5), (7, 8), (10, 12))
    ]
    ratio = (clamped[2] / clamped[1]) ** 2 * (1.0 - 0.008)
    rod = dx.Rod(1.0, dx.Stiffness(EI1=ratio, EI2=1.0, GJ=1e3, EA=1e8, mass=1.0))
    problem = dx.Equilibrium(rod, end=dx.Slider(along=UP, position=UP))
    exact = np.sort([*clamped, *(np.sqrt(ratio) * np.array(clamped[:2]))])
    places = [
        np.argmax(np.abs(dx.solve(problem, dx.DiscreteRod(N)).modes(5).displacements[3, :, :2]).max(axis=0))
        for N in (20, 40)
    ]
    assert places[0] != places[1]
    found = dx.natural_modes(problem, 5, segments=40, rotary_inertia=1e-3).frequencies * dx.turn
    np.testing.assert_allclose(found, exact, rtol=2e-4)


def test_a_plane_of_modes_is_compared_with_a_plane() -> None:
    """Two modes of one value, turned by any angle, and two that have changed places."""
    fine, turned = np.eye(23)[:, :4], np.eye(23)[:, :4].copy()
    c, s = np.cos(0.7), np.sin(0.7)
    turned[:2, :2] = [[c, -s], [s, c]]
    turned[:, [2, 3]] = turned[:, [3, 2]]
    nodes, weights = np.linspace(0.0, 1.0, 6), np.ones(23)
    values, _ = extrapolated(
        Found(np.array([1.0, 1.0, 8.9, 9.1]), turned, nodes, weights),
        Found(np.array([1.3, 1.3, 9.4, 9.5]), fine, nodes, weights), 1 / 3, False,
    )  # fmt: skip
    np.testing.assert_allclose(values, [1.4, 1.4, 9.5, 9.7], rtol=1e-14)


# Zero, soft, unstable


def test_a_rod_that_nothing_holds() -> None:
    """Six rigid motions, 0 to the last bit, and (beta L)^2 with cos beta cosh beta = 1."""
    exact = brentq(lambda b: np.cos(b) * np.cosh(b) - 1.0, 4.6, 4.8, xtol=1e-15) ** 2
    bare = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.8, mass=1.0))  # twist follows without inertia
    for rod in (ROUND, FLAT, bare, dx.Rod(1.0, PLANE, natural=(0.0, 0.5, 0.0), stretch=True)):
        found = dx.natural_modes(rod, 7, segments=100).frequencies * dx.turn
        assert np.all(found[:6] == 0.0)
        if rod.natural is None:
            assert found[6] == pytest.approx(exact, rel=1e-6)


def test_soft_modes_are_not_zero() -> None:
    """A rod of EI = 1e6 that stretches with EA = 1, and one that hangs in springs of 1e-8 EI / L^3."""
    stiff = dx.Rod(1.0, dx.Stiffness(EI1=1e6, GJ=1e6, EA=1.0, mass=1.0), stretch=True)
    found = dx.natural_modes(dx.Equilibrium(stiff), 1, segments=100, rotary_inertia=1.0).frequencies * dx.turn
    np.testing.assert_allclose(found, np.pi / 2, rtol=1e-6)
    soft = dx.Equilibrium(ROUND, dx.Spring(linear=1e-8), dx.Spring(linear=1e-8, position=UP))
    modes = dx.natural_modes(soft, 6, segments=100)
    assert np.count_nonzero(modes.frequencies == 0.0) == 1  # it spins
    np.testing.assert_allclose(
        np.sort(modes.frequencies)[1:] * dx.turn, np.sqrt(1e-8 * np.array([2, 2, 2, 6, 6])), rtol=1e-5
    )


@pytest.mark.parametrize("natural", [(0, dx.turn, 0), None])
def test_rigid_motions_of_rings(natural) -> None:
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7, mass=1.0), natural=natural)
    rigid = 6 if natural else 7  # where no curvature ties it to its plane it may turn about its centreline
    found = dx.natural_modes(dx.Ring(rod), rigid + 2).frequencies
    assert np.all(found[:rigid] == 0.0)
    n, beside = 2.0, 1.0 if natural is None else 1.0 / 0.7
    out = n * np.sqrt(n**2 - 1.0) if natural is None else n * (n**2 - 1.0) / np.sqrt(n**2 + beside)
    exact = min(n * (n**2 - 1.0) / np.sqrt(n**2 + 1.0), out) * dx.turn
    np.testing.assert_allclose(found[rigid:], exact, rtol=1e-4)


def test_what_is_unstable_is_negative() -> None:
    """A straight column over its critical load: omega^2 = (pi^2)^2 (1 - P / P_E) between hinge and roller."""
    P = 1.5 * np.pi**2
    column = dx.Equilibrium(
        dx.Rod(1.0, dx.Stiffness(EI1=1e4, EI2=1.0, GJ=1e4, EA=1e8, mass=1.0)),
        hinge(), dx.Roller(along=UP), loads=[dx.EndForce((0, 0, -P))],
    )  # fmt: skip
    found = dx.natural_modes(column, 1, segments=100, about=lambda s: np.outer(s, UP))
    growth = np.pi**2 * np.sqrt(0.5)
    np.testing.assert_allclose(found.frequencies * dx.turn, -growth, rtol=1e-6)
    np.testing.assert_allclose(found.growth, growth, rtol=1e-6)


# In a frame that turns, and under loads without a potential


def shaft(EI2: float, omega: float) -> dx.Equilibrium:
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=EI2, GJ=0.8, EA=1e6, mass=1.0))
    return dx.Equilibrium(rod, dx.Pinned(), dx.Roller(along=UP), loads=[dx.Rotation((0, 0, omega))])


def roots_of_a_shaft(EI2: float, omega: float) -> np.ndarray:
    """z of (z^2 + a) (z^2 + b) + 4 omega^2 z^2 = 0, a, b = omega_1,2^2 - omega^2, of the first two half waves; Im z >= 0."""
    z = []
    for n in (1, 2):
        a, b = (EI * (n * np.pi) ** 4 - omega**2 for EI in (1.0, EI2))
        z += list(np.sqrt(np.roots([1.0, a + b + 4.0 * omega**2, a * b]).astype(complex)))
    return np.array([x if x.imag > 1e-9 or x.real > 0.0 else -x for x in z])


@pytest.mark.parametrize("omega", [3.0, 9.0, 15.0])
def test_a_round_shaft_whirls_forwards_and_backwards(omega: float) -> None:
    """omega_n - omega and omega_n + omega in the turning frame, below its critical speed and above; it spins freely too."""
    found = dx.natural_modes(shaft(1.0, omega), 5, segments=60)
    exact = np.sort([abs(n**2 * np.pi**2 + sign * omega) for n in (1, 2) for sign in (1, -1)])
    np.testing.assert_allclose(found.frequencies * dx.turn, [0.0, *exact], rtol=1e-5)
    assert not np.any(found.growth)
    turns = found.shapes[1, 30, 1] / found.shapes[1, 30, 0]  # a circle: y = -+ i x
    np.testing.assert_allclose(turns.real, 0.0, atol=1e-6)
    np.testing.assert_allclose(np.abs(turns.imag), 1.0, rtol=1e-6)


@pytest.mark.parametrize("omega", [9.0, 10.9, 15.0])
def test_a_flat_shaft_is_unstable_between_its_critical_speeds(omega: float) -> None:
    """omega_1 = pi^2 and pi^2 sqrt(1.5): between them it leaves its axis at the rate Re z, else it whirls."""
    z = roots_of_a_shaft(1.5, omega)
    found = dx.natural_modes(shaft(1.5, omega), 5, segments=100)
    unstable = np.pi**2 < omega < np.pi**2 * np.sqrt(1.5)
    assert np.any(found.growth > 0.0) == unstable
    np.testing.assert_allclose(np.max(found.growth), np.max(z.real), rtol=1e-4, atol=1e-12)
    swinging = found.frequencies[found.frequencies > 0.0] * dx.turn
    np.testing.assert_allclose(swinging, np.sort(z.imag[z.imag > 1e-9])[: len(swinging)], rtol=1e-5)


def test_a_blade_that_turns_about_its_root() -> None:
    """EI w'''' - (T w')' = omega^2 w, T = Omega^2 (1 - x^2) / 2, by Chebyshev collocation; in the plane less Omega^2."""
    spin, n = 6.0, 24
    x = 0.5 * (1.0 - np.cos(np.pi * np.arange(n) / (n - 1)))
    bases = [chebyshev.Chebyshev.basis(i, domain=[0, 1]) for i in range(n)]
    D = [np.stack([basis.deriv(k)(x) if k else basis(x) for basis in bases], axis=1) for k in range(5)]
    T, slope = 0.5 * spin**2 * (1 - x**2), -(spin**2) * x
    A, B = D[4] - T[:, None] * D[2] - slope[:, None] * D[1], D[0].copy()
    for row, condition in zip((0, 1, -2, -1), (D[0][0], D[1][0], D[2][-1], D[3][-1]), strict=True):
        A[row], B[row] = condition, 0.0
    values = eig(A, B, right=False)
    flap = np.sqrt(np.sort(values[np.isfinite(values) & (np.abs(values.imag) < 1e-3) & (values.real > 1.0)].real)[:2])
    assert flap[0] == pytest.approx(7.3604, abs=1e-4)  # A. D. Wright et al., J. Appl. Mech. 49 (1982) 197
    blade = dx.Equilibrium(ROUND, dx.Clamped(tangent=(1, 0, 0)), loads=[dx.Rotation((0, 0, spin))])
    found = dx.natural_modes(blade, 4, segments=100).frequencies * dx.turn
    np.testing.assert_allclose(found, np.sort([*flap, *np.sqrt(flap**2 - spin**2)]), rtol=1e-5)


@pytest.mark.parametrize("load", [15.0, 20.0, 20.1])
def test_a_column_under_a_follower_flutters(load: float) -> None:
    """P^2 + 2 w^2 + P w sinh a sin b + 2 w^2 cosh a cos b = 0, stable to P = 20.05: M. Beck, Z. angew. Math. Phys. 3 (1952) 225."""
    column = dx.Equilibrium(
        dx.Rod(1.0, dx.Stiffness(EI1=1e3, EI2=1.0, GJ=1e3, mass=1.0)), loads=[dx.EndForce((0, 0, -load), follower=True)]
    )
    found = dx.natural_modes(column, 2, segments=100, rotary_inertia=1e-3, about="equilibrium")

    def beck(w: complex) -> complex:
        root = np.sqrt(load**2 / 4 + w**2 + 0j)
        a, b = np.sqrt(root - load / 2), np.sqrt(root + load / 2)
        return load**2 + 2 * w**2 + load * w * np.sinh(a) * np.sin(b) + 2 * w**2 * np.cosh(a) * np.cos(b)

    for frequency, growth in zip(found.frequencies, found.growth, strict=True):
        w, change = dx.turn * frequency - 1j * growth, 1.0
        z = w
        while abs(change) > 1e-12:
            change = beck(z) * 1e-6 / (beck(z + 5e-7) - beck(z - 5e-7))
            z -= change
        assert abs(z - w) < 2e-3 * abs(w)
    assert (found.growth[0] > 0.0) == (load > 20.05)
    assert found.growth[0] == -found.growth[1] or load > 20.05


def test_what_has_no_natural_vibrations_says_so() -> None:
    spun = [dx.Rotation((0, 0, 1.0)), dx.Rotation((1.0, 0, 0))]
    with pytest.raises(dx.InvalidInput, match="two Rotation loads act"):
        dx.natural_modes(dx.Equilibrium(ROUND, loads=spun))
    with pytest.raises(dx.InvalidInput, match="holds a vertex there"):
        dx.natural_modes(dx.Equilibrium(ROUND, between={0.5: dx.Clamped((0, 0, 0.5))}))
    with pytest.raises(dx.InvalidInput, match=r"begins 0\.5 m off its Clamped.*about=solve\(problem\)"):
        dx.natural_modes(dx.Equilibrium(ROUND, end=dx.Clamped((0, 0, 0.5))))
    with pytest.raises(dx.InvalidInput, match=r"count is 30; 20 segments have 20 at most"):
        dx.natural_modes(dx.Equilibrium(ROUND), 30, segments=20)
    with pytest.raises(dx.InvalidInput, match=r"an Equilibrium, a Ring or a Rod"):
        dx.natural_modes(7)
