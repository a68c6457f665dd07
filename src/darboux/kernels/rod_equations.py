r"""The static equations of a Kirchhoff or Cosserat rod, and their exact Jacobian.

The state y holds r (3), q (4, scalar first), n (3) and m (3), the vectors in the fixed frame; R = R(q) has the
directors as columns and does not depend on \|q\|. With the section's law in compliance form and affine loads,

    k = k0 + B^-1 M + D N      v = e3 + S^-1 N + D^T M,     N = R^T n,  M = R^T m                 (1)
    f = a + C r + R b          l = la + R lb                                                      (2)
    r' = R v                   q' = 1/2 q (0, k)         n' = -f         m' = n x r' - l          (3)

The coefficients c(s) come as 36 columns, named below. S^-1 = 0 makes the rod inextensible and unshearable. D = 0, unless
9 columns more hold it: bending and twist are then coupled with stretch and shear, and B^-1 and S^-1 stand for the blocks
of the section's whole compliance.

The Jacobian goes through the small rotation phi that dq makes, in components of the section's frame:
dR = R [phi x], dM = M x phi. These blocks may differ from zero, those marked D only where D does:

              r   q   n   m
        r' (  .   x   x   D  )
        q' (  .   x   D   x  )                                                                    (4)
        n' (  x   x   .   .  )
        m' (  .   x   x   D  )

References: S. S. Antman, Nonlinear Problems of Elasticity, 2nd ed., Springer 2005, ch. VIII.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.algebra import (
    Quaternion,
    Rotation,
    Vector,
    cross,
    half_product,
    minus,
    plus,
    put,
    put_quaternion,
    quaternion,
    rotate,
    rotation,
    scaled,
    symmetric_times,
    times,
    transposed_times,
    turn,
    unrotate,
    vector,
)
from darboux.kernels.fours import NOTHING, Four, four_plus, put_four
from darboux.kernels.jit import inline, jit

Array = NDArray[np.float64]

# Where the parts of the state y begin.
POSITION, ROTATION, FORCE, MOMENT, STATES = 0, 3, 7, 10, 13  # r, q, n, m, and how many in all

# Where the parts of the coefficients c begin; symmetric matrices as 11, 22, 33, 23, 13, 12, others row by row.
BINV, SINV, K0 = 0, 6, 12  # compliance in bending and twist, in shear and stretch; natural curvature and twist
DEAD_FORCE, FORCE_GRADIENT, FOLLOWER_FORCE = 15, 18, 27  # a, C, b
DEAD_MOMENT, FOLLOWER_MOMENT = 30, 33  # la, lb
WIDTH = 36
COUPLING, COUPLED_WIDTH = 36, 45  # D, only in the coefficients of coupled sections

UNIT = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])  # the unit vector number a is what begins at 3 - a
ZERO = (0.0, 0.0, 0.0)


class Section(NamedTuple):
    """What (1) makes of the state and the coefficients at one s."""

    q: Quaternion
    R: Rotation
    n: Vector
    material_n: Vector  # R^T n
    material_m: Vector  # R^T m
    k: Vector
    v: Vector


@inline
def coupled(c: Array) -> bool:
    """Whether the coefficients hold D: few rods are coupled, and the others do not pay for it."""
    return c.size > WIDTH


@inline
def section(y: Array, i: int, c: Array) -> Section:
    """(1) of the state that begins at y[i]."""
    q, n = quaternion(y, i + ROTATION), vector(y, i + FORCE)
    R = rotation(q)
    material_n, material_m = unrotate(R, n), unrotate(R, vector(y, i + MOMENT))
    k = plus(vector(c, K0), symmetric_times(c, BINV, material_m))
    v = plus((0.0, 0.0, 1.0), symmetric_times(c, SINV, material_n))
    return Section(q, R, n, material_n, material_m, k, v)


@inline
def coupled_section(y: Array, i: int, c: Array) -> Section:
    """The same with D."""
    x = section(y, i, c)
    k = plus(x.k, times(c, COUPLING, x.material_n))
    v = plus(x.v, transposed_times(c, COUPLING, x.material_m))
    return Section(x.q, x.R, x.n, x.material_n, x.material_m, k, v)


@inline
def _write(x: Section, y: Array, i: int, c: Array, dy: Array, j: int, step: int) -> None:
    """(2) and (3), of the state that begins at y[i] and its section."""
    r = vector(y, i + POSITION)
    f = plus(
        plus(vector(c, DEAD_FORCE), times(c, FORCE_GRADIENT, r)),
        rotate(x.R, vector(c, FOLLOWER_FORCE)),
    )
    l = plus(vector(c, DEAD_MOMENT), rotate(x.R, vector(c, FOLLOWER_MOMENT)))
    dr = rotate(x.R, x.v)
    dq = half_product(x.q, x.k)
    dm = minus(cross(x.n, dr), l)
    put(dy, j + POSITION * step, step, dr)
    put_quaternion(dy, j + ROTATION * step, step, dq)
    put(dy, j + FORCE * step, step, (-f[0], -f[1], -f[2]))
    put(dy, j + MOMENT * step, step, dm)


@jit
def _write_coupled(y: Array, i: int, c: Array, dy: Array, j: int, step: int) -> None:
    """The same for a coupled section: not inlined, so that others do not pay for it."""
    _write(coupled_section(y, i, c), y, i, c, dy, j, step)


@inline
def write_derivative(y: Array, i: int, c: Array, dy: Array, j: int, step: int) -> None:
    """(2) and (3): the derivative, in dy[j], dy[j + step], ..., of the state that begins at y[i]."""
    if coupled(c):
        _write_coupled(y, i, c, dy, j, step)
    else:
        _write(section(y, i, c), y, i, c, dy, j, step)


@inline
def _write_rate(x: Section, y: Array, i: int, rate: Array, dy: Array, j: int) -> None:
    """The same by the coefficients' rates: (1) to (3) are affine in c, and e3 alone stays without them."""
    of_frame = Section(x.q, x.R, x.n, x.material_n, x.material_m, x.k, minus(x.v, (0.0, 0.0, 1.0)))
    _write(of_frame, y, i, rate, dy, j, 1)


