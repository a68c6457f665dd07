"""`darboux serve`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from darboux.cli.shell import say, scenario_of
from darboux.errors import InvalidInput

LOOPBACK = "127.0.0.1"


def serve(
    file: Annotated[Path | None, typer.Argument(metavar="[FILE]", help="A scenario to begin with.")] = None,
    port: Annotated[int, typer.Option("--port", metavar="N", help="Where it listens; 0 takes a free one.")] = 8080,
    host: Annotated[
        str,
        typer.Option(
            "--host",
            metavar="ADDRESS",
            help="Whom it listens to: this machine alone (127.0.0.1), or, with 0.0.0.0 or an address of the machine, everybody "
            "who reaches it over the network. There is no password, and whoever comes makes this machine compute.",
        ),
    ] = LOOPBACK,
    anywhere: Annotated[
        bool, typer.Option("--anywhere", help="Let the scenario's tables lie outside its folder.")
    ] = False,
) -> None:
    """Open a page on which a rod answers to the mouse; Ctrl-C ends it."""
    from importlib.util import find_spec

    if find_spec("nicegui") is None:
        raise InvalidInput("the page needs NiceGUI, which is not installed; install it by: pip install 'darboux[web]'")
    from darboux.web import server

    shelf = _shelf(file, anywhere)

    def ready(address: str) -> None:
        say(f"The page is at {address} (Ctrl-C closes it).")
        if host not in server.LOOPBACK:
            say("Everybody who reaches this machine over the network can open it; there is no password.")

    try:
        server.serve(shelf, host, port, ready)
    except KeyboardInterrupt:
        pass
    say("The page is closed.")


def _shelf(file: Path | None, anywhere: bool) -> dict[str, Any]:
    """Return the scenarios on offer: the file first, then those of `darboux new` that state an equilibrium."""
    from importlib.resources import files as resources

    from darboux import scenario
    from darboux.cli.new import TEMPLATES
    from darboux.web.page import Entry

    shelf = {}
    if file is not None:
        shelf[file.stem] = Entry(file.stem, scenario_of(file, anywhere))
    for name in TEMPLATES:
        stated = scenario.parse((resources("darboux.cli") / "templates" / f"{name}.toml").read_text(encoding="utf-8"))
        if stated.motion is None and name not in shelf:
            shelf[name] = Entry(name.replace("-", " "), stated)
    return shelf
