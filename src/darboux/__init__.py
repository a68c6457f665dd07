"""Elastic filaments: shapes, inner forces, stability and motion of thin rods by Kirchhoff's theory.

Names are loaded at their first use, so that ``import darboux`` stays light.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from darboux import above

__version__ = "0.1.0"  # the same stands in pyproject.toml; a test holds them together

# Where each public name is made.
_HOMES = {
    "errors": ("InvalidInput", "NotConverged"),
    "profile": ("Table",),
    "material": ("Material",),
    "section": ("Circle", "Tube", "Rectangle", "Ellipse", "Stiffness", "StiffnessMatrix"),
    "natural": ("Helix", "frame_of_helix"),
    "rod": ("Rod",),
    "supports": ("Clamped", "Free", "Guided", "Hinge", "Pinned", "Roller", "Slider", "Spring", "Universal"),
    "loads": (
        *("Buoyancy", "ElectricField", "EndForce", "EndMoment", "Foundation", "Gravity", "LineCouple", "LineForce"),
        *("PointForce", "PointMoment", "Rotation"),
    ),
    "frames": ("turn",),
    "problem": ("Equilibrium", "Ring"),
    "solution": ("EquilibriumSolution", "Status"),
    "statics.solve": ("solve",),
    "statics.solve_many": ("solve_many",),
    "statics.all_equilibria": ("solve_all",),
    "statics.initial_value": ("integrate",),
    "statics.shooting": ("Shooting",),
    "statics.collocation": ("Collocation",),
    "statics.elastica": ("Elastica",),
    "statics.discrete": ("DiscreteRod",),
    "comparison": ("compare", "Comparison"),
    "scenario": ("Scenario", "load"),
    "store": ("open",),
    "motion": ("KelvinVoigt", "LinearDrag", "MassDamping", "Motion", "Moving", "QuadraticDrag"),
    "trajectory": ("Trajectory",),
    "dynamics.simulate": ("simulate",),
    "dynamics.implicit_midpoint": ("ImplicitMidpoint",),
    "dynamics.tr_bdf2": ("TRBDF2",),
    "dynamics.stormer_verlet": ("StormerVerlet",),
    "dynamics.modes": ("natural_modes",),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}

# What modules below call by name, as in `solution.plot()`, and where it is.
above.PLACES.update(
    animate="darboux.view.animation:animate",
    export="darboux.view.space.export:export",
    material="darboux.materials:named",
    page="darboux.view.html:page",
    plot="darboux.view.plots:plot",
    plot_fields="darboux.view.plots:plot_fields",
    save="darboux.store:save",
    stream="darboux.stream:Stream",
    to_toml="darboux.scenario:write",
    view="darboux.view.space.show:view",
)

# All but `open`, so that `from darboux import *` leaves Python's own alone.
__all__ = [
    "TRBDF2",
    "Buoyancy",
    "Circle",
    "Clamped",
    "Collocation",
    "Comparison",
    "DiscreteRod",
    "Elastica",
    "ElectricField",
    "Ellipse",
    "EndForce",
    "EndMoment",
    "Equilibrium",
    "EquilibriumSolution",
    "Foundation",
    "Free",
    "Gravity",
    "Guided",
    "Helix",
    "Hinge",
    "ImplicitMidpoint",
    "InvalidInput",
    "KelvinVoigt",
    "LineCouple",
    "LineForce",
    "LinearDrag",
    "MassDamping",
    "Material",
    "Motion",
    "Moving",
    "NotConverged",
    "Pinned",
    "PointForce",
    "PointMoment",
    "QuadraticDrag",
    "Rectangle",
    "Ring",
    "Rod",
    "Roller",
    "Rotation",
    "Scenario",
    "Shooting",
    "Slider",
    "Spring",
    "Status",
    "Stiffness",
    "StiffnessMatrix",
    "StormerVerlet",
    "Table",
    "Trajectory",
    "Tube",
    "Universal",
    "compare",
    "frame_of_helix",
    "integrate",
    "load",
    "natural_modes",
    "simulate",
    "solve",
    "solve_all",
    "solve_many",
    "turn",
]

if TYPE_CHECKING:
    from darboux.comparison import Comparison, compare
    from darboux.dynamics.implicit_midpoint import ImplicitMidpoint
    from darboux.dynamics.modes import natural_modes
    from darboux.dynamics.simulate import simulate
    from darboux.dynamics.stormer_verlet import StormerVerlet
    from darboux.dynamics.tr_bdf2 import TRBDF2
    from darboux.errors import InvalidInput, NotConverged
    from darboux.frames import turn
    from darboux.loads import (
        Buoyancy,
        ElectricField,
        EndForce,
        EndMoment,
        Foundation,
        Gravity,
        LineCouple,
        LineForce,
        PointForce,
        PointMoment,
        Rotation,
    )
    from darboux.material import Material
    from darboux.motion import KelvinVoigt, LinearDrag, MassDamping, Motion, Moving, QuadraticDrag
    from darboux.natural import Helix, frame_of_helix
    from darboux.problem import Equilibrium, Ring
    from darboux.profile import Table
    from darboux.rod import Rod
    from darboux.scenario import Scenario, load
    from darboux.section import Circle, Ellipse, Rectangle, Stiffness, StiffnessMatrix, Tube
    from darboux.solution import EquilibriumSolution, Status
    from darboux.statics.all_equilibria import solve_all
    from darboux.statics.collocation import Collocation
    from darboux.statics.discrete import DiscreteRod
    from darboux.statics.elastica import Elastica
    from darboux.statics.initial_value import integrate
    from darboux.statics.shooting import Shooting
    from darboux.statics.solve import solve
    from darboux.statics.solve_many import solve_many
    from darboux.store import open as open
    from darboux.supports import Clamped, Free, Guided, Hinge, Pinned, Roller, Slider, Spring, Universal
    from darboux.trajectory import Trajectory


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'darboux' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"darboux.{_HOME[name]}"), name)
    globals()[name] = value  # the next use finds it without a call
    return value


def __dir__() -> list[str]:
    return [*__all__, "open", "__version__"]
