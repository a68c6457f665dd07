"""A motion in the numbers that the kernels read: dimensionless, discrete, at its start."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux import frames, profile
from darboux.dynamics import closing, holding
from darboux.dynamics.acting import FREE, HELD, TURNING, acting, datum
from darboux.dynamics.limits import refuses
from darboux.errors import InvalidInput
from darboux.kernels import discrete_rod, rod_motion
from darboux.kernels.band import FULL, LOWER
from darboux.kernels.discrete_rod import Elasticity, State
from darboux.kernels.ring import CORNER, LANES
from darboux.kernels.rod_equations import BINV, K0, SINV
from darboux.kernels.rod_motion import FACTORS, Body, Space, Turning
from darboux.loads import Load
from darboux.motion import Motion
from darboux.natural import smallest_rotation
from darboux.packing.cells import six, symmetric
from darboux.packing.ends import EndConditions
from darboux.packing.problem import Packing
from darboux.problem import Equilibrium
from darboux.solution import EquilibriumSolution
from darboux.statics.discrete_chain import nodes_along
from darboux.statics.discrete_ends import End
from darboux.statics.first_shape import circle
from darboux.statics.solve import solve

Array = NDArray[np.float64]

EXACT = 1e-9  # relative: an inextensible segment's length
ROUNDING = 1e-15  # of the length: what an edge may be off its own that is not fitted
NEAR = 0.1  # of the length: a shape further than this off its supports is not fitted between them
GAP = 1e-6  # of the length, by which a shape may miss a support
FOLDED = 1e-9 - 1.0  # the cosine of a turn that has no plane
SETTLED = 1e-11  # rad, to which that equilibrium is found
FOREVER = 1e5  # a stage this long is an equilibrium
RELAXING = tuple(10.0 ** np.arange(-5, 3))  # stages by which it is approached where it is far
SLOW = (0.1, 1.0, 1.0)  # stages that a ring takes to it, held by its inertia alone
FEWEST = 3  # segments of a ring
ENDS = ("start", "end")


class Units(NamedTuple):
    """What one is, in SI units, of each dimensionless quantity."""

    length: float
    time: float
    mass: float
    energy: float
    origin: Array


class System:
    """A rod of N equal segments that a motion describes: what resists, its mass, its supports, where it starts.

    Mass is spread along the edges, or, where ``spread`` is False, stands in the vertices. The kernels see a chain of
    ``edges``: N, and of a ring one more, the first once again; see kernels/ring.py.
    """

    def __init__(self, motion: Motion, segments: int, spread: bool = True) -> None:
        self.motion, self.segments, self.spread = motion, segments, spread
        problem = motion.problem
        self.link = problem.link
        self.edges = segments + int(self.link is not None)
        if self.link is not None and segments < FEWEST:
            raise InvalidInput(f"a Ring has {FEWEST} segments or more, but the method has {segments}.")
        self.packing = Packing(problem)
        self.scale = self.packing.scale
        L, energy = self.scale.length, self.scale.moment
        mass = float(np.mean(self.packing.masses(np.linspace(0.0, 1.0, 17), "Motion")))
        self.units = Units(L, L * np.sqrt(mass / energy), mass, energy, self.scale.origin)
        self.nodes = nodes_along(segments, 1.0, False, False, [x for x, _ in self.packing.stations])
        self.cells = self.packing.cells(self.nodes)
        self.l = self.cells.l
        self.inextensible = not problem.rod.stretch
        self.groups = _groups(motion)
        self._discretise(problem)
        self.datum = datum(self.packing, [loads for _, _, loads in self.groups], self.cells)
        self.body = self.body_at(0.0)
        self.space = new_space(self.edges, self.link is not None)
        self._steady: Array | None = None

    # -- from the rod to the numbers -----------------------------------------------------------------------------

    def _discretise(self, problem: Equilibrium) -> None:
        """Average compliance, natural shape, mass and loads over the cells of the vertices and over the edges."""
        cells, units, V = self.cells, self.units, self.cells.V
        at_vertices, on_edges = cells.at_vertices(self.packing.columns), cells.on_edges(self.packing.columns)
        compliance = symmetric(at_vertices[:, BINV : BINV + 6])
        k0 = cells.natural_rates(at_vertices[:, K0 : K0 + 3])
        self.V, compliance, k0 = (
            (V, compliance, k0) if self.link is None else closing.joined(self.link, V, compliance, k0)
        )
        self.B = six(np.linalg.inv(compliance) / self.V[:, None, None])
        self.kappa0 = k0 * self.V[:, None]
        self.EA = self._chained(np.ones(self.segments) if self.inextensible else 1.0 / on_edges[:, SINV + 2])
        self.frame_spin = np.array((*problem.frame_spins, (0.0, 0.0, 0.0))[0]) * units.time

        def inertia(x: Array) -> Array:
            """The mass per length and, about the tangent, the rotary inertia (n, 2)."""
            rotary = self.packing.masses.rotary(x, self.motion.rotary_inertia) / units.length**2
            return np.stack([self.packing.masses(x, "Motion"), rotary], axis=1) / units.mass

        mass = cells.at_vertices(inertia)[:, 0] * V
        edges, J = cells.on_edges(inertia).T * self.l
        self.sixth = self._chained(edges / 6.0 if self.spread else np.zeros(self.segments))
        packed = np.repeat(self._chained(mass)[:, None], 4, axis=1)
        packed[:-1, 3] = self._chained(J)
        self.mass = packed.ravel()[:-1].copy()
        self._brake()

    def _chained(self, values: Array, again: float = 0.0) -> Array:
        """Return numbers of vertices or edges (n,) of the chain: a ring's have one more, that of what stands twice."""
        return values if self.link is None else np.append(values, again)

    def _brake(self) -> None:
        units = self.units
        force = self.scale.force / units.length  # per length
        self.slowness, self.times = 0.0, np.zeros(3)
        for part in self.motion.damping:
            self.slowness += part.slowing * units.time
            self.times += np.array(part.times) / units.time
        drag = np.zeros((len(self.motion.drags), 2, 2))
        for own, part in zip(drag, self.motion.drags, strict=True):
            speed = units.length / units.time
            own[part.power - 1] = np.array([part.along, part.across]) * speed**part.power / force
        self.drag = drag.ravel()

    def body_at(self, t: float) -> Body:
        """Return what holds just after the time t in s: a released end is free."""
        N = self.edges
        start, end = (self.motion.held(at, t) for at in ENDS)
        supports = holding.supports_at(self.packing, (start, end), self.cells)
        kinds = [holding.kind_of(support) for _, support in supports[:2]]
        fixed = np.zeros(4 * N + 3, dtype=bool)
        fixed[:3], fixed[-3:] = (holding.moves_with(i, self.segments, support) for i, support in supports[:2])
        loads = [self.packing.group(part) for _, _, part in self.groups]
        acts = acting(self.packing, loads, self.cells, self.B, self.kappa0, kinds, self.link is not None)
        ghosts = holding.ghosts(supports)
        rod = Elasticity(
            self.B.ravel(), self.kappa0.ravel(), self._chained(self.l, self.l[0]), self.EA, np.zeros(N),
            1 if kinds[0] == FREE else 0, N if kinds[1] == FREE else N + 1,
        )  # fmt: skip
        return Body(
            rod, acts.loads, acts.couples, acts.carried,
            holding.holds(supports, self.segments, self.link is not None),
            Turning(*ghosts, acts.moments, acts.section_moments, acts.eccentric),
            self.frame_spin, self.mass, self.sixth, self.slowness,
            (self.B * self.times[[0, 0, 1, 0, 0, 0]]).ravel(), self.EA * self.times[2], self.drag, fixed, self.inextensible,
            np.zeros(0) if self.link is None else closing.angle(self.link),
        )  # fmt: skip

    # -- the start -----------------------------------------------------------------------------------------------

    def start(self) -> tuple[State, Array]:
        """Return the state and the packed velocities at t = 0."""
        initial = self.motion.initial
        if isinstance(initial, str):
            problem = self.motion.problem
            if initial == "equilibrium":
                state = self._settled(solve(problem))
            else:
                state = self._unloaded() if self.link is None else self._circle(self.link)
        elif isinstance(initial, EquilibriumSolution):
            state = self._settled(initial)
        else:
            state = self._laid(initial)
        if self.link is not None:
            self._hang(state)
        self._check_place(state)
        rod_motion.turn_ghosts(state, self.body, self.factors_at(0.0), self.space)
        return state, self._velocities(state)

    def _hang(self, state: State) -> None:
        """Shift a ring onto the first support that holds it, which its vertices miss by the square of a segment."""
        x = state.x.reshape(-1, 3)
        supports = holding.supports_at(self.packing, (False, False), self.cells)
        for i, support in (pair for pair in supports if any(pair[1].held_places)):
            shift = support.held_axes.T @ support.held_axes @ (support.place - x[i])
            if np.linalg.norm(shift) < np.max(self.l) ** 2:
                x += shift
            return

    def _unloaded(self) -> State:
        """Return the natural shape, laid at the support that holds it."""
        N, rest = self.segments, self.kappa0.copy()
        for support, vertex in zip(self.packing.ends, (0, N), strict=True):
            if holding.kind_of(support) == FREE:
                rest[vertex] = 0.0
        q = np.empty((N + 2, 4))
        discrete_rod.chain_frames(rest.ravel(), q.ravel())
        R = frames.matrix_of_quaternion(q)
        x = np.concatenate([np.zeros((1, 3)), np.cumsum(self.l[:, None] * R[1:-1, :, 2], axis=0)])
        support, place, orientation = self.packing.laid()
        i = self.cells.vertex(place)
        if orientation.shape == (3, 3):
            turn = orientation @ R[{0: 0, N: N + 1}.get(i, i)].T
        else:
            turn = smallest_rotation((x[-1] - x[0]) / np.linalg.norm(x[-1] - x[0]), orientation)
        R = turn @ R
        x = (x - x[i]) @ turn.T + support.place
        return self._state(x, R[1:-1, :, 0], rest[:, 2])

    def _circle(self, link: float) -> State:
        """Return a ring's polygon, whose sections turn evenly by the link; the one at s = 0 lies where the ring's start is."""
        first = circle(self.packing, link)
        R0, s = frames.matrix_of_quaternion(first.q), 0.5 * (self.nodes[:-1] + self.nodes[1:])
        axis, twist = R0[:, :2] @ first.k(np.zeros(1))[0, :2], frames.turn * link
        turns = np.outer(s, axis), np.outer(s, (0.0, 0.0, twist))
        bent, spun = (frames.matrix_of_quaternion(frames.quaternion_of_turn(turn)) for turn in turns)
        R = bent @ R0 @ spun
        e = self.l[:, None] * R[:, :, 2]
        x = first.r + np.concatenate([np.zeros((1, 3)), np.cumsum(e, axis=0)])
        return self._state(self._of_directions(x, np.ones(len(e))), R[:, :, 0], twist * self.V)

    def _of_directions(self, r: Array, stretch: Array) -> Array:
        """Return vertices (N + 1, 3) whose edges point along those of r (N + 1, 3) and have their proper lengths."""
        e = np.diff(r, axis=0)
        e *= (self.l * stretch / np.linalg.norm(e, axis=1))[:, None]
        if self.link is not None:
            e = closing.closed(e)
        x: Array = np.concatenate([np.zeros((1, 3)), np.cumsum(e, axis=0)])
        first, last = (r - x)[[0, -1]]
        start, end = self.packing.ends
        if self.link is not None or (start.holds and not end.holds):
            x = x + first
        elif not start.holds:
            x = x + last
        else:
            x = x + first + (last - first) * self.nodes[:, None]
        return self._between_supports(x) if self.inextensible else x

    def _between_supports(self, x: Array) -> Array:
        """Return vertices (N + 1, 3) near those given, of edges of their proper lengths, where the supports hold them."""
        held = [(i, axis, float(axis @ place)) for i, support, place in self._places() for axis in support.held_axes]
        gaps = [abs(axis @ x[i] - level) for i, axis, level in held]
        lengths = np.linalg.norm(np.diff(x, axis=0), axis=1)
        if max(gaps, default=0.0) > NEAR or np.max(np.abs(lengths - self.l)) < ROUNDING > max(gaps, default=0.0):
            return x  # `_check_place` says how far off it is
        x = holding.fitted(x, self.l, held, self.link is not None)
        lengths = np.linalg.norm(np.diff(x, axis=0), axis=1)
        if np.max(np.abs(lengths / self.l - 1.0)) > EXACT:
            raise InvalidInput(
                "motion: the rod does not stretch, but from this initial shape its segments can't come to their lengths between "
                "the supports; begin with a shape that has the rod's length between them, or set rod.stretch."
            )
        return x

    def _places(self) -> list[tuple[int, EndConditions, Array]]:
        """Return what holds the rod at the start: vertex, support, and the place (3,) of its displacements, dimensionless."""
        held = self.motion.held("start", 0.0), self.motion.held("end", 0.0)
        supports = holding.supports_at(self.packing, held, self.cells)
        ends = [(self.motion.position(at, 0.0) - self.units.origin) / self.units.length for at in ENDS]
        places = [*ends, *(support.place for _, support in supports[2:])]
        return [(i, support, place) for (i, support), place in zip(supports, places, strict=True)]

    def _settled(self, solution: EquilibriumSolution) -> State:
        """Return the discrete equilibrium beside a solution: a stage that lasts for ever; of a ring some long ones."""
        L, middle = self.units.length, 0.5 * (self.nodes[:-1] + self.nodes[1:])
        r = (solution.r(self.nodes * L) - self.units.origin) / L
        twists = None if self.link is None else solution.k(np.append(self.nodes, 0.0) * L)[:, 2] * L * self.V
        state = self._state(
            self._of_directions(r, solution.v(middle * L)[:, 2]), solution.R(middle * L)[:, :, 0], twists
        )
        motion = Motion(solution.problem, 1.0, solution, rotary_inertia=self.motion.rotary_inertia)
        held = self.link is not None and (solution.problem.loads or solution.problem.between)  # as it then is no more
        if self.inextensible or held or refuses(motion):
            return state
        other = System(motion, self.segments)
        row = other.drive([0.0], 0.0)[0]
        row[rod_motion.VELOCITY : rod_motion.VELOCITY + 6] = 0.0
        other.space.base[:] = 0.0
        found = other._at_rest(state, row, FOREVER) if self.link is None else None
        if found is None:
            found = state  # a stiff rod between two supports is far from it: its edges first come to their lengths
            for tau in SLOW if self.link is not None else (*RELAXING, FOREVER):
                found = other._at_rest(found, row, tau) or found
        return found

    def _at_rest(self, state: State, row: Array, tau: float) -> State | None:
        """Return where a stage of length tau ends that starts from rest; None where it does not converge."""
        now, V = new_state(self.edges), np.zeros(self.body.mass.size)
        done = rod_motion.stage(state, V.copy(), tau, V, self.body, row, False, SETTLED, self.space, now)
        now.m[:] = state.m
        discrete_rod.strains(now, self.body.rod.first, self.body.rod.stop, np.empty(self.kappa0.size))
        return now if done >= 0 else None

    def _laid(self, shape: Callable[[Array], Any]) -> State:
        """Return the shape r(s) that was given, with the frames that do not twist along it, from the support's on."""
        L = self.units.length
        r = (profile.evaluate("motion.initial", shape, self.nodes * L, (3,)) - self.units.origin) / L
        if self.link is not None:
            gap = float(np.linalg.norm(r[-1] - r[0]))
            if gap > GAP:
                raise InvalidInput(
                    f"motion.initial leaves the ring open: its end is {gap * L:.3g} m off its start; give r(L) = r(0)."
                )
            r[-1] = r[0]
        e = np.diff(r, axis=0)
        long = np.linalg.norm(e, axis=1) / self.l
        if np.any(long < 1e-3):
            raise InvalidInput(
                "motion.initial puts two points of the rod in one place; give r as a function of s in m."
            )
        if self.inextensible:
            if np.max(np.abs(long - 1.0)) > 0.01:
                raise InvalidInput(
                    f"motion.initial stretches the rod by up to {np.max(np.abs(long - 1.0)):.2g}, but it does not stretch; give r "
                    "by arc length, or set rod.stretch."
                )
            r = self._of_directions(r, np.ones(self.segments))
        t = np.diff(r, axis=0)
        t /= np.linalg.norm(t, axis=1)[:, None]
        along = t if self.link is None else np.append(t, t[:1], axis=0)
        cosines = np.sum(along[1:] * along[:-1], axis=1)
        if np.any(cosines < FOLDED):
            s = self.nodes[int(np.argmin(cosines)) + 1] * L
            raise InvalidInput(f"motion.initial folds the rod back on itself at s = {s:.4g} m; give a smooth curve.")
        start = self.packing.start
        R = start.frame if start.clamps and start.frame[:, 2] @ t[0] > FOLDED else frames_along(t[0])
        d1 = carried_along(R, along)
        if self.link is None:
            return self._state(r, d1, None)
        return self._state(r, *closing.evenly_twisted(self.link, r, t, d1, self.nodes, self.V))

    def _state(self, x: Array, d1: Array, m: Array | None) -> State:
        """Return a state from vertices (N + 1, 3) and the edges' first directors (N, 3); clamps' frames are the drive's."""
        t = np.diff(x, axis=0)
        t /= np.linalg.norm(t, axis=1)[:, None]
        d1 = d1 - np.einsum("ni,ni->n", d1, t)[:, None] * t
        d1 /= np.linalg.norm(d1, axis=1)[:, None]
        if self.link is not None:
            x, t = np.concatenate([x[:-1], x[:2]]), np.append(t, t[:1], axis=0)
            d1 = np.append(d1, [self.body.closing @ (d1[0], np.cross(t[0], d1[0]))], axis=0)
        R = [self._frame_at(at, x, t, d1) for at in ENDS]
        tangents = np.concatenate([R[0][None, :, 2], t, R[1][None, :, 2]])
        directors = np.concatenate([R[0][None, :, 0], d1, R[1][None, :, 0]])
        twists = np.zeros(self.edges + 1) if m is None else m.copy()
        state = State(x.ravel().copy(), tangents.ravel(), directors.ravel(), twists)
        rod = self.body_at(-1.0).rod
        discrete_rod.strains(state, rod.first, rod.stop, np.empty(self.kappa0.size))
        return state

    def _frame_at(self, at: str, x: Array, t: Array, d1: Array) -> Array:
        """Return the frame of an end at t = 0: the support's, or one that it allows next to the edge's."""
        i = 0 if at == "start" else -1
        support = self.packing.ends[i]
        if holding.kind_of(support) != TURNING:
            return self.motion.frame(at, 0.0)
        end = End(support, 1.0, 4 * self.segments + 3)
        return end.held_frame(frames.frame_of(t[i], d1[i]))

    def _check_place(self, state: State) -> None:
        x, t = state.x.reshape(-1, 3), state.t.reshape(-1, 3)
        for k, (i, support, place) in enumerate(self._places()):
            where = f"s = {self.nodes[i] * self.units.length:g} m" if k > 1 else f"its {ENDS[k]}"
            gap = float(np.linalg.norm(support.held_axes @ (x[i] - place)))
            edge, ghost = ((1, 0), (-2, -1))[min(k, 1)]
            away = k < 2 and holding.kind_of(support) == HELD and t[edge] @ t[ghost] < 0.0
            if gap > GAP:
                raise InvalidInput(
                    f"the rod begins {gap * self.units.length:.3g} m off the support at {where}; lay it there: "
                    "initial=solve(problem), or a function of s."
                )
            if away:
                raise InvalidInput(
                    f"the rod begins turned away from the frame of the support at {where}, by more than a right angle; let it "
                    "begin along the support's d3: initial=solve(problem), or a function of s."
                )

    def _velocities(self, state: State) -> Array:
        N, L, unit = self.segments, self.units.length, self.units.length / self.units.time
        V = np.zeros((self.edges + 1, 4))
        if self.motion.velocity is not None:
            V[: N + 1, :3] = profile.vector("motion.velocity", self.motion.velocity, "m/s")(self.nodes * L) / unit
        middle = 0.5 * (self.nodes[:-1] + self.nodes[1:])
        V[:N, 3] = profile.scalar("motion.spin", self.motion.spin, "rad/s", "any")(middle * L) * self.units.time
        if self.link is not None:
            if np.max(np.abs(V[N, :3] - V[0, :3])) > GAP * np.max(np.abs(V[:, :3])):
                raise InvalidInput(
                    "motion.velocity tears the ring: it is another one at s = L than at s = 0, one point."
                )
            V[N], V[N + 1, :3] = V[0], V[1, :3]
        for at, vertex in (("start", 0), ("end", N)):
            if self.body.fixed[4 * vertex]:
                V[vertex, :3] = self._support_velocity(at, 0.0, 1e-4 * self.motion.duration)
        for vertex, axis in zip(self.body.holds.slides, self.body.holds.directions.reshape(-1, 3), strict=True):
            V[vertex, :3] -= (axis @ V[vertex, :3]) * axis
        if self.inextensible:
            t = state.t.reshape(-1, 3)[1:-1]
            rate = np.abs(np.einsum("ni,ni->n", np.diff(V[:, :3], axis=0), t)) / self.body.rod.l
            if np.max(rate) > 1e-6 * max(1.0, np.max(np.abs(V[:, :3]))):
                if self.motion.velocity is None:
                    raise InvalidInput(
                        "a support moves along the rod from the first moment on, but the rod is at rest and does not stretch; let "
                        "the support set out from rest, give the rod its velocity by motion.velocity, or set rod.stretch."
                    )
                raise InvalidInput(
                    "motion.velocity stretches the rod, which does not stretch; give velocities with v' across the tangent, or "
                    "set rod.stretch."
                )
        return V.ravel()[:-1].copy()

    # -- in time -------------------------------------------------------------------------------------------------

    def factors_at(self, t: float) -> Array:
        """Return a row of a drive that holds nothing but the factors of the groups of loads at the time t in s."""
        row = np.zeros(FACTORS + len(self.groups))
        row[FACTORS:] = [self.motion.factor(t, load) for _, load, _ in self.groups]
        return row

    def _support_velocity(self, at: str, t: float, h: float) -> Array:
        """Return the dimensionless velocity of a support at t, by its own differences."""
        if getattr(self.motion, at) is None or h == 0.0:
            return np.zeros(3)
        before, after = max(t - 0.01 * h, 0.0), min(t + 0.01 * h, self.motion.duration)
        change = self.motion.position(at, after) - self.motion.position(at, before)
        return np.asarray(change / (after - before) * self.units.time / self.units.length)

    def drive(self, times: Any, h: float) -> Array:
        """Return one row for each time in s, (n, ROW): loads, fluids and supports there; h in s scales differences."""
        fluids = FACTORS + len(self.groups)
        rows = np.zeros((len(times), fluids + 3 * len(self.motion.drags)))
        motion, units = self.motion, self.units
        for row, t in zip(rows, times, strict=True):
            row[FACTORS:fluids] = self.factors_at(t)[FACTORS:]
            row[fluids:] = motion.fluids(t).ravel() * units.time / units.length
            for end, at in enumerate(ENDS):
                R, o = motion.frame(at, t), 3 * end
                row[rod_motion.POSITION + o :][:3] = (motion.position(at, t) - units.origin) / units.length
                row[rod_motion.VELOCITY + o :][:3] = self._support_velocity(at, t, h)
                row[rod_motion.TANGENT + o :][:3], row[rod_motion.DIRECTOR + o :][:3] = R[:, 2], R[:, 0]
                moving = getattr(motion, at)
                if moving is not None and moving.frame is not None and h > 0.0:
                    before, after = max(t - 0.01 * h, 0.0), min(t + 0.01 * h, motion.duration)
                    turn = frames.rotation_vector(motion.frame(at, after) @ motion.frame(at, before).T) / (
                        after - before
                    )
                    row[rod_motion.SPIN + o :][:3] = turn * units.time
        return rows

    def midpoint_drive(self, t0: float, h: float, steps: int) -> Array:
        """Return the rows (n, ROW) of n midpoint steps of h seconds from t0; one row, found once, where nothing changes."""
        if not self.motion.steady:
            return self._midpoint_rows(t0, h, steps)
        if self._steady is None:
            self._steady = self._midpoint_rows(t0, h, 1)
        return self._steady

    def _midpoint_rows(self, t0: float, h: float, n: int) -> Array:
        rows = self.drive(t0 + h * (np.arange(n) + 0.5), h)
        ends = self.drive(t0 + h * np.arange(n + 1), h)
        at = slice(rod_motion.POSITION, rod_motion.POSITION + 6)
        rows[:, at] = 0.5 * (ends[:-1, at] + ends[1:, at])
        change = (ends[1:, at] - ends[:-1, at]) * (self.units.time / h)
        rows[:, rod_motion.VELOCITY : rod_motion.VELOCITY + 6] = change
        for name, later in (("VELOCITY", "NEXT_VELOCITY"), ("TANGENT", "NEXT_TANGENT"), ("DIRECTOR", "NEXT_DIRECTOR")):
            source, target = getattr(rod_motion, name), getattr(rod_motion, later)
            rows[:, target : target + 6] = ends[1:, source : source + 6]
        return rows

    def place_of(self, residual: Array) -> float:
        """Return the arc length in m at which packed numbers are largest."""
        packed = np.append(np.nan_to_num(np.abs(residual), nan=np.inf), 0.0).reshape(-1, 4).max(axis=1)
        return float(self.nodes[min(int(np.argmax(packed)), self.segments)] * self.units.length)


