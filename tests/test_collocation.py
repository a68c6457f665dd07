"""Collocation: order, invariants, derivatives, symmetries, supports, and what it says where there is no answer."""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any

import numpy as np
import pytest

import darboux as dx
from darboux import frames
from darboux.kernels.singular_values import solve_by_singular_values
from darboux.packing.ends import EndConditions, moved
from darboux.packing.scale import Scale
from darboux.statics.collocation_equations import Equations
from tests import cases

UNIT = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7, mass=1.0))
FLAT = dx.Rod(1.0, dx.Stiffness(EI1=1.4, EI2=1.0, GJ=0.7, mass=1.0))
UP = (0.0, 0.0, 1.0)


@pytest.mark.parametrize("stages", [2, 3, 4, 5])
def test_order_is_twice_the_stages(stages: int) -> None:
    """On equal elements, against a fine solution; coarse enough that rounding does not show."""
    problem = cases.anisotropic((6.0, -4.0, -3.0), (0.4, 0.6, 0.9))
    exact = dx.solve(problem, dx.Collocation(rtol=1e-13)).tip
    counts = {2: (16, 32), 3: (8, 16), 4: (6, 12), 5: (3, 6)}[stages]
    method = dx.Collocation(stages=stages)
    errors = []
    for elements in counts:  # the answer is on twice the elements
        tip = dx.solve(problem, dataclasses.replace(method, elements=elements)).tip
        errors.append(np.linalg.norm(tip - exact))
    order = np.log2(errors[0] / errors[1])
    assert order == pytest.approx(method.order, abs=0.7), f"order {order:.2f}, declared {method.order}; errors {errors}"


def test_invariants_of_an_unloaded_rod() -> None:
    """N, m + r x n, m . n, |q| and, in a round rod, m . d3, to rounding on any mesh."""
    problem = dx.Equilibrium(UNIT, loads=[dx.EndForce((5, 2, -4)), dx.EndMoment((0.5, 1.0, 2.0))])
    for elements in (12, None):
        solution = dx.solve(problem, dx.Collocation(elements=elements))
        y = solution.curve.y
        n, m = y[:, 7:10], y[:, 10:13]
        moment = m + np.cross(y[:, :3], n)
        d3 = frames.matrix_of_quaternion(y[:, 3:7])[:, :, 2]
        for constant in (n, moment, np.sum(m * n, axis=1), np.linalg.norm(y[:, 3:7], axis=1), np.sum(m * d3, axis=1)):
            drift = np.max(np.abs(constant - constant[0])) / np.max(np.abs(constant))
            assert drift < 1e-12


def everything() -> dx.Equilibrium:
    """All kinds of loads at once, on a rod that stretches, shears and varies."""
    section = dx.Stiffness(EI1=lambda s: 2.0 - s, EI2=1.3, GJ=0.8, EA=80.0, GA1=60.0, GA2=50.0, mass=1.0)
    rod = dx.Rod(1.0, section, natural=(0.5, 1.0, -0.7), stretch=True, shear=True)
    loads = [
        dx.Gravity((1, 2, -3)),
        dx.Rotation((0.4, 0.2, 1.0), (0.3, 0, 0)),
        dx.LineForce((0.5, -0.3, 1), frame="section"),
        dx.LineCouple((0.2, 0.1, 0.3)),
        dx.LineCouple((0.1, -0.2, 0.2), frame="section"),
        dx.LineForce(lambda s, r, R: -2.0 * r + R[:, :, 0] * s[:, None]),
        dx.LineCouple(lambda s, r, R: 0.3 * np.cross(R[:, :, 2], r)),
        dx.Foundation(3.0),
        dx.PointForce((0.4, 0.2, -0.1), at=0.3),
        dx.PointForce((0.3, -0.2, 0.4), at=0.3, follower=True),
        dx.PointMoment((0.1, 0.2, 0.3), at=0.6),
        dx.PointMoment((-0.2, 0.1, 0.3), at=0.6, follower=True),
        dx.EndForce((0.5, 0.1, -0.6), follower=True),
        dx.EndMoment((0.3, 0.1, 0.2), follower=True),
    ]
    return dx.Equilibrium(rod, loads=loads)


