"""The one way a kernel is compiled: numba, cached on disk, the cache keyed on every kernel's source."""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core.caching import CompileResultCacheImpl, FunctionCache, _CacheLocator

OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}, "nogil": True}
Kernel = TypeVar("Kernel", bound=Callable[..., Any])
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


def jit(function: Kernel) -> Kernel:
    """Compile a kernel at its first call and keep the machine code on disk where a folder is writable."""
    kernel: Any = numba.njit(**OPTIONS)(function)
    if CACHE is not None and hasattr(kernel, "_cache"):
        kernel._cache = _KernelCache(function)
    return kernel  # type: ignore[no-any-return]


def inline(function: Kernel) -> Kernel:
    """Compile a small helper that LLVM inlines into every kernel: nothing of it is cached on its own."""
    return numba.njit(forceinline=True, **OPTIONS)(function)  # type: ignore[no-any-return]
