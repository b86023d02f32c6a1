"""Operators that change settings: of the solver, back and forth; of an object, copied to others."""

from __future__ import annotations

import bpy

from ...options import OPTIONS, BakeSettings
from ..scene_records.object_roles import has_role
from .panel_facts import copy_targets, has_copy_targets
from .polls import Conditional, no_bake_runs

OVERRIDES = ("radiosity_mode", "radiosity_texel_scale")
"""Settings of single objects."""


class RADIOSITY_OT_set_option(Conditional, bpy.types.Operator):
    """Choose a value instead of the quality's, or go back to it"""

    bl_idname = "radiosity.set_option"
    bl_label = "Set by Quality"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    option: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Option", description="Name of the option", options={"SKIP_SAVE"}
    )

    @classmethod
    def description(cls, context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        """Return the tooltip: the option's own."""
        option = OPTIONS.get(properties.option)
        if option is None:
            return ""
        is_set = bool(getattr(context.scene.radiosity, option.identifier))
        action = "Back to the value set by quality" if is_set else "Click to set a value"
        return f"{option.description}. {action}"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Start from the value that the quality gives, or leave it to the quality again."""
        from ...bake.quality import quality_of

        group, option = context.scene.radiosity, OPTIONS.get(self.option)
        if option is None or not option.automatic:
            self.report({"ERROR"}, f"The quality sets no option '{self.option}'")
            return {"CANCELLED"}
        if getattr(group, option.identifier):
            group.property_unset(option.identifier)
            return {"FINISHED"}
        known = group.quality in OPTIONS["quality"].values
        quality = quality_of(BakeSettings(method=group.method, quality=group.quality if known else "medium"))
        setattr(group, option.identifier, getattr(quality.solver, option.name))
        return {"FINISHED"}


def _can_copy(context: bpy.types.Context) -> str:
    if not has_role(getattr(context, "object", None)):
        return "The active object is not a surface and has nothing to copy"
    return "" if has_copy_targets(context) else "Select the objects to copy to, and the one to copy from last"


class RADIOSITY_OT_copy_overrides(Conditional, bpy.types.Operator):
    """Copy mode and texel scale of the active object to all selected objects"""

    bl_idname = "radiosity.copy_overrides"
    bl_label = "Copy to Selected"
    bl_options = {"REGISTER", "UNDO"}

    conditions = (no_bake_runs, _can_copy)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Copy."""
        source, others = context.object, copy_targets(context)
        for obj in others:
            for name in OVERRIDES:
                if source.is_property_set(name):
                    setattr(obj, name, getattr(source, name))
                else:
                    obj.property_unset(name)
        self.report({"INFO"}, f"Copied mode and texel scale to {len(others)} objects")
        return {"FINISHED"}


CLASSES = (RADIOSITY_OT_set_option, RADIOSITY_OT_copy_overrides)
