"""Folders in which a bake prepares its files, and all the renaming that puts files in their places.

While files are renamed to their places, a journal names them with the digests of what is new and of what was
there before, which is kept meanwhile. Whoever finds the journal of a killed bake later puts the earlier files
back, so that a result is never half of each. A journal is material to be checked: only regular files in
the folder itself, with names that a bake writes, and that are to the byte what it says, are touched.
"""

from __future__ import annotations

import json
import os
import shutil
import stat
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from ..base import BakeError
from ..files import digest_of_file, is_bake_name
from .marked_folders import MarkedFolder, abandoned, clean_up_folders, is_own

PREFIX = ".radiosity-"
JOURNAL = ".publishing.json"
EARLIER = "earlier"
"""Where the files that are replaced are kept meanwhile."""

_VERSION = 2
_MAX_JOURNAL = 64 * 2**20

Check = Callable[[str, str | None], None]
"""Called with a name and the digest of the file of that name, None if there is none; may refuse it."""


@dataclass(frozen=True, eq=False, repr=False)
class _FileDigests:
    """Digests of a file that is published, and of the file that it replaces, if there is one."""

    new: str
    old: str | None


class Staging(MarkedFolder):
    """A staging folder of a bake that is going on, in the folder that its files will go to."""

    def __init__(self, target: Path) -> None:
        super().__init__(target, PREFIX)
        self.target = target

    @property
    def aside(self) -> Path:
        """Where to save a .blend whose relative paths are to be those of the target folder."""
        return _asides(self.target, self.path)[0]

    def names(self) -> list[str]:
        """Return the names of the files to be published; those of a folder in it begin with the folder's."""
        found = [path for path in self.path.iterdir() if path.name[0] != "." and path.name != EARLIER]
        inner = [path for folder in found if folder.is_dir() for path in folder.iterdir()]
        return sorted(path.relative_to(self.path).as_posix() for path in (*found, *inner) if path.is_file())

    def publish(
        self,
        names: Sequence[str],
        check: Check = lambda _name, _digest: None,
        known: Mapping[str, str] | None = None,
    ) -> None:
        """Rename files to their places, in order; all or, if one fails, none.

        Parameters
        ----------
        names : sequence of str
        check : callable
            Sees what each file is about to replace; what it raises ends it all.
        known : mapping of str to str or None
            Digests of staged files, where they are known already.

        Raises
        ------
        OSError
            With the file that could not be replaced as its `filename`.
        """
        earlier = self.path / EARLIER
        earlier.mkdir()
        found: dict[str, os.stat_result | None] = {}
        files: dict[str, _FileDigests] = {}
        name: str | None = None
        try:
            for name in names:
                _sync(self.path / name)
                _make_folder(self.target, name)
                _make_folder(earlier, name)
                found[name] = _regular(self.target / name)
                old = None if found[name] is None else _kept(self.target / name, earlier / name)
                check(name, old)
                files[name] = _FileDigests((known or {}).get(name) or digest_of_file(self.path / name), old)
            _sync_folder(earlier)
            write_journal(self.path, files)
            for name in names:
                if not _is_same(found[name], _regular(self.target / name)):
                    raise BakeError(f"'{self.target / name}' was changed while it was being replaced")
                rename(self.path / name, self.target / name)
            for folder in {(self.target / name).parent for name in names}:
                _sync_folder(folder)
            (self.path / JOURNAL).unlink()
        except BaseException as error:
            if isinstance(error, OSError) and name is not None:
                error.filename, error.filename2 = str(self.target / name), None
            # What cannot be put back now stays in this folder with its journal, for the next bake to try.
            with suppress(OSError, ValueError, BakeError):
                if (self.path / JOURNAL).exists():
                    _take_back(_to_take_back(self.path, self.target, files))
                    (self.path / JOURNAL).unlink()
            raise

    def close(self) -> None:
        """Remove the folder and everything left in it; it stays if earlier files could not be put back."""
        for aside in _asides(self.target, self.path):
            _remove_file(aside)
        if (self.path / JOURNAL).exists():
            self.release()
        else:
            super().close()


