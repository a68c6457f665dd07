"""One call for every method."""

from __future__ import annotations

from typing import Any, Protocol

from darboux import checks
from darboux.checks import checked_call
from darboux.errors import InvalidInput
from darboux.kernels.jit import announced
from darboux.problem import Equilibrium
from darboux.solution import EquilibriumSolution
from darboux.statics import limits
from darboux.statics.collocation import Collocation


class Method(Protocol):
    """What a method is: it says which problems it can't state, and solves the others."""

    def refuses(self, problem: Equilibrium) -> str | None:
        """Return why this method can't state the problem, in one sentence, or None."""

    def solve(self, problem: Equilibrium) -> EquilibriumSolution:
        """Return the solution; its status says whether the method converged."""


@checked_call
@announced
def solve(problem: Equilibrium, method: Any = None, *, start: Any = None, throw: bool = True) -> EquilibriumSolution:
    """Find the equilibrium that follows from the unloaded rod as all loads grow together, or the one next to a start.

    Arguments: ``problem`` an ``Equilibrium``; ``method`` ``Collocation()`` (the default), ``Shooting()``, ``Elastica()`` or
    ``DiscreteRod()``; ``start`` None, or a guess for ``Collocation``: a solution of a problem like this one, from which
    Newton's method sets out at full load, or a curve or points (n, 3) in m along the rod, in whose shape the rod is first made
    free of stress, and followed while its own natural shape, the supports and the loads come in; ``throw`` whether a
    solve that does not converge raises. Returns an ``EquilibriumSolution``. Raises ``InvalidInput`` where the method can't
    state the problem, and ``NotConverged``, whose ``solution`` holds what was reached, unless ``throw`` is False; then Ctrl-C
    too may return what was reached, with the status "stopped".
    """
    checks.instance("solve.problem", problem, Equilibrium, "an Equilibrium")
    method = checked_method("solve.method", Collocation() if method is None else method)
    refused = refusal(problem, method)
    if refused:
        raise InvalidInput(refused)
    if start is None:
        solution: EquilibriumSolution = method.solve(problem)
    elif isinstance(method, Collocation):
        solution = method.solve(problem, start)
    else:
        raise InvalidInput(
            f"solve.start came beside {method}, which sets out from the unloaded rod; use Collocation()."
        )
    if throw and solution.status.code == "stopped":
        raise KeyboardInterrupt(solution.status.message)
    return solution.check() if throw else solution


def refusal(problem: Equilibrium, method: Method) -> str | None:
    """Return why a problem can't be solved by a method, in one sentence, or None."""
    return limits.wound(problem) or limits.twisted(problem) or method.refuses(problem)


def checked_method(field: str, method: Any) -> Method:
    """Return the method, or say that it is none (a class without its brackets is the usual slip)."""
    if isinstance(method, type) or not (hasattr(method, "solve") and hasattr(method, "refuses")):
        name = method.__name__ if isinstance(method, type) else checks.shown(method)
        hint = f" Did you mean {name}()?" if isinstance(method, type) else ""
        raise InvalidInput(
            f"{field} is {name}; it must be a method, such as Shooting() or DiscreteRod(segments=50).{hint}"
        )
    return method  # type: ignore[no-any-return]
