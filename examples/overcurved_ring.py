"""An overcurved ring: it coils to three loops.

A ring is made of a rod whose natural curvature is t times that of the ring. It may lie as n loops,
at the elastic energy 2 pi^2 EI (t - n)^2 / L; n is odd, as two loops would need a turn of twist. Up
to t = 2 it stays a circle, beyond it coils to three loops.

Source: B. Audoly, K. A. Seffen, J. Elasticity 119 (2015) 293.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

import darboux as dx

section = dx.Stiffness(EI1=1.0, GJ=0.75)
times = np.array([1.0, 1.4, 1.8, 2.2, 2.6, 3.0])
energies = []
for t in times:
    ring = dx.solve(dx.Ring(dx.Rod(1.0, section, natural=(0, 2.0 * np.pi * t, 0))))
    energies.append(ring.energy.elastic)
    loops = np.linalg.norm(ring.k(0.3)) / (2.0 * np.pi)
    print(f"{t:g} times its curvature: {loops:.6f} loops, elastic energy {energies[-1]:.6f} EI / L")
    assert ring.stable
    assert abs(loops - (1 if t < 2.0 else 3)) < 1e-5
    assert abs(energies[-1] - 2.0 * np.pi**2 * (t - round(loops)) ** 2) < 1e-6

fig, ax = plt.subplots()
t = np.linspace(1.0, 3.0, 101)
for n in (1, 3):
    ax.plot(t, 2.0 * np.pi**2 * (t - n) ** 2, "--", lw=1, label=f"{n} loop{'s' * (n > 1)}, by the formula")
ax.plot(times, energies, "ko", label="darboux")
ax.set(xlabel="natural curvature over the ring's", ylabel="elastic energy (EI / L)")
ax.legend()
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
