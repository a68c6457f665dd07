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
from scipy.linalg import eigh

from darboux import frames
from darboux.problem import Equilibrium
from darboux.supports import Support

Array = NDArray[np.float64]

COMPLIANCE = 1e-7  # of stretch, over 1 + the largest dimensionless force
ROUNDING = 1e-13  # of a block's largest entry
SAME = 1e-4  # relative: eigenvalues closer than this belong to one another
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
class SecondVariation:
    """The second variation over the nodes: blocks on the diagonal and beside it, the ends reduced to their free motions.

    ``diagonal`` holds (k, k) and ``beside`` (k', k), below it; ``ends`` the free motions at both ends; ``tolerance`` what
    an eigenvalue must be below to count as negative.
    """

    diagonal: list[Array]
    beside: list[Array]
    ends: tuple[Array, Array]
    tolerance: float

    @property
    def index(self) -> int:
        """The number of negative directions."""
        negative = 0
        block = self.diagonal[0]
        for i, own in enumerate(self.diagonal):
            if i > 0:
                block = (
                    own if block.size == 0 else own - self.beside[i - 1] @ np.linalg.solve(block, self.beside[i - 1].T)
                )
            if block.size:
                rounding = ROUNDING * float(np.max(np.abs(own)))
                below = np.linalg.eigvalsh(0.5 * (block + block.T)) < -max(self.tolerance, rounding)
                negative += int(np.count_nonzero(below))
        return negative

    def lowest_mode(self) -> Array:
        """Return the displacements (dr, theta) (N + 1, 6) of the lowest eigenvalue."""
        sizes = [len(block) for block in self.diagonal]
        starts = np.concatenate([[0], np.cumsum(sizes)])
        full = np.zeros((starts[-1], starts[-1]))
        for i, block in enumerate(self.diagonal):
            full[starts[i] : starts[i + 1], starts[i] : starts[i + 1]] = block
        for i, block in enumerate(self.beside):
            full[starts[i + 1] : starts[i + 2], starts[i] : starts[i + 1]] = block
        values, vectors = eigh(full, lower=True, subset_by_index=[0, 1])
        lowest, second = (self._spread(vectors[:, i], starts) for i in (0, 1))
        if values[1] - values[0] < SAME * abs(values[0]):  # any plane serves: take the one with the least along y
            pair = np.stack([lowest[:, 1], second[:, 1]], axis=1)
            lowest = np.tensordot(np.linalg.svd(pair)[2][1], np.stack([lowest, second]), axes=1)
        largest = lowest[:, :3].ravel()[np.argmax(np.abs(lowest[:, :3]))]
        return lowest * (1.0 if largest >= 0.0 else -1.0)

    def _spread(self, vector: Array, starts: Array) -> Array:
        parts = [vector[a:b] for a, b in itertools.pairwise(starts)]
        parts[0], parts[-1] = self.ends[0] @ parts[0], self.ends[1] @ parts[-1]
        return np.array(parts)


def second_variation(transfer: Array, problem: Equilibrium, y: Array, springs: tuple[Array, Array]) -> SecondVariation:
    """Return the second variation of an equilibrium.

    Arguments: ``transfer`` (N, 12, 12), dimensionless, of the states (dr, theta, dn, dm); ``problem``; ``y`` (N + 1, 13)
    the states at the nodes; ``springs`` the stiffness (6, 6) of the springs at the start and at the end.
    """
    A, B = transfer[:, :6, :6], transfer[:, :6, 6:]
    C, D = transfer[:, 6:, :6], transfer[:, 6:, 6:]
    inverse = np.linalg.inv(B)
    K00, K01 = inverse @ A, -inverse
    K10, K11 = C - D @ K00, D @ inverse
    sums = np.zeros((len(transfer) + 1, 6, 6))
    sums[:-1] += K00
    sums[1:] += K11
    sums[0] += springs[0]
    sums[-1] += springs[1]
    diagonal = list(0.5 * (sums + sums.transpose(0, 2, 1)))
    beside = list(0.5 * (K10 + K01.transpose(0, 2, 1)))
    R = frames.matrix_of_quaternion(y[[0, -1], 3:7])
    ends = free_motions(problem.start, R[0]), free_motions(problem.end, R[1])
    diagonal[0], diagonal[-1] = ends[0].T @ diagonal[0] @ ends[0], ends[1].T @ diagonal[-1] @ ends[1]
    beside[0] = beside[0] @ ends[0]
    beside[-1] = ends[1].T @ beside[-1]
    force = float(np.max(np.linalg.norm(y[:, 7:10], axis=1)))
    return SecondVariation(diagonal, beside, ends, NEGATIVE * (1.0 + force))
