"""Rings in motion: what is kept, orders, rest in equilibria of statics, any vertex the first, what holds and loads them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import darboux as dx
from darboux import scenario
from darboux.link import writhe_of_polygon
from darboux.scenario import Scenario
from darboux.view.space import shape

SECTION = dx.Stiffness(EI1=1.0, EI2=1.5, GJ=0.75, EA=1e4, mass=1.0)
ROUND = dx.Rod(1.0, dataclasses.replace(SECTION, EI2=1.0), stretch=True)
FLAT = dx.Rod(1.0, SECTION, natural=(0.3, 4.0, 0.5), stretch=True)
STIFF = dataclasses.replace(FLAT, stretch=False)
CRITICAL = np.sqrt(3.0) / 0.75  # turns, of Michell
R = 1.0 / dx.turn
WEIGHT = (0, 0, -3.0)


def waves(s):
    return np.stack([2.0 * np.sin(2.0 * s / R), 1.5 * np.cos(s / R), 0.3 + 0.0 * s], axis=1)


def circle(s):
    return R * np.stack([np.cos(s / R), np.sin(s / R), 0.0 * s], axis=1)


# Conservation


@pytest.mark.parametrize("steps", [600, pytest.param(10_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("rod", [ROUND, dataclasses.replace(ROUND, stretch=False)], ids=["stretches", "inextensible"])
def test_free_flight_keeps_momenta_and_energy(rod, steps: int) -> None:
    """Of a twisted ring, the stiff one struck by its spin alone: inextensible rods take no velocities that stretch them."""
    spin = lambda s: 3.0 + 20.0 * np.sin(s / R) ** 2  # noqa: E731
    motion = dx.Motion(dx.Ring(rod, link=1.0), steps * 1e-4, spin=spin, velocity=waves if rod.stretch else (1, 2, 3))
    x = dx.simulate(motion, dx.ImplicitMidpoint(20, step=1e-4, tolerance=1e-13), records=20)
    for momentum in (x.momentum, x.angular_momentum):
        np.testing.assert_allclose(momentum, np.tile(momentum[0], (21, 1)), atol=1e-12 * np.linalg.norm(momentum[0]))
    assert x.energy.drift < 1e-8
    assert np.ptp(x.energy.elastic) > 1e-2 * np.ptp(x.energy.kinetic) > 0.0


METHODS = [dx.ImplicitMidpoint(12, step=4e-3), dx.TRBDF2(12, step=4e-3), dx.StormerVerlet(12, step=2e-4)]


@pytest.mark.parametrize("method", METHODS, ids=lambda method: type(method).__name__)
def test_order_in_time(method) -> None:
    """Of a flat ring closed after half a turn, under all that acts along a rod, a force at a point and two supports between."""
    loads = [
        dx.Gravity((0, 0, -1)),
        dx.LineForce((0.5, 0.3, 0.6), frame="section"),
        dx.LineCouple((0.3, 0.2, 0.4)),
        dx.PointForce((0.5, 0.3, 0.6), at=0.4, follower=True),
        dx.Rotation((0, 0, 2.0)),
    ]
    swing = lambda t: np.cos(9 * t) ** 2  # noqa: E731
    rod = dataclasses.replace(FLAT, natural=(0.0, 3.0, 0.5), section=dataclasses.replace(SECTION, EA=300.0))
    at = circle(np.array([0.7]))[0]
    between = {0.3: dx.Spring(linear=5.0), 0.7: dx.Roller((0, 1, 0), position=at)}
    drag = [dx.LinearDrag(0.5, 1.0), dx.MassDamping(0.2)]
    drag += [dx.KelvinVoigt(1e-3, 1e-3, 1e-3)] if not isinstance(method, dx.StormerVerlet) else []
    ring = dx.Ring(rod, link=0.5, loads=loads, between=between)
    factors = [None, swing, swing, swing, None]
    motion = dx.Motion(ring, 0.1, circle, load_factor=factors, damping=drag, rotary_inertia=0.02, spin=1.0)
    ends = []
    for halving in range(3):
        x = dx.simulate(motion, dataclasses.replace(method, step=method.step / 2**halving), records=1)
        ends.append(np.concatenate([x.positions[-1].ravel(), x.directors[-1].ravel()]))
    order = np.log2(np.linalg.norm(ends[1] - ends[0]) / np.linalg.norm(ends[2] - ends[1]))
    assert abs(order - method.order) < 0.25, f"order {order:.3f}, declared {method.order}"
    assert x.energy.drift < (1e-3 if isinstance(method, dx.TRBDF2) else 1e-4)  # which damps what it does not resolve
    off = x.positions[:, np.argmin(np.abs(x.s - 0.7))] - at
    np.testing.assert_allclose(off[:, [0, 2]], 0.0, atol=1e-12)


def test_methods_agree() -> None:
    """Verlet's has its mass in the vertices, which is off by order 2."""
    motion = dx.Motion(dx.Ring(FLAT, link=1.0), 0.02, velocity=waves)
    midpoint = dx.simulate(motion, dx.ImplicitMidpoint(40, step=1e-4), records=4)
    moved = np.max(np.abs(midpoint.positions[-1] - midpoint.positions[0]))
    assert moved > 0.3 * R
    for method, off in ((dx.TRBDF2(40, rtol=1e-7), 1e-3), (dx.StormerVerlet(40), 0.02)):
        other = dx.simulate(motion, method, records=4)
        np.testing.assert_allclose(other.positions, midpoint.positions, atol=off * moved)


