"""What lies flat on a picture of space: colour bar, scale bar, axes, gravity, names, notes and labels."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkRenderingCore import vtkActor2D, vtkPolyDataMapper2D, vtkTextActor
from vtkmodules.vtkRenderingFreeType import vtkVectorText  # noqa: F401  # loads what draws letters

from darboux.view.palette import BLACK, on_scale, rgb
from darboux.view.space.marks import Label

Array = NDArray[np.float64]

SMALLEST, RELATIVE = (
    11.0,
    0.0245,
)  # the height of letters: in pixels, else of the picture's height, or of 3/4 of its width
WIDE = 0.62  # of a letter over its height
BAR_STEPS = 128
UNITS = (("km", 1e3), ("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("µm", 1e-6), ("nm", 1e-9))
AXES = "#5a6068"


@dataclass(frozen=True)
class Bar:
    """A colour bar: ``title`` with the unit, and the least and largest value in that unit."""

    title: str
    low: float
    high: float


@dataclass
class Overlay:
    """All that is written on the picture; lengths in letters' heights."""

    bar: Bar | None = None
    names: list[tuple[str, str | None]] = field(default_factory=list)  # words, and the colour of what they name
    notes: list[str] = field(default_factory=list)
    labels: list[Label] = field(default_factory=list)
    gravity: Array | None = None
    actors: list[Any] = field(default_factory=list)
    seen: Any = None

    def letter(self, width: float, height: float) -> float:
        """Return the height of letters in pixels in a picture of this size, in which the longest line fits."""
        longest = max(map(len, [*self.notes, *(name for name, _ in self.names), self.bar.title if self.bar else ""]))
        return min(max(SMALLEST, RELATIVE * min(height, 0.75 * width)), width / (WIDE * longest + 3.6))

    def margins(self, width: float, height: float) -> tuple[float, float, float, float]:
        """Return what the overlay needs at the left, right, bottom and top, in pixels."""
        f = self.letter(width, height)
        right = 6.2 * f if self.bar else 1.5 * f
        top = 1.5 * f + 1.5 * f * max(float(len(self.names)), 1.3 if self.bar else 0.0)
        return 1.5 * f, right, (5.6 + 1.5 * len(self.notes)) * f, top

    def boxes(self, A: Array, pixel: float, f: float) -> Array:
        """Return the corners (2 n, 2) of the labels in the picture plane in m, where a pixel is ``pixel`` m wide."""
        corners = []
        for label in self.labels:
            x, y, wide = _beside(label, A, f)
            corners.append(A[:2] @ label.point / pixel + [[x, y - 0.8 * f], [x + wide, y + 0.8 * f]])
        return pixel * np.reshape(corners, (-1, 2))

    def attach(self, renderer: Any) -> None:
        """Lay the overlay out before each drawing in which the view has changed."""
        renderer.AddObserver("StartEvent", lambda *_: self._layout(renderer))

    def _layout(self, renderer: Any) -> None:
        camera = renderer.GetActiveCamera()
        width, height = renderer.GetSize()
        view = (width, height, camera.GetMTime(), id(self.bar), tuple(self.names), tuple(self.notes), len(self.labels))
        if view == self.seen or width < 2:
            return
        self.seen = view
        for actor in self.actors:
            renderer.RemoveViewProp(actor)
        page = _Page(width, height, self.letter(width, height))
        A = _axes_of(camera)
        pixel = 2.0 * camera.GetParallelScale() / height  # m
        self._write_labels(page, A, np.array(camera.GetFocalPoint()), pixel)
        self._corner(page, A)
        self._scale_bar(page, pixel)
        if self.bar:
            self._colour_bar(page, self.bar)
        self._words(page)
        self.actors = page.actors()
        for actor in self.actors:
            renderer.AddViewProp(actor)

    def _write_labels(self, page: _Page, A: Array, focus: Array, pixel: float) -> None:
        for label in self.labels:
            at = A[:2] @ (label.point - focus) / pixel + np.array([page.width, page.height]) / 2.0
            x, y, _ = _beside(label, A, page.f)
            page.text(at[0] + x, at[1] + y, label.words, halo=True)

    def _corner(self, page: _Page, A: Array) -> None:
        """The fixed axes, and beside them where gravity pulls."""
        f = page.f
        origin = np.array([3.0 * f, (2.6 + 1.5 * len(self.notes)) * f])
        for i in np.argsort(A[2]):
            tip = origin + 1.7 * f * A[:2, i]
            if np.linalg.norm(tip - origin) < 0.35 * f:
                continue  # seen from its end
            page.arrow(origin, tip, 0.11 * f, AXES)
            beyond = origin + 2.45 * f * A[:2, i] * max(1.0, 0.6 / float(np.linalg.norm(A[:2, i])))
            page.text(beyond[0], beyond[1], "xyz"[i], "center", colour=AXES)
        if self.gravity is not None and np.any(self.gravity):
            way = A[:2] @ self.gravity / np.linalg.norm(self.gravity)
            middle = origin + np.array([4.4 * f, 0.0])
            page.arrow(middle - 1.3 * f * way, middle + 1.3 * f * way, 0.13 * f, BLACK)
            page.text(middle[0] + 0.6 * f, middle[1], "g", colour=BLACK)

    def _scale_bar(self, page: _Page, pixel: float) -> None:
        f = page.f
        length = _nice_below(0.25 * page.width * pixel)
        unit, size = next(((unit, size) for unit, size in UNITS if length >= size * (1.0 - 1e-9)), UNITS[-1])
        wide = length / pixel
        right, y = page.width - 1.2 * f, (1.0 + 1.5 * len(self.notes)) * f
        page.rectangle(right - wide, y, right, y + 0.28 * f, BLACK)
        page.text(right - 0.5 * wide, y + 1.1 * f, f"{length / size:g} {unit}", "center")

    def _colour_bar(self, page: _Page, bar: Bar) -> None:
        f = page.f
        left, right = page.width - 5.6 * f, page.width - 4.5 * f
        low, high = (5.2 + 1.5 * len(self.notes)) * f, page.height - 3.4 * f
        edges = np.linspace(low, high, BAR_STEPS + 1)
        colours = on_scale((np.arange(BAR_STEPS) + 0.5) / BAR_STEPS)
        for a, b, colour in zip(edges[:-1], edges[1:], colours, strict=True):
            page.rectangle(left, a, right, b + 0.5, colour)
        for value in ticks(bar.low, bar.high, (high - low) / (3.0 * f)):
            y = low + (high - low) * (value - bar.low) / (bar.high - bar.low)
            page.rectangle(right, y - 0.05 * f, right + 0.35 * f, y + 0.05 * f, BLACK)
            page.text(right + 0.55 * f, y, f"{value:.4g}".replace("-", "\N{MINUS SIGN}"))
        page.text(page.width - 0.8 * f, page.height - 1.6 * f, bar.title, "right")

    def _words(self, page: _Page) -> None:
        f = page.f
        for i, (words, colour) in enumerate(self.names):
            y = page.height - (1.6 + 1.5 * i) * f
            if colour is not None:
                page.rectangle(0.9 * f, y - 0.32 * f, 2.3 * f, y + 0.32 * f, colour)
            page.text(2.8 * f if colour is not None else 0.9 * f, y, words)
        for i, words in enumerate(reversed(self.notes)):
            page.text(0.9 * f, (0.9 + 1.5 * i) * f, words, colour=AXES)


