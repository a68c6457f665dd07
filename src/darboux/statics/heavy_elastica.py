"""The heavy elastica: the boundary value problem in the tangent angle, by piecewise Legendre collocation.

Lengths are in units of the rod's L, forces of EI/L^2 (see `elastica_plane`). The unknowns are theta and M,

    theta' = k0 + M/B,     M' = n_x sin(theta) - n_y cos(theta) - l,     n(s) = n(1) + int_s^1 f,

with theta(0) = 0 and, at s = 1, either M and n given (free), or theta given and x = int cos(theta),
y = int sin(theta) closing on the held place, n(1) being two more unknowns (clamped).

On each element both sides are polynomials through the P Gauss-Legendre points, in integral form,

    theta(s_i) = theta_left + h sum_j A_ij theta'(s_j),     A_ij = int_0^(x_i) l_j,

which is better conditioned than differentiation and asks nothing of B, k0 and f at the ends of the element, where a
table may have a kink. Elements are halved where the Legendre coefficients of what is integrated have not decayed,
so that boundary layers, kinks and jumps are found by themselves.

Sources: L. Greengard, Spectral integration and two-point boundary value problems, SIAM J. Numer. Anal. 28 (1991)
1071; F. V. Rohde, Large deflections of a cantilever beam with uniformly distributed load, Q. Appl. Math. 11 (1953) 337.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy import sparse

from darboux.statics.elastica_branch import Branch, Entries, Follower
from darboux.statics.elastica_plane import PlaneData, PlaneProblem, PlaneSolution, PlaneStates

Array = NDArray[np.float64]

P = 20  # points on an element
TAIL = 3  # coefficients at the end of a series that must have decayed
NARROWEST = 1e-13  # of L: where a jump in the data is not halved any further
MOST_ELEMENTS = 2000
IN_PLACE = 1e-12  # between the place that the held end slid to and its own
TAUT = 1.0 - 1e-9  # of L, between held ends: the force along a rod drawn straight has no bound
STRAIGHT = 0.1  # rad: an unloaded rod that turns by less can't be pushed together along its tangent

X, W = legendre.leggauss(P)
TO_SERIES = (np.arange(P)[:, None] + 0.5) * legendre.legvander(X, P - 1).T * W  # values at X to Legendre coefficients
INTEGRAL = (
    legendre.legint(np.eye(P), lbnd=-1.0, axis=0) / 2.0
)  # (P + 1, P): coefficients to those of the integral, h = 1
TO_ENDS = (
    legendre.legvander(np.append(X, 1.0), P) @ INTEGRAL @ TO_SERIES
)  # A, and below it the weights to the right end


@dataclass(frozen=True, eq=False)
class Leg:
    """One stretch of the way to the full problem; its own parameter t runs from 0 to 1.

    The loads grow from the factor ``first`` to 1; a held end moves from the pose ``start`` to ``stop``, each
    (x, y, theta); where it ``slides``, the force along x on it is zero instead of x given.
    """

    first: float
    start: Array
    stop: Array
    slides: bool = False

    def loads(self, t: float) -> float:
        """The factor of the loads."""
        return self.first + t * (1.0 - self.first)

    def pose(self, t: float) -> Array:
        """Where the held end is."""
        return np.asarray(self.start + t * (self.stop - self.start))


def solve(plane: PlaneProblem, rtol: float) -> PlaneSolution:
    """Return the equilibrium that follows from the unloaded rod, on elements fine enough for rtol."""
    branches = followed(plane)
    last = branches[-1]
    system, u, error = resolved(last, rtol)
    code = last.code
    if code == "converged" and not error <= rtol:
        code = "unresolved"
    return PlaneSolution(
        code=code,
        load=system.leg.loads(float(u[-1])),
        reached=last.load,
        crossings=last.crossings,
        pushed=len(branches) > 1,
        states=lambda s: system.states(u, s),
        error=error,
        statistics={
            "solver": "heavy elastica",
            "elements": len(system.width),
            "steps": sum(branch.steps for branch in branches),
            "newton_iterations": sum(branch.newton_iterations for branch in branches),
        },
    )


def followed(plane: PlaneProblem) -> list[Branch[Elements]]:
    """Return the branch from the unloaded rod to the full problem, in one leg or two.

    A held end moves to its place while the loads grow. Not so where the unloaded rod is straight: it can't give way
    along its tangent at first, the bordered matrix is singular. There the end slides along that line, free of force,
    while the loads grow and it takes its place across and its turn; then it is pushed along the line to its place.
    """
    edges = np.unique(np.concatenate([[0.0, 1.0], plane.breaks]))
    natural = Elements(plane, edges, Leg(0.0, np.zeros(3), np.zeros(3)))
    free = natural.states(natural.unloaded(), edges)
    unloaded = np.append(free.r[-1], free.theta[-1])
    wanted = unloaded if plane.end_pose is None else np.array(plane.end_pose)
    slides = plane.end_pose is not None and float(np.max(np.abs(free.theta))) < STRAIGHT
    system = Elements(plane, edges, Leg(0.0, unloaded, wanted, slides))
    first = Follower(system).follow(system.unloaded())
    if not slides or first.code != "converged":
        return [first]
    slid = first.system.states(first.u, np.ones(1))
    here = np.append(slid.r[0], slid.theta[0])
    if np.max(np.abs(wanted - here)) < IN_PLACE:
        return [first]
    if np.hypot(*wanted[:2]) > TAUT:
        return [replace(first, code="taut")]
    pushing = Elements(plane, first.system.edges, Leg(1.0, here, wanted))
    return [first, Follower(pushing).follow(first.u[:-1])]


def resolved(branch: Branch[Elements], rtol: float) -> tuple[Elements, Array, float]:
    """Return the last equilibrium on elements fine enough for rtol, and the estimated error of its tip.

    The error is the difference from elements of twice the width; infinite where they can't be made fine enough.
    """
    walk = Follower(branch.system)
    u = walk.refine(branch.u, 0.01 * rtol)
    if u is None:
        return branch.system, branch.u, np.inf
    wide = walk.system
    v = walk.refine(u, 0.0, rounds=1)
    if v is None:
        return wide, u, np.inf
    end = np.ones(1)
    return walk.system, v, float(np.linalg.norm(wide.states(u, end).r - walk.system.states(v, end).r))


@dataclass(frozen=True, eq=False)
class Elements:
    """The collocation on elements between ``edges``, as a system for the branch.

    u = ([theta_left, M_left, theta_1 .. theta_P, M_1 .. M_P] of each element, theta_end, M_end, [n_x, n_y of a held
    end], load). Every unknown but the first two, and those of a held end, has the integral equation that gives it.
    """

    plane: PlaneProblem
    edges: Array
    leg: Leg

    # -- what is given ------------------------------------------------------------------------------------------------

    @cached_property
    def width(self) -> Array:
        """h: (E,)."""
        return np.diff(self.edges)

    @cached_property
    def nodes(self) -> Array:
        """The Gauss-Legendre points: (E, P)."""
        return np.asarray(self.edges[:-1, None] + self.width[:, None] * (X + 1.0) / 2.0)

    @cached_property
    def data(self) -> PlaneData:
        """B, k0, f, l at the nodes: (E, P), f (E, P, 2)."""
        given = self.plane.data(self.nodes.ravel())
        return PlaneData(*(values.reshape(*self.nodes.shape, *values.shape[1:]) for values in given))

    @cached_property
    def hanging_left(self) -> Array:
        """int_s^1 f at the left edges: (E, 2)."""
        each = self._integrated(self.data.f)[:, -1]
        return np.asarray(np.cumsum(each[::-1], axis=0)[::-1])

    @cached_property
    def hanging(self) -> Array:
        """int_s^1 f at the nodes: (E, P, 2)."""
        return np.asarray(self.hanging_left[:, None] - self._integrated(self.data.f)[:, :-1])

    def _integrated(self, values: Array) -> Array:
        """The integral of values (E, P, ..) from the left edge to each node and to the right edge: (E, P + 1, ..)."""
        return np.asarray(np.einsum("e,ij,ej...->ei...", self.width, TO_ENDS, values))

    # -- where the unknowns stand -------------------------------------------------------------------------------------

    @property
    def held(self) -> bool:
        """True where s = 1 is clamped as well."""
        return self.plane.end_pose is not None

    @cached_property
    def left(self) -> NDArray[np.intp]:
        """Where theta_left stands, M_left one further on: (E + 1,), the last for the rod's end."""
        return np.arange(len(self.edges)) * (2 * P + 2)

    @cached_property
    def theta_at(self) -> NDArray[np.intp]:
        """Where theta stands at the nodes and at the right edge: (E, P + 1)."""
        return np.hstack([self.left[:-1, None] + 2 + np.arange(P), self.left[1:, None]])

    @cached_property
    def moment_at(self) -> NDArray[np.intp]:
        """Where M stands at the nodes and at the right edge: (E, P + 1)."""
        return np.hstack([self.left[:-1, None] + 2 + P + np.arange(P), self.left[1:, None] + 1])

    @property
    def size(self) -> int:
        """The number of unknowns without the load."""
        return int(self.left[-1]) + 2 + 2 * self.held

    @cached_property
    def weights(self) -> Array:
        """The arc length is int (d theta)^2 ds + (d load)^2."""
        weights = np.zeros(self.size + 1)
        weights[self.theta_at[:, :-1]] = self.width[:, None] * W / 2.0
        weights[-1] = 1.0
        return weights

    def unloaded(self) -> Array:
        """The unknowns of the natural shape: (n,)."""
        turned = self._integrated(self.data.k0)
        start = np.concatenate([[0.0], np.cumsum(turned[:, -1])])
        z = np.zeros(self.size)
        z[self.left] = start
        z[self.theta_at] = start[:-1, None] + turned
        return z

    # -- the equations ------------------------------------------------------------------------------------------------

    def end_force(self, u: Array) -> Array:
        """n at s = 1: (2,)."""
        return u[self.size - 2 : self.size] if self.held else self.leg.loads(u[-1]) * self.plane.end_force

    def _integrands(self, u: Array) -> tuple[Array, Array, Array]:
        """theta, theta' and M' at the nodes: (E, P) each."""
        theta, moment = u[self.theta_at[:, :-1]], u[self.moment_at[:, :-1]]
        load = self.leg.loads(u[-1])
        n = self.end_force(u) + load * self.hanging
        slope = n[..., 0] * np.sin(theta) - n[..., 1] * np.cos(theta) - load * self.data.l
        return theta, self.data.k0 + moment / self.data.B, slope

    def residual(self, u: Array) -> Array:
        """G(u): the integral equations at the unknowns they give, the supports at the rest."""
        theta, kappa, slope = self._integrands(u)
        end, G = self.left[-1], np.zeros(self.size)
        for at, left, rate in ((self.theta_at, self.left, kappa), (self.moment_at, self.left + 1, slope)):
            G[at] = u[at] - u[left[:-1], None] - self._integrated(rate)
        G[0] = u[0]
        if not self.held:
            G[1] = u[end + 1] - self.leg.loads(u[-1]) * self.plane.moment_at_end(u[end])[0]
            return G
        x, y, turn = self.leg.pose(u[-1])
        G[1] = u[end] - turn
        G[-2] = u[self.size - 2] if self.leg.slides else np.sum(self._integrated(np.cos(theta))[:, -1]) - x
        G[-1] = np.sum(self._integrated(np.sin(theta))[:, -1]) - y
        return G

    def jacobian(self, u: Array) -> sparse.csc_matrix:
        """dG/du, exact."""
        theta, _, _ = self._integrands(u)
        cos, sin, growth = np.cos(theta), np.sin(theta), 1.0 - self.leg.first
        n = self.end_force(u) + self.leg.loads(u[-1]) * self.hanging
        dn = growth * (self.hanging + (0.0 if self.held else self.plane.end_force))
        slope_by_theta = n[..., 0] * cos + n[..., 1] * sin
        slope_by_load = dn[..., 0] * sin - dn[..., 1] * cos - growth * self.data.l
        theta_at, moment_at, end, load = self.theta_at, self.moment_at, int(self.left[-1]), self.size
        A = self.width[:, None, None] * TO_ENDS
        entries = Entries()
        for at, left in ((theta_at, self.left[:-1]), (moment_at, self.left[:-1] + 1)):
            entries.add(at, at, 1.0)
            entries.add(at, left[:, None], -1.0)
        entries.add(theta_at[:, :, None], moment_at[:, None, :-1], -A / self.data.B[:, None, :])
        entries.add(moment_at[:, :, None], theta_at[:, None, :-1], -A * slope_by_theta[:, None, :])
        entries.add(moment_at, load, -self._integrated(slope_by_load))
        entries.add(0, 0, 1.0)
        if not self.held:
            entries.add(1, end + 1, 1.0)
            moment, by_angle = self.plane.moment_at_end(u[end])
            entries.add(1, end, -self.leg.loads(u[-1]) * by_angle)
            entries.add(1, load, -growth * moment)
        else:
            speed = self.leg.stop - self.leg.start
            weights = self.width[:, None] * W / 2.0
            entries.add(moment_at, load - 2, -self._integrated(sin))
            entries.add(moment_at, load - 1, self._integrated(cos))
            entries.add(1, end, 1.0)
            entries.add(1, load, -speed[2])
            if self.leg.slides:
                entries.add(load - 2, load - 2, 1.0)
            else:
                entries.add(load - 2, theta_at[:, :-1], -weights * sin)
                entries.add(load - 2, load, -speed[0])
            entries.add(load - 1, theta_at[:, :-1], weights * cos)
            entries.add(load - 1, load, -speed[1])
        return entries.matrix(self.size, self.size + 1)

    # -- what is found ------------------------------------------------------------------------------------------------

    def _series(self, u: Array) -> Array:
        """The Legendre coefficients of theta', M', x', y' and -f on each element: (E, P, 6)."""
        theta, kappa, slope = self._integrands(u)
        falling = -self.leg.loads(u[-1]) * self.data.f
        rates = np.stack([kappa, slope, np.cos(theta), np.sin(theta), falling[..., 0], falling[..., 1]], axis=-1)
        return np.asarray(TO_SERIES @ rates)

    def states(self, u: Array, s: Array) -> PlaneStates:
        """Return the states at s (m,): the integrals of the series."""
        integral = self.width[:, None, None] * (INTEGRAL @ self._series(u))  # (E, P + 1, 6)
        right = integral.sum(axis=1)  # every Legendre polynomial is 1 at the right edge
        corner = np.vstack([np.zeros(6), np.cumsum(right, axis=0)])[:-1]
        corner[:, :2] = u[self.left[:-1, None] + np.arange(2)]
        corner[:, 4:] = self.end_force(u) + self.leg.loads(u[-1]) * self.hanging_left
        e = np.clip(np.searchsorted(self.edges, s, side="right") - 1, 0, len(self.width) - 1)
        local = 2.0 * (s - self.edges[e]) / self.width[e] - 1.0
        found = corner[e] + np.einsum("mj,mjk->mk", legendre.legvander(local, P), integral[e])
        given = self.plane.data(s)
        return PlaneStates(
            theta=found[:, 0],
            kappa=given.k0 + found[:, 1] / given.B,
            moment=found[:, 1],
            r=found[:, 2:4],
            n=found[:, 4:6],
        )

    def refined(self, u: Array, tolerance: float) -> tuple[Elements, Array] | None:
        """Halve the elements whose coefficients have not decayed; all of them where the tolerance is zero."""
        moment, force = np.max(np.abs(u[self.moment_at])), np.max(np.abs(self.end_force(u) + self.hanging))
        scale = np.array([1.0, max(1.0, moment), 1.0, 1.0, max(1.0, force), max(1.0, force)])
        tails = self.width[:, None] * np.max(np.abs(self._series(u)[:, -TAIL:]), axis=1) / scale
        rough = np.max(tails, axis=1) > tolerance if tolerance else np.full(len(self.width), True)
        rough &= self.width > NARROWEST
        if not np.any(rough) or len(self.width) > MOST_ELEMENTS:
            return None
        middle = (self.edges[1:] + self.edges[:-1])[rough] / 2.0
        finer = Elements(self.plane, np.unique(np.append(self.edges, middle)), self.leg)
        return finer, finer.sampled(u, self)

    def sampled(self, u: Array, other: Elements) -> Array:
        """Return the point of this system that samples a point u of another one."""
        v = np.zeros(self.size + 1)
        at_edges = other.states(u, self.edges)
        at_nodes = other.states(u, self.nodes.ravel())
        v[self.left], v[self.left + 1] = at_edges.theta, at_edges.moment
        v[self.theta_at[:, :-1]] = at_nodes.theta.reshape(-1, P)
        v[self.moment_at[:, :-1]] = at_nodes.moment.reshape(-1, P)
        if self.held:
            v[self.size - 2 : self.size] = u[other.size - 2 : other.size]
        v[-1] = u[-1]
        return v
