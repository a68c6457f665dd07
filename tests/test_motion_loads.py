"""What acts on a rod in motion and what holds it: against statics, against flutter, from a turning frame, and let go."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import darboux as dx

SECTION = dx.Stiffness(EI1=1.0, EI2=1.5, GJ=0.8, EA=1e4, mass=1.0)
ROD = dx.Rod(1.0, SECTION, natural=(0.3, 0.5, 0.7), stretch=True)
UP = (0, 0, 1)
PUSH = dx.LineForce((1, 2, -3))
ROLLER = dx.Roller(UP, position=UP)
SPRING = dx.Spring(linear=5.0, rotational=np.diag([1, 2, 0.5]), position=(0, 0.1, 0.9))
TURNING = [dx.EndForce((0.5, 0.3, -0.6), follower=True), dx.EndMoment((0.3, 0.2, 0.4), follower=True)]
AT_POINTS = [
    dx.PointForce((0.5, 0.3, 0.6), at=0.37, follower=True),
    dx.PointMoment((0.3, 0.2, 0.4), 0.37, follower=True),
]
OFF = {"offset": (0.1, -0.2, 0.15)}
ECCENTRIC = [dx.EndForce((0.5, 0.3, -0.6), **OFF), dx.PointForce((1, 0.5, 0.6), 0.37, **OFF)]
IN_SECTION = [dx.LineForce((0.5, 0.3, 0.6), frame="section"), dx.LineCouple((0.3, 0.2, 0.4), frame="section")]
FIELDS = [
    dx.LineCouple((0.3, 0.2, 0.4)),
    dx.Buoyancy(0.2, area=1.0),
    dx.ElectricField((1, 0, 0), 1.5),
    dx.Foundation(3.0),
]
BETWEEN = {0.3: dx.Roller(UP, position=(0, 0, 0.3)), 0.61: dx.Spring(linear=50, position=(0, 0, 0.61))}
PROBLEMS = {
    "followers on the end": dx.Equilibrium(ROD, loads=TURNING),
    "loads at points": dx.Equilibrium(
        ROD, loads=[dx.PointForce((0.5, 0.3, 0.6), 0.37), dx.PointMoment((0.3, 0.2, 0.4), 0.6)]
    ),
    "followers at points": dx.Equilibrium(ROD, loads=AT_POINTS),
    "off the centre": dx.Equilibrium(ROD, loads=ECCENTRIC),
    "off the centre, with others": dx.Equilibrium(ROD, loads=[*ECCENTRIC, *AT_POINTS, dx.EndMoment((0.1, 0.2, 0.1))]),
    "off the centre of joints": dx.Equilibrium(
        ROD, dx.Hinge((1, 0, 0)), ROLLER, loads=[*ECCENTRIC, dx.EndForce((0.3, 0.2, -0.4), at="start", **OFF)]
    ),
    "followers along the rod": dx.Equilibrium(ROD, loads=IN_SECTION),
    "fields": dx.Equilibrium(ROD, loads=FIELDS),
    "turning frame": dx.Equilibrium(
        ROD, dx.Clamped(tangent=(1, 0, 0)), loads=[dx.Rotation((0, 0, 2)), dx.Gravity((0, 0, -1))]
    ),
    "hinge": dx.Equilibrium(ROD, dx.Hinge((1, 0, 0)), ROLLER, loads=[PUSH, dx.EndMoment((1, 0.2, 0.3), at="start")]),
    "universal": dx.Equilibrium(ROD, dx.Universal((1, 0, 0), (0, 1, 0)), ROLLER, loads=[PUSH, *IN_SECTION]),
    "spring": dx.Equilibrium(ROD, end=SPRING, loads=[PUSH, *TURNING]),
    "slider": dx.Equilibrium(ROD, end=dx.Slider((0, 1, 1), position=UP), loads=[PUSH, TURNING[0], ECCENTRIC[0]]),
    "guided": dx.Equilibrium(ROD, end=dx.Guided(tangent=(0, 0.2, 1)), loads=[PUSH]),
    "between": dx.Equilibrium(ROD, dx.Pinned(), ROLLER, between=BETWEEN, loads=[PUSH]),
}


@pytest.fixture(scope="module")
def solved() -> dict[str, dx.EquilibriumSolution]:
    return {name: dx.solve(problem) for name, problem in PROBLEMS.items()}


@pytest.mark.parametrize("name", PROBLEMS)
def test_an_equilibrium_of_statics_is_at_rest(name: str, solved) -> None:
    """What collocation finds is, but for an error of order 2 in 1/N, where the discrete rod stays."""
    errors = []
    for N in (20, 40):
        motion = dx.Motion(PROBLEMS[name], 4e-3, initial=solved[name])
        x = dx.simulate(motion, dx.ImplicitMidpoint(N, step=1e-3), records=1)
        assert np.max(np.abs(x.velocities[-1])) < 1e-9
        errors.append(float(np.max(np.abs(x.positions[0] - solved[name].r(x.s)))))
    order = np.log2(errors[0] / errors[1])
    assert abs(order - 2.0) < 0.15, f"order {order:.2f}, declared 2; errors {errors}"


STIFF = dx.TRBDF2(12, step=1e-3)
METHODS = [dx.ImplicitMidpoint(12, step=4e-3), dx.TRBDF2(12, step=4e-3), dx.StormerVerlet(12, step=2e-4)]


@pytest.mark.parametrize("method", METHODS, ids=lambda method: type(method).__name__)
def test_order_in_time_with_all_that_follows(method, solved) -> None:
    rod = dataclasses.replace(ROD, section=dataclasses.replace(SECTION, EA=300.0))
    loads = [*TURNING, *AT_POINTS, *IN_SECTION, dx.Rotation((0, 0, 2.0)), dx.Gravity((0, 0, -1))]
    swing = lambda t: np.cos(9 * t) ** 2  # noqa: E731
    factors = [None, swing, None, swing, lambda t: 1 + t**2, swing, None, swing]
    problem = dx.Equilibrium(
        rod, dx.Universal((1, 0, 0), (0, 1, 0)), SPRING, between={0.5: dx.Spring(linear=9.0)}, loads=loads
    )
    motion = dx.Motion(
        problem, 0.1, "equilibrium", load_factor=factors, damping=[dx.LinearDrag(0.5, 1.0)], rotary_inertia=0.02
    )
    ends = []
    for halving in range(3):
        x = dx.simulate(motion, dataclasses.replace(method, step=method.step / 2**halving), records=1)
        ends.append(np.concatenate([x.positions[-1].ravel(), x.directors[-1].ravel()]))
    order = np.log2(np.linalg.norm(ends[1] - ends[0]) / np.linalg.norm(ends[2] - ends[1]))
    assert abs(order - method.order) < 0.25, f"order {order:.3f}, declared {method.order}"
    assert x.energy.drift < 1e-4


def test_a_motion_seen_from_a_turning_frame() -> None:
    """Coriolis' force: let go from rest in the turning frame, and from r_t = omega x r outside, where the clamp turns."""
    rod, spin = dataclasses.replace(ROD, natural=None), 5.0
    arm = dx.Clamped(position=(0.2, 0, 0), tangent=(1, 0, 0))

    def turned(t):
        c, s = np.cos(spin * t), np.sin(spin * t)
        return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])

    weight, method = dx.Gravity((0, 0, -3)), dx.ImplicitMidpoint(20, step=2.5e-4)
    inside = dx.Equilibrium(rod, arm, loads=[weight, dx.Rotation((0, 0, spin))])
    seen = dx.simulate(dx.Motion(inside, 0.4, rotary_inertia=1e-6), method, records=4)
    moving = dx.Moving(position=lambda t: turned(t) @ arm.position, frame=lambda t: turned(t) @ arm.R)
    straight = lambda s: np.outer(0.2 + s, (1, 0, 0))  # noqa: E731
    velocity = lambda s: np.cross((0, 0, spin), straight(s))  # noqa: E731
    outside = dx.Motion(
        dx.Equilibrium(rod, arm, loads=[weight]), 0.4, velocity=velocity, start=moving, rotary_inertia=1e-6
    )
    x = dx.simulate(outside, method, records=4)
    back = np.einsum("nji,nkj->nki", [turned(t) for t in x.times], x.positions)
    moved = np.max(np.abs(seen.tip - seen.tip[0]))
    assert moved > 0.1
    np.testing.assert_allclose(back, seen.positions, atol=2e-3 * moved)
    assert seen.energy.drift < 1e-8


