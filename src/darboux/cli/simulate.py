"""`darboux simulate`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from darboux.cli.shell import (
    INTERRUPTED,
    Anywhere,
    Json,
    KeptIn,
    Quiet,
    ScenarioFile,
    check_result,
    result_of,
    scenario_of,
    show,
)
from darboux.errors import InvalidInput, NotConverged


def simulate(
    file: ScenarioFile,
    method: Annotated[
        str | None,
        typer.Option("--method", metavar="M", help="implicit_midpoint, tr_bdf2 or stormer_verlet; else the file's."),
    ] = None,
    out: KeptIn = None,
    before: Annotated[
        Path | None,
        typer.Option(
            "--continue", metavar="RESULT", help="Go on from the last record of a result, to the file's duration."
        ),
    ] = None,
    records: Annotated[
        int | None, typer.Option("--records", metavar="N", help="Equal intervals of time between records; else 200.")
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
    anywhere: Anywhere = False,
) -> None:
    """Follow the motion that a scenario states: tip, energy and how well it is kept; Ctrl-C keeps what was reached."""
    import time

    began = time.perf_counter()
    from darboux import files, scenario
    from darboux.dynamics.simulate import simulate as simulated
    from darboux.solution import EquilibriumSolution

    stated = scenario_of(file, anywhere)
    if stated.motion is None:
        raise InvalidInput(
            f'{file} states no motion; add the table [motion] with duration = "1 s", or use darboux solve.'
        )
    check_result(out, file)
    chosen = scenario.method(method, stated.motion_method, of_motion=True) if method else stated.motion_method
    reached = None if before is None else result_of(before)
    if isinstance(reached, EquilibriumSolution):
        raise InvalidInput(
            f"--continue is {before}, which holds an equilibrium; a motion goes on from a motion's result."
        )
    trajectory = simulated(
        stated.motion,
        chosen,
        records=records,
        start_from=reached,
        out=out,
        throw=False,
        progress=not (quiet or json) and sys.stderr.isatty(),
    )
    seconds = time.perf_counter() - began
    if out is not None and files.part_of(out).exists():  # there was no room to finish it
        out = files.part_of(out)
    kept = "" if out is None else f"Kept in {out}: darboux info {out}"
    if out is not None and trajectory.status.code == "stopped":
        kept = f"Kept in {out}; go on by: darboux simulate {file} --continue {out} --out {out}"
    show("motion_report", trajectory, file.stem, seconds, json, quiet, kept)
    if trajectory.status.code == "stopped":
        raise typer.Exit(INTERRUPTED)
    if not trajectory.converged:
        raise NotConverged(trajectory.status.message, trajectory)
