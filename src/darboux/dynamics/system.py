"""A motion in the numbers that the kernels read: dimensionless, discrete, at its start."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux import frames, profile
from darboux.errors import InvalidInput
from darboux.kernels import discrete_rod, rod_motion
from darboux.kernels.band import LOWER
from darboux.kernels.discrete_rod import Elasticity, Loads, State
from darboux.kernels.rod_equations import BINV, DEAD_FORCE, DEAD_MOMENT, FORCE_GRADIENT, K0, SINV
from darboux.kernels.rod_motion import Body, Space
from darboux.loads import Rotation
from darboux.motion import KelvinVoigt, LinearDrag, MassDamping, Motion, QuadraticDrag
from darboux.problem import Equilibrium
from darboux.solution import EquilibriumSolution
from darboux.statics import coefficients
from darboux.statics.coefficients import PAIRS, Scale
from darboux.statics.solve import solve
from darboux.supports import Free, Support

Array = NDArray[np.float64]

EXACT = 1e-9  # relative: an inextensible segment's length
GAP = 1e-6  # of the length, by which a shape may miss a support
SETTLED = 1e-11  # rad, to which that equilibrium is found
FOREVER = 1e5  # a stage this long is an equilibrium
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

    Mass is spread along the edges, or, where ``spread`` is False, stands in the vertices.
    """

    def __init__(self, motion: Motion, segments: int, spread: bool = True) -> None:
        self.motion, self.segments, self.spread = motion, segments, spread
        problem = motion.problem
        self.scale = Scale.of(problem)
        L, EI = problem.rod.length, self.scale.moment * problem.rod.length
        mass = float(np.mean(problem.rod.mass(np.linspace(0.0, L, 17), "Motion")))
        self.units = Units(L, L**2 * np.sqrt(mass / EI), mass * L, EI / L, self.scale.origin)
        self.nodes = np.linspace(0.0, 1.0, segments + 1)
        self.l = np.full(segments, 1.0 / segments)
        self.inextensible = not problem.rod.stretch
        self._discretise(problem)
        self.body = self.body_at(0.0)
        self.space = new_space(segments)
        self._steady: Array | None = None

    # -- from the rod to the numbers -----------------------------------------------------------------------------

    def _discretise(self, problem: Equilibrium) -> None:
        """Average compliance, natural shape, mass and loads over the cells of the vertices and over the edges."""
        x, scale, units = self.nodes, self.scale, self.units
        cells = np.concatenate([[0.0], 0.5 * (x[:-1] + x[1:]), [1.0]])
        self.V = np.diff(cells)

        def columns(s: Array) -> Array:
            return coefficients.columns(problem, scale, s)

        at_vertices, on_edges = _means(columns, cells), _means(columns, x)
        B = np.linalg.inv(symmetric(at_vertices[:, BINV : BINV + 6])) / self.V[:, None, None]
        self.B = six(B)
        self.kappa0 = at_vertices[:, K0 : K0 + 3] * self.V[:, None]
        self.EA = np.ones(self.segments) if self.inextensible else 1.0 / on_edges[:, SINV + 2]
        self.f = at_vertices[:, DEAD_FORCE : DEAD_FORCE + 3] * self.V[:, None]
        self.C = six(at_vertices[:, FORCE_GRADIENT : FORCE_GRADIENT + 9].reshape(-1, 3, 3)) * self.V[:, None]
        self.couples = on_edges[:, DEAD_MOMENT : DEAD_MOMENT + 3] * self.l[:, None]
        for at, i in (("start", 0), ("end", -1)):
            load = problem.end_load(at)
            self.f[i] += load.force / scale.force
            self.couples[i] += load.moment / scale.moment
        per_length = units.mass / units.length
        mass = (
            _means(lambda s: problem.rod.mass(s * units.length, "Motion")[:, None], cells)[:, 0] / per_length * self.V
        )
        edges = _means(lambda s: problem.rod.mass(s * units.length, "Motion")[:, None], x)[:, 0] / per_length * self.l
        self.sixth = edges / 6.0 if self.spread else np.zeros(self.segments)
        J = _means(lambda s: self._rotary(s * units.length)[:, None], x)[:, 0] / (per_length * units.length**2) * self.l
        self.mass = np.append(np.repeat(mass[:-1, None], 4, axis=1), np.full((1, 4), mass[-1]), axis=0)
        self.mass[:-1, 3] = J
        self.mass = self.mass.ravel()[:-1].copy()
        self._brake()

    def _rotary(self, s: Array) -> Array:
        """Return the rotary inertia per length about the tangent, kg m, at s (n,)."""
        if self.motion.rotary_inertia is not None:
            return np.full(len(s), self.motion.rotary_inertia)
        c = self.motion.problem.rod.stiffness(s)
        if c.EA is None:
            raise InvalidInput(
                "motion.rotary_inertia is missing, and section.EA too, from which it would follow; give one of them."
            )
        mass = self.motion.problem.rod.mass(s, "Motion")
        return np.asarray(mass * (c.EI1 + c.EI2) / c.EA)

    def _brake(self) -> None:
        units = self.units
        force = self.scale.force / units.length  # per length
        self.slowness, self.times, self.drag = 0.0, np.zeros(3), np.zeros(4)
        for part in self.motion.damping:
            if isinstance(part, MassDamping):
                self.slowness += part.rate * units.time
            elif isinstance(part, KelvinVoigt):
                self.times += np.array([part.bending, part.twist, part.stretch]) / units.time
            elif isinstance(part, LinearDrag):
                self.drag[:2] += np.array([part.along, part.across]) * (units.length / units.time) / force
            elif isinstance(part, QuadraticDrag):
                self.drag[2:] += np.array([part.along, part.across]) * (units.length / units.time) ** 2 / force

    def body_at(self, t: float) -> Body:
        """Return what holds just after the time t in s: a released end is free."""
        N = self.segments
        supports = [getattr(self.motion.problem, at) if self.motion.held(at, t) else Free() for at in ENDS]
        clamped = [all(support.held_rotation) for support in supports]
        fixed = np.zeros(4 * N + 3, dtype=bool)
        fixed[:3], fixed[-3:] = (np.diagonal(_held(support)) > 0.5 for support in supports)
        viscous = self.B * self.times[[0, 0, 1, 0, 0, 0]]
        rod = Elasticity(
            self.B.ravel(), self.kappa0.ravel(), self.l, self.EA, np.zeros(N),
            0 if clamped[0] else 1, N + 1 if clamped[1] else N,
        )  # fmt: skip
        return Body(
            rod, Loads(self.f.ravel(), self.C.ravel()), self.couples.ravel(), self.mass, self.sixth, self.slowness,
            viscous.ravel(), self.EA * self.times[2], self.drag, fixed, self.inextensible,
        )  # fmt: skip

    # -- the start -----------------------------------------------------------------------------------------------

    def start(self) -> tuple[State, Array]:
        """Return the state and the packed velocities at t = 0."""
        initial = self.motion.initial
        if isinstance(initial, str):
            problem = self.motion.problem
            state = self._unloaded() if initial == "unloaded" else self._settled(solve(problem))
        elif isinstance(initial, EquilibriumSolution):
            state = self._settled(initial)
        else:
            state = self._laid(initial)
        self._check_place(state)
        return state, self._velocities(state)

    def _unloaded(self) -> State:
        """Return the natural shape, laid at the support that holds it."""
        problem, N = self.motion.problem, self.segments
        support, held = (problem.start, 0) if problem.start.holds else (problem.end, N + 1)
        rest = self.kappa0.copy()
        for at, vertex in (("start", 0), ("end", N)):
            if not getattr(problem, at).clamps:
                rest[vertex] = 0.0
        q = np.empty((N + 2, 4))
        discrete_rod.chain_frames(rest.ravel(), q.ravel())
        R = frames.matrix_of_quaternion(q)
        R = support.R @ R[held].T @ R
        x = np.concatenate([np.zeros((1, 3)), np.cumsum(self.l[:, None] * R[1:-1, :, 2], axis=0)])
        return self._state(x if held == 0 else x - x[-1], R[1:-1, :, 0], rest[:, 2])

    def _of_directions(self, r: Array, stretch: Array) -> Array:
        """Return vertices (N + 1, 3) whose edges point along those of r (N + 1, 3) and have their proper lengths."""
        e = np.diff(r, axis=0)
        e *= (self.l * stretch / np.linalg.norm(e, axis=1))[:, None]
        x: Array = np.concatenate([np.zeros((1, 3)), np.cumsum(e, axis=0)])
        first, last = (r - x)[[0, -1]]
        if self.motion.problem.start.holds and not self.motion.problem.end.holds:
            return np.asarray(x + first)
        if not self.motion.problem.start.holds:
            return np.asarray(x + last)
        return np.asarray(x + first + (last - first) * self.nodes[:, None])

    def _settled(self, solution: EquilibriumSolution) -> State:
        """Return the discrete equilibrium beside a solution: a stage that lasts for ever."""
        L, middle = self.units.length, 0.5 * (self.nodes[:-1] + self.nodes[1:])
        r = (solution.r(self.nodes * L) - self.units.origin) / L
        state = self._state(self._of_directions(r, solution.v(middle * L)[:, 2]), solution.R(middle * L)[:, :, 0], None)
        if self.inextensible or beyond(solution.problem):
            return state
        other = System(Motion(solution.problem, 1.0), self.segments)
        now, V = new_state(self.segments), np.zeros(4 * self.segments + 3)
        row = other.drive([0.0], 0.0)[0]
        row[rod_motion.VELOCITY : rod_motion.VELOCITY + 6] = 0.0
        other.space.base[:] = 0.0
        done = rod_motion.stage(state, V.copy(), FOREVER, V, other.body, row, False, SETTLED, other.space, now)
        if done < 0:
            return state
        now.m[:] = state.m
        discrete_rod.strains(now, other.body.rod.first, other.body.rod.stop, np.empty(self.kappa0.size))
        return now

    def _laid(self, shape: Callable[[Array], Any]) -> State:
        """Return the shape r(s) that was given, with the frames that do not twist along it, from the support's on."""
        L = self.units.length
        r = (profile.evaluate("motion.initial", shape, self.nodes * L, (3,)) - self.units.origin) / L
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
                    "by arc length, or set stretch=True."
                )
            r = self._of_directions(r, np.ones(self.segments))
        t = e / np.linalg.norm(e, axis=1)[:, None]
        support = self.motion.problem.start
        R = support.R if support.clamps else frames_along(t[0])
        d1 = np.empty_like(t)
        before, d = R[:, 2], R[:, 0]
        for j, tangent in enumerate(t):
            d = d - (d @ tangent) / (1.0 + before @ tangent) * (before + tangent)
            before, d1[j] = tangent, d
        return self._state(r, d1, None)

    def _state(self, x: Array, d1: Array, m: Array | None) -> State:
        """Return a state from vertices (N + 1, 3) and the edges' first directors (N, 3); clamps' frames are the drive's."""
        N = self.segments
        t = np.diff(x, axis=0)
        t /= np.linalg.norm(t, axis=1)[:, None]
        d1 = d1 - np.einsum("ni,ni->n", d1, t)[:, None] * t
        d1 /= np.linalg.norm(d1, axis=1)[:, None]
        R = [self.motion.frame(at, 0.0) for at in ENDS]
        tangents = np.concatenate([R[0][None, :, 2], t, R[1][None, :, 2]])
        directors = np.concatenate([R[0][None, :, 0], d1, R[1][None, :, 0]])
        twists = np.zeros(N + 1) if m is None else m.copy()
        state = State(x.ravel().copy(), tangents.ravel(), directors.ravel(), twists)
        rod = self.body_at(-1.0).rod
        discrete_rod.strains(state, rod.first, rod.stop, np.empty(3 * N + 3))
        return state

    def _check_place(self, state: State) -> None:
        x, t = state.x.reshape(-1, 3), state.t.reshape(-1, 3)
        lengths = np.linalg.norm(np.diff(x, axis=0), axis=1)
        if self.inextensible and np.max(np.abs(lengths / self.l - 1.0)) > EXACT:
            raise InvalidInput(
                "motion: the rod does not stretch and is held at both ends, but its segments can't have their lengths between "
                "them in this initial shape; set stretch=True."
            )
        for at, vertex, edge, ghost in (("start", 0, 1, 0), ("end", -1, -2, -1)):
            if not self.motion.held(at, 0.0):
                continue
            place = (self.motion.position(at, 0.0) - self.units.origin) / self.units.length
            support = getattr(self.motion.problem, at)
            gap = float(np.linalg.norm(_held(support) @ (x[vertex] - place)))
            if gap > GAP or (all(support.held_rotation) and t[edge] @ t[ghost] < 0.0):
                raise InvalidInput(
                    f"the rod begins {gap * self.units.length:.3g} m off the support at its {at}, or turned away from it; lay it "
                    "there: initial=solve(problem), or a function of s."
                )

    def _velocities(self, state: State) -> Array:
        N, L, unit = self.segments, self.units.length, self.units.length / self.units.time
        V = np.zeros((N + 1, 4))
        if self.motion.velocity is not None:
            V[:, :3] = profile.vector("motion.velocity", self.motion.velocity, "m/s")(self.nodes * L) / unit
        middle = 0.5 * (self.nodes[:-1] + self.nodes[1:])
        V[:-1, 3] = profile.scalar("motion.spin", self.motion.spin, "rad/s", "any")(middle * L) * self.units.time
        for at, vertex in (("start", 0), ("end", N)):
            if self.motion.held(at, 0.0):
                V[vertex, :3] = self._support_velocity(at, 0.0, 1e-4 * self.motion.duration)
        if self.inextensible:
            t = state.t.reshape(-1, 3)[1:-1]
            rate = np.abs(np.einsum("ni,ni->n", np.diff(V[:, :3], axis=0), t)) / self.l
            if np.max(rate) > 1e-6 * max(1.0, np.max(np.abs(V[:, :3]))):
                raise InvalidInput(
                    "motion.velocity stretches the rod, which does not stretch; give velocities with v' across the tangent, or "
                    "set stretch=True."
                )
        return V.ravel()[:-1].copy()

    # -- in time -------------------------------------------------------------------------------------------------

    def _support_velocity(self, at: str, t: float, h: float) -> Array:
        """Return the dimensionless velocity of a support at t, by its own differences."""
        if getattr(self.motion, at) is None or h == 0.0:
            return np.zeros(3)
        before, after = max(t - 0.01 * h, 0.0), min(t + 0.01 * h, self.motion.duration)
        change = self.motion.position(at, after) - self.motion.position(at, before)
        return np.asarray(change / (after - before) * self.units.time / self.units.length)

    def drive(self, times: Any, h: float) -> Array:
        """Return one row for each time in s, (n, ROW): loads, fluid and supports there; h in s scales differences."""
        rows = np.zeros((len(times), rod_motion.ROW))
        motion, units = self.motion, self.units
        for row, t in zip(rows, times, strict=True):
            row[rod_motion.FACTOR] = motion.factor(t)
            row[rod_motion.FLUID : rod_motion.FLUID + 3] = motion.fluid(t) * units.time / units.length
            for end, at in enumerate(ENDS):
                R, o = motion.frame(at, t), 3 * end
                row[rod_motion.POSITION + o :][:3] = (motion.position(at, t) - units.origin) / units.length
                row[rod_motion.VELOCITY + o :][:3] = self._support_velocity(at, t, h)
                row[rod_motion.TANGENT + o :][:3], row[rod_motion.DIRECTOR + o :][:3] = R[:, 2], R[:, 0]
                moving = getattr(motion, at)
                if moving is not None and moving.frame is not None and h > 0.0:
                    before, after = max(t - 0.01 * h, 0.0), min(t + 0.01 * h, motion.duration)
                    turn = rotation_vector(motion.frame(at, after) @ motion.frame(at, before).T) / (after - before)
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
        return float(self.nodes[int(np.argmax(packed))] * self.units.length)


