"""The planar elastica against closed forms, reference digits, others' integrators, and itself by its second solver."""

import pickle

import numpy as np
import pytest
from scipy import sparse
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation as SpaceRotation

from darboux.errors import InvalidInput
from darboux.loads import (
    ElectricField,
    EndForce,
    EndMoment,
    Gravity,
    LineCouple,
    LineForce,
    Rotation,
)
from darboux.material import Material
from darboux.problem import Equilibrium
from darboux.profile import Table
from darboux.rod import Rod
from darboux.section import Circle, Rectangle, Stiffness
from darboux.statics import elastica_closed_form, heavy_elastica
from darboux.statics.elastica import Elastica
from darboux.statics.elastica_branch import Follower
from darboux.statics.elastica_closed_form import Pieces, carried
from darboux.statics.elastica_plane import plane_of
from darboux.supports import Clamped, Free, Support

ROD = Rod(length=1.0, section=Stiffness(EI1=1.0, GJ=0.7))
ALONG_X = Clamped(tangent=(1, 0, 0), d1=(0, 1, 0))  # d2 = e3: the plane is x y, and k2 is its curvature


def cantilever(*loads, rod=ROD, start=ALONG_X):
    return Equilibrium(rod, start=start, loads=loads)


def arc(curvature):
    return Rod(length=1.0, section=Stiffness(EI1=1.0, GJ=0.7), natural=(0, curvature, 0))


def in_direction(size, degrees):
    angle = np.deg2rad(degrees)
    return (size * np.cos(angle), size * np.sin(angle), 0.0)


def solved(problem):
    return Elastica().solve(problem).check()


def angle_at(solution, s):
    x, y, _ = solution.R(s)[:, 2]
    return np.arctan2(y, x)


def marched(solution, start=0.0, stop=None, places=()):
    """March the 13 states from the solution's own state at ``start`` by DOP853: (13,) at ``stop``.

    r' = d3,  q' = q (0, k)/2,  n' = -f,  m' = -d3 x n - l,  k = k0 + B^-1 R^T m: the theory in space, not the plane's.
    ``places`` are jumps of the data, at which the march starts anew.
    """
    problem = solution.problem
    stop = problem.rod.length if stop is None else stop

    def slope(s, y):
        place = np.array([min(max(s, 0.0), problem.rod.length)])
        w, v, n, m = y[3], y[4:7], y[7:10], y[10:13]
        R = SpaceRotation.from_quat([*v, w]).as_matrix()
        k = problem.rod.k0(place)[0] + problem.rod.compliance(place)[0, 3:, 3:] @ R.T @ m
        loads = problem.distributed(place)
        dq = 0.5 * np.array([-v @ k, *(w * k + np.cross(v, k))])
        return np.concatenate([R[:, 2], dq, -loads.a[0], -np.cross(R[:, 2], n) - loads.la[0]])

    y = solution.curve(np.array([start]))[0]
    for left, right in zip([start, *places], [*places, stop], strict=True):
        y = solve_ivp(slope, (left, right), y, method="DOP853", rtol=3e-14, atol=1e-15).y[:, -1]
    return y


# -- reference digits ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("turns", [0.25, 0.5, 1.0, 2.0, -0.75])
def test_rolled_up_by_an_end_moment(turns):
    """S01, Euler: kappa = M/EI, x = sin(kappa s)/kappa, y = (1 - cos(kappa s))/kappa; M = 2 pi EI/L is a circle."""
    kappa = 2.0 * np.pi * turns
    solution = solved(cantilever(EndMoment((0, 0, kappa))))
    s = np.linspace(0.0, 1.0, 50)
    exact = np.column_stack([np.sin(kappa * s) / kappa, (1.0 - np.cos(kappa * s)) / kappa, np.zeros(50)])
    np.testing.assert_allclose(solution.r(s), exact, atol=1e-12)
    np.testing.assert_allclose(solution.k(s), np.broadcast_to([0, kappa, 0], (50, 3)), atol=1e-11)


@pytest.mark.parametrize(
    ("P", "x", "y", "angle", "curvature"),
    [
        (0.1, 0.99933460003695241534, 0.033295319268174331159, 0.049954255754753137699, 0.099933460003695241534),
        (1, 0.94356676371662311691, 0.30172077379981352954, 0.46135194971187896071, 0.94356676371662311691),
        (2, 0.83935827917483276379, 0.49345748039671182041, 0.78174983155654304442, 1.6787165583496655276),
        (5, 0.61237163927557012814, 0.71379152361191272809, 1.2153681176116810959, 3.0618581963778506407),
        (15, 0.36471421963791471887, 0.84771567433229714449, 1.5018401541771560702, 5.4707132945687207831),
    ],
)
def test_transverse_end_force(P, x, y, angle, curvature):
    """S02, Bisshopp & Drucker 1945: theta'' = -P cos(theta), theta(0) = 0, theta'(1) = 0; 40 digits by mpmath."""
    solution = solved(cantilever(EndForce((0, P, 0))))
    np.testing.assert_allclose(solution.tip, [x, y, 0], atol=2e-15)
    assert angle_at(solution, 1.0) == pytest.approx(angle, abs=2e-15)
    assert solution.k(0.0)[1] == pytest.approx(curvature, abs=2e-14)
    assert solution.error.tip < 1e-14


