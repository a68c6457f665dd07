"""The catalogue: problems that cross supports, loads, sections and natural shapes, each with what must come out.

Reference digits are closed forms (elliptic integrals, Euler's columns, circles), or come from an independent computation
of high precision; where there is neither, another method of ours that shares no discretisation is the reference.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import darboux as dx
from darboux import frames
from tests import cases

UNIT = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.75, mass=1.0))
FLAT = dx.Rod(1.0, dx.Stiffness(EI1=1.4, EI2=1.0, GJ=0.75, mass=1.0))  # bends more easily about d2
ALONG_X = dx.Clamped(tangent=(1, 0, 0))
UP = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Entry:
    """A problem, what is read from its solution, and what that must be (or the method that says it).

    ``family`` is the axis about which all of its equilibria may be turned, where rounding chooses one of them.
    """

    name: str
    problem: dx.Equilibrium
    read: Callable[[Any], Any]
    value: Any
    tolerance: float = 1e-9
    family: tuple[float, float, float] | None = None

    def __str__(self) -> str:
        return self.name


def tip(solution: Any) -> Any:
    return solution.tip / solution.problem.rod.length


def height(solution: Any) -> Any:
    return solution.tip[2]


def sideways(solution: Any) -> Any:
    """How far the middle stands from the line through the ends, which lies along z."""
    return np.hypot(*solution.r(0.5)[:2])


def push(P: float, at: str = "end") -> dx.EndForce:
    return dx.EndForce((0, 0, -P), at)


def buckled(P: float, critical: float) -> tuple[float, float]:
    """Distance of the ends and deflection of the middle of Euler's column, P / Pcr = (2 K / pi)^2 (Love 1927, art. 263)."""
    k = brentq(lambda k: (2.0 * ellipk(k * k) / np.pi) ** 2 - P / critical, 1e-9, 1.0 - 1e-12)
    return 2.0 * ellipe(k * k) / ellipk(k * k) - 1.0, k / ellipk(k * k)


def _turns() -> list[Entry]:
    """An end moment of n turns rolls the rod to a circle: the tip is back, the curvature 2 pi n."""
    return [
        Entry(
            f"{n} turns of an end moment",
            cases.rolled(n),
            lambda x: np.append(tip(x), np.linalg.norm(x.k(0.3))),
            [0, 0, 0, 2 * np.pi * n],
        )
        for n in (1, 2, 4, 8)
    ]


def _by_elastica() -> list[Entry]:
    rods = {f"P = {P:g}": cases.tip_force(P) for P in (1.0, 10.0, 100.0, 1000.0)}
    rods |= {f"weight {w:g}": cases.heavy(w) for w in (1.0, 1e2, 1e3, 1e4, 1e5, 1e6)}
    bent = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0), natural=lambda s: np.outer(np.sin(7.0 * s), (0, 6.0, 0)))
    rods["curved both ways"] = dx.Equilibrium(
        bent, start=dx.Clamped(tangent=(1, 0, 0), d1=(0, 1, 0)), loads=[dx.EndForce((2, 3, 0))]
    )
    for a in (0.2, 0.6):
        rods[f"both ends, {a:g}"] = dx.Equilibrium(UNIT, end=dx.Clamped(position=(a, 0, 0.4), tangent=(1, 0, 0)))
    return [
        Entry(f"elastica, {name}", problem, lambda x: x.r(0.5), dx.Elastica(), 1e-8) for name, problem in rods.items()
    ]


FOLLOWER = {  # tip x / L, y / L and root curvature times L under a follower force across the tip, P L^2 / EI
    1.0: (0.93564566948069293786, 0.32064199467501362198, 0.97551004396953371101),
    2.0: (0.76736219153465106998, 0.57383906256094399589, 1.8153664428098923359),
    10.0: (-0.092123181189366385357, 0.54698326459371419536, 1.7223732269625793607),
    40.0: (0.14060805908040698771, -0.51045086032720439446, -6.6666080746718718780),
}
PRESSURE = {  # the same under a force per length across the rod, p L^3 / EI, and the root moment
    1.0: (0.9911035286358, 0.1244437319746, 0.4988862234511),
    5.0: (0.795522590297, 0.560423244408, 2.367326011364),
    40.0: (-0.3882188983402, 0.1500318523662, 3.464469395059),
}


