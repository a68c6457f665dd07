"""Newton's equations of collocation are the derivative of its residual: Taylor tests, under every support and every load.

The residual is written here anew, in SI units and in NumPy, from the descriptions alone. The state is no solution: places,
frames, forces and moments at nodes and stages are drawn at random, but for what is explicit at the stages. Along the step
that the kernels give, nodes and stages alike, the residual F must change by -F, and with the load factor's change c by its
derivative too:

    d/dt F(z(t), lambda + t c) = -F(z, lambda)   at t = 0,   with z(0) = z and z'(0) = dz
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import darboux as dx
from darboux import frames
from darboux.kernels import collocation
from darboux.kernels.gauss import gauss
from darboux.statics import first_shape
from darboux.statics.collocation_equations import Equations
from darboux.statics.mesh import Mesh, stage_points
from tests import cases

Array = np.ndarray

STEP = 1e-3  # of the largest part of Newton's step, in differences of order 4
EXACT = 1e-9  # what these leave over, relative to the size of step and residual
BY_DIFFERENCES = 1e-6  # where the solver itself takes differences: grooves, springs, functions, poses that move
UP = (0.0, 0.0, 1.0)


# -- the residual ------------------------------------------------------------------------------------------------------


def along(value: Any, s: Array) -> Array:
    return np.asarray(value(s) if callable(value) else np.broadcast_to(value, (len(s), np.size(value))), dtype=float)


def distributed(load: Any, rod: dx.Rod, s: Array, r: Array, R: Array) -> tuple[Array, Array]:
    """Force and couple per length (n, 3) of one load, by its law."""
    zero = np.zeros((len(s), 3))
    match load:
        case dx.Gravity():
            return rod.mass(s, "")[:, None] * np.array(load.g), zero
        case dx.Rotation():
            arm = r - np.array(load.point)
            return -rod.mass(s, "")[:, None] * np.cross(load.omega, np.cross(load.omega, arm)), zero
        case dx.ElectricField():
            return along(load.charge_per_length, s).reshape(-1, 1) * np.array(load.field), zero
        case dx.Buoyancy():
            return np.tile(-load.density * load.area * np.array(load.g), (len(s), 1)), zero
        case dx.Foundation():
            rest = np.array(load.point) + s[:, None] * np.array(load.direction)
            return -(r - rest) @ np.array(load.stiffness), zero
        case dx.LineForce() | dx.LineCouple():
            value = load.force if isinstance(load, dx.LineForce) else load.couple
            if load.of_shape:
                value = value(s, r, R)
            else:
                value = along(value, s)
                value = np.einsum("nij,nj->ni", R, value) if load.frame == "section" else value
            return (value, zero) if isinstance(load, dx.LineForce) else (zero, value)
    return zero, zero


def concentrated(loads: Any, R: Array) -> tuple[Array, Array]:
    """Force and moment (3,) of the loads at one place, where the section's frame is R."""
    F, M = np.zeros(3), np.zeros(3)
    for load in loads:
        value = np.array(load.force if isinstance(load, dx.EndForce | dx.PointForce) else load.moment)
        value = R @ value if load.follower else value
        if isinstance(load, dx.EndForce | dx.PointForce):
            F, M = F + value, M + np.cross(R @ np.array(load.offset), value)
        else:
            M = M + value
    return F, M


