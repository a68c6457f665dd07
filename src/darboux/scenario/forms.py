"""The form of every public description in a scenario file: its name there, its fields, their units.

A new description takes its line here; a test walks the public classes and fails for one that has none.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from typing import Any

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, create_model

import darboux
from darboux import materials
from darboux.errors import InvalidInput
from darboux.material import Material
from darboux.problem import Equilibrium, Ring
from darboux.scenario import kinds
from darboux.scenario.kinds import (
    Checked,
    List,
    Word,
    along,
    flag,
    form,
    matrix,
    number,
    stiffness,
    vector,
    vector_along,
    whole,
    word,
)

MOST_LOADS = 1000


@dataclass(frozen=True)
class Shape:
    """How a description is written: kinds and units of its fields, those that it needs, other names that it answers to."""

    description: str
    fields: dict[str, tuple[Any, str]]  # kind of value, and the unit that its numbers are written with
    needs: str = ""
    also: tuple[str, ...] = ()
    word: str = ""  # its name in a file, where capitals don't tell

    @property
    def cls(self) -> type:
        """The public class, loaded when it is first needed."""
        return getattr(darboux, self.description)  # type: ignore[no-any-return]

    @property
    def name(self) -> str:
        """Its name in a file: EndForce is "end_force"."""
        return self.word or re.sub(r"(?<!^)(?=[A-Z])", "_", self.description).lower()

    def kind(self, key: str = "", needed: bool = True, station: bool = False) -> Any:
        """Return its form for pydantic: ``key`` is the field that names it, ``station`` whether it says where it is."""
        extra: dict[str, Any] = {key: (Word[(self.name, *self.also)], ... if needed else self.name)} if key else {}
        extra |= {"at": (number("m"), ...)} if station else {}
        fields = {field: kind for field, (kind, _) in self.fields.items()}
        model = form(self.description + "Between" * station, fields, self.needs, extra)

        def made(form: kinds.Form) -> Any:
            value = self.cls(**{field: given for field, given in form.given.items() if field not in extra})
            return (form.given["at"], value) if station else value

        return Checked[model, AfterValidator(made)]


def _shape(description: str, needs: str = "", /, **fields: tuple[Any, str]) -> Shape:
    return Shape(description, fields, needs)


def _of(kind: Any, unit: str = "") -> tuple[Any, str]:
    return kind(unit), unit


POSE = {"tangent": _of(vector), "d1": _of(vector), "frame": _of(matrix)}
POSITION, TWIST = _of(vector, "m"), _of(number, "rad")
PLAIN, YES_OR_NO, COUNT = _of(number), (flag, ""), (whole, "")
LENGTH, ALONG_METRES = _of(number, "m"), _of(along, "m")
FRAMES = (word("fixed", "section"), "")
AT_END = (word("start", "end"), "")

SECTIONS = (
    _shape("Circle", "radius", radius=ALONG_METRES),
    _shape("Tube", "outer_radius inner_radius", outer_radius=ALONG_METRES, inner_radius=ALONG_METRES),
    _shape("Rectangle", "width height", width=ALONG_METRES, height=ALONG_METRES),
    _shape("Ellipse", "a b", a=ALONG_METRES, b=ALONG_METRES),
    _shape(
        "Stiffness",
        "EI1 GJ",
        EI1=_of(along, "N m^2"),
        EI2=_of(along, "N m^2"),
        GJ=_of(along, "N m^2"),
        EA=_of(along, "N"),
        GA1=_of(along, "N"),
        GA2=_of(along, "N"),
        mass=_of(along, "kg/m"),
    ),
    _shape("StiffnessMatrix", "matrix", matrix=(kinds.square_along(), ""), mass=_of(along, "kg/m")),
)
SUPPORTS = (
    _shape("Clamped", position=POSITION, **POSE, twist=TWIST),
    _shape("Pinned", position=POSITION),
    _shape("Hinge", "axis", axis=_of(vector), position=POSITION, **POSE),
    _shape("Universal", "axis section_axis", axis=_of(vector), section_axis=_of(vector), position=POSITION, **POSE),
    _shape("Roller", "along", along=_of(vector), position=POSITION, sliding=FRAMES),
    _shape("Slider", "along", along=_of(vector), position=POSITION, **POSE, twist=TWIST),
    _shape("Guided", **POSE, twist=TWIST),
    _shape("Spring", linear=_of(stiffness, "N/m"), rotational=_of(stiffness, "N m/rad"), position=POSITION, **POSE),
    _shape("Free"),
)
LOADS = (
    _shape("Gravity", g=_of(vector, "m/s^2")),
    _shape("EndForce", "force", force=_of(vector, "N"), at=AT_END, follower=YES_OR_NO, offset=POSITION),
    _shape("EndMoment", "moment", moment=_of(vector, "N m"), at=AT_END, follower=YES_OR_NO),
    _shape("PointForce", "force at", force=_of(vector, "N"), at=LENGTH, follower=YES_OR_NO, offset=POSITION),
    _shape("PointMoment", "moment at", moment=_of(vector, "N m"), at=LENGTH, follower=YES_OR_NO),
    _shape("LineForce", "force", force=_of(vector_along, "N/m"), frame=FRAMES),
    _shape("LineCouple", "couple", couple=_of(vector_along, "N"), frame=FRAMES),
    _shape("Rotation", "omega", omega=_of(vector, "rad/s"), point=POSITION),
    _shape("ElectricField", "field charge_per_length", field=_of(vector, "V/m"), charge_per_length=_of(along, "C/m")),
    _shape("Foundation", "stiffness", stiffness=_of(stiffness, "N/m^2"), point=POSITION, direction=_of(vector)),
    _shape("Buoyancy", "density", density=_of(number, "kg/m^3"), area=_of(number, "m^2"), g=_of(vector, "m/s^2")),
)
METHODS = (
    _shape("Collocation", rtol=PLAIN, stages=COUNT, elements=COUNT, stable=YES_OR_NO),
    _shape("Shooting", rtol=PLAIN, pieces=COUNT),
    _shape("Elastica", rtol=PLAIN),
    Shape(
        "DiscreteRod",
        {
            "segments": COUNT,
            "clamp": (word("half_cell", "two_vertices"), ""),
            "grading": PLAIN,
            "extrapolate": YES_OR_NO,
            "stable": YES_OR_NO,
        },
        also=("discrete",),
    ),
)
SECONDS = _of(number, "s")
MOTION_METHODS = (
    _shape("ImplicitMidpoint", segments=COUNT, step=SECONDS, tolerance=_of(number, "rad")),
    Shape("TRBDF2", {"segments": COUNT, "rtol": PLAIN, "step": SECONDS}, word="tr_bdf2"),
    _shape("StormerVerlet", segments=COUNT, step=SECONDS),
)
FLUID = _of(kinds.vector_in_time, "m/s")
DAMPINGS = (
    _shape("MassDamping", "rate", rate=_of(number, "1/s")),
    _shape("KelvinVoigt", bending=SECONDS, twist=SECONDS, stretch=SECONDS),
    _shape("LinearDrag", "along across", along=_of(number, "N s/m^2"), across=_of(number, "N s/m^2"), fluid=FLUID),
    _shape(
        "QuadraticDrag", "along across", along=_of(number, "N s^2/m^3"), across=_of(number, "N s^2/m^3"), fluid=FLUID
    ),
)
MOVING = _shape("Moving", position=_of(kinds.vector_in_time, "m"))
MOTION = _shape(
    "Motion",
    "duration",
    duration=SECONDS,
    initial=(word("unloaded", "equilibrium"), ""),
    velocity=_of(vector_along, "m/s"),
    spin=_of(along, "rad/s"),
    start=(MOVING.kind(), ""),
    end=(MOVING.kind(), ""),
    load_factor=(kinds.factors(), ""),
    damping=(None, ""),
    release=(None, "s"),
    rotary_inertia=_of(number, "kg m"),
)
MATERIAL = _shape(
    "Material",
    E=_of(number, "Pa"),
    nu=PLAIN,
    density=_of(number, "kg/m^3"),
    G=_of(number, "Pa"),
    strength=_of(number, "Pa"),
)
HELIX = _shape("Helix", "radius pitch", radius=LENGTH, pitch=LENGTH, handed=(word("right", "left"), ""))
ROD = _shape(
    "Rod",
    "length section",
    length=LENGTH,
    section=(None, ""),
    material=(None, ""),
    natural=(None, "1/m"),
    stretch=YES_OR_NO,
    shear=YES_OR_NO,
)
SHAPES = (
    *(*SECTIONS, *SUPPORTS, *LOADS, *METHODS, MATERIAL, HELIX, ROD),
    *(*MOTION_METHODS, *DAMPINGS, MOVING, MOTION),
)
UNWRITTEN = {
    ("LineForce", "gradient"),  # they belong to Python functions
    ("LineCouple", "gradient"),
    ("Moving", "frame"),  # a table's interpolation of rotations is none
    ("Motion", "problem"),  # it is the rest of the file
}
IN_TIME = {("Moving", "position"), ("Motion", "load_factor"), ("LinearDrag", "fluid"), ("QuadraticDrag", "fluid")}


def _one_of(shapes: tuple[Shape, ...], key: str, default: str | None = None, **more: Any) -> Any:
    labels: dict[str, Any] = {}
    for shape in shapes:
        kind = shape.kind(key, needed=shape.name != default, **more)
        labels |= dict.fromkeys((shape.name, *shape.also), kind)
    return kinds.one_of(labels, key, default)


def _material() -> Any:
    """A material by name, by its values, or by a name with some values of one's own."""

    def named(value: Any) -> Any:
        return {"name": value} if isinstance(value, str) else value

    def made(name: str | None = None, **own: Any) -> Material:
        if name is None:
            return Material(**own)
        entry = materials.named("material.name", name)
        values = {key: value for key, value in vars(entry).items() if value is not None}
        if own.keys() & {"nu", "G"}:
            values = {key: value for key, value in values.items() if key not in ("nu", "G")}
        return Material(**(values | own))

    fields: dict[str, Any] = {"name": word(*materials.LIBRARY)}
    fields |= {field: kind for field, (kind, _) in MATERIAL.fields.items()}
    model = form("Material", fields)
    return Checked[model, AfterValidator(lambda form: made(**form.given)), BeforeValidator(named)]


