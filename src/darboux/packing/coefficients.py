"""The coefficients c(s) of the rod equations: a problem's stiffness, natural shape and loads, dimensionless.

At any points, and as piecewise polynomials of s, which are affine in the load factor.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.curve import Curve, gauss_points
from darboux.errors import InvalidInput
from darboux.kernels import rod_equations
from darboux.kernels.path import flattest
from darboux.kernels.profile import Profile
from darboux.kernels.rod_equations import (
    BINV,
    COUPLED_WIDTH,
    COUPLING,
    FORCE,
    K0,
    MOMENT,
    ROTATION,
    SINV,
    WIDTH,
)
from darboux.packing.cells import six
from darboux.packing.loads import LOADS, per_length
from darboux.packing.scale import Scale
from darboux.problem import Equilibrium

Array = NDArray[np.float64]

DEGREE = 7
TOLERANCE = 1e-12  # of a polynomial piece, relative to the column's largest value
NARROWEST = 2.0**-44  # a jump is enclosed by pieces down to this width, relative to L
MOST_PIECES = 4000
SAMPLES = 2048  # anything wider than L over this is seen
ROUNDING = 1e-15  # of s over L: a steep ramp's values are known to this much times its slope
AVERAGED = 1e-14  # what averaging over a piece may change, of the positions over L
FEWEST_AVERAGES, MOST_AVERAGES = 16, 1000  # pieces to begin with
SURE = 10.0  # how many times as large what averages leave out is said to be
CHUNK = 4096
CURVED, MOST_QUADRATURE = (
    1e-4,
    1_000_000,
)  # of a column, between Gauss' points, from which on it is sampled twice as closely
CLOSEST = 1e-9  # of L, between a break and a knot of a shape
NO_KNOTS: Array = np.empty(0)
TAUT = 1e-9  # of a part's length, by which the places that hold it are closer
HEAVY = 1e3  # of EI / L^3: weight per length from which on a rod between two supports is a cable


@dataclass(frozen=True)
class Table:
    """Piecewise polynomials on [0, 1]: breaks (p + 1,), coefficients (p, degree + 1, columns), lowest power first."""

    breaks: Array
    coefficients: Array
    error: float = 0.0  # of positions over L at the breaks, by averages over dense rows
    between: float = 0.0  # rad by which the rod turns between the breaks what averages leave out

    @property
    def degree(self) -> int:
        """The degree of the polynomials."""
        return int(self.coefficients.shape[1]) - 1

    def __call__(self, x: Array) -> Array:
        """Return the coefficients at x (n,): (n, columns)."""
        p = np.clip(np.searchsorted(self.breaks, x, side="right") - 1, 0, len(self.breaks) - 2)
        local = (x - self.breaks[p])[:, None]
        result = self.coefficients[p, -1]
        for power in range(self.degree - 1, -1, -1):
            result = result * local + self.coefficients[p, power]
        return np.asarray(result)

    def least_stretch(self, x: Array, y: Array) -> float:
        """Return the least stretch v3 = 1 + (S^-1 R^T n + D^T R^T m)_3 of the states y (n, 13) at x (n,)."""
        profile = Profile(self.breaks, self.coefficients.ravel(), self.degree)
        return flattest(profile, x, np.ascontiguousarray(y).ravel())

    def elastic_energies(self, curve: Curve, scale: Scale) -> tuple[float, float, float]:
        """Return the energies of bending, twist and stretch in J of a curve whose nodes hold the breaks: of averages too."""
        s, weights = gauss_points(np.unique(curve.s))
        x = s / scale.length
        y, c = scale.states(curve, x), self(x)
        R = frames.matrix_of_quaternion(y[:, ROTATION:FORCE])
        N, M = (np.einsum("nji,nj->ni", R, y[:, part : part + 3]) for part in (FORCE, MOMENT))
        index = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])
        k = np.einsum("nij,nj->ni", c[:, BINV + index], M)
        v = np.einsum("nij,nj->ni", c[:, SINV + index], N)
        if c.shape[1] > WIDTH:
            D = c[:, COUPLING : COUPLING + 9].reshape(-1, 3, 3)
            k, v = k + np.einsum("nij,nj->ni", D, N), v + np.einsum("nji,nj->ni", D, M)
        works, unit = M * k, 0.5 * scale.moment / scale.length
        bending, twist = float(weights @ np.sum(works[:, :2], axis=1)), float(weights @ works[:, 2])
        return unit * bending, unit * twist, unit * float(weights @ np.sum(N * v, axis=1))

    def on(self, breaks: Array, degree: int) -> Table:
        """Return the same functions on pieces between more breaks, as polynomials of a degree as high or higher."""
        p = np.clip(np.searchsorted(self.breaks, breaks[:-1], side="right") - 1, 0, len(self.breaks) - 2)
        shift, own = (breaks[:-1] - self.breaks[p])[:, None], self.coefficients[p]
        result = np.zeros((len(p), degree + 1, own.shape[2]))
        for power in range(self.degree + 1):
            for k in range(power + 1):
                result[:, k] += comb(power, k) * shift ** (power - k) * own[:, power]
        return dataclasses.replace(self, breaks=breaks, coefficients=result)

    def plus(self, more: Table, column: int) -> Table:
        """Return the sum with another table, whose columns are added from the given one on."""
        breaks, degree = np.union1d(self.breaks, more.breaks), max(self.degree, more.degree)
        result, added = self.on(breaks, degree), more.on(breaks, degree).coefficients
        result.coefficients[:, :, column : column + added.shape[2]] += added
        return result

    def law(self, slack: float, relaxing: Array | None) -> tuple[Array, Array]:
        """Return c at load factor 0, and c' by the load factor: the loads grow, a compliance of stretch and another shape go.

        ``relaxing`` is k0 less the other shape's curvature and twist, in the same pieces.
        """
        base, rate = self.coefficients.copy(), np.zeros_like(self.coefficients)
        base[:, :, LOADS] = 0.0
        rate[:, :, LOADS] = self.coefficients[:, :, LOADS]
        base[:, 0, SINV + 2] += slack
        rate[:, 0, SINV + 2] -= slack
        if relaxing is not None:
            base[:, :, K0 : K0 + 3] -= relaxing
            rate[:, :, K0 : K0 + 3] += relaxing
        return base, rate

    def lent(self, slack: float, problem: Equilibrium) -> float:
        """Return the compliance of stretch that a rod held at both ends is lent on the way: ``slack``, or none.

        None has a rod that is softer by itself, or that stretches and is not pushed together: a tension that is missing on the way
        would let a twisted wire buckle.
        """
        softest = float(np.max(np.abs(self.coefficients[:, 0, SINV : SINV + 3])))
        return slack if not problem.rod.stretch or (softest < slack and is_pushed(problem)) else 0.0


@dataclass(eq=False)
class Law:
    """The coefficients c + lambda c' of a rod between ``breaks``: ``base`` c and ``rate`` c' (p, degree + 1, columns)."""

    breaks: Array
    base: Array
    rate: Array
    _last: tuple[float, Array] = (np.nan, np.empty(0))

    @property
    def degree(self) -> int:
        """The degree of the polynomials."""
        return int(self.base.shape[1]) - 1

    def table(self, load_factor: float) -> Table:
        """Return the coefficients at a load factor."""
        if self._last[0] != load_factor:
            self._last = load_factor, self.base + load_factor * self.rate
        return Table(self.breaks, self._last[1])

    def at(self, load_factor: float) -> tuple[Profile, Profile]:
        """Return them, and their derivatives by it, as the kernels take them."""
        now = self.table(load_factor).coefficients
        return Profile(self.breaks, now.ravel(), self.degree), Profile(self.breaks, self.rate.ravel(), self.degree)


def _held_parts(problem: Equilibrium) -> list[tuple[float, float]]:
    """Return the length of each part between two supports that hold places, and how far apart these are, in m."""
    held = [(s, np.array(at.position)) for s, at in problem.supports if all(at.held_displacement)]
    held.sort(key=lambda pair: pair[0])
    return [(b - a, float(np.linalg.norm(there - here))) for (a, here), (b, there) in pairwise(held)]


def is_taut(problem: Equilibrium) -> bool:
    """Return whether two supports hold a part of a rod that does not stretch as far apart as it is long."""
    return not problem.rod.stretch and any(apart > length * (1.0 - TAUT) for length, apart in _held_parts(problem))


def is_straight(problem: Equilibrium) -> bool:
    """Return whether both ends are held as far apart as the rod is long, which does not stretch."""
    ends = problem.start, problem.end
    apart = float(np.linalg.norm(np.subtract(*(at.position for at in ends))))
    held = all(all(at.held_displacement) for at in ends) and not problem.closed
    return held and not problem.rod.stretch and apart > problem.rod.length * (1.0 - TAUT)


def is_pushed(problem: Equilibrium) -> bool:
    """Return whether two supports hold parts of the rod closer than they are long, which it buckles by, rather than hangs."""
    closer = any(apart < length for length, apart in _held_parts(problem))
    scale = Scale.of(problem)
    weight = problem.distributed(np.linspace(0.0, scale.length, 129)).a * (scale.length / scale.force)
    return closer and float(np.mean(np.linalg.norm(weight, axis=1))) < HEAVY


def columns(problem: Equilibrium, scale: Scale, x: Array) -> Array:
    """Return the dimensionless coefficients of the rod equations at x = s / L (n,): (n, WIDTH), or (n, COUPLED_WIDTH)."""
    if problem.uniform and len(x) > 1:
        return np.repeat(columns(problem, scale, x[:1]), len(x), axis=0)
    s = x * scale.length
    L, force, moment = scale.length, scale.force, scale.moment
    C = problem.rod.compliance(s)
    result = np.empty((len(x), COUPLED_WIDTH if problem.rod.coupled else WIDTH))
    result[:, BINV : BINV + 6] = six(C[:, 3:, 3:]) * (moment * L)
    result[:, SINV : SINV + 6] = six(C[:, :3, :3]) * force
    result[:, K0 : K0 + 3] = problem.rod.k0(s) * L
    result[:, LOADS] = per_length(problem.distributed(s), scale)
    if problem.rod.coupled:
        result[:, COUPLING : COUPLING + 9] = C[:, 3:, :3].reshape(-1, 9) * moment
    return result


def slopes(c: Array, y: Array) -> Array:
    """Return dy/dx (n, 13) of the states y (n, 13) by the rod equations with the coefficients c (n, columns)."""
    dy = np.empty_like(y)
    rod_equations.derivatives(y.ravel(), c.ravel(), dy.ravel())
    return dy


def table(problem: Equilibrium, scale: Scale) -> Table:
    """Return the coefficients of a problem as piecewise polynomials; one constant piece where nothing varies."""
    if problem.uniform:
        return Table(np.array([0.0, 1.0]), columns(problem, scale, np.array([0.5]))[:, None, :])
    return _followed(problem, scale, lambda x: columns(problem, scale, x))


def table_and_strain(
    problem: Equilibrium, scale: Scale, shape: Callable[[Array], Array], knots: Array
) -> tuple[Table, Array]:
    """Return the coefficients, and k0 less another shape's curvature and twist in the same pieces (p, degree + 1, 3).

    Arguments: ``shape`` a function of x (n,) that returns k L (n, 3); ``knots`` x (m,) between which it is smooth. What varies
    too roughly is then the problem's own, never the shape.
    """

    def both(x: Array) -> Array:
        c, k = columns(problem, scale, x), shape(x)
        return np.concatenate([c, k, c[:, K0 : K0 + 3] - k], axis=1)

    joint = _followed(problem, scale, both, [slice(-6, None)], knots)
    parts = joint.coefficients[:, :, :-6], joint.coefficients[:, :, -3:]
    return dataclasses.replace(joint, coefficients=np.ascontiguousarray(parts[0])), np.ascontiguousarray(parts[1])


def elastic_parts(problem: Equilibrium, table: Table, curve: Curve, scale: Scale) -> tuple[float, float, float] | None:
    """Return the elastic energies where the problem's dense tables are averaged, or None: then a solution has its own sum."""
    return table.elastic_energies(curve, scale) if problem.dense else None


