"""`darboux export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from darboux.cli.shell import Quiet, ResultFile, equilibrium
from darboux.errors import InvalidInput

FORMS = ("csv",)
MOST_SAMPLES = 1_000_000
COLUMNS = (
    "s (m)",
    *(f"{name} (m)" for name in ("x", "y", "z")),
    *(f"d{i}{axis}" for i in (1, 2, 3) for axis in "xyz"),
    *(f"k{i} (1/m)" for i in (1, 2, 3)),
    *(f"n{axis} (N)" for axis in "xyz"),
    *(f"m{axis} (N m)" for axis in "xyz"),
)


def export(
    result: ResultFile,
    to: Annotated[str, typer.Option("--to", metavar="FORM", help="csv: a line for each place along the rod.")] = "csv",
    samples: Annotated[int, typer.Option("--samples", metavar="N", help="Equally spaced places along the rod.")] = 201,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Where to write it; else RESULT.csv.")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Write a result for other programs: position, directors, curvature, force and moment along the rod, in SI."""
    import numpy as np

    from darboux import checks, files

    checks.choice("--to", to, FORMS)
    if not 2 <= samples <= MOST_SAMPLES:
        raise InvalidInput(f"--samples is {samples}; it must lie between 2 and {MOST_SAMPLES}.")
    solution = equilibrium(result)
    s = np.linspace(0.0, solution.problem.rod.length, samples)
    directors = solution.R(s).transpose(0, 2, 1).reshape(samples, 9)
    data = np.column_stack([s, solution.r(s), directors, solution.k(s), solution.n(s), solution.m(s)])
    path = out or Path(f"{result.stem}.csv")
    with files.replacing(path) as temporary:
        np.savetxt(temporary, data, fmt="%.17g", delimiter=",", header=",".join(COLUMNS), comments="")
    if not quiet:
        typer.echo(f"Written to {path}: {samples} places, {len(COLUMNS)} columns.")
