"""Stability: critical loads of columns, rings, twisted rods and strips.

What counts as an unstable direction is measured by the rod's stiffest one: a bracket is as much wider as that is stiffer.
`Shooting` and `DiscreteRod` follow the straight branch and count its unstable directions; `Collocation` takes the stable side
and so leaves it. A discrete rod's critical load is that at which the stiffness of its lowest mode vanishes, of second
order; a continuous method's is bracketed.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import darboux as dx
from tests.validation.judging import COLLOCATION, NEAR, SHOOTING, Statement
from tests.validation.record import Digits, digits, stated

UP = (0.0, 0.0, 1.0)
PLANE = dx.Rod(1.0, dx.Stiffness(EI1=4.0, EI2=1.0, GJ=4.0))  # buckles about d2 first
ROUND = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.75))


def leaves(problem, method, sideways):
    """1 where the rod has left its line, or has an unstable direction, else 0."""
    x = dx.solve(problem, method)
    return int(bool(x.index) or sideways(x) > 1e-5)


def across(x):
    s = np.linspace(0.0, x.problem.rod.length, 17)
    return np.max(np.hypot(*x.r(s)[:, :2].T))


EXTRAPOLATED = 1e-6  # what that polynomial leaves, relative
BEFORE = np.array([0.9, 0.925, 0.95, 0.975, 0.99])  # of the critical load, at which itself no iteration settles


def vanishing(problem_at, critical, segments):
    """The load at which the lowest stiffness of a discrete rod vanishes, by a polynomial through it before it does."""
    stiffness = [
        dx.solve(problem_at(f * critical), dx.DiscreteRod(segments, stable=False)).modes(1).stiffness[0] for f in BEFORE
    ]
    through = np.polynomial.Polynomial.fit(BEFORE, stiffness, 4)
    return critical * brentq(through, 0.95, 1.05)


ENDS = {
    "pinned-pinned": {"start": dx.Hinge(axis=(0, 1, 0)), "end": dx.Roller(along=UP)},
    "clamped-free": {},
    "clamped-clamped": {"end": dx.Slider(along=UP)},
    "clamped-pinned": {"end": dx.Roller(along=UP)},
    "clamped-sliding": {"end": dx.Guided()},
}


def _pushed(ends, P, rod=PLANE):
    return dx.Equilibrium(rod, **ENDS[ends], loads=[dx.EndForce((0, 0, -P))])


def _weighed(ends, q):
    return dx.Equilibrium(PLANE, **ENDS[ends], loads=[dx.LineForce((0, 0, -q))])


COLUMNS = {  # the case, what makes the problem of a load, and the load
    f"{ends}, force": ("T13", lambda P, ends=ends: _pushed(ends, P), digits("T13", f"P_cr L^2/EI, {ends}" if ends != "clamped-sliding" else "clamped-sliding"))
    for ends in ENDS if ends not in ("clamped-clamped", "clamped-pinned")
} | {
    f"{ends}, force": ("T13", lambda P, ends=ends: _pushed(ends, P), digits("T13", f"P_cr L^2/EI, {ends}"))
    for ends in ("clamped-clamped", "clamped-pinned")
} | {
    f"{ends}, weight": ("T14", lambda q, ends=ends: _weighed(ends, q), digits("T14", name))
    for ends, name in (("clamped-free", "clamped(bottom)-free(top)"), ("pinned-pinned", "pinned-pinned"), ("clamped-pinned", "clamped(bottom)-pinned(top)"),
                       ("clamped-clamped", "clamped-clamped"), ("clamped-sliding", "clamped(bottom)-sliding(top)"))
}  # fmt: skip
stated("S15", "D->0")  # clamped and pinned
stated("T14", "Greenhill")  # the same as clamped and free
stated("T14", "j_{-1/3,1}")


@pytest.mark.long
@pytest.mark.parametrize("name", COLUMNS)
def test_columns_by_continuous_methods(name, judge) -> None:
    """T13, L. Euler (1757); T14, A. G. Greenhill, Proc. Camb. Phil. Soc. 4 (1881) 65: columns under a force or their weight.

    EI w'''' + P w'' = 0;  EI w'''' + q ((L - s) w')' = 0, clamped and free: q L^3 / EI = (9/4) j_{-1/3,1}^2
    """
    case, problem_at, exact = COLUMNS[name]
    for method in (SHOOTING, COLLOCATION):
        if method.refuses(problem_at(1.0)) is None:
            judge.between(
                case,
                name,
                "critical load L^2 / EI",
                method,
                lambda P, m=method: leaves(problem_at(P), m, across),
                exact,
                4.0 * NEAR,
            )


@pytest.mark.parametrize(
    "name", [n if n.endswith("force") else pytest.param(n, marks=pytest.mark.long) for n in COLUMNS]
)
def test_columns_by_discrete_rods(name, judge) -> None:
    """T13, T14: the same by the vanishing stiffness of a discrete rod's lowest mode."""
    case, problem_at, exact = COLUMNS[name]
    judge.discrete(case, name, "critical load L^2 / EI", "DiscreteRod.modes",
                          lambda N: vanishing(problem_at, float(exact.value[0]), N), exact, 32, EXTRAPOLATED)  # fmt: skip


