"""The collocation equations of one problem: Newton's steps on a mesh, the branch that is followed, its stability.

Sources: U. M. Ascher, R. M. M. Mattheij and R. D. Russell, Numerical Solution of Boundary Value Problems (SIAM, 1995),
ch. 5 and 7.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.curve import Curve
from darboux.kernels import collocation
from darboux.kernels import newton as kernel
from darboux.kernels import stability as stability_kernel
from darboux.kernels.collocation import SHAPED_COUPLE
from darboux.kernels.newton import Work, new_work
from darboux.kernels.path import MOST_ITERATIONS
from darboux.kernels.rod_equations import BINV, DEAD_FORCE, FORCE, K0, MOMENT, ROTATION, SINV, STATES
from darboux.kernels.system import FREE, SIDES, System
from darboux.natural import smallest_rotation
from darboux.packing import coefficients
from darboux.packing.cells import symmetric
from darboux.packing.coefficients import Law, Table
from darboux.packing.ends import EndConditions
from darboux.packing.laying import shape_of
from darboux.packing.loads import DEAD, FOLLOWER, GRADIENT, LOADS
from darboux.packing.problem import Packing
from darboux.problem import Equilibrium
from darboux.solution import EquilibriumSolution
from darboux.statics.first_shape import FirstShape
from darboux.statics.mesh import Mesh, better_nodes, stage_points
from darboux.statics.stability import SecondVariation

Array = NDArray[np.float64]

ANSWER = 8.0  # elements for an answer to 1e-9, over the sum of what the elements on the way leave out, each to the power of 1/3
FIRST_ELEMENTS, FEWEST_OF_ANSWER = 8, 4
LARGEST_NATURAL_TURN = 1.5  # rad of an unloaded rod's frame over an element of the first mesh
SLACK = 1e-3  # compliance of stretch lent on the way to a rod held at both ends that has less: a stiff one meets all its buckling
# loads at once
NOTHING = np.zeros(0)  # no load is a function of the shape
ROUNDING_STRAIN = 1e-14  # of a stretching rod: what rounding of places amounts to
BESIDE = 1e-12  # of L, from a jump: on either side of what encloses it
CLOSEST = 1e-11  # of L, between two breaks


class Pace(NamedTuple):
    """How a path is followed: stages of an element, what Newton's method leaves over, and what the polynomials may leave out."""

    stages: int
    tolerance: float
    roughness: float


QUICK = Pace(2, 1e-2, 0.05)  # on the way only the branch matters
CAREFUL = Pace(4, 1e-6, 2e-3)  # ... but near a bifurcation small errors make a fold of it


@dataclass
class Step:
    """Newton's step (N + 1, 12) at a mesh, its length and its largest turn; the derivative by the load factor and its turn.

    ``sign`` is that of the determinant, ``left`` the length of the next step as foreseen.
    """

    delta: Array
    length: float
    turn: float
    tangent: Array
    tangent_turn: float
    sign: float
    left: float

    @classmethod
    def of(cls, work: Work) -> Step:
        """Return the step that the kernel left in its work."""
        delta = work.delta.reshape(-1, FREE, SIDES)
        kept = kernel.LENGTH, kernel.SIGN, kernel.TURN, kernel.TANGENT_TURN, kernel.LEFT
        length, sign, turn, tangent_turn, left = (float(work.kept[k]) for k in kept)
        return cls(
            np.ascontiguousarray(delta[:, :, 0]),
            length,
            turn,
            np.ascontiguousarray(delta[:, :, 1]),
            tangent_turn,
            sign,
            left,
        )


