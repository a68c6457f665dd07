"""Solutions and trajectories as NetCDF files that describe themselves: the states, the scenario, and how it was solved.

The states are stored as they are, without rounding, so that what is read equals what was saved.
`EquilibriumSolution.to_dataset` is for people's plots and holds derived quantities; this is for coming back.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from darboux import __version__, checks, files, scenario
from darboux.curve import Curve
from darboux.errors import InvalidInput, printable
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
SIGNATURE = b"\x89HDF"  # with which NetCDF files begin
SEAL = len(BEFORE_SEAL) + 64 + len(AFTER_SEAL)  # bytes
SAME = 1e-9  # of the length
BLOCK = 2**20  # bytes that are read at a time
# Dimensions, unit and what it is, of all arrays of a trajectory's file.
MOTION_ARRAYS = {
    "time": (("time",), "", "time in s"),  # xarray takes a unit "s" for a calendar's
    "s": (("vertex",), "m", "arc length of the undeformed rod"),
    **{name: (dimensions, unit, words) for name, dimensions, unit, words in RECORDS},
    **{name: (("time",), "J", words) for name, words in ENERGIES.items()},
}
DIMENSIONS: dict[str, dict[str, tuple[str, ...]]] = {
    EQUILIBRIUM: {
        "s": ("node",),
        **{form.format(name): ("node", d) for form in ("{}", "d{}_ds") for name, _, d, *_ in STATES},
    },
    MOTION: {name: dimensions for name, (dimensions, *_) in MOTION_ARRAYS.items()},
}
TEXTS = {"scenario": "the problem and the method, a scenario file", "record": "how the solve ended, as JSON"}
MOST_TEXT = {"scenario": 20_000_000, "record": 1_000_000}  # characters, which are read in some seconds


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
        part = files.part_of(file)
        more = f" {files.unfinished(part)}" if part.is_file() else ""
        raise InvalidInput(
            f"{file} is no file; a result is written by solution.save({file.name!r}), or by the command: darboux solve FILE "
            f"--out {file.name}.{more}"
        )
    foreign = f"{file} is damaged, or no result of darboux; solve its scenario again, and keep the result anew"
    try:
        _check_seal(file, foreign)
        with h5py.File(file, "r") as data:
            kind = data.attrs.get("kind")
            if kind not in ARRAYS:
                raise InvalidInput(f"{foreign}.")
            form, version = int(np.ravel(data.attrs["format"])[0]), str(data.attrs["darboux"])[:40]
            if form > FORMAT:
                raise InvalidInput(
                    f"{file} was written by darboux {version} in form {form}; this is darboux {__version__}, which reads forms "
                    f"up to {FORMAT}. Update darboux."
                )
            _check_parts(data, kind, file.stat().st_size)
            streamed = "streamed" in data.attrs
            arrays = _maps(file, data) if streamed else {name: np.asarray(data[name], float) for name in ARRAYS[kind]}
            texts = {name: data[name].asstr()[()] for name in TEXTS}
            unfinished = streamed and not data.attrs["digest"].strip()
            if not unfinished and _digest(kind, arrays, texts) != data.attrs["digest"]:
                raise InvalidInput(f"{foreign} (its check sum differs).")
        _check_arrays(kind, arrays)
        for name, most in MOST_TEXT.items():
            if len(texts[name]) > most:
                raise _Unfit(f"its {name} has {len(texts[name]) / 1e6:.3g} MB, and may have {most / 1e6:g}")
        return (_solution if kind == EQUILIBRIUM else _trajectory)(arrays, texts)
    except _Unfit as error:
        raise InvalidInput(f"{foreign} ({error}).") from None
    except InvalidInput as error:
        raise InvalidInput(str(error) if printable(str(file)) in str(error) else f"{foreign} ({error})") from None
    except MemoryError:
        raise InvalidInput(f"{file} needs more memory than there is to be read.") from None
    except Exception as error:  # noqa: BLE001  # whatever a damaged file makes of the reader
        raise InvalidInput(f"{foreign} ({type(error).__name__}).") from None


class _Unfit(Exception):  # noqa: N818  # a finding, not an error
    """What in a file is not as `save` would write it."""


def _check_parts(data: Any, kind: str, size: int) -> None:
    """Check that all parts lie in the file itself, as plain numbers and texts, and claim no more bytes than it has."""
    import h5py

    claimed = 0
    for name in (*ARRAYS[kind], *TEXTS):
        link = data.get(name, getlink=True)
        if link is None:
            raise _Unfit(f"it has no {name}")
        if not isinstance(link, h5py.HardLink):
            raise _Unfit(f"its {name} is a link to elsewhere")
        part = data[name]
        if not isinstance(part, h5py.Dataset) or part.external or part.is_virtual or part.chunks is not None:
            raise _Unfit(f"its {name} does not lie in it as one plain array")
        if name in TEXTS:
            if part.shape != () or h5py.check_string_dtype(part.dtype) is None:
                raise _Unfit(f"its {name} is no text")
        elif part.dtype != np.dtype("<f8") or part.shape is None:
            raise _Unfit(f"its {name} has no numbers of 64 bits")
        claimed += part.nbytes
    if claimed > size:
        raise _Unfit("its arrays claim more than it holds")
    if size - claimed > sum(MOST_TEXT.values()) + ROOM:
        raise _Unfit(f"it has {(size - claimed) / 1e6:.3g} MB beside its arrays, more than its scenario may have")


def _check_arrays(kind: str, arrays: dict[str, Array]) -> None:
    """Check shapes and values: dimensions that agree, numbers that are finite, s and time that grow."""
    sizes: dict[str, int] = {"axis": 3, "quaternion": 4}
    if "vertex" in (dimensions := DIMENSIONS[kind])["s"]:
        sizes["edge"] = arrays["s"].size - 1
    for name, array in arrays.items():
        expected = tuple(sizes.setdefault(d, n) for d, n in zip(dimensions[name], array.shape, strict=False))
        if array.shape != expected or array.ndim != len(dimensions[name]):
            raise _Unfit(
                f"its {name} is {' x '.join(map(str, array.shape)) or 'one number'}, which does not fit the rest"
            )
        if not np.all(np.isfinite(array)):
            raise _Unfit(f"its {name} holds what is no finite number")
    s = arrays["s"]
    if len(s) < 2 or np.any(np.diff(s) < 0.0) or s[0] < 0.0:
        raise _Unfit("its s does not grow from 0 along the rod")
    if kind == EQUILIBRIUM and np.any(np.abs(np.linalg.norm(arrays["q"], axis=1) - 1.0) > 1e-3):
        raise _Unfit("its q are no unit quaternions")
    if kind == MOTION:
        time, checkpoint = arrays["time"], arrays["checkpoint"]
        if len(time) < 1 or np.any(np.diff(time) <= 0.0) or time[0] < 0.0:
            raise _Unfit("its time does not grow from record to record")
        if len(checkpoint) < 1 or abs(checkpoint[0] - time[-1]) > SAME * time[-1]:
            raise _Unfit("it has no checkpoint at its last record")


def mapped(path: Path) -> dict[str, Array]:
    """Return the arrays of a streamed trajectory, which stay on the disk."""
    import h5py

    with h5py.File(path, "r") as data:
        return _maps(path, data)


def _maps(path: Path, data: Any) -> dict[str, Array]:
    """Return the arrays of a streamed file, of the records up to its checkpoint: its first number is the time."""
    if not len(data["checkpoint"]):
        raise _Unfit("it has no checkpoint to go on from")
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
    if len(texts["scenario"]) > MOST_TEXT["scenario"]:
        raise InvalidInput(
            f"the scenario of this result would have {len(texts['scenario']) / 1e6:.3g} MB, and may have "
            f"{MOST_TEXT['scenario'] / 1e6:g} in a file; thin out its Tables."
        )
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


def _status(record: dict[str, Any]) -> Status:
    """Return the status of a record, whose sentence is printed as it stands."""
    code, message = record["status"]["code"], record["status"]["message"]
    if not (isinstance(code, str) and isinstance(message, str)):
        raise _Unfit("its status is no text")
    return Status(printable(code[:40]), printable(message[:2000]))


def _check_number(record: dict[str, Any], name: str, least: float = -math.inf) -> None:
    value = record[name]
    if isinstance(value, bool) or not isinstance(value, int | float) or not least <= value < math.inf:
        raise _Unfit(f"its {name} is {checks.shown(value)}")


def _solution(arrays: dict[str, Array], texts: dict[str, str]) -> EquilibriumSolution:
    stated = scenario.parse(texts["scenario"])
    record = {name: _frozen(value) for name, value in json.loads(texts["record"]).items()}
    record |= {"status": _status(record), "error": ErrorEstimate(**record["error"])}
    _check_number(record, "load_factor")
    checks.instance("model", record["model"], str, "a text")
    checks.instance("statistics", record["statistics"], dict, "a table")
    for name, value in vars(record["error"]).items():
        if value is not None:
            _check_number({f"error of {name}": value}, f"error of {name}", 0.0)
    if record["index"] is not None:
        record["index"] = checks.whole("index", record["index"], 0)
    if record["elastic_parts"] is not None:
        checks.array("elastic_parts", record["elastic_parts"], (3,))
    if abs(arrays["s"][-1] - stated.problem.rod.length) > SAME * stated.problem.rod.length or arrays["s"][0] != 0.0:
        raise _Unfit("its s does not run from 0 to the rod's length")
    y, dy = (np.concatenate([arrays[form.format(name)] for name, *_ in STATES], axis=1) for form in ("{}", "d{}_ds"))
    return EquilibriumSolution(stated.problem, stated.method, curve=Curve(arrays["s"], y, dy), **record)


def _trajectory(arrays: dict[str, Array], texts: dict[str, str]) -> Trajectory:
    stated = scenario.parse(texts["scenario"])
    if stated.motion is None or stated.motion_method is None:
        raise _Unfit("its scenario states no motion and its method")
    record = json.loads(texts["record"])
    for name, least in (("seconds", 0.0), ("records", 1), ("steps", 0), ("newton_iterations", 0), ("halvings", 0)):
        _check_number(record["statistics"], name, least)
    parts = {name: arrays[name] for name, *_ in RECORDS}
    return Trajectory(
        stated.motion,
        stated.motion_method,
        _status(record),
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
