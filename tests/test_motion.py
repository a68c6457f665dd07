"""Motion: conservation, orders in time, natural frequencies, damping, moving supports, and what is refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipk

import darboux as dx
from darboux.paper.cases import figure5

UNIT = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.5, GJ=0.8, EA=1e4, mass=1.0), stretch=True)
STEEL = dx.Rod(1.0, dx.Circle(5e-3), dx.Material(E=210e9, nu=0.3, density=7850), stretch=True)
END = (0, 0, 1)
G = 9.81


def beam(rod: dx.Rod) -> float:
    """f = beam (beta L)^2, in Hz."""
    c = rod.stiffness(np.zeros(1))
    return float(np.sqrt(c.EI1[0] / c.mass[0])) / (2 * np.pi * rod.length**2)


def roots(function, *brackets):
    return [brentq(function, a, b, xtol=1e-14) for a, b in brackets]


# Natural frequencies: R. D. Blevins, Formulas for Natural Frequency and Mode Shape (1979), table 8-1

CLAMPED_FREE = roots(lambda b: np.cos(b) * np.cosh(b) + 1, (1.8, 2.0), (4.6, 4.8), (7.8, 7.9))
FREE_FREE = roots(lambda b: np.cos(b) * np.cosh(b) - 1, (4.6, 4.8), (7.8, 7.9), (10.9, 11.1))
CASES = {
    "clamped-free": (dx.Equilibrium(STEEL), {}, 0, CLAMPED_FREE),
    "pinned-pinned": (dx.Equilibrium(STEEL, dx.Pinned(), dx.Pinned(END)), {}, 1, [np.pi, 2 * np.pi, 3 * np.pi]),
    "free-free": (dx.Equilibrium(STEEL), {"release": {"start": 0.0}}, 6, FREE_FREE),
    "clamped-clamped": (dx.Equilibrium(STEEL, end=dx.Clamped(END)), {}, 0, FREE_FREE),
}


@pytest.mark.parametrize("case", CASES)
def test_natural_frequencies_of_bending(case: str) -> None:
    problem, how, rigid, betas = CASES[case]
    found = dx.natural_modes(problem, 2 * len(betas) + rigid, segments=200, **how).frequencies
    assert np.all(found[:rigid] == 0.0)
    exact = beam(STEEL) * np.array(betas) ** 2
    rtol = 1e-6 if "clamped" in case else 1e-7  # what extrapolation leaves is of order (beta h)^4
    np.testing.assert_allclose(found[rigid:].reshape(-1, 2), np.stack([exact, exact], axis=1), rtol=rtol)


def test_natural_frequencies_of_torsion_and_stretch() -> None:
    found = dx.natural_modes(dx.Equilibrium(STEEL), 24, segments=200).frequencies
    for modulus in (STEEL.material.shear_modulus, STEEL.material.E):
        exact = np.sqrt(modulus / STEEL.material.density) / 4.0
        assert np.min(np.abs(found / exact - 1.0)) < 1e-4


def test_a_pinned_beam_under_tension_from_the_modes_about_its_shape() -> None:
    """omega^2 = (T (pi/L)^2 + EI (pi/L)^4) / rhoA"""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=0.1, GJ=0.1, EA=1e6, mass=1.0), stretch=True)
    T = 2.0
    end = np.array([0, 0, 1 + T / 1e6])
    problem = dx.Equilibrium(rod, dx.Pinned(), dx.Pinned(end))
    found = dx.natural_modes(problem, 3, segments=100, about=lambda s: np.outer(s, end)).frequencies
    assert found[0] == 0.0  # the spin about its axis
    np.testing.assert_allclose(2 * np.pi * found[1:], np.sqrt(T * np.pi**2 + 0.1 * np.pi**4), rtol=1e-4)


def waves(modulus: float) -> list[float]:
    """Of a rod clamped at one end, in Hz: torsion and stretch."""
    return [np.sqrt(modulus / STEEL.material.density) / 4.0]


SMALL = {
    **{
        case: (problem, how, [beam(STEEL) * b**2 for b in betas], 2 * len(betas) + rigid)
        for case, (problem, how, rigid, betas) in CASES.items()
        if case != "clamped-clamped"
    },
    "torsion": (dx.Equilibrium(STEEL), {}, waves(STEEL.material.shear_modulus), 24),
    "stretch": (dx.Equilibrium(STEEL), {}, waves(STEEL.material.E), 24),
}


@pytest.mark.parametrize("case", SMALL)
def test_natural_frequencies_of_a_small_motion(case: str) -> None:
    """The spectrum of what is simulated, from a start with the velocities of a mode: one line.

    A motion q = sin(omega t) at equal times obeys q_n+1 + q_n-1 = 2 cos(omega dt) q_n. The midpoint rule turns a mode by
    2 arctan(omega h / 2) in a step, so that omega = (2 / h) tan(the found angle / 2).
    """
    problem, how, exact, count = SMALL[case]
    modes = dx.natural_modes(problem, count, segments=200, **how)
    for frequency in exact:
        i = int(np.argmin(np.abs(modes.frequencies - frequency)))
        s = np.linspace(0.0, 1.0, 201)
        shape, turns = modes.shapes[i], modes.turns[i]
        size = 1e-5 * 2 * np.pi * frequency / max(np.max(np.abs(shape)), np.max(np.abs(turns)))
        h = 1.0 / (40 * frequency)
        velocity = dx.Table(s, size * shape, "linear")
        spin = dx.Table(np.concatenate([[0.0], 0.5 * (s[1:] + s[:-1]), [1.0]]), size * np.pad(turns, 1), "linear")
        motion = dx.Motion(problem, 100 * h, velocity=velocity, spin=spin, **how)
        x = dx.simulate(motion, dx.ImplicitMidpoint(200, step=h, tolerance=1e-12), records=100)
        q = np.einsum("nij,ij->n", x.velocities, shape) + x.spins @ turns
        cosine = q[1:-1] @ (q[2:] + q[:-2]) / (2.0 * q[1:-1] @ q[1:-1])
        found = np.tan(0.5 * np.arccos(cosine)) / (np.pi * h)
        assert abs(found / frequency - 1.0) < 1e-4, f"{case}: {found} Hz, exact {frequency} Hz"
        np.testing.assert_allclose(q, q[0] * np.cos(np.arccos(cosine) * np.arange(101)), atol=1e-4 * q[0])


# Conservation


def flight(steps: int, step: float) -> dx.Trajectory:
    velocity = lambda s: np.stack([2 * np.sin(3 * s) * s, 1.5 * np.cos(5 * s), 0.3 + 0 * s], axis=1)  # noqa: E731
    motion = dx.Motion(
        dx.Equilibrium(UNIT), steps * step, velocity=velocity, spin=lambda s: 3 + 20 * s, release={"start": 0.0}
    )
    return dx.simulate(motion, dx.ImplicitMidpoint(20, step=step), records=20)


@pytest.mark.parametrize("steps", [600, pytest.param(10_000, marks=pytest.mark.slow)])
def test_free_flight_keeps_momenta_and_energy(steps: int) -> None:
    flown = flight(steps, 1e-4)
    for momentum in (flown.momentum, flown.angular_momentum):
        np.testing.assert_allclose(momentum, np.tile(momentum[0], (21, 1)), atol=1e-12 * np.linalg.norm(momentum[0]))
    assert flown.energy.drift < 1e-8
    assert np.max(flown.energy.elastic) > 0.01 * flown.energy.kinetic[0]


def test_loads_change_the_momenta_by_force_and_moment_times_time() -> None:
    force, moment = np.array([0.3, -0.2, 0.5]), np.array([0.1, 0.4, -0.2])
    problem = dx.Equilibrium(
        UNIT, dx.Free(), dx.Clamped(END), loads=[dx.LineForce(force), dx.EndMoment(moment, at="start")]
    )
    x = dx.simulate(dx.Motion(problem, 0.5, release={"end": 0.0}), dx.ImplicitMidpoint(20, step=2e-3), records=5)
    np.testing.assert_allclose(x.momentum, np.outer(x.times, force), atol=1e-12)
    about_centre = x.angular_momentum - np.cross([_centre(x, i) for i in range(6)], x.momentum)
    np.testing.assert_allclose(about_centre, np.outer(x.times, moment), atol=2e-5)


def _centre(x: dx.Trajectory, i: int):
    r = x.positions[i]
    return np.mean(0.5 * (r[1:] + r[:-1]), axis=0)


METHODS = [dx.ImplicitMidpoint(20, step=4e-3), dx.TRBDF2(20, step=4e-3)]


@pytest.mark.parametrize("method", METHODS, ids=lambda method: type(method).__name__)
def test_order_in_time(method) -> None:
    """Of a rod bent, twisted and turned by all loads, from differences of halved steps."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.5, GJ=0.8, EA=1e3, mass=1.0), natural=(0.5, 1.0, 2.0), stretch=True)
    problem = dx.Equilibrium(rod, loads=[dx.Gravity(), dx.EndForce((1, 2, -1)), dx.EndMoment((0.2, 0.3, 0.5))])
    damping = [dx.KelvinVoigt(1e-3, 1e-3, 1e-3), dx.MassDamping(0.2), dx.QuadraticDrag(0.1, 0.3, fluid=(1, 0, 0))]
    motion = dx.Motion(problem, 0.2, damping=damping, load_factor=lambda t: np.sin(5 * t) ** 2)
    ends = []
    for halving in range(3):
        finer = dataclasses.replace(method, step=method.step / 2**halving)
        x = dx.simulate(motion, finer, records=1)
        ends.append(np.concatenate([x.positions[-1].ravel(), x.directors[-1].ravel()]))
    order = np.log2(np.linalg.norm(ends[1] - ends[0]) / np.linalg.norm(ends[2] - ends[1]))
    assert abs(order - method.order) < 0.25, f"order {order:.3f}, declared {method.order}"
    assert x.energy.drift < 1e-4


