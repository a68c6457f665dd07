"""A solution in a few lines of text."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from darboux.solution import EquilibriumSolution

Array = NDArray[np.float64]

NAME = 14  # letters of a line's name
ROUNDING = 1e-12  # of a vector's largest component: what is smaller is shown as 0


def summary(solution: EquilibriumSolution) -> str:
    """Return status, method, tip, reactions, the largest moment and stress, energy and stability, a line each."""
    lines = [
        ("status", solution.status.message),
        *(("warning", sentence) for sentence in solution.warnings),
        ("method", f"{solution.method} ({solution.model})"),
        ("tip", f"{vector(solution.tip, solution.error.tip)} m"),
        *_reactions(solution),
        ("largest |m|", _largest_moment(solution)),
        *_stress(solution),
        *_cable(solution),
        ("energy", _energy(solution)),
        *_error(solution),
    ]
    if solution.index is not None:
        lines.append(("stability", "stable" if solution.stable else f"unstable in {solution.index} direction(s)"))
    return "\n".join(f"{name:<{NAME}}{text}" for name, text in lines)


def vector(values: Array, error: float | None = None) -> str:
    """Return the components with nine digits, those of rounding, or below an estimated ``error``, as 0."""
    least = max(ROUNDING * float(np.max(np.abs(values))), error or 0.0)
    return "(" + ", ".join("0" if abs(value) <= least else f"{value:.9g}" for value in values) + ")"


def _reactions(solution: EquilibriumSolution) -> list[tuple[str, str]]:
    lines, error = [], solution.error
    for end in ("start", "end"):
        if getattr(solution.problem, end).holds:
            reaction = getattr(solution.reactions, end)
            lines += [(f"{end:<5} force", f"{vector(reaction.force, error.reactions)} N")]
            lines += [(f"{end:<5} moment", f"{vector(reaction.moment, error.moments)} N m")]
    for s, reaction in solution.reactions.between.items():
        force, moment = vector(reaction.force, error.reactions), vector(reaction.moment, error.moments)
        lines += [(f"at {s:.4g} m", f"{force} N, {moment} N m")]
    return lines


def _largest_moment(solution: EquilibriumSolution) -> str:
    s = np.union1d(solution.s, np.linspace(0.0, solution.problem.rod.length, 401))
    moment = np.linalg.norm(solution.m(s), axis=1)
    place = int(np.argmax(moment))
    return f"{moment[place]:.6g} N m at s = {s[place]:.4g} m"


def _stress(solution: EquilibriumSolution) -> list[tuple[str, str]]:
    if not solution.problem.rod.section.has_shape:
        return []
    found = solution.largest_stress
    axial, bending, torsion, von_mises = (
        _shown(value / 1e6, found.von_mises / 1e6)
        for value in (found.axial, found.bending, found.torsion, found.von_mises)
    )
    x1, x2 = (_shown(x * 1e3, max(map(abs, found.point)) * 1e3) for x in found.point)
    return [
        ("stress", f"at most {von_mises} MPa (von Mises) at s = {found.s:.4g} m, x1 = {x1} mm, x2 = {x2} mm:"),
        ("", f"axial {axial}, bending {bending}, torsion {torsion} MPa"),
    ]


def _cable(solution: EquilibriumSolution) -> list[tuple[str, str]]:
    cable = solution.cable
    if cable is None:
        return []
    return [
        ("cable", f"sag {cable.sag:.6g} m, span {cable.span:.6g} m, length {cable.length:.9g} m,"),
        (
            "",
            f"tension up to {cable.tension:.6g} N at s = {cable.at:.4g} m, ends {cable.angles[0]:.4g} and "
            f"{cable.angles[1]:.4g} degrees below the horizontal",
        ),
    ]


def _shown(value: float, largest: float) -> str:
    return "0" if abs(value) <= ROUNDING * largest else f"{value:.4g}"


def _energy(solution: EquilibriumSolution) -> str:
    return f"{solution.energy.total:.6g} J ({solution.energy.parts})"


def _error(solution: EquilibriumSolution) -> list[tuple[str, str]]:
    error = solution.error
    known = [
        f"{name} {value:.1e} {unit}"
        for name, value, unit in (
            ("tip", error.tip, "m"),
            ("reactions", error.reactions, "N"),
            ("moments", error.moments, "N m"),
            ("energy", error.energy, "J"),
        )
        if value is not None
    ]
    return [("error", f"{', '.join(known)} (estimated)")] if known else []
