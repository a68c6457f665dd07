"""The planar elastica: an independent check of the methods that work in space.

It shares no code with them: only the descriptions, NumPy and SciPy. See `elastica_closed_form` (end loads alone),
`heavy_elastica` (all the rest), `elastica_branch` (which of many equilibria), `elastica_plane` (which plane).
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigvalsh_tridiagonal

from darboux import checks
from darboux.checks import assign, description
from darboux.errors import InvalidInput
from darboux.problem import Equilibrium
from darboux.solution import EquilibriumSolution, ErrorEstimate, Status
from darboux.statics import elastica_closed_form, heavy_elastica, limits
from darboux.statics.elastica_plane import NotPlanar, PlaneProblem, PlaneSolution, plane_of

STATUS = {"converged": "converged", "folded": "folded"}
LARGEST_LOAD = 1e13  # dimensionless
ROUNDING = 2e-15  # no error below this is claimed
CELLS = 2000  # of the grid on which the second variation is counted


@description
class Elastica:
    """The planar, inextensible rod by its tangent angle: closed form under end loads, collocation under all others.

        (B (theta' - k0))' = n_x sin(theta) - n_y cos(theta) - l,     n(s) = n(L) + int_s^L f

    States: rods clamped at one end or both, in any plane of space, that neither stretch nor shear; dead forces in the
    plane, also off the end's centre, couples and moments normal to it; stiffness and natural curvature that may vary along s.
    The answer is on the branch that starts at the unloaded rod. Accuracy: 1e-12 of the length as a rule.

    Argument: ``rtol``, the allowed error of the tip relative to the length, from 1e-12 to 1e-3.
    Sources: A. E. H. Love, A Treatise on the Mathematical Theory of Elasticity, 4th ed. 1927, art. 260-263;
    K. E. Bisshopp and D. C. Drucker, Q. Appl. Math. 3 (1945) 272; F. V. Rohde, Q. Appl. Math. 11 (1953) 337.
    """

    rtol: float = 1e-11

    def __post_init__(self) -> None:
        rtol = checks.positive("elastica.rtol", self.rtol)
        if not 1e-12 <= rtol <= 1e-3:
            raise InvalidInput(f"elastica.rtol is {rtol:g}; it must lie between 1e-12 and 1e-3.")
        assign(self, rtol=rtol)

    def __str__(self) -> str:
        return "Elastica()" if self.rtol == 1e-11 else f"Elastica(rtol={self.rtol:g})"

    def refuses(self, problem: Equilibrium) -> str | None:
        """Return why this method can't state the problem and what to use instead, in one sentence; None if it can."""
        try:
            plane_of(problem)
        except NotPlanar as refusal:
            return str(refusal)
        return limits.beyond(problem, "Elastica") or limits.too_large(problem, "Elastica", LARGEST_LOAD)

    def solve(self, problem: Equilibrium) -> EquilibriumSolution:
        """Return the equilibrium on the branch that starts at the unloaded rod.

        Raises ``InvalidInput`` where the problem is not planar, or is none of an inextensible rod under dead loads.
        """
        checks.instance("problem", problem, Equilibrium, "an Equilibrium")
        plane = plane_of(problem)
        found = elastica_closed_form.solve(plane) if plane.end_loaded_arc else heavy_elastica.solve(plane, self.rtol)
        unstable = unstable_in_plane(plane, found)
        return EquilibriumSolution(
            problem=problem,
            method=self,
            model="inextensible",
            status=Status(STATUS.get(found.code, "no_convergence"), message(found, unstable, self.rtol)),
            curve=plane.curve(found),
            load_factor=found.load,
            error=ErrorEstimate(
                tip=max(found.error, ROUNDING) * problem.rod.length if np.isfinite(found.error) else None
            ),
            statistics={**found.statistics, "crossings": found.crossings, "unstable_in_plane": unstable},
        )


def unstable_in_plane(plane: PlaneProblem, found: PlaneSolution) -> int | None:
    """Return the number of directions in the plane that lower the energy; None where both ends are held.

        d^2 E = int B eta'^2 + (n_x cos(theta) + n_y sin(theta)) eta^2 ds - dM/dtheta eta^2 at the end,     eta(0) = 0

    The negative eigenvalues of its matrix on linear elements are counted; the grid blurs only loads within about
    1e-6 of a critical one.
    """
    if plane.end_pose is not None:
        return None
    h = 1.0 / CELLS
    edges = np.linspace(0.0, 1.0, CELLS + 1)
    at = found.states(edges[1:])
    tension = at.n[:, 0] * np.cos(at.theta) + at.n[:, 1] * np.sin(at.theta)
    stiffness = plane.data((edges[1:] + edges[:-1]) / 2.0).B / h
    diagonal = stiffness + np.append(stiffness[1:], 0.0) + h * tension
    diagonal[-1] -= h * tension[-1] / 2.0 + found.load * plane.moment_at_end(at.theta[-1])[1]
    lowest = min(float(np.min(diagonal) - 2.0 * np.max(stiffness)), 0.0) - 1.0  # Gershgorin
    return len(eigvalsh_tridiagonal(diagonal, -stiffness[1:], select="v", select_range=(lowest, 0.0)))


def message(found: PlaneSolution, unstable: int | None, rtol: float) -> str:
    """Return how the solve ended, and what to do next, in words."""
    way = " of the way of its held end, under full load" if found.pushed else " of the load"
    reached = f"{100.0 * found.reached:.4g} %{way}"
    buckled = f"passed a buckling load at {100.0 * found.crossings[0]:.3g} %{way}" if found.crossings else ""
    branch = "the branch that starts at the unloaded rod"
    match found.code:
        case "converged" if buckled:
            return (
                f"Converged, but {branch} {buckled}, and this shape stayed on it unbuckled. "
                "Add a small load across the rod to follow the buckled shape."
            )
        case "converged" if unstable:
            return (
                f"Converged on {branch}, but unstable in its plane in {unstable} direction(s): the rod would snap away."
            )
        case "converged":
            return f"Converged on {branch}."
        case "folded":
            turns = f"{buckled} and turns back" if buckled else "turns back"
            return (
                f"{branch.capitalize()} {turns} at {reached}: beyond it the rod snaps to another shape. "
                "The last equilibrium before it is given; lower the load."
            )
        case "unresolved":
            return (
                f"The shape was found, but not to rtol = {rtol:g}: the data along the rod vary too fast or jump "
                "too often. Give them as a Table, or allow a larger rtol."
            )
        case "taut":
            return (
                "The ends are held as far apart as the rod is long, so without stretch it can only be straight, and "
                "the force along it has no bound. Set rod.stretch and use Shooting, or move the ends closer."
            )
        case _ if found.pushed and found.reached < 1e-6:
            return (
                "A straight rod is pushed along its tangent and can buckle to either side: nothing tells which. "
                "Add a small load across it that chooses one."
            )
    return f"No equilibrium was found beyond {reached}; the last one is given. Use Collocation, or smaller loads."
