"""A rod as it lies, at places dense enough to draw: of a solution, of a trajectory at a time, or without its loads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.problem import Equilibrium
from darboux.rod import Rod
from darboux.solution import EquilibriumSolution
from darboux.trajectory import Trajectory
from darboux.view import unloaded as where

Array = NDArray[np.float64]

LEAST, MOST = 200, 20_000  # places along a rod
PER_TURN = 60  # places for each turn of its frame


@dataclass(frozen=True, eq=False)
class Shape:
    """The rod at n places: ``s`` (n,) in m, ``r`` (n, 3) in m, directors ``R`` (n, 3, 3), curvature and twist ``k`` (n, 3) in 1/m.

    ``strains`` are (v - v0, k - k0) and ``forces`` (R^T n, R^T m), (n, 6) each, section's frame; ``axial_force_known`` is
    False where the force along the rod is not among the results (an inextensible rod in motion) and stands as zero;
    ``velocity`` (n, 3) in m/s in motion.
    """

    rod: Rod
    s: Array
    r: Array
    R: Array
    k: Array
    strains: Array
    forces: Array
    axial_force_known: bool = True
    velocity: Array | None = None


def of(solution: EquilibriumSolution) -> Shape:
    """Return the shape of an equilibrium."""
    rod = solution.problem.rod
    rough = np.linspace(0.0, rod.length, 4 * LEAST + 1)
    s = _places(rod, float(np.mean(np.linalg.norm(solution.k(rough), axis=1))))
    R, k = solution.R(s), solution.k(s)
    strains = np.hstack([solution.v(s) - [0.0, 0.0, 1.0], k - rod.k0(s)])
    forces = np.hstack([np.einsum("nji,nj->ni", R, vector) for vector in (solution.n(s), solution.m(s))])
    return Shape(rod, s, solution.r(s), R, k, strains, forces)


def at(trajectory: Trajectory, t: float) -> Shape:
    """Return the shape at a time t in s; the strains are those of the discrete rod at its vertices, straight between them."""
    problem, now = trajectory.motion.problem, trajectory.at(t)
    rod, middles, edges = problem.rod, 0.5 * (now.s[1:] + now.s[:-1]), now.R
    stretch = np.linalg.norm(np.diff(now.r, axis=0), axis=1) / np.diff(now.s) - 1.0
    if problem.link is not None:  # the last edge stands in front of the first too, and the first behind the last
        glue = frames.matrix_of_quaternion(
            frames.quaternion_of_turn(np.array([[0.0, 0.0, frames.turn * problem.link]]))
        )[0]
        edges = np.concatenate([now.R[-1:] @ glue.T, now.R, now.R[:1] @ glue])
        middles = np.concatenate([middles[-1:] - rod.length, middles, middles[:1] + rod.length])
        stretch = np.concatenate([stretch[-1:], stretch, stretch[:1]])
    turns = frames.quaternion_of_matrix(np.einsum("nji,njk->nik", edges[:-1], edges[1:]))
    turns *= np.where(turns[:, :1] < 0.0, -1.0, 1.0)
    sine = np.linalg.norm(turns[:, 1:], axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, turns[:, :1])
    curvature = angle * turns[:, 1:] / np.maximum(sine, 1e-300) / np.diff(middles)[:, None]
    s = _places(
        rod, float(np.mean(np.linalg.norm(curvature, axis=1))), len(middles) * max(4, -(-LEAST // len(middles)))
    )
    spline = trajectory.curve(now.r)
    d3, d1 = spline(s, 1), _between(s, middles, edges[:, :, 0])
    d3 /= np.linalg.norm(d3, axis=1, keepdims=True)
    d1 -= np.sum(d1 * d3, axis=1, keepdims=True) * d3
    d1 /= np.linalg.norm(d1, axis=1, keepdims=True)
    k = _between(s, now.s if len(curvature) == len(now.s) else now.s[1:-1], curvature)
    strains = np.zeros((len(s), 6))
    strains[:, 3:] = k - rod.k0(s)
    if rod.stretch:
        strains[:, 2] = np.interp(s, middles, stretch)
    forces = np.einsum("nij,nj->ni", rod.stiffness(s).matrix, strains)
    R = np.stack([d1, np.cross(d3, d1), d3], axis=-1)
    return Shape(rod, s, spline(s), R, k, strains, forces, rod.stretch, _between(s, now.s, now.velocity))


def unloaded(problem: Equilibrium) -> Shape:
    """Return the rod without its loads, laid at the support that places it; for a ring the round one."""
    rod = problem.rod
    rough = np.linspace(0.0, rod.length, 4 * LEAST + 1)
    s = _places(rod, float(np.mean(np.linalg.norm(rod.k0(rough), axis=1))))
    r, R, k = where.unloaded(problem, s)
    nothing = np.zeros((len(s), 6))
    return Shape(rod, s, r, R, k, nothing, nothing)


def _places(rod: Rod, turning: float, least: int = LEAST) -> Array:
    """Return places along the rod: evenly, and where its data bend; ``turning`` is the mean of |k| in 1/m."""
    count = int(np.clip(PER_TURN * turning * rod.length / frames.turn, min(least, MOST), MOST))
    return np.union1d(np.linspace(0.0, rod.length, count + 1), rod.breaks)


def _between(s: Array, at: Array, values: Array) -> Array:
    """Return the values (n, 3) given at the places ``at``, straight between them and the same beyond."""
    return np.stack([np.interp(s, at, column) for column in values.T], axis=1)
