"""The bordered matrix of a mesh is solved as a dense one, and its transpose, also where it is singular without its borders."""

from __future__ import annotations

import numpy as np
import pytest

from darboux.kernels import bordered
from darboux.kernels.bordered import HALF, Borders, Factors, Matrix, new_factors
from darboux.kernels.system import FREE

Array = np.ndarray
SOLVED = 1e-13  # of the residual, over the matrix times the solution


def random(elements: int, k: int, rng: np.random.Generator) -> Array:
    """A matrix with k borders, dense."""
    n = FREE * (elements + 1)
    M = np.zeros((n + k, n + k))
    M[:HALF, :FREE] = rng.normal(size=(HALF, FREE))
    for i in range(elements):
        M[HALF + i * FREE : HALF + (i + 1) * FREE, i * FREE : (i + 2) * FREE] = rng.normal(size=(FREE, 2 * FREE))
    M[n - HALF : n, n - FREE : n] = rng.normal(size=(HALF, FREE))
    M[:, n:], M[n:, :n] = rng.normal(size=(n + k, k)), rng.normal(size=(k, n))
    return M


def factored(M: Array, k: int) -> tuple[Factors, float]:
    """The factors of a dense matrix with k borders."""
    n = len(M) - k
    rows = range(HALF, n - HALF, FREE)
    blocks = [M[row : row + FREE, row - HALF : row - HALF + 2 * FREE].ravel() for row in rows]
    start, end = M[:HALF, :FREE].flatten(), M[n - HALF : n, n - FREE : n].flatten()
    borders = Borders(M[:n, n:].flatten(), M[n:, :n].flatten(), M[n:, n:].flatten())
    factors = new_factors(len(blocks), k)
    return factors, bordered.factor(Matrix(start, np.concatenate([*blocks, []]), end), borders, factors)


def solved(factors: Factors, b: Array, transposed: bool = False) -> Array:
    x = np.empty_like(b)
    (bordered.solve_transposed if transposed else bordered.solve)(factors, b.ravel(), x.ravel())
    return x


def left_over(M: Array, x: Array, b: Array) -> float:
    return float(np.max(np.abs(M @ x - b)) / (np.linalg.norm(M, 2) * np.max(np.abs(x))))


def check(M: Array, factors: Factors, b: Array) -> None:
    assert left_over(M, solved(factors, b), b) < SOLVED
    assert left_over(M.T, solved(factors, b, transposed=True), b) < SOLVED


@pytest.mark.parametrize("k", [0, 1, 3])
@pytest.mark.parametrize("elements", [0, 1, 2, 7])
def test_both_are_solved_as_a_dense_matrix(elements: int, k: int) -> None:
    rng = np.random.default_rng(10 * elements + k)
    M = random(elements, k, rng)
    factors, pivot = factored(M, k)
    assert np.sign(pivot) == np.linalg.slogdet(M)[0]
    for sides in (1, 4):
        check(M, factors, rng.normal(size=(len(M), sides)))


def test_pivots_come_from_the_node_before_where_a_joint_has_none() -> None:
    """Of a station's twelve equations some say nothing of the forces before it."""
    rng = np.random.default_rng(3)
    M = random(3, 0, rng)
    M[HALF + FREE : HALF + 2 * FREE, FREE + 6 : 2 * FREE] = 0.0
    check(M, factored(M, 0)[0], rng.normal(size=(len(M), 2)))


def singular(elements: int, k: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """A matrix with a kernel of k dimensions, within rounding, and random borders; and that kernel (n, k)."""
    M = random(elements, k, rng)
    n = len(M) - k
    kernel = rng.normal(size=(n, k))
    first, last = slice(0, FREE), slice(n - FREE, n)
    for rows, here in ((slice(0, HALF), first), (slice(n - HALF, n), last)):
        M[rows, here] -= M[rows, here] @ kernel[here] @ np.linalg.pinv(kernel[here])
    for i in range(elements):
        rows, here = slice(HALF + i * FREE, HALF + (i + 1) * FREE), slice(i * FREE, (i + 2) * FREE)
        M[rows, here] -= M[rows, here] @ kernel[here] @ np.linalg.pinv(kernel[here])
    M[n:, n:] = 0.0
    return M, kernel


@pytest.mark.parametrize("k", [1, 2, 3])
def test_borders_are_sound_where_the_matrix_is_singular(k: int) -> None:
    rng = np.random.default_rng(k)
    M, kernel = singular(6, k, rng)
    n = len(M) - k
    b = rng.normal(size=(n + k, 3))
    factors, pivot = factored(M, k)
    assert abs(pivot) > 1e-6
    check(M, factors, b)
    assert np.max(np.abs(solved(factors, b))) < 1.01 * np.max(np.abs(np.linalg.solve(M, b)))
    unit = np.concatenate([np.zeros((n, k)), np.eye(k)])
    x = solved(factors, unit)
    np.testing.assert_allclose(x[n:], 0.0, atol=1e-12, rtol=0.0)
    np.testing.assert_allclose(x[:n] - kernel @ np.linalg.lstsq(kernel, x[:n])[0], 0.0, atol=1e-10, rtol=0.0)
    plain, small = factored(M[:n, :n], 0)
    assert abs(small) < 1e-12
    if small != 0.0:
        assert not np.max(np.abs(M[:n, :n] @ solved(plain, b[:n]) - b[:n])) < 1e-6


def test_a_matrix_of_nothing_is_said_to_be_singular() -> None:
    with np.errstate(all="ignore"):
        assert factored(np.zeros((FREE, FREE)), 0)[1] == 0.0
