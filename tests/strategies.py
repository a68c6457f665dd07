"""Random problems and motions for hypothesis: whole ones, of any size, stated as a user might, mostly within reason.

Everything is drawn without dimensions and scaled by a length and a stiffness, so that a micrometre filament and a sea cable
are as frequent as a metre of wire.
"""

from __future__ import annotations

import dataclasses
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
    offset = scaled(draw(vector(0.3)), length) if draw(st.booleans()) else (0.0, 0.0, 0.0)
    match draw(st.sampled_from(kinds)):
        case "gravity":
            return dx.Gravity(scaled(draw(vector(20.0)), force / (length * mass)))
        case "line force":
            return dx.LineForce(scaled(draw(vector(15.0)), force / length), frame="section" if follower else "fixed")
        case "line couple":
            return dx.LineCouple(scaled(draw(vector(2.0)), moment / length), frame="section" if follower else "fixed")
        case "point force":
            return dx.PointForce(scaled(draw(vector(8.0)), force), at=at, follower=follower, offset=offset)
        case "point moment":
            return dx.PointMoment(scaled(draw(vector(2.0)), moment), at=at, follower=follower)
        case "rotation":
            return dx.Rotation(scaled(draw(vector(3.0)), np.sqrt(force / (mass * length**2))))
        case "foundation":
            return dx.Foundation(draw(magnitude(0.1, 30.0)) * force / length**2)
        case "end force":
            return dx.EndForce(scaled(draw(vector(8.0)), force), follower=follower, offset=offset)
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


# Motions


def swinging(size: Any, rate: float) -> Any:
    """Return a function of time that begins at zero, at rest, and swings by about ``size``."""
    return lambda t: np.array(size) * (1.0 - np.cos(rate * t))


def turning(frame: Any, axis: Any, angle: float, rate: float) -> Any:
    """Return a frame as a function of time, swinging about an axis from where it is."""
    K = np.cross(np.eye(3), np.array(axis))

    def turned(t: float) -> Any:
        a = angle * (1.0 - np.cos(rate * t))
        return (np.eye(3) - np.sin(a) * K + (1.0 - np.cos(a)) * K @ K) @ frame

    return turned


@st.composite
def dampings(draw: Draw, length: float, time: float, mass: float) -> Any:
    """One damping, from hardly any to more than critical."""
    strength = draw(magnitude(1e-3, 30.0))
    fluid = scaled(draw(vector(2.0)), length / time)
    moving = swinging(fluid, draw(number(1.0, 20.0)) / time) if draw(st.booleans()) else fluid
    match draw(st.sampled_from(["mass", "inner", "linear drag", "quadratic drag"])):
        case "mass":
            return dx.MassDamping(strength / time)
        case "inner":
            return dx.KelvinVoigt(*(draw(magnitude(1e-5, 0.1)) * time for _ in range(3)))
        case "linear drag":
            return dx.LinearDrag(strength * mass / time, 2.0 * strength * mass / time, fluid=moving)
    return dx.QuadraticDrag(0.1 * strength * mass / length, strength * mass / length, fluid=moving)


@st.composite
def far_ends(draw: Draw, place: Any, frame: Any, EI: float, length: float) -> Any:
    """What holds the far end where the unloaded rod has it."""
    match draw(st.sampled_from(["clamped", "pinned", "hinge", "universal", "roller", "slider", "guided", "spring"])):
        case "clamped":
            return dx.Clamped(position=place, frame=frame)
        case "pinned":
            return dx.Pinned(place)
        case "hinge":
            return dx.Hinge(axis=frame[:, 0], position=place, frame=frame)
        case "universal":
            return dx.Universal(axis=frame[:, 0], section_axis=frame[:, 1], position=place, frame=frame)
        case "roller":
            return dx.Roller(along=frame[:, draw(st.integers(0, 2))], position=place)
        case "slider":
            return dx.Slider(along=frame[:, draw(st.integers(0, 2))], position=place, frame=frame)
        case "guided":
            return dx.Guided(frame=frame)
    return dx.Spring(linear=draw(magnitude(0.1, 1e3)) * EI / length**3, position=place)


