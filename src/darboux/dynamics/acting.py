"""The loads of a motion on the vertices and edges of its rod, in groups that share a factor of time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.discrete_rod import Loads
from darboux.kernels.rod_equations import BINV
from darboux.kernels.rod_motion import Carried
from darboux.loads import Distributed, EndLoad, Load
from darboux.packing import coefficients
from darboux.packing.cells import six, symmetric
from darboux.packing.scale import Scale
from darboux.problem import Equilibrium
from darboux.statics.discrete_chain import means, places_along

Array = NDArray[np.float64]

FREE, HELD, TURNING = 0, 1, 2  # the frame of an end: its edge's, a ghost's that is held, a ghost's that turns


class Acting(NamedTuple):
    """What acts, in the arrays of the kernels."""

    loads: Loads
    couples: Array
    carried: Carried
    moments: Array  # (G 6) dead, on ghosts that turn
    section_moments: Array  # (G 6)
    eccentric: Array  # (G 18) at ends that have a ghost


class _Carrier:
    """An edge and a vertex that carry a load of the section."""

    def __init__(self, groups: int, edge: int, vertex: int, share: float, turn: Array, compliance: Array) -> None:
        self.place, self.share, self.turn, self.compliance = (edge, vertex), share, turn, compliance
        self.force, self.couple, self.dead = np.zeros((3, groups, 3))
        self.eccentric = np.zeros((groups, 3, 3))  # A^T


def acting(
    problem: Equilibrium,
    groups: Sequence[Sequence[Load]],
    nodes: Array,
    scale: Scale,
    B: Array,
    kappa0: Array,
    ends: Sequence[int],
) -> Acting:
    """Return the loads at the factor 1: groups (G) of them, springs B (N + 1, 6) and natural strains (N + 1, 3).

    ``ends`` says whose frame the section's is at both ends: FREE, HELD or TURNING. A ring's repeated edge bears nothing.
    """
    G, N, L, places = len(groups), len(nodes) - 1, scale.length, places_along(problem)
    l = np.diff(nodes)
    cells = np.concatenate([[0.0], 0.5 * (nodes[:-1] + nodes[1:]), [1.0]])
    V = np.diff(cells)[:, None]
    edges = N + problem.closed
    f, C, couples = np.zeros((G, edges + 1, 3)), np.zeros((G, edges + 1, 6)), np.zeros((G, edges, 3))
    moments, section_moments = np.zeros((2, G, 2, 3))
    eccentric = np.zeros((G, 2, 3, 3))
    along: list[_Carrier] = []
    points = [_station(problem, s, G, nodes, scale) for s in problem.points]
    tips = [_tip(G, at, N, kind, B, kappa0) for at, kind in enumerate(ends)]
    for g, loads in enumerate(groups):

        def per_length(s: Array, loads: Sequence[Load] = loads) -> Array:
            total = Distributed.zero(len(s))
            for load in loads:
                load.add_distributed(total, s * L, problem.rod)
            a = (total.a + total.C @ scale.origin) * (L / scale.force)
            parts = a, total.C.reshape(-1, 9) * (L * L / scale.force), total.la / scale.force
            return np.concatenate([*parts, total.b * (L / scale.force), total.lb / scale.force], axis=1)

        on_cells, on_edges = means(per_length, cells, places) * V, means(per_length, nodes, places) * l[:, None]
        f[g, : N + 1], couples[g, :N] = on_cells[:, :3], on_edges[:, 12:15]
        C[g, : N + 1] = six(on_cells[:, 3:12].reshape(-1, 3, 3))
        if np.any(on_edges[:, 15:]):
            along = along or [
                _Carrier(G, j, i, 1.0, np.zeros(3), np.zeros(6)) for j in range(1, N + 1) for i in (j - 1, j)
            ]
            for carrier, (b, lb) in zip(along, 0.5 * on_edges[:, 15:].repeat(2, axis=0).reshape(-1, 2, 3), strict=True):
                carrier.force[g], carrier.couple[g] = b, lb
        for pair, s in zip(points, problem.points, strict=True):
            total = EndLoad()
            for load in loads:
                if problem.point_of(load) == s:
                    load.add_point(total)
            f[g, pair[0].place[1]] += total.force / scale.force
            for carrier in pair:
                couples[g, carrier.place[0] - 1] += carrier.share * total.moment / scale.moment
                _take(carrier, g, total, scale)
        for at, (tip, name) in enumerate(zip(tips, ("start", "end"), strict=True)):
            total = EndLoad()
            for load in loads:
                load.add_end(name, total)
            f[g, tip.place[1]] += total.force / scale.force
            _take(tip, g, total, scale)
            if ends[at] == FREE:
                couples[g, tip.place[0] - 1] += total.moment / scale.moment
                continue
            eccentric[g, at] = tip.eccentric[g]
            tip.couple[g] = tip.dead[g] = tip.eccentric[g] = 0.0  # a moment on a ghost is the support's, or turns it
            if ends[at] == TURNING:
                moments[g, at] = total.moment / scale.moment
                section_moments[g, at] = total.section_moment / scale.moment
    carriers = [
        c
        for c in (*along, *(c for pair in points for c in pair), *tips)
        if any(np.any(getattr(c, part)) for part in PARTS)
    ]
    carried = Carried(
        np.array([c.place for c in carriers], dtype=np.int64).ravel(),
        np.array([c.share for c in carriers], dtype=float),
        _flat([c.turn for c in carriers]),
        _flat([c.compliance for c in carriers]),
        *(_flat(list(np.swapaxes([getattr(c, part) for c in carriers], 0, 1)) if carriers else []) for part in PARTS),
    )
    on_ghosts = moments.ravel(), section_moments.ravel(), eccentric.ravel()
    return Acting(Loads(f.ravel(), C.ravel()), couples.ravel(), carried, *on_ghosts)


PARTS = ("force", "couple", "dead", "eccentric")


def datum(problem: Equilibrium, groups: Sequence[Sequence[Load]], nodes: Array, scale: Scale) -> Array:
    """Return the potential (G) of a chain that lies in ``scale.origin``, where the kernels' is zero, at the factor 1.

    -(f.x0 + x0.C x0 / 2) summed over the vertices is zero here at each load's own datum x0.
    """
    L, result, places = scale.length, np.zeros(len(groups)), places_along(problem)
    cells = np.concatenate([[0.0], 0.5 * (nodes[:-1] + nodes[1:]), [1.0]])
    for g, loads in enumerate(groups):
        for load in loads:

            def per_length(s: Array, load: Load = load) -> Array:
                own = Distributed.zero(len(s))
                load.add_distributed(own, s * L, problem.rod)
                return np.concatenate([own.a + own.C @ scale.origin, own.C.reshape(-1, 9) * L], axis=1)

            x = (load.datum(nodes * L) - scale.origin) / L
            means_on_cells = means(per_length, cells, places) * (np.diff(cells)[:, None] * L / scale.force)
            f, C = means_on_cells[:, :3], means_on_cells[:, 3:].reshape(-1, 3, 3)
            result[g] += np.sum(x * (f + 0.5 * np.einsum("nij,nj->ni", C, x)))
            point = EndLoad()
            for at in ("start", "end"):
                load.add_end(at, point)
            if load.station is not None:
                load.add_point(point)
            result[g] -= point.force @ scale.origin / scale.moment
    return result


def _take(carrier: _Carrier, g: int, total: EndLoad, scale: Scale) -> None:
    carrier.force[g] = total.section_force / scale.force
    carrier.couple[g] = total.section_moment / scale.moment
    carrier.dead[g] = total.moment / scale.moment
    carrier.eccentric[g] = total.eccentric.T / scale.moment


def _station(problem: Equilibrium, s: float, G: int, nodes: Array, scale: Scale) -> tuple[_Carrier, _Carrier]:
    """Return the two edges that share a load at a vertex, each by the other's length.

    A couple d makes the curvature jump, so that the mean frame of both is turned from the section's by C d l_a l_b / 2
    (l_a + l_b); see docs/decisions.md.
    """
    i = int(np.argmin(np.abs(nodes - s / scale.length)))
    a, b = nodes[i] - nodes[i - 1], nodes[i + 1] - nodes[i]
    compliance = 0.5 * a * b / (a + b) * coefficients.columns(problem, scale, nodes[i : i + 1])[0, BINV : BINV + 6]
    first, second = (_Carrier(G, j, i, x / (a + b), np.zeros(3), compliance) for j, x in ((i, b), (i + 1, a)))
    return first, second


def _tip(G: int, at: int, N: int, kind: int, B: Array, kappa0: Array) -> _Carrier:
    """Return what carries the loads on the start (0) or the end (1): a ghost's frame, or the edge's turned by half a cell."""
    vertex, edge, ghost = ((0, 1, 0), (N, N, N + 1))[at]
    if kind != FREE:
        return _Carrier(G, ghost, vertex, 1.0, np.zeros(3), np.zeros(6))
    turn = kappa0[vertex] * (1.0 if at else -1.0)
    compliance = six(np.asarray(np.linalg.inv(symmetric(B[vertex : vertex + 1]))))[0]
    return _Carrier(G, edge, vertex, 1.0, turn, compliance)


def _flat(parts: list[Array]) -> Array:
    return np.array(parts, dtype=float).ravel()
