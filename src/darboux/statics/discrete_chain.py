"""A rod as a chain of edges: what resists, what acts, how it lies at rest and how it moves.

Beyond either end stands a ghost edge, which carries the frame of the end's section: the spring between it and the first
edge is that of half a cell. A clamp holds it; under other supports it turns (see discrete_ends.py). With ghosts the
kernels see N + 2 edges and N + 3 vertices.
"""

from __future__ import annotations

import copy
import itertools
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.errors import InvalidInput
from darboux.kernels import discrete_rod
from darboux.kernels.band import LOWER
from darboux.kernels.collocation import SHAPED_COUPLE
from darboux.kernels.discrete_rod import Elasticity, Loads, State
from darboux.kernels.rod_equations import (
    BINV,
    DEAD_FORCE,
    DEAD_MOMENT,
    FOLLOWER_FORCE,
    FOLLOWER_MOMENT,
    FORCE_GRADIENT,
    K0,
    SINV,
)
from darboux.natural import smallest_rotation
from darboux.packing.cells import six, symmetric
from darboux.packing.ends import EndConditions
from darboux.packing.pendulum import hanging
from darboux.packing.problem import Packing
from darboux.problem import Equilibrium
from darboux.statics import hanging_chain
from darboux.statics.discrete_ends import Block, End, cross_matrix
from darboux.statics.first_shape import FirstShape, circle

Array = NDArray[np.float64]

# EA L^2 / EI of an inextensible rod's edges, a penalty that multipliers make exact: well above bending and above the loads.
PENALTY, PENALTY_OF_LOADS = 1e6, 100.0
PENALTY_OF_CABLE = 1e4  # the same where tension is all: a path's tangent stretches by it over the penalty, and sags
SLACK = 1e3  # and, on the way, of a rod held at both ends: as a straight one it could not leave its place, or would meet all its
# buckling loads at once
SHIFT = 1e-5  # of EI / L^3 and EI / L, per length: what is lent to motions that nothing resists, as a round rod's spin
SHIFT_OF_RING = 1e-4  # the same, above the rounding of the penalty, which a ring that turns feels
CLOSE = 0.05  # of a mean edge: a point load this close to another place acts from there
GHOST = 0.5  # length of a ghost edge, over its neighbour's
APART = 0.25  # of a segment, between nodes that are put at two places


class Shape(NamedTuple):
    """A state of the chain, the multipliers of its edges' lengths (T) and of grooves, how many directions lower its energy."""

    state: State
    T: Array  # (N + 2) the edges' tensions at rest length
    reactions: tuple[Array, ...] = ()  # of grooves at either end
    unstable: int | None = None


class EdgeLoads(NamedTuple):
    """Loads that follow the shape, on each edge, with their derivatives by its middle and by a small turn: see the kernel."""

    F: Array  # (N + 2, 2, 3) on the vertex behind and on the one in front
    F_r: Array  # (N + 2, 2, 3, 3)
    F_phi: Array
    M: Array  # (N + 2, 3)
    M_r: Array  # (N + 2, 3, 3)
    M_phi: Array


class PointLoad(NamedTuple):
    """What acts at a vertex between the ends and depends on the section's frame, dimensionless.

    The edges that meet there share it, each by the other's length. A moment makes the curvature jump, so that the section's
    frame is that of both, in the mean, turned by u = c mu, with mu the whole moment in the section's frame.
    """

    edges: Array  # (2,) whole numbers: in front of the vertex and behind it
    share: Array  # (2,)
    c: Array  # (3, 3) C l_a l_b / 2 (l_a + l_b)
    force: Array  # (3,) of followers, section's frame
    couple: Array
    dead: Array  # (3,) dead moment, fixed frame
    eccentric: Array  # (3, 3) A, fixed frame by columns

    def moment(self, R: Array, load_factor: float) -> Array:
        """Return mu (3,) on an edge of the frame R."""
        return np.asarray(load_factor * (self.couple + R.T @ self.dead + _axial(R.T @ self.eccentric)))

    def energy(self, R: Array, load_factor: float) -> float:
        """Return the potential -R : A - 1/2 m.c m of the eccentric forces on an edge of the frame R, m their moment."""
        G = load_factor * R.T @ self.eccentric
        m = _axial(G)
        return -float(np.trace(G) + 0.5 * m @ self.c @ m)

    def on_edge(self, R: Array, load_factor: float) -> tuple[Array, Array, Array, Array]:
        """Return force and couple on an edge of the frame R, fixed frame, each with its derivative by a small rotation of it.

        With G = R^T A, m its axial vector, K = G - tr(G) = dm/dpsi and psi a rotation in the section's frame

            R^T F = p + u x p,   R^T M = d + u x d + m + K^T u
        """
        p, d = load_factor * self.force, load_factor * self.couple
        G, q = load_factor * R.T @ self.eccentric, load_factor * R.T @ self.dead
        m, K = _axial(G), G - np.trace(G) * np.eye(3)
        u, by_turn = self.c @ (d + q + m), self.c @ (cross_matrix(q) + K)
        force, couple = p + np.cross(u, p), d + np.cross(u, d) + m + K.T @ u
        dp = -cross_matrix(p) @ by_turn - cross_matrix(force)
        dd = (K.T - cross_matrix(d)) @ by_turn + K - G.T @ cross_matrix(u) - np.outer(u, m) - cross_matrix(couple)
        return R @ force, R @ dp @ R.T, R @ couple, R @ dd @ R.T