@pytest.mark.parametrize(
    ("F", "degrees", "x", "y", "angle", "curvature"),
    [
        (2, 135, 0.75949723687580599864, 0.58307843162656504060, 0.98078694300891600070, 1.8986887189081776874),
        (5, 135, 0.28446320163660573562, 0.82492699314349371532, 1.7668882754375044112, 3.9222866485543656002),
        (5, 45, 0.89116875531347255295, 0.41898646063877016622, 0.61668660554321595383, 1.6694165126035334247),
    ],
)
def test_inclined_end_force(F, degrees, x, y, angle, curvature):
    """S02b, Frisch-Fay 1962: as S02 with the force at an angle from the clamped tangent; 40 digits by mpmath."""
    solution = solved(cantilever(EndForce(in_direction(F, degrees))))
    np.testing.assert_allclose(solution.tip, [x, y, 0], atol=2e-15)
    assert angle_at(solution, 1.0) == pytest.approx(angle, abs=2e-15)
    assert solution.k(0.0)[1] == pytest.approx(curvature, abs=2e-14)


def test_tapered_cone():
    """S02c: EI(s) = EI0 (1 - s/2L)^4, P L^2/EI0 = 1; Chebyshev BVP and shooting, 1e-12."""
    rod = Rod(length=1.0, section=Stiffness(EI1=lambda s: (1.0 - 0.5 * s) ** 4, GJ=0.7))
    solution = solved(cantilever(EndForce((0, 1, 0)), rod=rod))
    np.testing.assert_allclose(solution.tip, [0.838760929192, 0.4586311875418, 0], atol=1e-12)
    assert angle_at(solution, 1.0) == pytest.approx(0.9479663864154, abs=1e-12)
    assert solution.m(0.0)[2] == pytest.approx(0.838760929192, abs=1e-12)


BUCKLED = [  # S04: P/Pcr = (2 K/pi)^2, end distance = 2 E/K - 1, deflection of the cantilever = 2 k/K, k = sin(alpha/2)
    (40, 1.0636632663994142290, 0.88120351172601482110, 0.42224034012118811993),
    (100, 1.5183887932923930820, 0.34898930041483408825, 0.79153949653691928367),
    (160, 4.0300859660499365563, -0.34031885569114988090, 0.62460351295334605702),
    (170, 5.9504904781347682913, -0.47143439913676711886, 0.51996961076599846443),
]


@pytest.mark.parametrize(("alpha", "P", "height", "deflection"), BUCKLED)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_buckled_column(alpha, P, height, deflection, side):
    """S04 (c), Timoshenko & Gere: the cantilever under P > Pcr = pi^2 EI/4 L^2, bent to the side of a tiny force.

    The tip is linear in the tiny force: twice the tip at 1e-7 less the tip at 2e-7 leaves its square.
    """
    axial = P * np.pi**2 / 4.0
    small, twice = (solved(cantilever(EndForce((-axial, side * e * axial, 0)))).tip for e in (1e-7, 2e-7))
    np.testing.assert_allclose(2.0 * small - twice, [height, side * deflection, 0], atol=1e-11)


