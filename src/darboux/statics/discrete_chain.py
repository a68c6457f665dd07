"""A rod as a chain of edges: what resists, what acts, how it lies at rest and how it moves."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.kernels import discrete_rod
from darboux.kernels.discrete_rod import Elasticity, Loads, State
from darboux.kernels.rod_equations import BINV, DEAD_FORCE, DEAD_MOMENT, FORCE_GRADIENT, K0, SINV
from darboux.problem import Equilibrium
from darboux.statics import coefficients
from darboux.statics.coefficients import Scale

Array = NDArray[np.float64]

# EA L^2 / EI of an inextensible rod's edges, a penalty that multipliers make exact: well above bending and above the loads.
PENALTY, PENALTY_OF_LOADS = 1e6, 100.0
SLACK = 1e3  # and, on the way, of a rod held at both ends, which as a straight one could not leave its place


class Shape(NamedTuple):
    """A state of the chain, its multipliers (the edges' tensions at rest length), how many directions lower its energy."""

    state: State
    T: Array
    unstable: int | None = None


class Chain:
    """The discrete rod in dimensionless numbers: N edges between the given nodes, clamped where the supports hold.

    With ``two_vertices`` a clamp freezes the first edge; else a spring of half a cell ties it to the clamp.
    """

    def __init__(self, problem: Equilibrium, nodes: Array, two_vertices: bool) -> None:
        self.problem, self.nodes, self.two_vertices = problem, nodes, two_vertices
        self.scale = Scale.of(problem)
        self.held = (problem.start.holds, problem.end.holds)
        self.springs = tuple(held and not two_vertices for held in self.held)
        self.edges = len(nodes) - 1
        self.unknowns = 4 * self.edges + 3
        self._discretise()
        self._loaded = (0.0, Loads(np.zeros(self.f.size), np.zeros(self.C.size)))
        self.fixed = self._fixed()

    # -- from the rod to the chain -------------------------------------------------------------------------------

    def _discretise(self) -> None:
        """Average compliance, natural shape and loads over the cells of the vertices and over the edges."""
        x = self.nodes
        middle = 0.5 * (x[:-1] + x[1:])
        cells = np.concatenate([[0.0], middle, [1.0]])
        at_vertices = _means(lambda s: coefficients.columns(self.problem, self.scale, s), cells)
        on_edges = _means(lambda s: coefficients.columns(self.problem, self.scale, s), x)
        self.l, self.V = np.diff(x), np.diff(cells)
        B = np.linalg.inv(symmetric(at_vertices[:, BINV : BINV + 6])) / self.V[:, None, None]
        self.stiffness = _six(B).ravel()
        self.kappa0 = (at_vertices[:, K0 : K0 + 3] * self.V[:, None]).ravel()
        stretch = on_edges[:, SINV + 2]
        self.lent = not self.problem.rod.stretch and all(self.held)
        self.inextensible = not self.problem.rod.stretch and not self.lent
        force, gradient = DEAD_FORCE, FORCE_GRADIENT
        self.f = at_vertices[:, force : force + 3] * self.V[:, None]
        self.C = _six(at_vertices[:, gradient : gradient + 9].reshape(-1, 3, 3)) * self.V[:, None]
        moment = DEAD_MOMENT
        self.couples = on_edges[:, moment : moment + 3] * self.l[:, None]
        for at, i in (("start", 0), ("end", -1)):
            load = self.problem.end_load(at)
            self.f[i] += load.force / self.scale.force
            self.couples[i] += load.moment / self.scale.moment
        self.penalty = PENALTY + PENALTY_OF_LOADS * float(np.sum(np.abs(self.f)) + np.sum(np.abs(self.C)))
        self.EA = 1.0 / stretch if self.problem.rod.stretch else np.full(self.edges, self.penalty)

    def _fixed(self) -> NDArray[np.bool_]:
        fixed = np.zeros(self.unknowns, dtype=bool)
        if self.held[0]:
            fixed[: 7 if self.two_vertices else 3] = True
        if self.held[1]:
            fixed[-7 if self.two_vertices else -3 :] = True
        return fixed

    def elasticity(self, T: Array) -> Elasticity:
        """Return what resists, with the multipliers T."""
        first = 0 if self.springs[0] else 1
        stop = self.edges + 1 if self.springs[1] else self.edges
        return Elasticity(self.stiffness, self.kappa0, self.l, self.EA, T, first, stop)

    def loads(self, load_factor: float) -> Loads:
        """Return what acts on the vertices at a load factor; the last answer is kept, for it is asked for again."""
        if load_factor != self._loaded[0]:
            self._loaded = (load_factor, Loads((load_factor * self.f).ravel(), (load_factor * self.C).ravel()))
        return self._loaded[1]

    # -- the unloaded rod ----------------------------------------------------------------------------------------

    def unloaded(self) -> Shape:
        """Return the natural shape, where every spring is at rest, laid against the support that holds it."""
        N = self.edges
        support, held = (self.problem.start, 0) if self.held[0] else (self.problem.end, N + 1)
        rest = self.kappa0.reshape(-1, 3).copy()
        for vertex, spring in ((0, self.springs[0]), (N, self.springs[1])):
            if not spring:
                rest[vertex] = 0.0  # no spring: the ghost edge runs on along its neighbour
        q = np.empty((N + 2, 4))
        discrete_rod.chain_frames(rest.ravel(), q.ravel())
        R = frames.matrix_of_quaternion(q)
        R = support.R @ R[held].T @ R
        x = np.zeros((N + 1, 3))
        x[1:] = np.cumsum(self.l[:, None] * R[1:-1, :, 2], axis=0)
        x -= x[0] if self.held[0] else x[-1]
        self.natural_end = (x[-1].copy(), frames.quaternion_of_matrix(R[-1]))
        state = State(x.ravel(), R[:, :, 2].ravel().copy(), R[:, :, 0].ravel().copy(), rest[:, 2].copy())
        return Shape(state, np.zeros(N))

    # -- moving --------------------------------------------------------------------------------------------------

    def moved(self, shape: Shape, step: Array, scale: float) -> Shape:
        """Return the shape after a step; edges turn rather than shear, and multipliers take up an inextensible rod's."""
        x, t, _, _ = shape.state
        turned = np.empty_like(step)
        frozen = 1 if self.two_vertices else 0
        discrete_rod.turning_step(x, self.l, step, scale, self.inextensible, *self.held, frozen, turned)
        new = _advanced(shape.state, turned)
        T = shape.T
        if self.inextensible:
            moves = np.diff(np.append(step, 0.0).reshape(-1, 4)[:, :3], axis=0)
            strain = scale * np.einsum("ni,ni->n", t[3:-3].reshape(-1, 3), moves) / self.l
            T = T + self.EA * (self.stretch(shape) + strain)
        return shape._replace(state=new, T=T)

    def settled(self, shape: Shape) -> None:
        """Keep the twists of an accepted state, so that whole turns are not lost."""
        first, stop = self.elasticity(shape.T)[-2:]
        discrete_rod.strains(shape.state, first, stop, np.empty(3 * (self.edges + 1)))

    def posed(self, shape: Shape, load_factor: float) -> Shape:
        """Put the far clamp of a rod that is held at both ends where it belongs at this load factor."""
        if not all(self.held):
            return shape
        position0, q0 = self.natural_end
        position1 = (np.array(self.problem.end.position) - self.scale.origin) / self.scale.length
        q = frames.between(q0, frames.quaternion_of_matrix(self.problem.end.R), load_factor)
        R = frames.matrix_of_quaternion(q)
        end = (1.0 - load_factor) * position0 + load_factor * position1
        step = np.zeros(self.unknowns)
        step[-3:] = end - shape.state.x[-3:]
        if self.two_vertices:
            step[-7:-4] = end - self.l[-1] * R[:, 2] - shape.state.x[-6:-3]
        posed = _advanced(shape.state, step)
        clamped = slice(-6, None) if self.two_vertices else slice(-3, None)
        posed.t[clamped], posed.d1[clamped] = (
            np.resize(R[:, 2], posed.t[clamped].size),
            np.resize(R[:, 0], posed.d1[clamped].size),
        )
        return shape._replace(state=posed)

    def lend(self, load_factor: float) -> None:
        """Let an inextensible rod held at both ends stretch on the way, less and less."""
        if self.lent:
            self.EA[:] = min(SLACK / max(1.0 - load_factor, 1e-12), self.penalty)

    def taken_back(self, shape: Shape) -> Shape:
        """Take back at the end what was lent: what pulled at a stretched edge becomes its multiplier T."""
        if not self.lent:
            return shape
        self.inextensible = True
        return self.moved(shape, np.zeros(self.unknowns), 0.0)

    def stretch(self, shape: Shape) -> Array:
        """Return by how much each edge is longer than at rest, relatively: (N,)."""
        edges = np.diff(shape.state.x.reshape(-1, 3), axis=0)
        return np.asarray(np.linalg.norm(edges, axis=1) / self.l - 1.0)

    def turn(self, step: Array) -> float:
        """Return the largest turn of an edge in a packed step, or its largest displacement; not a number if one is none."""
        return float(discrete_rod.largest_turn(self.l, step))


def _advanced(state: State, step: Array) -> State:
    """Return the state after a packed step; the twists stay those of before, to count whole turns by."""
    new = State(np.empty_like(state.x), np.empty_like(state.t), np.empty_like(state.d1), state.m.copy())
    discrete_rod.advance(state, step, 1.0, new)
    return new


def nodes_along(segments: int, grading: float, start_held: bool, end_held: bool) -> Array:
    """Return segments + 1 nodes on [0, 1] whose spacing grows smoothly, by the factor ``grading``, away from held ends.

    s(x) = (g^x - 1) / (g - 1),   mirrored for the other end, and in two halves where both ends are held
    """
    x = np.linspace(0.0, 1.0, segments + 1)
    if grading == 1.0:
        return x

    def away_from_start(x: Array) -> Array:
        return np.asarray(np.expm1(x * np.log(grading)) / (grading - 1.0))

    if start_held and end_held:
        half = 0.5 * away_from_start(1.0 - np.abs(2.0 * x - 1.0))
        return np.where(x <= 0.5, half, 1.0 - half)
    return away_from_start(x) if start_held else 1.0 - away_from_start(1.0 - x)


def _means(function: Callable[[Array], Array], nodes: Array) -> Array:
    """Return the mean of a function (n,) -> (n, k) on each interval, by Gauss' rule of two points."""
    middle, half = 0.5 * (nodes[:-1] + nodes[1:]), 0.5 * np.diff(nodes)
    offset = half / np.sqrt(3.0)
    return np.asarray(0.5 * (function(middle - offset) + function(middle + offset)))


def symmetric(six: Array) -> Array:
    """Return (n, 3, 3) from the six numbers 11, 22, 33, 23, 13, 12."""
    return six[:, [0, 5, 4, 5, 1, 3, 4, 3, 2]].reshape(-1, 3, 3)


def _six(matrix: Array) -> Array:
    return np.stack([matrix[:, i, j] for i, j in coefficients.PAIRS], axis=1)