QUADRATIC = 10.0  # times the square of a step is the largest that may follow it: measured 0.3
SETTLED = 1e-12  # below it steps are rounding


def newtons_steps(part: float = 1.0) -> list[float]:
    """The sizes of Newton's steps to half the loads of everything, of which only a part is taken."""
    equations = Equations(everything(), stages=4)
    mesh, sizes = equations.unloaded(), []
    for _ in range(7):
        step = equations.newton_step(mesh, 0.5)
        sizes.append(step.length)
        mesh = equations.moved(mesh, 0.5, part * step.delta)
    return sizes


def are_quadratic(sizes: list[float]) -> bool:
    """Whether every step from the first small one on is bounded by the square of the one before."""
    late = [size for size in sizes if size < 0.1]
    return all(b < QUADRATIC * a**2 + SETTLED for a, b in itertools.pairwise(late)) and sizes[-1] < SETTLED


def test_newtons_method_is_quadratic_with_every_load() -> None:
    """Each step is bounded by the square of the one before, which holds for an exact Jacobian only."""
    sizes = newtons_steps()
    assert are_quadratic(sizes), sizes


@pytest.mark.parametrize("part", [0.95, 0.999, 1.05])
def test_a_jacobian_that_is_a_little_off_is_not_quadratic(part: float) -> None:
    """A Jacobian over `part` gives this part of Newton's step."""
    sizes = newtons_steps(part)
    assert not are_quadratic(sizes), sizes


def test_the_tangent_is_the_derivative_by_the_load() -> None:
    """Also where support displacements and turns, and the lent compliance, grow with the load."""
    posed = dx.Equilibrium(
        FLAT, end=dx.Clamped(position=(0.2, 0.1, 0.6), tangent=(1, 0, 1), twist=2.0), loads=[dx.Gravity((1, 0, 0))]
    )
    for problem in (everything(), posed):
        equations = Equations(problem, stages=4)
        mesh = equations.unloaded()
        for i in range(10):
            step = equations.newton_step(mesh, 0.03 * i)
            mesh = equations.moved(mesh, 0.03 * i, 0.03 * step.tangent, 0.03)
            mesh = equations.newton(mesh, 0.03 * (i + 1), 1e-12, most=20)[0]
        h = 1e-4
        ahead, behind = (equations.newton(mesh, 0.3 + sign * h, 1e-12, most=20)[0] for sign in (1.0, -1.0))
        tangent = equations.newton_step(mesh, 0.3).tangent
        slope = (ahead.y - behind.y) / (2.0 * h)
        np.testing.assert_allclose(tangent[:, :3], slope[:, :3], atol=2e-6 * np.max(np.abs(slope)))
        np.testing.assert_allclose(tangent[:, 6:], slope[:, 7:], atol=2e-6 * np.max(np.abs(slope)))


SUPPORTS: dict[str, dx.Clamped | Any] = {
    "clamped": dx.Clamped(position=(0.1, 0.2, 0.9), tangent=(0.1, 0.2, 1), twist=0.5),
    "pinned": dx.Pinned(position=(0.1, 0.2, 0.9)),
    **cases.ENDS,
}


@pytest.mark.parametrize("name", SUPPORTS)
def test_rows_of_the_end_conditions_are_their_derivatives(name: str) -> None:
    loads = (
        []
        if name == "clamped"
        else [dx.EndForce((1, 2, 3), follower=True), dx.EndMoment((0.3, 0.2, 0.1), follower=True)]
    )
    problem = dx.Equilibrium(UNIT, end=SUPPORTS[name], loads=loads)
    conditions = EndConditions(problem.end, problem.end_load("end"), 1.0, Scale.of(problem))
    rng = np.random.default_rng(1)
    y = np.concatenate([(0.1, 0.0, 0.9), [1.0, 0, 0, 0], rng.normal(size=6)])
    y = moved(y, 0.3 * rng.normal(size=12))
    system = conditions.system(y, 0.8)
    rows, values = system[:, :12], -system[:, 12]
    for k in range(12):
        step = 1e-6 * np.eye(12)[k]
        slope = (conditions.values(moved(y, step), 0.8) - conditions.values(moved(y, -step), 0.8)) / 2e-6
        np.testing.assert_allclose(rows[:, k], slope, atol=2e-8, err_msg=f"{name}, unknown {k}")
    assert np.linalg.matrix_rank(rows) == 6
    np.testing.assert_array_equal(values, conditions.values(y, 0.8))