@st.composite
def motions(draw: Draw) -> tuple[dx.Motion, Any]:
    """A motion of a few segments and a short time, with a method: supports that move or let go, loads in time, damping.

    One in ten is out of all reason: its loads a thousand times as large.
    """
    rod = draw(rods())
    rod = dataclasses.replace(rod, shear=False)
    stiffness = rod.stiffness(np.zeros(1))
    EI, EA = float(stiffness.EI1[0]), float(stiffness.EA[0])
    length, mass = rod.length, float(rod.mass(np.zeros(1), "the test")[0])
    time = length**2 * np.sqrt(mass / EI)
    segments, duration = draw(st.integers(2, 16)), time * draw(magnitude(0.01, 1.0))
    method = draw(st.sampled_from(["midpoint", "TR-BDF2", "Verlet"] if rod.stretch else ["midpoint", "TR-BDF2"]))
    if method == "midpoint":
        how: Any = dx.ImplicitMidpoint(segments, step=duration / draw(st.integers(20, 200)))
    else:  # the shortest wave is followed in both: about ten thousand steps at most, ten to forty a wave by TR-BDF2
        waves = segments * max(np.sqrt(EA * length**2 / EI) if rod.stretch else 0.0, 5.0 * segments) / time
        if method == "TR-BDF2":
            how = dx.TRBDF2(segments, rtol=draw(magnitude(1e-6, 1e-3)))
            duration = min(duration, 2e3 / waves)
        else:
            how = dx.StormerVerlet(segments)
            duration = min(duration, 1e4 / waves)

    frame, position = draw(frames()), np.array(scaled(draw(vector(1.0)), length))
    start: Any = dx.Clamped(position=position, frame=frame)
    end: Any = dx.Free()
    initial: Any = "unloaded"
    where = draw(st.sampled_from(["free", "free", "as unloaded", "elsewhere" if rod.stretch else "free"]))
    if where == "as unloaded" and rod.natural is None:
        end = draw(far_ends(position + length * frame[:, 2], frame, EI, length))
        start = draw(st.sampled_from([start, dx.Pinned(position)])) if any(end.held_rotation) else start
    elif where == "elsewhere":
        start, end, initial = dx.Clamped(frame=frame), draw(ends(length, EI)), "equilibrium"
    elif draw(st.integers(0, 3)) == 0:
        start = draw(st.sampled_from([dx.Pinned(position), dx.Hinge(axis=frame[:, 0], position=position, frame=frame)]))
    free = not end.holds
    size = draw(st.sampled_from([1.0] * 9 + [1e3]))
    acting = draw(st.lists(loads(length, size * EI, mass, free), max_size=3))
    problem = dx.Equilibrium(rod, start=start, end=end, loads=acting)

    factors: list[Any] = []
    for load in acting:
        value = draw(number(-2.0, 2.0))
        in_time = [value, lambda t, value=value: value * np.sin(5.0 * t / time)]
        factors.append(1.0 if isinstance(load, dx.Rotation) else draw(st.sampled_from(in_time)))
    moving: dict[str, Any] = {}
    for at, support in (("start", start), ("end", end)):
        reach = rod.stretch or free  # a straight rod that does not stretch can't be pulled at
        if reach and all(support.held_displacement) and draw(st.integers(0, 3)) == 0:
            rate = draw(number(1.0, 20.0)) / time
            way = swinging(scaled(draw(vector(0.1)), length), rate)
            turn = turning(support.R, draw(directions()), draw(number(-1.0, 1.0)), rate)
            moving[at] = dx.Moving(
                position=lambda t, support=support, way=way: np.array(support.position) + way(t),
                frame=turn if all(support.held_rotation) and draw(st.booleans()) else None,
            )
    release = {}
    for at in ("start", "end"):
        if draw(st.integers(0, 3)) == 0:
            release[at] = duration * draw(st.sampled_from([0.0, 0.0, 0.3, 0.77]))
    # A couple that nothing resists would make a thin rod spin, all of whose turns are followed: minutes.
    spun = any(isinstance(load, dx.EndMoment | dx.PointMoment | dx.LineCouple) for load in acting)
    velocity = np.array(scaled(draw(vector(2.0)), length / time))
    velocities: list[Any] = [None, velocity, lambda s: np.sin(3.0 * s / length)[:, None] * velocity]
    if not rod.stretch:  # a straight one may turn about its start
        across = np.cross(velocity, frame[:, 2])
        straight = free and rod.natural is None
        velocities = [None, lambda s: s[:, None] / length * across] if straight else [None]
    motion = dx.Motion(
        problem,
        duration,
        initial=initial,
        velocity=draw(st.sampled_from(velocities)),
        spin=draw(st.sampled_from([0.0, 3.0 / time])),
        load_factor=factors if draw(st.booleans()) else None,
        damping=draw(st.lists(dampings(length, time, mass), max_size=2)),
        release=release,
        rotary_inertia=mass * length**2 * draw(magnitude(1e-4, 1e-2)) if spun or draw(st.booleans()) else None,
        **moving,
    )
    return motion, how
