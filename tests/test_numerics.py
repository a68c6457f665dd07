"""The parts that methods stand on: rotations, interpolation, piecewise polynomials, the load path, Newton's matrix."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import darboux as dx
from darboux import frames
from darboux.curve import Curve
from darboux.kernels import discrete_rod
from darboux.packing.coefficients import piecewise
from darboux.statics import load_path, shooting
from darboux.statics.load_path import Corrected, follow
from tests import cases

# -- rotations ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-8, 1e-4, 1.0, np.pi - 1e-8, np.pi])
def test_quaternions_and_matrices_at_every_angle(angle: float) -> None:
    """Exact to rounding on both sides of half a turn, where the scalar part vanishes."""
    for axis in np.vstack([np.eye(3), np.array([1.0, 2.0, -2.0]) / 3.0]):
        q = np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * axis])
        R = frames.matrix_of_quaternion(q)
        back = frames.quaternion_of_matrix(R)
        assert min(np.linalg.norm(back - q), np.linalg.norm(back + q)) < 2e-15
        cross = -np.cross(np.eye(3), axis).T
        np.testing.assert_allclose(
            R, np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross, atol=2e-15
        )
        np.testing.assert_allclose(frames.matrix_of_quaternion(3.7 * q), R, atol=1e-15)


def test_the_product_is_that_of_the_matrices() -> None:
    p, q = np.random.default_rng(0).normal(size=(2, 5, 4))
    np.testing.assert_allclose(
        frames.matrix_of_quaternion(frames.product(p, q)),
        frames.matrix_of_quaternion(p) @ frames.matrix_of_quaternion(q),
        atol=1e-14,
    )


@pytest.mark.parametrize("angle", [0.0, 0.9e-8, 1.1e-8, 2.0, 3.1])
def test_between_on_both_sides_of_its_small_angle(angle: float) -> None:
    """A third of the way from no turn to a turn by `angle` about z is a turn by a third of it, for either sign of q."""
    q0 = np.array([1.0, 0.0, 0.0, 0.0])
    q1 = np.array([np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)])
    for sign in (1.0, -1.0):
        third = frames.between(q0, sign * q1, 1.0 / 3.0)
        np.testing.assert_allclose(third, [np.cos(angle / 6), 0.0, 0.0, np.sin(angle / 6)], atol=1e-16, rtol=1e-14)
        np.testing.assert_allclose(frames.between(q0, sign * q1, 1.0), q1, atol=1e-15)


@pytest.mark.parametrize("angle", [0.0, 0.9e-8, 1.1e-8, 0.5])
def test_an_edge_that_turns_keeps_its_length(angle: float) -> None:
    """On both sides of the threshold below which sin(x) / x is 1."""
    x, l = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.0]), np.array([2.0])
    step = np.zeros(7)
    step[4], step[6] = 2.0 * angle, 0.0
    turned = np.empty(7)
    discrete_rod.turning_step(x, l, step, 1.0, False, True, False, 0, turned)
    end = x[3:] + turned[4:]
    np.testing.assert_allclose(end, 2.0 * np.array([np.sin(angle), 0.0, np.cos(angle)]), rtol=1e-15, atol=1e-30)


def test_a_turning_step_agrees_with_the_straight_one_to_first_order() -> None:
    rng = np.random.default_rng(2)
    x, step = rng.normal(size=15), rng.normal(size=19)
    l = np.linalg.norm(np.diff(x.reshape(5, 3), axis=0), axis=1)
    gaps = []
    for scale in (1e-2, 1e-3):
        for held in ((True, False), (False, True), (True, True)):
            turned = np.empty(19)
            discrete_rod.turning_step(x, l, step, scale, False, *held, 0, turned)
            if held[0]:
                np.testing.assert_allclose(turned[:3], scale * step[:3])
            if held[1]:
                np.testing.assert_allclose(turned[-3:], scale * step[-3:], atol=1e-15)
            if held == (True, False):
                gaps.append(np.max(np.abs(turned - scale * step)))
    assert 1.9 < np.log10(gaps[0] / gaps[1]) < 2.1


# -- interpolation ---------------------------------------------------------------------------------------------------


def wave(s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Thirteen smooth functions and their slopes."""
    w = 1.0 + 0.2 * np.arange(13)
    return np.sin(np.outer(s, w)), w * np.cos(np.outer(s, w))


