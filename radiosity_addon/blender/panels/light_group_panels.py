"""Light groups in the sidebar, and their names in the properties of what has them."""

from __future__ import annotations

from typing import Any

import bpy

from ...options import GROUPS
from ..operators.panel_facts import light_mixers, listed_groups
from ..scene_records.light_membership import NAME
from ..scene_records.object_roles import BAKEABLE_TYPES
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
            layout.label(text="No light group yet: select lamps", icon="INFO")
        row = layout.row(align=True)
        row.operator("radiosity.light_group_assign", text="New Group", icon="ADD").group = ""
        row.operator("radiosity.light_group_remove", text="Ungroup", icon="REMOVE")
        if context.scene.world is not None:
            layout.prop(context.scene.world, NAME, text="World")
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
    """A light group's name, at home with what it is on."""

    bl_label = "Radiosity Light Group"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def owner(cls, context: bpy.types.Context) -> bpy.types.ID | None:
        """Return what the name is on."""
        raise NotImplementedError

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show it where there is something to name."""
        return cls.owner(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the name."""
        layout: Any = self.layout  # type: ignore[attr-defined]
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(self.owner(context), NAME)


class RADIOSITY_PT_light_group_object(_NamePanel, bpy.types.Panel):
    """The group of an object: a lamp, what may emit, or an instance of a collection."""

    bl_idname = "RADIOSITY_PT_light_group_object"
    bl_context = "object"

    @classmethod
    def owner(cls, context: bpy.types.Context) -> bpy.types.ID | None:
        """Return the object shown, if it can shine."""
        obj = context.object
        shines = obj is not None and (obj.type in (*BAKEABLE_TYPES, "LIGHT") or obj.instance_type != "NONE")
        return obj if shines else None


class RADIOSITY_PT_light_group_lamp(_NamePanel, bpy.types.Panel):
    """The same of a lamp, where its power is."""

    bl_idname = "RADIOSITY_PT_light_group_lamp"
    bl_context = "data"

    @classmethod
    def owner(cls, context: bpy.types.Context) -> bpy.types.ID | None:
        """Return the lamp object; the name is on the object, for lamps share their data."""
        obj = context.object
        return obj if obj is not None and obj.type == "LIGHT" else None


class RADIOSITY_PT_light_group_material(_NamePanel, bpy.types.Panel):
    """The group of what a material emits."""

    bl_idname = "RADIOSITY_PT_light_group_material"
    bl_context = "material"

    @classmethod
    def owner(cls, context: bpy.types.Context) -> bpy.types.ID | None:
        """Return the material shown."""
        return getattr(context, "material", None)


class RADIOSITY_PT_light_group_world(_NamePanel, bpy.types.Panel):
    """The group of a world's light."""

    bl_idname = "RADIOSITY_PT_light_group_world"
    bl_context = "world"

    @classmethod
    def owner(cls, context: bpy.types.Context) -> bpy.types.ID | None:
        """Return the world shown."""
        return getattr(context, "world", None)


class RADIOSITY_PT_light_group_collection(_NamePanel, bpy.types.Panel):
    """The group of all lamps and emissive objects in a collection."""

    bl_idname = "RADIOSITY_PT_light_group_collection"
    bl_context = "collection"

    @classmethod
    def owner(cls, context: bpy.types.Context) -> bpy.types.ID | None:
        """Return the collection shown."""
        return getattr(context, "collection", None)


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
    RADIOSITY_PT_light_group_object,
    RADIOSITY_PT_light_group_lamp,
    RADIOSITY_PT_light_group_material,
    RADIOSITY_PT_light_group_world,
    RADIOSITY_PT_light_group_collection,
)
