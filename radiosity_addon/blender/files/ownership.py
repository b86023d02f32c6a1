"""Whose files a bake's are, and which files the open scene itself reads."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

from ...base import BakeError
from ...files import LISTED, REPORT_NAME, FileNames, NoReportError, Owner, read_report, reports_in
from ..datablocks.bake_record import is_made

CORNELL_BOX = "<Cornell box>"
"""Stands for the file of the bundled scene."""

_unsaved = f"<unsaved {os.urandom(16).hex()}>"
"""Stands for the open file as long as it has no path; no two unsaved files are the same."""


def owner_of(scene: bpy.types.Scene, source: str = "") -> Owner:
    """Return who the files of a scene's bake belong to.

    Parameters
    ----------
    scene : Scene
    source : str
        The file that the scene came from, where it is not the open one.
    """
    return Owner(source or bpy.data.filepath or _unsaved, scene.name)


def panel_names(scene: bpy.types.Scene) -> FileNames:
    """Return the names of the files of a scene that is baked from the panel."""
    return FileNames.of_scene(bpy.data.filepath, scene.name)


@dataclass(frozen=True, eq=False, repr=False)
class OwnReport:
    """A report of a scene of the open file, and the names and the owner that go with it."""

    names: FileNames
    owner: Owner
    contents: Mapping[str, Any]


def own_reports(folder: Path, scene: bpy.types.Scene) -> list[OwnReport]:
    """Return the reports in a folder that are of a scene of the open file.

    Those of the time before it was saved for the first time are among them.
    """
    owners = dict.fromkeys((owner_of(scene), Owner(_unsaved, scene.name)))
    return [
        OwnReport(FileNames.of_report(name), owner, contents)
        for owner in owners
        for name, contents in reports_in(folder, owner.owns).items()
    ]


def report_listing(path: Path, scenes: Collection[bpy.types.Scene]) -> OwnReport:
    """Return the report next to a file that lists it as one of a scene's lightmaps.

    Raises
    ------
    BakeError
        If there is none: the file is not ours.
    """
    for scene in scenes:
        for report in own_reports(path.parent, scene):
            if path.name in report.contents[LISTED]:
                return report
    for name in dict.fromkeys((*(panel_names(scene).report for scene in scenes), REPORT_NAME)):
        with suppress(OSError):
            try:
                read_report(path.with_name(name))
            except NoReportError as error:
                raise BakeError(f"'{path.with_name(name)}' {error}: move it away and bake again") from None
    raise BakeError(f"no report of this file and scene lists '{path}': bake again")


def is_read(path: Path) -> bool:
    """Return whether the open file reads a file: a library, a texture, a cache, or the .blend itself."""
    return any(_is_same(path, read) for read in _read_files()) or any(
        pattern.fullmatch(str(path)) for pattern in _series()
    )


def _read_files() -> Iterator[Path]:
    """Yield all files that the open file refers to, and itself; our own lightmaps are none.

    Files of packed images are among them: importing glTF packs what it has read.
    """
    made: set[str] = set()
    others: set[str] = set()
    for image in bpy.data.images:
        if image.filepath_raw:
            path = os.path.normpath(bpy.path.abspath(image.filepath_raw, library=image.library))
            (made if is_made(image) else others).add(path)
    if bpy.data.filepath:
        yield Path(bpy.data.filepath)
    for path in bpy.utils.blend_paths(absolute=True, packed=False, local=False):
        path = os.path.normpath(path)
        if path not in made or path in others:
            yield Path(path)
    yield from map(Path, others)


def _series() -> Iterator[re.Pattern[str]]:
    """Yield patterns of the files of image sequences and of tiled images."""
    for image in bpy.data.images:
        if image.source in {"SEQUENCE", "TILED"} and not is_made(image):
            path = Path(bpy.path.abspath(image.filepath_raw, library=image.library))
            name = re.sub(r"<UDIM>|<UVTILE>|\d+", "\0", path.name)
            parts = [re.escape(part) for part in f"{path.parent.resolve()}/{name}".split("\0")]
            yield re.compile(r"\w*".join(parts))


def _is_same(path: Path, read: Path) -> bool:
    try:
        return path == read or path.samefile(read)
    except (OSError, ValueError):
        return False


def forget_unsaved(*_: object) -> None:
    """Another file is being opened: know one unsaved file from the next."""
    global _unsaved
    _unsaved = f"<unsaved {os.urandom(16).hex()}>"
