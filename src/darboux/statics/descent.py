"""How a rod falls: down in energy, as it is let go from a shape that is no stable equilibrium of its supports and loads.

A discrete rod falls from that shape by Newton's steps with a shift that makes its Hessian positive, each of them downhill.
What it comes to rest in is a first guess of the equilibrium of the continuous theory.

Source: J. Nocedal and S. J. Wright, Numerical Optimization, 2nd ed. (Springer, 2006), ch. 3 and 4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux import frames
from darboux.curve import Curve
from darboux.kernels.rod_equations import FORCE, ROTATION
from darboux.statics import discrete_fields, limits
from darboux.statics.collocation_equations import Equations
from darboux.statics.collocation_path import follow
from darboux.statics.discrete_branch import ChainBranch
from darboux.statics.discrete_chain import Chain, nodes_along, nodes_wanted
from darboux.statics.first_shape import given
from darboux.statics.load_path import Fall, Path
from darboux.statics.mesh import Mesh

Array = NDArray[np.float64]

SEGMENTS, PER_SPAN, MOST_SEGMENTS = 100, 16, 800
MOST_FALLS = 40
PUSH = 0.05  # rad
BEHIND = 2e-3, 0.01, 0.05, 0.25  # a bifurcation or a fold, over its load factor: where the rod falls
BEHIND_LENT = 0.01, 0.03, 0.1  # the load factor more, where what is lent takes up a part of what buckles the rod
PLACES = 101  # along the rod, where it is looked how far it moves
MOST_ITERATIONS = 20
TURN = 0.2  # rad by which a segment of the given shape turns


def fallen(equations: Equations, curve: Curve, load_factor: float) -> Curve | None:
    """Return the shape in which a rod comes to rest that is let go in a shape at a load factor; None where none is found.

    So it is where no discrete rod states the problem.
    """
    problem = equations.problem
    turned = np.sum(np.linalg.norm(np.diff(curve.frames(np.unique(curve.s)), axis=0), axis=(1, 2))) / np.sqrt(2.0)
    spans = len(problem.stations) + 1
    segments = int(np.clip(max(turned / TURN, PER_SPAN * spans), SEGMENTS, MOST_SEGMENTS))
    if not equations.has_potential or limits.beyond_chain(problem, segments, even=True):
        return None
    chain = _chain(equations, segments)
    branch = ChainBranch(chain)
    shape = branch.rest(chain.in_shape(given(problem, equations.scale, curve), load_factor), load_factor)
    if shape is None:
        return None
    branch.assemble(shape, load_factor)
    return discrete_fields.curve(chain, shape, load_factor, branch.gradient)


def let_go(equations: Equations, path: Path[Mesh]) -> tuple[Path[Mesh] | None, tuple[Fall, ...]]:
    """Return the path that a rod follows which falls wherever its path turns unstable or ends, or None, and the falls.

    It falls a little behind that place, and is followed on from where it comes to rest; where that is nowhere it falls at full
    load.
    """
    falls: list[Fall] = []
    for _ in range(MOST_FALLS):
        unstable = path.unstable is not None
        if path.load_factor == 1.0 and not unstable:
            return (path if not path.index else None), tuple(falls)
        mesh, load_factor = path.unstable or (path.state, path.load_factor)
        lent = unstable and equations.slack > 0.0
        behind = (
            load_factor + more if lent else load_factor * (1.0 + more) for more in (BEHIND_LENT if lent else BEHIND)
        )
        goals = sorted({min(1.0, goal) for goal in behind} | {1.0})
        for goal in goals:
            rest = _at_rest(equations, mesh, load_factor, goal, unstable=unstable)
            if rest is not None:
                break
        else:
            return None, ()
        falls.append(Fall(load_factor, not unstable, rest[1]))
        after = follow(equations, rest[0], until_unstable=True, begin=goal)
        after.crossings[:0] = path.crossings
        after.steps, after.rejected = after.steps + path.steps, after.rejected + path.rejected
        path = after
    return None, ()


def _at_rest(
    equations: Equations, mesh: Mesh, load_factor: float, goal: float, *, unstable: bool
) -> tuple[Mesh, float] | None:
    """Return the stable equilibrium at a load factor that the rod falls to, and how far it moves in m; or None.

    From an unstable equilibrium it is pushed along the lowest mode.
    """
    curve = equations.curve(mesh, load_factor)
    begin = [_pushed(equations, mesh, load_factor, sign * PUSH) for sign in (1.0, -1.0)] if unstable else [curve]
    for one in begin:
        rest = fallen(equations, one, goal)
        if rest is None:
            continue
        found = equations.newton(equations.mesh_along(rest), goal, equations.pace.tolerance, most=MOST_ITERATIONS)
        if found is not None and equations.index(found[0], goal) == 0:
            return found[0], farthest(curve, equations.curve(found[0], goal))
    return None


def farthest(before: Curve, behind: Curve) -> float:
    """Return how far a point of the rod moves at most in m."""
    s = np.linspace(0.0, float(before.s[-1]), PLACES)
    return float(np.max(np.linalg.norm(behind(s)[:, :3] - before(s)[:, :3], axis=1)))


def _pushed(equations: Equations, mesh: Mesh, load_factor: float, push: float) -> Curve:
    """Return an equilibrium whose sections are turned along its lowest mode, the one that turns most by ``push`` rad."""
    mode = equations.second_variation(mesh, load_factor).lowest_mode()[np.searchsorted(np.unique(mesh.x), mesh.x)]
    turn = push * mode[:, 3:] / np.max(np.linalg.norm(mode[:, 3:], axis=1))
    y = mesh.y.copy()
    y[:, ROTATION:FORCE] = frames.product(frames.quaternion_of_turn(turn), y[:, ROTATION:FORCE])
    y[:, :ROTATION] += push * mode[:, :3] / np.max(np.linalg.norm(mode[:, 3:], axis=1))
    return equations.curve(Mesh(mesh.x, y, mesh.Y), load_factor)


def _chain(equations: Equations, segments: int) -> Chain:
    """Return the discrete rod, whose supports move with the load factor as those of the equations do."""
    problem, N = equations.problem, segments
    if problem.closed:
        nodes = (np.arange(N + 2) - 0.5) / N
    else:
        nodes = nodes_along(N, 1.0, problem.start.holds, problem.end.holds, nodes_wanted(problem, N)[0])
    chain = Chain(problem, nodes, two_vertices=False, start=equations.shape)
    chain.unloaded()
    for own, conditions in zip((end.conditions for end in chain.ends), (equations.start, equations.end), strict=True):
        own.move_as(conditions)
    for (_, own, _), conditions in zip(chain.between, equations.held_between, strict=True):
        own.move_as(conditions)
    return chain
