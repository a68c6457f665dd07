"""Pictures in space and files for other programs: geometry and fields by closed forms, pixels only where they must lie."""

from __future__ import annotations

import json
import shutil
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import darboux as dx
from darboux.view.palette import SCALE, rgb
from darboux.view.space import fields, marks, shape, show, solids
from darboux.view.space.body import Body, drawn, places

pyvista = pytest.importorskip("pyvista")

RUBBER = dx.Material(E=1e6, nu=0.5, density=1e3)


@pytest.fixture(scope="module")
def bent() -> dx.EquilibriumSolution:
    """A quarter of a circle, in the x z plane, by an end moment about y."""
    rod = dx.Rod(length=0.2, section=dx.Circle(radius=2e-3), material=RUBBER)
    EI = 1e6 * np.pi * 2e-3**4 / 4.0
    moment = dx.EndMoment((0.0, EI * 0.5 * np.pi / 0.2, 0.0))
    return dx.solve(dx.Equilibrium(rod, start=dx.Clamped(tangent=(1, 0, 0)), loads=[moment]))


@pytest.fixture(scope="module")
def fall() -> dx.Trajectory:
    rod = dx.Rod(length=0.25, section=dx.Circle(radius=1e-3), material=RUBBER, stretch=True)
    hanging = dx.Equilibrium(rod, start=dx.Clamped(tangent=(1, 0, 0)), loads=[dx.Gravity()])
    return dx.simulate(dx.Motion(hanging, duration=0.02), dx.ImplicitMidpoint(segments=12, step=2e-3))


def polygon_area(m: Any) -> float:
    """The area of the polygon with these corners on the unit circle, by their angles."""
    return 0.5 * float(np.sum(np.sin(np.diff(np.append(m, m[0] + 2.0 * np.pi)))))


@pytest.mark.parametrize(
    "section",
    [
        dx.Circle(radius=2e-3),
        dx.Tube(outer_radius=2e-3, inner_radius=1.5e-3),
        dx.Rectangle(width=8e-3, height=1e-3),
        dx.Ellipse(a=4e-3, b=1e-3),
    ],
    ids=lambda section: type(section).__name__,
)
def test_the_surface_is_closed_and_holds_area_times_length(section: Any, tmp_path: Path) -> None:
    rod = dx.Rod(length=0.2, section=section, material=RUBBER, natural=(5.0, 3.0, 12.0))
    dx.integrate(rod, k=(5.0, 3.0, 12.0)).export(tmp_path / "rod.stl")
    mesh = pyvista.read(tmp_path / "rod.stl")
    assert mesh.is_manifold
    area = float(section.geometry(np.zeros(1), 0.5).A[0])
    p, _ = places(section)
    round_one = 1.0 if isinstance(section, dx.Rectangle) else polygon_area(0.5 * np.pi * p) / np.pi
    assert round_one > 0.99
    assert mesh.volume == pytest.approx(area * round_one * 0.2, rel=2e-3)  # Pappus; (turn / 60)^2 / 6 along the rod


def test_fields_in_a_vtk_file_are_those_of_the_solution(bent: dx.EquilibriumSolution, tmp_path: Path) -> None:
    bent.export(tmp_path / "rod.vtp")
    mesh = pyvista.read(tmp_path / "rod.vtp")
    s = mesh.point_data["s (m)"]
    assert (s.min(), s.max()) == (0.0, pytest.approx(0.2))
    kappa = 0.5 * np.pi / 0.2
    np.testing.assert_allclose(mesh.point_data["curvature (1/m)"], kappa, rtol=1e-6)
    middle = 1.0 / kappa * np.array([1.0, 0.0, -1.0])
    np.testing.assert_allclose(
        mesh.points[-1], middle, atol=1e-6
    )  # the middle of the end: a quarter of a circle, in metres
    distance = np.hypot(mesh.points[:, 0], mesh.points[:, 2] + 1.0 / kappa) - 1.0 / kappa
    np.testing.assert_allclose(mesh.point_data["von Mises stress (Pa)"], 1e6 * kappa * np.abs(distance), atol=5.0)
    np.testing.assert_allclose(mesh.point_data["m (N m)"], np.tile(bent.m(0.1), (len(s), 1)), atol=1e-9)


