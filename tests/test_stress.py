"""Stress and strain on the outline: torsion of sections, combined stress, its largest value along the rod."""

from __future__ import annotations

import numpy as np
import pytest

import darboux as dx
from darboux import stress
from darboux.paper.cases import figure5

S = np.zeros(1)
ROUND = np.linspace(0.0, 4.0, 4001)[None]
STEEL = dx.Material(E=210e9, nu=0.3, density=7850)
SECTIONS = [dx.Circle(2e-3), dx.Tube(2e-3, 1.5e-3), dx.Ellipse(3e-3, 1e-3), dx.Rectangle(4e-3, 2e-3)]
METHODS = [dx.Collocation(), dx.DiscreteRod(40)]


# Timoshenko and Goodier, 3rd ed., art. 109: their table of b / a and k2.
@pytest.mark.parametrize(
    ("ratio", "k2"),
    [
        (1.0, 0.208),
        (1.2, 0.219),
        (1.5, 0.231),
        (2.0, 0.246),
        (2.5, 0.258),
        (3, 0.267),
        (4, 0.282),
        (5, 0.291),
        (10, 0.312),
    ],
)
def test_torsion_of_rectangles_by_the_classical_table(ratio, k2) -> None:
    """tau_max = T / (k2 a^2 b) in the middle of the long sides, for any orientation of the section."""
    for section, middle in ((dx.Rectangle(ratio, 1.0), 1.5), (dx.Rectangle(1.0, ratio), 0.5)):
        shear = section.torsion_shear(S, ROUND)[0]
        assert 1.0 / (np.max(shear) * ratio) == pytest.approx(k2, abs=5.1e-4)
        assert shear[int(1000 * middle)] == pytest.approx(np.max(shear), rel=1e-12)
        np.testing.assert_allclose(shear[::1000], 0.0, atol=1e-14)  # corners


def test_torsion_of_a_rectangle_is_the_gradient_of_prandtls_function() -> None:
    """The double Fourier series of phi, an independent form: tau = |grad phi| on the outline, T = 2 int phi."""
    b, h = 2.0, 0.7
    m, n = (np.arange(1, 4001, 2.0)[i] for i in ((slice(None), None), (None, slice(None))))
    phi = (
        32.0 / np.pi**4 / (m * n * ((m / b) ** 2 + (n / h) ** 2))
    )  # of sin(m pi x / b) sin(n pi y / h); its Laplacian is -2
    torque = 2.0 * np.sum(phi * 4.0 * b * h / (np.pi**2 * m * n))
    section = dx.Rectangle(b, h)
    p = np.array([[0.2, 0.4, 1.1, 1.45, 2.3, 3.8]])
    for (x1, x2), tau in zip(section.outline(S, p)[0], section.torsion_shear(S, p)[0], strict=True):
        x, y = x1 + b / 2, x2 + h / 2
        if min(abs(x), abs(x - b)) < 1e-12:
            gradient = np.sum(phi * m * np.pi / b * np.cos(m * np.pi * x / b) * np.sin(n * np.pi * y / h))
        else:
            gradient = np.sum(phi * n * np.pi / h * np.sin(m * np.pi * x / b) * np.cos(n * np.pi * y / h))
        assert tau == pytest.approx(abs(gradient) / torque, rel=2e-3)


def test_torsion_of_an_ellipse() -> None:
    """Prandtl: tau_max = 2 T / (pi a b^2) at the ends of the short axis, 2 T / (pi a^2 b) at those of the long one."""
    shear = dx.Ellipse(3.0, 2.0).torsion_shear(S, ROUND)[0]
    np.testing.assert_allclose(shear[[0, 1000, 2000]], 2.0 / np.pi / np.array([18.0, 12.0, 18.0]), rtol=1e-14)
    np.testing.assert_allclose(
        dx.Ellipse(2.0, 2.0).torsion_shear(S, ROUND), 1.0 / (4.0 * np.pi), rtol=1e-14
    )  # a circle's


def test_torsion_of_a_tube_at_its_outer_wall() -> None:
    """T ro / J, J = pi (ro^4 - ri^4) / 2."""
    np.testing.assert_allclose(dx.Tube(2.0, 1.0).torsion_shear(S, ROUND), 4.0 / (15.0 * np.pi), rtol=1e-14)


@pytest.mark.parametrize("section", SECTIONS, ids=lambda s: type(s).__name__)
def test_outlines_enclose_the_area_and_run_from_d1_to_d2(section) -> None:
    x1, x2 = np.moveaxis(section.outline(S, np.linspace(0.0, 4.0, 4097)[None])[0], -1, 0)
    area = 0.5 * np.sum(x1[:-1] * x2[1:] - x1[1:] * x2[:-1])
    assert area == pytest.approx(np.pi * 4e-6 if isinstance(section, dx.Tube) else section.outer_area(S)[0], rel=1e-6)


