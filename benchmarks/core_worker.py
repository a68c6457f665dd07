"""Answers timing requests with the darboux that is first on the path: `core` starts one for the working tree, one for its base.

A request is a line of JSON, {"work": name, "calls": n}; the answer another, {"seconds": CPU s per call, "tip": places over L}, or
{"error": a sentence}. Works are stated by what a user calls, but for one Newton iteration, which reaches inside.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import darboux as dx
from benchmarks.command import FIRST_SOLUTION
from darboux.paper.cases import figure5
from tests import cases

ELEMENTS = 200
COMMAND = "from darboux.cli import main; main()"
Work = Callable[[], Any]


def solved(problem: dx.Equilibrium, method: Any = None) -> Work:
    return lambda: dx.solve(problem, method)


def warm() -> Work:
    problem = figure5()
    start = dx.solve(problem)
    more = dx.Equilibrium(problem.rod, problem.start, loads=[dx.Gravity((0, 0, -1.01 * 9.81))])
    return lambda: dx.solve(more, start=start)


def iteration() -> Work:
    """One of Newton's iterations on elements with four stages, as a solve takes it: eliminate, substitute, measure, move."""
    from darboux.statics.collocation_equations import Equations

    problem = cases.heavy(10.0)
    equations = Equations(problem, stages=4)
    mesh = equations.mesh_of(dx.solve(problem)).laid(np.linspace(0.0, 1.0, ELEMENTS + 1))

    return lambda: equations.newton(mesh, 1.0, 1.0, most=1)


def process(*words: str) -> Work:
    return lambda: subprocess.run([sys.executable, *words], check=True, capture_output=True)


def command() -> Work:
    folder = tempfile.mkdtemp(dir=sys.argv[1])
    process("-c", COMMAND, "new", "cantilever", "--out", f"{folder}/cantilever.toml")()
    return process("-c", COMMAND, "solve", f"{folder}/cantilever.toml", "-q")


WORKS: dict[str, Callable[[], Work]] = {
    "figure5": lambda: solved(figure5()),
    "force_10": lambda: solved(cases.tip_force(10.0)),
    "force_1000": lambda: solved(cases.tip_force(1000.0)),
    "weight_1e6": lambda: solved(cases.heavy(1e6)),
    "two_turns": lambda: solved(cases.rolled(2)),
    "warm": warm,
    "iteration": iteration,
    "discrete_50": lambda: solved(figure5(), dx.DiscreteRod(50)),
    "first_solution": lambda: process("-c", FIRST_SOLUTION),
    "command": command,
}


def processor_seconds() -> float:
    """CPU s of this process and of those that it has waited for."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def answered(request: dict[str, Any], ready: dict[str, Work]) -> dict[str, Any]:
    name = request["work"]
    if name not in ready:
        ready[name] = WORKS[name]()
        ready[name]()  # the first call, which may compile, is not counted
    work, found = ready[name], None
    began = processor_seconds()
    for _ in range(request["calls"]):
        found = work()
    took = (processor_seconds() - began) / request["calls"]
    solution = isinstance(found, dx.EquilibriumSolution)
    return {"seconds": took, "tip": (found.tip / found.problem.rod.length).tolist() if solution else None}


def main() -> None:
    ready: dict[str, Work] = {}
    print(json.dumps({"package": str(Path(dx.__file__).parent)}), flush=True)
    for line in sys.stdin:
        request = json.loads(line)
        try:
            told = answered(request, ready)
        except Exception as error:  # noqa: BLE001
            # What else is timed is still timed.
            told = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(told), flush=True)


if __name__ == "__main__":
    main()
