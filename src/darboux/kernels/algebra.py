"""Vectors, quaternions and rotations as tuples of scalars: the compiler keeps them in registers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.jit import inline

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]  # scalar first
Rotation = tuple[float, float, float, float, float, float, float, float, float]  # row by row

# An index that is unsigned never counts from the end: the compiler leaves out what looks for that, and uses vectors.
ONE, TWO = np.uint64(1), np.uint64(2)


@inline
def vector(x: Array, i: int) -> Vector:
    """The three numbers of x from i on."""
    o = np.uint64(i)
    return x[o], x[o + ONE], x[o + TWO]


@inline
def quaternion(x: Array, i: int) -> Quaternion:
    """The four numbers of x from i on."""
    return x[i], x[i + 1], x[i + 2], x[i + 3]


@inline
def store(x: Array, i: int, a: Vector) -> None:
    """x[i], x[i + 1], x[i + 2] = a."""
    o = np.uint64(i)
    x[o], x[o + ONE], x[o + TWO] = a


@inline
def add(x: Array, i: int, a: Vector) -> None:
    """Add a to the three numbers of x from i on."""
    o = np.uint64(i)
    x[o] += a[0]
    x[o + ONE] += a[1]
    x[o + TWO] += a[2]


@inline
def add_multiple(x: Array, i: int, factor: float, y: Array, k: int, count: int) -> None:
    """x[i + j] += factor y[k + j] for j < count."""
    to, of = np.uint64(i), np.uint64(k)  # such an index never counts from the end: the compiler uses vectors
    for j in range(np.uint64(count)):
        x[to + j] += factor * y[of + j]


@inline
def add_row_times(x: Array, i: int, a: Vector, y: Array, k: int, width: int) -> None:
    """Add a . Y to `width` numbers of x, with Y the three rows of that width in y from k on."""
    to, row1 = np.uint64(i), np.uint64(k)
    row2, row3 = row1 + np.uint64(width), row1 + np.uint64(2 * width)
    for j in range(np.uint64(width)):
        x[to + j] += a[0] * y[row1 + j] + a[1] * y[row2 + j] + a[2] * y[row3 + j]


@inline
def put(x: Array, i: int, step: int, a: Vector) -> None:
    """x[i], x[i + step], x[i + 2 step] = a."""
    x[i], x[i + step], x[i + 2 * step] = a


@inline
def put_quaternion(x: Array, i: int, step: int, q: Quaternion) -> None:
    """x[i], x[i + step], x[i + 2 step], x[i + 3 step] = q."""
    x[i], x[i + step], x[i + 2 * step], x[i + 3 * step] = q


@inline
def plus(a: Vector, b: Vector) -> Vector:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inline
def minus(a: Vector, b: Vector) -> Vector:
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inline
def scaled(s: float, a: Vector) -> Vector:
    """s a."""
    return s * a[0], s * a[1], s * a[2]


@inline
def mix(s: float, a: Vector, r: float, b: Vector) -> Vector:
    """s a + r b."""
    return s * a[0] + r * b[0], s * a[1] + r * b[1], s * a[2] + r * b[2]


@inline
def dot(a: Vector, b: Vector) -> float:
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inline
def across(t: Vector, a: Vector) -> Vector:
    """The part of a across the unit vector t: a - (t . a) t."""
    s = dot(t, a)
    return a[0] - s * t[0], a[1] - s * t[1], a[2] - s * t[2]


@inline
def cross(a: Vector, b: Vector) -> Vector:
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inline
def times(x: Array, i: int, a: Vector) -> Vector:
    """X a, with X the 3 x 3 matrix stored row by row in x from i on."""
    return (
        x[i] * a[0] + x[i + 1] * a[1] + x[i + 2] * a[2],
        x[i + 3] * a[0] + x[i + 4] * a[1] + x[i + 5] * a[2],
        x[i + 6] * a[0] + x[i + 7] * a[1] + x[i + 8] * a[2],
    )


@inline
def transposed_times(x: Array, i: int, a: Vector) -> Vector:
    """X^T a, with X the 3 x 3 matrix stored row by row in x from i on."""
    return (
        x[i] * a[0] + x[i + 3] * a[1] + x[i + 6] * a[2],
        x[i + 1] * a[0] + x[i + 4] * a[1] + x[i + 7] * a[2],
        x[i + 2] * a[0] + x[i + 5] * a[1] + x[i + 8] * a[2],
    )


@inline
def symmetric_times(x: Array, i: int, a: Vector) -> Vector:
    """X a, with X the symmetric matrix stored as 11, 22, 33, 23, 13, 12 in x from i on."""
    x11, x22, x33 = vector(x, i)
    x23, x13, x12 = vector(x, i + 3)
    return (
        x11 * a[0] + x12 * a[1] + x13 * a[2],
        x12 * a[0] + x22 * a[1] + x23 * a[2],
        x13 * a[0] + x23 * a[1] + x33 * a[2],
    )


@inline
def rotation(q: Quaternion) -> Rotation:
    """R(q), the same for every multiple of q."""
    w, x, y, z = q
    t = 2.0 / (w * w + x * x + y * y + z * z)
    tx, ty, tz = t * x, t * y, t * z
    return (
        *(1.0 - (ty * y + tz * z), tx * y - tz * w, tx * z + ty * w),
        *(tx * y + tz * w, 1.0 - (tx * x + tz * z), ty * z - tx * w),
        *(tx * z - ty * w, ty * z + tx * w, 1.0 - (tx * x + ty * y)),
    )


@inline
def column(R: Rotation, i: int) -> Vector:
    """Column i of R: the director d1, d2 or d3."""
    return R[i], R[3 + i], R[6 + i]


@inline
def rotate(R: Rotation, a: Vector) -> Vector:
    """R a: from the section's frame to the fixed one."""
    return (
        R[0] * a[0] + R[1] * a[1] + R[2] * a[2],
        R[3] * a[0] + R[4] * a[1] + R[5] * a[2],
        R[6] * a[0] + R[7] * a[1] + R[8] * a[2],
    )


@inline
def unrotate(R: Rotation, a: Vector) -> Vector:
    """R^T a: from the fixed frame to the section's."""
    return (
        R[0] * a[0] + R[3] * a[1] + R[6] * a[2],
        R[1] * a[0] + R[4] * a[1] + R[7] * a[2],
        R[2] * a[0] + R[5] * a[1] + R[8] * a[2],
    )


@inline
def half_product(q: Quaternion, a: Vector) -> Quaternion:
    """1/2 q (0, a): how fast q changes when the frame turns at the rate a, in components of the frame."""
    w, x, y, z = q
    a1, a2, a3 = 0.5 * a[0], 0.5 * a[1], 0.5 * a[2]
    return (
        -(x * a1 + y * a2 + z * a3),
        w * a1 + y * a3 - z * a2,
        w * a2 + z * a1 - x * a3,
        w * a3 + x * a2 - y * a1,
    )


@inline
def turn(q: Quaternion, dq: Quaternion) -> Vector:
    """2 vec(conj(q) dq) / |q|^2: the small rotation, in components of the frame, that dq makes; undoes half_product."""
    w, x, y, z = q
    t = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        t * (w * dq[1] - x * dq[0] - (y * dq[3] - z * dq[2])),
        t * (w * dq[2] - y * dq[0] - (z * dq[1] - x * dq[3])),
        t * (w * dq[3] - z * dq[0] - (x * dq[2] - y * dq[1])),
    )
