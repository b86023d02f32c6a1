"""Refusing values read from a file: of another type or shape, out of range, not finite, out of bounds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

LARGE = 1e15
"""Radiometric values and coordinates beyond this are no scene's."""

SHARE_TOLERANCE = 1e-3
"""Rounding that shares may miss 0, 1 or a sum of 1 by."""

T = TypeVar("T")


def instance(value: Any, kind: type[T]) -> T:
    """Return a value; refuse one of another class."""
    if not isinstance(value, kind):
        raise ValueError(f"a {type(value).__name__} in place of a {kind.__name__}")
    return value


def require(right: Any, what: str) -> None:
    """Refuse a condition that does not hold."""
    if not right:
        raise ValueError(what)


def array_of(value: Any, kinds: str, shape: Sequence[int]) -> None:
    """Refuse what is not an array of one of some kinds of numbers, and of this shape."""
    if not isinstance(value, np.ndarray) or value.dtype.kind not in kinds or value.shape != tuple(shape):
        raise ValueError("an array of another type or shape")


def integers(value: Any, shape: Sequence[int], low: int, high: int) -> None:
    """Refuse what are not integers of a shape within [low, high]."""
    array_of(value, "i", shape)
    if value.size and not (low <= value.min() and value.max() <= high):
        raise ValueError("an index out of bounds")


def numbers(value: Any, shape: Sequence[int], low: float, high: float = LARGE) -> None:
    """Refuse what are not finite numbers of a shape within [low, high]."""
    array_of(value, "f", shape)
    # NaN fails both. In a narrower type, the bounds would overflow.
    if value.size and not (low <= float(value.min()) and float(value.max()) <= high):
        raise ValueError("a value out of range")


def whole(value: Any, low: int, high: int) -> None:
    """Refuse what is not an integer within [low, high]."""
    if type(value) is not int or not low <= value <= high:
        raise ValueError("a number out of range")


def number(value: Any, low: float) -> None:
    """Refuse what is not a finite number from `low`."""
    if type(value) not in (int, float) or not low <= value <= LARGE:
        raise ValueError("a number out of range")
