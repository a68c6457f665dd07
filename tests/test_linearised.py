"""Newton's equations as one matrix: transposed, with borders at folds and bifurcations, tangents and gradients from it."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest

import darboux as dx
from darboux.errors import InvalidInput, NotConverged
from darboux.statics import rates
from darboux.statics.collocation_equations import Equations
from darboux.statics.linearised import Linearised
from darboux.statics.mesh import Mesh, stage_points
from tests.test_rates import CASES, equilibrium

Array = np.ndarray

SOLVED = 1e-12  # of the residual, over the right side
EULER = np.pi**2 / 4.0  # L^2 / EI: clamped and free


def solved_problem(name: str) -> Linearised:
    at = equilibrium(name)
    return Linearised(at.equations, at.mesh)


ALL_KINDS = [
    "point moments",
    "between the ends",
    "ring",
    "groove",
    "spring",
    "coupled section",
    "stretch under what goes by place",
]


@pytest.mark.parametrize("name", ALL_KINDS)
def test_the_whole_matrix_gives_newtons_step(name: str) -> None:
    """The tangent by the load factor, too: but for springs and grooves, whose rows the sweep takes by differences of order 2."""
    linearised = solved_problem(name)
    mesh = linearised.mesh
    mesh = Mesh(mesh.x, mesh.y + 1e-3 * np.sin(np.arange(mesh.y.size)).reshape(mesh.y.shape), mesh.Y.copy())
    step = linearised.equations.newton_step(mesh, 1.0)
    assert step is not None
    linearised = Linearised(linearised.equations, mesh, responds=False)
    found = linearised.plain.solve(-np.stack([linearised.residual, linearised.by_load_factor], axis=1))
    close = 1e-6 if name in ("groove", "spring") else 1e-10
    for side, wanted in enumerate((step.delta, step.tangent)):
        np.testing.assert_allclose(
            found[:, side].reshape(-1, 12), wanted, atol=close * np.max(np.abs(wanted)), rtol=0.0
        )
    assert np.sign(linearised.plain.pivot) == step.sign


@pytest.mark.parametrize("name", ALL_KINDS)
def test_the_transposed_matrix_is_solved(name: str) -> None:
    linearised, rng = solved_problem(name), np.random.default_rng(2)
    c = rng.normal(size=(linearised.size, 3))
    z = linearised.plain.solve_transposed(c)
    A = linearised.dense()
    np.testing.assert_allclose(z.T @ A, c.T, atol=SOLVED * np.max(np.abs(A.T) @ np.abs(z)), rtol=0.0)
    b = rng.normal(size=(linearised.size, 3))
    x = linearised.plain.solve(b)
    np.testing.assert_allclose(A @ x, b, atol=SOLVED * np.max(np.abs(A) @ np.abs(x)), rtol=0.0)
    np.testing.assert_allclose(z.T @ b, c.T @ x, rtol=1e-9)


@pytest.mark.parametrize("name", CASES)
def test_gradients_are_the_tangents(name: str) -> None:
    at, rng = equilibrium(name), np.random.default_rng(3)
    tangents = rates.tangents(at.equations, at.mesh, at.case.of, at.p, at.sizes)
    w = rng.normal(size=(2, *tangents.y.shape))
    found = rates.gradients(at.equations, at.mesh, at.case.of, at.p, w, at.sizes)
    terms = np.einsum("mni,pni->mp", np.abs(w), np.abs(tangents.dy))
    np.testing.assert_allclose(found / terms, np.einsum("mni,pni->mp", w, tangents.dy) / terms, atol=1e-10, rtol=0.0)


def test_the_energy_of_an_elastica_knows_its_tip() -> None:
    """Castigliano and Engesser: with Pi = E - P.r(L) at equilibrium, dPi/dP = -r(L), so the tangents are minus its Hessian."""
    P = np.array([3.0, -1.0, 2.0])

    def problem_of(p: Array) -> dx.Equilibrium:
        return dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.4, GJ=0.75)), loads=[dx.EndForce(tuple(p))])

    equations, mesh = rates.settled(dx.solve(problem_of(P)))
    tangents = rates.tangents(equations, mesh, problem_of, P)
    tip = tangents.dy[:, -1, :3]
    np.testing.assert_allclose(tip, tip.T, atol=1e-11 * np.max(np.abs(tip)), rtol=0.0)
    h, weights = 0.08, (-49.0 / 18.0, 3.0 / 2.0, -3.0 / 20.0, 1.0 / 90.0)  # of the second derivative, of order 6
    second = 0.0
    for a in range(-3, 4):
        force = P + a * h * np.array([1.0, 0.0, 0.0])
        second += weights[abs(a)] / h**2 * dx.solve(problem_of(force), dx.Collocation(rtol=1e-12)).energy.total
    np.testing.assert_allclose(second, -tip[0, 0], rtol=1e-9)


# -- a fold ------------------------------------------------------------------------------------------------------------

ARCH = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=5.0, GJ=4.0, EA=2000.0), natural=(0.9, 0.0, 0.0), stretch=True)
FOOT = dx.Clamped(tangent=(0, 0, 1))


def crown(depth: float) -> Any:
    """Half of a shallow arch: its crown keeps its direction and moves along the load alone."""
    theta = 0.9
    at = (0.0, -(1.0 - np.cos(theta)) / 0.9, np.sin(theta) / 0.9)
    tangent = (0.0, -np.sin(theta), np.cos(theta))
    along = (0.0, -np.cos(theta), -np.sin(theta))  # towards the centre
    return at, tangent, tuple(np.array(at) + depth * np.array(along)), along


def by_depth(p: Array) -> dx.Equilibrium:
    _, tangent, place, _ = crown(float(p[0]))
    return dx.Equilibrium(ARCH, start=FOOT, end=dx.Clamped(position=place, tangent=tangent))


def by_load(depth: float, P: float) -> dx.Equilibrium:
    at, tangent, _, along = crown(depth)
    load = dx.EndForce(tuple(P * np.array(along)))
    return dx.Equilibrium(ARCH, start=FOOT, end=dx.Slider(along=along, position=at, tangent=tangent), loads=[load])


@functools.cache
def fold() -> tuple[float, float, Mesh]:
    """Depth and load of the crown where the load is largest, by displacements, which have no fold there; and the mesh."""
    _, mesh = rates.settled(dx.solve(by_depth([0.02])))
    along = np.array(crown(0.0)[3])

    def slope(depth: float, mesh: Mesh) -> tuple[float, Mesh]:
        equations = Equations(by_depth([depth]), 4)
        found = equations.newton(mesh, 1.0, 1e-14, 20)
        assert found is not None
        tangents = rates.tangents(equations, found[0], by_depth, np.array([depth]), np.array([0.1]))
        return float(tangents.dy[0, -1, 7:10] @ along), found[0]

    a, (before, mesh) = 0.02, slope(0.02, mesh)
    while True:
        b = a + 0.01
        behind, there = slope(b, mesh)
        if before * behind < 0.0:
            break
        a, before, mesh = b, behind, there
        assert b < 0.9
    for _ in range(12):  # secants
        c = b - behind * (b - a) / (behind - before)
        a, before = b, behind
        b, (behind, mesh) = c, slope(c, mesh)
        if abs(b - a) < 1e-14 or behind == before:
            break
    scale = Equations(by_depth([b]), 4).scale
    return b, float(mesh.y[-1, 7:10] @ along) * scale.force, mesh


def test_at_a_fold_borders_are_sound_and_plain_solves_are_not() -> None:
    depth, P, mesh = fold()
    linearised = Linearised(Equations(by_load(depth, P), 4), mesh)
    assert np.max(np.abs(linearised.residual)) < 1e-11
    A, rng = linearised.dense(), np.random.default_rng(5)
    sizes = np.linalg.svd(A)[1]
    assert sizes[-1] < 1e-11 * sizes[-2]
    check_singular(linearised, A, 1, rng)


def check_singular(linearised: Linearised, A: Array, k: int, rng: np.random.Generator) -> None:
    n = linearised.size
    right, left, tau = linearised.null_vectors(k)
    assert np.max(np.abs(A @ right)) < 1e-10 * np.max(np.abs(A))
    assert np.max(np.abs(left.T @ A)) < 1e-10 * np.max(np.abs(A))
    np.testing.assert_allclose(tau, 0.0, atol=1e-10, rtol=0.0)
    np.testing.assert_allclose([right.T @ right, left.T @ left], [np.eye(k)] * 2, atol=1e-13, rtol=0.0)
    b = rng.normal(size=(n + k, 2))
    for columns, rows in ((left, right.T), (rng.normal(size=(n, k)), rng.normal(size=(k, n)))):
        M = np.block([[A, columns], [rows, np.zeros((k, k))]])
        found = linearised.bordered(columns, rows)
        x, z = found.solve(b), found.solve_transposed(b)
        assert np.max(np.abs(M @ x - b)) < SOLVED * np.max(np.abs(M) @ np.abs(x))
        assert np.max(np.abs(M.T @ z - b)) < SOLVED * np.max(np.abs(M.T) @ np.abs(z))
        assert np.max(np.abs(x)) < 1.01 * np.max(np.abs(np.linalg.solve(M, b)))
    plain = linearised.plain.solve(b[:n])
    assert not np.max(np.abs(A @ plain - b[:n])) < 1e-4
    assert abs(linearised.plain.pivot) < 1e-11


# -- bifurcations ------------------------------------------------------------------------------------------------------


def column(thrust: float, EI2: float) -> Linearised:
    """A straight rod, clamped and free, under a thrust: its states are known."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=EI2, GJ=0.75))
    equations = Equations(dx.Equilibrium(rod, loads=[dx.EndForce((0, 0, -thrust))]), 5)
    x = np.linspace(0.0, 1.0, 7)
    states = [np.zeros((*at.shape, 13)) for at in (x, stage_points(x, 5))]
    for y, at in zip(states, (x, stage_points(x, 5)), strict=True):
        y[..., 2], y[..., 3], y[..., 9] = at, 1.0, -thrust / equations.scale.force
    return Linearised(equations, Mesh(x, *states))


