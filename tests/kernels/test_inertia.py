"""Counting negative eigenvalues of block tridiagonal matrices, and the last twelve equations, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from darboux.kernels.collocation import solve_last
from darboux.kernels.inertia import negative_eigenvalues


@pytest.mark.parametrize("seed", range(12))
def test_the_count_is_that_of_the_eigenvalues(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sizes = rng.integers(0 if seed % 3 else 2, 7, 8)
    diagonal, below = np.zeros((8, 6, 6)), np.zeros((7, 6, 6))
    starts = np.concatenate([[0], np.cumsum(sizes)])
    full = np.zeros((starts[-1], starts[-1]))
    for i, n in enumerate(sizes):
        A = rng.normal(size=(n, n))
        diagonal[i, :n, :n] = A + A.T + 3.0 * rng.normal() * np.eye(n)
        full[starts[i] : starts[i + 1], starts[i] : starts[i + 1]] = diagonal[i, :n, :n]
        if i:
            m = sizes[i - 1]
            below[i - 1, :n, :m] = rng.normal(size=(n, m))
            full[starts[i] : starts[i + 1], starts[i - 1] : starts[i]] = below[i - 1, :n, :m]
            full[starts[i - 1] : starts[i], starts[i] : starts[i + 1]] = below[i - 1, :n, :m].T
    expected = int(np.count_nonzero(np.linalg.eigvalsh(full) < 0.0))
    assert negative_eigenvalues(diagonal.ravel(), below.ravel(), sizes, 0.0, 0.0) == expected


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_count_is_sharp_where_blocks_are_definite(side: float) -> None:
    """A definite matrix, shifted to either side of its lowest eigenvalue: the inverses of all blocks take part."""
    rng = np.random.default_rng(2)
    diagonal, below, full = np.zeros((5, 6, 6)), rng.normal(size=(4, 6, 6)), np.zeros((30, 30))
    for i in range(5):
        A = rng.normal(size=(6, 6))
        diagonal[i] = A + A.T + 12.0 * np.eye(6)
        full[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] = diagonal[i]
        if i:
            full[6 * i : 6 * i + 6, 6 * i - 6 : 6 * i] = below[i - 1]
            full[6 * i - 6 : 6 * i, 6 * i : 6 * i + 6] = below[i - 1].T
    lowest = np.linalg.eigvalsh(full)[0] + side * 1e-6
    diagonal -= lowest * np.eye(6)
    count = negative_eigenvalues(diagonal.ravel(), below.ravel(), np.full(5, 6), 0.0, 0.0)
    assert count == (1 if side > 0.0 else 0)


def test_an_eigenvalue_of_rounding_does_not_count() -> None:
    D = np.diag([1.0, 2.0, -1e-9, 3.0, 1.0, 1.0])
    count = [negative_eigenvalues(D.ravel(), np.empty(0), np.array([6]), limit, 0.0) for limit in (1e-5, 0.0)]
    assert count == [0, 1]


def test_the_last_equations() -> None:
    rng = np.random.default_rng(3)
    last = rng.normal(size=(12, 14))
    delta = np.empty((12, 2))
    pivot = solve_last(last.copy().ravel(), delta.ravel())
    np.testing.assert_allclose(delta, np.linalg.solve(last[:, :12], last[:, 12:]), rtol=1e-10)
    assert np.sign(pivot) == np.sign(np.linalg.det(last[:, :12]))
    last[5, :12] = last[4, :12] * (1.0 + 1e-12 * rng.normal(size=12))
    assert abs(solve_last(last.copy().ravel(), delta.ravel())) < 1e-10
