"""The pictures of a result: as its own methods draw them, and by the words of `darboux plot --what`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from darboux import checks
from darboux.comparison import Comparison
from darboux.solution import EquilibriumSolution
from darboux.trajectory import Trajectory
from darboux.view import fields, motion, shapes, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

OF_SHAPES = ("shape", *fields.FIELDS, "fields")
OF_MOTIONS = ("motion", "shape", "tip", "energy")
PLOTS: dict[type, Callable[..., Any]] = {
    EquilibriumSolution: shapes.shape,
    Comparison: shapes.comparison,
    Trajectory: motion.motion,
}


def plot(result: EquilibriumSolution | Comparison | Trajectory, **options: Any) -> Axes | list[Axes]:
    """Draw a result on the reader's axes or on a new figure of ``pyplot``'s: its ``plot``."""
    draw_it = next(function for kind, function in PLOTS.items() if isinstance(result, kind))
    return draw_it(result, **options, new=style.shown_figure())  # type: ignore[no-any-return]


def plot_fields(solution: EquilibriumSolution, names: Sequence[str], ax: Any) -> list[Axes]:
    """Draw fields of a solution on the reader's axes or on a new figure of ``pyplot``'s: its ``plot_fields``."""
    return fields.fields(solution, names, ax, style.shown_figure())


def draw(result: EquilibriumSolution | Trajectory, what: str | None = None) -> Figure:
    """Return a figure of a solution (one of ``OF_SHAPES``) or a trajectory (one of ``OF_MOTIONS``); None: the first of them.

    Raises ``InvalidInput`` for another word.
    """
    if isinstance(result, Trajectory):
        name = checks.choice("--what", OF_MOTIONS[0] if what is None else what, OF_MOTIONS)
        made = motion.motion(result, {"motion": "all", "shape": "shapes"}.get(name, name))
        return (made[0] if isinstance(made, list) else made).get_figure(root=True)  # type: ignore[return-value]
    name = checks.choice("--what", OF_SHAPES[0] if what is None else what, OF_SHAPES)
    if name == "shape":
        return shapes.shape(result).get_figure(root=True)  # type: ignore[return-value]
    return fields.fields(result, () if name == "fields" else (name,))[0].get_figure(root=True)  # type: ignore[return-value]
