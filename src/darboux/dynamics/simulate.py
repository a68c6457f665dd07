"""One call for every method of motion."""

from __future__ import annotations

import dataclasses
import sys
import time
from contextlib import nullcontext
from operator import attrgetter
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from darboux import checks
from darboux.checks import checked_call
from darboux.dynamics.implicit_midpoint import ImplicitMidpoint
from darboux.dynamics.run import Run
from darboux.dynamics.system import System, refuses
from darboux.errors import InvalidInput
from darboux.motion import Motion
from darboux.solution import Status
from darboux.trajectory import MotionEnergy, Trajectory

Array = NDArray[np.float64]

SAME = 1e-9  # of the duration: two times are one
RECORDS = 200
SLOW = 2.0  # s of wall time after which a progress bar appears on a terminal


class Method(Protocol):
    """What a method of motion is."""

    segments: int
    spread: bool  # whether mass is spread along the segments

    def begin(self, system: System) -> Run:
        """Return a run at t = 0."""


@checked_call
def simulate(
    motion: Motion,
    method: Any = None,
    *,
    records: int | None = None,
    drift: float = 0.01,
    start_from: Trajectory | None = None,
    throw: bool = True,
    progress: bool | None = None,
) -> Trajectory:
    """Follow a motion to its end.

    Arguments: ``motion`` a ``Motion``; ``method`` ``ImplicitMidpoint()`` (the default), ``TRBDF2()`` or
    ``StormerVerlet()``; ``records`` the number of equal intervals of time between which the rod is recorded (None: 200); ``drift``
    of the energy balance, relative, above which the status says so; ``start_from`` a ``Trajectory`` of the same motion,
    which may have been shorter, and method, that is continued after its last record as if it had never stopped;
    ``throw`` whether a run that breaks off raises; ``progress`` whether a bar is shown (None: on a terminal, after two seconds).
    Returns a ``Trajectory``; Ctrl-C ends the run, with what was reached and the status "stopped". Raises ``InvalidInput``
    where the motion can't be stated, and ``NotConverged``, whose ``solution`` is the trajectory so far, unless ``throw``
    is False.
    """
    checks.instance("simulate.motion", motion, Motion, "a Motion")
    if start_from is not None:
        method, records = _continued(motion, method, records, start_from)
    method = ImplicitMidpoint() if method is None else method
    if isinstance(method, type) or not hasattr(method, "begin"):
        raise InvalidInput(
            f"simulate.method is {checks.shown(method)}; it must be a method of motion, such as ImplicitMidpoint(segments=50)."
        )
    records = checks.whole("simulate.records", RECORDS if records is None else records, 1)
    drift = checks.positive("simulate.drift", drift)
    refusal = refuses(motion)
    if refusal:
        raise InvalidInput(refusal)
    system = System(motion, method.segments, spread=method.spread)
    run: Run = method.begin(system)
    times = np.linspace(0.0, motion.duration, records + 1)
    for event in motion.events:  # one and the same time, not two a rounding apart
        times[np.abs(times - event) < SAME * motion.duration] = event
    recorder = _Recorder(system, records, start_from)
    if start_from is None:
        recorder.take(run)
    else:
        run.resume(start_from.checkpoint)
        recorder.checkpoint = start_from.checkpoint
    status = Status("converged", "The motion was followed to its end.")
    began = time.perf_counter()
    with _bar(progress) as bar, np.errstate(all="ignore"):
        task = bar.add_task("motion", total=motion.duration, completed=run.t, visible=bool(progress)) if bar else None
        try:
            for t in times[times > run.t + SAME * motion.duration]:
                failure = _to(run, float(t))
                if failure:
                    status = Status("no_convergence", failure)
                    break
                recorder.take(run)
                if bar and task is not None:
                    bar.update(task, completed=float(t), visible=bool(progress) or time.perf_counter() - began > SLOW)
        except KeyboardInterrupt:
            status = Status(
                "stopped", f"The run was stopped at t = {run.t:.6g} s of {motion.duration:g} s; it can be continued."
            )
    trajectory = recorder.trajectory(method, status, run, drift, time.perf_counter() - began)
    return trajectory.check() if throw else trajectory