@pytest.mark.parametrize("name", [name for name in SUPPORTS if name != "free"])
def test_a_support_does_what_it_says(name: str) -> None:
    """What is held has its place; what is free carries no force: read from the solution, in three dimensions."""
    support = SUPPORTS[name]
    problem = dx.Equilibrium(FLAT, end=support, loads=[dx.Gravity((1.0, 0.6, -0.4))])
    x = dx.solve(problem)
    u, n, m = x.r(1.0) - np.array(support.position), x.n(1.0), x.m(1.0)
    turn = x.R(1.0) @ np.array(support.R).T
    if name == "clamped":
        turned = support.R @ frames.matrix_of_quaternion(np.array([np.cos(0.25), 0, 0, np.sin(0.25)]))
        np.testing.assert_allclose(x.R(1.0), turned, atol=1e-9)
    if name in ("clamped", "pinned", "hinge", "universal"):
        np.testing.assert_allclose(u, 0.0, atol=1e-9)
    if name in ("pinned", "roller"):
        np.testing.assert_allclose(m, 0.0, atol=1e-8)
    if name in ("roller", "slider"):
        along = np.array([1, 0, 2]) / np.sqrt(5.0)
        np.testing.assert_allclose(u - (u @ along) * along, 0.0, atol=1e-9)
        assert abs(n @ along) < 1e-8
    if name == "groove":
        along = x.R(1.0) @ np.array([1, 0, 2]) / np.sqrt(5.0)
        np.testing.assert_allclose(u - (u @ along) * along, 0.0, atol=1e-9)
        assert abs(n @ along) < 1e-8
        np.testing.assert_allclose(m, np.cross(n, u), atol=1e-8)  # the groove's force acts where the pin is
    if name == "hinge":
        axis = np.array([1, 2, 0]) / np.sqrt(5.0)
        np.testing.assert_allclose(turn @ axis, axis, atol=1e-9)
        assert abs(m @ axis) < 1e-8
    if name == "universal":
        second = turn @ np.array([0.0, 1.0, 0.0])
        assert abs(second[0]) < 1e-9
        assert abs(m[0]) < 1e-8
        assert abs(m @ second) < 1e-8
    if name in ("guided", "slider"):
        np.testing.assert_allclose(x.R(1.0), support.R, atol=1e-9)
    if name == "guided":
        np.testing.assert_allclose(n, 0.0, atol=1e-8)
    if name == "spring":
        np.testing.assert_allclose(n, -np.array(support.linear) @ u, atol=1e-8)


def test_a_rotational_spring_gives_what_its_energy_says() -> None:
    """The work of the end moment over a small rotation is minus the change of 1/2 theta . K theta, at a large angle."""
    K = np.array([[2.0, 0.3, 0.1], [0.3, 3.0, 0.2], [0.1, 0.2, 4.0]])
    rest = frames.quaternion_of_turn(np.array([[0.3, 0.5, -0.4]]))[0]
    joint = dx.Equilibrium(UNIT, end=dx.Spring(rotational=K, frame=frames.matrix_of_quaternion(rest[None])[0]))
    conditions = EndConditions(joint.end, joint.end_load("end"), 1.0, Scale.of(joint))
    q = frames.product(frames.quaternion_of_turn(np.array([[0.9, -1.1, 0.7]]))[0], rest)
    moment = conditions.values(np.concatenate([np.zeros(3), q, np.zeros(6)]), 1.0)[3:]

    def energy(q: np.ndarray) -> float:
        q = frames.product(q, rest * (1, -1, -1, -1))
        half = np.arctan2(np.linalg.norm(q[1:]), q[0])
        theta = 2.0 * half * q[1:] / np.linalg.norm(q[1:])
        return float(0.5 * theta @ K @ theta)

    for k in range(3):
        e = 1e-6 * np.eye(3)[k]
        ahead, behind = (frames.product(frames.quaternion_of_turn(sign * e[None])[0], q) for sign in (1.0, -1.0))
        assert moment[k] == pytest.approx((energy(ahead) - energy(behind)) / 2e-6, abs=1e-8)


