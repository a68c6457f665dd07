"""An equilibrium in numbers: what all methods read, and all that they read, of a rod, its supports and its loads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from darboux.curve import Curve
from darboux.loads import Load
from darboux.packing import coefficients, loads, pendulum
from darboux.packing.cells import Cells
from darboux.packing.coefficients import Table
from darboux.packing.ends import EndConditions
from darboux.packing.laying import laid
from darboux.packing.loads import Group
from darboux.packing.masses import Masses
from darboux.packing.scale import Scale
from darboux.problem import Equilibrium
from darboux.supports import Free

Array = NDArray[np.float64]


class Packing:
    """A problem without dimensions; x = s / L.

    ``scale`` its units; ``start``, ``end`` and ``stations``, with their x, what holds the rod and acts at places; ``columns`` the
    coefficients of the rod equations at any points, ``table`` the same as piecewise polynomials; ``of_shape`` the loads that
    are functions of the shape; ``masses`` what a motion and natural modes need.
    """

    def __init__(self, problem: Equilibrium) -> None:
        self._problem, self.scale = problem, Scale.of(problem)
        L = problem.rod.length
        self.start = EndConditions(problem.start, problem.end_load("start"), -1.0, self.scale)
        self.end = EndConditions(problem.end, problem.end_load("end"), 1.0, self.scale)
        self.stations = [
            (s / L, EndConditions(support, load, 1.0, self.scale)) for s, (support, load) in problem.stations.items()
        ]
        self.masses = Masses(problem.rod)
        self.breaks: Array = np.array(problem.breaks) / L  # where tables have a kink, and stations are

    @property
    def ends(self) -> tuple[EndConditions, EndConditions]:
        """What holds the start and the end."""
        return self.start, self.end

    @property
    def supports(self) -> list[tuple[float, EndConditions]]:
        """What holds the rod, along it."""
        places = [(0.0, self.start), *self.stations, (1.0, self.end)]
        return [(x, conditions) for x, conditions in places if conditions.holds]

    def columns(self, x: Array) -> Array:
        """Return the coefficients of the rod equations at x (n,): (n, WIDTH), or (n, COUPLED_WIDTH)."""
        return coefficients.columns(self._problem, self.scale, x)

    @cached_property
    def table(self) -> Table:
        """The coefficients as piecewise polynomials."""
        return coefficients.table(self._problem, self.scale)

    def cells(self, nodes: Array) -> Cells:
        """Return the edges between nodes x (N + 1,), and their cells."""
        return Cells(self._problem, nodes)

    def laid(self) -> tuple[EndConditions, float, Array]:
        """Return what places the unloaded rod, its x, and how the rod lies: see `laying.laid`."""
        _, place, lie = laid(self._problem)
        return self._holding(place), place, lie

    def released(self, at: Sequence[str]) -> Packing:
        """Return the same without the supports of those ends, "start" and "end", as no problem of statics may be."""
        packing = Packing(self._problem)
        for name in at:
            outward = getattr(packing, name).outward
            setattr(packing, name, EndConditions(Free(), self._problem.end_load(name), outward, self.scale))
        return packing

    def group(self, some: Sequence[Load]) -> Group:
        """Return some of the loads by themselves."""
        return Group(self._problem, self.scale, some)

    @property
    def points(self) -> list[float]:
        """The x at which loads act between the ends."""
        return [s / self.scale.length for s in self._problem.points]

    def at_rest(self) -> tuple[EndConditions, float, Array]:
        """Return the same, but for a pendulum as it hangs: see `pendulum.at_rest`."""
        _, place, lie = pendulum.at_rest(self._problem)
        return self._holding(place), place, lie

    def _holding(self, place: float) -> EndConditions:
        return next(conditions for x, conditions in self.supports if x == place)

    def natural(self, x: Array) -> Array:
        """Return the natural curvature and twist k0 L at x (n,): (n, 3)."""
        return self._problem.rod.k0(x * self.scale.length) * self.scale.length

    @property
    def is_pushed(self) -> bool:
        """Whether two supports hold parts of the rod closer than they are long, which it buckles by, rather than hangs."""
        return coefficients.is_pushed(self._problem)

    @property
    def is_taut(self) -> bool:
        """Whether two supports hold a part of a rod that does not stretch as far apart as it is long."""
        return coefficients.is_taut(self._problem)

    @property
    def is_straight(self) -> bool:
        """Whether supports at both ends hold a rod that does not stretch as far apart as it is long: it has one shape."""
        return coefficients.is_straight(self._problem)

    def lent(self, slack: float) -> float:
        """Return the compliance of stretch that the rod is lent on the way: ``slack`` between two supports, or none."""
        return self.table.lent(slack, self._problem) if len(self.supports) > 1 else 0.0

    def table_and_strain(self, shape: Callable[[Array], Array], knots: Array) -> tuple[Table, Array]:
        """Return the table, and k0 less another shape's curvature and twist: see `coefficients.table_and_strain`."""
        return coefficients.table_and_strain(self._problem, self.scale, shape, knots)

    @cached_property
    def has_potential(self) -> bool:
        """Whether all loads have a potential."""
        return loads.has_potential(self._problem)

    def of_shape(self, x: Array, r: Array, R: Array, slopes: bool = True) -> Array:
        """Return the loads that are functions of the shape at x (n,), r (n, 3), R (n, 3, 3): see `loads.of_shape`."""
        return loads.of_shape(self._problem, self.scale, x, r, R, slopes)

    def elastic_parts(self, curve: Curve) -> tuple[float, float, float] | None:
        """Return the elastic energies where dense tables are averaged, or None: then a solution has its own sum."""
        return coefficients.elastic_parts(self._problem, self.table, curve, self.scale)
