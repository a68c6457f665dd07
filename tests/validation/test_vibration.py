"""Vibration: frequencies of straight, loaded, rotating, hanging and bent rods, by both ways that find them.

`natural_modes` and the modes of a `DiscreteRod` take every support; what flutters, `natural_modes` alone.
Lengths, EI and rhoA are 1, so that frequencies are omega sqrt(rhoA L^4 / EI).
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import darboux as dx
from tests.validation.judging import COLLOCATION
from tests.validation.record import Digits, digits, stated

TURN = 2.0 * np.pi
UP = (0.0, 0.0, 1.0)
PLANE = dx.Stiffness(EI1=1e4, EI2=1.0, GJ=1e4, EA=1e7, mass=1.0)  # bends about d2 alone
FLAT = dx.Rod(1.0, dx.Stiffness(EI1=1e4, EI2=1.0, GJ=1e4, mass=1.0))
HINGE = dx.Hinge(axis=(0, 1, 0))


def by_discrete_rod(problem, count, **how):
    """Return the function of N that gives the lowest frequencies in rad / s, those that are none left out."""

    def answer(N):
        found = dx.solve(problem, dx.DiscreteRod(N, **how)).modes(count).frequencies
        return TURN * found

    return answer


def by_natural_modes(problem, count, rigid=0, about=None, **motion):
    def answer(N):
        found = dx.natural_modes(
            problem, count + rigid, segments=N, about=about, rotary_inertia=1e-6, **motion
        ).frequencies
        return TURN * found[rigid:]

    return answer


def _betas(ends):
    """omega_n = (beta_n L)^2, three of them; the first is in the record too."""
    betas = [digits("V01", f"beta_{n} L, {ends}") for n in (1, 2, 3)]
    stated("V01", "omega_1", ends)
    return Digits(np.concatenate([b.value for b in betas]) ** 2)


STRAIGHT = dx.Rod(1.0, PLANE, stretch=True)
BEAMS = {
    "clamped-free": ("clamped-free", {}, {}),
    "clamped-clamped": (
        "clamped-clamped (= free-free elastic modes)",
        {"end": dx.Slider(along=UP)},
        {"end": dx.Clamped(UP)},
    ),
    "clamped-pinned": (
        "clamped-pinned (= free-pinned elastic modes)",
        {"end": dx.Roller(along=UP)},
        {"end": dx.Pinned(UP)},
    ),
    "clamped-sliding": ("clamped-sliding", {"end": dx.Guided()}, None),
    "pinned-pinned": ("pinned-pinned", {"start": HINGE, "end": dx.Roller(along=UP)}, None),
}
BETAS = {name: _betas(record) for name, (record, *_) in BEAMS.items()}


@pytest.mark.parametrize("name", BEAMS)
def test_beams(name, judge) -> None:
    """V01; R. D. Blevins, Formulas for Natural Frequency and Mode Shape (1979), table 8-1: omega = (beta L)^2 sqrt(EI / rhoA L^4)."""
    _, discrete, moving = BEAMS[name]
    judge.discrete(
        "V01",
        name,
        "omega",
        "DiscreteRod.modes",
        by_discrete_rod(dx.Equilibrium(FLAT, **discrete), 3),
        BETAS[name],
        64,
        1e-6,
    )
    if moving is not None:
        judge.discrete(
            "V01",
            name,
            "omega",
            "natural_modes",
            by_natural_modes(dx.Equilibrium(STRAIGHT, **moving), 3),
            BETAS[name],
            64,
            1e-6,
            order=4,
        )


for _words in ("axial/torsion", "c axial", "c torsion"):
    stated("V02", _words)


@pytest.mark.parametrize("kind", ["axial", "torsion"])
def test_waves_along_the_rod(kind, judge) -> None:
    """V02: fixed and free (2 n - 1) pi / 2 c / L, free and free n pi c / L, c = sqrt(EA / rhoA) or sqrt(GJ / J)."""
    stiff = (
        {"EI1": 10.0, "EI2": 10.0, "GJ": 1e8, "EA": 1.0}
        if kind == "axial"
        else {"EI1": 10.0, "EI2": 10.0, "GJ": 1.0, "EA": 1e8}
    )
    rod = dx.Rod(1.0, dx.Stiffness(mass=1.0, **stiff), stretch=True)
    for name, motion, rigid, exact in (
        ("fixed-free", {}, 0, [0.5, 1.5, 2.5]),
        ("free-free", {"release": {"start": 0.0}}, 6, [1.0, 2.0, 3.0]),
    ):
        judge.discrete("V02", f"{kind}, {name}", "omega L / c", "natural_modes",
                              lambda N, m=motion, r=rigid: TURN * dx.natural_modes(dx.Equilibrium(rod), 3 + r, segments=N, rotary_inertia=1.0, **m).frequencies[r:],
                              Digits(np.pi * np.array(exact)), 32, 1e-6, order=4)  # fmt: skip


LOADED = {
    f"pinned-pinned, P / P_E = {share:g}": ({"start": HINGE, "end": dx.Roller(along=UP)}, -share * np.pi**2, digits("V03", f"P/P_E={share:g}:"))
    for share in (0.5, -1, -10)
} | {
    f"clamped-clamped, T = {T}": ({"end": dx.Slider(along=UP)}, float(T),
                                  digits("V03", f"T L^2/EI={T}: omega_1") + digits("V03", f"T L^2/EI={T}: omega_2") + digits("V03", f"T L^2/EI={T}: omega_3"))
    for T in (100, -20, -39)
}  # fmt: skip


@pytest.mark.parametrize("name", LOADED)
def test_loaded_beams(name, judge) -> None:
    """V03: EI w'''' - T w'' = rhoA omega^2 w; pinned: omega^2 = (n pi)^2 ((n pi)^2 EI + T)."""
    supports, T, exact = LOADED[name]
    problem = dx.Equilibrium(FLAT, **supports, loads=[dx.EndForce((0, 0, T))])
    judge.discrete(
        "V03", name, "omega", "DiscreteRod.modes", by_discrete_rod(problem, len(exact.value)), exact, 64, 1e-6
    )


SPEEDS = (0, 3, 12)
FLAP = {
    eta: digits("V04", f"eta={eta}: flap omega_1")
    + digits("V04", f"eta={eta}: flap omega_2")
    + digits("V04", f"eta={eta}: flap omega_3")
    for eta in SPEEDS
}
LAG = {eta: digits("V04", f"eta={eta}: lag") for eta in SPEEDS}


@pytest.mark.parametrize("eta", SPEEDS)
@pytest.mark.parametrize("way", ["flap", "lag"])
def test_rotating_cantilever(eta, way, judge) -> None:
    """V04; D. H. Hodges and M. J. Rutkowski, AIAA J. 19 (1981) 1459: flap out of the plane of rotation, lag^2 = flap^2 - eta^2.

    Coriolis' force of either lies along the rod, which does not stretch.
    """
    axis = (eta, 0, 0) if way == "flap" else (0, eta, 0)
    problem = dx.Equilibrium(FLAT, loads=[dx.Rotation(axis)] if eta else [])
    exact = FLAP[eta] if way == "flap" else LAG[eta]
    judge.discrete(
        "V04",
        f"eta = {eta}, {way}",
        "omega",
        "DiscreteRod.modes",
        by_discrete_rod(problem, len(exact.value)),
        exact,
        64,
        1e-6,
    )


def _three(*words):
    return digits("V05", *words, "omega_1") + digits("V05", *words, "omega_2") + digits("V05", *words, "omega_3")


HUNG = {"standing q=1": -1.0, "hanging q=10": 10.0, "hanging q=100": 100.0, "hanging q=1000": 1000.0}
COLUMNS = {name: _three("clamped-free", name) for name in HUNG}
PENDULUMS = {
    q: digits("V05", "flexible pendulum", f"EI={q}: omega_1") + digits("V05", "flexible pendulum", f"EI={q}: omega_2")
    for q in (1, 10, 100, 1000)
}


@pytest.mark.parametrize("name", HUNG)
def test_hanging_and_standing_rods(name, judge) -> None:
    """V05: EI w'''' -+ q ((L - s) w')' = rhoA omega^2 w, hanging or standing."""
    problem = dx.Equilibrium(FLAT, loads=[dx.LineForce((0, 0, HUNG[name]))])
    judge.discrete("V05", name, "omega", "DiscreteRod.modes", by_discrete_rod(problem, 3), COLUMNS[name], 128, 1e-6)


