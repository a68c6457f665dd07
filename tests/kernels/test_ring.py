"""A chain closed to a ring: its band with a border against a dense solve, and the frame of the edge that stands twice."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from darboux.dynamics.modes import joined
from darboux.dynamics.system import System, new_state
from darboux.kernels import band, ring, rod_motion
from tests.kernels.test_band import random_band


@pytest.mark.parametrize("segments", [3, 4, 5, 6, 20])
def test_the_ring_of_a_band_is_solved_as_a_dense_matrix(segments: int) -> None:
    n = 4 * segments + ring.SHARED
    lower, A = random_band(n, 12.0)
    b = np.random.default_rng(1).standard_normal(n)
    J = np.eye(n - ring.SHARED)[np.arange(n) % (n - ring.SHARED)]
    A = np.tril(A) + np.tril(A, -1).T
    x = b.copy()
    assert ring.solve(lower, x, np.empty(ring.LANES * n), np.empty(ring.CORNER))
    np.testing.assert_allclose(x, J @ np.linalg.solve(J.T @ A @ J, J.T @ b), rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("of", ["the band", "the corner"])
def test_a_pivot_of_zero_is_said(of: str) -> None:
    n = 4 * 6 + ring.SHARED
    lower, A = random_band(n, 0.0)
    lower[:] = 0.0
    A[:] = 0.0
    lower[:: band.LOWER] = np.where(np.arange(n) == (12 if of == "the band" else 2), 0.0, 1.0)
    lower[band.LOWER * (n - ring.SHARED) :] = 0.0
    assert not ring.solve(lower, np.ones(n), np.empty(ring.LANES * n), np.empty(ring.CORNER))


def test_the_repeated_edge_has_the_first_ones_frame_turned() -> None:
    """By the link's angle, from d1 towards d2."""
    rng, angle = np.random.default_rng(2), 0.7
    t, d1 = rng.standard_normal((2, 18))
    t[3:6], d1[3:6] = (0, 0, 1), (1, 0, 0)
    ring.close(t, d1, np.array([np.cos(angle), np.sin(angle)]))
    np.testing.assert_allclose(t[12:15], (0, 0, 1))
    np.testing.assert_allclose(d1[12:15], (np.cos(angle), np.sin(angle), 0), atol=1e-15)


def test_the_band_of_a_ring_is_the_derivative_of_its_balance() -> None:
    """Taylor: what is left of R(V + e dV) - R(V) - e tau A dV falls as e^2; see test_rod_motion.py for the couples' share."""
    section = dx.Stiffness(EI1=1.0, EI2=1.5, GJ=0.8, EA=50.0, mass=1.0)
    rod = dx.Rod(1.0, section, natural=(1, 2, 3), stretch=True)
    loads = [dx.Gravity(), dx.Foundation(np.diag([1.0, 2.0, 3.0]))]
    motion = dx.Motion(dx.Ring(rod, link=0.5, loads=loads), 1.0, damping=[dx.MassDamping(2.0), dx.LinearDrag(3.0, 3.0)])
    system = System(motion, 6)
    system.body = system.body._replace(mass=np.where(np.arange(system.mass.size) % 4 == 3, 1e-30, system.mass))
    old, _ = system.start()
    n, tau, now = system.mass.size, 0.1, new_state(system.edges)
    J = np.eye(n - ring.SHARED)[np.arange(n) % (n - ring.SHARED)]
    rng, row, space = np.random.default_rng(1), system.drive([0.0], 0.1)[0], system.space
    start, direction = J @ rng.uniform(-1, 1, n - ring.SHARED), J @ rng.uniform(-1, 1, n - ring.SHARED)

    def balance(V):
        rod_motion.place(old, -tau * start, tau, V, row, system.body, space.step, now)
        size = np.linalg.norm(np.diff(now.x.reshape(-1, 3), axis=0), axis=1)
        space.expected[:] = system.body.rod.EA * (size / system.body.rod.l - 1.0)
        rod_motion.forces(old, now, V, 1 / tau, system.body, row, False, True, space)
        rod_motion.add_inertia(old, now, V, start, 1 / tau, system.body, False, space.residual, space.lower)
        return space.residual.copy(), joined(system, space.lower).toarray()

    R, A = balance(start)
    for j in range(1, system.edges + 1):
        t, e, c = old.t[3 * j : 3 * j + 3], np.diff(old.x.reshape(-1, 3), axis=0)[j - 1], R[4 * j - 1]
        D = np.zeros((3, n))
        D[:, 4 * j - 4 : 4 * j - 1], D[:, 4 * j : 4 * j + 3] = -np.eye(3), np.eye(3)
        A += 0.5 * c / (e @ e) * (D @ J).T @ np.cross(np.eye(3), t) @ D @ J
    R, once = J.T @ R, direction[: n - ring.SHARED]
    left = [np.linalg.norm(J.T @ balance(start + e * direction)[0] - R - e * tau * A @ once) for e in (1e-3, 5e-4)]
    assert 1.8 < np.log2(left[0] / left[1]) < 2.2, left


def test_what_stands_twice_is_accelerated_by_the_force_on_both() -> None:
    g, m = np.random.default_rng(3).uniform(1, 2, (2, 31))
    A = np.zeros(31)
    ring.share(g, m, A)
    np.testing.assert_allclose(A[:7], -(g[:7] + g[24:]) / (m[:7] + m[24:]), rtol=1e-15)
    assert np.array_equal(A[:7], A[24:])
    assert not np.any(A[7:24])


def test_drag_acts_on_every_edge_once() -> None:
    """On a ring that moves without turning: its coefficient times the length, 1 here, and the velocity."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.8, EA=50.0, mass=1.0), stretch=True)
    system = System(dx.Motion(dx.Ring(rod), 1.0, damping=[dx.LinearDrag(5.0, 5.0)]), 8)
    state, _ = system.start()
    V, row = np.tile([1.0, 2.0, 3.0, 0.0], system.edges + 1)[:-1], system.drive([0.0], 0.1)[0]
    rod_motion.forces(state, state, V, 0.0, system.body, row, False, False, system.space)
    force = np.append(system.space.residual, 0.0).reshape(-1, 4)[:, :3].sum(axis=0)
    np.testing.assert_allclose(force, system.drag[0] * np.array([1.0, 2.0, 3.0]), rtol=1e-12)


def test_the_cell_at_the_closing_has_one_frame() -> None:
    """Glued at a right angle, what bends about d1 behind the start bends about -d2 behind the end; so does what resists."""
    section = dx.Stiffness(EI1=1.0, EI2=1.5, GJ=0.8, EA=50.0, mass=1.0)
    system = System(dx.Motion(dx.Ring(dx.Rod(1.0, section, natural=(3.0, 1.0, 2.0), stretch=True), link=0.25), 1.0), 8)
    np.testing.assert_allclose(system.kappa0[8], np.array([0.5 * (3 + 1), 0.5 * (1 - 3), 2]) / 8, atol=1e-15)
    EI = 2.0 / (1.0 + 1.0 / 1.5) * 8 / (system.scale.moment)
    np.testing.assert_allclose(system.B[8], [EI, EI, 0.8 * 8 / system.scale.moment, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(system.B[3, :2] * system.scale.moment / 8, [1.0, 1.5])
