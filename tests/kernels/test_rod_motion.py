"""The band of a stage is the derivative of its balance, but for what is left out on purpose."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from darboux.dynamics.system import System, new_state
from darboux.kernels import band, rod_motion

OFF = [
    dx.EndForce((1.0, 2.0, -3.0), offset=(0.2, 0.1, 0.3)),
    dx.PointForce((2.0, -1.0, 1.0), 0.4, offset=(0.1, -0.3, 0.2)),
]


@pytest.mark.parametrize("start", [dx.Clamped(), dx.Hinge((1, 0, 0))], ids=lambda support: type(support).__name__)
def test_the_band_is_the_derivative_of_the_balance(start: dx.supports.Support) -> None:
    """Taylor: what is left of R(V + e dV) - R(V) - e tau A dV falls as e^2.

    The balance is by turns about the tangent where the rod then is, the band by one fixed chart. On an edge that takes up a
    couple c about its tangent t they differ by c [t]_x / 2 |e|^2: the area that t sweeps on the sphere.
    """
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.5, GJ=0.8, EA=50.0, mass=1.0), natural=(1, 2, 3), stretch=True)
    loads = [dx.Gravity(), dx.Foundation(np.diag([1.0, 2.0, 3.0])), *OFF]
    loads += [] if start.clamps else [dx.EndForce((1.0, 2.0, 3.0), at="start", offset=(0.3, 0.2, -0.1))]
    problem = dx.Equilibrium(rod, start, loads=loads)
    motion = dx.Motion(problem, 1.0, damping=[dx.MassDamping(2.0), dx.LinearDrag(3.0, 3.0)])
    rng, N = np.random.default_rng(1), 6
    system = System(motion, N)
    state, _ = system.start()
    state.x[3:] += rng.uniform(-0.02, 0.02, 3 * N)
    moved = new_state(N)
    body = system.body._replace(mass=np.where(np.arange(4 * N + 3) % 4 == 3, 1e-30, system.mass))  # no tops
    row, space = system.drive([0.0], 0.1)[0], system.space
    rod_motion.place(state, np.zeros(4 * N + 3), 1.0, np.zeros(4 * N + 3), row, body, space.step, moved)
    old, now, tau, n = moved, new_state(N), 0.1, 4 * N + 3
    V, before = rng.uniform(-1, 1, n), rng.uniform(-1, 1, n)
    base = -tau * V
    V[:3] = 0.0

    def balance(V):
        rod_motion.place(old, base, tau, V, row, body, space.step, now)
        size = np.linalg.norm(np.diff(now.x.reshape(-1, 3), axis=0), axis=1)
        space.expected[:] = body.rod.EA * (size / body.rod.l - 1.0)
        rod_motion.forces(old, now, V, 1 / tau, body, row, False, True, space)
        rod_motion.add_inertia(old, now, V, before, 1 / tau, body, False, space.residual, space.lower)
        band.fix(space.lower, space.residual, body.fixed)
        return space.residual.copy(), space.lower.copy()

    direction = rng.uniform(-1, 1, n) * ~body.fixed
    R, lower = balance(V)
    general = np.empty(band.FULL * n)
    band.expand(lower, n, general)
    A = sum(np.diag(general.reshape(n, -1)[max(0, -k) : n - max(0, k), band.REACH + k], -k) for k in range(-10, 11))
    for j in range(1, N + 1):
        t, e, c = old.t[3 * j : 3 * j + 3], np.diff(old.x.reshape(-1, 3), axis=0)[j - 1], R[4 * j - 1]
        D = np.zeros((3, n))
        D[:, 4 * j - 4 : 4 * j - 1], D[:, 4 * j : 4 * j + 3] = -np.eye(3), np.eye(3)
        A = A + 0.5 * c / (e @ e) * D.T @ np.cross(np.eye(3), t) @ D
    A[body.fixed] = 0.0
    left = [np.linalg.norm(balance(V + e * direction)[0] - R - e * tau * A @ direction) for e in (1e-3, 5e-4)]
    assert 1.8 < np.log2(left[0] / left[1]) < 2.2, left


@pytest.mark.parametrize("stretch", [True, False])
def test_the_general_band_is_the_derivative_of_a_midpoint_steps_tension(stretch: bool) -> None:
    """Taylor, as above, of the tension alone, with edges that turn by some 0.3 rad in the step."""
    section = dx.Stiffness(EI1=1.0, GJ=0.8, EA=50.0, mass=1.0)
    axis, N, tau = np.array([0.6, 0.0, 0.8]), 6, 0.1
    problem = dx.Equilibrium(dx.Rod(1.0, section, stretch=stretch), end=dx.Roller(along=axis, position=(0, 0, 1)))
    motion = dx.Motion(problem, 1.0, damping=[dx.KelvinVoigt(0.0, 0.0, 0.01)] if stretch else [], rotary_inertia=0.1)
    rng, system, n = np.random.default_rng(1), System(motion, N), 4 * N + 3
    old, _ = system.start()
    now, row, space = new_state(N), system.drive([0.0], 0.1)[0], system.space
    body = system.body._replace(rod=system.body.rod._replace(B=np.zeros_like(system.body.rod.B)))
    free = ~body.fixed

    def held(V):
        V = V * free
        V[-3:] = axis * (axis @ V[-3:])
        return V

    def balance(V):
        rod_motion.place(old, np.zeros(n), tau, V.copy(), row, body, space.step, now)
        space.correction[-1] = rod_motion.KEPT
        for _ in range(2):  # the second time with the tension that the first has found
            rod_motion.forces(old, now, V, 1 / tau, body, row, True, True, space)
        band.fix(space.lower, space.residual, body.fixed)
        rod_motion.project(body.holds, space.lower, space.residual)
        return space.residual.copy()

    V, direction = held(rng.uniform(-0.3, 0.3, n)), held(rng.uniform(-1, 1, n))
    R = balance(V)
    band.expand(space.lower, n, space.general)
    rod_motion.add_lengthening(old, now, 1 / tau, body, space.expected, space.work, space.general)
    general = space.general.reshape(n, -1)
    A = sum(np.diag(general[max(0, -k) : n - max(0, k), band.REACH + k], -k) for k in range(-10, 11))
    A[3::4] = 0.0
    left = [np.linalg.norm(balance(V + e * direction) - R - e * tau * A @ direction) for e in (1e-3, 5e-4)]
    assert 1.8 < np.log2(left[0] / left[1]) < 2.2, left


ROD = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.5, GJ=0.8, EA=50.0, mass=1.0), natural=(1, 2, 3), stretch=True)


def test_the_work_of_a_step_is_the_change_of_energy() -> None:
    """Free flight, steps in which the springs turn by some 0.01 rad: but for the correction (4), energy errs by its cube."""
    motion = dx.Motion(
        dx.Equilibrium(ROD),
        0.06,
        velocity=lambda s: np.outer(np.sin(4 * s), (1.0, 2.0, 0.0)),
        spin=3.0,
        release={"start": 0},
    )
    energy = dx.simulate(motion, dx.ImplicitMidpoint(4, step=0.01, tolerance=1e-12), records=6).energy
    assert np.max(energy.elastic) > 1e-3 * energy.kinetic[0]
    assert energy.drift < 3e-5  # 4e-4 without


def test_what_is_held_along_a_line_stays_on_it() -> None:
    axis = np.array([0.6, 0.0, 0.8])
    r = dx.simulate(dx.Motion(dx.Equilibrium(ROD), 0.1), dx.ImplicitMidpoint(4, step=0.02), records=1).positions[0, -1]
    held = dx.Equilibrium(ROD, end=dx.Roller(along=axis, position=r), loads=[dx.Gravity((3.0, 2.0, 1.0))])
    run = dx.simulate(dx.Motion(held, 0.05), dx.ImplicitMidpoint(4, step=0.01, tolerance=1e-12), records=5)
    away = run.positions[:, -1] - r
    along = away @ axis
    assert np.max(np.abs(along)) > 1e-5
    np.testing.assert_allclose(away, along[:, None] * axis, atol=1e-14)


UP, ALONG = (0, 0, 1), (1, 0, 0)
HELD = {
    "clamp": dx.Clamped(),
    "hinge": dx.Hinge(ALONG),
    "universal": dx.Universal(ALONG, (0, 1, 0)),
    "groove and springs": dx.Spring(np.diag([300.0, 0.0, 0.0]) + np.eye(3), 2.0),
    "springs": dx.Spring(300.0, 2.0),
}
LOADS = {
    "dead": [dx.LineForce((2, 1, 0)), dx.PointMoment((0.1, 0.2, 0.1), at=0.4), dx.Foundation(5.0)],
    "following": [dx.LineForce((2, 1, 0), frame="section"), dx.PointForce((1, 0, 0), at=0.4, follower=True),
                  dx.EndForce((0.5, 0, 0), follower=True), dx.EndMoment((0.1, 0, 0.1), follower=True)],
    "turning": [dx.Rotation((0.5, 1.0, 2.0))],
    "eccentric": OFF,
}  # fmt: skip


def balances(
    start: dx.supports.Support, loads: list, methods: list, rod: dx.Rod = ROD, **motion: object
) -> list[float]:
    """Return the drifts of energy over a few steps, by each method."""
    asked = dx.Motion(dx.Equilibrium(rod, start=start, loads=loads), 0.02, rotary_inertia=1e-3, **motion)
    return [dx.simulate(asked, method, records=2, drift=1.0).energy.drift for method in methods]


METHODS = [dx.ImplicitMidpoint(4, step=2e-3), dx.TRBDF2(4, step=2e-3), dx.StormerVerlet(4, step=2e-4)]
DRIFTS = [1e-4, 5e-3, 5e-4]


@pytest.mark.parametrize("support", HELD)
@pytest.mark.parametrize("loads", LOADS)
def test_energy_is_in_balance_under_every_support_and_load(support: str, loads: str) -> None:
    assert np.all(np.array(balances(HELD[support], LOADS[loads], METHODS)) < DRIFTS)


def test_energy_is_in_balance_with_every_damping_and_where_a_rod_does_not_stretch() -> None:
    damping = [
        dx.KelvinVoigt(1e-3, 1e-3, 1e-3),
        dx.QuadraticDrag(1.0, 2.0, fluid=ALONG),
        dx.LinearDrag(1.0, 2.0),
        dx.MassDamping(1.0),
    ]
    assert np.all(np.array(balances(HELD["clamp"], LOADS["dead"], METHODS, damping=damping)) < DRIFTS)
    stiff = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.5, GJ=0.8, mass=1.0), natural=(1, 2, 3))
    assert np.all(
        np.array(balances(HELD["hinge"], LOADS["dead"], METHODS[:2], stiff, damping=damping[1:])) < DRIFTS[:2]
    )
