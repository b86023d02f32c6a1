"""What single objects are there for: in the Properties editor, and one object's choices for many."""

from __future__ import annotations

import bpy

from ..scene_records.object_roles import BAKE, BAKEABLE_TYPES
from ..session.state import session

OVERRIDES = ("radiosity_mode", "radiosity_texel_scale")
"""What an object has of its own."""


def has_role(obj: bpy.types.Object | None) -> bool:
    """Tell whether an object can light, block or be baked: surfaces, and instances of collections."""
    return obj is not None and (obj.type in BAKEABLE_TYPES or obj.instance_type == "COLLECTION")


class RADIOSITY_PT_object_properties(bpy.types.Panel):
    """What the object is there for in a bake, among its other properties."""

    bl_idname = "RADIOSITY_PT_object_properties"
    bl_label = "Radiosity Lightmap"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show it for what can light, block or be baked."""
        return has_role(context.object)

    def draw(self, context: bpy.types.Context) -> None:
        """Draw mode and texel scale, and the button that gives them to others."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.active = not session.running.active
        draw_overrides(layout, context.object)


class RADIOSITY_OT_copy_overrides(bpy.types.Operator):
    """Give mode and texel scale of the active object to all selected ones"""

    bl_idname = "radiosity.copy_overrides"
    bl_label = "Copy to Selected"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Offer it where there is something to copy, and others to copy it to."""
        if session.running.active:
            cls.poll_message_set("A bake is running; press Esc to cancel it")
            return False
        if not has_role(getattr(context, "object", None)):
            cls.poll_message_set("The active object is no surface: it has nothing to copy")
            return False
        if not _others(context):
            cls.poll_message_set("Select the objects to copy to, and the one to copy from last")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Copy."""
        source, others = context.object, _others(context)
        for obj in others:
            for name in OVERRIDES:
                if source.is_property_set(name):
                    setattr(obj, name, getattr(source, name))
                else:
                    obj.property_unset(name)
        self.report({"INFO"}, f"Copied mode and texel scale to {len(others)} objects")
        return {"FINISHED"}


def _others(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The selected objects that can take what the active one has; linked ones cannot."""
    return [
        obj
        for obj in context.selected_objects
        if obj != context.object and has_role(obj) and obj.library is None
    ]


def draw_overrides(layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
    """Draw what an object has of its own."""
    # Over the whole width: beside a label its three choices would not fit.
    row = layout.row(align=True)
    row.use_property_split = False
    row.prop(obj, "radiosity_mode", expand=True)
    column = layout.column()
    column.enabled = obj.radiosity_mode == BAKE
    column.prop(obj, "radiosity_texel_scale")
    layout.operator("radiosity.copy_overrides", icon="COPYDOWN")


CLASSES = (RADIOSITY_OT_copy_overrides, RADIOSITY_PT_object_properties)