# Rest


PLACES = np.linspace(0.0, 1.0, 9)
IN_ONE_PART = dx.Table(PLACES, np.outer(np.cos(dx.turn * PLACES), (3.0, 5.0, 2.0)))
AT_REST = {
    "a twisted ring": dx.Ring(ROUND, link=0.9 * CRITICAL),
    "beyond Michell's link": dx.Ring(ROUND, link=1.03 * CRITICAL),
    "a flat ring after half a turn": dx.Ring(dataclasses.replace(FLAT, natural=None), link=0.5),
    "an overcurved ring": dx.Ring(dataclasses.replace(ROUND, natural=(0, 6 * np.pi, 0))),
    "bent in one part, glued at a right angle": dx.Ring(dataclasses.replace(FLAT, natural=IN_ONE_PART), link=0.25),
}


@pytest.fixture(scope="module")
def solved() -> dict[str, dx.EquilibriumSolution]:
    return {name: dx.solve(problem) for name, problem in AT_REST.items()}


@pytest.mark.parametrize("name", AT_REST)
def test_an_equilibrium_of_statics_is_at_rest(name: str, solved) -> None:
    """What collocation finds is, but for an error of order 2 in 1/N, where the discrete ring stays."""
    errors = []
    for N in (40, 80):
        motion = dx.Motion(AT_REST[name], 4e-3, initial=solved[name], rotary_inertia=1e-3)
        x = dx.simulate(motion, dx.ImplicitMidpoint(N, step=1e-3), records=1)
        assert np.max(np.abs(x.velocities[-1])) < 1e-9
        gap = x.positions[0] - solved[name].r(x.s)
        errors.append(float(np.max(np.linalg.norm(gap - np.mean(gap[1:], axis=0), axis=1))))
    order = np.log2(errors[0] / errors[1])
    assert abs(order - 2.0) < 0.2, f"order {order:.2f}, declared 2; errors {errors}"


def test_an_inextensible_ring_sets_out_from_an_equilibrium_by_little(solved) -> None:
    """It is read from the solution, and so is out of its own equilibrium by an error of order 2."""
    ways = []
    for N in (40, 80):
        problem = dx.Ring(dataclasses.replace(FLAT, natural=None, stretch=False), link=0.5)
        motion = dx.Motion(problem, 0.1, initial="equilibrium")
        x = dx.simulate(motion, dx.ImplicitMidpoint(N, step=1e-3), records=20)
        lengths = np.linalg.norm(np.diff(x.positions, axis=1), axis=2)
        np.testing.assert_allclose(lengths, 1.0 / N, rtol=1e-9)
        ways.append(float(np.max(np.abs(x.positions - x.positions[0]))))
    assert 1.7 < np.log2(ways[0] / ways[1]) < 2.3, ways


