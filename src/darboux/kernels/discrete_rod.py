"""Discrete elastic rods: energy, gradient and exact Hessian, in units that the caller made dimensionless.

A rod of N edges has the vertices x_0 ... x_N. Edge j lies between x_{j-1} and x_j, j = 1 ... N; it carries the
directors d1, d2 and its tangent t = d1 x d2. Two ghost edges, 0 and N + 1, are the fixed frames of clamps at the end
vertices. Where two edges meet at vertex i, a in front of it and b behind, a spring resists the strains

    kappa1 = -2 a2'.b / chi           kappa2 = 2 a1'.b / chi           chi = 1 + a.b
    m      = atan2(b1.a2 - b2.a1, a1.b1 + a2.b2) + 2 pi w
    E_i    = 1/2 (kappa - kappa0).B/V (kappa - kappa0)         kappa = (kappa1, kappa2, m)

where a1', a2' are the directors of a turned forward by m / 2 about a, and b1', b2' those of b turned back by m / 2: what is
between these frames is bending alone, by an angle phi with |(kappa1, kappa2)| = 2 tan(phi / 2). (The mean of the directors
as they are, which is usual, makes it smaller by cos(m / 2): a rod that is twisted would bend more easily than it does.)
V is the length of rod that belongs to the vertex (half a cell at a clamp, which makes the clamp second order), and w the
whole turns that keep m next to its last value. Edges stretch, and vertices carry affine loads:

    E_j = (EA eps^2 / 2 + T eps) l       eps = |x_j - x_{j-1}| / l - 1
    E_i = -(f.x_i + x_i.C x_i / 2)

The unknowns are packed x_0, theta_1, x_1, theta_2, ..., x_N, so that vertex i is at 4 i, the angle of edge j at
4 j - 1, and the Hessian is a band of half-bandwidth 10 (see band.py).

The chart: a step (dx, theta) carries each edge's directors from the old tangent to the new by parallel transport in
time, then turns them by theta about the new tangent. Derivatives are taken at the step 0, and the state moves along
with each accepted step (`advance`). They are exact in this chart, holonomy included.

Notation of the derivatives: w_a is a change of the unit tangent a (perpendicular to it), e_a one of the edge vector, and
r_a = 1 / |a| the edge's inverse length. By edges a spring has eight unknowns, (e_a, theta_a, e_b,
theta_b), by vertices eleven, (x_-, theta_a, x, theta_b, x_+), which are neighbours in the packed order.

Sources: M. Bergou et al., Discrete elastic rods, ACM Trans. Graph. 27 (2008) 63; Discrete viscous threads, ibid. 29
(2010) 116, for the model, the transport in time and the first derivatives. The second derivatives are derived here.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.algebra import (
    Vector,
    across,
    add,
    cross,
    dot,
    minus,
    mix,
    plus,
    scaled,
    store,
    symmetric_times,
    times,
    vector,
)
from darboux.kernels.band import FULL, LOWER, REACH
from darboux.kernels.jit import inline, jit

Array = NDArray[np.float64]

# The workspace of one spring: 8 numbers for each of these, then its Hessian by edges, 8 rows of 8, where AA is the
# block (e_a, e_a), AB is (e_a, e_b), BB is (e_b, e_b) and ANGLE is the row of theta_a. Below the diagonal blocks
# nothing is kept.
KAPPA1, KAPPA2, TWIST, CHI, PHI, AA = 0, 8, 16, 24, 32, 40
ROW = 8
AB, ANGLE, BB = AA + 4, AA + 3 * ROW, AA + 4 * ROW + 4
WORK = AA + 8 * ROW

AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

FOLDED = 1e-12  # chi below this: the tangents are antiparallel up to rounding, and the curvature is infinite


class State(NamedTuple):
    """Where a rod is. Edges count from the ghost 0 to the ghost N + 1."""

    x: Array  # (3 (N + 1)) vertices
    t: Array  # (3 (N + 2)) tangents of the edges
    d1: Array  # (3 (N + 2)) first directors of the edges
    m: Array  # (N + 1) last known twist at each vertex, which decides whole turns


class Elasticity(NamedTuple):
    """What resists. Numbers of a symmetric matrix come in the order 11, 22, 33, 23, 13, 12."""

    B: Array  # (6 (N + 1)) bending and twisting stiffness over the vertex's length, B / V
    kappa0: Array  # (3 (N + 1)) natural strain at each vertex, integrated over V
    l: Array  # (N) rest lengths of the edges 1 ... N
    EA: Array  # (N) stretching stiffness, or penalty of an inextensible rod
    T: Array  # (N) tension at the rest length, or multiplier of an inextensible rod
    first: int  # vertex of the first spring: 0 with a clamp in front, else 1
    stop: int  # one past the vertex of the last spring: N + 1 with a clamp behind, else N


class Loads(NamedTuple):
    """Dead forces f + C x on the vertices."""

    f: Array  # (3 (N + 1))
    C: Array  # (6 (N + 1)) symmetric, in the order 11, 22, 33, 23, 13, 12


# Frames


@inline
def edge(x: Array, j: int) -> Vector:
    """e_j = x_j - x_{j-1}"""
    e: Vector = mix(1.0, vector(x, 3 * j), -1.0, vector(x, 3 * j - 3))
    return e


@inline
def length(x: Array, j: int, edges: int) -> float:
    """|e_j|; infinite for a ghost, so that no step of a vertex turns it."""
    if j < 1 or j > edges:
        return np.inf
    e = edge(x, j)
    return math.sqrt(dot(e, e))


@inline
def unit(u: Vector) -> Vector:
    """u / |u|"""
    size = math.sqrt(dot(u, u))
    return u[0] / size, u[1] / size, u[2] / size


@inline
def transported(d: Vector, t: Vector, new: Vector) -> Vector:
    """d - (d.t') (t + t') / (1 + t.t'): the least rotation that takes t to t', applied to d across t."""
    s = dot(d, new) / (1.0 + dot(t, new))
    moved: Vector = mix(1.0, d, -s, mix(1.0, t, 1.0, new))
    return moved


@jit
def advance(old: State, step: Array, scale: float, new: State) -> None:
    """Move a rod by `scale` times a packed step: d1' = cos(theta) P d1 + sin(theta) t' x P d1, P the transport.

    Everything of `new` is written but its twists m, which `strains` does. A step that turns an edge exactly round, or
    shrinks it to nothing, leaves NaN in its frame, and `energy` calls that infinite.
    """
    x, t, d1, _ = old
    new_x, new_t, new_d1, _ = new
    edges = x.size // 3 - 1
    for i in range(edges + 1):
        store(new_x, 3 * i, mix(1.0, vector(x, 3 * i), scale, vector(step, 4 * i)))
    for j in (0, edges + 1):
        store(new_t, 3 * j, vector(t, 3 * j))
        store(new_d1, 3 * j, vector(d1, 3 * j))
    for j in range(1, edges + 1):
        tangent = unit(edge(new_x, j))
        director = unit(across(tangent, transported(vector(d1, 3 * j), vector(t, 3 * j), tangent)))
        theta = scale * step[4 * j - 1]
        store(new_t, 3 * j, tangent)
        store(new_d1, 3 * j, mix(math.cos(theta), director, math.sin(theta), cross(tangent, director)))


# Strains and energy


@inline
def turned(t: Vector, d1: Vector, c: float, s: float) -> tuple[Vector, Vector]:
    """The directors d1 and t x d1 of an edge, turned about t by the angle with the cosine c and the sine s."""
    d2 = cross(t, d1)
    return mix(c, d1, s, d2), mix(-s, d1, c, d2)


@inline
def strain(t: Array, d1: Array, m: Array, i: int) -> Vector:
    """kappa = (-2 a2'.b / chi, 2 a1'.b / chi, m) at vertex i; infinite where the rod folds on itself."""
    a, a1 = vector(t, 3 * i), vector(d1, 3 * i)
    b, b1 = vector(t, 3 * i + 3), vector(d1, 3 * i + 3)
    a2, b2 = cross(a, a1), cross(b, b1)
    chi = 1.0 + dot(a, b)
    if chi < FOLDED:
        return np.inf, np.inf, m[i]
    angle = math.atan2(dot(b1, a2) - dot(b2, a1), dot(a1, b1) + dot(a2, b2))
    twist = angle + 2.0 * math.pi * np.rint((m[i] - angle) / (2.0 * math.pi))
    c, s, r = math.cos(0.5 * twist), math.sin(0.5 * twist), 2.0 / chi
    u1, u2 = r * dot(a1, b), r * dot(a2, b)
    return s * u1 - c * u2, c * u1 + s * u2, twist


@jit
def strains(state: State, first: int, stop: int, kappa: Array) -> None:
    """The strain of every spring into kappa (3 (N + 1)), 0 where there is none; the twists also into the state."""
    _, t, d1, m = state
    kappa[:] = 0.0
    for i in range(first, stop):
        k = strain(t, d1, m, i)
        store(kappa, 3 * i, k)
        m[i] = k[2]


@inline
def load_energy(x: Array, f: Array, C: Array, i: int) -> float:
    """E_i = -(f.x_i + x_i.C x_i / 2)"""
    u = vector(x, 3 * i)
    work: float = dot(mix(1.0, vector(f, 3 * i), 0.5, symmetric_times(C, 6 * i, u)), u)
    return -work


@jit
def energy(state: State, rod: Elasticity, loads: Loads, parts: Array) -> float:
    """The energy, also split by what works: bending, twist, stretching, loads (4 numbers into `parts`).

    A coupling of bending and twist is shared half and half. Where the rod folds on itself or a frame is lost the
    energy is +inf, never NaN.
    """
    x, t, d1, m = state
    B, kappa0, l, EA, T, first, stop = rod
    f, C = loads
    parts[:] = 0.0
    edges = l.size
    for i in range(first, stop):
        s = mix(1.0, strain(t, d1, m, i), -1.0, vector(kappa0, 3 * i))
        mu = symmetric_times(B, 6 * i, s)
        parts[0] += 0.5 * (mu[0] * s[0] + mu[1] * s[1])
        parts[1] += 0.5 * mu[2] * s[2]
    for j in range(1, edges + 1):
        eps = length(x, j, edges) / l[j - 1] - 1.0
        parts[2] += (0.5 * EA[j - 1] * eps + T[j - 1]) * eps * l[j - 1]
    for i in range(edges + 1):
        parts[3] += load_energy(x, f, C, i)
    total: float = parts[0] + parts[1] + parts[2] + parts[3]
    return np.inf if math.isnan(total) else total


# Derivatives of a spring, in the turned frames of its own edges
#
# A direction moves across itself only: w_a has components along a1' and a2', w_b along b1' and b2'. With
#
#     x = kappa1 / 2     y = kappa2 / 2     z = (x, y)     delta = w_b - w_a     sigma = w_a + w_b     zeta = x delta2 - y delta1
#
# the rotation between these frames is (1, x, y, 0) / sqrt(1 + x^2 + y^2) as a quaternion, and the strains change by
#
#     d kappa1 = -delta2 - x zeta + y (theta_a + theta_b)     d kappa2 = delta1 - y zeta - x (theta_a + theta_b)
#     d m      = z.sigma + theta_b - theta_a
#
# The second derivatives, twice along the same step, of mu.kappa with the moments mu = (M, T) = B/V (kappa - kappa0) are
#
#     psi (delta^2 + zeta^2) - (M.delta)(z.delta) / 2 - (M.sigma)(z.sigma) / 2 - psi (z.sigma)^2 / 2 - psi Theta^2 / 2
#     + (M.delta - omega zeta) Theta - T (sigma1 delta2 - sigma2 delta1) / 2 - T zeta z.sigma
#
# where psi = M.z, omega = M1 y - M2 x and Theta = theta_a + theta_b. To derive it, expand to second order a -> a + w - |w|^2
# a / 2 and what is carried along, v -> v - (v.w) a - (v.w) w / 2. By edges, w = P e / |e| - (t.e) P e / |e|^2, which adds
# -(phi t^T + t phi^T) / |e| to every function of direction alone, phi its gradient by e.


@inline
def local_gradients(x: float, y: float) -> tuple[Vector, Vector, Vector, Vector, Vector, Vector]:
    """What each of (w_a, theta_a, w_b, theta_b) does to (kappa1, kappa2, m)."""
    p, q1, q2 = x * y, 1.0 + x * x, 1.0 + y * y
    return (-p, -q2, x), (q1, p, y), (y, -x, -1.0), (p, q2, x), (-q1, -p, y), (y, -x, 1.0)


@inline
def strain_gradients(
    work: Array, k: Vector, a: Vector, a1: Vector, ra: float, b: Vector, b1: Vector, rb: float
) -> None:
    """The gradients of kappa1, kappa2 and m by (e_a, theta_a, e_b, theta_b) into the workspace."""
    c, s = math.cos(0.5 * k[2]), math.sin(0.5 * k[2])
    f1, f2 = turned(a, a1, c, s)
    g1, g2 = turned(b, b1, c, -s)
    A1, A2, A3, B1, B2, B3 = local_gradients(0.5 * k[0], 0.5 * k[1])
    for p in range(3):
        o = ROW * p
        store(work, o, mix(ra * A1[p], f1, ra * A2[p], f2))
        store(work, o + 4, mix(rb * B1[p], g1, rb * B2[p], g2))
        work[o + 3], work[o + 7] = A3[p], B3[p]


@inline
def spring_gradient(work: Array, mu: Vector) -> None:
    """phi = mu1 grad kappa1 + mu2 grad kappa2 + mu3 grad m, into the workspace."""
    for p in range(8):
        work[PHI + p] = mu[0] * work[KAPPA1 + p] + mu[1] * work[KAPPA2 + p] + mu[2] * work[TWIST + p]


@inline
def store_edge(
    work: Array, o: int, g: int, phi: Vector, h11: float, h12: float, h22: float, h1: float, h2: float, h: float,
    t: Vector, d1: Vector, d2: Vector, r: float,
) -> None:  # fmt: skip
    """Gradient and Hessian by one edge and its angle: from its own frame, scaled by r = 1 / |e|, into the workspace."""
    f1, f2 = scaled(r, d1), scaled(r, d2)
    along = mix(phi[0], f1, phi[1], f2)
    store(work, g, along)
    work[g + 3] = phi[2]
    u1, u2 = mix(h11, f1, h12, f2), mix(h12, f1, h22, f2)
    u1, u2 = mix(1.0, u1, -r * phi[0], t), mix(1.0, u2, -r * phi[1], t)
    z = scaled(-r, along)
    for q in range(3):
        row = mix(1.0, mix(f1[q], u1, f2[q], u2), t[q], z)
        store(work, o + ROW * q, row)
        work[o + ROW * q + 3] = h1 * f1[q] + h2 * f2[q]
    work[o + 3 * ROW + 3] = h


@inline
def spring_hessian(
    work: Array, stiffness: Array, o: int, k: Vector, mu: Vector,
    a: Vector, a1: Vector, ra: float, b: Vector, b1: Vector, rb: float,
) -> None:  # fmt: skip
    """The gradient and the Hessian of a spring by edges, into the workspace."""
    x, y, (M1, M2, T) = 0.5 * k[0], 0.5 * k[1], mu
    p, q1, q2, psi, omega = x * y, 1.0 + x * x, 1.0 + y * y, M1 * x + M2 * y, M1 * y - M2 * x
    # (B/V) times what delta1, delta2, Theta and theta_b - theta_a do to the strains
    Y1, Y2 = symmetric_times(stiffness, o, (p, q2, 0.0)), symmetric_times(stiffness, o, (-q1, -p, 0.0))
    Y3, S = symmetric_times(stiffness, o, (y, -x, 0.0)), stiffness[o + 2]
    # (delta, delta), (sigma, sigma), (sigma, delta)
    r, shared = S - 0.5 * psi, 0.25 * (M1 * y + M2 * x)
    d11, d22 = p * Y1[0] + q2 * (Y1[1] + psi) - 0.5 * M1 * x, q1 * (psi - Y2[0]) - p * Y2[1] - 0.5 * M2 * y
    d12 = p * (Y2[0] - psi) + q2 * Y2[1] - shared
    s11, s12, s22 = r * x * x - 0.5 * M1 * x, r * p - shared, r * y * y - 0.5 * M2 * y
    c11, c12 = x * Y1[2] + 0.5 * T * p, x * Y2[2] - 0.5 * T * (q1 - 0.5)
    c21, c22 = y * Y1[2] + 0.5 * T * (q2 - 0.5), y * Y2[2] - 0.5 * T * p
    # with Theta and with theta_b - theta_a
    n1 = p * Y3[0] + q2 * Y3[1] + 0.5 * (M1 + omega * y)
    n2 = -q1 * Y3[0] - p * Y3[1] + 0.5 * (M2 - omega * x)
    both, either = y * Y3[0] - x * Y3[1] - 0.5 * psi + S, 2.0 * Y3[2]
    up1, up2, down1, down2 = (Y3[2] + S) * x, (Y3[2] + S) * y, (Y3[2] - S) * x, (Y3[2] - S) * y
    cosine, sine = math.cos(0.5 * k[2]), math.sin(0.5 * k[2])
    f1, f2 = turned(a, a1, cosine, sine)
    g1, g2 = turned(b, b1, cosine, -sine)
    A1, A2, A3, B1, B2, B3 = local_gradients(x, y)
    store_edge(
        work, AA, PHI, (dot(mu, A1), dot(mu, A2), dot(mu, A3)),
        d11 + s11 - 2.0 * c11, d12 + s12 - c12 - c21, d22 + s22 - 2.0 * c22,
        down1 - n1 + Y1[2], down2 - n2 + Y2[2], both - either, a, f1, f2, ra,
    )  # fmt: skip
    store_edge(
        work, BB, PHI + 4, (dot(mu, B1), dot(mu, B2), dot(mu, B3)),
        d11 + s11 + 2.0 * c11, d12 + s12 + c12 + c21, d22 + s22 + 2.0 * c22,
        up1 + n1 + Y1[2], up2 + n2 + Y2[2], both + either, b, g1, g2, rb,
    )  # fmt: skip
    f1, f2, g1, g2 = scaled(ra, f1), scaled(ra, f2), scaled(rb, g1), scaled(rb, g2)
    skew = c12 - c21
    v1, v2 = mix(s11 - d11, g1, s12 - d12 + skew, g2), mix(s12 - d12 - skew, g1, s22 - d22, g2)
    by1, by2 = up1 - n1 - Y1[2], up2 - n2 - Y2[2]
    for q in range(3):
        store(work, AB + ROW * q, mix(f1[q], v1, f2[q], v2))
        work[AB + ROW * q + 3] = by1 * f1[q] + by2 * f2[q]
    store(work, ANGLE + 4, mix(down1 + n1 - Y1[2], g1, down2 + n2 - Y2[2], g2))
    work[ANGLE + 7] = both - 2.0 * S


# Assembly: by e_a = x - x_- and e_b = x_+ - x from edges to vertices


@inline
def add_spring_gradient(gradient: Array, work: Array, i: int, edges: int) -> None:
    """phi to the gradient. A ghost has no unknowns: its angle is left out, and its edge has no share in phi."""
    o = 4 * i
    if i > 0:
        add(gradient, o - 4, scaled(-1.0, vector(work, PHI)))
        gradient[o - 1] += work[PHI + 3]
    add(gradient, o, mix(1.0, vector(work, PHI), -1.0, vector(work, PHI + 4)))
    if i < edges:
        gradient[o + 3] += work[PHI + 7]
        add(gradient, o + 4, vector(work, PHI + 4))


@inline
def add_upper(lower: Array, o: int, u: Vector, v: Vector, w: Vector) -> None:
    """The diagonal block at unknown o, from the upper halves of its rows: (u1, u2, u3), (v2, v3), (w3)."""
    column = LOWER * o
    add(lower, column, u)
    lower[column + LOWER] += v[1]
    lower[column + LOWER + 1] += v[2]
    lower[column + 2 * LOWER] += w[2]


@inline
def column_of(work: Array, o: int) -> Vector:
    """Three numbers of the workspace's Hessian, one below the other."""
    return work[o], work[o + ROW], work[o + 2 * ROW]


@inline
def at_vertex(work: Array, q: int) -> Vector:
    """Row q of aa - ab - ba + bb."""
    ends = plus(vector(work, AA + ROW * q), vector(work, BB + ROW * q))
    return minus(ends, plus(vector(work, AB + ROW * q), column_of(work, AB + q)))


@inline
def add_at_vertex(lower: Array, work: Array, o: int) -> None:
    """(x, x) += aa - ab - ba + bb"""
    add_upper(lower, o, at_vertex(work, 0), at_vertex(work, 1), at_vertex(work, 2))


@inline
def add_in_front(lower: Array, work: Array, o: int) -> None:
    """(x_-, x_-) += aa, (x, x_-) += ba - aa, and the angle theta_a with x_- and x alike."""
    add_upper(lower, o - 4, vector(work, AA), vector(work, AA + ROW), vector(work, AA + 2 * ROW))
    for q in range(3):
        column = LOWER * (o - 4 + q) - q
        lower[column + 3] -= work[AA + ROW * q + 3]
        add(lower, column + 4, minus(vector(work, AB + ROW * q), vector(work, AA + ROW * q)))
    column = LOWER * (o - 1)
    lower[column] += work[ANGLE + 3]
    add(lower, column + 1, minus(column_of(work, AA + 3), vector(work, ANGLE + 4)))


@inline
def add_behind(lower: Array, work: Array, o: int) -> None:
    """(x_+, x_+) += bb, (x_+, x) += ba - bb, and the angle theta_b with x and x_+ alike."""
    add_upper(lower, o + 4, vector(work, BB), vector(work, BB + ROW), vector(work, BB + 2 * ROW))
    for q in range(3):
        column = LOWER * (o + q) - q
        lower[column + 3] += work[AB + ROW * q + 3] - work[BB + ROW * q + 3]
        add(lower, column + 4, minus(vector(work, AB + ROW * q), vector(work, BB + ROW * q)))
    column = LOWER * (o + 3)
    lower[column] += work[BB + 3 * ROW + 3]
    add(lower, column + 1, column_of(work, BB + 3))


@inline
def add_over(lower: Array, work: Array, o: int) -> None:
    """(x_+, x_-) -= ba, and theta_b with x_-, x_+ with theta_a, theta_b with theta_a: over the vertex."""
    for q in range(3):
        column = LOWER * (o - 4 + q) - q
        lower[column + 7] -= work[AB + ROW * q + 3]
        add(lower, column + 8, scaled(-1.0, vector(work, AB + ROW * q)))
    column = LOWER * (o - 1) + 4
    lower[column] += work[ANGLE + 7]
    add(lower, column + 1, vector(work, ANGLE + 4))


@inline
def add_spring_hessian(lower: Array, work: Array, i: int, edges: int) -> None:
    """Blocks by edges become blocks by vertices. Vertex 0 has no x_- and theta_a, vertex N no theta_b and x_+."""
    add_at_vertex(lower, work, 4 * i)
    if i > 0:
        add_in_front(lower, work, 4 * i)
    if i < edges:
        add_behind(lower, work, 4 * i)
        if i > 0:
            add_over(lower, work, 4 * i)


@inline
def rows_of(s: float, u: Vector, r: float) -> tuple[Vector, Vector, Vector]:
    """s I + r u u^T, row by row."""
    v = scaled(r, u)
    h1, h2, h3 = scaled(u[0], v), scaled(u[1], v), scaled(u[2], v)
    return (h1[0] + s, h1[1], h1[2]), (h2[0], h2[1] + s, h2[2]), (h3[0], h3[1], h3[2] + s)


@inline
def stretching(t: Vector, size: float, l: float, EA: float, T: float) -> tuple[Vector, Vector, Vector, Vector, float]:
    """E' = tau t, E'' = (tau / |e|) P_t + (EA / l) t t^T row by row, and E, by an edge e = |e| t, with tau = EA eps + T."""
    eps = size / l - 1.0
    tau = EA * eps + T
    s = tau / size
    h1, h2, h3 = rows_of(s, t, EA / l - s)
    return scaled(tau, t), h1, h2, h3, (0.5 * EA * eps + T) * eps * l


@inline
def add_stretching(
    t: Array, size: float, l: Array, EA: Array, T: Array, j: int, gradient: Array, lower: Array
) -> float:
    """The stretching of edge j, with no spring in front of it: its share of gradient and Hessian; returns its energy."""
    phi, h1, h2, h3, value = stretching(vector(t, 3 * j), size, l[j - 1], EA[j - 1], T[j - 1])
    o = 4 * j
    add(gradient, o - 4, scaled(-1.0, phi))
    add(gradient, o, phi)
    add_upper(lower, o - 4, h1, h2, h3)
    add_upper(lower, o, h1, h2, h3)
    between = LOWER * (o - 4) + 4  # x_j below x_{j-1}
    add(lower, between, scaled(-1.0, h1))
    add(lower, between + REACH, scaled(-1.0, h2))
    add(lower, between + 2 * REACH, scaled(-1.0, h3))
    return value


@inline
def add_spring(
    t: Array, d1: Array, m: Array, B: Array, kappa0: Array, l: Array, EA: Array, T: Array, i: int, size_a: float, size_b: float,
    work: Array, gradient: Array, lower: Array,
) -> float:  # fmt: skip
    """Vertex i's spring, with the stretching of the edge behind it: their share of gradient and Hessian; returns their energy."""
    edges = l.size
    k = strain(t, d1, m, i)
    s = mix(1.0, k, -1.0, vector(kappa0, 3 * i))
    mu = symmetric_times(B, 6 * i, s)
    a, a1 = vector(t, 3 * i), vector(d1, 3 * i)
    b, b1 = vector(t, 3 * i + 3), vector(d1, 3 * i + 3)
    spring_hessian(work, B, 6 * i, k, mu, a, a1, 1.0 / size_a, b, b1, 1.0 / size_b)
    value: float = 0.5 * dot(mu, s)
    if i < edges:
        phi, h1, h2, h3, stretched = stretching(b, size_b, l[i], EA[i], T[i])
        add(work, PHI + 4, phi)
        add(work, BB, h1)
        add(work, BB + ROW, h2)
        add(work, BB + 2 * ROW, h3)
        value += stretched
    add_spring_gradient(gradient, work, i, edges)
    add_spring_hessian(lower, work, i, edges)
    return value


@inline
def add_symmetric(lower: Array, o: int, s: float, u: Vector, r: float) -> None:
    """H += s I + r u u^T, H the diagonal block of the vertex at unknown o."""
    h1, h2, h3 = rows_of(s, u, r)
    add_upper(lower, o, h1, h2, h3)


@inline
def add_loads(x: Array, f: Array, C: Array, i: int, gradient: Array, lower: Array) -> float:
    """E' = -(f + C x), E'' = -C at vertex i; returns E."""
    o = 6 * i
    add(gradient, 4 * i, mix(-1.0, vector(f, 3 * i), -1.0, symmetric_times(C, o, vector(x, 3 * i))))
    c, d = vector(C, o), vector(C, o + 3)  # 11, 22, 33 and 23, 13, 12
    add_upper(lower, 4 * i, (-c[0], -d[2], -d[1]), (-d[2], -c[1], -d[0]), (-d[1], -d[0], -c[2]))
    value: float = load_energy(x, f, C, i)
    return value


@jit
def energy_gradient_hessian(
    state: State, rod: Elasticity, loads: Loads, work: Array, gradient: Array, lower: Array
) -> float:
    """The energy with its exact gradient (4 N + 3) and Hessian (lower band, 11 (4 N + 3)) at the step 0.

    Where the rod folds on itself the energy is +inf and the derivatives are not numbers.
    """
    x, t, d1, m = state
    B, kappa0, l, EA, T, first, stop = rod
    f, C = loads
    gradient[:] = 0.0
    lower[:] = 0.0
    total, behind = 0.0, np.inf
    for i in range(l.size + 1):
        in_front, behind = behind, length(x, i + 1, l.size)
        if first <= i < stop:
            total += add_spring(t, d1, m, B, kappa0, l, EA, T, i, in_front, behind, work, gradient, lower)
        elif i < l.size:
            total += add_stretching(t, behind, l, EA, T, i + 1, gradient, lower)
        total += add_loads(x, f, C, i, gradient, lower)
    return np.inf if math.isnan(total) else total


# Couples and loads that follow the shape, which have no energy


@inline
def add_couple_tangent(general: Array, o: int, q: int, by_edge: Vector, by_angle: float) -> None:
    """Column q of the tangent by e, from edge to vertices: x at unknown o, its angle before it, x_- before that."""
    column = FULL * (o + q) + REACH - q
    before = column - 4 * FULL
    general[column - 1] += by_angle
    general[before + 3] -= by_angle
    for p in range(3):
        general[column + p] += by_edge[p]
        general[column + p - 4] -= by_edge[p]
        general[before + p + 4] -= by_edge[p]
        general[before + p] += by_edge[p]


@jit
def add_couples(state: State, M: Array, residual: Array, general: Array) -> None:
    """Add residual and tangent of dead couples M (3 N, fixed frame) on the edges, to a gradient and a general band.

    Off the step 0, whose tangent is t0, an edge turns by d phi = t x dt + (d theta - (t0 x t).dt / (1 + t0.t)) t, less
    than theta by the solid angle that t sweeps about t0. Minus the work M.d phi is, by d theta and by de,

        residual   -M.t on theta             -M x t / |e| on e
        tangent    -P M / |e| of theta by e  -([M]_x (I - 2 t t^T) - (M.t) [t]_x / 2) / |e|^2 of e by e

    The tangent is not symmetric: to turn the edge about two axes in turn takes a work that depends on their order.
    """
    x, tangents, _, _ = state
    for j in range(1, M.size // 3 + 1):
        couple, t, e = vector(M, 3 * j - 3), vector(tangents, 3 * j), edge(x, j)
        r = 1.0 / math.sqrt(dot(e, e))
        along = dot(couple, t)
        force, by_angle = scaled(r, cross(couple, t)), scaled(-r, across(t, couple))
        add(residual, 4 * j - 4, force)
        add(residual, 4 * j, scaled(-1.0, force))
        residual[4 * j - 1] -= along
        for q in range(3):
            u = AXES[q]
            mirrored = mix(1.0, u, -2.0 * t[q], t)
            by_edge = scaled(-r * r, mix(1.0, cross(couple, mirrored), -0.5 * along, cross(t, u)))
            add_couple_tangent(general, 4 * j, q, by_edge, by_angle[q])


@jit
def add_edge_loads(
    state: State,
    F: Array,
    F_r: Array,
    F_phi: Array,
    M: Array,
    M_r: Array,
    M_phi: Array,
    residual: Array,
    general: Array,
) -> None:
    """Add the loads that follow the shape: forces F (6 N) on the two vertices of each edge, couples M (3 N) on it.

    F_r, F_phi (18 N) and M_r, M_phi (9 N) are their derivatives, row by row, by the middle of the edge and by a small
    rotation d phi = t x de / |e| + d theta t of it, in the fixed frame. The work is F.dx on a vertex and M.d phi on an
    edge; what a couple adds where it stands still is `add_couples`'.
    """
    x, tangents, _, _ = state
    for j in range(1, M.size // 3 + 1):
        t, e, first = vector(tangents, 3 * j), edge(x, j), 4 * j - 4
        r = 1.0 / math.sqrt(dot(e, e))
        add(residual, first, scaled(-1.0, vector(F, 6 * j - 6)))
        add(residual, first + 4, scaled(-1.0, vector(F, 6 * j - 3)))
        for q in range(7):
            dr, dphi = (0.0, 0.0, 0.0), t
            if q != 3:
                u = AXES[q % 4]
                dr, dphi = scaled(0.5, u), scaled(r if q > 3 else -r, cross(t, u))
            column = FULL * (first + q) + REACH - q
            dM = plus(times(M_r, 9 * j - 9, dr), times(M_phi, 9 * j - 9, dphi))
            pair = scaled(r, cross(dM, t))
            behind = plus(times(F_r, 18 * j - 18, dr), times(F_phi, 18 * j - 18, dphi))
            ahead = plus(times(F_r, 18 * j - 9, dr), times(F_phi, 18 * j - 9, dphi))
            add(general, column, mix(1.0, pair, -1.0, behind))
            add(general, column + 4, mix(-1.0, pair, -1.0, ahead))
            general[column + 3] -= dot(dM, t)


# Shapes from frames


@jit
def chain_frames(kappa: Array, q: Array) -> None:
    """Quaternions q (4 (N + 2)) of the edges, q_0 = 1, whose springs have the strains kappa (3 (N + 1)).

    q_b = q_a p,  p = (cos(m/2), kappa1 / 2, kappa2 / 2, sin(m/2)) / |.|
    """
    q[0], q[1], q[2], q[3] = 1.0, 0.0, 0.0, 0.0
    for i in range(kappa.size // 3):
        c, s = math.cos(0.5 * kappa[3 * i + 2]), math.sin(0.5 * kappa[3 * i + 2])
        x, y = 0.5 * kappa[3 * i], 0.5 * kappa[3 * i + 1]
        r = 1.0 / math.sqrt(1.0 + x * x + y * y)
        w0, x0, y0, z0 = q[4 * i], q[4 * i + 1], q[4 * i + 2], q[4 * i + 3]
        q[4 * i + 4] = r * (w0 * c - x0 * x - y0 * y - z0 * s)
        q[4 * i + 5] = r * (w0 * x + x0 * c + y0 * s - z0 * y)
        q[4 * i + 6] = r * (w0 * y - x0 * s + y0 * c + z0 * x)
        q[4 * i + 7] = r * (w0 * s + x0 * y - y0 * x + z0 * c)


@jit
def turning_step(
    x: Array,
    l: Array,
    step: Array,
    scale: float,
    inextensible: bool,
    start: bool,
    end: bool,
    frozen: int,
    turned: Array,
) -> None:
    """The packed step that turns edges where `step`, times `scale`, moves their ends along straight lines.

        e -> (|e| + t.de) (cos|w| t + sin|w| w / |w|),   w = P de / |e|

    It agrees with `step` to first order, but does not stretch an edge that turns; an inextensible rod's edges get
    their rest length l. Vertices are joined from the held end; where both are held the gap is shared by all
    edges but the ``frozen`` (0 or 1) at either end, which are part of their clamps.
    """
    edges = l.size
    for q in range(3):
        turned[q] = scale * step[q]
    for j in range(1, edges + 1):
        e, o = edge(x, j), 4 * j
        de = mix(scale, vector(step, o), -scale, vector(step, o - 4))
        size = math.sqrt(dot(e, e))
        t = scaled(1.0 / size, e)
        w = scaled(1.0 / size, across(t, de))
        angle = math.sqrt(dot(w, w))
        sinc = math.sin(angle) / angle if angle > 1e-8 else 1.0
        new = l[j - 1] if inextensible else size + dot(t, de)
        moved = mix(1.0, mix(new * math.cos(angle), t, new * sinc, w), -1.0, e)
        store(turned, o, mix(1.0, vector(turned, o - 4), 1.0, moved))
        turned[o - 1] = scale * step[o - 1]
    if not end:
        return
    gap = mix(scale, vector(step, 4 * edges), -1.0, vector(turned, 4 * edges))
    for j in range(edges + 1):
        share = min(max((j - frozen) / max(edges - 2 * frozen, 1), 0.0), 1.0) if start else 1.0
        store(turned, 4 * j, mix(1.0, vector(turned, 4 * j), share, gap))


@jit
def largest_turn(l: Array, step: Array) -> float:
    """The largest |de| / l or |d theta| of an edge in a packed step, or |dx| of a vertex; not a number if one is none."""
    largest = 0.0
    for j in range(l.size + 1):
        dx = vector(step, 4 * j)
        size = math.sqrt(dot(dx, dx))
        if j > 0:
            de = mix(1.0, dx, -1.0, vector(step, 4 * j - 4))
            size = max(size, abs(step[4 * j - 1]), math.sqrt(dot(de, de)) / l[j - 1])
        if not math.isfinite(size):
            return np.nan
        largest = max(largest, size)
    return largest
