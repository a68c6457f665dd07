"""`darboux export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from darboux.cli.shell import Quiet, ResultFile, result_of, say
from darboux.errors import InvalidInput


def export(
    result: ResultFile,
    to: Annotated[
        str | None,
        typer.Option(
            "--to",
            metavar="FORM",
            help="csv, vtk (ParaView), gltf (Blender) or stl; else what --out ends in, else csv.",
        ),
    ] = None,
    samples: Annotated[
        int, typer.Option("--samples", metavar="N", help="csv: equally spaced places along the rod.")
    ] = 201,
    field: Annotated[
        str, typer.Option("--field", metavar="F", help="gltf: what colours the rod, or none.")
    ] = "curvature",
    time: Annotated[
        float | None, typer.Option("--time", metavar="T", help="gltf, stl: the time of a motion in s; else its last.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Where to write it; else RESULT and the form's ending.")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Write a result for other programs, in SI: a table, or the rod's surface with its fields."""
    from darboux import checks
    from darboux.view.space import export as exports

    if to is not None:
        checks.choice("--to", to, exports.ENDINGS)
    checks.whole("--samples", samples, 2, exports.MOST_SAMPLES)
    content = result_of(result)
    path = out or Path(f"{result.stem}{exports.ending(to or 'csv', content)}")
    if to is not None and path.suffix.lower() not in exports.ENDINGS[to]:
        raise InvalidInput(
            f"--out is {str(path)!r}, but --to is {to}; such a name ends in {', '.join(exports.ENDINGS[to])}."
        )
    words = exports.export(content, path, t=time, field=field, samples=samples)
    if not quiet:
        say(f"Written to {path}: {words}.")