def _beside(label: Label, A: Array, f: float) -> tuple[float, float, float]:
    """Return where a label begins, beside its point, and how wide it is, in pixels."""
    way = A[:2] @ label.way
    way = way / max(float(np.linalg.norm(way)), 1e-9)
    wide = WIDE * f * len(label.words)
    return 0.5 * f * way[0] + 0.5 * wide * (way[0] - 1.0), 0.9 * f * way[1], wide


def ticks(low: float, high: float, most: float) -> Array:
    """Return round numbers from low to high, about as many as ``most`` and two at least."""
    step = _nice_below((high - low) / max(2.0, min(most, 6.0)) * 1.999)
    while np.floor(high / step + 1e-9) - np.ceil(low / step - 1e-9) < 1.0:
        step = _nice_below(step * 0.6)
    return np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 0.5) * step + 0.0


def _nice_below(value: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that is not above the value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(digit * power for digit in (1.0, 2.0, 5.0) if digit * power <= value * (1.0 + 1e-9)))


def _axes_of(camera: Any) -> Array:
    """Return right, up and towards the viewer as the rows of a rotation (3, 3)."""
    towards, up = -np.array(camera.GetDirectionOfProjection()), np.array(camera.GetViewUp())
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(towards, right), towards])


class _Page:
    """The flat picture, in pixels from its lower left corner."""

    def __init__(self, width: float, height: float, f: float) -> None:
        self.width, self.height, self.f = width, height, f
        self.corners: list[Array] = []
        self.colours: list[Array] = []
        self.texts: list[Any] = []

    def polygon(self, corners: Any, colour: Any) -> None:
        """Fill a quadrangle (4, 2)."""
        self.corners.append(np.asarray(corners, dtype=float))
        self.colours.append(rgb(colour))

    def rectangle(self, left: float, low: float, right: float, high: float, colour: Any) -> None:
        """Fill a rectangle."""
        self.polygon([(left, low), (right, low), (right, high), (left, high)], colour)

    def arrow(self, start: Array, end: Array, width: float, colour: str) -> None:
        """Draw a flat arrow."""
        length = float(np.linalg.norm(end - start))
        if length < 1e-6:
            return
        way = (end - start) / length
        across = np.array([-way[1], way[0]])
        neck = end - min(6.0 * width, 0.7 * length) * way
        self.polygon(
            [
                start - width * across / 2,
                neck - width * across / 2,
                neck + width * across / 2,
                start + width * across / 2,
            ],
            colour,
        )
        self.polygon([neck - 2.2 * width * across, end, end, neck + 2.2 * width * across], colour)

    def text(
        self, x: float, y: float, words: str, align: str = "left", colour: str = BLACK, halo: bool = False
    ) -> None:
        """Write words whose middle line is at y."""
        actor = vtkTextActor()
        actor.SetInput(words)
        properties = actor.GetTextProperty()
        font = _font()
        if font is not None:
            properties.SetFontFamily(4)  # VTK_FONT_FILE
            properties.SetFontFile(font)
        properties.SetFontSize(round(self.f))
        properties.SetColor(*rgb(colour))
        getattr(
            properties,
            {"left": "SetJustificationToLeft", "center": "SetJustificationToCentered"}.get(
                align, "SetJustificationToRight"
            ),
        )()
        properties.SetVerticalJustificationToCentered()
        if halo:
            properties.SetBackgroundColor(1.0, 1.0, 1.0)
            properties.SetBackgroundOpacity(0.65)
        actor.SetPosition(x, y)
        self.texts.append(actor)

    def actors(self) -> list[Any]:
        """Return what was drawn, to be added to a renderer."""
        points = np.zeros((4 * len(self.corners), 3))
        points[:, :2] = np.concatenate(self.corners)
        data = polydata(points, np.arange(len(points)).reshape(-1, 4), np.array(self.colours))
        mapper = vtkPolyDataMapper2D()
        mapper.SetInputData(data)
        flat = vtkActor2D()
        flat.SetMapper(mapper)
        return [flat, *self.texts]


