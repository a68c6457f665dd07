"""`darboux info`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from darboux.cli.shell import SCENARIO, Anywhere, Json, print_json, result_of, say, scenario_of


def info(
    file: Annotated[
        Path | None, typer.Argument(metavar="[FILE]", help="A scenario or a result; without one, what darboux knows.")
    ] = None,
    json: Json = False,
    anywhere: Anywhere = False,
) -> None:
    """Say what a scenario or a result holds; without a file: methods, supports, loads, sections and materials."""
    found = _library() if file is None else _of(file, anywhere)
    if json:
        print_json(found)
        return
    for name, words in found.items():
        if isinstance(words, dict):
            say("\n".join([f"{name}:", *(f"  {key}: {value}" for key, value in words.items())]))
        else:
            say(f"{name}: {', '.join(words) if isinstance(words, list) else words}")


def _library() -> dict[str, Any]:
    from darboux import __version__, materials
    from darboux.scenario import forms

    return {
        "darboux": __version__,
        "methods": [shape.name for shape in forms.METHODS],
        "methods of motion": [shape.name for shape in forms.MOTION_METHODS],
        "dampings": [shape.name for shape in forms.DAMPINGS],
        "supports": [shape.name for shape in forms.SUPPORTS],
        "loads": [shape.name for shape in forms.LOADS],
        "sections": [shape.name for shape in forms.SECTIONS],
        "materials": {
            name: f"{entry.words}; E = {entry.material.E:.4g} Pa, nu = {entry.material.poisson:.3g}, "
            f"density {entry.material.density:.4g} kg/m^3. {entry.source}"
            for name, entry in materials.LIBRARY.items()
        },
    }


def _of(file: Path, anywhere: bool) -> dict[str, Any]:
    from darboux import scenario
    from darboux.trajectory import Trajectory

    if file.suffix.lower() == SCENARIO:
        stated = scenario_of(file, anywhere)
        return {
            "kind": "scenario",
            **_problem(stated.problem),
            "method": str(stated.method or "the solver of record"),
            **(_motion(stated.motion, stated.motion_method) if stated.motion else {}),
        }
    solution = result_of(file)
    if isinstance(solution, Trajectory):
        motion = solution.motion
        return {
            "kind": "result",
            "status": solution.status.message,
            **_problem(motion.problem),
            **_motion(motion, solution.method),
            "records": f"{len(solution.times)} to t = {solution.times[-1]:g} s",
            "scenario": "\n" + scenario.Scenario(motion.problem, None, motion, solution.method).toml,
        }
    return {
        "kind": "result",
        "status": solution.status.message,
        **_problem(solution.problem),
        "method": str(solution.method or "the solver of record"),
        "nodes": len(solution.s),
        "scenario": "\n" + scenario.Scenario(solution.problem, solution.method).toml,
    }


def _motion(motion: Any, method: Any) -> dict[str, Any]:
    return {
        "motion": f"{motion.duration:g} s from {motion.initial}",
        "method of motion": str(method or "ImplicitMidpoint()"),
    }


def _problem(problem: Any) -> dict[str, Any]:
    places = [(0.0, problem.start), *problem.between, (problem.rod.length, problem.end)]
    return {
        "problem": type(problem).__name__,
        "length": f"{problem.rod.length:g} m",
        "section": type(problem.rod.section).__name__,
        "model": problem.rod.model,
        "supports": [f"{type(support).__name__} at s = {s:g} m" for s, support in places],
        "loads": [type(load).__name__ for load in problem.loads] or "none",
    }
