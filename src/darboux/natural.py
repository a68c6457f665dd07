"""Natural shapes: the curvature and twist k0(s) that a rod has when nothing acts on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux import checks
from darboux.checks import Vector, assign, description
from darboux.errors import InvalidInput

Array = NDArray[np.float64]


@description
class Helix:
    """A natural helix, with d1 along its principal normal (towards the axis) and no material twist beside its torsion.

        k0 = (0, kappa, tau),  kappa = a / (a^2 + c^2),  tau = c / (a^2 + c^2),  c = pitch / 2 pi

    Arguments: ``radius`` a in m, positive; ``pitch`` in m per turn, positive, or 0 for a ring;
    ``handed`` "right" or "left" (the left-handed helix has tau < 0).
    """

    radius: float
    pitch: float
    handed: str = "right"

    def __post_init__(self) -> None:
        pitch = checks.number("natural.pitch", self.pitch, "m")
        if pitch < 0.0:
            raise InvalidInput(
                f"natural.pitch is {pitch:g} m; it must not be negative. For a left-handed helix write handed='left'."
            )
        assign(
            self,
            radius=checks.positive("natural.radius", self.radius, "m"),
            pitch=pitch,
            handed=checks.choice("natural.handed", self.handed, ("right", "left")),
        )

    @property
    def curvature(self) -> Vector:
        """k0 in 1/m, section's frame."""
        c = self.pitch / (2.0 * np.pi)
        squared = self.radius**2 + c**2
        sign = 1.0 if self.handed == "right" else -1.0
        return (0.0, self.radius / squared, sign * c / squared)

    def frame(self, axis: object = (0.0, 0.0, 1.0)) -> Array:
        """Return the clamp's frame [d1 d2 d3] (3, 3) for which the helix advances along ``axis``."""
        return frame_of_helix(self.curvature, axis)


def frame_of_helix(k: object, axis: object = (0.0, 0.0, 1.0)) -> Array:
    """Return the frame at s = 0 for which a rod of constant curvature k winds about, and advances along, an axis.

        R k/|k| = sign(k3) axis

    Arguments: ``k`` (3,) in 1/m, section's frame, not zero; ``axis`` (3,) a direction in the fixed frame.
    Returns R (3, 3), columns d1, d2, d3. Raises ``InvalidInput`` for a k of zero length.
    """
    inner = np.array(checks.direction("k", k))
    outer = np.array(checks.direction("axis", axis)) * (-1.0 if inner[2] < 0.0 else 1.0)
    return smallest_rotation(inner, outer)


def smallest_rotation(a: Array, b: Array) -> Array:
    """Return the rotation by the smallest angle that takes the unit vector a to the unit vector b: (3, 3).

    Half a turn about a, then half a turn about the bisector h of a and b (a normal of a where b = -a):

        Q = (2 h h^T - 1)(2 a a^T - 1)
    """
    h = a + b if a @ b > 0.0 else np.cross(np.cross(a, b), a - b)  # along a + b too, and exact where that cancels
    if not np.any(h):
        h = np.cross(a, np.eye(3)[np.argmin(np.abs(a))])
    h /= np.max(np.abs(h))  # so that no square underflows
    h /= np.linalg.norm(h)
    return np.asarray((2.0 * np.outer(h, h) - np.eye(3)) @ (2.0 * np.outer(a, a) - np.eye(3)))
