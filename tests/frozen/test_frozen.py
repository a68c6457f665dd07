"""Every kept answer is found again: status, index, places, forces, moments and energy, as closely as was measured."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest

import darboux as dx
from darboux.packing import coefficients
from darboux.packing.loads import LOADS
from tests.frozen.answers import answer, difference, read
from tests.frozen.problems import CANDIDATES, Frozen

KEPT = read()
LONG = [name for name, kept in KEPT.items() if kept["long"]]
SHARP = 1e-12


def params() -> list[Any]:
    return [
        pytest.param(frozen, id=frozen.name, marks=[pytest.mark.long] if frozen.name in LONG else [])
        for frozen in CANDIDATES
    ]


@pytest.mark.parametrize("frozen", params())
def test_the_same_answer(frozen: Frozen) -> None:
    kept = KEPT[frozen.name]
    gap, of_what = difference(answer(frozen, dx.Collocation(rtol=kept["rtol"])), kept, frozen.family)
    assert gap <= kept["tolerance"], f"{of_what}: {gap:.1e}, allowed {kept['tolerance']:.0e}"


def test_every_candidate_is_kept_and_nothing_else() -> None:
    """Two hundred at least are solved each time, nearly all to twelve digits."""
    names = Counter(frozen.name for frozen in CANDIDATES)
    assert max(names.values()) == 1
    assert set(names) == set(KEPT)
    assert len(KEPT) - len(LONG) >= 200
    assert sum(kept["tolerance"] == SHARP for kept in KEPT.values()) > 0.98 * len(KEPT)
    assert {kept["index"] for kept in KEPT.values()} >= {None, 0, 1}


@pytest.mark.parametrize("name", ["example: heavy elastica", "cable over a pole", "load: end force, follower"])
def test_a_load_that_is_a_billionth_more_is_seen(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    frozen = next(frozen for frozen in CANDIDATES if frozen.name == name)
    method = dx.Collocation(rtol=KEPT[name]["rtol"])
    columns, end_load = coefficients.columns, dx.Equilibrium.end_load

    def more(*arguments: Any) -> Any:
        c = columns(*arguments)
        c[:, LOADS] *= 1.0 + 1e-9
        return c

    def more_at(self: dx.Equilibrium, at: str) -> Any:
        load = end_load(self, at)
        load.section_force = load.section_force * (1.0 + 1e-9)
        return load

    monkeypatch.setattr(coefficients, "columns", more)
    monkeypatch.setattr(dx.Equilibrium, "end_load", more_at)
    gap, _ = difference(answer(frozen, method), KEPT[name], frozen.family)
    assert gap > KEPT[name]["tolerance"], f"{gap:.1e}"


def test_what_two_answers_differ_in() -> None:
    one = {
        "code": "converged",
        "index": 0,
        "places": [[0.0, 0.6, 0.8], [0.1, 0.2, 0.3]],
        "forces": [[3.0, 0.0, 4.0], [0.0, 0.0, 0.0]],
        "moments": [[0.0, 0.1, 0.0], [0.0, 0.0, 0.0]],
        "energy": -20.0,
    }
    assert difference(one, one) == (0.0, "places")
    for name, changed, gap in (
        ("code", "folded", np.inf),
        ("index", 1, np.inf),
        ("index", None, np.inf),
        ("places", [[0.0, 0.6, 0.8], [0.1, 0.2, 0.31]], 0.01),
        ("forces", [[3.0, 0.0, 4.0], [0.0, 0.5, 0.0]], 0.1),  # over the largest, 5
        ("moments", [[0.0, 0.2, 0.0], [0.0, 0.0, 0.0]], 0.1),  # over 1
        ("energy", -19.0, 1 / 20),
    ):
        found, of_what = difference(one | {name: changed}, one)
        assert found == pytest.approx(gap)
        assert of_what.startswith(name)
    turned = one | {
        "places": [[-0.6, 0.0, 0.8], [-0.2, 0.1, 0.3]],
        "forces": [[0.0, 3.0, 4.0], [0.0, 0.0, 0.0]],
        "moments": [[-0.1, 0.0, 0.0], [0.0, 0.0, 0.0]],
    }
    assert difference(turned, one)[0] > 0.5
    assert difference(turned, one, (0.0, 0.0, 1.0))[0] < 1e-15
