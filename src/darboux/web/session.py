"""One visitor's rod: which scenario, which values are asked for, which shape is shown, and how one goes to the other.

It knows nothing of the page. `step` and `compare` compute, in any thread but one at a time; the rest is quick.
"""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from darboux.comparison import distance
from darboux.errors import InvalidInput
from darboux.problem import Equilibrium
from darboux.scenario import Scenario
from darboux.solution import EquilibriumSolution
from darboux.statics.collocation import Collocation
from darboux.statics.discrete import DiscreteRod
from darboux.statics.elastica import Elastica
from darboux.statics.shooting import Shooting
from darboux.statics.solve import solve
from darboux.web import quantities, snap
from darboux.web.quantities import Quantity
from darboux.web.shape import Fields, Shape, sampled

METHOD = Collocation(rtol=1e-6)
STRIDE = 0.1  # of a slider's range, at first
NEAR = 0.2  # L: a shape that is further off than this from the last is not next to it ...
SMALL = 0.004  # ... where no slider moved by more than this part of its range
SAME = 0.02  # L: shapes between which nothing needs to be shown
THEORIES = (Shooting(), Elastica(), DiscreteRod(segments=40))


@dataclass(frozen=True)
class Frame:
    """What is shown next: the solution, its shape and its fields, how long the solve took in s; ``way`` and ``words`` of a snap."""

    solution: EquilibriumSolution
    shape: Shape
    fields: Fields
    seconds: float
    way: tuple[Shape, ...] = ()
    words: str = ""


@dataclass(frozen=True)
class Failure:
    """There is no new shape, and why."""

    words: str


@dataclass(frozen=True)
class Theory:
    """Another method's answer: its shape and its distance over L from the one shown, or the sentence why there is none."""

    name: str
    shape: Shape | None
    distance: float | None
    words: str


