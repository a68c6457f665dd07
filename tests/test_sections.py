"""Stiffness of sections against closed forms, materials, functions along the rod."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import spence

import darboux as dx
from darboux import section

ONE = np.zeros(1)


def test_the_chi_function_of_a_rectangle_is_half_of_two_dilogarithms() -> None:
    z = np.concatenate([[0.0, 1e-9, 1.0 - 1e-9, 1.0], np.linspace(0.0, 1.0, 101)])
    np.testing.assert_allclose(section._chi2(z), 0.5 * (spence(1.0 - z) - spence(1.0 + z)), rtol=1e-14, atol=2e-15)


def test_ellipse_of_unequal_axes() -> None:
    """J = pi a^3 b^3 / (a^2 + b^2); Cowper (1966), nu = 0: K = (9 n^2 + 3) / (10 n^2 + 4), n along the force over across."""
    g = dx.Ellipse(a=2.0, b=1.0).geometry(ONE, 0.0)
    np.testing.assert_allclose([g.A[0], g.J[0]], [2.0 * np.pi, 8.0 * np.pi / 5.0], rtol=1e-14)
    np.testing.assert_allclose([g.shear1[0], g.shear2[0]], [39.0 / 44.0, 21.0 / 26.0], rtol=1e-14)
    np.testing.assert_allclose(dx.Ellipse(2.0, 1.0).geometry(ONE, 0.3).shear1[0], 811.2 / 893.9, rtol=1e-14)


def test_tube_with_a_hole() -> None:
    """Outer radius 2, inner 1; and Cowper's thin tube, 2 (1 + nu) / (4 + 3 nu)."""
    g = dx.Tube(2.0, 1.0).geometry(ONE, 0.3)
    np.testing.assert_allclose([g.A[0], g.I1[0], g.I2[0], g.J[0]], np.pi * np.array([3.0, 3.75, 3.75, 7.5]), rtol=1e-14)
    thin = dx.Tube(1.0, 1.0 - 1e-7).geometry(ONE, 0.3)
    assert thin.shear1[0] == pytest.approx(2.6 / 4.9, rel=1e-6)
    assert thin.shear2[0] == thin.shear1[0]


def test_rectangle_in_shear() -> None:
    """Cowper (1966): 10 (1 + nu) / (12 + 11 nu); 5/6 for nu = 0."""
    for nu, factor in ((0.0, 5.0 / 6.0), (0.3, 13.0 / 15.3)):
        g = dx.Rectangle(1.0, 2.0).geometry(ONE, nu)
        np.testing.assert_allclose([g.shear1[0], g.shear2[0]], factor, rtol=1e-14)


def test_both_shear_stiffnesses_and_a_material_by_its_shear_modulus() -> None:
    by_nu = dx.Rod(1.0, dx.Ellipse(2.0, 1.0), dx.Material(E=3.0, nu=0.25)).stiffness(ONE)
    np.testing.assert_allclose(
        [by_nu.GA1[0], by_nu.GA2[0]],
        1.2
        * 2.0
        * np.pi
        * np.array([15.0 * 4 * 13 / (49.25 * 16 + 18.5 * 4 + 0.25), 15.0 / 4 * 1.75 / (49.25 / 16 + 18.5 / 4 + 0.25)]),
        rtol=1e-14,
    )
    assert dx.Material(E=3.0, G=1.2).poisson == pytest.approx(0.25)
    by_G = dx.Rod(1.0, dx.Ellipse(2.0, 1.0), dx.Material(E=3.0, G=1.2)).stiffness(ONE)
    for field in ("EI1", "EI2", "GJ", "EA", "GA1", "GA2"):
        np.testing.assert_allclose(getattr(by_G, field), getattr(by_nu, field), rtol=1e-14)


def test_a_function_may_write_into_what_it_is_given() -> None:
    def doubled(s):
        s *= 2.0
        return 1.0 + s

    rod = dx.Rod(1.0, dx.Stiffness(EI1=doubled, GJ=lambda s: 1.0 + s))
    s = np.array([0.0, 0.5, 1.0])
    np.testing.assert_allclose(rod.stiffness(s).GJ, 1.0 + s)
    np.testing.assert_array_equal(s, [0.0, 0.5, 1.0])
