"""What README shows is run, block by block."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

import darboux as dx
from darboux import scenario
from darboux.cli import app

README = (Path(__file__).parent.parent / "README.md").read_text()
BLOCKS = re.findall(r"```python\n(.*?)```", README, re.DOTALL)


COMMANDS = re.findall(r"^\$ darboux (.*?)(?:\s+#.*)?$", README, re.MULTILINE)


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.splitlines()[0])
def test_examples_run(
    block: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    exec(block, {})
    out = capsys.readouterr().out
    assert out.strip()
    assert "False" not in out


def test_commands_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of the section on the command, one after the other, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    assert len(COMMANDS) >= 8
    for words in COMMANDS:
        done = CliRunner().invoke(app, shlex.split(words), prog_name="darboux")
        assert done.exit_code == 0, f"{words}: {done.output}"
        assert done.stdout.strip()
    assert (tmp_path / "moments.svg").exists()
    assert (tmp_path / "cantilever.csv").exists()


def test_the_scenario_that_is_shown_is_solved(tmp_path: Path) -> None:
    text = re.findall(r"```toml\n(.*?)```", README, re.DOTALL)[0]
    stated = scenario.parse(text)
    assert dx.solve(stated.problem, stated.method).stable
    file = tmp_path / "hanging.toml"
    for old, new in (("radius", "raduis"), ("25 cm", "25 kg")):
        file.write_text(text.replace(old, new))
        with pytest.raises(dx.InvalidInput) as caught:
            dx.load(file)
        assert f"InvalidInput: {str(caught.value).replace(str(tmp_path) + '/', '')}" in README


def test_the_first_screen_shows_the_commands_and_the_picture() -> None:
    first = "\n".join(README.splitlines()[:24])
    for words in ("make paper", "make test", "docs/figures/figure5.png"):
        assert words in first
    assert (Path(__file__).parent.parent / "docs" / "figures" / "figure5.png").stat().st_size > 50_000


def test_the_sentences_are_the_ones_that_come() -> None:
    for mistake in (lambda: dx.Circle(radius=-1e-3), lambda: dx.Circle(raduis=1e-3)):
        with pytest.raises(dx.InvalidInput) as caught:
            mistake()
        assert f"InvalidInput: {caught.value}" in README
