"""The command, as a new user runs it: every verb, every example of --help, what is printed, and the exit status."""

from __future__ import annotations

import csv
import json
import os
import re
import shlex
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import darboux as dx
from darboux import scenario
from darboux.cli import EXAMPLES, app
from darboux.cli.new import TEMPLATES
from darboux.kernels import path
from darboux.stream import Stream
from darboux.view import terminal


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Run the command in an empty folder, in this process."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")

    def runs(*words: str) -> Result:
        return CliRunner().invoke(app, list(words), prog_name="darboux")

    return runs


def sentence(result: Result, status: int, *words: str) -> None:
    """Assert the exit status, and one sentence on standard error with these words in it."""
    assert result.exit_code == status, result.output
    assert len(result.stderr.strip().splitlines()) == 1, result.stderr
    assert "Traceback" not in result.stderr
    for word in words:
        assert word in result.stderr


@pytest.mark.parametrize("name", TEMPLATES)
def test_every_template_is_written_and_solved(name: str, run: Any) -> None:
    verb = "simulate" if name == "falling" else "solve"
    assert f"Next: darboux {verb} {name}.toml" in run("new", name).stdout
    assert Path(f"{name}.toml").read_text().startswith("# ")
    found = run("solve", f"{name}.toml", "--json", "--out", "result.nc")
    assert found.exit_code == 0, found.output
    numbers = json.loads(found.stdout)
    solution = dx.solve(dx.load(f"{name}.toml"), scenario.read(f"{name}.toml").method)
    assert numbers["converged"] is True
    assert numbers["status"] == "converged"
    assert numbers["tip"]["r"] == solution.tip.tolist()
    assert dx.open("result.nc").problem == solution.problem
    sentence(run("new", name), 2, f"{name}.toml is there already", "--out", "--force")
    Path(f"{name}.toml").write_text("mine")
    assert run("new", name, "--force", "-q").stdout == ""
    assert dx.load(f"{name}.toml") == solution.problem


def test_the_numbers_of_json(run: Any) -> None:
    run("new", "cantilever")
    result = run("solve", "cantilever.toml", "--json")
    assert result.stderr == ""
    numbers = json.loads(result.stdout)
    solution = dx.solve(dx.load("cantilever.toml"), dx.Collocation(rtol=1e-8))
    flat = {"method": "Collocation(rtol=1e-08)", "stable": True, "model": "inextensible"}
    assert {key: numbers[key] for key in flat} == flat
    assert numbers["reactions"]["start"]["force"] == solution.reactions.start.force.tolist()
    assert numbers["reactions"]["start"]["moment"] == solution.reactions.start.moment.tolist()
    assert numbers["reactions"]["end"] == {"force": [0, 0, 0], "moment": [0, 0, 0]}
    weight = 1000.0 * np.pi * 1e-6 * 0.25 * 9.81
    assert numbers["reactions"]["start"]["force"][2] == pytest.approx(weight)
    assert numbers["energy"]["total"] == solution.energy.total
    assert numbers["error"]["tip"] == solution.error.tip
    assert 0.0 < numbers["seconds"] < 600.0
    np.testing.assert_allclose(numbers["tip"]["tangent"], solution.R(0.25)[:, 2], atol=1e-15)
    assert numbers["largest_moment"]["s"] == 0.0
    largest = solution.largest_stress
    assert numbers["largest_stress"] == {"value": largest.von_mises, "s": largest.s, "point": list(largest.point)}
    M = np.linalg.norm(solution.m(0.0))
    assert largest.von_mises == pytest.approx(4.0 * M / (np.pi * 1e-9), rel=1e-2)  # 4 M / pi r^3, and a little tension


