"""The tab *Radiosity* in the 3D viewport's sidebar."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.app.translations import pgettext_iface as iface_

from . import runtime
from .method_properties import AUTOMATIC, shown_settings
from .object_panel import draw_overrides, has_role
from .operators import output_folder
from .preferences import folder_of, preferences
from .preset_menu import RADIOSITY_PT_presets
from .progress_text import progress_text
from .properties import BY_ERROR
from .relight_buttons import draw_relight_buttons
from .wrapped_text import draw_text

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

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        """Draw the button of the presets."""
        RADIOSITY_PT_presets.draw_panel_header(self.layout)

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
        if runtime.interrupted:
            box = layout.box()
            draw_text(box, iface_("A bake was interrupted while it replaced its files"), "ERROR", context)
            box.operator("radiosity.recover", icon="RECOVER_LAST")
        draw_relight_buttons(layout, context)
        hint = unseen_hint(context)
        if hint is not None:
            draw_text(layout.box(), iface_(hint), "INFO", context)
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
        if not settings.is_property_set("output_folder"):
            _draw_preferred(column, folder_of(context), settings.output_folder)
        if output_folder(context) is None:
            text = iface_("The file is not saved: lightmaps will be packed into it")
            draw_text(layout.box(), text, "INFO", context)
        if not any(obj.type == "MESH" for obj in context.scene.objects):
            layout.operator("radiosity.add_cornell_box", icon="CUBE")


WORKBENCH = "The Workbench render engine shows no lightmaps: choose EEVEE or Cycles"
SOLID = "Solid and wireframe views show no lightmaps: switch to Material Preview"


def unseen_hint(context: bpy.types.Context) -> str | None:
    """Say why the lightmaps of a baked scene are not seen; None where they are, or there are none."""
    if runtime.last_bake(context.scene) is None:
        return None
    shading = getattr(getattr(context.space_data, "shading", None), "type", "MATERIAL")
    if context.scene.render.engine == "BLENDER_WORKBENCH" and shading != "MATERIAL":
        return WORKBENCH
    return SOLID if shading in {"SOLID", "WIREFRAME"} else None


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
        if not settings.is_property_set("threads"):
            _draw_preferred(column, preferences(context).threads, settings.threads)
        column = layout.column(heading="Viewport")
        column.prop(settings, "show_while_solving")
        column.prop(settings, "show_result")
        layout.operator("radiosity.clean", icon="BRUSH_DATA")


class RADIOSITY_PT_object(_Panel, bpy.types.Panel):
    """What the active object is there for."""

    bl_idname = "RADIOSITY_PT_object"
    bl_label = "Active Object"
    bl_parent_id = "RADIOSITY_PT_main"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show it for what can light, block or be baked."""
        return has_role(context.object) and not runtime.running.active

    def draw(self, context: bpy.types.Context) -> None:
        """Draw its settings."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.label(text=context.object.name, icon="OBJECT_DATA", translate=False)
        draw_overrides(layout, context.object)


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
            split.label(text=value, translate=False)
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
            draw_text(self.layout.box(), f"{name}: {message}", "ERROR", context)
        hidden = last.warning_count - len(last.warnings[:SHOWN_WARNINGS])
        if hidden > 0:
            text = iface_("and {} more, in the report").format(hidden)
            self.layout.label(text=text, translate=False)


def _draw_preferred(layout: Any, preferred: Any, shown: Any) -> None:
    """Say that the preferences' value counts where the scene has none of its own."""
    if preferred != shown:
        layout.label(text=iface_("From the preferences: {}").format(preferred), icon="INFO", translate=False)


def _draw_progress(layout: Any) -> None:
    """Show how far the running bake is."""
    running = runtime.running
    layout.progress(factor=running.fraction, text=progress_text(running), type="BAR")
    layout.label(text="Esc cancels", icon="CANCEL")


CLASSES = (
    RADIOSITY_PT_main,
    RADIOSITY_PT_object,
    RADIOSITY_PT_solver,
    RADIOSITY_PT_advanced,
    RADIOSITY_PT_last_bake,
    RADIOSITY_PT_warnings,
)
