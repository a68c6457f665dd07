"""What the supports ask of the state at an end: six conditions, and their derivatives.

Unknowns of an end: dr, the small rotation phi in the section's frame (dq = 1/2 q (0, phi)), dn, dm. Each condition is
one half of a conjugate pair: a displacement along an axis is prescribed or the force along it is known; a rotation
about an axis is prescribed or the moment about it is known. With o = 1 at the end and -1 at the start, dead loads F, M,
follower loads p, d and springs,

    n - o [F + R p - K (r - position)] = 0 along the free axes                                       (1)
    m - o [M + R d - the spring's moment] = 0 about the free axes                                    (2)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.kernels.rod_equations import FORCE, MOMENT, ROTATION
from darboux.problem import Equilibrium
from darboux.statics.coefficients import Scale
from darboux.supports import Support

Array = NDArray[np.float64]
Pose = tuple[Array, Array]  # position (3,), quaternion (4,)

UNKNOWNS = 12
POSITION, TURN, N, M = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)  # the parts of the unknowns
DIFFERENCE = 1e-7  # of the load factor and of the unknowns, where a derivative is taken by differences


class EndConditions:
    """The six conditions at one end, dimensionless; prescribed poses and loads grow with the load factor."""

    def __init__(self, problem: Equilibrium, at: str, scale: Scale) -> None:
        support: Support = getattr(problem, at)
        load = problem.end_load(at)
        self.support = support
        self.outward = 1.0 if at == "end" else -1.0
        self.force, self.moment = load.force / scale.force, load.moment / scale.moment
        self.section_force, self.section_moment = load.section_force / scale.force, load.section_moment / scale.moment
        self.position = (np.array(support.position) - scale.origin) / scale.length
        self.q = frames.quaternion_of_matrix(support.R)
        self.displacement_axes = support.displacement_axes
        self.rotation_axes = support.rotation_axes
        self.linear = None if support.linear is None else np.array(support.linear) * scale.length / scale.force
        self.rotational = None if support.rotational is None else np.array(support.rotational) / scale.moment
        self.first: Pose | None = None  # the pose at load factor 0, where it grows
        self._by_differences = self.rotational is not None or support.sliding == "section"

    # -- the prescribed pose -------------------------------------------------------------------------------------

    def grow_from(self, y: Array) -> None:
        """Let what is prescribed grow from the state y (13,) of the unloaded rod."""
        self.first = y[:3].copy(), y[ROTATION:FORCE].copy()

    def pose(self, load_factor: float) -> Pose:
        """Return the position and the quaternion that the support prescribes."""
        if self.first is None:
            return self.position, _twisted(self.q, load_factor * self.support.twist)
        position, q = self.first
        return (
            (1.0 - load_factor) * position + load_factor * self.position,
            _twisted(frames.between(q, self.q, load_factor), load_factor * self.support.twist),
        )

    @property
    def stiffness(self) -> Array:
        """The springs' stiffness (6, 6) for the displacements (dr, theta), at small rotations."""
        result = np.zeros((6, 6))
        for part, spring in ((slice(0, 3), self.linear), (slice(3, 6), self.rotational)):
            if spring is not None:
                result[part, part] = spring
        return result

    # -- the conditions ------------------------------------------------------------------------------------------

    def system(self, y: Array, load_factor: float) -> tuple[Array, Array, Array]:
        """Return the conditions' rows (6, 12), values (6,) and derivative by the load factor (6,) at the state y (13,)."""
        values = self.values(y, load_factor)
        rows = self._rows_by_differences(y, load_factor) if self._by_differences else self._rows(y, load_factor)
        step = DIFFERENCE if load_factor <= 0.5 else -DIFFERENCE
        loads = (self.force, self.moment, self.section_force, self.section_moment)
        if self.first is None and self.support.twist == 0.0 and not any(np.any(load) for load in loads):
            return rows, values, np.zeros(6)  # nothing here grows with the load
        return rows, values, (self.values(y, load_factor + step) - values) / step

    def _forces(self, y: Array, load_factor: float) -> tuple[Array, Array, Array]:
        """Return what (1) and (2) leave over, and the frame."""
        R = frames.matrix_of_quaternion(y[ROTATION:FORCE])
        share = self.outward * load_factor
        n = y[FORCE:MOMENT] - share * (self.force + R @ self.section_force)
        m = y[MOMENT:] - share * (self.moment + R @ self.section_moment)
        return n, m, R

    def values(self, y: Array, load_factor: float) -> Array:
        """Return what must be zero (6,) at the state y (13,)."""
        position, q0 = self.pose(load_factor)
        n, m, R = self._forces(y, load_factor)
        u = y[:3] - position
        if self.linear is not None:
            n = n + self.outward * (self.linear @ u)
        if self.rotational is not None:
            m = m + self.outward * _spring_moment(self.rotational, q0, y[ROTATION:FORCE])
        held, turned = self.support.held_displacement, self.support.held_rotation
        T = self.displacement_axes
        if self.support.sliding == "section":
            T = R @ T
            reaction = sum((float(T[:, i] @ n) * T[:, i] for i in range(3) if held[i]), np.zeros(3))
            m = m - np.cross(reaction, u)  # the groove's force acts off the end, at the point that is held
        displacement = [T[:, i] @ (u if held[i] else n) for i in range(3)]
        return np.array([*displacement, *self._turn_values(turned, q0, y[ROTATION:FORCE], R, m)])

    def _turn_values(self, held: tuple[bool, bool, bool], q0: Array, q: Array, R: Array, m: Array) -> list[float]:
        A = self.rotation_axes
        if not any(held):
            return [float(A[:, i] @ m) for i in range(3)]
        R0 = frames.matrix_of_quaternion(q0)
        if held == (False, False, True):
            b = R @ R0.T @ A[:, 1]
            return [float(A[:, 0] @ m), float(b @ m), float(A[:, 0] @ b)]
        turn = R0 @ relative_turn(q0, q)[0]
        return [float(A[:, i] @ (turn if held[i] else m)) for i in range(3)]

    def _rows(self, y: Array, load_factor: float) -> Array:
        _, q0 = self.pose(load_factor)
        _n, m, R = self._forces(y, load_factor)
        share = self.outward * load_factor
        rows = np.zeros((6, UNKNOWNS))
        T, A = self.displacement_axes, self.rotation_axes
        for i in range(3):
            if self.support.held_displacement[i]:
                rows[i, POSITION] = T[:, i]
            else:
                rows[i, N] = T[:, i]
                rows[i, TURN] = T[:, i] @ (share * R @ _cross(self.section_force))
                if self.linear is not None:
                    rows[i, POSITION] = self.outward * (T[:, i] @ self.linear)
        held = self.support.held_rotation
        by_turn = share * R @ _cross(self.section_moment)
        if not any(held):
            rows[3:, M], rows[3:, TURN] = A.T, A.T @ by_turn
            return rows
        R0 = frames.matrix_of_quaternion(q0)
        if held == (False, False, True):
            material = R0.T @ A[:, 1]
            b, by_phi = R @ material, -R @ _cross(material)
            rows[3, M], rows[3, TURN] = A[:, 0], A[:, 0] @ by_turn
            rows[4, M], rows[4, TURN] = b, b @ by_turn + m @ by_phi
            rows[5, TURN] = A[:, 0] @ by_phi
            return rows
        derivative = R0 @ relative_turn(q0, y[ROTATION:FORCE])[1]
        for i in range(3):
            if held[i]:
                rows[3 + i, TURN] = A[:, i] @ derivative
            else:
                rows[3 + i, M], rows[3 + i, TURN] = A[:, i], A[:, i] @ by_turn
        return rows

    def _rows_by_differences(self, y: Array, load_factor: float) -> Array:
        """Return central differences: a groove that turns and a rotational spring are rare."""
        rows = np.empty((6, UNKNOWNS))
        for k in range(UNKNOWNS):
            e = np.zeros(UNKNOWNS)
            e[k] = DIFFERENCE * (1.0 if k < 6 else 1.0 + float(np.max(np.abs(y[FORCE:]))))
            ahead, behind = self.values(moved(y, e), load_factor), self.values(moved(y, -e), load_factor)
            rows[:, k] = (ahead - behind) / (2.0 * e[k])
        return rows


