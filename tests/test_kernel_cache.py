"""Kernels that compile when they are first called are kept where a folder is writable, keyed on every kernel's source."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import darboux

PACKAGE = Path(darboux.__file__).parent
CODE = """
import numpy as np
from darboux.kernels import band, first_call
lower = np.zeros(band.LOWER); band.fix(lower, np.ones(1), np.array([True]))  # a kernel that compiles quickly
print(first_call.CACHE); print(lower[0]); print(sum(band.fix.stats.cache_hits.values()))
"""


def run(environment: dict[str, str], path: Path | None = None) -> list[str]:
    extra = {"DARBOUX_JIT": "1"} | ({"PYTHONPATH": str(path)} if path else {})
    done = subprocess.run(
        [sys.executable, "-c", CODE], capture_output=True, text=True, check=False, env=os.environ | environment | extra
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_a_second_process_finds_the_machine_code(tmp_path: Path) -> None:
    environment = {"DARBOUX_CACHE": str(tmp_path / "cache")}
    assert run(environment) == [str(tmp_path / "cache"), "1.0", "0"]
    assert run(environment) == [str(tmp_path / "cache"), "1.0", "1"]


def test_an_edit_in_another_kernel_file_is_noticed(tmp_path: Path) -> None:
    shutil.copytree(PACKAGE, tmp_path / "src" / "darboux", ignore=shutil.ignore_patterns("__pycache__"))
    environment = {"DARBOUX_CACHE": str(tmp_path / "cache")}
    assert run(environment, tmp_path / "src")[2] == "0"
    assert run(environment, tmp_path / "src")[2] == "1"
    with (tmp_path / "src" / "darboux" / "kernels" / "algebra.py").open("a") as file:
        file.write("# an edit\n")
    assert run(environment, tmp_path / "src")[2] == "0"


def test_no_writable_folder_is_no_failure(tmp_path: Path) -> None:
    """A file stands where each folder would be made: then kernels compile in memory."""
    shutil.copytree(PACKAGE, tmp_path / "src" / "darboux", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "src" / "darboux" / "kernels" / "__pycache__").write_text("")
    (tmp_path / "file").write_text("")
    blocked = str(tmp_path / "file" / "inside")
    environment = {"XDG_CACHE_HOME": blocked, "HOME": blocked, "LOCALAPPDATA": blocked, "PYTHONDONTWRITEBYTECODE": "1"}
    assert run(environment, tmp_path / "src") == ["None", "1.0", "0"]


COMPILES = """
import sys
import numpy as np
from darboux.kernels import band, jit

def compiles():
    band.fix(np.zeros(band.LOWER), np.ones(1), np.array([True]))

outer = jit.announced(lambda: jit.announced(compiles)())
outer() if "public" in sys.argv else compiles()
"""


def said(environment: dict[str, str], *words: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", COMPILES, *words],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | environment | {"DARBOUX_JIT": "1"},
    )
    assert done.stdout == ""
    return done.stderr


def test_a_public_call_says_once_that_it_compiles_and_for_how_long(tmp_path: Path) -> None:
    first = said({"DARBOUX_CACHE": str(tmp_path)}, "public")
    assert re.fullmatch(r"darboux: compiling .*, once for this installation; .* \.\.\. \d+ s\.\n", first)
    assert said({"DARBOUX_CACHE": str(tmp_path)}, "public") == ""


def test_all_that_is_public_and_compiles_says_so() -> None:
    """Their wrapper is the one that counts calls."""
    for call in (
        darboux.solve,
        darboux.solve_all,
        darboux.solve_many,
        darboux.simulate,
        darboux.natural_modes,
        darboux.integrate,
        darboux.compare,
    ):
        assert call.__wrapped__.__code__.co_filename.endswith("jit.py"), call
