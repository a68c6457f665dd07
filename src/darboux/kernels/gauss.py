"""Gauss' methods on [0, 1]: the points c, the weights a and b, and what follows from them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.jit import inline

Array = NDArray[np.float64]

FEWEST_STAGES, MOST_STAGES = 2, 5


def gauss(stages: int) -> tuple[Array, Array]:
    """Return the points c of Gauss' method, and the weights a with b as their last row."""
    x, w = np.polynomial.legendre.leggauss(stages)
    c, b = 0.5 * (x + 1.0), 0.5 * w
    powers = np.arange(1, stages + 1)
    a = (c[:, None] ** powers / powers) @ np.linalg.inv(c[:, None] ** (powers - 1))
    return c, np.vstack([a, b])


# One row of numbers per method, by its stages s: c (s,), a and b (s + 1, s), a^-1 and b a^-1 (s + 1, s), row by row.
PER_METHOD = 3 * MOST_STAGES + 2 * MOST_STAGES**2
METHODS = np.zeros((MOST_STAGES + 1) * PER_METHOD)
for _stages in range(FEWEST_STAGES, MOST_STAGES + 1):
    _c, _a = gauss(_stages)
    _inverse = np.linalg.inv(_a[:-1])
    _numbers = np.concatenate([_c, _a.ravel(), _inverse.ravel(), _a[-1] @ _inverse])
    METHODS[_stages * PER_METHOD : _stages * PER_METHOD + _numbers.size] = _numbers


@inline
def point(stages: int, j: int) -> float:
    """c_j."""
    number: float = METHODS[stages * PER_METHOD + j]
    return number


@inline
def weight(stages: int, j: int, l: int) -> float:
    """a_jl, or b_l for j = stages."""
    number: float = METHODS[stages * PER_METHOD + (j + 1) * stages + l]
    return number


@inline
def inverse_weight(stages: int, j: int, l: int) -> float:
    """(a^-1)_jl, or (b a^-1)_l for j = stages."""
    number: float = METHODS[stages * PER_METHOD + (stages + 2 + j) * stages + l]
    return number
