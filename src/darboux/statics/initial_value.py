"""The initial value problem: start values k(0), n(0), frame and r(0) in, the curve out; the paper's own way.

Source: J. R. Dormand and P. J. Prince, J. Comp. Appl. Math. 6 (1980) 19, the method of MATLAB's ODE45.
"""

from __future__ import annotations

import dataclasses
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux import checks, frames
from darboux.checks import checked_call
from darboux.errors import InvalidInput
from darboux.kernels.jit import announced
from darboux.kernels.rod_equations import BINV, FORCE, K0, MOMENT
from darboux.loads import EndForce, EndMoment
from darboux.packing.cells import symmetric
from darboux.packing.problem import Packing
from darboux.problem import Equilibrium
from darboux.rod import Rod
from darboux.solution import EquilibriumSolution, Status
from darboux.statics.steps import accepted_steps, joined
from darboux.supports import Clamped

Array = NDArray[np.float64]

FAILED = {1: "it took too many steps", 2: "its step became too small", 3: "its numbers overflowed"}


@checked_call
@announced
def integrate(
    rod: Rod,
    k: Any,
    n: Any = (0.0, 0.0, 0.0),
    *,
    position: Any = (0.0, 0.0, 0.0),
    frame: Any = None,
    loads: Any = (),
    rtol: float = 1e-8,
    throw: bool = True,
) -> EquilibriumSolution:
    """Integrate the rod equations from s = 0, where all states are given, to the rod's end.

        r' = R v,  R' = R [k]_x,  n' = -f,  m' = -r' x n - l,   m(0) = R B (k(0) - k0)

    Arguments: ``rod``; ``k`` (3,) curvature and twist at s = 0 in 1/m, section's frame; ``n`` (3,) inner force at
    s = 0 in N, fixed frame; ``position`` (3,) in m; ``frame`` (3, 3), columns d1, d2, d3 (default d_i = e_i);
    ``loads`` along the rod; ``rtol`` relative error per step, 1e-13 to 1e-2; ``throw`` whether a failure raises. Returns
    the equilibrium of the clamped rod that carries n and m of the curve's end as end loads; its nodes ``s`` are the
    accepted steps, and it can be asked for any s.
    Raises ``InvalidInput`` and ``NotConverged`` (where the integration breaks down).
    Source: the paper, eqs. (14) and (17), in right-handed frames.
    """
    rtol = checks.positive("integrate.rtol", rtol)
    if not 1e-13 <= rtol <= 1e-2:
        raise InvalidInput(f"integrate.rtol is {rtol:g}; it must lie between 1e-13 and 1e-2.")
    clamp = Clamped(position=position) if frame is None else Clamped(position=position, frame=frame)
    problem = Equilibrium(rod, start=clamp, loads=loads)
    if problem.of_shape or any(load.place is not None or load.station is not None for load in problem.loads):
        raise InvalidInput("integrate takes loads along the rod; at the start give n and k, at the end they come out.")
    if rod.coupled:
        raise InvalidInput(
            "integrate can't state a section that couples bending and twist with stretch or shear; solve an Equilibrium instead."
        )
    packing = Packing(problem)
    scale, table, R = packing.scale, packing.table, packing.start.frame
    c = packing.columns(np.zeros(1))
    strain = checks.array("integrate.k", k, (3,), "1/m") * scale.length - c[0, K0 : K0 + 3]
    moment = R @ np.linalg.solve(symmetric(c[:, BINV : BINV + 6])[0], strain)
    force = checks.array("integrate.n", n, (3,), "N") / scale.force
    y0 = np.concatenate([np.zeros(3), frames.quaternion_of_matrix(R), force, moment])

    began = time.perf_counter()
    data = (table.breaks, table.coefficients.ravel(), table.degree)
    x, y, dy, code = accepted_steps(y0, 0.0, 1.0, data, rtol)
    status = Status("converged", "integrated from end to end.")
    if code != 0:
        status = Status(
            "no_convergence",
            f"the integration stopped at s = {x[-1] * rod.length:.6g} m: {FAILED[code]}. Start values or loads this large wind "
            "the rod without end; check k, n and the units, or solve a boundary value problem instead.",
        )
        x, y, dy = (np.concatenate([part, part[-1:]]) for part in (x, y, dy))
        x[-1] = 1.0  # beyond the stop the last state is kept
    curve = scale.curve(*joined(x, y, dy, table.breaks if problem.dense else packing.breaks))
    ends = [EndForce(curve.y[-1, FORCE:MOMENT]), EndMoment(curve.y[-1, MOMENT:])]
    solution = EquilibriumSolution(
        dataclasses.replace(problem, loads=(*problem.loads, *ends)),
        "integrate",
        rod.model,
        status,
        curve,
        elastic_parts=packing.elastic_parts(curve),
        statistics={"seconds": time.perf_counter() - began, "steps": len(curve.s) - 1},
    )
    return solution.check() if throw else solution
