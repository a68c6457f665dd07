"""The lowest eigenvalues of a discrete rod whose strains keep their own unknowns: its stiffness is never multiplied out.

    K = G + S^T B S           [G - sigma M    S^T  ] [u]   [M v]
                              [S             -B^-1 ] [f] = [ 0 ]                                                     (1)

S makes the strains (bending, twist, stretch) of small motions u, B is their stiffness, f the moments and tensions, and G
what loads, supports and the forces in the rod add. Multiplied out, a spring of EI / h^3 rounds away the lowest modes of a rod
of many segments, and the penalty of an inextensible edge does so sooner; in (1) both are but small compliances. Then

    lambda = (u.G u + S u.B S u) / u.M u                                                                             (2)

where S u is made from the differences of neighbours: what a rigid motion strains is then rounding, and its stiffness the
square of that.

In a frame that turns, or under loads without a potential, modes are u exp(z t) with a complex z:

    (z^2 M + z D + K) u = 0,     z = s + 1 / nu,     (u, z u) -> nu (u, z u) by (1) with G + s D + s^2 M             (3)

Sources: Y. Saad, Numerical Methods for Large Eigenvalue Problems (SIAM, 2011), ch. 8 (shift and invert) through ARPACK;
F. Tisseur and K. Meerbergen, SIAM Review 43 (2001) 235 (quadratic problems); the mixed form: F. Brezzi and M. Fortin, Mixed
and Hybrid Finite Element Methods (Springer, 1991), ch. I.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig, eigh, svd
from scipy.optimize import linear_sum_assignment
from scipy.sparse import block_array, block_diag, csr_array, diags_array
from scipy.sparse.csgraph import connected_components, reverse_cuthill_mckee
from scipy.sparse.linalg import LinearOperator, eigs, eigsh, splu

from darboux.kernels.discrete_rod import Elasticity, State

Array = NDArray[Any]  # real, or complex where modes are

LOW = (
    2.0**-60
)  # of a material's stiffness, what a band keeps that is to have none; a power of two, so that no force is rounded
EXCLUDED = 1e-12  # L^2 / EI times the compliance of an inextensible edge
PENALTY = 1e6  # and, where only signs are counted, its stiffness
SOFT = 1e-9  # of the stiffest of some modes: those below it are found again without it
NOISE = 50.0  # times the rounding in (2): a stiffness below this is 0
DENSE = 200  # unknowns up to which all modes are found at once
EPS = float(np.finfo(float).eps)
STILL = 1e-6  # |z| below this, over sqrt(EI / m L^4), is 0: two roots that meet there are known to the root of rounding
ROUNDED = 1e-8  # and a part of z below this, over |z|
SAME = 0.5  # of a mode's square that lies among the modes of the coarser rod: below this it is none of them
APART = 0.25  # values further apart than this, over the larger, are those of different modes
MARGIN = 6  # modes more than were asked for: some change places with the segments


class Parts(NamedTuple):
    """The stiffness of a discrete rod in its parts, and its mass, by the n unknowns that nothing holds."""

    G: Any  # (n, n)
    E: Any  # (4 N, n) differences of the edges' ends, and the edges' turns
    L: Any  # (r, 4 N) strains by these
    B: Any  # (r, r) 0 for a strain that is excluded
    C: Any  # (r, r) B^-1
    M: Any  # (n, n)
    g: Array  # (n,) what is left of the forces, which should be 0
    D: Any = None  # (n, n) by velocities


class Found(NamedTuple):
    """The lowest modes of one discrete rod, k of them, in its dimensionless numbers; shapes by packed unknowns."""

    values: Array  # (k,) lambda of (2), or z of (3)
    shapes: Array  # (4 N + 3, k)
    nodes: Array  # (N + 1,)
    weights: Array  # (4 N + 3,) mass and rotary inertia, by which two shapes are compared


def without_material(rod: Elasticity, kappa: Array, stretch: Array) -> Elasticity:
    """Return what has the same forces at the strains (3 n,) and stretches (N,) and, but for LOW of it, no stiffness."""
    stressed = (kappa - rod.kappa0) / LOW
    return rod._replace(B=LOW * rod.B, kappa0=kappa - stressed, EA=LOW * rod.EA, T=rod.T + rod.EA * stretch)


def strains_of(state: State, rod: Elasticity, kappa: Array, inextensible: bool) -> tuple[Any, Any, Any, Any]:
    """Return E, L, B and C by packed unknowns; the derivatives of the strains are those of kernels/discrete_rod.py."""
    N, at = rod.l.size, np.arange(rod.first, rod.stop)
    e = np.diff(state.x.reshape(-1, 3), axis=0)
    size = np.linalg.norm(e, axis=1)
    x, y, one = 0.5 * kappa[3 * at], 0.5 * kappa[3 * at + 1], np.ones(len(at))
    p, q1, q2 = x * y, 1.0 + x * x, 1.0 + y * y
    gradients = (  # of kappa1, kappa2 and m by w1, w2 and theta, in the turned frames of both edges
        (at, 1.0, ((-p, q1, y), (-q2, p, -x), (x, y, -one))),
        (at + 1, -1.0, ((p, -q1, y), (q2, -p, -x), (x, y, one))),
    )
    entries = []
    for j, sign, by in gradients:
        t, d1 = state.t.reshape(-1, 3)[j], state.d1.reshape(-1, 3)[j]
        d2, half = np.cross(t, d1), 0.5 * sign * kappa[3 * at + 2]
        c, s = np.cos(half)[:, None], np.sin(half)[:, None]
        f1, f2 = ((c * d1 + s * d2) / size[j - 1, None]).T, ((c * d2 - s * d1) / size[j - 1, None]).T
        for strain, (by1, by2, turn) in enumerate(by):
            columns = (*(by1 * f1 + by2 * f2), turn)
            entries += [(3 * (at - rod.first) + strain, 4 * (j - 1) + k, value) for k, value in enumerate(columns)]
    springs, along = 3 * len(at), np.flatnonzero(rod.EA > 0.0)
    count = len(along)
    entries += [(springs + np.arange(count), 4 * along + k, (e[:, k] / size)[along]) for k in range(3)]
    unknown = np.arange(4 * N)
    moves = unknown[unknown % 4 < 3]
    ahead = [
        (unknown, np.where(unknown % 4 < 3, unknown + 4, unknown), np.ones(4 * N)),
        (moves, moves, -np.ones(3 * N)),
    ]
    B = rod.B.reshape(-1, 6)[at][:, [0, 5, 4, 5, 1, 3, 4, 3, 2]].reshape(-1, 3, 3)
    l = rod.l[along]
    EA, slack = (np.zeros(count), EXCLUDED * l) if inextensible else (rod.EA[along] / l, l / rod.EA[along])
    return (
        _filled(ahead, (4 * N, 4 * N + 3)),
        _filled(entries, (springs + count, 4 * N)),
        block_diag([*B, diags_array(EA)], format="csr"),
        block_diag([*np.linalg.inv(B), diags_array(slack)], format="csr"),
    )


def _filled(entries: list[tuple[Array, Array, Array]], shape: tuple[int, int]) -> Any:
    rows, columns, values = (np.concatenate(part) for part in zip(*entries, strict=True))
    return csr_array((values, (rows, columns)), shape=shape)


# One rod


def lowest(parts: Parts, k: int) -> tuple[Array, Array]:
    """Return the k lowest eigenvalues of K u = lambda M u and their vectors (n, k); what is 0 but for rounding is 0."""
    n = parts.M.shape[0]
    shift = _below(parts)
    inverse = _inverse(parts, parts.G - shift * parts.M)
    if n <= DENSE:  # where what has no mass is a large part, Krylov's space may end too soon
        m, V = eigh(parts.M.toarray())
        root = V * np.sqrt(np.maximum(m, 0.0)) @ V.T
        nu, Y = eigh(root @ inverse(root))
        finite = np.flatnonzero(nu > EPS * n * nu[-1])[::-1][:k]
        return _refined(parts, inverse(root @ Y[:, finite] / nu[finite]))
    start = parts.M @ np.random.default_rng(1).normal(size=n)
    operator = LinearOperator((n, n), matvec=inverse, dtype=float)
    _, vectors = eigsh(
        parts.M, k, M=parts.M, sigma=shift, OPinv=operator, v0=start, ncv=min(n - 1, max(2 * k + 10, 30))
    )
    return _refined(parts, vectors)


def _below(parts: Parts) -> float:
    """Return a shift below all eigenvalues: K less the shift has no negative pivot (Sylvester's law of inertia)."""
    S, stiff = parts.L @ parts.E, parts.B.diagonal()
    B = parts.B + diags_array(np.where(stiff == 0.0, PENALTY, 0.0))
    K, shift = parts.G + S.T @ B @ S, -1.0
    while True:  # rows and columns in one order, or the law would not hold
        options: dict[str, Any] = {"diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
        pivots = splu((K - shift * parts.M).tocsc(), permc_spec="MMD_AT_PLUS_A", **options).U.diagonal()
        if np.all(pivots > 0.0):
            return shift
        shift *= 4.0


def _inverse(parts: Parts, G: Any) -> Callable[[Array], Array]:
    """Return what solves (1) for u, with a matrix in the place of G - sigma M."""
    S = parts.L @ parts.E
    n, r = parts.M.shape[0], S.shape[0]
    matrix = block_array([[G, S.T], [S, -parts.C]], format="csc")
    order = reverse_cuthill_mckee(matrix, symmetric_mode=True)
    factors = splu(matrix[order][:, order].tocsc(), permc_spec="NATURAL")
    back = np.argsort(order)

    def solved(right: Array) -> Array:
        return np.asarray(factors.solve(right[order])[back])

    def inverse(v: Array) -> Array:
        right = np.concatenate([v, np.zeros((r, *v.shape[1:]))])
        x = solved(right)
        return np.asarray((x + solved(right - matrix @ x))[:n])

    return inverse


def _refined(parts: Parts, Z: Array) -> tuple[Array, Array]:
    """Return the eigenvalues by (2) in the span of vectors (n, k), and these; the soft ones among themselves once more.

    For the stiffest among the modes rounds the others where they are mixed.
    """
    soft = np.ones(Z.shape[1], dtype=bool)
    values = np.zeros(Z.shape[1])
    while np.any(soft):
        strains = parts.L @ (parts.E @ Z[:, soft])
        K = Z[:, soft].T @ (parts.G @ Z[:, soft]) + strains.T @ (parts.B @ strains)
        M = Z[:, soft].T @ (parts.M @ Z[:, soft])
        values[soft], turn = eigh(0.5 * (K + K.T), 0.5 * (M + M.T))
        Z[:, soft] = Z[:, soft] @ turn
        softer = soft & (np.abs(values) < SOFT * np.max(np.abs(values[soft])))
        if np.array_equal(softer, soft):
            break
        soft = softer
    return np.where(np.abs(values) < _noise(parts, Z), 0.0, values), Z


def _noise(parts: Parts, Z: Array) -> Array:
    """Return what (2) can't tell from 0, for vectors (n, k) of the mass 1.

    Entries of G are rounded at random, the strains by those of the vertices; and off an equilibrium, a rigid rotation has the
    stiffness -g.x (1 rad).
    """
    G = parts.G.tocoo()
    entries = (G.data[:, None] * Z[G.coords[0]] * Z[G.coords[1]]) ** 2
    strains = EPS * (abs(parts.L) @ (abs(parts.E) @ np.abs(Z)))
    rounding = EPS * np.sqrt(np.sum(entries, axis=0)) + parts.B.diagonal() @ strains**2
    return np.asarray(NOISE * rounding + np.linalg.norm(parts.g) * np.max(np.abs(Z), axis=0) ** 2)


def whirling(parts: Parts, k: int) -> tuple[Array, Array]:
    """Return the k roots z of (3) next to 0, one of each conjugate pair, and their vectors (n, k), both complex."""
    n = parts.M.shape[0]
    M, D = parts.M, parts.D
    s = float(np.sqrt(-_below(parts._replace(G=0.5 * (parts.G + parts.G.T)))))  # nothing grows faster
    inverse = _inverse(parts, parts.G + s * D + s**2 * M)

    def step(y: Array) -> Array:
        u, v = y[:n], y[n:]
        new = inverse(-(M @ v + D @ u + s * (M @ u)))
        return np.concatenate([new, s * new + u])

    if n <= DENSE:
        nu, vectors = eig(step(np.eye(2 * n)))
        finite = np.flatnonzero(np.abs(nu) > EPS * n * np.max(np.abs(nu)))
        finite = finite[np.argsort(-np.abs(nu[finite]))][: 2 * k + 4]
        nu, vectors = nu[finite], vectors[:, finite]
    else:
        start, count = step(np.random.default_rng(1).normal(size=2 * n)), 2 * k + 4
        operator = LinearOperator((2 * n, 2 * n), matvec=step, dtype=float)
        nu, vectors = eigs(operator, count, which="LM", v0=start, ncv=2 * count + 20)
    z = s + 1.0 / nu
    Z = np.abs(vectors[:n])
    z[np.abs(z) ** 2 < _noise(parts, Z / np.sqrt(np.sum(Z * (M @ Z), axis=0)))] = 0.0
    for part in (z.real, z.imag):
        part[np.abs(part) < STILL + ROUNDED * np.abs(z)] = 0.0
    once = np.flatnonzero((z.imag > 0.0) | ((z.imag == 0.0) & (z.real >= 0.0)))
    still = once[z[once] == 0.0]  # a motion that nothing resists has the root 0 twice
    once = np.setdiff1d(once, still[(len(still) + 1) // 2 :])
    return z[once], vectors[:n, once]


# Two rods, one of them finer


def extrapolated(coarse: Found, fine: Found, gain: float, of_pairs: bool) -> tuple[Array, Array]:
    """Return values extrapolated (Richardson) from those of the same shapes, and the fine rod's shapes that go with them.

        H = L_fine + gain (L_fine - P^T L_coarse P)

    with L the values and P the coarse modes among the fine ones, by their overlaps with the mass, made orthogonal; modes whose
    values lie apart mix only where they have changed places. So these, and those of one value, whose shapes are any of their
    plane, are compared with their own. What is not among the coarse modes stays what it is, as do the motions of no stiffness.
    Complex values are those of single modes.
    """
    near, apart = _overlaps(coarse, fine), _apart(coarse.values, fine.values)
    if of_pairs:
        rows, columns = linear_sum_assignment(apart - np.abs(near))
        values = fine.values.copy()
        for i, j in zip(rows, columns, strict=True):
            if np.abs(near[i, j]) ** 2 > SAME and fine.values[j] != 0.0:
                values[j] += gain * (fine.values[j] - coarse.values[i])
        return values, fine.shapes
    near[(apart > APART) & (near**2 < SAME)] = 0.0
    known = (np.sum(near**2, axis=0) > SAME) & (fine.values != 0.0)
    values, shapes = fine.values.copy(), fine.shapes.copy()
    _, group = connected_components(
        np.block([[np.zeros((len(near),) * 2), near], [near.T, np.zeros((len(known),) * 2)]])
    )
    for one in np.unique(group[len(near) :][known]):  # each by itself, or a soft mode is rounded by the stiff ones
        rows = np.flatnonzero(group[: len(near)] == one)
        own = np.flatnonzero((group[len(near) :] == one) & known)
        U, _, V = svd(near[np.ix_(rows, own)], full_matrices=False)
        P = U @ V
        H = np.diag((1.0 + gain) * fine.values[own]) - gain * P.T @ (coarse.values[rows, None] * P)
        values[own], turn = eigh(H)
        shapes[:, own] = fine.shapes[:, own] @ turn
    return values, shapes


def _apart(a: Array, b: Array) -> Array:
    """Return how far values (k,) are from others (l,), over their size: (k, l)."""
    size = np.maximum(np.abs(a)[:, None], np.abs(b)[None])
    return np.asarray(np.abs(a[:, None] - b[None]) / np.where(size > 0.0, size, 1.0))


def _overlaps(coarse: Found, fine: Found) -> Array:
    """Return the cosines, in the norm of the mass, of the angles between the modes of two rods: (k, l)."""
    there = _on_nodes(coarse, fine.nodes)
    w = fine.weights[:, None]
    sizes = [np.sqrt(np.sum(w * np.abs(shapes) ** 2, axis=0)) for shapes in (there, fine.shapes)]
    return np.asarray(there.conj().T @ (w * fine.shapes) / np.outer(*sizes))


def _on_nodes(found: Found, nodes: Array) -> Array:
    """Return the shapes of a rod, linear between its nodes and between the middles of its edges, on other nodes."""
    k = found.shapes.shape[1]
    packed = np.vstack([found.shapes, np.zeros((1, k))]).reshape(-1, 4, k)
    result = np.zeros((len(nodes), 4, k), dtype=packed.dtype)
    middles = [0.5 * (x[1:] + x[:-1]) for x in (found.nodes, nodes)]
    for i in range(k):
        for c in range(3):
            result[:, c, i] = np.interp(nodes, found.nodes, packed[:, c, i])
        result[:-1, 3, i] = np.interp(middles[1], middles[0], packed[:-1, 3, i])
    return result.reshape(-1, k)[:-1]