def test_methods_agree_on_the_rod_of_figure_5_released_from_the_horizontal() -> None:
    motion = dx.Motion(figure5(stretch=True), 0.25)
    midpoint = dx.simulate(motion, dx.ImplicitMidpoint(100, step=5e-4), records=10)
    others = [dx.simulate(motion, method, records=10) for method in (dx.StormerVerlet(100), dx.TRBDF2(100, rtol=1e-6))]
    for other in others:
        assert np.max(np.abs(other.tip - midpoint.tip)) < 1e-3 * 0.25
    assert midpoint.energy.drift < 1e-9
    assert np.linalg.norm(midpoint.tip[-1] - midpoint.tip[0]) > 0.2


@pytest.mark.parametrize("stretch", [True, False])
def test_a_stiff_rod_swings_as_a_pendulum(stretch: bool) -> None:
    """From the horizontal: a quarter period K(sin^2 45 deg) sqrt(2 L / 3 g)."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1e3, GJ=1e3, EA=1e7, mass=1.0), stretch=stretch)
    quarter = float(ellipk(0.5)) * np.sqrt(2.0 / (3.0 * G))
    problem = dx.Equilibrium(rod, dx.Pinned(), loads=[dx.Gravity()])
    motion = dx.Motion(problem, quarter, initial=lambda s: np.outer(s, (1, 0, 0)))
    x = dx.simulate(motion, dx.ImplicitMidpoint(10, step=2e-3), records=20)
    np.testing.assert_allclose(x.tip[-1], (0, 0, -1), atol=1e-3)
    assert x.energy.drift < 1e-6
    if not stretch:
        lengths = np.linalg.norm(np.diff(x.positions, axis=1), axis=2)
        np.testing.assert_allclose(lengths, 0.1, rtol=1e-9)


# Damping


def test_mass_damping_of_a_free_rod() -> None:
    motion = dx.Motion(
        dx.Equilibrium(UNIT), 1.0, velocity=(1, 2, 3), spin=4.0, release={"start": 0.0}, damping=[dx.MassDamping(2.0)]
    )
    x = dx.simulate(motion, dx.ImplicitMidpoint(10, step=1e-3), records=4)
    np.testing.assert_allclose(x.momentum, np.outer(np.exp(-2.0 * x.times), (1, 2, 3)), rtol=1e-5)
    np.testing.assert_allclose(x.spins[-1], 4.0 * np.exp(-2.0), rtol=1e-5)
    np.testing.assert_allclose(x.energy.dissipated[-1], x.energy.total[0] - x.energy.total[-1], rtol=1e-9)


@pytest.mark.parametrize("kind", ["bending", "twist", "stretch"])
def test_kelvin_voigt_damps_a_mode_by_its_frequency_squared(kind: str) -> None:
    """Amplitude exp(-eta omega^2 t / 2): bending of a pinned beam, twist and stretch of a clamped one."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1e-3, EA=100.0, mass=1.0), stretch=True)
    s = np.linspace(0, 1, 21)
    if kind == "bending":
        omega, shape = np.pi**2, {"velocity": lambda s: np.outer(np.sin(np.pi * s), (1e-4, 0, 0))}
        problem = dx.Equilibrium(rod, dx.Pinned(), dx.Pinned(END))
    elif kind == "stretch":
        omega, shape = np.pi / 2 * 10, {"velocity": lambda s: np.outer(np.sin(np.pi * s / 2), (0, 0, 1e-4))}
        problem = dx.Equilibrium(rod)
    else:
        omega, shape = np.pi / 2 * np.sqrt(1e-3 / 0.02), {"spin": lambda s: 1e-3 * np.sin(np.pi * s / 2)}
        problem = dx.Equilibrium(rod)
    eta, period = 0.02 / omega, 2 * np.pi / omega
    motion = dx.Motion(problem, 3 * period, damping=[dx.KelvinVoigt(**{kind: eta})], **shape)
    x = dx.simulate(motion, dx.ImplicitMidpoint(len(s) - 1, step=period / 400), records=3)
    np.testing.assert_allclose(
        x.energy.kinetic[-1] / x.energy.kinetic[0], np.exp(-eta * omega**2 * 3 * period), rtol=0.01
    )
    assert x.energy.drift < 1e-6


