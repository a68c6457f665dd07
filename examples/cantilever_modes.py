"""The vibrations of a cantilever.

The natural frequencies of a clamped steel wire are beta^2 sqrt(EI / (rhoA L^4)) / (2 pi), with
cos(beta) cosh(beta) = -1. The round wire has each of them twice, once for either plane.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

import darboux as dx

wire = dx.Rod(length=0.5, section=dx.Circle(radius=1e-3), material="steel")
stiffness = wire.stiffness(np.zeros(1))
scale = np.sqrt(stiffness.EI1[0] / stiffness.mass[0]) / 0.5**2
modes = dx.natural_modes(dx.Equilibrium(wire), 6, segments=100)

fig, ax = plt.subplots()
for i in range(3):
    start = np.pi * (i + 0.5)
    beta = brentq(lambda b: np.cos(b) * np.cosh(b) + 1.0, start - 1.0, start + 1.0)
    exact = beta**2 * scale / (2.0 * np.pi)
    print(f"{modes.frequencies[2 * i]:.4f} Hz and {modes.frequencies[2 * i + 1]:.4f} Hz, exact {exact:.4f} Hz")
    assert np.allclose(modes.frequencies[2 * i : 2 * i + 2], exact, rtol=1e-3)
    shape = modes.shapes[2 * i]
    sideways = shape @ (shape[-1] / np.linalg.norm(shape[-1]) ** 2)
    ax.plot(np.linspace(0.0, 0.5, 101), sideways, label=f"{modes.frequencies[2 * i]:.1f} Hz")
ax.set(xlabel="s (m)", ylabel="shape, 1 at the tip")
ax.legend()
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
