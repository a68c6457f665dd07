"""What the page says of a solution."""

from __future__ import annotations

import numpy as np

from darboux.solution import EquilibriumSolution
from darboux.web.quantities import readable
from darboux.web.shape import Fields

LOST = 1e-3  # turns
NOTHING = 1e-9  # of the length: shown as zero


def state(solution: EquilibriumSolution) -> tuple[str, str]:
    """Return the stability in words, and how it is to be taken: "good", "bad" or "unknown"."""
    if solution.stable is None:
        return "Equilibrium; its loads have no potential, so stability is not counted.", "unknown"
    if solution.stable:
        return "Stable equilibrium.", "good"
    ways = "one direction" if solution.index == 1 else f"{solution.index} directions"
    return f"Unstable equilibrium, in {ways}: a real rod would leave it.", "bad"


def how(message: str) -> str:
    """Return how a solution was found, from its status; nothing where it follows from the last one by a small step."""
    if "next to the one" in message:
        return ""
    message = message.removeprefix("converged: ")
    return message[:1].upper() + message[1:]


def failure(message: str) -> str:
    """Return why there is no shape, without what only a program can do about it."""
    return message[:1].upper() + message[1:]


def numbers(solution: EquilibriumSolution, fields: Fields, energy: float) -> list[tuple[str, str]]:
    """Return names and values of what a reader looks at first."""
    place = solution.curve.y[0 if solution.problem.end.holds and not solution.problem.start.holds else -1, :3]
    apart = float(np.linalg.norm(solution.curve.y[-1, :3] - solution.curve.y[0, :3]))
    bent = float(np.max(np.linalg.norm(fields.k, axis=1)))
    moment = float(np.max(np.linalg.norm(fields.M, axis=1)))
    return [
        ("end of the rod", _vector(place, solution.problem.rod.length)),
        ("from end to end", readable(apart if apart > NOTHING * solution.problem.rod.length else 0.0, "m")),
        ("largest moment", readable(moment, "N m")),
        ("largest |k|", readable(bent, "1/m")),
        ("elastic energy", readable(energy, "J")),
        ("error of the shape", error(solution)),
        *link(solution),
    ]


def link(solution: EquilibriumSolution) -> list[tuple[str, str]]:
    """Return the link of a ring, and whether it is the one asked for: two turns go each time the rod passes through itself."""
    problem = solution.problem
    if problem.link is None or problem.rod.shear:
        return []
    found = solution.link
    lost = abs(found - problem.link) > LOST
    return [("link", f"{found:.4g} turns" + (": it passed through itself" if lost else ""))]


def error(solution: EquilibriumSolution) -> str:
    """Return the estimated error of the centreline, as the error bar has it."""
    tip = solution.error.tip
    return "not estimated" if tip is None else f"\N{PLUS-MINUS SIGN} {readable_error(tip)}"


def readable_error(value: float) -> str:
    """Return a small length in m: two digits are all that an estimate has."""
    return f"{value:.1e} m"


def _vector(r: np.ndarray[tuple[int], np.dtype[np.float64]], length: float) -> str:
    unit, factor = next(
        (u, f) for u, f in (("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6), ("nm", 0.0)) if length >= f
    )
    values = ", ".join(f"{0.0 if abs(x) < NOTHING * length else x / (factor or 1e-9):.4g}" for x in r)
    return f"({values}) {unit.replace('u', chr(0xB5))}"
