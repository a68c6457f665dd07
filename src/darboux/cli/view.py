"""`darboux view`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from darboux.cli.shell import Anywhere, Quiet, ResultOrScenario, say
from darboux.errors import InvalidInput


def view(
    file: ResultOrScenario,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="PICTURE", help="Draw a .png file, without a window or a display.")
    ] = None,
    field: Annotated[
        str | None,
        typer.Option(
            "--field",
            metavar="F",
            help="What colours the rod: curvature, twist, moment, force, tension, stress, energy, speed or none.",
        ),
    ] = None,
    time: Annotated[
        float | None, typer.Option("--time", metavar="T", help="The time of a motion in s; else its last.")
    ] = None,
    ghost: Annotated[bool, typer.Option("--ghost", help="Show the unloaded shape too; of a motion its first.")] = False,
    directors: Annotated[bool, typer.Option("--directors", help="Show d1, d2, d3 as arrows.")] = False,
    thicker: Annotated[
        float | None, typer.Option("--thicker", metavar="N", help="Draw the rod N times as thick; else as can be seen.")
    ] = None,
    size: Annotated[str, typer.Option("--size", metavar="WxH", help="Width and height in pixels.")] = "1200x900",
    quiet: Quiet = False,
    anywhere: Anywhere = False,
) -> None:
    """Show a result or a scenario in space: a tube with its true section, coloured by a field; supports and loads."""
    from darboux.cli.result import found, refuse_unconverged

    pixels = size_of(size)
    from darboux.view.space import show

    if out is not None:
        show.checked_file(out)  # before the solve
    result = found(file, anywhere)
    show.view(result, field=field, out=out, t=time, ghost=ghost, directors=directors, thicker=thicker, size=pixels)
    if out is not None and not quiet:
        say(f"Drawn in {out}")
    refuse_unconverged(file, result)


def size_of(words: str) -> tuple[int, int]:
    """Return width and height of a text such as 1200x900."""
    parts = words.lower().split("x")
    if len(parts) != 2 or not all(part.isdigit() for part in parts):
        raise InvalidInput(f"--size is {words!r}; it must be width and height in pixels, such as 1200x900.")
    return int(parts[0]), int(parts[1])