SECOND = {ends: digits("T13", f"second P_cr L^2/EI, {ends}") for ends in ("clamped-clamped", "clamped-pinned")}


@pytest.mark.parametrize("ends", SECOND)
def test_second_critical_loads(ends, judge) -> None:
    """T13: the load at which a second direction turns unstable; a discrete rod's error is (beta h)^2 / 12 or some, bracketed by three."""
    N = 800
    exact = SECOND[ends]
    width = 3.0 * float(exact.value[0]) / N**2 / 12.0
    judge.between("T13", f"{ends}, second", "critical load L^2 / EI", dx.DiscreteRod(N, stable=False),
                  lambda P: dx.solve(_pushed(ends, P), dx.DiscreteRod(N, stable=False)).index, exact, width, (1, 2))  # fmt: skip


SOFT = {
    (EA, GA): digits("T13b", f"clamped-free, EA L^2/EI={EA}, GA L^2/EI={GA}:") for EA, GA in (("50", "1e+09"), ("1e+09", "20"), ("20", "50"))
} | {("pinned", EA, GA): digits("T13b", f"pinned-pinned, EA L^2/EI={EA}, GA L^2/EI={GA}:") for EA, GA in (("50", "1e+09"), ("1e+09", "20"))}  # fmt: skip


@pytest.mark.parametrize("method", [SHOOTING, COLLOCATION], ids=lambda m: type(m).__name__)
@pytest.mark.long
@pytest.mark.parametrize("which", SOFT, ids=str)
def test_column_that_shears_and_shortens(which, method, judge) -> None:
    """T13b; E. Reissner, J. Appl. Math. Phys. 23 (1972) 795: P (1 + P (1 / GA - 1 / EA)) = P_E, Euler's load."""
    EA, GA = (float(x) for x in which[-2:])
    ends = "pinned-pinned" if len(which) == 3 else "clamped-free"
    section = dx.Stiffness(EI1=4.0, EI2=1.0, GJ=4.0, EA=EA, GA1=GA, GA2=GA)
    rod = dx.Rod(1.0, section, stretch=True, shear=True)
    if method.refuses(_pushed(ends, 1.0, rod)) is not None:
        pytest.skip("not a problem of this method")
    judge.between("T13b", f"{ends}, EA {EA:g}, GA {GA:g}", "critical load L^2 / EI", method,
                  lambda P: leaves(_pushed(ends, P, rod), method, across), SOFT[which], (50.0 if EA == 1e9 else 10.0) * NEAR)  # fmt: skip


LINKS = {
    ratio: digits("T15", f"critical turns for C/B={name}")
    for name, ratio in (("1", 1.0), ("2/3", 2 / 3), ("0.75", 0.75), ("10/13", 10 / 13))
}
stated("T15", "critical twist moment")
stated("T15", "critical total twist")
stated("T15", "critical number of turns")


