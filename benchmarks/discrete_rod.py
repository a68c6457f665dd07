"""Discrete elastic rods: what one node costs, from 1,000 to 1,000,000 nodes.

The rod is a helix with two bending stiffnesses, stretch and weight, at its natural shape: every term of the energy is at
work. Its Hessian is held at the clamp, and 1e-6 of its largest entry is added to the diagonal, as mass / step^2 does in an
implicit time step; without it a static rod of 100,000 nodes has a condition number near 1e20, and LAPACK's Cholesky
factorisation refuses it. The target is on the sum: gradient, Hessian and solution of a Newton iteration. The memory is the
largest that the rod, its state and a whole Newton iteration with line search hold at once. Both solvers solve the same band
for the same right side; LAPACK's is `scipy.linalg.solveh_banded`, factorisation and solution, as is ours. Its time is the
measure by which rows that have no peer are held against the last recorded run.
"""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

import darboux as dx
from benchmarks.timing import Curve, Row, Spread, interleaved
from darboux.kernels import band, discrete_rod
from darboux.kernels.discrete_rod import State
from darboux.statics.discrete_branch import ChainBranch
from darboux.statics.discrete_chain import Chain, nodes_along

Array = NDArray[np.float64]

ROUNDS = {1_000: 101, 10_000: 51, 100_000: 21, 1_000_000: 7}
SHIFT = 1e-6
LOAD_FACTOR = 1e-6  # a Newton step that the line search accepts at once
MOST_NS, MOST_BYTES = 400.0, 1500.0


def rows(quick: bool) -> Iterator[Row | Curve]:
    _memory(10)  # what is loaded and compiled at first use is not the rod's
    made: dict[str, list[Spread]] = {"gradient and Hessian": [], "factor and solve": [], "LAPACK, factor and solve": []}
    for nodes, rounds in ROUNDS.items():
        for row in _rows(nodes, rounds=min(rounds, 11) if quick else rounds):
            yield row
            if row.name.startswith("discrete_rod.gradient"):
                made["gradient and Hessian"].append(row.ours)
            elif row.theirs is not None:
                made["factor and solve"].append(row.ours)
                made["LAPACK, factor and solve"].append(row.theirs)
    for label, costs in made.items():
        yield Curve("discrete_rod.size", label, tuple(ROUNDS), tuple(costs), peer=label.startswith("LAPACK"))


def _helix(segments: int) -> Chain:
    section = dx.Stiffness(EI1=3e-7, EI2=4e-7, GJ=2.6e-7, EA=10.0, mass=8e-4)
    rod = dx.Rod(length=0.3, section=section, natural=dx.Helix(radius=0.02, pitch=0.03), stretch=True)
    return Chain(dx.Equilibrium(rod, loads=[dx.Gravity()]), nodes_along(segments, 1.0, True, False), two_vertices=False)


def _memory(nodes: int) -> float:
    """Return the largest memory in bytes."""
    tracemalloc.start()
    chain = _helix(nodes - 1)
    ChainBranch(chain).newton(chain.unloaded(), LOAD_FACTOR, np.inf)
    largest = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return largest


