"""The unit in which numbers are readable: 25 cm, not 0.25 m; 3 nN, not 3e-9 N."""

from __future__ import annotations

import math

LENGTHS = (("km", 1e3), ("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("µm", 1e-6), ("nm", 1e-9))
PER_LENGTH = (("1/nm", 1e9), ("1/µm", 1e6), ("1/mm", 1e3), ("1/m", 1.0), ("1/km", 1e-3))
TIMES = (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6), ("ns", 1e-9))
PREFIXES = (
    *(("G", 1e9), ("M", 1e6), ("k", 1e3), ("", 1.0), ("m", 1e-3), ("µ", 1e-6), ("n", 1e-9), ("p", 1e-12)),
    *(("f", 1e-15), ("a", 1e-18), ("z", 1e-21), ("y", 1e-24)),
)


def length(extent: float) -> tuple[str, float]:
    """Return the unit for lengths up to ``extent`` in m, which is then 2 or more, and its size in m."""
    return _fitting(LENGTHS, extent / 2.0)


def quantity(largest: float, unit: str) -> tuple[str, float]:
    """Return the unit for values up to ``largest`` in the SI ``unit``, with its prefix, and its size in it.

    As in ``quantity(2e-9, "N m")``, which is ("nN m", 1e-9).
    """
    if not 0.0 < largest < math.inf:
        return unit, 1.0
    known = {"m": LENGTHS, "1/m": PER_LENGTH, "s": TIMES}
    return _fitting(known.get(unit) or tuple((prefix + unit, size) for prefix, size in PREFIXES), largest)


def round_number(value: float) -> float:
    """Return the nearest of 1, 2, 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(max(value, 1e-300)))
    return power * min((1.0, 2.0, 5.0, 10.0), key=lambda digit: abs(digit - value / power))


def _fitting(units: tuple[tuple[str, float], ...], largest: float) -> tuple[str, float]:
    return next(((name, size) for name, size in units if largest >= size * (1.0 - 1e-9)), units[-1])