@pytest.mark.parametrize("q", PENDULUMS)
def test_flexible_pendulum(q, judge) -> None:
    """V05, hinged at its top: between the rigid pendulum, sqrt(3/2 g/L), and D. Bernoulli's chain (1738), j_{0,n} / 2 sqrt(g/L)."""
    problem = dx.Equilibrium(FLAT, HINGE, loads=[dx.LineForce((0, 0, float(q)))])
    judge.discrete("V05", f"pendulum q = {q}", "omega sqrt(L / g)", "DiscreteRod.modes",
                          lambda N: by_discrete_rod(problem, 2)(N) / np.sqrt(q), PENDULUMS[q], 64, 1e-6)  # fmt: skip


RIGID, CHAIN = (
    digits("V05", "rigid pendulum"),
    [digits("V05", "hanging chain limit", f"omega_{n}") for n in (1, 2, 3, 4)],
)


def test_limits_of_the_pendulum(judge) -> None:
    """V05: a stiff rod (q = 0.1, which is 1e-4 off its limit) and a soft one (q = 1e8, whose boundary layer at the top changes frequencies by (EI / q)^(1/2) / 2 at most;
    every second of its modes is in the hinge's plane)."""
    for q, exact, allowed in ((1e-1, RIGID, 3e-4), (1e8, CHAIN[0] + CHAIN[1] + CHAIN[2] + CHAIN[3], 1e-4)):
        problem = dx.Equilibrium(FLAT, HINGE, loads=[dx.LineForce((0, 0, q))])
        judge.discrete("V05", f"pendulum q = {q:g}", "omega sqrt(L / g)", "DiscreteRod.modes",
                              lambda N, p=problem, q=q, n=exact.value.size: by_discrete_rod(p, 2 * n)(N)[:: 2 if n > 1 else 1][:n] / np.sqrt(q), exact, 128, allowed)  # fmt: skip


