"""Discrete rods against an oracle that knows frames and the strains' definition, and differentiates by differences.

The oracle's chart: transport each edge's directors from the base tangent, turn them by theta, measure the strains.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import solve_banded
from scipy.spatial.transform import Rotation

from darboux.kernels import band
from darboux.kernels import discrete_rod as der

Array = NDArray[np.float64]

GHOSTS = {"free": (0, 0), "clamp in front": (1, 0), "clamp behind": (0, 1), "clamps": (1, 1)}
RNG_SEED = 20


class Rod(NamedTuple):
    state: der.State
    elasticity: der.Elasticity
    loads: der.Loads


def symmetric(six: Array) -> Array:
    """The 3 x 3 matrices of rows 11, 22, 33, 23, 13, 12."""
    s11, s22, s33, s23, s13, s12 = np.moveaxis(np.reshape(six, (-1, 6)), -1, 0)
    return np.moveaxis(np.array([[s11, s12, s13], [s12, s22, s23], [s13, s23, s33]]), -1, 0)


def random_rod(edges: int, ghosts: tuple[int, int], seed: int = RNG_SEED, turn: float = 1.2) -> Rod:
    """A rod whose edges turn by about `turn` (rad) in any direction, everything about it random and of order one."""
    rng = np.random.default_rng(seed)
    rotation, frames = Rotation.random(random_state=seed), []
    for _ in range(edges + 2):
        frames.append(rotation.as_matrix())
        rotation = Rotation.from_rotvec(turn * rng.uniform(-1, 1, 3)) * rotation
    R = np.array(frames)
    rest = rng.uniform(0.5, 1.5, edges)
    x = np.vstack([np.zeros(3), np.cumsum((rest * rng.uniform(0.9, 1.1, edges))[:, None] * R[1:-1, :, 2], axis=0)])
    root = rng.uniform(-1, 1, (edges + 1, 3, 3))
    B = root @ root.transpose(0, 2, 1) + 0.5 * np.eye(3)
    C = rng.uniform(-1, 1, (edges + 1, 6))
    B6 = np.stack([B[:, 0, 0], B[:, 1, 1], B[:, 2, 2], B[:, 1, 2], B[:, 0, 2], B[:, 0, 1]], axis=1)
    state = der.State(x.ravel(), R[:, :, 2].ravel(), R[:, :, 0].ravel(), 2 * np.pi * rng.integers(-2, 3, edges + 1))
    elasticity = der.Elasticity(
        B6.ravel(), rng.uniform(-1, 1, 3 * (edges + 1)), rest, rng.uniform(1, 9, edges), rng.uniform(-2, 2, edges),
        1 - ghosts[0], edges + ghosts[1],
    )  # fmt: skip
    return Rod(state, elasticity, der.Loads(rng.uniform(-1, 1, 3 * (edges + 1)), C.ravel()))


# The oracle: its arrays may have any number of leading axes, and may be complex


def norm(v: Array) -> Array:
    return np.sqrt(np.sum(v * v, axis=-1, keepdims=True))


def oracle_move(state: der.State, q: Array) -> tuple[Array, Array]:
    """Vertices x and frames R (columns d1, d2, t) after a packed step q from the state."""
    steps = np.concatenate([q, np.zeros((*q.shape[:-1], 1))], axis=-1).reshape(*q.shape[:-1], -1, 4)
    x = state.x.reshape(-1, 3) + steps[..., :3]
    t, d1 = (np.broadcast_to(v.reshape(-1, 3), (*q.shape[:-1], v.size // 3, 3)).astype(q.dtype) for v in state[1:3])
    old, e = t[..., 1:-1, :].copy(), np.diff(x, axis=-2)
    t[..., 1:-1, :] = new = e / norm(e)
    axis, d, angle = np.cross(old, new), d1[..., 1:-1, :], steps[..., :-1, 3:]
    cosine = np.sum(old * new, axis=-1, keepdims=True)
    d = d + np.cross(axis, d) + np.cross(axis, np.cross(axis, d)) / (1 + cosine)  # Rodrigues
    d1[..., 1:-1, :] = np.cos(angle) * d + np.sin(angle) * np.cross(new, d)
    return x, np.stack([d1, np.cross(t, d1), t], axis=-1)


def oracle_strains(R: Array, m: Array) -> Array:
    """Curvature: kb = 2 a x b / (1 + a.b) on the directors half way. Twist: against the frame carried over."""
    Ra, Rb = R[..., :-1, :, :], R[..., 1:, :, :]
    a, b = Ra[..., 2], Rb[..., 2]
    chi = 1 + np.sum(a * b, axis=-1, keepdims=True)
    kb = 2 * np.cross(a, b) / chi
    carried = Ra[..., 0] - np.sum(Ra[..., 0] * b, axis=-1, keepdims=True) / chi * (a + b)
    y = np.sum(np.cross(carried, Rb[..., 0]) * b, axis=-1)
    x = np.sum(carried * Rb[..., 0], axis=-1)
    angle = 2 * np.arctan(y / (np.sqrt(x * x + y * y) + x))
    twist = angle + 2 * np.pi * np.round((m - angle.real) / (2 * np.pi))
    bending = np.einsum("...i,...ik->...k", kb, (Ra + Rb)[..., :2]) / (2 * np.cos(twist / 2))[..., None]
    return np.concatenate([bending, twist[..., None]], axis=-1)


def oracle_energy(rod: Rod, q: Array) -> Array:
    elasticity = rod.elasticity
    x, R = oracle_move(rod.state, q)
    strain = oracle_strains(R, rod.state.m) - elasticity.kappa0.reshape(-1, 3)
    springs = np.einsum("...ik,ikl,...il->...i", strain, symmetric(elasticity.B), strain) / 2
    eps = norm(np.diff(x, axis=-2))[..., 0] / elasticity.l - 1
    stretching = (elasticity.EA * eps**2 / 2 + elasticity.T * eps) * elasticity.l
    f, C = rod.loads.f.reshape(-1, 3), symmetric(rod.loads.C)
    works = np.einsum("ik,...ik->...i", f, x) + np.einsum("...ik,ikl,...il->...i", x, C, x) / 2
    elastic = springs[..., elasticity.first : elasticity.stop].sum(axis=-1) + stretching.sum(axis=-1)
    return elastic - works.sum(axis=-1)


def oracle_gradient(rod: Rod, q: Array) -> Array:
    """By complex step: exact."""
    n = q.shape[-1]
    return oracle_energy(rod, q[..., None, :] + 1e-30j * np.eye(n)).imag / 1e-30


def oracle_forces(rod: Rod, M: Array, q: Array) -> Array:
    """Generalised forces M.(d phi / d q) of couples anywhere in the chart, d phi the axial vector of dR R^T: exact."""
    _, R = oracle_move(rod.state, q[..., None, :] + 1e-30j * np.eye(q.shape[-1]))
    spin = np.einsum("...ik,...jk->...ij", R.imag / 1e-30, R.real)[..., 1:-1, :, :]
    phi = np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], axis=-1)
    return np.einsum("...jk,jk->...", phi, M.reshape(-1, 3))


def slope(function: Callable[[Array], Array], n: int, h: float = 2e-3) -> Array:
    """The Jacobian at 0 by sixth-order central differences, errors about h^6 and 1e-16 / h."""
    d1, d2, d3 = (function(k * h * np.eye(n)) - function(-k * h * np.eye(n)) for k in (1, 2, 3))
    return np.asarray((45 * d1 - 9 * d2 + d3) / (60 * h)).T


# The kernels, and what one does with them


def unknowns(rod: Rod) -> int:
    return 4 * rod.elasticity.l.size + 3


def derivatives(rod: Rod) -> tuple[float, Array, Array]:
    """Energy, gradient and lower band; the results' arrays come dirty."""
    n = unknowns(rod)
    gradient, lower = np.full(n, np.nan), np.full(band.LOWER * n, np.nan)
    value = der.energy_gradient_hessian(*rod, np.full(der.WORK, np.nan), gradient, lower)
    return value, gradient, lower


