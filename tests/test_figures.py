"""The figures of results: whole at small and large size, in readable units, and the lines are the solution.

Some are held against small pictures without words, so that they do not depend on fonts; `python -m tests.test_figures`
draws these anew, to be looked at before they are kept.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any
from unittest import mock

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import imread, imsave

import darboux as dx
from darboux.checks import ONE_PLACE
from darboux.view import fields, motion, palette, plots, prefix, shapes, style
from darboux.view.look import Look, plane_of
from tests import drawing
from tests.cases import ALONG_X, RUBBER, UNIT

PICTURES = Path(__file__).parent / "pictures"
CLOSE = 0.2  # root mean square of the changes over that of the ink; edges differ a little from version to version


@cache
def solved(name: str) -> dx.EquilibriumSolution:
    helix = dx.Helix(radius=0.02, pitch=0.02)
    spring = dx.Rod(0.5, dx.Circle(1e-3), "steel", natural=helix)
    micro = dx.Rod(20e-6, dx.Circle(12e-9), dx.Material(E=2e9, nu=0.3, density=1300))
    rope = dx.Rod(101.0, dx.Circle(0.015), dx.Material(E=1e11, nu=0.3, density=6000), stretch=True)
    problem = {
        "straight": dx.Equilibrium(RUBBER),
        "hanging": dx.Equilibrium(RUBBER, start=ALONG_X, loads=[dx.Gravity()]),
        "helix": dx.Equilibrium(
            spring, start=dx.Clamped(frame=helix.frame((0, 0, -1))), loads=[dx.EndForce((0, 0, -2))]
        ),
        "ring": dx.Ring(UNIT, link=0),
        "twisted ring": dx.Ring(dx.Rod(1.0, dx.Stiffness(EI1=1.4, EI2=1.0, GJ=0.75)), link=1),
        "twisted": dx.Equilibrium(RUBBER, end=dx.Clamped(position=(0, 0, 0.25), twist=dx.turn)),
        "edge-on": dx.Equilibrium(UNIT, loads=[dx.EndForce((0.02, 2.0, -1.0)), dx.EndMoment((0, 0, 0.2))]),
        "oblique": dx.Equilibrium(RUBBER, start=dx.Clamped(tangent=(1, 1, 0)), loads=[dx.Gravity()]),
        "micrometre": dx.Equilibrium(micro, start=ALONG_X, loads=[dx.EndForce((1e-13, 4e-13, 0))]),
        "cable": dx.Equilibrium(rope, dx.Pinned(), dx.Pinned((100.0, 0, 0)), loads=[dx.Gravity()]),
    }[name]
    return dx.solve(problem)


NAMES = ("straight", "hanging", "helix", "ring", "twisted ring", "twisted", "edge-on", "oblique", "micrometre", "cable")


@cache
def compared(name: str) -> dx.Comparison:
    methods = [dx.Elastica(), dx.DiscreteRod(30)] if name == "hanging" else [dx.DiscreteRod(60)]
    return dx.compare(solved(name).problem, [dx.Collocation(), *methods], order=False)


@cache
def moved(space: bool) -> dx.Trajectory:
    rod = dx.Rod(0.25, dx.Circle(1e-3), RUBBER.material, stretch=True)
    problem = dx.Equilibrium(rod, start=ALONG_X, loads=[dx.Gravity()])
    aside = (lambda s: np.stack([0 * s, 2 * s, 0 * s], axis=1)) if space else None
    damping = [] if space else [dx.LinearDrag(along=0.005, across=0.01)]
    return dx.simulate(dx.Motion(problem, 0.4, velocity=aside, damping=damping), dx.TRBDF2(12), records=200)


DRAWN: dict[str, Callable[[Any], Any]] = {
    **{f"shape of {name}": lambda ax, name=name: shapes.shape(solved(name), ax) for name in NAMES},
    **{
        f"{what} of {name}": lambda ax, name=name, what=what: fields.fields(solved(name), (what,), ax)[0]
        for name, what in (
            ("hanging", "curvature"),
            ("helix", "curvature"),
            ("helix", "moments"),
            ("straight", "forces"),
            ("cable", "stress"),
            ("helix", "energy"),
        )
    },
    **{
        f"methods for {name}": lambda ax, name=name: shapes.comparison(compared(name), ax)
        for name in ("hanging", "helix", "cable")
    },
    **{
        f"{what} of a motion in {'space' if space else 'a plane'}": lambda ax, what=what, space=space: motion.motion(
            moved(space), what, ax
        )
        for space in (False, True)
        for what in ("shapes", "tip", "energy")
    },
}  # fmt: skip


@pytest.fixture(scope="module", params=[(name, large) for name in DRAWN for large in (True, False)], ids=str)
def figure(request: pytest.FixtureRequest) -> Figure:
    """Each figure, as it comes, and on axes of three inches with a reader's settings."""
    name, large = request.param
    ax = None if large else style.new_figure(3.0, 2.4, "constrained").add_subplot()
    made = DRAWN[name](ax).get_figure(root=True)
    made.draw_without_rendering()
    return made


