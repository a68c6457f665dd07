"""A motion as a film: the rod, the path of its tip, a scale bar and a clock."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from darboux import checks, files
from darboux.errors import InvalidInput
from darboux.view import palette, prefix, style
from darboux.view.look import Look
from darboux.view.motion import moving_ends, smooth
from darboux.view.scene import Scene

if TYPE_CHECKING:
    from darboux.trajectory import Trajectory

Array = NDArray[np.float64]
Frame = NDArray[np.uint8]

ENDINGS = (".mp4", ".gif")
MOST_FRAMES = 3000
SHORTEST, LONGEST = 2.0, 15.0  # s, of a film in real time
SECONDS = 5.0  # about which another film is slowed down or sped up to last
DPI = 100.0
COLOURS = 64  # of a gif
MARGINS = (0.35, 0.35, 0.75, 0.55)  # inches around the motion


def animate(trajectory: Trajectory, path: Any, fps: float = 25.0, speed: float | None = None) -> Path:
    """Write a motion as a film, mp4 or gif by the ending of ``path``; returns the path.

    ``fps`` pictures a second; ``speed`` seconds of motion in a second of film (None: 1, or what makes the film last a few
    seconds). Raises ``InvalidInput``, also where the encoder for mp4 is missing.
    """
    target = _target(path)
    fps = checks.positive("animate.fps", fps)
    times, speed = _times(trajectory, fps, speed)
    frames = _frames(trajectory, times, speed)
    write = _write_mp4 if target.suffix.lower() == ".mp4" else _write_gif
    with style.article(), files.replacing(target) as temporary:
        write(temporary, frames, fps)
    return target


def _target(path: Any) -> Path:
    target = Path(checks.instance("animate.path", path, (str, Path), "a file's name, such as 'fall.mp4'"))
    if target.suffix.lower() not in ENDINGS:
        raise InvalidInput(f"animate.path is {str(target)!r}; a film's name ends in {' or '.join(ENDINGS)}.")
    if target.suffix.lower() == ".mp4":
        try:
            import imageio_ffmpeg  # noqa: F401
        except ImportError:
            raise InvalidInput(
                "mp4 needs the encoder of the extra [view]: pip install 'darboux[view]'. A name that ends in .gif needs nothing."
            ) from None
    files.check(target)
    return target


def _times(trajectory: Trajectory, fps: float, speed: float | None) -> tuple[Array, float]:
    """Return the times of the pictures in s, and the speed."""
    first, last = float(trajectory.times[0]), float(trajectory.times[-1])
    if last <= first:
        raise InvalidInput("the trajectory holds one record only, so that nothing moves; simulate a longer duration.")
    if speed is None:
        speed = 1.0 if SHORTEST <= last - first <= LONGEST else prefix.round_number((last - first) / SECONDS)
    speed = checks.positive("animate.speed", speed)
    count = round((last - first) * fps / speed) + 1
    if not 2 <= count <= MOST_FRAMES:
        raise InvalidInput(
            f"the film would have {count} pictures, of {last - first:g} s with fps={fps:g} and speed={speed:g}; it may have 2 to "
            f"{MOST_FRAMES}. Choose another speed."
        )
    return np.linspace(first, last, count), speed


def _frames(trajectory: Trajectory, times: Array, speed: float) -> Iterator[Frame]:
    """Yield pictures (height, width, 3); what stands still is drawn once."""
    shapes = np.stack([trajectory.at(float(t)).r for t in times])
    look = Look.at(shapes)
    width, height = (2 * round(max(side, 2.6) * DPI / 2.0) for side in look.size)  # encoders want even numbers
    figure = style.new_figure(width / DPI, height / DPI)
    figure.set_dpi(DPI)
    scene = Scene.at(figure, (0.0, 0.0, width / DPI, height / DPI), look.camera)
    unit, metres = prefix.length(look.longest)
    scene.fit(look.points / metres, MARGINS)
    bar = prefix.round_number(0.25 * look.longest / metres)
    scene.scale_bar(bar, f"{bar:g} {unit}", (0.06, 0.05))
    _axes_of_space(scene)
    if speed != 1.0:
        words = f"{1.0 / speed:.3g} times slower" if speed < 1.0 else f"{speed:.3g} times faster"
        figure.text(0.97, 0.96, words, ha="right", va="top", color=palette.GREY)
    scene.line(smooth(trajectory, shapes[0]) / metres, color=palette.PALE, lw=2.0, zorder=1.0)
    for place, support in trajectory.held:
        scene.dot(place / metres, marker="s" if support.clamps else "o", ms=5.0)
    rod = scene.line(smooth(trajectory, shapes[0]) / metres, color=palette.BLUE, lw=2.4, zorder=4.0, animated=True)
    ends = moving_ends(trajectory)
    tails = [
        scene.line(shapes[:1, end] / metres, color=palette.VERMILION, lw=1.0, zorder=2.0, animated=True) for end in ends
    ]
    clock = figure.text(0.03, 0.96, "", ha="left", va="top", animated=True)
    second, size = prefix.quantity(float(times[-1]), "s")
    digits = max(0, int(np.ceil(-np.log10((times[1] - times[0]) / size))))
    canvas: Any = figure.canvas
    canvas.draw()
    still = canvas.copy_from_bbox(figure.bbox)
    for i, t in enumerate(times):
        canvas.restore_region(still)
        rod.set_data(*scene.camera.project(smooth(trajectory, shapes[i]) / metres).T)
        for end, tail in zip(ends, tails, strict=True):
            tail.set_data(*scene.camera.project(shapes[: i + 1, end] / metres).T)
        clock.set_text(f"$t$ = {t / size:.{digits}f} {second}")
        for artist in (*tails, rod, clock):
            artist.draw(canvas.get_renderer())
        yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _axes_of_space(scene: Scene) -> None:
    """Draw the directions x, y, z as small arrows in the lower right corner, those that are not seen end on."""
    ways = scene.camera.project(np.eye(3)) * 24.0  # points
    for name, way in zip("xyz", ways, strict=True):
        length = float(np.linalg.norm(way))
        if length > 5.0:
            style.field_arrow(scene.ax, 0.9, 0.06, (float(way[0]), float(way[1])), "")
            scene.ax.annotate(
                f"${name}$", (0.9, 0.06), xycoords="axes fraction", textcoords="offset points", ha="center", va="center",
                xytext=(float(way[0] * (1.0 + 9.0 / length)), float(way[1] * (1.0 + 9.0 / length))),
            )  # fmt: skip


def _write_mp4(path: Path, frames: Iterator[Frame], fps: float) -> None:
    import imageio_ffmpeg

    first = next(frames)
    height, width = first.shape[:2]
    film = imageio_ffmpeg.write_frames(str(path), (width, height), fps=fps, quality=8, macro_block_size=2)
    try:
        film.send(None)
        film.send(np.ascontiguousarray(first))
        for frame in frames:
            film.send(np.ascontiguousarray(frame))
    finally:
        film.close()


def _write_gif(path: Path, frames: Iterator[Frame], fps: float) -> None:
    from PIL import Image

    pictures = [Image.fromarray(frame).quantize(COLOURS, Image.Quantize.FASTOCTREE) for frame in frames]
    delay = 10.0 * max(2, round(100.0 / fps))  # ms; a gif counts in hundredths, and viewers in two of them at least
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=delay, loop=0)