def _natural() -> Any:
    """A natural shape: a helix, a curvature (constant or in a table), or a file."""

    def made(form: Any, info: ValidationInfo) -> Any:
        if len(form.given) != 1:
            raise ValueError("it must be one of { helix = ... }, { curvature = ... } and { table = 'file.csv' }")
        ((key, value),) = form.given.items()
        return kinds.read_table(value, 3, info) if key == "table" else value

    model = create_model(
        "Natural",
        __base__=kinds.Form,
        helix=(HELIX.kind(), None),
        curvature=(vector_along("1/m"), None),
        table=(str, None),
    )
    return Checked[model, AfterValidator(made)]


@cache
def scenario() -> Any:
    """Return the pydantic model of a whole file; validated, ``given`` holds the descriptions that it makes."""
    own = {"section": _one_of(SECTIONS, "shape", "stiffness"), "material": _material(), "natural": _natural()}
    fields = {field: own.get(field, kind) for field, (kind, _) in ROD.fields.items()}
    rod = Checked[form("Rod", fields, ROD.needs), AfterValidator(lambda form: darboux.Rod(**form.given))]
    support = _one_of(SUPPORTS, "type")
    between = _one_of(SUPPORTS, "type", station=True)
    supports = create_model(
        "Supports",
        __base__=kinds.Form,
        start=(support, None),
        end=(support, None),
        between=(Checked[List[between], Field(max_length=MOST_LOADS)], None),
    )
    load = _one_of(LOADS, "type")
    damping = Checked[List[_one_of(DAMPINGS, "type")], Field(max_length=MOST_LOADS)]
    release = form("Release", {"start": number("s"), "end": number("s")})
    released = Checked[release, AfterValidator(lambda table: table.given)]
    own = {"damping": damping, "release": released}
    motion = {field: own.get(field, kind) for field, (kind, _) in MOTION.fields.items()}
    motion["method"] = _one_of(MOTION_METHODS, "name")
    return create_model(
        "Scenario",
        __base__=kinds.Form,
        rod=(rod, ...),
        ring=(create_model("Ring", __base__=kinds.Form, link=(number(), 0.0)), None),
        supports=(supports, None),
        loads=(Checked[List[load], Field(max_length=MOST_LOADS)], None),
        method=(_one_of(METHODS, "name"), None),
        motion=(form("Motion", motion, MOTION.needs), None),
    )


def problem(given: dict[str, Any]) -> Equilibrium:
    """Return the problem that the checked tables of a file state."""
    supports = given["supports"].given if "supports" in given else {}
    parts = {"rod": given["rod"], "loads": given.get("loads", ()), **supports}
    if "between" in parts:
        parts["between"] = tuple(parts["between"])
    if "ring" not in given:
        return Equilibrium(**parts)
    if "end" in parts:
        raise InvalidInput("supports.end came beside a ring, whose end meets its start; leave it out.")
    return Ring(**parts, **given["ring"].given)


def motion(problem: Equilibrium, given: dict[str, Any]) -> Any:
    """Return the motion of the problem that the checked table of a file states, or None."""
    if "motion" not in given:
        return None
    return darboux.Motion(
        problem, **{field: value for field, value in given["motion"].given.items() if field != "method"}
    )
