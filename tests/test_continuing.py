"""Motions that are saved, stopped and continued: bit for bit what one run without a stop gives."""

from __future__ import annotations

import dataclasses
import os
import signal
from pathlib import Path

import numpy as np
import pytest

import darboux as dx
from darboux.dynamics.run import Run

ROD = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.5, GJ=0.8, EA=1e3, mass=1.0), natural=(0.0, 0.5, 1.0), stretch=True)
SHAKEN = dx.Moving(dx.Table([0, 0.1, 0.2, 0.4], [[0, 0, 0], [0.02, 0, 0], [0, 0, 0], [0.02, 0, 0]]))
RAMP = dx.Table([0, 0.4], [0, 2], "linear")
DAMPING = [dx.MassDamping(0.5), dx.KelvinVoigt(1e-3, 1e-3, 1e-4), dx.LinearDrag(0.1, 0.2)]
PULLED = dx.Equilibrium(ROD, end=dx.Pinned((0.2, 0.1, 0.7)), loads=[dx.Gravity()])
INEXTENSIBLE = dx.Equilibrium(dataclasses.replace(ROD, stretch=False), loads=[dx.Gravity()])
BUSY = dx.Motion(
    PULLED, 0.2, initial="equilibrium", start=SHAKEN, load_factor=RAMP, damping=DAMPING, release={"end": 0.07}
)
RUNS = {
    "midpoint": (BUSY, dx.ImplicitMidpoint(12, step=2e-3)),
    "midpoint, inextensible": (
        dx.Motion(INEXTENSIBLE, 0.2, rotary_inertia=0.01, spin=2.0),
        dx.ImplicitMidpoint(12, step=2e-3),
    ),
    "TR-BDF2": (BUSY, dx.TRBDF2(12, rtol=1e-4)),
    "TR-BDF2, equal steps": (BUSY, dx.TRBDF2(12, step=2e-3)),
    "Verlet": (BUSY, dx.StormerVerlet(12, step=5e-4)),
}


@pytest.fixture
def stop(monkeypatch: pytest.MonkeyPatch):
    """Let the user press Ctrl-C in the middle of the n-th record."""

    def at(n: int) -> None:
        checkpoint, calls = Run.checkpoint, []

        def counted(self: Run):
            calls.append(self)
            if len(calls) == n:
                os.kill(os.getpid(), signal.SIGINT)
            return checkpoint(self)

        monkeypatch.setattr(Run, "checkpoint", counted)

    yield at
    monkeypatch.undo()


@pytest.mark.skipif(os.name == "nt", reason="interrupts by a signal")
@pytest.mark.parametrize("name", RUNS)
def test_a_run_goes_on_from_a_file_as_if_it_had_not_been_stopped(name: str, stop, monkeypatch, tmp_path: Path) -> None:
    motion, method = RUNS[name]
    whole = dx.simulate(motion, method, records=10)
    assert whole.converged
    for n in (3, 7):  # before the release and after it
        stop(n)
        part = dx.simulate(motion, method, records=10)
        monkeypatch.undo()
        assert part.status.code == "stopped"
        assert not part.converged
        np.testing.assert_array_equal(part.times, whole.times[: n - 1])
        assert part != whole
        part.save(tmp_path / "part.nc")
        found = dx.open(tmp_path / "part.nc")
        assert found == part
        assert dx.simulate(motion, start_from=found) == whole
    whole.save(tmp_path / "whole.nc")
    assert dx.open(tmp_path / "whole.nc") == whole
    assert dx.simulate(motion, method, start_from=whole) == whole  # nothing is left to do


def test_a_finished_run_is_made_longer_with_the_steps_that_it_had() -> None:
    """2^-10 s, so that no time is rounded: the longer run is the one that was asked for at once."""
    step, method = 2.0**-9, None
    short = dx.Motion(PULLED, 64 * step, initial="equilibrium", load_factor=RAMP)
    method = dx.ImplicitMidpoint(12, step=step)
    long = dataclasses.replace(short, duration=128 * step)
    found = dx.simulate(long, start_from=dx.simulate(short, method, records=8))
    assert found == dx.simulate(long, method, records=16)
    default = dx.simulate(long, start_from=dx.simulate(short, dx.ImplicitMidpoint(12), records=8))
    assert default.statistics["steps"] == 2000


def test_equality_sees_every_part() -> None:
    one = dx.simulate(dx.Motion(INEXTENSIBLE, 0.02, rotary_inertia=0.01), dx.ImplicitMidpoint(6, step=2e-3), records=2)
    assert one != "a trajectory"
    assert dataclasses.replace(one, statistics=one.statistics | {"seconds": 7.0}) == one
    assert hash(dataclasses.replace(one)) == hash(one)
    changes: dict[str, object] = {"statistics": one.statistics | {"steps": 1}, "method": dx.ImplicitMidpoint(6)}
    changes["energy"] = dataclasses.replace(one.energy, work=np.nextafter(one.energy.work, 1.0))
    for part in dataclasses.fields(one):
        value = getattr(one, part.name)
        if isinstance(value, np.ndarray):
            changes[part.name] = np.nextafter(value, np.inf)
    for name, value in changes.items():
        assert dataclasses.replace(one, **{name: value}) != one, name


