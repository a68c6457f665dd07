"""Every picture of `darboux paper` is whole: axes with units, one scale for all directions, no word cut off."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.text import Text

from darboux.paper import pictures
from darboux.paper.results import PARTS, Part
from darboux.view import style
from darboux.view.camera import Camera
from darboux.view.scene import Scene
from darboux.view.tube import tube

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


def is_space(ax: Axes) -> bool:
    return ax.get_gid() == "space"


def texts(figure: Figure) -> list[Text]:
    """The texts that are seen: those of ticks outside the axes' limits are made but not drawn."""
    hidden = set()
    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            low, high = sorted(axis.get_view_interval())
            ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
            slack = 1e-9 * (high - low)
            out = [t for t in ticks if not ax.axison or not low - slack <= t.get_loc() <= high + slack]
            hidden |= {id(label) for t in out for label in (t.label1, t.label2)}
            if not ax.axison:
                hidden |= {id(axis.label), id(axis.offsetText)}
    found = figure.findobj(Text)
    return [t for t in found if t.get_visible() and t.get_text().strip() and id(t) not in hidden]


def test_draws_every_part_of_the_paper() -> None:
    assert STEMS.keys() == PARTS.keys()
    for name, stems in STEMS.items():
        assert list(drawn(name)) == stems


def test_no_word_is_cut_off(figure: Figure) -> None:
    width, height = figure.bbox.size
    seen = texts(figure)
    assert len(seen) >= 8
    for text in seen:
        box = text.get_window_extent()
        assert np.all(np.isfinite(box.get_points())), text.get_text()
        assert min(box.x0, box.y0, width - box.x1, height - box.y1) >= 0, text.get_text()


def test_no_two_words_lie_on_each_other(figure: Figure) -> None:
    seen = [(t.get_text(), t.get_window_extent()) for t in texts(figure) if t.get_rotation() in (0.0, 90.0)]
    for i, (a, box) in enumerate(seen):
        for b, other in seen[i + 1 :]:
            across = min(box.x1, other.x1) - max(box.x0, other.x0)
            up = min(box.y1, other.y1) - max(box.y0, other.y0)
            smaller = min(box.width * box.height, other.width * other.height)
            assert across <= 0 or up <= 0 or across * up < 0.15 * smaller, (a, b)


def test_plane_axes_are_labelled_with_units(figure: Figure) -> None:
    for ax in (ax for ax in figure.axes if not is_space(ax)):
        for label in (ax.get_xlabel(), ax.get_ylabel()):
            assert re.search(r"\((m|cm)\)$", label) or label in UNITLESS, label


def test_pictures_of_space_say_their_lengths(figure: Figure) -> None:
    if any(is_space(ax) for ax in figure.axes):
        words = " ".join(t.get_text() for t in texts(figure))
        assert re.search(r"\d\S* ?(m|cm)\b", words) or all(f"${x}$ (" in words for x in "xyz")


def test_every_direction_has_the_same_scale(figure: Figure) -> None:
    for ax in figure.axes:
        lengths = "m)" in ax.get_xlabel() and "m)" in ax.get_ylabel()
        if lengths or is_space(ax):
            corner, right, up = ax.transData.transform([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
            np.testing.assert_allclose(right[0] - corner[0], up[1] - corner[1], rtol=1e-6)


def test_all_that_is_drawn_is_finite(figure: Figure) -> None:
    for ax in figure.axes:
        assert np.all(np.isfinite([ax.get_xlim(), ax.get_ylim()]))
        for line in ax.findobj(Line2D):
            assert not np.any(np.isinf(np.asarray(line.get_xydata(), dtype=float)))


def test_legends_hide_no_line(figure: Figure) -> None:
    for legend in figure.findobj(Legend):
        box = legend.get_window_extent()
        for ax in figure.axes:
            for line in ax.get_lines():
                if line.get_transform() == ax.transData and len(line.get_xydata()) > 2:
                    points = ax.transData.transform(line.get_xydata())
                    inside = ax.bbox.x0, ax.bbox.y0, ax.bbox.x1, ax.bbox.y1
                    shown = np.all((points >= inside[:2]) & (points <= inside[2:]), axis=1)
                    hidden = np.all((points > box.p0) & (points < box.p1), axis=1)
                    assert not np.any(shown & hidden), line.get_label()


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
