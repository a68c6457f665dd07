"""The shape of a cable: how a chain hangs between two supports under dead loads, where a path of heavy loads begins.

A rod whose weight is thousands of times what bends it is a chain but for short bends, and meets dozens of folds on its way
from the straight one. As a chain it has one equilibrium, which makes the convex function

    phi(n0) = integral of sqrt(|n|^2 + e^2) + a |n|^2 / 2 dx - n0.c,      n(x) = n0 - integral of f from 0 to x,

smallest in each span, with n0 the force at its start, c its chord over the rod's length, a = 1 / EA where the rod stretches, and
r' = n / sqrt(|n|^2 + e^2) + a n. The force e = (f^2 EI)^(1/3) lets the chain bend where it hangs in a narrow loop, as the rod
does, over a length of (EI / f)^(1/3). The path begins with the chain's directions, but without stretch: the loads stretch it
along them while its supports move to their places, so that on the way a taut cable hardly turns.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.rod_equations import DEAD_FORCE, FOLLOWER_FORCE, FORCE_GRADIENT, SINV
from darboux.packing.coefficients import HEAVY
from darboux.packing.laying import hangs_between_ends
from darboux.packing.problem import Packing
from darboux.problem import Equilibrium
from darboux.statics import first_shape
from darboux.statics.first_shape import FirstShape

Array = NDArray[np.float64]

ORIGIN = "the chain that hangs between its supports"
TAUT = 1.0 - 1e-6  # of the length: at a longer chord the chain is a straight line
PLACES = 129  # of a span
MOST_ITERATIONS = 200
BOW, MOST_TURNS, SETTLED = 0.2, 60, 1e-3  # of the length: the bow, the turns taken, and the change that is left
ON_AXIS = 1e-9  # of the length: a first support closer to the axis of such a load than this lies on it
SHORTEST_LINE = 2.0**-30
FOLDED = 1e-6  # of e: a force below it has no direction


def hung(problem: Equilibrium) -> FirstShape | None:
    """Return the shape of the chain that hangs between the rod's supports under its dead loads; None where it is no cable.

    Loads that are functions of the shape, such as a seabed's, come on the way.
    """
    if problem.closed or not hangs_between_ends(problem):
        return None
    packing = Packing(problem)
    places, supports = np.array([x for x, _ in packing.supports]), [support for _, support in packing.supports]
    chords = np.diff([support.place for support in supports], axis=0)
    if np.any(np.linalg.norm(chords, axis=1) > TAUT * np.diff(places)):
        return None
    x = np.linspace(places[:-1], places[1:], PLACES, axis=1)  # (spans, PLACES)
    first = np.array([support.place for support in supports[:-1]])
    points = [(at, station.load.force) for at, station in packing.stations if np.any(station.load.force)]
    spans = _spans(packing.columns(x.ravel()).reshape(*x.shape, -1), x, first, chords, _lumped(points, x))
    if spans is None:
        return None
    t, heavy = spans
    tangents = [span[min(i, 1) :] for i, span in enumerate(t)]  # one where two spans meet
    along = np.concatenate([span[min(i, 1) :] for i, span in enumerate(x)])
    shape = first_shape.untwisted(packing, along, np.concatenate(tangents), first[0])
    layer = 2.0 ** np.arange(np.floor(np.log2(heavy**-0.5)), -2.0)  # where the supports' directions die away
    layers = np.concatenate([place + sign * layer for place in places for sign in (1.0, -1.0)])
    return replace(shape, layers=tuple(np.unique(layers[(layers > 0.0) & (layers < 1.0)])))


def _lumped(points: list[tuple[float, Array]], x: Array) -> Array:
    """Return dead forces at points as loads per length (spans, PLACES, 3) on the nearest of the places x between the supports."""
    f = np.zeros((*x.shape, 3))
    for at, force in points:
        span = min(int(np.searchsorted(x[:, -1], at)), len(x) - 1)
        place = int(np.clip(np.argmin(np.abs(x[span] - at)), 1, PLACES - 2))
        f[span, place] += force / (x[span, 1] - x[span, 0])
    return f


def _spans(c: Array, x: Array, first: Array, chords: Array, lumped: Array) -> tuple[Array, float] | None:
    """Return the tangents (spans, PLACES, 3) and the mean load per length; None where it is light, or draws the rod back.

    A load that grows with r, as that of a skipping rope, is that of the chain which it makes, found by turns from a bow.
    """
    a, C = c[..., DEAD_FORCE:FORCE_GRADIENT], c[..., FORCE_GRADIENT:FOLLOWER_FORCE].reshape(*x.shape, 3, 3)
    soft = c[..., SINV + 2]
    part = (x - x[:, :1]) / np.ptp(x, axis=1)[:, None]
    r = first[:, None] + part[:, :, None] * chords[:, None]
    values, axes = np.linalg.eigh(np.mean(C, axis=(0, 1)))
    if np.any(values < 0.0):
        return None
    if values[-1] > 0.0:
        most = axes[:, values > 0.99 * values[-1]]
        along = most @ most.T @ np.mean(a, axis=(0, 1))  # to the side to which the dead loads pull
        size = float(np.linalg.norm(along))
        side = along / size if size > ON_AXIS * values[-1] else axes[:, -1]
        r = r + BOW * np.sin(np.pi * part)[:, :, None] * side
    for _ in range(MOST_TURNS):
        f = a + np.einsum("spij,spj->spi", C, r) + lumped
        heavy = float(np.mean(np.linalg.norm(f, axis=2)))
        if heavy < HEAVY:
            return None
        spans = [_tangents(*span, heavy ** (2.0 / 3.0)) for span in zip(x, f, chords, soft, strict=True)]
        if any(span is None for span in spans):
            return None
        t = np.array(spans)
        h = (x[:, 1:] - x[:, :-1])[:, :, None]
        steps = np.cumsum(0.5 * h * (t[:, 1:] + t[:, :-1]), axis=1)
        before, r = r, first[:, None] + np.concatenate([np.zeros_like(steps[:, :1]), steps], axis=1)
        if values[-1] == 0.0 or np.max(np.abs(r - before)) < SETTLED:
            break
    return t, heavy


def _opened(n: Array, f: Array, chord: Array, e: float) -> Array:
    """Return the forces n (m, 3), but to a side where there is none, at the fold of a chain that turns back on itself."""
    folded = np.linalg.norm(n, axis=1) < FOLDED * e
    if not np.any(folded):
        return n
    down = np.mean(f, axis=0)
    across = [a - (a @ down) / (down @ down) * down for a in (chord, *np.eye(3))]
    side = next(a for a in across if np.linalg.norm(a) > ON_AXIS)
    return np.where(folded[:, None], e * side / np.linalg.norm(side), n)


def _tangents(x: Array, f: Array, chord: Array, a: Array, e: float) -> Array | None:
    """Return the unit tangents (n, 3) at x (n,) of a span under f (n, 3), by Newton's method on the convex phi."""
    h = x[1] - x[0]
    weights = np.full(len(x), h)
    weights[[0, -1]] *= 0.5
    applied = np.concatenate([np.zeros((1, 3)), np.cumsum(0.5 * h * (f[1:] + f[:-1]), axis=0)])

    def phi(n0: Array) -> tuple[float, Array, Array]:
        """Return phi at n0, its slope (3,) and its second derivative (3, 3)."""
        n = n0 - applied
        square = np.sum(n**2, axis=1)
        size = np.sqrt(square + e**2)
        t, share = n / size[:, None], weights / size
        bend = (np.sum(share) + weights @ a) * np.eye(3) - np.einsum("n,ni,nj->ij", share, t, t)
        return float(weights @ (size + 0.5 * a * square) - n0 @ chord), weights @ (t + a[:, None] * n) - chord, bend

    n0 = 0.5 * applied[-1] + chord / (x[-1] - x[0]) * np.linalg.norm(applied[-1])
    value, slope, bend = phi(n0)
    for _ in range(MOST_ITERATIONS):
        if np.max(np.abs(slope)) < 1e-10:
            n = _opened(n0 - applied, f, chord, e)
            return np.asarray(n / np.linalg.norm(n, axis=1)[:, None])
        step = np.linalg.solve(bend, -slope)
        part, descent = 1.0, float(slope @ step)
        while part > SHORTEST_LINE:
            trial = phi(n0 + part * step)
            if trial[0] <= value + 1e-4 * part * descent + 1e-14 * abs(value):
                break
            part *= 0.5
        n0 = n0 + part * step
        value, slope, bend = trial
    return None