def _asides(target: Path, staging: Path) -> list[Path]:
    """Return where the copy of the scene is saved aside, and where Blender writes that first."""
    return [target / f"{staging.name}{ending}" for ending in (".blend", ".blend@")]


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield where to write a single file that then replaces `path` as a whole.

    Raises
    ------
    OSError
        If that cannot be prepared, or the file cannot be renamed.
    """
    clean_up_folders(path.parent, PREFIX, lambda folder: not (folder / JOURNAL).exists())
    staging = Staging(path.parent)
    try:
        aside = staging.path / path.name
        yield aside
        _sync(aside)
        rename(aside, path)
        _sync_folder(path.parent)
    finally:
        staging.close()


def write_text(path: Path, text: str) -> None:
    """Write a text file, in a folder that is made if need be, over an older one once it is whole.

    Raises
    ------
    BakeError
        If it cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as aside:
            aside.write_text(text, encoding="utf-8")
    except OSError as error:
        raise BakeError(f"cannot write '{path}': {error.strerror}") from error


def clean_up(target: Path) -> bool:
    """Undo what killed bakes have left in a folder; True if a half-published result was taken back.

    Only folders with our mark that no living process holds are touched; one whose journal does not stand up
    is left as it is.

    Raises
    ------
    BakeError
        If a file was changed since, so that the earlier one cannot be put back.
    """
    taken_back = False

    def done_with(path: Path) -> bool:
        nonlocal taken_back
        if _lexists(path / JOURNAL):
            try:
                steps = _to_take_back(path, target, _read_journal(path))
                _take_back(steps)
                (path / JOURNAL).unlink()
            except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
                return False
            taken_back = taken_back or bool(steps)
        for aside in _asides(target, path):
            _remove_file(aside)
        return True

    clean_up_folders(target, PREFIX, done_with)
    return taken_back


def is_interrupted(target: Path) -> bool:
    """Return whether a killed bake has left a folder half published; only looks."""
    for path in abandoned(target, PREFIX):
        if _lexists(path / JOURNAL):
            try:
                if _to_take_back(path, target, _read_journal(path)):
                    return True
            except BakeError:
                return True
            except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
                continue
    return False


_Step = tuple[Path | None, Path]
"""A kept file and the place it goes back to; or None and a file that was not there before."""


def _to_take_back(staging: Path, target: Path, files: Mapping[str, _FileDigests]) -> list[_Step]:
    """Return what has to be done to have the earlier files back.

    Raises
    ------
    BakeError
        If a file was changed since it was published.
    ValueError
        If the kept files are not what the journal says.
    """
    steps: list[_Step] = []
    for name, file in files.items():
        place, kept = target / name, staging / EARLIER / name
        for folder in (place.parent, kept.parent):
            if folder.is_symlink():  # what is in it is somewhere else
                raise ValueError(name)
        present = _digest_of(place)
        if present == file.old:
            continue
        if file.old is None:
            if present == file.new:
                steps.append((None, place))
            continue  # else somebody else put a file where there was none
        if present is not None and present != file.new:
            raise BakeError(
                f"a bake was interrupted while it replaced '{place}', and the file was changed since: "
                "move it away, and bake again to have the earlier result back"
            )
        if _digest_of(kept) != file.old:
            raise ValueError(name)
        steps.append((kept, place))
    return steps


def _take_back(steps: Sequence[_Step]) -> None:
    """Put earlier files back, and remove those that were not there before."""
    for kept, place in steps:
        if kept is None:
            place.unlink()
        else:
            rename(kept, place)
    for folder in {place.parent for _, place in steps}:
        _sync_folder(folder)


