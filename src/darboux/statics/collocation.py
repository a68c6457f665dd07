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
from darboux.curve import Curve
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
from darboux.statics.load_path import Fall
from darboux.statics.mesh import Mesh

ALMOST = 0.99  # of the load: what ends here for want of slack is taut
LENT = 4.0  # times the strain that is lent, over the load: by how much a bracket of a bifurcation is widened
SLACKS = 1e-6, 1e-4  # compliances of stretch lent on the way, until the rod buckles by what pushes it together
MOST_SNAPS = 3
SAME_LINK = 0.1  # turns: two rings' links that differ by less are one, for others differ by whole turns
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
    1e-2; ``stages`` 2 to 5; ``elements`` None (adaptive) or how many equal elements are used; ``stable`` False to stay on a
    branch that turns unstable, where a real rod leaves it. Raises ``InvalidInput``.
    """

    rtol: float = 1e-9
    stages: int = 4
    elements: int | None = None
    stable: bool = True

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
        stable = checks.flag("collocation.stable", self.stable)
        assign(self, rtol=rtol, stages=stages, elements=elements, stable=stable)

    def __str__(self) -> str:
        parts = [] if self.rtol == 1e-9 else [f"rtol={self.rtol:g}"]
        parts += [] if self.stages == 4 else [f"stages={self.stages}"]
        parts += [] if self.elements is None else [f"elements={self.elements}"]
        parts += [] if self.stable else ["stable=False"]
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
                "own_load": equations.tells_load,
                "falls": tuple((fall.load_factor, fall.fold, fall.jump) for fall in found.falls),
            },
        )

    def _next_to(self, problem: Equilibrium, start: EquilibriumSolution) -> _Found | None:
        """Return the equilibrium that Newton's method reaches from another solution, or None where it does not contract."""
        equations = Equations(problem, self.stages)
        answer = refined(equations, equations.mesh_of(start), self.rtol, self.stages, self.elements, first=True)
        if answer is None or not _turned_as_asked(problem, equations.curve(answer[0], 1.0), start):
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
        quick = self._quickly(Equations(problem, QUICK.stages, shape), origin)
        if quick is not None:
            return quick
        for slack in SLACKS:
            found = self._carefully(Equations(problem, CAREFUL.stages, shape, slack), origin)
            # Not stiff enough on the way to buckle, it ends straight between supports that leave it more room.
            if found.status.code == "converged" or not found.equations.slack or found.equations.packing.is_taut:
                break
        return found

    def _quickly(self, equations: Equations, origin: str) -> _Found | None:
        """Return a stable answer to which a path leads without a crossing, or None."""
        path = self._path(equations)
        if path.load_factor < 1.0 or path.crossings or path.index:
            return None
        answer = refined(equations, path.state, self.rtol, self.stages, self.elements)
        if answer is None or equations.index(answer[0], 1.0) != path.index:
            return None
        return _Found(equations, Status(*load_path.ending(path, "Collocation", origin)), *answer, path)

    def _path(self, equations: Equations) -> load_path.Path[Mesh]:
        """Return the path to its first crossing, but for a cable's."""
        unloaded = equations.unloaded()
        if equations.shape is not None and equations.shape.sags:
            return load_path.of_cable(follow(equations, unloaded, unseen=load_path.UNSEEN_TURN_OF_CABLE))
        return follow(equations, unloaded, until_unstable=True)

    def _disturbed(
        self, equations: Equations, path: load_path.Path[Mesh]
    ) -> tuple[Equations, load_path.Path[Mesh] | None, tuple[Fall, ...]]:
        """Return the stable side of a bifurcation to which a small load leads, or None, and the falls.

        Where that ends too, the rod is made free of stress in that shape, and followed while its own natural shape comes back.
        """
        from darboux.statics.descent import farthest

        stable, ended = buckled(equations, path)
        if stable is not None:
            stable.crossings[:0] = path.crossings
            return equations, stable, ()
        own, before = equations, equations.curve(ended.state, ended.load_factor)
        for _ in range(MOST_SNAPS):
            if ended.unstable is not None:
                break
            curve, iterations = own.curve(ended.state, ended.load_factor), own.iterations
            own = Equations(own.problem, CAREFUL.stages, first_shape.given(own.problem, own.scale, curve))
            own.iterations = iterations
            after = ended = follow(own, own.unloaded(), until_unstable=True)
            if after.unstable is not None:
                beside, ended = buckled(own, after)
                after = beside or after
            if after.load_factor == 1.0 and after.index == 0:
                after.crossings[:] = path.crossings
                jump = farthest(before, own.curve(after.state, 1.0))
                return own, after, (Fall(path.load_factor, False, jump),)
        return equations, None, ()

    def _carefully(self, equations: Equations, origin: str) -> _Found:
        """Return where the rod ends that leaves its path wherever that turns unstable or ends."""
        problem, path = equations.problem, self._path(equations)
        if equations.packing.is_straight and path.unstable is not None:  # what is lent would let it buckle
            path = follow(equations, equations.unloaded())
            path.crossings, path.unstable, path.index = [], None, 0
        code, message = load_path.ending(path, "Collocation", origin)
        if equations.slack > 0.0 and path.unstable is not None:  # what is lent shortens the rod, and so moves the load
            more = LENT * equations.slack * equations.largest_force(path.unstable[0])
            path.crossings[0] = path.crossings[0][0] * (1.0 - more), path.crossings[0][1] * (1.0 + more)
        falls: tuple[Fall, ...] = ()
        if self.stable and equations.has_potential and (path.unstable is not None or path.load_factor < 1.0):
            from darboux.statics.descent import let_go  # slow to load, and seldom needed

            stable, falls = let_go(equations, path)
            if stable is None and path.unstable is not None:  # no discrete rod falls
                equations, stable, falls = self._disturbed(equations, path)
            if stable is not None:
                code, message = load_path.reached(stable, falls, origin, problem.rod.length, told=equations.tells_load)
                path = stable
            elif path.unstable is not None:  # then at least the unstable branch, and said to be so
                path, falls = follow(equations, equations.unloaded()), ()
                code, message = load_path.ending(path, "Collocation", origin)
        elif path.unstable is not None:
            path = follow(equations, equations.unloaded())
            code, message = load_path.ending(path, "Collocation", origin)
        mesh = path.state
        if path.load_factor < 1.0:
            if equations.flattest(mesh) < FLATTEST:
                code, message = "no_convergence", load_path.flattened(path)
            elif equations.slack and not problem.rod.stretch and path.load_factor > ALMOST and code != "folded":
                code, message = "no_convergence", limits.TAUT
            return _Found(equations, Status(code, message), mesh, ErrorEstimate(), path, falls)
        answer = refined(equations, mesh, self.rtol, self.stages, self.elements)
        if answer is None:
            message = (
                f"Newton's method did not settle at rtol = {self.rtol:g}, but on the coarse mesh. Ask "
                "for a larger rtol."
            )
            message = limits.TAUT if equations.packing.is_taut else message
            return _Found(equations, Status("no_convergence", message), mesh, ErrorEstimate(), path, falls)
        return _Found(equations, Status(code, message), *answer, path, falls)


def _turned_as_asked(problem: Equilibrium, curve: Curve, start: EquilibriumSolution) -> bool:
    """Return whether a ring's link differs from the start's by as much as the links that were asked for."""
    if problem.link is None or start.problem.link is None:
        return True
    found = first_shape.link_of(curve) - first_shape.link_of(start.curve)
    return abs(found - (problem.link - start.problem.link)) < SAME_LINK


@dataclass(frozen=True)
class _Found:
    """Where a solve ended."""

    equations: Equations
    status: Status
    mesh: Mesh
    error: ErrorEstimate
    path: load_path.Path[Mesh]
    falls: tuple[Fall, ...] = ()
