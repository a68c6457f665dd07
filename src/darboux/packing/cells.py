"""What the discrete rods read of the columns: matrices of six numbers, and means over edges and the cells of vertices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))  # the order in which symmetric matrices are stored


def symmetric(numbers: Array) -> Array:
    """Return (n, 3, 3) from the six numbers 11, 22, 33, 23, 13, 12."""
    return numbers[:, [0, 5, 4, 5, 1, 3, 4, 3, 2]].reshape(-1, 3, 3)


def six(matrix: Array) -> Array:
    """Return the six numbers (n, 6) of symmetric matrices (n, 3, 3)."""
    return np.stack([matrix[:, i, j] for i, j in PAIRS], axis=1)
