"""Random problems for hypothesis: whole ones, of any size, stated as a user might, mostly within reason.

Everything is drawn without dimensions and scaled by a length and a stiffness, so that a micrometre filament and a sea cable
are as frequent as a metre of wire.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st

import darboux as dx

Draw = Any


def number(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False).map(lambda x: float(f"{x:.6g}"))


def magnitude(low: float, high: float) -> st.SearchStrategy[float]:
    """Between the two, on a logarithmic scale."""
    return number(np.log10(low), np.log10(high)).map(lambda x: float(f"{10.0**x:.6g}"))


def vector(size: float) -> st.SearchStrategy[tuple[float, float, float]]:
    return st.tuples(*[number(-size, size)] * 3)


def scaled(values: tuple[float, ...], unit: float) -> tuple[float, ...]:
    return tuple(float(f"{unit * x:.6g}") for x in values)


@st.composite
def directions(draw: Draw) -> tuple[float, float, float]:
    theta, phi = draw(number(0.0, np.pi)), draw(number(0.0, 2.0 * np.pi))
    return (np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta))


@st.composite
def frames(draw: Draw) -> Any:
    q = np.array(draw(st.tuples(*[number(-1.0, 1.0)] * 4)))
    length = np.linalg.norm(q)
    a, b, c, d = q / length if length > 0.1 else np.array([1.0, 0.0, 0.0, 0.0])
    return np.array(
        [
            [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
        ]
    )


@st.composite
def sections(draw: Draw, length: float) -> Any:
    """A geometric section of a slender rod, constant or tapered."""
    size = length / draw(magnitude(20.0, 5000.0))

    def along(value: float) -> Any:
        return dx.Table([0.0, length], [value, value * draw(number(0.5, 1.5))]) if draw(st.booleans()) else value

    match draw(st.sampled_from(["circle", "tube", "rectangle", "ellipse"])):
        case "circle":
            return dx.Circle(along(size))
        case "tube":
            return dx.Tube(size, size * draw(number(0.1, 0.95)))
        case "rectangle":
            return dx.Rectangle(along(size), size * draw(number(0.1, 1.0)))
    return dx.Ellipse(along(size), size * draw(number(0.1, 1.0)))


@st.composite
def rods(draw: Draw) -> dx.Rod:
    length = draw(magnitude(1e-6, 1e3))
    naturals = [st.none(), vector(4.0).map(lambda k: scaled(k, 1.0 / length))]
    naturals.append(
        st.builds(
            dx.Helix, magnitude(0.02, 0.5).map(lambda x: x * length), magnitude(0.05, 0.5).map(lambda x: x * length)
        )
    )
    natural = draw(st.one_of(*naturals))
    stretch = draw(st.booleans())
    if draw(st.booleans()):
        material = dx.Material(
            E=draw(magnitude(1e3, 1e12)), nu=draw(number(0.0, 0.5)), density=draw(magnitude(10.0, 2e4))
        )
        section = draw(sections(length))
        return dx.Rod(
            length, section, material, natural=natural, stretch=stretch, shear=stretch and draw(st.booleans())
        )
    EI = draw(magnitude(1e-20, 1e8))
    section = dx.Stiffness(
        EI1=EI,
        EI2=EI * draw(magnitude(0.1, 20.0)),
        GJ=EI * draw(magnitude(0.1, 3.0)),
        EA=EI / length**2 * draw(magnitude(1e2, 1e7)),
        mass=draw(magnitude(1e-9, 10.0)),
    )
    return dx.Rod(length, section, natural=natural, stretch=stretch)


@st.composite
def loads(draw: Draw, length: float, EI: float, mass: float, free: bool) -> Any:
    """One load, about as large as the rod can carry without rolling up."""
    force, moment = EI / length**2, EI / length
    kinds = ["gravity", "line force", "line couple", "point force", "point moment", "rotation", "foundation"]
    kinds += ["end force", "end moment"] if free else []
    follower, at = draw(st.booleans()), length * draw(number(0.05, 0.95))
    match draw(st.sampled_from(kinds)):
        case "gravity":
            return dx.Gravity(scaled(draw(vector(20.0)), force / (length * mass)))
        case "line force":
            return dx.LineForce(scaled(draw(vector(15.0)), force / length), frame="section" if follower else "fixed")
        case "line couple":
            return dx.LineCouple(scaled(draw(vector(2.0)), moment / length), frame="section" if follower else "fixed")
        case "point force":
            return dx.PointForce(scaled(draw(vector(8.0)), force), at=at, follower=follower)
        case "point moment":
            return dx.PointMoment(scaled(draw(vector(2.0)), moment), at=at, follower=follower)
        case "rotation":
            return dx.Rotation(scaled(draw(vector(3.0)), np.sqrt(force / (mass * length**2))))
        case "foundation":
            return dx.Foundation(draw(magnitude(0.1, 30.0)) * force / length**2)
        case "end force":
            return dx.EndForce(scaled(draw(vector(8.0)), force), follower=follower)
    return dx.EndMoment(scaled(draw(vector(3.0)), moment), follower=follower)


@st.composite
def ends(draw: Draw, length: float, EI: float) -> Any:
    """What holds the far end, within reach."""
    place = scaled(draw(directions()), length * draw(number(0.1, 0.95)))
    match draw(st.sampled_from(["free", "free", "free", "clamped", "pinned", "hinge", "roller", "slider", "spring"])):
        case "clamped":
            return dx.Clamped(position=place, frame=draw(frames()))
        case "pinned":
            return dx.Pinned(place)
        case "hinge":
            frame = draw(frames())
            return dx.Hinge(axis=frame[:, 0], position=place, frame=frame)
        case "roller":
            return dx.Roller(along=draw(directions()), position=place)
        case "slider":
            return dx.Slider(along=draw(directions()), position=place, frame=draw(frames()))
        case "spring":
            return dx.Spring(linear=draw(magnitude(0.1, 100.0)) * EI / length**3, position=place)
    return dx.Free()


@st.composite
def problems(draw: Draw) -> dx.Equilibrium:
    """A rod clamped or pinned at its start, its far end free or held, with up to three loads; or a ring.

    One in five is out of all reason: its loads a thousand times as large.
    """
    rod = draw(rods())
    stiffness = rod.stiffness(np.zeros(1))
    EI, mass = float(stiffness.EI1[0]), float(rod.mass(np.zeros(1), "the test")[0])
    if draw(st.integers(0, 9)) == 0:
        return dx.Ring(rod, link=draw(number(-2.0, 2.0)))
    end = draw(ends(rod.length, EI))
    free = not end.holds
    size = draw(st.sampled_from([1.0, 1.0, 1.0, 1.0, 1e3]))
    acting = draw(st.lists(loads(rod.length, size * EI, mass, free), max_size=3))
    position = scaled(draw(vector(1.0)), rod.length) if free else (0.0, 0.0, 0.0)
    start = dx.Clamped(position=position, frame=draw(frames()), twist=draw(st.sampled_from([0.0, 1.0])))
    if not free and draw(st.booleans()):
        start = dx.Pinned(position)
    between = {}
    if free and draw(st.integers(0, 4)) == 0:
        s = rod.length * draw(number(0.1, 0.9))
        place = np.array(position) + 0.9 * s * np.array(draw(directions()))
        between = {s: dx.Spring(linear=draw(magnitude(0.1, 100.0)) * EI / rod.length**3, position=place)}
    return dx.Equilibrium(rod, start=start, end=end, loads=acting, between=between)