@pytest.mark.parametrize(("share", "leaves"), [(0.97, False), (1.04, True)])
def test_a_ring_leaves_its_plane_beyond_michells_link(share: float, leaves: bool) -> None:
    """omega^2 falls through 0 at sqrt(3) EI / GJ; a small push then grows, and does not before."""
    ring = dx.Ring(ROUND, link=share * CRITICAL)
    flat = dx.simulate(dx.Motion(ring, 1e-6), dx.ImplicitMidpoint(60), records=1).positions[0]
    normal = np.linalg.svd(flat - np.mean(flat, axis=0))[2][2]
    push = lambda s: np.outer(np.cos(2 * s / R), 1e-4 * normal)  # noqa: E731
    x = dx.simulate(dx.Motion(ring, 0.4, velocity=push), dx.ImplicitMidpoint(60, step=5e-4), records=40)
    away = np.max(np.abs((x.positions - flat) @ normal), axis=1)
    assert (np.max(away[30:]) > 4.0 * np.max(away[:10])) == leaves


@pytest.mark.parametrize("natural", [(0, 1.0, 0), None], ids=["naturally round", "naturally straight"])
def test_vibrations_of_a_ring_that_stretches(natural) -> None:
    """R = EI = rhoA = 1: n (n^2 - 1) / sqrt(n^2 + 1) in its plane; out of it / sqrt(n^2 + EI / GJ), or n sqrt(n^2 - 1)."""
    rod = dx.Rod(dx.turn, dx.Stiffness(EI1=1.0, GJ=2 / 3, EA=1e6, mass=1.0), natural=natural, stretch=True)
    rigid = 6 if natural else 7  # it may turn about its centreline too, where no curvature ties it to its plane
    found = dx.natural_modes(dx.Ring(rod), rigid + 8, rotary_inertia=1e-5).frequencies * dx.turn
    n = np.array([2.0, 3.0])
    out = n * (n**2 - 1.0) / np.sqrt(n**2 + 1.5) if natural else n * np.sqrt(n**2 - 1.0)
    wanted = np.sort([*n * (n**2 - 1.0) / np.sqrt(n**2 + 1.0), *out])
    assert np.all(found[:rigid] == 0.0)
    np.testing.assert_allclose(found[rigid:], np.repeat(wanted, 2), rtol=1e-4)


# Any vertex may be the first


@pytest.mark.parametrize("rod", [FLAT, STIFF], ids=["stretches", "inextensible"])
def test_the_first_vertex_is_like_the_others(rod) -> None:
    """A flat ring twisted once, out of its plane, numbered from another vertex on: the same motion, up to rounding."""
    N, shift, method = 24, 7, dx.ImplicitMidpoint(24, step=5e-4, tolerance=1e-13)
    wavy = lambda s: circle(s) + np.outer(np.cos(2.0 * s / R), (0, 0, 0.05 * R))  # noqa: E731
    once = dx.simulate(dx.Motion(dx.Ring(rod, link=1.0), 1e-9, initial=wavy), method, records=1)
    x, R0 = once.positions[0], once.frames[0]
    twist = dx.turn * (1.0 - writhe_of_polygon(x)) / N  # of one segment

    def numbered(first: int) -> dx.Trajectory:
        c, s = np.cos(0.5 * twist), np.sin(0.5 * twist)
        start = dx.Clamped(
            frame=R0[first] @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        )  # half a segment before its edge
        polygon = lambda s: x[(np.rint(s * N).astype(int) + first) % N]  # noqa: E731
        return dx.simulate(dx.Motion(dx.Ring(rod, link=1.0, start=start), 0.02, polygon), method, records=4)

    a, b = numbered(0), numbered(shift)
    for name in ("positions", "directors"):
        one, other = (getattr(part, name)[:, :N] for part in (a, b))
        np.testing.assert_allclose(np.roll(one, -shift, axis=1), other, atol=1e-10)
    np.testing.assert_allclose(a.energy.total, b.energy.total, rtol=1e-10)
    assert np.max(np.abs(a.positions[-1] - a.positions[0])) > 0.1 * R