def _followers() -> list[Entry]:
    clamp = dx.Clamped(tangent=(1, 0, 0), d1=(0, 1, 0))
    read = lambda x: [*x.tip[:2], x.m(0.0)[2]]  # noqa: E731
    entries = [
        Entry(
            f"follower force {P:g}",
            dx.Equilibrium(UNIT, clamp, loads=[dx.EndForce((P, 0, 0), follower=True)]),
            read,
            digits,
        )
        for P, digits in FOLLOWER.items()
    ]
    entries += [
        Entry(
            f"pressure {p:g}",
            dx.Equilibrium(UNIT, clamp, loads=[dx.LineForce((p, 0, 0), frame="section")]),
            read,
            digits,
        )
        for p, digits in PRESSURE.items()
    ]
    # A moment that turns with the section of a planar rod is a dead one.
    entries.append(
        Entry(
            "follower moment",
            dx.Equilibrium(UNIT, loads=[dx.EndMoment((0, np.pi, 0), follower=True)]),
            tip,
            (2 / np.pi, 0, 0),
        )
    )
    return entries


def _columns() -> list[Entry]:
    """Euler's columns past their critical loads; the distance of the ends does not tell the plane of a round rod."""
    pi2 = np.pi**2
    ends: dict[str, tuple[dict[str, Any], float, float]] = {
        "clamped, free": ({}, pi2 / 4.0, 1.0),
        "pinned, roller": ({"start": dx.Pinned(), "end": dx.Roller(along=UP)}, pi2, 1.0),
        "clamped, slider": ({"end": dx.Slider(along=UP)}, 4.0 * pi2, 1.0),
        "clamped, guided": ({"end": dx.Guided()}, pi2, 1.0),
    }
    entries = []
    for rod_name, rod in (("round", UNIT), ("flat", FLAT)):
        for name, (supports, critical, _) in ends.items():
            for over in (1.02, 1.3):
                problem = dx.Equilibrium(rod, **supports, loads=[push(over * critical)])
                entries.append(Entry(f"{rod_name} column, {name}, {over} Pcr", problem, height, buckled(over, 1.0)[0]))
        for over in (0.98,):
            problem = dx.Equilibrium(rod, loads=[push(over * pi2 / 4.0)])
            entries.append(Entry(f"{rod_name} column, {over} Pcr", problem, height, 1.0))
    for P in (4.0, 10.0):
        entries.append(
            Entry(
                f"column, free, {P / 2.4674:.2f} Pcr",
                dx.Equilibrium(UNIT, loads=[push(P)]),
                height,
                buckled(P, pi2 / 4)[0],
            )
        )
    return entries


CLAMPED_PINNED = {  # D: P, |transverse reaction|, |clamp moment|
    0.05: (20.57309269887, 2.130236271974, 2.023724458376),
    0.1: (20.95864220562, 3.202324500462, 2.882092050416),
    0.5: (22.91556420835, 13.39382122242, 6.696910611212),
}
TWISTED = {  # D, Phi: axial moment, axial force, lateral force, distance of the middle, bending moment at the clamp
    (0.2, 2.0): (1.07630800458, -40.8457423635, 6.17272257137, 0.257299087818, 5.79162969462),
    (0.4, 4.0): (1.34588992939, -30.4767185995, 19.9772344927, 0.298822939148, 7.78035081358),
}


def _pushed() -> list[Entry]:
    """Clamps pushed together: the elastica of Euler's column with four times the load, by the distance of its ends."""
    entries = []
    for D in (0.05, 0.1, 0.3, 0.5):
        k = brentq(lambda k, D=D: 2.0 * ellipe(k * k) / ellipk(k * k) - 1.0 - (1.0 - D), 1e-9, 1.0 - 1e-12)
        exact = [16.0 * ellipk(k * k) ** 2, k / ellipk(k * k)]
        for rod_name, rod in (("round", UNIT), ("flat", FLAT)):
            problem = dx.Equilibrium(rod, end=dx.Clamped(position=(0, 0, 1.0 - D)))
            entries.append(
                Entry(f"{rod_name}, pushed by {D:g}", problem, lambda x: [-x.n(0.0)[2], sideways(x)], exact, 1e-8)
            )
    for D, digits in CLAMPED_PINNED.items():
        problem = dx.Equilibrium(UNIT, end=dx.Pinned(position=(0, 0, 1.0 - D)))
        read = lambda x: [-x.n(0.0)[2], np.hypot(*x.n(0.0)[:2]), np.hypot(*x.m(0.0)[:2])]  # noqa: E731
        entries.append(Entry(f"clamped, pinned, pushed by {D:g}", problem, read, digits, 1e-8))
    for (D, Phi), digits in TWISTED.items():
        problem = dx.Equilibrium(UNIT, end=dx.Clamped(position=(0, 0, 1.0 - D), twist=Phi))
        entries.append(Entry(f"pushed by {D:g}, twisted by {Phi:g}", problem, _writhing, digits, 1e-7))
    return entries


