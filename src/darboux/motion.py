"""The motion of one filament: a problem, how it starts, what moves and what brakes it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux import above, checks, frames, profile
from darboux.checks import Vector, assign, description
from darboux.errors import InvalidInput
from darboux.loads import Distributed, EndLoad
from darboux.problem import Equilibrium
from darboux.profile import Table
from darboux.solution import EquilibriumSolution
from darboux.supports import Support

Array = NDArray[np.float64]

SAMPLES = 257  # times at which functions of time are looked at before a run
SAME = 1e-6  # relative to the length: a support and what moves it begin in one place
ROUNDING = 2.0**-52  # of EI / L: the energy of strains that are rounding is its square
SUMMED = 2.0**-36  # of a load's work over the length, which is summed up over the steps


@description
class Moving:
    """How a held end moves: position and orientation as functions of time.

    Arguments: ``position`` a function of t in s that returns (3,) in m, fixed frame; ``frame`` a function of t that
    returns (3, 3), columns d1, d2, d3 (for a clamp). Whichever is None stays as the support has it. Both begin where the
    support is; velocities are their differences.
    """

    position: Any = None
    frame: Any = None

    def __post_init__(self) -> None:
        for name in ("position", "frame"):
            value = getattr(self, name)
            if value is not None and not callable(value):
                raise InvalidInput(f"moving.{name} is {checks.shown(value)}; it must be a function of the time t in s.")
        if self.position is None and self.frame is None:
            raise InvalidInput("moving.position and moving.frame are both missing; give one as a function of the time.")


class Damping:
    """What takes energy from a motion; there is none but what is asked for."""

    power = 0  # of the velocity, by which a fluid drags

    @property
    def slowing(self) -> float:
        """The force against the motion over mass and velocity, in 1/s."""
        return 0.0

    @property
    def times(self) -> Vector:
        """The viscosities over the stiffnesses in bending, twist and stretch, in s."""
        return (0.0, 0.0, 0.0)


@description
class MassDamping(Damping):
    """A force against the motion, proportional to mass: f = -rate rhoA r_t, and likewise for the spin.

    Argument: ``rate`` in 1/s. Free oscillations die out as exp(-rate t / 2).
    """

    rate: float

    def __post_init__(self) -> None:
        assign(self, rate=checks.not_negative("mass_damping.rate", self.rate, "1/s"))

    @property
    def slowing(self) -> float:
        """The rate in 1/s."""
        return self.rate


@description
class KelvinVoigt(Damping):
    """Inner friction: stresses of strain rates.

        m = B (k - k0) + B diag(bending, bending, twist) k_t,     n3 = EA (v3 - 1) + EA stretch v3_t

    Arguments: ``bending``, ``twist`` and ``stretch``, each the viscosity over the stiffness, in s.
    """

    bending: float = 0.0
    twist: float = 0.0
    stretch: float = 0.0

    def __post_init__(self) -> None:
        names = ("bending", "twist", "stretch")
        assign(self, **{n: checks.not_negative(f"kelvin_voigt.{n}", getattr(self, n), "s") for n in names})

    @property
    def times(self) -> Vector:
        """Those of bending, twist and stretch, in s."""
        return (self.bending, self.twist, self.stretch)


class _Drag(Damping):
    """The force of a fluid on the rod's side."""

    along: float
    across: float
    fluid: Any

    def _check(self, name: str, unit: str) -> None:
        for field in ("along", "across"):
            assign(self, **{field: checks.not_negative(f"{name}.{field}", getattr(self, field), unit)})
        if not callable(self.fluid):
            assign(self, fluid=checks.vector(f"{name}.fluid", self.fluid, "m/s"))


@description
class LinearDrag(_Drag):
    """Viscous drag by resistive-force theory, w = r_t - fluid the velocity against the fluid.

        f = -along (w.d3) d3 - across (w - (w.d3) d3)

    Arguments: ``along`` and ``across`` in N s/m^2; ``fluid`` the fluid's velocity in m/s, (3,) or a function of t.
    Source: J. Gray, G. J. Hancock, J. Exp. Biol. 32 (1955) 802.
    """

    along: float
    across: float
    fluid: Any = (0.0, 0.0, 0.0)

    power = 1

    def __post_init__(self) -> None:
        self._check("linear_drag", "N s/m^2")


