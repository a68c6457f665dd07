"""Coefficients that vary along the rod: a table of piecewise polynomials."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.jit import inline

Array = NDArray[np.float64]


class Profile(NamedTuple):
    """Columns c(s) = sum_d C[p, d] (s - breaks[p])^d on breaks[p] <= s < breaks[p + 1]; they may jump at the breaks."""

    breaks: Array  # (P + 1,), ascending
    coefficients: Array  # C, (P, degree + 1, columns), flat
    degree: int


@inline
def piece_at(breaks: Array, s: float) -> int:
    """The piece p that begins at s or holds it; the last one at the very end."""
    p = 0
    while p < breaks.size - 2 and breaks[p + 1] <= s:
        p += 1
    return p


@inline
def evaluate(profile: Profile, p: int, s: float, c: Array) -> None:
    """c = ((C[p, degree] x + ...) x + C[p, 1]) x + C[p, 0], with x = s - breaks[p]."""
    x = s - profile.breaks[p]
    columns = c.size
    first = p * (profile.degree + 1) * columns
    row = first + profile.degree * columns
    for j in range(columns):
        c[j] = profile.coefficients[row + j]
    while row > first:
        row -= columns
        for j in range(columns):
            c[j] = c[j] * x + profile.coefficients[row + j]


@inline
def columns(profile: Profile) -> int:
    """How many columns a table has."""
    return profile.coefficients.size // ((profile.breaks.size - 1) * (profile.degree + 1))
