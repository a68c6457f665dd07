"""Forces that act off the section's centre: by closed forms, by SciPy alone, and by a moment that is iterated by hand."""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

import darboux as dx
from darboux.frames import rotation
from darboux.kernels import band
from darboux.packing.ends import EndConditions, moved
from darboux.packing.scale import Scale
from darboux.statics.discrete_branch import ChainBranch
from darboux.statics.discrete_chain import Chain, _advanced, nodes_along

UNIT = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.75))
FLAT = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=2.0, GJ=0.75, mass=1.0))
BENT = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.4, GJ=0.75, EA=30.0), natural=(0.3, 0.2, 0.4))
ALONG = np.linspace(0.0, 1.0, 11)
METHODS = [dx.Collocation(), dx.Shooting(), dx.Elastica(), dx.DiscreteRod(50, extrapolate=True)]


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_the_secant_formula(method: Any) -> None:
    """S. P. Timoshenko, J. M. Gere, Theory of Elastic Stability, 1961, sec. 1.4: delta = e (sec kL - 1), k^2 = P / EI."""
    e, P = 1e-4, 1.3
    found = dx.solve(dx.Equilibrium(UNIT, loads=[dx.EndForce((0, 0, -P), offset=(e, 0, 0))]), method)
    assert abs(found.tip[0]) == pytest.approx(e * (1.0 / np.cos(np.sqrt(P)) - 1.0), rel=2e-5)
    assert found.tip[0] > 0.0


def in_plane(F: tuple, e: tuple, at: float = 1.0) -> np.ndarray:
    """The tip (x, z) of a unit cantilever along z by shooting: theta'' = -(x' F_z - z' F_x), theta'(at) = ((R e) x F)_y.

    e = (across, along) the rod, theta the tangent's angle from z to x. Beyond ``at`` the rod is straight.
    """

    def slope(_: float, y: np.ndarray) -> list[float]:
        x, z = np.sin(y[2]), np.cos(y[2])
        return [x, z, y[3], -(z * F[0] - x * F[1])]

    def gap(k: float) -> float:
        y = solve_ivp(slope, (0.0, at), [0, 0, 0, k], rtol=1e-12, atol=1e-13).y[:, -1]
        c, s = np.cos(y[2]), np.sin(y[2])
        arm = (e[0] * c + e[1] * s, -e[0] * s + e[1] * c)
        return y[3] - (arm[1] * F[0] - arm[0] * F[1])

    grid = np.linspace(-8.0, 8.0, 81)
    gaps = [gap(k) for k in grid]
    starts = [(a, b) for (a, p), (b, q) in itertools.pairwise(zip(grid, gaps, strict=True)) if p * q < 0.0]
    k = brentq(gap, *min(starts, key=lambda pair: abs(pair[0] + pair[1])), xtol=1e-13)
    y = solve_ivp(slope, (0.0, at), [0, 0, 0, k], rtol=1e-12, atol=1e-13).y[:, -1]
    return y[:2] + (1.0 - at) * np.array([np.sin(y[2]), np.cos(y[2])])


@pytest.mark.parametrize(("F", "e", "at"), [((1.5, -1.0), (0.3, 0.2), 1.0), ((2.0, 1.5), (-0.4, -0.3), 0.6)])
def test_large_deflections_by_scipy(F: tuple, e: tuple, at: float) -> None:
    force, offset = (F[0], 0, F[1]), (e[0], 0, e[1])
    load = dx.EndForce(force, offset=offset) if at == 1.0 else dx.PointForce(force, at, offset=offset)
    problem = dx.Equilibrium(UNIT, loads=[load])
    wanted = in_plane(F, e, at)
    for method in METHODS if at == 1.0 else (METHODS[0], METHODS[3]):
        tip = dx.solve(problem, method).tip
        close = 2e-6 if method is METHODS[3] else 1e-9
        np.testing.assert_allclose(tip, [wanted[0], 0.0, wanted[1]], atol=close, err_msg=str(method))


COUPLED = np.diag([60.0, 60.0, 80.0, 1.0, 1.4, 0.75])
COUPLED[2, 5] = COUPLED[5, 2] = 2.0
COUPLED[3, 4] = COUPLED[4, 3] = 0.2
RODS = {
    "inextensible": dataclasses.replace(BENT, stretch=False),
    "stretching": dataclasses.replace(BENT, stretch=True),
    "shearing": dx.Rod(
        1.0, dx.Stiffness(EI1=1.0, EI2=1.4, GJ=0.75, EA=30.0, GA1=20.0, GA2=15.0), stretch=True, shear=True
    ),
    "coupled": dx.Rod(1.0, dx.StiffnessMatrix(COUPLED), stretch=True, shear=True),
}


