"""The implicit midpoint rule: no damping of its own, momenta kept to rounding, energy without drift."""

from __future__ import annotations

import math

from darboux import checks
from darboux.checks import MOST_SEGMENTS, assign, description
from darboux.dynamics.run import Run, check_steps
from darboux.dynamics.system import System
from darboux.kernels import rod_motion

DEFAULT_STEPS = 1000
MOST_HALVINGS = 10
CHUNK = 256  # steps to a call, so that a run can be stopped


@description
class ImplicitMidpoint:
    """The implicit midpoint rule, order 2, for conservative motion, by Newton's method on the exact banded Newton matrix.

    M (V1 - V0) / h + G((q0 + q1) / 2, (V0 + V1) / 2) = 0,     q1 - q0 = h (V0 + V1) / 2

    Stretching and spin are taken between the ends of the step, so that the tension's work is exact and inextensible
    rods have exact multipliers. Linear and angular momentum are kept to rounding; energy has an error of order h^2 that
    does not grow. Unconditionally stable for small motion.

    Arguments: ``segments`` N >= 2; ``step`` h in s (None: the duration over 1000); ``tolerance`` of Newton's last change, as a
    turn in rad: what is kept is kept to about that. A step that does not converge is halved, up to ten times; the next one has its
    full length again. Source: J. C. Simo, N. Tarnow, K. K. Wong, Comput. Methods Appl. Mech. Eng. 100 (1992) 63.
    """

    segments: int = 100
    step: float | None = None
    tolerance: float = 1e-10

    order = 2
    spread = True

    def __post_init__(self) -> None:
        assign(self, segments=checks.whole("implicit_midpoint.segments", self.segments, 2, MOST_SEGMENTS))
        assign(self, tolerance=checks.positive("implicit_midpoint.tolerance", self.tolerance, "rad"))
        if self.step is not None:
            assign(self, step=checks.positive("implicit_midpoint.step", self.step, "s"))

    def __str__(self) -> str:
        return f"ImplicitMidpoint({self.segments}" + ("" if self.step is None else f", step={self.step:g}") + ")"

    def begin(self, system: System) -> Run:
        """Return a run at t = 0."""
        if self.step is not None:
            check_steps("implicit_midpoint.step", self.step, system.motion.duration, "Take a longer step.")
        return _Steps(system, self.step or system.motion.duration / DEFAULT_STEPS, self.tolerance)


class _Steps(Run):
    numbers = (*Run.numbers, "step")

    def __init__(self, system: System, step: float, tolerance: float) -> None:
        super().__init__(system)
        self.step, self.tolerance = step, tolerance
        self._tried = step

    @property
    def smallest(self) -> float:
        return self._tried

    def advance(self, t: float) -> bool:
        """Make equal steps to t; one that does not converge is made anew as two of half the length."""
        while self.t < t:
            left = max(1, math.ceil((t - self.t) / self.step * (1.0 - 1e-12)))
            n = min(CHUNK, left)
            if not self._steps(t if n == left else self.t + n * (t - self.t) / left, n):
                return False
        return True

    def _steps(self, t: float, n: int, halved: int = 0) -> bool:
        """Make n equal steps to t, each halved at most MOST_HALVINGS - `halved` times more."""
        while n > 0:
            kept, start, h = self.kept(), self.t, (t - self.t) / n
            made = self._try(h, n)
            if made < n:
                self.put_back(kept)
                if made > 0:
                    self._try(h, made)
                self.t = start + made * h
                made += 1
                if not self._again(t if made == n else start + made * h, h, halved):
                    return False
            n -= made
        self.t = t
        return True

    def _again(self, t: float, h: float, halved: int) -> bool:
        """Make the step to t that did not converge from another guess, or as two.

        The last acceleration is a poor guess of the next where the rod oscillates faster than the steps: there it changes its sign.
        """
        kept = self.kept()
        self.A[:] = 0.0
        if self._try(h, 1) == 1:
            self.t = t
            return True
        self.put_back(kept)
        self.halvings += 1
        return halved < MOST_HALVINGS and self._steps(t, 2, halved + 1)

    def _try(self, h: float, n: int) -> int:
        """Make n steps of h seconds from where the run is; return how many converged."""
        self._tried = h
        drive = self.system.midpoint_drive(self.t, h, n)
        done = int(rod_motion.midpoint_steps(
            self.state, self.V, self.A, h / self.system.units.time, n, drive, self.body, self.system.space,
            self.now, self.velocity, self.tally, self.tolerance,
        ))  # fmt: skip
        if done < 0:
            return -1 - done
        self.steps, self.iterations = self.steps + n, self.iterations + done
        return n
