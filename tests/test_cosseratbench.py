"""The adapter to cosseratbench, by that suite's own scenarios, references and metrics, where these are quick."""

import tomllib
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("cosseratbench")

from cosseratbench import experiment, registry, variations
from cosseratbench.experiments import twist
from cosseratbench.metrics import twist_angles
from cosseratbench.scenario import EndCondition, Material, Motion, PointLoad, Rod, Scenario
from cosseratbench.solver import Solver

from darboux.cosseratbench import DarbouxSolver, _tangent

SOFT = Material(youngs_modulus=1e6, shear_modulus=1e6 / 3.0, density=1000.0)
ALONG = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))


def test_the_entry_point_leads_to_a_solver() -> None:
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
    group = project["entry-points"][registry.SOLVERS]
    solver = EntryPoint("darboux", group["darboux"], registry.SOLVERS).load()(**{variations.TIME_STEP_SCALE: 2.0})
    assert isinstance(solver, Solver)


@pytest.mark.parametrize(
    ("name", "metric", "values", "n_elements", "largest"),
    [
        ("cantilever", "tip_deflection_error", {}, 20, 2e-3),
        # Of a softer cable the reference, which leaves bending out, is right to 7e-5.
        ("catenary", "shape_error", {"youngs_modulus": 1e5}, 50, 1e-4),
        ("pendulum", "period_error", {}, 25, 5e-5),
    ],
)
def test_metrics_of_the_suite(name: str, metric: str, values: dict, n_elements: int, largest: float) -> None:
    result = experiment.run(
        registry.load_experiment(name), DarbouxSolver(4.0), values=values, n_elements=n_elements, n_frames=51
    )
    assert result.outcome == experiment.COMPLETED
    assert result.metrics[metric] < largest


def test_clamps_stand_along_the_tangent_of_the_initial_curve() -> None:
    """The suite's twisted rods set out along x; the first chord of their 200 rises by 5e-6."""
    rod = registry.load_experiment("twist").scenario.rods[0]
    for points, away in ((rod.centerline, 1.0), (rod.centerline[::-1], -1.0)):
        tangent = _tangent(points)
        np.testing.assert_allclose(tangent / np.linalg.norm(tangent), (away, 0.0, 0.0), atol=1e-7)
    np.testing.assert_allclose(_tangent(((0.0, 0.0, 0.0), (0.0, 2.0, 0.0))), (0.0, 2.0, 0.0))


def test_the_twist_at_which_a_rod_buckles(monkeypatch: pytest.MonkeyPatch) -> None:
    """The suite's own fit says 0.2 % on exact growth rates. Clamps along the first chord bend the rod for good, which looks
    like growth at the critical twist itself, and made it 0.5 %. The two rods below that twist are left out.
    """
    monkeypatch.setattr(twist, "LEVELS", (1.0, 1.02, 1.04, 1.06))
    result = experiment.run(twist.twist, DarbouxSolver(4.0))
    assert result.outcome == experiment.COMPLETED
    assert twist.growth_rates(twist.twist.scenario, result.trajectory)[0] < 0.0
    assert result.metrics["critical_twist_error"] < 3e-3


@pytest.mark.parametrize("name", ["capstan", "pile"])
def test_contact_is_declined(name: str) -> None:
    assert experiment.run(registry.load_experiment(name), DarbouxSolver()).outcome == experiment.UNSUPPORTED


def test_an_end_is_turned_and_slides_under_its_load() -> None:
    angle, tension, N = 2.0, 0.05, 8
    times = np.linspace(0.0, 2.0, 41)
    turns = angle * np.sin(0.25 * np.pi * times) ** 2
    motion = Motion(
        tuple(times), ((0.0, 0.0, 0.0),) * 41, tuple((float(a), 0.0, 0.0) for a in turns), slides_along=(1.0, 0.0, 0.0)
    )
    clamped = EndCondition.CLAMPED
    rod = Rod(ALONG, 0.01, SOFT, start=clamped, end=clamped, end_motion=motion, loads=(PointLoad((tension, 0.0, 0.0)),))
    run = DarbouxSolver().run(Scenario((rod,), duration=12.0, quasi_static=True), n_elements=N, n_frames=3)
    r, d1 = run.positions[0], run.directors[0]
    np.testing.assert_allclose(d1[0], rod.directors(N), atol=1e-12)
    # Half a segment's twist lies beyond the first and the last of its directors.
    np.testing.assert_allclose(twist_angles(r[-1], d1[-1]), angle / N, rtol=1e-3)
    assert r[-1, -1, 0] == pytest.approx(1.0 + tension / (SOFT.youngs_modulus * rod.area), rel=1e-6)


def test_a_free_rod_falls() -> None:
    scenario = Scenario((Rod(ALONG, 0.01, SOFT),), duration=0.2, gravity=(0.0, 0.0, -9.81))
    run = DarbouxSolver().run(scenario, n_elements=4, n_frames=3)
    np.testing.assert_allclose(run.positions[0][-1, :, 2], -0.5 * 9.81 * 0.2**2, rtol=1e-9)


def test_what_the_library_refuses_is_declined_with_its_sentence() -> None:
    brittle = Material(youngs_modulus=1e6, shear_modulus=1e5, density=1000.0)
    with pytest.raises(NotImplementedError, match=r"material.G is 100000 Pa"):
        DarbouxSolver().run(Scenario((Rod(ALONG, 0.01, brittle),), duration=1.0), n_elements=4, n_frames=2)
