"""`darboux paper`: the numbers of the issue's table, the files, the command, and both on a clean copy."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

import darboux as dx
from darboux.paper import cases as paper_cases
from darboux.paper import results
from darboux.paper.run import PART_OF, run

ROOT = Path(__file__).parent.parent
STEMS = {*(f"figure{i}" for i in range(1, 8)), "figure5_convergence", "rotating", "charged"}


@pytest.fixture(scope="module")
def paper(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path, str]:
    """What one whole run gives: the file, the folder, the screen."""
    folder = tmp_path_factory.mktemp("paper")
    with (folder / "screen.txt").open("w+") as screen:
        run([], folder / "figures", Console(file=screen, width=80))
        screen.seek(0)
        text = screen.read()
    return json.loads((folder / "figures" / "paper.json").read_text()), folder / "figures", text


def distance(a: list[float], b: tuple[float, ...]) -> float:
    return math.dist(a, b)


def test_figure_5(paper) -> None:
    """Tip / L (0.059237552699737, -0.975788073351614), root curvature x L 34.5913301991614, to 1e-9; and with stretch."""
    figure = paper[0]["figure5"]
    tip = (0.059237552699737 * 0.25, 0.0, -0.975788073351614 * 0.25)
    for method in ("shooting", "elastica"):
        row = figure["inextensible"][method]
        assert distance(row["tip"], tip) < 1e-9 * 0.25
        assert row["root_curvature"] * 0.25 == pytest.approx(34.5913301991614, rel=1e-9)
    assert distance(figure["stretch"]["shooting"]["tip"], (0.014817711552, 0.0, -0.244237586080)) < 1e-8 * 0.25
    assert "elastica" not in figure["stretch"]  # which states inextensible rods
    for model in ("inextensible", "stretch"):
        assert figure[model]["discrete_30"]["tip_distance"] < 3e-3
        assert figure[model]["discrete_30"]["tip_distance"] < 0.2 * figure[model]["discrete_5"]["tip_distance"]
    assert 1.9 < figure["order"]["half_cell"] < 2.1
    assert 0.95 < figure["order"]["two_vertices"] < 1.1


def test_figure_6(paper) -> None:
    """Helix radius 0.027223581963397 m, pitch 0.103230848648764 m, tip (0.14357442, 0.00121015, 0.07986098) m."""
    figure = paper[0]["figure6"]
    for method in ("initial_value", "shooting", "exact"):
        assert figure[method]["radius"] == pytest.approx(0.027223581963397, abs=0.3e-9)
        assert figure[method]["pitch"] == pytest.approx(0.103230848648764, abs=0.3e-9)
        assert distance(figure[method]["tip"], (0.14357442, 0.00121015, 0.07986098)) < 1e-8  # digits given
    assert figure["shooting"]["centreline_distance"] < 1e-9
    assert 1.95 < figure["discrete_order"] < 2.05


def test_the_rest_of_the_numbers(paper) -> None:
    numbers = paper[0]
    assert set(numbers["figure7"]) == {"a", "b"}
    for reading in numbers["figure7"].values():
        assert set(reading) == {"vertical", "horizontal"}
        assert all(len(shape["tip"]) == 3 for shape in reading.values())
    assert set(numbers["invariants"]) == {"n", "m_plus_r_cross_n", "m_dot_n", "m_dot_d3"}
    assert max(numbers["invariants"].values()) < 1e-9
    assert numbers["conventions"]["max_difference"] < 1e-9
    assert numbers["rotating"]
    assert numbers["charged"]


def test_the_files_and_the_screen(paper) -> None:
    _, folder, screen = paper
    for stem in STEMS:
        assert (folder / f"{stem}.png").read_bytes()[:4] == b"\x89PNG"
        assert (folder / f"{stem}.svg").read_text().lstrip().startswith("<?xml")
    assert {path.stem for path in folder.iterdir()} == STEMS | {"paper"}
    for words in ("Figure 5, inextensible", "agree to", "exact helix", "order", "paper.json"):
        assert words in screen
    assert max(map(len, screen.splitlines())) <= 80


def command(*words: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run the command as a person would, in a process of its own."""
    code = "from darboux.cli import main; main()"
    return subprocess.run(
        [sys.executable, "-c", code, *words], cwd=cwd, capture_output=True, text=True, timeout=300, check=False,
        env=os.environ | {"COLUMNS": "80", "MPLBACKEND": "Agg"},
    )  # fmt: skip


