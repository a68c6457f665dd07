"""Statics: cantilevers, under dead loads, followers, weight, shear and stretch."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from tests import cases
from tests.cases import ALONG_X, UNIT, turn_z
from tests.validation.judging import DISCRETE, Statement, through_methods
from tests.validation.record import Digits, digits, stated

IN_PLANE = dx.Clamped(tangent=(1, 0, 0), d1=(0, 1, 0))  # d1 is the normal, d2 = -e3


def tip(x):
    return x.tip[:2] / x.problem.rod.length


def angle(x, s=None):
    """The angle of the tangent to +x in the plane x y, without jumps: an integral of the curvature would be no check."""
    s = np.linspace(0.0, x.problem.rod.length, 257)
    t = x.R(s)[:, :, 2]
    return np.unwrap(np.arctan2(t[:, 1], t[:, 0]))[-1]


def whole(x):
    """Tip, tip angle and root moment, of a rod with L = EI = 1 in the plane x y."""
    return [*x.tip[:2], angle(x), x.m(0.0)[2]]


# S00: small loads. The load is 1e-4, so that what is not linear is 1e-8 of the deflection, which the tolerance allows.

SMALL = 1e-4
ALLOWED = 1e-6  # the record's own: rounding and tolerance over a deflection of 1e-5
STOUT = dx.Stiffness(EI1=1.0, EI2=1.0, GJ=0.7, EA=50.0, GA1=20.0, GA2=20.0)
LINEAR = {  # the rod, its loads, what is read over the load, and what that is
    "tip force": ("tip force F", {}, [dx.EndForce((0, SMALL, 0))], lambda x: [x.tip[1], angle(x)], [1 / 3, 1 / 2]),
    "tip force, shear": ("tip force F", {"shear": True, "stretch": True}, [dx.EndForce((0, SMALL, 0))], lambda x: x.tip[1], [1 / 3 + 1 / 20]),
    "tip couple": ("tip couple M", {}, [dx.EndMoment((0, 0, SMALL))], lambda x: [x.tip[1], angle(x)], [1 / 2, 1.0]),
    "uniform load": ("uniform load w", {}, [dx.LineForce((0, SMALL, 0))], lambda x: [x.tip[1], angle(x)], [1 / 8, 1 / 6]),
    "uniform load, shear": ("uniform load w", {"shear": True, "stretch": True}, [dx.LineForce((0, SMALL, 0))], lambda x: x.tip[1], [1 / 8 + 1 / 40]),
    "axial": ("axial F L/EA", {"stretch": True}, [dx.EndForce((SMALL, 0, 0))], lambda x: x.tip[0] - 1, [1 / 50]),
    "torsion": ("axial F L/EA", {}, [dx.EndMoment((SMALL, 0, 0))], lambda x: x.k(0.5)[2], [1 / 0.7]),
}  # fmt: skip
ARCS = {a: (digits("S00", f"arc of {a} deg, radius"), digits("S00", f"arc of {a} deg: b")) for a in (45, 90, 180)}
for _quantity, *_ in LINEAR.values():
    stated("S00", _quantity)
SHARP = (dx.Collocation(rtol=1e-12), dx.Shooting(rtol=1e-12), dx.Elastica(rtol=1e-12), DISCRETE)


@pytest.mark.parametrize("method", SHARP, ids=lambda m: type(m).__name__)
@pytest.mark.parametrize("name", LINEAR)
def test_small_loads(name, method, judge) -> None:
    """S00, small loads on a straight rod; Castigliano.

    F L^3 / 3 EI + F L / GA, F L^2 / 2 EI;  M L^2 / 2 EI, M L / EI;  w L^4 / 8 EI + w L^2 / 2 GA, w L^3 / 6 EI;
    F L / EA, T L / GJ
    """
    _, model, loads, read, exact = LINEAR[name]
    problem = dx.Equilibrium(dx.Rod(1.0, STOUT, **model), ALONG_X, loads=loads)
    _small(Statement("S00", name, problem, "response / load", lambda x: np.array(read(x)) / SMALL,
                     Digits(np.array(exact))), method, judge)  # fmt: skip


@pytest.mark.parametrize("method", SHARP, ids=lambda m: type(m).__name__)
@pytest.mark.parametrize("degrees", ARCS)
def test_small_loads_on_an_arc(degrees, method, judge) -> None:
    """S00, an arc of radius R pulled out of its plane; Castigliano: (P R^3 / EI) a + (P R^3 / GJ) b."""
    a, b = ARCS[degrees]
    rod = dx.Rod(np.radians(degrees), dx.Stiffness(EI1=1.0, GJ=0.7), natural=(0.0, 1.0, 0.0))
    problem = dx.Equilibrium(rod, loads=[dx.EndForce((0, SMALL, 0))])
    _small(Statement("S00", f"arc of {degrees} degrees", problem, "deflection / P", lambda x: x.tip[1] / SMALL,
                     Digits(a.value + b.value / 0.7)), method, judge)  # fmt: skip


def _small(statement, method, judge) -> None:
    if method.refuses(statement.problem) is not None:
        pytest.skip("not a problem of this method")
    if method is DISCRETE:
        judge.discrete(statement.case, statement.name, statement.what, "DiscreteRod",
                              lambda N: statement.read(dx.solve(statement.problem, dx.DiscreteRod(N))), statement.exact, 32, ALLOWED)  # fmt: skip
    else:
        judge.continuous(statement, type(method).__name__, lambda: statement.read(dx.solve(statement.problem, method)),
                         ALLOWED, f"rtol {method.rtol:g}")  # fmt: skip


S01 = [
    Statement(
        "S01", f"M L / 2 pi EI = {turns:g}", cases.rolled(turns), "tip / L, angle", lambda x: [*x.tip[:2], angle(x)],
        digits("S01", "tip x/L", f"={turns}") + digits("S01", "tip y/L", f"={turns}") + digits("S01", "rotation", f"={turns}"),
    )
    for turns in (0.25, 0.5, 1.0, 2.0)
]  # fmt: skip


@through_methods(S01)
def test_rolled_up_by_a_moment(statement, method, judge) -> None:
    """S01, L. Euler, Methodus inveniendi (1744), additamentum 1: a dead moment M at the tip makes an arc.

    x = sin(M L / EI) / (M L / EI),  y = (1 - cos(M L / EI)) / (M L / EI)
    """
    judge(statement, method)


def _four(case, *words):
    names = ("tip x", "tip y", "tip angle", "root curvature")
    return sum((digits(case, name, *words) for name in names[1:]), digits(case, names[0], *words))


def _inclined(F, degrees):
    force = turn_z(np.radians(degrees)) @ (F, 0, 0)
    return dx.Equilibrium(UNIT, start=ALONG_X, loads=[dx.EndForce(force)])


S02 = [
    Statement("S02", f"P L^2/EI = {P:g}", cases.tip_force(P), "tip / L, angle, k(0) L", whole, _four("S02", f"P L^2/EI={P:g}"))
    for P in (0.1, 1, 2, 5, 15)
] + [
    Statement("S02b", f"F L^2/EI = {F:g} at {beta} degrees", _inclined(F, beta), "tip / L, angle, k(0) L", whole,
              _four("S02b", f"F L^2/EI={F}", f"direction {beta} deg"))
    for F, beta in ((2, 135), (5, 135), (5, 45))
]  # fmt: skip


@through_methods(S02)
def test_dead_tip_force(statement, method, judge) -> None:
    """S02 across the clamped tangent, S02b inclined; K. E. Bisshopp and D. C. Drucker, Q. Appl. Math. 3 (1945) 272.

    theta'' = -(F L^2 / EI) sin(beta - theta), theta(0) = theta'(1) = 0, by elliptic integrals
    """
    judge(statement, method)


S02C = [
    Statement("S02c", "P L^2/EI0 = 1", cases.tapered(1.0), "tip / L, angle, m(0) L / EI0", whole,
              digits("S02c", "tip (x,y)/L") + digits("S02c", "tip angle") + digits("S02c", "root moment"))
]  # fmt: skip


@through_methods(S02C)
def test_tapered_cone(statement, method, judge) -> None:
    """S02c, a cone whose tip has half the diameter of its root; the record's own computation.

    EI = EI0 (1 - s / 2 L)^4 in the equation of S02
    """
    judge(statement, method)


LIGHT = Statement("S02c", "small P", cases.tapered(SMALL), "deflection EI0 / P L^3", lambda x: x.tip[1] / SMALL, digits("S02c", "linear limit"))  # fmt: skip


@pytest.mark.parametrize("method", SHARP, ids=lambda m: type(m).__name__)
def test_tapered_cone_under_a_small_load(method, judge) -> None:
    """S02c, the linear limit: int (1 - s)^2 / (1 - s / 2)^4 ds."""
    _small(LIGHT, method, judge)


def follower(P):
    return dx.Equilibrium(UNIT, IN_PLANE, loads=[dx.EndForce((P, 0, 0), follower=True)])


def pressure(p):
    return dx.Equilibrium(UNIT, IN_PLANE, loads=[dx.LineForce((p, 0, 0), frame="section")])


TURNED = float(digits("S03", "P L^2/EI at which tip angle first = pi").value[0])
S03 = [
    Statement("S03", f"P L^2/EI = {P:g}", follower(P), "tip / L, angle, k(0) L", whole, _four("S03", f"P L^2/EI={P:g}"), segments=128)
    for P in (1, 2, 10, 40)
] + [
    Statement("S03", "the tip turned round", follower(TURNED), "angle, k(0) L", lambda x: whole(x)[2:],
              digits("S03", "max tip rotation") + Digits(np.zeros(1)), segments=128)
]  # fmt: skip


@through_methods(S03)
def test_follower_tip_force(statement, method, judge) -> None:
    """S03; J. H. Argyris and S. Symeonidis, Comput. Methods Appl. Mech. Eng. 26 (1981) 75, in closed form by Jacobi's functions.

    psi'' = (P / EI) cos(psi), psi(0) = psi'(0) = 0 from the tip inwards: the pendulum with k^2 = 1/2
    """
    judge(statement, method)


S03B = [
    Statement("S03b", f"p L^3/EI = {p}", pressure(p), "tip / L, angle, m(0) L / EI", whole,
              digits("S03b", f"p L^3/EI={p}:", "tip (x,y)") + digits("S03b", f"p L^3/EI={p}:", "angle") + digits("S03b", f"p L^3/EI={p}:", "moment"),
              segments=128)
    for p in (1, 5, 40)
]  # fmt: skip


@through_methods(S03B)
def test_pressure(statement, method, judge) -> None:
    """S03b, a force p per length along the normal (the class of Argyris and Symeonidis 1981); the record's own computation."""
    judge(statement, method)


