"""Shooting: boundary value problems by initial value problems, in pieces.

Sources: J. R. Dormand and P. J. Prince, J. Comp. Appl. Math. 6 (1980) 19; U. M. Ascher, R. M. M. Mattheij and
R. D. Russell, Numerical Solution of Boundary Value Problems (SIAM, 1995), ch. 4 (why one long shot fails: over the
paper's figure 5 it amplifies an error 1.5e7 times).
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from darboux import checks, frames
from darboux.checks import assign, description
from darboux.curve import Curve
from darboux.errors import InvalidInput
from darboux.kernels import dormand_prince
from darboux.kernels.rod_equations import FORCE, MOMENT, POSITION, ROTATION, SINV, STATES
from darboux.kernels.stability import COMPLIANCE
from darboux.packing.ends import EndConditions
from darboux.packing.problem import Packing
from darboux.problem import Equilibrium
from darboux.solution import EquilibriumSolution, ErrorEstimate, Status
from darboux.statics import limits, load_path, stability
from darboux.statics.mesh import size, units
from darboux.statics.steps import MOST_STEPS, Data, accepted_steps, joined

Array = NDArray[np.float64]

FIRST_PIECES = 16
MOST_PIECES = 800
LARGEST_GROWTH = 20.0  # of an error over one piece; a piece that exceeds it is halved
PATH_RTOL = 1e-6  # on the way the branch must be kept, not measured
FINER = 30.0  # how much more sharply the answer is solved once more, for its error
SLACK = 1e-3  # compliance of stretch lent on the way to a rod held at both ends that has less, as in Collocation
LARGEST_LOAD = 3e8  # dimensionless
FLATTEST = 0.05  # stretch below which a rod counts as compressed to nothing
ROUNDING_STRAIN = 1e-14
LOWER, UPPER = 19, 18  # bandwidths of the Newton matrix, see `_Pieces.shoot`
_R, _Q, _N, _M = slice(POSITION, ROTATION), slice(ROTATION, FORCE), slice(FORCE, MOMENT), slice(MOMENT, STATES)


@description
class Shooting:
    """Multiple shooting for the two-point boundary value problem, in 13 states per node.

    Each piece is integrated by Dormand-Prince 5(4) together with its sensitivities; Newton's method closes the gaps
    between the pieces and meets the end conditions (an almost block diagonal system, solved as a band). The branch that
    starts at the unloaded rod is followed. Error: that of the integration; the equations are solved at ``rtol`` and once
    more at a thirtieth of it, which is the answer, and the difference is the estimated error. Domain: any single rod
    with clamped and free ends; smooth or piecewise smooth data.

    Arguments: ``rtol`` relative error per integration step, 1e-12 to 1e-3; ``pieces`` how many pieces to begin with
    (more are added where a piece amplifies errors).
    """

    rtol: float = 1e-10
    pieces: int = FIRST_PIECES

    def __post_init__(self) -> None:
        rtol = checks.positive("shooting.rtol", self.rtol)
        if not 1e-12 <= rtol <= 1e-3:
            raise InvalidInput(f"shooting.rtol is {rtol:g}; it must lie between 1e-12 and 1e-3.")
        assign(self, rtol=rtol, pieces=checks.whole("shooting.pieces", self.pieces, 1, MOST_PIECES))

    def __str__(self) -> str:
        return "Shooting()" if self.rtol == 1e-10 else f"Shooting(rtol={self.rtol:g})"

    def refuses(self, problem: Equilibrium) -> str | None:
        """Return why this method can't state the problem, or None."""
        return (
            limits.beyond(problem, "Shooting")
            or limits.coupled(problem, "Shooting", bending_with_twist=True)
            or limits.too_large(problem, "Shooting", LARGEST_LOAD)
        )

    def solve(self, problem: Equilibrium) -> EquilibriumSolution:
        """Return the equilibrium that follows from the unloaded rod; the status says whether the path got there."""
        began = time.perf_counter()
        pieces, straight = _Pieces(problem, self.pieces), limits.straight(problem)
        with np.errstate(all="ignore"):  # a Newton step that leaves the numbers' range is rejected by the path
            path = load_path.Path(pieces.unloaded(), 0.0) if straight else load_path.follow(pieces, pieces.unloaded())
            while (
                path.load_factor == 0.0 and not straight and len(pieces.first) < FIRST_PIECES
            ):  # a piece that is too long breaks down
                pieces = _Pieces(problem, 2 * (len(pieces.first) - 1))
                path = load_path.follow(pieces, pieces.unloaded())
            error = None
            nodes, converged = path.state, path.load_factor == 1.0
            if converged:
                coarse = pieces.polish(nodes, self.rtol)
                fine = None if coarse is None else pieces.polish(coarse, self.rtol / FINER)
                converged = fine is not None
                if coarse is not None and fine is not None:
                    error = float(np.max(np.linalg.norm(fine.y[:, :3] - coarse.y[:, :3], axis=1))) + pieces.table.error
                    error *= problem.rod.length
                    nodes = fine
        code, message = load_path.ending(path, "Shooting")
        if path.load_factor < 1.0 and pieces.flattest(nodes) < FLATTEST:
            code, message = "no_convergence", load_path.flattened(path)
        if path.load_factor < 1.0 and len(nodes.x) > MOST_PIECES:
            code, message = (
                "no_convergence",
                (
                    f"at {100.0 * path.load_factor:.3g} % of the load errors grow so fast along the rod that it needs more than "
                    f"{MOST_PIECES} pieces; use DiscreteRod with 400 segments and grading 100, or Elastica in the plane."
                ),
            )
        if pieces.slack and not problem.rod.stretch and 0.99 < path.load_factor < 1.0:
            code, message = (
                "no_convergence",
                (
                    "the rod, held at both ends and inextensible, stays straight on the way, and its inner force grows without "
                    "bound. Give it a side to bend to by a small load, or set rod.stretch."
                ),
            )
        if straight:
            code, message = "no_convergence", straight
        if path.load_factor == 1.0 and not converged:
            code, message = (
                "no_convergence",
                (
                    f"Newton's method did not settle at rtol = {self.rtol:g}, but at rtol = {PATH_RTOL:g}. "
                    "Ask for a larger rtol."
                ),
            )
        curve = pieces.curve(nodes, path.load_factor, self.rtol / FINER)
        return EquilibriumSolution(
            problem,
            self,
            problem.rod.model,
            Status(code, message),
            curve,
            load_factor=path.load_factor,
            index=path.index,
            error=ErrorEstimate(error),
            elastic_parts=pieces.packing.elastic_parts(curve),
            statistics={
                "seconds": time.perf_counter() - began,
                "pieces": len(nodes.x) - 1,
                "load_steps": path.steps,
                "rejected_steps": path.rejected,
                "newton_iterations": path.iterations,
                "crossings": tuple(path.crossings),
            },
        )


