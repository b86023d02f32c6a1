"""Which files are ours: those that a report lists, as they are to the byte, for the same .blend and scene.

A report lists every file that bakes of its scene have left in its folder, with size and digest, and says
which scene of which file that is. It proves itself by a seal, a digest of its other contents.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
from collections.abc import Callable, Generator, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..base import drain
from .file_names import BLEND_NAME, REPORT_NAME, is_bake_name

LISTED, OWNER, SEAL = "files", "baked", "seal"
"""Keys of a report."""


_CHUNK = 1 << 20
_MAX_REPORT = 256 * 2**20

Report = Mapping[str, Any]


@dataclass(frozen=True, repr=False)
class Owner:
    """Whose files they are.

    source: The absolute path of the scene's file, or a word in angle brackets for a scene without one.
    scene: The scene's name.
    """

    source: str
    scene: str

    def recorded(self, folder: Path) -> dict[str, str]:
        """Return what a report in `folder` says: a path relative to it, so that both can be moved."""
        return {"file": _relative(self.source, folder), "scene": self.scene}

    def owns(self, report: Report, folder: Path) -> bool:
        """Return whether a report that lies in `folder` is of this file and scene.

        The copy `baked.blend` that the command line has put next to it counts as the file itself.
        """
        return bool(report[OWNER]["scene"] == self.scene) and self.is_source_of(report, folder)

    def is_source_of(self, report: Report, folder: Path) -> bool:
        """Return whether a report that lies in `folder` is of any scene of this file."""
        said = report[OWNER]
        own_file = self.recorded(folder)["file"]
        if _is_same_path(folder, said["file"], own_file):
            return True
        return BLEND_NAME in report[LISTED] and _is_same_path(folder, BLEND_NAME, own_file)


class NoReportError(Exception):
    """A file is no report that proves itself; says why, to be put after the file's name."""


def read_report(path: Path) -> dict[str, Any]:
    """Return a report that proves itself.

    Raises FileNotFoundError if there is no file of this name.
    Raises NoReportError if it is anything else.
    """
    found = path.lstat()
    if not stat.S_ISREG(found.st_mode) or found.st_size > _MAX_REPORT:
        raise NoReportError("was not written by a bake")
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(report, dict):
            raise TypeError
        if SEAL not in report and "version" in report and "solver" in report:
            raise NoReportError("was written by an earlier version, which does not prove its files")
        if report[SEAL] != _seal_of(report):
            raise NoReportError("was changed since it was written")
        for key in ("file", "scene"):
            if not isinstance(report[OWNER][key], str):
                raise TypeError
        report[LISTED] = _checked(report[LISTED])
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise NoReportError("was not written by a bake") from None
    return report


def sealed(report: Report) -> dict[str, Any]:
    """Return a report with its seal."""
    return {**{key: value for key, value in report.items() if key != SEAL}, SEAL: _seal_of(report)}


def text_of(report: Report) -> str:
    """Return what the file of a report holds."""
    return json.dumps(report, indent=2, ensure_ascii=False) + "\n"


def reports_in(folder: Path, belongs: Callable[[Report, Path], bool]) -> dict[str, dict[str, Any]]:
    """Return the reports in a folder that belong to somebody, by name; see `Owner.owns`."""
    found = {}
    try:
        names = sorted(path.name for path in folder.iterdir() if path.name.endswith(REPORT_NAME))
    except OSError:
        return {}
    for name in names:
        try:
            report = read_report(folder / name)
        except (OSError, NoReportError):
            continue
        if belongs(report, folder):
            found[name] = report
    return found


def entry(path: Path) -> dict[str, Any]:
    """Describe a file as a report lists it."""
    return {"bytes": path.stat().st_size, "sha256": digest_of_file(path)}


def digest_of_file(path: Path) -> str:
    """Return a file's SHA-256."""
    return drain(digest_steps(path))


def digest_steps(path: Path) -> Generator[None, None, str]:
    """Return a file's SHA-256; yields every few milliseconds."""
    found = hashlib.sha256()
    with path.open("rb") as file:
        while chunk := file.read(_CHUNK):
            found.update(chunk)
            yield
    return found.hexdigest()


def entries(
    new: Iterable[str], staging: Path, folder: Path, earlier: Report | None
) -> dict[str, dict[str, Any]]:
    """Return what a new report is to list: the new files, and those the earlier one lists that are there.

    staging: Where the new ones are now.
    folder: Where they will be.
    earlier: The report to be replaced.
    """
    before = {} if earlier is None else earlier[LISTED]
    kept = {name: listed for name, listed in before.items() if (folder / name).is_file()}
    return {**kept, **{name: entry(staging / name) for name in new}}


def is_as_written(path: Path, listed: Mapping[str, Any]) -> bool:
    """Return whether a file is, to the byte, what a bake wrote."""
    return drain(is_as_written_steps(path, listed))


def is_as_written_steps(path: Path, listed: Mapping[str, Any]) -> Generator[None, None, bool]:
    """Return whether a file is, to the byte, what a bake wrote; yields every few milliseconds."""
    try:
        found = path.lstat()
        if not stat.S_ISREG(found.st_mode) or found.st_size != listed["bytes"]:
            return False
        return bool((yield from digest_steps(path)) == listed["sha256"])
    except OSError:
        return False


def without(report: Report, names: Iterable[str]) -> dict[str, Any]:
    """Return a report that does not list these files any more."""
    gone = set(names)
    return sealed(
        {**report, LISTED: {name: listed for name, listed in report[LISTED].items() if name not in gone}}
    )


def _seal_of(report: Report) -> str:
    """Return the digest of a report's other contents, in one canonical form."""
    plain = json.loads(json.dumps({key: value for key, value in report.items() if key != SEAL}))
    text = json.dumps(plain, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def _checked(files: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return a report's list as it should be; names that no bake gives are left out."""
    return {
        name: {"bytes": int(entry["bytes"]), "sha256": str(entry["sha256"])}
        for name, entry in files.items()
        if is_bake_name(name)
    }


def _relative(source: str, folder: Path) -> str:
    if source.startswith("<"):
        return source
    try:
        return Path(os.path.relpath(Path(source).resolve(), folder.resolve())).as_posix()
    except ValueError:  # on another drive
        return Path(source).resolve().as_posix()


def _is_same_path(folder: Path, one: str, other: str) -> bool:
    """Return whether two paths, relative to a folder, are of one file."""
    if os.path.normcase(one) == os.path.normcase(other):
        return True
    if any(path.startswith(("<", "//", "\\\\")) for path in (one, other)):
        return False  # words, and paths that would be looked for in the network
    try:
        return (folder / one).samefile(folder / other)
    except OSError:
        return False
