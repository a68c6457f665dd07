"""Loads of every kind, branches and data that jump, through the methods."""

from __future__ import annotations

import numpy as np

import darboux as dx
from darboux.kernels import step_control
from darboux.statics import load_path, shooting
from darboux.statics.load_path import Corrected, Path, follow
from tests import cases

EULER = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.3, GJ=0.75))


def line_loads(L, EI):
    f, l = EI / L**3, EI / L**2
    return [
        dx.LineForce(np.array([2, 1, -1]) * f),
        dx.LineForce(np.array([1, -2, 0.5]) * f, frame="section"),
        dx.LineCouple(np.array([0.3, 0.4, -0.2]) * l),
        dx.LineCouple(np.array([-0.2, 0.5, 0.1]) * l, frame="section"),
    ]


def test_loads_along_a_rod_of_another_length_and_stiffness() -> None:
    unit, other = (
        dx.solve(dx.Equilibrium(dx.Rod(L, dx.Stiffness(EI1=EI, GJ=0.7 * EI)), loads=line_loads(L, EI)))
        for L, EI in ((1.0, 1.0), (5.0, 3.0))
    )
    s = np.linspace(0.0, 1.0, 11)
    np.testing.assert_allclose(other.r(5.0 * s) / 5.0, unit.r(s), atol=1e-9)
    np.testing.assert_allclose(other.m(5.0 * s) / (3.0 / 5.0), unit.m(s), atol=1e-8)
    np.testing.assert_allclose(other.n(5.0 * s) / (3.0 / 25.0), unit.n(s), atol=1e-8)


def test_dead_couples_along_a_discrete_rod() -> None:
    """Order 2 towards Shooting, on equal and on graded segments."""
    problem = dx.Equilibrium(cases.UNIT, loads=[dx.LineCouple((0.5, 2.0, 0.7)), dx.LineForce((1, 0, 0))])
    exact = dx.solve(problem)
    np.testing.assert_allclose(exact.m(1.0), 0.0, atol=1e-9)
    for grading in (1.0, 4.0):
        gaps = [
            np.linalg.norm(dx.solve(problem, dx.DiscreteRod(N, grading=grading)).tip - exact.tip) for N in (50, 100)
        ]
        assert gaps[1] < 1e-3
        assert 1.8 < np.log2(gaps[0] / gaps[1]) < 2.2, gaps


def test_integrate_starts_where_and_with_what_it_is_told() -> None:
    rod = dx.Rod(4.0, dx.Stiffness(EI1=3.0, GJ=2.0))
    curve = dx.integrate(rod, k=(0.1, 0.2, 0.3), n=(0.3, -0.2, 0.1), position=(1, 2, 3))
    np.testing.assert_allclose(curve.r(0.0), (1, 2, 3), rtol=1e-14)
    np.testing.assert_allclose(curve.n(np.array([0.0, 4.0])), [(0.3, -0.2, 0.1)] * 2, rtol=1e-12)
    np.testing.assert_allclose(curve.k(0.0), (0.1, 0.2, 0.3), rtol=1e-12)
    r0, m0, r1, m1, n = curve.r(0.0), curve.m(0.0), curve.r(4.0), curve.m(4.0), np.array([0.3, -0.2, 0.1])
    np.testing.assert_allclose(m1 + np.cross(r1, n), m0 + np.cross(r0, n), atol=1e-7)


def test_the_sign_of_newtons_determinant_does_not_depend_on_the_pieces() -> None:
    problem = cases.anisotropic((1.5, -1, -0.8), (0.4, 0.6, 0.9))
    signs = []
    for count in (4, 5, 6):
        pieces = shooting._Pieces(problem, count)
        signs.append(pieces.stability(pieces.unloaded(), 0.0)[0])
    assert signs[0] != 0.0
    assert len(set(signs)) == 1


def test_pieces_that_are_halved_on_the_way_are_no_crossing() -> None:
    solution = dx.solve(cases.heavy(1e4), dx.Shooting(pieces=5))
    assert solution.statistics["pieces"] > 5
    assert solution.statistics["crossings"] == ()
    assert "DiscreteRod()" not in solution.status.message


def test_the_force_at_a_jump_of_the_load() -> None:
    """A uniform load up to 0.37: n is linear up to there and zero beyond, between the nodes too."""
    load = dx.LineForce(lambda s: np.outer(s < 0.37, (0, -30.0, 0)))
    solution = dx.solve(dx.Equilibrium(cases.UNIT, start=cases.ALONG_X, loads=[load]))
    s = np.linspace(0.25, 0.5, 1001)
    np.testing.assert_allclose(solution.n(s)[:, 1], -30.0 * np.maximum(0.37 - s, 0.0), atol=1e-9)


