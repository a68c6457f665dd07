"""The live page in a browser: headless Chromium opens what `darboux serve` serves."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import darboux as dx
from darboux import scenario

CHROMIUM = os.environ.get("DARBOUX_CHROMIUM") or next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
pytest.importorskip("nicegui", reason="the page needs the extra [web]")
playwright = pytest.importorskip("playwright.sync_api", reason="the page is tested by Playwright")
if CHROMIUM is None:
    pytest.skip("no Chromium is installed; DARBOUX_CHROMIUM may name one", allow_module_level=True)

FLAGS = ["--no-sandbox", "--enable-unsafe-swiftshader", "--disable-background-networking"]
PATIENCE = 30_000  # ms


@contextmanager
def served(port: int = 0) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Run the command; lend it and the page's address, when it can be opened."""
    words = [sys.executable, "-c", "from darboux.cli import main; main()", "serve", "--port", str(port)]
    own = {
        name: value for name, value in os.environ.items() if not name.startswith("PYTEST")
    }  # NiceGUI behaves otherwise
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=own | {"PYTHONUNBUFFERED": "1"}
    ) as process:
        try:
            line = process.stdout.readline()
            address = re.search(r"http://\S+", line)
            assert address, line + process.stdout.read()
            yield process, address[0].rstrip("/")
        finally:
            process.kill()


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with served() as (_, address):
        yield address


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture
def tab(browser: Any) -> Iterator[Any]:
    """A visitor of its own, who notes every address that is asked for and every fault of the page."""
    context = browser.new_context(viewport={"width": 1280, "height": 800})
    tab = context.new_page()
    tab.set_default_timeout(PATIENCE)
    tab.asked, tab.faults = [], []
    tab.on("request", lambda request: tab.asked.append(request.url))
    tab.on("pageerror", lambda fault: tab.faults.append(str(fault)))
    tab.on("console", lambda said: tab.faults.append(said.text) if "Content Security Policy" in said.text else None)
    yield tab
    context.close()
    assert tab.faults == []


def open_rod(tab: Any, address: str) -> None:
    tab.goto(address)
    tab.wait_for_selector(".dx-good")


def end(tab: Any) -> np.ndarray:
    """Return where the drawn rod's end is, in m."""
    return np.array([float(x) for x in tab.get_attribute(".dx-scene", "data-end").split()])


def number(tab: Any, name: str) -> str:
    return str(tab.inner_text(f'[data-number="{name}"]'))


def field(tab: Any, key: str) -> Any:
    return tab.locator(f'[data-key="{key}"] input')


def put(tab: Any, key: str, text: str) -> None:
    field(tab, key).fill(text)
    field(tab, key).press("Enter")


def drag(tab: Any, key: str, share: float) -> None:
    """Drag a slider's thumb from its middle by a share of its width."""
    box = tab.locator(f'[data-key="{key}"] .q-slider').bounding_box()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    tab.mouse.move(x, y)
    tab.mouse.down()
    for part in (0.3, 0.6, 1.0):
        tab.mouse.move(x + part * share * box["width"], y)
    tab.mouse.up()


def until_end(tab: Any, where: Any) -> None:
    """Wait until the drawn rod's end is there, to a millionth of a metre."""
    tab.wait_for_function(
        """([x, y, z]) => {
            const end = document.querySelector(".dx-scene")?.dataset.end?.split(" ").map(Number);
            return end && Math.hypot(end[0] - x, end[1] - y, end[2] - z) < 1e-6;
        }""",
        arg=[float(x) for x in where],
    )


def cantilever(length: float) -> dx.Equilibrium:
    rod = dx.Rod(length, dx.Circle(1e-3), dx.Material(E=1e6, nu=0.5, density=1e3))
    return dx.Equilibrium(rod, start=dx.Clamped(tangent=(1, 0, 0), d1=(0, 0, 1)), loads=[dx.Gravity()])


