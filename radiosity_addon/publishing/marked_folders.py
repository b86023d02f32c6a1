"""Folders that a process makes for itself and that a later one can prove to be ours after a kill.

Such a folder holds a mark, which its process keeps locked as long as it lives: the system takes the lock
off however the process ends. Ages and process numbers lie.
"""

from __future__ import annotations

import os
import re
import secrets
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

OWNER_FILE = ".owner"

_MARK_TEXT = "made by Radiosity Lightmaps while it bakes; it cleans up by itself\n"
_RANDOM_BYTES = 8
_SUFFIX = rf"[0-9a-f]{{{2 * _RANDOM_BYTES}}}-[a-z0-9_]{{8}}"
"""What follows the prefix: nobody else names a folder so, which makes an empty one ours without a mark."""

_ATTEMPTS = 3


class MarkedFolder:
    """A new folder with our mark, locked as long as this process holds it.

    Raises OSError if it cannot be made; nothing is left of it then.
    """

    def __init__(self, parent: Path, prefix: str) -> None:
        for attempt in range(_ATTEMPTS):
            name = f"{prefix}{secrets.token_hex(_RANDOM_BYTES)}-"
            self.path = Path(tempfile.mkdtemp(prefix=name, dir=parent))
            made = self.path.lstat()
            self._identity = made.st_dev, made.st_ino
            try:
                self._mark = _new_mark(self.path / OWNER_FILE)
            except FileNotFoundError:
                # Somebody who cleans up took it for the empty folder of a killed process.
                if attempt == _ATTEMPTS - 1:
                    raise
            except BaseException:
                shutil.rmtree(self.path, ignore_errors=True)
                raise
            else:
                return

    def close(self) -> None:
        """Remove the folder with all that is in it, if it still is the one that was made."""
        self.release()
        with suppress(OSError):
            found = self.path.lstat()
            if stat.S_ISDIR(found.st_mode) and (found.st_dev, found.st_ino) == self._identity:
                _remove(self.path)

    def release(self) -> None:
        """Leave the folder where it is, for others to find as that of a process that is no more."""
        self._mark.close()


def clean_up_folders(
    parent: Path, prefix: str, done_with: Callable[[Path], bool] = lambda _folder: True
) -> None:
    """Remove the folders of processes that are no more.

    prefix: Of their names.
    done_with: Called with each, locked meanwhile; the folder stays where it returns False.
    """
    for path in _candidates(parent, prefix):
        with suppress(OSError):
            path.rmdir()  # killed before it was marked: only an empty folder can be removed so
            continue
        with _claimed(path) as ours:
            removable = ours and done_with(path)
        if removable:
            _remove(path)


def _remove(folder: Path) -> None:
    """Remove a folder, its mark last: what a kill leaves of it must still be known as ours."""
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in [entry for entry in entries if entry.name != OWNER_FILE]:
            if entry.is_dir(follow_symlinks=False):
                shutil.rmtree(entry.path, ignore_errors=True)
            else:
                with suppress(OSError):
                    Path(entry.path).unlink()
    shutil.rmtree(folder, ignore_errors=True)


def abandoned(parent: Path, prefix: str) -> Iterator[Path]:
    """Yield the folders of processes that are no more; nothing is changed."""
    for path in _candidates(parent, prefix):
        with _claimed(path) as ours:
            if ours:
                yield path


def is_own(found: os.stat_result) -> bool:
    """Return whether a file belongs to the user who runs this, as far as the system says."""
    return not hasattr(os, "geteuid") or found.st_uid == os.geteuid()


def _candidates(parent: Path, prefix: str) -> list[Path]:
    """Return folders of the right name that are this user's; links are none."""
    name = re.compile(re.escape(prefix) + _SUFFIX)
    try:
        with os.scandir(parent) as entries:
            return sorted(
                Path(entry.path)
                for entry in entries
                if name.fullmatch(entry.name)
                and entry.is_dir(follow_symlinks=False)
                and is_own(entry.stat(follow_symlinks=False))
            )
    except OSError:
        return []


@contextmanager
def _claimed(folder: Path) -> Iterator[bool]:
    """Lock the mark of a folder whose process is no more; False if it is not ours, or its process lives."""
    mark = None
    try:
        mark = os.fdopen(
            os.open(folder / OWNER_FILE, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0)), "r+", encoding="utf-8"
        )
        found = os.fstat(mark.fileno())
        _lock(mark)
        text = mark.read(len(_MARK_TEXT) + 1)
        # An empty mark is that of a process killed while it wrote it; nothing else was in the folder then.
        ours = text == _MARK_TEXT or (not text and list(folder.iterdir()) == [folder / OWNER_FILE])
        ours = ours and stat.S_ISREG(found.st_mode) and is_own(found)
    except (OSError, ValueError):
        ours = False
    try:
        yield ours
    finally:
        if mark is not None:
            mark.close()


def _new_mark(path: Path) -> IO[str]:
    """Make and lock a folder's mark."""
    mark = path.open("x", encoding="utf-8")
    try:
        _lock(mark)
        mark.write(_MARK_TEXT)
        mark.flush()
    except BaseException:
        mark.close()
        raise
    return mark


def _lock(file: IO[str]) -> None:
    """Lock a file for as long as it is open in this process; OSError if another process has it."""
    if os.name == "nt":
        import msvcrt

        file.seek(0)
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined,unused-ignore]
    else:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