def test_the_table_and_the_picture(run: Any) -> None:
    run("new", "cantilever")
    text = run("solve", "cantilever.toml").stdout
    for words in (
        "status",
        "converged",
        "tip",
        "0.0148094",
        "force at the start",
        "largest moment",
        "energy",
        "stable",
        "time",
        "■",
    ):
        assert words in text
    assert max(map(len, text.splitlines())) <= 80
    assert run("solve", "cantilever.toml", "-q").output == ""
    by_elastica = run("solve", "cantilever.toml", "--method", "elastica", "--json")
    assert json.loads(by_elastica.stdout)["method"] == "Elastica()"


def test_what_does_not_converge_exits_with_one_and_is_kept(run: Any) -> None:
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7))
    dx.Equilibrium(rod, end=dx.Clamped(position=(0, 0, 0.5))).to_toml("pushed.toml", dx.Shooting())
    sentence(run("solve", "pushed.toml", "-q", "--out", "pushed.nc"), 1, "NotConverged: ")
    assert dx.open("pushed.nc").load_factor < 1.0
    sentence(run("plot", "pushed.toml"), 1, "NotConverged: ")
    assert Path("pushed-shape.png").exists()
    result = run("solve", "pushed.toml", "--json")
    sentence(result, 1, "NotConverged: ")
    numbers = json.loads(result.stdout)
    assert numbers["converged"] is False
    assert numbers["status"] != "converged"


def test_mistakes_are_one_sentence_and_exit_with_two(run: Any) -> None:
    run("new", "cantilever")
    text = Path("cantilever.toml").read_text()
    Path("wrong.toml").write_text(text.replace("radius", "raduis"))
    sentence(run("solve", "wrong.toml"), 2, "wrong.toml, line 7", "raduis", "Did you mean 'radius'?")
    sentence(run("solve", "none.toml"), 2, "none.toml is no file", "darboux new")
    sentence(run("solve"), 2, "FILE", "darboux solve --help")
    sentence(run("solve", "cantilever.toml", "--jsn"), 2, "--jsn", "--json")
    sentence(run("slove", "cantilever.toml"), 2, "slove", "solve")
    sentence(run("solve", "cantilever.toml", "--method", "colocation"), 2, "Did you mean 'collocation'?")
    sentence(run("compare", "cantilever.toml", "--methods", "shooting"), 2, "two or more")
    sentence(run("compare", "cantilever.toml", "--out", "a.doc"), 2, ".png, .svg, .pdf")
    sentence(run("new", "cantilver"), 2, "Did you mean 'cantilever'?")
    Path("none.nc").write_text(text)
    sentence(run("plot", "none.nc"), 2, "no result of darboux")
    sentence(run("plot", "none.toml"), 2, "none.toml is no file")
    run("solve", "cantilever.toml", "--out", "a.nc", "-q")
    sentence(run("plot", "a.nc", "--what", "shapes"), 2, "Did you mean 'shape'?")
    sentence(run("export", "a.nc", "--to", "cvs"), 2, "Did you mean 'csv'?")
    sentence(run("export", "a.nc", "--samples", "1"), 2, "--samples")
    sentence(run("solve", "cantilever.toml", "--out", "no/folder/a.nc"), 2, "can't be written: there is no folder")
    result = run("solve", "none.toml", "--json")
    sentence(result, 2, "none.toml is no file")
    assert json.loads(result.stdout)["status"] == "invalid_input"
    with pytest.raises(dx.InvalidInput):  # --debug lets the traceback through
        CliRunner().invoke(app, ["solve", "none.toml", "--debug"], catch_exceptions=False)


def test_advice_fits_the_command(run: Any) -> None:
    run("new", "cantilever")
    run("solve", "cantilever.toml", "--out", "a.nc", "-q")
    sentence(run("export", "cantilever.toml"), 2, "darboux solve cantilever.toml --out cantilever.nc")
    sentence(run("simulate", "a.nc"), 2, "a.nc is a result, not a scenario", "darboux plot a.nc")
    sentence(run("solve", "a.nc"), 2, "a.nc is a result, not a scenario", "darboux info a.nc")
    sentence(run("solve", "cantilver.toml"), 2, "cantilver.toml is no file. Did you mean 'cantilever.toml'?")
    sentence(run("info", "."), 2, ". is no file")
    assert run("solve", "cantilever.toml", "--method", "Elastica", "-q").exit_code == 0  # as sentences call it
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7))
    pushed = dx.Equilibrium(rod, end=dx.Clamped(position=(0, 0, 0.5)))
    pushed.to_toml("pushed.toml", dx.Shooting())
    said = run("solve", "pushed.toml", "--json")
    sentence(said, 1, "--out keeps what was reached")
    assert ".solution" not in said.output
    with pytest.raises(dx.NotConverged, match=r"is in \.solution\.$"):
        dx.solve(pushed, dx.Shooting())


