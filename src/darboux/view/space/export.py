"""Results for other programs: surfaces with fields (VTK), coloured surfaces (glTF), solids (STL), tables (CSV).

All lengths are in metres and true: nothing is made thicker. A section without shape has no true thickness; the file then says so.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux import checks, files
from darboux.errors import InvalidInput
from darboux.solution import EquilibriumSolution
from darboux.trajectory import Trajectory
from darboux.view.space import fields, gltf, shape
from darboux.view.space.body import Body, drawn
from darboux.view.space.shape import Shape
from darboux.view.space.show import ROD, pyvista

Array = NDArray[np.float64]

SAMPLES, MOST_SAMPLES = 201, 1_000_000  # lines of a table
EDGE = 40.0  # degrees between faces, beyond which an edge is sharp
SERIES_QUARTER = 6  # faces on a quarter of the outline, in the many files of a motion
OF_RODS = (".vtp", ".vtk", ".glb", ".gltf", ".stl", ".csv")
OF_MOTIONS = (".pvd", *OF_RODS)
ENDINGS = {"csv": (".csv",), "vtk": (".vtp", ".vtk", ".pvd"), "gltf": (".glb", ".gltf"), "stl": (".stl",)}  # by form
COLUMNS = (
    "s (m)",
    *(f"{name} (m)" for name in ("x", "y", "z")),
    *(f"d{i}{axis}" for i in (1, 2, 3) for axis in "xyz"),
    *(f"k{i} (1/m)" for i in (1, 2, 3)),
    *(f"n{axis} (N)" for axis in "xyz"),
    *(f"m{axis} (N m)" for axis in "xyz"),
    "tension (N)",
    "shear (N)",
)
STRESS = "stress (Pa)"  # von Mises', the largest of a section that has a shape
MOTION_COLUMNS = ("t (s)", "s (m)", "x (m)", "y (m)", "z (m)", "vx (m/s)", "vy (m/s)", "vz (m/s)")


def export(
    result: EquilibriumSolution | Trajectory,
    path: Any,
    *,
    t: float | None = None,
    field: str = "curvature",
    samples: int = SAMPLES,
) -> str:
    """Write a result for other programs; the name's ending says the form. Return what was written, in words.

        .vtp .vtk   the closed surface with its fields in SI, for ParaView and PyVista
        .glb .gltf  the surface, coloured by ``field`` ("none": plain), in metres with y upwards, for Blender and web pages
        .stl        the closed surface, for solid modellers
        .csv        a line for each of ``samples`` places along the rod (of a motion: for each record and vertex)
        .pvd        a motion for ParaView: its records as .vtp files in a folder beside it, with their times

    Arguments: ``t`` the time in s of a motion, for all forms but .csv and .pvd (else its last); the others as above.
    Raises ``InvalidInput``.
    """
    file = Path(path)
    form, moves = file.suffix.lower(), isinstance(result, Trajectory)
    allowed = OF_MOTIONS if moves else OF_RODS
    if form not in allowed:
        raise InvalidInput(
            f"export: {str(file)!r} ends in {form or 'nothing'!r}; the ending is one of {', '.join(allowed)}."
        )
    if isinstance(result, Trajectory):
        if form == ".csv":
            return _motion_table(result, file)
        if form == ".pvd":
            return _series(result, file)
        rod = shape.at(result, float(result.times[-1]) if t is None else checks.number("export.t", t, "s"))
    else:
        if t is not None:
            raise InvalidInput("export.t is the time of a motion; an equilibrium has none.")
        if form == ".csv":
            return _table(result, file, checks.whole("export.samples", samples, 2, MOST_SAMPLES))
        rod = shape.of(result)
    checks.choice("export.field", field, [*fields.known(rod), "none"])
    body = _body(rod)
    with files.replacing(file) as temporary:
        if form in (".vtp", ".vtk"):
            _mesh(body).save(temporary)
        elif form == ".stl":
            _mesh(body, vectors=False).save(temporary)
        else:
            write = gltf.binary if form == ".glb" else gltf.text
            temporary.write_bytes(write(*_painted(body, None if field == "none" else field), file.stem))
    return f"{len(body.points)} points, {len(body.faces)} faces" + _thickness(body)


def _body(rod: Shape, quarter: int | None = None) -> Body:
    extent = float(np.linalg.norm(np.ptp(rod.r, axis=0)))
    way = drawn(rod.rod, extent, thicker=1.0)
    return Body.of(rod, way) if quarter is None else Body.of(rod, way, quarter=quarter)


def _thickness(body: Body) -> str:
    return "" if body.drawn.own else "; the section has no shape, so its thickness is only drawn"


def _mesh(body: Body, vectors: bool = True) -> Any:
    """Return the closed surface with its fields as PyVista's mesh; without the ``vectors`` it takes less room."""
    rod = body.shape
    mesh = pyvista().PolyData.from_regular_faces(body.points, body.solid(None, (0.0, 1.0), ROD).triangles)
    given: dict[str, Array] = {"s (m)": rod.s}
    if vectors:
        given |= {f"d{i + 1}": rod.R[:, :, i] for i in range(3)}
        given |= {"k (1/m)": rod.k, "m (N m)": np.einsum("nij,nj->ni", rod.R, rod.forces[:, 3:])}
        if rod.velocity is None:
            given["n (N)"] = np.einsum("nij,nj->ni", rod.R, rod.forces[:, :3])
        else:
            given["velocity (m/s)"] = rod.velocity
    for name, values in given.items():
        mesh.point_data[name] = body.along(values)
    for name in fields.known(rod):
        mesh.point_data[f"{fields.FIELDS[name].words} ({fields.FIELDS[name].unit})"] = body.values(name)
    if not body.drawn.own:
        mesh.field_data["note"] = [body.drawn.note]
    return mesh