class Residual:
    """What must be zero, of the states y (N + 1, 13) and Y (N, stages, 13) on the nodes x, dimensionless as the kernels' are."""

    def __init__(self, equations: Equations, x: Array) -> None:
        self.equations, self.problem, self.x, scale = equations, equations.problem, x, equations.scale
        self.unit = np.repeat([scale.length, 1.0, scale.force, scale.moment], [3, 4, 3, 3])
        self.c, self.a = gauss(equations.pace.stages)

    def si(self, y: Array) -> Array:
        result = y * self.unit
        result[..., :3] += self.equations.scale.origin
        return result

    def slope(self, x: Array, y: Array, load_factor: float) -> Array:
        """y' by r' = R v, q' = 1/2 q (0, k), n' = -f, m' = n x r' - l, in SI units, then without dimensions."""
        rod, L = self.problem.rod, self.problem.rod.length
        s, y = x * L, self.si(y)
        r, q, n, m = y[:, :3], y[:, 3:7], y[:, 7:10], y[:, 10:]
        R = frames.matrix_of_quaternion(q)
        C = rod.compliance(s).copy()
        C[:, 2, 2] += self.equations.slack * (1.0 - load_factor) / self.equations.scale.force
        stress = np.concatenate([np.einsum("nji,nj->ni", R, part) for part in (n, m)], axis=1)
        strain = np.einsum("nij,nj->ni", C, stress)
        k = rod.k0(s)
        if self.equations.shape is not None:
            k = load_factor * k + (1.0 - load_factor) * self.equations.shape.k(x) / L
        k, v = k + strain[:, 3:], strain[:, :3] + UP
        f, l = (
            load_factor * sum(parts)
            for parts in zip(*(distributed(load, rod, s, r, R) for load in (*self.problem.loads, None)), strict=True)
        )
        dr = np.einsum("nij,nj->ni", R, v)
        dq = 0.5 * frames.product(q, np.concatenate([0.0 * k[:, :1], k], axis=1))
        return np.concatenate([dr, dq, -f, np.cross(n, dr) - l], axis=1) * L / self.unit

    def held(self, conditions: Any, loads: Any, outward: float, y: Array, load_factor: float) -> Array:
        """The six conditions of a support (6,) at the state y (13,)."""
        support, scale = conditions.support, self.equations.scale
        place, q0 = conditions.pose(load_factor)
        R0, y, place = frames.matrix_of_quaternion(q0), self.si(y), place * scale.length + scale.origin
        r, q, n, m = y[:3], y[3:7], y[7:10], y[10:]
        R, u = frames.matrix_of_quaternion(q), r - place
        F, M = concentrated(loads, R)
        n, m = n - outward * load_factor * F, m - outward * load_factor * M
        if support.linear is not None:
            n = n + outward * np.array(support.linear) @ u
        if support.rotational is not None:
            theta = frames.rotation_vector(R @ R0.T)
            t, weights = np.polynomial.legendre.leggauss(24)
            by_turn = sum(0.5 * w * frames.rotation(0.5 * (1.0 + a) * theta) for a, w in zip(t, weights, strict=True))
            m = m + outward * np.linalg.solve(by_turn.T, np.array(support.rotational) @ theta)
        axes = (R if support.sliding == "section" else np.eye(3)) @ support.displacement_axes
        displaced = np.where(support.held_displacement, axes.T @ u / scale.length, axes.T @ n / scale.force)
        if support.sliding == "section":
            m = m - np.cross(axes @ np.where(support.held_displacement, axes.T @ n, 0.0), u)
        m = m / scale.moment
        first, second, _ = support.rotation_axes.T
        if tuple(support.held_rotation) == (False, False, True):
            b = R @ R0.T @ second
            return np.concatenate([displaced, [first @ m, b @ m, first @ b]])
        turn = frames.product(q0 * (1, -1, -1, -1), q)
        angle = 2.0 * np.sign(turn[0]) * R0 @ turn[1:]
        return np.concatenate(
            [displaced, np.where(support.held_rotation, support.rotation_axes.T @ angle, support.rotation_axes.T @ m)]
        )

    def __call__(self, y: Array, Y: Array, load_factor: float, about: Array) -> Array:
        """All equations; those of a node's rotation as a small turn from ``about`` (N + 1, 4)."""
        equations, problem, parts = self.equations, self.problem, []
        places = ("start", "end", *problem.stations)
        acting = {at: [load for load in problem.loads if at in (load.place, load.station)] for at in places}
        parts.append(self.held(equations.start, acting["start"], -1.0, y[0], load_factor))
        stations = iter(equations.stations)
        for i, h in enumerate(np.diff(self.x)):
            if h > 0.0:
                g = self.slope(self.x[i] + h * self.c, Y[i], load_factor)
                ends = y[i] + h * self.a @ g
                parts += [(ends[:-1] - Y[i]).ravel(), _small(ends[-1] - y[i + 1], about[i + 1])]
                continue
            at, conditions = next(stations)
            before, behind = y[i].copy(), y[i + 1]
            before[7:] -= behind[7:]
            loads = acting[min(problem.stations, key=lambda s, at=at: abs(s - at * problem.rod.length))]
            parts += [_small(y[i] - y[i + 1], about[i])[:6], self.held(conditions, loads, 1.0, before, load_factor)]
        parts.append(self.held(equations.end, acting["end"], 1.0, y[-1], load_factor))
        return np.concatenate(parts)


