"""A rod as the browser draws it: sections along it, the outline of a section, and what is plotted along s."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.problem import Equilibrium
from darboux.rod import Rod
from darboux.section import Rectangle
from darboux.solution import EquilibriumSolution
from darboux.view import unloaded as where

Array = NDArray[np.float64]

SAMPLES = 101  # sections that are drawn
AROUND = 16  # points of an outline
THINNEST = (
    0.006  # half of a section's larger side over the picture's size: thinner rods are drawn thicker, and this is said
)
PLOTTED, MOST_PLOTTED = 2, 300  # every second section, and the solver's own nodes, which are dense in boundary layers


@dataclass(frozen=True)
class Shape:
    """Sections along the rod: centreline ``r`` (n, 3) in m and directors ``R`` (n, 3, 3)."""

    r: Array
    R: Array

    @property
    def size(self) -> float:
        """The longest side of the box around it, in m."""
        return float(np.max(np.ptp(self.r, axis=0)))

    @property
    def packed(self) -> str:
        """r, d1, d2 as 32-bit numbers (n, 9), in base64."""
        return packed(np.concatenate([self.r, self.R[:, :, 0], self.R[:, :, 1]], axis=1))


@dataclass(frozen=True)
class Fields:
    """What is plotted: ``k`` (n, 3) in 1/m and ``M`` = R^T m (n, 3) in N m, section's frame, and ``e`` (n,) in J/m, over s (n,).

    e is the elastic energy per length, 1/2 [R^T n, R^T m] . [v - v0, k - k0].
    """

    s: Array
    k: Array
    M: Array
    e: Array


def sampled(solution: EquilibriumSolution) -> tuple[Shape, Fields]:
    """Return the shape and the fields of a solution, its curve asked once."""
    rod = solution.problem.rod
    s = np.linspace(0.0, rod.length, SAMPLES)
    y = solution.curve(s)
    R = frames.matrix_of_quaternion(y[:, 3:7])
    shape = Shape(y[:, 0:3], R)
    s = _plotted(solution)
    y = solution.curve(s)
    R = frames.matrix_of_quaternion(y[:, 3:7])
    forces = np.einsum("nji,naj->nai", R, y[:, 7:13].reshape(-1, 2, 3)).reshape(-1, 6)
    strains = np.einsum("nij,nj->ni", rod.compliance(s), forces)
    energy = 0.5 * np.einsum("ni,ni->n", forces, strains)
    return shape, Fields(s, rod.k0(s) + strains[:, 3:], forces[:, 3:], energy)


def _plotted(solution: EquilibriumSolution) -> Array:
    """Return where fields are plotted: evenly, and at the nodes and half between them, thinned out where they are many."""
    nodes = np.unique(np.clip(solution.curve.s, 0.0, solution.problem.rod.length))
    nodes = np.sort(np.concatenate([nodes, 0.5 * (nodes[1:] + nodes[:-1])]))
    nodes = nodes[np.linspace(0, len(nodes) - 1, min(len(nodes), MOST_PLOTTED)).astype(int)]
    return np.union1d(np.linspace(0.0, solution.problem.rod.length, SAMPLES)[::PLOTTED], nodes)


def unloaded(problem: Equilibrium) -> Shape | None:
    """Return the unloaded rod, laid at its support; None for a ring, which was never open."""
    if problem.closed:
        return None
    r, R, _ = where.unloaded(problem, np.linspace(0.0, problem.rod.length, SAMPLES))
    return Shape(r, R)


@dataclass(frozen=True)
class Outline:
    """The section that is drawn: ``points`` (m, 2), or (n, m, 2) where it varies, times ``scale``; ``bright`` (m,) its mark.

    The mark is a stripe along d1 on round sections and one broad side of flat ones: it shows the twist. ``words`` say
    what is not true to scale.
    """

    points: Array
    bright: NDArray[np.bool_]
    words: str

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Outline) and np.array_equal(self.points, other.points)

    @property
    def content(self) -> dict[str, Any]:
        """What is sent."""
        return {"points": packed(self.points), "bright": self.bright.tolist(), "varies": self.points.ndim == 3}


def outline(rod: Rod, size: float) -> Outline:
    """Return the outline of the section, thick enough to be seen in a picture of ``size`` m."""
    s = np.linspace(0.0, rod.length, SAMPLES)
    p = (np.arange(AROUND) + 0.5) * (4.0 / AROUND)
    bright = (p < 0.5) | (p > 3.5)
    least = THINNEST * size
    if not rod.section.has_shape:
        angle = 0.5 * np.pi * p
        circle = least * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return Outline(circle, bright, "a section without a shape is drawn as a thread")
    if isinstance(rod.section, Rectangle):
        corners = np.array([0.001, 0.999])
        p = np.concatenate([side + corners for side in range(4)])
        points = rod.section.outline(s, np.tile(p, (len(s), 1)))
        broad = 0 if np.ptp(points[0, :, 1]) > np.ptp(points[0, :, 0]) else 1  # the side p = 0 to 1 is that of d1
        bright = np.array([i == 2 * broad for i in range(8)])
    else:
        points = rod.section.outline(s, np.tile(p, (len(s), 1)))
    scale = max(1.0, least / float(np.max(np.abs(points))))
    words = f"section drawn {scale:.2g} times its size" if scale > 1.005 else ""
    points = scale * points
    return Outline(points if np.any(points != points[0]) else points[0], bright, words)


def packed(values: Array) -> str:
    """Return numbers as 32-bit ones in base64."""
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode()