def _followed(
    problem: Equilibrium,
    scale: Scale,
    function: Callable[[Array], Array],
    vectors: Sequence[slice] = (),
    knots: Array = NO_KNOTS,
) -> Table:
    own = np.array([0.0, *(s / scale.length for s in problem.breaks), 1.0])
    above = np.clip(np.searchsorted(own, knots), 1, len(own) - 1)
    apart = np.minimum(np.abs(knots - own[above - 1]), np.abs(own[above] - knots)) > CLOSEST
    breaks = np.sort(np.concatenate([own, knots[apart]])).tolist()
    if not problem.dense:
        return piecewise(function, breaks, vectors)
    turn = _turn(problem, scale)
    averages, rows, *errors = _averages(function, np.array(breaks), turn, [s / scale.length for s in problem.stations])
    single = [piecewise(function, list(ends), vectors) for ends in rows]
    parts = [
        *averages,
        *((start, c) for part in single for start, c in zip(part.breaks[:-1], part.coefficients, strict=True)),
    ]
    parts.sort(key=lambda part: part[0])
    starts, pieces = zip(*parts, strict=True)
    return Table(np.array([*starts, 1.0]), np.array(pieces), *errors)


def _turn(problem: Equilibrium, scale: Scale) -> float:
    """Return about how far (rad) the natural shape or the loads may turn the rod over its length, at least 1."""
    s = np.linspace(0.0, scale.length, 129)
    loads = problem.distributed(s)
    at_points = [problem.end_load("start"), problem.end_load("end"), *problem.points.values()]
    force = sum(float(np.linalg.norm(load.force) + np.linalg.norm(load.section_force)) for load in at_points)
    force += scale.length * float(np.mean(np.linalg.norm(loads.a, axis=1) + np.linalg.norm(loads.b, axis=1)))
    moment = sum(float(np.linalg.norm(load.moment) + np.linalg.norm(load.section_moment)) for load in at_points)
    natural = scale.length * float(np.mean(np.linalg.norm(problem.rod.k0(s), axis=1)))
    return float(max(1.0, np.sqrt(force / scale.force), moment / scale.moment, natural))


