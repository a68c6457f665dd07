"""The rod in space, as an element of a page: three.js in the browser, shapes from here."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import nicegui.elements.scene  # noqa: F401  # its three.js, under the name that rod_scene.js imports
import numpy as np
from nicegui.element import Element

from darboux.problem import Equilibrium
from darboux.web.shape import Outline, Shape

COMB = (0.1, 0.3, 0.5, 0.7, 0.9)  # of the length: where arrows of a load along the rod stand


class RodScene(Element, component="rod_scene.js"):
    """A view of a rod; ``on_received`` is called with the number of each frame that arrived, ``on_camera`` with the view."""

    def __init__(self, on_received: Callable[[int], None], on_camera: Callable[[tuple[float, ...]], None]) -> None:
        super().__init__()
        self.props["dark"] = False
        self._signs: Any = None
        self._size = math.inf
        self.on("received", lambda event: on_received(int(event.args)))
        self.on("camera", lambda event: on_camera(tuple(map(float, event.args))))

    def frame(
        self, number: int, shape: Shape, outline: Outline | None = None, unloaded: tuple[Shape | None] | None = None
    ) -> None:
        """Show a shape; the outline of its section, and faintly the unloaded rod or none, where these are new."""
        new = None if outline is None else outline.content
        still = None if unloaded is None else "" if unloaded[0] is None else unloaded[0].packed
        self.run_method("frame", number, shape.packed, new, still)

    def acting(self, problem: Equilibrium, size: float) -> None:
        """Show what holds and loads the rod, by signs that suit a picture of ``size`` m, where they are not there yet."""
        signs = glyphs(problem), corner(problem)
        if signs != self._signs or not 0.8 < size / self._size < 1.25:
            self._signs, self._size = signs, size
            self.run_method("acting", *signs, size)

    def others(self, shapes: Sequence[tuple[str, Shape]]) -> None:
        """Draw other answers, each in its colour, over the rod."""
        self.run_method("others", [{"colour": colour, "data": shape.packed} for colour, shape in shapes])

    def greyed(self, grey: bool) -> None:
        """Show whether the shape is an old one."""
        self.run_method("greyed", grey)

    def towards(self, shape: Shape) -> None:
        """Look at a new rod from a side from which it is seen best."""
        self.run_method("towards", best_side(shape))

    def seen(self, camera: tuple[float, ...]) -> None:
        """Look from where a link says."""
        self.run_method("seen", list(camera))

    def fit(self) -> None:
        """Show all of the rod."""
        self.run_method("fit")

    def picture(self, name: str, title: str) -> None:
        """Let the browser save what is seen as a PNG file."""
        self.run_method("picture", name, title)


def best_side(shape: Shape) -> list[float]:
    """Return the direction from which a shape is seen: across its plane, a little from above and from the side."""
    across = np.linalg.svd(shape.r - shape.r.mean(axis=0))[2]
    spread = np.ptp((shape.r - shape.r.mean(axis=0)) @ across.T, axis=0)
    normal = across[2] if spread[1] > 0.02 * spread[0] else np.cross(across[0], (0.0, 0.0, 1.0))
    if np.linalg.norm(normal) < 0.1:
        normal = np.array([0.0, -1.0, 0.0])
    level = normal * np.array([1.0, 1.0, 0.0])
    if np.linalg.norm(level) < 0.5 * np.linalg.norm(normal):  # it lies flat: look down on it
        return [0.25, -0.55, 0.8]
    level *= -np.sign(level[1] if abs(level[1]) > 0.3 * np.linalg.norm(level) else -level[0]) / np.linalg.norm(level)
    turned = np.array([level[0] * 0.94 - level[1] * 0.34, level[0] * 0.34 + level[1] * 0.94, 0.28])
    return [float(x) for x in turned / np.linalg.norm(turned)]


def glyphs(problem: Equilibrium) -> list[dict[str, Any]]:
    """Return what is drawn at the rod: its supports, and the loads at points and along it."""
    L = problem.rod.length
    found: list[dict[str, Any]] = []
    for s, support in problem.supports:
        at, held = s / L, all(support.held_displacement)
        if support.clamps:
            found.append({"kind": "clamp", "at": at, "follower": True})
        elif support.linear is not None or support.rotational is not None:
            found.append({"kind": "spring", "at": at, "follower": False})
        elif held:
            found.append({"kind": "pin", "at": at, "follower": False})
        else:
            axis = support.displacement_axes[:, 0]
            follower = support.sliding == "section"
            found.append({"kind": "slide", "at": at, "follower": follower, "vector": _unit(axis)})
    for load in problem.loads:
        force, moment = getattr(load, "force", None), getattr(load, "moment", None)
        place = getattr(load, "at", None)
        if place is None and isinstance(force, tuple) and any(force):
            follower = load.frame == "section"
            found += [_arrow("press", at, force, follower, 0.09, 0.7) for at in COMB]
        elif place is not None:
            at = {"start": 0.0, "end": 1.0}.get(place, place / L if isinstance(place, float) else 0.0)
            if force is not None and any(force):
                found.append(_arrow("force", at, force, load.follower, 0.17, 1.0))
            if moment is not None and any(moment):
                found.append(_arrow("moment", at, moment, load.follower, 0.17, 1.0))
    return found


def corner(problem: Equilibrium) -> list[dict[str, Any]]:
    """Return the directions that are drawn beside the axes: of gravity, a field, a rotation."""
    found = []
    for load in problem.loads:
        for name, letter in (("g", "g"), ("field", "E"), ("omega", "\N{GREEK SMALL LETTER OMEGA}")):
            vector = getattr(load, name, None)
            if vector is not None and any(vector):
                found.append({"letter": letter, "vector": _unit(vector)})
    return found


def _arrow(
    kind: str, at: float, vector: tuple[float, ...], follower: bool, size: float, width: float
) -> dict[str, Any]:
    return {"kind": kind, "at": at, "vector": _unit(vector), "follower": follower, "size": size, "width": width}


def _unit(vector: Any) -> list[float]:
    """Return a direction to four digits, so that signs are drawn anew only where they are seen to turn."""
    largest = max(abs(float(x)) for x in vector)
    scaled = [float(x) / largest for x in vector]
    return [round(x / math.hypot(*scaled), 4) for x in scaled]