@pytest.mark.parametrize(("EI2", "k"), [(1.4, 1), (1.0, 2)], ids=["flat", "round"])
def test_at_a_columns_buckling_load_the_kernel_is_its_planes(EI2: float, k: int) -> None:
    linearised = column(EULER, EI2)
    check_singular(linearised, linearised.dense(), k, np.random.default_rng(6))
    right, _, _ = linearised.null_vectors(k)
    nodes = right.reshape(-1, 12, k)[:, :2]
    mode = 1.0 - np.cos(0.5 * np.pi * linearised.mesh.x)
    for i in range(k):
        amplitude = nodes[-1, :, i]
        np.testing.assert_allclose(nodes[:, :, i], np.outer(mode, amplitude), atol=1e-9, rtol=0.0)
    if k == 1:  # EI1 bends about d1 = x: towards y
        np.testing.assert_allclose(nodes[:, 0], 0.0, atol=1e-9, rtol=0.0)


def test_tau_changes_its_sign_where_a_column_buckles() -> None:
    """With the same borders on both sides, tau is a smooth function of the load, and 0 at the buckling load."""
    right, left, _ = column(EULER, 1.4).null_vectors(1)
    unit = np.append(np.zeros(len(right)), 1.0)[:, None]
    taus = [column(share * EULER, 1.4).bordered(left, right.T).solve(unit)[-1, 0] for share in (0.999, 1.0, 1.001)]
    assert taus[0] * taus[2] < 0.0
    assert abs(taus[1]) < 1e-10 * abs(taus[0])
    np.testing.assert_allclose(taus[0], -taus[2], rtol=1e-2)


