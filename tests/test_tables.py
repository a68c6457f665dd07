"""Tables of measured values: jumps, steep ramps, many rows, and sharp bends; and what is mostly a slip."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

import darboux as dx
from darboux.interpolation import _of_spline
from darboux.packing import coefficients
from darboux.statics import limits

Array = NDArray[np.float64]

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(12)


def bent_by_a_moment(s: Array, EI: Array, M: float) -> tuple[float, float]:
    """Return (x, z) of the tip of a rod whose EI runs straight from row to row, bent by M at its end.

    theta(s) = theta_i + M ln(EI / EI_i) / EI', in closed form; x and z are the integrals of sin and cos theta.
    """
    wide = np.flatnonzero(np.diff(s) > 0.0)  # the others are jumps
    h, rise, EI = np.diff(s)[wide], np.diff(EI)[wide], EI[wide]
    level = np.abs(rise) < 1e-9 * EI
    slope = np.where(level, 1.0, rise / h)

    def turned(t: Array) -> Array:  # t (n, m): s - s_i
        steep = M * np.log1p(slope[:, None] * t / EI[:, None]) / slope[:, None]
        return np.where(level[:, None], M * t / EI[:, None], steep)

    start = np.concatenate([[0.0], np.cumsum(turned(h[:, None])[:, 0])[:-1]])
    theta = start[:, None] + turned(0.5 * h[:, None] * (1.0 + POINTS))
    weights = 0.5 * h[:, None] * WEIGHTS
    return float(np.sum(weights * np.sin(theta))), float(np.sum(weights * np.cos(theta)))


# -- rows ----------------------------------------------------------------------------------------------------------------


def test_a_jump_is_the_same_s_twice_and_its_value_is_the_one_behind() -> None:
    for interpolation in ("linear", "cubic"):
        table = dx.Table([0.0, 0.25, 0.5, 0.5, 0.75, 1.0], [1.0, 1.0, 1.0, 3.0, 3.0, 3.0], interpolation)
        assert table(np.array([0.0, np.nextafter(0.5, 0.0), 0.5, 1.0])).tolist() == [1.0, 1.0, 3.0, 3.0]
        assert table.jumps == (0.5,)


@pytest.mark.parametrize(
    ("s", "words"),
    [
        ([0.0, 0.5, 0.5, 0.5, 1.0], "more than twice; a jump is the same s twice"),
        ([0.0, 0.0, 1.0], "first place, 0, twice"),
        ([0.0, 1.0, 1.0], "last place, 1, twice"),
        ([0.0, 0.6, 0.5, 1.0], "ascending order"),
    ],
)
def test_a_table_says_which_rows_it_takes(s: list[float], words: str) -> None:
    with pytest.raises(dx.InvalidInput, match=words):
        dx.Table(s, s)


@pytest.mark.parametrize(
    "rows",
    [
        [1.0, 1.0, 1.0, 0.01, 0.01, 0.01],
        [1.0, 0.01, 0.01],
        [0.0, 0.0, 1.0, 1.0, 0.0, 0.0],
        [1.0, 1.0, 1.0, 2.0, 2.1, 2.2, 5.0, 5.0],
        [2.0, 1.0, 1.5, 1.5, 1.0, 2.0],
    ],
)
def test_stepped_rows_do_not_overshoot(rows: list[float]) -> None:
    s = np.linspace(0.0, 1.0, len(rows))
    fine = np.linspace(0.0, 1.0, 4001)
    values = dx.Table(s, rows)(fine)
    between = np.clip(np.searchsorted(s, fine, side="right") - 1, 0, len(s) - 2)
    low, high = (pick(rows[:-1], rows[1:])[between] for pick in (np.minimum, np.maximum))
    assert np.all(values >= low - 1e-12)
    assert np.all(values <= high + 1e-12)


def test_smooth_rows_are_a_cubic_spline_of_order_4_and_a_sign_that_rows_have_is_kept() -> None:
    fine = np.linspace(0.0, 1.0, 2001)
    errors = [
        np.max(np.abs(dx.Table(s, np.cos(9.0 * s))(fine) - np.cos(9.0 * fine)))
        for s in (np.linspace(0.0, 1.0, n) for n in (33, 65))
    ]
    order = np.log2(errors[0] / errors[1])
    assert order > 3.5, f"measured order {order:.2f}, declared 4"
    assert np.min(dx.Table(np.linspace(0.0, 1.0, 4), [1.0, 0.01, 0.01, 1.0])(fine)) > 0.0


@pytest.mark.parametrize("n", [3, 4, 5, 8, 50, 1000])
def test_slopes_are_those_of_a_spline(n: int) -> None:
    random = np.random.default_rng(n)
    s, rows = np.cumsum(10.0 ** random.uniform(0.0, 2.0, n)), random.normal(size=(n, 2))
    h = np.diff(s)[:, None]
    expected = CubicSpline(s, rows)(s, 1)
    assert np.max(np.abs(_of_spline(h, np.diff(rows, axis=0) / h) - expected)) < 1e-13 * np.max(np.abs(expected))


# -- steps and sharp bends -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("half", [0.0, 1e-4, 1e-7, 1e-10])
@pytest.mark.parametrize("unit", [1.0, 1e-3])
def test_a_step_and_a_ramp_however_steep_are_taken_as_they_are(half: float, unit: float) -> None:
    s = unit * np.array([0.0, 0.4 - half, 0.4 + half, 1.0])
    rod = dx.Rod(unit, dx.Stiffness(EI1=dx.Table(s, [1.0, 1.0, 0.25, 0.25], "linear"), GJ=0.75))
    problem = dx.Equilibrium(rod, loads=[dx.EndMoment((0.0, 0.9 / unit, 0.0))])
    x, z = bent_by_a_moment(s, np.array([1.0, 1.0, 0.25, 0.25]), 0.9 / unit)
    for method in (dx.Collocation(), dx.Shooting()):
        tip = dx.solve(problem, method).tip
        assert np.max(np.abs(tip - [x, 0.0, z])) < 1e-9 * unit, method


@pytest.mark.parametrize(("length", "width"), [(1.0, 1e-3), (1.0, 1e-6), (1e-3, 1e-6), (1.0, 1e-9)])
def test_a_quarter_turn_however_sharp_is_no_winding(length: float, width: float) -> None:
    k, a, M = 0.5 * np.pi / width, 0.5 * length, 0.3 / length  # EI 1: the whole rod is bent by M besides
    rows = [[0.0, 0.0, 0.0], [0.0, k, 0.0]]
    s = [0.0, a, a, a + width, a + width, length]
    natural = dx.Table(s, [rows[0], rows[0], rows[1], rows[1], rows[0], rows[0]], "linear")
    rod = dx.Rod(length, dx.Stiffness(EI1=1.0, GJ=0.75), natural=natural)
    problem = dx.Equilibrium(rod, loads=[dx.EndMoment((0.0, M, 0.0))])
    x = z = theta = 0.0
    for span, curvature in ((a, M), ((a + width) - a, k + M), (length - a - width, M)):
        after = theta + curvature * span
        x += (np.cos(theta) - np.cos(after)) / curvature
        z += (np.sin(after) - np.sin(theta)) / curvature
        theta = after
    for method in (dx.Collocation(), *((dx.Shooting(),) if width > 1e-5 * length else ())):
        assert np.max(np.abs(dx.solve(problem, method).tip - [x, 0.0, z])) < 1e-8 * length, method


def test_a_soft_hinge_is_no_rod_that_turns_hundreds_of_times() -> None:
    EI = dx.Table([0.0, 0.5, 0.5, 0.5 + 1e-4, 0.5 + 1e-4, 1.0], [1.0, 1.0, 1e-4, 1e-4, 1.0, 1.0], "linear")
    problem = dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=EI, GJ=1.0)), loads=[dx.EndMoment((0.0, 0.1, 0.0))])
    assert limits.too_many_turns(problem, "Collocation", 500.0) is None
    angle = 0.1 * (1.0 + 1.0)  # M (int ds / EI): 1 for the rod, 1 for its hinge
    tangent = dx.solve(problem).R(1.0)[:, 2]
    assert np.max(np.abs(tangent - [np.sin(angle), 0.0, np.cos(angle)])) < 1e-3


def test_a_load_in_one_spot_is_no_load_all_along() -> None:
    spot = dx.Table(
        [0.0, 0.5, 0.5, 0.5 + 1e-6, 0.5 + 1e-6, 1.0],
        [[0.0] * 3, [0.0] * 3, [1e6, 0, 0], [1e6, 0, 0], [0.0] * 3, [0.0] * 3],
    )
    problem = dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0)), loads=[dx.LineForce(spot)])
    assert limits.too_large(problem, "Shooting", 1e3) is None
    point = dx.Equilibrium(problem.rod, loads=[dx.PointForce((1.0, 0.0, 0.0), at=0.5 + 5e-7)])
    assert np.max(np.abs(dx.solve(problem).tip - dx.solve(point).tip)) < 1e-9


# -- many rows -----------------------------------------------------------------------------------------------------------


def measured(rows: int, noise: float) -> tuple[Array, Array]:
    s = np.linspace(0.0, 1.0, rows)
    return s, 1.0 + 0.3 * np.sin(5.0 * s) + noise * np.random.default_rng(5).uniform(-1.0, 1.0, rows)


@pytest.mark.parametrize(("rows", "noise"), [(100_000, 0.05), (2_000, 0.2)])
def test_dense_rows_are_averaged_to_the_estimated_error(rows: int, noise: float) -> None:
    s, EI = measured(rows, noise)
    problem = dx.Equilibrium(
        dx.Rod(1.0, dx.Stiffness(EI1=dx.Table(s, EI, "linear"), GJ=0.75)), loads=[dx.EndMoment((0.0, 1.5, 0.0))]
    )
    solution = dx.solve(problem)
    x, z = bent_by_a_moment(s, EI, 1.5)
    away = float(np.max(np.abs(solution.tip - [x, 0.0, z])))
    assert away < solution.error.tip + 1e-13, (away, solution.error.tip)
    assert solution.error.tip < 1e-9
    bending = 0.5 * 1.5**2 * float(np.sum(np.diff(s) * np.log1p(np.diff(EI) / EI[:-1]) / np.diff(EI)))
    assert abs(solution.energy.bending - bending) < 1e-9


def test_a_table_of_100_000_rows_becomes_a_few_hundred_pieces() -> None:
    s, EI = measured(100_000, 0.02)
    problem = dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=dx.Table(s, EI, "linear"), GJ=0.75)))
    assert len(coefficients.table(problem, coefficients.Scale.of(problem)).breaks) < 400


def test_a_jump_among_dense_rows_stays_where_it_is() -> None:
    s = np.sort(np.append(np.linspace(0.0, 1.0, 2001), 0.33352))
    s = np.insert(s, np.searchsorted(s, 0.33352), 0.33352)
    EI = np.where(np.arange(len(s)) <= np.searchsorted(s, 0.33352), 1.0, 0.2)
    rod = dx.Rod(1.0, dx.Stiffness(EI1=dx.Table(s, EI, "linear"), GJ=0.75))
    solution = dx.solve(dx.Equilibrium(rod, loads=[dx.EndMoment((0.0, 0.4, 0.0))]))
    x, z = bent_by_a_moment(s, EI, 0.4)
    assert np.max(np.abs(solution.tip - [x, 0.0, z])) < 1e-9


# -- what is mostly a slip -----------------------------------------------------------------------------------------------

STEEL = dx.Rod(1.0, dx.Circle(5e-3), "steel")


@pytest.mark.parametrize(
    ("problem", "words"),
    [
        (dx.Equilibrium(STEEL, end=dx.Clamped()), "both ends at one place, .0, 0, 0. m; a support without a position"),
        (
            dx.Equilibrium(STEEL, end=dx.Clamped((0, 0, 0.9), twist=90)),
            "90 rad, which is 14.3 turns; 90 degrees are 1.5708 rad",
        ),
        (dx.Equilibrium(STEEL, loads=[dx.Gravity((0, 0, -9810))]), "gravity is 9810 m/s.2"),
        (
            dx.Equilibrium(dx.Rod(30e3, dx.Circle(6.0), dx.Material(E=210e3, nu=0.3))),
            "softer than rubber, in a rod 30000 m",
        ),
        (
            dx.Equilibrium(dx.Rod(1.0, dx.Circle(5e-3), dx.Material(E=210e9, nu=0.3, density=7.85e-9))),
            "density is 7.85e-09",
        ),
    ],
)
def test_a_slip_is_warned_of_in_a_line(problem: dx.Equilibrium, words: str) -> None:
    from darboux import mistakes

    (sentence,) = mistakes.of_problem(problem)
    assert "\n" not in sentence
    with pytest.raises(AssertionError, match=words):
        raise AssertionError(sentence)


def test_what_is_meant_is_not_warned_of() -> None:
    from darboux import mistakes

    for problem in (
        dx.Equilibrium(STEEL, loads=[dx.Gravity()]),
        dx.Equilibrium(STEEL, end=dx.Clamped((0, 0, 0.9), twist=4 * dx.turn)),
        dx.Ring(STEEL, link=3),
        dx.Equilibrium(dx.Rod(1e-6, dx.Stiffness(EI1=2e-28, GJ=4e-28))),
    ):
        assert mistakes.of_problem(problem) == []
    assert dx.solve(dx.Equilibrium(STEEL, loads=[dx.EndForce((5.0, 0, 0))])).warnings == ()


def test_stress_beyond_the_strength_is_warned_of() -> None:
    (sentence,) = dx.solve(dx.Equilibrium(STEEL, loads=[dx.EndForce((500.0, 0, 0))])).warnings
    assert "MPa" in sentence
    assert "strength of steel, 460 MPa" in sentence
    own = dx.Rod(1.0, dx.Circle(5e-3), dx.Material(E=210e9, nu=0.3, strength=1e6))
    assert (
        "strength of the material, 1 MPa" in dx.solve(dx.Equilibrium(own, loads=[dx.EndForce((1.0, 0, 0))])).warnings[0]
    )


# -- a cable -------------------------------------------------------------------------------------------------------------


def test_a_cable_shows_its_sag_span_tension_angles_and_length() -> None:
    """Against the catenary z = c (cosh(x / c) - 1): H = w c, T = w (c + z), L = 2 c sinh(span / 2 c)."""
    c, half = 60.0, 20.0
    L, sag = 2.0 * c * np.sinh(half / c), c * (np.cosh(half / c) - 1.0)
    rod = dx.Rod(L, dx.Stiffness(EI1=1e-3, GJ=1e-3, mass=1.0))
    problem = dx.Equilibrium(rod, dx.Pinned(), dx.Pinned((2.0 * half, 0, 0)), loads=[dx.Gravity((0, 0, -2.0))])
    solution = dx.solve(problem)
    cable = solution.cable
    assert cable is not None
    assert cable.span == pytest.approx(40.0)
    assert cable.sag == pytest.approx(sag, rel=1e-4)
    assert cable.tension == pytest.approx(2.0 * (c + sag), rel=1e-4)
    assert cable.length == pytest.approx(L, rel=1e-12)
    assert cable.angles == pytest.approx(2 * [np.degrees(np.arctan(np.sinh(half / c)))], abs=0.5)
    assert "cable         sag " in str(solution)
    assert dx.solve(dx.Equilibrium(STEEL, loads=[dx.Gravity()])).cable is None


# -- in time -------------------------------------------------------------------------------------------------------------


def test_a_load_that_jumps_in_time_does_so_between_two_steps() -> None:
    """A free rod pushed along x by a force F from t = 0.137 s on: its centre has gone F (t - 0.137)^2 / 2 m."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0, mass=2.0))
    problem = dx.Equilibrium(rod, loads=[dx.LineForce((3.0, 0.0, 0.0))])
    factor = dx.Table([0.0, 0.137, 0.137, 0.3], [0.0, 0.0, 1.0, 1.0])
    motion = dx.Motion(problem, 0.3, release={"start": 0.0}, load_factor=factor, rotary_inertia=1e-3)
    found = dx.simulate(motion, dx.ImplicitMidpoint(segments=6, step=0.02))
    assert found.positions[-1, 3, 0] == pytest.approx(0.5 * 3.0 / 2.0 * 0.163**2, rel=1e-9)
    jumping = dx.Table([0.0, 0.1, 0.1, 0.3], [[0.0] * 3, [0.0] * 3, [0.1, 0, 0], [0.1, 0, 0]])
    with pytest.raises(dx.InvalidInput, match=r"jumps at t = 0.1 s; a support moves without jumps"):
        dx.Motion(problem, 0.3, start=dx.Moving(position=jumping), rotary_inertia=1e-3)


