"""A problem as a TOML file, with units: read, checked, written."""

from __future__ import annotations

import re
from dataclasses import field
from pathlib import Path
from typing import Any

from darboux import checks, files
from darboux.checks import description
from darboux.errors import InvalidInput
from darboux.problem import Equilibrium

LARGEST = 300_000  # bytes of a scenario, which are read in well under a second; longer tables are CSV files beside it
# A key of more than sixteen parts: the parser's time grows with the square of that, and no scenario nests so deep.
TOO_DEEP = re.compile(r"""(?<![\w-])(?:(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*){16}""")

UNSUPPORTED = "the file names no supports: the rod is clamped at s = 0, at the origin and along z, and its end is free."


@description
class Scenario:
    """What a scenario file holds.

    ``problem``, and ``method`` where the file names one (else None: the solver of record); ``motion`` of that problem and
    ``motion_method`` where it states them; ``notes`` what the file leaves to defaults that may hide a mistake, in sentences.
    """

    problem: Equilibrium
    method: Any = None
    motion: Any = None
    motion_method: Any = None
    notes: tuple[str, ...] = field(default=(), compare=False)

    @property
    def toml(self) -> str:
        """The text of its file. Raises ``InvalidInput`` where a part is a Python function."""
        from darboux.scenario import writing

        return writing.toml(self.problem, self.method, self.motion, self.motion_method)

    def write(self, path: str | Path) -> None:
        """Write the file. Raises ``InvalidInput`` where a part is a Python function or the file can't be written."""
        text = self.toml
        if len(text) > LARGEST:
            raise InvalidInput(
                f"{path} would have {len(text) / 1e6:.3g} MB; a scenario has at most {LARGEST / 1e6:g}. Thin out its Tables."
            )
        with files.replacing(Path(path), text=True) as temporary:
            temporary.write_text(text, encoding="utf-8")


def write(problem: Equilibrium, path: str | Path, method: Any = None) -> None:
    """Write a problem, and the method where one is given, as a scenario file; errors as in ``Scenario.write``."""
    Scenario(problem, method).write(path)


def load(path: str | Path, *, anywhere: bool = False) -> Equilibrium:
    """Return the problem that a scenario file states.

    Arguments: ``path`` a TOML file; ``anywhere`` whether its tables may lie outside its own folder. Raises
    ``InvalidInput``, which names the file, the line, the field, what came and what is allowed.
    """
    return read(path, anywhere=anywhere).problem


def read(path: str | Path, *, anywhere: bool = False) -> Scenario:
    """Return the problem and the method that a scenario file states; arguments and errors as in ``load``."""
    file = Path(path)
    try:
        if not file.is_file():
            raise InvalidInput(f"{file} is no file; a new scenario is written by: darboux new cantilever.")
        if file.stat().st_size > LARGEST:
            raise InvalidInput(
                f"{file} has {file.stat().st_size / 1e6:.3g} MB; a scenario has at most {LARGEST / 1e6:g}. Put long tables into "
                "CSV files beside it, as in { table = 'radius.csv' }."
            )
        text = file.read_bytes().decode("utf-8-sig")
    except (OSError, ValueError) as error:
        if isinstance(error, InvalidInput):
            raise
        reason = error.strerror if isinstance(error, OSError) else "it is no UTF-8 text"
        raise InvalidInput(f"{file} can't be read: {reason}.") from None
    try:
        return parse(text, folder=file.parent, anywhere=anywhere)
    except InvalidInput as error:
        raise InvalidInput(f"{file}{', ' if str(error).startswith('line ') else ': '}{error}") from None


def parse(text: str, *, folder: Path | None = None, anywhere: bool = False) -> Scenario:
    """Return what the text of a scenario file states; ``folder`` is where its tables lie. Raises ``InvalidInput``."""
    import tomllib

    from pydantic import ValidationError

    from darboux.scenario import forms, sentences

    try:
        if TOO_DEEP.search(text):
            raise RecursionError
        data = tomllib.loads(text)
    except RecursionError:
        raise InvalidInput("it nests too deep; a scenario has tables in tables, and no more.") from None
    except ValueError as error:
        raise InvalidInput(sentences.of_toml(error, text)) from None
    try:
        given = forms.scenario().model_validate(data, context={"folder": folder, "anywhere": anywhere}).given
        problem, motion = forms.problem(given), given["motion"].given if "motion" in given else {}
        notes = () if "supports" in given or "ring" in given else (UNSUPPORTED,)
        return Scenario(problem, given.get("method"), forms.motion(problem, given), motion.get("method"), notes)
    except ValidationError as error:
        raise InvalidInput(sentences.sentence(error, text)) from None
    except InvalidInput as error:
        raise InvalidInput(sentences.located(error, text)) from None


def method(name: str, stated: Any = None, *, of_motion: bool = False) -> Any:
    """Return the method of that name: the one stated where it is of that kind, else with its own defaults."""
    from darboux.scenario import forms

    shapes = forms.MOTION_METHODS if of_motion else forms.METHODS
    names = {word: shape for shape in shapes for word in (shape.name, *shape.also)}
    name = next((shape.name for shape in shapes if shape.description == name), name)  # as sentences call it
    cls = names[checks.choice("the method", name, names)].cls
    return stated if type(stated) is cls else cls()


def schema() -> dict[str, Any]:
    """Return the JSON schema of scenario files."""
    from darboux.scenario import forms

    return forms.scenario().model_json_schema()  # type: ignore[no-any-return]