@pytest.mark.parametrize(("thrust", "grows"), [(19.0, False), (21.0, True)])
def test_a_column_flutters_under_a_follower_thrust(thrust: float, grows: bool) -> None:
    """From 20.05 EI / L^2 on: M. Beck, Z. angew. Math. Phys. 3 (1952) 225."""
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=1.0, EA=1e5, mass=1.0), stretch=True)
    problem = dx.Equilibrium(rod, loads=[dx.EndForce((0, 0, -thrust), follower=True)])
    motion = dx.Motion(problem, 4.0, velocity=lambda s: np.outer(s**2, (1e-4, 0, 0)))
    x = dx.simulate(motion, dx.ImplicitMidpoint(40, step=4e-3), records=200, drift=1.0)
    tip = np.abs(x.tip[:, 0])
    assert (np.max(tip[150:]) > 5.0 * np.max(tip[:50])) == grows


HELD = (
    dx.Clamped(),
    dx.Hinge((1, 0, 0)),
    dx.Universal((1, 0, 0), (0, 1, 0)),
    dx.Roller(UP),
    dx.Slider(UP),
    dx.Spring(30.0, 2.0),
)


@pytest.mark.parametrize("support", HELD, ids=lambda support: type(support).__name__)
def test_a_support_lets_go(support) -> None:
    """After which momentum grows by weight alone; what its springs held is its work."""
    problem = dx.Equilibrium(ROD, support, loads=[dx.Gravity((0, 0, -1)), dx.Foundation(1e-9)])
    motion = dx.Motion(problem, 0.2, release={"start": 0.1}, velocity=lambda s: np.outer(s, (0, 0.2, 0.3)))
    for method in (dx.ImplicitMidpoint(12, step=1e-3), STIFF, dx.StormerVerlet(12, step=1e-4)):
        x = dx.simulate(motion, method, records=4)
        held, free = np.diff(x.momentum[:3], axis=0), np.diff(x.momentum[2:], axis=0)
        np.testing.assert_allclose(free, np.tile((0, 0, -0.05), (2, 1)), atol=1e-7)
        assert np.max(np.abs(held - free)) > 1e-3
        assert x.energy.drift < (0.05 if method == STIFF else 1e-3)  # which damps the wave that runs from the end


