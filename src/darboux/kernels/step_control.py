"""How far the next step along a path goes, and how far the corrector may turn the rod behind it."""

from __future__ import annotations

from darboux.kernels.jit import jit

LARGEST_PREDICTED_TURN = 0.6  # rad between neighbouring equilibria
LARGEST_TURN_BY_TWO = 1.5  # the same, where two tangents predict it
LARGEST_CORRECTED_TURN = 0.3  # rad by which the corrector may move a predicted shape
WANTED_CORRECTED_TURN = 0.1  # rad; the predictor's error grows with the square of the step
LARGEST_SHARE = 0.5  # of the predicted turn that the corrector may make
WANTED_SHARE = 0.35
CROSSING_STEP = 1e-3  # of the load factor: a change of stability within this span is a crossing
LATER_CROSSING_STEP = 0.02  # the same, once the rod is known to be unstable
LARGEST_STEP = 0.25  # also where nothing turns: a straight column passes its buckling loads one by one
SMALLEST_STEP = 1e-6  # of the load reached so far
MOST_STEPS = 1000
MECHANISM_LOAD, MECHANISM_STEPS = 1e-8, 60  # a rod that turns for so many steps below so little load turns as a whole
LOST, REJECTED = 0.4, 0.6  # the next try over one that did not converge, or that went too far


@jit
def growth(predicted: float, corrected: float, unseen: float, order: int) -> float:
    """Return the next step over this one; the corrector's turn grows with the power order + 1 of the step."""
    if corrected <= unseen:
        return 4.0
    wanted = (WANTED_CORRECTED_TURN / corrected) ** (1.0 / (order + 1))
    wanted = min(wanted, (WANTED_SHARE * predicted / corrected) ** (1.0 / order))
    return float(min(max(wanted, 0.5), 4.0))


@jit
def allowed(predicted: float, unseen: float) -> float:
    """Return by how much the corrector may turn the rod after the predictor turned it by `predicted` rad."""
    return min(LARGEST_CORRECTED_TURN, max(LARGEST_SHARE * predicted, unseen))