QUARTER = np.pi / 2


def _even(name, words):
    return digits("V06", words, f"n={name}")


IN_PLANE = _even("2", "in-plane flexural") + _even("4", "in-plane flexural")
OUT = {
    1.0: digits("V06", "out-of-plane flexural n=2, GJ/EI=1:"),
    2 / 3: digits("V06", "out-of-plane flexural n=2, GJ/EI=2/3:"),
}


def test_ring_in_its_plane(judge) -> None:
    """V06; R. Hoppe (1871), Love art. 293: omega^2 = n^2 (n^2 - 1)^2 / (n^2 + 1), for even n by a quarter of the ring.

    By symmetry the quarter's ends slide along their radius and do not turn.
    """
    rod = dx.Rod(QUARTER, dx.Stiffness(EI1=1.0, EI2=1e4, GJ=1e4, mass=1.0), natural=(-1.0, 0.0, 0.0))
    start = dx.Slider(along=(0, 1, 0), tangent=(1, 0, 0), d1=(0, 0, -1))
    end = dx.Slider(along=(1, 0, 0), position=(1, 1, 0), tangent=(0, 1, 0), d1=(0, 0, -1))
    judge.discrete("V06", "in plane, n = 2, 4", "omega sqrt(rhoA R^4 / EI)", "DiscreteRod.modes",
                          by_discrete_rod(dx.Equilibrium(rod, start, end), 2), IN_PLANE, 64, 1e-6)  # fmt: skip


@pytest.mark.parametrize("ratio", OUT)
def test_ring_out_of_its_plane(ratio, judge) -> None:
    """V06: omega^2 = n^2 (n^2 - 1)^2 / (n^2 + EI / GJ), for n = 2 by a quarter whose ends stay and turn about their radius only."""
    rod = dx.Rod(QUARTER, dx.Stiffness(EI1=10.0, EI2=1.0, GJ=ratio, mass=1.0), natural=(-1.0, 0.0, 0.0))
    start = dx.Hinge(axis=(0, 1, 0), tangent=(1, 0, 0), d1=(0, 0, -1))
    end = dx.Hinge(axis=(1, 0, 0), position=(1, 1, 0), tangent=(0, 1, 0), d1=(0, 0, -1))
    judge.discrete("V06", f"out of plane, n = 2, GJ / EI = {ratio:.3g}", "omega sqrt(rhoA R^4 / EI)", "DiscreteRod.modes",
                          by_discrete_rod(dx.Equilibrium(rod, start, end), 1), OUT[ratio], 64, 1e-6)  # fmt: skip


FREE_RINGS = {
    f"{where}, n = {n}": (n, *how, digits("V06", *words, f"n={n}"))
    for where, waves, words, how in (
        ("in plane", (2, 3, 4), ("in-plane flexural",), (1.0, True, True)),
        ("out of plane, GJ / EI = 1", (2, 3), ("out-of-plane flexural", "GJ/EI=1:"), (1.0, True, False)),
        ("out of plane, GJ / EI = 2/3", (2, 3), ("out-of-plane flexural", "GJ/EI=2/3:"), (2 / 3, True, False)),
        ("naturally straight, out of plane", (2, 3), ("naturally STRAIGHT",), (2 / 3, False, False)),
    )
    for n in waves
}  # fmt: skip


