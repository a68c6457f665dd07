"""Where the rod lies before anything acts on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.packing.laying import placed
from darboux.packing.scale import Scale
from darboux.problem import Equilibrium
from darboux.statics import first_shape

Array = NDArray[np.float64]


def unloaded(problem: Equilibrium, s: Array) -> tuple[Array, Array, Array]:
    """Return the rod without loads at s (n,), laid where its first support holds it; a ring is the round one.

    Centreline (n, 3) in m, directors (n, 3, 3), curvature and twist (n, 3) in 1/m. Supports that bend the rod are not
    followed: it is where a solve sets out from.
    """
    L = problem.rod.length
    circle = first_shape.of_problem(problem)
    if circle is not None:
        r, q = circle.states(s / L)
        return Scale.of(problem).origin + L * r, frames.matrix_of_quaternion(q), circle.k(s / L) / L
    return (*placed(problem, s), problem.rod.k0(s))
