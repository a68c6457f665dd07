"""`make bench`: how fast darboux is, beside what else there is, and how wrong both are.

    make bench                                  every family, some ten minutes
    make bench ARGS="--only initial_value"      one of them
    make bench ARGS=--quick                     fewer turns, the recorded settings of PyElastica
    make bench ARGS=--write                     record: docs/benchmarks.md, its plots and benchmarks/last.json
    make bench ARGS="--only motion --write"     record one family anew, with its own date; the others stay as they are

The exit status is 0 whether targets are met or not, and 1 where something broke.
"""

from __future__ import annotations

import argparse
import dataclasses
import datetime
import importlib
import importlib.metadata
import json
import os
import platform
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

# One core, also where this file is not started by make; the libraries read it when they are loaded.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(name, "1")
ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

if TYPE_CHECKING:
    from rich.console import Console

    from benchmarks.timing import Curve, Row, Spread

FAMILIES = (
    "initial_value",
    "discrete_rod",
    "collocation",
    "batch",
    "against_pyelastica",
    "motion",
    "neutral_judge",
    "command",
    "core",
    "page",
)
LAST = ROOT / "benchmarks" / "last.json"
PAGE = ROOT / "docs" / "benchmarks.md"
FIGURES = ROOT / "docs" / "figures"
SLOWER = 1.3  # than the last recorded run, in units of something timed in the same run: worth a look
PACKAGES = ("darboux", "numpy", "scipy", "numba", "matplotlib", "nicegui", "pyelastica", "mujoco", "cosseratbench")
HEADINGS = ("what", "against", "ours", "theirs", "ratio", "spread", "target", "", "our error", "their error", "note")
COLOURED = {"pass": "[green]pass[/green]", "**FAIL**": "[red]FAIL[/red]"}
WORDS = ("what", "against", "", "note")


@dataclasses.dataclass(frozen=True)
class Measured:
    """What one family measured, and on what."""

    date: str
    machine: str
    versions: dict[str, str]
    seconds: float
    rows: list[Row]
    curves: list[Curve]
    remarks: list[str]


def main(arguments: list[str] | None = None) -> int:
    """Run, print and, where asked, record; return 1 only where something broke."""
    parser = argparse.ArgumentParser(description="How fast darboux is, and how wrong, beside what else there is.")
    parser.add_argument("--only", choices=FAMILIES, action="append", help="one family; may be repeated")
    parser.add_argument("--quick", action="store_true", help="fewer turns: good enough while working on something")
    parser.add_argument("--write", action="store_true", help=f"record in {PAGE.name} and {LAST.name}")
    asked = parser.parse_args(arguments)
    if asked.write and asked.quick:
        parser.error("--write records what all turns have measured: leave out --quick.")

    from rich.console import Console

    console = Console(width=None if sys.stdout.isatty() else 200)
    recorded = read()
    measured, broken = _measure(asked.only or FAMILIES, asked.quick, console)
    console.print(_table([row for family in measured.values() for row in family.rows], costs(recorded)))
    for name, family in measured.items():
        console.print(f"{name}: {family.seconds:.0f} s", highlight=False)
        for remark in family.remarks:
            console.print(f"  {remark}", highlight=False)
    for sentence in broken:
        console.print(sentence, style="red", highlight=False)
    if asked.write and not broken:
        record(recorded | measured)
        console.print(f"Recorded in {PAGE.relative_to(ROOT)} and {LAST.relative_to(ROOT)}.")
    return 1 if broken else 0


def _measure(families: Any, quick: bool, console: Console) -> tuple[dict[str, Measured], list[str]]:
    """Return what the families measured, and a sentence about each that broke."""
    from benchmarks.timing import Curve, Row

    measured: dict[str, Measured] = {}
    broken: list[str] = []
    with console.status("") as status:
        for family in families:
            status.update(f"measuring: {family.replace('_', ' ')} ...")
            began = time.perf_counter()
            try:
                found = list(importlib.import_module(f"benchmarks.{family}").rows(quick))
            except Exception as error:  # noqa: BLE001
                # What the other families measured is still shown.
                broken.append(f"{family} broke: {type(error).__name__}: {error}")
                continue
            measured[family] = Measured(
                date=datetime.date.today().isoformat(),
                machine=f"{_processor()}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}",
                versions={
                    "Python": platform.python_version(),
                    **{name: version for name in PACKAGES if (version := _version(name))},
                },
                seconds=time.perf_counter() - began,
                rows=[x for x in found if isinstance(x, Row)],
                curves=[x for x in found if isinstance(x, Curve)],
                remarks=[x for x in found if isinstance(x, str)],
            )
    return measured, broken


