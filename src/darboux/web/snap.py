"""What a rod does on its way from one shape to another: its damped motion where that can be stated, else a blend."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.curve import Curve
from darboux.dynamics.limits import refuses
from darboux.dynamics.simulate import simulate
from darboux.dynamics.tr_bdf2 import TRBDF2
from darboux.errors import InvalidInput
from darboux.motion import MassDamping, Motion
from darboux.problem import Equilibrium
from darboux.solution import EquilibriumSolution, Status
from darboux.trajectory import Trajectory
from darboux.web.shape import SAMPLES, Shape

Array = NDArray[np.float64]

SEGMENTS, RTOL = 24, 1e-3
DURATION, DAMPING, RECORDS = 30.0, 4.0, 400  # in units of the rod's own time, L^2 sqrt(rho A / EI), and its inverse
KICK = 0.02  # L over that time: a disturbance, as nothing leaves an unstable shape without one
BLENDED, PICTURES = 20, 45
LEFT, AT_REST = 0.05, 0.005  # of L: still where it was; no longer moving


def motion(before: EquilibriumSolution, problem: Equilibrium) -> Trajectory | None:
    """Return the damped motion from an equilibrium under what now holds and loads the rod.

    None where the dynamic solver can't state it, and for a ring, which nothing would hold. The rod may stretch in it, however
    stiffly, as one that is held at both ends could not set out otherwise.
    """
    try:
        stated = _movable(problem)
        if stated.closed or refuses(Motion(stated, 1.0)) is not None:
            return None
        rod, zero = stated.rod, np.zeros(1)
        stiffness = rod.stiffness(zero)
        EI = float(min(stiffness.EI1[0], stiffness.EI2[0]))
        time = rod.length**2 * float(np.sqrt(rod.mass(zero, "Motion")[0] / EI))
        first = dataclasses.replace(
            before,
            problem=dataclasses.replace(stated, loads=before.problem.loads),
            curve=_laid(before, problem),
        )
        found = simulate(
            Motion(
                stated,
                DURATION * time,
                initial=first,
                velocity=_disturbance(rod.length, KICK * rod.length / time),
                damping=[MassDamping(DAMPING / time)],
            ),
            TRBDF2(SEGMENTS, rtol=RTOL),
            records=RECORDS,
            throw=False,
            progress=False,
        )
    except InvalidInput:
        return None
    if len(found.times) < 2 or not np.all(np.isfinite(found.positions)):
        return None
    start = first.curve(found.s)[:, :3]
    away = float(np.max(np.linalg.norm(found.positions[0] - start, axis=1)))
    return found if away <= LEFT * rod.length else None


def pictures(trajectory: Trajectory) -> list[Shape]:
    """Return the shapes of a motion, from its start until it is at rest."""
    L, t = trajectory.motion.problem.rod.length, trajectory.times
    from_start, from_end = (
        np.max(np.linalg.norm(trajectory.positions - trajectory.positions[i], axis=2), axis=1) for i in (0, -1)
    )
    first = int(np.argmax(from_start > AT_REST * L))
    last = int(np.max(np.flatnonzero(from_end > AT_REST * L), initial=0)) + 1
    s = np.linspace(0.0, L, SAMPLES)
    times = np.linspace(t[max(first - 1, 0)], t[min(max(last, first), len(t) - 1)], PICTURES)
    return [_shape(trajectory, float(time), s) for time in times]


def guess(trajectory: Trajectory, problem: Equilibrium) -> EquilibriumSolution:
    """Return the last shape of a motion as if it were an equilibrium: what Newton's method sets out from.

    M = B (k - k0),   n = n0 - int f ds,   with n0 such that m' + r' x n + l = 0 as nearly as can be
    """
    from scipy.interpolate import CubicSpline

    rod, s = problem.rod, np.linspace(0.0, problem.rod.length, 2 * SEGMENTS + 1)
    shape = _shape(trajectory, float(trajectory.times[-1]), s)
    q = frames.same_sign(np.array([frames.quaternion_of_matrix(R) for R in shape.R]))
    k = 2.0 * frames.product(q * np.array([1.0, -1.0, -1.0, -1.0]), CubicSpline(s, q)(s, 1))[:, 1:]
    B = np.linalg.inv(rod.compliance(s)[:, 3:, 3:])
    m = np.einsum("nij,njk,nk->ni", shape.R, B, k - rod.k0(s))
    loads = problem.distributed(s)
    below = CubicSpline(s, loads.force(shape.r, shape.R)).antiderivative()(s)
    if not problem.start.holds:
        n0 = -problem.end_load("start").force
    elif not problem.end.holds:
        n0 = problem.end_load("end").force + below[-1]
    else:
        t = shape.R[:, :, 2]
        cross = np.stack([np.cross(t, axis) for axis in np.eye(3)], axis=-1).reshape(-1, 3)
        right = np.cross(t, below) - CubicSpline(s, m)(s, 1) - loads.couple(shape.R)
        n0 = np.linalg.lstsq(cross, right.ravel(), rcond=None)[0]
    y = np.concatenate([shape.r, q, n0 - below, m], axis=1)
    curve = Curve(s, y, CubicSpline(s, y)(s, 1))
    return EquilibriumSolution(problem, None, rod.model, Status("guess", ""), curve)


def _shape(trajectory: Trajectory, t: float, s: Array) -> Shape:
    """Return the rod at a time, its edges' directors carried to the places s."""
    from scipy.interpolate import CubicSpline

    now = trajectory.at(t)
    spline = CubicSpline(now.s, now.r)
    tangent = spline(s, 1)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    d1 = np.asarray(CubicSpline(0.5 * (now.s[1:] + now.s[:-1]), now.R[:, :, 0])(s))
    d1 -= np.sum(d1 * tangent, axis=1, keepdims=True) * tangent
    d1 /= np.linalg.norm(d1, axis=1, keepdims=True)
    return Shape(np.asarray(spline(s)), np.stack([d1, np.cross(tangent, d1), tangent], axis=-1))


