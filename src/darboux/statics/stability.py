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

import numpy as np
from numpy.typing import NDArray

from darboux.problem import Equilibrium

Array = NDArray[np.float64]

COMPLIANCE = 1e-7  # of stretch, over 1 + the largest dimensionless force
NEGATIVE = 1e-5  # eigenvalues above minus this, over the same, are those of a free motion


def has_potential(problem: Equilibrium) -> bool:
    """Return whether all loads have a potential: couples, end moments and followers have none in three dimensions."""
    s = np.linspace(0.0, problem.rod.length, 33)
    loads = problem.distributed(s)
    ends = [problem.end_load(at).moment for at in ("start", "end")]
    return not any(np.any(part) for part in (loads.b, loads.la, loads.lb, *ends))


def unstable_directions(transfer: Array, held: tuple[bool, bool], largest_force: float) -> int:
    """Return the number of negative directions of the second variation.

    Arguments: ``transfer`` (pieces, 12, 12), dimensionless, of the states (dr, theta, dn, dm); ``held`` whether the
    start and the end are clamped (they are free otherwise); ``largest_force`` the largest inner force.
    """
    A, B = transfer[:, :6, :6], transfer[:, :6, 6:]
    C, D = transfer[:, 6:, :6], transfer[:, 6:, 6:]
    inverse = np.linalg.inv(B)
    K00, K01 = inverse @ A, -inverse
    K10, K11 = C - D @ K00, D @ inverse
    pieces = len(transfer)
    diagonal = np.zeros((pieces + 1, 6, 6))
    diagonal[:-1] += K00
    diagonal[1:] += K11
    diagonal = 0.5 * (diagonal + diagonal.transpose(0, 2, 1))
    beside = 0.5 * (K10 + K01.transpose(0, 2, 1))
    first, last = int(held[0]), pieces - int(held[1])
    tolerance = NEGATIVE * (1.0 + largest_force)
    negative = 0
    block = diagonal[first]
    for i in range(first, last + 1):
        if i > first:
            block = diagonal[i] - beside[i - 1] @ np.linalg.solve(block, beside[i - 1].T)
        negative += int(np.count_nonzero(np.linalg.eigvalsh(0.5 * (block + block.T)) < -tolerance))
    return negative
