"""The neutral judge: scenarios, references and metrics of cosseratbench, ours beside the suite's own adapters.

Each scenario runs through our adapter and one peer's by turns, three of them (one where the peer takes more than 5 s), all
at the suite's number of elements; the time is that of `run`, after a short run that compiles. The target of a row is less
time than the peer; its error is the suite's metric, held against its own target in the note. Peers that do not complete a
scenario are named. Below stand the suite's variants, one change at a time, by our adapter alone, each run once: harder cases,
half and twice the elements, longer steps.

- In the catenary the suite's reference has no bending stiffness, which the rod that it describes has: that rod, by collocation,
  hangs 4.8e-4 of its length off the reference, and so must every right answer. The true error stands in the note: the
  largest distance from the rod with its bending stiffness, by `Collocation`, over the length.
- The twist is read off the growth of six slightly bent rods. On exact growth rates, from a Galerkin solution of the
  reference's own equation, B w'''' - i M w''' - T w'' = 0 with inertia and damping, the suite's fit says 0.21 %.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from typing import Any

import numpy as np

import darboux as dx
from benchmarks.timing import Row, Spread

# Of each scenario: its metric, and what it must stay below.
TARGETS = {
    "cantilever": ("tip_deflection_error", 2e-3),
    "catenary": ("shape_error", 1e-4),
    "pendulum": ("period_error", 5e-5),
    "twist": ("critical_twist_error", 5e-3),
}
PEERS = {"pyelastica": "elastica", "mujoco": "mujoco"}
LONG = 5.0  # s: a turn that takes so long is one alone
BEYOND = {("twist", "mujoco"): "mujoco was not asked for twist: its clamps give way, as the suite's notes say."}


def rows(quick: bool) -> Iterator[Row | str]:
    if find_spec("cosseratbench") is None:
        yield "cosseratbench is not installed here, so the neutral judge was not asked: pip install 'darboux[bench]'."
        return
    scenarios = ("cantilever", "catenary") if quick else tuple(TARGETS)
    for peer, package in PEERS.items():
        if find_spec(package) is None:
            yield f"{package} is not installed here, so cosseratbench did not run it: pip install 'darboux[bench]'."
            continue
        for scenario in scenarios:
            beyond = BEYOND.get((scenario, peer))
            yield beyond or _row(scenario, peer, 1 if quick else 3)
    for scenario in scenarios:
        yield from _variants(scenario)


def _row(scenario: str, peer: str, rounds: int) -> Row | str:
    from cosseratbench import experiment, registry

    from darboux.cosseratbench import DarbouxSolver

    asked, other = registry.load_experiment(scenario), registry.load_solver(peer)
    metric, _ = TARGETS[scenario]
    ours: list[Any] = []
    theirs: list[Any] = []
    for _ in range(rounds):
        theirs.append(experiment.run(asked, other))
        if theirs[-1].outcome != experiment.COMPLETED:
            return f"{peer} does not complete {scenario}: {theirs[-1].failure or theirs[-1].missing}."
        ours.append(experiment.run(asked, DarbouxSolver()))
        if theirs[-1].wall_time > LONG:
            break
    a, b = (np.array([result.wall_time for result in results]) for results in (ours, theirs))
    return Row(
        name=f"neutral_judge.{scenario}.{peer}",
        what=f"cosseratbench, {scenario}, {asked.n_elements} elements",
        ours=Spread.of(a),
        unit="s",
        peer=peer,
        theirs=Spread.of(b),
        ratio=Spread.of(b / a),
        least_ratio=1.0,
        our_error=ours[-1].metrics[metric],
        their_error=theirs[-1].metrics[metric],
        error_of=metric.replace("_", " "),
        note=_judged(scenario, asked.scenario, ours[-1], theirs[-1]),
    )


def _variants(scenario: str) -> Iterator[Row]:
    """Judge ours in each of the suite's variants; the ordinary case has its rows already."""
    from cosseratbench import experiment, registry, variations

    from darboux.cosseratbench import DarbouxSolver

    asked = registry.load_experiment(scenario)
    metric, _ = TARGETS[scenario]
    for variant in variations.variants(asked, ["all"])[1:]:
        result = experiment.run(
            asked, DarbouxSolver(**variant.options), values=variant.parameters, n_elements=variant.n_elements
        )
        yield Row(
            name=f"neutral_judge.{scenario}.{variant.key}",
            what=f"cosseratbench, {scenario}, {variant.key.replace('_', ' ').replace('=', ' ')}",
            ours=Spread.of(np.array([result.wall_time])),
            unit="s",
            our_error=result.metrics[metric],
            error_of=metric.replace("_", " "),
            note=_judged(scenario, asked.scenario_for(**variant.parameters), result),
        )


def _judged(scenario: str, case: Any, ours: Any, theirs: Any = None) -> str:
    """Return how our result stands to the target of its scenario; in the catenary by the true errors too."""
    metric, largest = TARGETS[scenario]
    said = [_against("error", ours.metrics[metric], largest)]
    if scenario == "catenary":
        exact = _catenary(case)
        error = _off(ours, exact)
        said.append(_against(f"true error {error:.1e}", error, largest))
        if theirs is not None:
            said.append(f"theirs {_off(theirs, exact):.1e}")
    return "; ".join(said)


def _against(what: str, error: float, largest: float) -> str:
    return f"{what} {'meets' if error < largest else 'MISSES'} its target, {largest:g}"


def _catenary(case: Any) -> dx.EquilibriumSolution:
    """Return the rod that the suite's catenary describes, bending stiffness and all, converged."""
    rod = case.rods[0]
    material = dx.Material(rod.material.youngs_modulus, G=rod.material.shear_modulus, density=rod.material.density)
    problem = dx.Equilibrium(
        dx.Rod(rod.length, dx.Circle(radius=rod.radius), material, stretch=True),
        start=dx.Pinned(rod.centerline[0]),
        end=dx.Pinned(rod.centerline[-1]),
        loads=[dx.Gravity(case.gravity)],
    )
    return dx.solve(problem, dx.Collocation(rtol=1e-9))


def _off(result: Any, exact: dx.EquilibriumSolution) -> float:
    """Return the largest distance of a vertex at rest from the exact curve, over the length."""
    from cosseratbench.metrics import max_distance_to_curve

    length = exact.problem.rod.length
    curve = exact.r(np.linspace(0.0, length, 2001))
    return float(max_distance_to_curve(result.trajectory.positions[0][-1], curve)) / length
