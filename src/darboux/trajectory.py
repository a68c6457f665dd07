"""What a motion did: shapes, velocities, energies and momenta at the recorded times."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from darboux import above, checks, mistakes
from darboux.errors import InvalidInput, NotConverged
from darboux.motion import SUMMED, Motion
from darboux.solution import Status
from darboux.supports import Support

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MotionEnergy:
    """Energies in J at the recorded times, each (n,).

    ``kinetic``, with the spin's; elastic ``bending``, ``twist``, ``stretch``; ``supports`` of those that are springs; ``load`` the
    potential of the loads as they are at that time, from the origin that ``Energy`` declares; ``dissipated`` by damping since the
    start; ``work`` since the start of moving supports and of those that let go, of loads that change in time, of couples, of
    followers and of the fluid. ``least`` is a number in J: what is less comes from rounding, see ``Motion.least_energy``.
    """

    kinetic: Array
    bending: Array
    twist: Array
    stretch: Array
    supports: Array
    load: Array
    dissipated: Array
    work: Array
    least: float = 0.0

    @property
    def elastic(self) -> Array:
        """Bending, twist and stretch together."""
        return self.bending + self.twist + self.stretch

    @property
    def total(self) -> Array:
        """Kinetic, elastic and potential energy, with that of the supports."""
        return self.kinetic + self.elastic + self.supports + self.load

    @property
    def parts(self) -> str:
        """The kinds of energy at the end in words; supports where springs are strained."""
        springs = f"supports {self.supports[-1]:.6g}, " if np.any(self.supports) else ""
        return f"kinetic {self.kinetic[-1]:.6g}, elastic {self.elastic[-1]:.6g}, {springs}loads {self.load[-1]:.6g}"

    @property
    def balance(self) -> Array:
        """total + dissipated - work, which the exact motion keeps constant."""
        return self.total + self.dissipated - self.work

    @property
    def drift(self) -> float:
        """The largest change of the balance, over the largest change or amount of energy in the motion, ``least`` at least.

        Of a load that varies in time only potential less work counts: that does not depend on the origin.
        """
        amount = float(np.max(self.kinetic + self.elastic + self.supports))
        changes = (float(np.ptp(part)) for part in (self.load - self.work, self.dissipated))
        size = max(amount, *changes, self.least, SUMMED * float(np.max(np.abs(self.load))))
        return float(np.max(np.abs(self.balance - self.balance[0]))) / size if size > 0.0 else 0.0


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The rod at one time.

    ``s`` (N + 1,) and the vertices' ``r`` in m and ``velocity`` in m/s, (N + 1, 3); the edges' frames ``R`` (N, 3, 3), at the
    middles between the vertices, and ``spin`` (N,) about their tangents in rad/s.
    """

    t: float
    s: Array
    r: Array
    velocity: Array
    R: Array
    spin: Array


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The answer of ``simulate``.

    ``times`` (n,) in s; vertices' arc lengths ``s``, ``positions`` (n, N + 1, 3) in m and ``velocities`` in m/s; edges' first
    ``directors`` (n, N, 3) and ``spins`` (n, N) in rad/s; ``energy``; ``momentum`` in kg m/s and ``angular_momentum`` about the
    origin in kg m^2/s, (n, 3). ``checkpoint`` is what ``simulate(start_from=...)`` goes on with, dimensionless. ``status`` says
    how the run ended; ``statistics`` counts. Two trajectories are equal where all but the time they took is.

    Code of the status: "converged"; "drift" where the balance of energy drifts by more than the tolerance;
    "no_convergence", with what was reached; "stopped" where the user stopped it.
    """

    motion: Motion
    method: Any
    status: Status
    s: Array
    times: Array
    positions: Array
    velocities: Array
    directors: Array
    spins: Array
    energy: MotionEnergy
    momentum: Array
    angular_momentum: Array
    checkpoint: Array
    statistics: dict[str, Any] = field(default_factory=dict)

    @property
    def converged(self) -> bool:
        """True where the whole duration was reached and energy did not drift."""
        return self.status.converged

    def check(self) -> Trajectory:
        """Return the trajectory, or raise ``NotConverged`` where it broke off."""
        if self.status.code == "no_convergence":
            raise NotConverged(self.status.next_in_python, self)
        return self

    def save(self, path: Any) -> None:
        """Write the trajectory with its motion to a NetCDF file; ``darboux.open`` gives it back, equal.

        Raises ``InvalidInput`` where the motion holds a Python function or the file can't be written.
        """
        above.call("save", self, path)

    def view(self, **options: Any) -> Any:
        """Show the motion in space, with a slider of time, or at a time ``t``; the options are ``EquilibriumSolution.view``'s."""
        return above.call("view", self, **options)

    def export(self, path: Any, **options: Any) -> None:
        """Write the motion (.pvd, .csv), or the rod at a time ``t`` (.vtp, .vtk, .glb, .gltf, .stl), for other programs."""
        above.call("export", self, path, **options)

    def __eq__(self, other: object) -> bool:
        """Return whether all is the same, to the last digit, but for the time that it took."""
        if not isinstance(other, Trajectory):
            return NotImplemented
        return all(_same(getattr(self, part.name), getattr(other, part.name)) for part in fields(self))

    def __hash__(self) -> int:
        return hash((self.motion, self.method, self.status))

    @property
    def tip(self) -> Array:
        """The positions (n, 3) in m of the free end; of s = length where both are held."""
        problem = self.motion.problem
        return self.positions[:, 0 if problem.end.holds and not problem.start.holds else -1]

    @cached_property
    def frames(self) -> Array:
        """The edges' frames R, columns d1, d2, d3: (n, N, 3, 3)."""
        t = np.diff(self.positions, axis=1)
        t /= np.linalg.norm(t, axis=2, keepdims=True)
        return np.stack([self.directors, np.cross(t, self.directors), t], axis=-1)

    def r(self, t: float, s: Any) -> Array:
        """Return the positions in m at the time t in s and the arc lengths s, (3,) or (m, 3): a cubic between the vertices."""
        points = np.asarray(checks.real_array(s))
        length = self.motion.problem.rod.length
        if not np.all((points >= 0.0) & (points <= length)):
            raise InvalidInput(f"s is {checks.shown(s)}; the rod runs from 0 to {length:g} m.")
        return np.asarray(self.curve(self.at(t).r)(points))

    def curve(self, r: Array) -> CubicSpline:
        """Return the cubic in s through vertices r (..., N + 1, 3), which closes smoothly where the rod is a ring."""
        from scipy.interpolate import CubicSpline

        ends = "periodic" if self.motion.problem.closed else "not-a-knot"
        return CubicSpline(self.s, r, axis=-2, bc_type=ends)

    @property
    def held(self) -> list[tuple[Array, Support]]:
        """What holds the rod as it begins to move: the place (3,) in m, and the support."""
        places = [(int(np.argmin(np.abs(self.s - s))), support) for s, support in self.motion.supports]
        return [(self.positions[0, i], support) for i, support in places]

    def at(self, t: float) -> Snapshot:
        """Return the rod at a time t in s, between records by the cubic that fits positions and velocities."""
        t = checks.number("t", t, "s")
        if not self.times[0] <= t <= self.times[-1]:
            raise InvalidInput(f"t is {t:g} s, but the trajectory runs from {self.times[0]:g} to {self.times[-1]:g} s.")
        i = int(np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, max(len(self.times) - 2, 0)))
        j = min(i + 1, len(self.times) - 1)
        h = float(self.times[j] - self.times[i])
        if h == 0.0:
            return self._snapshot(i)
        p = (t - self.times[i]) / h
        x0, x1, v0, v1 = self.positions[i], self.positions[j], h * self.velocities[i], h * self.velocities[j]
        r = x0 + p * (v0 + p * (3.0 * (x1 - x0) - 2.0 * v0 - v1 + p * (2.0 * (x0 - x1) + v0 + v1)))
        slope = v0 + p * (2.0 * (3.0 * (x1 - x0) - 2.0 * v0 - v1) + 3.0 * p * (2.0 * (x0 - x1) + v0 + v1))
        tangent = np.diff(r, axis=0)
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
        d1 = (1.0 - p) * self.directors[i] + p * self.directors[j]
        d1 -= np.sum(d1 * tangent, axis=1, keepdims=True) * tangent
        d1 /= np.linalg.norm(d1, axis=1, keepdims=True)
        spin = (1.0 - p) * self.spins[i] + p * self.spins[j]
        R = np.stack([d1, np.cross(tangent, d1), tangent], axis=-1)
        return Snapshot(t, self.s, r, slope / h, R, spin)

    def _snapshot(self, i: int) -> Snapshot:
        return Snapshot(
            float(self.times[i]), self.s, self.positions[i], self.velocities[i], self.frames[i], self.spins[i]
        )

    def plot(self, what: str = "all", ax: Any = None) -> Axes | list[Axes]:
        """Draw the motion: "shapes" (a fan coloured by time, with the paths of ends that move), "tip", "energy", or "all".

        Energies of the loads count from the start, and the sum, with what was dissipated and less the work done, is level
        where energy is kept. ``ax`` are plain axes of Matplotlib, three for "all"; None: a new figure of ``pyplot``'s in our
        style. Returns the axes. Raises ``InvalidInput``.
        """
        return above.call("plot", self, what=what, ax=ax)

    def animate(self, path: Any, *, fps: float = 25.0, speed: float | None = None) -> Path:
        """Write the motion as a film with a scale bar and a clock, mp4 or gif by the ending of ``path``; returns the path.

        ``fps`` are the pictures in a second; ``speed`` the seconds of motion in a second of film (None: 1, or what makes
        the film last a few seconds). Raises ``InvalidInput``, also where the encoder for mp4, of the extra [view], is missing.
        """
        return above.call("animate", self, path, fps, speed)

    def _repr_html_(self) -> str:
        return above.call("page", self)

    def __repr__(self) -> str:
        return (
            f"<Trajectory by {self.method}: {self.status.code}, {len(self.times)} records to t = {self.times[-1]:g} s>"
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to mind before the answer is used, in sentences, as of an ``EquilibriumSolution``."""
        return tuple(mistakes.of_problem(self.motion.problem))

    def __str__(self) -> str:
        tip, energy = self.tip[-1], self.energy
        steps = self.statistics.get("steps", 0)
        return "\n".join(
            [
                f"status        {self.status.message}",
                *(f"warning       {sentence}" for sentence in self.warnings),
                f"method        {self.method}, {steps} steps",
                f"tip           ({', '.join(f'{x + 0.0:.6g}' for x in tip)}) m at t = {self.times[-1]:.6g} s",
                f"energy        {energy.total[-1]:.6g} J ({energy.parts})",
                f"balance       kept to {energy.drift:.1e}",
            ]
        )


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other)
    if isinstance(one, MotionEnergy):
        return all(_same(getattr(one, part.name), getattr(other, part.name)) for part in fields(one))
    if isinstance(one, dict):
        return {**one, "seconds": None} == {**other, "seconds": None}
    return bool(one == other)
