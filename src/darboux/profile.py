"""A quantity along the rod: one value, a table, or a function of the arc length s."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux import checks, interpolation
from darboux.checks import assign, description
from darboux.errors import InvalidInput

Array = NDArray[np.float64]
Varying = Any  # a number or vector, a Table, or a function of s; checked by `profile`


@description
class Table:
    """A quantity given in rows along the rod, or at times of a motion, and interpolated between them.

    ``interpolation`` says how a value between two rows is found:

        "cubic"    a cubic spline, of order 4 for smooth data, which stays between the two rows' values except at an extremum
                   of smooth rows, and never changes a sign that both rows have: a stepped quantity does not overshoot
        "linear"   a straight line from row to row, with kinks at the rows

    A jump is the same s twice, with the values before and behind it: at that s the value behind the jump holds, and on either side
    the rows are interpolated by themselves. A steep ramp between two rows is taken as it is. Rows may be as dense as they were
    measured (100,000 are no trouble): methods average them, to an error that is part of their estimate.

    Arguments: ``s`` (n,) ascending arc lengths in m, the first 0 and the last the rod's length, or times in s; ``values`` (n,),
    (n, 3), (n, 3, 3) or (n, 6, 6) in the quantity's unit.
    Raises ``InvalidInput`` where s does not ascend, holds one place more than twice or an end twice, or the lengths differ.
    Source: the rule for extrema is that of H. T. Huynh, SIAM J. Numer. Anal. 30 (1993) 57; the region of slopes that keep a
    cubic monotone is that of F. N. Fritsch and R. E. Carlson, SIAM J. Numer. Anal. 17 (1980) 238.
    """

    s: Any
    values: Any
    interpolation: str = "cubic"

    def __post_init__(self) -> None:
        try:
            s, values = checks.real_array(self.s), checks.real_array(self.values)
        except (TypeError, ValueError, OverflowError):
            raise InvalidInput(
                f"Table takes two arrays of real numbers, but came s = {checks.shown(self.s)}, values = "
                f"{checks.shown(self.values)}."
            ) from None
        checks.choice("Table.interpolation", self.interpolation, ("linear", "cubic"))
        if s.ndim != 1 or len(s) < 2 or np.any(np.diff(s) < 0.0) or not np.all(np.isfinite(s)):
            raise InvalidInput(
                "Table.s must hold at least two finite arc lengths (or times) in ascending order; sort it first."
            )
        self._check_jumps(s)
        if values.shape[:1] != s.shape or values.shape[1:] not in ((), (3,), (3, 3), (6, 6)):
            raise InvalidInput(
                f"Table.values has the shape {values.shape}; it must hold {len(s)} numbers or {len(s)} x 3, like Table.s, or as "
                "many matrices of 3 x 3 or 6 x 6."
            )
        if not np.all(np.isfinite(values)):
            place = int(np.argmax(~np.isfinite(values.reshape(len(s), -1)).all(axis=1)))
            raise InvalidInput(
                f"Table.values is not finite at s = {s[place]:g} m (row {place}); mend or leave out that row."
            )
        assign(self, s=tuple(s.tolist()), values=_tuples(values.tolist()))

    @staticmethod
    def _check_jumps(s: Array) -> None:
        same = np.flatnonzero(np.diff(s) == 0.0)
        thrice = same[:-1][np.diff(same) == 1]
        if len(thrice):
            raise InvalidInput(
                f"Table.s holds {s[thrice[0]]:g} more than twice; a jump is the same s twice, with the values before and behind it."
            )
        at_ends = same[(same == 0) | (same == len(s) - 2)]
        if len(at_ends):
            raise InvalidInput(
                f"Table.s holds its {'first' if at_ends[0] == 0 else 'last'} place, {s[at_ends[0]]:g}, twice; a jump lies between "
                "the ends. Leave one of the two rows out."
            )

    def __call__(self, s: Array) -> Array:
        """Return the interpolated values at s, at a jump those behind it: (m,), (m, 3), ...."""
        return interpolation.value(*self._cubics, s)

    @property
    def jumps(self) -> tuple[float, ...]:
        """The places of the jumps, each once."""
        return tuple(a for a, b in pairwise(self.s) if a == b)

    @cached_property
    def _cubics(self) -> tuple[Array, Array]:
        """The places (n,) from which cubics run, and their coefficients (4, n - 1, ...)."""
        s, values = np.array(self.s), np.array(self.values)
        behind = np.flatnonzero(np.diff(s) == 0.0) + 1
        parts = [
            interpolation.piecewise_cubic(*rows, smooth=self.interpolation == "cubic")
            for rows in zip(np.split(s, behind), np.split(values, behind), strict=True)
        ]
        return np.unique(s), np.concatenate(parts, axis=1)


class Profile:
    """A checked quantity along the rod, of shape (), (3,), ...: call it with s (n,) to get (n,), (n, 3), ...."""

    def __init__(self, field: str, value: Varying, shape: tuple[int, ...], unit: str, sign: str) -> None:
        self.field, self.shape, self.unit, self.sign = field, shape, unit, sign
        self.constant = not callable(value)
        self.breaks: tuple[float, ...] = value.s if isinstance(value, Table) else ()
        if self.constant:
            value = checks.array(field, value, shape, unit) if shape else checks.number(field, value, unit)
            self._check(np.asarray(value)[None], value)
        self._value: Any = value

    def __call__(self, s: Array) -> Array:
        """Return the checked values at s (n,)."""
        if self.constant:
            return np.broadcast_to(np.asarray(self._value), (len(s), *self.shape)).copy()
        values = evaluate(self.field, self._value, s, self.shape)
        self._check(values, None, s)
        return values

    def _check(self, values: Array, came: object, s: Array | None = None) -> None:
        if self.sign == "any":
            return
        if self.sign == "definite":
            checks.definite(self.field, values, [""] if s is None else [f" at s = {place:g} m" for place in s])
            return
        bad = values <= 0.0 if self.sign == "positive" else values < 0.0
        if not np.any(bad):
            return
        if s is None:
            (checks.positive if self.sign == "positive" else checks.not_negative)(self.field, came, self.unit)
        place = int(np.argmax(bad))
        raise InvalidInput(
            f"{self.field} is {checks.with_unit(float(values[place]), self.unit)} at s = {float(s[place]):g} m; "  # type: ignore[index]
            f"it must be {'positive' if self.sign == 'positive' else 'zero or more'} all along the rod."
        )


def evaluate(field: str, function: Callable[[Array], Any], s: Array, shape: tuple[int, ...]) -> Array:
    """Call a user's vectorised function of s and check what it returns: (n,) + shape, finite."""
    what = "Table" if isinstance(function, Table) else "function"
    numbers = {(): "one real number", (3,): "three real numbers"}.get(
        shape, f"{' x '.join(map(str, shape))} real numbers"
    )
    try:
        raw = function(s.copy())
        if isinstance(raw, tuple | list) and shape == (3,) and any(np.ndim(component) for component in raw):
            raw = np.stack(np.broadcast_arrays(*raw, s)[:-1], axis=-1)  # three components, each an array or a number
        values = checks.real_array(raw)
    except InvalidInput:
        raise
    except Exception as error:
        raise InvalidInput(
            f"{field} is a function that failed on an array of {len(s)} arc lengths: {type(error).__name__}: {error}. "
            f"It must take a NumPy array s and return {numbers} for each."
        ) from error
    if values.shape == shape:  # a function that returns a constant
        values = np.broadcast_to(values, (len(s), *shape)).copy()
    if values.shape != (len(s), *shape):
        raise InvalidInput(
            f"{field} is a {what} that gave the shape {values.shape} for {len(s)} arc lengths; "
            f"it must give {(len(s), *shape)}."
        )
    if not np.all(np.isfinite(values)):
        place = int(np.argmax(~np.isfinite(values.reshape(len(s), -1)).all(axis=1)))
        raise InvalidInput(f"{field} is not finite at s = {s[place]:g} m; it must be finite all along the rod.")
    return values


