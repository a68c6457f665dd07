"""Statics: columns past their critical loads, and rods held at both ends.

A straight rod that is held at both ends and pushed leaves its line by itself only with `Collocation`. `DiscreteRod()`
leaves it too, but under a dead load it may fall past the elastica, to the rod that has turned round and is pulled; it is held to
the clamped column, where there is nothing to fall past.
"""

from __future__ import annotations

import numpy as np

import darboux as dx
from tests import cases
from tests.validation.judging import COLLOCATION, STABLE_SIDE, Statement, through_methods
from tests.validation.record import Digits, digits, stated

UP = (0.0, 0.0, 1.0)
UNIT = cases.UNIT
FLAT = dx.Rod(
    1.0, dx.Stiffness(EI1=10.0, EI2=1.0, GJ=10.0)
)  # bends about d2, and so much less about d1 that it stays plane
PI2 = np.pi**2


def sideways(x):
    """How far the middle stands from the line through the ends, which lies along z."""
    return np.hypot(*x.r(0.5)[:2])


HELD = {  # the supports, the critical load, and what is read besides the distance of the ends
    "pinned, pinned": ({"start": dx.Pinned(), "end": dx.Roller(along=UP)}, PI2, lambda x: [x.tip[2], sideways(x)]),
    "clamped, clamped": ({"end": dx.Slider(along=UP)}, 4 * PI2, lambda x: [x.tip[2], sideways(x)]),
    "clamped, free": ({}, PI2 / 4, lambda x: [x.tip[2], np.hypot(*x.tip[:2])]),
}


def _column(supports, P):
    return dx.Equilibrium(FLAT, **supports, loads=[dx.EndForce((0, 0, -P))])


S04 = [
    Statement("S04", f"{name}, alpha = {alpha:g}", _column(supports, critical * float(digits("S04", "P/Pcr, ", f"alpha={alpha:g} ").value[0])),
              "end distance / L, deflection / L", read,
              digits("S04", "end distance/L", f"alpha={alpha:g} ") + digits("S04", "cantilever form" if name == "clamped, free" else "midspan deflection/L, alpha", f"alpha={alpha:g} "),
              STABLE_SIDE if name == "clamped, free" else (COLLOCATION,), segments=128, long=alpha not in (60, 120))
    for name, (supports, critical, read) in HELD.items()
    for alpha in ((20, 40, 60, 100, 120, 160, 170) if name == "clamped, free" else (20, 40, 60, 100, 120))
] + [
    Statement("S04", "the pinned ends touch", _column(HELD["pinned, pinned"][0], PI2 * float(digits("S04", "P/Pcr where the ends touch").value[0])),
              "end distance / L, deflection / L", HELD["pinned, pinned"][2],
              Digits(np.zeros(1)) + digits("S04", "midspan deflection/L where"), (COLLOCATION,), long=True)
]  # fmt: skip
for _alpha in (20, 40, 60, 100, 120, 160, 170):
    stated("S04", "end shortening/L", f"alpha={_alpha} ")  # 1 - the distance


@through_methods(S04)
def test_past_the_critical_load(statement, method, judge) -> None:
    """S04; S. P. Timoshenko and J. M. Gere, Theory of Elastic Stability (1961), sec. 2.7, alpha the angle at the inflexion.

    k = sin(alpha / 2):  P / Pcr = (2 K / pi)^2,  distance of the ends 2 E / K - 1,  deflection k / K (cantilever 2 k / K)
    """
    judge(statement, method)


SLOPE = digits("S04", "dP/P slope")
TOUCH = digits("S04", "k^2 where ends touch"), digits("S04", "alpha [deg] where")


def test_the_slope_behind_the_critical_load(judge) -> None:
    """S04: P / Pcr = 1 + shortening / 2 + ..., from two shortenings, extrapolated to none; k^2 = sin^2(alpha / 2) of the touch."""
    slopes = []
    for D in (0.01, 0.005):
        x = dx.solve(dx.Equilibrium(FLAT, dx.Pinned(), dx.Pinned((0, 0, 1.0 - D))))
        slopes.append((-x.n(0.0)[2] / PI2 - 1.0) / D)
    assert abs(2 * slopes[1] - slopes[0] - SLOPE.value[0]) < 5e-5  # what is left is of the order of D^2
    assert abs(np.sin(np.radians(TOUCH[1].value[0]) / 2) ** 2 - TOUCH[0].value[0]) < 1e-14


def _clamped_pinned(D):
    P, V, M, a = (digits("S15", f"D/L={D:g}", name) for name in ("P L^2", "transverse", "moment", "angle"))
    read = lambda x: [-x.n(0.0)[2], np.hypot(*x.n(0.0)[:2]), np.hypot(*x.m(0.0)[:2]), np.arccos(x.R(1.0)[2, 2])]  # noqa: E731
    folded = Digits(np.arccos(np.cos(a.value)), a.uncertainty)
    return Statement("S15", f"D/L = {D:g}", dx.Equilibrium(FLAT, end=dx.Pinned((0, 0, 1.0 - D))), "P, V, M, end angle", read,
                     P + V + M + folded, (COLLOCATION,))  # fmt: skip


@through_methods([_clamped_pinned(D) for D in (0.05, 0.1, 0.5)])
def test_clamped_and_pinned(statement, method, judge) -> None:
    """S15, clamped at one end and pinned at the other, pushed together by D; the record's own computation. n = (-P, V)."""
    judge(statement, method)


def _posed():
    """The end's pose on the way from a quarter circle: Ry(pi / 2) Rz(0.8 f) at (1 - f)(2, 0, 2) / pi + f (0.3, 0.2, 0.5)."""
    exact = [digits("S14", name) for name in ("root moment", "root force", "elastic energy", "midpoint")]
    read = lambda x: [*x.m(0.0), *x.n(0.0), x.energy.total, *x.r(0.5)]  # noqa: E731
    return Statement("S14", "isotropic", cases.posed(), "m(0), n(0), energy, r(L/2)", read, sum(exact[1:], exact[0]), segments=256)  # fmt: skip


@through_methods([_posed()])
def test_both_ends_clamped_in_space(statement, method, judge) -> None:
    """S14, the end at (0.3, 0.2, 0.5) with R = Ry(pi / 2) Rz(0.8); the record's own computation. One of several equilibria."""
    judge(statement, method)


def _writhing(x):
    n, m = x.n(0.0), x.m(0.0)
    return [m[2], n[2], np.hypot(*n[:2]), sideways(x), np.hypot(*m[:2])]


def _twisted(D, Phi):
    names = ("axial moment", "axial force", "lateral force", "lateral distance", "bending moment")
    exact = [digits("S14b", f"D/L={D:g}", name) for name in names]
    problem = dx.Equilibrium(UNIT, end=dx.Clamped(position=(0, 0, 1.0 - D), twist=Phi))
    return Statement("S14b", f"D/L = {D:g}, Phi = {Phi:g}", problem, "m3, n3, |n12|, distance, |m12|", _writhing,
                     sum(exact[1:], exact[0]), (COLLOCATION,))  # fmt: skip


@through_methods([_twisted(0.2, 2.0), _twisted(0.4, 4.0)])
def test_pushed_together_and_twisted(statement, method, judge) -> None:
    """S14b, clamps D closer and turned by Phi; G. H. M. van der Heijden, S. Neukirch, V. G. A. Goss and J. M. T. Thompson,
    Int. J. Mech. Sci. 45 (2003) 161, digits of the record's own computation."""
    judge(statement, method)
