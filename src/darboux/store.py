"""Solutions and trajectories as NetCDF files that describe themselves: the states, the scenario, and how it was solved.

The states are stored as they are, without rounding, so that what is read equals what was saved.
`EquilibriumSolution.to_dataset` is for people's plots and holds derived quantities; this is for coming back.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from darboux import __version__, files, scenario
from darboux.curve import Curve
from darboux.errors import InvalidInput
from darboux.solution import EquilibriumSolution, ErrorEstimate, Status
from darboux.trajectory import MotionEnergy, Trajectory

if TYPE_CHECKING:
    from xarray import Dataset

Array = NDArray[np.float64]

ROOM = 2**17  # bytes of a file, for names, texts and descriptions beside the numbers
FORMAT = 1  # raised when a reader of the old form could no longer read the new one; older forms stay readable
EQUILIBRIUM, MOTION = "darboux equilibrium", "darboux motion"  # kinds of results
# Name, columns of the 13 states, dimension, unit and what it is.
STATES = (
    ("r", slice(0, 3), "axis", "m", "centreline, fixed frame"),
    ("q", slice(3, 7), "quaternion", "1", "orientation of the section as a unit quaternion, scalar first"),
    ("n", slice(7, 10), "axis", "N", "inner force, fixed frame"),
    ("m", slice(10, 13), "axis", "N m", "inner moment, fixed frame"),
)
RATE = {"m": "1", "1": "1/m", "N": "N/m", "N m": "N"}
# Name, dimensions, unit and what it is, of the arrays of a trajectory and of its energies.
RECORDS = (
    ("positions", ("time", "vertex", "axis"), "m", "the vertices, fixed frame"),
    ("velocities", ("time", "vertex", "axis"), "m/s", "velocities of the vertices"),
    ("directors", ("time", "edge", "axis"), "1", "first directors d1 of the edges between the vertices"),
    ("spins", ("time", "edge"), "rad/s", "spins of the edges about their tangents"),
    ("momentum", ("time", "axis"), "kg m/s", "momentum"),
    ("angular_momentum", ("time", "axis"), "kg m^2/s", "angular momentum about the origin"),
    ("checkpoint", ("number",), "1", "what the run goes on with, dimensionless"),
)
ENERGIES = {
    "kinetic": "kinetic energy",
    "bending": "energy of bending",
    "twist": "energy of twist",
    "stretch": "energy of stretch",
    "supports": "energy of elastic supports",
    "load": "potential of the loads",
    "dissipated": "energy dissipated by damping",
    "work": "work of moving supports, and of loads that change or follow",
}
ARRAYS = {
    EQUILIBRIUM: ("s", *(name for name, *_ in STATES), *(f"d{name}_ds" for name, *_ in STATES)),
    MOTION: ("time", "s", *(name for name, *_ in RECORDS), *ENERGIES),
}
BEFORE_SEAL, AFTER_SEAL = b"darboux sha256 ", b" end of file\n"
SEAL = len(BEFORE_SEAL) + 64 + len(AFTER_SEAL)  # bytes
BLOCK = 2**20  # bytes that are read at a time
# Dimensions, unit and what it is, of all arrays of a trajectory's file.
MOTION_ARRAYS = {
    "time": (("time",), "", "time in s"),  # xarray takes a unit "s" for a calendar's
    "s": (("vertex",), "m", "arc length of the undeformed rod"),
    **{name: (dimensions, unit, words) for name, dimensions, unit, words in RECORDS},
    **{name: (("time",), "J", words) for name, words in ENERGIES.items()},
}
TEXTS = {"scenario": "the problem and the method, a scenario file", "record": "how the solve ended, as JSON"}


def save(result: EquilibriumSolution | Trajectory, path: str | Path) -> None:
    """Write a result to a NetCDF file (HDF5), whole or not at all; ``darboux.open`` reads it back equal.

    Raises ``InvalidInput`` where the problem holds a Python function or the file can't be written.
    """
    data = dataset(result)
    with files.replacing(Path(path)) as temporary:
        files.reserve(temporary, data.nbytes + ROOM)  # HDF5 itself does not survive a full disk
        data.to_netcdf(temporary, engine="h5netcdf")
        seal(temporary)


def seal(file: Path) -> None:
    """Append a check sum of all bytes, which HDF5 passes over: some damaged files would keep its reader busy for ever."""
    digest = _sum_of(file, file.stat().st_size)
    with file.open("ab") as end:
        end.write(BEFORE_SEAL + digest + AFTER_SEAL)


def _check_seal(file: Path, foreign: str) -> None:
    size = max(0, file.stat().st_size - SEAL)
    with file.open("rb") as content:
        content.seek(size)
        seal = content.read()
    sealed = seal.startswith(BEFORE_SEAL) or seal.endswith(AFTER_SEAL)  # a streamed file is not
    if sealed and seal != BEFORE_SEAL + _sum_of(file, size) + AFTER_SEAL:
        raise InvalidInput(f"{foreign} (its check sum differs).")


def _sum_of(file: Path, size: int) -> bytes:
    digest = hashlib.sha256()
    with file.open("rb") as content:
        while size > 0:
            block = content.read(min(size, BLOCK))
            digest.update(block)
            size -= max(len(block), 1)
    return digest.hexdigest().encode()


def open(path: str | Path) -> Any:  # noqa: A001  # darboux.open
    """Return the solution or trajectory that a file holds, equal to the one saved, with its problem and its method.

    Raises ``InvalidInput`` for a file that is damaged, foreign, or written by a later form of darboux.
    """
    import h5py

    file = Path(path)
    if not file.is_file():
        raise InvalidInput(f"{file} is no file; a result is written by: darboux solve FILE --out {file.name}.")
    foreign = f"{file} is damaged, or no result of darboux; solve its scenario again, with --out {file.name}"
    try:
        _check_seal(file, foreign)
        with h5py.File(file, "r") as data:
            kind = data.attrs.get("kind")
            if kind not in ARRAYS:
                raise InvalidInput(f"{foreign}.")
            form, version = int(np.ravel(data.attrs["format"])[0]), data.attrs["darboux"]
            if form > FORMAT:
                raise InvalidInput(
                    f"{file} was written by darboux {version} in form {form}; this is darboux {__version__}, which reads forms "
                    f"up to {FORMAT}. Update darboux."
                )
            streamed = "streamed" in data.attrs
            arrays = _maps(file, data) if streamed else {name: np.asarray(data[name], float) for name in ARRAYS[kind]}
            texts = {name: data[name].asstr()[()] for name in TEXTS}
            unfinished = streamed and not data.attrs["digest"].strip()
            if not unfinished and _digest(kind, arrays, texts) != data.attrs["digest"]:
                raise InvalidInput(f"{foreign} (its check sum differs).")
        return (_solution if kind == EQUILIBRIUM else _trajectory)(arrays, texts)
    except InvalidInput as error:
        raise InvalidInput(str(error) if str(file) in str(error) else f"{foreign} ({error})") from None
    except Exception as error:  # noqa: BLE001  # whatever a damaged file makes of the reader
        raise InvalidInput(f"{foreign} ({type(error).__name__}).") from None


def mapped(path: Path) -> dict[str, Array]:
    """Return the arrays of a streamed trajectory, which stay on the disk."""
    import h5py

    with h5py.File(path, "r") as data:
        return _maps(path, data)


def _maps(path: Path, data: Any) -> dict[str, Array]:
    """Return the arrays of a streamed file, of the records up to its checkpoint: its first number is the time."""
    whole = {
        name: np.asarray(np.memmap(path, "<f8", "r", data[name].id.get_offset(), data[name].shape))
        for name in ARRAYS[MOTION]
    }
    kept = int(np.count_nonzero(whole["time"] <= whole["checkpoint"][0]))
    return {name: part[:kept] if MOTION_ARRAYS[name][0][0] == "time" else part for name, part in whole.items()}


def digest_of_motion(path: Path, data: Any) -> str:
    """Return the check sum of a streamed file, as it stands on the disk."""
    return _digest(MOTION, _maps(path, data), {name: data[name].asstr()[()] for name in TEXTS})


def json_of(record: dict[str, Any]) -> str:
    """Return a record as a file holds it."""
    return json.dumps(_plain(record))


def dataset(result: EquilibriumSolution | Trajectory) -> Dataset:
    """Return a result as an xarray ``Dataset`` that holds all of it: the states, the scenario, the record."""
    return _of_motion(result) if isinstance(result, Trajectory) else _of_equilibrium(result)


def _of_equilibrium(solution: EquilibriumSolution) -> Dataset:
    arrays = {"s": solution.curve.s}
    variables: dict[str, Any] = {}
    for name, columns, dimension, unit, words in STATES:
        arrays |= {name: solution.curve.y[:, columns], f"d{name}_ds": solution.curve.dy[:, columns]}
        variables[name] = (("node", dimension), arrays[name], {"units": unit, "long_name": words})
        rate = {"units": RATE[unit], "long_name": f"derivative of {name} by s"}
        variables[f"d{name}_ds"] = (("node", dimension), arrays[f"d{name}_ds"], rate)
    s = (
        "node",
        arrays["s"],
        {"units": "m", "long_name": "arc length of the undeformed rod; twice where a derivative jumps"},
    )
    coordinates = {"s": s, "axis": ["x", "y", "z"], "quaternion": list("wxyz")}
    names = [f.name for f in dataclasses.fields(solution) if f.compare and f.name not in ("problem", "method", "curve")]
    stated = scenario.Scenario(solution.problem, solution.method)
    return _whole(EQUILIBRIUM, variables, coordinates, arrays, stated, _record(solution, names))


def _of_motion(trajectory: Trajectory) -> Dataset:
    arrays = {"time": trajectory.times, "s": trajectory.s}
    arrays |= {name: getattr(trajectory, name) for name, *_ in RECORDS}
    arrays |= {name: getattr(trajectory.energy, name) for name in ENERGIES}
    variables: dict[str, Any] = {}
    for name, (dimensions, unit, words) in MOTION_ARRAYS.items():
        variables[name] = (dimensions, arrays[name], ({"units": unit} if unit else {}) | {"long_name": words})
    coordinates = {"time": variables.pop("time"), "s": variables.pop("s"), "axis": ["x", "y", "z"]}
    motion = trajectory.motion
    stated = scenario.Scenario(motion.problem, None, motion, trajectory.method)
    return _whole(MOTION, variables, coordinates, arrays, stated, _record(trajectory, ["status", "statistics"]))


def _whole(
    kind: str,
    variables: dict[str, Any],
    coordinates: dict[str, Any],
    arrays: dict[str, Array],
    stated: scenario.Scenario,
    record: dict[str, Any],
) -> Dataset:
    """Return the dataset with its texts and its check sum."""
    import xarray

    texts = {"scenario": stated.toml, "record": json.dumps(record)}
    variables |= {name: ((), texts[name], {"long_name": words}) for name, words in TEXTS.items()}
    digest = _digest(kind, arrays, texts)
    attributes = {"kind": kind, "format": FORMAT, "darboux": __version__, "digest": digest}
    return xarray.Dataset(variables, coordinates, attributes)


def _record(result: Any, names: list[str]) -> dict[str, Any]:
    """Return these fields as JSON can hold them."""
    record = {name: getattr(result, name) for name in names}
    return {
        name: dataclasses.asdict(value)
        if dataclasses.is_dataclass(value) and not isinstance(value, type)
        else _plain(value)
        for name, value in record.items()
    }


def _plain(value: Any) -> Any:
    """Return Python's own numbers in place of NumPy's."""
    if isinstance(value, dict):
        return {name: _plain(part) for name, part in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(part) for part in value]
    return value.item() if isinstance(value, np.generic) else value


def _frozen(value: Any) -> Any:
    """Return tuples in place of JSON's lists."""
    if isinstance(value, dict):
        return {name: _frozen(part) for name, part in value.items()}
    return tuple(map(_frozen, value)) if isinstance(value, list) else value