@jit
def _write_coupled_rate(y: Array, i: int, rate: Array, dy: Array, j: int) -> None:
    _write_rate(coupled_section(y, i, rate), y, i, rate, dy, j)


@inline
def write_rate(y: Array, i: int, rate: Array, dy: Array, j: int) -> None:
    """How y' of the state that begins at y[i] changes with what the coefficients depend on, from their rates dc."""
    if coupled(rate):
        _write_coupled_rate(y, i, rate, dy, j)
    else:
        _write_rate(section(y, i, rate), y, i, rate, dy, j)


@inline
def _columns_of_position(c: Array, J: Array) -> None:
    """dn' = -C dr."""
    for row in range(3):
        for column in range(3):
            J[(FORCE + row) * STATES + POSITION + column] = -c[FORCE_GRADIENT + 3 * row + column]


@inline
def _by_components(q: Quaternion) -> tuple[Four, Four, Four]:
    """phi as rows times dq: 2 vec(conj(q) dq) / |q|^2."""
    w, x, y, z = q
    t = 2.0 / (w * w + x * x + y * y + z * z)
    w, x, y, z = t * w, t * x, t * y, t * z
    return (-x, w, z, -y), (-y, -z, w, x), (-z, y, -x, w)


@inline
def _turned(a: Vector) -> tuple[Vector, Vector, Vector]:
    """a x e_1, a x e_2 and a x e_3."""
    return (0.0, a[2], -a[1]), (-a[2], 0.0, a[0]), (a[1], -a[0], 0.0)


@inline
def _put_row(J: Array, row: int, by_phi: Vector, phi: tuple[Four, Four, Four], more: Four) -> None:
    """Four columns of a row of J: what the components of phi change, times phi by those of dq, and what dq changes besides."""
    of_dq = four_plus(four_plus(four_plus(more, by_phi[0], phi[0]), by_phi[1], phi[1]), by_phi[2], phi[2])
    put_four(J, row * STATES + ROTATION, of_dq)


