"""A quantity along the rod: one value, a table, or a function of the arc length s."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux import checks
from darboux.checks import assign, description
from darboux.errors import InvalidInput

Array = NDArray[np.float64]
Varying = Any  # a number or vector, a Table, or a function of s; checked by `profile`


@description
class Table:
    """A quantity given at points along the rod, or at times of a motion, and interpolated between them.

    Arguments: ``s`` (n,) ascending arc lengths in m, the first 0 and the last the rod's length, or times in s; ``values`` (n,),
    (n, 3), (n, 3, 3) or (n, 6, 6) in the quantity's unit; ``interpolation`` "linear" (kinks at the points) or "cubic" (a
    smooth spline).
    Raises ``InvalidInput`` where s does not ascend or the lengths differ.
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
        if s.ndim != 1 or len(s) < 2 or np.any(np.diff(s) <= 0.0) or not np.all(np.isfinite(s)):
            raise InvalidInput(
                "Table.s must hold at least two finite arc lengths (or times) in ascending order; sort it first."
            )
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

    def __call__(self, s: Array) -> Array:
        """Return the interpolated values at s: (m,), (m, 3), ...."""
        return np.asarray(self._spline(s))

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import CubicSpline, make_interp_spline

        if self.interpolation == "cubic":
            return CubicSpline(self.s, self.values)
        return make_interp_spline(self.s, self.values, k=1)


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
