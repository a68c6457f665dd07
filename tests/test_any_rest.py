"""Random rods that buckle, wind, hang and snap: each ends in a stable equilibrium, cold and by default.

What is found is checked by what shares nothing with the solver: the balances of forces and moments and the centreline, integrated
by Gauss' rule over short intervals, and the places that the supports hold.
"""

from __future__ import annotations

import itertools
import os

import numpy as np
import pytest

import darboux as dx

UP = (0.0, 0.0, 1.0)
COUNT = int(os.environ.get("DARBOUX_FUZZ", "0")) or 150
NAMED = {"folded", "no_convergence"}


def drawn(seed: int) -> dx.Equilibrium:
    """Loads of 0.5 to 5 times a critical one, stiffness ratios 1 to 1,000, 0 to 20 supports between, 0 to 6 turns."""
    rng = np.random.default_rng([16, seed])
    ratio = float(10.0 ** rng.uniform(0.0, 3.0)) if rng.random() < 0.6 else 1.0
    stretches, compliance = rng.random() < 0.4, float(10.0 ** rng.uniform(-7.0, -2.0))
    natural, GJ = tuple(rng.normal(size=3) * rng.choice([0.0, 0.3, 3.0])), float(rng.uniform(0.6, 1.0))
    times = float(rng.uniform(0.5, 5.0))
    tilt = rng.normal(size=3) * rng.choice([0.0, 1e-3, 0.1])
    kind = rng.choice(["column", "rollers", "pushed", "wrung", "hung"])
    count = int(rng.integers(1, 21)) if kind == "rollers" else 0
    largest = 5.0 * 4.0 * np.pi**2 * (count + 1) ** 2  # of the forces
    EA = largest / compliance if stretches else None
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=ratio, GJ=GJ, EA=EA), natural=natural, stretch=stretches)
    if kind == "column":
        ends = [
            ({}, np.pi**2 / 4),
            ({"start": dx.Pinned(), "end": dx.Roller(along=UP)}, np.pi**2),
            ({"end": dx.Roller(along=UP)}, 20.19),
            ({"end": dx.Slider(along=UP, position=UP)}, 4 * np.pi**2),
        ]
        supports, critical = ends[rng.integers(len(ends))]
        force = times * critical * (np.array([0, 0, -1.0]) + tilt)
        return dx.Equilibrium(rod, **supports, loads=[dx.EndForce(tuple(force))])
    if kind == "rollers":
        between = {(i + 1) / (count + 1): dx.Roller(along=UP) for i in range(count)}
        force = times * (np.pi * (count + 1)) ** 2
        return dx.Equilibrium(rod, dx.Pinned(), dx.Roller(along=UP), [dx.EndForce((0, 0, -force))], between=between)
    if kind == "pushed":
        twist = float(rng.uniform(0.0, 6.0)) * dx.turn if rng.random() < 0.5 else 0.0
        place = (0.0, 0.0, float(1.0 - 10.0 ** rng.uniform(-3.0, -0.3)))
        return dx.Equilibrium(rod, end=dx.Clamped(position=place, twist=twist))
    if kind == "wrung":
        end = dx.Slider(along=UP, position=UP, twist=float(rng.uniform(0.0, 6.0)) * dx.turn)
        return dx.Equilibrium(rod, end=end, loads=[dx.EndForce((0, 0, float(rng.uniform(0.0, 40.0))))])
    weight = times * 7.84 * (np.array([0.0, 0.0, -1.0]) + tilt)
    return dx.Equilibrium(rod, loads=[dx.LineForce(tuple(weight))])


def defect(found: dx.EquilibriumSolution) -> float:
    """The largest defect of the equations over all intervals between stations."""
    problem, worst = found.problem, 0.0
    places = [0.0, *problem.stations, problem.rod.length]
    for a, b in itertools.pairwise(places):
        s = np.unique(
            np.concatenate([np.linspace(a, b, 9), found.s[(found.s > a) & (found.s < b)]])
        )  # where layers are
        y = np.concatenate([found.r(s), found.n(s, side="behind"), found.m(s, side="behind")], axis=1)
        y[-1, 3:] = np.concatenate([found.n(b, side="before"), found.m(b, side="before")])
        worst = max(worst, _over(found, s, y))
    return worst


def _over(found: dx.EquilibriumSolution, s: np.ndarray, y: np.ndarray) -> float:
    """The largest defect of r' = R v, n' = -f and m' = n x r' over an interval, by Gauss' rule of six points, over their sizes."""
    points, weights = np.polynomial.legendre.leggauss(6)
    worst = 0.0
    sizes = [1.0, 1.0 + float(np.max(np.abs(y[:, 3:6]))), 1.0 + float(np.max(np.abs(y[:, 6:])))]
    for i in range(len(s) - 1):
        h = s[i + 1] - s[i]
        x = s[i] + 0.5 * h * (1.0 + points)
        slope = np.einsum("nij,nj->ni", found.R(x), found.v(x))
        f = found.problem.distributed(x).a
        n, w = found.n(x), 0.5 * h * weights
        gaps = (
            y[i + 1, :3] - y[i, :3] - w @ slope,
            y[i + 1, 3:6] - y[i, 3:6] + w @ f,
            y[i + 1, 6:] - y[i, 6:] - w @ np.cross(n, slope),
        )
        worst = max(worst, *(float(np.max(np.abs(gap))) / size for gap, size in zip(gaps, sizes, strict=True)))
    return worst


def outcome(seed: int) -> str:
    """What became of a problem, and if it was solved, whether that holds."""
    problem = drawn(seed)
    found = dx.solve(problem, throw=False)
    if not found.converged:
        return f"named: {found.status.code}" if found.status.code in NAMED else f"wrong: {found.status.code}"
    if found.index != 0:
        return f"unstable: {found.index}"
    gap = defect(found)
    if gap > 1e-6:
        return f"wrong: off by {gap:.1e}"
    for name in ("start", "end"):
        at = getattr(problem, name)
        tip = found.r(0.0 if name == "start" else problem.rod.length)
        held = np.array(at.held_displacement) @ np.abs(at.displacement_axes.T @ (tip - np.array(at.position)))
        if held > 1e-8:
            return f"wrong: the {name} is {held:.1e} off its support"
    return "solved"


@pytest.mark.parametrize("seed", range(COUNT))
def test_it_comes_to_rest(seed: int) -> None:
    found = outcome(seed)
    assert found == "solved" or found.startswith("named")
