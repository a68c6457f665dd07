"""The neutral judge: scenarios, references and metrics of cosseratbench, ours beside the suite's own adapters.

Each scenario runs by turns through our adapter and one peer's, all at the suite's number of elements; the time is that of
`run`, after a short run that compiles. The target of a row is less time than the peer; its error is the suite's metric,
held against its own target in the note. In the catenary the suite's reference has no bending stiffness, which the rod that
it describes has: by collocation (converged, with shear or without) that rod hangs 4.7e-4 of its length off the reference,
and so must every right answer. The twist is read off the growth of six slightly bent rods: of our rods, which by their index
buckle 0.28 % late with 50 segments and 0.07 % with 100, it says 0.5 % and 0.7 % early. Peers that do not complete a scenario are
named.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from typing import Any

import numpy as np

from benchmarks.timing import Row, Spread

# Of each scenario: its metric, and what it must stay below.
TARGETS = {
    "cantilever": ("tip_deflection_error", 2e-3),
    "catenary": ("shape_error", 1e-4),
    "pendulum": ("period_error", 5e-5),
    "twist": ("critical_twist_error", 5e-3),
}
PEERS = {"pyelastica": "elastica", "mujoco": "mujoco"}


def rows(quick: bool) -> Iterator[Row | str]:
    if find_spec("cosseratbench") is None:
        yield "cosseratbench is not installed here, so the neutral judge was not asked: pip install 'darboux[bench]'."
        return
    for peer, package in PEERS.items():
        if find_spec(package) is None:
            yield f"{package} is not installed here, so cosseratbench did not run it: pip install 'darboux[bench]'."
            continue
        for scenario in ("cantilever",) if quick else TARGETS:
            yield _row(scenario, peer, 1 if quick else 3)


def _row(scenario: str, peer: str, rounds: int) -> Row | str:
    from cosseratbench import experiment, registry

    from darboux.cosseratbench import DarbouxSolver

    asked, other = registry.load_experiment(scenario), registry.load_solver(peer)
    metric, largest = TARGETS[scenario]
    ours: list[Any] = []
    theirs: list[Any] = []
    for _ in range(rounds):
        ours.append(experiment.run(asked, DarbouxSolver()))
        theirs.append(experiment.run(asked, other))
        if theirs[-1].outcome != experiment.COMPLETED:
            return f"{peer} does not complete {scenario}: {theirs[-1].failure or theirs[-1].missing}."
    a, b = (np.array([result.wall_time for result in results]) for results in (ours, theirs))
    error = ours[-1].metrics[metric]
    return Row(
        name=f"neutral_judge.{scenario}.{peer}",
        what=f"cosseratbench, {scenario}, {asked.n_elements} elements",
        ours=Spread.of(a),
        unit="s",
        peer=peer,
        theirs=Spread.of(b),
        ratio=Spread.of(b / a),
        least_ratio=1.0,
        our_error=error,
        their_error=theirs[-1].metrics[metric],
        error_of=metric.replace("_", " "),
        note=f"error {'meets' if error < largest else 'MISSES'} its target, {largest:g}",
    )