@pytest.mark.parametrize(
    "drag", [dx.LinearDrag(2.0, 5.0, fluid=(0.3, 0, 0)), dx.QuadraticDrag(2.0, 5.0, fluid=(0.3, 0, 0))]
)
def test_a_falling_rod_reaches_its_terminal_velocity(drag) -> None:
    """Along itself (x) with the fluid, across (z) where drag carries the weight."""
    problem = dx.Equilibrium(UNIT, dx.Clamped(tangent=(1, 0, 0)), loads=[dx.Gravity()])
    x = dx.simulate(dx.Motion(problem, 20.0, release={"start": 0.0}, damping=[drag]), dx.TRBDF2(10), records=10)
    fall = G / 5.0 if isinstance(drag, dx.LinearDrag) else np.sqrt(G / 5.0)
    np.testing.assert_allclose(x.velocities[-1, :, 2], -fall, rtol=1e-4)
    slip = 0.0 if isinstance(drag, dx.LinearDrag) else 0.3 / (1 + 0.3 * 2.0 * 20.0)  # w' = -2 w^2
    np.testing.assert_allclose(x.velocities[-1, :, 0], 0.3 - slip, atol=1e-3)


def gusts(t: float):
    return np.array([np.sin(3 * t), 0.2, -np.cos(2 * t)])


