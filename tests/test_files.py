"""Files: what is there is not destroyed, and what comes out of a file neither harms nor surprises."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import shutil
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from typer.testing import CliRunner

import darboux as dx
from darboux import files, scenario, store
from darboux.cli import app
from darboux.errors import printable

ROD = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7, mass=1.0))
MOTION = dx.Motion(dx.Equilibrium(ROD, loads=[dx.EndForce((0.1, 0, 0))]), 0.02, rotary_inertia=0.01)
METHOD = dx.ImplicitMidpoint(4, step=2e-3)
posix = pytest.mark.skipif(os.name == "nt", reason="links, pipes and devices")


@pytest.fixture(scope="module")
def solution() -> Any:
    return dx.solve(dx.Equilibrium(ROD, loads=[dx.EndForce((0.5, 0, 0))]))


def writers(solution: Any) -> dict[str, Callable[[Path], Any]]:
    """Every way of the library to write a file, by its ending."""

    def figure(path: Path) -> None:
        from darboux.cli.plot import write_figure
        from darboux.view import plots

        write_figure(plots.draw(solution, "shape"), path)

    return {
        ".nc": solution.save,
        ".csv": solution.export,
        ".toml": solution.problem.to_toml,
        ".png": figure,
    }


@posix
@pytest.mark.parametrize("ending", [".nc", ".csv", ".toml", ".png"])
def test_only_a_regular_file_is_replaced_and_links_are_followed(ending: str, solution: Any, tmp_path: Path) -> None:
    write = writers(solution)[ending]
    pipe, folder = tmp_path / f"pipe{ending}", tmp_path / f"folder{ending}"
    os.mkfifo(pipe)
    folder.mkdir()
    for path, word in ((pipe, "device or a pipe"), (folder, "folder")):
        with pytest.raises(dx.InvalidInput, match=word):
            write(path)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    (tmp_path / f"null{ending}").symlink_to("/dev/null")
    with pytest.raises(dx.InvalidInput, match="device or a pipe"):
        write(tmp_path / f"null{ending}")
    circle = tmp_path / f"circle{ending}"
    circle.symlink_to(circle)
    with pytest.raises(dx.InvalidInput, match="can't be written"):
        write(circle)
    (tmp_path / "sub").mkdir()
    real, link = tmp_path / "sub" / f"real{ending}", tmp_path / f"link{ending}"
    link.symlink_to(real)
    write(link)  # not there yet
    real.chmod(0o640)
    write(link)
    assert link.is_symlink()
    assert stat.S_IMODE(real.stat().st_mode) == 0o640
    assert [file.name for file in real.parent.iterdir()] == [real.name]
    assert Path("/dev/null").is_char_device()


def test_another_kind_of_file_is_kept(solution: Any, tmp_path: Path) -> None:
    for ending in (".nc", ".csv", ".png"):
        path = tmp_path / f"mine{ending}"
        path.write_text("my notes")
        with pytest.raises(dx.InvalidInput, match="another kind of file"):
            writers(solution)[ending](path)
        assert path.read_text() == "my notes"
        path.write_text("")
        writers(solution)[ending](path)
        writers(solution)[ending](path)
    assert len(list(tmp_path.iterdir())) == 3


def test_the_command_keeps_its_scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    MOTION.problem.to_toml("a.toml")
    text = Path("a.toml").read_text()
    Path("b.toml").write_text("# another scenario")
    Path("a.csv").write_text("0,1\n1,2\n")
    os.link("a.toml", "hard.nc")
    for out in ("a.toml", "./a.toml", "b.toml", "hard.nc", "a.csv", str(tmp_path), os.devnull):
        done = CliRunner().invoke(app, ["solve", "a.toml", "--out", out], prog_name="darboux")
        assert (done.exit_code, done.stdout) == (2, ""), out
        assert done.stderr.startswith("InvalidInput: ")
    assert (
        "a.toml, which is the scenario itself; write --out a-result.nc"
        in CliRunner().invoke(app, ["solve", "a.toml", "--out", "a.toml"], prog_name="darboux").stderr
    )
    for words in (["schema", "--out", "a.toml"], ["export", "a.nc"]):
        CliRunner().invoke(app, ["solve", "a.toml", "--out", "a.nc", "-q"], prog_name="darboux")
        done = CliRunner().invoke(app, words, prog_name="darboux")
        assert (done.exit_code, "another kind of file" in done.stderr) == (2, True)
    assert (Path("a.toml").read_text(), Path("b.toml").read_text()) == (text, "# another scenario")
    assert Path("a.csv").read_text() == "0,1\n1,2\n"


def test_a_run_that_was_broken_off_is_kept_and_gone_on_with(tmp_path: Path) -> None:
    whole = dx.simulate(MOTION, METHOD, records=4)
    half = dx.simulate(dataclasses.replace(MOTION, duration=0.01), METHOD, records=2)
    part = tmp_path / "a.nc.part"
    half.save(part)
    before = part.read_bytes()
    with pytest.raises(dx.InvalidInput, match=r"a\.nc\.part holds a run that was broken off.*--continue"):
        dx.simulate(MOTION, METHOD, records=4, out=tmp_path / "a.nc")
    with pytest.raises(dx.InvalidInput, match="broken off"):  # another run's
        dx.simulate(
            MOTION,
            start_from=dx.simulate(dataclasses.replace(MOTION, duration=0.005), METHOD, records=1),
            out=tmp_path / "a.nc",
        )
    assert part.read_bytes() == before
    with pytest.raises(dx.InvalidInput, match=r"a\.nc is no file.*a\.nc\.part holds a run"):
        dx.open(tmp_path / "a.nc")
    assert dx.simulate(MOTION, start_from=dx.open(part), out=tmp_path / "a.nc") == whole  # from what it replaces
    assert [file.name for file in tmp_path.iterdir()] == ["a.nc"]
    assert dx.open(tmp_path / "a.nc") == whole


def test_the_command_streams_a_motion(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from darboux.dynamics.implicit_midpoint import _Steps

    monkeypatch.chdir(tmp_path)
    scenario.Scenario(MOTION.problem, None, MOTION, METHOD).write("a.toml")
    seen: list[int] = []
    advance = _Steps.advance

    def watched(self: Any, t: float) -> bool:
        seen.append(len(dx.open("a.nc.part").times))  # what a kill would leave
        return advance(self, t)

    monkeypatch.setattr(_Steps, "advance", watched)
    done = CliRunner().invoke(app, ["simulate", "a.toml", "--out", "a.nc", "--records", "4", "-q"], prog_name="darboux")
    assert (done.exit_code, seen) == (0, [1, 2, 3, 4])
    assert [file.name for file in tmp_path.iterdir() if file.suffix != ".toml"] == ["a.nc"]


# -- results with hostile content --------------------------------------------------------------------------------------------


def forged(source: Path, target: Path, change: Callable[[Any], None]) -> Path:
    """Write a copy with a change, whose check sums are right again."""
    content = source.read_bytes()
    target.write_bytes(content[: -store.SEAL] if content.endswith(store.AFTER_SEAL) else content)
    with h5py.File(target, "r+") as data:
        change(data)
        names, texts = store.ARRAYS[data.attrs["kind"]], {}
        if all(name in data and isinstance(data.get(name), h5py.Dataset) and data[name].size < 1e6 for name in names):
            texts = {name: data[name].asstr()[()] for name in store.TEXTS}
            arrays = {name: np.asarray(data[name]).real for name in names}
            data.attrs["digest"] = store._digest(data.attrs["kind"], arrays, texts)
    if texts:
        store.seal(target)
    return target


def put(name: str, value: Any, **how: Any) -> Callable[[Any], None]:
    def change(data: Any) -> None:
        del data[name]
        data.create_dataset(name, data=value, **how)

    return change


def linked(link: Any) -> Callable[[Any], None]:
    def change(data: Any) -> None:
        del data["r"]
        data["r"] = link

    return change


def record(**parts: Any) -> Callable[[Any], None]:
    def change(data: Any) -> None:
        text = json.dumps(json.loads(data["record"].asstr()[()]) | parts)
        put("record", text, dtype=h5py.string_dtype())(data)

    return change


def empty(data: Any) -> None:
    for name in store.ARRAYS[store.EQUILIBRIUM]:
        put(name, np.zeros((0, *data[name].shape[1:])))(data)


def huge(data: Any) -> None:
    del data["m"]
    data.create_dataset("m", shape=(10**11, 3), dtype="<f8")


HOSTILE: dict[str, tuple[str, Callable[[Any], None], str]] = {
    "external link": ("a.nc", linked(h5py.ExternalLink("/etc/other.nc", "r")), "link to elsewhere"),
    "soft link": ("a.nc", linked(h5py.SoftLink("/n")), "link to elsewhere"),
    "missing": ("a.nc", lambda data: data.__delitem__("m"), "has no m"),
    "group": ("a.nc", lambda data: (data.__delitem__("m"), data.create_group("m")), "one plain array"),
    "compressed": ("a.nc", lambda data: put("m", np.zeros((9, 3)), compression="gzip")(data), "one plain array"),
    "complex": ("a.nc", lambda data: put("m", data["m"][:] + 0j)(data), "64 bits"),
    "huge": ("a.nc", huge, "more than it holds"),
    "empty": ("a.nc", empty, "does not grow"),
    "NaN": ("a.nc", lambda data: data["m"].__setitem__((0, 0), np.nan), "its m holds what is no finite number"),
    "columns": ("a.nc", lambda data: put("m", data["m"][:, :2])(data), "does not fit"),
    "rows": ("a.nc", lambda data: put("m", data["m"][1:])(data), "does not fit"),
    "q": ("a.nc", lambda data: data["q"].__setitem__(0, 7.0), "unit quaternions"),
    "another scenario": (
        "a.nc",
        lambda data: put(
            "scenario", scenario.Scenario(dx.Equilibrium(dx.Rod(2.0, ROD.section))).toml, dtype=h5py.string_dtype()
        )(data),
        "rod's length",
    ),
    "long scenario": (
        "a.nc",
        lambda data: put("scenario", "#" * 40_000_000, dtype=h5py.string_dtype())(data),
        "more than its scenario may have",
    ),
    "load factor": ("a.nc", record(load_factor="much"), "load_factor is 'much'"),
    "index": ("a.nc", record(index=-1), "index is -1"),
    "error": ("a.nc", record(error={"tip": "small"}), "error of tip"),
    "status": ("a.nc", record(status=7), "damaged"),
    "no motion": (
        "b.nc",
        lambda data: put("scenario", scenario.Scenario(MOTION.problem).toml, dtype=h5py.string_dtype())(data),
        "states no motion",
    ),
    "time": ("b.nc", lambda data: data["time"].__setitem__(1, -1.0), "time does not grow"),
    "no checkpoint": ("b.nc", lambda data: put("checkpoint", np.zeros(0))(data), "no checkpoint"),
    "another checkpoint": ("b.nc", lambda data: data["checkpoint"].__setitem__(0, 9.0), "no checkpoint"),
    "statistics": ("b.nc", record(statistics={"records": 0}), "damaged"),
}


@pytest.fixture(scope="module")
def results(solution: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results")
    solution.save(folder / "a.nc")
    dx.simulate(MOTION, METHOD, records=2).save(folder / "b.nc")
    return folder


@pytest.mark.parametrize("name", HOSTILE)
def test_a_result_with_hostile_content_is_a_sentence(name: str, results: Path, tmp_path: Path) -> None:
    source, change, words = HOSTILE[name]
    with pytest.raises(dx.InvalidInput, match=re.escape(words)) as caught:
        dx.open(forged(results / source, tmp_path / "c.nc", change))
    assert str(caught.value).startswith(f"{tmp_path / 'c.nc'} is damaged")


def test_a_forged_file_is_else_read(results: Path, tmp_path: Path) -> None:
    assert dx.open(forged(results / "a.nc", tmp_path / "c.nc", lambda data: None)) == dx.open(results / "a.nc")


def test_a_checkpoint_of_another_rod_is_refused(results: Path, tmp_path: Path) -> None:
    found = dx.open(forged(results / "b.nc", tmp_path / "c.nc", lambda data: put("checkpoint", [0.02, 1.0])(data)))
    with pytest.raises(dx.InvalidInput, match="checkpoint of 2 numbers"):
        dx.simulate(dataclasses.replace(MOTION, duration=0.03), start_from=found)


# -- what a file says, on a terminal -----------------------------------------------------------------------------------------

STEERING = "\x1b]0;owned\x07\x1b[31m\u202e\x9b2J\r\n"


def test_nothing_of_a_file_steers_the_terminal(results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = json.dumps(STEERING).replace("\x7f", "")
    steered = {
        "key.toml": f"{text} = 1\n",
        "inner.toml": f"[rod]\n{text} = 1\n",
        "value.toml": f"[rod]\nlength = {text}\n",
        "name.toml": f"[rod]\nlength = 1\nsection = {{ shape = {text} }}\n",
        "raw.toml": f"[rod]\nlength = 1 {STEERING}\n",
        "\x1b[31mred\u202e[bold].toml": "[rod]\n",
    }
    for name, content in steered.items():
        Path(name).write_text(content)
    shutil.copy(results / "a.nc", "good.nc")
    forged(
        results / "a.nc", Path("\x1b[31m.nc"), record(status={"code": "converged", "message": STEERING + "[red]x[/]"})
    )
    rod = scenario.Scenario(MOTION.problem).toml
    Path("\x1b[32m[blue]fine.toml").write_text(rod)
    words = [["solve", name] for name in steered] + [["info", name] for name in steered]
    words += [
        ["info", "\x1b[31m.nc"],
        ["solve", "\x1b[32m[blue]fine.toml", "--out", "\x1b[33m.nc"],
        ["export", "\x1b[31m.nc"],
    ]
    words += [
        ["solve", STEERING],
        ["plot", "good.nc", "--what", STEERING],
        ["new", STEERING],
        [STEERING],
        ["solve", "--" + STEERING],
    ]
    words += [["solve", "\udcff.toml"], ["solve", "key.toml", "--json"]]
    for line in words:
        done = CliRunner().invoke(app, line, prog_name="darboux")
        assert done.exit_code in (0, 2), (line, done.output)
        for letter in done.output:
            assert letter == "\n" or letter.isprintable(), (line, done.output)
        assert "fault of darboux" not in done.output
    assert "[blue]fine" in CliRunner().invoke(app, ["solve", "\x1b[32m[blue]fine.toml"], prog_name="darboux").stdout


def test_sentences_in_python_are_escaped_too(tmp_path: Path) -> None:
    assert printable("plain ± µ ü") == "plain ± µ ü"
    with pytest.raises(dx.InvalidInput) as caught:
        dx.load(tmp_path / STEERING)
    assert str(caught.value).isprintable()
    assert str(dx.NotConverged(STEERING)).isprintable()


def test_counts_in_a_file_have_bounds() -> None:
    def said(text: str) -> str:
        rod = "[rod]\nlength = 1\nsection = { EI1 = 1, GJ = 1, mass = 1 }\n[supports]\nstart = { type = 'clamped' }\n"
        with pytest.raises(dx.InvalidInput) as caught:
            followed(scenario.parse(rod + text))
        return str(caught.value)

    def followed(stated: scenario.Scenario) -> None:
        dx.simulate(stated.motion, stated.motion_method)

    for method in ("segments = 1000000000", "segments = 0x" + "f" * 100_000):
        assert "between 2 and 100000" in said(f"[method]\nname = 'discrete'\n{method}\n")
    for name in ("implicit_midpoint", "tr_bdf2", "stormer_verlet"):
        assert "between 2 and 100000" in said(
            f"[motion]\nduration = 1\nrotary_inertia = 0.01\nmethod = {{ name = '{name}', segments = 1000000000 }}"
        )
    assert "between 1 and 800" in said("[method]\nname = 'shooting'\npieces = 1000000000")
    assert "between 1 and 20000" in said("[method]\nname = 'collocation'\nelements = 1000000000")
    step = "[motion]\nduration = 1\nrotary_inertia = 0.01\nmethod = {{ name = '{}', segments = 4, step = 1e-15 }}"
    for name in ("implicit_midpoint", "tr_bdf2"):
        assert "1e+15 steps" in said(step.format(name))
    with pytest.raises(dx.InvalidInput, match=r"link is 1e\+09 turns; at most"):
        dx.solve(dx.Ring(ROD, link=1e9))
    with pytest.raises(dx.InvalidInput, match=r"end\.twist is -1e\+09 turns; at most"):
        dx.solve(dx.Equilibrium(ROD, end=dx.Clamped((0, 0, 0.9), twist=-1e9 * dx.turn)))
    with pytest.raises(dx.InvalidInput, match="between 1 and 1000000"):
        dx.simulate(MOTION, METHOD, records=10**9)
    with pytest.raises(dx.InvalidInput, match=r"GB of memory.*in a file"):
        dx.simulate(MOTION, dx.ImplicitMidpoint(100), records=10**6)


def test_tables_beside_a_file_have_a_bound_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from darboux.scenario import kinds

    (tmp_path / "k.csv").write_text("0,1\n1,1\n")
    monkeypatch.setattr(kinds, "LARGEST_TABLES", 12)
    (tmp_path / "a.toml").write_text(
        "[rod]\nlength = 1\nsection = { EI1 = { table = 'k.csv' }, GJ = { table = 'k.csv' } }\n"
    )
    with pytest.raises(dx.InvalidInput, match="tables have more than"):
        dx.load(tmp_path / "a.toml")


def test_a_write_protected_file_is_kept(solution: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    solution.save(tmp_path / "a.nc")
    monkeypatch.setattr(files.os, "access", lambda *_: False)  # root may write everything
    with pytest.raises(dx.InvalidInput, match="write-protected"):
        solution.save(tmp_path / "a.nc")
