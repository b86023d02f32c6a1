"""The progress of long work: one object, passed down to all parts of it, which also cancels them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

T = TypeVar("T")


class Cancelled(BaseException):
    """Nobody wants the work any more. Not an `Exception`: it is not handled, only cleaned up after."""


@dataclass(frozen=True)
class Status:
    """Where a job is.

    fraction: Of the whole job, 0 to 1.
    picture: What the result looks like so far, now and then; else None.
    """

    stage: str
    fraction: float
    picture: Any = None


@dataclass(frozen=True, eq=False, repr=False)
class Progress:
    """Reports the progress of work to a listener. May be used from any thread.

    listener: Takes a `Status`. Raises `Cancelled` to stop the work. None: nobody listens.
    name: The stage.
    begin, end: The part of the whole that the work is.
    look: Makes the picture, or None, of what is shown to `at`, or of None.
    in_window: Whether a window is drawn meanwhile: no step may hold Python's lock for long.
    """

    listener: Callable[[Status], None] | None = None
    name: str = ""
    begin: float = 0.0
    end: float = 1.0
    look: Callable[[Any], Any] | None = None
    in_window: bool = False

    def at(self, fraction: float, shown: object = None) -> None:
        """Say that a fraction of this part, 0 to 1, is done; `shown` is what a picture can be made of.

        Raises Cancelled if the job was canceled.
        """
        if self.listener is not None:
            picture = None if self.look is None else self.look(shown)
            self.listener(Status(self.name, self._of_whole(fraction), picture))

    def part(self, begin: float, end: float) -> Progress:
        """Return the progress of work that goes from one fraction of this part to another."""
        return replace(self, begin=self._of_whole(begin), end=self._of_whole(end))

    def stage(
        self, name: str, begin: float, end: float, look: Callable[[Any], Any] | None = None
    ) -> Progress:
        """Return the progress of a stage, which has a name and perhaps pictures."""
        return replace(self.part(begin, end), name=name, look=look)

    def each(self, items: Sequence[T]) -> Iterator[tuple[T, Progress]]:
        """Go through items that take equally long, each with the part that it is."""
        for number, item in enumerate(items):
            yield item, self.part(number / len(items), (number + 1) / len(items))

    def turns(self, share: float) -> Iterator[Progress]:
        """Return the parts of turns without end: each takes a `share` of what is left."""
        left = 1.0
        while True:
            yield self.part(1.0 - left, 1.0 - (1.0 - share) * left)
            left *= 1.0 - share

    def _of_whole(self, fraction: float) -> float:
        return self.begin + (self.end - self.begin) * fraction


SILENT = Progress()
"""For work that nobody watches or stops."""
