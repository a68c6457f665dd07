"""One call for every method of motion."""

from __future__ import annotations

import dataclasses
import sys
import time
from contextlib import nullcontext
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from darboux import above, checks, files
from darboux.checks import checked_call
from darboux.dynamics.implicit_midpoint import ImplicitMidpoint
from darboux.dynamics.limits import refuses
from darboux.dynamics.run import Run
from darboux.dynamics.system import System
from darboux.errors import InvalidInput
from darboux.kernels.jit import announced
from darboux.motion import Motion
from darboux.solution import Status
from darboux.trajectory import MotionEnergy, Trajectory

Array = NDArray[np.float64]

SAME = 1e-9  # of the duration: two times are one
RECORDS, MOST_RECORDS = 200, 1_000_000
MOST_IN_MEMORY = 2e9  # bytes of records; a file takes more
RECORDED = ("positions", "velocities", "directors", "spins", "momentum", "angular_momentum")
ENERGIES = tuple(field.name for field in dataclasses.fields(MotionEnergy) if field.name != "least")
BLOCK = 64  # records that are copied at a time
SLOW = 2.0  # s of wall time after which a progress bar appears on a terminal


class Method(Protocol):
    """What a method of motion is."""

    segments: int
    spread: bool  # whether mass is spread along the segments

    def begin(self, system: System) -> Run:
        """Return a run at t = 0."""


