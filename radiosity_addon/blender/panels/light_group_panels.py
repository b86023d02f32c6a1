"""Light groups in the sidebar, and the fields of materials and collections in the Properties editor."""

from __future__ import annotations

from typing import Any

import bpy

from ...options import GROUPS
from ..operators.panel_facts import light_mixers, listed_groups
from ..scene_records.light_membership import NAME
from ..settings.light_group_properties import ListedGroup
from .option_rows import draw_options
from .relight_panel import draw_light
from .sections import Section

_COUNTS = (
    ("lamps", "LIGHT"),
    ("objects", "OBJECT_DATA"),
    ("materials", "MATERIAL"),
    ("worlds", "WORLD"),
    ("collections", "OUTLINER_COLLECTION"),
)


class LightGroupSection(Section):
    """The scene's light groups, and the sliders of those that were baked."""

    name = "radiosity_light_groups"
    label = "Light Groups"

    @classmethod
    def draw_header(cls, header: Any, context: bpy.types.Context) -> None:
        """Draw the switch, and the name next to it."""
        header.prop(context.scene.radiosity, "use_light_groups", text="")
        super().draw_header(header, context)

    @classmethod
    def draw(cls, layout: Any, context: bpy.types.Context) -> None:
        """Draw the list, and below it the sliders."""
        draw_options(layout, GROUPS, context, in_header="light_groups")
        groups = listed_groups(context)
        column = layout.column(align=True)
        for group in groups:
            _draw_group(column.row(align=True), group)
        if not groups:
            layout.label(text="No light groups yet: select lamps", icon="INFO")
        row = layout.row(align=True)
        row.operator("radiosity.light_group_assign", text="New Group", icon="ADD").group = ""
        row.operator("radiosity.light_group_remove", text="Ungroup", icon="REMOVE")
        layout.use_property_split = True
        _draw_membership(layout, context, context.object, "Active Object")
        _draw_membership(layout, context, context.scene.world, "World")
        layout.use_property_split = False
        shown = light_mixers(context)
        for name, rows in shown:
            box = layout.box()
            if len(shown) > 1:
                box.label(text=name, icon="NODETREE", translate=False)
            for light in rows:
                draw_light(box, light)
        if shown:
            layout.operator("radiosity.light_group_reset", text="Reset", icon="LOOP_BACK")
        elif groups and not context.scene.radiosity.use_light_groups:
            layout.label(text="Tick Light Groups and bake to mix them", icon="INFO")
        elif groups:
            layout.label(text="Bake to mix them", icon="INFO")


class _NamePanel:
    """The group of what its editor shows, which Blender has no field for."""

    bl_label = "Radiosity Light Group"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_options = {"DEFAULT_CLOSED"}
    bl_context = ""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show it where there is something to name."""
        return getattr(context, cls.bl_context, None) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the name."""
        layout: Any = self.layout  # type: ignore[attr-defined]
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(getattr(context, self.bl_context), NAME)


class RADIOSITY_PT_light_group_material(_NamePanel, bpy.types.Panel):
    """The group of what a material emits."""

    bl_idname = "RADIOSITY_PT_light_group_material"
    bl_context = "material"


class RADIOSITY_PT_light_group_collection(_NamePanel, bpy.types.Panel):
    """The group of all lamps and emissive objects in a collection."""

    bl_idname = "RADIOSITY_PT_light_group_collection"
    bl_context = "collection"


def _draw_membership(layout: Any, context: bpy.types.Context, owner: Any, label: str) -> None:
    """Draw Blender's field of an object or a world, which its own editors show with Cycles alone."""
    if owner is None:
        return
    layer = context.view_layer
    row = layout.row(align=True)
    row.prop_search(owner, "lightgroup", layer, "lightgroups", text=label, results_are_suggestions=True)
    if owner.lightgroup and owner.lightgroup not in layer.lightgroups:
        row.operator("scene.view_layer_add_lightgroup", icon="ADD", text="").name = owner.lightgroup


def _draw_group(row: Any, group: ListedGroup) -> None:
    """Draw a group's name, what is in it, and its buttons."""
    row.label(text=group.name)
    for kind, icon in _COUNTS:
        number = getattr(group, kind)
        if number:
            row.label(text=str(number), icon=icon)
    row.operator("radiosity.light_group_select", text="", icon="RESTRICT_SELECT_OFF").group = group.name
    row.operator("radiosity.light_group_assign", text="", icon="IMPORT").group = group.name


CLASSES = (
    RADIOSITY_PT_light_group_material,
    RADIOSITY_PT_light_group_collection,
)
