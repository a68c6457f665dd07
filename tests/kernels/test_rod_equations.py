"""The static rod equations against their formulas written with matrices, and their Jacobian against differences."""

import numpy as np
import pytest

from darboux.kernels.rod_equations import (
    BINV,
    COUPLED_WIDTH,
    COUPLING,
    DEAD_FORCE,
    DEAD_MOMENT,
    FOLLOWER_FORCE,
    FOLLOWER_MOMENT,
    FORCE_GRADIENT,
    K0,
    SINV,
    STATES,
    WIDTH,
    derivative,
    jacobian,
)


def symmetric(x):
    """The matrix stored as 11, 22, 33, 23, 13, 12."""
    return np.array([[x[0], x[5], x[4]], [x[5], x[1], x[3]], [x[4], x[3], x[2]]])


def rotation(q):
    """R(q) / |q|^2 = I + 2 (w [u x] + [u x]^2) / |q|^2."""
    w, u = q[0], q[1:]
    hat = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
    return np.eye(3) + 2 * (w * hat + hat @ hat) / (q @ q)


def product(p, q):
    """The product of two quaternions."""
    return np.concatenate(
        ([p[0] * q[0] - p[1:] @ q[1:]], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])),
    )


def reference(y, c):
    """The equations as they stand in the module, with matrices; also for complex arguments."""
    r, q, n, m = np.split(y, [3, 7, 10])
    R = rotation(q)
    D = c[COUPLING:].reshape(3, 3) if c.size > WIDTH else np.zeros((3, 3))
    k = c[K0 : K0 + 3] + symmetric(c[BINV:]) @ R.T @ m + D @ R.T @ n
    v = np.array([0, 0, 1]) + symmetric(c[SINV:]) @ R.T @ n + D.T @ R.T @ m
    C = c[FORCE_GRADIENT : FORCE_GRADIENT + 9].reshape(3, 3)
    f = c[DEAD_FORCE : DEAD_FORCE + 3] + C @ r + R @ c[FOLLOWER_FORCE : FOLLOWER_FORCE + 3]
    couple = c[DEAD_MOMENT : DEAD_MOMENT + 3] + R @ c[FOLLOWER_MOMENT : FOLLOWER_MOMENT + 3]
    dr = R @ v
    return np.concatenate((dr, product(q, np.concatenate(([0], k))) / 2, -f, -np.cross(dr, n) - couple))


@pytest.fixture(params=[(seed, width) for width in (WIDTH, COUPLED_WIDTH) for seed in range(6)])
def case(request):
    """A state, with |q| far from one, and coefficients, none of them zero, of an uncoupled and of a coupled section."""
    seed, width = request.param
    rng = np.random.default_rng(seed)
    return rng.normal(size=STATES), rng.normal(size=width)


def test_derivative_is_the_formula(case):
    y, c = case
    dy = np.empty(STATES)
    derivative(y, c, dy)
    np.testing.assert_allclose(dy, reference(y, c), rtol=0, atol=2e-14 * np.abs(dy).max())


def test_jacobian_is_the_complex_step_of_the_formula(case):
    y, c = case
    J = np.full(STATES * STATES, np.nan)
    jacobian(y, c, J)
    expected = np.empty((STATES, STATES))
    for j in range(STATES):
        step = y.astype(complex)
        step[j] += 1e-30j
        expected[:, j] = reference(step, c).imag / 1e-30
    np.testing.assert_allclose(J.reshape(STATES, STATES), expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def test_jacobian_passes_the_taylor_test(case):
    y, c = case
    J, at, moved = np.empty(STATES * STATES), np.empty(STATES), np.empty(STATES)
    jacobian(y, c, J)
    derivative(y, c, at)
    direction = np.random.default_rng(7).normal(size=STATES)
    rests = []
    for h in (1e-3, 5e-4):
        derivative(y + h * direction, c, moved)
        rests.append(np.linalg.norm(moved - at - h * J.reshape(STATES, STATES) @ direction))
    order = np.log2(rests[0] / rests[1])
    assert order == pytest.approx(2, abs=0.1), f"remainder of order {order:.3f}, expected 2"


def test_length_of_the_quaternion_does_not_matter(case):
    y, c = case
    scaled = y.copy()
    scaled[3:7] *= 4
    dy, dscaled = np.empty(STATES), np.empty(STATES)
    derivative(y, c, dy)
    derivative(scaled, c, dscaled)
    dy[3:7] *= 4
    np.testing.assert_array_equal(dscaled, dy)


def test_straight_unloaded_rod_only_moves_along_its_tangent():
    y, dy = np.zeros(STATES), np.full(STATES, np.nan)
    y[3] = 1
    derivative(y, np.zeros(WIDTH), dy)
    np.testing.assert_array_equal(dy, np.eye(STATES)[2])
