"""The page: controls, the rod, numbers and plots of one visitor; nothing that happens to it leaves this page."""

from __future__ import annotations

import asyncio
import tempfile
from collections import deque
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nicegui import Client, background_tasks, ui
from nicegui.elements.mixins.disableable_element import DisableableElement
from nicegui.elements.mixins.value_element import ValueElement

from darboux import scenario, store
from darboux.errors import InvalidInput
from darboux.scenario import Scenario
from darboux.web import link, quantities, words
from darboux.web.link import View
from darboux.web.plots import Plots
from darboux.web.quantities import Quantity
from darboux.web.rod_scene import RodScene
from darboux.web.session import Failure, Frame, Session, Theory
from darboux.web.shape import Outline, Shape, outline, unloaded
from darboux.web.workers import Workers

CSS = (Path(__file__).parent / "page.css").read_text(encoding="utf-8")
STEPS = 1000  # of a slider
OFTEN = 0.03  # s between a slider's messages
AHEAD = 2  # frames on their way to the browser
PATIENCE = 2.0  # s after which a frame counts as lost
PICTURE = 1.0 / 30.0  # s that a picture of a snap is shown
SPOKEN = 0.25  # s between two sets of numbers and plots while a slider moves: no eye reads faster
REMEMBERED = 8.0  # s that a snap is spoken of
BUSY = 0.25  # s after which a solve is seen to be under way
QUIET = 0.4  # s of rest after which the address is brought up to date
COLOURS = ("#e69f00", "#009e73", "#cc79a7")  # of the other theories
OWN = ""  # the choice that is a scenario which the visitor brought
WAITING = "Solving: a first solve, or a hard one, takes a few seconds."


@dataclass(frozen=True)
class Entry:
    """A scenario on offer: its ``title`` in the list, and what it holds."""

    title: str
    scenario: Scenario


class Slider(ValueElement[float], DisableableElement):
    """Quasar's slider, whose thumb the browser moves by itself and which speaks often enough for an animation."""

    LOOPBACK = None  # else the browser lays the whole page anew for each message

    def __init__(self, value: float, on_change: Any) -> None:
        super().__init__(tag="q-slider", value=value, on_value_change=on_change, throttle=OFTEN)
        self.props(f":min=0 :max={STEPS} :step=1 thumb-size=14px track-size=3px")


class Control:
    """A slider and a field for one number, with the sentence that says what is wrong."""

    def __init__(self, page: Page, quantity: Quantity) -> None:
        self.page, self.quantity = page, quantity
        value = page.session.wanted[quantity.key]
        unit = quantities.pretty(quantity.unit)
        self.at = self._place(value)
        with ui.element("div").classes("dx-row").props(f'data-key="{quantity.key}"'):
            ui.label(quantity.label).classes("dx-label")
            self.slider = Slider(self.at, self._slid).props(f'aria-label="{quantity.label}"')
            self.field = ui.input(value=quantity.text(value)).classes("dx-field")
            self.field.props(
                f'dense filled hide-bottom-space suffix="{unit}" aria-label="{quantity.label} in {quantity.unit or "1"}"'
            )
            self.field.on("keydown.enter", self._typed).on("blur", self._typed)
            self.wrong = ui.label("").classes("dx-wrong").props("role=alert")

    def _place(self, value: float) -> float:
        return float(min(max(round(STEPS * self.quantity.place(value)), 0), STEPS))

    def _slid(self, event: Any) -> None:
        if event.value == self.at:
            return
        self.at = event.value
        self._ask(self.quantity.at(self.at / STEPS))
        self.page.moved.add(self)

    def show(self) -> None:
        """Bring the field up to the slider, or to the last value that could be taken."""
        self.field.set_value(self.quantity.text(self.quantity.at(self.at / STEPS)))

    def _typed(self) -> None:
        text = self.field.value or ""
        if text == self.quantity.text(self.page.session.wanted[self.quantity.key]):
            self.say("")
            return
        try:
            value = self.quantity.read(text)
        except InvalidInput as error:
            self.say(str(error))
            return
        if self._ask(value):
            self.at = self._place(value)
            self.slider.set_value(self.at)
            self.field.set_value(self.quantity.text(value))

    def _ask(self, value: float) -> bool:
        sentence = self.page.session.ask(self.quantity.key, value)
        self.say(sentence)
        if not sentence:
            self.page.changed()
        return not sentence

    def say(self, sentence: str) -> None:
        """Show what is wrong, or that nothing is."""
        if self.wrong.text != sentence:
            self.wrong.set_text(sentence)
            self.field.classes(**({"add": "dx-amiss"} if sentence else {"remove": "dx-amiss"}))


