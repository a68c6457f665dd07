"""The state of a rod along s, r q n m, known at nodes and interpolated between them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.checks import ONE_PLACE

Array = NDArray[np.float64]
Side = Literal["before", "behind"]

MOST_NODES = 4  # of an interpolant: order 8
AT_ONCE = 2048  # places, for each takes 5 KB while it is interpolated
GAUSS = 5  # points on an interval: of order 10, so that the interpolation between nodes sets the error, not the sum


@dataclass(frozen=True, eq=False)
class Curve:
    """States at nodes: ``s`` (n,) ascending in m; ``y`` (n, 13) and ``dy`` = dy/ds (n, 13).

    The 13 states are r (m), q (unit quaternion, scalar first), n (N) and m (N m), vectors in the fixed frame. Where
    dy jumps (a load or a section with a step) the node stands twice, with the state and the derivative of either side: a jump.
    A place next to a jump but for rounding is at it.
    """

    s: Array
    y: Array
    dy: Array

    def __call__(self, s: Array, part: slice = slice(None), *, side: Side = "behind") -> Array:
        """Return the states at s (m,), or a part of them: (m, 13), by the polynomial that fits y and dy at the four nodes around s.

        At a jump they are those of the given side. Between jumps that enclose fewer nodes those are all that is fitted: then it
        is a quintic or a cubic.
        """
        nearest, there = self._at_jumps(s)
        s = np.where(there, nearest, s)
        i = np.searchsorted(self.s, s, side="left" if side == "before" else "right") - 1
        i = np.clip(i, 0, len(self.s) - 2)
        i = self._wide[np.clip(np.searchsorted(self._wide, i), 0, len(self._wide) - 1)]  # off the intervals of no width
        lowest, highest = self._smooth
        lowest, highest = lowest[i], highest[i]
        count = np.minimum(highest - lowest + 1, MOST_NODES)
        first = np.clip(i - 1, lowest, highest - count + 1)
        y, dy = self.y[:, part], self.dy[:, part]
        result = np.empty((len(s), y.shape[1]))
        for n in np.unique(count):
            places = np.flatnonzero(count == n)
            for j in range(0, len(places), AT_ONCE):
                here = places[j : j + AT_ONCE]
                at = first[here, None] + np.arange(n)
                result[here] = _hermite(s[here], self.s[at], y[at], dy[at])
        return result

    def beside(self, s: Array, side: Side) -> Array:
        """Return s (m,) moved off the jumps to one side, where the rod's own data are those of that side."""
        nearest, there = self._at_jumps(s)
        step = ONE_PLACE * self.s[-1]
        return np.where(there, nearest - step if side == "before" else nearest + step, s)

    def _at_jumps(self, s: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return the nearest jump to each s (m,), and whether s is there but for rounding."""
        jumps = self.s[:-1][np.diff(self.s) == 0.0]
        if len(jumps) == 0:
            return s, np.zeros(len(s), dtype=bool)
        i = np.clip(np.searchsorted(jumps, s), 1, max(len(jumps) - 1, 1))
        low, high = jumps[i - 1], jumps[np.minimum(i, len(jumps) - 1)]
        nearest = np.where(s - low <= high - s, low, high)
        return nearest, np.abs(s - nearest) <= ONE_PLACE * self.s[-1]

    @cached_property
    def _wide(self) -> NDArray[np.intp]:
        """The intervals that have a width; the others mark a jump."""
        return np.flatnonzero(np.diff(self.s) > 0.0)

    @cached_property
    def _smooth(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The first and the last node between the jumps around each interval."""
        jumps = np.flatnonzero(np.diff(self.s) == 0.0)
        piece = np.searchsorted(jumps, np.arange(len(self.s) - 1))
        return np.append(0, jumps + 1)[piece], np.append(jumps, len(self.s) - 1)[piece]

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Curve):
            return NotImplemented
        return all(np.array_equal(getattr(self, name), getattr(other, name)) for name in ("s", "y", "dy"))

    def __hash__(self) -> int:
        return hash((len(self.s), self.s[-1]))

    def frames(self, s: Array) -> Array:
        """Return R (m, 3, 3) at s (m,)."""
        return frames.matrix_of_quaternion(self(s)[:, 3:7])


def _hermite(s: Array, x: Array, y: Array, dy: Array) -> Array:
    """Return Newton's form of Hermite's interpolant at s (m,): nodes x (m, k), values y and slopes dy (m, k, 13)."""
    z = np.repeat(x, 2, axis=1)
    column = np.repeat(y, 2, axis=1)
    n = z.shape[1]
    leading = [column[:, 0]]
    column = np.diff(column, axis=1)
    column[:, ::2] = dy
    column[:, 1::2] /= np.diff(x, axis=1)[:, :, None]
    leading.append(column[:, 0])
    for k in range(2, n):
        column = np.diff(column, axis=1) / (z[:, k:] - z[:, :-k])[:, :, None]
        leading.append(column[:, 0])
    result = leading[-1]
    for k in range(n - 2, -1, -1):
        result = leading[k] + (s - z[:, k])[:, None] * result
    return result


def gauss_points(nodes: Array, count: int = GAUSS) -> tuple[Array, Array]:
    """Return points and weights of Gauss' rule of ``count`` points on each interval between nodes (n,): (count (n - 1),) each."""
    at, weights = _rule(count)
    half = np.diff(nodes)[:, None] / 2.0
    points = (nodes[:-1] + nodes[1:])[:, None] / 2.0 + half * at
    return points.ravel(), (half * weights).ravel()


@lru_cache(maxsize=8)
def _rule(count: int) -> tuple[Array, Array]:
    return np.polynomial.legendre.leggauss(count)