def moved(y: Array, delta: Array) -> Array:
    """Return the state y (13,) moved by the unknowns delta (12,)."""
    q = frames.product(y[ROTATION:FORCE], np.concatenate([[1.0], 0.5 * delta[TURN]]))
    return np.concatenate([y[:3] + delta[:3], q / np.linalg.norm(q), y[FORCE:] + delta[6:]])


def relative_turn(q0: Array, q: Array) -> tuple[Array, Array]:
    """Return 2 vec(q0* q), the turn from q0 to q in the frame of q0, and its derivative (3, 3) by phi of q."""
    a, b, c, d = (float(x) for x in q0)
    e, f, g, h = (float(x) for x in q)
    w, x, y, z = (
        a * e + b * f + c * g + d * h,
        a * f - b * e - c * h + d * g,
        a * g - c * e - d * f + b * h,
        a * h - d * e - b * g + c * f,
    )
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    return 2.0 * np.array([x, y, z]), np.array([[w, -z, y], [z, w, -x], [-y, x, w]])


def _cross(a: Array) -> Array:
    """Return the matrix of a x."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def _twisted(q: Array, angle: float) -> Array:
    """Return the quaternion q turned about its own d3."""
    if angle == 0.0:
        return q
    return frames.product(q, np.array([np.cos(0.5 * angle), 0.0, 0.0, np.sin(0.5 * angle)]))


def _spring_moment(stiffness: Array, q0: Array, q: Array) -> Array:
    """Return the gradient of 1/2 theta . K theta by a small rotation of the fixed frame: J^-T(theta) K theta.

    theta is the rotation vector of R R0^T, and with the angle t = |theta|

        J^-1 = 1 - 1/2 [theta x] + (1 - t / 2 cot(t / 2)) / t^2 [theta x]^2
    """
    relative = frames.product(q, q0 * np.array([1.0, -1.0, -1.0, -1.0]))
    if relative[0] < 0.0:
        relative = -relative
    sine = float(np.linalg.norm(relative[1:]))
    t = 2.0 * float(np.arctan2(sine, relative[0]))
    theta = relative[1:] * (t / sine if sine > 1e-9 else 2.0)
    factor = 1.0 / 12.0 if t < 1e-3 else (1.0 - 0.5 * t / np.tan(0.5 * t)) / t**2
    across = _cross(theta)
    inverse = np.eye(3) - 0.5 * across + factor * across @ across
    return np.asarray(inverse.T @ (stiffness @ theta))
