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

from darboux import checks, frames, profile
from darboux.checks import Vector, assign, description
from darboux.errors import InvalidInput
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

    def potential(self, r: Array, datum: Array) -> Array:
        """-(a + C r0).(r - r0) - 1/2 (r - r0).C (r - r0), zero at r0 = ``datum`` (n, 3): (n,) in J/m, without b, la and lb."""
        u = r - datum
        force = self.a + np.einsum("nij,nj->ni", self.C, datum + 0.5 * u)
        return -np.asarray(np.einsum("ni,ni->n", force, u))


@dataclass
class EndLoad:
    """The sum of the loads on one end or point: force (3,) in N and moment (3,) in N m.

    The dead ones in the fixed frame; the followers, ``section_force`` and ``section_moment``, in the section's.
    ``eccentric`` (3, 3) in N m is the sum A of F e^T, of the dead forces F that act at r + R e.
    """

    force: Array = field(default_factory=lambda: np.zeros(3))
    moment: Array = field(default_factory=lambda: np.zeros(3))
    section_force: Array = field(default_factory=lambda: np.zeros(3))
    section_moment: Array = field(default_factory=lambda: np.zeros(3))
    eccentric: Array = field(default_factory=lambda: np.zeros((3, 3)))

    def force_at(self, R: Array) -> Array:
        """Return the force (3,) in N on a section of the frame R (3, 3), fixed frame."""
        return np.asarray(self.force + R @ self.section_force)

    def moment_at(self, R: Array) -> Array:
        """Return the moment (3,) in N m about the section's centre: (R e) x F is the sum of d_i x A_i, A_i the columns of A."""
        dead = self.moment + np.sum(np.cross(R.T, self.eccentric.T), axis=0)
        return np.asarray(dead + R @ self.section_moment)

    def moment_by_turn(self, R: Array) -> Array:
        """Return dM/dphi (3, 3) of that moment, R -> exp([phi]_x) R: R A^T - tr(R A^T) - [R section_moment]_x.

        Its symmetric part, that of the eccentric forces alone, is minus the second derivative of their potential.
        """
        arms = R @ self.eccentric.T
        return np.asarray(arms - np.trace(arms) * np.eye(3) - np.cross(R @ self.section_moment, np.eye(3)).T)

    def potential(self, r: Array, R: Array) -> float:
        """Return -F.r - R : A in J at r (3,) and the frame R (3, 3), without moments and followers."""
        return -float(self.force @ r + np.sum(R * self.eccentric))


class Load:
    """What every load offers; most add to one of the three."""

    def add_distributed(self, total: Distributed, s: Array, rod: Rod) -> None:
        """Add this load's part per length at s (n,)."""

    def add_end(self, at: str, total: EndLoad) -> None:
        """Add this load's part at the end ``at``, "start" or "end"."""

    def datum(self, s: Array) -> Array:
        """Return where the potential per length is zero, the fixed frame's origin unless the load has a rest: (n, 3) in m."""
        return np.zeros((len(s), 3))

    def potential(self, s: Array, r: Array, rod: Rod) -> Array:
        """Return the potential (n,) in J/m of the load per length at s (n,) and r (n, 3)."""
        own = Distributed.zero(len(s))
        self.add_distributed(own, s, rod)
        return own.potential(r, self.datum(s))

    @property
    def varying(self) -> tuple[Varying, ...]:
        """The load's own quantities that may vary along s."""
        return ()

    @property
    def varies(self) -> bool:
        """True where the load per length varies along s by more than the rod's own data."""
        return any(callable(value) for value in self.varying)

    @property
    def place(self) -> str | None:
        """The end that the load acts on, or None for a load along the rod."""
        return None

    @property
    def station(self) -> float | None:
        """The s in m between the ends that the load acts on, or None."""
        return None

    @property
    def of_shape(self) -> bool:
        """True where the load is a function of s, r and R."""
        return False

    @property
    def may_hold(self) -> bool:
        """True where the load may hold the rod in place."""
        return self.of_shape

    @property
    def frame_spin(self) -> Vector | None:
        """The angular velocity (3,) in rad/s of the frame in which the load has all seen, or None."""
        return None

    def add_point(self, total: EndLoad) -> None:
        """Add this load's part at its point."""


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


