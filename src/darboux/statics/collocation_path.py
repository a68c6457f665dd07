"""The path of collocation from the unloaded rod, by the kernel `path`, and past a bifurcation."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from darboux.kernels import newton
from darboux.kernels import path as kernel
from darboux.kernels.collocation import SHAPED
from darboux.kernels.path import Course, Nodes
from darboux.kernels.rod_equations import STATES
from darboux.kernels.step_control import LARGEST_CORRECTED_TURN
from darboux.kernels.system import FREE
from darboux.packing.coefficients import Table
from darboux.statics.collocation_equations import QUICK, Equations
from darboux.statics.load_path import UNSEEN_TURN, Path, Stopped, look
from darboux.statics.mesh import Mesh

Array = NDArray[np.float64]

TRIES = 4000  # steps in the kernel between two looks for Ctrl-C, over the number of elements
DISTURBANCE = 0.1  # of EI / L^2, spread along the unstable mode
MOST_DISTURBANCES = 3
SMALLEST_MODE = 1e-8  # of displacements, over 1 for all of them together
SMALLEST_RELIEF = 1e-3  # of the disturbance that is taken off in a step


def follow(
    equations: Equations,
    mesh: Mesh,
    until_unstable: bool = False,
    *,
    begin: float = 0.0,
    unseen: float = UNSEEN_TURN,
) -> Path[Mesh]:
    """Follow the branch from the load factor ``begin``, where the mesh holds an equilibrium, to 1 or to where it ends.

    With ``until_unstable`` it is followed to its first crossing at most; ``unseen`` rad are what the corrector may always turn the
    rod by. Raises ``Stopped`` on Ctrl-C.
    """
    law, shaped = equations.law, bool(equations.problem.of_shape)
    ways = np.concatenate([conditions.way for conditions in equations.conditions])
    numbers = (law.breaks, law.base.ravel(), law.rate.ravel(), law.degree, ways, equations.breaks)
    rod = kernel.Rod(
        *numbers, *equations.pace, equations.rounding, unseen, equations.problem.rod.stretch, equations.has_potential
    )
    room = 4 * len(mesh.x) + 3 * len(equations.breaks)
    course = _course(room, equations.pace.stages, law.base.size, equations.supports(begin), shaped)
    _write(course.here, mesh)
    course.whole[kernel.HERE] = len(mesh.x) - 1
    course.real[kernel.LOADED], course.real[kernel.FACTOR] = np.nan, begin
    if shaped:
        course.shaped_here[: mesh.Y.size // STATES * SHAPED] = equations.shaped(mesh)
    path = Path(mesh, begin)
    try:
        while (reason := kernel.follow(rod, course, max(1, TRIES // course.room))) not in (
            kernel.ARRIVED,
            kernel.ENDED,
        ):
            look()
            if reason == kernel.LOADS_WANTED:
                asked = _asked(course)
                course.shaped[: asked.Y.size // STATES * SHAPED] = equations.shaped(asked)
            elif reason == kernel.TOO_SMALL:
                course = _with_room(course, 2 * int(course.whole[kernel.WISHED]) + 3 * len(equations.breaks) + 4)
            elif reason == kernel.CROSSED:
                goal = float(course.real[kernel.GOAL])
                path.crossings.append((float(course.real[kernel.FACTOR]), goal))
                path.unstable = path.unstable or (_mesh(course.tried, course.whole[kernel.TRIED]), goal)
                if until_unstable and course.whole[kernel.NEXT_INDEX] > 0:
                    break
    except KeyboardInterrupt:
        _read(course, path)
        raise Stopped(equations, path) from None
    _read(course, path)
    equations.iterations += path.iterations
    return path


def buckled(equations: Equations, path: Path[Mesh]) -> tuple[Path[Mesh] | None, Path[Mesh]]:
    """Return the stable side of a bifurcation, or None, and the disturbed path.

    That is the path with a small load along the unstable mode, which is then taken off.
    """
    disturbed, modes = path, []
    for _ in range(MOST_DISTURBANCES):
        if disturbed.unstable is None:
            break
        mesh, load_factor = disturbed.unstable
        mode = equations.second_variation(mesh, load_factor).lowest_mode()[:, :3]
        largest = float(np.max(np.abs(mode)))
        if largest < SMALLEST_MODE:  # a mode of twist alone, which no force stirs
            break
        from scipy.interpolate import CubicSpline  # slow to load, and seldom needed

        spline = CubicSpline(np.unique(mesh.x), DISTURBANCE / largest * mode)
        modes.append(Table(spline.x, np.ascontiguousarray(spline.c[::-1].transpose(1, 0, 2))))
        equations.disturb(modes)
        disturbed = follow(equations, equations.unloaded(), until_unstable=True)
    reached = disturbed.load_factor == 1.0 and disturbed.index == 0
    found = _undisturbed(equations, disturbed.state, modes) if reached else None
    equations.disturb(())
    if found is None or equations.index(found, 1.0) != 0:
        return None, disturbed
    return dataclasses.replace(disturbed, state=found, index=0, unstable=None), disturbed


def _undisturbed(equations: Equations, mesh: Mesh, modes: list[Table]) -> Mesh | None:
    """Take the disturbance off at full load, in steps that Newton's method follows."""
    left, step = 1.0, 0.5
    while left > 0.0:
        goal = max(0.0, left - step)
        equations.disturb([Table(mode.breaks, goal * mode.coefficients) for mode in modes])
        found = equations.newton(mesh, 1.0, equations.pace.tolerance, most=kernel.MOST_ITERATIONS)
        if found is None or found[2] > LARGEST_CORRECTED_TURN:
            step *= 0.5
            if step < SMALLEST_RELIEF:
                return None
            continue
        mesh, left, step = found[0], goal, 1.5 * step
    return mesh


