"""Work that yields the fraction it has done: run to its end, or as a part of more."""

from __future__ import annotations

from collections.abc import Generator
from typing import TypeVar

T = TypeVar("T")


def drain(steps: Generator[float, None, T]) -> T:
    """Run steps to their end and return their result."""
    while True:
        try:
            next(steps)
        except StopIteration as done:
            result: T = done.value
            return result


def scaled(steps: Generator[float, None, T], begin: float, end: float) -> Generator[float, None, T]:
    """Run steps as a part of a whole: their fractions go from `begin` to `end`."""
    while True:
        try:
            fraction = next(steps)
        except StopIteration as done:
            result: T = done.value
            return result
        yield begin + (end - begin) * fraction
