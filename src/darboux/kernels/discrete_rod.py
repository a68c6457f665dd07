"""Discrete elastic rods: energy, gradient and exact Hessian, in units that the caller made dimensionless.

A rod of N edges has the vertices x_0 ... x_N. Edge j lies between x_{j-1} and x_j, j = 1 ... N; it carries the
directors d1, d2 and its tangent t = d1 x d2. Two ghost edges, 0 and N + 1, are the fixed frames of clamps at the end
vertices. Where two edges meet at vertex i, a in front of it and b behind, a spring resists the strains

    kappa1 = (a.b2 - b.a2) / chi      kappa2 = (b.a1 - a.b1) / chi      chi = 1 + a.b
    m      = atan2(b1.a2 - b2.a1, a1.b1 + a2.b2) + 2 pi w
    E_i    = 1/2 (kappa - kappa0).B/V (kappa - kappa0)         kappa = (kappa1, kappa2, m)

with V the length of rod that belongs to the vertex (half a cell at a clamp, which makes the clamp second order), and
w the whole turns that keep m next to its last value. Edges stretch, and vertices carry affine loads:

    E_j = (EA eps^2 / 2 + T eps) l       eps = |x_j - x_{j-1}| / l - 1
    E_i = -(f.x_i + x_i.C x_i / 2)

The unknowns are packed x_0, theta_1, x_1, theta_2, ..., x_N, so that vertex i is at 4 i, the angle of edge j at
4 j - 1, and the Hessian is a band of half-bandwidth 10 (see band.py).

The chart: a step (dx, theta) carries each edge's directors from the old tangent to the new by parallel transport in
time, then turns them by theta about the new tangent. Derivatives are taken at the step 0, and the state moves along
with each accepted step (`advance`). They are exact in this chart, holonomy included.

Notation of the derivatives: w_a is a change of the unit tangent a (perpendicular to it), e_a one of the edge vector,
P_a = I - a a^T, and r_a = 1 / |a| the edge's inverse length. By edges a spring has eight unknowns, (e_a, theta_a, e_b,
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
KAPPA1, KAPPA2, TWIST, CHI, PHI, SIGMA, AA = 0, 8, 16, 24, 32, 40, 48
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
def strain(t: Array, d1: Array, m: Array, i: int) -> Vector:
    """kappa = ((a.b2 - b.a2) / chi, (b.a1 - a.b1) / chi, m) at vertex i; infinite where the rod folds on itself."""
    a, a1 = vector(t, 3 * i), vector(d1, 3 * i)
    b, b1 = vector(t, 3 * i + 3), vector(d1, 3 * i + 3)
    a2, b2 = cross(a, a1), cross(b, b1)
    chi = 1.0 + dot(a, b)
    if chi < FOLDED:
        return np.inf, np.inf, m[i]
    angle = math.atan2(dot(b1, a2) - dot(b2, a1), dot(a1, b1) + dot(a2, b2))
    turns = np.rint((m[i] - angle) / (2.0 * math.pi))
    return (dot(a, b2) - dot(b, a2)) / chi, (dot(b, a1) - dot(a, b1)) / chi, angle + 2.0 * math.pi * turns


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


# First derivatives of a spring


@inline
def strain_gradients(
    work: Array, k: Vector, a: Vector, a1: Vector, ra: float, b: Vector, b1: Vector, rb: float
) -> None:
    """The gradients of kappa1, kappa2, m and chi by (e_a, theta_a, e_b, theta_b) into the workspace.

    d kappa1 = ( w_a.(b2 + c a2 - kappa1 b) - w_b.(a2 + c b2 + kappa1 a) + theta_a b.a1 - theta_b a.b1) / chi
    d kappa2 = (-w_a.(b1 + c a1 + kappa2 b) + w_b.(a1 + c b1 - kappa2 a) + theta_a b.a2 - theta_b a.b2) / chi
    d m      = kb.(w_a + w_b) / 2 + theta_b - theta_a               kb = 2 a x b / chi, c = a.b
    d chi    = w_a.b + w_b.a                                        w = P e / |e| = r P e
    """
    a2, b2, c = cross(a, a1), cross(b, b1), dot(a, b)
    per_chi = 1.0 / (1.0 + c)
    half_kb = scaled(per_chi, cross(a, b))
    sa, sb = ra * per_chi, rb * per_chi
    store(work, KAPPA1, scaled(sa, across(a, mix(1.0, mix(1.0, b2, c, a2), -k[0], b))))
    store(work, KAPPA1 + 4, scaled(-sb, across(b, mix(1.0, mix(1.0, a2, c, b2), k[0], a))))
    store(work, KAPPA2, scaled(-sa, across(a, mix(1.0, mix(1.0, b1, c, a1), k[1], b))))
    store(work, KAPPA2 + 4, scaled(sb, across(b, mix(1.0, mix(1.0, a1, c, b1), -k[1], a))))
    store(work, TWIST, scaled(ra, half_kb))
    store(work, TWIST + 4, scaled(rb, half_kb))
    store(work, CHI, scaled(ra, across(a, b)))
    store(work, CHI + 4, scaled(rb, across(b, a)))
    work[KAPPA1 + 3], work[KAPPA1 + 7] = per_chi * dot(b, a1), -per_chi * dot(a, b1)
    work[KAPPA2 + 3], work[KAPPA2 + 7] = per_chi * dot(b, a2), -per_chi * dot(a, b2)
    work[TWIST + 3], work[TWIST + 7] = -1.0, 1.0
    work[CHI + 3], work[CHI + 7] = 0.0, 0.0


@inline
def spring_gradient(work: Array, mu: Vector) -> None:
    """phi = mu1 grad kappa1 + mu2 grad kappa2 + mu3 grad m, into the workspace."""
    for p in range(8):
        work[PHI + p] = mu[0] * work[KAPPA1 + p] + mu[1] * work[KAPPA2 + p] + mu[2] * work[TWIST + p]


# Second derivatives of a spring
#
# With Av = mu1 a2 - mu2 a1, Bv = mu1 b2 - mu2 b1, psi = mu1 kappa1 + mu2 kappa2 = (a.Bv - b.Av) / chi, A = Av / |a| and
# B = Bv / |b|, the Hessian of the spring's energy by (e_a, theta_a, e_b, theta_b) is
#
#     sum_kl (B/V)_kl grad kappa_k grad kappa_l^T - sigma chi'^T - chi' sigma^T + remainder
#     sigma = (mu1 grad kappa1 + mu2 grad kappa2 + (mu3 kb / 4|a| - A / 2, 0, mu3 kb / 4|b| + B / 2, 0)) / chi
#
# and the remainder is short (`add_direction`, `add_coupling`, `add_angles`). To derive it, expand to second order
# a -> a + w - |w|^2 a / 2, its transported Av -> Av - (Av.w) a - (Av.w) w / 2, and w = P e / |e| - (t.e) P e / |e|^2.


@inline
def spring_sigma(work: Array, per_chi: float, mu: Vector, A: Vector, B: Vector) -> None:
    """sigma, the factor of chi' in the Hessian, into the workspace."""
    for p in range(8):
        work[SIGMA + p] = per_chi * (mu[0] * work[KAPPA1 + p] + mu[1] * work[KAPPA2 + p])
    half = 0.5 * per_chi
    add(work, SIGMA, mix(half * mu[2], vector(work, TWIST), -half, A))
    add(work, SIGMA + 4, mix(half * mu[2], vector(work, TWIST + 4), half, B))


