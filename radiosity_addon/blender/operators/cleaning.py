"""*Clean* deletes lightmaps that bakes wrote and nothing shows any more; *Recover* ends an interrupted bake.

A file goes only if a report of this .blend lists it and it is, to the byte, what a bake wrote; if no image
of the open file shows it; and if no copy `baked.blend` next to it may show it.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import bpy

from ...base import BakeError
from ...files import (
    BLEND_NAME,
    LIGHTMAPS,
    LISTED,
    PREVIEW_NAME,
    is_as_written,
    read_report,
    reports_in,
    text_of,
    without,
)
from ...publishing import clean_up, is_interrupted, write_text
from ..files.ownership import owner_of
from ..session import last_bake
from ..session.redraw import redraw_sidebars
from ..session.state import session
from ..settings.preferences import output_folder
from .polls import Conditional


@dataclass(frozen=True, eq=False, repr=False)
class UnusedFiles:
    """What nothing shows any more.

    Parameters
    ----------
    files : mapping of Path to list of str
        To be deleted: by report, the names of the files next to it.
    changed : tuple of Path
        Left alone: they are not what a bake wrote.
    """

    files: Mapping[Path, list[str]] = field(default_factory=dict)
    changed: tuple[Path, ...] = ()

    @property
    def count(self) -> int:
        """How many files are to be deleted."""
        return sum(map(len, self.files.values()))


def unused_lightmaps(context: bpy.types.Context) -> UnusedFiles:
    """Find the lightmaps that bakes of the open file wrote and that it does not show."""
    images = [image for image in bpy.data.images if image.filepath_raw]
    shown = {Path(bpy.path.abspath(each.filepath_raw, library=each.library)).resolve() for each in images}
    here = Path(bpy.data.filepath).resolve() if bpy.data.filepath else None
    files: dict[Path, list[str]] = {}
    changed: list[Path] = []
    for folder in _folders(context):
        for report, contents in reports_in(folder, owner_of(context.scene).is_source_of).items():
            # A copy that the command line wrote shows all that is listed with it.
            copy = folder / BLEND_NAME
            if BLEND_NAME in contents[LISTED] and copy.exists() and copy.resolve() != here:
                continue
            for name, entry in contents[LISTED].items():
                path = folder / name
                if path.suffix.lower() not in LIGHTMAPS or name == PREVIEW_NAME or not path.is_file():
                    continue
                if path.resolve() in shown:
                    continue
                if is_as_written(path, entry):
                    files.setdefault(folder / report, []).append(name)
                else:
                    changed.append(path)
    return UnusedFiles(files, tuple(changed))


def delete(unused: UnusedFiles) -> int:
    """Delete the files that nothing shows, and take them off their reports; returns how many.

    Raises
    ------
    OSError, BakeError
        If one cannot be deleted, or its report cannot be written; those before it are gone.
    """
    for report, names in unused.files.items():
        contents = read_report(report)
        for name in names:
            (report.parent / name).unlink()
        write_text(report, text_of(without(contents, names)))
    return unused.count


def interrupted_folders(context: bpy.types.Context) -> list[Path]:
    """Return the folders of this file's bakes in which one was killed while it published; only looks."""
    return [folder for folder in _folders(context) if is_interrupted(folder)]


def _folders(context: bpy.types.Context) -> list[Path]:
    """Return where bakes of the open file have written, and where the next one would; none in a network."""
    last = [_last_folder(scene) for scene in bpy.data.scenes]
    found = {folder for folder in (output_folder(context), *last) if folder is not None}
    # `Path.is_dir` raises for a name that is too long.
    return sorted(folder for folder in found if not _is_remote(folder) and os.path.isdir(folder))  # noqa: PTH112


def _is_remote(folder: Path) -> bool:
    """Return whether merely looking at a folder would ask another machine, which a file could name."""
    here = Path(bpy.data.filepath).drive if bpy.data.filepath else ""
    return folder.drive.startswith("\\\\") and folder.drive != here


class RADIOSITY_OT_clean(Conditional, bpy.types.Operator):
    """Delete lightmap files that bakes of this file wrote and that it no longer shows"""

    bl_idname = "radiosity.clean"
    bl_label = "Clean Up Lightmaps"
    bl_options = {"REGISTER"}

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Ask first: files do not come back by undo."""
        found = unused_lightmaps(context)
        if not found.count or bpy.app.background:
            return self.execute(context)
        message = f"Delete unused lightmap files ({found.count})? This cannot be undone"
        return context.window_manager.invoke_confirm(self, event, title="Clean Up Lightmaps", message=message)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Delete them."""
        found = unused_lightmaps(context)
        for path in found.changed:
            self.report({"WARNING"}, f"'{path.name}' was changed since it was baked; it is kept")
        try:
            count = delete(found)
        except OSError as error:
            self.report({"ERROR"}, f"Cannot delete '{error.filename}': {error.strerror}")
            return {"CANCELLED"}
        except BakeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if not count:
            self.report({"INFO"}, "Nothing to clean up: no report of this file lists an unused lightmap")
            return {"CANCELLED"}
        self.report({"INFO"}, f"Deleted unused lightmap files: {count}")
        return {"FINISHED"}


class RADIOSITY_OT_recover(Conditional, bpy.types.Operator):
    """Recover the files of the last complete bake: a bake was interrupted while it replaced them"""

    bl_idname = "radiosity.recover"
    bl_label = "Recover Lightmaps"
    bl_options = {"REGISTER"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Put them back, and have the open file show them."""
        done: list[Path] = []
        try:
            done = [folder.resolve() for folder in interrupted_folders(context) if clean_up(folder)]
        except BakeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            look_for_interrupted(context)
        if not done:
            self.report({"INFO"}, "Nothing to recover: no bake was interrupted")
            return {"CANCELLED"}
        for image in bpy.data.images:
            if image.filepath and Path(bpy.path.abspath(image.filepath_raw)).parent.resolve() in done:
                image.reload()
        self.report({"INFO"}, "Recovered the lightmaps of the last complete bake")
        return {"FINISHED"}


def look_for_interrupted(context: bpy.types.Context) -> None:
    """Have the panel say whether a bake of the open file was interrupted; files are only looked at."""
    session.interrupted = bool(interrupted_folders(context))
    redraw_sidebars()


def look_at_file(*_: object) -> None:
    """Another file was opened."""
    look_for_interrupted(bpy.context)


def _last_folder(scene: bpy.types.Scene) -> Path | None:
    last = last_bake.read(scene) if scene.is_property_set("radiosity") else None
    if last is None or not last.folder:
        return None
    return Path(bpy.path.abspath(last.folder))


CLASSES = (RADIOSITY_OT_clean, RADIOSITY_OT_recover)
