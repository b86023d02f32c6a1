"""The buttons of the panel *Light Groups*: who is in which group, and the sliders of what was baked."""

from __future__ import annotations

import bpy

from ..images.light_mixer import WHITE, mixers, sliders_of
from ..scene_records.light_membership import NAME, Membership, name_on
from ..session import facts
from ..settings.light_group_properties import LONGEST_NAME
from .polls import Conditional, has_light_groups, has_selection, in_object_mode, no_bake_runs


class RADIOSITY_OT_light_group_assign(Conditional, bpy.types.Operator):
    """Put the selected lamps, emissive objects and instances into this light group"""

    bl_idname = "radiosity.light_group_assign"
    bl_label = "Assign to Light Group"
    bl_options = {"REGISTER", "UNDO"}

    group: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Light Group",
        description="The light group's name; a new one makes a new group",
        maxlen=LONGEST_NAME,
        options={"SKIP_SAVE"},
    )

    conditions = (no_bake_runs, has_selection)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Ask for the name where none is given."""
        if self.group:
            return self.execute(context)
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Name the group on the objects."""
        name = self.group.strip()
        if not name:
            self.report({"ERROR"}, "The light group needs a name")
            return {"CANCELLED"}
        changed = _set_on_selected(context, name)
        if changed is None:
            self.report({"ERROR"}, "Linked objects cannot be changed: make them local or library overrides")
            return {"CANCELLED"}
        self.report({"INFO"}, f"{changed} objects are in light group '{name}'")
        return {"FINISHED"}


class RADIOSITY_OT_light_group_remove(Conditional, bpy.types.Operator):
    """Remove the selected objects from this light group. That of their material or collection then applies"""

    bl_idname = "radiosity.light_group_remove"
    bl_label = "Remove from Light Group"
    bl_options = {"REGISTER", "UNDO"}

    conditions = (no_bake_runs, has_selection)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Unname it."""
        changed = _set_on_selected(context, "")
        if changed is None:
            self.report({"ERROR"}, "Linked objects cannot be changed: make them local or library overrides")
            return {"CANCELLED"}
        return {"FINISHED"}


class RADIOSITY_OT_light_group_select(Conditional, bpy.types.Operator):
    """Select the lamps and objects of this light group, and those with a material that is in it"""

    bl_idname = "radiosity.light_group_select"
    bl_label = "Select Light Group"
    bl_options = {"REGISTER", "UNDO"}

    group: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Light Group", description="The light group's name", maxlen=LONGEST_NAME
    )

    conditions = (in_object_mode,)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Select them, and nothing else."""
        membership = Membership(context.scene)
        found = [obj for obj in context.view_layer.objects if self.group in _groups_of(obj, membership)]
        for obj in context.view_layer.objects:
            obj.select_set(obj in found and obj.visible_get())
        if found:
            context.view_layer.objects.active = found[0]
        return {"FINISHED"}


class RADIOSITY_OT_light_group_reset(Conditional, bpy.types.Operator):
    """Set all light groups back to white and strength 1, the light as it was baked; keyframes stay"""

    bl_idname = "radiosity.light_group_reset"
    bl_label = "Reset Light Groups"
    bl_options = {"REGISTER", "UNDO"}

    conditions = (has_light_groups,)

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Set every slider."""
        for tree in mixers():
            for sliders in sliders_of(tree):
                sliders.color.default_value, sliders.strength.default_value = WHITE, 1.0
        return {"FINISHED"}


def _set_on_selected(context: bpy.types.Context, name: str) -> int | None:
    """Put the selected objects into a group, or with "" into none; None if one of them is another file's."""
    objects = list(context.view_layer.objects.selected)
    if not all(obj.is_editable for obj in objects):
        return None
    if name:
        groups = context.view_layer.lightgroups
        # Blender does not take every name as it is.
        name = (groups.get(name) or groups.add(name=name)).name
    for obj in objects:
        obj.lightgroup = name
        obj.property_unset(NAME)
    facts.outdate()
    return len(objects)


def _groups_of(obj: bpy.types.Object, membership: Membership) -> set[str]:
    """Return the groups that an object's light may be in."""
    groups = membership.at(obj, obj)
    if obj.type == "LIGHT":
        return {groups.of_lamp}
    if groups.own:
        return {groups.own}
    return {name_on(slot.material) for slot in obj.material_slots} - {""}


CLASSES = (
    RADIOSITY_OT_light_group_assign,
    RADIOSITY_OT_light_group_remove,
    RADIOSITY_OT_light_group_select,
    RADIOSITY_OT_light_group_reset,
)
