"""Stages of a bake: their progress as a part of all of it, and how long each took."""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from typing import TypeVar

from .result import Progress, TexelPictures

T = TypeVar("T")


def staged(
    steps: Generator[float, None, T],
    stage: str,
    begin: float,
    end: float,
    pictures: TexelPictures | None = None,
) -> Generator[Progress, None, T]:
    """Run steps that yield the fraction they have done as one stage, from `begin` to `end` of the whole."""
    while True:
        try:
            fraction = next(steps)
        except StopIteration as done:
            result: T = done.value
            return result
        texels = None if pictures is None else pictures.next()
        yield Progress(stage, begin + (end - begin) * fraction, texels=texels)


@contextmanager
def timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Add the time that the block takes to a stage's."""
    started = time.perf_counter()
    try:
        yield
    finally:
        seconds[stage] = seconds.get(stage, 0.0) + time.perf_counter() - started
