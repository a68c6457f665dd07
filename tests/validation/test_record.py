"""Nothing of the record is forgotten: every quantity is held by a test, or left out with a reason."""

from __future__ import annotations

import importlib
from pathlib import Path

import darboux as dx
from tests.validation import judging
from tests.validation.left_out import LEFT_OUT
from tests.validation.record import CASES, LOOKED_UP

for _path in sorted(Path(__file__).parent.glob("test_*.py")):
    if _path.stem != Path(__file__).stem:
        importlib.import_module(f"tests.validation.{_path.stem}")


def _left_out(case: str, name: str) -> bool:
    return any(case == of and words in name for of, words, _ in LEFT_OUT)


def test_every_quantity_is_held_or_left_out_with_a_reason() -> None:
    forgotten = [
        f"{case}: {quantity['name']}"
        for case, record in CASES.items()
        for quantity in record["quantities"]
        if (case, quantity["name"]) not in LOOKED_UP and not _left_out(case, quantity["name"])
    ]
    assert not forgotten, "\n".join(forgotten)


def test_what_is_left_out_is_in_the_record() -> None:
    for case, words, _ in LEFT_OUT:
        names = [quantity["name"] for quantity in CASES[case]["quantities"]]
        assert any(words in name for name in names), f"{case}: {words}"
        assert words or not any(of == case for of, _ in LOOKED_UP), f"{case} is held and left out"


def test_every_method_is_held_to_the_record() -> None:
    exported = {name for name in dx.__all__ if hasattr(getattr(dx, name), "refuses")}
    assert {type(method).__name__ for method in judging.ALL} == exported
