"""L D L^T of a band against LAPACK: solutions, inertia, and what must not be factored."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import eigvalsh, solve_banded, solveh_banded

from darboux.kernels import band

Array = NDArray[np.float64]

SIZES = [1, 7, 10, 11, 12, 23, 203]


def random_band(n: int, shift: float) -> tuple[Array, Array]:
    """A random symmetric band in blocks of four, with its diagonal shifted: flat lower storage, and dense."""
    rng = np.random.default_rng(n)
    i, j = np.indices((n, n))
    A = np.where((j <= i) & (i <= j - j % 4 + band.REACH), rng.uniform(-1, 1, (n, n)), 0.0) + shift * np.eye(n)
    lower = np.full((n, band.LOWER), np.nan)  # what lies below the last row must not be read
    for j in range(n):
        lower[j, : n - j] = A[j : j + band.LOWER, j]
    return lower.ravel(), A + np.tril(A, -1).T


@pytest.mark.parametrize("n", SIZES)
def test_definite_band_is_solved_as_by_lapack(n: int) -> None:
    lower, A = random_band(n, 12.0)
    b = np.random.default_rng(1).standard_normal(n)
    expected = solveh_banded(np.nan_to_num(lower).reshape(n, -1).T[:n], b, lower=True)
    assert band.factor(lower, n) == 0
    x = b.copy()
    band.solve(lower, n, x)
    np.testing.assert_allclose(x, expected, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(A @ x, b, atol=1e-13)


@pytest.mark.parametrize("n", SIZES)
def test_indefinite_band_has_as_many_negative_pivots_as_eigenvalues(n: int) -> None:
    lower, A = random_band(n, 0.7)
    b = np.random.default_rng(2).standard_normal(n)
    assert band.factor(lower, n) == np.count_nonzero(eigvalsh(A) < 0)
    x = b.copy()
    band.solve(lower, n, x)
    np.testing.assert_allclose(A @ x, b, atol=1e-8 * abs(x).max())


@pytest.mark.parametrize("shift", [-12.0, -3.0, 0.3, 3.0])
def test_inertia_follows_a_shift_of_the_spectrum(shift: float) -> None:
    lower, A = random_band(60, shift)
    assert band.factor(lower, 60) == np.count_nonzero(eigvalsh(A) < 0)


def test_factors_multiply_back() -> None:
    n = 23
    lower, A = random_band(n, 0.7)
    band.factor(lower, n)
    L, D = np.eye(n), lower[:: band.LOWER]
    for j in range(n):
        below = min(band.REACH, n - 1 - j)
        L[j + 1 : j + 1 + below, j] = lower[band.LOWER * j + 1 : band.LOWER * j + 1 + below]
    np.testing.assert_allclose(L @ np.diag(D) @ L.T, A, atol=1e-11)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # which NumPy gives where the kernels run uncompiled
@pytest.mark.parametrize("pivot", [0.0, np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", [0, 5, 22])
def test_pivot_that_is_zero_or_not_finite_is_refused(place: int, pivot: float) -> None:
    n = 23
    lower = np.zeros(band.LOWER * n)
    lower[:: band.LOWER] = 1.0
    lower[band.LOWER * place] = pivot
    assert band.factor(lower, n) == -1


@pytest.mark.parametrize("n", [7, 12, 43])
def test_fixed_unknowns_leave_the_system_of_the_free_ones(n: int) -> None:
    lower, A = random_band(n, 0.7)
    rng = np.random.default_rng(n)
    gradient, fixed = rng.standard_normal(n), rng.random(n) < 0.3
    expected = np.zeros(n)
    free = np.flatnonzero(~fixed)
    expected[free] = np.linalg.solve(A[np.ix_(free, free)], gradient[free])
    general, residual = np.empty(band.FULL * n), gradient.copy()
    band.expand(lower, n, general)

    band.fix(lower, gradient, fixed)
    assert band.factor(lower, n) == np.count_nonzero(eigvalsh(A[np.ix_(free, free)]) < 0)
    band.solve(lower, n, gradient)
    np.testing.assert_allclose(gradient, expected, atol=1e-9 * abs(expected).max())

    band.fix_general(general, residual, fixed)
    x = solve_banded((band.REACH, band.REACH), general.reshape(n, band.FULL).T, residual)
    np.testing.assert_allclose(x, expected, atol=1e-9 * abs(expected).max())


@pytest.mark.parametrize("n", SIZES)
def test_expanded_band_is_the_same_matrix(n: int) -> None:
    lower, A = random_band(n, 12.0)
    general = np.full(band.FULL * n, np.nan)
    band.expand(lower, n, general)
    rows = general.reshape(n, band.FULL).T
    for i in range(n):
        for j in range(max(0, i - band.REACH), min(n, i + band.LOWER)):
            assert rows[band.REACH + i - j, j] == A[i, j]
    assert np.count_nonzero(rows) == np.count_nonzero(A)


@pytest.mark.parametrize("n", SIZES)
def test_general_band_is_solved_as_by_lapack(n: int) -> None:
    rng, general = np.random.default_rng(n), np.empty(band.FULL * n)
    band.expand(random_band(n, 12.0)[0], n, general)
    general *= rng.uniform(0.5, 1.0, general.size)  # no longer symmetric
    b = rng.standard_normal(n)
    rows = general.reshape(n, band.FULL)
    A = np.array(
        [[rows[j, band.REACH + i - j] if abs(i - j) <= band.REACH else 0.0 for j in range(n)] for i in range(n)]
    )
    x = b.copy()
    assert band.solve_general(general, n, x)
    np.testing.assert_allclose(x, np.linalg.solve(A, b), rtol=1e-12, atol=1e-14)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("pivot", [0.0, np.nan])
def test_general_band_without_a_pivot_is_refused(pivot: float) -> None:
    general = np.zeros(band.FULL * 23)
    general[band.REACH :: band.FULL] = 1.0
    general[band.FULL * 5 + band.REACH] = pivot
    assert not band.solve_general(general, 23, np.ones(23))