def test_is_whole(figure: Figure) -> None:
    drawing.assert_no_word_is_cut_off(figure, least=4)
    drawing.assert_no_two_words_lie_on_each_other(figure)
    drawing.assert_one_scale_for_all_directions(figure)
    drawing.assert_all_is_finite(figure)
    drawing.assert_legends_hide_no_line(figure)


@pytest.mark.parametrize("size", [(3.3, 2.6), (6.0, 4.5), None])
@pytest.mark.parametrize("along", [(1, 0, 0), (0, -1, 0), (0, 0, 1), (1, 0.2, 0.1)])
def test_narrow_shapes_in_space_keep_their_words_apart(
    along: tuple[float, ...], size: tuple[float, float] | None
) -> None:
    d3 = np.array(along) / np.linalg.norm(along)
    d1 = np.cross(d3, np.eye(3)[np.argmin(np.abs(d3))])
    d1 /= np.linalg.norm(d1)
    bent = dx.integrate(UNIT, k=(0.3, 0.1, 3.0), frame=np.stack([d1, np.cross(d3, d1), d3], axis=1))
    ax = style.new_figure(*size, "constrained").add_subplot() if size else None
    made = shapes.shape(bent, ax).get_figure(root=True)
    made.draw_without_rendering()
    assert drawing.is_space(made.axes[0])
    drawing.assert_no_word_is_cut_off(made, least=8)
    drawing.assert_no_two_words_lie_on_each_other(made)


def test_says_its_units_in_short_numbers(figure: Figure) -> None:
    words = [t.get_text() for t in drawing.texts(figure)]
    ax = figure.axes[0]
    labels = (
        [w for w in words if re.search(r"^\$[xyz]\$ \(", w)]
        if drawing.is_space(ax)
        else [ax.get_xlabel(), ax.get_ylabel()]
    )
    assert len(labels) >= 2
    for label in labels:
        assert re.search(r" \((k|c|m|µ|n|M|f|a)?(m|N|N m|Pa|J|J/m|s)\)$| \(1/(km|m|mm|µm)\)$", label), label
    for word in words:
        if re.fullmatch(r"[\N{MINUS SIGN}\d.]+", word):
            assert len(word.lstrip("\N{MINUS SIGN}")) <= 5, word


def test_lines_differ_in_grey_too() -> None:
    for name in ("hanging", "helix"):
        for ax in fields.fields(solved(name)):
            lines = [line for line in ax.get_lines() if line.get_zorder() >= 2.0]
            assert len({str(line._unscaled_dash_pattern) for line in lines}) == len(lines) >= 2
    dashes = [line.get_linestyle() for line in shapes.comparison(compared("hanging")).get_lines()[:3]]
    assert len(set(dashes)) == 3
    shade = [np.dot(mpl.colors.to_rgb(line.get_color()), (0.2126, 0.7152, 0.0722)) for line in _fan_of(moved(False))]
    assert np.all(np.diff(shade) > 0.0)  # time runs from dark to light


def _fan_of(trajectory: dx.Trajectory) -> list[Any]:
    lines = motion.motion(trajectory, "shapes").get_lines()  # type: ignore[union-attr]
    return [line for line in lines if line.get_linestyle() == "-" and line.get_color() != palette.VERMILION][
        : motion.MOST_SHAPES
    ]


# -- what is drawn is what was found -----------------------------------------------------------------------------------


