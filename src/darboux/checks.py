"""Validation at the boundary: each check returns the clean value or raises ``InvalidInput`` in one sentence."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import math
from collections.abc import Callable, Iterable
from typing import Any, ParamSpec, TypeVar, dataclass_transform

import numpy as np
from numpy.typing import NDArray

from darboux.errors import InvalidInput

Vector = tuple[float, float, float]
ROUNDING = 1e-14  # of a unit vector's or a frame's length
ONE_PLACE = 1e-12  # of the rod's length: places along it that are no farther apart are the same
SHORTEST, LONGEST = 1e-15, 1e9  # m: what a length may be
P = ParamSpec("P")
T = TypeVar("T")

FEWEST_LETTERS, MOST_NEAR = 2, 3  # of a word that is taken for the beginning of another; suggestions at a time
# What else people call the words of files, bare of capitals and signs.
SYNONYMS = {
    **dict.fromkeys(("fixed", "fix", "builtin", "encastre", "cantilever", "welded", "rigid"), ("clamped",)),
    **dict.fromkeys(("ball", "balljoint", "simple", "simplysupported"), ("pinned",)),
    **dict.fromkeys(("hinged", "joint"), ("hinge", "pinned")),
    **dict.fromkeys(("weight", "selfweight", "ownweight"), ("gravity",)),
    **dict.fromkeys(("tipforce", "endload", "tipload"), ("end_force",)),
    **dict.fromkeys(("pointload", "concentratedforce"), ("point_force", "end_force")),
    **dict.fromkeys(("lineload", "distributedload", "distributedforce", "uniformload"), ("line_force",)),
    **dict.fromkeys(("torque", "tiptorque", "tipmoment"), ("end_moment",)),
    **dict.fromkeys(("circular", "round", "rod", "wire"), ("circle",)),
    **dict.fromkeys(("pipe", "hollow", "ring", "annulus"), ("tube",)),
    **dict.fromkeys(("square", "strip", "rectangular", "box"), ("rectangle",)),
    **dict.fromkeys(("youngsmodulus", "youngmodulus", "young", "modulus", "elasticmodulus"), ("E",)),
    **dict.fromkeys(("poisson", "poissonratio", "poissonsratio"), ("nu",)),
    **dict.fromkeys(("shearmodulus",), ("G",)),
    **dict.fromkeys(("rho", "massdensity"), ("density",)),
    **dict.fromkeys(("thickness", "depth"), ("height", "radius")),
    **dict.fromkeys(("position", "location", "s", "place"), ("at",)),
    **dict.fromkeys(("timestep", "dt"), ("step",)),
    **dict.fromkeys(("time", "tend", "t"), ("duration",)),
    **dict.fromkeys(("solver",), ("method",)),
    **dict.fromkeys(("der", "discreterods"), ("discrete_rod",)),
    **dict.fromkeys(("bvp",), ("collocation",)),
    **dict.fromkeys(("iron",), ("steel",)),
    **dict.fromkeys(("aluminum",), ("aluminium",)),
}

MOST_SEGMENTS = 100_000  # of a discrete rod
ASYMMETRY, SINGULAR = 1e-9, 1e-12  # of a stiffness matrix, its diagonal scaled to one: rounding of what was typed


def shown(value: object) -> str:
    """Return a value as a person would read it back: short, numbers without type names."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, np.ndarray):
        value = value.tolist()
    try:
        text = repr(value)
    except ValueError:  # Python does not write whole numbers of thousands of digits
        return "a number of thousands of digits"
    return text if len(text) <= 80 else text[:77] + "..."


def with_unit(value: object, unit: str) -> str:
    """Return the value as shown, with its unit."""
    return f"{shown(value)} {unit}".rstrip()


def number(field: str, value: object, unit: str = "") -> float:
    """Return a finite float, or say that ``field`` must be one."""
    if isinstance(value, bool | str | bytes) or value is None:
        raise InvalidInput(f"{field} is {shown(value)}; it must be a number{in_unit(unit)}.")
    try:
        result = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise InvalidInput(f"{field} is {shown(value)}; it must be a single number{in_unit(unit)}.") from None
    if not math.isfinite(result):
        raise InvalidInput(f"{field} is {with_unit(value, unit)}; it must be a finite number.")
    return result


