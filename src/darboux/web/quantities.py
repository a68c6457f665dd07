"""What of a problem can be changed on the page: its numbers, their units and ranges, and the problem with other numbers."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from darboux.checks import shown
from darboux.errors import InvalidInput
from darboux.natural import Helix
from darboux.problem import Equilibrium
from darboux.profile import Table
from darboux.scenario import forms, units

FARTHEST = 30.0  # times the slider's range: what may be typed
MOST = 60  # controls of a page
AXES = "xyz"
# Units that are read more easily than those of the files, by the unit of the files.
SHOWN = {
    "m": ("km", "m", "cm", "mm", "um", "nm"),
    "Pa": ("GPa", "MPa", "kPa", "Pa"),
    "N": ("MN", "kN", "N", "mN", "uN", "nN", "pN", "fN"),
    "N m": ("N m", "mN m", "uN m", "nN m", "pN m", "fN m", "aN m", "zN m"),
    "N/m": ("kN/m", "N/m", "mN/m", "uN/m", "nN/m"),
    "N m^2": ("N m^2", "mN m^2", "uN m^2", "nN m^2", "pN m^2", "fN m^2", "aN m^2"),
    "J": ("kJ", "J", "mJ", "uJ", "nJ", "pJ", "fJ", "aJ", "zJ"),
    "1/m": ("1/nm", "1/um", "1/mm", "1/m"),
    "rad": ("turn",),
    "rad/s": ("rpm",),
}
FACTORS = {"turn": 2.0 * math.pi, "rpm": 2.0 * math.pi / 60.0, "1/mm": 1e3, "1/um": 1e6, "1/nm": 1e9}
SIZES = (1e9, 1e6, 1e3, 1e-2, 1e-3, 1e-6, 1e-9, 1e-12, 1e-15, 1e-18, 1e-21)
PREFIXES = dict(zip("GMkcmunpfaz", SIZES, strict=True))
WORDS = {
    "E": "modulus E",
    "density": "density",
    "g": "gravity",
    "a": "semi-axis a",
    "b": "semi-axis b",
    "omega": "speed",
    "charge_per_length": "charge",
}


@dataclass(frozen=True)
class Quantity:
    """One number of a problem.

    ``key`` names it in links, ``group`` and ``label`` on the page; ``value`` as the scenario has it, ``low`` and ``high`` the
    slider's ends, in ``si``; ``unit`` is what the page shows, of ``factor`` SI units; ``geometric`` whether the slider's
    steps are ratios; ``path`` leads to it from the problem.
    """

    key: str
    group: str
    label: str
    si: str
    unit: str
    factor: float
    value: float
    low: float
    high: float
    geometric: bool
    path: tuple[str | int, ...]

    def place(self, value: float) -> float:
        """Return where on the slider a value is, 0 to 1 within its ends."""
        if self.geometric:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def at(self, place: float) -> float:
        """Return the value at a place of the slider."""
        if self.geometric:
            return float(self.low * (self.high / self.low) ** place)
        return float(self.low + place * (self.high - self.low))

    def text(self, value: float) -> str:
        """Return the value in the unit shown, as a field holds it."""
        number = f"{value / self.factor:.5g}"
        return "0" if number == "-0" else number

    def read(self, text: str) -> float:
        """Return the value that a person typed, a number in the unit shown or a text with its own; in SI.

        Raises ``InvalidInput``, whose sentence stands beside the field.
        """
        text = text.strip().replace("\N{MINUS SIGN}", "-").replace("\N{MICRO SIGN}", "u")
        try:
            value = float(text) * self.factor if _plain(text) else units.si(text, self.si)
        except ValueError as error:
            asked = f"a number in {self.unit or '1'}, or a text with a unit, such as {self.text(self.value)} {self.unit}".rstrip()
            fault = str(error).replace(units.asked(self.si), asked).rstrip(".")  # the field's unit, not the file's
            raise InvalidInput(
                f"{self.label} is {shown(text)}; {fault}{'' if fault.endswith('?') else '.'}"
                if text
                else f"{self.label} is empty; give a number in {self.unit}."
            ) from None
        return self.checked(value)

    def checked(self, value: float) -> float:
        """Return a value that this page takes, or raise ``InvalidInput``."""
        if self.geometric and value <= 0.0:
            raise InvalidInput(
                f"{self.label} is {self.text(value)} {self.unit}; it must be positive.".replace("  ", " ")
            )
        low, high = self.bounds
        if not low <= value <= high:
            raise InvalidInput(
                f"{self.label} is {self.text(value)} {self.unit}; on this page it lies between {self.text(low)} and "
                f"{self.text(high)} {self.unit}.".replace(" ;", ";").replace(" .", ".")
            )
        return value

    @property
    def bounds(self) -> tuple[float, float]:
        """The smallest and the largest value that may be typed."""
        if self.geometric:
            return self.low / FARTHEST, self.high * FARTHEST
        middle, half = 0.5 * (self.low + self.high), 0.5 * FARTHEST * (self.high - self.low)
        return middle - half, middle + half


def _plain(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def of(problem: Equilibrium) -> tuple[Quantity, ...]:
    """Return what can be changed: only numbers that the problem has, the rod's first, then its ends' and its loads'."""
    found = [*_of_rod(problem), *_of_ends(problem), *_of_loads(problem)]
    return tuple(found[:MOST])