@pytest.mark.parametrize("ratio", [pytest.param(r, marks=[pytest.mark.long] if r != 1.0 else []) for r in LINKS])
def test_michells_ring(ratio, judge) -> None:
    """T15; J. H. Michell, Messenger of Math. 19 (1890) 181; E. E. Zajac, J. Appl. Mech. 29 (1962) 136: sqrt(3) B / C turns."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=ratio))
    judge.between(
        "T15",
        f"C / B = {ratio:.4g}",
        "turns",
        COLLOCATION,
        lambda turns: int(bool(dx.solve(dx.Ring(rod, link=turns), dx.Collocation(stable=False)).index)),
        LINKS[ratio],
        NEAR,
    )


TENSIONS = {T: digits("T16", f"clamped-clamped, T L^2/B={T}:") for T in (0, 10, 100, -10, -39)}
stated("T16", "zero tension")


def _wrung(T, M):
    """Clamped, twisted by the angle that makes the moment M, free to draw the ends together."""
    return dx.Equilibrium(
        ROUND, end=dx.Slider(along=UP, twist=M / 0.75), loads=[dx.EndForce((0, 0, float(T)))] if T else []
    )


@pytest.mark.parametrize("T", [pytest.param(T, marks=[pytest.mark.long] if T else []) for T in TENSIONS])
def test_twisted_and_pulled_by_collocation(T, judge) -> None:
    """T16; A. G. Greenhill, Proc. Inst. Mech. Eng. (1883) 182; A. E. H. Love (1927), art. 272: B y'''' - i M y''' - T y'' = 0."""
    width = NEAR * max(1.0, 4 * np.pi**2 / (4 * np.pi**2 + T))  # near Euler's load M changes little of what is critical
    judge.between(
        "T16",
        f"T L^2 / B = {T}",
        "M L / B",
        COLLOCATION,
        lambda M: leaves(_wrung(T, M), COLLOCATION, across),
        TENSIONS[T],
        width,
    )


FLAT = {EI: digits("T17a", "full Kirchhoff", f"EI_stiff={EI}:") for EI in (10, 100, 1000)}
NARROW = digits("T17a", "cantilever, tip load at centroid")


def _strip(P, EI):
    """P is the load over sqrt(EI_soft GJ); gravity-like, along the stiff direction d1 (bending about d2)."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=float(EI), GJ=0.8))
    return dx.Equilibrium(
        rod, dx.Clamped(tangent=(1, 0, 0), d1=(0, 0, 1)), loads=[dx.EndForce((0, 0, -P * np.sqrt(0.8)))]
    )


def tilted(x):
    return abs(x.tip[1])


@pytest.mark.parametrize("method", [SHOOTING, COLLOCATION], ids=lambda m: type(m).__name__)
@pytest.mark.parametrize("EI", FLAT)
def test_lateral_buckling_of_a_strip(EI, method, judge) -> None:
    """T17a; L. Prandtl, Kipperscheinungen (1899); A. G. M. Michell, Philos. Mag. 48 (1899) 298, with the bending before it.

    What counts as a negative eigenvalue is measured by the rod's stiffest direction: the bracket is as much wider.
    """
    judge.between(
        "T17a",
        f"EI_stiff = {EI}",
        "P L^2 / sqrt(EI GJ)",
        method,
        lambda P: leaves(_strip(P, EI), method, tilted),
        FLAT[EI],
        NEAR * EI,
    )


@pytest.mark.parametrize("EI", [pytest.param(EI, marks=[pytest.mark.long] if EI > 10 else []) for EI in FLAT])
def test_lateral_buckling_by_discrete_rods(EI, judge) -> None:
    """T17a: the same by the vanishing stiffness of a discrete rod's lowest mode."""
    judge.discrete("T17a", f"EI_stiff = {EI}", "P L^2 / sqrt(EI GJ)", "DiscreteRod.modes",
                          lambda N: vanishing(lambda P: _strip(P, EI), float(FLAT[EI].value[0]), N), FLAT[EI], 32, EXTRAPOLATED)  # fmt: skip


def test_lateral_buckling_of_a_strip_without_bending_before(judge) -> None:
    """T17a: 2 j_{-1/4,1} for EI_stiff -> infinity; at 1e6 what is left is of the order of 1e-6."""
    exact = Digits(NARROW.value, 1.2e-6 * float(NARROW.value[0]))
    judge.discrete("T17a", "EI_stiff = 1e6", "P L^2 / sqrt(EI GJ)", "DiscreteRod.modes",
                          lambda N: vanishing(lambda P: _strip(P, 1e6), float(exact.value[0]), N), exact, 32, EXTRAPOLATED)  # fmt: skip


def _writhed(ratio):
    return [
        digits("T18", f"C/B={name}:", what)
        for name in (ratio,)
        for what in ("end shortening", "P L^2/B there", "inflexion angle")
    ]


WRITHING = {name: _writhed(name) for name in ("1", "0.75", "0.666667", "1.5")}


def _approached(ratio, D):
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=ratio))
    return dx.solve(dx.Equilibrium(rod, end=dx.Clamped(position=(0, 0, 1.0 - D))))


def out_of_plane(x):
    """The least extension of the curve across: zero where it is plane."""
    r = x.r(np.linspace(0.0, 1.0, 65))
    return np.linalg.svd(r - np.mean(r, axis=0), compute_uv=False)[2]


