"""Supports and loads as marks that a mechanician knows: blocks, cones, rollers, coils; straight and turning arrows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux.loads import Distributed, EndLoad, Foundation, Gravity, LineCouple, LineForce, Rotation
from darboux.natural import smallest_rotation
from darboux.problem import Equilibrium
from darboux.supports import Support
from darboux.view import prefix
from darboux.view.palette import GREEN, ORANGE, VERMILION
from darboux.view.space.shape import Shape
from darboux.view.space.solids import E3, Solid, arrow, ball, box, coil, turned, turning_arrow, wire

Array = NDArray[np.float64]

SUPPORT, GROUND, JOINT = "#9aa3ad", "#c9ced4", "#4d545c"
SPREAD = 13  # arrows of a load along the rod
LEAST = 0.35  # of the longest arrow: a smaller force is drawn so long
FACING = 0.6  # of a moment's axis towards the viewer: from here on its arrow turns, else it has two heads


@dataclass(frozen=True)
class Label:
    """Words at a point in space (3,), on the side of it to which ``way`` (3,) points."""

    point: Array
    words: str
    way: Array


@dataclass(frozen=True)
class Marks:
    """Draws marks of the length ``size`` in m beside a rod ``thickness`` m thick, seen from ``towards`` (3,), a unit vector."""

    size: float
    thickness: float
    towards: Array

    # -- supports ------------------------------------------------------------------------------------------------

    def support(self, support: Support, r: Array, R: Array, outward: Array | None) -> list[Solid]:
        """Return the mark of a support where the section stands at r (3,), R (3, 3).

        ``outward`` (3,) points out of the rod at its end; None between the ends.
        """
        parts: list[Solid] = []
        slides = [support.displacement_axes[:, i] for i in range(3) if not support.held_displacement[i]]
        if support.sliding == "section":
            slides = [R @ axis for axis in slides]
        if all(support.held_rotation):
            parts += self._block(r, R, outward)
            parts += self._rail(r, slides[0], outward) if len(slides) == 1 else []
            parts += self._free_ways(r, outward) if len(slides) == 3 else []
        elif any(support.held_displacement):
            parts += self._stand(support, r, R, outward, slides)
        for stiffness, turns in ((support.linear, False), (support.rotational, True)):
            if stiffness is not None:
                parts += self._spring(np.array(stiffness), r, R, outward, turns)
        return parts

    def _block(self, r: Array, R: Array, outward: Array | None) -> list[Solid]:
        """A block in which the rod ends; between the ends one through which it passes."""
        side = max(1.6 * self.thickness, 0.75 * self.size)
        depth = 0.55 * self.size
        centre = r if outward is None else r + 0.5 * depth * outward
        return [box(centre, R, (side, side, depth), SUPPORT)]

    def _rail(self, r: Array, along: Array, outward: Array | None) -> list[Solid]:
        centre = r if outward is None else r + 0.3 * self.size * outward
        rods = []
        normal = np.cross(along, E3) if abs(along[2]) < 0.9 else np.cross(along, self.towards)
        normal /= np.linalg.norm(normal)
        for side in (-1.0, 1.0):
            middle = centre + side * max(0.9 * self.thickness, 0.45 * self.size) * normal
            rods.append(
                turned(
                    middle - 1.3 * self.size * along, middle + 1.3 * self.size * along, [0.07 * self.size] * 2, JOINT
                )
            )
        return rods

    def _free_ways(self, r: Array, outward: Array | None) -> list[Solid]:
        """Thin arrows along all axes: held in orientation, free to move."""
        centre = r if outward is None else r + 0.3 * self.size * outward
        return [
            part
            for axis in np.vstack([np.eye(3), -np.eye(3)])
            for part in arrow(centre, 1.1 * self.size * axis, 0.03 * self.size, JOINT)
        ]

    def below(self, r: Array, R: Array, outward: Array | None, slides: list[Array]) -> Array:
        """Return the direction from the rod to the ground: across what slides, downwards where it can be."""
        tangent = R[:, 2] if outward is None else -outward
        for wanted in (-E3, -self._right, outward if outward is not None else self._right, E3):
            way = np.array(wanted)
            for axis in slides[:1]:
                way = way - (way @ axis) * axis
            into = abs(way @ tangent) if outward is None else way @ tangent
            if np.linalg.norm(way) > 0.5 and into < 0.8 * np.linalg.norm(way):
                return np.asarray(way / np.linalg.norm(way))
        return np.asarray(smallest_rotation(E3, slides[0])[:, 0] if slides else -tangent)

    @property
    def _right(self) -> Array:
        right = np.cross(E3, self.towards)
        length = float(np.linalg.norm(right))
        return right / length if length > 1e-9 else np.eye(3)[0]

    def _stand(self, support: Support, r: Array, R: Array, outward: Array | None, slides: list[Array]) -> list[Solid]:
        """A ball, or an axle, on a cone; on rollers where it slides."""
        below = self.below(r, R, outward, slides)
        height, radius = 0.75 * self.size, 0.42 * self.size
        base = r + height * below
        axles = [support.rotation_axes[:, i] for i in range(3) if not support.held_rotation[i]]
        parts = [turned(base, r, [radius, 0.06 * self.size], SUPPORT)]
        if any(support.held_rotation):
            reach = max(0.9 * self.thickness, 0.35 * self.size)
            parts += [turned(r - reach * a, r + reach * a, [0.13 * self.size] * 2, JOINT) for a in axles]
        else:
            parts.append(ball(r, max(0.62 * self.thickness, 0.17 * self.size), JOINT))
        across = slides[0] if slides else np.cross(below, R[:, 0] if abs(below @ R[:, 0]) < 0.9 else R[:, 1])
        across = across / np.linalg.norm(across)
        frame = np.stack([across, np.cross(below, across), below], axis=1)
        wheel = 0.13 * self.size
        if slides:
            for side in (-0.55, 0.55):
                centre = base + wheel * below + side * radius * across
                parts.append(
                    turned(centre - radius * frame[:, 1], centre + radius * frame[:, 1], [wheel, wheel], JOINT)
                )
            base = base + 2.0 * wheel * below
        length = 3.2 if slides else 2.6
        parts.append(
            box(base + 0.05 * self.size * below, frame, (length * radius, 2.6 * radius, 0.1 * self.size), GROUND)
        )
        return parts

    def _spring(self, stiffness: Array, r: Array, R: Array, outward: Array | None, turns: bool) -> list[Solid]:
        """A coil to the ground along the stiffest direction; a flat spiral about it where it resists turning."""
        value, vectors = np.linalg.eigh(stiffness)
        same = value[0] > 0.99 * value[-1]
        axis = self.below(r, R, outward, []) if same else vectors[:, -1]
        if turns:
            axis = self.towards if same else axis
            frame = smallest_rotation(E3, axis)
            angle = np.linspace(0.0, 6.0 * np.pi, 145)
            reach = np.linspace(0.1, 0.6, len(angle)) * self.size
            spiral = r + reach[:, None] * (np.cos(angle)[:, None] * frame[:, 0] + np.sin(angle)[:, None] * frame[:, 1])
            return [wire(spiral, 0.045 * self.size, JOINT)]
        tangent = R[:, 2] if outward is None else -outward
        axis = -axis if axis @ tangent > 0.3 or (abs(axis @ tangent) <= 0.3 and axis[2] > 0.0) else axis
        ground = r + 1.5 * self.size * axis
        frame = smallest_rotation(E3, axis)
        return [
            coil(r, ground, 0.24 * self.size, 0.05 * self.size, JOINT),
            box(ground + 0.05 * self.size * axis, frame, (1.1 * self.size, 1.1 * self.size, 0.1 * self.size), GROUND),
        ]

    # -- loads ---------------------------------------------------------------------------------------------------

    def force(
        self, r: Array, vector: Array, longest: float, outward: Array | None, words: str
    ) -> tuple[list[Solid], Label]:
        """Return an arrow that pulls at r, or pushes on it, and its label."""
        size = float(np.linalg.norm(vector))
        way = vector / size
        length = 2.0 * self.size * max(LEAST, size / longest)
        pushes = outward is None or way @ outward < -0.3
        gap = 0.6 * self.thickness
        start = r - (length + gap) * way if pushes else r + gap * way
        at = start if pushes else start + length * way
        return arrow(start, length * way, 0.055 * self.size, VERMILION), Label(at, words, -way if pushes else way)

    def moment(self, r: Array, vector: Array, words: str) -> tuple[list[Solid], Label]:
        """Return a moment at r: an arrow that turns about its axis, or one with two heads where that is seen from the side."""
        axis = vector / np.linalg.norm(vector)
        if abs(axis @ self.towards) >= FACING:
            reach = max(1.1 * self.size, self.thickness)
            up = np.cross(self.towards, self._right)
            return turning_arrow(r, axis, reach, 0.05 * self.size, GREEN), Label(r + 1.15 * reach * up, words, up)
        length = 2.0 * self.size
        start = r + 0.6 * self.thickness * axis
        return arrow(start, length * axis, 0.055 * self.size, GREEN, heads=2), Label(start + length * axis, words, axis)

    def spread(self, r: Array, vectors: Array, couple: bool = False) -> list[Solid]:
        """Return arrows along the rod whose heads touch it (n, 3); couples have two heads and begin at it."""
        sizes = np.linalg.norm(vectors, axis=1)
        longest = float(np.max(sizes))
        parts: list[Solid] = []
        for point, vector, size in zip(r, vectors, sizes, strict=True):
            if size < 0.04 * longest:
                continue
            reach = 1.2 * self.size * vector / longest
            start = (
                point + 0.6 * self.thickness * vector / size
                if couple
                else point - reach - 0.6 * self.thickness * vector / size
            )
            parts += arrow(start, reach, 0.035 * self.size, GREEN if couple else ORANGE, heads=2 if couple else 1)
        return parts


def supports(marks: Marks, problem: Equilibrium, shape: Shape, held: Any = None) -> list[Solid]:
    """Return the marks of all supports; ``held`` says of "start" and "end" whether they hold at this time."""
    parts: list[Solid] = []
    if problem.closed and (held is None or held("start")):
        parts += marks.support(problem.start, shape.r[0], shape.R[0], None)
    ends = () if problem.closed else (("start", 0, -1.0), ("end", -1, 1.0))
    for at, i, sign in ends:
        support = getattr(problem, at)
        if support.holds and (held is None or held(at)):
            parts += marks.support(support, shape.r[i], shape.R[i], sign * shape.R[i][:, 2])
    for s, support in problem.between:
        i = int(np.argmin(np.abs(shape.s - s)))
        parts += marks.support(support, shape.r[i], shape.R[i], None)
    return parts


def loads(marks: Marks, problem: Equilibrium, shape: Shape, factor: float = 1.0) -> tuple[list[Solid], list[Label]]:
    """Return the marks of all loads but gravity, and the labels of forces and moments; ``factor`` multiplies them."""
    parts, labels = _along(marks, problem, shape)
    forces, moments = [], []
    for (place, offset), load in _concentrated(problem).items():
        i = int(np.argmin(np.abs(shape.s - {"start": shape.s[0], "end": shape.s[-1]}.get(place, place))))
        r, R = shape.r[i], shape.R[i]
        outward = {"start": -R[:, 2], "end": R[:, 2]}.get(place)
        point = r + R @ offset
        if any(offset):
            parts.append(turned(r, point, [0.05 * marks.size] * 2, JOINT))
        for follows, force, moment in (
            (False, load.force, load.moment),
            (True, R @ load.section_force, R @ load.section_moment),
        ):
            note = ", follower" if follows else ""
            if np.any(force):
                forces.append((point, factor * force, outward, note))
            if np.any(moment) and not any(offset):
                moments.append((r, factor * moment, note))
    longest = max((float(np.linalg.norm(force)) for _, force, *_ in forces), default=0.0)
    for r, force, outward, note in forces:
        if np.any(force):
            solids, label = marks.force(r, force, longest, outward, _amount(force, "N") + note)
            parts += solids
            labels.append(label)
    for r, moment, note in moments:
        if np.any(moment):
            solids, label = marks.moment(r, moment, _amount(moment, "N m") + note)
            parts += solids
            labels.append(label)
    return parts, labels


def _concentrated(problem: Equilibrium) -> dict[tuple[Any, Any], EndLoad]:
    """Return the sum of the loads at each end ("start", "end") or s, and each offset from the section's centre there."""
    result: dict[tuple[Any, Any], EndLoad] = {}
    load: Any
    for load in problem.loads:
        if load.place is not None or load.station is not None:
            load.add_point(result.setdefault((load.at, load.offset), EndLoad()))
    return result


