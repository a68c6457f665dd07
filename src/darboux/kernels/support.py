r"""What a support asks of the state at an end: six conditions, and their derivatives.

Unknowns of an end: dr, the small rotation phi in the section's frame (dq = 1/2 q (0, phi)), dn, dm. Each condition is
one half of a conjugate pair: a displacement along an axis is prescribed or the force along it is known; a rotation
about an axis is prescribed or the moment about it is known. With o = 1 at the end and -1 at the start, u = r - r0, dead
loads F, M, follower loads p, d and springs K,

    n - o lambda (F + R p) + o K u = 0                         along the free axes                   (1)
    m - o lambda (M + R d) + o (the spring's moment) = 0       about the free axes                   (2)

The prescribed pose r0, q0 moves with the load factor lambda at the rates r0', q0'.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.algebra import (
    Quaternion,
    Rotation,
    Vector,
    column,
    cross,
    dot,
    half_product,
    minus,
    plus,
    put,
    put_quaternion,
    quaternion,
    rotate,
    rotation,
    scaled,
    times,
    turn,
    unrotate,
    vector,
)
from darboux.kernels.jit import allocating, inline, jit
from darboux.kernels.rod_equations import FORCE, MOMENT, ROTATION, STATES, UNIT

Array = NDArray[np.float64]

FREE, CONDITIONS, SIDES = 12, 6, 2  # unknowns of an end, conditions, right sides
ROW = FREE + SIDES  # of `conditions`: 12 columns, minus the value, minus the derivative by the load factor

# Where the parts of a support's numbers begin. Axes stand one after the other; matrices row by row.
OUTWARD, HELD, TURNED, GROOVE, SPRUNG = 0, 1, 4, 7, 8  # o; which displacements and rotations are held; two flags
SLIDING_AXES, TURNING_AXES, LINEAR, ROTATIONAL = 9, 18, 27, 36
DEAD_FORCE, DEAD_MOMENT, FOLLOWER_FORCE, FOLLOWER_MOMENT, ECCENTRIC = 45, 48, 51, 54, 57  # F, M, p, d, columns of A
PLACE, FRAME, PLACE_RATE, FRAME_RATE, NUMBERS = 66, 69, 73, 76, 80  # r0, q0, r0', q0'

# Where the parts of a support's way begin: the pose at load factor 0, that at load factor 1, and the twist on the way.
FROM_PLACE, FROM_FRAME, TO_PLACE, TO_FRAME, TWIST, WAY = 0, 3, 7, 10, 14, 15

STEP = 1e-7  # of the unknowns, where derivatives are taken by differences: a groove that turns, a rotational spring


@jit
def pose(way: Array, load_factor: float, support: Array) -> None:
    """Write the prescribed pose at a load factor, and its rates, among a support's numbers: the shortest way, evenly.

    With the turn theta from the first frame to the last one, in the first one, and the twist tau,

        r0 = (1 - lambda) r_a + lambda r_b,   q0 = q_a (cos(lambda theta / 2), ...) (cos(lambda tau / 2), 0, 0, sin(lambda tau / 2))
    """
    first, last = vector(way, FROM_PLACE), vector(way, TO_PLACE)
    put(support, PLACE, 1, plus(scaled(1.0 - load_factor, first), scaled(load_factor, last)))
    put(support, PLACE_RATE, 1, minus(last, first))
    w, a, b, c = _turned(way, FROM_FRAME, way, TO_FRAME)
    sine = np.sqrt(a * a + b * b + c * c)
    angle = np.arctan2(sine, w)
    axis = scaled(1.0 / sine if sine > 0.0 else 0.0, (a, b, c))
    q = _along(quaternion(way, FROM_FRAME), load_factor * angle, axis)
    rate = scaled(2.0 * angle, axis)
    half = 0.5 * load_factor * way[TWIST]
    q = _along(q, half, (0.0, 0.0, 1.0))
    cosine, sine = np.cos(2.0 * half), np.sin(2.0 * half)
    spin = (rate[0] * cosine + rate[1] * sine, rate[1] * cosine - rate[0] * sine, rate[2] + way[TWIST])
    put_quaternion(support, FRAME, 1, q)
    put_quaternion(support, FRAME_RATE, 1, half_product(q, spin))


@inline
def _along(q: Quaternion, half: float, axis: Vector) -> Quaternion:
    """q turned by twice the angle `half` about an axis of its own frame."""
    cosine, by_turn = np.cos(half), half_product(q, scaled(2.0 * np.sin(half), axis))
    return (
        cosine * q[0] + by_turn[0],
        cosine * q[1] + by_turn[1],
        cosine * q[2] + by_turn[2],
        cosine * q[3] + by_turn[3],
    )


@inline
def _turned(q0: Array, i: int, q: Array, j: int) -> tuple[float, float, float, float]:
    """conj(q0) q with a scalar part that is not negative."""
    a, b, c, d = q0[i], q0[i + 1], q0[i + 2], q0[i + 3]
    e, f, g, h = q[j], q[j + 1], q[j + 2], q[j + 3]
    w = a * e + b * f + c * g + d * h
    x = a * f - b * e - c * h + d * g
    y = a * g - c * e - d * f + b * h
    z = a * h - d * e - b * g + c * f
    sign = -1.0 if w < 0.0 else 1.0
    return sign * w, sign * x, sign * y, sign * z


@jit
def _spring_moment(support: Array, y: Array) -> Vector:
    """Return the gradient of 1/2 theta . K theta by a small rotation of the fixed frame: J^-T(theta) K theta.

    theta is the rotation vector from q0 to q in the fixed frame, and with the angle t = |theta|

        J^-1 = 1 - 1/2 [theta x] + (1 - t / 2 cot(t / 2)) / t^2 [theta x]^2
    """
    w, a, b, c = _turned(support, FRAME, y, ROTATION)
    axis = rotate(rotation(quaternion(support, FRAME)), (a, b, c))
    sine = np.sqrt(dot(axis, axis))
    t = 2.0 * np.arctan2(sine, w)
    theta = scaled(t / sine if sine > 1e-9 else 2.0, axis)
    factor = 1.0 / 12.0 if t < 1e-3 else (1.0 - 0.5 * t / np.tan(0.5 * t)) / t**2
    moment = times(support, ROTATIONAL, theta)
    first = cross(theta, moment)
    return plus(plus(moment, scaled(0.5, first)), scaled(factor, cross(theta, first)))


@inline
def _moment_of_loads(support: Array, R: Rotation) -> Vector:
    """M + R d + sum d_i x A_i."""
    moment = plus(vector(support, DEAD_MOMENT), rotate(R, vector(support, FOLLOWER_MOMENT)))
    for i in range(3):
        moment = plus(moment, cross(column(R, i), vector(support, ECCENTRIC + 3 * i)))
    return moment


@inline
def _moment_by_turn(support: Array, R: Rotation, phi: Vector) -> Vector:
    """How it changes with a small rotation phi in the section's frame: R (phi x d) + sum (R (phi x e_i)) x A_i."""
    change = rotate(R, cross(phi, vector(support, FOLLOWER_MOMENT)))
    for i in range(3):
        arm = rotate(R, cross(phi, vector(UNIT, 3 - i)))
        change = plus(change, cross(arm, vector(support, ECCENTRIC + 3 * i)))
    return change