@dataclass(frozen=True)
class _Nodes:
    """The states y (m + 1, 13) at the nodes x (m + 1,) between the pieces, dimensionless."""

    x: Array
    y: Array


@dataclass(frozen=True)
class _Shot:
    """What one pass over the pieces gives: the residual, the factored Newton matrix, and the sensitivities P_i in it."""

    residual: Array
    factors: Array
    pivots: NDArray[np.int32]
    P: Array

    def solve(self, right: Array) -> Array:
        x, _ = lapack.dgbtrs(self.factors, LOWER, UPPER, right, self.pivots)
        return np.asarray(x)

    @property
    def sign(self) -> float:
        """The sign of det [A_0; A_m P_m-1 ... P_0], whatever the number of pieces: each -1 block of 13 rows turns it."""
        diagonal = self.factors[LOWER + UPPER]
        swaps = np.count_nonzero(self.pivots != np.arange(len(self.pivots)))
        return float((-1) ** (swaps + np.count_nonzero(diagonal < 0.0) + len(self.P)))


class _Pieces:
    """The boundary value problem as equations between nodes, for `load_path.follow`."""

    def __init__(self, problem: Equilibrium, pieces: int) -> None:
        self.problem = problem
        self.packing = Packing(problem)
        self.scale, self.table = self.packing.scale, self.packing.table
        self.start, self.end = self.packing.ends
        self.first = np.linspace(0.0, 1.0, pieces + 1)
        self.slack = self.packing.lent(SLACK)
        self.law = self.table.law(self.slack, None)
        self.has_potential = self.packing.has_potential
        softest = float(np.max(np.abs(self.table.coefficients[:, 0, SINV : SINV + 3])))
        self.rounding = ROUNDING_STRAIN / softest if softest > 0.0 else 0.0  # of n: what a rounded place makes of EA

    # -- the unloaded rod ----------------------------------------------------------------------------------------

    def unloaded(self) -> _Nodes:
        """Return the natural shape, laid against the support that holds it."""
        held, place = (self.start, 0) if self.start.holds else (self.end, -1)
        y0 = np.zeros(STATES)
        y0[ROTATION] = 1.0
        y = np.empty((len(self.first), STATES))
        data = self._data(0.0)
        code, *_ = dormand_prince.integrate(y0, self.first, *data, 1e-12, 1e-14, MOST_STEPS, y.ravel())
        if code != 0:
            raise InvalidInput("rod.natural winds so often that its shape can't be integrated; check its unit, 1/m.")
        R = frames.matrix_of_quaternion(y[:, ROTATION:FORCE])
        turn = held.frame @ R[place].T
        y[:, ROTATION:FORCE] = frames.same_sign(frames.quaternion_of_matrix(turn @ R))
        y[:, :3] = (y[:, :3] - y[place, :3]) @ turn.T
        if self.start.holds and self.end.holds:
            self.end.grow_from(y[-1])
        return _Nodes(self.first, y)

    def _data(self, load_factor: float, compliance: float = 0.0) -> Data:
        """Return the coefficients at a load factor, where an inextensible rod has the ``compliance`` of stretch at least."""
        base, rate = self.law
        c, lent = base + load_factor * rate, self.slack * (1.0 - load_factor)
        if not self.problem.rod.stretch:
            c[:, 0, SINV + 2] += max(compliance - lent, 0.0)
        return self.table.breaks, c.ravel(), self.table.degree

    # -- the end conditions, as conjugate pairs ------------------------------------------------------------------

    def _end_rows(self, at: EndConditions, y: Array, load_factor: float) -> tuple[Array, Array]:
        """Return six conditions on the state at an end, and their derivative (6, 13): displacement or force, turn or moment."""
        position, q = at.pose(load_factor)
        here, factor = y[ROTATION:FORCE], load_factor * at.outward
        R = frames.matrix_of_quaternion(here)
        force, moment = factor * at.load.force, factor * at.load.moment_at(R)
        by_q = factor * at.load.moment_by_turn(R) @ _turn_matrix(here) / (here @ here)
        turn = _turn_matrix(q)
        turn = turn if float(q @ here) >= 0.0 else -turn
        rows, values = np.zeros((6, STATES)), np.empty(6)
        for i in range(3):
            if at.held_places[i]:
                rows[i, POSITION + i], values[i] = 1.0, y[POSITION + i] - position[i]
            else:
                rows[i, FORCE + i], values[i] = 1.0, y[FORCE + i] - force[i]
            if at.held_turns[i]:
                rows[3 + i, ROTATION:FORCE], values[3 + i] = turn[i], turn[i] @ here
            else:
                rows[3 + i, MOMENT + i], values[3 + i] = 1.0, y[MOMENT + i] - moment[i]
                rows[3 + i, ROTATION:FORCE] = -by_q[i]
        return values, rows

    # -- Newton's equations --------------------------------------------------------------------------------------

    def shoot(self, nodes: _Nodes, load_factor: float, rtol: float) -> _Shot | None:
        """Integrate every piece with its sensitivities and factor Newton's matrix; None where a piece breaks down.

        Unknowns: the states y_0 ... y_m. Rows, with Y_i(y_i) the state that piece i reaches and P_i = dY_i/dy_i:

            y_0            y_1    ...     y_m
            [A_0                             ]   six conditions at the start and |q|^2 = 1
            [P_0            -1               ]   Y_0(y_0) - y_1 = 0
            [                P_1   -1        ]   ...
            [                         A_m    ]   six conditions at the end
        """
        pieces = len(nodes.x) - 1
        reached, P = np.empty((pieces, STATES)), np.empty((pieces, STATES, STATES))
        data = self._data(load_factor)
        for i in range(pieces):
            ends = (nodes.y[i], nodes.x[i], nodes.x[i + 1])
            code, *_ = dormand_prince.integrate_sensitivity(
                *ends, *data, rtol, 1e-2 * rtol, MOST_STEPS, reached[i], P[i].ravel()
            )
            if code != 0:
                return None
        start, A0 = self._end_rows(self.start, nodes.y[0], load_factor)
        end, Am = self._end_rows(self.end, nodes.y[-1], load_factor)
        q = nodes.y[0, ROTATION:FORCE]
        norm = np.zeros((1, STATES))
        norm[0, ROTATION:FORCE] = 2.0 * q
        residual = np.concatenate([start, [q @ q - 1.0], (reached - nodes.y[1:]).ravel(), end])
        band = _band(np.vstack([A0, norm]), P, Am)
        if not (np.all(np.isfinite(residual)) and np.all(np.isfinite(band))):
            return None
        factors, pivots, _ = lapack.dgbtrf(band, LOWER, UPPER)
        return _Shot(residual, factors, pivots, P)

    def newton(
        self, nodes: _Nodes, load_factor: float, rtol: float, most: int
    ) -> tuple[_Nodes, _Shot, float, int] | None:
        """Return nodes, last pass, the largest turn and the iterations of Newton's method; None unless it contracts."""
        turn, last = 0.0, np.inf
        y = nodes.y
        floor = self.rounding / (1.0 + float(np.max(np.linalg.norm(y[:, _N], axis=1))))
        for iteration in range(1, most + 1):
            shot = self.shoot(_Nodes(nodes.x, y), load_factor, rtol)
            if shot is None:
                return None
            change = -shot.solve(shot.residual).reshape(y.shape)
            length = size(change, y)
            if not np.isfinite(length) or length > max(0.5 * last, 10.0 * rtol, floor):
                return None
            y = y + change
            turn += float(2.0 * np.max(np.linalg.norm(change[:, ROTATION:FORCE], axis=1)))
            if length <= max(rtol, floor):
                found = _Nodes(nodes.x, y)
                return None if self.flattest(found) <= 0.0 else (found, shot, turn, iteration)
            last = length
        return None

    def flattest(self, nodes: _Nodes) -> float:
        """Return the least stretch v3 = 1 + (S^-1 R^T n)_3 at the nodes."""
        if not self.problem.rod.stretch:
            return 1.0
        return self.table.least_stretch(nodes.x, nodes.y)

    # -- for load_path.follow ------------------------------------------------------------------------------------

    def stability(self, state: _Nodes, load_factor: float) -> tuple[float, int | None]:
        shot = self.shoot(state, load_factor, PATH_RTOL)
        return 0.0 if shot is None else shot.sign, self.index(state, load_factor)

    def index(self, state: _Nodes, load_factor: float) -> int | None:
        """Return the number of unstable directions; None where the loads have no potential."""
        if not self.has_potential:
            return None
        force = float(np.max(np.linalg.norm(state.y[:, _N], axis=1)))
        data = self._data(load_factor, COMPLIANCE / (1.0 + force))
        transfer = np.empty((len(state.x) - 1, STATES, STATES))
        reached = np.empty(STATES)
        for i in range(len(transfer)):
            ends = (state.y[i], state.x[i], state.x[i + 1])
            code, *_ = dormand_prince.integrate_sensitivity(
                *ends, *data, PATH_RTOL, 1e-2 * PATH_RTOL, MOST_STEPS, reached, transfer[i].ravel()
            )
            if code != 0:
                return None
        held = {i: at.held(state.y[i], load_factor) for i, at in ((0, self.start), (len(transfer), self.end))}
        moments = state.y[:-1, MOMENT:], state.y[1:, MOMENT:]
        return stability.second_variation(_by_turns(transfer, state.y), state.x, moments, held, force).index

    def tangent(self, state: _Nodes, load_factor: float) -> tuple[Array, float]:
        """Solve J dy/d(load factor) = -dF/d(load factor), the right side by a difference of two passes."""
        step = 1e-6
        here = self.shoot(state, load_factor, PATH_RTOL)
        there = self.shoot(state, load_factor + step, PATH_RTOL)
        if here is None or there is None:
            return np.zeros_like(state.y), np.inf
        change = -here.solve((there.residual - here.residual) / step).reshape(state.y.shape)
        return change, float(2.0 * np.max(np.linalg.norm(change[:, ROTATION:FORCE], axis=1)))

    def predict(self, state: _Nodes, tangent: Array, step: float) -> _Nodes:
        return _Nodes(state.x, state.y + step * tangent)

    def correct(self, state: _Nodes, load_factor: float) -> load_path.Corrected[_Nodes] | None:
        found = self.newton(state, load_factor, PATH_RTOL, most=8)
        if found is None:
            return None
        nodes, shot, turn, iterations = found
        refined = self._refined(nodes, shot.P, load_factor)
        return load_path.Corrected(refined, turn, shot.sign, iterations, self.index(refined, load_factor))

    def _refined(self, nodes: _Nodes, P: Array, load_factor: float) -> _Nodes:
        """Halve the pieces that amplify an error too much."""
        unit = units(nodes.y)
        growth = np.linalg.norm(P * unit / unit[:, None], ord=2, axis=(1, 2))
        steep = np.flatnonzero(growth > LARGEST_GROWTH)
        if len(steep) == 0 or len(nodes.x) > MOST_PIECES:
            return nodes
        middle = 0.5 * (nodes.x[steep] + nodes.x[steep + 1])
        states = np.empty((len(steep), 2, STATES))
        for j, i in enumerate(steep):
            ends = np.array([nodes.x[i], middle[j]])
            dormand_prince.integrate(
                nodes.y[i], ends, *self._data(load_factor), PATH_RTOL, 1e-2 * PATH_RTOL, MOST_STEPS, states[j].ravel()
            )
        return _Nodes(np.insert(nodes.x, steep + 1, middle), np.insert(nodes.y, steep + 1, states[:, 1], axis=0))

    def polish(self, nodes: _Nodes, rtol: float) -> _Nodes | None:
        """Return the nodes at full load to the given tolerance."""
        found = self.newton(nodes, 1.0, rtol, most=12)
        return None if found is None else found[0]

    # -- the answer ----------------------------------------------------------------------------------------------

    def curve(self, nodes: _Nodes, load_factor: float, rtol: float) -> Curve:
        """Return every accepted step of a last integration of the pieces, in SI units."""
        data = self._data(load_factor)
        parts = [
            accepted_steps(nodes.y[i], nodes.x[i], nodes.x[i + 1], data, rtol)[:3] for i in range(len(nodes.x) - 1)
        ]
        x, y, dy = (np.concatenate(part) for part in zip(*parts, strict=True))
        knots = self.table.breaks if self.problem.dense else self.packing.breaks
        return self.scale.curve(*joined(x, y, dy, knots))


