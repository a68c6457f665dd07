"""The two exceptions of the library: a mistake in the input, and a solve that did not converge."""

from __future__ import annotations

from typing import Any


class InvalidInput(ValueError):
    """Input that can't be used, said in one sentence: the field, what came, what is allowed, how to mend it."""


class NotConverged(RuntimeError):
    """A solve that found no equilibrium; ``solution`` holds what was reached, ``str()`` says why and what to try."""

    def __init__(self, message: str, solution: Any = None) -> None:
        super().__init__(message)
        self.solution = solution