def _continued(motion: Motion, method: Any, records: int | None, before: Trajectory) -> tuple[Any, int]:
    """Return the method of a run that is continued, and its records at their old distance, if no other is asked for."""
    checks.instance("simulate.start_from", before, Trajectory, "a Trajectory")
    if method is not None and method != before.method:
        raise InvalidInput(f"simulate.method is {method}, but start_from was made by {before.method}; go on with that.")
    if dataclasses.replace(before.motion, duration=motion.duration) != motion:
        raise InvalidInput("simulate.start_from is of another motion; only the duration may differ.")
    if motion.duration < before.times[-1]:
        raise InvalidInput(
            f"motion.duration is {motion.duration:g} s, but start_from has reached {before.times[-1]:g} s; make it longer."
        )
    interval = before.motion.duration / before.statistics["records"]
    return before.method, max(1, round(motion.duration / interval)) if records is None else records


def _to(run: Run, t: float) -> str | None:
    """Take a run to a time, releasing supports on the way; return why it broke off, or None."""
    for event in (*(e for e in run.system.motion.events if run.t < e < t), t):
        if not run.advance(event):
            return run.failure()
        if event in run.system.motion.events:
            run.release()
    return None


def _bar(progress: bool | None) -> Any:
    if not (sys.stderr.isatty() if progress is None else progress):
        return nullcontext()
    from rich.console import Console
    from rich.progress import Progress

    return Progress(console=Console(stderr=True), transient=True)


class _Recorder:
    """Keeps what a run went through, in SI units, after what was recorded ``before``."""

    def __init__(self, system: System, records: int, before: Trajectory | None) -> None:
        self.system, self.records, self.before, self.n = system, records, before, 0
        self.checkpoint = np.zeros(0)
        N = system.segments
        self.times = np.zeros(records + 1)
        self.x, self.v = np.zeros((records + 1, N + 1, 3)), np.zeros((records + 1, N + 1, 3))
        self.d1, self.spin = np.zeros((records + 1, N, 3)), np.zeros((records + 1, N))
        self.measured = np.zeros((records + 1, 15))

    def take(self, run: Run) -> None:
        """Record the run's present state."""
        i, N, units = self.n, self.system.segments, self.system.units
        self.times[i] = run.t
        self.x[i] = run.state.x.reshape(-1, 3) * units.length + units.origin
        packed = np.append(run.V, 0.0).reshape(N + 1, 4)
        self.v[i], self.spin[i] = packed[:, :3] * (units.length / units.time), packed[:-1, 3] / units.time
        self.d1[i] = run.state.d1.reshape(-1, 3)[1:-1]
        self.measured[i] = run.measures()
        self.checkpoint, self.n = run.checkpoint(), i + 1  # at once, should the user stop it here

    def trajectory(self, method: Any, status: Status, run: Run, drift: float, seconds: float) -> Trajectory:
        """Return what was recorded, with the status that the energy allows."""
        units, n = self.system.units, self.n
        kinetic, bending, twist, stretch, load = self.measured[:n, :5].T * units.energy
        supports, dissipated, of_loads, of_supports = self.measured[:n, 11:].T * units.energy
        work = of_supports + of_loads + (load - (load[:1] if self.before is None else self.before.energy.load[0]))
        energies = (kinetic, bending, twist, stretch, supports, load, dissipated, work)
        names = [field.name for field in dataclasses.fields(MotionEnergy)]
        energy = MotionEnergy(*(self._whole(f"energy.{name}", new) for name, new in zip(names, energies, strict=True)))
        if status.converged and not energy.drift <= drift:
            status = Status(
                "drift",
                f"The motion was followed to its end, but its energy drifts by {energy.drift:.2g} of what there is "
                f"(simulate.drift = {drift:g}); take smaller steps.",
            )
        momentum = self.measured[:n, 5:8] * (units.mass * units.length / units.time)
        angular = self.measured[:n, 8:11] * (units.mass * units.length**2 / units.time)
        return Trajectory(
            self.system.motion,
            method,
            status,
            self.system.nodes * units.length,
            self._whole("times", self.times[:n]),
            self._whole("positions", self.x[:n]),
            self._whole("velocities", self.v[:n]),
            self._whole("directors", self.d1[:n]),
            self._whole("spins", self.spin[:n]),
            energy,
            self._whole("momentum", momentum),
            self._whole("angular_momentum", angular + np.cross(units.origin, momentum)),
            self.checkpoint,
            {
                "seconds": seconds,
                "records": self.records,
                "steps": run.steps,
                "newton_iterations": run.iterations,
                "halvings": run.halvings,
            },
        )

    def _whole(self, name: str, new: Array) -> Array:
        """Return the new records of a quantity after the old ones."""
        return new.copy() if self.before is None else np.concatenate([attrgetter(name)(self.before), new])
