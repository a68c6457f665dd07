"""Write the kept answers of tests/frozen anew: every candidate is solved, and what converges is kept.

    python -m tests.tools.freeze              all of them, some minutes
    python -m tests.tools.freeze "ring"       those whose name contains one of the words; the others stay

To be run only where an answer has changed for a reason that is understood, which the commit then says: the file is there so
that nothing changes unseen. How closely an answer is compared is measured: it is solved again from disturbed states, which
lead to other meshes, and with five stages. The tolerance is 1e-12 where three times what these differ by is less, else 1e-9,
the default method's own; one that differs by more is left out, and named. What takes more than 150 of Newton's iterations
is marked long.
"""

from __future__ import annotations

import sys
from typing import Any

import darboux as dx
from tests.frozen.answers import Answer, answer, difference, read, write
from tests.frozen.problems import CANDIDATES, Frozen
from tests.rounding import disturbed

RTOLS = (1e-12, 1e-9)  # the first at which a problem converges
SEEDS = (1, 2)  # of the disturbances
SURE = 3.0
TOLERANCES = (1e-12, 1e-9)
LONG = 150  # iterations of Newton's method from which on a problem is left to `make validate`


def frozen_answer(frozen: Frozen) -> Answer | str:
    """Return what is kept of a problem, or in words why nothing is."""
    for rtol in RTOLS:
        found = answer(frozen, dx.Collocation(rtol=rtol))
        if found["code"] == "converged":
            break
    else:
        return f"does not converge: {found['code']}"
    others: list[Any] = []
    for seed in SEEDS:
        with disturbed(seed):
            others.append(answer(frozen, dx.Collocation(rtol=rtol)))
    others.append(answer(frozen, dx.Collocation(rtol=rtol, stages=5)))
    gap, of_what = max((difference(other, found, frozen.family) for other in others), key=lambda pair: pair[0])
    tolerance = next((tolerance for tolerance in TOLERANCES if tolerance >= SURE * gap), None)
    if tolerance is None:
        return f"is not the same twice: {of_what}, {gap:.1e}"
    long = found.pop("iterations") > LONG
    return {"rtol": rtol, "tolerance": tolerance, "measured": float(f"{gap:.1e}"), "long": long} | found


def main(words: list[str]) -> int:
    kept, result = read(), {}
    for frozen in CANDIDATES:
        if words and not any(word in frozen.name for word in words):
            found: Answer | str | None = kept.get(frozen.name)
        else:
            found = frozen_answer(frozen)
            told = found if isinstance(found, str) else f"{found['tolerance']:.0e}, measured {found['measured']:.1e}"
            print(f"{frozen.name}: {told}", flush=True)
        if isinstance(found, dict):
            result[frozen.name] = found
    write(result)
    print(f"{len(result)} of {len(CANDIDATES)} are kept.")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