@inline
def product(work: Array, q: int, y: Vector, s: float, x: float) -> float:
    """Entry q of a row of sum_k y_k grad kappa_k - s chi' - x sigma."""
    stiff = y[0] * work[KAPPA1 + q] + y[1] * work[KAPPA2 + q] + y[2] * work[TWIST + q]
    entry: float = stiff - s * work[CHI + q] - x * work[SIGMA + q]
    return entry


@inline
def spring_products(work: Array, stiffness: Array, o: int) -> None:
    """sum_kl (B/V)_kl grad kappa_k grad kappa_l^T - sigma chi'^T - chi' sigma^T, into the Hessian, four at a time."""
    for p in range(8):
        y = symmetric_times(stiffness, o, (work[KAPPA1 + p], work[KAPPA2 + p], work[TWIST + p]))
        s, x = work[SIGMA + p], work[CHI + p]
        if p < 4:
            h = AA + ROW * p
            work[h], work[h + 1], work[h + 2], work[h + 3] = (
                product(work, 0, y, s, x), product(work, 1, y, s, x),
                product(work, 2, y, s, x), product(work, 3, y, s, x),
            )  # fmt: skip
        h = AB + ROW * p
        work[h], work[h + 1], work[h + 2], work[h + 3] = (
            product(work, 4, y, s, x), product(work, 5, y, s, x),
            product(work, 6, y, s, x), product(work, 7, y, s, x),
        )  # fmt: skip


