"""Geometry of curves: parallel frames, writhe, torsion and link."""

from __future__ import annotations

import numpy as np
import pytest

from darboux.link import writhe, writhe_of_polygon
from darboux.natural import smallest_rotation
from tests.validation.judging import Statement
from tests.validation.record import CASES, digits, stated


def holonomy(edges):
    """The angle by which minimal rotations from edge to edge, and back to the first, turn a frame about it."""
    t = edges / np.linalg.norm(edges, axis=1, keepdims=True)
    R = np.eye(3)
    for a, b in zip(t, np.roll(t, -1, axis=0), strict=True):
        R = smallest_rotation(a, b) @ R
    across = np.cross(t[0], (0.3, 0.5, 0.8))
    across /= np.linalg.norm(across)
    turned = R @ across
    return np.arctan2(np.cross(across, turned) @ t[0], across @ turned)


def same_angle(a, b):
    return np.angle(np.exp(1j * (np.asarray(a) - np.asarray(b))))


ROUND = {b: digits("G01", f"continuous, tangent at {b} deg") for b in (30, 60, 80)}
CORNERED = {(N, b): digits("G01", f"discrete, {N} edges per turn, {b} deg") for N in (6, 12, 48) for b in ROUND}


def _circle(N, b):
    psi = 2 * np.pi * np.arange(N) / N
    beta = np.radians(b)
    return np.stack([np.sin(beta) * np.cos(psi), np.sin(beta) * np.sin(psi), np.cos(beta) + 0 * psi], axis=1)


@pytest.mark.parametrize(("N", "b"), CORNERED)
def test_parallel_frame_of_a_polygon(N, b, judge) -> None:
    """G01; F. B. Fuller, Proc. Natl. Acad. Sci. USA 75 (1978) 3557: the area of the spherical polygon of the tangents.

    N 2 atan2(t sin(2 pi / N), 1 + t cos(2 pi / N)),  t = tan^2(b / 2): the frame turns by it, up to whole turns
    """
    exact = CORNERED[N, b]
    angle = exact.value + same_angle(holonomy(_circle(N, b)), exact.value)
    judge.continuous(
        Statement("G01", f"{N} edges, {b} degrees", None, "holonomy (rad)", None, exact),
        "smallest_rotation",
        lambda: angle,
        1e-13,
        "exact",
    )


@pytest.mark.parametrize("b", ROUND)
def test_parallel_frame_of_a_helix(b, judge) -> None:
    """G01, a smooth helix: 2 pi (1 - cos b), the solid angle of the tangents, to which polygons tend with 1 / N^2."""
    exact = ROUND[b]
    judge.discrete("G01", f"helix, {b} degrees", "holonomy (rad)", "smallest_rotation",
                          lambda N: exact.value + same_angle(holonomy(_circle(N, b)), exact.value), exact, 64)  # fmt: skip


# G02: curves by their formulas, with t in [0, 2 pi)


def _torus(n, R, a):
    return lambda t: np.stack(
        [(R + a * np.cos(n * t)) * np.cos(t), (R + a * np.cos(n * t)) * np.sin(t), a * np.sin(n * t)], axis=1
    )


def _trefoil(t):
    return np.stack([(2 + np.cos(3 * t)) * np.cos(2 * t), (2 + np.cos(3 * t)) * np.sin(2 * t), np.sin(3 * t)], axis=1)


def _seam(t):
    r = np.stack(
        [np.cos(t) + 0.4 * np.cos(3 * t), np.sin(t) - 0.4 * np.sin(3 * t), 2 * np.sqrt(0.4) * np.sin(2 * t)], axis=1
    )
    return r / np.linalg.norm(r, axis=1, keepdims=True)


CURVES = {
    "toroidal helix n=3, R=1, a=0.3": _torus(3, 1.0, 0.3),
    "toroidal helix n=8, R=1, a=0.25": _torus(8, 1.0, 0.25),
    "trefoil torus knot (2,3), R=2, a=1": _trefoil,
    "spherical seam curve": _seam,
    "tilted wobble x=cos t,y=sin t,z=.5 sin 2t": lambda t: np.stack(
        [np.cos(t), np.sin(t), 0.5 * np.sin(2 * t)], axis=1
    ),
    "chiral unknot z=.5 sin(2t), r=1+.3cos(3t)..": lambda t: np.stack(
        [(1 + 0.3 * np.cos(2 * t)) * np.cos(t), (1 + 0.3 * np.cos(2 * t)) * np.sin(t), 0.5 * np.sin(2 * t)], axis=1
    ),
}
SPUN = {
    name: tuple(
        digits("G02", name, what)
        for what in ("writhe", "total torsion/(2 pi)", "Frenet self-linking", "Bishop holonomy")
    )
    for name in CURVES
}