# -- as text and as files ------------------------------------------------------------------------------------------------


def test_a_material_of_the_library_keeps_its_name(tmp_path: Path) -> None:
    problem = dx.Equilibrium(dx.Rod(1.0, dx.Circle(5e-3), dx.Material("spring steel")))
    assert problem.rod == dx.Rod(1.0, dx.Circle(5e-3), "spring steel")
    file = tmp_path / "rod.toml"
    problem.to_toml(file)
    assert 'material = "spring steel"' in file.read_text()
    assert dx.load(file) == problem
    own = dx.Material("steel", nu=0.28)
    assert (own.E, own.nu, own.density, own.strength) == (210e9, 0.28, 7850.0, 460e6)


def test_a_table_with_a_jump_survives_the_round_trip(tmp_path: Path) -> None:
    table = dx.Table([0.0, 0.5, 0.5, 1.0], [5e-3, 5e-3, 2e-3, 2e-3])
    problem = dx.Equilibrium(dx.Rod(1.0, dx.Circle(table), "steel"))
    problem.to_toml(tmp_path / "rod.toml")
    assert dx.load(tmp_path / "rod.toml") == problem


def test_a_csv_file_has_tension_shear_and_stress(tmp_path: Path) -> None:
    solution = dx.solve(dx.Equilibrium(STEEL, loads=[dx.EndForce((5.0, 0.0, 3.0))]))
    solution.export(tmp_path / "rod.csv", samples=5)
    heading, *lines = (tmp_path / "rod.csv").read_text().splitlines()
    assert heading.endswith("tension (N),shear (N),stress (Pa)")
    first = [float(x) for x in lines[0].split(",")]
    assert first[-3] == pytest.approx(3.0)
    assert first[-2] == pytest.approx(5.0)
    assert first[-1] == pytest.approx(float(solution.stress(0.0).von_mises))


