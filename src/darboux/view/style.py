"""The look of darboux's figures: an article's type, colours that the colour-blind tell apart, greys that differ.

Nothing is drawn and no setting of Matplotlib's is changed at import; ``article()`` lends its settings to a block.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np

from darboux import checks, files
from darboux.errors import InvalidInput
from darboux.view.palette import BLACK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NewFigure = Callable[[float, float, str | None], "Figure"]

SHEET = Path(__file__).with_name("article.mplstyle")


@contextmanager
def article() -> Iterator[None]:
    """Draw in our style inside the block; Matplotlib's own settings are as before after it."""
    with mpl.rc_context():
        mpl.rcdefaults()  # a reader's own settings must not reach into the paper's figures
        mpl.rcParams.update(_settings())
        yield


@cache
def _settings() -> Any:
    return mpl.rc_params_from_file(SHEET, use_default_template=False)


def new_figure(width: float, height: float, layout: str | None = None) -> Figure:
    """Return an empty figure of ``width`` by ``height`` inches that no window and no global list knows of."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), facecolor="white", layout=layout)  # type: ignore[arg-type]
    FigureCanvasAgg(figure)
    return figure


def shown_figure() -> NewFigure:
    """Return what makes empty figures that ``matplotlib.pyplot.show()`` and notebooks show.

    A notebook makes pyplot interactive when its backend is loaded. That is done here, for the end of ``article`` would take the
    setting back, and no further figure would be shown.
    """
    import matplotlib.pyplot as plt

    plt.draw_if_interactive()  # type: ignore[no-untyped-call]  # loads the backend
    return lambda width, height, layout: plt.figure(figsize=(width, height), layout=layout)


@contextmanager
def axes_for(ax: Any, width: float, height: float, new: NewFigure) -> Iterator[Axes]:
    """Lend the reader's axes ``ax`` under the reader's settings; if None, those of a new figure, in inches, in our style.

    Raises ``InvalidInput`` where ``ax`` is something else.
    """
    if ax is not None:
        yield checked_axes(ax)
        return
    with article():
        figure = new(width, height, "constrained")
        yield figure.add_subplot()


@contextmanager
def panels_for(ax: Any, count: int, width: float, height: float, new: NewFigure) -> Iterator[list[Axes]]:
    """Lend the reader's ``count`` axes, as one or a sequence; if None, those of a new figure one above the other.

    ``height`` is that of one. Raises ``InvalidInput`` where ``ax`` is something else.
    """
    if ax is not None:
        given = list(np.ravel(np.array(ax, dtype=object)))
        if len(given) != count:
            raise InvalidInput(f"ax holds {len(given)} axes; {count} are wanted, as from subplots({count}).")
        yield [checked_axes(one) for one in given]
        return
    with article():
        figure = new(width, height * count, "constrained")
        yield list(figure.subplots(count, sharex=True, squeeze=False)[:, 0])


def checked_axes(ax: Any) -> Axes:
    """Return axes of a plane, or say what is wanted."""
    from matplotlib.axes import Axes

    checks.instance("ax", ax, Axes, "axes of Matplotlib, as from matplotlib.pyplot.subplots()")
    if ax.name != "rectilinear":
        raise InvalidInput(
            f"ax is of the projection {ax.name!r}; give plain axes: what lies in space is drawn on them as seen by a camera."
        )
    return ax  # type: ignore[no-any-return]


def settle(ax: Axes) -> None:
    """Let the layout of the figure, where it has one, place the axes before their size is read; makes the ticks, too."""
    figure = ax.get_figure(root=True)
    engine = figure.get_layout_engine()  # type: ignore[union-attr]
    if engine is not None:
        engine.execute(figure)  # type: ignore[arg-type]


def size_of(ax: Axes) -> Any:
    """Return width and height of the axes in inches."""
    return np.array(ax.get_position(original=True).size) * ax.get_figure(root=True).get_size_inches()  # type: ignore[union-attr]


def legend_on_top(ax: Axes, kept: float = 0.0) -> None:
    """Write the legend in the settled axes' upper edge and make room for it above the data; ``kept`` inches are free there.

    It has as few rows as fit; small axes get small letters.
    """
    entries = ax.get_legend_handles_labels()
    plain: dict[str, Any] = {}
    small: dict[str, Any] = {"fontsize": "small", "handlelength": 1.8, "columnspacing": 1.0, "labelspacing": 0.2}
    for columns, look in [(len(entries[1]), plain), *((n, small) for n in range(len(entries[1]), 0, -1))]:
        legend = ax.legend(*entries, loc="upper center", ncols=columns, borderaxespad=0.2, **look)
        box = legend.get_window_extent()
        if box.width <= 0.96 * ax.bbox.width:
            break
    dpi = ax.get_figure(root=True).dpi  # type: ignore[union-attr]
    share = float(np.clip((1.06 * box.height - kept * dpi) / ax.bbox.height, 0.0, 0.7))
    low, high = ax.get_ylim()
    ax.set_ylim(low, low + (high - low) / (1.0 - share))
    if ax.get_aspect() != "auto":
        left, right = ax.get_xlim()
        wider = 0.5 * (right - left) * share / (1.0 - share)
        ax.set_xlim(left - wider, right + wider)


def save(figure: Figure, folder: Path, stem: str, dpi: float = 200.0) -> None:
    """Write the figure as ``stem``.png and ``stem``.svg into the folder, in our style and without the date."""
    with article():
        with files.replacing(folder / f"{stem}.png") as temporary:
            figure.savefig(temporary, dpi=dpi)
        with files.replacing(folder / f"{stem}.svg") as temporary:
            figure.savefig(temporary, metadata={"Date": None})


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