def in_unit(unit: str) -> str:
    """Return " in m" for the unit m, nothing for no unit."""
    return f" in {unit}" if unit else ""


def positive(field: str, value: object, unit: str = "") -> float:
    """Return a finite float above zero; a negative one gets a suggestion."""
    result = number(field, value, unit)
    if result <= 0.0:
        hint = f" Did you mean {-result:g}?" if result < 0.0 else ""
        raise InvalidInput(f"{field} is {with_unit(value, unit)}; it must be positive.{hint}")
    if unit == "m" and not SHORTEST <= result <= LONGEST:
        raise InvalidInput(
            f"{field} is {with_unit(value, unit)}; lengths are from {SHORTEST:g} to {LONGEST:g} m here. Check its unit."
        )
    return result


def not_negative(field: str, value: object, unit: str = "") -> float:
    """Return a finite float of zero or more."""
    result = number(field, value, unit)
    if result < 0.0:
        raise InvalidInput(f"{field} is {with_unit(value, unit)}; it must not be negative. Did you mean {-result:g}?")
    return result


def whole(field: str, value: object, least: int, most: int | None = None) -> int:
    """Return an int of at least ``least`` and at most ``most``, beyond which memory or time would not do."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise InvalidInput(f"{field} is {shown(value)}; it must be a whole number, {least} or more.")
    if value < least:
        raise InvalidInput(f"{field} is {shown(value)}; it must be {least} or more.")
    if most is not None and value > most:
        raise InvalidInput(f"{field} is {shown(value)}; it must lie between {least} and {most}, for memory and time.")
    return int(value)


def choice(field: str, value: object, allowed: Iterable[str]) -> str:
    """Return one of the allowed words, or suggest the nearest."""
    words = list(allowed)
    if isinstance(value, str) and value in words:
        return value
    raise InvalidInput(
        f"{field} is {shown(value)}; allowed are {', '.join(map(repr, words))}.{did_you_mean(value, words)}"
    )


def did_you_mean(came: object, allowed: Iterable[str]) -> str:
    """Return " Did you mean 'radius'?" with the allowed words nearest to what came; nothing where none is near."""
    words = near(came, allowed)
    return f" Did you mean {' or '.join(map(repr, words))}?" if words else ""


def near(came: object, allowed: Iterable[str]) -> list[str]:
    """Return the allowed words that were most likely meant, few or none.

    First those that differ in capitals, signs and spaces only; then what a mechanician may call them; then those that
    begin or end with what came, or with which it begins; then those that are a slip or two of the keyboard away.
    """
    words, key = list(allowed), _bare(str(came)[:100])
    bare = {word: _bare(word) for word in words}
    if not key:
        return []
    found = [word for word in words if bare[word] == key]
    found = found or [word for word in words if word in SYNONYMS.get(key, ())]
    if not found and len(key) >= FEWEST_LETTERS:
        found = [word for word in words if bare[word].startswith(key)]
        found = found or [word for word in words if bare[word].endswith(key)]
        found = found or [word for word in words if len(bare[word]) > FEWEST_LETTERS and key.startswith(bare[word])]
        # all but the last letter: the plural of a word in -y
        found = found or [
            word for word in words if len(bare[word]) > FEWEST_LETTERS + 1 and key.startswith(bare[word][:-1])
        ]
    if not found:
        slips = {word: _slips(key, bare[word]) for word in words}
        least = min(slips.values(), default=0)
        found = [word for word in words if slips[word] == least and least <= _allowed(key, bare[word])]
        found = [word for word in found if len(bare[word]) == len(key)] or found
    return found if len(found) <= MOST_NEAR else []


def _bare(word: str) -> str:
    return "".join(c for c in word.casefold() if c.isalnum() or c in "%/^*")


def _allowed(one: str, other: str) -> int:
    """Return how many slips may lie between two words: one in three letters."""
    shorter = min(len(one), len(other), 9)
    return max(shorter // 3, int(shorter > 1))


def _slips(one: str, other: str) -> int:
    """Return how many letters are to be put in, left out, changed or swapped with their neighbours."""
    rows = [list(range(len(other) + 1))]
    for i, a in enumerate(one, 1):
        row = [i]
        for j, b in enumerate(other, 1):
            slips = min(rows[-1][j] + 1, row[-1] + 1, rows[-1][j - 1] + (a != b))
            if i > 1 and j > 1 and (a, b) == (other[j - 2], one[i - 2]):
                slips = min(slips, rows[-2][j - 2] + 1)
            row.append(slips)
        rows.append(row)
    return rows[-1][-1]


def array(field: str, value: object, shape: tuple[int, ...], unit: str = "") -> NDArray[np.float64]:
    """Return a new float array of the given shape with finite entries; the caller's array is never kept."""
    words = " x ".join(map(str, shape))
    try:
        result = real_array(value)
    except (TypeError, ValueError, OverflowError):
        raise InvalidInput(f"{field} is {shown(value)}; it must be {words} numbers{in_unit(unit)}.") from None
    if result.shape != shape:
        raise InvalidInput(f"{field} is {shown(value)}; it must be {words} numbers{in_unit(unit)}.")
    if not np.all(np.isfinite(result)):
        raise InvalidInput(f"{field} is {with_unit(value, unit)}; every component must be a finite number.")
    return result


