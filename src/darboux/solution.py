"""What was found: status, shape, inner forces, reactions, energy, and how it was computed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from darboux import above, balance, cable, checks, frames, link, materials, mistakes, stress
from darboux.balance import Balance
from darboux.cable import Cable
from darboux.checks import ONE_PLACE, real_array, rows, shown, whole
from darboux.curve import Curve, Side, gauss_points
from darboux.dataset import dataset
from darboux.errors import InvalidInput, NotConverged
from darboux.modes import Modes
from darboux.problem import Equilibrium
from darboux.stress import LargestStrain, LargestStress, Stress
from darboux.summary import summary, vector

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes

    from darboux.loads import EndLoad

Array = NDArray[np.float64]

SMALL_STRAIN = 0.05  # beyond it linear elasticity and sections that keep their shape are a rough picture
# The next step in Python, by how a solve or a run ended; the command and the page have their own.
ADVICE = {
    "folded": "The last equilibrium is in .solution; solve_all(problem) looks for those at full load, and solve(problem, "
    "start=...) takes a shape to set out from.",
    "no_convergence": "What was reached is in .solution.",
    "stopped": "What was reached is in .solution.",
}
SNAP = 0.25  # of the length: a rod that moves farther where it turns unstable has snapped
CLOSED = 1e-6  # of the length, or rad: a gap between the ends that is none
LIKE = 0.5  # of the moments: two meshes' answers that differ by more are no approximations of one equilibrium
NO_MOMENT = 1e-9  # of EI / L: what rounding leaves of an unbent rod


@dataclass(frozen=True)
class Status:
    """How a solve ended: ``code`` for programs, ``message`` the sentence that a person reads."""

    code: str
    message: str

    @property
    def converged(self) -> bool:
        """True where the equilibrium was found."""
        return self.code == "converged"

    @property
    def next_in_python(self) -> str:
        """The sentence, and the next step for who reads it in Python."""
        return f"{self.message} {ADVICE.get(self.code, '')}".rstrip()


@dataclass(frozen=True)
class Event:
    """What happened while the load grew: ``kind`` "bifurcation", "fold" or "snap".

    ``load_factors`` the part of the load before it and behind it, not a number where it is not known; ``jump`` by how far a point
    of the rod moved in a snap, at most, in m. A bifurcation makes the straight-on branch unstable; a fold ends it.
    """

    kind: str
    load_factors: tuple[float, float]
    jump: float = 0.0


@dataclass(frozen=True)
class Reaction:
    """What a support does to the rod: force (3,) in N and moment (3,) in N m about the end, fixed frame."""

    force: Array
    moment: Array


@dataclass(frozen=True)
class Reactions:
    """The reactions at s = 0 and s = length, zero where an end is free; ``between`` those between the ends, by s in m."""

    start: Reaction
    end: Reaction
    between: dict[float, Reaction] = field(default_factory=dict)


@dataclass(frozen=True)
class Energy:
    """Elastic energy by kind, the energy of springs, and the potential of the conservative loads, in J.

        bending = 1/2 int M1 (k1 - k01) + M2 (k2 - k02) ds,    twist = 1/2 int M3 (k3 - k03) ds,     M = R^T m,
        stretch (with shear) = 1/2 int R^T n . (v - v0) ds,
        supports = sum (1/2 u . linear u + 1/2 theta . rotational theta)   over every ``Spring``,
        load = load_factor (-int f . r ds - sum F . (r + R e)   over dead forces, at ends and points too, with their offsets e
                            + 1/2 int (r - rest) . K (r - rest) ds   of a ``Foundation``,
                            - 1/2 int rho A |omega x (r - point)|^2 ds   of a ``Rotation``)

    The origin is declared: the potential of weight and dead forces is zero at the origin of the fixed frame, springs and a
    foundation have no energy where they are at rest, a rotation none on its axis. A ``MotionEnergy`` counts from the same.
    In a coupled section a mixed term counts half and half for the two kinds that it couples.
    Moments, couples, followers and functions of the shape are not in it: in space they have no potential, or none that is known.
    """

    bending: float
    twist: float
    stretch: float
    supports: float
    load: float

    @property
    def elastic(self) -> float:
        """Bending, twist and stretch together."""
        return self.bending + self.twist + self.stretch

    @property
    def total(self) -> float:
        """Elastic energy, that of the supports' springs, and the potential of the loads."""
        return self.elastic + self.supports + self.load

    @property
    def parts(self) -> str:
        """The kinds of energy in words; supports where springs are strained."""
        springs = f"supports {self.supports:.6g}, " if self.supports else ""
        return f"elastic {self.elastic:.6g}, {springs}loads {self.load:.6g}"


