"""Solutions as NetCDF files that describe themselves: the nodes' states, the scenario, and how it was solved.

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

if TYPE_CHECKING:
    from xarray import Dataset

Array = NDArray[np.float64]

FORMAT = 1  # raised when a reader of the old form could no longer read the new one; older forms stay readable
KIND = "darboux equilibrium"
# Name, columns of the 13 states, dimension, unit and what it is.
STATES = (
    ("r", slice(0, 3), "axis", "m", "centreline, fixed frame"),
    ("q", slice(3, 7), "quaternion", "1", "orientation of the section as a unit quaternion, scalar first"),
    ("n", slice(7, 10), "axis", "N", "inner force, fixed frame"),
    ("m", slice(10, 13), "axis", "N m", "inner moment, fixed frame"),
)
ARRAYS = ("s", *(name for name, *_ in STATES), *(f"d{name}_ds" for name, *_ in STATES))
TEXTS = {"scenario": "the problem and the method, a scenario file", "record": "how the solve ended, as JSON"}
RATE = {"m": "1", "1": "1/m", "N": "N/m", "N m": "N"}


def save(solution: EquilibriumSolution, path: str | Path) -> None:
    """Write a solution to a NetCDF file (HDF5), whole or not at all; ``darboux.open`` reads it back equal.

    Raises ``InvalidInput`` where the problem holds a Python function or the file can't be written.
    """
    data = dataset(solution)
    with files.replacing(Path(path)) as temporary:
        data.to_netcdf(temporary, engine="h5netcdf")


def open(path: str | Path) -> EquilibriumSolution:  # noqa: A001  # darboux.open
    """Return the solution that a file holds, equal to the one saved, with its problem and its method.

    Raises ``InvalidInput`` for a file that is damaged, foreign, or written by a later form of darboux.
    """
    import h5py

    file = Path(path)
    if not file.is_file():
        raise InvalidInput(f"{file} is no file; a result is written by: darboux solve FILE --out {file.name}.")
    foreign = f"{file} is damaged, or no result of darboux; solve its scenario again, with --out {file.name}"
    try:
        with h5py.File(file, "r") as data:
            if data.attrs.get("kind") != KIND:
                raise InvalidInput(f"{foreign}.")
            form, version = int(np.ravel(data.attrs["format"])[0]), data.attrs["darboux"]
            if form > FORMAT:
                raise InvalidInput(
                    f"{file} was written by darboux {version} in form {form}; this is darboux {__version__}, which reads forms "
                    f"up to {FORMAT}. Update darboux."
                )
            arrays = {name: np.asarray(data[name], dtype=float) for name in ARRAYS}
            texts = {name: data[name].asstr()[()] for name in TEXTS}
            if _digest(arrays, texts) != data.attrs["digest"]:
                raise InvalidInput(f"{foreign} (its check sum differs).")
        return _solution(arrays, texts)
    except InvalidInput as error:
        raise InvalidInput(str(error) if str(file) in str(error) else f"{foreign} ({error})") from None
    except Exception as error:  # noqa: BLE001  # whatever a damaged file makes of the reader
        raise InvalidInput(f"{foreign} ({type(error).__name__}).") from None


def dataset(solution: EquilibriumSolution) -> Dataset:
    """Return the solution as an xarray ``Dataset`` that holds all of it: the states at the nodes, the scenario, the record."""
    import xarray

    arrays = {"s": solution.curve.s}
    variables: dict[str, Any] = {}
    for name, columns, dimension, unit, words in STATES:
        arrays |= {name: solution.curve.y[:, columns], f"d{name}_ds": solution.curve.dy[:, columns]}
        variables[name] = (("node", dimension), arrays[name], {"units": unit, "long_name": words})
        rate = {"units": RATE[unit], "long_name": f"derivative of {name} by s"}
        variables[f"d{name}_ds"] = (("node", dimension), arrays[f"d{name}_ds"], rate)
    texts = {
        "scenario": scenario.Scenario(solution.problem, solution.method).toml,
        "record": json.dumps(_record(solution)),
    }
    for name, words in TEXTS.items():
        variables[name] = ((), texts[name], {"long_name": words})
    s = (
        "node",
        arrays["s"],
        {"units": "m", "long_name": "arc length of the undeformed rod; twice where a derivative jumps"},
    )
    data = xarray.Dataset(variables, {"s": s, "axis": ["x", "y", "z"], "quaternion": list("wxyz")})
    data.attrs = {"kind": KIND, "format": FORMAT, "darboux": __version__, "digest": _digest(arrays, texts)}
    return data


def _record(solution: EquilibriumSolution) -> dict[str, Any]:
    """Return all fields but the problem, the method and the curve, as JSON can hold them."""
    record = {
        field.name: getattr(solution, field.name)
        for field in dataclasses.fields(solution)
        if field.compare and field.name not in ("problem", "method", "curve")
    }
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


def _digest(arrays: dict[str, Array], texts: dict[str, str]) -> str:
    """Return a check sum of all that is stored."""
    digest = hashlib.sha256()
    for name in ARRAYS:
        digest.update(np.ascontiguousarray(arrays[name], dtype="<f8").tobytes())
    for name in TEXTS:
        digest.update(texts[name].encode())
    return digest.hexdigest()
