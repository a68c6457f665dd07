"""The index of an equilibrium: short elements put together count as they do one by one."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from darboux.kernels import collocation, stability
from darboux.kernels.system import FREE
from darboux.statics.collocation_equations import Equations
from darboux.statics.mesh import Mesh
from tests import cases

UP = (0.0, 0.0, 1.0)
FLAT = dx.Rod(1.0, dx.Stiffness(EI1=1.4, EI2=1.0, GJ=0.7))
BENT = dx.Rod(1.0, dx.Stiffness(EI1=1.4, EI2=1.0, GJ=0.7, EA=1e3), natural=(0.5, 0.2, 1.0), stretch=True)
PI = np.pi**2
PROBLEMS = {  # with the index of the straight branch, or None where it is whatever the elements say
    "free column": (dx.Equilibrium(FLAT, loads=[dx.EndForce((0, 0, -1.1 * PI * 9 / 4))]), 3),
    "clamped column": (dx.Equilibrium(FLAT, end=dx.Slider(along=UP), loads=[dx.EndForce((0, 0, -4.5 * PI))]), 1),
    "round column": (dx.Equilibrium(cases.UNIT, end=dx.Roller(along=UP), loads=[dx.EndForce((0, 0, -25.0))]), 2),
    "held between": (
        dx.Equilibrium(
            FLAT,
            dx.Pinned(),
            dx.Roller(along=UP),
            [dx.EndForce((0, 0, -4.2 * PI))],
            between={0.5: dx.Roller(along=UP)},
        ),
        1,
    ),
    "taut": (dx.Equilibrium(FLAT, dx.Clamped(), dx.Clamped(UP)), 0),
    "bent": (dx.Equilibrium(BENT, loads=[dx.LineForce((3.0, 1.0, -8.0)), dx.PointForce((0, 2, -9.0), at=0.4)]), None),
}


def at_full_load(equations: Equations, elements: int) -> Mesh:
    """The first branch at full load, without a path: these are straight, or nearly so."""
    mesh = equations.unloaded()
    x = np.unique(np.concatenate([np.linspace(0.0, 1.0, elements + 1), equations.breaks]))
    mesh = mesh.laid(np.sort(np.concatenate([x, mesh.x[mesh.joints]])))
    for load_factor in np.linspace(0.25, 1.0, 4):
        found = equations.newton(mesh, float(load_factor), 1e-9, most=30)
        assert found is not None
        mesh = found[0]
    return mesh


def far_from_one(T: np.ndarray, h: float) -> float:
    """|A - 1|, the largest sum of a row, with places over four times the length."""
    unit = np.repeat([4.0 * h, 1.0], 3)
    return float(np.max(np.sum(np.abs(T[:6, :6] - np.eye(6)) * unit / unit[:, None], axis=1)))


@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning")  # NumPy says so where kernels are not compiled
@pytest.mark.parametrize("name", PROBLEMS)
def test_pieces_of_several_elements_count_the_same(name: str) -> None:
    """And far fewer are left; the product of their transfers is that of all."""
    problem, expected = PROBLEMS[name]
    equations = Equations(problem, 2)
    mesh = at_full_load(equations, 24)
    one_by_one = equations.second_variation(mesh, 1.0).index
    assert equations.index(mesh, 1.0) == one_by_one
    assert one_by_one == expected or expected is None
    system, T = equations.system(mesh, 1.0), np.empty((mesh.elements, FREE, FREE))
    collocation.transfers(system, T.ravel())
    merged, nodes = T.copy(), np.empty(mesh.elements + 1, np.int64)
    count = stability.merge(system, merged.ravel(), nodes)
    assert count <= 15
    assert set(mesh.joints + 1) <= set(nodes[:count])
    assert nodes[count] == len(mesh.x) - 1
    first = np.searchsorted(np.flatnonzero(mesh.wide), nodes[: count + 1])  # elements
    for k, piece in enumerate(merged[:count]):
        h = float(np.sum(np.diff(mesh.x)[nodes[k] : nodes[k + 1]]))
        assert first[k + 1] == first[k] + 1 or far_from_one(piece, h) < stability.SHORT
        if k + 1 < count and nodes[k + 1] - 1 not in mesh.joints:  # nor would one more element do
            more = float(mesh.x[nodes[k + 1] + 1] - mesh.x[nodes[k + 1]])
            assert far_from_one(T[first[k + 1]] @ piece, h + more) >= stability.SHORT
    whole, parts = np.eye(FREE), np.eye(FREE)
    for one in T:
        whole = one @ whole
    for one in merged[:count]:
        parts = one @ parts
    np.testing.assert_allclose(parts, whole, atol=1e-9 * np.max(np.abs(whole)))
