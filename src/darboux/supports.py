"""What holds the rod's ends. Every support is data: which half of each conjugate pair it prescribes.

At an end there are six pairs: a displacement and the force along it, a rotation and the moment about it, along three
axes. A support holds one of each pair; methods read `held_displacement` and `held_rotation`, never a class name.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux import checks
from darboux.checks import Vector, assign, description
from darboux.errors import InvalidInput
from darboux.natural import smallest_rotation

Array = NDArray[np.float64]
Flags = tuple[bool, bool, bool]


class Support:
    """Which displacements and rotations an end prescribes, along the fixed axes; the other half of each pair is free."""

    held_displacement: Flags = (False, False, False)
    held_rotation: Flags = (False, False, False)
    position: Any = (0.0, 0.0, 0.0)

    @property
    def R(self) -> Array:
        """The prescribed frame (3, 3), columns d1, d2, d3."""
        return np.eye(3)

    @property
    def holds(self) -> bool:
        """True where the support prescribes any displacement or rotation."""
        return any(self.held_displacement) or any(self.held_rotation)


@description
class Free(Support):
    """An end that nothing holds: its force and moment are those of the end loads."""


@description
class Clamped(Support):
    """An end held in position and full orientation.

    Arguments: ``position`` (3,) in m; the orientation either as ``frame`` (3, 3), a right-handed orthonormal matrix
    with the columns d1, d2, d3, or as ``tangent`` (3,), the direction of d3, with ``d1`` (3,) for the turn about it
    (its part along the tangent is taken off). Without d1 the frame is the fixed one turned by the smallest angle that
    takes e3 to the tangent. The default is d_i = e_i. Raises ``InvalidInput``.
    """

    position: Any = (0.0, 0.0, 0.0)
    tangent: Any = (0.0, 0.0, 1.0)
    d1: Any = None
    frame: Any = None

    held_displacement = (True, True, True)
    held_rotation = (True, True, True)

    def __post_init__(self) -> None:
        assign(self, position=checks.vector("clamp.position", self.position, "m"))
        if self.frame is None:
            tangent = checks.direction("clamp.tangent", self.tangent)
            d1 = None if self.d1 is None else checks.direction("clamp.d1", self.d1)
            assign(self, tangent=tangent, d1=d1)
            _frame_of(tangent, d1)
        else:
            if self.d1 is not None or tuple(np.ravel(self.tangent)) != (0.0, 0.0, 1.0):
                raise InvalidInput(
                    "clamp.frame came beside clamp.tangent or clamp.d1; give the frame or the directions."
                )
            assign(self, frame=tuple(map(tuple, checks.rotation("clamp.frame", self.frame).tolist())))

    @property
    def R(self) -> Array:
        return _frame_of(self.tangent, self.d1) if self.frame is None else np.array(self.frame)


def _frame_of(tangent: Vector, d1: Vector | None) -> Array:
    """Return the frame with d3 along the tangent and d1 as near to the one asked for as it can be."""
    d3 = np.array(tangent)
    if d1 is None:
        return smallest_rotation(np.array([0.0, 0.0, 1.0]), d3)
    normal = np.array(d1) - (np.array(d1) @ d3) * d3
    if np.linalg.norm(normal) < 1e-6:
        raise InvalidInput("clamp.d1 is parallel to clamp.tangent; it must point across the rod.")
    normal /= np.linalg.norm(normal)
    return np.column_stack([normal, np.cross(d3, normal), d3])
