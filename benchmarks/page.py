"""The live page: a slider is dragged in headless Chromium, and the rod is solved and drawn anew all the while.

`darboux serve` shows the cantilever of 40 elements; the mouse takes the slider of its length to and fro over six tenths of
its track, at one track a second in sixty moves a second, as long as no more than six are on their way. Counted is what the
browser has drawn: shapes that are new. Without a graphics card Chromium draws by the processor, and so on the same cores that
solve: on a machine that is busy otherwise (its load is given) only the processor's time says something. That is the time of
the server, and of Chromium with all its processes, over the shapes drawn.
"""

from __future__ import annotations

import asyncio
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.timing import Row, Spread

CHROMIUM = os.environ.get("DARBOUX_CHROMIUM") or next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
SIZES = ((1280, 800), (900, 600))
LEAST = 20.0  # frames/s
MOVES, MOST, SHARE = 60, 6, 0.6  # of the mouse in a second, and on their way; of the track
COUNT = """() => {
    const scene = document.querySelector(".dx-scene");
    let last = scene.dataset.frames;
    window.times = [];
    const drawn = () => {
        if (scene.dataset.frames !== last) window.times.push(performance.now());
        last = scene.dataset.frames;
    };
    new MutationObserver(drawn).observe(scene, { attributes: true, attributeFilter: ["data-drawn"] });
}"""


def rows(quick: bool) -> Iterator[Row | str]:
    if CHROMIUM is None or find_spec("playwright") is None or find_spec("nicegui") is None:
        yield "The page was not timed: that takes Chromium (DARBOUX_CHROMIUM may name one), Playwright and the extra [web]."
        return
    with _served() as (server, address):
        for width, height in SIZES:
            times, ours, theirs = asyncio.run(_dragged(address, width, height, 4.0 if quick else 12.0, server))
            each = np.array([np.sum((times > t) & (times <= t + 1.0)) for t in np.arange(0.0, times[-1] - 1.0, 0.5)])
            yield Row(
                f"page.drag_{width}",
                f"a slider is dragged, {width} x {height}: from one new shape to the next",
                Spread.of(1e3 / np.maximum(each, 0.5)),
                "ms",
                most=1e3 / LEAST,
                note=f"{len(times) / times[-1]:.1f} frames/s; a frame takes {ours:.0f} ms of the server's processor time, "
                f"{theirs:.0f} ms of the browser's; load {os.getloadavg()[0]:.1f}",
            )


async def _dragged(address: str, width: int, height: int, seconds: float, server: int) -> tuple[Any, float, float]:
    """Return when new shapes were drawn, in s, and the processor's time per shape of server and browser in ms."""
    from playwright.async_api import async_playwright

    async with async_playwright() as driver:
        browser = await driver.chromium.launch(
            executable_path=CHROMIUM, args=["--no-sandbox", "--enable-unsafe-swiftshader"]
        )
        tab = await browser.new_page(viewport={"width": width, "height": height})
        await tab.goto(address)
        await tab.wait_for_selector(".dx-good")
        await tab.wait_for_timeout(2000)
        box = await tab.locator('[data-key="length"] .q-slider').bounding_box()
        x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
        await tab.mouse.move(x, y)
        await tab.mouse.down()
        await tab.evaluate(COUNT)
        mouse, under_way, before = await tab.context.new_cdp_session(tab), set(), _processor_time()
        clock = asyncio.get_running_loop().time
        began = clock()
        first = await tab.evaluate("performance.now()")
        while (t := clock() - began) < seconds:
            place = abs((t / SHARE) % 2.0 - 1.0) - 0.5
            event = {
                "type": "mouseMoved",
                "x": x + SHARE * place * box["width"],
                "y": y,
                "button": "left",
                "buttons": 1,
            }
            if len(under_way) < MOST:
                under_way.add(asyncio.create_task(mouse.send("Input.dispatchMouseEvent", event)))
            await asyncio.sleep(1.0 / MOVES)
            under_way = {task for task in under_way if not task.done()}
        times = 1e-3 * (np.array(await tab.evaluate("times")) - first)
        after = _processor_time()
        await browser.close()
    spent = {pid: time - before.get(pid, (0.0, ""))[0] for pid, (time, _) in after.items()}
    theirs = sum(spent[pid] for pid, (_, words) in after.items() if "chrom" in words)
    return times, 1e3 * spent[server] / len(times), 1e3 * theirs / len(times)


def _processor_time() -> dict[int, tuple[float, str]]:
    """Return the processor's time in s, and the command, of this process and all below it; only Linux tells."""
    found, parents = {}, {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
            command = (folder / "cmdline").read_text().partition("\0")[0]
        except OSError:  # it has ended
            continue
        parents[int(folder.name)] = int(fields[1])
        found[int(folder.name)] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK"), command

    def ours(pid: int) -> bool:
        return pid == os.getpid() or (pid in parents and ours(parents[pid]))

    return {pid: values for pid, values in found.items() if ours(pid)}


@contextmanager
def _served() -> Iterator[tuple[int, str]]:
    """Lend the process and the address of a server."""
    words = [sys.executable, "-c", "from darboux.cli import main; main()", "serve", "--port", "0"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            assert process.stdout is not None
            line = process.stdout.readline()
            address = re.search(r"http://\S+", line)
            if not address:
                raise RuntimeError(f"darboux serve did not start: {line}")
            yield process.pid, address[0]
        finally:
            process.kill()
