"""A problem's coefficients as piecewise polynomials: the same functions on more pieces, sums, and the law of the load factor."""

from __future__ import annotations

import numpy as np

from darboux.kernels.rod_equations import DEAD_FORCE, K0, SINV, WIDTH
from darboux.packing.coefficients import Table
from darboux.packing.loads import LOADS

RNG = np.random.default_rng(4)
X = np.sort(RNG.random(60))


def random(breaks: list[float], degree: int, columns: int) -> Table:
    return Table(np.array(breaks), RNG.normal(size=(len(breaks) - 1, degree + 1, columns)))


def test_more_pieces_are_the_same_functions() -> None:
    table = random([0.0, 0.4, 1.0], 5, 3)
    finer = table.on(np.array([0.0, 0.1, 0.4, 0.45, 0.9, 1.0]), 7)
    np.testing.assert_allclose(finer(X), table(X), atol=1e-13)
    assert finer.degree == 7


def test_a_sum_adds_to_its_columns_alone() -> None:
    table, more = random([0.0, 0.4, 1.0], 2, WIDTH), random([0.0, 0.3, 0.6, 1.0], 3, 3)
    before = table(X)
    total = table.plus(more, DEAD_FORCE)(X)
    before[:, DEAD_FORCE : DEAD_FORCE + 3] += more(X)
    np.testing.assert_allclose(total, before, atol=1e-13)


def test_the_law_leads_from_what_is_lent_to_the_problem() -> None:
    """At load factor 0 no load acts, and the compliance and the shape that are lent are there; at 1 they are gone."""
    table, relaxing = random([0.0, 0.4, 1.0], 2, WIDTH), RNG.normal(size=(2, 3, 3))
    base, rate = table.law(0.25, relaxing)
    np.testing.assert_allclose(base + rate, table.coefficients, atol=1e-15)
    np.testing.assert_array_equal(base[:, :, LOADS], 0.0)
    lent = base - table.coefficients
    np.testing.assert_allclose(lent[:, 0, SINV + 2], 0.25)
    np.testing.assert_allclose(lent[:, :, K0 : K0 + 3], -relaxing)
    lent[:, 0, SINV + 2] = lent[:, :, K0 : K0 + 3] = lent[:, :, LOADS] = 0.0
    np.testing.assert_array_equal(lent, 0.0)
