"""The list of mutants is up to date; `make mutants` runs them."""

from __future__ import annotations

import re

import pytest

from tests.tools.mutants import MUTANTS, ROOT


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: f"{mutant.file}: {mutant.text.strip()[:40]}")
def test_its_text_still_stands_in_its_file(mutant) -> None:
    assert mutant.found(ROOT), f"{mutant.path} has no longer, or more than once: {mutant.text!r}"
    assert mutant.changed != mutant.text
    path, name = mutant.test.split("::")
    assert f"def {name}(" in (ROOT / "tests" / path).read_text()


def test_every_kernel_has_mutants() -> None:
    paths = (ROOT / "src/darboux/kernels").glob("*.py")
    kernels = {
        f"kernels/{path.name}"
        for path in paths
        if re.search("^@(jit|allocating|inline)$", path.read_text(), re.MULTILINE)
    }
    assert kernels <= {mutant.file for mutant in MUTANTS}
    assert len(MUTANTS) >= 20
