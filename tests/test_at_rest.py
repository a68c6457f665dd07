"""Where a real rod would be found: past bifurcations and folds it falls to a stable equilibrium, cold and by default.

Numbers are closed forms, published ones, or those of a damped motion; see each test.
"""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from scipy.optimize import brentq

import darboux as dx

UP = (0.0, 0.0, 1.0)
ROUND = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.75))
FLAT = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.3, GJ=0.75))
PI2 = np.pi**2


def rolled(rod: dx.Rod, force: float) -> dx.Equilibrium:
    return dx.Equilibrium(rod, dx.Pinned(), dx.Roller(along=UP), [dx.EndForce((0, 0, force))])


def guided(rollers: int, shortened: float, stiff: float) -> dx.Equilibrium:
    """A rod of length 10 in rollers along it, whose ends are clamped closer."""
    between = {10.0 * (i + 1) / (rollers + 1): dx.Roller(along=UP) for i in range(rollers)}
    rod = dx.Rod(10.0, dx.Stiffness(EI1=1.0, EI2=stiff, GJ=0.75))
    return dx.Equilibrium(rod, end=dx.Clamped((0, 0, 10.0 - shortened)), between=between)


# -- columns whose critical load is known ---------------------------------------------------------------------------------

COLUMNS = {
    "clamped, free": ({}, PI2 / 4),
    "pinned, roller": ({"start": dx.Pinned(), "end": dx.Roller(along=UP)}, PI2),
    "clamped, roller": ({"end": dx.Roller(along=UP)}, brentq(lambda x: np.tan(x) - x, 4.4, 4.6) ** 2),
    "clamped, slider": ({"end": dx.Slider(along=UP, position=UP)}, 4 * PI2),
    "hinge, roller": ({"start": dx.Hinge(axis=(1, 0, 0)), "end": dx.Roller(along=UP)}, PI2),
}


@pytest.mark.parametrize("name", COLUMNS)
@pytest.mark.parametrize(("stiff", "times"), [(1.3, 1.01), (4.0, 2.0), (1.0, 1.3), (1000.0, 3.0)])
def test_a_column_leaves_its_line_at_the_load_that_is_told(name: str, stiff: float, times: float) -> None:
    """The bracket holds Euler's load; the answer is stable, and lower in energy than the straight rod."""
    supports, critical = COLUMNS[name]
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=stiff, GJ=max(stiff, 1.0)))
    problem = dx.Equilibrium(rod, **supports, loads=[dx.EndForce((0, 0, -times * critical))])
    bent, straight = dx.solve(problem), dx.solve(problem, dx.Collocation(stable=False))
    assert straight.index > 0
    assert bent.index == 0
    assert bent.energy.total < straight.energy.total
    first = bent.events[0]
    assert first.kind == "bifurcation"
    low, high = first.load_factors
    assert low <= 1.0 / times <= high
    assert high - low < 2e-3


def test_percentages_are_of_the_problems_own_load() -> None:
    """Pins pushed together: EA P_E / EI of the way, which the rod takes by its own stretch. Without stretch it buckles at once."""
    stiff = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.75, EA=1e4), stretch=True)
    found = dx.solve(dx.Equilibrium(stiff, dx.Pinned(), dx.Pinned((0, 0, 0.9))))
    low, high = found.events[0].load_factors
    assert low <= PI2 / 1e4 / 0.1 <= high
    assert "0.98" in found.status.message
    found = dx.solve(dx.Equilibrium(ROUND, dx.Pinned(), dx.Pinned((0, 0, 0.9))))
    assert np.isnan(found.events[0].load_factors).all()
    assert "%" not in found.status.message


# -- kinds of which users' cases are members -------------------------------------------------------------------------------


@pytest.mark.parametrize("times", [1.05, 2.2, 5.0])
def test_a_column_between_a_pin_and_a_roller_turns_over(times: float) -> None:
    """Beyond 2.2 Euler's loads nothing but the other way round is stable: it hangs, with no energy of bending."""
    found = dx.solve(rolled(FLAT, -times * PI2))
    assert found.index == 0
    if times > 2.0:
        np.testing.assert_allclose(found.tip, (0, 0, -1), atol=1e-9)
        assert found.energy.elastic < 1e-12


@pytest.mark.parametrize("GJ", [0.7, 1.0])
def test_beyond_michells_link_a_ring_passes_through_itself(GJ: float) -> None:
    """By two turns at a time; the ring that is left is a circle again, of energy 2 pi^2 (EI + GJ Lk^2)."""
    link = 1.02 * np.sqrt(3.0) / GJ
    ring = dx.solve(dx.Ring(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=GJ)), link=link))
    assert ring.index == 0
    lost = 0.5 * (link - ring.link)
    assert lost == pytest.approx(round(lost), abs=1e-6)
    assert abs(ring.link) < link
    assert ring.energy.elastic == pytest.approx(2 * PI2 * (1.0 + GJ * ring.link**2), rel=1e-6)