def _rows(nodes: int, rounds: int) -> Iterator[Row]:
    chain = _helix(nodes - 1)
    branch = ChainBranch(chain)
    shape = chain.unloaded()
    rod, loads = chain.elasticity(shape.T), chain.loads(LOAD_FACTOR)
    n, per_node = chain.unknowns, 1e9 / nodes
    gradient, lower, work = np.zeros(n), np.zeros(band.LOWER * n), np.zeros(discrete_rod.WORK)

    def gradient_and_hessian() -> None:
        discrete_rod.energy_gradient_hessian(shape.state, rod, loads, work, gradient, lower)

    gradient_and_hessian()
    derivative_error = _derivative_error(chain, shape.state, rod, loads, gradient, lower)
    held = lower.copy()
    band.fix(held, gradient.copy(), chain.fixed)
    held[:: band.LOWER] += SHIFT * float(np.max(held[:: band.LOWER]))
    right = np.random.default_rng(1).normal(size=n)
    columns = np.asfortranarray(held.reshape(n, band.LOWER).T)  # LAPACK's form
    factors, x = np.empty_like(held), np.empty(n)

    def factor_and_solve() -> None:
        np.copyto(factors, held)  # both solvers keep their input
        np.copyto(x, right)
        band.factor(factors, n)
        band.solve(factors, n, x)

    def lapack() -> Array:
        return np.asarray(solveh_banded(columns, right, lower=True, check_finite=False))

    def newton() -> None:
        if branch.newton(shape, LOAD_FACTOR, np.inf) is None:
            raise RuntimeError("the Newton iteration that is timed was rejected")

    assembled, solved, solved_by_lapack, iterated = interleaved(
        gradient_and_hessian, factor_and_solve, lapack, newton, rounds=rounds
    )
    yardstick = float(np.median(solved_by_lapack))
    yield Row(
        name=f"discrete_rod.gradient_hessian.{nodes}",
        what=f"DER gradient and Hessian, {nodes:,} nodes, per node",
        ours=Spread.of(assembled * per_node),
        unit="ns",
        our_error=derivative_error,
        error_of="against differences of the energy",
        guard=float(np.median(assembled)) / yardstick,
    )
    factor_and_solve()
    yield Row(
        name=f"discrete_rod.solve.{nodes}",
        what=f"factor and solve its band, {nodes:,} nodes, per node",
        ours=Spread.of(solved * per_node),
        unit="ns",
        peer="scipy solveh_banded (LAPACK)",
        theirs=Spread.of(solved_by_lapack * per_node),
        ratio=Spread.of(solved_by_lapack / solved),
        our_error=_backward_error(held, x, right),
        their_error=_backward_error(held, lapack(), right),
        error_of="backward error",
    )
    yield Row(
        name=f"discrete_rod.iteration.{nodes}",
        what=f"gradient, Hessian and solution, {nodes:,} nodes, per node",
        ours=Spread.of((assembled + solved) * per_node),
        unit="ns",
        most=MOST_NS,
        guard=float(np.median(assembled + solved)) / yardstick,
    )
    yield Row(
        name=f"discrete_rod.memory.{nodes}",
        what=f"memory, {nodes:,} nodes, per node",
        ours=Spread.of(np.array([_memory(nodes) / nodes])),
        unit="B",
        most=MOST_BYTES,
    )
    yield Row(
        name=f"discrete_rod.newton.{nodes}",
        what=f"one Newton iteration with line search, {nodes:,} nodes, per node",
        ours=Spread.of(iterated * per_node),
        unit="ns",
        guard=float(np.median(iterated)) / yardstick,
    )


def _derivative_error(chain: Chain, state: State, rod: Any, loads: Any, gradient: Array, lower: Array) -> float:
    """Return how far v.g and v.H v are from central differences of the energy of order 4, relative, for a smooth v."""
    edges, parts = chain.edges, np.empty(4)
    phase = np.linspace(0.0, 9.0, edges + 3)  # with the ghosts
    waves = np.stack([np.sin(phase), np.cos(2.0 * phase), np.sin(3.0 * phase), np.cos(phase)], axis=1)
    v = 0.02 * waves.ravel()[: chain.unknowns]

    def energy(h: float) -> float:
        new = State(*(part.copy() for part in state))
        discrete_rod.advance(state, v, h, new)
        return float(discrete_rod.energy(new, rod, loads, parts))

    h = 0.02
    E = {i: energy(i * h) for i in (-2, -1, 0, 1, 2)}
    first = (8.0 * (E[1] - E[-1]) - (E[2] - E[-2])) / (12.0 * h)
    second = (16.0 * (E[1] + E[-1]) - (E[2] + E[-2]) - 30.0 * E[0]) / (12.0 * h * h)
    curvature = float(v @ _times(lower, v))
    return max(abs(curvature - second) / abs(second), abs(float(v @ gradient) - first) / abs(h * second))


def _times(lower: Array, x: Array) -> Array:
    """Return A x of the symmetric band."""
    diagonals = lower.reshape(-1, band.LOWER).T
    result = diagonals[0] * x
    for k in range(1, band.LOWER):
        result[k:] += diagonals[k, :-k] * x[:-k]
        result[:-k] += diagonals[k, :-k] * x[k:]
    return np.asarray(result)


def _backward_error(lower: Array, x: Array, right: Array) -> float:
    """Return the largest |A x - b| over (|A| |x| + |b|), row by row."""
    scale = _times(np.abs(lower), np.abs(x)) + np.abs(right)
    return float(np.max(np.abs(_times(lower, x) - right) / scale))
