"""Many problems in one call: the answers of `solve` bit for bit, in order, whatever fails or is stopped on the way."""

from __future__ import annotations

import _thread
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import darboux as dx
from darboux.statics import load_path, solve_many
from tests.catalogue.problems import CATALOGUE

ROD = dx.Rod(length=1.0, section=dx.Stiffness(EI1=1.0, EI2=1.0, GJ=0.8, mass=1.0))
SOFT = dx.Rod(1.0, dx.Stiffness(EI1=1e3, EI2=1e3, GJ=1e3, EA=10.0), stretch=True)
FLATTENED = dx.Equilibrium(SOFT, loads=[dx.EndForce((0.0, 0.0, -20.0))])  # its stretch would be -1
COLUMN = dx.Equilibrium(ROD, loads=[dx.EndForce((0.01, 0.0, -12.0))])


def heavy(weight: float) -> dx.Equilibrium:
    return dx.Equilibrium(ROD, start=dx.Clamped(tangent=(1.0, 0.0, 0.0)), loads=[dx.Gravity((0.0, 0.0, -weight))])


def of_a_function(f: Callable[..., Any]) -> dx.Equilibrium:
    return dx.Equilibrium(ROD, loads=[dx.LineForce(f)])


def varied(count: int, seed: int) -> list[dx.Equilibrium]:
    """Problems of the catalogue, all different: springs, stations, rings, followers, loads of the shape, cables, buckled ones."""
    rng = np.random.default_rng(seed)
    chosen = rng.permutation(len(CATALOGUE))[:count]
    return [CATALOGUE[i].problem for i in chosen]


def same(one: dx.EquilibriumSolution, other: dx.EquilibriumSolution) -> bool:
    arrays = [(getattr(one.curve, name), getattr(other.curve, name)) for name in ("s", "y", "dy")]
    said = [(x.status, x.index, x.load_factor, x.error, x.elastic_parts) for x in (one, other)]
    return all(np.array_equal(a, b, equal_nan=True) for a, b in arrays) and said[0] == said[1]


@pytest.mark.slow
def test_eight_threads_find_what_a_loop_finds_bit_for_bit() -> None:
    problems = varied(60, seed=4)
    one_by_one = [dx.solve(problem, throw=False) for problem in problems]
    assert len({solution.curve.y.tobytes() for solution in one_by_one}) >= 55  # else the order were not seen
    order = np.random.default_rng(5).permutation(len(problems))
    # The very same problems: what they remember is shared by the threads. And copies, which remember nothing yet.
    for given in (problems, varied(60, seed=4)):
        together = dx.solve_many([given[i] for i in order], threads=8, throw=False)
        for i, solution in zip(order, together, strict=True):
            assert solution.problem is given[i]
            assert same(solution, one_by_one[i]), given[i]


@pytest.mark.parametrize(
    "method", [dx.Shooting(), dx.DiscreteRod(20), dx.Elastica(), dx.Collocation(rtol=1e-6)], ids=str
)
def test_any_method(method: Any) -> None:
    problems = [heavy(weight) for weight in np.linspace(0.5, 20.0, 12)]
    together = dx.solve_many(problems, method, threads=4)
    assert all(same(a, dx.solve(p, method)) for a, p in zip(together, problems, strict=True))
    assert [solution.method for solution in together] == [method] * 12


