"""`darboux plot`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from darboux.cli.shell import Quiet, ResultFile, equilibrium
from darboux.errors import InvalidInput

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ENDINGS = (".png", ".svg", ".pdf")


def plot(
    result: ResultFile,
    what: Annotated[
        str, typer.Option("--what", metavar="W", help="shape, moments, curvature, energy or stress.")
    ] = "shape",
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FIGURE", help="Where to draw it: .png, .svg or .pdf.")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Draw a result: its shape in space, or moments, curvature, energy, stress along the rod."""
    from darboux.view import plots

    path = figure_file(out, Path(f"{result.stem}-{what}.png"))
    write_figure(plots.draw(equilibrium(result), what), path)
    if not quiet:
        typer.echo(f"Drawn in {path}")


def figure_file(asked: Path | None, default: Path) -> Path:
    """Return where a figure goes, or say which endings there are."""
    path = asked or default
    if path.suffix.lower() not in ENDINGS:
        raise InvalidInput(f"--out is {str(path)!r}; a figure's name ends in {', '.join(ENDINGS)}.")
    return path


def write_figure(figure: Figure, path: Path) -> None:
    """Write a figure in our style, whole or not at all."""
    from darboux import files
    from darboux.view import style

    metadata = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(path.suffix.lower())
    with style.article(), files.replacing(path) as temporary:
        figure.savefig(temporary, dpi=200.0, metadata=metadata)
