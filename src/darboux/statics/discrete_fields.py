"""What a chain in equilibrium says: positions, frames, forces and moments at its vertices, and its energies."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.curve import Curve
from darboux.kernels import discrete_rod
from darboux.kernels.rod_equations import BINV, K0
from darboux.statics import coefficients
from darboux.statics.discrete_chain import Chain, Shape, symmetric

Array = NDArray[np.float64]


def curve(chain: Chain, shape: Shape, load_factor: float, gradient: Array) -> Curve:
    """Return positions, frames, forces and moments at the vertices, in SI units.

    ``gradient`` is that of the energy by all unknowns, 4 N + 3: by the held ones it is the force of the supports.
    """
    x = shape.state.x.reshape(-1, 3)
    t, d1 = (part.reshape(-1, 3) for part in shape.state[1:3])
    R = np.stack([d1, np.cross(t, d1), t], axis=-1)
    c = coefficients.columns(chain.problem, chain.scale, chain.nodes)
    c[:, coefficients.LOADS] *= load_factor
    n_edges, n = _forces(chain, shape, load_factor, gradient)
    m = _moments(chain, shape, R, n_edges, load_factor)
    q = _quaternions(chain, R, m, c)
    y = np.concatenate([x, q, n, m], axis=1)
    return chain.scale.curve(chain.nodes, y, coefficients.slopes(c, y))


def elastic_parts(chain: Chain, shape: Shape, load_factor: float) -> tuple[float, float, float]:
    """Return the energies of bending, twist and stretch in J: of the springs, the edges, and the loaded free ends.

    Half a cell at a free end has no spring; under an end moment M it holds 1/2 (R^T M) . B^-1 (R^T M) l / 2.
    """
    parts = np.empty(4)
    discrete_rod.energy(shape.state, chain.elasticity(shape.T), chain.loads(0.0), parts)
    t, d1 = (part.reshape(-1, 3) for part in shape.state[1:3])
    for spring, at, vertex, edge in ((0, "start", 0, 1), (1, "end", -1, -2)):
        held, moment = chain.held[spring], chain.problem.end_load(at).moment
        if not held and np.any(moment):
            R = np.column_stack([d1[edge], np.cross(t[edge], d1[edge]), t[edge]])
            M = R.T @ (load_factor * moment / chain.scale.moment)
            half = 0.25 * chain.l[vertex]
            c = coefficients.columns(chain.problem, chain.scale, chain.nodes[[vertex]])
            k = symmetric(c[:, BINV : BINV + 6])[0] @ M
            parts[:2] += half * (M[:2] @ k[:2]), half * M[2] * k[2]
    bending, twist, stretch = (float(part) * chain.scale.moment for part in parts[:3])
    return bending, twist, 0.0 if chain.inextensible else stretch


def _quaternions(chain: Chain, R: Array, m: Array, c: Array) -> Array:
    """Return the frames at the vertices, between those of the edges' middles on either side."""
    N = chain.edges
    q = frames.same_sign(frames.quaternion_of_matrix(R))
    share = np.concatenate([[0.5], chain.l[1:] / (chain.l[:-1] + chain.l[1:]), [0.5]])[:, None]
    between = share * q[:-1] + (1.0 - share) * q[1:]
    for held, vertex, edge, clamp, sign in ((chain.held[0], 0, 1, 0, -1.0), (chain.held[1], N, N, N + 1, 1.0)):
        if held:
            between[vertex] = q[clamp]
        else:  # a free end: half a segment of the end's curvature beyond the last edge's middle
            k = c[vertex, K0 : K0 + 3] + symmetric(c[vertex : vertex + 1, BINV : BINV + 6])[0] @ (R[edge].T @ m[vertex])
            between[vertex] = frames.product(q[edge], np.concatenate([[1.0], sign * 0.25 * chain.l[edge - 1] * k]))
    return frames.same_sign(between / np.linalg.norm(between, axis=1, keepdims=True))


def _forces(chain: Chain, shape: Shape, load_factor: float, gradient: Array) -> tuple[Array, Array]:
    """Return the inner force in each edge, by balance from the start on, and at each vertex."""
    x = shape.state.x.reshape(-1, 3)
    applied = load_factor * (chain.f + np.einsum("nij,nj->ni", symmetric(chain.C), x))
    reaction = np.append(np.where(chain.fixed, gradient, 0.0), 0.0).reshape(-1, 4)[:, :3]
    if chain.two_vertices:  # a frozen edge is part of its clamp
        for held, last, inner in ((chain.held[0], 0, 1), (chain.held[1], -1, -2)):
            if held:
                reaction[last] += reaction[inner]
                reaction[inner] = 0.0
    total = np.cumsum(applied + reaction, axis=0)
    edges = -total[:-1]
    vertices = np.empty_like(x)
    weight = (chain.l[1:] / (chain.l[:-1] + chain.l[1:]))[:, None]
    vertices[1:-1] = weight * edges[:-1] + (1.0 - weight) * edges[1:]
    start, end = (load_factor * chain.problem.end_load(at).force / chain.scale.force for at in ("start", "end"))
    vertices[0] = edges[0] + applied[0] - start if chain.held[0] else -start
    vertices[-1] = edges[-1] - applied[-1] + end if chain.held[1] else end
    return edges, vertices


def _moments(chain: Chain, shape: Shape, R: Array, n: Array, load_factor: float) -> Array:
    """Return the moment that each spring transmits, fixed frame; where there is none, by balance over the edge.

    m_i = sum_j mu_j tau_j,   tau_1 = (b2 x a - b x a2 + kappa1 a x b) / chi,
    tau_2 = (b x a1 - b1 x a + kappa2 a x b) / chi,   tau_3 = (a + b) / chi,   mu = B (kappa - kappa0) / V
    """
    rod = chain.elasticity(shape.T)
    kappa = np.empty(3 * (chain.edges + 1))
    discrete_rod.strains(shape.state, rod.first, rod.stop, kappa)
    strain = kappa.reshape(-1, 3)
    mu = np.einsum("nij,nj->ni", symmetric(chain.stiffness.reshape(-1, 6)), strain - chain.kappa0.reshape(-1, 3))
    a1, a2, a = (R[:-1, :, i] for i in range(3))
    b1, b2, b = (R[1:, :, i] for i in range(3))
    chi = 1.0 + np.sum(a * b, axis=1, keepdims=True)
    ab = np.cross(a, b)
    tau1 = np.cross(b2, a) - np.cross(b, a2) + strain[:, :1] * ab
    tau2 = np.cross(b, a1) - np.cross(b1, a) + strain[:, 1:2] * ab
    m: Array = (mu[:, :1] * tau1 + mu[:, 1:2] * tau2 + mu[:, 2:] * (a + b)) / chi
    edges = np.diff(shape.state.x.reshape(-1, 3), axis=0)
    lever = np.cross(edges, n)
    start, end = (load_factor * chain.problem.end_load(at).moment / chain.scale.moment for at in ("start", "end"))
    if not chain.springs[0]:
        m[0] = m[1] + lever[0] if chain.held[0] else -start
    if not chain.springs[1]:
        m[-1] = m[-2] - lever[-1] if chain.held[1] else end
    return m
