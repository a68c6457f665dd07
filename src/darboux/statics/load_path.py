"""Follow the equilibrium that starts at the unloaded rod while all loads and displacements grow together.

Natural-parameter continuation in the load factor: a tangent predictor, Newton's corrector, a step that is chosen by
how far the rod turns. A rod has many equilibria, and Newton's method from afar lands on any of them; here no section
may turn by more than a fraction of a radian between one equilibrium and the next, and the corrector less than the
predictor, so that the branch is not left unnoticed. Source: E. L. Allgower and K. Georg, Introduction to Numerical
Continuation Methods (SIAM, 2003), ch. 6 and 8.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
State = TypeVar("State")

LARGEST_PREDICTED_TURN = 0.6  # rad between neighbouring equilibria
LARGEST_CORRECTED_TURN = 0.3  # rad by which the corrector may move a predicted shape
WANTED_CORRECTED_TURN = 0.1  # rad; the predictor's error grows with the square of the step
LARGEST_STEP = 0.25  # also where nothing turns: a straight column passes its buckling loads one by one
SMALLEST_STEP = 1e-6  # of the load reached so far
MOST_STEPS = 1000


@dataclass(frozen=True)
class Corrected(Generic[State]):
    """An equilibrium that Newton's method reached: the state, the largest turn it took, the Jacobian's sign."""

    state: State
    turn: float
    sign: float
    iterations: int


class Branch(Protocol[State]):
    """What a method offers to be followed."""

    def sign(self, state: State, load_factor: float) -> float:
        """Return the sign of the Jacobian's determinant, or 0 where it is singular."""

    def tangent(self, state: State, load_factor: float) -> tuple[Array, float]:
        """Return the change of the state per unit of load factor, and the largest turn of a section in it (rad)."""

    def predict(self, state: State, tangent: Array, step: float) -> State:
        """Return the state moved along the tangent."""

    def correct(self, state: State, load_factor: float) -> Corrected[State] | None:
        """Return the equilibrium that Newton's method reaches, or None where it does not contract."""


@dataclass
class Path(Generic[State]):
    """Where the path ended: the last equilibrium and its load factor (1: all the way), and what was met."""

    state: State
    load_factor: float
    steps: int = 0
    rejected: int = 0
    iterations: int = 0
    crossings: list[tuple[float, float]] = field(default_factory=list)  # load factors between which the determinant
    # of the Jacobian changed its sign


def follow(branch: Branch[State], state: State) -> Path[State]:
    """Follow the branch from load factor 0, where ``state`` is an equilibrium, to 1 or to where it ends."""
    path = Path(state, 0.0)
    sign = branch.sign(state, 0.0)
    step = first = LARGEST_STEP
    while path.load_factor < 1.0 and path.steps + path.rejected < MOST_STEPS:
        tangent, turn = branch.tangent(path.state, path.load_factor)
        if not np.isfinite(turn):
            return path
        step = min(step, LARGEST_STEP, 1.0 - path.load_factor, LARGEST_PREDICTED_TURN / max(turn, 1e-300))
        first = step if path.steps == 0 else first
        while True:
            last = step >= (1.0 - path.load_factor) * (1.0 - 1e-12)
            goal = 1.0 if last else path.load_factor + step
            reached = branch.correct(branch.predict(path.state, tangent, goal - path.load_factor), goal)
            if reached is not None and reached.turn <= LARGEST_CORRECTED_TURN:
                break
            path.rejected += 1
            step *= 0.4 if reached is None else 0.6
            if step < SMALLEST_STEP * max(path.load_factor, first):
                return path
        if reached.sign * sign < 0.0:
            path.crossings.append((path.load_factor, goal))
        sign = reached.sign
        path.state, path.load_factor = reached.state, goal
        path.steps += 1
        path.iterations += reached.iterations
        step *= float(np.clip(np.sqrt(WANTED_CORRECTED_TURN / max(reached.turn, 1e-12)), 0.5, 4.0))
    return path


def ending(path: Path[State], method: str) -> tuple[str, str]:
    """Return the status code and the sentence for the way a path ended."""
    percent = f"{np.floor(1e4 * path.load_factor) / 100.0:.4g} %"
    if path.load_factor >= 1.0:
        if not path.crossings:
            return "converged", "converged: the equilibrium that follows from the unloaded rod."
        where = " and ".join(f"between {100.0 * a:.3g} % and {100.0 * b:.3g} %" for a, b in path.crossings)
        return "converged", (
            f"converged: the equilibrium that follows from the unloaded rod; {where} of the load other equilibria branch "
            "off it, and its stability changes."
        )
    if path.load_factor == 0.0:
        return "no_convergence", (
            f"{method} could not leave the unloaded rod: its equations are singular there, as for a straight inextensible "
            "rod held at both ends. Bend it a little by a small load, or use DiscreteRod() with stretch=True."
        )
    if path.steps + path.rejected >= MOST_STEPS:
        return "no_convergence", (
            f"{method} gave up after {MOST_STEPS} steps of the load, at {percent} of it: the rod turns too often on the way. "
            "The last equilibrium is in .solution; lower the load."
        )
    return "folded", (
        f"the equilibrium that follows from the unloaded rod ends at {percent} of the load: beyond a fold the rod snaps to "
        f"another shape. The last equilibrium is in .solution; lower the load below {percent}, or load in another order."
    )
