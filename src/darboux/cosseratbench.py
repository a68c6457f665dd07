"""The adapter by which cosseratbench, a benchmark suite with references and metrics of its own, runs darboux.

Every rod of a scenario is one motion of a discrete rod that stretches, with the suite's number of elements as segments,
from the suite's initial shape on. Where the motion itself is the result, it is followed by ``ImplicitMidpoint`` without any
damping. Where equilibrium is the result (``quasi_static``), it is followed by ``TRBDF2``, braked in proportion to mass with
the rate that is critical for the slowest mode, as the suite's own adapters do. Nothing depends on which scenario it is.

There is no shear and no contact: the suite sees that in ``capabilities`` and declines what needs them. A scenario that allows
touching but does not require it runs without, and the suite reports how deep its rods overlap.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from cosseratbench.scenario import End, EndCondition, Rod, Scenario, rotation_matrix
from cosseratbench.solver import Capability, Diverged
from cosseratbench.trajectory import Trajectory
from numpy.typing import NDArray

import darboux as dx

Array = NDArray[np.float64]

STEPS = 2000  # to a period of the slowest mode, where the motion is the result
RTOL = 1e-5  # of a step, where equilibrium is


class DarbouxSolver:
    """Runs a scenario of cosseratbench; ``time_step_scale`` multiplies the time steps, an adaptive one by its rtol."""

    name = "darboux"
    backend_version = dx.__version__
    capabilities = frozenset({Capability.STRETCH})

    def __init__(self, time_step_scale: float = 1.0) -> None:
        self.scale = time_step_scale

    def method(self, scenario: Scenario, n_elements: int) -> Any:
        """Return the method of motion."""
        if scenario.quasi_static:
            return dx.TRBDF2(n_elements, rtol=RTOL * self.scale ** (dx.TRBDF2.order + 1))
        period = 2.0 * np.pi / scenario.slowest_frequency()
        return dx.ImplicitMidpoint(n_elements, step=self.scale * period / STEPS)

    def settings(self, scenario: Scenario, *, n_elements: int, n_frames: int) -> dict[str, Any]:
        """Return what the suite shows beside the results."""
        return {"method": str(self.method(scenario, n_elements)), "damping_rate": _rate(scenario)}

    def run(self, scenario: Scenario, *, n_elements: int, n_frames: int) -> Trajectory:
        """Return the scenario's motion at ``n_frames`` equal distances of time.

        Raises ``NotImplementedError`` with the sentence that says what can't be stated, and ``Diverged`` where a step does
        not converge.
        """
        try:
            method = self.method(scenario, n_elements)
            motions = [_motion(scenario, rod, n_elements) for rod in scenario.rods]
            runs = [dx.simulate(m, method, records=n_frames - 1, throw=False, progress=False) for m in motions]
        except dx.InvalidInput as error:
            raise NotImplementedError(str(error)) from error
        for run in runs:
            if run.status.code == "no_convergence":
                raise Diverged(run.status.message, time=float(run.times[-1]))
        return Trajectory(
            runs[0].times,
            tuple(run.positions for run in runs),
            tuple(_directors(run, rod, n_elements) for run, rod in zip(runs, scenario.rods, strict=True)),
        )


def _rate(scenario: Scenario) -> float:
    """Return the damping by mass in 1/s: critical for the slowest mode where equilibrium is the result, else none."""
    return 2.0 * scenario.slowest_frequency() if scenario.quasi_static else 0.0


def _motion(scenario: Scenario, rod: Rod, n_elements: int) -> dx.Motion:
    """Return the motion of one rod of a scenario."""
    material = dx.Material(rod.material.youngs_modulus, G=rod.material.shear_modulus, density=rod.material.density)
    nodes, s = rod.nodes(n_elements), np.linspace(0.0, rod.length, n_elements + 1)
    supports = {at.value: _support(rod, at, n_elements) for at in End}
    free = not any(support.holds for support in supports.values())
    if free:  # an equilibrium must be held; its motion need not
        supports["start"] = dx.Pinned(position=nodes[0])
    driven = {at.value: rod.motion(at) for at in End}
    moving = {at: _moving(motion, supports[at]) for at, motion in driven.items() if motion is not None}
    loads = [dx.EndForce(load.force, at=load.at.value) for load in rod.loads if not supports[load.at.value].clamps]
    rate = _rate(scenario)
    return dx.Motion(
        dx.Equilibrium(
            dx.Rod(rod.length, dx.Circle(radius=rod.radius), material, stretch=True),
            **supports,
            loads=[dx.Gravity(scenario.gravity), *loads],
        ),
        scenario.duration,
        initial=lambda at: np.stack([np.interp(at, s, x) for x in nodes.T], axis=1),
        damping=[dx.MassDamping(rate)] if rate else [],
        release={"start": 0.0} if free else {},
        start=moving.get("start"),
        end=moving.get("end"),
    )


def _support(rod: Rod, at: End, n_elements: int) -> Any:
    """Return what holds an end: a clamp along the tangent of the initial curve there, turned as its element is."""
    first = at is End.START
    position = rod.centerline[0 if first else -1]
    if rod.condition(at) is EndCondition.FREE:
        return dx.Free()
    if rod.condition(at) is EndCondition.PINNED:
        return dx.Pinned(position)
    pose = {
        "tangent": _tangent(rod.centerline) if first else -_tangent(rod.centerline[::-1]),
        "d1": rod.directors(n_elements)[0 if first else -1],
    }
    motion = rod.motion(at)
    if motion is not None and motion.slides_along is not None:
        return dx.Slider(motion.slides_along, position, **pose)
    return dx.Clamped(position, **pose)


def _tangent(points: Any) -> Array:
    """Return the direction in which the curve through the points sets out: that of the parabola through the first three.

    The first chord is off by half the turn of a segment, and a clamp along it bends the rod for good.
    """
    chords = np.diff(np.array(points[:3]), axis=0)
    if len(chords) == 1:
        return np.asarray(chords[0])
    first, second = np.linalg.norm(chords, axis=1)
    return np.asarray(chords[0] / first + first / (first + second) * (chords[0] / first - chords[1] / second))


def _moving(motion: Any, support: Any) -> dx.Moving:
    """Return how an end is driven, smoothly through the suite's samples: corners would set waves going along the rod."""
    from scipy.interpolate import PchipInterpolator

    position, R = np.array(support.position), support.R
    last = motion.times[-1]
    moved = PchipInterpolator(motion.times, motion.displacement)
    turned = PchipInterpolator(motion.times, motion.rotation)
    return dx.Moving(
        position=(lambda t: position + moved(min(t, last))) if np.any(motion.displacement) else None,
        frame=lambda t: rotation_matrix(turned(min(t, last))) @ R,
    )


def _directors(run: dx.Trajectory, rod: Rod, n_elements: int) -> Array:
    """Return the suite's material line, which a round rod carries at a constant angle to our first director."""
    R, line = run.frames, rod.directors(n_elements)[0]
    return np.asarray(R[..., 0] * (R[0, 0, :, 0] @ line) + R[..., 1] * (R[0, 0, :, 1] @ line))
