"""Shapes that a load path may begin with: the rod's own, a circle, or any curve that a user draws.

A path that begins with another shape than the rod's own makes the rod free of stress in it, by lending it a natural
curvature and twist, and takes that back while the loads and the supports' poses grow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux import checks, frames
from darboux.curve import Curve
from darboux.errors import InvalidInput
from darboux.kernels.rod_equations import BINV, K0
from darboux.link import writhe_of_polygon
from darboux.packing.laying import shape_of
from darboux.packing.problem import Packing
from darboux.packing.scale import Scale
from darboux.problem import Equilibrium
from darboux.solution import EquilibriumSolution

Array = NDArray[np.float64]

SAMPLES = 129  # of a curve that is drawn
SAMPLES_OF_TWIST = 1024


@dataclass(frozen=True)
class FirstShape:
    """Curvature and twist k L as a function of x = s / L (n,) -> (n, 3), and where the start lies: r (3,), q (4,).

    Between its ``knots`` x (m,) k is a polynomial, or smooth where there are none. A cable's shape has ``layers``, places x (n,)
    near the ends between which they will bend it steeply. It sags, so that its forces are determined. A ring's shape has a
    ``link`` in turns.
    """

    k: Callable[[Array], Array]
    r: Array
    q: Array
    layers: tuple[float, ...] = ()
    knots: Array = field(default_factory=lambda: np.empty(0))
    link: float | None = None

    @property
    def sags(self) -> bool:
        """True for a cable's shape."""
        return len(self.layers) > 0

    def states(self, x: Array) -> tuple[Array, Array]:
        """Return places (n, 3) and quaternions (n, 4) at x (n,)."""
        r, q = shape_of(self.k, x)
        R = frames.matrix_of_quaternion(self.q)
        return self.r + r @ R.T, frames.product(np.broadcast_to(self.q, q.shape), q)


def circle(ring: Packing, link: float) -> FirstShape:
    """Return the round ring: its sections turn evenly about the centreline, by the link in turns over the whole length.

        k = 2 pi (cos(phi - 2 pi link x), sin(phi - 2 pi link x), link),    x = s / L

    It bends to the side to which the natural shape bends, or about the softer axis at the start.
    """
    x: Array = (np.arange(256, dtype=float) + 0.5) / 256.0
    c = ring.columns(x)
    turned = frames.turn * link * x
    mean = np.mean((c[:, K0] + 1j * c[:, K0 + 1]) * np.exp(1j * turned))
    softer = 0.0 if np.mean(1.0 / c[:, BINV]) <= np.mean(1.0 / c[:, BINV + 1]) else 0.5 * np.pi
    phi = float(np.angle(mean)) if abs(mean) > 1e-9 else softer

    def k(x: Array) -> Array:
        angle = phi - frames.turn * link * x
        return frames.turn * np.stack([np.cos(angle), np.sin(angle), np.full_like(x, link)], axis=1)

    return FirstShape(k, ring.start.place, frames.quaternion_of_matrix(ring.start.frame), link=link)


def of_problem(problem: Equilibrium) -> FirstShape | None:
    """Return the circle for a ring; None where the path begins with the natural shape."""
    return None if problem.link is None else circle(Packing(problem), problem.link)


def given(problem: Equilibrium, scale: Scale, start: Any) -> FirstShape:
    """Return the shape of a guess: a solution, a curve, or points (n, 3) in m along the rod.

    A ring that begins with a ring begins with the link that was asked of that one: then no whole turns are lost, but those in which
    it passed through itself.
    """
    if problem.closed:
        shape = _given(problem, scale, start)
        asked = start.problem.link if isinstance(start, EquilibriumSolution) else None
        return replace(shape, link=_link(shape) if asked is None else asked)
    return _given(problem, scale, start)


def _link(shape: FirstShape) -> float:
    """Return the link Tw + Wr in turns of a closed shape, as near as whole turns are told apart."""
    x = (np.arange(SAMPLES_OF_TWIST) + 0.5) / SAMPLES_OF_TWIST
    places = shape.states(np.linspace(0.0, 1.0, SAMPLES))[0]
    places[-1] = places[0]
    return float(np.mean(shape.k(x)[:, 2])) / frames.turn + writhe_of_polygon(places)