DRAGS = [
    dx.LinearDrag(1.0, 2.0, fluid=(0, 1, 0)),
    dx.QuadraticDrag(0.3, 0.5, fluid=(0.5, 3, 1)),
    dx.LinearDrag(0.5, 0.7, fluid=gusts),
    dx.QuadraticDrag(0.2, 0.1, fluid=gusts),
    dx.LinearDrag(0.4, 0.3),
]


@pytest.mark.parametrize(
    "method",
    [dx.ImplicitMidpoint(4, step=1e-3), dx.TRBDF2(4, step=1e-3), dx.StormerVerlet(4, step=1e-3)],
    ids=lambda method: type(method).__name__,
)
def test_every_drag_has_its_own_fluid(method) -> None:
    """A straight rod flies without turning: m v' = m g + sum of the drags of v - u, and their work on slip and fluids."""
    g, v0, mass = np.array([0.0, 1.0, -2.0]), np.array([1.0, -1.0, 0.5]), 1.5

    def rates(t, y):
        total, lost, given = mass * g, 0.0, 0.0
        for drag in DRAGS:
            u = drag.fluid(t) if callable(drag.fluid) else np.array(drag.fluid)
            w = y[:3] - u
            along, across = w * (0, 0, 1), w * (1, 1, 0)
            power = 1 if isinstance(drag, dx.QuadraticDrag) else 0
            force = -drag.along * np.linalg.norm(along) ** power * along
            force = force - drag.across * np.linalg.norm(across) ** power * across
            total, lost, given = total + force, lost - force @ w, given + force @ u
        return np.concatenate([total / mass, [lost, given]])

    times = np.linspace(0, 0.8, 5)
    exact = solve_ivp(rates, (0, 0.8), [*v0, 0, 0], t_eval=times, rtol=1e-10, atol=1e-12).y.T
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.8, EA=1e3, mass=mass), stretch=True)
    problem = dx.Equilibrium(rod, loads=[dx.Gravity(g)])
    for order in ([0, 1, 2, 3, 4], [3, 1, 4, 2, 0]):
        damping = [DRAGS[i] for i in order]
        motion = dx.Motion(problem, 0.8, velocity=v0, release={"start": 0}, damping=damping)
        x = dx.simulate(motion, method, records=4)
        np.testing.assert_allclose(x.velocities, np.tile(exact[:, None, :3], (1, 5, 1)), atol=2e-5)
        np.testing.assert_allclose(x.energy.dissipated, exact[:, 3], atol=3e-4)
        np.testing.assert_allclose(x.energy.work, exact[:, 4], atol=3e-4)


# Supports


def test_a_turning_clamp_carries_the_rod_round() -> None:
    """Steady rotation: the equilibrium under the centrifugal force, seen from outside."""
    rod = dx.Rod(0.25, dx.Circle(1e-3), dx.Material(E=1e6, nu=0.5, density=1e3), stretch=True)
    arm = dx.Clamped(position=(0.02, 0, 0), tangent=(1, 0, 0))
    rest = dx.solve(dx.Equilibrium(rod, arm, loads=[dx.Gravity(), dx.Rotation((0, 0, 20.0))]))

    def turned(t):
        c, s = np.cos(20 * t), np.sin(20 * t)
        return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])

    moving = dx.Moving(position=lambda t: turned(t) @ arm.position, frame=lambda t: turned(t) @ arm.R)
    problem = dx.Equilibrium(rod, arm, loads=[dx.Gravity()])
    motion = dx.Motion(problem, 0.2, initial=rest, start=moving, velocity=lambda s: np.cross((0, 0, 20.0), rest.r(s)))
    x = dx.simulate(motion, dx.ImplicitMidpoint(40, step=5e-4), records=10)
    back = np.einsum("nji,nj->ni", [turned(t) for t in x.times], x.tip)
    np.testing.assert_allclose(back, np.tile(rest.tip, (11, 1)), atol=2e-3 * 0.25)
    assert x.energy.drift < 1e-3


