"""Any scenario and any result, however damaged, is read or refused in a sentence: never an exception of a library.

DARBOUX_FUZZ=N (`make fuzz`) tries 5 N mutations of each kind; the test run some hundreds, always the same.
"""

from __future__ import annotations

import os
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import darboux as dx
from darboux import cli, scenario
from darboux.cli.new import TEMPLATES

MUTATIONS = 5 * int(os.environ.get("DARBOUX_FUZZ", "60"))
SEED = random.randrange(10**9) if "DARBOUX_FUZZ" in os.environ else 1
WORDS = [
    "nan",
    "inf",
    "1e400",
    "-1",
    "0",
    '"1 kg"',
    '"1 parsec"',
    "[]",
    "{}",
    "[[",
    "true",
    '""',
    "1979-05-27",
    "\x00",
    "é",
    "=",
]
WORDS += ["9" * 400, "[1, 2]", "{ s = [0, 1], values = [1, 2] }"]
TEXTS = [(Path(cli.__file__).parent / "templates" / f"{name}.toml").read_text() for name in TEMPLATES]


def mutated(text: str, chance: random.Random) -> str:
    """Return the text with one to three words, lines or letters lost, doubled, moved or replaced."""
    for _ in range(chance.randint(1, 3)):
        lines = text.split("\n")
        i, j = chance.randrange(len(lines)), chance.randrange(len(lines))
        match chance.randrange(6):
            case 0:
                del lines[i]
            case 1:
                lines.insert(j, lines[i])
            case 2:
                lines[i], lines[j] = lines[j], lines[i]
            case 3:
                key, sign, _ = lines[i].partition("=")
                lines[i] = key + sign + " " + chance.choice(WORDS)
            case 4:
                at = chance.randrange(len(lines[i]) + 1)
                lines[i] = lines[i][:at] + chance.choice(WORDS) + lines[i][at:]
            case 5:
                at = chance.randrange(len(lines[i]) + 1)
                lines[i] = lines[i][:at] + lines[i][at + 1 :]
        text = "\n".join(lines)
    return text


def refusal(read: Callable[[], Any]) -> str:
    """Return the sentence of a refusal, empty where it was read."""
    try:
        read()
    except dx.InvalidInput as error:
        return str(error)
    return ""


@pytest.mark.parametrize("seed", [SEED])
def test_any_scenario_is_read_or_refused_in_a_sentence(seed: int) -> None:
    chance = random.Random(seed)
    refused = 0
    for _ in range(MUTATIONS):
        text = mutated(chance.choice(TEXTS), chance)
        said = refusal(lambda text=text: scenario.parse(text))
        refused += bool(said)
        assert "\n" not in said, text
        assert len(said) < 600, text
    assert 0.3 < refused / MUTATIONS < 1.0


@pytest.mark.parametrize("seed", [SEED])
def test_any_result_is_read_or_refused_in_a_sentence(seed: int, tmp_path: Path) -> None:
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7))
    solution = dx.solve(dx.Equilibrium(rod, loads=[dx.EndForce((0.5, 0, 0))]))
    path = tmp_path / "a.nc"
    solution.save(path)
    whole = path.read_bytes()
    chance = random.Random(seed)
    for _ in range(MUTATIONS):
        content = bytearray(whole)
        for _ in range(chance.choice([1, 1, 1, 10, 100])):
            content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
        if chance.randrange(10) == 0:
            del content[chance.randrange(len(content)) :]
        path.write_bytes(content)
        said = refusal(lambda: dx.open(path))
        assert "damaged" in said or content == whole
        assert "\n" not in said