def _down(case, w):
    x, y, a, k = (
        digits(case, name, f"wL^3/EI={w:g}")
        for name in ("tip x", "tip deflection", "tip angle below", "root curvature")
    )
    return x + y * -1 + a * -1 + k * -1


S05 = [
    Statement("S05", f"w L^3/EI = {w:g}", cases.heavy(w), "tip / L, angle, k(0) L", whole, _down("S05", w), segments=N)
    for w, N in ((1.0, 64), (10.0, 256), (613.125, 1024), (613.1, 1024))
] + [
    Statement("S05", "the paper's figure 5, in SI units", dx.Equilibrium(cases.RUBBER, ALONG_X, loads=[dx.Gravity()]),
              "tip x, z (m), k(0) (1/m), m(0) / EI k(0)", lambda x: [*x.tip[[0, 2]], np.linalg.norm(x.k(0.0)), x.m(0.0)[1] / 1.0867186883158426e-04],
              digits("S05", "dimensional tip x") + digits("S05", "dimensional tip deflection") * -1 + digits("S05", "dimensional root curvature")
              + digits("S05", "root moment EI") * (1 / 1.0867186883158426e-04), segments=1024)
]  # fmt: skip


@through_methods(S05)
def test_own_weight(statement, method, judge) -> None:
    """S05, the paper's figure 5; F. V. Rohde, Q. Appl. Math. 11 (1953) 337, digits of the record's own computation.

    theta'' = -(w L^3 / EI) (1 - s) cos(theta), theta(0) = theta'(1) = 0: the branch that follows from no weight
    """
    judge(statement, method)


