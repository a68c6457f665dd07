"""Curvature, moment and energy along the rod, as plots of a page."""

from __future__ import annotations

from typing import Any

import numpy as np
from nicegui import ui
from numpy.typing import NDArray

from darboux.view import prefix
from darboux.web.shape import Fields

Array = NDArray[np.float64]

COLOURS = {
    False: ("#0072b2", "#d55e00", "#009e73"),
    True: ("#56b4e9", "#ff8c42", "#2ccb9b"),
}  # told apart by the colour-blind; dashes and widths tell them in grey
DASHES: tuple[Any, ...] = ("solid", [7, 3], [2, 2])
INK = {False: ("#3a3f45", "#e3e5e7"), True: ("#c9ced3", "#33383d")}
LEVELS = ((7.0, 23.0), (39.0, 23.0), (71.0, 20.0))  # top and height of each plot, in per cent


class Plots:
    """Three plots under one another, over the arc length s."""

    def __init__(self) -> None:
        self.dark = False
        self.chart = ui.echart(self._options()).classes("dx-plots")

    def show(self, fields: Fields) -> None:
        """Draw these fields."""
        unit, step = prefix.length(float(fields.s[-1]))
        s = fields.s / step
        (k, unit_k), (M, unit_M), (e, unit_e) = (
            _scaled(values, si) for values, si in ((fields.k, "1/m"), (fields.M, "N m"), (fields.e, "J/m"))
        )
        lines = [*k.T, *M.T, e]
        titles = [
            f"curvature, twist  {{0|k\N{SUBSCRIPT ONE}}} {{1|k\N{SUBSCRIPT TWO}}} {{2|k\N{SUBSCRIPT THREE}}}  in {unit_k}",
            f"moment  {{0|M\N{SUBSCRIPT ONE}}} {{1|M\N{SUBSCRIPT TWO}}} {{2|M\N{SUBSCRIPT THREE}}}  in {unit_M}",
            f"elastic energy per length in {unit_e}",
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


def _scaled(values: Array, si: str) -> tuple[Array, str]:
    """Return values in SI in a unit in which they are read easily, and that unit."""
    unit, size = prefix.quantity(float(np.max(np.abs(values))), si)
    return values / size, unit
