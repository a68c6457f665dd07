"""The paper's own equations, as printed: a left-handed triad, d3 = d2 x d1.

This is the only module that uses them. With that triad the printed component equations (14), the rotation equation
(17) and the components of gravity are right; read with a right-handed triad they are wrong by order one. The map to
the right-handed form used everywhere else flips the second director:

    d2 -> -d2,   (k1, k2, k3) -> (k1, -k2, k3),   (n1, n2, n3) -> (n1, -n2, n3)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]

FLIP = np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True)
class PaperRod:
    """A straight, uniform, inextensible rod in the paper's letters: EI1, EI2, D in N m^2; weight rho A g in N/m."""

    EI1: float
    EI2: float
    D: float
    weight: float = 0.0


def right_hand_side(rod: PaperRod, theta: Array) -> Array:
    """Return the paper's Sigma(Theta), 18 equations: n (3), k (3), Q (9, rows d1 d2 d3), r (3).

    Source: eqs. (14) with l = 0, (17) written out as dq11/ds ... dq33/ds, r' = (q31, q32, q33), and the components of
    f = -rho A g e3 in the triad d3 = d2 x d1.
    """
    n1, n2, n3, k1, k2, k3 = theta[:6]
    Q = theta[6:15].reshape(3, 3)
    (q11, q12, _), (q21, q22, _), (q31, q32, q33) = Q
    EI1, EI2, D, w = rod.EI1, rod.EI2, rod.D, rod.weight
    f1 = -w * (q22 * q31 - q21 * q32)
    f2 = -w * (q32 * q11 - q12 * q31)
    f3 = -w * (q12 * q21 - q22 * q11)
    dn = [-n2 * k3 + n3 * k2 - f1, n1 * k3 - n3 * k1 - f2, -n1 * k2 + k1 * n2 - f3]
    dk = [(-(EI2 - D) * k3 * k2 - n2) / EI1, (-(D - EI1) * k3 * k1 + n1) / EI2, -(EI1 - EI2) * k1 * k2 / D]
    spin = np.array([[0.0, -k3, k2], [k3, 0.0, -k1], [-k2, k1, 0.0]])
    return np.concatenate([dn, dk, (spin @ Q).ravel(), [q31, q32, q33]])


def integrate_as_printed(
    rod: PaperRod, length: float, k: Array, n: Array, R: Array, s: Array, rtol: float = 1e-8, method: str = "RK45"
) -> Array:
    """Integrate the paper's equations from a right-handed start and return the centreline at s: (n, 3) in m.

    Arguments: ``rod``; ``length`` in m; ``k`` (3,) in 1/m and ``n`` (3,) in N at s = 0, section's frame, right-handed;
    ``R`` (3, 3), columns d1, d2, d3, right-handed; ``s`` (n,) outputs; ``rtol`` and ``method`` of ``solve_ivp``.
    Raises ``RuntimeError`` where ``solve_ivp`` fails.
    """
    start = np.concatenate([n * FLIP, k * FLIP, (R * FLIP).T.ravel(), np.zeros(3)])
    scale = np.concatenate(
        [np.full(3, max(rod.weight * length, 1e-30)), np.full(3, 1.0 / length), np.ones(9), np.full(3, length)]
    )
    found = solve_ivp(
        lambda _, theta: right_hand_side(rod, theta),
        (0.0, length),
        start,
        method=method,
        t_eval=s,
        rtol=rtol,
        atol=rtol * scale * 1e-2,
    )
    if not found.success:
        raise RuntimeError(f"solve_ivp failed on the paper's equations: {found.message}")
    return np.asarray(found.y[15:18].T)
