"""Discrete rods against an oracle that knows frames and the strains' definition, and differentiates by differences.

The oracle's chart: transport each edge's directors from the base tangent, turn them by theta, measure the strains.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import solve_banded
from scipy.spatial.transform import Rotation

from darboux.kernels import band
from darboux.kernels import discrete_rod as der

Array = NDArray[np.float64]

GHOSTS = {"free": (0, 0), "clamp in front": (1, 0), "clamp behind": (0, 1), "clamps": (1, 1)}
RNG_SEED = 20


class Rod(NamedTuple):
    state: der.State
    elasticity: der.Elasticity
    loads: der.Loads


def symmetric(six: Array) -> Array:
    """The 3 x 3 matrices of rows 11, 22, 33, 23, 13, 12."""
    s11, s22, s33, s23, s13, s12 = np.moveaxis(np.reshape(six, (-1, 6)), -1, 0)
    return np.moveaxis(np.array([[s11, s12, s13], [s12, s22, s23], [s13, s23, s33]]), -1, 0)


def random_rod(edges: int, ghosts: tuple[int, int], seed: int = RNG_SEED, turn: float = 1.2) -> Rod:
    """A rod whose edges turn by about `turn` (rad) in any direction, everything about it random and of order one."""
    rng = np.random.default_rng(seed)
    rotation, frames = Rotation.random(random_state=seed), []
    for _ in range(edges + 2):
        frames.append(rotation.as_matrix())
        rotation = Rotation.from_rotvec(turn * rng.uniform(-1, 1, 3)) * rotation
    R = np.array(frames)
    rest = rng.uniform(0.5, 1.5, edges)
    x = np.vstack([np.zeros(3), np.cumsum((rest * rng.uniform(0.9, 1.1, edges))[:, None] * R[1:-1, :, 2], axis=0)])
    root = rng.uniform(-1, 1, (edges + 1, 3, 3))
    B = root @ root.transpose(0, 2, 1) + 0.5 * np.eye(3)
    C = rng.uniform(-1, 1, (edges + 1, 6))
    B6 = np.stack([B[:, 0, 0], B[:, 1, 1], B[:, 2, 2], B[:, 1, 2], B[:, 0, 2], B[:, 0, 1]], axis=1)
    state = der.State(x.ravel(), R[:, :, 2].ravel(), R[:, :, 0].ravel(), 2 * np.pi * rng.integers(-2, 3, edges + 1))
    elasticity = der.Elasticity(
        B6.ravel(), rng.uniform(-1, 1, 3 * (edges + 1)), rest, rng.uniform(1, 9, edges), rng.uniform(-2, 2, edges),
        1 - ghosts[0], edges + ghosts[1],
    )  # fmt: skip
    return Rod(state, elasticity, der.Loads(rng.uniform(-1, 1, 3 * (edges + 1)), C.ravel()))


# The oracle


def oracle_move(state: der.State, q: Array) -> tuple[Array, Array]:
    """Vertices and frames R (columns d1, d2, t) after a packed step q from the state."""
    t, d1 = state.t.reshape(-1, 3), state.d1.reshape(-1, 3)
    R = np.stack([d1, np.cross(t, d1), t], axis=2)
    x = state.x.reshape(-1, 3) + np.append(q, 0.0).reshape(-1, 4)[:, :3]
    for j in range(1, len(x)):
        old, new = t[j], (x[j] - x[j - 1]) / np.linalg.norm(x[j] - x[j - 1])
        axis = np.cross(old, new)
        K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        transport = np.eye(3) + K + K @ K / (1 + old @ new)
        R[j] = Rotation.from_rotvec(q[4 * j - 1] * new).as_matrix() @ transport @ R[j]
    return x, R


def oracle_strains(R: Array, m: Array) -> Array:
    """Curvature from kb = 2 a x b / (1 + a.b) by mean directors; twist from the frame transported over the vertex."""
    kappa = np.zeros((len(R) - 1, 3))
    for i, (Ra, Rb) in enumerate(pairwise(R)):
        a, b = Ra[:, 2], Rb[:, 2]
        kb = 2 * np.cross(a, b) / (1 + a @ b)
        kappa[i, :2] = kb @ (Ra[:, :2] + Rb[:, :2]) / 2
        across = Ra[:, 0] - (Ra[:, 0] @ b) / (1 + a @ b) * (a + b)  # d1 of a, carried over to b
        angle = np.arctan2(np.cross(across, Rb[:, 0]) @ b, across @ Rb[:, 0])
        kappa[i, 2] = angle + 2 * np.pi * np.round((m[i] - angle) / (2 * np.pi))
    return kappa


def oracle_energy(rod: Rod, q: Array) -> float:
    elasticity = rod.elasticity
    x, R = oracle_move(rod.state, q)
    strain = oracle_strains(R, rod.state.m) - elasticity.kappa0.reshape(-1, 3)
    springs = np.einsum("ik,ikl,il->i", strain, symmetric(elasticity.B), strain) / 2
    eps = np.linalg.norm(np.diff(x, axis=0), axis=1) / elasticity.l - 1
    stretching = (elasticity.EA * eps**2 / 2 + elasticity.T * eps) * elasticity.l
    C = symmetric(rod.loads.C)
    works = np.sum(rod.loads.f.reshape(-1, 3) * x, axis=1) + np.einsum("ik,ikl,il->i", x, C, x) / 2
    return float(springs[elasticity.first : elasticity.stop].sum() + stretching.sum() - works.sum())


def directions(n: int, h: float) -> Array:
    return h * np.eye(n)


def oracle_gradient(rod: Rod, q: Array, h: float = 1e-3) -> Array:
    """Sixth-order differences: the error is about h^6 and 1e-16 / h."""

    def slope(u: Array) -> float:
        d1, d2, d3 = (oracle_energy(rod, q + k * u) - oracle_energy(rod, q - k * u) for k in (1, 2, 3))
        return (45 * d1 - 9 * d2 + d3) / (60 * h)

    return np.array([slope(u) for u in directions(q.size, h)])


def oracle_hessian(rod: Rod, n: int, h: float = 2e-2) -> Array:
    """Sixth-order differences of the sixth-order gradient."""
    columns = []
    for u in directions(n, h):
        d1, d2, d3 = (oracle_gradient(rod, k * u) - oracle_gradient(rod, -k * u) for k in (1, 2, 3))
        columns.append((45 * d1 - 9 * d2 + d3) / (60 * h))
    return np.array(columns).T


def derivatives(rod: Rod) -> tuple[float, Array, Array]:
    """The kernel's energy, gradient and lower band."""
    n = 4 * rod.elasticity.l.size + 3
    gradient, lower = np.full(n, np.nan), np.full(band.LOWER * n, np.nan)
    value = der.energy_gradient_hessian(*rod, np.empty(der.WORK), gradient, lower)
    return value, gradient, lower


def dense(lower: Array) -> Array:
    n = lower.size // band.LOWER
    A = np.zeros((n, n))
    for j in range(n):
        k = min(band.LOWER, n - j)
        A[j : j + k, j] = A[j, j : j + k] = lower[band.LOWER * j : band.LOWER * j + k]
    return A


# Derivatives


@pytest.mark.parametrize("ghosts", GHOSTS.values(), ids=GHOSTS)
@pytest.mark.parametrize("edges", [1, 2, 4])
def test_energy_gradient_and_hessian_are_the_oracles(edges: int, ghosts: tuple[int, int]) -> None:
    rod = random_rod(edges, ghosts)
    value, gradient, lower = derivatives(rod)
    assert value == pytest.approx(oracle_energy(rod, np.zeros(gradient.size)), rel=1e-13)
    assert value == pytest.approx(der.energy(*rod, np.empty(4)), rel=1e-13)
    np.testing.assert_allclose(gradient, oracle_gradient(rod, np.zeros(gradient.size)), atol=1e-10 * abs(gradient).max())
    hessian = dense(lower)
    np.testing.assert_allclose(hessian, oracle_hessian(rod, gradient.size), atol=1e-7 * abs(hessian).max())