@pytest.mark.parametrize(("alpha", "P", "distance", "deflection"), BUCKLED[:3])
def test_buckled_between_clamps(alpha, P, distance, deflection):
    """S04 (b): the symmetric mode between clamps, Pcr = 4 pi^2 EI/L^2; the deflection at midspan is half of (c)'s."""
    end = Clamped(position=(distance, 0, 0), tangent=(1, 0, 0), d1=(0, 1, 0))
    values = []
    for e in (1e-5, 2e-5):
        solution = solved(Equilibrium(ROD, start=ALONG_X, end=end, loads=[LineForce((0, e, 0))]))
        np.testing.assert_allclose(solution.tip, [distance, 0, 0], atol=1e-14)
        values.append([solution.reactions.start.force[0], solution.r(0.5)[1], solution.n(0.5)[1]])
    found = 2.0 * np.array(values[0]) - values[1]
    np.testing.assert_allclose(found, [4.0 * np.pi**2 * P, deflection / 2.0, 0], rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize(
    ("w", "x", "y", "angle", "curvature"),
    [
        (1, 0.991246395346635179, 0.123471401983351056, 0.165115560502435512, 0.496933399930717187),
        (10, 0.656353761238598705, 0.700199715514312598, 1.05264311719677112, 3.74219111087157760),
        (613.125, 0.0592375526997370739, 0.975788073351613863, 1.57079591051528583, 34.5913301991614150),
        (613.1, 0.0592388097535321971, 0.975787567540423789, 1.57079591037660792, 34.5906160008472189),
    ],
)
def test_heavy_cantilever(w, x, y, angle, curvature):
    """S05: theta'' = -w (1 - s) cos(theta), theta below the horizontal; 17 digits. The hanging branch, of up to 7."""
    solution = solved(cantilever(LineForce((0, -w, 0))))
    np.testing.assert_allclose(solution.tip, [x, -y, 0], atol=2e-15)
    assert angle_at(solution, 1.0) == pytest.approx(-angle, abs=5e-15)
    assert solution.k(0.0)[1] == pytest.approx(-curvature, rel=1e-14)
    assert solution.error.tip < 1e-14


def test_figure_5_in_si_units():
    """S05, the paper's figure 5: L 0.25 m, radius 1 mm, E 1 MPa, rho 1000 kg/m^3, g 9.81 m/s^2."""
    rod = Rod(length=0.25, section=Circle(radius=1e-3), material=Material(E=1e6, nu=0.5, density=1e3))
    solution = solved(cantilever(Gravity(), rod=rod, start=Clamped(tangent=(1, 0, 0))))
    np.testing.assert_allclose(solution.tip, [0.0148093881749342685, 0, -0.243947018337903466], atol=1e-15)
    assert np.linalg.norm(solution.k(0.0)) == pytest.approx(138.365320796645660, rel=1e-13)
    assert np.linalg.norm(solution.reactions.start.moment) == pytest.approx(0.000108671868831584261, rel=1e-13)


def test_very_heavy_cantilever():
    """w L^3/EI = 1e4 and 1e5: the balance of the whole rod, m(0) = w int x ds, needs no digits."""
    for w in (1e4, 1e5):
        solution = solved(cantilever(LineForce((0, -w, 0))))
        x, weights = np.polynomial.legendre.leggauss(400)
        s = (1.0 - np.cos(np.pi * (x + 1.0) / 2.0)) / 2.0  # dense at both ends
        arm = np.sum(weights * np.pi / 4.0 * np.sin(np.pi * (x + 1.0) / 2.0) * solution.r(s)[:, 0])
        assert solution.m(0.0)[2] == pytest.approx(-w * arm, rel=1e-11)
        assert solution.error.tip < 1e-13
        np.testing.assert_allclose(solution.m(1.0), 0.0, atol=1e-10)


@pytest.mark.parametrize("F", [1e5, 1e7])
def test_very_large_end_force(F):
    """F L^2/EI -> infinity: tan(phi/4) = tan(pi/8) exp(-s sqrt(F)) for the angle phi = pi/2 - theta from the force.

    So x_tip = int sin(phi) = sqrt(2/F) and 1 - y_tip = int (1 - cos(phi)) = (2 - sqrt(2))/sqrt(F), to exp(-sqrt(F)).
    """
    solution = solved(cantilever(EndForce((0, F, 0))))
    exact = [np.sqrt(2.0 / F), 1.0 - (2.0 - np.sqrt(2.0)) / np.sqrt(F), 0.0]
    np.testing.assert_allclose(solution.tip, exact, atol=5e-14)
    assert solution.k(0.0)[1] == pytest.approx(np.sqrt(2.0 * F), rel=1e-12)


@pytest.mark.parametrize(
    ("size", "degrees", "x", "y", "angle", "curvature"),
    [
        (10, 120, 0.4732953201669, 0.8037696923257, 1.345651684348, 4.380496118621),
        (5, 60, 0.9200738238972, 0.3670596186129, 0.4968388391765, 1.667092877949),
    ],
)
def test_charged_filament(size, degrees, x, y, angle, curvature):
    """S11d: a uniform charge in a uniform field, q E L^3/EI = size at an angle from the tangent; 1e-12."""
    field = ElectricField(field=in_direction(size / 2.0, degrees), charge_per_length=2.0)
    solution = solved(cantilever(field))
    np.testing.assert_allclose(solution.tip, [x, y, 0], atol=1e-12)
    assert angle_at(solution, 1.0) == pytest.approx(angle, abs=1e-12)
    assert solution.k(0.0)[1] == pytest.approx(curvature, abs=1e-11)


# -- others' integrators -----------------------------------------------------------------------------------------------

VARIED = {
    "varying force": cantilever(LineForce(lambda s: np.column_stack([3 * s, -8 * np.cos(3 * s), 0 * s]))),
    "couple": cantilever(LineCouple((0, 0, 2.0)), LineForce((0, -5, 0))),
    "varying couple": cantilever(
        LineCouple(lambda s: np.column_stack([0 * s, 0 * s, np.sin(9 * s)])), EndForce((2, 2, 0))
    ),
    "table": cantilever(
        ElectricField((0, -4, 0), Table([0, 0.2, 0.7, 1], [1, -1, 3, 0], "linear")), EndMoment((0, 0, 1))
    ),
    "natural curve": cantilever(
        LineForce((1, -6, 0)),
        EndForce((1, 1, 0)),
        rod=Rod(1.0, Stiffness(EI1=1.0, GJ=1.0), natural=lambda s: np.column_stack([0 * s, 4 * s - 1, 0 * s])),
    ),
    "cubic tables": cantilever(
        LineForce((1, -6, 0)),
        rod=Rod(1.0, Stiffness(EI1=Table([0, 0.3, 0.6, 1], [1, 0.8, 1.1, 0.5]), GJ=1.0), natural=(0, -1.5, 0)),
    ),
    "curved and turned": Equilibrium(
        arc(2.0),
        start=ALONG_X,
        end=Clamped(position=(0.3, 0.5, 0), tangent=(0, 1, 0), d1=(-1, 0, 0)),
        loads=[LineForce((5, -20, 0))],
    ),
    "straight and turned": Equilibrium(
        ROD,
        start=ALONG_X,
        end=Clamped(position=(0.6, -0.2, 0), tangent=(0, -1, 0), d1=(1, 0, 0)),
        loads=[LineForce(lambda s: np.column_stack([0 * s, -20 * s, 0 * s]))],
    ),
}


@pytest.mark.parametrize("name", VARIED)
def test_against_a_march_in_space(name):
    """The theory in space, marched by DOP853 from the found start, arrives at the found end with its support met."""
    problem = VARIED[name]
    solution = solved(problem)
    end = marched(solution, places=problem.breaks)
    np.testing.assert_allclose(end, solution.curve(np.array([1.0]))[0], atol=2e-11)
    if not problem.end.holds:
        tip = problem.end_load("end")
        np.testing.assert_allclose(end[7:13], [*tip.force, *tip.moment], atol=2e-11)
    else:
        np.testing.assert_allclose(end[0:3], problem.end.position, atol=2e-11)
        np.testing.assert_allclose(solution.R(1.0), problem.end.R, atol=1e-12)


def test_a_jump_that_nobody_announced():
    """EI falls from 2 to 1 at s = 1/3 inside a function of s: the elements find the place by halving."""
    rod = Rod(1.0, Stiffness(EI1=lambda s: np.where(s < 1 / 3, 2.0, 1.0), GJ=1.0))
    solution = solved(cantilever(EndForce((-3, 5, 0)), rod=rod))
    end = marched(solution, places=(1 / 3,))
    np.testing.assert_allclose(end[:3], solution.tip, atol=1e-11)
    np.testing.assert_allclose(end[10:], 0.0, atol=1e-11)


@pytest.mark.parametrize("name", VARIED)
def test_curve_interpolates_to_rounding(name):
    """The curve between its nodes against the solver's own series: within 1e-11 of the largest value, all 13 states."""
    problem = VARIED[name]
    plane = plane_of(problem)
    found = elastica_closed_form.solve(plane) if plane.end_loaded_arc else heavy_elastica.solve(plane, 1e-11)
    s = np.random.default_rng(0).uniform(0.0, 1.0, 500)
    exact, _ = plane.in_space(s, found.states(s), found.load)
    scale = np.repeat([1.0, 1.0, np.max(np.abs(exact[:, 7:10])), np.max(np.abs(exact[:, 10:]))], [3, 4, 3, 3])
    np.testing.assert_allclose((plane.curve(found)(s) - exact) / scale, 0.0, atol=1e-11)


# -- the closed form -----------------------------------------------------------------------------------------------


def pendulum(theta, kappa, force, h):
    """theta'' = F_x sin(theta) - F_y cos(theta), marched by DOP853: theta, kappa, x, y at h."""

    def slope(_, y):
        return [y[1], force[0] * np.sin(y[0]) - force[1] * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])]

    return solve_ivp(slope, (0.0, h), [theta, kappa, 0.0, 0.0], method="DOP853", rtol=3e-14, atol=1e-16).y[:, -1]


