"""How large a load a method can follow: mostly a mistaken unit lies behind a larger one."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.curve import gauss_points
from darboux.problem import Equilibrium
from darboux.supports import Support

Array = NDArray[np.float64]

PUSHED = (
    "the rod is straight, inextensible and held at both ends, and nothing bends it to a side: pushed together it stays straight "
    "on its branch, which it can't do without stretch. Bend it a little by a small load across, or set rod.stretch."
)
TAUT = (
    "the rod is inextensible, and a straight part of it is held at both its ends as far apart as it is long: it is taut, its "
    "tension is not determined, and grows without bound under a load across. Move the supports closer, or set rod.stretch."
)
MOST_WOUND = 2e4  # rad
LARGEST_LOAD = 3e8  # dimensionless, of a discrete rod
# Of L, times the root of the segments: an edge whose stiffness EI / (h l^2) has a rounding like the rod's own.
NARROWEST = 5e-8
SAME = 1e-12  # relative: two places or directions are one


def wound(problem: Equilibrium) -> str | None:
    """Return the sentence for a natural shape that winds more often than any method lays it out, or None."""
    s, weights = _along(problem)
    k0 = np.linalg.norm(problem.rod.k0(s), axis=1)
    wound = float(weights @ k0)
    if wound <= MOST_WOUND:
        return None
    return (
        f"rod.natural, up to {np.max(k0):.3g} 1/m over {problem.rod.length:g} m, winds the rod {wound / frames.turn:.2g} times; at "
        f"most {MOST_WOUND / frames.turn:.2g} can be computed with. Check its unit, 1/m."
    )


def _along(problem: Equilibrium) -> tuple[Array, Array]:
    """Return points s (n,) in m and weights (n,) for sums along the rod: between the rows of tables and where functions jump."""
    L = problem.rod.length
    if problem.uniform:
        return np.array([0.5 * L]), np.array([L])
    even = np.linspace(0.0, L, 33)
    return gauss_points(np.unique(np.concatenate([even, problem.breaks, problem.steep_places])), 2)


def twisted(problem: Equilibrium) -> str | None:
    """Return the sentence for ends that are turned against each other more often than any method follows, or None."""
    name, angle = "link", (problem.link or 0.0) * frames.turn
    for at in ("start", "end"):
        twist = getattr(problem, at).twist
        if abs(twist) > abs(angle):
            name, angle = f"{at}.twist", twist
    if abs(angle) <= MOST_WOUND:
        return None
    return (
        f"{name} is {angle / frames.turn:.3g} turns; at most {MOST_WOUND / frames.turn:.2g} can be followed. A link counts turns; "
        "a twist is in rad, or has its unit."
    )


def straight(problem: Equilibrium) -> str | None:
    """Return why an inextensible, straight rod between two clamps has no solution that could be followed, or None."""
    rod, start, end = problem.rod, problem.start, problem.end
    if rod.stretch or not (start.holds and end.holds):
        return None
    s = np.concatenate([[0.0], _along(problem)[0], [rod.length]])
    if np.any(rod.k0(s)):
        return None
    tangent = start.R[:, 2]
    chord = (np.array(end.position) - np.array(start.position)) / rod.length
    along = float(chord @ tangent)
    if np.linalg.norm(chord - along * tangent) > SAME or np.linalg.norm(end.R[:, 2] - tangent) > SAME:
        return None
    loads = problem.distributed(s)
    r = np.array(start.position) + s[:, None] * along * tangent
    force, couple = (
        loads.force(r, np.broadcast_to(start.R, (len(s), 3, 3))),
        loads.couple(np.broadcast_to(start.R, (len(s), 3, 3))),
    )
    across = np.max(np.abs(np.cross(force, tangent))) > 0.0 or np.max(np.abs(np.cross(couple, tangent))) > 0.0
    if along >= 1.0 - SAME:
        return TAUT
    return None if across else PUSHED


def coupled(problem: Equilibrium, method: str, *, bending_with_twist: bool = False) -> str | None:
    """Return why a method can't state a coupled section, or None; ``bending_with_twist`` whether that coupling is one it can."""
    what, mixed = "bending and twist with stretch or shear", problem.rod.coupled
    if not bending_with_twist:
        C = problem.rod.compliance(np.linspace(0.0, problem.rod.length, 33))
        what, mixed = (
            "bending, twist, stretch or shear with one another",
            mixed or bool(np.any(C[:, ~np.eye(6, dtype=bool)])),
        )
    if not mixed:
        return None
    return f"{method} can't state a section that couples {what}, as this StiffnessMatrix does; use Collocation."


