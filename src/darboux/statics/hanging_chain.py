"""The shape of a cable: how a chain hangs between two supports under dead loads, where a path of heavy loads begins.

A rod whose weight is thousands of times what bends it is a chain but for short bends, and meets dozens of folds on its way
from the straight one. As a chain it has one equilibrium, which makes the convex function

    phi(n0) = integral of sqrt(|n|^2 + e^2) dx - n0.c,      n(x) = n0 - integral of f from 0 to x,

smallest, with n0 the force at the start, c the chord over the length and r' = n / sqrt(|n|^2 + e^2). The force e = (f^2 EI)^(1/3)
lets the chain bend where it hangs in a narrow loop, as the rod does, over a length of (EI / f)^(1/3).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from darboux.problem import Equilibrium, Ring
from darboux.statics import first_shape
from darboux.statics.coefficients import HEAVY, Scale
from darboux.statics.first_shape import FirstShape

Array = NDArray[np.float64]

ORIGIN = "the chain that hangs between its supports"
TAUT = 1.0 - 1e-6  # of the length: at a longer chord the chain is a straight line
PLACES = 513
MOST_ITERATIONS = 200
SHORTEST_LINE = 2.0**-30


def hung(problem: Equilibrium) -> FirstShape | None:
    """Return the shape of the chain that hangs between the rod's ends under its dead loads; None where it is no cable."""
    scale = Scale.of(problem)
    x = np.linspace(0.0, 1.0, PLACES)
    start, end = problem.start, problem.end
    held = all(start.held_displacement) and all(end.held_displacement)
    if not held or problem.between or problem.of_shape or isinstance(problem, Ring):
        return None
    loads = problem.distributed(x * scale.length)
    f = loads.a * (scale.length / scale.force)
    heavy = float(np.mean(np.linalg.norm(f, axis=1)))
    chord = (np.array(end.position) - np.array(start.position)) / scale.length
    if heavy < HEAVY or np.any(loads.C) or np.linalg.norm(chord) > TAUT:
        return None
    r = _chain(x, f, chord, heavy ** (2.0 / 3.0))
    if r is None:
        return None
    shape = first_shape.given(problem, scale, np.array(start.position) + scale.length * r)
    layers = 2.0 ** np.arange(np.floor(np.log2(heavy**-0.5)), -2.0)  # where the ends' directions die away
    return replace(shape, layers=(*layers, *(1.0 - layers[::-1])))


def _chain(x: Array, f: Array, chord: Array, e: float) -> Array | None:
    """Return the places (n, 3) at x (n,) of the chain under f (n, 3), by Newton's method on the convex phi; all over the length."""
    h = x[1] - x[0]
    weights = np.full(len(x), h)
    weights[[0, -1]] *= 0.5
    applied = np.concatenate([np.zeros((1, 3)), np.cumsum(0.5 * h * (f[1:] + f[:-1]), axis=0)])

    def tangents(n0: Array) -> tuple[Array, Array]:
        n = n0 - applied
        size = np.sqrt(np.sum(n**2, axis=1) + e**2)
        return n / size[:, None], size

    n0 = 0.5 * applied[-1] + chord * np.linalg.norm(applied[-1])
    t, size = tangents(n0)
    value = weights @ size - n0 @ chord
    for _ in range(MOST_ITERATIONS):
        slope = weights @ t - chord
        if np.max(np.abs(slope)) < 1e-10:
            return np.concatenate([np.zeros((1, 3)), np.cumsum(0.5 * h * (t[1:] + t[:-1]), axis=0)])
        share = weights / size
        step = np.linalg.solve(np.sum(share) * np.eye(3) - np.einsum("n,ni,nj->ij", share, t, t), -slope)
        scale = 1.0
        while scale > SHORTEST_LINE:
            t, size = tangents(n0 + scale * step)
            trial = weights @ size - (n0 + scale * step) @ chord
            if trial <= value + 1e-4 * scale * (slope @ step) + 1e-14 * abs(value):
                break
            scale *= 0.5
        n0, value = n0 + scale * step, trial
    return None