class Session:
    """The state of one page."""

    def __init__(self, name: str, scenario: Scenario) -> None:
        self.name, self.scenario = name, scenario
        self.base: Equilibrium = scenario.problem
        self.quantities: tuple[Quantity, ...] = quantities.of(self.base)
        self.by_key = {quantity.key: quantity for quantity in self.quantities}
        self.wanted: dict[str, float] = {quantity.key: quantity.value for quantity in self.quantities}
        self.values = dict(self.wanted)  # of the shape that is shown
        self.shown: EquilibriumSolution | None = None
        self.given_up: dict[str, float] | None = None
        self._stride = STRIDE

    # -- what is asked ------------------------------------------------------------------------------------------------

    def ask(self, key: str, value: float) -> str:
        """Ask for a value in SI; return the sentence that stands beside its field where it can't be, else nothing."""
        wanted = self.wanted | {key: value}
        try:
            self.by_key[key].checked(value)
            refusal = METHOD.refuses(quantities.changed(self.base, self.quantities, wanted))
        except InvalidInput as error:
            return str(error)
        if refusal is None:
            self.wanted = wanted
        return refusal or ""

    def ask_all(self, values: dict[str, float]) -> list[str]:
        """Ask for the values of a link, each alone if not together; return what can't be, in sentences."""
        unknown = [f"{self.name} has no {key!r}." for key in values if key not in self.by_key]
        sentences = []
        known = {key: value for key, value in values.items() if key in self.by_key}
        try:
            for key, value in known.items():
                self.by_key[key].checked(value)
            refusal = METHOD.refuses(quantities.changed(self.base, self.quantities, self.wanted | known))
            if refusal is None:
                self.wanted |= known
                return unknown
        except InvalidInput:
            pass
        sentences = [self.ask(key, value) for key, value in known.items()]
        return unknown + [sentence for sentence in sentences if sentence]

    @property
    def problem(self) -> Equilibrium:
        """The problem that is asked for."""
        return quantities.changed(self.base, self.quantities, self.wanted)

    @property
    def differences(self) -> dict[str, float]:
        """The values that are not the scenario's own."""
        return {q.key: self.wanted[q.key] for q in self.quantities if self.wanted[q.key] != q.value}

    @property
    def pending(self) -> bool:
        """True where what is shown is not what is asked for, and has not been tried."""
        return (self.shown is None or self.values != self.wanted) and self.given_up != self.wanted

    # -- what is computed ---------------------------------------------------------------------------------------------

    def step(self) -> Frame | Failure:
        """Go towards what is asked, as far as the shape next to what is shown goes; beyond its end, by a snap."""
        wanted, before, began = self.wanted, self.shown, time.perf_counter()
        if before is None:
            return self._begun(wanted, began)
        way = max(abs(q.place(wanted[q.key]) - q.place(self.values[q.key])) for q in self.quantities)
        while True:
            stride = min(way, self._stride)
            values = wanted if stride == way else self._between(wanted, stride / way)
            try:
                problem = quantities.changed(self.base, self.quantities, values)
            except InvalidInput:  # between two sets of values that can be, there may be some that can't
                values, problem, stride = wanted, self.problem, 0.0
            found = METHOD.beside(problem, before)
            if found is not None and not _less_stable(found, before) and _apart(found, before) <= NEAR:
                self._stride = min(2.0 * max(stride, SMALL), 1.0)
                return self._taken(found, values, wanted, began)
            if stride <= SMALL:
                return self._snapped(before, problem, found, values, wanted, began)
            self._stride = max(0.25 * stride, SMALL)

    def compare(self, solution: EquilibriumSolution) -> list[Theory]:
        """Solve what is shown by the other theories, and say how far they are."""
        found = []
        for method in THEORIES:
            name = str(method)
            try:
                refusal = method.refuses(solution.problem)
                other = None if refusal else solve(solution.problem, method, throw=False)
            except InvalidInput as error:
                refusal, other = str(error), None
            if other is None or not other.converged:
                found.append(Theory(name, None, None, refusal or (other.status.message if other else "")))
            else:
                found.append(Theory(name, sampled(other)[0], distance(other, solution).centreline, ""))
        return found

    def result(self) -> Scenario:
        """Return the scenario as it is now asked for, for a file."""
        return dataclasses.replace(self.scenario, problem=self.problem, motion=None, motion_method=None)

    def _begun(self, wanted: dict[str, float], began: float) -> Frame | Failure:
        """Return the first shape: what is asked for, or the scenario's own where a link's values are too far for one go."""
        own = {quantity.key: quantity.value for quantity in self.quantities}
        found = solve(self.problem, METHOD, throw=False)
        if found.converged or wanted == own:
            return self._taken(found, wanted, wanted, began)
        return self._taken(solve(self.base, METHOD, throw=False), own, wanted, began)

    def _taken(
        self,
        solution: EquilibriumSolution,
        values: dict[str, float],
        wanted: dict[str, float],
        began: float,
        **more: Any,
    ) -> Frame | Failure:
        """Return a solution as what is shown from now on."""
        if not solution.converged:
            self.given_up = wanted
            return Failure(solution.status.message)
        self.shown, self.values, self.given_up = solution, values, None
        shape, fields = sampled(solution)
        return Frame(solution, shape, fields, time.perf_counter() - began, **more)

    def _snapped(
        self,
        before: EquilibriumSolution,
        problem: Equilibrium,
        found: EquilibriumSolution | None,
        values: dict[str, float],
        wanted: dict[str, float],
        began: float,
    ) -> Frame | Failure:
        """Leave a shape that is no longer there, or no longer stable: for where its motion ends, else where the solver goes."""
        moved = snap.motion(before, problem)
        settled = None if moved is None else METHOD.beside(problem, snap.guess(moved, problem))
        if settled is None or settled.stable is False:
            moved, settled = None, found
        if settled is None or settled.stable is False:
            other = solve(problem, METHOD, throw=False)
            settled = other if settled is None or (other.converged and other.stable) else settled
        if not settled.converged or _apart(settled, before) <= SAME:
            return self._taken(settled, values, wanted, began)
        if moved is not None:
            way, words = snap.pictures(moved), "The rod snapped: its motion is shown, slowed down and damped."
        else:
            way = snap.blend(sampled(before)[0], sampled(settled)[0])
            words = "The rod snapped: the way from the one shape to the other is drawn, not computed."
        return self._taken(settled, values, wanted, began, way=tuple(way), words=words)

    def _between(self, wanted: dict[str, float], share: float) -> dict[str, float]:
        """Return values at a share of every slider's way."""
        result = {}
        for quantity in self.quantities:
            now, then = self.values[quantity.key], wanted[quantity.key]
            if now == then:
                result[quantity.key] = then
                continue
            a, b = quantity.place(now), quantity.place(then)
            result[quantity.key] = quantity.at(a + share * (b - a))
        return result


def _less_stable(found: EquilibriumSolution, before: EquilibriumSolution) -> bool:
    return bool(before.stable) and found.stable is False


def _apart(one: EquilibriumSolution, other: EquilibriumSolution) -> float:
    """Return how far apart two shapes are, over their lengths."""
    x = np.linspace(0.0, 1.0, 33)
    L, M = one.problem.rod.length, other.problem.rod.length
    gap = one.curve(x * L)[:, :3] / L - other.curve(x * M)[:, :3] / M
    return float(np.max(np.linalg.norm(gap, axis=1)))
