"""What goes on along a rod: curvature, moments, forces, stress and energy over the arc length."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from darboux import checks
from darboux.checks import ONE_PLACE
from darboux.view import palette, prefix, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from darboux.solution import EquilibriumSolution

Array = NDArray[np.float64]

SAMPLES = 801
NOTHING = 1e-9  # of what bends the rod by 1 rad over its length: rounding, which is drawn as zero
LOOKS: Any = ((palette.BLUE, "-"), (palette.VERMILION, "--"), (palette.GREEN, "-."), (palette.BLACK, ":"))
DOTS: Any = (0, (1.0, 2.5))


@dataclass(frozen=True)
class Field:
    """Lines (n,) over s by name, in the SI ``unit``; ``scale`` a value that counts as large; ``behind`` (n, 3) more, dotted."""

    name: str
    unit: str
    lines: dict[str, Array]
    scale: float
    behind: tuple[str, Array] | None = None


def fields(
    solution: EquilibriumSolution,
    names: Sequence[str] = (),
    ax: Any = None,
    new: style.NewFigure = style.new_figure,
) -> list[Axes]:
    """Draw fields of a solution over the arc length, each in axes of its own; names are those of ``FIELDS``. Returns the axes.

    Without names all that the rod has are drawn: stress is left out where its section has no shape. ``ax`` are as many axes.
    """
    shaped = solution.problem.rod.section.has_shape
    names = [checks.choice("plot_fields", name, FIELDS) for name in names] or [
        name for name in FIELDS if shaped or name != "stress"
    ]
    s = places(solution)
    found = [FIELDS[name](solution, s) for name in names]
    with style.panels_for(ax, len(names), 6.4, 3.2 if len(names) == 1 else 1.75, new) as panels:
        for one, panel in zip(found, panels, strict=True):
            _draw(panel, one, s, last=panel is panels[-1])
        style.settle(panels[0])
        for panel in panels:
            style.legend_on_top(panel)
    return panels


def places(solution: EquilibriumSolution) -> Array:
    """Return arc lengths (n,) in m at which fields are read: equally spaced, and on both sides of each jump."""
    L, problem = solution.problem.rod.length, solution.problem
    jumps = np.array(sorted({*problem.breaks, *problem.jumps}))
    return np.unique(np.concatenate([np.linspace(0.0, L, SAMPLES), jumps, jumps - 2.0 * ONE_PLACE * L]))


def _draw(ax: Axes, field: Field, s: Array, last: bool) -> None:
    name_behind, behind = field.behind or ("", np.empty((len(s), 0)))
    every = [*field.lines.values(), *behind.T]
    largest = max(float(np.max(np.abs(values))) for values in every)
    nothing = largest <= NOTHING * field.scale
    unit, size = prefix.quantity(field.scale if nothing else largest, field.unit)
    along, metres = prefix.length(s[-1])
    for values, (colour, _) in zip(behind.T, LOOKS, strict=False):
        ax.plot(s / metres, values / size, color=colour, ls=DOTS, lw=1.2, zorder=1.5)
    for (name, values), (colour, dashes) in zip(field.lines.items(), LOOKS, strict=False):
        ax.plot(s / metres, values / size, color=colour, ls=dashes, label=name)
    if name_behind:  # one entry for all three
        ax.plot([], [], color=palette.GREY, ls=DOTS, lw=1.2, label=name_behind)
    ax.set_xlim(0.0, s[-1] / metres)
    if nothing:
        ax.set_ylim(-1.0, 1.0)
    if last:
        ax.set_xlabel(f"arc length $s$ ({along})")
    ax.set_ylabel(f"{field.name} ({unit})")
    ax.grid(visible=True)


def _stiffness(solution: EquilibriumSolution) -> float:
    """Return the largest stiffness against bending or twist, in N m^2."""
    rod = solution.problem.rod
    return float(
        np.max(np.diagonal(rod.stiffness(np.linspace(0.0, rod.length, 17)).matrix[:, 3:, 3:], axis1=1, axis2=2))
    )


def _in_section(solution: EquilibriumSolution, s: Array, vectors: Array) -> Array:
    return np.asarray(np.einsum("nji,nj->ni", solution.R(s), vectors))


def _curvature(solution: EquilibriumSolution, s: Array) -> Field:
    k, k0 = solution.k(s), solution.problem.rod.k0(s)
    lines = {"$k_1$": k[:, 0], "$k_2$": k[:, 1], "$k_3$, twist": k[:, 2]}
    behind = ("natural", k0) if np.any(k0) else None
    return Field("curvature", "1/m", lines, 1.0 / solution.problem.rod.length, behind)


def _moments(solution: EquilibriumSolution, s: Array) -> Field:
    M = _in_section(solution, s, solution.m(s))
    lines = {"$M_1$, bending": M[:, 0], "$M_2$, bending": M[:, 1], "$M_3$, twist": M[:, 2]}
    lines["$|m|$"] = np.linalg.norm(M, axis=1)
    return Field("moment", "N m", lines, _stiffness(solution) / solution.problem.rod.length)


def _forces(solution: EquilibriumSolution, s: Array) -> Field:
    N = _in_section(solution, s, solution.n(s))
    lines = {"$N_1$, shear": N[:, 0], "$N_2$, shear": N[:, 1], "$N_3$, tension": N[:, 2]}
    lines["$|n|$"] = np.linalg.norm(N, axis=1)
    return Field("force", "N", lines, _stiffness(solution) / solution.problem.rod.length**2)


def _energy(solution: EquilibriumSolution, s: Array) -> Field:
    rod = solution.problem.rod
    M, N = (_in_section(solution, s, vector) for vector in (solution.m(s), solution.n(s)))
    work = 0.5 * (solution.k(s) - rod.k0(s)) * M
    lines = {"bending": work[:, 0] + work[:, 1], "twist": work[:, 2]}
    if rod.model != "inextensible":
        lines["stretch and shear"] = 0.5 * np.sum((solution.v(s) - [0.0, 0.0, 1.0]) * N, axis=1)
    return Field("energy", "J/m", lines, _stiffness(solution) / rod.length**2)


def _stress(solution: EquilibriumSolution, s: Array) -> Field:
    rod = solution.problem.rod
    found = solution.stress(s)
    lines = {"axial": found.axial, "bending": found.bending, "torsion": found.torsion, "von Mises": found.von_mises}
    shape = rod.section.geometry(np.zeros(1), rod.material.poisson)
    scale = rod.material.E * float(np.sqrt(shape.I1[0] / shape.A[0])) / rod.length
    return Field("stress", "Pa", lines, scale)


FIELDS: dict[str, Callable[[EquilibriumSolution, Array], Field]] = {
    "curvature": _curvature,
    "moments": _moments,
    "forces": _forces,
    "stress": _stress,
    "energy": _energy,
}
