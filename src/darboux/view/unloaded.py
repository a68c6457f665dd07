"""Where the rod lies before anything acts on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.natural import smallest_rotation
from darboux.problem import Equilibrium
from darboux.statics import first_shape
from darboux.statics.coefficients import Scale
from darboux.statics.laying import laid

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
    support, place, lie = laid(problem)
    r, q = first_shape.shape_of(lambda x: problem.rod.k0(x * L) * L, np.concatenate([[0.0, 1.0], s / L, [place]]))
    R, chord = frames.matrix_of_quaternion(q), r[1] - r[0]
    length = float(np.linalg.norm(chord))
    straight = chord / length if length > 0.0 else np.array([0.0, 0.0, 1.0])  # of a rod that is closed by nature
    turn = lie @ R[-1].T if lie.ndim == 2 else smallest_rotation(straight, lie)
    return np.array(support.position) + L * (r[2:-1] - r[-1]) @ turn.T, turn @ R[2:-1], problem.rod.k0(s)
