"""Descriptions to TOML, in the form that is read back equal."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from typing import Any

from darboux import materials
from darboux.errors import InvalidInput
from darboux.material import Material
from darboux.natural import Helix
from darboux.problem import Equilibrium, Ring
from darboux.profile import Table
from darboux.scenario import forms
from darboux.scenario.forms import Shape


def toml(problem: Equilibrium, method: Any = None, motion: Any = None, motion_method: Any = None) -> str:
    """Return the problem, and the methods and the motion where they are given, as the text of a scenario file."""
    if type(problem) not in (Equilibrium, Ring):
        raise InvalidInput(f"{type(problem).__name__} has no form in a scenario file; Equilibrium and Ring have.")
    document: dict[str, Any] = {"rod": _rod(problem)}
    if isinstance(problem, Ring):
        document["ring"] = {"link": problem.link}
    document["supports"] = {
        at: _written(f"supports.{at}", getattr(problem, at), forms.SUPPORTS, "type")
        for at in (("start",) if isinstance(problem, Ring) else ("start", "end"))
    }
    if problem.between:
        document["supports"]["between"] = [
            {"at": _quantity("", s, "m"), **_written(f"supports.between[{i}]", support, forms.SUPPORTS, "type")}
            for i, (s, support) in enumerate(problem.between)
        ]
    loads = [_written(f"loads[{i}]", load, forms.LOADS, "type") for i, load in enumerate(problem.loads)]
    document |= {"loads": loads} if loads else {}
    document |= {"method": _written("method", method, forms.METHODS, "name")} if method is not None else {}
    document |= {"motion": _motion(motion, motion_method)} if motion is not None else {}
    return "\n".join(_tables(document))


def _rod(problem: Equilibrium) -> dict[str, Any]:
    rod = problem.rod
    table: dict[str, Any] = {"length": _quantity("rod.length", rod.length, "m")}
    table["section"] = _written("rod.section", rod.section, forms.SECTIONS, "shape")
    if isinstance(rod.material, Material):
        name = materials.name_of(rod.material)
        table["material"] = name or _fields("rod.material", rod.material, forms.MATERIAL)
    if isinstance(rod.natural, Helix):
        table["natural"] = {"helix": _fields("rod.natural", rod.natural, forms.HELIX)}
    elif rod.natural is not None:
        table["natural"] = {"curvature": _quantity("rod.natural", rod.natural, "1/m")}
    return table | {name: True for name in ("stretch", "shear") if getattr(rod, name)}


def _motion(motion: Any, method: Any) -> dict[str, Any]:
    if not isinstance(motion.initial, str):
        raise InvalidInput(
            "motion.initial is an equilibrium or a function, which a file can't hold; write 'unloaded' or 'equilibrium'."
        )
    plain = dataclasses.replace(motion, start=None, end=None, damping=(), release=())
    table = _fields("motion", plain, forms.MOTION)
    table |= {"release": {end: f"{t!r} s" for end, t in motion.release}} if motion.release else {}
    for at in ("start", "end"):
        moving = getattr(motion, at)
        table |= {at: _fields(f"motion.{at}", moving, forms.MOVING)} if moving is not None else {}
    parts = [_written(f"motion.damping[{i}]", part, forms.DAMPINGS, "type") for i, part in enumerate(motion.damping)]
    table |= {"damping": parts} if parts else {}
    return table | ({"method": _written("motion.method", method, forms.MOTION_METHODS, "name")} if method else {})


def _written(path: str, value: Any, shapes: tuple[Shape, ...], key: str) -> dict[str, Any]:
    """Return one of several descriptions as a table, its name under ``key``."""
    shape = next((shape for shape in shapes if shape.description == type(value).__name__), None)
    if shape is None or type(value) is not shape.cls:
        raise InvalidInput(
            f"{path} is a {type(value).__name__}, which has no form in a scenario file; those are "
            f"{', '.join(shape.description for shape in shapes)}."
        )
    return {key: shape.name, **_fields(path, value, shape)}


def _fields(path: str, value: Any, shape: Shape) -> dict[str, Any]:
    table = {}
    for field in dataclasses.fields(value):
        given = getattr(value, field.name)
        if (
            (shape.description, field.name) == ("Motion", "problem")
            or given is None
            or (type(given) is type(field.default) and given == field.default)
        ):
            continue
        if field.name not in shape.fields:
            raise InvalidInput(f"{path}.{field.name} has no form in a scenario file; leave it out.")
        at = "t" if (shape.description, field.name) in forms.IN_TIME else "s"
        table[field.name] = _quantity(f"{path}.{field.name}", given, shape.fields[field.name][1], at)
    return table


def _quantity(path: str, value: Any, unit: str, at: str = "s") -> Any:
    """Return a value with its unit; tables of numbers, at arc lengths s or times t, stay plain, in SI."""
    if isinstance(value, Table):
        return {at: list(value.s), "values": _quantity(path, value.values, ""), "interpolation": value.interpolation}
    if callable(value):
        raise InvalidInput(
            f"{path} is a Python function, which a file can't hold; give its values as a Table, then it can."
        )
    if isinstance(value, tuple):
        return [_quantity(f"{path}[{i}]", part, unit, at) for i, part in enumerate(value)]
    return f"{value!r} {unit}" if unit and isinstance(value, float) else value


def _tables(document: dict[str, Any], above: str = "") -> Iterator[str]:
    """Yield each table under its heading: those of the document, and what `supports` holds.

    Written here because the libraries spread a vector over five lines, or take a minute for a long table.
    """
    for key, content in document.items():
        name = above + key
        if key == "supports":
            yield from _tables(content, "supports.")
            continue
        for table in content if isinstance(content, list) else [content]:
            heading = f"[[{name}]]" if isinstance(content, list) else f"[{name}]"
            yield "\n".join([heading, *(f"{field} = {_text(value)}" for field, value in table.items()), ""])


def _text(value: Any) -> str:
    """Return a value in TOML; names and numbers only, so JSON's text of them serves."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_text(part)}" for key, part in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_text, value)) + "]"
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
