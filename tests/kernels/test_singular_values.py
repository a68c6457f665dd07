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


def test_the_step_of_a_large_force_is_no_free_motion() -> None:
    """Measured by its size it resists as the others do; by 1 its singular value is that of a free motion, and it is left alone."""
    rng = np.random.default_rng(11)
    A, b = equations(np.geomspace(1.0, 1e-3, 12), rng)
    unit = np.ones(12)
    unit[6:9] = 1e11
    of_forces = A / unit
    step, left_alone = np.empty((12, 2)), np.empty((12, 2))
    assert solve_by_singular_values(np.hstack([of_forces, b]).ravel(), unit, 0.0, step.ravel()) == 0
    np.testing.assert_allclose(step, unit[:, None] * np.linalg.solve(A, b), rtol=1e-9)
    change = (
        np.where(unit > 1.0, 1e-9, 1.0)[:, None] * unit[:, None] * np.array([[1.0, -2.0]])
    )  # of all, little of the forces
    asked = np.hstack([of_forces, of_forces @ change])
    assert solve_by_singular_values(asked.copy().ravel(), unit, 0.0, step.ravel()) == 0
    np.testing.assert_allclose(step, change, rtol=1e-3)
    assert solve_by_singular_values(asked.copy().ravel(), np.ones(12), 0.0, left_alone.ravel()) == 3
    np.testing.assert_array_less(np.abs(left_alone[6:9]), 0.1 * np.abs(change[6:9]))


def test_what_is_unsure_makes_a_motion_free_that_rounding_would_not() -> None:
    """A singular value of 1e-8 and a wish of 1e-8 along it: of a mesh with few elements."""
    rng = np.random.default_rng(7)
    U, V = (np.linalg.qr(rng.normal(size=(12, 12)))[0] for _ in range(2))
    A = U @ np.diag([1.0] * 11 + [1e-8]) @ V.T
    b = np.stack([A @ V[:, 0] + 1e-8 * U[:, 11], A @ V[:, 1]], axis=1)
    for unsure, free in ((0.0, 0), (1e-6, 1)):
        step = np.empty((12, 2))
        assert solve_by_singular_values(np.hstack([A, b]).ravel(), np.ones(12), unsure, step.ravel()) == free
        np.testing.assert_allclose(
            V[:, 11] @ step[:, 0], 1.0 - free, atol=1e-6
        )  # rows are scaled, which changes no solution
        np.testing.assert_allclose(V[:, 0] @ step[:, 0], 1.0, atol=1e-6)
