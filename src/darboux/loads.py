"""What acts on the rod: along its length, and at its ends.

Every distributed load is affine in the position and the frame,

    f = a(s) + C(s) r + R b(s)   (force per length),     l = la(s) + R lb(s)   (couple per length),

so that methods have exact derivatives. A load adds its part; methods never ask for a class name.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from darboux import checks, profile
from darboux.checks import assign, description
from darboux.profile import Table, Varying

if TYPE_CHECKING:
    from darboux.rod import Rod

Array = NDArray[np.float64]
ENDS = ("start", "end")


@dataclass
class Distributed:
    """The sum of the loads per length at n arc lengths: a (n, 3), C (n, 3, 3), b, la, lb (n, 3); N/m, N/m^2, N."""

    a: Array
    C: Array
    b: Array
    la: Array
    lb: Array

    @classmethod
    def zero(cls, n: int) -> Distributed:
        return cls(*(np.zeros((n, 3, 3)) if name == "C" else np.zeros((n, 3)) for name in ("a", "C", "b", "la", "lb")))

    def force(self, r: Array, R: Array) -> Array:
        """f = a + C r + R b: (n, 3) in N/m."""
        moved: Array = np.einsum("nij,nj->ni", self.C, r) + np.einsum("nij,nj->ni", R, self.b)
        return self.a + moved

    def couple(self, R: Array) -> Array:
        """l = la + R lb: (n, 3) in N."""
        turned: Array = np.einsum("nij,nj->ni", R, self.lb)
        return self.la + turned


@dataclass
class EndLoad:
    """The sum of the dead loads on one end: force (3,) in N and moment (3,) in N m, fixed frame."""

    force: Array = field(default_factory=lambda: np.zeros(3))
    moment: Array = field(default_factory=lambda: np.zeros(3))


class Load:
    """What every load offers; most add to one of the two."""

    def add_distributed(self, total: Distributed, s: Array, rod: Rod) -> None:
        """Add this load's part per length at s (n,)."""

    def add_end(self, at: str, total: EndLoad) -> None:
        """Add this load's part at the end ``at``, "start" or "end"."""

    @property
    def varying(self) -> tuple[Varying, ...]:
        """The load's own quantities that may vary along s."""
        return ()

    @property
    def place(self) -> str | None:
        """The end that the load acts on, or None for a load along the rod."""
        return None


@description
class Gravity(Load):
    """The rod's weight.

        f = rho A g

    Argument: ``g`` (3,) in m/s^2, fixed frame; the default is (0, 0, -9.81). Conservative.
    """

    g: Any = (0.0, 0.0, -9.81)

    def __post_init__(self) -> None:
        assign(self, g=checks.vector("gravity.g", self.g, "m/s^2"))

    def add_distributed(self, total: Distributed, s: Array, rod: Rod) -> None:
        total.a += rod.mass(s, "Gravity")[:, None] * np.array(self.g)


@description
class LineForce(Load):
    """A force per length, dead or turning with the section.

        f = force(s)   (frame="fixed"),     f = R force(s)   (frame="section": a follower, not conservative in general)

    Arguments: ``force`` in N/m: three numbers, a ``Table`` of (n, 3), or a function of s that returns (n, 3);
    ``frame`` "fixed" or "section".
    """

    force: Varying
    frame: str = "fixed"

    def __post_init__(self) -> None:
        profile.vector("line_force.force", self.force, "N/m")
        frame = checks.choice("line_force.frame", self.frame, ("fixed", "section"))
        assign(self, force=profile.frozen(self.force), frame=frame)

    def add_distributed(self, total: Distributed, s: Array, rod: Rod) -> None:
        values = profile.vector("line_force.force", self.force, "N/m")(s)
        if self.frame == "fixed":
            total.a += values
        else:
            total.b += values

    @property
    def varying(self) -> tuple[Varying, ...]:
        return (self.force,)


