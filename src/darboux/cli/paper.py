"""`darboux paper`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def paper(
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only",
            metavar="NAME",
            help="One part: 1 ... 7, rotating, charged, invariants, conventions; may be repeated.",
        ),
    ] = None,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="The folder to write to; made where it is missing.")
    ] = Path("paper-figures"),
) -> None:
    """Recompute the paper: figures 1 to 7 as PNG and SVG, paper.json with every number, the table on the screen."""
    from darboux.paper.run import run

    run(only or [], out)