def test_a_folded_path_has_its_next_step_for_each_reader() -> None:
    from darboux.cli import shell
    from darboux.solution import ADVICE, Status
    from darboux.statics.load_path import Path as LoadPath
    from darboux.statics.load_path import ending

    path: Any = LoadPath(None, 0.5)
    path.slope = 1e12
    code, message = ending(path, "Collocation")
    assert code == "folded"
    for word in (".solution", "solve_all", "start=", "()"):
        assert word not in message
    assert "solve_all(problem)" in Status(code, message).next_in_python
    assert set(shell.ADVICE) <= set(ADVICE)
    assert "--out" in shell.ADVICE[code]


def test_tables_outside_the_folder_need_leave(run: Any, tmp_path: Path) -> None:
    (tmp_path / "k.csv").write_text("0,0,1,0\n1,0,1,0\n")
    (tmp_path / "inside").mkdir()
    text = "[rod]\nlength = 1\nsection = { EI1 = 1, GJ = 1 }\nnatural = { table = '../k.csv' }"
    (tmp_path / "inside" / "bent.toml").write_text(text)
    sentence(run("solve", "inside/bent.toml"), 2, "own folder", "--anywhere")
    assert run("solve", "inside/bent.toml", "--anywhere", "-q").exit_code == 0


def test_simulating(run: Any) -> None:
    run("new", "falling")
    text = run("simulate", "falling.toml", "--out", "a.nc", "--records", "20").stdout
    for words in (
        "status",
        "followed to its end",
        "TRBDF2(40",
        "tip at the end",
        "energy",
        "balance",
        "steps",
        "time",
        "■",
    ):
        assert words in text
    assert max(map(len, text.splitlines())) <= 80
    stated = scenario.read("falling.toml")
    expected = dx.simulate(stated.motion, stated.motion_method, records=20)
    assert dx.open("a.nc") == expected
    numbers = json.loads(run("simulate", "falling.toml", "--json", "--records", "20").stdout)
    assert numbers["tip"]["r"] == expected.tip[-1].tolist()
    assert (numbers["status"], numbers["t"], numbers["records"]) == ("converged", 1.0, 21)
    energy = numbers["energy"]
    assert energy["total"] == energy["kinetic"] + energy["elastic"] + energy["supports"] + energy["load"]
    assert energy["total"] + energy["dissipated"] - energy["work"] == pytest.approx(0.0, abs=energy["drift"] * 7e-4)
    found = json.loads(run("info", "a.nc", "--json").stdout)
    assert scenario.parse(found["scenario"]).motion == stated.motion
    assert "tr_bdf2" in run("info").stdout
    other = json.loads(
        run("simulate", "falling.toml", "--json", "--method", "implicit_midpoint", "--records", "1").stdout
    )
    np.testing.assert_allclose(other["tip"]["r"], numbers["tip"]["r"], atol=2.5e-3)
    assert other["method"] == "ImplicitMidpoint(100)"


