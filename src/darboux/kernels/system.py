"""The numbers of Newton's equations of a mesh: what is known of it, and how many unknowns a node has."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.profile import Profile

Array = NDArray[np.float64]

FREE = 12  # unknowns of a node: dr, phi, dn, dm
SIDES = 2  # right sides: the residual, and the load factor's
R_, PHI, N_, M_ = 0, 3, 6, 9  # where the parts of the unknowns begin
ROW = 2 * FREE + SIDES  # of the eliminated rows: 12 columns of the node, 12 of the next one, the right sides


class System(NamedTuple):
    """The rod on a mesh at a load factor, all arrays flat."""

    stages: int
    x: Array  # (N + 1,), the nodes
    y: Array  # (N + 1, 13), the states there
    Y: Array  # (N, stages, 13), those at Gauss' points
    table: Profile  # the coefficients of the rod equations at this load factor
    rate: Profile  # their derivatives by the load factor, in the same pieces
    shaped: Array  # (N, stages, SHAPED), the loads that are functions of the shape, or none
    load_factor: float
