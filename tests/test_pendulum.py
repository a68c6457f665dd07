"""A rod on a single joint is a mechanism, but its weight comes to rest: it hangs, wherever it was drawn."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from darboux import frames
from darboux.statics import pendulum

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


def test_the_turn_is_the_best_of_many() -> None:
    rng = np.random.default_rng(3)
    arms, forces = rng.normal(size=(2, 5, 3))
    for joint, k in ((dx.Pinned(), 3), (dx.Hinge(axis=(1, 2, 2)), 1), (dx.Universal(X, Y), 2)):
        Q = pendulum.hanging(dx.Equilibrium(BENT, joint), arms, forces)
        assert Q is not None

        def work(Q: np.ndarray) -> float:
            return float(np.sum(forces * (arms @ Q.T)))

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
        dx.Equilibrium(ROD, dx.Pinned(), loads=[*weight, dx.Foundation(1.0)]),
    ):
        assert "hung" not in dx.solve(problem).status.message