def _twisted_to_a_tenth() -> list[Entry]:
    """Clamps pushed together to a tenth of the length with whole turns of twist: two to six snap on the way.

    Which equilibrium is found is read from its stability; that it is one, from an integration with its own start.
    """
    return [
        Entry(
            f"{name}, pushed to 0.1, {turns} turns",
            dx.Equilibrium(rod, end=dx.Clamped(position=(0, 0, 0.1), twist=turns * dx.turn)),
            misses_its_end,
            np.zeros(6),
            1e-7,
            family=UP if rod is UNIT else None,
        )
        for name, rod in (("round", UNIT), ("flat", FLAT))
        for turns in (1, 2, 3, 4, 6)
    ]


def misses_its_end(x: Any) -> Any:
    """By how much an integration from the found start misses the end's place and tangents, Dormand-Prince at 1e-12."""
    L, start, end = x.problem.rod.length, x.problem.start, x.problem.end
    shot = dx.integrate(x.problem.rod, x.k(0.0), x.n(0.0), position=start.position, frame=start.R, rtol=1e-12)
    turned = end.R @ frames.matrix_of_quaternion(frames.quaternion_of_turn(np.array([[0.0, 0.0, end.twist]]))[0])
    return np.append((shot.r(L) - np.array(end.position)) / L, np.diag(turned.T @ shot.R(L)) - 1.0)


def _rings() -> list[Entry]:
    """Rings: the twisted circle by its energy (closed form), and rings that are no circles by an integration."""
    energy = lambda x: x.energy.total  # noqa: E731
    curved = dx.Rod(1.0, UNIT.section, natural=(1.0, 4.0, 2.0))
    return [
        *(
            Entry(f"ring, link {link:g}", dx.Ring(UNIT, link=link), energy, 2 * np.pi**2 + 1.5 * (np.pi * link) ** 2)
            for link in (0.0, 1.0, 2.2)
        ),
        Entry("flat ring, link 1", dx.Ring(FLAT, link=1.0), misses_its_end, np.zeros(6), 1e-7),
        Entry("curved ring", dx.Ring(curved, link=1.0), misses_its_end, np.zeros(6), 1e-7),
    ]


def _writhing(x: Any) -> list[float]:
    n, m = x.n(0.0), x.m(0.0)
    return [m[2], n[2], np.hypot(*n[:2]), sideways(x), np.hypot(*m[:2])]


SPINNING = {15.0: (0.4537862163775, 0.8712093515274), 50.0: (0.8561569520271, 0.3686008845484)}


def _spinning() -> list[Entry]:
    """A rod on the axis that it spins about, past its first critical speed: radius and height of the tip."""
    return [
        Entry(
            f"spinning, Lambda = {Lambda:g}",
            dx.Equilibrium(UNIT, loads=[dx.Rotation((0, 0, np.sqrt(Lambda)))]),
            lambda x: [np.hypot(*x.tip[:2]), x.tip[2]],
            digits,
        )
        for Lambda, digits in SPINNING.items()
    ]


# At its end a clamp holds it whatever is found. A quarter and the middle by Shooting(rtol=1e-11), which takes ten seconds.
CABLE = (
    lambda x: np.ravel(x.r(np.array([250.0, 500.0]))) / 1e3,
    (0.24121433122226, 0, -0.06506785738269, 0.48999999999999, 0, -0.08748744533172),
)