def test_work_of_a_shaken_support_is_in_the_balance() -> None:
    problem = dx.Equilibrium(UNIT, loads=[dx.Gravity((0, 0, -1))])

    def turned(t):
        c, s = np.cos(0.4 * np.sin(8 * t) ** 2), np.sin(0.4 * np.sin(8 * t) ** 2)
        return [[1, 0, 0], [0, c, -s], [0, s, c]]

    shaken = dx.Moving(position=lambda t: (0.1 * np.sin(8 * t) ** 2, 0, 0.05 * np.sin(8 * t) ** 2), frame=turned)
    for method in (dx.ImplicitMidpoint(20, step=2e-3), dx.TRBDF2(20, step=1e-3)):
        x = dx.simulate(dx.Motion(problem, 0.5, start=shaken), method, records=10)
        assert np.ptp(x.energy.total) > 1e-3
        assert x.energy.drift < 5e-3
        np.testing.assert_allclose(x.positions[:, 0], [shaken.position(t) for t in x.times], atol=1e-12)


def test_a_released_rod_falls_freely() -> None:
    problem = dx.Equilibrium(UNIT, loads=[dx.Gravity()])
    x = dx.simulate(dx.Motion(problem, 0.4, release={"start": 0.1}), dx.ImplicitMidpoint(20, step=1e-3), records=8)
    assert np.all(x.positions[:3, 0] == 0.0)
    np.testing.assert_allclose(np.diff(x.momentum[2:], axis=0), np.tile((0, 0, -G * 0.05), (6, 1)), atol=1e-9)


def test_from_an_equilibrium_a_rod_stays_or_swings() -> None:
    problem = dx.Equilibrium(UNIT, loads=[dx.Gravity()])
    pulled = dx.solve(problem.with_load(dx.EndForce((1.0, 0, 0))))
    rest = dx.Motion(problem.with_load(dx.EndForce((1.0, 0, 0))), 0.2, initial=pulled)
    x = dx.simulate(rest, dx.ImplicitMidpoint(40, step=2e-3), records=5)
    assert np.max(np.abs(x.tip - x.tip[0])) < 1e-10
    np.testing.assert_allclose(x.tip[0], pulled.tip, atol=2e-3)
    let_go = dx.simulate(dx.Motion(problem, 0.2, initial=pulled), dx.ImplicitMidpoint(20, step=2e-3), records=5)
    assert np.max(np.abs(let_go.tip - let_go.tip[0])) > 0.05


# What is said