def _by_turns(P: Array, y: Array) -> Array:
    """Return the sensitivities (m, 13, 13) between nodes in the 12 numbers dr, theta, dn, dm: dq = 1/2 (0, theta) q."""
    change = np.zeros((len(y), STATES, 12))
    turn = np.zeros((len(y), 12, STATES))
    T = np.array([_turn_matrix(q / np.linalg.norm(q)) for q in y[:, _Q]])
    for here, there in ((_R, slice(0, 3)), (_N, slice(6, 9)), (_M, slice(9, 12))):
        change[:, here, there] = turn[:, there, here] = np.eye(3)
    turn[:, 3:6, _Q] = T
    change[:, _Q, 3:6] = 0.25 * T.transpose(0, 2, 1)
    return np.asarray(turn[1:] @ P @ change[:-1])


def _turn_matrix(q: Array) -> Array:
    """Return T (3, 4) with T y = 2 vec(y q*): the small turn, fixed frame, from the quaternion q to y."""
    w, x, y, z = q
    return 2.0 * np.array([[-x, w, -z, y], [-y, z, w, -x], [-z, -y, x, w]])


def _band(A0: Array, P: Array, Am: Array) -> Array:
    """Return Newton's matrix in LAPACK's band form, with room for the factors above: (2 LOWER + UPPER + 1, 13 (m + 1))."""
    row, column = _places(len(P))
    minus_one = np.broadcast_to(-np.eye(STATES), P.shape)
    values = np.concatenate([A0.ravel(), P.ravel(), minus_one.ravel(), Am.ravel()])
    band = np.zeros((2 * LOWER + UPPER + 1, STATES * (len(P) + 1)))
    band[LOWER + UPPER + row - column, column] = values
    return band


@lru_cache(maxsize=64)
def _places(pieces: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return row and column, in Newton's matrix, of every entry of A_0, the P_i, the blocks -1 and A_m."""
    i = np.arange(pieces)[:, None, None]
    row, column = np.indices((STATES, STATES))
    rows = [np.indices((7, STATES))[0], 7 + STATES * i + row, 7 + STATES * i + row]
    columns = [np.indices((7, STATES))[1], STATES * i + column, STATES * (i + 1) + column]
    end = np.indices((6, STATES)) + np.array([7 + STATES * pieces, STATES * pieces])[:, None, None]
    together = [np.concatenate([part.ravel() for part in parts]) for parts in ([*rows, end[0]], [*columns, end[1]])]
    return together[0], together[1]