def changed(problem: Equilibrium, quantities: tuple[Quantity, ...], values: dict[str, float]) -> Equilibrium:
    """Return the problem with these values, by key, in SI. Raises ``InvalidInput`` as the descriptions do."""
    tree: dict[Any, Any] = {}
    for quantity in quantities:
        value: Any = values.get(quantity.key, quantity.value)
        if value == quantity.value:
            continue
        if quantity.key == "distance":
            value = _apart(problem, value)
        branch = tree
        for part in quantity.path[:-1]:
            branch = branch.setdefault(part, {})
        branch[quantity.path[-1]] = value
    return _grafted(problem, tree) if tree else problem


def _grafted(value: Any, tree: Any) -> Any:
    """Return a description, or a tuple, with the parts that the tree names; all of them at once, so that order is nothing."""
    if not isinstance(tree, dict):
        return tree
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        parts = {name: _grafted(getattr(value, name), branch) for name, branch in tree.items()}
        return dataclasses.replace(value, **parts)
    entries = (0.0, 0.0, 0.0) if value is None else value  # no natural curvature
    return tuple(_grafted(entry, tree.get(i, entry)) if i in tree else entry for i, entry in enumerate(entries))


# -- the parts of a problem ----------------------------------------------------------------------------------------------


def _of_rod(problem: Equilibrium) -> list[Quantity]:
    rod, found = problem.rod, []
    L = rod.length
    if not _along(problem):
        found.append(_ratio("length", "Rod", "length", "m", L, 3.0, ("rod", "length")))
    section = next(shape for shape in forms.SECTIONS if shape.description == type(rod.section).__name__)
    for name, (_, unit) in section.fields.items():
        value = getattr(rod.section, name)
        if isinstance(value, float | int) and value > 0.0:
            found.append(_ratio(name, "Rod", _words(name), unit, float(value), 3.0, ("rod", "section", name)))
    if rod.material is not None:
        for name, unit in (("E", "Pa"), ("density", "kg/m^3")):
            value = getattr(rod.material, name)
            if value:
                found.append(_ratio(name, "Rod", _words(name), unit, value, 10.0, ("rod", "material", name)))
    natural = rod.natural
    if isinstance(natural, Helix):
        for name in ("radius", "pitch"):
            value = getattr(natural, name)
            if value > 0.0:
                found.append(
                    _ratio(f"helix.{name}", "Natural shape", f"helix {name}", "m", value, 3.0, ("rod", "natural", name))
                )
    elif natural is None or isinstance(natural, tuple):
        for i, value in enumerate(natural or (0.0, 0.0, 0.0)):
            label = "twist" if i == 2 else f"curvature {i + 1}"
            reach = max(4.0 * math.pi / L, 2.0 * abs(value))
            found.append(_even(f"k0.{i + 1}", "Natural shape", label, "1/m", value, reach, ("rod", "natural", i)))
    return found


def _of_ends(problem: Equilibrium) -> list[Quantity]:
    if problem.link is not None:
        reach = max(4.0, 2.0 * abs(problem.link))
        return [_even("link", "Ends", "link", "", problem.link, reach, ("link",), unit="turn")]
    found, start, end, L = [], problem.start, problem.end, problem.rod.length
    if all(start.held_displacement) and all(end.held_displacement):
        distance = float(np.linalg.norm(np.subtract(end.position, start.position)))
        if distance > 0.0:
            high = max(1.1 * distance, L) if problem.rod.stretch else max(distance, 0.998 * L)
            found.append(
                dataclasses.replace(
                    _even("distance", "Ends", "end distance", "m", distance, high, ("end", "position")), low=0.05 * high
                )
            )
    if "twist" in {field.name for field in dataclasses.fields(end)} and start.holds:
        reach = max(2.0 * FACTORS["turn"], 2.0 * abs(end.twist))
        found.append(_even("rotation", "Ends", "end rotation", "rad", end.twist, reach, ("end", "twist")))
    return found


