"""From a problem in space to the elastica in its plane, without dimensions, and back.

The clamp's tangent t0 and a unit normal e of the plane span the fixed base (t0, e x t0). The tangent angle theta
turns about e; lengths are in units of L, forces of EI/L^2, moments of EI/L, with EI that at s = 0 of the rod:

    x' = cos(theta),  y' = sin(theta),  n' = -f,  M = B (theta' - k0),  M' = n_x sin(theta) - n_y cos(theta) - l

Sections turn about e and about nothing else, R = Rot(e, theta) R0: e has the same components in every section's frame.

A rod clamped at s = L alone is read from its clamp: s runs backwards, so the tangent, n, M and k0 change sign.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from darboux.curve import Curve
from darboux.errors import InvalidInput
from darboux.frames import quaternion_of_matrix
from darboux.problem import Equilibrium
from darboux.statics import limits

Array = NDArray[np.float64]

OUT_OF_PLANE = 1e-12  # of the largest load or curvature: rounding in the data; anything larger is refused
MOST_BREAKS = 2000
SAME_FRAME = 1e-10  # between the frame of a held end and that of the clamp, turned in the plane
SAMPLES = 257  # places along the rod at which the data are looked at
CURVE_TOLERANCE = 1e-12  # of the interpolation between the nodes of a curve, relative to the largest value
CURVE_ROUNDS = 50
MOST_NODES = 20000
LEAST_SCALE = 1e-3  # of forces and moments without dimensions: below it their rounding is not interpolated
INSTEAD = "Use Collocation"


class NotPlanar(InvalidInput):
    """A problem that the planar, inextensible theory does not state."""


class PlaneData(NamedTuple):
    """What is given along the rod at n places: bending stiffness B, natural curvature k0, force f (n, 2), couple l."""

    B: Array
    k0: Array
    f: Array
    l: Array


class PlaneStates(NamedTuple):
    """What is found along the rod at n places: theta, kappa = theta', moment M, position r (n, 2), force n (n, 2)."""

    theta: Array
    kappa: Array
    moment: Array
    r: Array
    n: Array


@dataclass(frozen=True)
class PlaneSolution:
    """What a planar solver hands back, without dimensions; ``states`` takes any s in [0, 1].

    ``code`` is "converged", "folded", "no_convergence", "unresolved" (found, but its error is above the tolerance) or
    "taut" (both ends held as far apart as the rod is long);
    ``load`` the factor of the loads; ``reached`` the share of the last leg, in which a held end may be ``pushed``;
    ``crossings`` the shares of the last leg at which the branch crossed another one: where a straight rod buckles.
    """

    code: str
    load: float
    reached: float
    states: Callable[[Array], PlaneStates]
    error: float
    statistics: dict[str, Any]
    crossings: tuple[float, ...] = ()
    pushed: bool = False


