"""Compile all public kernels ahead of time, by numba.pycc: this is the only file that knows it.

    python -m darboux.kernels.build

The machine code is for x86-64-v3 (AVX2 and FMA) where this processor has that, and else for every one of its kind.
DARBOUX_CPU names another as LLVM does, says "generic" for every one, or "host" for this one. When darboux is imported it looks
whether the processor has x86-64-v3, and at nothing else that DARBOUX_CPU may name.
"""

from __future__ import annotations

import functools
import importlib
import os
import subprocess
import sys
import sysconfig
import time
import typing
import warnings
from concurrent.futures import ThreadPoolExecutor
from itertools import repeat
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any

from darboux.kernels import built, calling

HELPERS = "darboux_kernels"
NUMBA = {"int": "int64", "float": "float64", "bool": "boolean"}


@functools.cache
def has_compiler() -> bool:
    """Whether numba, a compiler for C and C++ and Python's headers are at hand, and nobody said DARBOUX_JIT=1."""
    headers = Path(sysconfig.get_path("include"), "Python.h")
    if os.environ.get("DARBOUX_JIT", "0") not in ("", "0") or not headers.exists():
        return False
    try:
        from numba.pycc.platform import external_compiler_works
    except ImportError:
        return False
    return bool(external_compiler_works())


def processor() -> str:
    """Return the processor to build for."""
    return os.environ.get("DARBOUX_CPU") or (built.V3 if built.has_v3() else "generic")


def build() -> list[Path]:
    """Compile each module whose sources or processor have changed, remove what belongs to others, and return the files."""
    files = {name: built.file(name, processor()) for name in built.modules()}
    for old in built.files():
        if old not in files.values():
            old.unlink()
    anew = processor() == "host"  # which need not be the same one as before
    missing = [name for name, file in files.items() if anew or not file.exists()]
    missing.sort(key=lambda name: -(built.FOLDER / f"{name}.py").stat().st_size)  # the longest first
    if missing:
        names = ", ".join(missing)
        _say(f"darboux: compiling its numerical kernels for {processor()} ({names}); some minutes, once ...")
        with TemporaryDirectory() as folder, ThreadPoolExecutor(os.cpu_count()) as pool:
            for line in pool.map(_in_a_process, missing, repeat(_helpers(folder))):
                _say(line)
    return list(files.values())


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)  # noqa: T201


def _helpers(folder: str) -> list[str]:
    """Compile numba's own C files, the same for all modules, and return the object files."""
    from numba.pycc import CC

    objects: list[str] = CC(HELPERS)._compile_mixins(folder)
    return objects


def _in_a_process(name: str, helpers: list[str]) -> str:
    """Compile one module in a process of its own, for numba compiles one function at a time."""
    began = time.perf_counter()
    path = os.pathsep.join(filter(None, [str(built.FOLDER.parents[1]), os.environ.get("PYTHONPATH")]))
    # By these numba compiles what kernels call for the same processor, and makes vectors of four numbers, see fours.py.
    target = {} if processor() == "host" else {"NUMBA_CPU_NAME": processor(), "NUMBA_CPU_FEATURES": ""}
    target["NUMBA_SLP_VECTORIZE"] = "1"
    done = subprocess.run(
        [sys.executable, "-m", "darboux.kernels.build", name, *helpers],
        env=os.environ | target | {"PYTHONPATH": path, "DARBOUX_JIT": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(f"kernels/{name}.py could not be compiled; DARBOUX_JIT=1 does without:\n{done.stdout}")
    return f"  {name}: {time.perf_counter() - began:.0f} s"


def _compile(name: str, helpers: list[str]) -> None:
    """Compile one module and those that are in its extension, to be linked with numba's helpers."""
    warnings.simplefilter("ignore")  # that pycc may be replaced one day
    from numba.core import compiler
    from numba.pycc import CC
    from numba.pycc import compiler as pycc

    def flags() -> Any:
        made = compiler.Flags()
        made.release_gil = True
        return made

    pycc.Flags = flags  # there is no option for it
    parts = [part for part, home in built.homes().items() if home == name]
    modules = {part: importlib.import_module(f"darboux.kernels.{part}") for part in parts}
    _leave_out_what_python_calls()
    extension = CC(built.extension(name), source_module=modules[name])
    extension.target_cpu = processor()
    extension.output_dir = str(built.FOLDER)
    extension.output_file = built.file(name, processor()).name
    for part, module in modules.items():
        for word, kernel in vars(module).items():
            if _is_public(kernel, word, module):
                signature, flat = _flat(kernel)
                extension.export(built.word(part, word), signature)(flat)
    extension._compile_mixins = lambda _: helpers
    extension._init_function = f"pycc_init_{HELPERS}"
    extension.compile()


def _is_public(kernel: Any, name: str, module: ModuleType) -> bool:
    is_kernel = hasattr(kernel, "py_func") and not kernel.targetoptions.get("forceinline")
    return is_kernel and not name.startswith("_") and bool(kernel.py_func.__module__ == module.__name__)


def _leave_out_what_python_calls() -> None:
    """Kernels that only kernels call need no wrapper and no cache."""
    from numba.core.caching import NullCache

    for module in [module for name, module in sys.modules.items() if name.startswith("darboux.kernels.")]:
        for kernel in vars(module).values():
            if hasattr(kernel, "py_func"):
                kernel._cache = NullCache()
                kernel.targetoptions |= {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def _flat(kernel: Any) -> tuple[str, Any]:
    """Return the signature and the function that takes a kernel's numbers and arrays one after another."""
    hints = dict(calling.hints(kernel.py_func))
    returned = hints.pop("return")
    kinds: list[str] = []
    names: dict[str, Any] = {"kernel_": kernel}

    def whole(hint: Any, name: str) -> str:
        """Return the expression that puts an argument together from a0, a1, ..."""
        if hasattr(hint, "_fields"):
            names[hint.__name__] = hint
            inner = [whole(part, f"{name}.{field}") for field, part in calling.hints(hint).items()]
            return f"{hint.__name__}({', '.join(inner)})"
        if typing.get_origin(hint) is tuple:
            return f"({''.join(whole(part, name) + ', ' for part in typing.get_args(hint))})"
        ((_, kind),) = calling.parts(hint, name)
        kinds.append(kind)
        return f"a{len(kinds) - 1}"

    call = f"kernel_({', '.join(whole(hint, name) for name, hint in hints.items())})"
    lines = [f"def flat({', '.join(f'a{i}' for i in range(len(kinds)))}):", f"    r = {call}"]
    lines += [f"    return ({''.join(f'r[{i}], ' for i in range(len(getattr(returned, '_fields', ()))))})"]
    if not hasattr(returned, "_fields"):
        lines[-1] = "    return r"
    exec("\n".join(lines), names)
    signature = ", ".join(NUMBA.get(kind, kind.replace("bool[", "boolean[")) for kind in kinds)
    return f"({signature},)", names["flat"]


if __name__ == "__main__":
    if len(sys.argv) > 1:
        _compile(sys.argv[1], sys.argv[2:])
    elif has_compiler():
        build()
    else:
        _say("darboux: no compiler for C and C++ works here; its kernels compile when they are first called.")
