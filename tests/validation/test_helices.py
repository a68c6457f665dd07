"""Statics: helices, and rods with natural curvature."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from tests import cases
from tests.validation.judging import Statement, through_methods
from tests.validation.record import Digits, digits, stated

U, LENGTH = np.array([-25.0, 10.0, -25.0]), 0.3
EVEN = dx.Stiffness(EI1=1e-3, GJ=1e-3)


def _tip(convention):
    return sum((digits("S06", convention, f"tip {a}") for a in "yz"), digits("S06", convention, "tip x")) * (1 / LENGTH)


def _tip_a():
    return sum((digits("S06", "convention A", f"tip {a} ") for a in "yz"), digits("S06", "convention A", "tip x ")) * (
        1 / LENGTH
    )


# The tangent is e3, e1, e2 in the conventions A, B, C; the other two directors follow in cyclic order.
FRAMES = {"convention A": (0, 1, 2), "convention B": (1, 2, 0), "convention C": (2, 0, 1)}


def _natural(convention):
    axes = list(FRAMES[convention])
    rod = dx.Rod(LENGTH, EVEN, natural=tuple(U[axes]))
    return dx.Equilibrium(rod, start=dx.Clamped(frame=np.eye(3)[:, axes]))


TANGENT = sum(
    (digits("S06", f"convention A: tip tangent {a}") for a in "yz"), digits("S06", "convention A: tip tangent x")
)
S06 = [
    Statement("S06", f"natural helix, {name}", _natural(name), "tip / L", lambda x: x.tip / LENGTH,
              _tip_a() if name.endswith("A") else _tip(name))
    for name in FRAMES
] + [
    Statement("S06", "straight rod, end moment K u", dx.Equilibrium(dx.Rod(LENGTH, EVEN), loads=[dx.EndMoment(tuple(1e-3 * U))]),
              "tip / L, tangent", lambda x: [*x.tip / LENGTH, *x.R(LENGTH)[:, 2]], _tip_a() + TANGENT)
]  # fmt: skip


@through_methods(S06)
def test_constant_curvature(statement, method, judge) -> None:
    """S06, the paper's figure 6: R(s) = exp(s [u x]) by Rodrigues' formula, unloaded by its natural shape, or under a moment."""
    judge(statement, method)


def _axis(x):
    """Radius, pitch, curvature, torsion, turns and rise of an integrated curve of constant curvature, from its points."""
    r = x.r(np.linspace(0.0, LENGTH, 5))
    u = x.R(0.0) @ x.k(0.0)
    axis, size = u / np.linalg.norm(u), np.linalg.norm(u)
    along = (r - r[0]) @ axis
    across = r - np.outer(r @ axis, axis)
    # The circle through three points that the helix leaves on the plane across its axis.
    a, b, c = across[[0, 2, 4]]
    sides = [np.linalg.norm(p - q) for p, q in ((b, c), (c, a), (a, b))]
    radius = np.prod(sides) / (2.0 * np.linalg.norm(np.cross(b - a, c - a)))
    return radius, 2 * np.pi * along[-1] / (size * LENGTH), along[-1]


def _names(convention):
    return digits("S06", convention, "radius"), digits("S06", convention, "pitch")


SHAPES = {name: _names(name) for name in FRAMES}
RISE, DISTANCE = digits("S06", "axial rise"), digits("S06", "end-to-end")
FRENET = digits("S06", "geometric curvature"), digits("S06", "geometric torsion")
SIZE = digits("S06", "|u| = "), digits("S06", "total rotation"), digits("S06", "number of turns")


@pytest.mark.parametrize("name", FRAMES)
def test_radius_and_pitch_of_the_integrated_helix(name, judge) -> None:
    """S06: radius kappa / |u|^2, pitch 2 pi |u3| / |u|^2, from the points of an integrated curve."""
    rod = dx.Rod(LENGTH, EVEN)
    x = dx.integrate(rod, k=tuple(U[list(FRAMES[name])]), n=(0, 0, 0), rtol=1e-12)
    radius, pitch, rise = _axis(x)
    exact = SHAPES[name]
    assert abs(radius / exact[0].value[0] - 1.0) < 1e-10
    assert abs(abs(pitch) / exact[1].value[0] - 1.0) < 1e-10
    if name == "convention A":
        assert abs(abs(rise) / RISE.value[0] - 1.0) < 1e-10
        assert abs(np.linalg.norm(x.tip) / DISTANCE.value[0] - 1.0) < 1e-10
        k = x.k(0.1)
        assert abs(np.hypot(*k[:2]) / FRENET[0].value[0] - 1.0) < 1e-10
        assert abs(k[2] / FRENET[1].value[0] - 1.0) < 1e-10
        turns = np.linalg.norm(k) * LENGTH
        assert abs(turns / (SIZE[0].value[0] * LENGTH) - 1.0) < 1e-10
        assert abs(turns / SIZE[1].value[0] - 1.0) < 1e-10
        assert abs(turns / 2 / np.pi / SIZE[2].value[0] - 1.0) < 1e-10


def _under_moment(name, ratio):
    words = f"C/B={name}:"
    rod = dx.Rod(LENGTH, dx.Stiffness(EI1=1e-3, GJ=1e-3 * ratio))
    problem = dx.Equilibrium(rod, loads=[dx.EndMoment(tuple(1e-3 * U * (1, 1, ratio)))])
    place = sum((digits("S06a", words, f"tip {a}") for a in "yz"), digits("S06a", words, "tip x")) * (1 / LENGTH)
    bend = (digits("S06a", words, "u1") + digits("S06a", words, "u2")) * LENGTH
    stated("S06a", words, "radius")  # follow from the tip and the curvature, which are read
    stated("S06a", words, "pitch")
    return Statement("S06a", f"C/B = {name}", problem, "tip / L, k1 L, k2 L at the tip",
                     lambda x: [*x.tip / LENGTH, *x.k(LENGTH)[:2] * LENGTH], place + bend, segments=128)  # fmt: skip


@through_methods([_under_moment("1.0", 1.0), _under_moment("0.666667", 2 / 3), _under_moment("0.769231", 1 / 1.3)])
def test_straight_rod_under_a_moment_in_space(statement, method, judge) -> None:
    """S06a: t' = (M / B) x t, a helix about M with curvature |M x t| / B and torsion C u3 / B, whatever C is."""
    judge(statement, method)