def _painted(body: Body, field: str | None) -> tuple[Array, Array, Array, NDArray[np.int64]]:
    """Return points, normals and colours (n, 3) and triangles (m, 3), with points of their own for stripes and sharp edges."""
    span = fields.span([body.values(field)]) if field else (0.0, 1.0)
    solid = body.solid(field, span, ROD)
    mesh = pyvista().PolyData.from_regular_faces(body.points, solid.triangles)
    halves = np.concatenate([body.stripe, body.stripe])[solid.kept]
    mesh.cell_data["stripe"] = np.where(halves == 3, 0, halves) if field else halves
    mesh.cell_data["colour"] = np.concatenate([solid.colours, solid.colours])[solid.kept]
    mesh = mesh.compute_normals(
        cell_normals=False, split_vertices=True, feature_angle=EDGE, consistent_normals=False, auto_orient_normals=False
    )
    corners = mesh.regular_faces
    key, triangles = np.unique(4 * corners + mesh.cell_data["stripe"][:, None], return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    colours, count = np.zeros((len(key), 3)), np.zeros(len(key))
    for i in range(3):
        np.add.at(colours, triangles[:, i], mesh.cell_data["colour"])
        np.add.at(count, triangles[:, i], 1.0)
    points = key // 4
    return mesh.points[points], mesh.point_data["Normals"][points], colours / count[:, None], triangles


def _series(trajectory: Trajectory, file: Path) -> str:
    """Write a motion for ParaView: a list of times, and a file for each."""
    folder = file.parent / f"{file.stem}_records"
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise InvalidInput(f"{folder} can't be made ({error.strerror or error}); choose another place.") from None
    lines = []
    for i, t in enumerate(trajectory.times):
        name = f"{file.stem}_{i:05d}.vtp"
        mesh = _mesh(_body(shape.at(trajectory, float(t)), SERIES_QUARTER), vectors=False)
        mesh.points = mesh.points.astype(np.float32)
        for label in mesh.point_data:
            mesh.point_data[label] = mesh.point_data[label].astype(np.float32)
        with files.replacing(folder / name) as temporary:
            mesh.save(temporary)
        lines.append(f'    <DataSet timestep="{t:.17g}" file="{folder.name}/{name}"/>')
    text = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n{}\n  </Collection>\n</VTKFile>\n'
    with files.replacing(file) as temporary:
        temporary.write_text(text.format("\n".join(lines)), encoding="utf-8")
    return f"{len(lines)} records to t = {trajectory.times[-1]:.4g} s, in {folder}"


def _table(solution: EquilibriumSolution, file: Path, samples: int) -> str:
    s = np.linspace(0.0, solution.problem.rod.length, samples)
    directors = solution.R(s).transpose(0, 2, 1).reshape(samples, 9)
    n, d3 = solution.n(s), solution.R(s)[:, :, 2]
    tension = np.einsum("ni,ni->n", n, d3)
    shear = np.linalg.norm(n - tension[:, None] * d3, axis=1)
    columns, parts = COLUMNS, [s, solution.r(s), directors, solution.k(s), n, solution.m(s), tension, shear]
    if solution.problem.rod.section.has_shape:
        columns, parts = (*columns, STRESS), [*parts, solution.stress(s).von_mises]
    _write_table(file, np.column_stack(parts), columns)
    return f"{samples} places, {len(columns)} columns"


def _motion_table(trajectory: Trajectory, file: Path) -> str:
    n, m = trajectory.positions.shape[:2]
    t, s = np.repeat(trajectory.times, m), np.tile(trajectory.s, n)
    data = np.column_stack([t, s, trajectory.positions.reshape(-1, 3), trajectory.velocities.reshape(-1, 3)])
    _write_table(file, data, MOTION_COLUMNS)
    return f"{n} records of {m} vertices, {len(MOTION_COLUMNS)} columns"


def _write_table(file: Path, data: Array, columns: tuple[str, ...]) -> None:
    with files.replacing(file) as temporary:
        np.savetxt(temporary, data, fmt="%.17g", delimiter=",", header=",".join(columns), comments="")


def ending(form: str, result: Any) -> str:
    """Return the ending that a file of this form has where none is asked for."""
    return ".pvd" if form == "vtk" and isinstance(result, Trajectory) else ENDINGS[form][0]
