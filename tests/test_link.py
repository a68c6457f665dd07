"""Twist, writhe and link: closed forms, an independent double integral, and Calugareanu's theorem."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from darboux import link
from tests import cases

TAU = 2.0 * np.pi


def knot(p: int, q: int, small: float = 0.4):
    """The torus knot, p times round the axis and q times through the hole; its parameter t from 0 to 1."""

    def r(t):
        t = TAU * t
        radius = 1.0 + small * np.cos(q * t)
        return np.stack([radius * np.cos(p * t), radius * np.sin(p * t), small * np.sin(q * t)], axis=-1)

    return r


def derivative(x):
    """Of a closed curve by its parameter, from values at equal steps of it."""
    n = len(x)
    return np.fft.ifft(1j * TAU * np.fft.fftfreq(n, 1.0 / n)[:, None] * np.fft.fft(x, axis=0), axis=0).real


def gauss_integral(r, n=200):
    """Gauss' double integral of a closed curve by the trapezoidal rule, with n, 2 n and 4 n points extrapolated.

    The integrand has a kink on the diagonal, where it is 0, so the error falls as 1 / n^2, 1 / n^4, ...
    """

    def rule(n):
        x = r(np.arange(n) / n)
        t = derivative(x)
        d = x[:, None] - x[None]
        distance = np.linalg.norm(d, axis=2) + np.eye(n)
        return np.sum(np.einsum("ijk,ijk->ij", np.cross(t[:, None], t[None]), d) / distance**3) / (4.0 * np.pi * n * n)

    a, b, c = (rule(m * n) for m in (1, 2, 4))
    return (64.0 * c - 20.0 * b + a) / 45.0


def open_gauss_integral(r, dr, panels=6, order=24):
    """The open one over s' < s, where the integrand is smooth, by Gauss' rule: squares, and triangles folded to squares."""
    x, w = np.polynomial.legendre.leggauss(order)
    u, w = 0.5 + 0.5 * x, 0.5 * w
    total = 0.0
    for i in range(panels):
        for j in range(i + 1):
            U, V = np.meshgrid(u, u, indexing="ij")
            weight = np.outer(w, w) / panels**2
            if i == j:
                V, weight = U * V, weight * U
            a, b = (i + U).ravel() / panels, (j + V).ravel() / panels
            d = r(a) - r(b)
            triple = np.einsum("ni,ni->n", np.cross(dr(a), dr(b)), d)
            total += np.sum(weight.ravel() * triple / np.linalg.norm(d, axis=1) ** 3)
    return total / TAU


def frenet(r, n=128):
    """Return the length of a closed curve and its k = (0, kappa, tau) as a function of the arc length."""
    k = 1j * TAU * np.fft.fftfreq(n, 1.0 / n)
    x = np.fft.fft(r(np.arange(n) / n), axis=0) / n
    low = np.abs(k) < 8.5 * TAU  # a torus knot has no higher waves

    def at(t, times):
        return (np.exp(np.outer(t, k[low])) @ (k[low, None] ** times * x[low])).real

    speed = np.fft.fft(np.linalg.norm(at(np.arange(n) / n, 1), axis=1)) / n
    length = speed[0].real
    wave = np.divide(speed, k, out=np.zeros_like(speed), where=k != 0.0)

    def curvature(s):
        t = s / length
        for _ in range(6):  # s = length t + the wave of the speed, by Newton's method
            t = t - (length * t + ((np.exp(np.outer(t, k)) - 1.0) @ wave).real - s) / np.linalg.norm(at(t, 1), axis=1)
        d1, d2, d3 = (at(t, i) for i in (1, 2, 3))
        across = np.cross(d1, d2)
        kappa = np.linalg.norm(across, axis=1) / np.linalg.norm(d1, axis=1) ** 3
        return np.stack([0.0 * s, kappa, np.einsum("ni,ni->n", across, d3) / np.sum(across**2, axis=1)], axis=1)

    return length, curvature


@pytest.mark.parametrize(("p", "q"), [(2, 3), (3, 2), (1, 4), (2, -3)])
def test_writhe_of_closed_curves_against_the_double_integral(p, q) -> None:
    r = knot(p, q)
    found = link.writhe(r, np.linspace(0.0, 1.0, 9), closed=True)
    assert found == pytest.approx(gauss_integral(r), abs=1e-7)


def test_writhe_of_a_figure_of_eight() -> None:
    """Two lobes that pass each other at a small distance: near 1 or -1, by the sign of the crossing."""
    for height in (0.05, -0.05):

        def r(t, height=height):
            t = TAU * t
            return np.stack([np.sin(t), np.sin(t) * np.cos(t), height * np.cos(t)], axis=-1)

        found = link.writhe(r, np.linspace(0.0, 1.0, 9), closed=True)
        assert found == pytest.approx(gauss_integral(r, 400), abs=1e-7)
        assert abs(found) == pytest.approx(1.0, abs=0.1)


def test_writhe_of_a_helix_of_one_and_a_half_turns() -> None:
    """Open, against Gauss' rule; a left-handed helix has the opposite writhe, and writhe has no length."""
    for hand in (1.0, -1.0):

        def r(t, hand=hand):
            return np.stack([np.cos(3 * np.pi * t), hand * np.sin(3 * np.pi * t), 1.2 * t], axis=-1)

        def dr(t, hand=hand):
            c, s = np.cos(3 * np.pi * t), np.sin(3 * np.pi * t)
            return np.stack([-3 * np.pi * s, hand * 3 * np.pi * c, 1.2 + 0 * t], axis=-1)

        exact = open_gauss_integral(r, dr)
        assert hand * exact > 0.4
        assert link.writhe(r, np.linspace(0.0, 1.0, 5), closed=False) == pytest.approx(exact, abs=1e-10)
        assert link.writhe(lambda t: 1e-6 * r(t), np.linspace(0.0, 1.0, 5), False) == pytest.approx(exact, abs=1e-8)