@dataclass(frozen=True)
class ErrorEstimate:
    """The estimated error of the answer: ``tip`` in m, ``reactions`` in N, ``moments`` of the supports in N m, ``energy`` in J.

    None where the method gives none.
    """

    tip: float | None = None
    reactions: float | None = None
    moments: float | None = None
    energy: float | None = None


@dataclass(frozen=True, eq=False)
class EquilibriumSolution:
    """The solution of an ``Equilibrium``. Call r, R, k, v, n, m with any s in [0, length], one number or an array.

    Where a point load, a support or a step of the section makes k, v, n, m or the stress jump, they are those behind the jump,
    at larger s; with ``side="before"`` those before it, as in ``solution.m(0.5, side="before")``.

    ``problem`` and ``method`` made it; ``model`` names the theory that was solved ("inextensible", "stretch", ...);
    ``status`` says how the solve ended; ``statistics`` counts what it took; ``index`` is the number of unstable
    directions where the method counts them (0: stable), else None; ``elastic_parts`` are the energies of bending, twist
    and stretch where the method has its own sum for them; ``lowest_modes`` computes what ``modes`` returns.
    """

    problem: Equilibrium
    method: Any
    model: str
    status: Status
    curve: Curve
    load_factor: float = 1.0
    index: int | None = None
    error: ErrorEstimate = ErrorEstimate()
    elastic_parts: tuple[float, float, float] | None = None
    lowest_modes: Callable[[int], Modes] | None = field(default=None, compare=False, repr=False)
    statistics: dict[str, Any] = field(default_factory=dict)

    @property
    def converged(self) -> bool:
        """True where the equilibrium was found; else ``status`` says why not."""
        return self.status.converged

    def check(self) -> EquilibriumSolution:
        """Return the solution, or raise ``NotConverged`` with the status' sentence."""
        if not self.converged:
            raise NotConverged(self.status.next_in_python, self)
        return self

    @property
    def events(self) -> tuple[Event, ...]:
        """What the rod met while its load grew, in this order: bifurcations, folds and snaps."""
        counts, unknown = self.statistics, (float("nan"), float("nan"))
        own = counts.get("own_load", True)
        met = [Event("bifurcation", bracket) for bracket in counts.get("crossings", ())]
        for load_factor, fold, jump in counts.get("falls", ()):
            met += [Event("fold", (load_factor, load_factor))] if fold else []
            if fold or jump > SNAP * self.problem.rod.length:
                met.append(Event("snap", (load_factor, load_factor), jump))
        met.sort(key=lambda event: event.load_factors[1])
        return tuple(event if own else replace(event, load_factors=unknown) for event in met)

    @property
    def stable(self) -> bool | None:
        """True where no direction lowers the energy; None where the method does not count them."""
        return None if self.index is None else self.index == 0

    def save(self, path: Any) -> None:
        """Write the solution with its problem to a NetCDF file; ``darboux.open`` gives it back, equal.

        Raises ``InvalidInput`` where the problem holds a Python function or the file can't be written.
        """
        above.call("save", self, path)

    def view(self, **options: Any) -> Any:
        """Show the rod in space, its section as it is: a window, or a PNG file that needs no display.

        Options: ``field`` what colours it (curvature, twist, moment, force, tension, stress, energy or none); ``out`` the file;
        ``ghost`` the unloaded shape too; ``directors`` as arrows; ``beside`` other solutions by name; ``thicker`` how many times
        as thick it is drawn; ``camera`` azimuth and elevation in degrees; ``size`` in pixels. Raises ``InvalidInput``.
        """
        return above.call("view", self, **options)

    def export(self, path: Any, **options: Any) -> None:
        """Write the rod for other programs: .vtp, .vtk, .glb, .gltf, .stl or .csv, by the name's ending.

        Options: ``field`` what colours it in glTF; ``samples`` lines of a table. Raises ``InvalidInput``.
        """
        above.call("export", self, path, **options)

    def __eq__(self, other: object) -> bool:
        """Return whether all is the same: the problem, the method, the states at the nodes, how it was solved."""
        if not isinstance(other, EquilibriumSolution):
            return NotImplemented
        return all(getattr(self, part.name) == getattr(other, part.name) for part in fields(self) if part.compare)

    def __hash__(self) -> int:
        return hash((self.problem, self.model, self.status))

    def modes(self, k: int = 1) -> Modes:
        """Return the k lowest modes of the second variation, with their stiffness and, with mass, their frequencies.

        Raises ``InvalidInput`` for loads without a potential, and unless ``DiscreteRod`` made the solution.
        """
        if self.lowest_modes is None:
            raise InvalidInput(
                f"solution.modes is there for DiscreteRod's answer, not for one by {self.method} or from a file; solve with it."
            )
        return self.lowest_modes(whole("modes.k", k, 1))

    # -- along the rod -------------------------------------------------------------------------------------------

    @property
    def s(self) -> Array:
        """The nodes of the solution in m: (n,), those at a jump once."""
        return np.unique(self.curve.s)

    def _states(self, s: Any, side: Side = "behind") -> tuple[Array, Array]:
        checks.choice("side", side, ("before", "behind"))
        length = self.problem.rod.length
        try:
            points = np.atleast_1d(real_array(s))
        except (TypeError, ValueError, OverflowError):
            points = np.full(1, np.nan)
        if points.ndim != 1 or not np.all(np.isfinite(points)):
            raise InvalidInput(f"s is {shown(s)}; it must be one finite arc length or a one-dimensional array of them.")
        outside = (points < -1e-9 * length) | (points > length * (1.0 + 1e-9))
        if np.any(outside):
            raise InvalidInput(f"s is {points[outside][0]:g} m, but the rod runs from 0 to {length:g} m.")
        points = np.clip(points, 0.0, length)
        return self.curve.beside(points, side), self.curve(points, side=side)

    def _shaped(self, s: Any, values: Array) -> Array:
        return values[0] if np.ndim(s) == 0 else values

    def r(self, s: Any) -> Array:
        """Return the centreline in m, fixed frame: (3,) or (n, 3)."""
        return self._shaped(s, self._states(s)[1][:, 0:3])

    def R(self, s: Any) -> Array:
        """Return the frame, columns d1, d2, d3: (3, 3) or (n, 3, 3)."""
        return self._shaped(s, frames.matrix_of_quaternion(self._states(s)[1][:, 3:7]))

    def n(self, s: Any, side: Side = "behind") -> Array:
        """Return the inner force in N, fixed frame: (3,) or (n, 3)."""
        return self._shaped(s, self._states(s, side)[1][:, 7:10])

    def m(self, s: Any, side: Side = "behind") -> Array:
        """Return the inner moment in N m, fixed frame: (3,) or (n, 3)."""
        return self._shaped(s, self._states(s, side)[1][:, 10:13])

    def k(self, s: Any, side: Side = "behind") -> Array:
        """Return curvature and twist, k = k0 + B^-1 R^T m + D R^T n, in 1/m, section's frame: (3,) or (n, 3)."""
        points, y = self._states(s, side)
        return self._shaped(s, self.problem.rod.k0(points) + self._section(points, y)[1][:, 3:])

    def v(self, s: Any, side: Side = "behind") -> Array:
        """Return stretch and shear, v = (0, 0, 1) + S^-1 R^T n + D^T R^T m, section's frame: (3,) or (n, 3)."""
        points, y = self._states(s, side)
        return self._shaped(s, np.array([0.0, 0.0, 1.0]) + self._section(points, y)[1][:, :3])

    def _section(self, points: Array, y: Array) -> tuple[Array, Array]:
        """Return the forces (R^T n, R^T m) and the strains (v - v0, k - k0) of the states y (n, 13), (n, 6) each."""
        R = frames.matrix_of_quaternion(y[:, 3:7])
        forces = np.einsum("nji,naj->nai", R, y[:, 7:13].reshape(-1, 2, 3)).reshape(-1, 6)
        return forces, np.einsum("nij,nj->ni", self.problem.rod.compliance(points), forces)

    # -- what a reader asks first --------------------------------------------------------------------------------

    @property
    def tip(self) -> Array:
        """The position (3,) in m of the free end; of s = length where both ends are held."""
        return self.r(self._tip_place)

    @property
    def _tip_place(self) -> float:
        return 0.0 if self.problem.end.holds and not self.problem.start.holds else self.problem.rod.length

    @cached_property
    def reactions(self) -> Reactions:
        """Force and moment of each support on the rod: -n(0), -m(0) at the start, n(L), m(L) at the end, less the loads there."""
        zero, problem = Reaction(np.zeros(3), np.zeros(3)), self.problem
        first, last = self.curve.y[0], self.curve.y[-1]
        start = self._reaction(-first[7:13], first, problem.end_load("start")) if problem.start.holds else zero
        end = self._reaction(last[7:13], last, problem.end_load("end")) if problem.end.holds else zero
        return Reactions(start, end, {s: self._reaction_at(s) for s, _ in problem.between})

    def _reaction_at(self, s: float) -> Reaction:
        """What a support between the ends does: the jump of n and m, less the point loads there."""
        node = int(np.searchsorted(self.curve.s, s - ONE_PLACE * self.problem.rod.length))
        before, behind = self.curve.y[node], self.curve.y[node + 1]
        return self._reaction(before[7:13] - behind[7:13], before, self.problem.stations[s][1])

    def _reaction(self, carried: Array, y: Array, load: EndLoad) -> Reaction:
        """What a support does where the inner force and moment ``carried`` (6,) act on a node in the state y (13,)."""
        R = frames.matrix_of_quaternion(y[3:7])
        force, moment = load.force_at(R), load.moment_at(R)
        return Reaction(carried[:3] - self.load_factor * force, carried[3:] - self.load_factor * moment)

    @cached_property
    def _nodes(self) -> Array:
        """The places between which all is smooth: (n,) in m, those of the curve and where the data bend or jump.

        Rows of dense tables are not among them.
        """
        breaks = () if self.problem.dense else self.problem.breaks
        return np.unique(np.concatenate([self.curve.s, breaks, self.problem.steep_places]))

    @cached_property
    def _rows(self) -> Array:
        """The same with the rows of dense tables, for sums."""
        return np.union1d(self._nodes, self.problem.breaks) if self.problem.dense else self._nodes

    @cached_property
    def energy(self) -> Energy:
        """The energies, integrated by Gauss' rule of five points between nodes; elastic ones the method's own if it has."""
        points, weights = gauss_points(self._rows if self.elastic_parts is None else self._nodes)
        y = self.curve(points)
        works = np.prod(self._section(points, y), axis=0)
        stretched, bent, twisted = (np.sum(works[:, part], axis=1) for part in np.split(np.arange(6), [3, 5]))
        integrals = tuple(float(weights @ f) / 2.0 for f in (bent, twisted, stretched))
        bending, twist, stretch = integrals if self.elastic_parts is None else self.elastic_parts
        problem = self.problem
        ends = ((0.0, problem.end_load("start")), (problem.rod.length, problem.end_load("end")))
        loaded, held = [*ends, *problem.points.items()], problem.supports
        there = self.curve(np.array([s for s, _ in (*loaded, *held)]))
        poses = list(zip(there[:, 0:3], frames.matrix_of_quaternion(there[:, 3:7]), strict=True))
        points, weights, r = self._for_loads(points, weights, y)
        load = float(weights @ problem.potential(points, r))
        load += sum(at.potential(*pose) for (_, at), pose in zip(loaded, poses, strict=False))
        supports = sum(at.energy(*pose) for (_, at), pose in zip(held, poses[len(loaded) :], strict=True))
        return Energy(bending, twist, stretch, supports, self.load_factor * load)

    def _for_loads(self, points: Array, weights: Array, y: Array) -> tuple[Array, Array, Array]:
        """Return points, weights and places (n, 3) for sums of loads: in every row of dense tables, else those given."""
        if not self.problem.dense or not self.problem.loads:
            return points, weights, y[:, 0:3]
        points, weights = gauss_points(self._rows, 2)
        return points, weights, self.curve(points, slice(0, 3))

    # -- stress and strain ---------------------------------------------------------------------------------------

    def _axial_force_and_moment(self, s: Array, side: Side = "behind") -> tuple[Array, Array]:
        y = self.curve(s, side=side)
        R = frames.matrix_of_quaternion(y[:, 3:7])
        return np.einsum("ni,ni->n", R[:, :, 2], y[:, 7:10]), np.einsum("nji,nj->ni", R, y[:, 10:13])

    def stress(self, s: Any, side: Side = "behind") -> Stress:
        """Return the stress in Pa at s: of the axial force, of bending and torsion on the section's outline, and von Mises'.

            axial = N3 / A,   bending = M1 x2 / I1 - M2 x1 / I2,   torsion = |M3| t(x1, x2);   N = R^T n,  M = R^T m

        with Saint-Venant's t for the section's shape, and for a tube on its outer wall, where all of them are largest. The
        shear stress of the transverse force, smaller than bending's by the thickness over the length, is left out. Under
        ``Buoyancy`` n is the effective force. Each part has the shape of s. Raises ``InvalidInput`` for a ``Stiffness``.
        """
        points, _ = self._states(s, side)
        found = stress.stress(self.problem.rod, points, *self._axial_force_and_moment(points, side))
        return Stress(*(self._shaped(s, getattr(found, part)) for part in ("axial", "bending", "torsion", "von_mises")))

    @cached_property
    def largest_stress(self) -> LargestStress:
        """The largest von Mises stress of the whole rod, to 1e-6 of itself, with its place. Raises as ``stress``."""
        return stress.largest_stress(self.problem.rod, self._axial_force_and_moment, self._nodes)

    @cached_property
    def largest_strain(self) -> LargestStrain:
        """The largest principal strain of the whole rod, by magnitude, with its place. Raises as ``stress``.

            e = v3 - 1 + ((k - k0) x x)_3,   g = torsion / G:   |e| (1 - nu) / 2 + sqrt((1 + nu)^2 e^2 + g^2) / 2

        It is |e|, the strain of the fibre, where the rod bends and stretches, and g / 2 where it only twists.
        """
        return stress.largest_strain(self.problem.rod, self._axial_force_and_moment, self._nodes)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What to mind before the answer is used, in sentences.

        Strain beyond 5 %, where small-strain theory is left; stress beyond the material's strength; what is mostly a slip: ends at
        one place, a twist in degrees, millimetres.
        """
        return (*mistakes.of_problem(self.problem), *self._overstrained)

    @property
    def _overstrained(self) -> tuple[str, ...]:
        rod = self.problem.rod
        if not rod.section.has_shape:
            return ()
        strength, stressed = rod.material.strength, self.largest_stress
        found, name = self.largest_strain, materials.name_of(rod.material)
        if strength is not None and stressed.von_mises > strength:
            return (
                f"the stress reaches {stressed.von_mises / 1e6:.4g} MPa (von Mises) at s = {stressed.s:.4g} m, beyond the strength "
                f"of {name or 'the material'}, {strength / 1e6:.4g} MPa: it yields or breaks, and linear elasticity ends before.",
            )
        if found.strain <= SMALL_STRAIN:
            return ()
        return (
            f"the strain reaches {100.0 * found.strain:.3g} % at s = {found.s:.4g} m; beyond {100.0 * SMALL_STRAIN:g} % linear "
            "elasticity and small-strain theory are rough.",
        )

    @cached_property
    def cable(self) -> Cable | None:
        """Span, sag, largest tension, end angles and loaded length of a rod that hangs between its held ends; else None."""
        points, weights = gauss_points(self._nodes)
        return cable.cable(self.problem, self.curve, self.v(points), points, weights)

    # -- is it right? --------------------------------------------------------------------------------------------

    @cached_property
    def balance(self) -> Balance:
        """The residual of the balance of forces and moments, integrated independently of the method, in units of the largest."""
        return balance.balance(self.problem, self.curve, self.load_factor, self._rows)

    # -- the curve and its ribbon --------------------------------------------------------------------------------

    @cached_property
    def twist(self) -> float:
        """The twist of the directors about d3 in turns, Tw = int k3 ds / 2 pi.

        It is the twist about the tangent where the rod does not shear.
        """
        points, weights = gauss_points(self._rows)
        return float(weights @ self.k(points)[:, 2]) / frames.turn

    @cached_property
    def writhe(self) -> float:
        """The writhe of the centreline in turns, Wr = int int (t x t') . (r - r') / |r - r'|^3 ds ds' / 4 pi.

        Of the open curve where the ends do not meet. Source: F. B. Fuller, Proc. Natl. Acad. Sci. USA 68 (1971) 815.
        """
        return link.writhe(lambda s: self.curve(s)[:, 0:3], self._nodes, self._gaps[0] <= CLOSED)

    @property
    def link(self) -> float:
        """The link in turns, Lk = Tw + Wr: a whole number where d1 closes too (Calugareanu, White, Fuller).

        Raises ``InvalidInput`` where the centreline does not close smoothly, or the rod shears: d3 is not its tangent then.
        """
        if self.problem.rod.shear:
            raise InvalidInput(
                "solution.link needs a rod that does not shear, for d3 to be the tangent; set shear=False."
            )
        distance, angle = self._gaps
        if distance > CLOSED or angle > CLOSED:
            raise InvalidInput(
                f"solution.link is defined for closed rods, but the ends are {distance * self.problem.rod.length:.3g} m apart and "
                f"their tangents {round(np.degrees(angle), 6):g} degrees; twist and writhe are there for open rods too."
            )
        return self.twist + self.writhe

    @property
    def _gaps(self) -> tuple[float, float]:
        """The distance of the ends, relative to the length, and the angle between their tangents in rad."""
        (r0, rL), (R0, RL) = self.curve.y[[0, -1], 0:3], frames.matrix_of_quaternion(self.curve.y[[0, -1], 3:7])
        angle = np.arctan2(np.linalg.norm(np.cross(R0[:, 2], RL[:, 2])), R0[:, 2] @ RL[:, 2])
        return float(np.linalg.norm(rL - r0)) / self.problem.rod.length, float(angle)

    # -- pictures ------------------------------------------------------------------------------------------------

    def plot(self, ax: Any = None, *, points: Any = None) -> Axes:
        """Draw the shape in the plane in which it lies, or in space, in a box and with its directors d1 and d2.

        ``ax`` are plain axes of Matplotlib to draw on, with your own settings; None: a new figure of ``pyplot``'s in our
        style. Lengths have one scale in all directions, in a unit that keeps their numbers short. ``points`` (n, 3) in m are drawn
        over the rod, as those of a measurement. Returns the axes. Raises ``InvalidInput``.
        """
        if points is not None:
            points = rows("plot.points", points, 3, "m")
        return above.call("plot", self, ax=ax, points=points)

    def plot_fields(self, *names: str, ax: Any = None) -> list[Axes]:
        """Draw fields over the arc length, each in axes of its own, as in ``plot_fields("moments", "stress")``.

        They are "curvature" (k, with the natural one behind it), "moments" (R^T m), "forces" (R^T n), "stress" (the largest
        of the section) and "energy" (elastic, per length); without names all that the rod has. ``ax`` are as many axes; None:
        a new figure of ``pyplot``'s. Returns the axes. Raises ``InvalidInput``.
        """
        return above.call("plot_fields", self, names, ax)

    # -- for reading and for other tools -------------------------------------------------------------------------

    def to_dataset(self, s: Any = None, side: Side = "behind") -> xarray.Dataset:
        """Return r, R, k, v, n, m as an ``xarray.Dataset`` with units, at s (n,) in m, or at the nodes; ``side`` as for ``m``."""
        return dataset(self, self.s if s is None else s, side)

    def __repr__(self) -> str:
        return f"<EquilibriumSolution by {self.method}: {self.status.code}, tip {vector(self.tip)} m>"

    def __str__(self) -> str:
        return summary(self)

    def _repr_html_(self) -> str:
        return above.call("page", self)


def same_branch(a: EquilibriumSolution, b: EquilibriumSolution) -> bool:
    """Return whether two meshes' answers to one problem approximate one equilibrium, rather than two, such as mirror images.

    |m_a - m_b| <= max(|m_a|, |m_b|) / 2,       |m|^2 the mean of m^2 along the rod
    """
    L = b.problem.rod.length
    s = np.linspace(0.0, L, 101)
    m = [a.m(s), b.m(s)]
    sizes = [float(np.sqrt(np.mean(np.sum(x**2, axis=1)))) for x in (m[0] - m[1], *m)]
    # Polygons of a bent rod miss its natural curvature by (k0 h)^2, which is no difference of branches.
    k0 = float(np.max(np.linalg.norm(b.problem.rod.k0(s), axis=1)))
    missed = NO_MOMENT / L + k0 * (k0 * float(np.max(np.diff(a.curve.s)))) ** 2
    return sizes[0] <= LIKE * max(sizes[1:]) + missed * float(np.max(b.problem.rod.stiffness(s).EI1))