def _small(gap: Array, q: Array) -> Array:
    """The gap (13,) between two states as (dr, phi, dn, dm), with phi = 2 vec(q* dq)."""
    phi = 2.0 * frames.product(q * (1, -1, -1, -1), gap[3:7])[1:]
    return np.concatenate([gap[:3], phi, gap[7:]])


# -- the step ----------------------------------------------------------------------------------------------------------


def drawn(equations: Equations, seed: int, nodes: Any = (0.0, 0.45, 1.0)) -> Mesh:
    """States about the straight rod, of random places, frames, forces and moments; a joint's two nodes have one place."""
    rng = np.random.default_rng(seed)
    stations = [at for at, _ in equations.stations]
    x = np.unique([*nodes, *stations])

    def states(x: Array, size: float) -> Array:
        y = size * rng.normal(size=(len(x), 13))
        y[:, 2] += x
        y[:, 3] += 1.0
        y[:, 7:] *= 5.0
        return y

    y = states(x, 0.15)
    y[:, 3:7] /= np.linalg.norm(y[:, 3:7], axis=1, keepdims=True)
    points = x[:-1, None] + np.diff(x)[:, None] * gauss(equations.pace.stages)[0]
    Y = states(points.ravel(), 0.15).reshape(*points.shape, 13)
    mesh = Mesh(x, y, Y).jointed(np.array(stations))
    mesh.y[mesh.joints + 1, 7:] += rng.normal(size=(len(stations), 6))
    for conditions in (equations.start, *(c for _, c in equations.stations), equations.end):
        if conditions.support.holds:  # what it prescribes grows from some pose
            first = states(np.zeros(1), 0.1)[0]
            first[3:7] /= np.linalg.norm(first[3:7])
            conditions.grow_from(first, all_at_once=equations.shape is not None)
    return mesh


def left_over(problem: dx.Equilibrium, stages: int = 2, load_factor: float = 0.7, start: Any = None) -> float:
    """The largest of d/dt F + F along the kernels' step, over the size of both, with and without the load factor's change."""
    shape = None
    if start is not None:
        shape = first_shape.given(problem, Equations(problem, stages).scale, start)
    equations = Equations(problem, stages, shape)
    mesh = drawn(equations, seed=1)
    residual = Residual(equations, mesh.x)
    about = mesh.y[:, 3:7]
    step = equations.newton_step(mesh, load_factor)  # which writes what is explicit at the stages
    assert step is not None
    here = residual(mesh.y, mesh.Y, load_factor, about)
    worst = 0.0
    for change in (0.0, 1.0):
        delta = step.delta + change * step.tangent
        dY = equations.moved(mesh, load_factor, delta, change).Y - mesh.Y
        turn = np.concatenate([np.zeros((len(delta), 1)), 0.5 * delta[:, 3:6]], axis=1)
        dy = np.concatenate([delta[:, :3], frames.product(about, turn), delta[:, 6:]], axis=1)
        size = max(1.0, float(np.max(np.abs(dy))), float(np.max(np.abs(dY))))
        h = STEP / size

        def at(t: float, delta: Array = delta, change: float = change) -> Array:
            moved = equations.moved(mesh, load_factor, delta, change, t)
            equations.newton_step(moved, load_factor + t * change)
            return residual(moved.y, moved.Y, load_factor + t * change, about)

        ahead, further, behind, back = (at(t) for t in (h, 2 * h, -h, -2 * h))
        slope = (8.0 * (ahead - behind) - (further - back)) / (12.0 * h)
        worst = max(worst, float(np.max(np.abs(slope + here))) / (size + float(np.max(np.abs(here)))))
    return worst


# -- the tests ---------------------------------------------------------------------------------------------------------

