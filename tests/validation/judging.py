"""How an answer is held to the record: the error that each method may make, by its own order and resolution.

A continuous method has a tolerance, its ``rtol``. A discrete rod is of second order: two resolutions give its error,
E = |y_N - y_2N| / 3, and its extrapolation (4 y_2N - y_N) / 3 must meet the record within a quarter of E. A method of
first order would miss by 2 E, one with an order and a half by 0.8 E. Frequencies of ``natural_modes`` are of order 4, so
that 15 stands for 3 there.
"""

from __future__ import annotations

import dataclasses
import json
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import darboux as dx
from tests.validation.record import Digits

Array = NDArray[np.float64]
Read = Callable[[Any], Any]

COLLOCATION, SHOOTING, ELASTICA, DISCRETE = dx.Collocation(), dx.Shooting(), dx.Elastica(), dx.DiscreteRod()
ALL = (COLLOCATION, SHOOTING, ELASTICA, DISCRETE)
FALLING = dx.DiscreteRod()  # leaves an unstable shape, as `Collocation` does
STABLE_SIDE = (COLLOCATION, FALLING)

ALLOWED = {"Collocation": 1.0, "Shooting": 10.0, "Elastica": 10.0}  # times rtol, which Shooting's counts for each step
SHARE = 0.25  # of the error of the finer discrete rod: how far off its extrapolation may be
NEAR = 1e-4  # relative: how near to a critical load a continuous method counts unstable directions, its path being followed to 1e-6
SETTLED = 1e-8  # what an iteration leaves of a discrete rod, as far as it is extrapolated


@dataclass(frozen=True)
class Statement:
    """A case as the library states it: a problem, what is read from its answer (dimensionless), and the digits of that.

    ``segments`` is the coarser of the two discrete rods, ``methods`` those that claim the case,
    ``start`` where the solve sets out from.
    """

    case: str
    name: str
    problem: Any
    what: str
    read: Read
    exact: Digits
    methods: tuple[Any, ...] = ALL
    segments: int = 64
    long: bool = False
    start: Any = None

    def __str__(self) -> str:
        return f"{self.case} {self.name}".strip()


def through_methods(statements: Iterable[Statement]) -> Any:
    """Return the mark that runs a test over every statement by every method that claims it."""
    rows = [
        pytest.param(statement, method, id=f"{statement}, {method}", marks=[pytest.mark.long] if statement.long else [])
        for statement in statements
        for method in statement.methods
        if method.refuses(statement.problem) is None
    ]
    return pytest.mark.parametrize(("statement", "method"), rows)


@dataclass(frozen=True)
class Row:
    """One line of the table: what was compared, and the outcome."""

    case: str
    name: str
    what: str
    method: str
    exact: list[float]
    ours: list[float]
    error: float
    tolerance: float
    resolution: str
    seconds: float
    bracket: bool = False  # the answer lies between the two of ours, whose half distance the error is


@dataclass
class Judge:
    """Compares, notes the row for the page, and asserts."""

    note: Callable[[str, object], None]

    def __call__(self, statement: Statement, method: Any) -> None:
        """Solve the statement by the method and hold its answer to the record."""
        if isinstance(method, dx.DiscreteRod):
            self.discrete(
                statement.case,
                statement.name,
                statement.what,
                str(method).replace("(100", "("),
                lambda N: statement.read(dx.solve(statement.problem, dataclasses.replace(method, segments=N))),
                statement.exact,
                statement.segments,
            )
        else:
            allowed = ALLOWED[type(method).__name__] * method.rtol
            self.continuous(
                statement, type(method).__name__, lambda: statement.read(dx.solve(statement.problem, method, start=statement.start)),
                allowed, f"rtol {method.rtol:g}",
            )  # fmt: skip

    def continuous(
        self, statement: Statement, method: str, answer: Callable[[], Any], allowed: float, resolution: str
    ) -> None:
        """Hold an answer to the record within what is allowed, relative to the largest of its values or to 1."""
        began = time.perf_counter()
        ours = np.atleast_1d(np.array(answer(), dtype=float))
        seconds = time.perf_counter() - began
        exact = statement.exact
        scale = max(1.0, float(np.max(np.abs(exact.value))))
        error = float(np.max(np.abs(ours - exact.value))) / scale
        tolerance = allowed + exact.uncertainty / scale
        self._keep(
            Row(
                statement.case, statement.name, statement.what, method, exact.value.tolist(), ours.tolist(),
                error, tolerance, resolution, seconds,
            )
        )  # fmt: skip
        assert error <= tolerance, f"{ours} for {exact.value}: {error:.2e} off, {tolerance:.2e} allowed"

    def discrete(
        self,
        case: str,
        name: str,
        what: str,
        method: str,
        answer: Callable[[int], Any],
        exact: Digits,
        segments: int,
        settled: float = SETTLED,
        order: int = 2,
    ) -> None:
        """Hold the answers on N and 2 N segments to the record: the error and the order at once."""
        began = time.perf_counter()
        coarse, fine = (np.atleast_1d(np.array(answer(N), dtype=float)) for N in (segments, 2 * segments))
        seconds = time.perf_counter() - began
        scale = max(1.0, float(np.max(np.abs(exact.value))))
        gain = 1.0 / (2.0**order - 1.0)
        estimate = float(np.linalg.norm(fine - coarse)) * gain / scale
        left = float(np.linalg.norm(fine + gain * (fine - coarse) - exact.value)) / scale
        off = float(np.linalg.norm(fine - exact.value)) / scale
        sure = settled + exact.uncertainty / scale
        self._keep(
            Row(
                case, name, what, method, exact.value.tolist(), fine.tolist(), off, (1.0 + SHARE) * estimate + sure,
                f"{segments}, {2 * segments} segments", seconds,
            )
        )  # fmt: skip
        found = np.log2((np.linalg.norm(coarse - exact.value) / scale + 1e-300) / (off + 1e-300))
        assert left <= SHARE * estimate + sure, (
            f"{fine} for {exact.value}: extrapolated {left:.2e} off, estimated error {estimate:.2e}; order {found:.2f}, declared {order}"
        )

    def between(self, case: str, name: str, what: str, method: Any, index: Callable[[float], Any], exact: Digits,
                width: float, sides: tuple[Any, Any] = (0, 1)) -> None:  # fmt: skip
        """Hold a critical value between two others, a relative ``width`` to either side, where the answers differ as they should."""
        began = time.perf_counter()
        critical = float(exact.value[0])
        found = tuple(index(critical * (1.0 + sign * width)) for sign in (-1.0, 1.0))
        ours = [critical * (1.0 - width), critical * (1.0 + width)]
        rtol = f"rtol {method.rtol:g}" if hasattr(method, "rtol") else f"{method.segments} segments"
        self._keep(
            Row(case, name, what, type(method).__name__, [critical], ours, width, width, rtol,
                time.perf_counter() - began, bracket=True)
        )  # fmt: skip
        assert found == sides, f"{found} on either side of {critical}, {sides} expected"

    def _keep(self, row: Row) -> None:
        self.note("validation", json.dumps(dataclasses.asdict(row)))  # text passes between the processes of pytest