def closed_form(theta, kappa, force, h):
    return np.array(carried(np.array([theta]), np.array([kappa]), np.array(force), np.array([h])))[:, 0]


@pytest.mark.parametrize("theta", [-2.0, 0.0, 0.3, 1.0, 3.1])
@pytest.mark.parametrize("kappa", [-3.0, -0.5, 0.0, 1e-9, 0.7, 2.5])
@pytest.mark.parametrize("force", [(0.0, 0.0), (1e-12, -1e-12), (1e-3, 0.0), (-0.5, 0.9), (2.0, -3.0)])
def test_a_piece_against_the_pendulum(theta, kappa, force):
    """Equations (1) and (2), swinging and turning over, against an integrator of the pendulum."""
    rate = max(np.sqrt(np.hypot(*force)), abs(kappa) / 2.0, 0.1)
    for h in (1.0 / rate, 0.01 / rate):
        np.testing.assert_allclose(closed_form(theta, kappa, force, h), pendulum(theta, kappa, force, h), atol=1e-12)


@pytest.mark.parametrize("off", [0.0, 1e-16, 1e-13, 1e-10, 1e-7, 1e-4])
def test_both_sides_of_the_separatrix(off):
    """m = 1 divides swinging from turning over; there tan(theta/4) grows as exp(s), for F = (1, 0)."""
    theta, h = 0.4, 1.0
    kappa = 2.0 * np.sin(theta / 2.0)  # the orbit that leaves the unstable rest
    exact = 4.0 * np.arctan(np.tan(theta / 4.0) * np.exp(h))
    for side in (1.0, -1.0):
        found = closed_form(theta, kappa * (1.0 + side * off), (1.0, 0.0), h)
        assert found[0] == pytest.approx(exact, abs=2.0 * off + 1e-15)
        np.testing.assert_allclose(found, pendulum(theta, kappa * (1.0 + side * off), (1.0, 0.0), h), atol=1e-12)


@pytest.mark.parametrize("delta", [1e-3, 1e-8, 1e-16, 1e-40])
def test_relative_accuracy_near_a_rod_pulled_straight(delta):
    """theta = delta cosh(s) + O(delta^3) under a pull F = (1, 0): a modulus and a phase would lose half the digits."""
    theta, kappa, x, y = closed_form(delta, 0.0, (1.0, 0.0), 0.8)
    close = 1e-13 + delta**2
    assert theta == pytest.approx(delta * np.cosh(0.8), rel=close)
    assert kappa == pytest.approx(delta * np.sinh(0.8), rel=close)
    assert y == pytest.approx(delta * np.sinh(0.8), rel=close)
    assert x == pytest.approx(0.8, abs=1e-15 + delta**2)


@pytest.mark.parametrize("f", [0.0, 1e-300, 1e-30, 1e-17, 1e-16, 1e-15, 1e-12, 1e-8])
@pytest.mark.parametrize("kappa", [0.0, 1e-12, 1.0])
def test_small_forces_tend_to_the_circle(f, kappa):
    """F -> 0 leaves the arc theta = theta_0 + kappa s, corrected by at most f h^2/2 in the angle, however small f."""
    theta, h = 0.5, 0.9
    found = closed_form(theta, kappa, (0.6 * f, 0.8 * f), h)
    middle, chord = theta + kappa * h / 2.0, h * np.sinc(kappa * h / 2.0 / np.pi)
    circle = [theta + kappa * h, kappa, chord * np.cos(middle), chord * np.sin(middle)]
    np.testing.assert_allclose(found, circle, atol=1e-15 + f)


def test_small_end_force_against_the_linear_beam():
    """S00: F -> 0 gives the deflection F L^3/3 EI and the rotation F L^2/2 EI, relative error O(F^2)."""
    for F in (1e-4, 1e-7, 1e-10):
        solution = solved(cantilever(EndForce((0, F, 0))))
        assert solution.tip[1] == pytest.approx(F / 3.0, rel=F**2 + 1e-15 / F)
        assert solution.m(0.0)[2] == pytest.approx(F, rel=F**2 + 1e-15 / F)


