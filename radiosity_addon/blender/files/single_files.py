"""Single files that the command line writes where the user says: `--report`, `--plot`, `restore`.

None of them may replace the scene, a file the scene reads, a file of the bake, or another of them; what is
there already is replaced only if it is ours, or with `--overwrite`.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from ...base import BakeError, UsageError
from ...files import OWNER, NoReportError, Owner, read_report
from .output import is_same_file, refuse_special
from .ownership import is_read
from .scene_parts import scene_parts


def check_places(places: Mapping[str, Path], scene: Path | None) -> None:
    """Refuse places that coincide, and those that cannot be written; before the scene is opened.

    places mapping of str to Path: By the option that names each.
    scene: The scene's file, if there is one.
    Raises RadiosityError: Naming the option.
    """
    taken: dict[str, Path] = {}
    if scene is not None and places:
        taken = {f"a part of the scene, '{part.name}'": part for part in scene_parts(scene)}
        taken["the scene itself"] = scene
    for option, path in places.items():
        for what, other in taken.items():
            if is_same_file(_absolute(path), _absolute(other)):
                raise UsageError(f"{option} {path} is {what}: choose another file")
        taken[f"also that of {option}"] = path
        refuse_special(path)
        check_writable(path)


def check_existing(option: str, path: Path, overwrite: bool, ours: Mapping[str, str] | None = None) -> None:
    """Refuse to replace a file that is not ours; once the scene is open.

    option: That names it.
    overwrite: Whether other files may be replaced, too, except for those the scene reads.
    ours: The owner as the report of the bake will say, if a report of that may be replaced.
    Raises BakeError.
    """
    if not os.path.lexists(path):
        return
    refuse_special(path)
    if is_read(_absolute(path)):
        raise BakeError(f"{option} {path} is a file that the scene reads: choose another file")
    if not overwrite and not (ours is not None and _is_report_of(path, ours)):
        raise BakeError(f"{option} {path} is there: move it away, choose another, or give --overwrite")


def owner_record(owner: Owner, output: Path) -> dict[str, str]:
    """Return what a report in an output folder says of its owner."""
    return owner.recorded(output.expanduser().resolve())


def check_writable(path: Path) -> None:
    """See that a file can be written later, in its folder or in the one in which that will be made.

    Raises BakeError if not.
    """
    folder = next((each for each in path.absolute().parents if os.path.lexists(each)), path.parent)
    aside = folder / f".{path.name}.{os.getpid()}.part"
    try:
        aside.open("x").close()
        aside.unlink()
    except OSError as error:
        raise BakeError(f"cannot write '{path}': {error.strerror}") from error


def make_folder_of(path: Path) -> None:
    """Make the folder of a file to be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BakeError(f"cannot write '{path}': its folder cannot be made ({error.strerror})") from error


def _is_report_of(path: Path, owner: Mapping[str, str]) -> bool:
    try:
        return bool(read_report(path)[OWNER] == owner)
    except (OSError, NoReportError):
        return False


def _absolute(path: Path) -> Path:
    """Return a path whose folder is resolved, but not the file itself."""
    path = path.absolute()
    return path.parent.resolve() / path.name
