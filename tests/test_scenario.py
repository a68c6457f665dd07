"""Scenario files: every public description has its form, comes back equal, and a mistake is one sentence."""

from __future__ import annotations

import dataclasses
import json
import random
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import darboux as dx
from darboux import materials, scenario
from darboux.scenario import Scenario, forms, units

S, UP = (0.0, 0.4, 1.0), (0, 0, 1)
BARE = dx.Stiffness(EI1=1.0, EI2=2.0, GJ=0.7, EA=400.0, GA1=150.0, GA2=200.0, mass=1.0)
ROD = dx.Rod(1.0, BARE)
FRAME = dx.Clamped(tangent=(1, 2, 3), d1=(1, 0, 0)).R
RUBBER = dx.Material(E=1e6, nu=0.5, density=1e3)
VECTORS = dx.Table(S, np.arange(9.0).reshape(3, 3) / 7.0, "linear")

# At least one value of every public class, with all its fields somewhere.
SECTIONS = [
    dx.Circle(1e-3),
    dx.Circle(dx.Table(S, [1e-3, 2e-3, 1.5e-3])),
    dx.Tube(2e-3, 1e-3),
    dx.Rectangle(1e-3, dx.Table(S, [1e-3, 2e-3, 1.5e-3], "linear")),
    dx.Ellipse(1e-3, 2e-3),
    dx.StiffnessMatrix(np.diag([1.0, 2.0, 0.7]), mass=1.0),
    dx.StiffnessMatrix(dx.Table([0, 1.0], [np.eye(6), 2.0 * np.eye(6)], "linear")),
]
SUPPORTS = [
    dx.Clamped(position=(0.1, 0.2, 0.3), tangent=(1, 2, 3), d1=(1, 0, -1), twist=1.3 * dx.turn),
    dx.Clamped(frame=FRAME),
    dx.Pinned((0.1, 0, 0.3)),
    dx.Hinge((1, 2, 0), (0.1, 0, 0.3), frame=FRAME),
    dx.Universal((1, 1, 0), (1, -1, 0), (0.1, 0, 0.3), tangent=(0, 1, 1)),
    dx.Roller((1, 2, 3), (0.1, 0, 0.3), sliding="section"),
    dx.Slider((1, 2, 3), (0.1, 0, 0.3), d1=(1, 1, 0), twist=0.2),
    dx.Guided(tangent=(1, 2, 3), twist=-0.2),
    dx.Spring(linear=3.0, rotational=np.diag([1.0, 2.0, 0.1]), position=(0, 0, 0.9), tangent=(0, 1, 1)),
    dx.Free(),
]
LOADS = [
    dx.Gravity(),
    dx.Gravity((0, 1.62, 0)),
    dx.EndForce((1, 2, 1 / 3), follower=True, offset=(0.1, 0, 1 / 3)),
    dx.EndMoment((1, 2, 1 / 3), at="end"),
    dx.PointForce((1, 2, 3), at=0.1, follower=True, offset=(0, 1 / 7, 0)),
    dx.PointMoment((1, 2, 3), at=0.7),
    dx.LineForce((1, 2, 3), frame="section"),
    dx.LineForce(VECTORS),
    dx.LineCouple(VECTORS, frame="section"),
    dx.Rotation((1, 0, 40), point=(0.1, 0, 0)),
    dx.ElectricField((0, 0, 1e5), charge_per_length=dx.Table(S, [1e-7, -1e-7, 0])),
    dx.Foundation(np.diag([1.0, 2.0, 0.1]), point=(0.1, 0, 0), direction=(1, 2, 3)),
    dx.Buoyancy(1000.0, area=1e-6, g=(0, 0, -1.62)),
]
METHODS = [
    dx.Collocation(rtol=1e-7, stages=3, elements=12),
    dx.Shooting(rtol=1e-8, pieces=4),
    dx.Elastica(rtol=1e-9),
    dx.DiscreteRod(30, clamp="two_vertices", grading=2.0),
]
NATURAL = [(0.0, 10.0, 1 / 3), dx.Helix(0.02, 0.01, handed="left"), dx.Table(S, np.ones((3, 3)))]
PROBLEMS = [
    *(dx.Equilibrium(dx.Rod(1.0, section, RUBBER if section.needs_material else None)) for section in SECTIONS),
    *(dx.Equilibrium(ROD, end=support) for support in SUPPORTS),
    *(dx.Equilibrium(ROD, loads=[load]) for load in LOADS),
    *(dx.Equilibrium(dx.Rod(1.0, BARE, natural=natural, stretch=True, shear=True)) for natural in NATURAL),
    dx.Equilibrium(dx.Rod(1 / 3, dx.Circle(1e-3), dx.Material(E=1e6, G=4e5))),
    dx.Equilibrium(ROD, start=dx.Free(), end=dx.Clamped(), loads=[dx.EndForce((1, 0, 0), at="start"), *LOADS[4:6]]),
    dx.Equilibrium(ROD, between={0.3: dx.Pinned((0, 0, 0.3)), 0.6: dx.Roller((1, 1, 1))}),
    dx.Ring(ROD, link=2.5, start=dx.Clamped(tangent=(1, 0, 0)), loads=[dx.Gravity()]),
]
DAMPING = [
    dx.MassDamping(2.0),
    dx.KelvinVoigt(bending=1e-3, twist=2e-3, stretch=1 / 3),
    dx.LinearDrag(along=0.1, across=0.2, fluid=(1, 0, 0)),
    dx.QuadraticDrag(0.1, 0.2, fluid=dx.Table(S, [[1, 0, 0], [1, 0, 0.3], [0, 0, 0]], "linear")),
]
MOTION_METHODS = [
    None,
    dx.ImplicitMidpoint(50, step=1e-3, tolerance=1e-9),
    dx.TRBDF2(segments=40, rtol=1e-4),
    dx.StormerVerlet(30, step=1e-6),
]
HUNG = dx.Equilibrium(dx.Rod(1.0, BARE, stretch=True), end=dx.Pinned((0, 0, 1)), loads=[dx.LineForce((1, 0, 0))])
TWICE = dataclasses.replace(HUNG, loads=(dx.Gravity(), *HUNG.loads))
MOTIONS = [
    dx.Motion(HUNG, 1 / 3, initial="equilibrium", rotary_inertia=0.1, release={"end": 0.2, "start": 0.0}),
    dx.Motion(HUNG, 1.0, velocity=VECTORS, spin=dx.Table(S, [1, 2, 3]), load_factor=0.5, damping=DAMPING),
    dx.Motion(TWICE, 1.0, load_factor=[None, dx.Table(S, [0, 1, 2], "linear")]),
    dx.Motion(HUNG, 1.0, velocity=(0, 1, 0), spin=7.0, load_factor=dx.Table(S, [0, 1, 2], "linear")),
    dx.Motion(HUNG, 1.0, start=dx.Moving(dx.Table(S, [[0, 0, 0], [0.01, 0, 0], [0, 0, 0.01]]))),
    dx.Motion(HUNG, 1.0, end=dx.Moving(dx.Table(S, [[0, 0, 1], [0.01, 0, 0.9], [0, 0, 0.9]]))),
]
ALL = [
    *(Scenario(problem) for problem in PROBLEMS),
    *(Scenario(PROBLEMS[0], method) for method in METHODS),
    *(Scenario(motion.problem, None, motion) for motion in MOTIONS),
    *(Scenario(HUNG, METHODS[0], MOTIONS[0], method) for method in MOTION_METHODS),
]


