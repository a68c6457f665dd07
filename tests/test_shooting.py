"""Shooting: the initial value problem against SciPy and the paper's printed equations, and the boundary value problem."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import darboux as dx
from darboux import frames
from darboux.paper.equations import PaperRod, integrate_as_printed
from tests import cases

S = np.linspace(0.0, 1.0, 41)


def random_rod(rng: np.random.Generator) -> tuple[PaperRod, dx.Rod, np.ndarray, np.ndarray, np.ndarray]:
    EI1, EI2, D = rng.uniform(0.5, 2.0, 3)
    rod = dx.Rod(1.0, dx.Stiffness(EI1=EI1, EI2=EI2, GJ=D, mass=1.0 / 9.81))
    k, n = rng.uniform(-3.0, 3.0, 3), rng.uniform(-2.0, 2.0, 3)
    return PaperRod(EI1, EI2, D, weight=1.0), rod, k, n, frames.matrix_of_quaternion(rng.normal(size=4))


@pytest.mark.parametrize("seed", range(8))
def test_the_printed_left_handed_equations_give_the_same_centreline(seed: int) -> None:
    """Eqs. (14) and (17) by SciPy's RK45 (ODE45), random anisotropic rods under gravity; 1e-9."""
    paper, rod, k, n, R = random_rod(np.random.default_rng(seed))
    ours = dx.integrate(rod, k=k, n=R @ n, frame=R, loads=[dx.Gravity()], rtol=1e-12)
    printed = integrate_as_printed(paper, 1.0, k, n, R, S, rtol=3e-13, method="RK45")
    assert np.max(np.linalg.norm(ours.r(S) - printed, axis=1)) < 1e-9


def test_the_printed_equations_read_right_handed_are_wrong() -> None:
    """What the map between the conventions is for: without it the difference is of order one."""
    paper, rod, k, n, R = random_rod(np.random.default_rng(0))
    ours = dx.integrate(rod, k=k, n=R @ n, frame=R, loads=[dx.Gravity()], rtol=1e-10)
    flip = np.array([1.0, -1.0, 1.0])
    misread = integrate_as_printed(paper, 1.0, k * flip, n * flip, R * flip, S, rtol=1e-10)
    assert np.max(np.linalg.norm(ours.r(S) - misread, axis=1)) > 0.1


@pytest.mark.parametrize("rtol", [1e-6, 1e-8, 1e-10])
def test_the_error_follows_the_tolerance(rtol: float) -> None:
    """Figure 6 has an exact solution, a helix: the error stays near the tolerance asked for."""
    from darboux.paper import cases as paper_cases

    curve = dx.integrate(paper_cases.figure6().rod, k=paper_cases.FIGURE6_K, rtol=rtol)
    s = np.linspace(0.0, 0.3, 97)  # between the outputs too
    error = np.max(np.linalg.norm(curve.r(s) - paper_cases.exact_helix6(s), axis=1)) / 0.3
    assert 0.01 * rtol < error < 20.0 * rtol


def test_invariants_of_unloaded_rods() -> None:
    """n, m + r x n, m . n; and m . d3 where the section is isotropic: constant to 1e-9 relative."""
    for EI2 in (1.0, 1.7):
        rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=EI2, GJ=0.7))
        curve = dx.integrate(rod, k=(3, -4, 5), n=(2, -3, 4), rtol=1e-12)
        r, n, m, d3 = curve.r(S), curve.n(S), curve.m(S), curve.R(S)[:, :, 2]
        kept = [n, m + np.cross(r, n), np.sum(m * n, axis=1, keepdims=True)]
        twist = np.sum(m * d3, axis=1, keepdims=True)
        for quantity in [*kept, twist] if EI2 == 1.0 else kept:
            drift = np.max(np.linalg.norm(quantity - quantity[0], axis=1)) / np.linalg.norm(quantity[0])
            assert drift < 1e-9
        if EI2 != 1.0:  # and it is a test: an anisotropic section does not keep it
            assert np.ptp(twist) > 0.1


def test_against_scipy_with_loads_of_every_kind() -> None:
    """The right-handed equations written once more, with rotation matrices, by solve_ivp(DOP853)."""
    rng = np.random.default_rng(5)
    k0 = rng.normal(size=3)
    section = dx.Stiffness(EI1=lambda s: 1.0 + 0.5 * s, EI2=1.5, GJ=0.8, EA=30.0, GA1=20.0, GA2=25.0, mass=0.7)
    rod = dx.Rod(1.0, section, natural=lambda s: np.outer(1.0 + np.sin(3.0 * s), k0), stretch=True, shear=True)
    loads = [
        dx.Gravity(), dx.Rotation((1.0, 2.0, 0.5), point=(0.1, 0.2, 0.3)), dx.LineForce((0.3, -0.2, 0.5), frame="section"),
        dx.LineCouple((0.1, 0.4, -0.3)), dx.LineCouple((0.2, -0.1, 0.1), frame="section"),
        dx.LineForce(lambda s: np.stack([np.cos(5 * s), s, s**2], axis=1)),
    ]  # fmt: skip
    problem = dx.Equilibrium(rod, loads=loads)
    k, n = np.array([1.0, -1.5, 0.8]), np.array([0.5, 1.0, -0.7])

    def rate(s: float, y: np.ndarray) -> np.ndarray:
        x = np.array([s])
        r, R, n, m = y[:3], y[3:12].reshape(3, 3), y[12:15], y[15:]
        C = rod.compliance(x)[0]
        bend = rod.k0(x)[0] + C[3:, 3:] @ R.T @ m
        dr = R @ (np.array([0, 0, 1.0]) + C[:3, :3] @ R.T @ n)
        cross = np.array([[0, -bend[2], bend[1]], [bend[2], 0, -bend[0]], [-bend[1], bend[0], 0]])
        load = problem.distributed(x)
        force, couple = load.force(r[None], R[None])[0], load.couple(R[None])[0]
        return np.concatenate([dr, (R @ cross).ravel(), -force, -np.cross(dr, n) - couple])

    m0 = np.linalg.inv(rod.compliance(np.zeros(1))[0, 3:, 3:]) @ (k - rod.k0(np.zeros(1))[0])
    start = np.concatenate([np.zeros(3), np.eye(3).ravel(), n, m0])
    reference = solve_ivp(rate, (0, 1), start, method="DOP853", rtol=1e-12, atol=1e-13, t_eval=S).y
    ours = dx.integrate(rod, k=k, n=n, loads=loads, rtol=1e-12)
    np.testing.assert_allclose(ours.r(S), reference[:3].T, atol=1e-10)
    np.testing.assert_allclose(ours.m(S), reference[15:].T, atol=1e-10)
    np.testing.assert_allclose(ours.k(0.0), k, atol=1e-12)