@inline
def _put_rows(J: Array, row: int, columns: tuple[Vector, Vector, Vector], phi: tuple[Four, Four, Four]) -> None:
    """Three such rows."""
    x, y, z = columns
    _put_row(J, row, (x[0], y[0], z[0]), phi, NOTHING)
    _put_row(J, row + 1, (x[1], y[1], z[1]), phi, NOTHING)
    _put_row(J, row + 2, (x[2], y[2], z[2]), phi, NOTHING)


@inline
def _columns_of_rotation(x: Section, c: Array, J: Array) -> None:
    """The columns of dq, which turns the frame by phi.

    dr' = R (phi x v + S^-1 (N x phi))          dq' = 1/2 dq (0, k) + 1/2 q (0, B^-1 (M x phi))
    dn' = -R (phi x b)                          dm' = n x dr' - R (phi x lb)
    """
    phi, k = _by_components(x.q), scaled(0.5, x.k)
    by_N, by_v, by_M = _turned(x.material_n), _turned(x.v), _turned(x.material_m)
    dr = (
        rotate(x.R, minus(symmetric_times(c, SINV, by_N[0]), by_v[0])),
        rotate(x.R, minus(symmetric_times(c, SINV, by_N[1]), by_v[1])),
        rotate(x.R, minus(symmetric_times(c, SINV, by_N[2]), by_v[2])),
    )
    _put_rows(J, POSITION, dr, phi)
    b, lb = _turned(vector(c, FOLLOWER_FORCE)), _turned(vector(c, FOLLOWER_MOMENT))
    _put_rows(J, FORCE, (rotate(x.R, b[0]), rotate(x.R, b[1]), rotate(x.R, b[2])), phi)
    dm = (
        plus(cross(x.n, dr[0]), rotate(x.R, lb[0])),
        plus(cross(x.n, dr[1]), rotate(x.R, lb[1])),
        plus(cross(x.n, dr[2]), rotate(x.R, lb[2])),
    )
    _put_rows(J, MOMENT, dm, phi)
    dq = (
        half_product(x.q, symmetric_times(c, BINV, by_M[0])),
        half_product(x.q, symmetric_times(c, BINV, by_M[1])),
        half_product(x.q, symmetric_times(c, BINV, by_M[2])),
    )
    _put_row(J, ROTATION, (dq[0][0], dq[1][0], dq[2][0]), phi, (0.0, -k[0], -k[1], -k[2]))
    _put_row(J, ROTATION + 1, (dq[0][1], dq[1][1], dq[2][1]), phi, (k[0], 0.0, k[2], -k[1]))
    _put_row(J, ROTATION + 2, (dq[0][2], dq[1][2], dq[2][2]), phi, (k[1], -k[2], 0.0, k[0]))
    _put_row(J, ROTATION + 3, (dq[0][3], dq[1][3], dq[2][3]), phi, (k[2], k[1], -k[0], 0.0))


@inline
def _column_of_force(x: Section, e: Vector, c: Array, J: Array, j: int) -> None:
    """dr' = R S^-1 R^T e, dm' = n x dr' + e x r', for a unit force e."""
    dr = rotate(x.R, symmetric_times(c, SINV, unrotate(x.R, e)))
    put(J, POSITION * STATES + j, STATES, dr)
    put(J, MOMENT * STATES + j, STATES, plus(cross(x.n, dr), cross(e, rotate(x.R, x.v))))


@inline
def _column_of_moment(x: Section, e: Vector, c: Array, J: Array, j: int) -> None:
    """dq' = 1/2 q (0, B^-1 R^T e), for a unit moment e."""
    dq = half_product(x.q, symmetric_times(c, BINV, unrotate(x.R, e)))
    put_quaternion(J, ROTATION * STATES + j, STATES, dq)


@inline
def _clear_coupling(J: Array) -> None:
    """The blocks marked D in (4) are zero."""
    for a in range(3):
        put(J, POSITION * STATES + MOMENT + a, STATES, ZERO)
        put_quaternion(J, ROTATION * STATES + FORCE + a, STATES, (0.0, 0.0, 0.0, 0.0))
        put(J, MOMENT * STATES + MOMENT + a, STATES, ZERO)