class Chain:
    """The discrete rod in dimensionless numbers: N edges between the given nodes, and a ghost edge beyond either end.

    With ``two_vertices`` a clamp freezes the first edge; else a spring of half a cell ties it to the clamp.

    A ring's nodes run from half a segment in front of s = 0 to half a segment behind s = L: the first edge and the last are
    one, and frozen. So every vertex is like the others, and what the ring feels where it is held is nothing.
    """

    def __init__(self, problem: Equilibrium, nodes: Array, two_vertices: bool, start: FirstShape | None = None) -> None:
        self.problem, self.nodes, self.start = problem, nodes, start
        self.closed = problem.closed
        self.cable = hanging_chain.hung(problem) if start is None else None
        self.packing = Packing(problem)
        self.scale = self.packing.scale
        self.edges = len(nodes) - 1
        self.unknowns = 4 * (self.edges + 2) + 3
        self.frozen = tuple(self.closed or (two_vertices and end.clamps) for end in self.packing.ends)
        self.symmetric = self.packing.has_potential
        self._discretise()
        self.ends = self._ends_of(self.packing)
        self._soften()
        self.between = self._stations()
        self._loaded = (0.0, Loads(np.zeros(self.f.size), np.zeros(self.C.size)))
        self.fixed = self._fixed()
        oriented = any(all(support.held_turns) or support.sprung[1] for _, support in self.packing.supports)
        self.shift = SHIFT_OF_RING if self.closed else 0.0 if oriented else SHIFT
        self.shift *= max(1.0, float(np.max(self.EA)) / PENALTY)  # above the rounding of stiffer edges too

    def _ends_of(self, packing: Packing) -> tuple[End, End]:
        first, last = (
            End(conditions, float(ghost), self.unknowns, float(ghost) if self.closed else 0.0)
            for conditions, ghost in zip(packing.ends, GHOST * self.l[[1, -2]], strict=True)
        )
        return first, last

    def _soften(self) -> None:
        """Give the spring of an end that nothing turns, next to a very short edge, the stiffness of half a mean cell.

        It carries no moment. As stiff as its own half cell it would, by its rounding, move the short edge.
        """
        for end, i in zip(self.ends, (0, -1), strict=True):
            share = 2.0 * self.V[i] * self.edges
            if share < CLOSE and end.bare and not any(end.conditions.held_turns):
                self.stiffness.reshape(-1, 6)[1:-1][i] *= share

    def released(self, at: Sequence[str]) -> Chain:
        """Return the chain without the supports of those ends, as no problem of statics may be."""
        chain = copy.copy(self)
        chain.packing = self.packing.released(at)
        chain.ends = self._ends_of(chain.packing)
        chain.fixed = chain._fixed()
        return chain

    # -- from the rod to the chain -------------------------------------------------------------------------------

    def _discretise(self) -> None:
        """Average compliance, natural shape and loads over the cells of the vertices and over the edges."""
        self.cells = self.packing.cells(self.nodes)
        at_vertices = self.cells.at_vertices(self.packing.columns)
        on_edges = _ghosted(self.cells.on_edges(self.packing.columns))
        self.l, self.V = _ghosted(self.cells.l), self.cells.V
        self.l[[0, -1]] = GHOST * self.l[[1, -2]]
        B = np.linalg.inv(symmetric(at_vertices[:, BINV : BINV + 6])) / self.V[:, None, None]
        self.stiffness = _ghosted(six(B)).ravel()
        self.natural = _ghosted(self.cells.natural_rates(at_vertices[:, K0 : K0 + 3]) * self.V[:, None]).ravel()
        self.kappa0 = self.first = self.natural  # at the load factor of now, at 0
        held_twice = len(self.packing.supports) > 1 and self.cable is None
        self.lent = held_twice and (not self.problem.rod.stretch or self.packing.is_pushed)
        self.inextensible = not self.problem.rod.stretch and not self.lent
        force, gradient = DEAD_FORCE, FORCE_GRADIENT
        self.f = _ghosted(at_vertices[:, force : force + 3] * self.V[:, None])
        self.C = _ghosted(six(at_vertices[:, gradient : gradient + 9].reshape(-1, 3, 3)) * self.V[:, None])
        spread = self.l[:, None]
        self.couples = on_edges[:, DEAD_MOMENT : DEAD_MOMENT + 3] * spread
        self.section_force = 0.5 * (on_edges[:, FOLLOWER_FORCE : FOLLOWER_FORCE + 3] * spread)[:, None].repeat(
            2, axis=1
        )
        self.section_couple = on_edges[:, FOLLOWER_MOMENT : FOLLOWER_MOMENT + 3] * spread
        self.distributed = self.f.copy()
        for end, i in zip(self.packing.ends, (1, -2), strict=True):
            self.f[i] += end.load.force
        self.lever = np.zeros_like(self.f)
        self.points: list[PointLoad] = []
        for x, load in ((x, station.load) for x, station in self.packing.stations if station.loaded):
            i = self.vertex(x)
            share = self.l[[i, i - 1]] / (self.l[i - 1] + self.l[i])  # of the edges in front of it and behind it
            self.f[i] += load.force
            beyond = x - self.nodes[i - 1]
            if beyond != 0.0:
                other = i + (1 if beyond > 0.0 else -1)
                part = beyond / (self.nodes[other - 1] - self.nodes[i - 1]) * load.force
                self.lever[other] += part
                self.lever[i] -= part
            self.couples[[i - 1, i]] += share[:, None] * load.moment
            c = symmetric(self.packing.columns(self.nodes[i - 1 : i])[:, BINV : BINV + 6])[0]
            c *= 0.5 * share[0] * self.l[i - 1]
            p = load.section_force
            d = load.section_moment + beyond * np.array([-p[1], p[0], 0.0])
            self.points.append(PointLoad(np.array([i - 1, i]), share, c, p, d, load.moment, load.eccentric))
        self.f += self.lever
        followers = [self.section_force, *(point.force for point in self.points)]
        loads = sum(float(np.sum(np.abs(part))) for part in (self.f, self.C, *followers))
        self.penalty = PENALTY + (PENALTY_OF_LOADS if self.cable is None else PENALTY_OF_CABLE) * loads
        self.EA = np.full(self.edges + 2, self.penalty)
        if self.problem.rod.stretch:
            self.EA[1:-1] = 1.0 / on_edges[1:-1, SINV + 2]
        self.EA[[0, -1]] = 1.0  # a ghost's length is held
        self.own_EA = self.EA[1:-1].copy() if self.problem.rod.stretch else None

    def vertex(self, x: float) -> int:
        """Return the number of the vertex at x = s / L, ghosts counted."""
        return 1 + self.cells.vertex(x)

    def _stations(self) -> list[tuple[int, EndConditions, Block]]:
        """Return the supports between the ends: the vertex, the conditions, the vertex's unknowns."""
        held = [(self.vertex(x), conditions) for x, conditions in self.packing.stations if conditions.holds]
        return [(i, conditions, Block(self.unknowns, 4 * i, 3)) for i, conditions in held]

    def _fixed(self) -> NDArray[np.bool_]:
        fixed = np.zeros(self.unknowns, dtype=bool)
        for end, frozen, edge in zip(self.ends, self.frozen, (slice(7, 11), slice(-11, -7)), strict=True):
            fixed[end.block.part] = end.fixed
            fixed[edge] = frozen
        for _, conditions, block in self.between:
            fixed[block.part] = conditions.held_places
        return fixed

    def elasticity(self, T: Array) -> Elasticity:
        """Return what resists, with the multipliers T."""
        first, stop = 2 if self.frozen[0] else 1, self.edges + (1 if self.frozen[1] else 2)
        return Elasticity(self.stiffness, self.kappa0, self.l, self.EA, T, first, stop)

    def loads(self, load_factor: float) -> Loads:
        """Return what acts on the vertices at a load factor; the last answer is kept, for it is asked for again."""
        if load_factor != self._loaded[0]:
            self._loaded = (load_factor, Loads((load_factor * self.f).ravel(), (load_factor * self.C).ravel()))
        return self._loaded[1]

    def edge_loads(self, shape: Shape, load_factor: float) -> EdgeLoads:
        """Return the loads that follow the shape, with their derivatives; the dead couples among M."""
        R = self.frames(shape)
        force, couple = load_factor * self.section_force, load_factor * self.section_couple
        F, M = np.einsum("nij,nkj->nki", R, force), np.einsum("nij,nj->ni", R, couple)
        loads = EdgeLoads(
            F, np.zeros((*F.shape, 3)), -_cross_matrices(F), M, np.zeros((*M.shape, 3)), -_cross_matrices(M)
        )
        for point in self.points:
            for j, share, vertex in zip(point.edges, point.share, (1, 0), strict=True):
                own = point.on_edge(R[j], load_factor)
                for part, value in zip((loads.F, loads.F_phi), own[:2], strict=True):
                    part[j, vertex] += share * value
                for part, value in zip((loads.M, loads.M_phi), own[2:], strict=True):
                    part[j] += share * value
        if self.problem.of_shape:
            self._add_of_shape(shape, R, load_factor, loads)
        loads.M[:] += load_factor * self.couples
        return loads

    def _add_of_shape(self, shape: Shape, R: Array, load_factor: float, loads: EdgeLoads) -> None:
        """Add the loads that are functions of the shape, read at the middle of each edge."""
        x, R = shape.state.x.reshape(-1, 3)[1:-1], R[1:-1]
        values = self.packing.of_shape(0.5 * (self.nodes[:-1] + self.nodes[1:]), 0.5 * (x[:-1] + x[1:]), R)
        values *= load_factor * self.l[1:-1, None]
        parts = [values[:, at : at + 21] for at in (0, SHAPED_COUPLE)]
        forces, couples = (
            (own[:, :3], own[:, 3:12].reshape(-1, 3, 3), own[:, 12:].reshape(-1, 3, 3) @ R.transpose(0, 2, 1))
            for own in parts
        )
        for i in range(3):  # half of a force on either vertex
            loads[i][1:-1] += 0.5 * forces[i][:, None]
            loads[3 + i][1:-1] += couples[i]

    # -- the unloaded rod ----------------------------------------------------------------------------------------

    def unloaded(self) -> Shape:
        """Return where the path begins, with every spring at rest: the natural shape, a ring's circle, a cable's sag."""
        if self.start is not None:
            x, R, twists = self._shaped(self.start)
        elif self.problem.link is not None:
            x, R, twists = self._circle(self.problem.link)
        elif self.cable is not None:
            x, R, twists = self._shaped(self.cable)
        else:
            x, R, twists = self._laid()
        shape = self._shape(x, R, twists)
        placing, given = self.packing.laid()[0], self.closed or bool(self.cable or self.start)
        for end, k in zip(self.ends, (0, -1), strict=True):
            if end.conditions.holds and (end.conditions is not placing or given):
                place = x[k] - end.outward * end.overhang * R[k, :, 2]
                pose = np.concatenate([place, frames.quaternion_of_matrix(R[k])])
                end.conditions.grow_from(pose, all_at_once=given)
            end.at(0.0)
        for k, conditions, _ in self.between:
            if conditions is not placing:
                conditions.grow_from(np.concatenate([x[k - 1], [1.0, 0.0, 0.0, 0.0]]))
        if given:
            self.first = np.empty_like(self.natural)
            discrete_rod.strains(shape.state, 1, self.edges + 2, self.first)
        return self.posed(shape, 0.0)

    def in_shape(self, shape: FirstShape, load_factor: float) -> Shape:
        """Return another shape, with what the supports hold where it belongs at a load factor."""
        return self.posed(self._shape(*self._shaped(shape)), load_factor)

    def _shape(self, x: Array, R: Array, twists: Array) -> Shape:
        """Return the shape of vertices, frames and twists, without tensions."""
        state = State(
            np.zeros(3 * (self.edges + 3)), np.zeros(3 * (self.edges + 4)), np.zeros(3 * (self.edges + 4)), twists
        )
        state.x[3:-3] = x.ravel()
        state.t[3:-3], state.d1[3:-3] = R[:, :, 2].ravel(), R[:, :, 0].ravel()
        grooved = [sum(end.conditions.held_places) if end.groove else 0 for end in self.ends]
        for end, edge in zip(self.ends, (0, -1), strict=True):
            self._put(state, end, R[edge])
        return Shape(state, np.zeros(self.edges + 2), tuple(np.zeros(k) for k in grooved))

    def _laid(self) -> tuple[Array, Array, Array]:
        """Return vertices, frames and twists of the natural shape, laid against the support that holds it."""
        N = self.edges
        rest = self.natural.reshape(-1, 3)[1:-1].copy()
        rest[[0, -1]] *= ~np.array(self.frozen)[:, None]  # no spring: the ghost edge runs on along its neighbour
        q = np.empty((N + 2, 4))
        discrete_rod.chain_frames(rest.ravel(), q.ravel())
        R = frames.matrix_of_quaternion(q)
        x = self._joined(R)
        support, place, orientation = self.packing.laid()
        i = self.cells.vertex(place)
        at = {0: 0, N: N + 1}.get(i, i)
        chord = x[-1] - x[0]
        chord /= np.linalg.norm(chord) if np.any(chord) else 1.0
        turn = orientation @ R[at].T if orientation.shape == (3, 3) else smallest_rotation(chord, orientation)
        hung = hanging(self.problem, *self._pulls((x - x[i]) @ turn.T, turn @ R, support))
        turn = turn if hung is None else hung @ turn
        x = (x - x[i]) @ turn.T + support.place
        return x, turn @ R, np.concatenate([[0.0], rest[:, 2], [0.0]])

    def _pulls(self, x: Array, R: Array, support: EndConditions) -> tuple[Array, Array, Array]:
        """Return arms (n, 3), forces and gradients for `hanging`, of the vertices x (N + 1, 3) and the frames R (N + 2, 3, 3)."""
        eccentric = [(R[k], end.conditions.load.eccentric) for end, k in zip(self.ends, (0, -1), strict=True)]
        eccentric += [(np.tensordot(point.share, R[point.edges], 1), point.eccentric) for point in self.points]
        C = symmetric(self.C[1:-1])
        return (
            np.concatenate([x, *(frame.T for frame, _ in eccentric)]),
            np.concatenate([self.f[1:-1] + C @ support.place, *(A.T for _, A in eccentric)]),
            np.concatenate([C, np.zeros((3 * len(eccentric), 3, 3))]),
        )

    def _circle(self, link: float) -> tuple[Array, Array, Array]:
        """Return vertices, frames and twists of a ring's regular polygon, whose sections turn evenly by the link."""
        first = circle(self.packing, link)
        R0 = frames.matrix_of_quaternion(first.q)
        axis = R0[:, :2] @ first.k(np.zeros(1))[0, :2]
        s = np.arange(self.edges) / (self.edges - 1)  # of the middles of the edges
        s = np.concatenate([s[:1], s, s[-1:]])
        own = np.outer(frames.turn * link * s, [0.0, 0.0, 1.0])
        bent, spun = (frames.matrix_of_quaternion(frames.quaternion_of_turn(v)) for v in (np.outer(s, axis), own))
        R = bent @ R0 @ spun
        x = first.r + self._joined(R) - 0.5 * self.l[1] * R0[:, 2]
        return x, R, np.concatenate([[0.0], np.diff(own[:, 2]), [0.0]])

    def _shaped(self, shape: FirstShape) -> tuple[Array, Array, Array]:
        """Return vertices, frames and twists of a given shape, at the middles of the edges and at both ends."""
        middles = 0.5 * (self.nodes[:-1] + self.nodes[1:])
        places, q = shape.states(np.concatenate([[0.0], middles, [1.0]]))
        R = frames.matrix_of_quaternion(q)
        first = places[0] - (
            0.5 * self.l[1] * R[0, :, 2] if self.closed else 0.0
        )  # a ring begins in the middle of an edge
        return first + self._joined(R), R, np.zeros(self.edges + 3)

    def _joined(self, R: Array) -> Array:
        """Return the vertices (N + 1, 3) from the origin on of edges at rest with the frames R (N + 2, 3, 3)."""
        return np.concatenate([np.zeros((1, 3)), np.cumsum(self.l[1:-1, None] * R[1:-1, :, 2], axis=0)])

    # -- moving --------------------------------------------------------------------------------------------------

    def frames(self, shape: Shape) -> Array:
        """Return the frames of the edges, ghosts included: (N + 2, 3, 3)."""
        t, d1 = (part[3:-3].reshape(-1, 3) for part in shape.state[1:3])
        return np.stack([d1, np.cross(t, d1), t], axis=-1)

    def _ends(self, state: State) -> Iterable[tuple[End, int, Array, Array]]:
        """Return the ends with which of both they are, the place of their vertex and their frame."""
        x, t, d1 = (part.reshape(-1, 3) for part in state[:3])
        for k, end in enumerate(self.ends):
            i, j = (1, 1) if k == 0 else (-2, -2)
            yield end, k, x[i], frames.frame_of(t[j], d1[j])

    @staticmethod
    def _put(state: State, end: End, R: Array) -> None:
        """Give an end's ghost edge the frame R, where its vertex is."""
        x, t, d1 = (part.reshape(-1, 3) for part in state[:3])
        i, j, ghost = (1, 1, 0) if end.outward < 0.0 else (-2, -2, -1)
        t[j], d1[j] = R[:, 2], R[:, 0]
        x[ghost] = x[i] + end.outward * end.ghost * R[:, 2]

    @property
    def _pieces(self) -> list[tuple[int, int, bool, bool]]:
        """The parts between vertices that supports place: from, to, and whether either end is placed."""
        inner = [i for i, conditions, _ in self.between if any(conditions.held_places)]
        places = [(1, self.ends[0].places), *((i, True) for i in inner), (self.edges + 1, self.ends[1].places)]
        return [(i, j, a, b) for (i, a), (j, b) in itertools.pairwise(places)]

    def moved(self, shape: Shape, step: Array, scale: float) -> Shape:
        """Return the shape after a packed step; edges turn rather than shear, multipliers take up what is held by them."""
        x, t, _, _ = shape.state
        turned = np.zeros_like(step)
        frozen = int(any(self.frozen))
        for i, j, *placed in self._pieces:
            own = slice(4 * i, 4 * j + 3)
            arguments: Any = (x[3 * i : 3 * j + 3], self.l[i:j], step[own], scale, self.inextensible, *placed, frozen)
            arguments = (*arguments, turned[own])
            discrete_rod.turning_step(*arguments)
        new = _advanced(shape.state, turned)
        reactions = list(shape.reactions)
        for end, k, place, R in self._ends(shape.state):
            seven = step[end.block.part]
            if end.rigid and not seven.any():
                continue
            turn = end.turn(seven, R)
            if end.groove:
                c, by_unknowns, _ = end.out_of_groove(place, R)
                change = by_unknowns @ np.concatenate([turn, seven[end.near]])
                reactions[k] = reactions[k] + self.penalty * (c + scale * change)
            R = frames.rotation(scale * turn) @ R
            self._put(new, end, end.held_frame(R) if end.universal else R)
        T = shape.T
        if self.inextensible:
            moves = np.diff(np.append(step, 0.0).reshape(-1, 4)[:, :3], axis=0)
            strain = scale * np.einsum("ni,ni->n", t[3:-3].reshape(-1, 3), moves) / self.l
            T = T + self.EA * (np.pad(self.stretch(shape), 1) + strain)
            T[[0, -1]] = 0.0
        return shape._replace(state=new, T=T, reactions=tuple(reactions))

    def settled(self, shape: Shape) -> None:
        """Keep the twists of an accepted state, so that whole turns are not lost."""
        first, stop = self.elasticity(shape.T)[-2:]
        discrete_rod.strains(shape.state, first, stop, np.empty(3 * (self.edges + 3)))

    def at(self, load_factor: float) -> None:
        """Take the poses that the supports prescribe at a load factor, and what is left of a first shape that was lent."""
        if self.first is not self.natural:
            self.kappa0 = self.first + load_factor * (self.natural - self.first)
        for end in self.ends:
            if end.load_factor != load_factor:
                end.at(load_factor)

    @property
    def still(self) -> bool:
        """True where no support moves on the way: its clamps are fixed, and its other ends hold nothing."""
        growing = any(conditions.grows for _, conditions, _ in self.between)
        return not growing and all(
            end.bare and not end.conditions.grows and end.conditions.twist == 0.0 for end in self.ends
        )

    def posed(self, shape: Shape, load_factor: float) -> Shape:
        """Put what the supports hold where it belongs at a load factor."""
        self.at(load_factor)
        if self.still:
            return shape
        x = shape.state.x.reshape(-1, 3)
        new, held = x.copy(), []
        for end, k, place, R in self._ends(shape.state):
            vertex, inner = (1, 2) if k == 0 else (-2, -3)
            held.append(end.held_frame(R))
            new[vertex] = end.held_place(place)
            if self.frozen[k]:
                new[inner] = new[vertex] - end.outward * self.l[vertex] * held[k][:, 2]
        for i, conditions, _ in self.between:
            A = conditions.held_axes
            new[i] += A.T @ (A @ (conditions.pose(load_factor)[0] - x[i]))
        step = np.zeros((self.edges + 3, 4))
        step[:, :3] = new - x
        state = _advanced(shape.state, step.ravel()[:-1])
        t, d1 = (part.reshape(-1, 3) for part in state[1:3])
        for end, R, frozen, inner in zip(self.ends, held, self.frozen, (2, -3), strict=True):
            self._put(state, end, R)
            if frozen:
                t[inner], d1[inner] = R[:, 2], R[:, 0]
        return shape._replace(state=state)

    def rates(self, shape: Shape, there: Shape, step: float) -> Array:
        """Return how fast what is held moves, from a shape to where it is posed a step further: the unknowns."""
        moves = np.zeros((self.edges + 3, 4))
        moves[:, :3] = (there.state.x - shape.state.x).reshape(-1, 3) / step
        result = moves.ravel()[:-1]
        for (end, _, x, R), (_, _, new_x, new_R) in zip(self._ends(shape.state), self._ends(there.state), strict=True):
            result[end.block.part] = end.packed_pose((new_x - x) / step, frames.rotation_vector(new_R @ R.T) / step, R)
        for _, conditions, block in self.between:
            result[block.part] = conditions.place_axes.T @ result[block.part]
        return result

    # -- what the supports make of the equations -----------------------------------------------------------------

    def hold(self, shape: Shape, load_factor: float, band: Array, gradient: Array, symmetric: bool) -> None:
        """Bring a band and its gradient to the supports' unknowns, with what supports and end loads add."""
        for end, k, x, R in self._ends(shape.state):
            if not end.rigid:  # all of what a clamp holds is fixed afterwards
                end.hold(band, gradient, x, R, shape.reactions[k], self.penalty, symmetric)
        x = shape.state.x.reshape(-1, 3)
        for i, conditions, block in self.between:
            A, K = conditions.place_axes, conditions.stiffness[:3, :3]
            block.transform(band, gradient, A, A.T @ K @ A, symmetric)
            gradient[block.part] += A.T @ K @ (x[i] - conditions.pose(load_factor)[0])

    def transform(self, shape: Shape, lower: Array) -> None:
        """Bring a symmetric band from packed unknowns to those of the supports."""
        nothing = np.zeros(self.unknowns)
        for end, _, _, R in self._ends(shape.state):
            end.block.transform(lower, nothing, end.transformation(R), np.zeros((7, 7)), True)
        for _, conditions, block in self.between:
            block.transform(lower, nothing, conditions.place_axes, np.zeros((3, 3)), True)

    def packed(self, shape: Shape, step: Array) -> Array:
        """Return the packed step of a step in the supports' unknowns."""
        result = step.copy()
        for end, _, _, R in self._ends(shape.state):
            if step[end.block.part].any():
                result[end.block.part] = end.transformation(R) @ step[end.block.part]
        for _, conditions, block in self.between:
            result[block.part] = conditions.place_axes @ step[block.part]
        return result

    def energy_of_supports(self, shape: Shape, load_factor: float) -> float:
        """Return the energy of springs, grooves and eccentric forces."""
        energy, R = 0.0, self.frames(shape) if self.points else np.empty(0)
        for point in self.points:
            energy += sum(
                share * point.energy(R[j], load_factor) for j, share in zip(point.edges, point.share, strict=True)
            )
        for end, k, x, R in self._ends(shape.state) if any(end.stores for end in self.ends) else ():
            energy += end.energy(x, R, shape.reactions[k], self.penalty)
        x = shape.state.x.reshape(-1, 3)
        for i, conditions, _ in self.between:
            u = x[i] - conditions.pose(load_factor)[0]
            energy += 0.5 * float(u @ conditions.stiffness[:3, :3] @ u)
        return energy

    def add_eccentric(self, shape: Shape, load_factor: float, gradient: Array, lower: Array) -> None:
        """Add gradient and Hessian of the eccentric forces between the ends, where all loads have a potential.

        The couple M of an edge, which depends on its frame by dM/dphi, adds what `discrete_rod.add_couples` and
        `add_edge_loads` do, here symmetric.
        """
        R, x = self.frames(shape), shape.state.x.reshape(-1, 3)
        for point in self.points:
            for j, share in zip(point.edges, point.share, strict=True):
                _, _, M, by_turn = point.on_edge(R[j], load_factor)
                t, M, by_turn, r = R[j, :, 2], share * M, share * by_turn, 1.0 / np.linalg.norm(x[j + 1] - x[j])
                own, along = r * cross_matrix(t), float(M @ t)
                by_edge = own @ by_turn @ own + r * r * (
                    0.5 * along * cross_matrix(t) - cross_matrix(M) @ (np.eye(3) - 2.0 * np.outer(t, t))
                )
                edge_angle, force = own @ by_turn @ t, own @ M
                H = np.zeros((7, 7))
                H[:3, :3] = H[4:, 4:] = by_edge
                H[4:, :3] = -by_edge
                H[3, :3], H[4:, 3], H[3, 3] = -edge_angle, edge_angle, -t @ by_turn @ t
                p, q = np.tril_indices(7)
                lower[LOWER * (4 * j + q) + p - q] += H[p, q]
                gradient[4 * j : 4 * j + 7] += np.concatenate([-force, [-along], force])

    def lend(self, load_factor: float) -> None:
        """Let a rod that is held twice stretch on the way, less and less."""
        if self.own_EA is not None and self.lent:
            self.EA[1:-1] = 1.0 / (1.0 / self.own_EA + (1.0 - load_factor) / SLACK)
        elif self.lent:
            self.EA[1:-1] = min(SLACK / max(1.0 - load_factor, 1e-12), self.penalty)

    def taken_back(self, shape: Shape) -> Shape:
        """Take back at the end what was lent: what pulled at a stretched edge becomes its multiplier T."""
        if not self.lent or self.own_EA is not None:
            return shape
        self.inextensible = True
        return self.moved(shape, np.zeros(self.unknowns), 0.0)

    def stretch(self, shape: Shape) -> Array:
        """Return by how much each edge is longer than at rest, relatively: (N,)."""
        edges = np.diff(shape.state.x.reshape(-1, 3)[1:-1], axis=0)
        return np.asarray(np.linalg.norm(edges, axis=1) / self.l[1:-1] - 1.0)

    def turn(self, step: Array) -> float:
        """Return the largest turn of an edge in a packed step, or its largest displacement; not a number if one is none."""
        return float(discrete_rod.largest_turn(self.l, step))


