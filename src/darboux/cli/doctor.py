"""`darboux doctor` and `darboux warmup`."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable
from typing import Any

import typer

from darboux.cli.shell import Json, Quiet, console, print_json, say
from darboux.errors import printable

SAME = 1e-7  # over L: two methods that share no code
THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def doctor(json: Json = False) -> None:
    """Check this installation: versions, threads, the kernels, and a self test; say how to mend what is wrong."""
    checks: list[tuple[str, Callable[[], str]]] = [
        ("darboux", _versions),
        ("packages", _packages),
        ("threads", _threads),
        ("kernels", _kernels),
        ("self test", _self_test),
    ]
    found: dict[str, dict[str, Any]] = {}
    screen = console()
    for name, check in checks:
        try:
            found[name] = {"fine": True, "words": check()}
        except (_Ill, ModuleNotFoundError) as illness:
            found[name] = {"fine": False, "words": str(illness)}
        if not json:
            mark = "[green]fine[/]" if found[name]["fine"] else "[red]mend[/]"
            screen.print(f"{mark}  {name}: ", end="")
            screen.print(printable(found[name]["words"]), markup=False)
    if json:
        print_json({"fine": all(part["fine"] for part in found.values()), "checks": found})
    if not all(part["fine"] for part in found.values()):
        raise typer.Exit(1)


def warmup(quiet: Quiet = False) -> None:
    """Compile every kernel once, so that the next solve is quick: some minutes, and nothing where it is done."""
    from darboux.kernels import jit

    if jit.AT_FIRST_CALL:
        jit.announced(_solve_by_all)()
    if not quiet:
        say(f"All kernels are compiled; {_kernels()}.")


class _Ill(Exception):  # noqa: N818  # a finding, not an error
    """What is wrong, and how to mend it."""


def _versions() -> str:
    import platform

    from darboux import __version__

    return f"{__version__}, Python {platform.python_version()}, {platform.system()} {platform.machine()}"


def _packages() -> str:
    from importlib import metadata

    from darboux.kernels import jit

    numba = ("numba",) if jit.AT_FIRST_CALL else ()
    names = ("numpy", "scipy", *numba, "matplotlib", "typer", "rich", "pydantic", "pint", "xarray", "h5netcdf", "h5py")
    versions, missing = [], []
    for name in names:
        try:
            versions.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            missing.append(name)
    if missing:
        raise _Ill(f"{', '.join(missing)} is missing; install it by: pip install {' '.join(missing)}")
    return ", ".join(versions)


def _threads() -> str:
    limits = [f"{name}={os.environ[name]}" for name in THREADS if name in os.environ]
    return f"{os.cpu_count()} cores; {', '.join(limits) or 'no limits set'}"


def _kernels() -> str:
    from darboux.kernels import built, jit

    if not jit.AT_FIRST_CALL:
        return f"they were compiled when darboux was built, for {built.processor()}, and lie in {built.FOLDER}"
    try:
        first_call = jit.first_call_module()
    except ModuleNotFoundError as error:
        raise _Ill(str(error)) from error
    if first_call.CACHE is None:
        raise _Ill(
            "no folder is writable, so kernels compile anew each time; name one by DARBOUX_CACHE=/a/folder/of/yours"
        )
    count = len(list(first_call.CACHE.glob("*.nbi")))
    words = f"they compile when they are first called; {count} are kept in {first_call.CACHE}"
    if not count:
        words += " (the first solve compiles; or: darboux warmup)"
    if built.is_too_new():
        words += f"; they were built for {built.V3}, which is newer than this processor: to mend it, {built.FOR_ALL}"
    return words


def _self_test() -> str:
    import time

    import numpy as np

    import darboux as dx

    began = time.perf_counter()
    problem = _problem()
    tips = [dx.solve(problem, method).tip for method in (dx.Collocation(), dx.Elastica())]
    gap = float(np.linalg.norm(tips[0] - tips[1])) / problem.rod.length
    if not gap < SAME:
        raise _Ill(f"two methods are {gap:.1e} L apart; install darboux anew, and report it if that does not help")
    return f"two methods that share no code agree to {gap:.0e} L, in {time.perf_counter() - began:.2g} s"


def _problem() -> Any:
    import darboux as dx

    rod = dx.Rod(length=0.25, section=dx.Circle(radius=1e-3), material=dx.Material(E=1e6, nu=0.5, density=1e3))
    return dx.Equilibrium(rod, start=dx.Clamped(tangent=(1, 0, 0)), loads=[dx.Gravity()])


def _methods() -> tuple[Any, ...]:
    import darboux as dx

    return dx.Collocation(), dx.Shooting(), dx.DiscreteRod(30)


def _solve_by_all() -> None:
    import darboux as dx

    for method in _methods():
        dx.solve(_problem(), method, throw=False)
    problem = dataclasses.replace(_problem(), rod=dataclasses.replace(_problem().rod, stretch=True))
    for method in (dx.ImplicitMidpoint(4), dx.TRBDF2(4), dx.StormerVerlet(4)):
        dx.simulate(dx.Motion(problem, 1e-3), method, records=1, throw=False)