def test_what_a_trajectory_says() -> None:
    x = dx.simulate(dx.Motion(figure5(stretch=True), 0.1), dx.ImplicitMidpoint(20, step=1e-3), records=10)
    half = x.at(0.055)
    np.testing.assert_allclose(half.r, 0.5 * (x.positions[5] + x.positions[6]), atol=2e-3)
    np.testing.assert_allclose(np.einsum("nji,njk->nik", half.R, half.R), np.tile(np.eye(3), (20, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(x.r(0.1, [0.0, 0.25]), x.positions[-1, [0, -1]], atol=1e-12)
    assert "kept to" in str(x)
    with pytest.raises(dx.InvalidInput, match=r"runs from 0 to 0\.1 s"):
        x.at(0.2)


def test_a_step_that_does_not_converge_keeps_what_was_reached() -> None:
    problem = dx.Equilibrium(UNIT, loads=[dx.EndForce((0, 1.0, 0))])
    motion = dx.Motion(problem, 1.0, load_factor=lambda t: 1.0 if t < 0.5 else 1e12)
    with pytest.raises(dx.NotConverged, match=r"does not converge at t = 0\.\d+ s, worst near s") as caught:
        dx.simulate(motion, dx.ImplicitMidpoint(10, step=0.02), records=10)
    assert caught.value.solution.times[-1] == pytest.approx(0.5)
    assert (
        dx.simulate(motion, dx.ImplicitMidpoint(10, step=0.02), records=10, throw=False).status.code == "no_convergence"
    )


def test_drift_changes_the_status() -> None:
    motion = dx.Motion(figure5(stretch=True), 0.3)
    assert dx.simulate(motion, dx.TRBDF2(20, rtol=1e-2), records=10, drift=1e-6).status.code == "drift"


CANTILEVER = dx.Equilibrium(UNIT)
WEIGHED = dx.Equilibrium(UNIT, loads=[dx.Gravity(), dx.EndForce((1, 0, 0))])
MISTAKES = {
    "duration is 0": lambda: dx.Motion(CANTILEVER, 0.0),
    "duration is -1": lambda: dx.Motion(CANTILEVER, -1.0),
    "section.mass is missing": lambda: dx.Motion(dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0))), 1.0),
    "section.mass is 0": lambda: dx.Motion(dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0, mass=0.0))), 1.0),
    "must not be negative": lambda: dx.Material(E=1.0, nu=0.3, density=-1.0),
    "load_factor at t = 0.25": lambda: dx.Motion(CANTILEVER, 1.0, load_factor=lambda t: np.nan if t >= 0.25 else 1.0),
    "position at t = ": lambda: dx.Motion(CANTILEVER, 1.0, start=dx.Moving(position=lambda t: (t, t))),
    "failed at t = 0 s: ZeroDivisionError": lambda: dx.Motion(CANTILEVER, 1.0, load_factor=lambda t: 1 / t),
    "off the support": lambda: dx.Motion(CANTILEVER, 1.0, start=dx.Moving(position=lambda t: (1.0, 0, 0))),
    "does not hold it": lambda: dx.Motion(CANTILEVER, 1.0, end=dx.Moving(position=lambda t: (0, 0, 1))),
    "m apart, but the rod is 1 m long": lambda: dx.Motion(
        dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0, mass=1.0)), end=dx.Clamped((0, 0, 0.5))),
        1.0,
        end=dx.Moving(position=lambda t: (0, 0, 0.5 + t)),
    ),
    "must name an end": lambda: dx.Motion(CANTILEVER, 1.0, release="end"),
    "another rod": lambda: dx.Motion(CANTILEVER, 1.0, initial=dx.solve(figure5())),
    "it must be a list, such as": lambda: dx.Motion(CANTILEVER, 1.0, damping=0.1),
    "rate is -1": lambda: dx.MassDamping(-1.0),
    "(or times) in ascending order": lambda: dx.Motion(CANTILEVER, 1.0, load_factor=dx.Table([0, 1, 0.5], [0, 1, 2])),
    "Did you mean release?": lambda: dx.Motion(CANTILEVER, 1.0, relase={"start": 0.1}),
    "release['start'] is -0.1": lambda: dx.Motion(CANTILEVER, 1.0, release={"start": -0.1}),
    "has 2 factors, but the problem has 0 loads": lambda: dx.Motion(CANTILEVER, 1.0, load_factor=[1, 2]),
    "load_factor is 'x'": lambda: dx.Motion(CANTILEVER, 1.0, load_factor="x"),
    "load_factor[1] at t = 0": lambda: dx.Motion(WEIGHED, 1.0, load_factor=[1, lambda t: None]),
    "section.mass is -1": lambda: dx.Stiffness(EI1=1.0, GJ=1.0, mass=-1.0),
    "off the support at its end": lambda: dx.simulate(
        dx.Motion(dx.Equilibrium(UNIT, end=dx.Clamped((0, 0, 0.5))), 1.0)
    ),
    "begins turned away from the frame of the support at its start": lambda: dx.simulate(
        dx.Motion(dx.Equilibrium(UNIT), 1.0, initial=lambda s: np.outer(s, (0, 0, -1)))
    ),
    "motion.start.frame begins turned against": lambda: dx.Motion(
        CANTILEVER, 1.0, start=dx.Moving(position=lambda t: (0, 0, 0), frame=lambda t: np.diag([-1.0, -1.0, 1.0]))
    ),
    "rotary_inertia is missing": lambda: dx.simulate(
        dx.Motion(dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0, mass=1.0))), 1.0)
    ),
    "stretches the rod": lambda: dx.simulate(
        dx.Motion(dx.Equilibrium(dx.Rod(1.0, UNIT.section)), 1.0, velocity=lambda s: np.outer(s, (0, 0, 1)))
    ),
    "use ImplicitMidpoint": lambda: dx.simulate(
        dx.Motion(dx.Equilibrium(dx.Rod(1.0, UNIT.section)), 1.0), dx.StormerVerlet()
    ),
    "largest stable step": lambda: dx.simulate(dx.Motion(CANTILEVER, 1.0), dx.StormerVerlet(20, step=1.0)),
    "a method of motion": lambda: dx.simulate(dx.Motion(CANTILEVER, 1.0), dx.DiscreteRod()),
}


@pytest.mark.parametrize("words", MISTAKES)
def test_mistakes_are_said_in_one_sentence(words: str) -> None:
    with pytest.raises(dx.InvalidInput) as caught:
        MISTAKES[words]()
    assert words in str(caught.value)


# Rods that do not stretch, between supports

STIFF = dx.Rod(1.0, dx.Stiffness(EI1=1.4, EI2=1.0, GJ=0.75, EA=1e3, mass=1.0))
RADIUS = 1.0 / np.pi


def arc(s):
    """Half a circle of length 1."""
    return RADIUS * np.stack([np.sin(s / RADIUS), 0.0 * s, 1.0 - np.cos(s / RADIUS)], axis=1)