def _axial(G: Array) -> Array:
    """Return the sum of e_i x g_i (3,), g_i the columns of G (3, 3)."""
    return np.array([G[2, 1] - G[1, 2], G[0, 2] - G[2, 0], G[1, 0] - G[0, 1]])


def _ghosted(values: Array) -> Array:
    """Return an array with zeros in front and behind: (n + 2, ...)."""
    return np.pad(values, [(1, 1), *[(0, 0)] * (values.ndim - 1)])


def _cross_matrices(a: Array) -> Array:
    """Return [a]_x of vectors (..., 3): (..., 3, 3)."""
    return np.cross(a[..., None, :], np.eye(3)).swapaxes(-1, -2)


def _advanced(state: State, step: Array) -> State:
    """Return the state after a packed step; the twists stay those of before, to count whole turns by."""
    new = State(np.empty_like(state.x), np.empty_like(state.t), np.empty_like(state.d1), state.m.copy())
    discrete_rod.advance(state, step, 1.0, new)
    return new


def places_of_vertices(problem: Equilibrium, segments: int) -> list[float]:
    """Return the places, over L, that need a vertex of their own: all supports, and point loads that are not close to one of those.

    An edge much shorter than the others is so stiff that rounding hides the rest; a load acts beyond its vertex by a lever.
    """
    L = problem.rod.length
    places = [s / L for s, _ in problem.between]
    for s in problem.stations:
        if all(abs(s / L - other) > CLOSE / segments for other in (0.0, *places, 1.0)):
            places.append(s / L)
    return sorted(places)


