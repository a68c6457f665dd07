"""Discrete rods: the digits of the discrete model itself, with both clamps, and how they tend to the rod.

The reference is another code with the same definitions: curvature 2 tan(phi / 2), strains averaged over two edges, twist
as an angle, weight in the vertices, half of it at the tip.
"""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from tests import cases
from tests.validation.judging import Statement
from tests.validation.record import CASES, Digits, digits, stated

CLAMPS = {"half": "half_cell", "edge": "two_vertices"}
SOLVED = 1e-8  # what is left by an iteration, whose multipliers make edges as long as they should be to 1e-9


def _table(case, *words):
    """The rows [N, tip ...] of a case, as the tips by N."""
    found = [q for q in CASES[case]["quantities"] if all(w in q["name"] for w in words) and "DER tip" in q["name"]]
    assert len(found) == 1
    stated(case, *words, "error")
    stated(case, *words, "observed order")
    stated(case, *words, "DER tip")
    return {int(row[0]): np.array(row[1:]) for row in found[0]["value"]}


HEAVY = {(w, clamp): _table("D01", f"wL^3/EI={w}, clamp={clamp}") for w in ("1", "10", "613.125") for clamp in CLAMPS}
HELIX = {clamp: _table("D02", f"clamp={clamp}") for clamp in CLAMPS}
HANGING = {(name, clamp): _table("D03", f"{name}, clamp={clamp}") for name in ("H1", "H2") for clamp in CLAMPS}
NATURAL = dx.Equilibrium(dx.Rod(0.3, dx.Stiffness(EI1=1.0, GJ=1.0), natural=(-25.0, 10.0, -25.0)))


def _rows():
    for (w, clamp), table in HEAVY.items():
        for N, tip in table.items():
            yield "D01", f"w L^3/EI = {w}", clamp, N, cases.heavy(float(w)), lambda x: [x.tip[0], -x.tip[1]], tip, 1e-10
    for clamp, table in HELIX.items():
        for N, tip in table.items():
            yield "D02", "helix", clamp, N, NATURAL, lambda x: x.tip, tip, 1e-11
    for (name, clamp), table in HANGING.items():
        for N, tip in table.items():
            yield (
                "D03",
                name,
                clamp,
                N,
                cases.hanging_helix({"H1": 20.0, "H2": 200.0}[name]),
                lambda x: x.tip,
                tip,
                1e-9,
            )


ROWS = list(_rows())


@pytest.mark.parametrize(
    "row",
    [
        pytest.param(
            r, id=f"{r[0]} {r[1]}, {r[2]}, {r[3]}", marks=[] if r[3] in (16, 20, 64, 80) else [pytest.mark.long]
        )
        for r in ROWS
    ],
)
def test_digits_of_the_discrete_rod(row, judge) -> None:
    """D01 the heavy rod of S05, D02 the helix of S06, D03 the hanging helix of S10: M. Bergou and others (2008, 2010).

    Energy EI / 2 l (2 tan(phi / 2))^2; the clamp a vertex with a spring of half a cell, or the first edge held.
    """
    case, name, clamp, N, problem, read, tip, sure = row
    method = dx.DiscreteRod(N, clamp=CLAMPS[clamp])
    judge.continuous(Statement(case, f"{name}, clamp {clamp}, N = {N}", problem, "tip", None, Digits(tip, sure)), "DiscreteRod",
                     lambda: read(dx.solve(problem, method)), SOLVED, f"{N} segments")  # fmt: skip


EXACT = {case.id: np.array(case.tip) for case in cases.ALL}
TURNED = [digits("S06", "convention A", f"tip {a} ").value[0] for a in "xyz"]
LIMITS = {
    "1": EXACT["S05 w=1"][:2] * (1, -1), "10": EXACT["S05 w=10"][:2] * (1, -1), "613.125": EXACT["S05 w=613.125"][:2] * (1, -1),
    "helix": np.array(TURNED), "H1": EXACT["S10 H1"], "H2": EXACT["S10 H2"],
}  # fmt: skip
TABLES = HEAVY | {("helix", clamp): table for clamp, table in HELIX.items()} | HANGING
del TABLES["613.125", "half"]  # its layer at the clamp delays the order to 512 segments


@pytest.mark.parametrize("which", TABLES, ids=str)
def test_orders_of_both_clamps(which) -> None:
    """D01, D02, D03: order 2 with half a cell, 1 with the edge held, from the two finest rows, which are ours too."""
    name, clamp = which
    coarse, fine = (np.linalg.norm(TABLES[which][N] - LIMITS[name]) for N in sorted(TABLES[which])[-2:])
    assert abs(np.log2(coarse / fine) - {"half": 2.0, "edge": 1.0}[clamp]) < 0.2


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
ERRORS = {name: digits("D05", name, "|tip error|") for name in LOADED}
for _name in LOADED:
    stated("D05", _name, "observed order")
    stated("D05", _name, "Richardson")


@pytest.mark.parametrize("name", LOADED)
def test_errors_of_discrete_rods(name, judge) -> None:
    """D05: the error of the tip over L for 16 and 32 segments, to the four digits of the record; the order follows."""
    problem, L = LOADED[name], LOADED[name].rod.length
    limit = EXACT[NAMES.get(name, name)]
    errors = [float(np.linalg.norm(dx.solve(problem, dx.DiscreteRod(N)).tip - limit)) / L for N in (16, 32)]
    exact = Digits(ERRORS[name].value[:2], 6e-7)
    judge.continuous(
        Statement("D05", name, None, "tip error / L", None, exact),
        "DiscreteRod",
        lambda: errors,
        SOLVED,
        "16, 32 segments",
    )


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
