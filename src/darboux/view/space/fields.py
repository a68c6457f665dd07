"""What a rod's surface can show by its colour: fields along the rod, and stress on the section's outline, with their units."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from darboux import stress
from darboux.view.space.shape import Shape

Array = NDArray[np.float64]

OUTLINE: Array = np.linspace(0.0, 4.0, 65)
CONSTANT = 1e-6  # of the largest value: a field that varies by less is drawn as one colour


@dataclass(frozen=True)
class Field:
    """``words`` for people, the SI ``unit``, and ``along`` of a shape: values (n,)."""

    words: str
    unit: str
    along: Callable[[Shape], Array]


FIELDS = {
    "curvature": Field("curvature", "1/m", lambda shape: np.hypot(shape.k[:, 0], shape.k[:, 1])),
    "twist": Field("twist", "1/m", lambda shape: shape.k[:, 2]),
    "moment": Field("moment", "N m", lambda shape: np.linalg.norm(shape.forces[:, 3:], axis=1)),
    "force": Field("force", "N", lambda shape: np.linalg.norm(shape.forces[:, :3], axis=1)),
    "tension": Field("tension", "N", lambda shape: shape.forces[:, 2]),
    "stress": Field("von Mises stress", "Pa", lambda shape: np.max(on_surface("stress", shape, OUTLINE), axis=1)),
    "energy": Field("elastic energy", "J/m", lambda shape: 0.5 * np.sum(shape.strains * shape.forces, axis=1)),
    "speed": Field("speed", "m/s", lambda shape: np.linalg.norm(shape.velocity, axis=1)),  # type: ignore[arg-type]
}


def known(shape: Shape) -> list[str]:
    """Return the fields that this shape has."""
    missing = set()
    if shape.velocity is None:
        missing |= {"speed"}
    else:
        missing |= {"force"}  # of which the discrete rod in motion keeps the axial part only
    if not shape.axial_force_known:
        missing |= {"tension", "stress"}
    if not shape.rod.section.has_shape:
        missing |= {"stress"}
    return [name for name in FIELDS if name not in missing]


def on_surface(name: str, shape: Shape, p: Array, size: Array | None = None) -> Array:
    """Return a field (n, m) on the section's outline at the places p (m,), or on the same made smaller by ``size`` (n,)."""
    if name != "stress":
        return np.broadcast_to(FIELDS[name].along(shape)[:, None], (len(shape.s), len(p)))
    size = np.ones_like(shape.s) if size is None else size
    return stress.von_mises(shape.rod, shape.s, shape.forces[:, 2], shape.forces[:, 3:], p, size)


def span(values: list[Array]) -> tuple[float, float]:
    """Return the least and the largest value; of a constant field a little more on either side."""
    low = min(float(np.min(x)) for x in values)
    high = max(float(np.max(x)) for x in values)
    size = max(abs(low), abs(high))
    if high - low > CONSTANT * size and size > 0.0:
        return low, high
    middle = 0.5 * (low + high)
    room = 0.1 * abs(middle) if abs(middle) > 1e-290 else 1.0
    return middle - room, middle + room
