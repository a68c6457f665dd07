"""The element whose loads depend on neither place nor frame, against the general one, which takes the same states.

Coefficients are random polynomials that jump within elements, states random but for n, r and m of the stages, which are explicit:
`write_element` writes them. Then both are Newton's equations of the same collocation, and agree but for rounding.
"""

from __future__ import annotations

import numpy as np
import pytest

from darboux.kernels import collocation, element
from darboux.kernels.gauss import gauss
from darboux.kernels.profile import Profile
from darboux.kernels.rod_equations import (
    DEAD_MOMENT,
    FORCE,
    FORCE_GRADIENT,
    K0,
    POSITION,
    ROTATION,
    SINV,
    STATES,
    WIDTH,
    derivatives,
)
from darboux.kernels.system import FREE, ROW, SIDES, System

X = np.array([0.0, 0.22, 0.37, 0.37, 0.74, 1.0])  # with a joint
BREAKS = np.array([0.0, 0.3, 0.5, 0.55, 1.0])  # none of them a node, two in one element
WIDE = [0, 1, 3, 4]  # elements that have a width
DEGREE = 2
EXACT = 1e-12


def system(stages: int, *, stretch: bool, load_factor: float = 0.7) -> System:
    """Random coefficients, but that no force of the table depends on place or frame; their rates may."""
    rng = np.random.default_rng(stages)
    tables = []
    for _ in range(2):
        table = rng.normal(size=(BREAKS.size - 1, DEGREE + 1, WIDTH))
        if not stretch:
            table[:, :, SINV:K0] = 0.0
        tables.append(table)
    tables[0][:, :, FORCE_GRADIENT:DEAD_MOMENT] = 0.0
    y, Y = (rng.normal(size=shape) for shape in ((X.size, STATES), (X.size - 1, stages, STATES)))
    y[:, ROTATION:FORCE] /= np.linalg.norm(y[:, ROTATION:FORCE], axis=1, keepdims=True)
    profiles = [Profile(BREAKS, table.ravel(), DEGREE) for table in tables]
    made = System(stages, X, y.ravel(), Y.ravel(), *profiles, np.empty(0), load_factor)
    assert element.is_explicit(made)
    return made


def coefficients(given: System, i: int) -> np.ndarray:
    """Those at the stages of an element (stages, 36), by NumPy."""
    places = X[i] + (X[i + 1] - X[i]) * gauss(given.stages)[0]
    piece = np.searchsorted(BREAKS, places, side="right") - 1
    C = given.table.coefficients.reshape(-1, DEGREE + 1, WIDTH)[piece]
    t = (places - BREAKS[piece])[:, None]
    return C[:, 0] + t * (C[:, 1] + t * C[:, 2])


def general(given: System, i: int) -> np.ndarray:
    """The rows of the general element."""
    T = np.empty(FREE * ROW)
    plan = collocation._planned(given, given.stages, FREE + SIDES)
    collocation._element(given, i, plan, np.empty(STATES), T)
    return T.reshape(FREE, ROW)


def generals_stages(given: System, i: int, delta: np.ndarray, change: float) -> np.ndarray:
    """The steps of an element's stages by the general element, (stages, 4) of the quaternions."""
    plan, start = collocation._planned(given, given.stages, SIDES), np.empty(STATES)
    collocation._moved(given.y, i * STATES, delta.ravel(), i * FREE * SIDES, 1.0, start)
    plan.X[:] = 0.0
    collocation._linearise(given, i, plan)
    collocation._condense(given, i, start, plan)
    collocation._solve(plan, change)
    rows = [collocation._row(plan, collocation.Q, j) + a for j in range(given.stages) for a in range(4)]
    return np.array([plan.X[row * plan.width + plan.unknowns] for row in rows]).reshape(-1, 4)


@pytest.mark.parametrize("stretch", [False, True])
@pytest.mark.parametrize("stages", [2, 3, 4, 5])
def test_its_rows_are_the_general_elements(stages: int, *, stretch: bool) -> None:
    """Whatever order the elements come in: the piece of the table is looked for both ways."""
    given, at, T = system(stages, stretch=stretch), element.bench(stages), np.empty(FREE * ROW)
    for i in [*WIDE, *reversed(WIDE)]:
        element.write_element(given, i, at, T)
        expected = general(given, i)
        np.testing.assert_allclose(T.reshape(FREE, ROW), expected, rtol=0, atol=EXACT * np.max(np.abs(expected)))


