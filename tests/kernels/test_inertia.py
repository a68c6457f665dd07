"""Counting negative eigenvalues of indefinite block tridiagonal matrices, and the last twelve equations, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from darboux.kernels.collocation import solve_last
from darboux.kernels.inertia import negative_eigenvalues


def matrix(sizes: np.ndarray, diagonal: np.ndarray, below: np.ndarray) -> np.ndarray:
    """The whole matrix, of blocks (N, 12, 12) on the diagonal and (N - 1, 12, 12) below it."""
    starts = np.concatenate([[0], np.cumsum(sizes)])
    full = np.zeros((starts[-1], starts[-1]))
    for i, n in enumerate(sizes):
        here = slice(starts[i], starts[i + 1])
        full[here, here] = diagonal[i, :n, :n]
        if i:
            before = slice(starts[i - 1], starts[i])
            full[here, before] = below[i - 1, :n, : sizes[i - 1]]
            full[before, here] = full[here, before].T
    return full


def random_blocks(seed: int, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(len(sizes), 12, 12))
    return A + A.transpose(0, 2, 1), rng.normal(size=(len(sizes) - 1, 12, 12))


def count(sizes: np.ndarray, diagonal: np.ndarray, below: np.ndarray) -> int:
    return negative_eigenvalues(diagonal.ravel(), below.ravel(), sizes)


@pytest.mark.parametrize("seed", range(12))
def test_the_count_is_that_of_the_eigenvalues(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sizes = rng.integers(0 if seed % 3 else 2, 13, 8)
    diagonal, below = random_blocks(seed, sizes)
    diagonal += 3.0 * rng.normal(size=(8, 1, 1)) * np.eye(12)
    values = np.linalg.eigvalsh(matrix(sizes, diagonal, below))
    assert count(sizes, diagonal, below) == np.count_nonzero(values < 0.0)


@pytest.mark.parametrize("seed", range(6))
def test_blocks_without_a_pivot_of_their_own_wait(seed: int) -> None:
    """All blocks on the diagonal are zero, so that only the couplings give pivots: as many negative ones as positive ones."""
    sizes = np.full(10, 12) if seed % 2 else np.array([12, 5, 8, 3, 4])
    diagonal, below = random_blocks(seed, sizes)
    diagonal *= 1e-12
    values = np.linalg.eigvalsh(matrix(sizes, diagonal, below))
    assert count(sizes, diagonal, below) == np.count_nonzero(values < 0.0)


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("seed", range(4))
def test_the_count_is_sharp(seed: int, side: float) -> None:
    """Shifted to either side of its eigenvalues: all entries take part."""
    sizes = np.array([12, 6, 11, 12, 6])
    diagonal, below = random_blocks(seed, sizes)
    values = np.linalg.eigvalsh(matrix(sizes, diagonal, below))
    for k in (0, 11, 30, 46):
        shifted = diagonal - (values[k] + side * 1e-7) * np.eye(12)
        assert count(sizes, shifted, below) == k + (1 if side > 0.0 else 0)


@pytest.mark.parametrize("small", [1e-6, 1e-9])
def test_a_saddle_with_small_blocks_keeps_its_signs(small: float) -> None:
    """Displacements and forces of short pieces: [[K, E^T], [E, -G]] with K and G near 0 has the index of K + E^T G^-1 E."""
    rng = np.random.default_rng(5)
    K, G = (small * np.diag(rng.uniform(0.5, 1.0, 6)) for _ in range(2))
    E = np.eye(6) + 1e-3 * rng.normal(size=(6, 6))
    block = np.block([[K - 2e3 * small * np.eye(6), E.T], [E, -G]])
    index = np.count_nonzero(np.linalg.eigvalsh(K - 2e3 * small * np.eye(6) + E.T @ np.linalg.inv(G) @ E) < 0.0)
    assert count(np.array([12]), block[None], np.empty((0, 12, 12))) == 6 + index


def test_the_last_equations() -> None:
    rng = np.random.default_rng(3)
    last = rng.normal(size=(12, 14))
    delta = np.empty((12, 2))
    pivot = solve_last(last.copy().ravel(), delta.ravel())
    np.testing.assert_allclose(delta, np.linalg.solve(last[:, :12], last[:, 12:]), rtol=1e-10)
    assert np.sign(pivot) == np.sign(np.linalg.det(last[:, :12]))
    last[5, :12] = last[4, :12] * (1.0 + 1e-12 * rng.normal(size=12))
    assert abs(solve_last(last.copy().ravel(), delta.ravel())) < 1e-10
