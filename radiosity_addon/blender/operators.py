"""The operators behind the panel's buttons: each calls one function and reports its errors."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ..alike import one_of_each
from ..errors import NothingToDoError, RadiosityError
from ..remaining import RemainingTime
from . import kept_bakes, live_state, live_view, runtime
from .check_panel import look_first
from .preferences import folder_of
from .progress_text import progress_text
from .properties import settings_of
from .relight_properties import keeps

if TYPE_CHECKING:
    from ..keeping import Keeping
    from ..settings import BakeSettings

TICK = 0.005
"""Seconds of looking after the bake between two redraws: the work itself goes on in its thread."""

TURNS = 0.01
"""Seconds between two looks."""

# What still works while a bake runs: looking around.
_NAVIGATION = {
    "MOUSEMOVE",
    "INBETWEEN_MOUSEMOVE",
    "MIDDLEMOUSE",
    "WHEELUPMOUSE",
    "WHEELDOWNMOUSE",
    "TRACKPADPAN",
    "TRACKPADZOOM",
    "MOUSEROTATE",
    "NDOF_MOTION",
    "WINDOW_DEACTIVATE",
}


class RADIOSITY_OT_bake(bpy.types.Operator):
    """Bake the light of the scene into lightmaps and show them on the objects"""

    bl_idname = "radiosity.bake"
    bl_label = "Bake Radiosity"
    bl_options = {"REGISTER", "UNDO"}

    _was_editing = False
    # Blender evaluates annotations when it registers the class: no names of later imports.
    _job: Any = None  # BakeJob while a bake runs
    _report: Any = None  # BakeReport once it is done
    _timer: bpy.types.Timer | None = None
    _remaining: Any = None  # RemainingTime of the bake that runs

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Offer the bake wherever there is a scene and no bake is running."""
        if runtime.running.active:
            cls.poll_message_set("A bake is running; press Esc to cancel it")
            return False
        if context.scene is None:
            cls.poll_message_set("There is no scene")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Run the bake through."""
        try:
            self._begin(context, in_window=False)
            while not self._advance(float("inf")):
                pass
        except RadiosityError as error:
            return self._fail(context, error)
        except BaseException:
            self._end(context)
            raise
        return self._finish(context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Start the bake; a timer carries it on."""
        if bpy.app.background or context.window is None:
            return self.execute(context)
        try:
            if look_first(context):
                self.report({"INFO"}, "Look at what is odd before this scene is baked for the first time")
                bpy.ops.radiosity.check("INVOKE_DEFAULT")
                return {"CANCELLED"}
            self._begin(context, in_window=True)
        except RadiosityError as error:
            return self._fail(context, error)
        manager = context.window_manager
        self._timer = manager.event_timer_add(TURNS, window=context.window)
        manager.progress_begin(0, 100)
        context.workspace.status_text_set(iface_("Esc cancels"))
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Carry on for a tick, or cancel."""
        if event.type == "ESC" and event.value == "PRESS":
            self._end(context)
            self._return_to_edit_mode(context)
            self.report({"INFO"}, "Bake cancelled; everything is as it was")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"} if event.type in _NAVIGATION else {"RUNNING_MODAL"}
        try:
            if not self._advance(TICK):
                self._show_progress(context)
                return {"RUNNING_MODAL"}
        except RadiosityError as error:
            return self._fail(context, error)
        except BaseException:
            self._end(context)
            raise
        show_result(context)
        return self._finish(context)

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender ends the operator from outside: a window closes, or Blender quits."""
        self._end(context)

    def _begin(self, context: bpy.types.Context, in_window: bool) -> None:
        from .job import run_bake
        from .output import OutputFolder

        live_state.stop()
        self._was_editing = context.mode == "EDIT_MESH"
        settings = settings_of(context)
        folder = output_folder(context)
        self._report = None
        output = None if folder is None else OutputFolder(folder)
        changed = context.scene.radiosity.scope == "changed"
        keeping = self._keeping(context.scene, settings)
        self._job = run_bake(
            context, settings, output, patient=in_window, keeping=keeping, only_changed=changed
        )
        runtime.running.active = True
        runtime.running.stop = lambda: self._end(bpy.context)
        runtime.running.stage, runtime.running.fraction = "export", 0.0
        runtime.running.seconds_left = None
        self._remaining = RemainingTime()
        if in_window and context.scene.radiosity.show_while_solving:
            live_view.begin(context.scene)

    @staticmethod
    def _keeping(scene: bpy.types.Scene, settings: BakeSettings) -> Keeping | None:
        """Return how the bake is to be kept for relighting; None if it is not."""
        from ..keeping import Keeping

        if not keeps(scene, settings):
            return None
        chosen = scene.radiosity_relight
        held = kept_bakes.find(scene) if chosen.only_moved else None
        return Keeping(chosen.sidecar, earlier=None if held is None else held.bake)

    def _advance(self, seconds: float) -> bool:
        """Bake for about so long; True once it is done."""
        until = time.perf_counter() + seconds
        while time.perf_counter() < until:
            try:
                progress = next(self._job)
            except StopIteration as done:
                self._report = done.value
                return True
            runtime.running.stage, runtime.running.fraction = progress.stage, progress.fraction
            runtime.running.seconds_left = self._remaining.update(progress.fraction)
            if progress.picture is not None:
                live_view.show(progress.picture)
            if progress.texels is not None:
                live_view.show_texels(progress.texels)
        return False

    def _show_progress(self, context: bpy.types.Context) -> None:
        running = runtime.running
        context.window_manager.progress_update(int(100 * running.fraction))
        context.workspace.status_text_set(f"{progress_text(running)}    {iface_('Esc cancels')}")
        redraw_sidebars(context)

    def _finish(self, context: bpy.types.Context) -> set[str]:
        from .lightmap_materials import set_lightmap_only

        self._end(context)
        report = self._report.as_dict()
        if context.scene.radiosity.lightmap_only:
            set_lightmap_only(True)
        taken = sum(report["seconds"].values())
        message = rpt_("Baked {} objects in {:.1f} s")
        self.report({"INFO"}, message.format(len(report["objects"]), taken))
        warnings = one_of_each(report["warnings"])
        for warning in warnings[:3]:
            self.report({"WARNING"}, f"{warning['name']}: {warning['message']}")
        if len(warnings) > 3:
            message = rpt_("and {} more warnings, listed in the panel")
            self.report({"WARNING"}, message.format(len(warnings) - 3))
        return {"FINISHED"}

    def _fail(self, context: bpy.types.Context, error: RadiosityError) -> set[str]:
        self._end(context)
        self._return_to_edit_mode(context)
        kind = "INFO" if isinstance(error, NothingToDoError) else "ERROR"
        self.report({kind}, " ".join(str(error).split()))
        return {"CANCELLED"}

    def _return_to_edit_mode(self, context: bpy.types.Context) -> None:
        """Go on with the editing that the export had to leave."""
        if self._was_editing and context.mode == "OBJECT" and bpy.ops.object.mode_set.poll():
            bpy.ops.object.mode_set(mode="EDIT")

    def _end(self, context: bpy.types.Context) -> None:
        """Close the bake, whatever state it is in, and everything shown about it."""
        job, self._job = self._job, None
        try:
            if job is not None:
                job.close()
        finally:
            runtime.running.active, runtime.running.stop = False, None
            live_view.end()
            if self._timer is not None:
                context.window_manager.event_timer_remove(self._timer)
                context.window_manager.progress_end()
                context.workspace.status_text_set(None)
                self._timer = None
            redraw_sidebars(context)


