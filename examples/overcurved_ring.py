"""An overcurved ring: it coils to three loops.

A ring is made of a rod whose natural curvature is that of a smaller ring. It leaves its plane, more so the smaller that ring is; with
three times the curvature it lies coiled in three loops, free of stress. Two loops it can't make: they would need a turn of twist.

Source: B. Audoly, K. A. Seffen, J. Elasticity 119 (2015) 293.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

import darboux as dx

section = dx.Stiffness(EI1=1.0, GJ=0.75)
s = np.linspace(0.0, 1.0, 601)

ax = plt.figure(figsize=(5.0, 4.0)).add_subplot(projection="3d")
for times in (1.0, 1.8, 3.0):
    ring = dx.solve(dx.Ring(dx.Rod(1.0, section, natural=(0, 2.0 * np.pi * times, 0))))
    flat = 2.0 * np.pi**2 * (times - 1.0) ** 2
    print(f"{times:g} times its curvature: elastic energy {ring.energy.elastic:.3e} EI / L, of the circle {flat:.3e}")
    assert ring.stable
    if times != 1.8:  # both free of stress: the circle, and the three loops
        assert ring.energy.elastic < 1e-8
        assert np.allclose(np.linalg.norm(ring.k(s), axis=1), 2.0 * np.pi * times, rtol=1e-6)
    ax.plot(*ring.r(s).T, label=f"{times:g} times its curvature")
ax.set(xlabel="x / L", ylabel="y / L", zlabel="z / L")
ax.set_aspect("equal")
ax.locator_params(nbins=4)
ax.legend(loc="upper left")
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
