"""The loads of a motion on the vertices and edges of its rod, in groups that share a factor of time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.discrete_rod import Loads
from darboux.kernels.rod_equations import BINV
from darboux.kernels.rod_motion import Carried
from darboux.loads import EndLoad, Load
from darboux.packing.cells import Cells, six, symmetric
from darboux.packing.loads import COUPLE, DEAD, FOLLOWER, GRADIENT, SECTION_COUPLE, Group
from darboux.packing.problem import Packing

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

    def take(self, g: int, load: EndLoad) -> None:
        """Carry a load of a group."""
        self.force[g], self.couple[g], self.dead[g] = load.section_force, load.section_moment, load.moment
        self.eccentric[g] = load.eccentric.T


def acting(
    packing: Packing, groups: Sequence[Group], cells: Cells, B: Array, kappa0: Array, ends: Sequence[int], closed: bool
) -> Acting:
    """Return the loads at the factor 1: groups (G) of them, springs B (N + 1, 6) and natural strains (N + 1, 3).

    ``ends`` says whose frame the section's is at both ends: FREE, HELD or TURNING. The repeated edge
    of a ``closed`` rod bears nothing.
    """
    G, N = len(groups), len(cells.l)
    edges = N + closed
    f, C, couples = np.zeros((G, edges + 1, 3)), np.zeros((G, edges + 1, 6)), np.zeros((G, edges, 3))
    moments, section_moments = np.zeros((2, G, 2, 3))
    eccentric = np.zeros((G, 2, 3, 3))
    along: list[_Carrier] = []
    points = [_station(packing, x, G, cells) for x in packing.points]
    tips = [_tip(G, at, N, kind, B, kappa0) for at, kind in enumerate(ends)]
    for g, loads in enumerate(groups):
        on_cells = cells.at_vertices(loads.columns) * cells.V[:, None]
        on_edges = cells.on_edges(loads.columns) * cells.l[:, None]
        f[g, : N + 1], couples[g, :N] = on_cells[:, DEAD], on_edges[:, COUPLE]
        C[g, : N + 1] = six(on_cells[:, GRADIENT].reshape(-1, 3, 3))
        followers = on_edges[:, FOLLOWER], on_edges[:, SECTION_COUPLE]
        if np.any(followers):
            along = along or [
                _Carrier(G, j, i, 1.0, np.zeros(3), np.zeros(6)) for j in range(1, N + 1) for i in (j - 1, j)
            ]
            halves = (0.5 * part.repeat(2, axis=0) for part in followers)
            for carrier, b, lb in zip(along, *halves, strict=True):
                carrier.force[g], carrier.couple[g] = b, lb
        for pair, load in zip(points, loads.at_points(), strict=True):
            f[g, pair[0].place[1]] += load.force
            for carrier in pair:
                couples[g, carrier.place[0] - 1] += carrier.share * load.moment
                carrier.take(g, load)
        for at, (tip, name) in enumerate(zip(tips, ("start", "end"), strict=True)):
            load = loads.at_end(name)
            f[g, tip.place[1]] += load.force
            tip.take(g, load)
            if ends[at] == FREE:
                couples[g, tip.place[0] - 1] += load.moment
                continue
            eccentric[g, at] = tip.eccentric[g]
            tip.couple[g] = tip.dead[g] = tip.eccentric[g] = 0.0  # a moment on a ghost is the support's, or turns it
            if ends[at] == TURNING:
                moments[g, at], section_moments[g, at] = load.moment, load.section_moment
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


def datum(packing: Packing, groups: Sequence[Sequence[Load]], cells: Cells) -> Array:
    """Return the potential (G) of a chain that lies in the scale's origin, where the kernels' is zero, at the factor 1.

    -(f.x0 + x0.C x0 / 2) summed over the vertices is zero here at each load's own datum x0.
    """
    result, origin = np.zeros(len(groups)), packing.scale.origin / packing.scale.length
    for g, loads in enumerate(groups):
        for one in (packing.group([load]) for load in loads):
            on_cells, x = cells.at_vertices(one.columns) * cells.V[:, None], one.rest(cells.nodes)
            f, C = on_cells[:, DEAD], on_cells[:, GRADIENT].reshape(-1, 3, 3)
            result[g] += np.sum(x * (f + 0.5 * np.einsum("nij,nj->ni", C, x)))
            at_places = (one.at_end("start"), one.at_end("end"), *one.at_points())
            result[g] -= sum(float(load.force @ origin) for load in at_places)
    return result


def _station(packing: Packing, x: float, G: int, cells: Cells) -> tuple[_Carrier, _Carrier]:
    """Return the two edges that share a load at a vertex, each by the other's length.

    A couple d makes the curvature jump, so that the mean frame of both is turned from the section's by C d l_a l_b / 2
    (l_a + l_b); see docs/decisions.md.
    """
    i = cells.vertex(x)
    a, b = cells.l[i - 1 : i + 1]
    compliance = 0.5 * a * b / (a + b) * packing.columns(cells.nodes[i : i + 1])[0, BINV : BINV + 6]
    first, second = (_Carrier(G, j, i, l / (a + b), np.zeros(3), compliance) for j, l in ((i, b), (i + 1, a)))
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