SECTION = dx.Stiffness(EI1=3.0, EI2=4.2, GJ=2.2, EA=90.0, mass=1.5)
BENT = dx.Rod(2.0, SECTION, natural=(0.3, 0.2, 0.4))
COUPLED = np.diag([60.0, 50.0, 80.0, 1.0, 1.4, 0.75]) + 0.15 * np.random.default_rng(4).normal(size=(6, 6))
MIDDLE = 1.0  # m
OFFSET = (0.2, -0.1, 0.3)
DEAD = [dx.LineForce((1.0, 0.8, -0.6)), dx.EndForce((0.4, 0.3, -0.5), offset=OFFSET), dx.EndMoment((0.2, -0.3, 0.1))]
FOLLOWING = [
    dx.EndForce((0.3, -0.8, 0.5), follower=True, offset=OFFSET),
    dx.EndMoment((-0.4, 0.3, 0.6), follower=True),
]
AT_THE_MIDDLE = [
    dx.PointForce((0.4, 0.2, -0.7), at=MIDDLE, offset=OFFSET),
    dx.PointForce((0.3, -0.2, 0.4), at=MIDDLE, follower=True, offset=OFFSET),
    dx.PointMoment((0.1, 0.2, 0.3), at=MIDDLE),
    dx.PointMoment((-0.2, 0.1, 0.3), at=MIDDLE, follower=True),
]
SUPPORTS = {
    "clamped": dx.Clamped(position=(0.1, 0.2, 0.8), tangent=(0.1, 0.2, 1)),
    "clamped, twisted": dx.Clamped(position=(0.1, 0.2, 0.9), tangent=(0.1, 0.2, 1), twist=0.7),
    "pinned": dx.Pinned(position=(0.1, 0.1, 0.9)),
    **cases.ENDS,
}
BY_DIFFERENCES_AT = ("groove", "spring")


def tolerance(name: str) -> float:
    return BY_DIFFERENCES if name in BY_DIFFERENCES_AT else EXACT


@pytest.mark.parametrize("name", SUPPORTS)
def test_under_every_support_of_the_end(name: str) -> None:
    loads = DEAD[:1] if "clamped" in name else [*DEAD, *FOLLOWING]
    gap = left_over(dx.Equilibrium(BENT, end=SUPPORTS[name], loads=loads))
    assert gap < tolerance(name), f"{gap:.1e}"


@pytest.mark.parametrize("name", [name for name in SUPPORTS if name != "free"])
def test_under_every_support_of_the_start(name: str) -> None:
    loads = [DEAD[0]] if "clamped" in name else [DEAD[0], *(dataclasses.replace(load, at="start") for load in DEAD[1:])]
    loads += [] if "clamped" in name else [dataclasses.replace(load, at="start") for load in FOLLOWING]
    gap = left_over(dx.Equilibrium(BENT, start=SUPPORTS[name], end=dx.Clamped(position=(0, 0, 1.5)), loads=loads))
    assert gap < tolerance(name), f"{gap:.1e}"


@pytest.mark.parametrize("name", [name for name in SUPPORTS if "clamped" not in name])
def test_under_every_support_between_the_ends(name: str) -> None:
    """With all that may act at a point; "free" is a point load alone."""
    between = {} if name == "free" else {MIDDLE: SUPPORTS[name]}
    gap = left_over(dx.Equilibrium(BENT, between=between, loads=[*DEAD, *AT_THE_MIDDLE]))
    assert gap < tolerance(name), f"{gap:.1e}"


def test_at_two_stations() -> None:
    between = {0.4: dx.Roller(along=(1, 0, 2)), MIDDLE: dx.Clamped(position=(0.1, 0, 0.8))}
    gap = left_over(dx.Equilibrium(BENT, between=between, loads=[*DEAD, dx.PointForce((0.4, 0.2, -0.7), at=0.4)]))
    assert gap < EXACT, f"{gap:.1e}"