def refuses(motion: Motion) -> str | None:
    """Return why this motion can't be stated, in one sentence, or None."""
    if any(isinstance(load, Rotation) for load in motion.problem.loads):
        return (
            "Rotation is the centrifugal force in a turning frame, to which Coriolis' force belongs in motion; turn the clamp "
            "instead: start=Moving(frame=...)."
        )
    return beyond(motion.problem)


def beyond(problem: Equilibrium) -> str | None:
    """Return why the discrete rod here can't state a problem, or None."""
    if problem.rod.shear:
        return "motion states rods that do not shear, but rod.shear is True; set shear=False."
    for at in ENDS:
        support, load = getattr(problem, at), problem.end_load(at)
        P = _held(support)
        along_axes = support.sliding == "fixed" and np.allclose(P, np.diag(np.round(np.diagonal(P))))
        known = along_axes and (all(support.held_rotation) or not any(support.held_rotation))
        if not known or support.twist != 0.0 or support.linear is not None or support.rotational is not None:
            return (
                f"problem.{at} is {type(support).__name__}(); motion states Clamped() without twist, Pinned() and Free() ends, "
                "and ends that slide along x, y or z."
            )
        if np.any(load.section_force) or np.any(load.section_moment):
            return f"a load on the {at} turns with the section (follower=True); motion states dead loads on the ends."
    loads = problem.distributed(np.linspace(0.0, problem.rod.length, 33))
    if np.any(loads.b) or np.any(loads.lb) or problem.of_shape or problem.points:
        return (
            "motion states dead loads along the rod and on its ends, but a load turns with the section, acts at a point or is a "
            "function of the shape."
        )
    return None


