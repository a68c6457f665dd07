"""Stoermer and Verlet's method: explicit, symplectic, for very small steps."""

from __future__ import annotations

import math

from darboux import checks
from darboux.checks import MOST_SEGMENTS, assign, description
from darboux.dynamics.modes import largest_frequency
from darboux.dynamics.run import Run, check_steps
from darboux.dynamics.system import System
from darboux.errors import InvalidInput
from darboux.kernels import rod_motion

CHUNK = 1024
SAFETY = 0.9  # of the largest stable step, which the stiffness at the start gives


@description
class StormerVerlet:
    """Stoermer and Verlet's method, order 2, explicit and symplectic; stable only for very small steps.

        V_h = V0 - h/2 M^-1 G(q0),     q1 = q0 + h V_h,     V1 = V_h - h/2 M^-1 G(q1)

    The largest stable step is 2 / omega, with omega the highest natural frequency of the discrete rod. It is the choice
    where every wave along the rod is to be resolved, impact for one. Stretchable rods only.

    Arguments: ``segments`` N >= 2; ``step`` in s (None: 0.9 times the largest stable one).
    Source: E. Hairer, C. Lubich, G. Wanner, Acta Numerica 12 (2003) 399.
    """

    segments: int = 100
    step: float | None = None

    order = 2
    spread = False

    def __post_init__(self) -> None:
        assign(self, segments=checks.whole("stormer_verlet.segments", self.segments, 2, MOST_SEGMENTS))
        if self.step is not None:
            assign(self, step=checks.positive("stormer_verlet.step", self.step, "s"))

    def __str__(self) -> str:
        return f"StormerVerlet({self.segments}" + ("" if self.step is None else f", step={self.step:g}") + ")"

    def begin(self, system: System) -> Run:
        """Return a run at t = 0."""
        if system.inextensible:
            raise InvalidInput(
                "StormerVerlet states rods that stretch, but rod.stretch is False; use ImplicitMidpoint, or set rod.stretch."
            )
        return _Explicit(system, self.step)


class _Explicit(Run):
    advice = "Try a shorter step, which fast motion and damping need, more segments, or ImplicitMidpoint."
    numbers = (*Run.numbers, "step")

    def __init__(self, system: System, step: float | None) -> None:
        super().__init__(system)
        stable = 2.0 / largest_frequency(system, self.state) * system.units.time
        if step is not None and step > stable:
            raise InvalidInput(
                f"stormer_verlet.step is {step:.4g} s; the largest stable step is {stable:.4g} s. Leave it out, or use "
                "ImplicitMidpoint, which is stable for any."
            )
        self.step = step or SAFETY * stable
        instead = "Take ImplicitMidpoint, whose steps may be longer."
        check_steps("stormer_verlet.step", self.step, system.motion.duration, instead)
        self._start()

    def _start(self) -> None:
        row = self.system.drive([self.t], self.step)[0]
        rod_motion.accelerations(self.state, self.V, self.body, row, self.system.space, self.A)

    def release(self) -> None:
        super().release()
        self._start()

    @property
    def smallest(self) -> float:
        return self.step

    def advance(self, t: float) -> bool:
        """Make equal steps to t."""
        system, start = self.system, self.t
        n = max(1, math.ceil((t - start) / self.step * (1.0 - 1e-12)))
        h = (t - start) / n
        for first in range(0, n, CHUNK):
            steps = min(CHUNK, n - first)
            rows = 1 if system.motion.steady else steps
            drive = system.drive([start + h * (first + k + 1) for k in range(rows)], h)
            done = rod_motion.verlet_steps(
                self.state, self.V, self.A, h / system.units.time, steps, drive, self.body, system.space, self.now,
                self.tally,
            )  # fmt: skip
            self.steps += done if done >= 0 else -1 - done
            self.t = t if first + steps == n and done >= 0 else start + h * (first + max(done, -1 - done))
            if done < 0:
                return False
        return True
