"""The kept answers: what is kept of a solution, how two of them are compared, and the file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

import darboux as dx
from tests.frozen.problems import Frozen
from tests.rounding import turned_to

FILE = Path(__file__).parent / "answers.json"
Answer = dict[str, Any]
VECTORS = ("places", "forces", "moments")


def answer(frozen: Frozen, method: dx.Collocation) -> Answer:
    """Status code, index, places of tip and middle over L, forces, moments and energy over EI / L^2, EI / L and EI / L.

    And how many of Newton's iterations it took, which is not compared.
    """
    begin = None if frozen.start is None else dx.solve(frozen.start, method)
    x = dx.solve(frozen.problem, method, start=begin, throw=False)
    rod, held = x.problem.rod, [x.reactions.start, x.reactions.end, *x.reactions.between.values()]
    stiffness, L = rod.stiffness(np.zeros(1)), rod.length
    EI = float(np.sqrt(stiffness.EI1[0] * stiffness.EI2[0]))
    return {
        "code": x.status.code,
        "index": x.index,
        "places": [(place / L).tolist() for place in (x.tip, x.r(0.5 * L))],
        "forces": [(np.array(reaction.force) / (EI / L**2)).tolist() for reaction in held],
        "moments": [(np.array(reaction.moment) / (EI / L)).tolist() for reaction in held],
        "energy": float(x.energy.total) / (EI / L),
        "iterations": x.statistics["newton_iterations"],
    }


def difference(one: Answer, other: Answer, family: Any = None) -> tuple[float, str]:
    """Return the largest difference of two answers, and of what: infinite where status or index differ.

    Places count over L, forces, moments and energy over their largest, or over EI / L^2 and EI / L where that is larger.
    About the axis ``family`` one of them is turned as a whole so that they are nearest.
    """
    for name in ("code", "index"):
        if one[name] != other[name]:
            return np.inf, f"{name} {one[name]} and {other[name]}"
    units = [max([1.0, *np.linalg.norm(other[name], axis=1)]) if name != "places" else 1.0 for name in VECTORS]
    a, b = (
        np.concatenate([np.array(x[name]) / unit for name, unit in zip(VECTORS, units, strict=True)])
        for x in (one, other)
    )
    if a.shape != b.shape:
        return np.inf, "how many supports"
    if family is not None:
        a = turned_to(a, b, np.array(family))
    ends = np.cumsum([len(other[name]) for name in VECTORS])[:-1]
    gaps = [float(np.max(part)) for part in np.split(np.linalg.norm(a - b, axis=1), ends)]
    gaps.append(abs(one["energy"] - other["energy"]) / max(1.0, abs(other["energy"])))
    return max(gaps), (*VECTORS, "energy")[int(np.argmax(gaps))]


def read() -> dict[str, Answer]:
    return json.loads(FILE.read_text()) if FILE.exists() else {}


def write(answers: dict[str, Answer]) -> None:
    """One problem to a line, so that a change shows which."""
    lines = [f"{json.dumps(name)}: {json.dumps(kept)}" for name, kept in answers.items()]
    FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n")
