"""The lowest modes of a chain's second variation, by shift and invert on the band.

Source: Y. Saad, Numerical Methods for Large Eigenvalue Problems (SIAM, 2011), ch. 8, through ARPACK.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, diags
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from darboux import frames
from darboux.errors import InvalidInput
from darboux.kernels import band
from darboux.modes import Modes
from darboux.statics.discrete_branch import ChainBranch
from darboux.statics.discrete_chain import Chain, Shape

Array = NDArray[np.float64]

LIGHTEST = (
    1e-9  # of the rod's mass, per length: what has none, as what is held, is a mode of no interest, but must be one
)
FREE = 1e-3  # of EI / L^3, by the softer axis: a stiffness below this is that of a free motion, and rounding
STIFFER = 100.0  # times the penalty of an inextensible rod, whose modes would else stretch a little


def modes(chain: Chain, shape: Shape, load_factor: float, k: int) -> Modes:
    """Return the k lowest modes. Raises ``InvalidInput`` where the loads have no potential, or k is too large."""
    if not chain.symmetric:
        raise InvalidInput("solution.modes needs loads with a potential, but a moment, a couple or a follower acts.")
    if k > chain.edges:
        raise InvalidInput(f"solution.modes has k = {k}; with {chain.edges} segments it may be at most {chain.edges}.")
    inertia, mass = _inertia(chain)
    free = chain.closed and not chain.problem.loads
    K, M, packed = _free_ring(chain, shape, inertia) if free else _held(chain, shape, load_factor, inertia)
    factors, below = _shifted(K, M)
    operator = LinearOperator(K.shape, matvec=factors.solve)
    start = np.random.default_rng(1).normal(size=K.shape[0])
    values, vectors = eigsh(K, k, M, sigma=below, OPinv=operator, v0=start)
    order = np.argsort(values)
    values = np.where(np.abs(values) < FREE * _softest(chain), 0.0, values)
    return _modes(chain, values[order], [packed(own) for own in vectors.T[order]], mass)


def extrapolated(coarse: Modes, fine: Modes, gain: float) -> Modes:
    """Return the modes with their stiffness, and the squares of their frequencies, extrapolated (Richardson)."""
    stiffness = fine.stiffness + gain * (fine.stiffness - coarse.stiffness)
    frequencies = None
    if fine.frequencies is not None and coarse.frequencies is not None:
        squares = fine.frequencies**2 + gain * (fine.frequencies**2 - coarse.frequencies**2)
        frequencies = np.sqrt(np.where(squares < 0.0, np.nan, squares))
    return replace(fine, stiffness=stiffness, frequencies=frequencies)


def _softest(chain: Chain) -> float:
    """Return the least bending stiffness, dimensionless."""
    c = chain.problem.rod.stiffness(chain.nodes[1:-1] % 1.0 * chain.scale.length)
    return float(min(np.min(c.EI1), np.min(c.EI2))) / (chain.scale.moment * chain.scale.length)


def _inertia(chain: Chain) -> tuple[Array, float | None]:
    """Return the band of the norm by packed unknowns, a share of the whole, and the rod's mass in kg.

    It is spread along the edges: 1/2 w (|dr_i|^2 + |dr_j|^2) - 1/6 w |dr_j - dr_i|^2 for an edge with the share w.
    """
    rod, L = chain.problem.rod, chain.scale.length
    middles = 0.5 * (chain.nodes[1:] + chain.nodes[:-1]) % 1.0 * L
    per_length = rod.stiffness(middles).mass
    pieces = chain.l[1:-1] * (np.ones(chain.edges) if per_length is None else per_length)
    pieces[-1] *= not chain.closed  # the first edge once more
    total = float(np.sum(pieces))
    mass = None if per_length is None or total == 0.0 else total * L
    pieces = chain.l[1:-1] if total == 0.0 else pieces / total
    gyration = np.zeros(chain.edges)
    if rod.section.has_shape:
        g = rod.section.geometry(middles, rod.material.nu)
        gyration = (g.I1 + g.I2) / (g.A * L**2)
    lower = np.zeros((chain.edges + 3, 4, band.LOWER))
    lower[1:-2, :3, 0] += pieces[:, None] / 3.0
    lower[2:-1, :3, 0] += pieces[:, None] / 3.0
    lower[1:-2, :3, 4] = pieces[:, None] / 6.0  # the next vertex is four unknowns on
    lower[1:-2, 3, 0] = pieces * gyration
    return lower.ravel()[: -band.LOWER].copy(), mass


def _held(chain: Chain, shape: Shape, load_factor: float, inertia: Array) -> tuple[Any, Any, Any]:
    """Return stiffness and mass by the supports' unknowns, and what makes packed unknowns of these."""
    branch = ChainBranch(chain)
    stiffness, shift, chain.shift = chain.EA.copy(), chain.shift, 0.0  # a free motion has no stiffness
    if chain.inextensible:
        chain.EA[1:-1] *= STIFFER
    branch.assemble(shape, load_factor)
    branch.hold(shape, load_factor)
    chain.EA[:], chain.shift = stiffness, shift
    chain.transform(shape, inertia)
    band.fix(inertia, np.zeros(chain.unknowns), chain.fixed)
    inertia[:: band.LOWER][chain.fixed] = 0.0
    return _sparse(branch.lower), _weighty(_sparse(inertia), chain), lambda own: chain.packed(shape, own)


