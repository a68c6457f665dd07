"""Which motions can't be stated."""

from __future__ import annotations

from darboux.motion import Motion
from darboux.solution import EquilibriumSolution
from darboux.statics.limits import turns


def refuses(motion: Motion) -> str | None:
    """Return why this motion can't be stated, in one sentence, or None."""
    problem = motion.problem
    if problem.rod.shear:
        return "motion states rods that do not shear, but rod.shear is True; set shear=False."
    if problem.rod.coupled:
        return "motion states no section that couples bending or twist with stretch or shear, as this StiffnessMatrix does."
    for at in () if problem.closed else ("start", "end"):
        support = getattr(problem, at)
        if support.twist != 0.0 and not (
            motion.initial == "equilibrium" or isinstance(motion.initial, EquilibriumSolution)
        ):
            return (
                f"problem.{at} has a twist, which the rod at the start of the motion has not; begin with an equilibrium, "
                "initial='equilibrium', or give the end's frame instead of a twist."
            )
        if support.sliding == "section" and any(support.held_displacement):
            return f"problem.{at} is a groove that turns with the section; motion states sliding='fixed'."
    for s, support in problem.between:
        if turns(support):
            return (
                f"the {type(support).__name__}() at s = {s:g} m turns with the section or holds it from turning; between the ends "
                "motion states supports that hold displacements or tie them by springs."
            )
    if problem.of_shape:
        return (
            f"a {type(problem.of_shape[0]).__name__} is a Python function of the shape, which compiled steps can't ask; motion "
            "states functions of s, and functions of t as load_factor."
        )
    turning = [i for i, load in enumerate(problem.loads) if load.frame_spin is not None]
    factors = motion.factors if len(motion.factors) == len(problem.loads) else motion.factors * len(problem.loads)
    if len(turning) > 1:
        return "two Rotation loads act, but all is seen in one turning frame; add their omega."
    if turning and factors[turning[0]] not in (None, 1.0):
        return "Rotation is the turning frame itself, whose speed can't change: its load_factor must be 1; turn the clamp instead."
    return None
