"""How the command speaks: exit statuses, sentences on standard error, one JSON object on standard output."""

from __future__ import annotations

import importlib
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from darboux.errors import InvalidInput, NotConverged

if TYPE_CHECKING:
    from rich.console import Console

    from darboux.solution import EquilibriumSolution

NOT_CONVERGED, BAD_INPUT, OWN_FAULT, INTERRUPTED = 1, 2, 70, 130
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
        """Run, and exit with 0, 1 (not converged), 2 (bad input), 70 (a fault of darboux) or 130 (interrupted)."""
        words = list(sys.argv[1:] if args is None else args)
        debug, as_json = "--debug" in words, "--json" in words
        words = [word for word in words if word != "--debug"] or ["--help"]
        try:
            status = super().main(words, *rest, **options | {"standalone_mode": False}) or 0
        except Exception as error:
            if debug and not isinstance(error, typer.Exit | UsageError):
                raise
            code, sentence, status = _said(error)
            if as_json and not isinstance(error, NotConverged):  # that one has printed its own
                print_json({"status": code, "converged": False, "message": sentence})
            typer.echo(sentence, err=True)
        except KeyboardInterrupt:
            status = INTERRUPTED
        if status == INTERRUPTED:  # Typer's own way of saying it
            typer.echo("Interrupted.", err=True)
        sys.exit(status)


def _said(error: Exception) -> tuple[str, str, int]:
    """Return the word for programs, the sentence for people, and the exit status."""
    if isinstance(error, InvalidInput):
        return "invalid_input", f"InvalidInput: {error}", BAD_INPUT
    if isinstance(error, NotConverged):
        return "not_converged", f"NotConverged: {error}", NOT_CONVERGED
    if isinstance(error, UsageError):
        context = getattr(error, "ctx", None)
        path = context.command_path if context else "darboux"
        return "invalid_input", f"InvalidInput: {error.format_message().rstrip('.')}. See {path} --help.", BAD_INPUT
    return (
        "fault",
        f"A fault of darboux: {type(error).__name__}: {error}. Run it with --debug, and report it.",
        OWN_FAULT,
    )


def print_json(content: Any) -> None:
    """Print one JSON object; what is no number (nan, infinite) is null."""
    typer.echo(json.dumps(_plain(content), indent=2, allow_nan=False))


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
        screen.print(kept, markup=False)


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


def equilibrium(path: Path) -> EquilibriumSolution:
    """Return the equilibrium that a result holds."""
    from darboux import store
    from darboux.solution import EquilibriumSolution

    result = store.open(path)
    if not isinstance(result, EquilibriumSolution):
        raise InvalidInput(
            f"{path} is a motion, where an equilibrium is wanted; its records are variables of the NetCDF file."
        )
    return result


def console(err: bool = False) -> Console:
    """Return Rich's console for the screen."""
    from rich.console import Console

    return Console(stderr=err, highlight=False)
