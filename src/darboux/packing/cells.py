"""What the discrete rods read of the columns: matrices of six numbers, and means over edges and the cells of vertices."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.problem import Equilibrium

Array = NDArray[np.float64]
Function = Callable[[Array], Array]  # of x (n,): (n, k)

SHARPEST = 2.5  # rad, bend of a spring where the natural shape has a narrow one
PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))  # the order in which symmetric matrices are stored


def symmetric(numbers: Array) -> Array:
    """Return (n, 3, 3) from the six numbers 11, 22, 33, 23, 13, 12."""
    return numbers[:, [0, 5, 4, 5, 1, 3, 4, 3, 2]].reshape(-1, 3, 3)


def six(matrix: Array) -> Array:
    """Return the six numbers (n, 6) of symmetric matrices (n, 3, 3)."""
    return np.stack([matrix[:, i, j] for i, j in PAIRS], axis=1)


class Cells:
    """The edges between nodes x = s / L, and the cells of the nodes: half of the edge on either side.

    ``l`` (N,) are the edges' lengths, ``V`` (N + 1,) the cells'. Nodes of a ring may reach beyond 0 and 1, where it goes on.
    """

    def __init__(self, problem: Equilibrium, nodes: Array) -> None:
        self.nodes = nodes
        self.bounds: Array = np.concatenate([nodes[:1], 0.5 * (nodes[:-1] + nodes[1:]), nodes[-1:]])
        self.l, self.V = np.diff(nodes), np.diff(self.bounds)
        self._closed = problem.closed
        steep, L = problem.steep_places, problem.rod.length
        kinks = np.array([*problem.breaks, *steep]) / L
        self._places = self._gone_on(np.append(kinks, 0.0) if self._closed else kinks)
        self._bends = self._gone_on(np.array([*problem.rod.breaks, *steep]) / L)

    def _gone_on(self, places: Array) -> Array:
        """Return places in [0, 1] in rising order; those of rings from -1 to 2."""
        return np.unique(np.concatenate([places - 1.0, places, places + 1.0]) if self._closed else places)

    def vertex(self, x: float) -> int:
        """Return the number of the node next to x."""
        return int(np.argmin(np.abs(self.nodes - x)))

    def at_vertices(self, function: Function) -> Array:
        """Return the mean of a function over each cell: (N + 1, k)."""
        return self._means(function, self.bounds)

    def on_edges(self, function: Function) -> Array:
        """Return the mean of a function over each edge: (N, k)."""
        return self._means(function, self.nodes)

    def _means(self, function: Function, bounds: Array) -> Array:
        """Return means by Gauss' rule of two points, between the kinks, jumps and steep places of the rod's data."""
        inside = self._places[(self._places > bounds[0]) & (self._places < bounds[-1])]
        x: Array = np.union1d(bounds, inside)
        middle, half = 0.5 * (x[:-1] + x[1:]), 0.5 * np.diff(x)
        offset = half / np.sqrt(3.0)
        points = (middle - offset, middle + offset)
        values = [function(at % 1.0 if self._closed else at) for at in points]
        parts = (values[0] + values[1]) * half[:, None]
        if len(inside):
            parts = np.add.reduceat(parts, np.searchsorted(x, bounds[:-1]), axis=0)
        return np.asarray(parts / np.diff(bounds)[:, None])

    def natural_rates(self, k0: Array) -> Array:
        """Return the strains per length (N + 1, 3) of the natural shape, whose mean curvature and twist over the cells is k0.

        They are k0, but where the rod's data jump or have a kink, as about a bend that is narrower than the
        cell: there the spring turns by as much as the rod does. With p the quaternion of that turn, as in
        `discrete_rod.chain_frames`,

            kappa = 2 (p_1, p_2) / sqrt(p_0^2 + p_3^2),   m = 2 atan2(p_3, p_0), and whole turns that bring it next to the turn
                                                          about d3

        Such a spring bends by ``SHARPEST`` at most: half a turn has no strain.
        """
        at = np.diff(np.searchsorted(self._bends, self.bounds)) > 0
        rates, V = k0.copy(), self.V[at, None]
        turn = k0[at] * V
        bend = np.linalg.norm(turn[:, :2], axis=1, keepdims=True)
        turn[:, :2] *= np.minimum(1.0, SHARPEST / np.maximum(bend, SHARPEST))
        p = frames.quaternion_of_turn(turn)
        half = np.arctan2(p[:, 3], p[:, 0])
        whole = np.rint((0.5 * turn[:, 2] - half) / np.pi)
        kappa = 2.0 * p[:, 1:3] * ((-1.0) ** whole / np.hypot(p[:, 0], p[:, 3]))[:, None]
        rates[at] = np.column_stack([kappa, 2.0 * (half + np.pi * whole)]) / V
        return rates
