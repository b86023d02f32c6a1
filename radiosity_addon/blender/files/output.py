"""The output folder: files are written aside and renamed, so that a result is always whole.

What stands in a place of one of a bake's files is only replaced if it proves to be ours, see
`baked_files.py`.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Collection, Generator, Iterable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

import bpy

from ...bake.result import BakeReport
from ...base import BakeError, RadiosityError
from ...cli import check_folder
from ...files import (
    BLEND_NAME,
    LISTED,
    OWNER,
    PLAIN_NAMES,
    PREVIEW_NAME,
    FileNames,
    NoReportError,
    Owner,
    entries,
    folded,
    is_as_written_steps,
    read_report,
)
from ...publishing import Staging, clean_up
from .ownership import is_read, owner_of

_DISK_FAILURES = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG, errno.EIO)
"""What the system says of a disk that is full, or fails, often without naming the file."""


class OutputFolder:
    """A folder that gets all of a bake's files at once, or none.

    A context manager. Inside it, write into `staging`, a hidden folder on the same file
    system laid out as the result will be; `publish` then renames file by file over an
    earlier result, the report last. Leaving without it, or by an error, leaves the folder
    as it was. A file is replaced only if a report of the same file and scene lists it as it is.

    Parameters
    ----------
    path : Path or str
    names : FileNames
        What the files are called: those of the command line, unless others are given.
    source : str
        The file the scene came from, where that is not the open one.
    overwrite : bool
        Replace files that are not ours, too, but none that the scene reads.
    others : collection of Path
        Files that something else will write: none of this bake's may be one of them.
    owner : Owner or None
        Whose files they are; None for the context's scene.
    """

    def __init__(
        self,
        path: Path | str,
        names: FileNames = PLAIN_NAMES,
        source: str = "",
        overwrite: bool = False,
        others: Collection[Path] = (),
        owner: Owner | None = None,
    ) -> None:
        self.path = Path(path).expanduser().resolve()
        self.names = names
        self.earlier: dict[str, Any] | None = None
        self._source = source
        self._overwrite = overwrite
        self._others = [_in_its_folder(other) for other in others]
        self._owner = owner
        self._staging: Staging | None = None
        self._made: list[Path] = []
        self._digests: dict[str, str] = {}

    @property
    def staging(self) -> Path:
        """Where to write, while the folder is open."""
        return self._open.path

    @property
    def aside(self) -> Path:
        """Where to save the copy of the scene, which has its relative paths from the folder it is in."""
        return self._open.aside

    @property
    def _open(self) -> Staging:
        if self._staging is None:
            raise RuntimeError("the output folder is not open")
        return self._staging

    def __enter__(self) -> OutputFolder:
        """Make the folder and its staging folder; a BakeError names one that cannot be written.

        What a killed bake has left there is cleaned up first. A report in the place of this bake's
        must be ours.
        """
        check_folder(self.path)
        missing = [folder for folder in (self.path, *self.path.parents) if not folder.exists()]
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._made = missing
            clean_up(self.path)
            self._staging = Staging(self.path)
        except OSError as error:
            self._remove_made()
            raise BakeError(
                f"cannot write to the output folder '{self.path}': {error.strerror}; choose another"
            ) from error
        try:
            self._meet_earlier()
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(
        self,
        _kind: type[BaseException] | None,
        error: BaseException | None,
        _trace: TracebackType | None,
    ) -> None:
        """Remove what was not published, and folders that were made for nothing.

        An error that names a file in the staging folder goes on naming its place in this folder.
        """
        staging, aside = str(self.staging), str(self.aside)
        self._open.close()
        self._staging = None
        self._remove_made()
        if isinstance(error, OSError):
            named = str(error.filename or (staging if error.errno in _DISK_FAILURES else ""))
        else:
            named = str(error) if isinstance(error, RadiosityError) else ""
        if staging in named:
            place = named.replace(aside, str(self.path / BLEND_NAME)).replace(staging, str(self.path))
            if isinstance(error, OSError):
                raise BakeError(f"cannot write '{place}': {error.strerror}") from error
            assert error is not None
            raise type(error)(place) from error

    def refusal(self, names: Iterable[str]) -> str | None:
        """Return why a bake that writes files of these names would stop, if it would; changes no file."""
        try:
            check_folder(self.path)
            if self.path.is_dir():
                self._meet_earlier()
                self.expect(names)
        except (BakeError, OSError) as error:
            return str(error)
        return None

    def _meet_earlier(self) -> None:
        """Read the report that this bake replaces; a BakeError names what stands in its place."""
        self._owner = self._owner or owner_of(bpy.context.scene, self._source)
        self.earlier = self._earlier()
        for name in (BLEND_NAME, PREVIEW_NAME, self.names.report, self.names.sidecar):
            self._refuse_others(name)

    def expect(self, names: Iterable[str]) -> None:
        """Refuse names of files to come in whose places something stands that is not ours.

        Raises
        ------
        BakeError
            Naming the first of them, and what to do.
        """
        for _ in self.expecting(names):
            pass

    def expecting(self, names: Iterable[str]) -> Generator[None, None, None]:
        """As `expect`; yields every few milliseconds, for large files are read."""
        for name in names:
            path = self.path / name
            self._refuse_others(name)
            if path.parent != self.path and os.path.lexists(path.parent) and not _is_folder(path.parent):
                self._refuse(path.parent, "is no folder")
            if os.path.lexists(path):
                entry = self._listed.get(name)
                ours = entry is not None and (yield from is_as_written_steps(path, entry))
                self._judge(name, ours)

    def files(self) -> dict[str, dict[str, Any]]:
        """Return what the report is to list of the files here: those staged, and those of earlier bakes."""
        staged = [name for name in self._open.names() if name != self.names.report]
        found = entries(staged, self.staging, self.path, self.earlier)
        self._digests = {name: found[name]["sha256"] for name in staged}
        return found

    def write_report(self, report: BakeReport) -> BakeReport:
        """Stage the report, the last file, with what proves which files are ours; returns it so."""
        assert self._owner is not None
        owner = self._owner.recorded(self.path) if self.earlier is None else self.earlier[OWNER]
        proven = report.proven(self.files(), owner)
        proven.write(self.staging / self.names.report)
        return proven

    def publish(self) -> list[Path]:
        """Rename all staged files to their places; undone as a whole if one fails.

        Killed meanwhile, the next bake into the folder puts the earlier ones back.

        Returns
        -------
        paths : list of Path
            The files as they are now, the report last.

        Raises
        ------
        BakeError
            If a file cannot be replaced, or is not ours to replace.
        """
        report = self.names.report
        names = sorted(self._open.names(), key=lambda name: (name == report, name))
        ours = {name: entry["sha256"] for name, entry in self._listed.items()}

        def check(name: str, digest: str | None) -> None:
            self._refuse_others(name)
            if digest is None or (name == report and self.earlier is not None):
                return
            self._judge(name, ours.get(name) == digest)

        try:
            self._open.publish(names, check, self._digests)
        except OSError as error:
            raise BakeError(f"cannot replace '{error.filename}': {error.strerror}") from error
        return [self.path / name for name in names]

    def _earlier(self) -> dict[str, Any] | None:
        """Return the report that this bake replaces, if it is ours.

        Raises
        ------
        BakeError
            If something else stands in its place.
        """
        assert self._owner is not None
        path = self.path / self.names.report
        try:
            report = read_report(path)
        except FileNotFoundError:
            return None
        except NoReportError as error:
            self._refuse(path, str(error))
            return None
        if self._owner.owns(report, self.path):
            return report
        said = report[OWNER]
        file = "a file that was never saved" if said["file"].startswith("<unsaved") else f"'{said['file']}'"
        self._refuse(path, f"is of scene '{said['scene']}' of {file}")
        return None

    @property
    def _listed(self) -> Mapping[str, Mapping[str, Any]]:
        """What our earlier report lists."""
        return {} if self.earlier is None else self.earlier[LISTED]

    def _refuse_others(self, name: str) -> None:
        """Refuse a name of ours that something else will write."""
        path = self.path / name
        if any(is_same_file(path, other) for other in self._others):
            raise BakeError(f"'{path}' is a file of the bake itself: choose another name for the other file")

    def _judge(self, name: str, ours: bool) -> None:
        """Refuse what stands in the place of a file, unless it is ours or may be overwritten."""
        path = self.path / name
        if ours:
            if name == BLEND_NAME and is_read(path):
                raise BakeError(f"'{path}' is a file that the scene itself reads: choose another folder")
            return
        known = name in self._listed
        self._refuse(
            path, "was changed since it was baked" if known else "was not written by a bake of this scene"
        )

    def _refuse(self, path: Path, reason: str) -> None:
        """Refuse what stands in a place; return if it may be overwritten."""
        refuse_special(path)
        if is_read(path):
            raise BakeError(f"'{path}' is a file that the scene itself reads: choose another folder")
        if not self._overwrite:
            more = "" if self.names.prefix else ", or give --overwrite"
            raise BakeError(f"'{path}' {reason}: move it away, choose another folder{more}")

    def _remove_made(self) -> None:
        """Remove the folders made on entering that are still empty, innermost first."""
        for folder in self._made:
            try:
                folder.rmdir()
            except OSError:
                return


def _is_folder(path: Path) -> bool:
    return stat.S_ISDIR(path.lstat().st_mode)


def refuse_special(path: Path) -> None:
    """Refuse, by a BakeError, to write where a folder, a link or a device is."""
    try:
        found = path.lstat()
    except FileNotFoundError:
        return
    except OSError as error:
        raise BakeError(f"cannot write '{path}': {error.strerror}") from error
    except ValueError as error:
        raise BakeError(f"cannot write '{path}': {error}") from error
    kinds = ((stat.S_ISDIR, "a folder"), (stat.S_ISLNK, "a link"))
    kind = next((text for test, text in kinds if test(found.st_mode)), "not a regular file")
    if not stat.S_ISREG(found.st_mode):
        raise BakeError(f"cannot write '{path}': it is {kind}; choose another place")


def _in_its_folder(path: Path) -> Path:
    """Return a path whose folder is resolved, but not the file itself."""
    path = path.expanduser().absolute()
    return path.parent.resolve() / path.name


def is_same_file(one: Path, other: Path) -> bool:
    """Return whether two paths are of one file, also of one that is not there yet."""
    try:
        return one.samefile(other)
    except (OSError, ValueError):
        return one.parent == other.parent and folded(one.name) == folded(other.name)
