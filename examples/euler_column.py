"""Euler's column: how far it buckles.

A column that stands clamped at its foot buckles at Pcr = pi^2 EI / (4 L^2). Beyond it the height of
its tip follows from elliptic integrals: P / Pcr = (2 K(k) / pi)^2, height / L = 2 E(k) / K(k) - 1.

Source: A. E. H. Love, A Treatise on the Mathematical Theory of Elasticity, 4th ed., 1927, art. 263.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import darboux as dx

rod = dx.Rod(length=1.0, section=dx.Stiffness(EI1=1.0, GJ=0.75))
critical = np.pi**2 / 4.0


def exact_height(over):
    k = brentq(lambda k: (2.0 * ellipk(k * k) / np.pi) ** 2 - over, 1e-9, 1.0 - 1e-12)
    return 2.0 * ellipe(k * k) / ellipk(k * k) - 1.0


fig, ax = plt.subplots(layout="constrained")
for over in (1.02, 1.1, 1.3, 2.0):
    column = dx.solve(dx.Equilibrium(rod, loads=[dx.EndForce((0, 0, -over * critical))]))
    assert column.stable
    assert abs(column.tip[2] - exact_height(over)) < 1e-8
    print(f"P = {over:4.2f} Pcr   height {column.tip[2]:+.9f} L   exact {exact_height(over):+.9f} L")
    r = column.r(np.linspace(0.0, 1.0, 201))
    ax.plot(np.hypot(r[:, 0], r[:, 1]), r[:, 2], label=f"{over:g} $P_{{cr}}$")
ax.set(xlabel="sideways / L", ylabel="height / L", aspect="equal")
fig.legend(title="load", loc="outside right upper")
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
