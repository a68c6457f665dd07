"""The numbers of the paper's figures: each part solves its cases, for `paper.json` and for the pictures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux import comparison, frames
from darboux.loads import EndForce, Gravity
from darboux.paper import cases
from darboux.paper.equations import FLIP, PaperRod, integrate_as_printed
from darboux.problem import Equilibrium
from darboux.rod import Rod
from darboux.section import Stiffness
from darboux.solution import EquilibriumSolution
from darboux.statics.discrete import CLAMPS, DiscreteRod
from darboux.statics.elastica import Elastica
from darboux.statics.initial_value import integrate
from darboux.statics.shooting import Shooting
from darboux.statics.solve import solve

Array = NDArray[np.float64]
SEGMENTS = tuple(2**i for i in range(3, 11))  # 8 ... 1024


@dataclass
class Part:
    """What one part of the paper gives: ``numbers`` for the file (SI), ``solutions`` and ``data`` for the pictures."""

    numbers: dict[str, Any] = field(default_factory=dict)
    solutions: dict[str, EquilibriumSolution] = field(default_factory=dict)
    comparisons: dict[str, comparison.Comparison] = field(default_factory=dict)
    data: dict[str, Any] = field(default_factory=dict)


def compile_kernels() -> None:
    """Solve a small rod by every method, so that the times of the comparison hold no compiling."""
    for stretch in (False, True):
        small = Equilibrium(
            Rod(1.0, Stiffness(EI1=1.0, GJ=1.0, EA=1e3), stretch=stretch), loads=[EndForce((0.1, 0.0, 0.0))]
        )
        for method in (Shooting(), DiscreteRod(4), *([] if stretch else [Elastica()])):
            solve(small, method)


def geometry() -> Part:
    """Figures 1 to 4: the rod that they are drawn from, a short thick filament bent and twisted by its end loads."""
    solution = Shooting().solve(cases.geometry()).check()
    return Part({"figure1to4": {"tip": solution.tip.tolist()}}, {"rod": solution})


def figure5() -> Part:
    """The cantilever under its own weight, by every method in every model it states, and the convergence of DER."""
    part = Part()
    numbers: dict[str, Any] = {}
    for model, problem in (("inextensible", cases.figure5()), ("stretch", cases.figure5(stretch=True))):
        methods: dict[str, Any] = {"shooting": Shooting(), "elastica": Elastica()}
        methods |= {name: DiscreteRod(segments=n) for name, n in cases.FIGURE5_SEGMENTS.items()}
        two_vertices = {
            f"{name}_two_vertices": DiscreteRod(n, "two_vertices") for name, n in cases.FIGURE5_SEGMENTS.items()
        }
        methods = {name: method for name, method in (methods | two_vertices).items() if method.refuses(problem) is None}
        found = comparison.compare(problem, list(methods.values()))
        part.comparisons[model] = found
        numbers[model] = {}
        for name, entry in zip(methods, found.entries, strict=True):
            solution = entry.solution
            part.solutions[f"{model}.{name}"] = solution
            numbers[model][name] = {
                "tip": solution.tip.tolist(),
                "converged": solution.converged,
                "centreline_distance": entry.distance.centreline,
                "tip_distance": entry.distance.tip,
            }
            if name in ("shooting", "elastica"):
                numbers[model][name]["root_curvature"] = float(np.linalg.norm(solution.k(0.0)[:2]))
        part.data[model] = errors = _convergence(problem, part.solutions[f"{model}.shooting"])
        for clamp, row in errors.items():
            numbers[model][f"discrete_errors_{clamp}"] = dict(zip(map(str, SEGMENTS), row, strict=True))
    numbers["order"] = {clamp: _observed_orders(part.data["stretch"][clamp])[-1] for clamp in CLAMPS}
    part.numbers = {"figure5": numbers}
    return part


def _convergence(problem: Equilibrium, reference: EquilibriumSolution) -> dict[str, list[float]]:
    """Return the tip's distance from the reference, relative to L, for N = 8 ... 1024 in both clamps."""
    errors: dict[str, list[float]] = {}
    for clamp in CLAMPS:
        solutions = [DiscreteRod(N, clamp).solve(problem) for N in SEGMENTS]
        L = problem.rod.length
        errors[clamp] = [
            float(np.linalg.norm(x.tip - reference.tip)) / L if x.converged else float("nan") for x in solutions
        ]
    return errors


def _observed_orders(errors: list[float]) -> list[float]:
    return [float(order) for order in np.log2(np.array(errors[:-1]) / np.array(errors[1:]))]


def figure6() -> Part:
    """The terminal moment, as an initial and as a boundary value problem, by DER, and the exact helix."""
    problem = cases.figure6()
    rod = problem.rod
    solutions = {
        "initial_value": integrate(rod, k=cases.FIGURE6_K, rtol=1e-12),
        "shooting": Shooting().solve(problem),
        "discrete_100": DiscreteRod(100).solve(problem),
    }
    s = np.linspace(0.0, rod.length, 401)
    exact = cases.exact_helix6(s)
    numbers: dict[str, Any] = {"exact": {**_helix_of(exact, problem), "tip": exact[-1].tolist()}}
    for name, solution in solutions.items():
        numbers[name] = {
            **_helix_of(solution.r(s), problem),
            "tip": solution.tip.tolist(),
            "centreline_distance": float(np.max(np.linalg.norm(solution.r(s) - exact, axis=1))) / rod.length,
        }
    errors = [float(np.linalg.norm(DiscreteRod(N).solve(problem).tip - exact[-1])) / rod.length for N in SEGMENTS[2:]]
    numbers["discrete_errors"] = dict(zip(map(str, SEGMENTS[2:]), errors, strict=True))
    numbers["discrete_order"] = _observed_orders(errors)[-1]
    return Part({"figure6": numbers}, solutions, data={"s": s, "exact": exact})