@pytest.mark.parametrize("method", METHODS, ids=str)
@pytest.mark.parametrize("section", SECTIONS, ids=lambda s: type(s).__name__)
def test_a_rod_that_is_pulled_bent_and_twisted(section, method) -> None:
    """Against a search of the outline, point by point, with the fibre's strain E ((k - k0) x x)_3 for the bending."""
    rod = dx.Rod(0.5, section, STEEL, natural=(0.5, -1.0, 2.0), stretch=True)
    solution = dx.solve(
        dx.Equilibrium(rod, loads=[dx.EndForce((30.0, 20.0, 400.0)), dx.EndMoment((0.5, -1, 1.5))]), method
    )
    for s in (0.0, 0.2):
        found = solution.stress(s)
        x = section.outline(S, np.linspace(0.0, 4.0, 40001)[None])[0]
        k = solution.k(s) - np.array([0.5, -1.0, 2.0])
        bending = STEEL.E * (k[0] * x[:, 1] - k[1] * x[:, 0])
        axial = STEEL.E * (solution.v(s)[2] - 1.0)
        torsion = abs(rod.stiffness(S).GJ[0] * k[2]) * section.torsion_shear(S, np.linspace(0.0, 4.0, 40001)[None])[0]
        von_mises = np.max(np.sqrt((axial + bending) ** 2 + 3.0 * torsion**2))
        assert found.axial == pytest.approx(axial, rel=1e-9)
        assert found.bending == pytest.approx(np.max(np.abs(bending)), rel=1e-6)
        assert found.torsion == pytest.approx(np.max(torsion), rel=1e-6)
        assert found.von_mises == pytest.approx(von_mises, rel=1e-6)
    largest = solution.largest_stress
    (x1, x2), k = largest.point, solution.k(largest.s) - np.array([0.5, -1.0, 2.0])
    assert largest.bending == pytest.approx(STEEL.E * (k[0] * x2 - k[1] * x1), rel=1e-9)
    assert largest.von_mises == pytest.approx(np.max(solution.stress(np.linspace(0.0, 0.5, 1001)).von_mises), rel=1e-5)
    assert largest.von_mises == pytest.approx(
        np.sqrt((largest.axial + largest.bending) ** 2 + 3.0 * largest.torsion**2), rel=1e-12
    )
    many = solution.stress([0.0, 0.2])
    np.testing.assert_allclose(many.von_mises, [solution.stress(0.0).von_mises, solution.stress(0.2).von_mises])


@pytest.mark.parametrize(
    "section", [dx.Rectangle(1e-2, 1e-5), dx.Rectangle(1e-4, 1e-2), dx.Ellipse(1e-2, 1e-4)], ids=str
)
def test_thin_sections_where_the_largest_stress_lies_near_a_corner(section) -> None:
    """The shear of torsion falls to zero within the thickness, where bending is largest; against 100000 places a side."""
    p = np.linspace(0.0, 4.0, 400001)[None]
    rod = dx.Rod(1.0, section, STEEL)
    g, (x1, x2), shear = section.geometry(S, 0.3), section.outline(S, p)[0].T, section.torsion_shear(S, p)[0]
    for share in (0.01, 0.1, 1.0, 10.0):  # of torsion in bending, about d1 and about d2
        for M in ((1.0 / np.max(x2 / g.I1), 0.0), (0.0, 1.0 / np.max(x1 / g.I2))):
            torque = share / np.max(shear)
            found = stress.stress(rod, S, np.zeros(1), np.array([[*M, torque]])).von_mises[0]
            bending = M[0] * x2 / g.I1 - M[1] * x1 / g.I2
            assert found == pytest.approx(np.max(np.sqrt(bending**2 + 3.0 * (torque * shear) ** 2)), rel=1e-6)


def test_a_circle_by_its_closed_form() -> None:
    """|M| r / I, M3 r / J, N / A: the largest von Mises stress is where bending adds to the pull."""
    r = 1.5e-3
    rod = dx.Rod(0.5, dx.Circle(r), STEEL)
    solution = dx.solve(dx.Equilibrium(rod, loads=[dx.EndForce((3.0, -2.0, 100.0)), dx.EndMoment((0.2, 0.4, 0.7))]))
    s = np.linspace(0.0, 0.5, 7)
    R = solution.R(s)
    M, N = np.einsum("nji,nj->ni", R, solution.m(s)), np.einsum("ni,ni->n", R[:, :, 2], solution.n(s))
    bending, torsion = np.hypot(M[:, 0], M[:, 1]) * 4.0 / (np.pi * r**3), np.abs(M[:, 2]) * 2.0 / (np.pi * r**3)
    exact = np.sqrt((np.abs(N) / (np.pi * r**2) + bending) ** 2 + 3.0 * torsion**2)
    np.testing.assert_allclose(solution.stress(s).von_mises, exact, rtol=1e-6)


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_the_largest_stress_between_the_nodes_of_a_cone(method) -> None:
    """P x / I, x = L - s, r = r1 (1 + x / L): the largest is at x = L / 2, 4 P x / (pi r^3), not at the clamp."""
    r1, L, P = 1e-3, 0.2, 1e-3
    rod = dx.Rod(L, dx.Circle(lambda s: r1 * (2.0 - s / L)), STEEL)
    found = dx.solve(dx.Equilibrium(rod, loads=[dx.EndForce((0, P, 0))]), method).largest_stress
    assert found.von_mises == pytest.approx(4.0 * P * 0.5 * L / (np.pi * (1.5 * r1) ** 3), rel=1e-6)
    assert found.s == pytest.approx(0.5 * L, rel=1e-2)
    np.testing.assert_allclose(np.abs(found.point), (0.0, 1.5 * r1), atol=2e-5)
    assert found.bending * found.point[1] < 0.0  # pushed to +y: the fibres at +d2 are shortened
    assert abs(found.bending) == pytest.approx(found.von_mises, rel=1e-3)