@jit
def values(support: Array, y: Array, load_factor: float, out: Array) -> None:
    """(1), (2) and the prescribed displacements and rotations: out (6,), to be zero at the state y (13,)."""
    o = support[OUTWARD]
    R, R0 = rotation(quaternion(y, ROTATION)), rotation(quaternion(support, FRAME))
    u = minus(vector(y, 0), vector(support, PLACE))
    force = plus(vector(support, DEAD_FORCE), rotate(R, vector(support, FOLLOWER_FORCE)))
    moment = _moment_of_loads(support, R)
    n = plus(minus(vector(y, FORCE), scaled(o * load_factor, force)), scaled(o, times(support, LINEAR, u)))
    m = minus(vector(y, MOMENT), scaled(o * load_factor, moment))
    if support[SPRUNG] != 0.0:
        m = plus(m, scaled(o, _spring_moment(support, y)))
    reaction = (0.0, 0.0, 0.0)
    for i in range(3):
        axis = vector(support, SLIDING_AXES + 3 * i)
        if support[GROOVE] != 0.0:
            axis = rotate(R, axis)
        if support[HELD + i] != 0.0:
            out[i] = dot(axis, u)
            reaction = plus(reaction, scaled(dot(axis, n), axis))
        else:
            out[i] = dot(axis, n)
    if support[GROOVE] != 0.0:  # its force acts off the end, at the point that is held
        m = minus(m, cross(reaction, u))
    first, second = vector(support, TURNING_AXES), vector(support, TURNING_AXES + 3)
    if support[TURNED] == 0.0 and support[TURNED + 1] == 0.0 and support[TURNED + 2] != 0.0:  # a universal joint
        b = rotate(R, unrotate(R0, second))
        out[3], out[4], out[5] = dot(first, m), dot(b, m), dot(first, b)
        return
    _w, p, q, r = _turned(support, FRAME, y, ROTATION)
    angle = scaled(2.0, rotate(R0, (p, q, r)))
    for i in range(3):
        axis = vector(support, TURNING_AXES + 3 * i)
        out[3 + i] = dot(axis, angle if support[TURNED + i] != 0.0 else m)