LOADS = {
    "gravity": dx.Gravity((1, 0.5, -2)),
    "line force": dx.LineForce((2, 1, -1)),
    "line force that varies": dx.LineForce(lambda s: np.stack([s, 1.0 - s**2, 0.5 * s**3], axis=1)),
    "line force, follower": dx.LineForce((2, 1, -1), frame="section"),
    "line couple": dx.LineCouple((0.5, 1, 0.4)),
    "line couple, follower": dx.LineCouple((0.5, 1, 0.4), frame="section"),
    "force of the shape": dx.LineForce(lambda s, r, R: -2.0 * r + R[:, :, 0] * s[:, None]),
    "couple of the shape": dx.LineCouple(lambda s, r, R: 0.9 * np.cross(R[:, :, 2], r + 0.3)),
    "foundation": dx.Foundation([[3, 1, 0], [1, 4, 0], [0, 0, 5]], point=(0.1, 0, 0), direction=(0.1, 0, 1)),
    "buoyancy": dx.Buoyancy(density=3.0, area=1.0, g=(0, 1, -1)),
    "rotation": dx.Rotation((0.3, 2, 1), (0.3, 0.1, 0)),
    "electric field": dx.ElectricField((1, 2, 0), lambda s: 1.0 + s),
    "end force": dx.EndForce((1, 1, -1)),
    "end force, follower": dx.EndForce((1, 1, -1), follower=True),
    "end force off the centre": dx.EndForce((1, 1, -1), offset=OFFSET),
    "end force off the centre that turns": dx.EndForce((1, 1, -1), follower=True, offset=OFFSET),
    "end moment": dx.EndMoment((1, 0.5, 0.6)),
    "end moment, follower": dx.EndMoment((1, 0.5, 0.6), follower=True),
    "point force": dx.PointForce((2, 1, -1), at=MIDDLE),
    "point force, follower": dx.PointForce((2, 1, -1), at=MIDDLE, follower=True),
    "point force off the centre": dx.PointForce((2, 1, -1), at=MIDDLE, offset=OFFSET),
    "point force off the centre that turns": dx.PointForce((2, 1, -1), at=MIDDLE, follower=True, offset=OFFSET),
    "point moment": dx.PointMoment((0.5, 1, 0.3), at=MIDDLE),
    "point moment, follower": dx.PointMoment((0.5, 1, 0.3), at=MIDDLE, follower=True),
}


@pytest.mark.parametrize("name", LOADS)
def test_under_every_load(name: str) -> None:
    gap = left_over(dx.Equilibrium(BENT, loads=[LOADS[name]]))
    assert gap < (BY_DIFFERENCES if "shape" in name else EXACT), f"{gap:.1e}"


def pull(s: Array, r: Array, R: Array) -> Array:
    return -2.0 * r + R[:, :, 0] * s[:, None]


