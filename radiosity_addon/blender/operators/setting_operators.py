"""Operators that change settings: of the solver, back and forth; of an object, copied to others."""

from __future__ import annotations

import bpy

from ...options import OPTIONS, BakeSettings, Option
from ..scene_records.object_roles import has_role
from ..settings.option_properties import PREFERRED, automatic_source
from ..settings.preferences import preferences
from .panel_facts import copy_targets, has_copy_targets
from .polls import Conditional, no_bake_runs

OVERRIDES = ("radiosity_mode", "radiosity_texel_scale", "radiosity_lightmap_page")
"""Settings of single objects."""


class RADIOSITY_OT_set_option(Conditional, bpy.types.Operator):
    """Set a value, or go back to the one set by quality or preferences"""

    bl_idname = "radiosity.set_option"
    bl_label = "Set Automatically"
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
        action = f"Back to the value set by {automatic_source(option)}" if is_set else "Click to set a value"
        return f"{option.description}. {action}"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Start from the value that is in use, or unset it again."""
        group, option = context.scene.radiosity, OPTIONS.get(self.option)
        if option is None or not option.automatic:
            self.report({"ERROR"}, f"Option '{self.option}' is never set automatically")
            return {"CANCELLED"}
        if getattr(group, option.identifier):
            group.property_unset(option.identifier)
            return {"FINISHED"}
        setattr(group, option.identifier, self._automatic(context, option))
        return {"FINISHED"}

    @staticmethod
    def _automatic(context: bpy.types.Context, option: Option) -> float:
        """Return the value that an option has while it is not set."""
        from ...bake.quality import quality_of

        group = context.scene.radiosity
        preferred = getattr(preferences(context), option.name) if option.name in PREFERRED else 0.0
        known = group.quality in OPTIONS["quality"].values
        quality = quality_of(BakeSettings(method=group.method, quality=group.quality if known else "medium"))
        value: float = preferred or getattr(quality.solver, option.name)
        return value


def _can_copy(context: bpy.types.Context) -> str:
    if not has_role(getattr(context, "object", None)):
        return "The active object is not a surface and has nothing to copy"
    return "" if has_copy_targets(context) else "Select the objects to copy to, and the one to copy from last"


class RADIOSITY_OT_copy_overrides(Conditional, bpy.types.Operator):
    """Copy mode, texel scale and page of the active object to all selected objects"""

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
        self.report({"INFO"}, f"Copied mode, texel scale and page to {len(others)} objects")
        return {"FINISHED"}


CLASSES = (RADIOSITY_OT_set_option, RADIOSITY_OT_copy_overrides)
