"""Gauss collocation: the solver of record.

Sources: C. de Boor and B. Swartz, SIAM J. Numer. Anal. 10 (1973) 582 (order 2 s at the nodes); U. M. Ascher,
R. M. M. Mattheij and R. D. Russell, Numerical Solution of Boundary Value Problems (SIAM, 1995), ch. 5, 7 and 9.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from darboux import checks
from darboux.checks import assign, description
from darboux.errors import InvalidInput
from darboux.kernels.gauss import FEWEST_STAGES, MOST_STAGES
from darboux.kernels.path import MOST_ELEMENTS
from darboux.packing import pendulum
from darboux.packing.coefficients import elastic_parts
from darboux.packing.scale import Scale
from darboux.problem import Equilibrium
from darboux.solution import EquilibriumSolution, ErrorEstimate, Status
from darboux.statics import first_shape, hanging_chain, limits, load_path
from darboux.statics.collocation_equations import CAREFUL, QUICK, Equations
from darboux.statics.collocation_path import buckled, follow
from darboux.statics.collocation_refinement import refined
from darboux.statics.first_shape import FirstShape
from darboux.statics.mesh import Mesh

ALMOST = 0.99  # of the load: what ends here for want of slack is taut
MOST_SNAPS = 3
MOST_TURNED = 500.0  # rad by which moments may turn the rod: more takes too many steps
FLATTEST = 0.05  # stretch below which a rod counts as compressed to nothing


@description
class Collocation:
    """Gauss collocation with ``stages`` points per element, Newton's method on the exact Jacobian and an adaptive mesh.

    Order 2 stages at the nodes. Every quadratic invariant of the equations (|q|, and of an unloaded rod m + r x n and
    m . n) holds to rounding. The branch that starts at the unloaded rod is followed on a coarse mesh of elements with two
    points, or four where the path is not plain; then the mesh is laid anew until the answer's estimated error is below
    ``rtol``. The error is estimated by halving every element; the answer is the finer of the two. Domain: any single rod;
    smooth or piecewise smooth data.

    Arguments: ``rtol`` wanted error of the positions over L, and of forces and moments over their largest, 1e-13 to
    1e-2; ``stages`` 2 to 5; ``elements`` None (adaptive) or how many equal elements are used. Raises ``InvalidInput``.
    """

    rtol: float = 1e-9
    stages: int = 4
    elements: int | None = None

    def __post_init__(self) -> None:
        rtol = checks.positive("collocation.rtol", self.rtol)
        if not 1e-13 <= rtol <= 1e-2:
            raise InvalidInput(f"collocation.rtol is {rtol:g}; it must lie between 1e-13 and 1e-2.")
        stages = checks.whole("collocation.stages", self.stages, FEWEST_STAGES)
        if stages > MOST_STAGES:
            raise InvalidInput(
                f"collocation.stages is {stages}; it must lie between {FEWEST_STAGES} and {MOST_STAGES}."
            )
        elements = self.elements
        elements = None if elements is None else checks.whole("collocation.elements", elements, 1, MOST_ELEMENTS)
        assign(self, rtol=rtol, stages=stages, elements=elements)

    def __str__(self) -> str:
        parts = [] if self.rtol == 1e-9 else [f"rtol={self.rtol:g}"]
        parts += [] if self.stages == 4 else [f"stages={self.stages}"]
        parts += [] if self.elements is None else [f"elements={self.elements}"]
        return f"Collocation({', '.join(parts)})"

    @property
    def order(self) -> int:
        """The order of the error at the nodes in 1/elements."""
        return 2 * self.stages

    def refuses(self, problem: Equilibrium) -> str | None:
        """Return why this method can't state the problem, or None."""
        return limits.too_many_turns(problem, "Collocation", MOST_TURNED)

    def solve(self, problem: Equilibrium, start: Any = None) -> EquilibriumSolution:
        """Return the equilibrium that follows from the unloaded rod, or from a start; the status says whether it got there."""
        began = time.perf_counter()
        with np.errstate(all="ignore"):  # a Newton step that leaves the numbers' range is rejected
            try:
                found = self._next_to(problem, start) if isinstance(start, EquilibriumSolution) else None
                found = found or self._followed(problem, start)
            except load_path.Stopped as stop:
                if stop.branch.is_disturbed:  # what was reached is no equilibrium of this problem
                    raise
                status = Status("stopped", load_path.stopped(stop.path))
                found = _Found(stop.branch, status, stop.path.state, ErrorEstimate(), stop.path)
            return self._answer(problem, found, began)

    def beside(self, problem: Equilibrium, start: EquilibriumSolution) -> EquilibriumSolution | None:
        """Return the equilibrium that Newton's method reaches from another solution at once, or None: for small steps."""
        began = time.perf_counter()
        with np.errstate(all="ignore"):
            found = self._next_to(problem, start)
            return None if found is None else self._answer(problem, found, began)

    def _answer(self, problem: Equilibrium, found: _Found, began: float) -> EquilibriumSolution:
        equations, mesh, path = found.equations, found.mesh, found.path
        curve = equations.curve(mesh, path.load_factor)
        return EquilibriumSolution(
            problem,
            self,
            problem.rod.model,
            found.status,
            curve,
            load_factor=path.load_factor,
            index=path.index,
            error=found.error,
            elastic_parts=elastic_parts(problem, equations.table, curve, equations.scale),
            statistics={
                "seconds": time.perf_counter() - began,
                "elements": mesh.elements,
                "load_steps": path.steps,
                "rejected_steps": path.rejected,
                "newton_iterations": equations.iterations,
                "crossings": tuple(path.crossings),
            },
        )

    def _next_to(self, problem: Equilibrium, start: EquilibriumSolution) -> _Found | None:
        """Return the equilibrium that Newton's method reaches from another solution, or None where it does not contract."""
        equations = Equations(problem, self.stages)
        answer = refined(equations, equations.mesh_of(start), self.rtol, self.stages, self.elements, first=True)
        if answer is None:
            return None
        path = load_path.Path(answer[0], 1.0, index=equations.index(answer[0], 1.0))
        unstable = load_path.unstable_in(path.index)
        message = f"converged: the equilibrium next to the one that was given as the start.{unstable}"
        return _Found(equations, Status("converged", message), *answer, path)

    def _followed(self, problem: Equilibrium, start: Any) -> _Found:
        """Return where the path ends that begins with the unloaded rod, or with the start's shape free of stress."""
        if start is not None:
            return self._followed_from(problem, first_shape.given(problem, Scale.of(problem), start), "the given start")
        cable = hanging_chain.hung(problem)
        if cable is not None:
            found = self._followed_from(problem, cable, hanging_chain.ORIGIN)
            if found.status.code == "converged" and not found.path.index:
                return found
        return self._followed_from(problem, first_shape.of_problem(problem), pendulum.origin(problem))

    def _followed_from(self, problem: Equilibrium, shape: FirstShape | None, origin: str) -> _Found:
        """Return where the path ends that begins with a shape (None: the rod's own), called ``origin`` in words.

        It is followed quickly, and once more with care where it does not get to the end, or not to a stable one without a crossing.
        """
        found = self._with_stages(QUICK.stages, problem, shape, origin)
        plain = found.status.code == "converged" and not found.path.crossings and not found.path.index
        if plain and found.equations.index(found.mesh, 1.0) == found.path.index:
            return found
        careful = self._with_stages(CAREFUL.stages, problem, shape, origin)
        careful.equations.iterations += found.equations.iterations
        return careful

    def _with_stages(self, stages: int, problem: Equilibrium, shape: FirstShape | None, origin: str) -> _Found:
        equations = Equations(problem, stages, shape)
        if shape is not None and shape.sags:
            path = load_path.of_cable(follow(equations, equations.unloaded(), unseen=load_path.UNSEEN_TURN_OF_CABLE))
        else:
            path = follow(equations, equations.unloaded(), until_unstable=True)
        if stages == QUICK.stages and (path.load_factor < 1.0 or path.unstable is not None):
            return _Found(equations, Status("no_convergence", ""), path.state, ErrorEstimate(), path)
        code, message = load_path.ending(path, "Collocation", origin)
        if path.unstable is not None and equations.has_potential:
            a, b = path.crossings[0]
            leaving = (
                f"Between {100.0 * a:.4g} % and {100.0 * b:.4g} % of the load the straight-on branch turns unstable, and the rod "
                "leaves it to the side that a small disturbance gives"
            )
            stable, disturbed = buckled(equations, path)
            if stable is not None:
                path, code = stable, "converged"
                message = f"converged: the stable equilibrium that follows from {origin}. {leaving}."
            elif (behind := self._behind_a_snap(equations, disturbed)) is not None:
                fold = f"{100.0 * disturbed.load_factor:.4g} %"
                equations, path = behind
                code, message = (
                    "converged",
                    (
                        f"converged: a stable equilibrium behind a snap. {leaving}; that branch ends at a fold, at {fold}, from "
                        "where the rod was let go. Contact of the rod with itself is left out."
                    ),
                )
            else:  # then at least the unstable branch, and said to be so
                path = follow(equations, equations.unloaded())
                code, message = load_path.ending(path, "Collocation", origin)
        mesh = path.state
        if path.load_factor < 1.0:
            if equations.flattest(mesh) < FLATTEST:
                code, message = "no_convergence", load_path.flattened(path)
            elif equations.slack and not problem.rod.stretch and path.load_factor > ALMOST and code != "folded":
                code, message = "no_convergence", limits.TAUT
            return _Found(equations, Status(code, message), mesh, ErrorEstimate(), path)
        answer = refined(equations, mesh, self.rtol, self.stages, self.elements)
        if answer is None:
            message = (
                f"Newton's method did not settle at rtol = {self.rtol:g}, but on the coarse mesh. Ask "
                "for a larger rtol."
            )
            message = limits.TAUT if equations.packing.is_taut else message
            return _Found(equations, Status("no_convergence", message), mesh, ErrorEstimate(), path)
        return _Found(equations, Status(code, message), *answer, path)

    def _behind_a_snap(
        self, equations: Equations, ended: load_path.Path[Mesh]
    ) -> tuple[Equations, load_path.Path[Mesh]] | None:
        """Return a stable equilibrium at full load that is reached from the shape at a fold, where a path ended, or None.

        The rod is made free of stress in that shape, and followed while its own natural shape comes back.
        """
        problem = equations.problem
        for _ in range(MOST_SNAPS):
            if ended.unstable is not None:
                return None
            curve, iterations = equations.curve(ended.state, ended.load_factor), equations.iterations
            equations = Equations(problem, CAREFUL.stages, first_shape.given(problem, equations.scale, curve))
            equations.iterations = iterations
            path = ended = follow(equations, equations.unloaded(), until_unstable=True)
            if path.unstable is not None:
                stable, ended = buckled(equations, path)
                path = stable or path
            if path.load_factor == 1.0 and path.index == 0:
                return equations, path
        return None


@dataclass(frozen=True)
class _Found:
    """Where a solve ended."""

    equations: Equations
    status: Status
    mesh: Mesh
    error: ErrorEstimate
    path: load_path.Path[Mesh]
