"""One energy: every load and spring counts, from one origin, in an equilibrium and in a motion at rest in its shape.

An equilibrium is a stationary point of the energy, so that dE along a family of problems is what the change of the problem
does to a shape that stays (R. P. Feynman, Phys. Rev. 56 (1939) 340): of a load or a spring that grows, its potential; of a
support that moves, the work of its reaction. Nothing of darboux but r, R and the reactions stands on those right sides.
"""

from __future__ import annotations

import dataclasses
import inspect
import itertools

import numpy as np
import pytest

import darboux as dx
from darboux import frames
from darboux.loads import Load
from darboux.supports import Support
from tests import cases

STEP = 5e-4  # of a family's parameter, which is of order 1
GAUSS = np.polynomial.legendre.leggauss(24)
PIECES = (0.0, 0.37, 0.6, 1.0)  # between which shapes are smooth


def along(function):
    """Return int function(s) ds over the rod of unit length."""
    x, w = GAUSS
    parts = [(0.5 * (b - a), 0.5 * (a + b)) for a, b in itertools.pairwise(PIECES)]
    return sum(half * (w @ function(middle + half * x)) for half, middle in parts)


def charge(s):
    return 1.0 + s**2


def tapered(s):
    return np.stack([0.4 + s, -0.3 * s, 0.2 - s], axis=1)


MASS = 0.7
G, FIELD, OMEGA, POINT = (np.array(v) for v in ((0.3, -0.5, -2.0), (0.4, 0.3, 0.5), (0.5, 0.2, 0.9), (0.2, 0.1, -0.3)))
F, PUSH, OFF = (np.array(v) for v in ((0.5, -0.8, -1.1), (-0.2, 0.4, 0.6), (0.2, -0.1, 0.15)))
K, LINE, UP = (
    np.array([[2.0, 0.3, 0.1], [0.3, 1.5, 0.2], [0.1, 0.2, 0.8]]),
    (0.1, -0.1, 0.05),
    np.array((0.0, 0.6, 0.8)),
)


def off_line(x, s):
    return x.r(s) - LINE - s[:, None] * UP


# Each load with a potential, as a function of its factor, and the derivative of its potential by that at 1.
CONSERVATIVE = {
    "gravity": (lambda c: dx.Gravity(c * G), lambda x: -MASS * along(lambda s: x.r(s) @ G)),
    "line force": (
        lambda c: dx.LineForce(lambda s: c * tapered(s)),
        lambda x: -along(lambda s: np.sum(tapered(s) * x.r(s), axis=1)),
    ),
    "electric field": (
        lambda c: dx.ElectricField(c * FIELD, charge),
        lambda x: -along(lambda s: charge(s) * (x.r(s) @ FIELD)),
    ),
    "buoyancy": (lambda c: dx.Buoyancy(c * 0.9, 0.4, G), lambda x: 0.36 * along(lambda s: x.r(s) @ G)),
    "rotation": (
        lambda c: dx.Rotation(c * OMEGA, POINT),
        lambda x: -MASS * along(lambda s: np.sum(np.cross(OMEGA, x.r(s) - POINT) ** 2, axis=1)),
    ),
    "foundation": (
        lambda c: dx.Foundation(c * K, LINE, UP),
        lambda x: 0.5 * along(lambda s: np.einsum("ni,ij,nj->n", off_line(x, s), K, off_line(x, s))),
    ),
    "end force": (lambda c: dx.EndForce(c * F), lambda x: -F @ x.r(1.0)),
    "point force": (lambda c: dx.PointForce(c * F, 0.37), lambda x: -F @ x.r(0.37)),
    "end force off the centre": (
        lambda c: dx.EndForce(c * PUSH, offset=OFF),
        lambda x: -PUSH @ (x.r(1.0) + x.R(1.0) @ OFF),
    ),
    "point force off the centre": (
        lambda c: dx.PointForce(c * PUSH, 0.37, offset=OFF),
        lambda x: -PUSH @ (x.r(0.37) + x.R(0.37) @ OFF),
    ),
}
WITHOUT = (dx.EndMoment, dx.PointMoment, dx.LineCouple)  # a potential, in space