def test_each_load_has_its_own_factor_of_time() -> None:
    """Weight from 0.05 s on, a force that pulses, another that stays: their impulse is the momentum."""
    pulse, weight = np.array([0.3, -0.2, 0.0]), np.array([0, 0, -2.0])
    loads = [dx.Gravity(weight), dx.LineForce(pulse), dx.LineForce((0, 0.1, 0))]
    problem = dx.Equilibrium(dataclasses.replace(ROD, natural=None), loads=loads)
    on = dx.Table([0, 0.05, 0.05 + 1e-9, 0.2], [0, 0, 1, 1], "linear")
    motion = dx.Motion(problem, 0.2, load_factor=[on, lambda t: np.sin(30 * t), None], release={"start": 0})
    x = dx.simulate(motion, dx.ImplicitMidpoint(10, step=1e-3), records=8)
    impulse = np.outer(np.maximum(x.times - 0.05, 0.0), weight) + np.outer((1 - np.cos(30 * x.times)) / 30, pulse)
    np.testing.assert_allclose(x.momentum, impulse + np.outer(x.times, (0, 0.1, 0)), atol=2e-6)
    one = dataclasses.replace(motion, load_factor=[2.0, 2.0, 2.0])
    for same in (dataclasses.replace(motion, load_factor=2.0), dataclasses.replace(motion, load_factor=lambda t: 2.0)):
        a, b = (dx.simulate(each, dx.ImplicitMidpoint(10, step=1e-3), records=2) for each in (one, same))
        np.testing.assert_allclose(a.positions, b.positions, atol=1e-12)


def test_tr_bdf2_keeps_the_length_of_an_inextensible_rod() -> None:
    """Order 2, and the same motion as by the midpoint rule; it begins with a turn, which only the tension holds."""
    rod = dataclasses.replace(ROD, natural=None, stretch=False)
    problem = dx.Equilibrium(rod, dx.Pinned(), loads=[dx.Gravity(), TURNING[0]])
    turning = lambda s: np.outer(s, (1, 3, 0))  # noqa: E731
    motion = dx.Motion(problem, 0.1, velocity=turning, load_factor=lambda t: np.sin(5 * t) ** 2)
    ends = []
    for step in (4e-3, 2e-3, 1e-3):
        x = dx.simulate(motion, dx.TRBDF2(12, step=step), records=1)
        ends.append(x.positions[-1])
        np.testing.assert_allclose(np.linalg.norm(np.diff(x.positions, axis=1), axis=2), 1.0 / 12.0, rtol=1e-12)
    order = np.log2(np.linalg.norm(ends[1] - ends[0]) / np.linalg.norm(ends[2] - ends[1]))
    assert abs(order - 2.0) < 0.1, f"order {order:.3f}, declared 2"
    other = dx.simulate(motion, dx.ImplicitMidpoint(12, step=1e-3), records=1)
    np.testing.assert_allclose(ends[2], other.positions[-1], atol=2e-6)