def polydata(points: Array, faces: NDArray[np.int64], colours: Array) -> Any:
    """Return faces (m, k) of points (n, 3) in colours (m, 3) as VTK's data."""
    data, at, cells = vtkPolyData(), vtkPoints(), vtkCellArray()
    at.SetData(numpy_to_vtk(np.ascontiguousarray(points), deep=True))
    m, k = faces.shape
    cells.SetData(
        numpy_to_vtkIdTypeArray(np.arange(0, m * k + 1, k, dtype=np.int64), deep=True),
        numpy_to_vtkIdTypeArray(np.ascontiguousarray(faces, dtype=np.int64).ravel(), deep=True),
    )
    data.SetPoints(at)
    data.SetPolys(cells)
    scalars = numpy_to_vtk(np.round(255.0 * np.clip(colours, 0.0, 1.0)).astype(np.uint8), deep=True)
    scalars.SetName("colour")
    data.GetCellData().SetScalars(scalars)
    return data


def _font() -> str | None:
    """Return the file of a font with all letters, which comes with Matplotlib; that need not be loaded for it."""
    found = importlib.util.find_spec("matplotlib")
    if found is None or found.origin is None:
        return None
    file = Path(found.origin).parent / "mpl-data" / "fonts" / "ttf" / "DejaVuSans.ttf"
    return str(file) if file.is_file() else None