@pytest.mark.parametrize("name", [n if n == "1" else pytest.param(n, marks=pytest.mark.long) for n in WRITHING])
def test_writhing_of_the_clamped_elastica(name, judge) -> None:
    """T18; van der Heijden and others (2003): ends pushed together without twist, the plane elastica turns out of its plane at D.

    The bracket is wider than for columns: the shape leaves its plane by the root of the excess.
    """
    shortening, force, alpha = WRITHING[name]
    ratio = 2 / 3 if name == "0.666667" else float(name)
    judge.between(
        "T18",
        f"C / B = {name}",
        "end shortening D / L",
        COLLOCATION,
        lambda D: int(out_of_plane(_approached(ratio, D)) > 1e-4),
        shortening,
        1e-3,
    )
    k2 = np.sin(np.radians(float(alpha.value[0])) / 2) ** 2
    assert abs(2.0 - 2.0 * ellipe(k2) / ellipk(k2) - shortening.value[0]) < 1e-9
    assert abs(16.0 * ellipk(k2) ** 2 - force.value[0]) < 1e-7
    D = 0.999 * float(shortening.value[0])  # before it, the force is that of the plane elastica
    k2 = brentq(lambda k2: 2.0 - 2.0 * ellipe(k2) / ellipk(k2) - D, 1e-9, 1.0 - 1e-12, xtol=1e-15)
    assert abs(-_approached(ratio, D).n(0.0)[2] / (16.0 * ellipk(k2) ** 2) - 1.0) < 1e-8


# Rings under pressure

PUSH = 1e-3  # of EI / R^3: bends the ring by some 1e-4 R
PRESSED = {
    "hydrostatic, n = 2": (2, digits("T19", "p_cr R^3/EI, hydrostatic (follower normal), n=2"),
                           lambda p, out: dx.LineForce((p, 0, 0), frame="section")),
    "hydrostatic, n = 3": (3, digits("T19", "hydrostatic n=3"), lambda p, out: dx.LineForce((p, 0, 0), frame="section")),
    "dead, n = 2": (2, digits("T19", "dead radial"), lambda p, out: dx.LineForce(lambda s: -p * out(s))),
    "to the centre, n = 2": (2, digits("T19", "load directed to the fixed centre"),
                             lambda p, out: dx.LineForce(lambda s, r, R: -p * r / np.linalg.norm(r, axis=-1, keepdims=True))),
}  # fmt: skip


@pytest.mark.parametrize("name", PRESSED)
def test_rings_under_pressure(name, judge) -> None:
    """T19; M. Levy 1884, S. R. Bodner 1958: p R^3 / EI = n^2 - 1, n^2, ... by what the loads do as the ring bends.

    A follower has no potential, hence no index. But a force cos(n theta) across the ring bends it by w, and 1 / w falls in
    proportion to p down to zero at the critical load: two loads give that. A half wave between two lines of
    symmetry, on which the ring slides, stands for the whole ring.
    """
    n, exact, pressure = PRESSED[name]
    theta = np.pi / n
    rod = dx.Rod(theta, dx.Stiffness(EI1=1e4, EI2=1.0, GJ=1e4), natural=(0.0, 1.0, 0.0))

    def out(s):
        return np.stack([-np.cos(s), np.zeros_like(s), np.sin(s)], axis=-1)

    def line(s):
        ahead = (np.sin(s), 0.0, np.cos(s))
        return dx.Slider(along=out(s), position=out(s), tangent=ahead, d1=-out(s))

    def bent(p, push):
        loads = [dx.LineForce(lambda s: push * np.cos(n * s)[:, None] * out(s)), *([pressure(p, out)] if p else [])]
        problem = dx.Equilibrium(rod, start=line(0.0), end=line(theta), loads=loads)
        return -dx.solve(problem, dx.Collocation(rtol=1e-11)).r(0.0)[0] - 1.0

    def critical():
        half = 0.5 * float(exact.value[0])
        free, pressed = ((bent(p, PUSH) - bent(p, -PUSH)) / 2.0 for p in (0.0, half))
        return half / (1.0 - free / pressed)

    statement = Statement("T19", name, None, "p R^3 / EI", lambda _: None, exact)
    # What is left is of the square of the bend, and rtol over the bend.
    judge.continuous(statement, "Collocation", critical, 1e-6, "rtol 1e-11, two loads")
