"""A helix by an end moment: figure 6 of the paper.

There is no force, so the moment m is the same vector at every section. The tangent of a round rod
then turns about m at the rate |m| / EI: a helix of curvature sqrt(k1^2 + k2^2) and torsion k3 GJ /
EI, and not of torsion k3, which is the twist of the material.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

import darboux as dx

EI, GJ = 4e-7, 2.6e-7  # N m^2
k = np.array([-25.0, 10.0, -25.0])  # 1/m
rod = dx.Rod(length=0.3, section=dx.Stiffness(EI1=EI, GJ=GJ))
helix = dx.solve(dx.Equilibrium(rod, loads=[dx.EndMoment(np.array([EI, EI, GJ]) * k)]))

kappa, tau = np.hypot(k[0], k[1]), k[2] * GJ / EI
radius, pitch = kappa / (kappa**2 + tau**2), 2.0 * np.pi * abs(tau) / (kappa**2 + tau**2)

# The helix winds about m: the distance from its axis, and the rise along it per turn.
s = np.linspace(0.0, 0.3, 301)
axis = helix.m(0.0) / np.linalg.norm(helix.m(0.0))
across = np.cross(axis, helix.R(0.0)[:, 2])
centre = radius * across / np.linalg.norm(across)
from_axis = helix.r(s) - centre
from_axis -= np.outer(from_axis @ axis, axis)
turns = 0.3 * np.hypot(kappa, tau) / (2.0 * np.pi)
rise = abs(helix.tip @ axis) / turns
print(f"radius {1e3 * np.mean(np.linalg.norm(from_axis, axis=1)):.6f} mm   exact {1e3 * radius:.6f} mm")
print(f"pitch  {1e3 * rise:.6f} mm   exact {1e3 * pitch:.6f} mm")
assert np.allclose(np.linalg.norm(from_axis, axis=1), radius, rtol=1e-8)
assert np.isclose(rise, pitch, rtol=1e-8)

ax = plt.figure(figsize=(4.5, 4.5)).add_subplot(projection="3d")
ax.plot(*(1e3 * helix.r(s)).T)
ax.plot(*(1e3 * (centre + np.outer(np.linspace(0.0, helix.tip @ axis, 2), axis))).T, "--", lw=1, color="C5")
ax.set(xlabel="x (mm)", ylabel="y (mm)", zlabel="z (mm)")
ax.set_aspect("equal")
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
