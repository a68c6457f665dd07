"""Twelve equations solved by singular values, against NumPy's: regular ones, and those with free motions."""

from __future__ import annotations

import numpy as np
import pytest

from darboux.kernels.singular_values import FREE_MOTION, solve_by_singular_values


def equations(values: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Equations of these singular values, with rows of length 1, and right sides that ask for nothing along the free motions."""
    A = np.linalg.qr(rng.normal(size=(12, 12)))[0] @ np.diag(values) @ np.linalg.qr(rng.normal(size=(12, 12)))[0]
    A /= np.linalg.norm(A, axis=1, keepdims=True)
    U, found, _ = np.linalg.svd(A)
    regular = U[:, found > FREE_MOTION * found[0]]
    return A, regular @ (regular.T @ rng.normal(size=(12, 2)))


@pytest.mark.parametrize("free", [0, 1, 2, 3])
def test_free_motions_are_left_alone(free: int) -> None:
    rng = np.random.default_rng(free)
    for _ in range(5):
        values = np.concatenate([np.geomspace(1.0, 1e-4, 12 - free), 1e-14 * rng.random(free)])
        A, b = equations(values, rng)
        stretched = np.exp(rng.normal(size=(12, 1)))  # the rows' lengths are no matter
        step = np.empty((12, 2))
        assert solve_by_singular_values((stretched * np.hstack([A, b])).ravel(), np.ones(12), 0.0, step.ravel()) == free
        np.testing.assert_allclose(step, np.linalg.pinv(A, rcond=1e-10) @ b, rtol=1e-7, atol=1e-9)


def test_what_is_asked_for_along_a_free_motion_is_done() -> None:
    rng = np.random.default_rng(7)
    A, b = equations(np.append(np.ones(11), 1e-12), rng)
    b += 1e-3 * np.linalg.svd(A)[0][:, 11:]
    step = np.empty((12, 2))
    assert solve_by_singular_values(np.hstack([A, b]).ravel(), np.ones(12), 0.0, step.ravel()) == 0
    np.testing.assert_allclose(A @ step, b, atol=1e-15 * np.max(np.abs(step)) * 12.0)
    assert np.min(np.max(np.abs(step), axis=0)) > 1e6


def test_a_small_wish_along_a_motion_that_resists_is_granted() -> None:
    A, _ = equations(np.geomspace(1.0, 1e-4, 12), np.random.default_rng(9))
    U, sizes, V = np.linalg.svd(A)
    b = U[:, :2] + 1e-8 * U[:, 11:]
    step = np.empty((12, 2))
    assert solve_by_singular_values(np.hstack([A, b]).ravel(), np.ones(12), 0.0, step.ravel()) == 0
    np.testing.assert_allclose(V[11] @ step, 1e-8 / sizes[11], rtol=1e-6)