def test_numbers_below_their_estimated_error_are_shown_as_0() -> None:
    from darboux.cli.report import duration_text, vector_text
    from darboux.summary import vector

    assert vector_text([4.3e-10, 1.0, -2e-3], 1.0, 1e-9) == "(0, 1, -0.002)"
    assert vector(np.array([4.3e-10, 1.0, -2e-3]), 1e-9) == "(0, 1, -0.002)"
    assert [duration_text(t) for t in (0.0423, 3.14, 163.2)] == ["0.042 s", "3.1 s", "163 s"]


def test_measured_points_are_drawn_in_the_unit_of_the_axes() -> None:
    solution = dx.solve(dx.Equilibrium(STEEL, loads=[dx.EndForce((20.0, 0.0, 0.0))]))
    ax = solution.plot(points=solution.r(np.array([0.0, 0.5, 1.0])))
    crosses = next(line for line in ax.lines if line.get_marker() == "x")
    curve = max(ax.lines, key=lambda line: len(line.get_xdata()))
    xy = np.stack(crosses.get_data(), axis=1)
    every = np.stack(curve.get_data(), axis=1)
    assert np.max(np.min(np.linalg.norm(xy[:, None] - every[None], axis=2), axis=1)) < 1e-3 * np.max(np.abs(every))
    for wrong in ([0.0, 1.0, 2.0], [], [[0.0, 1.0]], [[0.0, 1.0], [2.0]], "a", [[0.0, 1.0, np.nan]]):
        with pytest.raises(dx.InvalidInput, match=r"plot.points is .*; (it must be rows of 3 numbers in m|.* finite)"):
            solution.plot(points=wrong)
