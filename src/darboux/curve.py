"""The state of a rod along s, r q n m, known at nodes and interpolated between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from darboux import frames

Array = NDArray[np.float64]

GAUSS = 5  # points on an interval: of order 10, so that the interpolation between nodes sets the error, not the sum


@dataclass(frozen=True, eq=False)
class Curve:
    """States at nodes: ``s`` (n,) ascending in m; ``y`` (n, 13) and ``dy`` = dy/ds (n, 13).

    The 13 states are r (m), q (unit quaternion, scalar first), n (N) and m (N m), vectors in the fixed frame. Where
    dy jumps (a load or a section with a step) the node stands twice, with the derivative of either side.
    """

    s: Array
    y: Array
    dy: Array

    def __call__(self, s: Array) -> Array:
        """Return the states at s (m,): (m, 13), by the quintic that fits y and dy at three neighbouring nodes."""
        i = np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, len(self.s) - 2)
        i = self._real_interval(i)
        third = self._third_node(i)
        return _hermite(
            s,
            [self.s[j] for j in (i, i + 1, third)],
            [self.y[j] for j in (i, i + 1, third)],
            [self.dy[j] for j in (i, i + 1, third)],
            self._has_third(i),
        )

    def _widths(self) -> Array:
        return np.diff(self.s)

    def _real_interval(self, i: NDArray[np.intp]) -> NDArray[np.intp]:
        """Step off the intervals of no width that mark a jump."""
        real = np.flatnonzero(self._widths() > 0.0)
        return real[np.clip(np.searchsorted(real, i), 0, len(real) - 1)]

    def _sides(self, i: NDArray[np.intp]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        width = self._widths()
        last = len(width) - 1
        right = (i < last) & (width[np.minimum(i + 1, last)] > 0.0)
        left = (i > 0) & (width[np.maximum(i - 1, 0)] > 0.0)
        return left, right

    def _third_node(self, i: NDArray[np.intp]) -> NDArray[np.intp]:
        _, right = self._sides(i)
        return np.where(right, np.minimum(i + 2, len(self.s) - 1), np.maximum(i - 1, 0))

    def _has_third(self, i: NDArray[np.intp]) -> NDArray[np.bool_]:
        left, right = self._sides(i)
        return left | right

    def frames(self, s: Array) -> Array:
        """Return R (m, 3, 3) at s (m,)."""
        return frames.matrix_of_quaternion(self(s)[:, 3:7])


def _hermite(
    s: Array, nodes: list[Array], values: list[Array], slopes: list[Array], cubic_to_quintic: NDArray[np.bool_]
) -> Array:
    """Return the Newton form of the Hermite interpolant on x0, x0, x1, x1 (a cubic), x2, x2 (a quintic where told)."""
    x0, x1, x2 = (x[:, None] for x in nodes)
    x2 = np.where(cubic_to_quintic[:, None], x2, x1 + (x1 - x0))  # any point off the nodes: its terms are dropped
    f0, f1, f2 = values
    g0, g1, g2 = slopes
    s = s[:, None]
    f01 = (f1 - f0) / (x1 - x0)
    f12 = (f2 - f1) / (x2 - x1)
    a, b, c, d = g0, f01, g1, f12  # first differences, then the higher ones in place
    e = g2
    a2, b2, c2, d2 = (b - a) / (x1 - x0), (c - b) / (x1 - x0), (d - c) / (x2 - x1), (e - d) / (x2 - x1)
    a3, b3, c3 = (b2 - a2) / (x1 - x0), (c2 - b2) / (x2 - x0), (d2 - c2) / (x2 - x1)
    a4, b4 = (b3 - a3) / (x2 - x0), (c3 - b3) / (x2 - x0)
    a5 = (b4 - a4) / (x2 - x0)
    t0, t1, t2 = s - x0, s - x1, s - x2
    quintic = np.where(cubic_to_quintic[:, None], t1 * (a4 + t2 * a5), 0.0)
    return np.asarray(f0 + t0 * (a + t0 * (a2 + t1 * (a3 + quintic))))


def gauss_points(nodes: Array) -> tuple[Array, Array]:
    """Return points and weights of Gauss' rule of five points on each interval between nodes (n,): (5 (n - 1),) each."""
    x, w = np.polynomial.legendre.leggauss(GAUSS)
    half = np.diff(nodes)[:, None] / 2.0
    points = (nodes[:-1] + nodes[1:])[:, None] / 2.0 + half * x
    return points.ravel(), (half * w).ravel()
