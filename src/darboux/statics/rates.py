"""How an equilibrium changes with any parameters of its description: tangents, and gradients by the transposed equations.

With the states y of a mesh at full load, and any description problem_of(p),

    F(y, p) = 0,     A dy / dp = -dF / dp,     d(w.y) / dp = -z.dF / dp  with  A^T z = w                       (1)

What F holds of the description is packed, and it is the packing that is differentiated, never a solve: by differences of
order 8, whose error is rounding. Lengths count in x = s / L, and the units of the dimensionless numbers change with p too. Where
breaks move with p, as the place of a load does, or all places with the length, the mesh stretches with them: a node keeps its
share of the piece between two breaks. A width h that changes by h' is one more change of the slopes, h' / h g.

The mesh is frozen, so this is the derivative of the discrete solution to rounding; of the exact one it has the mesh's error.

References: B. Fornberg, Math. Comp. 51 (1988) 699, table 1 (the weights); D. G. Cacuci, J. Math. Phys. 22 (1981) 2794 (adjoints).
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.errors import InvalidInput, NotConverged
from darboux.kernels import response as kernel
from darboux.kernels.collocation import SHAPED_COUPLE
from darboux.kernels.response import LOADS, ORDER_8, Rates
from darboux.kernels.rod_equations import FORCE, MOMENT, ROTATION, STATES
from darboux.kernels.support import FRAME, FRAME_RATE, NUMBERS, PLACE_RATE, SLIDING_AXES
from darboux.kernels.system import FREE, M_, N_, PHI
from darboux.packing.problem import Packing
from darboux.problem import Equilibrium
from darboux.solution import EquilibriumSolution
from darboux.statics.collocation_equations import Equations, kinks
from darboux.statics.linearised import Linearised
from darboux.statics.mesh import Mesh, stage_points

Array = NDArray[np.float64]
ProblemOf = Callable[[Array], Equilibrium]

STEP = 4e-3  # of a parameter's size, in differences: of a fourth power they leave 1e-13, of smoother laws less
SETTLED = 1e-13  # of the last of Newton's steps to the equilibrium that is differentiated
MOST_STEPS = 20


class Packed(NamedTuple):
    """What the equations of a mesh hold of one description, at given states: everything here changes smoothly with parameters."""

    x: Array  # (N + 1,), the nodes
    c: Array  # (N, stages, columns), the coefficients at Gauss' points
    shaped: Array  # (N, stages, 6), f and l of the loads that are functions of the shape, or none
    supports: Array  # (supports, NUMBERS), what holds the rod
    unit: Array  # (13,), by which a state is multiplied
    origin: Array  # (13,), what is added to it then


class Derivatives(NamedTuple):
    """What the equations of a mesh hold, by P parameters: what `kernels.response.right_sides` takes, and more for SI units."""

    rates: Rates
    x: Array  # (P, N + 1), of the nodes
    unit: Array  # (P, 13)
    origin: Array  # (P, 13)


class Tangents(NamedTuple):
    """An equilibrium at its nodes, and its derivatives by P parameters, in SI units.

    ``dy`` belongs to a node that moves with the breaks and the length, by ``ds``; at a fixed s it is dy - y' ds.
    """

    s: Array  # (N + 1,)
    y: Array  # (N + 1, 13)
    ds: Array  # (P, N + 1)
    dy: Array  # (P, N + 1, 13)


def settled(solution: EquilibriumSolution, stages: int = 4) -> tuple[Equations, Mesh]:
    """Return the equations of a solution, and its mesh with Newton's method done to rounding.

    Raises ``NotConverged`` where that does not contract, as at a fold.
    """
    equations = Equations(solution.problem, stages)
    found = equations.newton(equations.mesh_of(solution, every=1), 1.0, SETTLED, MOST_STEPS)
    if found is None:
        raise NotConverged(
            "Newton's method did not settle at the solution, so it has no derivative: a fold or a bifurcation may be there. "
            "Solve with a smaller rtol, or change a parameter a little.",
            solution,
        )
    return equations, found[0]


def packed(problem: Equilibrium, mesh: Mesh, breaks: Array, jumps: bool = True) -> Packed:
    """Return what the equations of a mesh hold of a description, whose breaks replace those (n,) on which the mesh stands.

    ``jumps`` as for `kinks`.
    """
    packing = Packing(problem)
    moved, _ = kinks(problem, packing.table if problem.dense else None, jumps)
    if len(moved) != len(breaks):
        raise _Changed
    x = np.interp(mesh.x, np.concatenate([[0.0], breaks, [1.0]]), np.concatenate([[0.0], moved, [1.0]]))
    points = stage_points(x, mesh.stages).ravel()
    c = packing.table(points) if problem.dense else packing.columns(points)
    shaped = np.zeros((0, mesh.stages, LOADS))
    if problem.of_shape:
        Y = mesh.Y.reshape(-1, STATES)
        R = frames.matrix_of_quaternion(Y[:, ROTATION:FORCE])
        all_of_it = packing.of_shape(points, Y[:, :ROTATION], R, slopes=False)
        parts = all_of_it[:, :3], all_of_it[:, SHAPED_COUPLE : SHAPED_COUPLE + 3]
        shaped = np.concatenate(parts, axis=1).reshape(-1, mesh.stages, LOADS)
    places = [packing.start, *(conditions for _, conditions in packing.stations), packing.end]
    supports = np.array([conditions.numbers(1.0) for conditions in places])
    scale = packing.scale
    unit = np.repeat([scale.length, 1.0, scale.force, scale.moment], [3, 4, 3, 3])
    origin = np.concatenate([scale.origin, np.zeros(STATES - 3)])
    return Packed(x, c.reshape(len(x) - 1, mesh.stages, -1), shaped, supports, unit, origin)


class _Changed(Exception):  # noqa: N818  # what happened
    """The description changed in kind, which has no derivative."""


def derivatives(
    equations: Equations, mesh: Mesh, problem_of: ProblemOf, p: Array, sizes: Array | None = None
) -> Derivatives:
    """Return how what the equations of a mesh hold changes with the parameters p (P,) of a description.

    ``sizes`` (P,) are those by which the parameters count as large: their own, unless given, as a parameter that is 0 needs. A
    change of 1.6 % of that must not change in kind what holds the rod or where something jumps. Raises ``InvalidInput``.
    """
    p = np.asarray(p, dtype=float)
    steps = STEP * np.abs(p if sizes is None else np.asarray(sizes, dtype=float))
    if not np.all(steps > 0.0):
        raise InvalidInput(f"parameter {int(np.argmin(steps))} is 0 and has no size; give one for each in sizes.")
    problem = problem_of(p)
    packing = functools.partial(packed, mesh=mesh, breaks=equations.breaks, jumps=len(problem.jumps) > 0)
    here = packing(problem)
    changes = [_difference(lambda p: packing(problem_of(p)), p, k, steps[k], here) for k in range(len(p))]
    x, c, shaped, supports, unit, origin = (np.array(part) for part in zip(*changes, strict=True))
    width = np.diff(mesh.x)
    widths = np.divide(np.diff(x, axis=1), width, out=np.zeros((len(p), len(width))), where=width > 0.0)
    rates = Rates(*(np.ascontiguousarray(part).ravel() for part in (c, widths, shaped, supports)))
    return Derivatives(rates, x, unit, origin)


def _difference(packing: Callable[[Array], Packed], p: Array, k: int, step: float, here: Packed) -> Packed:
    """Return the derivative of what is packed by parameter k."""
    total = [np.zeros_like(part) for part in here]
    for number, weight in enumerate(ORDER_8, start=1):
        for sign in (1.0, -1.0):
            there = p.copy()
            there[k] += sign * number * step
            try:
                found = _alike(packing(there), here)
            except _Changed:
                raise InvalidInput(
                    f"parameter {k}: what holds the rod, or where something jumps, changes in kind between {p[k]:g} and "
                    f"{there[k]:g}, so there is no derivative. Give a smaller size in sizes, or another parameter."
                ) from None
            for part, change in zip(total, found, strict=True):
                part += sign * weight / step * change
    return Packed(*total)


def _alike(found: Packed, here: Packed) -> Packed:
    """Return what was packed, with quaternions of the same sign; raises ``_Changed`` where it is of another kind."""
    if any(one.shape != other.shape for one, other in zip(found, here, strict=True)):
        raise _Changed
    if np.any(found.supports[:, :SLIDING_AXES] != here.supports[:, :SLIDING_AXES]):
        raise _Changed
    frame = slice(FRAME, PLACE_RATE)
    signs = np.sign(np.sum(found.supports[:, frame] * here.supports[:, frame], axis=1, keepdims=True))
    found.supports[:, frame] *= signs
    found.supports[:, FRAME_RATE:NUMBERS] *= signs
    return found


def right_sides(linearised: Linearised, derivatives: Derivatives) -> Array:
    """Return -dF / dp (n, P) of an equilibrium's equations."""
    out = np.empty((linearised.size, len(derivatives.x)))
    kernel.right_sides(
        linearised.system, linearised.supports, linearised.response.ravel(), derivatives.rates, out.ravel()
    )
    return out


