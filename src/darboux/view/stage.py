"""Axes for shapes: the plane in which they lie, with its two coordinates, or space, in a box; one scale for all directions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from darboux.view import palette, prefix, style
from darboux.view.look import MARGINS, Look, named
from darboux.view.scene import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

AROUND = 0.18  # inches, free around shapes in a plane


@dataclass(frozen=True)
class Stage:
    """Axes on which shapes are drawn in the unit ``unit``, which is ``metres`` m."""

    scene: Scene
    unit: str
    metres: float

    @classmethod
    def on(cls, ax: Axes, look: Look, right: float = 0.0) -> Stage:
        """Make axes ready for what a look has seen; ``right`` keeps that share of them free at the right."""
        unit, metres = prefix.length(look.longest)
        scene = Scene(ax, look.camera)
        stage = cls(scene, unit, metres)
        if look.flat:
            stage._plane(look, right)
        else:
            stage._box(look, right)
        return stage

    def legend(self) -> None:
        """Write the legend above what is drawn."""
        ax = self.scene.ax
        style.legend_on_top(ax, kept=0.0 if ax.axison else MARGINS[3] * _tight(ax))

    def _plane(self, look: Look, right: float) -> None:
        ax = self.scene.ax
        flat = look.camera.project(look.frame) / self.metres
        ax.set_xlim(*_room(flat[:, 0], look.longest / self.metres))
        ax.set_ylim(*_room(flat[:, 1], look.longest / self.metres))
        ax.set_xlabel(f"{named(look.camera.A[0])} ({self.unit})")
        ax.set_ylabel(f"{named(look.camera.A[1])} ({self.unit})")
        ax.grid(visible=True)
        style.settle(ax)
        width, height = style.size_of(ax)
        beside, above = min(AROUND, 0.06 * width), min(AROUND, 0.06 * height)
        self.scene.fit(look.frame / self.metres, (beside, beside + right * width, above, above))

    def _box(self, look: Look, right: float) -> None:
        ax = self.scene.ax
        ax.set_axis_off()
        ax.set_gid("space")
        style.settle(ax)
        low, high = (corner / self.metres for corner in look.box)
        width = style.size_of(ax)[0]
        left, beside, below, above = (_tight(ax) * margin for margin in MARGINS)
        margins = np.array([left, beside + right * width, below, above])
        labels = (f"$x$ ({self.unit})", f"$y$ ({self.unit})", f"$z$ ({self.unit})")
        before = set(ax.get_children())
        for more in (True, True, False):  # room for the numbers is known when they stand
            self.scene.fit(look.frame / self.metres, tuple(margins))
            self.scene.box(low.tolist(), high.tolist(), None, labels)
            made = [artist for artist in ax.get_children() if artist not in before]
            lacking = _lacking(ax, made)
            if not more or np.all(lacking <= 0.0):
                break
            margins = margins + np.maximum(lacking, 0.0)
            for artist in made:
                artist.remove()

    def shape(self, r: Array, width: float = 2.0, colour: str = palette.BLUE) -> None:
        """Draw one rod through r (n, 3) in m, in space so that it visibly passes before itself."""
        if self.scene.ax.axison:
            self.line(r, lw=width, color=colour)
        else:
            self.scene.curve(r / self.metres, width=width, colour=colour)

    def line(self, r: Array, **look: Any) -> Any:
        """Draw a line through r (n, 3) in m."""
        return self.scene.line(r / self.metres, **{"zorder": 3.0, **look})

    def hold(self, place: Array, clamped: bool) -> None:
        """Mark a held point (3,) in m: a square for a clamp, a disc for what lets the rod turn."""
        self.scene.dot(place / self.metres, marker="s" if clamped else "o", ms=5.0)


def _tight(ax: Axes) -> float:
    """Return by how much the margins of small axes are smaller."""
    width, height = style.size_of(ax)
    return float(np.clip(min(width / 4.0, height / 3.2), 0.8, 1.0))


def _lacking(ax: Axes, artists: list[Any]) -> Array:
    """Return by how much words stand out of the axes: left, right, below, above in inches."""
    from matplotlib.text import Text

    boxes = [artist.get_window_extent() for artist in artists if isinstance(artist, Text) and artist.get_text()]
    low, high = np.min([box.p0 for box in boxes], axis=0), np.max([box.p1 for box in boxes], axis=0)
    out = np.array([ax.bbox.x0 - low[0], high[0] - ax.bbox.x1, ax.bbox.y0 - low[1], high[1] - ax.bbox.y1])
    return np.asarray(out / ax.get_figure(root=True).dpi)  # type: ignore[union-attr]


def _room(values: Array, longest: float) -> tuple[float, float]:
    """Return limits around values, never of no width."""
    half = 0.5 * max(float(np.ptp(values)), 0.1 * longest)
    middle = 0.5 * float(np.min(values) + np.max(values))
    return middle - half, middle + half
