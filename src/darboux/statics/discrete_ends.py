r"""What holds a chain of edges: at its ends, where a ghost edge carries the section's frame, and at vertices between them.

The unknowns of an end are those of its vertex and of the ghost edge beyond, whose other vertex lies at x + o l t with
o = 1 at the end and -1 at the start. In their place a support speaks of a displacement dx, a small rotation phi (in the
exponential chart, R -> exp([phi]_x) R) and the ghost's length, which is held:

    d(ghost vertex) = dx + o l (phi x t + phi x (phi x t) / 2)        d(theta) = phi.t

Along and about the support's axes each of these is an unknown of the band or is held. Springs add their energy; a groove
that turns with the section adds a penalty and a multiplier for what it holds, (R a).(x - p) = 0; eccentric forces add their
potential -R : A; moments and followers, which have no energy, add their residual and its unsymmetric tangent.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.kernels.band import FULL, LOWER, REACH
from darboux.packing.ends import EndConditions

Array = NDArray[np.float64]

PHI, DX = slice(0, 3), slice(3, 6)  # a support's own six: rotation and displacement
STEP = 1e-6  # rad, for the second derivative of a rotational spring's energy


class Block:
    """A run of unknowns in the band, and the rows and columns that couple with it."""

    def __init__(self, unknowns: int, first: int, size: int) -> None:
        low, high = max(0, first - REACH), min(unknowns, first + size + REACH)
        i, j = np.meshgrid(np.arange(low, high), np.arange(low, high), indexing="ij")
        self.part = slice(first, first + size)
        self.local = slice(first - low, first - low + size)
        self.size = high - low
        self.inside = np.abs(i - j) <= REACH
        self.lower = (LOWER * np.minimum(i, j) + np.abs(i - j))[self.inside]
        self.general = (FULL * j + REACH + i - j)[self.inside]

    def transform(self, band: Array, gradient: Array, T: Array, added: Array, symmetric: bool) -> None:
        """H -> T^T H T + added and g -> T^T g, in a lower band or a general one; T keeps within the band."""
        flat = self.lower if symmetric else self.general
        H = np.zeros((self.size, self.size))
        H[self.inside] = band[flat]
        H[:, self.local] = H[:, self.local] @ T
        H[self.local] = T.T @ H[self.local]
        H[self.local, self.local] += added
        band[flat] = H[self.inside]
        gradient[self.part] = T.T @ gradient[self.part]


class Terms(NamedTuple):
    """What a support and its loads add at an end: energy, gradient (6,) and its derivative (6, 6), by (phi, dx)."""

    energy: float
    gradient: Array
    tangent: Array


class End:
    """One end of a chain: its support, its loads, and the seven unknowns of its vertex and its ghost edge."""

    def __init__(self, conditions: EndConditions, ghost: float, unknowns: int, overhang: float = 0.0) -> None:
        self.conditions, self.outward = conditions, conditions.outward
        self.ghost = ghost  # length of the ghost edge
        self.overhang = overhang  # by which the vertex lies beyond the support, along the held tangent
        load, at_start = conditions.load, self.outward < 0.0
        self.moment, self.eccentric = load.moment, load.eccentric
        self.section_force, self.section_moment = load.section_force, load.section_moment
        self.block = Block(unknowns, 0 if at_start else unknowns - 7, 7)
        # Where the ghost vertex, its angle (or its length) and the vertex stand among the seven. phi takes the ghost's place.
        self.far, self.angle, self.near = (slice(0, 3), 3, slice(4, 7)) if at_start else (slice(4, 7), 3, slice(0, 3))
        self.groove = conditions.groove and any(conditions.held_places)
        self.universal = not any(conditions.held_turns[:2]) and bool(conditions.held_turns[2])
        self.places = any(conditions.held_places) or conditions.sprung[0]
        self.rigid = bool(np.all(self.fixed))
        self.stores = any(conditions.sprung) or self.groove or bool(np.any(self.eccentric))  # energy
        acting = np.any(self.moment) or np.any(self.section_force) or np.any(self.section_moment)
        self.bare = not (self.stores or acting or self.universal)  # it adds nothing
        self.at(0.0)

    @property
    def fixed(self) -> NDArray[np.bool_]:
        """Which of the seven unknowns are held: (7,)."""
        fixed = np.zeros(7, dtype=bool)
        fixed[self.angle] = True
        fixed[self.far] = self.conditions.held_turns
        fixed[self.near] = False if self.groove else self.conditions.held_places
        return fixed

    def at(self, load_factor: float) -> None:
        """Take the pose that the support prescribes at a load factor."""
        self.load_factor = load_factor
        self.position, q = self.conditions.pose(load_factor)
        self.R = frames.matrix_of_quaternion(q)
        self.position = self.position + self.outward * self.overhang * self.R[:, 2]

    def axes(self, R: Array) -> tuple[Array, Array]:
        """Return the axes of rotations and of displacements as columns (3, 3), where the section's frame is R."""
        A = self.conditions.turn_axes
        if self.universal:
            b = R @ self.R.T @ A[:, 1]
            A = np.column_stack([A[:, 0], b, frames.cross(A[:, 0], b)])
        return A, self.conditions.place_axes

    def transformation(self, R: Array) -> Array:
        """Return T (7, 7): the packed unknowns by the support's own."""
        T = np.zeros((7, 7))
        C, A = self.axes(R)
        t = R[:, 2]
        T[self.far, self.far] = -self.outward * self.ghost * cross_matrix(t) @ C
        T[self.angle, self.far] = t @ C
        T[self.far, self.angle] = self.outward * t
        T[self.far, self.near] = T[self.near, self.near] = A
        return T

    def packed_pose(self, move: Array, turn: Array, R: Array) -> Array:
        """Return the support's own unknowns (7,) of a displacement and a rotation."""
        C, A = self.axes(R)
        own = np.zeros(7)
        own[self.far], own[self.near] = C.T @ turn, A.T @ move
        return own

    def turn(self, step: Array, R: Array) -> Array:
        """Return the rotation vector of a packed step (7,)."""
        t = R[:, 2]
        de = (step[self.far] - step[self.near]) * (self.outward / self.ghost)
        return np.asarray(frames.cross(t, de) + step[self.angle] * t)

    def held_frame(self, R: Array) -> Array:
        """Return the frame next to R that the support allows."""
        held = self.conditions.held_turns
        if all(held):
            return self.R
        if not any(held):
            return R
        a = self.conditions.turn_axes[:, 0]
        if self.universal:  # the least turn that brings b across a
            b = R @ self.R.T @ self.conditions.turn_axes[:, 1]
            across = frames.cross(b, a)
            sine = float(np.linalg.norm(across))
            return frames.rotation(-np.arctan2(float(a @ b), sine) / sine * across) @ R
        q = frames.quaternion_of_matrix(R @ self.R.T)  # a hinge: the part of the turn that is about its axis
        return frames.rotation(2.0 * np.arctan2(q[1:] @ a, q[0]) * a) @ self.R

    def held_place(self, x: Array) -> Array:
        """Return the place next to x that the support allows."""
        if self.groove:
            return x
        A = self.conditions.held_axes
        return np.asarray(x + A.T @ (A @ (self.position - x)))

    def out_of_groove(self, x: Array, R: Array) -> tuple[Array, Array, Array]:
        """Return what the groove holds at zero (k,), its derivatives (k, 6), and the axes across it, R a, as rows (k, 3)."""
        across = self.conditions.held_axes @ R.T
        u = x - self.position
        return across @ u, np.hstack([np.cross(across, u), across]), across

    def energy(self, x: Array, R: Array, reaction: Array, penalty: float) -> float:
        """Return the energy of springs and eccentric forces, and of the groove with the multipliers ``reaction``."""
        energy, u = -self.load_factor * float(np.sum(R * self.eccentric)), x - self.position
        if self.conditions.sprung[0]:
            energy += 0.5 * float(u @ self.conditions.stiffness[:3, :3] @ u)
        if self.conditions.sprung[1]:
            theta = frames.rotation_vector(R @ self.R.T)
            energy += 0.5 * float(theta @ self.conditions.stiffness[3:, 3:] @ theta)
        if self.groove:
            c = self.out_of_groove(x, R)[0]
            energy += float((0.5 * penalty * c + reaction) @ c)
        return energy

    def terms(self, x: Array, R: Array, reaction: Array, penalty: float) -> Terms:
        """Return what springs, groove, eccentric forces, moments and followers add."""
        g, H, u = np.zeros(6), np.zeros((6, 6)), x - self.position
        K, k = self.conditions.stiffness[:3, :3], self.conditions.stiffness[3:, 3:]
        if self.conditions.sprung[0]:
            g[DX] += K @ u
            H[DX, DX] += K
        if self.conditions.sprung[1]:
            g[PHI] += _spring_moment(k, R @ self.R.T)
            H[PHI, PHI] += _spring_tangent(k, R @ self.R.T)
        if self.groove:
            c, by_unknowns, across = self.out_of_groove(x, R)
            g += (reaction + penalty * c) @ by_unknowns
            H += penalty * by_unknowns.T @ by_unknowns
            F = reaction @ across  # what is expected of the groove, not the penalty of a guess that lies beside it
            H[DX, PHI] -= cross_matrix(F)
            H[PHI, DX] += cross_matrix(F)
            H[PHI, PHI] += turned_twice(F, u)
        for d, A in zip(R.T, self.load_factor * self.eccentric.T, strict=True):
            g[PHI] -= frames.cross(d, A)
            H[PHI, PHI] -= turned_twice(A, d)
        moment, force = self.load_factor * self.moment, self.load_factor * (R @ self.section_force)
        turning = self.load_factor * (R @ self.section_moment)
        g[PHI] -= moment + turning
        g[DX] -= force
        H[PHI, PHI] += 0.5 * cross_matrix(turning - moment)
        H[DX, PHI] += cross_matrix(force)
        return Terms(self.energy(x, R, reaction, penalty), g, H)

    def hold(
        self, band: Array, gradient: Array, x: Array, R: Array, reaction: Array, penalty: float, symmetric: bool
    ) -> None:
        """Bring the band and the gradient to the support's own unknowns, and add what support and loads add."""
        T, t = self.transformation(R), R[:, 2]
        by_turn = turned_twice(gradient[self.block.part][self.far], self.outward * self.ghost * t)  # the chart's own
        if self.bare:
            C, own = self.axes(R)[0], np.zeros((7, 7))
            own[self.far, self.far] = C.T @ by_turn @ C
            self.block.transform(band, gradient, T, own, symmetric)
            return
        terms = self.terms(x, R, reaction, penalty)
        H, g = terms.tangent, terms.gradient
        H[PHI, PHI] += by_turn
        C, A = self.axes(R)
        if self.universal:  # a.b = 0 is curved: its reaction, a moment about b x a, turns with the section
            held = (T.T @ gradient[self.block.part])[self.far][2] + C[:, 2] @ g[PHI]
            H[PHI, PHI] += held * turned_twice(C[:, 0], C[:, 1])
        own, own_g = np.zeros((7, 7)), np.zeros(7)
        for rows, P, here in ((self.far, C, PHI), (self.near, A, DX)):
            own_g[rows] = P.T @ g[here]
            for columns, Q, there in ((self.far, C, PHI), (self.near, A, DX)):
                own[rows, columns] = P.T @ H[here, there] @ Q
        self.block.transform(band, gradient, T, own, symmetric)
        gradient[self.block.part] += own_g


