"""Sentences on what is allowed, but mostly a slip: a twist in degrees, millimetres, a support that was not placed."""

from __future__ import annotations

import numpy as np

from darboux.loads import Gravity
from darboux.problem import Equilibrium

DEGREES = 10.0  # rad: a whole number from here on is taken for degrees
THIN_AIR = 0.1  # kg/m^3, below the density of any solid: t/mm^3 are 1e-12 of it
SOFTEST, LONG = 1e6, 10.0  # Pa and m: no rod so long is softer than rubber
IN_MILLIMETRES = (9.7e3, 9.9e3)  # m/s^2: g in mm/s^2


def of_problem(problem: Equilibrium) -> list[str]:
    """Return a sentence for each mistake that a problem seems to hold."""
    rod, found = problem.rod, []
    ends = (problem.start, problem.end)
    held_twice = all(all(end.held_displacement) for end in ends) and not problem.closed
    if held_twice and np.array_equal(*(end.position for end in ends)):
        place = ", ".join(f"{x:g}" for x in problem.end.position)
        found.append(
            f"the supports hold both ends at one place, ({place}) m; a support without a position lies at the origin. If the ends "
            "are apart, give the position of the end."
        )
    for name, end in zip(("start", "end"), ends, strict=True):
        twist = float(end.twist)
        if abs(twist) >= DEGREES and twist == round(twist) and not problem.closed:
            found.append(
                f"the twist of the support at the {name} is {twist:g} rad, which is {twist / (2.0 * np.pi):.3g} turns; {twist:g} "
                f"degrees are {np.radians(twist):.6g} rad."
            )
    material = rod.material
    if material is not None and material.density is not None and 0.0 < material.density < THIN_AIR:
        found.append(
            f"the material's density is {material.density:g} kg/m^3, less than that of any solid; t/mm^3 and g/mm^3 are no units "
            "here: steel has 7850 kg/m^3."
        )
    if material is not None and material.E < SOFTEST and rod.length > LONG:
        found.append(
            f"the material's E is {material.E:g} Pa, softer than rubber, in a rod {rod.length:g} m long; lengths are in m and E in "
            "Pa: 1 MPa is 1e6 Pa, 1 mm is 1e-3 m."
        )
    pulls = [float(np.linalg.norm(load.g)) for load in problem.loads if isinstance(load, Gravity)]
    low, high = IN_MILLIMETRES
    return found + [f"gravity is {g:g} m/s^2; that of the earth is 9.81 m/s^2." for g in pulls if low < g < high]
