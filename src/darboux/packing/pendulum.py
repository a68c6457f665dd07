"""How a rod that its joints leave free to turn hangs as a rigid body: where the smallest load takes it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.natural import smallest_rotation
from darboux.packing.laying import laid, placed
from darboux.problem import Equilibrium
from darboux.supports import Support

Array = NDArray[np.float64]
Work = Callable[[Array], float]  # of the loads, by a rotation Q (3, 3)

PLACES = 257  # at which a pendulum's loads are summed
STARTS, ALIGNMENTS = 8, 50  # of turns about several axes, one after the other
ALIGNED = 1e-9  # relative to the largest distance: a joint beside the common axis by less lies on it
NOTHING = 1e-12  # of the loads' largest moment: below this their sum is rounding
SAME_TURN = 1e-9  # rad


def origin(problem: Equilibrium) -> str:
    """Return in words where the load path of a problem begins."""
    if problem.closed:
        return "the round ring"
    if _hung(problem) is None:
        return "the unloaded rod"
    if len(problem.supports) == 1 or _common_axis(problem) is not None:
        return "the unloaded rod, hung from its joints"
    return "the unloaded rod, turned about the line through its supports to where its weight is lowest"


def at_rest(problem: Equilibrium) -> tuple[Support, float, Array]:
    """Return what `laid` does, but for a pendulum as it hangs: where the smallest load leaves it, and a path can begin."""
    support, place, lie = laid(problem)
    Q = _hung(problem)
    if Q is None:
        return support, place, lie
    return support, place, Q @ placed(problem, np.array([place * problem.rod.length]))[1][0]


def _hung(problem: Equilibrium) -> Array | None:
    """Return what `hanging` does under the rod's own loads, which are summed only where it can turn."""
    return None if _free_axes(problem) is None else hanging(problem, *_weights(problem))


def hanging(problem: Equilibrium, arms: Array, forces: Array, gradients: Array) -> Array | None:
    """Return the rotation Q (3, 3) by which a rod on joints hangs lowest as a rigid body; None where it does, or can't turn.

        sum of f.(Q a) + 1/2 (Q a).C (Q a) -> max

    ``arms`` a (n, 3) lead from the joint; dead ``forces`` f (n, 3), and ``gradients`` C (n, 3, 3) of those that grow with Q a. Of
    several such rotations it is the smallest. The rod turns about its only joint, or about the line on which all its ball joints
    and rollers lie; it is no pendulum where a spring against turning holds it too.
    """
    axes = _free_axes(problem)
    if axes is None:
        return None
    moments = np.einsum("ni,nj->nij", arms, forces)
    growing = np.einsum("nij,nk,nl->nikjl", gradients, arms, arms)
    N, K = np.sum(moments, axis=0), np.sum(growing, axis=0)
    nothing = NOTHING * float(np.sum(np.abs(moments)) + np.sum(np.abs(growing)))
    if max(np.max(np.abs(N)), np.max(np.abs(K))) <= nothing:
        return None

    def work(Q: Array) -> float:
        return float(np.sum(Q.T * N) + 0.5 * np.einsum("ik,ikjl,jl->", Q, K, Q))

    Q = _aligned(N) if len(axes) == 3 and np.max(np.abs(K)) <= nothing else _best(work, axes, nothing)
    return None if work(Q) - work(np.eye(3)) <= nothing else Q


def _weights(problem: Equilibrium) -> tuple[Array, Array, Array]:
    """Return arms (n, 3) in m from the support, the forces (n, 3) in N of loads there, and their gradients (n, 3, 3) in N/m.

    Along the rod by Simpson's rule.
    """
    s = np.linspace(0.0, problem.rod.length, PLACES)
    simpson = np.ones(PLACES)
    simpson[1:-1:2], simpson[2:-1:2] = 4.0, 2.0
    weights = simpson * s[1] / 3.0
    ends = [(s[0], problem.end_load("start")), (s[-1], problem.end_load("end"))]
    points = [*ends, *problem.points.items()]
    joint, loads = np.array(laid(problem)[0].position), problem.distributed(s)
    r, R = placed(problem, np.concatenate([s, [at for at, _ in points]]))
    forces = [(loads.a + loads.C @ joint) * weights[:, None], [load.force for _, load in points]]
    arms = [r - joint]
    for frame, (_, load) in zip(R[PLACES:], points, strict=True):  # tr(Q R A^T) of those that act off the centre
        arms.append(frame.T)
        forces.append(load.eccentric.T)
    gradients = np.zeros((sum(map(len, arms)), 3, 3))
    gradients[:PLACES] = loads.C * weights[:, None, None]
    return np.concatenate(arms), np.concatenate(forces), gradients


def _free_axes(problem: Equilibrium) -> Array | None:
    """Return the axes (k, 3) about which the supports let the rod turn as a whole, or None: it is no pendulum."""
    if problem.closed or problem.of_shape or any(at.rotational is not None for _, at in problem.supports):
        return None
    if len(problem.supports) == 1:
        axes = _axes_of_joint(problem.supports[0][1])
    else:
        axes = _common_axis(problem)
        axes = _line_of_places(problem) if axes is None else axes
    return axes