def test_a_motion_goes_on_from_its_file(run: Any) -> None:
    run("new", "falling")
    text = Path("falling.toml").read_text().replace("rtol = 1e-4", "step = 0.0078125").replace("40", "10")
    Path("long.toml").write_text(text)
    Path("short.toml").write_text(text.replace('"1 s"', '"0.5 s"'))
    assert run("simulate", "short.toml", "--records", "4", "--out", "a.nc", "-q").output == ""
    assert run("simulate", "long.toml", "--continue", "a.nc", "--out", "a.nc", "-q").exit_code == 0
    run("simulate", "long.toml", "--records", "8", "--out", "b.nc", "-q")
    assert dx.open("a.nc") == dx.open("b.nc")
    sentence(run("simulate", "short.toml", "--continue", "a.nc"), 2, "make it longer")
    sentence(run("simulate", "falling.toml", "--continue", "a.nc"), 2, "go on with that")


def test_motions_that_end_early_or_can_t_be(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    run("new", "cantilever")
    sentence(run("simulate", "cantilever.toml"), 2, "cantilever.toml states no motion", "[motion]")
    run("new", "falling")
    sentence(run("simulate", "falling.toml", "--method", "tr_bdf"), 2, "Did you mean 'tr_bdf2'?")
    sentence(run("simulate", "falling.toml", "--out", "no/folder/a.nc"), 2, "can't be written: there is no folder")
    sentence(run("simulate", "falling.toml", "--continue", "none.nc"), 2, "none.nc is no file")
    text = Path("falling.toml").read_text().replace("rtol = 1e-4", "step = 0.25")
    Path("coarse.toml").write_text(text[: text.index("[[motion.damping]]")])
    result = run("simulate", "coarse.toml", "--json", "--out", "a.nc")
    sentence(result, 1, "NotConverged", "drifts", "smaller steps")
    assert json.loads(result.stdout)["status"] == "drift"
    assert run("export", "a.nc").exit_code == 0  # what was reached
    from darboux.dynamics.tr_bdf2 import _Adaptive

    advance = _Adaptive.advance

    def interrupted(self: _Adaptive, t: float) -> bool:
        if t >= 0.5:
            os.kill(os.getpid(), signal.SIGINT)
        return advance(self, t)

    def again(self: Stream, *words: Any) -> Any:
        os.kill(os.getpid(), signal.SIGINT)
        return finish(self, *words)

    finish = Stream.finish
    with monkeypatch.context() as patch:
        patch.setattr(_Adaptive, "advance", interrupted)
        result = run("simulate", "falling.toml", "--records", "10", "--out", "b.nc")
        sentence(result, 130, "Interrupted.")
        assert "can be continued" in " ".join(result.stdout.split())
        Path("b.nc").unlink()
        patch.setattr(Stream, "finish", again)  # and once more, while it is saved
        sentence(run("simulate", "falling.toml", "--records", "10", "--out", "b.nc"), 130, "Interrupted.")
    assert dx.open("b.nc").times[-1] == 0.4
    assert dx.simulate(scenario.read("falling.toml").motion, start_from=dx.open("b.nc")).converged


def test_comparing(run: Any) -> None:
    run("new", "cantilever")
    result = run("compare", "cantilever.toml", "--methods", "elastica,collocation", "--out", "curves.svg", "--json")
    assert result.exit_code == 0
    numbers = json.loads(result.stdout)
    gap = min(entry["distance"]["centreline"] for entry in numbers["methods"] if entry["distance"]["centreline"])
    assert gap < 1e-8
    assert Path(numbers["figure"]).read_text().startswith("<?xml")
    text = run("compare", "cantilever.toml", "--methods", "elastica,discrete").stdout
    for words in ("agreement of the methods", "Elastica()", "DiscreteRod(100)", "order", "cantilever-agreement.png"):
        assert words in text
    assert Path("cantilever-agreement.png").read_bytes()[:4] == b"\x89PNG"


def test_pictures_of_a_result(run: Any) -> None:
    run("new", "cantilever")
    run("solve", "cantilever.toml", "--out", "a.nc", "-q")
    for what, ending, start in (
        ("shape", "png", b"\x89PNG"),
        ("moments", "svg", b"<?xml"),
        ("stress", "pdf", b"%PDF"),
        ("fields", "png", b"\x89PNG"),
    ):
        assert f"{what}.{ending}" in run("plot", "a.nc", "--what", what, "--out", f"{what}.{ending}").stdout
        assert Path(f"{what}.{ending}").read_bytes().startswith(start)
    assert "a-shape.png" in run("plot", "a.nc").stdout
    sentence(run("plot", "a.nc", "--out", "a.gif"), 2, "An equilibrium does not move")
    for name in ("a.nc", "cantilever.toml"):
        run("plot", name, "--out", f"{name}.svg")
    assert Path("cantilever.toml.svg").read_text() == Path("a.nc.svg").read_text()


def test_pictures_of_a_motion(run: Any) -> None:
    run("new", "falling")
    run("simulate", "falling.toml", "--out", "a.nc", "--records", "10", "-q")
    assert "a-motion.png" in run("plot", "a.nc").stdout
    for what, ending, start in (("shape", "svg", b"<?xml"), ("energy", "png", b"\x89PNG"), ("tip", "pdf", b"%PDF")):
        assert run("plot", "a.nc", "--what", what, "--out", f"{what}.{ending}", "-q").output == ""
        assert Path(f"{what}.{ending}").read_bytes().startswith(start)
    assert "fall.gif" in run("plot", "a.nc", "--out", "fall.gif").stdout
    assert Path("fall.gif").read_bytes().startswith(b"GIF89a")
    sentence(run("plot", "a.nc", "--what", "moments"), 2, "'tip'")
    sentence(run("plot", "a.nc", "--what", "tip", "--out", "tip.gif"), 2, "a film shows the shape")
    sentence(run("plot", "a.nc", "--out", "a.doc"), 2, ".png, .svg, .pdf, .gif, .mp4")


def test_exporting(run: Any) -> None:
    run("new", "spinning")
    run("solve", "spinning.toml", "--out", "a.nc", "-q")
    assert run("export", "a.nc", "--samples", "11").exit_code == 0
    with Path("a.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0][:4] == ["s (m)", "x (m)", "y (m)", "z (m)"]
    data, solution = np.array(rows[1:], dtype=float), dx.open("a.nc")
    s = np.linspace(0.0, 0.25, 11)
    directors = solution.R(s).transpose(0, 2, 1).reshape(11, 9)
    parts = [s, solution.r(s), directors, solution.k(s), solution.n(s), solution.m(s)]
    np.testing.assert_array_equal(data[:, :22], np.column_stack(parts))  # tension, shear, stress: test_tables.py
    np.testing.assert_array_equal(data[:, rows[0].index("d3x")], solution.R(s)[:, 0, 2])


def test_what_darboux_and_a_file_hold(run: Any) -> None:
    text = run("info").stdout
    for words in ("collocation", "end_force", "clamped", "circle", "nitinol", "EN 1993-1-1"):
        assert words in text
    run("new", "hanging-cable")
    assert "Clamped at s = 0 m, Clamped at s = " in run("info", "hanging-cable.toml").stdout
    assert "0 and 0 degrees below the horizontal" in run("solve", "hanging-cable.toml", "--out", "a.nc").stdout
    found = json.loads(run("info", "a.nc", "--json").stdout)
    assert found["kind"] == "result"
    assert scenario.parse(found["scenario"]).problem == dx.load("hanging-cable.toml")


def test_the_schema(run: Any) -> None:
    assert json.loads(run("schema").stdout) == scenario.schema()
    run("schema", "--out", "s.json")
    assert json.loads(Path("s.json").read_text()) == scenario.schema()


def test_the_doctor(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    result = run("doctor")
    assert result.exit_code == 0, result.output
    for words in ("Python", "numpy", "cores", "kernels", "agree to"):
        assert words in result.stdout
    assert json.loads(run("doctor", "--json").stdout)["fine"] is True
    from darboux.kernels import first_call, jit

    monkeypatch.setattr(jit, "AT_FIRST_CALL", True)
    monkeypatch.setattr(first_call, "CACHE", None)
    result = run("doctor")
    assert result.exit_code == 1
    assert "DARBOUX_CACHE" in result.stdout


@pytest.mark.parametrize("verb", EXAMPLES, ids=lambda verb: verb.__name__)
def test_every_verb_has_help_with_an_example_that_runs(verb: Any, run: Any) -> None:
    text = " ".join(run(verb.__name__, "--help").stdout.split())
    example = EXAMPLES[verb]
    assert f"Example: {example}" in text
    if verb.__name__ not in ("new", "paper", "serve"):
        run("new", "cantilever")
        run("new", "falling")
        run("solve", "cantilever.toml", "--out", "cantilever.nc", "-q")
    words = shlex.split(example)
    assert words[0] == "darboux"
    if verb.__name__ in ("paper", "serve"):  # test_paper and test_page run them
        return
    result = run(*words[1:])
    assert result.exit_code == 0, result.output


def process(*words: str, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the command in a process of its own."""
    code = "from darboux.cli import main; main()"
    return subprocess.run(
        [sys.executable, "-c", code, *words], cwd=cwd, capture_output=True, text=True, timeout=300, check=False,
        env=os.environ | {"COLUMNS": "80"} | environment,
    )  # fmt: skip


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a disk that is always full")
def test_what_the_machine_does_not_let_it_do_is_a_sentence(tmp_path: Path) -> None:
    def ran(words: str, **environment: str) -> subprocess.CompletedProcess[str]:
        main = f"'{sys.executable}' -c 'from darboux.cli import main; main()'"
        done = subprocess.run(
            ["bash", "-c", f"set -o pipefail; {main} {words}"],
            cwd=tmp_path, env=os.environ | environment, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert "Traceback" not in done.stderr
        assert "fault of darboux" not in done.stderr
        assert "Exception ignored" not in done.stderr
        return done

    for words in ("info --json >/dev/full", "info >/dev/full"):
        done = ran(words)
        assert (done.returncode, len(done.stderr.splitlines())) == (74, 1)
        assert "No space left on device" in done.stderr
    assert ran("info 2>/dev/full").returncode == 0
    assert ran("info none.toml 2>/dev/full").returncode == 2
    assert ran("info >&-").returncode == 0
    assert ran("info | head -c 1").returncode in (0, 141)  # 141 where the reader was quicker
    shown = ran("info", PYTHONIOENCODING="ascii")
    assert (shown.returncode, shown.stdout.isascii()) == (0, True)
    (tmp_path / "a.toml").write_text("[rod]\nlength = " + "9" * 200_000)
    assert "thousands of digits" in ran("info a.toml").stderr
    (tmp_path / "a.toml").write_text("[rod]\nlength = 0x" + "f" * 200_000)
    assert "thousands of digits" in ran("info a.toml").stderr


def test_little_memory_is_a_sentence(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from darboux.scenario import forms

    def failing(error: Exception) -> Any:
        def fail() -> None:
            raise error

        return fail

    run("new", "cantilever")
    for error in (
        MemoryError(),
        np.linalg.LinAlgError("x: cannot allocate memory"),
        RuntimeError("can't start new thread"),
    ):
        monkeypatch.setattr(forms, "scenario", failing(error))
        sentence(run("solve", "cantilever.toml"), 74, "not enough memory")
    monkeypatch.setattr(forms, "scenario", failing(OSError("Could not find/load shared object file 'x.so'")))
    sentence(run("solve", "cantilever.toml"), 74, "A library can't be loaded")


def test_a_newcomer_s_first_minute(tmp_path: Path) -> None:
    bare = process(cwd=tmp_path)
    assert bare.returncode == 0
    assert bare.stdout == process("--help", cwd=tmp_path).stdout
    text = " ".join(bare.stdout.split())
    example = re.search(r"Example: (.*)", text)
    assert example
    for words in example[1].split("&&"):
        done = process(*shlex.split(words)[1:], cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert done.stderr == ""
    ascii_only = process("solve", "helix.toml", cwd=tmp_path, PYTHONIOENCODING="ascii")
    assert ascii_only.returncode == 0, ascii_only.stderr
    assert "# the start" in ascii_only.stdout
    completed = process(cwd=tmp_path, _DARBOUX_COMPLETE="complete_bash", COMP_WORDS="darboux so", COMP_CWORD="1")
    assert completed.stdout.split() == ["solve"]


@pytest.mark.skipif(os.name == "nt", reason="interrupts by a signal")
def test_an_interrupt_keeps_the_equilibrium_reached(run: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(rod: path.Rod, course: path.Course, most: int) -> int:
        if course.real[path.FACTOR] > 0.3:
            os.kill(os.getpid(), signal.SIGINT)
        return int(follow(rod, course, 1))

    run("new", "cantilever")
    follow = path.follow
    with monkeypatch.context() as patch:
        patch.setattr(path, "follow", interrupted)
        result = run("solve", "cantilever.toml", "--out", "a.nc")
        with pytest.raises(KeyboardInterrupt, match="of the load"):  # a loop over many loads ends at once
            dx.solve(dx.load("cantilever.toml"))
    sentence(result, 130, "Interrupted.")
    assert "stopped at" in " ".join(result.stdout.split())
    kept = dx.open("a.nc")
    assert kept.status.code == "stopped"
    assert 0.3 < kept.load_factor < 1.0
    weight = 1000.0 * np.pi * 1e-3**2 * 0.25 * 9.81
    assert kept.reactions.start.force[2] == pytest.approx(kept.load_factor * weight, rel=1e-6)


@pytest.mark.skipif(os.name == "nt", reason="interrupts by a signal")
def test_an_interrupt_is_clean(tmp_path: Path) -> None:
    code = (
        "import os, signal, threading; from darboux import scenario; from darboux.cli import main\n"
        "scenario.read = lambda *a, **k: os.kill(os.getpid(), signal.SIGINT)\n"
        "main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "solve", "a.toml"], capture_output=True, text=True, cwd=tmp_path, check=False
    )
    assert done.returncode == 130
    assert done.stderr.strip() == "Interrupted."
    assert not list(tmp_path.iterdir())


def test_the_picture_keeps_the_shape() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    ring = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    lines = terminal.picture(ring, plain=True).splitlines()
    assert len(lines) == terminal.ROWS + 1
    assert abs(max(map(len, lines[:-1])) - 2 * terminal.ROWS) <= 1  # a letter is twice as high as wide
    assert lines[-1].startswith("x to the right, y upwards; 2")
    middle = lines[len(lines) // 2]
    assert middle.startswith("*")
    assert "#" in "".join(lines[len(lines) // 2 - 2 : len(lines) // 2 + 2])
    straight = terminal.picture(np.array([[0, 0, 0], [0, 0, 1.0]]))
    assert len(straight.splitlines()) == terminal.ROWS + 1


def test_view_draws_a_scenario_a_motion_and_a_result(run: Any) -> None:
    pytest.importorskip("pyvista")
    run("new", "helix")
    run("new", "falling")
    small = ("--size", "200x150")
    assert "Drawn in a.png" in run("view", "helix.toml", "--out", "a.png", "--ghost", "--directors", *small).stdout
    run("solve", "helix.toml", "--out", "helix.nc")
    assert run("view", "helix.nc", "--out", "b.png", "--field", "none", "-q", *small).stdout == ""
    drawn = run("view", "falling.toml", "--out", "c.png", "--time", "0.5", "--field", "speed", *small)
    assert drawn.exit_code == 0, drawn.output
    pictures = [Path(f"{name}.png").read_bytes() for name in "abc"]
    assert all(picture[:4] == b"\x89PNG" for picture in pictures)
    assert len(set(pictures)) == 3
    sentence(run("view", "helix.nc", "--out", "d.png", "--size", "200"), 2, "--size is '200'", "1200x900")
    sentence(run("view", "helix.nc", "--out", "d.png", "--size", "20x15"), 2, "between 160 x 120 and")