def arguments_of(value: object) -> int:
    """Return how many arguments without defaults a function takes; 1 where it can't be told, 0 for anything else."""
    if not callable(value) or isinstance(value, Table):
        return 0
    try:
        parameters = inspect.signature(value).parameters.values()
    except (TypeError, ValueError):
        return 1
    kinds = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    return sum(1 for p in parameters if p.kind in kinds and p.default is inspect.Parameter.empty)


def scalar(field: str, value: Varying, unit: str = "", sign: str = "positive") -> Profile:
    """Return the profile of a scalar quantity; sign is "positive", "not negative" or "any"."""
    return Profile(field, value, (), unit, sign)


def vector(field: str, value: Varying, unit: str = "") -> Profile:
    """Return the profile of a vector quantity."""
    return Profile(field, value, (3,), unit, "any")


def matrix(field: str, value: Varying, size: int) -> Profile:
    """Return the profile of a symmetric, positive definite matrix."""
    return Profile(field, value, (size, size), "", "definite")


def frozen(value: Varying) -> Varying:
    """Return a value that can be hashed: arrays and lists become tuples, tables and functions stay."""
    if callable(value) or value is None or isinstance(value, str):
        return value
    return _tuples(np.asarray(value, dtype=float).tolist())


def _tuples(nested: Any) -> Any:
    return tuple(map(_tuples, nested)) if isinstance(nested, list) else nested