@pytest.mark.parametrize("rod", RODS)
def test_it_is_the_force_with_its_moment_iterated_by_hand(rod: str) -> None:
    """At both kinds of place, in space; the end stands on a groove that turns, and its reaction takes the moment too."""
    F, G, e = np.array([0.7, 0.4, -0.5]), np.array([-0.3, 0.8, 0.4]), np.array([0.2, -0.15, 0.1])
    problem = dx.Equilibrium(
        RODS[rod], end=dx.Spring(linear=2.0, position=(0, 0, 1)), loads=[dx.LineForce((0, 0.5, 0))]
    )
    off = dx.solve(
        problem.with_load(dx.EndForce(F, offset=e)).with_load(dx.PointForce(G, 0.4, offset=e)), dx.Collocation(1e-11)
    )
    arms = {1.0: np.cross(off.R(1.0) @ e, F), 0.4: np.cross(off.R(0.4) @ e, G)}
    loads = [dx.EndForce(F), dx.EndMoment(arms[1.0]), dx.PointForce(G, 0.4), dx.PointMoment(arms[0.4], 0.4)]
    by_hand = dx.solve(dataclasses.replace(problem, loads=(*problem.loads, *loads)), dx.Collocation(1e-11))
    np.testing.assert_allclose(off.r(ALONG), by_hand.r(ALONG), atol=1e-9)
    np.testing.assert_allclose(off.m([0.2, 0.7]), by_hand.m([0.2, 0.7]), atol=1e-9)
    assert off.balance.moment < 1e-9
    assert off.index == 0
    assert by_hand.index is None


def test_it_is_the_force_on_a_stiff_arm() -> None:
    """Along the rod: the arm is more of the rod, 1e7 times as stiff."""
    c, F = 0.3, (0.8, 0.5, -1.2)
    EI = dx.Table([0, 1, 1 + 1e-9, 1 + c], [1, 1, 1e7, 1e7], "linear")
    arm = dx.Rod(1.0 + c, dx.Stiffness(EI1=EI, EI2=EI, GJ=EI))
    whole = dx.solve(dx.Equilibrium(arm, loads=[dx.EndForce(F)]))
    off = dx.solve(
        dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.0, GJ=1.0)), loads=[dx.EndForce(F, offset=(0, 0, c))])
    )
    np.testing.assert_allclose(off.tip, whole.r(1.0), atol=1e-6)
    np.testing.assert_allclose(off.tip + off.R(1.0) @ (0, 0, c), whole.tip, atol=1e-6)


def test_a_follower_off_the_centre_is_one_with_a_moment() -> None:
    f, e = np.array([0.5, 0.3, -0.8]), np.array([0.1, 0.2, 0.3])
    one = dx.Equilibrium(BENT, loads=[dx.EndForce(f, follower=True, offset=e)])
    two = dx.Equilibrium(BENT, loads=[dx.EndForce(f, follower=True), dx.EndMoment(np.cross(e, f), follower=True)])
    np.testing.assert_allclose(dx.solve(one).r(ALONG), dx.solve(two).r(ALONG), atol=1e-12)
    assert dx.solve(one).index is None


def test_turning_the_problem_turns_the_answer() -> None:
    T = rotation(np.array([0.4, -0.8, 0.5]))
    forces = np.array([0.7, 0.4, -0.9]), np.array([-0.3, 0.8, 0.4])

    def solved(T: np.ndarray) -> dx.EquilibriumSolution:
        F, G = (T @ force for force in forces)
        loads = [dx.EndForce(F, offset=(0.2, -0.1, 0.3)), dx.PointForce(G, 0.4, offset=(-0.1, 0.3, 0))]
        return dx.solve(dx.Equilibrium(BENT, dx.Clamped(frame=T), loads=loads))

    np.testing.assert_allclose(solved(T).r(ALONG), solved(np.eye(3)).r(ALONG) @ T.T, atol=1e-9)


# -- stability ---------------------------------------------------------------------------------------------------------


def critical(c: float) -> float:
    """The load at r + c d3 under which a unit cantilever buckles: EI w'' = P (d - w), d = w + c w' at the end.

    w = d (1 - cos kx), so that k c sin k = cos k.
    """
    return float(brentq(lambda k: k * c * np.sin(k) - np.cos(k), 0.05, np.pi - 0.05)) ** 2