def test_initial_and_boundary_value_problem_have_the_same_solution() -> None:
    rng = np.random.default_rng(3)
    _, rod, k, n, R = random_rod(rng)
    curve = dx.integrate(rod, k=0.5 * k, n=0.5 * n, frame=R, loads=[dx.Gravity()], rtol=1e-11)
    solution = dx.solve(curve.problem)  # the clamped rod that carries the curve's end force and moment
    assert np.max(np.abs(solution.r(S) - curve.r(S))) < 1e-9
    assert np.max(np.abs(solution.m(S) - curve.m(S))) < 1e-9


@pytest.mark.parametrize("w", [1e3, 1e4, 1e5])
def test_heavy_rods_keep_their_branch(w: float) -> None:
    """Far beyond figure 5: against Elastica, which shares no code. Forward shooting fails from 100 on."""
    problem = cases.heavy(w)
    gap = np.linalg.norm(dx.solve(problem).tip - dx.solve(problem, dx.Elastica()).tip)
    assert gap < 1e-9


def test_loads_that_jump() -> None:
    """A uniform load on half of the rod: the mesh encloses the jump, and the balance holds on both sides of it."""
    problem = dx.Equilibrium(
        cases.UNIT, start=cases.ALONG_X, loads=[dx.LineForce(lambda s: np.outer(s < 0.37, (0, -30.0, 0)))]
    )
    solution = dx.solve(problem)
    np.testing.assert_allclose(
        solution.n(np.array([0.0, 0.37, 0.5])), [(0, -30.0 * 0.37, 0), (0, 0, 0), (0, 0, 0)], atol=1e-9
    )
    assert np.ptp(solution.k(np.linspace(0.4, 1.0, 50))) < 1e-9  # straight beyond it
    from_table = dx.LineForce(
        dx.Table([0, 0.37, 0.37 + 1e-12, 1.0], [(0, -30.0, 0), (0, -30.0, 0), (0, 0, 0), (0, 0, 0)], "linear")
    )
    same = dx.solve(dx.Equilibrium(cases.UNIT, start=cases.ALONG_X, loads=[from_table]))
    assert np.linalg.norm(same.tip - solution.tip) < 1e-9


def test_the_estimated_error_covers_the_true_one() -> None:
    for case in cases.ALL:
        for rtol in (1e-7, 1e-9):
            solution = dx.solve(case.problem, dx.Shooting(rtol=rtol))
            L = case.problem.rod.length
            true = np.linalg.norm(solution.tip - case.tip) / L
            assert true < solution.error.tip / L + 1e-12 + case.digits, case.id


def test_buckling_on_the_way_is_said() -> None:
    """Euler: 2.4674 EI / L^2. The straight column stays an equilibrium; the status says that its stability changed."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.3, GJ=0.75))
    before, after = (dx.solve(dx.Equilibrium(rod, loads=[dx.EndForce((0, 0, -P))]), dx.Shooting()) for P in (2.4, 2.6))
    assert before.statistics["crossings"] == ()
    ((low, high),) = after.statistics["crossings"]
    assert low < 2.4674 / 2.6 < high
    assert "stability changes" in after.status.message


def test_branch_following_reaches_the_hanging_equilibrium() -> None:
    """Figure 5 has at least seven planar equilibria; the one that follows from the unloaded rod hangs down."""
    solution = dx.solve(cases.heavy(613.125))
    angle = np.arctan2(-solution.R(1.0)[1, 2], solution.R(1.0)[0, 2])
    assert angle == pytest.approx(1.57079591051528583, abs=1e-9)  # case S05
    assert solution.energy.load < -600.0 * 0.45


def test_a_rod_with_a_natural_shape_and_no_load_keeps_it() -> None:
    helix = dx.Helix(0.02, 0.03)
    rod = dx.Rod(0.5, dx.Stiffness(EI1=1.0, EI2=2.0, GJ=0.7), natural=helix)
    solution = dx.solve(dx.Equilibrium(rod))
    curve = dx.integrate(rod, k=helix.curvature, rtol=1e-12)
    np.testing.assert_allclose(solution.r(solution.s), curve.r(solution.s), rtol=0, atol=1e-10)
    assert solution.energy.total == pytest.approx(0.0, abs=1e-15)
