"""Two hundred problems whose answers are kept, digit by digit: whatever solves them tomorrow must find the same."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

import darboux as dx
from darboux import frames
from tests import cases
from tests.catalogue.problems import CATALOGUE

UP = (0.0, 0.0, 1.0)
UNIT = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.75, mass=1.0))
FLAT = dx.Rod(1.0, dx.Stiffness(EI1=1.4, EI2=1.0, GJ=0.75, mass=1.0))
BENT = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.4, GJ=0.75, EA=30.0, mass=1.0), natural=(0.3, 0.2, 0.4))
FULL = {"stretch": True, "shear": True}
STEEL = dx.Material(E=210e9, nu=0.3, density=7850)
RUBBER = dx.Material(E=1e6, nu=0.5, density=1e3)
TURNING = (  # beginnings of the names of the catalogue's problems that look the same from all sides of the z axis
    "ring, link",
    "round",
    "column, free",
    "clamped, pinned, pushed",
    "pushed by",
    "spinning, Lambda",
    "sliding across",
)
SLIDING = ("flat ring, link 1", "curved ring")  # where these uniform rings stand along themselves, rounding chooses


@dataclass(frozen=True)
class Frozen:
    """A problem; ``family`` the axis about which its equilibria may be turned; the problem from whose solution it begins."""

    name: str
    problem: dx.Equilibrium
    family: tuple[float, float, float] | None = None
    start: dx.Equilibrium | None = None

    def __str__(self) -> str:
        return self.name


def _catalogue() -> list[Frozen]:
    return [
        Frozen(
            f"catalogue: {entry.name}",
            entry.problem,
            entry.family or (UP if entry.name.startswith(TURNING) else None),
        )
        for entry in CATALOGUE
        if entry.name not in SLIDING
    ]


SUPPORTS = {
    "clamped": dx.Clamped(position=(0.1, 0.2, 0.8), tangent=(0.1, 0.2, 1)),
    "clamped, twisted": dx.Clamped(position=(0.1, 0.2, 0.9), tangent=(0.1, 0.2, 1), twist=1.2),
    "pinned": dx.Pinned(position=(0.1, 0.1, 0.9)),
    **cases.ENDS,
}


def _supports() -> list[Frozen]:
    loads = [dx.LineForce((1.0, 0.8, -0.6))]
    ends = [dx.EndForce((0.4, 0.3, -0.5)), dx.EndMoment((0.2, -0.3, 0.1))]
    found = []
    for name, support in SUPPORTS.items():
        acting = loads if "clamped" in name else [*loads, *ends]
        found.append(Frozen(f"end: {name}", dx.Equilibrium(BENT, end=support, loads=acting)))
    for name in ("clamped", "pinned", "hinge", "universal", "groove", "slider", "spring"):
        moved = dataclasses.replace(SUPPORTS[name], position=(0.1, 0.1, 0.1))
        problem = dx.Equilibrium(BENT, start=moved, end=dx.Clamped(position=UP), loads=loads)
        found.append(Frozen(f"start: {name}", problem))
    for name, support in SUPPORTS.items():
        if "free" in name or "clamped" in name:
            continue
        between = {0.55: dataclasses.replace(support, **({} if name == "guided" else {"position": (0.1, 0.05, 0.52)}))}
        found.append(Frozen(f"between: {name}", dx.Equilibrium(BENT, between=between, loads=[*loads, *ends])))
    return found


def _loads() -> list[Frozen]:
    return [Frozen(f"load: {name}", dx.Equilibrium(BENT, loads=[load])) for name, load in cases.LOADS.items()]


def _coupled(seed: int) -> dx.StiffnessMatrix:
    """A full matrix whose couplings reach a third or so of what positive definiteness allows."""
    A = np.eye(6) + 0.2 * (2.0 * np.random.default_rng(seed).random((6, 6)) - 1.0)
    unit = np.sqrt([60.0, 50.0, 80.0, 1.0, 1.6, 0.7])
    return dx.StiffnessMatrix(A @ A.T * np.outer(unit, unit), mass=1.0)


def _coupled_sections() -> list[Frozen]:
    acting = {
        "dead loads": ({}, [dx.Gravity((1, 0.5, -2)), dx.EndForce((1, -0.5, 0.3)), dx.EndMoment((0.2, 0.3, 0.5))]),
        "followers": ({}, [dx.EndForce((1, 0.5, -1), follower=True), dx.LineCouple((0.2, 0.1, 0.4), frame="section")]),
        "two clamps": ({"end": dx.Clamped(position=(0.1, 0.1, 0.9), tangent=(0.2, 0, 1))}, [dx.Gravity((1, 0, 0))]),
        "a station": ({"between": {0.4: dx.Spring(linear=20.0, position=(0, 0, 0.4))}}, [dx.Gravity((2, 1, 0))]),
    }
    return [
        Frozen(
            f"coupled section {seed}: {name}",
            dx.Equilibrium(dx.Rod(1.0, _coupled(seed), **FULL), **supports, loads=loads),
        )
        for seed, (name, (supports, loads)) in enumerate(acting.items())
    ]


def _helices() -> list[Frozen]:
    found = []
    for turns, radius, pitch in ((2, 0.02, 0.01), (4, 0.03, 0.03), (8, 0.01, 0.004)):
        helix = dx.Helix(radius=radius, pitch=pitch)
        spring = dx.Rod(turns * float(np.hypot(2.0 * np.pi * radius, pitch)), dx.Circle(1e-3), STEEL, natural=helix)
        hung = dx.Clamped(frame=helix.frame((0, 0, -1)))
        pull = [dx.Gravity(), dx.EndForce((0.02, 0, -0.4 / turns))]
        found.append(Frozen(f"helix of {turns} turns: pulled", dx.Equilibrium(spring, hung, loads=pull)))
        push = [dx.EndForce((0, 0, 0.05 / turns)), dx.EndMoment((0, 0, 1e-3))]
        found.append(Frozen(f"helix of {turns} turns: pushed and turned", dx.Equilibrium(spring, hung, loads=push)))
    return found


def _rings() -> list[Frozen]:
    overcurved = dx.Rod(1.0, UNIT.section, natural=(0, 2.0 * np.pi * 1.4, 0))
    curved = dx.Rod(1.0, FLAT.section, natural=(2.0, 3.0, 1.0))
    return [
        Frozen("ring: curved, link 0.4", dx.Ring(curved, link=0.4)),
        Frozen("ring: heavy, link 0.5", dx.Ring(FLAT, link=0.5, loads=[dx.Gravity((0.3, 0.2, -3.0))])),
        Frozen("ring: overcurved", dx.Ring(overcurved)),
        Frozen("ring: heavy", dx.Ring(FLAT, loads=[dx.Gravity((0.3, 0.2, -3.0))])),
        Frozen("ring: pulled at a point", dx.Ring(FLAT, loads=[dx.PointForce((1.0, 2.0, 3.0), at=0.5)])),
    ]


def _cables() -> list[Frozen]:
    weight = dx.Gravity((0, 0, -9.81))
    ends = {
        "pins, level": (dx.Pinned(), dx.Pinned((90, 0, 0))),
        "clamps, level": (dx.Clamped(tangent=(1, 0, 0)), dx.Clamped((90, 0, 0), tangent=(1, 0, 0))),
        "on a slope": (dx.Pinned(), dx.Pinned((50, 0, 60))),
        "clamps, twisted": (dx.Clamped(tangent=(1, 0, 0)), dx.Clamped((90, 0, 0), tangent=(1, 0, 0), twist=7.0)),
    }
    found = []
    for stretch in (False, True):
        rod = dx.Rod(100.0, dx.Circle(0.01), STEEL, stretch=stretch)
        word = "stretching" if stretch else "inextensible"
        for name, pair in ends.items():
            found.append(Frozen(f"cable, {word}: {name}", dx.Equilibrium(rod, *pair, [weight])))
    rod = dx.Rod(120.0, dx.Circle(0.01), STEEL)
    poles = dx.Equilibrium(rod, dx.Pinned(), dx.Pinned((110, 0, 0)), [weight], between={50.0: dx.Pinned((46, 0, 0))})
    found.append(Frozen("cable over a pole", poles))
    pins = (dx.Pinned(), dx.Pinned((100, 0, 0)))
    for name, load in (("a mass", dx.PointForce((0, 0, -2000), 30.0)), ("wind", dx.LineForce((0, 10.0, 0)))):
        found.append(Frozen(f"cable, {name}", dx.Equilibrium(rod, *pins, [weight, load])))
    return found


def _stations() -> list[Frozen]:
    on_line = lambda s: dx.Roller(along=UP, position=(0, 0, s))  # noqa: E731
    w = [dx.LineForce((8.0, 3.0, 0))]
    ends = (dx.Pinned(), on_line(1.0))
    between = {0.4: dx.Pinned((0.1, 0.05, 0.35)), 0.7: dx.Spring(linear=50.0, position=(0, 0, 0.6))}
    acting = [dx.EndForce((3, 2, -4)), dx.PointForce((1, -5, 0.5), at=0.4), dx.PointForce((0, 2, 0), at=0.55)]
    stretching = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.75, EA=1e3), stretch=True)
    clamp = {0.5: dx.Clamped(position=(0, 0, 0.5))}
    wire = dx.Rod(0.2, dx.Circle(0.2e-3), dx.Material(E=60e9, nu=0.33))
    push = np.pi**2 * 60e9 * np.pi / 4.0 * 0.2e-3**4 / 0.05**2
    guides = {s: dx.Roller(along=UP, position=(0, 0, s)) for s in (0.05, 0.1, 0.15)}
    guided = {"start": dx.Pinned(), "end": dx.Roller(along=UP), "between": guides}
    mast = {0.3: dx.Pinned((0, 0, 0.3)), 0.7: on_line(0.7)}
    return [
        Frozen("beam on three supports", dx.Equilibrium(UNIT, *ends, w, {0.5: on_line(0.5)})),
        Frozen("beam on five supports", dx.Equilibrium(FLAT, *ends, w, {s: on_line(s) for s in (0.25, 0.5, 0.75)})),
        Frozen("pin, spring, points", dx.Equilibrium(UNIT, loads=acting, between=between)),
        Frozen("clamp in the middle", dx.Equilibrium(stretching, loads=[dx.EndForce((3, 0, 0))], between=clamp)),
        Frozen("mast on two pins", dx.Equilibrium(FLAT, dx.Free(), dx.Free(), [dx.LineForce((2.0, 1.0, 0))], mast)),
        Frozen("guide wire, below", dx.Equilibrium(wire, **guided, loads=[dx.EndForce((0, 0, -0.9 * push))])),
        Frozen("guide wire, above", dx.Equilibrium(wire, **guided, loads=[dx.EndForce((0, 0, -1.05 * push))]), UP),
    ]


def _examples() -> list[Frozen]:
    rubber = dx.Rod(0.25, dx.Circle(1e-3), RUBBER)
    along_x = dx.Clamped(tangent=(1, 0, 0))
    balanced = 1e3 * np.pi * 1e-6 * 9.81 / 1e-7
    strip = dx.Rod(1.0, dx.Stiffness(EI1=1e4, EI2=1.0, GJ=0.8))
    on_edge = dx.Clamped(tangent=(1, 0, 0), d1=(0, 1, 0))
    tips_over = 4.0126 * np.sqrt(0.8)
    cone = dx.Rod(1.0, dx.Circle(lambda s: 5e-3 - 3e-3 * s), dx.Material(E=210e9, nu=0.3))
    helix = np.array([4e-7, 4e-7, 2.6e-7]) * (-25.0, 10.0, -25.0)
    catenary = {"start": dx.Pinned(), "end": dx.Pinned((0.8, 0, 0))}
    found = {
        "heavy elastica": dx.Equilibrium(rubber, along_x, loads=[dx.Gravity()]),
        "catenary": dx.Equilibrium(UNIT, **catenary, loads=[dx.LineForce((0, 0, -1e4))]),
        "helix by a moment": dx.Equilibrium(
            dx.Rod(0.3, dx.Stiffness(EI1=4e-7, GJ=2.6e-7)), loads=[dx.EndMoment(helix)]
        ),
        "overcurved ring": dx.Ring(dx.Rod(1.0, UNIT.section, natural=(0, 2.0 * np.pi * 1.8, 0))),
    }
    for part in (0.9, 1.05):
        edge = dx.EndForce((0, 0, -part * tips_over))
        field = dx.ElectricField((0, 0, part * balanced), charge_per_length=1e-7)
        found[f"strip on edge, {part:g}"] = dx.Equilibrium(strip, on_edge, loads=[edge])
        found[f"charged filament, {part:g}"] = dx.Equilibrium(rubber, along_x, loads=[dx.Gravity(), field])
    for P in (1e-3, 60.0):
        found[f"cone, {P:g} N"] = dx.Equilibrium(cone, along_x, loads=[dx.EndForce((0, 0, -P))])
    return [Frozen(f"example: {name}", problem) for name, problem in found.items()]


def _warm() -> list[Frozen]:
    """From the solution of another problem: a load or a support changed a little, or another rod."""
    heavy = lambda w: dx.Equilibrium(UNIT, cases.ALONG_X, loads=[dx.LineForce((0, -w, 0))])  # noqa: E731
    posed = lambda x: dx.Equilibrium(FLAT, end=dx.Clamped((x, 0.1, 0.7)), loads=[dx.Gravity((1, 0, 0))])  # noqa: E731
    column = lambda P: dx.Equilibrium(FLAT, loads=[dx.EndForce((0, 0, -P))])  # noqa: E731
    swung = lambda P: dx.Equilibrium(BENT, loads=[dx.EndForce((P, 1, -1), follower=True)])  # noqa: E731
    stations = lambda F: dx.Equilibrium(  # noqa: E731
        BENT, between={0.6: dx.Spring(linear=20.0, position=(0, 0, 0.6))}, loads=[dx.PointForce((F, 1, 0), at=0.3)]
    )
    pairs = {
        "weight, 1 %": (heavy(10.0), heavy(10.1)),
        "weight, 30 %": (heavy(100.0), heavy(130.0)),
        "heavy, 1 %": (heavy(1e4), heavy(1.01e4)),
        "clamp moved": (posed(0.1), posed(0.13)),
        "column, further": (column(4.0), column(4.2)),
        "follower, 10 %": (swung(2.0), swung(2.2)),
        "stations, 20 %": (stations(3.0), stations(3.6)),
        "softer rod": (heavy(20.0), dataclasses.replace(heavy(20.0), rod=FLAT)),
    }
    return [Frozen(f"warm: {name}", problem, start=start) for name, (start, problem) in pairs.items()]


def _unstable() -> list[Frozen]:
    """Unstable equilibria, from the solution of a problem that a small load holds there."""
    straight = dx.Equilibrium(FLAT, loads=[dx.EndForce((0, 0, -2.0))])
    return [
        Frozen(f"unstable column, P = {P:g}", dx.Equilibrium(FLAT, loads=[dx.EndForce((0, 0, -P))]), start=straight)
        for P in (3.0, 20.0, 30.0)
    ]


def _drawn(seed: int) -> dx.Equilibrium:
    """A rod, an end and up to three loads at random, of any size and in any units."""
    rng = np.random.default_rng(seed)
    vector = lambda size: tuple(size * (2.0 * rng.random(3) - 1.0))  # noqa: E731
    between = lambda a, b: float(a * (b / a) ** rng.random())  # noqa: E731
    L, EI = between(1e-4, 1e2), between(1e-12, 1e4)
    natural = None if rng.random() < 0.4 else vector(3.0 / L)
    stretch = bool(rng.random() < 0.4)
    stiffness = {"EI2": EI * between(0.3, 4.0), "GJ": EI * between(0.3, 2.0), "EA": EI / L**2 * between(1e2, 1e5)}
    rod = dx.Rod(L, dx.Stiffness(EI1=EI, mass=1.0, **stiffness), natural=natural, stretch=stretch)
    force, moment = EI / L**2, EI / L
    frame = frames.matrix_of_quaternion(np.array([2.0, *vector(1.0)]))
    place = tuple(L * np.array([*vector(0.3)[:2], 0.6 + 0.2 * rng.random()]))
    end = [
        dx.Free(),
        dx.Free(),
        dx.Clamped(position=place, frame=frame),
        dx.Pinned(place),
        dx.Roller(along=frame[:, 2], position=place),
        dx.Hinge(axis=frame[:, 0], position=place, frame=frame),
        dx.Universal(axis=frame[:, 0], section_axis=frame[:, 1], position=place, frame=frame),
        dx.Slider(along=frame[:, 2], position=place, frame=frame),
        dx.Spring(linear=between(1.0, 50.0) * EI / L**3, position=place),
        dx.Guided(frame=frame),
    ][int(rng.integers(10))]
    kinds = [
        lambda: dx.Gravity(vector(6.0 * force / L)),
        lambda: dx.LineForce(vector(6.0 * force / L), frame=("fixed", "section")[int(rng.integers(2))]),
        lambda: dx.LineCouple(vector(moment / L), frame=("fixed", "section")[int(rng.integers(2))]),
        lambda: dx.PointForce(vector(4.0 * force), at=L * (0.1 + 0.8 * rng.random()), offset=vector(0.2 * L)),
        lambda: dx.PointMoment(vector(moment), at=L * (0.1 + 0.8 * rng.random()), follower=bool(rng.integers(2))),
        lambda: dx.Rotation(vector(np.sqrt(4.0 * force / L**2))),
        lambda: dx.Foundation(between(0.1, 20.0) * force / L**2),
    ]
    loads = [kinds[int(i)]() for i in rng.choice(len(kinds), size=int(rng.integers(1, 4)), replace=False)]
    if not end.holds:
        loads.append(dx.EndForce(vector(4.0 * force), follower=bool(rng.integers(2)), offset=vector(0.1 * L)))
    return dx.Equilibrium(rod, end=end, loads=loads)


def _random(count: int) -> list[Frozen]:
    return [Frozen(f"drawn by seed {seed}", _drawn(seed)) for seed in range(count)]


CANDIDATES = [
    *_catalogue(),
    *_supports(),
    *_loads(),
    *_coupled_sections(),
    *_helices(),
    *_rings(),
    *_cables(),
    *_stations(),
    *_examples(),
    *_warm(),
    *_unstable(),
    *_random(40),
]
