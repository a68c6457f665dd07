"""A falling rod: a bent rod that is let go.

A rubber filament hangs in equilibrium from its clamp and is let go. It straightens and swings, but
its centre of mass falls as every body does, by g t^2 / 2, and its energy is kept.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

import darboux as dx

rubber = dx.Material(E=1e6, nu=0.5, density=1e3)
rod = dx.Rod(length=0.25, section=dx.Circle(radius=6e-3), material=rubber)
held = dx.Equilibrium(rod, start=dx.Clamped(tangent=(1, 0, 0)), loads=[dx.Gravity()])
let_go = dx.Motion(held, duration=0.2, initial="equilibrium", release={"start": 0.0})
fall = dx.simulate(let_go, dx.ImplicitMidpoint(segments=40, step=1e-3))

weights = np.full(41, 1.0 / 40.0)
weights[[0, -1]] /= 2.0  # mass lies along the edges
centre = np.einsum("nij,i->nj", fall.positions, weights)
fallen = centre[0, 2] - centre[:, 2]
print(f"after {fall.times[-1]:g} s the centre of mass is {1e3 * fallen[-1]:.6f} mm lower")
print(f"g t^2 / 2 = {1e3 * 9.81 * 0.2**2 / 2:.6f} mm; energy drifts by {fall.energy.drift:.1e}")
assert np.allclose(fallen, 9.81 * fall.times**2 / 2.0, atol=1e-9)
assert fall.energy.drift < 1e-6

fig, ax = plt.subplots(layout="constrained", figsize=(5.0, 4.0))
for i in range(0, len(fall.times), len(fall.times) // 5):
    ax.plot(*(1e3 * fall.positions[i][:, [0, 2]]).T, label=f"{1e3 * fall.times[i]:.0f} ms")
ax.plot(*(1e3 * centre[:, [0, 2]]).T, "k--", lw=1, label="centre of mass")
ax.set(xlabel="x (mm)", ylabel="z (mm)", aspect="equal")
fig.legend(loc="outside right upper")
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