def glb(path: Path) -> tuple[dict[str, Any], list[Any]]:
    data = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    content = json.loads(data[20 : 20 + size])
    assert kind == b"JSON"
    start = 20 + size + 8
    arrays = []
    for accessor in content["accessors"]:
        view = content["bufferViews"][accessor["bufferView"]]
        kind = {5126: "<f4", 5125: "<u4"}[accessor["componentType"]]
        raw = np.frombuffer(data, kind, view["byteLength"] // 4, start + view["byteOffset"])
        arrays.append(raw.reshape(-1, 3))
    return content, arrays


def test_gltf_is_in_metres_with_y_upwards(bent: dx.EquilibriumSolution, tmp_path: Path) -> None:
    bent.export(tmp_path / "rod.glb", field="stress")
    _, (points, normals, colours, triangles) = glb(tmp_path / "rod.glb")
    radius = 0.2 / (0.5 * np.pi)
    assert points[:, 1].min() == pytest.approx(-radius, abs=1e-5)  # what hangs down along -z does so along -y
    assert points[:, 0].max() == pytest.approx(radius + 2e-3, abs=1e-5)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-5)
    a, b, c = (points[triangles[:, i]].astype(float) for i in range(3))
    assert np.sum(np.einsum("ni,ni->n", a, np.cross(b, c))) / 6.0 == pytest.approx(np.pi * 4e-6 * 0.2, rel=1e-2)
    outward = np.einsum("ni,ni->n", np.cross(b - a, c - a), normals[triangles[:, 0]])
    assert np.mean(outward > 0.0) > 0.99
    assert np.any(np.all(colours < 0.02, axis=1))  # the dark stripe
    bent.export(tmp_path / "rod.gltf")
    assert pyvista.read(tmp_path / "rod.gltf").combine().n_points == len(glb_points(bent, tmp_path))


def glb_points(solution: dx.EquilibriumSolution, folder: Path) -> Any:
    solution.export(folder / "again.glb")
    return glb(folder / "again.glb")[1][0]


