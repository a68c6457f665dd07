"""How many directions lower the energy of an equilibrium on a mesh: the second variation, summed and held, and its index.

An inextensible rod is lent a compliance of stretch, so that a straight one between two supports has a force; a soft foundation
makes a free motion positive.

Neighbouring elements are put together while the piece stays short: the displacements at its end are

    d_1 = A d_0 + B p_0,     |A - 1| < SHORT                                                                      (2)

so that A is never singular, and the piece is stable with both ends held, as the law of inertia wants it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.algebra import dot, minus, put, vector
from darboux.kernels.collocation import transfers
from darboux.kernels.fours import NOTHING, four, four_plus, put_four
from darboux.kernels.inertia import BLOCK, SQUARE
from darboux.kernels.jit import allocating, inline
from darboux.kernels.rod_equations import FORCE, MOMENT, STATES
from darboux.kernels.second_variation import HALF, assemble, hold, index
from darboux.kernels.support import NUMBERS, motions, stiffness
from darboux.kernels.system import System

Array = NDArray[np.float64]
Whole = NDArray[np.int64]

COMPLIANCE = 1e-7  # of stretch, over 1 + the largest dimensionless force
LONG, SHORT = 4.0, 0.75  # the unit of places in (2), over a piece's length, and how far from 1 it may be
FOUNDATION = 1e-5  # per length, over what the rod resists and carries: more than Newton's method leaves over on the way


@inline
def _is_short(T: Array, h: float) -> bool:
    """(2), with places over LONG times the length of the piece."""
    for a in range(HALF):
        apart = 0.0
        for b in range(HALF):
            unit = (LONG * h if a < 3 else 1.0) / (LONG * h if b < 3 else 1.0)
            apart += abs(T[a * BLOCK + b] - (1.0 if a == b else 0.0)) / unit
        if not apart < SHORT:
            return False
    return True


@allocating
def merge(system: System, transfer: Array, nodes: Whole) -> int:
    """Put short pieces together; return how many are left, whose transfers come first.

    transfer (N x 144,) of the elements that have a width; nodes (N + 1,) out, where the pieces begin, and the last one.
    """
    both, count, element = np.empty(SQUARE), 0, 0
    for i in range(system.x.size - 1):
        if system.x[i + 1] == system.x[i]:
            continue
        at = element * SQUARE
        element += 1
        if i > 0 and system.x[i] > system.x[i - 1]:  # nothing holds the rod between the two
            last = (count - 1) * SQUARE
            for row in range(BLOCK):
                for j in range(0, BLOCK, 4):
                    line = NOTHING
                    for k in range(BLOCK):
                        line = four_plus(line, transfer[at + row * BLOCK + k], four(transfer, last + k * BLOCK + j))
                    put_four(both, row * BLOCK + j, line)
            if _is_short(both, system.x[i + 1] - system.x[nodes[count - 1]]):
                for k in range(SQUARE):
                    transfer[last + k] = both[k]
                continue
        for k in range(SQUARE):
            transfer[count * SQUARE + k] = transfer[at + k]
        nodes[count] = i
        count += 1
    nodes[count] = system.x.size - 1
    return count


@allocating
def second_variation(
    system: System,
    supports: Array,
    lend: bool,
    transfer: Array,
    nodes: Whole,
    diagonal: Array,
    below: Array,
    weights: Array,
    sizes: Whole,
) -> tuple[int, float]:
    """Write the matrix of an equilibrium, held by its supports; return how many forces count, and the foundation's stiffness.

    supports as for `sweep`; transfer (n x 144,) of n pieces, which are changed, and nodes (n + 1,), as for `merge`. Out, all zero
    on entry: diagonal (n + 1 x 144,), below (n x 144,) and weights (n + 1 x 12,) as for `assemble`; sizes (n + 1,) how many rows
    of each block count.
    """
    pieces, y, x = sizes.size - 1, system.y, np.empty(sizes.size)
    starts, force, moment = np.empty(3 * pieces), 0.0, 0.0
    for i in range(system.x.size):
        n, m = vector(y, i * STATES + FORCE), vector(y, i * STATES + MOMENT)
        force, moment = max(force, dot(n, n)), max(moment, dot(m, m))
    force = np.sqrt(force)
    for piece in range(pieces + 1):
        x[piece] = system.x[nodes[piece]]
        if piece < pieces:
            put(starts, 3 * piece, 1, vector(y, nodes[piece] * STATES + MOMENT))
    lent = _lent(system, nodes, COMPLIANCE / (1.0 + force)) if lend else np.zeros(0)
    of_forces, softest = assemble(transfer, x, starts, lent, diagonal, below, weights)
    sizes[:] = BLOCK
    node, number = 0, 0
    for i in range(system.x.size):
        joint = i + 1 < system.x.size and system.x[i + 1] == system.x[i]
        if i == 0 or joint or i + 1 == system.x.size:
            while nodes[node] < (i + 1 if joint else i):
                node += 1
            support, at = supports[number * NUMBERS : (number + 1) * NUMBERS], y[i * STATES : (i + 1) * STATES]
            free, springs = np.empty(36), np.empty(36)
            count = motions(support, at, free)
            stiffness(support, at, system.load_factor, springs)
            hold(node, free, count, springs, diagonal, below, weights)
            sizes[node] = count + HALF
            number += 1
    sizes[pieces] -= HALF
    return of_forces, FOUNDATION * (force + min(1.0, np.sqrt(moment) + 1.0 / softest))


@allocating
def _lent(system: System, nodes: Whole, compliance: float) -> Array:
    """What the pieces' forces are lent along the chords of their elements, (n x 9,): the sum of c h t t^T."""
    lent = np.zeros(9 * (nodes.size - 1))
    for piece in range(nodes.size - 1):
        for i in range(nodes[piece], nodes[piece + 1]):
            h, at = system.x[i + 1] - system.x[i], i * STATES
            chord = minus(vector(system.y, at + STATES), vector(system.y, at))
            if h > 0.0:
                for a in range(3):
                    for b in range(3):
                        lent[9 * piece + 3 * a + b] += compliance * chord[a] * chord[b] / h
    return lent


@allocating
def unstable_directions(system: System, supports: Array, lend: bool, transfer: Array) -> int:
    """Return the index of an equilibrium; `lend` a rod that does not stretch some compliance.

    transfer (N x 144,) as `sweep` wrote it, which is changed, or none.
    """
    elements = 0
    for i in range(system.x.size - 1):
        elements += 1 if system.x[i + 1] > system.x[i] else 0
    if transfer.size == 0:
        transfer = np.empty(elements * SQUARE)
        transfers(system, transfer)
    nodes = np.empty(elements + 1, np.int64)
    n = merge(system, transfer, nodes)
    diagonal, below = np.zeros((n + 1) * SQUARE), np.zeros(n * SQUARE)
    weights, sizes = np.zeros((n + 1) * BLOCK), np.empty(n + 1, np.int64)
    pieces, ends = transfer[: n * SQUARE], nodes[: n + 1]
    of_forces, foundation = second_variation(system, supports, lend, pieces, ends, diagonal, below, weights, sizes)
    return index(diagonal, below, weights, sizes, foundation, of_forces)
