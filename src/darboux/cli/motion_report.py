"""What a person and a program read of a trajectory."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from darboux import __version__
from darboux.cli.report import duration_text, table_of, vector_text
from darboux.trajectory import Trajectory
from darboux.view import terminal

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


def content(trajectory: Trajectory, seconds: float) -> dict[str, Any]:
    """Return the numbers of a trajectory at its end, in SI, for JSON."""
    energy, counts = trajectory.energy, trajectory.statistics
    return {
        "status": trajectory.status.code,
        "converged": trajectory.converged,
        "message": trajectory.status.message,
        "method": str(trajectory.method),
        "model": trajectory.motion.problem.rod.model,
        "t": trajectory.times[-1],
        "duration": trajectory.motion.duration,
        "tip": {"r": trajectory.tip[-1]},
        "energy": {
            "total": energy.total[-1],
            "kinetic": energy.kinetic[-1],
            "elastic": energy.elastic[-1],
            "supports": energy.supports[-1],
            "load": energy.load[-1],
            "dissipated": energy.dissipated[-1],
            "work": energy.work[-1],
            "drift": energy.drift,
        },
        "momentum": trajectory.momentum[-1],
        "angular_momentum": trajectory.angular_momentum[-1],
        "warnings": trajectory.warnings,
        "records": len(trajectory.times),
        "steps": counts["steps"],
        "newton_iterations": counts["newton_iterations"],
        "halvings": counts["halvings"],
        "seconds": seconds,
        "units": "SI",
        "version": __version__,
    }


def table(trajectory: Trajectory, title: str, seconds: float) -> Table:
    """Return the table that an engineer wants; it fits a screen of 80 columns."""
    energy, counts = trajectory.energy, trajectory.statistics
    rows = [
        ("status", trajectory.status.message),
        *(("warning", sentence) for sentence in trajectory.warnings),
        ("method", f"{trajectory.method}, {trajectory.motion.problem.rod.model}"),
        ("reached", f"t = {trajectory.times[-1]:.6g} s of {trajectory.motion.duration:.6g} s"),
        ("tip at the end", f"{vector_text(trajectory.tip[-1], trajectory.motion.problem.rod.length)} m"),
        ("energy at the end", f"{energy.total[-1]:.6g} J ({energy.parts})"),
        ("dissipated, work", f"{energy.dissipated[-1]:.6g} J by damping, {energy.work[-1]:.6g} J done on the rod"),
        ("balance", f"energy kept to {energy.drift:.1e} of its largest change"),
        (
            "steps",
            f"{counts['steps']}, shortened {counts['halvings']} times; {counts['newton_iterations']} Newton iterations",
        ),
        ("time", duration_text(seconds)),
    ]
    return table_of(rows, title)


def picture(trajectory: Trajectory, screen: Console) -> str:
    """Return the last shape as a small picture, in letters that the screen has."""
    return terminal.picture(trajectory.positions[-1], plain=screen.options.ascii_only)
