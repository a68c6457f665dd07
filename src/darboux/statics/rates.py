r"""How an equilibrium changes with any parameter p of its description: the derivative of collocation's equations by p.

The rod equations are affine in their coefficients, so that y' = g(y; c) changes by

    dg/dp = g(y; dc/dp) - g(y; 0) + (dh/dp) / h g(y; c)                                              (1)

at a stage of an element of width h: breaks of the data, and places of loads and supports, may move with p, and the mesh stretches
between them. On an element, with the Jacobians J_l at the stages,

    dY_j = dy_0 + h sum_l a_jl (J_l dY_l + dg_l/dp),     dy_1 = dy_0 + h sum_l b_l (J_l dY_l + dg_l/dp)          (2)

which gives T and W of dy_1 = T dy_0 + W (dg_1/dp, ..., dg_s/dp). With the derivatives of what the supports ask for, the matrix of
all nodes and its right sides are there; dc/dp and the like come from differences of the packing, never of a solve.

Reference: A. Griewank and A. Walther, Evaluating Derivatives, 2nd ed. (SIAM, 2008), section 15.1 (implicit functions).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.kernels import factored, rod_equations
from darboux.kernels import support as support_kernel
from darboux.kernels.collocation import SHAPED_COUPLE as COUPLE
from darboux.kernels.factored import Border, Factors
from darboux.kernels.gauss import METHODS, PER_METHOD
from darboux.kernels.rod_equations import FORCE, MOMENT, ROTATION, STATES
from darboux.kernels.system import FREE, SIDES
from darboux.packing.coefficients import slopes
from darboux.packing.problem import Packing
from darboux.problem import Equilibrium
from darboux.statics.mesh import Mesh, stage_points

Array = NDArray[np.float64]

STEP = 1e-3  # of a parameter
OFFSETS = np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])  # of central differences of order 6, in steps
WEIGHTS = np.array([-1.0, 9.0, -45.0, 45.0, -9.0, 1.0]) / 60.0
HALF = FREE // 2


@dataclass(frozen=True)
class Change:
    """What changes with a parameter: right sides (N + 1, 12) in the order of the matrix's rows, and the units.

    ``unit`` (13,) and ``origin`` (3,) are the derivatives of what dimensionless states are multiplied by and counted from.
    """

    right: Array
    unit: Array
    origin: Array


class Linearised:
    """The equations of collocation about an equilibrium at full load: ``mesh`` holds it, dimensionless."""

    def __init__(self, problem: Equilibrium, mesh: Mesh) -> None:
        self.packing, self.mesh = Packing(problem), mesh
        self._wide = np.flatnonzero(mesh.wide)
        self._points = stage_points(mesh.x, mesh.stages)[self._wide]
        self._slopes, self.T, self.W = self._responses()

    def tangent(self, problem_of: Callable[[float], Equilibrium], p: float, step: float = 0.0) -> Array:
        """Return dy/dp (N + 1, 13) of the nodes in SI units, at a fixed share of each part between breaks.

        ``problem_of(p)`` is the problem itself, and differs near p by what the parameter changes; ``step`` of the differences, as
        p has it, else a thousandth of p.
        """
        change = self.change(problem_of, p, step)
        return self.in_units(self.solved(change.right), change)

    def solved(self, right: Array) -> Array:
        """Return the steps (N + 1, 12) of the nodes for right sides (N + 1, 12), in the order of the matrix's rows."""
        delta = right.ravel().copy()
        factored.solve(self.factors, NO_BORDER, delta, np.empty(0), 1)
        return delta.reshape(-1, FREE)

    def adjoint(self, outputs: Array) -> Array:
        """Return z (N + 1, 12) with A^T z = outputs (N + 1, 12), by the nodes' steps: an output changes by z . right."""
        z = outputs.ravel().copy()
        factored.solve_transposed(self.factors, NO_BORDER, z, np.empty(0), 1)
        return z.reshape(-1, FREE)

    def in_units(self, delta: Array, change: Change) -> Array:
        """Return the change (N + 1, 13) in SI units of nodes that move by delta (N + 1, 12), with that of the units."""
        scale = self.packing.scale
        turn = np.concatenate([np.zeros((len(delta), 1)), 0.5 * delta[:, 3:6]], axis=1)
        dq = frames.product(self.mesh.y[:, ROTATION:FORCE], turn)
        dy = np.concatenate([delta[:, :3], dq, delta[:, 6:]], axis=1) * _unit(scale.length, scale.force, scale.moment)
        dy += change.unit * self.mesh.y
        dy[:, :ROTATION] += change.origin
        return dy

    @cached_property
    def factors(self) -> Factors:
        """The factored matrix."""
        blocks = np.zeros((len(self.mesh.x) - 1, FREE, 2 * FREE))
        blocks[self._wide, :, :FREE] = self.T
        blocks[self._wide, :, FREE:] = -np.eye(FREE)
        for i, (_, station) in zip(self.mesh.joints, self.packing.stations, strict=True):
            rows = np.empty((FREE, 2 * FREE + SIDES))
            support_kernel.joint(station.numbers(1.0), self.mesh.y[i], self.mesh.y[i + 1], 1.0, rows.ravel())
            blocks[i] = rows[:, : 2 * FREE]
        ends = [c.system(y, 1.0)[:, :FREE] for c, y in zip(self.packing.ends, self.mesh.y[[0, -1]], strict=True)]
        factors = factored.new_factors(len(blocks))
        factored.factor(
            np.ascontiguousarray(ends[0]).ravel(), blocks.ravel(), np.ascontiguousarray(ends[1]).ravel(), factors
        )
        return factors

    def change(self, problem_of: Callable[[float], Equilibrium], p: float, step: float = 0.0) -> Change:
        """Return what a parameter changes: minus the derivative of all equations, and that of the units."""
        step = step or STEP * (abs(p) or 1.0)
        packings = [Packing(problem_of(p + offset * step)) for offset in OFFSETS]
        breaks = self.packing.breaks
        if any(len(packing.breaks) != len(breaks) for packing in packings):
            raise ValueError("the number of breaks changes with the parameter")

        def rate(values: list[Array]) -> Array:
            return np.asarray(np.tensordot(WEIGHTS, np.array(values), axes=1) / step)

        own, ends = np.array([0.0, *breaks, 1.0]), [np.array([0.0, *packing.breaks, 1.0]) for packing in packings]
        points = [np.interp(self._points, own, end) for end in ends]
        widths = rate([np.diff(np.interp(self.mesh.x, own, end))[self._wide] for end in ends])
        c = rate([packing.columns(x.ravel()) for packing, x in zip(packings, points, strict=True)])
        Y = self.mesh.Y[self._wide].reshape(-1, STATES)
        dg = slopes(c, Y) - slopes(np.zeros_like(c), Y)  # (1)
        dg[:, FORCE:] -= rate([_shaped(packing, x, Y) for packing, x in zip(packings, points, strict=True)])
        dg = dg.reshape(len(self._wide), -1, STATES)
        dg += (widths / np.diff(self.mesh.x)[self._wide])[:, None, None] * self._slopes
        rows = np.zeros((len(self.mesh.x) - 1, FREE))
        rows[self._wide] = -np.einsum("nrk,nk->nr", self.W, dg.reshape(len(dg), -1))
        for number, i in enumerate(self.mesh.joints):
            before, behind = self.mesh.y[i], self.mesh.y[i + 1]
            rows[i] = rate([_joint(packing.stations[number][1].numbers(1.0), before, behind) for packing in packings])
        asked = [-rate([packing.ends[k].values(self.mesh.y[-k], 1.0) for packing in packings]) for k in (0, 1)]
        units = rate([_unit(x.scale.length, x.scale.force, x.scale.moment) for x in packings])
        right = np.concatenate([asked[0], rows.ravel(), asked[1]]).reshape(-1, FREE)
        return Change(right, units, rate([packing.scale.origin for packing in packings]))

    def _responses(self) -> tuple[Array, Array, Array]:
        """(2): return the slopes at the stages (n, s, 13), T (n, 12, 12) and W (n, 12, 13 s) of the elements with a width."""
        mesh, s = self.mesh, self.mesh.stages
        Y, h = mesh.Y[self._wide], np.diff(mesh.x)[self._wide]
        numbers = METHODS[s * PER_METHOD + s : s * PER_METHOD + s + s * (s + 1)].reshape(s + 1, s)
        a, b = numbers[:-1], numbers[-1]
        c = self.packing.columns(self._points.ravel())
        flat = Y.reshape(-1, STATES)
        g, J = slopes(c, flat), np.empty((len(flat), STATES, STATES))
        for k in range(len(flat)):
            rod_equations.jacobian(flat[k], c[k], J[k].ravel())
        g[:, FORCE:] -= _shaped(self.packing, self._points, flat)
        J -= _shaped_jacobian(self.packing, self._points, flat)
        n, size = len(h), s * STATES
        by_state = J.reshape(n, s, STATES, STATES)
        by_stages = np.einsum("n,jl,nlab->njalb", h, a, by_state).reshape(n, size, size)
        right = np.zeros((n, size, STATES + size))  # of dy_0, and of dg at the stages
        right[:, :, :STATES] = np.tile(np.eye(STATES), (s, 1))
        right[:, :, STATES:] = h[:, None, None] * np.kron(a, np.eye(STATES))
        dY = np.linalg.solve(np.eye(size) - by_stages, right).reshape(n, s, STATES, -1)
        end = np.einsum("n,l,nlab,nlbk->nak", h, b, by_state, dY)
        end[:, :, :STATES] += np.eye(STATES)
        end[:, :, STATES:] += h[:, None, None] * np.kron(b, np.eye(STATES))
        end = _from_quaternions(mesh.y[self._wide + 1], end)
        T = np.concatenate(
            [end[:, :, :3], _of_turns(mesh.y[self._wide], end[:, :, ROTATION:FORCE]), end[:, :, FORCE:STATES]], axis=2
        )
        return g.reshape(n, s, STATES), T, end[:, :, STATES:]


