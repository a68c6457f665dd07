"""Statics: hanging cables with bending stiffness, and rings."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import darboux as dx
from tests.validation.judging import COLLOCATION, DISCRETE, Statement, through_methods
from tests.validation.record import Digits, digits


def _catenary(span):
    """Points of the inextensible catenary of length 1 between (0, 0, 0) and (span, 0, 0)."""
    half = brentq(lambda x: np.sinh(x) / x - 1.0 / span, 1e-6, 20.0)
    x = np.linspace(-half, half, 41)
    return np.stack(
        [span * (x / half + 1.0) / 2.0, 0.0 * x, span / (2.0 * half) * (np.cosh(x) - np.cosh(half))], axis=1
    )


def _hung(EI, span, EA=None):
    rod = dx.Rod(1.0, dx.Stiffness(EI1=EI, GJ=EI, EA=EA), stretch=EA is not None)
    return dx.Equilibrium(rod, dx.Pinned(), dx.Pinned((span, 0, 0)), loads=[dx.LineForce((0, 0, -1.0))])


def _middle(x):
    return np.array([x.n(0.5)[0], -x.r(0.5)[2]])


def _cable(EI, span):
    words = (f"EI/(wL^3)={EI:g}", f"span/L={span:g}")
    return Statement("S12", f"EI/(w L^3) = {EI:g}, span {span:g} L", _hung(EI, span), "H / w L, sag / L", _middle,
                     digits("S12", *words, "H/(wL)") + digits("S12", *words, "sag/L"), (COLLOCATION,), start=_catenary(span))  # fmt: skip


@through_methods([_cable(EI, span) for EI in (0.1, 0.01, 1e-4) for span in (0.5, 0.9)])
def test_hanging_cable(statement, method, judge) -> None:
    """S12 between pinned ends, hung as the catenary, for a stiff rod is not pushed together into it; H. M. Irvine, Cable Structures (1981), with bending stiffness by the record's own computation."""
    judge(statement, method)


CATENARY = {
    span: digits("S12", f"span/L={span:g}: H/(wL)") + digits("S12", f"span/L={span:g}: sag/L") for span in (0.5, 0.9)
}
ELASTIC = {span: digits("S12", f"elastic catenary wL/EA=0.1, span/L={span:g}: H/(wL)") + digits("S12", f"elastic catenary wL/EA=0.1, span/L={span:g}: sag/L") for span in (0.5, 0.9)}  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("stretch", [False, True])
@pytest.mark.parametrize("span", CATENARY)
def test_the_limit_is_the_catenary(span, stretch, judge) -> None:
    """S12: sinh(x) / x = L / span, H = w span / 2 x; elastic: span = H L / EA + (2 H / w) asinh(w L / 2 H); by EI -> 0.

    Between moment-free ends the bending stiffness acts through curvature's square: what is left is of first order in EI,
    and is extrapolated from two values.
    """
    exact = ELASTIC[span] if stretch else CATENARY[span]

    def read(EI):
        return _middle(dx.solve(_hung(EI, span, 10.0 if stretch else None), start=_catenary(span)))

    few, fewer = 1e-4, 2.5e-5
    statement = Statement(
        "S12", f"{'elastic ' * stretch}catenary, span {span:g} L", None, "H / w L, sag / L", None, exact
    )
    left = float(np.max(np.abs(read(few) - read(fewer)))) / 3.0
    judge.continuous(
        statement,
        "Collocation",
        lambda: (4.0 * read(fewer) - read(few)) / 3.0,
        0.25 * left,
        "EI 1e-4, 2.5e-5, extrapolated",
    )


# S13: a quarter of the ring by symmetry, from the load to the section at right angles to it. EI = R = 1.


def _quarter(F):
    words = f"F R^2/EI={F:g}:"
    rod = dx.Rod(np.pi / 2, dx.Stiffness(EI1=1.0, EI2=30.0, GJ=30.0), natural=(-1.0, 0.0, 0.0))
    start = dx.Clamped(tangent=(1, 0, 0), d1=(0, 0, -1))
    end = dx.Guided(tangent=(0, 1, 0), d1=(0, 0, -1))
    problem = dx.Equilibrium(rod, start, end, loads=[dx.EndForce((0, -F / 2, 0))])
    return problem, words


def _pinched(F):
    problem, words = _quarter(F)
    names = ("height", "width", "curvature at the load")
    exact = [digits("S13", words, name) for name in names]
    return Statement("S13", f"F R^2/EI = {F:g}", problem, "height / 2R, width / 2R, k R", lambda x: [x.tip[1], x.tip[0], -x.k(0.0)[0]],
                     exact[0] + exact[1] + exact[2], (COLLOCATION, DISCRETE))  # fmt: skip


TOUCHING = digits("S13", "poles touch")
S13 = [_pinched(F) for F in (0.001, 1, 5, -5, -20)]
S13.append(Statement("S13", "the poles touch", _quarter(float(TOUCHING.value[0]))[0], "height / 2R", lambda x: x.tip[1],
                     Digits(np.zeros(1), 1e-11), (COLLOCATION, DISCRETE)))  # fmt: skip


@through_methods(S13)
def test_pinched_ring(statement, method, judge) -> None:
    """S13, two opposite forces on a ring (the class of R. Frisch-Fay, Flexible Bars, 1962); the record's own computation.

    theta'' = (F / 2 EI) cos(theta), theta = 0 at the load and pi / 2 at the quarter
    """
    judge(statement, method)


LINEAR = digits("S13", "linear: diameter change /"), digits("S13", "linear: diameter change across")


@pytest.mark.parametrize("method", [COLLOCATION, DISCRETE], ids=lambda m: type(m).__name__)
def test_ring_pinched_a_little(method) -> None:
    """S13, S. P. Timoshenko, Strength of Materials II (1956), art. 17: pi / 4 - 2 / pi along the forces, 2 / pi - 1 / 2 across."""
    F = 1e-4
    method = dx.Collocation(rtol=1e-12) if method is COLLOCATION else dx.DiscreteRod(100, extrapolate=True)
    along, across = (float(d.value[0]) for d in LINEAR)
    x = dx.solve(_quarter(F)[0], method)
    back = dx.solve(_quarter(-F)[0], method)  # the difference of both is free of the load's square
    change = (x.tip - back.tip) / F
    np.testing.assert_allclose([-change[1], change[0]], [along, across], rtol=1e-5)


CLOSED = digits("S13", "circle closed from a straight rod"), digits("S13", "moment in it")


def test_straight_rod_closed_to_a_circle(judge) -> None:
    """S13: the energy 2 pi^2 EI / L and the moment 2 pi EI / L."""
    statement = Statement("S13", "closed from a straight rod", dx.Ring(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7))), "energy, moment",
                          lambda x: [x.energy.total, np.linalg.norm(x.m(0.3))], CLOSED[0] + CLOSED[1])  # fmt: skip
    judge(statement, COLLOCATION)