def _amount(vector: Array, unit: str) -> str:
    size = float(np.linalg.norm(vector))
    words, si = prefix.quantity(size, unit)
    return f"{size / si:.3g} {words}"


def _along(marks: Marks, problem: Equilibrium, shape: Shape) -> tuple[list[Solid], list[Label]]:
    """Return the marks of the loads along the rod: arrows, coils of a foundation, the axis of a rotation."""
    chosen = np.unique(np.searchsorted(shape.s, np.linspace(0.0, shape.s[-1], SPREAD)))
    s, r, R = shape.s[chosen], shape.r[chosen], shape.R[chosen]
    parts: list[Solid] = []
    labels: list[Label] = []
    for load in problem.loads:
        if isinstance(load, Gravity):
            continue
        total = Distributed.zero(len(s))
        load.add_distributed(total, s, problem.rod)
        force, couple = total.force(r, R), total.couple(R)
        if isinstance(load, LineForce) and load.of_shape:
            force = load.at_shape(s, r, R)
        if isinstance(load, LineCouple) and load.of_shape:
            couple = load.at_shape(s, r, R)
        if isinstance(load, Foundation):
            below = marks.below(r[0], R[0], None, [np.array(load.direction)])
            parts += [
                coil(point, point + 1.1 * marks.size * below, 0.12 * marks.size, 0.03 * marks.size, JOINT, turns=4)
                for point in r
            ]
            continue
        if isinstance(load, Rotation):
            solids, label = _axis(marks, load, shape)
            parts += solids
            labels.append(label)
            continue
        if np.any(force):
            parts += marks.spread(r, force)
        if np.any(couple):
            parts += marks.spread(r, couple, couple=True)
    return parts, labels


