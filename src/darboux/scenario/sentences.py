"""What is wrong with a scenario file, in one sentence: file, line, field, what came, what is allowed."""

from __future__ import annotations

import re
from typing import Any

from pydantic import ValidationError

from darboux.checks import did_you_mean, shown
from darboux.errors import InvalidInput

Place = tuple[str | int, ...]

QUOTES_OF_PRINT = re.compile("[\u2018\u2019\u201c\u201d\u201e\u00ab\u00bb]")  # which text editors put in

# Where keys belong that stand at the top of a file, or in its rod, by mistake.
HOMES = {
    "rod.material": ("E", "nu", "G", "density"),
    "rod.section": ("shape", "radius", "outer_radius", "inner_radius", "width", "height", "EI1", "EI2", "GJ", "EA"),
    "rod": ("length", "section", "material", "natural", "stretch", "shear"),
    "supports": ("start", "end", "between"),
    "motion": ("duration", "damping", "velocity", "release", "load_factor"),
}
MUST = {
    "bool_type": "it must be true or false",
    "int_type": "it must be a whole number",
    "string_type": "it must be a text",
    "list_type": "it must be a list",
}
HEADING = re.compile(r"\s*(\[\[?)\s*([\w\s.\"'-]+?)\s*\]\]?\s*(?:#.*)?")
KEY = re.compile(r"\s*([\w.\"'-]+)\s*=")
PLAIN_KEY = re.compile(r"[\w-]{1,60}")
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


def of_toml(error: ValueError, text: str) -> str:
    """Return why a text is not TOML, and what to write where that can be told."""
    message = str(error)
    at = re.search(r" \(at (?:line (\d+), column \d+|end of document)\)", message)
    if "digits" in message:
        return "it holds a whole number of thousands of digits, which is no quantity of a rod."
    if at is None:
        return f"it is not TOML: {message}."
    number = int(at[1]) if at[1] else len(text.splitlines())
    lines = text.splitlines()
    line = lines[number - 1].strip() if 0 < number <= len(lines) else ""
    if "Illegal character '\\n'" in message and number > 1:  # it is the line above that did not end
        number, line = number - (not line), line or lines[number - 2].strip()
    fault = message.replace(at[0], "").rstrip(".")
    return f"line {number}: {shown(line)} is not TOML ({_remedy(line, fault)})."


def _remedy(line: str, fault: str) -> str:
    """Return what is to be written in place of a line that can't be read, else the parser's words."""
    key, sign, value = (part.strip() for part in line.partition("="))
    bare = value.partition("#")[0].strip()
    if "twice" in fault or "overwrite" in fault.lower():
        return "this name is there already; state each table and each key once"
    if QUOTES_OF_PRINT.search(bare):
        return f"write straight quotes: {key} = {QUOTES_OF_PRINT.sub(chr(34), bare)}"
    if line.count('"') % 2:
        return "a quote is missing"
    if not sign and not line.startswith("["):
        return "write: name = value"
    if line.startswith("["):
        return "write [name] for a table, [[name]] for one of several loads"
    if bare.lower() in ("true", "false"):
        return f"write: {key} = {bare.lower()}"
    if re.fullmatch(r"[+-]?\d+,\d+", bare):
        return f"write a decimal point: {key} = {bare.replace(',', '.')}"
    if bare and not any(c in bare for c in "\"'[]{}"):
        return f'text, and a number with its unit, stands in quotes: {key} = "{bare}"'
    return fault[:1].lower() + fault[1:]


def _after_line(words: str, place: Place, text: str) -> str:
    line = _line(text, place)
    return f"line {line}: {words}" if line else words


def _words(kind: str, place: Place, came: Any, context: dict[str, Any], message: str) -> tuple[str, Place]:
    field, said = _field(place), shown(came)
    cause = context.get("error")
    match kind:
        case "unknown":
            key, allowed = str(context["key"]), context["allowed"]
            here = (*place, key)
            holder = field or "a scenario"
            return (
                f"{_field(here)} is not known; {holder} takes {', '.join(allowed)}.{_instead(place, key, allowed)}",
                here,
            )
        case "without":
            return f"{field}.{context['key']} is missing; allowed are {_list(context['allowed'])}.", place
        case "choice":
            here = (*place, context["key"])
            allowed = context["allowed"]
            hint = did_you_mean(context["came"], allowed)
            return f"{_field(here)} is {shown(context['came'])}; allowed are {_list(allowed)}.{hint}", here
        case "list_type" if isinstance(came, dict):
            return f"{field} is one table; write [[{field}]] in double brackets, once for each of them.", place
        case "missing":
            return f"{field} is missing; {_field(place[:-1]) or 'a scenario'} needs it.", place
        case "literal_error":
            allowed = re.findall(r"'([^']*)'", context["expected"])
            return f"{field} is {said}; allowed are {_list(allowed)}.{did_you_mean(came, allowed)}", place
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
    """Return a place as a file writes it; a key that is no plain word is quoted, and cut where it is long."""
    words = (part if isinstance(part, int) or PLAIN_KEY.fullmatch(part) else shown(part) for part in place)
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in words).removeprefix(".")


def _instead(place: Place, key: str, allowed: Any) -> str:
    """Return what may have been meant by a key that is not known, or where it belongs."""
    size = key.lower().replace("diameter", "radius")
    if size != key.lower() and size in allowed:
        return f" Write {size}, which is half of it."
    home = next((home for home, keys in HOMES.items() if key in keys), "")
    if home and place in ((), ("rod",)) and _field(place) != home:
        return f" It belongs into the table [{home}]."
    return did_you_mean(key, allowed)


def _list(allowed: Any) -> str:
    return ", ".join(repr(word) for word in allowed)


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
