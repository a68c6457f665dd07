"""The agreement of methods: distances, orders, unlike models, the words."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import darboux as dx
from darboux import comparison
from darboux.solution import ErrorEstimate
from tests import cases

HEAVY = cases.heavy(50.0)


def test_three_theories_agree() -> None:
    found = dx.compare(HEAVY, [dx.Shooting(), dx.Elastica(), dx.DiscreteRod(60)])
    shooting, elastica, discrete = found.entries
    assert found.distance(0, 1).centreline < 1e-11
    assert found.distance(1, 0).moment < 1e-10
    assert found.distance(0, 1).energy < 1e-10
    assert discrete.order == pytest.approx(2.0, abs=0.4)
    assert discrete.distance.tip <= discrete.distance.centreline
    assert shooting.order is None
    assert elastica.order is None
    text = str(found)
    for word in ("Shooting()", "Elastica()", "DiscreteRod(60)", "agree to", "closes in with order", "reference"):
        assert word in text
    assert max(map(len, text.splitlines())) <= 100
    assert found[0].tip == pytest.approx(found.entries[0].solution.tip)


def test_the_distance_is_what_it_says() -> None:
    """Two rods under weights of w and 0: distances at equal s by hand."""
    a, b = dx.solve(cases.heavy(1.0)), dx.solve(cases.heavy(0.0))
    gap = comparison.distance(a, b)
    s = np.linspace(0.0, 1.0, comparison.SAMPLES)
    assert gap.centreline == pytest.approx(np.max(np.linalg.norm(a.r(s) - np.outer(s, (1, 0, 0)), axis=1)))
    assert gap.tip == pytest.approx(np.hypot(1.0 - 0.991246395346635179, 0.123471401983351056), rel=1e-9)  # case S05


def test_unlike_models_are_refused_or_marked() -> None:
    stretching = cases.STRETCHED[0].problem
    methods = [dx.Shooting(), dx.Elastica()]
    with pytest.raises(dx.InvalidInput, match="unlike_models='mark'"):
        dx.compare(stretching, methods)
    found = dx.compare(stretching, methods, unlike_models="mark")
    assert "Unlike models: Elastica() solves the inextensible rod" in found.verdict
    assert "Elastica() (inextensible)" in str(found)
    assert found.reference == 0
    # Figure 5's rod stretches by up to a quarter of a per cent under its own weight: that is what is left.
    assert 1e-3 < found.entries[1].distance.tip < 3e-3


def test_a_method_that_fails_is_named() -> None:
    class Broken:
        """A method whose answer is another problem's, and says that it did not converge."""

        def refuses(self, problem: dx.Equilibrium) -> str | None:
            return None

        def solve(self, problem: dx.Equilibrium) -> dx.EquilibriumSolution:
            other = dx.Shooting().solve(problem)
            return dataclasses.replace(other, method=self, status=dx.Status("no_convergence", "it gave up."))

        def __str__(self) -> str:
            return "Broken()"

    found = dx.compare(HEAVY, [Broken(), dx.Shooting()])
    assert found.reference == 1
    assert "Broken() did not converge: it gave up." in found.verdict
    assert "(not converged)" in str(found)


def test_answers_that_differ_are_called_different() -> None:
    class Wrong:
        """A continuous method that lands on another answer."""

        def refuses(self, problem: dx.Equilibrium) -> str | None:
            return None

        def solve(self, problem: dx.Equilibrium) -> dx.EquilibriumSolution:
            return dx.Shooting(rtol=1e-6).solve(cases.heavy(60.0))

        def __str__(self) -> str:
            return "Wrong()"

    assert "do not agree" in dx.compare(HEAVY, [dx.Shooting(), Wrong()]).verdict


def test_distances_are_relative_to_length_moment_and_energy() -> None:
    rod = dx.Rod(4.0, dx.Stiffness(EI1=3.0, GJ=1.0))
    a, b = (dx.solve(dx.Equilibrium(rod, loads=[dx.EndForce((P, 0, 0))])) for P in (0.2, 0.3))
    gap = comparison.distance(a, b)
    s = np.linspace(0.0, 4.0, comparison.SAMPLES)
    assert gap.centreline == pytest.approx(np.max(np.linalg.norm(a.r(s) - b.r(s), axis=1)) / 4.0)
    assert gap.tip == pytest.approx(np.linalg.norm(a.tip - b.tip) / 4.0)
    assert gap.moment == pytest.approx(1.0 - np.linalg.norm(a.m(0.0)) / np.linalg.norm(b.m(0.0)))
    assert gap.energy == pytest.approx(1.0 - a.energy.elastic / b.energy.elastic)


def test_moments_are_held_against_the_largest_along_the_rod() -> None:
    """A couple along the rod that takes the end moment back: the largest moment is not at an end."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0))
    a, b = (
        dx.solve(
            dx.Equilibrium(rod, loads=[dx.LineCouple(lambda s, c=c: np.column_stack([0 * s, 0 * s, c * (1 - 2 * s)]))])
        )
        for c in (1.0, 1.1)
    )
    assert np.linalg.norm(b.m(0.5)) == pytest.approx(0.275)
    a = dataclasses.replace(a, curve=dataclasses.replace(a.curve, y=a.curve.y + 1e-3 * np.eye(13)[12]))
    assert comparison.distance(a, b).moment == pytest.approx(1e-3 / 0.275, rel=1e-3)


def test_the_reference_solves_the_model_described() -> None:
    """However small the error that a method of another model estimates."""

    class Sure:
        def refuses(self, problem):
            return "stretches" if problem.rod.stretch else None

        def solve(self, problem):
            return dataclasses.replace(dx.Shooting().solve(problem), method=self, error=ErrorEstimate(0.0))

        def __str__(self):
            return "Sure()"

    found = dx.compare(cases.STRETCHED[0].problem, [Sure(), dx.Shooting(rtol=1e-4)], unlike_models="mark")
    assert found.reference == 1


def test_the_words_follow_the_gap() -> None:
    class Near:
        def refuses(self, problem):
            return None

        def solve(self, problem):
            return dataclasses.replace(dx.Shooting(rtol=1e-6).solve(cases.heavy(50.1)), method=self)

        def __str__(self):
            return "Near()"

    verdict = dx.compare(cases.heavy(50.0), [dx.Shooting(), Near()]).verdict
    assert "L apart." in verdict
    assert "do not agree" not in verdict


def test_only_what_a_method_cannot_state_is_left_out() -> None:
    problem = cases.anisotropic((1.5, -1, -0.8), (0.4, 0.6, 0.9), **cases.COSSERAT)
    found = dx.compare(problem, [dx.Shooting(), dx.DiscreteRod(20)], unlike_models="mark")
    assert found[1].model == "stretch"
