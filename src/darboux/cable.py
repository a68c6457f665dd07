"""A rod that hangs between its ends: sag, tension and angles, as for a cable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from darboux.curve import Curve
from darboux.problem import Equilibrium

Array = NDArray[np.float64]

LIGHT = 1e-9  # of a rod's loads along it that hold each other: then nothing hangs
SAMPLES = 401


@dataclass(frozen=True)
class Cable:
    """What is asked of a hanging rod whose ends are held.

    ``span`` in m between the ends, straight; ``sag`` in m, the largest distance of the rod below that straight line, along the sum
    of the loads; ``tension`` in N, the largest, and ``at`` its s in m; ``angles`` in degrees by which the rod leaves its start and
    its end below the horizontal; ``length`` in m of the loaded rod.
    """

    span: float
    sag: float
    tension: float
    at: float
    angles: tuple[float, float]
    length: float


def cable(problem: Equilibrium, curve: Curve, v: Array, points: Array, weights: Array) -> Cable | None:
    """Return what a hanging rod is asked for; None unless both ends are held and loads along it pull to one side.

    ``v`` (n, 3) are stretch and shear at the ``points`` (n,) in m, with their ``weights``.
    """
    ends = problem.start, problem.end
    loads = problem.distributed(points).a
    pull, all_pulls = weights @ loads, float(weights @ np.linalg.norm(loads, axis=1))
    hangs = float(np.linalg.norm(pull)) > LIGHT * all_pulls
    if not hangs or problem.closed or not all(all(end.held_displacement) for end in ends):
        return None
    down = pull / np.linalg.norm(pull)
    s = np.union1d(np.linspace(0.0, problem.rod.length, SAMPLES), curve.s)
    y, tangents = curve(s), curve.frames(s)[:, :, 2]
    r = y[:, 0:3] - y[0, 0:3]
    chord = r[-1]
    across = chord - (chord @ down) * down
    share = r @ across / (across @ across) if across @ across > 1e-12 * problem.rod.length**2 else np.zeros(len(s))
    below = (r - share[:, None] * chord) @ down - (max(0.0, float(chord @ down)) if not np.any(share) else 0.0)
    tension = np.einsum("ni,ni->n", y[:, 7:10], tangents)
    place = int(np.argmax(tension))
    start, end = (float(np.degrees(np.arcsin(np.clip(t @ down, -1.0, 1.0)))) for t in (tangents[0], -tangents[-1]))
    length = float(weights @ np.linalg.norm(v, axis=1))
    return Cable(
        float(np.linalg.norm(chord)), float(np.max(below)), float(tension[place]), float(s[place]), (start, end), length
    )
