"""The two exceptions of the library, a mistake in the input and a solve that did not converge; text that is safe to print."""

from __future__ import annotations

from typing import Any


def printable(text: str) -> str:
    """Return a text with everything escaped that steers a terminal or can't be seen: it may come from a file.

    These are control characters and line breaks, marks that turn the direction of writing, and bytes that are no text.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


class InvalidInput(ValueError):
    """Input that can't be used, said in one sentence: the field, what came, what is allowed, how to mend it."""

    def __init__(self, message: str) -> None:
        super().__init__(printable(message))


class NotConverged(RuntimeError):
    """A solve that found no equilibrium; ``solution`` holds what was reached, ``str()`` says why and what to try.

    ``solutions`` are all of a call that solves many.
    """

    def __init__(self, message: str, solution: Any = None, solutions: Any = ()) -> None:
        super().__init__(printable(message))
        self.solution, self.solutions = solution, solutions
