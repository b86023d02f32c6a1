"""Who is to help with a bake, as the command line says it."""

from __future__ import annotations

from dataclasses import dataclass

from ..base import UsageError
from .path_checks import quoted

LOCAL = "local:"

MOST_WORKERS = 256
"""Workers on one machine."""


@dataclass(frozen=True)
class FarmSpec:
    """Workers that the bake starts.

    workers: Their number on this machine.
    """

    workers: int


def farm_spec(text: str) -> FarmSpec:
    """Read who is to help. Raises UsageError if nobody can be meant."""
    number = text.removeprefix(LOCAL)
    if number == text:
        raise UsageError(f"--farm {quoted(text)}: give {LOCAL}N, such as {LOCAL}4")
    workers = int(number) if number.isascii() and number.isdecimal() and len(number) < 9 else 0
    if not 1 <= workers <= MOST_WORKERS:
        raise UsageError(f"--farm {quoted(text)}: give a number of workers from 1 to {MOST_WORKERS}")
    return FarmSpec(workers)
