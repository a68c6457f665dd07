"""A small picture of a curve in the terminal, of braille letters: each holds 2 x 4 dots."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

COLUMNS, ROWS = 64, 14  # at most
DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])  # of a braille letter, from its upper left
NAMES = "xyz"


def picture(r: Array, plain: bool = False) -> str:
    """Return the curve through r (n, 3), seen along the axis in which it extends least; one scale for both directions.

    The first point is marked. ``plain`` uses the letters of ASCII.
    """
    extent = np.ptp(r, axis=0)
    across, up = sorted(np.argsort(-extent, kind="stable")[:2])  # z upwards, else y
    flat = r[:, [across, up]]
    low, size = flat.min(axis=0), np.maximum(np.ptp(flat, axis=0), 1e-300)
    per_dot = float(np.max(size / [2 * COLUMNS - 1, 4 * ROWS - 1]))
    columns, rows = (int(np.floor(n)) for n in np.floor(size / per_dot + 1e-9) // [2, 4] + 1)
    x, y = np.rint((_dense(flat) - low) / per_dot).astype(int).T
    x, y = np.clip(x, 0, 2 * columns - 1), np.clip(4 * rows - 1 - y, 0, 4 * rows - 1)
    cells = np.zeros((rows, columns), dtype=int)
    np.bitwise_or.at(cells, (y // 4, x // 2), DOTS[y % 4, x % 2])
    letters = np.where(cells > 0, "*", " ") if plain else np.vectorize(lambda cell: chr(0x2800 + cell))(cells)
    letters[y[0] // 4, x[0] // 2] = "#" if plain else "■"
    bar = f"{2.0 * per_dot * columns:.3g} m"
    lines = ["".join(row).replace("\u2800", " ").rstrip() for row in letters]
    caption = f"{NAMES[across]} to the right, {NAMES[up]} upwards; {bar} wide; {'#' if plain else '■'} the start"
    return "\n".join([*lines, caption])


def _dense(flat: Array) -> Array:
    """Return points so near one another that no gap shows."""
    steps = 16
    t = np.arange(0, (len(flat) - 1) * steps + 1) / steps
    return np.stack([np.interp(t, np.arange(len(flat)), column) for column in flat.T], axis=1)
