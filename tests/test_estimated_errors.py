"""The estimated errors of random rods against their true ones: none is below a third of the truth.

The truth is Newton's method from the answer, to 1e-12 with five stages; that this solves the rod's equations an independent
integration says. What the truth itself may be wrong by, by its own estimate, is taken off.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import darboux as dx
from darboux.statics.collocation_equations import Equations
from tests import strategies

MOST = 3.0  # of true over estimated
RTOLS = (1e-3, 1e-6, 1e-9)
TRUTH = dx.Collocation(rtol=1e-12, stages=5)
ANOTHER = 0.05  # of L: a coarse answer so far away is another equilibrium
ALMOST_STRAIGHT = (
    1e-3  # of a curvature times L: rounding over so small a stiffness moves a ring along what is nearly a family
)
WAY = np.cos(np.arange(13.0))  # some direction of the states
SHAKE = 1e-7  # of the start's states, to see what the integration makes of an error


@st.composite
def problems(draw: Any) -> dx.Equilibrium:
    """Those of `strategies`, with coupled sections and supports between the ends among them."""
    problem = draw(strategies.problems())
    if isinstance(problem, dx.Ring):
        return problem
    rod = problem.rod
    if draw(st.integers(0, 4)) == 0:
        k = rod.stiffness(np.zeros(1))
        GA, EI = 0.4 * float(k.EA[0]), (float(k.EI1[0]), float(k.EI2[0]), float(k.GJ[0]))
        parts = np.array(draw(st.lists(strategies.number(-1.0, 1.0), min_size=36, max_size=36))).reshape(6, 6)
        pure = np.eye(6) + 0.3 * parts @ parts.T
        unit = np.sqrt(np.array([GA, GA, float(k.EA[0]), *EI]) / np.diagonal(pure))
        section = dx.StiffnessMatrix(unit[:, None] * pure * unit, mass=float(rod.mass(np.zeros(1), "the test")[0]))
        rod = dataclasses.replace(rod, section=section, material=None, shear=rod.stretch and draw(st.booleans()))
        problem = dataclasses.replace(problem, rod=rod)
    if not problem.end.holds and not problem.between and draw(st.integers(0, 4)) == 0:
        s = rod.length * draw(strategies.number(0.2, 0.8))
        place = np.array(problem.start.position) + 0.9 * s * np.array(draw(strategies.directions()))
        problem = dataclasses.replace(problem, between={s: dx.Pinned(tuple(place))})
    return problem


def drawn(count: int) -> list[dx.Equilibrium]:
    """Return so many problems, always the same."""
    found: list[dx.Equilibrium] = []

    @settings(
        max_examples=count, derandomize=True, deadline=None, database=None, phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(problem=problems())
    def collect(problem: dx.Equilibrium) -> None:
        found.append(problem)

    collect()
    return found


def methods(i: int, rtol: float) -> dx.Collocation:
    """Four stages, as most users have; every fourth problem with another number of them."""
    return dx.Collocation(rtol=rtol, stages=(4, 4, 4, 2 if rtol == 1e-3 else 3)[i % 4])


def said(solution: dx.EquilibriumSolution, free: bool) -> dict[str, np.ndarray]:
    """Return what the errors are estimated of: places of both ends, forces and moments of all supports, energy.

    Of one of a family, which a free motion leads through, what is the same for all of it: of a rod that may turn about its chord
    the lengths of forces and moments, of a ring the energy.
    """
    found = solution.reactions
    held = [found.start, found.end, *found.between.values()]
    forces, moments = np.array([x.force for x in held]), np.array([x.moment for x in held])
    energy = np.array([[solution.energy.total]])
    if free and isinstance(solution.problem, dx.Ring):
        return {"energy": energy}
    if free:
        forces, moments = (np.linalg.norm(x, axis=1, keepdims=True) for x in (forces, moments))
    return {"tip": solution.curve.y[[0, -1], :3], "reactions": forces, "moments": moments, "energy": energy}


def is_free(solution: dx.EquilibriumSolution) -> bool:
    """Whether the equilibrium is one of a family, or nearly: a ring of a round straight rod may turn about its clamped tangent."""
    problem = solution.problem
    equations = Equations(problem, TRUTH.stages)
    almost = np.max(np.abs(problem.rod.k0(solution.s))) * problem.rod.length < ALMOST_STRAIGHT
    return equations.free_motions(equations.mesh_of(solution)) > 0 or (isinstance(problem, dx.Ring) and bool(almost))


def ratios(solution: dx.EquilibriumSolution, truth: dx.EquilibriumSolution) -> dict[str, float]:
    """Return true over estimated, what the truth may be wrong by taken off."""
    free = is_free(truth)
    found, exact = said(solution, free), said(truth, free)
    true = {name: float(np.max(np.linalg.norm(found[name] - exact[name], axis=1))) for name in found}
    return {
        name: max(0.0, error - getattr(truth.error, name)) / max(getattr(solution.error, name), 1e-300)
        for name, error in true.items()
    }


def compared(problems: list[dx.Equilibrium], rtols: tuple[float, ...]) -> Iterator[tuple[int, float, dict[str, float]]]:
    """Yield which problem, the tolerance and the ratios, for each that is solved and whose truth is found."""
    for i, problem in enumerate(problems):
        answers = {}
        for rtol in rtols:
            try:
                answers[rtol] = dx.solve(problem, methods(i, rtol), throw=False)
            except dx.InvalidInput:
                break
        answers = {rtol: answer for rtol, answer in answers.items() if answer.converged}
        truth = TRUTH.beside(problem, answers[min(answers)]) if answers else None
        if truth is None:
            continue
        for rtol, answer in answers.items():
            if np.max(np.linalg.norm(answer.r(truth.s) - truth.r(truth.s), axis=1)) < ANOTHER * problem.rod.length:
                yield i, rtol, ratios(answer, truth)


def integrated(solution: dx.EquilibriumSolution, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the states (13,) at the end by SciPy's eighth order from those at the start, and their units: the equations anew.

    r' = R v,  q' = q (0, k) / 2,  n' = -f,  m' = -r' x n - l,    (v, k) = (v0, k0) + C (R^T n, R^T m)
    """
    problem, rod = solution.problem, solution.problem.rod
    unit = np.repeat(
        [rod.length, 1.0, *(np.max(np.abs(solution.curve.y[:, a : a + 3])) or 1.0 for a in (7, 10))], [3, 4, 3, 3]
    )

    def slope(s: float, y: np.ndarray) -> np.ndarray:
        y, at = y * unit, np.array([s])
        a, b, c, d = q = y[3:7] / np.linalg.norm(y[3:7])
        R = np.array(
            [
                [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
                [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
                [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
            ]
        )
        strain = rod.compliance(at)[0] @ np.concatenate([R.T @ y[7:10], R.T @ y[10:13]])
        v, k = np.array([0.0, 0.0, 1.0]) + strain[:3], rod.k0(at)[0] + strain[3:]
        loads = problem.distributed(at)
        turn = 0.5 * np.array([-q[1:] @ k, *(q[0] * k + np.cross(q[1:], k))])
        dr = R @ v
        dm = -np.cross(dr, y[7:10]) - loads.couple(R[None])[0]
        return np.concatenate([dr, turn, -loads.force(y[None, :3], R[None])[0], dm]) / unit

    inner = [s for s in problem.breaks if 0.0 < s < rod.length]
    y = states / unit
    for low, high in zip([0.0, *inner], [*inner, rod.length], strict=True):
        y = solve_ivp(slope, (low, high), y, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    return y * unit, unit


def plain(problem: dx.Equilibrium) -> bool:
    """Whether n and m do not jump along the rod."""
    return not (problem.between or problem.steep_places or any(hasattr(load, "at") for load in problem.loads))


def failures(problems: list[dx.Equilibrium], rtols: tuple[float, ...]) -> list[str]:
    return [
        f"{name} of problem {i} at rtol {rtol:g}: true error {ratio:.3g} times the estimated one: {problems[i]}"
        for i, rtol, each in compared(problems, rtols)
        for name, ratio in each.items()
        if not ratio <= MOST
    ]


@pytest.mark.slow
def test_some_random_rods() -> None:
    problems = drawn(40)
    assert sum(1 for _ in compared(problems, (1e-6,))) > 20
    assert not failures(problems, (1e-3, 1e-6))


@pytest.mark.long
def test_a_thousand_random_rods() -> None:
    found = failures(drawn(1000), RTOLS)
    assert not found, "\n".join(found)


CABLES = [
    (1e3, 0.02, dx.Clamped(position=(950.0, 0, 0), tangent=(1, 0, 0)), 3),
    (1e3, 0.02, dx.Pinned((950.0, 0, 20.0)), 4),
    (1e3, 0.02, dx.Pinned((950.0, 0, 20.0)), 5),
    (30.0, 2e-3, dx.Clamped(position=(25.0, 0, 0), tangent=(1, 0, 0)), 5),
    (10.0, 1e-3, dx.Pinned((9.0, 0, 0)), 5),
]


@pytest.mark.parametrize(("length", "radius", "end", "stages"), CABLES)
def test_cables_whose_layers_are_thinner_than_the_elements(length: float, radius: float, end: Any, stages: int) -> None:
    """Halving them gains far less than the order promises, forces are a million times EI / L^2, and Newton's method stops early."""
    steel = dx.Material(E=210e9, nu=0.3, density=7850)
    rod = dx.Rod(length, dx.Circle(radius), steel)
    problem = dx.Equilibrium(rod, dx.Clamped(tangent=(1, 0, 0)), end, [dx.Gravity()])
    truth = TRUTH.beside(problem, dx.solve(problem))
    found = ratios(dx.solve(problem, dx.Collocation(rtol=1e-3, stages=stages)), truth)
    assert max(found.values()) < MOST, found


@pytest.mark.slow
def test_the_truth_solves_the_equations_of_the_rod() -> None:
    """SciPy's integration from its start leads to its end, but for what it makes of the digits that the start has lost."""
    tried, wanted = 0, 6
    for problem in [problem for problem in drawn(60) if plain(problem)]:
        if tried == wanted:
            return
        solution = dx.solve(problem, throw=False)
        if not solution.converged:
            continue
        truth = TRUTH.beside(problem, solution)
        first, last = truth.curve.y[0], truth.curve.y[-1]
        end, unit = integrated(truth, first)
        shaken = np.max(np.abs(integrated(truth, first + SHAKE * unit * WAY)[0] - end) / unit)
        if shaken > 1e3 * SHAKE:  # the integration tells little
            continue
        error = np.max(np.abs(end - last) / unit)
        assert error < 1e-10 * max(1.0, shaken / SHAKE), (problem, error, shaken)
        tried += 1
    pytest.fail(f"only {tried} of the problems could be integrated")
