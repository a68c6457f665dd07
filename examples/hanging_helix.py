"""A helix under its own weight.

A rod of natural curvature (0, 10, 3) / L, clamped with its tangent downwards, GJ / EI = 3/4, for
growing weight. The tips at w L^3 / EI = 20 and 200 are known to eleven digits, from an integration
of high precision that shares no code with this library.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

import darboux as dx

KNOWN = {
    20.0: (0.1426521077168, -0.281071031153, -0.2855246377034),
    200.0: (0.1366541758199, 0.02086734685962, -0.7774631890582),
}
rod = dx.Rod(length=1.0, section=dx.Stiffness(EI1=1.0, GJ=0.75), natural=(0.0, 10.0, 3.0))
clamp = dx.Clamped(tangent=(0, 0, -1), d1=(1, 0, 0))

fig = plt.figure(figsize=(5.5, 5.0), layout="constrained")
ax = fig.add_subplot(projection="3d")
for weight in (0.0, 20.0, 200.0):
    helix = dx.solve(dx.Equilibrium(rod, start=clamp, loads=[dx.LineForce((0, 0, -weight))]))
    print(f"w L^3 / EI = {weight:5g}   tip {np.array2string(helix.tip, precision=9)} L")
    if weight in KNOWN:
        assert np.allclose(helix.tip, KNOWN[weight], atol=1e-9)
    ax.plot(*helix.r(np.linspace(0.0, 1.0, 401)).T, label=f"w L³ / EI = {weight:g}")
ax.set(xlabel="x / L", ylabel="y / L", zlabel="z / L")
ax.set_aspect("equal")
ax.locator_params(nbins=4)
fig.legend(loc="outside left upper")
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
