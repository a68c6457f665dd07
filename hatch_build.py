"""What hatchling does for darboux: where a C compiler is at hand, a wheel holds the kernels compiled; else it needs numba.

An editable install holds nothing compiled: `make`, or `python -m darboux.kernels.build`, builds in the source tree.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

sys.path.insert(0, str(Path(__file__).parent / "src"))

from darboux.kernels import build


class Dependencies(MetadataHookInterface):
    """The dependencies listed in pyproject.toml, and numba where nothing is compiled ahead of time."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Set the dependencies."""
        numba = [] if build.has_compiler() else metadata["optional-dependencies"]["jit"]
        metadata["dependencies"] = [*self.config["dependencies"], *numba]


class Kernels(BuildHookInterface):
    """The compiled kernels, which make the wheel one for this platform and this Python."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile the kernels and add them to the wheel."""
        if not build.has_compiler():
            return
        if version == "editable":
            build_data["dependencies"] += self.metadata.core.optional_dependencies["jit"]
            return
        for file in build.build():
            build_data["force_include"][str(file)] = f"darboux/kernels/{file.name}"
        build_data["pure_python"] = False
        build_data["infer_tag"] = True
