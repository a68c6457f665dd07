"""Motion: waves, spin, pendulum, and creeping filaments, by every method of motion that claims the case."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from tests.validation.judging import Statement
from tests.validation.record import Digits, digits, stated

SPUN = digits("Y04", "free straight extensible rod")
RING = digits("Y04", "closed extensible ring")
stated("Y04", "inextensible closed rod")
PERIOD = digits("Y04", "rigid pendulum limit")
stated("Y04", "torsion: clamped-free")
stated("Y04", "axial: same with EA")

METHODS = [dx.ImplicitMidpoint, dx.TRBDF2, dx.StormerVerlet]


def _method(kind, N, step):
    return (
        kind(N)
        if kind is dx.StormerVerlet
        else kind(N, step=step)
        if kind is dx.ImplicitMidpoint
        else kind(N, rtol=1e-6)
    )


@pytest.mark.parametrize("kind", METHODS, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("way", ["torsion", "axial"])
def test_step_load_at_the_tip(way, kind, judge) -> None:
    """Y04: a triangular wave; the tip answers T L / GJ at t = L / c, 2 T L / GJ at 2 L / c, 0 at 4 L / c, c = sqrt(GJ / J).

    The front of the wave is as sharp as a segment: the error is of the order of h = 1 / N there.
    """
    N, small = 50, 1e-3
    stiffness = {"EI1": 10.0, "GJ": 1.0, "EA": 1e3} if way == "torsion" else {"EI1": 10.0, "GJ": 1e3, "EA": 1.0}
    rod = dx.Rod(1.0, dx.Stiffness(mass=1.0, **stiffness), stretch=True)
    load = dx.EndMoment((0, 0, small)) if way == "torsion" else dx.EndForce((0, 0, small))
    motion = dx.Motion(dx.Equilibrium(rod, loads=[load]), 4.0, rotary_inertia=1.0 if way == "torsion" else None)

    def answer():
        x = dx.simulate(motion, _method(kind, N, 1.0 / (2 * N)), records=8)
        at = [2, 4, 8]
        if way == "axial":
            return (x.tip[at, 2] - 1.0) / small
        d1 = x.directors[at][:, -1]
        return np.arctan2(d1[:, 1], d1[:, 0]) / small

    judge.continuous(Statement("Y04", f"{way}, step", None, "tip at L, 2 L, 4 L over c, over its static value", None, Digits(np.array([1.0, 2.0, 0.0]))),
                     kind.__name__, answer, 2.0 / N, f"{N} segments")  # fmt: skip


@pytest.mark.parametrize("kind", METHODS, ids=lambda kind: kind.__name__)
def test_spinning_free_rod(kind, judge) -> None:
    """Y04: a free rod that spins about its middle, stretched, keeps its length; R_tip / h = tan(k h) / k h, k^2 = rhoA Omega^2 / EA.

    Its shape is the closed form sin(k s) / (k cos(k h)) from the middle; half a turn of it.
    """
    EA, h, k = 100.0, 0.5, 1.0  # half length h, k h = 0.5
    Omega = k * np.sqrt(EA)
    rod = dx.Rod(2 * h, dx.Stiffness(EI1=1.0, GJ=1.0, EA=EA, mass=1.0), stretch=True)
    place = lambda s: np.outer(np.sin(k * (s - h)) / (k * np.cos(k * h)), (1, 0, 0))  # noqa: E731
    first = float(place(np.zeros(1))[0, 0])
    problem = dx.Equilibrium(rod, dx.Pinned((first, 0, 0)))
    motion = dx.Motion(
        problem,
        np.pi / Omega,
        initial=place,
        velocity=lambda s: np.cross((0, 0, Omega), place(s)),
        release={"start": 0.0},
    )

    def answer(N):
        x = dx.simulate(motion, _method(kind, N, np.pi / Omega / (4 * N)), records=4)
        return np.linalg.norm(x.tip - x.positions[:, 0], axis=1)[-1] / (2 * h)

    judge.continuous(
        Statement("Y04", "spinning free rod", None, "R_tip / h", None, SPUN),
        kind.__name__,
        lambda: answer(32),
        2.0 / 32**2,
        "32 segments",
    )


@pytest.mark.parametrize("kind", METHODS, ids=lambda kind: kind.__name__)
def test_spinning_ring(kind, judge) -> None:
    """Y04: a ring that spins in its plane keeps R / R0 = 1 / (1 - rhoA Omega^2 R0^2 / EA); half a turn of it."""
    EA, Omega = 100.0, np.sqrt(10.0)
    rod = dx.Rod(2 * np.pi, dx.Stiffness(EI1=1.0, GJ=1.0, EA=EA, mass=1.0), natural=(-1.0, 0.0, 0.0), stretch=True)
    place = lambda s: RING.value[0] * np.stack([np.cos(s), np.sin(s), 0 * s], axis=1)  # noqa: E731
    ring = dx.Ring(rod, start=dx.Clamped((1, 0, 0), tangent=(0, 1, 0), d1=(0, 0, -1)))
    motion = dx.Motion(
        ring, np.pi / Omega, initial=place, velocity=lambda s: np.cross((0, 0, Omega), place(s)), rotary_inertia=1e-3
    )

    def answer(N):
        x = dx.simulate(motion, _method(kind, N, np.pi / Omega / (4 * N)), records=8)
        sizes = np.linalg.norm(x.positions[:, :-1], axis=2)
        return sizes[np.arange(9), np.argmax(np.abs(sizes - RING.value[0]), axis=1)][4:]

    judge.continuous(
        Statement("Y04", "spinning ring", None, "R / R0", None, RING),
        kind.__name__,
        lambda: answer(48),
        3.0 / 48**2,
        "48 segments",
    )


def test_a_ring_flows_along_itself(judge) -> None:
    """Y04: a flat ring closed after half a turn, every section of which runs along the ring's shape at one speed."""
    N, speed, small = 96, 4.0, 1e-6
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.5, GJ=0.75, EA=1e6, mass=1.0), stretch=True)
    rest = dx.solve(dx.Ring(rod, link=0.5))
    motion = dx.Motion(rest.problem, 0.125, initial=rest, velocity=lambda s: speed * rest.R(s)[:, :, 2],
                       spin=lambda s: speed * rest.k(s)[:, 2], rotary_inertia=small)  # fmt: skip

    def answer():
        x = dx.simulate(motion, dx.ImplicitMidpoint(N, step=1.25e-4), records=4)
        ahead = [np.roll(x.positions[0, :-1], -round(speed * t * N), axis=0) for t in x.times]
        assert np.max(np.abs(x.positions[-1] - x.positions[0])) > 0.2
        return np.max(np.abs(x.positions[:, :-1] - ahead))

    judge.continuous(Statement("Y04", "flow along itself", None, "way off the shape / L", None, Digits(np.array([0.0]))),
                     "ImplicitMidpoint", answer, 2.0 / N**2, f"{N} segments")  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("kind", METHODS, ids=lambda kind: kind.__name__)
