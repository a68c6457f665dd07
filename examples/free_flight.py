"""Free flight: a rod thrown with a spin.

Nothing holds the rod and nothing acts on it, so its momentum and its angular momentum are constants
of the motion, however it bends. `ImplicitMidpoint` keeps both to rounding.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

import darboux as dx

rod = dx.Rod(length=1.0, section=dx.Stiffness(EI1=0.02, GJ=0.015, mass=0.1))
thrown = dx.Motion(
    dx.Equilibrium(rod),
    duration=1.0,
    velocity=lambda s: np.stack([1.0 - 4.0 * s, 3.0 * np.sin(4.0 * s), 0.0 * s], axis=1),
    release={"start": 0.0},
    rotary_inertia=1e-6,
)
flight = dx.simulate(thrown, dx.ImplicitMidpoint(segments=40, step=2e-3))

for name, values in (("momentum", flight.momentum), ("angular momentum", flight.angular_momentum)):
    change = np.max(np.linalg.norm(values - values[0], axis=1)) / np.linalg.norm(values[0])
    print(f"{name} changes by {change:.1e} of itself in {flight.times[-1]:g} s")
    assert change < 1e-9

fig = plt.figure(figsize=(5.0, 4.0), layout="constrained")
ax = fig.add_subplot(projection="3d")
for i in range(0, len(flight.times), len(flight.times) // 6):
    ax.plot(*flight.positions[i].T, label=f"{flight.times[i]:.2f} s")
ax.set(xlabel="x (m)", ylabel="y (m)", zlabel="z (m)")
ax.set_aspect("equal")
ax.locator_params(nbins=4)
fig.legend(loc="outside left upper")
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
