"""What is asked of every figure: no word cut off or on another, legends beside the data, one scale for all directions."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.text import Text


def is_space(ax: Axes) -> bool:
    return ax.get_gid() == "space"


def texts(figure: Figure) -> list[Text]:
    """The texts that are seen: those of ticks outside the axes' limits are made but not drawn."""
    hidden = set()
    for ax in figure.findobj(Axes):
        for axis in (ax.xaxis, ax.yaxis):
            low, high = sorted(axis.get_view_interval())
            ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
            slack = 1e-9 * (high - low)
            out = [t for t in ticks if not ax.axison or not low - slack <= t.get_loc() <= high + slack]
            hidden |= {id(label) for t in out for label in (t.label1, t.label2)}
            if not ax.axison:
                hidden |= {id(axis.label), id(axis.offsetText)}
    found = figure.findobj(Text)
    return [t for t in found if t.get_visible() and t.get_text().strip() and id(t) not in hidden]


def assert_no_word_is_cut_off(figure: Figure, least: int) -> None:
    width, height = figure.bbox.size
    seen = texts(figure)
    assert len(seen) >= least
    for text in seen:
        box = text.get_window_extent()
        assert np.all(np.isfinite(box.get_points())), text.get_text()
        assert min(box.x0, box.y0, width - box.x1, height - box.y1) >= 0, text.get_text()


def assert_no_two_words_lie_on_each_other(figure: Figure) -> None:
    seen = [(t.get_text(), t.get_window_extent()) for t in texts(figure) if t.get_rotation() in (0.0, 90.0)]
    for i, (a, box) in enumerate(seen):
        for b, other in seen[i + 1 :]:
            across = min(box.x1, other.x1) - max(box.x0, other.x0)
            up = min(box.y1, other.y1) - max(box.y0, other.y0)
            smaller = min(box.width * box.height, other.width * other.height)
            assert across <= 0 or up <= 0 or across * up < 0.15 * smaller, (a, b)


def assert_one_scale_for_all_directions(figure: Figure) -> None:
    for ax in figure.axes:
        lengths = "m)" in ax.get_xlabel() and "m)" in ax.get_ylabel() and "time" not in ax.get_xlabel()
        if (lengths and "arc length" not in ax.get_xlabel()) or is_space(ax):
            corner, right, up = ax.transData.transform([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
            np.testing.assert_allclose(right[0] - corner[0], up[1] - corner[1], rtol=1e-6)


def assert_all_is_finite(figure: Figure) -> None:
    for ax in figure.axes:
        assert np.all(np.isfinite([ax.get_xlim(), ax.get_ylim()]))
        for line in ax.findobj(Line2D):
            assert not np.any(np.isinf(np.asarray(line.get_xydata(), dtype=float)))


def assert_legends_hide_no_line(figure: Figure) -> None:
    for legend in figure.findobj(Legend):
        box = legend.get_window_extent()
        for ax in figure.axes:
            for line in ax.get_lines():
                if line.get_transform() == ax.transData and len(line.get_xydata()) > 2:
                    points = ax.transData.transform(line.get_xydata())
                    inside = ax.bbox.x0, ax.bbox.y0, ax.bbox.x1, ax.bbox.y1
                    shown = np.all((points >= inside[:2]) & (points <= inside[2:]), axis=1)
                    hidden = np.all((points > box.p0) & (points < box.p1), axis=1)
                    assert not np.any(shown & hidden), line.get_label()
