"""Meshes of collocation against NumPy: polynomials between the nodes, and what they leave out."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from darboux.kernels import mesh as kernel
from darboux.statics.mesh import Mesh, stage_points

X = np.array([0.0, 0.2, 0.3, 0.3, 0.65, 1.0])  # with a station


def meshed(stages: int, function) -> Mesh:
    points = stage_points(X, stages)
    return Mesh(X, function(X), function(points.ravel()).reshape(len(X) - 1, stages, 13))


def powers(x: np.ndarray, degree: int) -> np.ndarray:
    return (x[:, None] - 0.1) ** degree * np.linspace(1.0, 2.0, 13)


@pytest.mark.parametrize("stages", [2, 3, 4, 5])
def test_the_polynomials_are_exact_up_to_their_degree(stages: int) -> None:
    at = np.sort(np.concatenate([X, np.random.default_rng(1).random(40)]))
    mesh = meshed(stages, lambda x: powers(x, stages))
    np.testing.assert_allclose(mesh.at(at), powers(at, stages), atol=1e-13)
    off = meshed(stages, lambda x: powers(x, stages + 1)).at(at) - powers(at, stages + 1)
    assert np.max(np.abs(off)) > 1e-6


@pytest.mark.parametrize("stages", [2, 4])
def test_roughness_is_the_power_of_h_times_the_next_derivative(stages: int) -> None:
    """By the leading coefficients of the polynomials through each element's values, which NumPy fits; alone, by its own one."""
    rng = np.random.default_rng(stages)
    mesh = meshed(stages, lambda x: rng.normal(size=(len(x), 13)))
    largest = [np.linalg.norm(mesh.y[:, a:b], axis=1).max() for a, b in ((7, 10), (10, 13))]
    units = np.repeat([1.0, 1.0 + largest[0], 1.0 + largest[1]], [7, 3, 3])
    starts, h = X[:-1][mesh.wide], np.diff(X)[mesh.wide]
    points = np.column_stack([starts, stage_points(X, stages)[mesh.wide]])
    values = np.concatenate([mesh.y[:-1, None], mesh.Y], axis=1)[mesh.wide] / units
    leading = np.array([np.polyfit(x, v, stages)[0] for x, v in zip(points, values, strict=True)])
    jumps = np.max(np.abs(np.diff(leading, axis=0)), axis=1) / (0.5 * (h[1:] + h[:-1]))
    for breaks in ([], [0.3, 0.65]):
        jumps[np.isin(starts[1:], breaks)] = 0.0
        next_one = np.maximum(np.append(jumps, 0.0), np.append(0.0, jumps))
        next_one = np.where(
            next_one > 0.0, next_one, np.max(np.abs(leading), axis=1) / h
        )  # of an element between two breaks
        expected = h ** (stages + 1) * next_one
        np.testing.assert_allclose(mesh.roughness(np.array(breaks)), expected, rtol=1e-7)


def test_density_never_jumps_by_more_than_a_factor() -> None:
    density = np.array([1.0, 1e-6, 1e-6, 1e-6, 5.0, 1e-3])
    kernel.spread(density, 3.0)
    np.testing.assert_allclose(density, [1.0, 1 / 3, 5 / 9, 5 / 3, 5.0, 5 / 3])


@pytest.mark.parametrize("breaks", [[], [0.25], [0.25, 0.6, 0.6000001]])
def test_elements_are_laid_where_they_are_wanted(breaks: list[float]) -> None:
    """The share that is laid evenly and the rest, in the measure that NumPy sums: the same for all elements of a part."""
    x = np.sort(np.concatenate([[0.0, 1.0], np.random.default_rng(3).random(30)]))
    wanted = np.diff(x) * (1.0 + 2.0 * np.exp(-30.0 * (0.5 * (x[1:] + x[:-1]) - 0.4) ** 2))
    nodes = np.empty(100)
    nodes = nodes[: kernel.lay(x, wanted, 40, np.array(breaks), nodes)]
    assert nodes[0] == 0.0
    assert nodes[-1] == 1.0
    assert set(breaks) <= set(nodes)
    measure = np.concatenate([[0.0], np.cumsum(0.7 * wanted / np.sum(wanted) + 0.3 * np.diff(x))])
    for a, b in itertools.pairwise([0.0, *breaks, 1.0]):
        part = nodes[(nodes >= a) & (nodes <= b)]
        shares = np.diff(np.interp(part, x, measure))
        np.testing.assert_allclose(shares, np.mean(shares), rtol=1e-9)
        assert len(shares) == max(1, round(40 * float(np.sum(shares))))


def test_a_mesh_that_is_laid_anew_keeps_ends_and_stations() -> None:
    rng = np.random.default_rng(5)
    mesh = meshed(2, lambda x: np.column_stack([np.sin(x[:, None] * np.arange(1, 14))]) + 2.0)
    mesh.y[2:4, 7:] += rng.normal(size=(2, 6))  # the states jump at the station
    x = np.sort(np.concatenate([rng.random(9), [0.0, 0.3, 0.3, 1.0]]))
    laid, at = mesh.laid(x, 3), int(np.searchsorted(x, 0.3))
    np.testing.assert_array_equal(laid.y[[0, at, at + 1, -1], 7:], mesh.y[[0, 2, 3, -1], 7:])
    np.testing.assert_allclose(np.linalg.norm(laid.y[1:at, 3:7], axis=1), 1.0)
    assert laid.Y.shape == (len(x) - 1, 3, 13)
    np.testing.assert_allclose(laid.Y.reshape(-1, 13), mesh.at(stage_points(x, 3).ravel()))
