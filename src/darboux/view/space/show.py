"""Solutions and trajectories in space: which rods, marks and words a scene holds, from where it is seen, and where it is shown."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux import checks, files
from darboux.comparison import Comparison
from darboux.errors import InvalidInput
from darboux.loads import Gravity
from darboux.problem import Equilibrium
from darboux.solution import EquilibriumSolution
from darboux.trajectory import Trajectory
from darboux.view import prefix
from darboux.view.camera import Camera
from darboux.view.palette import BLUE, DIRECTORS, GREEN, GREY, ORANGE, SKY, VERMILION
from darboux.view.space import fields, marks, shape
from darboux.view.space.body import Body, Drawn, drawn
from darboux.view.space.fields import FIELDS
from darboux.view.space.shape import Shape
from darboux.view.space.solids import Solid, wire

Array = NDArray[np.float64]

ROD, GHOST = "#b9c7d6", "#aab4bd"
SEVERAL = (BLUE, VERMILION, GREEN, ORANGE, SKY, GREY)  # rods beside one another
MARK = 0.065  # a mark's length over the picture's extent
ASIDE, LOWEST, HIGHEST = 22.0, 16.0, 55.0  # degrees: of the view off the plane of the rod, and above the ground
PLAIN = "none"
DASHES, THIN = 8, 0.8  # of several rods: thick pieces along each, and the thickness between them
LARGEST = 8192  # pixels


@dataclass(frozen=True, eq=False)
class Subject:
    """One rod of a scene: its name, shape, problem, the factor of its loads, and whether an end is held."""

    name: str
    shape: Shape
    problem: Equilibrium
    factor: float = 1.0
    held: Callable[[str], bool] | None = None


@dataclass(frozen=True)
class Look:
    """What is shown: a field's name, "none" or None (a choice of ours), ghost, directors, thickness, azimuth and elevation."""

    field: str | None = None
    ghost: bool = False
    directors: bool = False
    thicker: float | None = None
    camera: Any = None

    def __post_init__(self) -> None:
        if self.field is not None:
            checks.choice("view.field", self.field, [*FIELDS, PLAIN])
        if self.thicker is not None:
            object.__setattr__(self, "thicker", checks.positive("view.thicker", self.thicker))
        if self.camera is not None:
            angles = checks.array("view.camera", self.camera, (2,), "degrees: azimuth, elevation")
            object.__setattr__(self, "camera", Camera(*angles.tolist()))


def view(
    result: Any,
    *,
    field: str | None = None,
    out: Any = None,
    t: float | None = None,
    beside: Any = None,
    ghost: bool = False,
    directors: bool = False,
    thicker: float | None = None,
    camera: Any = None,
    size: Any = (1200, 900),
    show: bool = True,
) -> Any:
    """Show a solution, a trajectory or a comparison in space: a window, or a PNG file off screen.

    Arguments: ``field`` colours the rod, one of ``fields.FIELDS``, or "none"; ``out`` a PNG file; ``t`` the time in s of a
    trajectory (else its last, with a slider in a window); ``beside`` other solutions by their names, {name: solution}; ``ghost``
    the unloaded shape too (in motion: the first); ``directors`` d1, d2, d3 as arrows; ``thicker`` how many times as thick the
    rod is drawn (else as much as it takes to be seen; the picture says it); ``camera`` azimuth and elevation in degrees;
    ``size`` in pixels; ``show`` False returns PyVista's ``Plotter`` before it opens its window.
    Raises ``InvalidInput``, also where there is no display for a window, or nothing that can draw.
    """
    width, height = _size(size)
    look = Look(field, ghost, directors, thicker, camera)
    if out is not None:
        staged(result, look, t, beside).write(checked_file(out), (width, height))
        return None
    if show and not _has_display():
        raise InvalidInput(
            "there is no display for a window; give a file, as in view(out='rod.png') or darboux view FILE --out rod.png."
        )
    plotter = pyvista().Plotter(window_size=[width, height], lighting="none")
    first = staged(result, look, t, beside)
    first.fill(plotter.renderer, (width, height))
    plotter.camera_set = True
    if isinstance(result, Trajectory) and t is None and len(result.times) > 1:
        _slider(plotter, result, look, beside, first)
    if show:
        plotter.show()
        return None
    return plotter


def checked_file(out: Any) -> Path:
    """Return the path of a picture, or raise ``InvalidInput`` where it is none that can be written."""
    path = Path(out)
    if path.suffix.lower() != ".png":
        raise InvalidInput(f"view.out is {str(path)!r}; a picture in space is a .png file.")
    files.check(path)
    return path


