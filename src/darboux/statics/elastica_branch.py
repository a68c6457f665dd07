"""The branch of equilibria that starts at the unloaded rod, followed in the load factor.

The unknowns z of a system and the load factor form one point u = (z, load). From a known point the branch is
predicted along its tangent and corrected by Newton's method across it:

    [ G_u(u) ]         [ G(u)            ]
    [  row   ] du  = - [ row . (u - u_p) ],      row = the tangent, in the weights that measure the arc length.

This is Keller's pseudo-arclength continuation: the bordered matrix stays regular where the branch turns back, so a
fold is seen, and reported, instead of being jumped over. The corrected point is taken only where the tangent turned
little; otherwise the step is halved. Along a smooth branch the bordered determinant keeps its sign. Where the sign
changes, either the branch crosses another one, or a sharp bend near such a crossing (a rod that buckles from an
almost straight shape) was cut: the step is halved until the bend is followed, or is so sharp that it is a crossing.
Nothing here knows of rods.

Source: H. B. Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems, in P. H. Rabinowitz (ed.),
Applications of Bifurcation Theory, 1977, p. 359.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

Array = NDArray[np.float64]

FIRST_STEP, LONGEST_STEP, SHORTEST_STEP = 0.05, 0.3, 1e-8  # arc length: radians and load factor, root mean square
FOLD_STEP = 1e-4  # a fold is located to about the square of this, in the load factor
CROSSING_STEP = 1e-4  # a bend within this is a crossing: imperfections below about its cube are not followed
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
    """Where the branch ended.

    ``code`` is "converged", "folded" or "no_convergence"; ``crossings`` are the loads at which it crossed another one.
    """

    system: S
    u: Array
    code: str
    crossings: tuple[float, ...]
    steps: int
    newton_iterations: int

    @property
    def load(self) -> float:
        """The load factor reached."""
        return float(self.u[-1])


class Follower(Generic[S]):
    """One walk along a branch; counts what it takes."""

    def __init__(self, system: S) -> None:
        self.system = system
        self.steps = 0
        self.newton_iterations = 0
        self.crossings: list[float] = []

    def follow(self, z: Array) -> Branch[S]:
        """Walk from z at load 0 to load 1, or to the last equilibrium before a fold."""
        place = self._start(np.append(z, 0.0))
        if place is None:
            return self._ended(np.append(z, 0.0), "no_convergence")
        step = FIRST_STEP
        while self.steps < STEPS_ALLOWED and step > SHORTEST_STEP:
            self.steps += 1
            ahead = self._step(place, step)
            if ahead is None or (ahead.sign != place.sign and step > CROSSING_STEP):
                step /= 2.0
            elif ahead.u[-1] >= 1.0:
                share = (1.0 - place.u[-1]) / (ahead.u[-1] - place.u[-1])
                guess = place.u + share * (ahead.u - place.u)
                if (end := self.at_fixed_load(np.append(guess[:-1], 1.0))) is not None:
                    return self._ended(end, "converged")
                step /= 2.0
            elif ahead.tangent[-1] <= 0.0:
                if step <= FOLD_STEP:
                    return self._ended(place.u, "folded")
                step /= 2.0
            else:
                if ahead.sign != place.sign:
                    self.crossings.append(float(ahead.u[-1]))
                place = self._resolved(ahead)
                step = min(1.6 * step, LONGEST_STEP)
        return self._ended(place.u, "no_convergence")

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
        return self._corrected(guess, _load_row(guess))

    def _ended(self, u: Array, code: str) -> Branch[S]:
        return Branch(self.system, u, code, tuple(self.crossings), self.steps, self.newton_iterations)

    def _start(self, guess: Array) -> _Place | None:
        u = self.at_fixed_load(guess)
        u = None if u is None else self.refine(u, PATH_TOLERANCE)
        return None if u is None else self._place(u, _load_row(u))

    def _step(self, place: _Place, step: float) -> _Place | None:
        """Predict and correct one step; None where Newton failed or the branch turned too sharply to be sure of it."""
        row = self.system.weights * place.tangent
        u = self._corrected(place.u + step * place.tangent, row)
        ahead = None if u is None else self._place(u, row)
        return ahead if ahead is not None and row @ ahead.tangent >= LEAST_COSINE else None

    def _resolved(self, place: _Place) -> _Place:
        """Return the place on a system fine enough for the way; as it is where that fails."""
        before = self.system
        u = self.refine(place.u, PATH_TOLERANCE)
        if self.system is before:
            return place
        finer = None if u is None else self._place(u, _load_row(u))
        if finer is None:
            self.system = before
            return place
        return finer

    def _place(self, u: Array, row: Array) -> _Place | None:
        """Return u with the unit tangent of the branch, on the side to which ``row`` points."""
        solved = _solved(self.system.jacobian(u), row, np.append(np.zeros(len(u) - 1), 1.0))
        if solved is None:
            return None
        direction, sign = solved
        return _Place(u, np.asarray(direction / np.sqrt(self.system.weights @ direction**2)), sign)

    def _corrected(self, guess: Array, row: Array) -> Array | None:
        """Newton's method on G(u) = 0, row . (u - guess) = 0; None unless every correction is smaller than the last."""
        u, last = guess, np.inf
        measured = self.system.weights > 0.0
        for _ in range(NEWTON_ALLOWED):
            self.newton_iterations += 1
            right = np.append(-self.system.residual(u), -row @ (u - guess))
            solved = _solved(self.system.jacobian(u), row, right)
            if solved is None:
                return None
            u = u + solved[0]
            size = float(np.max(np.abs(solved[0][measured])))
            if size < NEWTON_TOLERANCE:
                return u
            if not size < last:
                return None
            last = size
        return None