def test_the_larger_side_of_a_jump() -> None:
    """A section that steps from 2 mm to 1 mm at 0.3 L: the largest stress is just beyond it; from 1 to 2, at the clamp."""
    for first, second, place, r in ((2e-3, 1e-3, 0.3, 1e-3), (1e-3, 2e-3, 0.0, 1e-3)):
        rod = dx.Rod(1.0, dx.Circle(lambda s, a=first, b=second: np.where(s < 0.3, a, b)), STEEL)
        found = dx.solve(dx.Equilibrium(rod, loads=[dx.EndForce((0, 1e-3, 0))])).largest_stress
        assert found.s == pytest.approx(place, abs=1e-9)
        assert found.von_mises == pytest.approx(4.0 * 1e-3 * (1.0 - place) / (np.pi * r**3), rel=1e-5)
    load = dx.PointMoment((0, 1.0, 0), at=0.4)  # all the moment ends here: the side before it carries it
    found = dx.solve(
        dx.Equilibrium(dx.Rod(1.0, dx.Circle(lambda s: 3e-3 - 1e-3 * s), STEEL), loads=[load])
    ).largest_stress
    assert found.s == pytest.approx(0.4, abs=1e-9)
    assert found.von_mises == pytest.approx(4.0 / (np.pi * 2.6e-3**3), rel=1e-6)


def test_strain_of_a_bent_a_twisted_and_a_stretched_rod() -> None:
    """r kappa; half of r k3, the principal strain of a shear; N / EA."""
    rubber = dx.Material(E=1e6, nu=0.4)
    r, L = 1e-3, 0.1
    rod = dx.Rod(L, dx.Circle(r), rubber, stretch=True)
    EI, GJ, EA = (getattr(rod.stiffness(S), name)[0] for name in ("EI1", "GJ", "EA"))
    for load, strain in (
        (dx.EndMoment((0, 30.0 * EI, 0)), 30.0 * r),
        (dx.EndMoment((0, 0, 80.0 * GJ)), 0.5 * 80.0 * r),
        (dx.EndForce((0, 0, 0.07 * EA)), 0.07),
    ):
        assert dx.solve(dx.Equilibrium(rod, loads=[load])).largest_strain.strain == pytest.approx(strain, rel=1e-6)
    stiff = dx.Equilibrium(rod, loads=[dx.EndForce((0, 0, 0.07 * EA))]).with_rod(stretch=False)
    assert dx.solve(stiff).largest_strain.strain < 1e-12  # an inextensible rod has no axial strain


def test_strain_is_measured_from_the_natural_shape() -> None:
    rod = dx.Rod(0.1, dx.Circle(1e-3), STEEL, natural=(0, 200.0, 0))
    solution = dx.solve(dx.Equilibrium(rod))
    assert solution.largest_strain.strain < 1e-12
    assert solution.warnings == ()


def test_large_strain_is_warned_of_in_words() -> None:
    """Figure 5's rubber: r |m(0)| / EI."""
    solution = dx.solve(figure5())
    strain = 1e-3 * np.linalg.norm(solution.m(0.0)) / (1e6 * np.pi * 1e-12 / 4.0)
    assert solution.largest_strain.strain == pytest.approx(strain, rel=1e-6)
    assert solution.largest_strain.s == 0.0
    (sentence,) = solution.warnings
    assert f"{100.0 * strain:.3g} % at s = 0 m" in sentence
    assert sentence in str(solution)
    assert "von Mises" in str(solution)


def test_a_section_without_a_shape_has_no_stress() -> None:
    solution = dx.solve(dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7)), loads=[dx.EndForce((1, 0, 0))]))
    for ask in (lambda: solution.stress(0.0), lambda: solution.largest_stress, lambda: solution.largest_strain):
        with pytest.raises(dx.InvalidInput, match="has no shape"):
            ask()
    assert solution.warnings == ()
    assert "MPa" not in str(solution)