def _held(support: Support) -> Array:
    """Return the projection (3, 3) of a displacement on what a support holds of it."""
    axes = support.displacement_axes[:, list(support.held_displacement)]
    return np.asarray(axes @ axes.T)


def new_state(N: int) -> State:
    """Return room for a state of N edges."""
    return State(np.zeros(3 * N + 3), np.zeros(3 * N + 6), np.zeros(3 * N + 6), np.zeros(N + 1))


def new_space(N: int) -> Space:
    """Return room for a step of N edges."""
    n = 4 * N + 3
    work, lower = np.zeros(discrete_rod.WORK + 6), np.zeros(LOWER * n)
    base, step, residual = np.zeros(n), np.zeros(n), np.zeros(n)
    strains, tensions, reaction, power = np.zeros(3 * N + 3), np.zeros(N), np.zeros(12), np.zeros(2)
    return Space(base, step, residual, lower, work, new_state(N), strains, tensions, reaction, power)


def frames_along(t: Array) -> Array:
    """Return a frame (3, 3) whose third column is t (3,)."""
    axis = np.eye(3)[int(np.argmin(np.abs(t)))]
    d1 = axis - (axis @ t) * t
    d1 /= np.linalg.norm(d1)
    return np.column_stack([d1, np.cross(t, d1), t])


