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


def transfers(force: float, stiff: float = 1.0) -> np.ndarray:
    """Those of a straight rod under tension, EI = 2, GJ = 1.5, EA = 9, with r' = theta x e3 + n3 / EA e3 and theta' = B^-1 m.

    `stiff` times so much in bending and twist.
    """
    A = np.zeros((BLOCK, BLOCK))
    E = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 0]])  # e3 x
    A[0:3, 3:6] = -E
    A[2, 8] = 1 / 9
    A[3:6, 9:] = np.diag([1 / 2, 1 / 2, 1 / 1.5]) / stiff
    A[9:, 6:9] = -E
    A[9:, 3:6] = force * np.diag([1.0, 1.0, 0.0])
    return np.array([expm(A * h) for h in np.diff(X)])


def assembled(T: np.ndarray, m: np.ndarray) -> tuple:
    parts = np.zeros((N + 1, BLOCK, BLOCK)), np.zeros((N, BLOCK, BLOCK)), np.zeros((N + 1, BLOCK))
    flat = tuple(part.ravel() for part in parts)
    counts = second_variation.assemble(T.copy().ravel(), X, m[:-1].ravel(), np.zeros(0), *flat)
    return parts, flat, counts


def conjugate(m: np.ndarray) -> np.ndarray:
    """From (dr, theta, dn, dm) to (dr, theta, dn, dm + 1/2 m x theta)."""
    to = np.eye(BLOCK)
    to[9:, 3:6] = 0.5 * np.cross(m, np.eye(3)).T
    return to


@pytest.mark.parametrize(
    ("force", "stiff"), [(0.0, 1.0), (30.0, 1.0), (-30.0, 1.0), (-60.0, 1.0), (0.0, 0.1), (-3.0, 0.1)]
)
def test_the_sum_is_the_energy_of_the_pieces(force: float, stiff: float) -> None:
    """Its value at any d and p is the sum of p0.(A^-1 d1 - d0) - 1/2 p0.A^-1 B p0 + 1/2 d1.C A^-1 d1.

    Forces count by the eigenvalues of A^-1 B, of which the longest piece under -60 has two that are negative: free at one end it
    would buckle. A soft piece's displacements weigh less, by its compliance of bending and twist over h.
    """
    rng = np.random.default_rng(1)
    m, T = rng.normal(size=(N + 1, 3)), transfers(force, stiff)
    (diagonal, below, weights), _, (of_forces, softest) = assembled(T, m)
    full = matrix(np.full(N + 1, BLOCK), diagonal, below)
    z = rng.normal(size=(N + 1, BLOCK))
    z[N, 6:] = 0.0
    energy, positive, soft, lengths = 0.0, 0, [], np.zeros(N + 1)
    for i in range(N):
        P = conjugate(m[i + 1]) @ T[i] @ np.linalg.inv(conjugate(m[i]))
        A, B, C = P[:6, :6], P[:6, 6:], P[6:, :6]
        inverse = np.linalg.inv(A)
        d0, p0, d1 = z[i, :6], z[i, 6:], z[i + 1, :6]
        energy += p0 @ (inverse @ d1 - d0) - 0.5 * p0 @ inverse @ B @ p0 + 0.5 * d1 @ C @ inverse @ d1
        G = inverse @ B
        positive += np.count_nonzero(np.linalg.eigvalsh(0.5 * (G + G.T)) > -1e-13)
        soft.append(max(1.0, np.max(np.abs(np.tril(0.5 * (G + G.T))[:, 3:])) / (X[i + 1] - X[i])))
        lengths[i : i + 2] += 0.5 * (X[i + 1] - X[i]) / soft[-1]
    assert 0.5 * z.ravel() @ full @ z.ravel() == pytest.approx(energy, rel=1e-12)
    assert of_forces == positive
    assert softest == pytest.approx(max(soft), rel=1e-12)
    assert (softest > 1.0) == (stiff < 1.0 or force == -60.0)
    assert (positive < 6 * N) == (force == -60.0)
    np.testing.assert_allclose(weights[:, :6], np.tile(lengths[:, None], 6), rtol=1e-12)
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


@pytest.mark.parametrize("seed", range(4))
def test_a_piece_is_solved_as_by_numpy(seed: int) -> None:
    """A^-1, A^-1 B and C A^-1 of any matrix, also of one whose pivots are not on the diagonal."""
    rng = np.random.default_rng(seed)
    T = rng.normal(size=(12, 12))
    if seed % 2:
        T[:6, :6] = np.eye(6)[rng.permutation(6)] + 1e-9 * T[:6, :6]
    M, S = np.empty((6, second_variation.LINE)), np.empty((6, 8))
    second_variation._solve_piece(T.copy().ravel(), 0, M.ravel(), S.ravel())
    inverse = np.linalg.inv(T[:6, :6])
    at, of_B = second_variation.INVERSE, second_variation.OF_B
    np.testing.assert_allclose(M[:, at : at + 6], inverse, atol=1e-12 * np.max(np.abs(inverse)))
    np.testing.assert_allclose(M[:, of_B : of_B + 6], inverse @ T[:6, 6:], atol=1e-11 * np.max(np.abs(inverse)))
    np.testing.assert_allclose(S[:, :6], T[6:, :6] @ inverse, atol=1e-11 * np.max(np.abs(inverse)))


@pytest.mark.parametrize("seed", range(6))
def test_a_definite_compliance_is_told_from_others(seed: int) -> None:
    """Shifted to either side of its least eigenvalue."""
    A = np.random.default_rng(seed).normal(size=(6, 6))
    A = A + A.T
    least = np.linalg.eigvalsh(A)[0]
    for shift, definite in ((1e-9, True), (-1e-9, False)):
        rows = np.zeros((6, BLOCK))
        rows[:, :6] = A + (shift - least) * np.eye(6)
        assert second_variation._is_definite(rows.ravel()) is definite