class RADIOSITY_OT_restore(bpy.types.Operator):
    """Take the lightmaps off again: objects, materials and UV layers are as before the bake"""

    bl_idname = "radiosity.restore"
    bl_label = "Restore"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Offer it unless a bake is running."""
        if runtime.running.active:
            cls.poll_message_set("A bake is running; press Esc to cancel it")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Bring every baked object of the file back."""
        from .restore import restore

        live_state.stop()
        count = restore(context)
        for scene in bpy.data.scenes:
            runtime.forget(scene)
            kept_bakes.drop(scene)
        redraw_sidebars(context)
        if not count:
            self.report({"INFO"}, "Nothing to restore: no object shows a lightmap")
            return {"CANCELLED"}
        self.report({"INFO"}, rpt_("Restored {} objects").format(count))
        return {"FINISHED"}


class RADIOSITY_OT_add_cornell_box(bpy.types.Operator):
    """Add the Cornell box, ready to bake, to this scene if it is empty, else in a scene of its own"""

    bl_idname = "radiosity.add_cornell_box"
    bl_label = "Add Cornell Box"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Offer it unless a bake is running."""
        if runtime.running.active:
            cls.poll_message_set("A bake is running; press Esc to cancel it")
            return False
        return True

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Build the box, in this scene if it is empty, and show it."""
        from .cornell import build_cornell_box

        build_cornell_box()
        return {"FINISHED"}


class RADIOSITY_OT_open_folder(bpy.types.Operator):
    """Show the lightmaps of the last bake in the file browser"""

    bl_idname = "radiosity.open_folder"
    bl_label = "Open Folder"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Offer it where the last bake wrote files."""
        last = runtime.last_bake(context.scene)
        if last is None or not last.folder:
            cls.poll_message_set("The last bake wrote no files")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Open the folder."""
        last = runtime.last_bake(context.scene)
        folder = bpy.path.abspath(last.folder) if last is not None else ""
        if not Path(folder).is_dir():
            self.report({"ERROR"}, rpt_("The folder '{}' is not there any more").format(folder))
            return {"CANCELLED"}
        bpy.ops.wm.path_open(filepath=folder)
        return {"FINISHED"}


def output_folder(context: bpy.types.Context) -> Path | None:
    """Return where the panel's bake writes; None packs, for an unsaved file has no place."""
    folder = folder_of(context)
    if folder.startswith("//") and not bpy.data.filepath:
        return None
    return Path(bpy.path.abspath(folder)).resolve()


def show_result(context: bpy.types.Context) -> None:
    """Switch a viewport that shows no materials to the preview that does, if that is wanted."""
    space = context.space_data
    wanted = context.scene.radiosity.show_result
    if wanted and isinstance(space, bpy.types.SpaceView3D) and space.shading.type in {"WIREFRAME", "SOLID"}:
        space.shading.type = "MATERIAL"


def redraw_sidebars(context: bpy.types.Context) -> None:
    """Have the panel drawn again in every 3D viewport."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()


CLASSES = (RADIOSITY_OT_bake, RADIOSITY_OT_restore, RADIOSITY_OT_add_cornell_box, RADIOSITY_OT_open_folder)
