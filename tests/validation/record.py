"""The reference record, `validation.json`: 63 cases with their statement, digits, uncertainty and source.

Its digits come from closed forms, elliptic integrals, high-precision shooting and spectral methods, made without this
library. A quantity is looked up by words that stand in its name; what was looked up is remembered, so that a test can
say what of the record is held and what is not.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CASES: dict[str, dict[str, Any]] = {
    case["id"]: case for case in json.loads(Path(__file__).with_name("validation.json").read_text())["cases"]
}
LOOKED_UP: set[tuple[str, str]] = set()


@dataclass(frozen=True)
class Digits:
    """Values (n,) of the record, and how sure they are."""

    value: Array
    uncertainty: float = 0.0

    def __add__(self, other: Digits) -> Digits:
        """Return both one after the other."""
        return Digits(np.append(self.value, other.value), max(self.uncertainty, other.uncertainty))

    def __mul__(self, factor: float) -> Digits:
        return Digits(self.value * factor, self.uncertainty * abs(factor))


def digits(case: str, *words: str) -> Digits:
    """Return the one quantity of the case whose name contains all words, each not followed by a further
    digit; one word that is the whole name is that quantity."""
    found = _matching(case, words)
    if len(found) != 1:
        raise LookupError(f"{case} has {len(found)} quantities with {words}: {[q['name'] for q in found]}")
    quantity = found[0]
    LOOKED_UP.add((case, quantity["name"]))
    given = re.search(r"\d[\d.]*(e[-+]?\d+)?", str(quantity.get("uncertainty")))
    value = quantity.get("value_float", quantity["value"])
    return Digits(np.atleast_1d(np.array(value, dtype=float)), float(given.group()) if given else 0.0)


def stated(case: str, *words: str) -> None:
    """Note that the quantities with these words are formulas, which a test states by itself."""
    found = _matching(case, words)
    assert found, f"{case} has no quantity with {words}"
    LOOKED_UP.update((case, quantity["name"]) for quantity in found)


def _matching(case: str, words: tuple[str, ...]) -> list[dict[str, Any]]:
    if len(words) == 1 and any(q["name"] == words[0] for q in CASES[case]["quantities"]):
        return [q for q in CASES[case]["quantities"] if q["name"] == words[0]]
    patterns = [re.compile(re.escape(word) + r"(?!\.?\d)") for word in words]
    return [q for q in CASES[case]["quantities"] if all(p.search(q["name"]) for p in patterns)]