def _averages(
    function: Callable[[Array], Array], rows: Array, turn: float, stations: Sequence[float]
) -> tuple[list[tuple[float, Array]], list[tuple[float, float]], float, float]:
    """Return pieces (start, polynomial) that average dense rows, the intervals between rows that stay, and the errors made.

    A piece's polynomial keeps the moments of the columns c up to the seventh power, so that what a smooth state makes of c
    stays. The gap g between both, with the primitive G of G(a) = G(b) = 0, acts in second order, by

        turn^2 int G_i g_j ds   and   turn^2 int G_i G_j ds,

    the area that the turns by G enclose and the length that they take; a piece is halved at a row until both are below
    ``AVERAGED``. Source: the second term of W. Magnus' series, Comm. Pure Appl. Math. 7 (1954) 649.
    """
    once = _in_chunks(function, 0.5 * (rows[1:] + rows[:-1]))
    largest, constant = np.max(np.abs(once), axis=0), once[0]
    varying = np.flatnonzero(np.ptp(once, axis=0) > TOLERANCE * largest)
    x, weights, c = _quadrature(lambda x: _in_chunks(function, x, varying) / largest[varying], rows)
    count = int(np.clip(turn, FEWEST_AVERAGES, MOST_AVERAGES))
    edges = np.searchsorted(rows, np.concatenate([np.linspace(0.0, 1.0, count + 1), stations]))
    first = np.searchsorted(x, rows)
    todo = list(pairwise(np.unique(edges).tolist()))[::-1]
    averages: list[tuple[float, Array]] = []
    single: list[tuple[float, float]] = []
    error = between = 0.0
    while todo:
        i, j = todo.pop()
        a, b = float(rows[i]), float(rows[j])
        if j == i + 1:
            single.append((a, b))
            continue
        here = slice(int(first[i]), int(first[j]))
        local = (x[here] - a) / (b - a)
        P, w = np.polynomial.legendre.legvander(2.0 * local - 1.0, DEGREE), weights[here] / (b - a)
        spectrum = _NORMS[:, None] * ((P * w[:, None]).T @ c[here])
        g = (c[here] - P @ spectrum) * (w * (b - a))[:, None]
        G = np.cumsum(g, axis=0) - 0.5 * g
        left = turn**2 * max(float(np.max(np.abs(G.T @ g))), float((b - a) * np.max((G**2).T @ w)))
        if left <= AVERAGED:
            error, between = error + left, max(between, turn * float(np.max(np.abs(G))))
            polynomial = np.zeros((DEGREE + 1, len(constant)))
            polynomial[0] = constant
            polynomial[:, varying] = (
                (_LEGENDRE @ spectrum) * largest[varying] / (b - a) ** np.arange(DEGREE + 1.0)[:, None]
            )
            averages.append((a, polynomial))
            continue
        middle = int(np.clip(np.searchsorted(rows, 0.5 * (a + b)), i + 1, j - 1))
        todo += [(middle, j), (i, middle)]
    return averages, single, SURE * error, between