def test_a_slider_moves_the_rod_and_its_numbers_and_a_wrong_value_gets_its_sentence(tab: Any, address: str) -> None:
    open_rod(tab, address)
    until_end(tab, dx.solve(cantilever(0.25)).tip)
    before = number(tab, "end of the rod")
    assert "cm" in before
    drag(tab, "length", 0.25)
    tab.wait_for_function(
        "text => document.querySelector('[data-number=\"end of the rod\"]').innerText !== text", arg=before
    )
    tab.wait_for_function("() => location.search.includes('length=')")  # the address follows when all is at rest
    length = float(re.search(r"length=([\d.e-]+)", tab.url)[1])
    assert 0.3 < length < 0.6
    until_end(tab, dx.solve(cantilever(length)).tip)
    assert float(field(tab, "length").input_value()) == pytest.approx(100 * length, rel=1e-4)
    assert "Stable" in tab.inner_text(".dx-said")

    put(tab, "length", "30 kg")
    wrong = tab.locator('[data-key="length"] [role=alert]')
    playwright.expect(wrong).to_contain_text("its unit 'kg' is of another kind")
    put(tab, "radius", "-1")
    playwright.expect(tab.locator('[data-key="radius"] [role=alert]')).to_contain_text("it must be positive")
    until_end(tab, dx.solve(cantilever(length)).tip)  # the page goes on with the last value that can be
    put(tab, "length", "0.3 m")
    playwright.expect(wrong).to_be_empty()
    until_end(tab, dx.solve(cantilever(0.3)).tip)
    home = re.match(r"http://[^/]+", address)[0]
    assert all(url.startswith((home, home.replace("http", "ws"), "data:", "blob:")) for url in tab.asked)


def answer(address: str, path: str = "/", **headers: str) -> tuple[int, dict[str, str]]:
    """Return status and headers of what the server answers to a request with these headers."""
    import http.client

    with closing(http.client.HTTPConnection("127.0.0.1", int(address.rpartition(":")[2]), timeout=60)) as connection:
        connection.putrequest("GET", path, skip_host=True)
        for name, value in ({"Host": address.removeprefix("http://")} | headers).items():
            connection.putheader(name.replace("_", "-"), value)
        connection.endheaders()
        with connection.getresponse() as response:
            return response.status, {name.lower(): value for name, value in response.getheaders()}


def test_a_foreign_page_gets_no_answer_and_no_socket(address: str) -> None:
    status, headers = answer(address)
    assert status == 200
    assert "default-src 'self'" in headers["content-security-policy"]
    assert "frame-ancestors 'none'" in headers["content-security-policy"]
    assert headers["x-content-type-options"] == "nosniff"
    port = address.rpartition(":")[2]
    socket = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
    upgrade = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec_WebSocket_Version": "13"}
    upgrade |= {"Sec_WebSocket_Key": "MDEyMzQ1Njc4OTAxMjM0NQ=="}
    assert answer(address, socket, **upgrade, Origin=address)[0] == 101
    for headers in (
        {"Origin": "http://elsewhere.example"},
        {"Origin": "null"},
        {"Origin": "http://localhost:1"},
        {"Host": "elsewhere.example"},
        {"Host": f"elsewhere.example:{port}", "Origin": f"http://elsewhere.example:{port}"},  # DNS rebinding
    ):
        for path, more in (("/", {}), (socket, upgrade), (socket.replace("websocket", "polling"), {})):
            assert answer(address, path, **more, **headers)[0] == 403


def test_the_slider_with_the_focus_is_seen_and_the_keyboard_moves_it(tab: Any, address: str) -> None:
    open_rod(tab, address)
    for _ in range(40):
        tab.keyboard.press("Tab")
        if "q-slider" in str(tab.evaluate("document.activeElement.className")):
            break
    outline = "getComputedStyle(document.activeElement.closest('.q-slider').querySelector('.q-slider__thumb')).outline"
    assert "solid 2px" in tab.evaluate(outline)
    before = field(tab, "length").input_value()
    tab.keyboard.press("ArrowRight")
    tab.wait_for_function("text => document.querySelector('[data-key=length] input').value !== text", arg=before)


def test_two_tabs_a_reload_and_a_link(tab: Any, browser: Any, address: str) -> None:
    context = browser.new_context()
    other = context.new_page()
    other.set_default_timeout(PATIENCE)
    open_rod(tab, f"{address}/?length=0.2")
    open_rod(other, f"{address}/?length=0.4&dark=1&camera=0,-1,0,0,0,0,0.7")
    put(tab, "E", "2")
    tab.wait_for_function("() => location.search.includes('E=')")
    until_end(other, dx.solve(cantilever(0.4)).tip)
    short = end(tab)
    assert np.linalg.norm(short - dx.solve(cantilever(0.2)).tip) > 1e-3  # stiffer now
    assert tab.evaluate("document.body.classList.contains('body--dark')") is False
    assert other.evaluate("document.body.classList.contains('body--dark')") is True
    tab.reload()
    until_end(tab, short)
    other.goto(tab.url)
    until_end(other, short)
    context.close()


