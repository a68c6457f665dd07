"""Where the rod lies before anything acts on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.natural import smallest_rotation
from darboux.problem import Equilibrium, Ring
from darboux.statics.first_shape import shape_of
from darboux.statics.laying import laid

Array = NDArray[np.float64]


def unloaded(problem: Equilibrium, samples: int) -> Array:
    """Return the centreline (samples, 3) in m of the rod without loads, laid where its first support holds it.

    A ring is a circle. Supports that bend the rod are not followed: it is where a solve sets out from.
    """
    L = problem.rod.length
    circle = np.array([0.0, frames.turn, 0.0])
    support, place, orientation = laid(problem)
    x = np.unique(np.append(np.linspace(0.0, 1.0, samples), place))
    k = (lambda x: np.tile(circle, (len(x), 1))) if isinstance(problem, Ring) else (lambda x: problem.rod.k0(x * L) * L)
    r, q = shape_of(k, x)
    i = int(np.searchsorted(x, place))
    if orientation.shape == (3, 3):
        turn = orientation @ frames.matrix_of_quaternion(q)[i].T
    else:
        chord = r[-1] - r[0]
        turn = smallest_rotation(chord / np.linalg.norm(chord), orientation)
    return np.asarray(np.array(support.position) + L * (r - r[i]) @ turn.T)
