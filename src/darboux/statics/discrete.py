"""Discrete elastic rods: an energy on a polyline with a material angle per edge, minimised by Newton's method.

Sources: M. Bergou, M. Wardetzky, S. Robinson, B. Audoly and E. Grinspun, Discrete elastic rods, ACM Trans. Graph. 27
(2008) 63; M. Bergou, B. Audoly, E. Vouga, M. Wardetzky and E. Grinspun, Discrete viscous threads, ACM Trans. Graph. 29
(2010) 116. The clamp of half a cell and the multipliers of inextensible rods are our own; see docs/decisions.md.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np

from darboux import checks
from darboux.checks import MOST_SEGMENTS, assign, description
from darboux.curve import Curve
from darboux.errors import InvalidInput
from darboux.packing import pendulum
from darboux.problem import Equilibrium
from darboux.solution import EquilibriumSolution, ErrorEstimate, Status, same_branch
from darboux.statics import discrete_fields, hanging_chain, limits, load_path
from darboux.statics.discrete_branch import ChainBranch
from darboux.statics.discrete_chain import Chain, Shape, nodes_along, nodes_wanted
from darboux.statics.discrete_modes import LowestModes
from darboux.statics.first_shape import given

CLAMPS = ("half_cell", "two_vertices")
FEWEST = 100  # segments, from which on fewer may serve as a start
INEXTENSIBLE = 1e-6  # relative stretch that multipliers leave at most
FLATTEST = 0.05  # an edge shorter than this, over its rest length, is compressed to nothing


@description
class DiscreteRod:
    """Discrete elastic rods of ``segments`` edges, by Newton's method on the exact banded Hessian.

    Order 2 in 1/segments with ``clamp="half_cell"`` (a spring of half a cell ties the first edge to the clamp), order 1
    with ``clamp="two_vertices"`` (the first edge frozen, as in the paper's figure 5); one more where extrapolated. Domain:
    rods that do not shear; stretching by EA, or inextensible by multipliers, as rings must be; all supports at the ends,
    and between them those that hold or spring displacements; all loads, with their exact tangent. Counts the unstable
    directions where the loads have a potential, and its solutions have `modes`.

    Arguments: ``segments`` N >= 2; ``clamp``; ``extrapolate`` whether the answers of N and 2 N segments (a ring's: 3 N) are
    extrapolated (Richardson), which gives an estimated error too, unless they are different equilibria, as the status then says;
    ``stable`` False to stay at an equilibrium
    that is unstable, where a real rod falls to another; ``grading`` the longest segment over the shortest (1: all equal), which
    shrink smoothly towards the held ends, where boundary layers lie. Raises ``InvalidInput``.
    """

    segments: int = 100
    clamp: str = "half_cell"
    grading: float = 1.0
    extrapolate: bool = False
    stable: bool = True

    def __post_init__(self) -> None:
        grading = checks.positive("discrete_rod.grading", self.grading)
        if not 1.0 <= grading <= 1e4:
            raise InvalidInput(f"discrete_rod.grading is {grading:g}; it must lie between 1 (equal segments) and 1e4.")
        assign(
            self,
            segments=checks.whole("discrete_rod.segments", self.segments, 2, MOST_SEGMENTS),
            clamp=checks.choice("discrete_rod.clamp", self.clamp, CLAMPS),
            grading=grading,
            extrapolate=checks.flag("discrete_rod.extrapolate", self.extrapolate),
            stable=checks.flag("discrete_rod.stable", self.stable),
        )

    def __str__(self) -> str:
        extra = "" if self.clamp == "half_cell" else f", {self.clamp!r}"
        extra += "" if self.grading == 1.0 else f", grading={self.grading:g}"
        extra += ", extrapolate=True" if self.extrapolate else ""
        extra += "" if self.stable else ", stable=False"
        return f"DiscreteRod({self.segments}{extra})"

    @property
    def order(self) -> int:
        """The order of the error in 1/segments."""
        return (2 if self.clamp == "half_cell" else 1) + int(self.extrapolate)

    def refined(self, factor: int) -> DiscreteRod:
        """Return the method with ``factor`` times the segments."""
        return replace(self, segments=self.segments * factor)

    def refuses(self, problem: Equilibrium) -> str | None:
        """Return why this method can't state the problem, or None."""
        return limits.beyond_chain(problem, self.segments, even=self.grading == 1.0)

    def solve(self, problem: Equilibrium) -> EquilibriumSolution:
        """Return the equilibrium that follows from the unloaded rod; the status says whether the path got there."""
        refusal = self.refuses(problem)
        if refusal:
            raise InvalidInput(refusal)
        coarse = self._solved(problem, 1)
        if not (self.extrapolate and coarse.converged):
            return coarse
        parts = 3 if problem.closed else 2
        return self._extrapolated(coarse, self._solved(problem, parts), parts)

    def _solved(self, problem: Equilibrium, parts: int) -> EquilibriumSolution:
        """Return the equilibrium on the nodes, or on those with each segment in two parts (a ring's: in three)."""
        began = time.perf_counter()
        places = nodes_wanted(problem, self.segments)[0]
        held = problem.start.holds, problem.end.holds
        if problem.closed:
            nodes = (np.arange(parts * self.segments + 2) - 0.5) / (parts * self.segments)
        else:
            nodes = nodes_along(self.segments, self.grading, *held, places, parts - 1)
        chain = Chain(problem, nodes, self.clamp == "two_vertices")
        branch = ChainBranch(chain)
        with np.errstate(all="ignore"):  # a step out of the numbers' range is rejected
            follow = load_path.follow if chain.cable is None else load_path.followed_as_cable
            path = follow(branch, chain.unloaded())
            shape = path.state
            settled = branch.settle(shape) if path.load_factor == 1.0 else shape
            shape = settled or shape
            path.index = branch.index(shape, path.load_factor)
            arrived = settled is not None and path.load_factor == 1.0
            leaves = self.stable and chain.symmetric and path.load_factor > 0.0 and (path.index or not arrived)
            fallen = branch.fallen(shape, along_mode=arrived) if leaves else None
            if leaves and fallen is None and not arrived:
                fallen = self._from_fewer(branch)
            origin = pendulum.origin(problem) if chain.cable is None else hanging_chain.ORIGIN
            code, message = load_path.ending(path, "DiscreteRod", origin)
            if fallen is not None:
                ended = "is unstable" if arrived else f"ends at {100.0 * path.load_factor:.4g} % of the load"
                code = "converged"
                message = f"converged: a stable equilibrium, to which the rod fell. The one that follows from {origin} {ended}."
                shape, settled, path.index, path.load_factor = fallen, fallen, 0, 1.0
            if settled is None:
                code, message = "no_convergence", "Newton's method did not settle at full load; try fewer segments."
            elif (
                path.load_factor == 1.0
                and not problem.rod.stretch
                and np.max(np.abs(chain.stretch(shape))) > INEXTENSIBLE
            ):
                code, message = "no_convergence", limits.PUSHED
            branch.assemble(shape, path.load_factor)
        if path.load_factor < 1.0 and problem.rod.stretch and float(np.min(chain.stretch(shape))) < FLATTEST - 1.0:
            code, message = "no_convergence", load_path.flattened(path)
        return EquilibriumSolution(
            problem,
            self,
            problem.rod.model,
            Status(code, message),
            discrete_fields.curve(chain, shape, path.load_factor, branch.gradient),
            load_factor=path.load_factor,
            index=path.index,
            lowest_modes=LowestModes(((chain, shape, path.load_factor),)),
            elastic_parts=discrete_fields.elastic_parts(chain, shape, path.load_factor),
            statistics={
                "seconds": time.perf_counter() - began,
                "load_steps": path.steps,
                "rejected_steps": path.rejected,
                "newton_iterations": branch.iterations,
                "crossings": tuple(path.crossings),
            },
        )

    def _from_fewer(self, branch: ChainBranch) -> Shape | None:
        """Return the equilibrium next to that of a quarter of the segments, which turn less often on the way; or None."""
        chain = branch.chain
        if chain.edges < FEWEST:
            return None
        coarse = replace(self, segments=chain.edges // 4, extrapolate=False)._solved(chain.problem, 1)
        if not coarse.converged or coarse.index:
            return None
        rest = branch.rest(chain.in_shape(given(chain.problem, chain.scale, coarse.curve), 1.0), 1.0)
        return rest if rest is None or not chain.lent else branch.settle(rest) or rest

    def _extrapolated(self, coarse: EquilibriumSolution, fine: EquilibriumSolution, parts: int) -> EquilibriumSolution:
        """Return Richardson's extrapolation at the coarse nodes, with what it changed in the fine answer as its error.

        y = y_fine + (y_fine - y_coarse) / (parts^p - 1),   p the order of each

        Where a quantity jumps within a segment the error has no such law: the answer is the fine one, and its error that change.
        """
        if not fine.converged:
            return fine
        if coarse.index != fine.index or not same_branch(coarse, fine):
            numbers = f"{self.segments} and {parts * self.segments} segments"
            message = (
                f"{fine.status.message} It is not extrapolated, and has no estimated error: the answers of {numbers} are different "
                "equilibria, or far apart; try more segments."
            )
            return replace(fine, status=Status(fine.status.code, message))
        lawful = nodes_wanted(fine.problem, self.segments)[1] and not (parts == 3 and fine.problem.jumps)
        gain = 1.0 / (parts ** (self.order - 1) - 1) if lawful else 0.0
        next_to = np.clip(np.searchsorted(coarse.curve.s, fine.curve.s), 1, len(coarse.curve.s) - 1)
        gaps = [np.abs(coarse.curve.s[next_to - i] - fine.curve.s) for i in (0, 1)]
        common = np.minimum(*gaps) < 1e-9 * coarse.curve.s[-1]
        a, b = (
            np.concatenate([x.curve.y, x.curve.dy], axis=1)[at] for x, at in ((coarse, slice(None)), (fine, common))
        )
        turned = np.sign(np.sum(a[:, 3:7] * b[:, 3:7], axis=1, keepdims=True))  # q and -q are one orientation
        a[:, 3:7] *= turned
        a[:, 16:20] *= turned
        y = b + gain * (b - a)
        norm = np.linalg.norm(y[:, 3:7], axis=1, keepdims=True)
        y[:, 3:7] /= norm
        y[:, 16:20] /= norm
        energies: Any = tuple(
            f + gain * (f - c) for c, f in zip(coarse.elastic_parts or (), fine.elastic_parts or (), strict=True)
        )
        chains = [
            own for x in (coarse, fine) if isinstance(x.lowest_modes, LowestModes) for own in x.lowest_modes.chains
        ]
        lowest_modes = LowestModes(tuple(chains), gain)
        answer = replace(
            fine, curve=Curve(coarse.curve.s, y[:, :13], y[:, 13:]), elastic_parts=energies, lowest_modes=lowest_modes
        )
        change = np.abs(y - b if lawful else b - a)[[0, -1]]
        tip = float(np.linalg.norm(answer.tip - (fine if lawful else coarse).tip))
        error = ErrorEstimate(tip, float(np.max(change[:, 7:10])), float(np.max(change[:, 10:13])))
        return replace(answer, error=error)
