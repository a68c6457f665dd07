"""The static solver of the working tree against that of an earlier commit, its base: CPU time now, then, and their ratio.

Both sides do the same work in a process each, warm, and take turns; which one begins changes from turn to turn. A ratio is
formed in every turn, base over now: above 1 the working tree is faster. The processes are started anew a few times, as where
one lies in memory is worth some per cent. CPU seconds are counted, those of the system for it included, so that what else
the machine does matters little. The error is the distance of the two tips over L. The base's source is taken from git into
build/, and keeps its compiled kernels there.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from benchmarks.timing import Row, Spread

BASE = "804699d91eb5eef3ad892053be97b8b607213e3e"
ROOT = Path(__file__).resolve().parent.parent
TURN = 0.05  # s of CPU that a turn of one side takes at least


@dataclass(frozen=True)
class Asked:
    """What is timed: its name among the worker's works, in words, the unit, how many of it in a second, turns per start."""

    work: str
    what: str
    unit: str
    per_second: float
    turns: int


WORKS = (
    Asked("figure5", "figure 5, cold, to 1e-9", "ms", 1e3, 10),
    Asked("force_10", "P L^2 / EI = 10, cold", "ms", 1e3, 10),
    Asked("force_1000", "P L^2 / EI = 1000, cold", "ms", 1e3, 10),
    Asked("weight_1e6", "w L^3 / EI = 1e6, cold", "ms", 1e3, 6),
    Asked("two_turns", "two turns of an end moment, cold", "ms", 1e3, 6),
    Asked("warm", "figure 5 from its solution, the load changed by 1 %", "ms", 1e3, 10),
    Asked("iteration", "a Newton iteration per element, 4 stages, 200 elements", "us", 1e6 / 200, 10),
    Asked("discrete_50", "DiscreteRod(50) on figure 5", "ms", 1e3, 6),
    Asked("first_solution", "a new process solves figure 5, kernels compiled before", "s", 1.0, 2),
    Asked("command", "darboux solve cantilever.toml -q", "s", 1.0, 2),
)


class Side:
    """A worker process with the darboux of one source folder."""

    def __init__(self, source: Path, folder: str) -> None:
        variables = {"PYTHONPATH": os.pathsep.join([str(source), str(ROOT)]), "MPLBACKEND": "Agg"}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.core_worker", folder],
            env=os.environ | variables,
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        package = self._answer().get("package", "")
        if Path(package) != source / "darboux":
            raise RuntimeError(f"the worker for {source} found {package}")

    def __enter__(self) -> Side:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.process.kill()
        self.process.communicate()

    def _answer(self) -> dict[str, Any]:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            raise RuntimeError("a worker ended before it answered")
        return dict(json.loads(line))

    def seconds(self, work: str, calls: int = 1) -> tuple[float, Any]:
        """Return the CPU seconds of a call, and the tip over L where the work finds one."""
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps({"work": work, "calls": calls}) + "\n")
        self.process.stdin.flush()
        told = self._answer()
        if "error" in told:
            raise LookupError(told["error"])
        return told["seconds"], told["tip"]


def base() -> Path:
    """Return the base's source folder, from git where it is not there yet."""
    folder = ROOT / "build" / f"base-{BASE[:7]}"
    if not folder.exists():
        try:
            packed = subprocess.run(["git", "archive", BASE, "src"], cwd=ROOT, capture_output=True, check=False)
        except OSError as error:
            raise LookupError(f"git does not run: {error}") from error
        if packed.returncode != 0:
            raise LookupError(packed.stderr.decode().strip())
        folder.parent.mkdir(exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent) as unpacked:
            with tarfile.open(fileobj=io.BytesIO(packed.stdout)) as archive:
                archive.extractall(unpacked, filter="data")
            _lend_kernels(Path(unpacked) / "src")
            Path(unpacked, "src").rename(folder)
    return folder


def _lend_kernels(source: Path) -> None:
    """Give the base our compiled kernels where its kernels have the same source: they need not be compiled again."""
    ours, theirs = (folder / "darboux" / "kernels" for folder in (ROOT / "src", source))
    names = {path.name for path in (*ours.glob("*.py"), *theirs.glob("*.py"))}
    same = all((ours / n).exists() and (theirs / n).exists() for n in names) and all(
        (ours / n).read_bytes() == (theirs / n).read_bytes() for n in names
    )
    if same and (ours / "__pycache__").exists():
        shutil.copytree(ours / "__pycache__", theirs / "__pycache__")


def rows(quick: bool) -> Iterator[Row | str]:
    try:
        sources = {"now": ROOT / "src", "base": base()}
    except LookupError as error:
        yield f"The solver was not timed against commit {BASE[:7]}, which is not to be had here: {error}"
        return
    times: dict[str, list[tuple[float, float]]] = {asked.work: [] for asked in WORKS}
    apart: dict[str, float] = {}
    missing: dict[str, str] = {}
    for _ in range(1 if quick else 3):
        with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
            sides = {name: stack.enter_context(Side(source, folder)) for name, source in sources.items()}
            for asked in WORKS:
                try:
                    found, apart[asked.work] = _turns(sides, asked, quick)
                    times[asked.work] += found
                except LookupError as error:
                    missing[asked.work] = f"{asked.what}: not timed, {error}"
    for asked in WORKS:
        if asked.work not in missing:
            yield _row(asked, np.array(times[asked.work]), apart[asked.work])
    yield from missing.values()


def _turns(sides: dict[str, Side], asked: Asked, quick: bool) -> tuple[list[tuple[float, float]], float]:
    """Return CPU seconds per call (now, base) turn by turn, and how far the tips are apart."""
    once = {name: side.seconds(asked.work) for name, side in sides.items()}
    calls = max(1, round(TURN / max(min(seconds for seconds, _ in once.values()), 1e-9)))
    tips = [tip for _, tip in once.values()]
    found = []
    for turn in range(max(2, asked.turns // 3) if quick else asked.turns):
        order = list(sides) if turn % 2 == 0 else list(sides)[::-1]
        took = {name: sides[name].seconds(asked.work, calls)[0] for name in order}
        found.append((took["now"], took["base"]))
    return found, float("nan") if None in tips else float(np.linalg.norm(np.subtract(*tips)))


def _row(asked: Asked, times: Any, apart: float) -> Row:
    now, then = asked.per_second * times.T
    return Row(
        name=f"core.{asked.work}",
        what=asked.what,
        ours=Spread.of(now),
        unit=asked.unit,
        peer=f"commit {BASE[:7]}",
        theirs=Spread.of(then),
        ratio=Spread.of(then / now),
        our_error=None if np.isnan(apart) else apart,
        error_of="tip / L, now against base",
    )
