"""The rod as a solid with its true section, made thicker where it would be too thin to see, with stripes that show its twist."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from darboux.rod import Rod
from darboux.section import Ellipse, Section
from darboux.view.palette import BLACK, on_scale, rgb
from darboux.view.space import fields
from darboux.view.space.shape import Shape
from darboux.view.space.solids import Solid, lids, wall
from darboux.view.tube import sweep

Array = NDArray[np.float64]

THINNEST = 0.03  # of the picture's extent
FLATTEST = 8.0  # to which a section without shape is drawn
STRIPES = (
    (1.0, 0.0, 0.07),
    (0.0, 1.0, 0.022),
    (-1.0, 0.0, 0.022),
    (0.0, -1.0, 0.022),
)  # towards d1, d2; width over outline
CROWDED = 0.8  # of the radius of curvature, to which half a thickness may grow
QUARTER = 16  # faces on a quarter of the outline
LID = "#e9e6dc"


@dataclass(frozen=True)
class Drawn:
    """How a rod's section is drawn: its own, ``factor`` times as thick, or where it has no shape an ellipse that stands for it."""

    section: Section
    factor: float
    own: bool

    @property
    def note(self) -> str:
        """What the picture must say of it; nothing where all is true to scale."""
        if not self.own:
            return "the section has no shape: its thickness is only drawn"
        return "" if self.factor == 1.0 else f"section drawn {self.factor:g} times as thick"

    def outline(self, s: Array, p: Array) -> Array:
        """Return the outline (n, m, 2) as drawn."""
        return self.factor * self.section.outline(s, np.broadcast_to(p, (len(s), len(p))))


def drawn(rod: Rod, extent: float, largest_curvature: float = 0.0, thicker: float | None = None) -> Drawn:
    """Return how the rod is drawn in a picture of this extent in m: ``thicker`` times as it is, or as thick as can be seen."""
    wanted = THINNEST * extent
    if not rod.section.has_shape:
        stiffness = rod.stiffness(np.linspace(0.0, rod.length, 17))
        ratio = np.sqrt(float(np.mean(stiffness.EI1) / np.mean(stiffness.EI2)))  # I1 / I2 = b^2 / a^2
        ratio = float(np.clip(ratio, 1.0 / FLATTEST, FLATTEST))
        size = 0.5 * wanted * (thicker or 1.0)
        return Drawn(Ellipse(size / max(1.0, ratio), size * min(1.0, ratio)), 1.0, own=False)
    if thicker is not None:
        return Drawn(rod.section, thicker, own=True)
    s = np.linspace(0.0, rod.length, 33)
    p = np.linspace(0.0, 4.0, 4 * QUARTER + 1)
    thickness = 2.0 * float(np.max(np.linalg.norm(Drawn(rod.section, 1.0, own=True).outline(s, p), axis=-1)))
    most = 2.0 * CROWDED / (largest_curvature * thickness) if largest_curvature > 0.0 else np.inf
    return Drawn(rod.section, max(1.0, min(_round_number(wanted / thickness), _round_number(most, up=False))), own=True)


def _round_number(value: float, up: bool = True) -> float:
    """Return the next of 1, 1.5, 2, 3, 5, 7 times a power of ten, above or below; 1 for less."""
    if not 1.0 < value < 1e300:
        return 1.0 if value <= 1.0 else value
    power = 10.0 ** np.floor(np.log10(value))
    steps = [digit * power for digit in (1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0)]
    return float(min(x for x in steps if x >= value * (1.0 - 1e-9)) if up else max(x for x in steps if x <= value))


def places(section: Section, quarter: int = QUARTER) -> tuple[Array, NDArray[np.int64]]:
    """Return places p (m,) round the outline, and to the stripe of which each face from p to the next belongs (m,).

    ``quarter`` is how many faces lie on a quarter of it.
    0: none, 1: the broad stripe along d1, 2: the fine ones along d2, -d1 and -d2.
    """
    fine = np.linspace(0.0, 4.0, 1601)
    x = section.outline(np.zeros(1), fine[None])[0]
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(x, axis=0), axis=1))])
    p = list(np.linspace(0.0, 4.0, 4 * quarter, endpoint=False))
    ends = []
    for towards1, towards2, width in STRIPES:
        ahead, aside = x @ [towards1, towards2], x @ [-towards2, towards1]
        middle = along[np.argmin(np.where(ahead > 0.0, np.abs(aside), np.inf))]
        edges = np.interp((middle + np.array([-0.5, 0.5]) * width * along[-1]) % along[-1], along, fine) % 4.0
        ends.append(edges)
        p = [a for a in p if min(abs(a - edge) for edge in edges) > 0.2 / quarter or a == round(a)] + list(edges)
    result = np.unique(np.round(p, 12))
    middles = result + 0.5 * ((np.roll(result, -1) - result) % 4.0)
    stripe = np.zeros(len(result), dtype=np.int64)
    for number, (a, b) in enumerate(ends, start=1):
        stripe[(middles - a) % 4.0 < (b - a) % 4.0] = min(number, 2)
    return result, stripe


