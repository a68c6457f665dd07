"""Gauss' method: its weights, by the conditions that define them, and their inverses."""

from __future__ import annotations

import numpy as np
import pytest

from darboux.kernels import gauss


@pytest.mark.parametrize("stages", range(gauss.FEWEST_STAGES, gauss.MOST_STAGES + 1))
def test_weights_integrate_polynomials(stages: int) -> None:
    """sum_j a_ij c_j^(k-1) = c_i^k / k for k up to the stages; sum_j b_j c_j^(k-1) = 1 / k up to twice as many (Butcher 1964)."""
    row = gauss.METHODS[stages * gauss.PER_METHOD :]
    c, a = row[:stages], row[stages : stages + stages * (stages + 1)].reshape(stages + 1, stages)
    for k in range(1, stages + 1):
        np.testing.assert_allclose(a[:-1] @ c ** (k - 1), c**k / k, atol=1e-14)
    for k in range(1, 2 * stages + 1):
        np.testing.assert_allclose(a[-1] @ c ** (k - 1), 1.0 / k, atol=1e-14)
    inverse = row[stages * (stages + 2) : 2 * stages * (stages + 1) + stages].reshape(stages + 1, stages)
    np.testing.assert_allclose(inverse[:-1] @ a[:-1], np.eye(stages), atol=1e-13)
    np.testing.assert_allclose(inverse[-1] @ a[:-1], a[-1], atol=1e-13)