@jit
def _write_displacements(support: Array, y: Array, load_factor: float, out: Array) -> None:
    o = support[OUTWARD]
    R = rotation(quaternion(y, ROTATION))
    p, rate = vector(support, FOLLOWER_FORCE), vector(support, PLACE_RATE)
    force = plus(vector(support, DEAD_FORCE), rotate(R, p))
    for i in range(3):
        row, axis = i * ROW, vector(support, SLIDING_AXES + 3 * i)
        if support[HELD + i] != 0.0:
            for a in range(3):
                out[row + a] = axis[a]
            out[row + FREE + 1] = dot(axis, rate)
            continue
        for a in range(3):
            e = vector(UNIT, 3 - a)
            out[row + a] = o * dot(axis, times(support, LINEAR, e))
            out[row + 3 + a] = o * load_factor * dot(axis, rotate(R, cross(p, e)))
            out[row + 6 + a] = axis[a]
        out[row + FREE + 1] = o * (dot(axis, force) + dot(axis, times(support, LINEAR, rate)))


@jit
def _write_rotations(support: Array, y: Array, load_factor: float, out: Array) -> None:
    o = support[OUTWARD]
    q, q0 = quaternion(y, ROTATION), quaternion(support, FRAME)
    R, R0 = rotation(q), rotation(q0)
    moment = _moment_of_loads(support, R)
    m = minus(vector(y, MOMENT), scaled(o * load_factor, moment))
    w, x, z, v = _turned(support, FRAME, y, ROTATION)
    relative = turn(q0, quaternion(support, FRAME_RATE))  # how the prescribed frame turns per unit of load factor
    second = vector(support, TURNING_AXES + 3)
    universal = support[TURNED] == 0.0 and support[TURNED + 1] == 0.0 and support[TURNED + 2] != 0.0
    material = unrotate(R0, second)
    for i in range(3):
        row, axis = (3 + i) * ROW, vector(support, TURNING_AXES + 3 * i)
        if universal and i > 0:
            b = rotate(R, material)
            b_rate = rotate(R, cross(material, relative))
            first = vector(support, TURNING_AXES)
            for a in range(3):
                e = vector(UNIT, 3 - a)
                db = rotate(R, cross(e, material))
                if i == 1:
                    out[row + 3 + a] = dot(m, db) - o * load_factor * dot(b, _moment_by_turn(support, R, e))
                    out[row + 9 + a] = b[a]
                else:
                    out[row + 3 + a] = dot(first, db)
            out[row + FREE + 1] = o * dot(b, moment) - dot(m, b_rate) if i == 1 else -dot(first, b_rate)
        elif support[TURNED + i] != 0.0:
            # 2 vec(conj(q0) q (1, phi / 2)) = 2 vec + w phi + vec x phi
            local = unrotate(R0, axis)
            by_phi = plus(scaled(w, local), cross(local, (x, z, v)))
            for a in range(3):
                out[row + 3 + a] = by_phi[a]
            by_frame = minus(cross(relative, (x, z, v)), scaled(w, relative))
            out[row + FREE + 1] = -dot(local, by_frame)
        else:
            for a in range(3):
                e = vector(UNIT, 3 - a)
                out[row + 3 + a] = -o * load_factor * dot(axis, _moment_by_turn(support, R, e))
                out[row + 9 + a] = axis[a]
            out[row + FREE + 1] = o * dot(axis, moment)


@allocating
def _write_by_differences(support: Array, y: Array, load_factor: float, out: Array) -> None:
    """The rows by central differences, and the load factor's side."""
    size = 1.0
    for k in range(FORCE, STATES):
        size = max(size, 1.0 + abs(y[k]))
    moved, shifted = np.empty(STATES), np.empty(support.size)
    ahead, behind = np.empty(CONDITIONS), np.empty(CONDITIONS)
    for k in range(FREE + 1):
        step = STEP * (1.0 if k < 6 or k == FREE else size)
        for sign in (1.0, -1.0):
            for i in range(STATES):
                moved[i] = y[i]
            for i in range(support.size):
                shifted[i] = support[i]
            if k < 3:
                moved[k] += sign * step
            elif k < 6:
                dq = half_product(quaternion(y, ROTATION), scaled(sign * step, vector(UNIT, 6 - k)))
                for a in range(4):
                    moved[ROTATION + a] += dq[a]
            elif k < FREE:
                moved[k + 1] += sign * step
            else:
                for i in range(PLACE_RATE - PLACE):
                    shifted[PLACE + i] += sign * step * support[PLACE_RATE + i]
            factor = load_factor + (sign * step if k == FREE else 0.0)
            values(shifted, moved, factor, ahead if sign > 0.0 else behind)
        for i in range(CONDITIONS):
            slope = (ahead[i] - behind[i]) / (2.0 * step)
            if k < FREE:
                out[i * ROW + k] = slope
            else:
                out[i * ROW + FREE + 1] = -slope


