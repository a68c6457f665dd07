"""Counting negative eigenvalues of indefinite block tridiagonal matrices, and the last twelve equations, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from darboux.kernels import inertia
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


@pytest.mark.parametrize("seed", range(8))
def test_the_units_of_rows_change_no_sign(seed: int) -> None:
    """D A D has as many negative eigenvalues as A, by Sylvester's law: now a pivot of two rows has eigenvalues of one sign."""
    rng, sizes = np.random.default_rng(seed), np.full(4, 12)
    diagonal, below = random_blocks(seed, sizes)
    diagonal *= 0.05
    below *= 0.05
    diagonal[:, range(12), range(12)] += rng.choice([-1.0, 1.0], size=(4, 12), p=[0.7, 0.3])
    expected = np.count_nonzero(np.linalg.eigvalsh(matrix(sizes, diagonal, below)) < 0.0)
    unit = 10.0 ** rng.uniform(-3.0, 3.0, size=(4, 12))
    diagonal *= unit[:, :, None] * unit[:, None, :]
    below *= unit[1:, :, None] * unit[:-1, None, :]
    assert count(sizes, diagonal, below) == expected


@pytest.mark.parametrize("small", [1e-6, 1e-9])
def test_a_saddle_with_small_blocks_keeps_its_signs(small: float) -> None:
    """Displacements and forces of short pieces: [[K, E^T], [E, -G]] with K and G near 0 has the index of K + E^T G^-1 E."""
    rng = np.random.default_rng(5)
    K, G = (small * np.diag(rng.uniform(0.5, 1.0, 6)) for _ in range(2))
    E = np.eye(6) + 1e-3 * rng.normal(size=(6, 6))
    block = np.block([[K - 2e3 * small * np.eye(6), E.T], [E, -G]])
    index = np.count_nonzero(np.linalg.eigvalsh(K - 2e3 * small * np.eye(6) + E.T @ np.linalg.inv(G) @ E) < 0.0)
    assert count(np.array([12]), block[None], np.empty((0, 12, 12))) == 6 + index


def pivots(A: np.ndarray, first: int) -> dict[tuple[int, int], float]:
    """Every pivot among the rows from `first` on, of one row or of two, with its size over what stands beside it in all rows.

    A pivot of two rows P lets |P^-1| (x, y) grow, x and y the largest entries beside it in its rows.
    """
    found = {}
    for i in range(first, len(A)):
        found[i, i] = abs(A[i, i]) / np.max(np.abs(np.delete(A[i], i)))
        for j in range(first, i):
            beside = [np.max(np.abs(np.delete(A[k], [i, j]))) for k in (i, j)]
            found[i, j] = 1.0 / np.max(np.abs(np.linalg.inv(A[np.ix_([i, j], [i, j])])) @ beside)
    return found


@pytest.mark.parametrize("first", [0, 4])
@pytest.mark.parametrize("diagonal", [3.0, 0.2, 1e-3, 0.0])
def test_a_pivot_is_large_enough_or_the_best(diagonal: float, first: int) -> None:
    """Its size over what stands beside it is what the rule says; one that is too small is the largest of all there are."""
    rng, n, kinds = np.random.default_rng(first), 14, set()
    for small in [1.0, 1e-2] * 10:  # coupled with the rows before `first` much more than with each other
        A = rng.normal(size=(n, n))
        A = A + A.T
        A[range(n), range(n)] *= diagonal
        A[first:, first:] *= small
        F, beside = np.zeros(inertia.FRONT**2 + 3), np.empty(3 * inertia.FRONT)
        F[: inertia.FRONT**2].reshape(inertia.FRONT, -1)[:n, :n] = A
        i, j, size = inertia._pivot(F, first, n, beside)
        every = pivots(A, first)
        assert size == pytest.approx(every[max(i, j), min(i, j)], rel=1e-12)
        assert size >= inertia.PIVOT or size == pytest.approx(max(every.values()), rel=1e-12)
        kinds.add((i == j, bool(size >= inertia.PIVOT)))
    assert kinds & ({(True, True)} if diagonal == 3.0 else {(False, True), (False, False)})


def test_the_last_equations() -> None:
    rng = np.random.default_rng(3)
    last = rng.normal(size=(12, 14))
    delta = np.empty((12, 2))
    pivot = solve_last(last.copy().ravel(), delta.ravel())
    np.testing.assert_allclose(delta, np.linalg.solve(last[:, :12], last[:, 12:]), rtol=1e-10)
    assert np.sign(pivot) == np.sign(np.linalg.det(last[:, :12]))
    last[5, :12] = last[4, :12] * (1.0 + 1e-12 * rng.normal(size=12))
    assert abs(solve_last(last.copy().ravel(), delta.ravel())) < 1e-10
