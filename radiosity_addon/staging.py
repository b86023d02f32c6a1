"""Folders in which a bake prepares its files, and what becomes of them when a bake is killed.

A staging folder is ours if it holds our mark, which its process keeps locked as long as it lives: the
system takes the lock off however the process ends. While files are renamed to their places, a journal
says which; whoever finds it later puts the earlier ones back, so that a result is never half of each.
"""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO

PREFIX = ".radiosity-"
MARK = ".owner"
JOURNAL = ".publishing.json"
EARLIER = "earlier"
"""Where the files that are replaced are kept meanwhile."""

_MARK_TEXT = "made by Radiosity Lightmaps while it bakes; it cleans up by itself\n"


class Staging:
    """A staging folder of a bake that is going on, in the folder that its files will go to."""

    def __init__(self, target: Path) -> None:
        self.target = target
        self.path = Path(tempfile.mkdtemp(prefix=PREFIX, dir=target))
        self._mark = (self.path / MARK).open("w", encoding="utf-8")
        self._mark.write(_MARK_TEXT)
        self._mark.flush()
        _lock(self._mark)

    def names(self) -> list[str]:
        """Return the names of the files to be published."""
        return sorted(path.name for path in self.path.iterdir() if path.is_file() and path.name[0] != ".")

    def publish(self, names: Sequence[str]) -> None:
        """Rename files to their places, in order; all or, if one fails, none.

        Raises
        ------
        OSError
            With the file that could not be replaced as its `filename`.
        """
        earlier = self.path / EARLIER
        earlier.mkdir()
        name: str | None = None
        journal = self.path / JOURNAL
        try:
            for name in names:
                _keep(self.target / name, earlier / name)
            _write_through(journal, json.dumps({"names": list(names)}))
            for name in names:
                (self.path / name).replace(self.target / name)
        except BaseException as error:
            _take_back(self.path, self.target, names)
            journal.unlink(missing_ok=True)
            if isinstance(error, OSError) and name is not None:
                error.filename = str(self.target / name)
            raise
        journal.unlink()

    def close(self) -> None:
        """Remove the folder and whatever is left in it."""
        self._mark.close()
        shutil.rmtree(self.path, ignore_errors=True)


def clean_up(target: Path) -> bool:
    """Undo what killed bakes have left in a folder; True if a half-published result was taken back.

    Only folders with our mark that no living process holds are touched; one whose earlier files cannot be put
    back is kept, for they are in it.
    """
    taken_back = False
    for path in _abandoned(target):
        journal = path / JOURNAL
        if journal.exists():
            try:
                _take_back(path, target, json.loads(journal.read_text(encoding="utf-8"))["names"])
            except (OSError, ValueError, KeyError, TypeError):
                continue
            taken_back = True
        shutil.rmtree(path, ignore_errors=True)
    return taken_back


def _abandoned(target: Path) -> Iterator[Path]:
    """Yield the staging folders of bakes that are no more."""
    try:
        found = [path for path in target.glob(f"{PREFIX}*") if (path / MARK).is_file()]
    except OSError:
        return
    for path in found:
        try:
            with (path / MARK).open("r+", encoding="utf-8") as mark:
                ours = mark.read() == _MARK_TEXT
                _lock(mark)
        except OSError:  # its bake is still going on, or it is not for us to open
            continue
        if ours:
            yield path


def _take_back(staging: Path, target: Path, names: Sequence[str]) -> None:
    """Put the earlier files back where new ones have taken their places."""
    for name in names:
        if (staging / name).exists():
            continue  # it was not renamed
        kept = staging / EARLIER / name
        if kept.exists():
            kept.replace(target / name)
        elif (target / name).is_file():
            (target / name).unlink()


def _keep(path: Path, kept: Path) -> None:
    """Keep a file under a second name; nothing to do where there is none."""
    if path.is_dir():
        raise IsADirectoryError(21, "it is a folder")
    if not path.exists():
        return
    try:
        os.link(path, kept)
    except OSError:
        shutil.copy2(path, kept)


def _write_through(path: Path, text: str) -> None:
    """Write a small file that is there, whole, even if the machine stops at the next instant."""
    aside = path.with_name(f"{path.name}.part")
    with aside.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    aside.replace(path)


def _lock(file: IO[str]) -> None:
    """Lock a file for as long as it is open in this process; OSError if somebody else has it."""
    if os.name == "nt":
        import msvcrt

        file.seek(0)
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined,unused-ignore]
    else:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