def test_one_part_alone(tmp_path: Path) -> None:
    done = command("paper", "--only", "rotating", "--out", "here", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert {path.name for path in (tmp_path / "here").iterdir()} == {"rotating.png", "rotating.svg", "paper.json"}
    assert set(json.loads((tmp_path / "here" / "paper.json").read_text())) >= {"rotating"}


@pytest.mark.parametrize("name", ["8", "figure5", ""])
def test_an_unknown_part_is_a_sentence(name: str, tmp_path: Path) -> None:
    done = command("paper", "--only", name, cwd=tmp_path)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert "--only" in done.stderr
    assert "'rotating'" in done.stderr
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_written_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    done = command("paper", "--out", str(tmp_path / "file" / "inside"))
    assert done.returncode == 2
    assert done.stderr.startswith("InvalidInput: --out is ")
    assert len(done.stderr.strip().splitlines()) == 1


def test_help_and_version() -> None:
    assert "paper" in command("--help").stdout
    text = command("paper", "--help").stdout
    assert "--only" in text
    assert "Example" in text
    assert command("--version").stdout.strip() == f"darboux {dx.__version__}"
    assert tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"] == dx.__version__


def test_every_part_has_a_name() -> None:
    from darboux.paper.results import PARTS

    assert set(PART_OF.values()) == set(PARTS)


def test_importing_is_light() -> None:
    """Nothing that draws, compiles or prints is loaded by ``import darboux``."""
    code = (
        "import sys, darboux; print([m for m in ('numba', 'scipy', 'matplotlib', 'typer', 'rich') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_public_names() -> None:
    assert set(dx._HOME) == {*dx.__all__, "open"}
    assert dx.turn == pytest.approx(2.0 * np.pi)
    for name in set(dx.__all__) - {"turn"}:
        assert getattr(dx, name).__name__ == name
        assert getattr(dx, name).__doc__
    with pytest.raises(AttributeError, match="no attribute 'Rodd'"):
        dx.Rodd  # noqa: B018


@pytest.mark.long
def test_the_two_commands_on_a_clean_copy(tmp_path: Path) -> None:
    """`make paper` and `make test` from a fresh clone, in an environment that they make themselves, as `.ci/run` does."""
    copy = tmp_path / "copy"
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(copy)], check=True)
    clean = {
        name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV", "MAKEFLAGS")
    }
    for words in (["paper", "ARGS=--only 6"], ["test", "ARGS=tests/test_descriptions.py -q"]):
        done = subprocess.run(
            ["make", *words], cwd=copy, env=clean, capture_output=True, text=True, timeout=900, check=False
        )
        assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert (copy / "paper-figures" / "figure6.png").exists()
    assert "passed" in done.stdout


def test_figure_7_starts_from_the_printed_curvature() -> None:
    """Printed k = (0, 2, 0.1) in the left-handed triad: (0, -2, 0.1) in ours; and the drawn tips hang below the clamp."""
    part = results.figure7()
    for orientation in ("vertical", "horizontal"):
        np.testing.assert_allclose(part.solutions[f"a.{orientation}"].k(0.0), (0.0, -2.0, 0.1), atol=1e-12)
        np.testing.assert_allclose(part.solutions[f"b.{orientation}.natural"].k(0.0), (0.0, 2.0, 0.1), atol=1e-12)


def test_drifts_and_differences_are_the_largest_not_the_smallest() -> None:
    drift = results.invariants().numbers["invariants"]
    assert all(1e-17 < drift[name] < 1e-9 for name in ("m_plus_r_cross_n", "m_dot_n", "m_dot_d3"))
    assert 1e-15 < results.conventions().numbers["conventions"]["max_difference"] < 1e-9


def test_turns_per_second_are_turns() -> None:
    assert paper_cases.rotating(2.0).loads[1].omega == pytest.approx((0.0, 0.0, 4.0 * np.pi))