MOMENT = dx.EndMoment((0, 0, 1))


def test_a_singular_value_of_nothing_is_rounding() -> None:
    """Equations that ask for a step along a motion which nothing resists get a long one, not an infinite one."""
    last = np.concatenate([np.diag([*np.ones(11), 0.0]), np.ones((12, 2))], axis=1)
    last[11, 0] = 1e-3
    step = np.empty((12, 2))
    assert solve_by_singular_values(last.ravel(), np.ones(12), 0.0, step.ravel()) == 0
    assert np.all(np.isfinite(step))
    assert np.max(np.abs(step)) > 1e12


@pytest.mark.parametrize(
    "problem",
    [
        dx.Equilibrium(UNIT, dx.Pinned(), dx.Pinned((0, 0, 0.8)), [MOMENT]),
        dx.Equilibrium(UNIT, dx.Pinned(), dx.Roller(along=UP), [MOMENT, dx.EndForce(UP)]),
        dx.Equilibrium(UNIT, dx.Hinge(axis=(1, 0, 0)), loads=[dx.EndMoment((1, 0, 0))]),
    ],
)
def test_a_mechanism_that_a_moment_turns_is_named(problem: dx.Equilibrium) -> None:
    solution = dx.solve(problem, throw=False)
    assert "leave it free to turn" in solution.status.message
    assert solution.statistics["load_steps"] < 100


def test_more_turns_than_can_be_followed_are_refused() -> None:
    with pytest.raises(
        dx.InvalidInput, match=r"by about 2\.3e\+05 turns; Collocation follows it up to 80\. Check the units"
    ):
        dx.solve(dx.Equilibrium(UNIT, loads=[dx.EndMoment((1e6, 0, 0))]))


def test_a_ring_of_curvature_turns_three_times_within_the_section() -> None:
    """The unloaded rod is settled before it is followed: its first frames are only roughly integrated."""
    k0 = lambda s: 2 * np.pi * np.stack([np.sin(6 * np.pi * s), np.cos(6 * np.pi * s), 3.0 + 0 * s], axis=1)  # noqa: E731
    x = dx.solve(dx.Equilibrium(dx.Rod(1.0, UNIT.section, natural=k0)))
    np.testing.assert_allclose(x.tip, 0.0, atol=1e-9)
    assert x.link == pytest.approx(3.0, abs=1e-6)


def test_turning_the_whole_problem_turns_the_answer() -> None:
    Q = frames.matrix_of_quaternion(np.array([0.3, -0.5, 0.7, 0.2]))
    place = np.array([3.0, -2.0, 1.0])

    def problem(Q: np.ndarray, place: np.ndarray) -> dx.Equilibrium:
        clamp = dx.Clamped(position=place, frame=Q)
        end = dx.Roller(along=Q @ np.array([0.3, 0, 1.0]), position=place + Q @ np.array([0.2, 0.1, 0.7]))
        loads = [dx.LineForce(Q @ np.array([2.0, 1.0, -3.0])), dx.PointForce((1, 0, 0.5), at=0.4, follower=True)]
        return dx.Equilibrium(FLAT, clamp, end, loads)

    a, b = dx.solve(problem(np.eye(3), np.zeros(3))), dx.solve(problem(Q, place))
    s = np.linspace(0.0, 1.0, 11)
    np.testing.assert_allclose(b.r(s), place + a.r(s) @ Q.T, atol=1e-9)
    np.testing.assert_allclose(b.n(s), a.n(s) @ Q.T, atol=1e-7)


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_units_do_not_matter(unit: float) -> None:
    """Lengths by 1e-6 and 1e6, with forces that give the same shape."""

    def shape(L: float) -> np.ndarray:
        rod = dx.Rod(L, dx.Stiffness(EI1=1.0, EI2=1.4, GJ=0.7))
        end = dx.Pinned(position=(0.2 * L, 0.1 * L, 0.8 * L))
        return dx.solve(dx.Equilibrium(rod, end=end, loads=[dx.LineForce((3 / L**3, 0, 0))])).r(0.5 * L) / L

    np.testing.assert_allclose(shape(unit), shape(1.0), atol=1e-10)