def _course(room: int, stages: int, coefficients: int, supports: Array, shaped: bool) -> Course:
    """Return a course with room for so many elements, at its beginning."""

    def nodes() -> Nodes:
        return Nodes(np.empty(room + 1), np.empty((room + 1) * STATES), np.empty(room * stages * STATES))

    tangent, last_tangent, next_tangent = (np.empty((room + 1) * FREE) for _ in range(3))
    loads = room * stages * SHAPED if shaped else 0
    loaded = np.empty(coefficients), supports.copy(), np.empty(loads), np.empty(loads)
    kept = np.zeros(kernel.REALS), np.zeros(kernel.WHOLES, np.int64)
    return Course(
        room,
        nodes(),
        nodes(),
        nodes(),
        tangent,
        last_tangent,
        next_tangent,
        newton.new_work(room, stages, transfers=stages == QUICK.stages),
        *loaded,
        *kept,
    )


def _with_room(course: Course, room: int) -> Course:
    """Return the same course with room for more elements."""
    larger = _course(room, _stages(course), course.table.size, course.supports, course.shaped.size > 0)
    tangents = "tangent", "last_tangent", "next_tangent"
    pairs = [(getattr(course, name), getattr(larger, name)) for name in tangents]
    pairs += [(course.shaped_here, larger.shaped_here), (course.shaped, larger.shaped)]
    for old, new in ((course.here, larger.here), (course.tried, larger.tried)):
        pairs += list(zip(old, new, strict=True))
    for source, target in pairs:
        target[: source.size] = source
    return larger._replace(real=course.real, whole=course.whole, table=course.table)


def _stages(course: Course) -> int:
    return course.here.Y.size // (course.room * STATES)


def _write(nodes: Nodes, mesh: Mesh) -> None:
    for target, source in zip(nodes, (mesh.x, mesh.y, mesh.Y), strict=True):
        target[: source.size] = source.ravel()


def _mesh(nodes: Nodes, elements: int) -> Mesh:
    """Return a copy of the mesh that the nodes hold."""
    N, Y = int(elements), nodes.Y.size // (len(nodes.x) - 1)
    states = nodes.y[: (N + 1) * STATES].reshape(-1, STATES), nodes.Y[: N * Y].reshape(N, -1, STATES)
    return Mesh(nodes.x[: N + 1].copy(), *(part.copy() for part in states))


def _asked(course: Course) -> Mesh:
    """Return the mesh at whose states the kernel wants loads."""
    which = int(course.whole[kernel.ASKED])
    return _mesh(course.tried if which == kernel.TRIED else course.laid, course.whole[which])


def _read(course: Course, path: Path[Mesh]) -> None:
    """Write how far the course is into the path."""
    real, whole = course.real, course.whole
    path.state, path.load_factor = _mesh(course.here, whole[kernel.HERE]), float(real[kernel.FACTOR])
    path.steps, path.rejected = int(whole[kernel.TAKEN]), int(whole[kernel.REJECTED])
    path.iterations, path.slope = int(whole[kernel.ITERATIONS]), float(real[kernel.TURN])
    path.index = None if whole[kernel.INDEX] == kernel.UNCOUNTED else int(whole[kernel.INDEX])
