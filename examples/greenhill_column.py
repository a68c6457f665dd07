"""Greenhill's column: how tall a tree may grow.

A column under its own weight stands straight up to w L^3 / EI = (9/4) j^2 = 7.8373, j the first
zero of the Bessel function of order -1/3. A taller one bends over.

Source: A. G. Greenhill, Proc. Camb. Phil. Soc. 4 (1881) 65.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq
from scipy.special import jv

import darboux as dx

rod = dx.Rod(length=1.0, section=dx.Stiffness(EI1=1.0, GJ=0.75))
critical = 9.0 / 4.0 * brentq(lambda x: jv(-1.0 / 3.0, x), 1.0, 3.0) ** 2

fig, ax = plt.subplots(layout="constrained", figsize=(4.5, 4.0))
s = np.linspace(0.0, 1.0, 201)
for part in (0.99, 1.01, 1.05, 1.2, 2.0):
    column = dx.solve(dx.Equilibrium(rod, loads=[dx.LineForce((0, 0, -part * critical))]))
    print(f"w = {part:.2f} of the critical {critical:.6f}: the tip is {column.tip[0]:.6f} L off")
    assert column.stable
    assert (np.hypot(*column.tip[:2]) > 1e-3) == (part > 1.0)
    ax.plot(*column.r(s)[:, [0, 2]].T, label=f"{part:g}")
ax.set(xlabel="x / L", ylabel="z / L", aspect="equal")
fig.legend(title="w over the critical", loc="outside right upper")
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
