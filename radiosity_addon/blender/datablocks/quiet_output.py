"""Keep what other people's code prints off the terminal."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def silenced() -> Iterator[None]:
    """Drop what the block prints, by Python or C, on standard output or error."""
    with Path(os.devnull).open("w", encoding="utf-8") as null:
        saved = _redirected(null.fileno())
        streams = sys.stdout, sys.stderr
        sys.stdout = sys.stderr = null
        try:
            yield
        finally:
            sys.stdout, sys.stderr = streams
            _forget_handlers(null)
            null.flush()
            for descriptor, original in saved:
                os.dup2(original, descriptor)
                os.close(original)


def _redirected(target: int) -> list[tuple[int, int]]:
    """Lead descriptors 1 and 2 to a file; returns each with a copy of what it was."""
    saved = []
    for stream, descriptor in ((sys.stdout, 1), (sys.stderr, 2)):
        with suppress(OSError, ValueError, AttributeError):
            stream.flush()
        with suppress(OSError):  # a process without it
            saved.append((descriptor, os.dup(descriptor)))
            os.dup2(target, descriptor)
    return saved


def _forget_handlers(stream: object) -> None:
    """Take loggers' handlers that were made meanwhile away: their stream is about to be closed."""
    for logger in list(logging.root.manager.loggerDict.values()):
        for handler in list(getattr(logger, "handlers", ())):
            if getattr(handler, "stream", None) is stream:
                logger.removeHandler(handler)  # type: ignore[union-attr]