def nodes_along(
    segments: int, grading: float, start_held: bool, end_held: bool, stations: Sequence[float] = (), halvings: int = 0
) -> Array:
    """Return segments + 1 nodes on [0, 1] whose spacing grows smoothly, by the factor ``grading``, away from held ends.

    s(x) = (g^x - 1) / (g - 1),   mirrored for the other end, and in two halves where both ends are held

    ``stations``, in their order, are met each by a node of its own next to it, which takes the others along; each segment is
    then halved ``halvings`` times. Raises ``InvalidInput`` where there are more stations than nodes between the ends.
    """

    def away_from_start(x: Array) -> Array:
        return x if grading == 1.0 else np.asarray(np.expm1(x * np.log(grading)) / (grading - 1.0))

    def back(s: Array) -> Array:
        return s if grading == 1.0 else np.asarray(np.log1p(s * (grading - 1.0)) / np.log(grading))

    def spaced(x: Array, law: Callable[[Array], Array]) -> Array:
        if start_held and end_held:
            half = 0.5 * law(1.0 - np.abs(2.0 * x - 1.0))
            return np.where(x <= 0.5, half, 1.0 - half)
        return law(x) if start_held else 1.0 - law(1.0 - x)

    fine = np.linspace(0.0, 1.0, segments * 2**halvings + 1)
    if len(stations):
        wanted = spaced(np.array(stations), back)
        nearest = _one_each(np.rint(wanted * segments), segments)
        fine = np.interp(fine, [0.0, *(nearest / segments), 1.0], [0.0, *wanted, 1.0])
    nodes = spaced(fine, away_from_start)
    for s, i in zip(stations, nearest.astype(int) if len(stations) else (), strict=True):
        nodes[i * 2**halvings] = s  # to the last bit
    return nodes