NO_BORDER = Border(np.empty(0), np.empty(0), np.empty(0))


def _unit(length: float, force: float, moment: float) -> Array:
    """Return by what the 13 dimensionless states are multiplied."""
    return np.repeat([length, 1.0, force, moment], [3, 4, 3, 3])


def _joint(numbers: Array, before: Array, behind: Array) -> Array:
    """Return minus what the twelve equations of a station leave over."""
    rows = np.empty((FREE, 2 * FREE + SIDES))
    support_kernel.joint(numbers, before, behind, 1.0, rows.ravel())
    return rows[:, 2 * FREE]


def _shaped(packing: Packing, points: Array, states: Array) -> Array:
    """Return the force and the couple per length (n, 6) of loads that are functions of the shape."""
    R = frames.matrix_of_quaternion(states[:, ROTATION:FORCE])
    shaped = packing.of_shape(points.ravel(), states[:, :3], R, slopes=False)
    return np.concatenate([shaped[:, :3], shaped[:, COUPLE : COUPLE + 3]], axis=1)


def _shaped_jacobian(packing: Packing, points: Array, states: Array) -> Array:
    """Return their derivatives (n, 13, 13) by the states: f in the rows of n, l in those of m."""
    R = frames.matrix_of_quaternion(states[:, ROTATION:FORCE])
    shaped, result = packing.of_shape(points.ravel(), states[:, :3], R), np.zeros((len(states), STATES, STATES))
    for row, at in ((FORCE, 0), (MOMENT, COUPLE)):
        result[:, row : row + 3, :ROTATION] = shaped[:, at + 3 : at + 12].reshape(-1, 3, 3)
        by_turn = shaped[:, at + 12 : at + 21].reshape(-1, 3, 3)
        result[:, row : row + 3, ROTATION:FORCE] = by_turn @ _turns(states[:, ROTATION:FORCE])
    return result


def _turns(q: Array) -> Array:
    """Return the matrices (n, 3, 4) of phi = 2 vec(conj(q) dq) / |q|^2, the small rotation in the section's frame."""
    w, x, y, z = (2.0 * q / np.sum(q**2, axis=1, keepdims=True)).T
    return np.stack([-x, w, z, -y, -y, -z, w, x, -z, y, -x, w], axis=1).reshape(-1, 3, 4)


def _from_quaternions(y: Array, end: Array) -> Array:
    """Replace the four rows of dq by the three of phi behind the element: (n, 13, k) becomes (n, 12, k)."""
    phi = _turns(y[:, ROTATION:FORCE]) @ end[:, ROTATION:FORCE]
    return np.concatenate([end[:, :ROTATION], phi, end[:, FORCE:]], axis=1)


def _of_turns(y: Array, by_quaternion: Array) -> Array:
    """Replace four columns of dq by three of phi before the element: dq = 1/2 q (0, phi)."""
    q = y[:, ROTATION:FORCE]
    columns = [frames.product(q, np.broadcast_to(np.eye(4)[1 + a] * 0.5, q.shape)) for a in range(3)]
    return by_quaternion @ np.stack(columns, axis=2)
