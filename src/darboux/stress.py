"""Stress and strain on the section's outline, and where along the rod they are largest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from darboux.checks import ONE_PLACE
from darboux.errors import InvalidInput
from darboux.rod import Rod

Array = NDArray[np.float64]
Inner = Callable[[Array], tuple[Array, Array]]  # s (n,) to N3 (n,) and M (n, 3)

QUARTER = np.linspace(0.0, 1.0, 33)  # samples on a quarter of the outline
ROUNDS = 4  # of refinement, each to a quarter of the width: the value is then exact to 1e-7
ALONG = 400  # samples along the rod, about
REFINED = 4  # intervals along the rod that are looked into, those with the largest samples


@dataclass(frozen=True, eq=False)
class Stress:
    """Stress in Pa at the arc lengths asked for: () or (n,) each.

    ``axial`` is N3 / A; ``bending`` the largest |M1 x2 / I1 - M2 x1 / I2| and ``torsion`` the largest of Saint-Venant's
    shear on the section's outline; ``von_mises`` the largest sqrt((axial + bending)^2 + 3 torsion^2) of its points.
    """

    axial: Array
    bending: Array
    torsion: Array
    von_mises: Array


@dataclass(frozen=True)
class LargestStress:
    """The largest von Mises stress of the rod in Pa, with its place ``s`` and ``point`` (x1, x2) in m, and its parts there."""

    von_mises: float
    s: float
    point: tuple[float, float]
    axial: float
    bending: float
    torsion: float


@dataclass(frozen=True)
class LargestStrain:
    """The largest principal strain of the rod by magnitude, with its place ``s`` and ``point`` (x1, x2) in m."""

    strain: float
    s: float
    point: tuple[float, float]


def stress(rod: Rod, s: Array, N3: Array, M: Array) -> Stress:
    """Return the stress at s (n,) under the axial force N3 (n,) and the moment M (n, 3), section's frame."""
    _shaped(rod)
    bending, torsion, von_mises = (
        _round_outline(rod, s, N3, M, kind)[1]
        for kind in (lambda parts: np.abs(parts[1]), lambda parts: parts[2], _von_mises)
    )
    return Stress(N3 / rod.section.geometry(s, rod.material.poisson).A, bending, torsion, von_mises)


def von_mises(rod: Rod, s: Array, N3: Array, M: Array, p: Array, size: Array) -> Array:
    """Return von Mises' stress (n, m) in Pa at s (n,) and the places p (m,), on the outline made smaller by ``size`` (n,).

    Bending grows with the distance from the section's centre; so does torsion in a circular tube, the one section with a hole.
    """
    _shaped(rod)
    axial, bending, torsion = _parts(rod, s, N3, M, np.broadcast_to(p, (len(s), len(p))))
    return _von_mises((axial, size[:, None] * bending, size[:, None] * torsion))


def largest_stress(rod: Rod, inner: Inner, nodes: Array) -> LargestStress:
    """Return the largest von Mises stress along the rod; its fields are smooth between nodes (n,), which ascend."""
    s, p, value = _along(rod, inner, nodes, _von_mises)
    place = np.array([s])
    axial, bending, torsion = (float(part[0, 0]) for part in _parts(rod, place, *inner(place), np.array([[p]])))
    return LargestStress(value, s, _point(rod, s, p), axial, bending, torsion)


def largest_strain(rod: Rod, inner: Inner, nodes: Array) -> LargestStrain:
    """Return the largest principal strain along the rod; its fields are smooth between nodes (n,), which ascend.

    e = v3 - 1 + ((k - k0) x x)_3,   g = torsion / G:   |e| (1 - nu) / 2 + sqrt((1 + nu)^2 e^2 + g^2) / 2
    """
    material = rod.material

    def strain(parts: tuple[Array, Array, Array]) -> Array:
        axial, bending, torsion = parts
        e = (axial * rod.stretch + bending) / material.E
        g, nu = torsion / material.shear_modulus, material.poisson
        return np.asarray(0.5 * (np.abs(e) * (1.0 - nu) + np.hypot((1.0 + nu) * e, g)))

    s, p, value = _along(rod, inner, nodes, strain)
    return LargestStrain(value, s, _point(rod, s, p))


def _shaped(rod: Rod) -> None:
    if not rod.section.has_shape:
        raise InvalidInput(
            "rod.section is a Stiffness, which has no shape, so stress and strain on its outline are not known; "
            "give a Circle, Tube, Rectangle or Ellipse with its Material."
        )


