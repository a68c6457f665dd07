"""The solver of record against `scipy.integrate.solve_bvp`, over the catalogue; the cost of a cold solve; size.

- `solve_bvp` gets its best case: the compiled rod equations with their exact Jacobian, exact boundary rows, and as its
  guess our own solution at 1e-3, far more exact than a user's would be. Ours is timed with all that `solve` does: checks,
  error estimate, stability, result; once cold, from the unloaded rod, from where `solve_bvp` fails on most of these problems, and
  once from the same guess, by `start=`. A ratio is formed for each problem; the targets are its median, and that none is below 1.
- Both are asked for the same tolerance; errors are the largest of any position over L, against ours at 1e-12 with five
  stages. Problems with point loads, stations, rings or loads of the shape are left out: `solve_bvp` can't state them. It
  may use 15,000 nodes; where that is not enough it has failed, and the problem has no ratio.
- Figure 5 from a cold start is given in units of one Newton iteration on its final mesh (target: at most 25).
- Cost per element and iteration from 20 to 20,000 elements: linear where the figures stay the same. Memory per element at 5,000,
  10,000 and 20,000: of Newton's method, of a path on that mesh, and of a whole solve, whose answer has so many. The plot
  has `solve_bvp` beside it, from our solution on the same elements, its time over the times it formed its Jacobian. Its
  element has one point inside, ours four: it needs many times as many elements.
- Error against cost, figure 5 at tolerances from 1e-3 to 1e-11: the largest distance of any position over L from `Elastica`
  at 1e-11, which shares no code with either.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_bvp

import darboux as dx
from benchmarks.timing import Curve, Row, Spread, interleaved, seconds
from darboux.kernels import rod_equations
from darboux.kernels.rod_equations import FORCE, ROTATION, STATES
from darboux.packing import coefficients
from darboux.packing.scale import Scale
from darboux.paper.cases import figure5
from darboux.statics.collocation_equations import Equations
from darboux.statics.mesh import Mesh
from tests import cases
from tests.catalogue.problems import CATALOGUE

Array = NDArray[np.float64]

TARGETS = {1e-9: 100.0, 1e-6: 25.0}
LEAST = 1.0  # of the ratios, for any problem
SLOWEST = 8  # problems whose ratios are listed
MOST_ITERATIONS = 25
MOST_NODES = 15_000
SIZES = (20, 200, 2_000, 20_000)
LARGE = (5_000, 10_000, 20_000)
ROOT = Path(__file__).resolve().parent.parent
MOST_KB = 4.0
PEER_SIZES = (20, 200, 2_000)
COARSE = 1.0  # tolerance at which solve_bvp keeps the mesh it is given
RTOLS = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)  # of the plot
LONG = 2.0  # s


class Peer:
    """One problem as `solve_bvp` takes it: 13 states, dimensionless, |q(0)| = 1 as the thirteenth condition."""

    def __init__(self, problem: dx.Equilibrium, guess: dx.EquilibriumSolution, x: Array | None = None) -> None:
        self.scale = Scale.of(problem)
        self.table = coefficients.table(problem, self.scale)
        equations = Equations(problem, stages=4)
        equations.unloaded()
        self.start, self.end = equations.start, equations.end
        self.x = np.unique(guess.curve.s) / problem.rod.length if x is None else x
        self.y = self.scale.states(guess.curve, self.x).T

    def slope(self, x: Array, y: Array) -> Array:
        return coefficients.slopes(self.table(x), np.ascontiguousarray(y.T)).T

    def jacobian(self, x: Array, y: Array) -> Array:
        states, c = np.ascontiguousarray(y.T), self.table(x)
        J = np.empty((len(x), STATES * STATES))
        for i in range(len(x)):
            rod_equations.jacobian(states[i], c[i], J[i])
        return J.reshape(-1, STATES, STATES).transpose(1, 2, 0)

    def conditions(self, a: Array, b: Array) -> Array:
        return np.concatenate([self.start.values(a, 1.0), self.end.values(b, 1.0), [a[3:7] @ a[3:7] - 1.0]])

    def rows(self, a: Array, b: Array) -> tuple[Array, Array]:
        A, B = np.zeros((STATES, STATES)), np.zeros((STATES, STATES))
        A[:6], B[6:12] = _by_states(self.start.system(a, 1.0), a), _by_states(self.end.system(b, 1.0), b)
        A[12, ROTATION:FORCE] = 2.0 * a[ROTATION:FORCE]
        return A, B

    def solve(self, tolerance: float) -> Any:
        return solve_bvp(
            self.slope, self.conditions, self.x, self.y, fun_jac=self.jacobian, bc_jac=self.rows, tol=tolerance,
            max_nodes=MOST_NODES,
        )  # fmt: skip

    def error(self, found: Any, exact: dx.EquilibriumSolution) -> float:
        r = found.sol(found.x)[:3].T * self.scale.length + self.scale.origin
        return _error(r, exact.r(np.clip(found.x, 0.0, 1.0) * self.scale.length)) / self.scale.length


def _by_states(system: Array, y: Array) -> Array:
    """Return the rows by the 13 states: phi = 2 vec(q* dq)."""
    w, x, y_, z = y[ROTATION:FORCE]
    phi = 2.0 * np.array([[-x, w, z, -y_], [-y_, -z, w, x], [-z, y_, -x, w]])
    return np.concatenate([system[:, :3], system[:, 3:6] @ phi, system[:, 6:12]], axis=1)


def _error(a: Array, b: Array) -> float:
    return float(np.max(np.linalg.norm(a - b, axis=1)))


def rows(quick: bool) -> Iterator[Row | Curve | str]:
    problems = [entry for entry in CATALOGUE if _stated(entry.problem)][:: 12 if quick else 1]
    left_out = [entry.name for entry in CATALOGUE if not _stated(entry.problem)]
    for tolerance, target in TARGETS.items():
        yield from _against_solve_bvp(problems, tolerance, target, 2 if quick else 3)
    yield f"Left out, for solve_bvp can't state them: {', '.join(left_out)}."
    yield from _figure5(5 if quick else 15)
    yield from _sizes(3 if quick else 7)
    yield from _memory()
    yield from _by_tolerance(3 if quick else 9)


def _stated(problem: dx.Equilibrium) -> bool:
    return not (problem.of_shape or problem.stations or isinstance(problem, dx.Ring))


def _against_solve_bvp(entries: list[Any], tolerance: float, target: float, rounds: int) -> Iterator[Row | str]:
    method, failed, names = dx.Collocation(rtol=tolerance), [], []
    times, errors = [], []  # of each problem: cold, from the guess, theirs
    for entry in entries:
        problem = entry.problem
        exact = dx.solve(problem, dx.Collocation(rtol=1e-12, stages=5))
        guess = dx.solve(problem, dx.Collocation(rtol=1e-3))
        peer, L = Peer(problem, guess), problem.rod.length
        began = time.perf_counter()
        found = peer.solve(tolerance)
        took = time.perf_counter() - began
        if found.status != 0:
            failed.append(entry.name)
            continue
        ways = [partial(dx.solve, problem, method), partial(dx.solve, problem, method, start=guess)]
        mine = [way() for way in ways]
        turns = 1 if took > LONG else rounds  # a turn that takes seconds is long enough alone
        calls = max(1, min(3, int(took / max(mine[0].statistics["seconds"], 1e-9))))
        taken = [
            [seconds(way, calls) for way in ways] + [seconds(partial(peer.solve, tolerance))] for _ in range(turns)
        ]
        names.append(entry.name)
        times.append(np.median(taken, axis=0))
        errors.append([_error(each.r(each.s), exact.r(each.s)) / L for each in mine] + [peer.error(found, exact)])
    cold, warm, theirs = 1e3 * np.array(times).T
    for way, ours, error in (("cold", cold, 0), ("guess", warm, 1)):
        ratio = theirs / ours
        slowest = [f"{names[i]} {ratio[i]:.2g}" for i in np.argsort(ratio)[:SLOWEST]]
        yield Row(
            name=f"collocation.solve_bvp.{tolerance:g}"
            if way == "guess"
            else f"collocation.solve_bvp.cold.{tolerance:g}",
            what=f"{len(ratio)} problems of the catalogue to {tolerance:g}, ours {'from the same guess' if error else 'cold'}",
            ours=Spread.of(ours),
            unit="ms",
            peer="solve_bvp with exact Jacobians",
            theirs=Spread.of(theirs),
            ratio=Spread.of(ratio),
            least_ratio=target,
            our_error=float(np.median(np.array(errors)[:, error])),
            their_error=float(np.median(np.array(errors)[:, 2])),
            error_of="position / L, median",
            note=f"medians over problems; least ratio {np.min(ratio):.2g}, {np.sum(ratio < LEAST)} below {LEAST:g}; "
            f"solve_bvp failed on {len(failed)}",
        )
        yield f"To {tolerance:g}, {'from the same guess' if error else 'cold'}, the least ratios: {', '.join(slowest)}."
    if failed:
        yield f"To {tolerance:g} solve_bvp failed on: {', '.join(failed)}."


def _figure5(rounds: int) -> Iterator[Row]:
    problem = figure5()
    solution = dx.solve(problem)
    equations = Equations(problem, stages=4)
    mesh = equations.mesh_of(solution).halved()

    def iteration() -> None:
        step = equations.newton_step(mesh, 1.0)
        equations.moved(mesh, 1.0, step.delta)

    cold, one = interleaved(lambda: dx.solve(problem), iteration, rounds=rounds, span=0.05)
    yield Row(
        name="collocation.figure5",
        what="figure 5, cold, to 1e-9",
        ours=Spread.of(cold / one),
        unit="iterations",
        most=MOST_ITERATIONS,
        guard=float(np.median(cold / one)),
        note=f"{1e3 * np.median(cold):.3g} ms; one iteration on its {mesh.elements} elements takes {1e3 * np.median(one):.3g} ms",
    )


def _sizes(rounds: int) -> Iterator[Row | Curve]:
    problem = cases.heavy(10.0)
    equations = Equations(problem, stages=4)
    solution = dx.solve(problem)
    first = equations.mesh_of(solution)
    work = []
    for elements in SIZES:
        mesh = first.laid(np.linspace(0.0, 1.0, elements + 1))
        work.append(lambda mesh=mesh: _iteration(equations, mesh))
    peers = [Peer(problem, solution, np.linspace(0.0, 1.0, elements + 1)) for elements in PEER_SIZES]
    jacobians = [_jacobians(peer) for peer in peers]
    times = interleaved(*work, *(partial(peer.solve, COARSE) for peer in peers), rounds=rounds, span=0.05)
    per_element = [1e6 * t / n for t, n in zip(times, SIZES, strict=False)]
    for n, t in zip(SIZES, per_element, strict=True):
        yield Row(
            name=f"collocation.elements.{n}",
            what=f"a Newton iteration per element, {n} elements",
            ours=Spread.of(t),
            unit="us",
            guard=float(np.median(t / per_element[1])),
        )
    yield Curve("collocation.size", "ours, 4 points inside", SIZES, tuple(map(Spread.of, per_element)))
    theirs = [1e6 * t / n / m for t, n, m in zip(times[len(SIZES) :], PEER_SIZES, jacobians, strict=True)]
    yield Curve("collocation.size", "solve_bvp, 1 point inside", PEER_SIZES, tuple(map(Spread.of, theirs)), peer=True)


def _memory() -> Iterator[Row]:
    words = {"newton": "Newton's method on elements with four points", "path": "a path on elements with two points"}
    words |= {"solve": "a solve, for each element of the answer"}
    for work, what in words.items():
        found = [_kilobytes(work, elements) for elements in LARGE]
        yield Row(
            name=f"collocation.memory.{work}",
            what=f"memory of {what}",
            ours=Spread.of(np.array(found)),
            unit="KB",
            most=MOST_KB,
            note=", ".join(f"{each:.2f} at {elements:,}" for each, elements in zip(found, LARGE, strict=True)),
        )


def _kilobytes(work: str, elements: int) -> float:
    words = [sys.executable, "-m", "benchmarks.memory", work, str(elements)]
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    done = subprocess.run(words, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, check=True)
    return float(done.stdout)


def _jacobians(peer: Peer) -> int:
    """Return how often solve_bvp forms its Jacobian, which asks for ours at the nodes and at the middles."""
    asked, jacobian = 0, peer.jacobian

    def counted(x: Array, y: Array) -> Array:
        nonlocal asked
        asked += 1
        return jacobian(x, y)

    peer.jacobian = counted  # type: ignore[method-assign]
    found = peer.solve(COARSE)
    peer.jacobian = jacobian  # type: ignore[method-assign]
    if len(found.x) != len(peer.x):
        raise RuntimeError("solve_bvp refined the mesh on which it was to be timed")
    return asked // 2


def _by_tolerance(rounds: int) -> Iterator[Curve]:
    problem = figure5()
    exact = dx.solve(problem, dx.Elastica(rtol=1e-11))
    guess = dx.solve(problem, dx.Collocation(rtol=1e-3))
    peer, L = Peer(problem, guess), problem.rod.length
    methods = [dx.Collocation(rtol=rtol) for rtol in RTOLS]
    ways = {
        "Collocation, cold": [partial(dx.solve, problem, method) for method in methods],
        "Collocation, from a guess": [partial(dx.solve, problem, method, start=guess) for method in methods],
        "solve_bvp, from that guess": [partial(peer.solve, rtol) for rtol in RTOLS],
    }
    times = interleaved(*(solve for solves in ways.values() for solve in solves), rounds=rounds)
    for i, (label, solves) in enumerate(ways.items()):
        found = [solve() for solve in solves]
        if label.startswith("solve_bvp"):
            kept = [solution.status == 0 for solution in found]
            errors = [peer.error(solution, exact) for solution in found]
        else:
            kept = [solution.converged for solution in found]
            errors = [_error(solution.r(solution.s), exact.r(solution.s)) / L for solution in found]
        cost = [Spread.of(1e3 * t) for t in times[i * len(RTOLS) : (i + 1) * len(RTOLS)]]
        yield Curve(
            "collocation.error", label,
            at=tuple(error for error, ok in zip(errors, kept, strict=True) if ok),
            cost=tuple(spread for spread, ok in zip(cost, kept, strict=True) if ok),
            peer=label.startswith("solve_bvp"),
        )  # fmt: skip


def _iteration(equations: Equations, mesh: Mesh) -> Mesh:
    step = equations.newton_step(mesh, 1.0)
    return equations.moved(mesh, 1.0, step.delta)
