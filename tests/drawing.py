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
    seen = [(text.get_text(), corners(text)) for text in texts(figure)]
    for i, (a, box) in enumerate(seen):
        for b, other in seen[i + 1 :]:
            assert overlap(box, other) < 0.15 * min(side(box), side(other)), (a, b)


def corners(text: Text) -> np.ndarray:
    """The corners (4, 2) of the box around a text, turned as it is."""
    turn = text.get_rotation()
    middle = text.get_window_extent().get_points().mean(axis=0)
    text.set_rotation(0.0)
    box = text.get_window_extent()
    text.set_rotation(turn)
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    half = 0.5 * np.array(
        [[-box.width, -box.height], [box.width, -box.height], [box.width, box.height], [-box.width, box.height]]
    )
    return middle + half @ np.array([[c, s], [-s, c]])


def side(box: np.ndarray) -> float:
    """The shorter side of a box."""
    return float(min(np.linalg.norm(box[1] - box[0]), np.linalg.norm(box[2] - box[1])))


def overlap(one: np.ndarray, other: np.ndarray) -> float:
    """How deep two boxes lie in each other, in the direction in which it is least."""
    depths = []
    for box in (one, other):
        for way in (box[1] - box[0], box[2] - box[1]):
            direction = way / max(float(np.linalg.norm(way)), 1e-9)
            a, b = one @ direction, other @ direction
            depths.append(min(a.max(), b.max()) - max(a.min(), b.min()))
    return float(min(depths))


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
        assert all(text.get_text().strip() for text in legend.get_texts()), "a line without a name"
        box = legend.get_window_extent()
        for ax in figure.axes:
            for line in ax.get_lines():
                if line.get_transform() == ax.transData and len(line.get_xydata()) > 2:
                    points = ax.transData.transform(line.get_xydata())
                    inside = ax.bbox.x0, ax.bbox.y0, ax.bbox.x1, ax.bbox.y1
                    shown = np.all((points >= inside[:2]) & (points <= inside[2:]), axis=1)
                    hidden = np.all((points > box.p0) & (points < box.p1), axis=1)
                    assert not np.any(shown & hidden), line.get_label()