def test_a_motion_for_paraview(fall: dx.Trajectory, tmp_path: Path) -> None:
    fall.export(tmp_path / "fall.pvd")
    sets = list(ElementTree.parse(tmp_path / "fall.pvd").iter("DataSet"))
    assert [float(one.attrib["timestep"]) for one in sets] == fall.times.tolist()
    last = pyvista.read(tmp_path / sets[-1].attrib["file"])
    np.testing.assert_allclose(last.points[-1], fall.tip[-1], atol=1e-6)
    assert last.point_data["speed (m/s)"].max() == pytest.approx(
        np.linalg.norm(fall.velocities[-1], axis=1).max(), rel=1e-5
    )
    fall.export(tmp_path / "fall.stl", t=0.0)
    assert pyvista.read(tmp_path / "fall.stl").bounds.x_max == pytest.approx(0.25)
    fall.export(tmp_path / "fall.csv")
    table = np.loadtxt(tmp_path / "fall.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(table[-1, 2:5], fall.tip[-1])


def test_a_thin_rod_is_drawn_thicker_and_says_so(bent: dx.EquilibriumSolution) -> None:
    rod = shape.of(bent)
    way = drawn(rod.rod, 10.0)
    assert way.factor == 100.0  # 4 mm to 3 % of 10 m, which is 75 times, and the next round number
    assert way.note == "section drawn 100 times as thick"
    assert drawn(rod.rod, 10.0, thicker=2.5).factor == 2.5
    assert drawn(rod.rod, 0.01).note == ""
    bare = dx.Rod(1.0, dx.Stiffness(EI1=1.0, EI2=4.0, GJ=1.0))
    way = drawn(bare, 1.0)
    assert "no shape" in way.note
    assert way.section.a == pytest.approx(2.0 * way.section.b)  # an ellipse with I1 / I2 = EI1 / EI2


def test_the_stripe_leads_along_d1() -> None:
    rod = dx.Rod(length=0.2, section=dx.Rectangle(width=8e-3, height=1e-3), material=RUBBER)
    body = Body.of(shape.of(dx.integrate(rod, k=(0.0, 0.0, 30.0))), drawn(rod, 0.0))
    middles = body.points[body.faces[body.stripe == 1]].mean(axis=1)
    at = np.interp(middles[:, 2], [0.0, 0.2], [0.0, 6.0])
    d1 = np.stack([np.cos(at), np.sin(at)], axis=1)
    assert np.all(np.sum(middles[:, :2] * d1, axis=1) > 3.4e-3)


def test_what_can_t_be_drawn_is_said(
    bent: dx.EquilibriumSolution, fall: dx.Trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(dx.InvalidInput, match="it has curvature, twist, moment"):
        bent.view(field="speed", out="x.png")
    with pytest.raises(dx.InvalidInput, match="Did you mean 'stress'"):
        bent.view(field="stres", out="x.png")
    with pytest.raises(dx.InvalidInput, match=r"a \.png file"):
        bent.view(out="x.bmp")
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "darboux.view.space.overlay", None)  # as where VTK is missing
        with pytest.raises(dx.InvalidInput, match=r"pip install .darboux\[view\]"):
            bent.view(out="x.png")
    with pytest.raises(dx.InvalidInput, match="an equilibrium has none"):
        bent.view(t=1.0, out="x.png")
    with pytest.raises(dx.InvalidInput, match=r"\.vtp"):
        bent.export("x.obj")
    with pytest.raises(dx.InvalidInput, match="the trajectory runs"):
        fall.export("x.stl", t=3.0)
    assert "stress" in fields.known(shape.at(fall, 0.01))


def test_the_unloaded_shape_lies_at_its_support(bent: dx.EquilibriumSolution) -> None:
    ghost = shape.unloaded(bent.problem)
    np.testing.assert_allclose(ghost.r[-1], (0.2, 0.0, 0.0), atol=1e-12)
    ring = shape.unloaded(dx.Ring(dx.Rod(1.0, dx.Stiffness(EI1=1.0, GJ=0.7)), link=1))
    np.testing.assert_allclose(ring.r[-1], ring.r[0], atol=1e-6)


@pytest.mark.parametrize(
    "support",
    [
        dx.Clamped(),
        dx.Pinned(),
        dx.Hinge(axis=(1, 0, 0)),
        dx.Universal(axis=(1, 0, 0), section_axis=(0, 1, 0)),
        dx.Roller(along=(0, 0, 1)),
        dx.Roller(along=(1, 0, 0), sliding="section"),
        dx.Slider(along=(0, 0, 1)),
        dx.Guided(),
        dx.Spring(linear=1.0),
        dx.Spring(rotational=1.0),
    ],
    ids=lambda support: type(support).__name__,
)
def test_every_support_has_a_mark_that_does_not_cover_the_rod(support: Any) -> None:
    pen = marks.Marks(0.05, 0.01, np.array([0.0, -1.0, 0.0]))
    parts = pen.support(support, np.zeros(3), np.eye(3), np.array([0.0, 0.0, -1.0]))
    points = np.concatenate([part.points for part in parts])
    assert np.all(np.isfinite(points))
    assert 0.01 < np.max(np.linalg.norm(points, axis=1)) < 0.2
    if support.held_displacement != (False, False, False) and not isinstance(support, dx.Slider | dx.Roller):
        assert np.max(points[:, 2]) < 0.03  # the rod leaves along +z


LOADS = {
    "nothing": (dx.Gravity(), 0, []),
    "force": (dx.EndForce((0, 0.02, 0)), 1, ["20 mN"]),
    "follower": (dx.PointForce((0.02, 0, 0), at=0.1, follower=True), 1, ["20 mN, follower"]),
    "force off the centre": (dx.EndForce((0, 0.02, 0), offset=(0.01, 0, 0)), 2, ["20 mN"]),
    "follower off the centre": (
        dx.PointForce((0.02, 0, 0), at=0.1, follower=True, offset=(0, 0.01, 0)),
        2,
        ["20 mN, follower"],
    ),
    "moment": (dx.EndMoment((0, 1e-4, 0)), 1, ["100 µN m"]),
    "moment in a station": (dx.PointMoment((0, 0, 1e-4), at=0.1, follower=True), 1, ["100 µN m, follower"]),
    "line": (dx.LineForce((0, 0.1, 0)), 10, []),
    "line of the shape": (dx.LineForce(lambda s, r, R: 0.1 * R[:, :, 0]), 10, []),
    "couple": (dx.LineCouple((0, 0, 1e-4)), 10, []),
    "couple of the shape": (dx.LineCouple(lambda s, r, R: 1e-4 * R[:, :, 2]), 10, []),
    "foundation": (dx.Foundation(2.0), 10, []),
    "rotation": (dx.Rotation((0, 0, 3.0)), 10, ["3 rad/s"]),
    "no rotation": (dx.Rotation((0, 0, 0.0)), 0, [""]),
}


@pytest.mark.parametrize("name", LOADS)
def test_every_load_has_its_marks_and_words(bent: dx.EquilibriumSolution, name: str) -> None:
    load, least, words = LOADS[name]
    along = shape.of(bent)
    pen = marks.Marks(0.02, 0.004, np.array([0.0, -1.0, 0.0]))
    drawn_parts, labels = marks.loads(pen, dx.Equilibrium(bent.problem.rod, loads=[load]), along)
    assert len(drawn_parts) >= least
    assert bool(drawn_parts) == bool(least)
    assert [label.words for label in labels] == words
    assert all(np.all(np.isfinite(part.points)) for part in drawn_parts)


def test_a_force_off_the_centre_is_drawn_where_it_acts(bent: dx.EquilibriumSolution) -> None:
    F, e = np.array([0.0, 0.02, 0.0]), np.array([0.01, 0.0, 0.03])
    along, pen = shape.of(bent), marks.Marks(0.02, 0.004, np.array([0.0, -1.0, 0.0]))
    problem = dx.Equilibrium(bent.problem.rod, loads=[dx.EndForce(F, offset=e)])
    arm, *arrow = marks.loads(pen, problem, along)[0]
    acts_at = along.r[-1] + along.R[-1] @ e
    np.testing.assert_allclose(arm.points[[0, -1]].mean(axis=0), 0.5 * (along.r[-1] + acts_at), atol=2e-3)
    points = np.concatenate([part.points for part in arrow])
    assert np.min(points[:, 1]) == pytest.approx(acts_at[1] + 0.6 * 0.004)  # it pulls
    np.testing.assert_allclose(points.mean(axis=0)[[0, 2]], acts_at[[0, 2]], atol=1e-9)


def test_arrows_are_as_long_and_turn_as_what_they_stand_for() -> None:
    pen = marks.Marks(0.05, 0.01, np.array([0.0, -1.0, 0.0]))
    parts, label = pen.force(np.zeros(3), np.array([0.0, 0.0, -2.0]), 2.0, np.array([1.0, 0.0, 0.0]), "2 N")
    points = np.concatenate([part.points for part in parts])
    assert points[:, 2].min() == pytest.approx(-0.1 - 0.6 * 0.01)
    assert label.words == "2 N"
    arc, head = solids.turning_arrow(np.zeros(3), np.array([0.0, 0.0, 1.0]), 1.0, 0.02, "#000000")
    tip = head.points[-1]
    assert np.cross(arc.points.mean(axis=0) * 0.0 + arc.points[-1], tip - arc.points[-1])[2] > 0.0  # right-handedly


def test_the_picture_shows_the_rod_where_it_lies(bent: dx.EquilibriumSolution, tmp_path: Path) -> None:
    look = show.Look(field="curvature", camera=(-90.0, 0.0))
    stage = show.staged(bent, look)
    pixels = stage.pixels((400, 300)).astype(float) / 255.0
    assert pixels.shape == (300, 400, 3)
    np.testing.assert_array_equal(pixels[2, 2], 1.0)
    hue = pixels - pixels.mean(axis=2, keepdims=True)
    target = rgb(SCALE[2]) - rgb(SCALE[2]).mean()  # a constant field has the middle of the scale
    rod = np.sum(hue * target, axis=2) > 0.5 * np.sum(target**2)
    rod[:, 320:] = False  # the colour bar
    rows, columns = np.nonzero(rod)
    assert len(rows) > 300
    assert np.median(columns[rows < np.quantile(rows, 0.2)]) < np.median(columns[rows > np.quantile(rows, 0.8)])
    width, height = np.ptp(columns), np.ptp(rows)
    assert width == pytest.approx(height, abs=0.1 * height)  # a quarter of a circle, to one scale
    bent.view(out=tmp_path / "rod.png", size=(400, 300))
    assert (tmp_path / "rod.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize("size", [(180, 600), (300, 800), (160, 120), (900, 200)])
def test_no_word_is_cut_off_at_the_edges(bent: dx.EquilibriumSolution, size: tuple[int, int]) -> None:
    stage = show.staged(bent, show.Look(field="stress", thicker=3.0))
    assert stage.overlay.notes == ["section drawn 3 times as thick"]
    pixels = stage.pixels(size)
    border = np.ones(pixels.shape[:2], dtype=bool)
    border[2:-2, 2:-2] = False
    np.testing.assert_array_equal(pixels[border], 255)


WINDOW = """
import sys
import darboux as dx
from darboux.view.space import show

fall = dx.open(sys.argv[1])
plotter = show.view(fall, show=False, size=(500, 400))
plotter.show(interactive_update=True, auto_close=False)
assert plotter.render_window.GetMapped()  # on the display
slider, camera = plotter.slider_widgets[0], plotter.camera.position
plotter.screenshot("last.png")
slider.GetRepresentation().SetValue(0.0)
slider.InvokeEvent("EndInteractionEvent")
plotter.render()
plotter.screenshot("first.png")
assert plotter.camera.position == camera
plotter.camera.azimuth = 60.0
plotter.render()
plotter.screenshot("turned.png")
plotter.close()
"""


@pytest.mark.skipif(shutil.which("xvfb-run") is None, reason="no xvfb-run, which lends a display")
def test_a_window_opens_its_slider_moves_the_rod_and_it_can_be_turned(fall: dx.Trajectory, tmp_path: Path) -> None:
    longer = dx.Motion(fall.motion.problem, duration=0.15)
    dx.simulate(longer, dx.ImplicitMidpoint(segments=12, step=5e-3)).save(tmp_path / "fall.nc")
    command = ["xvfb-run", "-a", "--server-args=-screen 0 800x600x24", sys.executable, "-c", WINDOW, "fall.nc"]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert run.returncode == 0, run.stderr
    from matplotlib.image import imread

    last, first, turned = (imread(tmp_path / f"{name}.png")[..., :3] for name in ("last", "first", "turned"))
    assert last.shape == (400, 500, 3)
    for one, other in ((last, first), (first, turned)):
        assert np.mean(np.any(np.abs(one - other) > 0.2, axis=2)) > 0.005
    coloured = (np.nonzero(np.ptp(x[:, :400], axis=2) > 0.25)[0] for x in (first, last))  # the rod, without its scale
    before, after = (np.quantile(rows, 0.9) for rows in coloured)
    assert after > before + 20.0  # it has fallen


def test_a_window_needs_a_display_and_a_plotter_does_not(
    bent: dx.EquilibriumSolution, fall: dx.Trajectory, monkeypatch: Any
) -> None:
    monkeypatch.setattr(show, "_has_display", lambda: False)
    with pytest.raises(dx.InvalidInput, match="no display for a window"):
        bent.view()
    assert (
        show.view(bent, field="none", beside={"again": bent}, show=False).renderer.GetActors().GetNumberOfItems() >= 1
    )