def cross_matrix(a: Array) -> Array:
    """Return [a]_x (3, 3): [a]_x b = a x b."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def turned_twice(F: Array, t: Array) -> Array:
    """Return the second derivative (3, 3) of F.(exp([phi]_x) t) by phi: (F t^T + t F^T) / 2 - (F.t) I."""
    outer = np.outer(F, t)
    return np.asarray(0.5 * (outer + outer.T) - np.trace(outer) * np.eye(3))


def _spring_moment(K: Array, R: Array) -> Array:
    """Return the gradient of 1/2 theta . K theta by a small rotation, theta the rotation vector of R.

    J^-T K theta,   J^-1 = 1 - 1/2 [theta]_x + (1 - t / 2 cot(t / 2)) / t^2 [theta]_x^2,   t = |theta|
    """
    theta = frames.rotation_vector(R)
    t, m = float(np.linalg.norm(theta)), K @ theta
    factor = 1.0 / 12.0 if t < 1e-3 else (1.0 - 0.5 * t / np.tan(0.5 * t)) / t**2
    first = frames.cross(theta, m)
    return np.asarray(m + 0.5 * first + factor * frames.cross(theta, first))


def _spring_tangent(K: Array, R: Array) -> Array:
    """Return the second derivative (3, 3) in the exponential chart, by differences: the symmetric part of the moment's."""
    slopes = [
        (_spring_moment(K, frames.rotation(STEP * e) @ R) - _spring_moment(K, frames.rotation(-STEP * e) @ R))
        / (2.0 * STEP)
        for e in np.eye(3)
    ]
    return np.asarray(0.5 * (np.array(slopes) + np.array(slopes).T))