@pytest.mark.parametrize(
    "stated", ALL, ids=lambda x: f"{x.motion_method or x.motion or ''}{x.problem.loads}{x.problem.end}{x.method}"[:60]
)
def test_what_is_written_is_read_back_equal(stated: Scenario) -> None:
    assert scenario.parse(stated.toml) == stated


def descriptions() -> set[str]:
    """The public classes that are descriptions: made by `checks.description`, which wraps their constructor."""
    classes = {name: getattr(dx, name) for name in dx.__all__ if isinstance(getattr(dx, name), type)}
    return {name for name, cls in classes.items() if hasattr(cls.__init__, "__wrapped__")}


def test_every_public_description_has_its_form_and_its_round_trip() -> None:
    written_by_hand = {"Equilibrium", "Ring", "Table", "Scenario"}
    assert descriptions() == {shape.description for shape in forms.SHAPES} | written_by_hand

    def parts(value: Any) -> set[str]:
        inner = [getattr(value, field.name) for field in dataclasses.fields(value)]
        inner = [x for part in inner for x in (part if isinstance(part, tuple) else (part,))]
        inner = [x[1] if isinstance(x, tuple) and len(x) == 2 else x for x in inner]
        found = {type(value).__name__}
        return found.union(*(parts(x) for x in inner if dataclasses.is_dataclass(x)))

    assert set().union(*map(parts, ALL)) >= descriptions()


@pytest.mark.parametrize("shape", forms.SHAPES, ids=lambda shape: shape.description)
def test_a_form_has_the_fields_of_its_class(shape: forms.Shape) -> None:
    fields = [
        field for field in dataclasses.fields(shape.cls) if (shape.description, field.name) not in forms.UNWRITTEN
    ]
    assert set(shape.fields) == {field.name for field in fields}
    free = {field.name for field in fields if field.default is dataclasses.MISSING}
    if shape is not forms.MATERIAL:  # whose E a name may stand for
        assert set(shape.needs.split()) == free