def test_the_lines_of_the_fields_are_the_solution() -> None:
    strip = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=3.0, GJ=0.7, EA=50.0), natural=(0, 0, 2.0), stretch=True)
    loads = [dx.EndForce((1, 2, -1)), dx.EndMoment((0, 0, 0.5)), dx.PointForce((0, 3, 0), at=0.4)]
    solution = dx.solve(dx.Equilibrium(strip, loads=loads))
    curvature, moments, forces, energy = fields.fields(solution)  # a Stiffness has no stress
    s = curvature.get_lines()[0].get_xdata() / 100.0  # cm
    assert {0.4, 0.4 - 2.0 * ONE_PLACE} <= set(fields.places(solution))  # both sides of the jump
    np.testing.assert_allclose(s, fields.places(solution))
    s = fields.places(solution)
    R = solution.R(s)
    for ax, vectors in ((moments, solution.m(s)), (forces, solution.n(s))):
        lines = np.stack([line.get_ydata() for line in ax.get_lines()], axis=1)
        np.testing.assert_allclose(lines[:, :3], np.einsum("nji,nj->ni", R, vectors), atol=1e-12)
        np.testing.assert_allclose(lines[:, 3], np.linalg.norm(vectors, axis=1))
    *drawn, sample = curvature.get_lines()
    assert (sample.get_label(), len(sample.get_xdata())) == ("natural", 0)
    natural, k = np.split(np.stack([line.get_ydata() for line in drawn], axis=1), 2, axis=1)
    np.testing.assert_allclose(k, solution.k(s))
    np.testing.assert_allclose(natural, np.tile([0, 0, 2.0], (len(s), 1)))
    assert energy.get_ylabel() == "energy (J/m)"
    found = [np.trapezoid(line.get_ydata(), s) for line in energy.get_lines()]
    expected = [solution.energy.bending, solution.energy.twist, solution.energy.stretch]
    np.testing.assert_allclose(found, expected, rtol=1e-4)


def test_a_rod_in_a_plane_is_drawn_there_and_others_in_space() -> None:
    for name in NAMES:
        ax = shapes.shape(solved(name))
        assert drawing.is_space(ax) == (name in ("helix", "twisted ring", "twisted", "edge-on"))
    solution = solved("oblique")  # hangs in the plane at 45 degrees
    ax = shapes.shape(solution)
    x, y = ax.get_lines()[0].get_data()
    r = solution.r(np.linspace(0.0, 0.25, shapes.SAMPLES)) * 100.0
    np.testing.assert_allclose(np.stack([x, y]), np.stack([(r[:, 0] + r[:, 1]) / np.sqrt(2.0), r[:, 2]]), atol=1e-9)
    assert ax.get_xlabel() == "along (0.71, 0.71, 0) (cm)"
    assert ax.get_ylabel() == "$z$ (cm)"


@pytest.mark.parametrize("normal", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0, 0.8), (-0.48, 0.6, 0.64)])
def test_the_camera_faces_the_plane_of_the_points(normal: tuple[float, ...]) -> None:
    n = np.array(normal)
    along = np.linalg.svd(n[None])[2][1:]
    points = np.random.default_rng(3).normal(size=(40, 2)) @ along + 2.0 * n
    assert abs(plane_of(points) @ n) == pytest.approx(1.0, abs=1e-12)
    look = Look.at(points)
    assert look.flat
    np.testing.assert_allclose(np.abs(look.camera.A[2] @ n), 1.0, atol=1e-12)
    flat = look.camera.project(points)  # lengths are true
    np.testing.assert_allclose(
        np.linalg.norm(flat - flat[0], axis=1), np.linalg.norm(points - points[0], axis=1), atol=1e-12
    )
    assert not Look.at(points + np.outer(np.arange(40) % 2, 0.01 * n)).flat
    right = look.camera.A[0]
    assert right[np.argmax(np.abs(right))] > 0.0


