"""How a command ends that fails: one line on standard error, and an exit code."""

from __future__ import annotations

import sys
from contextlib import suppress

from .path_checks import printable

OUT_OF_MEMORY = "out of memory; lower the resolution, the texel density or the quality"


def with_notes(message: str, error: BaseException) -> str:
    """Return an error's message, and what its way up has added to it."""
    return "; ".join((message, *getattr(error, "__notes__", ())))


def fail(message: str, code: int) -> int:
    """Print an error; return the exit code."""
    with suppress(OSError, ValueError):  # nobody may read it: the exit code still says it
        print(f"error: {printable(message)}", file=sys.stderr, flush=True)  # noqa: T201
    return code
