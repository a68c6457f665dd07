"""Descriptions are frozen values; sections and natural shapes hold what mechanics says of them."""

from __future__ import annotations

import dataclasses
import pickle

import numpy as np
import pytest

import darboux as dx
from darboux.natural import smallest_rotation

S = np.array([0.0, 0.5, 1.0])


def bent(s: np.ndarray) -> np.ndarray:
    return np.stack([0 * s, 1 + s, 0 * s], axis=1)


VALUES = [
    dx.Material(E=1e6, nu=0.5, density=1e3),
    dx.Circle(1e-3),
    dx.Circle(dx.Table([0, 1], [1e-3, 2e-3])),
    dx.Stiffness(EI1=1.0, GJ=0.7),
    dx.Helix(0.02, 0.02, handed="left"),
    dx.Rod(1.0, dx.Rectangle(1e-3, 2e-3), dx.Material(E=1e6, G=4e5), natural=[0, 1, 0], stretch=True),
    dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7), natural=bent),
    dx.Clamped(position=[1, 2, 3], tangent=[2, 0, 0], d1=[0, 0, 1]),
    dx.Clamped(frame=np.eye(3)),
    dx.Free(),
    dx.Gravity(),
    dx.LineForce(np.array([0, 0, 1.0])),
    dx.Rotation((0, 0, 1)),
    dx.ElectricField((0, 0, 1), 1e-7),
    dx.EndForce([1, 0, 0]),
    dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7)), loads=[dx.EndForce([1, 0, 0])]),
    dx.Shooting(),
    dx.Elastica(),
    dx.DiscreteRod(30),
]


@pytest.mark.parametrize("value", VALUES, ids=lambda v: type(v).__name__)
def test_frozen_values(value) -> None:
    assert pickle.loads(pickle.dumps(value)) == value
    assert hash(dataclasses.replace(value)) == hash(value)
    assert dataclasses.replace(value) == value
    for field in dataclasses.fields(value):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(value, field.name, 1.0)


def test_problems_are_changed_by_copy() -> None:
    problem = dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7, EA=1e3)))
    loaded = problem.with_load(dx.EndForce((1, 0, 0)))
    assert problem.loads == ()
    assert len(loaded.loads) == 1
    assert loaded.with_rod(stretch=True).rod.model == "stretch"
    assert loaded.rod.model == "inextensible"
    # A single load needs no list.
    assert dx.Equilibrium(problem.rod, loads=dx.EndForce((1, 0, 0))) == loaded


def test_circle() -> None:
    rod = dx.Rod(1.0, dx.Circle(2.0), dx.Material(E=3.0, nu=0.25, density=5.0), stretch=True, shear=True)
    got = rod.stiffness(S)
    np.testing.assert_allclose(got.EI1, 3.0 * np.pi * 16.0 / 4.0)
    np.testing.assert_allclose(got.GJ, 1.2 * np.pi * 16.0 / 2.0)
    np.testing.assert_allclose(got.EA, 3.0 * np.pi * 4.0)
    np.testing.assert_allclose(got.mass, 5.0 * np.pi * 4.0)
    np.testing.assert_allclose(got.GA1, 1.2 * np.pi * 4.0 * 6 * 1.25 / (7 + 6 * 0.25))  # Cowper (1966)


def test_a_tube_without_a_hole_is_a_circle_and_an_ellipse_of_equal_axes_too() -> None:
    circle = dx.Circle(2.0).geometry(S, 0.3)
    for other in (dx.Tube(2.0, 1e-9).geometry(S, 0.3), dx.Ellipse(2.0, 2.0).geometry(S, 0.3)):
        for field in dataclasses.fields(circle):
            np.testing.assert_allclose(getattr(other, field.name), getattr(circle, field.name), rtol=1e-12)


@pytest.mark.parametrize(
    ("ratio", "beta"),
    # Torsion constant J = beta p q^3; square: 0.140577014955154 (reference digits, case S07), others: Timoshenko and
    # Goodier, Theory of Elasticity, table of art. 109 (three digits), infinitely flat: 1/3.
    [(1.0, 0.14057701495515368), (2.0, 0.229), (3.0, 0.263), (10.0, 0.312), (1e6, 1.0 / 3.0)],
)
def test_torsion_constant_of_a_rectangle(ratio: float, beta: float) -> None:
    tolerance = 1e-14 if ratio == 1.0 else 5.1e-4
    for section in (dx.Rectangle(ratio, 1.0), dx.Rectangle(1.0, ratio)):
        assert section.geometry(S, 0.3).J[0] / ratio == pytest.approx(beta, abs=tolerance)