def test_distances_stand_in_the_inset_of_large_axes_only() -> None:
    found = compared("hanging")
    ax = shapes.comparison(found)
    (inset,) = ax.child_axes
    reference = found[found.reference]
    s = np.linspace(0.0, 0.25, shapes.SAMPLES)
    for entry in found.entries:
        gap = np.linalg.norm(entry.solution.r(s) - reference.r(s), axis=1) / 0.25
        drawn = [line.get_ydata() for line in inset.get_lines() if len(line.get_ydata()) == np.count_nonzero(gap)]
        assert np.max(gap) == 0.0 or any(np.array_equal(values, gap[gap > 0.0]) for values in drawn)
    box = inset.get_tightbbox()
    for line in ax.get_lines():
        points = ax.transData.transform(line.get_xydata())
        assert not np.any(np.all((points > box.p0) & (points < box.p1), axis=1))  # it hides no curve
    small = style.new_figure(3.0, 2.4).add_subplot()
    assert not shapes.comparison(found, small).child_axes


def test_energies_and_tips_are_those_of_the_motion() -> None:
    trajectory = moved(False)
    energy = trajectory.energy
    lines = {str(line.get_label()): line for line in motion.motion(trajectory, "energy").get_lines()}  # type: ignore[union-attr]
    assert set(lines) == {"kinetic", "elastic", "loads", "dissipated", "sum"}  # nothing does work here
    np.testing.assert_allclose(lines["dissipated"].get_ydata(), energy.dissipated * 1e6)
    np.testing.assert_allclose(lines["sum"].get_ydata(), (energy.balance - energy.load[0]) * 1e6)
    tips = motion.motion(trajectory, "tip").get_lines()  # type: ignore[union-attr]
    np.testing.assert_allclose([line.get_ydata() for line in tips], trajectory.tip.T * 100.0)


def test_what_did_not_converge_says_so() -> None:
    pushed = dx.Equilibrium(UNIT, end=dx.Clamped(position=(0, 0, 0.5)))
    solution = dx.solve(pushed, dx.Shooting(), throw=False)
    title = shapes.shape(solution).get_title()
    assert title == f"not converged: at {100 * solution.load_factor:.0f} % of the load"


# -- manners -----------------------------------------------------------------------------------------------------------


def test_axes_are_taken_and_returned_and_no_setting_is_changed() -> None:
    solution, trajectory = solved("hanging"), moved(False)
    with mpl.rc_context({"font.size": 23.0, "axes.grid": True}):
        before = dict(mpl.rcParams)
        figure, axes = plt.subplots(1, 8)
        assert solution.plot(axes[0]) is axes[0]
        assert axes[0].get_lines()
        assert axes[0].xaxis.label.get_size() == 23.0  # the reader's settings on the reader's axes
        assert solution.plot_fields("moments", "forces", ax=axes[1:3]) == list(axes[1:3])
        assert compared("hanging").plot(ax=axes[3]) is axes[3]
        assert trajectory.plot(ax=axes[4:7]) == list(axes[4:7])
        assert trajectory.plot("tip", ax=axes[7]) is axes[7]
        assert plt.get_fignums() == [figure.number]
        made = solution.plot()
        assert made.xaxis.label.get_size() == 11.0  # ours on a new figure, which pyplot shows
        assert plt.gcf() is made.get_figure()
        assert dict(mpl.rcParams) == before
    plt.close("all")


def test_mistakes_are_sentences() -> None:
    solution = solved("hanging")
    with pytest.raises(dx.InvalidInput, match="Did you mean 'moments'"):
        solution.plot_fields("moment")
    with pytest.raises(dx.InvalidInput, match="Did you mean 'energy'"):
        moved(False).plot("energies")
    with pytest.raises(dx.InvalidInput, match="axes of Matplotlib"):
        solution.plot(ax=3)
    with pytest.raises(dx.InvalidInput, match=r"holds 1 axes; 2"):
        solution.plot_fields("moments", "stress", ax=style.new_figure(3.0, 3.0).add_subplot())
    with pytest.raises(dx.InvalidInput, match="projection '3d'"):
        solution.plot(ax=style.new_figure(3.0, 3.0).add_subplot(projection="3d"))
    with pytest.raises(dx.InvalidInput, match="no shape"):
        solved("ring").plot_fields("stress")


