"""*Clean*: delete lightmap files that bakes wrote and nothing shows any more; and recovery after a crash.

A file goes only if a report lists it and it is, to the byte, what a bake wrote; if no image of the open
file shows it; and if no other .blend that is known to have been baked with it is still there.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy
from bpy.app.handlers import persistent
from bpy.app.translations import pgettext_rpt as rpt_

from . import runtime
from .operators import output_folder


@dataclass(frozen=True, eq=False, repr=False)
class Unused:
    """What nothing shows any more.

    Parameters
    ----------
    files : tuple of Path
        To be deleted.
    changed : tuple of Path
        Left alone: they are not what a bake wrote.
    """

    files: tuple[Path, ...] = ()
    changed: tuple[Path, ...] = ()


def unused_lightmaps(context: bpy.types.Context) -> Unused:
    """Find the lightmaps that bakes of the open file wrote and that it does not show."""
    from ..manifest import LIGHTMAPS, is_as_written, listed
    from .output import BLEND_NAME, PREVIEW_NAME, REPORT_NAME

    images = [image for image in bpy.data.images if image.filepath_raw]
    shown = {Path(bpy.path.abspath(each.filepath_raw, library=each.library)).resolve() for each in images}
    here = Path(bpy.data.filepath).resolve() if bpy.data.filepath else None
    files: list[Path] = []
    changed: list[Path] = []
    for folder in _folders(context):
        # A copy that the command line wrote shows all that is beside it.
        copy = folder / BLEND_NAME
        if copy.exists() and copy.resolve() != here:
            continue
        for name, told in listed(folder / REPORT_NAME).items():
            path = folder / name
            if path.suffix.lower() not in LIGHTMAPS or name == PREVIEW_NAME or not path.is_file():
                continue
            if path.resolve() in shown or _is_of_another(told["scene"], here):
                continue
            (files if is_as_written(path, told) else changed).append(path)
    return Unused(tuple(files), tuple(changed))


def delete(unused: Unused) -> int:
    """Delete the files that nothing shows, and take them off their reports; returns how many.

    Raises
    ------
    OSError
        If one cannot be deleted; those before it are gone.
    """
    from ..manifest import forget
    from .output import REPORT_NAME

    for path in unused.files:
        path.unlink()
        forget(path.parent / REPORT_NAME, [path.name])
    return len(unused.files)


def _folders(context: bpy.types.Context) -> list[Path]:
    """Where bakes of the open file have written, and where the next one would."""
    found = {output_folder(context), *map(_last_folder, bpy.data.scenes)}
    return sorted(folder for folder in found if folder is not None and folder.is_dir())


def _is_of_another(scene: str, here: Path | None) -> bool:
    """Tell whether a lightmap belongs to another .blend that is still there, and may show it."""
    return bool(scene) and Path(scene).exists() and Path(scene).resolve() != here


class RADIOSITY_OT_clean(bpy.types.Operator):
    """Delete lightmap files that bakes of this file have written and that nothing in it shows any more"""

    bl_idname = "radiosity.clean"
    bl_label = "Clean Up Lightmaps"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Offer it unless a bake is running."""
        if runtime.running.active:
            cls.poll_message_set("A bake is running; press Esc to cancel it")
            return False
        return True

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Ask first: files do not come back by undo."""
        found = unused_lightmaps(context)
        if not found.files or bpy.app.background:
            return self.execute(context)
        message = rpt_("Delete {} lightmap files that nothing shows any more? Undo does not bring them back")
        return context.window_manager.invoke_confirm(
            self, event, title="Clean Up Lightmaps", message=message.format(len(found.files))
        )

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Delete them."""
        found = unused_lightmaps(context)
        for path in found.changed:
            message = rpt_("'{}' was changed since it was baked: it is left alone")
            self.report({"WARNING"}, message.format(path.name))
        try:
            count = delete(found)
        except OSError as error:
            self.report({"ERROR"}, rpt_("Cannot delete '{}': {}").format(error.filename, error.strerror))
            return {"CANCELLED"}
        if not count:
            self.report({"INFO"}, "Nothing to clean: every lightmap of this file is shown")
            return {"CANCELLED"}
        self.report({"INFO"}, rpt_("Deleted {} lightmap files").format(count))
        return {"FINISHED"}


@persistent
def _recover(*_: object) -> None:
    """Put back what a bake that was killed while it wrote has left half done beside the file just opened."""
    from ..staging import clean_up

    for folder in {scene_folder for scene in bpy.data.scenes if (scene_folder := _last_folder(scene))}:
        if clean_up(folder):
            for image in bpy.data.images:
                if image.filepath and Path(bpy.path.abspath(image.filepath_raw)).parent.resolve() == folder:
                    image.reload()


def _last_folder(scene: bpy.types.Scene) -> Path | None:
    last = runtime.last_bake(scene) if scene.is_property_set("radiosity") else None
    if last is None or not last.folder:
        return None
    folder = Path(bpy.path.abspath(last.folder)).resolve()
    return folder if folder.is_dir() else None


def register() -> None:
    """Look after each file that is opened."""
    bpy.app.handlers.load_post.append(_recover)


def unregister() -> None:
    """Stop that."""
    if _recover in bpy.app.handlers.load_post:
        bpy.app.handlers.load_post.remove(_recover)


CLASSES = (RADIOSITY_OT_clean,)