@dataclass(frozen=True, eq=False)
class PlaneProblem:
    """A planar problem: a rod clamped at s = 0 with the tangent along x, its other end free or held.

    ``sign`` is -1 where s runs against the rod's own; ``normal`` is e, ``base`` (3, 2) holds the axes x and y,
    ``R0`` the clamp's frame and ``origin`` its place; ``end_force`` (2,) and ``end_moment`` act on the free end, ``off_centre``
    (2,) are e x F and e . F of forces that act at an offset e from it, where it has not turned; ``end_pose`` is (x, y, theta) of
    a held end or None; ``breaks`` are the kinks of the data.
    """

    problem: Equilibrium
    sign: float
    normal: Array
    base: Array
    R0: Array
    origin: Array
    axis: int
    stiffness: float
    end_force: Array
    end_moment: float
    off_centre: Array
    end_pose: tuple[float, float, float] | None
    breaks: tuple[float, ...]

    @property
    def length(self) -> float:
        """L in m."""
        return self.problem.rod.length

    def arc_length(self, s: Array) -> Array:
        """Return the rod's own arc length in m at s in [0, 1]."""
        return self.length * (s if self.sign > 0.0 else 1.0 - s)

    def data(self, s: Array) -> PlaneData:
        """Return what is given at s (n,)."""
        place, unit = self.arc_length(s), self.stiffness / self.length
        stiffness = self.problem.rod.stiffness(place)
        loads = self.problem.distributed(place)
        k0 = self.problem.rod.k0(place) @ (self.R0.T @ self.normal)
        return PlaneData(
            B=(stiffness.EI1, stiffness.EI2)[self.axis] / self.stiffness,
            k0=self.sign * self.length * k0,
            f=loads.a @ self.base * (self.length**2 / unit),
            l=loads.la @ self.normal * (self.length / unit),
        )

    def moment_at_end(self, theta: float) -> tuple[float, float]:
        """Return the moment on the free end at an angle, and its derivative by it: (R e) x F = (e x F) cos - (e . F) sin."""
        across, along = self.off_centre
        cos, sin = np.cos(theta), np.sin(theta)
        return float(self.end_moment + across * cos - along * sin), float(-across * sin - along * cos)

    @cached_property
    def end_loaded_arc(self) -> bool:
        """True where forces and moments act on one free end alone and the rod is uniform: the closed form's domain."""
        data = self.data(np.linspace(0.0, 1.0, SAMPLES))
        return self.end_pose is None and self.problem.uniform and not np.any(data.f) and not np.any(data.l)

    def in_space(self, s: Array, states: PlaneStates, load: float) -> tuple[Array, Array]:
        """Return the 13 states at s and their derivatives by the rod's own arc length, in SI: (n, 13) each."""
        data, L, sign = self.data(s), self.length, self.sign
        force, moment = self.stiffness / L**2, self.stiffness / L
        cos, sin = np.cos(states.theta), np.sin(states.theta)
        slope = states.n[:, 0] * sin - states.n[:, 1] * cos - load * data.l
        q0 = quaternion_of_matrix(self.R0)
        q1 = np.append(-self.normal @ q0[1:], q0[0] * self.normal + np.cross(self.normal, q0[1:]))  # (0, e) q0
        half_cos, half_sin = np.cos(states.theta / 2.0)[:, None], np.sin(states.theta / 2.0)[:, None]
        r = self.origin + L * states.r @ self.base.T
        q = half_cos * q0 + half_sin * q1
        n = sign * force * states.n @ self.base.T
        m = sign * moment * states.moment[:, None] * self.normal
        dr = sign * np.stack([cos, sin], axis=1) @ self.base.T
        dq = sign / L * states.kappa[:, None] / 2.0 * (half_cos * q1 - half_sin * q0)
        dn = -force / L * load * data.f @ self.base.T
        dm = moment / L * slope[:, None] * self.normal
        return np.hstack([r, q, n, m]), np.hstack([dr, dq, dn, dm])

    def curve(self, solution: PlaneSolution) -> Curve:
        """Return the rod's curve on nodes close enough for its interpolation; those at breaks stand twice."""
        inner = np.array([s for s in self.breaks if 0.0 < s < 1.0])
        s = np.unique(np.concatenate([np.linspace(0.0, 1.0, 17), inner]))
        y, dy = self.in_space(s, solution.states(s), solution.load)
        for _ in range(CURVE_ROUNDS):
            curve = self._assembled(s, y, dy, inner)
            middle = (s[1:] + s[:-1]) / 2.0
            exact, slope = self.in_space(middle, solution.states(middle), solution.load)
            rough = self._roughness(curve(self.arc_length(middle)) - exact, y) > CURVE_TOLERANCE
            rough &= np.diff(s) > 1e-13
            if not np.any(rough) or len(s) > MOST_NODES:
                break
            places = np.flatnonzero(rough) + 1  # the exact midpoints of rough intervals become nodes
            s = np.insert(s, places, middle[rough])
            y, dy = np.insert(y, places, exact[rough], axis=0), np.insert(dy, places, slope[rough], axis=0)
        return self._assembled(s, y, dy, inner)

    def _roughness(self, difference: Array, y: Array) -> Array:
        """The largest difference of the states, each vector relative to its largest value: (n,)."""
        unit = self.stiffness / self.length
        force = max(float(np.max(np.abs(y[:, 7:10]))), LEAST_SCALE * unit / self.length)
        moment = max(float(np.max(np.abs(y[:, 10:13]))), LEAST_SCALE * unit)
        scale = np.repeat([self.length, 1.0, force, moment], [3, 4, 3, 3])
        return np.asarray(np.max(np.abs(difference) / scale, axis=1))

    def _assembled(self, s: Array, y: Array, dy: Array, inner: Array) -> Curve:
        count = np.where(np.isin(s, inner), 2, 1)
        place = self.arc_length(s)
        nodes = (np.repeat(place, count), np.repeat(y, count, axis=0), np.repeat(dy, count, axis=0))
        return Curve(*nodes) if self.sign > 0.0 else Curve(*(a[::-1].copy() for a in nodes))


