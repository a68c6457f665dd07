"""Discrete elastic rods in motion, in units that the caller made dimensionless; see discrete_rod.py for the rod itself.

Vertices carry masses, edges a rotary inertia J about their tangent. Mass that is spread along the edges has the kinetic
energy

    1/2 sum_i m_i |v_i|^2 - 1/2 sum_j c_j |e_j'|^2,     c_j = (mass of edge j) / 6

which takes the error of order h^2 off the frequencies of bending (that of the curvature is as large, with the other
sign). The velocities are packed like the unknowns, V = v_0, omega_1, v_1, omega_2, ..., v_N, with omega the spin about
the tangent. With G the gradient of the energy, less the other loads, and the damping's forces added,

    m_i v_i' + G_i = 0,     (J omega t)_j' + couple of G on edge j = 0

and the part of the second across t, a couple that two vertices feel, turns a spinning edge as a top.

Every implicit method here is made of one *stage*: find V with

    q = q_ref + tau V,     M (V - V_ref) / tau + G(q, V) = 0,                                                      (1)

by Newton's method on the band M / tau^2 + C / tau + K. The midpoint rule is one stage of tau = h / 2, q_ref = q_0, V_ref =
V_0, after which V_1 = 2 V - V_0 and q_1 = q_0 + h V. Its stretching and its spin are taken between the ends of the step,

    tension  EA (eps_0 + eps_1) / 2  along  e  over the length  (|e_0| + |e_1|) / 2                                  (2)
    (J omega t)'  =  J (omega_1 t_1 - omega_0 t_0) / h                                                              (3)

with e the midpoint's edge: the tension then works exactly what the stretching energy changes by, however fast a stiff
edge turns, and angular momentum is exactly kept (J. C. Simo, N. Tarnow, Z. angew. Math. Phys. 43 (1992) 757). Its derivative
is not symmetric, for edges lengthen along e_1: Newton's matrix is a general band, but that of a ring leaves it out. A spring's
moments mu, at the midpoint, are corrected along the change of its strains dk = grad kappa . h V, so that they too work what
its energy changes by (O. Gonzalez, J. Nonlinear Sci. 6 (1996) 449, in the strains, which rotations leave alone):

    mu -> mu + c B dk,     c = (E_1 - E_0 - mu.dk) / (dk.B dk)                                                      (4)

An inextensible rod has a multiplier T in the place of (2), with eps_1 = 0 (in other stages eps = 0), by an augmented
Lagrangian.

Loads come in groups g that share a factor of time lambda_g (t): each row of the drive ends with the factors. Loads *carried* by
the section are forces and couples in an edge's frame. At the end of a rod, and where a couple makes the curvature jump,
the section's frame is that of the edge turned a little, by its natural curvature and by the couple over the distance:

    F = lambda R (p + a x p),     a = a_0 + C (d + R^T d_dead + m)                                                   (5)

Dead forces F_k that act off the centre, at R e_k, have the potential -R : A, A = sum F_k e_k^T, and of the frame that is
turned by a, with G = R^T A and its axial vector m, the moment in the section's frame,

    E = -tr G - m.(a_0 + C m / 2)                                                                                    (7)

A support that leaves some of the end's rotations free, or ties them by a spring, has a ghost edge without inertia that
stands in equilibrium: by its free rotations phi, E the energy of the spring of half a cell and of the support,

    dE/dphi - moment = 0,     K = E_ee - E_e,phi (E_phi,phi)^-1 E_phi,e                                              (6)

A ring is a chain whose last edge is its first one once more, without mass or stretching: see ring.py.

Source of TR-BDF2: R. E. Bank et al., IEEE Trans. Computer-Aided Design 4 (1985) 436; its error estimate: M. E. Hosea,
L. F. Shampine, Appl. Numer. Math. 20 (1996) 21, eq. (14).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux.kernels import band, ring
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
from darboux.kernels.discrete_rod import (
    AA,
    AB,
    CHI,
    KAPPA1,
    KAPPA2,
    PHI,
    ROW,
    TWIST,
    WORK,
    Elasticity,
    Loads,
    State,
    add_spring_gradient,
    add_spring_hessian,
    add_symmetric,
    add_upper,
    advance,
    edge,
    energy,
    largest_turn,
    length,
    load_energy,
    spring_gradient,
    spring_hessian,
    strain,
    strain_gradients,
    strains,
    unit,
)
from darboux.kernels.jit import allocating, inline, jit

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Places = NDArray[np.int64]
Rows = np.ndarray[tuple[int, int], np.dtype[np.float64]]

# One row of a drive: what supports, loads and fluids do at one stage. Two numbers of three stand for the two ends.
POSITION, VELOCITY, TANGENT, DIRECTOR, SPIN = 0, 6, 12, 18, 24
# And, for the midpoint rule, how the supports move at the end of the step; then one factor for each group of loads, and three
# numbers for the velocity of the fluid of each drag.
NEXT_VELOCITY, NEXT_TANGENT, NEXT_DIRECTOR, FACTORS = 30, 36, 42, 48

DISSIPATED, OF_LOADS, OF_SUPPORTS = 0, 1, 2  # the tally of energy

MOST_ITERATIONS = 25
PATIENCE = 4  # iterations after which changes must shrink
FLOOR = 1e-6  # a change below this that no longer shrinks is rounding
SLOWEST = 0.9  # of the change before: with a tangent that leaves parts out, changes may shrink as slowly
LARGEST_TURN = 1.5  # rad; a change above this leads nowhere
STILL = 1e-10  # of the energy of a spring: below this its change is not corrected, for that would be rounding
LARGEST_SHARE = 0.5  # of B dk in the correction (4), which is left out where dk all but vanishes and c is huge
RENEWED, KEPT = 0.0, 1.0  # the correction (4) in an iteration
NEARLY = 1e-4  # rad; changes from which on it is kept where they shrink too slowly,
SLOW = 0.5  # of the change before
PENALTY = 1e3  # of an inextensible edge, times 1 / tau^2

MOST_TURNS = 30  # of a ghost, until it stands in equilibrium
TURNED = 1e-12  # rad
# Room for a ghost: (3 x 3) by its rotation, free axes (3 of 3), by these (3 x 3), by them and the edge's own (4 x 3), gradient.
MATRIX, AXES, FREE, MIXED, SLOPE, GHOST = 0, 9, 18, 27, 39, 42

GAMMA = 2.0 - math.sqrt(2.0)
ALONG, ACROSS = 0, 1  # linear drag; the quadratic one follows
AXIS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Carried(NamedTuple):
    """Loads in the section's frame, K of them, each on one vertex and one edge: eq. (5)."""

    place: Places  # (2 K) edge (0 and N + 1 are ghosts, which take no couples), vertex
    share: Array  # (K) of the load that this edge carries
    turn: Array  # (3 K) a_0
    compliance: Array  # (6 K) C
    force: Array  # (G 3 K) p
    couple: Array  # (G 3 K) d
    dead: Array  # (G 3 K) d_dead, which other loads count
    eccentric: Array  # (G 9 K) A, column by column


class Holds(NamedTuple):
    """What holds vertices along one direction, and what springs hold."""

    slides: Places  # (S) vertices
    directions: Array  # (3 S) unit vectors
    level: Array  # (S) direction.x
    anchors: Places  # (A) vertices
    stiffness: Array  # (6 A)
    place: Array  # (3 A) where a spring is at rest


class Turning(NamedTuple):
    """The ghosts at both ends that turn with the rod: eq. (6)."""

    free: Places  # (2) how many rotations are free; 0: the ghost is held, or there is none
    axes: Array  # (18) the first about fixed axes; the second of two turns with the section
    frame: Array  # (18) the support's, columns d1, d2, d3 one after another
    stiffness: Array  # (12) of the support's spring, where all three rotations are free
    moment: Array  # (G 6) dead
    section_moment: Array  # (G 6)
    eccentric: Array  # (G 18) A of both ends that have a ghost, column by column


class Body(NamedTuple):
    """All that does not change along the way."""

    rod: Elasticity
    loads: Loads  # (G 3 (N + 1)) and (G 6 (N + 1)), by groups
    couples: Array  # (G 3 N) dead couples on the edges
    carried: Carried
    holds: Holds
    turning: Turning
    frame_spin: Array  # (3) angular velocity of the frame in which all is seen, for Coriolis' force
    mass: Array  # (4 N + 3) packed: masses of vertices, rotary inertia of edges about their tangent
    spread: (
        Array  # (N) a sixth of each edge's mass, by which the kinetic energy of |e'| is too large; 0: mass in vertices
    )
    slowness: float  # damping proportional to mass, 1 / time
    viscous: Array  # (6 (N + 1)) viscous bending and twist of the springs, like rod.B
    viscous_stretch: Array  # (N) viscous stretching of the edges, like rod.EA
    drag: Array  # (4 D) of each: linear drag along and across the tangent, quadratic drag along and across, per length
    fixed: Flags  # (4 N + 3) unknowns that a support holds
    inextensible: bool
    closing: (
        Array  # (2) cosine and sine of the angle by which a ring's end is turned against its start; (0) with two ends
    )