FOLD, AT_FOLD = digits("S05", "at the first fold"), digits("S05", "tip angle below horizontal at that fold")
COUNTED = {w: digits("S05", "number of planar", f"wL^3/EI={w:g}") for w in (1.0, 10.0)}


@pytest.mark.long
@pytest.mark.parametrize(("side", "count"), [(-1.0, 1), (1.0, 3)])
def test_the_first_fold_of_the_heavy_rod(side, count) -> None:
    """S05: two more equilibria, over the top, from w L^3 / EI = 41.39995 on; found by deflation, 1 % to either side."""
    found = dx.solve_all(cases.heavy(float(FOLD.value[0]) * (1.0 + 0.01 * side)))
    assert len(found) == count
    if count == 3:  # on either side of the fold's shape, by the square root of how far behind it they are
        low, high = sorted(angle(x) for x in found[1:])
        assert low < -AT_FOLD.value[0] < high
        assert high - low < 1.0


@pytest.mark.long
@pytest.mark.parametrize("w", COUNTED)
def test_the_lightly_loaded_rod_has_one_equilibrium(w) -> None:
    """S05: the number of equilibria in the plane, which the search finds too."""
    assert len(dx.solve_all(cases.heavy(w), most=3)) == COUNTED[w].value[0]


def _charged(q, degrees):
    words = f"field direction {degrees} deg"
    return Statement("S11d", f"q E L^3/EI = {q:g} at {degrees} degrees", cases.field(q, degrees), "tip / L, angle, k(0) L", whole,
                     digits("S11d", words, "tip (x,y)") + digits("S11d", words, "angle") + digits("S11d", words, "root"))  # fmt: skip


