"""What the validation tests are given."""

from __future__ import annotations

import pytest

from tests.validation.judging import Judge


@pytest.fixture
def judge(record_property) -> Judge:
    """The judge of a test; what it compares goes into the page that `make validate` writes."""
    return Judge(record_property)