@dataclass(frozen=True)
class _Place:
    """A point of the branch, its unit tangent, and the sign of the bordered determinant there."""

    u: Array
    tangent: Array
    sign: int


def _load_row(u: Array) -> Array:
    return np.append(np.zeros(len(u) - 1), 1.0)


def _solved(jacobian: sparse.csc_matrix, row: Array, right: Array) -> tuple[Array, int] | None:
    """Return the solution of the bordered system and the sign of its determinant; None where it is singular."""
    try:
        factors = splu(sparse.vstack([jacobian, sparse.csc_matrix(row)], format="csc"))
    except RuntimeError:  # "Factor is exactly singular"
        return None
    solution = factors.solve(right)
    if not np.all(np.isfinite(solution)):
        return None
    negative = int(np.sum(factors.U.diagonal() < 0.0)) + _odd(factors.perm_r) + _odd(factors.perm_c)
    return solution, 1 - 2 * (negative % 2)


def _odd(permutation: NDArray[np.int32]) -> int:
    """Return 1 for an odd permutation: its length less the number of its cycles is odd."""
    n = len(permutation)
    graph = sparse.csr_matrix((np.ones(n), (np.arange(n), permutation)), shape=(n, n))
    return (n - int(connected_components(graph, return_labels=False))) % 2


class Entries:
    """The entries of a sparse matrix, gathered by blocks; those on the same place add up."""

    def __init__(self) -> None:
        self._blocks: list[tuple[Array, ...]] = []

    def add(self, rows: object, columns: object, values: object) -> None:
        """Add values at rows and columns, which are broadcast against each other."""
        self._blocks.append(tuple(a.ravel() for a in np.broadcast_arrays(rows, columns, values)))  # type: ignore[arg-type]

    def matrix(self, rows: int, columns: int) -> sparse.csc_matrix:
        """Return the matrix of this shape."""
        row, column, value = (np.concatenate(parts) for parts in zip(*self._blocks, strict=True))
        return sparse.csc_matrix((value, (row, column)), shape=(rows, columns))