def beyond(problem: Equilibrium, method: str) -> str | None:
    """Return why a method for clamped and free ends and loads along the rod or on its ends can't state a problem, or None."""
    use = f"use Collocation. {method} states clamped and free ends, loads along the rod and dead loads on its ends"
    for at in ("start", "end"):
        support, load = getattr(problem, at), problem.end_load(at)
        if not support.plain:
            what = "a twist of whole turns" if support.clamps else f"a {type(support).__name__}"
            return f"problem.{at} has {what}; {use}."
        if np.any(load.section_force) or np.any(load.section_moment):
            return f"a load on the {at} turns with the section (follower=True); {use}."
    if problem.closed:
        return f"the rod is closed to a Ring; {use}."
    if problem.between:
        return f"a support holds the rod between its ends, at s = {problem.between[0][0]:g} m; {use}."
    if problem.points:
        return f"a load acts at the point s = {next(iter(problem.points)):g} m; {use}."
    if problem.of_shape:
        return f"a load is a function of the shape; {use}."
    return None


def too_many_turns(problem: Equilibrium, method: str, most: float) -> str | None:
    """Return the sentence for moments that would turn the rod by more than ``most`` rad, or None."""
    L = problem.rod.length
    s, weights = _along(problem)
    loads, stiffness = problem.distributed(s), problem.rod.stiffness(s)
    softest = L / float(weights @ (1.0 / np.min([stiffness.EI1, stiffness.EI2, stiffness.GJ], axis=0)))
    at_points = [problem.end_load("start"), problem.end_load("end"), *problem.points.values()]
    moments = [
        float(sum(np.linalg.norm(part) for part in (load.moment, load.section_moment, load.eccentric)))
        for load in at_points
    ]
    moments += [float(weights @ np.linalg.norm(couple, axis=1)) for couple in (loads.la, loads.lb)]
    turned = max(moments) * L / softest
    if turned <= most:
        return None
    return (
        f"a moment of {max(moments):.3g} N m would turn the rod, {L:g} m long with a mean stiffness of {softest:.3g} N m^2, by "
        f"about {turned / frames.turn:.2g} turns; {method} follows it up to {most / frames.turn:.2g}. Check the units of the "
        "length, the section and the moment."
    )


def turns(support: Support) -> bool:
    """Return whether a support turns with the section, or holds it from turning, as a vertex, which has no frame, can't."""
    return any(support.held_rotation) or support.rotational is not None or support.sliding == "section"


def beyond_chain(problem: Equilibrium, segments: int, *, even: bool) -> str | None:
    """Return why a discrete rod of so many segments, ``even`` ones or not, can't state a problem, or None."""
    beyond = beyond_nodes(problem, "DiscreteRod") or coupled(problem, "DiscreteRod")
    if beyond:
        return beyond
    if problem.closed and (problem.rod.stretch or problem.stations):
        what = "stretches" if problem.rod.stretch else "has a support or a load at a point between its ends"
        return f"the ring {what}; DiscreteRod states rings that do not, for it holds one segment; use Collocation."
    if problem.closed and not even:
        return "DiscreteRod states a Ring on equal segments; leave out grading."
    if problem.rod.shear:
        return "DiscreteRod states rods that do not shear, but rod.shear is True; use Collocation, or a rod without rod.shear."
    least = NARROWEST * segments**0.5 * problem.rod.length
    for (a, _), (b, _) in pairwise([(0.0, None), *problem.between, (problem.rod.length, None)]):
        if b - a < least:
            return (
                f"a support is {b - a:.3g} m from the next one or an end; DiscreteRod({segments}) needs {least:.2g} m "
                "between, or rounding hides the rest; use Collocation, or one support for both."
            )
    return too_large(problem, "DiscreteRod", LARGEST_LOAD)


def beyond_nodes(problem: Equilibrium, method: str) -> str | None:
    """Return why a method whose unknowns are vertices and edges can't state a problem, or None."""
    for s, support in problem.between:
        if turns(support):
            return (
                f"the {type(support).__name__} at s = {s:g} m turns with the section or holds it from turning, but {method} "
                "holds a vertex there, which has no frame; use Collocation."
            )
    return None


def too_large(problem: Equilibrium, method: str, limit: float) -> str | None:
    """Return the sentence for loads larger than ``limit`` times EI / L^2 (a moment: EI / L), or None."""
    L = problem.rod.length
    s, weights = _along(problem)
    loads, stiffness = problem.distributed(s), problem.rod.stiffness(s)
    EI = float(np.exp(weights @ (np.log(stiffness.EI1) + np.log(stiffness.EI2)) / (2.0 * L)))
    ends = [problem.end_load(at) for at in ("start", "end")]
    per_length = [(loads.a, L**2), (loads.b, L**2), (loads.la, L), (loads.lb, L)]
    sums = [(weights @ np.abs(part), unit) for part, unit in per_length]
    at_ends = [(np.abs(end.force), L**2) for end in ends] + [
        (np.abs(part), L) for end in ends for part in (end.moment, end.eccentric)
    ]
    largest = max(float(np.max(part)) * unit for part, unit in (*sums, *at_ends)) / EI
    if largest <= limit:
        return None
    return (
        f"the loads are {largest:.1g} times EI / L^2 (a moment: EI / L), with a length of {L:g} m and a bending stiffness of "
        f"{EI:.3g} N m^2; {method} follows them up to {limit:.0g}. Check the units of the length, the section and the loads."
    )