def _in_chunks(function: Callable[[Array], Array], x: Array, columns: Any = slice(None)) -> Array:
    """Return some columns of a function at many x (n,): (n, k), without holding all of them at a time."""
    return np.concatenate([function(part)[:, columns] for part in np.split(x, range(CHUNK, len(x), CHUNK))])


def _quadrature(function: Callable[[Array], Array], rows: Array) -> tuple[Array, Array, Array]:
    """Return Gauss' points x (n,) between the rows, weights (n,) and columns (n, k) of size 1: closer where they bend."""
    nodes, weights = np.polynomial.legendre.leggauss(_QUADRATURE)
    highest = np.polynomial.legendre.legvander(nodes, _QUADRATURE - 1)[:, -1] * weights * (_QUADRATURE - 0.5)

    def sampled(a: Array, b: Array) -> tuple[Array, Array, Array]:
        half = 0.5 * (b - a)[:, None]
        x = 0.5 * (a + b)[:, None] + half * nodes
        return x, half * weights, function(x.ravel()).reshape(*x.shape, -1)

    a, b = rows[:-1], rows[1:]
    x, w, values = sampled(a, b)
    parts = [(x, w, values)]
    done: list[tuple[Array, Array, Array]] = []
    total = 0
    while parts:
        x, w, values = parts.pop()
        curved = np.any(np.abs(highest @ values) > CURVED, axis=1)
        curved &= b - a > NARROWEST
        total += x.size
        if total + 2 * _QUADRATURE * int(np.count_nonzero(curved)) > MOST_QUADRATURE:
            curved[:] = False
        done.append((x[~curved], w[~curved], values[~curved]))
        if np.any(curved):
            middle = 0.5 * (a + b)[curved]
            a, b = np.concatenate([a[curved], middle]), np.concatenate([middle, b[curved]])
            parts.append(sampled(a, b))
    x, w, values = (np.concatenate(part) for part in zip(*done, strict=True))
    order = np.argsort(x.ravel(), kind="stable")
    return x.ravel()[order], w.ravel()[order], values.reshape(len(order), -1)[order]


