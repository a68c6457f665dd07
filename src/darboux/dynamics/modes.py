"""Natural vibrations: the generalised eigenvalue problem K u = omega^2 M u of the discrete rod's own band."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, diags
from scipy.sparse.linalg import LinearOperator, eigsh

from darboux import checks
from darboux.checks import checked_call
from darboux.dynamics.system import System, beyond
from darboux.errors import InvalidInput
from darboux.kernels import band, rod_motion
from darboux.kernels.band import LOWER
from darboux.kernels.discrete_rod import State
from darboux.kernels.ring import SHARED
from darboux.motion import Motion
from darboux.problem import Equilibrium, Ring
from darboux.solution import EquilibriumSolution
from darboux.statics.discrete import DiscreteRod
from darboux.statics.solve import solve

Array = NDArray[np.float64]

RIGID = 1e8  # EA L^2 / EI that stands for an inextensible rod
SHIFT = (
    1e-3  # below the spectrum, in units of the lowest frequency of a bent rod, squared: rigid motions are no obstacle
)


@dataclass(frozen=True, eq=False)
class Modes:
    """Natural vibrations.

    ``frequencies`` (k,) in Hz, ascending, rigid motions with 0, unstable directions negative; ``shapes`` (k, N + 1, 3), the
    vertices' displacements, and ``turns`` (k, N), the edges' turns about the tangent, of any one scale.
    """

    frequencies: Array
    shapes: Array
    turns: Array


@checked_call
def natural_modes(
    problem: Equilibrium, count: int = 6, *, segments: int = 200, about: Any = None, **motion: Any
) -> Modes:
    """Find the lowest natural vibrations about a shape, by shift and inversion on the band.

        K u = omega^2 M u

    Arguments: ``problem`` an ``Equilibrium``, whose loads act where ``about`` is an ``EquilibriumSolution`` of it and not
    about the unloaded shape (None), or a ``Ring``, which vibrates about its equilibrium, free where no load acts; ``count``;
    ``segments``, 6 or more; and whatever ``Motion`` takes, such as ``release`` for free ends. Supports hold. The squares of the
    frequencies are extrapolated from half as many segments (a ring's: a third), which makes their error one of order 4 in
    1 / segments; the shapes' is of order 2. Raises ``InvalidInput``.
    """
    checks.instance("natural_modes.problem", problem, Equilibrium, "an Equilibrium")
    count = checks.whole("natural_modes.count", count, 1)
    segments = checks.whole("natural_modes.segments", segments, 6)
    if isinstance(problem, Ring):
        return _of_ring(problem, count, segments, about, motion)
    loaded = 0.0 if about is None else 1.0
    about = Motion(problem, 1.0, initial=about, **motion)
    coarse, fine = (_modes(about, loaded, count, N) for N in (segments // 2, segments))
    gain = 1.0 / ((segments / (segments // 2)) ** 2 - 1.0)
    a, b = (np.sign(f.frequencies) * f.frequencies**2 for f in (coarse, fine))
    squares = b + gain * (b - a)
    return Modes(np.sign(squares) * np.sqrt(np.abs(squares)), fine.shapes, fine.turns)


def _of_ring(ring: Ring, count: int, segments: int, about: Any, motion: dict[str, Any]) -> Modes:
    """Return the vibrations of a ring about its equilibrium, as the discrete rod of statics finds them."""
    if about is not None or motion:
        raise InvalidInput(
            "natural_modes of a Ring are those about its own equilibrium; leave out about and all that Motion takes."
        )
    found = solve(ring, DiscreteRod(segments // 3, extrapolate=True)).modes(count)
    if found.frequencies is None:
        raise InvalidInput("natural_modes needs the rod's mass; give its material a density, or the Stiffness a mass.")
    return Modes(found.frequencies, found.displacements, found.turns)


def _modes(motion: Motion, load_factor: float, count: int, segments: int) -> Modes:
    """Return the vibrations about the start of a motion by so many segments, of order 2."""
    refusal = beyond(motion.problem)
    if refusal:
        raise InvalidInput(refusal)
    system = System(motion, segments)
    state, _ = system.start()
    if system.inextensible:
        system.EA = np.full(system.segments, RIGID)
        system.body = system.body_at(0.0)
    free = ~system.body.fixed
    if count > np.count_nonzero(free) - 2:
        raise InvalidInput(
            f"natural_modes.count is {count}; {segments} segments, half of those asked for, have "
            f"{np.count_nonzero(free) - 2} at most."
        )
    lower = stiffness(system, state, load_factor, _carried(system))
    n = 4 * segments + 3
    mass = mass_band(system, state)
    shifted = lower + SHIFT * mass
    band.fix(shifted, np.zeros(n), system.body.fixed)
    if band.factor(shifted, n) < 0:
        raise InvalidInput(
            "natural_modes: the stiffness about this shape is singular; take another number of segments."
        )

    def inverse(u: Array) -> Array:
        right = np.zeros(n)
        right[free] = u.ravel()
        band.solve(shifted, n, right)
        return right[free]

    size = (int(np.count_nonzero(free)),) * 2
    operator = LinearOperator(size, matvec=inverse, dtype=float)
    M = sparse(mass, n)[free][:, free]
    start = np.random.default_rng(0).normal(size=size[0])
    values, vectors = eigsh(M, k=count, M=M, sigma=-SHIFT, OPinv=operator, v0=start, tol=1e-13)
    order = np.argsort(values)
    omega2 = values[order]
    omega = np.sign(omega2) * np.sqrt(np.abs(omega2))
    omega[np.abs(omega2) < SHIFT] = 0.0
    packed = np.zeros((count, n + 1))
    packed[:, :-1][:, free] = vectors[:, order].T
    moves = packed.reshape(count, -1, 4)
    return Modes(omega / (2.0 * np.pi * system.units.time), moves[:, :, :3], moves[:, :-1, 3])


def _carried(system: System) -> Array | float:
    """Return the tension (N,) of an inextensible rod in the equilibrium that it vibrates about, which its lengths do not tell."""
    about = system.motion.initial
    if not (system.inextensible and isinstance(about, EquilibriumSolution)):
        return 0.0
    s = 0.5 * (system.nodes[1:] + system.nodes[:-1]) * system.units.length
    return np.asarray(np.einsum("ni,ni->n", about.n(s), about.R(s)[:, :, 2]) / system.scale.force)


def mass_band(system: System, state: State) -> Array:
    """Return the band of M at a state; the held unknowns are still in it."""
    rest, space = np.zeros_like(system.body.mass), system.space
    space.lower[:] = 0.0
    rod_motion.add_inertia(state, state, rest, rest, 1.0, system.body, False, space.residual, space.lower)
    return space.lower.copy()


def sparse(lower: Array, n: int) -> Any:
    """Return a band as a sparse matrix."""
    columns = lower.reshape(n, LOWER)
    below = [columns[: n - k, k] for k in range(LOWER)]
    return diags([*below, *below[1:]], [*(-k for k in range(LOWER)), *range(1, LOWER)], format="csr")


def joined(system: System, lower: Array) -> Any:
    """Return a band as a sparse matrix by the unknowns that nothing holds, a ring's by those that do not stand twice."""
    n = system.body.mass.size
    columns = np.flatnonzero(~system.body.fixed)
    once = np.arange(n - SHARED if system.ring is not None else n)
    J = csr_matrix((np.ones(n), (np.arange(n), np.arange(n) % len(once))))[:, columns[columns < len(once)]]
    return (J.T @ sparse(lower, n) @ J).tocsr()


def stiffness(system: System, state: State, factor: float, carried: Array | float = 0.0) -> Array:
    """Return the band of K at a state, with the loads at a factor and ``carried`` tension; the held unknowns are still in it."""
    row = system.drive([0.0], 0.0)[0]
    row[rod_motion.FACTORS :] = factor
    rest, rod = np.zeros_like(system.body.mass), system.body.rod
    size = np.linalg.norm(np.diff(state.x.reshape(-1, 3), axis=0), axis=1)
    system.space.expected[:] = rod.EA * (size / rod.l - 1.0) + carried
    rod_motion.forces(state, state, rest, 0.0, system.body, row, False, True, system.space)
    return system.space.lower.copy()


def largest_frequency(system: System, state: State) -> float:
    """Return the highest natural frequency of the discrete rod at a state, dimensionless, in rad per unit of time."""
    K, M = (joined(system, band) for band in (stiffness(system, state, 1.0), mass_band(system, state)))
    root = diags([1.0 / np.sqrt(M.diagonal())], [0])
    start = np.random.default_rng(0).normal(size=K.shape[0])
    return float(np.sqrt(eigsh(root @ K @ root, k=1, which="LA", v0=start, tol=1e-3, return_eigenvectors=False)[0]))