def _parts(rod: Rod, s: Array, N3: Array, M: Array, p: Array) -> tuple[Array, Array, Array]:
    """Return axial, bending and torsional stress (n, m) in Pa at s (n,) and the places p (n, m) of the outline."""
    g = rod.section.geometry(s, rod.material.poisson)
    x1, x2 = np.moveaxis(rod.section.outline(s, p), -1, 0)
    bending = (M[:, 0] / g.I1)[:, None] * x2 - (M[:, 1] / g.I2)[:, None] * x1
    torsion = np.abs(M[:, 2:]) * rod.section.torsion_shear(s, p)
    return np.broadcast_to((N3 / g.A)[:, None], bending.shape), bending, torsion


def _von_mises(parts: tuple[Array, Array, Array]) -> Array:
    axial, bending, torsion = parts
    return np.asarray(np.hypot(axial + bending, np.sqrt(3.0) * torsion))


def _point(rod: Rod, s: float, p: float) -> tuple[float, float]:
    x1, x2 = rod.section.outline(np.array([s]), np.array([[p]]))[0, 0].tolist()
    return x1, x2


def _round_outline(
    rod: Rod, s: Array, N3: Array, M: Array, kind: Callable[[tuple[Array, Array, Array]], Array]
) -> tuple[Array, Array]:
    """Return place p (n,) and value (n,) of the largest ``kind`` on the outline at s (n,).

    The squares of the stresses have no maximum inside the section: normal stress is linear, and the shear is the gradient of
    a function whose Laplacian is constant.
    """
    s, N3, M = np.repeat(s, 4), np.repeat(N3, 4), np.repeat(M, 4, axis=0)
    starts = np.tile(np.arange(4.0), len(s) // 4)
    quarters = starts[:, None] + QUARTER
    p, value = (part.reshape(-1, 4) for part in _largest(lambda p: kind(_parts(rod, s, N3, M, p)), quarters))
    best = np.argmax(value, axis=1)[:, None]
    return np.take_along_axis(p, best, 1)[:, 0], np.take_along_axis(value, best, 1)[:, 0]


def _along(
    rod: Rod, inner: Inner, nodes: Array, kind: Callable[[tuple[Array, Array, Array]], Array]
) -> tuple[float, float, float]:
    """Return s, p and the value of the largest ``kind`` on the rod's surface."""
    _shaped(rod)

    def sampled(s: Array) -> Array:
        outline = np.concatenate([i + QUARTER for i in range(4)])[None]
        return np.asarray(np.max(kind(_parts(rod, s, *inner(s), outline)), axis=1))

    def largest_at(s: Array) -> Array:
        return _round_outline(rod, s.ravel(), *inner(s.ravel()), kind)[1].reshape(s.shape)

    samples = int(np.clip(ALONG // len(nodes), 2, 16)) + 1
    off = np.minimum(2.0 * ONE_PLACE * nodes[-1], 0.25 * np.diff(nodes))  # from a jump, to the side of the interval
    first, last = nodes[:-1] + np.append(0.0, off[1:]), nodes[1:] - np.append(off[:-1], 0.0)
    s = np.linspace(first, last, samples, axis=1)
    highest = np.argsort(-np.max(sampled(s.ravel()).reshape(s.shape), axis=1))[:REFINED]
    place, value = _largest(largest_at, s[highest])
    best = place[[np.argmax(value)]]
    p, value = _round_outline(rod, best, *inner(best), kind)
    return float(best[0]), float(p[0]), float(value[0])


def _largest(f: Callable[[Array], Array], x: Array) -> tuple[Array, Array]:
    """Return place and value (n,) of the largest f in each row of x (n, m), whose samples lie evenly, and between them.

    The parabola through three samples tells which of several maxima is the largest; then its surroundings are sampled anew.
    """
    value = f(x)
    slope, bend = 0.5 * (value[:, 2:] - value[:, :-2]), value[:, 2:] - 2.0 * value[:, 1:-1] + value[:, :-2]
    peak = np.abs(slope) < -0.5 * bend  # higher than both neighbours
    estimate = value.copy()
    estimate[:, 1:-1] += np.where(peak, -(slope**2) / np.where(peak, 2.0 * bend, 1.0), 0.0)
    rows = np.arange(len(x))
    for _ in range(ROUNDS):
        best = np.argmax(estimate, axis=1)
        low, high = x[rows, np.maximum(best - 1, 0)], x[rows, np.minimum(best + 1, x.shape[1] - 1)]
        x = np.linspace(low, high, 9, axis=1)
        value = estimate = f(x)
    best = np.argmax(value, axis=1)
    return x[rows, best], value[rows, best]
