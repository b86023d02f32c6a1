"""Spools of a bake: in a folder that is given, next to where its files go, or in a folder for spools."""

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
from .spool import FINISHED, PREPARED, RECORD, Spool

ENDING = "-spool"

PREFIX = "radiosity-"
_NAME = re.compile(PREFIX + "[0-9a-f]{16}")

FORGOTTEN = 86400.0
"""Seconds after which a spool in a folder for spools is one that a bake was killed in."""


@contextmanager
def given_spool(path: Path) -> Iterator[Spool]:
    """Yield a spool to bake with in a folder; after an error nothing is left there, unless it holds results.

    Raises BakeError as `Spool.to_bake` does.
    """
    with _there_again(path):
        if (path.expanduser() / PREPARED).exists():
            raise BakeError(f"a bake is prepared in '{path}': run and finish it, or give another folder")
        spool = Spool.to_bake(path)
        with suppress(FileNotFoundError):
            (spool.path / FINISHED).unlink()
        with _kept_with_results(spool):
            yield spool


@contextmanager
def spool_to_prepare(path: Path) -> Iterator[Spool]:
    """Yield a spool to prepare a bake in; after an error one that was made for it is removed.

    Raises BakeError as `Spool.made` does.
    """
    spool = Spool(path)
    was_there, was_spool = spool.path.exists(), (spool.path / RECORD).exists()
    with _there_again(path):
        try:
            spool = Spool.made(path)
        except BaseException:
            if not was_there:
                with suppress(OSError):
                    spool.path.rmdir()
            raise
        try:
            yield spool
        except BaseException:
            if not was_spool:
                spool.remove()
            raise


@contextmanager
def _there_again(path: Path) -> Iterator[None]:
    """Make a folder again after an error that was there before."""
    path = path.expanduser()
    was_there = path.is_dir()
    try:
        yield
    except BaseException:
        if was_there:
            with suppress(OSError):
                path.mkdir(exist_ok=True)
        raise


@contextmanager
def own_spool(output: Path) -> Iterator[Spool]:
    """Yield a spool for the bake into a folder, which is removed if the bake ends well.

    If it does not, and there are results in the spool, it stays: the error says so, and the next bake into
    the folder goes on with it.
    Raises BakeError if something else has its name.
    """
    output = output.expanduser().resolve()
    spool = Spool.of_output(output.parent / (output.name + ENDING), output)
    with _kept_with_results(spool):
        yield spool
    spool.remove()


@contextmanager
def _kept_with_results(spool: Spool) -> Iterator[None]:
    """Remove a spool after an error, unless a bake can go on with it: then the error says so."""
    try:
        yield
    except BaseException as error:
        if spool.has_results():
            error.add_note(f"what was computed is kept in '{spool.path}': the same command goes on with it")
            spool.leave()
        else:
            spool.remove()
        raise


@contextmanager
def shared_in_folder(folder: Path, helpers: Helpers) -> Iterator[ShareRecord]:
    """Share what is baked within through a new spool in a folder, which is removed however the bake ends.

    What bakes that were killed have left in the folder is removed as well. If no spool can be made there, the
    bake goes on alone, and the record says why.
    Raises BakeError if the spool cannot be written to later.
    """
    folder = folder.resolve()
    _remove_forgotten(folder)
    path = folder / f"{PREFIX}{secrets.token_hex(8)}"
    try:
        spool = Spool.to_bake(path, made_for=folder)
    except BakeError as error:
        Spool(path).remove()
        alone = ShareRecord()
        alone.problems.append(f"{error}; the bake went on alone")
        yield alone
        return
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