def staged(result: Any, look: Look, t: float | None = None, beside: Any = None, reach: Array | None = None) -> Any:
    """Return the ``Stage`` of a result at a time: rods, marks and words; ``reach`` (n, 3) points that it must show as well."""
    try:
        from darboux.view.space.overlay import Bar, Overlay
        from darboux.view.space.stage import Stage
    except ImportError:
        raise InvalidInput(NEEDED) from None

    subjects = _subjects(result, t, beside)
    if isinstance(result, Trajectory) and reach is None:
        reach = result.positions.reshape(-1, 3) if t is None or look.ghost else None
    behind = _ghosts(result, subjects, look)
    lines = np.concatenate(
        [*(x.shape.r for x in subjects), *(ghost.r for ghost in behind), *([] if reach is None else [reach])]
    )
    extent = float(np.linalg.norm(np.ptp(lines, axis=0)))
    camera = look.camera or _camera(lines)
    ways = [_drawn(x.shape, extent, look) for x in subjects]
    factor = max(way.factor for way in ways)
    ways = [way if not way.own else Drawn(way.section, factor, own=True) for way in ways]
    bodies = [
        Body.of(x.shape, way, _dashes(i, len(subjects))) for i, (x, way) in enumerate(zip(subjects, ways, strict=True))
    ]
    name, bar, span = _coloured(result, subjects, bodies, look)
    colours = (ROD,) if len(subjects) == 1 else SEVERAL
    solids = [body.solid(name, span, colours[i % len(colours)]) for i, body in enumerate(bodies)]
    solids += [Body.of(ghost, ways[0]).solid(None, span, GHOST, 0.3) for ghost in behind]

    thickness = max(
        float(np.max(np.linalg.norm(way.outline(x.shape.s[[0, -1]], bodies[0].p), axis=-1))) * 2.0
        for x, way in zip(subjects, ways, strict=True)
    )
    pen = marks.Marks(max(MARK * extent, 0.6 * thickness), thickness, camera.A[2])
    labels: list[marks.Label] = []
    for subject in subjects:
        solids += marks.supports(pen, subject.problem, subject.shape, subject.held)
    for subject in subjects[:1]:
        drawn_loads, labels = marks.loads(pen, subject.problem, subject.shape, subject.factor)
        solids += drawn_loads
    if look.directors:
        solids += [part for x in subjects for part in marks.directors(pen, x.shape, DIRECTORS)]
    if isinstance(result, Trajectory):
        solids += _path(result, extent)

    names: list[tuple[str, str | None]] = []
    if len(subjects) > 1:
        names += [(x.name, None if name else colours[i % len(colours)]) for i, x in enumerate(subjects)]
    elif subjects[0].name:
        names += [(subjects[0].name, None)]
    if look.directors:
        names += [(f"d{i}", colour) for i, colour in enumerate(DIRECTORS, start=1)]
    notes = list(dict.fromkeys(way.note for way in ways if way.note))
    gravity = [np.array(load.g) for load in subjects[0].problem.loads if isinstance(load, Gravity)]
    overlay = Overlay(
        Bar(bar[0], *bar[1]) if bar else None, names, notes, labels, np.sum(gravity, axis=0) if gravity else None
    )
    frame = np.concatenate([*(solid.points for solid in solids), *([] if reach is None else [reach])])
    return Stage(solids, overlay, camera, frame)


def _subjects(result: Any, t: float | None, beside: Any) -> list[Subject]:
    if isinstance(result, Trajectory):
        if beside is not None:
            raise InvalidInput("view.beside puts solutions beside a solution; a trajectory is shown alone.")
        motion, t = result.motion, float(result.times[-1]) if t is None else checks.number("view.t", t, "s")
        return [
            Subject(
                f"t = {t:.4g} s", shape.at(result, t), motion.problem, motion.factor(t), lambda at: motion.held(at, t)
            )
        ]
    if t is not None:
        raise InvalidInput("view.t is the time of a trajectory; an equilibrium has none.")
    if isinstance(result, Comparison):
        order = [result.entries[result.reference], *(x for i, x in enumerate(result.entries) if i != result.reference)]
        solutions = {entry.name: entry.solution for entry in order}
    else:
        solutions = {"": result}
    for name, other in _named(beside).items():
        solutions[str(name)] = checks.instance("view.beside", other, EquilibriumSolution, "solutions by their names")
    if len(solutions) > 1 and "" in solutions:
        solutions = {
            str(x.method) if name == "" and str(x.method) not in solutions else name or "this": x
            for name, x in solutions.items()
        }
    return [_subject(name, solution) for name, solution in solutions.items()]


def _named(beside: Any) -> dict[Any, Any]:
    if beside is None:
        return {}
    if isinstance(beside, dict):
        return beside
    raise InvalidInput(
        f"view.beside is {checks.shown(beside)}; it must be solutions by their names, as in {{'elastica': other}}."
    )


def _subject(name: str, solution: EquilibriumSolution) -> Subject:
    words = [name] if name else []
    if not solution.converged:
        words.append(f"not converged: at {100.0 * solution.load_factor:.3g} % of the load")
    return Subject(", ".join(words), shape.of(solution), solution.problem, solution.load_factor)


def _ghosts(result: Any, subjects: list[Subject], look: Look) -> list[Shape]:
    if not look.ghost:
        return []
    if isinstance(result, Trajectory):
        return [shape.at(result, float(result.times[0]))]
    return [shape.unloaded(subjects[0].problem)]