# What an end may be held by, each with what holds the start. A Ring, which nothing holds, has tests of its own.
ROD = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=1.7, GJ=0.8, EA=300.0, mass=MASS), natural=(0.3, -0.4, 0.5), stretch=True)
CLAMP, PIN, PLACE = dx.Clamped(position=(0.02, 0.1, 0.03)), dx.Pinned((0.02, 0.1, 0.03)), (0.1, 0.2, 0.85)
SPRUNG = dataclasses.replace(cases.ENDS["spring"], position=(0.1, 0, 0.5), tangent=(0.1, 0, 1))
HELD = {
    "clamped": (SPRUNG, dx.Clamped(position=PLACE, tangent=(0.2, 0.1, 1))),
    "pinned": (CLAMP, dx.Pinned(PLACE)),
    "hinge": (SPRUNG, cases.ENDS["hinge"]),
    "universal": (PIN, cases.ENDS["universal"]),
    "slider": (PIN, cases.ENDS["slider"]),
    **{name: (CLAMP, cases.ENDS[name]) for name in ("roller", "groove", "guided", "spring", "free")},
}
AMID, AMID_K = 0.6, 2.0


def stated(start, end, grown=0.0):
    """Return a problem with every load that has a potential and a spring between the ends, all in parts of their own grown."""
    acting = [
        make(1.0 + grown * share)
        for (name, (make, _)), share in zip(CONSERVATIVE.items(), SHARES, strict=True)
        if not (end.clamps and name.startswith("end force"))
    ]
    return dx.Equilibrium(ROD, start, end, acting, {AMID: stiffer(dx.Spring(AMID_K, position=(0.1, 0.1, 0.5)), grown)})


SHARES = np.linspace(0.5, 1.2, len(CONSERVATIVE))


def stiffer(support, grown):
    changes = {name: getattr(support, name) for name in ("linear", "rotational")}
    changes = {name: (1.0 + grown) * np.array(k) for name, k in changes.items() if k is not None}
    return dataclasses.replace(support, **changes) if changes else support


def turn_of(Q):
    """Return the rotation vector of a matrix, off 0 and pi."""
    axis = np.array([Q[2, 1] - Q[1, 2], Q[0, 2] - Q[2, 0], Q[1, 0] - Q[0, 1]])
    return np.arccos(0.5 * (np.trace(Q) - 1.0)) * axis / np.linalg.norm(axis)


def strained(support, r, R):
    """Return the energy of a support's springs."""
    energy = 0.0
    if support.linear is not None:
        energy += 0.5 * (r - support.position) @ np.array(support.linear) @ (r - support.position)
    if support.rotational is not None:
        theta = turn_of(R @ support.R.T)
        energy += 0.5 * theta @ np.array(support.rotational) @ theta
    return energy


def slope(family, middle):
    """Return dE/dt of a family of problems at t = 0, around its solution there."""
    one, other = (dx.solve(family(t), start=middle).energy.total for t in (STEP, -STEP))
    return (one - other) / (2.0 * STEP)


@pytest.mark.parametrize("name", HELD)
def test_the_energy_changes_by_what_loads_and_springs_that_grow_store(name) -> None:
    start, end = HELD[name]
    x = dx.solve(stated(start, end))
    amid = x.r(AMID) - (0.1, 0.1, 0.5)
    parts = {what: share * stored(x) for (what, (_, stored)), share in zip(CONSERVATIVE.items(), SHARES, strict=True)}
    if end.clamps:
        del parts["end force"], parts["end force off the centre"]
    parts |= {f"spring at {s:g}": strained(support, x.r(s), x.R(s)) for s, support in ((0.0, start), (1.0, end))}
    parts["spring between"] = 0.5 * AMID_K * amid @ amid
    found = slope(lambda t: stated(stiffer(start, t), stiffer(end, t), t), x)
    assert found == pytest.approx(sum(parts.values()), rel=1e-6, abs=1e-6), parts
    assert all(abs(part) > 1e-4 for part in parts.values() if part != 0.0)  # so that none can be left out


