"""A tapered rod: a cone as a cantilever.

A cone that tapers from the radius r0 at its root to r1 at its tip sinks under a small force P by P
L^3 r0 / (3 E I0 r1), with I0 = pi r0^4 / 4. Under a large force it does not.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

import darboux as dx

r0, r1 = 5e-3, 2e-3
steel = dx.Material(E=210e9, nu=0.3)
cone = dx.Rod(length=1.0, section=dx.Circle(radius=lambda s: r0 + (r1 - r0) * s), material=steel)
clamp = dx.Clamped(tangent=(1, 0, 0))
soft = r0 / (3.0 * 210e9 * np.pi / 4.0 * r0**4 * r1)  # m/N

small = dx.solve(dx.Equilibrium(cone, start=clamp, loads=[dx.EndForce((0, 0, -1e-3))]))
print(f"compliance at 1 mN: {-small.tip[2] / 1e-3:.9e} m/N, by the formula {soft:.9e} m/N")
assert abs(-small.tip[2] / 1e-3 / soft - 1.0) < 1e-6

forces = np.array([10.0, 30.0, 60.0, 100.0, 200.0])
sunk = [-dx.solve(dx.Equilibrium(cone, start=clamp, loads=[dx.EndForce((0, 0, -P))])).tip[2] for P in forces]
fig, ax = plt.subplots()
ax.plot([0, *forces], [0, *sunk], "o-", label="darboux")
ax.plot([0, 60], [0, 60 * soft], "--", label="small deflections")
ax.set(xlabel="force (N)", ylabel="the tip sinks by (m)")
ax.legend()
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
