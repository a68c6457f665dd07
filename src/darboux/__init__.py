"""Elastic filaments: shapes, inner forces, stability and motion of thin rods by Kirchhoff's theory.

Names are loaded at their first use, so that ``import darboux`` stays light.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOME = {
    "InvalidInput": "errors",
    "NotConverged": "errors",
    "Table": "profile",
    "Material": "material",
    "Circle": "section",
    "Tube": "section",
    "Rectangle": "section",
    "Ellipse": "section",
    "Stiffness": "section",
    "Helix": "natural",
    "frame_of_helix": "natural",
    "Rod": "rod",
    "Clamped": "supports",
    "Free": "supports",
    "Gravity": "loads",
    "LineForce": "loads",
    "LineCouple": "loads",
    "Rotation": "loads",
    "ElectricField": "loads",
    "EndForce": "loads",
    "EndMoment": "loads",
    "Equilibrium": "problem",
    "EquilibriumSolution": "solution",
    "Status": "solution",
    "solve": "statics.solve",
    "integrate": "statics.shooting",
    "Shooting": "statics.shooting",
    "Elastica": "statics.elastica",
    "DiscreteRod": "statics.discrete",
    "compare": "comparison",
    "Comparison": "comparison",
}

__all__ = ["__version__", *_HOME]

if TYPE_CHECKING:
    from darboux.comparison import Comparison, compare
    from darboux.errors import InvalidInput, NotConverged
    from darboux.loads import ElectricField, EndForce, EndMoment, Gravity, LineCouple, LineForce, Rotation
    from darboux.material import Material
    from darboux.natural import Helix, frame_of_helix
    from darboux.problem import Equilibrium
    from darboux.profile import Table
    from darboux.rod import Rod
    from darboux.section import Circle, Ellipse, Rectangle, Stiffness, Tube
    from darboux.solution import EquilibriumSolution, Status
    from darboux.statics.discrete import DiscreteRod
    from darboux.statics.elastica import Elastica
    from darboux.statics.shooting import Shooting, integrate
    from darboux.statics.solve import solve
    from darboux.supports import Clamped, Free


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'darboux' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"darboux.{_HOME[name]}"), name)
    globals()[name] = value  # the next use finds it without a call
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