def _by_shooting() -> list[Entry]:
    steel = dx.Material(E=210e9, nu=0.3, density=7850)
    rods: dict[str, dx.Equilibrium] = {}
    for turns in (1, 5, 20):
        helix = dx.Helix(radius=0.02, pitch=0.01)
        spring = dx.Rod(turns * np.hypot(0.04 * np.pi, 0.01), dx.Circle(1e-3), steel, natural=helix)
        pull = [dx.Gravity(), dx.EndForce((0, 0, -0.5 / turns))]
        rods[f"hanging helix, {turns} turns"] = dx.Equilibrium(
            spring, dx.Clamped(frame=helix.frame((0, 0, -1))), loads=pull
        )
        rods[f"lying helix, {turns} turns"] = dx.Equilibrium(
            spring, dx.Clamped(frame=helix.frame((1, 0, 0))), loads=[dx.Gravity()]
        )
    wire = dx.Rod(1.0, dx.Circle(5e-6), steel)
    rods["wire of slenderness 1e5"] = dx.Equilibrium(wire, ALONG_X, loads=[dx.EndForce((0, 0, -1e-9))])
    hair = dx.Rod(0.1, dx.Circle(35e-6), dx.Material(E=4e9, nu=0.4, density=1300))
    rods["hair"] = dx.Equilibrium(hair, ALONG_X, loads=[dx.Gravity()])
    cable = dx.Rod(1e3, dx.Circle(0.02), steel, stretch=True)
    ends = (dx.Clamped(position=(x, 0, 0), tangent=(1, 0, 0)) for x in (0.0, 980.0))
    rods["a kilometre of cable"] = dx.Equilibrium(cable, *ends, loads=[dx.Gravity()])
    thin = dx.Rod(2e-6, dx.Circle(1e-8), dx.Material(E=1e9, nu=0.3))
    rods["2 um filament"] = dx.Equilibrium(thin, ALONG_X, loads=[dx.EndForce((1e-12, 2e-12, -5e-12))])
    rods["strip"] = cases.strip((2.0, 1.0, -1.0))
    stepped = dx.Rod(
        1.0, dx.Stiffness(EI1=lambda s: np.where(s < 0.4, 3.0, 1.0), GJ=lambda s: np.where(s < 0.4, 2.0, 0.7))
    )
    rods["step in section"] = dx.Equilibrium(stepped, loads=[dx.EndForce((3, 1, -1)), dx.EndMoment((0, 0, 0.4))])
    hat = dx.LineForce(lambda s: np.stack([np.where((s > 0.4) & (s < 0.48), 60.0, 0.0), 0 * s, 3 + 0 * s], -1))
    rods["load with jumps"] = dx.Equilibrium(UNIT, loads=[hat])
    rods["all loads, varying"] = dx.Equilibrium(
        dx.Rod(
            1.0, dx.Stiffness(EI1=lambda s: 2.0 - s, EI2=lambda s: 1.0 + s, GJ=1.0, mass=1.0), natural=(1.0, 2.0, -1.0)
        ),
        loads=[
            dx.Gravity((1, 2, -3)),
            dx.Rotation((0.4, 0.2, 1.0), (0.3, 0, 0)),
            dx.LineCouple((0.2, 0.1, 0.3)),
            dx.LineForce((0.5, 0, 1), frame="section"),
        ],
    )
    return [
        Entry(name, problem, *CABLE, 1e-8)
        if "kilometre" in name
        else Entry(
            name,
            problem,
            lambda x: x.tip / x.problem.rod.length,
            dx.Shooting(rtol=1e-11, pieces=120 if "20" in name else 16),
            1e-8,
        )
        for name, problem in rods.items()
    ]


def _sinking(lam: float) -> float:
    """Return how far the free end of a clamped beam on a foundation K = 4 lam^4 sinks under a unit load along it.

    u = (1 - U(s)) / K with U'''' + K U = 0, U(0) = 1, U'(0) = 0, U''(1) = U'''(1) = 0.
    """
    roots = lam * np.array([1 + 1j, 1 - 1j, -1 + 1j, -1 - 1j])
    rows = [roots**0, roots, roots**2 * np.exp(roots), roots**3 * np.exp(roots)]
    amplitudes = np.linalg.solve(np.array(rows), [1.0, 0, 0, 0])
    return float((1.0 - np.real(amplitudes @ np.exp(roots))) / (4.0 * lam**4))


