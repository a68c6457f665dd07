"""An orthographic camera: space on equal plane axes, so that every direction keeps one scale."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """Looks at the origin from ``azimuth`` (from e1 towards e2) and ``elevation`` above the e1 e2 plane, in degrees.

        (x, y, depth) = A p,   A = [right, up, towards the viewer] as rows, a rotation

    so a length l at the angle a to the picture plane is drawn with the length l cos a, whatever its direction.
    """

    azimuth: float = -60.0
    elevation: float = 20.0

    @classmethod
    def facing(cls, normal: Any) -> Camera:
        """Return the camera that looks along the normal (3,) of a plane, from the side on which its axes run forward.

        A plane x z, y z or x y is seen with its first axis to the right and the second upwards.
        """
        n = np.asarray(normal, dtype=float)
        if abs(n[2]) > 1.0 - 1e-9:
            return cls(-90.0, 90.0)
        azimuth, elevation = np.degrees([np.arctan2(n[1], n[0]), np.arcsin(np.clip(n[2], -1.0, 1.0))])
        camera = cls(float(azimuth), float(elevation))
        right = camera.A[0]
        return camera if right[np.argmax(np.abs(right))] > 0.0 else cls(camera.azimuth + 180.0, -camera.elevation)

    @cached_property
    def A(self) -> Array:
        """The rotation (3, 3) from the fixed frame to the picture: rows right, up, towards the viewer."""
        a, e = np.radians([self.azimuth, self.elevation])
        towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        return np.array([right, np.cross(towards, right), towards])

    def project(self, points: Any) -> Array:
        """Return the points (..., 3) in the picture plane: (..., 2)."""
        return np.asarray(np.asarray(points, dtype=float) @ self.A[:2].T)

    def depth(self, points: Any) -> Array:
        """Return how near the points (..., 3) are to the viewer: (...), larger is nearer."""
        return np.asarray(np.asarray(points, dtype=float) @ self.A[2])