class Space(NamedTuple):
    """Room for one step."""

    base: Array  # (4 N + 3) packed q_ref - q_0
    step: Array  # (4 N + 3) packed
    residual: Array  # (4 N + 3)
    lower: Array  # (11 (4 N + 3))
    work: Array  # of a spring
    later: State  # at the end of a midpoint step
    before: Array  # (3 (N + 1)) strains at the start of a midpoint step
    correction: Array  # (3 (N + 1) + 1) moments of the correction (4), and whether they are RENEWED or KEPT
    expected: Array  # (N) tension of the edges by which Newton's matrix is made: what the last iteration expects
    reaction: Array  # (12) force and moment of the support at the start, then at the end
    power: Array  # (2) dissipated, of the loads
    ghost: Array  # (GHOST) of a ghost that turns
    border: Array  # (8 (4 N + 3)) of a ring, see ring.py; (0) with two ends
    corner: Array  # (56)
    general: Array  # (21 (4 N + 3)) Newton's matrix with all of the tension's derivative; (0) of a ring


# Forces


@inline
def add_tension(e: Vector, s: float, j: int, residual: Array) -> None:
    """The force s e pulls the ends of edge j together."""
    add(residual, 4 * j - 4, scaled(-s, e))
    add(residual, 4 * j, scaled(s, e))


@inline
def add_tension_hessian(t: Vector, s: float, r: float, j: int, lower: Array) -> None:
    """s I + r t t^T by the edge vector of edge j."""
    o = 4 * j
    add_symmetric(lower, o - 4, s, t, r)
    add_symmetric(lower, o, s, t, r)
    for p in range(3):
        lower[LOWER * (o - 4 + p) + 4] -= s
        for q in range(3):
            lower[LOWER * (o - 4 + p) + 4 + q - p] -= r * t[p] * t[q]


@inline
def stretching(
    x0: Array, x: Array, V: Array, rate: float, l: float, EA: float, T: float, viscous: float, inextensible: bool, j: int,
    ends: bool, hessian: bool, residual: Array, lower: Array, expected: Array,
) -> float:  # fmt: skip
    """Tension of edge j, elastic and viscous; returns the power it dissipates."""
    e = edge(x, j)
    size = math.sqrt(dot(e, e))
    if ends:  # eq. (2)
        e0 = edge(x0, j)
        e1 = mix(2.0, e, -1.0, e0)
        size0, size1 = math.sqrt(dot(e0, e0)), math.sqrt(dot(e1, e1))
        mean, eps_rate = 0.5 * (size0 + size1), 0.5 * rate * (size1 - size0) / l
        eps = (size1 if inextensible else mean) / l - 1.0
    else:
        de = minus(vector(V, 4 * j), vector(V, 4 * j - 4))
        mean, eps, eps_rate = size, size / l - 1.0, dot(e, de) / (size * l)
    tension = EA * eps + T + viscous * eps_rate
    add_tension(e, tension / mean, j, residual)
    if hessian:
        s = expected[j - 1] / mean
        stiff = (2.0 * EA if inextensible and ends else EA) + viscous * rate
        add_tension_hessian(scaled(1.0 / size, e), s, stiff / l - s, j, lower)
        expected[j - 1] = tension  # `renew_tension` adds what the change on its way makes of it
    power: float = viscous * eps_rate * eps_rate * l
    return power


@inline
def ghost_reaction(work: Array, o: int, t: Vector, reaction: Array, r: int) -> None:
    """The couple t x phi + phi_theta t that holds a clamp's frame; then the frame's share of the gradients is dropped."""
    couple = mix(1.0, cross(t, vector(work, PHI + o)), work[PHI + o + 3], t)
    add(reaction, r, couple)
    for part in (KAPPA1, KAPPA2, TWIST, CHI, PHI):
        for p in range(3):
            work[part + o + p] = 0.0


@inline
def rate_of_edge(V: Array, i: int, edges: int, row: Array, t: Vector) -> tuple[Vector, float]:
    """How fast edge i changes and spins; a ghost's unit edge turns with its clamp."""
    if 0 < i <= edges:
        return minus(vector(V, 4 * i), vector(V, 4 * i - 4)), V[4 * i - 1]
    spin = vector(row, SPIN) if i == 0 else vector(row, SPIN + 3)
    return cross(spin, t), dot(spin, t)


@inline
def rate_of_strain(work: Array, o: int, da: Vector, wa: float, db: Vector, wb: float) -> float:
    """grad kappa . (e_a', omega_a, e_b', omega_b)"""
    rate: float = dot(vector(work, o), da) + work[o + 3] * wa + dot(vector(work, o + 4), db) + work[o + 7] * wb
    return rate


@inline
def exact_in_energy(B: Array, o: int, mu: Vector, rest: Vector, before: Vector, after: Vector, dk: Vector) -> Vector:
    """c B dk, with which the work of mu on dk = grad kappa . h V is exactly what the energy of the spring changes by: eq. (4)."""
    mean = minus(mix(0.5, before, 0.5, after), rest)
    Bdk, Bmean = symmetric_times(B, o, dk), symmetric_times(B, o, mean)
    size = dot(dk, Bdk)
    if size <= STILL * dot(mean, Bmean):
        return 0.0, 0.0, 0.0
    c = (dot(Bmean, minus(after, before)) - dot(mu, dk)) / size
    correction: Vector = scaled(c / (1.0 + (c / LARGEST_SHARE) ** 4), Bdk)
    return correction


@inline
def spring(
    x: Array, t: Array, d1: Array, m: Array, before: Array, later_t: Array, later_d: Array, ends: bool, V: Array,
    rate: float, B: Array, kappa0: Array, viscous: Array, row: Array, i: int, hessian: bool, residual: Array,
    lower: Array, work: Array, stiffness: Array, reaction: Array, correction: Array,
) -> float:  # fmt: skip
    """Bending and twist of vertex i, elastic and viscous; returns the power they dissipate."""
    edges = x.size // 3 - 1
    o = 6 * i
    k, rest = strain(t, d1, m, i), vector(kappa0, 3 * i)
    a, a1, ra = vector(t, 3 * i), vector(d1, 3 * i), 1.0 / length(x, i, edges)
    b, b1, rb = vector(t, 3 * i + 3), vector(d1, 3 * i + 3), 1.0 / length(x, i + 1, edges)
    strain_gradients(work, k, a, a1, ra if i > 0 else 1.0, b, b1, rb if i < edges else 1.0)
    da, wa = rate_of_edge(V, i, edges, row, a)
    db, wb = rate_of_edge(V, i + 1, edges, row, b)
    rates = (
        rate_of_strain(work, KAPPA1, da, wa, db, wb),
        rate_of_strain(work, KAPPA2, da, wa, db, wb),
        rate_of_strain(work, TWIST, da, wa, db, wb),
    )
    resisting = symmetric_times(viscous, o, rates)
    mu = symmetric_times(B, o, minus(k, rest))
    if ends:
        if correction[correction.size - 1] == RENEWED:
            after, dk = strain(later_t, later_d, m, i), scaled(2.0 / rate, rates)
            store(correction, 3 * i, exact_in_energy(B, o, mu, rest, vector(before, 3 * i), after, dk))
        mu = plus(mu, vector(correction, 3 * i))
    mu = plus(mu, resisting)
    spring_gradient(work, mu)
    if i == 0:
        ghost_reaction(work, 0, a, reaction, 3)
    if i == edges:
        ghost_reaction(work, 4, b, reaction, 9)
    add_spring_gradient(residual, work, i, edges)
    if hessian:
        for p in range(6):
            stiffness[p] = B[o + p] + rate * viscous[o + p]
        spring_hessian(work, stiffness, 0, k, mu, a, a1, ra, b, b1, rb)
        add_spring_hessian(lower, work, i, edges)
    power: float = dot(resisting, rates)
    return power


@inline
def add_diagonal(lower: Array, i: int, s: float, C: Array, o: int) -> None:
    """H += s C by vertex i."""
    column = LOWER * 4 * i
    lower[column] += s * C[o]
    lower[column + 1] += s * C[o + 5]
    lower[column + 2] += s * C[o + 4]
    lower[column + LOWER] += s * C[o + 1]
    lower[column + LOWER + 1] += s * C[o + 3]
    lower[column + 2 * LOWER] += s * C[o + 2]