def piecewise(function: Callable[[Array], Array], breaks: list[float], vectors: Sequence[slice] = ()) -> Table:
    """Fit a function of x by polynomials of degree 7 on pieces that are halved until they meet the tolerance.

    Each piece interpolates at Chebyshev's points of the second kind and is tried half-way between them, and at 2048 points
    over the whole, so that a narrow load is not overlooked. A jump is
    enclosed by halving, and bridged by a constant over a width of 2^-44. Each column is measured by its own largest value,
    those of ``vectors`` by the largest among them: what is all but zero beside the others is rounding. Raises
    ``InvalidInput`` where the function is too rough to be followed.
    """
    x = 0.5 - 0.5 * _POINTS
    powers = np.arange(DEGREE + 1)
    probes = 0.5 * (x[:-1] + x[1:])
    to_probes = probes[:, None] ** powers
    everywhere = (np.arange(SAMPLES) + 0.5) / SAMPLES
    samples = function(everywhere)
    inner = np.array(breaks[:-1])[:, None] + np.diff(breaks)[:, None] * probes  # a piece may lie between two samples
    largest = np.maximum(np.max(np.abs(samples), axis=0), np.max(np.abs(function(inner.ravel())), axis=0))
    for vector in vectors:
        largest[vector] = np.max(largest[vector])
    todo = list(pairwise(breaks))[::-1]
    starts: list[float] = []
    pieces: list[Array] = []
    while todo:
        if len(pieces) + len(todo) > MOST_PIECES + len(breaks):
            raise InvalidInput(
                "a quantity of the problem varies too roughly along the rod to be followed: its function is noisy or jumps "
                f"more than about {MOST_PIECES // 80} times. Smooth it, or give it as a Table."
            )
        a, b = todo.pop()
        places = np.clip(a + (b - a) * x, a + 4.0 * ROUNDING * a, b - 4.0 * ROUNDING * b)  # what holds between a and b
        values = function(places)
        slope = np.max(np.abs(np.diff(values, axis=0)) / np.diff(x)[:, None], axis=0) / (b - a)
        rounding = 8.0 * ROUNDING * b * slope  # of values where s itself is rounded
        spectrum = _TO_SPECTRUM @ values
        small = np.abs(spectrum) < np.maximum(4e-16 * np.max(np.abs(values), axis=0), rounding)
        spectrum[small] = 0.0  # rounding, which powers would magnify
        local = _TO_POWERS @ spectrum
        first, last = np.searchsorted(everywhere, [a, b])
        inside = ((everywhere[first:last, None] - a) / (b - a)) ** powers
        gaps = (to_probes @ local - function(a + (b - a) * probes), inside @ local - samples[first:last])
        if all(np.all(np.abs(gap) <= TOLERANCE * largest + 4.0 * rounding) for gap in gaps):
            starts.append(a)
            pieces.append(local / (b - a) ** powers[:, None])
        elif b - a < NARROWEST:
            starts.append(a)
            pieces.append(np.where(powers[:, None] == 0, np.mean(values, axis=0), 0.0))
        else:
            middle = 0.5 * (a + b)
            todo += [(middle, b), (a, middle)]
    return Table(np.array([*starts, 1.0]), np.array(pieces))


