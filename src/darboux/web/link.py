"""A view as the query of a link, and back: which scenario, which values, the camera. Data only, bounded, checked."""

from __future__ import annotations

import base64
import binascii
import math
import re
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from urllib.parse import urlencode

from darboux.errors import InvalidInput
from darboux.web.quantities import MOST

LONGEST = 6000  # letters of a link, which browsers and servers take
LONGEST_TEXT = 60_000  # letters of a scenario that a link may carry, unpacked
CAMERA = 7  # numbers: the direction from which one looks, the point looked at, the height of the picture in m
KEY = re.compile(r"[A-Za-z0-9_.]{1,40}")


@dataclass(frozen=True)
class View:
    """What a link says: the name of a ``scenario`` of this server or the ``text`` of one, ``values`` in SI by key, the rest."""

    scenario: str = ""
    text: str = ""
    values: dict[str, float] = field(default_factory=dict)
    camera: tuple[float, ...] = ()
    theories: bool = False
    dark: bool | None = None


def query(view: View) -> str:
    """Return the query of a link to this view. Raises ``InvalidInput`` where it would be too long."""
    parts = {"text": _packed(view.text)} if view.text else {"scenario": view.scenario}
    parts |= {key: repr(value) for key, value in view.values.items()}
    if view.camera:
        parts["camera"] = ",".join(f"{number:.5g}" for number in view.camera)
    parts |= {"theories": "1"} if view.theories else {}
    parts |= {} if view.dark is None else {"dark": str(int(view.dark))}
    text = urlencode(parts)
    if len(text) > LONGEST:
        raise InvalidInput("this scenario is too long for a link; save it, and send the file.")
    return text


def view(parameters: Mapping[str, str]) -> View:
    """Return the view that a link's parameters describe. Raises ``InvalidInput`` for what is none."""
    if sum(map(len, parameters.values())) > LONGEST or len(parameters) > MOST + 6:
        raise InvalidInput("the link is too long; the page shows its first scenario instead.")
    rest = dict(parameters)
    scenario, text, dark = rest.pop("scenario", ""), rest.pop("text", ""), rest.pop("dark", "")
    theories, camera = rest.pop("theories", "") == "1", rest.pop("camera", "")
    values = {}
    for key, value in rest.items():
        if not KEY.fullmatch(key):
            raise InvalidInput(f"the link has a part {key[:40]!r}, which no scenario has.")
        values[key] = _number(key, value)
    numbers = tuple(_number("camera", value) for value in camera.split(",")) if camera else ()
    if numbers and (len(numbers) != CAMERA or not any(numbers[:3]) or numbers[6] <= 0.0):
        raise InvalidInput("the link's camera is not seven numbers; the whole rod is shown.")
    return View(scenario, _unpacked(text), values, numbers, theories, dark == "1" if dark in ("0", "1") else None)


def _number(key: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InvalidInput(f"the link's {key} is {text[:40]!r}; it must be a number.")
    return value


def _packed(text: str) -> str:
    return base64.urlsafe_b64encode(zlib.compress(text.encode(), 9)).decode()


def _unpacked(text: str) -> str:
    if not text:
        return ""
    try:
        unpacking = zlib.decompressobj()
        data = unpacking.decompress(base64.urlsafe_b64decode(text), LONGEST_TEXT)
        if unpacking.unconsumed_tail or not unpacking.eof:
            raise InvalidInput("the link's scenario is longer than a link's may be, or cut off.")
        return data.decode()
    except (binascii.Error, zlib.error, ValueError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput("the link's scenario can't be read; perhaps a part of the link was lost.") from None
