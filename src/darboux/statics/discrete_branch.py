"""Newton's method on a chain, for `load_path.follow`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from darboux.kernels import band, discrete_rod
from darboux.kernels.discrete_rod import Elasticity
from darboux.kernels.step_control import LARGEST_CORRECTED_TURN
from darboux.statics import load_path
from darboux.statics.discrete_chain import SLACK, Chain, Shape

Array = NDArray[np.float64]

PATH_TOLERANCE = 1e-4  # of the last change of Newton on the way, as a turn in rad: what is left over is its square
TOLERANCE = 1e-10  # and at full load
DRIFT = 1e-7  # rad by which rounding moves, in each iteration anew, what nothing but the lent stiffness resists
SETTLING = 1e-2  # rad by which an equilibrium may move when what was lent to it is taken back
MOST_ITERATIONS = 40
SHORT_STEP = 2e-3  # of the load factor
FLATTEST = 1e-3  # an edge shorter than this, over its rest length, has been compressed to nothing
SHORTEST_LINE = 2.0**-12
FIRST_FALL = 0.05  # rad, the first step from an unstable equilibrium
SMALLEST_SHIFT = 1e-2  # of EI / L^3 per length, by which an indefinite Hessian is made positive
STIRRED = np.array(
    [1.0, 1e-2, 1e-4, 1e-2]
)  # in x, y, z and about the tangent: the lowest mode has a part of one of them
MOST_FALLING, MOST_STRETCHING, INVERSE_ITERATIONS = 2000, 300, 30
STIFF = 1e5  # L^2 / EI times EA, from where on a rod hardly stretches
NEAR = 1e-4  # rad: a step so short is Newton's own, and what it gains is rounding


class ChainBranch:
    """The equilibria of a chain as the load factor grows, each found by Newton's method on the exact band."""

    def __init__(self, chain: Chain) -> None:
        self.chain = chain
        self.iterations = 0
        self.came_from = 0.0  # the load factor of the last equilibrium
        n = chain.unknowns
        self.work = np.zeros(discrete_rod.WORK)
        self.gradient, self.lower = np.zeros(n), np.zeros(band.LOWER * n)
        self.general = None if chain.symmetric else np.zeros(band.FULL * n)  # loads without a potential

    # -- Newton's method -----------------------------------------------------------------------------------------

    def assemble(self, shape: Shape, load_factor: float, rod: Elasticity | None = None) -> float:
        """Fill gradient and band (the general one where loads have no potential), of packed unknowns; return the energy.

        ``rod`` may be another one than the chain's own.
        """
        self.chain.at(load_factor)
        rod, loads = rod or self.chain.elasticity(shape.T), self.chain.loads(load_factor)
        energy: float = discrete_rod.energy_gradient_hessian(
            shape.state, rod, loads, self.work, self.gradient, self.lower
        )
        if self.general is not None:
            band.expand(self.lower, self.chain.unknowns, self.general)
            following = self.chain.edge_loads(shape, load_factor)
            arguments: Any = (shape.state, *(part.ravel() for part in following), self.gradient, self.general)
            discrete_rod.add_couples(shape.state, following.M.ravel(), self.gradient, self.general)
            discrete_rod.add_edge_loads(*arguments)
        elif self.chain.points:
            self.chain.add_eccentric(shape, load_factor, self.gradient, self.lower)
        return energy + self.chain.energy_of_supports(shape, load_factor)

    def hold(self, shape: Shape, load_factor: float) -> None:
        """Bring band and gradient from packed unknowns to those of the supports, and hold what these hold."""
        if self.general is None:
            self.chain.hold(shape, load_factor, self.lower, self.gradient, True)
            self.lower[:: band.LOWER] += self.chain.shift / self.chain.edges
            band.fix(self.lower, self.gradient, self.chain.fixed)
        else:
            self.chain.hold(shape, load_factor, self.general, self.gradient, False)
            self.general[band.REACH :: band.FULL] += self.chain.shift / self.chain.edges
            band.fix_general(self.general, self.gradient, self.chain.fixed)

    def _factor(self) -> tuple[int, Any]:
        """Return the number of negative pivots (-1: singular) and the factors."""
        if self.general is None:
            return band.factor(self.lower, self.chain.unknowns), None
        n, reach = self.chain.unknowns, band.REACH
        matrix = np.zeros((3 * reach + 1, n))
        matrix[reach:] = self.general.reshape(n, band.FULL).T
        factors, pivots, info = lapack.dgbtrf(matrix, reach, reach)
        swaps = np.count_nonzero(pivots != np.arange(n))
        negative = int(np.count_nonzero(factors[2 * reach] < 0.0) + swaps) % 2
        return (-1 if info != 0 else negative), (factors, pivots)

    def _solve(self, factors: Any, right: Array) -> Array:
        if factors is None:
            band.solve(self.lower, self.chain.unknowns, right)
            return right
        x, _ = lapack.dgbtrs(factors[0], band.REACH, band.REACH, right, factors[1])
        return np.asarray(x)

    def newton(self, shape: Shape, load_factor: float, tolerance: float) -> tuple[Shape, float, int] | None:
        """Return the equilibrium near a shape, the largest turn on the way and the iterations; None where it is not near.

        In a basin of the energy the search stays there, and a branch that is stable may lose that only within a short
        step, so that it is followed past a buckling load but never left for another. Past it, or under couples, which
        have no energy, Newton's changes must contract.
        """
        if self.general is None and not shape.unstable:
            found = self._descend(shape, load_factor, tolerance, True)
            if found is not None or load_factor - self.came_from > SHORT_STEP:
                return found
        return self._descend(shape, load_factor, tolerance, False)

    def _descend(
        self, shape: Shape, load_factor: float, tolerance: float, stable: bool
    ) -> tuple[Shape, float, int] | None:
        """Newton's method: downhill with a positive definite Hessian all the way where ``stable``, else undamped."""
        turned, last = 0.0, np.inf
        near = (
            SETTLING if load_factor == self.came_from else PATH_TOLERANCE
        )  # below this a change need not contract at once
        for iteration in range(1, MOST_ITERATIONS + 1):
            self.iterations += 1
            energy = self.assemble(shape, load_factor)
            self.hold(shape, load_factor)
            slope = self.gradient.copy()
            index, factors = self._factor()
            if index < 0 or not np.isfinite(energy) or (stable and index > 0):
                return None
            own = self._solve(factors, -slope)
            step = self.chain.packed(shape, own)
            size = self.chain.turn(step)
            if not np.isfinite(size):
                return None
            scale = 1.0
            trial = self.chain.moved(shape, step, scale)
            if stable and size > 1e-7:
                descent = float(slope @ own)
                while self._energy(trial, shape, load_factor) > energy + 1e-4 * scale * descent + 1e-13 * abs(energy):
                    scale *= 0.5
                    if scale < SHORTEST_LINE:
                        return None
                    trial = self.chain.moved(shape, step, scale)
            elif not stable and size > max(0.5 * last, near):
                return None
            shape = trial
            self.chain.settled(shape)
            turned += scale * size
            if turned > 4.0 * LARGEST_CORRECTED_TURN:
                return None
            adrift = self.chain.shift > 0.0 and 0.5 * last < size <= DRIFT
            if scale == 1.0 and (size <= tolerance or adrift):
                return shape._replace(unstable=index), turned, iteration
            last = size
        return None

    def _energy(self, trial: Shape, shape: Shape, load_factor: float) -> float:
        """Return the energy of a trial, with the multipliers of the shape that it comes from."""
        chain, parts = self.chain, np.empty(4)
        rod, loads = chain.elasticity(shape.T), chain.loads(load_factor)
        energy: float = discrete_rod.energy(trial.state, rod, loads, parts)
        return energy + chain.energy_of_supports(trial._replace(reactions=shape.reactions), load_factor)

    def settle(self, shape: Shape) -> Shape | None:
        """Return the equilibrium at full load to the last digits, from one that the path reached."""
        self.came_from = 1.0
        found = self.newton(self.chain.taken_back(shape), 1.0, TOLERANCE)
        return None if found is None else found[0]

    def fallen(self, shape: Shape, *, along_mode: bool) -> Shape | None:
        """Return the stable equilibrium at full load that the energy's descent reaches from a shape, or None.

        From an unstable equilibrium the first step goes along its lowest mode.
        """
        shape = self.chain.posed(shape, 1.0)
        if along_mode:
            shape = self.chain.moved(shape, self.chain.packed(shape, self._lowest(shape, 1.0)), 1.0)
        rest = self.rest(shape, 1.0)
        return rest if rest is None or not self.chain.lent else self.settle(rest) or rest

    def rest(self, shape: Shape, load_factor: float) -> Shape | None:
        """Return where the rod comes to rest at a load factor, by the descent of its energy from a shape, or None.

        Each step is Newton's with a shift that makes the Hessian positive. A rod that hardly stretches falls as one that does not,
        for its stiffness makes the valley narrow, and stretches afterwards.
        """
        chain = self.chain
        shape = shape._replace(T=np.zeros_like(shape.T))
        own = chain.own_EA
        if own is not None and np.min(own) < STIFF:
            chain.EA[1:-1] = own
            return self._fall(shape, load_factor)
        chain.inextensible, chain.EA[1:-1] = True, chain.penalty
        rest = self._fall(shape, load_factor)
        if own is None:
            return rest or self._fall_stretching(shape, load_factor)
        chain.inextensible, chain.EA[1:-1] = False, own
        return self._fall((rest or shape)._replace(T=np.zeros_like(shape.T)), load_factor)

    def _fall_stretching(self, shape: Shape, load_factor: float) -> Shape | None:
        """Return the same of an inextensible rod that is held twice, by one that stretches less and less; or None."""
        chain, rest = self.chain, shape
        if not chain.lent or chain.own_EA is not None:
            return None
        chain.inextensible, chain.EA[1:-1] = False, SLACK
        while (found := self._fall(rest, load_factor, MOST_STRETCHING)) is not None and chain.EA[1] < chain.penalty:
            rest, chain.EA[1:-1] = found, np.minimum(10.0 * chain.EA[1:-1], chain.penalty)
        chain.EA[1:-1], chain.inextensible = chain.penalty, True
        return found

    def _fall(self, shape: Shape, load_factor: float, most: int = MOST_FALLING) -> Shape | None:
        """Return the stable equilibrium that Newton's shifted steps reach downhill, or None.

        At a saddle, as a plane rod meets it that is unstable out of its plane, it is pushed on along the lowest mode. A motion that
        costs less than the smallest shift is a free one, as that of a round rod's plane: the shift holds it, and
        rounding does not decide on its sign.
        """
        shift, still = 0.0, False
        self.chain.settled(shape)
        for _ in range(most):
            load_path.look()
            self.iterations += 1
            energy = self.assemble(shape, load_factor)
            self.hold(shape, load_factor)
            slope, shift, unshifted = self.gradient.copy(), 0.25 * shift, self.lower.copy()
            shift = shift if shift > SMALLEST_SHIFT else -SMALLEST_SHIFT
            self.lower[:: band.LOWER] += shift / self.chain.edges
            while self._factor()[0] != 0:
                shift = max(4.0 * shift, SMALLEST_SHIFT)
                self.lower[:] = unshifted
                self.lower[:: band.LOWER] += shift / self.chain.edges
            if shift < 0.0:  # far from any free motion
                shift, self.lower[:] = 0.0, unshifted
                self._factor()
            own = self._solve(None, -slope)
            step = self.chain.packed(shape, own)
            size = self.chain.turn(step)
            scale = min(1.0, LARGEST_CORRECTED_TURN / size)
            trial = self.chain.moved(shape, step, scale)
            descent, rounding = float(slope @ own), 1e-13 * abs(energy)
            while size > NEAR and self._energy(trial, shape, load_factor) > energy + 1e-4 * scale * descent + rounding:
                scale *= 0.5
                if scale < SHORTEST_LINE:
                    return None
                trial = self.chain.moved(shape, step, scale)
            shape = trial
            self.chain.settled(shape)
            if size > TOLERANCE:
                still = False
            elif shift <= SMALLEST_SHIFT:
                return shape._replace(unstable=0)
            elif not still:  # does it take a shift that large?
                shift, still = 0.0, True
            else:
                shape = self.chain.moved(shape, self.chain.packed(shape, self._lowest(shape, load_factor)), 1.0)
                shift, still = 0.0, False
        return None

    def _lowest(self, shape: Shape, load_factor: float) -> Array:
        """Return a step of FIRST_FALL rad along the lowest eigenvector of the Hessian, by inverse iteration.

        It begins with displacements that do not depend on the mesh, so that two meshes fall to one side.
        """
        self.assemble(shape, load_factor)
        self.hold(shape, load_factor)
        unshifted, shift = self.lower.copy(), SMALLEST_SHIFT
        while self._factor()[0] != 0:
            shift *= 2.0
            self.lower[:] = unshifted
            self.lower[:: band.LOWER] += shift / self.chain.edges
        along = np.linspace(0.0, 1.0, self.chain.edges + 3)[:, None]
        stirred = (STIRRED * (along + along**2)).ravel()[: self.chain.unknowns]
        vector = np.where(self.chain.fixed, 0.0, stirred)
        for end in self.chain.ends:  # whose unknowns are turns
            vector[end.block.part] = 0.0
        for _ in range(INVERSE_ITERATIONS):
            vector = self._solve(None, vector / np.linalg.norm(vector))
        return vector * (FIRST_FALL / self.chain.turn(self.chain.packed(shape, vector)))

    def index(self, shape: Shape, load_factor: float) -> int | None:
        """Return the number of negative eigenvalues of the Hessian; None under loads without a potential."""
        if self.general is not None:
            return None
        self.assemble(shape, load_factor)
        self.hold(shape, load_factor)
        return max(band.factor(self.lower, self.chain.unknowns), 0)

    # -- for load_path.follow ------------------------------------------------------------------------------------

    def stability(self, shape: Shape, load_factor: float) -> tuple[float, int | None]:
        """Return the determinant's sign, 0 where it is singular, and the unstable directions; None without a potential."""
        self.assemble(shape, load_factor)
        self.hold(shape, load_factor)
        negative = self._factor()[0]
        return _sign(negative), None if self.general is not None else max(negative, 0)

    def tangent(self, shape: Shape, load_factor: float) -> tuple[Array, float]:
        """Solve H dx/d(load factor) = -dg/d(load factor), the right side by a difference."""
        step = 1e-6
        self.came_from = load_factor
        there = self.chain.posed(shape, load_factor + step)
        self.chain.lend(load_factor + step)
        self.assemble(there, load_factor + step)
        self.hold(there, load_factor + step)
        ahead = self.gradient.copy()
        self.chain.lend(load_factor)
        self.assemble(shape, load_factor)
        self.hold(shape, load_factor)
        change = (ahead - self.gradient) / step
        index, factors = self._factor()
        if index < 0:
            return change, np.inf
        tangent = self._solve(factors, -change)
        if not self.chain.still:  # a support that moves takes along what it holds
            fixed = self.chain.fixed
            tangent[fixed] = self.chain.rates(shape, there, step)[fixed]
        tangent = self.chain.packed(shape, tangent)
        return tangent, self.chain.turn(tangent)

    def predict(self, shape: Shape, tangent: Array, step: float) -> Shape:
        """Return the shape moved along the tangent; a groove moves too, so that what it holds with is left to Newton."""
        return self.chain.moved(shape, tangent, step)._replace(reactions=shape.reactions)

    def correct(self, shape: Shape, load_factor: float) -> load_path.Corrected[Shape] | None:
        """Return the equilibrium near a predicted shape, or None."""
        self.chain.lend(load_factor)
        shape = self.chain.posed(shape, load_factor)
        found = self.newton(shape, load_factor, PATH_TOLERANCE)
        if found is None:
            return None
        settled, _, iterations = found
        turn = max(float(np.max(np.abs(a - b))) for a, b in zip(settled.state[1:3], shape.state[1:3], strict=True))
        if float(np.min(self.chain.stretch(settled))) < FLATTEST - 1.0:
            return None
        negative = settled.unstable or 0
        if self.chain.lent:  # the last change of Newton's method was small as a turn, not as a stretch of what is lent
            negative = self.index(settled, load_factor) or 0
        index = None if self.general is not None else negative
        return load_path.Corrected(settled, turn, _sign(negative), iterations, index)


def _sign(negative: int) -> float:
    """Return the sign of the determinant from the number of negative pivots; 0 where it is singular."""
    return 0.0 if negative < 0 else float((-1) ** negative)
