"""Reference problems that several test files state: case, source, formula and digits of each.

The digits are the project's reference set (closed forms, elliptic integrals, Chebyshev collocation and high-precision
shooting, made without this library), quoted with the id that they have there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import darboux as dx


@dataclass(frozen=True)
class Case:
    """A problem, what must come out at the tip (m), and how sure the digits are, relative to the length."""

    id: str
    problem: dx.Equilibrium
    tip: tuple[float, float, float]
    digits: float
    root_moment: tuple[float, float, float] | None = None


def turn_y(a: float) -> np.ndarray:
    return np.array([[np.cos(a), 0.0, np.sin(a)], [0.0, 1.0, 0.0], [-np.sin(a), 0.0, np.cos(a)]])


def turn_z(a: float) -> np.ndarray:
    return np.array([[np.cos(a), -np.sin(a), 0.0], [np.sin(a), np.cos(a), 0.0], [0.0, 0.0, 1.0]])


RUBBER = dx.Rod(length=0.25, section=dx.Circle(radius=1e-3), material=dx.Material(E=1e6, nu=0.5, density=1e3))
ALONG_X = dx.Clamped(tangent=(1, 0, 0))
UNIT = dx.Rod(length=1.0, section=dx.Stiffness(EI1=1.0, GJ=0.75))

# What may hold the far end of a rod of unit length, besides clamps and pins.
ENDS = {
    "hinge": dx.Hinge(axis=(1, 2, 0), position=(0, 0.1, 0.9)),
    "universal": dx.Universal(axis=(1, 0, 0), section_axis=(0, 1, 0), position=(0, 0.1, 0.9)),
    "roller": dx.Roller(along=(1, 0, 2), position=(0, 0.1, 0.9)),
    "groove": dx.Roller(along=(1, 0, 2), position=(0, 0.1, 0.9), sliding="section"),
    "slider": dx.Slider(along=(1, 0, 2), position=(0, 0.1, 0.9)),
    "guided": dx.Guided(tangent=(0.2, 0, 1)),
    "spring": dx.Spring(
        linear=[[3, 1, 0], [1, 4, 0], [0, 0, 5]], rotational=[[2, 0, 1], [0, 3, 0], [1, 0, 4]], position=(0, 0, 1)
    ),
    "free": dx.Free(),
}


def tip_force(P: float) -> dx.Equilibrium:
    """Clamped along +x, dead force P along +y: theta'' = -(P L^2 / EI) cos(theta)."""
    return dx.Equilibrium(UNIT, start=ALONG_X, loads=[dx.EndForce((0, P, 0))])


def rolled(turns: float) -> dx.Equilibrium:
    """Clamped along +x, moment 2 pi turns EI / L about +z: an arc of constant curvature."""
    return dx.Equilibrium(UNIT, start=ALONG_X, loads=[dx.EndMoment((0, 0, 2.0 * np.pi * turns))])


def heavy(w: float) -> dx.Equilibrium:
    """Clamped along +x, dead weight w along -y: theta'' = -(w L^3 / EI)(1 - s) cos(theta)."""
    return dx.Equilibrium(UNIT, start=ALONG_X, loads=[dx.LineForce((0, -w, 0))])


def anisotropic(force: tuple[float, ...], moment: tuple[float, ...], **model: bool) -> dx.Equilibrium:
    """B1 = 1, B2 = 3, C = 0.7, dead tip force and tip moment in space."""
    section = dx.Stiffness(EI1=1.0, EI2=3.0, GJ=0.7, EA=400.0, GA1=150.0, GA2=200.0)
    return dx.Equilibrium(dx.Rod(1.0, section, **model), loads=[dx.EndForce(force), dx.EndMoment(moment)])


def hanging_helix(w: float) -> dx.Equilibrium:
    """Natural curvature (0, 10, 3), B = 1, C = 0.75, weight w along -z, root tangent -z with d1 = +x."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.75), natural=(0.0, 10.0, 3.0))
    clamp = dx.Clamped(tangent=(0, 0, -1), d1=(1, 0, 0))
    return dx.Equilibrium(rod, start=clamp, loads=[dx.LineForce((0, 0, -w))])