@pytest.mark.parametrize("stretch", [False, True])
@pytest.mark.parametrize("stages", [2, 3, 4, 5])
def test_what_is_explicit_is_met(stages: int, *, stretch: bool) -> None:
    """n, r and m of the stages follow from the node and the slopes there."""
    given, at, T = system(stages, stretch=stretch), element.bench(stages), np.empty(FREE * ROW)
    before = given.Y.reshape(-1, STATES)[:, ROTATION:FORCE].copy()
    for i in WIDE:
        element.write_element(given, i, at, T)
        Y, slopes = given.Y.reshape(-1, stages, STATES)[i], np.empty((stages, STATES))
        derivatives(Y.ravel(), coefficients(given, i).ravel(), slopes.ravel())
        found = Y - given.y.reshape(-1, STATES)[i] - (X[i + 1] - X[i]) * gauss(stages)[1][:-1] @ slopes
        explicit = np.r_[POSITION:ROTATION, FORCE:STATES]
        np.testing.assert_allclose(found[:, explicit], 0.0, atol=EXACT * max(1.0, np.max(np.abs(slopes))))
    np.testing.assert_array_equal(given.Y.reshape(-1, STATES)[:, ROTATION:FORCE], before)


@pytest.mark.parametrize("stages", [2, 3, 4, 5])
def test_its_stages_move_as_the_general_elements(stages: int) -> None:
    """By the numbers that are kept, and by those that `advance` finds where none were."""
    given, rng = system(stages, stretch=True), np.random.default_rng(3)
    at, T, size = element.bench(stages), np.empty(FREE * ROW), 4 * stages * element.LINE
    kept, delta = np.empty((X.size - 1, size)), 0.1 * rng.normal(size=(X.size, FREE, SIDES))
    change, part, expected = 0.3, 0.8, {}
    for i in WIDE:
        element.write_element(given, i, at, T)
        element.keep(at, stages, kept[i])
        dq, expected[i] = np.empty(4 * stages), generals_stages(given, i, delta, change)
        element.write_steps(kept[i], delta[i].ravel(), change, dq)
        size_of = EXACT * np.max(np.abs(expected[i]))
        np.testing.assert_allclose(dq.reshape(-1, 4), expected[i], rtol=0, atol=10.0 * size_of)
    before, moved = given.Y.reshape(-1, stages, STATES).copy(), []
    for numbers in (kept.ravel(), np.empty(0)):
        y, Y = np.empty_like(given.y), np.empty_like(given.Y)
        collocation.advance(given, delta.ravel(), change, part, numbers, y, Y)
        moved.append(Y.reshape(-1, stages, STATES))
        for i in WIDE:
            found = moved[-1][i, :, ROTATION:FORCE] - before[i, :, ROTATION:FORCE]
            np.testing.assert_allclose(found, part * expected[i], atol=1e-11 * np.max(np.abs(expected[i])))
    np.testing.assert_array_equal(*moved)


def test_which_loads_leave_n_explicit() -> None:
    """A force by the place or by the frame does not, a couple by the frame does."""
    given = system(2, stretch=True)
    for column, explicit in ((FORCE_GRADIENT, False), (DEAD_MOMENT - 1, False), (DEAD_MOMENT, True), (WIDTH - 1, True)):
        table = given.table.coefficients.copy()
        table.reshape(-1, WIDTH)[-1, column] = 1e-3
        assert element.is_explicit(given._replace(table=Profile(BREAKS, table, DEGREE))) is explicit
    assert not element.is_explicit(given._replace(shaped=np.zeros(1)))


@pytest.mark.parametrize("stages", [2, 3, 4, 5])
def test_equations_without_a_pivot_on_the_diagonal_are_solved(stages: int) -> None:
    """The stages' own never need it, but where an element turns far its rows do."""
    rng, n = np.random.default_rng(stages), 4 * stages
    A = np.eye(n)[rng.permutation(n)] + 1e-9 * rng.normal(size=(n, n))
    V = np.hstack([A, rng.normal(size=(n, element.LINE))])
    expected = np.linalg.solve(A, V[:, n:])
    flat = V.ravel()
    element._solve(flat, stages)
    np.testing.assert_allclose(flat.reshape(n, -1)[:, n:], expected, atol=1e-12)
