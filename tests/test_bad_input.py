"""Every mistake gets one sentence: the field, what came, what is allowed, how to mend it."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import darboux as dx

CIRCLE = dx.Circle(radius=1e-3)
RUBBER = dx.Material(E=1e6, nu=0.5, density=1e3)
ROD = dx.Rod(length=0.25, section=CIRCLE, material=RUBBER)
BARE = dx.Rod(length=1.0, section=dx.Stiffness(EI1=1.0, GJ=0.7))
NAN, INF = float("nan"), float("inf")

# What a person types, and words that the sentence must hold.
MISTAKES = {
    "negative radius": (lambda: dx.Circle(radius=-1e-3), ["section.radius", "-0.001 m", "positive", "Did you mean 0.001?"]),
    "a length beyond reason": (lambda: dx.Rod(1e300, CIRCLE, RUBBER), ["rod.length", "1e+300 m", "1e-15 to 1e+09", "unit"]),
    "a section beyond reason": (lambda: dx.Rod(1.0, dx.Ellipse(1e100, 1e-100), RUBBER), ["section", "unit"]),
    "curvature beyond reason": (
        lambda: dx.solve(dx.Equilibrium(dx.Rod(1.0, BARE.section, natural=(0, 1e10, 0)))),
        ["rod.natural", "winds the rod", "1/m"],
    ),
    "zero radius": (lambda: dx.Circle(radius=0), ["section.radius", "positive"]),
    "nan radius": (lambda: dx.Circle(radius=NAN), ["section.radius", "nan", "finite"]),
    "text for a number": (lambda: dx.Circle(radius="1 mm"), ["section.radius", "'1 mm'", "number in m"]),
    "nothing for a number": (lambda: dx.Circle(radius=None), ["section.radius", "None"]),
    "a pair for a number": (lambda: dx.Circle(radius=[1, 2]), ["section.radius", "single number"]),
    "wall turned inside out": (lambda: dx.Tube(1e-3, 2e-3), ["inner_radius", "outer_radius", "smaller"]),
    "negative side": (lambda: dx.Rectangle(1e-3, -1e-3), ["section.height", "positive"]),
    "negative semi-axis": (lambda: dx.Ellipse(-1e-3, 1e-3), ["section.a", "positive"]),
    "negative stiffness": (lambda: dx.Stiffness(EI1=-1, GJ=1), ["section.EI1", "N m^2", "positive"]),
    "zero torsional stiffness": (lambda: dx.Stiffness(EI1=1, GJ=0), ["section.GJ", "positive"]),
    "negative mass": (lambda: dx.Stiffness(EI1=1, GJ=1, mass=-1), ["section.mass", "kg/m", "negative"]),
    "unknown keyword": (lambda: dx.Circle(raduis=1e-3), ["Circle", "'raduis'", "Did you mean radius?"]),
    "missing argument": (lambda: dx.Rod(section=CIRCLE), ["Rod", "length"]),
    "too many arguments": (lambda: dx.Free(1, 2), ["Free", "no arguments"]),
    "negative modulus": (lambda: dx.Material(E=-1e6, nu=0.3), ["material.E", "Pa", "positive"]),
    "nu above a half": (lambda: dx.Material(E=1e6, nu=0.7), ["material.nu", "0.7", "-1", "0.5"]),
    "nu of minus one": (lambda: dx.Material(E=1e6, nu=-1.0), ["material.nu", "-1"]),
    "nu and G": (lambda: dx.Material(E=1e6, nu=0.3, G=1e5), ["nu or G", "both"]),
    "neither nu nor G": (lambda: dx.Material(E=1e6), ["nu or G", "neither"]),
    "negative density": (lambda: dx.Material(E=1e6, nu=0.3, density=-1), ["material.density", "negative"]),
    "negative length": (lambda: dx.Rod(-1, CIRCLE, RUBBER), ["rod.length", "-1 m", "positive"]),
    "infinite length": (lambda: dx.Rod(INF, CIRCLE, RUBBER), ["rod.length", "finite"]),
    "no material": (lambda: dx.Rod(1, CIRCLE), ["rod.material", "Material("]),
    "material beside stiffnesses": (lambda: dx.Rod(1, dx.Stiffness(EI1=1.0, GJ=1.0), RUBBER), ["rod.material", "leave it out"]),
    "section of the wrong kind": (lambda: dx.Rod(1, 1e-3, RUBBER), ["rod.section", "Circle"]),
    "stretch without EA": (lambda: dx.Rod(1, dx.Stiffness(EI1=1.0, GJ=1.0), stretch=True), ["rod.stretch", "section.EA"]),
    "shear without GA": (lambda: dx.Rod(1, dx.Stiffness(EI1=1.0, GJ=1.0, EA=1.0), shear=True), ["rod.shear", "GA1"]),
    "stretch that is no yes or no": (lambda: dx.Rod(1, CIRCLE, RUBBER, stretch="yes"), ["rod.stretch", "True or False"]),
    "natural curvature of two numbers": (lambda: dx.Rod(1, CIRCLE, RUBBER, natural=(1, 2)), ["rod.natural", "3 numbers"]),
    "nan natural curvature": (lambda: dx.Rod(1, CIRCLE, RUBBER, natural=(0, NAN, 0)), ["rod.natural", "finite"]),
    "function of the wrong shape": (lambda: dx.Rod(1, CIRCLE, RUBBER, natural=lambda s: s), ["rod.natural", "(17, 3)"]),
    "function that fails": (lambda: dx.Rod(1, CIRCLE, RUBBER, natural=lambda s: 1 / 0), ["rod.natural", "ZeroDivisionError"]),
    "function that is nan somewhere": (lambda: dx.Rod(1, dx.Circle(lambda s: np.sqrt(0.5 - s)), RUBBER), ["section.radius", "finite", "s = "]),
    "function that goes negative": (lambda: dx.Rod(1, dx.Circle(lambda s: 0.5 - s), RUBBER), ["section.radius", "positive all along"]),
    "table that does not ascend": (lambda: dx.Table([0, 2, 1], [1, 2, 3]), ["Table.s", "ascending"]),
    "table of unlike lengths": (lambda: dx.Table([0, 1, 2], [1, 2]), ["Table.values", "3"]),
    "table that ends early": (lambda: dx.Rod(1, dx.Circle(dx.Table([0, 0.5], [1, 2])), RUBBER), ["Table", "0.5", "1 m"]),
    "word for an interpolation": (lambda: dx.Table([0, 1], [1, 2], "cubik"), ["interpolation", "Did you mean 'cubic'?"]),
    "helix of no radius": (lambda: dx.Helix(radius=0, pitch=1), ["natural.radius", "positive"]),
    "helix of negative pitch": (lambda: dx.Helix(radius=1, pitch=-1), ["natural.pitch", "handed='left'"]),
    "helix of no hand": (lambda: dx.Helix(1, 1, handed="lefty"), ["natural.handed", "Did you mean 'left'?"]),
    "tangent of zero length": (lambda: dx.Clamped(tangent=(0, 0, 0)), ["clamp.tangent", "length above zero"]),
    "tangent of two numbers": (lambda: dx.Clamped(tangent=(1, 0)), ["clamp.tangent", "3 numbers"]),
    "d1 along the tangent": (lambda: dx.Clamped(tangent=(1, 0, 0), d1=(2, 0, 0)), ["clamp.d1", "parallel"]),
    "frame that is not orthonormal": (lambda: dx.Clamped(frame=np.ones((3, 3))), ["clamp.frame", "orthonormal"]),
    "left-handed frame": (lambda: dx.Clamped(frame=np.diag([1.0, -1.0, 1.0])), ["clamp.frame", "left-handed", "d1 x d2"]),
    "frame and tangent": (lambda: dx.Clamped(frame=np.eye(3), tangent=(1, 0, 0)), ["clamp.frame", "clamp.tangent"]),
    "nan position": (lambda: dx.Clamped(position=(0, NAN, 0)), ["clamp.position", "finite"]),
    "force of two numbers": (lambda: dx.EndForce((1, 2)), ["end_force.force", "3 numbers in N"]),
    "infinite moment": (lambda: dx.EndMoment((0, INF, 0)), ["end_moment.moment", "finite"]),
    "offset of two numbers": (lambda: dx.EndForce((1, 2, 3), offset=(0.1, 0)), ["end_force.offset", "3 numbers in m"]),
    "offset that is no number": (lambda: dx.PointForce((1, 2, 3), 0.1, offset=(0, 0, NAN)), ["point_force.offset", "finite"]),
    "load at no end": (lambda: dx.EndForce((1, 0, 0), at="tip"), ["end_force.at", "'start', 'end'"]),
    "load in the wrong frame": (lambda: dx.LineForce((1, 0, 0), frame="body"), ["line_force.frame", "'fixed', 'section'"]),
    "couple in the wrong frame": (lambda: dx.LineCouple((1, 0, 0), frame=3), ["line_couple.frame", "'fixed', 'section'"]),
    "nothing holds the rod": (lambda: dx.Equilibrium(ROD, start=dx.Free()), ["Free()", "Clamp one end"]),
    "load on a clamp": (lambda: dx.Equilibrium(ROD, loads=[dx.EndForce((1, 0, 0), at="start")]), ["loads[0]", "clamped", "at='end'"]),
    "no load": (lambda: dx.Equilibrium(ROD, loads=[1]), ["loads[0]", "Gravity()"]),
    "a support's class": (lambda: dx.Equilibrium(ROD, start=dx.Clamped), ["problem.start", "Clamped()"]),
    "a rod that is none": (lambda: dx.Equilibrium("rod"), ["problem.rod", "a Rod"]),
    "ends further apart than the rod is long": (lambda: dx.Equilibrium(ROD, end=dx.Clamped(position=(0, 0, 0.3))), ["0.3 m apart", "0.25 m", "stretch=True"]),
    "weight of a rod without mass": (lambda: dx.Equilibrium(BARE, loads=[dx.Gravity()]), ["section.mass", "Gravity"]),
    "weight without density": (lambda: dx.Equilibrium(dx.Rod(1, CIRCLE, dx.Material(1e6, 0.5)), loads=[dx.Gravity()]), ["material.density", "Gravity"]),
    "load function of the wrong shape": (lambda: dx.Equilibrium(BARE, loads=[dx.LineForce(lambda s: s)]), ["line_force.force", "(17, 3)"]),
    "a method's class": (lambda: dx.solve(dx.Equilibrium(BARE), dx.Shooting), ["solve.method", "Did you mean Shooting()?"]),
    "a method that is none": (lambda: dx.solve(dx.Equilibrium(BARE), "shooting"), ["solve.method", "'shooting'"]),
    "a problem that is none": (lambda: dx.solve(BARE), ["solve.problem", "Equilibrium"]),
    "unknown keyword of solve": (lambda: dx.solve(dx.Equilibrium(BARE), trow=False), ["solve", "'trow'", "Did you mean throw?"]),
    "tolerance of nothing": (lambda: dx.Shooting(rtol=0), ["shooting.rtol", "positive"]),
    "tolerance below rounding": (lambda: dx.Shooting(rtol=1e-20), ["shooting.rtol", "1e-12"]),
    "no pieces": (lambda: dx.Shooting(pieces=0), ["shooting.pieces", "1 or more"]),
    "half a segment": (lambda: dx.DiscreteRod(segments=2.5), ["discrete_rod.segments", "whole number"]),
    "one segment": (lambda: dx.DiscreteRod(segments=1), ["discrete_rod.segments", "2 or more"]),
    "unknown clamp": (lambda: dx.DiscreteRod(clamp="half"), ["discrete_rod.clamp", "Did you mean 'half_cell'?"]),
    "grading below one": (lambda: dx.DiscreteRod(grading=0.5), ["discrete_rod.grading", "1 (equal segments)"]),
    "a shearing discrete rod": (lambda: dx.solve(dx.Equilibrium(dx.Rod(1, CIRCLE, RUBBER, shear=True)), dx.DiscreteRod()), ["DiscreteRod", "shear", "Collocation"]),
    "a graded ring": (lambda: dx.solve(dx.Ring(BARE), dx.DiscreteRod(grading=2.0)), ["Ring", "equal segments", "grading"]),
    "a clamp between a discrete rod's ends": (lambda: dx.solve(dx.Equilibrium(BARE, between={0.5: dx.Clamped((0, 0, 0.5))}), dx.DiscreteRod()), ["Clamped at s = 0.5 m", "DiscreteRod", "Collocation"]),
    "a stretching elastica": (lambda: dx.solve(dx.Equilibrium(dx.Rod(1, CIRCLE, RUBBER, stretch=True)), dx.Elastica()), ["Elastica", "stretch"]),
    "integrate from nan": (lambda: dx.integrate(BARE, k=(NAN, 0, 0)), ["integrate.k", "finite"]),
    "integrate with an end force": (lambda: dx.integrate(BARE, k=(1, 0, 0), loads=[dx.EndForce((1, 0, 0))]), ["integrate", "along the rod"]),
    "table of words": (lambda: dx.Table(["a", "b"], [1, 2]), ["Table", "real numbers"]),
    "table with a hole": (lambda: dx.Table([0, 1], [1, NAN]), ["Table.values", "s = 1 m"]),
    "function of words": (lambda: dx.Rod(1, dx.Circle(lambda s: "a"), RUBBER), ["section.radius", "one real number"]),
    "ragged function": (lambda: dx.Rod(1, dx.Circle(1e-3), RUBBER, natural=lambda s: (s, s[:3], 0)), ["rod.natural", "three real numbers"]),
    "complex function": (lambda: dx.Rod(1, dx.Circle(lambda s: 1e-3 + 1j * s), RUBBER), ["section.radius", "real"]),
    "table of the wrong shape": (lambda: dx.Rod(1, dx.Circle(dx.Table([0, 1], np.ones((2, 3)))), RUBBER), ["Table", "(17, 3)"]),
    "number beyond floats": (lambda: dx.Rod(10**400, dx.Circle(1e-3), RUBBER), ["rod.length"]),
    "force beyond floats": (lambda: dx.EndForce((10**400, 0, 0)), ["end_force.force"]),
    "scalar for a vector": (lambda: dx.Gravity(9.81), ["gravity.g", "9.81", "3 numbers"]),
    "radius in millimetres": (lambda: dx.Rod(0.25, dx.Circle(1.0), RUBBER), ["1.77 m thick", "0.25 m long", "1 mm is 1e-3"]),
    "vanishing section": (lambda: dx.Rod(1, dx.Circle(1e-90), RUBBER), ["EI1", "unit"]),
    "G without a Poisson's ratio": (lambda: dx.Material(E=1e6, G=1e5), ["material.G", "Stiffness"]),
    "stiffnesses by place": (lambda: dx.Stiffness(1.0, 1.0), ["Stiffness", "EI1"]),
    "end load between clamps": (
        lambda: dx.Equilibrium(BARE, end=dx.Clamped(position=(0, 0, 1)), loads=[dx.EndForce((1, 0, 0))]),
        ["loads[0]", "Leave it out, or free the end"],
    ),
    "s in words": (lambda: dx.solve(dx.Equilibrium(BARE)).r("tip"), ["s is 'tip'", "arc length"]),
    "integrate too roughly": (lambda: dx.integrate(BARE, k=(1, 0, 0), rtol=10), ["integrate.rtol", "1e-13", "1e-2"]),
    "compare one method": (lambda: dx.compare(dx.Equilibrium(BARE), [dx.Shooting()]), ["compare.methods", "two or more"]),
    "outside the rod": (lambda: dx.solve(dx.Equilibrium(BARE)).r(1.5), ["s is 1.5 m", "0 to 1 m"]),
    "nan along the rod": (lambda: dx.solve(dx.Equilibrium(BARE)).r([0.0, NAN]), ["s is", "finite"]),
}  # fmt: skip


@pytest.mark.parametrize(("mistake", "words"), MISTAKES.values(), ids=MISTAKES.keys())
def test_a_mistake_gets_one_sentence(mistake, words: list[str]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # NumPy's own, from the functions that go wrong on purpose
        with pytest.raises(dx.InvalidInput) as caught:
            mistake()
    text = str(caught.value)
    assert isinstance(caught.value, ValueError)
    for word in words:
        assert word in text, f"{word!r} is missing in: {text}"
    assert "\n" not in text
    assert len(text) < 400
    assert text.rstrip()[-1] in ".?"


def test_the_callers_arrays_are_never_modified_or_kept() -> None:
    natural, force, position = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0]), np.zeros(3)
    frame, k = np.eye(3), np.array([1.0, 2.0, 3.0])
    copies = [x.copy() for x in (natural, force, position, frame, k)]
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7), natural=natural)
    problem = dx.Equilibrium(rod, start=dx.Clamped(position=position, frame=frame), loads=[dx.EndForce(force)])
    tip = dx.solve(problem).tip
    dx.integrate(rod, k=k, frame=frame)
    for array, copy in zip((natural, force, position, frame, k), copies, strict=True):
        np.testing.assert_array_equal(array, copy)
    natural[:], force[:] = 5.0, 7.0  # what the caller does later changes nothing
    np.testing.assert_array_equal(dx.solve(problem).tip, tip)


def test_what_does_not_converge_says_so_and_is_kept() -> None:
    """An inextensible straight rod pushed together along itself: singular from the start, or snapping on the way."""
    pushed = dx.Equilibrium(BARE, end=dx.Clamped(position=(0, 0, 0.5)))
    kept = dx.solve(pushed, dx.Shooting(), throw=False)
    assert not kept.converged
    assert kept.load_factor < 1.0
    assert np.all(np.isfinite(kept.r(kept.s)))
    with pytest.raises(dx.NotConverged) as caught:
        dx.solve(pushed, dx.Shooting())
    assert str(caught.value) == caught.value.solution.status.next_in_python
    with pytest.raises(dx.NotConverged, match=r"load"):
        kept.check()


def test_an_integration_that_breaks_down_says_where() -> None:
    """f = c r with a huge c: the solution grows like exp(sqrt(c) s), out of the range of numbers."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7, mass=1.0))
    load = dx.Rotation((0.0, 1e8, 0.0))
    curve = dx.integrate(rod, k=(1, 2, 3), n=(1, 1, 1), loads=[load], throw=False)
    assert not curve.converged
    assert "stopped at s = " in curve.status.message
    assert np.all(np.isfinite(curve.r(0.0)))
    with pytest.raises(dx.NotConverged):
        dx.integrate(rod, k=(1, 2, 3), n=(1, 1, 1), loads=[load])
