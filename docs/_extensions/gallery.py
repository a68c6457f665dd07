"""The gallery: every script of examples/ is run when the site is built; its picture and its text become a page."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.errors import ExtensionError

INDEX = """# Gallery

Each picture is made by a short script of `examples/`, which also asserts a number: from a formula, or published. Run one by
`python examples/euler_column.py`, or with the name of a file for its picture.

::::{container} gallery
"""


def _make(app: Sphinx) -> None:
    """Run the examples, and write the pages that show them into docs/gallery/, which is made anew at each build."""
    folder = Path(app.srcdir) / "gallery"
    folder.mkdir(exist_ok=True)
    scripts = sorted((Path(app.srcdir).parent / "examples").glob("*.py"))

    def run(script: Path) -> subprocess.CompletedProcess[str]:
        words = [sys.executable, str(script), str(folder / f"{script.stem}.png")]
        return subprocess.run(
            words, env={**os.environ, "MPLBACKEND": "Agg"}, capture_output=True, text=True, check=False
        )

    index = INDEX
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        runs = list(pool.map(run, scripts))
    for script, done in zip(scripts, runs, strict=True):
        if done.returncode:
            raise ExtensionError(f"examples/{script.name} failed:\n{done.stderr}")
        title, _, text = (ast.get_docstring(ast.parse(script.read_text())) or "").partition("\n")
        title = title.rstrip(".")
        _write(
            folder / f"{script.stem}.md",
            f"# {title}\n{text}\n\n```{{image}} {script.stem}.png\n:alt: {title}\n:class: picture\n```\n\n"
            f"```{{code-block}} text\n{done.stdout}```\n\n"
            f"```{{literalinclude}} ../../examples/{script.name}\n:language: python\n```\n",
        )
        index += f":::{{container}}\n[![]({script.stem}.png)]({script.stem}.md)\n\n[{title}]({script.stem}.md)\n:::\n"
    index += "::::\n\n```{toctree}\n:hidden:\n\n" + "\n".join(script.stem for script in scripts) + "\n```\n"
    _write(folder / "index.md", index)
    for page in set(folder.glob("*.*")) - {
        folder / f"{x}.{kind}" for x in ["index", *(s.stem for s in scripts)] for kind in ("md", "png")
    }:
        page.unlink()


def _write(path: Path, text: str) -> None:
    """Write where something changed, so that Sphinx reads only what is new."""
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect to Sphinx."""
    app.connect("builder-inited", _make, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