@dataclass(frozen=True, eq=False)
class Body:
    """The rod's surface: rings of m points at n places, then those of the hole, then the middles of the ends.

    ``points`` (k, 3) in m; ``faces`` (j, 4); ``stripe`` (j,) 0, or 1 and 2 on stripes, 3 at the ends and in the hole.
    """

    shape: Shape
    drawn: Drawn
    p: Array
    points: Array
    faces: NDArray[np.int64]
    stripe: NDArray[np.int64]
    hollow: bool

    @classmethod
    def of(
        cls,
        shape: Shape,
        drawn: Drawn,
        thickness: Callable[[Array], Array] | None = None,
        quarter: int = QUARTER,
    ) -> Body:
        """Return the surface of a shape, closed, drawn in this way; ``thickness`` multiplies it along x = s / L."""
        p, stripe = places(drawn.section, quarter)
        outline, hole = drawn.outline(shape.s, p), drawn.section.hole(shape.s)
        if thickness is not None:
            outline = thickness(shape.s / shape.s[-1])[:, None, None] * outline
        n, m = len(shape.s), len(p)
        rings = sweep(shape.r, shape.R, outline).reshape(-1, 3)
        outside = wall(n, m)
        marked = np.tile(stripe, n - 1)
        if not np.all(hole > 0.0):
            ends = lids(n, m, n * m)
            points = np.concatenate([rings, shape.r[[0, -1]]])
            faces, hollow = np.concatenate([outside, ends]), False
        else:
            inside = sweep(shape.r, shape.R, hole[:, None, None] * outline).reshape(-1, 3)
            a, b = np.arange(m), (np.arange(m) + 1) % m
            last = (n - 1) * m
            start = np.stack([a, a + n * m, b + n * m, b], axis=1)
            ends = np.concatenate([start, start[:, ::-1] + last])
            ends = np.concatenate([wall(n, m, n * m, inwards=True), ends])
            points = np.concatenate([rings, inside])
            faces, hollow = np.concatenate([outside, ends]), True
        marked = np.concatenate([marked, np.full(len(faces) - len(marked), 3, dtype=np.int64)])
        return cls(shape, drawn, p, points, faces, marked, hollow)

    def along(self, values: Array) -> Array:
        """Return what is given along the rod, (n,) or (n, 3), at the points (k,)."""
        rings = np.repeat(values, len(self.p), axis=0)
        return np.concatenate([rings, rings if self.hollow else values[[0, -1]]])

    def values(self, name: str) -> Array:
        """Return a field at the points (k,)."""
        outside = fields.on_surface(name, self.shape, self.p)
        if self.hollow:
            hole = self.shape.rod.section.hole(self.shape.s)
            return np.concatenate([outside, fields.on_surface(name, self.shape, self.p, hole)]).ravel()
        middle = fields.on_surface(name, self.shape, self.p[:1], np.zeros_like(self.shape.s))
        return np.append(outside.ravel(), middle[[0, -1], 0])

    def solid(self, name: str | None, span: tuple[float, float], colour: str, opacity: float = 1.0) -> Solid:
        """Return the rod coloured by a field between the ends of ``span``, or in one colour."""
        if name is None:
            colours = np.tile(rgb(colour), (len(self.faces), 1))
        else:
            inner = np.mean(self.values(name)[self.faces], axis=1)
            colours = on_scale((inner - span[0]) / (span[1] - span[0]))
        for number, mark in ((1, BLACK), (2, "#ffffff")):
            colours[self.stripe == number] = rgb(mark)
        if name is None:
            colours[self.stripe == 3] = rgb(LID)
        return Solid(self.points, self.faces, colours, opacity)
