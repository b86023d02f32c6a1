"""A spool that the bake makes for itself, next to where its files go."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .spool import Spool

ENDING = "-spool"


@contextmanager
def own_spool(output: Path) -> Iterator[Spool]:
    """Yield a spool for the bake into a folder, which is removed if the bake ends well.

    If it does not, and there are results in the spool, it stays: the error says so, and the next bake into
    the folder goes on with it.
    Raises BakeError if something else has its name.
    """
    output = output.expanduser().resolve()
    spool = Spool.of_output(output.parent / (output.name + ENDING), output)
    try:
        yield spool
    except BaseException as error:
        if spool.has_results():
            error.add_note(f"what was computed is kept in '{spool.path}': the same command goes on with it")
            spool.leave()
        else:
            spool.remove()
        raise
    spool.remove()
