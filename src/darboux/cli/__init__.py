"""The command `darboux`: one verb a file, each loading what it needs when it runs."""

from __future__ import annotations

import gc
from typing import Annotated, Any

import typer

from darboux.cli.compare import compare
from darboux.cli.doctor import doctor, warmup
from darboux.cli.export import export
from darboux.cli.info import info
from darboux.cli.new import new
from darboux.cli.paper import paper
from darboux.cli.plot import plot
from darboux.cli.schema import schema
from darboux.cli.serve import serve
from darboux.cli.shell import Command
from darboux.cli.simulate import simulate
from darboux.cli.solve import solve
from darboux.cli.view import view

app = typer.Typer(
    cls=Command,
    help="Elastic filaments: shapes, forces and stability of thin rods by Kirchhoff's theory.",
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # plain: for colours Typer loads a reader of Markdown, which takes half the time of --help
)
EXAMPLES: dict[Any, str] = {
    new: "darboux new cantilever",
    solve: "darboux solve cantilever.toml --out cantilever.nc",
    simulate: "darboux simulate falling.toml --out falling.nc",
    compare: "darboux compare cantilever.toml --methods collocation,shooting,discrete",
    plot: "darboux plot cantilever.nc --what moments --out moments.svg",
    view: "darboux view cantilever.nc --field stress --out cantilever.png",
    export: "darboux export cantilever.nc --to vtk --out cantilever.vtp",
    info: "darboux info cantilever.nc",
    schema: "darboux schema --out darboux.schema.json",
    doctor: "darboux doctor",
    warmup: "darboux warmup",
    serve: "darboux serve cantilever.toml",
    paper: "darboux paper --only 5 --out my-figures",
}
for verb, example in EXAMPLES.items():
    app.command(epilog=f"Example: {example}", short_help=verb.__doc__.splitlines()[0])(verb)


def _version(wanted: bool) -> None:
    if wanted:
        from darboux import __version__

        typer.echo(f"darboux {__version__}")
        raise typer.Exit


@app.callback(epilog="Example: darboux new helix && darboux solve helix.toml")
def darboux(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
    debug: Annotated[
        bool, typer.Option("--debug", help="Show the traceback of a mistake; may stand anywhere.")
    ] = False,
) -> None:
    """Elastic filaments: shapes, forces and stability of thin rods by Kirchhoff's theory.

    A rod is a file: write one by darboux new, change it, find its equilibrium by darboux solve, follow its motion by
    darboux simulate. Exit status: 0 solved, 1 not converged, 2 bad input, 74 the disk or the memory
    did not let it.
    """


def main() -> None:
    """Run the command; a mistake is one sentence on standard error: exit status 2 bad input, 1 not converged."""
    gc.set_threshold(100_000)  # loading makes many objects and little garbage: about a tenth of a short run
    app(prog_name="darboux")