def _spring(kappa, tau, L=2.0):
    """A natural helix (kappa0, tau0) = (3, 0.8) that end loads hold as the helix (kappa, tau), clamped with d_i = e_i."""
    B, C, kappa0, tau0 = 1.0, 0.75, 3.0, 0.8
    words = f"(kappa,tau)=({kappa},{tau})"
    F, G, radius, pitch = (digits("S06b", name, words) for name in ("axial force", "axial couple", "radius", "pitch"))
    w = np.hypot(kappa, tau)
    e = np.array([0.0, kappa, tau]) / w
    n = float(F.value[0]) * e
    m = float(G.value[0]) * e + float(radius.value[0]) * np.cross((1, 0, 0), n)
    # The exact centreline: d_i' = u x d_i with u = w e fixed in space, r' = d3.
    d3, c, s = np.array([0, 0, 1.0]), np.cos(w * L), np.sin(w * L)
    tip = s / w * d3 + (1 - c) / w * np.cross(e, d3) + (L - s / w) * (e @ d3) * e
    rod = dx.Rod(L, dx.Stiffness(EI1=B, GJ=C), natural=(0.0, kappa0, tau0))
    end = m - np.cross(tip, n)  # m + r x n is constant
    problem = dx.Equilibrium(rod, loads=[dx.EndForce(tuple(n)), dx.EndMoment(tuple(end))])
    read = lambda x: [*x.tip / L, *x.k(0.7 * L), 2 * np.pi * x.k(0.3)[2] / w**2]  # noqa: E731
    return Statement("S06b", f"kappa = {kappa}, tau = {tau}", problem, "tip / L, k, pitch", read,
                     Digits(np.array([*tip / L, 0.0, kappa, tau])) + pitch, segments=256)  # fmt: skip


@through_methods([_spring(3.0, 1.3), _spring(2.5, 1.6)])
def test_spring_under_an_axial_wrench(statement, method, judge) -> None:
    """S06b; A. E. H. Love (1927), art. 271.

    F = (w^2 / kappa) (C (tau - tau0) cos a - B (kappa - kappa0) sin a),  G = C (tau - tau0) sin a + B (kappa - kappa0) cos a
    """
    judge(statement, method)


LONG = dx.Rod(11.0, dx.Stiffness(EI1=1.0, GJ=0.75))


def _words(M):
    return [digits("S06c", name, f"M/sqrt(BT)={M:g}") for name in ("max angle", "end shortening", "end rotation")]


LOCAL = {M: _words(M) for M in (0.5, 1.8)}