@checked_call
@announced
def simulate(
    motion: Motion,
    method: Any = None,
    *,
    records: int | None = None,
    drift: float = 0.01,
    start_from: Trajectory | None = None,
    out: Any = None,
    throw: bool = True,
    progress: bool | None = None,
) -> Trajectory:
    """Follow a motion to its end.

    Arguments: ``motion`` a ``Motion``; ``method`` ``ImplicitMidpoint()`` (the default), ``TRBDF2()`` or
    ``StormerVerlet()``; ``records`` the number of equal intervals of time between which the rod is recorded (None: 200); ``drift``
    of the energy balance, relative, above which the status says so; ``start_from`` a ``Trajectory`` of the same motion,
    which may have been shorter, and method, that is continued after its last record as if it had never stopped;
    ``out`` a file into which every record is written at once, so that memory does not grow (NetCDF, as ``trajectory.save``
    writes it; NAME.part until the run ends, which ``darboux.open`` reads too);
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
    records = checks.whole("simulate.records", RECORDS if records is None else records, 1, MOST_RECORDS)
    drift = checks.positive("simulate.drift", drift)
    refusal = refuses(motion)
    if refusal:
        raise InvalidInput(refusal)
    system = System(motion, method.segments, spread=method.spread)
    run: Run = method.begin(system)
    if start_from is not None:
        run.resume(start_from.checkpoint)
    times = np.linspace(0.0, motion.duration, records + 1)
    for event in motion.events:  # one and the same time, not two a rounding apart
        times[np.abs(times - event) < SAME * motion.duration] = event
    times = times[times > run.t + SAME * motion.duration]
    recorder = _Recorder(run, method, records, len(times) + (start_from is None), start_from, out)
    if start_from is None:
        recorder.take()
    status = Status("converged", "The motion was followed to its end.")
    began = time.perf_counter()
    with _bar(progress) as bar, np.errstate(all="ignore"):
        task = bar.add_task("motion", total=motion.duration, completed=run.t, visible=bool(progress)) if bar else None
        try:
            for t in times:
                failure = _to(run, float(t))
                if failure:
                    status = Status("no_convergence", failure)
                    break
                recorder.take()
                if bar and task is not None:
                    bar.update(task, completed=float(t), visible=bool(progress) or time.perf_counter() - began > SLOW)
        except KeyboardInterrupt:
            status = Status(
                "stopped", f"The run was stopped at t = {run.t:.6g} s of {motion.duration:g} s; it can be continued."
            )
        except OSError as error:
            status = Status(
                "stopped",
                f"{out} can't be written ({files.reason(error)}); what was recorded before t = {run.t:.6g} s is kept. Make "
                "room, and let it go on.",
            )
    with files.patient():  # a second Ctrl-C waits until the file has its name
        trajectory = recorder.trajectory(status, drift, time.perf_counter() - began)
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
    motion = run.system.motion
    for event in (*sorted(e for e in {*motion.events, *motion.jumps} if run.t < e < t), t):
        if not run.advance(event):
            return run.failure()
        if event in motion.events:
            run.release()
    return None


def _bar(progress: bool | None) -> Any:
    if not (sys.stderr.isatty() if progress is None else progress):
        return nullcontext()
    from rich.console import Console
    from rich.progress import Progress

    return Progress(console=Console(stderr=True), transient=True)


class _Recorder:
    """Keeps what a run goes through, in SI units, in memory or on the disk, after what was recorded ``before``."""

    def __init__(self, run: Run, method: Any, records: int, times: int, before: Trajectory | None, out: Any) -> None:
        self.run, self.system, self.method, self.records, self.before = run, run.system, method, records, before
        self.load, self.n = None if before is None else before.energy.load[0], 0
        self.checkpoint = np.zeros(0)
        kept = {} if before is None else _parts(before)
        first = kept or self._row()
        total = times + (0 if before is None else len(before.times))
        self.stream: Any = None
        self.arrays: dict[str, Array] = {}
        if out is None:
            wanted = total * sum(part[0].nbytes for part in first.values())
            if wanted > MOST_IN_MEMORY:
                raise InvalidInput(
                    f"simulate.records is {records}, which take {wanted / 1e9:.3g} GB of memory; take fewer, or keep them "
                    "in a file as they come (out)."
                )
            self.arrays = {name: np.zeros((total, *part.shape[1:])) for name, part in first.items()}
        else:
            s, size = self.system.nodes * self.system.units.length, run.checkpoint().size
            motion = self.system.motion
            self.stream = above.call("stream", out, motion, method, s, total, size, self._statistics(0.0), before)
        try:
            if before is not None:
                for i in range(0, len(before.times), BLOCK):
                    self._keep({name: part[i : i + BLOCK] for name, part in kept.items()}, before.checkpoint)
            if self.stream is not None:
                self.stream.named()
        except BaseException as error:
            if self.stream is not None:
                self.stream.abandon()
            if isinstance(error, OSError):
                raise files.refusal(Path(out), error) from None
            raise

    def _row(self) -> dict[str, Array]:
        """Return the present state as a record, each array with one row."""
        run, N, units = self.run, self.system.segments, self.system.units
        packed = np.append(run.V, 0.0).reshape(-1, 4)[: N + 1]  # of a ring without what stands twice
        measured = run.measures()
        kinetic, bending, twist, stretch, load = measured[:5] * units.energy
        supports, of_no_spring, dissipated, of_loads, of_supports = measured[11:] * units.energy
        self.load = load if self.load is None else self.load
        work = of_supports + of_loads + of_no_spring + (load - self.load)
        momentum = measured[5:8] * (units.mass * units.length / units.time)
        angular = measured[8:11] * (units.mass * units.length**2 / units.time)
        energies = (kinetic, bending, twist, stretch, supports, load, dissipated, work)
        row = {
            "time": run.t,
            "positions": run.state.x.reshape(-1, 3)[: N + 1] * units.length + units.origin,
            "velocities": packed[:, :3] * (units.length / units.time),
            "directors": run.state.d1.reshape(-1, 3)[1 : N + 1],
            "spins": packed[:-1, 3] / units.time,
            "momentum": momentum,
            "angular_momentum": angular + np.cross(units.origin, momentum),
            **dict(zip(ENERGIES, energies, strict=True)),
        }
        return {name: np.asarray(part, dtype=float)[None] for name, part in row.items()}

    def take(self) -> None:
        """Record the run's present state; raises ``OSError`` where the disk is full."""
        self._keep(self._row(), self.run.checkpoint())  # at once, should the user stop it here

    def _keep(self, rows: dict[str, Array], checkpoint: Array) -> None:
        n = self.n + len(rows["time"])
        if self.stream is not None:
            self.stream.write(self.n, rows, checkpoint)
        for name, part in self.arrays.items():
            part[self.n : n] = rows[name]
        self.checkpoint, self.n = checkpoint, n

    def _statistics(self, seconds: float) -> dict[str, Any]:
        counts = {"steps": self.run.steps, "newton_iterations": self.run.iterations, "halvings": self.run.halvings}
        return {"seconds": seconds, "records": self.records, **counts}

    def trajectory(self, status: Status, drift: float, seconds: float) -> Trajectory:
        """Return what was recorded, with the status that the energy allows."""
        n, statistics = self.n, self._statistics(seconds)
        arrays = self.arrays if self.stream is None else self.stream.energies()
        energy = MotionEnergy(**{name: arrays[name][:n] for name in ENERGIES}, least=self.system.motion.least_energy)
        if status.converged and not energy.drift <= drift:
            status = Status(
                "drift",
                f"The motion was followed to its end, but its energy drifts by {energy.drift:.2g} of what there is "
                f"(simulate.drift = {drift:g}); take smaller steps.",
            )
        if self.stream is not None:
            arrays = self.stream.finish(status, statistics)
            n = len(arrays["time"])
        parts = {name: arrays[name][:n] for name in RECORDED}
        return Trajectory(
            self.system.motion,
            self.method,
            status,
            self.system.nodes * self.system.units.length,
            arrays["time"][:n],
            energy=energy,
            checkpoint=self.checkpoint,
            statistics=statistics,
            **parts,
        )


def _parts(before: Trajectory) -> dict[str, Array]:
    """Return all records of a trajectory, by name."""
    own = {"time": before.times, **{name: getattr(before, name) for name in RECORDED}}
    return own | {name: getattr(before.energy, name) for name in ENERGIES}
