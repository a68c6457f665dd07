"""The units in which a problem has no dimensions.

Lengths are divided by the rod's length L, forces by EI / L^2 and moments by EI / L with a mean bending stiffness EI,
so that a micrometre filament and a kilometre of cable give the same numbers. Positions count from a held end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from darboux.curve import Curve
from darboux.kernels.rod_equations import FORCE, MOMENT, ROTATION
from darboux.problem import Equilibrium

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scale:
    """The units of the dimensionless numbers and the origin (3,) of the positions."""

    length: float
    force: float
    moment: float
    origin: Array

    @classmethod
    def of(cls, problem: Equilibrium) -> Scale:
        """Return the scale of a problem: its length, its mean bending stiffness, its first held end."""
        L = problem.rod.length
        stiffness = problem.rod.stiffness(np.linspace(0.0, L, 1 if problem.rod.uniform else 17))
        EI = float(np.exp(np.mean(np.log(stiffness.EI1) + np.log(stiffness.EI2)) / 2.0))
        _, held = problem.supports[0]
        return cls(L, EI / L**2, EI / L, np.array(held.position))

    def states(self, curve: Curve, x: Array) -> Array:
        """Return the dimensionless states (n, 13) of a curve in SI units at x (n,), from 0 to 1 along its own length."""
        y = curve(x * curve.s[-1])
        y[:, :ROTATION] = (y[:, :ROTATION] - self.origin) / self.length
        y[:, FORCE:MOMENT] /= self.force
        y[:, MOMENT:] /= self.moment
        return y

    def curve(self, x: Array, y: Array, dy: Array) -> Curve:
        """Return dimensionless states y (n, 13) at x (n,), with their slopes dy / dx, in SI units."""
        unit = np.repeat([self.length, 1.0, self.force, self.moment], [3, 4, 3, 3])
        states, slopes = y * unit, dy * unit / self.length
        norm = np.linalg.norm(states[:, ROTATION:FORCE], axis=1, keepdims=True)
        states[:, ROTATION:FORCE] /= norm
        slopes[:, ROTATION:FORCE] /= norm
        states[:, :ROTATION] += self.origin
        return Curve(x * self.length, states, slopes)
