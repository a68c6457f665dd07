"""How the command speaks: exit statuses, sentences on standard error, one JSON object on standard output."""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from darboux import checks, files
from darboux.errors import InvalidInput, NotConverged, printable

if TYPE_CHECKING:
    from rich.console import Console

    from darboux.scenario import Scenario
    from darboux.solution import EquilibriumSolution
    from darboux.trajectory import Trajectory

NOT_CONVERGED, BAD_INPUT, OWN_FAULT, CIRCUMSTANCE, INTERRUPTED, CLOSED = 1, 2, 70, 74, 130, 141
NO_ROOM = (
    "allocate memory",
    "failed to map segment",
    "can't start new thread",
    "out of memory",
)  # of libraries that load
RESULT, SCENARIO = ".nc", ".toml"
# The next step for a person at the command, by how a solve or a run ended; Python's is in `solution.ADVICE`.
ADVICE = {
    "folded": "Lower the load; --out keeps the last equilibrium. Python's darboux.solve_all looks for those at full load.",
    "no_convergence": "--out keeps what was reached.",
}
UsageError: Any = typer.BadParameter.__base__

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but mistakes.")]
Anywhere = Annotated[bool, typer.Option("--anywhere", help="Let the scenario's tables lie outside its folder.")]
KeptIn = Annotated[
    Path | None, typer.Option("--out", metavar="RESULT", help="Keep the result, as in --out result.nc (NetCDF).")
]
ScenarioFile = Annotated[Path, typer.Argument(metavar="FILE", help="A scenario, such as hanging.toml.")]
ResultOrScenario = Annotated[
    Path,
    typer.Argument(metavar="RESULT|FILE", help="A result, such as hanging.nc, or a scenario, which is solved."),
]
ResultFile = Annotated[Path, typer.Argument(metavar="RESULT", help="A result, such as hanging.nc.")]


class Command(TyperGroup):
    """The command with its mistakes in words; a traceback only by --debug, which may stand anywhere."""

    def main(self, args: Sequence[str] | None = None, *rest: Any, **options: Any) -> NoReturn:
        """Run, and exit with 0, 1 (not converged), 2 (bad input), 70 (a fault of darboux), 74 (disk, memory) or 130."""
        words = list(sys.argv[1:] if args is None else args)
        debug, as_json = "--debug" in words, "--json" in words
        words = [word for word in words if word != "--debug"] or ["--help"]
        for name in ("stdout", "stderr"):
            stream = getattr(sys, name)
            if stream is None:  # it was closed
                setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115  # to the end
            elif hasattr(stream, "reconfigure"):  # letters that a terminal lacks are escaped
                stream.reconfigure(errors="backslashreplace")
        try:
            status = super().main(words, *rest, **options | {"standalone_mode": False}) or 0
            sys.stdout.flush()
        except Exception as error:
            if debug and not isinstance(error, typer.Exit | UsageError):
                raise
            status = _told(error, as_json)
        except KeyboardInterrupt:
            status = INTERRUPTED
        if status == INTERRUPTED:  # Typer's own way of saying it
            say("Interrupted.", err=True)
        _close()
        sys.exit(status)

    def invoke(self, ctx: Any) -> Any:
        """Run a verb; where nobody reads on, as behind head, it ends without a word."""
        try:
            return super().invoke(ctx)
        except BrokenPipeError:
            raise typer.Exit(CLOSED) from None


def _told(error: Exception, as_json: bool) -> int:
    """Say what went wrong, and return the exit status."""
    code, sentence, status = _said(error)
    try:
        if status == CLOSED:
            return status
        if as_json and code not in ("not_converged", "output"):  # the first has printed its own
            print_json({"status": code, "converged": False, "message": sentence})
            sys.stdout.flush()
    except OSError as broken:
        code, sentence, status = _said(broken)
    with contextlib.suppress(OSError):
        if status != CLOSED:
            say(printable(sentence), err=True)
    return status


def _said(error: Exception) -> tuple[str, str, int]:
    """Return the word for programs, the sentence for people, and the exit status."""
    if isinstance(error, InvalidInput):
        return "invalid_input", f"InvalidInput: {error}", BAD_INPUT
    if isinstance(error, NotConverged):
        advice = ADVICE.get(error.solution.status.code, "") if error.solution is not None else ""
        return "not_converged", f"NotConverged: {error} {advice}".rstrip(), NOT_CONVERGED
    if isinstance(error, UsageError):
        context = getattr(error, "ctx", None)
        path = context.command_path if context else "darboux"
        return "invalid_input", f"InvalidInput: {error.format_message().rstrip('.')}. See {path} --help.", BAD_INPUT
    if isinstance(error, BrokenPipeError):
        return "output", "", CLOSED  # whoever reads has enough, as head has
    if isinstance(error, MemoryError) or any(words in str(error) for words in NO_ROOM):
        return (
            "memory",
            "There is not enough memory; close other programs, lift the limit, or ask for fewer segments or records.",
            CIRCUMSTANCE,
        )
    if isinstance(error, ImportError) or (isinstance(error, OSError) and error.errno is None):
        return (
            "fault",
            f"A library can't be loaded ({str(error)[:200]}): there is too little memory, or the installation is damaged; see "
            "darboux doctor.",
            CIRCUMSTANCE,
        )
    if isinstance(error, OSError):
        what = error.filename or "standard output"
        return (
            "output",
            f"{what} can't be read or written ({files.reason(error)}); make room, or choose another.",
            CIRCUMSTANCE,
        )
    return (
        "fault",
        f"A fault of darboux: {type(error).__name__}: {error}. Run it with --debug, and report it.",
        OWN_FAULT,
    )


