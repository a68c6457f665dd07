"""What a person and a program read of a solution."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from darboux import __version__
from darboux.errors import printable
from darboux.solution import EquilibriumSolution, Reaction
from darboux.view import terminal

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

SAMPLES = 401
NOTHING = 1e-12  # of the rod's length, its largest force or moment: shown as zero


def content(solution: EquilibriumSolution, seconds: float) -> dict[str, Any]:
    """Return the numbers of a solution, in SI, for JSON."""
    place, largest = _largest_moment(solution)
    energy = solution.energy
    return {
        "status": solution.status.code,
        "converged": solution.converged,
        "message": solution.status.message,
        "method": str(solution.method),
        "model": solution.model,
        "load_factor": solution.load_factor,
        "tip": {"r": solution.tip, "tangent": _tangent(solution)},
        "reactions": {
            end: {"force": reaction.force, "moment": reaction.moment}
            for end, reaction in (("start", solution.reactions.start), ("end", solution.reactions.end))
        }
        | {"between": [_between(s, reaction) for s, reaction in solution.reactions.between.items()]},
        "largest_moment": {"value": largest, "s": place},
        "largest_stress": _largest_stress(solution),
        "energy": {
            "total": energy.total,
            "elastic": energy.elastic,
            "bending": energy.bending,
            "twist": energy.twist,
            "stretch": energy.stretch,
            "supports": energy.supports,
            "load": energy.load,
        },
        "cable": None if solution.cable is None else vars(solution.cable),
        "error": vars(solution.error),
        "warnings": solution.warnings,
        "stable": solution.stable,
        "unstable_directions": solution.index,
        "seconds": seconds,
        "units": "SI",
        "version": __version__,
    }


def table(solution: EquilibriumSolution, title: str, seconds: float) -> Table:
    """Return the table that an engineer wants; it fits a screen of 80 columns."""
    place, largest = _largest_moment(solution)
    force = float(np.max(np.abs(solution.n(solution.s))))
    error = solution.error
    rows = [
        ("status", solution.status.message),
        *(("warning", sentence) for sentence in solution.warnings),
        ("method", f"{solution.method}, {solution.model}"),
        ("tip", f"{vector_text(solution.tip, solution.problem.rod.length, error.tip)} m"),
        ("tip's tangent", vector_text(_tangent(solution), 1.0)),
        (
            "error of the tip",
            "not estimated" if error.tip is None else f"{error.tip:.1e} m (estimated)",
        ),
    ]
    reactions = [
        (f"the {end}", getattr(solution.reactions, end))
        for end in ("start", "end")
        if getattr(solution.problem, end).holds
    ]
    reactions[1:1] = [(f"{s:g} m", reaction) for s, reaction in solution.reactions.between.items()]
    for where, reaction in reactions:
        rows += [
            (f"force at {where}", f"{vector_text(reaction.force, force, error.reactions)} N"),
            (f"moment at {where}", f"{vector_text(reaction.moment, largest, error.moments)} N m"),
        ]
    if cable := solution.cable:
        start, end = (round(angle, 6) + 0.0 for angle in cable.angles)  # rounding is no angle
        rows += [
            ("sag", f"{0.0 if cable.sag <= (error.tip or 0.0) else cable.sag:.6g} m over a span of {cable.span:.6g} m"),
            ("largest tension", f"{cable.tension:.6g} N at s = {cable.at:.4g} m"),
            ("end angles", f"{start:.4g} and {end:.4g} degrees below the horizontal"),
            ("loaded length", f"{cable.length:.9g} m"),
        ]
    energy = solution.energy
    stable = {None: "not counted", True: "stable", False: f"unstable in {solution.index} direction(s)"}
    rows += [("largest moment", f"{largest:.6g} N m at s = {place:.4g} m")]
    if stress := _largest_stress(solution):
        rows += [("largest stress", f"{stress['value'] / 1e6:.4g} MPa (von Mises) at s = {stress['s']:.4g} m")]
    rows += [
        ("energy", f"{energy.total:.6g} J ({energy.parts})"),
        ("stability", stable[solution.stable]),
        ("time", duration_text(seconds)),
    ]
    return table_of(rows, title)


def table_of(rows: list[tuple[str, str]], title: str) -> Table:
    """Return a table of names and what there is to say of them."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    result = Table(
        title=Text(printable(title)), title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), show_header=False
    )
    result.add_column(no_wrap=True, style="bold")
    result.add_column(overflow="fold")
    for row in rows:
        result.add_row(*(Text(printable(part)) for part in row))  # as it stands: brackets are no markup
    return result


def picture(solution: EquilibriumSolution, screen: Console) -> str:
    """Return the curve as a small picture, in letters that the screen has."""
    s = np.linspace(0.0, solution.problem.rod.length, SAMPLES)
    return terminal.picture(solution.r(s), plain=screen.options.ascii_only)


def _between(s: float, reaction: Reaction) -> dict[str, Any]:
    return {"s": s, "force": reaction.force, "moment": reaction.moment}


def _largest_moment(solution: EquilibriumSolution) -> tuple[float, float]:
    s = np.linspace(0.0, solution.problem.rod.length, SAMPLES)
    moment = np.linalg.norm(solution.m(s), axis=1)
    place = int(np.argmax(moment))
    return float(s[place]), float(moment[place])


def _largest_stress(solution: EquilibriumSolution) -> dict[str, Any] | None:
    """Return von Mises' largest stress and its place; None where the section has no shape."""
    if not solution.problem.rod.section.has_shape:
        return None
    found = solution.largest_stress
    return {"value": found.von_mises, "s": found.s, "point": found.point}


def _tangent(solution: EquilibriumSolution) -> Any:
    """Return the direction of the centreline at the tip, R v over its length."""
    length = solution.problem.rod.length
    s = min((0.0, length), key=lambda s: float(np.linalg.norm(solution.r(s) - solution.tip)))
    tangent = solution.R(s) @ solution.v(s)
    return tangent / np.linalg.norm(tangent)


def vector_text(values: Any, scale: float, error: float | None = None) -> str:
    """Return three numbers as text; what is nothing beside ``scale``, or below an estimated ``error``, is zero."""
    least = max(NOTHING * scale, error or 0.0)
    return "(" + ", ".join(f"{0.0 if abs(value) <= least else value:.6g}" for value in values) + ")"


def duration_text(seconds: float) -> str:
    """Return a duration as text, without powers of ten: 0.42 s, 3.1 s, 163 s."""
    return f"{seconds:.0f} s" if seconds >= 10.0 else f"{seconds:.2g} s"