@inline
def add_outer(work: Array, o: int, u: Vector, v: Vector) -> None:
    """H += u v^T, H the 3 x 3 block at work[o:]."""
    add(work, o, scaled(u[0], v))
    add(work, o + ROW, scaled(u[1], v))
    add(work, o + 2 * ROW, scaled(u[2], v))


@inline
def add_column(work: Array, o: int, u: Vector) -> None:
    """H += u, H the column of three at work[o:]."""
    work[o] += u[0]
    work[o + ROW] += u[1]
    work[o + 2 * ROW] += u[2]


@inline
def add_direction(work: Array, o: int, phi: Vector, s: float, t: Vector, r: float) -> None:
    """H_aa += s P_a / |a|^2 - (phi_a a^T + a phi_a^T) / |a|, the latter for every function of direction alone."""
    s *= r * r
    half = mix(-r, phi, -0.5 * s, t)
    add_outer(work, o, half, t)
    add_outer(work, o, t, half)
    add_column(work, o, (s, 0.0, 0.0))
    add_column(work, o + 1, (0.0, s, 0.0))
    add_column(work, o + 2, (0.0, 0.0, s))


@inline
def add_coupling(
    work: Array, psi: float, twist: float, a: Vector, A: Vector, ra: float, b: Vector, B: Vector, rb: float
) -> None:
    """H_ab += (A chi_b'^T - chi_a' B^T) / 2 chi + P_a ([mu3 (a + b) / 2]_x - psi I) P_b / (chi |a||b|)."""
    c = dot(a, b)
    per_chi = 1.0 / (1.0 + c)
    s = ra * rb * per_chi
    nu, psi = 0.5 * s * twist, s * psi
    turn, n = scaled(nu, cross(a, b)), mix(nu, a, nu, b)
    add_outer(work, AB, scaled(0.5 * per_chi, A), vector(work, CHI + 4))
    add_outer(work, AB, vector(work, CHI), scaled(-0.5 * per_chi, B))
    add_outer(work, AB, a, mix(1.0, mix(psi, a, -psi * c, b), -1.0, turn))
    add_outer(work, AB, mix(psi, b, -1.0, turn), b)
    add(work, AB, (-psi, -n[2], n[1]))
    add(work, AB + ROW, (n[2], -psi, -n[0]))
    add(work, AB + 2 * ROW, (-n[1], n[0], -psi))


@inline
def add_angles(work: Array, a: Vector, Av: Vector, ra: float, b: Vector, Bv: Vector, rb: float) -> None:
    """What the angles add, with Av' = a x Av and Bv' = b x Bv.

    (e_a, th_a)  c Av'/chi|a|       (e_a, th_b)  P_a Bv'/chi|a|     (th_a, th_a)  b.Av/chi
    (th_a, e_b)  -P_b Av'/chi|b|    (e_b, th_b)  -c Bv'/chi|b|      (th_b, th_b)  -a.Bv/chi
    """
    c = dot(a, b)
    per_chi = 1.0 / (1.0 + c)
    turned_a, turned_b = scaled(per_chi, cross(a, Av)), scaled(per_chi, cross(b, Bv))
    add_column(work, AA + 3, scaled(c * ra, turned_a))
    add_column(work, AB + 3, scaled(ra, across(a, turned_b)))
    add_column(work, BB + 3, scaled(-c * rb, turned_b))
    add(work, ANGLE + 4, scaled(-rb, across(b, turned_a)))
    work[ANGLE + 3] += per_chi * dot(b, Av)
    work[BB + 3 * ROW + 3] -= per_chi * dot(a, Bv)


