"""`darboux schema`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def schema(
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Write it there instead of printing it.")
    ] = None,
) -> None:
    """Print the JSON schema of scenario files, by which editors complete and check them."""
    import json
    import sys

    from darboux import files, scenario

    text = json.dumps(scenario.schema(), indent=2) + "\n"
    if out is None:
        sys.stdout.write(text)
    else:
        with files.replacing(out) as temporary:
            temporary.write_text(text, encoding="utf-8")
