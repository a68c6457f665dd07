"""What holds the rod's ends. Every support is data: which half of each conjugate pair it prescribes.

At an end there are six pairs: a displacement and the force along it, a rotation and the moment about it, along three
axes. A support holds one of each pair, or ties the two by a spring; methods read that and never ask for a class name.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux import checks, frames
from darboux.checks import Vector, assign, description
from darboux.errors import InvalidInput
from darboux.natural import smallest_rotation

Array = NDArray[np.float64]
Flags = tuple[bool, bool, bool]

ALL: Flags = (True, True, True)
NONE: Flags = (False, False, False)
AXES = np.eye(3)


class Support:
    """Which displacements and rotations an end prescribes; the other half of each pair is free, or a spring's.

    ``held_displacement`` along the columns of ``displacement_axes``, which turn with the section where ``sliding`` is
    "section"; ``held_rotation`` about the columns of ``rotation_axes``, in the fixed frame at the prescribed frame R.
    One held rotation is a universal joint: free about the first axis, fixed in space, and about the second, fixed in
    the section. ``linear`` (N/m) and ``rotational`` (N m/rad) are the springs (3, 3), fixed frame, or None.
    """

    held_displacement: Flags = NONE
    held_rotation: Flags = NONE
    sliding: str = "fixed"
    position: Any = (0.0, 0.0, 0.0)
    twist: float = 0.0
    linear: Any = None
    rotational: Any = None

    @property
    def R(self) -> Array:
        """The prescribed frame (3, 3), columns d1, d2, d3, before the twist about d3."""
        return np.eye(3)

    @property
    def displacement_axes(self) -> Array:
        """The axes of the displacement pairs as columns (3, 3)."""
        return AXES

    @property
    def rotation_axes(self) -> Array:
        """The axes of the rotation pairs as columns (3, 3)."""
        return AXES

    @property
    def holds(self) -> bool:
        """True where the support prescribes a displacement or a rotation, or ties one by a spring."""
        springs = self.linear is not None or self.rotational is not None
        return any(self.held_displacement) or any(self.held_rotation) or springs

    @property
    def clamps(self) -> bool:
        """True where all six displacements and rotations are prescribed."""
        return all(self.held_displacement) and all(self.held_rotation)

    def energy(self, r: Array, R: Array) -> float:
        """Return the energy of the springs in J, 1/2 u.linear u + 1/2 theta.rotational theta, at r (3,) and the frame R (3, 3)."""
        energy, u = 0.0, r - np.array(self.position)
        if self.linear is not None:
            energy += 0.5 * float(u @ np.array(self.linear) @ u)
        if self.rotational is not None:
            theta = frames.rotation_vector(R @ self.R.T)
            energy += 0.5 * float(theta @ np.array(self.rotational) @ theta)
        return energy

    @property
    def plain(self) -> bool:
        """True for a clamp without twist and for a free end, which every method can state."""
        return (self.clamps and self.twist == 0.0) or not self.holds


@description
class Free(Support):
    """An end that nothing holds: its force and moment are those of the end loads."""


class _Oriented(Support):
    """A support with a frame, given as a matrix or as directions."""

    frame: Any
    tangent: Any
    d1: Any

    def _check_pose(self, name: str) -> None:
        assign(self, position=checks.vector(f"{name}.position", self.position, "m"))
        if self.frame is None:
            tangent = checks.direction(f"{name}.tangent", self.tangent)
            d1 = None if self.d1 is None else checks.direction(f"{name}.d1", self.d1)
            assign(self, tangent=tangent, d1=d1)
            _frame_of(name, tangent, d1)
        else:
            if self.d1 is not None or tuple(np.ravel(self.tangent)) != (0.0, 0.0, 1.0):
                raise InvalidInput(
                    f"{name}.frame came beside {name}.tangent or {name}.d1; give the frame or the directions."
                )
            assign(self, frame=tuple(map(tuple, checks.rotation(f"{name}.frame", self.frame).tolist())))

    @property
    def R(self) -> Array:
        return _frame_of("", self.tangent, self.d1) if self.frame is None else np.array(self.frame)


@description
class Clamped(_Oriented):
    """An end held in position and full orientation; both may be displacements, which grow with the loads.

    Arguments: ``position`` (3,) in m; the orientation either as ``frame`` (3, 3), a right-handed orthonormal matrix
    with the columns d1, d2, d3, or as ``tangent`` (3,), the direction of d3, with ``d1`` (3,) for the turn about it
    (its part along the tangent is taken off). Without d1 the frame is the fixed one turned by the smallest angle that
    takes e3 to the tangent. The default is d_i = e_i. ``twist`` in rad turns the frame about d3 once more, by any
    number of turns, as in ``twist=4 * darboux.turn``. Raises ``InvalidInput``.
    """

    position: Any = (0.0, 0.0, 0.0)
    tangent: Any = (0.0, 0.0, 1.0)
    d1: Any = None
    frame: Any = None
    twist: float = 0.0

    held_displacement = ALL
    held_rotation = ALL

    def __post_init__(self) -> None:
        self._check_pose("clamp")
        assign(self, twist=checks.number("clamp.twist", self.twist, "rad"))


@description
class Pinned(Support):
    """A ball joint: held in position, free to turn.

    Argument: ``position`` (3,) in m. Raises ``InvalidInput``.
    """

    position: Any = (0.0, 0.0, 0.0)

    held_displacement = ALL

    def __post_init__(self) -> None:
        assign(self, position=checks.vector("pinned.position", self.position, "m"))


@description
class Hinge(_Oriented):
    """A hinge: held in position, free to turn about one axis only.

    Arguments: ``axis`` (3,) fixed frame; ``position`` (3,) in m; ``tangent`` (3,) with ``d1`` (3,), or ``frame`` (3, 3),
    the frame at no turn, as in ``Clamped``. Raises ``InvalidInput``.
    """

    axis: Any
    position: Any = (0.0, 0.0, 0.0)
    tangent: Any = (0.0, 0.0, 1.0)
    d1: Any = None
    frame: Any = None

    held_displacement = ALL
    held_rotation = (False, True, True)

    def __post_init__(self) -> None:
        self._check_pose("hinge")
        assign(self, axis=checks.direction("hinge.axis", self.axis))

    @property
    def rotation_axes(self) -> Array:
        return axes_along(self.axis)


@description
class Universal(_Oriented):
    """A universal (Cardan) joint: held in position, free to turn about two axes at right angles.

    Arguments: ``axis`` (3,), fixed in space, and ``section_axis`` (3,), fixed in the section, both in the fixed frame
    at no turn; ``position`` (3,) in m; ``tangent`` (3,) with ``d1`` (3,), or ``frame`` (3, 3), the frame at no turn, as in
    ``Clamped``. Raises ``InvalidInput``. Twist about the third axis passes through, as in a Cardan shaft.
    """

    axis: Any
    section_axis: Any
    position: Any = (0.0, 0.0, 0.0)
    tangent: Any = (0.0, 0.0, 1.0)
    d1: Any = None
    frame: Any = None

    held_displacement = ALL
    held_rotation = (False, False, True)

    def __post_init__(self) -> None:
        self._check_pose("universal")
        a = checks.direction("universal.axis", self.axis)
        b = checks.direction("universal.section_axis", self.section_axis)
        if abs(np.dot(a, b)) > 1e-9:
            raise InvalidInput("universal.axis and universal.section_axis are not at right angles; they must be.")
        assign(self, axis=a, section_axis=b)

    @property
    def rotation_axes(self) -> Array:
        a, b = np.array(self.axis), np.array(self.section_axis)
        return np.column_stack([a, b, np.cross(a, b)])


@description
class Roller(Support):
    """A roller: free to turn, and to slide along one direction.

    Arguments: ``along`` (3,) the direction, in the frame that ``sliding`` names; ``position`` (3,) in m, a point of the line;
    ``sliding`` "fixed", or "section": a groove that turns with the end. Raises ``InvalidInput``.
    """

    along: Any
    position: Any = (0.0, 0.0, 0.0)
    sliding: str = "fixed"

    held_displacement = (False, True, True)

    def __post_init__(self) -> None:
        assign(
            self,
            along=checks.direction("roller.along", self.along),
            position=checks.vector("roller.position", self.position, "m"),
            sliding=checks.choice("roller.sliding", self.sliding, ("fixed", "section")),
        )

    @property
    def displacement_axes(self) -> Array:
        return axes_along(self.along)


@description
class Slider(_Oriented):
    """A slider: held in orientation, free to slide along one direction of the fixed frame.

    Arguments: ``along`` (3,) the direction; ``position`` (3,) in m, a point of the line; ``tangent`` (3,) with ``d1`` (3,), or
    ``frame`` (3, 3), the orientation, and ``twist`` in rad, as in ``Clamped``. Raises ``InvalidInput``.
    """

    along: Any
    position: Any = (0.0, 0.0, 0.0)
    tangent: Any = (0.0, 0.0, 1.0)
    d1: Any = None
    frame: Any = None
    twist: float = 0.0

    held_displacement = (False, True, True)
    held_rotation = ALL

    def __post_init__(self) -> None:
        self._check_pose("slider")
        assign(
            self,
            along=checks.direction("slider.along", self.along),
            twist=checks.number("slider.twist", self.twist, "rad"),
        )

    @property
    def displacement_axes(self) -> Array:
        return axes_along(self.along)


@description
class Guided(_Oriented):
    """A guide: held in orientation, free to move in every direction.

    Arguments: ``tangent`` (3,) with ``d1`` (3,), or ``frame`` (3, 3), the orientation, and ``twist`` in rad, as in
    ``Clamped``. Raises ``InvalidInput``.
    """

    tangent: Any = (0.0, 0.0, 1.0)
    d1: Any = None
    frame: Any = None
    twist: float = 0.0

    held_rotation = ALL
    position = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        self._check_pose("guided")
        assign(self, twist=checks.number("guided.twist", self.twist, "rad"))


@description
class Spring(_Oriented):
    """An elastic support: the end's force and moment follow its displacement and rotation.

        force on the rod = -linear (r - position),     moment on the rod = -d/d(rotation) [1/2 theta . rotational theta]

    with theta the rotation vector from the prescribed frame to the section's. Arguments: ``linear`` in N/m and
    ``rotational`` in N m/rad, each one number or a symmetric matrix (3, 3) in the fixed frame, not negative;
    ``position`` (3,) in m; ``tangent`` (3,) with ``d1`` (3,), or ``frame`` (3, 3), the frame without moment, as in ``Clamped``.
    Conservative. Raises ``InvalidInput``.
    """

    linear: Any = None
    rotational: Any = None
    position: Any = (0.0, 0.0, 0.0)
    tangent: Any = (0.0, 0.0, 1.0)
    d1: Any = None
    frame: Any = None

    def __post_init__(self) -> None:
        self._check_pose("spring")
        if self.linear is None and self.rotational is None:
            raise InvalidInput("spring.linear and spring.rotational are both missing; give one in N/m or N m/rad.")
        for name, unit in (("linear", "N/m"), ("rotational", "N m/rad")):
            value = getattr(self, name)
            if value is not None:
                assign(self, **{name: checks.stiffness_matrix(f"spring.{name}", value, unit)})


def axes_along(first: Any) -> Array:
    """Return a right-handed orthonormal frame whose first column points along a direction (3,)."""
    return smallest_rotation(AXES[0], np.array(first))


@lru_cache(maxsize=1024)
def _frame_of(name: str, tangent: Vector, d1: Vector | None) -> Array:
    """Return the frame with d3 along the tangent and d1 as near to the one asked for as it can be; not to be written to."""
    R = _frame_along(name, tangent, d1)
    R.flags.writeable = False
    return R


def _frame_along(name: str, tangent: Vector, d1: Vector | None) -> Array:
    d3 = np.array(tangent)
    if d1 is None:
        return smallest_rotation(AXES[2], d3)
    normal = np.array(d1) - (np.array(d1) @ d3) * d3
    if np.linalg.norm(normal) < 1e-6:
        raise InvalidInput(f"{name}.d1 is parallel to {name}.tangent; it must point across the rod.")
    normal /= np.linalg.norm(normal)
    return np.column_stack([normal, np.cross(d3, normal), d3])
