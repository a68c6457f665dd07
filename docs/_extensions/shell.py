"""The cell magic %%bash of the pages: what a command prints comes in one piece, without colours; a failure fails the page."""

from __future__ import annotations

import os
import subprocess
from typing import Any


def bash(_line: str, cell: str) -> None:
    """Run the cell's commands, stop at the first that fails, and print what they say."""
    plain = {name: value for name, value in os.environ.items() if name not in ("FORCE_COLOR", "CLICOLOR_FORCE")}
    command = ["bash", "-e", "-o", "pipefail", "-c", cell]
    done = subprocess.run(command, env=plain, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    print(done.stdout)  # noqa: T201  # that is what the page shows
    done.check_returncode()


def load_ipython_extension(ipython: Any) -> None:
    """Take the place of IPython's own."""
    ipython.register_magic_function(bash, "cell")
