"""The site opens from disk: a page that would load anything from elsewhere is a warning, and so fails the build."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.util import logging

LOADED = re.compile(
    r'<(?:script|img|iframe|link(?=[^>]*rel="(?:stylesheet|preload|icon)"))[^>]*(?:src|href)="(https?:)?//[^"]*"'
)


def _check(app: Sphinx, failure: Exception | None) -> None:
    if failure is None and app.builder.format == "html":
        for page in Path(app.outdir).rglob("*.html"):
            for found in LOADED.finditer(page.read_text()):
                logging.getLogger(__name__).warning("%s loads from elsewhere: %s", page.name, found.group())


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect to Sphinx."""
    app.connect("build-finished", _check)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