SHAPED = dx.Equilibrium(ROD, loads=[dx.LineForce(lambda s, r, R: -r)])
SPUN = dx.Equilibrium(ROD, loads=[dx.Rotation((0, 0, 1)), dx.Gravity()])
COUPLED = np.diag([1.0, 2, 3, 4, 5, 6]) + np.diag([0, 0, 0.5], 3) + np.diag([0, 0, 0.5], -3)
REFUSED = {
    "Python function of the shape": dx.Motion(SHAPED, 1.0),
    "load_factor must be 1": dx.Motion(SPUN, 1.0, load_factor=[np.cos, None]),
    "add their omega": dx.Motion(SPUN.with_load(dx.Rotation((1, 0, 0))), 1.0),
    "sliding='fixed'": dx.Motion(dx.Equilibrium(ROD, end=dx.Roller(UP, UP, sliding="section")), 1.0),
    "initial='equilibrium'": dx.Motion(dx.Equilibrium(ROD, end=dx.Clamped(UP, twist=7.0)), 1.0),
    "between the ends motion states": dx.Motion(dx.Equilibrium(ROD, between={0.5: dx.Clamped((0, 0, 0.5))}), 1.0),
    "couples bending or twist": dx.Motion(dx.Equilibrium(dx.Rod(1.0, dx.StiffnessMatrix(COUPLED, mass=1.0), stretch=True)), 1.0),
    "do not shear": dx.Motion(dx.Equilibrium(dataclasses.replace(ROD, section=dataclasses.replace(SECTION, GA1=9, GA2=9), shear=True)), 1.0),  # noqa: E501
}  # fmt: skip


@pytest.mark.parametrize("words", REFUSED)
def test_what_can_not_be_stated_is_refused_in_a_sentence(words: str) -> None:
    with pytest.raises(dx.InvalidInput) as caught:
        dx.simulate(REFUSED[words])
    assert words in str(caught.value)


def test_a_twisted_rod_is_let_go() -> None:
    """Held at more than a whole turn it is at rest; let go, it has untwisted itself when a wave has run along it, at L / c."""
    J, twist = 0.01, 7.0
    rod = dataclasses.replace(ROD, natural=None)
    held = dx.Equilibrium(rod, end=dx.Clamped(UP, twist=twist))
    still = dx.simulate(dx.Motion(held, 0.1, "equilibrium", rotary_inertia=J), dx.ImplicitMidpoint(40, step=1e-2))
    assert np.max(np.abs(still.velocities)) < 1e-8
    assert still.energy.elastic[-1] == pytest.approx(0.5 * 0.8 * twist**2, rel=1e-9)
    wave = np.sqrt(J / 0.8)
    motion = dx.Motion(held, wave, "equilibrium", release={"end": 0.0}, rotary_inertia=J)
    let_go = dx.simulate(motion, dx.ImplicitMidpoint(200, step=wave / 400), records=4)
    elastic = let_go.energy.elastic / (0.5 * 0.8 * twist**2)
    np.testing.assert_allclose(
        elastic, [1.0, 0.75, 0.5, 0.25, 0.0], atol=0.03
    )  # the part that the wave has not reached
    assert let_go.energy.drift < 1e-6


@pytest.mark.parametrize("segments", [20, 60])
def test_a_stiff_wire_between_two_pins_begins_at_rest(segments: int) -> None:
    """Its edges come to their lengths before it is let move; cut, it swings, and keeps its energy."""
    wire = dx.Rod(1.0, dx.Circle(5e-4), dx.Material(E=210e9, nu=0.3, density=7850), stretch=True)
    hung = dx.Equilibrium(wire, dx.Pinned(), dx.Pinned((0.9, 0, 0)), [dx.Gravity()])
    cut = dx.Motion(hung, 0.2, "equilibrium", release={"end": 0.1})
    x = dx.simulate(cut, dx.ImplicitMidpoint(segments, step=5e-4), records=4)
    assert np.max(np.abs(x.velocities[:3])) < 1e-7
    assert x.positions[-1][-1, 2] < -0.03  # an end that is cut off falls by g t^2 / 2 at least
    assert x.energy.drift < 1e-6


def test_a_support_that_jerks_at_an_inextensible_rod_is_named() -> None:
    rod = dataclasses.replace(ROD, stretch=False, natural=None)
    jerk = dx.Moving(position=lambda t: (0, 0, t))
    motion = dx.Motion(dx.Equilibrium(rod), 0.1, start=jerk, rotary_inertia=1e-6)
    with pytest.raises(dx.InvalidInput, match="set out from rest, give the rod its velocity"):
        dx.simulate(motion)
    carried = dataclasses.replace(motion, velocity=lambda s: np.tile((0, 0, 1.0), (len(s), 1)))
    assert dx.simulate(carried, dx.ImplicitMidpoint(10, step=0.01), records=1).status.converged