def _drawn(rod: Shape, extent: float, look: Look) -> Drawn:
    return drawn(rod.rod, extent, float(np.max(np.hypot(rod.k[:, 0], rod.k[:, 1]))), look.thicker)


def _dashes(i: int, count: int) -> Callable[[Array], Array] | None:
    """Return the thickness of the rod i along x = s / L: of several each is thick in turns, so that all are seen."""
    if count == 1:
        return None
    last = DASHES * count - 1
    return lambda x: np.where(np.minimum(np.floor(DASHES * count * x), last) % count == i, 1.0, THIN)


def _coloured(
    result: Any, subjects: list[Subject], bodies: list[Body], look: Look
) -> tuple[str | None, tuple[str, tuple[float, float]] | None, tuple[float, float]]:
    """Return the field that colours the rods (None: it does not), the title and ends of its bar, and its ends in SI."""
    name = look.field or ("curvature" if len(subjects) == 1 else PLAIN)
    if name == PLAIN:
        return None, None, (0.0, 1.0)
    for subject in subjects:
        known = fields.known(subject.shape)
        if name not in known:
            raise InvalidInput(f"view.field is {name!r}, which this result does not have; it has {', '.join(known)}.")
    values = [body.values(name) for body in bodies]
    if isinstance(result, Trajectory):  # one scale for all times
        some = result.times[np.linspace(0, len(result.times) - 1, 12).astype(int)]
        values += [fields.on_surface(name, shape.at(result, float(t)), bodies[0].p) for t in some]
    low, high = fields.span(values)
    unit, si = prefix.quantity(max(abs(low), abs(high)), FIELDS[name].unit)
    return name, (f"{FIELDS[name].words} ({unit})", (low / si, high / si)), (low, high)


def _path(trajectory: Trajectory, extent: float) -> list[Solid]:
    """Return the path of the tip as a thin line."""
    tip = trajectory.tip
    tip = tip[np.concatenate([[True], np.linalg.norm(np.diff(tip, axis=0), axis=1) > 1e-9 * extent])]
    return [wire(tip, 0.0015 * extent, GREY)] if len(tip) > 2 else []


def _camera(r: Array) -> Camera:
    """Return a camera that faces the plane in which the points (n, 3) lie best, a little from the side and from above."""
    _, sizes, axes = np.linalg.svd(r - r.mean(axis=0), full_matrices=False)
    if sizes[1] < 1e-3 * sizes[0]:  # straight
        normal = np.cross(axes[0], [0.0, 0.0, 1.0])
        normal = normal if np.linalg.norm(normal) > 0.1 else np.array([0.0, -1.0, 0.0])
    else:
        normal = axes[2]
    normal = normal / np.linalg.norm(normal)
    level = float(np.hypot(normal[0], normal[1]))
    if normal[2] < -0.3 or (abs(normal[2]) <= 0.3 and normal[1] > 1e-9 * level):
        normal = -normal
    azimuth = -90.0 if level < 0.3 else float(np.degrees(np.arctan2(normal[1], normal[0])))
    elevation = float(np.degrees(np.arcsin(np.clip(normal[2], -1.0, 1.0))))
    return Camera(azimuth + ASIDE, float(np.clip(elevation, LOWEST, HIGHEST)))


def _slider(plotter: Any, trajectory: Trajectory, look: Look, beside: Any, first: Any) -> None:
    """Put a slider of time into a window."""
    renderer = plotter.renderer
    state = {"actors": list(renderer.GetActors()), "overlay": first.overlay}
    reach = trajectory.positions.reshape(-1, 3)

    def redraw(t: float) -> None:
        now = staged(trajectory, look, float(np.clip(t, trajectory.times[0], trajectory.times[-1])), beside, reach)
        for actor in state["actors"]:
            renderer.RemoveActor(actor)
        state["actors"] = list(now.actors())
        for actor in state["actors"]:
            renderer.AddActor(actor)
        for name in ("names", "notes", "labels"):
            setattr(state["overlay"], name, getattr(now.overlay, name))

    plotter.add_slider_widget(
        redraw,
        rng=[float(trajectory.times[0]), float(trajectory.times[-1])],
        value=float(trajectory.times[-1]),
        title="time (s)",
        pointa=(0.3, 0.93),
        pointb=(0.7, 0.93),
        style="modern",
    )


def _size(size: Any) -> tuple[int, int]:
    width, height = checks.array("view.size", size, (2,), "pixels").tolist()
    if not (160 <= width <= LARGEST and 120 <= height <= LARGEST):
        raise InvalidInput(
            f"view.size is {checks.shown(size)}; it must lie between 160 x 120 and {LARGEST} x {LARGEST} pixels."
        )
    return int(width), int(height)


def _has_display() -> bool:
    """Return whether a window, or a notebook that shows one, can be had."""
    if sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        return True
    return "ipykernel" in sys.modules or bool(pyvista().OFF_SCREEN)


def pyvista() -> Any:
    """Return PyVista, or say how to install it."""
    try:
        import pyvista
    except ImportError:
        raise InvalidInput(NEEDED) from None
    return pyvista


NEEDED = 'pictures in space and their files need PyVista; install it by: pip install "darboux[view]".'
