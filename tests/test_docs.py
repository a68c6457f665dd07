"""What the site must name: every public class and function, every module; `make docs` itself runs in continuous integration."""

from __future__ import annotations

import ast
import importlib
import re
import tomllib
from pathlib import Path

import pytest

import darboux as dx
from darboux import above

DOCS = Path(__file__).parent.parent / "docs"
REFERENCE = "\n".join(page.read_text() for page in sorted((DOCS / "reference").glob("*.md")))
SOURCE = Path(dx.__file__).parent
CONTRACTS = tomllib.loads((DOCS.parent / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]


@pytest.mark.parametrize("name", [*dx.__all__, "open"])
def test_a_public_name_is_in_the_reference(name: str) -> None:
    listed = re.findall(
        rf"auto(?:class|function):: darboux\.{name}$|py:data:: darboux\.{name}$", REFERENCE, re.MULTILINE
    )
    assert len(listed) == 1, f"{name} belongs into one page of docs/reference/, once"


def test_the_architecture_names_every_module() -> None:
    text = (DOCS / "architecture.md").read_text()
    modules = {path.stem for path in SOURCE.iterdir() if path.suffix in ("", ".py") and not path.name.startswith("__")}
    missing = {name for name in modules if not re.search(rf"`{name}(?:\.py|/)`", text)}
    assert not missing, f"docs/architecture.md does not say what {sorted(missing)} is for"


def test_every_how_to_checks_a_number_and_has_a_picture() -> None:
    pages = [page for page in (DOCS / "how_to").glob("*.md") if page.stem != "index"]
    assert len(pages) >= 13
    for page in pages:
        text = page.read_text()
        assert re.search(r"^\s*assert ", text, re.MULTILINE), f"{page.name} asserts nothing"
        assert "plt.show()" in text, f"{page.name} has no picture"
        assert page.stem in (DOCS / "how_to" / "index.md").read_text().split()


def test_a_method_stands_on_its_floor() -> None:
    """The contract that keeps methods apart knows them by their modules' names, and not those that nobody gave it."""
    layers = next(x["layers"] for x in CONTRACTS if x["name"] == "Methods do not import one another")
    methods = {name for name in dx.__all__ if hasattr(getattr(dx, name), "refuses")}
    modules = {getattr(dx, name).__module__.rpartition(".")[2] for name in methods}
    missing = modules - set(re.findall(r"\w+", layers[1]))
    assert not missing, f"pyproject.toml: {sorted(missing)} belong into the contract, on the floor {layers[1]}"


def test_no_contract_has_exceptions() -> None:
    assert not [contract["name"] for contract in CONTRACTS if "ignore_imports" in contract]


OF_ROD = {"compliance", "stiffness", "k0", "mass", "natural", "section", "material"}
OF_PROBLEM = {"distributed", "end_load", "points", "point_of"}
OF_SUPPORT = {
    "held_displacement",
    "held_rotation",
    "displacement_axes",
    "rotation_axes",
    "sliding",
    "linear",
    "rotational",
}
OF_LOAD = {"add_distributed", "add_end", "add_point", "at_shape", "gradients"}
OWN_FOOTING = {"elastica", "elastica_plane", "heavy_elastica"}  # which uses no packing
SENTENCES = {"limits"}  # why a problem is refused, in the words and units of its description


def reads_a_description(node: ast.AST) -> bool:
    """Whether a node of a source is rod.compliance, problem.rod.k0, problem.distributed, support.held_rotation, ..."""
    if not isinstance(node, ast.Attribute):
        return False
    owner = ast.unparse(node.value).rpartition(".")[2]
    of_owner = {"rod": OF_ROD, "problem": OF_PROBLEM}.get(owner, set())
    return node.attr in OF_SUPPORT | OF_LOAD | of_owner


def test_methods_read_packed_numbers_and_no_description() -> None:
    found = {
        path.stem
        for folder in ("statics", "dynamics")
        for path in (SOURCE / folder).glob("*.py")
        if any(reads_a_description(node) for node in ast.walk(ast.parse(path.read_text())))
    }
    assert not found - OWN_FOOTING - SENTENCES


def test_no_method_asks_a_description_for_its_class() -> None:
    modules = [importlib.import_module(f"darboux.{name}") for name in ("loads", "supports", "section", "natural")]
    classes = {name for module in modules for name, value in vars(module).items() if isinstance(value, type)}
    for folder in ("statics", "dynamics", "packing"):
        for path in (SOURCE / folder).glob("*.py"):
            for call in (node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)):
                if isinstance(call.func, ast.Name) and call.func.id in ("isinstance", "issubclass"):
                    asked = {node.id for node in ast.walk(call.args[1]) if isinstance(node, ast.Name)}
                    assert not asked & classes, f"{path.name}, line {call.lineno}"


def test_what_is_called_by_name_is_there_and_nothing_else() -> None:
    source = "".join(path.read_text() for path in SOURCE.rglob("*.py"))
    assert set(re.findall(r'above\.call\("(\w+)"', source)) == set(above.PLACES)
    for place in above.PLACES.values():
        module, function = place.split(":")
        assert callable(getattr(importlib.import_module(module), function)), place
