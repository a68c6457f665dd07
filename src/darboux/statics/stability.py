"""How many directions lower the energy of an equilibrium: the index of its second variation, and the mode that lowers it most.

The kernel `second_variation` sums the energy of a small change over the pieces of the rod; with what holds the nodes that is a
symmetric matrix in the displacements and forces of all nodes, block tridiagonal. Of its negative eigenvalues each force has as
many as its compliance has positive ones; the rest is the index, by Sylvester's law of inertia (Haynsworth's formula), if every
piece is stable with both ends held.

Two small numbers make zeros say what they are: a soft foundation makes a free motion positive, and an inextensible rod has
a compliance of stretch, so that a straight one between two supports has a force.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from darboux.kernels import second_variation as kernel
from darboux.kernels.inertia import BLOCK
from darboux.kernels.stability import FOUNDATION
from darboux.packing.ends import Held

Array = NDArray[np.float64]

SAME = 1e-4  # relative: eigenvalues closer than this belong to one another
TIED = 1e-6  # of the shift: what rounding alone makes of two equal eigenvalues
LARGE = 0.99  # of the largest displacement: as large as that, but for rounding
LESS = 0.13  # the weight of a direction or a place that comes after another
CLOSE = 1e-3  # relative: how well the lowest eigenvalue is found
# The shift over the lowest eigenvalue and over the foundation: near to it, but not so near that the second mode drowns in it.
BESIDE, APART = 1.05, 100.0
ITERATIONS = 12  # of a pair of modes
REACH = BLOCK - 1  # half-bandwidth of the whole matrix


@dataclass(frozen=True)
class SecondVariation:
    """The sum over the pieces, in the motions that are free at the nodes and the forces at the starts of the pieces.

    ``diagonal`` (N + 1, 12, 12) and ``below`` (N, 12, 12), of which ``sizes`` (N + 1,) rows and columns count: the motions, then
    the six forces; ``weights`` (N + 1, 12) the lengths that belong to a node's motions, none to forces; ``held`` what holds a
    node, by its number; ``of_forces`` how many negative eigenvalues are the forces'; ``foundation`` what free motions are lent.
    """

    diagonal: Array
    below: Array
    sizes: NDArray[np.int64]
    weights: Array
    held: dict[int, Held]
    of_forces: int
    foundation: float

    @property
    def index(self) -> int:
        """The number of negative directions."""
        return self._on_foundation(self.foundation)

    def _on_foundation(self, stiffness: float) -> int:
        """Return how many directions lower the energy of the rod on a foundation."""
        arrays = self.diagonal.ravel(), self.below.ravel(), self.weights.ravel(), self.sizes
        return int(kernel.index(*arrays, stiffness, self.of_forces))

    def lowest_mode(self) -> Array:
        """Return the displacements (dr, theta) (N + 1, 6) of the lowest eigenvalue, relative to the weights.

        Its first large one is positive; neither that nor the plane, where any serves, depends on rounding. The foundation under
        which the rod is just stable gives the shift of an inverse iteration of two modes.
        """
        from scipy.linalg import eigh, solve_banded  # slow to load, and seldom needed

        low, high = 0.0, self.foundation
        while self._on_foundation(high) > 0:
            low, high = high, 4.0 * high
        while high - low > CLOSE * high and low > 0.0:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self._on_foundation(middle) > 0 else (low, middle)
        shift = BESIDE * high + APART * self.foundation
        starts = np.concatenate([[0], np.cumsum(self.sizes)])
        weights = np.concatenate([w[:n] for w, n in zip(self.weights, self.sizes, strict=True)])
        band = self._band(starts)
        band[REACH] += shift * weights
        modes = np.random.default_rng(1).normal(size=(starts[-1], 2))
        for _ in range(ITERATIONS):
            right = weights[:, None] * modes
            modes = solve_banded((REACH, REACH), band, right)
            values, pair = eigh(modes.T @ right, modes.T @ (weights[:, None] * modes))
            modes = modes @ pair
        values = values - shift
        lowest, second = (self._spread(modes[:, i], starts) for i in (0, 1))
        if values[1] - values[0] < max(SAME * abs(values[0]), TIED * shift):
            # Any plane serves: take the one with the least along y, then z, then near the start, where a helix stands out.
            along = np.array([0.0, 1.0, LESS]) * (1.0 + LESS * np.linspace(1.0, 0.0, len(lowest)))[:, None]
            pair = np.stack([(along * mode[:, :3]).ravel() for mode in (lowest, second)], axis=1)
            lowest = np.tensordot(np.linalg.svd(pair)[2][1], np.stack([lowest, second]), axes=1)
        moved = lowest[:, :3].ravel()
        first = moved[np.argmax(np.abs(moved) >= LARGE * np.max(np.abs(moved)))]
        return np.asarray(lowest * (1.0 if first >= 0.0 else -1.0))

    def _band(self, starts: Array) -> Array:
        """Return the matrix in LAPACK's band form, (2 REACH + 1, rows)."""
        band = np.zeros((2 * REACH + 1, starts[-1]))
        for i, n in enumerate(self.sizes):
            row, column = np.indices((n, n))
            band[REACH + row - column, starts[i] + column] = self.diagonal[i, :n, :n]
            if i + 1 < len(self.sizes):
                row, column = np.nonzero(self.below[i])
                apart, values = starts[i + 1] - starts[i] + row - column, self.below[i, row, column]
                band[REACH + apart, starts[i] + column] = values
                band[REACH - apart, starts[i + 1] + row] = values
        return band

    def _spread(self, vector: Array, starts: Array) -> Array:
        """Return the displacements (N + 1, 6) of a vector of all unknowns."""
        result = np.empty((len(self.sizes), 6))
        for i, first in enumerate(starts[:-1]):
            hold = self.held.get(i)
            motions = np.eye(6) if hold is None else hold.motions[:, : hold.free]
            result[i] = motions @ vector[first : first + motions.shape[1]]
        return result


def second_variation(
    transfer: Array, x: Array, moments: tuple[Array, Array], held: dict[int, Held], largest_force: float
) -> SecondVariation:
    """Return the second variation of an equilibrium, all dimensionless.

    Arguments: ``transfer`` (N, 12, 12) of the states (dr, theta, dn, dm), which is changed; ``x`` (N + 1,) the nodes; ``moments``
    m (N, 3) at the starts of the pieces and at their ends; ``held`` what holds the nodes, by their numbers 0 ... N, both ends among
    them; ``largest_force`` the largest inner force.
    """
    N = len(x) - 1
    diagonal, below, weights = np.zeros((N + 1, BLOCK, BLOCK)), np.zeros((N, BLOCK, BLOCK)), np.zeros((N + 1, BLOCK))
    flat = diagonal.ravel(), below.ravel(), weights.ravel()
    m = np.ascontiguousarray(moments[0]).ravel()
    of_forces, softest = kernel.assemble(transfer.ravel(), x, m, np.zeros(0), *flat)
    sizes = np.full(N + 1, BLOCK)
    for i, hold in held.items():
        kernel.hold(i, hold.motions.ravel(), hold.free, hold.stiffness.ravel(), *flat)
        sizes[i] = hold.free + 6
    sizes[N] -= 6
    largest_moment = np.sqrt(max(float(np.max(np.sum(m**2, axis=1))) for m in moments))
    foundation = FOUNDATION * (largest_force + min(1.0, largest_moment + 1.0 / softest))
    return SecondVariation(diagonal, below, sizes, weights, held, of_forces, foundation)
