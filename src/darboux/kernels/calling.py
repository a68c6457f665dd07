"""How kernels are compiled, and how Python calls one that is: by its numbers and arrays one after another.

A kernel's annotations tell which they are: int, float, bool, arrays, and tuples of these with or without names. An
array has one dimension unless its annotation counts others: np.ndarray[tuple[int, int], np.dtype[np.float64]].
"""

from __future__ import annotations

import functools
import typing
from collections.abc import Iterator
from typing import Any

import numpy as np

OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}, "nogil": True}


@functools.cache
def hints(of: Any) -> dict[str, Any]:
    """Return the annotations of a kernel or of a named tuple."""
    return typing.get_type_hints(of)


def parts(hint: Any, name: str) -> Iterator[tuple[str, str]]:
    """Yield an argument's numbers and arrays, each as an expression with its type: ("state.x", "float64[::1]")."""
    for suffix, kind in _parts(hint):
        yield name + suffix, kind


@functools.cache
def _parts(hint: Any) -> tuple[tuple[str, str], ...]:
    if hint in (int, float, bool):
        return (("", hint.__name__),)
    if hasattr(hint, "_fields"):
        return tuple(part for name, inner in hints(hint).items() for part in parts(inner, f".{name}"))
    if typing.get_origin(hint) is tuple:
        return tuple(part for i, inner in enumerate(typing.get_args(hint)) for part in parts(inner, f"[{i}]"))
    if typing.get_origin(hint) is np.ndarray:
        shape, dtype = typing.get_args(hint)
        colons = "".join(":, " for length in typing.get_args(shape)[1:] if length is int)
        return (("", f"{np.dtype(typing.get_args(dtype)[0]).name}[{colons}::1]"),)
    raise TypeError(f"a kernel that Python calls can't take {hint}; see {__name__}")