def test_nothing_is_drawn_on_import() -> None:
    code = (
        "import sys, matplotlib as mpl; before = dict(mpl.rcParams)\n"
        "import darboux.view.plots, darboux.view.html, darboux.view.animation\n"
        "print('matplotlib.pyplot' in sys.modules, dict(mpl.rcParams) == before)"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.split() == ["False", "True"]


def test_the_style_sheet_is_there_for_figures_of_one_s_own() -> None:
    with mpl.style.context("darboux.view.article"):
        assert mpl.rcParams["axes.labelsize"] == 11.0
        assert mpl.rcParams["axes.prop_cycle"].by_key()["color"][:2] == [palette.BLUE, palette.VERMILION]


@pytest.mark.parametrize(
    ("largest", "unit", "found"),
    [
        (0.25, "m", ("cm", 1e-2)),
        (1.0, "m", ("m", 1.0)),
        (2.9e-9, "N m", ("nN m", 1e-9)),
        (1e-3, "N", ("mN", 1e-3)),
        (2.1e8, "Pa", ("MPa", 1e6)),
        (4.2e3, "1/m", ("1/mm", 1e3)),
        (0.02, "1/m", ("1/km", 1e-3)),
        (0.4, "s", ("ms", 1e-3)),
        (1e-30, "N", ("yN", 1e-24)),
    ],
)
def test_units_keep_numbers_short(largest: float, unit: str, found: tuple[str, float]) -> None:
    assert prefix.quantity(largest, unit) == found


def test_every_word_of_the_command_draws() -> None:
    assert len(plots.draw(solved("hanging"), "fields").axes) == 5
    assert plots.draw(solved("hanging")).axes[0].get_ylabel() == "$z$ (cm)"
    assert [ax.get_ylabel() for ax in plots.draw(moved(False)).axes] == [
        "$z$ (cm)",
        "tip (cm)",
        "energy (µJ)",
        "time $t$ (ms)",
    ]
    with pytest.raises(dx.InvalidInput, match="'motion'"):
        plots.draw(moved(False), "stress")


# -- held against pictures ---------------------------------------------------------------------------------------------

KEPT: dict[str, Callable[[Axes], Any]] = {
    "hanging": lambda ax: shapes.shape(solved("hanging"), ax),
    "helix": lambda ax: shapes.shape(solved("helix"), ax),
    "moments": lambda ax: fields.fields(solved("helix"), ["moments"], ax),
    "methods": lambda ax: shapes.comparison(compared("hanging"), ax),
    "fan": lambda ax: motion.motion(moved(False), "shapes", ax),
    "energy": lambda ax: motion.motion(moved(False), "energy", ax),
}


def wordless(draw: Callable[[Axes], Any], change: float = 0.0) -> np.ndarray:
    """Return the grey levels (90, 120) of a figure of 3 by 2.25 inches without its words; ``change`` moves every line."""
    with style.article(), mock.patch.object(style, "legend_on_top"):
        figure = style.new_figure(3.0, 2.25)
        draw(figure.add_axes((0.06, 0.06, 0.8, 0.88)))
        for ax in figure.findobj(Axes):
            ax.tick_params(which="both", labelleft=False, labelright=False, labelbottom=False)
        for text in figure.findobj(mpl.text.Text):
            text.set_visible(False)
        for line in figure.axes[0].get_lines() if change else ():
            x, y = np.array(line.get_data(), dtype=float)
            turn = change * np.linspace(0.0, 1.0, len(x))
            line.set_data(x + turn * np.ptp(figure.axes[0].get_xlim()), y + turn * np.ptp(figure.axes[0].get_ylim()))
        figure.set_dpi(40.0)
        figure.canvas.draw()  # type: ignore[attr-defined]
        return np.asarray(figure.canvas.buffer_rgba())[..., :3].mean(axis=2)  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", KEPT)
def test_looks_as_it_did(name: str) -> None:
    kept = 255.0 * imread(PICTURES / f"{name}.png")[..., 0]

    def difference(levels: np.ndarray) -> float:
        return float(np.sqrt(np.mean((levels - kept) ** 2) / np.mean((255.0 - kept) ** 2)))

    assert difference(wordless(KEPT[name])) < CLOSE
    assert difference(wordless(KEPT[name], change=0.02)) > CLOSE  # lines that turn by a degree or two are seen


def main() -> None:
    """Draw the kept pictures anew."""
    PICTURES.mkdir(exist_ok=True)
    for name, draw in KEPT.items():
        imsave(PICTURES / f"{name}.png", np.repeat(wordless(draw)[..., None] / 255.0, 3, axis=2))


if __name__ == "__main__":
    main()
