"""What a motion looks like: shapes coloured by time, where the tip goes, and where the energy is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from darboux import checks
from darboux.view import palette, prefix, style
from darboux.view.look import Look
from darboux.view.stage import Stage

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from darboux.trajectory import Trajectory

Array = NDArray[np.float64]

MOST_SHAPES = 60  # in a fan: more only fill the paper
MOVED = 1e-3  # of the length: an end that moves by less stands still
NOTHING = 1e-3  # of the largest energy: its line would lie on zero
SAMPLES = 200  # along a smooth rod


def motion(
    trajectory: Trajectory, what: str = "all", ax: Any = None, new: style.NewFigure = style.new_figure
) -> Axes | list[Axes]:
    """Draw a motion: ``what`` is one of ``PANELS``, on ``ax`` or new axes, or "all", on three. Returns the axes."""
    checks.choice("plot.what", what, ("all", *PANELS))
    look = Look.at(trajectory.positions)
    if what != "all":
        size = (look.size[0] + 1.0, look.size[1]) if what == "shapes" else (6.4, 3.2)
        with style.axes_for(ax, *size, new) as made:
            _panel(made, trajectory, what, look)
        return made
    if ax is not None:
        with style.panels_for(ax, len(PANELS), 0.0, 0.0, new) as panels:
            for name, panel in zip(PANELS, panels, strict=True):
                _panel(panel, trajectory, name, look)
        return panels
    with style.article():
        figure = new(9.2, 4.6, "constrained")
        parts = figure.add_gridspec(2, 2, width_ratios=(1.25, 1.0))
        panels = [figure.add_subplot(parts[:, 0]), figure.add_subplot(parts[0, 1]), figure.add_subplot(parts[1, 1])]
        for name, panel in zip(list(PANELS)[1:], panels[1:], strict=True):
            _panel(panel, trajectory, name, look)
        _panel(panels[0], trajectory, "shapes", look)
    return panels


def _panel(ax: Axes, trajectory: Trajectory, what: str, look: Look) -> None:
    if what == "shapes":
        _fan(ax, trajectory, look)
    else:
        PANELS[what](ax, trajectory)


def smooth(trajectory: Trajectory, r: Array) -> Array:
    """Return vertices r (..., N + 1, 3) as a smooth line through them, (..., m, 3)."""
    if r.shape[-2] >= SAMPLES or r.shape[-2] < 4:
        return r
    return np.asarray(trajectory.curve(r)(np.linspace(trajectory.s[0], trajectory.s[-1], SAMPLES)))


def moving_ends(trajectory: Trajectory) -> list[int]:
    """Return which of the rod's ends move: vertices, 0 or -1."""
    length = trajectory.motion.problem.rod.length
    ways = {end: np.max(np.ptp(trajectory.positions[:, end], axis=0)) for end in (-1, 0)}
    return [end for end, way in ways.items() if way > MOVED * length]


def _fan(ax: Axes, trajectory: Trajectory, look: Look) -> None:
    """Draw the shapes, dark at the start and light at the end, with a bar of time, and the paths of the ends that move."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap, Normalize

    times = trajectory.times
    unit, size = prefix.quantity(float(times[-1]), "s")
    chosen = np.unique(np.linspace(0, len(times) - 1, MOST_SHAPES).astype(int))
    colours = ListedColormap(colormaps["cividis"](np.linspace(0.0, 0.92, 256)), name="time")
    norm = Normalize(times[0] / size, max(times[-1], np.nextafter(times[0], np.inf)) / size)
    from matplotlib.cm import ScalarMappable

    bar = ax.get_figure(root=True).colorbar(  # type: ignore[union-attr]
        ScalarMappable(norm, colours), ax=ax, label=f"time $t$ ({unit})", fraction=0.05, pad=0.03
    )
    bar.outline.set_visible(False)
    stage = Stage.on(ax, look)
    curves = smooth(trajectory, trajectory.positions[chosen])
    for i, r in zip(chosen, curves, strict=True):
        first_or_last = i in (0, len(times) - 1)
        colour = colours(norm(times[i] / size))
        stage.line(r, color=colour, lw=2.2 if first_or_last else 0.9, zorder=3.0 + 0.5 * i / len(times))
    for end in moving_ends(trajectory):
        stage.line(trajectory.positions[:, end], color=palette.VERMILION, lw=1.0, ls=(0, (3.0, 1.5)), zorder=4.0)
    for place, support in trajectory.held:
        stage.hold(place, support.clamps)
    _say_what_failed(ax, trajectory)


def _tip(ax: Axes, trajectory: Trajectory) -> None:
    """Draw the tip's coordinates over time."""
    tip, times = trajectory.tip, trajectory.times
    unit, metres = prefix.length(float(np.max(np.abs(tip))))
    clock, size = prefix.quantity(float(times[-1]), "s")
    for i, (name, dashes, colour) in enumerate(
        zip("xyz", ("-", "-.", "--"), (palette.BLUE, palette.GREEN, palette.VERMILION), strict=True)
    ):
        ax.plot(times / size, tip[:, i] / metres, label=f"${name}$", ls=dashes, color=colour)
    ax.set_xlim(times[0] / size, times[-1] / size)
    ax.set_xlabel(f"time $t$ ({clock})")
    ax.set_ylabel(f"tip ({unit})")
    ax.grid(visible=True)
    style.settle(ax)
    style.legend_on_top(ax)


def _energy(ax: Axes, trajectory: Trajectory) -> None:
    """Draw the energies over time, loads counted from their start, and the balance, which is kept where it is level."""
    energy, times = trajectory.energy, trajectory.times
    lines = {
        "kinetic": energy.kinetic,
        "elastic": energy.elastic,
        "supports": energy.supports,
        "loads": energy.load - energy.load[0],
        "dissipated": energy.dissipated,
        "work": -energy.work,
        "sum": energy.balance - energy.load[0],
    }
    looks: Any = {
        "kinetic": (palette.VERMILION, "--"),
        "elastic": (palette.BLUE, "-"),
        "supports": (palette.GREY, (0, (3.0, 1.0))),
        "loads": (palette.GREEN, "-."),
        "dissipated": (palette.ORANGE, (0, (5.0, 1.5, 1.0, 1.5, 1.0, 1.5))),
        "work": (palette.SKY, (0, (1.0, 1.0))),
        "sum": (palette.BLACK, ":"),
    }
    largest = max(float(np.max(np.abs(values))) for values in lines.values())
    unit, joules = prefix.quantity(largest, "J")
    clock, size = prefix.quantity(float(times[-1]), "s")
    for name, values in lines.items():
        if np.max(np.abs(values)) > NOTHING * largest or name == "sum":
            label = "\N{MINUS SIGN}work" if name == "work" else name
            ax.plot(times / size, values / joules, label=label, color=looks[name][0], ls=looks[name][1])
    ax.set_xlim(times[0] / size, times[-1] / size)
    ax.set_xlabel(f"time $t$ ({clock})")
    ax.set_ylabel(f"energy ({unit})")
    ax.grid(visible=True)
    style.settle(ax)
    style.legend_on_top(ax)


def _say_what_failed(ax: Axes, trajectory: Trajectory) -> None:
    if not trajectory.converged:
        reached = f"{trajectory.times[-1]:.3g} s of {trajectory.motion.duration:.3g} s"
        ax.set_title(f"{trajectory.status.code.replace('_', ' ')}: {reached}", color=palette.VERMILION)


PANELS: Any = {"shapes": _fan, "tip": _tip, "energy": _energy}
