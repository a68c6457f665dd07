"""What a support leaves free, and how stiff it is, against its conditions and against its energy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

import darboux as dx
from darboux import frames
from darboux.kernels import support as kernel
from darboux.packing.ends import EndConditions
from darboux.packing.scale import Scale
from darboux.supports import Support

SUPPORTS = {
    "clamped": dx.Clamped(),
    "pinned": dx.Pinned(),
    "free": dx.Free(),
    "roller": dx.Roller(along=(1, 2, 2)),
    "hinge": dx.Hinge(axis=(0, 1, 0)),
    "universal": dx.Universal((1, 0, 0), (0, 1, 0)),
    "slider": dx.Slider(along=(0, 3, 4)),
    "guided": dx.Guided(),
    "spring": dx.Spring(linear=2.0, rotational=3.0),
}


def conditions(support: Support, loads: tuple = ()) -> EndConditions:
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.0, GJ=0.7))
    problem = dx.Equilibrium(rod, end=support, loads=loads)
    return EndConditions(support, problem.end_load("end"), 1.0, Scale.of(problem))


def state(seed: int) -> np.ndarray:
    y = np.random.default_rng(seed).normal(size=13)
    y[3:7] /= np.linalg.norm(y[3:7])
    return y


@pytest.mark.parametrize("name", SUPPORTS)
def test_free_motions_change_nothing_that_is_held(name: str) -> None:
    """There are as many as forces known; along each the prescribed displacements and rotations stay."""
    c = conditions(SUPPORTS[name])
    y = state(2)
    y[:3], y[3:7] = c.pose(1.0)
    if name == "universal":  # turned about its axes
        turned = frames.rotation(np.array([0.6, 0, 0])) @ frames.rotation(np.array([0, 0.4, 0]))
        y[3:7] = frames.quaternion_of_matrix(turned @ frames.matrix_of_quaternion(y[3:7]))
    hold = c.held(y, 1.0)
    motions = hold.motions[:, : hold.free]
    held = np.array([*SUPPORTS[name].held_displacement, *SUPPORTS[name].held_rotation])
    assert hold.free == 6 - np.count_nonzero(held)
    np.testing.assert_allclose(motions.T @ motions, np.eye(hold.free), atol=1e-12)
    R = frames.matrix_of_quaternion(y[3:7])
    rows = c.system(y, 1.0)[:, :12]
    for motion in motions.T:
        delta = np.concatenate([motion[:3], R.T @ motion[3:], np.zeros(6)])
        np.testing.assert_allclose((rows @ delta)[held], 0.0, atol=1e-7)


def test_the_stiffness_is_the_second_derivative_of_the_energy() -> None:
    """Of eccentric forces, -lambda R : A, by turns of the fixed frame; springs as they are."""
    c = conditions(dx.Free(), (dx.EndForce((0.5, -1.0, 2.0), offset=(0.3, 0.4, -0.2)),))
    A = np.outer((0.5, -1.0, 2.0), (0.3, 0.4, -0.2))
    y, load_factor, h = state(3), 0.7, 1e-4
    R = frames.matrix_of_quaternion(y[3:7])

    def energy(theta: np.ndarray) -> float:
        return float(-load_factor * np.sum(frames.rotation(theta) @ R * A))

    e = h * np.eye(3)
    second = [[(energy(a + b) - energy(a - b) - energy(b - a) + energy(-a - b)) / (4.0 * h**2) for b in e] for a in e]
    found = c.held(y, load_factor).stiffness
    np.testing.assert_allclose(found[3:, 3:], second, atol=1e-6)
    np.testing.assert_array_equal(found[:3], 0.0)
    spring = conditions(SUPPORTS["spring"]).held(y, load_factor).stiffness
    np.testing.assert_allclose(spring, np.diag([2.0, 2.0, 2.0, 3.0, 3.0, 3.0]))
    assert len(c.numbers(1.0)) == kernel.NUMBERS


@pytest.mark.parametrize("twist", [0.0, 7.0])
def test_a_pose_goes_the_shortest_way_evenly(twist: float) -> None:
    """Against SciPy's slerp, and the twist about the section's own axis; the rates against differences."""
    c = conditions(dx.Clamped((0.3, 0.2, 0.7), frame=frames.rotation(np.array([0.4, -1.5, 0.8])), twist=twist))
    y = state(6)
    c.grow_from(y)
    ends = Rotation.from_quat([y[3:7], c.way[kernel.TO_FRAME : kernel.TWIST]], scalar_first=True)
    for load_factor in (0.0, 0.37, 1.0):
        place, q = c.pose(load_factor)
        np.testing.assert_allclose(place, (1.0 - load_factor) * y[:3] + load_factor * c.way[7:10], atol=1e-15)
        about = Rotation.from_rotvec([0.0, 0.0, twist * load_factor])
        expected = (Slerp([0.0, 1.0], ends)(load_factor) * about).as_matrix()
        np.testing.assert_allclose(frames.matrix_of_quaternion(q), expected, atol=1e-14)
        rates = c.numbers(load_factor)[kernel.PLACE_RATE :].copy()
        ahead, behind = (np.concatenate(c.pose(load_factor + h)) for h in (1e-6, -1e-6))
        np.testing.assert_allclose(rates, (ahead - behind) / 2e-6, atol=1e-9 * (1.0 + twist**2))


def test_a_twist_is_of_the_way_where_all_grows_at_once() -> None:
    c = conditions(dx.Clamped((0.0, 0.0, 0.7), twist=1.2))
    y = state(6)
    c.grow_from(y, all_at_once=True)
    expected = frames.rotation(np.array([0.0, 0.0, 1.2]))
    np.testing.assert_allclose(frames.matrix_of_quaternion(c.pose(1.0)[1]), expected, atol=1e-15)
    np.testing.assert_allclose(c.pose(0.0)[1], y[3:7], atol=1e-15)
