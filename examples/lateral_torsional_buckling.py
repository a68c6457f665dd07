"""Lateral torsional buckling: a ruler on edge.

A narrow strip stands on edge as a cantilever, with a dead force at its tip. It tips over and twists
at P L^2 / sqrt(EI GJ) = 4.0126, twice the first zero of the Bessel function of order -1/4, EI being
the small bending stiffness and the other one large.

Sources: A. G. M. Michell, Phil. Mag. 48 (1899) 298; L. Prandtl, Kipperscheinungen, Munich, 1899.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq
from scipy.special import jv

import darboux as dx

EI, GJ = 1.0, 0.8
strip = dx.Rod(length=1.0, section=dx.Stiffness(EI1=1e4, EI2=EI, GJ=GJ))  # stiff about d1, which lies across
critical = 2.0 * brentq(lambda x: jv(-0.25, x), 1.0, 3.0) * np.sqrt(EI * GJ)
on_edge = dx.Clamped(tangent=(1, 0, 0), d1=(0, 1, 0))

parts, sideways = np.array([0.9, 0.995, 1.005, 1.05, 1.1, 1.2]), []
for part in parts:
    bent = dx.solve(dx.Equilibrium(strip, start=on_edge, loads=[dx.EndForce((0, 0, -part * critical))]))
    sideways.append(abs(bent.tip[1]))
    print(f"P = {part:.3f} of the critical {critical:.6f}: the tip moves {sideways[-1]:.6f} L sideways")
    assert (sideways[-1] > 1e-3) == (part > 1.0)

fig, ax = plt.subplots()
ax.plot(parts, sideways, "o-")
ax.axvline(1.0, ls="--", lw=1, color="C5")
ax.set(xlabel="$P / P_{cr}$", ylabel="the tip moves sideways / L")
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
