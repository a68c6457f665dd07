"""`make validate`: every case of the record, the long ones too, and docs/validation.md with its figures."""

from __future__ import annotations

import datetime
import json
import os
import platform
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from darboux.view import palette, style
from tests.validation.judging import Row
from tests.validation.left_out import LEFT_OUT
from tests.validation.record import CASES

ROOT = Path(__file__).resolve().parents[2]
PAGE, FIGURES = ROOT / "docs" / "validation.md", ROOT / "docs" / "figures"
MARKS = {"Collocation": "o", "Shooting": "s", "Elastica": "^", "DiscreteRod": "D", "natural_modes": "v"}
COLOURS = {
    "Collocation": palette.BLUE,
    "Shooting": palette.VERMILION,
    "Elastica": palette.GREEN,
    "DiscreteRod": palette.ORANGE,
}
SMALLEST = 1e-17  # an error of zero is drawn here


class Recorder:
    """Gathers what the judges compare, by the test file, and which tests failed."""

    def __init__(self) -> None:
        self.rows: dict[str, list[tuple[Row, str]]] = {}
        self.failed: list[str] = []
        self.counted = {"passed": 0, "failed": 0, "known": 0}

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.when != "call":
            if report.failed:
                self.failed.append(report.nodeid)
            return
        known = hasattr(report, "wasxfail")
        outcome = "known" if known else report.outcome
        self.counted[outcome] = self.counted.get(outcome, 0) + 1
        if report.failed:
            self.failed.append(report.nodeid)
        family = Path(report.nodeid.split("::")[0]).stem.removeprefix("test_")
        for name, text in report.user_properties:
            if name == "validation":
                self.rows.setdefault(family, []).append((Row(**json.loads(text)), outcome))


def main(arguments: list[str]) -> int:
    """Run the tests, write the page and return pytest's status."""
    recorder = Recorder()
    status = pytest.main(
        ["-m", "long or not long", "-q", str(ROOT / "tests" / "validation"), *arguments], plugins=[recorder]
    )
    if not arguments:
        for family, rows in recorder.rows.items():
            _draw(family, rows)
        PAGE.write_text(_page(recorder))
        print(f"Written: {PAGE.relative_to(ROOT)}.")
    return int(status)


def _title(family: str) -> str:
    return family.replace("_", " ").capitalize()


def _page(recorder: Recorder) -> str:
    rows = [row for found in recorder.rows.values() for row in found]
    held = {row.case for row, _ in rows}
    machine = f"{os.cpu_count()} cores, {platform.system()} {platform.machine()}, Python {platform.python_version()}"
    lines = [
        "# Validation",
        "",
        "Written by `make validate`; do not edit.",
        "",
        f"{datetime.date.today().isoformat()}, {machine}. {len(CASES)} cases are in the record (`tests/validation/validation.json`: closed forms, elliptic",
        "integrals, shooting and spectral methods of high precision, made without this library); "
        f"{len(held)} of them are held below, by {len(rows)} comparisons; what is left out stands at the end with its reason.",
        f"Tests: {', '.join(f'{count} {outcome}' for outcome, count in recorder.counted.items() if count)}.",
        "",
        "Errors are the largest over the values read, relative to the largest of them or to 1. Tolerances follow from the method: `rtol` of",
        "`Collocation`, ten times `rtol` of `Shooting` (which counts it per step) and `Elastica`; a discrete rod is solved on N and 2 N segments,",
        "the error of the finer one is estimated as a third of their difference, and the extrapolation must meet the record within a quarter",
        "of that: this holds its order, too. A bracket is as wide as the method sees, and the error *within* that. Times are of",
        "all solves of a line, with Python's overhead, on a machine that did other things as well; *known* marks a disagreement that is",
        "understood and not yet mended.",
    ]
    for family, found in recorder.rows.items():
        lines += [
            "",
            f"## {_title(family)}",
            "",
            f"![Errors of {_title(family).lower()} by method](figures/validation-{family}.png)",
            "",
        ]
        lines += [
            "| case | what | method | reference | ours | error | tolerance | resolution | time | |",
            "|---|---|---|---|---|---:|---:|---|---:|---|",
        ]
        lines += [_line(row, outcome) for row, outcome in found]
    lines += ["", "## Left out", "", "| case | what | why |", "|---|---|---|"]
    lines += [
        f"| {case} | {words.replace('|', chr(92) + '|') or CASES[case]['title']} | {why} |"
        for case, words, why in LEFT_OUT
    ]
    return "\n".join(lines) + "\n"


def _line(row: Row, outcome: str) -> str:
    verdict = {"passed": "", "known": "known"}.get(outcome, "**failed**")
    name = f"{row.case} {row.name}".strip()
    cells = [
        name,
        row.what,
        row.method,
        _numbers(row.exact),
        _numbers(row.ours),
        ("within " if row.bracket else "") + f"{row.error:.1e}",
        f"{row.tolerance:.1e}",
        row.resolution,
        f"{row.seconds:.2f} s",
        verdict,
    ]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _numbers(values: list[float]) -> str:
    shown = ", ".join(f"{value + 0.0:.7g}" for value in values[:3])
    return shown + (", ..." if len(values) > 3 else "")


def _draw(family: str, found: list[tuple[Row, str]]) -> None:
    """Draw each comparison's error over its tolerance's mark, by case."""
    with style.article():
        names = list(dict.fromkeys(row.case for row, _ in found))
        figure = style.new_figure(7.0, 3.4)
        ax = style.axes_at(figure, 0.75, 0.55, 6.1, 2.4)
        methods = list(dict.fromkeys(row.method.split(".")[0].split("(")[0] for row, _ in found))
        for i, method in enumerate(methods):
            rows = [row for row, _ in found if row.method.split(".")[0].split("(")[0] == method]
            x = np.array([names.index(row.case) for row in rows]) + 0.7 * (i - (len(methods) - 1) / 2.0) / max(
                len(methods), 2
            )
            shift = 0.25 / max(len(methods), 2) * np.linspace(-1.0, 1.0, len(rows)) if len(rows) > 1 else 0.0
            ax.plot(x + shift, [row.tolerance for row in rows], "_", color=palette.GREY, markersize=6, zorder=1)
            ax.plot(
                x + shift, [max(row.error, SMALLEST) for row in rows], MARKS.get(method, "o"), label=method, markersize=4.5,
                color=COLOURS.get(method, palette.BLACK), markerfacecolor="none" if method not in COLOURS else None, linestyle="none",
            )  # fmt: skip
        ax.plot([], [], "_", color=palette.GREY, markersize=8, label="tolerance")
        ax.set_yscale("log")
        ax.set_xticks(range(len(names)), names)
        ax.set_xlim(-0.6, len(names) - 0.4)
        ax.set_ylabel("error")
        ax.grid(axis="y")
        figure.legend(loc="upper center", ncols=min(6, len(methods) + 1))
        figure.savefig(FIGURES / f"validation-{family}.png", dpi=150)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