# What acts and what holds


def test_a_ring_falls_as_it_is() -> None:
    """Nothing holds it, not even its start: round, by g t^2 / 2, and a weight that grows with a factor of time."""
    ring = dx.Ring(ROUND, start=dx.Clamped(tangent=(1, 0, 0)), loads=[dx.Gravity(WEIGHT)])
    x = dx.simulate(dx.Motion(ring, 0.5), dx.ImplicitMidpoint(20, step=5e-3), records=5)
    np.testing.assert_allclose(x.positions - x.positions[0], 0.5 * np.multiply.outer(x.times**2, np.tile(WEIGHT, (21, 1))), atol=1e-11)  # fmt: skip # noqa: E501
    np.testing.assert_allclose(x.momentum, np.outer(x.times, WEIGHT), atol=1e-12)
    dropped = dx.simulate(dx.Motion(ring, 0.2, "equilibrium"), dx.ImplicitMidpoint(20, step=1e-3), records=4)
    np.testing.assert_allclose(dropped.momentum, np.outer(dropped.times, WEIGHT), atol=1e-10)
    assert np.max(np.abs(dropped.positions[-1, 0] - dropped.positions[0, 0])) > 0.5 * 0.2**2 * 3.0


@pytest.mark.parametrize("drag", [dx.LinearDrag(2.0, 5.0), dx.QuadraticDrag(2.0, 5.0)])
def test_a_ring_that_sinks_flat_reaches_its_terminal_velocity(drag) -> None:
    """Its whole length lies across the flow, the edge that closes it once."""
    ring = dx.Ring(ROUND, start=dx.Clamped(tangent=(1, 0, 0), d1=(0, 1, 0)), loads=[dx.Gravity(WEIGHT)])
    x = dx.simulate(dx.Motion(ring, 20.0, circle, damping=[drag]), dx.TRBDF2(10), records=2)
    fall = 3.0 / 5.0 if isinstance(drag, dx.LinearDrag) else np.sqrt(3.0 / 5.0)
    np.testing.assert_allclose(x.velocities[-1], np.tile((0, 0, -fall), (11, 1)), atol=1e-3)


@pytest.mark.parametrize("at", [0.05, 0.5])
@pytest.mark.parametrize("rod", [ROUND, dataclasses.replace(ROUND, stretch=False)], ids=["stretches", "inextensible"])
def test_a_ring_hangs_from_a_pin_beside_its_start_and_elsewhere(rod, at: float) -> None:
    """Twenty segments: at s = 0.05 lies the first vertex behind s = 0, which the chain has twice."""
    pin = dx.Pinned(circle(np.array([at]))[0])
    start = dx.Clamped((R, 0, 0), tangent=(0, 1, 0))
    ring = dx.Ring(rod, start=start, loads=[dx.Gravity(WEIGHT)], between={at: pin})
    for method in (dx.ImplicitMidpoint(20, step=1e-3), dx.TRBDF2(20, step=1e-3)):
        x = dx.simulate(dx.Motion(ring, 0.2, circle), method, records=4)
        np.testing.assert_allclose(x.positions[:, round(20 * at)], np.tile(pin.position, (5, 1)), atol=1e-12)
        np.testing.assert_allclose([place for place, _ in x.held], [pin.position], atol=1e-12)
        assert np.max(np.abs(x.velocities[-1])) > 0.1
        assert x.energy.drift < (0.05 if isinstance(method, dx.TRBDF2) else 1e-4)


