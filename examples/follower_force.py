"""A follower force: it turns with the tip.

A force that stays across the tip has no potential. Seen from the tip, though, the problem is a
pendulum's initial value problem: with sigma = L - s and psi the angle from the tip's tangent, psi''
= (P / EI) cos(psi), psi(0) = psi'(0) = 0. SciPy integrates it.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_ivp

import darboux as dx

rod = dx.Rod(length=1.0, section=dx.Stiffness(EI1=1.0, GJ=0.75))
clamp = dx.Clamped(tangent=(1, 0, 0), d1=(0, 1, 0))  # d1 across the rod, upwards


def exact_tip(P):
    """From the pendulum: psi, its rate, and the tip seen from the clamp's place in the tip's frame."""

    def rates(_, y):
        return [y[1], P * np.cos(y[0]), np.cos(y[0]), -np.sin(y[0])]

    psi, _, along, across = solve_ivp(rates, (0.0, 1.0), [0, 0, 0, 0], method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    return np.cos(psi) * along - np.sin(psi) * across, np.sin(psi) * along + np.cos(psi) * across


fig, ax = plt.subplots(layout="constrained")
s = np.linspace(0.0, 1.0, 201)
for P in (1.0, 2.0, 5.0, 10.0, 20.0, 40.0):
    bent = dx.solve(dx.Equilibrium(rod, start=clamp, loads=[dx.EndForce((P, 0, 0), follower=True)]))
    assert np.allclose(bent.tip[:2], exact_tip(P), atol=1e-8)
    print(f"P L^2 / EI = {P:4g}   tip ({bent.tip[0]:+.9f}, {bent.tip[1]:+.9f}) L")
    ax.plot(*bent.r(s)[:, :2].T, label=f"{P:g}")
ax.set(xlabel="x / L", ylabel="y / L", aspect="equal")
fig.legend(title="$P L^2 / EI$", loc="outside right upper")
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
