"""The catenary: a cable that hardly bends.

A cable between two ball joints hangs as a catenary, z = a cosh(x / a), where its bending stiffness
is small: at w L^3 / EI = 1e4 its sag is the catenary's to some parts in 1e5. No guess is needed:
the path of a load so heavy begins where a chain would hang.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

import darboux as dx

span, weight = 0.8, 1e4  # of the length; w L^3 / EI
rod = dx.Rod(length=1.0, section=dx.Stiffness(EI1=1.0, GJ=0.75))
ends = {"start": dx.Pinned(), "end": dx.Pinned((span, 0, 0))}
cable = dx.solve(dx.Equilibrium(rod, **ends, loads=[dx.LineForce((0, 0, -weight))]))

a = brentq(lambda a: 2.0 * a * np.sinh(span / (2.0 * a)) - 1.0, 0.1, 10.0)
sag = a * (np.cosh(span / (2.0 * a)) - 1.0)
found = -cable.r(0.5)[2]
print(
    f"sag {found:.9f} L, of the catenary {sag:.9f} L; tension at the lowest point {cable.n(0.5)[0]:.1f}, w a = {weight * a:.1f}"
)
assert abs(found / sag - 1.0) < 1e-4
assert abs(cable.n(0.5)[0] / (weight * a) - 1.0) < 1e-2

fig, ax = plt.subplots()
x = np.linspace(0.0, span, 201)
ax.plot(*cable.r(np.linspace(0.0, 1.0, 401))[:, [0, 2]].T, label="darboux")
ax.plot(x, a * (np.cosh((x - span / 2.0) / a) - np.cosh(span / (2.0 * a))), "--", label="catenary")
ax.set(xlabel="x / L", ylabel="z / L", aspect="equal")
ax.legend()
plt.savefig(sys.argv[1]) if sys.argv[1:] else plt.show()