@pytest.mark.parametrize("name", CURVES)
def test_writhe(name, judge) -> None:
    """G02, smooth closed curves; Fuller (1971), Gauss' double integral.

    `link.writhe` goes on until it changes by less than its goal, 1e-8.
    """
    nodes = np.linspace(0.0, 2 * np.pi, 17)
    judge.continuous(Statement("G02", name.split(" z=")[0].split(" x=")[0], None, "writhe", None, SPUN[name][0]), "link.writhe",
                     lambda: writhe(CURVES[name], nodes, True), 1e-8, "goal 1e-8")  # fmt: skip


@pytest.mark.parametrize("name", CURVES)
def test_writhe_and_torsion_make_whole_numbers(name) -> None:
    """G02; G. Calugareanu, Czech. Math. J. 11 (1961) 588: writhe + total torsion / 2 pi is the link of the normal, a whole number.

    The torsion is (r' x r'') . r''' / |r' x r''|^2 |r'|, by the series of the curve; the parallel frame returns turned by the writhe.
    """
    _, torsion, linking, bishop = SPUN[name]
    N = 4096
    t = 2 * np.pi * np.arange(N) / N
    waves = np.fft.fftfreq(N, 1.0 / N) * 1j
    a, b, c = (np.fft.ifft(np.fft.fft(CURVES[name](t), axis=0) * (waves**k)[:, None], axis=0).real for k in (1, 2, 3))
    normal = np.cross(a, b)
    tau = np.sum(normal * c, axis=1) / np.sum(normal**2, axis=1) * np.linalg.norm(a, axis=1)
    total = float(np.mean(tau))
    assert abs(total - torsion.value[0]) < 1e-8
    ours = writhe(CURVES[name], np.linspace(0.0, 2 * np.pi, 17), True)
    assert abs(ours + total - linking.value[0]) < 2e-8
    turned = same_angle(2 * np.pi * bishop.value[0], 2 * np.pi * ours)
    assert abs(turned) < 2 * np.pi * (1e-8 + bishop.uncertainty)


# G03: polygons

GIVEN = {q["name"].split(":")[0]: np.array(q["value"]) for q in CASES["G03"]["quantities"] if isinstance(q["value"], list) and q["name"].endswith("vertices")}  # fmt: skip
stated("G03", "vertices")
POLYGONS = GIVEN | {f"{N}-gon": _trefoil(2 * np.pi * np.arange(N) / N) for N in (12, 40)}
TURNED = {name: (digits("G03", name, "polygon writhe"), digits("G03", name, "holonomy")) for name in POLYGONS}


@pytest.mark.parametrize("name", POLYGONS)
def test_polygons(name, judge) -> None:
    """G03; K. Klenin and J. Langowski, Biopolymers 54 (2000) 307: the writhe of a polygon, exact; its parallel frame turns by it."""
    x = POLYGONS[name]
    wr, turned = TURNED[name]
    judge.continuous(
        Statement("G03", name, None, "writhe", None, wr),
        "writhe_of_polygon",
        lambda: writhe_of_polygon(np.append(x, x[:1], axis=0)),
        1e-13,
        "exact",
    )
    angle = holonomy(np.roll(x, -1, axis=0) - x)
    assert abs(same_angle(angle, 2 * np.pi * turned.value[0])) < 1e-11


POLYGONAL = next(q["value"] for q in CASES["G03"]["quantities"] if q["name"].startswith("polygon writhe of the N-gon"))
stated("G03", "polygon writhe of the N-gon")


@pytest.mark.parametrize(("N", "off"), POLYGONAL)
def test_polygons_on_the_trefoil(N, off) -> None:
    """G03: the writhe of polygons on the trefoil less that of the curve, which has six digits and is of second order."""
    x = _trefoil(2 * np.pi * np.arange(N + 1) / N)
    x[-1] = x[0]
    smooth = SPUN["trefoil torus knot (2,3), R=2, a=1"][0].value[0]
    assert abs(writhe_of_polygon(x) - smooth - off) < 1e-6 * max(1.0, off)
