"""The state of a running motion, which every method advances."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.dynamics.system import System, new_state
from darboux.errors import InvalidInput
from darboux.kernels import rod_motion

Array = NDArray[np.float64]

MOST_STEPS = 1e9  # hours, with ten segments


def check_steps(field: str, step: float, duration: float, instead: str) -> None:
    """Raise ``InvalidInput`` where a motion would take more steps than any machine makes."""
    if duration / step > MOST_STEPS:
        raise InvalidInput(
            f"{field} is {step:.3g} s, which makes {duration / step:.2g} steps of the duration of {duration:g} s; at most "
            f"{MOST_STEPS:.0e} are taken. {instead}"
        )


class Run:
    """Where a motion is: ``t`` in s, the dimensionless state, velocities, accelerations and tally of energy."""

    advice = "Try more segments, or look whether loads and supports pull the rod apart there."
    numbers: tuple[str, ...] = ("t", "steps", "iterations", "halvings")  # those that a run goes on with

    def __init__(self, system: System) -> None:
        self.system, self.body = system, system.body
        self.t = 0.0
        self.state, self.V = system.start()
        self.A = np.zeros_like(self.V)
        self.tally = np.zeros(3)
        self.tally[rod_motion.OF_LOADS] = -self.measures()[12]
        self.now, self.velocity = new_state(system.edges), np.empty_like(self.V)
        self.steps = self.iterations = self.halvings = 0

    def advance(self, t: float) -> bool:
        """Go to the time t in s; return False where a step does not converge, with all that was reached kept."""
        raise NotImplementedError

    def release(self) -> None:
        """Let go the ends whose time has come; the energy that goes with a support is its work."""
        T, before = self.body.rod.T, self._energy()
        self.body = self.system.body = self.system.body_at(self.t)
        self.body.rod.T[:] = T
        self.A[:] = 0.0
        self.tally[rod_motion.OF_SUPPORTS] += self._energy() - before

    def _energy(self) -> float:
        """Return the energy of the rod's springs and its supports, without the loads'."""
        measured = self.measures()
        return float(np.sum(measured[:4]) + measured[11] - measured[12])

    def failure(self) -> str:
        """Return where and when a step did not converge, and what to try."""
        place = self.system.place_of(self.system.space.residual)
        return (
            f"a step of {self.smallest:.2g} s does not converge at t = {self.t:.6g} s, worst near s = {place:.4g} m; what was "
            f"reached is kept. {self.advice}"
        )

    @property
    def smallest(self) -> float:
        """The shortest step that was tried, in s."""
        return 0.0

    def measures(self) -> Array:
        """Return energies, momenta, the supports' energy, that of no spring (see the kernel), the tally: (16,), dimensionless."""
        result, factors = np.empty(13), self.system.factors_at(self.t)
        rod_motion.measures(self.state, self.V, self.body, factors, result)
        result[4] += factors[rod_motion.FACTORS :] @ self.system.datum
        return np.concatenate([result, self.tally])

    def parts(self) -> tuple[Array, ...]:
        """Return all arrays that a step changes and the next one reads."""
        space = self.system.space
        return (*self.state, self.V, self.A, self.tally, self.body.rod.T, space.expected, space.reaction, space.power)

    def kept(self) -> tuple[Array, ...]:
        """Return copies of them."""
        return tuple(part.copy() for part in self.parts())

    def put_back(self, kept: tuple[Array, ...]) -> None:
        """Undo steps since `kept`."""
        for part, before in zip(self.parts(), kept, strict=True):
            part[:] = before

    def checkpoint(self) -> Array:
        """Return all that the run goes on with, in one array, from which `resume` goes on bit for bit."""
        return np.concatenate([[getattr(self, name) for name in self.numbers], *self.parts()])

    def resume(self, checkpoint: Array) -> None:
        """Go to where a run with the same rod, supports and method was; raises ``InvalidInput`` for what is no such place."""
        size = len(self.numbers) + sum(part.size for part in self.parts())
        if checkpoint.shape != (size,) or not np.all(np.isfinite(checkpoint)):
            raise InvalidInput(
                f"simulate.start_from has a checkpoint of {checkpoint.size} numbers, of which {size} finite ones are needed; "
                "simulate the motion from its start."
            )
        for name, value in zip(self.numbers, checkpoint, strict=False):
            setattr(self, name, type(getattr(self, name))(value))
        self.body = self.system.body = self.system.body_at(self.t)
        sizes = [part.size for part in self.parts()]
        self.put_back(tuple(np.split(checkpoint[len(self.numbers) :], np.cumsum(sizes)[:-1])))