def dense(general: Array) -> Array:
    """The matrix of a general band."""
    n = general.size // band.FULL
    A, rows = np.zeros((n, n)), general.reshape(n, band.FULL)
    for j in range(n):
        i = np.arange(max(0, j - band.REACH), min(n, j + band.LOWER))
        A[i, j] = rows[j, band.REACH + i - j]
    return A


def expanded(lower: Array) -> Array:
    n = lower.size // band.LOWER
    general = np.empty(band.FULL * n)
    band.expand(lower, n, general)
    return general


def moved(rod: Rod, step: Array, scale: float = 1.0) -> Rod:
    """The rod after a step, with its twists brought up to date."""
    state = der.State(*(np.full_like(v, np.nan) for v in rod.state[:3]), rod.state.m.copy())
    der.advance(rod.state, step, scale, state)
    der.strains(state, rod.elasticity.first, rod.elasticity.stop, np.empty(3 * state.m.size))
    return rod._replace(state=state)


def energy(rod: Rod) -> float:
    return float(der.energy(*rod, np.empty(4)))


def straight_rod(edges: int, length: float = 1.0) -> Rod:
    """Along e3 from a clamp at 0, unit bending and twisting stiffness, inextensible by penalty, no load."""
    l = length / edges
    x = np.zeros((edges + 1, 3))
    x[:, 2] = np.linspace(0, length, edges + 1)
    frames = np.tile(np.eye(3), (edges + 2, 1, 1))
    V = np.full(edges + 1, l)
    V[[0, -1]] /= 2
    B = np.zeros((edges + 1, 6))
    B[:, :3] = 1 / V[:, None]
    state = der.State(x.ravel(), frames[:, 2].ravel(), frames[:, 0].ravel(), np.zeros(edges + 1))
    zero = np.zeros(edges)
    elasticity = der.Elasticity(B.ravel(), np.zeros(3 * edges + 3), zero + l, zero + 1e4, zero, 0, edges)
    return Rod(state, elasticity, der.Loads(np.zeros(3 * edges + 3), np.zeros(6 * edges + 6)))