def test_a_link_that_is_none_shows_the_first_rod_and_says_so(tab: Any, address: str) -> None:
    open_rod(tab, f"{address}/?scenario=nothing&length=long")
    playwright.expect(tab.locator(".q-notification")).to_contain_text("it must be a number")
    until_end(tab, dx.solve(cantilever(0.25)).tip)


def test_another_scenario_the_theories_and_the_files(tab: Any, address: str, tmp_path: Path) -> None:
    open_rod(tab, f"{address}/?scenario=spinning&theories=1")
    playwright.expect(tab.locator(".dx-theory")).to_have_count(3, timeout=PATIENCE)
    said = tab.inner_text(".dx-theories")
    assert re.search(r"Shooting\(\)\s+\d\.\de-\d\d", said)
    assert "Elastica states planar, inextensible rods" in said
    with tab.expect_download() as download:
        tab.get_by_label("Save the scenario (TOML)").click()
    download.value.save_as(tmp_path / "rod.toml")
    saved = dx.load(tmp_path / "rod.toml")
    assert saved.loads[0].omega == pytest.approx((0, 0, 400 * 2 * np.pi / 60))
    with tab.expect_download() as download:
        tab.get_by_label("Save the result (NetCDF)").click()
    download.value.save_as(tmp_path / "rod.nc")
    solution = dx.open(tmp_path / "rod.nc")
    assert solution.problem == saved
    until_end(tab, solution.r(saved.rod.length))
    with tab.expect_download() as download:
        tab.get_by_label("Save a picture (PNG)").click()
    download.value.save_as(tmp_path / "rod.png")
    from matplotlib.image import imread

    picture = imread(tmp_path / "rod.png")[..., :3]
    assert picture.shape[0] > 800
    blue = (picture[..., 2] > picture[..., 0] + 0.3).sum()  # the rod's colour
    assert blue > 2000


def test_what_a_visitor_brings_is_read_as_data(tab: Any, address: str, tmp_path: Path) -> None:
    open_rod(tab, address)
    scenario.Scenario(cantilever(0.35)).write(tmp_path / "mine.toml")
    files = tab.locator("input[type=file]")
    files.set_input_files(tmp_path / "mine.toml")
    until_end(tab, dx.solve(cantilever(0.35)).tip)
    tab.wait_for_function("() => location.search.includes('text=')")  # the link carries it
    (tmp_path / "worse.toml").write_text("[rod]\nlength = '35 kg'\n")
    files.set_input_files(tmp_path / "worse.toml")
    playwright.expect(tab.locator(".q-notification").last).to_contain_text("line 2: rod.length is '35 kg'")
    (tmp_path / "large.toml").write_text("#" * (scenario.LARGEST + 1))
    files.set_input_files(tmp_path / "large.toml")
    playwright.expect(tab.locator(".q-notification").last).to_contain_text("at most 300 kB")
    until_end(tab, dx.solve(cantilever(0.35)).tip)


@pytest.mark.parametrize(("width", "height"), [(375, 700), (600, 500), (1280, 800)])
def test_the_axes_keep_clear_of_the_rod(tab: Any, address: str, width: int, height: int, tmp_path: Path) -> None:
    tab.set_viewport_size({"width": width, "height": height})
    open_rod(tab, address)  # a rod that hangs low and left
    until_end(tab, dx.solve(cantilever(0.25)).tip)
    tab.wait_for_timeout(600)  # until it is drawn finely
    scene = tab.locator(".dx-scene").bounding_box()
    tab.screenshot(path=tmp_path / "page.png")
    from matplotlib.image import imread

    picture = imread(tmp_path / "page.png")[..., :3]
    blue = picture[..., 2] > picture[..., 0] + 0.25
    left, below, size = map(float, tab.get_attribute(".dx-scene", "data-corner").split())
    x, y = int(scene["x"] + left), int(scene["y"] + scene["height"] - below - size)
    assert size > 60.0
    assert not np.any(blue[y : y + int(size), x : x + int(size)])
    middle = blue[
        int(scene["y"]) : int(scene["y"] + scene["height"]), int(scene["x"]) : int(scene["x"] + scene["width"])
    ]
    assert np.sum(middle) > 0.5 * scene["height"]  # it is seen


