"""A spinning rod: the critical speed at which it leaves its axis.

A rod stands on the axis about which it spins. It stays straight up to the speed whose square is
that of its lowest natural frequency, rhoA omega^2 L^4 / EI = beta^4 with cos(beta) cosh(beta) = -1;
then it whirls, bent, and stays in that shape.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

import darboux as dx

beta = brentq(lambda b: np.cos(b) * np.cosh(b) + 1.0, 1.0, 3.0)
rod = dx.Rod(length=1.0, section=dx.Stiffness(EI1=1.0, GJ=0.75, mass=1.0))

speeds = beta**2 * np.array([0.9, 0.995, 1.005, 1.02, 1.1, 1.3, 1.6, 2.0])
radii = []
for speed in speeds:
    rod_at_speed = dx.solve(dx.Equilibrium(rod, loads=[dx.Rotation((0, 0, speed))]))
    radii.append(np.hypot(*rod_at_speed.tip[:2]))
    print(f"omega = {speed / beta**2:.3f} of the critical {beta**2:.6f}: the tip is {radii[-1]:.6f} L off the axis")
    assert (radii[-1] > 1e-3) == (speed > beta**2)

fig, ax = plt.subplots()
ax.plot(speeds / beta**2, radii, "o-")
ax.axvline(1.0, ls="--", lw=1, color="C5")
ax.set(xlabel="speed over the critical speed", ylabel="the tip's distance from the axis / L")
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
