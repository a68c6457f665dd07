"""Gauss collocation: the solver of record.

Sources: C. de Boor and B. Swartz, SIAM J. Numer. Anal. 10 (1973) 582 (order 2 s at the nodes); U. M. Ascher,
R. M. M. Mattheij and R. D. Russell, Numerical Solution of Boundary Value Problems (SIAM, 1995), ch. 5, 7 and 9.
"""

from __future__ import annotations

import dataclasses
import time
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
from darboux.kernels.collocation import FEWEST_STAGES, FREE, JUMPS, MOST_STAGES, SHAPED, SHAPED_COUPLE, SIDES
from darboux.kernels.collocation import ROW as FACTOR_ROW
from darboux.kernels.rod_equations import FORCE, MOMENT, ROTATION, SINV, STATES
from darboux.loads import LineForce
from darboux.natural import smallest_rotation
from darboux.problem import Equilibrium
from darboux.solution import EquilibriumSolution, ErrorEstimate, Status
from darboux.statics import coefficients, load_path, stability
from darboux.statics.coefficients import Scale
from darboux.statics.end_conditions import EndConditions
from darboux.statics.mesh import Mesh, better_nodes, size, stage_points
from darboux.statics.stability import SecondVariation
from darboux.supports import Support

Array = NDArray[np.float64]

FIRST_ELEMENTS = 12
NATURAL_STEPS = 1000  # over which the unloaded shape is laid out
LARGEST_NATURAL_TURN = 1.5  # rad of an unloaded rod's frame over an element of the first mesh
PATH_TOLERANCE = 1e-5  # of Newton's last step on the way: the branch must be kept, not measured
PATH_ROUGHNESS = 2e-3  # of the polynomials on the way; where they leave out more the mesh is laid anew
MOST_ELEMENTS = 20_000
SLACK = 1e-3  # compliance of stretch lent to an inextensible rod held at both ends while it is on the way
DISTURBANCE = 0.1  # of EI / L^2, spread along the unstable mode
MOST_DISTURBANCES = 3
SMALLEST_MODE = 1e-8  # of displacements, over 1 for all of them together
SMALLEST_RELIEF = 1e-3  # of the disturbance that is taken off in a step
FREE_MOTION = 1e-9  # a singular value below this part of the largest belongs to a free motion ...
IDLE, NOISE = 1e-6, 1e-10  # ... if the equations ask for less than this along it, relative and absolute
SURE = 4.0  # the estimated error is this many times what the order promises
NOTHING = np.empty(0)  # no load is a function of the shape
ROUNDING_STRAIN = 1e-14  # of a stretching rod: what rounding of places amounts to
FLATTEST = 0.05  # stretch below which a rod counts as compressed to nothing
BESIDE = 1e-12  # of L, from a jump: on either side of what encloses it
CLOSEST = 1e-9  # of L, between two breaks
QUINTIC = 32.0  # by how much a quintic gains at least where its nodes are halved
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

    def solve(self, problem: Equilibrium) -> EquilibriumSolution:
        """Return the equilibrium that follows from the unloaded rod; the status says whether the path got there."""
        began = time.perf_counter()
        equations = _Equations(problem, self)
        with np.errstate(all="ignore"):  # a Newton step that leaves the numbers' range is rejected
            path = load_path.follow(equations, equations.unloaded(), until_unstable=True)
            code, message = load_path.ending(path, "Collocation")
            if path.unstable is not None and equations.has_potential:
                buckled = equations.buckled(path)
                if buckled is None:  # then at least the unstable branch, and said to be so
                    path = load_path.follow(equations, equations.unloaded())
                    code, message = load_path.ending(path, "Collocation")
                else:
                    a, b = path.crossings[0]
                    path = buckled
                    code, message = (
                        "converged",
                        (
                            "converged: the stable equilibrium that follows from the unloaded rod. Between "
                            f"{100.0 * a:.4g} % and {100.0 * b:.4g} % of the load the straight-on branch turns unstable, and "
                            "the rod leaves it to the side that a small disturbance gives."
                        ),
                    )
            if path.load_factor < 1.0 and equations.flattest(path.state.mesh) < FLATTEST:
                code, message = "no_convergence", load_path.flattened(path)
            answer, error = path.state.mesh, None
            if path.load_factor == 1.0:
                refined = equations.refined(path.state.mesh, self)
                if refined is None:
                    code, message = (
                        "no_convergence",
                        (
                            f"Newton's method did not settle at rtol = {self.rtol:g}; the answer on the coarse mesh is in "
                            ".solution. Ask for a larger rtol."
                        ),
                    )
                else:
                    answer, error = refined
        L = problem.rod.length
        return EquilibriumSolution(
            problem,
            self,
            problem.rod.model,
            Status(code, message),
            equations.curve(answer, path.load_factor),
            load_factor=path.load_factor,
            index=path.index,
            error=ErrorEstimate(None if error is None else error * L),
            statistics={
                "seconds": time.perf_counter() - began,
                "elements": answer.elements,
                "load_steps": path.steps,
                "rejected_steps": path.rejected,
                "newton_iterations": equations.iterations,
                "crossings": tuple(path.crossings),
            },
        )