def _axes_of_joint(support: Support) -> Array | None:
    """Return the axes (k, 3) about which the only support lets the rod turn, or None."""
    placing = all(support.held_displacement) or support.linear is not None
    if not placing or all(support.held_rotation):
        return None
    return support.rotation_axes[:, ~np.array(support.held_rotation)].T


def _common_axis(problem: Equilibrium) -> Array | None:
    """Return the axis (1, 3) on which all ball joints lie and along which all rollers run, or None."""
    supports = [support for _, support in problem.supports]
    pins = [np.array(support.position) for support in supports if all(support.held_displacement)]
    rollers = [support for support in supports if sum(support.held_displacement) == 2 and support.sliding == "fixed"]
    turning = any(any(support.held_rotation) for support in supports)
    if not pins or len(pins) + len(rollers) < len(supports) or turning:
        return None
    along = [place - pins[0] for place in (*pins, *(np.array(roller.position) for roller in rollers))]
    along += [roller.displacement_axes[:, 0] for roller in rollers]
    axis = max(along, key=lambda direction: float(np.linalg.norm(direction)))
    size = float(np.linalg.norm(axis))
    aside = max(float(np.linalg.norm(np.cross(direction, axis))) for direction in along)
    return None if size == 0.0 or aside > ALIGNED * size**2 else axis[None] / size


def _line_of_places(problem: Equilibrium) -> Array | None:
    """Return the axis (1, 3) through the places at which supports hold the unloaded rod, or None: it can't turn about one line.

    About it the rod may turn before any load, even where the loaded rod may not: what a support prescribes grows from there.
    """
    placing = [(s, at) for s, at in problem.supports if any(at.held_displacement) or at.linear is not None]
    firm = any(all(at.held_displacement) or at.linear is not None for _, at in placing)
    if not firm or len(placing) < 2 or any(any(at.held_rotation) for _, at in problem.supports):
        return None
    places = placed(problem, np.array([s for s, _ in placing]))[0]
    along = (places - places[0]) / problem.rod.length
    sizes = np.linalg.norm(along, axis=1)
    axis = along[np.argmax(sizes)]
    size = float(np.max(sizes))
    aside = float(np.max(np.linalg.norm(np.cross(along, axis), axis=1)))
    return None if size <= ALIGNED or aside > ALIGNED * size**2 else axis[None] / size


def _aligned(N: Array) -> Array:
    """Return the rotation of largest tr(Q N)."""
    U, sizes, Vt = np.linalg.svd(N)
    if sizes[1] <= 1e-9 * sizes[0]:
        return smallest_rotation(U[:, 0], Vt[0])
    return np.asarray(Vt.T @ np.diag([1.0, 1.0, np.linalg.det(U) * np.linalg.det(Vt)]) @ U.T)


def _best(work: Work, axes: Array, nothing: float) -> Array:
    """Return the rotation of most work about the axes (k, 3), by turns: about the first in space, about the others in the rod."""
    if len(axes) == 1:
        return _about(axes[0], work, nothing)

    def bettered(Q: Array) -> Array:
        for axis in axes[1:]:
            Q = Q @ _about(axis, partial(_work_behind, work, Q), nothing)
        return _about(axes[0], lambda turn: work(turn @ Q), nothing) @ Q

    Q = max((bettered(frames.rotation(frames.turn * i / STARTS * axes[0])) for i in range(STARTS)), key=work)
    for _ in range(ALIGNMENTS):
        Q = bettered(Q)
    return Q


def _work_behind(work: Work, Q: Array, turn: Array) -> float:
    return work(np.asarray(Q @ turn))


def _about(axis: Array, work: Work, nothing: float) -> Array:
    """Return the rotation of most work about a unit vector, the smallest of several; none where all are alike.

    The work is a wave of the angle and of twice the angle, which five values give; where it is largest z = exp(i angle) meets

        2 c2 z^4 + c1 z^3 - conj(c1) z - 2 conj(c2) = 0.
    """
    values = [work(frames.rotation(frames.turn * i / 5.0 * axis)) for i in range(5)]
    c1, c2 = 0.4 * np.fft.rfft(values)[1:]
    if abs(c1) + abs(c2) <= nothing:
        return np.eye(3)
    c2 = c2 if abs(c2) > nothing else 0.0
    angles = np.angle(np.roots([2.0 * c2, c1, 0.0, -np.conj(c1), -2.0 * np.conj(c2)]))
    works = np.real(c1 * np.exp(1j * angles) + c2 * np.exp(2j * angles))
    most = angles[works >= np.max(works) - nothing]
    smallest = most[np.abs(most) <= np.min(np.abs(most)) + SAME_TURN]
    return frames.rotation(np.max(smallest) * axis)