def strip(force: tuple[float, ...]) -> dx.Equilibrium:
    """A strip with one natural turn of twist, B1 = 1, B2 = 10, C = 1, dead tip force."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=10.0, GJ=1.0), natural=(0.0, 0.0, 2.0 * np.pi))
    return dx.Equilibrium(rod, loads=[dx.EndForce(force)])


def bathe_bolourchi(P: float, GJ: float, **stiffness: float) -> dx.Equilibrium:
    """45 degrees of a circle of radius 100, unit square section, E = 1e7, nu = 0; tip force P out of its plane."""
    EI = 1e7 / 12.0
    section = dx.Stiffness(EI1=EI, GJ=GJ, **stiffness)
    model = bool(stiffness)
    rod = dx.Rod(100.0 * np.pi / 4.0, section, natural=(0.0, 0.01, 0.0), stretch=model, shear=model)
    clamp = dx.Clamped(frame=np.column_stack([(1, 0, 0), (0, 0, -1), (0, 1, 0)]))
    return dx.Equilibrium(rod, start=clamp, loads=[dx.EndForce((0, 0, P))])


def spinning(a: float, Lambda: float) -> dx.Equilibrium:
    """Root at radius a from the z axis, tangent +z, rho A Omega^2 L^4 / EI = Lambda, no gravity."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.0, GJ=0.75, mass=1.0))
    clamp = dx.Clamped(position=(a, 0, 0))
    return dx.Equilibrium(rod, start=clamp, loads=[dx.Rotation((0, 0, np.sqrt(Lambda)))])


