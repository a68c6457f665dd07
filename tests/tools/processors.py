"""The catalogue and the solver's tests with the machine code of other processors, and from disturbed states.

    make processors                     all that this machine can run
    make processors ARGS="v3 generic"   those named

A compiler for another processor fuses other multiplications and additions, and a BLAS for it sums in another order: results
differ in their last digits, and nothing else may. Each problem of the catalogue must give the same branch, status and index as
here and undisturbed. What is compiled is kept in build/processors.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "build" / "processors"
TESTS = "pendulum branches start ring cables symmetries collocation"
SEEDS = (1, 2, 3)  # of the disturbances


@dataclass(frozen=True)
class Processor:
    """Another processor: as numba names it, as OpenBLAS does, and the features that this machine needs to run its code."""

    name: str
    numba: str
    openblas: str
    needs: tuple[str, ...] = ()

    @property
    def environment(self) -> dict[str, str]:
        return {"NUMBA_CPU_NAME": self.numba, "NUMBA_CPU_FEATURES": "", "OPENBLAS_CORETYPE": self.openblas}


PROCESSORS = (
    Processor("generic", "generic", "Prescott", ("sse3",)),
    Processor("v2", "x86-64-v2", "Nehalem", ("sse4.2",)),
    Processor("v3", "x86-64-v3", "Haswell", ("avx2", "fma")),
    Processor("znver3", "znver3", "Zen", ("avx2", "fma", "sse4a", "vaes")),
    Processor("v4", "x86-64-v4", "SkylakeX", ("avx512f", "avx512dq", "avx512vl", "avx512bw", "avx512cd")),
)


def missing(processor: Processor) -> list[str]:
    """Return the features that this machine lacks."""
    from llvmlite import binding

    own = binding.get_host_cpu_features()
    return [feature for feature in processor.needs if not own.get(feature)]


def answers() -> dict[str, Any]:
    """Return the answer to each problem of the catalogue."""
    from tests.catalogue.problems import CATALOGUE
    from tests.rounding import answer

    return {entry.name: answer(entry.problem) for entry in CATALOGUE}


def in_process(environment: dict[str, str], *arguments: str) -> subprocess.CompletedProcess[str]:
    one_core = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MPLBACKEND": "Agg"}
    command = [sys.executable, "-m", *arguments]
    return subprocess.run(
        command, cwd=ROOT, env=os.environ | one_core | environment, capture_output=True, text=True, check=False
    )


def answered(environment: dict[str, str], seed: int | None = None) -> dict[str, Any]:
    """Return what `answers` returns in a process of its own."""
    with tempfile.NamedTemporaryFile(suffix=".json") as file:
        done = in_process(
            environment, "tests.tools.processors", "--answers", file.name, *([] if seed is None else [str(seed)])
        )
        if done.returncode != 0:
            raise RuntimeError(done.stderr)
        found: dict[str, Any] = json.loads(Path(file.name).read_text())
    return found


def differences(ours: dict[str, Any], theirs: dict[str, Any]) -> list[str]:
    """Return in words which answers differ, and in what."""
    from tests.catalogue.problems import CATALOGUE
    from tests.rounding import difference

    all_of_them = {e.name: difference(ours[e.name], theirs[e.name], e.family) for e in CATALOGUE}
    return [f"{name}: {words}" for name, words in all_of_them.items() if words]


def tried(processor: Processor, ours: dict[str, Any]) -> list[str]:
    """Return what went wrong on another processor: answers that differ, tests that fail."""
    environment = processor.environment | {"DARBOUX_JIT": "1", "DARBOUX_CACHE": str(KEPT / processor.name)}
    wrong = differences(ours, answered(environment))
    files = [*(f"tests/test_{name}.py" for name in TESTS.split()), "tests/frozen"]
    tests = in_process(environment, "pytest", "-q", "-p", "no:cacheprovider", *files)
    return wrong if tests.returncode == 0 else [*wrong, tests.stdout]


def main(names: list[str]) -> int:
    """Try the processors, a core each, and the disturbances where none is named; return 1 where an answer differs."""
    jobs: dict[str, Callable[[dict[str, Any]], list[str]]] = {}
    for processor in PROCESSORS:
        if names and processor.name not in names:
            continue
        if lacks := missing(processor):
            print(f"{processor.name}: left out, this machine lacks {', '.join(lacks)}", flush=True)
        else:
            jobs[processor.name] = partial(tried, processor)
    for seed in () if names else SEEDS:
        jobs[f"disturbed, seed {seed}"] = lambda ours, seed=seed: differences(ours, answered({}, seed))
    ours = answered({})
    failed = False
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        waiting = {pool.submit(job, ours): name for name, job in jobs.items()}
        for job in as_completed(waiting):
            wrong = job.result()
            failed = failed or bool(wrong)
            print("\n".join([f"{waiting[job]}: {'FAILED' if wrong else 'the same answers'}", *wrong]), flush=True)
    return int(failed)


def _write(path: str, seed: str | None = None) -> int:
    from tests.rounding import disturbed

    with nullcontext() if seed is None else disturbed(int(seed)):
        Path(path).write_text(json.dumps(answers()))
    return 0


if __name__ == "__main__":
    sys.exit(_write(*sys.argv[2:]) if sys.argv[1:2] == ["--answers"] else main(sys.argv[1:]))