def test_the_fields_of_problems_are_known() -> None:
    """A new field of a problem needs a place in `writing.toml` and `forms.problem`."""
    assert [f.name for f in dataclasses.fields(dx.Equilibrium)] == ["rod", "start", "end", "loads", "between"]
    assert {f.name for f in dataclasses.fields(dx.Ring)} == {"rod", "start", "end", "loads", "between", "link"}


FINITE = st.floats(-1e3, 1e3, allow_subnormal=False)
POSITIVE = st.floats(1e-3, 1e3)
VECTOR = st.tuples(FINITE, FINITE, FINITE)
DIRECTION = VECTOR.filter(lambda v: np.linalg.norm(v) > 1e-3)


@settings(max_examples=100, deadline=None)
@given(POSITIVE, DIRECTION, VECTOR, FINITE, st.lists(st.tuples(VECTOR, st.booleans()), max_size=3), DIRECTION)
def test_any_numbers_come_back_to_the_last_digit(length, tangent, position, twist, forces, along) -> None:
    start = dx.Clamped(position=position, tangent=tangent, twist=twist)
    start = dataclasses.replace(start, tangent=(0, 0, 1), frame=start.R) if twist > 0 else start
    loads = [dx.EndForce(force, follower=follower) for force, follower in forces]
    end = dx.Roller(along, sliding="section")
    problem = dx.Equilibrium(dx.Rod(length, BARE, stretch=True), start=start, end=end, loads=loads)
    assert scenario.parse(Scenario(problem).toml).problem == problem


ISSUE = """
[rod]
length   = "25 cm"
section  = { shape = "circle", radius = "1 mm" }
material = { E = "1 MPa", nu = 0.5, density = "1000 kg/m^3" }
stretch  = false
natural  = { helix = { radius = "2 cm", pitch = "2 cm" } }
[supports.start]
type     = "clamped"
position = ["0 m", "0 m", "0 m"]
tangent  = [1, 0, 0]
d1       = [0, 0, 1]
[supports.end]
type     = "free"
[[loads]]
type     = "gravity"
g        = ["0 m/s^2", "0 m/s^2", "-9.81 m/s^2"]
[[loads]]
type     = "end_force"
force    = ["0 N", "0 N", "-1 N"]
[method]
name     = "collocation"
rtol     = 1e-8
"""


def test_the_form_of_a_file() -> None:
    rod = dx.Rod(0.25, dx.Circle(1e-3), RUBBER, natural=dx.Helix(0.02, 0.02))
    start = dx.Clamped(tangent=(1, 0, 0), d1=(0, 0, 1))
    problem = dx.Equilibrium(rod, start=start, loads=[dx.Gravity(), dx.EndForce((0, 0, -1))])
    assert scenario.parse(ISSUE) == Scenario(problem, dx.Collocation(rtol=1e-8))
    bare = "[rod]\nlength = 1\nsection = { EI1 = 1.0, EI2 = 1.0, GJ = 0.7, mass = 1.0 }\n"
    section = dx.Stiffness(EI1=1.0, EI2=1.0, GJ=0.7, mass=1.0)
    assert scenario.parse(bare) == Scenario(dx.Equilibrium(dx.Rod(1.0, section)))
    moment = '[[loads]]\ntype = "end_moment"\nmoment = ["1 N mm", 0, 0]\nfollower = true\n'
    assert scenario.parse(bare + moment).problem.loads == (dx.EndMoment((1e-3, 0, 0), follower=True),)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("25 cm", "m", 0.25),
        ("7 mm", "m", 0.007),
        ("3.3 um", "m", 3.3e-6),
        ("1 inch", "m", 0.0254),
        ("-1e-3 km", "m", -1.0),
        ("1 MPa", "Pa", 1e6),
        ("7.85 g/cm^3", "kg/m^3", 7850.0),
        ("90 deg", "rad", np.pi / 2.0),
        ("2 turn", "rad", 4.0 * np.pi),
        ("3 /cm", "1/m", 300.0),
        ("3 1/cm", "1/m", 300.0),
        ("5 lbf", "N", 22.2411080763025),  # 0.45359237 kg x 9.80665 m/s^2
        ("3 pN nm^2", "N m^2", 3e-30),
        ("60 rpm", "rad/s", 2.0 * np.pi),
        (0.25, "m", 0.25),
        (3, "m", 3.0),
    ],
)
def test_units(text, unit, value) -> None:
    assert units.si(text, unit) == pytest.approx(value, rel=1e-15)