def moved(support, u, phi, t):
    """Return a support that is moved by t u and whose frame, with its axes, is turned by t phi; and whether there is a frame."""
    turn, changes = frames.rotation(t * np.array(phi)), {}
    if any(support.held_displacement) or support.linear is not None:
        changes["position"] = np.array(support.position) + t * np.array(u)
    if hasattr(support, "frame"):
        changes |= {"frame": turn @ support.R, "tangent": (0.0, 0.0, 1.0), "d1": None}
    changes |= {
        axis: turn @ np.array(getattr(support, axis)) for axis in ("axis", "section_axis") if hasattr(support, axis)
    }
    return dataclasses.replace(support, **changes)


def work(support, reaction, R, u, phi):
    """Return the power of a support that moves by u and turns by phi."""
    moment = reaction.moment if hasattr(support, "frame") else np.zeros(3)
    if support.rotational is not None:  # its stiffness stays, in the fixed frame: R R0^T is turned from the right
        moment = (R @ support.R.T).T @ moment
    return reaction.force @ u + moment @ phi


@pytest.mark.parametrize("name", HELD)
def test_the_energy_changes_by_the_work_of_supports_that_move(name) -> None:
    start, end = HELD[name]
    u, phi = (0.3, -0.2, 0.25), (0.2, 0.3, -0.4)
    x = dx.solve(stated(start, end))
    found = slope(lambda t: stated(moved(start, u, phi, t), moved(end, phi, u, t)), x)
    done = work(start, x.reactions.start, x.R(0.0), u, phi) + work(end, x.reactions.end, x.R(1.0), phi, u)
    assert found == pytest.approx(done, rel=1e-5, abs=1e-6)


def kinds(energy, at=None):
    parts = [energy.elastic, energy.supports, energy.load]
    return np.array(parts if at is None else [part[at] for part in parts])


@pytest.mark.parametrize("name", [name for name in HELD if name != "groove"])  # which motion refuses
def test_a_motion_at_rest_has_the_energy_of_the_equilibrium(name) -> None:
    """To the order of the discrete rod, and that at rest by its own method too."""
    problem = stated(*HELD[name])
    x = dx.solve(problem)
    at_rest = dx.Motion(problem, 1e-4, initial=x, rotary_inertia=0.01)
    moving = [
        kinds(dx.simulate(at_rest, dx.ImplicitMidpoint(n, step=1e-4), records=1).energy, 0) - kinds(x.energy)
        for n in (40, 80)
    ]
    still = [kinds(dx.solve(problem, dx.DiscreteRod(n)).energy) - kinds(x.energy) for n in (40, 80)]
    for coarse, fine in (moving, still):
        assert np.max(np.abs(fine)) < 4e-4
        np.testing.assert_allclose(4.0 * fine, coarse, atol=3e-5)  # of order 2


def test_every_load_and_support_is_tried() -> None:
    public = [value for value in (getattr(dx, name) for name in dx.__all__) if inspect.isclass(value)]
    tried = {type(make(1.0)) for make, _ in CONSERVATIVE.values()} | {
        type(part) for pair in HELD.values() for part in pair
    }
    assert {kind for kind in public if issubclass(kind, Load | Support)} == tried | set(WITHOUT)


ANISOTROPIC = dx.Rod(1.0, dx.Stiffness(EI1=1.4, EI2=1.0, GJ=0.75, mass=2.0))


def test_equilibria_under_a_force_between_the_ends_are_sorted_by_the_whole_energy() -> None:
    """Elastic energy alone would put the straight rod, unstable in two directions, first."""
    found = dx.solve_all(dx.Equilibrium(ANISOTROPIC, loads=[dx.PointForce((0, 0, -6.0), at=0.9)]), most=3)
    assert [x.index for x in found] == [0, 1, 2]
    for x in found:
        assert x.energy.load == pytest.approx(6.0 * x.r(0.9)[2])
        assert x.energy.total == x.energy.elastic + x.energy.load
    assert found[0].energy.elastic > found[2].energy.elastic
    assert found[2].energy.total == pytest.approx(5.4)