def random_end_loads(seed):
    rng = np.random.default_rng(seed)
    force = rng.normal(size=2) * rng.choice([0.0, 0.3, 3.0, 30.0, 1000.0])
    moment, curvature = rng.normal(size=2) * rng.choice([0.0, 4.0], size=2)
    return cantilever(EndForce((*force, 0)), EndMoment((0, 0, moment)), rod=arc(curvature))


@pytest.mark.parametrize("seed", range(20))
def test_closed_form_against_collocation(seed):
    """Two planar solvers that share nothing but the walk along the branch, on the same random end loads and arcs."""
    plane = plane_of(random_end_loads(seed))
    one, other = elastica_closed_form.solve(plane), heavy_elastica.solve(plane, 1e-11)
    assert one.code == other.code == "converged"
    s = np.linspace(0.0, 1.0, 40)
    a, b = one.states(s), other.states(s)
    np.testing.assert_allclose(a.r, b.r, atol=1e-13)
    np.testing.assert_allclose(a.theta, b.theta, atol=1e-12)
    np.testing.assert_allclose(a.moment, b.moment, atol=1e-12 * max(1.0, np.max(np.abs(b.moment))))


@pytest.mark.parametrize("seed", range(20))
def test_invariants_of_unloaded_pieces(seed):
    """Without loads along the rod n, m + r x n and (kappa^2 - k0^2)/2 + n . d3 are constant."""
    solution = solved(random_end_loads(seed))
    s = np.linspace(0.0, 1.0, 60)
    r, n, m = solution.r(s), solution.n(s), solution.m(s)
    kappa, k0 = solution.k(s)[:, 1], solution.problem.rod.k0(s)[:, 1]
    hamiltonian = kappa**2 / 2.0 - k0**2 / 2.0 + np.einsum("ni,ni->n", n, solution.R(s)[:, :, 2])
    for values in (n, m + np.cross(r, n), hamiltonian):
        size = 1.0 + np.max(np.abs(values)) + np.max(kappa**2)
        np.testing.assert_allclose(values, np.broadcast_to(values[0], values.shape), atol=1e-11 * size)


# -- natural arcs --------------------------------------------------------------------------------------------------


def test_natural_arc_unloaded_and_straightened():
    """A natural arc keeps its shape without loads, and the moment -EI k0 opens it to a straight line."""
    free = solved(cantilever(rod=arc(2.0)))
    np.testing.assert_allclose(free.tip, [np.sin(2.0) / 2.0, (1.0 - np.cos(2.0)) / 2.0, 0], atol=1e-15)
    np.testing.assert_allclose(free.m(np.linspace(0, 1, 9)), 0.0, atol=1e-14)
    opened = solved(cantilever(EndMoment((0, 0, -2.0)), rod=arc(2.0)))
    np.testing.assert_allclose(opened.tip, [1, 0, 0], atol=1e-14)
    np.testing.assert_allclose(opened.k(0.5), 0.0, atol=1e-13)


@pytest.mark.parametrize("curvature", [1.5, -1.5])
def test_natural_arc_deflects_linearly(curvature):
    """Castigliano: a small end force across an arc moves its tip by int z(s) z(s)^T ds F/EI, z = e x (r(1) - r(s))."""
    F = np.array([2e-6, -3e-6, 0.0])
    rod = arc(curvature)
    moved = solved(cantilever(EndForce(F), rod=rod)).tip - solved(cantilever(rod=rod)).tip
    x, weights = np.polynomial.legendre.leggauss(30)
    s = (x + 1.0) / 2.0
    place = np.column_stack([np.sin(curvature * s), 1.0 - np.cos(curvature * s)]) / curvature
    tip = np.array([np.sin(curvature), 1.0 - np.cos(curvature)]) / curvature
    lever = np.column_stack([-(tip - place)[:, 1], (tip - place)[:, 0]])
    expected = np.einsum("n,ni,nj,j->i", weights / 2.0, lever, lever, F[:2])
    np.testing.assert_allclose(moved[:2], expected, rtol=1e-4, atol=1e-15)


# -- symmetries ------------------------------------------------------------------------------------------------------


def moved(problem, R, shift):
    """The whole problem turned by R and shifted."""

    def turned(load):
        name = {EndForce: "force", EndMoment: "moment", LineForce: "force", LineCouple: "couple", Gravity: "g"}[
            type(load)
        ]
        value = getattr(load, name)
        new = (lambda s: value(s) @ R.T) if callable(value) else R @ np.array(value)
        rest = {"at": load.at} if hasattr(load, "at") else {}
        rest |= {"offset": load.offset} if isinstance(load, EndForce) else {}  # in the section's frame
        return type(load)(**{name: new}, **rest)

    def carried_along(support):
        if not support.holds:
            return support
        return Clamped(position=R @ np.array(support.position) + shift, frame=R @ support.R)

    ends = carried_along(problem.start), carried_along(problem.end)
    return Equilibrium(problem.rod, *ends, loads=[turned(load) for load in problem.loads])


FLAT = Rod(1.0, Stiffness(EI1=3.0, EI2=1.0, GJ=0.7), natural=(0, 0.8, 0))
SYMMETRIC = {
    "closed form": cantilever(EndForce((-3, 5, 0)), EndMoment((0, 0, 1)), rod=FLAT),
    "heavy": cantilever(LineForce((3, -20, 0)), LineCouple((0, 0, 1)), rod=FLAT),
    "off the centre": cantilever(EndForce((-3, 5, 0), offset=(0.2, 0, 0.1)), rod=FLAT),
    "off the centre, heavy": cantilever(LineForce((3, -20, 0)), EndForce((2, 4, 0), offset=(-0.3, 0, 0.1)), rod=FLAT),
    "about d1": cantilever(
        LineForce((3, 0, -20)), rod=Rod(1.0, Stiffness(EI1=3.0, EI2=1.0, GJ=0.7), natural=(0.8, 0, 0))
    ),
    "held": Equilibrium(
        FLAT, ALONG_X, Clamped(position=(0.7, 0.2, 0), tangent=(1, 0, 0), d1=(0, 1, 0)), loads=[LineForce((0, -30, 0))]
    ),
}


