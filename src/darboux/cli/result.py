"""What a verb that draws is given: a result, or a scenario, which is solved."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from darboux.cli.shell import SCENARIO, result_of, scenario_of
from darboux.errors import NotConverged

if TYPE_CHECKING:
    from darboux.solution import EquilibriumSolution
    from darboux.trajectory import Trajectory


def found(file: Path, anywhere: bool) -> EquilibriumSolution | Trajectory:
    """Return what a result holds, or the answer to a scenario: its motion where it states one."""
    if file.suffix.lower() != SCENARIO:
        return result_of(file)
    stated = scenario_of(file, anywhere)
    if stated.motion is not None:
        from darboux.dynamics.simulate import simulate

        return simulate(stated.motion, stated.motion_method, throw=False)
    from darboux.statics.solve import solve

    return solve(stated.problem, stated.method, throw=False)


def refuse_unconverged(file: Path, result: EquilibriumSolution | Trajectory) -> None:
    """Raise ``NotConverged`` where a scenario was not solved to its end; a result that was kept has said so before."""
    if file.suffix.lower() == SCENARIO and not result.converged:
        raise NotConverged(result.status.message, result)
