"""Derivatives of an equilibrium by parameters of its description: Taylor tests of residual and solution, under all that there is.

The solution is solved anew at other parameters, on the mesh that stretches with the breaks, to rounding. Along the tangent it
must leave what falls with the square of the step, and differences of order 6 must agree with the tangent.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

import darboux as dx
from darboux.statics import rates
from darboux.statics.collocation_equations import Equations
from darboux.statics.linearised import Linearised
from darboux.statics.mesh import Mesh

Array = np.ndarray

STAGES = 3
EXACT = 1e-9  # what differences of order 6 leave over, relative to the derivative's largest number
ROUNDING = 1e-3  # of numbers about 1: what is smaller than EXACT times this is zero
SMALL = 1e-3  # of a parameter's size: their step

SECTION = dx.Stiffness(EI1=3.0, EI2=4.2, GJ=2.2, EA=90.0, mass=1.5)
BENT = dx.Rod(2.0, SECTION, natural=(0.3, 0.2, 0.4))
STRETCHING = dataclasses.replace(BENT, stretch=True)
SHEARING = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.4, GJ=0.7, EA=30.0, GA1=20.0, GA2=15.0), stretch=True, shear=True)
LOAD = dx.LineForce((1.0, 0.8, -0.6))
OFFSET = (0.2, -0.1, 0.3)
K = np.diag([60.0, 50.0, 80.0, 1.0, 1.4, 0.75]) + 0.15 * np.random.default_rng(4).normal(size=(6, 6))


class Case(NamedTuple):
    """A description with parameters, where they stand, and their sizes."""

    of: Callable[[Array], dx.Equilibrium]
    p: tuple[float, ...]
    sizes: tuple[float, ...] | None = None


def loaded(*loads: Any, rod: dx.Rod = BENT, **more: Any) -> dx.Equilibrium:
    return dx.Equilibrium(rod, loads=loads, **more)


def held(support: Any) -> dx.Equilibrium:
    return loaded(LOAD, end=support)


def turned(a: float, b: float) -> tuple[float, float, float]:
    return (float(np.sin(a)), float(np.sin(b)), 1.0)


def with_section(rod: dx.Rod, **changes: float) -> dx.Rod:
    return dataclasses.replace(rod, section=dataclasses.replace(rod.section, **changes))


def round_rod(radius: float, E: float, nu: float, density: float) -> dx.Equilibrium:
    rod = dx.Rod(0.3, dx.Circle(radius), dx.Material(E=E, nu=nu, density=density), natural=(1.0, 0.0, 0.5))
    return loaded(dx.Gravity((1, 2, -5)), dx.EndForce((1e-3, 0.0, 2e-3)), rod=rod)


def coupled(p: Array) -> dx.Equilibrium:
    matrix = 0.5 * (K + K.T)
    matrix[0, 4], matrix[4, 0] = p[0], p[0]
    matrix[3, 3] = p[1]
    rod = dx.Rod(1.0, dx.StiffnessMatrix(matrix, mass=1.0), stretch=True, shear=True)
    return loaded(LOAD, dx.EndMoment((0.3, -0.2, 0.4), follower=True), rod=rod)


def tables(p: Array) -> dx.Equilibrium:
    """Rows of a stiffness, of a natural curvature and of a load."""
    s = np.linspace(0.0, 1.0, 5)
    k0, f = np.tile([0.3, 0.2, 0.4], (5, 1)), np.tile([1.0, -0.5, 0.2], (5, 1))
    k0[2, 0], f[3, 1] = p[1], p[2]
    section = dx.Stiffness(EI1=dx.Table(s, [2.0, p[0], 1.4, 1.3, 1.0]), EI2=1.3, GJ=0.8)
    rod = dx.Rod(1.0, section, natural=dx.Table(s, k0, "linear"))
    return loaded(dx.LineForce(dx.Table(s, f)), rod=rod)


def steps(p: Array) -> dx.Equilibrium:
    """Jumps, at a place that is a parameter: of a stiffness by a table, of a load by another one."""
    EI = dx.Table([0.0, p[0], p[0], 1.0], [2.0, 2.0, 1.0, 1.0], "linear")
    f = dx.Table([0.0, 0.6, 0.6, 1.0], [[0, 0, 0], [0, 0, 0], [p[1], 2, 0], [p[1], 2, 0]], "linear")
    return loaded(dx.LineForce(f), rod=dx.Rod(1.0, dx.Stiffness(EI1=EI, EI2=1.3, GJ=0.8)))


def dense(p: Array) -> dx.Equilibrium:
    """A load of so many rows that they are averaged."""
    s = np.linspace(0.0, 1.0, 900)
    f = np.stack([p[0] * np.sin(40.0 * s), 1.0 + s, p[1] * (s > 0.5)], axis=1)
    return loaded(dx.LineForce(dx.Table(s, f)), rod=dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.3, GJ=0.8)))


def long(p: Array) -> dx.Equilibrium:
    """With a load at a place in m, and a foundation whose rest is a function of s."""
    loads = [
        dx.PointForce((2, 1, -1), at=0.8),
        dx.Foundation(3.0, direction=(0.1, 0, 1)),
        dx.ElectricField((1, 2, 0), np.cos),
    ]
    return loaded(*loads, rod=dx.Rod(p[0], SECTION, natural=lambda s: np.stack([s, 0.2 + 0 * s, s**2], axis=1)))


def between(p: Array) -> dx.Equilibrium:
    supports = {p[0]: dx.Pinned((0.1, p[1], 0.7)), 1.4: dx.Spring(linear=p[2], position=(0.1, 0, 1.2))}
    return loaded(LOAD, dx.PointMoment((0.1, 0.2, 0.3), at=p[0]), between=supports)


def ring(p: Array) -> dx.Equilibrium:
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.3, GJ=p[1]), natural=(0.3, p[2], 0.0))
    return dx.Ring(rod, link=p[0], start=dx.Clamped(tangent=(1, 0, 0)), loads=[dx.LineForce((0, 3.0, -20.0))])


AT = (0.1, 0.1, 1.7)
CASES = {
    "gravity": Case(lambda p: loaded(dx.Gravity((p[0], 0.5, p[1]))), (1.0, -2.0)),
    "line force": Case(lambda p: loaded(dx.LineForce((p[0], p[1], -0.6))), (1.0, 0.8)),
    "line force that varies": Case(
        lambda p: loaded(dx.LineForce(lambda s: np.stack([p[0] * s, 1.0 - s**2, np.cos(p[1] * s)], axis=1))), (1.0, 2.0)
    ),
    "line force, follower": Case(lambda p: loaded(dx.LineForce((p[0], p[1], -1), frame="section")), (2.0, 1.0)),
    "line couple": Case(lambda p: loaded(dx.LineCouple((p[0], 1, p[1]))), (0.5, 0.4)),
    "line couple, follower": Case(lambda p: loaded(dx.LineCouple((p[0], 1, p[1]), frame="section")), (0.5, 0.4)),
    "force of the shape": Case(
        lambda p: loaded(dx.LineForce(lambda s, r, R: -p[0] * r + p[1] * R[:, :, 0] * s[:, None])), (2.0, 1.0)
    ),
    "couple of the shape": Case(
        lambda p: loaded(dx.LineCouple(lambda s, r, R: p[0] * np.cross(R[:, :, 2], r + p[1]))), (0.9, 0.3)
    ),
    "foundation": Case(
        lambda p: loaded(dx.Foundation([[p[0], 1, 0], [1, 4, 0], [0, 0, 5]], point=(p[1], 0, 0), direction=turned(p[2], 0))),
        (3.0, 0.1, 0.1),
    ),
    "buoyancy": Case(lambda p: loaded(dx.Buoyancy(density=p[0], area=p[1], g=(0, 1, -1))), (3.0, 1.0)),
    "rotation": Case(lambda p: loaded(dx.Rotation((0.3, p[0], 1), (p[1], 0.1, 0))), (1.0, 0.3)),
    "electric field": Case(lambda p: loaded(dx.ElectricField((p[0], 2, 0), lambda s: 1.0 + p[1] * s)), (1.0, 1.0)),
    "end force off the centre": Case(lambda p: loaded(dx.EndForce((p[0], 1, -1), offset=(p[1], -0.1, 0.3))), (1.0, 0.2)),
    "end force, follower": Case(
        lambda p: loaded(dx.EndForce((p[0], 1, -1), follower=True, offset=(p[1], -0.1, 0.3))), (1.0, 0.2)
    ),
    "end moment": Case(lambda p: loaded(dx.EndMoment((p[0], 0.5, p[1]))), (1.0, 0.6)),
    "end moment, follower": Case(lambda p: loaded(dx.EndMoment((p[0], 0.5, p[1]), follower=True)), (1.0, 0.6)),
    "point force": Case(
        lambda p: loaded(dx.PointForce((p[0], 1, -1), at=p[1], offset=OFFSET), dx.LineForce((0, 1, 0))), (2.0, 1.1)
    ),
    "point force, follower": Case(
        lambda p: loaded(dx.PointForce((p[0], 1, -1), at=p[1], follower=True, offset=OFFSET)), (2.0, 1.1)
    ),
    "point moments": Case(
        lambda p: loaded(dx.PointMoment((p[0], 1, 0.3), at=0.7), dx.PointMoment((0.2, p[1], 0.3), at=p[2], follower=True)),
        (0.5, 0.4, 1.3),
    ),
    "clamped end": Case(
        lambda p: held(dx.Clamped(position=(p[0], 0.2, 1.6), tangent=turned(p[1], 0.1), twist=p[2])),
        (0.1, 0.1, 0.7),
        (1.0, 1.0, 1.0),
    ),
    "twist from nothing": Case(lambda p: held(dx.Clamped(position=(0.1, 0.2, 1.6), twist=p[0])), (0.0,), (1.0,)),
    "pinned end": Case(lambda p: held(dx.Pinned(position=(0.1, p[0], p[1]))), (0.1, 1.7)),
    "roller": Case(lambda p: held(dx.Roller(along=(1, p[0], 2), position=(0, 0.1, p[1]))), (0.3, 1.7), (1.0, 1.0)),
    "groove": Case(
        lambda p: held(dx.Roller(along=(1, p[0], 2), position=(0, 0.1, p[1]), sliding="section")), (0.3, 1.7), (1.0, 1.0)
    ),
    "hinge": Case(lambda p: held(dx.Hinge(axis=(1, p[0], 0), position=(0, p[1], 1.7))), (2.0, 0.1), (1.0, 1.0)),
    "universal": Case(
        lambda p: held(dx.Universal(axis=(1, 0, 0), section_axis=(0, 1, 0), position=(0, p[0], 1.7), tangent=turned(0, p[1]))),
        (0.1, 0.2),
        (1.0, 1.0),
    ),
    "slider": Case(lambda p: held(dx.Slider(along=(1, p[0], 2), position=AT, twist=p[1])), (0.3, 0.4), (1.0, 1.0)),
    "guided": Case(lambda p: held(dx.Guided(tangent=turned(p[0], 0), twist=p[1])), (0.2, 0.3), (1.0, 1.0)),
    "spring": Case(
        lambda p: held(
            dx.Spring(
                linear=[[p[0], 1, 0], [1, 4, 0], [0, 0, 5]],
                rotational=[[2, 0, 1], [0, p[1], 0], [1, 0, 4]],
                position=(0, p[2], 1.7),
                tangent=turned(p[3], 0),
            )
        ),
        (3.0, 3.0, 0.2, 0.1),
        (1.0, 1.0, 1.0, 1.0),
    ),
    "start": Case(
        lambda p: loaded(LOAD, start=dx.Clamped(position=(p[0], 0.1, 0), tangent=turned(p[1], 0.1), twist=p[2])),
        (0.2, 0.3, 0.4),
        (1.0, 1.0, 1.0),
    ),
    "hinged start": Case(
        lambda p: loaded(LOAD, start=dx.Hinge(axis=(1, p[0], 0)), end=dx.Pinned((p[1], 0.1, 1.7))), (2.0, 0.1), (1.0, 1.0)
    ),
    "stiffnesses": Case(
        lambda p: loaded(LOAD, dx.Gravity((1, 0, -2)), rod=with_section(BENT, EI1=p[0], EI2=p[1], GJ=p[2], mass=p[3])),
        (3.0, 4.2, 2.2, 1.5),
    ),
    "natural shape": Case(
        lambda p: loaded(LOAD, rod=dataclasses.replace(BENT, natural=(p[0], p[1], p[2]))), (0.0, 0.2, 0.4), (1.0, 1.0, 1.0)
    ),
    "radius, E, nu, density": Case(lambda p: round_rod(*p), (2e-3, 1e6, 0.4, 1e3)),
    "stretch and shear": Case(
        lambda p: loaded(LOAD, dx.EndForce((0, 1, 3)), rod=with_section(SHEARING, EA=p[0], GA1=p[1])), (30.0, 20.0)
    ),
    "stretch under what goes by place": Case(
        lambda p: loaded(dx.Foundation(p[0]), dx.EndForce((1, 0, 2)), rod=with_section(STRETCHING, EA=p[1])), (3.0, 90.0)
    ),
    "coupled section": Case(coupled, (0.1, 1.0), (1.0, 1.0)),
    "tables": Case(tables, (1.8, 0.35, -0.6)),
    "dense rows": Case(dense, (2.0, 1.0)),
    "jumps": Case(steps, (0.4, 2.0)),
    "jump of a function": Case(
        lambda p: loaded(dx.LineForce(lambda s: np.where(s[:, None] < p[0], [1.0, 0.5, 0.2], [0.0, p[1], 0.1]))), (0.9, 2.0)
    ),
    "length": Case(long, (2.0,)),
    "between the ends": Case(between, (0.9, 0.1, 5.0), (1.0, 1.0, 5.0)),
    "ring": Case(ring, (0.4, 0.75, 1.0)),
}  # fmt: skip


class At(NamedTuple):
    """A case, and where its equilibrium is."""

    case: Case
    p: Array
    sizes: Array
    equations: Equations
    mesh: Mesh


@functools.cache
def equilibrium(name: str) -> At:
    case = CASES[name]
    p = np.array(case.p)
    solution = dx.solve(case.of(p), dx.Collocation(rtol=1e-4))
    equations, mesh = rates.settled(solution, STAGES)
    return At(case, p, np.abs(p if case.sizes is None else np.array(case.sizes)), equations, mesh)


def moved(at: At, k: int, step: float) -> tuple[Equations, Mesh]:
    """The equations at another value of parameter k, and the mesh with its breaks there; its states are the old ones."""
    there = at.p.copy()
    there[k] += step
    problem = at.case.of(there)
    x = rates.packed(problem, at.mesh, at.equations.breaks).x
    return Equations(problem, STAGES), Mesh(x, at.mesh.y, at.mesh.Y)


def solved(at: At, k: int, step: float) -> tuple[Array, Array]:
    """The nodes and states in SI units there, solved to rounding."""
    equations, mesh = moved(at, k, step)
    found = equations.newton(mesh, 1.0, 1e-13, 20)
    assert found is not None
    unit, origin = rates._units(equations)
    return mesh.x * equations.scale.length, found[0].y * unit + origin


def by_differences(function: Callable[[float], Array], h: float) -> Array:
    """The derivative at 0 by differences of order 6."""
    weights = (45.0, -9.0, 1.0)
    return sum(w * (function(k * h) - function(-k * h)) for k, w in enumerate(weights, start=1)) / (60.0 * h)


def check_order(left: Callable[[float], float], size: float, rounding: float) -> None:
    """What is left along a tangent falls with the square of the step, or faster where the second derivative is zero too."""
    ahead, behind = left(8e-3 * size), left(4e-3 * size)
    if behind > rounding:
        order = np.log2(ahead / behind)
        assert order > 1.8, f"order {order:.2f}, declared 2"


@pytest.mark.parametrize("name", CASES)
def test_the_residual_changes_as_its_right_sides_say(name: str) -> None:
    at = equilibrium(name)
    linearised = Linearised(at.equations, at.mesh)
    by = rates.derivatives(at.equations, at.mesh, at.case.of, at.p, at.sizes)
    wanted = -rates.right_sides(linearised, by)
    for k, size in enumerate(at.sizes):

        def residual(step: float, k: int = k) -> Array:
            return Linearised(*moved(at, k, step), responds=False).residual

        largest = max(np.max(np.abs(wanted[:, k])), ROUNDING / size)
        np.testing.assert_allclose(by_differences(residual, SMALL * size), wanted[:, k], atol=EXACT * largest, rtol=0.0)

        def left(h: float, residual: Any = residual, by: Array = wanted[:, k]) -> float:
            return float(np.max(np.abs(residual(h) - residual(0.0) - h * by)))

        check_order(left, size, 1e-9 * largest * size)


@pytest.mark.parametrize("name", CASES)
def test_the_solution_changes_along_its_tangents(name: str) -> None:
    at = equilibrium(name)
    tangents = rates.tangents(at.equations, at.mesh, at.case.of, at.p, at.sizes)
    for k, size in enumerate(at.sizes):
        dy, h = tangents.dy[k], SMALL * size
        parts = [slice(0, 3), slice(3, 7), slice(7, 10), slice(10, 13)]
        y_by_differences = by_differences(lambda step, k=k: solved(at, k, step)[1], h)
        s_by_differences = by_differences(lambda step, k=k: solved(at, k, step)[0], h)
        np.testing.assert_allclose(tangents.ds[k], s_by_differences, atol=1e-10 * tangents.s[-1] / size, rtol=0.0)
        for part in parts:
            unit = max(np.max(np.abs(dy[:, part])), np.max(np.abs(tangents.y[:, part])) / size, ROUNDING / size)
            np.testing.assert_allclose(dy[:, part] / unit, y_by_differences[:, part] / unit, atol=EXACT, rtol=0.0)

            def left(h: float, k: int = k, part: slice = part, dy: Array = dy) -> float:
                return float(np.max(np.abs(solved(at, k, h)[1] - tangents.y - h * dy)[:, part]))

            check_order(left, size, 1e-9 * unit * size)
