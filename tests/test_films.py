"""Films of a motion: as many pictures as the time takes, a clock that runs, a rod that moves, and sentences for mistakes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.text import Text
from PIL import Image

import darboux as dx
from darboux.view import animation, style
from tests.cases import ALONG_X, RUBBER


@pytest.fixture(scope="module")
def falling() -> dx.Trajectory:
    rod = dx.Rod(0.25, dx.Circle(1e-3), RUBBER.material, stretch=True)
    return dx.simulate(
        dx.Motion(dx.Equilibrium(rod, start=ALONG_X, loads=[dx.Gravity()]), 0.2), dx.TRBDF2(10), records=20
    )


def blue(picture: np.ndarray) -> np.ndarray:
    """Return where the rod is: rows and columns (n, 2)."""
    levels = picture.astype(int)
    return np.argwhere((levels[..., 2] > levels[..., 0] + 80) & (levels[..., 0] < 90))


def test_a_gif_shows_the_rod_where_it_is(falling: dx.Trajectory, tmp_path: Path) -> None:
    path = falling.animate(tmp_path / "fall.gif", fps=20, speed=0.2)
    places = []
    with Image.open(path) as film:
        assert film.n_frames == 21  # 0.2 s, 5 times slower, at 20 a second
        assert film.info["duration"] == 50.0
        assert film.info["loop"] == 0
        for i in (0, 20):
            film.seek(i)
            places.append(blue(np.asarray(film.convert("RGB"))))
    start = places[0][:, 1].min()  # the clamp's column; the rod lies along x, so its picture gives the scale
    per_metre = (np.ptp(places[0][:, 1]) - 2.0) / 0.25
    assert np.ptp(places[0][:, 0]) < 6
    lowest = np.ptp(places[1][:, 0]) / per_metre
    assert lowest == pytest.approx(-falling.positions[-1, :, 2].min(), abs=0.01)
    widest = (places[1][:, 1].max() - start) / per_metre
    assert widest == pytest.approx(falling.positions[-1, :, 0].max(), abs=0.01)


def test_an_mp4_has_its_length(falling: dx.Trajectory, tmp_path: Path) -> None:
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    path = falling.animate(str(tmp_path / "fall.mp4"), fps=25, speed=0.2)
    count, seconds = imageio_ffmpeg.count_frames_and_secs(str(path))
    assert (count, seconds) == (26, pytest.approx(26 / 25))
    read = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    raw = subprocess.run(read, capture_output=True, check=True).stdout
    with style.article():
        height, width, _ = next(animation._frames(falling, *animation._times(falling, 25.0, 0.2))).shape
    assert width % 2 == height % 2 == 0
    first, *_, last = np.frombuffer(raw, np.uint8).reshape(26, height, width, 3)
    assert np.ptp(blue(last)[:, 0]) > 5 * np.ptp(blue(first)[:, 0])


def test_what_stands_beside_the_rod(falling: dx.Trajectory, monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    new = style.new_figure
    monkeypatch.setattr(style, "new_figure", lambda *size: made.append(new(*size)) or made[-1])
    times, speed = animation._times(falling, 25.0, None)
    assert speed == 0.05  # 0.2 s take about as long as five
    assert len(times) == 101
    clocks = []
    with style.article():
        for _ in animation._frames(falling, times[[0, 50, 100]], speed):
            words = [text.get_text() for text in made[0].findobj(Text) if text.get_text()]
            clocks += [word for word in words if word.startswith("$t$")]
            assert {"5 cm", "20 times slower", "$x$", "$z$"} <= set(words)
    assert clocks == ["$t$ = 0 ms", "$t$ = 100 ms", "$t$ = 200 ms"]


def test_mistakes_are_sentences(falling: dx.Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(dx.InvalidInput, match=r"ends in \.mp4 or \.gif"):
        falling.animate(tmp_path / "fall.avi")
    with pytest.raises(dx.InvalidInput, match="2000001 pictures"):
        falling.animate(tmp_path / "fall.gif", fps=10, speed=1e-6)
    with pytest.raises(dx.InvalidInput, match="Did you mean 1"):
        falling.animate(tmp_path / "fall.gif", speed=-1.0)
    with pytest.raises(dx.InvalidInput, match="can't be written"):
        falling.animate(tmp_path / "no" / "fall.gif")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(dx.InvalidInput, match=r"pip install 'darboux\[view\]'"):
        falling.animate(tmp_path / "fall.mp4")
    assert not list(tmp_path.iterdir())
