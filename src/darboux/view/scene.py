"""A picture of space: lines, arrows, faces and labels seen by one camera, on axes with one scale for all directions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from darboux.view.camera import Camera
from darboux.view.look import corners_of
from darboux.view.palette import BLACK
from darboux.view.style import axes_at, size_of
from darboux.view.tube import Faces

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Margins = tuple[float, float, float, float]

MOST_NUMBERS = 5  # along an edge of a box, about
ALONG = 0.94  # cosine of the angle, 20 degrees, below which two lines run along each other
CORNER = 0.9  # of the type's size: free of numbers at the ends of an edge


@dataclass(frozen=True)
class Scene:
    """What ``camera`` sees, drawn on ``ax``; every point is (..., 3), in the unit that the axes' labels name."""

    ax: Axes
    camera: Camera

    @classmethod
    def at(cls, figure: Figure, place: tuple[float, float, float, float], camera: Camera) -> Scene:
        """Return an empty scene at ``place``: left, bottom, width, height in inches."""
        ax = axes_at(figure, *place)
        ax.set_axis_off()
        ax.set_gid("space")
        return cls(ax, camera)

    def fit(self, points: Any, margins: Margins = (0.1, 0.1, 0.1, 0.1)) -> None:
        """Choose the scale: the points fill the axes up to ``margins`` (left, right, bottom, top in inches)."""
        flat = self.camera.project(points).reshape(-1, 2)
        low, high = flat.min(axis=0), flat.max(axis=0)
        size = size_of(self.ax)
        room = size - np.array([margins[0] + margins[1], margins[2] + margins[3]])
        scale = float(np.max((high - low) / room))  # units per inch
        middle = (low + high) / 2.0 - scale * np.array([margins[0] - margins[1], margins[2] - margins[3]]) / 2.0
        self.ax.set_xlim(*(middle[0] + scale * size[0] / 2.0 * np.array([-1.0, 1.0])))
        self.ax.set_ylim(*(middle[1] + scale * size[1] / 2.0 * np.array([-1.0, 1.0])))
        self.ax.set_aspect("equal", adjustable="box")

    def line(self, points: Any, halo: float = 0.0, **style: Any) -> Any:
        """Draw a line through the points (n, 3); ``halo`` points of white round it part it from what lies behind."""
        x, y = self.camera.project(points).T
        if halo:
            width = style.get("lw", 1.8) + 2.0 * halo
            self.ax.plot(x, y, color="white", lw=width, solid_capstyle="butt", zorder=style.get("zorder", 3.0) - 0.01)
        return self.ax.plot(x, y, **style)[0]

    def curve(
        self, points: Array, *, width: float, colour: Any, halo: float = 1.2, pieces: int = 60, zorder: float = 3.0
    ) -> None:
        """Draw a line that visibly passes before itself where it is nearer.

        Its ``pieces`` are drawn from back to front, each on a white halo with flat ends; a piece reaches a little into
        its neighbours, so that no joint shows. A piece that runs along another, in the scale that ``fit`` has set before,
        has no halo, which would cut that one.
        """
        from matplotlib.collections import LineCollection

        flat, depth = self.camera.project(points), self.camera.depth(points)
        cuts = np.linspace(0, len(points) - 1, pieces + 1).astype(int)
        order = np.argsort([depth[i : j + 1].mean() for i, j in pairwise(cuts)])
        beside = self._beside(flat, width + 2.0 * halo, len(points) // pieces)
        lines, widths = [], []
        for i, j in ((cuts[n], cuts[n + 1]) for n in order):
            lines += [flat[i : j + 1], flat[max(i - 2, 0) : j + 3]]
            widths += [0.0 if np.any(beside[i : j + 1]) else width + 2.0 * halo, width]
        collection = LineCollection(
            lines,
            colors=["white", colour] * pieces,
            linewidths=widths,
            capstyle="butt",
            joinstyle="round",
            zorder=zorder,
        )
        self.ax.add_collection(collection, autolim=False)

    def _beside(self, flat: Array, reach: float, apart: int) -> Any:
        """Return (n,) where a line of the picture runs along another part of itself, less than ``reach`` points from it.

        Parts are others where more than ``apart`` points of the line lie between them.
        """
        page = self.ax.transData.transform(flat) * 72.0 / self.ax.get_figure(root=True).dpi  # type: ignore[union-attr]
        way = np.gradient(page, axis=0)
        way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-300)
        found = np.zeros(len(flat), dtype=bool)
        for shift in range(2 * apart, len(flat)):
            gap, turn = page[shift:] - page[:-shift], np.sum(way[shift:] * way[:-shift], axis=1)
            near = (np.sum(gap**2, axis=1) < reach**2) & (np.abs(turn) > ALONG)
            found[:-shift] |= near
            found[shift:] |= near
        return found

    def faces(self, faces: Faces, zorder: float = 2.0, strength: float = 1.0) -> None:
        """Draw the faces from back to front, outlined in their own colours to hide the seams; paler below strength 1."""
        from matplotlib.collections import PolyCollection

        order = np.argsort(self.camera.depth(faces.corners).mean(axis=1))
        colours = 1.0 - strength * (1.0 - faces.colours[order])  # not see-through: faces still hide each other
        polygons = PolyCollection(
            list(self.camera.project(faces.corners[order])),
            facecolors=colours,
            edgecolors=colours,
            linewidths=0.4,
            zorder=zorder,
        )
        self.ax.add_collection(polygons, autolim=False)

    def outline(self, points: Any, **style: Any) -> None:
        """Draw the closed polygon through the points (n, 3)."""
        from matplotlib.patches import Polygon

        self.ax.add_patch(Polygon(self.camera.project(points), closed=True, **style))

    def arrow(
        self,
        start: Any,
        vector: Any,
        *,
        colour: str = BLACK,
        width: float = 1.8,
        head: float = 13.0,
        heads: int = 1,
        style: str = "-",
        zorder: float = 6.0,
        halo: float = 0.0,
    ) -> None:
        """Draw an arrow from ``start`` along ``vector``; two ``heads`` mark a moment, by the right-hand rule."""
        from matplotlib.patches import FancyArrowPatch
        from matplotlib.patheffects import Normal, Stroke

        a = self.camera.project(start)
        b = self.camera.project(np.asarray(start, dtype=float) + np.asarray(vector, dtype=float))
        for i in range(heads):
            patch = FancyArrowPatch(
                tuple(a),
                tuple(b),
                arrowstyle="-|>,head_length=0.55,head_width=0.2",
                mutation_scale=head,
                shrinkA=0.0,
                shrinkB=i * 0.62 * head,
                lw=width,
                linestyle=style if i == 0 else "-",
                color=colour,
                joinstyle="miter",
                capstyle="butt",
                zorder=zorder,
            )
            if halo and i == 0:
                patch.set_path_effects([Stroke(linewidth=width + 2.0 * halo, foreground="white"), Normal()])
            self.ax.add_patch(patch)

    def arc(
        self, points: Any, *, colour: str, width: float = 1.4, head: float = 10.0, zorder: float = 6.0, style: Any = "-"
    ) -> None:
        """Draw a curved line through the points (n, 3) that ends in an arrow's head."""
        from matplotlib.patches import FancyArrowPatch

        flat = self.camera.project(points)
        self.ax.plot(*flat.T, color=colour, lw=width, linestyle=style, zorder=zorder)
        self.ax.add_patch(
            FancyArrowPatch(
                tuple(flat[-2]),
                tuple(flat[-1] + 1e-3 * (flat[-1] - flat[-2])),
                arrowstyle="-|>,head_length=0.55,head_width=0.2",
                mutation_scale=head,
                shrinkA=0.0,
                shrinkB=0.0,
                lw=width,
                color=colour,
                zorder=zorder,
            )
        )

    def text(
        self, point: Any, words: str, offset: tuple[float, float] = (0.0, 0.0), halo: float = 1.5, **style: Any
    ) -> Any:
        """Write at a point (3,), moved by ``offset`` points on the page, on a white ``halo``."""
        from matplotlib.patheffects import Normal, Stroke

        style = {"ha": "center", "va": "center", "zorder": 9.0, "in_layout": False, **style}  # within the axes' margins
        if halo:
            style["path_effects"] = [Stroke(linewidth=2.0 * halo, foreground="white", alpha=0.85), Normal()]
        x, y = self.camera.project(point)
        return self.ax.annotate(
            words, (x, y), xytext=offset, textcoords="offset points", annotation_clip=False, **style
        )

    def label_arrow(self, start: Any, vector: Any, words: str, gap: float = 8.0, **style: Any) -> None:
        """Write beyond the head of the arrow, ``gap`` points further on."""
        way = self.camera.project(vector)
        length = float(np.linalg.norm(way))
        direction = way / length if length > 0.0 else np.array([0.0, 1.0])
        end = np.asarray(start, dtype=float) + np.asarray(vector, dtype=float)
        self.text(end, words, (float(gap * direction[0]), float(gap * direction[1])), **style)

    def dot(self, point: Any, **style: Any) -> None:
        """Draw one marker at a point (3,)."""
        style = {"marker": "o", "ms": 4.5, "color": BLACK, "zorder": 7.0, **style}
        x, y = self.camera.project(point)
        self.ax.plot([x], [y], linestyle="none", **style)

    def scale_bar(self, length: float, label: str, place: tuple[float, float]) -> None:
        """Draw a bar of ``length`` from ``place`` (fractions of the axes): true for lengths in the picture plane."""
        x, y = self.ax.transLimits.inverted().transform(place)
        self.ax.plot([x, x + length], [y, y], color=BLACK, lw=2.4, solid_capstyle="butt", zorder=8.0)
        self.ax.annotate(
            label,
            (x + length / 2.0, y),
            xytext=(0.0, 4.0),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=10.0,
        )

    def box(
        self,
        lowest: Sequence[float],
        highest: Sequence[float],
        step: Sequence[float] | None,
        labels: tuple[str, str, str],
        *,
        grid: str = "#e3e3e3",
        size: float = 9.0,
    ) -> Array:
        """Draw the three far sides of the box with a grid, and numbers along three near edges.

        Returns the corners (8, 3), for ``fit``. A number stands at each multiple of ``step``; None: as many as there is room
        for in the scale that ``fit`` has set before.
        """
        low, high = np.array(lowest, dtype=float), np.array(highest, dtype=float)
        near = np.where(self.camera.A[2] > 0.0, high, low)
        far = np.where(self.camera.A[2] > 0.0, low, high)
        edges = [self._edge(i, low, high, near, far) for i in range(3)]
        if step is None:
            ticks = [self._readable(edge, i, size) for i, edge in enumerate(edges)]
        else:
            ticks = [_multiples(low[i], high[i], step[i]) for i in range(3)]
            for i in (0, 1):  # at the corners the numbers of two axes would meet
                inside = (ticks[i] > low[i] + 0.1 * step[i]) & (ticks[i] < high[i] - 0.1 * step[i])
                ticks[i] = ticks[i][inside]
        for side in range(3):  # the far side across axis `side`
            for i in (j for j in range(3) if j != side):
                k = 3 - side - i
                for value in [low[i], *ticks[i], high[i]]:
                    ends = np.empty((2, 3))
                    ends[:, side], ends[:, i], ends[:, k] = far[side], value, (low[k], high[k])
                    border = value in (low[i], high[i])
                    self.line(
                        ends, color="#c4c4c4" if border else grid, lw=0.8 if border else 0.6, zorder=0.5 + 0.1 * border
                    )
        middle = self.camera.project((low + high) / 2.0)
        for i, edge in enumerate(edges):
            self._numbers(edge, i, ticks[i], middle, labels[i], size)
        return corners_of(low, high)

    def _readable(self, edge: Array, i: int, size: float) -> Array:
        """Return round values along an edge of axis i whose numbers do not touch each other or those of the next edge."""
        pixels = self.ax.transData.transform(self.camera.project(edge))
        way = (pixels[1] - pixels[0]) * 72.0 / self.ax.get_figure(root=True).dpi  # type: ignore[union-attr]  # in points
        low, high = edge[:, i]
        clear = CORNER * size * (high - low) / np.linalg.norm(way) if i < 2 else 0.0
        found = np.empty(0)
        for step in _nice_steps((high - low) / MOST_NUMBERS):
            if len(found) == 0:  # at least one, in the middle
                found = np.array([step * np.round(0.5 * (low + high) / step)]) + 0.0
            ticks = _multiples(low + clear, high - clear, step)
            if len(ticks) == 0:
                return np.asarray(found[[len(found) // 2]])
            found = ticks
            room = np.abs(way) * step / (high - low)
            if room[0] >= _width(ticks, size) + 0.5 * size or room[1] >= 1.4 * size:
                break
        return found

    def _edge(self, i: int, low: Array, high: Array, near: Array, far: Array) -> Array:
        """Return the ends (2, 3) of the edge that carries the numbers of axis i: low in the front, or on the left."""
        ends = np.stack([far, far])
        if i < 2:
            ends[:, 1 - i] = near[1 - i]
            ends[:, 2] = low[2]
        else:
            corners = [np.array([near[0], far[1], 0.0]), np.array([far[0], near[1], 0.0])]
            left = min(corners, key=lambda c: float(self.camera.project(c)[0]))
            ends[:, 0], ends[:, 1] = left[0], left[1]
        ends[:, i] = low[i], high[i]
        return ends

    def _numbers(self, edge: Array, i: int, ticks: Array, middle: Array, label: str, size: float) -> None:
        flat = self.camera.project(edge)
        along = flat[1] - flat[0]
        normal = np.array([-along[1], along[0]]) / np.linalg.norm(along)
        if normal @ (flat.mean(axis=0) - middle) < 0.0:
            normal = -normal
        depth = _width(ticks, size) * abs(normal[0]) + 0.8 * size * abs(normal[1])  # of the numbers, along the normal
        self.ax.plot(*flat.T, color="#4d4d4d", lw=0.8, zorder=0.8)
        for value in ticks:
            point = edge[0].copy()
            point[i] = value
            x, y = self.camera.project(point)
            self.ax.annotate(
                "",
                (x, y),
                xytext=(3.5 * normal[0], 3.5 * normal[1]),
                textcoords="offset points",
                arrowprops={"arrowstyle": "-", "lw": 0.8, "color": "#4d4d4d", "shrinkA": 0.0, "shrinkB": 0.0},
                annotation_clip=False,
                in_layout=False,
            )
            out = 6.0 + 0.5 * depth
            self.text(point, _words(value), (out * normal[0], out * normal[1]), fontsize=size)
        turn = np.degrees(np.arctan2(along[1], along[0]))
        turn = (turn + 90.0) % 180.0 - 90.0
        turn = 90.0 if abs(abs(turn) - 90.0) < 1.0 else turn
        gap = 10.0 + depth + 0.6 * size
        offset = gap * normal
        way = np.ptp(self.ax.transData.transform(flat), axis=0) * 72.0 / self.ax.get_figure(root=True).dpi  # type: ignore[union-attr]
        length = _length([label], size + 1.0)
        if i < 2 and length > np.linalg.norm(
            way
        ):  # no room along the edge: level, below its numbers, from the corner outwards
            outwards = np.sign(along[0]) * (1.0 if flat[0, 1] < flat[1, 1] else -1.0)
            offset = (6.0 + 0.5 * depth) * normal - np.array([0.0, 1.4 * size + 1.0])
            offset[0] += 0.5 * outwards * (length - way[0])
            turn = 0.0
        self.text(
            edge.mean(axis=0),
            label,
            (float(offset[0]), float(offset[1])),
            fontsize=size + 1.0,
            rotation=turn,
            rotation_mode="anchor",
        )


def _words(value: float) -> str:
    return f"{value:g}".replace("-", "\N{MINUS SIGN}")


def _width(ticks: Array, size: float) -> float:
    """Return how wide the longest number is, in points."""
    return _length([_words(value) for value in ticks], size)


def _length(words: Sequence[str], size: float) -> float:
    """Return how long the longest of some words is, in points."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(size=size)
    widths = (text_to_path.get_text_width_height_descent(word, font, ismath="$" in word)[0] for word in words)
    return float(max(widths, default=0.0))


def _nice_steps(least: float) -> Iterator[float]:
    """Yield 1, 2, 5 times the powers of ten that are at least ``least``, ascending."""
    power = 10.0 ** np.floor(np.log10(least))
    while True:
        yield from (float(digit * power) for digit in (1.0, 2.0, 5.0) if digit * power >= least * (1.0 - 1e-9))
        power *= 10.0


def _multiples(low: float, high: float, step: float) -> Array:
    first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
    return np.asarray(np.arange(first, last + 0.5) * step) + 0.0