class _Spread(Load):
    """A force or a couple per length: given along s, or as a function of the shape."""

    field_name = ""
    unit = ""
    is_couple = False
    frame: str
    gradient: Any

    def _value(self) -> Any:
        raise NotImplementedError

    def _check(self) -> None:
        name = self.field_name.split(".")[1]
        if self.of_shape:
            if self.frame != "fixed":
                raise InvalidInput(
                    f"{self.field_name} is a function of s, r, R, and frame is {self.frame!r}; such a function returns fixed "
                    "components: turn them by R itself, and leave frame out."
                )
        else:
            if self.gradient is not None:
                raise InvalidInput(f"{self.field_name} does not depend on r or R, so it has no gradient; leave it out.")
            profile.vector(self.field_name, self._value(), self.unit)
            assign(self, **{name: profile.frozen(self._value())})
        assign(self, frame=checks.choice(f"{self.field_name.split('.')[0]}.frame", self.frame, ("fixed", "section")))

    @property
    def of_shape(self) -> bool:
        return profile.arguments_of(self._value()) == 3

    def at_shape(self, s: Array, r: Array, R: Array) -> Array:
        """Return the function's values (n, 3) at s (n,), r (n, 3), R (n, 3, 3)."""
        return profile.evaluate(self.field_name, lambda s: self._value()(s, r.copy(), R.copy()), s, (3,))

    def gradients(self, s: Array, r: Array, R: Array, length: float) -> tuple[Array, Array]:
        """Return the derivatives (n, 3, 3) by r and by a small rotation of the section's frame, given or by differences."""
        if self.gradient is not None:
            by_r, by_turn = self.gradient(s, r.copy(), R.copy())
            return checks.array(f"{self.field_name} gradient by r", by_r, (len(s), 3, 3)), checks.array(
                f"{self.field_name} gradient by rotation", by_turn, (len(s), 3, 3)
            )
        by_r, by_turn = np.empty((len(s), 3, 3)), np.empty((len(s), 3, 3))
        for k in range(3):
            e = np.zeros(3)
            e[k] = 1e-6
            ahead, behind = (self.at_shape(s, r + sign * length * e, R) for sign in (1.0, -1.0))
            by_r[:, :, k] = (ahead - behind) / (2e-6 * length)
            ahead, behind = (self.at_shape(s, r, R @ frames.small_rotation(sign * e)) for sign in (1.0, -1.0))
            by_turn[:, :, k] = (ahead - behind) / 2e-6
        return by_r, by_turn

    @property
    def varying(self) -> tuple[Varying, ...]:
        return () if self.of_shape else (self._value(),)


@description
class LineForce(_Spread):
    """A force per length: dead, turning with the section, or any function of the shape.

        f = force(s)   (frame="fixed"),     f = R force(s)   (frame="section": a follower, not conservative in general),
        f = force(s, r, R)

    Arguments: ``force`` in N/m: three numbers, a ``Table`` of (n, 3), a function of s (n,) that returns (n, 3), or a
    function of s (n,), r (n, 3) in m and R (n, 3, 3) that returns (n, 3) in the fixed frame; ``frame`` "fixed" or
    "section"; ``gradient``, for the last kind, a function of s, r, R that returns the derivatives (n, 3, 3) by r and by
    phi, a small rotation in the section's frame (dR = R [phi x]); without it they are taken by differences.
    """

    force: Varying
    frame: str = "fixed"
    gradient: Any = None

    field_name = "line_force.force"
    unit = "N/m"

    def __post_init__(self) -> None:
        self._check()

    def _value(self) -> Any:
        return self.force

    def add_distributed(self, total: Distributed, s: Array, rod: Rod) -> None:
        if self.of_shape:
            return
        values = profile.vector(self.field_name, self.force, self.unit)(s)
        if self.frame == "fixed":
            total.a += values
        else:
            total.b += values


