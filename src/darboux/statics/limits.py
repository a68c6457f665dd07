"""How large a load a method can follow: mostly a mistaken unit lies behind a larger one."""

from __future__ import annotations

import numpy as np

from darboux.problem import Equilibrium


def too_large(problem: Equilibrium, method: str, limit: float) -> str | None:
    """Return the sentence for loads larger than ``limit`` times EI / L^2 (a moment: EI / L), or None."""
    L = problem.rod.length
    s = np.linspace(0.0, L, 33)
    loads, stiffness = problem.distributed(s), problem.rod.stiffness(s)
    EI = float(np.exp(np.mean(np.log(stiffness.EI1) + np.log(stiffness.EI2)) / 2.0))
    ends = [problem.end_load(at) for at in ("start", "end")]
    per_length = [(loads.a, L**3), (loads.b, L**3), (loads.la, L**2), (loads.lb, L**2)]
    at_ends = [(end.force, L**2) for end in ends] + [(end.moment, L) for end in ends]
    largest = max(float(np.max(np.abs(part))) * unit for part, unit in (*per_length, *at_ends)) / EI
    if largest <= limit:
        return None
    return (
        f"the loads are {largest:.1g} times EI / L^2 (a moment: EI / L), with a length of {L:g} m and a bending stiffness of "
        f"{EI:.3g} N m^2; {method} follows them up to {limit:.0g}. Check the units of the length, the section and the loads."
    )
