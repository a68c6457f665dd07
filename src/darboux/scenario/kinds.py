"""The kinds of values in a scenario file, as pydantic checks them and editors see them."""

from __future__ import annotations

from functools import cache, partial
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    StrictBool,
    StrictInt,
    Tag,
    ValidationInfo,
    WithJsonSchema,
    create_model,
    model_validator,
)
from pydantic_core import PydanticCustomError

from darboux.profile import Table
from darboux.scenario import units

# As values: these types are made while the program runs.
Checked: Any = Annotated
Tuple: Any = tuple
List: Any = list
Word: Any = Literal

MOST_SAMPLES = 100_000  # of a table
LARGEST_TABLE = 20_000_000  # bytes of a table's file
LARGEST_TABLES = 100_000_000  # bytes of all the tables' files of a scenario


class Form(BaseModel):
    """A table of the file, with known keys only."""

    model_config = ConfigDict(extra="forbid", defer_build=True)

    @model_validator(mode="before")
    @classmethod
    def _known(cls, table: Any) -> Any:
        if isinstance(table, list):
            raise ValueError("it must be one table; write its name in single brackets")
        if not isinstance(table, dict):
            raise ValueError(f"it must be a table with {', '.join(cls.model_fields)}")
        for key in table:
            if key not in cls.model_fields:
                raise PydanticCustomError("unknown", "", {"key": key, "allowed": tuple(cls.model_fields)})
        return table

    @property
    def given(self) -> dict[str, Any]:
        """What the file says, by key."""
        return {key: getattr(self, key) for key in self.model_fields_set}


def _labelled(**kinds: Any) -> Any:
    """Return one of several kinds, told apart by ``choose``; their labels never reach a person."""
    choose = kinds.pop("choose")
    union: Any = None
    for label, kind in kinds.items():
        tagged = Checked[kind, Tag(f"<{label}>")]
        union = tagged if union is None else union | tagged
    return Checked[union, Discriminator(lambda value: f"<{choose(value)}>")]


@cache
def number(unit: str = "") -> Any:
    """A number, plain in SI or a text with its unit."""
    schema: dict[str, Any] = {"type": ["number", "string"] if unit else "number", "description": units.asked(unit)}
    return Checked[float, BeforeValidator(partial(units.si, unit=unit)), WithJsonSchema(schema)]


@cache
def vector(unit: str = "") -> Any:
    """Three numbers."""

    def three(value: Any) -> Any:
        if not isinstance(value, list | tuple) or len(value) != 3:
            raise ValueError(f"it must be three numbers{' in ' + unit if unit else ''}, such as {_example(unit)}")
        return value

    one = number(unit)
    return Checked[Tuple[one, one, one], BeforeValidator(three)]


def _example(unit: str) -> str:
    return f'["0 {unit}", "0 {unit}", "1 {unit}"]' if unit and unit != "1/m" else "[0, 0, 1]"


@cache
def matrix(unit: str = "") -> Any:
    """Three rows of three numbers."""

    def rows(value: Any) -> Any:
        if not isinstance(value, list | tuple) or len(value) != 3:
            raise ValueError("it must be three rows of three numbers, such as [[1, 0, 0], [0, 1, 0], [0, 0, 1]]")
        return value

    row = vector(unit)
    return Checked[Tuple[row, row, row], BeforeValidator(rows)]


@cache
def stiffness(unit: str) -> Any:
    """One number for all directions, or a matrix."""
    return _labelled(
        number=number(unit), matrix=matrix(unit), choose=lambda value: "matrix" if isinstance(value, list) else "number"
    )


@cache
def along(unit: str) -> Any:
    """A number, or a table of numbers along the rod."""
    return _or_table("number", number(unit), table(unit, 1))


@cache
def vector_along(unit: str) -> Any:
    """Three numbers, or a table of them along the rod."""
    return _or_table("vector", vector(unit), table(unit, 3))


@cache
def in_time(unit: str) -> Any:
    """A number, or a table of numbers over the times of a motion."""
    return _or_table("number", number(unit), times(unit, 1))


@cache
def factors() -> Any:
    """A number or a table of numbers over the times of a motion; or a list of them, one for each load."""
    each = Checked[List[in_time("")], Field(max_length=MOST_SAMPLES)]
    return _labelled(
        list=Checked[each, AfterValidator(tuple)],
        one=in_time(""),
        choose=lambda value: "list" if isinstance(value, list | tuple) else "one",
    )


@cache
def vector_in_time(unit: str) -> Any:
    """Three numbers, or a table of them over the times of a motion."""
    return _or_table("vector", vector(unit), times(unit, 3))


def _or_table(name: str, kind: Any, table: Any) -> Any:
    """Return a kind by its name, or a table of it."""
    return _labelled(
        **{name: kind}, table=table, choose=lambda value: "table" if isinstance(value, dict | Table) else name
    )


def square_along() -> Any:
    """A square matrix of plain numbers, or a table of them along the rod; the description says which sizes it takes."""
    rows = Checked[List[Checked[List[number()], Field(max_length=6)]], Field(max_length=6)]
    return _or_table("matrix", rows, _table("Matrices", rows))


def word(*choices: str) -> Any:
    """One of some words."""
    return Word[choices]


flag, whole, text = StrictBool, StrictInt, str


