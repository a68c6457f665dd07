"""How a ring is closed: the angle of its glue, the cell there, a polygon that closes, the twist that its link leaves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.link import writhe_of_polygon

Array = NDArray[np.float64]

MOST_TURNS, CLOSED = 20, 1e-15  # iterations and gap over the length, to which a polygon is closed


def angle(link: float) -> Array:
    """Return cosine and sine (2,) of the angle by which a ring's end is turned against its start."""
    phi = frames.turn * (link - np.rint(link))
    return np.array([np.cos(phi), np.sin(phi)])


def joined(link: float, V: Array, compliance: Array, k0: Array) -> tuple[Array, Array, Array]:
    """Return lengths (n + 1,), compliance and natural strain of the cells of a ring's chain, of which the ends are halves (n).

    The half behind the end is the one behind the start, seen in the frame in which the rod runs on: turned by the link.
    """
    c, s = angle(link)
    Q = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    whole = V[0] + V[-1]
    C = (V[-1] * compliance[-1] + V[0] * Q.T @ compliance[0] @ Q) / whole
    k = (V[-1] * k0[-1] + V[0] * k0[0] @ Q) / whole
    parts = (V, whole), (compliance, C), (k0, k)
    lengths, C, k = (np.concatenate([[own], part[1:-1], [own], part[1:2]]) for part, own in parts)
    return lengths, C, k


def closed(e: Array) -> Array:
    """Return edges (n, 3) of the same lengths, each turned a little towards one and the same vector, so that they close."""
    w = np.linalg.norm(e, axis=1)[:, None]
    t = e / w
    for _ in range(MOST_TURNS):
        gap = np.sum(w * t, axis=0)
        t = t - np.linalg.solve(np.sum(w) * np.eye(3) - t.T @ (w * t), gap)
        t /= np.linalg.norm(t, axis=1)[:, None]
        if np.max(np.abs(gap)) < CLOSED:
            break
    return np.asarray(w * t)


def evenly_twisted(link: float, r: Array, t: Array, d1: Array, nodes: Array, V: Array) -> tuple[Array, Array]:
    """Return the first directors (N, 3) of a ring r (N + 1, 3) that is twisted evenly, and its twists over the lengths V.

    d1 (N + 1, 3) is carried around without twist, back to the first edge, along the tangents t (N, 3). By the angle at
    which it then is, and by the writhe, which says how many whole turns that leaves out, the twist is 2 pi (link - writhe).
    """
    holonomy = float(np.arctan2(np.cross(d1[0], d1[-1]) @ t[0], d1[0] @ d1[-1])) / frames.turn
    twist = frames.turn * (link - holonomy - np.rint(writhe_of_polygon(r) - holonomy))
    turned = twist * 0.5 * (nodes[:-1] + nodes[1:])[:, None]
    return np.cos(turned) * d1[:-1] + np.sin(turned) * np.cross(t, d1[:-1]), twist * V
