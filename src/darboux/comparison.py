"""One problem, many methods: by how much independent theories agree."""

from __future__ import annotations

import io
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from darboux import above, checks
from darboux.checks import checked_call
from darboux.errors import InvalidInput
from darboux.kernels.jit import announced
from darboux.problem import Equilibrium
from darboux.solution import EquilibriumSolution, same_branch
from darboux.statics.solve import Method, checked_method

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.table import Table

SAMPLES = 401  # points along s at which centrelines are held against each other
SAME = 1e-6  # two continuous answers closer than this, relative to L, are the same curve
ROUNDING = 1e-11  # over L
ANOTHER = 0.02  # a continuous answer further off than this is another equilibrium, or not solved


@dataclass(frozen=True)
class Distance:
    """How far an answer is from the reference: centrelines relative to L; end moments and elastic energy relatively."""

    centreline: float
    tip: float
    moment: float
    energy: float


@dataclass(frozen=True, eq=False)
class Entry:
    """One method's part: its solution, its distance from the reference, its observed order, its time in s."""

    solution: EquilibriumSolution
    distance: Distance
    order: float | None
    seconds: float

    @property
    def name(self) -> str:
        """The method, as the table shows it."""
        return str(self.solution.method)


@dataclass(frozen=True, eq=False)
class Comparison:
    """The answers of several methods to one problem, held against the one with the smallest estimated error."""

    problem: Equilibrium
    entries: tuple[Entry, ...]
    reference: int
    unlike: tuple[str, ...]

    def __getitem__(self, i: int) -> EquilibriumSolution:
        return self.entries[i].solution

    def distance(self, i: int, j: int) -> Distance:
        """Return the distance of answer i from answer j."""
        return distance(self.entries[i].solution, self.entries[j].solution)

    def view(self, **options: Any) -> Any:
        """Show all answers in one space, the reference first; the options are ``EquilibriumSolution.view``'s."""
        return above.call("view", self, **options)

    @property
    def verdict(self) -> str:
        """What the numbers say, in words."""
        reference = self.entries[self.reference]
        others = [entry for i, entry in enumerate(self.entries) if i != self.reference]
        sentences = [*self.unlike]
        sentences += [
            f"{x.name} did not converge: {x.solution.status.message}" for x in self.entries if not x.solution.converged
        ]
        sentences += [_sentence(entry, reference) for entry in others if entry.solution.converged]
        return " ".join(sentences)

    def table(self, title: str = "") -> Table:
        """Return the table as a rich renderable, with the verdict below it; it fits a screen of 80 columns."""
        from rich import box
        from rich.table import Table
        from rich.text import Text

        reference = self.entries[self.reference].name
        table = Table(
            title=Text(
                f"{title or 'Agreement of the methods'}\nDistance from {reference}: the centreline's largest and the tip's, "
                "over L; end moments and elastic energy, relative."
            ),
            title_justify="left",
            caption=Text(self.verdict),
            caption_justify="left",
            box=box.SIMPLE_HEAD,
            padding=(0, 1, 0, 0),
        )
        table.add_column("method", overflow="fold", min_width=16)
        for column in ("max |dr|/L", "tip |dr|/L", "moments", "energy", "order", "time"):
            table.add_column(column, justify="right", no_wrap=True)
        for i, entry in enumerate(self.entries):
            gap, solution = entry.distance, entry.solution
            numbers = [f"{value:.1e}" for value in (gap.centreline, gap.tip, gap.moment, gap.energy)]
            name = entry.name if solution.model == self.problem.rod.model else f"{entry.name} ({solution.model})"
            name += "" if solution.converged else " (not converged)"
            order = "" if entry.order is None else f"{entry.order:.2f}"
            cells = ["reference", "", "", ""] if i == self.reference else numbers
            table.add_row(name, *cells, order, f"{entry.seconds:.2g} s")
        return table

    def plot(self, ax: Any = None) -> Axes:
        """Draw the centrelines over each other, and in an inset their distance from the reference along s, over L.

        ``ax`` are plain axes of Matplotlib, with your own settings; small ones get no inset. None: a new figure of
        ``pyplot``'s in our style. Returns the axes.
        """
        return above.call("plot", self, ax=ax)

    def _repr_html_(self) -> str:
        return above.call("page", self)

    def __rich__(self) -> Table:
        return self.table()

    def __str__(self) -> str:
        from rich.console import Console

        text = io.StringIO()
        Console(file=text, width=100, no_color=True).print(self.table())
        return text.getvalue().rstrip()


