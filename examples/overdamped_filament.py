"""A filament in syrup: bending dies out.

In a viscous fluid inertia hardly matters, and zeta y_t = -EI y''''. The slowest bending of a
clamped filament dies out at the rate beta^4 EI / (zeta L^4), with cos(beta) cosh(beta) = -1: bent
like that mode, it straightens like exp(-rate t).

Source: C. H. Wiggins, D. Riveline, A. Ott, R. E. Goldstein, Biophys. J. 74 (1998) 1043.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

import darboux as dx

zeta, mass = 100.0, 1e-3  # inertia is a disturbance of mass rate / zeta
rod = dx.Rod(length=1.0, section=dx.Stiffness(EI1=1.0, GJ=0.75, EA=1e4, mass=mass), stretch=True)
beta = brentq(lambda b: np.cos(b) * np.cosh(b) + 1.0, 1.0, 3.0)
rate = beta**4 / zeta


def bent(s):
    """The slowest mode, a hundredth high."""
    b, c = beta * s, (np.cos(beta) + np.cosh(beta)) / (np.sin(beta) + np.sinh(beta))
    mode = np.cosh(b) - np.cos(b) - c * (np.sinh(b) - np.sin(b))
    return np.stack([0.005 * mode, 0.0 * s, s], axis=1)


drag = dx.LinearDrag(along=zeta / 2.0, across=zeta)
relaxing = dx.Motion(dx.Equilibrium(rod), duration=2.0 / rate, initial=bent, damping=[drag], rotary_inertia=1e-6)
run = dx.simulate(relaxing, dx.TRBDF2(segments=50))
tip = run.positions[:, -1, 0]
later = run.times > 0.2 / rate
found = -np.polyfit(run.times[later], np.log(tip[later]), 1)[0]
print(f"the tip comes back at the rate {found:.6f} 1/s; beta^4 EI / (zeta L^4) = {rate:.6f} 1/s")
assert abs(found / rate - 1.0) < 5e-3

fig, ax = plt.subplots()
ax.semilogy(run.times, tip, label="darboux")
ax.semilogy(run.times, tip[0] * np.exp(-rate * run.times), "--", label=r"$\exp(-\beta^4 EI t / \zeta L^4)$")
ax.set(xlabel="t (s)", ylabel="the tip, sideways (m)")
ax.legend()
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
