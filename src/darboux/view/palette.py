"""The colours of every picture: the colour-blind tell them apart, and their greys differ."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Okabe and Ito's colours (https://jfly.uni-koeln.de/color), ordered so that neighbours differ in lightness too.
BLACK, BLUE, VERMILION, GREEN, SKY, ORANGE = "#1b1b1b", "#0072b2", "#d55e00", "#009e73", "#56b4e9", "#e69f00"
GREY, PALE = "#7a7a7a", "#d9d9d9"
DIRECTORS = ("#c44601", "#3f9bd1", "#1b1b1b")  # d1, d2, d3: middle, light and dark in grey
SCALE = ("#4a6fc0", "#3f9fd0", "#63c3b4", "#bfe09a", "#fbf3b4")  # of a field, from its least value; ever lighter


def rgb(colour: Any) -> Array:
    """Return "#rrggbb", or three numbers, as red, green, blue from 0 to 1: (3,)."""
    if isinstance(colour, str):
        return np.array([int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)])
    return np.array(colour, dtype=float)


def on_scale(values: Any) -> Array:
    """Return the colours (n, 3) of a field's values (n,) from 0 to 1."""
    nodes = np.array([rgb(colour) for colour in SCALE])
    places = np.linspace(0.0, 1.0, len(nodes))
    return np.stack([np.interp(values, places, column) for column in nodes.T], axis=-1)
