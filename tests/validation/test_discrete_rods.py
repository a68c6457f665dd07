"""Discrete rods: the digits of the discrete model itself, with both clamps, and how they tend to the rod.

The reference is another code: curvature 2 tan(phi / 2), twist as an angle, weight in the vertices, half of it at the tip. In a
plane its definitions are ours, and so are its digits. Out of it, it measures bending along the mean of two edges' directors,
which is less by cos(m / 2) where the rod twists by m from edge to edge; there the limit and the order are held.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import darboux as dx
from tests import cases
from tests.validation.judging import Statement
from tests.validation.record import CASES, Digits, digits, stated

CLAMPS = {"half": "half_cell", "edge": "two_vertices"}
SOLVED = 1e-8  # what is left by an iteration, whose multipliers make edges as long as they should be to 1e-9


def _table(*words):
    """The rows [N, tip ...] of D01, as the tips by N."""
    found = [q for q in CASES["D01"]["quantities"] if all(w in q["name"] for w in words) and "DER tip" in q["name"]]
    assert len(found) == 1
    stated("D01", *words, "error")
    stated("D01", *words, "observed order")
    stated("D01", *words, "DER tip")
    return {int(row[0]): np.array(row[1:]) for row in found[0]["value"]}


HEAVY = {(w, clamp): _table(f"wL^3/EI={w}, clamp={clamp}") for w in ("1", "10", "613.125") for clamp in CLAMPS}
ROWS = [(w, clamp, N, tip) for (w, clamp), table in HEAVY.items() for N, tip in table.items()]


@pytest.mark.parametrize(
    "row",
    [
        pytest.param(r, id=f"w={r[0]}, {r[1]}, {r[2]}", marks=[] if r[2] in (16, 64) else [pytest.mark.long])
        for r in ROWS
    ],
)
def test_digits_of_the_discrete_rod(row, judge) -> None:
    """D01, the heavy rod of S05: M. Bergou and others (2008, 2010).

    Energy EI / 2 l (2 tan(phi / 2))^2; the clamp a vertex with a spring of half a cell, or the first edge held.
    """
    w, clamp, N, tip = row
    problem, method = cases.heavy(float(w)), dx.DiscreteRod(N, clamp=CLAMPS[clamp])
    judge.continuous(Statement("D01", f"w L^3/EI = {w}, clamp {clamp}, N = {N}", problem, "tip", None, Digits(tip, 1e-10)), "DiscreteRod",
                     lambda: np.array([1.0, -1.0]) * dx.solve(problem, method).tip[:2], SOLVED, f"{N} segments")  # fmt: skip


EXACT = {case.id: np.array(case.tip) for case in cases.ALL}
LIMITS = {w: EXACT[f"S05 w={w}"][:2] * (1, -1) for w in ("1", "10", "613.125")}


@pytest.mark.parametrize("which", [key for key in HEAVY if key != ("613.125", "half")], ids=str)
def test_orders_of_both_clamps(which) -> None:
    """D01: order 2 with half a cell, 1 with the edge held, from the two finest rows, which are ours too.

    Of the heaviest with half a cell the layer at the clamp delays the order to 512 segments.
    """
    w, clamp = which
    coarse, fine = (np.linalg.norm(HEAVY[which][N] - LIMITS[w]) for N in sorted(HEAVY[which])[-2:])
    assert abs(np.log2(coarse / fine) - {"half": 2.0, "edge": 1.0}[clamp]) < 0.2


TURNED = [digits("S06", "convention A", f"tip {a} ").value[0] for a in "xyz"]
IN_SPACE = {
    "D02": ("helix", dx.Equilibrium(dx.Rod(0.3, dx.Stiffness(EI1=1.0, GJ=1.0), natural=(-25.0, 10.0, -25.0))), np.array(TURNED), 80),
    "D03 H1": ("hanging helix H1", cases.hanging_helix(20.0), EXACT["S10 H1"], 64),
    "D03 H2": ("hanging helix H2", cases.hanging_helix(200.0), EXACT["S10 H2"], 64),
}  # fmt: skip
for _clamp in CLAMPS:
    stated("D02", f"clamp={_clamp}", "observed order")
    for _name in ("H1", "H2"):
        stated("D03", f"{_name}, clamp={_clamp}", "observed order")


@pytest.mark.parametrize("clamp", CLAMPS)
@pytest.mark.parametrize("name", IN_SPACE)
def test_helices_tend_to_the_rod(name, clamp, judge) -> None:
    """D02 the helix of S06, D03 the hanging helix of S10: order 2 with half a cell, 1 with the edge held."""
    what, problem, limit, N = IN_SPACE[name]
    judge.discrete(name[:3], f"{what}, clamp {clamp}", "tip", "DiscreteRod",
                   lambda n: dx.solve(problem, dx.DiscreteRod(n, clamp=CLAMPS[clamp])).tip, Digits(limit, 1e-9), N,
                   order={"half": 2, "edge": 1}[clamp])  # fmt: skip


@pytest.mark.parametrize("N", [10, 80])
def test_digits_of_a_discrete_helix(N, judge) -> None:
    """The rod of D02 put together spring by spring: half the twist, the bending, and half the twist again."""
    k, l = np.array([-25.0, 10.0, -25.0]), 0.3 / N
    R, tip = Rotation.identity(), np.zeros(3)
    for i in range(N):
        x, y, m = (0.5 if i == 0 else 1.0) * l * k
        half, angle = Rotation.from_rotvec([0.0, 0.0, m / 2]), 2 * np.arctan(np.hypot(x, y) / 2)
        R = R * half * Rotation.from_rotvec(angle * np.array([x, y, 0.0]) / np.hypot(x, y)) * half
        tip += l * R.as_matrix()[:, 2]
    problem = IN_SPACE["D02"][1]
    judge.continuous(Statement("D02", f"helix spring by spring, N = {N}", problem, "tip", None, Digits(tip, 1e-14)), "DiscreteRod",
                     lambda: dx.solve(problem, dx.DiscreteRod(N)).tip, SOLVED, f"{N} segments")  # fmt: skip


CIRCLE = {
    N: [digits("D04", f"N={N}:", what) for what in ("interior", "root vertex", "tip (x,y)")] for N in (10, 20, 40)
}


@pytest.mark.parametrize("N", CIRCLE)
def test_discrete_circle(N, judge) -> None:
    """D04, a cantilever under the moment 2 pi EI / L: M = (EI / l) 2 t (1 + t^2) with t = tan(phi / 2), in closed form."""
    inner, root, tip = CIRCLE[N]
    x = dx.solve(cases.rolled(1.0), dx.DiscreteRod(N))
    t = np.diff(x.r(x.s), axis=0)
    turn = np.unwrap(np.arctan2(t[:, 1], t[:, 0]))
    ours = [turn[1] - turn[0], turn[0], *x.tip[:2]]
    judge.continuous(Statement("D04", f"N = {N}", None, "inner turn, root turn, tip / L", None, inner + root + tip), "DiscreteRod",
                     lambda: ours, SOLVED, f"{N} segments")  # fmt: skip


LOADED = {
    "S07 V1 P=300": cases.bathe_bolourchi(300.0, cases.GJ_POLAR),
    "S07 V1 P=600": cases.bathe_bolourchi(600.0, cases.GJ_POLAR),
    "S09 Kirchhoff load 1": cases.anisotropic((1.5, -1, -0.8), (0.4, 0.6, 0.9)),
    "S09 Kirchhoff load 3": cases.anisotropic((0, 0, -2), (0.5, 0.2, 4)),
}
NAMES = {"S09 Kirchhoff load 1": "S09 load 1", "S09 Kirchhoff load 3": "S09 load 3"}
for _name in LOADED:
    stated("D05", _name, "observed order")
    stated("D05", _name, "Richardson")


@pytest.mark.parametrize("name", LOADED)
def test_orders_under_end_loads(name, judge) -> None:
    """D05: order 2, and the rod itself by extrapolation."""
    problem, L = LOADED[name], LOADED[name].rod.length
    judge.discrete("D05", name, "tip / L", "DiscreteRod", lambda n: dx.solve(problem, dx.DiscreteRod(n)).tip / L,
                   Digits(EXACT[NAMES.get(name, name)] / L, 1e-9), 64)  # fmt: skip


STABLE = {name: digits("D06", f"{name}: number of negative") for name in ("H1", "H2", "H4")}
for _name in STABLE:
    stated("D06", f"{_name}: |DER tip")


@pytest.mark.parametrize("name", STABLE)
def test_hanging_helices_are_stable(name) -> None:
    """D06: no negative eigenvalue of the Hessian along the branches of S10."""
    from tests.validation.test_helices import RUBBER_HELIX

    problem = {"H1": cases.hanging_helix(20.0), "H2": cases.hanging_helix(200.0), "H4": RUBBER_HELIX}[name]
    x = dx.solve(problem, dx.DiscreteRod(128))
    assert x.index == STABLE[name].value[0]
    assert not x.statistics["crossings"]
