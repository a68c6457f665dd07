"""What README shows is run, block by block."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import darboux as dx

README = (Path(__file__).parent.parent / "README.md").read_text()
BLOCKS = re.findall(r"```python\n(.*?)```", README, re.DOTALL)


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.splitlines()[0])
def test_examples_run(block: str, capsys: pytest.CaptureFixture[str]) -> None:
    exec(block, {})
    assert capsys.readouterr().out.strip()


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
