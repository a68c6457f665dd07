"""The mass of a rod along it, and what resists its turning about the tangent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from darboux.errors import InvalidInput
from darboux.rod import Rod

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Masses:
    """Masses in kg per x = s / L of a rod; a motion has its own unit of mass."""

    rod: Rod

    @property
    def known(self) -> bool:
        """Whether the rod's mass is known."""
        return self.rod.stiffness(np.zeros(1)).mass is not None

    def __call__(self, x: Array, why: str) -> Array:
        """Return the mass in kg per x at x (n,). Raises ``InvalidInput`` where it is not known; ``why`` names what needs it."""
        return self.rod.mass(x * self.rod.length, why) * self.rod.length

    def gyration(self, x: Array) -> Array:
        """Return (I1 + I2) / A L^2 of the section at x (n,): rotary inertia over m L^2; none where the section has no shape."""
        rod = self.rod
        if not rod.section.has_shape:
            return np.zeros(len(x))
        g = rod.section.geometry(x * rod.length, rod.material.nu)
        return np.asarray((g.I1 + g.I2) / (g.A * rod.length**2))

    def rotary_is_known(self, given: float | None) -> bool:
        """Return whether `rotary` has an answer."""
        return given is not None or self.rod.stiffness(np.zeros(1)).EA is not None

    def rotary(self, x: Array, given: float | None) -> Array:
        """Return the rotary inertia about the tangent in kg m^2 per x at x (n,): m (EI1 + EI2) / EA, or that given in kg m.

        Raises ``InvalidInput`` where it does not follow.
        """
        if given is not None:
            return np.full(len(x), given * self.rod.length)
        c = self.rod.stiffness(x * self.rod.length)
        if c.EA is None:
            raise InvalidInput(
                "motion.rotary_inertia is missing, and section.EA too, from which it would follow; give one of them."
            )
        return np.asarray(self(x, "Motion") * (c.EI1 + c.EI2) / c.EA)