@description
class QuadraticDrag(_Drag):
    """Drag of a fast flow, each part by the square of its own velocity, w = r_t - fluid.

        f = -along |w_t| w_t - across |w_n| w_n,     w_t = (w.d3) d3,  w_n = w - w_t

    Arguments: ``along`` and ``across`` in N s^2/m^3, such as 1/2 rho_f d C; ``fluid`` as in ``LinearDrag``.
    Source: G. I. Taylor, Proc. R. Soc. A 214 (1952) 158.
    """

    along: float
    across: float
    fluid: Any = (0.0, 0.0, 0.0)

    power = 2

    def __post_init__(self) -> None:
        self._check("quadratic_drag", "N s^2/m^3")


@description
class Motion:
    """The motion of a rod from t = 0 on.

        rhoA r_tt = n' + f,     (J spin d3)_t = m' + r' x n + l

    Arguments: ``problem`` an ``Equilibrium``: the rod (with mass), its supports and loads, or a ``Ring``, which supports between
    its ends hold and nothing else; ``duration`` in s; ``initial`` the shape at the start: "unloaded" (the default: the
    unloaded rod, laid at its support, or the round ring, where its start is), "equilibrium" (the problem's own, found when
    the run begins), an ``EquilibriumSolution`` of the same rod (a ring's: of the same link), or a function of s (n,) that
    returns r (n, 3) in m (a ring's closes, and is twisted evenly by its link less its writhe); ``velocity`` at the start in
    m/s: None (at rest), (3,), or a function of s that returns (n, 3); ``spin`` about the tangent in rad/s, a number or a
    function of s; ``start`` and ``end`` a ``Moving`` where the support moves; ``load_factor`` a number or a function of t
    that multiplies all loads, or a list of them, one for each of ``problem.loads`` (None: 1);
    ``damping`` a sequence of ``MassDamping``, ``KelvinVoigt``, ``LinearDrag``, ``QuadraticDrag``; ``release`` the
    time in s from which on an end is free, as in ``release={"end": 0.2}`` (both ends at 0: free flight);
    ``rotary_inertia`` J per length about the tangent in kg m, a number; None: mass (EI1 + EI2) / EA, which is rho (I1
    + I2) for a section of one material.
    A ``Table`` of times serves as a function of t. With a ``Rotation`` among the loads all is seen in the frame that turns
    with its omega, velocities included, and Coriolis' force acts too. Raises ``InvalidInput``.
    """

    problem: Equilibrium
    duration: float
    initial: Any = "unloaded"
    velocity: Any = None
    spin: Any = 0.0
    start: Any = None
    end: Any = None
    load_factor: Any = None
    damping: Any = ()
    release: Any = ()
    rotary_inertia: float | None = None

    def __post_init__(self) -> None:
        checks.instance("motion.problem", self.problem, Equilibrium, "an Equilibrium")
        assign(self, duration=checks.positive("motion.duration", self.duration, "s"))
        damping = (self.damping,) if isinstance(self.damping, Damping) else self.damping
        if not isinstance(damping, list | tuple):
            raise InvalidInput(
                f"motion.damping is {checks.shown(damping)}; it must be a list, such as [MassDamping(2.0)]."
            )
        for i, part in enumerate(damping):
            checks.instance(f"motion.damping[{i}]", part, Damping, "a damping, such as MassDamping(2.0)")
        assign(self, damping=tuple(damping), release=self._releases(), load_factor=self._checked_factors())
        if self.problem.closed:
            self._check_ring(self.problem)
        if self.rotary_inertia is not None:
            assign(self, rotary_inertia=checks.positive("motion.rotary_inertia", self.rotary_inertia, "kg m"))
        self._check_initial()
        self._check_mass()
        self._check_functions()

    def _releases(self) -> tuple[tuple[str, float], ...]:
        pairs = self.release.items() if isinstance(self.release, dict) else self.release
        try:
            pairs = [(at, time) for at, time in pairs]
        except (TypeError, ValueError):
            raise InvalidInput(
                f"motion.release is {checks.shown(self.release)}; it must name an end and a time, as {{'end': 0.2}}."
            ) from None
        result = []
        for at, time in pairs:
            at = checks.choice("motion.release", at, ("start", "end"))
            result.append((at, checks.not_negative(f"motion.release[{at!r}]", time, "s")))
        return tuple(sorted(result, key=lambda pair: pair[1]))

    def _checked_factors(self) -> Any:
        """Return the load factor, or one for each load."""
        if not isinstance(self.load_factor, list | tuple):
            return _checked_factor("motion.load_factor", self.load_factor)
        loads = len(self.problem.loads)
        if len(self.load_factor) != loads:
            raise InvalidInput(
                f"motion.load_factor has {len(self.load_factor)} factors, but the problem has {loads} loads; give one for each in "
                "their order (None where it does not change), or one for all."
            )
        if not loads:
            return None
        one = (1.0 if factor is None else factor for factor in self.load_factor)
        return tuple(_checked_factor(f"motion.load_factor[{i}]", factor) for i, factor in enumerate(one))

    def _check_ring(self, ring: Equilibrium) -> None:
        """Refuse what needs an end that is held."""
        for name in ("start", "end", "release"):
            if getattr(self, name):
                raise InvalidInput(
                    f"motion.{name} is given, but a Ring is free in motion from the first; leave it out."
                )
        if isinstance(self.initial, EquilibriumSolution):
            link = self.initial.problem.link
            if link != ring.link:
                what = "a rod with two ends" if link is None else f"a Ring with link={link:g}"
                raise InvalidInput(
                    f"motion.initial is the equilibrium of {what}; the motion's is a Ring with link={ring.link:g}, which it keeps."
                )

    def _check_initial(self) -> None:
        rod = self.problem.rod
        if isinstance(self.initial, EquilibriumSolution):
            if self.initial.problem.rod != rod:
                raise InvalidInput("motion.initial is the equilibrium of another rod; solve it for motion.problem.rod.")
        elif self.initial is None:
            assign(self, initial="unloaded")
        elif not callable(self.initial) and not (
            isinstance(self.initial, str) and self.initial in ("unloaded", "equilibrium")
        ):
            raise InvalidInput(
                f"motion.initial is {checks.shown(self.initial)}; it must be 'unloaded', 'equilibrium', an EquilibriumSolution or "
                "a function of s."
            )
        if self.velocity is not None:
            profile.vector("motion.velocity", self.velocity, "m/s")
            assign(self, velocity=profile.frozen(self.velocity))
        profile.scalar("motion.spin", self.spin, "rad/s", "any")

    def _check_mass(self) -> None:
        rod = self.problem.rod
        mass = rod.stiffness(np.linspace(0.0, rod.length, 17)).mass
        field = "material.density" if rod.section.needs_material else "section.mass"
        if mass is None:
            raise InvalidInput(f"{field} is missing; a rod needs mass to move. Give it.")
        if np.any(mass <= 0.0):
            raise InvalidInput(f"{field} is 0; a rod needs mass to move. Give a positive one.")

    def _check_functions(self) -> None:
        for at in ("start", "end"):
            moving, support = getattr(self, at), getattr(self.problem, at)
            if moving is None:
                continue
            checks.instance(f"motion.{at}", moving, Moving, "None or Moving(position=..., frame=...)")
            if not any(support.held_displacement):
                raise InvalidInput(
                    f"motion.{at} moves, but problem.{at} is {type(support).__name__}(), which does not hold it."
                )
            if moving.frame is not None and not all(support.held_rotation):
                raise InvalidInput(
                    f"motion.{at}.frame turns the end, but problem.{at} does not hold its frame; leave frame out."
                )
            gap = np.linalg.norm(self.position(at, 0.0) - np.array(support.position))
            turned = np.max(np.abs(self.frame(at, 0.0) - support.R))
            if gap > SAME * self.problem.rod.length:
                raise InvalidInput(
                    f"motion.{at}.position begins at {checks.shown(self.position(at, 0.0))} m, off the support's place; make both "
                    "agree at t = 0."
                )
            if turned > SAME:
                raise InvalidInput(
                    f"motion.{at}.frame begins turned against the support's frame; make both agree at t = 0."
                )
        for field, function in self._tables():
            if function.s[0] > 0.0 or function.s[-1] < self.duration:
                raise InvalidInput(
                    f"{field} is a table from t = {function.s[0]:g} to {function.s[-1]:g} s; it must reach from 0 to the duration, "
                    f"{self.duration:g} s."
                )
            if field.endswith(".position") and function.jumps:
                raise InvalidInput(
                    f"{field} jumps at t = {function.jumps[0]:g} s; a support moves without jumps. Give a ramp, however steep."
                )
        times = np.linspace(0.0, self.duration, SAMPLES)
        for i in range(len(self.factors)):
            for t in times:
                self.factor(float(t), i)
        self._check_distance(times)

    def _tables(self) -> list[tuple[str, Table]]:
        """Return the tables of times."""
        functions = [(self._name_of_factor(i), factor) for i, factor in enumerate(self.factors)]
        for at in ("start", "end"):
            moving = getattr(self, at)
            functions += [(f"motion.{at}.position", moving.position)] if moving is not None else []
        functions += [
            (f"motion.damping[{i}].fluid", getattr(part, "fluid", None)) for i, part in enumerate(self.damping)
        ]
        return [(field, function) for field, function in functions if isinstance(function, Table)]

    def _check_distance(self, times: Array) -> None:
        problem = self.problem
        both = all(problem.start.held_displacement) and all(problem.end.held_displacement)
        if not both or problem.rod.stretch or (self.start is None and self.end is None):
            return
        for t in times:
            if not (self.held("start", float(t)) and self.held("end", float(t))):
                return
            distance = float(np.linalg.norm(self.position("end", float(t)) - self.position("start", float(t))))
            if distance > problem.rod.length * (1.0 + 1e-9):
                raise InvalidInput(
                    f"motion: at t = {t:g} s the ends are {distance:g} m apart, but the rod is {problem.rod.length:g} m long and "
                    "does not stretch. Move them less or set rod.stretch."
                )

    def _repr_html_(self) -> str:
        return above.call("page", self)

    # -- what is asked at a time ---------------------------------------------------------------------------------

    def position(self, at: str, t: float) -> Array:
        """Return where the support ``at`` is at the time t: (3,) in m."""
        moving = getattr(self, at)
        if moving is None or moving.position is None:
            return np.array(getattr(self.problem, at).position)
        return _vector_at(f"motion.{at}.position", moving.position, t, "m")

    def frame(self, at: str, t: float) -> Array:
        """Return the orientation of the support ``at`` at the time t: (3, 3)."""
        moving = getattr(self, at)
        if moving is None or moving.frame is None:
            support = getattr(self.problem, at)
            return np.asarray(support.R @ frames.rotation(np.array([0.0, 0.0, support.twist])))
        return np.asarray(_at_time(f"motion.{at}.frame", moving.frame, t, checks.rotation))

    @property
    def factors(self) -> tuple[Any, ...]:
        """The factors of time of the loads, in their order: numbers or functions; one where it is that of all."""
        return self.load_factor if isinstance(self.load_factor, tuple) else (self.load_factor,)

    def _name_of_factor(self, i: int) -> str:
        return f"motion.load_factor[{i}]" if isinstance(self.load_factor, tuple) else "motion.load_factor"

    def factor(self, t: float, load: int = 0) -> float:
        """Return the factor of all loads at the time t; of one ``load`` by its number, where each has its own."""
        value = self.factors[load]
        if not callable(value):
            return 1.0 if value is None else float(value)
        return float(_at_time(self._name_of_factor(load), value, t, checks.number))

    @property
    def drags(self) -> tuple[LinearDrag | QuadraticDrag, ...]:
        """The drags among the dampings, each in a fluid of its own."""
        return tuple(part for part in self.damping if part.power)

    def fluids(self, t: float) -> Array:
        """Return the velocities of the fluids of the ``drags`` at the time t: (n, 3) in m/s."""
        named = [(f"motion.damping[{i}].fluid", part) for i, part in enumerate(self.damping) if part in self.drags]
        return np.array(
            [_vector_at(name, part.fluid, t, "m/s") if callable(part.fluid) else part.fluid for name, part in named]
        ).reshape(-1, 3)

    @property
    def least_energy(self) -> float:
        """The energy in J below which a motion is rounding: 2^-52 EI / L + 2^-36 F L, of all loads F at their largest factors."""
        rod, L = self.problem.rod, self.problem.rod.length
        s = np.linspace(0.0, L, 33)
        stiffness = rod.stiffness(s)
        loads = 0.0
        for i, load in enumerate(self.problem.loads):
            own, point, factor = Distributed.zero(len(s)), EndLoad(), i if len(self.factors) > 1 else 0
            load.add_distributed(own, s, rod)
            for at in ("start", "end"):
                load.add_end(at, point)
            if load.station is not None:
                load.add_point(point)
            size = [np.linalg.norm(part, axis=1).mean() * L for part in (own.a * L, own.b * L, own.la, own.lb)]
            size += [np.linalg.norm(own.C, axis=(1, 2)).mean() * L**3]
            size += [np.linalg.norm(part) * L for part in (point.force, point.section_force)]
            size += [np.linalg.norm(part) for part in (point.moment, point.section_moment, point.eccentric)]
            loads += float(np.sum(size)) * max(abs(self.factor(float(t), factor)) for t in self._samples())
        return ROUNDING * float(np.mean(stiffness.EI1 + stiffness.EI2)) / L + SUMMED * loads

    def _samples(self) -> Array:
        """Return times at which functions of time are looked at."""
        return np.linspace(0.0, self.duration, 1 if self.steady else SAMPLES)

    @property
    def steady(self) -> bool:
        """True where neither supports nor loads nor fluids change in time."""
        moving = self.start is not None or self.end is not None or any(map(callable, self.factors))
        return not moving and not any(callable(drag.fluid) for drag in self.drags)

    @property
    def events(self) -> tuple[float, ...]:
        """The times in s, within the duration, at which an end is released."""
        return tuple(t for _, t in self.release if 0.0 < t < self.duration)

    @property
    def jumps(self) -> tuple[float, ...]:
        """The times in s, within the duration, at which a table of times jumps: steps end there."""
        times = {t for _, table in self._tables() for t in table.jumps}
        return tuple(sorted(t for t in times if 0.0 < t < self.duration))

    @property
    def supports(self) -> tuple[tuple[float, Support], ...]:
        """All that holds the rod before an end is released: (s in m, support); of a ring that between its ends."""
        return self.problem.between if self.problem.closed else self.problem.supports

    def held(self, at: str, t: float) -> bool:
        """Return whether the support ``at`` still holds the end just after the time t; a ring's never does."""
        if self.problem.closed:
            return False
        released = any(end == at and time <= t for end, time in self.release)
        return getattr(self.problem, at).holds and not released


def _checked_factor(field: str, factor: Any) -> Any:
    return factor if factor is None or callable(factor) else checks.number(field, factor)


def _vector_at(field: str, function: Callable[[float], Any], t: float, unit: str) -> Array:
    return np.asarray(_at_time(field, function, t, lambda name, value: checks.array(name, value, (3,), unit)))


def _at_time(field: str, function: Callable[[float], Any], t: float, check: Callable[[str, Any], Any]) -> Any:
    """Return a checked value of a user's function of time; what is wrong with it is said with the time."""
    try:
        value = function(t)
    except Exception as error:
        raise InvalidInput(f"{field} failed at t = {t:g} s: {type(error).__name__}: {error}.") from error
    return check(f"{field} at t = {t:g} s", value)