def _of_loads(problem: Equilibrium) -> list[Quantity]:
    found = []
    names = [type(load).__name__ for load in problem.loads]
    for i, load in enumerate(problem.loads):
        shape = next((shape for shape in forms.LOADS if shape.description == names[i]), None)
        if shape is None:
            continue
        group = shape.name.replace("_", " ").capitalize()
        group += f" {names[: i + 1].count(names[i])}" if names.count(names[i]) > 1 else ""
        for name, (_, unit) in shape.fields.items():
            value, key, path = getattr(load, name), f"load{i + 1}.{name}", ("loads", i, name)
            if not unit or name == "point":
                continue
            if name == "at" and isinstance(value, float):
                L = problem.rod.length
                at = _even(key, group, "place s", "m", value, 0.98 * L, path)
                found.append(dataclasses.replace(at, low=0.02 * L))
            elif isinstance(value, float) and value > 0.0:
                found.append(_ratio(key, group, _words(name), unit, value, 5.0, path))
            elif isinstance(value, tuple) and len(value) == 3 and not isinstance(value[0], tuple):
                reach = 2.0 * max(map(abs, value)) or _natural_size(problem, unit)
                found += [
                    _even(f"{key}.{AXES[j]}", group, f"{_words(name)} {AXES[j]}", unit, value[j], reach, (*path, j))
                    for j in range(3)
                ]
    return found


def _natural_size(problem: Equilibrium, unit: str) -> float:
    """Return a load of this unit that bends the rod well: a power of its length times its stiffness."""
    stiffness = problem.rod.stiffness(np.zeros(1))
    EI, L = float(min(stiffness.EI1[0], stiffness.EI2[0])), problem.rod.length
    return {"N": 40.0 * EI / L**2, "N m": 4.0 * math.pi * EI / L, "N/m": 200.0 * EI / L**3}.get(unit, 1.0)


def _along(problem: Equilibrium) -> bool:
    """Return whether a part of the problem is tied to the length: a table along the rod, or a place between the ends."""
    rod = problem.rod
    parts = [rod.natural, *vars(rod.section).values(), *(value for load in problem.loads for value in load.varying)]
    return any(callable(part) or isinstance(part, Table) for part in parts) or bool(problem.between or problem.points)


def _apart(problem: Equilibrium, distance: float) -> tuple[float, ...]:
    """Return the end's position at this distance from the start, in the direction in which it is."""
    way = np.subtract(problem.end.position, problem.start.position)
    return tuple((problem.start.position + way * (distance / np.linalg.norm(way))).tolist())


def _words(name: str) -> str:
    return WORDS.get(name, name.replace("_", " "))


def _ratio(
    key: str, group: str, label: str, si: str, value: float, ratio: float, path: tuple[str | int, ...]
) -> Quantity:
    return Quantity(key, group, label, si, *_shown(si, value), value, value / ratio, value * ratio, True, path)


def _even(
    key: str, group: str, label: str, si: str, value: float, reach: float, path: tuple[str | int, ...], unit: str = ""
) -> Quantity:
    shown = (unit, 1.0) if unit else _shown(si, max(abs(value), 0.5 * reach))
    return Quantity(key, group, label, si, *shown, value, -reach, reach, False, path)


def _shown(si: str, size: float) -> tuple[str, float]:
    """Return the unit in which a size is between 1 and 1000 or so, and how many SI units it is."""
    names = SHOWN.get(si, (si,))
    for name in names:
        if size >= _factor(name, si) * 0.9999:
            return name, _factor(name, si)
    return names[-1], _factor(names[-1], si)


def _factor(name: str, si: str) -> float:
    return 1.0 if name == si else FACTORS.get(name) or PREFIXES[name[0]]


def readable(value: float, si: str) -> str:
    """Return a value in SI with a unit in which it is read easily, as in "12.3 mN"."""
    unit, factor = _shown(si, abs(value)) if value else (si, 1.0)
    return f"{value / factor:.4g} {pretty(unit)}"


def pretty(unit: str) -> str:
    """Return a unit as it is printed: powers raised, micro by its letter."""
    unit = "\N{MICRO SIGN}" + unit[1:] if unit[:1] == "u" else unit.replace("/u", "/\N{MICRO SIGN}")
    return unit.replace("^2", "\N{SUPERSCRIPT TWO}").replace("^3", "\N{SUPERSCRIPT THREE}")
