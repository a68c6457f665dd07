"""What the filament is made of."""

from __future__ import annotations

from typing import Any

from darboux import above, checks
from darboux.checks import assign, description
from darboux.errors import InvalidInput


@description
class Material:
    """A linear elastic, isotropic material.

        G = E / (2 (1 + nu))

    Arguments: ``E`` Young's modulus in Pa; ``nu`` Poisson's ratio in (-1, 0.5], or ``G`` shear modulus in Pa (one of
    the two; nu = 0.3 where neither is given is NOT assumed); ``density`` in kg/m3, needed only where mass acts; ``strength``
    in Pa, the stress up to which it is elastic: a solution warns beyond it. A name of ``materials.LIBRARY`` in place of E, as
    in ``Material("steel")``, gives what is not given. Raises ``InvalidInput`` for values outside these ranges.
    """

    E: float
    nu: float | None = None
    density: float | None = None
    G: float | None = None
    strength: float | None = None

    def __post_init__(self) -> None:
        came: Any = self.E
        if isinstance(came, str):
            self._take(came)
        E = checks.positive("material.E", self.E, "Pa")
        if (self.nu is None) == (self.G is None):
            came = "neither" if self.nu is None else "both"
            raise InvalidInput(
                f"material takes either nu or G, but {came} came; give Poisson's ratio or the shear modulus."
            )
        if self.nu is not None:
            nu = checks.number("material.nu", self.nu)
            if not -1.0 < nu <= 0.5:
                raise InvalidInput(f"material.nu is {nu:g}; Poisson's ratio must lie above -1 and not above 0.5.")
            assign(self, nu=nu)
        else:
            G = checks.positive("material.G", self.G, "Pa")
            nu = E / (2.0 * G) - 1.0
            if not -1.0 < nu <= 0.5 + 1e-12:
                raise InvalidInput(
                    f"material.G is {G:g} Pa beside E = {E:g} Pa: Poisson's ratio E / 2G - 1 would be {nu:.3g}, but it must lie "
                    f"above -1 and not above 0.5, so G from {E / 3.0:g} Pa on. An anisotropic rod is a Stiffness(EI1, EI2, GJ)."
                )
            assign(self, G=G)
        if self.density is not None:
            assign(self, density=checks.not_negative("material.density", self.density, "kg/m^3"))
        if self.strength is not None:
            assign(self, strength=checks.positive("material.strength", self.strength, "Pa"))
        assign(self, E=E)

    def _take(self, name: str) -> None:
        """Take what is not given from the material of that name."""
        known: Material = above.call("material", "material", name)
        given = {part for part in ("nu", "G", "density", "strength") if getattr(self, part) is not None}
        given |= {"nu", "G"} if given & {"nu", "G"} else set()
        assign(self, E=known.E, **{part: value for part, value in vars(known).items() if part not in given | {"E"}})

    @property
    def shear_modulus(self) -> float:
        """G in Pa."""
        return self.E / (2.0 * (1.0 + self.nu)) if self.nu is not None else float(self.G)  # type: ignore[arg-type]

    @property
    def poisson(self) -> float:
        """Poisson's ratio, from E and G where G was given."""
        return self.nu if self.nu is not None else self.E / (2.0 * self.shear_modulus) - 1.0