def test_the_familiar_units_are_those_of_pint() -> None:
    import pint

    registry = pint.UnitRegistry()
    for unit, texts in units.FAMILIAR.items():
        for text, factor in texts.items():
            assert registry.Quantity(1.0, text).to(unit).magnitude == pytest.approx(float(factor), rel=1e-15)


MOVED = """
[motion]
duration = "1 s"
initial = "equilibrium"
velocity = ["1 cm/s", 0, 0]
load_factor = { t = [0, "500 ms", 1], values = [0, 1, 1], interpolation = "linear" }
release = { start = "0.5 s" }
[motion.method]
name = "tr_bdf2"
segments = 20
[motion.start]
position = { t = [0, 1], values = [[0, 0, 0], ["1 cm", 0, 0]], interpolation = "linear" }
[[motion.damping]]
type = "linear_drag"
along = 0.1
across = "0.2 N s/m^2"
"""


def test_the_form_of_a_motion(tmp_path: Path) -> None:
    found = scenario.parse(ISSUE + MOVED)
    motion = dx.Motion(
        found.problem,
        1.0,
        initial="equilibrium",
        velocity=(0.01, 0, 0),
        load_factor=dx.Table([0, 0.5, 1], [0, 1, 1], "linear"),
        release={"start": 0.5},
        start=dx.Moving(dx.Table([0, 1], [[0, 0, 0], [0.01, 0, 0]], "linear")),
        damping=[dx.LinearDrag(0.1, 0.2)],
    )
    assert found == Scenario(found.problem, dx.Collocation(rtol=1e-8), motion, dx.TRBDF2(20))
    assert [motion.factor(t) for t in (0.0, 0.25, 0.75)] == [0.0, 0.5, 1.0]
    np.testing.assert_allclose(motion.position("start", 0.5), (0.005, 0, 0))
    (tmp_path / "shake.csv").write_text("t,x,y,z\n0,0,0,0\n1,0.01,0,0\n")
    (tmp_path / "a.toml").write_text(
        ISSUE + re.sub("{ t = .0, 1.*}", '{ table = "shake.csv", interpolation = "linear" }', MOVED)
    )
    assert scenario.read(tmp_path / "a.toml") == found
    wrong = {
        ('"equilibrium"', '"equilibrum"'): ["line 27", "motion.initial", "Did you mean 'equilibrium'?"],
        ('"tr_bdf2"', '"trbdf2"'): ["line 32", "motion.method.name", "Did you mean 'tr_bdf2'?"],
        ('"linear_drag"', '"drag"'): ["line 37", "motion.damping[0].type", "'kelvin_voigt'"],
        ('"500 ms", 1]', '"500 ms", 0.2]'): ["line 29", "Table.s", "times"],
        ('"500 ms", 1]', '"500 ms", 0.9]'): ["line 29", "motion.load_factor", "0 to 0.9 s", "the duration, 1 s"],
        ("t = [0, 1]", "s = [0, 1]"): ["line 35", "motion.start.position", "s is not known", "takes t"],
        ("{ start =", "{ strat ="): ["line 30", "motion.release.strat", "'start'"],
        ("load_factor = {", "load_factor = [1, 2, 3] # {"): ["motion.load_factor has 3 factors", "2 loads"],
        ("load_factor = {", 'load_factor = [1, "a"] # {'): ["line 29", "motion.load_factor[1]", "'a'"],
        ('"1 s"', '"-1 s"'): ["line 26", "motion.duration", "positive"],
    }
    for (old, new), words in wrong.items():
        assert old in MOVED
        with pytest.raises(dx.InvalidInput) as caught:
            scenario.parse(ISSUE + MOVED.replace(old, new, 1))
        for word in words:
            assert word in str(caught.value), f"{word!r} is missing in: {caught.value}"


def test_what_a_motion_s_file_can_t_hold() -> None:
    for motion, field in (
        (dx.Motion(HUNG, 1.0, load_factor=lambda t: t), "motion.load_factor"),
        (dx.Motion(HUNG, 1.0, load_factor=[lambda t: t]), r"motion.load_factor\[0\]"),
        (dx.Motion(HUNG, 1.0, start=dx.Moving(lambda t: (0, 0, 0))), "motion.start.position"),
        (dx.Motion(HUNG, 1.0, initial=lambda s: np.outer(s, (0, 0, 1))), "motion.initial"),
    ):
        with pytest.raises(dx.InvalidInput, match=f"^{field} is .*can't hold"):
            Scenario(HUNG, None, motion).write("never.toml")


