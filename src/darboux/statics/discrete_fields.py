"""What a chain in equilibrium says: positions, frames, forces and moments at its vertices, and its energies."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.curve import Curve
from darboux.kernels import discrete_rod
from darboux.kernels.collocation import SHAPED_COUPLE
from darboux.packing import coefficients
from darboux.packing.cells import symmetric
from darboux.packing.loads import LOADS
from darboux.statics.discrete_chain import Chain, EdgeLoads, Shape

Array = NDArray[np.float64]


def curve(chain: Chain, shape: Shape, load_factor: float, gradient: Array) -> Curve:
    """Return positions, frames, forces and moments at the vertices, in SI units, twice where they jump.

    ``gradient`` is that of the energy, less the loads, by all packed unknowns: by the held ones it is the supports' force.
    """
    x, R = shape.state.x.reshape(-1, 3)[1:-1], chain.frames(shape)
    stations = np.array(_at_vertices(chain), dtype=int)
    loads = chain.edge_loads(shape, load_factor)
    n_edges, n = _forces(chain, x, loads, load_factor, gradient)
    if chain.closed:  # s = 0 and s = L are in the middle of the edge that is held
        x = np.concatenate([[x[:2].mean(axis=0)], x[1:-1], [x[-2:].mean(axis=0)]])
    m = _moments(chain, x, shape, R, n_edges)
    behind = np.arange(len(x)) + np.searchsorted(
        stations, np.arange(len(x)), side="left"
    )  # where a vertex stands first
    twice = np.repeat(np.arange(len(x)), np.where(np.isin(np.arange(len(x)), stations), 2, 1))
    nodes = np.clip(chain.nodes, 0.0, 1.0)  # a ring's reach beyond
    c = chain.packing.columns(nodes)
    c[:, LOADS] *= load_factor
    q = _quaternions(chain, R, load_factor)
    y = np.concatenate([x, q, n, m], axis=1)[twice]
    for i in stations:
        _part(chain, i, load_factor, n_edges, y[behind[i] : behind[i] + 2])
    for point in chain.points:  # the couple on each edge acts between its springs
        if point.edges[0] not in stations:  # so close to an end that it counts there
            continue
        for side, j, share in zip((0, 1), point.edges, point.share, strict=True):
            couple = share * (load_factor * point.dead + point.on_edge(R[j], load_factor)[2])
            y[behind[point.edges[0]] + side, 10:13] += (1 - 2 * side) * couple
    dy = coefficients.slopes(c[twice], y)
    if chain.problem.of_shape:
        R = frames.matrix_of_quaternion(y[:, 3:7])
        shaped = load_factor * chain.packing.of_shape(nodes[twice], y[:, :3], R, slopes=False)
        dy[:, 7:10] -= shaped[:, :3]
        dy[:, 10:13] -= shaped[:, SHAPED_COUPLE : SHAPED_COUPLE + 3]
    return chain.scale.curve(nodes[twice], y, dy)


def elastic_parts(chain: Chain, shape: Shape, load_factor: float) -> tuple[float, float, float]:
    """Return the energies of bending, twist and stretch in J: of the springs and the edges, and beside moments at points.

    There the spring has the mean curvature of both sides; that they differ by it stores mu.u / 2, see `PointLoad`.
    """
    parts = np.empty(4)
    discrete_rod.energy(shape.state, chain.elasticity(shape.T), chain.loads(0.0), parts)
    R = chain.frames(shape)
    for point in chain.points:
        for j, share in zip(point.edges, point.share, strict=True):
            mu = point.moment(R[j], load_factor)
            stored = 0.5 * share * mu * (point.c @ mu)
            parts[:2] += stored[0] + stored[1], stored[2]
    bending, twist, stretch = (float(part) * chain.scale.moment for part in parts[:3])
    return bending, twist, 0.0 if chain.inextensible else stretch


def _at_vertices(chain: Chain) -> list[int]:
    """Return the vertices between the ends where n and m may jump."""
    at = {chain.vertex(x) - 1 for x, _ in chain.packing.stations}
    return sorted(i for i in at if 0 < i < chain.edges)


def _part(chain: Chain, i: int, load_factor: float, n: Array, y: Array) -> None:
    """Part a station's force: y (2, 13) in front of it and behind it."""
    a, b = chain.l[i : i + 2] / (chain.l[i] + chain.l[i + 1])
    force = load_factor * chain.distributed[i + 1]
    y[0, 7:10], y[1, 7:10] = n[i - 1] - a * force, n[i] + b * force


