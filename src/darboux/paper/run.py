"""`darboux paper`: compute the parts, draw them, write them, and print what came out."""

from __future__ import annotations

import json
import os
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from darboux import __version__, checks, files
from darboux.errors import InvalidInput, printable

DPI = 200
# The words that --only takes, and the part of `results.PARTS` that each stands for.
PART_OF = dict.fromkeys("1234", "1-4") | {
    name: name for name in ("5", "6", "7", "rotating", "charged", "invariants", "conventions")
}


def run(only: Sequence[str], out: Path, console: Console | None = None) -> dict[str, Any]:
    """Compute and write the chosen parts of the paper (all where none is chosen), and return what `paper.json` holds.

    Arguments: ``only`` names of parts, the keys of ``PART_OF``; ``out`` the folder; ``console`` where the table goes.
    Raises ``InvalidInput`` for an unknown name or a folder that can't be written.
    """
    names = list(dict.fromkeys(PART_OF[checks.choice("--only", name, PART_OF)] for name in only or PART_OF))
    _make_folder(out)
    console = console or Console()
    where = printable(f"{out}{os.sep}")
    console.print(f"darboux {__version__}: the paper, into {where}", markup=False)
    began = time.perf_counter()
    numbers: dict[str, Any] = {"version": __version__, "units": "SI"}
    comparisons: dict[str, Any] = {}
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("loading; a first run also compiles, for about half a minute", total=len(names))
        from darboux.paper import pictures, results
        from darboux.view import style

        results.compile_kernels()
        for name in names:
            title, compute = results.PARTS[name]
            progress.update(task, description=title)
            part = compute()
            numbers |= part.numbers
            comparisons |= part.comparisons
            for stem, figure in pictures.draw(name, part).items():
                style.save(figure, out, stem, DPI)
            progress.advance(task)
    numbers = _kept(out / "paper.json") | numbers if only else numbers
    numbers["seconds"] = time.perf_counter() - began
    _write(out / "paper.json", json.dumps(numbers, indent=2, allow_nan=False) + "\n")
    for model, found in comparisons.items():
        console.print(found.table(f"Figure 5, {model}: agreement of the methods"))
    if (summary := _summary(numbers)).row_count:
        console.print(summary)
    console.print(f"Written to {where}: the pictures as PNG and SVG, and paper.json with every number.", markup=False)
    return numbers


def _make_folder(out: Path) -> None:
    """Make the folder and try to write in it, before anything is computed."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=out):
            pass
    except OSError as error:
        raise InvalidInput(
            f"--out is {str(out)!r}, which can't be written ({error.strerror}); choose a folder of yours, as in --out my-figures."
        ) from None


def _kept(path: Path) -> dict[str, Any]:
    """Return the numbers that an earlier run of this version wrote, so that a part alone does not lose the others."""
    try:
        found = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else None
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) and found.get("version") == __version__ else {}


def _write(path: Path, text: str) -> None:
    with files.replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _summary(numbers: dict[str, Any]) -> Table:
    """Return what the other parts came to, each number with what it was held against; it fits 80 columns."""
    table = Table(title="The other cases", title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for column in ("figure", "quantity", "value"):
        table.add_column(column, no_wrap=column != "value")
    for clamp, order in numbers.get("figure5", {}).get("order", {}).items():
        table.add_row("5", f"DER's order, {clamp}", f"{order:.3f} (512 to 1024 segments, with stretch)")
    if "figure6" in numbers:
        six, exact = numbers["figure6"], numbers["figure6"]["exact"]
        for name in ("initial_value", "shooting", "discrete_100"):
            for quantity in ("radius", "pitch"):
                gap = abs(six[name][quantity] - exact[quantity])
                table.add_row(
                    "6", f"{quantity}, {name}", f"{six[name][quantity]:.12g} m (exact helix: {gap:.0e} m off)"
                )
        table.add_row("6", "DER's order", f"{six['discrete_order']:.3f} (512 to 1024 segments)")
    for reading, shapes in numbers.get("figure7", {}).items():
        for orientation, values in shapes.items():
            tip = ", ".join(f"{x:.6g}" for x in values["tip"])
            table.add_row("7", f"tip, ({reading}) {orientation}", f"({tip})")
    for name, drift in numbers.get("invariants", {}).items():
        table.add_row("", name.replace("_", " "), f"constant to {drift:.0e} along an unloaded rod")
    if "conventions" in numbers:
        gap = numbers["conventions"]["max_difference"]
        table.add_row("", "printed equations", f"{gap:.0e} L from ours (left-handed eqs. 14, 17 by RK45)")
    return table
