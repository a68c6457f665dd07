"""The tutorials run from top to bottom, as a notebook runs them, and each finds the numbers that mechanics says."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any

import jupytext
import matplotlib.pyplot as plt
import nbclient
import pytest

TUTORIALS = sorted((Path(__file__).parent.parent / "docs" / "tutorials").glob("*.md"))


def run(cell: str, names: dict[str, Any]) -> str:
    """Run a cell, and return how its last expression shows itself."""
    tree = ast.parse(cell)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    if last is None:
        return ""
    value = eval(compile(ast.Expression(last.value), "cell", "eval"), names)
    return str(value._repr_html_()) if hasattr(value, "_repr_html_") else repr(value)


@pytest.mark.parametrize("path", TUTORIALS, ids=lambda path: path.stem)
def test_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    cells = [cell.source for cell in jupytext.read(path).cells if cell.cell_type == "code"]
    assert sum("assert" in cell for cell in cells) >= 3
    names: dict[str, Any] = {}
    shown = "".join(run(cell, names) for cell in cells)
    assert "<svg" in shown or path.stem == "buckling"
    assert len(plt.get_fignums()) >= 2  # pictures that a notebook shows
    assert capsys.readouterr().out.strip()
    plt.close("all")
    if path.stem == "motion":
        assert (tmp_path / "fall.gif").stat().st_size > 10_000


def test_there_are_three() -> None:
    assert [path.stem for path in TUTORIALS] == ["buckling", "first-rod", "motion"]


def test_a_notebook_shows_every_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MPLBACKEND", raising=False)
    notebook = jupytext.read(next(path for path in TUTORIALS if path.stem == "first-rod"))
    nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(tmp_path)}}).execute()
    kinds = [set(output.get("data", {})) for cell in notebook.cells for output in cell.get("outputs", [])]
    assert sum("image/png" in kind for kind in kinds) == 3  # the shape, the fields, the methods
    assert sum("text/html" in kind for kind in kinds) == 3  # the problem, the solution, the comparison
