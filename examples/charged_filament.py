"""A charged filament in an electric field.

A rubber filament with a charge per length, clamped horizontally, in a field that points upwards.
Where the field carries the weight, charge x field = rho A g, the filament is straight; below it
hangs, above it rises.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

import darboux as dx

rubber = dx.Material(E=1e6, nu=0.5, density=1e3)
rod = dx.Rod(length=0.25, section=dx.Circle(radius=1e-3), material=rubber)
charge = 1e-7  # C/m
balanced = 1e3 * np.pi * 1e-3**2 * 9.81 / charge  # V/m

fig, ax = plt.subplots(layout="constrained")
s = np.linspace(0.0, 0.25, 201)
for part in (0.0, 0.9, 0.98, 1.0, 1.02, 1.1):
    loads = [dx.Gravity(), dx.ElectricField((0, 0, part * balanced), charge_per_length=charge)]
    filament = dx.solve(dx.Equilibrium(rod, start=dx.Clamped(tangent=(1, 0, 0)), loads=loads))
    print(f"field {part * balanced:9.1f} V/m: tip at {1e3 * filament.tip[0]:8.4f}, {1e3 * filament.tip[2]:+9.4f} mm")
    if part == 1.0:
        assert np.allclose(filament.tip, (0.25, 0.0, 0.0), atol=1e-12)
    ax.plot(1e3 * filament.r(s)[:, 0], 1e3 * filament.r(s)[:, 2], label=f"{part:g}")
ax.set(xlabel="x (mm)", ylabel="z (mm)", aspect="equal")
fig.legend(title="field over the\nbalanced one", loc="outside right upper")
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
