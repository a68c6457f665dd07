"""What acts on a rod, in numbers: along it, at its ends and points, and what is a function of its shape."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.collocation import SHAPED, SHAPED_COUPLE
from darboux.kernels.rod_equations import DEAD_FORCE, WIDTH
from darboux.loads import Distributed, EndLoad, Load
from darboux.packing.scale import Scale
from darboux.problem import Equilibrium

Array = NDArray[np.float64]

LOADS = slice(DEAD_FORCE, WIDTH)  # the columns of loads, which grow with the load factor
# ... and among these
DEAD, GRADIENT, FOLLOWER, COUPLE, SECTION_COUPLE = (slice(*x) for x in ((0, 3), (3, 12), (12, 15), (15, 18), (18, 21)))


def per_length(loads: Distributed, scale: Scale) -> Array:
    """Return loads per length as the columns ``LOADS`` (n, 21) of the rod equations: a, C, b, la, lb."""
    L, force, moment = scale.length, scale.force, scale.moment
    a = (loads.a + np.einsum("nij,j->ni", loads.C, scale.origin)) * (L / force)
    C, couples = loads.C.reshape(-1, 9) * (L**2 / force), (loads.la * (L / moment), loads.lb * (L / moment))
    return np.concatenate([a, C, loads.b * (L / force), *couples], axis=1)  # as the columns stand


def at_place(load: EndLoad, scale: Scale) -> EndLoad:
    """Return what acts on an end or at a point, over EI / L^2 and EI / L."""
    force, moment = scale.force, scale.moment
    forces, moments = (
        (load.force / force, load.section_force / force),
        (load.moment / moment, load.section_moment / moment),
    )
    return EndLoad(forces[0], moments[0], forces[1], moments[1], load.eccentric / moment)


class Group:
    """Some of a problem's loads, such as those of a motion that share a factor of time."""

    def __init__(self, problem: Equilibrium, scale: Scale, loads: Sequence[Load]) -> None:
        self._problem, self._scale, self._loads = problem, scale, loads

    def columns(self, x: Array) -> Array:
        """Return them per length at x (n,), as the columns ``LOADS`` (n, 21)."""
        total = Distributed.zero(len(x))
        for load in self._loads:
            load.add_distributed(total, x * self._scale.length, self._problem.rod)
        return per_length(total, self._scale)

    def at_end(self, name: str) -> EndLoad:
        """Return what they do on an end, "start" or "end"."""
        total = EndLoad()
        for load in self._loads:
            load.add_end(name, total)
        return at_place(total, self._scale)

    def at_points(self) -> list[EndLoad]:
        """Return what they do at each of the problem's points."""
        totals = {s: EndLoad() for s in self._problem.points}
        for load in self._loads:
            s = self._problem.point_of(load)
            if s is not None:
                load.add_point(totals[s])
        return [at_place(total, self._scale) for total in totals.values()]

    def rest(self, x: Array) -> Array:
        """Return where the potential of the only one is zero: (n, 3) at x (n,)."""
        (load,) = self._loads
        return np.asarray((load.datum(x * self._scale.length) - self._scale.origin) / self._scale.length)


def of_shape(problem: Equilibrium, scale: Scale, x: Array, r: Array, R: Array, slopes: bool = True) -> Array:
    """Return the loads that are functions of the shape at x (n,), r (n, 3), R (n, 3, 3), with their derivatives: (n, SHAPED).

    Where ``slopes`` is False the derivatives are left out, and zero.
    """
    s, places = x * scale.length, r * scale.length + scale.origin
    result = np.zeros((len(s), SHAPED))
    for load in problem.of_shape:
        at, unit = (SHAPED_COUPLE, scale.force) if load.is_couple else (0, scale.force / scale.length)
        result[:, at : at + 3] += load.at_shape(s, places, R) / unit
        if slopes:
            by_r, by_turn = load.gradients(s, places, R, scale.length)
            result[:, at + 3 : at + 12] += by_r.reshape(-1, 9) * (scale.length / unit)
            result[:, at + 12 : at + 21] += by_turn.reshape(-1, 9) / unit
    return result


def has_potential(problem: Equilibrium) -> bool:
    """Return whether all loads have a potential: couples, moments, followers and functions of the shape have none in 3-D."""
    s = np.linspace(0.0, problem.rod.length, 1 if problem.uniform else 33)
    loads = problem.distributed(s)
    ends = [problem.end_load("start"), problem.end_load("end"), *problem.points.values()]
    without = [part for end in ends for part in (end.moment, end.section_force, end.section_moment)]
    return not problem.of_shape and not any(np.any(part) for part in (loads.b, loads.la, loads.lb, *without))
