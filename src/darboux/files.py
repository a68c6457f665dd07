"""Files are written whole or not at all."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from darboux.errors import InvalidInput


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Lend a temporary name in the same folder and rename it at the end, so that a kill never leaves half a file.

    Raises ``InvalidInput`` where the folder or the file can't be written.
    """
    try:
        with tempfile.TemporaryDirectory(prefix=".darboux-", dir=path.parent) as folder:
            temporary = Path(folder) / path.name
            yield temporary
            temporary.replace(path)
    except OSError as error:
        raise InvalidInput(
            f"{path} can't be written ({error.strerror or error}); make room, or choose another place."
        ) from None
