"""TR-BDF2: L-stable, for stiff and damped motion, with a step that adapts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux import checks
from darboux.checks import MOST_SEGMENTS, assign, description
from darboux.dynamics.run import Run, check_steps
from darboux.dynamics.system import System, new_state
from darboux.kernels import rod_motion

Array = NDArray[np.float64]

FIRST = 1e-4  # of the duration: the first step that is tried
GROWTH, SHRINKING, SAFETY = 2.5, 0.2, 0.9
SHORTEST = 1e-12  # of the duration
NEWTON = 1e-3  # of rtol, to which Newton's method is followed
AGAIN = 1e-3  # of a step: what is left of an interval below this is rounding


@description
class TRBDF2:
    """BDF2 in one step, its second point made by the trapezoidal rule: order 2, L-stable, for stiff and damped motion.

        q_g = q0 + g h / 2 (V0 + V_g),     q1 = q0 + (q_g - q0) / (g (2 - g)) + (1 - g) / (2 - g) h V1,     g = 2 - sqrt 2

    and likewise for M V. Fast waves that the step does not resolve are damped, which the balance of energy shows; for motion
    without damping take ``ImplicitMidpoint``.

    Arguments: ``segments`` N >= 2; ``rtol`` the error of one step in positions over the length, and in angles (rad), by
    which the step adapts; ``step`` a constant step in s in its place. Sources: R. E. Bank et al., IEEE Trans.
    Computer-Aided Design 4 (1985) 436; M. E. Hosea, L. F. Shampine, Appl. Numer. Math. 20 (1996) 21.
    """

    segments: int = 100
    rtol: float = 1e-5
    step: float | None = None

    order = 2
    spread = True

    def __post_init__(self) -> None:
        assign(
            self,
            segments=checks.whole("tr_bdf2.segments", self.segments, 2, MOST_SEGMENTS),
            rtol=checks.positive("tr_bdf2.rtol", self.rtol),
        )
        if self.step is not None:
            assign(self, step=checks.positive("tr_bdf2.step", self.step, "s"))

    def __str__(self) -> str:
        control = f"rtol={self.rtol:g}" if self.step is None else f"step={self.step:g}"
        return f"TRBDF2({self.segments}, {control})"

    def begin(self, system: System) -> Run:
        """Return a run at t = 0."""
        if self.step is not None:
            check_steps("tr_bdf2.step", self.step, system.motion.duration, "Take a longer step.")
        return _Adaptive(system, self.rtol, self.step)


class _Adaptive(Run):
    numbers = (*Run.numbers, "h")

    def __init__(self, system: System, rtol: float, step: float | None) -> None:
        super().__init__(system)
        self.rtol, self.constant = rtol, step
        self.tolerance = NEWTON * rtol if step is None else 1e-10
        self.h = step or FIRST * system.motion.duration
        self.middle, self.error = new_state(system.edges), np.empty_like(self.V)
        self.power, self.new_power = np.zeros(3), np.zeros(3)
        self._steady: Array | None = None
        self._tried = self.h
        self._start()

    def _start(self) -> None:
        """Find the accelerations and powers from which the next step starts."""
        row = self.system.drive([self.t], self.h)[0]
        rod_motion.accelerations(self.state, self.V, self.body, row, self.system.space, self.A)
        self.power[:2], self.power[2] = self.system.space.power, 0.0

    def parts(self) -> tuple[Array, ...]:
        return (*super().parts(), self.power)

    def release(self) -> None:
        super().release()
        if self.constant is None:
            self.h = min(self.h, FIRST * self.system.motion.duration)
        self._start()

    @property
    def smallest(self) -> float:
        return self._tried

    def _drive(self, h: float) -> Array:
        """Return the three rows of a step; what never changes is found once."""
        if self._steady is None or not self.system.motion.steady:
            times = [self.t, self.t + rod_motion.GAMMA * h, self.t + h]
            self._steady = self.system.drive(times, h)
        return self._steady

    def advance(self, t: float) -> bool:
        """Step to t; errors above the tolerance and steps that do not converge make the step shorter."""
        motion, units = self.system.motion, self.system.units
        halvings = 0
        while self.t < t:
            left = t - self.t
            n = max(1, round(left / self.h + 0.5 - AGAIN)) if left < 3.0 * self.h else 3
            h = self._tried = left / n if left < 3.0 * self.h else self.h
            A, drive = self.A.copy(), self._drive(h)
            done = rod_motion.tr_bdf2_step(
                self.state, self.V, A, h / units.time, drive, self.body, self.system.space, self.middle,
                self.now, self.velocity, self.error, self.new_power, self.tolerance,
            )  # fmt: skip
            size = float(np.max(np.abs(self.error))) / self.rtol if done >= 0 else np.inf
            if done < 0 or (self.constant is None and not size <= 1.0):
                self.halvings += 1
                halvings += 1
                factor = 0.5 if done < 0 else max(SHRINKING, SAFETY * size ** (-1.0 / 3.0))
                self.h = h * factor
                if self.h < SHORTEST * motion.duration or (self.constant is not None and halvings > 10):
                    return False
                continue
            self.tally[rod_motion.OF_LOADS] += rod_motion.work_on_ghosts(
                self.state, self.now, self.body, drive[0], drive[2]
            )
            self._accept(t if n == 1 else self.t + h, h / units.time, A, done)
            halvings = 0
            if self.constant is None:
                self.h = h * min(GROWTH, max(SHRINKING, SAFETY * max(size, 1e-3) ** (-1.0 / 3.0)))
            else:
                self.h = self.constant
        return True

    def _accept(self, t: float, h: float, A: Array, iterations: int) -> None:
        self.tally += 0.5 * h * (self.power + self.new_power)
        self.power[:] = self.new_power
        self.t = t
        for part, new in zip((*self.state, self.V, self.A), (*self.now, self.velocity, A), strict=True):
            part[:] = new
        self.steps += 1
        self.iterations += iterations