# -- mistakes ----------------------------------------------------------------------------------------------------------


def test_a_parameter_that_is_zero_needs_a_size() -> None:
    at = equilibrium("gravity")
    with pytest.raises(InvalidInput, match="parameter 1 is 0"):
        rates.tangents(at.equations, at.mesh, at.case.of, np.array([1.0, 0.0]))


def test_what_changes_in_kind_has_no_derivative() -> None:
    def problem_of(p: Array) -> dx.Equilibrium:
        end = dx.Pinned((0.1, 0.1, 0.9)) if p[0] > 1.0 else dx.Free()
        return dx.Equilibrium(
            dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.4, GJ=0.7)), end=end, loads=[dx.LineForce((1, 0, 0))]
        )

    equations, mesh = rates.settled(dx.solve(problem_of([0.99])))
    with pytest.raises(InvalidInput, match="parameter 0: what holds the rod"):
        rates.tangents(equations, mesh, problem_of, np.array([0.99]))


def test_two_places_that_part_have_no_derivative() -> None:
    def problem_of(p: Array) -> dx.Equilibrium:
        loads = [dx.PointForce((1, 0, 0), at=0.5), dx.PointForce((0, 1, 0), at=p[0])]
        return dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.4, GJ=0.7)), loads=loads)

    equations, mesh = rates.settled(dx.solve(problem_of([0.5])))
    with pytest.raises(InvalidInput, match="parameter 0: what holds the rod, or where something jumps"):
        rates.tangents(equations, mesh, problem_of, np.array([0.5]))


def test_a_solution_of_another_problem_does_not_settle() -> None:
    solution = dx.solve(dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7)), loads=[dx.LineForce((1, 0, 0))]))
    other = dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7)), loads=[dx.LineForce((5e3, 0, 2e3))])
    object.__setattr__(solution, "problem", other)
    with pytest.raises(NotConverged, match="no derivative"):
        rates.settled(solution)
