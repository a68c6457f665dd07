"""How a problem or a result shows itself in a notebook: a small table and a picture, for static pages too.

Plain HTML and inline SVG, no script, no style of the page's. Words and thin lines have the colour of the text around
them, so that they are read on light and dark pages; the colours of the curves are legible on both.
"""

from __future__ import annotations

import dataclasses
import html
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux.comparison import Comparison
from darboux.motion import Motion
from darboux.problem import Equilibrium
from darboux.solution import EquilibriumSolution
from darboux.summary import NAME
from darboux.trajectory import Trajectory
from darboux.view import prefix
from darboux.view.look import Look, named
from darboux.view.unloaded import unloaded

Array = NDArray[np.float64]
Row = tuple[str, str]

COLOURS = ("#1f83c4", "#d55e00", "#009e73", "#8a74c9")
DASHES = ("", "7 4", "2 3", "8 3 2 3")
WIDTH, HEIGHT, LEAST = 260.0, 190.0, 24.0  # of a picture: at most, and the least of either
PLACES = 121  # along a rod
SHAPES = 13  # of a motion
LONGEST, ROWS = 240, 24  # letters in a cell, rows in a table


def page(value: Any) -> str:
    """Return a problem, a solution, a comparison or a trajectory as HTML; whatever fails, something is returned."""
    for make in (_page, lambda value: f"<pre>{_cell(repr(value))}</pre>"):
        with suppress(Exception), np.errstate(all="ignore"):
            return make(value)
    return html.escape(f"<{type(value).__name__}>")


def _page(value: Any) -> str:
    title, table, picture = next(_PAGES[kind](value) for kind in _PAGES if isinstance(value, kind))
    drawn = ""
    with suppress(Exception):
        drawn = picture()
    return (
        '<div style="display:flex;flex-wrap:wrap;gap:1em 1.5em;align-items:center;color:inherit">'
        f"{drawn}<div><b>{_cell(title)}</b>{table}</div></div>"
    )


# -- words -------------------------------------------------------------------------------------------------------------


def _cell(text: object) -> str:
    words = str(text)
    return html.escape(words if len(words) <= LONGEST else words[: LONGEST - 3] + "...")


def _table(rows: Iterable[Iterable[object]], header: Iterable[str] = ()) -> str:
    look = 'style="text-align:left;vertical-align:top;padding:0.1em 0.7em 0.1em 0;font-weight:normal"'
    head = "".join(
        f"<th {look.replace('font-weight:normal', 'font-weight:bold')}>{_cell(name)}</th>" for name in header
    )
    lines = [f"<tr>{''.join(f'<td {look}>{_cell(text)}</td>' for text in row)}</tr>" for row in rows]
    more = [f"<tr><td {look}>and {len(lines) - ROWS} more</td></tr>"] if len(lines) > ROWS else []
    top = f"<thead><tr>{head}</tr></thead>" if head else ""
    style = "border-collapse:collapse;margin:0.3em 0;color:inherit;font-size:inherit"
    return f'<table style="{style}">{top}<tbody>{"".join(lines[:ROWS] + more)}</tbody></table>'


def _brief(value: object) -> str:
    """Return a description as it was given: without what is so by default, numbers short."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, tuple):
        return f"({', '.join(map(_brief, value))})"
    if not dataclasses.is_dataclass(value):
        return repr(value)
    given = [(f.name, getattr(value, f.name)) for f in dataclasses.fields(value) if getattr(value, f.name) != f.default]
    return f"{type(value).__name__}({', '.join(f'{name}={_brief(part)}' for name, part in given)})"


def _rows_of_text(text: str) -> list[Row]:
    """Return the lines of a result's text, names and what is said of them."""
    return [(line[:NAME].strip(), line[NAME:].strip()) for line in text.splitlines()]


def _rows_of_problem(problem: Equilibrium) -> list[Row]:
    rod = problem.rod
    between = [(f"at {s:g} m", _brief(at)) for s, at in problem.between]
    if problem.link is not None:
        held = [("held at", _brief(problem.start)), *between, ("link", f"{problem.link:g}")]
    else:
        held = [("start", _brief(problem.start)), *between, ("end", _brief(problem.end))]
    return [
        ("rod", f"{rod.length:g} m, {rod.model}"),
        ("section", _brief(rod.section)),
        *([("material", _brief(rod.material))] if rod.material is not None else []),
        *([("natural", _brief(rod.natural))] if rod.natural is not None else []),
        *held,
        *[("load", _brief(load)) for load in problem.loads],
    ]


# -- what is shown -----------------------------------------------------------------------------------------------------

Shown = tuple[str, str, Callable[[], str]]


def _solution(solution: EquilibriumSolution) -> Shown:
    def picture() -> str:
        r = solution.r(_along(solution.problem))
        return _svg([r], [_held(solution.problem, solution.r)], Look.at(r))

    word = solution.status.code.replace("_", " ")
    return f"Equilibrium by {solution.method}: {word}", _table(_rows_of_text(str(solution))), picture


def _comparison(found: Comparison) -> Shown:
    def picture() -> str:
        curves = [entry.solution.r(_along(found.problem)) for entry in found.entries[: len(COLOURS)]]
        return _svg(curves, [_held(found.problem, found[found.reference].r)], Look.at(np.stack(curves)))

    rows = []
    for i, entry in enumerate(found.entries):
        numbers = [getattr(entry.distance, part) for part in ("centreline", "tip", "moment", "energy")]
        cells = ["reference", "", "", ""] if i == found.reference else [f"{value:.1e}" for value in numbers]
        rows.append((entry.name, *cells, "" if entry.order is None else f"{entry.order:.2f}"))
    table = _table(rows, ("method", "max |dr|/L", "tip |dr|/L", "moments", "energy", "order"))
    return f"{len(found.entries)} methods, one problem", f"{table}<div>{_cell(found.verdict)}</div>", picture


