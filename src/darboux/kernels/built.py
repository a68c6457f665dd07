"""Kernels that were compiled when darboux was built: whether they are there, and how Python calls them.

Each module with public kernels has an extension module beside it, `_band_0a1b2c3d4e5f` for band.py. Its name ends in the
digest of the sources that it was made from, so that another state of the sources does not find it.

A kernel's annotations say how it is called: int, float, bool, arrays, and tuples of these with or without names. An
array has one dimension unless its annotation counts others: np.ndarray[tuple[int, int], np.dtype[np.float64]]. The
compiled function takes the numbers and arrays one after another; `kernel` makes the function that takes tuples apart,
and looks at each array: the compiled function trusts that it is contiguous and of its type.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.machinery
import importlib.util
import re
import typing
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

FOLDER = Path(__file__).parent
SUFFIX = importlib.machinery.EXTENSION_SUFFIXES[0]
TYPES = {"float64": np.dtype(np.float64), "int64": np.dtype(np.int64), "bool": np.dtype(np.bool_)}
PUBLIC = re.compile(r"^@jit\ndef (?!_)", re.MULTILINE)
IMPORTED = re.compile(r"^from darboux\.kernels(?:\.(\w+) import|\s+import ([\w, ]+))", re.MULTILINE)


@functools.cache
def modules() -> dict[str, str]:
    """Return the modules that have public kernels, each with the digest of all sources that it is made from."""
    sources = {path.stem: path.read_bytes().replace(b"\r\n", b"\n") for path in sorted(FOLDER.glob("*.py"))}
    texts = {name: source.decode() for name, source in sources.items()}
    digests = {name: hashlib.sha256(source).digest() for name, source in sources.items()}
    imports = {
        name: {word.strip() for found in IMPORTED.findall(text) for word in (found[0] or found[1]).split(",")}
        for name, text in texts.items()
    }
    found = {}
    for name, text in texts.items():
        if PUBLIC.search(text):
            reached: set[str] = set()
            waiting = {name}
            while waiting:
                reached |= waiting
                waiting = {other for each in waiting for other in imports[each] & sources.keys()} - reached
            digest = hashlib.sha256(b"".join(digests[each] for each in sorted(reached)))
            found[name] = digest.hexdigest()[:12]
    return found


def extension(name: str) -> str:
    """Return the name of the extension module of a module of kernels."""
    return f"_{name}_{modules()[name]}"


def file(name: str) -> Path:
    """Return where it lies."""
    return FOLDER / (extension(name) + SUFFIX)


def is_whole() -> bool:
    """Whether all kernels were built from today's sources."""
    return all(file(name).exists() for name in modules())


def is_stale() -> bool:
    """Whether some were built from other sources."""
    return any(FOLDER.glob(f"_*{SUFFIX}"))


@functools.cache
def _loaded(name: str) -> ModuleType:
    full = f"darboux.kernels.{extension(name)}"
    spec = importlib.util.spec_from_file_location(full, file(name))
    if spec is None or spec.loader is None:
        raise ImportError(f"{file(name)} is no extension module")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def parts(hint: Any, name: str) -> Iterator[tuple[str, str]]:
    """Yield an argument's numbers and arrays, each as an expression with its type: ("state.x", "float64[::1]")."""
    if hint in (int, float, bool):
        yield name, hint.__name__
    elif hasattr(hint, "_fields"):
        for field, part in typing.get_type_hints(hint).items():
            yield from parts(part, f"{name}.{field}")
    elif typing.get_origin(hint) is tuple:
        for i, part in enumerate(typing.get_args(hint)):
            yield from parts(part, f"{name}[{i}]")
    elif typing.get_origin(hint) is np.ndarray:
        shape, dtype = typing.get_args(hint)
        lengths = typing.get_args(shape)
        colons = "".join(":, " for length in lengths[1:] if length is int)
        yield name, f"{np.dtype(typing.get_args(dtype)[0]).name}[{colons}::1]"
    else:
        raise TypeError(f"{name}: a kernel that Python calls can't take {hint}; see {__name__}")


def hints(function: Callable[..., Any]) -> dict[str, Any]:
    """Return the annotations of a kernel's arguments, then that of what it returns."""
    return typing.get_type_hints(function)


def kernel(function: Callable[..., Any]) -> Any:
    """Return the function by which Python calls the compiled kernel; a private one is called by kernels only."""
    if function.__name__.startswith("_"):
        return function
    found = hints(function)
    returned = found.pop("return")
    flat = [part for name, hint in found.items() for part in parts(hint, name)]
    arrays = [(text, kind.partition("[")[0], kind.count(":") - 1) for text, kind in flat if kind.endswith("]")]
    looks = [  # nearly always all there is to see
        f"{text}.dtype is {kind}_ and {text}.ndim == {many} and {text}.flags.c_contiguous"
        if many > 1
        else f"{text}.dtype is {kind}_ and {text}.strides == {(TYPES[kind].itemsize,)}"
        for text, kind, many in arrays
    ]
    call = f"built_({', '.join(text for text, _ in flat)})"
    lines = [
        f"def {function.__name__}({', '.join(found)}):",
        f"    if not ({' and '.join(looks) or True}):",
        f"        look_(({''.join(f'({text!r}, {text}, {kind}_, {many}), ' for text, kind, many in arrays)}))",
        f"    return {f'returned_(*{call})' if hasattr(returned, '_fields') else call}",
    ]
    names: dict[str, Any] = {f"{kind}_": dtype for kind, dtype in TYPES.items()}
    module = _loaded(function.__module__.rpartition(".")[2])
    names |= {"look_": _look, "built_": getattr(module, function.__name__), "returned_": returned}
    exec("\n".join(lines), names)
    made: Any = functools.wraps(function)(names[function.__name__])
    made.__defaults__ = getattr(function, "__defaults__", None)
    return made


def _look(arrays: tuple[tuple[str, Any, np.dtype[Any], int], ...]) -> None:
    """Raise TypeError for an array that a compiled kernel can't read."""
    for name, a, dtype, many in arrays:
        if not (isinstance(a, np.ndarray) and a.dtype == dtype and a.ndim == many and a.flags.c_contiguous):
            what = f"{a.dtype} {a.shape}, strides {a.strides}" if isinstance(a, np.ndarray) else type(a).__name__
            raise TypeError(f"{name} is {what}; the kernel takes a contiguous array of {dtype}, dimensions: {many}")
