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

from darboux.statics.elastica_branch import Branch, Follower
from darboux.statics.elastica_plane import PlaneData, PlaneProblem, PlaneSolution, PlaneStates

Array = NDArray[np.float64]

P = 20  # points on an element
TAIL = 3  # coefficients at the end of a series that must have decayed
NARROWEST = 1e-13  # of L: where a jump in the data is not halved any further
MOST_ELEMENTS = 2000
STRAIGHT = 0.1  # rad: an unloaded rod that turns by less can't be pushed together along its tangent

X, W = legendre.leggauss(P)
TO_SERIES = (np.arange(P)[:, None] + 0.5) * legendre.legvander(X, P - 1).T * W  # values at X to Legendre coefficients
INTEGRAL = legendre.legint(np.eye(P), lbnd=-1.0, axis=0) / 2.0  # (P + 1, P): coefficients to those of the integral, h = 1
TO_ENDS = legendre.legvander(np.append(X, 1.0), P) @ INTEGRAL @ TO_SERIES  # A, and below it the weights to the right end


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
        return self.first + t * (1.0 - self.first)

    def pose(self, t: float) -> Array:
        return np.asarray(self.start + t * (self.stop - self.start))


def solve(plane: PlaneProblem, rtol: float) -> PlaneSolution:
    """Return the equilibrium that follows from the unloaded rod, on elements fine enough for rtol.

    The estimated error of the tip is its difference from the solution on elements of half the width.
    """
    branches = followed(plane)
    system, code = branches[-1].system, branches[-1].code
    walk = Follower(system)
    coarse = walk.refine(branches[-1].u, 0.01 * rtol)
    fine = None if coarse is None else walk.refine(coarse, 0.0, rounds=1)
    u, error = branches[-1].u, np.inf
    if coarse is not None and fine is not None:
        half, system, u = system_before(walk), walk.system, fine
        error = 0.0
    return PlaneSolution()
