"""What a single material does in a bake, in the Properties editor."""

from __future__ import annotations

import bpy

from ..datablocks.bake_record import is_made
from ..scene_records.glass import NAME
from ..session.state import session


class RADIOSITY_PT_material_glass(bpy.types.Panel):
    """Whether light goes through a material's glass."""

    bl_idname = "RADIOSITY_PT_material_glass"
    bl_label = "Radiosity Lightmap"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Show it for the user's own materials."""
        return context.material is not None and not is_made(context.material)

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the choice."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.active = not session.running.active
        layout.prop(context.material, NAME)


CLASSES = (RADIOSITY_PT_material_glass,)