def test_the_curve_between_nodes_is_of_eighth_order() -> None:
    errors = []
    for n in (17, 33):
        nodes = np.linspace(0.0, 3.0, n) ** 1.2
        points = np.linspace(nodes[0], nodes[-1], 500)
        errors.append(np.max(np.abs(Curve(nodes, *wave(nodes))(points) - wave(points)[0])))
    assert 7.4 < np.log2(errors[0] / errors[1]) < 8.6, errors


def test_the_curve_does_not_look_across_a_jump() -> None:
    """A doubled node with two slopes: |s - 1|, exact on both sides."""
    nodes = np.array([0.0, 0.5, 1.0, 1.0, 1.5, 2.0])
    y = np.repeat(np.abs(nodes - 1.0)[:, None], 13, axis=1)
    dy = np.repeat(np.array([-1.0, -1.0, -1.0, 1.0, 1.0, 1.0])[:, None], 13, axis=1)
    points = np.linspace(0.0, 2.0, 101)
    np.testing.assert_allclose(Curve(nodes, y, dy)(points)[:, 0], np.abs(points - 1.0), atol=1e-14)
    shortest = Curve(nodes[2:5], y[2:5], dy[2:5])  # one interval alone: a cubic
    np.testing.assert_allclose(shortest(np.array([1.0, 1.2, 1.5]))[:, 5], [0.0, 0.2, 0.5], atol=1e-15)


# -- piecewise polynomials -----------------------------------------------------------------------------------------------


def evaluated(table, x: np.ndarray) -> np.ndarray:
    piece = np.clip(np.searchsorted(table.breaks, x, side="right") - 1, 0, len(table.coefficients) - 1)
    local = (x - table.breaks[piece])[:, None, None] ** np.arange(table.degree + 1)[:, None]
    return np.sum(table.coefficients[piece] * local, axis=1)


def test_piecewise_polynomials_follow_smooth_functions() -> None:
    def function(x: np.ndarray) -> np.ndarray:
        return np.stack([np.exp(3 * x), np.full_like(x, 1e-9), np.sin(40 * x), 1 / (1.1 - x)], axis=1)

    x = np.linspace(0.0, 1.0, 3001)
    table = piecewise(function, [0.0, 1.0])
    assert len(table.coefficients) <= 128
    scale = np.max(np.abs(function(x)), axis=0)
    assert np.max(np.abs(evaluated(table, x) - function(x)) / scale) < 3e-12


def test_a_jump_is_enclosed() -> None:
    table = piecewise(lambda x: (x < 0.3)[:, None] * 1.0, [0.0, 1.0])
    x = np.array([0.0, 0.2999999, 0.3000001, 1.0])
    np.testing.assert_allclose(evaluated(table, x)[:, 0], [1.0, 1.0, 0.0, 0.0], atol=1e-15)
    told = piecewise(lambda x: np.where(x < 0.5, x, 2.0 * x)[:, None], [0.0, 0.5, 1.0])
    assert len(told.coefficients) == 2


def test_noise_is_refused_in_a_sentence() -> None:
    rng = np.random.default_rng(0)
    noisy = dx.LineForce(lambda s: rng.normal(size=(len(s), 3)))
    with pytest.raises(dx.InvalidInput, match="varies too roughly"):
        dx.solve(dx.Equilibrium(cases.UNIT, loads=[noisy]))


# -- the load path ---------------------------------------------------------------------------------------------------------


