"""The supports of a rod in motion: which vertices they hold along what, and whose frame its ends have."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, identity
from scipy.sparse.linalg import splu

from darboux.dynamics.acting import FREE, HELD, TURNING
from darboux.kernels.rod_motion import Holds
from darboux.packing.cells import Cells, six
from darboux.packing.ends import EndConditions
from darboux.packing.problem import Packing

Array = NDArray[np.float64]
Supports = list[tuple[int, EndConditions]]  # with their vertices

MOST_CHANGES = 50  # of Newton's method, by which a polygon is fitted
SHORTEST_PART = 2.0**-10  # of one of them
APART = 1e-14  # of constraints that all but say the same


class Ghosts(NamedTuple):
    """The ends' frames, in the arrays of the kernel; see ``rod_motion.Turning``."""

    free: NDArray[np.int64]
    axes: Array
    frame: Array
    stiffness: Array


def kind_of(support: EndConditions) -> int:
    """Return whose frame the section's is at an end: its edge's (FREE), or that of a ghost that is HELD or TURNING."""
    if all(support.held_turns):
        return HELD
    return TURNING if any(support.held_turns) or support.sprung[1] else FREE


def supports_at(packing: Packing, held: tuple[bool, bool], cells: Cells) -> Supports:
    """Return the supports with their vertices, the ends first; ``held`` says whether an end's has not let go."""
    start, end = packing.released([at for at, still in zip(("start", "end"), held, strict=True) if not still]).ends
    between = [(cells.vertex(x), support) for x, support in packing.stations if support.holds]
    return [(0, start), (len(cells.l), end), *between]


def moves_with(i: int, edges: int, support: EndConditions) -> bool:
    """Return whether a support holds an end's vertex in all directions: its place may then be one that moves."""
    return i in (0, edges) and all(support.held_places)


def holds(supports: Supports, edges: int, closed: bool) -> Holds:
    """Return what is held along single directions, or by springs; a closed chain's vertex 1 stands once more behind its last."""
    slides: list[tuple[int, Array, float]] = []
    anchors: list[tuple[int, Array, Array]] = []
    for i, support in supports:
        if not moves_with(i, edges, support):
            twice = (i, edges + 1) if closed and i == 1 else (i,)
            slides += [(k, axis, float(axis @ support.place)) for k in twice for axis in support.held_axes]
        if support.sprung[0]:
            anchors.append((i, six(support.stiffness[None, :3, :3])[0], support.place))
    return Holds(
        np.array([i for i, _, _ in slides], dtype=np.int64),
        np.array([axis for _, axis, _ in slides], dtype=float).ravel(),
        np.array([level for _, _, level in slides], dtype=float),
        np.array([i for i, _, _ in anchors], dtype=np.int64),
        np.array([K for _, K, _ in anchors], dtype=float).ravel(),
        np.array([place for _, _, place in anchors], dtype=float).ravel(),
    )


def ghosts(supports: Supports) -> Ghosts:
    """Return the ghosts of both ends that turn, by their free axes."""
    count, axes, frame, stiffness = (
        np.zeros(2, dtype=np.int64),
        np.eye(3)[None].repeat(2, 0),
        np.zeros((2, 3, 3)),
        np.zeros((2, 6)),
    )
    for end, (_, support) in enumerate(supports[:2]):
        frame[end] = support.frame.T
        if kind_of(support) == TURNING:
            free = ~support.held_turns
            count[end] = np.count_nonzero(free)
            axes[end, : count[end]] = support.turn_axes.T[free]
            stiffness[end] = six(support.stiffness[None, 3:, 3:])[0]
    return Ghosts(count, axes.ravel(), frame.ravel(), stiffness.ravel())


def fitted(x: Array, l: Array, held: list[tuple[int, Array, float]], closed: bool) -> Array:
    """Return vertices near x (N + 1, 3) whose edges have the lengths l (N,), as near to that as they can.

        J J^T p = c,   x -> x - J^T p,     c = (|e_j| - l_j, axis.x_i - level)

    Newton's method, each change the smallest that meets the constraints c to first order, or the largest part of it by which
    they become less. ``held`` are vertex, axis (3,) and level of what supports hold; the last vertex of a ``closed`` polygon is
    its first.
    """
    N, n = len(l), len(x) - int(closed)
    tail, head = np.arange(N), np.arange(1, N + 1) % n
    at = np.array([i % n for i, _, _ in held], dtype=int)
    axes, levels = np.array([a for _, a, _ in held]).reshape(-1, 3), np.array([level for *_, level in held])
    rows = np.repeat(np.concatenate([tail, tail, N + np.arange(len(at))]), 3)
    columns = (3 * np.concatenate([tail, head, at])[:, None] + np.arange(3)).ravel()

    def short(y: Array) -> Array:
        size = np.linalg.norm(y[head] - y[tail], axis=1)
        return np.concatenate([size - l, np.sum(axes * y[at], axis=1) - levels])

    y = x[:n].copy()
    c = short(y)
    for _ in range(MOST_CHANGES):
        e = y[head] - y[tail]
        t = e / np.linalg.norm(e, axis=1)[:, None]
        J = csr_matrix((np.concatenate([-t, t, axes]).ravel(), (rows, columns)), (N + len(at), 3 * n))
        change = (J.T @ splu((J @ J.T + APART * identity(N + len(at))).tocsc()).solve(c)).reshape(-1, 3)
        part = 1.0
        while part > SHORTEST_PART and not np.linalg.norm(short(y - part * change)) < np.linalg.norm(c):
            part *= 0.5
        if part <= SHORTEST_PART:
            break
        y = y - part * change
        c = short(y)
    return np.concatenate([y, y[: int(closed)]])
