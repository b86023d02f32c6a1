"""The tab *Radiosity* in the 3D viewport's sidebar."""

from __future__ import annotations

from typing import Any

import bpy

from . import runtime
from .method_properties import AUTOMATIC, shown_settings
from .object_roles import BAKE, BAKEABLE_TYPES
from .operators import output_folder
from .properties import BY_ERROR

SHOWN_WARNINGS = 12


class _Panel:
    """Where all our panels are."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Radiosity"


class RADIOSITY_PT_main(_Panel, bpy.types.Panel):
    """Bake, Restore, and the settings that matter."""

    bl_idname = "RADIOSITY_PT_main"
    bl_label = "Radiosity Lightmaps"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the buttons and settings."""
        layout = self.layout
        settings = context.scene.radiosity
        if runtime.running.active:
            _draw_progress(layout)
            return
        column = layout.column()
        column.scale_y = 1.5
        column.operator("radiosity.bake", text="Bake Radiosity", icon="LIGHT_AREA")
        layout.operator("radiosity.restore", icon="LOOP_BACK")
        layout.prop(settings, "scope", expand=True)
        layout.prop(settings, "size_mode", expand=True)

        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column()
        column.prop(settings, "resolution" if settings.size_mode == "resolution" else "texel_density")
        column = layout.column()
        column.prop(settings, "quality")
        if settings.quality == BY_ERROR[0]:
            column.prop(settings, "relative_error")
        column.prop(settings, "atlas")
        if settings.atlas == "shared" and settings.size_mode == "resolution":
            column.prop(settings, "pages")
        column = layout.column()
        column.prop(settings, "output_folder")
        if output_folder(context) is None:
            _draw_text(
                layout.box(), "The file is not saved: lightmaps will be packed into it", "INFO", context
            )
        if not any(obj.type == "MESH" for obj in context.scene.objects):
            layout.operator("radiosity.add_cornell_box", icon="CUBE")


class RADIOSITY_PT_advanced(_Panel, bpy.types.Panel):
    """Settings that most bakes leave alone."""

    bl_idname = "RADIOSITY_PT_advanced"
    bl_label = "Advanced"
    bl_parent_id = "RADIOSITY_PT_main"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the settings."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.enabled = not runtime.running.active
        settings = context.scene.radiosity
        column = layout.column()
        for name in ("quantity", "light", "format"):
            column.prop(settings, name)
        column = layout.column()
        if settings.size_mode == "density":
            column.prop(settings, "max_resolution")
        column.prop(settings, "mip_levels")
        column = layout.column(heading="Scene")
        column.prop(settings, "sky")
        column.prop(settings, "keep_uvs")
        column = layout.column(align=True)
        column.prop(settings, "seed")
        column.prop(settings, "threads")
        column = layout.column(heading="Viewport")
        column.prop(settings, "show_while_solving")
        column.prop(settings, "show_result")


class RADIOSITY_PT_object(_Panel, bpy.types.Panel):
    """What the active object is there for."""

    bl_idname = "RADIOSITY_PT_object"
    bl_label = "Active Object"
    bl_parent_id = "RADIOSITY_PT_main"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show it for what can light, block or be baked."""
        obj = context.object
        surface = obj is not None and (obj.type in BAKEABLE_TYPES or obj.instance_type == "COLLECTION")
        return surface and not runtime.running.active

    def draw(self, context: bpy.types.Context) -> None:
        """Draw its settings."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.label(text=context.object.name, icon="OBJECT_DATA")
        layout.prop(context.object, "radiosity_mode", expand=True)
        column = layout.column()
        column.enabled = context.object.radiosity_mode == BAKE
        column.prop(context.object, "radiosity_texel_scale")


class RADIOSITY_PT_solver(_Panel, bpy.types.Panel):
    """How the light's balance is solved."""

    bl_idname = "RADIOSITY_PT_solver"
    bl_label = "Solver"
    bl_parent_id = "RADIOSITY_PT_main"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the method, and of the settings those that apply to it."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.enabled = not runtime.running.active
        settings = context.scene.radiosity
        layout.prop(settings, "method")
        column = layout.column()
        for name in shown_settings(settings.method):
            column.prop(settings, name)
        layout.label(text=AUTOMATIC, icon="INFO")


class RADIOSITY_PT_last_bake(_Panel, bpy.types.Panel):
    """What the last bake measured."""

    bl_idname = "RADIOSITY_PT_last_bake"
    bl_label = "Last Bake"
    bl_parent_id = "RADIOSITY_PT_main"
    bl_order = 9  # below all settings

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show it once there was a bake."""
        return not runtime.running.active and runtime.last_bake(context.scene) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the figures."""
        last = runtime.last_bake(context.scene) or runtime.LastBake()
        column = self.layout.column(align=True)
        for name, value in last.figures:
            split = column.split(factor=0.45)
            split.label(text=name)
            split.label(text=value)
        self.layout.prop(context.scene.radiosity, "lightmap_only")
        if last.folder:
            self.layout.operator("radiosity.open_folder", icon="FILE_FOLDER")


class RADIOSITY_PT_warnings(_Panel, bpy.types.Panel):
    """What the last bake did not understand, and what it used instead."""

    bl_idname = "RADIOSITY_PT_warnings"
    bl_label = "Warnings"
    bl_parent_id = "RADIOSITY_PT_last_bake"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show it only where there is something to say."""
        last = runtime.last_bake(context.scene)
        return last is not None and bool(last.warnings)

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the warnings, the first ones of many."""
        last = runtime.last_bake(context.scene) or runtime.LastBake()
        for name, message in last.warnings[:SHOWN_WARNINGS]:
            _draw_text(self.layout.box(), f"{name}: {message}", "ERROR", context)
        hidden = last.warning_count - len(last.warnings[:SHOWN_WARNINGS])
        if hidden > 0:
            self.layout.label(text=f"and {hidden} more, in report.json")


def _draw_progress(layout: Any) -> None:
    """Show how far the running bake is."""
    running = runtime.running
    layout.progress(factor=running.fraction, text=f"{running.stage}  {running.fraction:.0%}", type="BAR")
    layout.label(text="Esc cancels", icon="CANCEL")


def _draw_text(layout: Any, text: str, icon: str, context: bpy.types.Context) -> None:
    """Draw a text over as many lines as the sidebar's width asks for."""
    width = context.region.width if context.region is not None else 280
    scale = context.preferences.system.ui_scale
    per_line = max(16, int((width / scale - 60) / 6.2))
    column = layout.column(align=True)
    column.scale_y = 0.85
    for number, line in enumerate(_wrapped(text, per_line)):
        column.label(text=line, icon=icon if number == 0 else "BLANK1")


def _wrapped(text: str, width: int) -> list[str]:
    """Break a text at spaces into lines of at most `width` characters."""
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + 1 + len(word) > width:
            lines.append(word)
        else:
            lines[-1] = f"{lines[-1]} {word}".strip()
    return lines


CLASSES = (
    RADIOSITY_PT_main,
    RADIOSITY_PT_object,
    RADIOSITY_PT_solver,
    RADIOSITY_PT_advanced,
    RADIOSITY_PT_last_bake,
    RADIOSITY_PT_warnings,
)
