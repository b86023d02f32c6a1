"""What a single object does in a bake, in the Properties editor and in the tab."""

from __future__ import annotations

import bpy

from ..scene_records.object_roles import BAKE, has_role
from ..session.state import session


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
        """Draw mode, texel scale and page, and the button that copies them."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.active = not session.running.active
        draw_overrides(layout, context.object)


def draw_overrides(layout: bpy.types.UILayout, obj: bpy.types.Object) -> None:
    """Draw an object's own settings."""
    # Over the whole width: next to a label its three choices would not fit.
    row = layout.row(align=True)
    row.use_property_split = False
    row.prop(obj, "radiosity_mode", expand=True)
    column = layout.column()
    column.enabled = obj.radiosity_mode == BAKE
    column.prop(obj, "radiosity_texel_scale")
    column.prop(obj, "radiosity_lightmap_page")
    layout.operator("radiosity.copy_overrides", icon="COPYDOWN")


CLASSES = (RADIOSITY_PT_object_properties,)
