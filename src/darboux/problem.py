"""The problem: a rod, what holds its ends, what acts on it."""

from __future__ import annotations

import dataclasses
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux import checks
from darboux.checks import assign, description
from darboux.errors import InvalidInput
from darboux.loads import Distributed, EndLoad, Foundation, LineCouple, LineForce, Load, breaks_of
from darboux.profile import Table
from darboux.rod import Rod
from darboux.supports import Clamped, Free, Support

Array = NDArray[np.float64]

STEEP_SAMPLES = 2048
STEEP = 0.02  # of the largest value, between two samples
BISECTIONS = 42  # after which an interval between samples is rounding


@description
class Equilibrium:
    """The static problem of one filament.

        n' + f = 0,   m' + r' x n + l = 0

    Arguments: ``rod`` a ``Rod``; ``start`` and ``end`` the supports at s = 0 and s = length; ``loads`` a sequence of
    loads. Raises ``InvalidInput`` where nothing holds the rod or a load acts on a held end.
    """

    rod: Rod
    start: Any = Clamped()
    end: Any = Free()
    loads: Any = ()

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
        assign(self, loads=tuple(loads))
        self._check_supports()
        self._check_loads()
        self._check_motions()

    def _check_supports(self) -> None:
        if not (self.start.holds or self.end.holds):
            raise InvalidInput(
                "problem.start and problem.end are both Free(); nothing holds the rod in place. "
                "Clamp one end, as in start=Clamped()."
            )
        if all(self.start.held_displacement) and all(self.end.held_displacement) and not self.rod.stretch:
            distance = float(np.linalg.norm(np.array(self.end.position) - np.array(self.start.position)))
            if distance > self.rod.length * (1.0 + 1e-12):
                raise InvalidInput(
                    f"problem: the ends are {distance:g} m apart, but the rod is {self.rod.length:g} m long and does not "
                    "stretch. Move them closer or set stretch=True."
                )

    @property
    def _drawn_back(self) -> bool:
        """True where a load may hold the rod in place."""
        return any(isinstance(load, Foundation) for load in self.loads) or bool(self.of_shape)

    def _check_motions(self) -> None:
        """Refuse supports that leave the rod a rigid translation that nothing draws back."""
        held = []
        for support in (self.start, self.end):
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
                f"({', '.join(f'{x + 0.0:.3g}' for x in free)}). Hold it there, as by a Clamped() or Pinned() end, a Spring or a "
                "Foundation."
            )

    def _check_loads(self) -> None:
        ends = {"start": self.start, "end": self.end}
        for i, load in enumerate(self.loads):
            if load.station is not None and not 0.0 < load.station < self.rod.length:
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
            load.add_point(result.setdefault(load.station, EndLoad()))
        return result

    @property
    def of_shape(self) -> tuple[LineForce | LineCouple, ...]:
        """The loads that are functions of the shape."""
        return tuple(load for load in self.loads if isinstance(load, LineForce | LineCouple) and load.of_shape)

    def with_load(self, load: Load) -> Equilibrium:
        """Return the problem with one more load."""
        return dataclasses.replace(self, loads=(*self.loads, load))

    def with_rod(self, **changes: Any) -> Equilibrium:
        """Return the problem with a changed rod, as in ``problem.with_rod(stretch=True)``."""
        return dataclasses.replace(self, rod=dataclasses.replace(self.rod, **changes))

    @property
    def uniform(self) -> bool:
        """True where no stiffness, natural shape or load varies along s."""
        return self.rod.uniform and not any(load.varies for load in self.loads)

    @property
    def steep_places(self) -> tuple[float, ...]:
        """The arc lengths in m at which a load, a stiffness or the natural shape jumps or nearly does, to L / 2048."""
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
        loads, C = self.distributed(s), self.rod.compliance(s)
        return np.concatenate([loads.a, loads.b, loads.la, loads.lb, self.rod.k0(s), C.reshape(-1, 36)], axis=1)

    @property
    def breaks(self) -> tuple[float, ...]:
        """The arc lengths in m, between the ends, at which a table of the rod or of a load has a kink or a knot."""
        inner = {s for load in self.loads for s in breaks_of(load) if 0.0 < s < self.rod.length}
        return tuple(sorted(inner.union(self.rod.breaks, self.points)))


def _named(support: Support) -> str:
    return f"{type(support).__name__}()"
