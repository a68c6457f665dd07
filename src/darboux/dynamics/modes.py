"""Natural vibrations: the generalised eigenvalue problem K u = omega^2 M u of the discrete rod's own band."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, diags
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from darboux import checks
from darboux.checks import checked_call
from darboux.dynamics.system import System, beyond
from darboux.errors import InvalidInput
from darboux.kernels import band, rod_motion
from darboux.kernels.band import LOWER
from darboux.kernels.discrete_rod import State
from darboux.kernels.jit import announced
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
SHIFT_OF_RING = 1.0  # whose lowest one is a hundred times that, by its radius in place of its length


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
@announced
def natural_modes(
    problem: Equilibrium, count: int = 6, *, segments: int = 200, about: Any = None, **motion: Any
) -> Modes:
    """Find the lowest natural vibrations about a shape, by shift and inversion on the band.

        K u = omega^2 M u

    Arguments: ``problem`` an ``Equilibrium``, whose loads act where ``about`` is an ``EquilibriumSolution`` of it and not
    about the unloaded shape (None), or a ``Ring``, which vibrates about its equilibrium, free where no load acts, as a ring
    that stretches must be; ``count``; ``segments``, 6 or more; and whatever ``Motion`` takes, such as ``release`` for free
    ends. Supports hold. The squares of the frequencies are extrapolated from half as many segments (those of a ring that does
    not stretch: a third), which makes their error one of order 4 in 1 / segments; the shapes' is of order 2. Raises
    ``InvalidInput``.
    """
    checks.instance("natural_modes.problem", problem, Equilibrium, "an Equilibrium")
    count = checks.whole("natural_modes.count", count, 1)
    segments = checks.whole("natural_modes.segments", segments, 6)
    if isinstance(problem, Ring):
        return _of_ring(problem, count, segments, about, motion)
    loaded = 0.0 if about is None else 1.0
    refusal = beyond(problem)
    if refusal:
        raise InvalidInput(refusal)
    return _extrapolated(Motion(problem, 1.0, initial=about, **motion), loaded, count, segments)


def _extrapolated(about: Motion, loaded: float, count: int, segments: int) -> Modes:
    """Return the vibrations about the start of a motion, their squares extrapolated from half as many segments."""
    coarse, fine = (_modes(about, loaded, count, N) for N in (segments // 2, segments))
    gain = 1.0 / ((segments / (segments // 2)) ** 2 - 1.0)
    a, b = (np.sign(f.frequencies) * f.frequencies**2 for f in (coarse, fine))
    squares = b + gain * (b - a)
    return Modes(np.sign(squares) * np.sqrt(np.abs(squares)), fine.shapes, fine.turns)


def _of_ring(ring: Ring, count: int, segments: int, about: Any, motion: dict[str, Any]) -> Modes:
    """Return the vibrations of a ring about its equilibrium, as the discrete rod of statics finds them, or that of motion."""
    if about is not None or (motion and not ring.rod.stretch):
        raise InvalidInput(
            "natural_modes of a Ring are those about its own equilibrium; leave out about and all that Motion takes."
        )
    if ring.rod.stretch:
        if ring.loads or ring.between:
            raise InvalidInput(
                "natural_modes of a Ring that stretches are those of a free one; leave out loads and supports, or set "
                "stretch=False."
            )
        return _extrapolated(Motion(ring, 1.0, initial=solve(ring), **motion), 1.0, count, segments)
    found = solve(ring, DiscreteRod(segments // 3, extrapolate=True)).modes(count)
    if found.frequencies is None:
        raise InvalidInput("natural_modes needs the rod's mass; give its material a density, or the Stiffness a mass.")
    return Modes(found.frequencies, found.displacements, found.turns)


def _modes(motion: Motion, load_factor: float, count: int, segments: int) -> Modes:
    """Return the vibrations about the start of a motion by so many segments, of order 2."""
    system = System(motion, segments)
    state, _ = system.start()
    if system.inextensible:
        system.EA = np.full(system.segments, RIGID)
        system.body = system.body_at(0.0)
    J = unknowns(system)
    size = J.shape[1]
    if count > size - 2:
        raise InvalidInput(
            f"natural_modes.count is {count}; {segments} segments, half of those asked for, have {size - 2} at most."
        )
    lower, mass = stiffness(system, state, load_factor, _carried(system)), mass_band(system, state)
    M = joined(system, mass)
    shift = SHIFT if system.ring is None else SHIFT_OF_RING
    operator = LinearOperator((size, size), matvec=_inverse(system, lower + shift * mass, J), dtype=float)
    start = np.random.default_rng(0).normal(size=size)
    values, vectors = eigsh(M, k=count, M=M, sigma=-shift, OPinv=operator, v0=start, tol=1e-13)
    order = np.argsort(values)
    omega2 = values[order]
    omega = np.sign(omega2) * np.sqrt(np.abs(omega2))
    omega[np.abs(omega2) < shift] = 0.0
    moves = np.pad((J @ vectors[:, order]).T, ((0, 0), (0, 1))).reshape(count, -1, 4)[:, : segments + 1]
    return Modes(omega / (2.0 * np.pi * system.units.time), moves[:, :, :3], moves[:, :-1, 3])


def _inverse(system: System, lower: Array, J: Any) -> Callable[[Array], Array]:
    """Return what solves with a band by the unknowns."""
    n = system.body.mass.size
    if system.ring is not None:
        return cast("Callable[[Array], Array]", splu(joined(system, lower).tocsc()).solve)
    band.fix(lower, np.zeros(n), system.body.fixed)
    if band.factor(lower, n) < 0:
        raise InvalidInput(
            "natural_modes: the stiffness about this shape is singular; take another number of segments."
        )

    def inverse(u: Array) -> Array:
        right = J @ u.ravel()
        band.solve(lower, n, right)
        return np.asarray(J.T @ right)

    return inverse


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


def unknowns(system: System) -> Any:
    """Return the sparse matrix J that makes packed numbers of those that nothing holds; a ring's that stand twice it repeats."""
    n = system.body.mass.size
    once = n - SHARED if system.ring is not None else n
    free = ~system.body.fixed[:once]
    return csr_matrix((np.ones(n), (np.arange(n), np.arange(n) % once)))[:, free]


def joined(system: System, lower: Array) -> Any:
    """Return a band as a sparse matrix by the unknowns."""
    J = unknowns(system)
    return (J.T @ sparse(lower, J.shape[0]) @ J).tocsr()


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
