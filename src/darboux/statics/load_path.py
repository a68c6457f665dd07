"""Follow the equilibrium that starts at the unloaded rod while all loads and displacements grow together.

Natural-parameter continuation in the load factor: a tangent predictor, Newton's corrector, a step that is chosen by
how far the rod turns. A rod has many equilibria, and Newton's method from afar lands on any of them. Here no section
may turn by more than a fraction of a radian between one equilibrium and the next, and the corrector must turn the rod
by clearly less than the predictor did, however little that is: a rod that buckles from an almost straight shape is
almost straight on either side of the buckling load, and only the direction of the step tells the two apart. Where the
number of unstable directions (or the sign of the determinant) changes, the step is shortened until the change lies
within a narrow span of the load; what is left then is a crossing of branches.

Source: E. L. Allgower and K. Georg, Introduction to Numerical Continuation Methods (SIAM, 2003), ch. 6 and 8.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextvars import ContextVar
from dataclasses import dataclass, field
from threading import Event
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from darboux.kernels import step_control
from darboux.kernels.step_control import (
    CROSSING_STEP,
    LARGEST_PREDICTED_TURN,
    LARGEST_STEP,
    LATER_CROSSING_STEP,
    LOST,
    MECHANISM_LOAD,
    MECHANISM_STEPS,
    MOST_STEPS,
    REJECTED,
    SMALLEST_STEP,
)
from darboux.solution import SNAP

Array = NDArray[np.float64]
State = TypeVar("State")

UNSEEN_TURN = 1e-5  # rad; below this a turn may be what the integration leaves over
UNSEEN_TURN_OF_CABLE = (
    0.05  # rad; a cable has one equilibrium, so that no branch can be missed, and its path hardly turns
)
FOLD_SLOPE = (
    20.0  # rad per unit of load, over the load: a path that stops where it turns faster than this has met a fold
)


@dataclass(frozen=True)
class Corrected(Generic[State]):
    """An equilibrium that Newton's method reached: the state, the largest turn it took, the Jacobian's sign.

    ``index`` is the number of unstable directions where it is counted, else None.
    """

    state: State
    turn: float
    sign: float
    iterations: int
    index: int | None = None


class Branch(Protocol[State]):
    """What a method offers to be followed."""

    def stability(self, state: State, load_factor: float) -> tuple[float, int | None]:
        """Return the sign of the Jacobian's determinant, or 0 where it is singular, and the unstable directions if counted."""

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
    crossings: list[tuple[float, float]] = field(default_factory=list)  # load factors between which stability changed
    index: int | None = None  # the unstable directions of the last equilibrium, where they are counted
    unstable: tuple[State, float] | None = None  # the state and the load factor behind the first crossing
    slope: float = 0.0  # rad per unit of load factor, of the last tangent: without bound at a fold


@dataclass(frozen=True)
class Fall:
    """Where a rod left its path down in energy: at a fold, or where it turned unstable, and how far it moved at most in m."""

    load_factor: float
    fold: bool
    jump: float


STOP: ContextVar[Event | None] = ContextVar("stop", default=None)  # set where all threads of a call are to stop


def look() -> None:
    """Raise ``KeyboardInterrupt`` in a thread whose call the user stopped: Ctrl-C itself reaches the main thread alone."""
    stop = STOP.get()
    if stop is not None and stop.is_set():
        raise KeyboardInterrupt


class Stopped(KeyboardInterrupt):
    """Ctrl-C on the way: ``branch`` and ``path``, what was followed and how far."""

    def __init__(self, branch: Any, path: Path[Any]) -> None:
        super().__init__(f"stopped at {_percent(path)} of the load")
        self.branch, self.path = branch, path


def follow(
    branch: Branch[State], state: State, until_unstable: bool = False, *, unseen: float = UNSEEN_TURN
) -> Path[State]:
    """Follow the branch from load factor 0, where ``state`` is an equilibrium, to 1 or to where it ends.

    With ``until_unstable`` it is followed to its first crossing at most; ``unseen`` rad are what the corrector may always turn
    the rod by. Raises ``Stopped`` on Ctrl-C.
    """
    path = Path(state, 0.0)
    try:
        return _followed(branch, path, until_unstable, unseen)
    except KeyboardInterrupt:
        raise Stopped(branch, path) from None


def followed_as_cable(branch: Branch[State], state: State) -> Path[State]:
    """Follow a cable from the chain that it resembles; see ``of_cable``."""
    return of_cable(follow(branch, state, unseen=UNSEEN_TURN_OF_CABLE))


def of_cable(path: Path[State]) -> Path[State]:
    """Return the path of a cable: to the one equilibrium, whatever the curvature that is lent does before.

    What is crossed on the way are buckling loads of the naturally bent rod, so that they are kept only where the end is unstable.
    """
    if not path.index:
        path.crossings.clear()
        path.unstable = None
    return path


