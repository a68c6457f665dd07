"""Curvature, moment and energy along the rod, as plots of a page."""

from __future__ import annotations

from typing import Any

import numpy as np
from nicegui import ui
from numpy.typing import NDArray

from darboux.web.shape import Fields

Array = NDArray[np.float64]

COLOURS = {
    False: ("#0072b2", "#d55e00", "#009e73"),
    True: ("#56b4e9", "#ff8c42", "#2ccb9b"),
}  # told apart by the colour-blind; dashes and widths tell them in grey
DASHES: tuple[Any, ...] = ("solid", [7, 3], [2, 2])
INK = {False: ("#3a3f45", "#e3e5e7"), True: ("#c9ced3", "#33383d")}
PREFIXES = {1e9: "G", 1e6: "M", 1e3: "k", 1.0: "", 1e-3: "m", 1e-6: "\N{MICRO SIGN}", 1e-9: "n", 1e-12: "p"}
LEVELS = ((7.0, 23.0), (39.0, 23.0), (71.0, 20.0))  # top and height of each plot, in per cent


class Plots:
    """Three plots under one another, over the arc length s."""

    def __init__(self) -> None:
        self.dark = False
        self.chart = ui.echart(self._options()).classes("dx-plots")

    def show(self, fields: Fields) -> None:
        """Draw these fields."""
        step = 1e-2 if fields.s[-1] >= 0.02 else 1e-3 if fields.s[-1] >= 2e-3 else 1e-6
        step = 1.0 if fields.s[-1] >= 2.0 else step
        unit = {1.0: "m", 1e-2: "cm", 1e-3: "mm", 1e-6: "\N{MICRO SIGN}m"}[step]
        s = fields.s / step
        M, prefix_M = _scaled(fields.M)
        e, prefix_e = _scaled(fields.e)
        lines = [*fields.k.T, *M.T, e]
        titles = [
            "curvature, twist  {0|k\N{SUBSCRIPT ONE}} {1|k\N{SUBSCRIPT TWO}} {2|k\N{SUBSCRIPT THREE}}  in 1/m",
            f"moment  {{0|M\N{SUBSCRIPT ONE}}} {{1|M\N{SUBSCRIPT TWO}}} {{2|M\N{SUBSCRIPT THREE}}}  in {prefix_M}N m",
            f"elastic energy per length in {prefix_e}J/m",
        ]
        self.chart.run_chart_method(
            "setOption",
            {
                "title": [{"text": title} for title in titles],
                "xAxis": [{"max": float(s[-1]), "name": f"s, {unit}" if i == 2 else ""} for i in range(3)],
                "series": [{"data": np.round(np.stack([s, line], axis=1), 6).tolist()} for line in lines],
            },
        )

    def painted(self, dark: bool) -> None:
        """Draw for a dark or a light page."""
        self.dark = dark
        ink, grid = INK[dark]
        axis = {
            "axisLabel": {"color": ink},
            "axisLine": {"lineStyle": {"color": ink}},
            "splitLine": {"lineStyle": {"color": grid}},
        }
        self.chart.run_chart_method(
            "setOption",
            {
                "title": [{"textStyle": {"color": ink, "rich": _bold(dark)}}] * 3,
                "series": [{"color": COLOURS[dark][i % 3]} for i in range(7)],
                "xAxis": [axis | {"nameTextStyle": {"color": ink}}] * 3,
                "yAxis": [axis] * 3,
            },
        )

    def _options(self) -> dict[str, Any]:
        ink, grid = INK[False]
        text = {"color": ink, "fontSize": 12, "fontWeight": "normal", "rich": _bold(False)}
        lines = {"splitLine": {"lineStyle": {"color": grid}}, "axisLine": {"lineStyle": {"color": ink}}}
        small = {"color": ink, "fontSize": 11, "hideOverlap": True}
        names = [
            f"{name}{index}" for name in "kM" for index in "\N{SUBSCRIPT ONE}\N{SUBSCRIPT TWO}\N{SUBSCRIPT THREE}"
        ] + ["e"]
        return {
            "animation": False,
            "title": [{"text": "", "top": f"{top - 6}%", "left": 4, "textStyle": text} for top, _ in LEVELS],
            "grid": [{"top": f"{top}%", "height": f"{height}%", "left": 46, "right": 14} for top, height in LEVELS],
            "xAxis": [
                {
                    "gridIndex": i,
                    "type": "value",
                    "min": 0,
                    "axisLabel": small | {"show": i == 2},
                    "nameLocation": "middle",
                    "nameGap": 20,
                    "nameTextStyle": {"color": ink, "fontSize": 12},
                    **lines,
                }
                for i in range(3)
            ],
            "yAxis": [
                {"gridIndex": i, "type": "value", "scale": i < 2, "splitNumber": 3, "axisLabel": small, **lines}
                for i in range(3)
            ],
            "series": [
                {
                    "type": "line",
                    "name": name,
                    "xAxisIndex": i // 3,
                    "yAxisIndex": i // 3,
                    "showSymbol": False,
                    "silent": True,
                    "data": [],
                    "color": COLOURS[False][i % 3],
                    "lineStyle": {"width": 1.8, "type": DASHES[i % 3]},
                }
                for i, name in enumerate(names)
            ],
        }


def _bold(dark: bool) -> dict[str, Any]:
    """Return how the names of the lines are written in the titles, in the lines' colours."""
    return {str(i): {"color": colour, "fontSize": 13, "fontWeight": "bold"} for i, colour in enumerate(COLOURS[dark])}


def _scaled(values: Array) -> tuple[Array, str]:
    """Return values in a unit in which the largest is between 1 and 1000, and its prefix."""
    largest = float(np.max(np.abs(values)))
    factor = next((factor for factor in PREFIXES if largest >= factor), 1e-12 if largest > 0.0 else 1.0)
    return values / factor, PREFIXES[factor]
