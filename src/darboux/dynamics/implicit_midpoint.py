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
    """The implicit midpoint rule, order 2, for conservative motion, by Newton's method on the exact banded Hessian.

    M (V1 - V0) / h + G((q0 + q1) / 2, (V0 + V1) / 2) = 0,     q1 - q0 = h (V0 + V1) / 2

    Stretching and spin are taken between the ends of the step, so that the tension's work is exact and inextensible
    rods have exact multipliers. Linear and angular momentum are kept to rounding; energy has an error of order h^2 that
    does not grow. Unconditionally stable for small motion.

    Arguments: ``segments`` N >= 2; ``step`` h in s (None: the duration over 1000); ``tolerance`` of Newton's last change, as a
    turn in rad: what is kept is kept to about that. A step that does not converge is
    halved, up to ten times. Source: J. C. Simo, N. Tarnow, K. K. Wong, Comput. Methods Appl. Mech. Eng. 100 (1992) 63.
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
    numbers = (*Run.numbers, "step", "halved")

    def __init__(self, system: System, step: float, tolerance: float) -> None:
        super().__init__(system)
        self.step, self.tolerance = step, tolerance
        self._tried = step
        self.halved = 0

    @property
    def smallest(self) -> float:
        return self._tried

    def advance(self, t: float) -> bool:
        """Make equal steps to t; those that do not converge are made anew at half the length."""
        while self.t < t:
            left = max(1, math.ceil((t - self.t) / self.step * (1.0 - 1e-12)))
            n = min(CHUNK, left)
            if not self._chunk(t if n == left else self.t + n * (t - self.t) / left, n):
                return False
        return True

    def _chunk(self, t: float, n: int) -> bool:
        kept, start = self.kept(), self.t
        self.halved = max(0, self.halved - 1)  # what did not converge a moment ago is not tried at full length at once
        while True:
            steps = n * 2**self.halved
            h = self._tried = (t - start) / steps
            drive = self.system.midpoint_drive(start, h, steps)
            done = rod_motion.midpoint_steps(
                self.state, self.V, self.A, h / self.system.units.time, steps, drive, self.body, self.system.space,
                self.now, self.velocity, self.tally, self.tolerance,
            )  # fmt: skip
            if done >= 0:
                self.t, self.steps, self.iterations = t, self.steps + steps, self.iterations + done
                return True
            self.put_back(kept)
            self.halvings += 1
            self.halved += 1
            if self.halved > MOST_HALVINGS:
                return False