@pytest.mark.parametrize("name", SYMMETRIC)
@pytest.mark.parametrize("seed", range(3))
def test_turning_the_problem_turns_the_solution(name, seed):
    """Any plane of space: r -> R r + shift, frames, forces and moments likewise."""
    R = SpaceRotation.random(rng=np.random.default_rng(seed)).as_matrix()
    shift = np.array([1.0, -2.0, 0.5])
    before, after = solved(SYMMETRIC[name]), solved(moved(SYMMETRIC[name], R, shift))
    s = np.linspace(0.0, 1.0, 21)
    np.testing.assert_allclose(after.r(s), before.r(s) @ R.T + shift, atol=1e-12)
    np.testing.assert_allclose(after.R(s), R @ before.R(s), atol=1e-12)
    np.testing.assert_allclose(after.n(s), before.n(s) @ R.T, atol=1e-10)
    np.testing.assert_allclose(after.m(s), before.m(s) @ R.T, atol=1e-11)
    np.testing.assert_allclose(after.k(s), before.k(s), atol=1e-11)


@pytest.mark.parametrize("name", ["closed form", "heavy", "about d1"])
def test_reading_the_rod_from_its_other_end(name):
    """Clamped at s = L instead: s -> L - s, d3 -> -d3, d1 -> -d1, n -> -n, m -> -m, the same centreline in space."""
    problem = SYMMETRIC[name]
    R = problem.start.R @ np.diag([-1.0, 1.0, -1.0])  # half a turn about d2
    k1, k2, _ = problem.rod.natural
    rod = Rod(1.0, problem.rod.section, natural=(k1, -k2, 0))
    loads = [
        type(load)(load.force if isinstance(load, EndForce) else load.moment, at="start") if load.place else load
        for load in problem.loads
    ]
    before = solved(problem)
    after = solved(Equilibrium(rod, start=Free(), end=Clamped(frame=R), loads=loads))
    s = np.linspace(0.0, 1.0, 21)
    np.testing.assert_allclose(after.r(1.0 - s), before.r(s), atol=1e-12)
    np.testing.assert_allclose(after.R(1.0 - s), before.R(s) @ np.diag([-1.0, 1.0, -1.0]), atol=1e-12)
    np.testing.assert_allclose(after.n(1.0 - s), -before.n(s), atol=1e-11)
    np.testing.assert_allclose(after.m(1.0 - s), -before.m(s), atol=1e-11)
    np.testing.assert_allclose(after.tip, before.tip, atol=1e-12)
    end = marched(after, start=1.0, stop=0.0)
    np.testing.assert_allclose(end, after.curve(np.array([0.0]))[0], atol=2e-11)


def test_tables_read_from_the_other_end():
    """A tapered rod clamped at s = L under a load with a kink: marched in space, and the kink mirrored to 0.7."""
    rod = Rod(1.0, Stiffness(EI1=lambda s: 0.5 + s, GJ=1.0))
    load = LineForce(Table([0, 0.3, 1], [[0, -9, 0], [0, 4, 0], [0, -1, 0]], "linear"))
    problem = Equilibrium(rod, start=Free(), end=ALONG_X, loads=[load, EndForce((1, -2, 0), at="start")])
    assert plane_of(problem).breaks == pytest.approx((0.7,), abs=1e-15)
    solution = solved(problem)
    end = marched(solution, start=1.0, stop=0.0, places=(0.3,))
    np.testing.assert_allclose(end, solution.curve(np.array([0.0]))[0], atol=2e-11)
    np.testing.assert_allclose(end[7:], [-1, 2, 0, 0, 0, 0], atol=2e-11)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
@pytest.mark.parametrize("load", ["weight", "end"])
def test_a_micrometre_filament_and_a_kilometre_cable(scale, load):
    """Lengths by c, E by c with the same weight density: the same numbers without dimensions."""

    def scaled(c):
        material = Material(E=1e6 * c, nu=0.5, density=1e3)
        rod = Rod(length=0.25 * c, section=Circle(radius=1e-3 * c), material=material)
        EI = material.E * np.pi * (1e-3 * c) ** 4 / 4.0
        what = Gravity() if load == "weight" else EndForce((0, 0, -7.0 * EI / (0.25 * c) ** 2))
        return solved(cantilever(what, rod=rod, start=Clamped(tangent=(1, 0, 0))))

    one, other = scaled(1.0), scaled(scale)
    s = np.linspace(0.0, 0.25, 33)
    np.testing.assert_allclose(other.r(s * scale) / scale, one.r(s), atol=1e-14)
    np.testing.assert_allclose(other.k(s * scale) * scale, one.k(s), atol=1e-11)
    assert other.error.tip < 1e-13 * scale


# -- which branch ---------------------------------------------------------------------------------------------------


def test_a_straight_column_says_that_it_passed_its_buckling_load():
    """T13, Euler: P = pi^2 EI/4 L^2; T14, Greenhill: w = 7.8373474389434838852 EI/L^3, at load 10."""
    for load, critical in ((EndForce((-10, 0, 0)), np.pi**2 / 4.0), (LineForce((-10, 0, 0)), 7.8373474389434838852)):
        solution = solved(cantilever(load))
        assert solution.statistics["crossings"] == pytest.approx((critical / 10.0,), abs=2e-4)
        assert solution.statistics["unstable_in_plane"] == 1
        assert "buckling load" in solution.status.message
        below = solved(cantilever(type(load)((-0.999 * critical, 0, 0))))
        assert below.statistics["unstable_in_plane"] == 0
        assert "buckling" not in below.status.message