MISTAKES = {
    "misspelt field": ("length   =", "lenght =", ["line 3", "rod.lenght", "takes length", "Did you mean 'length'?"]),
    "misspelt table": ("[rod]", "[rodd]", ["line 2", "rodd", "Did you mean 'rod'?"]),
    "misspelt kind": ('"clamped"', '"clampd"', ["line 9", "supports.start.type", "'clampd'", "'pinned'", "mean 'clamped'?"]),
    "no kind": ('type     = "gravity"\n', "", ["line 15", "loads[0].type is missing", "'gravity'"]),
    "kind in capitals": ('"gravity"', '"Gravity"', ["line 16", "loads[0].type", "Did you mean 'gravity'?"]),
    "wrong unit": ('"25 cm"', '"25 kg"', ["line 3", "rod.length", "'25 kg'", "number in m", "'25 cm'"]),
    "unknown unit": ('"25 cm"', '"25 cmm"', ["line 3", "rod.length", "'cmm' is not known", "Did you mean '"]),
    "a unit all but right": ('"25 cm"', '"25 mn"', ["rod.length", "'mn' is not known", "Did you mean 'mm' or 'nm'?"]),
    "capitals of a unit": ("1 MPa", "1 mpa", ["'mpa' is not known", "Did you mean 'MPa'?"]),
    "decimal comma": ('"25 cm"', '"30,5 cm"', ["rod.length is '30,5 cm'", "decimal point", "'30.5 cm'"]),
    "a comma between thousands": ('"25 cm"', '"1,000 mm"', ["'1.000 mm', or '1000 mm'"]),
    "a decimal comma and thousands": ('"25 cm"', '"1.000,5 mm"', ["a decimal point; write '1000.5 mm'"]),
    "commas between thousands": ('"25 cm"', '"1,000,000.5 mm"', ["a decimal point; write '1000000.5 mm'"]),
    "nothing but thousands": ('"25 cm"', '"1,000,000 mm"', ["a decimal point; write '1000000 mm'"]),
    "no unit": ('"25 cm"', '"25"', ["line 3", "rod.length", "'25 m'"]),
    "unit of a plain number": ("nu = 0.5", 'nu = "0.5 m"', ["line 5", "rod.material.nu", "plain number"]),
    "arithmetic": ('"25 cm"', '"9**9**9 m"', ["line 3", "rod.length"]),
    "nan": ('"25 cm"', "nan", ["line 3", "rod.length is nan", "finite"]),
    "1e400": ('"25 cm"', "1e400", ["line 3", "rod.length is inf", "finite"]),
    "1e400 m": ('"25 cm"', '"1e400 m"', ["line 3", "rod.length", "finite"]),
    "true for a number": ('"25 cm"', "true", ["line 3", "rod.length is True", "number in m"]),
    "text for a flag": ("stretch  = false", 'stretch = "no"', ["line 6", "rod.stretch", "true or false"]),
    "two numbers": ("[1, 0, 0]", "[1, 0]", ["line 11", "supports.start.tangent", "three numbers"]),
    "wrong unit in a vector": ('["0 N", "0 N"', '["0 N", "0 m"', ["line 20", "loads[1].force[1]", "'0 m'", "number in N"]),
    "negative radius": ('"1 mm"', '"-1 mm"', ["line 4", "section.radius is -0.001 m", "positive", "Did you mean 0.001?"]),
    "no radius": (', radius = "1 mm"', "", ["line 4", "rod.section.radius is missing"]),
    "unknown shape": ('"circle"', '"circel"', ["line 4", "rod.section.shape", "Did you mean 'circle'?"]),
    "unknown material": ("{ E", '{ name = "steal", E', ["line 5", "rod.material.name", "Did you mean 'steel'?"]),
    "no density": (', density = "1000 kg/m^3"', "", ["material.density is missing", "Gravity"]),
    "two natural shapes": ("natural  = {", "natural = { curvature = [0, 0, 1],", ["line 7", "rod.natural", "one of"]),
    "end force on a clamp": ("force    =", 'at = "start"\nforce =', ["line 18", "loads[1]", "clamped"]),
    "a rod that nothing holds": ('"clamped"\nposition = ["0 m", "0 m", "0 m"]\ntangent  = [1, 0, 0]\nd1       = [0, 0, 1]', '"free"', ["Free()", "nothing holds"]),
    "no toml": ("[rod]", "[rod", ["line 2", "not TOML"]),
    "rtol of nothing": ("1e-8", "0", ["line 23", "collocation.rtol", "positive"]),
    "a table outside": ("{ helix = { radius = \"2 cm\", pitch = \"2 cm\" } }", "{ table = '../k.csv' }", ["line 7", "own folder", "--anywhere"]),
    "a ring with an end": ("[method]", "[ring]\nlink = 1\n[method]", ["supports.end", "ring"]),
}  # fmt: skip