def _solution(arrays: dict[str, Array], texts: dict[str, str]) -> EquilibriumSolution:
    stated = scenario.parse(texts["scenario"])
    record = {name: _frozen(value) for name, value in json.loads(texts["record"]).items()}
    record |= {"status": Status(**record["status"]), "error": ErrorEstimate(**record["error"])}
    y, dy = (np.concatenate([arrays[form.format(name)] for name, *_ in STATES], axis=1) for form in ("{}", "d{}_ds"))
    return EquilibriumSolution(stated.problem, stated.method, curve=Curve(arrays["s"], y, dy), **record)


def _trajectory(arrays: dict[str, Array], texts: dict[str, str]) -> Trajectory:
    stated = scenario.parse(texts["scenario"])
    record = json.loads(texts["record"])
    parts = {name: arrays[name] for name, *_ in RECORDS}
    return Trajectory(
        stated.motion,
        stated.motion_method,
        Status(**record["status"]),
        s=arrays["s"],
        times=arrays["time"],
        energy=MotionEnergy(**{name: arrays[name] for name in ENERGIES}, least=stated.motion.least_energy),
        statistics=record["statistics"],
        **parts,
    )


def _digest(kind: str, arrays: dict[str, Array], texts: dict[str, str]) -> str:
    """Return a check sum of all that is stored."""
    digest = hashlib.sha256()
    for name in ARRAYS[kind]:
        digest.update(np.ascontiguousarray(arrays[name], dtype="<f8").data)
    for name in TEXTS:
        digest.update(texts[name].encode())
    return digest.hexdigest()