def test_writhe_of_a_long_helix() -> None:
    """Fuller (1971): each turn adds 1 - sin(alpha), alpha the pitch angle; the ends cancel from the difference."""
    c = 0.5

    def helix(turns):
        def r(t):
            t = TAU * turns * t
            return np.stack([np.cos(t), np.sin(t), c * t], axis=-1)

        return link.writhe(r, np.linspace(0.0, 1.0, 2 * turns + 1), closed=False)

    per_turn = (helix(24) - helix(12)) / 12.0
    assert per_turn == pytest.approx(1.0 - c / np.hypot(1.0, c), abs=2e-3)


def test_a_polygon_has_the_writhe_of_its_crossings() -> None:
    """Two edges that cross at right angles at the distance h, far from all else: the signed solid angle 4 arctan(...)."""
    for h in (0.1, 1.0, -0.3):
        x = np.array([[-1.0, 0, h], [1.0, 0, h], [0.0, -1.0, 0], [0.0, 1.0, 0]])
        a, b, c, d = x
        solid = 4.0 * np.arcsin(1.0 / (1.0 + h * h))  # of the square |x|, |y| <= 1 from the height h
        total = link.writhe_of_polygon(x)
        skew = link.writhe_of_polygon(np.array([a, b, c])) + link.writhe_of_polygon(np.array([b, c, d]))
        assert skew == pytest.approx(0.0, abs=1e-15)  # three edges in a row: neighbours only
        assert abs(total) == pytest.approx(solid / TAU, rel=1e-12)


def test_polygons_that_are_summed_in_parts(monkeypatch) -> None:
    x = knot(2, 3)(np.linspace(0.0, 1.0, 101))
    x[-1] = x[0]
    whole = link.writhe_of_polygon(x)
    monkeypatch.setattr(link, "PAIRS", 350)
    assert link.writhe_of_polygon(x) == pytest.approx(whole, abs=1e-13)


def test_a_ring_with_turns_in_it() -> None:
    """A plane circle whose section turns three times on its way: Tw = Lk = 3, Wr = 0."""

    def k0(s):
        return np.stack([TAU * np.sin(3 * TAU * s), TAU * np.cos(3 * TAU * s), 3 * TAU + 0 * s], axis=-1)

    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7), natural=k0)
    ring = dx.integrate(rod, k=k0(0.0), rtol=1e-12)
    np.testing.assert_allclose([ring.twist, ring.writhe, ring.link], [3.0, 0.0, 3.0], atol=1e-9)
    assert dx.solve(dx.Equilibrium(rod), dx.DiscreteRod(100)).twist == pytest.approx(3.0, abs=1e-6)


@pytest.mark.parametrize(("p", "q"), [(2, 3), (3, 2)])
def test_calugareanus_theorem_for_a_knotted_rod(p, q) -> None:
    """A rod that is a torus knot by nature, d1 along its normal: twist and writhe are not whole numbers, their sum is."""
    length, k0 = frenet(knot(p, q))
    rod = dx.Rod(length, dx.Stiffness(EI1=1.0, GJ=1.0), natural=k0)
    solution = dx.integrate(rod, k=k0(np.zeros(1))[0], rtol=1e-12)
    assert abs(solution.writhe - round(solution.writhe)) > 0.01
    assert solution.link == pytest.approx(round(solution.link), abs=1e-6)
    assert abs(solution.link) >= 3.0


def test_a_free_helix() -> None:
    """Tw = tau L / 2 pi, whatever is bent; the writhe is that of the curve."""
    helix = dx.Helix(radius=0.02, pitch=0.03)
    rod = dx.Rod(0.3, dx.Stiffness(EI1=1.0, GJ=1.0), natural=helix)
    for method in (dx.Collocation(), dx.DiscreteRod(100)):
        assert dx.solve(dx.Equilibrium(rod), method).twist == pytest.approx(helix.curvature[2] * 0.3 / TAU, rel=1e-6)
    assert dx.solve(dx.Equilibrium(rod)).writhe > 0.5


def test_nodes_that_enclose_a_jump() -> None:
    """They stand 1e-13 apart, where rounding would turn the edge between them."""
    nodes = np.linspace(0.0, 1.0, 9)
    for s in (0.1234567, 0.3, 0.77):
        enclosed = np.sort(np.append(nodes, [s, s + 1e-13]))
        assert link.writhe(knot(2, 3), enclosed, True) == pytest.approx(link.writhe(knot(2, 3), nodes, True), abs=1e-8)


def test_link_is_refused_for_an_open_and_for_a_sheared_rod() -> None:
    with pytest.raises(dx.InvalidInput, match=r"the ends are 1 m apart and their tangents 0 degrees"):
        _ = dx.solve(dx.Equilibrium(cases.UNIT)).link
    with pytest.raises(dx.InvalidInput, match="shear"):
        _ = dx.solve(cases.anisotropic((1.5, -1, -0.8), (0.4, 0.6, 0.9), **cases.COSSERAT)).link
