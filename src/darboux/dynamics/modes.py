"""Natural vibrations: small motions about a shape of the discrete rod, by mass, stiffness and Coriolis' force.

    M u'' + D u' + K u = 0

M is spread along the edges, D u' = 2 rho A omega x u' where all is seen in a frame that turns, and K is the exact derivative of
what resists and acts (see statics/vibrations.py). The error of the squares has an expansion in 1 / segments^2, whose first
term two rods take off, one of which has half as many segments: a node lies at each jump of the rod, of its loads and supports.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, csr_matrix, diags
from scipy.sparse.linalg import eigsh

from darboux import checks, frames, profile
from darboux.checks import checked_call
from darboux.dynamics.system import ENDS, FOLDED, GAP, System, carried_along, frames_along
from darboux.errors import InvalidInput
from darboux.kernels import discrete_rod, rod_motion
from darboux.kernels.band import LOWER
from darboux.kernels.discrete_rod import State
from darboux.kernels.jit import announced
from darboux.kernels.ring import SHARED
from darboux.motion import Motion
from darboux.problem import Equilibrium
from darboux.rod import Rod
from darboux.solution import EquilibriumSolution
from darboux.statics import discrete_modes, limits, vibrations
from darboux.statics.discrete import DiscreteRod
from darboux.statics.discrete_branch import TOLERANCE, ChainBranch
from darboux.statics.discrete_chain import Chain, Shape, nodes_along, nodes_wanted
from darboux.statics.solve import solve
from darboux.statics.vibrations import Found, Parts

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Modes:
    """Natural vibrations, k of them: u = shape exp((growth + 2 pi i frequency) t).

    ``frequencies`` (k,) in Hz, ascending: rigid motions with 0; a motion that leaves the shape without swinging with minus its
    growth over 2 pi. ``growth`` (k,) in 1/s: above 0 a motion grows by itself, and the shape is unstable; below 0 it dies away.
    ``shapes`` (k, N + 1, 3), the displacements of the vertices at ``s`` (N + 1,) in m, and ``turns`` (k, N), the edges' turns
    about the tangent, of any one scale; under a ``Rotation``, or loads without a potential, complex: the phases of a whirl.
    """

    frequencies: Array
    shapes: Array
    turns: Array
    growth: Array
    s: Array


@checked_call
@announced
def natural_modes(problem: Any, count: int = 6, *, segments: int = 200, about: Any = None, **motion: Any) -> Modes:
    """Find the lowest natural vibrations about a shape.

        M u'' + D u' + K u = 0

    Arguments: ``problem`` an ``Equilibrium``, whose supports hold as in statics and whose loads act where ``about`` is an
    ``EquilibriumSolution`` of it, or "equilibrium", and not about the unloaded shape (None); a ``Rod``, which nothing holds; or
    a ``Ring``, which vibrates about its equilibrium, free where no load acts, as a ring that stretches must be. ``count``;
    ``segments``, 6 or more; and whatever ``Motion`` takes, such as ``release`` for free ends. Where neither ``rotary_inertia`` nor
    EA is given, twist has no inertia, and follows statically.

    A ``Rotation`` turns the frame in which all is seen: its centrifugal force acts, about None too (which then is the
    equilibrium), and Coriolis' force, D, makes modes whirl: they are those of the turning frame, where a round shaft whirls
    forwards with omega_n - omega and backwards with omega_n + omega. Loads without a potential (followers, moments) act with
    their exact derivative; what flutters has a growth.

    The squares of the frequencies are extrapolated, shape by shape, from half as many segments (those of a ring that does
    not stretch: a third), which makes their error one of order 4 in 1 / segments, and of order 3 about a shape that loads along
    the rod bend; the shapes' is of order 2. Nothing is extrapolated, and all is of order 2, where more quantities jump than nodes
    can lie at, or where an odd number of segments has to meet places along the rod; and two modes that meet, where flutter sets in,
    are of order 2. Raises ``InvalidInput``.
    """
    if isinstance(problem, Rod):
        problem, motion = Equilibrium(problem), {**motion, "release": {"start": 0.0}}
    checks.instance("natural_modes.problem", problem, Equilibrium, "an Equilibrium, a Ring or a Rod")
    count = checks.whole("natural_modes.count", count, 1)
    segments = checks.whole("natural_modes.segments", segments, 6)
    if problem.closed:
        return _of_ring(problem, count, segments, about, motion)
    refusal = _refuses(problem)
    if refusal:
        raise InvalidInput(refusal)
    if count > segments:
        raise InvalidInput(f"natural_modes.count is {count}; {segments} segments have {segments} at most.")
    how = Motion(problem, 1.0, initial=about, **motion)
    if how.initial == "equilibrium":
        how = Motion(problem, 1.0, initial=solve(problem), **motion)
    places, lawful = nodes_wanted(problem, segments // 2)
    halved = lawful and (segments % 2 == 0 or not places)
    if not halved:
        places = nodes_wanted(problem, segments)[0]
    nested = halved and segments % 2 == 0  # each segment in two
    nodes = nodes_along(segments // (1 + nested), 1.0, False, False, places, int(nested))
    fine = _Vibrations(how, nodes)
    k = count + vibrations.MARGIN
    found = fine.found(min(k, segments))
    if halved:
        half = _Vibrations(how, nodes_along(segments // 2, 1.0, False, False, places)).found(
            min(k, max(segments // 2, segments - 6))
        )
        gain = 1.0 / ((segments / (segments // 2)) ** 2 - 1.0)
        values, shapes = vibrations.extrapolated(half, found, gain, np.iscomplexobj(found.values))
        found = found._replace(values=values, shapes=shapes)
    return _modes(found, fine.time, problem.rod.length, count)


def _refuses(problem: Equilibrium) -> str | None:
    """Return why a problem has no natural vibrations here, or None."""
    name = "natural_modes"
    if problem.rod.shear:
        return f"{name} states rods that do not shear, but rod.shear is True; set shear=False."
    if len(problem.frame_spins) > 1:
        return "two Rotation loads act, but all is seen in one turning frame; add their omega."
    return limits.beyond_nodes(problem, name) or limits.coupled(problem, name)


class _Vibrations:
    """A chain about the start of a motion, in whose supports, masses and loads it vibrates."""

    def __init__(self, how: Motion, nodes: Array) -> None:
        self.how, problem = how, how.problem
        chain = Chain(problem, nodes, False)
        chain.inextensible, chain.cable = not problem.rod.stretch, None
        self.spins = [np.array(spin) for spin in problem.frame_spins]
        self.load_factor = 0.0 if how.initial == "unloaded" and not self.spins else 1.0
        self.shape = self._start(chain)
        self.chain = chain.released([at for at in ENDS if not how.held(at, 0.0)])
        masses = discrete_modes.mass_along(chain)
        self.mass = float(np.sum(masses if masses is not None else 0.0))
        scale = chain.scale

        def rotary(x: Array) -> Array:
            return chain.packing.masses.rotary(x, how.rotary_inertia)[:, None] / (self.mass * scale.length**2)

        known = chain.packing.masses.rotary_is_known(how.rotary_inertia)
        J = chain.cells.on_edges(rotary)[:, 0] * chain.cells.l if known else np.zeros(chain.edges)
        self.inertia = discrete_modes.inertia(self.chain, J)
        self.time = float(np.sqrt(self.mass * scale.length / scale.force))

    def found(self, k: int) -> Found:
        """Return the k lowest modes."""
        chain, whirls = self.chain, bool(self.spins) or (self.load_factor > 0.0 and not self.chain.symmetric)
        D = discrete_modes.coriolis(self.inertia, sum(self.spins, np.zeros(3)) * self.time)
        parts, packed = discrete_modes.parts_of(chain, self.shape, self.load_factor, self.inertia, D)
        values, vectors = vibrations.whirling(parts, k) if whirls else vibrations.lowest(parts, k)
        return discrete_modes.in_shapes(chain, values, packed @ vectors)

    # -- the shape -----------------------------------------------------------------------------------------------

    def _start(self, chain: Chain) -> Shape:
        initial = self.how.initial
        if isinstance(initial, EquilibriumSolution):
            return self._beside(chain, initial)
        if initial != "unloaded":
            return _near(chain, self._along(chain, initial))
        shape = self._unloaded(chain)
        return (
            shape if self.load_factor == 0.0 else _settled(chain, shape) or self._beside(chain, solve(self.how.problem))
        )

    def _unloaded(self, chain: Chain) -> Shape:
        """Return the natural shape, laid at the support that holds it; the others must be where it is."""
        shape = chain.unloaded()
        chain.at(1.0)
        ways = [
            (end.held_place(x) - x, end.held_frame(R) - R, end.conditions) for end, _, x, R in chain._ends(shape.state)
        ]
        x = shape.state.x.reshape(-1, 3)
        for i, conditions, _ in chain.between:
            A = conditions.held_axes
            ways.append((A.T @ (A @ (conditions.pose(1.0)[0] - x[i])), np.zeros(3), conditions))
        chain.at(0.0)
        for away, turned, conditions in ways:
            off, name = float(np.linalg.norm(away)), type(conditions.support).__name__
            if off > GAP:
                where = f"begins {off * chain.scale.length:.3g} m off its {name}()"
            elif np.max(np.abs(turned)) > GAP:
                where = f"is not turned as its {name}() holds it"
            elif conditions.twist != 0.0:
                where = f"has not the twist of its {name}()"
            else:
                continue
            raise InvalidInput(
                f"the unloaded rod {where}; name the shape about which it vibrates, as in about=solve(problem)."
            )
        return shape

    def _beside(self, chain: Chain, solution: EquilibriumSolution) -> Shape:
        """Return the discrete equilibrium next to a solution."""
        L, middle = chain.scale.length, 0.5 * (chain.nodes[:-1] + chain.nodes[1:])
        r = (solution.r(chain.nodes * L) - chain.scale.origin) / L
        e = np.diff(r, axis=0)
        stretch = solution.v(middle * L)[:, 2]
        e *= (np.diff(chain.nodes) * (1.0 if chain.inextensible else stretch) / np.linalg.norm(e, axis=1))[:, None]
        R = solution.R(np.concatenate([[0.0], middle * L, [L]]))
        twists = solution.k(chain.nodes * L)[:, 2] * L * chain.V
        shape = _shaped(chain, r[0] + np.concatenate([np.zeros((1, 3)), np.cumsum(e, axis=0)]), R, twists)
        if chain.inextensible:
            shape.T[1:-1] = np.einsum("ni,ni->n", solution.n(middle * L), R[1:-1, :, 2]) / chain.scale.force
        return _near(chain, shape)

    def _along(self, chain: Chain, curve: Any) -> Shape:
        """Return a shape r(s), with the frames that do not twist along it."""
        L, start = chain.scale.length, chain.packing.start
        r = (profile.evaluate("natural_modes.about", curve, chain.nodes * L, (3,)) - chain.scale.origin) / L
        e = np.diff(r, axis=0)
        long = np.linalg.norm(e, axis=1) / np.diff(chain.nodes)
        if np.any(long < 1e-3) or (chain.inextensible and np.max(np.abs(long - 1.0)) > 0.01):
            raise InvalidInput(
                f"natural_modes.about stretches the rod by up to {np.max(np.abs(long - 1.0)):.2g}; give r by arc length."
            )
        t = e / np.linalg.norm(e, axis=1)[:, None]
        R0 = start.frame if all(start.held_turns) and start.frame[:, 2] @ t[0] > FOLDED else frames_along(t[0])
        d1 = carried_along(R0, t)
        R = np.stack([d1, np.cross(t, d1), t], axis=-1)
        ends = [end.held_frame(R[i]) for end, i in zip(chain.ends, (0, -1), strict=True)]
        if chain.inextensible:
            e = np.diff(chain.nodes)[:, None] * t
            r = r[0] + np.concatenate([np.zeros((1, 3)), np.cumsum(e, axis=0)])
        return _shaped(chain, r, np.concatenate([ends[:1], R, ends[1:]]), np.zeros(len(r)))


def _settled(chain: Chain, shape: Shape) -> Shape | None:
    """Return the equilibrium next to a shape under all loads, be it stable or not."""
    branch = ChainBranch(chain)
    branch.came_from = 1.0
    with np.errstate(all="ignore"):
        found = branch.newton(chain.posed(shape, 1.0)._replace(unstable=1), 1.0, TOLERANCE)
    return None if found is None else found[0]


def _near(chain: Chain, shape: Shape) -> Shape:
    """Return the equilibrium next to a shape, or say that there is none."""
    found = _settled(chain, shape)
    if found is None:
        raise InvalidInput(
            f"natural_modes finds no equilibrium of {chain.edges} segments next to about; take about=solve(problem), or more "
            "segments."
        )
    return found


def _shaped(chain: Chain, x: Array, R: Array, twists: Array) -> Shape:
    """Return a shape from vertices (N + 1, 3), frames (N + 2, 3, 3) of both ends, and of the edges between them, and twists."""
    t = np.diff(x, axis=0)
    t /= np.linalg.norm(t, axis=1)[:, None]
    tangents, d1 = R[:, :, 2].copy(), R[:, :, 0].copy()
    tangents[1:-1] = t
    d1 -= np.einsum("ni,ni->n", d1, tangents)[:, None] * tangents
    d1 /= np.linalg.norm(d1, axis=1)[:, None]
    places = np.concatenate([x[:1] - chain.l[0] * tangents[:1], x, x[-1:] + chain.l[-1] * tangents[-1:]])
    state = State(
        places.ravel(),
        np.pad(tangents, ((1, 1), (0, 0))).ravel(),
        np.pad(d1, ((1, 1), (0, 0))).ravel(),
        np.pad(twists, 1),
    )
    reactions = tuple(np.zeros(sum(end.conditions.held_places) if end.groove else 0) for end in chain.ends)
    shape = Shape(state, np.zeros(chain.edges + 2), reactions)
    chain.settled(shape)
    return shape


def _modes(found: Found, time: float, length: float, count: int) -> Modes:
    """Return the lowest of what was found in SI units, of a rod whose unit of time is ``time``."""
    z = found.values / time if np.iscomplexobj(found.values) else _roots(found.values / time**2)
    leaves = (z.imag == 0.0) & (z.real != 0.0)
    frequencies = np.where(leaves, -z.real, z.imag) / frames.turn + 0.0
    alike = np.round(frequencies, 9 - int(np.ceil(np.log10(np.max(np.abs(frequencies)) or 1.0))))
    order = np.lexsort((-z.real, alike))[:count]
    moves = np.pad(found.shapes[:, order].T, ((0, 0), (0, 1))).reshape(len(order), -1, 4)
    return Modes(frequencies[order], moves[:, :, :3], moves[:, :-1, 3], z.real[order], found.nodes * length)


def _roots(squares: Array) -> NDArray[np.complex128]:
    """Return z of z^2 = -squares, to the side to which a motion grows."""
    root = np.sqrt(np.abs(squares))
    return np.where(squares < 0.0, root, 1j * root)


def _of_ring(ring: Equilibrium, count: int, segments: int, about: Any, motion: dict[str, Any]) -> Modes:
    """Return the vibrations of a ring about its equilibrium, as the discrete rod of statics finds them, or that of motion."""
    if about is not None or (motion and not ring.rod.stretch):
        raise InvalidInput(
            "natural_modes of a Ring are those about its own equilibrium; leave out about and all that Motion takes."
        )
    if ring.frame_spins:
        raise InvalidInput("natural_modes states no Ring in a turning frame; leave the Rotation out.")
    if ring.rod.stretch:
        if ring.loads or ring.between:
            raise InvalidInput(
                "natural_modes of a Ring that stretches are those of a free one; leave out loads and supports, or set "
                "stretch=False."
            )
        how = Motion(ring, 1.0, initial=solve(ring), **motion)
        systems = [System(how, N) for N in (segments // 2, segments)]
        coarse, fine = (_of_chain(system, count + vibrations.MARGIN) for system in systems)
        gain = 0.0 if ring.jumps else 1.0 / ((segments / (segments // 2)) ** 2 - 1.0)
        values, shapes = vibrations.extrapolated(coarse, fine, gain, False)
        units = systems[1].units
        return _modes(fine._replace(values=values, shapes=shapes), units.time, units.length, count)
    found = solve(ring, DiscreteRod(segments // 3, extrapolate=True)).modes(count)
    if found.frequencies is None:
        raise InvalidInput("natural_modes needs the rod's mass; give its material a density, or the Stiffness a mass.")
    edges = 0.5 * (found.turns[:, 1:] + found.turns[:, :-1])
    growth = np.where(found.frequencies < 0.0, -frames.turn * found.frequencies, 0.0)
    return Modes(found.frequencies, found.displacements, edges, growth, found.s)


def _of_chain(system: System, k: int) -> Found:
    """Return the k lowest modes of a ring in motion about its start."""
    state, _ = system.start()
    J = unknowns(system)
    k = min(k, J.shape[1] - 2)
    rod, M, inextensible = system.body.rod, joined(system, mass_band(system, state)), False
    kappa = np.zeros(rod.kappa0.size)
    discrete_rod.strains(state, rod.first, rod.stop, kappa)
    size = np.linalg.norm(np.diff(state.x.reshape(-1, 3), axis=0), axis=1)
    system.body = system.body._replace(rod=vibrations.without_material(rod, kappa, size / rod.l - 1.0))
    G = joined(system, stiffness(system, state, 1.0, rod.EA * (size / rod.l - 1.0)))
    E, L, B, C = vibrations.strains_of(state, rod, kappa, inextensible)
    parts = Parts(csr_array(G), csr_array(E @ J), L, B, C, csr_array(M), J.T @ system.space.residual)
    values, vectors = vibrations.lowest(parts, k)
    cut = 4 * system.segments + 3
    return Found(values, (J @ vectors)[:cut], system.nodes, system.mass[:cut])


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
    once = n - SHARED if system.link is not None else n
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
