"""The integrator against closed forms, invariants, symmetries, SciPy, and differences of itself."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from darboux.kernels.dormand_prince import integrate, integrate_mesh, integrate_sensitivity
from darboux.kernels.rod_equations import (
    BINV,
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
)

OK, TOO_MANY_STEPS, STEP_TOO_SMALL, NOT_FINITE = range(4)
UNIT = np.array([0.0, 1.0])
LARGE = 10_000


def run(y0, table, outputs=UNIT, breaks=UNIT, rtol=1e-10, atol=1e-12, max_steps=LARGE):
    """The states at the outputs, and the report."""
    table = np.asarray(table, dtype=float).reshape(len(breaks) - 1, -1, WIDTH)
    result = np.full((len(outputs), STATES), np.nan)
    degree = table.shape[1] - 1
    tolerances = float(rtol), float(atol)
    report = integrate(y0, outputs, breaks, table.ravel(), degree, *tolerances, max_steps, result.ravel())
    return result, report


def sensitivity(y0, table, breaks=UNIT, rtol=1e-10, atol=1e-12):
    """The end, dy(s1)/dy0, and the report."""
    table = np.asarray(table, dtype=float).reshape(len(breaks) - 1, -1, WIDTH)
    y1, phi = np.empty(STATES), np.empty((STATES, STATES))
    degree = table.shape[1] - 1
    span = breaks[0], breaks[-1]
    report = integrate_sensitivity(y0, *span, breaks, table.ravel(), degree, rtol, atol, LARGE, y1, phi.ravel())
    return y1, phi, report


def hat(a):
    """[a x]."""
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def rotation(q):
    """R(q) / |q|^2."""
    return np.eye(3) + 2 * (q[0] * hat(q[1:]) + hat(q[1:]) @ hat(q[1:])) / (q @ q)


def packed(a):
    """A symmetric positive matrix, from any, as 11, 22, 33, 23, 13, 12."""
    x = np.eye(3) + 0.1 * (a + a.T)
    return np.array([x[0, 0], x[1, 1], x[2, 2], x[1, 2], x[0, 2], x[0, 1]])


def general(seed, loads=1.0):
    """A start and coefficients of an anisotropic, coupled, naturally curved and shearable rod under every load."""
    rng = np.random.default_rng(seed)
    c = rng.normal(size=WIDTH)
    c[BINV : BINV + 6], c[SINV : SINV + 6] = packed(rng.normal(size=(3, 3))), 0.1 * packed(rng.normal(size=(3, 3)))
    c[DEAD_FORCE:] *= loads
    y0 = rng.normal(size=STATES)
    y0[3:7] /= np.linalg.norm(y0[3:7])
    return y0, c


def straight():
    """An isotropic straight rod along e3, and its start at the origin."""
    y0, c = np.zeros(STATES), np.zeros(WIDTH)
    y0[3] = 1
    c[BINV : BINV + 3] = 1
    return y0, c


# ------------------------------------------------------------------------------------------- closed forms


@pytest.mark.parametrize("rtol", [1e-6, 1e-9, 1e-12])
def test_unloaded_rod_of_constant_curvature_is_a_helix(rtol):
    """R(s) = exp(s [k0 x]), r(s) = int R e3; N = [k x]: s + (1 - cos ks) N/k^2 + (ks - sin ks) N^2/k^3."""
    y0, c = straight()
    k0 = np.array([-25, 10, -25]) * 0.3
    c[K0 : K0 + 3] = k0
    s = np.linspace(0, 1, 33)
    y, (status, *_) = run(y0, c, s, rtol=rtol, atol=rtol)
    k, N = np.linalg.norm(k0), hat(k0)
    assert status == OK
    for si, yi in zip(s, y, strict=True):
        integral = si * np.eye(3) + (1 - np.cos(k * si)) * N / k**2 + (k * si - np.sin(k * si)) * N @ N / k**3
        np.testing.assert_allclose(rotation(yi[3:7]), expm(si * N), rtol=0, atol=50 * rtol)
        np.testing.assert_allclose(yi[:3], integral[:, 2], rtol=0, atol=50 * rtol)
    np.testing.assert_array_equal(y[:, 7:], 0)


def test_straight_unloaded_rod_stays_straight():
    y0, c = straight()
    y, (status, *_) = run(y0, c)
    assert status == OK
    np.testing.assert_allclose(y[1], y0 + np.eye(STATES)[2], rtol=0, atol=1e-15)


# ----------------------------------------------------------------------------------------- another code


@pytest.mark.parametrize("seed", range(4))
def test_agrees_with_scipy(seed):
    y0, c = general(seed)
    dy = np.empty(STATES)

    def right_hand_side(s, y):
        derivative(y, c, dy)
        return dy.copy()

    s = np.linspace(0, 1, 21)
    expected = solve_ivp(right_hand_side, (0, 1), y0, method="DOP853", t_eval=s, rtol=1e-13, atol=1e-13).y.T
    y, (status, *_) = run(y0, c, s, rtol=1e-11, atol=1e-11)
    assert status == OK
    np.testing.assert_allclose(y, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


# --------------------------------------------------------------------------------------------- order


def order(errors, steps):
    """The slope of log error against log step."""
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


def one_step(h, part):
    """The error, from one single step h, at the fraction `part` of it."""
    y0, c = general(4)
    s = np.array([0, part * h, h])
    y, (_, steps, *_) = run(y0, c, s, rtol=1e6, atol=1e6)
    exact, _ = run(y0, c, s, rtol=1e-13, atol=1e-13)
    assert steps == 1
    return np.linalg.norm(y[1] - exact[1])


@pytest.mark.parametrize(("part", "expected"), [(1.0, 6), (0.4, 5)])
def test_one_step_has_the_declared_order(part, expected):
    """The local error of order p + 1: the step is of order 5, its continuous extension of order 4."""
    h = np.array([0.1, 0.05, 0.025])
    measured = order([one_step(x, part) for x in h], h)
    assert measured == pytest.approx(expected, abs=0.3), f"local order {measured:.2f}, declared {expected}"


def test_error_and_steps_follow_the_tolerance():
    y0, c = general(1)
    exact, _ = run(y0, c, rtol=1e-13, atol=1e-13)
    tolerances = 10.0 ** -np.arange(8, 13)
    runs = [run(y0, c, rtol=t, atol=t) for t in tolerances]
    errors = [np.linalg.norm(y[1] - exact[1]) for y, _ in runs]
    steps = [report[1] for _, report in runs]
    assert order(errors, tolerances) == pytest.approx(1, abs=0.1)
    measured = -order(errors, steps)
    assert measured == pytest.approx(5, abs=0.5), f"error of order {measured:.2f} in the number of steps, declared 5"


def test_outputs_do_not_change_the_steps():
    y0, c = general(2)
    few, report = run(y0, c)
    many, report_of_many = run(y0, c, np.linspace(0, 1, 101))
    assert report == report_of_many
    np.testing.assert_allclose(many[-1], few[-1], rtol=0, atol=1e-14 * np.abs(few).max())


def test_outputs_may_repeat_and_lie_at_the_start():
    y0, c = general(2)
    y, _ = run(y0, c, np.array([0, 0, 0.3, 0.3, 1, 1]))
    np.testing.assert_array_equal(y[0], y0)
    np.testing.assert_array_equal(y[::2], y[1::2])


def test_single_output_is_the_start():
    y0, c = general(2)
    y, (status, steps, *_) = run(y0, c, np.array([1.0]))
    assert (status, steps) == (OK, 0)
    np.testing.assert_array_equal(y[0], y0)


# ------------------------------------------------------------------------------------------- coefficients


def varying(seed):
    """A quadratic on [0, 0.3], another, not continuing it, on [0.3, 1]."""
    y0, c = general(seed)
    _, other = general(seed + 100)
    changes = 0.3 * np.random.default_rng(seed).normal(size=(4, WIDTH))
    return y0, np.array([[c, changes[0], changes[1]], [other, changes[2], changes[3]]]), np.array([0, 0.3, 1])


def test_varying_coefficients_agree_with_scipy():
    y0, table, breaks = varying(0)
    dy, y = np.empty(STATES), y0
    for p in range(2):

        def right_hand_side(s, y, p=p):
            x = s - breaks[p]
            derivative(y, table[p, 0] + x * (table[p, 1] + x * table[p, 2]), dy)
            return dy.copy()

        y = solve_ivp(right_hand_side, breaks[p : p + 2], y, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    result, (status, *_) = run(y0, table, breaks[[0, -1]], breaks, rtol=1e-11, atol=1e-11)
    assert status == OK
    np.testing.assert_allclose(result[1], y, rtol=0, atol=1e-8 * np.abs(y).max())


def test_jump_is_two_integrations_joined():
    y0, table, breaks = varying(1)
    whole, (status, *_) = run(y0, table, breaks, breaks)
    first, _ = run(y0, table, breaks[:2], breaks)
    second, _ = run(first[1], table, breaks[1:], breaks)
    assert status == OK
    np.testing.assert_array_equal(whole[1], first[1])
    np.testing.assert_allclose(whole[2], second[1], rtol=0, atol=1e-8 * np.abs(whole).max())


def test_breaks_without_a_jump_change_nothing_but_the_steps():
    y0, c = general(4)
    one, _ = run(y0, c)
    breaks = np.linspace(0, 1, 8)
    many, (status, *_) = run(y0, np.tile(c, 7), UNIT, breaks)
    assert status == OK
    np.testing.assert_allclose(many[1], one[1], rtol=0, atol=1e-8 * np.abs(one).max())


# ------------------------------------------------------------------------------- invariants and symmetries


def test_invariants_of_an_unloaded_rod():
    """n, m + r x n and m . n are constant; so is |q| to the tolerance."""
    y0, c = general(5, loads=0)
    y, _ = run(y0, c, np.linspace(0, 1, 11), rtol=1e-12, atol=1e-12)
    r, q, n, m = y[:, :3], y[:, 3:7], y[:, 7:10], y[:, 10:]
    np.testing.assert_array_equal(n, np.broadcast_to(n[0], n.shape))
    torque = m + np.cross(r, n)
    np.testing.assert_allclose(torque, np.broadcast_to(torque[0], m.shape), rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.sum(m * n, axis=1), m[0] @ n[0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1, rtol=0, atol=1e-10)


def test_isotropic_rod_keeps_its_twisting_moment():
    y0, c = straight()
    y0[7:] = 3, -2, 5, 1, 4, 2
    c[BINV + 2] = 1.5
    c[DEAD_FORCE + 2] = -4
    y, _ = run(y0, c, np.linspace(0, 1, 11), rtol=1e-10, atol=1e-12)
    twisting = [rotation(yi[3:7])[:, 2] @ yi[10:] for yi in y]
    np.testing.assert_allclose(twisting, twisting[0], rtol=0, atol=1e-8)


def test_length_of_the_quaternion_does_not_matter():
    y0, c = general(6)
    s = np.linspace(0, 1, 5)
    y, report = run(y0, c, s)
    y0[3:7] *= 8
    scaled, report_of_scaled = run(y0, c, s)
    scaled[:, 3:7] /= 8
    assert report == report_of_scaled
    np.testing.assert_array_equal(scaled, y)


def test_rotating_the_problem_rotates_the_answer():
    y0, c = general(7)
    p = np.random.default_rng(0).normal(size=4)
    p /= np.linalg.norm(p)
    Q = rotation(p)
    left = np.eye(4) * p[0]
    left[0, 1:], left[1:, 0], left[1:, 1:] = -p[1:], p[1:], left[1:, 1:] + hat(p[1:])
    T = np.zeros((STATES, STATES))
    T[:3, :3], T[3:7, 3:7], T[7:10, 7:10], T[10:, 10:] = Q, left, Q, Q
    turned = c.copy()
    for i in (DEAD_FORCE, DEAD_MOMENT):
        turned[i : i + 3] = Q @ c[i : i + 3]
    C = c[FORCE_GRADIENT : FORCE_GRADIENT + 9].reshape(3, 3)
    turned[FORCE_GRADIENT : FORCE_GRADIENT + 9] = (Q @ C @ Q.T).ravel()
    y, report = run(y0, c)
    z, report_of_turned = run(T @ y0, turned)
    assert report == report_of_turned, "the steps depend on the axes"
    np.testing.assert_allclose(z[1], T @ y[1], rtol=0, atol=1e-12 * np.abs(y).max())


# --------------------------------------------------------------------------------------------- the mesh


def test_mesh_holds_every_step_with_its_slope():
    y0, table, breaks = varying(2)
    nodes, states, slopes = np.empty(500), np.empty((500, STATES)), np.empty((500, STATES))
    span = breaks[0], breaks[-1]
    storage = nodes, states.ravel(), slopes.ravel()
    status, count, *_ = integrate_mesh(y0, *span, breaks, table.ravel(), 2, 1e-9, 1e-11, *storage)
    assert status == OK
    assert np.all(np.diff(nodes[:count]) > 0)
    assert set(breaks) <= set(nodes[:count])
    expected, (_, steps, *_) = run(y0, table, nodes[:count], breaks, rtol=1e-9, atol=1e-11)
    assert steps == count - 1
    np.testing.assert_allclose(states[:count], expected, rtol=0, atol=1e-13 * np.abs(expected).max())
    dy = np.empty(STATES)
    for s, y, slope in zip(nodes[:count], states, slopes, strict=False):
        p = min(np.searchsorted(breaks, s, side="right") - 1, 1)
        x = s - breaks[p]
        derivative(y, table[p, 0] + x * (table[p, 1] + x * table[p, 2]), dy)
        np.testing.assert_allclose(slope, dy, rtol=0, atol=1e-12 * np.abs(dy).max())


def test_mesh_stops_when_full():
    y0, c = general(0)
    nodes, states, slopes = np.empty(4), np.empty(4 * STATES), np.empty(4 * STATES)
    status, count, *_ = integrate_mesh(y0, 0.0, 1.0, UNIT, c, 0, 1e-9, 1e-11, nodes, states, slopes)
    assert (status, count) == (TOO_MANY_STEPS, 4)
    assert nodes[-1] < 1


# ------------------------------------------------------------------------------------------ sensitivities


@pytest.mark.parametrize("seed", range(3))
def test_sensitivity_is_the_difference_quotient(seed):
    y0, table, breaks = varying(seed)
    y1, phi, (status, steps, *_) = sensitivity(y0, table, breaks)
    y, (_, steps_without, *_) = run(y0, table, breaks[[0, -1]], breaks)
    assert (status, steps) == (OK, steps_without)
    np.testing.assert_allclose(y1, y[1], rtol=0, atol=1e-13 * np.abs(y1).max())
    h = 1e-5
    for j in range(STATES):
        ahead, behind = y0.copy(), y0.copy()
        ahead[j] += h
        behind[j] -= h
        ends = [run(x, table, breaks[[0, -1]], breaks, 1e-12, 1e-12)[0][1] for x in (ahead, behind)]
        np.testing.assert_allclose(phi[:, j], (ends[0] - ends[1]) / (2 * h), rtol=0, atol=1e-7 * np.abs(phi).max())


def test_sensitivity_passes_the_taylor_test():
    y0, c = general(8)
    y1, phi, _ = sensitivity(y0, c, rtol=1e-12, atol=1e-12)
    direction = np.random.default_rng(0).normal(size=STATES)
    h = np.array([2e-3, 1e-3, 5e-4])
    ends = [run(y0 + x * direction, c, rtol=1e-12, atol=1e-12)[0][1] for x in h]
    rests = [np.linalg.norm(end - y1 - x * phi @ direction) for x, end in zip(h, ends, strict=True)]
    measured = order(rests, h)
    assert measured == pytest.approx(2, abs=0.1), f"remainder of order {measured:.3f}, expected 2"


def test_sensitivity_differentiates_the_discrete_map():
    """A single coarse step, whose error is large: its own derivative, not that of the exact flow."""
    y0, c = general(9)
    loose = {"breaks": np.array([0, 0.3]), "rtol": 1e6, "atol": 1e6}
    _, phi, (_, steps, *_) = sensitivity(y0, c, **loose)
    assert steps == 1
    direction, h = np.random.default_rng(0).normal(size=STATES), 1e-5
    ahead, behind = (run(y0 + sign * h * direction, c, loose["breaks"], **loose)[0][1] for sign in (1, -1))
    np.testing.assert_allclose(phi @ direction, (ahead - behind) / (2 * h), rtol=0, atol=1e-8 * np.abs(phi).max())


def test_sensitivity_over_no_length_is_the_identity():
    y0, c = general(0)
    y1, phi = np.empty(STATES), np.empty((STATES, STATES))
    status, *_ = integrate_sensitivity(y0, 0.5, 0.5, UNIT, c, 0, 1e-8, 1e-10, LARGE, y1, phi.ravel())
    assert status == OK
    np.testing.assert_array_equal(y1, y0)
    np.testing.assert_array_equal(phi, np.eye(STATES))


# ------------------------------------------------------------------------------------------------ statuses


def test_too_many_steps():
    y0, c = general(0)
    y, (status, steps, *_) = run(y0, c, np.linspace(0, 1, 11), max_steps=3)
    assert (status, steps) == (TOO_MANY_STEPS, 3)
    assert np.all(np.isfinite(y[0])), "what came before the failure is kept"
    assert np.all(np.isnan(y[-1])), "what was not reached is left alone"


def test_exactly_enough_steps():
    y0, c = general(0)
    _, (_, steps, *_) = run(y0, c)
    _, (status, *_) = run(y0, c, max_steps=steps)
    assert status == OK


def test_tolerance_that_cannot_be_met():
    y0, c = general(0)
    _, (status, *_) = run(y0, c, rtol=1e-60, atol=0)
    assert status == STEP_TOO_SMALL


def test_zero_tolerance_ends():
    y0, c = general(0)
    _, (status, *_) = run(y0, c, rtol=0, atol=0)
    assert status == STEP_TOO_SMALL


@pytest.mark.parametrize("where", [0, 3, 8, 12])
def test_start_that_is_not_a_number(where):
    y0, c = general(0)
    y0[where] = np.nan
    _, (status, steps, *_) = run(y0, c)
    assert (status, steps) == (NOT_FINITE, 0)


def test_quaternion_of_zero_has_no_direction():
    y0, c = general(0)
    y0[3:7] = 0
    _, (status, *_) = run(y0, c)
    assert status == NOT_FINITE


def test_blow_up_ends():
    """The ends of a rod that cannot bend, r'' = 1e8 r, run away beyond every number before s = 1."""
    y0, c = straight()
    c[BINV : BINV + 3] = 0
    c[SINV : SINV + 3] = 1
    c[FORCE_GRADIENT : FORCE_GRADIENT + 9] = -1e8 * np.eye(3).ravel()
    y, (status, *_) = run(y0, c, np.linspace(0, 1, 5), rtol=1e-3, atol=1e-3, max_steps=10**6)
    assert status == NOT_FINITE
    assert np.all(np.isnan(y[-1]))


def test_follower_loads_matter():
    """A load in the section's frame bends the rod otherwise than the same load in the fixed one."""
    y0, c = general(1, loads=0)
    dead, follower = c.copy(), c.copy()
    dead[DEAD_FORCE], follower[FOLLOWER_FORCE] = 1, 1
    dead[DEAD_MOMENT], follower[FOLLOWER_MOMENT] = 1, 1
    assert np.linalg.norm(run(y0, dead)[0][1] - run(y0, follower)[0][1]) > 0.1
