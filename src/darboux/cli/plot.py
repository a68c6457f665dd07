"""`darboux plot`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from darboux.cli.shell import Anywhere, Quiet, ResultOrScenario, say
from darboux.errors import InvalidInput

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ENDINGS = (".png", ".svg", ".pdf")
FILMS = (".gif", ".mp4")


def plot(
    file: ResultOrScenario,
    what: Annotated[
        str | None,
        typer.Option(
            "--what",
            metavar="W",
            help="shape, curvature, moments, forces, stress, energy or fields (all of these along the rod); of a motion: motion "
            "(all of it), shape, tip or energy.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FIGURE", help="Where to draw it: .png, .svg or .pdf; a motion also as .gif or .mp4."
        ),
    ] = None,
    quiet: Quiet = False,
    anywhere: Anywhere = False,
) -> None:
    """Draw a result, or a scenario's: its shape, or fields along the rod; a motion over time, or as a film."""
    from darboux import files
    from darboux.cli.result import found, refuse_unconverged
    from darboux.trajectory import Trajectory

    if out is not None:
        files.check(out)  # before the solve
    result = found(file, anywhere)
    moves = isinstance(result, Trajectory)
    path = figure_file(
        out,
        Path(f"{file.stem}-{what or ('motion' if moves else 'shape')}.png"),
        (*ENDINGS, *FILMS) if moves else ENDINGS,
    )
    if isinstance(result, Trajectory) and path.suffix.lower() in FILMS:
        if what not in (None, "shape"):
            raise InvalidInput(f"--what is {what!r}, but a film shows the shape; leave it out, or draw a .png.")
        result.animate(path)
    else:
        from darboux.view import plots

        write_figure(plots.draw(result, what), path)
    if not quiet:
        say(f"Drawn in {path}")
    refuse_unconverged(file, result)


def figure_file(asked: Path | None, default: Path, endings: Sequence[str] = ENDINGS) -> Path:
    """Return where a figure goes, or say which endings there are."""
    path = asked or default
    if path.suffix.lower() not in endings:
        film = " An equilibrium does not move." if path.suffix.lower() in FILMS else ""
        raise InvalidInput(f"--out is {str(path)!r}; a figure's name ends in {', '.join(endings)}.{film}")
    return path


def write_figure(figure: Figure, path: Path) -> None:
    """Write a figure in our style, whole or not at all."""
    from darboux import files
    from darboux.view import style

    metadata = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(path.suffix.lower())
    with style.article(), files.replacing(path) as temporary:
        figure.savefig(temporary, dpi=200.0, metadata=metadata)
