"""Motion: a rubber rod let go, a steel rod that is struck, against PyElastica; and what one segment costs in one step.

- Released: the rod of the paper's figure 5 with stretch, 50 segments, let go from the horizontal, 1 s, undamped.
  PyElastica steps by `PositionVerlet` with 5e-5 s, near its largest stable step. Both are held against the converged
  motion, ours with 200 segments and a step of 5e-5 s; the error is the root mean square of the tip's, over L, up to 0.75
  s: after that the whip's crack multiplies every difference a thousandfold. Our step is the one
  of a list that takes the least time at an error no larger than PyElastica's.
- Struck: a steel rod (L 1 m, radius 5 mm, E 210 GPa, 7850 kg/m^3), 50 segments, clamped, with a force at its end that
  is there all at once, 1 s. The first mode of a beam says q = q_static (1 - cos omega t); the error is the largest of
  the rod's projection on that mode, over its amplitude 2 q_static, and our step is chosen to keep it below 1 %.
  PyElastica's largest stable step is 1.4e-6 s; of its 714,286 steps 20,000 are timed, and the rest is reckoned.
- Cost: one step of the midpoint rule (5e-4 s) and one of PyElastica, per segment, by turns. Theirs is explicit: 5e-5 s
  with 50 segments, and shorter in proportion with more.
- Only the stepping of PyElastica is timed; of ours all of `simulate`, with its checks and 100 records. Newton's method is
  followed to 1e-5 and 1e-6 rad, well below the error of the step.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

import darboux as dx
from benchmarks.timing import Curve, Row, Spread, interleaved, seconds
from darboux.paper.cases import figure5

Array = NDArray[np.float64]

SEGMENTS = 50
RELEASED_STEPS, RELEASED_DT = (5e-3, 2.5e-3, 1.25e-3, 1e-3, 5e-4), 5e-5  # s
STRUCK_STEP, STRUCK_DT = 1e-3, 1.4e-6  # s
COMPARED = 0.75  # s
BETA = 1.8751040687119611  # cos b cosh b = -1
SIZES = (50, 500, 5000)
RECORDS = 100


def rows(quick: bool) -> Iterator[Row | Curve | str]:
    yield from _costs(rounds=3 if quick else 11)
    if find_spec("elastica") is None:
        yield "PyElastica is not installed here, so no motion was timed against it: pip install 'pyelastica>=1.0'."
        return
    yield _released(3 if quick else 7)
    yield _struck(3 if quick else 7)


# Released


def _released(rounds: int) -> Row:
    problem = figure5(stretch=True)
    motion, length = dx.Motion(problem, 1.0), problem.rod.length
    true = dx.simulate(motion, dx.ImplicitMidpoint(200, step=5e-5), records=RECORDS).tip

    def error(tips: Array) -> float:
        compared = int(COMPARED * (len(true) - 1)) + 1
        gaps = np.linalg.norm((tips - true)[:compared], axis=1) / length
        return float(np.sqrt(np.mean(gaps**2)))

    theirs = error(_pyelastica_tips())
    tried = []
    for step in RELEASED_STEPS:
        run = dx.simulate(
            motion, dx.ImplicitMidpoint(SEGMENTS, step=step, tolerance=1e-5), records=RECORDS, throw=False
        )
        tried.append(
            (run.statistics["newton_iterations"] if error(run.tip) <= theirs else np.inf, error(run.tip), step)
        )
    _, ours, step = min(tried)
    method = dx.ImplicitMidpoint(SEGMENTS, step=step, tolerance=1e-5)
    steps = round(1.0 / RELEASED_DT)
    a, b = [], []
    for _ in range(rounds):
        a.append(1e3 * seconds(lambda: dx.simulate(motion, method, records=RECORDS)))
        run = _rubber()
        b.append(1e3 * seconds(lambda run=run: run(steps)))
    return Row(
        name="motion.released",
        what=f"figure 5 let go, 1 s, {SEGMENTS} segments, {method}",
        ours=Spread.of(np.array(a)),
        unit="ms",
        peer="PyElastica, PositionVerlet",
        theirs=Spread.of(np.array(b)),
        ratio=Spread.of(np.array(b) / np.array(a)),
        least_ratio=10.0,
        our_error=ours,
        their_error=theirs,
        error_of="tip / L, rms",
        note=f"PyElastica: {steps} steps of {RELEASED_DT:g} s",
    )


def _rubber(segments: int = SEGMENTS, dt: float = RELEASED_DT) -> Any:
    ahead = np.array([1.0, 0.0, 0.0])
    return _Elastica(0.25, 1e-3, 1e3, 1e6, 1e6 / 3.0, ahead, dt, segments=segments, weight=True)


def _pyelastica_tips() -> Array:
    run, each = _rubber(), round(1.0 / RELEASED_DT / RECORDS)
    tips = [run.tip]
    for _ in range(RECORDS):
        run(each)
        tips.append(run.tip)
    return np.array(tips)


# Struck


def _struck(rounds: int) -> Row:
    L, r, E, rho = 1.0, 5e-3, 210e9, 7850.0
    rod = dx.Rod(L, dx.Circle(r), dx.Material(E=E, nu=0.3, density=rho), stretch=True)
    EI, mass = E * np.pi * r**4 / 4.0, rho * np.pi * r**2
    force = 3.0 * EI / L**3 * 1e-3 * L  # moves the end by L / 1000: a linear motion
    omega = BETA**2 / L**2 * np.sqrt(EI / mass)
    motion = dx.Motion(dx.Equilibrium(rod, loads=[dx.EndForce((force, 0, 0))]), 1.0)
    method = dx.ImplicitMidpoint(SEGMENTS, step=STRUCK_STEP, tolerance=1e-6)
    x = dx.simulate(motion, method, records=RECORDS)
    s = BETA * x.s / L
    ratio = (np.cosh(BETA) + np.cos(BETA)) / (np.sinh(BETA) + np.sin(BETA))
    mode = np.cosh(s) - np.cos(s) - ratio * (np.sinh(s) - np.sin(s))
    static = force * mode[-1] / (mass * omega**2)
    q = np.trapezoid(x.positions[:, :, 0] * mode, x.s, axis=1) / L
    error = np.max(np.abs(q - static * (1.0 - np.cos(omega * x.times)))) / (2.0 * static)
    steps = round(1.0 / STRUCK_DT)
    run = _Elastica(L, r, rho, E, E / 2.6, np.array([0.0, 0.0, 1.0]), STRUCK_DT, force=np.array([force, 0.0, 0.0]))
    run(100)
    a, b = [], []
    for _ in range(rounds):
        a.append(1e3 * seconds(lambda: dx.simulate(motion, method, records=RECORDS)))
        b.append(1e3 * seconds(lambda: run(20_000)) * steps / 20_000)
    return Row(
        name="motion.struck",
        what=f"steel rod struck, 1 s, {SEGMENTS} segments, {method}",
        ours=Spread.of(np.array(a)),
        unit="ms",
        peer="PyElastica, PositionVerlet",
        theirs=Spread.of(np.array(b)),
        ratio=Spread.of(np.array(b) / np.array(a)),
        least_ratio=200.0,
        our_error=float(error),
        error_of="first mode",
        note=f"PyElastica: {steps} steps of {STRUCK_DT:g} s, reckoned from 20,000",
    )


class _Elastica:
    """A clamped rod of PyElastica, ready to step."""

    def __init__(
        self, length: float, radius: float, rho: float, E: float, shear: float, direction: Array, dt: float,
        *, segments: int = SEGMENTS, weight: bool = False, force: Array | None = None,
    ) -> None:  # fmt: skip
        import elastica as ea

        class Simulator(ea.BaseSystemCollection, ea.Constraints, ea.Forcing):  # type: ignore[misc]
            pass

        self.simulator, self.stepper = Simulator(), ea.PositionVerlet()
        normal = np.array([0.0, 1.0, 0.0])
        self.rod = ea.CosseratRod.straight_rod(
            segments, np.zeros(3), direction, normal, length, radius, rho, youngs_modulus=E, shear_modulus=shear
        )
        self.simulator.append(self.rod)
        clamp = {"constrained_position_idx": (0,), "constrained_director_idx": (0,)}
        self.simulator.constrain(self.rod).using(ea.OneEndFixedBC, **clamp)
        if weight:
            down = np.array([0.0, 0.0, -9.81])
            self.simulator.add_forcing_to(self.rod).using(ea.GravityForces, acc_gravity=down)
        if force is not None:
            self.simulator.add_forcing_to(self.rod).using(ea.EndpointForces, np.zeros(3), force, ramp_up_time=1e-9)
        self.simulator.finalize()
        self.t, self.dt = np.float64(0.0), np.float64(dt)

    @property
    def tip(self) -> Array:
        return np.array(self.rod.position_collection[:, -1])

    def __call__(self, steps: int) -> None:
        step, simulator, t, dt = self.stepper.step, self.simulator, self.t, self.dt
        for _ in range(steps):
            t = step(simulator, t, dt)
        self.t = t


# Cost


def _costs(rounds: int) -> Iterator[Row | Curve]:
    problem = figure5(stretch=True)
    peers = find_spec("elastica") is not None
    newton: dict[int, Array] = {}
    ours, theirs = [], []
    for size in SIZES:
        method, steps = dx.ImplicitMidpoint(size, step=5e-4), max(20, 20_000 // size)
        motion = dx.Motion(problem, steps * 5e-4)
        done = dx.simulate(motion, method, records=1).statistics
        works = [lambda motion=motion, method=method: dx.simulate(motion, method, records=1)]
        if peers:
            # The step shrinks with the segments, as a wave's way does.
            rod = _rubber(size, RELEASED_DT * SEGMENTS / size)
            works.append(lambda rod=rod, steps=steps: rod(steps))
        times = [1e9 * t / steps / size for t in interleaved(*works, rounds=rounds, span=0.0)]
        newton[size] = times[0] * done["steps"] / done["newton_iterations"]
        ours.append(Spread.of(times[0]))
        theirs += [Spread.of(t) for t in times[1:]]
        yield Row(
            name=f"motion.cost_{size}",
            what=f"one Newton iteration of a midpoint step, per segment, {size:,} segments",
            ours=Spread.of(newton[size]),
            unit="ns",
            guard=float(np.median(newton[size] / times[1])) if peers else None,
            note=f"{done['newton_iterations'] / done['steps']:.1f} iterations a step; "
            f"{np.median(newton[size]) / np.median(newton[SIZES[0]]):.2f} times that at {SIZES[0]} segments",
        )
    yield Curve("motion.size", "midpoint rule", SIZES, tuple(ours))
    if peers:
        yield Curve("motion.size", "PyElastica, explicit", SIZES, tuple(theirs), peer=True)
