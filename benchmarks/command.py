"""The command: `darboux paper` for the first time and again, a first picture of a scenario, and what an import costs.

Each is a process of its own. The first `darboux paper` finds no compiled kernels (DARBOUX_CACHE is an empty folder) and
no list of fonts (MPLCONFIGDIR is another): a fresh machine with the installation left out. The second finds what the
first left.
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

from benchmarks.timing import Row, Spread, interleaved

FIRST_S, SECOND_S, IMPORT_MS, PICTURE_MS = 90.0, 15.0, 300.0, 3000.0
FIRST_SOLUTION = """
import darboux as dx
rod = dx.Rod(length=0.25, section=dx.Circle(radius=1e-3), material=dx.Material(E=1e6, nu=0.5, density=1e3))
dx.solve(dx.Equilibrium(rod, start=dx.Clamped(tangent=(1, 0, 0)), loads=[dx.Gravity()]))
"""


def rows(quick: bool) -> Iterator[Row]:
    yield from _imports(rounds=3 if quick else 11)
    yield from _paper(again=1 if quick else 3)


def _imports(rounds: int) -> Iterator[Row]:
    scripts = ("import numpy", "import numpy, darboux", FIRST_SOLUTION)
    programs = [[sys.executable, "-c", script] for script in scripts] + [[*_darboux(), "--help"]]
    with tempfile.TemporaryDirectory() as folder:
        stated = f"{folder}/cantilever.toml"
        _run([*_darboux(), "new", "cantilever", "--out", stated])
        programs += [[*_darboux(), verb, stated, "--out", f"{folder}/rod.png"] for verb in ("plot", "view")]
        times = interleaved(*(partial(_run, program) for program in programs), rounds=rounds)
    numpy, with_darboux, solution, help_, figure, scene = times
    for key, what, values, most in (
        ("import", "import darboux, beyond import numpy", with_darboux - numpy, IMPORT_MS),
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
        share = float(np.median(values) / np.median(numpy))
        yield Row(f"command.{key}", what, Spread.of(1e3 * values), "ms", most=most, guard=1.0 + share)


def _paper(again: int) -> Iterator[Row]:
    """Time the first run and the next ones."""
    with tempfile.TemporaryDirectory() as folder:
        own = {"DARBOUX_CACHE": f"{folder}/kernels", "MPLCONFIGDIR": f"{folder}/fonts", "MPLBACKEND": "Agg"}
        program = [*_darboux(), "paper", "--out", f"{folder}/paper-figures"]
        first = _run(program, own)
        next_ones = np.array([_run(program, own) for _ in range(again)])
    yield Row(
        "command.paper_first", "darboux paper, nothing compiled yet", Spread(first, first, first), "s", most=FIRST_S
    )
    yield Row("command.paper_again", "darboux paper, again", Spread.of(next_ones), "s", most=SECOND_S)


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
