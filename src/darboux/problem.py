"""The problem: a rod, what holds its ends, what acts on it."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterable
from dataclasses import field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux import above, checks, frames
from darboux.checks import ONE_PLACE, Vector, assign, description
from darboux.errors import InvalidInput
from darboux.loads import Distributed, EndLoad, LineCouple, LineForce, Load, breaks_of
from darboux.profile import Table
from darboux.rod import Rod
from darboux.supports import Clamped, Free, Support

Array = NDArray[np.float64]

STEEP_SAMPLES = 2048
STEEP = 0.02  # of the largest value, between two samples
BISECTIONS = 42  # after which an interval between samples is rounding
MOST_ROWS = 400  # of tables: denser ones are not followed from row to row, but averaged


@description
class Equilibrium:
    """The static problem of one filament.

        n' + f = 0,   m' + r' x n + l = 0

    Arguments: ``rod`` a ``Rod``; ``start`` and ``end`` the supports at s = 0 and s = length; ``loads`` a sequence of
    loads; ``between`` the supports between the ends, by their s in m, as in ``{0.1: Pinned((0, 0, 0.1))}``: what they hold is
    the rod's point at that s. Raises ``InvalidInput`` where nothing holds the rod or a load acts on a held end.
    """

    rod: Rod
    start: Any = Clamped()
    end: Any = Free()
    loads: Any = ()
    between: Any = ()

    def __post_init__(self) -> None:
        checks.instance("problem.rod", self.rod, Rod, "a Rod")
        for name in ("start", "end"):
            checks.instance(f"problem.{name}", getattr(self, name), Support, "a support, such as Clamped() or Free()")
        loads = (self.loads,) if isinstance(self.loads, Load) else self.loads
        if not isinstance(loads, list | tuple):
            raise InvalidInput(
                f"problem.loads is {checks.shown(loads)}; it must be a list of loads, such as [Gravity()]."
            )
        for i, load in enumerate(loads):
            checks.instance(f"loads[{i}]", load, Load, "a load, such as Gravity() or EndForce((0, 0, -1))")
        assign(self, loads=tuple(loads), between=self._checked_between())
        self._check_supports()
        self._check_loads()
        self._check_motions()

    def _checked_between(self) -> tuple[tuple[float, Support], ...]:
        between = dict(self.between) if isinstance(self.between, dict | tuple) else None
        if between is None:
            raise InvalidInput(
                f"problem.between is {checks.shown(self.between)}; it must be supports by their s, such as "
                "{0.1: Pinned((0, 0, 0.1))}."
            )
        result: list[tuple[float, Support]] = []
        for place, support in between.items():
            s = checks.number("problem.between", place, "m")
            checks.instance(f"problem.between[{s:g}]", support, Support, "a support, such as Pinned((0, 0, 0.1))")
            if not self._is_between(s):
                raise InvalidInput(
                    f"problem.between has a support at s = {s:g} m, but the rod runs from 0 to {self.rod.length:g} m; a support "
                    "of an end is start or end."
                )
            if not support.holds:
                raise InvalidInput(f"problem.between[{s:g}] is Free(), which holds nothing; leave it out.")
            if any(self._is_same(s, other) for other, _ in result):
                raise InvalidInput(
                    f"problem.between has two supports at s = {s:g} m, apart by rounding; give one that holds what both hold."
                )
            result.append((s, support))
        return tuple(sorted(result, key=lambda pair: pair[0]))

    def _is_between(self, s: float) -> bool:
        """Whether a place in m is between the ends, farther from them than rounding."""
        return 0.0 < s < self.rod.length and not (self._is_same(s, 0.0) or self._is_same(s, self.rod.length))

    def _is_same(self, a: float, b: float) -> bool:
        """Whether two places in m are the same but for rounding."""
        return abs(a - b) <= ONE_PLACE * self.rod.length

    @property
    def supports(self) -> tuple[tuple[float, Support], ...]:
        """All that holds the rod: (s in m, support), the ends first."""
        ends = ((0.0, self.start), (self.rod.length, self.end))
        return tuple((s, support) for s, support in (*ends, *self.between) if support.holds)

    def _check_supports(self) -> None:
        if not self.supports:
            raise InvalidInput(
                "problem.start and problem.end are both Free(); nothing holds the rod in place. Clamp one end."
            )
        pinned = sorted((s, support.position) for s, support in self.supports if all(support.held_displacement))
        for (a, here), (b, there) in itertools.pairwise(pinned if not self.rod.stretch else []):
            distance = float(np.linalg.norm(np.array(there) - np.array(here)))
            if distance > (b - a) * (1.0 + 1e-12):
                ends = (a, b) == (0.0, self.rod.length)
                what = "the ends are" if ends else f"the supports at s = {a:g} and {b:g} m are"
                rod = f"the rod is {self.rod.length:g} m" if ends else f"the rod between them is {b - a:g} m"
                raise InvalidInput(
                    f"problem: {what} {distance:g} m apart, but {rod} long and does not stretch. Move them closer or set "
                    "stretch=True."
                )

    @property
    def _drawn_back(self) -> bool:
        """True where a load may hold the rod in place."""
        return any(load.may_hold for load in self.loads)

    def _check_motions(self) -> None:
        """Refuse supports that leave the rod a rigid translation that nothing draws back."""
        held = []
        for _, support in self.supports:
            if support.linear is not None:
                held += list(np.array(support.linear))
            held += [support.displacement_axes[:, i] for i in range(3) if support.held_displacement[i]]
        directions = np.linalg.svd(np.array(held).reshape(-1, 3))[2] if held else np.eye(3)
        rank = int(np.linalg.matrix_rank(np.array(held).reshape(-1, 3))) if held else 0
        if rank < 3 and not self._drawn_back:
            free = directions[rank]
            free = free * np.sign(free[np.argmax(np.abs(free))])
            raise InvalidInput(
                f"problem.start={_named(self.start)}, problem.end={_named(self.end)}: nothing stops the rod from moving along "
                f"({', '.join(f'{x + 0.0:.3g}' for x in free)}). Hold it there, as by a Clamped or Pinned end, a Spring or a "
                "Foundation."
            )

    def _check_loads(self) -> None:
        ends = {"start": self.start, "end": self.end}
        for i, load in enumerate(self.loads):
            if load.station is not None and not self._is_between(load.station):
                where = "starts at 0" if load.station <= 0.0 else f"ends at {self.rod.length:g}"
                raise InvalidInput(
                    f"loads[{i}].at is {load.station:g} m, but the rod {where} m; a load on an end is an EndForce or EndMoment."
                )
            if load.place is not None and ends[load.place].clamps:
                raise InvalidInput(
                    f"loads[{i}] acts on the rod's {load.place}, which is clamped: it would only add to the reaction. "
                    f"{self._advice(load.place)}"
                )
            for table in (value for value in load.varying if isinstance(value, Table)):
                if (
                    abs(table.s[0]) > 1e-12 * self.rod.length
                    or abs(table.s[-1] - self.rod.length) > 1e-9 * self.rod.length
                ):
                    raise InvalidInput(
                        f"loads[{i}] has a Table from s = {table.s[0]:g} to {table.s[-1]:g} m, but the rod runs from 0 to "
                        f"{self.rod.length:g} m; give values from end to end."
                    )
        self.distributed(np.linspace(0.0, self.rod.length, 17))

    def _advice(self, place: str) -> str:
        other = "start" if place == "end" else "end"
        if getattr(self, other).holds:
            return "Leave it out, or free the end."
        return f"Put it on the free end with at='{other}', or leave it out."

    def distributed(self, s: Array) -> Distributed:
        """Return the sum of the loads per length at s (n,)."""
        total = Distributed.zero(len(s))
        for load in self.loads:
            load.add_distributed(total, s, self.rod)
        return total

    def end_load(self, at: str) -> EndLoad:
        """Return the sum of the loads on the end ``at``, "start" or "end"."""
        total = EndLoad()
        for load in self.loads:
            load.add_end(at, total)
        return total

    @cached_property
    def points(self) -> dict[float, EndLoad]:
        """The loads at points between the ends: by s in m, ascending, the sum of what acts there."""
        result: dict[float, EndLoad] = {}
        for load in sorted((load for load in self.loads if load.station is not None), key=lambda load: load.station):
            place = self._among(load.station, (*dict(self.between), *result))
            load.add_point(result.setdefault(place, EndLoad()))
        return result

    def point_of(self, load: Load) -> float | None:
        """Return at which of the points a load acts, by s in m, or None."""
        return None if load.station is None else self._among(load.station, self.points)

    def _among(self, s: float, places: Iterable[float]) -> float:
        """Return the one of the places that is the same as s but for rounding, or s."""
        return next((place for place in places if self._is_same(s, place)), s)

    @cached_property
    def stations(self) -> dict[float, tuple[Support, EndLoad]]:
        """The places between the ends where a support holds the rod or a point load acts: by s in m, ascending."""
        between = dict(self.between)
        places = sorted({*between, *self.points})
        return {s: (between.get(s, Free()), self.points.get(s, EndLoad())) for s in places}

    def potential(self, s: Array, r: Array) -> Array:
        """Return the potential of the loads per length (n,) in J/m at s (n,) and r (n, 3)."""
        return sum((load.potential(s, r, self.rod) for load in self.loads), np.zeros(len(s)))

    @property
    def of_shape(self) -> tuple[LineForce | LineCouple, ...]:
        """The loads that are functions of the shape."""
        return tuple(load for load in self.loads if load.of_shape)

    @property
    def frame_spins(self) -> tuple[Vector, ...]:
        """The angular velocities (3,) in rad/s of the frames in which loads have all seen."""
        return tuple(load.frame_spin for load in self.loads if load.frame_spin is not None)

    @property
    def link(self) -> float | None:
        """The link in turns after which the end meets the start, as in a ``Ring``; None where the rod has two ends."""
        return None

    @property
    def closed(self) -> bool:
        """True where the rod's end meets its start."""
        return self.link is not None

    def with_load(self, load: Load) -> Equilibrium:
        """Return the problem with one more load."""
        return dataclasses.replace(self, loads=(*self.loads, load))

    def with_rod(self, **changes: Any) -> Equilibrium:
        """Return the problem with a changed rod, as in ``problem.with_rod(stretch=True)``."""
        return dataclasses.replace(self, rod=dataclasses.replace(self.rod, **changes))

    def to_toml(self, path: Any, method: Any = None) -> None:
        """Write the problem, and the method where one is given, as a scenario file; ``darboux.load`` reads it back equal.

        Raises ``InvalidInput`` where a part is a Python function, which no file can hold.
        """
        above.call("to_toml", self, path, method)

    def _repr_html_(self) -> str:
        return above.call("page", self)

    @property
    def uniform(self) -> bool:
        """True where no stiffness, natural shape or load varies along s."""
        return self.rod.uniform and not any(load.varies for load in self.loads)

    @property
    def steep_places(self) -> tuple[float, ...]:
        """The arc lengths in m at which a load, a stiffness, the mass or the natural shape jumps or nearly does, to L / 2048."""
        return self._steep[0]

    @property
    def jumps(self) -> tuple[float, ...]:
        """Those of the steep places at which something jumps."""
        return self._steep[1]

    @cached_property
    def _steep(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        if self.uniform:
            return (), ()
        s: Array = (np.arange(STEEP_SAMPLES, dtype=float) + 0.5) * (self.rod.length / STEEP_SAMPLES)
        columns = self._columns(s)
        largest = np.max(np.abs(columns), axis=0)
        unit = np.where(largest > 0.0, largest, 1.0)
        steep = np.any(np.abs(np.diff(columns, axis=0)) > STEEP * unit, axis=1)
        low, high = s[:-1][steep], s[1:][steep]
        at_low, at_high = columns[:-1][steep], columns[1:][steep]
        for _ in range(BISECTIONS if len(low) else 0):  # towards the side that changes more
            middle = 0.5 * (low + high)
            at_middle = self._columns(middle)
            changes = [np.max(np.abs(at_middle - side) / unit, axis=1) for side in (at_low, at_high)]
            left = changes[0] > changes[1]
            high, at_high = np.where(left, middle, high), np.where(left[:, None], at_middle, at_high)
            low, at_low = np.where(left, low, middle), np.where(left[:, None], at_low, at_middle)
        jumps = high[np.any(np.abs(at_high - at_low) > 0.5 * STEEP * unit, axis=1)]
        return tuple(high.tolist()), tuple(jumps.tolist())

    def _columns(self, s: Array) -> Array:
        """Return all that varies along the rod, side by side."""
        loads, C, mass = self.distributed(s), self.rod.compliance(s), self.rod.stiffness(s).mass
        weight = np.zeros((len(s), 1)) if mass is None else mass[:, None]
        return np.concatenate([loads.a, loads.b, loads.la, loads.lb, self.rod.k0(s), C.reshape(-1, 36), weight], axis=1)

    @cached_property
    def breaks(self) -> tuple[float, ...]:
        """The arc lengths in m, between the ends, at which a table has a kink or a knot, or a station is."""
        inner = {s for load in self.loads for s in breaks_of(load) if 0.0 < s < self.rod.length}
        return tuple(sorted(inner.union(self.rod.breaks, self.stations)))

    @property
    def dense(self) -> bool:
        """True where tables have so many rows that methods average them."""
        return len(self.breaks) > MOST_ROWS


@description
class Ring(Equilibrium):
    """A rod closed to a ring: its end meets its start, in place and frame, after a given link.

        r(L) = r(0),   R(L) = R(0) turned about d3 by 2 pi link,   link = twist + writhe

    The section at s = 0 is held at ``start``'s place and frame; without loads that costs nothing, as no force is needed
    there. With loads the reaction, the sum of ``reactions.start`` and ``reactions.end``, says what held it. A link that is not
    whole glues the ends at an angle. In a ``Motion`` nothing holds that section. Contact of the rod with itself is left out, so
    a ring may pass through itself: its link is then another one.

    Arguments: ``rod``; ``link`` in turns, of either sign; ``start`` a ``Clamped``; ``loads`` and ``between`` as in
    ``Equilibrium``. Raises ``InvalidInput``.
    """

    link: float = 0.0
    end: Any = field(init=False, default=Free())

    def __post_init__(self) -> None:
        checks.instance("ring.start", self.start, Clamped, "a Clamped, which holds the section at s = 0")
        link = checks.number("ring.link", self.link, "turns")
        checks.instance("problem.rod", self.rod, Rod, "a Rod")
        end = Clamped(self.start.position, frame=self.start.R, twist=self.start.twist + frames.turn * link)
        assign(self, link=link, end=end)
        super().__post_init__()


def _named(support: Support) -> str:
    return f"{type(support).__name__}()"
