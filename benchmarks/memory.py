"""Prints how many KB a work on a mesh takes for each of its elements, by the largest size of its process: `collocation` starts it.

    python -m benchmarks.memory WORK ELEMENTS

The process has done the same on a small mesh before, so that what it loads is not counted. What kernels allocate is counted
too, which Python's tracing of memory does not see.
"""

from __future__ import annotations

import re
import resource
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

import darboux as dx
from darboux.statics.collocation_equations import CAREFUL, QUICK, Equations
from darboux.statics.collocation_path import follow
from tests import cases

PROBLEM = cases.heavy(10.0)
SMALL = 50


def iteration(elements: int) -> Callable[[], object]:
    equations = Equations(PROBLEM, CAREFUL.stages)
    mesh = equations.mesh_of(dx.solve(PROBLEM)).laid(np.linspace(0.0, 1.0, elements + 1))
    return lambda: equations.newton(mesh, 1.0, 1e-9, most=9)


def path(elements: int) -> Callable[[], object]:
    equations = Equations(PROBLEM, QUICK.stages)
    mesh = equations.unloaded().laid(np.linspace(0.0, 1.0, elements + 1))
    return lambda: follow(equations, mesh)


def solve(elements: int) -> Callable[[], object]:
    return lambda: dx.solve(PROBLEM, dx.Collocation(elements=elements // 2))


WORKS = {"newton": iteration, "path": path, "solve": solve}


def largest() -> float:
    """KB of memory; on Linux those of this program, where the system counts what its parent had too."""
    status = Path("/proc/self/status")
    if status.exists():
        return float(re.search(r"VmHWM:\s*(\d+) kB", status.read_text())[1])
    size = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return size / 1024.0 if sys.platform == "darwin" else float(size)


def main(name: str, elements: int) -> None:
    WORKS[name](SMALL)()
    work = WORKS[name](elements)
    before = largest()
    work()
    print((largest() - before) / elements)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
