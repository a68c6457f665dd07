"""Every accepted step of an integration, as the nodes of a curve."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from darboux.kernels import dormand_prince
from darboux.kernels.rod_equations import STATES

Array = NDArray[np.float64]
Data = tuple[Array, Array, int]  # breaks, coefficients and degree of a table

MOST_STEPS = 100_000
FIRST_CAPACITY = 256


def accepted_steps(y: Array, a: float, b: float, data: Data, rtol: float) -> tuple[Array, Array, Array, int]:
    """Integrate from y (13,) at a to b; return the nodes x, y and dy, those at a break twice, and the kernel's status."""
    inner = data[0][(data[0] > a) & (data[0] < b)]
    parts: list[tuple[Array, Array, Array]] = []
    for start, end in pairwise([a, *inner, b]):
        x, states, slopes, status = _smooth_steps(y, start, end, data, rtol)
        parts.append((x, states, slopes))
        y = states[-1]
        if status != 0:
            break
    x, states, slopes = (np.concatenate(part) for part in zip(*parts, strict=True))
    return x, states, slopes, status


def _smooth_steps(y0: Array, a: float, b: float, data: Data, rtol: float) -> tuple[Array, Array, Array, int]:
    capacity = FIRST_CAPACITY
    while True:
        x, y, dy = np.empty(capacity), np.empty((capacity, STATES)), np.empty((capacity, STATES))
        status, count, *_ = dormand_prince.integrate_mesh(y0, a, b, *data, rtol, 1e-2 * rtol, x, y.ravel(), dy.ravel())
        if status != 1 or capacity > MOST_STEPS:
            return x[:count], y[:count], dy[:count], status
        capacity *= 4


def joined(x: Array, y: Array, dy: Array, knots: Array) -> tuple[Array, Array, Array]:
    """Return the nodes without those that stand twice although nothing jumps there; at knots of the data they stay."""
    keep = np.ones(len(x), dtype=bool)
    smooth = np.max(np.abs(np.diff(dy, axis=0)), axis=1) <= 1e-6 * (1.0 + np.max(np.abs(dy)))
    keep[1:] = (np.diff(x) > 0.0) | ~smooth | np.isin(x[1:], knots)
    return x[keep], y[keep], dy[keep]
