"""The elastica under end loads in closed form: Kirchhoff's pendulum, by Jacobi's functions and Carlson's integral.

Lengths are in units of the rod's L, forces of EI/L^2. With no load along the rod the force F = f (cos b, sin b) is
constant, and the tangent angle moves like a pendulum in the "time" s:

    theta'' = f sin(theta - b),     chi = theta - b + pi:     chi'' = -f sin(chi),     w^2 = f.

The invariant q^2 = f sin^2(chi/2) + kappa^2/4 gives the parameter m = q^2/f: for m < 1 the pendulum swings and the
curve has inflexions, for m > 1 it turns over and has none,

    S = sin(chi/2) = sqrt(m) sn(w s + a | m),   D = cos(chi/2) = dn(w s + a | m),   kappa/2 = w sqrt(m) cn(w s + a | m).

**No phase, no branches.** The addition theorems carry S, D and kappa over a piece of length h without ever asking for
the phase a. With z = sn(w h | m)/w, c = cn(w h | m), d = dn(w h | m) and N = 1 - f S^2 z^2:

    S_h     = (S c d + z D kappa/2) / N
    D_h     = (D d - S z c kappa/2) / N                                                                     (1)
    kappa_h = (kappa c - 2 f S D z d) / N

In this form nothing divides by f or by w: f = 0 is the circle, kappa = 0 besides the straight line. For m > 1 the
reciprocal modulus gives the same three, z = sn(q h | 1/m)/q, c = dn(q h | 1/m), d = cn(q h | 1/m); the two sides of
m = 1 agree to rounding. Near the unstable rest of the pendulum (a rod pulled straight, D and kappa small) D_h and
kappa_h are sums of small terms, so their relative accuracy is kept; a phase found from the modulus would lose half
of the digits there.

**Positions.** Along -F and across it, dX = int cos(chi), dY = int sin(chi) over the piece,

    dX = h - 2 z (S S_h + q^2 z^2 R_D(c^2, d^2, 1) / 3)
    dY = 2 z (S D d + (kappa/2) z (1/(1 + c) - S^2)) / N                                                     (2)

The first is the addition theorem of the second elliptic integral, E(u|m) = u - (m/3) sn^3 R_D(cn^2, dn^2, 1), which
for m > 1 reads the same with c and d exchanged, and R_D is symmetric in them. The second is the balance of moments,
dY = -(kappa_h - kappa)/f, after c - 1 = -f z^2/(1 + c) has taken the f out of it: written as a difference it would
cancel as f -> 0. So no quadrature stands in for the closed form anywhere. (1) and (2) hold for max(w, q) h < pi/2.

**The boundary value problem.** The rod is cut into the fewest equal pieces with max(w, q) h <= 1, and (1) on each
of them is one block of Newton's method. One piece for the whole rod would do on paper; but it amplifies rounding by
exp(w), a loss of eleven digits at F L^2/EI = 613 and of all of them at 1400.

Sources: A. E. H. Love, A Treatise on the Mathematical Theory of Elasticity, 4th ed. 1927, art. 260-263; NIST Digital
Library of Mathematical Functions, 22.8 (addition theorems), 22.17 (moduli above one), 19.25 (Carlson's forms).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse, special

from darboux.statics.elastica_branch import Entries, Follower
from darboux.statics.elastica_plane import PlaneProblem, PlaneSolution, PlaneStates

Array = NDArray[np.float64]


def solve(plane: PlaneProblem) -> PlaneSolution:
    """Return the equilibrium under the end loads that follows from the unloaded rod.

    The error is the difference from the same rod cut into twice as many pieces: there is no error but rounding.
    """
    system = Pieces.of(plane)
    walk = Follower(system)
    branch = walk.follow(system.unloaded())
    fine, tip = system.halved(), system.states(branch.u, np.ones(1)).r[0]
    again = Follower(fine).at_fixed_load(np.append(fine.sampled(branch.u, system), branch.load))
    if again is None:
        again, fine = branch.u, system
    return PlaneSolution(
        code=branch.code,
        load=branch.load,
        reached=branch.load,
        crossings=branch.crossings,
        states=lambda s: fine.states(again, s),
        error=float(np.linalg.norm(fine.states(again, np.ones(1)).r[0] - tip)),
        statistics={
            "solver": "closed form",
            "pieces": fine.count,
            "steps": walk.steps,
            "newton_iterations": walk.newton_iterations,
        },
    )


def jacobi(f: Array, q: Array, h: Array) -> tuple[Array, Array, Array]:
    """Return z = sn(w h | m)/w, c = cn, d = dn, for w^2 = f and m = q^2/f on either side of 1, f = q = 0 included."""
    w = np.sqrt(f)
    rate = np.maximum(w, q)  # w where the pendulum swings, q where it turns over
    slow = np.minimum(w, q)
    ratio = np.divide(slow, rate, out=np.zeros_like(rate), where=rate > 0.0)
    sn, cn, dn, _ = special.ellipj(rate * h, ratio**2)
    z = np.where(rate > 0.0, sn / np.where(rate > 0.0, rate, 1.0), h)
    swings = q <= w
    return z, np.where(swings, cn, dn), np.where(swings, dn, cn)


def carried(theta: Array, kappa: Array, force: Array, h: Array) -> tuple[Array, Array, Array, Array]:
    """Carry angle and curvature over a piece: the closed form, (1) and (2).

    Arguments: ``theta``, ``kappa`` and ``h`` (n,), ``force`` (2,) along x and y.
    Returns theta and kappa at the end of the piece, and its extent along x and y: each (n,).
    """
    f, b = float(np.hypot(*force)), float(np.arctan2(force[1], force[0]))
    half = (theta - b + np.pi) / 2.0
    S, D, half_kappa = np.sin(half), np.cos(half), kappa / 2.0
    q = np.hypot(np.sqrt(f) * S, half_kappa)
    z, c, d = jacobi(np.full_like(q, f), q, h)
    N = 1.0 - f * (S * z) ** 2
    S_h = (S * c * d + z * D * half_kappa) / N
    D_h = (D * d - S * z * c * half_kappa) / N
    kappa_h = 2.0 * (half_kappa * c - f * S * D * z * d) / N
    turn = 2.0 * np.arctan2(S_h * D - D_h * S, D_h * D + S_h * S)  # below 2 q h < pi in size
    along = h - 2.0 * z * (S * S_h + (q * z) ** 2 * special.elliprd(c**2, d**2, 1.0) / 3.0)
    across = 2.0 * z * (S * D * d + half_kappa * z * (1.0 / (1.0 + c) - S**2)) / N
    cos_b, sin_b = np.cos(b), np.sin(b)
    return theta + turn, kappa_h, across * sin_b - along * cos_b, -across * cos_b - along * sin_b


@dataclass(frozen=True)
class Pieces:
    """A clamped rod in ``count`` equal pieces, as a system for the branch: u = (theta_0 .., kappa_0 .., load)."""

    plane: PlaneProblem
    natural: float
    count: int

    @classmethod
    def of(cls, plane: PlaneProblem) -> Pieces:
        """Return the fewest pieces with max(w, q) h <= 1 at every load up to the full one."""
        natural = float(plane.data(np.zeros(1)).k0[0])
        tip = (
            abs(natural) + abs(plane.end_moment) + float(np.hypot(*plane.off_centre))
        )  # the largest curvature of the free end
        rate = np.sqrt(float(np.hypot(*plane.end_force)) + tip**2 / 4.0)
        return cls(plane, natural, max(1, int(np.ceil(rate))))

    def halved(self) -> Pieces:
        """Return the same rod in twice as many pieces."""
        return Pieces(self.plane, self.natural, 2 * self.count)

    @property
    def force(self) -> Array:
        """The force (2,) on the free end at full load."""
        return self.plane.end_force

    @property
    def nodes(self) -> Array:
        """The ends of the pieces: (count + 1,)."""
        return np.linspace(0.0, 1.0, self.count + 1)

    @property
    def weights(self) -> Array:
        """The arc length is mean (d theta)^2 + (d load)^2."""
        n = self.count + 1
        return np.concatenate([np.full(n, 1.0 / n), np.zeros(n), [1.0]])

    def unloaded(self) -> Array:
        """The unknowns of the natural arc: (n,)."""
        return np.concatenate([self.natural * self.nodes, np.full(self.count + 1, self.natural)])

    def sampled(self, u: Array, other: Pieces) -> Array:
        """Return the unknowns of this system from a point u of another one."""
        states = other.states(u, self.nodes)
        return np.concatenate([states.theta, states.kappa])

    def _split(self, u: Array) -> tuple[Array, Array, float]:
        n = self.count + 1
        return u[:n], u[n : 2 * n], float(u[-1])

    def _ends(self, theta: Array, kappa: Array, load: float) -> Array:
        """theta and kappa at the ends of the pieces: (2, count)."""
        h = np.full(self.count, 1.0 / self.count)
        return np.stack(carried(theta, kappa, load * self.force, h)[:2])

    def residual(self, u: Array) -> Array:
        """G(u): the clamp, (1) on every piece, the free end."""
        theta, kappa, load = self._split(u)
        ends = self._ends(theta[:-1], kappa[:-1], load)
        free = kappa[-1] - self.natural - load * self.plane.moment_at_end(theta[-1])[0]
        return np.concatenate([[theta[0]], theta[1:] - ends[0], kappa[1:] - ends[1], [free]])

    def jacobian(self, u: Array) -> sparse.csc_matrix:
        """The derivatives of (1) by central differences: they only steer Newton's method, the residual is exact."""
        theta, kappa, load = self._split(u)
        a, b, n = theta[:-1], kappa[:-1], self.count
        dt, dl = 1e-5, 1e-5 / (1.0 + float(np.hypot(*self.force)))
        dk = 1e-5 * (1.0 + float(np.max(np.abs(b))))
        by_theta = (self._ends(a + dt, b, load) - self._ends(a - dt, b, load)) / (2.0 * dt)
        by_kappa = (self._ends(a, b + dk, load) - self._ends(a, b - dk, load)) / (2.0 * dk)
        by_load = (self._ends(a, b, load + dl) - self._ends(a, b, load - dl)) / (2.0 * dl)
        theta_at, kappa_at = np.arange(n), np.arange(n) + n + 1  # where those at the start of each piece stand
        entries = Entries()
        for rows, at, ends in ((theta_at + 1, theta_at, 0), (kappa_at, kappa_at, 1)):
            entries.add(rows, at + 1, 1.0)
            entries.add(rows, theta_at, -by_theta[ends])
            entries.add(rows, kappa_at, -by_kappa[ends])
            entries.add(rows, 2 * n + 2, -by_load[ends])
        entries.add([0, 2 * n + 1], [0, 2 * n + 1], 1.0)
        moment, by_angle = self.plane.moment_at_end(theta[-1])
        entries.add(2 * n + 1, n, -load * by_angle)
        entries.add(2 * n + 1, 2 * n + 2, -moment)
        return entries.matrix(2 * n + 2, 2 * n + 3)

    def refined(self, u: Array, tolerance: float) -> None:
        """A closed form has nothing to refine."""

    def states(self, u: Array, s: Array) -> PlaneStates:
        """Return the states at s (m,): each carried in closed form from the start of its piece."""
        theta, kappa, load = self._split(u)
        force, h = load * self.force, np.full(self.count, 1.0 / self.count)
        extent = np.stack(carried(theta[:-1], kappa[:-1], force, h)[2:], axis=1)
        corner = np.concatenate([np.zeros((1, 2)), np.cumsum(extent, axis=0)])
        i = np.clip((s * self.count).astype(int), 0, self.count - 1)
        angle, curvature, x, y = carried(theta[i], kappa[i], force, s - self.nodes[i])
        return PlaneStates(
            theta=angle,
            kappa=curvature,
            moment=curvature - self.natural,
            r=corner[i] + np.stack([x, y], axis=1),
            n=np.broadcast_to(force, (len(s), 2)),
        )