def test_what_can_not_be_continued_or_saved_says_so(tmp_path: Path) -> None:
    motion, method = RUNS["midpoint, inextensible"]
    done = dx.simulate(dataclasses.replace(motion, duration=0.02), method, records=2)
    for change, words in (
        ({"method": dx.ImplicitMidpoint(13)}, "go on with that"),
        ({"motion": dataclasses.replace(motion, spin=3.0)}, "only the duration may differ"),
        ({"motion": dataclasses.replace(motion, duration=0.01)}, "make it longer"),
        ({"start_from": "a.nc"}, "Trajectory"),
    ):
        given = {"motion": motion, "method": None, "start_from": done} | change
        with pytest.raises(dx.InvalidInput, match=words):
            dx.simulate(given.pop("motion"), given.pop("method"), **given)
    free = dx.simulate(dataclasses.replace(motion, duration=0.02, load_factor=np.cos), method, records=2)
    with pytest.raises(dx.InvalidInput, match=r"motion\.load_factor is a Python function"):
        free.save(tmp_path / "a.nc")
    short = dx.Table([0, 0.01], [0, 1])
    for change, field in (
        ({"load_factor": short}, "load_factor"),
        ({"damping": dx.LinearDrag(1, 1, VELOCITY)}, "fluid"),
    ):
        with pytest.raises(dx.InvalidInput, match=rf"{field} is a table from t = 0 to 0.01 s.*0\.2 s"):
            dataclasses.replace(motion, **change)
    assert not list(tmp_path.iterdir())


VELOCITY = dx.Table([0, 0.01], [[0, 0, 0], [1, 0, 0]])


# To the disk, as it goes


@pytest.fixture(scope="module")
def whole() -> dx.Trajectory:
    return dx.simulate(*RUNS["midpoint"], records=10)


def test_a_streamed_run_is_the_same_and_goes_on_in_a_file(whole, stop, monkeypatch, tmp_path: Path) -> None:
    import xarray

    motion, method = RUNS["midpoint"]
    path = tmp_path / "a.nc"
    assert dx.simulate(motion, method, records=10, out=path) == whole
    assert dx.open(path) == whole
    assert not dx.open(path).positions.flags.owndata  # it stays on the disk
    with xarray.open_dataset(path, engine="h5netcdf") as data:
        np.testing.assert_array_equal(data["positions"].values, whole.positions)
    stop(7)
    part = dx.simulate(motion, method, records=10, out=path)
    monkeypatch.undo()
    assert (part.status.code, len(part.times)) == ("stopped", 5)
    assert dx.open(path) == part
    assert dx.simulate(motion, start_from=part, out=path) == whole  # into the file that it reads
    assert [file.name for file in tmp_path.iterdir()] == ["a.nc"]


KILLED = """
import os, signal, sys
import darboux as dx
from darboux.dynamics.run import Run
from tests.test_continuing import RUNS
checkpoint, calls = Run.checkpoint, []
def counted(self):
    calls.append(self)
    if len(calls) == 7:
        os.kill(os.getpid(), signal.SIGKILL)
    return checkpoint(self)
Run.checkpoint = counted
dx.simulate(*RUNS["midpoint"], records=10, out=sys.argv[1])
"""


@pytest.mark.skipif(os.name == "nt", reason="interrupts by a signal")
def test_a_run_that_is_killed_goes_on_from_its_last_record(whole, tmp_path: Path) -> None:
    import subprocess
    import sys

    folder = Path(__file__).parent.parent
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])}
    subprocess.run([sys.executable, "-c", KILLED, str(tmp_path / "a.nc")], env=environment, check=False)
    found = dx.open(tmp_path / "a.nc.part")
    assert (found.status.code, len(found.times)) == ("stopped", 5)
    assert "broken off" in found.status.message
    assert dx.simulate(RUNS["midpoint"][0], start_from=found) == whole


def test_a_full_disk_loses_nothing(whole, monkeypatch, tmp_path: Path) -> None:
    from darboux.stream import Stream

    motion, method = RUNS["midpoint"]
    write = Stream.write

    def full(self, i, rows, checkpoint):
        if i == 4:
            raise OSError(28, "No space left on device")
        write(self, i, rows, checkpoint)

    monkeypatch.setattr(Stream, "write", full)
    part = dx.simulate(motion, method, records=10, out=tmp_path / "a.nc")
    monkeypatch.undo()
    assert part.status.code == "stopped"
    assert "a.nc can't be written (No space left on device)" in part.status.message
    np.testing.assert_array_equal(part.positions, whole.positions[:4])
    assert dx.open(tmp_path / "a.nc") == part
    assert dx.simulate(motion, start_from=part) == whole


@pytest.mark.skipif(os.name == "nt", reason="limits of a process")
def test_a_disk_without_room_is_said_before_the_run(whole, tmp_path: Path) -> None:
    import resource

    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, limits[1]))
    try:
        with pytest.raises(dx.InvalidInput, match=r"a\.nc can't be written .*make room"):
            dx.simulate(*RUNS["midpoint"], records=10, out=tmp_path / "a.nc")
        with pytest.raises(dx.InvalidInput, match=r"a\.nc can't be written .*make room"):
            whole.save(tmp_path / "a.nc")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    with pytest.raises(dx.InvalidInput, match="can't be written"):
        dx.simulate(*RUNS["midpoint"], out=tmp_path / "no" / "a.nc")
    with pytest.raises(dx.InvalidInput, match=r"load_factor is a Python function"):
        dx.simulate(dataclasses.replace(BUSY, load_factor=np.cos), out=tmp_path / "a.nc")
    assert not list(tmp_path.iterdir())