def _small_motion_of_a_ring(n, GJ, round_by_nature, in_plane, N, stretch=True):
    """Return the frequency omega of the one line in the spectrum of a free ring that starts with the velocities of a mode.

    In its plane that is the polygon's own, a sum of two turning waves that stretch no edge; out of it w and the spin
    -w n^2 (EI + GJ) / (EI + GJ n^2), or -w where no natural curvature ties the section to the plane. The midpoint rule
    turns a mode by 2 arctan(omega h / 2) in a step.
    """
    a = TURN * np.arange(N) / N
    if in_plane:
        wave = np.exp(1j * (n + 1) * a) / np.sin((n + 1) * np.pi / N) + np.exp(-1j * (n - 1) * a) / np.sin(
            (n - 1) * np.pi / N
        )
        wave /= np.max(np.abs(wave))
        shape, spin = np.stack([wave.real, wave.imag, 0 * a], axis=1), lambda s: 0.0 * s
    else:
        shape = np.stack([0 * a, 0 * a, np.cos(n * a)], axis=1)
        share = n**2 * (1 + GJ) / (1 + GJ * n**2) if round_by_nature else 1.0
        spin = lambda s: -1e-5 * share * np.cos(n * s)  # noqa: E731
    rod = dx.Rod(
        TURN,
        dx.Stiffness(EI1=1.0, GJ=GJ, EA=1e6, mass=1.0),
        natural=(-1.0, 0.0, 0.0) if round_by_nature else None,
        stretch=stretch,
    )
    start = dx.Clamped((1, 0, 0), tangent=(0, 1, 0), d1=(0, 0, -1 if round_by_nature else 1))  # round the origin
    h = TURN / (n * np.sqrt(n**2 - 1)) / 40
    closed = dx.Table(np.append(a, TURN), 1e-5 * np.append(shape, shape[:1], axis=0), "linear")
    motion = dx.Motion(dx.Ring(rod, start=start), 100 * h, velocity=closed, spin=spin, rotary_inertia=1e-7)
    x = dx.simulate(motion, dx.ImplicitMidpoint(N, step=h, tolerance=1e-12), records=100)
    q = np.einsum("nij,ij->n", x.velocities[:, :-1], shape)
    cosine = q[1:-1] @ (q[2:] + q[:-2]) / (2.0 * q[1:-1] @ q[1:-1])
    np.testing.assert_allclose(q, q[0] * np.cos(np.arccos(cosine) * np.arange(101)), atol=1e-4 * q[0])
    return 2.0 / h * np.tan(0.5 * np.arccos(cosine))


@pytest.mark.parametrize("name", FREE_RINGS)
def test_small_motion_of_a_free_ring(name, judge) -> None:
    """V06, from the spectrum of what is simulated, with 100 and 200 segments."""
    n, *how, exact = FREE_RINGS[name]
    judge.discrete("V06", f"free ring, {name}", "omega sqrt(rhoA R^4 / EI)", "ImplicitMidpoint",
                          lambda N: _small_motion_of_a_ring(n, *how, N), exact, 100, 1e-6)  # fmt: skip


BENT = {}
for _name, _GJ, _EI in (
    ("GJ/EI=1, EI_out/EI=1", 1.0, 1.0),
    ("GJ/EI=0.666667, EI_out/EI=1", 2 / 3, 1.0),
    ("GJ/EI=0.7, EI_out/EI=2.5", 0.7, 2.5),
):
    _found = [digits("V07", f"wL^3/EI=10, {_name}: omega_{n}") for n in range(1, 6)]
    BENT[_name] = (_GJ, _EI, _found[0] + _found[1] + _found[2] + _found[3] + _found[4])


@pytest.mark.parametrize("name", BENT)
def test_heavy_cantilever(name, judge) -> None:
    """V07, about the shape of S05 under w L^3 / EI = 10, in the plane and out of it; the record's own computation."""
    GJ, EI_out, exact = BENT[name]
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=EI_out, GJ=GJ, mass=1.0))
    problem = dx.Equilibrium(rod, dx.Clamped(tangent=(1, 0, 0), d1=(0, 1, 0)), loads=[dx.LineForce((0, 0, -10.0))])
    judge.discrete("V07", name, "omega", "DiscreteRod.modes", by_discrete_rod(problem, 5), exact, 128, 1e-6)


