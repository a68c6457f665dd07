"""The shape of a rod in its plane or in space, and the shapes that several methods find, with their distance."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from darboux.view import palette, prefix, style
from darboux.view.look import Look
from darboux.view.stage import Stage

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from darboux.comparison import Comparison
    from darboux.solution import EquilibriumSolution

Array = NDArray[np.float64]

SAMPLES = 801
TRIADS = 9  # places along the rod at which directors are drawn
DIRECTOR = 0.07  # of the largest extent, their length
INSET = (0.36, 0.26)  # of the axes' width and height, with its numbers a little more
LEAST_INSET = 3.4  # inches, width of the axes in which it can still be read
LINES: Any = (
    ("-", palette.BLUE),
    ("--", palette.VERMILION),
    (":", palette.BLACK),
    ("-.", palette.GREEN),
    ("-", palette.ORANGE),
)


def shape(
    solution: EquilibriumSolution,
    ax: Any = None,
    new: style.NewFigure = style.new_figure,
    points: Array | None = None,
) -> Axes:
    """Draw the centreline with its supports and ``points`` (n, 3) in m; in space also d1 and d2 in some places. Returns the axes.

    A rod that lies in a plane, its section not turning about the tangent, is drawn in that plane.
    """
    s = np.linspace(0.0, solution.problem.rod.length, SAMPLES)
    r, R = solution.r(s), solution.R(s)
    look = Look.at(r, R)
    directors = None if look.flat else _directors(r, R)
    others = [part.reshape(-1, 3) for part in (directors, points) if part is not None]
    if others:  # the box holds them too
        look = dataclasses.replace(look, points=np.concatenate([r, *others]))
    with style.axes_for(ax, *look.size, new) as made:
        stage = Stage.on(made, look)
        stage.shape(r)
        if directors is not None:
            _draw_directors(stage, directors)
        _supports(stage, solution)
        if points is not None:
            stage.line(points, ls="none", marker="x", ms=6.0, mew=1.4, color=palette.VERMILION, zorder=5.0)
        _say_what_failed(made, [solution])
    return made


def comparison(found: Comparison, ax: Any = None, new: style.NewFigure = style.new_figure) -> Axes:
    """Draw the centrelines of all methods over each other, and in an inset their distance from the reference along s."""
    solutions = [entry.solution for entry in found.entries]
    s = np.linspace(0.0, found.problem.rod.length, SAMPLES)
    curves = [solution.r(s) for solution in solutions]
    look = Look.at(np.stack(curves))
    width, height = look.size
    with style.axes_for(ax, max(width, 6.4), max(height, 3.6), new) as made:
        style.settle(made)
        inset = style.size_of(made)[0] >= LEAST_INSET
        stage = Stage.on(made, look)
        corner = _free_corner(stage, curves) if inset else None
        if inset and corner is None:
            made.clear()
            corner = (1.0 - INSET[0], 0.1)
            stage = Stage.on(made, look, right=INSET[0] + 0.12)
        for i, r in enumerate(curves):
            dashes, colour = LINES[i % len(LINES)]
            stage.line(
                r, label=_label(found, i), ls=dashes, color=colour, lw=2.6 - 0.4 * min(i, 3), zorder=3.0 + 0.1 * i
            )
        _supports(stage, solutions[0])
        _say_what_failed(made, solutions)
        stage.legend()
        if corner is not None:
            _distances(made, corner, found, s)
    return made


def _label(found: Comparison, i: int) -> str:
    entry = found.entries[i]
    model = "" if entry.solution.model == found.problem.rod.model else f", {entry.solution.model}"
    return entry.name + model + (" (reference)" if i == found.reference else "")


def _directors(r: Array, R: Array) -> Array:
    """Return the ends (n, 2, 2, 3) of d1 and d2 in some places."""
    at = np.linspace(0, len(r) - 1, TRIADS).astype(int)
    length = DIRECTOR * float(np.max(np.ptp(r, axis=0)))
    starts = np.repeat(r[at, None, :], 2, axis=1)
    return np.stack([starts, starts + length * np.swapaxes(R[at, :, :2], 1, 2)], axis=2)


def _draw_directors(stage: Stage, directors: Array) -> None:
    for i, pair in enumerate(directors):
        for j, ends in enumerate(pair):
            colour, dashes = palette.DIRECTORS[j], ("-", (0, (2.5, 1.0)))[j]
            label = f"$d_{j + 1}$" if i == 0 else None
            stage.line(ends, color=colour, lw=1.4, ls=dashes, zorder=4.0, label=label)
    stage.legend()


def _supports(stage: Stage, solution: EquilibriumSolution) -> None:
    for s, support in solution.problem.supports:
        stage.hold(solution.r(s), support.clamps)


def _say_what_failed(ax: Axes, solutions: list[EquilibriumSolution]) -> None:
    """Say in the title which shapes are no equilibria."""
    failed = [x for x in solutions if not x.converged]
    if failed:
        names = "" if len(solutions) == 1 else ", ".join(str(x.method) for x in failed) + " "
        ax.set_title(
            f"{names}not converged: at {100.0 * failed[0].load_factor:.0f} % of the load", color=palette.VERMILION
        )


def _free_corner(stage: Stage, curves: list[Array]) -> tuple[float, float] | None:
    """Return the lower left point of an inset that hides no curve, in fractions of the axes, or None."""
    ax = stage.scene.ax
    ax.apply_aspect()
    points = ax.transData.transform(stage.scene.camera.project(np.concatenate(curves) / stage.metres))
    x, y = ax.transAxes.inverted().transform(points).T
    top = 0.80  # below the legend
    left, right, low, high = 0.13, 1.0 - INSET[0], 0.12, top - INSET[1]
    corners = [(right, high), (right, low), (left, high), (left, low)]
    if not ax.axison:  # numbers stand at the left and below
        corners = [(right, high)]
    for a, b in corners:
        hidden = (x > a - 0.16) & (x < a + INSET[0] + 0.03) & (y > b - 0.16) & (y < b + INSET[1] + 0.05)
        if not np.any(hidden):
            return a, b
    return None


def _distances(ax: Axes, corner: tuple[float, float], found: Comparison, s: Array) -> None:
    """Draw |r - r_reference| / L over s, on a logarithmic scale, in an inset."""
    L = found.problem.rod.length
    reference = found.entries[found.reference].solution.r(s)
    unit, metres = prefix.length(L)
    inset = ax.inset_axes((*corner, INSET[0] - 0.02, INSET[1]), zorder=6.0)
    for i, entry in enumerate(found.entries):
        if i != found.reference:
            gap = np.linalg.norm(entry.solution.r(s) - reference, axis=1) / L
            dashes, colour = LINES[i % len(LINES)]
            inset.plot(s[gap > 0.0] / metres, gap[gap > 0.0], ls=dashes, color=colour, lw=1.3)
    inset.set_yscale("log")
    largest = [entry.distance.centreline for entry in found.entries if entry.distance.centreline > 0.0]
    if largest:
        inset.set_ylim(max(min(1e-3 * max(largest), 0.03 * min(largest)), 1e-17), 5.0 * max(largest))
    inset.set_xlim(0.0, L / metres)
    inset.tick_params(labelsize=8.0, pad=2.0)
    inset.set_xlabel(f"$s$ ({unit})", fontsize=8.5, labelpad=1.0)
    inset.set_title("distance / $L$", fontsize=8.5, pad=3.0)
    inset.locator_params(axis="x", nbins=4)
    inset.minorticks_off()
