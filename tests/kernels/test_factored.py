"""The factored matrix of a mesh against dense matrices: right sides, transposed, bordered, and where it is singular."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from darboux.kernels import factored
from darboux.kernels.factored import FREE, HALF, Border

Array = Any
ELEMENTS = 7


def drawn(seed: int) -> tuple[Array, Array, Array, Array]:
    """Rows at the start and the end, blocks, and the dense matrix that they are."""
    rng = np.random.default_rng(seed)
    start, end = rng.normal(size=(2, HALF, FREE))
    blocks = rng.normal(size=(ELEMENTS, FREE, 2 * FREE))
    A = np.zeros((FREE * (ELEMENTS + 1),) * 2)
    A[:HALF, :FREE], A[-HALF:, -FREE:] = start, end
    for i, block in enumerate(blocks):
        A[HALF + i * FREE : HALF + (i + 1) * FREE, i * FREE : (i + 2) * FREE] = block
    return start, blocks, end, A


def singular(seed: int, dimension: int) -> tuple[Array, Array, Array, Array, Array]:
    """The same with a kernel (rows, dimension): what the rows make of it is taken off, along the part of it that each row sees."""
    start, blocks, end, A = drawn(seed)
    kernel = np.linalg.qr(np.random.default_rng(seed + 1).normal(size=(len(A), dimension)))[0]
    for row in A:
        seen = np.flatnonzero(row)
        part = kernel[seen]
        row[seen] -= part @ np.linalg.solve(part.T @ part, kernel.T @ row)
    start, end = A[:HALF, :FREE], A[-HALF:, -FREE:]
    blocks = np.array([A[HALF + i * FREE : HALF + (i + 1) * FREE, i * FREE : (i + 2) * FREE] for i in range(ELEMENTS)])
    return start, blocks, end, A, kernel


def factors_of(start: Array, blocks: Array, end: Array) -> factored.Factors:
    factors = factored.new_factors(len(blocks))
    factored.factor(*(np.ascontiguousarray(part).ravel() for part in (start, blocks, end)), factors)
    return factors


def border_of(k: int, size: int, seed: int = 5) -> tuple[Border, Array, Array, Array]:
    rng = np.random.default_rng(seed)
    B, D, G = rng.normal(size=(size, k)), rng.normal(size=(k, size)), rng.normal(size=(k, k))
    return Border(B.ravel(), np.ascontiguousarray(D.T).ravel(), G.ravel()), B, D, G


@pytest.mark.parametrize("transposed", [False, True])
@pytest.mark.parametrize("k", [0, 1, 3])
def test_right_sides_are_solved_as_by_a_dense_matrix(k: int, transposed: bool) -> None:
    start, blocks, end, A = drawn(1)
    border, B, D, G = border_of(k, len(A))
    whole = np.block([[A, B], [D, G]])
    b = np.random.default_rng(2).normal(size=(len(whole), 4))
    exact = np.linalg.solve(whole.T if transposed else whole, b)
    right, more = b[: len(A)].ravel(), b[len(A) :].ravel()
    solve = factored.solve_transposed if transposed else factored.solve
    assert solve(factors_of(start, blocks, end), border, right, more, 4) > 1e-6
    found = np.concatenate([right, more]).reshape(b.shape)
    np.testing.assert_allclose(found, exact, atol=1e-11 * np.max(np.abs(exact)))


@pytest.mark.parametrize("dimension", [1, 2])
def test_a_border_repairs_a_singular_matrix(dimension: int) -> None:
    """The plain matrix has no solution; with as many rows and columns more as its kernel has, the residual is rounding."""
    start, blocks, end, A, kernel = singular(3, dimension)
    assert np.max(np.abs(A @ kernel)) < 1e-12
    factors, none = factors_of(start, blocks, end), border_of(0, len(A))[0]
    b = np.random.default_rng(4).normal(size=len(A))
    assert factored.solve(factors, none, b.copy(), np.empty(0), 1) < 1e-12
    border, B, D, G = border_of(dimension, len(A))
    whole = np.block([[A, B], [D, G]])
    for solve, matrix in ((factored.solve, whole), (factored.solve_transposed, whole.T)):
        right, more = b.copy(), np.arange(1.0, dimension + 1.0)
        asked = np.concatenate([right, more])
        assert solve(factors, border, right, more, 1) > 1e-6
        found = np.concatenate([right, more])
        np.testing.assert_allclose(matrix @ found, asked, atol=1e-11 * np.max(np.abs(found)))


@pytest.mark.parametrize("dimension", [1, 2])
def test_null_vectors_of_both_sides_follow_from_a_border(dimension: int) -> None:
    start, blocks, end, A, kernel = singular(6, dimension)
    factors, (border, *_) = factors_of(start, blocks, end), border_of(dimension, len(A))
    border = border._replace(G=np.zeros(dimension**2))
    for solve, matrix in ((factored.solve, A), (factored.solve_transposed, A.T)):
        null, more = np.zeros((len(A), dimension)), np.eye(dimension)
        flat = null.ravel()
        solve(factors, border, flat, more.ravel(), dimension)
        assert np.max(np.abs(matrix @ null)) < 1e-10 * np.max(np.abs(null))
        assert np.linalg.matrix_rank(null) == dimension
    right = np.linalg.qr(kernel)[0]
    null, more = np.zeros((len(A), dimension)), np.eye(dimension)
    factored.solve(factors, border, null.ravel(), more.ravel(), dimension)
    np.testing.assert_allclose(right @ (right.T @ null), null, atol=1e-9 * np.max(np.abs(null)))