def _close() -> None:
    """Let nothing be left to write when Python ends, where what can't be written would be a traceback."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            with contextlib.suppress(OSError, ValueError, AttributeError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def say(text: str, err: bool = False) -> None:
    """Print lines of text; here everything that may come from a file or a name enters the terminal, escaped."""
    lines = "\n".join(map(printable, text.split("\n"))) + "\n"
    (sys.stderr if err else sys.stdout).write(lines)


def print_json(content: Any) -> None:
    """Print one JSON object; what is no number (nan, infinite) is null."""
    sys.stdout.write(json.dumps(_plain(content), indent=2, allow_nan=False) + "\n")


def show(report: str, result: Any, title: str, seconds: float, as_json: bool, quiet: bool, kept: str) -> None:
    """Print a result as the module `report` words it: one JSON object, or a table, a picture and where it is kept."""
    if quiet and not as_json:
        return
    words = importlib.import_module(f"darboux.cli.{report}")
    if as_json:
        print_json(words.content(result, seconds))
        return
    screen = console()
    screen.print(words.table(result, title, seconds))
    screen.print(words.picture(result, screen), markup=False)
    if kept:
        screen.print(printable(kept), markup=False)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items()}
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    if isinstance(value, float):
        return value if abs(value) < float("inf") else None
    return value


def scenario_of(file: Path, anywhere: bool = False) -> Scenario:
    """Return what a scenario file states; a default that may hide a mistake is a warning on standard error."""
    from darboux import scenario

    try:
        stated = scenario.read(file, anywhere=anywhere)
    except InvalidInput:
        _check_there(file, "a new scenario is written by: darboux new cantilever")
        if _is_result(file):
            raise InvalidInput(
                f"{file} is a result, not a scenario; draw it by: darboux plot {file}, or see its scenario by: darboux info {file}."
            ) from None
        raise
    for note in stated.notes:
        say(f"warning: {note}", err=True)
    return stated


def result_of(file: Path) -> EquilibriumSolution | Trajectory:
    """Return what a result holds."""
    from darboux import store

    try:
        return store.open(file)  # type: ignore[no-any-return]
    except InvalidInput:
        _check_there(file, f"a result is written by: darboux solve FILE --out {file.name}")
        if not _is_result(file) and file.suffix.lower() == SCENARIO:
            raise InvalidInput(
                f"{file} is a scenario, not a result; solve it first by: darboux solve {file} --out {file.with_suffix(RESULT)}."
            ) from None
        raise


def _is_result(file: Path) -> bool:
    from darboux import store

    try:
        with file.open("rb") as content:
            return content.read(len(store.SIGNATURE)) == store.SIGNATURE
    except OSError:
        return False


def _check_there(file: Path, otherwise: str) -> None:
    """Raise ``InvalidInput`` where there is no such file, with names that are there and nearly the same."""
    if file.is_file():
        return
    part = files.part_of(file)
    if part.is_file():
        raise InvalidInput(f"{file} is no file. {files.unfinished(part)}")
    with contextlib.suppress(OSError):
        names = [entry.name for entry in file.parent.iterdir() if entry.suffix in (SCENARIO, RESULT)]
        if near := checks.did_you_mean(file.name, names):
            raise InvalidInput(f"{file} is no file.{near}")
    raise InvalidInput(f"{file} is no file; {otherwise}.")


def check_result(out: Path | None, *inputs: Path | None) -> None:
    """Raise ``InvalidInput`` where --out is no name for a result, before anything is computed: it must not destroy anything."""
    if out is None:
        return
    for file in inputs:
        if file is not None and out.exists() and file.exists() and out.samefile(file):
            raise InvalidInput(f"--out is {out}, which is the scenario itself; write --out {file.stem}-result{RESULT}.")
    if out.suffix.lower() == SCENARIO:
        raise InvalidInput(f"--out is {out}, but a result is no scenario; write --out {out.stem}{RESULT}.")
    from darboux import store

    files.check(out, store.SIGNATURE)


def console(err: bool = False) -> Console:
    """Return Rich's console for the screen."""
    from rich.console import Console

    return Console(stderr=err, highlight=False)
