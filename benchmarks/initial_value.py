"""One initial value problem: the paper's figure 6 with its own weight, 200 outputs, against SciPy's RK45.

The paper prints neither weight nor start force for figure 6: the density is that of figure 5, and the force at the
start carries the rod's weight, so that none is left at the end. All integrate the same 13 dimensionless states at the
same tolerances, rtol 1e-8 and atol 1e-10. SciPy gets three right-hand sides, all written for this very problem: NumPy
on small arrays, as a competent user writes it; plain Python numbers, which are faster for vectors this short; and
compiled by numba. Of the compiled ones (one written for this problem, and our own kernel) SciPy gets the faster.
The plot has tolerances from 1e-4 to 1e-12, and of SciPy's methods the best for strict ones too, DOP853.
The truth is SciPy's DOP853 at rtol 1e-13 with the NumPy right-hand side, which shares no code with ours.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import darboux as dx
from benchmarks.timing import Curve, Row, Spread, interleaved, seconds
from darboux.kernels import dormand_prince, rod_equations
from darboux.packing import coefficients
from darboux.packing.scale import Scale
from darboux.paper.cases import FIGURE6_D, FIGURE6_EI, FIGURE6_K

Array = NDArray[np.float64]
RightHandSide = Callable[[float, Array], Any]

RTOL, OUTPUTS, MOST_STEPS = 1e-8, 200, 100_000  # atol is a hundredth of rtol
RTOLS = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)  # of the plot
LENGTH, MASS = 0.3, 1e3 * np.pi * 0.5e-3**2  # m; kg/m of the printed radius and the density of figure 5
WEIGHT = MASS * 9.81  # N/m

# Dimensionless, with L, EI / L^2 and EI / L: compliances, and the weight that n loses per length.
C1, C2, C3 = 1.0, 1.0, FIGURE6_EI / FIGURE6_D
W = WEIGHT * LENGTH**3 / FIGURE6_EI
COMPLIANCE = np.array([C1, C2, C3])
FORCE = np.array([0.0, 0.0, W])  # n' = -f


def with_numpy(_: float, y: Array) -> Array:
    """Return y' of r (3), q (4), n (3), m (3), on small arrays."""
    w, x, y_, z = q = y[3:7]
    n, m = y[7:10], y[10:13]
    R = np.array(
        [
            [w * w + x * x - y_ * y_ - z * z, 2.0 * (x * y_ - w * z), 2.0 * (x * z + w * y_)],
            [2.0 * (x * y_ + w * z), w * w - x * x + y_ * y_ - z * z, 2.0 * (y_ * z - w * x)],
            [2.0 * (x * z - w * y_), 2.0 * (y_ * z + w * x), w * w - x * x - y_ * y_ + z * z],
        ]
    ) / (q @ q)  # fmt: skip
    k = COMPLIANCE * (m @ R)
    t = R[:, 2]
    dy = np.empty(13)
    dy[:3] = t
    dy[3:7] = 0.5 * (np.array([[-x, -y_, -z], [w, -z, y_], [z, w, -x], [-y_, x, w]]) @ k)
    dy[7:10] = FORCE
    dy[10] = n[1] * t[2] - n[2] * t[1]
    dy[11] = n[2] * t[0] - n[0] * t[2]
    dy[12] = n[0] * t[1] - n[1] * t[0]
    return dy