class Equations:
    """The collocation equations of one problem; with two ``stages`` its path is followed quickly, with more carefully."""

    def __init__(
        self, problem: Equilibrium, stages: int, shape: FirstShape | None = None, slack: float = SLACK
    ) -> None:
        self.problem = problem
        self.pace = QUICK if stages == QUICK.stages else CAREFUL._replace(stages=stages)
        self.packing = Packing(problem)
        self.scale = self.packing.scale
        self.shape = shape
        if shape is None:
            self.table, self.relaxing = self.packing.table, None
        else:
            self.table, self.relaxing = self.packing.table_and_strain(shape.k, shape.knots)
        self.breaks, self.widths = kinks(problem, self.table if problem.dense else None)
        self.start, self.end = self.packing.ends
        self.stations = self.packing.stations
        self.held_between = [conditions for _, conditions in self.stations if conditions.holds]
        self.conditions = [self.start, *(conditions for _, conditions in self.stations), self.end]
        self.slack = 0.0 if shape is not None and shape.sags else self.packing.lent(slack)
        compliances = np.max(np.abs(self.table.coefficients[:, 0, :K0]), axis=0)
        self.softest, stretch = float(np.max(compliances[:3])), float(np.max(compliances[SINV : SINV + 3]))
        self.rounding = ROUNDING_STRAIN / stretch if stretch > 0.0 else 0.0  # of n: what a rounded place makes of EA
        self.has_potential = self.packing.has_potential
        self.iterations = 0
        self.free = 0  # free motions that the last step left alone
        self.disturb(())

    def disturb(self, loads: Sequence[Table]) -> None:
        """Write the law c + lambda c' of the coefficients, with some more loads f, each as a table of three columns."""
        table = functools.reduce(lambda table, more: table.plus(more, DEAD_FORCE), loads, self.table)
        relaxing = self.relaxing
        if relaxing is not None and table is not self.table:
            relaxing = Table(self.table.breaks, relaxing).on(table.breaks, table.degree).coefficients
        self.is_disturbed = len(loads) > 0
        self.law = Law(table.breaks, *table.law(self.slack, relaxing))

    @property
    def tells_load(self) -> bool:
        """Whether a load factor is the problem's own: not where compliance that is lent takes up how far supports move."""
        return self.slack == 0.0 or not any(conditions.moves for conditions in self.conditions)

    # -- the unloaded rod ----------------------------------------------------------------------------------------

    def unloaded(self) -> Mesh:
        """Return the rod without loads: its natural shape, laid against the support that holds it, or the first shape."""
        x = self._first_nodes()
        points = np.unique(np.concatenate([x, stage_points(x, self.pace.stages).ravel()]))
        states = np.zeros((len(points), STATES))
        support, straight = None, False
        if self.shape is None:
            straight = self.problem.uniform and not np.any(self.natural_shape(points[:1]))
            if straight:
                states[:, 2], states[:, ROTATION] = points, 1.0
            else:
                states[:, :ROTATION], states[:, ROTATION:FORCE] = shape_of(self.natural_shape, points)
            support = self._lay(points, states)
        else:
            states[:, :ROTATION], states[:, ROTATION:FORCE] = self.shape.states(points)
        for at, conditions in ((0.0, self.start), *self.stations, (1.0, self.end)):
            if conditions.holds and conditions is not support:
                conditions.grow_from(states[np.searchsorted(points, at)], all_at_once=self.shape is not None)
        if self.shape is not None and self.shape.link is not None and self.problem.link is not None:
            self.end.turn_by(frames.turn * (self.problem.link - self.shape.link))
        mesh = self._mesh(x, points, states)
        if straight:
            return mesh
        exact = self.newton(mesh, 0.0, self.pace.tolerance, most=MOST_ITERATIONS)
        return mesh if exact is None else exact[0]

    def bent(self, k: Callable[[Array], Array], x: Array, carrying: bool) -> Mesh:
        """Return the rod bent to the curvature and twist k L, with the moments of that and, if asked, the forces of the loads."""
        points = np.unique(np.concatenate([x, stage_points(x, self.pace.stages).ravel()]))
        states = np.zeros((len(points), STATES))
        states[:, :ROTATION], states[:, ROTATION:FORCE] = shape_of(k, points)
        self._lay(points, states)
        c = self.packing.columns(points)
        moment = np.linalg.solve(symmetric(c[:, BINV : BINV + 6]), (k(points) - c[:, K0 : K0 + 3])[:, :, None])
        R = frames.matrix_of_quaternion(states[:, ROTATION:FORCE])
        states[:, MOMENT:] = (R @ moment)[:, :, 0]
        if carrying:
            states[:, FORCE:MOMENT] = self._carried(points, states, R, c[:, LOADS])
        return self._mesh(x, points, states)

    def _carried(self, x: Array, states: Array, R: Array, loads: Array) -> Array:
        """Return the inner forces (n, 3) that carry the loads along a guessed shape to a held end."""
        from scipy.integrate import cumulative_trapezoid  # slow to load, and seldom needed

        moved = np.einsum("nij,nj->ni", loads[:, GRADIENT].reshape(-1, 3, 3), states[:, :3])
        f = loads[:, DEAD] + moved + np.einsum("nij,nj->ni", R, loads[:, FOLLOWER])
        n = -cumulative_trapezoid(f, x, axis=0, initial=0.0)
        if not all(self.end.held_places):
            n += self.end.load.force - n[-1]
        elif not all(self.start.held_places):
            n += -self.start.load.force - n[0]
        else:
            n -= np.mean(n, axis=0)
        return np.asarray(n)

    def _mesh(self, x: Array, points: Array, states: Array) -> Mesh:
        nodes = np.isin(points, x)
        mesh = Mesh(x, states[nodes], states[~nodes].reshape(len(x) - 1, self.pace.stages, STATES))
        return mesh.jointed(np.array([at for at, _ in self.stations])) if self.stations else mesh

    def natural_shape(self, x: Array) -> Array:
        """Return k0 L at x (n,): (n, 3)."""
        return self.packing.natural(x)

    def _lay(self, points: Array, states: Array) -> EndConditions:
        """Turn and move the states of the unloaded rod to where a support holds it; return that support."""
        held, place, orientation = self.packing.at_rest()
        there = states[int(np.searchsorted(points, place))].copy()
        q, R = there[ROTATION:FORCE], frames.matrix_of_quaternion(there[ROTATION:FORCE])
        chord = states[-1, :3] - states[0, :3]
        turn = orientation @ R.T if orientation.shape == (3, 3) else smallest_rotation(_unit(chord), orientation)
        turned = frames.product(frames.quaternion_of_matrix(turn @ R), q * [1.0, -1.0, -1.0, -1.0])
        states[:, ROTATION:FORCE] = frames.product(turned, states[:, ROTATION:FORCE])
        states[:, :3] = (states[:, :3] - there[:3]) @ turn.T + held.place
        return held

    def _first_nodes(self) -> Array:
        """Return nodes so close that the natural shape turns little over an element."""
        if self.shape is None and self.problem.uniform and len(self.breaks) == 0:
            k0 = float(np.linalg.norm(self.natural_shape(np.array([0.5]))))
            return np.linspace(0.0, 1.0, max(FIRST_ELEMENTS, int(np.ceil((k0 + 1.0) / LARGEST_NATURAL_TURN))) + 1)
        x = np.union1d(np.linspace(0.0, 1.0, 1025), self.breaks)  # a sharp bend lies between two breaks
        k0 = np.linalg.norm(
            (self.natural_shape if self.shape is None else self.shape.k)(0.5 * (x[1:] + x[:-1])), axis=1
        )
        pieces = np.minimum(1.0 / np.diff(self.table.breaks), 1024.0)  # where the data need short polynomials
        there = np.searchsorted(self.table.breaks, 0.5 * (x[1:] + x[:-1]), side="right") - 1
        turned = (k0 + pieces[there]) * np.diff(x)
        elements = max(FIRST_ELEMENTS, int(np.ceil(np.sum(turned) / LARGEST_NATURAL_TURN)))
        nodes = better_nodes(x, turned, elements, self.breaks)
        return nodes if self.shape is None else np.union1d(nodes, self.shape.layers)

    # -- Newton's equations --------------------------------------------------------------------------------------

    def newton_step(self, mesh: Mesh, load_factor: float) -> Step | None:
        """Return Newton's step and the tangent, or None where the numbers leave their range."""
        work = self._work(mesh)
        found = self._stepped(mesh, load_factor, work, np.inf, 0.0, most=0)
        return Step.of(work) if found else None

    def _stepped(self, mesh: Mesh, load_factor: float, work: Work, tolerance: float, floor: float, most: int) -> bool:
        """Let the kernel take Newton's steps from a mesh, which is moved; return whether they became small."""
        system, supports = self.system(mesh, load_factor), self.supports(load_factor)
        while (reason := kernel.newton(system, supports, work, float(tolerance), floor, most)) == kernel.LOADS:
            system.shaped[:] = self.shaped(mesh)
        self.iterations += int(work.kept[kernel.STEPS])
        self.free = int(work.kept[kernel.IDLE_MOTIONS])
        return bool(reason == kernel.CONVERGED)

    def free_motions(self, mesh: Mesh) -> int:
        """Return how many motions cost an equilibrium at full load nothing: a round rod's buckling plane may turn."""
        self.newton_step(mesh, 1.0)
        return self.free

    def system(self, mesh: Mesh, load_factor: float) -> System:
        """Return what the kernels of `collocation` take first."""
        shaped = self.shaped(mesh) if self.problem.of_shape else NOTHING
        states = (mesh.x, mesh.y.ravel(), mesh.Y.ravel())
        return System(mesh.stages, *states, *self.law.at(load_factor), shaped, float(load_factor))

    def supports(self, load_factor: float) -> Array:
        """Return the numbers of what holds the start, the stations and the end."""
        return np.concatenate([c.numbers(load_factor) for c in self.conditions])

    def _work(self, mesh: Mesh) -> Work:
        work = new_work(len(mesh.x) - 1, mesh.stages)
        work.kept[kernel.LENGTH] = np.inf
        return work

    def shaped(self, mesh: Mesh) -> Array:
        """Return the loads that are functions of the shape at the stages: flat."""
        return self._loads_of_shape(stage_points(mesh.x, mesh.stages).ravel(), mesh.Y.reshape(-1, STATES)).ravel()

    def _loads_of_shape(self, points: Array, states: Array) -> Array:
        """Return the loads that are functions of the shape, with their derivatives, at the states (n, 13): (n, SHAPED)."""
        return self.packing.of_shape(points, states[:, :3], frames.matrix_of_quaternion(states[:, ROTATION:FORCE]))

    def moved(self, mesh: Mesh, load_factor: float, delta: Array, change: float = 0.0, part: float = 1.0) -> Mesh:
        """Return the mesh moved along a step of the nodes and a change of the load factor."""
        y, Y = np.empty_like(mesh.y), np.empty_like(mesh.Y)
        step = np.zeros((*delta.shape, SIDES))
        step[:, :, 0] = delta
        system = self.system(mesh, load_factor)
        collocation.advance(system, step.ravel(), float(change), float(part), NOTHING, y.ravel(), Y.ravel())
        return Mesh(mesh.x, y, Y)

    def newton(
        self, mesh: Mesh, load_factor: float, tolerance: float, most: int
    ) -> tuple[Mesh, Step, float, int] | None:
        """Return the solution, the last step, the largest turn and the iterations of Newton's method; None unless it contracts."""
        floor = self.rounding / (1.0 + float(np.max(np.abs(mesh.y[:, FORCE:MOMENT])))) if self.rounding else 0.0
        mesh, work = Mesh(mesh.x, mesh.y.copy(), mesh.Y.copy()), self._work(mesh)
        if not self._stepped(mesh, load_factor, work, tolerance, floor, most) or not self.flattest(mesh) > 0.0:
            return None
        return mesh, Step.of(work), float(work.kept[kernel.TURNED]), int(work.kept[kernel.STEPS])

    def largest_force(self, mesh: Mesh) -> float:
        """Return the largest inner force at the nodes."""
        return float(np.max(np.linalg.norm(mesh.y[:, FORCE:MOMENT], axis=1)))

    def flattest(self, mesh: Mesh) -> float:
        """Return the least stretch v3 = 1 + (S^-1 R^T n)_3 at the nodes."""
        return self.table.least_stretch(mesh.x, mesh.y) if self.problem.rod.stretch else 1.0

    def index(self, mesh: Mesh, load_factor: float) -> int | None:
        """Return the number of unstable directions; None where the loads have no potential."""
        if not self.has_potential:
            return None
        system, lend = self.system(mesh, load_factor), not self.problem.rod.stretch
        return int(stability_kernel.unstable_directions(system, self.supports(load_factor), lend, NOTHING))

    def second_variation(self, mesh: Mesh, load_factor: float) -> SecondVariation:
        """Return the second variation of the energy at an equilibrium."""
        N, lend = mesh.elements, not self.problem.rod.stretch
        diagonal, below, weights = np.zeros((N + 1, FREE, FREE)), np.zeros((N, FREE, FREE)), np.zeros((N + 1, FREE))
        sizes = np.empty(N + 1, np.int64)
        flat = diagonal.ravel(), below.ravel(), weights.ravel(), sizes
        system, transfer = self.system(mesh, load_factor), np.empty(N * FREE * FREE)
        collocation.transfers(system, transfer)
        pieces = np.append(np.flatnonzero(mesh.wide), len(mesh.x) - 1)
        supports = self.supports(load_factor)
        of_forces, foundation = stability_kernel.second_variation(system, supports, lend, transfer, pieces, *flat)
        places = [0, *(int(i) - k for k, i in enumerate(mesh.joints)), N]  # a joint is one node here
        nodes = [0, *mesh.joints, -1]
        held = {i: c.held(mesh.y[k], load_factor) for i, k, c in zip(places, nodes, self.conditions, strict=True)}
        return SecondVariation(diagonal, below, sizes, weights, held, of_forces, foundation)

    # -- the answer ----------------------------------------------------------------------------------------------

    def elements_for_answer(self, mesh: Mesh, stages: int, rtol: float) -> int:
        """Return with how many elements of so many stages an answer is likely to be good enough, before they are halved."""
        wanted = np.sum(mesh.roughness(self.breaks) ** (1.0 / (mesh.stages + 1)))
        return max(FEWEST_OF_ANSWER, int(np.ceil(ANSWER * (1e-9 / rtol) ** (0.5 / stages) * wanted)))

    def mesh_of(self, start: EquilibriumSolution, every: int = 2) -> Mesh:
        """Return a solution of another problem on every second of its nodes, or ``every`` n-th, as a first guess."""
        return self.mesh_along(start.curve, every)

    def mesh_along(self, curve: Curve, every: int = 2) -> Mesh:
        """Return a curve that is near the solution on every second of its nodes, or ``every`` n-th, as a first guess."""
        nodes = np.unique(curve.s)
        x = nodes[:: every if len(nodes) > 2 * FEWEST_OF_ANSWER else 1] / nodes[-1]
        x = x[np.min(np.abs(x[:, None] - self.breaks), axis=1) > 1e-6] if len(self.breaks) else x
        x = np.unique(np.concatenate([[0.0], x, self.breaks, [1.0]]))
        points = np.concatenate([x, stage_points(x, self.pace.stages).ravel()])
        y = self.scale.states(curve, points)
        y[:, ROTATION:FORCE] /= np.linalg.norm(y[:, ROTATION:FORCE], axis=1, keepdims=True)
        mesh = Mesh(x, y[: len(x)], y[len(x) :].reshape(-1, self.pace.stages, STATES))
        return mesh.jointed(np.array([at for at, _ in self.stations]))

    def curve(self, mesh: Mesh, load_factor: float) -> Curve:
        """Return the states at the nodes with their slopes, in SI units; twice where the slopes jump."""
        x = at = mesh.x
        y = mesh.y
        if len(self.breaks):
            single = np.isin(x, self.breaks) & ~np.isin(x, x[mesh.joints])  # stations stand twice already
            x, y = np.repeat(x, np.where(single, 2, 1)), np.repeat(y, np.where(single, 2, 1), axis=0)
            second = np.concatenate([[False], np.diff(x) == 0.0])
            first = np.concatenate([second[1:], [False]])
            nearest = np.minimum(np.searchsorted(self.breaks, x), len(self.breaks) - 1)
            width = np.where(self.breaks[nearest] == x, self.widths[nearest], 0.0)
            at = np.where(first, x - width - BESIDE, np.where(second, x + width + BESIDE, x))
        dy = coefficients.slopes(self.law.table(load_factor)(at), y)
        if self.problem.of_shape:
            shaped = self._loads_of_shape(x, y)
            dy[:, FORCE:MOMENT] -= load_factor * shaped[:, :3]
            dy[:, MOMENT:] -= load_factor * shaped[:, SHAPED_COUPLE : SHAPED_COUPLE + 3]
        return self.scale.curve(x, y, dy)