@description
class LineCouple(Load):
    """A couple per length, dead or turning with the section. Neither is conservative in three dimensions.

        l = couple(s)   (frame="fixed"),     l = R couple(s)   (frame="section")

    Arguments: ``couple`` in N m/m: three numbers, a ``Table`` of (n, 3), or a function of s that returns (n, 3);
    ``frame`` "fixed" or "section".
    """

    couple: Varying
    frame: str = "fixed"

    def __post_init__(self) -> None:
        profile.vector("line_couple.couple", self.couple, "N")
        frame = checks.choice("line_couple.frame", self.frame, ("fixed", "section"))
        assign(self, couple=profile.frozen(self.couple), frame=frame)

    def add_distributed(self, total: Distributed, s: Array, rod: Rod) -> None:
        values = profile.vector("line_couple.couple", self.couple, "N")(s)
        if self.frame == "fixed":
            total.la += values
        else:
            total.lb += values

    @property
    def varying(self) -> tuple[Varying, ...]:
        return (self.couple,)


@description
class Rotation(Load):
    """The centrifugal force on a filament that turns steadily with its clamp, seen in the turning frame.

        f = rho A (|omega|^2 1 - omega omega^T) (r - point)

    Arguments: ``omega`` (3,) in rad/s, fixed (that is: turning) frame; ``point`` (3,) in m, any point of the axis.
    The section's own rotary inertia, smaller by (radius / length)^2, is left out. Conservative.
    """

    omega: Any
    point: Any = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        omega = checks.vector("rotation.omega", self.omega, "rad/s")
        assign(self, omega=omega, point=checks.vector("rotation.point", self.point, "m"))

    def add_distributed(self, total: Distributed, s: Array, rod: Rod) -> None:
        w = np.array(self.omega)
        C = rod.mass(s, "Rotation")[:, None, None] * ((w @ w) * np.eye(3) - np.outer(w, w))
        total.C += C
        total.a -= C @ np.array(self.point)


@description
class ElectricField(Load):
    """The force of a uniform electric field on a charged filament; the charges' action on each other is left out.

        f = charge_per_length(s) field

    Arguments: ``field`` (3,) in V/m, fixed frame; ``charge_per_length`` in C/m: a number, a ``Table`` or a function
    of s, of either sign. Conservative.
    """

    field: Any
    charge_per_length: Varying

    def __post_init__(self) -> None:
        self._charge()
        assign(
            self,
            field=checks.vector("electric_field.field", self.field, "V/m"),
            charge_per_length=profile.frozen(self.charge_per_length),
        )

    def _charge(self) -> profile.Profile:
        return profile.scalar("electric_field.charge_per_length", self.charge_per_length, "C/m", "any")

    def add_distributed(self, total: Distributed, s: Array, rod: Rod) -> None:
        total.a += self._charge()(s)[:, None] * np.array(self.field)

    @property
    def varying(self) -> tuple[Varying, ...]:
        return (self.charge_per_length,)


@description
class EndForce(Load):
    """A dead force on an end: n(L) = force at the end, n(0) = -force at the start. Conservative.

    Arguments: ``force`` (3,) in N, fixed frame; ``at`` "end" or "start".
    """

    force: Any
    at: str = "end"

    def __post_init__(self) -> None:
        force = checks.vector("end_force.force", self.force, "N")
        assign(self, force=force, at=checks.choice("end_force.at", self.at, ENDS))

    def add_end(self, at: str, total: EndLoad) -> None:
        if at == self.at:
            total.force = total.force + np.array(self.force)

    @property
    def place(self) -> str:
        return self.at


@description
class EndMoment(Load):
    """A dead moment on an end: m(L) = moment at the end, m(0) = -moment at the start.

    A moment whose direction stays fixed in space while the end turns in three dimensions is not conservative: its work
    depends on the order of the turns (H. Ziegler, Principles of Structural Stability, 1968, sec. 5.1). It is where the
    end can only turn about the moment's own axis, as in the plane.

    Arguments: ``moment`` (3,) in N m, fixed frame; ``at`` "end" or "start".
    """

    moment: Any
    at: str = "end"

    def __post_init__(self) -> None:
        moment = checks.vector("end_moment.moment", self.moment, "N m")
        assign(self, moment=moment, at=checks.choice("end_moment.at", self.at, ENDS))

    def add_end(self, at: str, total: EndLoad) -> None:
        if at == self.at:
            total.moment = total.moment + np.array(self.moment)

    @property
    def place(self) -> str:
        return self.at


def breaks_of(load: Load) -> tuple[float, ...]:
    """Return the arc lengths at which a load's table has a kink or a knot."""
    return tuple(s for value in load.varying if isinstance(value, Table) for s in value.s)
