"""The heavy elastica: a filament under its own weight, by three theories.

A rubber filament, clamped horizontally: figure 5 of the paper, where w L^3 / EI = 613.125 (with g =
9.81 m/s^2). The planar elastica's boundary value problem, solved in many digits, puts its tip at
(0.0592375526997, -0.9757880733516) L.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

import darboux as dx

rubber = dx.Material(E=1e6, nu=0.5, density=1e3)
rod = dx.Rod(length=0.25, section=dx.Circle(radius=1e-3), material=rubber)
hanging = dx.Equilibrium(rod, start=dx.Clamped(tangent=(1, 0, 0)), loads=[dx.Gravity()])

answers = dx.compare(hanging, [dx.Collocation(), dx.Elastica(), dx.DiscreteRod(segments=30)], order=False)
print(answers)
for answer, tolerance in zip(answers.entries, (1e-9, 1e-11, 4e-3), strict=True):
    off = answer.solution.tip / 0.25 - (0.0592375526997371, 0.0, -0.9757880733516139)
    assert np.linalg.norm(off) < tolerance

fig, ax = plt.subplots(figsize=(4.5, 4.0))
s = np.linspace(0.0, 0.05, 201)
for answer, look in zip(answers.entries, ("-", "--", ":"), strict=True):
    r = answer.solution.r(s)
    ax.plot(1e3 * r[:, 0], 1e3 * r[:, 2], look, label=answer.name)
ax.set(xlabel="x (mm)", ylabel="z (mm)", aspect="equal", xlim=(-22, 22), ylim=(-32, 2), title="the bend at the clamp")
ax.legend(loc="lower left")
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