@inline
def spring_hessian(
    work: Array, stiffness: Array, o: int, k: Vector, mu: Vector,
    a: Vector, a1: Vector, ra: float, b: Vector, b1: Vector, rb: float,
) -> None:  # fmt: skip
    """The Hessian of a spring by edges, into the workspace."""
    c = dot(a, b)
    per_chi = 1.0 / (1.0 + c)
    Av, Bv = mix(mu[0], cross(a, a1), -mu[1], a1), mix(mu[0], cross(b, b1), -mu[1], b1)
    A, B = scaled(ra, Av), scaled(rb, Bv)
    psi = mu[0] * k[0] + mu[1] * k[1]
    spring_sigma(work, per_chi, mu, A, B)
    spring_products(work, stiffness, o)
    add_direction(work, AA, vector(work, PHI), per_chi * (psi * c - dot(a, Bv)), a, ra)
    add_direction(work, BB, vector(work, PHI + 4), per_chi * (psi * c + dot(b, Av)), b, rb)
    add_coupling(work, psi, mu[2], a, A, ra, b, B, rb)
    add_angles(work, a, Av, ra, b, Bv, rb)


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
def add_at_vertex(lower: Array, work: Array, o: int) -> None:
    """(x, x) += aa - ab - ba + bb"""
    for q in range(3):
        for p in range(q, 3):
            ends = work[AA + ROW * q + p] + work[BB + ROW * q + p]
            lower[LOWER * (o + q) + p - q] += ends - work[AB + ROW * q + p] - work[AB + ROW * p + q]


@inline
def add_in_front(lower: Array, work: Array, o: int) -> None:
    """(x_-, x_-) += aa, (x, x_-) += ba - aa, and the angle theta_a with x_- and x alike."""
    for q in range(3):
        column = LOWER * (o - 4 + q) - q
        for p in range(q, 3):
            lower[column + p] += work[AA + ROW * q + p]
        lower[column + 3] -= work[AA + ROW * q + 3]
        for p in range(3):
            lower[column + 4 + p] += work[AB + ROW * q + p] - work[AA + ROW * q + p]
    column = LOWER * (o - 1)
    lower[column] += work[ANGLE + 3]
    for p in range(3):
        lower[column + 1 + p] += work[AA + ROW * p + 3] - work[ANGLE + 4 + p]


@inline
def add_behind(lower: Array, work: Array, o: int) -> None:
    """(x_+, x_+) += bb, (x_+, x) += ba - bb, and the angle theta_b with x and x_+ alike."""
    for q in range(3):
        column = LOWER * (o + q) - q
        lower[column + 3] += work[AB + ROW * q + 3] - work[BB + ROW * q + 3]
        for p in range(3):
            lower[column + 4 + p] += work[AB + ROW * q + p] - work[BB + ROW * q + p]
        for p in range(q, 3):
            lower[column + 4 * LOWER + p] += work[BB + ROW * q + p]
    column = LOWER * (o + 3)
    lower[column] += work[BB + 3 * ROW + 3]
    for p in range(3):
        lower[column + 1 + p] += work[BB + ROW * p + 3]


