"""Gauss collocation: the solver of record.

Sources: C. de Boor and B. Swartz, SIAM J. Numer. Anal. 10 (1973) 582 (order 2 s at the nodes); U. M. Ascher,
R. M. M. Mattheij and R. D. Russell, Numerical Solution of Boundary Value Problems (SIAM, 1995), ch. 5, 7 and 9.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from darboux import checks, frames
from darboux.checks import assign, description
from darboux.curve import Curve
from darboux.errors import InvalidInput
from darboux.kernels import collocation
from darboux.kernels.collocation import FEWEST_STAGES, FREE, MOST_STAGES, SHAPED, SHAPED_COUPLE, SIDES
from darboux.kernels.collocation import ROW as FACTOR_ROW
from darboux.kernels.rod_equations import FORCE, K0, MOMENT, ROTATION, SINV, STATES
from darboux.loads import LineForce
from darboux.natural import smallest_rotation
from darboux.problem import Equilibrium, Ring
from darboux.solution import EquilibriumSolution, ErrorEstimate, Status
from darboux.statics import coefficients, first_shape, load_path, stability
from darboux.statics.coefficients import Scale
from darboux.statics.end_conditions import EndConditions
from darboux.statics.first_shape import FirstShape, shape_of
from darboux.statics.mesh import Mesh, better_nodes, size, stage_points, units
from darboux.statics.stability import Held, SecondVariation
from darboux.supports import Support

Array = NDArray[np.float64]

FIRST_ELEMENTS = 12
LARGEST_NATURAL_TURN = 1.5  # rad of an unloaded rod's frame over an element of the first mesh
PATH_TOLERANCE = 1e-6  # of what Newton's method leaves over on the way: the branch must be kept, not measured
PATH_ROUGHNESS = 2e-3  # of the polynomials on the way; where they leave out more the mesh is laid anew
MOST_ELEMENTS = 20_000
SLACK = 1e-3  # compliance of stretch lent to an inextensible rod held at both ends while it is on the way
DISTURBANCE = 0.1  # of EI / L^2, spread along the unstable mode
MOST_DISTURBANCES = 3
SMALLEST_MODE = 1e-8  # of displacements, over 1 for all of them together
SMALLEST_RELIEF = 1e-3  # of the disturbance that is taken off in a step
SINGULAR = 1e-6  # of the last equations' pivots: below, singular values tell what is free
UNSURE, SAFE = 1e4, 10.0  # how the next of Newton's steps is foreseen: UNSURE length^2, or SAFE times the quadratic law
FREE_MOTION = 1e-9  # a singular value below this part of the largest belongs to a free motion ...
IDLE, NOISE = 1e-6, 1e-10  # ... if the equations ask for less than this along it, relative and absolute
SURE = 4.0  # the estimated error is this many times what the order promises
NOTHING = np.empty(0)  # no load is a function of the shape
ROUNDING_STRAIN = 1e-14  # of a stretching rod: what rounding of places amounts to
FLATTEST = 0.05  # stretch below which a rod counts as compressed to nothing
BESIDE = 1e-12  # of L, from a jump: on either side of what encloses it
CLOSEST = 1e-9  # of L, between two breaks
GAIN = 64.0  # of the curve between the nodes, at least, where they are halved
ROUNDING = 2e-14  # no error below this is claimed, relative


@description
class Collocation:
    """Gauss collocation with ``stages`` points per element, Newton's method on the exact Jacobian and an adaptive mesh.

    Order 2 stages at the nodes. Every quadratic invariant of the equations (|q|, and of an unloaded rod m + r x n and
    m . n) holds to rounding. The branch that starts at the unloaded rod is followed on a coarse mesh; then the mesh is
    laid anew until the answer's estimated error is below ``rtol``. The error is estimated by halving every element;
    the answer is the finer of the two. Domain: any single rod; smooth or piecewise smooth data.

    Arguments: ``rtol`` wanted error of the positions over L, and of forces and moments over their largest, 1e-13 to
    1e-2; ``stages`` 2 to 5; ``elements`` None (adaptive) or how many equal elements are used. Raises ``InvalidInput``.
    """

    rtol: float = 1e-9
    stages: int = 4
    elements: int | None = None

    def __post_init__(self) -> None:
        rtol = checks.positive("collocation.rtol", self.rtol)
        if not 1e-13 <= rtol <= 1e-2:
            raise InvalidInput(f"collocation.rtol is {rtol:g}; it must lie between 1e-13 and 1e-2.")
        stages = checks.whole("collocation.stages", self.stages, FEWEST_STAGES)
        if stages > MOST_STAGES:
            raise InvalidInput(
                f"collocation.stages is {stages}; it must lie between {FEWEST_STAGES} and {MOST_STAGES}."
            )
        elements = None if self.elements is None else checks.whole("collocation.elements", self.elements, 1)
        assign(self, rtol=rtol, stages=stages, elements=elements)

    def __str__(self) -> str:
        parts = [] if self.rtol == 1e-9 else [f"rtol={self.rtol:g}"]
        parts += [] if self.stages == 4 else [f"stages={self.stages}"]
        parts += [] if self.elements is None else [f"elements={self.elements}"]
        return f"Collocation({', '.join(parts)})"

    @property
    def order(self) -> int:
        """The order of the error at the nodes in 1/elements."""
        return 2 * self.stages

    def refuses(self, problem: Equilibrium) -> str | None:
        """Return why this method can't state the problem, or None."""
        return None

    def solve(self, problem: Equilibrium, start: Any = None) -> EquilibriumSolution:
        """Return the equilibrium that follows from the unloaded rod, or from a start; the status says whether it got there."""
        began = time.perf_counter()
        with np.errstate(all="ignore"):  # a Newton step that leaves the numbers' range is rejected
            found = self._next_to(problem, start) if isinstance(start, EquilibriumSolution) else None
            found = found or self._followed(problem, start)
            equations, mesh, path = found.equations, found.mesh, found.path
            curve = equations.curve(mesh, path.load_factor)
        return EquilibriumSolution(
            problem,
            self,
            problem.rod.model,
            found.status,
            curve,
            load_factor=path.load_factor,
            index=path.index,
            error=found.error,
            statistics={
                "seconds": time.perf_counter() - began,
                "elements": mesh.elements,
                "load_steps": path.steps,
                "rejected_steps": path.rejected,
                "newton_iterations": equations.iterations,
                "crossings": tuple(path.crossings),
            },
        )

    def _next_to(self, problem: Equilibrium, start: EquilibriumSolution) -> _Found | None:
        """Return the equilibrium that Newton's method reaches from another solution, or None where it does not contract."""
        equations = _Equations(problem, self)
        answer = equations.refined(equations.mesh_of(start), self, first=True)
        if answer is None:
            return None
        path = load_path.Path(_State(answer[0], 1.0), 1.0, index=equations.index(answer[0], 1.0))
        unstable = load_path.unstable_in(path.index)
        message = f"converged: the equilibrium next to the one that was given as the start.{unstable}"
        return _Found(equations, Status("converged", message), *answer, path)

    def _followed(self, problem: Equilibrium, start: Any) -> _Found:
        """Return where the path ends that begins with the unloaded rod, or with the start's shape free of stress."""
        scale, shape, origin = Scale.of(problem), None, "the unloaded rod"
        if start is not None:
            shape, origin = first_shape.given(problem, scale, start), "the given start"
        elif isinstance(problem, Ring):
            shape, origin = first_shape.circle(problem, scale), "the round ring"
        equations = _Equations(problem, self, shape)
        path = load_path.follow(equations, equations.unloaded(), until_unstable=True)
        code, message = load_path.ending(path, "Collocation", origin)
        if path.unstable is not None and equations.has_potential:
            buckled = equations.buckled(path)
            if buckled is None:  # then at least the unstable branch, and said to be so
                path = load_path.follow(equations, equations.unloaded())
                code, message = load_path.ending(path, "Collocation", origin)
            else:
                a, b = path.crossings[0]
                path, code = buckled, "converged"
                message = (
                    f"converged: the stable equilibrium that follows from {origin}. Between {100.0 * a:.4g} % and "
                    f"{100.0 * b:.4g} % of the load the straight-on branch turns unstable, and the rod leaves it to the side that "
                    "a small disturbance gives."
                )
        mesh = path.state.mesh
        if path.load_factor < 1.0:
            if equations.flattest(mesh) < FLATTEST:
                code, message = "no_convergence", load_path.flattened(path)
            return _Found(equations, Status(code, message), mesh, ErrorEstimate(), path)
        answer = equations.refined(mesh, self)
        if answer is None:
            message = (
                f"Newton's method did not settle at rtol = {self.rtol:g}; the answer on the coarse mesh is in .solution. Ask "
                "for a larger rtol."
            )
            return _Found(equations, Status("no_convergence", message), mesh, ErrorEstimate(), path)
        return _Found(equations, Status(code, message), *answer, path)