# Derivatives


@pytest.mark.parametrize("ghosts", GHOSTS.values(), ids=GHOSTS)
@pytest.mark.parametrize("edges", [1, 2, 5])
def test_energy_gradient_and_hessian_are_the_oracles(edges: int, ghosts: tuple[int, int]) -> None:
    rod = random_rod(edges, ghosts)
    n = unknowns(rod)
    value, gradient, lower = derivatives(rod)
    assert value == pytest.approx(oracle_energy(rod, np.zeros(n)), rel=1e-13)
    assert value == pytest.approx(energy(rod), rel=1e-13)
    np.testing.assert_allclose(gradient, oracle_gradient(rod, np.zeros(n)), atol=1e-13 * abs(gradient).max())
    hessian = dense(expanded(lower))
    np.testing.assert_allclose(hessian, slope(lambda q: oracle_gradient(rod, q), n), atol=1e-9 * abs(hessian).max())


@pytest.mark.parametrize("seed", range(5))
def test_taylor_remainders_are_of_second_and_third_order(seed: int) -> None:
    rod = random_rod(12, (1, 1), seed)
    value, gradient, lower = derivatives(rod)
    u = np.random.default_rng(seed).uniform(-1, 1, gradient.size)
    first, second = gradient @ u, u @ dense(expanded(lower)) @ u / 2
    h = np.array([4e-3, 2e-3, 1e-3])
    remainder1 = np.array([energy(moved(rod, u, s)) - value - s * first for s in h])
    remainder2 = remainder1 - h**2 * second
    np.testing.assert_allclose(remainder1[:-1] / remainder1[1:], 4, rtol=0.05)
    np.testing.assert_allclose(remainder2[:-1] / remainder2[1:], 8, rtol=0.1)


