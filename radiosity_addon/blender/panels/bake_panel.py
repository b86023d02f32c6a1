"""The tab *Radiosity* in the 3D viewport's sidebar: check, bake, look, relight, export."""

from __future__ import annotations

from typing import Any

import bpy

from ...options import ADVANCED, EXPORT, LAST_BAKE, MAIN, SOLVER
from ..jobs.progress_text import progress_text
from ..operators.export_operators import is_export_outdated
from ..operators.panel_facts import can_restore, faces_to_flip, has_meshes
from ..relight import kept_bakes
from ..scene_records.object_roles import has_role
from ..session import last_bake
from ..session.state import session
from ..settings.preferences import is_packed
from ..settings.preset_menu import RADIOSITY_PT_presets
from .check_panel import CheckSection
from .face_buttons import draw_face_buttons
from .light_group_panels import LightGroupSection
from .object_panel import draw_overrides
from .option_rows import draw_options
from .overlay_panel import OverlaySection
from .relight_panel import RelightSection
from .sections import Section, draw_sections
from .wrapped_text import draw_text

SHOWN_WARNINGS = 12


class _Panel:
    """Where our panels are."""

    bl_label = "Radiosity Lightmaps"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Radiosity"


class RADIOSITY_PT_progress(_Panel, bpy.types.Panel):
    """Progress of the bake, in place of all buttons.

    A panel of its own: within one, Blender takes a progress bar under the mouse for the first label of what
    is drawn next, and shows that as a bar.
    """

    bl_idname = "RADIOSITY_PT_progress"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Show it while a bake runs."""
        return session.running.active

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the progress bar."""
        running = session.running
        self.layout.progress(factor=running.fraction, text=progress_text(running), type="BAR")
        self.layout.label(text="Esc cancels", icon="CANCEL")


class RADIOSITY_PT_main(_Panel, bpy.types.Panel):
    """The buttons, the main settings, and sections that fold."""

    bl_idname = "RADIOSITY_PT_main"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Show it unless a bake runs."""
        return not session.running.active

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        """Draw the button of the presets."""
        RADIOSITY_PT_presets.draw_panel_header(self.layout)

    def draw(self, context: bpy.types.Context) -> None:
        """Draw everything for the next bake, then everything about the last one."""
        _draw_start(self.layout, context)
        _draw_settings(self.layout, context)
        draw_sections(self.layout, NEXT_BAKE, context)
        _draw_result(self.layout, context)
        draw_sections(self.layout, RESULT, context)


def _draw_start(layout: Any, context: bpy.types.Context) -> None:
    """Draw Check and Bake."""
    if not has_meshes(context):
        layout.operator("radiosity.add_cornell_box", icon="CUBE")
    row = layout.split(factor=0.32, align=True)
    row.scale_y = 1.5
    row.operator("radiosity.check", icon="VIEWZOOM")
    row.operator("radiosity.bake", text="Bake Radiosity", icon="LIGHT_AREA")
    if session.interrupted:
        box = layout.box()
        draw_text(box, "A bake was interrupted while it replaced its files", "ERROR", context)
        box.operator("radiosity.recover", icon="RECOVER_LAST")
    draw_sections(layout, (CheckSection,), context)


def _draw_settings(layout: Any, context: bpy.types.Context) -> None:
    """Draw the main settings of the next bake."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    draw_options(layout, MAIN, context)
    if is_packed(context):
        draw_text(layout.box(), "The file is not saved: lightmaps are packed into it", "INFO", context)


def _draw_result(layout: Any, context: bpy.types.Context) -> None:
    """Draw what can be done with the last bake, and anything wrong with it."""
    if can_restore(context):
        row = layout.row(align=True)
        row.operator("radiosity.restore", icon="LOOP_BACK")
        if kept_bakes.mark_of(context.scene):
            row.operator("radiosity.relight", icon="OUTLINER_OB_LIGHT")
            row.prop(context.window_manager, "radiosity_live", toggle=True, icon="REC")
    for message in (session.live_message, session.versions.message):
        if message:
            draw_text(layout.box(), message, "ERROR", context)
    hint = unseen_hint(context)
    if hint is not None:
        draw_text(layout.box(), hint, "INFO", context)


WORKBENCH = "The Workbench render engine shows no lightmaps: choose EEVEE or Cycles"
SOLID = "Solid and wireframe views show no lightmaps: switch to Material Preview"


