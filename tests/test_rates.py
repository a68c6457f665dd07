"""The derivative of an equilibrium by every kind of parameter, against differences of solves at 1e-12."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import darboux as dx
from darboux.statics.collocation_equations import Equations
from darboux.statics.rates import Linearised

Array = Any
EXACT = dx.Collocation(rtol=1e-12, stages=5)
PLACES = np.array([0.0, 0.13, 0.37, 0.56, 0.81, 1.0])  # of the length
SIDE = (0.3, -0.2, 0.1)
MIDDLE = 1.0  # m


def rod(length: float = 2.0, EI: float = 3.0, k: float = 0.3, mass: float = 1.5, **more: Any) -> dx.Rod:
    section = dx.Stiffness(EI1=EI, EI2=4.2, GJ=2.2, EA=90.0, mass=mass)
    return dx.Rod(length, section, natural=(k, 0.2, 0.4), **more)


def held(load: Any, **more: Any) -> dx.Equilibrium:
    return dx.Equilibrium(rod(**more), loads=[dx.EndForce(SIDE), load])


def between(place: float = 0.2, twist: float = 0.0) -> dx.Equilibrium:
    end = dx.Clamped(position=(place, 0.1, 1.7), tangent=(0, 0.2, 1), twist=twist)
    return dx.Equilibrium(rod(), end=end, loads=[dx.Gravity((0.0, 0.3, 0.0))])


def on_stations(at: float = MIDDLE, length: float = 2.0, y: float = 0.1) -> dx.Equilibrium:
    loads = [dx.EndForce(SIDE), dx.PointForce((0.2, -0.4, 0.1), at=at, offset=(0.0, 0.1, 0.0))]
    spring = dx.Spring(linear=3.0, position=(0.0, y, 1.4))
    return dx.Equilibrium(rod(length), loads=loads, between={1.5: spring})


def of_circle(radius: float = 1e-3, E: float = 1e6, density: float = 1e3, length: float = 0.25) -> dx.Equilibrium:
    material = dx.Material(E=E, nu=0.5, density=density)
    filament = dx.Rod(length, dx.Circle(radius=radius), material, stretch=True)
    return dx.Equilibrium(filament, start=dx.Clamped(tangent=(1, 0, 0)), loads=[dx.Gravity()])


def of_table(value: float) -> dx.Equilibrium:
    bending = dx.Table([0.0, 0.7, 1.3, 2.0], [3.0, value, 2.0, 4.0])
    section = dx.Stiffness(EI1=bending, EI2=4.2, GJ=2.2)
    return dx.Equilibrium(dx.Rod(2.0, section), loads=[dx.EndForce(SIDE)])


def turned(p: float) -> dx.Equilibrium:
    """The clamp at the start turns about x, and moves."""
    start = dx.Clamped(position=(0.1 * p, 0.0, p), tangent=(0.0, np.sin(p), np.cos(p)), d1=(1, 0, 0))
    return dx.Equilibrium(rod(), start=start, end=dx.Pinned((0.1, 0.6, 1.6)), loads=[dx.EndMoment((0.1, 0.2, 0.1))])


KINDS: dict[str, tuple[Callable[[float], dx.Equilibrium], float]] = {
    "end force": (lambda p: held(dx.EndForce((0, p, 0))), 0.4),
    "end moment": (lambda p: held(dx.EndMoment((0, p, 0))), 0.4),
    "follower force": (lambda p: held(dx.EndForce((0, p, 0), follower=True)), 0.4),
    "follower moment": (lambda p: held(dx.EndMoment((0, p, 0.2), follower=True)), 0.4),
    "offset": (lambda p: held(dx.EndForce((0, 0.3, 0.2), offset=(p, 0.1, 0.0))), 0.2),
    "weight": (lambda p: held(dx.Gravity((0, p, 0))), 0.4),
    "line force": (lambda p: held(dx.LineForce((0, p, 0))), 0.4),
    "pressure": (lambda p: held(dx.LineForce((0, p, 0), frame="section")), 0.4),
    "line couple": (lambda p: held(dx.LineCouple((0, p, 0))), 0.4),
    "varying force": (lambda p: held(dx.LineForce(lambda s: np.stack([0 * s, p * s, 0.1 + 0 * s], axis=-1))), 0.3),
    "charge": (lambda p: held(dx.ElectricField((0, 2.0, 0), charge_per_length=p)), 0.2),
    "rotation": (lambda p: held(dx.Rotation(omega=(0.0, 0.2, p))), 0.6),
    "foundation": (lambda p: held(dx.Foundation(p, point=(0.1, 0, 0))), 2.0),
    "function of the shape": (lambda p: held(dx.LineForce(lambda s, r, R: p * (0.2 - r) + 0.3 * R[:, :, 1])), 0.5),
    "length": (lambda p: held(dx.Gravity((0, 0.3, 0)), length=p), 2.0),
    "EI": (lambda p: held(dx.Gravity((0, 0.3, 0)), EI=p), 3.0),
    "natural curvature": (lambda p: held(dx.Gravity((0, 0.3, 0)), k=p), 0.3),
    "mass": (lambda p: held(dx.Gravity((0, 0.3, 0)), mass=p), 1.5),
    "mass of a rod that stretches": (lambda p: held(dx.Gravity((0, 0.3, 0)), mass=p, stretch=True), 1.5),
    "radius": (lambda p: of_circle(radius=p), 1e-3),
    "E": (lambda p: of_circle(E=p), 1e6),
    "density": (lambda p: of_circle(density=p), 1e3),
    "length of a filament": (lambda p: of_circle(length=p), 0.25),
    "a Table's value": (of_table, 2.5),
    "place of an end": (lambda p: between(place=p), 0.2),
    "twist": (lambda p: between(twist=p), 0.7),
    "turned start": (turned, 0.2),
    "spring": (
        lambda p: dx.Equilibrium(rod(), end=dx.Spring(linear=p, position=(0.2, 0, 1.8)), loads=[dx.Gravity((0, 1, 0))]),
        2.0,
    ),
    "turning spring": (lambda p: dx.Equilibrium(rod(), end=dx.Spring(rotational=p), loads=[dx.EndForce(SIDE)]), 1.5),
    "place of a point load": (lambda p: on_stations(at=p), 1.0),
    "place of a support between": (lambda p: on_stations(y=p), 0.1),
    "length beside stations": (lambda p: on_stations(length=p), 2.0),
}


def linearised(problem: dx.Equilibrium) -> Linearised:
    """About the solution on a mesh that holds the places."""
    equations, solution = Equations(problem, 5), dx.solve(problem, EXACT)
    mesh = equations.mesh_of(solution).halved()
    x = np.concatenate(
        [np.setdiff1d(np.union1d(mesh.x, PLACES), mesh.x[mesh.joints]), np.repeat(mesh.x[mesh.joints], 2)]
    )
    found = equations.newton(mesh.laid(np.sort(x)), 1.0, 1e-12, 12)
    assert found is not None
    return Linearised(problem, found[0])


def states(problem_of: Callable[[float], dx.Equilibrium], p: float, at: float) -> Array:
    """The states at the places, at parameter `at`, as a share of each part between the breaks, which move with it."""
    problem, moved = problem_of(p), problem_of(at)
    own, ends = ([0.0, *(s / x.rod.length for s in x.breaks), 1.0] for x in (problem, moved))
    solution = dx.solve(moved, EXACT)
    s = np.interp(PLACES, own, ends) * moved.rod.length
    return np.concatenate([solution.r(s), solution.n(s), solution.m(s)], axis=1)


@pytest.mark.parametrize("name", KINDS)
def test_the_derivative_is_that_of_solves(name: str) -> None:
    """Against differences of order 4; solves are good to 1e-12, so that these are to some 1e-9 of the change."""
    problem_of, p = KINDS[name]
    lines = linearised(problem_of(p))
    dy = lines.tangent(problem_of, p)
    at = np.searchsorted(lines.mesh.x, PLACES)
    found = np.concatenate([dy[at, :3], dy[at, 7:]], axis=1)
    h = 4e-3 * p
    ahead, further, behind, back = (states(problem_of, p, p + step) for step in (h, 2 * h, -h, -2 * h))
    exact = (8.0 * (ahead - behind) - (further - back)) / (12.0 * h)
    for part in (slice(0, 3), slice(3, 6), slice(6, 9)):
        size = max(float(np.max(np.abs(exact[:, part]))), 1e-3 * float(np.max(np.abs(ahead[:, part]))) / p)
        np.testing.assert_allclose(found[:, part], exact[:, part], atol=2e-7 * size, rtol=0.0)


@pytest.mark.parametrize("name", ["EI", "twist", "length beside stations", "function of the shape"])
def test_what_a_step_leaves_over_falls_with_its_square(name: str) -> None:
    """|y(p + h) - y(p) - h dy/dp| is C h^2: halving h divides it by four."""
    problem_of, p = KINDS[name]
    lines = linearised(problem_of(p))
    at = np.searchsorted(lines.mesh.x, PLACES)
    dy = lines.tangent(problem_of, p)[at]
    here = states(problem_of, p, p)
    left = []
    for h in (4e-3 * p, 2e-3 * p, 1e-3 * p):
        change = states(problem_of, p, p + h) - here
        left.append(float(np.max(np.abs(change - h * np.concatenate([dy[:, :3], dy[:, 7:]], axis=1)))))
    for larger, smaller in pairwise(left):
        assert 3.8 < larger / smaller < 4.2


@pytest.mark.parametrize("name", ["EI", "twist", "place of a point load", "rotation"])
def test_the_adjoint_gives_what_the_tangent_gives(name: str) -> None:
    """An output o . y: o . A^-1 right = z . right, with A^T z = o."""
    problem_of, p = KINDS[name]
    lines = linearised(problem_of(p))
    right = lines.change(problem_of, p).right
    outputs = np.random.default_rng(0).normal(size=right.shape)
    forward, back = float(np.sum(outputs * lines.solved(right))), float(np.sum(lines.adjoint(outputs) * right))
    assert abs(forward - back) < 1e-10 * max(abs(forward), float(np.sum(np.abs(lines.adjoint(outputs) * right))))


def test_the_elements_carry_what_the_kernels_carry() -> None:
    """T of NumPy's stages against `transfers`, whose rotations are in the fixed frame."""
    from darboux import frames
    from darboux.kernels import collocation

    problem = held(dx.Foundation(2.0, point=(0.1, 0, 0)))
    lines, equations = linearised(problem), Equations(problem, 5)
    T = np.empty((lines.mesh.elements, 12, 12))
    collocation.transfers(equations._system(lines.mesh, 1.0), T.ravel())
    R = frames.matrix_of_quaternion(lines.mesh.y[:, 3:7])
    ours = lines.T.copy()
    ours[:, 3:6] = np.einsum("nij,njk->nik", R[1:], ours[:, 3:6])
    ours[:, :, 3:6] = np.einsum("nik,njk->nij", ours[:, :, 3:6], R[:-1])
    np.testing.assert_allclose(ours, T, atol=1e-11 * np.max(np.abs(T)))