@pytest.mark.parametrize("edges", [1, 4])
def test_couples_residual_and_tangent_are_the_oracles(edges: int) -> None:
    rod = random_rod(edges, (0, 0))
    n = unknowns(rod)
    M = np.random.default_rng(3).uniform(-1, 1, 3 * edges)
    residual, general = np.zeros(n), np.zeros(band.FULL * n)
    der.add_couples(rod.state, M, residual, general)
    np.testing.assert_allclose(residual, -oracle_forces(rod, M, np.zeros(n)), atol=1e-14)
    tangent = dense(general)
    assert abs(tangent - tangent.T).max() > 0.1
    np.testing.assert_allclose(tangent, -slope(lambda q: oracle_forces(rod, M, q), n), atol=1e-10)


# Frames and invariance


def test_a_step_moves_the_frames_as_the_oracle_does() -> None:
    rod = random_rod(6, (1, 1))
    step = np.random.default_rng(4).uniform(-0.6, 0.6, unknowns(rod))
    x, R = oracle_move(rod.state, 0.7 * step)
    state = moved(rod, step, 0.7).state
    np.testing.assert_allclose(state.x, x.ravel(), atol=1e-15)
    np.testing.assert_allclose(state.t, R[..., 2].ravel(), atol=1e-14)
    np.testing.assert_allclose(state.d1, R[..., 0].ravel(), atol=1e-14)


def test_strains_are_the_oracles() -> None:
    rod = random_rod(6, (1, 0))
    kappa = np.full(21, np.nan)
    _, R = oracle_move(rod.state, np.zeros(27))
    expected = oracle_strains(R, rod.state.m)
    der.strains(rod.state, rod.elasticity.first, rod.elasticity.stop, kappa)
    np.testing.assert_allclose(kappa.reshape(-1, 3)[:-1], expected[:-1], atol=1e-14)
    np.testing.assert_array_equal(kappa[-3:], 0.0)
    np.testing.assert_array_equal(rod.state.m[:-1], kappa[2:-3:3])


@pytest.mark.parametrize("ghosts", GHOSTS.values(), ids=GHOSTS)
def test_elastic_energy_does_not_feel_a_rigid_motion(ghosts: tuple[int, int]) -> None:
    rod = random_rod(6, ghosts)
    rod = rod._replace(loads=der.Loads(*map(np.zeros_like, rod.loads)))
    Q, shift = Rotation.random(random_state=1).as_matrix(), np.array([1.0, -2.0, 3.0])
    x, t, d1 = (v.reshape(-1, 3) @ Q.T for v in rod.state[:3])
    turned = rod._replace(state=der.State((x + shift).ravel(), t.ravel(), d1.ravel(), rod.state.m))
    assert energy(turned) == pytest.approx(energy(rod), rel=1e-13)
    if ghosts == (0, 0):  # then the gradient has no resultant force and moment
        gradient = np.append(derivatives(rod)[1], 0.0).reshape(-1, 4)
        moment = np.cross(rod.state.x.reshape(-1, 3), gradient[:, :3]).sum(axis=0)
        moment += gradient[:-1, 3] @ rod.state.t.reshape(-1, 3)[1:-1]
        np.testing.assert_allclose(gradient[:, :3].sum(axis=0), 0.0, atol=1e-13)
        np.testing.assert_allclose(moment, 0.0, atol=1e-12)


def test_parts_of_the_energy() -> None:
    rod = random_rod(5, (1, 1))
    parts = np.empty(4)
    total = der.energy(*rod, parts)
    assert parts.sum() == pytest.approx(total, rel=1e-14)
    assert -parts[3] == pytest.approx(oracle_energy(rod._replace(loads=der.Loads(0 * rod.loads.f, 0 * rod.loads.C)),
                                                    np.zeros(23)) - total)  # fmt: skip


# Limits


