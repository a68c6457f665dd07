"""Cubics from row to row of a table: a spline where the rows are smooth, which does not overshoot where they are not.

By NumPy alone, as a description may use no more.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

EXTREMUM = 0.25  # of h^2 times the curvature: twice what a parabola's vertex between two rows rises above them
LIMITER_ROUNDS = 50


def value(places: Array, powers: Array, s: Array) -> Array:
    """Return at s (...) the cubics with coefficients ``powers`` (4, n - 1, ...) from each of ``places`` (n,) on, highest first."""
    i = np.clip(np.searchsorted(places, s, side="right") - 1, 0, len(places) - 2)
    t = (s - places[i]).reshape(np.shape(s) + (1,) * (powers.ndim - 2))
    a, b, c, d = powers[:, i]
    return np.asarray(((a * t + b) * t + c) * t + d)


def piecewise_cubic(s: Array, values: Array, smooth: bool) -> Array:
    """Return the coefficients (4, n - 1, ...) of the cubics between rows s (n,) and values (n, ...), highest power first."""
    y = values.reshape(len(s), -1)
    h = np.diff(s)[:, None]
    steps = np.diff(y, axis=0) / h
    left = right = steps
    if smooth and len(s) > 2:
        slopes = _limited(h, y, steps, _of_spline(h, steps))
        left, right = slopes[:-1], slopes[1:]
    curved = (left + right - 2.0 * steps) / h
    parts = [curved / h, (steps - left) / h - curved, left, y[:-1]]
    return np.stack(parts).reshape(4, len(s) - 1, *values.shape[1:])


def _of_spline(h: Array, steps: Array) -> Array:
    """Return the slopes (n, c) of the spline through rows at distances h (n - 1, 1) that rise by ``steps`` (n - 1, c) per length.

        h_i p_i-1 + 2 (h_i-1 + h_i) p_i + h_i-1 p_i+1 = 3 (h_i step_i-1 + h_i-1 step_i),     step_i between the rows i and i + 1

    Its third derivative does not jump at the second row and the last but one, which gives p at the ends. Source: C. de Boor, A
    Practical Guide to Splines (1978), ch. IV.
    """
    low, up = h[1:], h[:-1]
    both, right = low + up, low * steps[:-1] + up * steps[1:]
    first = up[:1] * right[:1] / both[:1] + 2.0 * low[:1] * steps[:1]  # = low p_0 + both p_1
    last = low[-1:] * right[-1:] / both[-1:] + 2.0 * up[-1:] * steps[-1:]  # = both p_n-2 + up p_n-1
    rows = np.concatenate([low, 2.0 * both, up, 3.0 * right], axis=1)
    rows[:1] -= np.concatenate([low[:1], both[:1], np.zeros((1, 1)), first], axis=1)
    rows[-1:] -= np.concatenate([np.zeros((1, 1)), both[-1:], up[-1:], last], axis=1)
    p = _tridiagonal(rows) if len(rows) > 1 else right / both  # a parabola
    return np.concatenate([(first - both[:1] * p[:1]) / low[:1], p, (last - both[-1:] * p[-1:]) / up[-1:]])


def _tridiagonal(rows: Array) -> Array:
    """Return x (n, c) where low x_i-1 + middle x_i + up x_i+1 = right; ``rows`` (n, 3 + c) hold low, middle, up, right.

    Cyclic reduction: each round takes the neighbours out of all rows, so that those twice as far away come in. As the middle is
    twice the others together, as in a spline's rows, what is 64 rows away counts no more than about 2^-64.
    """
    n, beyond = len(rows), np.zeros((1, rows.shape[1]))
    beyond[:, 1] = 1.0
    for distance in (1, 2, 4, 8, 16, 32):
        edge = np.repeat(beyond, distance, axis=0)
        padded = np.concatenate([edge, rows, edge])
        before, behind = padded[:n], padded[2 * distance :]
        f, g = -rows[:, :1] / before[:, 1:2], -rows[:, 2:3] / behind[:, 1:2]
        rows = np.concatenate([f * before[:, :1], rows[:, 1:2], g * behind[:, 2:3], rows[:, 3:]], axis=1)
        rows[:, 1:2] += f * before[:, 2:3] + g * behind[:, :1]
        rows[:, 3:] += f * before[:, 3:] + g * behind[:, 3:]
    return rows[:, 3:] / rows[:, 1:2]


def _limited(h: Array, y: Array, steps: Array, slopes: Array) -> Array:
    """Return the slopes (n, c) of cubics through y (n, c) that don't overshoot, from those of a spline.

    Where a cubic leaves the range of its two rows by more than a parabola through smooth rows might, its slopes are taken
    towards the region in which it is monotone, 0 <= slope / step <= 3.
    """
    allowed, rounding = _at_an_extremum(h, y, steps), 1e-14 * np.max(np.abs(y), axis=0)
    low, high = np.minimum(0.0, 3.0 * steps), np.maximum(0.0, 3.0 * steps)
    for _ in range(LIMITER_ROUNDS):  # a slope that is taken in may bend the next interval
        excursion = _excursion(h, y, steps, slopes[:-1], slopes[1:])
        far = excursion > allowed + rounding
        if not np.any(far):
            break
        part = np.where(far, allowed / np.where(far, excursion, 1.0), 1.0)
        kept = slopes.copy()
        for ends in (slice(None, -1), slice(1, None)):
            monotone = np.clip(slopes[ends], low, high)
            inner = monotone + part * (slopes[ends] - monotone)
            kept[ends] = np.where(np.abs(inner) < np.abs(kept[ends]), inner, kept[ends])
        slopes = kept
    return slopes


def _at_an_extremum(h: Array, y: Array, steps: Array) -> Array:
    """Return by how much smooth rows may rise above, or fall below, two of them that follow each other: (n - 1, c)."""
    if len(y) < 4:  # three rows don't tell a smooth extremum from a step
        return np.zeros_like(steps)
    bend = 2.0 * np.diff(steps, axis=0) / (h[1:] + h[:-1])  # second derivatives at the inner rows
    bend = np.concatenate([bend[[0, 0]], bend, bend[[-1, -1]]])
    bends = np.stack([bend[k : len(bend) - 3 + k] for k in range(4)])
    smooth = (
        np.abs(np.sum(np.sign(bends), axis=0)) == 4.0
    )  # a plateau of two rows is none: it bends back in front and behind
    parabola = np.where(smooth, h**2 * np.min(np.abs(bends), axis=0), 0.0)
    around = np.concatenate([y[:1], y, y[-1:]])
    four = np.stack([around[k : len(around) - 3 + k] for k in range(4)])
    allowed = EXTREMUM * np.minimum(parabola, np.ptp(four, axis=0))
    to_zero = np.where(y[1:] * y[:-1] > 0.0, np.minimum(np.abs(y[1:]), np.abs(y[:-1])), np.inf)
    return np.asarray(np.minimum(allowed, 0.9 * to_zero))


def _excursion(h: Array, y: Array, steps: Array, left: Array, right: Array) -> Array:
    """Return by how much the cubics with these slopes at their ends leave the range of their two rows: (n - 1, c)."""
    a, b = (
        3.0 * (left + right - 2.0 * steps),
        2.0 * (3.0 * steps - 2.0 * left - right),
    )  # slope = a t^2 + b t + left, t = s / h
    with np.errstate(all="ignore"):
        q = -0.5 * (b + np.where(b >= 0.0, 1.0, -1.0) * np.sqrt(b**2 - 4.0 * a * left))
        roots = np.stack([q / a, left / q])
    roots = np.where((roots > 0.0) & (roots < 1.0), roots, 0.0)
    values = y[:-1] + h * roots * (left + roots * (0.5 * b + roots * a / 3.0))
    low, high = np.minimum(y[:-1], y[1:]), np.maximum(y[:-1], y[1:])
    return np.asarray(np.max(np.maximum(values - high, low - values), axis=0))