# -- from space to the plane ------------------------------------------------------------------------------------------


class SpaceData(NamedTuple):
    """What decides on the plane, fixed frame, without dimensions: (n, 3) each.

    ``bent`` (the natural curvature) and ``couples`` must lie along the plane's normal, ``forces``, ``held`` (place
    and tangent of the clamp at s = length) and ``offsets`` (A R0^T = sum F (R0 e)^T) in the plane.
    """

    bent: Array
    couples: Array
    forces: Array
    held: Array
    offsets: Array

    @property
    def scale(self) -> float:
        """The largest component of any of them."""
        return max(float(np.max(np.abs(group))) for group in self)

    def leaving(self, normal: Array) -> dict[str, float]:
        """By how much the data leave the plane, under the words that say so."""
        amounts = {
            "rod.natural bends the rod": np.cross(self.bent, normal),
            "the couples and end moments bend it": np.cross(self.couples, normal),
            "the forces point": self.forces @ normal,
            "the clamp at s = length lies or points": self.held @ normal,
            "a force acts": self.offsets @ normal,
        }
        return {what: float(np.max(np.abs(amount))) for what, amount in amounts.items()}

    def normal(self, tangent: Array, default: Array) -> Array:
        """Return the plane's unit normal from the largest of the data that fix it; the default where none does."""
        across = [np.cross(tangent, self.forces), np.cross(tangent, self.held), np.cross(np.eye(3), self.offsets.T)]
        candidates = np.vstack([self.bent, self.couples, *across])
        best = candidates[np.argmax(np.linalg.norm(candidates, axis=1))]
        across = best - (best @ tangent) * tangent
        size = float(np.linalg.norm(across))
        return default if size <= OUT_OF_PLANE * self.scale else np.asarray(across / size)


def plane_of(problem: Equilibrium) -> PlaneProblem:
    """Return the planar problem, or raise ``NotPlanar`` in one sentence that says what to use instead."""
    _check_model(problem)
    rod, L = problem.rod, problem.rod.length
    backwards, both_held = not problem.start.holds, problem.start.holds and problem.end.holds
    clamp, sign = (problem.end, -1.0) if backwards else (problem.start, 1.0)
    tip = problem.end_load("start" if backwards else "end")
    R0, origin, tangent = clamp.R, np.array(clamp.position), sign * clamp.R[:, 2]

    places = sorted({*problem.breaks, *problem.steep_places})
    s = np.unique(np.concatenate([np.linspace(0.0, L, SAMPLES), places]))
    stiffness, loads, k0 = rod.stiffness(s), problem.distributed(s), L * rod.k0(s)
    EI = float(stiffness.EI1[0])
    data = SpaceData(
        bent=k0[:, :2] @ R0[:, :2].T,
        couples=np.vstack([loads.la * L, tip.moment]) * (L / EI),
        forces=np.vstack([loads.a * L, tip.force]) * (L**2 / EI),
        held=np.vstack([(np.array(problem.end.position) - origin) / L, problem.end.R[:, 2]]) * both_held,
        offsets=tip.eccentric @ R0.T * (L / EI),
    )
    weaker = 0 if np.sum(stiffness.EI1) <= np.sum(stiffness.EI2) else 1
    normal = data.normal(tangent, default=R0[:, weaker])
    axis = int(np.argmax(np.abs(R0[:, :2].T @ normal)))
    principal = np.copysign(1.0, normal @ R0[:, axis]) * R0[:, axis]
    allowed = OUT_OF_PLANE * data.scale
    if max(data.leaving(principal).values()) <= allowed:
        normal = principal  # without the rounding of the data

    if np.max(np.abs(k0[:, 2])) > allowed:
        raise NotPlanar(
            f"Elastica states planar rods; this rod has a natural twist, rod.natural's third part. {INSTEAD}."
        )
    for what, amount in data.leaving(normal).items():
        if amount > allowed:
            raise NotPlanar(f"Elastica states planar rods; here {what} out of the plane of the rest. {INSTEAD}.")
    isotropic = bool(np.all(np.abs(stiffness.EI1 - stiffness.EI2) <= 1e-12 * stiffness.EI1))
    if not isotropic and normal is not principal:
        raise NotPlanar(
            "Elastica states planar rods; here the plane of the loads is none of the section's principal planes "
            f"(EI1 and EI2 differ), so the rod also bends out of it. {INSTEAD}, or turn the clamp's d1."
        )

    unit = float((stiffness.EI1, stiffness.EI2)[axis][0])
    base = np.column_stack([tangent, np.cross(normal, tangent)])
    arms = base.T @ R0 @ tip.eccentric.T @ base  # sum e F^T
    return PlaneProblem(
        problem=problem,
        sign=sign,
        normal=normal,
        base=base,
        R0=R0,
        origin=origin,
        axis=axis,
        stiffness=unit,
        end_force=tip.force @ base * (L**2 / unit),
        end_moment=float(tip.moment @ normal) * (L / unit),
        off_centre=np.array([arms[0, 1] - arms[1, 0], np.trace(arms)]) * (L / unit),
        end_pose=_end_pose(problem, normal, base, float(np.mean(data.bent @ normal))) if both_held else None,
        breaks=tuple(sorted(b / L if sign > 0.0 else 1.0 - b / L for b in places)),
    )


