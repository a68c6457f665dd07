"""Rotations as unit quaternions (scalar first) and as frames R = [d1 d2 d3]."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

turn = 2.0 * np.pi  # rad, as in twist=4 * darboux.turn


def matrix_of_quaternion(q: Array) -> Array:
    """Return R(q) / |q|^2 for q (..., 4): (..., 3, 3), columns d1, d2, d3. Scale-free: |q| need not be 1."""
    w, x, y, z = (q[..., i] for i in range(4))
    t = 2.0 / (w * w + x * x + y * y + z * z)
    R = np.empty((*q.shape[:-1], 3, 3))
    R[..., 0, 0], R[..., 0, 1], R[..., 0, 2] = 1.0 - t * (y * y + z * z), t * (x * y - w * z), t * (x * z + w * y)
    R[..., 1, 0], R[..., 1, 1], R[..., 1, 2] = t * (x * y + w * z), 1.0 - t * (x * x + z * z), t * (y * z - w * x)
    R[..., 2, 0], R[..., 2, 1], R[..., 2, 2] = t * (x * z - w * y), t * (y * z + w * x), 1.0 - t * (x * x + y * y)
    return R


def quaternion_of_matrix(R: Array) -> Array:
    """Return the unit quaternion of R (..., 3, 3): (..., 4), of either sign, exact to rounding at every angle.

    The largest of w^2, x^2, y^2, z^2 is taken from the diagonal and divides the rest (S. W. Shepperd, J. Guidance and
    Control 1 (1978) 223).
    """
    if R.ndim == 2:
        return _quaternion_of_one(R.tolist())
    d0, d1, d2 = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    squares = 1.0 + np.stack([d0 + d1 + d2, d0 - d1 - d2, d1 - d0 - d2, d2 - d0 - d1], axis=-1)  # 4 w^2, 4 x^2, ...
    differences = [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]]  # 4 w x, ...
    xy, xz, yz = (R[..., i, j] + R[..., j, i] for i, j in ((0, 1), (0, 2), (1, 2)))  # 4 x y, ...
    wx, wy, wz = differences
    products = np.stack(
        [
            np.stack([squares[..., 0], wx, wy, wz], axis=-1),
            np.stack([wx, squares[..., 1], xy, xz], axis=-1),
            np.stack([wy, xy, squares[..., 2], yz], axis=-1),
            np.stack([wz, xz, yz, squares[..., 3]], axis=-1),
        ],
        axis=-2,
    )
    largest = np.argmax(squares, axis=-1)
    q = np.take_along_axis(products, largest[..., None, None], axis=-2)[..., 0, :]
    return np.asarray(q / np.linalg.norm(q, axis=-1, keepdims=True))


def _quaternion_of_one(R: list[list[float]]) -> Array:
    """Return the same of one matrix, in a tenth of the time that NumPy takes."""
    (a, b, c), (d, e, f), (g, h, i) = R
    squares = (1.0 + a + e + i, 1.0 + a - e - i, 1.0 + e - a - i, 1.0 + i - e - a)
    wx, wy, wz, xy, xz, yz = h - f, c - g, d - b, b + d, c + g, f + h
    rows = (squares[0], wx, wy, wz), (wx, squares[1], xy, xz), (wy, xy, squares[2], yz), (wz, xz, yz, squares[3])
    q = rows[squares.index(max(squares))]
    norm = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return np.array([part / norm for part in q])


def small_rotation(phi: Array) -> Array:
    """Return the rotation (3, 3) of the quaternion (1, phi / 2) / |.|, a turn by phi (3,) up to its third power."""
    return matrix_of_quaternion(np.concatenate([[1.0], 0.5 * phi]))


def cross(a: Array, b: Array) -> Array:
    """Return a x b (3,) of two vectors (3,): a tenth of the time that NumPy takes to tell which axes are meant."""
    (a1, a2, a3), (b1, b2, b3) = a.tolist(), b.tolist()
    return np.array([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])


def frame_of(d3: Array, d1: Array) -> Array:
    """Return the frame (3, 3) with the columns d1, d3 x d1, d3."""
    (x, y, z), (a, b, c) = d1.tolist(), d3.tolist()
    return np.array([[x, b * z - c * y, a], [y, c * x - a * z, b], [z, a * y - b * x, c]])


def same_sign(q: Array) -> Array:
    """Return the quaternions q (n, 4) with signs chosen so that neighbours lie on the same side."""
    signs = np.ones(len(q))
    signs[1:] = np.where(np.sum(q[1:] * q[:-1], axis=1) < 0.0, -1.0, 1.0)
    return q * np.cumprod(signs)[:, None]


def product(p: Array, q: Array) -> Array:
    """Return the product of quaternions p q (..., 4): first the turn q, then p."""
    (a, b, c, d), (w, x, y, z) = (p[..., i] for i in range(4)), (q[..., i] for i in range(4))
    result = np.empty(np.broadcast_shapes(p.shape, q.shape))
    result[..., 0], result[..., 1] = a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y
    result[..., 2], result[..., 3] = a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w
    return result


def quaternion_of_turn(phi: Array) -> Array:
    """Return the unit quaternion (n, 4) of the rotation vector phi (n, 3)."""
    half = 0.5 * np.linalg.norm(phi, axis=1, keepdims=True)
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * phi], axis=1)


def rotation(phi: Array) -> Array:
    """Return the matrix (3, 3) of a rotation vector (3,) in rad."""
    x, y, z = phi.tolist()
    angle = math.sqrt(x * x + y * y + z * z)
    w, share = math.cos(0.5 * angle), math.sin(0.5 * angle) / angle if angle > 1e-8 else 0.5
    x, y, z = share * x, share * y, share * z
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def rotation_vector(R: Array) -> Array:
    """Return the rotation vector (3,) in rad of a matrix (3, 3), of an angle up to pi."""
    q = quaternion_of_matrix(R)
    q = q if q[0] >= 0.0 else -q
    sine = float(np.linalg.norm(q[1:]))
    return np.asarray(q[1:] * (2.0 * np.arctan2(sine, q[0]) / sine if sine > 1e-9 else 2.0))


def between(q0: Array, q1: Array, part: float) -> Array:
    """Return the unit quaternion at ``part`` of the shortest way from q0 (4,) to q1 (4,)."""
    cosine = float(q0 @ q1)
    if cosine < 0.0:
        q1, cosine = -q1, -cosine
    sine = float(np.linalg.norm(q1 - cosine * q0))
    angle = float(np.arctan2(sine, cosine))
    if angle < 1e-8:  # the two weights below tend to 1 - part and part
        return np.asarray((1.0 - part) * q0 + part * q1)
    return np.asarray((np.sin((1.0 - part) * angle) * q0 + np.sin(part * angle) * q1) / np.sin(angle))