@allocating
def conditions(support: Array, y: Array, load_factor: float, out: Array) -> None:
    """Write the rows, minus the values, and minus the derivatives by the load factor: out (6 x ROW,)."""
    for k in range(CONDITIONS * ROW):
        out[k] = 0.0
    if support[GROOVE] != 0.0 or support[SPRUNG] != 0.0:
        _write_by_differences(support, y, load_factor, out)
    else:
        _write_displacements(support, y, load_factor, out)
        _write_rotations(support, y, load_factor, out)
    now = np.empty(CONDITIONS)
    values(support, y, load_factor, now)
    for i in range(CONDITIONS):
        out[i * ROW + FREE] = -now[i]


@allocating
def joint(support: Array, before: Array, behind: Array, load_factor: float, out: Array) -> None:
    """Write the twelve equations of a station between the states before it and behind it: out (12 x 26,).

    Place and frame are the same on both sides, and with n- - n+ and m- - m+ for n and m its conditions are those of an end.
    Columns: the unknowns before it and behind it, minus the values, minus their derivatives by the load factor.
    """
    width = FREE + ROW
    for k in range(FREE * width):
        out[k] = 0.0
    apart = turned_from(behind, before)
    for a in range(3):
        out[a * width + a] = out[(3 + a) * width + 3 + a] = 1.0
        out[a * width + FREE + a] = out[(3 + a) * width + FREE + 3 + a] = -1.0
        out[a * width + 2 * FREE] = behind[a] - before[a]
        out[(3 + a) * width + 2 * FREE] = -apart[a]
    difference, own = np.empty(STATES), np.empty(CONDITIONS * ROW)
    for k in range(STATES):
        difference[k] = before[k] - (behind[k] if k >= FORCE else 0.0)
    conditions(support, difference, load_factor, own)
    for i in range(CONDITIONS):
        row = (CONDITIONS + i) * width
        for k in range(FREE):
            out[row + k] = own[i * ROW + k]
        for k in range(6, FREE):
            out[row + FREE + k] = -own[i * ROW + k]
        for k in range(SIDES):
            out[row + 2 * FREE + k] = own[i * ROW + FREE + k]


@inline
def turned_from(y0: Array, y: Array) -> Vector:
    """2 vec(conj(q0) q): the small turn from the state y0 to y."""
    _w, a, b, c = _turned(y0, ROTATION, y, ROTATION)
    return 2.0 * a, 2.0 * b, 2.0 * c


@jit
def motions(support: Array, y: Array, out: Array) -> int:
    """Write the motions (dr, theta) that a support leaves free at the state y (13,), as columns of out (6 x 6,); how many."""
    R, R0 = rotation(quaternion(y, ROTATION)), rotation(quaternion(support, FRAME))
    count = 0
    for k in range(out.size):
        out[k] = 0.0
    for i in range(3):
        axis = vector(support, SLIDING_AXES + 3 * i)
        if support[GROOVE] != 0.0:
            axis = rotate(R, axis)
        if support[HELD + i] == 0.0:
            put(out, count, 6, axis)
            count += 1
    universal = support[TURNED] == 0.0 and support[TURNED + 1] == 0.0 and support[TURNED + 2] != 0.0
    for i in range(3):
        axis = vector(support, TURNING_AXES + 3 * i)
        if universal and i == 1:
            axis = rotate(R, unrotate(R0, axis))
        if support[TURNED + i] == 0.0:
            put(out, 18 + count, 6, axis)
            count += 1
    return count


@jit
def stiffness(support: Array, y: Array, load_factor: float, out: Array) -> None:
    """Write the second derivative of the energy of springs and eccentric forces, for (dr, theta): out (6 x 6,)."""
    R = rotation(quaternion(y, ROTATION))
    for k in range(out.size):
        out[k] = 0.0
    for a in range(3):
        for b in range(3):
            out[a * 6 + b] = support[LINEAR + 3 * a + b]
            out[(3 + a) * 6 + 3 + b] = support[ROTATIONAL + 3 * a + b]
    for i in range(3):  # of -(d_i x A_i) by theta, its symmetric part: d_i . A_i - (d_i A_i + A_i d_i) / 2
        d, A = column(R, i), vector(support, ECCENTRIC + 3 * i)
        for a in range(3):
            out[(3 + a) * 7] += load_factor * dot(d, A)
            for b in range(3):
                out[(3 + a) * 6 + 3 + b] -= 0.5 * load_factor * (d[a] * A[b] + A[a] * d[b])
