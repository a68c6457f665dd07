"""Kernels that were compiled when darboux was built: whether they are there, and how Python calls them.

A module that no other imports has an extension module beside it, `_path_0a1b2c3d4e5f.x86-64-v3` for path.py, which holds the
kernels of the modules that it imports too: compiled together they are compiled once. Its name holds
the digest of the sources that it was made from, so that another state of the sources does not find it, and the processor that
it was made for, as LLVM calls it: what was made for x86-64-v3 is not taken on a processor that is older.

The compiled function takes numbers and arrays one after another, see calling.py; `kernel` makes the function that takes
tuples apart, and looks at each array: the compiled function trusts that it is contiguous and of its type.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.machinery
import importlib.util
import re
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from darboux.kernels import calling

FOLDER = Path(__file__).parent
SUFFIX = importlib.machinery.EXTENSION_SUFFIXES[0]
V3 = "x86-64-v3"
FOR_ALL = "in a copy of the repository, DARBOUX_CPU=generic pip install ."  # how to build for every processor
TOOLS = {"built", "build", "first_call", "jit"}  # of them calling.py alone has a part in what comes out
TYPES = {"float64": np.dtype(np.float64), "int64": np.dtype(np.int64), "bool": np.dtype(np.bool_)}
PUBLIC = re.compile(r"^@(?:jit|allocating)\ndef (?!_)", re.MULTILINE)
IMPORTED = re.compile(r"^from darboux\.kernels(?:\.(\w+) import|\s+import ([\w, ]+))", re.MULTILINE)


@functools.cache
def _sources() -> dict[str, bytes]:
    return {path.stem: path.read_bytes().replace(b"\r\n", b"\n") for path in sorted(FOLDER.glob("*.py"))}


@functools.cache
def reached(name: str) -> frozenset[str]:
    """Return the modules that a module of kernels is made from: itself, those it imports, and so on."""
    imports = IMPORTED.findall(_sources()[name].decode())
    words = {word.split()[0] for found in imports for word in (found[0] or found[1]).split(",")} & _sources().keys()
    return frozenset({name}).union(*(reached(other) for other in words - TOOLS))


@functools.cache
def homes() -> dict[str, str]:
    """Return the modules that have public kernels, each with the module in whose extension these are: one that no other imports."""
    public = [name for name, source in _sources().items() if PUBLIC.search(source.decode())]
    above = {name: [other for other in public if other != name and name in reached(other)] for name in public}
    return {name: next((other for other in above[name] if not above[other]), name) for name in public}


def _homed(name: str) -> list[bytes]:
    """Return the names of what an extension holds."""
    return [part.encode() for part, home in homes().items() if home == name]


@functools.cache
def modules() -> dict[str, str]:
    """Return the modules with an extension module beside them, each with the digest of all sources that it is made from."""
    digests = {name: hashlib.sha256(source).digest() for name, source in _sources().items()}
    made_from = {name: sorted(reached(name) | {"calling"}) for name in sorted(set(homes().values()))}
    return {
        name: hashlib.sha256(b"".join([*(digests[each] for each in parts), *_homed(name)])).hexdigest()[:12]
        for name, parts in made_from.items()
    }


def extension(name: str) -> str:
    """Return the name of the extension module of a module of kernels."""
    return f"_{name}_{modules()[name]}"


def word(module: str, kernel: str) -> str:
    """Return what a kernel is called in its extension module."""
    return f"{module}_{kernel}"


def file(name: str, processor: str) -> Path:
    """Return where it lies, built for a processor."""
    return FOLDER / f"{extension(name)}.{processor}{SUFFIX}"


def files() -> list[Path]:
    """Return all extension modules, of whatever sources and for whatever processor."""
    return list(FOLDER.glob(f"_*{SUFFIX}"))


@functools.cache
def processor() -> str | None:
    """Return the processor that all kernels were built for from today's sources, or None where they were not."""
    found = sorted({path.name.removesuffix(SUFFIX).rpartition(".")[2] for path in files()})
    return next((each for each in found if all(file(name, each).exists() for name in modules())), None)


