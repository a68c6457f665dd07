"""What is wrong with a scenario file, in one sentence: file, line, field, what came, what is allowed."""

from __future__ import annotations

import difflib
import re
from typing import Any

from pydantic import ValidationError

from darboux.checks import shown
from darboux.errors import InvalidInput

Place = tuple[str | int, ...]

MUST = {
    "bool_type": "it must be true or false",
    "int_type": "it must be a whole number",
    "string_type": "it must be a text",
    "list_type": "it must be a list",
}
HEADING = re.compile(r"\s*(\[\[?)\s*([\w\s.\"'-]+?)\s*\]\]?\s*(?:#.*)?")
KEY = re.compile(r"\s*([\w.\"'-]+)\s*=")
SUBJECT = re.compile(r"(?:problem\.)?\w+(?:\[\d+\]|\.\w+)*")  # with which the library's own sentences begin


def sentence(error: ValidationError, text: str) -> str:
    """Return what the first fault is, after the line that it stands in."""
    fault = error.errors(include_url=False)[0]
    place: Place = tuple(part for part in fault["loc"] if not str(part).startswith("<"))
    context = fault.get("ctx", {})
    words, place = _words(fault["type"], place, fault["input"], context, fault["msg"])
    return _after_line(words, place, text)


def located(error: InvalidInput, text: str) -> str:
    """Return a sentence of the library after the line that it speaks of."""
    return _after_line(str(error), _subject((), str(error)), text)


def _after_line(words: str, place: Place, text: str) -> str:
    line = _line(text, place)
    return f"line {line}: {words}" if line else words


def _words(kind: str, place: Place, came: Any, context: dict[str, Any], message: str) -> tuple[str, Place]:
    field, said = _field(place), shown(came)
    cause = context.get("error")
    match kind:
        case "unknown":
            key, allowed = str(context["key"]), context["allowed"]
            holder = field or "a scenario"
            return f"{_field((*place, key))} is not known; {holder} takes {', '.join(allowed)}.{_near(key, allowed)}", (
                *place,
                key,
            )
        case "without":
            return f"{field}.{context['key']} is missing; allowed are {_list(context['allowed'])}.", place
        case "choice":
            here = (*place, context["key"])
            allowed = context["allowed"]
            return (
                f"{_field(here)} is {shown(context['came'])}; allowed are {_list(allowed)}.{_near(context['came'], allowed)}",
                here,
            )
        case "missing":
            return f"{field} is missing; {_field(place[:-1]) or 'a scenario'} needs it.", place
        case "literal_error":
            allowed = re.findall(r"'([^']*)'", context["expected"])
            return f"{field} is {said}; allowed are {_list(allowed)}.{_near(came, allowed)}", place
        case "too_long":
            return f"{field} has {context['actual_length']} entries; at most {context['max_length']} are taken.", place
        case _ if isinstance(cause, InvalidInput):
            return str(cause), _subject(place, str(cause))
        case _ if cause is not None:
            return f"{field or 'a scenario'} is {said}; {cause}{'' if str(cause).endswith('?') else '.'}", place
    return f"{field} is {said}; {MUST.get(kind, message)}.", place


def _subject(place: Place, words: str) -> Place:
    """Return the place of the field that a sentence of the library begins with."""
    match = SUBJECT.match(words)
    parts = re.findall(r"\w+", match[0].removeprefix("problem.")) if match else []
    inner: Place = tuple(int(part) if part.isdigit() else part for part in parts)
    if not place:
        return ("supports", *inner) if inner[:1] in (("start",), ("end",)) else inner
    return (*place, *inner[1:])


def _field(place: Place) -> str:
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in place).removeprefix(".")


def _list(allowed: Any) -> str:
    return ", ".join(repr(word) for word in allowed)


def _near(came: Any, allowed: Any) -> str:
    words = {word.lower(): word for word in allowed}
    near = difflib.get_close_matches(str(came)[:100].lower(), list(words), n=1)
    return f" Did you mean {words[near[0]]!r}?" if near else ""


def _line(text: str, place: Place) -> int | None:
    """Return the line of the file that a place, or what holds it, begins in."""
    lines = _lines(text)
    return next((lines[place[:n]] for n in range(len(place), 0, -1) if place[:n] in lines), None)


def _lines(text: str) -> dict[Place, int]:
    """Return where each heading and each key stands."""
    lines: dict[Place, int] = {}
    entries: dict[Place, int] = {}
    table: Place = ()
    for number, line in enumerate(text.splitlines(), 1):
        if heading := HEADING.fullmatch(line):
            name: Place = ()
            for part in _parts(heading[2]):
                name += (part,)
                if name in entries and len(name) < len(_parts(heading[2])):
                    name += (entries[name],)
            if heading[1] == "[[":
                entries[name] = entries.get(name, -1) + 1
                name += (entries[name],)
            table = name
            lines.setdefault(table, number)
        elif key := KEY.match(line):
            lines.setdefault((*table, *_parts(key[1])), number)
    return lines


def _parts(name: str) -> tuple[str, ...]:
    return tuple(part.strip().strip("\"'") for part in name.split("."))