def pulls_gradient(s: Array, r: Array, R: Array) -> tuple[Array, Array]:
    """By r, and by a small turn phi in the section's frame: d1 becomes R (phi x e1)."""
    by_turn = R @ np.array([[0.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    return np.tile(-2.0 * np.eye(3), (len(s), 1, 1)), by_turn * s[:, None, None]


FULL = {"stretch": True, "shear": True}
RODS = {
    "inextensible": BENT,
    "stretching": dataclasses.replace(BENT, stretch=True),
    "shearing": dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.4, GJ=0.7, EA=30.0, GA1=20.0, GA2=15.0, mass=1.0), **FULL),
    "coupled": dx.Rod(1.0, dx.StiffnessMatrix(0.5 * (COUPLED + COUPLED.T), mass=1.0), **FULL),
    "varying": dx.Rod(
        1.0,
        dx.Stiffness(EI1=lambda s: 2.0 - s, EI2=1.3, GJ=0.8, EA=80.0, mass=1.0),
        natural=lambda s: np.stack([s, 1.0 - s, s**2], axis=1),
        stretch=True,
    ),
    "stepped": dx.Rod(1.0, dx.Stiffness(EI1=lambda s: np.where(s < 0.45, 2.0, 1.0), EI2=1.3, GJ=0.8, mass=1.0)),
}
ACTING = {  # which parts of a stage are explicit depends on what acts
    "dead loads": [dx.LineForce((1, 2, -1)), dx.LineCouple((0.5, 1, 0.4)), *DEAD],
    "by place": [dx.Foundation(3.0), *DEAD],
    "by turn": [dx.LineForce((2, 1, -1), frame="section"), *DEAD],
    "by place and turn": [
        dx.Rotation((0.3, 1, 0.4)),
        dx.LineForce((2, 1, -1), frame="section"),
        dx.LineCouple((0.5, 1, 0.4), frame="section"),
        *FOLLOWING,
    ],
    "of the shape": [
        dx.Foundation(3.0),
        dx.LineForce(pull, gradient=pulls_gradient),
        dx.LineCouple(pull, gradient=pulls_gradient),
        *DEAD,
    ],
}


@pytest.mark.parametrize("acting", ACTING)
@pytest.mark.parametrize("rod", RODS)
def test_of_every_rod_under_every_kind_of_load(rod: str, acting: str) -> None:
    gap = left_over(dx.Equilibrium(RODS[rod], loads=ACTING[acting]))
    assert gap < EXACT, f"{gap:.1e}"


@pytest.mark.parametrize("stages", [3, 4, 5])
@pytest.mark.parametrize("rod", ["inextensible", "coupled"])
def test_with_every_number_of_stages(rod: str, stages: int) -> None:
    gap = left_over(dx.Equilibrium(RODS[rod], loads=ACTING["by place and turn"]), stages)
    assert gap < EXACT, f"{gap:.1e}"


@pytest.mark.parametrize("load_factor", [0.2, 0.9])
@pytest.mark.parametrize("rod", ["inextensible", "stretching"])
def test_while_another_shape_lets_go(rod: str, load_factor: float) -> None:
    """The natural shape comes back, the compliance that is lent goes, places and frames move, all with the load factor."""
    end = dx.Clamped(position=(0.3, 0.2, 1.2), tangent=(1, 0, 1), twist=0.6)
    problem = dx.Equilibrium(RODS[rod], end=end, loads=[dx.LineForce((1.0, 0.8, -0.6))])
    assert (Equations(problem, 2).slack > 0.0) == (rod == "inextensible")
    x = np.linspace(0.0, 1.0, 9)
    guess = np.stack([0.3 * np.sin(3.0 * x), 0.2 * x**2, 1.5 * x], axis=1)
    gap = left_over(problem, load_factor=load_factor, start=guess)
    assert gap < BY_DIFFERENCES, f"{gap:.1e}"


def test_transfers_carry_the_difference_of_two_steps() -> None:
    """T_i delta_i - delta_i+1 is the same for every end of the rod: the difference of two steps meets T_i d_i = d_i+1.

    The rotations of T_i are in the fixed frame, those of a step in the section's.
    """
    deltas = []
    for end in (dx.Free(), dx.Clamped(position=(0, 0, 1.5))):
        equations = Equations(dx.Equilibrium(RODS["stretching"], end=end, loads=[DEAD[0]]), 2)
        mesh = drawn(equations, seed=1)
        deltas.append(equations.newton_step(mesh, 0.7).delta)
    T = np.empty((mesh.elements, 12, 12))
    collocation.transfers(equations.system(mesh, 0.7), T.ravel())
    d = deltas[1] - deltas[0]
    d[:, 3:6] = np.einsum("nij,nj->ni", frames.matrix_of_quaternion(mesh.y[:, 3:7]), d[:, 3:6])
    np.testing.assert_allclose(np.einsum("nij,nj->ni", T, d[:-1]), d[1:], atol=1e-11 * np.max(np.abs(d)))


@pytest.mark.parametrize(
    "end", [dx.Free(), dx.Roller(along=UP), dx.Slider(along=UP)], ids=lambda end: type(end).__name__
)
def test_the_sign_of_the_determinant_changes_where_a_column_buckles(end: dx.Free) -> None:
    """A straight rod on four elements, whose softer plane buckles first; the other one does not until 1.4 times the load."""
    critical = {"Free": 0.25, "Roller": 20.190728556 / np.pi**2, "Slider": 4.0}[type(end).__name__] * np.pi**2
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.4, EI2=1.0, GJ=0.75))
    signs = []
    for share in (0.6, 0.95, 1.05, 1.3):
        equations = Equations(dx.Equilibrium(rod, end=end, loads=[dx.EndForce((0, 0, -share * critical))]), 3)
        x = np.linspace(0.0, 1.0, 5)
        points = stage_points(x, 3)
        states = [np.zeros((*at.shape, 13)) for at in (x, points)]
        for y, at in zip(states, (x, points), strict=True):
            y[..., 2], y[..., 3], y[..., 9] = at, 1.0, -share * critical / equations.scale.force
        step = equations.newton_step(Mesh(x, *states), 1.0)
        assert step.length < 1e-12
        signs.append(step.sign)
    assert signs[0] == signs[1] == -signs[2] == -signs[3]


@pytest.mark.parametrize("scale", [0.999999, 1.000001])
def test_a_step_that_is_a_millionth_off_is_seen(scale: float, monkeypatch: pytest.MonkeyPatch) -> None:
    right = Equations.newton_step

    def wrong(self: Equations, mesh: Mesh, load_factor: float) -> Any:
        step = right(self, mesh, load_factor)
        return None if step is None else dataclasses.replace(step, delta=scale * step.delta)

    monkeypatch.setattr(Equations, "newton_step", wrong)
    assert left_over(dx.Equilibrium(BENT, loads=DEAD)) > 10.0 * EXACT