@pytest.mark.parametrize("c", [0.25, 1.0, -0.2])
@pytest.mark.parametrize("at", [1.0, 0.6])
def test_a_column_whose_load_acts_on_a_rigid_link(c: float, at: float) -> None:
    P = critical(c / at) / at**2

    def problem(share: float) -> dx.Equilibrium:
        force, offset = (0, 0, -share * P), (0, 0, c)
        load = dx.EndForce(force, offset=offset) if at == 1.0 else dx.PointForce(force, at, offset=offset)
        return dx.Equilibrium(FLAT, loads=[load])

    straight = [dx.solve(problem(share), dx.DiscreteRod(100, stable=False)).index for share in (0.998, 1.002)]
    assert straight == [0, 1]
    assert [abs(dx.solve(problem(share)).tip[1]) > 0.01 for share in (0.998, 1.002)] == [False, True]
    (crossing,) = dx.solve(problem(1.2), dx.DiscreteRod(200, stable=False)).statistics["crossings"]
    assert 1.2 * crossing[0] < 1.0 + 1e-4
    assert 1.2 * crossing[1] > 1.0 - 1e-4
    if at == 1.0:
        assert [dx.solve(problem(share), dx.Shooting()).index for share in (0.9999, 1.0001)] == [0, 1]


def test_the_index_is_the_same_by_both_methods_where_much_is_off_the_centre() -> None:
    rng = np.random.default_rng(5)
    indices = []
    for _ in range(6):
        F, G, e, d = rng.normal(size=(4, 3)) * np.array([3.0, 3.0, 0.3, 0.3])[:, None]
        problem = dx.Equilibrium(FLAT, loads=[dx.EndForce(F, offset=e), dx.PointForce(G, 0.45, offset=d)])
        found = dx.solve(problem, dx.DiscreteRod(120, stable=False), throw=False)
        if found.status.converged:
            beside = dx.Collocation().beside(problem, found)
            assert beside is not None
            assert np.max(np.abs(beside.r(ALONG) - found.r(ALONG))) < 1e-2
            indices.append((found.index, beside.index))
    assert len(indices) > 3
    assert all(a == b for a, b in indices), indices


@pytest.mark.parametrize("share", [0.5, -1.0])
def test_vibrations_of_a_column_whose_load_acts_on_a_rigid_link(share: float) -> None:
    """w'''' + P w'' = omega^2 w, w''(1) = P c w'(1), w'''(1) = -P w'(1): the roots of a determinant, by matrix exponentials."""
    c = 0.4
    P = share * critical(c)

    def determinant(omega: float) -> float:
        A = np.diag(np.ones(3), 1)
        A[3, 0], A[3, 2] = omega**2, -P
        Y = expm(A)[:, 2:]
        return float(np.linalg.det([Y[2] - P * c * Y[1], Y[3] + P * Y[1]]))

    grid = np.linspace(0.3, 30.0, 300)
    signs = [determinant(x) for x in grid]
    wanted = [
        brentq(determinant, a, b) for (a, p), (b, q) in itertools.pairwise(zip(grid, signs, strict=True)) if p * q < 0
    ]
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1e4, GJ=1e4, EA=1e7, mass=1.0))
    problem = dx.Equilibrium(rod, loads=[dx.EndForce((0, 0, -P), offset=(0, 0, c))])
    found = dx.natural_modes(problem, 2, segments=60, about=dx.solve(problem), rotary_inertia=1e-4).frequencies
    np.testing.assert_allclose(found * dx.turn, wanted[:2], rtol=2e-4)
    by_statics = dx.solve(problem, dx.DiscreteRod(60, extrapolate=True)).modes(2).frequencies
    np.testing.assert_allclose(by_statics * dx.turn, wanted[:2], rtol=2e-4)


# -- derivatives -------------------------------------------------------------------------------------------------------


def test_the_derivatives_of_the_end_conditions() -> None:
    """A Taylor test by the twelve unknowns of an end, under what is free, held and hinged."""
    loads = [
        dx.EndForce((1, 2, -3), offset=(0.3, -0.2, 0.5)),
        dx.EndForce((2, 0, 1), offset=(0, 0.7, 0.1), follower=True),
    ]
    rng = np.random.default_rng(2)
    for support in (dx.Free(), dx.Hinge((1, 0, 0)), dx.Universal((1, 0, 0), (0, 1, 0)), dx.Slider((0, 0, 1))):
        problem = dx.Equilibrium(BENT, end=support, loads=loads)
        scale = Scale.of(problem)
        conditions = EndConditions(support, problem.end_load("end"), 1.0, scale)
        y, v = rng.normal(size=13), rng.normal(size=12)
        y[3:7] /= np.linalg.norm(y[3:7])
        J, at = conditions.system(y, 0.7)[:, :12], conditions.values(y, 0.7)
        left = [np.linalg.norm(conditions.values(moved(y, h * v), 0.7) - at - h * J @ v) for h in (1e-3, 5e-4)]
        assert 1.8 < np.log2(left[0] / left[1]) < 2.2, left


