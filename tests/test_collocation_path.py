"""The path of collocation, which the kernel follows: the same however it is interrupted, and with arrays that were too small."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from darboux.statics import collocation_path
from darboux.statics.collocation_equations import Equations
from tests import cases

ROD = dx.Rod(1.0, dx.Stiffness(EI1=1.4, EI2=1.0, GJ=0.7), natural=(0.5, 0.2, 1.0))
SHAPED = dx.LineForce(lambda s, r, R: -200.0 * r + 20.0 * R[:, :, 0] * s[:, None])
PROBLEMS = {
    "stiff": cases.tip_force(1000.0),
    "turned": cases.rolled(2),
    "loads of the shape": dx.Equilibrium(ROD, dx.Clamped(), dx.Pinned((0.1, 0.2, 0.8)), [SHAPED]),
    "station": dx.Equilibrium(ROD, loads=[dx.PointForce((30.0, 0.0, 5.0), at=0.4), dx.LineForce((0.0, 60.0, 0.0))]),
    "column": dx.Equilibrium(cases.UNIT, loads=[dx.EndForce((0, 0, -4))]),
}


def followed(problem: dx.Equilibrium) -> collocation_path.Path:
    equations = Equations(problem, 2)
    return collocation_path.follow(equations, equations.unloaded())


@pytest.mark.parametrize("name", PROBLEMS)
def test_interruptions_and_small_arrays_change_nothing(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = followed(PROBLEMS[name])
    assert whole.load_factor == 1.0
    assert whole.steps > 3
    course = collocation_path._course
    first = [True]

    def small(room: int, *rest: object) -> object:
        room, first[0] = (14 if first[0] else room), False
        return course(room, *rest)

    monkeypatch.setattr(collocation_path, "TRIES", 1)
    monkeypatch.setattr(collocation_path, "_course", small)
    parts = followed(PROBLEMS[name])
    for part in ("steps", "rejected", "iterations", "crossings", "index", "slope"):
        assert getattr(parts, part) == getattr(whole, part)
    for part in ("x", "y", "Y"):
        np.testing.assert_array_equal(getattr(parts.state, part), getattr(whole.state, part))


def test_what_is_stopped_goes_no_further(monkeypatch: pytest.MonkeyPatch) -> None:
    equations = Equations(PROBLEMS["stiff"], 2)
    whole = collocation_path.follow(equations, equations.unloaded())
    follow, calls = collocation_path.kernel.follow, []

    def interrupted(*arguments: object) -> int:
        calls.append(1)
        if len(calls) > 5:
            raise KeyboardInterrupt
        return int(follow(*arguments))

    monkeypatch.setattr(collocation_path, "TRIES", 1)
    monkeypatch.setattr(collocation_path.kernel, "follow", interrupted)
    with pytest.raises(collocation_path.Stopped) as stop:
        collocation_path.follow(equations, equations.unloaded())
    assert stop.value.path.steps == 5 < whole.steps
    assert 0.0 < stop.value.path.load_factor < 1.0
