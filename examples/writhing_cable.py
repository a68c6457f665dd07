"""A twisted cable: when it writhes.

A straight cable is clamped at both ends and twisted; one end may slide along the axis, so that no
force arises. It stays straight up to the moment M with tan(x) = x, x = M L / (2 EI), that is 8.9868
EI / L; then it writhes. The number of unstable directions says when.

Source: A. G. Greenhill, Proc. Inst. Mech. Eng. 34 (1883) 182; for clamped ends J. M. T. Thompson,
A. R. Champneys, Proc. R. Soc. A 452 (1996) 117.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

import darboux as dx

GJ = 0.75
rod = dx.Rod(length=1.0, section=dx.Stiffness(EI1=1.0, GJ=GJ))
critical = 2.0 * brentq(lambda x: np.sin(x) - x * np.cos(x), 4.0, 4.7) / GJ  # rad

for part in (0.99, 1.01):
    cable = dx.Equilibrium(rod, end=dx.Slider(along=(0, 0, 1), position=(0, 0, 1), twist=part * critical))
    straight = dx.solve(cable, dx.DiscreteRod(200, stable=False))
    print(f"{part:.2f} of the critical twist, {critical / dx.turn:.6f} turns: {straight.index} unstable directions")
    assert (straight.index > 0) == (part > 1.0)

ax = plt.figure(figsize=(5.0, 4.0)).add_subplot(projection="3d")
for shortened, turns in ((0.2, 0.0), (0.2, 1.0), (0.2, 2.0)):
    end = dx.Clamped(position=(0, 0, 1 - shortened), twist=turns * dx.turn)
    writhed = dx.solve(dx.Equilibrium(rod, end=end))
    ax.plot(*writhed.r(np.linspace(0.0, 1.0, 401)).T[[2, 0, 1]], label=f"{turns:g} turns: writhe {writhed.writhe:.3f}")
ax.set(xlabel="z / L", ylabel="x / L", zlabel="y / L")
ax.set_aspect("equal")
ax.locator_params(nbins=4)
ax.legend(loc="upper left")
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