def rows(field: str, value: object, width: int, unit: str = "") -> NDArray[np.float64]:
    """Return a new float array of one row or more of ``width`` finite numbers."""
    try:
        result = real_array(value)
    except (TypeError, ValueError, OverflowError):
        result = np.empty(0)
    if result.ndim != 2 or result.shape[1] != width or not len(result):
        raise InvalidInput(f"{field} is {shown(value)}; it must be rows of {width} numbers{in_unit(unit)}.")
    return array(field, result, result.shape, unit)


def real_array(value: object) -> NDArray[np.float64]:
    """Return a new float array; raises ``TypeError`` or ``ValueError`` for text, complex numbers and ragged lists."""
    raw = np.array(value)
    if raw.dtype.kind not in "biuf":
        raw = np.array(value, dtype=object)
        if any(not isinstance(x, int | float | np.integer | np.floating) for x in raw.ravel()):
            raise TypeError("not real numbers")
    return raw.astype(float)


def vector(field: str, value: object, unit: str = "") -> Vector:
    """Return three finite floats as a tuple, so that descriptions stay frozen and hashable."""
    x, y, z = array(field, value, (3,), unit).tolist()
    return (x, y, z)


def direction(field: str, value: object) -> Vector:
    """Return a unit vector along ``value``."""
    given = array(field, value, (3,))
    scale = max(float(np.max(np.abs(given))), 1e-300)  # so that no length overflows
    length = float(np.linalg.norm(given / scale))
    if length < 0.5:
        raise InvalidInput(f"{field} is {shown(value)}; a direction must have a length above zero.")
    if abs(scale * length - 1.0) > ROUNDING:  # else it stays as it is, so that a copy is equal
        given = given / scale / length
    x, y, z = given.tolist()
    return (x, y, z)


def rotation(field: str, value: object) -> NDArray[np.float64]:
    """Return a right-handed orthonormal 3 x 3 frame whose columns are d1, d2, d3."""
    matrix = array(field, value, (3, 3))
    fault = float(np.max(np.abs(matrix.T @ matrix - np.eye(3))))
    if fault > 1e-6:
        raise InvalidInput(
            f"{field} is not orthonormal (off by {fault:.2g}); its columns d1, d2, d3 must be unit vectors at right angles."
        )
    if np.linalg.det(matrix) < 0.0:
        raise InvalidInput(f"{field} is left-handed; darboux uses d3 = d1 x d2. Flip the sign of its second column.")
    if fault < ROUNDING:
        return matrix  # as it came, so that a copy is equal
    left, _, right = np.linalg.svd(matrix)
    return np.asarray(left @ right)  # the nearest exact rotation


