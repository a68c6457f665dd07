"""`darboux compare`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from darboux.cli.shell import Anywhere, Json, Quiet, ScenarioFile, console, print_json, scenario_of
from darboux.errors import InvalidInput, NotConverged, printable


def compare(
    file: ScenarioFile,
    methods: Annotated[
        str,
        typer.Option("--methods", metavar="A,B,C", help="Two or more of collocation, shooting, elastica, discrete."),
    ] = "collocation,discrete",
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FIGURE", help="Where to draw the curves: .png, .svg or .pdf.")
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
    anywhere: Anywhere = False,
) -> None:
    """Solve one scenario by several methods and say by how much they agree, with a figure of their curves."""
    from darboux import files, scenario
    from darboux.cli.plot import figure_file, write_figure
    from darboux.cli.solve import waiting

    stated = scenario_of(file, anywhere)
    chosen = [scenario.method(name.strip(), stated.method) for name in methods.split(",")]
    if len(chosen) < 2:
        raise InvalidInput(f"--methods is {methods!r}; it must name two or more, as in --methods collocation,discrete.")
    path = figure_file(out, Path(f"{file.stem}-agreement.png"))
    files.check(path)
    from darboux.comparison import compare as compared

    with waiting(f"solving {file.name} by {len(chosen)} methods", quiet or json):
        found = compared(stated.problem, chosen)
    from darboux.view import shapes

    write_figure(shapes.comparison(found).get_figure(root=True), path)  # type: ignore[arg-type]
    if json:
        print_json(
            {"verdict": found.verdict, "methods": [_entry(entry) for entry in found.entries], "figure": str(path)}
        )
    elif not quiet:
        screen = console()
        screen.print(found.table(printable(f"{file.stem}: agreement of the methods")))
        screen.print(printable(f"Drawn in {path}"), markup=False)
    failed = [entry for entry in found.entries if not entry.solution.converged]
    if failed:
        raise NotConverged(f"{failed[0].name}: {failed[0].solution.status.message}", failed[0].solution)


def _entry(entry: Any) -> dict[str, Any]:
    return {
        "method": entry.name,
        "status": entry.solution.status.code,
        "converged": entry.solution.converged,
        "tip": {"r": entry.solution.tip},
        "distance": vars(entry.distance),
        "order": entry.order,
        "seconds": entry.seconds,
    }
