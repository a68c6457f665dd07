"""What the live page does without a browser: values to problems, links, steps and snaps, shapes, limits."""

from __future__ import annotations

import asyncio
import base64
import dataclasses
import math
import socket
from concurrent.futures import ThreadPoolExecutor
from importlib.resources import files
from pathlib import Path
from urllib.parse import parse_qsl

import numpy as np
import pytest

import darboux as dx
from darboux import scenario
from darboux.cli.new import TEMPLATES
from darboux.cli.serve import _shelf
from darboux.errors import InvalidInput
from darboux.scenario import Scenario
from darboux.statics.solve import solve
from darboux.web import link, quantities, server, shape, words
from darboux.web.link import View
from darboux.web.session import METHOD, Failure, Frame, Session
from darboux.web.workers import Workers


def stated(name: str) -> Scenario:
    return scenario.parse((files("darboux.cli") / "templates" / f"{name}.toml").read_text(encoding="utf-8"))


def rest(session: Session, most: int = 60) -> Frame | Failure:
    """Step until there is nothing left to do; return the last that was shown."""
    for _ in range(most):  # where all is shown, a step leaves it as it is
        shown = session.step()
        if not session.pending:
            return shown
    raise AssertionError("it goes on for ever")


# -- values ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TEMPLATES)
def test_every_number_of_a_scenario_can_be_changed_and_nothing_else_changes(name: str) -> None:
    problem = stated(name).problem
    found = quantities.of(problem)
    assert len({quantity.key for quantity in found}) == len(found) > 5
    assert quantities.changed(problem, found, {}) is problem
    for quantity in found:
        assert quantity.low < quantity.high
        assert quantity.at(quantity.place(quantity.value)) == pytest.approx(quantity.value, rel=1e-12, abs=1e-12)
        assert quantity.read(quantity.text(quantity.value)) == pytest.approx(quantity.value, rel=1e-4)
        value = quantity.at(quantity.place(quantity.value) - 0.01)
        changed = quantities.changed(problem, found, {quantity.key: value})
        again = {other.key: other.value for other in quantities.of(changed)}
        assert again.pop(quantity.key) == pytest.approx(value, rel=1e-12)
        assert again == {other.key: other.value for other in found if other.key != quantity.key}


def test_values_go_where_they_belong() -> None:
    problem = stated("cantilever").problem
    values = {"length": 0.5, "radius": 2e-3, "E": 2e6, "k0.2": 3.0, "load1.g.z": -1.6}
    changed = quantities.changed(problem, quantities.of(problem), values)
    rod = dx.Rod(0.5, dx.Circle(2e-3), dx.Material(E=2e6, nu=0.5, density=1e3), natural=(0, 3, 0))
    assert changed == dx.Equilibrium(rod, start=dataclasses.replace(problem.start), loads=[dx.Gravity((0, 0, -1.6))])
    strip = stated("clamped-clamped").problem
    moved = quantities.changed(strip, quantities.of(strip), {"distance": 0.1, "rotation": 1.0})
    assert moved.end.position == (0.0, 0.0, 0.1)
    assert moved.end.twist == 1.0
    ring = quantities.changed(stated("ring").problem, quantities.of(stated("ring").problem), {"link": 1.0})
    assert ring == dx.Ring(ring.rod, link=1.0)


def test_what_is_tied_to_the_length_keeps_it() -> None:
    rod = dx.Rod(1.0, dx.Circle(dx.Table([0, 1], [1e-3, 2e-3])), "steel")
    keys = {quantity.key for quantity in quantities.of(dx.Equilibrium(rod, loads=[dx.Gravity()]))}
    assert keys == {"E", "density", "k0.1", "k0.2", "k0.3", "load1.g.x", "load1.g.y", "load1.g.z"}


@pytest.mark.parametrize(
    ("text", "value"), [("30", 0.30), ("0.3 m", 0.30), (" 300 mm ", 0.30), ("3e1", 0.30), ("1 ft", 0.3048)]
)
def test_what_may_be_typed(text: str, value: float) -> None:
    length = quantities.of(stated("cantilever").problem)[0]
    assert length.unit == "cm"
    assert length.read(text) == pytest.approx(value, rel=1e-12)