def _followed(branch: Branch[State], path: Path[State], until_unstable: bool, unseen: float) -> Path[State]:
    state = path.state
    sign, path.index = branch.stability(state, 0.0)
    step = first = LARGEST_STEP
    while path.load_factor < 1.0 and path.steps + path.rejected < MOST_STEPS:
        tangent, turn = branch.tangent(path.state, path.load_factor)
        if not np.isfinite(turn):
            return path
        path.slope = turn
        step = min(step, LARGEST_STEP, 1.0 - path.load_factor, LARGEST_PREDICTED_TURN / max(turn, 1e-300))
        first = step if path.steps == 0 else first
        while True:
            look()
            last = step >= (1.0 - path.load_factor) * (1.0 - 1e-12)
            goal = 1.0 if last else path.load_factor + step
            ahead = goal - path.load_factor
            reached = branch.correct(branch.predict(path.state, tangent, ahead), goal)
            if reached is not None and reached.turn <= step_control.allowed(turn * ahead, unseen):
                counted = reached.index is not None and path.index is not None
                changed = reached.index != path.index if counted else reached.sign * sign < 0.0
                if not changed or ahead <= (LATER_CROSSING_STEP if path.index else CROSSING_STEP):
                    break
            path.rejected += 1
            step = ahead * (LOST if reached is None else REJECTED)
            if step < SMALLEST_STEP * max(path.load_factor, first):
                return path
        if changed:
            path.crossings.append((path.load_factor, goal))
            path.unstable = path.unstable or (reached.state, goal)
            if until_unstable and reached.index:
                return path
        sign, path.index = reached.sign, reached.index
        path.state, path.load_factor = reached.state, goal
        path.steps += 1
        path.iterations += reached.iterations
        if path.steps > MECHANISM_STEPS and path.load_factor < MECHANISM_LOAD:
            return path
        step *= step_control.growth(turn * ahead, reached.turn, unseen, 1)
    return path


def _percent(path: Path[Any]) -> str:
    return f"{np.floor(1e4 * path.load_factor) / 100.0:.4g} %"


def unstable_in(index: int | None) -> str:
    """Return the sentence for an unstable equilibrium, with a space before it; nothing for a stable one."""
    return f" It is unstable: {index} direction(s) lower its energy." if index else ""


def ending(path: Path[State], method: str, origin: str = "the unloaded rod") -> tuple[str, str]:
    """Return the status code and the sentence for the way a path ended that began with ``origin``."""
    percent = _percent(path)
    if path.load_factor >= 1.0:
        message = f"converged: the equilibrium that follows from {origin}"
        if path.crossings:
            a, b = path.crossings[0]
            later = f", and {len(path.crossings) - 1} times later on" if len(path.crossings) > 1 else ""
            message += (
                f"; between {100.0 * a:.4g} % and {100.0 * b:.4g} % of the load{later} other equilibria branch off it, and its "
                "stability changes"
            )
        return "converged", f"{message}.{unstable_in(path.index)}"
    if 0.0 < path.load_factor < MECHANISM_LOAD and path.steps > MECHANISM_STEPS:
        return "no_convergence", (
            "the rod turns on and on as a whole under the smallest part of the load: its supports leave it free to turn, and the "
            "loads have a moment about that axis that turning does not take away. Hold that rotation, as by a Clamped or "
            "Hinge support or a rotational Spring, or take the moment off."
        )
    if path.load_factor == 0.0:
        return "no_convergence", (
            f"{method} could not leave {origin}: its equations are singular there, as for a straight inextensible "
            "rod held at both ends. Bend it a little by a small load, or use DiscreteRod with rod.stretch."
        )
    if path.steps + path.rejected >= MOST_STEPS:
        return "no_convergence", (
            f"{method} gave up after {MOST_STEPS} steps of the load, at {percent} of it: the rod turns too often on the way. "
            "Lower the load."
        )
    if path.slope * path.load_factor < FOLD_SLOPE:
        return "no_convergence", (
            f"{method} found no equilibrium beyond {percent} of the load, and no fold there either. "
            "Try another method or a finer one, or load in another order."
        )
    return "folded", (
        f"the equilibrium that follows from {origin} ends at {percent} of the load: beyond a fold the rod snaps to "
        "another shape."
    )


def reached(path: Path[State], falls: Sequence[Fall], origin: str, length: float, *, told: bool) -> tuple[str, str]:
    """Return the status code and the sentences for a stable equilibrium that was reached past bifurcations and snaps.

    The part of the load is ``told`` only where it is the problem's own.
    """
    message = f"converged: the stable equilibrium that follows from {origin}."
    if path.crossings:
        a, b = path.crossings[0]
        where = f"Between {100.0 * a:.4g} % and {100.0 * b:.4g} % of the load" if told else "On the way"
        leaves = "the rod leaves it to the side that a small disturbance gives"
        message += f" {where} the straight-on branch turns unstable, and {leaves}."
    for fall in falls:
        if fall.fold or fall.jump > SNAP * length:
            where = f"At {100.0 * fall.load_factor:.4g} % of the load" if told else "On the way"
            message += (
                f" {where} it snaps, and moves by up to {fall.jump:.3g} m; contact of the rod with itself is left out."
            )
    return "converged", message


def stopped(path: Path[Any]) -> str:
    """Return the sentence for a path that the user stopped."""
    return f"stopped at {_percent(path)} of the load."


def flattened(path: Path[State]) -> str:
    """Return the sentence for a rod that is compressed to nothing."""
    return (
        f"at {100.0 * path.load_factor:.4g} % of the load the rod is compressed to nothing: its stretch reaches 0. Its EA is too "
        "small for the load; check both."
    )