def test_a_pin_anywhere_is_the_same_pin() -> None:
    """A round ring swings about it alike, whichever vertex it is."""
    tips = []
    for at in (0.1, 0.5):
        turned = lambda s, at=at: circle(s - at)  # noqa: E731
        ring = dx.Ring(ROUND, loads=[dx.Gravity((0, -3.0, 0))], between={at: dx.Pinned((R, 0, 0))})
        x = dx.simulate(dx.Motion(ring, 0.5, turned), dx.ImplicitMidpoint(10, step=2e-3), records=4)
        tips.append(x.positions[:, (round(10 * at) + 5) % 10])  # across from the pin
    np.testing.assert_allclose(tips[0], tips[1], atol=1e-9)
    assert np.linalg.norm(tips[0][-1] - tips[0][0]) > 0.5 * R


@pytest.mark.parametrize("link", [0.25, 1.0, -7.0])
@pytest.mark.parametrize("rod", [FLAT, STIFF], ids=["stretches", "inextensible"])
def test_the_link_is_kept(rod, link: float) -> None:
    """Twist and writhe of the polygon, measured on its frames, add up to it, however the ring has moved."""
    spin = lambda s: 30.0 * np.cos(2.0 * s / R)  # noqa: E731
    motion = dx.Motion(dx.Ring(rod, link=link), 0.02, spin=spin)
    x = dx.simulate(motion, dx.ImplicitMidpoint(48, step=1e-4), records=2)
    assert np.array_equal(x.positions[:, 0], x.positions[:, -1])
    for r, frames in zip(x.positions, x.frames, strict=True):
        t, d1 = (np.append(frames[:, :, i], frames[:1, :, i], axis=0) for i in (2, 0))
        moved = d1[:-1] - (np.sum(d1[:-1] * t[1:], axis=1) / (1.0 + np.sum(t[:-1] * t[1:], axis=1)))[:, None] * (t[:-1] + t[1:])  # fmt: skip # noqa: E501
        angles = np.arctan2(np.sum(np.cross(moved, d1[1:]) * t[1:], axis=1), np.sum(moved * d1[1:], axis=1))
        angles[-1] += dx.turn * (link - round(link))  # the first frame over again, turned by the link
        twist = np.sum((angles + np.pi) % dx.turn - np.pi) / dx.turn
        assert twist + writhe_of_polygon(r) == pytest.approx(link, abs=1e-10)
    assert abs(writhe_of_polygon(x.positions[-1])) > 1e-3


def test_a_given_shape_gets_the_twist_that_its_link_leaves() -> None:
    """Tw = Lk - Wr: of a curve with writhe, evenly; GJ / 2 (2 pi Tw)^2."""
    shape = lambda s: R * np.stack([np.cos(s / R), np.sin(2 * s / R) / 2, 0.3 * np.sin(s / R)], axis=1)  # noqa: E731
    for link in (0.0, 0.25, 2.0):
        method = dx.ImplicitMidpoint(40, step=1e-9)
        x = dx.simulate(dx.Motion(dx.Ring(ROUND, link=link), 1e-9, shape), method, records=1)
        writhe = writhe_of_polygon(x.positions[0])
        assert abs(writhe) > 0.5
        wanted = 0.5 * 0.75 * (dx.turn * (link - writhe)) ** 2
        np.testing.assert_allclose(x.energy.twist[0], wanted, rtol=1e-9)


# Files and pictures


def test_a_motion_of_a_ring_is_saved_streamed_and_continued(tmp_path) -> None:
    motion = dx.Motion(dx.Ring(FLAT, link=0.5, loads=[dx.Gravity(WEIGHT)]), 0.02, velocity=(0, 0, 1.0))
    method = dx.ImplicitMidpoint(12, step=1e-3)
    x = dx.simulate(motion, method, records=4)
    x.save(tmp_path / "ring.nc")
    assert dx.open(tmp_path / "ring.nc") == x
    streamed = dx.simulate(motion, method, records=4, out=tmp_path / "stream.nc")
    np.testing.assert_array_equal(streamed.positions, x.positions)
    half = dx.simulate(dataclasses.replace(motion, duration=0.01), method, records=2)
    assert np.array_equal(dx.simulate(motion, start_from=half).positions, x.positions)
    stated = Scenario(motion.problem, None, dataclasses.replace(motion, velocity=None), method)
    stated.write(tmp_path / "ring.toml")
    assert scenario.read(tmp_path / "ring.toml") == stated