def test_heavy_cantilever_by_natural_modes(judge) -> None:
    """V07 by `natural_modes`, about the equilibrium that `Collocation` finds."""
    name = "GJ/EI=1, EI_out/EI=1"
    exact = BENT[name][2]
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0, mass=1.0))
    problem = dx.Equilibrium(rod, dx.Clamped(tangent=(1, 0, 0)), loads=[dx.LineForce((0, 0, -10.0))])
    shape = dx.solve(problem, COLLOCATION)
    judge.discrete(
        "V07", name, "omega", "natural_modes", by_natural_modes(problem, 5, about=shape), exact, 128, 1e-5, order=4
    )


# Buckled

BUCKLED = {
    alpha: Digits(np.concatenate([digits("V08", f"alpha={alpha} deg, immovable", f"omega_{n}^2").value for n in (1, 2, 3)]) ** 0.5)
    for alpha in (30, 90)
}  # fmt: skip
STIFF = 1e8  # EA L^2 / EI: the record's rod does not stretch


@pytest.mark.parametrize("alpha", BUCKLED)
def test_a_buckled_column(alpha, judge) -> None:
    """V08, in the plane, both ends pinned at their distance 2 E / K - 1, modulus sin(alpha / 2); it may turn about their line."""
    m = np.sin(0.5 * np.radians(alpha)) ** 2
    ends = {"start": dx.Pinned(), "end": dx.Pinned((0, 0, 2.0 * ellipe(m) / ellipk(m) - 1.0))}
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1e4, EI2=1.0, GJ=1e4, EA=STIFF, mass=1.0), stretch=True)
    problem = dx.Equilibrium(rod, **ends)
    about = dx.solve(problem, start=dx.solve(dx.Equilibrium(FLAT, **ends)))
    answer = by_natural_modes(problem, 3, rigid=1, about=about)
    judge.discrete(
        "V08", f"alpha = {alpha} deg, immovable", "omega", "natural_modes", answer, BUCKLED[alpha], 64, 1e-6, order=4
    )


PUSHED = {
    alpha: Digits(np.concatenate([digits("V08", f"alpha={alpha} deg, dead load", f"omega_{n}^2").value for n in (1, 2, 3)]) ** 0.5)
    for alpha in (30, 90)
}  # fmt: skip


@pytest.mark.parametrize("alpha", PUSHED)
def test_a_column_that_its_load_has_buckled(alpha, judge) -> None:
    """V08, in the plane, under the dead load P = 4 K^2 on an end that slides, about the shape that `Collocation` finds."""
    m = np.sin(0.5 * np.radians(alpha)) ** 2
    problem = dx.Equilibrium(FLAT, HINGE, dx.Roller(along=UP), loads=[dx.EndForce((0, 0, -4.0 * ellipk(m) ** 2))])
    answer = by_natural_modes(problem, 3, about=dx.solve(problem))
    judge.discrete(
        "V08", f"alpha = {alpha} deg, dead load", "omega", "natural_modes", answer, PUSHED[alpha], 64, 1e-6, order=4
    )


# Flutter

FOLLOWERS = {
    "Beck": (lambda P: dx.EndForce((0, 0, -P), follower=True), 20.0),
    "Leipholz": (lambda P: dx.LineForce((0, 0, -P), frame="section"), 40.0),
}
FLUTTER = {
    name: digits("T17b", name, "EI at flutter") + digits("T17b", f"{name}: omega", "at flutter") for name in FOLLOWERS
}


@pytest.mark.long
@pytest.mark.parametrize("name", FOLLOWERS)
def test_flutter_of_a_column_under_followers(name, judge) -> None:
    """T17b; M. Beck, Z. angew. Math. Phys. 3 (1952) 225: the load at which two frequencies meet, and their value.

    Where they meet they are of order 2: a root of rounding apart, they are not extrapolated one by one.
    """
    follower, near = FOLLOWERS[name]

    def answer(N):
        def squares(P):
            problem = dx.Equilibrium(FLAT, loads=[follower(P)])
            found = dx.natural_modes(problem, 2, segments=N, rotary_inertia=1e-6, about="equilibrium")
            return (TURN * found.frequencies - 1j * found.growth) ** 2

        load = brentq(
            lambda P: float(np.real((squares(P)[1] - squares(P)[0]) ** 2)), 0.98 * near, 1.02 * near, xtol=1e-6
        )
        return np.array([load, np.sqrt(np.mean(squares(load)).real)])

    judge.discrete("T17b", name, "load L^2 / EI, omega", "natural_modes", answer, FLUTTER[name], 32, 1e-5)
