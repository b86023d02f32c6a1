"""Spools that a bake makes for itself: next to where its files go, or in a folder for spools."""

from __future__ import annotations

import re
import secrets
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..base import BakeError
from .executor import shared_bake
from .helpers import Helpers
from .records import ShareRecord
from .spool import Spool

ENDING = "-spool"

PREFIX = "radiosity-"
_NAME = re.compile(PREFIX + "[0-9a-f]{16}")

FORGOTTEN = 86400.0
"""Seconds after which a spool in a folder for spools is one that a bake was killed in."""


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


@contextmanager
def shared_in_folder(folder: Path, helpers: Helpers) -> Iterator[ShareRecord]:
    """Share what is baked within through a new spool in a folder, which is removed however the bake ends.

    What bakes that were killed have left in the folder is removed as well.
    Raises BakeError if the spool cannot be written to.
    """
    folder = folder.resolve()
    _remove_forgotten(folder)
    spool = Spool.to_bake(folder / f"{PREFIX}{secrets.token_hex(8)}", made_for=folder)
    try:
        with shared_bake(spool, helpers) as record:
            yield record
    finally:
        spool.remove()


def _remove_forgotten(folder: Path) -> None:
    with suppress(OSError):
        for path in folder.iterdir():
            if not _NAME.fullmatch(path.name) or path.is_symlink():
                continue
            spool = Spool(path)
            with suppress(OSError, BakeError):
                if spool.is_made_for(folder) and time.time() - spool.last_sign() > FORGOTTEN:
                    spool.remove()
