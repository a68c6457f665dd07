"""What `make bench` says and writes, on made-up figures: that a slow-down is flagged, and families are recorded one by one."""

from __future__ import annotations

import json
import sys
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from benchmarks import core, plots, run
from benchmarks.timing import Curve, Row, Spread

COST = Spread(2.0, 1.9, 2.1)
ROWS = {
    "collocation": Row("a", "a thing", COST, "ms", peer="another", theirs=Spread(8.0, 7.0, 9.0), ratio=Spread(4.0, 3.0, 5.0)),
    "motion": Row("b", "a thing | without a peer", COST, "ns", guard=0.5, most=1.0, our_error=1e-3, error_of="tip / L"),
}  # fmt: skip
CURVES = [Curve(panel, "ours", (1e-3, 1e-6), (COST, COST)) for panel in plots.PANELS]


@pytest.fixture
def recorded(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Two families that measure at once, and a folder to record in."""
    monkeypatch.setattr(run, "ROOT", tmp_path)
    monkeypatch.setattr(run, "LAST", tmp_path / "last.json")
    monkeypatch.setattr(run, "PAGE", tmp_path / "benchmarks.md")
    monkeypatch.setattr(run, "FIGURES", tmp_path)
    monkeypatch.setattr(run, "FAMILIES", tuple(ROWS))
    for name, row in ROWS.items():
        family = ModuleType(name, f"What {name} is.")
        family.rows = lambda quick, row=row: iter([row, *CURVES, "a remark"])  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, f"benchmarks.{name}", family)
    return tmp_path


def test_a_slow_down_is_flagged(recorded: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert run.main(["--write"]) == 0
    assert "slower than recorded" not in capsys.readouterr().out
    last = json.loads(run.LAST.read_text())
    last["collocation"]["rows"][0]["ratio"]["median"] *= 1.31  # it was a larger one, so ours is slower now
    last["motion"]["rows"][0]["guard"] /= 1.29
    run.LAST.write_text(json.dumps(last))
    assert run.main([]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert out.count("slower than recorded") == 1
    assert "1.31 times slower than recorded" in out
    last["motion"]["rows"][0]["guard"] /= 1.1
    run.LAST.write_text(json.dumps(last))
    assert run.main(["--only", "motion"]) == 0
    assert "1.42 times slower than recorded" in " ".join(capsys.readouterr().out.split())


def test_a_family_is_recorded_alone_with_its_own_date(recorded: Any) -> None:
    assert run.main(["--write"]) == 0
    last = json.loads(run.LAST.read_text())
    last["collocation"]["date"] = last["motion"]["date"] = "2001-02-03"
    run.LAST.write_text(json.dumps(last))
    assert run.main(["--only", "motion", "--write"]) == 0
    again = run.read()
    assert again["collocation"].date == "2001-02-03" != again["motion"].date
    assert [again[name].rows for name in ROWS] == [[row] for row in ROWS.values()]
    page = run.PAGE.read_text()
    for words in ("Measured on 2001-02-03", "What motion is.", r"a thing \| without a peer", "a remark", "numpy"):
        assert words in page


def test_a_family_that_breaks_is_named_and_nothing_is_recorded(
    recorded: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(quick: bool) -> Any:
        raise ValueError("no more of this")

    monkeypatch.setattr(sys.modules["benchmarks.motion"], "rows", broken)
    assert run.main(["--write"]) == 1
    assert "motion broke: ValueError: no more of this" in capsys.readouterr().out
    assert not run.LAST.exists()


def test_the_plots_show_the_recorded_curves(recorded: Any) -> None:
    from matplotlib.image import imread

    assert run.main(["--write"]) == 0
    assert {path.name for path in recorded.glob("*.png")} == {f"benchmarks-{name}.png" for name in plots.PLOTS}
    for name in plots.PLOTS:
        drawn = np.asarray(imread(recorded / f"benchmarks-{name}.png"))
        assert f"](figures/benchmarks-{name}.png)" in run.PAGE.read_text()
        assert np.any(drawn[..., 2] > drawn[..., 0] + 0.3)  # our blue


def test_every_family_has_its_module_and_every_panel_its_family() -> None:
    from importlib.util import find_spec

    assert all(find_spec(f"benchmarks.{family}") for family in run.FAMILIES)
    assert {panel.split(".")[0] for panel in plots.PANELS} <= set(run.FAMILIES)


def test_a_solver_is_timed_in_a_process_of_its_own(tmp_path: Any) -> None:
    with core.Side(core.ROOT / "src", str(tmp_path)) as side:
        seconds, tip = side.seconds("force_10", 2)
        assert 0.0 < seconds < 60.0
        assert np.linalg.norm(tip) < 1.0
        with pytest.raises(LookupError, match="KeyError"):
            side.seconds("nothing")


def test_a_base_that_git_does_not_have_is_a_remark(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(core, "BASE", 40 * "0")
    (remark,) = core.rows(quick=True)
    assert isinstance(remark, str)
    assert "not timed against commit 0000000" in remark


def test_the_works_of_the_core_are_those_that_the_worker_knows() -> None:
    from benchmarks.core_worker import WORKS

    assert [asked.work for asked in core.WORKS] == list(WORKS)
