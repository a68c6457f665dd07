"""Statics in a rotating frame: centrifugal stretch and bending."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from tests import cases
from tests.validation.judging import COLLOCATION, DISCRETE, NEAR, SHOOTING, Statement, through_methods
from tests.validation.record import digits


def _stretched(kL):
    EA = 4.0
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.75, EA=EA, mass=1.0), stretch=True)
    problem = dx.Equilibrium(rod, cases.ALONG_X, loads=[dx.Rotation((0, 0, kL * np.sqrt(EA)))])
    return Statement("S11a", f"kL = {kL:g}", problem, "tip radius / L, n(0) / EA", lambda x: [x.tip[0], x.n(0.0)[0] / EA],
                     digits("S11a", "tip radius", f"kL={kL:g}") + digits("S11a", "root tension", f"kL={kL:g}"))  # fmt: skip


@through_methods([_stretched(kL) for kL in (0.1, 0.5, 1.0)])
def test_spinning_straight_rod(statement, method, judge) -> None:
    """S11a: R = sin(k s) / (k cos kL) with k^2 = rhoA Omega^2 / EA, so R(L) / L = tan(kL) / kL and n(0) = EA (1 / cos kL - 1)."""
    judge(statement, method)


def _round(x):
    return [np.hypot(*x.tip[:2]), x.tip[2]]


def _whirl(Lambda):
    words = ("a/L=0.1", f"Lambda={Lambda:g}:")
    exact = [digits("S11b", *words, name) for name in ("tip radius", "tip height", "root curvature")]
    return Statement("S11b", f"a / L = 0.1, Lambda = {Lambda:g}", cases.spinning(0.1, Lambda), "tip / L, k(0) L",
                     lambda x: [x.tip[0], x.tip[2], np.linalg.norm(x.k(0.0))], exact[0] + exact[1] + exact[2], segments=128)  # fmt: skip


def _whirled(Lambda):
    words = f"a=0 buckled branch, Lambda={Lambda:g}:"
    return Statement("S11b", f"a = 0, Lambda = {Lambda:g}", cases.spinning(0.0, Lambda), "tip / L", _round,
                     digits("S11b", words, "tip radius") + digits("S11b", words, "tip height"), (COLLOCATION,))  # fmt: skip


@through_methods([*map(_whirl, (1.0, 5.0, 50.0)), *map(_whirled, (15.0, 50.0))])
def test_rod_along_the_axis(statement, method, judge) -> None:
    """S11b, clamped along the axis of rotation, beside it or on it; the record's own computation.

    f = rhoA Omega^2 x;  on the axis the straight rod whirls from Lambda = rhoA Omega^2 L^4 / EI = 1.8751^4 on
    """
    judge(statement, method)


WHIRLING = digits("S11b", "critical Lambda")


@pytest.mark.parametrize("method", [SHOOTING, COLLOCATION], ids=str)
def test_onset_of_whirling(method, judge) -> None:
    """S11b: below the critical Lambda the straight rod is stable, above it whirls; the radius grows as the root of the excess."""

    def whirls(Lambda):
        x = dx.solve(cases.spinning(0.0, Lambda), method)
        return int(bool(x.index) or np.hypot(*x.tip[:2]) > 1e-5)

    judge.between("S11b", "a = 0", "critical Lambda", method, whirls, WHIRLING, NEAR)


def _disc(Lambda):
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.75, mass=1.0))
    clamp = dx.Clamped(position=(0.5, 0, 0), tangent=(0, 1, 0))
    words = f"Lambda={Lambda:g}:"
    return Statement("S11c", f"Lambda = {Lambda:g}", dx.Equilibrium(rod, clamp, loads=[dx.Rotation((0, 0, np.sqrt(Lambda)))]), "tip / L, k(0) L",
                     lambda x: [*x.tip[:2], np.linalg.norm(x.k(0.0))], digits("S11c", words, "tip (x,y)") + digits("S11c", words, "root"),
                     (COLLOCATION, SHOOTING, DISCRETE), segments=128)  # fmt: skip


@through_methods([_disc(1.0), _disc(5.0)])
def test_rod_along_the_rim_of_a_disc(statement, method, judge) -> None:
    """S11c, clamped along the circle at L / 2 from the axis, in steady spin; the record's own computation. f = rhoA Omega^2 (x, y)"""
    judge(statement, method)


SHAFTS = {
    "simply supported": ({"start": dx.Pinned(), "end": dx.Roller(along=(0, 0, 1))}, 1, 0),
    "clamped-free shaft": ({}, 1, 0),
    "clamped-free shaft, 2nd": ({}, 2, 1),
    "clamped-clamped": ({"end": dx.Slider(along=(0, 0, 1))}, 1, 0),
    "clamped-pinned": ({"end": dx.Roller(along=(0, 0, 1))}, 1, 0),
}
SPEEDS = {name: digits("T17c", name) for name in SHAFTS}
SPUN = dx.Stiffness(EI1=1.0, EI2=50.0, GJ=30.0, mass=1.0)  # stiff about d2, so that one direction whirls at a time


@pytest.mark.parametrize("method", [SHOOTING, dx.DiscreteRod(800, stable=False)], ids=str)
@pytest.mark.parametrize("name", SHAFTS)
def test_critical_speeds(name, method, judge) -> None:
    """T17c; S. P. Timoshenko, Vibration Problems in Engineering (1937), art. 57: a shaft whirls where rhoA Omega^2 is a squared
    natural frequency.

    The bracket of a discrete rod is three times its second-order error, (beta_2 h)^2 / 12 of the frequency with the largest beta.
    """
    supports, above, below = SHAFTS[name]
    if method.refuses(dx.Equilibrium(dx.Rod(1.0, SPUN), **supports)) is not None:
        pytest.skip("not a problem of this method")

    def index(Omega):
        return dx.solve(dx.Equilibrium(dx.Rod(1.0, SPUN), **supports, loads=[dx.Rotation((0, 0, Omega))]), method).index

    width = 10 * NEAR if method is SHOOTING else 3.0 * (4.73 / 800) ** 2 / 12.0 * (3.0 if above == 2 else 1.0)
    judge.between("T17c", name, "Omega sqrt(rhoA L^4 / EI)", method, index, SPEEDS[name], width, (below, above))