ARCH = dx.Equilibrium(STIFF, dx.Pinned(), dx.Pinned(arc(np.ones(1))[0]), [dx.Gravity()])
BENT = dx.Equilibrium(STIFF, end=dx.Clamped((0, 0, 0.9)))
POINTS = np.linspace(0.0, 1.0, 30)
ROLLERS = {s: dx.Roller(along=(0, 0, 1), position=(0, 0, s)) for s in (0.3, 0.6)}
RING = dx.Rod(1.0, STIFF.section)
BEGUN = {
    "equilibrium": (BENT, "equilibrium"),
    "curve": (ARCH, arc),
    "points": (ARCH, dx.Table(POINTS, arc(POINTS))),
    "roller": (dx.Equilibrium(STIFF, end=dx.Roller((0, 0, 1), (0.3, 0, 0.8)), loads=[dx.Gravity((5, 0, -3))]), "equilibrium"),
    "between": (dx.Equilibrium(STIFF, loads=[dx.Gravity((9, 0, -3))], between=ROLLERS), "equilibrium"),
    "three pins": (dx.Equilibrium(STIFF, dx.Pinned(), dx.Pinned((0, 0, 0.8)), [dx.Gravity((5, 0, -3))],
                                  between={0.4: dx.Pinned((0.1, 0, 0.35))}), "equilibrium"),
}  # fmt: skip


@pytest.mark.parametrize("case", BEGUN)
@pytest.mark.parametrize("segments", [12, 200])
def test_a_rod_that_does_not_stretch_begins_between_its_supports(case: str, segments: int) -> None:
    """Its segments have their lengths, its supports hold it, it lies where it was asked for, and its energy is kept."""
    problem, initial = BEGUN[case]
    x = dx.simulate(dx.Motion(problem, 0.02, initial), dx.ImplicitMidpoint(segments, step=2e-3), records=2)
    lengths = np.linalg.norm(np.diff(x.positions, axis=1), axis=2)
    np.testing.assert_allclose(lengths, np.tile(np.diff(x.s), (3, 1)), rtol=1e-9)
    for place, support in x.held:
        axes = support.displacement_axes[:, list(support.held_displacement)]
        np.testing.assert_allclose((place - np.array(support.position)) @ axes, 0.0, atol=1e-12)
    asked = dx.solve(problem).r(x.s) if initial == "equilibrium" else arc(x.s)
    assert np.max(np.abs(x.positions[0] - asked)) < 2.0 / segments**2
    assert x.energy.drift < 1e-3


