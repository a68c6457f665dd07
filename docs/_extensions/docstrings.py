"""Our docstrings as reStructuredText: their formulas stay as typed, their arguments become a list.

A docstring is plain text: an indented paragraph is a formula, ``name`` is code, and signs such as | and * are themselves.
"""

from __future__ import annotations

import inspect
import re
from typing import Any

from sphinx.application import Sphinx

CODE = re.compile(r"(``.+?``|`.+?`)")


def _escaped(text: str) -> str:
    """Return a paragraph in which only code has a meaning of its own."""
    parts = CODE.split(text)
    return "".join(part if i % 2 else re.sub(r"([|*_\\])", r"\\\1", part) for i, part in enumerate(parts))


def _names(what: str, thing: Any) -> list[str]:
    if what not in ("class", "function", "method"):
        return []
    try:
        return list(inspect.signature(thing).parameters)
    except (TypeError, ValueError):
        return []


def _paragraph(text: str, names: list[str]) -> list[str]:
    """Return a paragraph, its arguments as a list where it says what they are."""
    found = re.search(r"(?:^|(?<=\. ))Arguments?(?:, by name)?: ", text)
    if found is None or not names:
        return [_escaped(text), ""]
    before, arguments = text[: found.start()], text[found.end() :]
    after = ""
    if ends := re.search(r"(?<=\.) ((?:Raises|Returns|Conservative|Source)\b.*)", arguments):
        arguments, after = arguments[: ends.start()], ends.group(1)
    items = re.split(rf"[;,] (?:and |or )?(?=``(?:{'|'.join(map(re.escape, names))})``)", arguments)
    lines = [_escaped(before.strip()), ""] if before.strip() else []
    lines += ["**Arguments**", "", *(f"* {_escaped(item.strip())}" for item in items), ""]
    return lines + ([_escaped(after), ""] if after else [])


def _rewritten(_app: Sphinx, what: str, _name: str, thing: Any, _options: Any, lines: list[str]) -> None:
    blocks = re.split(r"\n[ \t]*\n", "\n".join(lines).strip("\n"))
    names, result = _names(what, thing), []
    for block in blocks:
        if block.startswith(" "):
            result += [
                ".. code-block:: text",
                "",
                *(f"    {line}" for line in inspect.cleandoc(block).splitlines()),
                "",
            ]
        elif block.strip():
            result += _paragraph(" ".join(line.strip() for line in block.splitlines()), names)
    lines[:] = result


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect to Sphinx."""
    app.connect("autodoc-process-docstring", _rewritten)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
