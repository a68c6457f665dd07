"""A thousand different rods in one public call, `solve_many` by two threads, against a loop of `solve` in one.

Rubber filaments of figure 5's kind, each with its own length, radius, stiffness, natural curvature and end load, all cold.
Loop and batch take turns on parts of 50 rods, made anew for each, so that nothing that a problem remembers is used twice; a
ratio is formed for each part. It is the rate of the batch over that of the loop, and needs two processors that nothing else
uses: how much of them the batch had is given too, and how much more of them its threads take for a rod than the loop does.
Before the clock runs both sides solve a few rods. The answers must be the same, bit for bit.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from functools import partial

import numpy as np

import darboux as dx
from benchmarks.timing import Row, Spread

RODS, PART, THREADS = 1000, 50, 2
LEAST_RATIO = 1.8
METHODS = {dx.Collocation(): "to 1e-9", dx.Collocation(rtol=1e-6): "to 1e-6"}


def filaments(count: int, seed: int) -> list[dx.Equilibrium]:
    """Return so many different rods, always the same."""
    random = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        rubber = dx.Material(E=1e6 * random.uniform(0.5, 2.0), nu=0.5, density=1e3)
        radius, bend = 1e-3 * 10.0 ** random.uniform(-0.2, 0.2), tuple(random.uniform(-8.0, 8.0, 3))
        rod = dx.Rod(random.uniform(0.2, 0.3), dx.Circle(radius), rubber, natural=bend)
        force = tuple(random.uniform(-1e-3, 1e-3, 3))
        found.append(dx.Equilibrium(rod, dx.Clamped(tangent=(1, 0, 0)), loads=[dx.Gravity(), dx.EndForce(force)]))
    return found


def rows(quick: bool) -> Iterator[Row | str]:
    if len(os.sched_getaffinity(0)) < THREADS if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1) < THREADS:
        yield f"The batch was not timed: it needs {THREADS} processors."
        return
    for method, words in METHODS.items():
        yield _row(method, words, (RODS // 5 if quick else RODS) // PART)


def _row(method: dx.Collocation, words: str, parts: int) -> Row:
    solve = partial(dx.solve, method=method, throw=False)
    many = partial(dx.solve_many, method=method, threads=THREADS, throw=False)
    for problem in filaments(4, seed=parts):
        solve(problem)
    many(filaments(4, seed=parts))
    times = []
    for part in range(parts):
        turns = [lambda problems: [solve(problem) for problem in problems], many]
        order = (0, 1) if part % 2 == 0 else (1, 0)
        took, found = np.empty((2, 2)), {}
        for side in order:
            problems = filaments(PART, seed=part)
            wall, cpu = time.perf_counter(), time.process_time()
            found[side] = turns[side](problems)
            took[side] = time.perf_counter() - wall, time.process_time() - cpu
        if not all(np.array_equal(a.curve.y, b.curve.y) for a, b in zip(found[0], found[1], strict=True)):
            raise RuntimeError("the batch found other answers than the loop")
        times.append(took)
    (loop, loop_cpu), (batch, batch_cpu) = (np.array(times)[:, side].T for side in (0, 1))
    return Row(
        name=f"batch.{words.split()[-1]}",
        what=f"{parts * PART:,} different rods {words}, {THREADS} threads",
        ours=Spread.of(1e3 * batch / PART),
        unit="ms per rod",
        peer="a loop of solve",
        theirs=Spread.of(1e3 * loop / PART),
        ratio=Spread.of(loop / batch),
        least_ratio=LEAST_RATIO,
        note=f"the batch had {np.median(batch_cpu / batch):.2f} processors, and "
        f"takes {np.median(batch_cpu / loop_cpu):.2f} times as much of them for a rod",
    )
