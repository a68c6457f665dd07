"""How a rod that its joints leave free to turn hangs as a rigid body: where the smallest load takes it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.natural import smallest_rotation
from darboux.problem import Equilibrium, Ring
from darboux.statics.laying import laid, placed
from darboux.supports import Support

Array = NDArray[np.float64]

PLACES = 257  # at which a pendulum's loads are summed
STARTS, ALIGNMENTS = 8, 50  # of a universal joint's two turns, one after the other
ALIGNED = 1e-9  # relative to the largest distance: a joint beside the common axis by less lies on it
NOTHING = 1e-12  # of the loads' largest moment: below this their sum is rounding


def origin(problem: Equilibrium) -> str:
    """Return in words where the load path of a problem begins."""
    if isinstance(problem, Ring):
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


def hanging(problem: Equilibrium, arms: Array, forces: Array) -> Array | None:
    """Return the rotation Q (3, 3) by which a rod on joints hangs lowest as a rigid body; None where it does, or can't turn.

        sum of f.(Q a) -> max

    ``arms`` a (n, 3) lead from the joint to the dead ``forces`` f (n, 3). Of several such rotations it is the smallest. The rod
    turns about its only joint, or about the line on which all its ball joints and rollers lie; it is no pendulum where a
    spring against turning or a force that grows with r holds it too.
    """
    axes = _free_axes(problem)
    if axes is None:
        return None
    moments = np.einsum("ni,nj->nij", arms, forces)
    N = np.sum(moments, axis=0)
    if np.max(np.abs(N)) <= NOTHING * np.sum(np.abs(moments)):
        return None
    Q = _best(N, axes)
    return None if np.trace(Q @ N) - np.trace(N) <= NOTHING * np.sum(np.abs(moments)) else Q


def _weights(problem: Equilibrium) -> tuple[Array, Array]:
    """Return the arms (n, 3) in m from the support to the dead forces, and these (n, 3) in N, by Simpson's rule."""
    s = np.linspace(0.0, problem.rod.length, PLACES)
    simpson = np.ones(PLACES)
    simpson[1:-1:2], simpson[2:-1:2] = 4.0, 2.0
    ends = [(s[0], problem.end_load("start")), (s[-1], problem.end_load("end"))]
    points = [*ends, *problem.points.items()]
    r, R = placed(problem, np.concatenate([s, [at for at, _ in points]]))
    forces = [problem.distributed(s).a * (simpson * s[1] / 3.0)[:, None], [load.force for _, load in points]]
    arms = [r - np.array(problem.supports[0][1].position)]
    for frame, (_, load) in zip(R[PLACES:], points, strict=True):  # tr(Q R A^T) of those that act off the centre
        arms.append(frame.T)
        forces.append(load.eccentric.T)
    return np.concatenate(arms), np.concatenate(forces)


def _free_axes(problem: Equilibrium) -> Array | None:
    """Return the axes (k, 3) about which the supports let the rod turn as a whole, or None: it is no pendulum."""
    if isinstance(problem, Ring) or problem.of_shape or any(at.rotational is not None for _, at in problem.supports):
        return None
    if len(problem.supports) == 1:
        axes = _axes_of_joint(problem.supports[0][1])
    else:
        axes = _common_axis(problem)
        axes = _line_of_places(problem) if axes is None else axes
    if axes is None or np.any(problem.distributed(np.linspace(0.0, problem.rod.length, PLACES)).C):
        return None
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


def _best(N: Array, axes: Array) -> Array:
    """Return the rotation of largest tr(Q N): any (a ball joint's), about one axis, or about a then about b, by Q = Q_a Q_b."""
    if len(axes) == 3:
        U, sizes, Vt = np.linalg.svd(N)
        if sizes[1] <= 1e-9 * sizes[0]:
            return smallest_rotation(U[:, 0], Vt[0])
        return np.asarray(Vt.T @ np.diag([1.0, 1.0, np.linalg.det(U) * np.linalg.det(Vt)]) @ U.T)
    if len(axes) == 1:
        return _about(axes[0], N)
    # Of a few turns about a the best, each with its best turn about b; then both by turns: tr(Qa Qb N) = tr(Qb N Qa).
    starts = [frames.rotation(angle * axes[0]) for angle in np.arange(STARTS) * (frames.turn / STARTS)]
    pairs = [(Qa, _about(axes[1], N @ Qa)) for Qa in starts]
    Qa, Qb = max(pairs, key=lambda pair: float(np.trace(pair[0] @ pair[1] @ N)))
    for _ in range(ALIGNMENTS):
        Qa = _about(axes[0], Qb @ N)
        Qb = _about(axes[1], N @ Qa)
    return np.asarray(Qa @ Qb)


def _about(a: Array, N: Array) -> Array:
    """Return the rotation about the unit vector a of largest tr(Q N); none where all are alike."""
    cosine = float(np.trace(N) - a @ N @ a)
    sine = float(a @ np.array([N[1, 2] - N[2, 1], N[2, 0] - N[0, 2], N[0, 1] - N[1, 0]]))
    if np.hypot(cosine, sine) <= NOTHING * np.max(np.abs(N)):
        return np.eye(3)
    return frames.rotation(np.arctan2(sine, cosine) * a)
