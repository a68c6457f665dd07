"""Files are written whole or not at all."""

from __future__ import annotations

import errno
import os
import shutil
import signal
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from darboux.errors import InvalidInput


def check(path: Path) -> None:
    """Raise ``InvalidInput`` where a file can't be written, before much is computed for it."""
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise refusal(path, error) from None


def reserve(path: Path, size: int) -> None:
    """Take the room of a file of so many bytes; raises ``OSError`` where there is not so much."""
    with path.open("wb") as file:
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(file.fileno(), 0, size)
        elif shutil.disk_usage(path.parent).free < size:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Lend a temporary name in the same folder and rename it at the end, so that a kill never leaves half a file.

    Ctrl-C waits until the file is written. Raises ``InvalidInput`` where the folder or the file can't be written.
    """
    try:
        with _patient(), tempfile.TemporaryDirectory(prefix=".darboux-", dir=path.parent) as folder:
            temporary = Path(folder) / path.name
            yield temporary
            temporary.replace(path)
    except OSError as error:
        raise refusal(path, error) from None


@contextmanager
def _patient() -> Iterator[None]:
    """Hold Ctrl-C back to the end."""
    if threading.current_thread() is not threading.main_thread():  # only that one hears it
        yield
        return
    held_back: list[int] = []
    handler = signal.signal(signal.SIGINT, lambda number, _: held_back.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
    if held_back:
        raise KeyboardInterrupt


def refusal(path: Path, error: OSError) -> InvalidInput:
    """Return why a file can't be written."""
    return InvalidInput(f"{path} can't be written ({reason(error)}); make room, or choose another place.")


def reason(error: OSError) -> str:
    """Return what the system says, in its own few words: libraries put their state in as well."""
    return os.strerror(error.errno) if error.errno else str(error)