def test_axes_of_unequal_sections() -> None:
    """Index 1 bends about d1: the height along d2 counts with its cube."""
    g = dx.Rectangle(width=2.0, height=3.0).geometry(S, 0.3)
    np.testing.assert_allclose([g.I1[0], g.I2[0]], [2.0 * 27.0 / 12.0, 3.0 * 8.0 / 12.0])
    e = dx.Ellipse(a=2.0, b=3.0).geometry(S, 0.3)
    np.testing.assert_allclose([e.I1[0], e.I2[0]], np.pi / 4.0 * np.array([2.0 * 27.0, 3.0 * 8.0]))


def test_quantities_that_vary() -> None:
    table = dx.Table([0.0, 1.0], [1.0, 2.0], interpolation="linear")
    for radius in (table, lambda s: 1.0 + s, dx.Table(S, 1.0 + S)):
        rod = dx.Rod(1.0, dx.Circle(radius), dx.Material(E=1.0, nu=0.3))
        assert not rod.uniform
        np.testing.assert_allclose(rod.stiffness(S).EA, np.pi * (1.0 + S) ** 2)
    assert dx.Rod(1.0, dx.Circle(1.0), dx.Material(E=1.0, nu=0.3)).uniform
    k0 = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0), natural=lambda s: (0 * s, 0 * s, s)).k0(S)
    np.testing.assert_allclose(k0[:, 2], S)


@pytest.mark.parametrize("handed", ["right", "left"])
def test_helix_keeps_radius_pitch_and_hand(handed: str) -> None:
    """One turn of arc length 2 pi sqrt(a^2 + c^2) rises by the pitch, and winds with or against the rise."""
    a, pitch = 0.02, 0.05
    helix = dx.Helix(a, pitch, handed)
    turn = np.hypot(2.0 * np.pi * a, pitch)
    rod = dx.Rod(turn, dx.Stiffness(EI1=1.0, GJ=0.7), natural=helix)
    solution = dx.solve(dx.Equilibrium(rod, start=dx.Clamped(frame=helix.frame((0, 0, 1)))), dx.Shooting())
    np.testing.assert_allclose(solution.tip, (0, 0, pitch), atol=1e-12)
    s = np.linspace(0.0, turn, 50)
    d1 = solution.R(s)[:, :, 0]
    axis_distance = solution.r(s) + a * d1  # d1 points to the axis, a away
    np.testing.assert_allclose(axis_distance[:, :2], np.broadcast_to(axis_distance[0, :2], (50, 2)), atol=1e-12)
    r0, r1 = (solution.r(x) - axis_distance[0] for x in (0.0, 0.1 * turn))
    assert np.sign(np.cross(r0, r1)[2]) == (1.0 if handed == "right" else -1.0)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1.0, np.pi - 1e-9, np.pi])
def test_smallest_rotation_on_both_sides_of_its_limits(angle: float) -> None:
    a, b = np.array([0.0, 0.0, 1.0]), np.array([np.sin(angle), 0.0, np.cos(angle)])
    Q = smallest_rotation(a, b)
    np.testing.assert_allclose(Q @ a, b, atol=1e-15)
    np.testing.assert_allclose(Q.T @ Q, np.eye(3), atol=1e-14)
    assert np.linalg.det(Q) == pytest.approx(1.0)
    assert np.trace(Q) == pytest.approx(1.0 + 2.0 * np.cos(angle), abs=1e-14)


def test_loads_are_affine_in_position_and_frame() -> None:
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7, mass=2.0))
    w, point = np.array([1.0, 2.0, 3.0]), np.array([0.5, 0.0, 0.0])
    loads = [
        dx.Gravity(), dx.Rotation(w, point), dx.ElectricField((0, 1, 0), lambda s: s),
        dx.LineForce((1, 0, 0), frame="section"), dx.LineCouple((0, 0, 1)), dx.LineCouple((0, 1, 0), frame="section"),
    ]  # fmt: skip
    total = dx.Equilibrium(rod, loads=loads).distributed(S)
    rng = np.random.default_rng(1)
    r, R = rng.normal(size=(3, 3)), np.linalg.qr(rng.normal(size=(3, 3, 3)))[0]
    expected = (
        2.0 * np.array([0, 0, -9.81]) - 2.0 * np.cross(w, np.cross(w, r - point)) + S[:, None] * [0, 1, 0] + R[:, :, 0]
    )
    np.testing.assert_allclose(total.force(r, R), expected, atol=1e-13)
    np.testing.assert_allclose(total.couple(R), np.array([0, 0, 1]) + R[:, :, 1], atol=1e-15)


@pytest.mark.parametrize("y", [0.0, 5e-324, 2.2250738585072014e-308, 1e-159, 1e-9])
def test_a_tangent_opposite_to_e3_has_an_orthonormal_frame(y: float) -> None:
    R = dx.Clamped(tangent=(0, y, -1)).R
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(R[:, 2], (0, y, -1), atol=1e-15)