@pytest.mark.parametrize(("old", "new", "words"), MISTAKES.values(), ids=MISTAKES.keys())
def test_a_mistake_is_a_sentence_with_file_line_and_field(old, new, words, tmp_path: Path) -> None:
    assert old in ISSUE
    file = tmp_path / "wrong.toml"
    file.write_text(ISSUE.replace(old, new, 1))
    with pytest.raises(dx.InvalidInput) as caught:
        dx.load(file)
    text = str(caught.value)
    assert text.startswith(str(file))
    for word in words:
        assert word in text, f"{word!r} is missing in: {text}"
    assert "\n" not in text
    assert len(text) < 600 + len(str(file))
    assert text.rstrip()[-1] in ".?"


NEWCOMER = '[rod]\nlength = "1 m"\nsection = { shape = "circle", radius = "1 mm" }\nmaterial = "steel"\n'
# What a newcomer writes, by what it replaces (at the end where that is empty), and what is said.
WRITTEN = {
    "one load in single brackets": (
        "",
        '[loads]\ntype = "gravity"\n',
        "loads is one table; write [[loads]] in double brackets",
    ),
    "one rod in double brackets": ("[rod]", "[[rod]]", "write its name in single brackets"),
    "a support in double brackets": ("", '[[supports.start]]\ntype = "free"\n', "write its name in single brackets"),
    "no quotes": ('"1 m"', "1 m", 'stands in quotes: length = "1 m"'),
    "no quotes about a word": ('"steel"', "steel", 'stands in quotes: material = "steel"'),
    "quotes of print": ('"1 m"', "\u201c1 m\u201d", 'write straight quotes: length = "1 m"'),
    "one quote": ('"1 m"', '"1 m', "line 2: 'length = \"1 m' is not TOML (a quote is missing)"),
    "one quote in braces": ('"1 mm"', '"1 mm', "a quote is missing"),
    "a plain decimal comma": ('"1 m"', "1,5", "write a decimal point: length = 1.5"),
    "a colon": ("length =", "length:", "write: name = value"),
    "True": ("", "stretch = True\n", "write: stretch = true"),
    "twice": ("", "[rod]\n", "state each table and each key once"),
    "diameter": ("radius", "diameter", "Write radius, which is half of it"),
    "material at the top": ("", "[material]\nE = 1\n", "It belongs into the table [rod]"),
    "E in the rod": ('material = "steel"', "E = 1", "It belongs into the table [rod.material]"),
    "pin": ("", '[supports.end]\ntype = "pin"\n', "Did you mean 'pinned'?"),
    "fixed": ("", '[supports.end]\ntype = "fixed"\n', "Did you mean 'clamped'?"),
    "force": ("", '[[loads]]\ntype = "force"\n', "Did you mean 'end_force' or 'point_force' or 'line_force'?"),
    "weight": ("", '[[loads]]\ntype = "weight"\n', "Did you mean 'gravity'?"),
    "round": ("circle", "round", "Did you mean 'circle'?"),
    "degrees": ("", '[supports.end]\ntype = "clamped"\ntwist = "90 degre"\n', "Did you mean 'deg'?"),
    "per cent of an angle": ("", '[supports.end]\ntype = "clamped"\ntwist = "50 %"\n', "of another kind"),
    "newton": ("", '[[loads]]\ntype = "end_force"\nforce = [0, 0, "6 mn"]\n', "Did you mean 'mN'?"),
    "method by its class": ("", '[method]\nname = "Collocation"\n', "Did you mean 'collocation'?"),
    "time": ("", '[motion]\ntime = "3 s"\n', "Did you mean 'duration'?"),
    "nothing near": ("", '[supports.end]\ntype = "xyz"\n', "'free'."),
}


@pytest.mark.parametrize(("old", "new", "words"), WRITTEN.values(), ids=WRITTEN.keys())
def test_what_a_newcomer_writes_is_mended_in_words(old: str, new: str, words: str) -> None:
    assert old in NEWCOMER
    text = NEWCOMER.replace(old, new, 1) if old else NEWCOMER + new
    with pytest.raises(dx.InvalidInput, match=re.escape(words)) as caught:
        scenario.parse(text)
    assert ("Did you mean" in words) == ("Did you mean" in str(caught.value))


