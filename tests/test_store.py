"""Results as files: what is read equals what was saved, and what is no result is refused in a sentence."""

from __future__ import annotations

import dataclasses
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import darboux as dx
from darboux import __version__, store
from tests import cases

HANGING = dx.Equilibrium(cases.RUBBER, start=cases.ALONG_X, loads=[dx.Gravity()])
POINTS = dx.Equilibrium(
    dx.Rod(1.0, dx.Stiffness(EI1=dx.Table([0, 0.3, 1], [1.0, 2.0, 1.0], "linear"), GJ=0.7)),
    between={0.5: dx.Pinned((0.1, 0, 0.4))},
    loads=[dx.PointForce((1, 2, 3), at=0.7)],
)
SOLVED = {
    "collocation": (HANGING, None),
    "shooting": (HANGING, dx.Shooting()),
    "elastica": (HANGING, dx.Elastica()),
    "discrete": (HANGING, dx.DiscreteRod(20)),
    "jumps": (POINTS, dx.Collocation(rtol=1e-6)),
    "a ring": (dx.Ring(cases.UNIT, link=1), None),
    "not converged": (cases.tip_force(1e3).with_load(dx.EndForce((-4e3, 0, 0))), dx.Shooting()),
}


@pytest.fixture(scope="module")
def solved() -> dict[str, Any]:
    return {name: dx.solve(problem, method, throw=False) for name, (problem, method) in SOLVED.items()}


@pytest.mark.parametrize("name", SOLVED)
def test_what_is_saved_comes_back_equal(name: str, solved: dict[str, Any], tmp_path: Path) -> None:
    solution = solved[name]
    solution.save(tmp_path / "a.nc")
    found = dx.open(tmp_path / "a.nc")
    assert found == solution
    assert hash(found) == hash(solution)
    for field in dataclasses.fields(solution):  # each by itself, so that equality can't forget one
        if field.compare:
            assert getattr(found, field.name) == getattr(solution, field.name), field.name
    for part in ("s", "y", "dy"):
        np.testing.assert_array_equal(getattr(found.curve, part), getattr(solution.curve, part))
    assert found.problem == solution.problem
    np.testing.assert_array_equal(found.tip, solution.tip)
    assert str(found) == str(solution)
    assert [path.name for path in tmp_path.iterdir()] == ["a.nc"]


def test_equality_sees_every_part(solved: dict[str, Any]) -> None:
    one = solved["collocation"]
    assert one != solved["shooting"]
    assert one != "a solution"
    y = one.curve.y.copy()
    y[3, 1] = np.nextafter(y[3, 1], np.inf)
    for change in ({"load_factor": 0.5}, {"index": 3}, {"curve": dataclasses.replace(one.curve, y=y)}):
        assert dataclasses.replace(one, **change) != one
    assert dataclasses.replace(one) == one


def test_the_file_describes_itself(solved: dict[str, Any], tmp_path: Path) -> None:
    """Read by xarray alone, as somebody without darboux would."""
    import xarray

    solved["collocation"].save(tmp_path / "a.nc")
    with xarray.open_dataset(tmp_path / "a.nc", engine="h5netcdf") as data:
        for name in data.data_vars:
            assert data[name].attrs["long_name"]
        for name, unit in (("s", "m"), ("r", "m"), ("n", "N"), ("m", "N m"), ("dr_ds", "1"), ("dm_ds", "N")):
            assert data[name].attrs["units"] == unit
        assert data["r"].dims == ("node", "axis")
        assert list(data["axis"].values) == ["x", "y", "z"]
        assert 'name = "steel"' not in str(data["scenario"].item())
        assert "[rod]" in str(data["scenario"].item())
        assert data.attrs["format"] == store.FORMAT
        assert data.attrs["darboux"] == __version__
        np.testing.assert_array_equal(data["r"][-1], solved["collocation"].tip)


def test_damaged_and_foreign_files_are_refused(solved: dict[str, Any], tmp_path: Path) -> None:
    good = tmp_path / "good.nc"
    solved["discrete"].save(good)
    whole = good.read_bytes()
    bad = tmp_path / "bad.nc"
    contents = [
        b"",
        b"text",
        whole[:100],
        whole[: len(whole) // 2],
        whole[:-1] + b"",
        b"\x89HDF\r\n\x1a\n" + bytes(500),
    ]
    rng = np.random.default_rng(1)
    for _ in range(40):
        at = int(rng.integers(len(whole)))
        contents.append(whole[:at] + bytes([whole[at] ^ 0x10]) + whole[at + 1 :])
    sentences = []
    for content in contents:
        bad.write_bytes(content)
        try:
            assert dx.open(bad) == solved["discrete"]  # a bit that nothing reads
        except dx.InvalidInput as error:
            sentences.append(str(error))
    assert len(sentences) >= 10
    for sentence in sentences:
        assert str(bad) in sentence
        assert "\n" not in sentence
        assert len(sentence) < 500 + len(str(bad))
    with pytest.raises(dx.InvalidInput, match="no file"):
        dx.open(tmp_path / "none.nc")
    with pytest.raises(dx.InvalidInput, match="no file"):
        dx.open(tmp_path)


def test_a_number_changed_in_the_file_is_noticed(solved: dict[str, Any], tmp_path: Path) -> None:
    solved["discrete"].save(tmp_path / "a.nc")
    import h5py

    with h5py.File(tmp_path / "a.nc", "r+") as file:
        file["r"][3, 1] += 1e-9
    with pytest.raises(dx.InvalidInput, match="check sum"):
        dx.open(tmp_path / "a.nc")


def test_another_program_s_and_a_later_form_are_refused(solved: dict[str, Any], tmp_path: Path) -> None:
    import xarray

    xarray.Dataset({"x": ("n", [1.0, 2.0])}).to_netcdf(tmp_path / "other.nc", engine="h5netcdf")
    with pytest.raises(dx.InvalidInput, match="no result of darboux"):
        dx.open(tmp_path / "other.nc")
    data = store.dataset(solved["discrete"])
    data.attrs |= {"format": store.FORMAT + 1, "darboux": "99.0"}
    data.to_netcdf(tmp_path / "later.nc", engine="h5netcdf")
    with pytest.raises(dx.InvalidInput, match=r"darboux 99\.0.*Update darboux"):
        dx.open(tmp_path / "later.nc")


def test_what_can_not_be_saved_says_so(solved: dict[str, Any], tmp_path: Path) -> None:
    cone = dx.Rod(1.0, dx.Stiffness(EI1=lambda s: 1.0 + s, GJ=1.0))
    solution = dx.solve(dx.Equilibrium(cone))
    with pytest.raises(dx.InvalidInput, match=r"rod\.section\.EI1 is a Python function"):
        solution.save(tmp_path / "a.nc")
    with pytest.raises(dx.InvalidInput, match="can't be written"):
        solved["discrete"].save(tmp_path / "no folder" / "a.nc")
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(os.name == "nt", reason="kills by a signal")
def test_a_kill_while_saving_leaves_the_old_file(solved: dict[str, Any], tmp_path: Path) -> None:
    """A process that dies between writing and renaming: under the final name is what was there before."""
    path = tmp_path / "a.nc"
    solved["discrete"].save(path)
    before = path.read_bytes()
    code = (
        "import os, signal, sys, pathlib\n"
        "from darboux import files\n"
        "with files.replacing(pathlib.Path(sys.argv[1])) as temporary:\n"
        "    temporary.write_bytes(b'half')\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", code, str(path)], check=False)
    assert done.returncode == -signal.SIGKILL
    assert path.read_bytes() == before