@inline
def add_loads(
    x: Array, V: Array, f: Array, C: Array, row: Array, i: int, hessian: bool, residual: Array, lower: Array
) -> float:
    """Minus the force, sum of lambda (f + C x), on vertex i; returns its power."""
    force = (0.0, 0.0, 0.0)
    for g in range(f.size // x.size):
        o, factor = 6 * i + g * 2 * x.size, row[FACTORS + g]
        part = plus(vector(f, 3 * i + g * x.size), symmetric_times(C, o, vector(x, 3 * i)))
        force = mix(1.0, force, factor, part)
        if hessian:
            add_diagonal(lower, i, -factor, C, o)
    add(residual, 4 * i, scaled(-1.0, force))
    power: float = dot(force, vector(V, 4 * i))
    return power


@inline
def sum_of(groups: Array, o: int, size: int, row: Array) -> Vector:
    """sum_g lambda_g of three numbers at o, where a group has `size` of them."""
    total = (0.0, 0.0, 0.0)
    for g in range(groups.size // size):
        total = mix(1.0, total, row[FACTORS + g], vector(groups, o + g * size))
    return total


@inline
def add_moment(residual: Array, j: int, t: Vector, r: float, W: Vector) -> None:
    """A couple W that edge j takes up: W.t by its angle, W x t / |e| by its ends."""
    force = scaled(r, cross(W, t))
    add(residual, 4 * j - 4, scaled(-1.0, force))
    add(residual, 4 * j, force)
    residual[4 * j - 1] += dot(W, t)


@inline
def add_couple(x: Array, V: Array, t: Vector, j: int, couple: Vector, residual: Array) -> float:
    """Minus a couple of the loads on edge j; returns its power."""
    e = edge(x, j)
    r = 1.0 / math.sqrt(dot(e, e))
    add_moment(residual, j, t, r, scaled(-1.0, couple))
    turning = scaled(r, cross(t, minus(vector(V, 4 * j), vector(V, 4 * j - 4))))
    power: float = dot(couple, turning) + dot(couple, t) * V[4 * j - 1]
    return power


@inline
def frame_of(state: State, j: int) -> tuple[Vector, Vector, Vector]:
    """The directors of edge j."""
    a3, a1 = vector(state.t, 3 * j), vector(state.d1, 3 * j)
    return a1, cross(a3, a1), a3


@inline
def in_section(a: tuple[Vector, Vector, Vector], v: Vector) -> Vector:
    """R^T v, with the directors a."""
    return dot(a[0], v), dot(a[1], v), dot(a[2], v)


@inline
def in_space(a: tuple[Vector, Vector, Vector], v: Vector) -> Vector:
    """R v"""
    result: Vector = plus(mix(v[0], a[0], v[1], a[1]), scaled(v[2], a[2]))
    return result


@inline
def eccentric_in_section(
    eccentric: Array, o: int, size: int, a: tuple[Vector, Vector, Vector], row: Array
) -> tuple[Vector, Vector, Vector]:
    """The columns of G = R^T A, from those of A at o."""
    first, second, third = (
        sum_of(eccentric, o, size, row), sum_of(eccentric, o + 3, size, row), sum_of(eccentric, o + 6, size, row),
    )  # fmt: skip
    return in_section(a, first), in_section(a, second), in_section(a, third)


@inline
def axial(G: tuple[Vector, Vector, Vector]) -> Vector:
    """m = sum e_i x g_i"""
    return G[1][2] - G[2][1], G[2][0] - G[0][2], G[0][1] - G[1][0]


@inline
def by_section_turn(G: tuple[Vector, Vector, Vector], psi: Vector) -> Vector:
    """dm = K psi, K = G - tr G, for a small rotation psi in the section's frame."""
    trace = G[0][0] + G[1][1] + G[2][2]
    result: Vector = plus(mix(psi[0], G[0], psi[1], G[1]), mix(psi[2], G[2], -trace, psi))
    return result


@inline
def of_turned(G: tuple[Vector, Vector, Vector], u: Vector) -> Vector:
    """K^T u: what a turn u of the section against the edge adds to m."""
    trace = G[0][0] + G[1][1] + G[2][2]
    result: Vector = mix(1.0, (dot(G[0], u), dot(G[1], u), dot(G[2], u)), -trace, u)
    return result


@inline
def eccentric_tangent(
    G: tuple[Vector, Vector, Vector], compliance: Array, o: int, m: Vector, u: Vector, psi: Vector
) -> Vector:
    """Minus the second derivative of eq. (7): K psi + K^T C K psi - G^T (u x psi) - (m.psi) u."""
    change, turned_by = by_section_turn(G, psi), cross(u, psi)
    first = plus(change, of_turned(G, symmetric_times(compliance, o, change)))
    second = (dot(G[0], turned_by), dot(G[1], turned_by), dot(G[2], turned_by))
    result: Vector = minus(first, mix(1.0, second, dot(m, psi), u))
    return result


@inline
def add_eccentric_hessian(
    a: tuple[Vector, Vector, Vector], r: float, share: float, w: Vector, c1: Vector, c2: Vector, c3: Vector, j: int,
    lower: Array,
) -> None:  # fmt: skip
    """The Hessian of `share` of eq. (7) by edge j and its angle; w is the moment, c_i what a turn about e_i makes of it.

    In the section's frame, of the edge: ((-c22, c12, w2), (c12, -c11, -w1), (w2, -w1, 0)) / |e|^2; with its angle
    (-c32, c31, 0) / |e|; of the angle -c33.
    """
    s, mixed, o = share * r * r, 0.5 * (c2[0] + c1[1]), 4 * j
    h1 = (-s * c2[1], s * mixed, s * w[1])
    h2 = (s * mixed, -s * c1[0], -s * w[0])
    h3 = (s * w[1], -s * w[0], 0.0)
    f1, f2, f3 = in_space(a, h1), in_space(a, h2), in_space(a, h3)
    by_angle = in_space(a, (-share * r * c2[2], share * r * c1[2], 0.0))
    between, angle = LOWER * (o - 4) + 4, LOWER * (o - 1)
    rows = (
        plus(mix(a[0][0], f1, a[1][0], f2), scaled(a[2][0], f3)),
        plus(mix(a[0][1], f1, a[1][1], f2), scaled(a[2][1], f3)),
        plus(mix(a[0][2], f1, a[1][2], f2), scaled(a[2][2], f3)),
    )
    add_upper(lower, o - 4, rows[0], rows[1], rows[2])
    add_upper(lower, o, rows[0], rows[1], rows[2])
    for q in range(3):
        add(lower, between + REACH * q, scaled(-1.0, rows[q]))
        lower[LOWER * (o - 4 + q) + 3 - q] -= by_angle[q]
        lower[angle + 1 + q] += by_angle[q]
    lower[angle] -= share * c3[2]


@jit
def add_carried(
    now: State, V: Array, carried: Carried, row: Array, hessian: bool, residual: Array, lower: Array
) -> float:
    """Minus the loads that depend on the section's frame, eqs. (5) and (7); returns their power.

    Of their tangents, those of followers are left out of Newton's matrix.
    """
    place, share, turns, compliance, forces, couples, dead, eccentric = carried
    x, t, d1, _ = now
    power = 0.0
    for k in range(share.size):
        j, i = place[2 * k], place[2 * k + 1]
        a3, a1 = vector(t, 3 * j), vector(d1, 3 * j)
        a = (a1, cross(a3, a1), a3)
        p, d = sum_of(forces, 3 * k, turns.size, row), sum_of(couples, 3 * k, turns.size, row)
        G = eccentric_in_section(eccentric, 9 * k, 3 * turns.size, a, row)
        m = axial(G)
        bending = plus(plus(d, m), in_section(a, sum_of(dead, 3 * k, turns.size, row)))
        turn = plus(vector(turns, 3 * k), symmetric_times(compliance, 6 * k, bending))
        w = plus(m, of_turned(G, turn))
        p, d = scaled(share[k], plus(p, cross(turn, p))), scaled(share[k], plus(plus(d, cross(turn, d)), w))
        force = in_space(a, p)
        add(residual, 4 * i, scaled(-1.0, force))
        power += dot(force, vector(V, 4 * i))
        if dot(d, d) > 0.0:
            power += add_couple(x, V, a3, j, in_space(a, d), residual)
        if hessian and dot(G[0], G[0]) + dot(G[1], G[1]) + dot(G[2], G[2]) > 0.0:
            c1 = eccentric_tangent(G, compliance, 6 * k, m, turn, AXIS[0])
            c2 = eccentric_tangent(G, compliance, 6 * k, m, turn, AXIS[1])
            c3 = eccentric_tangent(G, compliance, 6 * k, m, turn, AXIS[2])
            add_eccentric_hessian(a, 1.0 / length(x, j, x.size // 3 - 1), share[k], w, c1, c2, c3, j, lower)
    return power


@inline
def add_energy_of_carried(state: State, body: Body, row: Array, result: Array) -> None:
    """What loads that depend on the frame add to the measures: -R : A of the section's frame, and what its turn u stores.

    Between the section and its edge, or both of its edges, bending and twist by u = C mu store mu.u / 2.
    """
    carried, turning = body.carried, body.turning
    size, C = carried.turn.size, carried.compliance
    for k in range(carried.share.size):
        a, share = frame_of(state, carried.place[2 * k]), carried.share[k]
        G = eccentric_in_section(carried.eccentric, 9 * k, 3 * size, a, row)
        m = axial(G)
        dead = in_section(a, sum_of(carried.dead, 3 * k, size, row))
        mu = plus(plus(sum_of(carried.couple, 3 * k, size, row), m), dead)
        u = symmetric_times(C, 6 * k, mu)
        bent, twisted = 0.5 * share * (mu[0] * u[0] + mu[1] * u[1]), 0.5 * share * mu[2] * u[2]
        result[1] += bent
        result[2] += twisted
        result[12] += bent + twisted
        result[4] -= share * (G[0][0] + G[1][1] + G[2][2] + dot(m, plus(vector(carried.turn, 3 * k), u)))
    for end in range(2):
        a = frame_of(state, end * (state.t.size // 3 - 1))
        G = eccentric_in_section(turning.eccentric, 9 * end, 18, a, row)
        result[4] -= G[0][0] + G[1][1] + G[2][2]


@jit
def add_anchors(x: Array, holds: Holds, hessian: bool, residual: Array, lower: Array) -> None:
    """K (x - place) of the springs that hold vertices."""
    for k in range(holds.anchors.size):
        i = holds.anchors[k]
        u = minus(vector(x, 3 * i), vector(holds.place, 3 * k))
        add(residual, 4 * i, symmetric_times(holds.stiffness, 6 * k, u))
        if hessian:
            add_diagonal(lower, i, 1.0, holds.stiffness, 6 * k)


@inline
def add_coriolis(V: Array, mass: Array, spin: Vector, residual: Array) -> None:
    """2 m spin x v, which does no work; its derivative is skew, and left out of Newton's matrix."""
    for i in range(V.size // 4 + 1):
        add(residual, 4 * i, scaled(2.0 * mass[4 * i], cross(spin, vector(V, 4 * i))))


@inline
def drag_on(
    v: Vector, fluid: Vector, t: Vector, half: float, drag: Array, k: int, rate: float, o: int, hessian: bool,
    residual: Array, lower: Array,
) -> tuple[float, float]:  # fmt: skip
    """Drag k on half an edge, with w = v - fluid split along and across t; returns the power lost, and the fluid's.

    f = half ((c0 + c2 |w_t|) w_t + (c1 + c3 |w_n|) w_n)
    """
    w = minus(v, fluid)
    along = dot(w, t)
    normal = mix(1.0, w, -along, t)
    size = math.sqrt(dot(normal, normal))
    c_t = half * (drag[k + ALONG] + drag[k + 2 + ALONG] * abs(along))
    c_n = half * (drag[k + ACROSS] + drag[k + 2 + ACROSS] * size)
    force = mix(c_t * along, t, c_n, normal)
    add(residual, o, force)
    if hessian:
        c_t += half * drag[k + 2 + ALONG] * abs(along)
        add_symmetric(lower, o, rate * c_n, t, rate * (c_t - c_n))
        if size > 0.0:
            add_symmetric(lower, o, 0.0, scaled(1.0 / size, normal), rate * half * drag[k + 2 + ACROSS] * size)
    return dot(force, w), -dot(force, fluid)


@inline
def slow(V: Array, rate: float, slowness: float, mass: Array, hessian: bool, residual: Array, lower: Array) -> float:
    """Damping proportional to the mass in the vertices; returns the power it dissipates."""
    power = 0.0
    for k in range(residual.size):
        resisting = slowness * mass[k] * V[k]
        residual[k] += resisting
        power += resisting * V[k]
        if hessian:
            lower[LOWER * k] += rate * slowness * mass[k]
    return power


# Ghosts that turn


@inline
def support_frame(turning: Turning, end: int) -> tuple[Vector, Vector, Vector]:
    """The directors that a support has at no turn."""
    o = 9 * end
    return vector(turning.frame, o), vector(turning.frame, o + 3), vector(turning.frame, o + 6)


@inline
def turn_between(s: tuple[Vector, Vector, Vector], a: tuple[Vector, Vector, Vector]) -> Vector:
    """The rotation vector theta from a frame S to a frame A: 2 sin |theta| = |sum s_i x a_i|."""
    (s1, s2, s3), (a1, a2, a3) = s, a
    axis = scaled(0.5, plus(cross(s1, a1), plus(cross(s2, a2), cross(s3, a3))))
    sine, cosine = math.sqrt(dot(axis, axis)), 0.5 * (dot(s1, a1) + dot(s2, a2) + dot(s3, a3) - 1.0)
    if sine < 1e-9:
        return axis
    return scaled(math.atan2(sine, cosine) / sine, axis)


@inline
def moment_of_turn(K: Array, o: int, theta: Vector) -> Vector:
    """The derivative of theta.K theta / 2 by a small rotation: J^-T K theta, as in statics/discrete_ends.py."""
    size, m = math.sqrt(dot(theta, theta)), symmetric_times(K, o, theta)
    factor = 1.0 / 12.0 if size < 1e-3 else (1.0 - 0.5 * size / math.tan(0.5 * size)) / (size * size)
    first = cross(theta, m)
    moment: Vector = mix(1.0, m, 1.0, mix(0.5, first, factor, cross(theta, first)))
    return moment


@inline
def of_spring(work: Array, p: int, q: int) -> float:
    """Entry (p, q) of a spring's Hessian by edges, of which the upper triangle is kept."""
    entry: float = work[AA + ROW * min(p, q) + max(p, q)]
    return entry


@inline
def by_turn(work: Array, p: int, o: int, t: Vector) -> Vector:
    """Row p of the Hessian by a small rotation of the ghost, whose edge t and angle are at o: de = phi x t, dtheta = phi.t."""
    de = (of_spring(work, p, o), of_spring(work, p, o + 1), of_spring(work, p, o + 2))
    row: Vector = mix(1.0, cross(t, de), of_spring(work, p, o + 3), t)
    return row


@inline
def moment_on(turning: Turning, a: tuple[Vector, Vector, Vector], row: Array, end: int) -> Vector:
    """The loads' moment on a ghost of the frame a."""
    m = plus(
        sum_of(turning.section_moment, 3 * end, 6, row),
        axial(eccentric_in_section(turning.eccentric, 9 * end, 18, a, row)),
    )
    moment: Vector = plus(sum_of(turning.moment, 3 * end, 6, row), in_space(a, m))
    return moment


@jit
def work_on_ghosts(old: State, new: State, body: Body, first: Array, last: Array) -> float:
    """The work of the moments on ghosts that turn, in a step whose rows of the drive are `first` and `last`."""
    work = 0.0
    for end in range(2):
        if body.turning.free[end] > 0:
            j = end * (old.t.size // 3 - 1)
            a, b = frame_of(old, j), frame_of(new, j)
            mean = plus(moment_on(body.turning, a, first, end), moment_on(body.turning, b, last, end))
            work += 0.5 * dot(mean, turn_between(a, b))
    return work


@inline
def fill_ghost(now: State, turning: Turning, row: Array, end: int, work: Array, ghost: Array) -> None:
    """Gradient and Hessian of eq. (6) by the free rotations of a ghost, from those of its spring."""
    o, j = 4 * end, end * (now.t.size // 3 - 1)
    t, a1 = vector(now.t, 3 * j), vector(now.d1, 3 * j)
    a2, phi = cross(t, a1), vector(work, PHI + o)
    theta = turn_between(support_frame(turning, end), (a1, a2, t))
    slope = minus(mix(1.0, cross(t, phi), work[PHI + o + 3], t), moment_on(turning, (a1, a2, t), row, end))
    slope = plus(slope, moment_of_turn(turning.stiffness, 6 * end, theta))
    store(ghost, SLOPE, slope)
    rows = (by_turn(work, o, o, t), by_turn(work, o + 1, o, t), by_turn(work, o + 2, o, t), by_turn(work, o + 3, o, t))
    along = dot(phi, t)
    frame = (a1, a2, t)
    A = (
        sum_of(turning.eccentric, 9 * end, 18, row),
        sum_of(turning.eccentric, 9 * end + 3, 18, row),
        sum_of(turning.eccentric, 9 * end + 6, 18, row),
    )
    for q in range(3):  # T^T H T + (phi t^T + t phi^T) / 2 - (phi.t) I + K, and the same of -A_i and the directors
        u = AXIS[q]
        column = plus(cross(t, (rows[0][q], rows[1][q], rows[2][q])), scaled(rows[3][q], t))
        column = plus(column, mix(0.5 * t[q], phi, 0.5 * phi[q], t))
        column = plus(mix(1.0, column, -along, u), symmetric_times(turning.stiffness, 6 * end, u))
        for k in range(3):
            column = minus(column, mix(0.5 * frame[k][q], A[k], 0.5 * A[k][q], frame[k]))
            column = mix(1.0, column, dot(A[k], frame[k]), u)
        store(ghost, MATRIX + 3 * q, column)
    for c in range(turning.free[end]):
        axis = vector(turning.axes, 9 * end + 3 * c)
        if turning.free[end] == 2 and c == 1:  # turned by A S^T
            s = 9 * end
            one, two = dot(vector(turning.frame, s), axis), dot(vector(turning.frame, s + 3), axis)
            axis = plus(mix(one, a1, two, a2), scaled(dot(vector(turning.frame, s + 6), axis), t))
        store(ghost, AXES + 3 * c, axis)
    for c in range(turning.free[end]):
        column = times(ghost, MATRIX, vector(ghost, AXES + 3 * c))
        for d in range(turning.free[end]):
            ghost[FREE + 3 * d + c] = dot(vector(ghost, AXES + 3 * d), column)


@inline
def solve_free(ghost: Array, n: int, b: Vector) -> Vector:
    """FREE x = b for the first n of three numbers, by Cramer's rule."""
    a, o = ghost, FREE
    if n == 1:
        return b[0] / a[o], 0.0, 0.0
    if n == 2:
        d = a[o] * a[o + 4] - a[o + 1] * a[o + 3]
        return (a[o + 4] * b[0] - a[o + 1] * b[1]) / d, (a[o] * b[1] - a[o + 3] * b[0]) / d, 0.0
    r0, r1, r2 = vector(a, o), vector(a, o + 3), vector(a, o + 6)
    c0, c1, c2 = cross(r1, r2), cross(r2, r0), cross(r0, r1)
    x: Vector = scaled(1.0 / dot(r0, c0), plus(mix(b[0], c0, b[1], c1), scaled(b[2], c2)))
    return x


@inline
def turned(a: Vector, phi: Vector) -> Vector:
    """exp([phi]_x) a"""
    angle = math.sqrt(dot(phi, phi))
    if angle == 0.0:
        return a
    n = scaled(1.0 / angle, phi)
    s, c = math.sin(angle), math.cos(angle)
    result: Vector = plus(mix(c, a, s, cross(n, a)), scaled((1.0 - c) * dot(n, a), n))
    return result


@inline
def look_at(now: State, B: Array, kappa0: Array, i: int, end: int, hessian: bool, work: Array) -> None:
    """Gradient, and Hessian where asked, of the spring between an end's edge and its ghost, whose length is one."""
    x, t, d1, m = now
    edges = x.size // 3 - 1
    k = strain(t, d1, m, i)
    mu = symmetric_times(B, 6 * i, minus(k, vector(kappa0, 3 * i)))
    a, a1, ra = vector(t, 3 * i), vector(d1, 3 * i), 1.0 if end == 0 else 1.0 / length(x, i, edges)
    b, b1, rb = vector(t, 3 * i + 3), vector(d1, 3 * i + 3), 1.0 if end == 1 else 1.0 / length(x, i + 1, edges)
    strain_gradients(work, k, a, a1, ra, b, b1, rb)
    spring_gradient(work, mu)
    if hessian:
        spring_hessian(work, B, 6 * i, k, mu, a, a1, ra, b, b1, rb)


@jit
def turn_ghost(
    now: State, turning: Turning, B: Array, kappa0: Array, row: Array, end: int, work: Array, ghost: Array
) -> None:
    """Turn a ghost about its free axes until it stands in equilibrium."""
    edges, n = now.x.size // 3 - 1, turning.free[end]
    i, o = end * edges, 3 * end * (edges + 1)
    last = np.inf
    for _ in range(MOST_TURNS):
        look_at(now, B, kappa0, i, end, True, work)
        fill_ghost(now, turning, row, end, work, ghost)
        slope = vector(ghost, SLOPE)
        axes = vector(ghost, AXES), vector(ghost, AXES + 3), vector(ghost, AXES + 6)
        x = solve_free(ghost, n, (-dot(axes[0], slope), -dot(axes[1], slope), -dot(axes[2], slope)))
        phi = scaled(x[0], axes[0])
        if n > 1:
            phi = mix(1.0, phi, x[1], axes[1])
        if n > 2:
            phi = mix(1.0, phi, x[2], axes[2])
        tangent = unit(turned(vector(now.t, o), phi))
        store(now.t, o, tangent)
        store(now.d1, o, unit(across(tangent, turned(vector(now.d1, o), phi))))
        size = math.sqrt(dot(phi, phi))
        if size <= TURNED or (size <= FLOOR and size > 0.5 * last) or not size < np.inf:
            return
        last = size


@jit
def turn_ghosts(now: State, body: Body, row: Array, space: Space) -> None:
    """Turn the ghosts at both ends that are free to."""
    for end in range(2):
        if body.turning.free[end] > 0:
            turn_ghost(now, body.turning, body.rod.B, body.rod.kappa0, row, end, space.work, space.ghost)


@inline
def keep_ghosts(state: State, kept: State) -> None:
    """Copy the ghosts' frames."""
    for o in (0, state.t.size - 3):
        store(kept.t, o, vector(state.t, o))
        store(kept.d1, o, vector(state.d1, o))


@jit
def turning_spring(
    now: State, turning: Turning, B: Array, kappa0: Array, row: Array, i: int, hessian: bool, residual: Array,
    lower: Array, work: Array, ghost: Array,
) -> None:  # fmt: skip
    """The spring between an end's edge and a ghost that turns, with the ghost eliminated: eq. (6)."""
    edges = now.x.size // 3 - 1
    end = 0 if i == 0 else 1
    turn_ghost(now, turning, B, kappa0, row, end, work, ghost)
    look_at(now, B, kappa0, i, end, hessian, work)
    o, other = 4 * end, 4 - 4 * end
    n, t = turning.free[end], vector(now.t, 3 * end * (edges + 1))
    if hessian:
        fill_ghost(now, turning, row, end, work, ghost)
        for p in range(4):
            mixed = by_turn(work, other + p, o, t)
            for c in range(3):
                ghost[MIXED + 3 * p + c] = dot(mixed, vector(ghost, AXES + 3 * c)) if c < n else 0.0
        for p in range(4):
            moved = solve_free(ghost, n, vector(ghost, MIXED + 3 * p))
            for q in range(4):
                work[AA + ROW * (other + p) + other + q] -= dot(moved, vector(ghost, MIXED + 3 * q))
        for p in range(4):
            for q in range(4):
                work[AA + ROW * (o + p) + o + q] = 0.0
                work[AB + ROW * p + q] = 0.0
        add_spring_hessian(lower, work, i, edges)
    for p in range(4):
        work[PHI + o + p] = 0.0
    add_spring_gradient(residual, work, i, edges)


@inline
def energy_of_supports(state: State, body: Body) -> float:
    """Energy of the springs of the supports."""
    x, holds, turning = state.x, body.holds, body.turning
    total = 0.0
    for k in range(holds.anchors.size):
        u = minus(vector(x, 3 * holds.anchors[k]), vector(holds.place, 3 * k))
        total += 0.5 * dot(u, symmetric_times(holds.stiffness, 6 * k, u))
    for end in range(2):
        if turning.free[end] == 3:
            theta = turn_between(support_frame(turning, end), frame_of(state, end * (state.t.size // 3 - 1)))
            total += 0.5 * dot(theta, symmetric_times(turning.stiffness, 6 * end, theta))
    return total


@jit
def forces(
    old: State, now: State, V: Array, rate: float, body: Body, row: Array, ends: bool, hessian: bool, space: Space
) -> None:
    """G(q, V) into the residual, K + C rate into the band where `hessian`; reactions' moments and powers too."""
    _, _, residual, lower, work, later, before, correction, expected, reaction, power, ghost, _, _, _ = space
    (
        rod,
        loads,
        couples,
        carried,
        holds,
        turning,
        frame_spin,
        mass,
        _,
        slowness,
        viscous,
        viscous_stretch,
        drag,
        _,
        inextensible,
        closing,
    ) = body
    B, kappa0, l, EA, T, first, stop = rod
    f, C = loads
    x, t, d1, m = now
    x0 = old.x
    _, later_t, later_d, _ = later  # arrays by themselves: every look into a tuple counts references
    residual[:] = 0.0
    reaction[:] = 0.0
    if hessian:
        lower[:] = 0.0
    stiffness = work[WORK:]
    spin = vector(frame_spin, 0)
    fluids, dragged = row.size - 3 * (drag.size // 4), l.size - closing.size // 2
    lost = of_loads = 0.0
    for i in range(l.size + 1):
        if i > 0:
            lost += stretching(
                x0, x, V, rate, l[i - 1], EA[i - 1], T[i - 1], viscous_stretch[i - 1], inextensible, i, ends, hessian,
                residual, lower, expected,
            )  # fmt: skip
            tangent, couple = vector(t, 3 * i), sum_of(couples, 3 * i - 3, 3 * l.size, row)
            if dot(couple, couple) > 0.0:
                of_loads += add_couple(x, V, tangent, i, couple, residual)
            for k in range(drag.size // 4 if i <= dragged else 0):
                fluid, half = vector(row, fluids + 3 * k), 0.5 * l[i - 1]
                for o in (4 * i - 4, 4 * i):
                    taken, given = drag_on(
                        vector(V, o), fluid, tangent, half, drag, 4 * k, rate, o, hessian, residual, lower
                    )
                    lost += taken
                    of_loads += given
        if (i == 0 and turning.free[0] > 0) or (i == l.size and turning.free[1] > 0):
            turning_spring(now, turning, B, kappa0, row, i, hessian, residual, lower, work, ghost)
        elif first <= i < stop:
            lost += spring(
                x, t, d1, m, before, later_t, later_d, ends, V, rate, B, kappa0, viscous, row, i, hessian, residual,
                lower, work, stiffness, reaction, correction,
            )  # fmt: skip
        of_loads += add_loads(x, V, f, C, row, i, hessian, residual, lower)
    of_loads += add_carried(now, V, carried, row, hessian, residual, lower)
    add_anchors(x, holds, hessian, residual, lower)
    if dot(spin, spin) > 0.0:
        add_coriolis(V, mass, spin, residual)
    if slowness > 0.0:
        lost += slow(V, rate, slowness, mass, hessian, residual, lower)
    power[0], power[1] = lost, of_loads


# One stage


@inline
def spin_change(
    x0: Array, t0: Array, x: Array, t: Array, V: Array, start: Array, rate: float, J: float, j: int, ends: bool, r: float,
) -> Vector:  # fmt: skip
    """(J omega t)' of edge j: by eq. (3) between the ends of a midpoint step, else J omega' t + J omega t'."""
    tangent, spin, before = vector(t, 3 * j), V[4 * j - 1], start[4 * j - 1]
    if ends:
        later, factor = unit(mix(2.0, edge(x, j), -1.0, edge(x0, j))), 0.5 * rate * J
        change: Vector = mix(factor * (2.0 * spin - before), later, -factor * before, vector(t0, 3 * j))
        return change
    turning = scaled(r, across(tangent, minus(vector(V, 4 * j), vector(V, 4 * j - 4))))
    other: Vector = mix(J * (spin - before) * rate, tangent, J * spin, turning)
    return other


@inline
def add_spread(V: Array, start: Array, rate: float, c: float, j: int, residual: Array, lower: Array) -> None:
    """What mass spread along edge j takes off: -c e''."""
    o = 4 * j
    later, before = minus(vector(V, o), vector(V, o - 4)), minus(vector(start, o), vector(start, o - 4))
    force = scaled(c * rate, minus(later, before))
    add(residual, o - 4, force)
    add(residual, o, scaled(-1.0, force))
    for p in range(3):
        lower[LOWER * (o - 4 + p)] -= c * rate * rate
        lower[LOWER * (o + p)] -= c * rate * rate
        lower[LOWER * (o - 4 + p) + 4] += c * rate * rate


@jit
def add_inertia(
    old: State, now: State, V: Array, start: Array, rate: float, body: Body, ends: bool, residual: Array, lower: Array
) -> None:
    """M (V - V_ref) / tau to the residual, M / tau^2 to the band."""
    mass, spread = body.mass, body.spread
    x0, t0, _, _ = old
    x, t, _, _ = now
    for i in range(spread.size + 1):
        m = mass[4 * i]
        add(residual, 4 * i, scaled(m * rate, minus(vector(V, 4 * i), vector(start, 4 * i))))
        for p in range(3):
            lower[LOWER * (4 * i + p)] += m * rate * rate
        if i > 0:
            add_spread(V, start, rate, spread[i - 1], i, residual, lower)
            J, r = mass[4 * i - 1], 1.0 / length(x, i, spread.size)
            add_moment(residual, i, vector(t, 3 * i), r, spin_change(x0, t0, x, t, V, start, rate, J, i, ends, r))
            lower[LOWER * (4 * i - 1)] += J * rate * rate


@jit
def solved(lower: Array, b: Array, closing: Array, border: Array, corner: Array) -> bool:
    """Solve H x = b, a ring's by its own unknowns; x replaces b. False at a pivot that is zero or no number."""
    if closing.size > 0:
        return ring.solve(lower, b, border, corner)
    if band.factor(lower, b.size) < 0:
        return False
    band.solve(lower, b.size, b)
    return True


@jit
def add_lengthening(
    old: State, now: State, rate: float, body: Body, expected: Array, work: Array, general: Array
) -> None:
    """What the symmetric Hessian of eq. (2) leaves out: an edge lengthens along e_1, but its tension acts along e.

    r t (f e_1/|e_1| - t)^T, f = |e| / mean, of what supports leave free. Without it Newton's changes shrink by a factor of
    about the turn in a step times N, and not at all where a fine rod turns fast.
    """
    g, w = work[:8], work[8:16]
    for j in range(1, expected.size + 1):
        e, e0, o = edge(now.x, j), edge(old.x, j), 4 * j - 4
        e1, size = mix(2.0, e, -1.0, e0), math.sqrt(dot(e, e))
        size1 = math.sqrt(dot(e1, e1))
        mean = 0.5 * (math.sqrt(dot(e0, e0)) + size1)
        stiff = body.rod.EA[j - 1] * (2.0 if body.inextensible else 1.0) + rate * body.viscous_stretch[j - 1]
        r = stiff / body.rod.l[j - 1] - expected[j - 1] / mean
        t = scaled(1.0 / size, e)
        lacking = mix(size / (mean * size1), e1, -1.0, t)
        for i in (o, o + 4):
            sign = 1.0 if i > o else -1.0
            for p in range(3):
                free = 0.0 if body.fixed[i + p] else sign
                g[i - o + p], w[i - o + p] = free * r * t[p], free * lacking[p]
        for k in range(body.holds.slides.size):
            i, a = 4 * body.holds.slides[k], vector(body.holds.directions, 3 * k)
            if i == o or i == o + 4:
                add(g, i - o, scaled(-dot(a, vector(g, i - o)), a))
                add(w, i - o, scaled(-dot(a, vector(w, i - o)), a))
        for p in (0, 1, 2, 4, 5, 6):
            for q in (0, 1, 2, 4, 5, 6):
                general[FULL * (o + q) + REACH + p - q] += g[p] * w[q]


@inline
def hold(row: Array, body: Body, old: State, V: Array, step: Array) -> None:
    """The held vertices' step and velocity, from the drive."""
    last = 4 * body.rod.l.size
    for p in range(3):
        if body.fixed[p]:
            step[p] = row[POSITION + p] - old.x[p]
            V[p] = row[VELOCITY + p]
        if body.fixed[last + p]:
            step[last + p] = row[POSITION + 3 + p] - old.x[3 * body.rod.l.size + p]
            V[last + p] = row[VELOCITY + 3 + p]
    slides, directions, level, _, _, _ = body.holds
    for k in range(slides.size):
        i, a = slides[k], vector(directions, 3 * k)
        add(step, 4 * i, scaled(level[k] - dot(a, vector(old.x, 3 * i)) - dot(a, vector(step, 4 * i)), a))
        add(V, 4 * i, scaled(-dot(a, vector(V, 4 * i)), a))


@inline
def keep_from_sliding(holds: Holds, A: Array) -> None:
    """A -> A - (a.A) a where a vertex is held along a."""
    for k in range(holds.slides.size):
        i, a = holds.slides[k], vector(holds.directions, 3 * k)
        add(A, 4 * i, scaled(-dot(a, vector(A, 4 * i)), a))


@jit
def project(holds: Holds, lower: Array, residual: Array) -> None:
    """H -> P H P + a a^T and g -> P g, P = I - a a^T, where a vertex is held along a.

    The vertices two before and two behind are all that a vertex is tied to, so that the band stays.
    """
    n = residual.size
    for k in range(holds.slides.size):
        o, a = 4 * holds.slides[k], vector(holds.directions, 3 * k)
        add(residual, o, scaled(-dot(a, vector(residual, o)), a))
        for j in range(max(0, o - 8), o):
            column = LOWER * j + o - j
            add(lower, column, scaled(-dot(a, vector(lower, column)), a))
        for j in range(o + 3, min(n, o + 11)):
            c0, c1, c2 = LOWER * o + j - o, LOWER * (o + 1) + j - o - 1, LOWER * (o + 2) + j - o - 2
            s = a[0] * lower[c0] + a[1] * lower[c1] + a[2] * lower[c2]
            lower[c0] -= s * a[0]
            lower[c1] -= s * a[1]
            lower[c2] -= s * a[2]
        c0, c1, c2 = LOWER * o, LOWER * (o + 1), LOWER * (o + 2)
        r0 = (lower[c0], lower[c0 + 1], lower[c0 + 2])
        r1 = (lower[c0 + 1], lower[c1], lower[c1 + 1])
        r2 = (lower[c0 + 2], lower[c1 + 1], lower[c2])
        Ha = (dot(r0, a), dot(r1, a), dot(r2, a))
        s = dot(a, Ha) + 1.0  # P H P + a a^T = H - a (Ha)^T - (Ha) a^T + (a.Ha + 1) a a^T
        for p in range(3):
            for q in range(p, 3):
                lower[LOWER * (o + p) + q - p] += s * a[p] * a[q] - a[p] * Ha[q] - Ha[p] * a[q]


@inline
def set_ghosts(row: Array, tangent: int, director: int, turning: Turning, now: State) -> None:
    """The clamps' frames, from the drive; ghosts that turn stay as they are."""
    for end in range(2):
        if turning.free[end] == 0:
            o = end * (now.t.size - 3)
            for p in range(3):
                now.t[o + p], now.d1[o + p] = row[tangent + 3 * end + p], row[director + 3 * end + p]


@allocating
def place(old: State, base: Array, tau: float, V: Array, row: Array, body: Body, step: Array, now: State) -> None:
    """q = q_ref + tau V, frames and supports included."""
    for k in range(step.size):
        step[k] = base[k] + tau * V[k]
    hold(row, body, old, V, step)
    advance(old, step, 1.0, now)
    set_ghosts(row, TANGENT, DIRECTOR, body.turning, now)
    now.m[:] = old.m


@inline
def to_velocity(old: State, now: State, rate: float, change: Array, V: Array) -> None:
    """V += rate change, with the spin turned from the stage's own chart to that of the step's start.

    d theta = d phi.t + (t0 x t).dt / (1 + t0.t)
    """
    x, tangents, _, _ = now
    before = old.t
    edges = x.size // 3 - 1
    for j in range(1, edges + 1):
        t0, t, e = vector(before, 3 * j), vector(tangents, 3 * j), edge(x, j)
        de = minus(vector(change, 4 * j), vector(change, 4 * j - 4))
        V[4 * j - 1] += rate * (change[4 * j - 1] + dot(cross(t0, t), de) / ((1.0 + dot(t0, t)) * math.sqrt(dot(e, e))))
    for i in range(edges + 1):
        add(V, 4 * i, scaled(rate, vector(change, 4 * i)))


@inline
def renew_tension(
    old: State, now: State, change: Array, rate: float, body: Body, ends: bool, whole: bool, expected: Array
) -> None:
    """What the change on its way makes of the tension, to first order; for an inextensible rod that is its multiplier.

    Newton's matrix takes the tension from here and not from the edges' lengths: a stiff edge that turns is far too long
    before the last iteration (D. Magisano, L. Leonetti, G. Garcea, Comput. Methods Appl. Mech. Eng. 313 (2017) 265).
    """
    for j in range(1, expected.size + 1):
        e = edge(now.x, j)
        de = minus(vector(change, 4 * j), vector(change, 4 * j - 4))
        EA = body.rod.EA[j - 1] * (2.0 if body.inextensible and ends else 1.0)
        stiff = EA + rate * body.viscous_stretch[j - 1]
        along = unit(mix(2.0, e, -1.0, edge(old.x, j))) if whole else unit(e)
        expected[j - 1] += stiff * dot(along, de) / body.rod.l[j - 1]
        if body.inextensible:
            body.rod.T[j - 1] = expected[j - 1]


@inline
def turn_frames(now: State, step: Array, state: State) -> None:
    """Carry the directors from `now` to the state's edges, and turn them by the step's angles."""
    _, tangents, directors, _ = now
    x, new_tangents, new_directors, _ = state
    for j in range(1, x.size // 3):
        t, tangent = vector(tangents, 3 * j), unit(edge(x, j))
        d = vector(directors, 3 * j)
        s = dot(d, tangent) / (1.0 + dot(t, tangent))
        director = unit(across(tangent, mix(1.0, d, -s, mix(1.0, t, 1.0, tangent))))
        theta = step[4 * j - 1]
        turned = mix(math.cos(theta), director, math.sin(theta), cross(tangent, director))
        store(new_tangents, 3 * j, tangent)
        store(new_directors, 3 * j, turned)


@allocating
def stage(
    old: State, start: Array, tau: float, V: Array, body: Body, row: Array, ends: bool, tolerance: float, space: Space,
    now: State,
) -> int:  # fmt: skip
    """Solve eq. (1) from a guess of V, which it replaces; `now` is where the rod then is. Return the iterations, or -1.

    `tolerance` bounds Newton's last change, as a turn in rad; what is left is its square or a small part of it. Newton's
    matrix leaves out how the correction (4) changes, which does not vanish where a spring is almost still (c B dk ~ 1 / dk): where
    small changes shrink slowly the correction is kept. The work that it lacks then is of their size times its own.
    """
    base, step, residual, lower, work, later, before, correction, expected, reaction, _, _, border, corner, general = (
        space
    )
    rate, n = 1.0 / tau, V.size
    last, done, whole = np.inf, 0, ends and general.size > 0
    correction[correction.size - 1] = RENEWED
    moved = body.inextensible
    for k in range(6):
        if row[VELOCITY + k] != 0.0 or row[SPIN + k] != 0.0:
            moved = True
    if ends:
        strains(old, body.rod.first, body.rod.stop, before)
    if body.inextensible:
        body.rod.EA[:] = PENALTY * rate * rate
    for iteration in range(1, MOST_ITERATIONS + 2):
        place(old, base, tau, V, row, body, step, now)
        if ends:
            for p in range(now.x.size):
                later.x[p] = 2.0 * now.x[p] - old.x[p]
            turn_frames(now, step, later)
            set_ghosts(row, NEXT_TANGENT, NEXT_DIRECTOR, body.turning, later)
        forces(old, now, V, rate, body, row, ends, done == 0, space)
        add_inertia(old, now, V, start, rate, body, ends, residual, lower)
        for p in range(3):
            reaction[p], reaction[6 + p] = residual[p], residual[n - 3 + p]
        if done > 0:
            return done
        if iteration > MOST_ITERATIONS:
            return -1
        band.fix(lower, residual, body.fixed)
        project(body.holds, lower, residual)
        for k in range(n):
            residual[k] = -residual[k]
        if whole:
            band.expand(lower, n, general)
            add_lengthening(old, now, rate, body, expected, work, general)
            if not band.solve_general(general, n, residual):
                return -1
        elif not solved(lower, residual, body.closing, border, corner):
            return -1
        size = largest_turn(body.rod.l, residual)
        if not size < LARGEST_TURN or (iteration > PATIENCE and size > max(last, FLOOR)):
            return -1
        renew_tension(old, now, residual, rate, body, ends, whole, expected)
        to_velocity(old, now, rate, residual, V)
        if iteration > 1 and (size <= tolerance or (size <= FLOOR and size > SLOWEST * last)):
            if not moved:
                place(old, base, tau, V, row, body, step, now)
                return iteration
            done = iteration  # the reactions to a tension that the last change made, for their work
        if iteration >= PATIENCE and size <= NEARLY and size > SLOW * last:
            correction[correction.size - 1] = KEPT
        last = size
    return -1


@inline
def settle(now: State, body: Body) -> None:
    """Close a ring, and keep the twists, so that whole turns are not lost."""
    if body.closing.size > 0:
        ring.close(now.t, now.d1, body.closing)
    for i in range(body.rod.first, body.rod.stop):
        now.m[i] = strain(now.t, now.d1, now.m, i)[2]


@inline
def power_of_supports(body: Body, row: Array, reaction: Array) -> float:
    """Force times velocity and moment times turning of both supports."""
    power, last = 0.0, 4 * body.rod.l.size
    for p in range(3):
        if body.fixed[p]:
            power += reaction[p] * row[VELOCITY + p]
        if body.fixed[last + p]:
            power += reaction[6 + p] * row[VELOCITY + 3 + p]
        power += reaction[3 + p] * row[SPIN + p] + reaction[9 + p] * row[SPIN + 3 + p]
    return power


# Methods


@allocating
def midpoint_steps(
    state: State, V: Array, pull: Array, h: float, steps: int, drive: Rows, body: Body, space: Space, now: State,
    velocity: Array, tally: Array, tolerance: float,
) -> int:  # fmt: skip
    """Make steps of the midpoint rule, the k-th with row k of the drive (the last one again where there are no more).

    State, velocities V, tally and the last acceleration `pull`, by which the next step is guessed, are replaced. Returns
    Newton's iterations, or minus (1 + the steps that were made) where one does not converge; state and V are then those
    before it.
    """
    base, step = space.base, space.step
    tau = 0.5 * h
    rows = drive.shape[0]
    n = V.size
    iterations = 0
    base[:] = 0.0
    for k in range(steps):
        row = drive[min(k, rows - 1)]
        for p in range(n):
            velocity[p] = V[p] + tau * pull[p]
        done = stage(state, V, tau, velocity, body, row, True, tolerance, space, now)
        if done < 0:
            return -1 - k
        iterations += done
        settle(now, body)
        tally[DISSIPATED] += h * space.power[0]
        tally[OF_LOADS] += h * space.power[1]
        tally[OF_SUPPORTS] += h * power_of_supports(body, row, space.reaction)
        hold(row, body, state, velocity, step)
        for p in range(n):
            pull[p] = 2.0 * (velocity[p] - V[p]) / h
            V[p] = 2.0 * velocity[p] - V[p]
            step[p] = tau * velocity[p]
        for p in range(3):
            if body.fixed[p]:
                V[p], pull[p] = row[NEXT_VELOCITY + p], 0.0
            if body.fixed[n - 3 + p]:
                V[n - 3 + p], pull[n - 3 + p] = row[NEXT_VELOCITY + 3 + p], 0.0
        for p in range(state.x.size):  # x_1 = x_0 + h v, not 2 x - x_0: that would round
            state.x[p] += h * velocity[4 * (p // 3) + p % 3]
        turn_frames(now, step, state)
        set_ghosts(row, NEXT_TANGENT, NEXT_DIRECTOR, body.turning, state)
        keep_ghosts(state, space.later)
        state.m[:] = now.m
        turn_ghosts(state, body, row, space)
        tally[OF_LOADS] += work_on_ghosts(space.later, state, body, row, row)
        settle(state, body)
    return iterations


@allocating
def accelerations(now: State, V: Array, body: Body, row: Array, space: Space, A: Array) -> None:
    """V' = -M^-1 (G + J omega t'), 0 where a support holds; an inextensible rod's without its tension, which a stage makes up."""
    if body.inextensible:
        body.rod.EA[:] = 0.0
    forces(now, now, V, 0.0, body, row, False, False, space)
    edges = body.rod.l.size
    for j in range(1, edges + 1):
        t, r = vector(now.t, 3 * j), 1.0 / length(now.x, j, edges)
        turning = scaled(r, across(t, minus(vector(V, 4 * j), vector(V, 4 * j - 4))))
        add_moment(space.residual, j, t, r, scaled(body.mass[4 * j - 1] * V[4 * j - 1], turning))
    for p in range(3):
        space.reaction[p], space.reaction[6 + p] = space.residual[p], space.residual[V.size - 3 + p]
    if body.spread[0] == 0.0:
        for k in range(V.size):
            A[k] = 0.0 if body.fixed[k] else -space.residual[k] / body.mass[k]
        if body.closing.size > 0:
            ring.share(space.residual, body.mass, A)
        keep_from_sliding(body.holds, A)
        return
    A[:] = space.residual
    space.lower[:] = 0.0
    add_inertia(now, now, V, V, 1.0, body, False, space.residual, space.lower)
    band.fix(space.lower, A, body.fixed)
    project(body.holds, space.lower, A)
    solved(space.lower, A, body.closing, space.border, space.corner)
    for k in range(V.size):
        A[k] = -A[k]


@allocating
def verlet_steps(
    state: State, V: Array, A: Array, h: float, steps: int, drive: Rows, body: Body, space: Space, now: State,
    tally: Array,
) -> int:  # fmt: skip
    """Make steps of Stoermer and Verlet's method, the k-th to row k of the drive; A are the accelerations at the start.

    Returns the steps, or minus (1 + the steps that were made) where numbers run away.
    """
    rows = drive.shape[0]
    space.base[:] = 0.0
    for k in range(steps):
        row = drive[min(k, rows - 1)]
        for p in range(V.size):
            V[p] += 0.5 * h * A[p]
        place(state, space.base, h, V, row, body, space.step, now)
        settle(now, body)
        if not largest_turn(body.rod.l, space.step) < LARGEST_TURN:
            return -1 - k
        for p in range(V.size):  # where the next velocities will be, for forces that depend on them
            space.step[p] = A[p]
            V[p] += 0.5 * h * A[p]
        for half in range(2):  # the powers at both ends of the step, by halves
            tally[DISSIPATED] += 0.5 * h * space.power[0]
            tally[OF_LOADS] += 0.5 * h * space.power[1]
            tally[OF_SUPPORTS] += 0.5 * h * power_of_supports(body, row, space.reaction)
            if half == 0:
                accelerations(now, V, body, row, space, A)
        tally[OF_LOADS] += work_on_ghosts(state, now, body, row, row)
        for p in range(V.size):
            V[p] += 0.5 * h * (A[p] - space.step[p])
        state.x[:] = now.x
        state.t[:] = now.t
        state.d1[:] = now.d1
        state.m[:] = now.m
    return steps


@allocating
def tr_bdf2_step(
    state: State, V: Array, A: Array, h: float, drive: Rows, body: Body, space: Space, middle: State, now: State,
    V1: Array, error: Array, power: Array, tolerance: float,
) -> int:  # fmt: skip
    """Try one step of TR-BDF2, to (now, V1), from (state, V) with the accelerations A; three rows of the drive.

    `error` gets the estimated error of the packed positions, `power` the three powers at the end; A is replaced by that at
    the end. Returns Newton's iterations, or -1.
    """
    n = V.size
    tau = 0.5 * GAMMA * h
    start = np.empty(n)
    V_middle = np.empty(n)
    first, second = drive[1], drive[2]
    for k in range(n):
        space.base[k] = tau * V[k]
        start[k] = V[k] + tau * A[k]
        V_middle[k] = V[k] + 2.0 * tau * A[k]
    done = stage(state, start, tau, V_middle, body, first, False, tolerance, space, middle)
    if done < 0:
        return -1
    settle(middle, body)
    share = 1.0 / (GAMMA * (2.0 - GAMMA))
    for k in range(n):
        space.base[k] = share * space.step[k]
        V1[k] = V_middle[k] + (1.0 - GAMMA) / GAMMA * (V_middle[k] - V[k])
        start[k] = V[k] + share * (V_middle[k] - V[k])
    more = stage(state, start, tau, V1, body, second, False, tolerance, space, now)
    if more < 0:
        return -1
    now.m[:] = middle.m
    turn_ghosts(now, body, second, space)
    settle(now, body)
    c = 2.0 * h * (-3.0 * GAMMA * GAMMA + 4.0 * GAMMA - 2.0) / (12.0 * (2.0 - GAMMA))
    for k in range(n):
        A[k] = (V1[k] - V[k]) / h if body.fixed[k] else (V1[k] - start[k]) / tau
        error[k] = c * (V[k] / GAMMA - V_middle[k] / (GAMMA * (1.0 - GAMMA)) + V1[k] / (1.0 - GAMMA))
    power[0], power[1], power[2] = space.power[0], space.power[1], power_of_supports(body, second, space.reaction)
    return done + more


# What is measured


@allocating
def measures(state: State, V: Array, body: Body, row: Array, result: Array) -> None:
    """Kinetic energy, bending, twist, stretching, loads' potential; momentum; angular momentum about the origin; supports: (12).

    The last of 13 is the part of bending and twist that no spring has; the powers of the loads count it as theirs.
    """
    x, (f, C) = state.x, body.loads
    result[:] = 0.0
    for i in range(body.rod.l.size + 1):
        m, v = body.mass[4 * i], vector(V, 4 * i)
        result[0] += 0.5 * m * dot(v, v)
        add(result, 5, scaled(m, v))
        add(result, 8, scaled(m, cross(vector(x, 3 * i), v)))
        for g in range(f.size // x.size):
            result[4] += row[FACTORS + g] * load_energy(x, f[g * x.size :], C[2 * g * x.size :], i)
        if i > 0:
            J, spin = body.mass[4 * i - 1], V[4 * i - 1]
            c, de = body.spread[i - 1], minus(v, vector(V, 4 * i - 4))
            result[0] += 0.5 * (J * spin * spin - c * dot(de, de))
            add(result, 8, scaled(-c, cross(edge(x, i), de)))
            add(result, 8, scaled(J * spin, vector(state.t, 3 * i)))
    parts = np.empty(4)
    energy(state, body.rod, body.loads, parts)
    result[1], result[2], result[3] = parts[0], parts[1], 0.0 if body.inextensible else parts[2]
    add_energy_of_carried(state, body, row, result)
    result[11] = energy_of_supports(state, body)
