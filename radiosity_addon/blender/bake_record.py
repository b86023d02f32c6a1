"""What a bake changed on each object, remembered in the file so that Restore can undo it.

Two kinds of memory, both saved with the .blend:

* `Object.radiosity_bake`, a `BakeRecord` on every object the bake touched. Its mesh pointer
  counts as a user, so the original mesh outlives saving while a copy stands in for it.
* a marker on every datablock the bake made (images, materials, meshes, node trees,
  stand-in objects, their collection), so that Restore removes these and nothing else.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import bpy

MADE_MARKER = "radiosity_lightmaps"
"""Custom property of the datablocks that a bake made."""

_MADE_KINDS = ("objects", "collections", "meshes", "materials", "node_groups", "images")
"""The collections of `bpy.data` that a bake adds to."""


class ModifierRecord(bpy.types.PropertyGroup):
    """A modifier that was switched off because its result is in the baked mesh copy."""

    # `name` comes with PropertyGroup and is the modifier's.
    show_viewport: bpy.props.BoolProperty(  # type: ignore[valid-type]
        description="The modifier showed in the viewport before the bake"
    )
    show_render: bpy.props.BoolProperty(  # type: ignore[valid-type]
        description="The modifier showed in renders before the bake"
    )


class BakeRecord(bpy.types.PropertyGroup):
    """How one object was before the bake."""

    is_baked: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Baked", description="The object shows a lightmap; Restore brings the original back"
    )
    original_mesh: bpy.props.PointerProperty(  # type: ignore[valid-type]
        type=bpy.types.Mesh, description="The mesh that the object showed before the bake"
    )
    object_slots: bpy.props.StringProperty(  # type: ignore[valid-type]
        description="Indices of the material slots that were linked to the object, not its data"
    )
    active_material_index: bpy.props.IntProperty(  # type: ignore[valid-type]
        description="The material slot that was active before the bake"
    )
    modifiers: bpy.props.CollectionProperty(  # type: ignore[valid-type]
        type=ModifierRecord, description="Modifiers that were switched off: their result is in the baked copy"
    )
    fingerprint: bpy.props.StringProperty(  # type: ignore[valid-type]
        description="What shape and reflectance were when the object was baked"
    )
    texels_per_metre: bpy.props.FloatProperty(  # type: ignore[valid-type]
        description="How fine the lightmap is, for a texel scale of 1"
    )
    is_hidden: bpy.props.BoolProperty(  # type: ignore[valid-type]
        description="Stand-ins replace the object, which was hidden"
    )
    hide_viewport: bpy.props.BoolProperty(  # type: ignore[valid-type]
        description="The object was hidden in viewports before the bake"
    )
    hide_render: bpy.props.BoolProperty(  # type: ignore[valid-type]
        description="The object was hidden from renders before the bake"
    )


def register() -> None:
    """Register the record and hang it on every object."""
    bpy.utils.register_class(ModifierRecord)
    bpy.utils.register_class(BakeRecord)
    bpy.types.Object.radiosity_bake = bpy.props.PointerProperty(type=BakeRecord)


def unregister() -> None:
    """Take the record's type away; what a file remembers stays in the file."""
    del bpy.types.Object.radiosity_bake
    bpy.utils.unregister_class(BakeRecord)
    bpy.utils.unregister_class(ModifierRecord)


def recorded_objects() -> list[bpy.types.Object]:
    """Every object of the file that a bake touched and Restore can bring back."""
    # Asking first: before Blender 5.0 merely reading the record would leave one in the file.
    local = [obj for obj in bpy.data.objects if obj.library is None]
    touched = [obj for obj in local if obj.is_property_set("radiosity_bake")]
    return [obj for obj in touched if obj.radiosity_bake.is_baked or obj.radiosity_bake.is_hidden]


def is_baked() -> bool:
    """Whether the file shows a bake, so that Restore has something to do."""
    return bool(recorded_objects()) or next(made_datablocks(), None) is not None


def mark_made(datablock: bpy.types.ID) -> None:
    """Mark a datablock as made by the bake, for Restore to remove."""
    datablock[MADE_MARKER] = True


def unmark_made(datablock: bpy.types.ID) -> None:
    """Take the mark off again: Restore will leave the datablock alone."""
    datablock.pop(MADE_MARKER, None)


def is_made(datablock: bpy.types.ID) -> bool:
    """Whether a bake made this datablock."""
    return datablock.get(MADE_MARKER) is not None


def made_datablocks() -> Iterator[bpy.types.ID]:
    """Yield every datablock of this file that a bake made; linked ones are another file's."""
    for kind in _MADE_KINDS:
        yield from [block for block in getattr(bpy.data, kind) if is_made(block) and block.library is None]


def remove_made() -> None:
    """Remove every datablock that a bake made."""
    remove_datablocks(made_datablocks())


def remove_datablocks(datablocks: Iterable[bpy.types.ID]) -> None:
    """Remove datablocks from the file, all at once, and the keyframes that nothing else uses."""
    blocks = list(datablocks)
    animated = [tree.animation_data for tree in blocks if isinstance(tree, bpy.types.NodeTree)]
    actions = {data.action for data in animated if data is not None and data.action is not None}
    bpy.data.batch_remove(blocks)
    bpy.data.batch_remove([action for action in actions if action.users == 0])


def record_mesh_swap(obj: bpy.types.Object) -> None:
    """Remember the object's mesh and how its material slots are linked."""
    record = obj.radiosity_bake
    record.is_baked = True
    record.original_mesh = obj.data
    record.active_material_index = obj.active_material_index
    linked_to_object = [i for i, slot in enumerate(obj.material_slots) if slot.link == "OBJECT"]
    record.object_slots = " ".join(map(str, linked_to_object))


def record_modifiers(obj: bpy.types.Object) -> None:
    """Remember which of the object's modifiers show."""
    record = obj.radiosity_bake
    for modifier in obj.modifiers:
        entry = record.modifiers.add()
        entry.name = modifier.name
        entry.show_viewport = modifier.show_viewport
        entry.show_render = modifier.show_render


def record_hiding(obj: bpy.types.Object) -> None:
    """Remember whether the object shows in the viewport and in renders."""
    record = obj.radiosity_bake
    record.is_hidden = True
    record.hide_viewport = obj.hide_viewport
    record.hide_render = obj.hide_render


def forget(obj: bpy.types.Object) -> None:
    """Drop the object's record, leaving no trace of it in the file."""
    obj.property_unset("radiosity_bake")
