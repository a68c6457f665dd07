"""Discrete elastic rods: an energy on a polyline with a material angle per edge, minimised by Newton's method.

Sources: M. Bergou, M. Wardetzky, S. Robinson, B. Audoly and E. Grinspun, Discrete elastic rods, ACM Trans. Graph. 27
(2008) 63; M. Bergou, B. Audoly, E. Vouga, M. Wardetzky and E. Grinspun, Discrete viscous threads, ACM Trans. Graph. 29
(2010) 116. The clamp of half a cell and the multipliers of inextensible rods are our own; see docs/decisions.md.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from darboux import checks, frames
from darboux.checks import assign, description
from darboux.curve import Curve
from darboux.errors import InvalidInput
from darboux.kernels import band, discrete_rod
from darboux.kernels.discrete_rod import Elasticity, Loads, State
from darboux.kernels.rod_equations import BINV, DEAD_FORCE, DEAD_MOMENT, FORCE_GRADIENT, K0, SINV
from darboux.problem import Equilibrium
from darboux.solution import EquilibriumSolution, Status
from darboux.statics import coefficients, load_path
from darboux.statics.coefficients import Scale

Array = NDArray[np.float64]

CLAMPS = ("half_cell", "two_vertices")
PENALTY = 1e6  # EA L^2 / EI of an inextensible rod's edges: a penalty that multipliers make exact
SLACK = 1e3  # and, on the way, of a rod held at both ends, which as a straight one could not leave its place
PATH_TOLERANCE = 1e-6  # of Newton's last change, as a turn in rad, on the way
TOLERANCE = 1e-10  # and at full load
MOST_ITERATIONS = 40
SHORT_STEP = 2e-3  # of the load factor
SHORTEST_LINE = 2.0**-12


@description
class DiscreteRod:
    """Discrete elastic rods of ``segments`` edges, by Newton's method on the exact banded Hessian.

    Order 2 in 1/segments with ``clamp="half_cell"`` (a spring of half a cell ties the first edge to the clamp), order 1
    with ``clamp="two_vertices"`` (the first edge frozen, as in the paper's figure 5). Domain: rods that do not shear;
    stretching by EA, or inextensible by multipliers; dead and position-dependent loads, dead couples and moments (their
    unsymmetric tangent is exact). No follower loads. Counts the unstable directions where the loads are conservative.

    Arguments: ``segments`` N >= 2; ``clamp``; ``grading`` the longest segment over the shortest (1: all equal), which
    shrink smoothly towards the held ends, where boundary layers lie. Raises ``InvalidInput``.
    """

    segments: int = 100
    clamp: str = "half_cell"
    grading: float = 1.0

    def __post_init__(self) -> None:
        grading = checks.positive("discrete_rod.grading", self.grading)
        if not 1.0 <= grading <= 1e4:
            raise InvalidInput(f"discrete_rod.grading is {grading:g}; it must lie between 1 (equal segments) and 1e4.")
        assign(
            self,
            segments=checks.whole("discrete_rod.segments", self.segments, 2),
            clamp=checks.choice("discrete_rod.clamp", self.clamp, CLAMPS),
            grading=grading,
        )

    def __str__(self) -> str:
        extra = "" if self.clamp == "half_cell" else f", {self.clamp!r}"
        extra += "" if self.grading == 1.0 else f", grading={self.grading:g}"
        return f"DiscreteRod({self.segments}{extra})"

    @property
    def order(self) -> int:
        """The order of the error in 1/segments."""
        return 2 if self.clamp == "half_cell" else 1

    def refined(self, factor: int) -> DiscreteRod:
        """Return the method with ``factor`` times the segments."""
        return replace(self, segments=self.segments * factor)

    def refuses(self, problem: Equilibrium) -> str | None:
        """Return why this method can't state the problem, or None."""
        if problem.rod.shear:
            return (
                "DiscreteRod states rods that do not shear, but rod.shear is True; use Shooting(), or set shear=False."
            )
        loads = problem.distributed(np.linspace(0.0, problem.rod.length, 33))
        if np.any(loads.b) or np.any(loads.lb):
            return "DiscreteRod states dead loads, but a load turns with the section (frame='section'); use Shooting()."
        return None

    def solve(self, problem: Equilibrium) -> EquilibriumSolution:
        """Return the equilibrium that follows from the unloaded rod; the status says whether the path got there."""
        refusal = self.refuses(problem)
        if refusal:
            raise InvalidInput(refusal)
        began = time.perf_counter()
        chain = _Chain(problem, self)
        with np.errstate(all="ignore"):  # a step out of the numbers' range is rejected
            path = load_path.follow(chain, chain.unloaded())
            code, message = load_path.ending(path, "DiscreteRod")
            shape = path.state
            if path.load_factor == 1.0:
                chain.came_from = 1.0
                settled = chain.newton(shape, 1.0, TOLERANCE)
                if settled is None:
                    code, message = "no_convergence", "Newton's method did not settle at full load; try fewer segments."
                else:
                    shape = settled[0]
            index = chain.index(shape, path.load_factor)
        if code == "converged" and index:
            message += f" It is unstable: {index} direction(s) lower its energy."
        return EquilibriumSolution(
            problem,
            self,
            problem.rod.model,
            Status(code, message),
            chain.curve(shape, path.load_factor),
            load_factor=path.load_factor,
            index=index,
            elastic_parts=chain.elastic_parts(shape),
            statistics={
                "seconds": time.perf_counter() - began,
                "load_steps": path.steps,
                "rejected_steps": path.rejected,
                "newton_iterations": chain.iterations,
                "crossings": tuple(path.crossings),
            },
        )


@dataclass(frozen=True)
class _Shape:
    """A state of the chain and its multipliers (the edges' tensions at rest length), with the index of its Hessian."""

    state: State
    T: Array
    index: int | None = None


class _Chain:
    """The discrete problem in dimensionless numbers, for `load_path.follow`."""

    def __init__(self, problem: Equilibrium, method: DiscreteRod) -> None:
        self.problem, self.method = problem, method
        self.scale = Scale.of(problem)
        self.iterations = 0
        self.came_from = 0.0  # the load factor of the last equilibrium
        self.held = (problem.start.holds, problem.end.holds)
        self.springs = tuple(held and method.clamp == "half_cell" for held in self.held)
        N = self.edges = method.segments
        self.unknowns = 4 * N + 3
        self.nodes = nodes_along(N, method.grading, *self.held)
        self._discretise()
        self.fixed = self._fixed()
        self.work = np.zeros(discrete_rod.WORK)
        self.gradient, self.lower = np.zeros(self.unknowns), np.zeros(band.LOWER * self.unknowns)
        self.general = np.zeros(band.FULL * self.unknowns) if np.any(self.couples) else None

    # -- from the rod to the chain -------------------------------------------------------------------------------

    def _discretise(self) -> None:
        """Average compliance, natural shape and loads over the cells of the vertices and over the edges."""
        x = self.nodes
        middle = 0.5 * (x[:-1] + x[1:])
        cells = np.concatenate([[0.0], middle, [1.0]])
        at_vertices = _means(lambda s: coefficients.columns(self.problem, self.scale, s), cells)
        on_edges = _means(lambda s: coefficients.columns(self.problem, self.scale, s), x)
        self.l, self.V = np.diff(x), np.diff(cells)
        B = np.linalg.inv(_symmetric(at_vertices[:, BINV : BINV + 6])) / self.V[:, None, None]
        self.stiffness = _six(B).ravel()
        self.kappa0 = (at_vertices[:, K0 : K0 + 3] * self.V[:, None]).ravel()
        stretch = on_edges[:, SINV + 2]
        self.lent = not self.problem.rod.stretch and all(self.held)
        self.inextensible = not self.problem.rod.stretch and not self.lent
        self.EA = 1.0 / stretch if self.problem.rod.stretch else np.full(self.edges, PENALTY)
        force, gradient = DEAD_FORCE, FORCE_GRADIENT
        self.f = at_vertices[:, force : force + 3] * self.V[:, None]
        self.C = _six(at_vertices[:, gradient : gradient + 9].reshape(-1, 3, 3)) * self.V[:, None]
        moment = DEAD_MOMENT
        self.couples = on_edges[:, moment : moment + 3] * self.l[:, None]
        for at, i in (("start", 0), ("end", -1)):
            load = self.problem.end_load(at)
            self.f[i] += load.force / self.scale.force
            self.couples[i] += load.moment / self.scale.moment

    def _fixed(self) -> NDArray[np.bool_]:
        fixed = np.zeros(self.unknowns, dtype=bool)
        frozen_edge = self.method.clamp == "two_vertices"
        if self.held[0]:
            fixed[: 7 if frozen_edge else 3] = True
        if self.held[1]:
            fixed[-7 if frozen_edge else -3 :] = True
        return fixed

    def _elasticity(self, T: Array) -> Elasticity:
        first = 0 if self.springs[0] else 1
        stop = self.edges + 1 if self.springs[1] else self.edges
        return Elasticity(self.stiffness, self.kappa0, self.l, self.EA, T, first, stop)

    def _loads(self, load_factor: float) -> Loads:
        return Loads((load_factor * self.f).ravel(), (load_factor * self.C).ravel())

    # -- the unloaded rod ----------------------------------------------------------------------------------------

    def unloaded(self) -> _Shape:
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
        return _Shape(state, np.zeros(N))

    # -- moving --------------------------------------------------------------------------------------------------

    def _moved(self, shape: _Shape, step: Array, scale: float) -> _Shape:
        """Return the shape after a step; edges turn rather than shear, and multipliers take up an inextensible rod's."""
        x, t, _, _ = shape.state
        turned = np.empty_like(step)
        discrete_rod.turning_step(x, self.l, step, scale, self.inextensible, *self.held, turned)
        new = _advanced(shape.state, turned)
        T = shape.T
        if self.inextensible:
            moves = np.diff(np.append(step, 0.0).reshape(-1, 4)[:, :3], axis=0)
            strain = scale * np.einsum("ni,ni->n", t[3:-3].reshape(-1, 3), moves) / self.l
            T = T + self.EA * (self._stretch(shape) + strain)
        return replace(shape, state=new, T=T)

    def _settled(self, shape: _Shape) -> None:
        """Keep the twists of an accepted state, so that whole turns are not lost."""
        first, stop = self._elasticity(shape.T)[-2:]
        discrete_rod.strains(shape.state, first, stop, np.empty(3 * (self.edges + 1)))

    def _posed(self, shape: _Shape, load_factor: float) -> _Shape:
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
        if self.method.clamp == "two_vertices":
            step[-7:-4] = end - self.l[-1] * R[:, 2] - shape.state.x[-6:-3]
        posed = _advanced(shape.state, step)
        clamped = slice(-6, None) if self.method.clamp == "two_vertices" else slice(-3, None)
        posed.t[clamped], posed.d1[clamped] = (
            np.resize(R[:, 2], posed.t[clamped].size),
            np.resize(R[:, 0], posed.d1[clamped].size),
        )
        return replace(shape, state=posed)

    # -- Newton's method -----------------------------------------------------------------------------------------

    def _assemble(self, shape: _Shape, load_factor: float) -> float:
        """Fill gradient and band (and the general band where couples act), fixed unknowns held; return the energy."""
        rod, loads = self._elasticity(shape.T), self._loads(load_factor)
        energy: float = discrete_rod.energy_gradient_hessian(
            shape.state, rod, loads, self.work, self.gradient, self.lower
        )
        if self.general is not None:
            band.expand(self.lower, self.unknowns, self.general)
            couples = (load_factor * self.couples).ravel()
            discrete_rod.add_couples(shape.state, couples, self.gradient, self.general)
        return energy

    def _hold(self) -> None:
        if self.general is not None:
            band.fix_general(self.general, self.gradient, self.fixed)
        band.fix(self.lower, self.gradient, self.fixed)

    def _factor(self) -> tuple[int, Any]:
        """Return the number of negative pivots (-1: singular) and the factors."""
        if self.general is None:
            return band.factor(self.lower, self.unknowns), None
        n, reach = self.unknowns, band.REACH
        matrix = np.zeros((3 * reach + 1, n))
        matrix[reach:] = self.general.reshape(n, band.FULL).T
        factors, pivots, info = lapack.dgbtrf(matrix, reach, reach)
        swaps = np.count_nonzero(pivots != np.arange(n))
        negative = int(np.count_nonzero(factors[2 * reach] < 0.0) + swaps) % 2
        return (-1 if info != 0 else negative), (factors, pivots)

    def _solve(self, factors: Any, right: Array) -> Array:
        if factors is None:
            band.solve(self.lower, self.unknowns, right)
            return right
        x, _ = lapack.dgbtrs(factors[0], band.REACH, band.REACH, right, factors[1])
        return np.asarray(x)

    def newton(self, shape: _Shape, load_factor: float, tolerance: float) -> tuple[_Shape, float, int] | None:
        """Return the equilibrium near a shape, the largest turn on the way and the iterations; None where it is not near.

        In a basin of the energy the search stays there, and a branch that is stable may lose that only within a short
        step, so that it is followed past a buckling load but never left for another. Past it, or under couples, which
        have no energy, Newton's changes must contract.
        """
        if self.general is None and not shape.index:
            found = self._descend(shape, load_factor, tolerance, True)
            if found is not None or load_factor - self.came_from > SHORT_STEP:
                return found
        return self._descend(shape, load_factor, tolerance, False)

    def _descend(
        self, shape: _Shape, load_factor: float, tolerance: float, stable: bool
    ) -> tuple[_Shape, float, int] | None:
        """Newton's method: downhill with a positive definite Hessian all the way where ``stable``, else undamped."""
        turned, last, parts = 0.0, np.inf, np.empty(4)
        for iteration in range(1, MOST_ITERATIONS + 1):
            self.iterations += 1
            energy = self._assemble(shape, load_factor)
            self._hold()
            slope = self.gradient.copy()
            index, factors = self._factor()
            if index < 0 or not np.isfinite(energy) or (stable and index > 0):
                return None
            step = self._solve(factors, -slope)
            size = self._turn(step)
            if not np.isfinite(size):
                return None
            scale = 1.0
            if stable and size > 1e-7:
                rod, loads = self._elasticity(shape.T), self._loads(load_factor)
                descent = float(slope @ step)
                while True:
                    trial = self._moved(shape, step, scale)
                    lowered = discrete_rod.energy(trial.state, rod, loads, parts)
                    if lowered <= energy + 1e-4 * scale * descent + 1e-13 * abs(energy):
                        break
                    scale *= 0.5
                    if scale < SHORTEST_LINE:
                        return None
            elif not stable and size > max(0.5 * last, 1e-7):
                return None
            shape = self._moved(shape, step, scale)
            self._settled(shape)
            turned += scale * size
            if turned > 4.0 * load_path.LARGEST_CORRECTED_TURN:
                return None
            if scale == 1.0 and size <= tolerance:
                return replace(shape, index=index), turned, iteration
            last = size
        return None

    def _stretch(self, shape: _Shape) -> Array:
        edges = np.diff(shape.state.x.reshape(-1, 3), axis=0)
        return np.asarray(np.linalg.norm(edges, axis=1) / self.l - 1.0)

    def _turn(self, step: Array) -> float:
        """Return the largest turn of an edge in a packed step, or its largest displacement."""
        moves = np.concatenate([step, [0.0]]).reshape(-1, 4)
        across = np.linalg.norm(np.diff(moves[:, :3], axis=0), axis=1) / self.l
        return float(max(np.max(across), np.max(np.abs(moves[:-1, 3])), np.max(np.abs(moves[:, :3]))))

    def index(self, shape: _Shape, load_factor: float) -> int | None:
        """Return the number of negative eigenvalues of the Hessian; None under couples, which have no energy."""
        if self.general is not None:
            return None
        self._assemble(shape, load_factor)
        self._hold()
        return max(band.factor(self.lower, self.unknowns), 0)

    # -- for load_path.follow ------------------------------------------------------------------------------------

    def sign(self, shape: _Shape, load_factor: float) -> float:
        self._assemble(shape, load_factor)
        self._hold()
        return _sign(self._factor()[0])

    def tangent(self, shape: _Shape, load_factor: float) -> tuple[Array, float]:
        """Solve H dx/d(load factor) = -dg/d(load factor), the right side by a difference."""
        step = 1e-6
        self.came_from = load_factor
        self._lend(shape, load_factor)
        there = self._posed(shape, load_factor + step)
        self._assemble(there, load_factor + step)
        ahead = self.gradient.copy()
        self._assemble(shape, load_factor)
        change = (ahead - self.gradient) / step
        self._hold()
        index, factors = self._factor()
        change[self.fixed] = 0.0
        if index < 0:
            return change, np.inf
        tangent = self._solve(factors, -change)
        moved = np.zeros((self.edges + 1, 4))
        moved[:, :3] = (there.state.x - shape.state.x).reshape(-1, 3) / step
        tangent[self.fixed] = moved.ravel()[:-1][self.fixed]  # a far clamp that moves takes its vertices along
        return tangent, self._turn(tangent)

    def predict(self, shape: _Shape, tangent: Array, step: float) -> _Shape:
        return self._moved(shape, tangent, step)

    def _lend(self, shape: _Shape, load_factor: float) -> _Shape:
        """Let an inextensible rod held at both ends stretch on the way, less and less; what pulls then becomes its T."""
        if not self.lent:
            return shape
        self.inextensible = load_factor == 1.0
        if self.inextensible:
            shape = self._moved(shape, np.zeros(self.unknowns), 0.0)
        self.EA[:] = min(SLACK / max(1.0 - load_factor, 1e-12), PENALTY)
        return shape

    def correct(self, shape: _Shape, load_factor: float) -> load_path.Corrected[_Shape] | None:
        shape = self._posed(self._lend(shape, load_factor), load_factor)
        found = self.newton(shape, load_factor, PATH_TOLERANCE)
        if found is None:
            return None
        settled, turn, iterations = found
        return load_path.Corrected(settled, turn, _sign(settled.index or 0), iterations)

    # -- the answer ----------------------------------------------------------------------------------------------

    def curve(self, shape: _Shape, load_factor: float) -> Curve:
        """Return positions, frames, forces and moments at the vertices, in SI units."""
        N = self.edges
        x = shape.state.x.reshape(-1, 3)
        t, d1 = (part.reshape(-1, 3) for part in shape.state[1:3])
        R = np.stack([d1, np.cross(t, d1), t], axis=-1)
        n_edges, n_vertices = self._forces(shape, load_factor)
        m = self._moments(shape, R, n_edges, load_factor)
        compliance = _symmetric(coefficients.columns(self.problem, self.scale, self.nodes)[:, :6])
        k0 = coefficients.columns(self.problem, self.scale, self.nodes)[:, K0 : K0 + 3]
        q = frames.same_sign(frames.quaternion_of_matrix(R))
        middle = q[:-1] + q[1:]  # between two edges of equal length: half the turn from one to the next
        weight = np.concatenate([[0.5], self.l[1:] / (self.l[:-1] + self.l[1:]), [0.5]])[:, None]
        middle = 2.0 * (weight * q[:-1] + (1.0 - weight) * q[1:])
        for vertex, edge, clamp, sign in ((0, 1, 0, -1.0), (N, N, N + 1, 1.0)):
            if self.held[0 if vertex == 0 else 1]:
                middle[vertex] = q[clamp]
            else:  # a free end: half a segment of the end's curvature beyond the last edge's middle
                k = k0[vertex] + compliance[vertex] @ (R[edge].T @ m[vertex])
                middle[vertex] = frames.product(q[edge], np.concatenate([[1.0], sign * 0.25 * self.l[edge - 1] * k]))
        q = frames.same_sign(middle / np.linalg.norm(middle, axis=1, keepdims=True))
        y = np.concatenate([x, q, n_vertices, m], axis=1)
        c = coefficients.columns(self.problem, self.scale, self.nodes)
        c[:, coefficients.LOADS] *= load_factor
        return self.scale.curve(self.nodes, y, coefficients.slopes(c, y))

    def elastic_parts(self, shape: _Shape) -> tuple[float, float, float]:
        """Return the energies of bending, twist and stretch in J, as the springs and edges have them."""
        parts = np.empty(4)
        discrete_rod.energy(shape.state, self._elasticity(shape.T), self._loads(0.0), parts)
        bending, twist, stretch = (float(part) * self.scale.moment for part in parts[:3])
        return bending, twist, 0.0 if self.inextensible else stretch

    def _forces(self, shape: _Shape, load_factor: float) -> tuple[Array, Array]:
        """Return the inner force in each edge, by balance from the start on, and at each vertex."""
        x = shape.state.x.reshape(-1, 3)
        applied = load_factor * (self.f + np.einsum("nij,nj->ni", _symmetric(self.C), x))
        self._assemble(shape, load_factor)
        residual = np.concatenate([self.gradient, [0.0]]).reshape(-1, 4)[:, :3]
        reaction = np.where(np.concatenate([self.fixed, [True]]).reshape(-1, 4)[:, :3], residual, 0.0)
        if self.held[0] and self.method.clamp == "two_vertices":  # the frozen edge is part of the clamp
            reaction[0] += reaction[1]
            reaction[1] = 0.0
        total = np.cumsum(applied + reaction, axis=0)
        edges = -total[:-1]
        vertices = np.empty_like(x)
        weight = (self.l[1:] / (self.l[:-1] + self.l[1:]))[:, None]
        vertices[1:-1] = weight * edges[:-1] + (1.0 - weight) * edges[1:]
        start, end = (load_factor * self.problem.end_load(at).force / self.scale.force for at in ("start", "end"))
        vertices[0] = edges[0] + applied[0] - start if self.held[0] else -start
        vertices[-1] = edges[-1] - applied[-1] + end if self.held[1] else end
        return edges, vertices

    def _moments(self, shape: _Shape, R: Array, n: Array, load_factor: float) -> Array:
        """Return the moment that each spring transmits, fixed frame; where there is none, by balance over the edge.

        m_i = sum_j mu_j tau_j,   tau_1 = (b2 x a - b x a2 + kappa1 a x b) / chi,
        tau_2 = (b x a1 - b1 x a + kappa2 a x b) / chi,   tau_3 = (a + b) / chi,   mu = B (kappa - kappa0) / V
        """
        rod = self._elasticity(shape.T)
        kappa = np.empty(3 * (self.edges + 1))
        discrete_rod.strains(shape.state, rod.first, rod.stop, kappa)
        strain = kappa.reshape(-1, 3)
        mu = np.einsum("nij,nj->ni", _symmetric(self.stiffness.reshape(-1, 6)), strain - self.kappa0.reshape(-1, 3))
        a1, a2, a = (R[:-1, :, i] for i in range(3))
        b1, b2, b = (R[1:, :, i] for i in range(3))
        chi = 1.0 + np.sum(a * b, axis=1, keepdims=True)
        ab = np.cross(a, b)
        tau1 = np.cross(b2, a) - np.cross(b, a2) + strain[:, :1] * ab
        tau2 = np.cross(b, a1) - np.cross(b1, a) + strain[:, 1:2] * ab
        m: Array = (mu[:, :1] * tau1 + mu[:, 1:2] * tau2 + mu[:, 2:] * (a + b)) / chi
        edges = np.diff(shape.state.x.reshape(-1, 3), axis=0)
        lever = np.cross(edges, n)
        start, end = (load_factor * self.problem.end_load(at).moment / self.scale.moment for at in ("start", "end"))
        if not self.springs[0]:
            m[0] = m[1] + lever[0] if self.held[0] else -start
        if not self.springs[1]:
            m[-1] = m[-2] - lever[-1] if self.held[1] else end
        return m


def _advanced(state: State, step: Array) -> State:
    """Return the state after a packed step; the twists stay those of before, to count whole turns by."""
    new = State(np.empty_like(state.x), np.empty_like(state.t), np.empty_like(state.d1), state.m.copy())
    discrete_rod.advance(state, step, 1.0, new)
    return new


def _sign(negative: int) -> float:
    """Return the sign of the determinant from the number of negative pivots; 0 where it is singular."""
    return 0.0 if negative < 0 else float((-1) ** negative)


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


def _means(function: Any, nodes: Array) -> Array:
    """Return the mean of a function (n,) -> (n, k) on each interval, by Gauss' rule of two points."""
    middle, half = 0.5 * (nodes[:-1] + nodes[1:]), 0.5 * np.diff(nodes)
    offset = half / np.sqrt(3.0)
    return np.asarray(0.5 * (function(middle - offset) + function(middle + offset)))


def _symmetric(six: Array) -> Array:
    """Return (n, 3, 3) from the six numbers 11, 22, 33, 23, 13, 12."""
    return six[:, [0, 5, 4, 5, 1, 3, 4, 3, 2]].reshape(-1, 3, 3)


def _six(matrix: Array) -> Array:
    return np.stack([matrix[:, i, j] for i, j in coefficients.PAIRS], axis=1)