def _supports_and_points() -> list[Entry]:
    P, K, k = 1e-5, 30.0, 4.0  # small enough for the beam's linear law, whose error is its square
    small = [dx.EndForce((P, 0, 0))]
    sprung = dx.Spring(linear=K, rotational=k, position=UP)
    stiffness = np.array([[12.0 + K, -6.0], [-6.0, 4.0 + k]])  # of a cantilever's end, EI = L = 1: force, moment
    load = dx.LineForce((P, 0, 0))
    entries = [
        Entry(
            "spring",
            dx.Equilibrium(UNIT, end=sprung, loads=small),
            lambda x: x.tip[0] / P,
            np.linalg.solve(stiffness, [1, 0])[0],
            1e-8,
        ),
        Entry(
            "pinned, roller, load",
            dx.Equilibrium(UNIT, dx.Pinned(), dx.Roller(along=UP), [load]),
            lambda x: x.r(0.5)[0] / P,
            5 / 384,
            1e-7,
        ),
        Entry(
            "clamped, roller, load",
            dx.Equilibrium(UNIT, end=dx.Roller(along=UP), loads=[load]),
            lambda x: x.r(0.5)[0] / P,
            1 / 192,
            1e-7,
        ),
        Entry(
            "clamped, slider, load",
            dx.Equilibrium(UNIT, end=dx.Slider(along=UP), loads=[load]),
            lambda x: x.r(0.5)[0] / P,
            1 / 384,
            1e-7,
        ),
        Entry(
            "hinge, roller, load",
            dx.Equilibrium(UNIT, dx.Hinge(axis=(0, 1, 0)), dx.Roller(along=UP), [load]),
            lambda x: x.r(0.5)[0] / P,
            5 / 384,
            1e-7,
        ),
        Entry(
            "guided, force", dx.Equilibrium(UNIT, end=dx.Guided(), loads=small), lambda x: x.tip[0] / P, 1 / 12, 1e-8
        ),
        Entry(
            "sliding across",
            dx.Equilibrium(UNIT, end=dx.Slider(along=(1, 0, 0), position=(0, 0, 0.8))),
            lambda x: x.tip[2],
            0.8,
        ),
        Entry(
            "point force",
            dx.Equilibrium(UNIT, loads=[dx.PointForce((P, 0, 0), at=0.5)]),
            lambda x: x.tip[0] / P,
            0.5**3 / 3 + 0.5**2 / 2 * 0.5,
            1e-8,
        ),
        Entry(
            "point moment",
            dx.Equilibrium(UNIT, loads=[dx.PointMoment((0, np.pi, 0), at=0.5)]),
            tip,
            (1 / np.pi + 0.5, 0, 1 / np.pi),
            1e-9,
        ),
        Entry(
            "foundation",
            dx.Equilibrium(UNIT, loads=[load, dx.Foundation(4 * 3.0**4)]),
            lambda x: x.tip[0] / P,
            _sinking(3.0),
            1e-8,
        ),
        Entry(
            "buoyant",
            dx.Equilibrium(
                dx.Rod(1.0, dx.Circle(1e-3), dx.Material(E=1e6, nu=0.5, density=900)),
                ALONG_X,
                loads=[dx.Gravity(), dx.Buoyancy(900)],
            ),
            tip,
            (1, 0, 0),
        ),
        Entry(
            "function of the shape",
            dx.Equilibrium(
                UNIT, loads=[dx.LineForce(lambda s, r, R: -40.0 * (r - np.outer(s, UP)) + np.array([P, 0, 0]))]
            ),
            tip,
            dx.Equilibrium(UNIT, loads=[load, dx.Foundation(40.0)]),
        ),
    ]
    for at in (0.3, 0.7):  # behind the load the rod is straight: a cantilever of length `at`, and its tangent
        problem = dx.Equilibrium(UNIT, ALONG_X, loads=[dx.PointForce((0, 0, -20.0), at=at)])
        shorter = dx.Equilibrium(dx.Rod(at, dx.Stiffness(EI1=1.0, GJ=1.0)), ALONG_X, loads=[dx.EndForce((0, 0, -20.0))])
        exact = dx.solve(shorter, dx.Elastica())
        entries.append(Entry(f"point force at {at:g}", problem, tip, exact.tip + (1.0 - at) * exact.R(at)[:, 2], 1e-9))
    return entries


def _known() -> list[Entry]:
    """The reference cases that the other methods are held to."""
    return [
        Entry(case.id, case.problem, tip, np.array(case.tip) / case.problem.rod.length, 3e-10 + case.digits)
        for case in cases.ALL
    ]


CATALOGUE = [
    *_turns(),
    *_by_elastica(),
    *_followers(),
    *_columns(),
    *_pushed(),
    *_twisted_to_a_tenth(),
    *_rings(),
    *_spinning(),
    *_by_shooting(),
    *_supports_and_points(),
    *_known(),
]
