"""Solids in space as faces: rods with their section, and the boxes, cones, arrows and coils of which the marks are made."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux.natural import smallest_rotation
from darboux.view.palette import rgb
from darboux.view.tube import sweep

Array = NDArray[np.float64]
Whole = NDArray[np.int64]

E3 = np.array([0.0, 0.0, 1.0])
AROUND = 32  # faces round a mark
ROUND = np.stack([np.cos(a := np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)), np.sin(a)], axis=-1)


@dataclass(frozen=True, eq=False)
class Solid:
    """``points`` (n, 3) in m; ``faces`` (m, 4) of them, turning right-handedly about the way out, a triangle's last twice.

    ``colours`` (m, 3) of the faces; ``opacity`` from 0 to 1.
    """

    points: Array
    faces: Whole
    colours: Array
    opacity: float = 1.0

    @property
    def triangles(self) -> Whole:
        """The faces as triangles (k, 3)."""
        return self._halves[self.kept]

    @property
    def kept(self) -> NDArray[np.bool_]:
        """Which halves of the faces, the first ones and then the second, are ``triangles``: (2 m,)."""
        a, b, c = self._halves.T
        return np.asarray((a != b) & (b != c) & (c != a))

    @property
    def _halves(self) -> Whole:
        return np.concatenate([self.faces[:, [0, 1, 2]], self.faces[:, [0, 2, 3]]])


def wall(n: int, m: int, first: int = 0, inwards: bool = False) -> Whole:
    """Return the faces between n closed rings of m points each, ring after ring from the point ``first`` on."""
    ring, place = np.meshgrid(np.arange(n - 1), np.arange(m), indexing="ij")
    a, b = ring * m + place, ring * m + (place + 1) % m
    faces = np.stack([a, b, b + m, a + m], axis=-1).reshape(-1, 4) + first
    return faces[:, ::-1] if inwards else faces


def lids(n: int, m: int, centres: int) -> Whole:
    """Return the flat ends of n rings of m points: fans about the points ``centres`` and ``centres`` + 1."""
    a, b = np.arange(m), (np.arange(m) + 1) % m
    start, end = np.full(m, centres), np.full(m, centres + 1)
    last = (n - 1) * m
    return np.concatenate([np.stack([b, a, start, start], axis=1), np.stack([a + last, b + last, end, end], axis=1)])


def swept(r: Any, R: Any, outline: Array, colour: Any, opacity: float = 1.0) -> Solid:
    """Return the outline (m, 2) or (n, m, 2) carried along r (n, 3) with the directors R (n, 3, 3), closed at its ends."""
    r, R = np.asarray(r, dtype=float), np.broadcast_to(R, (len(r), 3, 3))
    points = sweep(r, R, outline)
    n, m = points.shape[:2]
    faces = np.concatenate([wall(n, m), lids(n, m, n * m)])
    points = np.concatenate([points.reshape(-1, 3), r[[0, -1]]])
    return Solid(points, faces, np.tile(rgb(colour), (len(faces), 1)), opacity)


def turned(a: Array, b: Array, radii: Any, colour: Any, places: Any = None) -> Solid:
    """Return the solid of revolution from a to b with these radii, evenly or at ``places`` from 0 to 1."""
    radii = np.maximum(np.asarray(radii, dtype=float), 1e-9 * np.max(radii))
    x = np.linspace(0.0, 1.0, len(radii)) if places is None else np.asarray(places, dtype=float)
    way = b - a
    R = smallest_rotation(E3, way / np.linalg.norm(way))
    return swept(a + x[:, None] * way, R, radii[:, None, None] * ROUND, colour)


def ball(centre: Array, radius: float, colour: Any) -> Solid:
    """Return a ball."""
    angle = np.linspace(0.0, np.pi, 17)
    up = radius * E3
    return turned(centre - up, centre + up, radius * np.sin(angle), colour, 0.5 - 0.5 * np.cos(angle))


def box(centre: Array, R: Array, sizes: Any, colour: Any, opacity: float = 1.0) -> Solid:
    """Return a box with these sizes (3,) along the columns of R."""
    a, b, c = np.asarray(sizes, dtype=float) / 2.0
    corners = np.array([[a, -b], [a, b], [-a, b], [-a, -b]])
    return swept([centre - c * R[:, 2], centre + c * R[:, 2]], R, corners, colour, opacity)


def wire(points: Array, radius: float, colour: Any) -> Solid:
    """Return a round wire through the points (n, 3)."""
    tangents = np.gradient(points, axis=0)
    tangents /= np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-300)
    R = [smallest_rotation(E3, tangents[0])]
    for before, here in pairwise(tangents):
        R.append(smallest_rotation(before, here) @ R[-1])
    return swept(points, np.array(R), radius * ROUND[::2], colour)


def arrow(start: Array, vector: Array, radius: float, colour: Any, heads: int = 1) -> list[Solid]:
    """Return an arrow along the vector; two ``heads`` mark a moment, by the right-hand rule."""
    length = float(np.linalg.norm(vector))
    way = vector / length
    head = min(6.0 * radius, 0.9 * length / heads)
    end = start + vector
    shaft = turned(start, end - 0.9 * head * way, [radius, radius], colour)
    tips = [end - i * 0.75 * head * way for i in range(heads)]
    return [
        shaft,
        *(turned(tip - head * way, tip, [2.2 * radius * head / (6.0 * radius), 0.0], colour) for tip in tips),
    ]


def turning_arrow(centre: Array, axis: Array, size: float, radius: float, colour: Any) -> list[Solid]:
    """Return an arc of three quarters about the axis that ends in a head, turning right-handedly: a moment."""
    R = smallest_rotation(E3, axis / np.linalg.norm(axis))
    angle = np.linspace(0.25 * np.pi, 1.75 * np.pi, 49)
    ring = centre + size * (np.cos(angle)[:, None] * R[:, 0] + np.sin(angle)[:, None] * R[:, 1])
    way = -np.sin(angle[-1]) * R[:, 0] + np.cos(angle[-1]) * R[:, 1]
    return [
        wire(ring, radius, colour),
        turned(ring[-1] - 1.5 * radius * way, ring[-1] + 5.0 * radius * way, [2.4 * radius, 0.0], colour),
    ]


def coil(a: Array, b: Array, radius: float, wire_radius: float, colour: Any, turns: int = 5) -> Solid:
    """Return a coil spring from a to b."""
    way = b - a
    R = smallest_rotation(E3, way / np.linalg.norm(way))
    x = np.linspace(0.0, 1.0, 24 * turns + 1)
    size = radius * np.clip(np.minimum(x, 1.0 - x) / 0.12, 0.0, 1.0)
    angle = 2.0 * np.pi * turns * x
    points = (
        a + x[:, None] * way + size[:, None] * (np.cos(angle)[:, None] * R[:, 0] + np.sin(angle)[:, None] * R[:, 1])
    )
    return wire(points, wire_radius, colour)
