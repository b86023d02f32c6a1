"""The operators behind *Export* and *Prepare for Export*."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy

from ...base import BakeError, RadiosityError
from ...files import FileNames, Mix, NoReportError, is_outdated, read_report
from ...options import EXPORT_FORMS, Form
from ..datablocks.bake_record import is_made
from ..datablocks.image_marks import PAGE, VERSION
from ..files.ownership import panel_names
from ..jobs.window_job import WindowJob
from ..session.facts import fact
from ..settings.preferences import output_folder
from .panel_facts import can_restore
from .polls import Conditional, has_scene, in_object_mode, no_bake_runs


def shows_lightmaps(context: bpy.types.Context) -> str:
    """Only what shows lightmaps can be exported with them."""
    return has_scene(context) or ("" if can_restore(context) else "Bake the scene first")


def chosen_forms(context: bpy.types.Context) -> Form:
    """Return the forms that the panel's check boxes choose."""
    settings = context.scene.radiosity
    names = [choice.value for choice in EXPORT_FORMS if getattr(settings, f"export_{choice.value}")]
    return Form(tuple(names), settings.sum_groups)


def export_folder(context: bpy.types.Context) -> Path | None:
    """Return where the panel's export goes: a folder of the scene's own next to its lightmaps."""
    folder = output_folder(context)
    return None if folder is None else folder / f"{panel_names(context.scene).prefix}export"


def shown_versions() -> dict[str, str]:
    """Return the digests of the lightmaps that the file shows, by name."""
    own = [image for image in bpy.data.images if is_made(image) and image.library is None]
    return {image.name: str(image.get(VERSION, "")) for image in own if image.get(PAGE) is not None}


def shown_mix(context: bpy.types.Context) -> Mix | None:
    """Return what light groups are multiplied by; None where nothing is shown that could be exported."""
    from ..exporting.export_scene import rendered_objects
    from ..exporting.shown_lightmaps import shown_lightmaps

    shown = [obj for obj in rendered_objects(context.view_layer) if obj.type == "MESH"]
    try:
        return {group.name: group.factor for group in shown_lightmaps(shown).groups}
    except RadiosityError:
        return None


@fact(unknown=False)
def is_export_outdated(context: bpy.types.Context) -> bool:
    """Whether the scene's export is of other lightmaps than those that are shown."""
    return outdated_now(context)


def outdated_now(context: bpy.types.Context) -> bool:
    """Return whether the scene's export is of other lightmaps than those shown, or mixes them otherwise."""
    folder = export_folder(context)
    if folder is None:
        return False
    try:
        report = read_report(folder / FileNames().report)
    except (OSError, NoReportError):
        return False
    return is_outdated(report, folder, shown_versions(), shown_mix(context))


def warn_of_outdated(operator: bpy.types.Operator, context: bpy.types.Context) -> None:
    """Say so, after lightmaps were changed, if there is an export of earlier ones."""
    if outdated_now(context):
        operator.report({"WARNING"}, "The export is older than the lightmaps: export again")


class RADIOSITY_OT_export(Conditional, WindowJob, bpy.types.Operator):
    """Write the scene with its lightmaps, for browsers and engines, into a folder next to the lightmaps"""

    bl_idname = "radiosity.export"
    bl_label = "Export"

    conditions = (no_bake_runs, shows_lightmaps, in_object_mode)

    def _start(self, context: bpy.types.Context, in_window: bool) -> Any:
        from ..exporting.export import run_export
        from ..files.output import OutputFolder

        form, folder = chosen_forms(context), export_folder(context)
        if not form.names:
            raise BakeError("choose at least one form to export")
        if folder is None:
            raise BakeError("save the file first: the export is written next to it")
        self._folder = folder
        output = OutputFolder(folder)
        return run_export(context, form, output, shown_versions(), in_background=in_window)

    def _succeeded(self, _context: bpy.types.Context, _in_window: bool) -> None:
        self.report({"INFO"}, f"Exported {len(self._report.files)} files into {self._folder}")
        for note in self._report.notes:
            self.report({"WARNING"}, note)


class RADIOSITY_OT_prepare_export(Conditional, bpy.types.Operator):
    """Copy the baked objects into a collection for other exporters, such as FBX and USD: with their own materials, and Lightmap as the second UV layer"""  # noqa: E501 - a tooltip

    bl_idname = "radiosity.prepare_export"
    bl_label = "Prepare for Export"
    bl_options = {"REGISTER", "UNDO"}

    conditions = (no_bake_runs, shows_lightmaps, in_object_mode)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Make the collection, or make it again."""
        from ..exporting.prepared_objects import COLLECTION, prepare

        try:
            count = prepare(context)
        except RadiosityError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report(
            {"INFO"}, f"{count} objects are in the collection '{COLLECTION}', which renders leave out"
        )
        return {"FINISHED"}


CLASSES = (RADIOSITY_OT_export, RADIOSITY_OT_prepare_export)
