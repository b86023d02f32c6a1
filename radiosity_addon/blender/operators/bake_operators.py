"""The operators behind the panel's buttons: each calls one function and reports its errors."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy

from ...base import RadiosityError, one_of_each
from ..files.ownership import own_reports, panel_names
from ..jobs import live_view
from ..jobs.window_job import WindowJob
from ..relight import kept_bakes
from ..relight.relight_properties import keeps, relight_of
from ..session import facts, last_bake
from ..session.redraw import redraw_sidebars
from ..session.state import session
from ..settings.preferences import output_folder
from ..settings.properties import settings_of
from .checks import look_first
from .cleaning import look_for_interrupted
from .export_operators import warn_of_outdated
from .polls import Conditional, has_folder, has_scene, no_bake_runs

if TYPE_CHECKING:
    from ...bake import KeepOptions
    from ...options import BakeSettings


class RADIOSITY_OT_bake(Conditional, WindowJob, bpy.types.Operator):
    """Bake the light of the scene into lightmaps and show them on the objects"""

    bl_idname = "radiosity.bake"
    bl_label = "Bake Radiosity"
    bl_options = {"REGISTER", "UNDO"}

    _was_editing = False

    conditions = (no_bake_runs, has_scene)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Start the bake, unless there is something to be looked at first."""
        try:
            in_window = not bpy.app.background and context.window is not None
            if in_window and look_first(context):
                self.report({"INFO"}, "This scene has problems: see the list before its first bake")
                bpy.ops.radiosity.check("INVOKE_DEFAULT")
                return {"CANCELLED"}
        except RadiosityError as error:
            return self._fail(context, error)
        return WindowJob.invoke(self, context, event)

    def _start(self, context: bpy.types.Context, in_window: bool) -> Any:
        from ..files.output import OutputFolder
        from ..jobs.farm import ended_with, farm_of
        from ..jobs.job import run_bake

        session.stop_live()
        self._was_editing = context.mode == "EDIT_MESH"
        settings = settings_of(context)
        folder = output_folder(context)
        output = None if folder is None else OutputFolder(folder, panel_names(context.scene))
        changed = context.scene.radiosity.scope == "changed"
        keeping = self._keeping(context.scene, settings)
        if in_window and context.scene.radiosity.show_while_solving:
            live_view.begin(context.scene)
        command, baking = farm_of(context)
        job = run_bake(
            context,
            settings,
            output,
            in_background=in_window,
            keeping=keeping,
            only_changed=changed,
            baking=baking,
        )
        return job if command is None else ended_with(job, command)

    @staticmethod
    def _keeping(scene: bpy.types.Scene, settings: BakeSettings) -> KeepOptions | None:
        """Return how the bake is to be kept for relighting; None if it is not."""
        from ...bake import KeepOptions

        if not keeps(scene, settings):
            return None
        chosen = relight_of(scene)
        held = kept_bakes.find(scene) if chosen.only_moved else None
        return KeepOptions(chosen.sidecar, earlier=None if held is None else held.bake)

    def _follow(self, progress: Any) -> None:
        if progress.picture is not None:
            live_view.show(progress.picture)

    def _undone(self, context: bpy.types.Context) -> None:
        """Go on with the editing that the export had to leave."""
        if self._was_editing and context.mode == "OBJECT" and bpy.ops.object.mode_set.poll():
            bpy.ops.object.mode_set(mode="EDIT")

    def _succeeded(self, context: bpy.types.Context, in_window: bool) -> None:
        look_for_interrupted(context)

        if in_window:
            show_result(context)
        report = self._report.as_dict()
        taken = sum(report["seconds"].values())
        baked = {entry["object"] for entry in report["objects"]}
        glass = sum(name not in baked for name in report["solver"].get("glass", ()))
        left_out = f" ({glass} of glass have no lightmap)" if glass else ""
        self.report({"INFO"}, f"Baked {len(baked)} objects in {taken:.1f} s{left_out}")
        for note in one_of_each(report.get("notes", ()))[:3]:
            self.report({"INFO"}, note["message"])
        warnings = one_of_each(report["warnings"])
        for warning in warnings[:3]:
            self.report({"WARNING"}, f"{warning['name']}: {warning['message']}")
        if len(warnings) > 3:
            self.report({"WARNING"}, f"and {len(warnings) - 3} more warnings, listed in the panel")
        warn_of_outdated(self, context)


class RADIOSITY_OT_restore(Conditional, bpy.types.Operator):
    """Remove the lightmaps from this scene. What you edited since the bake is kept"""

    bl_idname = "radiosity.restore"
    bl_label = "Restore"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Bring every baked object of the scene back."""
        from ..apply.restore import restore_scene

        session.stop_live()
        try:
            restored = restore_scene(context, context.scene)
        except RadiosityError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        last_bake.forget(context.scene)
        kept_bakes.drop(context.scene)
        redraw_sidebars()
        facts.refresh()
        if not restored.count:
            self.report({"INFO"}, "Nothing to restore: no object of this scene shows a lightmap")
            return {"CANCELLED"}
        self.report({"INFO"}, f"Restored {restored.count} objects")
        for warning in restored.warnings:
            self.report({"WARNING"}, warning.message)
        return {"FINISHED"}


class RADIOSITY_OT_add_cornell_box(Conditional, bpy.types.Operator):
    """Add a Cornell box that is ready to bake: to this scene if it is empty, otherwise in a new scene"""

    bl_idname = "radiosity.add_cornell_box"
    bl_label = "Add Cornell Box"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Build the box, in this scene if it is empty, and show it."""
        from ..files.cornell import build_cornell_box

        build_cornell_box()
        return {"FINISHED"}


class RADIOSITY_OT_open_folder(Conditional, bpy.types.Operator):
    """Show the lightmaps of the last bake in the file browser"""

    bl_idname = "radiosity.open_folder"
    bl_label = "Open Folder"

    conditions = (has_folder,)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Open the folder, if it really is that of a bake of this scene."""
        last = last_bake.read(context.scene)
        folder = bpy.path.abspath(last.folder) if last is not None else ""
        if not Path(folder).is_dir():
            self.report({"ERROR"}, f"The folder '{folder}' no longer exists")
            return {"CANCELLED"}
        if not own_reports(Path(folder), context.scene):
            self.report({"ERROR"}, f"The folder '{folder}' contains no bake of this scene")
            return {"CANCELLED"}
        show_folder(folder)
        return {"FINISHED"}


def show_folder(folder: str) -> None:
    """Show a folder in the system's file browser."""
    bpy.ops.wm.path_open(filepath=folder)


def show_result(context: bpy.types.Context) -> None:
    """Switch a viewport that shows no materials to the preview that does, if that is wanted.

    It has the scene's lamps and world, for no other light is to shine on baked surfaces.
    """
    space = context.space_data
    wanted = context.scene.radiosity.show_result
    if wanted and isinstance(space, bpy.types.SpaceView3D) and space.shading.type in {"WIREFRAME", "SOLID"}:
        space.shading.type = "MATERIAL"
        space.shading.use_scene_lights = space.shading.use_scene_world = True


CLASSES = (RADIOSITY_OT_bake, RADIOSITY_OT_restore, RADIOSITY_OT_add_cornell_box, RADIOSITY_OT_open_folder)
