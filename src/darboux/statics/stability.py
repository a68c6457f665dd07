r"""How many directions lower the energy of an equilibrium: the index of the second variation, from transfer matrices.

Over one piece of the rod small changes go from start to end by d_1 = A d_0 + B p_0, p_1 = C d_0 + D p_0, with the
displacements d = (dr, theta) and the forces p = (dn, dm), all in the fixed frame. What holds the piece's ends in changed
places is therefore

    [-p_0]   [ B^-1 A           -B^-1  ] [d_0]
    [ p_1] = [ C - D B^-1 A     D B^-1 ] [d_1]                                                       (1)

Over pieces that are stable with both ends held, the second variation has as many negative directions as the sum of these
matrices over the nodes (block tridiagonal, symmetric at an equilibrium under loads with a potential), and block
elimination counts them by Sylvester's law of inertia. An inextensible rod is given a compliance of stretch so small that
it changes no sign: B would be singular where the rod is straight.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.kernels.inertia import negative_eigenvalues
from darboux.problem import Equilibrium
from darboux.supports import Support

Array = NDArray[np.float64]

COMPLIANCE = 1e-7  # of stretch, over 1 + the largest dimensionless force
ROUNDING = 1e-13  # of a block's largest entry
SAME = 1e-4  # relative: eigenvalues closer than this belong to one another
TIED = 3e-15  # of the largest entry: what rounding alone makes of two equal eigenvalues
LARGE = 0.99  # of the largest displacement: as large as that, but for rounding
LESS = 0.13  # the weight of a direction or a place that comes after another
NEGATIVE = 1e-5  # eigenvalues above minus this, over the same, are those of a free motion


def has_potential(problem: Equilibrium) -> bool:
    """Return whether all loads have a potential: couples, moments, followers and functions of the shape have none in 3-D."""
    s = np.linspace(0.0, problem.rod.length, 33)
    loads = problem.distributed(s)
    ends = [problem.end_load("start"), problem.end_load("end"), *problem.points.values()]
    without = [part for end in ends for part in (end.moment, end.section_force, end.section_moment)]
    return not problem.of_shape and not any(np.any(part) for part in (loads.b, loads.la, loads.lb, *without))


def free_motions(support: Support, R: Array) -> Array:
    """Return the displacements (dr, theta) that a support leaves free at an end with the frame R, as columns (6, k)."""
    T = R @ support.displacement_axes if support.sliding == "section" else support.displacement_axes
    motions = [np.append(T[:, i], np.zeros(3)) for i in range(3) if not support.held_displacement[i]]
    A = support.rotation_axes
    if support.held_rotation == (False, False, True):
        A = np.column_stack([A[:, 0], R @ support.R.T @ A[:, 1], A[:, 2]])
    motions += [np.append(np.zeros(3), A[:, i]) for i in range(3) if not support.held_rotation[i]]
    return np.array(motions).reshape(-1, 6).T


@dataclass(frozen=True)
class Held:
    """What holds a node: its free motions (6, k) as columns, and the stiffness (6, 6) of its springs."""

    motions: Array
    stiffness: Array

    @classmethod
    def by(cls, support: Support, q: Array, stiffness: Array | None = None) -> Held:
        """Return how a support holds a node with the quaternion q (4,)."""
        R = frames.matrix_of_quaternion(q)
        return cls(free_motions(support, R), np.zeros((6, 6)) if stiffness is None else stiffness)


@dataclass(frozen=True)
class SecondVariation:
    """The second variation over the nodes: blocks on the diagonal and below it, reduced to the motions that are free.

    ``diagonal`` (N + 1, 6, 6) and ``below`` (N, 6, 6), of which ``sizes`` (N + 1,) rows and columns count; ``held`` what holds a
    node, by its number; ``tolerance`` what an eigenvalue must be below to count as negative.
    """

    diagonal: Array
    below: Array
    sizes: NDArray[np.int64]
    held: dict[int, Held]
    tolerance: float

    @property
    def index(self) -> int:
        """The number of negative directions."""
        blocks = self.diagonal.ravel(), self.below.ravel(), self.sizes
        return int(negative_eigenvalues(*blocks, self.tolerance, ROUNDING))

    def lowest_mode(self) -> Array:
        """Return the displacements (dr, theta) (N + 1, 6) of the lowest eigenvalue; the first of the large ones is positive.

        Neither that side nor the plane, where any serves, depends on rounding.
        """
        starts = np.concatenate([[0], np.cumsum(self.sizes)])
        full = np.zeros((starts[-1], starts[-1]))
        for i, (a, b) in enumerate(itertools.pairwise(starts)):
            full[a:b, a:b] = self.diagonal[i, : b - a, : b - a]
            if i > 0:
                before = starts[i - 1]
                full[a:b, before:a] = self.below[i - 1, : b - a, : a - before]
        from scipy.linalg import eigh  # slow to load, and seldom needed

        values, vectors = eigh(full, lower=True, subset_by_index=[0, 1])
        lowest, second = (self._spread(vectors[:, i], starts) for i in (0, 1))
        if values[1] - values[0] < max(SAME * abs(values[0]), TIED * np.max(np.abs(self.diagonal))):
            # Any plane serves: take the one with the least along y, then z, then near the start, where a helix stands out.
            weights = np.array([0.0, 1.0, LESS]) * (1.0 + LESS * np.linspace(1.0, 0.0, len(lowest)))[:, None]
            pair = np.stack([(weights * mode[:, :3]).ravel() for mode in (lowest, second)], axis=1)
            lowest = np.tensordot(np.linalg.svd(pair)[2][1], np.stack([lowest, second]), axes=1)
        moved = lowest[:, :3].ravel()
        first = moved[np.argmax(np.abs(moved) >= LARGE * np.max(np.abs(moved)))]
        return lowest * (1.0 if first >= 0.0 else -1.0)

    def _spread(self, vector: Array, starts: Array) -> Array:
        parts = [vector[a:b] for a, b in itertools.pairwise(starts)]
        for i, held in self.held.items():
            parts[i] = held.motions @ parts[i]
        return np.array(parts)


def second_variation(transfer: Array, held: dict[int, Held], largest_force: float) -> SecondVariation:
    """Return the second variation of an equilibrium.

    Arguments: ``transfer`` (N, 12, 12), dimensionless, of the states (dr, theta, dn, dm); ``held`` what holds the nodes, by
    their numbers 0 ... N; ``largest_force`` the largest inner force, dimensionless.
    """
    A, B = transfer[:, :6, :6], transfer[:, :6, 6:]
    C, D = transfer[:, 6:, :6], transfer[:, 6:, 6:]
    inverse = np.linalg.inv(B)
    K00, K01 = inverse @ A, -inverse
    K10, K11 = C - D @ K00, D @ inverse
    diagonal = np.zeros((len(transfer) + 1, 6, 6))
    diagonal[:-1] += K00
    diagonal[1:] += K11
    diagonal = 0.5 * (diagonal + diagonal.transpose(0, 2, 1))
    below = 0.5 * (K10 + K01.transpose(0, 2, 1))
    sizes = np.full(len(diagonal), 6)
    for i, hold in held.items():
        Z, k = hold.motions, hold.motions.shape[1]
        sizes[i] = k
        diagonal[i, :k, :k] = Z.T @ (diagonal[i] + hold.stiffness) @ Z
        if i > 0:
            below[i - 1, :k] = Z.T @ below[i - 1]
        if i < len(below):
            below[i, :, :k] = below[i] @ Z
    return SecondVariation(diagonal, below, sizes, held, NEGATIVE * (1.0 + largest_force))
