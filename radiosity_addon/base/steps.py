"""Generators that touch Blender's data: they work between two `yield`s, so that a window stays alive."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, TypeVar

from .progress import Status

T = TypeVar("T")


def drain(steps: Generator[Any, None, T]) -> T:
    """Run steps to their end and return their result."""
    while True:
        try:
            next(steps)
        except StopIteration as done:
            result: T = done.value
            return result


def staged(
    steps: Generator[float, None, T], stage: str, begin: float, end: float
) -> Generator[Status, None, T]:
    """Run steps that yield the fraction they have done as a stage, from `begin` to `end` of the whole."""
    try:
        while True:
            try:
                fraction = next(steps)
            except StopIteration as done:
                result: T = done.value
                return result
            yield Status(stage, begin + (end - begin) * fraction)
    finally:
        steps.close()