def at_once(problem, **changes):
    """Return energies and text of a motion at its start."""
    motion = dx.Motion(problem, 1e-4, rotary_inertia=0.01, **changes)
    return dx.simulate(motion, dx.ImplicitMidpoint(8, step=1e-4), records=1)


def test_potentials_count_from_the_origin_of_the_fixed_frame() -> None:
    """A straight rod above a clamp at z = 10: 2 * 9 * 10.5 + 3 * 10.9 + 5 * 11."""
    loads = [dx.Gravity((0, 0, -9.0)), dx.PointForce((0, 0, -3.0), 0.9), dx.EndForce((0, 0, -5.0))]
    problem = dx.Equilibrium(ANISOTROPIC, dx.Clamped((0, 0, 10.0)), loads=loads)
    assert at_once(problem).energy.load[0] == pytest.approx(276.7, rel=1e-12)
    factors = [1.0, 2.0, lambda t: 1.0 + t]
    assert at_once(problem, load_factor=factors).energy.load[0] == pytest.approx(276.7 + 32.7, rel=1e-12)
    standing = dx.solve(
        dx.Equilibrium(dx.Rod(1.0, dx.Stiffness(EI1=1e3, GJ=1e3, mass=2.0)), problem.start, loads=loads)
    )
    assert standing.energy.load == pytest.approx(276.7, rel=1e-12)


def test_a_foundation_and_a_rotation_store_nothing_where_they_are_at_rest() -> None:
    place, axis = (3.0, -2.0, 7.0), (0.0, 0.6, 0.8)
    acting = [dx.Foundation(1e8, place, axis), dx.Rotation(50.0 * np.array(axis), place)]
    problem = dx.Equilibrium(ANISOTROPIC, dx.Clamped(place, axis), loads=acting)
    assert abs(dx.solve(problem).energy.load) < 1e-6
    assert abs(at_once(problem).energy.load[0]) < 1e-6


def test_springs_are_in_the_total_and_said() -> None:
    """Two springs of 50 N/m at a stiff rod's ends carry 6 N: each is strained by 6 cm and stores 0.09 J."""
    spring = dx.Spring(linear=50.0, rotational=1.0)
    rod = dx.Rod(1.0, dx.Stiffness(EI1=1e3, GJ=1e3, mass=1.0))
    top = dataclasses.replace(spring, position=(0, 0, 1.0))
    problem = dx.Equilibrium(rod, spring, top, [dx.Gravity((0, 0, -6.0))])
    x = dx.solve(problem)
    assert x.energy.supports == pytest.approx(0.18, rel=1e-9)
    assert x.energy.total == pytest.approx(0.18 + 6.0 * 0.44, rel=1e-9)
    assert "supports 0.18, loads 2.64" in str(x)
    run = at_once(problem, initial=x)
    assert "supports 0.18, loads 2.64" in str(run)
    assert "supports" in [line.get_label() for line in run.plot("energy").get_lines()]
    assert x.to_dataset().attrs["energy_supports"] == x.energy.supports


def test_the_work_of_loads_that_grow_in_time_counts_from_the_same_origin() -> None:
    """dE/dt = f' V, with V the potential at the factor 1."""
    problem = dx.Equilibrium(
        ANISOTROPIC, dx.Clamped((5.0, 0, 10.0), (1, 0, 0)), loads=[dx.Gravity((0, 0, -1.0)), dx.PointForce(F, 0.4)]
    )
    motion = dx.Motion(problem, 0.5, load_factor=lambda t: 1.0 + 2.0 * t, rotary_inertia=0.01)
    run = dx.simulate(motion, dx.ImplicitMidpoint(10, step=2.5e-3), records=200)
    V = run.energy.load / (1.0 + 2.0 * run.times)
    assert np.ptp(V) > 0.1
    work = 2.0 * np.trapezoid(V, run.times)
    assert run.energy.work[-1] == pytest.approx(work, rel=1e-5)
    assert run.energy.total[-1] - run.energy.total[0] == pytest.approx(work, rel=1e-5)