def table(unit: str, columns: int) -> Any:
    """Numbers or vectors at arc lengths: in the file itself, or in a CSV file beside it with s in its first column (SI)."""
    name = f"{columns}In{''.join(c if c.isalnum() else '_' for c in unit)}"
    return _table(name, number(unit) if columns == 1 else vector(unit), columns)


def times(unit: str, columns: int) -> Any:
    """Numbers or vectors at times: in the file itself, or in a CSV file beside it with t in its first column (SI)."""
    name = f"{columns}InTimeIn{''.join(c if c.isalnum() else '_' for c in unit)}"
    return _table(name, number(unit) if columns == 1 else vector(unit), columns, "t", "s")


@cache
def _table(name: str, values: Any, columns: int = 0, at: str = "s", unit: str = "m") -> Any:
    """A table of ``values`` at arc lengths s or times t."""

    def made(stated: Any, info: ValidationInfo) -> Table:
        given = dict(stated.given)
        if ("table" in given) == ("values" in given) or (at in given) != ("values" in given):
            raise ValueError(f"it must be either {{ {at} = [...], values = [...] }} or {{ table = 'file.csv' }}")
        if "table" in given and not columns:
            raise ValueError("matrices can't be in a CSV file; write { s = [...], values = [...] }")
        if "table" in given:
            return read_table(given.pop("table"), columns, info, **given)
        return Table(given.pop(at), **given)

    fields = {
        at: Checked[List[number(unit)], Field(max_length=MOST_SAMPLES)],
        "values": Checked[List[values], Field(max_length=MOST_SAMPLES)],
    }
    fields |= {"table": str, "interpolation": word("linear", "cubic")}
    model = form(f"TableOf{name}", fields)
    return Checked[model, AfterValidator(made)]


def read_table(name: str, columns: int, info: ValidationInfo, **given: Any) -> Table:
    """Return the table in a CSV file: s in m or t in s, then the values in SI; a first line of words is a heading."""
    path = inside(name, info)
    try:
        if not path.is_file():
            raise ValueError(f"there is no file {path}")
        if path.stat().st_size > LARGEST_TABLE:
            raise ValueError(f"{path} has more than {LARGEST_TABLE // 1_000_000} MB; thin it out")
        context = info.context or {}
        context["read"] = context.get("read", 0) + path.stat().st_size
        if context["read"] > LARGEST_TABLES:
            raise ValueError(
                f"the scenario's tables have more than {LARGEST_TABLES // 1_000_000} MB together; thin them out"
            )
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} can't be read ({error})") from None
    if len(lines) > MOST_SAMPLES + 1:
        raise ValueError(f"{path} has {len(lines)} lines; at most {MOST_SAMPLES} are taken, so thin it out")
    heading = 0 if lines and _are_numbers(lines[0]) else 1
    if len(lines) < heading + 2:
        raise ValueError(f"{path} has fewer than two lines of numbers")
    try:
        data = np.loadtxt(lines[heading:], delimiter=",", ndmin=2)
    except ValueError as error:
        raise ValueError(f"{path} can't be read as numbers between commas: {error}") from None
    if data.shape[1] != columns + 1:
        raise ValueError(f"{path} has {data.shape[1]} columns; it must have {columns + 1}")
    return Table(data[:, 0], data[:, 1] if columns == 1 else data[:, 1:], **given)


def _are_numbers(line: str) -> bool:
    try:
        return bool([float(cell) for cell in line.split(",")])
    except ValueError:
        return False


def inside(name: str, info: ValidationInfo) -> Path:
    """Return the path beside the scenario file; one that leaves its folder is refused unless the reader allowed it."""
    context = info.context or {}
    folder = context.get("folder")
    if folder is None:
        raise ValueError("a table in another file needs a scenario that is a file itself")
    try:
        path, home = (Path(folder) / name).resolve(), Path(folder).resolve()
    except (OSError, ValueError, RuntimeError):
        raise ValueError("it must be the name of a file") from None
    if not context.get("anywhere") and not path.is_relative_to(home):
        raise ValueError(
            "it leaves the scenario's own folder; put the file there, or allow it (--anywhere, anywhere=True)"
        )
    return path


def form(name: str, fields: dict[str, Any], needs: str = "", extra: dict[str, Any] | None = None) -> Any:
    """Return the model of a table with these fields, of which it ``needs`` some; ``extra`` are pydantic's own fields."""
    annotated: dict[str, Any] = {key: (kind, ... if key in needs.split() else None) for key, kind in fields.items()}
    return create_model(name, __base__=Form, **(extra or {}), **annotated)


def one_of(kinds: dict[str, Any], key: str, default: str | None = None) -> Any:
    """Return one of several forms, told apart by the word under ``key``."""

    def known(value: Any) -> Any:
        if isinstance(value, list):
            raise ValueError("it must be one table; write its name in single brackets")
        if not isinstance(value, dict):
            raise ValueError(f"it must be a table, such as {{ {key} = {next(iter(kinds))!r}, ... }}")
        if key not in value and default is None:
            raise PydanticCustomError("without", "", {"key": key, "allowed": tuple(kinds)})
        if key in value and (not isinstance(value[key], str) or value[key] not in kinds):
            raise PydanticCustomError("choice", "", {"key": key, "came": value[key], "allowed": tuple(kinds)})
        return value

    return Checked[_labelled(**kinds, choose=lambda value: value.get(key, default)), BeforeValidator(known)]
