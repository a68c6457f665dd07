"""The equilibrium that starts at one load factor, followed while all loads and displacements grow: to load factor 1, or to its end.

A predictor by two tangents, Newton's corrector, a step that is chosen by how far the rod turns; on the way the mesh is laid
anew where it leaves out too much. What is followed is an affine law c + lambda c' of the coefficients, and poses that move evenly.

The path is a machine of few phases, each a function below. It returns to Python where something is asked of it, and goes on
when it is called again.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux.kernels import step_control as control
from darboux.kernels.algebra import dot, quaternion, rotation, unrotate, vector
from darboux.kernels.collocation import SHAPED, advance
from darboux.kernels.element import LINE
from darboux.kernels.jit import allocating, inline, jit
from darboux.kernels.mesh import lay, lay_on, roughness
from darboux.kernels.newton import CONVERGED, LOADS, LOST, SIGN, STEPS, TANGENT_TURN, TURNED, Work, begin, newton
from darboux.kernels.profile import Profile, columns, evaluate, piece_at
from darboux.kernels.rod_equations import COUPLING, FORCE, MOMENT, ROTATION, SINV, STATES, WIDTH
from darboux.kernels.stability import unstable_directions
from darboux.kernels.support import NUMBERS, WAY, pose
from darboux.kernels.system import FREE, ROW, SIDES, System

Array = NDArray[np.float64]

WANTED = 0.1  # of the roughness that is allowed: that of a mesh that is laid anew
MOST_ITERATIONS = 8
FEWEST_ELEMENTS, MOST_ELEMENTS = 8, 20_000
LARGEST_POWER = 3.0  # of the load, with which a tangent is taken to go

# Why `follow` returns: load factor 1, an end, so many steps, loads that are functions of the shape are wanted at the states of the
# mesh ASKED, stability changes (the mesh TRIED is behind that), the arrays are too small for WISHED elements.
ARRIVED, ENDED, PAUSED, LOADS_WANTED, CROSSED, TOO_SMALL, GO_ON = range(7)


class Rod(NamedTuple):
    """A rod in numbers: what holds and loads it, affine in the load factor."""

    breaks: Array  # of the table
    base: Array  # (p, degree + 1, columns), the coefficients at load factor 0
    rate: Array  # their derivative by the load factor
    degree: int
    ways: Array  # (supports, WAY), how the poses move
    cuts: Array  # places that stay nodes
    stages: int  # of an element
    tolerance: float  # of what Newton's method leaves over on the way
    roughness: float  # of the polynomials on the way; where they leave out more the mesh is laid anew
    rounding: float  # of n: what a rounded place makes of EA
    unseen: float  # rad by which the corrector may always turn the rod
    stretches: bool
    counts: bool  # whether the unstable directions are counted


class Nodes(NamedTuple):
    """A mesh with room to grow."""

    x: Array
    y: Array
    Y: Array


class Course(NamedTuple):
    """What the path writes: three meshes, and what it keeps between two calls. `room` elements have a place in each array."""

    room: int
    here: Nodes  # the last equilibrium
    tried: Nodes  # the next one
    laid: Nodes  # that on a better mesh
    tangent: Array  # of `here` by the load factor
    last_tangent: Array  # of the equilibrium before it, on the same nodes
    next_tangent: Array
    work: Work
    table: Array  # the coefficients at the load factor of now
    supports: Array  # (supports, NUMBERS), likewise
    shaped_here: Array  # loads that are functions of the shape, or none
    shaped: Array
    real: Array  # (REALS,)
    whole: NDArray[np.int64]  # (WHOLES,)


# What is kept in `real`: the load factor, the one that is tried, the next step, the first one, the tangent's turn and the tried
# mesh's, by how much the corrector turned the rod, the determinant's signs, the load factor of table and supports.
# LAST: that of the equilibrium before, or not a number.
FACTOR, GOAL, STEP, FIRST, TURN, NEXT_TURN, CORRECTED, SIGN_HERE, NEXT_SIGN, LOADED, LAST, REALS = range(12)
# ... and in `whole`: the phase, how many elements each mesh has, steps, rejected ones, Newton's iterations, the unstable directions
# (UNCOUNTED: not known) here and there, which mesh is asked about, how many elements are wished for.
PHASE, HERE, TRIED, LAID, TAKEN, REJECTED, ITERATIONS, INDEX, NEXT_INDEX, ASKED, WISHED, WHOLES = range(12)
UNCOUNTED = -1

BEGINNING, PREDICTING, AGAIN, CORRECTING, LAYING, SETTLING, JUDGING, ACCEPTING = range(8)


@jit
def load(rod: Rod, load_factor: float, table: Array, supports: Array) -> None:
    """Write the coefficients and the supports' numbers at a load factor."""
    for k in range(table.size):
        table[k] = rod.base[k] + load_factor * rod.rate[k]
    for i in range(supports.size // NUMBERS):
        pose(rod.ways[i * WAY : (i + 1) * WAY], load_factor, supports[i * NUMBERS : (i + 1) * NUMBERS])


@allocating
def _system(rod: Rod, course: Course, nodes: Nodes, elements: int, shaped: Array, load_factor: float) -> System:
    """The system of a mesh at a load factor."""
    if course.real[LOADED] != load_factor:
        load(rod, load_factor, course.table, course.supports)
        course.real[LOADED] = load_factor
    return System(
        rod.stages,
        nodes.x[: elements + 1],
        nodes.y[: (elements + 1) * STATES],
        nodes.Y[: elements * rod.stages * STATES],
        Profile(rod.breaks, course.table, rod.degree),
        Profile(rod.breaks, rod.rate, rod.degree),
        shaped[: elements * rod.stages * SHAPED],
        load_factor,
    )


@allocating
def _work(rod: Rod, course: Course, elements: int) -> Work:
    """The work of Newton's method on so many elements."""
    work = course.work
    return Work(
        work.factors[: elements * FREE * ROW],
        work.last,
        work.delta[: (elements + 1) * FREE * SIDES],
        work.steps[: elements * 4 * rod.stages * LINE],
        work.y[: (elements + 1) * STATES],
        work.Y[: elements * rod.stages * STATES],
        work.transfer[: elements * FREE * FREE],
        work.kept,
    )


@allocating
def _copy(source: Nodes, target: Nodes, elements: int, stages: int) -> None:
    target.x[: elements + 1] = source.x[: elements + 1]
    target.y[: (elements + 1) * STATES] = source.y[: (elements + 1) * STATES]
    target.Y[: elements * stages * STATES] = source.Y[: elements * stages * STATES]


@jit
def _floor(rod: Rod, nodes: Nodes, elements: int) -> float:
    """Return what rounding makes of the length of Newton's step."""
    largest = 0.0
    if rod.rounding > 0.0:
        for i in range(elements + 1):
            for a in range(FORCE, MOMENT):
                largest = max(largest, abs(nodes.y[i * STATES + a]))
    return rod.rounding / (1.0 + largest)


@allocating
def flattest(table: Profile, x: Array, y: Array) -> float:
    """Return the least stretch v3 = 1 + (S^-1 R^T n + D^T R^T m)_3 at the nodes x (N + 1,) with the states y (N + 1, 13) flat."""
    c, least = np.empty(columns(table)), np.inf
    for i in range(x.size):
        evaluate(table, piece_at(table.breaks, x[i]), x[i], c)
        R = rotation(quaternion(y, i * STATES + ROTATION))
        n, m = unrotate(R, vector(y, i * STATES + FORCE)), unrotate(R, vector(y, i * STATES + MOMENT))
        v3 = 1.0 + c[SINV + 4] * n[0] + c[SINV + 3] * n[1] + c[SINV + 2] * n[2]
        if c.size > WIDTH:
            v3 += dot((c[COUPLING + 2], c[COUPLING + 5], c[COUPLING + 8]), m)
        least = min(least, v3)
    return least


@allocating
def _counted(rod: Rod, course: Course, system: System) -> int:
    """The unstable directions of an equilibrium: with the transfers before Newton's last step, where these are kept."""
    if not rod.counts:
        return UNCOUNTED
    return unstable_directions(system, course.supports, not rod.stretches, course.work.transfer)


@jit
def _keep_tangent(course: Course, tangent: Array, elements: int) -> None:
    for k in range((elements + 1) * FREE):
        tangent[k] = course.work.delta[k * SIDES + 1]


@allocating
def _begin(rod: Rod, course: Course) -> int:
    """Find the tangent and the stability of the first equilibrium."""
    real, whole, kept = course.real, course.whole, course.work.kept
    system = _system(rod, course, course.here, whole[HERE], course.shaped_here, real[FACTOR])
    begin(course.work)
    reason = newton(system, course.supports, _work(rod, course, whole[HERE]), np.inf, 0.0, 0)
    whole[ITERATIONS] += 1
    real[SIGN_HERE], real[TURN] = kept[SIGN], kept[TANGENT_TURN] if reason == CONVERGED else np.inf
    _keep_tangent(course, course.tangent, whole[HERE])
    whole[INDEX] = _counted(rod, course, system)
    real[STEP], real[LAST] = control.LARGEST_STEP, np.nan
    whole[PHASE] = PREDICTING
    return GO_ON


@jit
def _choose_step(course: Course) -> int:
    """Let no section turn too far in a step from the last equilibrium, or in one after a step that was rejected."""
    real, whole = course.real, course.whole
    tries = whole[TAKEN] + whole[REJECTED]
    if whole[PHASE] == PREDICTING:
        if real[FACTOR] >= 1.0:
            return ARRIVED
        if tries >= control.MOST_STEPS or not np.isfinite(real[TURN]):
            return ENDED
        turn = control.LARGEST_TURN_BY_TWO if np.isfinite(real[LAST]) else control.LARGEST_PREDICTED_TURN
        largest = min(control.LARGEST_STEP, turn / max(real[TURN], 1e-300))
        real[STEP] = min(real[STEP], largest, 1.0 - real[FACTOR])
        real[FIRST] = real[STEP] if whole[TAKEN] == 0 else real[FIRST]
    elif real[STEP] < control.SMALLEST_STEP * max(real[FACTOR], real[FIRST]):
        return ENDED
    last = real[STEP] >= (1.0 - real[FACTOR]) * (1.0 - 1e-12)
    real[GOAL] = 1.0 if last else real[FACTOR] + real[STEP]
    return GO_ON


@inline
def _span(p: float, a: float, b: float) -> float:
    """The integral of x^p from a to b."""
    q = p + 1.0
    value: float = np.log(b / a) if abs(q) < 1e-6 else (b**q - a**q) / q
    return value


@inline
def _shares(real: Array, length: float, last_length: float) -> tuple[float, float]:
    """How much of the last tangent, of this length, and of the one before a prediction takes.

    Adams' and Bashforth's method of second order in a variable v along which the tangent keeps its length:

        y(v2) - y(v1) = (v2 - v1) ((1 + w) dy/dv(v1) - w dy/dv(v0)),     w = (v2 - v1) / 2 (v1 - v0)

    with dv = x^p d lambda and x = (lambda + lambda_1) / (lambda(v1) + lambda_1); lambda_1 is the first step. So what goes with the
    load itself is predicted exactly, p = 0, and what goes with a power of the load nearly so.
    """
    if not np.isfinite(real[LAST]) or length == 0.0 or last_length == 0.0:
        return real[GOAL] - real[FACTOR], 0.0
    here = real[FACTOR] + real[FIRST]
    before, ahead = (real[LAST] + real[FIRST]) / here, (real[GOAL] + real[FIRST]) / here
    p = min(max(np.log(last_length / length) / np.log(before), -LARGEST_POWER), LARGEST_POWER)
    v = _span(p, 1.0, ahead)
    w = 0.5 * v / _span(p, before, 1.0)
    return here * v * (1.0 + w), -here * v * w / before**p


@inline
def _length(tangent: Array, elements: int, part: int) -> float:
    """The length of a part of the tangent: of dr, phi, dn or dm at all nodes."""
    square = 0.0
    for i in range(elements + 1):
        for k in range(i * FREE + part, i * FREE + part + 3):
            square += tangent[k] ** 2
    return float(np.sqrt(square))


@allocating
def _predict(rod: Rod, course: Course) -> int:
    """Move the last equilibrium along its tangent and the one before."""
    reason = _choose_step(course)
    if reason != GO_ON:
        return reason
    real, whole = course.real, course.whole
    elements, ahead = whole[HERE], real[GOAL] - real[FACTOR]
    system = _system(rod, course, course.here, elements, course.shaped_here, real[FACTOR])
    work = _work(rod, course, elements)
    for part in range(0, FREE, 3):
        length, last_length = _length(course.tangent, elements, part), _length(course.last_tangent, elements, part)
        share, last_share = _shares(real, length, last_length)
        for i in range(elements + 1):
            for k in range(i * FREE + part, i * FREE + part + 3):
                work.delta[k * SIDES] = share * course.tangent[k]
                if last_share != 0.0:
                    work.delta[k * SIDES] += last_share * course.last_tangent[k]
    tried = course.tried
    tried.x[: elements + 1] = system.x
    advance(system, work.delta, ahead, 1.0, work.steps[:0], tried.y[: system.y.size], tried.Y[: system.Y.size])
    begin(course.work)
    whole[TRIED], whole[PHASE], whole[ASKED] = elements, CORRECTING, TRIED
    return LOADS_WANTED if course.shaped.size > 0 else GO_ON


@jit
def _reject(course: Course, part: float) -> int:
    """Try a shorter step."""
    course.real[STEP] = part * (course.real[GOAL] - course.real[FACTOR])
    course.whole[REJECTED] += 1
    course.whole[PHASE] = AGAIN
    return GO_ON


@allocating
def _correct(rod: Rod, course: Course) -> int:
    """Let Newton's method find the equilibrium, and see whether it is on the same branch and the mesh still good."""
    real, whole, kept, elements = course.real, course.whole, course.work.kept, course.whole[TRIED]
    system = _system(rod, course, course.tried, elements, course.shaped, real[GOAL])
    before = kept[STEPS]
    floor = _floor(rod, course.tried, elements)
    reason = newton(system, course.supports, _work(rod, course, elements), rod.tolerance, floor, MOST_ITERATIONS)
    whole[ITERATIONS] += int(kept[STEPS] - before)
    if reason == LOADS:
        return LOADS_WANTED
    if reason == LOST or (rod.stretches and not flattest(system.table, system.x, system.y) > 0.0):
        return _reject(course, control.LOST)
    real[CORRECTED], real[NEXT_SIGN], real[NEXT_TURN] = kept[TURNED], kept[SIGN], kept[TANGENT_TURN]
    if real[CORRECTED] > control.allowed(real[TURN] * (real[GOAL] - real[FACTOR]), rod.unseen):
        return _reject(course, control.REJECTED)
    _keep_tangent(course, course.next_tangent, elements)
    rough = _rough(rod, course)
    largest, wanted = 0.0, 0.0
    for part in rough:
        largest = max(largest, part)
        wanted += (part / (WANTED * rod.roughness)) ** (1.0 / (rod.stages + 1))
    whole[PHASE] = JUDGING
    if largest > rod.roughness and rough.size < MOST_ELEMENTS:
        whole[WISHED] = min(max(FEWEST_ELEMENTS, int(wanted) + 1, rough.size), 3 * rough.size)
        whole[PHASE] = LAYING
    return GO_ON


@allocating
def _rough(rod: Rod, course: Course) -> Array:
    """What the polynomials of the tried mesh leave out, for each element with a width."""
    elements, tried = course.whole[TRIED], course.tried
    wide = 0
    for i in range(elements):
        wide += 1 if tried.x[i + 1] > tried.x[i] else 0
    rough = np.empty(wide)
    y, Y = tried.y[: (elements + 1) * STATES], tried.Y[: elements * rod.stages * STATES]
    roughness(tried.x[: elements + 1], y, Y, rod.stages, rod.cuts, rough)
    return rough


@allocating
def _lay(rod: Rod, course: Course) -> int:
    """Lay a better mesh for the tried equilibrium."""
    whole, tried, laid, elements = course.whole, course.tried, course.laid, course.whole[TRIED]
    joints = course.supports.size // NUMBERS - 2
    if whole[WISHED] + 2 * rod.cuts.size + joints + 2 > course.room:
        return TOO_SMALL
    share = _rough(rod, course) ** (1.0 / (rod.stages + 1))
    x, nodes = np.empty(share.size + 1), np.empty(whole[WISHED] + 2 * rod.cuts.size + 2)
    wide = 0
    for i in range(elements + 1):
        if i == elements or tried.x[i + 1] > tried.x[i]:
            x[wide] = tried.x[i]
            wide += 1
    count, k, old = lay(x, share, whole[WISHED], rod.cuts, nodes), 0, 0
    for i in range(count):
        laid.x[k] = nodes[i]
        k += 1
        while old < elements and tried.x[old] < nodes[i]:
            old += 1
        if old < elements and tried.x[old] == nodes[i] and tried.x[old + 1] == nodes[i]:
            laid.x[k] = nodes[i]
            k += 1
    whole[LAID] = k - 1
    y, Y = tried.y[: (elements + 1) * STATES], tried.Y[: elements * rod.stages * STATES]
    y_new, Y_new = laid.y[: k * STATES], laid.Y[: (k - 1) * rod.stages * STATES]
    lay_on(tried.x[: elements + 1], y, Y, rod.stages, laid.x[:k], y_new, Y_new, rod.stages)
    begin(course.work)
    whole[PHASE], whole[ASKED] = SETTLING, LAID
    return LOADS_WANTED if course.shaped.size > 0 else GO_ON


@allocating
def _settle(rod: Rod, course: Course) -> int:
    """Solve on the better mesh; where that does not contract the old one serves."""
    real, whole, kept, elements = course.real, course.whole, course.work.kept, course.whole[LAID]
    system = _system(rod, course, course.laid, elements, course.shaped, real[GOAL])
    before, floor = kept[STEPS], _floor(rod, course.laid, elements)
    reason = newton(system, course.supports, _work(rod, course, elements), rod.tolerance, floor, MOST_ITERATIONS)
    whole[ITERATIONS] += int(kept[STEPS] - before)
    if reason == LOADS:
        return LOADS_WANTED
    whole[PHASE] = JUDGING
    if reason == CONVERGED and not (rod.stretches and not flattest(system.table, system.x, system.y) > 0.0):
        _copy(course.laid, course.tried, elements, rod.stages)
        whole[TRIED], real[NEXT_TURN] = elements, kept[TANGENT_TURN]
        _keep_tangent(course, course.next_tangent, elements)
    elif course.shaped.size > 0:
        whole[ASKED] = TRIED
        return LOADS_WANTED
    return GO_ON


@allocating
def _judge(rod: Rod, course: Course) -> int:
    """Count the unstable directions; a change of stability counts once the step is short."""
    real, whole = course.real, course.whole
    system = _system(rod, course, course.tried, whole[TRIED], course.shaped, real[GOAL])
    whole[NEXT_INDEX] = _counted(rod, course, system)
    if rod.counts:
        changed = whole[NEXT_INDEX] != whole[INDEX]
    else:
        changed = real[NEXT_SIGN] * real[SIGN_HERE] < 0.0
    shortest = control.LATER_CROSSING_STEP if whole[INDEX] > 0 else control.CROSSING_STEP
    if changed and real[GOAL] - real[FACTOR] > shortest:
        return _reject(course, control.REJECTED)
    whole[PHASE] = ACCEPTING
    return CROSSED if changed else GO_ON


@jit
def _keep_last_tangent(course: Course) -> None:
    """Write the tangent of the last equilibrium on the nodes of the tried mesh: between two of its own, their mean by distance."""
    old, new, elements, i = course.here.x, course.tried.x, course.whole[HERE], 0
    for k in range(course.whole[TRIED] + 1):
        if k > 0 and new[k] == new[k - 1]:  # behind a joint
            i, part = i + 1, 1.0
        else:
            while i < elements - 1 and old[i + 1] < new[k]:
                i += 1
            part = (new[k] - old[i]) / (old[i + 1] - old[i])
        for a in range(FREE):
            before, behind = course.tangent[i * FREE + a], course.tangent[(i + 1) * FREE + a]
            course.last_tangent[k * FREE + a] = before + part * (behind - before)


@allocating
def _accept(rod: Rod, course: Course) -> int:
    """Take the step, and choose the next one."""
    real, whole, elements = course.real, course.whole, course.whole[TRIED]
    _keep_last_tangent(course)
    _copy(course.tried, course.here, elements, rod.stages)
    course.tangent[: (elements + 1) * FREE] = course.next_tangent[: (elements + 1) * FREE]
    course.shaped_here[:] = course.shaped
    real[STEP] = (real[GOAL] - real[FACTOR]) * control.growth(
        real[TURN] * (real[GOAL] - real[FACTOR]), real[CORRECTED], rod.unseen, 2 if np.isfinite(real[LAST]) else 1
    )
    real[LAST] = real[FACTOR]
    real[FACTOR], real[TURN], real[SIGN_HERE] = real[GOAL], real[NEXT_TURN], real[NEXT_SIGN]
    whole[HERE], whole[INDEX], whole[PHASE] = elements, whole[NEXT_INDEX], PREDICTING
    whole[TAKEN] += 1
    if whole[TAKEN] > control.MECHANISM_STEPS and real[FACTOR] < control.MECHANISM_LOAD:
        return ENDED
    return GO_ON


@jit
def follow(rod: Rod, course: Course, most: int) -> int:
    """Go on along the path, for at most `most` tries; return why it stops for now."""
    phase, tries = course.whole, 0
    while True:
        if phase[PHASE] == BEGINNING:
            reason = _begin(rod, course)
        elif phase[PHASE] == PREDICTING or phase[PHASE] == AGAIN:
            if tries == most:
                return PAUSED
            tries += 1
            reason = _predict(rod, course)
        elif phase[PHASE] == CORRECTING:
            reason = _correct(rod, course)
        elif phase[PHASE] == LAYING:
            reason = _lay(rod, course)
        elif phase[PHASE] == SETTLING:
            reason = _settle(rod, course)
        elif phase[PHASE] == JUDGING:
            reason = _judge(rod, course)
        else:
            reason = _accept(rod, course)
        if reason != GO_ON:
            return reason
