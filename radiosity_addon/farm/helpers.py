"""What a bake may start to be helped: workers on this machine, on a cluster, or a command of the user's."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from .spool import Spool


class Helpers(Protocol):
    """Starts workers of a spool, and ends them.

    problems: What went wrong, a line each: the bake goes on without the help.
    """

    problems: list[str]

    def start(self, spool: Spool) -> None:
        """Start them."""

    def end(self) -> None:
        """End them: none is left. The bake has said that it is over, or has taken its sign away."""


@contextmanager
def helped(spool: Spool, helpers: Helpers | None) -> Iterator[None]:
    """Have helpers while a bake goes on, however it ends; they are told of its end first."""
    if helpers is None:
        yield
        return
    try:
        helpers.start(spool)
        yield
        spool.say_over()
    finally:
        spool.leave()
        helpers.end()
