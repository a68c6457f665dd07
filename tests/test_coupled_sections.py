"""Sections given by a full stiffness matrix: closed forms, an integrator of its own, limits, symmetry, bad input."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import darboux as dx
from darboux.packing import coefficients

FULL = {"stretch": True, "shear": True}
SHEAR1, SHEAR2, STRETCH, BEND1, BEND2, TWIST = range(6)


def diagonal(GA1=60.0, GA2=50.0, EA=80.0, EI1=1.0, EI2=1.6, GJ=0.7) -> np.ndarray:
    return np.diag([GA1, GA2, EA, EI1, EI2, GJ])


def random_stiffness(seed: int) -> np.ndarray:
    """A full matrix whose couplings reach a third or so of what positive definiteness allows."""
    A = np.eye(6) + 0.2 * np.random.default_rng(seed).normal(size=(6, 6))
    unit = np.sqrt(np.diag(diagonal()))
    return A @ A.T * np.outer(unit, unit)


def turned(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def hat(a: np.ndarray) -> np.ndarray:
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def test_a_wire_rope_under_tension_and_torque() -> None:
    """A straight rod stays straight: (v3 - 1, k3) = [EA g; g GJ]^-1 (F, Q), whatever the load; energy by the same matrix."""
    K = diagonal()
    K[STRETCH, TWIST] = K[TWIST, STRETCH] = 3.0
    F, Q, L = 9.0, 0.4, 2.0
    problem = dx.Equilibrium(
        dx.Rod(L, dx.StiffnessMatrix(K), **FULL), loads=[dx.EndForce((0, 0, F)), dx.EndMoment((0, 0, Q))]
    )
    solution = dx.solve(problem)
    block = np.array([[80.0, 3.0], [3.0, 0.7]])
    e, k3 = np.linalg.solve(block, (F, Q))
    np.testing.assert_allclose(solution.tip, (0, 0, L * (1.0 + e)), atol=1e-12)
    np.testing.assert_allclose(solution.R(L), turned(k3 * L), atol=1e-12)
    np.testing.assert_allclose(solution.k(1.3), (0, 0, k3), atol=1e-12)
    np.testing.assert_allclose(solution.v(1.3), (0, 0, 1.0 + e), atol=1e-12)
    assert solution.energy.stretch == pytest.approx(0.5 * F * e * L, rel=1e-12)
    assert solution.energy.twist == pytest.approx(0.5 * Q * k3 * L, rel=1e-12)
    assert solution.energy.elastic == pytest.approx(0.5 * L * np.array([e, k3]) @ block @ (e, k3), rel=1e-12)


def test_a_rope_held_against_turning_answers_with_a_torque() -> None:
    """A slider that holds the end's turn: F = EA e and Q = g e, with k3 = 0."""
    K = diagonal()
    K[STRETCH, TWIST] = K[TWIST, STRETCH] = 3.0
    end = dx.Slider(along=(0, 0, 1), position=(0, 0, 1))
    solution = dx.solve(
        dx.Equilibrium(dx.Rod(1.0, dx.StiffnessMatrix(K), **FULL), end=end, loads=[dx.EndForce((0, 0, 8.0))])
    )
    np.testing.assert_allclose(solution.tip, (0, 0, 1.1), atol=1e-12)
    np.testing.assert_allclose(solution.m(0.5), (0, 0, 0.3), atol=1e-12)