@inline
def _add_to_column(x: Section, dN: Vector, dM: Vector, c: Array, J: Array, j: int) -> None:
    """Add D's part: dr' = R D^T dM, dq' = 1/2 q (0, D dN), dm' = n x dr'."""
    dr = rotate(x.R, transposed_times(c, COUPLING, dM))
    dq = half_product(x.q, times(c, COUPLING, dN))
    dm = cross(x.n, dr)
    for row in range(3):
        J[(POSITION + row) * STATES + j] += dr[row]
        J[(MOMENT + row) * STATES + j] += dm[row]
    for row in range(4):
        J[(ROTATION + row) * STATES + j] += dq[row]


@jit
def _add_coupling(x: Section, c: Array, J: Array) -> None:
    """Add D's part to all columns: dN = N x phi and dM = M x phi by a turn, R^T e by a unit force or moment e."""
    for a in range(4):
        phi = turn(x.q, quaternion(UNIT, 3 - a))
        _add_to_column(x, cross(x.material_n, phi), cross(x.material_m, phi), c, J, ROTATION + a)
    for a in range(3):
        e = unrotate(x.R, vector(UNIT, 3 - a))
        _add_to_column(x, e, ZERO, c, J, FORCE + a)
        _add_to_column(x, ZERO, e, c, J, MOMENT + a)


@inline
def write_jacobian(y: Array, i: int, c: Array, J: Array) -> None:
    """(4): d(y')/dy at the state that begins at y[i]; writes only the entries that may differ from zero."""
    x = coupled_section(y, i, c) if coupled(c) else section(y, i, c)
    _columns_of_position(c, J)
    _clear_coupling(J)
    _columns_of_rotation(x, c, J)
    for a in range(3):
        e = vector(UNIT, 3 - a)
        _column_of_force(x, e, c, J, FORCE + a)
        _column_of_moment(x, e, c, J, MOMENT + a)
    if coupled(c):
        _add_coupling(x, c, J)


@inline
def _rows_times(
    J: Array, rows: int, count: int, partner: int, x: Array, i: int, width: int, out: Array, j: int
) -> None:
    """Some rows of J X: the four columns of q, and three columns more that begin at `partner`."""
    q0, p0 = i + ROTATION * width, i + partner * width
    q1, q2, q3 = q0 + width, q0 + 2 * width, q0 + 3 * width
    p1, p2 = p0 + width, p0 + 2 * width
    for k in range(width):
        y0, y1, y2, y3 = x[q0 + k], x[q1 + k], x[q2 + k], x[q3 + k]
        z0, z1, z2 = x[p0 + k], x[p1 + k], x[p2 + k]
        for row in range(rows, rows + count):
            a, b = row * STATES + ROTATION, row * STATES + partner
            by_rotation = J[a] * y0 + J[a + 1] * y1 + J[a + 2] * y2 + J[a + 3] * y3
            out[j + row * width + k] = by_rotation + J[b] * z0 + J[b + 1] * z1 + J[b + 2] * z2


@inline
def jacobian_times(J: Array, x: Array, i: int, width: int, out: Array, j: int) -> None:
    """J X for the matrix X of 13 rows of `width` that begins at x[i], by the blocks of (4) without D's."""
    _rows_times(J, POSITION, 3, FORCE, x, i, width, out, j)
    _rows_times(J, ROTATION, 4, MOMENT, x, i, width, out, j)
    _rows_times(J, FORCE, 3, POSITION, x, i, width, out, j)
    _rows_times(J, MOMENT, 3, FORCE, x, i, width, out, j)


@jit
def derivative(y: Array, c: Array, dy: Array) -> None:
    """dy = y' by (3), of the state y (13,) with the coefficients c (36,) or (45,)."""
    write_derivative(y, 0, c, dy, 0, 1)


@jit
def derivatives(y: Array, c: Array, dy: Array) -> None:
    """The same for the states y (n x 13,), each with its own coefficients c (n x 36,) or (n x 45,)."""
    states = y.size // STATES
    width = c.size // states
    for i in range(states):
        write_derivative(y, i * STATES, c[i * width : (i + 1) * width], dy, i * STATES, 1)


@jit
def jacobian(y: Array, c: Array, J: Array) -> None:
    """J = d(y')/dy by (4), (13 x 13,) row by row, at the state y (13,) with the coefficients c (36,) or (45,)."""
    J[:] = 0.0
    write_jacobian(y, 0, c, J)