def kinks(problem: Equilibrium, table: Table | None, jumps: bool = True) -> tuple[Array, Array]:
    """Return the x between the ends that stay nodes, and the width of each: see `_apart`.

    There a table has a kink, something jumps, or a station is; where dense tables are averaged their ``table`` says it alone.
    Without ``jumps`` no function is searched for them, which takes long.
    """
    searched = problem.jumps if jumps and table is None else ()
    places = [*problem.breaks, *searched] if table is None else table.breaks[1:-1] * problem.rod.length
    return _apart(places, problem.stations, problem.rod.length)


def _apart(places: Iterable[float], stations: Iterable[float], length: float) -> tuple[Array, Array]:
    """Return places in m over the length, and how far on either side of each lie those too close to be told apart from it.

    Of those that are closer than ``CLOSEST`` it is the middle, but for stations, which are kept.
    """
    fixed = np.array(sorted(s / length for s in stations))
    x = np.unique([s / length for s in places])
    groups = np.split(x, np.flatnonzero(np.diff(x) > CLOSEST) + 1) if len(x) else []
    found = []
    for group in groups:
        near = fixed[(fixed >= group[0] - CLOSEST) & (fixed <= group[-1] + CLOSEST)]
        if len(near) == 0:
            found.append((0.5 * (group[0] + group[-1]), 0.5 * (group[-1] - group[0])))
    found += [(at, 0.0) for at in fixed]
    found.sort()
    return np.array([at for at, _ in found]), np.array([width for _, width in found])


def _unit(a: Array) -> Array:
    length = float(np.linalg.norm(a))
    return a / length if length > 1e-12 else np.array([0.0, 0.0, 1.0])
