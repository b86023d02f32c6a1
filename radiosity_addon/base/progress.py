"""The progress of long work: one object, passed down to all parts of it, which also cancels them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, TypeVar

T = TypeVar("T")


class Cancelled(BaseException):
    """Nobody wants the work any more. Not an `Exception`: it is not handled, only cleaned up after."""


@dataclass(frozen=True)
class Expected:
    """How long work was expected to take beforehand: what is done of it, and what is left [s]."""

    done: float
    left: float


@dataclass(frozen=True)
class Status:
    """Where a job is.

    fraction: Of the whole job, 0 to 1.
    picture: What the result looks like so far, now and then; else None.
    expected: None where nothing is known of the time that the work takes.
    """

    stage: str
    fraction: float
    picture: Any = None
    expected: Expected | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Progress:
    """Reports the progress of work to a listener. May be used from any thread.

    listener: Takes a `Status`. Raises `Cancelled` to stop the work. None: nobody listens.
    name: The stage.
    begin, end: The part of the whole that the work is.
    look: Makes the picture, or None, of what is shown to `at`, or of None.
    in_window: Whether a window is drawn meanwhile: no step may hold Python's lock for long.
    seconds: How long the part is expected to take; None where that is not known.
    before, after: The same of what comes before and after it.
    """

    listener: Callable[[Status], None] | None = None
    name: str = ""
    begin: float = 0.0
    end: float = 1.0
    look: Callable[[Any], Any] | None = None
    in_window: bool = False
    seconds: float | None = None
    before: float = 0.0
    after: float = 0.0

    def at(self, fraction: float, shown: object = None) -> None:
        """Say that a fraction of this part, 0 to 1, is done; `shown` is what a picture can be made of.

        Raises Cancelled if the job was canceled.
        """
        if self.listener is not None:
            picture = None if self.look is None else self.look(shown)
            expected = None
            if self.seconds is not None:
                done = self.seconds * fraction
                expected = Expected(self.before + done, self.seconds - done + self.after)
            self.listener(Status(self.name, self._of_whole(fraction), picture, expected))

    def part(self, begin: float, end: float) -> Progress:
        """Return the progress of work that goes from one fraction of this part to another."""
        part = replace(self, begin=self._of_whole(begin), end=self._of_whole(end))
        if self.seconds is None:
            return part
        before, after = self.before + begin * self.seconds, self.after + (1.0 - end) * self.seconds
        return replace(part, seconds=(end - begin) * self.seconds, before=before, after=after)

    def expecting(self, seconds: Sequence[float]) -> list[Progress]:
        """Return the parts of steps that are expected to take so long, one after the other.

        What follows the whole of them is taken to be as long as its share of the job says.
        """
        total, after = max(sum(seconds), 1e-9), self.after
        if self.seconds is None and self.end > self.begin:
            after = total * (1.0 - self.end) / (self.end - self.begin)
        whole = replace(self, seconds=total, after=after)
        ends = [sum(seconds[: number + 1]) / total for number in range(len(seconds))]
        return [whole.part(begin, end) for begin, end in pairwise([0.0, *ends])]

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
        # Rounded, it must not be beyond where the next part begins.
        return min(self.begin + (self.end - self.begin) * fraction, self.end)


SILENT = Progress()
"""For work that nobody watches or stops."""