def test_a_table_with_flanks_a_thousandth_long() -> None:
    """The quintic between nodes must not look across a kink of the data."""
    for w in (0.1, 0.01, 0.003):
        load = dx.LineForce(
            dx.Table([0, 0.5 - w, 0.5, 0.5 + w, 1], [[0, 0, 0]] * 2 + [[1 / w, 0, 0]] + [[0, 0, 0]] * 2, "linear")
        )
        solution = dx.solve(dx.Equilibrium(cases.UNIT, loads=[load]))
        s = np.linspace(0.0, 0.5 - w, 2001)
        np.testing.assert_allclose(solution.n(s)[:, 0], 1.0, atol=1e-9)


def test_frozen_edges_stay_frozen() -> None:
    """The gap that turning steps leave is not shared by the frozen edges."""
    problem = cases.posed()
    solution = dx.solve(problem, dx.DiscreteRod(50, "two_vertices"))
    np.testing.assert_allclose(50.0 * (solution.r(0.02) - solution.r(0.0)), (0, 0, 1), atol=1e-9)
    np.testing.assert_allclose(50.0 * (solution.r(1.0) - solution.r(0.98)), problem.end.R[:, 2], atol=1e-9)


class Recorder:
    """A branch without equations: what turns it reports, and at what loads it is asked."""

    def __init__(self, predicted=0.0, corrected=lambda step: 0.0):
        self.predicted, self.corrected, self.at, self.asked = predicted, corrected, 0.0, []

    def stability(self, state, load):
        return 1.0, None

    def tangent(self, state, load):
        self.at = load
        return np.zeros(1), self.predicted

    def predict(self, state, tangent, step):
        return state

    def correct(self, state, load):
        self.asked.append(load - self.at)
        return Corrected(state, self.corrected(load - self.at), 1.0, 1, None)


def test_a_step_is_no_longer_than_the_predicted_turn_allows() -> None:
    branch = Recorder(predicted=10.0)
    assert follow(branch, 0.0).load_factor == 1.0
    assert max(branch.asked) <= load_path.LARGEST_PREDICTED_TURN / 10.0 * (1.0 + 1e-12)


def test_a_corrector_that_turns_too_far_is_not_believed() -> None:
    """Turns of 4 h by the predictor and 30 h^2 by the corrector: what is accepted keeps to the rule."""
    branch = Recorder(predicted=4.0, corrected=lambda step: 30.0 * step**2)
    path = follow(branch, 0.0)
    assert path.load_factor == 1.0
    assert path.rejected > 0
    longest = min(np.sqrt(step_control.LARGEST_CORRECTED_TURN / 30.0), 4.0 * step_control.LARGEST_SHARE / 30.0)
    assert path.steps >= 1.0 / longest


def test_a_path_of_too_many_steps_is_no_fold() -> None:
    code, sentence = load_path.ending(Path(None, 0.5, steps=load_path.MOST_STEPS, slope=1e9), "Toy")
    assert code == "no_convergence"
    assert "gave up" in sentence
    assert load_path.ending(Path(None, 0.5, steps=10, slope=1e9), "Toy")[0] == "folded"
    assert "could not leave" in load_path.ending(Path(None, 0.0), "Toy")[1]


def test_a_discrete_branch_loses_its_stability_within_a_short_step() -> None:
    P = 2.6
    ((low, high),) = dx.solve(dx.Equilibrium(EULER, loads=[dx.EndForce((0, 0, -P))]), dx.DiscreteRod(80)).statistics[
        "crossings"
    ]
    assert low < 2.4674 / P < high
    assert high - low <= 2e-3


def test_a_straight_rod_drawn_taut_says_what_to_do() -> None:
    taut = dx.Equilibrium(cases.UNIT, end=dx.Clamped(position=(0, 0, 1.0)), loads=[dx.LineForce((1, 0, 0))])
    message = dx.solve(taut, dx.Shooting(), throw=False).status.message
    assert "without bound" in message


def test_forces_between_the_vertices_where_the_path_stopped() -> None:
    """An arch that snaps at a third of its load: n' = -f with the load that acts there, between the vertices too."""
    lean = np.array([np.cos(1.0), np.sin(1.0), 0.0])
    start = dx.Clamped(tangent=lean, d1=(-lean[1], lean[0], 0))
    end = dx.Clamped(position=(lean[1], 0, 0), tangent=lean * (1, -1, 1), d1=(lean[1], lean[0], 0))
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0), natural=(0, -2.0, 0))
    problem = dx.Equilibrium(rod, start, end, [dx.LineForce((0, -400.0, 0))])
    stopped = dx.solve(problem, dx.DiscreteRod(20, stable=False), throw=False)
    assert 0.0 < stopped.load_factor < 1.0
    s = np.linspace(0.0, 1.0, 401)
    force = stopped.n(s)[:, 1]
    np.testing.assert_allclose(force, force[0] + 400.0 * stopped.load_factor * s, atol=1e-9)
