"""The mesh of a collocation solution: states at nodes and at Gauss' points, and how a better mesh is laid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from darboux.kernels import mesh as kernel
from darboux.kernels.gauss import METHODS, PER_METHOD
from darboux.kernels.rod_equations import STATES

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Nodes x (N + 1,) in [0, 1], states y (N + 1, 13) there and Y (N, stages, 13) at Gauss' points, dimensionless.

    At a station the node stands twice, for the states before and behind it: an element of no width, a joint.
    """

    x: Array
    y: Array
    Y: Array

    @property
    def stages(self) -> int:
        """How many Gauss' points an element has."""
        return int(self.Y.shape[1])

    @cached_property
    def wide(self) -> NDArray[np.bool_]:
        """Which elements have a width: all but the joints (N,)."""
        return np.diff(self.x) > 0.0

    @cached_property
    def joints(self) -> NDArray[np.intp]:
        """The numbers of the joints, which are those of their first nodes."""
        return np.flatnonzero(~self.wide)

    @property
    def elements(self) -> int:
        """How many elements have a width."""
        return len(self.x) - 1 - len(self.joints)

    def at(self, x: Array) -> Array:
        """Return the states at x (n,), ascending, by the polynomials through the start and the stages of each element: (n, 13)."""
        result = np.empty((len(x), STATES))
        kernel.interpolate(self.x, self.y.ravel(), self.Y.ravel(), self.stages, x, result.ravel())
        return result

    def laid(self, x: Array, stages: int | None = None) -> Mesh:
        """Return the same solution on other nodes, as the guess of a new one; x holds each station twice."""
        stages = stages or self.stages
        y, Y = np.empty((len(x), STATES)), np.empty((len(x) - 1, stages, STATES))
        kernel.lay_on(self.x, self.y.ravel(), self.Y.ravel(), self.stages, x, y.ravel(), Y.ravel(), stages)
        return Mesh(x, y, Y)

    def jointed(self, places: Array) -> Mesh:
        """Return the mesh with the nodes at the places (n,) doubled, by a joint each."""
        at = np.searchsorted(self.x, places)
        Y = np.insert(self.Y, at, self.y[at][:, None], axis=0)
        return Mesh(np.insert(self.x, at, self.x[at]), np.insert(self.y, at, self.y[at], axis=0), Y)

    def halved(self) -> Mesh:
        """Return the solution with every element halved."""
        middle = 0.5 * (self.x[1:] + self.x[:-1])[self.wide]
        return self.laid(np.sort(np.concatenate([self.x, middle])))

    @property
    def in_halves(self) -> NDArray[np.intp]:
        """Where the nodes stand among those of the halved mesh: (N + 1,)."""
        return np.concatenate([[0], np.cumsum(np.where(self.wide, 2, 1))])

    def roughness(self, breaks: Array) -> Array:
        """Return, per element with a width, the size of what its polynomials leave out: h^(s+1) times the next derivative.

        The next derivative is taken from the jumps of the highest ones at the nodes, but for those at breaks
        (U. M. Ascher, J. Christiansen and R. D. Russell, Math. Comp. 33 (1979) 659, section 3).
        """
        result = np.empty(self.elements)
        kernel.roughness(self.x, self.y.ravel(), self.Y.ravel(), self.stages, breaks, result)
        return result

    def redistributed(self, elements: int, breaks: Array, stages: int | None = None) -> Mesh:
        """Return the solution on about so many elements, laid so that each leaves out as much as any other."""
        wanted = self.roughness(breaks) ** (1.0 / (self.stages + 1))
        x = better_nodes(np.unique(self.x), wanted, elements, breaks)
        return self.laid(np.sort(np.concatenate([x, self.x[self.joints]])), stages)


def better_nodes(x: Array, wanted: Array, elements: int, breaks: Array) -> Array:
    """Return nodes so that the sum of ``wanted`` (per old element) is the same on every new one; breaks stay nodes."""
    nodes = np.empty(elements + 2 * len(breaks) + 2)
    return nodes[: kernel.lay(x, wanted, elements, breaks, nodes)]


def stage_points(x: Array, stages: int) -> Array:
    """Return Gauss' points on the elements between the nodes x (N + 1,): (N, stages)."""
    c = METHODS[stages * PER_METHOD : stages * PER_METHOD + stages]
    return np.asarray(x[:-1, None] + np.diff(x)[:, None] * c)


def units(y: Array) -> Array:
    """Return by what the 13 states of the nodes y are measured: r and q by 1, n and m by their own largest."""
    result = np.empty(STATES)
    kernel.units(np.ascontiguousarray(y).ravel(), result)
    return result


def size(change: Array, y: Array) -> float:
    """Return the largest change of a vector at a node, change (N + 1, 13), in those units."""
    return float(kernel.size(np.ascontiguousarray(change).ravel(), np.ascontiguousarray(y).ravel()))