def link_of(curve: Curve) -> float:
    """Return the link in turns of a closed curve, from its frames."""
    s = np.linspace(0.0, float(curve.s[-1]), SAMPLES)
    y = curve(s)
    return _link(_of_frames(s / s[-1], np.zeros(3), frames.same_sign(y[:, 3:7])))


def _given(problem: Equilibrium, scale: Scale, start: Any) -> FirstShape:
    if isinstance(start, EquilibriumSolution):
        start = start.curve
    if isinstance(start, Curve):
        s = np.linspace(0.0, float(start.s[-1]), SAMPLES)
        y = start(s)
        return _of_frames(s / s[-1], (y[0, :3] - scale.origin) / scale.length, frames.same_sign(y[:, 3:7]))
    try:
        points = checks.real_array(start)
    except (TypeError, ValueError):
        points = np.empty(0)
    if points.ndim != 2 or points.shape[1] != 3 or len(points) < 2 or not np.all(np.isfinite(points)):
        raise InvalidInput(
            f"solve.start is {checks.shown(start)}; it must be a solution, a Curve, or two or more points (n, 3) in m."
        )
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    if np.any(np.diff(along) <= 0.0):
        raise InvalidInput("solve.start has the same point twice in a row; leave one out.")
    x = np.linspace(0.0, 1.0, SAMPLES)
    from scipy.interpolate import CubicSpline  # slow to load, and seldom needed

    tangents = np.asarray(CubicSpline(along / along[-1], points)(x, 1))
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    return untwisted(Packing(problem), x, tangents, (points[0] - scale.origin) / scale.length)


def untwisted(packing: Packing, x: Array, tangents: Array, r: Array) -> FirstShape:
    """Return the shape from r on with unit tangents (n, 3) at x (n,), with the least twist that the ends' frames ask for."""
    start, end = packing.ends
    q = _carried(frames.quaternion_of_matrix(start.frame if any(start.held_turns) else np.eye(3)), tangents)
    if any(end.held_turns):  # the least twist that meets the frame at the end
        missing = frames.product(q[-1] * (1, -1, -1, -1), frames.quaternion_of_matrix(end.frame))
        angle = 2.0 * np.arctan2(missing[3], missing[0])
        angle = (angle + np.pi) % (2.0 * np.pi) - np.pi + end.twist
        spin = np.stack([np.cos(0.5 * angle * x), 0.0 * x, 0.0 * x, np.sin(0.5 * angle * x)], axis=1)
        q = frames.product(q, spin)
    return _of_frames(x, r, q)


def _of_frames(x: Array, r: Array, q: Array) -> FirstShape:
    """Return the shape whose frames are the quaternions q (n, 4) at x (n,)."""
    relative = frames.product(q[:-1] * np.array([1.0, -1.0, -1.0, -1.0]), q[1:])
    relative *= np.where(relative[:, :1] < 0.0, -1.0, 1.0)
    sine = np.linalg.norm(relative[:, 1:], axis=1, keepdims=True)
    turn = 2.0 * np.arctan2(sine, relative[:, :1]) / np.where(sine > 0.0, sine, 1.0) * relative[:, 1:]
    middle = 0.5 * (x[1:] + x[:-1])
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(middle, turn / np.diff(x)[:, None])
    return FirstShape(lambda x: np.asarray(spline(x)), r, q[0], knots=middle)


def _carried(q: Array, tangents: Array) -> Array:
    """Return quaternions (n, 4) whose d3 are the tangents (n, 3): q turned to the first, then each by the smallest angle."""
    result = np.empty((len(tangents), 4))
    for i, tangent in enumerate(tangents):
        d3 = frames.matrix_of_quaternion(q)[:, 2]
        axis, cosine = np.cross(d3, tangent), float(d3 @ tangent)
        turn = np.concatenate([[1.0 + cosine], axis])
        if cosine < -1.0 + 1e-12:
            turn = np.concatenate([[0.0], frames.matrix_of_quaternion(q)[:, 0]])
        q = frames.product(turn / np.linalg.norm(turn), q)
        result[i] = q
    return result
