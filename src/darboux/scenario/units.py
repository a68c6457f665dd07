"""Quantities with units, as in "25 cm": to SI, rounded once."""

from __future__ import annotations

import re
from decimal import Decimal
from functools import cache
from typing import Any

from darboux.checks import did_you_mean, shown

# Those of everyday files; pint knows the rest, and takes half a second to load.
FAMILIAR = {
    "m": {"m": "1", "cm": "1e-2", "mm": "1e-3", "um": "1e-6", "nm": "1e-9", "km": "1e3"},
    "Pa": {"Pa": "1", "kPa": "1e3", "MPa": "1e6", "GPa": "1e9"},
    "kg/m^3": {"kg/m^3": "1", "g/cm^3": "1e3"},
    "m/s^2": {"m/s^2": "1"},
    "N": {"N": "1", "mN": "1e-3", "uN": "1e-6", "kN": "1e3"},
    "N m": {"N m": "1"},
    "N m^2": {"N m^2": "1"},
    "N/m": {"N/m": "1"},
    "kg/m": {"kg/m": "1", "g/m": "1e-3"},
    "1/m": {"1/m": "1"},
    "rad/s": {"rad/s": "1"},
    "rad": {"rad": "1"},
    "V/m": {"V/m": "1"},
    "C/m": {"C/m": "1"},
    "s": {"s": "1", "ms": "1e-3", "us": "1e-6"},
    "1/s": {"1/s": "1"},
    "kg m": {"kg m": "1"},
    "N s/m^2": {"N s/m^2": "1"},
    "N s^2/m^3": {"N s^2/m^3": "1"},
    "m/s": {"m/s": "1", "cm/s": "1e-2", "mm/s": "1e-3"},
}
SIMPLE = ("m", "mm", "N", "Pa", "kg", "rad", "s", "V", "C")  # of which the others are made
EXAMPLE = {"m": "25 cm", "Pa": "1 MPa", "kg/m^3": "1000 kg/m^3", "N": "2 N", "s": "10 ms", "rad": "90 deg"}
QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,6})?)\s*(.*?)\s*")
DECIMAL_COMMA = re.compile(r"(?<=\d),(?=\d)")
THOUSANDS = re.compile(r",\d{3}(?!\d)")
GROUPED = re.compile(r"\d+(?:[.,]\d+){2,}")  # more than one sign: those before the last part thousands
NAME = r"[A-Za-zµμΩ°%]+(?:(?:\*\*|\^)-?\d)?"
UNIT = re.compile(
    rf"(?:1?\s*/\s*)?{NAME}(?:(?:\s*[*/·]\s*|\s+){NAME}){{0,7}}"
)  # nothing that pint would compute at length
LONGEST_UNIT, LONGEST_QUANTITY = 60, 500  # letters


def _ungrouped(number: str) -> str:
    """Return a number without signs between its thousands: "1.000,5" and "1,000.5" are 1000.5."""
    sign = "." if number.rfind(".") > number.rfind(",") else ","
    whole, _, rest = number.rpartition(sign)
    plain = whole.replace(".", "").replace(",", "")
    return plain + ("." if number.count(sign) == 1 else "") + rest


def si(value: Any, unit: str) -> float:
    """Return a plain number (SI) or a text such as "25 cm" in ``unit``; a ValueError says what it must be."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError(f"it must be {asked(unit)}")
    if not isinstance(value, str):
        return _finite(value)
    match = QUANTITY.fullmatch(value) if len(value) <= LONGEST_QUANTITY else None
    if (match is None or match[2].startswith(",")) and len(value) <= LONGEST_QUANTITY and DECIMAL_COMMA.search(value):
        point, none = (DECIMAL_COMMA.sub(sign, value.strip(), count=1) for sign in (".", ""))
        either = f"{point!r}, or {none!r} where it parts thousands" if THOUSANDS.search(value) else f"{point!r}"
        if GROUPED.search(value):
            either = repr(GROUPED.sub(lambda match: _ungrouped(match[0]), value.strip(), count=1))
        raise ValueError(f"a number has a decimal point; write {either}")
    if match is None or not unit:
        raise ValueError(f"it must be {asked(unit)}")
    if not match[2]:
        raise ValueError(f"its unit is missing; write {match[1] + ' ' + unit!r}, or the plain number {match[1]}")
    try:
        return _finite(Decimal(match[1]) * factor(match[2], unit))
    except ArithmeticError:
        raise ValueError("it must be a finite number") from None


def asked(unit: str) -> str:
    """Return in words what a quantity of this unit may be."""
    if not unit:
        return "a plain number"
    return f"a number in {unit}, or a text with a unit such as {EXAMPLE.get(unit, '1 ' + unit.removeprefix('1'))!r}"


def _finite(value: Any) -> float:
    try:
        number = float(value)
    except OverflowError:
        number = float("inf")
    if not abs(number) < float("inf"):
        raise ValueError("it must be a finite number")
    return number


@cache
def factor(text: str, unit: str) -> Decimal:
    """Return how many ``unit`` the unit in words is, as an exact decimal where it is one; ValueError where it is none."""
    familiar = FAMILIAR.get(unit, {}).get(text)
    if familiar is not None:
        return Decimal(familiar)
    if len(text) > LONGEST_UNIT or not UNIT.fullmatch(text):
        raise ValueError(f"its unit {shown(text)} can't be read; write products, quotients and powers, as in 'N/m^2'")
    if "rad" in unit and re.search(r"%|percent|pp[mb]", text):  # what pint takes for rad
        raise ValueError(f"its unit {text!r} is of another kind; it must be {asked(unit)}")
    import pint

    pint_units = _registry()
    try:
        return Decimal(repr(float(pint_units.Quantity(1.0, text if text[0] != "/" else "1" + text).to(unit).magnitude)))
    except pint.UndefinedUnitError as error:
        unknown = str(error.unit_names[0])
        known = [*FAMILIAR.get(unit, ()), *(("deg", "turn") if unit == "rad" else () if unit.isalpha() else SIMPLE)]
        hint = did_you_mean(unknown, known)
        raise ValueError(f"its unit {unknown!r} is not known; write {asked(unit)}{'.' * bool(hint)}{hint}") from None
    except pint.DimensionalityError:
        raise ValueError(f"its unit {text!r} is of another kind; it must be {asked(unit)}") from None
    except (pint.PintError, ArithmeticError, TypeError, ValueError, AttributeError):
        raise ValueError(f"its unit {text!r} can't be read; it must be {asked(unit)}") from None


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()
