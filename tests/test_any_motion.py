"""Any motion is followed with its balances kept, or ends in words: never in an exception or a NaN, never for ever.

DARBOUX_FUZZ=2000 (`make fuzz`) tries a quarter as many, drawn anew each time; the test run thirty, always the same.
"""

from __future__ import annotations

import os
from collections import Counter
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, note, settings

import darboux as dx
from darboux.statics.discrete_chain import nodes_along
from tests.strategies import motions

EXAMPLES = int(os.environ.get("DARBOUX_FUZZ", "0")) // 4
MOST_STEPS = 100_000  # of the thirty the longest takes 6,400
RECORDS = 7


def check_balances(run: dx.Trajectory) -> None:
    """Check what every motion keeps, whoever computed it, from the records alone."""
    motion, rod = run.motion, run.motion.problem.rod
    cells = np.diff(run.s)
    if not rod.stretch:
        lengths = np.linalg.norm(np.diff(run.positions, axis=1), axis=2)
        np.testing.assert_allclose(lengths, np.broadcast_to(cells, lengths.shape), rtol=1e-6)
    for at, i in (("start", 0), ("end", -1)):
        if all(getattr(motion.problem, at).held_displacement):
            held = [t for t in range(len(run.times)) if motion.held(at, float(run.times[t]))]
            places = np.array([motion.position(at, float(run.times[t])) for t in held]).reshape(-1, 3)
            np.testing.assert_allclose(run.positions[held, i], places, atol=1e-7 * rod.length)
    frames = run.frames
    tangents = np.diff(run.positions, axis=1)
    tangents /= np.linalg.norm(tangents, axis=2, keepdims=True)
    np.testing.assert_allclose(frames[..., 2], tangents, atol=1e-7)
    if set(dict(motion.release).items()) >= {("start", 0.0), ("end", 0.0)} or (
        not motion.problem.end.holds and dict(motion.release).get("start") == 0.0
    ):
        check_free_flight(run)


def check_free_flight(run: dx.Trajectory) -> None:
    """In free flight the momentum changes by the weight alone, where nothing else acts."""
    motion = run.motion
    acting = motion.problem.loads
    if motion.damping or motion.problem.between or not all(isinstance(load, dx.Gravity) for load in acting):
        return
    if not all(factor is None or not callable(factor) for factor in motion.factors):
        return
    s = np.linspace(0.0, motion.problem.rod.length, 2001)
    mass = float(np.trapezoid(motion.problem.rod.mass(s, "the test"), s))
    factors = motion.factors if len(motion.factors) == len(acting) else motion.factors * len(acting)
    weight = sum(
        (mass * (1.0 if f is None else f) * np.array(load.g) for f, load in zip(factors, acting, strict=True)),
        np.zeros(3),
    )
    expected = run.momentum[0] + run.times[:, None] * weight
    size = np.max(np.abs(run.momentum)) + mass * motion.problem.rod.length / motion.duration
    np.testing.assert_allclose(run.momentum, expected, atol=1e-5 * size)


def check(motion: dx.Motion, method: Any) -> str:
    """Follow a motion, check what came of it, and return how it ended."""
    try:
        run = dx.simulate(motion, method, records=RECORDS, throw=False)
    except dx.InvalidInput as refusal:
        return f"refused: {str(refusal)[:40]}"
    except dx.NotConverged:
        if motion.initial != "equilibrium":
            raise
        return "no equilibrium"
    assert run.statistics["steps"] < MOST_STEPS
    for part in (run.positions, run.velocities, run.directors, run.spins, run.momentum, run.energy.balance):
        assert np.all(np.isfinite(part))
    assert str(run)
    assert run.status.code in {"converged", "drift", "no_convergence"}
    assert run.status.message.endswith((".", "?"))
    if run.status.code == "converged":
        assert run.times[-1] == motion.duration
        assert run.energy.drift <= 0.01
    else:
        assert run.times[-1] <= motion.duration
    check_balances(run)
    return run.status.code


def test_any_motion_is_followed_or_said_why_not() -> None:
    ended: Counter[str] = Counter()

    @settings(
        max_examples=EXAMPLES or 30,
        derandomize=not EXAMPLES,
        deadline=None,
        database=None,
        print_blob=True,
        suppress_health_check=list(HealthCheck),
    )
    @given(drawn=motions())
    def any_motion(drawn: tuple[dx.Motion, Any]) -> None:
        note(repr(drawn))
        ended[check(*drawn)] += 1

    any_motion()
    assert ended["converged"] > 0.4 * sum(ended.values()), ended


def test_an_end_that_let_go_may_be_moved_any_way() -> None:
    """Found by the test above: what moves a released end pulls at nothing."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0, EA=100.0, mass=1.0))
    problem = dx.Equilibrium(rod, end=dx.Clamped(position=(0, 0, 1)))
    away = dx.Moving(position=lambda t: np.array([0.0, 0.0, 1.0 + t]))
    with pytest.raises(dx.InvalidInput, match="does not stretch"):
        dx.Motion(problem, 0.1, end=away)
    assert check(dx.Motion(problem, 0.1, end=away, release={"end": 0.0}), dx.TRBDF2(4)) == "converged"


def test_no_factors_for_no_loads_are_none() -> None:
    """Found by the test above on uncompiled kernels: they read the factor of a group of loads that was not there."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0, EA=100.0, mass=1.0))
    motion = dx.Motion(
        dx.Equilibrium(rod, start=dx.Pinned()), 0.1, load_factor=[], velocity=lambda s: s[:, None] * (1, 0, 0)
    )
    assert motion.load_factor is None
    assert check(motion, dx.ImplicitMidpoint(2, step=0.01)) == "converged"


def test_loads_close_together_have_vertices_of_their_own() -> None:
    """Found by the test above: with few segments two places fell on one vertex, and kernels read beyond their arrays."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0, EA=100.0, mass=1.0))
    loads = [dx.PointForce((0, 1, 0), at=0.46), dx.PointMoment((0, 0, 0.1), at=0.072, follower=True)]
    motion = dx.Motion(dx.Equilibrium(rod, loads=loads), 0.1)
    assert check(motion, dx.TRBDF2(3)) == "converged"
    assert set(dx.simulate(motion, dx.TRBDF2(3)).s) > {0.072, 0.46}
    with pytest.raises(dx.InvalidInput, match=r"segments is 2, .* at 2 places .* take 3 segments or more"):
        dx.simulate(motion, dx.TRBDF2(2))
    with pytest.raises(dx.InvalidInput, match="take 3 segments or more"):
        dx.solve(motion.problem, dx.DiscreteRod(2))


def test_every_station_has_a_vertex() -> None:
    chance = np.random.default_rng(0)
    for _ in range(300):
        segments = int(chance.integers(2, 12))
        stations = np.sort(chance.uniform(0.001, 0.999, chance.integers(1, segments)) ** chance.choice([1, 4]))
        held = chance.choice([False, True], 2)
        nodes = nodes_along(segments, chance.choice([1.0, 20.0]), *held, stations, int(chance.integers(0, 2)))
        assert np.all(np.diff(nodes) > 0.0)
        assert set(stations) <= set(nodes)