def _trajectory(trajectory: Trajectory) -> Shown:
    def picture() -> str:
        chosen = np.unique(np.linspace(0, len(trajectory.times) - 1, SHAPES).astype(int))
        last = len(trajectory.s) - 1
        places = np.unique(np.append(np.arange(0, last, max(1, last // (PLACES // 2))), last))
        shapes = trajectory.positions[chosen][:, places]
        held = [place for place, _ in trajectory.held]
        return _svg(list(shapes), [np.array(held).reshape(-1, 3)], Look.at(trajectory.positions), fan=True)

    word = trajectory.status.code.replace("_", " ")
    return f"Motion by {trajectory.method}: {word}", _table(_rows_of_text(str(trajectory))), picture


def _problem(problem: Equilibrium) -> Shown:
    def picture() -> str:
        r = unloaded(problem, np.linspace(0.0, problem.rod.length, PLACES))[0]
        held = [support.position for _, support in problem.supports if any(support.held_displacement)]
        return _svg([r], [np.array(held).reshape(-1, 3)], Look.at(np.concatenate([r, np.array(held).reshape(-1, 3)])))

    name = type(problem).__name__
    return f"{name}: the problem, and the rod before anything acts on it", _table(_rows_of_problem(problem)), picture


def _motion(motion: Motion) -> Shown:
    words = motion.initial if isinstance(motion.initial, str) else type(motion.initial).__name__
    rows = [
        ("duration", f"{motion.duration:g} s from {words}"),
        *[("damping", _brief(part)) for part in motion.damping],
        *[("released", f"{end} at {t:g} s") for end, t in motion.release],
        *[(f"{at} moves", _brief(getattr(motion, at))) for at in ("start", "end") if getattr(motion, at) is not None],
        *([("load factor", _brief(motion.load_factor))] if motion.load_factor is not None else []),
    ]
    _, _, picture = _problem(motion.problem)
    title = "Motion: the problem, and the rod before anything acts on it"
    return title, _table([*rows, *_rows_of_problem(motion.problem)]), picture


_PAGES: dict[type, Callable[[Any], Shown]] = {
    EquilibriumSolution: _solution,
    Comparison: _comparison,
    Trajectory: _trajectory,
    Motion: _motion,
    Equilibrium: _problem,
}


# -- pictures ----------------------------------------------------------------------------------------------------------


def _along(problem: Equilibrium) -> Array:
    return np.linspace(0.0, problem.rod.length, PLACES)


def _held(problem: Equilibrium, r: Callable[[Any], Array]) -> Array:
    return np.array([r(s) for s, _ in problem.supports]).reshape(-1, 3)


def _svg(curves: list[Array], held: list[Array], look: Look, fan: bool = False) -> str:
    """Return curves (n, 3) in m and squares at held points, with a scale bar, as SVG; a ``fan`` fades towards its start."""
    flat = look.camera.project(look.points)
    low, size = flat.min(axis=0), np.ptp(flat, axis=0)
    scale = min(WIDTH / max(size[0], 1e-300), HEIGHT / max(size[1], 1e-300))  # per m
    if not np.all(np.isfinite([*low, *size, scale])):
        return ""
    drawn = np.maximum(scale * size, LEAST)
    pad, foot = 8.0, 26.0
    width, height = max(drawn[0], 120.0) + 2.0 * pad, drawn[1] + 2.0 * pad + foot
    middle = low + size / 2.0

    def places(r: Array) -> Array:
        x, y = ((look.camera.project(r) - middle) * scale * [1.0, -1.0] + [width / 2.0, (height - foot) / 2.0]).T
        return np.stack([x, y], axis=1)

    parts = []
    for i, r in enumerate(curves):
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in places(r))
        colour, dashes = (COLOURS[0], "") if fan else (COLOURS[i % len(COLOURS)], DASHES[i % len(DASHES)])
        faded = f' stroke-opacity="{0.2 + 0.8 * (i + 1) / len(curves):.2f}"' if fan else ""
        dashed = f' stroke-dasharray="{dashes}"' if dashes else ""
        parts.append(f'<polyline points="{points}" stroke="{colour}" stroke-width="2"{faded}{dashed}/>')
    for x, y in places(np.concatenate(held)):
        parts.append(f'<rect x="{x - 3:.1f}" y="{y - 3:.1f}" width="6" height="6" fill="currentColor"/>')
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="shape of the rod" width="{width:.0f}" '
        f'height="{height:.0f}" viewBox="0 0 {width:.0f} {height:.0f}" fill="none" stroke-linejoin="round">'
        f"{''.join(parts)}{_scale_bar(look, scale, pad, height)}</svg>"
    )


def _scale_bar(look: Look, scale: float, left: float, height: float) -> str:
    unit, metres = prefix.length(0.5 * look.longest)
    bar = prefix.round_number(0.25 * look.longest / metres)
    long = bar * metres * scale
    right, up = (named(axis).replace("$", "") for axis in look.camera.A[:2])
    words = f"\N{EM SPACE}{right} \N{RIGHTWARDS ARROW}\N{EN SPACE}{up} \N{UPWARDS ARROW}"  # plain spaces would be one
    words = words if look.flat and len(right + up) <= 4 else ""
    y = height - 8.0
    return (
        f'<path d="M{left:.1f} {y - 4:.1f}v4h{long:.1f}v-4" stroke="currentColor"/>'
        f'<text x="{left + long + 6:.1f}" y="{y:.1f}" fill="currentColor" font-size="11" font-family="sans-serif">'
        f"{html.escape(f'{bar:g} {unit}{words}')}</text>"
    )
