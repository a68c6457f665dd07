"""Writhe of a curve in space by Gauss' double integral.

Sources: F. B. Fuller, Proc. Natl. Acad. Sci. USA 68 (1971) 815; M. Levitt, J. Mol. Biol. 170 (1983) 723; K. Klenin and
J. Langowski, Biopolymers 54 (2000) 307; A. van Oosterom and J. Strackee, IEEE Trans. Biomed. Eng. 30 (1983) 125.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PAIRS = 2**16  # of edges that are held at once
FEWEST, MOST = 64, 2048  # edges of the first and of the last polygon
GOAL = 1e-8  # change in turns from one extrapolation to the next


def writhe(r: Callable[[Array], Array], nodes: Array, closed: bool) -> float:
    """Return the writhe in turns of the curve r(s), smooth between nodes (n,), from polygons with ever more vertices on it.

        Wr = 1 / (4 pi) int int (t x t') . (r - r') / |r - r'|^3 ds ds'

    A polygon's is exact; its error to the curve has terms in 1/N^2, 1/N^3 (from ends and uneven edges), 1/N^4, ..., which
    Richardson's extrapolation takes off.
    """
    length = nodes[-1] - nodes[0]
    apart = np.unique(np.round((nodes - nodes[0]) / length, 6))  # rounding would turn an edge between closer nodes
    nodes = nodes[0] + length * apart
    if len(nodes) > MOST // 8:
        nodes = np.linspace(nodes[0], nodes[-1], MOST // 8 + 1)
    pieces = -(-FEWEST // (len(nodes) - 1))
    row: list[float] = []
    while True:
        s = np.interp(np.arange(pieces * (len(nodes) - 1) + 1) / pieces, np.arange(len(nodes)), nodes)
        x = r(s)
        if closed:
            x[-1] = x[0]
        new = [writhe_of_polygon(x)]
        for k, coarser in enumerate(row):
            new.append(new[k] + (new[k] - coarser) / (2.0 ** (k + 2) - 1.0))
        if (row and abs(new[-1] - row[-1]) < GOAL) or 2 * len(s) > MOST + 2:
            return new[-1]
        row, pieces = new, 2 * pieces


def writhe_of_polygon(x: Array) -> float:
    """Return the writhe in turns of the polygon with the vertices x (n, 3), closed where its last is its first.

    A pair of edges adds the solid angle of the parallelogram of all differences of their points, seen from the origin:
    two triangles of corners a, b, c, each with

        tan(Omega / 2) = a.(b x c) / (|a||b||c| + a.b |c| + b.c |a| + c.a |b|)
    """
    edges = np.diff(x, axis=0)
    N = len(edges)
    total = 0.0
    first = 0
    while first < N - 1:
        last = min(first + max(1, PAIRS // (N - first)), N - 1)
        differences = np.moveaxis(x[None, first:] - x[first : last + 1, None], -1, 0)
        a, b, c, d = (
            differences[:, i : i + last - first, j : j + N - first] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))
        )
        across = np.moveaxis(np.cross(edges[first:last, None], edges[None, first:]), -1, 0)
        triple = -_dot(a, across)  # the same for both triangles
        size = np.sqrt(_dot(differences, differences))
        A, B, C, D = (size[i : i + last - first, j : j + N - first] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)))
        ac = _dot(a, c)
        one = np.arctan2(triple, A * B * C + _dot(a, b) * C + _dot(b, c) * A + ac * B)
        two = np.arctan2(triple, A * C * D + ac * D + _dot(c, d) * A + _dot(a, d) * C)
        half_angles = np.triu(one + two, 2)  # neighbours lie in a plane
        if first == 0 and np.array_equal(x[0], x[-1]):
            half_angles[0, -1] = 0.0  # the last edge and the first are neighbours too
        total += float(np.sum(half_angles))
        first = last
    return total / np.pi


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("kij,kij->ij", a, b))
