"""How many directions lower the energy of an equilibrium on a mesh: the second variation, summed and held, and its index.

An inextensible rod is lent a compliance of stretch, so that a straight one between two supports has a force; a soft foundation
makes a free motion positive.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.algebra import dot, put, vector
from darboux.kernels.collocation import transfers
from darboux.kernels.inertia import BLOCK, SQUARE
from darboux.kernels.jit import allocating
from darboux.kernels.profile import Profile, columns
from darboux.kernels.rod_equations import FORCE, MOMENT, SINV, STATES
from darboux.kernels.second_variation import assemble, hold, index
from darboux.kernels.support import NUMBERS, motions, stiffness
from darboux.kernels.system import System

Array = NDArray[np.float64]

COMPLIANCE = 1e-7  # of stretch, over 1 + the largest dimensionless force
FOUNDATION = 1e-5  # per length, over what the rod resists and carries: more than Newton's method leaves over on the way


@allocating
def _lent(table: Profile, compliance: float) -> Profile:
    """The table whose compliance of stretch is at least this."""
    lent, width = table.coefficients.copy(), columns(table)
    for first in range(0, lent.size, (table.degree + 1) * width):
        lent[first + SINV + 2] = max(lent[first + SINV + 2], compliance)
    return Profile(table.breaks, lent, table.degree)


@allocating
def second_variation(
    system: System, supports: Array, lend: bool, diagonal: Array, below: Array, weights: Array, sizes: NDArray[np.int64]
) -> tuple[int, float]:
    """Write the matrix of an equilibrium, held by its supports; return how many forces count, and the foundation's stiffness.

    supports as for `sweep`. Out, all zero on entry, with n elements that have a width: diagonal (n + 1 x 144,), below (n x 144,)
    and weights (n + 1 x 12,) as for `assemble`; sizes (n + 1,) how many rows of each block count.
    """
    elements, y, x = sizes.size - 1, system.y, np.empty(sizes.size)
    starts, transfer = np.empty(3 * elements), np.empty(elements * SQUARE)
    force, moment, element = 0.0, 0.0, 0
    for i in range(system.x.size):
        n, m = vector(y, i * STATES + FORCE), vector(y, i * STATES + MOMENT)
        force, moment = max(force, dot(n, n)), max(moment, dot(m, m))
        if i + 1 == system.x.size or system.x[i + 1] > system.x[i]:
            x[element] = system.x[i]
            if element < elements:
                put(starts, 3 * element, 1, m)
            element += 1
    force = np.sqrt(force)
    table = _lent(system.table, COMPLIANCE / (1.0 + force)) if lend else system.table
    parts = (system.stages, system.x, y, system.Y, table, system.rate, system.shaped, system.load_factor)
    transfers(System(*parts), transfer)
    of_forces, softest = assemble(transfer, x, starts, diagonal, below, weights)
    sizes[:] = BLOCK
    node, number = 0, 0
    for i in range(system.x.size):
        joint = i + 1 < system.x.size and system.x[i + 1] == system.x[i]
        if i == 0 or joint or i + 1 == system.x.size:
            support, at = supports[number * NUMBERS : (number + 1) * NUMBERS], y[i * STATES : (i + 1) * STATES]
            free, springs = np.empty(36), np.empty(36)
            count = motions(support, at, free)
            stiffness(support, at, system.load_factor, springs)
            hold(node, free, count, springs, diagonal, below, weights)
            sizes[node] = count + BLOCK // 2
            number += 1
        node += 0 if joint else 1
    sizes[elements] -= BLOCK // 2
    return of_forces, FOUNDATION * (force + min(1.0, np.sqrt(moment) + 1.0 / softest))


@allocating
def unstable_directions(system: System, supports: Array, lend: bool) -> int:
    """Return the index of an equilibrium; `lend` a rod that does not stretch some compliance."""
    elements = 0
    for i in range(system.x.size - 1):
        elements += 1 if system.x[i + 1] > system.x[i] else 0
    diagonal, below = np.zeros((elements + 1) * SQUARE), np.zeros(elements * SQUARE)
    weights, sizes = np.zeros((elements + 1) * BLOCK), np.empty(elements + 1, np.int64)
    of_forces, foundation = second_variation(system, supports, lend, diagonal, below, weights, sizes)
    return index(diagonal, below, weights, sizes, foundation, of_forces)
