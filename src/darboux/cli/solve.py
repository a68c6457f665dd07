"""`darboux solve`."""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer

from darboux.cli.shell import (
    INTERRUPTED,
    Anywhere,
    Json,
    KeptIn,
    Quiet,
    ScenarioFile,
    check_result,
    console,
    scenario_of,
    show,
)
from darboux.errors import NotConverged


def solve(
    file: ScenarioFile,
    method: Annotated[
        str | None,
        typer.Option("--method", metavar="M", help="collocation, shooting, elastica or discrete; else the file's."),
    ] = None,
    out: KeptIn = None,
    json: Json = False,
    quiet: Quiet = False,
    anywhere: Anywhere = False,
) -> None:
    """Find the equilibrium: status, tip, reactions, moments, energy, error, stability, and a small picture."""
    import time

    began = time.perf_counter()
    from darboux import scenario

    stated = scenario_of(file, anywhere)
    check_result(out, file)
    solver = scenario.method(method, stated.method) if method else stated.method
    from darboux.statics.solve import solve as solved

    with waiting(f"solving {file.name}; a first run compiles for about half a minute", quiet or json):
        solution = solved(stated.problem, solver, throw=False)
    if out is not None:
        from darboux import store

        store.save(solution, out)
    seconds = time.perf_counter() - began
    kept = "" if out is None else f"Kept in {out}: darboux plot {out}"
    show("report", solution, file.stem, seconds, json, quiet, kept)
    if solution.status.code == "stopped":
        raise typer.Exit(INTERRUPTED)
    if not solution.converged:
        raise NotConverged(solution.status.message, solution)


def waiting(words: str, silent: bool) -> Any:
    """Return a spinner on standard error, where a person looks on."""
    import contextlib

    if silent or not sys.stderr.isatty():
        return contextlib.nullcontext()
    return console(err=True).status(words)