def tapered(P: float) -> dx.Equilibrium:
    """As the tip force, EI = EI0 (1 - s / 2 L)^4: a cone whose tip has half the diameter of its root."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=lambda s: (1.0 - 0.5 * s) ** 4, GJ=1.0))
    return dx.Equilibrium(rod, start=ALONG_X, loads=[dx.EndForce((0, P, 0))])


def field(mag: float, degrees: float) -> dx.Equilibrium:
    """A uniformly charged rod along +x in a field: f L^3 / EI = mag at an angle from +x towards +y."""
    angle = np.radians(degrees)
    load = dx.ElectricField((mag * np.cos(angle), mag * np.sin(angle), 0.0), charge_per_length=1.0)
    return dx.Equilibrium(UNIT, start=ALONG_X, loads=[load])


def posed(C: float = 0.75) -> dx.Equilibrium:
    """Both ends clamped: s = 1 at (0.3, 0.2, 0.5) with R = Ry(pi/2) Rz(0.8)."""
    end = dx.Clamped(position=(0.3, 0.2, 0.5), frame=turn_y(np.pi / 2) @ turn_z(0.8))
    return dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=C)), end=end)


GJ_POLAR = 5e6 / 6.0
LOADS = {  # of every kind, on a rod of length 1 and stiffness about 1
    "gravity": dx.Gravity((1, 0.5, -2)),
    "line force": dx.LineForce((2, 1, -1)),
    "line force, follower": dx.LineForce((2, 1, -1), frame="section"),
    "line couple": dx.LineCouple((0.5, 1, 0.4)),
    "line couple, follower": dx.LineCouple((0.5, 1, 0.4), frame="section"),
    "force of the shape": dx.LineForce(lambda s, r, R: -2.0 * r + R[:, :, 0] * s[:, None]),
    "couple of the shape": dx.LineCouple(lambda s, r, R: 0.9 * np.cross(R[:, :, 2], r + 0.3)),
    "foundation": dx.Foundation(30.0, direction=(0.1, 0, 1)),
    "buoyancy": dx.Buoyancy(density=3.0, area=1.0, g=(0, 1, -1)),
    "point force": dx.PointForce((2, 1, -1), at=0.37),
    "point force, follower": dx.PointForce((2, 1, -1), at=0.37, follower=True),
    "point force off the centre": dx.PointForce((2, 1, -1), at=0.37, offset=(0.2, -0.1, 0.15)),
    "point force off the centre that turns": dx.PointForce(
        (0.5, 0.3, -0.3), at=0.37, follower=True, offset=(0.2, -0.1, 0.15)
    ),
    "point moment": dx.PointMoment((0.5, 1, 0.3), at=0.37),
    "point moment, follower": dx.PointMoment((0.5, 1, 0.3), at=0.37, follower=True),
    "end force off the centre": dx.EndForce((1, 1, -1), offset=(0.2, -0.1, 0.15)),
    "end force, follower": dx.EndForce((1, 1, -1), follower=True),
    "end moment": dx.EndMoment((1, 0.5, 0.6)),
    "end moment, follower": dx.EndMoment((1, 0.5, 0.6), follower=True),
    "rotation": dx.Rotation((0.3, 2, 1)),
    "electric field": dx.ElectricField((1, 2, 0), lambda s: 1.0 + s),
}

COSSERAT = {"stretch": True, "shear": True}

PLANAR = [
    Case("S01 quarter", rolled(0.25), (0.63661977236758134308, 0.63661977236758134308, 0.0), 1e-15),
    Case("S01 half", rolled(0.5), (0.0, 0.63661977236758134308, 0.0), 1e-15),
    Case("S01 whole", rolled(1.0), (0.0, 0.0, 0.0), 1e-15),
    Case("S01 twice", rolled(2.0), (0.0, 0.0, 0.0), 1e-15),
    Case("S02 P=0.1", tip_force(0.1), (0.99933460003695241534, 0.033295319268174331159, 0.0), 1e-16),
    Case("S02 P=1", tip_force(1.0), (0.94356676371662311691, 0.30172077379981352954, 0.0), 1e-16),
    Case("S02 P=5", tip_force(5.0), (0.61237163927557012814, 0.71379152361191272809, 0.0), 1e-16),
    Case("S02 P=15", tip_force(15.0), (0.36471421963791471887, 0.84771567433229714449, 0.0), 1e-16),
    Case("S02c P=1", tapered(1.0), (0.838760929192, 0.4586311875418, 0.0), 1e-12),
    Case("S05 w=1", heavy(1.0), (0.991246395346635179, -0.123471401983351056, 0.0), 1e-16),
    Case("S05 w=10", heavy(10.0), (0.656353761238598705, -0.700199715514312598, 0.0), 1e-16),
    Case("S05 w=613.125", heavy(613.125), (0.0592375526997370739, -0.975788073351613863, 0.0), 1e-16),
    Case("S11d 120 deg", field(10.0, 120.0), (0.4732953201669, 0.8037696923257, 0.0), 1e-12),
    Case("S11d 60 deg", field(5.0, 60.0), (0.9200738238972, 0.3670596186129, 0.0), 1e-12),
]  # fmt: skip

SPATIAL = [
    Case("S09 load 1", anisotropic((1.5, -1, -0.8), (0.4, 0.6, 0.9)), (0.4029609786023, -0.4807601337262, 0.6770099145874), 1e-11, (1.461618021568, 1.937883654763, 1.218179221987)),
    Case("S09 load 3", anisotropic((0, 0, -2), (0.5, 0.2, 4)), (0.1658398234412, 0.06800423861518, 0.972091175135), 1e-11, (0.3639915227696, 0.5316796468824, 4.0)),
    Case("S09b force", strip((2.0, 1.0, -1.0)), (0.3395434406742, 0.1157174396479, 0.9101172121343), 1e-11, (-1.025834651782, 2.159777864943, 0.1081085613784)),
    Case("S09b tension", strip((0.5, 0.0, 20.0)), (0.01632147354822, -0.00137642272489, 0.9998368412461), 1e-11, (-0.0275284544978, 0.1734889496587, 0.000688211362445)),
    Case("S10 H1", hanging_helix(20.0), (0.1426521077168, -0.281071031153, -0.2855246377034), 1e-11, (2.415798704553, 1.901549399594, 0.0)),
    Case("S10 H2", hanging_helix(200.0), (0.1366541758199, 0.02086734685962, -0.7774631890582), 1e-11, (3.032632818266, 8.662684101322, 4.968685806847e-15)),
    Case("S07 V1 P=300", bathe_bolourchi(300.0, GJ_POLAR), (22.24503474207, 58.77968539121, 40.18828383798), 1e-10),
    Case("S07 V1 P=600", bathe_bolourchi(600.0, GJ_POLAR), (15.68507816216, 47.15129440031, 53.46859844232), 1e-10),
    Case("S11b L=1", spinning(0.1, 1.0), (0.1136122842473, 0.0, 0.999893976963), 1e-12),
    Case("S11b L=5", spinning(0.1, 5.0), (0.2039610496915, 0.0, 0.9937628761239), 1e-12),
    Case("S11b L=50", spinning(0.1, 50.0), (0.9734610405195, 0.0, 0.3273655753327), 1e-12),
]  # fmt: skip

STRETCHED = [
    Case("S05 stretch", dx.Equilibrium(dx.Rod(0.25, dx.Circle(1e-3), dx.Material(E=1e6, nu=0.5, density=1e3), stretch=True), start=ALONG_X, loads=[dx.Gravity()]), (0.014817711552, 0.0, -0.244237586080), 1e-11),
]  # fmt: skip

SHEARED = [
    Case("S09 Cosserat 1", anisotropic((1.5, -1, -0.8), (0.4, 0.6, 0.9), **COSSERAT), (0.4101926357242, -0.4840142034807, 0.6731690175357), 1e-11, (1.46038038032, 1.937907634883, 1.215828669497)),
    Case("S09 Cosserat 3", anisotropic((0, 0, -2), (0.5, 0.2, 4), **COSSERAT), (0.1666029125396, 0.06902836758596, 0.9666541380409), 1e-11, (0.3619432648281, 0.5332058250792, 4.0)),
    Case("S07 V2 P=300", bathe_bolourchi(300.0, GJ_POLAR, EA=1e7, GA1=5e6, GA2=5e6), (22.24478094537, 58.77912248968, 40.19189167015), 1e-10),
    Case("S07 V2 P=600", bathe_bolourchi(600.0, GJ_POLAR, EA=1e7, GA1=5e6, GA2=5e6), (15.68480053404, 47.15043857363, 53.47485879183), 1e-10),
]  # fmt: skip

ALL = PLANAR + SPATIAL + STRETCHED + SHEARED
