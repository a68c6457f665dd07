"""Three equilibria of one column.

Beyond Euler's load a column that bends more easily one way has three equilibria: two buckled, one
to each side, and the straight one, which is unstable. `solve_all` finds them; their heights are
those of the elastica.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import darboux as dx

rod = dx.Rod(length=1.0, section=dx.Stiffness(EI1=1.4, EI2=1.0, GJ=0.75))
P = 3.0
k = brentq(lambda k: ellipk(k * k) ** 2 - P, 1e-9, 1.0 - 1e-12)  # P / Pcr = (2 K / pi)^2
buckled = 2.0 * ellipe(k * k) / ellipk(k * k) - 1.0

found = dx.solve_all(dx.Equilibrium(rod, loads=[dx.EndForce((0, 0, -P))]), most=3)
fig, ax = plt.subplots(figsize=(4.5, 4.0))
s = np.linspace(0.0, 1.0, 201)
for shape, height, unstable in zip(found, (buckled, buckled, 1.0), (0, 0, 1), strict=True):
    print(f"energy {shape.energy.total:.6f}, {shape.index} unstable directions, tip at z = {shape.tip[2]:.9f} L")
    assert abs(shape.tip[2] - height) < 1e-8
    assert shape.index == unstable
    ax.plot(*shape.r(s)[:, [0, 2]].T, "--" if unstable else "-", label="unstable" if unstable else "stable")
ax.set(xlabel="x / L", ylabel="z / L", aspect="equal")
ax.legend()
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