def test_the_hessian_of_the_chain_is_the_derivative_of_its_gradient() -> None:
    """And the gradient that of the energy, but for the turn of the chart."""
    loads = [dx.EndForce((1, 2, -3), offset=(0.3, -0.2, 0.5)), dx.PointForce((2, -1, 1), 0.5, offset=(-0.3, 0.4, 0.2))]
    problem = dx.Equilibrium(dataclasses.replace(BENT, stretch=True), loads=loads)
    chain = Chain(problem, nodes_along(6, 1.0, True, False, [0.5]), False)
    branch, rng = ChainBranch(chain), np.random.default_rng(3)
    free = np.where(chain.fixed, 0.0, 1.0)
    shape = chain.moved(chain.unloaded(), 0.05 * rng.normal(size=chain.unknowns) * free, 1.0)
    v = rng.normal(size=chain.unknowns) * free
    v[:8], v[-7:] = 0.0, 0.0  # the ends have charts of their own
    here = branch.assemble(shape, 1.0)
    g, n = branch.gradient.copy(), chain.unknowns
    general = np.empty(band.FULL * n)
    band.expand(branch.lower, n, general)
    columns = general.reshape(n, band.FULL)
    H = sum(np.diag(columns[max(0, -k) : n - max(0, k), band.REACH + k], -k) for k in range(-10, 11))
    h = 2e-4
    a, b, c, d = (
        branch.assemble(shape._replace(state=_advanced(shape.state, k * h * v)), 1.0) for k in (2.0, 1.0, -1.0, -2.0)
    )
    assert (8.0 * (b - c) - (a - d)) / (12.0 * h) == pytest.approx(g @ v, rel=1e-7)
    assert (16.0 * (b + c) - (a + d) - 30.0 * here) / (12.0 * h * h) == pytest.approx(v @ H @ v, rel=1e-6)


# -- what holds and what is told ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", [dx.Collocation(), dx.DiscreteRod(40)], ids=str)
def test_a_reaction_takes_the_moment_of_an_eccentric_force(method: Any) -> None:
    """About the origin, all reactions and loads, at their points of action, are in balance."""
    F, e = np.array([0.6, -0.4, 0.3]), np.array([0.2, 0.1, -0.15])
    problem = dx.Equilibrium(
        dataclasses.replace(FLAT, stretch=False),
        end=dx.Slider((0, 0, 1), position=(0.1, 0, 0.9)),
        between={0.5: dx.Spring(linear=20.0, position=(0, 0, 0.5))},
        loads=[dx.EndForce(F, offset=e), dx.PointForce(-2.0 * F, 0.5, offset=e)],
    )
    found = dx.solve(problem, method)
    acting = [(found.r(s) + found.R(s) @ e, force) for s, force in ((1.0, F), (0.5, -2.0 * F))]
    held = [(0.0, found.reactions.start), (1.0, found.reactions.end), (0.5, found.reactions.between[0.5])]
    force = sum(f for _, f in acting) + sum(reaction.force for _, reaction in held)
    moment = sum(np.cross(r, f) for r, f in acting)
    moment = moment + sum(np.cross(found.r(s), reaction.force) + reaction.moment for s, reaction in held)
    np.testing.assert_allclose(force, 0.0, atol=1e-9)
    np.testing.assert_allclose(moment, 0.0, atol=1e-8 if method == dx.Collocation() else 2e-3)


def test_a_hung_rod_begins_where_its_eccentric_loads_let_it_hang() -> None:
    """On a ball joint it hangs from the point of action: straight, with r + R e below the joint."""
    e = np.array([0.3, 0.1, 0.0])
    problem = dx.Equilibrium(UNIT, dx.Pinned(), loads=[dx.EndForce((0, 0, -1e-6), offset=e)])
    for method in (dx.Collocation(), dx.DiscreteRod(20)):
        found = dx.solve(problem, method)
        point = found.tip + found.R(1.0) @ e
        np.testing.assert_allclose(point, [0, 0, -np.sqrt(1.0 + e @ e)], atol=1e-6)
