"""The command: `darboux paper` for the first time and again, a first picture of a scenario, and what an import costs.

Each is a process of its own. The first `darboux paper` compiles its kernels when they are first called (DARBOUX_JIT), for
it finds none (DARBOUX_CACHE is an empty folder), and no list of fonts (MPLCONFIGDIR is another): a fresh machine without
a C compiler. The second takes the kernels that were built, and the list of fonts.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.timing import Row, Spread, interleaved

Array = NDArray[np.float64]

FIRST_S, SECOND_S, IMPORT_MS, PICTURE_MS = 90.0, 15.0, 300.0, 3000.0
FIRST_SOLUTION = """
import darboux as dx
rod = dx.Rod(length=0.25, section=dx.Circle(radius=1e-3), material=dx.Material(E=1e6, nu=0.5, density=1e3))
dx.solve(dx.Equilibrium(rod, start=dx.Clamped(tangent=(1, 0, 0)), loads=[dx.Gravity()]))
"""


def rows(quick: bool) -> Iterator[Row]:
    rounds = 3 if quick else 11
    scripts = ("import numpy", "import numpy, darboux", FIRST_SOLUTION)
    programs = [[sys.executable, "-c", script] for script in scripts] + [[*_darboux(), "--help"]]
    with tempfile.TemporaryDirectory() as folder:
        stated = f"{folder}/cantilever.toml"
        _run([*_darboux(), "new", "cantilever", "--out", stated])
        programs += [[*_darboux(), verb, stated, "--out", f"{folder}/rod.png"] for verb in ("plot", "view")]
        numpy, *times = interleaved(*(partial(_run, program) for program in programs), rounds=rounds)
    yardstick = float(np.median(numpy))
    yield from _imports(yardstick, times[0] - numpy, *times[1:])
    yield from _paper(yardstick, again=1 if quick else 3)


def _imports(
    numpy: float, with_darboux: Array, solution: Array, help_: Array, figure: Array, scene: Array
) -> Iterator[Row]:
    for key, what, values, most in (
        ("import", "import darboux, beyond import numpy", with_darboux, IMPORT_MS),
        ("help", "darboux --help", help_, None),
        ("first_solution", "a new process solves figure 5, kernels compiled before", solution, None),
        (
            "first_picture",
            "darboux plot cantilever.toml: solved and drawn, kernels compiled before",
            figure,
            PICTURE_MS,
        ),
        ("first_scene", "darboux view cantilever.toml: the same in space", scene, PICTURE_MS),
    ):
        share = float(np.median(values)) / numpy
        yield Row(f"command.{key}", what, Spread.of(1e3 * values), "ms", most=most, guard=1.0 + share)


def _paper(numpy: float, again: int) -> Iterator[Row]:
    """Time the first run and the next ones; ``numpy`` is what importing that takes, in the same run."""
    with tempfile.TemporaryDirectory() as folder:
        own = {"DARBOUX_CACHE": f"{folder}/kernels", "MPLCONFIGDIR": f"{folder}/fonts", "MPLBACKEND": "Agg"}
        program = [*_darboux(), "paper", "--out", f"{folder}/paper-figures"]
        first = _run(program, own | {"DARBOUX_JIT": "1"})
        next_ones = np.array([_run(program, own) for _ in range(again)])
    for key, what, times, most in (
        ("paper_first", "darboux paper, nothing compiled yet", np.array([first]), FIRST_S),
        ("paper_again", "darboux paper, again", next_ones, SECOND_S),
    ):
        guard = float(np.median(times)) / numpy
        yield Row(f"command.{key}", what, Spread.of(times), "s", most=most, guard=guard)


def _darboux() -> list[str]:
    """Return the installed command, or the same by the interpreter where only the source is at hand."""
    script = Path(sys.executable).parent / "darboux"
    return [str(script)] if script.exists() else [sys.executable, "-c", "from darboux.cli import main; main()"]


def _run(program: list[str], environment: Mapping[str, str] | None = None) -> float:
    """Return how long a program takes; raise with its last words where it fails."""
    began = time.perf_counter()
    done = subprocess.run(
        program, env=os.environ | dict(environment or {}), capture_output=True, text=True, check=False
    )
    took = time.perf_counter() - began
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(program)} failed:\n{done.stderr.strip()[-2000:]}")
    return took
