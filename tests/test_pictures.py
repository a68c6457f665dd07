"""Every picture of `darboux paper` is whole: axes with units, one scale for all directions, no word cut off."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imread

from darboux.paper import pictures
from darboux.paper.results import PARTS, Part
from darboux.view import style
from darboux.view.camera import Camera
from darboux.view.scene import Scene
from darboux.view.tube import tube
from tests import drawing
from tests.drawing import is_space, texts

STEMS = {
    "1-4": ["figure1", "figure2", "figure3", "figure4"],
    "5": ["figure5", "figure5_convergence"],
    "6": ["figure6"],
    "7": ["figure7"],
    "rotating": ["rotating"],
    "charged": ["charged"],
    "invariants": [],
    "conventions": [],
}
ALL = [(name, stem) for name, stems in STEMS.items() for stem in stems]
UNITLESS = {"number of segments $N$", r"error of the tip, $|\Delta \mathbf{r}(L)| / L$",
            r"distance from shooting, $|\Delta \mathbf{r}| / L$"}  # fmt: skip


@cache
def part(name: str) -> Part:
    return PARTS[name][1]() if STEMS[name] else Part()


@cache
def drawn(name: str) -> dict[str, Figure]:
    return pictures.draw(name, part(name))


@pytest.fixture(params=ALL, ids=[stem for _, stem in ALL])
def figure(request: pytest.FixtureRequest) -> Figure:
    name, stem = request.param
    found = drawn(name)[stem]
    found.draw_without_rendering()
    return found


def test_draws_every_part_of_the_paper() -> None:
    assert STEMS.keys() == PARTS.keys()
    for name, stems in STEMS.items():
        assert list(drawn(name)) == stems


def test_no_word_is_cut_off(figure: Figure) -> None:
    drawing.assert_no_word_is_cut_off(figure, least=8)


def test_no_two_words_lie_on_each_other(figure: Figure) -> None:
    drawing.assert_no_two_words_lie_on_each_other(figure)


def test_plane_axes_are_labelled_with_units(figure: Figure) -> None:
    for ax in (ax for ax in figure.axes if not is_space(ax)):
        for label in (ax.get_xlabel(), ax.get_ylabel()):
            assert re.search(r"\((m|cm)\)$", label) or label in UNITLESS, label


def test_pictures_of_space_say_their_lengths(figure: Figure) -> None:
    if any(is_space(ax) for ax in figure.axes):
        words = " ".join(t.get_text() for t in texts(figure))
        assert re.search(r"\d\S* ?(m|cm)\b", words) or all(f"${x}$ (" in words for x in "xyz")


def test_every_direction_has_the_same_scale(figure: Figure) -> None:
    drawing.assert_one_scale_for_all_directions(figure)


def test_all_that_is_drawn_is_finite(figure: Figure) -> None:
    drawing.assert_all_is_finite(figure)


def test_legends_hide_no_line(figure: Figure) -> None:
    drawing.assert_legends_hide_no_line(figure)


@pytest.mark.parametrize(("name", "stem"), ALL, ids=[stem for _, stem in ALL])
def test_is_saved_as_png_and_as_a_small_svg(name: str, stem: str, tmp_path: Path) -> None:
    style.save(drawn(name)[stem], tmp_path, stem, dpi=60)
    image = imread(tmp_path / f"{stem}.png")
    dark = np.mean(image[..., :3].min(axis=2) < 0.9)
    assert 0.005 < dark < 0.6
    edge = np.concatenate([image[0, :, :3], image[-1, :, :3], image[:, 0, :3], image[:, -1, :3]])
    assert np.all(edge > 0.98)  # nothing runs off the page
    svg = tmp_path / f"{stem}.svg"
    assert svg.stat().st_size < 1_000_000
    assert ElementTree.parse(svg).getroot().tag.endswith("svg")


def test_settings_of_matplotlib_stay_as_they_are() -> None:
    with mpl.rc_context({"font.size": 23.0, "axes.grid": True}):
        before = dict(mpl.rcParams)
        figures = pictures.draw("rotating", part("rotating"))
        assert dict(mpl.rcParams) == before
        assert figures["rotating"].axes[0].xaxis.label.get_size() == 11.0  # and the reader's do not reach in
        assert isinstance(figures["rotating"].canvas, FigureCanvasAgg)


def test_drawing_twice_gives_the_same_file(tmp_path: Path) -> None:
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        style.save(pictures.draw("charged", part("charged"))["charged"], tmp_path / folder, "charged", dpi=60)
    assert (tmp_path / "one/charged.svg").read_bytes() == (tmp_path / "two/charged.svg").read_bytes()


@pytest.mark.parametrize("azimuth", [-170.0, -60.0, 0.0, 35.0])
@pytest.mark.parametrize("elevation", [-30.0, 0.0, 22.0])
def test_camera_is_a_rotation_with_e3_upright(azimuth: float, elevation: float) -> None:
    A = Camera(azimuth, elevation).A
    np.testing.assert_allclose(A @ A.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(A) == pytest.approx(1.0)
    assert A[0, 2] == 0.0
    assert A[1, 2] > 0.0


def test_camera_from_the_front_sees_e1_to_the_right_and_e3_up() -> None:
    camera = Camera(azimuth=-90.0, elevation=0.0)
    np.testing.assert_allclose(camera.project(np.eye(3)), [[1, 0], [0, 0], [0, 1]], atol=1e-15)
    np.testing.assert_allclose(camera.depth(np.eye(3)), [0, -1, 0], atol=1e-15)


@pytest.mark.parametrize(("apart", "cut"), [(0.02, False), (0.5, True)])
def test_a_curve_parts_strands_that_cross_and_cuts_none_that_runs_along_it(apart: float, cut: bool) -> None:
    """Two turns of a helix: ``apart`` by little they nearly coincide all along, by more they only cross."""
    turns = np.linspace(0.0, 4.0 * np.pi, 401)
    curve = np.stack([np.cos(turns), np.sin(turns), apart * turns / (2.0 * np.pi)], axis=1)
    scene = Scene.at(style.new_figure(4.0, 3.0), (0.0, 0.0, 4.0, 3.0), Camera(-60.0, 20.0))
    scene.fit(curve)
    scene.curve(curve, width=2.0, colour="b")
    halos = np.array(scene.ax.collections[0].get_linewidths()[::2])
    assert np.any(halos > 0.0) == cut
    assert np.all(np.isin(halos, (0.0, 2.0 + 2.0 * 1.2)))


def test_scene_fits_its_points_between_the_margins() -> None:
    with style.article():
        scene = Scene.at(style.new_figure(6.0, 4.0), (1.0, 0.5, 4.0, 3.0), Camera())
        points = np.random.default_rng(1).normal(size=(50, 3))
        scene.fit(points, (0.5, 0.25, 0.3, 0.1))
    pixels = scene.ax.transData.transform(scene.camera.project(points)) / 100.0  # inches
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    assert np.all(low > np.array([1.5, 0.8]) - 1e-9)
    assert np.all(high < np.array([4.75, 3.4]) + 1e-9)
    assert np.isclose(high - low, [3.25, 2.6]).any()  # and fills them one way


def test_tube_lies_round_the_centreline_and_shows_its_material_line() -> None:
    s = np.linspace(0.0, 1.0, 20)
    r = np.stack([s, 0 * s, 0 * s], axis=1)
    R = np.broadcast_to(np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]), (20, 3, 3))  # d1 = e2, d2 = e3, d3 = e1
    camera = Camera(azimuth=90.0, elevation=0.0)  # looks at the side of d1
    faces = tube(r, R, 0.1, camera.A, colour=(0.9, 0.9, 0.9), lines=[(0.0, 0.2, (1.0, 0.0, 0.0))])
    np.testing.assert_allclose(np.hypot(faces.corners[..., 1], faces.corners[..., 2]), 0.1)
    assert np.all(faces.corners.mean(axis=1)[:, 1] > -0.02)  # only what looks at the viewer
    red = faces.colours[:, 0] > faces.colours[:, 1] + 0.2
    assert red.sum() == 19
    assert np.all(faces.corners[red][..., 1] > 0.095)
    assert np.all((faces.colours >= 0.0) & (faces.colours <= 1.0))


@pytest.mark.parametrize(
    ("value", "words"), [(0.0, "0"), (3e5, r"3 \times 10^{5}"), (8e-4, r"8 \times 10^{-4}"), (1.5, "1.5")]
)
def test_power_of_ten(value: float, words: str) -> None:
    assert style.power_of_ten(value) == words