def test_the_force_jumps_by_a_point_load_and_the_curve_does_not_look_across() -> None:
    """On both sides, at the nodes and between them: n' = 0 but for the jump, m' = n x r'."""
    x = dx.solve(
        dx.Equilibrium(UNIT, loads=[dx.PointForce((2.0, 0, -1.0), at=0.37), dx.PointMoment((0, 0.5, 0), at=0.37)])
    )
    s = np.linspace(0.0, 1.0, 301)
    np.testing.assert_allclose(x.n(s), np.where(s[:, None] < 0.37, (2.0, 0, -1.0), 0.0), atol=1e-9)
    exact = np.where(s < 0.37, 0.5 + np.cross(x.r(0.37) - x.r(s), (2.0, 0, -1.0))[:, 1], 0.0)
    np.testing.assert_allclose(x.m(s)[:, 1], exact, atol=1e-9)


def test_between_the_nodes_a_load_of_the_shape_balances() -> None:
    """N' = -f with f = (1, 0, 0) - 5 r, the derivative by differences, between the nodes."""
    x = dx.solve(dx.Equilibrium(UNIT, loads=[dx.LineForce(lambda s, r, R: np.array([1.0, 0, 0]) - 5.0 * r)]))
    s, h = np.linspace(0.05, 0.95, 41), 1e-4
    slope = (x.n(s + h) - x.n(s - h)) / (2.0 * h)
    np.testing.assert_allclose(slope, 5.0 * x.r(s) - (1.0, 0, 0), atol=1e-6)


def test_functions_of_the_shape_are_checked() -> None:
    for wrong, word in (
        (lambda s, r, R: r[:, :2], "must give"),
        (lambda s, r, R: np.where(s[:, None] > 0.5, np.nan, r), "not finite at s = "),
        (lambda s, r, R: 1 / 0, "ZeroDivisionError"),
    ):
        with pytest.raises(dx.InvalidInput, match=word):
            dx.solve(dx.Equilibrium(UNIT, loads=[dx.LineForce(wrong)]))


def test_a_given_gradient_is_used() -> None:
    calls = []

    def pull(s: np.ndarray, r: np.ndarray, R: np.ndarray) -> np.ndarray:
        return -5.0 * r + np.array([1.0, 0, 0])

    def gradient(s: np.ndarray, r: np.ndarray, R: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        calls.append(len(s))
        return np.broadcast_to(-5.0 * np.eye(3), (len(s), 3, 3)), np.zeros((len(s), 3, 3))

    given, differences = (
        dx.solve(dx.Equilibrium(UNIT, loads=[dx.LineForce(pull, gradient=g)])) for g in (gradient, None)
    )
    np.testing.assert_allclose(given.tip, differences.tip, atol=1e-12)
    assert calls


def test_what_can_not_be_held_is_named() -> None:
    with pytest.raises(dx.InvalidInput, match=r"nothing stops the rod from moving along \(0, 0, 1\)"):
        dx.Equilibrium(UNIT, dx.Roller(along=UP), dx.Roller(along=UP))
    with pytest.raises(dx.InvalidInput, match=r"loads\[0\].at is 1.5 m, but the rod ends at 1 m"):
        dx.Equilibrium(UNIT, loads=[dx.PointForce((1, 0, 0), at=1.5)])
    for method in (dx.Shooting(), dx.Elastica()):
        with pytest.raises(dx.InvalidInput, match=r"[Uu]se Collocation"):
            dx.solve(dx.Equilibrium(UNIT, end=dx.Roller(along=UP)), method)


def test_a_buckled_rod_says_where_it_left_the_straight_branch() -> None:
    message = dx.solve(dx.Equilibrium(UNIT, loads=[dx.EndForce((0, 0, -4.0))])).status.message
    assert "turns unstable" in message
    assert "61.6" in message  # pi^2 / 4 / 4


def test_a_free_motion_is_left_alone() -> None:
    """A round rod between a ball joint and a roller may spin, and its bow may turn about the line of its ends."""
    pinned = dx.Equilibrium(UNIT, dx.Pinned(), dx.Roller(along=UP), [dx.EndForce((0, 0, -11.0))])
    x = dx.solve(pinned)
    assert x.stable
    np.testing.assert_allclose(x.m(np.array([0.0, 1.0])), 0.0, atol=1e-8)