def tangents(equations: Equations, mesh: Mesh, problem_of: ProblemOf, p: Array, sizes: Array | None = None) -> Tangents:
    """Return an equilibrium at full load and its derivatives by the parameters p (P,), one solution of (1) for each.

    problem_of(p) is the problem of the equations; sizes as for `derivatives`.
    """
    linearised, by = Linearised(equations, mesh), derivatives(equations, mesh, problem_of, p, sizes)
    delta = linearised.plain.solve(right_sides(linearised, by)).T.reshape(-1, len(mesh.x), FREE)
    unit, origin = _units(equations)
    length = equations.scale.length
    dy = np.einsum("nij,pnj->pni", _states_of_unknowns(mesh.y), delta) * unit
    dy += by.unit[:, None] * mesh.y + by.origin[:, None]
    return Tangents(mesh.x * length, mesh.y * unit + origin, by.x * length + mesh.x * by.unit[:, :1], dy)


def gradients(
    equations: Equations, mesh: Mesh, problem_of: ProblemOf, p: Array, weights: Array, sizes: Array | None = None
) -> Array:
    """Return d(w.y) / dp (m, P) of outputs w.y, by one transposed solution of (1) for each output.

    ``weights`` w (m, N + 1, 13) of the states at the nodes in SI units, which move as those of `Tangents` do.
    """
    linearised, by = Linearised(equations, mesh), derivatives(equations, mesh, problem_of, p, sizes)
    unit, _ = _units(equations)
    w = np.einsum("nij,mni->mnj", _states_of_unknowns(mesh.y), weights * unit)
    z = linearised.plain.solve_transposed(w.reshape(len(weights), -1).T)
    of_units = np.einsum("mni,pni->mp", weights, by.unit[:, None] * mesh.y + by.origin[:, None])
    return np.asarray(z.T @ right_sides(linearised, by) + of_units)


def _units(equations: Equations) -> tuple[Array, Array]:
    """Return unit and origin (13,) of the states."""
    scale = equations.scale
    unit = np.repeat([scale.length, 1.0, scale.force, scale.moment], [3, 4, 3, 3])
    return unit, np.concatenate([scale.origin, np.zeros(STATES - 3)])


def _states_of_unknowns(y: Array) -> Array:
    """Return d(r, q, n, m) / d(dr, phi, dn, dm) (n, 13, 12) at the states y (n, 13): dq = 1/2 q (0, phi), all else the same."""
    result = np.zeros((len(y), STATES, FREE))
    result[:, range(3), range(3)] = 1.0
    for a, e in enumerate(np.eye(4)[1:]):
        result[:, ROTATION:FORCE, PHI + a] = 0.5 * frames.product(y[:, ROTATION:FORCE], np.tile(e, (len(y), 1)))
    result[:, range(FORCE, MOMENT), range(N_, M_)] = 1.0
    result[:, range(MOMENT, STATES), range(M_, FREE)] = 1.0
    return result
