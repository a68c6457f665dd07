"""The one way a kernel is compiled: numba, cached on disk, the cache keyed on every kernel's source.

A public call that compiles says so in one line on standard error: before it starts, and how long it took.
"""

from __future__ import annotations

import functools
import hashlib
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numba
from numba.core.caching import CompileResultCacheImpl, FunctionCache, NullCache, _CacheLocator

OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}, "nogil": True}
Kernel = TypeVar("Kernel", bound=Callable[..., Any])
P = ParamSpec("P")
T = TypeVar("T")
FOLDER = Path(__file__).parent


def _digest_of_sources() -> str:
    """Numba keys a cached function on its own file only; kernels inline each other across files."""
    digest = hashlib.sha256()
    for path in sorted(FOLDER.glob("*.py")):
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _is_writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _user_cache() -> Path:
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "darboux"
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")) / "darboux"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "darboux"


def cache_folder() -> Path | None:
    """Return the first writable folder of: DARBOUX_CACHE, beside the kernels, the user's cache; else None."""
    chosen = os.environ.get("DARBOUX_CACHE")
    candidates = [Path(chosen)] if chosen else [FOLDER / "__pycache__"]
    try:
        candidates.append(_user_cache())
    except RuntimeError:  # no home folder: then there is no user's cache either
        pass
    return next((folder for folder in candidates if _is_writable(folder)), None)


STAMP = _digest_of_sources()
CACHE = cache_folder()


class _KernelLocator(_CacheLocator):  # type: ignore[misc]
    """Tells numba where a kernel's machine code lies and which sources it belongs to."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._line = function.__code__.co_firstlineno

    def get_cache_path(self) -> str:
        return str(CACHE)

    def get_source_stamp(self) -> str:
        return STAMP

    def get_disambiguator(self) -> str:
        return str(self._line)

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> _KernelLocator | None:
        return None if CACHE is None else cls(function)


class _KernelCacheImpl(CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = (_KernelLocator,)


class _KernelCache(FunctionCache):  # type: ignore[misc]
    _impl_class = _KernelCacheImpl

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        found = super().load_overload(sig, target_context)
        if found is None:
            _announce("once for this installation")
        return found


class _NoCache(NullCache):  # type: ignore[misc]
    def load_overload(self, sig: Any, target_context: Any) -> None:
        _announce("at every start, for no folder is writable: name one by the variable DARBOUX_CACHE")


def jit(function: Kernel) -> Kernel:
    """Compile a kernel at its first call and keep the machine code on disk where a folder is writable."""
    kernel: Any = numba.njit(**OPTIONS)(function)
    if hasattr(kernel, "_cache"):  # not where numba is told to compile nothing
        kernel._cache = _NoCache() if CACHE is None else _KernelCache(function)
    return kernel  # type: ignore[no-any-return]


def inline(function: Kernel) -> Kernel:
    """Compile a small helper that LLVM inlines into every kernel: nothing of it is cached on its own."""
    return numba.njit(forceinline=True, **OPTIONS)(function)  # type: ignore[no-any-return]


_calls = 0  # public calls that are running, one within another
_began = 0.0  # when the outermost of them first compiled; 0: not yet


def _announce(how_often: str) -> None:
    """Begin the line, if a public call is running and has not begun it."""
    global _began
    if _calls and not _began:
        _began = time.perf_counter()
        print(  # noqa: T201  # the one line that the library prints
            f"darboux: compiling its numerical kernels, {how_often}; this takes a minute or two ...",
            end="",
            file=sys.stderr,
            flush=True,
        )


def announced(function: Callable[P, T]) -> Callable[P, T]:
    """Let a public call say in one line on standard error that it compiles, and when it has returned, how long it took."""

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> T:
        global _calls, _began
        _calls += 1
        try:
            return function(*args, **kwargs)
        finally:
            _calls -= 1
            if _began and not _calls:
                print(f" {time.perf_counter() - _began:.0f} s.", file=sys.stderr, flush=True)  # noqa: T201
                _began = 0.0

    return call