@pytest.mark.parametrize("segments", [10, 1000])
def test_a_bent_rod_between_clamps_is_set_in_motion(segments: int) -> None:
    """By the other method too; from the shape of other loads; and let go, after which it carries its momentum along."""
    bent = dx.solve(BENT)
    pushed = dx.Motion(BENT.with_load(dx.Gravity((3, 0, 0))), 0.01, bent, release={"end": 0.005})
    x = dx.simulate(pushed, dx.TRBDF2(segments, step=1e-3), records=2, drift=0.1)  # which damps the wave from the end
    assert x.converged
    np.testing.assert_allclose(x.positions[:2, -1], np.tile((0, 0, 0.9), (2, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(np.diff(x.positions, axis=1), axis=2), 1.0 / segments, rtol=1e-9)
    assert np.linalg.norm(x.momentum[-1]) > 1e-3


def test_a_straight_shape_with_slack_is_refused_and_one_without_is_straightened() -> None:
    def straight(s):
        return np.outer(0.995 * s, END)

    def nearly(s):
        return np.stack([1e-3 * np.sin(np.pi * s), 0.0 * s, s], axis=1)

    method = dx.ImplicitMidpoint(10, step=1e-3)
    short, taut = (dx.Equilibrium(STIFF, dx.Pinned(), dx.Pinned((0, 0, z)), [dx.Gravity()]) for z in (0.995, 1.0))
    with pytest.raises(dx.InvalidInput, match="begin with a shape that has the rod's length between them"):
        dx.simulate(dx.Motion(short, 0.1, straight), method)
    x = dx.simulate(dx.Motion(taut, 0.01, nearly), method, records=1)
    np.testing.assert_allclose(x.positions[0], np.outer(x.s, END), atol=1e-4)


# What the energy's drift is measured against

AT_REST = {
    "no load": (dx.Equilibrium(STIFF), {}),
    "factor 0": (dx.Equilibrium(STIFF, loads=[dx.Gravity((3, 0, 0)), dx.EndForce((1, 2, 3), follower=True)]), {"load_factor": 0.0}),
    "taut": (dx.Equilibrium(STIFF, dx.Pinned(), dx.Pinned(END), [dx.Gravity()]), {}),
    "hanging": (dx.Equilibrium(STIFF, loads=[dx.Gravity((0, 0, 9.81))]), {}),
    "far from the origin": (dx.Equilibrium(STIFF, dx.Clamped((0, 0, 1e6)), loads=[dx.Gravity((0, 0, 9.81))]), {}),
    "pushed by a follower": (dx.Equilibrium(STIFF, loads=[dx.EndForce((0, 0, -3), follower=True)]), {}),
    "naturally curved": (dx.Equilibrium(dataclasses.replace(STIFF, natural=(3, 2, 5), stretch=True)), {}),
    "in micrometres": (dx.Equilibrium(dx.Rod(1e-6, dx.Stiffness(EI1=1e-20, GJ=1e-20, EA=1e-4, mass=1e-9), stretch=True)), {}),
    "ring": (dx.Ring(RING), {}),
}  # fmt: skip


@pytest.mark.parametrize("case", AT_REST)
@pytest.mark.parametrize("segments", [10, 300])
def test_rest_is_rest(case: str, segments: int) -> None:
    problem, how = AT_REST[case]
    rod = problem.rod
    time = rod.length**2 * np.sqrt(rod.mass(np.zeros(1), "test")[0] / rod.stiffness(np.zeros(1)).EI1[0])
    motion = dx.Motion(problem, 0.05 * time, **how)
    for method in (dx.ImplicitMidpoint(segments, step=5e-4 * time), dx.TRBDF2(segments)):
        x = dx.simulate(motion, method, records=3)
        assert x.status.converged, f"{method}: {x.status.message}"
        assert np.max(np.abs(x.positions - x.positions[0])) < 1e-9 * rod.length


@dataclasses.dataclass(frozen=True)
class Wrong(dx.ImplicitMidpoint):
    """The midpoint rule with bending and twist a thousandth too stiff in its steps."""

    def begin(self, system):
        run = dx.ImplicitMidpoint(self.segments, self.step).begin(system)
        right, advance = run.body, run.advance

        def stiff(t):
            run.body = right._replace(rod=right.rod._replace(B=1.001 * right.rod.B))
            done = advance(t)
            run.body = right
            return done

        run.advance = stiff
        return run


@pytest.mark.parametrize("size", [1.0, 1e-5])
@pytest.mark.parametrize("stretch", [True, False])
def test_a_true_drift_is_seen(size: float, stretch: bool) -> None:
    """Of a rod that swings much or hardly, whose forces are not those of its energy."""
    problem = dx.Equilibrium(dataclasses.replace(STIFF, stretch=stretch))
    motion = dx.Motion(problem, 0.5, velocity=lambda s: size * np.outer(s**2, (1, 2, 0)))
    right, wrong = (
        dx.simulate(motion, method(10, step=2e-3), records=40, drift=2e-4) for method in (dx.ImplicitMidpoint, Wrong)
    )
    assert (right.status.code, wrong.status.code) == ("converged", "drift")


def test_the_first_step_of_a_shaken_rod_that_does_not_stretch_has_its_work() -> None:
    """A new tension works in it: that of the iteration before the last one made the work twice as much."""
    shaken = dx.Moving(position=lambda t: (0.1 * np.sin(8 * t) ** 2, 0, 0.05 * np.sin(8 * t) ** 2))
    for method in (dx.ImplicitMidpoint(12, step=1e-5), dx.TRBDF2(12, step=1e-5)):
        motion = dx.Motion(dx.Equilibrium(STIFF), 1e-5, start=shaken, rotary_inertia=1e-3)
        energy = dx.simulate(motion, method, records=1, drift=1.0).energy
        np.testing.assert_allclose(energy.work[1], energy.total[1], rtol=0.05)


def test_steps_do_not_stall_where_a_spring_is_almost_still() -> None:
    """What Newton's matrix leaves out of the correction (4) grows as 1 / dk there: steps were halved without end."""
    rod = dx.Rod(10.0, dx.Stiffness(EI1=1e6, GJ=0.75e6, EA=1e8, mass=40.0), stretch=True)
    problem = dx.Equilibrium(rod, loads=[dx.EndForce((1e5, 0, 0))])
    motion = dx.Motion(problem, 0.5, load_factor=lambda t: np.sin(20 * t))
    x = dx.simulate(motion, dx.ImplicitMidpoint(60, step=2e-3), records=50)
    assert x.statistics["halvings"] == 0
    assert x.statistics["steps"] == 250
    assert x.energy.drift < 1e-4


def test_points_are_no_initial_shape() -> None:
    problem = dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7, mass=1.0)))
    for wrong in (np.zeros((5, 3)), [[0, 0, 0], [0, 0, 1]], "rest"):
        with pytest.raises(dx.InvalidInput, match=r"motion.initial is .*; it must be 'unloaded', 'equilibrium', an"):
            dx.Motion(problem, 0.1, rotary_inertia=1e-3, initial=wrong)


@pytest.mark.parametrize("follower", [False, True])
def test_steps_of_a_rod_that_does_not_stretch_are_not_halved(follower: bool) -> None:
    """Edges lengthen along the end of the step, their tensions act along its middle: Newton's matrix is not symmetric."""
    rod = dx.Rod(10.0, dx.Stiffness(EI1=1e6, GJ=1e6, mass=40.0))
    problem = dx.Equilibrium(rod, loads=[dx.EndForce((0, 1e5, 0), follower=follower)])
    motion = dx.Motion(problem, 0.5, load_factor=lambda t: np.sin(20 * t), rotary_inertia=1.0)
    x = dx.simulate(motion, dx.ImplicitMidpoint(60, step=2e-3), records=50)
    assert x.statistics["halvings"] == 0
    assert x.statistics["newton_iterations"] < 7 * x.statistics["steps"]
    assert x.energy.drift < 1e-4