@pytest.mark.parametrize("M", LOCAL)
def test_localised_helix(M, judge) -> None:
    """S06c, a twisted rod without ends under the tension T; J. Coyne, IEEE J. Ocean. Eng. 15 (1990) 72.

    cos(theta) = 1 - 2 a^2 sech^2(a s sqrt(T/B)),  a^2 = 1 - M^2 / 4 B T: shortening 4 a sqrt(B/T), rotation 4 arccos(M / 2 sqrt(BT))

    Half of it is integrated, from the middle, where the rod is at its steepest. Errors grow as exp(a s), tails die as
    exp(-2 a s): at a s = 11 both are below 1e-6.
    """
    steepest, shortening, rotation = LOCAL[M]
    theta = float(steepest.value[0])
    a = np.sqrt(1.0 - M**2 / 4.0)
    s = 11.0 / a
    # In the middle theta' = 0 and t' = psi' e3 x t; the twist is M / C.
    tangent = np.array([0.0, np.sin(theta), np.cos(theta)])
    frame = np.column_stack([(1, 0, 0), np.cross(tangent, (1, 0, 0)), tangent])
    psi = M / (1.0 + np.cos(theta))  # the azimuth's rate, hence t' = psi' e3 x t
    bend = psi * np.cross((0, 0, 1), tangent)
    u = np.cross(tangent, bend) + (M / 0.75) * tangent
    rod = dx.Rod(s, LONG.section)
    x = dx.integrate(rod, k=tuple(frame.T @ u), n=(0, 0, 1.0), frame=frame, rtol=1e-12)
    at = np.linspace(0.0, s, 4001)
    t = x.R(at)[:, :, 2]
    law = np.max(np.abs(t[:, 2] - (1 - 2 * a**2 / np.cosh(a * at) ** 2)))
    sheared = 2.0 * (s - (x.r(s) - x.r(0.0))[2])
    integrand = M / (1.0 + t[:, 2]) * (1.0 - t[:, 2])  # psi' (1 - cos theta)
    turned = 2.0 * float(np.sum((integrand[1:] + integrand[:-1]) / 2 * np.diff(at)))
    assert law < 1e-7
    judge.continuous(Statement("S06c", f"M = {M:g}", None, "shortening, rotation (rad)", None, shortening + rotation),
                     "integrate", lambda: [sheared, turned], 1e-6, "rtol 1e-12, 4000 intervals for the rotation")  # fmt: skip


LOOP = [digits("S06d", name) for name in ("max curvature", "height", "end shortening", "bending energy")]


def test_planar_loop(judge) -> None:
    """S06d, L. Euler's solitary loop under the tension T, half of it integrated from its top; lambda = sqrt(EI / T).

    theta = 4 arctan(exp(s / lambda)),  height 2 lambda,  shortening 4 lambda,  bending energy 4 sqrt(EI T)
    """
    s = 9.0
    rod = dx.Rod(s, LONG.section)
    frame = np.column_stack([(0, 1, 0), (1, 0, 0), (0, 0, -1.0)])  # at its top the rod runs backwards, along -z
    x = dx.integrate(rod, k=(0.0, float(LOOP[0].value[0]), 0.0), n=(0, 0, 1.0), frame=frame, rtol=1e-12)
    at = np.linspace(0.0, s, 4001)
    k = x.k(at)[:, 1]
    energy = 2.0 * float(np.sum((k[1:] ** 2 + k[:-1] ** 2) / 2 * np.diff(at))) / 2.0
    top = np.linalg.norm((x.r(s) - x.r(0.0))[:2]) + 2.0 / np.cosh(s)  # where it ends it still stands 2 sech(s) high
    exact = sum(LOOP[2:], LOOP[1])
    assert np.max(np.abs(k - 2.0 / np.cosh(at))) < 1e-7
    judge.continuous(Statement("S06d", "", None, "height, shortening, energy", None, exact), "integrate",
                     lambda: [top, 2.0 * (s - (x.r(s) - x.r(0.0))[2]), energy], 1e-6, "rtol 1e-12")  # fmt: skip


def _hanging(name, problem, segments=128):
    unit = problem.rod.length
    place, tangent, moment = (
        digits("S10", f"{name}:", what) for what in ("tip position", "tip tangent", "root moment")
    )
    EI = float(problem.rod.stiffness(np.zeros(1)).EI1[0])
    largest = float(np.max(np.abs(moment.value)))
    read = lambda x: [*x.tip / unit, *x.R(unit)[:, 2], *x.m(0.0) / EI / largest]  # noqa: E731
    return Statement("S10", name, problem, "tip / L, tangent, m(0) / largest", read,
                     place * (1 / unit) + tangent + moment * (1 / largest), segments=segments)  # fmt: skip


RUBBER_HELIX = dx.Equilibrium(
    dx.Rod(0.3, cases.RUBBER.section, dx.Material(E=1e6, nu=0.5, density=1e3), natural=(-25.0, 10.0, -25.0)),
    start=dx.Clamped(tangent=(1, 0, 0), d1=(0, 1, 0)), loads=[dx.Gravity((0, 0, -9.81))],
)  # fmt: skip


@through_methods(
    [
        _hanging("H1", cases.hanging_helix(20.0)),
        _hanging("H2", cases.hanging_helix(200.0)),
        _hanging("H4", RUBBER_HELIX, 256),
    ]
)
def test_hanging_helix(statement, method, judge) -> None:
    """S10, a natural helix under its weight, followed from no weight; the record's own computation, by two methods."""
    judge(statement, method)
