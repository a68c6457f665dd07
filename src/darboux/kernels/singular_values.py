"""Twelve equations that are almost singular, solved by singular values: Jacobi's method from one side.

The columns of A are turned in pairs until they are at right angles: A V = W. Their lengths are the singular values, and even the
small ones have many correct digits.

Source: J. Demmel and K. Veselic, SIAM J. Matrix Anal. Appl. 13 (1992) 1204.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from darboux.kernels.jit import allocating, jit

Array = NDArray[np.float64]

SIZE, SIDES = 12, 2
WIDTH = SIZE + SIDES
RIGHT_ANGLE = 1e-15  # of two columns, over their lengths
MOST_ROUNDS = 30
ROUNDING = 1e-14  # of the square of a side's length
FREE_MOTION = 1e-9  # a singular value below this part of the largest belongs to a free motion ...
IDLE, NOISE = 1e-6, 1e-10  # ... if the equations ask for less than this along it, relative and absolute
ZERO = 1e-16  # no singular value is smaller, over the largest, but by rounding


@jit
def _turn_pair(W: Array, V: Array, i: int, j: int) -> float:
    """Turn the columns i and j of W, and of V, to a right angle; return how far they were from it."""
    a = b = c = 0.0
    for k in range(SIZE):
        x, y = W[k * SIZE + i], W[k * SIZE + j]
        a, b, c = a + x * x, b + y * y, c + x * y
    off = abs(c) / np.sqrt(a * b) if a > 0.0 and b > 0.0 else 0.0
    if off <= RIGHT_ANGLE:
        return off
    zeta = (b - a) / (2.0 * c)
    t = (1.0 if zeta >= 0.0 else -1.0) / (abs(zeta) + np.sqrt(1.0 + zeta * zeta))
    cosine = 1.0 / np.sqrt(1.0 + t * t)
    sine = cosine * t
    for M in (W, V):
        for k in range(SIZE):
            x, y = M[k * SIZE + i], M[k * SIZE + j]
            M[k * SIZE + i], M[k * SIZE + j] = cosine * x - sine * y, sine * x + cosine * y
    return off


@allocating
def solve_by_singular_values(last: Array, unit: Array, unsure: float, delta: Array) -> int:
    """Solve the equations (12 x 14,) for delta (12 x 2,), and return how many motions are free.

    An unknown k is measured by unit[k] (12,), for the step of a large force is no free motion. Rows are scaled to length 1. With
    A = U S V^T a side b gives V S^-1 U^T b, but nothing along a free motion. Where Newton's method stops early, or elements are
    few, a free motion's singular value and what is asked for along it are no rounding, but may be ``unsure``.
    """
    W, V, size, norm = np.empty(SIZE * SIZE), np.zeros(SIZE * SIZE), np.empty(SIZE), np.zeros(SIDES)
    for row in range(SIZE):
        square = 0.0
        for k in range(SIZE):
            last[row * WIDTH + k] *= unit[k]
            square += last[row * WIDTH + k] ** 2
        over = 1.0 / np.sqrt(square)
        for k in range(WIDTH):
            last[row * WIDTH + k] *= over
        for k in range(SIZE):
            W[row * SIZE + k] = last[row * WIDTH + k]
        for side in range(SIDES):
            norm[side] += last[row * WIDTH + SIZE + side] ** 2
        V[row * (SIZE + 1)] = 1.0
    for _ in range(MOST_ROUNDS):
        off = 0.0
        for i in range(SIZE):
            for j in range(i + 1, SIZE):
                off = max(off, _turn_pair(W, V, i, j))
        if not off > RIGHT_ANGLE:
            break
    largest, free = 0.0, 0
    for j in range(SIZE):
        square = 0.0
        for k in range(SIZE):
            square += W[k * SIZE + j] ** 2
        size[j] = np.sqrt(square)
        largest = max(largest, size[j])
    delta[:] = 0.0
    left = norm.copy()  # of the squares of what the sides ask for: a column of nothing has no direction of its own
    for j in np.argsort(-size):
        for side in range(SIDES):
            wanted = 0.0
            for k in range(SIZE):
                wanted += W[k * SIZE + j] * last[k * WIDTH + SIZE + side]
            wanted = wanted / size[j] if size[j] > 0.0 else np.sqrt(max(left[side], 0.0))
            left[side] -= wanted * wanted
            if abs(left[side]) <= ROUNDING * norm[side]:
                left[side] = 0.0
            idle = abs(wanted) <= IDLE * np.sqrt(norm[side]) + max(NOISE, unsure)
            if idle and size[j] <= max(FREE_MOTION, unsure) * largest:
                free += 1 if side == 0 else 0
                continue
            wanted /= max(size[j], ZERO * largest)
            for k in range(SIZE):
                delta[k * SIDES + side] += unit[k] * V[k * SIZE + j] * wanted
    return free