def _check_model(problem: Equilibrium) -> None:
    rod = problem.rod
    if rod.stretch or rod.shear:
        verb, name = ("stretches", "stretch") if rod.stretch else ("shears", "shear")
        raise NotPlanar(f"Elastica states planar, inextensible rods; this rod {verb}. {INSTEAD}, or set {name}=False.")
    if len(problem.breaks) > MOST_BREAKS:
        raise NotPlanar(
            f"Elastica follows tables from row to row, up to {MOST_BREAKS} of them; here are {len(problem.breaks)} between the "
            f"ends. {INSTEAD}, which averages them."
        )
    mixed = limits.coupled(problem, "Elastica")
    if mixed:
        raise NotPlanar(mixed)
    for place in ("start", "end"):
        support = getattr(problem, place)
        held = {*support.held_displacement, *support.held_rotation}
        if len(held) > 1:
            raise NotPlanar(
                f"Elastica states clamped and free ends; problem.{place} is {support}, which holds an end in part. "
                f"{INSTEAD}."
            )
    loads = problem.distributed(np.linspace(0.0, rod.length, SAMPLES))
    if np.any(loads.C):
        raise NotPlanar(
            "Elastica states dead loads; here a force along the rod depends on the position, as a Rotation's does. "
            f"{INSTEAD}."
        )
    if np.any(loads.b) or np.any(loads.lb):
        raise NotPlanar(f"Elastica states dead loads; here a load turns with the section (frame='section'). {INSTEAD}.")


def _end_pose(problem: Equilibrium, normal: Array, base: Array, natural_turn: float) -> tuple[float, float, float]:
    """Return x, y and theta of the held end; of all turns the one nearest to the unloaded rod's."""
    R0, R1 = problem.start.R, problem.end.R
    x, y = (np.array(problem.end.position) - np.array(problem.start.position)) @ base / problem.rod.length
    cos, sin = R1[:, 2] @ base
    tangent = base @ (cos, sin)
    turned = np.column_stack([tangent, np.cross(normal, tangent), normal])
    if np.max(np.abs(R1 - turned @ np.column_stack([base, normal]).T @ R0)) > SAME_FRAME:
        raise NotPlanar(
            "Elastica states planar rods; here the clamp at s = length is twisted against the one at s = 0. "
            f"{INSTEAD}, or give both clamps the d1 of one plane."
        )
    theta = float(np.arctan2(sin, cos))
    return float(x), float(y), theta + 2.0 * np.pi * round((natural_turn - theta) / (2.0 * np.pi))