@dataclass
class Toy:
    """One unknown x with residual f(x, load factor) and derivative f_x, as a branch to follow."""

    f: object
    fx: object
    fl: object

    def stability(self, x: float, load: float) -> tuple[float, int | None]:
        return float(np.sign(self.fx(x, load))), None

    def tangent(self, x: float, load: float) -> tuple[np.ndarray, float]:
        slope = -self.fl(x, load) / self.fx(x, load)
        return np.array([slope]), abs(slope)

    def predict(self, x: float, tangent: np.ndarray, step: float) -> float:
        return x + step * float(tangent[0])

    def correct(self, x: float, load: float) -> Corrected[float] | None:
        start, last = x, np.inf
        for iteration in range(1, 9):
            change = -self.f(x, load) / self.fx(x, load)
            if not abs(change) <= 0.5 * last:
                return None
            x += change
            if abs(change) < 1e-12:
                return Corrected(x, abs(x - start), float(np.sign(self.fx(x, load))), iteration)
            last = max(abs(change), 1e-14)
        return None


def test_the_path_reaches_the_end_of_a_smooth_branch() -> None:
    """X = 50 load / (1 + load^2 ...) would be too kind: x^3 + x = 40 load, steep at first, then flat."""
    path = follow(Toy(lambda x, t: x**3 + x - 40 * t, lambda x, t: 3 * x**2 + 1, lambda x, t: -40.0), 0.0)
    assert path.load_factor == 1.0
    assert path.state**3 + path.state == pytest.approx(40.0)
    assert path.crossings == []


def test_the_path_stops_at_a_fold_and_says_where() -> None:
    """X - x^3 = load folds at 2 / (3 sqrt 3) = 0.3849."""
    path = follow(Toy(lambda x, t: x - x**3 - t, lambda x, t: 1 - 3 * x**2, lambda x, t: -1.0), 0.0)
    assert path.load_factor == pytest.approx(2.0 / (3.0 * np.sqrt(3.0)), abs=1e-3)
    assert path.load_factor <= 2.0 / (3.0 * np.sqrt(3.0))
    code, sentence = load_path.ending(path, "Toy")
    assert code == "folded"
    assert "38.4" in sentence


def test_the_path_notices_a_branch_that_crosses() -> None:
    """X (x^2 - (load - 0.6)) = 0: the trivial branch loses its stability at 0.6."""
    toy = Toy(lambda x, t: x * (x**2 - (t - 0.6)), lambda x, t: 3 * x**2 - (t - 0.6), lambda x, t: -x)
    path = follow(toy, 0.0)
    ((low, high),) = path.crossings
    assert low < 0.6 < high
    assert path.state == 0.0


# -- Newton's matrix of shooting -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "problem", [cases.anisotropic((1.5, -1, -0.8), (0.4, 0.6, 0.9)), cases.posed()], ids=["tip", "both ends"]
)
def test_newtons_matrix_is_the_derivative_of_the_residual(problem: dx.Equilibrium) -> None:
    """A Taylor test: the remainder after the linear part falls with the square of the step."""
    pieces = shooting._Pieces(problem, 4)
    start = pieces.unloaded()
    rng = np.random.default_rng(3)
    y = start.y + 0.1 * rng.normal(size=start.y.shape)
    direction = rng.normal(size=y.shape)
    nodes = shooting._Nodes(start.x, y)
    shot = pieces.shoot(nodes, 0.7, 1e-12)
    gaps = []
    for h in (1e-2, 1e-3):
        moved = pieces.shoot(shooting._Nodes(start.x, y + h * direction), 0.7, 1e-12)
        # J^-1 (F(y + h d) - F(y)) - h d is of second order exactly where J is the derivative.
        gaps.append(np.max(np.abs(shot.solve(moved.residual - shot.residual) - h * direction.ravel())))
    assert 1.8 < np.log10(gaps[0] / gaps[1]) < 2.2, gaps