def flag(field: str, value: object) -> bool:
    """Return True or False."""
    return bool(instance(field, value, (bool, np.bool_), "True or False"))


def stiffness_matrix(field: str, value: object, unit: str) -> tuple[Vector, ...]:
    """Return a symmetric, not negative 3 x 3 matrix as tuples; one number stands for the same in all directions."""
    one = np.ndim(value) == 0  # type: ignore[arg-type]
    matrix = number(field, value, unit) * np.eye(3) if one else array(field, value, (3, 3), unit)
    largest = float(np.max(np.abs(matrix)))
    if np.max(np.abs(matrix - matrix.T)) > 1e-9 * largest:
        raise InvalidInput(f"{field} is not symmetric; a stiffness matrix must be.")
    if largest == 0.0 or np.linalg.eigvalsh(matrix)[0] < -1e-9 * largest:
        raise InvalidInput(f"{field} is {shown(value)}; a stiffness must be positive, in no direction negative.")
    rows = (0.5 * (matrix + matrix.T)).tolist()
    return tuple((x, y, z) for x, y, z in rows)


def definite(field: str, matrices: NDArray[np.float64], places: Iterable[str]) -> None:
    """Check that finite matrices (n, k, k) are symmetric and positive definite, whatever the units of rows and columns."""
    for matrix, place in zip(matrices, places, strict=True):
        diagonal = np.diagonal(matrix)
        if np.min(diagonal) <= 0.0:
            row = int(np.argmin(diagonal))
            raise InvalidInput(
                f"{field} has {diagonal[row]:g} on its diagonal, in row {row + 1}{place}; a stiffness must be positive."
            )
        unit = np.sqrt(diagonal)
        pure = matrix / unit / unit[:, None]
        if np.max(np.abs(pure - pure.T)) > ASYMMETRY:
            i, j = np.unravel_index(np.argmax(np.abs(pure - pure.T)), pure.shape)
            raise InvalidInput(
                f"{field} is not symmetric{place}: {matrix[i, j]:g} in row {i + 1}, column {j + 1}, but {matrix[j, i]:g} "
                "across the diagonal; a stiffness matrix must be."
            )
        if np.linalg.eigvalsh(pure)[0] < SINGULAR:
            raise InvalidInput(
                f"{field} is not positive definite{place}: some strain would cost no energy. Its couplings are too large "
                "beside its diagonal; check their units."
            )


def instance(field: str, value: object, kind: type | tuple[type, ...], allowed: str) -> Any:
    """Return the value if it is of the kind; ``allowed`` says in words what it may be."""
    if not isinstance(value, kind):
        raise InvalidInput(f"{field} is {shown(value)}; it must be {allowed}.")
    return value


def checked_call(function: Callable[P, T], name: str = "") -> Callable[P, T]:
    """Let a call with unknown, missing or doubled arguments raise ``InvalidInput`` with the nearest right name."""
    signature = inspect.signature(function)
    names = [p for p in signature.parameters if p != "self"]
    title = name or function.__name__

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> T:
        try:
            signature.bind(*args, **kwargs)
        except TypeError as error:
            unknown = [key for key in kwargs if key not in names]
            if unknown:
                found = near(unknown[0], names)
                hint = f" Did you mean {' or '.join(found)}?" if found else ""
                raise InvalidInput(
                    f"{title} has no argument {unknown[0]!r}; it takes {', '.join(names) or 'none'}.{hint}"
                ) from None
            raise InvalidInput(f"{title}: {error}; it takes {', '.join(names) or 'no arguments'}.") from None
        return function(*args, **kwargs)

    return call


@dataclass_transform(frozen_default=True)
def description(cls: type[T]) -> type[T]:
    """Make a class a frozen value (compared, hashed and copied by its fields) that refuses unknown keywords in words."""
    frozen = dataclasses.dataclass(frozen=True)(cls)
    frozen.__init__ = checked_call(frozen.__init__, cls.__name__)  # type: ignore[method-assign]
    return frozen


def assign(owner: object, **values: object) -> None:
    """Store cleaned values in a frozen description while it is being made."""
    for name, value in values.items():
        object.__setattr__(owner, name, value)
