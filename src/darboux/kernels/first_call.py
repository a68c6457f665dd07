"""Kernels compiled by numba when they are first called, kept on disk, the cache keyed on every kernel's source.

This is the way of a source tree that was not built; see jit.py.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import CompileResultCacheImpl, FunctionCache, NullCache, _CacheLocator

from darboux.kernels import calling, jit

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
            jit.announce("once for this installation")
        return found


class _NoCache(NullCache):  # type: ignore[misc]
    def load_overload(self, sig: Any, target_context: Any) -> None:
        jit.announce("at every start, for no folder is writable: name one by the variable DARBOUX_CACHE")


def kernel(function: Callable[..., Any], counts: bool) -> Any:
    """Compile a kernel at its first call and keep the machine code on disk where a folder is writable.

    ``counts``: whether it counts who refers to an array, which takes time and which only those need that make arrays.
    """
    dispatcher: Any = numba.njit(_nrt=counts, **calling.OPTIONS)(function)
    if hasattr(dispatcher, "_cache"):  # not where numba is told to compile nothing
        dispatcher._cache = _NoCache() if CACHE is None else _KernelCache(function)
    return dispatcher


def helper(function: Callable[..., Any]) -> Any:
    """Compile a small helper that LLVM inlines into every kernel: nothing of it is cached on its own."""
    return numba.njit(forceinline=True, _nrt=False, **calling.OPTIONS)(function)
