"""The lowest modes of a chain's second variation, by shift and invert on the band.

Source: Y. Saad, Numerical Methods for Large Eigenvalue Problems (SIAM, 2011), ch. 8, through ARPACK.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import diags
from scipy.sparse.linalg import LinearOperator, eigsh

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
STIFFER = 100.0  # times the penalty of an inextensible rod, whose modes would else stretch a little


def modes(chain: Chain, shape: Shape, load_factor: float, k: int) -> Modes:
    """Return the k lowest modes. Raises ``InvalidInput`` where the loads have no potential, or k is too large."""
    if not chain.symmetric:
        raise InvalidInput("solution.modes needs loads with a potential, but a moment, a couple or a follower acts.")
    if k > chain.edges:
        raise InvalidInput(f"solution.modes has k = {k}; with {chain.edges} segments it may be at most {chain.edges}.")
    weights, mass = _weights(chain)
    branch = ChainBranch(chain)
    stiffness, shift, chain.shift = chain.EA.copy(), chain.shift, 0.0  # a free motion has no stiffness
    if chain.inextensible:
        chain.EA[1:-1] *= STIFFER
    branch.assemble(shape, load_factor)
    branch.hold(shape, load_factor)
    chain.EA[:], chain.shift = stiffness, shift
    n, lower = chain.unknowns, branch.lower.reshape(-1, band.LOWER)
    columns = [lower[: n - i, i] for i in range(band.LOWER)]
    K = diags([*columns, *columns[1:]], [*range(0, -band.LOWER, -1), *range(1, band.LOWER)], format="csc")
    factors, below = _shifted(branch.lower, weights)

    def inverse(b: Array) -> Array:
        x = np.array(b, dtype=float).ravel()
        band.solve(factors, n, x)
        return x

    operator = LinearOperator((n, n), matvec=inverse)
    start = np.random.default_rng(1).normal(size=n)
    M = diags([weights], [0], format="csc")
    values, vectors = eigsh(K, k, M, sigma=below, OPinv=operator, v0=start)
    return _modes(chain, shape, values, vectors.T, mass)


def _weights(chain: Chain) -> tuple[Array, float | None]:
    """Return the share of each unknown in the norm, and the rod's mass in kg."""
    rod, L = chain.problem.rod, chain.scale.length
    middles = 0.5 * (chain.nodes[1:] + chain.nodes[:-1]) * L
    per_length = rod.stiffness(middles).mass
    pieces = chain.l[1:-1] * (np.ones(chain.edges) if per_length is None else per_length)
    total = float(np.sum(pieces))
    mass = None if per_length is None or total == 0.0 else total * L
    pieces = chain.l[1:-1] if total == 0.0 else pieces / total
    gyration = np.zeros(chain.edges)
    if rod.section.has_shape:
        g = rod.section.geometry(middles, rod.material.nu)
        gyration = (g.I1 + g.I2) / (g.A * L**2)
    weights = np.zeros((chain.edges + 3, 4))
    weights[1:-2, :3] += 0.5 * pieces[:, None]
    weights[2:-1, :3] += 0.5 * pieces[:, None]
    weights[1:-2, 3] = pieces * gyration
    free = np.where(chain.fixed, 0.0, weights.ravel()[:-1])
    return np.maximum(free, LIGHTEST / chain.edges), mass


def _shifted(lower: Array, weights: Array) -> tuple[Array, float]:
    """Return the factors of K - shift M, and a shift below all eigenvalues."""
    shift = -1.0
    while True:
        factors = lower.copy()
        factors[:: band.LOWER] -= shift * weights
        if band.factor(factors, weights.size) == 0:
            return factors, shift
        shift *= 4.0


def _modes(chain: Chain, shape: Shape, values: Array, vectors: Array, mass: float | None) -> Modes:
    order = np.argsort(values)
    displacements, turns = [], []
    for own in vectors[order]:
        step = np.append(chain.packed(shape, own), 0.0).reshape(-1, 4)
        dr, turn = step[1:-1, :3], 0.5 * (step[:-2, 3] + step[1:-1, 3])  # the angle of an edge stands before its vertex
        largest = dr.ravel()[np.argmax(np.abs(dr))]
        sign = 1.0 if largest >= 0.0 else -1.0
        displacements.append(sign * dr)
        turns.append(sign * turn)
    stiffness = values[order] * (chain.scale.force / chain.scale.length)
    frequencies = None if mass is None else np.sqrt(np.where(stiffness < 0.0, np.nan, stiffness) / mass) / frames.turn
    turned = np.array(turns) / chain.scale.length
    return Modes(chain.nodes * chain.scale.length, np.array(displacements), turned, stiffness, frequencies)