def _helix_of(r: Array, problem: Equilibrium) -> dict[str, float]:
    """Return radius and pitch of the helix about the end moment's direction that lies nearest to the points r (n, 3).

    Across the axis the points lie on a circle, fitted by linear least squares: |p|^2 = 2 c . p + (a^2 - |c|^2).
    """
    moment = problem.end_load("end").moment
    axis = moment / np.linalg.norm(moment)
    e = np.linalg.svd(np.eye(3) - np.outer(axis, axis))[0][:, :2]
    p = r @ e
    fit, *_ = np.linalg.lstsq(np.column_stack([2.0 * p, np.ones(len(p))]), np.sum(p**2, axis=1), rcond=None)
    centre = fit[:2]
    angle = np.unwrap(np.arctan2(*(p - centre).T[::-1]))
    rise = float((r[-1] - r[0]) @ axis)
    return {
        "radius": float(np.sqrt(fit[2] + centre @ centre)),
        "pitch": abs(2.0 * np.pi * rise / float(angle[-1] - angle[0])),
    }


def figure7() -> Part:
    """The two helices under gravity, in both readings: (a) the printed initial value problem, (b) natural curvature."""
    part = Part()
    numbers: dict[str, Any] = {"a": {}, "b": {}}
    for orientation in ("vertical", "horizontal"):
        a, b = cases.figure7("a", orientation), cases.figure7("b", orientation)
        k = cases.FIGURE7_K * FLIP
        part.solutions[f"a.{orientation}"] = integrate(a.rod, k=k, frame=a.start.R, loads=a.loads, rtol=1e-10)
        part.solutions[f"b.{orientation}"] = Shooting().solve(b).check()
        part.solutions[f"b.{orientation}.natural"] = integrate(b.rod, k=cases.FIGURE7_K, frame=b.start.R)
        for reading in ("a", "b"):
            solution = part.solutions[f"{reading}.{orientation}"]
            numbers[reading][orientation] = {"tip": solution.tip.tolist()}
    part.numbers = {"figure7": numbers}
    return part


def rotating() -> Part:
    """The paper's next step: a filament in a rotating system, at several speeds."""
    solutions = {f"{f:g}": Shooting().solve(cases.rotating(f)).check() for f in cases.TURNS_PER_SECOND}
    numbers = {f"{f}_turns_per_second": {"tip": x.tip.tolist()} for f, x in solutions.items()}
    return Part({"rotating": numbers}, solutions)


def charged() -> Part:
    """The paper's next step: a charged filament in an electric field, at several strengths."""
    solutions = {f"{E:g}": Shooting().solve(cases.charged(E)).check() for E in cases.FIELDS}
    return Part({"charged": {f"{E}_volt_per_metre": {"tip": x.tip.tolist()} for E, x in solutions.items()}}, solutions)


def invariants() -> Part:
    """Along an unloaded rod n, m + r x n, m . n, and m . d3 of an isotropic one, are constant: their largest drift."""
    rod = Rod(length=1.0, section=Stiffness(EI1=1.0, GJ=0.7))
    curve = integrate(rod, k=(3.0, -4.0, 5.0), n=(2.0, -3.0, 4.0), rtol=1e-12)
    s = np.linspace(0.0, 1.0, 201)
    r, n, m, d3 = curve.r(s), curve.n(s), curve.m(s), curve.R(s)[:, :, 2]
    quantities = {
        "n": n,
        "m_plus_r_cross_n": m + np.cross(r, n),
        "m_dot_n": np.sum(m * n, axis=1)[:, None],
        "m_dot_d3": np.sum(m * d3, axis=1)[:, None],
    }
    drift = {
        name: float(np.max(np.linalg.norm(value - value[0], axis=1)) / np.linalg.norm(value[0]))
        for name, value in quantities.items()
    }
    return Part({"invariants": drift})


def conventions() -> Part:
    """The printed left-handed equations against ours, on random anisotropic rods under gravity."""
    rng = np.random.default_rng(2022)
    s = np.linspace(0.0, 1.0, 51)
    worst = 0.0
    for _ in range(5):
        EI1, EI2, D = rng.uniform(0.5, 2.0, 3)
        k, n = rng.uniform(-3.0, 3.0, 3), rng.uniform(-2.0, 2.0, 3)
        R = frames.matrix_of_quaternion(rng.normal(size=4))
        rod = Rod(length=1.0, section=Stiffness(EI1=EI1, EI2=EI2, GJ=D, mass=1.0 / 9.81))
        ours = integrate(rod, k=k, n=R @ n, frame=R, loads=[Gravity()], rtol=1e-12)
        printed = integrate_as_printed(PaperRod(EI1, EI2, D, weight=1.0), 1.0, k, n, R, s, rtol=1e-12, method="RK45")
        worst = max(worst, float(np.max(np.linalg.norm(ours.r(s) - printed, axis=1))))
    return Part({"conventions": {"max_difference": worst, "rods": 5}})


# What `darboux paper` runs: the name after --only, what it is, how it is computed.
PARTS: dict[str, tuple[str, Callable[[], Part]]] = {
    "1-4": ("figures 1 to 4: the geometry of a rod", geometry),
    "5": ("figure 5: a cantilever under its own weight", figure5),
    "6": ("figure 6: a terminal moment", figure6),
    "7": ("figure 7: two helices under gravity", figure7),
    "rotating": ("next: a rotating filament", rotating),
    "charged": ("next: a charged filament", charged),
    "invariants": ("invariants of unloaded rods", invariants),
    "conventions": ("the printed equations against ours", conventions),
}