def test_pictures_of_a_ring_in_motion(tmp_path) -> None:
    x = dx.simulate(dx.Motion(dx.Ring(FLAT, link=0.5), 0.01, velocity=waves), dx.ImplicitMidpoint(12, step=1e-3), records=3)  # fmt: skip # noqa: E501
    assert len(x.plot()) == 3
    x.export(tmp_path / "ring.csv")
    assert "Motion by" in x._repr_html_()
    assert x.held == []
    s = np.array([0.0, 1.0 - 1e-7])
    np.testing.assert_allclose(*x.r(0.005, s), atol=1e-5)


def test_a_ring_is_drawn_closed() -> None:
    """Curvature, twist and frame of a round ring are the same around it, and go on over its closing."""
    x = dx.simulate(dx.Motion(dx.Ring(ROUND, link=1.25), 1e-3), dx.ImplicitMidpoint(40, step=1e-3), records=1)
    drawn = shape.at(x, 1e-3)
    np.testing.assert_allclose(drawn.k[:, 2], 1.25 * dx.turn, rtol=0.02)
    np.testing.assert_allclose(np.linalg.norm(drawn.k[:, :2], axis=1), 1.0 / R, rtol=0.02)
    glue = drawn.R[0].T @ drawn.R[-1]  # a quarter of a turn
    np.testing.assert_allclose(glue, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-3)


# What is said

FOLD = lambda s: np.outer(np.sin(dx.turn * s), (1, 0, 0))  # noqa: E731
OPEN = dx.Motion(dx.Ring(ROUND), 1.0, lambda s: np.outer(s, (1, 0, 0)))
MISTAKES = {
    "motion.start is given, but a Ring is free": lambda: dx.Motion(dx.Ring(ROUND), 1.0, start=dx.Moving(lambda t: (t, 0, 0))),
    "motion.release is given, but a Ring is free": lambda: dx.Motion(dx.Ring(ROUND), 1.0, release={"start": 0.1}),
    "leaves the ring open: its end is 1 m off": lambda: dx.simulate(OPEN),
    "folds the rod back on itself at s = 0.25": lambda: dx.simulate(dx.Motion(dx.Ring(ROUND), 1.0, FOLD)),
    "tears the ring": lambda: dx.simulate(dx.Motion(dx.Ring(ROUND), 1.0, velocity=lambda s: np.outer(s, (0, 0, 1)))),
    "a Ring has 3 segments or more, but the method has 2": lambda: dx.simulate(dx.Motion(dx.Ring(ROUND), 1.0), dx.TRBDF2(2)),
    "of a Ring with link=1; the motion's is": lambda: dx.Motion(dx.Ring(ROUND), 1.0, dx.solve(dx.Ring(ROUND, link=1))),
    "of a rod with two ends": lambda: dx.Motion(dx.Ring(ROUND), 1.0, dx.solve(dx.Equilibrium(ROUND))),
    "stretches the rod": lambda: dx.simulate(dx.Motion(dx.Ring(STIFF), 1.0, velocity=waves)),
    "use ImplicitMidpoint": lambda: dx.simulate(dx.Motion(dx.Ring(STIFF), 1.0), dx.StormerVerlet()),
    "those of a free one": lambda: dx.natural_modes(dx.Ring(ROUND, loads=[dx.Gravity()])),
    "turns with the section": lambda: dx.simulate(dx.Motion(dx.Ring(ROUND, between={0.5: dx.Clamped((0, 0, 0))}), 1.0)),
}  # fmt: skip


@pytest.mark.parametrize("words", MISTAKES)
def test_mistakes_are_said_in_one_sentence(words: str) -> None:
    with pytest.raises(dx.InvalidInput) as caught:
        MISTAKES[words]()
    assert words in str(caught.value)