def test_boundary_layers_are_plotted_as_they_are() -> None:
    """A rod that is pulled hard: bent over sqrt(EI / F) = L / 200 at its clamps, M = sqrt(EI F) phi exp(-s / that)."""
    EI, F, phi, layer = 1.0, 4e4, 0.02, 1.0 / 200.0
    rod = dx.Rod(1.0, dx.Stiffness(EI1=EI, GJ=1.0))
    pulled = dx.Equilibrium(rod, dx.Clamped(tangent=(np.sin(phi), 0, np.cos(phi))), loads=[dx.EndForce((0, 0, F))])
    _, fields = shape.sampled(dx.solve(pulled, METHOD))
    s = np.linspace(0.0, 8.0 * layer, 400)
    drawn = np.interp(s, fields.s, np.linalg.norm(fields.M, axis=1))
    exact = np.sqrt(EI * F) * phi * np.exp(-s / layer)
    np.testing.assert_allclose(drawn, exact, atol=0.03 * exact[0])
    assert len(fields.s) < 400


def test_who_is_let_in_over_a_network() -> None:
    def in_by(host: str, *headers: tuple[str, str]) -> bool:
        return server.Guarded(None, host)._is_ours([(name.encode(), value.encode()) for name, value in headers])

    for name in ("localhost:8080", "127.0.0.1:8080", "[::1]:8080", "LOCALHOST"):
        assert in_by("127.0.0.1", ("host", name))
        assert in_by("127.0.0.1", ("host", name), ("origin", f"http://{name.lower()}"))
    for name in ("10.0.0.7:8080", "[fe80::1]:8080"):
        assert in_by("0.0.0.0", ("host", name))
        assert not in_by("127.0.0.1", ("host", name))
    assert not in_by("0.0.0.0", ("host", "elsewhere.example:8080"))
    assert not in_by("127.0.0.1", ("host", "localhost"), ("host", "elsewhere.example"))
    assert not in_by("127.0.0.1", ("host", "localhost"), ("origin", "http://localhost"), ("origin", "http://a.example"))
    assert not in_by("127.0.0.1")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("30 kg", "length is '30 kg'; its unit 'kg' is of another kind"),
        ("long", "length is 'long'; it must be a number in cm"),
        ("", "length is empty; give a number in cm."),
        ("-5", "length is -5 cm; it must be positive."),
        ("0", "length is 0 cm; it must be positive."),
        ("nan", "it must be"),
        ("inf", "it must be"),
        ("1e300", "on this page it lies between"),
        ("1e-9", "on this page it lies between"),
        ("__import__('os').system('true')", "it must be a number in cm"),
    ],
)
def test_what_may_not_be_typed_is_said(text: str, sentence: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        quantities.of(stated("cantilever").problem)[0].read(text)
    assert sentence in str(caught.value)


def test_readable_units() -> None:
    assert quantities.readable(1.234e-4, "N m") == "123.4 \N{MICRO SIGN}N m"
    assert quantities.readable(0.0, "J") == "0 J"
    assert quantities.readable(2.5e-2, "m") == "2.5 cm"
    assert quantities.readable(1.09e-18, "N m") == "1.09 aN m"
    assert quantities.readable(5.13e6, "1/m") == "5.13 1/\N{MICRO SIGN}m"
    assert quantities.pretty("kg/m^3") == "kg/m\N{SUPERSCRIPT THREE}"


# -- links -------------------------------------------------------------------------------------------------------------


def _parameters(query: str) -> dict[str, str]:
    return dict(parse_qsl(query))


def test_a_link_says_what_it_was_made_of() -> None:
    one = View(
        "helix", "", {"load2.force.z": -1.0 / 3.0, "E": 2e11}, (0.1, -1.0, 0.25, 0.0, 0.5, 1.0, 0.125), True, False
    )
    assert link.view(_parameters(link.query(one))) == one
    other = View(text=stated("ring").toml + "# \N{GREEK SMALL LETTER PI} & more")
    assert link.view(_parameters(link.query(other))) == other
    assert link.view({}) == View()


@pytest.mark.parametrize(
    "parameters",
    [
        {"length": "nan"},
        {"length": "1e999"},
        {"length": "long"},
        {"<script>": "1"},
        {"camera": "1,2,3"},
        {"camera": "0,0,0,0,0,0,1"},
        {"camera": "1,0,0,0,0,0,-1"},
        {"text": "no base 64!"},
        {"text": "aGVsbG8="},
        {"scenario": "x" * (link.LONGEST + 1)},
        {f"k{i}": "1" for i in range(200)},
    ],
)
def test_a_link_that_is_none_is_refused_in_a_sentence(parameters: dict[str, str]) -> None:
    with pytest.raises(InvalidInput, match=r"^the link"):
        link.view(parameters)


def test_a_link_s_scenario_is_bounded_both_ways() -> None:
    with pytest.raises(InvalidInput, match="longer than a link"):
        link.view({"text": link._packed("#" * (link.LONGEST_TEXT + 1))})
    noise = "".join(np.random.default_rng(1).choice(list("0123456789abcdef"), 20_000))
    with pytest.raises(InvalidInput, match="too long for a link"):
        link.query(View(text=noise))


# -- steps -------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def cantilever() -> Session:
    session = Session("cantilever", stated("cantilever"))
    rest(session)
    return session


def test_a_step_ends_where_a_cold_solve_does(cantilever: Session) -> None:
    assert cantilever.ask("length", 0.4) == cantilever.ask("load1.g.x", 3.0) == ""
    shown = rest(cantilever)
    assert isinstance(shown, Frame)
    assert cantilever.values == cantilever.wanted
    assert cantilever.differences == {"length": 0.4, "load1.g.x": 3.0}
    cold = solve(cantilever.problem)
    s = np.linspace(0.0, 0.4, 9)
    assert shown.solution.problem == cold.problem == cantilever.result().problem
    assert np.max(np.abs(shown.solution.r(s) - cold.r(s))) < 1e-6 * 0.4
    assert shown.way == ()


def test_what_can_t_be_is_said_and_not_taken(cantilever: Session) -> None:
    before = dict(cantilever.wanted)
    assert "must be positive" in cantilever.ask("radius", -1e-3)
    assert "on this page it lies between" in cantilever.ask("E", 1e30)
    assert cantilever.ask_all({"radius": 2e-3, "E": -1e6, "nothing": 1.0}) == [
        "cantilever has no 'nothing'.",
        "modulus E is -1 MPa; it must be positive.",
    ]
    assert cantilever.wanted == before | {"radius": 2e-3}
    strip = Session("strip", stated("clamped-clamped"))
    assert "the ends are 0.5 m apart, but the rod is 0.3 m long" in strip.ask("distance", 0.5)
    assert strip.ask_all({"distance": 0.5, "length": 0.6}) == []  # together they can be


def test_a_solve_that_fails_keeps_the_last_shape(cantilever: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    rest(cantilever)
    shown, values = cantilever.shown, cantilever.values
    lost = dataclasses.replace(solve(cantilever.problem), status=dx.solution.Status("no_convergence", "it is lost."))
    monkeypatch.setattr("darboux.web.session.solve", lambda *args, **kwargs: lost)
    monkeypatch.setattr(type(METHOD), "beside", lambda *args: None)
    monkeypatch.setattr("darboux.web.session.snap.motion", lambda *args: None)
    cantilever.ask("length", 0.41)
    failed = rest(cantilever)
    assert failed == Failure("it is lost.")
    assert cantilever.shown is shown
    assert cantilever.values == values
    assert not cantilever.pending  # it is not tried for ever
    cantilever.ask("length", 0.42)
    assert cantilever.pending


def test_an_arch_snaps_through_in_motion_and_stays_there() -> None:
    session = Session("arch", stated("arch"))
    assert rest(session).solution.r(0.15)[2] > 0.04
    assert session.ask("load1.force.z", -6.0) == ""
    way = []
    while session.pending:
        shown = session.step()
        assert isinstance(shown, Frame)
        assert shown.solution.stable
        if shown.way:
            way.append(shown)
    (snap,) = way
    assert "motion" in snap.words
    assert -6.0 < snap.solution.problem.loads[0].force[2] < -5.0  # Newton's method finds it unstable from -5.55 N/m on
    heights = [picture.r[shape.SAMPLES // 2, 2] for picture in snap.way]
    assert heights[0] > 0.04
    assert heights[-1] < -0.04
    assert np.max(np.abs(np.diff(heights))) < 0.05  # pictures of one motion, no jump
    assert np.max(np.abs(snap.way[-1].r - snap.shape.r)) < 0.01 * 0.3  # which ends at the equilibrium
    session.ask("load1.force.z", 0.0)
    assert rest(session).solution.r(0.15)[2] < -0.04  # and unloaded it does not come back


def test_values_of_a_link_that_no_cold_solve_reaches_are_gone_to_from_the_scenario_s_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stays = dataclasses.replace(METHOD, stable=False)  # so that it ends at a fold
    monkeypatch.setattr("darboux.web.session.METHOD", stays)
    session = Session("ring", stated("ring"))
    assert session.ask_all({"link": 3.4, "k0.2": 30.0}) == []
    assert not solve(session.problem, stays, throw=False).converged
    first = session.step()
    assert isinstance(first, Frame)
    assert first.solution.problem == session.base
    assert session.pending


def test_several_visitors_do_not_disturb_each_other() -> None:
    def visit(length: float) -> np.ndarray:
        session = Session("cantilever", stated("cantilever"))
        rest(session)
        for part in (0.5, 1.0):
            session.ask("length", 0.25 + part * (length - 0.25))
            rest(session)
        return session.shown.curve.y

    lengths = [0.2, 0.3, 0.4, 0.5]
    alone = [visit(length) for length in lengths]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(visit, lengths))
    for one, other in zip(alone, together, strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_other_theories_agree_or_say_why_not() -> None:
    session = Session("cantilever", stated("cantilever"))
    shooting, elastica, discrete = session.compare(rest(session).solution)
    assert shooting.distance < 1e-6
    assert elastica.distance < 1e-6
    assert 1e-6 < discrete.distance < 0.03
    ring = Session("ring", stated("ring"))
    shooting, elastica, discrete = ring.compare(rest(ring).solution)
    for theory in (shooting, elastica):
        assert theory.shape is None
        assert "use Collocation" in theory.words
    assert 1e-6 < discrete.distance < 0.01


# -- shapes ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["cantilever", "clamped-clamped", "spinning", "helix"])
def test_what_is_drawn_is_the_solution(name: str) -> None:
    solution = rest(Session(name, stated(name))).solution
    drawn, fields = shape.sampled(solution)
    s = np.linspace(0.0, solution.problem.rod.length, shape.SAMPLES)
    np.testing.assert_allclose(drawn.r, solution.r(s), atol=1e-14)
    np.testing.assert_allclose(drawn.R, solution.R(s), atol=1e-14)
    np.testing.assert_allclose(fields.k, solution.k(fields.s), rtol=1e-9, atol=1e-9)
    moment = np.einsum("nji,nj->ni", solution.R(fields.s), solution.m(fields.s))
    np.testing.assert_allclose(fields.M, moment, rtol=1e-9, atol=1e-12 * np.max(np.abs(moment)))
    force = np.einsum("nji,nj->ni", solution.R(fields.s), solution.n(fields.s))
    work = moment * (fields.k - solution.problem.rod.k0(fields.s)) + force * (solution.v(fields.s) - [0, 0, 1])
    np.testing.assert_allclose(fields.e, 0.5 * work.sum(axis=1), rtol=1e-9, atol=1e-12 * np.max(fields.e))
    packed = np.frombuffer(base64.b64decode(drawn.packed), "<f4").reshape(-1, 9)
    np.testing.assert_allclose(packed[:, :3], drawn.r, atol=1e-6 * solution.problem.rod.length)


def test_the_unloaded_rod_is_its_natural_shape() -> None:
    problem = stated("helix").problem
    solution = solve(dataclasses.replace(problem, loads=()))
    laid = shape.unloaded(problem)
    s = np.linspace(0.0, problem.rod.length, len(laid.r))
    assert np.max(np.abs(laid.r - solution.r(s))) < 2e-3 * problem.rod.length  # Simpson's rule, 1000 steps
    assert shape.unloaded(stated("ring").problem) is None


def test_a_thin_section_is_drawn_thicker_and_this_is_said() -> None:
    rod = dx.Rod(1.0, dx.Circle(1e-3), "steel")
    drawn = shape.outline(rod, 1.0)
    assert np.max(np.linalg.norm(drawn.points, axis=1)) == pytest.approx(shape.THINNEST, rel=0.03)
    assert drawn.words == "section drawn 6.1 times its size"
    thick = shape.outline(dx.Rod(1.0, dx.Rectangle(0.04, 0.01), "steel"), 1.0)
    assert thick.words == ""
    np.testing.assert_allclose(np.ptp(thick.points, axis=0), [0.04, 0.01], rtol=1e-2)
    assert thick.bright.sum() == 1
    cone = shape.outline(dx.Rod(1.0, dx.Circle(dx.Table([0, 1], [0.02, 0.01])), "steel"), 1.0)
    assert cone.content["varies"]


def test_a_ring_that_passed_through_itself_says_so() -> None:
    session = Session("ring", stated("ring"))
    shown = rest(session)
    assert isinstance(shown, Frame)
    assert words.link(shown.solution) == [("link", "2 turns")]
    session.ask("link", 3.4)  # a planar ring of this material is stable up to sqrt(3) EI / GJ = 2.30 turns
    shown = rest(session)
    assert isinstance(shown, Frame)
    assert session.values["link"] == 3.4
    turns = shown.solution.link
    assert 0.5 * (3.4 - turns) == pytest.approx(round(0.5 * (3.4 - turns)), abs=1e-6)  # two at a time
    assert abs(turns) < 2.3
    assert words.link(shown.solution) == [("link", f"{turns:.4g} turns: it passed through itself")]
    cantilever = rest(Session("cantilever", stated("cantilever")))
    assert isinstance(cantilever, Frame)
    assert words.link(cantilever.solution) == []


def test_stability_in_words() -> None:
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.3, GJ=0.7))
    unstable = dx.solve(dx.Equilibrium(rod, loads=[dx.EndForce((0, 0, -3.0))]), dx.DiscreteRod(40, stable=False))
    assert words.state(unstable) == ("Unstable equilibrium, in one direction: a real rod would leave it.", "bad")
    follower = dx.solve(dx.Equilibrium(rod, loads=[dx.EndForce((1, 0, 0), follower=True)]))
    assert words.state(follower)[1] == "unknown"


# -- limits ------------------------------------------------------------------------------------------------------------


def test_a_port_in_use_is_one_sentence() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(InvalidInput, match=rf"port {port} of 127.0.0.1 can't be had .*--port {port + 1}"):
            server.free_port("127.0.0.1", port)
    assert server.free_port("127.0.0.1", 0) > 0
    with pytest.raises(InvalidInput, match="between 0 and 65535"):
        server.free_port("127.0.0.1", 70000)


@pytest.mark.parametrize("announced", [True, False])
def test_a_long_request_is_refused_before_it_is_kept(announced: bool) -> None:
    kept, answers = [], []

    async def app(scope: object, receive: object, send: object) -> None:
        while (message := await receive())["type"] == "http.request":
            kept.append(len(message["body"]))

    async def receive() -> dict[str, object]:
        return {"type": "http.request", "body": b"x" * 65_536, "more_body": True}

    async def send(message: dict[str, object]) -> None:
        answers.append(message)

    length = [(b"content-length", b"99999999")] if announced else []
    asyncio.run(server.Bounded(app)({"type": "http", "headers": length}, receive, send))
    assert sum(kept) <= server.BODY
    if announced:
        assert answers[0]["status"] == 413
        assert not kept


def test_workers_work_beside_one_another_and_pass_on_what_went_wrong() -> None:
    workers = Workers(2)

    async def both() -> list[object]:
        return await asyncio.gather(
            workers.run(math.sqrt, 4.0),
            workers.run(math.sqrt, -1.0),
            workers.run(math.sqrt, 9.0),
            return_exceptions=True,
        )

    two, error, three = asyncio.run(both())
    assert (two, three) == (2.0, 3.0)
    assert isinstance(error, ValueError)


def test_a_scenario_of_a_visitor_is_data(tmp_path: Path) -> None:
    (tmp_path / "secret.csv").write_text("0,1\n1,2\n")
    section = f"{{ shape = 'circle', radius = {{ table = '{tmp_path}/secret.csv' }} }}"
    text = f"[rod]\nlength = 1\nsection = {section}\nmaterial = 'steel'\n"
    with pytest.raises(InvalidInput, match="needs a scenario that is a file itself"):
        scenario.parse(text)


def test_a_file_of_one_s_own_stands_first(tmp_path: Path) -> None:
    stated("ring").write(tmp_path / "mine.toml")
    shelf = _shelf(tmp_path / "mine.toml", anywhere=False)
    assert list(shelf) == ["mine", *(name for name in TEMPLATES if name != "falling")]  # that one is a motion
    assert shelf["mine"].scenario == stated("ring")
    (tmp_path / "mine.toml").write_text("[rod]\nlength = '1 kg'\n")
    with pytest.raises(InvalidInput, match=r"mine.toml, line 2: rod.length is '1 kg'"):
        _shelf(tmp_path / "mine.toml", anywhere=False)
