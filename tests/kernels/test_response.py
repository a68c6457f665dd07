"""The response of elements, joints and ends: to a step of their nodes, and to parameters of many kinds."""

from __future__ import annotations

import functools

import numpy as np

import darboux as dx
from darboux.kernels.response import ORDER_8
from darboux.statics import rates
from darboux.statics.collocation_equations import Equations
from darboux.statics.linearised import Linearised
from darboux.statics.mesh import Mesh
from tests.test_rates import by_differences

Array = np.ndarray

EXACT = 1e-9  # of differences of order 6
SHARP = 1e-12  # of those along the nodes, which are smoother; rows by differences of order 2 would leave 1e-10
P = np.array([1.5, 0.2, 0.9, 0.3, 0.4, 0.1, 0.2, 0.3])


def problem_of(p: Array) -> dx.Equilibrium:
    """Length, a load of the shape, a point load's place, a spring of turns and its place, an offset, a follower load, a groove."""
    section = dx.Stiffness(EI1=1.0, EI2=1.4, GJ=0.7, EA=50.0)
    rod = dx.Rod(p[0], section, natural=(0.1, 0.2, 0.3), stretch=True)
    loads = [
        dx.LineForce(lambda s, r, R: -p[1] * r + 0.1 * R[:, :, 0], gradient=gradient(p[1])),
        dx.PointForce((0.2, 0.1, -0.1), at=p[2], offset=(p[5], 0.1, 0.0)),
        dx.LineForce((p[6], 0.1, 0.0), frame="section"),
    ]
    spring = dx.Spring(linear=p[3], rotational=[[0.5, 0.1, 0], [0.1, p[3], 0], [0, 0, 0.4]], position=(p[4], 0.0, 1.4))
    groove = dx.Roller(along=(1, p[7], 2), position=(0.02, 0.05, 0.88), sliding="section")
    return dx.Equilibrium(rod, end=spring, loads=loads, between={p[2]: groove})


def gradient(by: float):
    def of(s: Array, r: Array, R: Array) -> tuple[Array, Array]:
        turned = R @ np.array([[0.0, 0, 0], [0, 0, 0.1], [0, -0.1, 0]])
        return np.tile(-by * np.eye(3), (len(s), 1, 1)), turned

    return of


@functools.cache
def equilibrium() -> tuple[Equations, Mesh]:
    equations = Equations(problem_of(P), 2)
    x = np.array([0.0, 0.35, P[2] / P[0], 1.0])
    points = np.unique(x)
    mesh = equations.unloaded().laid(np.sort(np.append(points, P[2] / P[0])))
    found = equations.newton(mesh, 1.0, 1e-13, 20)
    assert found is not None
    return equations, found[0]


def test_rows_are_the_derivative_of_the_residual() -> None:
    """By a step of all nodes: those of a spring that turns too, to more digits than Newton's method has them."""
    equations, mesh = equilibrium()
    linearised = Linearised(equations, mesh)
    delta = np.random.default_rng(1).normal(size=(len(mesh.x), 12))
    dy = np.einsum("nij,nj->ni", rates._states_of_unknowns(mesh.y), delta)

    def residual(t: float) -> Array:
        return Linearised(equations, Mesh(mesh.x, mesh.y + t * dy, mesh.Y), responds=False).residual

    wanted = linearised.dense() @ delta.ravel()
    np.testing.assert_allclose(by_differences(residual, 4e-3), wanted, atol=SHARP * np.max(np.abs(wanted)), rtol=0.0)


def test_right_sides_are_the_derivative_of_the_residual() -> None:
    equations, mesh = equilibrium()
    by = rates.derivatives(equations, mesh, problem_of, P)
    wanted = -rates.right_sides(Linearised(equations, mesh), by)
    for k, size in enumerate(P):

        def residual(step: float, k: int = k) -> Array:
            there = P.copy()
            there[k] += step
            x = rates.packed(problem_of(there), mesh, equations.breaks).x
            return Linearised(Equations(problem_of(there), 2), Mesh(x, mesh.y, mesh.Y), responds=False).residual

        largest = np.max(np.abs(wanted[:, k]))
        np.testing.assert_allclose(by_differences(residual, 1e-3 * size), wanted[:, k], atol=EXACT * largest, rtol=0.0)


def test_a_response_to_slopes_is_what_a_load_makes_of_the_gap() -> None:
    """A change of n' alone, at all stages: gaps of n are the sum of b over the stages times the width."""
    equations, mesh = equilibrium()
    linearised = Linearised(equations, mesh)
    response = linearised.response.reshape(-1, 12, mesh.stages, 13)
    assert np.all(response[~mesh.wide] == 0.0)
    free = Equations(dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7)), loads=[dx.LineForce((0.1, 0, 0))]), 2)
    mesh = free.newton(free.unloaded(), 1.0, 1e-13, 20)[0]
    response = Linearised(free, mesh).response.reshape(-1, 12, mesh.stages, 13)
    sums = np.sum(response[:, 6:9, :, 7:10], axis=2)
    np.testing.assert_allclose(sums, np.diff(mesh.x)[:, None, None] * np.eye(3), atol=1e-14, rtol=0.0)


def test_the_weights_are_exact_up_to_the_eighth_power() -> None:
    k = np.arange(1.0, 5.0)
    for power in range(1, 9):
        total = np.sum(ORDER_8 * (k**power - (-k) ** power))
        np.testing.assert_allclose(total, 1.0 if power == 1 else 0.0, atol=1e-12 * 4.0**power, rtol=0.0)


def test_the_mesh_stretches_with_its_breaks() -> None:
    """A node keeps its share of the piece that it is on, and a station's node goes with the load."""
    equations, mesh = equilibrium()
    there = P.copy()
    there[[0, 2]] = 1.6, 0.8
    x = rates.packed(problem_of(there), mesh, equations.breaks).x
    at, moved = P[2] / P[0], 0.8 / 1.6
    np.testing.assert_allclose(x, [0.0, 0.35 * moved / at, moved, moved, 1.0], atol=1e-15, rtol=0.0)


def test_tangents_are_the_derivative_of_the_solution() -> None:
    equations, mesh = equilibrium()
    tangents = rates.tangents(equations, mesh, problem_of, P)
    for k, size in enumerate(P):

        def solved(step: float, k: int = k) -> Array:
            there = P.copy()
            there[k] += step
            x = rates.packed(problem_of(there), mesh, equations.breaks).x
            other = Equations(problem_of(there), 2)
            found = other.newton(Mesh(x, mesh.y, mesh.Y), 1.0, 1e-13, 20)
            assert found is not None
            return found[0].y * np.repeat(
                [other.scale.length, 1.0, other.scale.force, other.scale.moment], [3, 4, 3, 3]
            )

        largest = np.max(np.abs(tangents.dy[k]))
        np.testing.assert_allclose(by_differences(solved, 1e-3 * size), tangents.dy[k], atol=EXACT * largest, rtol=0.0)
