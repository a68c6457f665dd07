"""The plots of docs/benchmarks.md, from recorded curves: cost against size, and error against cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.ticker import LogLocator, NullFormatter

from benchmarks.timing import Curve
from darboux.view import palette, style

OURS = (palette.BLUE, palette.SKY, palette.GREEN)
PEERS = (palette.VERMILION, palette.ORANGE, palette.BLACK)
MARKS = ("o", "s", "^")
DPI = 150


@dataclass(frozen=True)
class Panel:
    """What a panel shows, and what its two axes count."""

    title: str
    at: str
    cost: str


# Of each plot: its caption, and its panels by the family that measures them.
PLOTS: dict[str, tuple[str, dict[str, Panel]]] = {
    "cost-against-size": (
        "Cost against size, quartiles as bars. What is flat grows in proportion to the size.",
        {
            "collocation.size": Panel("collocation", "elements", "µs per element, one Newton step"),
            "discrete_rod.size": Panel("discrete rods", "nodes", "ns per node"),
            "motion.size": Panel("motion", "segments", "ns per segment, one time step"),
        },
    ),
    "error-against-cost": (
        "Error against cost, quartiles as bars; what lies further to the left and below is better.",
        {
            "collocation.error": Panel("figure 5", "position error / L", "ms"),
            "against_pyelastica.error": Panel("figure 5 with stretch", "tip error / L", "ms"),
            "initial_value.error": Panel("figure 6 with weight", "position error / L", "ms"),
        },
    ),
}
PANELS = {key: panel for _, panels in PLOTS.values() for key, panel in panels.items()}


def draw(curves: Sequence[Curve], folder: Path) -> list[tuple[str, str]]:
    """Write each plot that has curves into the folder; return their file names and captions."""
    written = []
    for name, (caption, panels) in PLOTS.items():
        drawn = {key: [curve for curve in curves if curve.panel == key] for key in panels}
        drawn = {key: found for key, found in drawn.items() if found}
        if not drawn:
            continue
        with style.article():
            figure = style.new_figure(3.2 * len(drawn), 3.9)
            for i, (key, found) in enumerate(drawn.items()):
                ax = style.axes_at(figure, 3.2 * i + 0.72, 1.35, 2.35, 2.2)
                _panel(ax, panels[key], found, by_size=key.endswith(".size"))
                style.panel_label(ax, "abc"[i], panels[key].title)
            figure.savefig(folder / f"benchmarks-{name}.png", dpi=DPI)
        written.append((f"benchmarks-{name}.png", caption))
    return written


def _panel(ax: Any, panel: Panel, curves: Sequence[Curve], *, by_size: bool) -> None:
    """Draw the curves of a panel: sizes to the right and costs upwards, or costs to the right and errors upwards."""
    drawn = {True: 0, False: 0}
    for curve in curves:
        n = drawn[curve.peer]
        drawn[curve.peer] += 1
        at, cost = np.array(curve.at), np.array([(c.low, c.median, c.high) for c in curve.cost])
        bars = np.abs(cost[:, [0, 2]] - cost[:, [1]]).T
        x, y = (at, cost[:, 1]) if by_size else (cost[:, 1], at)
        colour = (PEERS if curve.peer else OURS)[n]
        ax.errorbar(
            x, y, **{"yerr" if by_size else "xerr": bars}, label=curve.label, color=colour, marker=MARKS[n], markersize=4.5,
            linewidth=1.2, linestyle="--" if curve.peer else "-", markerfacecolor="white" if curve.peer else colour,
            elinewidth=0.8, capsize=1.5,
        )  # fmt: skip
        for mark, *point in zip(curve.marks, x, y, strict=False):
            ax.annotate(mark, point, xytext=(4, 3), textcoords="offset points", fontsize="x-small", color=colour)
    ax.set_xscale("log")
    ax.set_yscale("log")
    for axis, (low, high) in ((ax.xaxis, ax.get_xlim()), (ax.yaxis, ax.get_ylim())):
        if high < 50.0 * low:  # powers of ten alone would be too few
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter("{x:,.6g}")
        else:
            axis.set_major_locator(LogLocator(numticks=6))
        axis.set_minor_formatter(NullFormatter())
    ax.set_xlabel(panel.at if by_size else panel.cost)
    ax.set_ylabel(panel.cost if by_size else panel.at)
    ax.grid(visible=True)
    ax.legend(loc="upper center", bbox_to_anchor=(0.45, -0.2), fontsize="small", handlelength=2.2, labelspacing=0.25)
