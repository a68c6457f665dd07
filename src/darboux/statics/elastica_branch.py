"""The branch of equilibria that starts at the unloaded rod, followed in the load factor.

The unknowns z of a system and the load factor form one point u = (z, load). From a known point the branch is
predicted along its tangent and corrected by Newton's method across it:

    [ G_u(u) ]         [ G(u)            ]
    [  row   ] du  = - [ row . (u - u_p) ],      row = the tangent, in the weights that measure the arc length.

This is Keller's pseudo-arclength continuation: the bordered matrix stays regular where the branch turns back, so a
fold is seen, and reported, instead of being jumped over. The corrected point is taken only where the tangent turned
little; otherwise the step is halved. Nothing here knows of rods.

Source: H. B. Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems, in P. H. Rabinowitz (ed.),
Applications of Bifurcation Theory, 1977, p. 359.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

Array = NDArray[np.float64]

FIRST_STEP, LONGEST_STEP, SHORTEST_STEP = 0.05, 0.3, 1e-8  # arc length: radians and load factor, root mean square
FOLD_STEP = 1e-4  # a fold is located to about the square of this, in the load factor
LEAST_COSINE = 0.95  # between the tangents at both ends of a step
STEPS_ALLOWED = 3000
NEWTON_TOLERANCE = 1e-8  # on the last correction; its square is left, by Newton's quadratic convergence
NEWTON_ALLOWED = 8
PATH_TOLERANCE = 1e-5  # of the resolution on the way: only the end of the branch is wanted to all digits


class System(Protocol):
    """A discretised problem G(z, load) = 0 with n unknowns z; u = (z, load) has n + 1 entries."""

    @property
    def weights(self) -> Array:
        """The weight of each entry of u in the square of the arc length: (n + 1,); zero where it has no say."""

    def residual(self, u: Array) -> Array:
        """G(u): (n,)."""

    def jacobian(self, u: Array) -> sparse.csc_matrix:
        """dG/du: (n, n + 1)."""

    def refined(self, u: Array, tolerance: float) -> tuple[Self, Array] | None:
        """A finer system and u interpolated to it, or None where this one resolves u to the tolerance."""


S = TypeVar("S", bound=System)


@dataclass(frozen=True)
class Branch(Generic[S]):
    """Where the branch ended: ``code`` is "converged", "folded" or "no_convergence"."""

    system: S
    u: Array
    code: str
    steps: int
    newton_iterations: int

    @property
    def load(self) -> float:
        return float(self.u[-1])


class Follower(Generic[S]):
    """One walk along a branch; counts what it takes."""

    def __init__(self, system: S) -> None:
        self.system = system
        self.steps = 0
        self.newton_iterations = 0

    def follow(self, z: Array) -> Branch[S]:
        """Walk from z at load 0 to load 1, or to the last equilibrium before a fold."""
        start = self.at_fixed_load(np.append(z, 0.0))
        if start is None or (tangent := self.tangent(start, self._load_row(start))) is None:
            return self.ended(np.append(z, 0.0), "no_convergence")
        u, step = start, FIRST_STEP
        while self.steps < STEPS_ALLOWED and step > SHORTEST_STEP:
            self.steps += 1
            found = self._step(u, tangent, step)
            if found is None:
                step /= 2.0
                continue
            v, next_tangent = found
            if v[-1] >= 1.0:
                share = (1.0 - u[-1]) / (v[-1] - u[-1])
                if (end := self.at_fixed_load(np.append((u + share * (v - u))[:-1], 1.0))) is not None:
                    return self.ended(end, "converged")
                step /= 2.0
                continue
            if next_tangent[-1] <= 0.0:
                if step <= FOLD_STEP:
                    return self.ended(u, "folded")
                step /= 2.0
                continue
            u, tangent = self._resolved(v, next_tangent)
            step = min(1.6 * step, LONGEST_STEP)
        return self.ended(u, "no_convergence")

    def ended(self, u: Array, code: str) -> Branch[S]:
        return Branch(self.system, u, code, self.steps, self.newton_iterations)

    def refine(self, u: Array, tolerance: float, rounds: int = 60) -> Array | None:
        """Return u at its load on a system fine enough for the tolerance, or None where Newton failed on the way."""
        for _ in range(rounds):
            finer = self.system.refined(u, tolerance)
            if finer is None:
                return u
            self.system, guess = finer
            corrected = self.at_fixed_load(guess)
            if corrected is None:
                return None
            u = corrected
        return u

    def at_fixed_load(self, guess: Array) -> Array | None:
        """Return the equilibrium near ``guess`` at the guess's load."""
        return self._corrected(guess, self._load_row(guess))

    def tangent(self, u: Array, row: Array) -> Array | None:
        """Return the unit tangent of the branch at u, on the side to which ``row`` points."""
        direction = self._solved(u, row, np.append(np.zeros(len(u) - 1), 1.0))
        if direction is None:
            return None
        return np.asarray(direction / np.sqrt(self.system.weights @ direction**2))

    def _step(self, u: Array, tangent: Array, step: float) -> tuple[Array, Array] | None:
        """Predict and correct one step; None where Newton failed or the branch turned too sharply to be sure of it."""
        row = self.system.weights * tangent
        v = self._corrected(u + step * tangent, row)
        if v is None or (turned := self.tangent(v, row)) is None:
            return None
        return (v, turned) if row @ turned >= LEAST_COSINE else None

    def _resolved(self, u: Array, tangent: Array) -> tuple[Array, Array]:
        """Return u and its tangent on a system fine enough for the way; the old one where that fails."""
        before = self.system
        fine = self.refine(u, PATH_TOLERANCE)
        if self.system is before:
            return u, tangent
        if fine is not None and (new := self.tangent(fine, self._load_row(fine))) is not None:
            return fine, new
        self.system = before
        return u, tangent

    @staticmethod
    def _load_row(u: Array) -> Array:
        return np.append(np.zeros(len(u) - 1), 1.0)

    def _corrected(self, guess: Array, row: Array) -> Array | None:
        """Newton's method on G(u) = 0, row . (u - guess) = 0; None unless every correction is smaller than the last."""
        u, last = guess, np.inf
        measured = self.system.weights > 0.0
        for _ in range(NEWTON_ALLOWED):
            self.newton_iterations += 1
            change = self._solved(u, row, np.append(-self.system.residual(u), -row @ (u - guess)))
            if change is None:
                return None
            u = u + change
            size = float(np.max(np.abs(change[measured])))
            if size < NEWTON_TOLERANCE:
                return u
            if not size < last:
                return None
            last = size
        return None

    def _solved(self, u: Array, row: Array, right: Array) -> Array | None:
        bordered = sparse.vstack([self.system.jacobian(u), sparse.csc_matrix(row)], format="csc")
        try:
            solution = splu(bordered).solve(right)
        except RuntimeError:  # exactly singular
            return None
        return np.asarray(solution) if np.all(np.isfinite(solution)) else None