@dataclass(frozen=True)
class _Found:
    """Where a solve ended."""

    equations: _Equations
    status: Status
    mesh: Mesh
    error: ErrorEstimate
    path: load_path.Path[_State]


@dataclass(frozen=True, eq=False)
class _State:
    """A mesh with its solution, and the change of the solution per unit of load factor (N + 1, 12) where known."""

    mesh: Mesh
    load_factor: float = 0.0
    tangent: Array | None = None


@dataclass
class _Step:
    """Newton's step (N + 1, 12) at a mesh, its length and its largest turn; the derivative by the load factor and its turn.

    ``sign`` is that of the determinant.
    """

    delta: Array
    length: float
    turn: float
    tangent: Array
    tangent_turn: float
    sign: float


class _Equations:
    """The collocation equations of one problem, for `load_path.follow`."""

    def __init__(self, problem: Equilibrium, method: Collocation, shape: FirstShape | None = None) -> None:
        self.problem = problem
        self.stages = method.stages
        self.scale = Scale.of(problem)
        self.shape = shape
        if shape is None:
            self.table, self.relaxing = coefficients.table(problem, self.scale), np.zeros((1, 1, 3))
        else:
            self.table, self.relaxing = coefficients.table_and_strain(problem, self.scale, shape.k)
        self.breaks = _apart({*problem.breaks, *problem.jumps}, problem.stations, problem.rod.length)
        self.start = EndConditions(problem.start, problem.end_load("start"), -1.0, self.scale)
        self.end = EndConditions(problem.end, problem.end_load("end"), 1.0, self.scale)
        self.stations = [
            (s / problem.rod.length, EndConditions(support, load, 1.0, self.scale))
            for s, (support, load) in problem.stations.items()
        ]
        held_twice = len(problem.supports) > 1
        self.slack = SLACK if held_twice and not problem.rod.stretch else 0.0
        softest = float(np.max(np.abs(self.table.coefficients[:, 0, SINV : SINV + 3])))
        self.rounding = ROUNDING_STRAIN / softest if softest > 0.0 else 0.0  # of n: what a rounded place makes of EA
        self.has_potential = stability.has_potential(problem)
        self.iterations = 0
        self.disturbance = 0.0
        self.disturbances: list[CubicSpline] = []  # the modes (n, 3) along which a small load acts, as functions of x
        self._last: tuple[float, float, Array] = (np.nan, np.nan, np.empty(0))

    def _data(self, load_factor: float, compliance: float = 0.0) -> tuple[Array, Array, int, Array]:
        """Return the table for the kernels, which scale the loads themselves, and the derivative of k0 by the load factor."""
        slack = max(self.slack * (1.0 - load_factor), 0.0 if self.problem.rod.stretch else compliance)
        lent = 1.0 - load_factor if self.shape is not None else 0.0
        if self._last[:2] != (slack, lent):
            coefficients = self.table.loaded(1.0, slack).coefficients
            coefficients[:, :, K0 : K0 + 3] -= lent * self.relaxing
            self._last = (slack, lent, coefficients.ravel())
        relaxing = NOTHING if self.shape is None else self.relaxing.ravel()
        return self.table.breaks, self._last[2], self.table.degree, relaxing

    # -- the unloaded rod ----------------------------------------------------------------------------------------

    def unloaded(self) -> _State:
        """Return the rod without loads: its natural shape, laid against the support that holds it, or the first shape."""
        x = self._first_nodes()
        between = [at for at, _ in self.stations]
        points = np.unique(np.concatenate([x, stage_points(x, self.stages).ravel()]))
        states = np.zeros((len(points), STATES))
        if self.shape is None:
            states[:, :ROTATION], states[:, ROTATION:FORCE] = shape_of(self._k0, points)
            support = self._lay(points, states)
        else:
            support = None
            states[:, :ROTATION], states[:, ROTATION:FORCE] = self.shape.states(points)
        for at, conditions in ((0.0, self.start), *self.stations, (1.0, self.end)):
            if conditions.support.holds and conditions.support is not support:
                conditions.grow_from(states[np.searchsorted(points, at)], all_at_once=self.shape is not None)
        nodes = np.isin(points, x)
        mesh = Mesh(x, states[nodes], states[~nodes].reshape(len(x) - 1, self.stages, STATES))
        return _State(mesh.jointed(np.array(between)))

    def _k0(self, x: Array) -> Array:
        return self.problem.rod.k0(x * self.scale.length) * self.scale.length

    def _lay(self, points: Array, states: Array) -> Support:
        """Turn and move the states of the unloaded rod to where a support holds it; return that support."""
        held, place, orientation = self._laid()
        i = int(np.searchsorted(points, place))
        R = frames.matrix_of_quaternion(states[:, ROTATION:FORCE])
        chord = states[-1, :3] - states[0, :3]
        turn = orientation @ R[i].T if orientation.shape == (3, 3) else smallest_rotation(_unit(chord), orientation)
        states[:, ROTATION:FORCE] = frames.same_sign(frames.quaternion_of_matrix(turn @ R))
        states[:, :3] = (states[:, :3] - states[i, :3]) @ turn.T
        states[:, :3] += (np.array(held.position) - self.scale.origin) / self.scale.length
        return held

    def _laid(self) -> tuple[Support, float, Array]:
        """Return the support that places the unloaded rod, its x, and how the rod lies: a frame there, or its chord's direction."""
        supports = [(s / self.scale.length, support) for s, support in self.problem.supports]
        places = [(x, support) for x, support in supports if any(support.held_displacement)]
        frames_ = [(x, support) for x, support in supports if any(support.held_rotation) or support.rotational is not None]
        place, held = (places or supports)[0]
        for x, support in frames_:
            if support is held:
                return held, place, held.R
        for x, support in frames_:
            return (support, x, support.R) if any(support.held_displacement) else (held, place, support.R)
        pinned = [(x, support) for x, support in places if all(support.held_displacement)]
        if len(pinned) > 1:
            between = np.array(pinned[-1][1].position) - np.array(pinned[0][1].position)
            if np.linalg.norm(between) > 0.0:
                direction = np.sign(pinned[-1][0] - pinned[0][0]) * _unit(between)
                return held, place, direction
        for x, support in reversed(places):
            if not all(support.held_displacement) and support.sliding == "fixed":
                return held, place, support.displacement_axes[:, 0]
        return held, place, np.array([0.0, 0.0, 1.0])

    def _first_nodes(self) -> Array:
        """Return nodes so close that the natural shape turns little over an element."""
        x = np.linspace(0.0, 1.0, 1025)
        k0 = np.linalg.norm((self._k0 if self.shape is None else self.shape.k)(x), axis=1)
        pieces = np.minimum(1.0 / np.diff(self.table.breaks), 1024.0)  # where the data need short polynomials
        there = np.searchsorted(self.table.breaks, 0.5 * (x[1:] + x[:-1]), side="right") - 1
        turned = (0.5 * (k0[1:] + k0[:-1]) + pieces[there]) * np.diff(x)
        elements = max(FIRST_ELEMENTS, int(np.ceil(np.sum(turned) / LARGEST_NATURAL_TURN)))
        return better_nodes(x, turned, elements, self.breaks)

    # -- Newton's equations --------------------------------------------------------------------------------------

    def newton_step(self, mesh: Mesh, load_factor: float) -> _Step | None:
        """Return Newton's step and the tangent, or None where the numbers leave their range."""
        self.iterations += 1
        N, y = len(mesh.x) - 1, mesh.y
        carried = self.start.system(y[0], load_factor)
        joints = [
            conditions.joint(y[i], y[i + 1], load_factor)
            for i, (_, conditions) in zip(mesh.joints, self.stations, strict=True)
        ]
        factors = np.empty(N * FREE * FACTOR_ROW)
        given = np.array(joints).ravel() if joints else NOTHING
        sign = collocation.sweep(*self._arguments(mesh, load_factor), given, carried.ravel(), factors)
        last = np.concatenate([carried, self.end.system(y[-1], load_factor)])
        if not np.all(np.isfinite(last)):
            return None
        delta = np.empty((N + 1, FREE, SIDES))
        pivot = collocation.solve_last(last.copy().ravel(), delta[-1].ravel())
        if abs(pivot) < SINGULAR:
            delta[-1], pivot = _solved(last)
        collocation.back(factors, delta.ravel())
        length, turn = collocation.measure(y.ravel(), delta.ravel(), 0)
        tangent_length, tangent_turn = collocation.measure(y.ravel(), delta.ravel(), 1)
        if not np.isfinite(length + tangent_length):
            return None
        step, tangent = np.ascontiguousarray(delta[:, :, 0]), np.ascontiguousarray(delta[:, :, 1])
        return _Step(step, length, turn, tangent, tangent_turn, sign * np.sign(pivot))

    def _arguments(self, mesh: Mesh, load_factor: float, compliance: float = 0.0) -> Any:
        """Return what all kernels of `collocation` take first."""
        shaped = self._shaped(mesh) if self.problem.of_shape or self.disturbance else NOTHING
        data = self._data(load_factor, compliance)
        states = (mesh.x, mesh.y.ravel(), mesh.Y.ravel())
        return (self.stages, *states, *data, shaped, load_factor, -self.slack)

    def _shaped(self, mesh: Mesh) -> Array:
        """Return the loads that are functions of the shape, and the disturbance, at the stages: flat."""
        points = stage_points(mesh.x, self.stages).ravel()
        result = self._loads_of_shape(points, mesh.Y.reshape(-1, STATES))
        for mode in self.disturbances if self.disturbance else ():
            result[:, :3] += self.disturbance * mode(points)
        return result.ravel()

    def _loads_of_shape(self, points: Array, states: Array) -> Array:
        """Return the loads that are functions of the shape, with their derivatives, at the states (n, 13): (n, SHAPED)."""
        scale = self.scale
        s, r = points * scale.length, states[:, :3] * scale.length + scale.origin
        R = frames.matrix_of_quaternion(states[:, ROTATION:FORCE])
        result = np.zeros((len(s), SHAPED))
        for load in self.problem.of_shape:
            at, unit = (0, scale.force / scale.length) if isinstance(load, LineForce) else (SHAPED_COUPLE, scale.force)
            by_r, by_turn = load.gradients(s, r, R, scale.length)
            result[:, at : at + 3] += load.at_shape(s, r, R) / unit
            result[:, at + 3 : at + 12] += by_r.reshape(-1, 9) * (scale.length / unit)
            result[:, at + 12 : at + 21] += by_turn.reshape(-1, 9) / unit
        return result

    def moved(self, mesh: Mesh, load_factor: float, delta: Array, change: float = 0.0, part: float = 1.0) -> Mesh:
        """Return the mesh moved along a step of the nodes and a change of the load factor."""
        y, Y = np.empty_like(mesh.y), np.empty_like(mesh.Y)
        step = np.ascontiguousarray(delta).ravel()
        arguments = (*self._arguments(mesh, load_factor), step, change, part, y.ravel(), Y.ravel())
        collocation.advance(*arguments)
        return Mesh(mesh.x, y, Y)

    def newton(
        self, mesh: Mesh, load_factor: float, tolerance: float, most: int
    ) -> tuple[Mesh, _Step, float, int] | None:
        """Return the solution, the last step, the largest turn and the iterations of Newton's method; None unless it contracts."""
        turn, last = 0.0, np.inf
        floor = self.rounding / (1.0 + float(np.max(np.abs(mesh.y[:, FORCE:MOMENT])))) if self.rounding else 0.0
        for iteration in range(1, most + 1):
            step = self.newton_step(mesh, load_factor)
            if step is None or step.length > max(0.5 * last, 10.0 * tolerance, floor):
                return None
            mesh = self.moved(mesh, load_factor, step.delta)
            turn += step.turn
            foreseen = min(UNSURE * step.length, SAFE * (step.length / last) ** 2 if np.isfinite(last) else np.inf)
            if step.length * min(1.0, foreseen) <= max(tolerance, floor):
                return (mesh, step, turn, iteration) if self.flattest(mesh) > 0.0 else None
            last = step.length
        return None

    def flattest(self, mesh: Mesh) -> float:
        """Return the least stretch v3 = 1 + (S^-1 R^T n)_3 at the nodes."""
        if not self.problem.rod.stretch:
            return 1.0
        return self.table.least_stretch(mesh.x, mesh.y)

    # -- for load_path.follow ------------------------------------------------------------------------------------

    def stability(self, state: _State, load_factor: float) -> tuple[float, int | None]:
        step = self.newton_step(state.mesh, load_factor)
        return 0.0 if step is None else step.sign, self.index(state.mesh, load_factor)

    def index(self, mesh: Mesh, load_factor: float) -> int | None:
        """Return the number of unstable directions; None where the loads have no potential."""
        return self.second_variation(mesh, load_factor).index if self.has_potential else None

    def second_variation(self, mesh: Mesh, load_factor: float) -> SecondVariation:
        """Return the second variation of the energy at an equilibrium."""
        force = float(np.max(np.linalg.norm(mesh.y[:, FORCE:MOMENT], axis=1)))
        T = np.empty((mesh.elements, FREE, FREE))
        arguments = (*self._arguments(mesh, load_factor, stability.COMPLIANCE / (1.0 + force)), T.ravel())
        collocation.transfers(*arguments)
        q = np.delete(mesh.y, mesh.joints, axis=0)[:, ROTATION:FORCE]
        R = frames.matrix_of_quaternion(q)
        T[:, 3:6] = R[1:] @ T[:, 3:6]  # from rotations in the section's frame to those in the fixed one
        T[:, :, 3:6] = T[:, :, 3:6] @ R[:-1].transpose(0, 2, 1)
        stations = [int(i) - k for k, i in enumerate(mesh.joints)]  # a joint is one node here
        conditions = [self.start, *(c for _, c in self.stations), self.end]
        held = {
            i: Held.by(c.support, q[i], c.stiffness)
            for i, c in zip([0, *stations, mesh.elements], conditions, strict=True)
        }
        return stability.second_variation(T, held, force)

    def tangent(self, state: _State, load_factor: float) -> tuple[Array, float]:
        if state.tangent is not None:
            return state.tangent, _turn(state.tangent)
        step = self.newton_step(state.mesh, load_factor)
        if step is None:
            return np.zeros((len(state.mesh.x), FREE)), np.inf
        return step.tangent, step.tangent_turn

    def predict(self, state: _State, tangent: Array, step: float) -> _State:
        moved = self.moved(state.mesh, state.load_factor, step * tangent, step)
        return _State(moved, state.load_factor + step)

    def correct(self, state: _State, load_factor: float) -> load_path.Corrected[_State] | None:
        found = self.newton(state.mesh, load_factor, PATH_TOLERANCE, most=8)
        if found is None:
            return None
        mesh, step, turn, iterations = found
        watched = self._watched(mesh, step, load_factor)
        return load_path.Corrected(watched, turn, step.sign, iterations, self.index(watched.mesh, load_factor))

    def _watched(self, mesh: Mesh, step: _Step, load_factor: float) -> _State:
        """Lay the mesh anew where its polynomials leave out too much."""
        rough = mesh.roughness(self.breaks)
        if float(np.max(rough)) <= PATH_ROUGHNESS or mesh.elements >= MOST_ELEMENTS:
            return _State(mesh, load_factor, step.tangent)
        wanted = (rough / (0.1 * PATH_ROUGHNESS)) ** (1.0 / (self.stages + 1))
        elements = int(np.clip(np.sum(wanted), mesh.elements, 3 * mesh.elements))
        laid = self.newton(mesh.redistributed(elements, self.breaks), load_factor, PATH_TOLERANCE, most=8)
        if laid is None:
            return _State(mesh, load_factor, step.tangent)
        return _State(laid[0], load_factor, laid[1].tangent)

    # -- past a bifurcation ----------------------------------------------------------------------------------------

    def buckled(self, path: load_path.Path[_State]) -> load_path.Path[_State] | None:
        """Return the stable side of a bifurcation: the path with a small load along the unstable mode, then without it."""
        disturbed = path
        for _ in range(MOST_DISTURBANCES):
            if disturbed.unstable is None:
                break
            state, load_factor = disturbed.unstable
            mode = self.second_variation(state.mesh, load_factor).lowest_mode()[:, :3]
            largest = float(np.max(np.abs(mode)))
            if largest < SMALLEST_MODE:  # a mode of twist alone, which no force stirs
                break
            self.disturbances.append(CubicSpline(np.unique(state.mesh.x), mode / largest))
            self.disturbance = DISTURBANCE
            disturbed = load_path.follow(self, self.unloaded(), until_unstable=True)
        reached = disturbed.load_factor == 1.0 and disturbed.index == 0
        mesh = self._undisturbed(disturbed.state.mesh) if reached else None
        self.disturbance = 0.0
        if mesh is None or self.index(mesh, 1.0) != 0:
            return None
        return dataclasses.replace(disturbed, state=_State(mesh, 1.0), index=0, unstable=None)

    def _undisturbed(self, mesh: Mesh) -> Mesh | None:
        """Take the disturbance off at full load, in steps that Newton's method follows."""
        left, step = 1.0, 0.5
        while left > 0.0:
            goal = max(0.0, left - step)
            self.disturbance = DISTURBANCE * goal
            found = self.newton(mesh, 1.0, PATH_TOLERANCE, most=8)
            if found is None or found[2] > load_path.LARGEST_CORRECTED_TURN:
                step *= 0.5
                if step < SMALLEST_RELIEF:
                    return None
                continue
            mesh, left, step = found[0], goal, 1.5 * step
        return mesh

    # -- the answer ----------------------------------------------------------------------------------------------

    def refined(self, mesh: Mesh, method: Collocation, first: bool = False) -> tuple[Mesh, ErrorEstimate] | None:
        """Return the answer and its estimated error: meshes laid anew until the error is small enough.

        With ``first`` the given mesh is tried before any other is laid.
        """
        sharp = max(1e-3 * method.rtol, 1e-13)
        elements = method.elements or mesh.elements
        for attempt in range(8):
            guess = mesh if first and attempt == 0 else self._laid_anew(mesh, elements, method)
            coarse = self.newton(guess, 1.0, sharp, most=20)
            fine = None if coarse is None else self.newton(coarse[0].halved(), 1.0, sharp, most=12)
            if coarse is None or fine is None:
                return None
            mesh = fine[0]
            gap = size(mesh.y[coarse[0].in_halves] - coarse[0].y, mesh.y)
            error = max(SURE * gap / 2.0**method.order, ROUNDING)
            if method.elements or elements >= MOST_ELEMENTS or error <= method.rtol:
                estimate = self._error(coarse[0], mesh, method.order)
                return mesh if method.elements else self._dense(coarse[0], mesh, method.rtol, sharp), estimate
            elements = int(elements * np.clip(1.1 * (error / method.rtol) ** (1.0 / method.order), 1.2, 4.0)) + 1
        return mesh, self._error(coarse[0], mesh, method.order)

    def _laid_anew(self, mesh: Mesh, elements: int, method: Collocation) -> Mesh:
        if not method.elements:
            return mesh.redistributed(elements, self.breaks)
        even = np.unique(np.concatenate([np.linspace(0.0, 1.0, elements + 1), self.breaks]))
        return mesh.laid(np.sort(np.concatenate([even, mesh.x[mesh.joints]])))

    def _error(self, coarse: Mesh, fine: Mesh, order: int) -> ErrorEstimate:
        """Return what halving the elements changed, by the order's law, in SI units."""
        share, scale = SURE / 2.0**order, self.scale
        gaps = np.abs(fine.y[coarse.in_halves] - coarse.y)
        held = [0, *coarse.joints, *(coarse.joints + 1), len(coarse.x) - 1]
        force, moment = (float(np.max(np.linalg.norm(gaps[held, a : a + 3], axis=1))) for a in (FORCE, MOMENT))
        unit = units(fine.y)
        place = float(np.max(np.linalg.norm(gaps[:, :3], axis=1)))
        return ErrorEstimate(
            max(share * place, ROUNDING) * scale.length,
            max(share * force, ROUNDING * unit[FORCE]) * scale.force,
            max(share * moment, ROUNDING * unit[MOMENT]) * scale.moment,
        )

    def mesh_of(self, start: EquilibriumSolution) -> Mesh:
        """Return a solution of another problem on every second of its nodes, as the first guess of this one."""
        nodes, scale = np.unique(start.curve.s), self.scale
        x = nodes[:: 2 if len(nodes) > 2 * FIRST_ELEMENTS else 1] / nodes[-1]
        x = x[np.min(np.abs(x[:, None] - self.breaks), axis=1) > 1e-6] if len(self.breaks) else x
        x = np.unique(np.concatenate([[0.0], x, self.breaks, [1.0]]))
        points = np.concatenate([x, stage_points(x, self.stages).ravel()])
        y = start.curve(points * nodes[-1])
        y[:, :3] = (y[:, :3] - scale.origin) / scale.length
        y[:, FORCE:MOMENT] /= scale.force
        y[:, MOMENT:] /= scale.moment
        y[:, ROTATION:FORCE] /= np.linalg.norm(y[:, ROTATION:FORCE], axis=1, keepdims=True)
        mesh = Mesh(x, y[: len(x)], y[len(x) :].reshape(-1, self.stages, STATES))
        return mesh.jointed(np.array([at for at, _ in self.stations]))

    def _dense(self, coarse: Mesh, fine: Mesh, rtol: float, sharp: float) -> Mesh:
        """Halve the elements until the curve between the nodes is as good as the nodes are."""
        while fine.elements < MOST_ELEMENTS:
            between = self.curve(coarse, 1.0)(fine.x * self.scale.length)
            unit = np.repeat([self.scale.length, 1.0, self.scale.force, self.scale.moment], [3, 4, 3, 3])
            origin = np.concatenate([self.scale.origin, np.zeros(10)])
            smooth = ~np.isin(fine.x, self.breaks)
            gap = size((between - origin)[smooth] / unit - fine.y[smooth], fine.y)
            if gap <= GAIN * rtol:
                break
            finer = self.newton(fine.halved(), 1.0, sharp, most=6)
            if finer is None:
                break
            coarse, fine = fine, finer[0]
        return fine

    def curve(self, mesh: Mesh, load_factor: float) -> Curve:
        """Return the states at the nodes with their slopes, in SI units; twice where the slopes jump."""
        single = np.isin(mesh.x, self.breaks) & ~np.isin(mesh.x, mesh.x[mesh.joints])  # stations stand twice already
        x = np.repeat(mesh.x, np.where(single, 2, 1))
        y = np.repeat(mesh.y, np.where(single, 2, 1), axis=0)
        second = np.concatenate([[False], np.diff(x) == 0.0])
        first = np.concatenate([second[1:], [False]])
        at = np.where(first, x - BESIDE, np.where(second, x + BESIDE, x))
        table = self.table.loaded(load_factor, self.slack * (1.0 - load_factor))
        dy = coefficients.slopes(table(at), y)
        if self.problem.of_shape:
            shaped = self._loads_of_shape(x, y)
            dy[:, FORCE:MOMENT] -= load_factor * shaped[:, :3]
            dy[:, MOMENT:] -= load_factor * shaped[:, SHAPED_COUPLE : SHAPED_COUPLE + 3]
        return self.scale.curve(x, y, dy)