def test_a_fold_is_reported_with_the_last_equilibrium():
    """A moment and a force that oppose each other: the branch turns back, at the same load by either solver."""
    problem = cantilever(EndForce((4.9759908, -0.61011216, 0)), EndMoment((0, 0, -5.039889994642469)))
    solution = Elastica().solve(problem)
    assert solution.status.code == "folded"
    assert 0.98 < solution.load_factor < 1.0
    assert "98.93 % of the load" in solution.status.message
    plane = plane_of(problem)
    assert heavy_elastica.solve(plane, 1e-11).load == pytest.approx(solution.load_factor, abs=1e-6)
    n, m = solution.n(1.0), solution.m(1.0)
    np.testing.assert_allclose(n, solution.load_factor * np.array([4.9759908, -0.61011216, 0]), rtol=1e-12)
    np.testing.assert_allclose(m, [0, 0, -5.039889994642469 * solution.load_factor], rtol=1e-12, atol=1e-14)
    # A little below the fold there is an equilibrium, a little above it there is none on the branch.
    below, above = (cantilever(EndForce(c * n), EndMoment(c * m)) for c in (0.999, 1.001))
    assert solved(below).statistics["unstable_in_plane"] == 0
    assert Elastica().solve(above).status.code == "folded"


def test_snap_through_of_an_arch():
    """A shallow arch between clamps under weight snaps: a fold, and before it the crossing to the lopsided shape."""
    a = 2.0
    rod = arc(-a)
    lean = np.array([np.cos(a / 2.0), np.sin(a / 2.0), 0.0])
    start = Clamped(tangent=lean, d1=(-lean[1], lean[0], 0))
    end = Clamped(position=(2.0 / a * lean[1], 0, 0), tangent=lean * (1, -1, 1), d1=(lean[1], lean[0], 0))
    solution = Elastica().solve(Equilibrium(rod, start, end, loads=[LineForce((0, -400, 0))]))
    assert solution.status.code == "folded"
    assert solution.load_factor < 1.0
    assert len(solution.statistics["crossings"]) == 1
    np.testing.assert_allclose(solution.reactions.start.force[1], 200.0 * solution.load_factor, rtol=1e-9)


def test_held_ends_that_no_equilibrium_meets():
    """Pushed along its tangent a straight rod may buckle to either side; drawn taut its force has no bound."""
    closer = Clamped(position=(0.7, 0, 0), tangent=(1, 0, 0), d1=(0, 1, 0))
    solution = Elastica().solve(Equilibrium(ROD, ALONG_X, closer))
    assert solution.status.code == "no_convergence"
    assert "either side" in solution.status.message
    taut = Clamped(position=(1, 0, 0), tangent=(1, 0, 0), d1=(0, 1, 0))
    solution = Elastica().solve(Equilibrium(ROD, ALONG_X, taut, loads=[LineForce((0, -1, 0))]))
    assert solution.status.code == "no_convergence"
    assert "Set rod.stretch" in solution.status.message
    straight = solved(Equilibrium(ROD, ALONG_X, taut))
    np.testing.assert_allclose(straight.r(0.5), [0.5, 0, 0], atol=1e-15)


# -- derivatives and the walk ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
def test_derivatives_of_both_systems(seed):
    """Taylor test: G(u + h v) - G(u - h v) = 2 h J v + O(h^3), at random points."""
    rng = np.random.default_rng(seed)
    held = SYMMETRIC["held"]
    off = EndForce((3, -2, 0), offset=(0.4, 0, -0.2))
    plane = plane_of(VARIED["couple"].with_load(off) if seed % 2 else held)
    pose = np.array([0.7, 0.2, 0.1])
    leg = heavy_elastica.Leg(0.25, np.zeros(3), pose, slides=seed == 2)
    elements = heavy_elastica.Elements(plane, np.array([0.0, 0.3, 1.0]), leg)
    pieces = Pieces(plane_of(cantilever(off, EndMoment((0, 0, 1.5)))), 0.5, 3)
    for system, close in ((elements, 1e-8), (pieces, 1e-6)):
        size = len(system.weights)
        u, v = rng.normal(size=size), rng.normal(size=size)
        u[-1] = 0.6
        h = 1e-5
        difference = (system.residual(u + h * v) - system.residual(u - h * v)) / (2.0 * h)
        np.testing.assert_allclose(system.jacobian(u) @ v, difference, atol=close * np.max(np.abs(difference)))


class Circle2D:
    """x^2 + load^2 = 1 from (1, 0): a branch that turns back at load 1, seen from a load scaled to turn at 1/2."""

    weights = np.ones(2)

    def residual(self, u):
        return np.array([u[0] ** 2 + 4.0 * u[1] ** 2 - 1.0])

    def jacobian(self, u):
        return sparse.csc_matrix([[2.0 * u[0], 8.0 * u[1]]])

    def refined(self, u, tolerance):
        return None


def test_the_walk_stops_at_a_fold():
    """The circle x^2 + 4 load^2 = 1 folds at load 1/2, located to 1e-6."""
    branch = Follower(Circle2D()).follow(np.array([1.0]))
    assert branch.code == "folded"
    assert branch.load == pytest.approx(0.5, abs=1e-6)
    assert branch.load < 0.5


# -- refusals --------------------------------------------------------------------------------------------------------


class Pinned(Support):
    held_displacement = (True, True, True)