@description
class LineCouple(_Spread):
    """A couple per length: dead, turning with the section, or any function of the shape. Not conservative in 3-D.

        l = couple(s)   (frame="fixed"),     l = R couple(s)   (frame="section"),     l = couple(s, r, R)

    Arguments: ``couple`` in N m/m, ``frame`` and ``gradient`` as in ``LineForce``.
    """

    couple: Varying
    frame: str = "fixed"
    gradient: Any = None

    field_name = "line_couple.couple"
    unit = "N"
    is_couple = True

    def __post_init__(self) -> None:
        self._check()

    def _value(self) -> Any:
        return self.couple

    def add_distributed(self, total: Distributed, s: Array, rod: Rod) -> None:
        if self.of_shape:
            return
        values = profile.vector(self.field_name, self.couple, self.unit)(s)
        if self.frame == "fixed":
            total.la += values
        else:
            total.lb += values


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

    def datum(self, s: Array) -> Array:
        return np.tile(self.point, (len(s), 1))

    @property
    def frame_spin(self) -> Vector:
        return self.omega  # type: ignore[no-any-return]


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
class Foundation(Load):
    """An elastic foundation (Winkler): every point of the rod is drawn back to its place on a straight line.

        f = -stiffness (r - point - s direction)

    Arguments: ``stiffness`` in N/m^2, one number or a symmetric matrix (3, 3) in the fixed frame, not negative;
    ``point`` (3,) in m and ``direction`` (3,) the line on which the foundation is at rest. Conservative.
    """

    stiffness: Any
    point: Any = (0.0, 0.0, 0.0)
    direction: Any = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        assign(
            self,
            stiffness=checks.stiffness_matrix("foundation.stiffness", self.stiffness, "N/m^2"),
            point=checks.vector("foundation.point", self.point, "m"),
            direction=checks.direction("foundation.direction", self.direction),
        )

    def add_distributed(self, total: Distributed, s: Array, rod: Rod) -> None:
        K = np.array(self.stiffness)
        total.C -= K
        total.a += self.datum(s) @ K

    def datum(self, s: Array) -> Array:
        return np.asarray(np.array(self.point) + s[:, None] * np.array(self.direction))

    @property
    def may_hold(self) -> bool:
        return True

    @property
    def varies(self) -> bool:
        return True


@description
class Buoyancy(Load):
    """The lift of a fluid at rest, with the hydrostatic pressure on the rod's side put into an effective force.

        f = -rho_f A g,     n = n_wall + p A d3

    The inner force that is solved for is then the effective one: the force in the wall is n - p A d3, with the fluid's
    pressure p at the section; at an end that the fluid reaches, the end cap's own pressure p A closes the balance and the
    effective force is what the support or the end load gives. Exact for a section that does not vary.

    Arguments: ``density`` rho_f of the fluid in kg/m^3; ``area`` A of the displaced section in m^2, which may be left
    out where the section has a shape; ``g`` (3,) in m/s^2. Conservative.
    Source: C. P. Sparks, J. Energy Resour. Technol. 106 (1984) 46.
    """

    density: float
    area: float | None = None
    g: Any = (0.0, 0.0, -9.81)

    def __post_init__(self) -> None:
        area = None if self.area is None else checks.positive("buoyancy.area", self.area, "m^2")
        density = checks.positive("buoyancy.density", self.density, "kg/m^3")
        assign(self, density=density, area=area, g=checks.vector("buoyancy.g", self.g, "m/s^2"))

    def add_distributed(self, total: Distributed, s: Array, rod: Rod) -> None:
        A = np.full(len(s), self.area) if self.area is not None else rod.displaced_area(s)
        total.a -= self.density * A[:, None] * np.array(self.g)


class _Concentrated(Load):
    """A force or a moment at one place, dead or turning with the section."""

    at: Any
    follower: bool
    offset: Any = (0.0, 0.0, 0.0)

    def _add(self, total: EndLoad) -> None:
        raise NotImplementedError

    def add_end(self, at: str, total: EndLoad) -> None:
        if at == self.at:
            self._add(total)

    def add_point(self, total: EndLoad) -> None:
        self._add(total)


def _force_on(total: EndLoad, force: Any, follower: bool, offset: Any) -> None:
    if follower:
        total.section_force = total.section_force + np.array(force)
        total.section_moment = total.section_moment + np.cross(offset, force)
    else:
        total.force = total.force + np.array(force)
        total.eccentric = total.eccentric + np.outer(force, offset)


def _moment_on(total: EndLoad, moment: Any, follower: bool) -> None:
    if follower:
        total.section_moment = total.section_moment + np.array(moment)
    else:
        total.moment = total.moment + np.array(moment)