def rotation_vector(R: Array) -> Array:
    """Return the rotation vector (3,) in rad of a rotation (3, 3)."""
    q = frames.quaternion_of_matrix(R)
    q = q * np.sign(q[0]) if q[0] != 0.0 else q
    sine = float(np.linalg.norm(q[1:]))
    return np.asarray(2.0 * q[1:] if sine < 1e-8 else 2.0 * np.arctan2(sine, q[0]) / sine * q[1:])


def symmetric(numbers: Array) -> Array:
    """Return (n, 3, 3) from the six numbers 11, 22, 33, 23, 13, 12."""
    return numbers[:, [0, 5, 4, 5, 1, 3, 4, 3, 2]].reshape(-1, 3, 3)


def six(matrix: Array) -> Array:
    """Return the six numbers (n, 6) of symmetric matrices (n, 3, 3)."""
    return np.stack([matrix[:, i, j] for i, j in PAIRS], axis=1)


def _means(function: Callable[[Array], Array], nodes: Array) -> Array:
    """Return the mean of a function (n,) -> (n, k) on each interval, by Gauss' rule of two points."""
    middle, half = 0.5 * (nodes[:-1] + nodes[1:]), 0.5 * np.diff(nodes)
    offset = half / np.sqrt(3.0)
    return np.asarray(0.5 * (function(middle - offset) + function(middle + offset)))
