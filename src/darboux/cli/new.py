"""`darboux new`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from darboux.cli.shell import Quiet, say
from darboux.errors import InvalidInput

TEMPLATES = {
    "cantilever": "a rubber filament, clamped at one end, under its own weight",
    "helix": "a steel spring that hangs from one end, pulled at the other",
    "clamped-clamped": "a strip held at both ends, pushed together and twisted",
    "arch": "a strip bowed up between two clamps, pressed down towards its snap",
    "hanging-cable": "a steel rope that sags between two masts",
    "spinning": "a filament that turns with its clamp",
    "falling": "a rubber filament let go from the horizontal, in syrup: a motion",
    "ring": "a wire closed to a ring after two turns of twist",
}


def new(
    template: Annotated[
        str | None,
        typer.Argument(metavar="[" + "|".join(TEMPLATES) + "]", help="What to begin with; without it, what there is."),
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="Where to; else NAME.toml.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
    quiet: Quiet = False,
) -> None:
    """Write a scenario with comments, to change and to solve."""
    from importlib.resources import files as resources

    from darboux import checks, files

    if template is None:
        for name, words in TEMPLATES.items():
            say(f"{name:<16} {words}")
        return
    checks.choice("template", template, TEMPLATES)
    path = out or Path(f"{template}.toml")
    if path.exists() and not force:
        raise InvalidInput(f"{path} is there already; choose another name by --out, or write over it by --force.")
    text = (resources("darboux.cli") / "templates" / f"{template}.toml").read_text(encoding="utf-8")
    with files.replacing(path, text=True) as temporary:
        temporary.write_text(text, encoding="utf-8")
    if not quiet:
        verb = "simulate" if "\n[motion]" in text else "solve"
        say(f"Written to {path}: {TEMPLATES[template]}. Next: darboux {verb} {path}")
