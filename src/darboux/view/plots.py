"""What a solution looks like: its shape in space, and moments, curvature and energy along the rod."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from darboux import checks
from darboux.solution import EquilibriumSolution
from darboux.view import style
from darboux.view.camera import Camera
from darboux.view.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

SAMPLES = 801
THINNEST = 0.12  # of the box's longest side
TICKS = 4
UNITS = (
    ("km", 1e3),
    ("m", 1.0),
    ("cm", 1e-2),
    ("mm", 1e-3),
    ("µm", 1e-6),
    ("nm", 1e-9),
)  # of the axes, and their size in m


def draw(solution: EquilibriumSolution, what: str = "shape") -> Figure:
    """Return a figure of a solution: ``what`` is one of ``PLOTS``. Raises ``InvalidInput`` for another word."""
    plot = PLOTS[checks.choice("--what", what, PLOTS)]
    with style.article():
        return plot(solution)


def _shape(solution: EquilibriumSolution) -> Figure:
    return shapes({"": solution})


def shapes(solutions: dict[str, EquilibriumSolution]) -> Figure:
    """Return the centrelines in one box, each under its name."""
    curves = {name: x.r(np.linspace(0.0, x.problem.rod.length, SAMPLES)) for name, x in solutions.items()}
    extent = np.max(np.ptp(np.concatenate(list(curves.values())), axis=0))
    unit, metres = next(((unit, size) for unit, size in UNITS if extent >= 2.0 * size), UNITS[-1])
    curves = {name: r / metres for name, r in curves.items()}
    points = np.concatenate(list(curves.values()))
    low, high = points.min(axis=0), points.max(axis=0)
    longest = float(np.max(high - low))
    room = np.maximum(high - low, THINNEST * longest) * 1.08
    middle = (low + high) / 2.0
    low, high = middle - room / 2.0, middle + room / 2.0
    figure = style.new_figure(6.4, 5.2)
    scene = Scene.at(figure, (0.0, 0.0, 6.4, 5.2), Camera(azimuth=-62.0, elevation=20.0))
    step = _nice(longest / TICKS)
    steps = [step if side > step else _nice(side / 2.0) for side in room]
    corners = scene.box(low.tolist(), high.tolist(), steps, (f"$x$ ({unit})", f"$y$ ({unit})", f"$z$ ({unit})"))
    looks: Any = (("-", style.BLUE), ("--", style.VERMILION), (":", style.GREEN), ("-.", style.ORANGE))
    for i, (name, r) in enumerate(curves.items()):
        dashes, colour = looks[i % len(looks)]
        if len(curves) == 1:
            scene.curve(r, width=2.0, colour=colour)
        else:
            scene.line(r, label=name, linestyle=dashes, color=colour, lw=2.4 - 0.3 * min(i, 4), zorder=3.0 + 0.1 * i)
        scene.dot(r[0], marker="s", ms=5.0)
    rows = 0 if len(curves) == 1 else (len(curves) + 1) // 2
    scene.fit(corners, (0.7, 0.5, 0.65, 0.2 + 0.25 * rows))
    if rows:
        figure.legend(loc="upper center", ncols=2)
    return figure


def _nice(value: float) -> float:
    """Return the nearest of 1, 2, 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(max(value, 1e-300)))
    return float(power * min((1.0, 2.0, 5.0, 10.0), key=lambda digit: abs(digit - value / power)))


def _along(solution: EquilibriumSolution, label: str, lines: dict[str, Array], s: Array, dashed: Any = None) -> Figure:
    """Return lines over the arc length, with thin dashed ones of the same colours behind them."""
    figure = style.new_figure(6.4, 3.6)
    ax = style.axes_at(figure, 0.95, 0.6, 5.2, 2.55)
    colours = (style.BLUE, style.VERMILION, style.GREEN, style.BLACK)
    for (name, values), colour in zip(lines.items(), colours, strict=False):
        ax.plot(s, values, label=name, color=colour)
    if dashed is not None:
        for values, colour in zip(dashed.T, colours, strict=False):
            ax.plot(s, values, color=colour, lw=1.0, linestyle="--", zorder=1.5)
    ax.set_xlabel("arc length $s$ (m)")
    ax.set_ylabel(label)
    ax.set_xlim(0.0, solution.problem.rod.length)
    ax.grid(visible=True)
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=len(lines))
    return figure


def _samples(solution: EquilibriumSolution) -> Array:
    return np.linspace(0.0, solution.problem.rod.length, SAMPLES)


def _moments(solution: EquilibriumSolution) -> Figure:
    s = _samples(solution)
    M = np.einsum("nji,nj->ni", solution.R(s), solution.m(s))
    lines = {"$M_1$, bending": M[:, 0], "$M_2$, bending": M[:, 1], "$M_3$, twist": M[:, 2]}
    lines["$|m|$"] = np.linalg.norm(M, axis=1)
    return _along(solution, "moment, section's frame (N m)", lines, s)


def _curvature(solution: EquilibriumSolution) -> Figure:
    s = _samples(solution)
    k, k0 = solution.k(s), solution.problem.rod.k0(s)
    lines = {"$k_1$": k[:, 0], "$k_2$": k[:, 1], "$k_3$, twist": k[:, 2]}
    return _along(solution, "curvature (1/m); dashed: natural", lines, s, k0 if np.any(k0) else None)


def _energy(solution: EquilibriumSolution) -> Figure:
    s = _samples(solution)
    rod, R = solution.problem.rod, solution.R(s)
    M, N = (np.einsum("nji,nj->ni", R, vector) for vector in (solution.m(s), solution.n(s)))
    work = 0.5 * (solution.k(s) - rod.k0(s)) * M
    lines = {"bending": work[:, 0] + work[:, 1], "twist": work[:, 2]}
    if rod.model != "inextensible":
        lines["stretch and shear"] = 0.5 * np.sum((solution.v(s) - [0.0, 0.0, 1.0]) * N, axis=1)
    return _along(solution, "elastic energy per length (J/m)", lines, s)


def _stress(solution: EquilibriumSolution) -> Figure:
    s = _samples(solution)
    found = solution.stress(s)
    lines = {"axial": found.axial, "bending": found.bending, "torsion": found.torsion, "von Mises": found.von_mises}
    return _along(
        solution, "largest stress in the section (MPa)", {name: values / 1e6 for name, values in lines.items()}, s
    )


PLOTS = {"shape": _shape, "moments": _moments, "curvature": _curvature, "energy": _energy, "stress": _stress}
