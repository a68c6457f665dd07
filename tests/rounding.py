"""An answer that depends on rounding is no answer: states disturbed between load steps, and what must come out all the same.

`python -m pytest -p tests.rounding ...` disturbs every load path of those tests.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

import darboux as dx
from darboux.kernels import path
from darboux.kernels.rod_equations import STATES
from darboux.statics.discrete_branch import ChainBranch
from darboux.statics.shooting import _Pieces

DISTURBANCE = 1e-13  # of L, in rad, and of EI / L^2 and EI / L
SAME = 1e-6  # of L
PLACES = np.linspace(0.0, 1.0, 21)


@contextmanager
def disturbed(seed: int, size: float = DISTURBANCE) -> Iterator[None]:
    """Disturb every state that a load path predicts, as the rounding of another processor does."""
    rng = np.random.default_rng(seed)
    with pytest.MonkeyPatch.context() as patch:
        follow = path.follow

        def one_step(rod: path.Rod, course: path.Course, most: int) -> int:
            reason = int(follow(rod, course, 1))
            if reason == path.PAUSED:
                elements = course.whole[path.HERE]
                for states in (
                    course.here.y[: (elements + 1) * STATES],
                    course.here.Y[: elements * rod.stages * STATES],
                ):
                    states += size * rng.normal(size=states.size)
            return reason

        patch.setattr(path, "follow", one_step)
        for branch in (ChainBranch, _Pieces):

            def predict(self: Any, state: Any, tangent: Any, step: float, own: Any = branch.predict) -> Any:
                return own(self, state, tangent + size / step * rng.normal(size=tangent.shape), step)

            patch.setattr(branch, "predict", predict)
        yield


@pytest.fixture(autouse=True)
def _disturbed() -> Iterator[None]:
    """For `-p tests.rounding`: a test is disturbed from its first line to its last."""
    with disturbed(seed=0):
        yield


def answer(problem: dx.Equilibrium, method: Any = None) -> dict[str, Any]:
    """Return status code, index and centreline (21, 3) over L, as plain values."""
    x = dx.solve(problem, method, throw=False)
    L = problem.rod.length
    return {"code": x.status.code, "index": x.index, "r": (x.r(PLACES * L) / L).tolist()}


def difference(one: dict[str, Any], other: dict[str, Any], family: Any = None) -> str:
    """Return in words what two answers differ in, "" for nothing; ``family`` the axis about which equilibria may be turned."""
    for name in ("code", "index"):
        if one[name] != other[name]:
            return f"{name} {one[name]} and {other[name]}"
    a, b = np.array(one["r"]), np.array(other["r"])
    if family is not None:
        a = turned_to(a, b, np.array(family))
    gap = float(np.max(np.linalg.norm(a - b, axis=1)))
    return "" if gap < SAME else f"{gap:.1e} L between the centrelines"


def turned_to(a: Any, b: Any, axis: Any) -> Any:
    """Return the curve a (n, 3), turned about an axis through the origin (a unit vector) so that it is nearest to b."""
    across = np.linalg.svd(axis[None])[2][1:]  # two unit vectors normal to the axis
    plane = [curve @ across.T @ np.array([1.0, 1.0j]) for curve in (a, b)]
    turn = np.vdot(*plane)
    turned = plane[0] * turn / max(abs(turn), 1e-300)
    return np.outer(a @ axis, axis) + np.stack([turned.real, turned.imag], axis=1) @ across
