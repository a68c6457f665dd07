"""The command `darboux`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from darboux.errors import InvalidInput, NotConverged

app = typer.Typer(
    help="Elastic filaments: shapes, forces and stability of thin rods by Kirchhoff's theory.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
)


def _version(wanted: bool) -> None:
    if wanted:
        from darboux import __version__

        typer.echo(f"darboux {__version__}")
        raise typer.Exit


@app.callback()
def darboux(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Elastic filaments: shapes, forces and stability of thin rods by Kirchhoff's theory."""


@app.command(epilog="Example: darboux paper --only 5 --out my-figures")
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


def main() -> None:
    """Run the command; a mistake is one sentence on standard error: exit status 2 bad input, 1 not converged."""
    try:
        app()
    except InvalidInput as mistake:
        _complain(f"InvalidInput: {mistake}", 2)
    except NotConverged as failure:
        _complain(f"NotConverged: {failure}", 1)


def _complain(sentence: str, status: int) -> None:
    typer.echo(sentence, err=True)
    sys.exit(status)