def blend(before: Shape, after: Shape) -> list[Shape]:
    """Return shapes that lead evenly from one to the other: no motion, only a hint of what went where."""
    first, last = (np.array([frames.quaternion_of_matrix(R) for R in shape.R]) for shape in (before, after))
    shapes = []
    for part in np.linspace(0.0, 1.0, BLENDED):
        smooth = part**2 * (3.0 - 2.0 * part)
        q = np.array([frames.between(a, b, smooth) for a, b in zip(first, last, strict=True)])
        r = (1.0 - smooth) * before.r + smooth * after.r
        shapes.append(Shape(r, frames.matrix_of_quaternion(q)))
    return shapes


def _movable(problem: Equilibrium) -> Equilibrium:
    """Return the problem as the dynamic solver states it: a twisted clamp as a turned one, a rod that stretches."""
    changes: dict[str, Any] = {"rod": dataclasses.replace(problem.rod, stretch=True)}
    for at in ("start", "end"):
        support = getattr(problem, at)
        if support.clamps and support.twist != 0.0:
            turn = frames.rotation(np.array([0.0, 0.0, support.twist]))
            changes[at] = type(support)(support.position, frame=support.R @ turn)
    return Equilibrium(**{name: getattr(problem, name) for name in ("start", "end", "loads", "between")} | changes)


def _laid(before: EquilibriumSolution, problem: Equilibrium) -> Curve:
    """Return the curve of a solution over the new length, moved so that its ends are where they are now held."""
    ratio = problem.rod.length / before.problem.rod.length
    y, dy = before.curve.y.copy(), before.curve.dy / ratio
    y[:, :3] *= ratio
    dy[:, :3] *= ratio
    moves = np.zeros((2, 3))
    for i, support in enumerate((problem.start, problem.end)):
        if all(support.held_displacement):
            moves[i] = np.array(support.position) - y[-i, :3]
        elif not support.holds and i == 1:
            moves[1] = moves[0]
    if not problem.start.holds:
        moves[0] = moves[1]
    x = (before.curve.s / before.curve.s[-1])[:, None]
    y[:, :3] += (1.0 - x) * moves[0] + x * moves[1]
    dy[:, :3] += (moves[1] - moves[0]) / problem.rod.length
    return Curve(before.curve.s * ratio, y, dy)


def _disturbance(L: float, speed: float) -> Any:
    """Return a small velocity of no symmetry, zero at both ends."""

    def velocity(s: Array) -> Array:
        once, twice = np.sin(np.pi * s / L), np.sin(2.0 * np.pi * s / L)
        return speed * np.stack([0.3 * twice, 0.7 * once + 0.5 * twice, 0.9 * twice - 0.6 * once], axis=1)

    return velocity