def _axis(marks: Marks, load: Rotation, shape: Shape) -> tuple[list[Solid], Label]:
    """Return the axis about which the frame turns, with the arrow of the turn."""
    omega = np.array(load.omega)
    rate = float(np.linalg.norm(omega))
    if rate == 0.0:
        return [], Label(np.array(load.point), "", E3)
    axis, point = omega / rate, np.array(load.point)
    along = (shape.r - point) @ axis
    low, high = min(0.0, float(np.min(along))) - marks.size, max(0.0, float(np.max(along))) + 2.0 * marks.size
    dashes = np.linspace(low, high, 24)
    radius = 0.025 * marks.size
    line = [
        turned(point + a * axis, point + b * axis, [radius, radius], JOINT)
        for a, b in zip(dashes[::2], dashes[1::2], strict=True)
    ]
    turn = turning_arrow(point + (high - 0.6 * marks.size) * axis, axis, 0.5 * marks.size, 0.04 * marks.size, JOINT)
    return [*line, *turn], Label(point + high * axis, f"{rate:.3g} rad/s", axis)


def directors(marks: Marks, shape: Shape, colours: tuple[str, str, str], count: int = 9) -> list[Solid]:
    """Return d1, d2, d3 as arrows at places along the rod."""
    chosen = np.unique(np.searchsorted(shape.s, np.linspace(0.0, shape.s[-1], count)))
    reach = 1.3 * marks.size + 0.5 * marks.thickness
    return [
        part
        for j in chosen
        for i in range(3)
        for part in arrow(shape.r[j], reach * shape.R[j][:, i], 0.045 * marks.size, colours[i])
    ]
