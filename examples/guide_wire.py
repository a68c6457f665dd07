"""A guide wire: how hard it can be pushed.

A nitinol wire is held on its line at points at equal distances l, which slide along, and is pushed
at its end. It buckles from point to point at P = pi^2 EI / l^2, as if each bay were a column between
ball joints.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

import darboux as dx

nitinol = dx.Material(E=60e9, nu=0.33)
wire = dx.Rod(length=0.2, section=dx.Circle(radius=0.2e-3), material=nitinol)
along, bay = (0, 0, 1), 0.05
critical = np.pi**2 * 60e9 * np.pi / 4.0 * 0.2e-3**4 / bay**2  # N

fig, ax = plt.subplots(layout="constrained")
s = np.linspace(0.0, 0.2, 401)
for part in (0.99, 1.02, 1.05, 1.1):
    guides = {at: dx.Roller(along=along, position=(0, 0, at)) for at in (bay, 2 * bay, 3 * bay)}
    push = dx.EndForce((0, 0, -part * critical))
    ends = {"start": dx.Pinned(), "end": dx.Roller(along=along)}
    pushed = dx.solve(dx.Equilibrium(wire, **ends, between=guides, loads=[push]))
    sideways = np.hypot(*pushed.r(s)[:, :2].T)
    print(f"P = {part * critical:.4f} N, {part:.2f} of the critical: {1e3 * sideways.max():.4f} mm sideways")
    assert (sideways.max() > 1e-4) == (part > 1.0)
    (line,) = ax.plot(1e3 * pushed.r(s)[:, 2], 1e3 * pushed.r(s)[:, 0], label=f"{part:g}")
    held = 1e3 * pushed.r(np.array(list(guides)))
    ax.plot(held[:, 2], held[:, 0], "s", color=line.get_color())
ax.set(xlabel="z (mm)", ylabel="x (mm)")
fig.legend(title="$P / P_{cr}$", loc="outside right upper")
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