def test_straight_rod_has_the_beams_matrix() -> None:
    """Bending B/l^3 (1 -4 6 -4 1), twist B/l (-1 2 -1), stretching EA/l (-1 2 -1), no force, all stable."""
    edges, rod = 8, straight_rod(8)
    l = 1 / edges
    value, gradient, lower = derivatives(rod)
    assert value == 0.0
    np.testing.assert_allclose(gradient, 0.0, atol=1e-11)  # rounding of |e| times the penalty
    hessian = dense(expanded(lower))
    for component in (0, 1):
        row = hessian[16 + component, component::4]
        np.testing.assert_allclose(row[2:7], np.array([1, -4, 6, -4, 1]) / l**3, rtol=1e-10)
    np.testing.assert_allclose(hessian[18, 2::4][3:6], np.array([-1, 2, -1]) * 1e4 / l, rtol=1e-10)
    np.testing.assert_allclose(hessian[19, 3::4][3:6], np.array([-1, 2, -1]) / l, rtol=1e-10)
    fixed = np.arange(gradient.size) < 3
    band.fix(lower, gradient, fixed)
    assert band.factor(lower, gradient.size) == 0


@pytest.mark.parametrize("angle", [1e-9, 1e-5, 1e-2])
def test_small_turns_keep_their_relative_accuracy(angle: float) -> None:
    """kappa1 = 2 tan(angle/2) for a turn about d1, and a twist m = angle."""
    d1, t = np.tile([1.0, 0.0, 0.0], 2), np.array([0.0, 0.0, 1.0, 0.0, -np.sin(angle), np.cos(angle)])
    kappa = np.empty(3)
    der.strains(der.State(np.zeros(3), t, d1, np.zeros(1)), 0, 1, kappa)
    np.testing.assert_allclose(kappa, [2 * np.tan(angle / 2), 0.0, 0.0], rtol=1e-14, atol=1e-30)
    turned = np.array([1.0, 0.0, 0.0, np.cos(angle), np.sin(angle), 0.0])
    der.strains(der.State(np.zeros(3), np.tile([0.0, 0.0, 1.0], 2), turned, np.zeros(1)), 0, 1, kappa)
    np.testing.assert_allclose(kappa, [0.0, 0.0, angle], rtol=1e-14, atol=1e-30)


def folded(angle: float) -> Rod:
    """Two edges, the second turned by an angle (rad) about d1."""
    rod = straight_rod(2)
    R = Rotation.from_rotvec([angle, 0.0, 0.0]).as_matrix()
    rod.state.x[6:] = rod.state.x[3:6] + R[:, 2] / 2
    rod.state.t[6:9] = R[:, 2]
    return rod


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # which NumPy gives where the kernels run uncompiled
def test_energy_grows_towards_a_fold_and_is_infinite_there() -> None:
    values = [energy(folded(np.pi - gap)) for gap in (1e-1, 1e-2, 1e-4)]
    np.testing.assert_allclose(values, [2 * (2 / np.tan(gap / 2)) ** 2 / 2 for gap in (1e-1, 1e-2, 1e-4)], rtol=1e-6)
    for angle in (np.pi - 1e-7, np.pi, np.pi + 1e-7):
        assert energy(folded(angle)) == np.inf
        value, gradient, lower = derivatives(folded(angle))
        assert value == np.inf
        assert not np.isfinite(gradient).all()
        assert band.factor(lower, gradient.size) == -1


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # which NumPy gives where the kernels run uncompiled
@pytest.mark.parametrize("shift", [-0.5, -1.0], ids=["to nothing", "exactly round"])
def test_lost_frame_makes_the_energy_infinite(shift: float) -> None:
    rod = straight_rod(2)
    step = np.zeros(11)
    step[10] = shift
    assert energy(moved(rod, step)) == np.inf


def test_twist_is_followed_through_many_turns() -> None:
    rod = straight_rod(3)
    step = np.zeros(15)
    step[[7, 11]] = 1.0  # the second and third edge turn, the first does not
    for count in range(1, 31):
        rod = moved(rod, step)
        np.testing.assert_allclose(rod.state.m[:3], [0.0, count, 0.0], atol=1e-13)
    assert energy(rod) == pytest.approx(3 * 30**2 / 2)
    assert derivatives(rod)[1][7] == pytest.approx(3 * 30)


# Equilibria