def _apart(places: set[float], stations: Iterable[float], length: float) -> Array:
    """Return the places in m over the length without those too close to be told apart; stations are kept."""
    result = [s / length for s in stations]
    for x in sorted(s / length for s in places):
        if all(abs(x - other) > CLOSEST for other in result):
            result.append(x)
    return np.array(sorted(result))


def _unit(a: Array) -> Array:
    length = float(np.linalg.norm(a))
    return a / length if length > 1e-12 else np.array([0.0, 0.0, 1.0])


def _turn(delta: Array) -> float:
    return float(np.max(np.linalg.norm(delta[:, 3:6], axis=1)))


def _solved(last: Array) -> tuple[Array, float]:
    """Solve the last 12 equations; return the unknowns (12, SIDES) of the end and the sign of the determinant.

    By singular values, so that a free motion is left alone: a rod that may turn about its axis, or about the line through
    its ends, or buckle in any plane. Such a motion has a singular value of rounding and nothing to do, which is the phase
    condition. Where the equations do ask for a step along it, as near a bifurcation, they get it.
    """
    A = last[:, :FREE]
    scale = np.linalg.norm(A, axis=1, keepdims=True)
    U, values, V = np.linalg.svd(A / scale)
    right = last[:, FREE:] / scale
    wanted = U.T @ right
    free = (values <= FREE_MOTION * values[0])[:, None] & (
        np.abs(wanted) <= IDLE * np.linalg.norm(right, axis=0) + NOISE
    )
    inverse = np.where(free, 0.0, 1.0 / np.maximum(values, 1e-300)[:, None])
    return V.T @ (inverse * wanted), float(np.linalg.det(U) * np.linalg.det(V))
