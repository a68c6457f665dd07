"""A rod on a single joint is a mechanism, but its weight comes to rest: it hangs, wherever it was drawn."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from darboux import frames
from darboux.packing import pendulum
from darboux.packing.scale import Scale
from darboux.statics import first_shape
from darboux.statics.collocation_equations import Equations
from tests.rounding import answer, difference, disturbed

ROD = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7, mass=1.0))
BENT = dx.Rod(1.0, dx.Stiffness(EI1=1.4, EI2=1.0, GJ=0.7, mass=1.0), natural=(0.5, 1.0, 2.0))
X, Y, Z = np.eye(3)
METHODS = [dx.Collocation(), dx.DiscreteRod(20)]
DIRECTIONS = [X, Y, Z, -Z, (1, 0, 0.01), (1, 0, -0.01), (0.6, 0.8, 0), (0, 1e-3, 0), (100, 0, 0)]


@pytest.mark.parametrize("method", METHODS, ids=str)
@pytest.mark.parametrize("g", DIRECTIONS, ids=str)
@pytest.mark.parametrize("joint", [dx.Pinned(), dx.Universal(X, Y)], ids=lambda joint: type(joint).__name__)
def test_a_straight_rod_hangs_along_its_weight(method, joint, g) -> None:
    x = dx.solve(dx.Equilibrium(ROD, joint, loads=[dx.Gravity(g)]), method)
    np.testing.assert_allclose(x.tip, np.array(g) / np.linalg.norm(g), atol=1e-8)
    assert x.stable
    assert ("hung from its joints" in x.status.message) == (tuple(g) != tuple(Z))


@pytest.mark.parametrize("method", METHODS, ids=str)
@pytest.mark.parametrize("at", ["start", "end"])
def test_a_bent_rod_hangs_with_its_weight_below_the_joint(method, at: str) -> None:
    """Of the moment about a ball joint at p nothing is left: the integral of (r - p) x g vanishes."""
    joint = {"start": dx.Free(), at: dx.Pinned((0.1, 0.2, 0.3))}
    x = dx.solve(dx.Equilibrium(BENT, **joint, loads=[dx.Gravity((1, 2, -0.5))]), method)
    s, w = np.polynomial.legendre.leggauss(40)
    centre = 0.5 * w @ x.r(0.5 * (s + 1.0)) - (0.1, 0.2, 0.3)
    assert np.linalg.norm(np.cross(centre, (1, 2, -0.5))) < (1e-8 if method == METHODS[0] else 1e-3)
    assert centre @ (1, 2, -0.5) > 0.0
    assert x.stable


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_a_rod_on_a_hinge_turns_about_its_axis_only(method) -> None:
    """Weight along the axis bends it sideways, as a cantilever, and leaves it free to swing."""
    x = dx.solve(dx.Equilibrium(ROD, dx.Hinge(Y), loads=[dx.Gravity((3, 0, 4))]), method)
    np.testing.assert_allclose(x.tip, (0.6, 0, 0.8), atol=1e-8)
    aside = dx.solve(dx.Equilibrium(ROD, dx.Hinge(Y), loads=[dx.Gravity(Y)]), method)
    cantilever = dx.solve(dx.Equilibrium(ROD, dx.Clamped(), loads=[dx.Gravity(Y)]))
    assert aside.tip[1] == pytest.approx(cantilever.tip[1], rel=3e-3)


@pytest.mark.parametrize("method", METHODS, ids=str)
@pytest.mark.parametrize("end", [dx.Roller(along=Z), dx.Pinned((0, 0, 0.8))], ids=["roller", "pinned"])
def test_an_arch_on_two_ball_joints_falls_over(method, end) -> None:
    """It turns about the line of its joints until its weight hangs below them; hinges keep it upright."""
    arch = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.0, GJ=0.7, mass=1.0), natural=(0, 2.0, 0))
    fallen = dx.solve(dx.Equilibrium(arch, dx.Pinned(), end, [dx.Gravity(Y)]), method)
    assert fallen.stable
    middle = fallen.r(0.5)
    assert middle[1] > 0.2
    assert abs(middle[0]) < 1e-6
    upright = dx.Hinge(axis=Y, tangent=(-np.sin(1.0), 0, np.cos(1.0)))
    kept = dx.solve(dx.Equilibrium(arch, upright, end, [dx.Gravity(X)]), method)
    assert kept.r(0.5)[0] < -0.15


@pytest.mark.parametrize("growing", [0.0, 0.3, 3.0])
def test_the_turn_is_the_best_of_many(growing: float) -> None:
    rng = np.random.default_rng(3)
    arms, forces = rng.normal(size=(2, 5, 3))
    C = growing * rng.normal(size=(5, 3, 3))
    C = C + C.transpose(0, 2, 1)
    for joint, k in ((dx.Pinned(), 3), (dx.Hinge(axis=(1, 2, 2)), 1), (dx.Universal(X, Y), 2)):
        Q = pendulum.hanging(dx.Equilibrium(BENT, joint), arms, forces, C)
        assert Q is not None

        def work(Q: np.ndarray) -> float:
            places = arms @ Q.T
            return float(np.sum(forces * places) + 0.5 * np.einsum("ni,nij,nj", places, C, places))

        axes = joint.rotation_axes[:, ~np.array(joint.held_rotation)].T
        for _ in range(300):
            if k == 3:
                other = frames.rotation(rng.normal(size=3) * 2.0)
            else:
                other = np.eye(3)
                for axis in axes:
                    other = other @ frames.rotation(rng.uniform(-np.pi, np.pi) * axis)
            assert work(other) <= work(Q) + 1e-9


def test_what_is_no_pendulum_lies_where_its_support_lays_it() -> None:
    weight = [dx.Gravity(X)]
    for problem in (
        dx.Equilibrium(ROD, loads=weight),
        dx.Equilibrium(ROD, dx.Pinned(), dx.Roller(along=Z), weight),  # straight: it turns about itself
        dx.Equilibrium(BENT, dx.Pinned(), dx.Roller(along=Z, position=(0.1, 0, 0)), weight),
        dx.Equilibrium(BENT, dx.Hinge(Y), dx.Roller(along=Z), weight),
        dx.Equilibrium(ROD, dx.Pinned()),
        dx.Equilibrium(ROD, dx.Spring(linear=1.0, rotational=1.0), loads=weight),
    ):
        assert "hung" not in dx.solve(problem).status.message


TURNING = {  # before any load about the line through its two supports: a lateral place, or a spring, grows from there
    "a roller aside": (dx.Pinned(), dx.Roller(along=Z, position=(0.1, 0, 0))),
    "a roller across": (dx.Pinned(), dx.Roller(along=Y, position=(0.1, 0, 0.5))),
    "the roller at the start": (dx.Roller(along=Z, position=(0.1, 0, 0)), dx.Pinned()),
    "a spring": (dx.Pinned(), dx.Spring(linear=5.0, position=(0.1, 0, 0.6))),
    "two springs": (dx.Spring(linear=5.0), dx.Spring(linear=5.0, position=(0.1, 0, 0.6))),
}


@pytest.mark.parametrize("name", TURNING)
def test_a_bent_rod_on_two_supports_turns_to_where_its_weight_is_lowest(name: str) -> None:
    """No weight is left about the line through its supports, and the side does not depend on rounding."""
    problem = dx.Equilibrium(BENT, *TURNING[name], [dx.Gravity(X)])
    x = dx.solve(problem)
    assert x.stable
    assert "turned about the line through its supports" in x.status.message
    s, w = np.polynomial.legendre.leggauss(40)
    centre, line = 0.5 * w @ x.r(0.5 * (s + 1.0)) - x.r(0.0), x.tip - x.r(0.0)
    assert abs(np.cross(centre, X) @ line) < 1e-9
    assert (centre - line * (centre @ line) / (line @ line)) @ X > 0.0
    with disturbed(seed=1):
        assert difference(answer(problem), answer(problem)) == ""


def test_a_bent_rod_turns_to_where_loads_that_grow_with_its_place_let_it_rest() -> None:
    """Foundations, with a dead load or without: stable, and the same from disturbed states (a third was neither)."""
    rng = np.random.default_rng(5)
    for i in range(14):
        stiffness = dx.Stiffness(EI1=1.0, EI2=rng.uniform(1, 3), GJ=0.8)
        rod = dx.Rod(1.0, stiffness, natural=(rng.uniform(-4, 4), rng.uniform(-4, 4), rng.uniform(-3, 3)))
        end = dx.Pinned((0, 0, 0.7)) if rng.integers(2) == 0 else dx.Roller(along=Z)
        loads: list = [dx.Foundation(10 ** rng.uniform(0, 2.5), point=tuple(rng.uniform(-0.3, 0.3, 3)))]
        if i % 2:
            loads.append(dx.LineForce(tuple(rng.uniform(-9, 9, 3))))
        problem = dx.Equilibrium(rod, dx.Pinned(), end, loads)
        found = answer(problem)
        assert (found["code"], found["index"]) == ("converged", 0)
        with disturbed(seed=i):
            assert difference(found, answer(problem)) == ""


def test_a_pendulum_on_a_foundation_starts_where_its_moment_vanishes() -> None:
    """A rod on a hinge, its weight w along x and a foundation K along z: tan(angle) = 3 w / (2 K L)."""
    problem = dx.Equilibrium(ROD, dx.Hinge(Y), loads=[dx.LineForce((6.0, 0, 0)), dx.Foundation(9.0)])
    _, _, R = pendulum.at_rest(problem)
    K, w = 9.0, 6.0
    assert np.arctan2(R[0, 2], R[2, 2]) == pytest.approx(np.arctan(1.5 * w / K), abs=1e-12)
    assert dx.solve(problem).stable


def test_a_shape_that_the_solver_found_is_never_too_rough() -> None:
    """Free of stress in its own shape a rod has no strain but rounding; and a rough curve is a polynomial between its samples."""
    problem = dx.Equilibrium(BENT, dx.Pinned(), loads=[dx.Gravity(X)])
    scale = Scale.of(problem)
    equations = Equations(problem, 4)
    own = equations.curve(equations.unloaded(), 0.0)
    lent = Equations(problem, 4, first_shape.given(problem, scale, own)).relaxing
    assert np.max(np.abs(lent[:, 0])) < 1e-8
    points = np.cumsum(np.random.default_rng(0).normal(size=(300, 3)), axis=0)
    rough = first_shape.given(problem, scale, points)
    table = Equations(problem, 4, rough)
    middle = 0.5 * (table.table.breaks[1:] + table.table.breaks[:-1])
    powers = (0.5 * np.diff(table.table.breaks))[:, None] ** np.arange(8)
    found = np.einsum("pk,pkc->pc", powers, table.relaxing)
    np.testing.assert_allclose(found, table.natural_shape(middle) - rough.k(middle), atol=1e-9 * np.max(np.abs(found)))