def test_pendulum_of_large_swing(kind, judge) -> None:
    """Y04: a stiff rod from the horizontal: T sqrt(g / L) = 4 K(1/2) sqrt(2 / 3); after a quarter it hangs, after the half it is opposite."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1e3, GJ=1e3, EA=1e5, mass=1.0), stretch=True)
    period = float(PERIOD.value[0])
    problem = dx.Equilibrium(rod, dx.Pinned(), loads=[dx.Gravity((0, 0, -1.0))])
    motion = dx.Motion(problem, period / 2, initial=lambda s: np.outer(s, (1, 0, 0)))

    def answer():
        x = dx.simulate(motion, _method(kind, 40, 2e-3), records=2)
        # The time by which it is late, from how far it is from where it should hang, over its velocity there.
        late = x.tip[1, 0] / abs(x.velocities[1, -1, 0])
        return period + 4.0 * late

    judge.continuous(
        Statement("Y04", "pendulum", None, "period sqrt(g / L)", None, PERIOD),
        kind.__name__,
        answer,
        1e-3,
        "40 segments, EI = 1000 rhoA g L^3",
    )


RATES = {
    "free-free": (digits("Y05", "free-free filament"), digits("Y05", "free-free, second")),
    "clamped-free": (digits("Y05", "clamped-free: slowest"), digits("Y05", "clamped-free: second")),
    "pinned-pinned": (digits("Y05", "pinned-pinned"),),
}


def _shape(ends, beta, s):
    """The mode of a beam (Blevins 1979, table 8-1)."""
    if ends == "pinned-pinned":
        return np.sin(beta * s)
    sign = 1.0 if ends == "free-free" else -1.0
    sigma = (
        (np.cosh(beta) - np.cos(beta)) / (np.sinh(beta) - np.sin(beta))
        if sign > 0
        else (np.sinh(beta) - np.sin(beta)) / (np.cosh(beta) + np.cos(beta))
    )
    return np.cosh(beta * s) + sign * np.cos(beta * s) - sigma * (np.sinh(beta * s) + sign * np.sin(beta * s))


@pytest.mark.parametrize("which", [(ends, n) for ends, rates in RATES.items() for n in range(len(rates))], ids=str)
def test_creeping_filament(which, judge) -> None:
    """Y05; C. H. Wiggins and R. E. Goldstein, Phys. Rev. Lett. 80 (1998) 3879: zeta y_t = -EI y'''', modes die as exp(-beta^4 t).

    Inertia is left out by a mass of 1e-6: it changes rates by its product with them over zeta^2.
    """
    ends, n = which
    exact = RATES[ends][n]
    rate = float(exact.value[0])
    beta = rate**0.25
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0, EA=1e4, mass=1e-7), stretch=True)
    supports = {"start": dx.Pinned(), "end": dx.Pinned((0, 0, 1.0))} if ends == "pinned-pinned" else {}
    release = {"start": 0.0} if ends == "free-free" else {}
    small = 1e-4  # the tension of a bow grows as the square of it, and of EA
    motion = dx.Motion(dx.Equilibrium(rod, **supports), 2.0 / rate, initial=lambda s: np.stack([small * _shape(ends, beta, s), 0 * s, s], axis=1),
                       damping=[dx.LinearDrag(1.0, 1.0)], release=release, rotary_inertia=1e-7)  # fmt: skip

    def answer(N):
        x = dx.simulate(motion, dx.TRBDF2(N, rtol=1e-8), records=2)
        mode = _shape(ends, beta, x.s)
        mode[[0, -1]] *= 0.5  # the trapezoidal rule
        sizes = x.positions[:, :, 0] @ mode
        return np.log(sizes[1] / sizes[2]) * rate

    judge.discrete("Y05", f"{ends}, {n + 1}", "rate zeta L^4 / EI", "TRBDF2", answer, exact, 24, 1e-3)


TWISTS = {
    "free-free": digits("Y05", "twist relaxation free-free"),
    "clamped-free": digits("Y05", "twist relaxation clamped-free"),
}


@pytest.mark.parametrize("ends", TWISTS)
def test_creeping_twist(ends, judge) -> None:
    """Y05: zeta_r theta_t = GJ theta'': pi^2 GJ / zeta_r L^2, a quarter of it clamped and free; the friction by `MassDamping`.

    The twist is wound up by a moment, which the load factor takes off, and dies mostly in its slowest mode.
    """
    exact = TWISTS[ends]
    rate = float(exact.value[0])
    J = 1e-4
    rod = dx.Rod(1.0, dx.Stiffness(EI1=10.0, GJ=1.0, EA=1e4, mass=1.0), stretch=True)
    # spin relaxes within J; a first spin of the mode, J spin' = -zeta spin, winds up the mode by spin J / zeta (zeta = 1)
    mode = (lambda s: np.cos(np.pi * s)) if ends == "free-free" else (lambda s: np.sin(np.pi * s / 2))
    motion = dx.Motion(dx.Equilibrium(rod), 2.0 / rate, spin=lambda s: 1e-2 / J * mode(s), damping=[dx.MassDamping(1.0 / J)], rotary_inertia=J,
                       release={"start": 0.0} if ends == "free-free" else {})  # fmt: skip

    def answer(N):
        x = dx.simulate(motion, dx.TRBDF2(N, rtol=1e-7), records=2)
        twist = np.arctan2(x.directors[:, :, 1], x.directors[:, :, 0])
        sizes = twist @ mode((np.arange(N) + 0.5) / N)
        return np.log(sizes[1] / sizes[2]) * rate

    # what inertia changes: rate J over zeta
    judge.discrete(
        "Y05",
        f"twist, {ends}",
        "rate zeta_r L^2 / GJ",
        "TRBDF2",
        answer,
        Digits(exact.value, 1.5 * rate**2 * J),
        24,
        1e-3,
    )