@checked_call
@announced
def compare(
    problem: Equilibrium, methods: Sequence[Any], *, unlike_models: str = "refuse", order: bool = True
) -> Comparison:
    """Solve one problem by several methods and say by how much they agree.

        max |dr| / L = max_s |r_i(s) - r_ref(s)| / L,   order = log2(e(N) / e(2 N)), e(N) the first of these

    Arguments: ``problem`` an ``Equilibrium``; ``methods`` two or more methods; ``unlike_models`` "refuse", or "mark" to
    let a method that can't state the problem's stretch or shear solve it without, which the table and the verdict then
    say; ``order`` whether methods with a resolution are solved once more with twice of it. Returns a ``Comparison``.
    Raises ``InvalidInput`` where a method can't state the problem.
    """
    checks.instance("compare.problem", problem, Equilibrium, "an Equilibrium")
    checks.choice("compare.unlike_models", unlike_models, ("refuse", "mark"))
    if not isinstance(methods, list | tuple) or len(methods) < 2:
        raise InvalidInput(f"compare.methods is {checks.shown(methods)}; it must be a list of two or more methods.")
    chosen = [checked_method(f"compare.methods[{i}]", method) for i, method in enumerate(methods)]
    stated = [_stated(problem, method, unlike_models) for method in chosen]
    unlike = tuple(
        f"Unlike models: {method} solves the {own.rod.model} rod, not the one described ({problem.rod.model})."
        for method, own in zip(chosen, stated, strict=True)
        if own.rod.model != problem.rod.model
    )
    timed = [_timed(method, own) for method, own in zip(chosen, stated, strict=True)]
    solutions = [solution for solution, _ in timed]
    reference = min(range(len(solutions)), key=lambda i: _trust(solutions[i], problem))
    entries = tuple(
        Entry(
            solution,
            distance(solution, solutions[reference]),
            _order(method, own, solution, solutions[reference]) if order and i != reference else None,
            seconds,
        )
        for i, (method, own, (solution, seconds)) in enumerate(zip(chosen, stated, timed, strict=True))
    )
    return Comparison(problem, entries, reference, unlike)


def _sentence(entry: Entry, reference: Entry) -> str:
    """Say how far a converged answer is from the reference, and what that means."""
    gap = entry.distance.centreline
    pair = f"{entry.name} and {reference.name}"
    if entry.solution.model != reference.solution.model:
        return f"{pair} are {gap:.1e} L apart, the difference of their models in it."
    if entry.order is not None and gap <= ANOTHER:
        return f"{entry.name} is {gap:.1e} L away and closes in with order {entry.order:.2f}."
    if gap <= SAME:
        return f"{pair} agree to {gap:.1e} L."
    if gap <= ANOTHER or _closing_in(entry):
        return f"{pair} are {gap:.1e} L apart."
    return f"{pair} do not agree: they are {gap:.1e} L apart, so they found different equilibria."


def _closing_in(entry: Entry) -> bool:
    """Return whether a coarse answer far away comes clearly nearer when its resolution is doubled."""
    return entry.order is not None and entry.order > 0.5


def distance(a: EquilibriumSolution, b: EquilibriumSolution) -> Distance:
    """Return the distance of the answers a and b, relative to b."""
    L = b.problem.rod.length
    s = np.linspace(0.0, L, SAMPLES)
    ends = np.array([0.0, L])
    largest = float(np.max(np.linalg.norm(b.m(s), axis=1)))
    moment = float(np.max(np.linalg.norm(a.m(ends) - b.m(ends), axis=1)))
    gap = abs(a.energy.elastic - b.energy.elastic)
    return Distance(
        float(np.max(np.linalg.norm(a.r(s) - b.r(s), axis=1))) / L,
        float(np.linalg.norm(a.tip - b.tip)) / L,
        moment / largest if largest > 0.0 else moment,
        gap / b.energy.elastic if b.energy.elastic > 0.0 else gap,
    )


def _stated(problem: Equilibrium, method: Method, unlike_models: str) -> Equilibrium:
    """Return the problem, or its nearest form that the method can state where the caller lets it."""
    refusal = method.refuses(problem)
    if refusal is None:
        return problem
    if unlike_models == "mark":
        for changes in ({"shear": False}, {"shear": False, "stretch": False}):
            simpler = problem.with_rod(**changes)
            if method.refuses(simpler) is None:
                return simpler
    hint = (
        " Or compare unlike models knowingly, with unlike_models='mark'." if problem.rod.model != "inextensible" else ""
    )
    raise InvalidInput(refusal + hint)


def _timed(method: Method, problem: Equilibrium) -> tuple[EquilibriumSolution, float]:
    began = time.perf_counter()
    solution = method.solve(problem)
    return solution, time.perf_counter() - began


def _trust(solution: EquilibriumSolution, problem: Equilibrium) -> tuple[bool, bool, float]:
    """The reference solves the model described, converged, with the smallest estimated error."""
    error = solution.error.tip
    return (
        solution.model != problem.rod.model,
        not solution.converged,
        np.inf if error is None else max(error, 1e-12 * problem.rod.length),
    )


def _order(
    method: Any, problem: Equilibrium, solution: EquilibriumSolution, reference: EquilibriumSolution
) -> float | None:
    """Return the order by which the centreline closes in on the reference when the resolution is doubled.

    None where twice the resolution is no better, or finds another equilibrium.
    """
    if not hasattr(method, "refined") or solution.model != reference.model or not solution.converged:
        return None
    try:
        finer = method.refined(2).solve(problem)
    except InvalidInput:  # it is as fine as may be
        return None
    coarse, fine = (distance(answer, reference).centreline for answer in (solution, finer))
    if not finer.converged or fine <= ROUNDING or not same_branch(solution, finer):  # nothing that could close in
        return None
    return float(np.log2(coarse / fine))
