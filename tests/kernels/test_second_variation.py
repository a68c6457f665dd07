"""The sum of a rod's pieces and what holds its nodes, against dense matrices: transfers of a real rod's pieces, random supports."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from darboux.kernels import second_variation
from darboux.kernels.inertia import BLOCK
from tests.kernels.test_inertia import matrix

N = 5
X = np.array([0.0, 0.1, 0.35, 0.5, 0.8, 1.0])


def transfers(force: float) -> np.ndarray:
    """Those of a straight rod under tension, EI = 2, GJ = 1.5, EA = 9, with r' = theta x e3 + n3 / EA e3 and theta' = B^-1 m."""
    A = np.zeros((BLOCK, BLOCK))
    E = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 0]])  # e3 x
    A[0:3, 3:6] = -E
    A[2, 8] = 1 / 9
    A[3:6, 9:] = np.diag([1 / 2, 1 / 2, 1 / 1.5])
    A[9:, 6:9] = -E
    A[9:, 3:6] = force * np.diag([1.0, 1.0, 0.0])
    return np.array([expm(A * h) for h in np.diff(X)])


def assembled(T: np.ndarray, m: np.ndarray) -> tuple:
    parts = np.zeros((N + 1, BLOCK, BLOCK)), np.zeros((N, BLOCK, BLOCK)), np.zeros((N + 1, BLOCK))
    flat = tuple(part.ravel() for part in parts)
    counts = second_variation.assemble(T.copy().ravel(), X, m[:-1].ravel(), *flat)
    return parts, flat, counts


def conjugate(m: np.ndarray) -> np.ndarray:
    """From (dr, theta, dn, dm) to (dr, theta, dn, dm + 1/2 m x theta)."""
    to = np.eye(BLOCK)
    to[9:, 3:6] = 0.5 * np.cross(m, np.eye(3)).T
    return to


@pytest.mark.parametrize("force", [0.0, 30.0, -30.0])
def test_the_sum_is_the_energy_of_the_pieces(force: float) -> None:
    """Its value at any d and p is the sum of p0.(A^-1 d1 - d0) - 1/2 p0.A^-1 B p0 + 1/2 d1.C A^-1 d1."""
    rng = np.random.default_rng(1)
    m, T = rng.normal(size=(N + 1, 3)), transfers(force)
    (diagonal, below, weights), _, (of_forces, softest) = assembled(T, m)
    full = matrix(np.full(N + 1, BLOCK), diagonal, below)
    z = rng.normal(size=(N + 1, BLOCK))
    z[N, 6:] = 0.0
    energy, positive = 0.0, 0
    for i in range(N):
        P = conjugate(m[i + 1]) @ T[i] @ np.linalg.inv(conjugate(m[i]))
        A, B, C = P[:6, :6], P[:6, 6:], P[6:, :6]
        inverse = np.linalg.inv(A)
        d0, p0, d1 = z[i, :6], z[i, 6:], z[i + 1, :6]
        energy += p0 @ (inverse @ d1 - d0) - 0.5 * p0 @ inverse @ B @ p0 + 0.5 * d1 @ C @ inverse @ d1
        G = inverse @ B
        positive += np.count_nonzero(np.linalg.eigvalsh(0.5 * (G + G.T)) > -1e-13)
    assert 0.5 * z.ravel() @ full @ z.ravel() == pytest.approx(energy, rel=1e-12)
    assert of_forces == positive
    assert softest >= 1.0
    np.testing.assert_allclose(np.sum(weights[:, :6], axis=0), np.sum(weights[:, 0]))
    np.testing.assert_array_equal(weights[:, 6:], 0.0)


def test_a_held_node_keeps_its_motions_and_forces() -> None:
    rng = np.random.default_rng(2)
    parts, flat, _ = assembled(transfers(3.0), rng.normal(size=(N + 1, 3)))
    before = matrix(np.full(N + 1, BLOCK), parts[0].copy(), parts[1].copy())
    sizes, to, own = np.full(N + 1, BLOCK), np.eye(BLOCK * (N + 1)), parts[2][:, 0].copy()
    for node, free in ((0, 2), (3, 5), (N, 0)):
        motions, K = np.zeros((6, 6)), rng.normal(size=(6, 6))
        motions[:, :free] = np.linalg.qr(rng.normal(size=(6, 6)))[0][:, :free]
        K = K + K.T
        before[BLOCK * node : BLOCK * node + 6, BLOCK * node : BLOCK * node + 6] += K
        second_variation.hold(node, motions.ravel(), free, K.ravel(), *flat)
        sizes[node] = free + 6
        to[BLOCK * node : BLOCK * node + 6, BLOCK * node : BLOCK * node + 6] = motions
    kept = np.concatenate([BLOCK * i + np.r_[0 : sizes[i] - 6, 6:BLOCK] for i in range(N + 1)])
    expected = (to.T @ before @ to)[np.ix_(kept, kept)]
    np.testing.assert_allclose(matrix(sizes, parts[0], parts[1]), expected, atol=1e-12)
    index = second_variation.index(*flat, sizes, 0.3, 7)
    lent = np.concatenate([np.append(np.full(sizes[i] - 6, own[i]), np.zeros(6)) for i in range(N + 1)])
    np.testing.assert_allclose(np.concatenate([parts[2][i, : sizes[i]] for i in range(N + 1)]), lent)
    values = np.linalg.eigvalsh(expected + 0.3 * np.diag(lent))
    assert index == np.count_nonzero(values < 0.0) - 7
