"""Where the unloaded rod lies: which support places it, and how it is turned."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.kernels import framed_curve as kernel
from darboux.natural import smallest_rotation
from darboux.problem import Equilibrium
from darboux.supports import Support

Array = NDArray[np.float64]

STEPS = 1000  # over which a shape is laid out


def hangs_between_ends(problem: Equilibrium) -> bool:
    """Return whether both ends, and the places between them that are held at all, are held in place: as those of a cable."""
    places = [support for _, support in problem.supports if support.holds]
    return all(all(at.held_displacement) for at in (problem.start, *places, problem.end))


def laid(problem: Equilibrium) -> tuple[Support, float, Array]:
    """Return the support that places the unloaded rod, its s / L, and how the rod lies: a frame there, or its chord's direction."""
    supports = [(s / problem.rod.length, support) for s, support in problem.supports]
    places = [(x, support) for x, support in supports if any(support.held_displacement)]
    oriented = [(x, at) for x, at in supports if any(at.held_rotation) or at.rotational is not None]
    place, held = (places or supports)[0]
    if any(support is held for _, support in oriented):
        return held, place, held.R
    for x, support in oriented:
        return (support, x, support.R) if any(support.held_displacement) else (held, place, support.R)
    pinned = [(x, support) for x, support in places if all(support.held_displacement)]
    if len(pinned) > 1:
        between = np.array(pinned[-1][1].position) - np.array(pinned[0][1].position)
        distance = float(np.linalg.norm(between))
        if distance > 0.0:
            return held, place, np.sign(pinned[-1][0] - pinned[0][0]) * between / distance
    for _, support in reversed(places):
        if not all(support.held_displacement) and support.sliding == "fixed":
            return held, place, support.displacement_axes[:, 0]
    return held, place, np.array([0.0, 0.0, 1.0])


def placed(problem: Equilibrium, s: Array) -> tuple[Array, Array]:
    """Return the centreline (n, 3) in m and the directors (n, 3, 3) at s (n,) of the unloaded rod, laid at its support."""
    L = problem.rod.length
    support, place, lie = laid(problem)
    steep = np.array([*problem.rod.breaks, *problem.steep_places]) / L  # no step goes over a narrow bend
    r, q = shape_of(lambda x: problem.rod.k0(x * L) * L, np.concatenate([[0.0, 1.0], steep, s / L, [place]]))
    r, q = np.delete(r, slice(2, 2 + len(steep)), 0), np.delete(q, slice(2, 2 + len(steep)), 0)
    R, chord = frames.matrix_of_quaternion(q), r[1] - r[0]
    length = float(np.linalg.norm(chord))
    straight = chord / length if length > 0.0 else np.array([0.0, 0.0, 1.0])  # of a rod that is closed by nature
    turn = lie @ R[-1].T if lie.ndim == 2 else smallest_rotation(straight, lie)
    return np.array(support.position) + L * (r[2:-1] - r[-1]) @ turn.T, turn @ R[2:-1]


def shape_of(k: Callable[[Array], Array], x: Array) -> tuple[Array, Array]:
    """Return places (n, 3) and quaternions (n, 4) at x (n,) of a curve that leaves the origin with d_i = e_i.

    The frame turns by the mean of k over short steps; the places follow by Simpson's rule. Only a first guess.
    """
    steps = np.unique(np.concatenate([x, np.linspace(0.0, 1.0, STEPS + 1)]))
    fine = np.empty(2 * len(steps) - 1)
    fine[::2], fine[1::2] = steps, 0.5 * (steps[1:] + steps[:-1])
    r, q = np.empty((len(steps), 3)), np.empty((len(steps), 4))
    kernel.lay_out(np.diff(fine), k(0.5 * (fine[1:] + fine[:-1])).ravel(), r.ravel(), q.ravel())
    at = np.searchsorted(steps, x)
    return r[at], q[at]