def _components(
    q0: float, q1: float, q2: float, q3: float, n1: float, n2: float, n3: float, m1: float, m2: float, m3: float
) -> tuple[float, ...]:
    """Return the 13 components of y', number by number."""
    p = 2.0 / (q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
    x1, x2, x3 = 1.0 - p * (q2 * q2 + q3 * q3), p * (q1 * q2 + q0 * q3), p * (q1 * q3 - q0 * q2)  # d1
    y1, y2, y3 = p * (q1 * q2 - q0 * q3), 1.0 - p * (q1 * q1 + q3 * q3), p * (q2 * q3 + q0 * q1)  # d2
    t1, t2, t3 = p * (q1 * q3 + q0 * q2), p * (q2 * q3 - q0 * q1), 1.0 - p * (q1 * q1 + q2 * q2)  # d3 = r'
    k1 = C1 * (x1 * m1 + x2 * m2 + x3 * m3)
    k2 = C2 * (y1 * m1 + y2 * m2 + y3 * m3)
    k3 = C3 * (t1 * m1 + t2 * m2 + t3 * m3)
    return (
        t1, t2, t3,
        0.5 * (-q1 * k1 - q2 * k2 - q3 * k3), 0.5 * (q0 * k1 - q3 * k2 + q2 * k3),
        0.5 * (q3 * k1 + q0 * k2 - q1 * k3), 0.5 * (-q2 * k1 + q1 * k2 + q0 * k3),
        0.0, 0.0, W,
        n2 * t3 - n3 * t2, n3 * t1 - n1 * t3, n1 * t2 - n2 * t1,
    )  # fmt: skip


def with_python(_: float, y: Array) -> tuple[float, ...]:
    return _components(*y[3:].tolist())


_compiled_components = numba.njit(error_model="numpy", fastmath={"contract"})(_components)


@numba.njit(error_model="numpy", fastmath={"contract"})
def compiled(_: float, y: Array) -> Array:
    dy = np.empty(13)
    (
        dy[0], dy[1], dy[2], dy[3], dy[4], dy[5], dy[6], dy[7], dy[8], dy[9], dy[10], dy[11], dy[12],
    ) = _compiled_components(y[3], y[4], y[5], y[6], y[7], y[8], y[9], y[10], y[11], y[12])  # fmt: skip
    return dy


def _by_our_kernel(c: Array) -> RightHandSide:
    def derivative(_: float, y: Array) -> Array:
        dy = np.empty(13)
        rod_equations.derivative(y, c, dy)
        return dy

    return derivative


def rows(quick: bool) -> Iterator[Row | Curve]:
    rod = dx.Rod(length=LENGTH, section=dx.Stiffness(EI1=FIGURE6_EI, GJ=FIGURE6_D, mass=MASS))
    problem = dx.Equilibrium(rod, loads=[dx.Gravity()])
    scale = Scale.of(problem)
    table = coefficients.table(problem, scale)
    data = (table.breaks, table.coefficients.ravel(), table.degree)
    n0 = np.array([0.0, 0.0, -WEIGHT * LENGTH])
    m0 = np.array([FIGURE6_EI, FIGURE6_EI, FIGURE6_D]) * FIGURE6_K
    y0 = np.concatenate([np.zeros(3), [1.0, 0.0, 0.0, 0.0], n0 / scale.force, m0 / scale.moment])
    s = np.linspace(0.0, 1.0, OUTPUTS)
    states = np.empty(OUTPUTS * 13)

    def scipy(right_hand_side: RightHandSide, rtol: float = RTOL, method: str = "RK45") -> Array:
        found = solve_ivp(right_hand_side, (0.0, 1.0), y0, method=method, t_eval=s, rtol=rtol, atol=0.01 * rtol)
        return np.asarray(found.y[:3].T)

    def kernel(rtol: float = RTOL) -> Array:
        dormand_prince.integrate(y0, s, *data, rtol, 0.01 * rtol, MOST_STEPS, states)
        return states.reshape(-1, 13)[:, :3]

    def public(rtol: float = RTOL) -> Array:
        return dx.integrate(rod, k=FIGURE6_K, n=n0, loads=[dx.Gravity()], rtol=rtol).r(LENGTH * s) / LENGTH

    candidates: dict[str, RightHandSide] = {"its own": compiled, "our kernel": _by_our_kernel(data[1])}
    for candidate in candidates.values():
        scipy(candidate)
    chosen = min(candidates, key=lambda name: min(seconds(lambda: scipy(candidates[name])) for _ in range(5)))
    sides: dict[str, tuple[RightHandSide, tuple[float | None, float | None]]] = {
        "NumPy right-hand side": (with_numpy, (300.0, None)),
        "plain Python right-hand side": (with_python, (None, None)),
        f"compiled right-hand side ({chosen})": (candidates[chosen], (60.0, None)),
    }

    truth = solve_ivp(with_numpy, (0.0, 1.0), y0, method="DOP853", t_eval=s, rtol=1e-13, atol=1e-15).y[:3].T
    errors = [_distance(kernel(), truth), _distance(public(), truth)]
    for side, (right_hand_side, targets) in sides.items():
        theirs = _distance(scipy(right_hand_side), truth)
        times = interleaved(kernel, public, partial(scipy, right_hand_side), rounds=11 if quick else 101)
        key = side.split()[0].lower()
        names = (("kernel", "kernel dormand_prince.integrate"), ("public", "darboux.integrate"))
        for i, (name, what) in enumerate(names):
            at_equal_error = float(np.median(times[2] / times[i])) * (theirs / errors[i]) ** 0.2
            yield Row(
                name=f"initial_value.{name}.{key}",
                what=f"figure 6 with weight, {what}",
                ours=Spread.of(1e6 * times[i]),
                unit="us",
                peer=f"solve_ivp(RK45), {side}",
                theirs=Spread.of(1e6 * times[2]),
                ratio=Spread.of(times[2] / times[i]),
                least_ratio=targets[i],
                our_error=errors[i],
                their_error=theirs,
                error_of="centreline / L",
                note=f"{at_equal_error:.0f}x at equal error (order 5)",
            )

    side = candidates[chosen]
    ways: dict[str, Callable[[float], Array]] = {
        "our kernel": kernel,
        "darboux.integrate": public,
        "RK45, compiled": partial(scipy, side),
        "DOP853, compiled": partial(scipy, side, method="DOP853"),
    }
    found = {label: _by_tolerance(way, truth, rounds=3 if quick else 15) for label, way in ways.items()}
    for label, (at, cost) in found.items():
        yield Curve("initial_value.error", label, at, cost, peer="compiled" in label)


def _by_tolerance(
    solve: Callable[[float], Array], truth: Array, rounds: int
) -> tuple[tuple[float, ...], tuple[Spread, ...]]:
    """Return errors and times in ms at each tolerance of the plot."""
    errors = tuple(_distance(solve(rtol), truth) for rtol in RTOLS)
    times = interleaved(*(partial(solve, rtol) for rtol in RTOLS), rounds=rounds)
    return errors, tuple(Spread.of(1e3 * t) for t in times)


def _distance(r: Array, truth: Array) -> float:
    """Return the largest distance between two centrelines (n, 3)."""
    return float(np.max(np.linalg.norm(r - truth, axis=1)))
