"""The paper's figures as problems, with its numbers; what it does not print is named and chosen here."""

from __future__ import annotations

import numpy as np

from darboux.loads import ElectricField, EndForce, EndMoment, Gravity, Rotation
from darboux.material import Material
from darboux.natural import frame_of_helix
from darboux.problem import Equilibrium
from darboux.rod import Rod
from darboux.section import Circle, Stiffness
from darboux.supports import Clamped

# Figure 5: printed are l, r, E and rho. Not printed: nu (twist does not occur) and g (the standard 9.81 m/s^2).
FIGURE5_SEGMENTS = {"discrete_5": 4, "discrete_30": 29}  # 5 and 30 vertices

# Figure 6: all is printed.
FIGURE6_K = np.array([-25.0, 10.0, -25.0])  # 1/m: the moment is B k, the same vector in space at every section
FIGURE6_EI, FIGURE6_D = 4e-7, 2.6e-7  # N m^2

# Figure 7: printed are E I1 = 3, E I2 = 2, D = 0.5, k = (0, 2, 0.1) and n = 0 at the start, in no unit.
# Not printed: length and weight per length; these show five turns that the weight bends but does not pull straight.
FIGURE7_K = np.array([0.0, 2.0, 0.1])
FIGURE7_LENGTH = 16.0
FIGURE7_WEIGHT = {"a": 0.002, "b": 0.02}


def figure5(stretch: bool = False) -> Equilibrium:
    """A cantilever under its own weight, clamped horizontally: w L^3 / EI = 613.125."""
    rod = Rod(length=0.25, section=Circle(radius=1e-3), material=Material(E=1e6, nu=0.5, density=1e3), stretch=stretch)
    return Equilibrium(rod, start=Clamped(tangent=(1, 0, 0)), loads=[Gravity()])


def figure6() -> Equilibrium:
    """A rod under the terminal moment -25 EI1 e1 + 10 EI2 e2 - 25 D e3: a helix about the moment's direction."""
    rod = Rod(length=0.3, section=Stiffness(EI1=FIGURE6_EI, GJ=FIGURE6_D))
    return Equilibrium(rod, loads=[EndMoment(np.array([FIGURE6_EI, FIGURE6_EI, FIGURE6_D]) * FIGURE6_K)])


def exact_helix6(s: np.ndarray) -> np.ndarray:
    """Return the exact centreline of figure 6 at s (n,): (n, 3) in m.

        r' = t, t' = w x t, w = m / EI:   r = (t.w w/|w|^2) s + sin(|w| s)/|w| p + (1 - cos(|w| s))/|w| (w/|w| x p)
    with p the part of t(0) = e3 across w.
    """
    w = np.array([FIGURE6_EI, FIGURE6_EI, FIGURE6_D]) * FIGURE6_K / FIGURE6_EI
    size = np.linalg.norm(w)
    axis, t = w / size, np.array([0.0, 0.0, 1.0])
    p = t - (t @ axis) * axis
    turned = np.asarray(s)[:, None] * size
    along = (t @ axis) * axis * np.asarray(s)[:, None]
    return np.asarray(along + np.sin(turned) / size * p + (1.0 - np.cos(turned)) / size * np.cross(axis, p))


def figure7(reading: str, orientation: str) -> Equilibrium:
    """The helix under gravity. Reading "a": straight at rest, to be integrated from k; "b": natural curvature k.

    The helix axis at the clamp is vertical (hanging) or horizontal.
    """
    k = FIGURE7_K if reading == "b" else FIGURE7_K * (1.0, -1.0, 1.0)  # (a) is printed in the left-handed triad
    axis = (0, 0, -1) if orientation == "vertical" else (1, 0, 0)
    section = Stiffness(EI1=3.0, EI2=2.0, GJ=0.5, mass=FIGURE7_WEIGHT[reading] / 9.81)
    rod = Rod(length=FIGURE7_LENGTH, section=section, natural=k if reading == "b" else None)
    return Equilibrium(rod, start=Clamped(frame=frame_of_helix(k, axis)), loads=[Gravity()])


def rotating(turns_per_second: float) -> Equilibrium:
    """The rod of figure 5, clamped radially on a hub of radius 2 cm that turns about the vertical."""
    rod = figure5().rod
    omega = (0.0, 0.0, 2.0 * np.pi * turns_per_second)
    return Equilibrium(rod, start=Clamped(position=(0.02, 0, 0), tangent=(1, 0, 0)), loads=[Gravity(), Rotation(omega)])


def charged(field: float) -> Equilibrium:
    """The rod of figure 5 with a charge of 1e-7 C/m in a vertical electric field (V/m, upwards)."""
    loads = [Gravity(), ElectricField((0.0, 0.0, field), charge_per_length=1e-7)]
    return Equilibrium(figure5().rod, start=Clamped(tangent=(1, 0, 0)), loads=loads)


TURNS_PER_SECOND = (0.0, 0.8, 1.2, 1.6, 2.4, 4.0)
FIELDS = (0.0, 2e5, 2.8e5, 3.2e5, 3.6e5, 5e5)  # V/m; 3.08e5 V/m would carry the rod's weight


def geometry() -> Equilibrium:
    """The rod that figures 1 to 4 are drawn from: of foam, thick enough to be seen, bent and twisted by weight and end."""
    rod = Rod(length=1.0, section=Circle(radius=0.035), material=Material(E=1e5, nu=0.5, density=20.0))
    loads = [Gravity(), EndForce((0.6, 0.3, 0.8)), EndMoment((0.4, 0.4, 0.2))]
    return Equilibrium(
        rod, start=Clamped(position=(0.1, 0.1, 0.3), tangent=(0.8, -0.3, 0.5), d1=(0.35, -0.2, -0.7)), loads=loads
    )
