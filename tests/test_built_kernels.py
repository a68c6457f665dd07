"""Kernels compiled when darboux is built: when they are taken, how they are called, and that they compute the same."""

from __future__ import annotations

import json
import os
import pickle
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import darboux
from darboux.kernels import band, build, built, discrete_rod, jit

PACKAGE = Path(darboux.__file__).parent
KERNELS = PACKAGE / "kernels"
pytestmark = pytest.mark.skipif(jit.AT_FIRST_CALL, reason="the kernels are not built: make kernels")


def run(code: str, source: Path = PACKAGE.parent, **environment: str) -> subprocess.CompletedProcess[str]:
    own = {"PYTHONPATH": str(source), "DARBOUX_JIT": "0", "PYTHONDONTWRITEBYTECODE": "1"} | environment
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, env=os.environ | own
    )


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """The source in a folder of its own, with the kernels that were built."""
    shutil.copytree(PACKAGE, tmp_path / "darboux", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


CHOICE = "import sys; from darboux.kernels import jit, band; print(jit.AT_FIRST_CALL, 'numba' in sys.modules)"
WITHOUT_NUMBA = "import sys; sys.modules['numba'] = None; "


def test_built_kernels_are_taken_and_numba_is_not_asked_for(copy: Path) -> None:
    done = run(WITHOUT_NUMBA.replace("None", "sys") + CHOICE.replace("'numba'", "'llvmlite'"), copy)
    assert (done.stdout.split(), done.stderr) == (["False", "False"], "")
    done = run(CHOICE, copy, DARBOUX_JIT="1")
    assert (done.stdout.split(), done.stderr) == (["True", "True"], "")


OLD = "from numpy._core import _multiarray_umath as m; m.__cpu_features__ |= dict.fromkeys({features}, False); "


@pytest.mark.parametrize("missing", ["AVX2", "F16C", "FMA3"])
def test_kernels_for_a_newer_processor_are_left_aside(copy: Path, missing: str) -> None:
    named_for(copy, built.V3)
    old = OLD.format(features=[missing])
    done = run(old + CHOICE, copy)
    assert (done.stdout.split(), done.stderr) == (["True", "True"], "")
    done = run(old + WITHOUT_NUMBA + CHOICE, copy)
    assert done.returncode == 1
    assert "newer than this processor" in done.stderr
    assert "DARBOUX_CPU=generic" in done.stderr


def test_the_doctor_tells_of_a_newer_processor(copy: Path, tmp_path: Path) -> None:
    named_for(copy, built.V3)
    doctor = "from darboux.cli.doctor import _kernels; print(_kernels())"
    assert "for x86-64-v3, and lie in" in run(doctor, copy).stdout or not built.has_v3()
    done = run(OLD.format(features=["AVX2"]) + doctor, copy, DARBOUX_CACHE=str(tmp_path))
    assert "they compile when they are first called" in done.stdout
    assert "newer than this processor" in done.stdout
    assert "DARBOUX_CPU=generic" in done.stdout


def test_kernels_for_every_processor_are_taken_on_an_old_one(copy: Path) -> None:
    named_for(copy, "generic")
    done = run(OLD.format(features=["AVX2", "F16C", "FMA3"]) + CHOICE, copy)
    assert (done.stdout.split(), done.stderr) == (["False", "False"], "")


def named_for(copy: Path, processor: str) -> None:
    """Name the kernels as if they had been built for this processor."""
    for name in built.modules():
        (found,) = (copy / "darboux/kernels").glob(f"{built.extension(name)}.*{built.SUFFIX}")
        found.rename(found.with_name(built.file(name, processor).name))


def test_what_is_built_where_nobody_names_a_processor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DARBOUX_CPU", raising=False)
    features = dict.fromkeys(("AVX2", "F16C", "FMA3"), True)
    monkeypatch.setattr("numpy._core._multiarray_umath.__cpu_features__", features)
    assert build.processor() == built.V3
    for told in ({"AVX2": True, "F16C": True}, {}):  # told nothing of some, and of all
        monkeypatch.setattr("numpy._core._multiarray_umath.__cpu_features__", told)
        assert build.processor() == "generic"
    monkeypatch.delattr("numpy._core._multiarray_umath.__cpu_features__")
    assert build.processor() == "generic"
    monkeypatch.setenv("DARBOUX_CPU", "znver3")
    assert build.processor() == "znver3"


def test_kernels_of_other_sources_are_left_aside(copy: Path) -> None:
    """Ring calls what is in band, and both are in the extension of rod_motion; path is not, but kernels are taken all or none."""
    before = built.modules()
    with (copy / "darboux/kernels/band.py").open("a") as file:
        file.write("# an edit\n")
    done = run(CHOICE, copy)
    assert done.stdout.split() == ["True", "True"]
    assert done.stderr.count("\n") == 1
    assert "make kernels" in done.stderr
    done = run("import json; from darboux.kernels import built; print(json.dumps(built.modules()))", copy)
    after = json.loads(done.stdout)
    changed = {name for name in before if before[name] != after[name]}
    assert changed == {"rod_motion"}
    assert built.homes()["band"] == built.homes()["ring"] == "rod_motion"


def test_without_built_kernels_numba_is_needed(copy: Path) -> None:
    for file in (copy / "darboux/kernels").glob(f"_*{built.SUFFIX}"):
        file.unlink()
    done = run(CHOICE, copy)
    assert (done.stdout.split(), done.stderr) == (["True", "True"], "")
    done = run(WITHOUT_NUMBA + CHOICE, copy)
    assert done.returncode == 1
    assert "pip install numba" in done.stderr


def test_an_array_that_the_machine_code_would_misread_is_refused() -> None:
    lower = np.zeros(4 * band.LOWER)
    for wrong in (np.zeros(2 * lower.size)[::2], lower.astype(int), lower.reshape(4, -1), lower.tolist()):
        with pytest.raises((TypeError, AttributeError), match=r"lower|dtype"):
            band.factor(wrong, 4)
    state = discrete_rod.State(*(np.zeros(9) for _ in range(3)), np.zeros((3, 1)))
    with pytest.raises(TypeError, match=r"state\.m is float64 \(3, 1\)"):
        discrete_rod.strains(state, 0, 0, np.zeros(3))
    assert band.factor(np.ones((band.LOWER, 2))[:, 0][:1].repeat(band.LOWER), 1) == 0


def test_a_built_kernel_is_a_function_of_its_module() -> None:
    assert pickle.loads(pickle.dumps(band.factor)) is band.factor
    assert band.factor.__doc__
    assert band.factor(n=1, lower=np.ones(band.LOWER)) == 0


def test_a_built_kernel_lets_other_threads_run() -> None:
    """Threads that never take turns by themselves see each other only while one waits, or is in a kernel."""
    n = 400_000
    lower = np.zeros(band.LOWER * (n + 4 * band.BLOCK))
    lower[:: band.LOWER] = 4.0
    inside, seen = threading.Event(), threading.Event()
    within = False

    def many() -> None:
        nonlocal within
        inside.set()
        for _ in range(200):
            within = True
            band.factor(lower, n)
            within = False
            if seen.is_set():
                return

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e6)
    try:
        thread = threading.Thread(target=many)
        thread.start()
        inside.wait()
        while thread.is_alive() and not seen.is_set():
            if within:
                seen.set()
            time.sleep(0.0)
    finally:
        sys.setswitchinterval(interval)
    thread.join()
    assert seen.is_set()


SOLVED = """
import numpy as np
from darboux.kernels import band, jit
random = np.random.default_rng(1)
n = 40
lower = random.uniform(-1.0, 1.0, band.LOWER * (n + 2 * band.BLOCK + band.REACH)); lower[:: band.LOWER] += 10.0
b = random.uniform(-1.0, 1.0, n + 2 * band.BLOCK + band.REACH)
print(band.factor(lower, n), band.solve(lower, n, b), lower.tobytes().hex(), b.tobytes().hex(), jit.AT_FIRST_CALL)
"""


@pytest.mark.slow
def test_built_kernels_give_the_numbers_of_those_that_compile_at_the_first_call(tmp_path: Path) -> None:
    """Bit for bit, compiled for the same processor."""
    same = {"NUMBA_CPU_NAME": built.processor() or "", "NUMBA_CPU_FEATURES": "", "DARBOUX_CACHE": str(tmp_path)}
    ours, theirs = run(SOLVED).stdout.split(), run(SOLVED, DARBOUX_JIT="1", **same).stdout.split()
    assert (ours.pop(), theirs.pop()) == ("False", "True")
    assert ours == theirs
