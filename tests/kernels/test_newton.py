"""Newton's method in the kernel takes the steps that its rule says: against the same steps taken one by one."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from darboux.statics.collocation_equations import Equations
from darboux.statics.mesh import Mesh

ROD = dx.Rod(1.0, dx.Stiffness(EI1=1.4, EI2=1.0, GJ=0.7), natural=(0.5, 0.2, 1.0))
LOADS = [dx.LineForce((3.0, 1.0, -2.0)), dx.LineForce(lambda s, r, R: -2.0 * r + R[:, :, 0] * s[:, None])]


def one_by_one(equations: Equations, mesh: Mesh, load_factor: float, tolerance: float, most: int) -> tuple | None:
    """A step must be half as long as the last one, and ends if it, or what follows by the square, is small."""
    last, turned = np.inf, 0.0
    for count in range(1, most + 1):
        step = equations.newton_step(mesh, load_factor)
        if step is None or step.length > max(0.5 * last, 10.0 * tolerance):
            return None
        mesh = equations.moved(mesh, load_factor, step.delta)
        turned += step.turn
        next_one = min(1e4 * step.length, 10.0 * (step.length / last) ** 2 if np.isfinite(last) else np.inf)
        if step.length * min(1.0, next_one) <= tolerance:
            return mesh, turned, count
        last = step.length
    return None


@pytest.mark.parametrize("loads", [LOADS[:1], LOADS], ids=["dead", "function"])
@pytest.mark.parametrize("end", [dx.Free(), dx.Pinned((0.1, 0.2, 0.8))], ids=["free", "pinned"])
def test_the_kernel_takes_the_steps_of_the_rule(end: dx.Free, loads: list) -> None:
    equations = Equations(dx.Equilibrium(ROD, end=end, loads=loads), 2)
    start, ends = equations.unloaded(), set()
    for load_factor in np.geomspace(0.03, 60.0, 6):
        for tolerance in (1e-3, 1e-9):
            for most in (3, 8):
                expected = one_by_one(equations, start, load_factor, tolerance, most)
                before, equations.iterations = start.y.copy(), 0
                found = equations.newton(start, load_factor, tolerance, most)
                np.testing.assert_array_equal(start.y, before)
                assert (found is None) == (expected is None)
                ends.add(None if found is None else found[3])
                if found is not None and expected is not None:
                    np.testing.assert_allclose(found[0].y, expected[0].y, atol=1e-12 * np.max(np.abs(found[0].y)))
                    np.testing.assert_allclose(found[2], expected[1], rtol=1e-9)
                    assert found[3] == expected[2] == equations.iterations
    assert {None, 2, 4} <= ends
