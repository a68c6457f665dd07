"""The paper's figure 5 with stretch, 50 segments, from the straight rod: our static solution against PyElastica at rest.

PyElastica has no static solver: its rod falls and is damped until it hangs still. It is set up as a fair and competent
user would, and better: all that could be tuned is tuned outside the timed part, on the known answer.

- 50 elements, its own clamp (`OneEndFixedBC`), gravity and `PositionVerlet` (one force evaluation per step), no
  callbacks; E = 1e6 Pa and G = E / 3, so that it shears, which moves the answer by less than 1e-5 L.
- The time step is the largest of a list that is stable; the next one, 2 % longer, blows up.
- The damping (`AnalyticalLinearDamper`, unconditionally stable) is whichever of two protocols and many constants brings
  the tip to rest soonest by the clock: the fewest steps, times what a step of that protocol costs.
- The clock runs only while it steps, and stops at the first step from which on the tip stays within 1e-3 L of where it
  comes to rest in the end, which a longer run told before. No step looks at the tip. Making the rod is not counted;
  for ours all of `DiscreteRod(50).solve(problem)` is, with its checks and its result.
- In the plot both have several numbers of segments; with more than 50 PyElastica's time step is
  shorter in proportion, with fewer it can't be longer; its damping is the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

import darboux as dx
from benchmarks.timing import Curve, Row, Spread, interleaved, seconds
from darboux.paper.cases import figure5

Array = NDArray[np.float64]

SEGMENTS, LENGTH, RADIUS, DENSITY, E, GRAVITY = 50, 0.25, 1e-3, 1e3, 1e6, 9.81
NEAR = 1e-3 * LENGTH  # of its own answer: at rest
TRUE_TIP = np.array([0.014817711552, 0.0, -0.244237586080])  # m, 12 digits; the table
STEPS = (6e-5, 5.5e-5, 5.3e-5, 5.2e-5, 5.1e-5, 5e-5, 4.9e-5, 4.8e-5, 4.5e-5, 4e-5)  # s
LONGEST, UNTIL_REST = 6.0, 1.6  # s simulated: for its own answer, and to see when it stays near it
PROTOCOLS = ("uniform", "translational")
CONSTANTS = np.arange(10.0, 18.0, 1.0)  # 1/s; critical damping of the slowest swing lies near 15
FINER = np.arange(-0.8, 0.9, 0.2)  # about the best of those
LEAST_RATIO = 100.0
OUR_SEGMENTS, THEIR_SEGMENTS = (10, 20, 50, 100, 200, 500, 1000), (10, 20, 50, 100)  # of the plot
SHARES = (1.0, 0.9, 0.8, 0.6)  # of the time step with 50 segments, shorter in proportion with more


@dataclass(frozen=True)
class Settings:
    """Time step in s; damping in 1/s, of all rates or of the velocities only; how many steps it takes to rest."""

    dt: float
    protocol: str
    constant: float
    steps: int = 0
    segments: int = SEGMENTS

    def __str__(self) -> str:
        return f"dt {self.dt:g} s, {self.protocol} damping {self.constant:g}/s, {self.steps} steps"


RECORDED = Settings(5.1e-5, "uniform", 14.2)  # the best that the search found; a quick run takes it


def rows(quick: bool) -> Iterator[Row | Curve | str]:
    if find_spec("elastica") is None:
        yield "PyElastica is not installed here, so figure 5 was not timed against it: pip install 'pyelastica>=1.0'."
        return
    problem, method = figure5(stretch=True), dx.DiscreteRod(SEGMENTS)
    rest = _tips(Settings(4e-5, "uniform", 13.0), LONGEST)[-1]
    best = _with_steps(RECORDED, rest) if quick else _best(rest)
    tip = method.solve(problem).check().tip  # compiles
    calls = 10
    ours, theirs = [], []
    for _ in range(3 if quick else 11):
        ours.append(seconds(lambda: method.solve(problem), calls))
        fall = _Fall(best)  # not timed
        theirs.append(seconds(fall.to_rest))
        if np.linalg.norm(fall.tip - rest) > NEAR:
            raise RuntimeError(f"PyElastica was timed with {best}, but had not come to rest")
    a, b = 1e3 * np.array(ours), 1e3 * np.array(theirs)
    yield Row(
        name="against_pyelastica.figure5",
        what=f"figure 5 with stretch, {SEGMENTS} segments, cold, DiscreteRod.solve",
        ours=Spread.of(a),
        unit="ms",
        peer="PyElastica, stepping until at rest",
        theirs=Spread.of(b),
        ratio=Spread.of(b / a),
        least_ratio=LEAST_RATIO,
        our_error=float(np.linalg.norm(tip - TRUE_TIP)) / LENGTH,
        their_error=float(np.linalg.norm(rest - TRUE_TIP)) / LENGTH,
        error_of="tip / L",
        note=f"{best}, {1e3 * float(np.median(b)) / best.steps:.1f} us each",
    )
    yield from _by_segments(best, quick)


def _by_segments(best: Settings, quick: bool) -> Iterator[Curve]:
    """Time both at several numbers of segments."""
    problem = figure5(stretch=True)
    works = [partial(dx.DiscreteRod(n).solve, problem) for n in OUR_SEGMENTS]
    times = interleaved(*works, rounds=3 if quick else 15)
    errors = [float(np.linalg.norm(solve().check().tip - TRUE_TIP)) / LENGTH for solve in works]
    yield Curve(
        "against_pyelastica.error", "DiscreteRod, cold", tuple(errors), tuple(Spread.of(1e3 * t) for t in times),
        marks=tuple(str(n) for n in OUR_SEGMENTS),
    )  # fmt: skip
    sizes = THEIR_SEGMENTS[:3] if quick else THEIR_SEGMENTS
    errors, cost = [], []
    for n in sizes:
        settings, rest = _resting(best, n)
        falls = [_Fall(settings) for _ in range(1 if quick else 3)]
        cost.append(Spread.of(1e3 * np.array([seconds(fall.to_rest) for fall in falls])))
        errors.append(float(np.linalg.norm(rest - TRUE_TIP)) / LENGTH)
    yield Curve(
        "against_pyelastica.error", "PyElastica, until at rest", tuple(errors), tuple(cost), peer=True,
        marks=tuple(map(str, sizes)),
    )  # fmt: skip


def _resting(best: Settings, n: int) -> tuple[Settings, Array]:
    """Return settings for n segments that come to rest, and the tip there: the largest of a few time steps that is stable."""
    for share in SHARES:
        settings = replace(best, dt=share * best.dt * min(1.0, SEGMENTS / n), segments=n)
        tips = _tips(settings, LONGEST)
        if len(tips) == round(LONGEST / settings.dt):
            settings = _with_steps(settings, tips[-1])
            if settings.steps:
                return settings, tips[-1]
    raise RuntimeError(f"PyElastica does not come to rest with {n} segments")


class _Fall:
    """A simulation of figure 5 by PyElastica, ready to step."""

    def __init__(self, settings: Settings) -> None:
        import elastica as ea

        class Simulator(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):  # type: ignore[misc]
            pass

        self.settings = settings
        self.simulator, self.stepper = Simulator(), ea.PositionVerlet()
        x, z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
        self.rod = ea.CosseratRod.straight_rod(
            settings.segments, np.zeros(3), x, z, LENGTH, RADIUS, DENSITY, youngs_modulus=E, shear_modulus=E / 3.0
        )
        self.simulator.append(self.rod)
        clamp = {"constrained_position_idx": (0,), "constrained_director_idx": (0,)}
        self.simulator.constrain(self.rod).using(ea.OneEndFixedBC, **clamp)
        self.simulator.add_forcing_to(self.rod).using(ea.GravityForces, acc_gravity=-GRAVITY * z)
        if settings.protocol == "uniform":
            damping = {"uniform_damping_constant": settings.constant}
        else:  # a coefficient in kg/s, the same for every node
            mass = DENSITY * np.pi * RADIUS**2 * LENGTH / settings.segments
            damping = {
                "translational_damping_constant": settings.constant * mass,
                "rotational_damping_constant": 0.0,
            }
        damper = ea.AnalyticalLinearDamper
        self.simulator.dampen(self.rod).using(damper, time_step=np.float64(settings.dt), **damping)
        self.simulator.finalize()

    @property
    def tip(self) -> Array:
        return np.array(self.rod.position_collection[:, -1])

    def to_rest(self) -> None:
        step, simulator = self.stepper.step, self.simulator
        t, dt = np.float64(0.0), np.float64(self.settings.dt)
        for _ in range(self.settings.steps):
            t = step(simulator, t, dt)


def _tips(settings: Settings, duration: float) -> Array:
    """Return the tip after every step (n, 3); short of ``duration`` where the simulation blows up."""
    fall = _Fall(settings)
    t, dt = np.float64(0.0), np.float64(settings.dt)
    tips = []
    with np.errstate(all="ignore"):
        for _ in range(round(duration / settings.dt)):
            t = fall.stepper.step(fall.simulator, t, dt)
            tips.append(fall.tip)
            if not np.linalg.norm(tips[-1]) < 1.3 * LENGTH:
                break
    return np.array(tips)


def _with_steps(settings: Settings, rest: Array) -> Settings:
    """Return the settings with the steps after which the tip stays near its rest; 0 where it never does."""
    tips = _tips(settings, UNTIL_REST)
    steps = int(np.flatnonzero(~(np.linalg.norm(tips - rest, axis=1) <= NEAR))[-1]) + 2
    stayed = steps * settings.dt < 0.98 * UNTIL_REST and len(tips) == round(UNTIL_REST / settings.dt)
    return replace(settings, steps=steps if stayed else 0)


def _best(rest: Array) -> Settings:
    """Return the settings of least time: the largest stable time step first, then protocol and constant."""
    dt = next(dt for dt in STEPS if _with_steps(Settings(dt, "uniform", 12.0), rest).steps)
    best, least = None, np.inf
    for protocol in PROTOCOLS:
        of_a_step = _seconds_per_step(Settings(dt, protocol, 12.0, 1000))
        found = _fewest(dt, protocol, CONSTANTS, rest)
        found = _fewest(dt, protocol, found.constant + FINER, rest)
        if found.steps * of_a_step < least:
            best, least = found, found.steps * of_a_step
    if best is None:
        raise RuntimeError("no damping brought PyElastica to rest")
    return best


def _fewest(dt: float, protocol: str, constants: Array, rest: Array) -> Settings:
    """Return the settings of fewest steps to rest among several damping constants."""
    tried = [_with_steps(Settings(dt, protocol, float(constant)), rest) for constant in constants]
    return min((settings for settings in tried if settings.steps), key=lambda settings: settings.steps)


def _seconds_per_step(settings: Settings) -> float:
    return float(np.median([seconds(_Fall(settings).to_rest) for _ in range(5)])) / settings.steps
