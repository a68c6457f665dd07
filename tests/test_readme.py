"""What README and the guide show is what comes; code of the guide runs when the site is built."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

import darboux as dx
from darboux import scenario
from darboux.cli import app

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
FILES_PAGE = (ROOT / "docs" / "guide" / "scenario_files.md").read_text()
COMMAND_PAGE = (ROOT / "docs" / "guide" / "command.md").read_text()
ROUNDING = r"\d\.\de-1[3-9]"  # differs from one processor to the next


def commands(page: str) -> list[str]:
    return re.findall(r"^\$ darboux (.*?)(?:\s+#.*)?$", page, re.MULTILINE)


def test_the_code_prints_what_stands_below_it(capsys: pytest.CaptureFixture[str]) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    assert len(code.strip().splitlines()) <= 9
    exec(code, {})
    shown = re.findall(r"```text\n(.*?)```", README, re.DOTALL)[0]
    assert re.sub(ROUNDING, "", capsys.readouterr().out) == re.sub(ROUNDING, "", shown)


def test_readme_is_short_and_its_first_screen_shows_what_this_is() -> None:
    assert len(README.split()) <= 800
    first = README[: README.index("The paper is")]
    assert len(first.splitlines()) <= 45
    for words in ("make paper", "make test", "docs/figures/figure5.png", "```python", "```text"):
        assert words in first
    assert (ROOT / "docs" / "figures" / "figure5.png").stat().st_size > 50_000


def test_links_lead_to_files() -> None:
    for link in re.findall(r"\]\((?!http)([^)#]+)\)", README):
        assert (ROOT / link).exists(), link


def test_the_sentences_are_the_ones_that_come() -> None:
    for mistake in (lambda: dx.Circle(radius=-1e-3), lambda: dx.Circle(raduis=1e-3)):
        with pytest.raises(dx.InvalidInput) as caught:
            mistake()
        assert f"InvalidInput: {caught.value}" in README


def test_commands_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of the page on the command, one after the other, in an empty folder; README's are among them."""
    monkeypatch.chdir(tmp_path)
    assert set(commands(README)) <= {words.split(" --out cantilever.nc")[0] for words in commands(COMMAND_PAGE)}
    assert len(commands(COMMAND_PAGE)) >= 8
    for words in commands(COMMAND_PAGE):
        done = CliRunner().invoke(app, shlex.split(words), prog_name="darboux")
        assert done.exit_code == 0, f"{words}: {done.output}"
        assert done.stdout.strip()
    assert (tmp_path / "moments.svg").exists()
    assert (tmp_path / "cantilever.csv").exists()


def test_the_scenario_that_is_shown_is_solved(tmp_path: Path) -> None:
    text = re.findall(r"```toml\n(.*?)```", FILES_PAGE, re.DOTALL)[0]
    stated = scenario.parse(text)
    assert dx.solve(stated.problem, stated.method).stable
    file = tmp_path / "hanging.toml"
    for old, new in (("radius", "raduis"), ("25 cm", "25 kg")):
        file.write_text(text.replace(old, new))
        with pytest.raises(dx.InvalidInput) as caught:
            dx.load(file)
        assert f"InvalidInput: {str(caught.value).replace(str(tmp_path) + '/', '')}" in FILES_PAGE
