"""Several equilibria of one problem: Newton's method with deflation, from many first shapes.

A known equilibrium r_i is taken out of the equations F(y) = 0 by the factor

    M(y) = prod_i (1 / d_i^2 + 1),      d_i^2 = mean |r - r_i|^2 / (0.1 L)^2                         (1)

and Newton's step delta of F becomes that of M F by a change of its length alone,

    delta / (1 - grad M . delta / M).                                                                (2)

Source: P. E. Farrell, A. Birkisson and S. W. Funke, SIAM J. Sci. Comput. 37 (2015) A2026, eq. 3.4.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from darboux import checks
from darboux.checks import checked_call
from darboux.kernels.jit import announced
from darboux.problem import Equilibrium
from darboux.solution import EquilibriumSolution, Status
from darboux.statics import first_shape
from darboux.statics.collocation import Collocation
from darboux.statics.collocation_equations import Equations
from darboux.statics.collocation_refinement import refined
from darboux.statics.load_path import unstable_in
from darboux.statics.mesh import Mesh
from darboux.statics.solve import solve

Array = NDArray[np.float64]

ELEMENTS = 32
WIDTH = 0.1  # of the deflation, over L
MOST_ITERATIONS = 30
MOST_AGAIN = 20  # of those found, from which the search sets out once more
LARGEST_TURN = 0.8  # rad in one step
SETTLED = 1e-8
SAME = 1e-4  # over L: curves closer than this are one
BENDS = (2.0, -2.0, 4.0, -4.0, 5.0, -5.0, 6.0, -6.0)  # rad by which a first shape is bent
DIRECTIONS = ((1.0, 0.0), (0.0, 1.0))  # about d1, about d2
WAVES = (0, 1, 2)  # half waves of that bend: an arc, an S, ...


@checked_call
@announced
def solve_all(problem: Equilibrium, *, rtol: float = 1e-9, most: int = 20) -> tuple[EquilibriumSolution, ...]:
    """Find distinct equilibria at full load by a bounded search, those of lowest energy (``energy.total``) first.

    The first is that of ``solve``. The others are found by Newton's method with deflation (1), (2), from shapes bent in many
    ways and from those already known. No search can promise that it found all of them. Where equilibria form a family,
    as a round rod that may buckle in any plane does, one of them stands for it.

    Arguments: ``problem`` an ``Equilibrium``; ``rtol`` as for ``Collocation``; ``most`` how many are looked for. Returns a
    tuple of ``EquilibriumSolution``, each with its energy and its number of unstable directions. Raises
    ``InvalidInput``, also where ``Collocation`` refuses the problem.
    """
    checks.instance("solve_all.problem", problem, Equilibrium, "an Equilibrium")
    most = checks.whole("solve_all.most", most, 1)
    method = Collocation(rtol=rtol)
    first = solve(problem, method, throw=False)
    with np.errstate(all="ignore"):  # a Newton step that leaves the numbers' range is rejected
        search = _Search(problem, method)
        if first.converged:
            search.found.append(first)
        search.run(most)
    return tuple(sorted(search.found, key=lambda x: (x.energy.total, x.index or 0)))


class _Search:
    def __init__(self, problem: Equilibrium, method: Collocation) -> None:
        self.problem, self.method = problem, method
        self.equations = Equations(problem, method.stages, first_shape.of_problem(problem))
        self.equations.unloaded()  # from where prescribed displacements grow
        self.x = np.unique(np.concatenate([np.linspace(0.0, 1.0, ELEMENTS + 1), self.equations.breaks]))
        self.found: list[EquilibriumSolution] = []

    def run(self, most: int) -> None:
        """Look for equilibria, starting from one guess after the other."""
        known = [self._on_nodes(solution) for solution in self.found]
        for guess in self._guesses(known):
            if len(self.found) >= most:
                return
            mesh = self._deflated(guess, known)
            answer = None if mesh is None else self._answer(mesh)
            if mesh is not None and answer is not None:
                known.append(mesh)
                if all(self._distinct(answer, other) for other in self.found):
                    self.found.append(answer)

    def _guesses(self, known: list[Mesh]) -> Iterator[Mesh]:
        """Yield first shapes: bent in the plane and out of it, as arcs and waves; then what is known, as a start anew.

        Each with the forces that carry the loads along it, and without: both lead to equilibria that the other misses.
        """
        for wave, bend, direction, carrying in itertools.product(WAVES, BENDS, DIRECTIONS, (True, False)):
            yield self._bent(bend, wave, direction, carrying)
        yield from itertools.islice(known, MOST_AGAIN)

    def _bent(self, bend: float, wave: int, direction: tuple[float, float], carrying: bool) -> Mesh:
        def k(x: Array) -> Array:
            more = bend * np.cos(wave * np.pi * x)
            return np.asarray(self.equations.natural_shape(x) + more[:, None] * np.array([*direction, 0.0]))

        return self.equations.bent(k, self.x, carrying)

    def _on_nodes(self, solution: EquilibriumSolution) -> Mesh:
        stations = [at for at, _ in self.equations.stations]
        return self.equations.mesh_of(solution).laid(np.sort(np.concatenate([self.x, stations])))

    def _deflated(self, mesh: Mesh, known: list[Mesh]) -> Mesh | None:
        """Return the equilibrium that deflated Newton's method reaches, or None."""
        for _ in range(MOST_ITERATIONS):
            step = self.equations.newton_step(mesh, 1.0)
            if step is None:
                return None
            longer = _deflation(mesh, step.delta, known)
            part = min(abs(longer), LARGEST_TURN / max(step.turn, 1e-300)) * np.sign(longer)
            mesh = self.equations.moved(mesh, 1.0, step.delta, part=part)
            if not np.all(np.isfinite(mesh.y)):
                return None
            if step.length < SETTLED:
                return mesh
        return None

    def _answer(self, mesh: Mesh) -> EquilibriumSolution | None:
        answer = refined(self.equations, mesh, self.method.rtol, self.method.stages)
        if answer is None or self.equations.flattest(answer[0]) <= 0.0:
            return None
        index = self.equations.index(answer[0], 1.0)
        message = f"converged: one of the equilibria at full load.{unstable_in(index)}"
        problem, status = self.problem, Status("converged", message)
        curve, error = self.equations.curve(answer[0], 1.0), answer[1]
        return EquilibriumSolution(problem, self.method, problem.rod.model, status, curve, index=index, error=error)

    def _distinct(self, a: EquilibriumSolution, b: EquilibriumSolution) -> bool:
        """Return whether two answers are different shapes, and no members of one family."""
        L = self.problem.rod.length
        s = np.linspace(0.0, L, 101)
        if float(np.max(np.linalg.norm(a.r(s) - b.r(s), axis=1))) < SAME * L:
            return False
        bent = [np.linalg.norm(x.m(s), axis=1) for x in (a, b)]
        alike = float(np.max(np.abs(bent[0] - bent[1]))) < 1e-6 * max(float(np.max(m)) for m in bent)
        return not (alike and self.equations.free_motions(self.equations.mesh_of(a)) > 0)


def _deflation(mesh: Mesh, delta: Array, known: list[Mesh]) -> float:
    """(2): by how much deflation changes the length of Newton's step."""
    gradient = 0.0
    for other in known:
        gap = mesh.y[:, :3] - other.y[:, :3]
        square = float(np.mean(np.sum(gap**2, axis=1))) / WIDTH**2 + 1e-30
        slope = 2.0 * float(np.mean(np.sum(gap * delta[:, :3], axis=1))) / WIDTH**2
        gradient -= slope / square**2 / (1.0 / square + 1.0)
    return 1.0 / (1.0 - gradient)