class Page:
    """One visitor's page."""

    def __init__(
        self, client: Client, shelf: Mapping[str, Entry], workers: Workers, parameters: Mapping[str, str]
    ) -> None:
        self.client, self.shelf, self.workers = client, shelf, workers
        self.wake, self.arrived = asyncio.Event(), asyncio.Event()
        self.sent = self.received = self.generation = 0
        self.outline: Outline | None = None
        self.frame: Frame | None = None
        self.camera: tuple[float, ...] = ()
        self.untold: Frame | None = None
        self.moved: set[Control] = set()  # whose fields are not up to their sliders yet
        self.snapped = "", 0.0  # what was last said of a snap, and until when it stands
        self.grey = self.overlaid = False
        self.laid: Any = None  # what the unloaded rod was last drawn for
        self.told = 0.0
        self.text = ""  # of a scenario that the visitor brought
        self.drawn: deque[float] = deque(maxlen=20)
        complaint = ""
        try:
            self.view = link.view(parameters)
        except InvalidInput as error:
            self.view, complaint = View(), str(error)
        self._laid_out()
        complaint = self._first() or complaint
        if complaint:
            ui.notify(complaint[:1].upper() + complaint[1:], type="warning", timeout=9000, multi_line=True)
        client.on_delete(self.wake.set)  # so that the work ends with the page
        background_tasks.create(self._work(), name="a rod")

    # -- what there is to see ------------------------------------------------------------------------------------------

    def _laid_out(self) -> None:
        ui.add_css(CSS)
        self.mode = ui.dark_mode(self.view.dark)
        with ui.element("div").classes("dx-whole"):
            with ui.element("div").classes("dx-top"):
                self._bar()
            self.left = ui.element("div").classes("dx-left").props('role=region aria-label="what can be changed"')
            with ui.element("div").classes("dx-middle"):
                self.scene = RodScene(self._received, self._seen)
                self.scene.classes("dx-scene")
                self.note = ui.label("").classes("dx-note")
                with ui.button(icon="fit_screen", on_click=self._fit).props("flat dense color=grey").classes("dx-tool"):
                    ui.tooltip("Show all of the rod")
                with ui.element("div").classes("dx-said").props('role=status aria-live="polite"'):
                    self.busy = ui.element("div").classes("dx-busy")
                    self.busy.set_visibility(False)
                    self.state = ui.label(WAITING).classes("dx-state dx-unknown")
                    self.detail = ui.label("").classes("dx-detail")
            with ui.element("div").classes("dx-right").props('role=region aria-label="numbers and plots"'):
                self.numbers = ui.element("div").classes("dx-numbers")
                self.values: dict[str, ui.label] = {}
                self.theories = ui.element("div").classes("dx-theories")
                self.theories.set_visibility(self.view.theories)
                self.plots = Plots()

    def _bar(self) -> None:
        ui.label("darboux").classes("dx-name")
        self.titles = {name: entry.title for name, entry in self.shelf.items()}
        self.choice = ui.select(self.titles, on_change=self._chosen).props(
            'dense outlined options-dense aria-label="scenario"'
        )
        self.choice.style("width: 190px; flex: none")
        self.upload = ui.upload(
            auto_upload=True, max_file_size=scenario.LARGEST, on_upload=self._brought, on_rejected=self._refused
        ).props("accept=.toml")
        self._button("folder_open", "Open a scenario of yours", lambda: self.upload.run_method("pickFiles"))
        self.compare = ui.checkbox("three theories", value=self.view.theories, on_change=self._compared).props("dense")
        self.compare.tooltip("Solve by the other methods too, and draw them over the rod")
        ui.element("div").classes("dx-gap")
        self._button("restart_alt", "The scenario's own values", self._restored)
        self._button("description", "Save the scenario (TOML)", self._save_scenario)
        self._button("dataset", "Save the result (NetCDF)", self._save_result)
        self._button("image", "Save a picture (PNG)", self._save_picture)
        self._button("link", "Copy a link to this view", self._copy_link)
        self._button("contrast", "Dark or light", self._turned_dark)

    def _button(self, icon: str, words: str, action: Any) -> None:
        with ui.button(icon=icon, on_click=action).props(f'flat dense round color=grey aria-label="{words}"'):
            ui.tooltip(words)

    def _controls(self) -> None:
        """Lay the controls of the session's scenario."""
        self.left.clear()
        self.controls: dict[str, Control] = {}
        group = ""
        with self.left:
            if self.session.scenario.motion is not None:
                ui.label("Its motion is not shown here, only its equilibrium: darboux simulate.").classes("dx-about")
            for quantity in self.session.quantities:
                if quantity.group != group:
                    group = quantity.group
                    ui.label(group).classes("dx-group")
                self.controls[quantity.key] = Control(self, quantity)

    # -- which scenario ------------------------------------------------------------------------------------------------

    def _first(self) -> str:
        """Begin with what the link says; return what is wrong with that."""
        name, complaint = self.view.scenario, ""
        if self.view.text:
            try:
                self._begin("scenario", scenario.parse(self.view.text), self.view.text)
            except InvalidInput as error:
                complaint = f"the link's scenario can't be shown: {error}"
                name = ""
        if not self.view.text or complaint:
            if name and name not in self.shelf:
                complaint = f"there is no scenario {name!r} here; the first one is shown."
            name = name if name in self.shelf else next(iter(self.shelf))
            self._begin(name, self.shelf[name].scenario)
        said = self.session.ask_all({} if complaint else self.view.values)
        self._controls()
        if self.view.camera and not complaint:
            self.camera = self.view.camera
            self.scene.seen(self.camera)
        return complaint or " ".join(said)

    def _begin(self, name: str, stated: Scenario, text: str = "") -> None:
        self.session, self.text = Session(name, stated), text
        self.outline, self.frame, self.laid, self.camera = None, None, None, ()
        self.generation += 1
        self.chosen = OWN if text else name
        self.choice.set_options({OWN: name} | self.titles if text else self.titles, value=self.chosen)
        self._note()
        self.wake.set()

    def _chosen(self, event: Any) -> None:
        if event.value in self.shelf and event.value != self.chosen:
            self._begin(event.value, self.shelf[event.value].scenario)
            self._controls()

    async def _brought(self, event: Any) -> None:
        """Show the scenario of a file that the visitor brought: data, read as every scenario is."""
        self.upload.reset()
        name = Path(event.file.name).stem[:60] or "scenario"
        try:
            if event.file.size() > scenario.LARGEST:
                raise InvalidInput(_too_large())
            text = (await event.file.read()).decode("utf-8-sig")
            stated = await self.workers.run(scenario.parse, text)
        except (InvalidInput, UnicodeDecodeError) as error:
            self._say(f"{name}: {error if isinstance(error, InvalidInput) else 'it is no UTF-8 text.'}")
            return
        self._begin(name, stated, text)
        self._controls()

    def _refused(self) -> None:
        self._say(_too_large())

    # -- what a visitor does -------------------------------------------------------------------------------------------

    def changed(self) -> None:
        """Go for what is now asked."""
        self.generation += 1
        self.wake.set()

    def _restored(self) -> None:
        self._begin_again(self.session.scenario)

    def _begin_again(self, stated: Scenario) -> None:
        camera = self.camera
        self._begin(self.session.name, stated, self.text)
        self.camera = camera
        self._controls()

    def _compared(self) -> None:
        self.theories.set_visibility(self.compare.value)
        if not self.compare.value:
            self._bare()
        self.changed()

    def _bare(self) -> None:
        """Take the other theories' shapes away, which were those of other values."""
        if self.overlaid:
            self.overlaid = False
            self.scene.others([])
            self.theories.clear()

    def _fit(self) -> None:
        self.camera = ()
        self.scene.fit()

    def _seen(self, camera: tuple[float, ...]) -> None:
        self.camera = camera if len(camera) in (0, link.CAMERA) else ()
        self.wake.set()

    def _turned_dark(self) -> None:
        self.mode.set_value(not self.dark)
        self._painted()
        self.wake.set()

    @property
    def dark(self) -> bool:
        """Whether the page is dark."""
        return bool(self.mode.value)

    def _painted(self) -> None:
        self.scene.props["dark"] = self.dark
        self.plots.painted(self.dark)

    async def _save_scenario(self) -> None:
        with self._spoken():
            ui.download.content(self.session.result().toml, f"{self.session.name}.toml")

    async def _save_result(self) -> None:
        solution = self.session.shown
        if solution is None:
            self._say("There is no result to save yet.")
            return
        with self._spoken():
            ui.download.content(await self.workers.run(_file_of, solution), f"{self.session.name}.nc")

    def _save_picture(self) -> None:
        words = self.outline.words if self.outline else ""
        self.scene.picture(f"{self.session.name}.png", f"{self.session.name}: {words}" if words else self.session.name)

    def _copy_link(self) -> None:
        with self._spoken():
            query = self._query()
            ui.run_javascript(
                f"navigator.clipboard?.writeText(location.origin + location.pathname + {'?' + query!r})"
                ".catch(() => {}); history.replaceState(history.state, '', "
                f"{'?' + query!r})"
            )
            self._say("The link is copied; it stands in the address too.", "positive")

    def _query(self) -> str:
        dark = None if self.mode.value is None else self.dark
        session = self.session
        view = View(session.name, self.text, session.differences, self.camera, self.compare.value, dark)
        return link.query(view)

    def _spoken(self) -> Any:
        return _Spoken(self._say)

    def _say(self, sentence: str, kind: Any = "warning") -> None:
        with self.client:
            ui.notify(sentence[:1].upper() + sentence[1:], type=kind, timeout=7000, multi_line=len(sentence) > 60)

    # -- the work ------------------------------------------------------------------------------------------------------

    async def _work(self) -> None:
        """Solve what is asked for, one step after the other, and rest when all is shown."""
        await self.client.connected()
        await self._settle_mode()
        while not self._gone():
            await self.wake.wait()
            self.wake.clear()
            try:
                while self.session.pending and not self._gone():
                    await self._step(self.session)
                await self._at_rest()
            except asyncio.CancelledError:
                raise
            except Exception as error:  # noqa: BLE001  # whatever happens is said, and the page goes on
                if self._gone():
                    return
                self.session.given_up = self.session.wanted
                with self.client:
                    self._failed(f"A fault of darboux: {type(error).__name__}: {error}. Please report it.")

    def _gone(self) -> bool:
        """Return whether the visitor has left."""
        return self.client.is_deleted

    async def _settle_mode(self) -> None:
        """Learn from the browser whether it likes dark pages, where neither the link nor the visitor has said so."""
        with self.client:
            if self.mode.value is None:
                with suppress(TimeoutError):
                    wish = await ui.run_javascript("matchMedia('(prefers-color-scheme: dark)').matches", timeout=5)
                    self.mode.set_value(bool(wish))
            self._painted()

    async def _step(self, session: Session) -> None:
        later = asyncio.get_running_loop().call_later(BUSY, self._waiting)
        try:
            event, still = await self.workers.run(_solved, session, self.laid)
        finally:
            later.cancel()
        if self._gone():
            return
        with self.client:
            self.busy.set_visibility(False)
        if session is not self.session:
            return
        if isinstance(event, Failure):
            await self._tell()
            with self.client:
                self._failed(event.words)
            return
        await self._show(event, still)

    async def _show(self, frame: Frame, still: Shape | None) -> None:
        """Show a solution, after the way to it, and the unloaded rod."""
        problem, first, now = frame.solution.problem, self.frame is None, asyncio.get_running_loop().time()
        if first:
            self.relative_size = frame.shape.size / problem.rod.length
        size = self.relative_size * problem.rod.length
        section = outline(problem.rod, size)
        new = first or section != self.outline
        self.frame, self.outline = frame, section
        with self.client:
            self._bare()
            if frame.way:
                self.snapped = frame.words, now + REMEMBERED
                self.state.set_text("The rod snaps ...")
                self._state_class("unknown")
            for shape in frame.way:
                await self._sent(shape)
                await asyncio.sleep(PICTURE)
            self.scene.acting(problem, size)
            if first and not self.camera:
                self.scene.towards(frame.shape)
            laid = _unloaded_by(problem)
            await self._sent(frame.shape, section if new else None, (still,) if laid != self.laid else None)
            self.laid = laid
            self._greyed(False)
        self.untold = frame
        if now - self.told > SPOKEN:
            await self._tell()

    async def _tell(self) -> None:
        """Bring the fields, the words, the numbers and the plots up to what is shown."""
        for control in self.moved:
            control.show()
        self.moved.clear()
        if self.untold is None:
            return
        frame, self.untold = self.untold, None
        self.told = asyncio.get_running_loop().time()
        rows = await self.workers.run(_numbers, frame)
        with self.client:
            self.plots.show(frame.fields)
            text, kind = words.state(frame.solution)
            self.state.set_text(text)
            self._state_class(kind)
            sentence, until = self.snapped
            self.detail.set_text(sentence if self.told < until else words.how(frame.solution.status.message))
            self._numbered(rows)
            self._note()

    def _greyed(self, grey: bool) -> None:
        if grey != self.grey:
            self.grey = grey
            self.scene.greyed(grey)

    async def _sent(
        self, shape: Shape, section: Outline | None = None, still: tuple[Shape | None] | None = None
    ) -> None:
        """Send a shape, when the browser has taken those before."""
        while self.sent - self.received >= AHEAD:
            self.arrived.clear()
            try:
                await asyncio.wait_for(self.arrived.wait(), PATIENCE)
            except TimeoutError:
                self.received = self.sent
        self.sent += 1
        self.scene.frame(self.sent, shape, section, still)

    def _received(self, number: int) -> None:
        self.received = max(self.received, min(number, self.sent))
        self.drawn.append(asyncio.get_running_loop().time())
        self.arrived.set()

    def _failed(self, sentence: str) -> None:
        """Say why there is no new shape; the last one stays, in grey."""
        self.state.set_text(
            "No equilibrium was found here; the last shape stays, in grey."
            if self.frame
            else "No equilibrium was found."
        )
        self._state_class("bad")
        self.detail.set_text(words.failure(sentence))
        self._greyed(True)

    def _waiting(self) -> None:
        with self.client:
            self.busy.set_visibility(True)
            self.state.set_text(WAITING)
            self._state_class("unknown")

    def _state_class(self, kind: str) -> None:
        self.state.classes(replace=f"dx-state dx-{kind}")

    def _numbered(self, rows: list[tuple[str, str]]) -> None:
        if list(self.values) != [key for key, _ in rows]:  # a ring has a link
            self.numbers.clear()
            self.values.clear()
        for key, value in rows:
            if key not in self.values:
                with self.numbers:
                    ui.label(key).classes("dx-key")
                    self.values[key] = ui.label(value).classes("dx-value").props(f'data-number="{key}"')
            self.values[key].set_text(value)

    def _note(self) -> None:
        self.note.set_text(self.outline.words.capitalize() if self.outline else "")

    async def _undisturbed(self, seconds: float) -> bool:
        """Wait, and return whether nothing was asked meanwhile."""
        try:
            await asyncio.wait_for(self.wake.wait(), seconds)
        except TimeoutError:
            return not self._gone()
        return False

    async def _at_rest(self) -> None:
        """Compare the theories, where that is wanted, and bring the address up to date."""
        if not await self._undisturbed(SPOKEN):
            return
        if self.grey and self.session.values == self.session.wanted:  # back where there is a shape
            self.untold = self.frame
            with self.client:
                self._greyed(False)
        await self._tell()
        if not await self._undisturbed(QUIET):
            return
        generation = self.generation
        with self.client, suppress(InvalidInput):
            ui.run_javascript(f"history.replaceState(history.state, '', {'?' + self._query()!r})")
        if self.compare.value and self.session.shown is not None and not self.session.pending:
            with self.client:
                self.theories.clear()
                with self.theories:
                    ui.label("Solving by the other theories ...").classes("dx-detail")
            found = await self.workers.run(self.session.compare, self.session.shown)
            if generation == self.generation and not self._gone():
                with self.client:
                    self._overlaid(found)

    def _overlaid(self, found: list[Theory]) -> None:
        self.theories.clear()
        with self.theories:
            ui.label("Distance from the rod shown, over its length").classes("dx-detail")
            for colour, theory in zip(COLOURS, found, strict=True):
                with ui.element("div").classes("dx-theory"):
                    ui.element("div").classes("dx-swatch").style(
                        f"background: {colour if theory.shape else 'transparent'}"
                    )
                    ui.label(theory.name)
                    ui.label("" if theory.distance is None else f"{theory.distance:.1e}").classes("dx-value")
                    if theory.words:
                        ui.label(theory.words).classes("dx-words")
        self.overlaid = True
        self.scene.others(
            [(c, theory.shape) for c, theory in zip(COLOURS, found, strict=True) if theory.shape is not None]
        )


class _Spoken:
    """Say an ``InvalidInput`` instead of raising it."""

    def __init__(self, say: Any) -> None:
        self.say = say

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: Any, error: Any, traceback: Any) -> bool:
        if isinstance(error, InvalidInput):
            self.say(str(error))
            return True
        return False


def _solved(session: Session, laid: Any) -> tuple[Frame | Failure, Shape | None]:
    """Return the next step of a session, and the unloaded rod where that is another than the one for ``laid``."""
    event = session.step()
    if isinstance(event, Failure) or _unloaded_by(event.solution.problem) == laid:
        return event, None
    return event, unloaded(event.solution.problem)


def _numbers(frame: Frame) -> list[tuple[str, str]]:
    return words.numbers(frame.solution, frame.fields, frame.solution.energy.elastic)


def _unloaded_by(problem: Any) -> Any:
    """Return what the unloaded rod depends on."""
    return problem.rod.length, problem.rod.natural, problem.start, problem.end


def _file_of(solution: Any) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "result.nc"
        store.save(solution, path)
        return path.read_bytes()


def _too_large() -> str:
    return f"a scenario has at most {scenario.LARGEST // 1000} kB, and its name ends in .toml."