@dataclass(frozen=True, eq=False)
class _State:
    """A mesh with its solution, and the change of the solution per unit of load factor (N + 1, 12) where known."""

    mesh: Mesh
    load_factor: float = 0.0
    tangent: Array | None = None


@dataclass
class _Step:
    """Newton's step (N + 1, 12) at a mesh, the derivative by the load factor, and the sign of the determinant."""

    delta: Array
    tangent: Array
    sign: float


class _Equations:
    """The collocation equations of one problem, for `load_path.follow`."""

    def __init__(self, problem: Equilibrium, method: Collocation) -> None:
        self.problem = problem
        self.stages = method.stages
        self.scale = Scale.of(problem)
        self.table = coefficients.table(problem, self.scale)
        self.breaks = _apart(np.array(sorted({*problem.breaks, *problem.jumps})) / problem.rod.length)
        self.start = EndConditions(problem, "start", self.scale)
        self.end = EndConditions(problem, "end", self.scale)
        both = problem.start.holds and problem.end.holds
        self.slack = SLACK if both and not problem.rod.stretch else 0.0
        softest = float(np.max(np.abs(self.table.coefficients[:, 0, SINV : SINV + 3])))
        self.rounding = ROUNDING_STRAIN / softest if softest > 0.0 else 0.0  # of n: what a rounded place makes of EA
        self.has_potential = stability.has_potential(problem)
        self.iterations = 0
        self.disturbance = 0.0
        self.disturbances: list[CubicSpline] = []  # the modes (n, 3) along which a small load acts, as functions of x
        self._last: tuple[float, Array] = (np.nan, np.empty(0))

    def _data(self, load_factor: float, compliance: float = 0.0) -> tuple[Array, Array, int]:
        """Return the table for the kernels, which scale the loads themselves."""
        slack = max(self.slack * (1.0 - load_factor), 0.0 if self.problem.rod.stretch else compliance)
        if self._last[0] != slack:
            self._last = (slack, self.table.loaded(1.0, slack).coefficients.ravel())
        return self.table.breaks, self._last[1], self.table.degree

    # -- the unloaded rod ----------------------------------------------------------------------------------------

    def unloaded(self) -> _State:
        """Return the natural shape, laid against the support that holds it."""
        problem = self.problem
        held, place, orientation = self._laid()
        x = self._first_nodes()
        points = np.unique(np.concatenate([x, stage_points(x, self.stages).ravel()]))
        states = np.zeros((len(points), STATES))
        states[:, :3], states[:, ROTATION:FORCE] = self._natural_shape(points)
        R = frames.matrix_of_quaternion(states[:, ROTATION:FORCE])
        chord = states[-1, :3] - states[0, :3]
        turn = orientation @ R[place].T if orientation.shape == (3, 3) else smallest_rotation(_unit(chord), orientation)
        states[:, ROTATION:FORCE] = frames.same_sign(frames.quaternion_of_matrix(turn @ R))
        states[:, :3] = (states[:, :3] - states[place, :3]) @ turn.T
        position = (np.array(held.position) - self.scale.origin) / self.scale.length
        states[:, :3] += position
        for conditions, support, y in ((self.start, problem.start, states[0]), (self.end, problem.end, states[-1])):
            if support is not held and support.holds:
                conditions.grow_from(y)
        nodes = np.isin(points, x)
        mesh = Mesh(x, states[nodes], states[~nodes].reshape(len(x) - 1, self.stages, STATES))
        return _State(mesh)

    def _natural_shape(self, points: Array) -> tuple[Array, Array]:
        """Return the unloaded rod's places (n, 3) and quaternions (n, 4) at points (n,), from the origin and d_i = e_i on.

        The frame turns by the mean of k0 over short steps; the places follow by Simpson's rule. Only a first guess.
        """
        steps = np.unique(np.concatenate([points, np.linspace(0.0, 1.0, NATURAL_STEPS + 1)]))
        fine = np.sort(np.concatenate([steps, 0.5 * (steps[1:] + steps[:-1])]))
        h = np.diff(fine)
        k0 = self.problem.rod.k0(0.5 * (fine[1:] + fine[:-1]) * self.scale.length) * self.scale.length
        q = frames.accumulated(frames.quaternion_of_turn(k0 * h[:, None]))
        d3 = frames.matrix_of_quaternion(q)[:, :, 2]
        moved = (h[::2] + h[1::2])[:, None] / 6.0 * (d3[:-1:2] + 4.0 * d3[1::2] + d3[2::2])
        r = np.concatenate([np.zeros((1, 3)), np.cumsum(moved, axis=0)])
        at = np.searchsorted(steps, points)
        return r[at], q[::2][at]

    def _laid(self) -> tuple[Support, int, Array]:
        """Return the support that places the unloaded rod, its node, and how it lies: a frame there, or its chord's direction."""
        start, end = self.problem.start, self.problem.end
        held, place = (start, 0) if any(start.held_displacement) or not any(end.held_displacement) else (end, -1)
        if not held.holds:
            held, place = (end, -1) if held is start else (start, 0)
        other = end if held is start else start
        if any(held.held_rotation) or held.rotational is not None:
            return held, place, held.R
        if any(other.held_rotation) or other.rotational is not None:
            return (
                (other, -1 if other is end else 0, other.R) if any(other.held_displacement) else (held, place, other.R)
            )
        between = np.array(end.position) - np.array(start.position)
        if all(start.held_displacement) and all(end.held_displacement) and np.linalg.norm(between) > 0.0:
            return held, place, _unit(between)
        for support in (end, start):
            if any(support.held_displacement) and not all(support.held_displacement) and support.sliding == "fixed":
                return held, place, support.displacement_axes[:, 0]
        return held, place, np.array([0.0, 0.0, 1.0])

    def _first_nodes(self) -> Array:
        """Return nodes so close that the natural shape turns little over an element."""
        x = np.linspace(0.0, 1.0, 1025)
        k0 = np.linalg.norm(self.problem.rod.k0(x * self.scale.length), axis=1) * self.scale.length
        pieces = np.minimum(1.0 / np.diff(self.table.breaks), 1024.0)  # where the data need short polynomials
        there = np.searchsorted(self.table.breaks, 0.5 * (x[1:] + x[:-1]), side="right") - 1
        turned = (0.5 * (k0[1:] + k0[:-1]) + pieces[there]) * np.diff(x)
        elements = max(FIRST_ELEMENTS, int(np.ceil(np.sum(turned) / LARGEST_NATURAL_TURN)))
        return better_nodes(x, turned, elements, self.breaks)

    # -- Newton's equations --------------------------------------------------------------------------------------

    def newton_step(self, mesh: Mesh, load_factor: float) -> _Step | None:
        """Return Newton's step and the tangent, or None where the numbers leave their range."""
        self.iterations += 1
        conditions = np.empty((6, FREE + SIDES))
        self._fill(conditions, self.start, mesh.y[0], load_factor)
        factors = np.empty(mesh.elements * FREE * FACTOR_ROW)
        arguments = (*self._arguments(mesh, load_factor), conditions.ravel(), factors)
        sign = collocation.sweep(*arguments)
        last = np.empty((FREE, FREE + SIDES))
        last[:6] = conditions
        self._fill(last[6:], self.end, mesh.y[-1], load_factor)
        if not np.all(np.isfinite(last)):
            return None
        delta = np.empty((mesh.elements + 1, FREE, SIDES))
        delta[-1], last_sign = _solved(last)
        collocation.back(factors, delta.ravel())
        if not np.all(np.isfinite(delta)):
            return None
        return _Step(np.ascontiguousarray(delta[:, :, 0]), np.ascontiguousarray(delta[:, :, 1]), sign * last_sign)

    @staticmethod
    def _fill(out: Array, conditions: EndConditions, y: Array, load_factor: float) -> None:
        rows, values, by_load_factor = conditions.system(y, load_factor)
        out[:, :FREE] = rows
        out[:, FREE] = -values
        out[:, FREE + 1] = -by_load_factor

    def _arguments(self, mesh: Mesh, load_factor: float, compliance: float = 0.0) -> Any:
        """Return what all kernels of `collocation` take first."""
        shaped = self._shaped(mesh) if self.problem.of_shape or self.disturbance else NOTHING
        data = self._data(load_factor, compliance)
        states = (mesh.x, mesh.y.ravel(), mesh.Y.ravel())
        return (self.stages, *states, self._jumps(mesh.x), *data, shaped, load_factor, -self.slack)

    def _jumps(self, x: Array) -> Array:
        """Return the loads at points, dimensionless, at the nodes x: (n, JUMPS) flat."""
        result = np.zeros((len(x), JUMPS))
        for s, load in self.problem.points.items():
            i = int(np.argmin(np.abs(x - s / self.scale.length)))
            forces = np.concatenate([load.force, load.section_force]) / self.scale.force
            result[i] += np.concatenate(
                [forces, np.concatenate([load.moment, load.section_moment]) / self.scale.moment]
            )
        return result.ravel()

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
        floor = self.rounding / (1.0 + float(np.max(np.linalg.norm(mesh.y[:, FORCE:MOMENT], axis=1))))
        for iteration in range(1, most + 1):
            step = self.newton_step(mesh, load_factor)
            if step is None:
                return None
            length = _length(step.delta, mesh.y)
            if not np.isfinite(length) or length > max(0.5 * last, 10.0 * tolerance, floor):
                return None
            mesh = self.moved(mesh, load_factor, step.delta)
            turn += _turn(step.delta)
            if length <= max(tolerance, floor):
                return (mesh, step, turn, iteration) if self.flattest(mesh) > 0.0 else None
            last = length
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
        R = frames.matrix_of_quaternion(mesh.y[:, ROTATION:FORCE])
        T[:, 3:6] = R[1:] @ T[:, 3:6]  # from rotations in the section's frame to those in the fixed one
        T[:, :, 3:6] = T[:, :, 3:6] @ R[:-1].transpose(0, 2, 1)
        springs = self.start.stiffness, self.end.stiffness
        return stability.second_variation(T, self.problem, mesh.y, springs)

    def tangent(self, state: _State, load_factor: float) -> tuple[Array, float]:
        tangent = state.tangent
        if tangent is None:
            step = self.newton_step(state.mesh, load_factor)
            if step is None:
                return np.zeros((state.mesh.elements + 1, FREE)), np.inf
            tangent = step.tangent
        return tangent, _turn(tangent)

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
            self.disturbances.append(CubicSpline(state.mesh.x, mode / largest))
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

    def refined(self, mesh: Mesh, method: Collocation) -> tuple[Mesh, float] | None:
        """Return the answer and its estimated error: meshes laid anew until the error is small enough."""
        sharp = max(1e-3 * method.rtol, 1e-13)
        elements = method.elements or mesh.elements
        for _ in range(8):
            if method.elements:
                guess = mesh.laid(np.unique(np.concatenate([np.linspace(0.0, 1.0, elements + 1), self.breaks])))
            else:
                guess = mesh.redistributed(elements, self.breaks)
            coarse = self.newton(guess, 1.0, sharp, most=20)
            fine = None if coarse is None else self.newton(coarse[0].halved(), 1.0, sharp, most=12)
            if coarse is None or fine is None:
                return None
            mesh = fine[0]
            gap = size(mesh.y[::2] - coarse[0].y, mesh.y)
            error = max(SURE * gap / 2.0**method.order, ROUNDING)
            if method.elements or elements >= MOST_ELEMENTS:
                return mesh, error
            if error <= method.rtol:
                return self._dense(coarse[0], mesh, method.rtol, sharp), error
            elements = int(elements * np.clip(1.1 * (error / method.rtol) ** (1.0 / method.order), 1.2, 4.0)) + 1
        return mesh, error

    def _dense(self, coarse: Mesh, fine: Mesh, rtol: float, sharp: float) -> Mesh:
        """Halve the elements until the curve between the nodes, a quintic, is as good as the nodes are."""
        while fine.elements < MOST_ELEMENTS:
            between = self.curve(coarse, 1.0)(fine.x * self.scale.length)
            unit = np.repeat([self.scale.length, 1.0, self.scale.force, self.scale.moment], [3, 4, 3, 3])
            origin = np.concatenate([self.scale.origin, np.zeros(10)])
            smooth = ~np.isin(fine.x, self.breaks)
            gap = size((between - origin)[smooth] / unit - fine.y[smooth], fine.y)
            if gap <= QUINTIC * rtol:
                break
            finer = self.newton(fine.halved(), 1.0, sharp, most=6)
            if finer is None:
                break
            coarse, fine = fine, finer[0]
        return fine

    def curve(self, mesh: Mesh, load_factor: float) -> Curve:
        """Return the states at the nodes with their slopes, in SI units; twice where the slopes jump."""
        jump = np.isin(mesh.x, self.breaks)
        x = np.repeat(mesh.x, np.where(jump, 2, 1))
        y = np.repeat(mesh.y, np.where(jump, 2, 1), axis=0)
        second = np.concatenate([[False], np.diff(x) == 0.0])
        first = np.concatenate([second[1:], [False]])
        at = np.where(first, x - BESIDE, np.where(second, x + BESIDE, x))
        for s, load in self.problem.points.items():  # behind a point load the forces are less by it
            i = int(np.flatnonzero(second)[np.argmin(np.abs(x[second] - s / self.scale.length))])
            R = frames.matrix_of_quaternion(y[i, ROTATION:FORCE])
            y[i, FORCE:MOMENT] -= load_factor * (load.force + R @ load.section_force) / self.scale.force
            y[i, MOMENT:] -= load_factor * (load.moment + R @ load.section_moment) / self.scale.moment
        table = self.table.loaded(load_factor, self.slack * (1.0 - load_factor))
        dy = coefficients.slopes(table(at), y)
        if self.problem.of_shape:
            shaped = self._loads_of_shape(x, y)
            dy[:, FORCE:MOMENT] -= load_factor * shaped[:, :3]
            dy[:, MOMENT:] -= load_factor * shaped[:, SHAPED_COUPLE : SHAPED_COUPLE + 3]
        return self.scale.curve(x, y, dy)


def _length(delta: Array, y: Array) -> float:
    """Return the largest step of a vector at a node, in the units of the states."""
    change = np.concatenate([delta[:, 0:3], np.zeros((len(delta), 1)), 0.5 * delta[:, 3:6], delta[:, 6:12]], axis=1)
    return size(change, y)


def _apart(places: Array) -> Array:
    """Return the places without those that follow another one too closely to be told from it."""
    return places[np.concatenate([[True], np.diff(places) > CLOSEST])] if len(places) else places


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