def _cells(row: Row) -> list[str]:
    """Return a row's cells, in the order of the headings."""
    theirs = "" if row.theirs is None else f"{_number(row.theirs.median)} {row.unit}"
    errors = ["" if e is None else f"{e:.1e}" for e in (row.our_error, row.their_error)]
    if errors[0]:
        errors[0] += f" ({row.error_of})"
    spread = _range(row.ours, f" {row.unit}") if row.ratio is None else _range(row.ratio, "x")
    ratio = "" if row.ratio is None else f"{_number(row.ratio.median)}x"
    ours = f"{_number(row.ours.median)} {row.unit}"
    return [row.what, row.peer, ours, theirs, ratio, spread, row.target, _verdict(row), *errors, row.note]


def _number(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 100.0 else f"{value:.3g}"


def _range(spread: Spread, unit: str) -> str:
    return f"{_number(spread.low)} ... {_number(spread.high)}{unit}"


def _verdict(row: Row) -> str:
    return {True: "pass", False: "**FAIL**", None: ""}[row.passed]


def slower(row: Row, last: dict[str, float]) -> str:
    """Return by how much a row has become slower than recorded, where that is worth a look."""
    before, now = last.get(row.name), row.cost
    if not before or not now or now <= SLOWER * before:
        return ""
    return f"{now / before:.2f} times slower than recorded"


def _table(rows: list[Row], last: dict[str, float]) -> Any:
    from rich.table import Table

    table = Table(
        title="One process, one core, after compiling; medians, and quartiles as spread", title_justify="left"
    )
    for heading in HEADINGS:
        table.add_column(heading, justify="left" if heading in WORDS else "right", overflow="fold")
    for row in rows:
        *cells, note = (COLOURED.get(cell, cell) for cell in _cells(row))
        lost = slower(row, last)
        words = [note, f"[yellow]{lost}[/yellow]" if lost else ""]
        table.add_row(*cells, "; ".join(word for word in words if word))
    return table


def costs(measured: dict[str, Measured]) -> dict[str, float]:
    """Return what must not grow, by the rows' names."""
    return {row.name: row.cost for family in measured.values() for row in family.rows if row.cost is not None}


def record(measured: dict[str, Measured]) -> None:
    """Write the figures for the next run, and from them the page for people and its plots."""
    ordered = {name: measured[name] for name in FAMILIES if name in measured}
    plain = {name: dataclasses.asdict(family) for name, family in ordered.items()}
    LAST.write_text(json.dumps(plain, indent=1) + "\n")
    PAGE.write_text(_page(read()))


def read() -> dict[str, Measured]:
    """Return what was recorded last, by families; empty where nothing was."""
    from benchmarks.timing import Curve, Row, Spread

    def row(given: dict[str, Any]) -> Row:
        spreads = {name: Spread(**given[name]) for name in ("ours", "theirs", "ratio") if given[name] is not None}
        return Row(**given | spreads)

    def curve(given: dict[str, Any]) -> Curve:
        lists = {"at": tuple(given["at"]), "marks": tuple(given["marks"])}
        return Curve(**given | lists | {"cost": tuple(Spread(**cost) for cost in given["cost"])})

    plain = json.loads(LAST.read_text()) if LAST.exists() else {}
    return {
        name: Measured(
            **family | {"rows": [row(x) for x in family["rows"]], "curves": [curve(x) for x in family["curves"]]}
        )
        for name, family in plain.items()
    }


def _page(measured: dict[str, Measured]) -> str:
    """Draw the plots and return docs/benchmarks.md."""
    from benchmarks import plots

    drawn = plots.draw([curve for family in measured.values() for curve in family.curves], FIGURES)
    lines = [
        "# Benchmarks",
        "",
        "Written by `make bench ARGS=--write`; do not edit. `make bench` measures again and says what has become slower.",
        "",
        "One process and one core, the batch apart, after compiling. What is compared is timed in turns, A B A B; a ratio is",
        "formed in every turn. Given are medians, and quartiles as the spread (of the ratio; of our own time where there is no",
        "ratio). No result is kept from one call to the next. Errors are true errors, against an answer that is better than both.",
    ]
    for file, caption in drawn:
        lines += ["", f"![{caption.split('.')[0].split(',')[0]}](figures/{file})", "", caption]
    for name, family in measured.items():
        words = (importlib.import_module(f"benchmarks.{name}").__doc__ or "").strip()
        versions = ", ".join(f"{package} {version}" for package, version in family.versions.items())
        lines += ["", f"## {name.replace('_', ' ').capitalize()}", "", words, ""]
        lines += [f"Measured on {family.date} in {family.seconds:.0f} s; {family.machine}; {versions}.", ""]
        lines += ["| " + " | ".join(HEADINGS) + " |"]
        lines += ["|" + "|".join("---" if heading in WORDS else "---:" for heading in HEADINGS) + "|"]
        for row in family.rows:
            lines += ["| " + " | ".join(cell.replace("|", "\\|") for cell in _cells(row)) + " |"]
        lines += ["", *family.remarks] if family.remarks else []
    return "\n".join(lines) + "\n"


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def _processor() -> str:
    """Return the processor's name as the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown processor"
    return next(
        (line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.processor()
    )


if __name__ == "__main__":
    sys.exit(main())