def test_small_loads_on_a_cantilever_that_bends_and_twists() -> None:
    """Bending moment P (L - s) about d2 alone: k = C (0, P (L - s), 0), so r1 = C22 P L^3 / 3, and it twists by C32 P L^2 / 2."""
    B = np.array([[1.0, 0.2, 0.1], [0.2, 1.6, 0.4], [0.1, 0.4, 0.7]])
    C, errors = np.linalg.inv(B), []
    for P in (2e-3, 1e-3):
        problem = dx.Equilibrium(dx.Rod(1.0, dx.StiffnessMatrix(B)), loads=[dx.EndForce((P, 0, 0))])
        for method in (dx.Collocation(), dx.Shooting()):
            solution = dx.solve(problem, method)
            place, turn = solution.tip / P, solution.R(1.0) / P
            got = [place[0], place[1], turn[1, 0]]  # the last: the angle by which d1 turns about e3
            errors.append(np.max(np.abs(got - np.array([C[1, 1] / 3.0, -C[0, 1] / 3.0, C[2, 1] / 2.0]))))
    orders = np.log2(np.array(errors[:2]) / errors[2:])
    np.testing.assert_allclose(orders, 1.0, atol=0.05)


@pytest.mark.parametrize("model", [FULL, {"stretch": True}, {"shear": True}, {}], ids=str)
def test_large_deflections_against_an_integrator_of_its_own(model: dict[str, bool]) -> None:
    """R' = R [k]x, r' = R v, n' = -f, m' = n x r' with strains that minimise the energy, from the solution's own base values."""
    K = random_stiffness(3)
    force, moment, weight, k0 = np.array([[3.0, -2.0, 1.5], [0.5, 0.3, -0.8], [0, -2.0, 1.0], [0.5, -1.0, 2.0]])
    rod = dx.Rod(1.0, dx.StiffnessMatrix(K), natural=k0, **model)
    solution = dx.solve(dx.Equilibrium(rod, loads=[dx.EndForce(force), dx.EndMoment(moment), dx.LineForce(weight)]))
    held = [i for i, name in enumerate(("shear", "shear", "stretch")) if not model.get(name)]
    constraints = np.eye(6)[held]
    bordered = np.block([[K, constraints.T], [constraints, np.zeros((len(held), len(held)))]])

    def slope(s: float, y: np.ndarray) -> np.ndarray:
        R, n, m = y[3:12].reshape(3, 3), y[12:15], y[15:]
        strains = np.linalg.solve(bordered, [*(R.T @ n), *(R.T @ m), *np.zeros(len(held))])[:6]
        dr = R @ (strains[:3] + np.array([0, 0, 1]))
        return np.concatenate([dr, (R @ hat(k0 + strains[3:])).ravel(), -weight, np.cross(n, dr)])

    y0 = np.concatenate([np.zeros(3), np.eye(3).ravel(), solution.n(0.0), solution.m(0.0)])
    y = solve_ivp(slope, (0, 1), y0, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    np.testing.assert_allclose(solution.tip, y[:3], atol=1e-9)
    np.testing.assert_allclose(solution.R(1.0).ravel(), y[3:12], atol=1e-9)
    np.testing.assert_allclose(y[12:], [*force, *moment], atol=1e-9)


def test_energy_is_the_work_of_the_load() -> None:
    """dW = F dx along a path of loads: the elastic energy at the full load is the integral."""
    K, F = random_stiffness(4), np.array([2.0, 1.0, -1.0])
    x, w = np.polynomial.legendre.leggauss(12)
    rod = dx.Rod(1.0, dx.StiffnessMatrix(K), **FULL)
    reached = [dx.solve(dx.Equilibrium(rod, loads=[dx.EndForce(t * F)])) for t in (*(0.5 + 0.5 * x), 1.0)]
    done = reached[-1].tip @ F - 0.5 * sum(w * [solution.tip @ F for solution in reached[:-1]])
    assert reached[-1].energy.elastic == pytest.approx(done, rel=1e-8)


def test_axes_turned_within_the_section() -> None:
    """A flat section whose matrix is turned by 30 degrees about d3 is the same rod behind a clamp that is turned back."""
    T, loads = turned(np.pi / 6.0), [dx.EndForce((2.0, 1.0, -1.0)), dx.EndMoment((0, 0.4, 0.5))]
    plain = dx.Stiffness(EI1=0.5, EI2=4.0, GJ=0.7, EA=80.0, GA1=60.0, GA2=30.0)
    TT = np.kron(np.eye(2), T)  # both parts of the strain turn
    K = TT @ np.diag([60.0, 30.0, 80.0, 0.5, 4.0, 0.7]) @ TT.T
    expected = dx.solve(dx.Equilibrium(dx.Rod(1.0, plain, natural=(1, 2, 0.5), **FULL), loads=loads))
    rod = dx.Rod(1.0, dx.StiffnessMatrix(K), natural=T @ (1, 2, 0.5), **FULL)
    got = dx.solve(dx.Equilibrium(rod, start=dx.Clamped(frame=T.T), loads=loads))
    s = np.linspace(0.0, 1.0, 5)
    np.testing.assert_allclose(got.r(s), expected.r(s), atol=1e-10)
    np.testing.assert_allclose(got.m(s), expected.m(s), atol=1e-9)
    assert got.energy.elastic == pytest.approx(expected.energy.elastic, rel=1e-10)


def test_stiff_strains_tend_to_strains_that_are_not_there() -> None:
    """With S times t the tip goes to that of the inextensible rod as 1 / t, though X stays: what counts is the block B."""
    K = random_stiffness(5)
    loads, gaps = [dx.EndForce((2.0, 1.0, -1.0))], []
    limit = dx.solve(dx.Equilibrium(dx.Rod(1.0, dx.StiffnessMatrix(K)), loads=loads)).tip
    alone = dx.solve(dx.Equilibrium(dx.Rod(1.0, dx.StiffnessMatrix(K[3:, 3:])), loads=loads)).tip
    for t in (1e3, 1e4):
        stiff = K.copy()
        stiff[:3, :3] *= t
        tip = dx.solve(dx.Equilibrium(dx.Rod(1.0, dx.StiffnessMatrix(stiff), **FULL), loads=loads)).tip
        gaps.append(np.linalg.norm(tip - limit))
    np.testing.assert_array_equal(alone, limit)
    assert np.log10(gaps[0] / gaps[1]) == pytest.approx(1.0, abs=0.02)


def test_reciprocity_of_a_loaded_rod() -> None:
    """Castigliano: under dead forces the tip's response d r_i / d F_j is symmetric, about a large deflection too."""
    rod, F, h = dx.Rod(1.0, dx.StiffnessMatrix(random_stiffness(6)), **FULL), np.array([2.0, 1.0, -1.0]), 1e-3
    tips = [
        [dx.solve(dx.Equilibrium(rod, loads=[dx.EndForce(F + t * h * e)])).tip for t in (-2, -1, 1, 2)]
        for e in np.eye(3)
    ]
    response = np.array([(a - 8.0 * b + 8.0 * c - d) / (12.0 * h) for a, b, c, d in tips])
    assert np.max(np.abs(response - np.diag(np.diag(response)))) > 1e-2
    np.testing.assert_allclose(response, response.T, atol=1e-9)


def test_matrices_that_vary_and_step() -> None:
    """A table, the function that it stands for, and a step; under Q about e3 a straight rod twists by int Q C33(s) ds."""
    first, last = diagonal(), diagonal(GJ=1.4, EA=160.0)
    first[STRETCH, TWIST] = first[TWIST, STRETCH] = 3.0
    last[STRETCH, TWIST] = last[TWIST, STRETCH] = -4.0
    loads = [dx.EndForce((1.0, 0.5, 0.2)), dx.EndMoment((0, 0, 0.6))]
    table = dx.StiffnessMatrix(dx.Table([0.0, 1.0], [first, last], "linear"), mass=1.0)
    function = dx.StiffnessMatrix(lambda s: first + s[:, None, None] * (last - first))
    tips = [dx.solve(dx.Equilibrium(dx.Rod(1.0, section, **FULL), loads=loads)).tip for section in (table, function)]
    np.testing.assert_allclose(tips[0], tips[1], atol=1e-11)

    stepped = dx.StiffnessMatrix(lambda s: np.where(s[:, None, None] < 0.37, first, last))
    solution = dx.solve(dx.Equilibrium(dx.Rod(1.0, stepped, **FULL), loads=loads[1:]))
    rates = [np.linalg.solve([[K[2, 2], K[2, 5]], [K[5, 2], K[5, 5]]], (0, 0.6)) for K in (first, last)]
    stretched, twisted = 0.37 * rates[0] + 0.63 * rates[1]
    np.testing.assert_allclose(solution.tip, (0, 0, 1.0 + stretched), atol=1e-11)
    np.testing.assert_allclose(solution.R(1.0), turned(twisted), atol=1e-11)
    assert solution.k(0.3)[2] == pytest.approx(rates[0][1], rel=1e-10)
    assert solution.k(0.5)[2] == pytest.approx(rates[1][1], rel=1e-10)


def test_no_coupling_is_the_section_without() -> None:
    """A diagonal matrix is what Stiffness says, in every method; a frozen value either way."""
    plain, section = (
        dx.Stiffness(EI1=1.0, EI2=1.6, GJ=0.7, EA=80.0),
        dx.StiffnessMatrix(np.diag([9.0, 9.0, 80.0, 1.0, 1.6, 0.7])),
    )
    for method in (dx.Collocation(), dx.Shooting(), dx.DiscreteRod(segments=20)):
        tips = [
            dx.solve(dx.Equilibrium(dx.Rod(1.0, kind, stretch=True), loads=[dx.EndForce((1.0, 2.0, -1.0))]), method).tip
            for kind in (plain, section)
        ]
        np.testing.assert_array_equal(tips[0], tips[1])
    assert hash(section) == hash(dx.StiffnessMatrix(np.diag([9.0, 9.0, 80.0, 1.0, 1.6, 0.7]).tolist()))
    np.testing.assert_array_equal(
        dx.Rod(1.0, section).compliance(np.zeros(1))[0], np.diag([0, 0, 0, 1.0, 1.0 / 1.6, 1.0 / 0.7])
    )


@pytest.mark.parametrize(("P", "index"), [(2.3, 0), (2.6, 1)])
def test_a_coupled_column_buckles_about_its_weakest_axis(P: float, index: int) -> None:
    """Euler: P = pi^2 / 4 over the largest compliance of bending, here about an axis that B's entries do not show."""
    T = turned(0.4)
    B = T @ np.diag([1.0, 3.0, 0.7]) @ T.T
    problem = dx.Equilibrium(dx.Rod(1.0, dx.StiffnessMatrix(B)), loads=[dx.EndForce((0, 0, -P))])
    solution = dx.solve(problem)
    side = T.T @ solution.tip
    assert solution.stable
    if index == 0:
        np.testing.assert_allclose(solution.tip, (0, 0, 1), atol=1e-10)
    else:
        assert abs(side[1]) > 0.1
        assert abs(side[0]) < 1e-4 * abs(side[1])


COUPLED = dx.StiffnessMatrix(random_stiffness(7))


@pytest.mark.parametrize("method", [dx.Shooting(), dx.DiscreteRod(segments=10), dx.Elastica()], ids=str)
def test_methods_that_can_not_couple_say_so(method: object) -> None:
    flags = {} if isinstance(method, dx.Elastica) else {"stretch": True}
    with pytest.raises(dx.InvalidInput, match=r"couples.*Collocation"):
        dx.solve(dx.Equilibrium(dx.Rod(1.0, COUPLED, **flags), loads=[dx.EndForce((1, 0, 0))]), method)
    with pytest.raises(dx.InvalidInput, match="couples"):
        dx.integrate(dx.Rod(1.0, COUPLED, **FULL), k=(0, 1, 0))


ONE, SIX = np.eye(3), np.eye(6)
MISTAKES = {
    "wrong size": (lambda: dx.StiffnessMatrix(np.eye(4)), ["section.matrix", "(4, 4)", "6 x 6", "3 x 3"]),
    "ragged": (lambda: dx.StiffnessMatrix([[1, 2], [3]]), ["section.matrix", "6 x 6"]),
    "a function of another size elsewhere": (
        lambda: dx.Rod(1.0, dx.StiffnessMatrix(lambda s: np.tile(np.eye(3 if len(s) == 1 else 6), (len(s), 1, 1)))),
        ["section.matrix", "(17, 3, 3)"],
    ),
    "wrong size of a function": (lambda: dx.StiffnessMatrix(lambda s: s), ["section.matrix", "6 x 6"]),
    "text": (lambda: dx.StiffnessMatrix("stiff"), ["section.matrix", "6 x 6"]),
    "nan": (lambda: dx.StiffnessMatrix(np.diag([1, 1, np.nan])), ["section.matrix", "finite"]),
    "negative": (lambda: dx.StiffnessMatrix(np.diag([1.0, -1.0, 1.0])), ["section.matrix", "row 2", "positive"]),
    "not symmetric": (lambda: dx.StiffnessMatrix(ONE + np.eye(3, k=1) / 10), ["not symmetric", "row 1, column 2"]),
    "not definite": (lambda: dx.StiffnessMatrix(ONE + 1.1 * (np.eye(3, k=1) + np.eye(3, k=-1))), ["not positive definite"]),
    "not definite somewhere": (
        lambda: dx.Rod(1.0, dx.StiffnessMatrix(lambda s: ONE + 2.0 * s[:, None, None] * (np.eye(3, k=2) + np.eye(3, k=-2)))),
        ["not positive definite", "at s = 0.5 m"],
    ),
    "a function that fails": (lambda: dx.StiffnessMatrix(lambda s: 1 / 0), ["ZeroDivisionError", "6 x 6"]),
    "stretch of 3 x 3": (lambda: dx.Rod(1.0, dx.StiffnessMatrix(ONE), stretch=True), ["rod.stretch", "6 x 6"]),
    "shear of 3 x 3": (lambda: dx.Rod(1.0, dx.StiffnessMatrix(ONE), shear=True), ["rod.shear", "6 x 6"]),
    "material": (lambda: dx.Rod(1.0, dx.StiffnessMatrix(SIX), dx.Material(E=1.0, nu=0.3)), ["StiffnessMatrix", "leave it out"]),
    "table of another shape": (lambda: dx.Table([0, 1], np.zeros((2, 2, 2))), ["Table.values", "(2, 2, 2)"]),
    "mass": (lambda: dx.StiffnessMatrix(ONE, mass=-1.0), ["section.mass", "negative"]),
}  # fmt: skip


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes(name: str) -> None:
    make, words = MISTAKES[name]
    with pytest.raises(dx.InvalidInput) as caught:
        make()
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_the_least_stretch_is_that_of_the_strains() -> None:
    """By the force and by the moment, in the units of the problem, where L = EI = 1."""
    K = random_stiffness(8)
    K /= np.sqrt(K[BEND1, BEND1] * K[BEND2, BEND2])
    loads = [dx.EndForce((2.0, 1.0, -1.0)), dx.EndMoment((1.0, -1.0, 1.5))]
    problem = dx.Equilibrium(dx.Rod(1.0, dx.StiffnessMatrix(K), **FULL), loads=loads)
    solution = dx.solve(problem)
    table = coefficients.table(problem, coefficients.Scale.of(problem))
    least = table.least_stretch(solution.curve.s, solution.curve.y)
    assert least == pytest.approx(np.min(solution.v(solution.curve.s)[:, 2]), rel=1e-12)


def test_units_may_lie_far_apart() -> None:
    """A filament of a micrometre: EA is 1e13 times EI, and the matrix is none the worse for it."""
    section = dx.Circle(1e-6)
    material = dx.Material(E=1e6, nu=0.5)
    s = np.zeros(1)
    plain = dx.Rod(1e-3, section, material, **FULL)
    got = dx.Rod(1e-3, dx.StiffnessMatrix(plain.stiffness(s).matrix[0]), **FULL)
    np.testing.assert_array_equal(got.compliance(s), plain.compliance(s))
