"""The answer on a mesh that is fine enough, and its estimated error."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.newton import SAFE
from darboux.kernels.path import MOST_ELEMENTS
from darboux.kernels.rod_equations import FORCE, MOMENT, ROTATION
from darboux.solution import ErrorEstimate
from darboux.statics.collocation_equations import Equations, Step
from darboux.statics.mesh import Mesh, size, units

Array = NDArray[np.float64]
Found = tuple[Mesh, Step, float, int]  # what Newton's method returns

MOST_MESHES = 8
SURE = 4.0  # the estimated error is this many times what the order promises
GAIN = 64.0  # of the curve between the nodes, at least, where they are halved
CURVE_ORDER = 8  # of the curve between the nodes
ROUNDING = 2e-14  # no error below this is claimed, relative
TINY = 1e-300


def refined(
    equations: Equations, mesh: Mesh, rtol: float, stages: int, even: int | None = None, first: bool = False
) -> tuple[Mesh, ErrorEstimate] | None:
    """Return the answer and its estimated error: meshes laid anew until the error is small enough.

    With ``first`` the given mesh is tried before any other is laid.
    """
    sharp, order = max(1e-3 * rtol, 1e-13), 2 * stages
    rough = sharp if even else max(0.1 * rtol, sharp)  # of the coarse mesh: divided by 2^order it is sharp enough
    elements = even or equations.elements_for_answer(mesh, stages, rtol)
    for attempt in range(MOST_MESHES):
        guess = mesh if first and attempt == 0 else _laid_anew(equations, mesh, elements, stages, even)
        coarse = equations.newton(guess, 1.0, rough, most=20)
        fine = None if coarse is None else equations.newton(coarse[0].halved(), 1.0, sharp, most=12)
        if coarse is None or fine is None:
            return None
        mesh = fine[0]
        gap = size(mesh.y[coarse[0].in_halves] - coarse[0].y, mesh.y)
        error = max(SURE * gap / 2.0**order, ROUNDING)
        if even or elements >= MOST_ELEMENTS or error <= rtol or attempt == MOST_MESHES - 1:
            return _dense(equations, coarse, fine, order, rtol, sharp, 0 if even else MOST_ELEMENTS)
        elements = int(elements * np.clip(1.1 * (error / rtol) ** (1.0 / order), 1.2, 4.0)) + 1
    return None


def _laid_anew(equations: Equations, mesh: Mesh, elements: int, stages: int, even: int | None) -> Mesh:
    if not even:
        return mesh.redistributed(elements, equations.breaks, stages)
    x = np.unique(np.concatenate([np.linspace(0.0, 1.0, even + 1), equations.breaks]))
    return mesh.laid(np.sort(np.concatenate([x, mesh.x[mesh.joints]])), stages)


def _dense(
    equations: Equations, before: Found, found: Found, order: int, rtol: float, sharp: float, most: int
) -> tuple[Mesh, ErrorEstimate]:
    """Halve the elements until the curve between the nodes is as good as the nodes are; return the answer and its error."""
    coarse, rate_of_newton = before[0], before[1].rate
    fine, share = found[0], SURE / 2.0**order
    while True:
        middle = np.ones(len(fine.x), dtype=bool)
        middle[coarse.in_halves] = False
        between = equations.scale.states(equations.curve(coarse, 1.0), fine.x[middle])
        gap = size(between - fine.y[middle], fine.y)
        dense = gap <= GAIN * rtol + equations.table.between or fine.elements >= most
        finer = None if dense else equations.newton(fine.halved(), 1.0, sharp, most=6)
        if finer is None:
            left = min(found[1].left, sharp)  # by Newton's method, and as it went on the coarse mesh
            if rate_of_newton > 0.0:
                left = min(left, SAFE * rate_of_newton * found[1].length ** 2)
            return fine, _error(equations, coarse, fine, share, left, SURE * gap / 2.0**CURVE_ORDER)
        # Where layers are thinner than the elements, halving them gains less than the order promises.
        first, second = (size(b.y[a.in_halves] - a.y, b.y) for a, b in ((coarse, fine), (fine, finer[0])))
        rate = min(0.5, second / max(first, TINY))
        share = max(SURE / 2.0**order, rate / (1.0 - rate))
        coarse, fine, found = fine, finer[0], finer


def _error(equations: Equations, coarse: Mesh, fine: Mesh, share: float, left: float, between: float) -> ErrorEstimate:
    """Return the share of what halving the elements changed that is left, and what Newton's method leaves, in SI units.

    The energy is summed along the curve; its first variation by the states is at most that of n and m over their own size.
    """
    scale = equations.scale
    gaps = np.abs(fine.y[coarse.in_halves] - coarse.y)
    held = [0, *coarse.joints, *(coarse.joints + 1), len(coarse.x) - 1]
    force, moment = (float(np.max(np.linalg.norm(gaps[held, a : a + 3], axis=1))) for a in (FORCE, MOMENT))
    unit = [float(x) for x in units(fine.y)]
    place, turn = float(np.max(np.linalg.norm(gaps[:, :3], axis=1))), 2.0 * float(np.max(gaps[:, ROTATION:FORCE]))
    place = max(place, turn)  # for a section's place is its sum of turns, and its gap may be small by chance
    left += equations.table.error  # what averages over dense rows miss
    energy = unit[FORCE] + unit[MOMENT] * equations.softest * unit[MOMENT]
    return ErrorEstimate(
        max(share * place + left, ROUNDING) * scale.length,
        max(share * force + left * unit[FORCE], ROUNDING * unit[FORCE]) * scale.force,
        max(share * moment + left * unit[MOMENT], ROUNDING * unit[MOMENT]) * scale.moment,
        max(share * size(gaps, fine.y) + between + left, ROUNDING) * energy * scale.moment,
    )