@description
class EndForce(_Concentrated):
    """A force on an end: n(L) = force at the end, n(0) = -force at the start.

    With an ``offset`` e it acts at r + R e, eccentrically: its moment about the section's centre is (R e) x force.

    Arguments: ``force`` (3,) in N, fixed frame; ``at`` "end" or "start"; ``follower`` whether it turns with the section
    (then ``force`` is in the section's frame, (0, 0, -P) a thrust along the rod); ``offset`` e (3,) in m, in the section's
    frame, from its centre to the point of action. A dead force is conservative, with the potential -force . (r + R e); a
    follower force is not.
    """

    force: Any
    at: str = "end"
    follower: bool = False
    offset: Any = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        force = checks.vector("end_force.force", self.force, "N")
        follower = checks.flag("end_force.follower", self.follower)
        offset = checks.vector("end_force.offset", self.offset, "m")
        at = checks.choice("end_force.at", self.at, ENDS)
        assign(self, force=force, at=at, follower=follower, offset=offset)

    def _add(self, total: EndLoad) -> None:
        _force_on(total, self.force, self.follower, self.offset)

    @property
    def place(self) -> str:
        return self.at


@description
class EndMoment(_Concentrated):
    """A moment on an end: m(L) = moment at the end, m(0) = -moment at the start.

    Three kinds of end moment are told apart (H. Ziegler, Principles of Structural Stability, 1968, sec. 5.1). Dead: its
    axis stays fixed in space; in three dimensions its work depends on the order of the turns, so it is not
    conservative. Follower (tangential): its axis turns with the section; not conservative either. Both are where the
    end can turn only about the moment's own axis, as in the plane. Semi-tangential, half the sum of the two, is
    conservative: apply half of it dead and half as a follower.

    Arguments: ``moment`` (3,) in N m, fixed frame; ``at`` "end" or "start"; ``follower`` whether it turns with the
    section (then ``moment`` is in the section's frame).
    """

    moment: Any
    at: str = "end"
    follower: bool = False

    def __post_init__(self) -> None:
        moment = checks.vector("end_moment.moment", self.moment, "N m")
        follower = checks.flag("end_moment.follower", self.follower)
        assign(self, moment=moment, at=checks.choice("end_moment.at", self.at, ENDS), follower=follower)

    def _add(self, total: EndLoad) -> None:
        _moment_on(total, self.moment, self.follower)

    @property
    def place(self) -> str:
        return self.at


@description
class PointForce(_Concentrated):
    """A force at a given s: the inner force jumps by it, n(s+) = n(s-) - force.

    With an ``offset`` e the inner moment jumps too, m(s+) = m(s-) - (R e) x force.

    Arguments: ``force`` (3,) in N; ``at`` s in m, strictly between the ends; ``follower`` and ``offset`` (3,) in m as in
    ``EndForce``.
    """

    force: Any
    at: float
    follower: bool = False
    offset: Any = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        assign(
            self,
            force=checks.vector("point_force.force", self.force, "N"),
            at=checks.number("point_force.at", self.at, "m"),
            follower=checks.flag("point_force.follower", self.follower),
            offset=checks.vector("point_force.offset", self.offset, "m"),
        )

    def _add(self, total: EndLoad) -> None:
        _force_on(total, self.force, self.follower, self.offset)

    @property
    def station(self) -> float:
        return self.at


@description
class PointMoment(_Concentrated):
    """A couple at a given s: the inner moment jumps by it, m(s+) = m(s-) - moment.

    Arguments: ``moment`` (3,) in N m; ``at`` s in m, strictly between the ends; ``follower`` as in ``EndMoment``, whose
    remarks on conservative kinds hold here too.
    """

    moment: Any
    at: float
    follower: bool = False

    def __post_init__(self) -> None:
        assign(
            self,
            moment=checks.vector("point_moment.moment", self.moment, "N m"),
            at=checks.number("point_moment.at", self.at, "m"),
            follower=checks.flag("point_moment.follower", self.follower),
        )

    def _add(self, total: EndLoad) -> None:
        _moment_on(total, self.moment, self.follower)

    @property
    def station(self) -> float:
        return self.at


def breaks_of(load: Load) -> tuple[float, ...]:
    """Return the arc lengths at which a load's table has a kink or a knot."""
    return tuple(s for value in load.varying if isinstance(value, Table) for s in value.s)