def test_on_a_phone_the_rod_stays_in_sight_of_its_sliders(tab: Any, address: str) -> None:
    tab.set_viewport_size({"width": 375, "height": 700})
    open_rod(tab, address)
    assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth")
    before = end(tab)
    tab.evaluate("""() => document.querySelector('[data-key="load1.g.x"]').scrollIntoView()""")
    drag(tab, "load1.g.x", 0.25)
    tab.wait_for_function("() => location.search.includes('load1.g.x=')")
    assert np.linalg.norm(end(tab) - before) > 1e-3
    scene = tab.locator(".dx-scene").bounding_box()
    assert -1.0 <= scene["y"] <= scene["y"] + scene["height"] <= 700.0
    assert scene["height"] > 200.0
    row = tab.locator('[data-key="load1.g.x"]').bounding_box()
    assert row["y"] > scene["y"] + scene["height"]


def test_a_hard_solve_is_seen_to_be_under_way_and_others_do_not_wait(tab: Any, browser: Any, address: str) -> None:
    open_rod(tab, f"{address}/?scenario=ring")
    context = browser.new_context()
    other = context.new_page()
    open_rod(other, address)
    put(tab, "link", "3.4")  # beyond where the ring turns unstable
    tab.wait_for_selector(".dx-busy", state="visible")
    assert "Solving" in tab.inner_text(".dx-said")
    put(other, "length", "0.3 m")
    until_end(other, dx.solve(cantilever(0.3)).tip)
    tab.wait_for_selector(".dx-busy", state="hidden")
    playwright.expect(tab.locator(".dx-good")).to_be_visible()
    playwright.expect(tab.locator('[data-number="link"]')).to_have_text("1.4 turns: it passed through itself")
    context.close()


def test_a_page_survives_its_server(tab: Any) -> None:
    with served() as (process, address):
        open_rod(tab, address)
        put(tab, "length", "0.3 m")
        tab.wait_for_function("() => location.search.includes('length=')")
        process.kill()
        process.wait()
        playwright.expect(tab.locator("#popup")).to_be_visible()
        until_end(tab, dx.solve(cantilever(0.3)).tip)  # what was there stays
        with served(int(address.rpartition(":")[2])):  # and comes back with its values when the server does
            playwright.expect(tab.locator("#popup")).not_to_be_visible(timeout=PATIENCE)
            tab.wait_for_selector(".dx-good")
            until_end(tab, dx.solve(cantilever(0.3)).tip)
            put(tab, "length", "0.35 m")
            until_end(tab, dx.solve(cantilever(0.35)).tip)


def test_a_filament_of_micrometres_is_drawn_as_any_rod_in_its_own_units(tab: Any, address: str, tmp_path: Path) -> None:
    rod = dx.Rod(10e-6, dx.Circle(3.5e-9), dx.Material(E=1.8e9, nu=0.3, density=1300))
    pulled = dx.Equilibrium(rod, start=dx.Clamped(tangent=(0, 0, 1)), loads=[dx.EndForce((2e-12, 1e-12, -5e-13))])
    scenario.Scenario(pulled).write(tmp_path / "filament.toml")
    open_rod(tab, address)
    tab.locator("input[type=file]").set_input_files(tmp_path / "filament.toml")
    playwright.expect(field(tab, "load1.force.x")).to_have_value("2")
    assert tab.inner_text('[data-key="load1.force.x"] .q-field__suffix') == "pN"
    playwright.expect(tab.locator('[data-number="largest |k|"]')).to_contain_text("1/\N{MICRO SIGN}m")
    assert "filament" in tab.inner_text(".dx-top")
    tab.wait_for_timeout(600)
    tab.locator(".dx-scene").screenshot(path=tmp_path / "scene.png")
    from matplotlib.image import imread

    picture = imread(tmp_path / "scene.png")[..., :3]
    blue, orange = (picture[..., i] > picture[..., 2 - i] + 0.25 for i in (2, 0))
    assert np.mean(blue) > 0.001
    assert 0.0 < np.mean(orange) < 0.02  # the arrow of the force


def test_ctrl_c_ends_the_server_and_an_open_page_says_so(tab: Any) -> None:
    with served() as (process, address):
        open_rod(tab, address)
        process.send_signal(signal.SIGINT)
        out = process.communicate(timeout=30)[0]
        assert (process.returncode, out.strip()) == (0, "The page is closed.")
    playwright.expect(tab.locator("#popup")).to_be_visible()
    assert "cm" in number(tab, "end of the rod")  # what was there stays
