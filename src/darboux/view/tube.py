"""The surface of a rod as shaded faces, from its centreline and its directors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LIGHT = np.array([-0.45, 0.55, 0.70])  # in the camera's axes: from above, over the viewer's left shoulder


@dataclass(frozen=True)
class Faces:
    """Flat faces in space: ``corners`` (n, 4, 3) and the colour of each, ``colours`` (n, 3) in RGB."""

    corners: Array
    colours: Array

    def __add__(self, other: Faces) -> Faces:
        return Faces(np.concatenate([self.corners, other.corners]), np.concatenate([self.colours, other.colours]))


def sweep(r: Array, R: Array, outline: Array) -> Array:
    """Return the points r + x1 d1 + x2 d2 (n, m, 3) of an outline (x1, x2), (m, 2) or (n, m, 2), carried along the rod."""
    return np.asarray(r[:, None] + np.broadcast_to(outline, (len(r), *outline.shape[-2:])) @ R[:, :, :2].swapaxes(1, 2))


def tube(
    r: Array,
    R: Array,
    radius: float,
    view: Array,
    *,
    colour: Any,
    lines: Sequence[tuple[float, float, Any]] = (),
    around: int = 32,
) -> Faces:
    """Return the faces of a round rod that look at the viewer, with material lines along it that show its twist.

    Arguments: ``r`` (n, 3) the centreline and ``R`` (n, 3, 3) the directors at n sections; ``radius``; ``view`` (3, 3)
    the camera's rotation; ``colour`` in RGB; ``lines`` the angle from d1, the half width (both in rad) and the colour
    of each material line; ``around`` the faces round a section.
    """
    strips = sorted(lines, key=lambda line: line[0])
    edges = [place + side * half for place, half, _ in strips for side in (-1.0, 1.0)]
    plain = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False) + np.pi / around
    free = [a for a in plain if all(abs(_wrapped(a - place)) > 1.5 * half for place, half, _ in strips)]
    angle = np.sort(np.array(free + edges))
    angle = np.append(angle, angle[0] + 2.0 * np.pi)
    points = sweep(r, R, radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1))
    corners = np.stack([points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]], axis=2)
    normal = corners.mean(axis=2) - 0.5 * (r[:-1] + r[1:])[:, None]
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    base = np.broadcast_to(np.array(colour, dtype=float), normal.shape).copy()
    middle = 0.5 * (angle[:-1] + angle[1:])
    for place, half, line_colour in strips:
        base[:, np.abs(_wrapped(middle - place)) < half] = line_colour
    seen = normal @ view[2] > -0.05
    return Faces(corners[seen], _shaded(base[seen], normal[seen], view))


def cap(
    r: Array, R: Array, radius: float, view: Array, *, colour: Any, outward: float = 1.0, around: int = 48
) -> Faces:
    """Return the flat end of a round rod at r (3,), R (3, 3); ``outward`` is the sign of d3 that leaves the rod."""
    normal = outward * R[:, 2]
    if normal @ view[2] <= 0.0:
        return Faces(np.empty((0, 4, 3)), np.empty((0, 3)))
    angle = np.linspace(0.0, 2.0 * np.pi, around + 1)
    rim = r + radius * (np.cos(angle)[:, None] * R[:, 0] + np.sin(angle)[:, None] * R[:, 1])
    centre = np.broadcast_to(r, (around // 2, 3))
    corners = np.stack([centre, rim[:-1:2], rim[1::2], rim[2::2]], axis=1)
    shade = (0.96 + 0.04 * normal[None] @ view.T @ LIGHT[:, None] / np.linalg.norm(LIGHT)) * np.array(
        colour
    )  # flat and light
    return Faces(corners, np.repeat(shade, len(corners), axis=0))


def _wrapped(angle: Array) -> Array:
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi)


def _shaded(colours: Array, normal: Array, view: Array) -> Array:
    """Return the colours under one lamp: soft, so that the light side is nearly the colour itself."""
    lamp = view.T @ (LIGHT / np.linalg.norm(LIGHT))
    bright = np.clip(normal @ lamp, -1.0, 1.0)
    shade = 0.80 + 0.22 * bright - 0.10 * (1.0 - np.clip(normal @ view[2], 0.0, 1.0)) ** 2
    gleam = 0.25 * np.clip(bright, 0.0, 1.0)[..., None] ** 12
    return np.asarray(np.clip(colours * shade[..., None] + gleam * (1.0 - colours), 0.0, 1.0))
