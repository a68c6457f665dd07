"""The lowest modes of an equilibrium: how stiff it is, and along which displacements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Modes:
    """The k lowest modes of the second variation, the lowest first; a negative stiffness is an unstable direction.

        d^2 E = stiffness a^2 for the mode times a,     sum over the rod of w (|dr|^2 + g^2 turn^2) = 1 for each mode

    with w the share of a piece in the rod's mass, or in its length where the rod has no mass, dr linear between the
    nodes, and g^2 = (I1 + I2) / A (0 for a section without a shape: its twist follows statically). Arrays: ``s`` (n,) in
    m; ``displacements`` (k, n, 3), fixed frame, and ``turns`` (k, n) about d3 in rad/m, both per unit of a; ``stiffness``
    (k,) in N/m, 0 of a free motion; ``frequencies`` (k,) in Hz of small vibrations, negative where the stiffness is (a motion
    then grows at the rate 2 pi |frequency|), or None where the rod has no mass.
    """

    s: Array
    displacements: Array
    turns: Array
    stiffness: Array
    frequencies: Array | None