def _groups(motion: Motion) -> list[tuple[Any, int, list[Load]]]:
    """Return the loads that share a factor of time: the factor, the number of the first load, the loads."""
    loads = motion.problem.loads
    if len(motion.factors) != len(loads):
        return [(motion.factors[0], 0, list(loads))]
    groups: list[tuple[Any, int, list[Load]]] = []
    for i, (factor, load) in enumerate(zip(motion.factors, loads, strict=True)):
        same = [part for other, _, part in groups if other is factor or (not callable(factor) and other == factor)]
        if same:
            same[0].append(load)
        else:
            groups.append((factor, i, [load]))
    return groups


def new_state(N: int) -> State:
    """Return room for a state of N edges."""
    return State(np.zeros(3 * N + 3), np.zeros(3 * N + 6), np.zeros(3 * N + 6), np.zeros(N + 1))


def new_space(N: int, closed: bool = False) -> Space:
    """Return room for a step of N edges, which may be closed to a ring."""
    n = 4 * N + 3
    work, lower = np.zeros(discrete_rod.WORK + 6), np.zeros(LOWER * n)
    base, step, residual = np.zeros(n), np.zeros(n), np.zeros(n)
    strains, correction = np.zeros(3 * N + 3), np.zeros(3 * N + 4)
    tensions, reaction, power = np.zeros(N), np.zeros(12), np.zeros(2)
    ghost = np.zeros(rod_motion.GHOST)
    border, corner = (np.zeros(size if closed else 0) for size in (LANES * n, CORNER))
    general = np.zeros(0 if closed else FULL * n)
    return Space(
        base, step, residual, lower, work, new_state(N), strains, correction, tensions, reaction, power, ghost, border,
        corner, general,
    )  # fmt: skip


def carried_along(R: Array, t: Array) -> Array:
    """Return the first directors of frames that do not twist along the tangents t (n, 3), from the frame R (3, 3) on."""
    d1 = np.empty_like(t)
    before, d = R[:, 2], R[:, 0]
    for j, tangent in enumerate(t):
        d = d - (d @ tangent) / (1.0 + before @ tangent) * (before + tangent)
        before, d1[j] = tangent, d
    return d1


def frames_along(t: Array) -> Array:
    """Return a frame (3, 3) whose third column is t (3,)."""
    axis = np.eye(3)[int(np.argmin(np.abs(t)))]
    d1 = axis - (axis @ t) * t
    d1 /= np.linalg.norm(d1)
    return frames.frame_of(t, d1)