def unseen_hint(context: bpy.types.Context) -> str | None:
    """Say why the lightmaps of a baked scene are not seen; None where they are, or there are none."""
    if last_bake.read(context.scene) is None:
        return None
    shading = getattr(getattr(context.space_data, "shading", None), "type", "MATERIAL")
    if context.scene.render.engine == "BLENDER_WORKBENCH" and shading != "MATERIAL":
        return WORKBENCH
    return SOLID if shading in {"SOLID", "WIREFRAME"} else None


class AdvancedSection(Section):
    """Settings that most bakes leave alone."""

    name = "radiosity_advanced"
    label = "Advanced"

    @classmethod
    def draw(cls, layout: Any, context: bpy.types.Context) -> None:
        """Draw the settings."""
        layout.use_property_split = True
        draw_options(layout, ADVANCED, context)


class ObjectSection(Section):
    """Settings of the active object."""

    name = "radiosity_object"
    label = "Active Object"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show it for what can light, block or be baked."""
        return has_role(context.object)

    @classmethod
    def draw(cls, layout: Any, context: bpy.types.Context) -> None:
        """Draw its settings."""
        layout.use_property_split = True
        layout.label(text=context.object.name, icon="OBJECT_DATA", translate=False)
        draw_overrides(layout, context.object)


class SolverSection(Section):
    """The method and its settings."""

    name = "radiosity_solver"
    label = "Solver"

    @classmethod
    def draw(cls, layout: Any, context: bpy.types.Context) -> None:
        """Draw the method, and the settings that apply to it."""
        layout.use_property_split = True
        draw_options(layout, SOLVER, context)


class LastBakeSection(Section):
    """Figures of the last bake."""

    name = "radiosity_last_bake"
    label = "Last Bake"
    folded = False

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show it once there was a bake."""
        return last_bake.read(context.scene) is not None

    @classmethod
    def draw(cls, layout: Any, context: bpy.types.Context) -> None:
        """Draw the figures."""
        last = last_bake.read(context.scene) or last_bake.LastBake()
        draw_options(layout, LAST_BAKE, context)
        column = layout.column(align=True)
        for name, value in last.figures:
            split = column.split(factor=0.45)
            split.label(text=name)
            split.label(text=value, translate=False)
        for note in last.notes[:SHOWN_WARNINGS]:
            draw_text(layout.box(), note, "INFO", context)
        draw_sections(layout, (WarningsSection,), context)


class WarningsSection(Section):
    """Warnings of the last bake."""

    name = "radiosity_warnings"
    label = "Warnings"
    folded = False

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show it only if there are any."""
        last = last_bake.read(context.scene)
        return last is not None and bool(last.warnings)

    @classmethod
    def draw(cls, layout: Any, context: bpy.types.Context) -> None:
        """Draw the first warnings, and what can be done about some."""
        last = last_bake.read(context.scene) or last_bake.LastBake()
        draw_face_buttons(layout, faces_to_flip(context)[0], "bake again", context)
        for name, message in last.warnings[:SHOWN_WARNINGS]:
            draw_text(layout.box(), f"{name}: {message}", "ERROR", context)
        hidden = last.warning_count - len(last.warnings[:SHOWN_WARNINGS])
        if hidden > 0:
            layout.label(text=f"and {hidden} more, in the report", translate=False)


class ExportSection(Section):
    """Exports, and the files of bakes."""

    name = "radiosity_export"
    label = "Export"

    @classmethod
    def draw(cls, layout: Any, context: bpy.types.Context) -> None:
        """Draw what can be done with the lightmaps and their files."""
        draw_options(layout, EXPORT, context)
        layout.operator("radiosity.export", icon="EXPORT")
        if is_export_outdated(context):
            draw_text(layout.box(), "The export is older than the lightmaps", "INFO", context)
        layout.operator("radiosity.prepare_export", icon="COLLECTION_NEW")
        layout.operator("radiosity.open_folder", icon="FILE_FOLDER")
        layout.operator("radiosity.clean", icon="BRUSH_DATA")


NEXT_BAKE: tuple[type[Section], ...] = (ObjectSection, LightGroupSection, SolverSection, AdvancedSection)
"""Below the main settings, in this order."""

RESULT: tuple[type[Section], ...] = (LastBakeSection, OverlaySection, RelightSection, ExportSection)
"""Below Restore and Relight, in this order."""

CLASSES = (RADIOSITY_PT_progress, RADIOSITY_PT_main)