def _read_journal(staging: Path) -> dict[str, _FileDigests]:
    """Return what a journal says, checked; see `_to_take_back` for the files themselves.

    Raises
    ------
    OSError, ValueError, KeyError, TypeError, AttributeError
        If it is no journal of ours.
    """
    path = staging / JOURNAL
    found = path.lstat()
    earlier = (staging / EARLIER).lstat()
    if not stat.S_ISREG(found.st_mode) or not stat.S_ISDIR(earlier.st_mode) or found.st_size > _MAX_JOURNAL:
        raise ValueError(path)
    if not (is_own(found) and is_own(earlier)):
        raise ValueError(path)
    journal = json.loads(path.read_text(encoding="utf-8"))
    if journal["version"] != _VERSION:
        raise ValueError(path)
    files = {}
    for name, digests in journal["files"].items():
        new, old = digests["new"], digests["old"]
        if not is_bake_name(name) or not isinstance(new, str) or not isinstance(old, str | None):
            raise ValueError(name)
        files[name] = _FileDigests(new, old)
    return files


def write_journal(staging: Path, files: Mapping[str, _FileDigests]) -> None:
    """Write the journal so that it is there, whole, even if the machine stops at the next instant."""
    journal = {name: {"new": file.new, "old": file.old} for name, file in files.items()}
    aside = staging / f"{JOURNAL}.part"
    with aside.open("w", encoding="utf-8") as file:
        json.dump({"version": _VERSION, "files": journal}, file)
        file.flush()
        os.fsync(file.fileno())
    rename(aside, staging / JOURNAL)
    _sync_folder(staging)


def _kept(path: Path, kept: Path) -> str:
    """Keep a file under a second name and return its digest."""
    try:
        os.link(path, kept, follow_symlinks=False)
    except (OSError, NotImplementedError):
        shutil.copy2(path, kept, follow_symlinks=False)
        _sync(kept)
    return digest_of_file(kept)


def rename(source: Path, target: Path) -> None:
    """Rename a file over another; every renaming of ours is this one."""
    source.replace(target)


def _make_folder(base: Path, name: str) -> None:
    """Make the folder that a file's name begins with.

    Raises
    ------
    OSError
        If something else is there, such as a link.
    """
    folder = (base / name).parent
    if folder == base:
        return
    with suppress(FileExistsError):
        folder.mkdir()
    if not stat.S_ISDIR(folder.lstat().st_mode):
        raise NotADirectoryError(20, "its folder is a link or a file", str(folder))


def _regular(path: Path) -> os.stat_result | None:
    """Return what the system says of a regular file; None if there is nothing of this name.

    Raises
    ------
    OSError
        If it is anything else: a link, a folder, a device.
    """
    try:
        found = path.lstat()
    except FileNotFoundError:
        return None
    if stat.S_ISDIR(found.st_mode):
        raise IsADirectoryError(21, "it is a folder", str(path))
    if not stat.S_ISREG(found.st_mode):
        raise OSError(22, "it is not a regular file", str(path))
    return found


def _digest_of(path: Path) -> str | None:
    """Return a regular file's digest; None if there is nothing, "" if it is no regular file."""
    try:
        return None if _regular(path) is None else digest_of_file(path)
    except OSError:
        return ""


def _is_same(one: os.stat_result | None, other: os.stat_result | None) -> bool:
    """Return whether a file is as it was found."""
    if one is None or other is None:
        return one is other
    return (one.st_ino, one.st_size, one.st_mtime_ns) == (other.st_ino, other.st_size, other.st_mtime_ns)


def _remove_file(path: Path) -> None:
    """Remove a regular file, if there is one."""
    with suppress(OSError):
        if _regular(path) is not None:
            path.unlink()


def _lexists(path: Path) -> bool:
    return os.path.lexists(path)


def _sync(path: Path) -> None:
    """Have a file's content on the disk before its name is."""
    with path.open("r+b") as file:
        os.fsync(file.fileno())


def _sync_folder(path: Path) -> None:
    """Have a folder's names on the disk, where the system can do that."""
    if os.name == "nt":
        return
    with suppress(OSError):
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
