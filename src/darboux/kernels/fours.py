"""Four numbers at once, as tuples of scalars: the compiler makes one vector of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.jit import inline

Array = NDArray[np.float64]
Four = tuple[float, float, float, float]

NOTHING = (0.0, 0.0, 0.0, 0.0)
# An index that is unsigned never counts from the end: the compiler leaves out what looks for that, and uses vectors.
ONE, TWO, THREE = np.uint64(1), np.uint64(2), np.uint64(3)


@inline
def four(x: Array, i: int) -> Four:
    """The four numbers of x from i on."""
    o = np.uint64(i)
    return x[o], x[o + ONE], x[o + TWO], x[o + THREE]


@inline
def put_four(x: Array, i: int, a: Four) -> None:
    """x[i], ..., x[i + 3] = a."""
    o = np.uint64(i)
    x[o], x[o + ONE], x[o + TWO], x[o + THREE] = a


@inline
def four_plus(a: Four, s: float, b: Four) -> Four:
    """a + s b."""
    return a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2], a[3] + s * b[3]