@inline
def add_over(lower: Array, work: Array, o: int) -> None:
    """(x_+, x_-) -= ba, and theta_b with x_-, x_+ with theta_a, theta_b with theta_a: over the vertex."""
    for q in range(3):
        column = LOWER * (o - 4 + q) - q
        lower[column + 7] -= work[AB + ROW * q + 3]
        for p in range(3):
            lower[column + 8 + p] -= work[AB + ROW * q + p]
    column = LOWER * (o - 1) + 4
    lower[column] += work[ANGLE + 7]
    for p in range(3):
        lower[column + 1 + p] += work[ANGLE + 4 + p]


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
def add_spring(
    x: Array, t: Array, d1: Array, m: Array, B: Array, kappa0: Array, i: int,
    work: Array, gradient: Array, lower: Array,
) -> float:  # fmt: skip
    """Vertex i's spring: its share of gradient and Hessian; returns its energy."""
    edges = x.size // 3 - 1
    k = strain(t, d1, m, i)
    s = mix(1.0, k, -1.0, vector(kappa0, 3 * i))
    mu = symmetric_times(B, 6 * i, s)
    a, a1, ra = vector(t, 3 * i), vector(d1, 3 * i), 1.0 / length(x, i, edges)
    b, b1, rb = vector(t, 3 * i + 3), vector(d1, 3 * i + 3), 1.0 / length(x, i + 1, edges)
    strain_gradients(work, k, a, a1, ra, b, b1, rb)
    spring_gradient(work, mu)
    add_spring_gradient(gradient, work, i, edges)
    spring_hessian(work, B, 6 * i, k, mu, a, a1, ra, b, b1, rb)
    add_spring_hessian(lower, work, i, edges)
    value: float = 0.5 * dot(mu, s)
    return value


@inline
def add_symmetric(lower: Array, o: int, s: float, u: Vector, r: float) -> None:
    """H += s I + r u u^T, H the diagonal block of the vertex at unknown o."""
    for p in range(3):
        lower[LOWER * (o + p)] += s
        for q in range(p, 3):
            lower[LOWER * (o + p) + q - p] += r * u[p] * u[q]


@inline
def add_stretching(e: Vector, l: float, EA: float, T: float, j: int, gradient: Array, lower: Array) -> float:
    """E' = tau t, E'' = (tau / |e|) P_t + (EA / l) t t^T, tau = EA eps + T, on x_j - x_{j-1}; returns E."""
    size = math.sqrt(dot(e, e))
    t, eps = scaled(1.0 / size, e), size / l - 1.0
    s = (EA * eps + T) / size
    r = EA / l - s
    o = 4 * j
    add(gradient, o - 4, scaled(-s, e))
    add(gradient, o, scaled(s, e))
    add_symmetric(lower, o - 4, s, t, r)
    add_symmetric(lower, o, s, t, r)
    for p in range(3):
        lower[LOWER * (o - 4 + p) + 4] -= s
        for q in range(3):
            lower[LOWER * (o - 4 + p) + 4 + q - p] -= r * t[p] * t[q]
    return (0.5 * EA * eps + T) * eps * l


@inline
def add_loads(x: Array, f: Array, C: Array, i: int, gradient: Array, lower: Array) -> float:
    """E' = -(f + C x), E'' = -C at vertex i; returns E."""
    o, column = 6 * i, LOWER * 4 * i
    add(gradient, 4 * i, mix(-1.0, vector(f, 3 * i), -1.0, symmetric_times(C, o, vector(x, 3 * i))))
    lower[column] -= C[o]
    lower[column + 1] -= C[o + 5]
    lower[column + 2] -= C[o + 4]
    lower[column + LOWER] -= C[o + 1]
    lower[column + LOWER + 1] -= C[o + 3]
    lower[column + 2 * LOWER] -= C[o + 2]
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
    total = 0.0
    for i in range(l.size + 1):
        if i > 0:
            total += add_stretching(edge(x, i), l[i - 1], EA[i - 1], T[i - 1], i, gradient, lower)
        if first <= i < stop:
            total += add_spring(x, t, d1, m, B, kappa0, i, work, gradient, lower)
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

    q_b = q_a p,  p = (cos(m/2), kappa1 / (2 cos(m/2)), kappa2 / (2 cos(m/2)), sin(m/2)) / |.|
    """
    q[0], q[1], q[2], q[3] = 1.0, 0.0, 0.0, 0.0
    for i in range(kappa.size // 3):
        c, s = math.cos(0.5 * kappa[3 * i + 2]), math.sin(0.5 * kappa[3 * i + 2])
        x, y = kappa[3 * i] / (2.0 * c), kappa[3 * i + 1] / (2.0 * c)
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