HEAD = "[rod]\nlength = 1\nsection = { EI1 = 1.0, GJ = 1.0 }\n"
BIG = scenario.LARGEST - 1000
REFUSED = {
    "deep lists": "x = " + "[" * BIG,
    "deep tables": "x = " + "{a=" * (BIG // 3),
    "deep keys": "a." * (BIG // 2) + "b = 1",
    "deep quoted keys": '"a".' * (BIG // 4) + "b = 1",
    "many digits": "[rod]\nlength = " + "1" * BIG,
    "many digits in a text": "[rod]\nlength = '" + "1" * BIG + " m'",
    "a long unit": "[rod]\nlength = '1 " + "m" * BIG + "'",
    "many loads": HEAD + "[[loads]]\ntype='gravity'\n" * (BIG // 30),
    "many samples": HEAD + "natural = { curvature = { s = [" + "1," * (BIG // 2 - 50) + "] } }",
    "many keys": "".join(f"k{i}=1\n" for i in range(BIG // 10)),
}


@pytest.mark.parametrize("text", REFUSED.values(), ids=REFUSED.keys())
def test_a_monstrous_file_is_refused_in_a_sentence(text: str, tmp_path: Path) -> None:
    file = tmp_path / "monster.toml"
    file.write_text(text)
    with pytest.raises(dx.InvalidInput) as caught:
        dx.load(file)
    assert len(str(caught.value)) < 700 + len(str(file))
    assert "\n" not in str(caught.value)


def test_a_file_of_100_megabytes_is_not_read(tmp_path: Path) -> None:
    file = tmp_path / "big.toml"
    with file.open("wb") as handle:
        handle.truncate(100_000_000)
    began = time.perf_counter()
    with pytest.raises(dx.InvalidInput, match=r"100 MB"):
        dx.load(file)
    table = tmp_path / "table.toml"
    table.write_text(HEAD + "natural = { table = 'big.toml' }")
    with pytest.raises(dx.InvalidInput, match=r"20 MB"):
        dx.load(table)
    assert time.perf_counter() - began < 30.0  # never read: milliseconds on any machine
    for path in (tmp_path, tmp_path / "none.toml"):
        with pytest.raises(dx.InvalidInput, match="no file"):
            dx.load(path)
    file.write_bytes(b"\xff\xfe")
    with pytest.raises(dx.InvalidInput, match="UTF-8"):
        dx.load(file)


def test_what_breaks_a_file_never_breaks_the_reader() -> None:
    """Three hundred files with letters changed, doubled, or cut: read, or refused in a sentence; never another error."""
    chance = random.Random(5)
    texts = [stated.toml for stated in ALL] + [ISSUE]
    letters = "[]{}=\"',.#\n 019eE-+mNaxyz\\\u00e9\u0000"
    sentences = []
    for _ in range(300):
        text = chance.choice(texts)
        for _ in range(chance.randint(1, 4)):
            at = chance.randrange(len(text))
            to = chance.choice([at, at + 1, at + chance.randint(1, 9)])
            text = text[:at] + chance.choice(["", chance.choice(letters), text[at:to] * 2, "nan"]) + text[to:]
        try:
            scenario.parse(text)
        except dx.InvalidInput as error:
            sentences.append(str(error))
    assert len(sentences) > 100
    assert not any("\n" in sentence for sentence in sentences)


def test_tables_in_files(tmp_path: Path) -> None:
    inside, outside = tmp_path / "inside", tmp_path / "k.csv"
    inside.mkdir()
    s, k = np.linspace(0.0, 1.0, 5), np.arange(15.0).reshape(5, 3) / 7.0
    np.savetxt(outside, np.column_stack([s, k]), delimiter=",", header="s,k1,k2,k3", comments="", fmt="%.17g")
    (inside / "k.csv").write_bytes(outside.read_bytes())
    (inside / "radius.csv").write_text("0,1e-3\n0.5,2e-3\n1,1e-3\n")
    file = inside / "rod.toml"
    file.write_text(HEAD + "natural = { table = 'k.csv' }")
    assert dx.load(file).rod.natural == dx.Table(s, k)
    file.write_text(
        "[rod]\nlength = 1\nmaterial = 'steel'\nsection = { shape = 'circle', radius = { table = 'radius.csv', interpolation = 'linear' } }"
    )
    assert dx.load(file).rod.section.radius == dx.Table([0, 0.5, 1], [1e-3, 2e-3, 1e-3], "linear")
    (inside / "link.csv").symlink_to(outside)
    for name in ("../k.csv", str(outside), "link.csv"):
        file.write_text(HEAD + f"natural = {{ table = '{name}' }}")
        with pytest.raises(dx.InvalidInput, match="own folder"):
            dx.load(file)
        assert dx.load(file, anywhere=True).rod.natural == dx.Table(s, k)
    wrong = {
        "0,1,2,3\n1,2,3,x\n": "numbers between commas",
        "0,1\n1,2\n": "columns",
        "": "fewer",
        "0,1,2,nan\n1,2,3,4": "finite",
    }
    file.write_text(HEAD + "natural = { table = 'k.csv' }")
    for content, words in wrong.items():
        (inside / "k.csv").write_text(content)
        with pytest.raises(dx.InvalidInput, match=words):
            dx.load(file)
    (inside / "k.csv").write_text("0,1,2,3\n" * 100_002)
    with pytest.raises(dx.InvalidInput, match="100002 lines"):
        dx.load(file)
    with pytest.raises(dx.InvalidInput, match="a file itself"):
        scenario.parse(HEAD + "natural = { table = 'k.csv' }")


def test_a_function_has_no_form_in_a_file(tmp_path: Path) -> None:
    cone = dx.Rod(1.0, dx.Circle(lambda s: 1e-3 + 1e-4 * s), RUBBER)
    for problem, field in (
        (dx.Equilibrium(cone), "rod.section.radius"),
        (dx.Equilibrium(ROD, loads=[dx.LineForce(lambda s, r, R: -r)]), r"loads\[0\].force"),
        (dx.Equilibrium(dx.Rod(1.0, BARE, natural=lambda s: np.ones((len(s), 3)))), "rod.natural"),
    ):
        with pytest.raises(dx.InvalidInput, match=f"^{field} is a Python function.*Table"):
            problem.to_toml(tmp_path / "f.toml")
    assert not list(tmp_path.iterdir())

    class Breeze(dx.Gravity):
        pass

    with pytest.raises(dx.InvalidInput, match="Breeze"):
        dx.Equilibrium(ROD, loads=[Breeze()]).to_toml(tmp_path / "f.toml")
    long = dx.Rod(1.0, dx.Stiffness(EI1=dx.Table(np.linspace(0, 1, 50_000), np.ones(50_000)), GJ=1.0))
    with pytest.raises(dx.InvalidInput, match="Thin out"):
        dx.Equilibrium(long).to_toml(tmp_path / "f.toml")


def test_files_of_a_problem(tmp_path: Path) -> None:
    hanging = dx.Equilibrium(
        dx.Rod(0.25, dx.Circle(1e-3), RUBBER), start=dx.Clamped(tangent=(1, 0, 0)), loads=[dx.Gravity()]
    )
    hanging.to_toml(tmp_path / "hanging.toml", dx.DiscreteRod(30))
    assert dx.load(tmp_path / "hanging.toml") == hanging
    assert scenario.read(tmp_path / "hanging.toml") == Scenario(hanging, dx.DiscreteRod(30))
    with pytest.raises(dx.InvalidInput, match="can't be written"):
        hanging.to_toml(tmp_path / "no folder" / "hanging.toml")


def test_methods_by_name() -> None:
    assert scenario.method("discrete") == dx.DiscreteRod()
    assert scenario.method("discrete_rod", dx.DiscreteRod(7)) == dx.DiscreteRod(7)
    assert scenario.method("shooting", dx.DiscreteRod(7)) == dx.Shooting()
    with pytest.raises(dx.InvalidInput, match="Did you mean 'shooting'"):
        scenario.method("shoting")


def test_the_material_library() -> None:
    for name, entry in materials.LIBRARY.items():
        assert dx.Rod(1.0, dx.Circle(1e-3), name).material == entry.material
        assert entry.material.density
        assert entry.source
        assert (
            scenario.parse(
                f"[rod]\nlength=1\nsection={{shape='circle',radius=1e-3}}\nmaterial='{name}'"
            ).problem.rod.material
            == entry.material
        )
    own = "[rod]\nlength=1\nsection={shape='circle',radius=1e-3}\nmaterial={name='spring steel', density='7900 kg/m^3', nu=0.3}"
    assert scenario.parse(own).problem.rod.material == dx.Material(E=206e9, nu=0.3, density=7900.0)
    with pytest.raises(dx.InvalidInput, match="Did you mean 'nylon'"):
        dx.Rod(1.0, dx.Circle(1e-3), "nilon")
    # DNA: 50 nm kT at 298 K in bending, 410 pN nm^2 in twist (Bryant and others, 2003).
    stiffness = dx.Rod(1e-7, dx.Circle(1e-9), "DNA").stiffness(np.zeros(1))
    assert stiffness.EI1[0] == pytest.approx(50e-9 * 1.380649e-23 * 298.15, rel=0.01)
    assert stiffness.GJ[0] == pytest.approx(410e-30, rel=0.01)


def test_the_schema_names_every_field() -> None:
    text = json.dumps(scenario.schema())
    for shape in forms.SHAPES:
        assert f'"{shape.description}"' in text
        for field in shape.fields:
            assert f'"{field}"' in text
    circle = scenario.schema()["$defs"]["Circle"]
    assert circle["required"] == ["shape", "radius"]
    assert circle["additionalProperties"] is False


def test_reading_loads_pint_for_rare_units_only() -> None:
    code = (
        "import sys; from darboux import scenario; scenario.parse(sys.argv[1]); print([m for m in ('pint', 'matplotlib', "
        "'xarray') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code, ISSUE], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
