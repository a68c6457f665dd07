"""The filament: length, section, material, natural shape, and whether it stretches and shears."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux import checks, materials, profile
from darboux.checks import assign, description
from darboux.errors import InvalidInput
from darboux.material import Material
from darboux.natural import Helix
from darboux.profile import Table, Varying
from darboux.section import Section, SectionStiffness

Array = NDArray[np.float64]

THICKEST = 4.0  # times as thick as long: surely a mistaken unit
SMALLEST_STIFFNESS, LARGEST_STIFFNESS = 1e-60, 1e60  # N m^2


@description
class Rod:
    """An elastic filament with the arc length s in [0, length].

        R^T m = B (k - k0),  B = diag(EI1, EI2, GJ);   v = (0, 0, 1) + S^-1 R^T n,  S = diag(GA1, GA2, EA)

    Arguments: ``length`` in m, unloaded; ``section`` a ``Circle``, ``Tube``, ``Rectangle``, ``Ellipse``, ``Stiffness`` or
    ``StiffnessMatrix`` (with its law); ``material`` a ``Material``, or a name from ``materials.LIBRARY`` such as "steel"
    (none beside the last two); ``natural`` the natural curvature and twist k0 in 1/m, section's frame: None (straight),
    three numbers, a ``Helix``, a ``Table`` of (n, 3), or a function of s that returns (n, 3); ``stretch`` and ``shear``
    whether S^-1 keeps its part or is zero. Raises ``InvalidInput``.
    """

    length: float
    section: Any
    material: Any = None
    natural: Varying = None
    stretch: bool = False
    shear: bool = False

    def __post_init__(self) -> None:
        length = checks.positive("rod.length", self.length, "m")
        checks.instance(
            "rod.section", self.section, Section, "a Circle, Tube, Rectangle, Ellipse, Stiffness or StiffnessMatrix"
        )
        if isinstance(self.material, str):
            assign(self, material=materials.named("rod.material", self.material))
        if self.section.needs_material:
            checks.instance("rod.material", self.material, Material, "a material by name, or Material(E=1e6, nu=0.5)")
        elif self.material is not None:
            raise InvalidInput(
                f"rod.material came beside a {type(self.section).__name__} section, which holds the stiffnesses already; leave "
                "it out."
            )
        for name in ("stretch", "shear"):
            checks.instance(f"rod.{name}", getattr(self, name), (bool, np.bool_), "True or False")
        natural = self.natural
        if natural is not None and not isinstance(natural, Helix):
            profile.vector("rod.natural", natural, "1/m")
            natural = profile.frozen(natural)
        assign(self, length=length, natural=natural, stretch=bool(self.stretch), shear=bool(self.shear))
        self._check_ends()
        with np.errstate(over="ignore"):  # what is out of the numbers' range is said in words
            self._check_thickness()
            self._check_stiffness(self.stiffness(np.linspace(0.0, length, 17)))

    def _check_thickness(self) -> None:
        area = self.section.outer_area(np.linspace(0.0, self.length, 17))
        if area is not None and np.max(np.sqrt(area)) > THICKEST * self.length:
            raise InvalidInput(
                f"the section is about {np.max(np.sqrt(area)):.3g} m thick, but the rod is {self.length:g} m long; a rod is longer "
                "than thick. Check the unit of the section's dimensions: metres, so 1 mm is 1e-3."
            )

    def _check_ends(self) -> None:
        values = [self.natural, *(getattr(self.section, name) for name in self.section.profiles())]
        for table in (value for value in values if isinstance(value, Table)):
            if abs(table.s[0]) > 1e-12 * self.length or abs(table.s[-1] - self.length) > 1e-9 * self.length:
                raise InvalidInput(
                    f"a Table runs from s = {table.s[0]:g} to {table.s[-1]:g} m, but the rod from 0 to {self.length:g} m; "
                    "give values from end to end."
                )

    def _check_stiffness(self, stiffness: SectionStiffness) -> None:
        self.k0(np.linspace(0.0, self.length, 17))
        for name in ("EI1", "EI2", "GJ"):
            value = getattr(stiffness, name)
            wrong = value[(value < SMALLEST_STIFFNESS) | (value > LARGEST_STIFFNESS)]
            if len(wrong):
                raise InvalidInput(
                    f"the section's {name} is {wrong[0]:g} N m^2, out of the numbers' range; check the unit of its dimensions (m)."
                )
        if self.stretch and stiffness.EA is None:
            raise InvalidInput(
                "rod.stretch is True, but section.EA is missing; give EA in N (or a matrix of 6 x 6), or set stretch=False."
            )
        if self.shear and (stiffness.GA1 is None or stiffness.GA2 is None):
            raise InvalidInput(
                "rod.shear is True, but section.GA1 or GA2 is missing; give both in N (or a matrix of 6 x 6), or set shear=False."
            )

    def stiffness(self, s: Array) -> SectionStiffness:
        """Return the section's stiffnesses and mass per length at s (n,)."""
        if self._same_section and len(s) == 1:
            return self._first_section
        if self._same_section:
            same: Any = {
                name: None if value is None else np.repeat(value, len(s), axis=0)
                for name, value in vars(self._first_section).items()
            }
            return SectionStiffness(**same)
        return self.section.stiffness(np.asarray(s, dtype=float), self.material)  # type: ignore[no-any-return]

    @cached_property
    def _same_section(self) -> bool:
        return all(p.constant for p in self.section.profiles().values())

    @cached_property
    def _first_section(self) -> SectionStiffness:
        return self.section.stiffness(np.zeros(1), self.material)  # type: ignore[no-any-return]

    def k0(self, s: Array) -> Array:
        """Return the natural curvature and twist at s (n,): (n, 3) in 1/m, section's frame."""
        return self._natural(np.asarray(s, dtype=float))

    @cached_property
    def _natural(self) -> profile.Profile:
        natural = self.natural.curvature if isinstance(self.natural, Helix) else self.natural
        return profile.vector("rod.natural", (0.0, 0.0, 0.0) if natural is None else natural, "1/m")

    def mass(self, s: Array, why: str) -> Array:
        """Return the mass per length in kg/m at s (n,); ``why`` names the load that needs it."""
        mass = self.stiffness(s).mass
        if mass is None:
            field = "material.density" if self.section.needs_material else "section.mass"
            raise InvalidInput(f"{field} is missing; {why} acts on the rod's mass. Give it, or leave the load out.")
        return mass

    def displaced_area(self, s: Array) -> Array:
        """Return the area in m^2 that the section takes from a fluid around it, at s (n,)."""
        area: Array | None = self.section.outer_area(np.asarray(s, dtype=float))
        if area is None:
            raise InvalidInput(
                f"buoyancy.area is missing; a {type(self.section).__name__} section has no shape. Give the area in m^2."
            )
        return area

    def compliance(self, s: Array) -> Array:
        """Return the section's compliance at s (n,): (n, 6, 6), in the order (v1, v2, v3, k1, k2, k3).

            [v - v0]   [S^-1  D^T ] [R^T n]
            [k - k0] = [D     B^-1] [R^T m]          in 1/N (S^-1), 1/(N m) (D), 1/(N m^2) (B^-1)

        It is the inverse of the stiffness matrix without the rows and columns of the strains that the rod does not have:
        these are held at zero, and so are their rows and columns here.
        """
        free = [*([0, 1] if self.shear else []), *([2] if self.stretch else []), 3, 4, 5]
        stiffness, C = self.stiffness(s), np.zeros((len(s), 6, 6))
        if stiffness.full is None:
            for i in free:
                C[:, i, i] = 1.0 / stiffness.diagonal[i]
            return C
        K = stiffness.matrix[:, free][:, :, free]
        C[np.ix_(range(len(s)), free, free)] = np.linalg.inv(K)
        return C

    @cached_property
    def coupled(self) -> bool:
        """True where the section may couple bending and twist with stretch and shear."""
        if not self.section.coupled or not (self.stretch or self.shear):
            return False
        return not self._same_section or bool(np.any(self.compliance(np.zeros(1))[:, 3:, :3]))

    @property
    def model(self) -> str:
        """The theory that the rod states, in words: methods are compared only where they solve the same."""
        return {
            (False, False): "inextensible",
            (True, False): "stretch",
            (False, True): "shear",
            (True, True): "stretch and shear",
        }[self.stretch, self.shear]

    @property
    def uniform(self) -> bool:
        """True where neither the section nor the natural shape varies along s."""
        return not callable(self.natural) and self._same_section

    @cached_property
    def breaks(self) -> tuple[float, ...]:
        """The arc lengths in m, between the ends, at which a table has a kink or a knot."""
        tables = [self.natural] if isinstance(self.natural, Table) else []
        inner = {s for table in tables for s in table.s}
        inner |= {s for p in self.section.profiles().values() for s in p.breaks}
        return tuple(sorted(s for s in inner if 0.0 < s < self.length))