def test_by_one_thread_nothing_leaves_the_one_that_calls(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = set()

    def push(s: Any, r: Any, R: Any) -> Any:
        seen.add(threading.get_ident())
        return np.zeros_like(r)

    dx.solve_many([of_a_function(push)] * 2, threads=1)
    assert seen == {threading.get_ident()}
    dx.solve_many([of_a_function(push)] * 2, dx.DiscreteRod(5))  # which gains nothing by a second one
    assert seen == {threading.get_ident()}
    monkeypatch.setattr(solve_many, "_processors", lambda: 2)
    dx.solve_many([of_a_function(push)] * 2)
    assert len(seen) > 1


def test_what_does_not_converge_stops_nothing_else() -> None:
    problems = [heavy(1.0), FLATTENED, heavy(2.0), FLATTENED, heavy(3.0)]
    found = dx.solve_many(problems, threads=2, throw=False)
    assert [solution.converged for solution in found] == [True, False, True, False, True]
    with pytest.raises(dx.NotConverged, match=r"^problems\[1\]: .* 2 of 5 did not converge \(1, 3\)") as raised:
        dx.solve_many(problems, threads=2)
    assert all(same(a, b) for a, b in zip(raised.value.solutions, found, strict=True))
    assert raised.value.solution is raised.value.solutions[1]
    with pytest.raises(dx.NotConverged, match=r"^problems\[2\]: .* All others of 3 converged"):
        dx.solve_many([heavy(1.0), heavy(2.0), FLATTENED])


def test_what_can_not_be_stated_is_named_before_anything_is_solved() -> None:
    asked = []

    def push(s: Any, r: Any, R: Any) -> Any:
        asked.append(len(s))
        return np.zeros_like(r)

    wound = dx.Equilibrium(ROD, end=dx.Clamped(position=(0.0, 0.0, 0.9), twist=1e5))
    with pytest.raises(dx.InvalidInput, match=r"^problems\[2\]: "):
        dx.solve_many([of_a_function(push), heavy(1.0), wound])
    with pytest.raises(dx.InvalidInput, match=r"^solve_many.problems\[1\] is 3; it must be an Equilibrium"):
        dx.solve_many([of_a_function(push), 3])
    assert not asked


def test_what_shows_on_the_way_is_named_too() -> None:
    def nowhere(s: Any, r: Any, R: Any) -> Any:
        return np.full_like(r, np.nan) if np.max(np.abs(r[:, 2])) > 0.0 else np.zeros_like(r)

    class Broken:
        """A user's own method, with a mistake in it."""

        def refuses(self, problem: dx.Equilibrium) -> None:
            return None

        def solve(self, problem: dx.Equilibrium) -> dx.EquilibriumSolution:
            if problem is problems[2]:
                raise ZeroDivisionError("in my method")

            while threads > 1:  # as a long solve does; what went wrong in another ends it, and is what the user sees
                load_path.look()
            return dx.solve(problem)

    problems = [heavy(1.0), heavy(2.0), heavy(3.0)]
    for threads in (1, 3):
        with pytest.raises(dx.InvalidInput, match=r"^problems\[1\]: line_force.force is not finite"):
            dx.solve_many([heavy(1.0), of_a_function(nowhere), heavy(2.0)], threads=threads)
        with pytest.raises(ZeroDivisionError, match="in my method") as raised:
            dx.solve_many(problems, Broken(), threads=threads)
        assert raised.value.__notes__ == ["This came up in problems[2]."]


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("method", [dx.Collocation(), dx.Shooting(), dx.DiscreteRod(20)], ids=str)
def test_ctrl_c_stops_all_and_keeps_what_was_done(method: Any, threads: int) -> None:
    """The user presses it in the fifth of many problems, while other threads are within solves that would never end."""
    pressed = threading.Event()

    def progress(done: int, total: int) -> None:
        assert total == 400
        if done == 5:
            pressed.set()
            _thread.interrupt_main()

    with pytest.raises(KeyboardInterrupt, match=r"stopped after \d+ of 400 problems") as raised:
        dx.solve_many([heavy(1.0 + i) for i in range(400)], method, threads=threads, progress=progress)
    done = [i for i, solution in enumerate(raised.value.solutions) if solution is not None]
    assert pressed.is_set()
    assert 5 <= len(done) < 400
    assert all(same(raised.value.solutions[i], dx.solve(heavy(1.0 + i), method)) for i in done[:5])


def test_ctrl_c_reaches_into_the_solves_of_other_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    from darboux.statics import collocation_path

    kernel, calls = collocation_path.kernel.follow, []

    def patient(*given: Any) -> Any:
        """Return again and again without a step, as a kernel does in which Ctrl-C is looked for; not for ever."""
        calls.append(threading.get_ident())
        time.sleep(0.001)
        if len(set(calls)) == 2 and pressed.acquire(blocking=False):
            _thread.interrupt_main()
        return -1 if len(calls) < 5000 else kernel(*given)

    pressed = threading.Semaphore(1)
    monkeypatch.setattr(collocation_path.kernel, "follow", patient)
    with pytest.raises(KeyboardInterrupt) as raised:
        dx.solve_many([heavy(1.0), heavy(2.0)], threads=2)
    assert raised.value.solutions == [None, None]


def test_progress_counts_every_problem_once() -> None:
    seen: list[tuple[int, int]] = []
    dx.solve_many([heavy(1.0 + i) for i in range(9)], threads=4, progress=lambda *counted: seen.append(counted))
    assert seen == [(i, 9) for i in range(1, 10)]


def test_what_numpy_says_of_floating_point_errors_is_the_callers_choice() -> None:
    def push(s: Any, r: Any, R: Any) -> Any:
        seen.append(np.geterrcall())
        return np.zeros_like(r)

    seen: list[Any] = []
    with np.errstate(call=print):
        dx.solve_many([of_a_function(push)] * 2, threads=2)
    assert set(seen) == {print}


def test_none_at_all_and_an_iterator() -> None:
    assert dx.solve_many([]) == []
    assert len(dx.solve_many(heavy(x) for x in (1.0, 2.0))) == 2


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: dx.solve_many(heavy(1.0)), "it must be a list of Equilibrium. For one problem there is solve."),
        (lambda: dx.solve_many(3), "it must be a list of Equilibrium."),
        (lambda: dx.solve_many([], dx.Shooting), "solve_many.method is Shooting; .* Did you mean Shooting"),
        (lambda: dx.solve_many([], threads=0), "solve_many.threads is 0; it must be 1 or more."),
        (lambda: dx.solve_many([], threads=2.0), "solve_many.threads is 2.0; it must be a whole number"),
        (lambda: dx.solve_many([], progress=True), "solve_many.progress is True; it must be a function"),
        (lambda: dx.solve_many([], workers=2), "solve_many has no argument 'workers'"),
    ],
)
def test_mistakes(call: Callable[[], Any], words: str) -> None:
    with pytest.raises(dx.InvalidInput, match=words):
        call()


def test_columns_that_buckle_are_counted_alike() -> None:
    (found,) = dx.solve_many([COLUMN], threads=2)
    assert (found.index, same(found, dx.solve(COLUMN))) == (0, True)
