"""`make bench`: how fast darboux is, beside what else there is, and how wrong both are.

    make bench                                  every family, some minutes
    make bench ARGS="--only initial_value"      one of them
    make bench ARGS=--quick                     fewer turns, the recorded settings of PyElastica
    make bench ARGS=--write                     record: docs/benchmarks.md and benchmarks/last.json

The exit status is 0 whether targets are met or not, and 1 where something broke.
"""

from __future__ import annotations

import argparse
import datetime
import importlib
import importlib.metadata
import json
import os
import platform
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

# One core, also where this file is not started by make; the libraries read it when they are loaded.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(name, "1")
ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

if TYPE_CHECKING:
    from rich.console import Console

    from benchmarks.timing import Row, Spread

FAMILIES = (
    "initial_value",
    "discrete_rod",
    "collocation",
    "against_pyelastica",
    "motion",
    "neutral_judge",
    "command",
    "page",
)
LAST = ROOT / "benchmarks" / "last.json"
PAGE = ROOT / "docs" / "benchmarks.md"
SLOWER = 1.3  # than the last recorded run, in units of something timed in the same run: worth a look
PACKAGES = ("darboux", "numpy", "scipy", "numba", "matplotlib", "nicegui", "pyelastica", "mujoco", "cosseratbench")
HEADINGS = ("what", "against", "ours", "theirs", "ratio", "spread", "target", "our error", "their error", "")
WORDS = ("what", "against", "")


def main(arguments: list[str] | None = None) -> int:
    """Run, print and, where asked, record; return 1 only where something broke."""
    parser = argparse.ArgumentParser(description="How fast darboux is, and how wrong, beside what else there is.")
    parser.add_argument("--only", choices=FAMILIES, action="append", help="one family; may be repeated")
    parser.add_argument("--quick", action="store_true", help="fewer turns: good enough while working on something")
    parser.add_argument("--write", action="store_true", help=f"record in {PAGE.name} and {LAST.name}")
    asked = parser.parse_args(arguments)
    if asked.write and (asked.only or asked.quick):
        parser.error("--write records everything with all turns: leave out --only and --quick.")

    from rich.console import Console

    console = Console(width=None if sys.stdout.isatty() else 200)
    rows, remarks, broken = _measure(asked.only or FAMILIES, asked.quick, console)
    last = json.loads(LAST.read_text())["rows"] if LAST.exists() else {}
    console.print(_table(rows, last))
    for remark in remarks:
        console.print(remark, style="red" if broken else None, highlight=False)
    if asked.write and not broken:
        _record(rows, remarks)
        console.print(f"Recorded in {PAGE.relative_to(ROOT)} and {LAST.relative_to(ROOT)}.")
    return 1 if broken else 0


def _measure(families: Any, quick: bool, console: Console) -> tuple[list[Row], list[str], bool]:
    """Return the rows of the families, sentences about what could not be measured, and whether one broke."""
    rows: list[Row] = []
    remarks: list[str] = []
    broken = False
    with console.status("") as status:
        for family in families:
            status.update(f"measuring: {family.replace('_', ' ')} ...")
            try:
                for row in importlib.import_module(f"benchmarks.{family}").rows(quick):
                    if isinstance(row, str):
                        remarks.append(row)
                    else:
                        rows.append(row)
            except Exception as error:  # noqa: BLE001
                # What the other families measured is still shown.
                broken = True
                remarks.append(f"{family} broke: {type(error).__name__}: {error}")
    return rows, remarks, broken


def _cells(row: Row) -> list[str]:
    """Return a row's cells, in the order of the headings, the verdict left out."""
    theirs = "" if row.theirs is None else f"{_number(row.theirs.median)} {row.unit}"
    errors = ["" if e is None else f"{e:.1e}" for e in (row.our_error, row.their_error)]
    if errors[0]:
        errors[0] += f" ({row.error_of})"
    spread = _range(row.ours, f" {row.unit}") if row.ratio is None else _range(row.ratio, "x")
    ratio = "" if row.ratio is None else f"{_number(row.ratio.median)}x"
    return [row.what, row.peer, f"{_number(row.ours.median)} {row.unit}", theirs, ratio, spread, row.target, *errors]


def _number(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 100.0 else f"{value:.3g}"


def _range(spread: Spread, unit: str) -> str:
    return f"{_number(spread.low)} ... {_number(spread.high)}{unit}"


def _verdict(row: Row) -> str:
    return {True: "pass", False: "FAIL", None: ""}[row.passed]


def _slower(row: Row, last: dict[str, Any]) -> str:
    """Return by how much a row has become slower than recorded, where that is worth a look."""
    before, now = last.get(row.name, {}).get("cost"), row.cost
    if not before or not now or now <= SLOWER * before:
        return ""
    return f"{now / before:.2f} times slower than recorded"


def _table(rows: list[Row], last: dict[str, Any]) -> Any:
    from rich.table import Table

    table = Table(
        title="One process, one core, after compiling; medians, and quartiles as spread", title_justify="left"
    )
    for heading in HEADINGS:
        table.add_column(heading, justify="left" if heading in WORDS else "right", overflow="fold")
    for row in rows:
        colour = {True: "green", False: "red", None: ""}[row.passed]
        verdict = f"[{colour}]{_verdict(row)}[/{colour}]" if colour else ""
        slower = _slower(row, last)
        words = [verdict, row.note, f"[yellow]{slower}[/yellow]" if slower else ""]
        table.add_row(*_cells(row), "; ".join(word for word in words if word))
    return table


def _record(rows: list[Row], remarks: list[str]) -> None:
    """Write the page for people and the figures for the next run."""
    made = {
        "date": datetime.date.today().isoformat(),
        "machine": f"{_processor()}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "versions": {name: version for name in PACKAGES if (version := _version(name))},
    }
    figures = {
        row.name: {
            "ours": row.ours.median,
            "unit": row.unit,
            "theirs": row.theirs and row.theirs.median,
            "ratio": row.ratio and [row.ratio.low, row.ratio.median, row.ratio.high],
            "cost": row.cost,
            "passed": row.passed,
        }
        for row in rows
    }
    LAST.write_text(json.dumps(made | {"rows": figures}, indent=1) + "\n")
    PAGE.write_text(_page(made, rows, remarks))


def _page(made: dict[str, Any], rows: list[Row], remarks: list[str]) -> str:
    """Return docs/benchmarks.md."""
    versions = ", ".join(f"{name} {version}" for name, version in made["versions"].items())
    lines = [
        "# Benchmarks",
        "",
        "Written by `make bench ARGS=--write`; do not edit. `make bench` measures again and says what has become slower.",
        "",
        f"{made['date']}, {made['machine']}; Python {made['python']}, {versions}.",
        "",
        "One process and one core, after compiling. What is compared is timed in turns, A B A B; a ratio is formed in every",
        "turn. Given are medians, and quartiles as the spread (of the ratio; of our own time where there is no ratio). No",
        "result is kept from one call to the next. Errors are true errors, against an answer that is better than both.",
        "",
        "| " + " | ".join([*HEADINGS[:-1], "verdict"]) + " |",
        "|" + "|".join("---" if heading in WORDS else "---:" for heading in HEADINGS) + "|",
    ]
    lines += [
        "| " + " | ".join([*_cells(row), "; ".join(filter(None, [_verdict(row), row.note]))]) + " |" for row in rows
    ]
    lines += ["", *remarks] if remarks else []
    for family in FAMILIES:
        words = (importlib.import_module(f"benchmarks.{family}").__doc__ or "").strip()
        lines += ["", f"## {family.replace('_', ' ').capitalize()}", "", words]
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
