"""The balance of forces and moments of a found shape, integrated independently of the method that found it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.curve import GAUSS, Curve, gauss_points
from darboux.problem import Equilibrium

Array = NDArray[np.float64]

ROUNDING = 1e-12  # of EI / L^2: a rod with less in it carries nothing


@dataclass(frozen=True)
class Balance:
    """What is missing in the balance of forces and moments, in units of F and F L, F the largest of |n| and |m| / L.

        force = max_s |n(s) - n(0) + int_0^s f|,
        moment = max_s |m(s) - m(0) + (r(s) - r(0)) x n(s) + int_0^s [l + (r - r(0)) x f]|,  loads at points included

    Of a rod that carries nothing, F = EI / L^2.
    """

    force: float
    moment: float


def balance(problem: Equilibrium, curve: Curve, load_factor: float, nodes: Array) -> Balance:
    """Return what is missing at the nodes of the curve, by Gauss' rule between ``nodes`` (n,), which hold those of the curve."""
    points, weights = gauss_points(nodes)
    y = curve(points)
    origin = curve.y[0, 0:3]
    f, l = loads_along(problem, points, y)
    parts = weights[:, None] * np.concatenate([f, l + np.cross(y[:, 0:3] - origin, f)], axis=1)
    sums = np.concatenate([np.zeros((1, 6)), np.cumsum(parts.reshape(-1, GAUSS, 6).sum(axis=1), axis=0)])
    load = load_factor * sums[np.searchsorted(nodes, curve.s)] + _stations_up_to(problem, curve, load_factor, origin)

    r, n, m = curve.y[:, 0:3] - origin, curve.y[:, 7:10], curve.y[:, 10:13]
    missing = np.concatenate([n, m + np.cross(r, n)], axis=1) + load
    missing = missing - missing[0]
    L = problem.rod.length
    unit, stiffness = max(_longest(n), _longest(m) / L), float(problem.rod.stiffness(np.zeros(1)).EI1[0]) / L**2
    if unit < ROUNDING * stiffness:
        unit = stiffness
    return Balance(_longest(missing[:, :3]) / unit, _longest(missing[:, 3:]) / (unit * L))


def loads_along(problem: Equilibrium, s: Array, y: Array) -> tuple[Array, Array]:
    """Return force f (n, 3) in N/m and couple l (n, 3) in N per length at s (n,), for the states y (n, 13)."""
    r, R = y[:, 0:3], frames.matrix_of_quaternion(y[:, 3:7])
    loads = problem.distributed(s)
    f, l = loads.force(r, R), loads.couple(R)
    for load in problem.of_shape:
        if load.is_couple:
            l = l + load.at_shape(s, r, R)
        else:
            f = f + load.at_shape(s, r, R)
    return f, l


def _stations_up_to(problem: Equilibrium, curve: Curve, load_factor: float, origin: Array) -> Array:
    """Return force and moment about the origin of what acts at stations before each node of the curve: (n, 6).

    Point loads are known; of a support between the ends it is what the inner forces jump by.
    """
    total = np.zeros((len(curve.s), 6))
    for s, (support, load) in problem.stations.items():
        nearest = np.abs(curve.s - s)
        before, after = np.flatnonzero(nearest == np.min(nearest))[[0, -1]]  # the node stands twice: from its second on
        y = curve.y[after]
        R = frames.matrix_of_quaternion(y[3:7])
        force = load_factor * load.force_at(R)
        moment = load_factor * load.moment_at(R)
        if support.holds:
            force, moment = curve.y[before, 7:10] - y[7:10], curve.y[before, 10:13] - y[10:13]
        total[after:] += np.concatenate([force, moment + np.cross(y[0:3] - origin, force)])
    return total


def _longest(vectors: Array) -> float:
    return float(np.max(np.linalg.norm(vectors, axis=1)))
