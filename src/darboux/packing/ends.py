"""What the supports ask of the rod: six conditions at an end, and at a station between the ends.

The kernel `support` holds the equations; here are its numbers. A station is a place where a support holds the rod, or a
point load acts, between the ends: what is behind it has the same place and frame, and inner forces that differ by what
acts there. With n and m replaced by n- - n+ and m- - m+ its conditions are those of an end.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.kernels import support as kernel
from darboux.kernels.rod_equations import FORCE, ROTATION
from darboux.kernels.support import CONDITIONS, ROW
from darboux.loads import EndLoad
from darboux.packing.loads import at_place
from darboux.packing.scale import Scale
from darboux.supports import Support

Array = NDArray[np.float64]

ROUNDING = 1e-12  # of the length
TURN = slice(3, 6)  # the small rotation among the unknowns


class Held(NamedTuple):
    """What holds a node: its free motions as the first ``free`` columns of (6, 6), and the stiffness (6, 6) of its springs."""

    motions: Array
    free: int
    stiffness: Array


class EndConditions:
    """The six conditions of a support and its loads, dimensionless; prescribed poses and loads grow with the load factor.

    ``outward`` is 1 at the end and at a station, -1 at the start. ``held_places`` (3,) says which displacements are prescribed,
    along ``place_axes``, ``held_turns`` (3,) which rotations, about ``turn_axes``; ``groove`` whether the former turn with the
    section; ``place`` (3,) and ``frame`` (3, 3) the pose at full load, before the ``twist``; ``load`` what acts there.
    """

    def __init__(self, support: Support, load: EndLoad, outward: float, scale: Scale) -> None:
        self.support, self.load, self.outward = support, at_place(load, scale), outward
        self.held_places, self.held_turns = np.array(support.held_displacement), np.array(support.held_rotation)
        self.place_axes, self.turn_axes = support.displacement_axes, support.rotation_axes  # (3, 3), as columns
        self.place, self.frame = (np.array(support.position) - scale.origin) / scale.length, support.R
        self.holds = support.holds  # true where a displacement or a rotation is prescribed, or tied by a spring
        self.groove, self.twist = support.sliding == "section", support.twist
        q = frames.quaternion_of_matrix(self.frame)
        self.way = np.concatenate(
            [self.place, q, self.place, q, [support.twist]]
        )  # of the pose, from load factor 0 to 1
        zero = np.zeros((3, 3))
        linear = zero if support.linear is None else np.array(support.linear) * scale.length / scale.force
        rotational = zero if support.rotational is None else np.array(support.rotational) / scale.moment
        self.stiffness = np.zeros((6, 6))  # of the springs, for (dr, theta), small rotations
        self.stiffness[:3, :3], self.stiffness[3:, 3:] = linear, rotational
        self.sprung = support.linear is not None, support.rotational is not None  # places, turns
        flags = [outward, *self.held_places, *self.held_turns, self.groove, self.sprung[1]]
        axes = [self.place_axes.T.ravel(), self.turn_axes.T.ravel()]
        own = self.load
        loads = [own.force, own.moment, own.section_force, own.section_moment, own.eccentric.T.ravel()]
        parts = [np.array(flags, dtype=float), *axes, linear.ravel(), rotational.ravel(), *loads]
        self._numbers = np.concatenate([*parts, np.zeros(kernel.NUMBERS - kernel.PLACE)])
        self._posed = np.nan  # the load factor of the pose among the numbers

    def grow_from(self, y: Array, all_at_once: bool = False) -> None:
        """Let what is prescribed grow from the state y (13,); ``all_at_once``: the twist too is of the way from there."""
        self.way[: kernel.TO_PLACE] = y[:FORCE]
        if all_at_once:
            self.way[kernel.TO_FRAME : kernel.TWIST] = _twisted(
                self.way[kernel.TO_FRAME : kernel.TWIST], self.way[kernel.TWIST]
            )
            self.way[kernel.TWIST] = 0.0
        self._posed = np.nan

    def turn_by(self, angle: float) -> None:
        """Let what is prescribed arrive after so many more rad about its own d3; they are of the way from where it grows."""
        turned = _twisted(self.way[kernel.TO_FRAME : kernel.TWIST], self.way[kernel.TWIST] - angle)
        self.way[kernel.TO_FRAME : kernel.TWIST], self.way[kernel.TWIST] = turned, angle
        self._posed = np.nan

    def move_as(self, other: EndConditions) -> None:
        """Let what is prescribed go the way of another's."""
        self.way[:] = other.way
        self._posed = np.nan

    def numbers(self, load_factor: float) -> Array:
        """Return the numbers for the kernel."""
        if self._posed != load_factor:
            kernel.pose(self.way, float(load_factor), self._numbers)
            self._posed = load_factor
        return self._numbers

    def pose(self, load_factor: float) -> tuple[Array, Array]:
        """Return the position (3,) and the quaternion (4,) that the support prescribes."""
        pose = self.numbers(load_factor)[kernel.PLACE : kernel.PLACE_RATE].copy()
        return pose[:3], pose[3:]

    @property
    def held_axes(self) -> Array:
        """The axes (k, 3) along which displacements are prescribed, as rows."""
        return np.asarray(self.place_axes.T[self.held_places])

    @property
    def loaded(self) -> bool:
        """True where a load acts."""
        return any(np.any(part) for part in vars(self.load).values())

    @property
    def clamps(self) -> bool:
        """True where all displacements and rotations are prescribed."""
        return bool(np.all(self.held_places) and np.all(self.held_turns))

    @property
    def moves(self) -> bool:
        """True where the prescribed place moves with the load factor."""
        change = self.way[kernel.TO_PLACE : kernel.TO_FRAME] - self.way[: kernel.FROM_FRAME]
        return bool(np.any(np.abs(self.held_axes @ change) > ROUNDING))

    @property
    def grows(self) -> bool:
        """True where the prescribed pose moves with the load factor."""
        return bool(np.any(self.way[: kernel.TO_PLACE] != self.way[kernel.TO_PLACE : kernel.TWIST]))

    def system(self, y: Array, load_factor: float) -> Array:
        """Return the conditions at the state y (13,): rows (6, 12), minus the values, minus their slope by the load factor."""
        out = np.empty((CONDITIONS, ROW))
        kernel.conditions(self.numbers(load_factor), y, load_factor, out.ravel())
        return out

    def values(self, y: Array, load_factor: float) -> Array:
        """Return what must be zero (6,) at the state y (13,)."""
        out = np.empty(CONDITIONS)
        kernel.values(self.numbers(load_factor), y, load_factor, out)
        return out

    def held(self, y: Array, load_factor: float) -> Held:
        """Return the motions that are free where the state is y (13,), and the stiffness of springs and eccentric forces."""
        motions, stiffness = np.empty((6, 6)), np.empty((6, 6))
        count = kernel.motions(self.numbers(load_factor), y, motions.ravel())
        kernel.stiffness(self.numbers(load_factor), y, load_factor, stiffness.ravel())
        return Held(motions, count, stiffness)


def moved(y: Array, delta: Array) -> Array:
    """Return the state y (13,) moved by the unknowns delta (12,)."""
    q = frames.product(y[ROTATION:FORCE], np.concatenate([[1.0], 0.5 * delta[TURN]]))
    return np.concatenate([y[:3] + delta[:3], q / np.linalg.norm(q), y[FORCE:] + delta[6:]])


def _twisted(q: Array, angle: float) -> Array:
    """Return the quaternion q turned about its own d3."""
    if angle == 0.0:
        return q
    return frames.product(q, np.array([np.cos(0.5 * angle), 0.0, 0.0, np.sin(0.5 * angle)]))