def has_v3() -> bool:
    """Whether this processor has the instructions of x86-64-v3; not where NumPy does not tell."""
    try:
        from numpy._core._multiarray_umath import __cpu_features__ as features  # type: ignore[import-not-found]
    except ImportError:
        return False
    # Not every NumPy lists the others (BMI1, BMI2, LZCNT, MOVBE); no processor came with these three and without them.
    return all(features.get(name, False) for name in ("AVX2", "F16C", "FMA3"))


def is_too_new() -> bool:
    """Whether the kernels were built for a newer processor than this one."""
    return processor() == V3 and not has_v3()


@functools.cache
def _loaded(name: str) -> ModuleType:
    path = file(name, processor() or "")
    spec = importlib.util.spec_from_file_location(f"darboux.kernels.{extension(name)}", path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} is no extension module")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def kernel(function: Callable[..., Any]) -> Any:
    """Return the function by which Python calls the compiled kernel; a private one is called by kernels only."""
    if function.__name__.startswith("_"):
        return function
    hints = dict(calling.hints(function))
    returned = hints.pop("return")
    call = ", ".join(text for name, hint in hints.items() for text, _ in calling.parts(hint, name))
    module = function.__module__.rpartition(".")[2]
    names = {
        "built_": getattr(_loaded(homes()[module]), word(module, function.__name__)),
        "returned_": returned,
        "refuse_": functools.partial(_refuse, hints),
    }
    lines = [
        f"def {function.__name__}({', '.join(hints)}):",
        f"    if not ({' and '.join(_fits(hint, name, names) for name, hint in hints.items())}):",
        f"        refuse_({', '.join(hints)})",
        f"    return {f'returned_(*built_({call}))' if hasattr(returned, '_fields') else f'built_({call})'}",
    ]
    exec("\n".join(lines), names)
    made: Any = functools.wraps(function)(names[function.__name__])
    made.__defaults__ = getattr(function, "__defaults__", None)
    return made


def _fits(hint: Any, name: str, names: dict[str, Any]) -> str:
    """Return the expression that an argument's arrays are, at a glance, what the kernel takes; add what it calls."""
    if hasattr(hint, "_fields"):
        names[f"fit_{hint.__name__}"] = _fit(hint)
        return f"fit_{hint.__name__}({name})"
    arrays = [(text, kind) for text, kind in calling.parts(hint, name) if kind.endswith("]")]
    names |= {f"{kind}_": dtype for kind, dtype in TYPES.items()}
    looks = [f"{text}.dtype is {kind.partition('[')[0]}_ and {_shape(text, kind)}" for text, kind in arrays]
    return " and ".join(looks) or "True"


@functools.cache
def _fit(hint: Any) -> Any:
    """Return the function that looks at a named tuple."""
    names: dict[str, Any] = {}
    looks = [_fits(inner, f"x.{name}", names) for name, inner in calling.hints(hint).items()]
    exec(f"def fit(x): return {' and '.join(looks)}", names)
    return names["fit"]


def _shape(text: str, kind: str) -> str:
    """Return the expression that an array is contiguous: the quicker one, true of nearly all, where one is enough."""
    many = kind.count(":") - 1
    size = TYPES[kind.partition("[")[0]].itemsize
    if many > 1:
        return f"{text}.ndim == {many} and {text}.flags.c_contiguous"
    return f"({text}.strides == ({size},) or {text}.shape == (0,))"  # an empty array may have any stride


def _refuse(hints: dict[str, Any], *arguments: Any) -> None:
    """Raise TypeError for an array that a compiled kernel can't read; return where all are fine at a closer look."""
    given = dict(zip(hints, arguments, strict=True))
    for text, kind in [part for name, hint in hints.items() for part in calling.parts(hint, name)]:
        if kind.endswith("]"):
            a, dtype, many = eval(text, given), TYPES[kind.partition("[")[0]], kind.count(":") - 1
            if not (isinstance(a, np.ndarray) and a.dtype == dtype and a.ndim == many and a.flags.c_contiguous):
                what = f"{a.dtype} {a.shape}, strides {a.strides}" if isinstance(a, np.ndarray) else type(a).__name__
                raise TypeError(f"{text} is {what}; the kernel takes a contiguous array of {dtype}, dimensions: {many}")