def cantilever_in_a_circle(edges: int, M: float) -> tuple[Rod, Array]:
    """The exact shape under a tip couple about e1, and the turns: M = (2 tau + 2 tau^3) B / V, tau = tan(turn / 2)."""
    rod = straight_rod(edges)
    V = 1 / rod.elasticity.B.reshape(-1, 6)[:-1, 0]
    tau = [np.roots([2, 0, 2, -M * v])[-1].real for v in V]
    turns = 2 * np.arctan(tau)
    R = Rotation.from_rotvec(np.outer(np.cumsum(turns), [1.0, 0.0, 0.0])).as_matrix()
    rod.state.t[3:-3] = R[:, :, 2].ravel()
    rod.state.x[3:] = np.cumsum(R[:, :, 2] / edges, axis=0).ravel()
    return rod, turns


@pytest.mark.parametrize(
    ("edges", "inner", "root", "tip"),
    [
        (10, 0.56417634650112, 0.30455448101132, (-0.1082492260556, 0.03327732040587)),
        (20, 0.30455448101132, 0.15581219315302, (-0.03147554546879, 0.002920229518616)),
        (40, 0.15581219315302, 0.078379104886889, (-0.00813924860027, 0.0002025119491006)),
    ],
)
def test_tip_couple_winds_a_cantilever_into_the_discrete_circle(
    edges: int, inner: float, root: float, tip: tuple[float, float]
) -> None:
    """Tip couple 2 pi B / L: closed form of the discrete model; Newton returns to it from a disturbed shape."""
    exact, turns = cantilever_in_a_circle(edges, 2 * np.pi)
    np.testing.assert_allclose(turns, [root] + [inner] * (edges - 1), rtol=1e-13)
    np.testing.assert_allclose(exact.state.x[[-1, -2]] * [1, -1], tip, atol=1e-12)
    n, M = unknowns(exact), np.zeros(3 * edges)
    M[-3] = 2 * np.pi
    fixed = np.arange(n) < 3

    rod = moved(exact, np.random.default_rng(5).uniform(-0.02, 0.02, n) / edges * ~fixed)
    sizes = []
    for _ in range(20):
        _, residual, lower = derivatives(rod)
        general = expanded(lower)
        der.add_couples(rod.state, M, residual, general)
        band.fix_general(general, residual, fixed)
        step = solve_banded((band.REACH, band.REACH), general.reshape(n, band.FULL).T, -residual)
        sizes.append(abs(step).max())
        rod = moved(rod, step)
        if sizes[-1] < 1e-11:
            break
    np.testing.assert_allclose(rod.state.x, exact.state.x, atol=1e-11)
    assert sizes[-1] < 1e3 * sizes[-2] ** 2 + 1e-13, f"steps should shrink quadratically: {sizes}"


@pytest.mark.parametrize(
    ("edges", "weight", "tip"),
    [
        (8, 1.0, (0.9910633041, 0.12532202163)),
        (16, 1.0, (0.99120140728, 0.12393150686)),
        (16, 10.0, (0.65726317134, 0.7005177258)),
    ],
)
def test_heavy_cantilever(edges: int, weight: float, tip: tuple[float, float]) -> None:
    """Inextensible by an augmented Lagrangian, weight lumped to the vertices; digits of an independent planar code."""
    rod = straight_rod(edges)
    rod.loads.f[1::3] = -weight / edges
    rod.loads.f[[1, -2]] /= 2
    n = unknowns(rod)
    fixed = np.arange(n) < 3
    for _ in range(100):
        value, gradient, lower = derivatives(rod)
        band.fix(lower, gradient, fixed)
        negative = band.factor(lower, n)
        step = -gradient
        band.solve(lower, n, step)
        scale = 1.0 if step @ gradient < 0 else -1.0
        while abs(scale) > 1e-6 and energy(moved(rod, step, scale)) > value + 1e-12 * (1 + abs(value)):
            scale /= 2
        rod = moved(rod, step, scale)
        if abs(step).max() < 1e-7:
            stretched = np.linalg.norm(np.diff(rod.state.x.reshape(-1, 3), axis=0), axis=1) / rod.elasticity.l - 1
            rod.elasticity.T[:] += rod.elasticity.EA * stretched
            if abs(stretched).max() < 1e-13:
                break
    assert negative == 0
    np.testing.assert_allclose(rod.state.x[[-1, -2]] * [1, -1], tip, atol=2e-10)
