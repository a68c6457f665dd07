"""The one way a kernel is declared: `jit`, `allocating` where it makes arrays, or `inline` for a small helper.

Kernels compiled when darboux was built are taken where they match their sources and this processor; then numba is not even
imported. Elsewhere numba compiles them when they are first called, and the public call says so in one line on standard error:
before it compiles, and how long it took. DARBOUX_JIT=1 chooses the second way.
"""

from __future__ import annotations

import functools
import os
import sys
import time
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

from darboux.kernels import built

Kernel = TypeVar("Kernel", bound=Callable[..., Any])
P = ParamSpec("P")
T = TypeVar("T")


def _at_first_call() -> bool:
    """Whether kernels are compiled when they are first called; says so where those that were built are out of date."""
    if any(os.environ.get(name, "0") not in ("", "0") for name in ("DARBOUX_JIT", "NUMBA_DISABLE_JIT")):
        return True
    if built.processor():
        return built.is_too_new()
    if built.files():
        print(  # noqa: T201
            "darboux: its kernels were changed after they were built, so they compile when they are first called; "
            "build them anew by: make kernels",
            file=sys.stderr,
        )
    return True


AT_FIRST_CALL = _at_first_call()


def jit(function: Kernel) -> Kernel:
    """Declare a kernel that works in place: it makes no arrays and gets none, so that numba counts no references in it.

    Its annotations tell how it is called, see calling.py.
    """
    return _kernel(function, counts=False)


def allocating(function: Kernel) -> Kernel:
    """Declare a kernel that makes arrays, gets some from a kernel that it calls, or copies slices."""
    return _kernel(function, counts=True)


def _kernel(function: Kernel, counts: bool) -> Kernel:
    if not AT_FIRST_CALL:
        return built.kernel(function)  # type: ignore[no-any-return]
    return first_call_module().kernel(function, counts)  # type: ignore[no-any-return]


def inline(function: Kernel) -> Kernel:
    """Declare a small helper that is inlined into every kernel that calls it; it makes no arrays."""
    return first_call_module().helper(function) if AT_FIRST_CALL else function


def first_call_module() -> Any:
    """Return the module that compiles kernels at their first call, or say how to get them compiled where numba is missing."""
    try:
        from darboux.kernels import first_call
    except ModuleNotFoundError as error:
        if error.name != "numba":
            raise
        what, mend = "are not built", "in a source tree, make kernels"
        if built.is_too_new():
            what, mend = f"were built for {built.V3}, which is newer than this processor", built.FOR_ALL
        raise ModuleNotFoundError(
            f"the kernels of darboux {what}, and numba, which else compiles them when they are first called, "
            f"is not installed: pip install numba, or, {mend}",
            name="numba",
        ) from error
    return first_call


_calls = 0  # public calls that are running, one within another
_began = 0.0  # when the outermost of them first compiled; 0: not yet


def announce(how_often: str) -> None:
    """Begin the line that says that kernels compile, if a public call is running and has not begun it."""
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
