"""Statics: end loads in three dimensions."""

from __future__ import annotations

import numpy as np

import darboux as dx
from tests import cases
from tests.cases import COSSERAT, GJ_POLAR, bathe_bolourchi
from tests.validation.judging import Statement, through_methods
from tests.validation.record import digits

GJ_SAINT_VENANT = 5e6 * 0.14057701495515368
VARIANTS = {
    "V1": (GJ_POLAR, {}),
    "V2": (GJ_POLAR, {"EA": 1e7, "GA1": 5e6, "GA2": 5e6}),
    "V3": (GJ_SAINT_VENANT, {"EA": 1e7, "GA1": 5e6 * 5 / 6, "GA2": 5e6 * 5 / 6}),
    "V4": (GJ_SAINT_VENANT, {"EA": 1e7, "GA1": 5e6, "GA2": 5e6}),
}
ARC_END = np.array([100.0 * (1.0 - np.sqrt(0.5)), 100.0 * np.sqrt(0.5), 0.0])


def _bend(variant, P):
    GJ, stiffness = VARIANTS[variant]
    place = [digits("S07", f"{variant} ", f"tip {a},", f"P={P}") for a in "xyz"]
    moved = digits("S07", f"{variant} ", "tip displacement", f"P={P}")
    problem = bathe_bolourchi(P, GJ, **stiffness)
    return Statement("S07", f"{variant}, P = {P}", problem, "tip / R, displacement / R", lambda x: np.append(x.tip, x.tip - ARC_END) / 100.0,
                     (place[0] + place[1] + place[2] + moved) * 0.01, segments=32, long=variant == "V4")  # fmt: skip


@through_methods([_bend(variant, P) for variant in VARIANTS for P in (300, 600)])
def test_bend_of_45_degrees(statement, method, judge) -> None:
    """S07; K.-J. Bathe and S. Bolourchi, Int. J. Numer. Methods Eng. 14 (1979) 961, digits of the record's own computation.

    V1 inextensible, GJ = G (I1 + I2); V2 with stretch and shear; V3, V4 with Saint-Venant's torsion constant of the square
    """
    judge(statement, method)


PRINCETON = dx.Stiffness(  # d1 along the height y (stiff), d2 along z, d3 along x
    EI1=2.428734443353508, EI2=36.27936354403289, GJ=3.103338270807439,
    EA=2841908.71416, GA1=903914.9854198474, GA2=903914.9854198474,
)  # fmt: skip


def _princeton(n, P, beta):
    words = f"P{n}={P:g} N, beta={beta}:"
    angle = np.radians(beta)
    problem = dx.Equilibrium(
        dx.Rod(0.508, PRINCETON, stretch=True, shear=True), start=dx.Clamped(tangent=(1, 0, 0), d1=(0, 1, 0)),
        loads=[dx.EndForce((0, -P * np.cos(angle), P * np.sin(angle)))],
    )  # fmt: skip

    def read(x):
        d1 = x.R(0.508)[:, 0]
        return [*(x.tip - (0.508, 0, 0)) / 0.508, np.arctan2(d1[2], d1[1])]

    exact = digits("S08", words, "tip displacement") * (1 / 0.508) + digits("S08", words, "twist angle")
    return Statement(
        "S08",
        f"P = {P:g} N at {beta} degrees",
        problem,
        "displacement / L, twist (rad)",
        read,
        exact,
        long=beta not in (0, 45),
    )


@through_methods([_princeton(n, P, b) for n, P in ((1, 4.448), (3, 13.345)) for b in (0, 15, 30, 45, 60, 75, 90)])
def test_princeton_beam(statement, method, judge) -> None:
    """S08; E. H. Dowell and J. J. Traybar, AMRL TR 1194 and 1257 (1975): a strip under a tip force at an angle.

    Digits of the record's own computation, with E I, Saint-Venant's G J, E A and 5/6 G A.
    """
    judge(statement, method)


def _space(case, words, problem, force=""):
    frame = digits(case, words, "tip tangent" if case == "S09" else "tip d3") + digits(case, words, "tip d1")
    moment = digits(case, words, "root moment")
    largest = float(np.max(np.abs(moment.value)))
    read = lambda x: [*x.tip, *x.R(1.0)[:, 2], *x.R(1.0)[:, 0], *x.m(0.0) / largest]  # noqa: E731
    name = words.replace(": F=", "; F=").rstrip(":")
    return Statement(case, name, problem, "tip / L, d3, d1, m(0) / largest", read,
                     digits(case, words.rstrip(":") + force, "tip position") + frame + moment * (1 / largest))  # fmt: skip


ONE, THREE = ((1.5, -1, -0.8), (0.4, 0.6, 0.9)), ((0, 0, -2), (0.5, 0.2, 4))
S09 = [
    _space("S09", f"{model}, {load}", cases.anisotropic(*how, **flags))
    for model, flags in (("Kirchhoff", {}), ("GA2=200", COSSERAT))
    for load, how in (("load 1", ONE), ("load 3", THREE))
]


@through_methods(S09)
def test_anisotropic_rod(statement, method, judge) -> None:
    """S09, EI1 = 1, EI2 = 3, GJ = 0.7, dead force and dead moment at the tip; the record's own computation, by two methods."""
    judge(statement, method)


S09B = [
    _space("S09b", "strip B1=1,B2=10,C=1, natural twist u3=2 pi" + words, cases.strip(force), f", F={named}")
    for words, force, named in (
        (":", (2.0, 1.0, -1.0), "[2.0, 1.0, -1.0]:"),
        (", axial tension:", (0.5, 0.0, 20.0), "[0.5, 0, 20.0]:"),
    )
]


@through_methods(S09B)
def test_twisted_strip(statement, method, judge) -> None:
    """S09b, a strip with one natural turn of twist under a dead force; the record's own computation, by two methods."""
    judge(statement, method)
