"""From where shapes are seen: along the normal of the plane in which they lie, or by a camera from the side."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux.view.camera import Camera

Array = NDArray[np.float64]

FLAT = 1e-4  # of the extent: what lies off a plane by less is in it
TURNED = 0.02  # of a unit vector: a section that turns by less keeps its direction
THINNEST = 0.12  # of the longest side, that of the box
SLACK = 1.08  # of what is drawn, that of the box
MARGINS = (0.62, 0.5, 0.62, 0.4)  # inches around a box, for its numbers and labels and a legend
AZIMUTHS = (-62.0, -28.0)  # of the camera; the one that sees more of what is drawn
LARGEST, SMALLEST = 5.2, 1.5  # inches, of axes that are made for a shape


@dataclass(frozen=True, eq=False)
class Look:
    """From where ``points`` (n, 3) in m are seen; ``flat`` where they lie in a plane."""

    camera: Camera
    flat: bool
    points: Array

    @classmethod
    def at(cls, r: Any, R: Any = None) -> Look:
        """Return how the points r (..., 3) are seen best, with sections R (n, 3, 3) if their turning is to be seen."""
        points = np.asarray(r, dtype=float).reshape(-1, 3)
        normal = plane_of(points)
        if normal is not None and (R is None or np.max(np.ptp(normal @ np.asarray(R), axis=0)) < TURNED):
            return cls(Camera.facing(normal), True, points)
        across = [float(np.ptp(Camera(azimuth).project(points)[:, 0])) for azimuth in AZIMUTHS]
        return cls(Camera(AZIMUTHS[int(across[1] > 1.2 * across[0])]), False, points)

    @cached_property
    def longest(self) -> float:
        """The largest extent along an axis of space, in m, above zero."""
        return max(float(np.max(np.ptp(self.points, axis=0))), 1e-300)

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """The lowest and the highest corner (3,) in m of a box around all, no side of it thin beside the longest."""
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        room = np.maximum(high - low, THINNEST * self.longest) * SLACK
        return (low + high - room) / 2.0, (low + high + room) / 2.0

    @property
    def frame(self) -> Array:
        """The points (m, 3) in m that a picture has to hold: in space the corners of the box."""
        return self.points if self.flat else corners_of(*self.box)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height in inches of a figure that suits the shapes."""
        width, height = np.ptp(self.camera.project(self.frame), axis=0)
        across, up = np.clip(LARGEST * np.array([width, height]) / max(width, height, 1e-300), SMALLEST, LARGEST)
        beside, above = (1.1, 0.8) if self.flat else (MARGINS[0] + MARGINS[1], MARGINS[2] + MARGINS[3])
        return float(max(across, 2.2)) + beside, float(min(up, 4.4)) + above


def plane_of(points: Array) -> Array | None:
    """Return the normal (3,) of the plane in which points (n, 3) lie, or None. A straight line lies in x z where it can."""
    _, extents, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    if extents[2] > FLAT * extents[0]:
        return None
    normal = axes[2]
    if extents[1] <= FLAT * extents[0]:
        along = axes[0] if extents[0] > 0.0 else np.array([0.0, 0.0, 1.0])
        square = [e for e in np.eye(3)[[1, 0, 2]] if abs(e @ along) < FLAT]
        normal = square[0] if square else np.cross(along, [0.0, 0.0, 1.0]) / np.linalg.norm(along[:2])
    nearest = int(np.argmax(np.abs(normal)))
    return np.asarray(np.eye(3)[nearest] if abs(normal[nearest]) > 1.0 - FLAT**2 else normal)


def corners_of(low: Array, high: Array) -> Array:
    """Return the corners (8, 3) of a box."""
    return np.array([[(low, high)[b >> i & 1][i] for i in range(3)] for b in range(8)])


def named(direction: Array) -> str:
    """Return a letter for an axis of space, else the direction's components."""
    nearest = int(np.argmax(np.abs(direction)))
    if abs(direction[nearest]) > 1.0 - 1e-6:
        return f"${'' if direction[nearest] > 0.0 else '-'}{'xyz'[nearest]}$"
    return "along (" + ", ".join(f"{x + 0.0:.2g}".replace("-", "\N{MINUS SIGN}") for x in np.round(direction, 2)) + ")"
