"""Any problem ends in an equilibrium that an independent balance confirms, or in words: never in an exception or a NaN.

DARBOUX_FUZZ=2000 (`make fuzz`) tries that many, drawn anew each time; the test run a hundred, always the same.
"""

from __future__ import annotations

import os
import time

import numpy as np
from hypothesis import HealthCheck, given, settings

import darboux as dx
from tests.strategies import problems

EXAMPLES = int(os.environ.get("DARBOUX_FUZZ", "0"))
LONGEST = 60.0  # s of the processor: a solve takes some hundredths, one that gives up at full length some seconds
CODES = {"converged", "no_convergence", "folded"}


@settings(
    max_examples=EXAMPLES or 100,
    derandomize=not EXAMPLES,
    deadline=None,
    database=None,
    print_blob=True,
    suppress_health_check=list(HealthCheck),
)
@given(problem=problems())
def test_any_problem_is_solved_or_said_why_not(problem: dx.Equilibrium) -> None:
    began = time.process_time()
    try:
        solution = dx.solve(problem, throw=False)
    except dx.InvalidInput:
        return
    assert solution.status.code in CODES
    assert time.process_time() - began < LONGEST
    assert np.all(np.isfinite(solution.curve.y))
    assert str(solution)
    if solution.converged:
        assert max(solution.balance.force, solution.balance.moment) < 1e-6, solution
        assert solution.error.tip <= 1e-8 * problem.rod.length
    else:
        assert solution.status.message.endswith((".", "?"))
        assert solution.load_factor < 1.0 or "settle" in solution.status.message