def _free_ring(chain: Chain, shape: Shape, inertia: Array) -> tuple[Any, Any, Any]:
    """Return stiffness and mass of a ring that nothing holds: the last edge and its two vertices are the first ones."""
    branch = ChainBranch(chain)
    stiffness, T = chain.EA.copy(), shape.T.copy()
    chain.EA[1:-1] *= STIFFER
    T[1] = 0.5 * (T[2] + T[-3])
    T[-2] = 0.0
    chain.EA[[0, -2, -1]] = 0.0
    branch.assemble(shape._replace(T=T), 1.0)
    chain.EA[:] = stiffness
    own = 4 * (chain.edges - 1)  # from the first vertex on; before it is a ghost
    rows = np.arange(own + 7)
    join = csc_matrix((np.ones(own + 7), (rows + 4, rows % own)), shape=(chain.unknowns, own))
    K, M = (join.T @ _sparse(matrix) @ join for matrix in (branch.lower, inertia))
    return K.tocsc(), _weighty(M, chain), lambda own: join @ own


def _sparse(lower: Array) -> Any:
    """Return a symmetric band as a sparse matrix."""
    rows = lower.reshape(-1, band.LOWER)
    columns = [rows[: len(rows) - i, i] for i in range(band.LOWER)]
    return diags([*columns, *columns[1:]], [*range(0, -band.LOWER, -1), *range(1, band.LOWER)], format="csc")


def _weighty(M: Any, chain: Chain) -> Any:
    """Return the mass with a little for those unknowns that have none."""
    least = LIGHTEST / chain.edges
    return (M + diags([np.maximum(least - M.diagonal(), 0.0)], [0])).tocsc()


def _shifted(K: Any, M: Any) -> tuple[Any, float]:
    """Return the factors of K - shift M, and a shift below all eigenvalues."""
    shift = -1.0
    while True:
        factors = splu(
            K - shift * M, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
        if np.all(factors.U.diagonal() > 0.0):  # rows and columns in one order, so that Sylvester's law holds
            return factors, shift
        shift *= 4.0


def _modes(chain: Chain, values: Array, vectors: list[Array], mass: float | None) -> Modes:
    displacements, turns = [], []
    for packed in vectors:
        step = np.append(packed, 0.0).reshape(-1, 4)
        dr, turn = step[1:-1, :3], 0.5 * (step[:-2, 3] + step[1:-1, 3])  # the angle of an edge stands before its vertex
        if chain.closed:  # from the middle of the held edge to its middle
            dr, turn = dr.copy(), turn.copy()
            dr[0] = dr[-1] = 0.5 * (dr[0] + dr[1])
            turn[0] = turn[-1] = step[1, 3]
        largest = dr.ravel()[np.argmax(np.abs(dr))]
        sign = 1.0 if largest >= 0.0 else -1.0
        displacements.append(sign * dr)
        turns.append(sign * turn)
    stiffness = values * (chain.scale.force / chain.scale.length)
    frequencies = None if mass is None else np.sqrt(np.where(stiffness < 0.0, np.nan, stiffness) / mass) / frames.turn
    turned = np.array(turns) / chain.scale.length
    s = np.clip(chain.nodes, 0.0, 1.0) * chain.scale.length
    return Modes(s, np.array(displacements), turned, stiffness, frequencies)
