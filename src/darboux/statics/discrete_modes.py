"""The lowest modes of a chain: what its supports and loads make of its small motions, see vibrations.py for the rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_diag, csr_array, diags_array, identity, kron

from darboux import frames
from darboux.errors import InvalidInput
from darboux.kernels import band, discrete_rod
from darboux.modes import Modes
from darboux.statics import vibrations
from darboux.statics.discrete_branch import ChainBranch
from darboux.statics.discrete_chain import Chain, Shape
from darboux.statics.discrete_ends import cross_matrix
from darboux.statics.vibrations import Found, Parts

Array = NDArray[np.float64]

LIGHTEST = (
    1e-9  # of the rod's mass, per length: the rotary inertia of an edge that has none, whose mode is of no interest
)


@dataclass(frozen=True)
class LowestModes:
    """What `solution.modes` asks: the modes of an equilibrium of a chain, or of two, of which the second is finer."""

    chains: tuple[tuple[Chain, Shape, float], ...]  # each with the shape and the load factor
    gain: float = 0.0  # of the extrapolation

    def __call__(self, k: int) -> Modes:
        """Return the k lowest modes. Raises ``InvalidInput`` where the loads have no potential, or k is too large."""
        chain = self.chains[-1][0]
        most = self.chains[0][0].edges
        if not chain.symmetric:
            raise InvalidInput(
                "solution.modes needs loads with a potential, but a moment, a couple or a follower acts; use natural_modes."
            )
        if k > most:
            raise InvalidInput(f"solution.modes has k = {k}; with {most} segments it may be at most {most}.")
        if self.gain == 0.0:
            return _modes(chain, _found(*self.chains[-1], k))
        coarse, fine = (_found(*own, min(k + vibrations.MARGIN, own[0].edges)) for own in self.chains)
        values, shapes = vibrations.extrapolated(coarse, fine, self.gain, False)
        order = np.argsort(values)[:k]
        return _modes(chain, fine._replace(values=values[order], shapes=shapes[:, order]))


def _found(chain: Chain, shape: Shape, load_factor: float, k: int) -> Found:
    parts, packed = parts_of(chain, shape, load_factor, inertia(chain))
    values, vectors = vibrations.lowest(parts, k)
    return in_shapes(chain, values, packed @ vectors)


def in_shapes(chain: Chain, values: Array, packed: Array) -> Found:
    """Return what was found, by packed unknowns of the rod itself, without its ghosts."""
    weights = inertia(chain).diagonal()
    shapes = packed[4:-4]
    if chain.closed:  # the first edge and the last are one: from its middle to its middle
        shapes, turn = shapes.copy(), packed[7]
        middle = 0.5 * (packed[4:7] + packed[8:11])
        shapes[:3], shapes[-3:], shapes[3], shapes[-4] = middle, middle, turn, turn
    return Found(values, shapes, chain.nodes, weights[4:-4])


def mass_along(chain: Chain) -> Array | None:
    """Return the mass of each edge in kg, a ring's last one, which is its first, with none; None for a rod without mass."""
    if not chain.packing.masses.known:
        return None
    per_length = chain.cells.on_edges(lambda x: chain.packing.masses(x, "solution.modes")[:, None])
    pieces = per_length[:, 0] * chain.cells.l
    pieces[-1] *= not chain.closed
    return pieces if np.any(pieces > 0.0) else None


def inertia(chain: Chain, rotary: Array | None = None) -> Any:
    """Return the sparse norm by packed unknowns, a share of the whole; ``rotary`` inertias of the edges, over m L^2.

    It is spread along the edges: 1/2 w (|dr_i|^2 + |dr_j|^2) - 1/6 w |dr_j - dr_i|^2 for an edge with the share w.
    """
    mass = mass_along(chain)
    pieces = (
        chain.l[1:-1] * (np.arange(chain.edges) < chain.edges - chain.closed) if mass is None else mass / np.sum(mass)
    )
    if rotary is None:
        rotary = pieces * chain.packing.masses.gyration(0.5 * (chain.nodes[1:] + chain.nodes[:-1]) % 1.0)
    rotary = np.maximum(rotary, LIGHTEST / chain.edges)
    if chain.closed:
        rotary[-1] = 0.0
    w = np.pad(pieces, 1)
    vertices = (w[:, None] * np.ones(3)).ravel()
    edges = np.arange(chain.edges + 2)
    first = (4 * edges[:, None] + np.arange(3)).ravel()
    rows = np.concatenate([first, first + 4, first, first + 4, 4 * edges + 3])
    columns = np.concatenate([first, first + 4, first + 4, first, 4 * edges + 3])
    values = np.concatenate([vertices / 3.0, vertices / 3.0, vertices / 6.0, vertices / 6.0, np.pad(rotary, 1)])
    return csr_array((values, (rows, columns)), shape=(chain.unknowns, chain.unknowns))