def _one_each(nearest: Array, segments: int) -> Array:
    """Return the nodes between the ends next to the ones asked for, in rising order, such that no two are the same."""
    count = len(nearest)
    if count >= segments:
        raise InvalidInput(
            f"segments is {segments}, but loads or supports act at {count} places between the ends, each of which needs a vertex; "
            f"take {count + 1} segments or more."
        )
    order = np.arange(count)
    rising = np.maximum.accumulate(np.maximum(nearest - order, 1.0))
    return np.asarray(np.minimum(rising, segments - count) + order)


def nodes_wanted(problem: Equilibrium, segments: int) -> tuple[list[float], bool]:
    """Return the places in [0, 1] at which a rod's nodes should lie, its stations and jumps, and whether all jumps are there.

    On a node a jump leaves the order, and the expansion of the error, what they are. One that lies next to another place stays
    within a segment.
    """
    places = places_of_vertices(problem, segments)
    left_out = False
    for jump in (s / problem.rod.length for s in problem.jumps):
        apart = min((abs(jump - x) for x in (0.0, 1.0, *places)), default=1.0) * segments
        if apart > APART and len(places) < segments // 2:
            places.append(jump)
        else:
            left_out = left_out or apart > 0.0
    return sorted(places), not left_out and len(places) < segments
