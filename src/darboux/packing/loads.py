"""What acts on a rod, in numbers."""

from __future__ import annotations

import numpy as np

from darboux.problem import Equilibrium


def has_potential(problem: Equilibrium) -> bool:
    """Return whether all loads have a potential: couples, moments, followers and functions of the shape have none in 3-D."""
    s = np.linspace(0.0, problem.rod.length, 33)
    loads = problem.distributed(s)
    ends = [problem.end_load("start"), problem.end_load("end"), *problem.points.values()]
    without = [part for end in ends for part in (end.moment, end.section_force, end.section_moment)]
    return not problem.of_shape and not any(np.any(part) for part in (loads.b, loads.la, loads.lb, *without))