def coriolis(mass: Any, spin: Array) -> Any:
    """Return the sparse matrix of 2 m spin x v by packed unknowns, from the mass by these (its turns left out)."""
    blocks = mass[::4, ::4]  # the same for x, y and z
    padded = np.zeros((4, 4))
    padded[:3, :3] = 2.0 * cross_matrix(spin)
    n = mass.shape[0]
    return csr_array(kron(blocks, padded, format="csr")[:n, :n])


def parts_of(chain: Chain, shape: Shape, load_factor: float, mass: Any, damping: Any = None) -> tuple[Parts, Any]:
    """Return the chain's stiffness and mass in their parts, and what makes packed unknowns of those that nothing holds."""
    branch = ChainBranch(chain)
    rod, T = chain.elasticity(shape.T), shape.T.copy()
    free_ring = chain.closed and not chain.problem.loads
    if (
        free_ring
    ):  # the last edge and its two vertices are the first ones; the sections' frames there are held by nothing
        T[1], T[-2] = 0.5 * (T[2] + T[-3]), 0.0
        rod = rod._replace(T=T, EA=np.where(np.arange(len(T)) < len(T) - 2, rod.EA, 0.0))
        rod.EA[0] = 0.0
    kappa = np.zeros(3 * (chain.edges + 3))
    discrete_rod.strains(shape.state, rod.first, rod.stop, kappa)
    stretch = np.pad(chain.stretch(shape), 1)
    lent, chain.shift = chain.shift, 0.0  # a free motion has no stiffness
    branch.assemble(shape, load_factor, vibrations.without_material(rod, kappa, stretch))
    E, L, B, C = vibrations.strains_of(shape.state, rod, kappa, chain.inextensible)
    if free_ring:
        own = 4 * (chain.edges - 1)  # from the first vertex on; before it is a ghost
        rows = np.arange(own + 7)
        P = csr_array((np.ones(own + 7), (rows + 4, rows % own)), shape=(chain.unknowns, own))
        held = P
    else:
        branch.hold(shape, load_factor)
        held = csr_array(identity(chain.unknowns, format="csr")[:, ~chain.fixed])
        P = _packing(chain, shape) @ held
    chain.shift = lent
    K = _symmetric(branch.lower) if branch.general is None else _general(branch.general)
    D = None if damping is None else csr_array(P.T @ damping @ P)
    g = held.T @ branch.gradient
    return Parts(csr_array(held.T @ K @ held), csr_array(E @ P), L, B, C, csr_array(P.T @ mass @ P), g, D), P


def _packing(chain: Chain, shape: Shape) -> Any:
    """Return the sparse matrix of `Chain.packed`."""
    blocks = [(end.block.part, end.transformation(R)) for end, _, _, R in chain._ends(shape.state)]
    blocks += [(block.part, conditions.place_axes) for _, conditions, block in chain.between]
    parts, at = [], 0
    for part, T in sorted(blocks, key=lambda block: block[0].start):
        parts += [identity(part.start - at), T]
        at = part.stop
    return block_diag([part for part in parts if part.shape[0]], format="csr")


def _symmetric(lower: Array) -> Any:
    """Return a symmetric band as a sparse matrix."""
    rows = lower.reshape(-1, band.LOWER)
    columns = [rows[: len(rows) - i, i] for i in range(band.LOWER)]
    return diags_array(
        [*columns, *columns[1:]], offsets=[*range(0, -band.LOWER, -1), *range(1, band.LOWER)], format="csr"
    )


def _general(general: Array) -> Any:
    """Return a band as a sparse matrix."""
    columns = general.reshape(-1, band.FULL)  # row i of column j stands at REACH + i - j
    n, reach = len(columns), band.REACH
    offsets = range(-reach, reach + 1)
    return diags_array(
        [columns[max(k, 0) : n + min(k, 0), reach - k] for k in offsets], offsets=list(offsets), format="csr"
    )


def _modes(chain: Chain, found: Found) -> Modes:
    values, k = found.values, len(found.values)
    packed = np.vstack([found.shapes, np.zeros((1, k))]).T.reshape(k, -1, 4)
    displacements, edges = packed[:, :, :3], packed[:, :-1, 3]
    ends = (edges[:, :1], edges[:, -1:]) if chain.closed else (0.5 * edges[:, :1], 0.5 * edges[:, -1:])
    turns = np.concatenate([ends[0], 0.5 * (edges[:, 1:] + edges[:, :-1]), ends[1]], axis=1)
    largest = displacements.reshape(k, -1)[np.arange(k), np.argmax(np.abs(displacements.reshape(k, -1)), axis=1)]
    sign = np.where(largest >= 0.0, 1.0, -1.0)
    stiffness = values * (chain.scale.force / chain.scale.length)
    mass = mass_along(chain)
    frequencies = None
    if mass is not None:
        frequencies = np.sign(stiffness) * np.sqrt(np.abs(stiffness) / np.sum(mass)) / frames.turn
    turned = sign[:, None] * turns / chain.scale.length
    s = np.clip(chain.nodes, 0.0, 1.0) * chain.scale.length
    return Modes(s, sign[:, None, None] * displacements, turned, stiffness, frequencies)