@through_methods([_charged(10.0, 120), _charged(5.0, 60)])
def test_charged_filament(statement, method, judge) -> None:
    """S11d, a uniformly charged rod in a uniform field: a dead load along the rod; the record's own computation."""
    judge(statement, method)


THICK = dx.Stiffness(EI1=2.07e11 * 0.1 * 0.5**3 / 12, GJ=1e8, EA=2.07e11 * 0.05, **dict.fromkeys(("GA1", "GA2"), 0.8496732026143791 * 2.07e11 / 2.6 * 0.05))  # fmt: skip
S08B = [
    Statement("S08b", f"F = {F:g} N", dx.Equilibrium(dx.Rod(2.0, THICK, stretch=True, shear=True), ALONG_X, loads=[dx.EndForce((0, F, 0))]),
              "L - tip x, tip y (m)", lambda x: [2.0 - x.tip[0], x.tip[1]], digits("S08b", f"L - tip x, {size}") + digits("S08b", f"tip y, {size}"))
    for F, size in ((62500.0, "small"), (6.25e7, "large"))
]  # fmt: skip


@through_methods(S08B)
def test_thick_cantilever(statement, method, judge) -> None:
    """S08b, stretch and shear by Reissner's beam; K. Nachbagauer, A. Pechstein, H. Irschik and J. Gerstmayr, Multibody Syst.
    Dyn. 26 (2011) 245."""
    judge(statement, method)
