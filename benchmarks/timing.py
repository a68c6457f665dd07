"""How everything here is timed: one process, one core, after compiling, A B A B ..., medians and their spread.

Two things are never timed one after the other but in turns, so that what else the machine does falls on both alike, and
the ratio is formed turn by turn. Turns are short, a hundredth of a second or one call, and many, so that the median is
of turns in which nothing else took the processor away. No minimum is taken, no cache is filled in secret: what is timed
is what a user calls.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Work = Callable[[], object]


@dataclass(frozen=True)
class Spread:
    """The median of several measurements, and their quartiles."""

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, values: NDArray[np.float64]) -> Spread:
        low, median, high = np.quantile(values, [0.25, 0.5, 0.75])
        return cls(float(median), float(low), float(high))


@dataclass(frozen=True)
class Row:
    """One line of the table.

    ``ours`` and ``theirs`` count in ``unit``; ``ratio`` is theirs over ours. The target is a least ratio or a largest
    value of ours. ``our_error`` and ``their_error`` measure what ``error_of`` says. ``guard`` is what is held against
    the last recorded run where there is no ratio: ours over the time of something else in the same run.
    """

    name: str
    what: str
    ours: Spread
    unit: str
    peer: str = ""
    theirs: Spread | None = None
    ratio: Spread | None = None
    least_ratio: float | None = None
    most: float | None = None
    our_error: float | None = None
    their_error: float | None = None
    error_of: str = ""
    guard: float | None = None
    note: str = ""

    @property
    def target(self) -> str:
        if self.least_ratio is not None:
            return f">= {self.least_ratio:g}x"
        return "" if self.most is None else f"<= {self.most:g} {self.unit}"

    @property
    def passed(self) -> bool | None:
        """Whether the target is met; None where there is none."""
        if self.least_ratio is not None:
            return self.ratio is not None and self.ratio.median >= self.least_ratio
        return None if self.most is None else self.ours.median <= self.most

    @property
    def cost(self) -> float | None:
        """What must not grow from one recorded run to the next: ours in units of something timed in the same run."""
        return 1.0 / self.ratio.median if self.ratio is not None else self.guard


@dataclass(frozen=True)
class Curve:
    """One curve of a plot: what was paid, each time as ``cost`` in the panel's unit, ``at`` a size or an error.

    ``panel`` is a key of ``plots.PANELS``; ``marks`` are short words beside the points.
    """

    panel: str
    label: str
    at: tuple[float, ...]
    cost: tuple[Spread, ...]
    peer: bool = False
    marks: tuple[str, ...] = ()


TURN = 0.01  # s


def seconds(work: Work, calls: int = 1) -> float:
    """Return the wall time of one of several calls in a row."""
    began = time.perf_counter()
    for _ in range(calls):
        work()
    return (time.perf_counter() - began) / calls


def calls_for(work: Work, span: float) -> int:
    """Return how many calls fill about ``span`` seconds; the first call, which may compile, is not counted."""
    work()
    return max(1, round(span / max(seconds(work), 1e-9)))


def interleaved(*works: Work, rounds: int, span: float = TURN) -> list[NDArray[np.float64]]:
    """Return the seconds per call (rounds,) of each work, timed in turns that take about ``span`` seconds each."""
    calls = [calls_for(work, span) for work in works]
    times = np.array([[seconds(work, n) for work, n in zip(works, calls, strict=True)] for _ in range(rounds)])
    return list(times.T)
