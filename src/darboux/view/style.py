"""The look of darboux's figures: an article's type, colours that the colour-blind tell apart, greys that differ.

Nothing is drawn and no setting of Matplotlib's is changed at import; ``article()`` lends its settings to a block.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np

from darboux.view.palette import BLACK as BLACK
from darboux.view.palette import BLUE as BLUE
from darboux.view.palette import DIRECTORS as DIRECTORS
from darboux.view.palette import GREEN as GREEN
from darboux.view.palette import GREY as GREY
from darboux.view.palette import ORANGE as ORANGE
from darboux.view.palette import PALE as PALE
from darboux.view.palette import SKY as SKY
from darboux.view.palette import VERMILION as VERMILION

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SETTINGS: dict[str, Any] = {
    "font.family": ["STIXGeneral", "DejaVu Serif"],  # both come with Matplotlib
    "mathtext.fontset": "stix",
    "font.size": 11.0,
    "axes.titlesize": 11.0,
    "axes.labelsize": 11.0,
    "xtick.labelsize": 10.0,
    "ytick.labelsize": 10.0,
    "legend.fontsize": 10.0,
    "legend.frameon": False,
    "legend.handlelength": 2.6,
    "legend.columnspacing": 1.6,
    "text.color": BLACK,
    "axes.labelcolor": BLACK,
    "axes.edgecolor": "#4d4d4d",
    "xtick.color": "#4d4d4d",
    "ytick.color": "#4d4d4d",
    "xtick.labelcolor": BLACK,
    "ytick.labelcolor": BLACK,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.8,
    "lines.solid_capstyle": "round",
    "figure.facecolor": "white",
    "axes.facecolor": "white",
    "savefig.facecolor": "white",
    "hatch.linewidth": 0.8,
    "svg.fonttype": "path",  # the same letters on every machine
    "svg.hashsalt": "darboux",  # the same file from the same numbers
}


@contextmanager
def article() -> Iterator[None]:
    """Draw in our style inside the block; Matplotlib's own settings are as before after it."""
    with mpl.rc_context():
        mpl.rcdefaults()  # a reader's own settings must not reach into the paper's figures
        mpl.rcParams.update(_SETTINGS)  # type: ignore[arg-type,unused-ignore]  # the names are literals from 3.11 on
        yield


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of ``width`` by ``height`` inches that no window and no global list knows of."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, folder: Path, stem: str, dpi: float = 200.0) -> None:
    """Write the figure as ``stem``.png and ``stem``.svg into the folder, in our style and without the date."""
    with article():
        figure.savefig(folder / f"{stem}.png", dpi=dpi)
        figure.savefig(folder / f"{stem}.svg", metadata={"Date": None})


def axes_at(figure: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    """Return axes at a place given in inches from the figure's lower left corner."""
    across, up = figure.get_size_inches()
    return figure.add_axes((left / across, bottom / up, width / across, height / up))


def panel_label(ax: Axes, letter: str, title: str = "", x: float = 0.0) -> None:
    """Write "(a) title" above the axes, flush left."""
    ax.set_title(f"({letter})" + (f"  {title}" if title else ""), loc="left", x=x, pad=7.0)


def power_of_ten(value: float) -> str:
    """Return a number as mathtext, 3e5 as "3 x 10^5", and 0 to 999 as they are."""
    if value == 0.0 or 1e-2 <= abs(value) < 1e3:
        return f"{value:g}"
    exponent = int(np.floor(np.log10(abs(value))))
    return rf"{value / 10.0**exponent:g} \times 10^{{{exponent}}}"


def gravity_arrow(ax: Axes, x: float, y: float, length: float = 22.0, label: str = r"$g$", side: str = "right") -> None:
    """Draw a small arrow downwards, ``length`` points long from (x, y) in fractions of the axes, with its label."""
    field_arrow(ax, x, y, (0.0, -length), label, side=side)


def field_arrow(
    ax: Axes, x: float, y: float, vector: tuple[float, float], label: str, *, colour: str = BLACK, side: str = "right"
) -> None:
    """Draw a small arrow, ``vector`` in points from (x, y) in fractions of the axes, with its label beside it."""
    from matplotlib.transforms import ScaledTranslation

    figure = ax.get_figure(root=True)
    shift = ScaledTranslation(vector[0] / 72.0, vector[1] / 72.0, figure.dpi_scale_trans)  # type: ignore[union-attr]
    ax.annotate(
        "",
        xy=(x, y),
        xytext=(x, y),
        xycoords=ax.transAxes + shift,
        textcoords=ax.transAxes,
        arrowprops={
            "arrowstyle": "-|>",
            "color": colour,
            "lw": 1.4,
            "shrinkA": 0.0,
            "shrinkB": 0.0,
            "mutation_scale": 11.0,
        },
        annotation_clip=False,
    )
    sign = 1.0 if side == "right" else -1.0
    ax.annotate(
        label,
        xy=(x, y),
        xycoords="axes fraction",
        xytext=(vector[0] / 2.0 + sign * 6.0, vector[1] / 2.0),
        textcoords="offset points",
        ha="left" if side == "right" else "right",
        va="center",
        color=colour,
        annotation_clip=False,
    )