@pytest.mark.parametrize("turns", [2.5, 2.8, 3.0])
def test_a_wrung_rod_loses_two_turns(turns: float) -> None:
    """Under tension 10 it is straight, or has lost two: twist + writhe is that of the problem, or two less."""
    end = dx.Slider(along=UP, position=UP, twist=turns * dx.turn)
    found = dx.solve(dx.Equilibrium(ROUND, end=end, loads=[dx.EndForce((0, 0, 10.0))]))
    assert found.index == 0
    lost = 0.5 * (turns - found.twist - found.writhe)
    assert lost == pytest.approx(round(lost), abs=1e-6)


@pytest.mark.parametrize("link", [0.51, 1.2, 2.2, -0.3])
@pytest.mark.parametrize("points", [False, True])
def test_no_turns_are_lost_from_a_start(link: float, *, points: bool) -> None:
    """A5: from a ring of half a turn, by its frames or by its circle alone, to one of another link that is stable."""
    start = dx.solve(dx.Ring(ROUND, link=0.5))
    found = dx.solve(dx.Ring(ROUND, link=link), start=start.r(np.linspace(0.0, 1.0, 65)) if points else start)
    assert found.index == 0
    assert found.link == pytest.approx(link, abs=1e-7)


def test_curly_hair_hangs() -> None:
    """B3: ten coils by nature, drawn out by their weight; tip by a damped motion with Newton's method behind it."""
    material = dx.Material(E=1.3e6, nu=0.5, density=1200)
    hair = dx.Rod(1.0, dx.Circle(1.55e-3), material, natural=(62.0, 0, 0))
    found = dx.solve(dx.Equilibrium(hair, dx.Clamped(tangent=(0, 0, -1)), loads=[dx.Gravity()]))
    assert found.index == 0
    assert found.tip[2] == pytest.approx(-0.87252, abs=1e-5)
    assert found.energy.total == pytest.approx(-0.034293, abs=1e-6)


@pytest.mark.parametrize("stiff", [1.0, 3.0])
@pytest.mark.parametrize("rollers", [1, 7, 12])
def test_a_rod_in_guides_buckles_between_them(rollers: int, stiff: float) -> None:
    """A bit more than Euler's load of a span between clamps, 4 pi^2 EI / l^2, or less where spans lean on each other."""
    found = dx.solve(guided(rollers, 0.05, stiff))
    assert found.index == 0
    span = 10.0 / (rollers + 1)
    assert 0.9 * PI2 / span**2 < -found.reactions.end.force[2] < 4.4 * PI2 / span**2


def test_a_straight_rod_between_clamps_stays_so() -> None:
    """It does not stretch: whatever its twist, no other shape is possible."""
    found = dx.solve(dx.Equilibrium(ROUND, end=dx.Clamped(position=UP, twist=2.5 * dx.turn)))
    assert found.index == 0
    assert found.twist == pytest.approx(2.5)
    assert "branch" not in found.status.message


@pytest.mark.parametrize("segments", [100, 350, 1000])
def test_a_slack_chain_of_many_segments_comes_to_rest(segments: int) -> None:
    """B8: H = 0.0948967, sag 0.3906876."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1e-3, GJ=1e-3))
    problem = dx.Equilibrium(rod, dx.Pinned(), dx.Pinned((0.5, 0, 0)), [dx.LineForce((0, 0, -1.0))])
    found = dx.solve(problem, dx.DiscreteRod(segments))
    assert found.index == 0
    assert found.reactions.end.force[0] == pytest.approx(0.0948967, rel=5e-4)
    assert -found.r(0.5)[2] == pytest.approx(0.3906876, rel=1e-4)


def test_a_hundred_thousand_segments() -> None:
    """B8: the README's first rod, against Collocation."""
    rubber = dx.Material(E=1e6, nu=0.5, density=1e3)
    rod = dx.Rod(length=0.25, section=dx.Circle(radius=1e-3), material=rubber)
    hanging = dx.Equilibrium(rod, dx.Clamped(tangent=(1, 0, 0)), loads=[dx.Gravity()])
    found = dx.solve(hanging, dx.DiscreteRod(100_000))
    np.testing.assert_allclose(found.tip, dx.solve(hanging).tip, atol=1e-7)


def test_a_rod_that_need_not_fall_loads_nothing_for_it() -> None:
    """Nor SciPy, which takes as long to load as a hundred solves."""
    code = """
import sys
import darboux as dx
dx.solve(dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0)), loads=[dx.EndForce((1.0, 0, 0))]))
assert not {"scipy", "darboux.statics.descent"} & set(sys.modules)
"""
    subprocess.run([sys.executable, "-c", code], check=True)