def _quaternions(chain: Chain, R: Array, load_factor: float) -> Array:
    """Return the frames at the vertices: between those of the edges' middles on either side, and at the ends the ghosts'.

    Where a moment acts, the section's frame is turned against the mean; see `PointLoad`.
    """
    q = frames.same_sign(frames.quaternion_of_matrix(R))
    l = chain.l[1:-1]
    share = np.concatenate([[1.0], l[1:] / (l[:-1] + l[1:]), [0.0]])[:, None]
    between = share * q[:-1] + (1.0 - share) * q[1:]
    between /= np.linalg.norm(between, axis=1, keepdims=True)
    for point in chain.points:
        i = point.edges[0]
        mean = frames.matrix_of_quaternion(between[i])
        between[i] = frames.product(
            between[i], frames.quaternion_of_turn((point.c @ point.moment(mean, load_factor))[None])[0]
        )
    return frames.same_sign(between)


def _forces(chain: Chain, x: Array, loads: EdgeLoads, load_factor: float, gradient: Array) -> tuple[Array, Array]:
    """Return the inner force in each edge, by balance from the start on, and at each vertex."""
    dead = (chain.f - chain.lever)[1:-1]  # a load close to a vertex counts there
    applied = load_factor * (dead + np.einsum("nij,nj->ni", symmetric(chain.C[1:-1]), x))
    applied += loads.F[1:, 0] + loads.F[:-1, 1]
    reaction = np.append(gradient, 0.0).reshape(-1, 4)[:, :3]
    reaction[1] += reaction[0]
    reaction[-2] += reaction[-1]
    reaction = reaction[1:-1]
    for frozen, last, inner in ((chain.frozen[0], 0, 1), (chain.frozen[1], -1, -2)):
        if frozen:  # the edge is part of its clamp
            reaction[last] += reaction[inner]
            reaction[inner] = 0.0
    held = [0, -1, *(i - 1 for i, _, _ in chain.between)]
    reaction = np.where(np.isin(np.arange(len(x)), np.arange(len(x))[held])[:, None], reaction, 0.0)
    edges = -np.cumsum(applied + reaction, axis=0)[:-1]
    l = chain.l[1:-1]
    vertices = np.empty_like(x)
    weight = (l[1:] / (l[:-1] + l[1:]))[:, None]
    vertices[1:-1] = weight * edges[:-1] + (1.0 - weight) * edges[1:]
    start, end = (load_factor * end.load.force for end in chain.packing.ends)
    vertices[0] = edges[0] + applied[0] - start
    vertices[-1] = edges[-1] - applied[-1] + end
    if chain.closed:
        vertices[[0, -1]] = edges[[0, -1]]
    return edges, vertices


def _moments(chain: Chain, nodes: Array, shape: Shape, R: Array, n: Array) -> Array:
    """Return the moment that each spring transmits, fixed frame; where there is none, by balance over the edge.

    m_i = sum_j mu_j tau_j,   tau_1 = b1' + x c + y b,   tau_2 = b2' + y c - x b,   tau_3 = b + x b2' - y b1'

    with mu = B (kappa - kappa0) / V, (x, y) = (kappa1, kappa2) / 2 and c = x b1' + y b2'; b1', b2' as in kernels/discrete_rod.py.
    """
    rod = chain.elasticity(shape.T)
    kappa = np.empty(3 * (chain.edges + 3))
    discrete_rod.strains(shape.state, rod.first, rod.stop, kappa)
    strain, rest = (part.reshape(-1, 3)[1:-1] for part in (kappa, chain.kappa0))
    mu = np.einsum("nij,nj->ni", symmetric(chain.stiffness.reshape(-1, 6)[1:-1]), strain - rest)
    x, y, half_twist = np.split(0.5 * strain, 3, axis=1)
    cosine, sine = np.cos(half_twist), np.sin(half_twist)
    b1, b2, b = (R[1:, :, i] for i in range(3))
    b1, b2 = cosine * b1 - sine * b2, sine * b1 + cosine * b2
    c = x * b1 + y * b2
    m: Array = mu[:, :1] * (b1 + x * c + y * b) + mu[:, 1:2] * (b2 + y * c - x * b) + mu[:, 2:] * (b + x * b2 - y * b1)
    lever = np.cross(np.diff(nodes, axis=0), n)
    if chain.frozen[0]:
        m[0] = m[1] + lever[0]
    if chain.frozen[1]:
        m[-1] = m[-2] - lever[-1]
    return m