TWISTED = Clamped(position=(0.5, 0, 0), tangent=(1, 0, 0), d1=(0, 0.6, 0.8))
STRIP = Rod(1.0, Stiffness(EI1=1.0, EI2=2.0, GJ=1.0))
FULL = {"EA": 1e3, "GA1": 1e3, "GA2": 1e3, "mass": 1.0}
REFUSED = {
    "this rod stretches": cantilever(rod=Rod(1.0, Stiffness(EI1=1.0, GJ=1.0, **FULL), stretch=True)),
    "this rod shears": cantilever(rod=Rod(1.0, Stiffness(EI1=1.0, GJ=1.0, **FULL), shear=True)),
    "depends on the position": cantilever(Rotation(omega=(0, 1, 0)), rod=Rod(1.0, Stiffness(EI1=1.0, GJ=1.0, **FULL))),
    "turns with the section": cantilever(LineForce((0, 1, 0), frame="section")),
    "couple turns": cantilever(LineCouple((0, 1, 0), frame="section")),
    "natural twist": cantilever(rod=Rod(1.0, Stiffness(EI1=1.0, GJ=1.0), natural=(0, 1, 1))),
    "rod.natural bends": cantilever(
        rod=Rod(1.0, Stiffness(EI1=1.0, GJ=1.0), natural=lambda s: np.column_stack([s, 1 - s, 0 * s]))
    ),
    "the forces point": cantilever(EndForce((0, 1, 0)), LineForce((0, 0, 0.5))),
    "couples and end moments": cantilever(EndForce((0, 2, 0)), EndMoment((0, 1, 1))),
    "moments along the tangent": cantilever(EndMoment((1, 0, 0))),
    "principal planes": cantilever(EndForce((0, 1, 1)), rod=STRIP),
    "s = length lies": Equilibrium(
        ROD, ALONG_X, Clamped(position=(0.5, 0, 0.3), tangent=(1, 0, 0), d1=(0, 1, 0)), loads=[LineForce((0, 1, 0))]
    ),
    "is twisted against": Equilibrium(ROD, ALONG_X, TWISTED, loads=[LineForce((0, 1, 0))]),
    "holds an end in part": Equilibrium(ROD, start=Pinned(), end=ALONG_X),
}
WORDS = {"couple turns": "turns with the section", "moments along the tangent": "couples and end moments"}


@pytest.mark.parametrize("words", REFUSED)
def test_refusals_are_one_sentence_with_the_way_out(words):
    sentence = Elastica().refuses(REFUSED[words])
    assert sentence is not None
    assert WORDS.get(words, words) in sentence
    assert sentence.startswith("Elastica states ")
    assert "Use Collocation" in sentence
    assert sentence.count(". ") == 1
    with pytest.raises(InvalidInput) as raised:
        Elastica().solve(REFUSED[words])
    assert str(raised.value) == sentence


def test_the_plane_of_an_undetermined_problem():
    """No loads, loads along the tangent, noise across it: some principal plane, the weaker one, and no refusal."""
    for loads in ([], [EndForce((3, 0, 0))], [EndForce((3, 1e-17, 1e-17)), LineForce((1, 0, 2e-17))]):
        problem = cantilever(*loads, rod=STRIP)
        assert Elastica().refuses(problem) is None
        np.testing.assert_allclose(solved(problem).tip, [1, 0, 0], atol=1e-15)
        np.testing.assert_allclose(plane_of(problem).normal, problem.start.R[:, 0], atol=1e-15)


def test_the_section_bends_about_the_axis_of_the_plane():
    """EI1 for a plane normal to d1, EI2 for one normal to d2: a strip 4 x 1 is 16 times stiffer on edge."""
    rod = Rod(1.0, Rectangle(4e-3, 1e-3), Material(E=1e9, nu=0.3))
    EI1, EI2 = 1e9 * 4e-3 * 1e-9 / 12.0, 1e9 * 64e-9 * 1e-3 / 12.0
    start = Clamped(tangent=(1, 0, 0), d1=(0, 1, 0))
    for force, EI in (((0, 0, 1), EI1), ((0, 1, 0), EI2)):
        small = 1e-6 * EI
        tip = solved(cantilever(EndForce(small * np.array(force)), rod=rod, start=start)).tip
        assert tip @ force == pytest.approx(small / (3.0 * EI), rel=1e-9)


def test_description():
    """A frozen value: compared, hashed, pickled, shown in short, and its mistakes said in one sentence."""
    assert Elastica() == Elastica(rtol=1e-11)
    assert hash(Elastica()) == hash(Elastica(rtol=1e-11))
    assert pickle.loads(pickle.dumps(Elastica(rtol=1e-9))) == Elastica(rtol=1e-9)
    assert str(Elastica()) == "Elastica()"
    assert str(Elastica(rtol=1e-9)) == "Elastica(rtol=1e-09)"
    with pytest.raises(InvalidInput, match=r"elastica\.rtol is 0\.1; it must lie between 1e-12 and 1e-3"):
        Elastica(rtol=0.1)
    with pytest.raises(InvalidInput, match="Did you mean rtol"):
        Elastica(rtoll=1e-9)
    with pytest.raises(InvalidInput, match="must be an Equilibrium"):
        Elastica().solve(ROD)


def test_solution_carries_what_it_took():
    solution = solved(cantilever(EndForce((0, 1, 0))))
    assert solution.model == "inextensible"
    assert solution.method == Elastica()
    assert solution.statistics["solver"] == "closed form"
    assert solved(cantilever(LineForce((0, 1, 0)))).statistics["solver"] == "heavy elastica"
    assert solution.energy.bending == pytest.approx(np.sum(solution.energy.elastic), rel=1e-15)