def _spectrum_matrix() -> Array:
    """Return the matrix from values at Chebyshev's points of the second kind to coefficients of T_0 ... T_7."""
    k, j = np.indices((DEGREE + 1, DEGREE + 1))
    halved = np.where((k % DEGREE) == 0, 0.5, 1.0) * np.where((j % DEGREE) == 0, 0.5, 1.0)
    return np.asarray(2.0 / DEGREE * halved * np.cos(np.pi * k * j / DEGREE))


def _powers_matrix() -> Array:
    """Return the matrix (of whole numbers) from coefficients of T_k(1 - 2 x) to those of the powers of x."""
    result = np.zeros((DEGREE + 1, DEGREE + 1))
    for k in range(DEGREE + 1):
        shifted = np.polynomial.Chebyshev.basis(k)(np.polynomial.Polynomial([1.0, -2.0]))
        result[: k + 1, k] = np.round(shifted.coef)
    return result


def _legendre_matrix() -> Array:
    """Return the matrix (of whole numbers) from coefficients of P_k(2 x - 1) to those of the powers of x."""
    result = np.zeros((DEGREE + 1, DEGREE + 1))
    for k in range(DEGREE + 1):
        shifted = np.polynomial.Legendre.basis(k)(np.polynomial.Polynomial([-1.0, 2.0]))
        result[: k + 1, k] = np.round(shifted.coef)
    return result


_QUADRATURE = 4  # Gauss' points between two rows
_NORMS = 2.0 * np.arange(DEGREE + 1) + 1.0
_LEGENDRE = _legendre_matrix()
_POINTS = np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)  # on [-1, 1], descending: x = 0 comes first
_TO_SPECTRUM = _spectrum_matrix()
_TO_POWERS = _powers_matrix()
