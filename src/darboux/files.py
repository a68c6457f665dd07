"""Files are written whole or not at all."""

from __future__ import annotations

import errno
import os
import shutil
import signal
import stat
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from darboux.errors import InvalidInput

SIGNATURE = 4  # bytes that tell what kind of file it is


def check(path: Path, begins: bytes = b"") -> None:
    """Raise ``InvalidInput`` where a file can't be written or must not be, before much is computed for it.

    ``begins`` are the first bytes of what will be written; a file that is there and begins otherwise is another's.
    """
    try:
        found = target(path, begins)
        with tempfile.TemporaryFile(dir=found.parent):
            pass
    except OSError as error:
        raise refusal(path, error) from None


def target(path: Path, begins: bytes = b"") -> Path:
    """Return the file that a path leads to, through its links; raises ``InvalidInput`` as ``check`` where it must be kept."""
    try:
        found = _target(path)
        _spare(path, found, begins)
    except OSError as error:
        raise refusal(path, error) from None
    return found


def part_of(path: Path) -> Path:
    """Return what the result of a motion is called until its run ends."""
    return path.parent / f"{path.name}.part"


def unfinished(part: Path) -> str:
    """Return the sentence for a run that was broken off, by a kill for one."""
    return (
        f"{part} holds a run that was broken off, or still goes on; continue it (in Python: simulate(..., "
        f"start_from=darboux.open({part.name!r})); the command: darboux simulate FILE --continue {part.name}), or delete it."
    )


def _target(path: Path) -> Path:
    """Return the file that a path leads to, through its links, whether it is there or not."""
    try:
        return path.resolve()
    except RuntimeError:  # links in a circle
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP)) from None


def _spare(path: Path, target: Path, begins: bytes) -> None:
    """Raise ``InvalidInput`` where what is there is not ours to replace; ``begins`` is empty where any text may be."""
    try:
        mode = target.stat().st_mode
    except FileNotFoundError:
        return
    if not stat.S_ISREG(mode):
        what = "a folder" if stat.S_ISDIR(mode) else "a device or a pipe"
        raise InvalidInput(f"{path} is {what}, which darboux does not replace; give the name of a file.")
    if not os.access(target, os.W_OK):
        raise InvalidInput(f"{path} is write-protected; choose another name, or allow writing to it.")
    with target.open("rb") as file:
        old = file.read(SIGNATURE)
    if begins and old and old != begins[: len(old)]:
        raise InvalidInput(
            f"{path} is there already and is another kind of file than would be written; choose another name, or delete it "
            "first."
        )


def reserve(path: Path, size: int) -> None:
    """Take the room of a file of so many bytes; raises ``OSError`` where there is not so much."""
    with path.open("wb") as file:
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(file.fileno(), 0, size)
        elif shutil.disk_usage(path.parent).free < size:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@contextmanager
def replacing(path: Path, text: bool = False) -> Iterator[Path]:
    """Lend a temporary name in the same folder and rename it at the end, so that a kill never leaves half a file.

    A link is followed: the file that it leads to is replaced, and keeps its permissions. Only a regular file is replaced,
    and one that begins as the new one does, unless it is ``text`` that people write too. Ctrl-C waits until the file is
    written. Raises ``InvalidInput`` where the folder or the file can't be written, or is another's.
    """
    found = target(path)  # before it is written for nothing
    try:
        with patient(), tempfile.TemporaryDirectory(prefix=".darboux-", dir=found.parent) as folder:
            temporary = Path(folder) / path.name  # its ending says to some libraries what to write
            yield temporary
            with temporary.open("rb") as file:
                _spare(path, found, b"" if text else file.read(SIGNATURE))
            if found.exists():
                shutil.copymode(found, temporary)
            temporary.replace(found)
    except OSError as error:
        raise refusal(path, error) from None


@contextmanager
def patient() -> Iterator[None]:
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
    """Return why a file can't be written, and how to mend it."""
    if not path.parent.is_dir():
        return InvalidInput(
            f"{path} can't be written: there is no folder {path.parent}; make it, or choose another place."
        )
    mend = "make room" if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG) else "allow it"
    return InvalidInput(f"{path} can't be written ({reason(error)}); {mend}, or choose another place.")


def reason(error: OSError) -> str:
    """Return what the system says, in its own few words: libraries put their state in as well."""
    return os.strerror(error.errno) if error.errno else str(error)
