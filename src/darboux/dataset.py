"""A solution as an xarray Dataset: named, labelled, with units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray

    from darboux.curve import Side
    from darboux.solution import EquilibriumSolution

# Name, dimensions, unit and what it is. Fixed frame: component x, y, z; section's frame: director 1, 2, 3.
VARIABLES = (
    ("r", ("s", "component"), "m", "centreline, fixed frame"),
    ("R", ("s", "component", "director"), "1", "directors d1, d2, d3 as columns, fixed frame"),
    ("k", ("s", "director"), "1/m", "curvatures and twist, section's frame"),
    ("v", ("s", "director"), "1", "shears and stretch, section's frame"),
    ("n", ("s", "component"), "N", "inner force, fixed frame"),
    ("m", ("s", "component"), "N m", "inner moment, fixed frame"),
)
CONTINUOUS = ("r", "R")
ENERGIES = ("bending", "twist", "stretch", "supports", "load")


def dataset(solution: EquilibriumSolution, s: Any, side: Side) -> xarray.Dataset:
    """Return r, R, k, v, n, m at s (n,) in m, those of one side at jumps.

    Status, method, model, load factor, energies (J) and errors are attributes.
    """
    import xarray

    s = np.atleast_1d(s)
    data = {
        name: (
            dimensions,
            getattr(solution, name)(s, **({} if name in CONTINUOUS else {"side": side})),
            {"units": unit, "long_name": meaning},
        )
        for name, dimensions, unit, meaning in VARIABLES
    }
    coordinates = {
        "s": ("s", s.astype(float), {"units": "m", "long_name": "arc length of the undeformed rod"}),
        "component": ["x", "y", "z"],
        "director": [1, 2, 3],
    }
    attributes: dict[str, Any] = {
        "status": solution.status.code,
        "message": solution.status.message,
        "method": str(solution.method),
        "model": solution.model,
        "load_factor": solution.load_factor,
        "length": solution.problem.rod.length,
    }
    attributes |= {f"energy_{kind}": getattr(solution.energy, kind) for kind in ENERGIES}
    attributes |= {f"error_{what}": value for what, value in vars(solution.error).items() if value is not None}
    if solution.index is not None:
        attributes["unstable_directions"] = solution.index
    return xarray.Dataset(data, coordinates, attributes)
