"""One call for many problems, by several threads: compiled kernels run side by side, what is between them in turn."""

from __future__ import annotations

import contextvars
import os
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, wait
from threading import Event, Lock
from typing import Any

from darboux import checks
from darboux.checks import checked_call
from darboux.errors import InvalidInput, NotConverged
from darboux.kernels.jit import announced
from darboux.problem import Equilibrium
from darboux.solution import EquilibriumSolution
from darboux.statics import load_path
from darboux.statics.collocation import Collocation
from darboux.statics.solve import Method, checked_method, refusal

Solutions = list[EquilibriumSolution | None]

MOST_THREADS = 1024
PATIENCE = 0.1  # s between two looks for Ctrl-C, which not every system lets interrupt a wait
MOST_NAMED = 5  # of the problems that did not converge


class BatchStopped(KeyboardInterrupt):
    """Ctrl-C in ``solve_many``: ``solutions`` in the problems' order, None for those that were not reached."""

    def __init__(self, solutions: Solutions) -> None:
        done = sum(solution is not None for solution in solutions)
        super().__init__(f"stopped after {done} of {len(solutions)} problems; their solutions are in .solutions.")
        self.solutions = solutions


@checked_call
@announced
def solve_many(
    problems: Iterable[Equilibrium],
    method: Any = None,
    *,
    threads: int | None = None,
    throw: bool = True,
    progress: Callable[[int, int], object] | None = None,
) -> list[EquilibriumSolution]:
    """Solve many problems as ``solve`` does one, by several threads.

    The answers are those of ``solve``, bit for bit, whatever the number of threads. One that does not converge stops none of
    the others.

    Arguments: ``problems`` any number of ``Equilibrium``; ``method`` as for ``solve``, the same for all; ``threads`` how many
    are solved at once (None: as many as there are processors by ``Collocation``, one by other methods, which spend
    their time in Python, where threads take turns); ``throw`` whether it raises in the end where some did not
    converge; ``progress`` None, or what is called as ``progress(done, total)`` after each, by one thread at a time. A load
    that is a function of the shape is called by several threads at once. Returns a list of ``EquilibriumSolution`` in the
    order of the problems. Raises ``InvalidInput``, which names the problem as in ``problems[17]``, before any is solved where
    it can be known by then; ``NotConverged``, unless ``throw`` is False, whose ``solution`` is the first that did not
    converge and whose ``solutions`` are all; on Ctrl-C a ``KeyboardInterrupt`` whose ``solutions`` has what was done,
    and None for the rest.
    """
    method = checked_method("solve_many.method", Collocation() if method is None else method)
    if threads is None:
        threads = _processors() if isinstance(method, Collocation) else 1
    else:
        threads = checks.whole("solve_many.threads", threads, 1, MOST_THREADS)
    if progress is not None and not callable(progress):
        raise InvalidInput(
            f"solve_many.progress is {checks.shown(progress)}; it must be a function of two numbers, such as print."
        )
    batch = _Batch(_checked(problems, method), method, progress)
    batch.run(min(threads, len(batch.problems)))
    solutions = [solution for solution in batch.solutions if solution is not None]
    failed = [i for i, solution in enumerate(solutions) if not solution.converged]
    if throw and failed:
        first = solutions[failed[0]]
        raise NotConverged(_sentence(first, failed, len(solutions)), first, solutions)
    return solutions


def _checked(problems: Iterable[Equilibrium], method: Method) -> list[Equilibrium]:
    """Return the problems as a list, all of which the method can state."""
    if isinstance(problems, Equilibrium) or not hasattr(problems, "__iter__"):
        hint = " For one problem there is solve." if isinstance(problems, Equilibrium) else ""
        raise InvalidInput(f"solve_many.problems is {checks.shown(problems)}; it must be a list of Equilibrium.{hint}")
    listed = list(problems)
    for i, problem in enumerate(listed):
        checks.instance(f"solve_many.problems[{i}]", problem, Equilibrium, "an Equilibrium")
        refused = refusal(problem, method)
        if refused:
            raise InvalidInput(f"problems[{i}]: {refused}")
    return listed


def _processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _sentence(first: EquilibriumSolution, failed: list[int], total: int) -> str:
    sentence = f"problems[{failed[0]}]: {first.status.next_in_python}"
    if len(failed) == 1:
        return f"{sentence} All others of {total} converged: they are in .solutions."
    named = ", ".join(str(i) for i in failed[:MOST_NAMED]) + (", ..." if len(failed) > MOST_NAMED else "")
    return f"{sentence} {len(failed)} of {total} did not converge ({named}); all are in .solutions."


class _Batch:
    """Problems that are solved, each by the first thread that is free, and what came of them."""

    def __init__(self, problems: list[Equilibrium], method: Method, progress: Callable[[int, int], object] | None):
        self.problems, self.method, self.progress = problems, method, progress
        self.solutions: Solutions = [None] * len(problems)
        self.waiting = deque(range(len(problems)))
        self.done = 0
        self.one_at_a_time, self.stop = Lock(), Event()

    def run(self, threads: int) -> None:
        """Solve all; raises ``BatchStopped`` on Ctrl-C, and what a solve raised."""
        try:
            if threads <= 1:
                return self._work()
            with ThreadPoolExecutor(threads) as pool:
                try:
                    # In copies of the caller's context, so that NumPy says of floating-point errors there what it says here.
                    working = [pool.submit(contextvars.copy_context().run, self._work) for _ in range(threads)]
                    while wait(working, PATIENCE).not_done:
                        pass
                finally:
                    self.stop.set()
            for each in working:
                each.result()
        except KeyboardInterrupt:
            raise BatchStopped(self.solutions) from None

    def _work(self) -> None:
        """Solve one problem after another, until none is waiting or all are stopped."""
        stopping = load_path.STOP.set(self.stop)
        try:
            while not self.stop.is_set():
                try:
                    i = self.waiting.popleft()
                except IndexError:
                    return
                self._solve(i)
        except BaseException as error:
            if not (self.stop.is_set() and isinstance(error, KeyboardInterrupt)):
                self.stop.set()  # the other threads too
                raise
        finally:
            load_path.STOP.reset(stopping)

    def _solve(self, i: int) -> None:
        try:
            solution = self.method.solve(self.problems[i])
        except InvalidInput as error:  # what only shows on the way, as a load that is no number somewhere
            raise InvalidInput(f"problems[{i}]: {error}") from error
        except Exception as error:
            error.add_note(f"This came up in problems[{i}].")
            raise
        if solution.status.code == "stopped":
            raise KeyboardInterrupt
        with self.one_at_a_time:
            self.solutions[i] = solution
            self.done += 1
            if self.progress is not None:
                self.progress(self.done, len(self.problems))
