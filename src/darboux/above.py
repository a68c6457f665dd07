"""What modules above do for those below, such as drawing and saving: called by name, so that imports run one way."""

from __future__ import annotations

import importlib
from typing import Any, TypeVar

Result = TypeVar("Result")

# "module:function" by name. `darboux/__init__.py` fills it, which loads none of them.
PLACES: dict[str, str] = {}


def call(name: str, /, *arguments: Any, **options: Any) -> Result:  # type: ignore[type-var]  # the caller says what it gets
    """Return what the function of that name returns; its module is loaded at the first call."""
    module, function = PLACES[name].split(":")
    return getattr(importlib.import_module(module), function)(*arguments, **options)  # type: ignore[no-any-return]
