"""The pictures of a result by their words, as `darboux plot --what` names them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from darboux import checks
from darboux.solution import EquilibriumSolution
from darboux.trajectory import Trajectory
from darboux.view import fields, motion, shapes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

OF_SHAPES = ("shape", *fields.FIELDS, "fields")
OF_MOTIONS = ("motion", "shape", "tip", "energy")


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
