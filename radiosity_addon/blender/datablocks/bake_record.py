"""The record of a bake's changes, stored in the file for Restore.

Everything a bake makes carries a marker. What is needed to bring an object back hangs on what the bake put on
it, so that it is copied along with it and also holds for library overrides:

* a mesh with the UV layer `Lightmap` of ours has a record of the layer (`uv_layers.py`);
* a stand-in mesh knows the mesh it stands for, and how its object was (`stand_ins.py`);
* `Object.radiosity_bake`, a `BakeRecord` on every object that shows a lightmap or was hidden for one.

Files of earlier versions keep all of it in the `BakeRecord`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import bpy

MADE_MARKER = "radiosity_lightmaps"
"""Custom property of the datablocks that a bake made."""

ORIGINAL = "radiosity_original"
"""Custom property of a stand-in mesh, or of a copy of a material or node group: the user's datablock that it
shows. Copies of no material have none."""

LAYER = "radiosity_layer"
"""Custom property of a mesh with a UV layer of ours; see `uv_layers.py`."""

ASIDE = ".earlier "
"""Name prefix of an earlier bake's datablocks while a new bake is prepared."""

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
    """The state of one object before the bake."""

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
        description="Shape and reflectance when the object was baked"
    )
    texels_per_metre: bpy.props.FloatProperty(  # type: ignore[valid-type]
        description="Texels per meter at a texel scale of 1"
    )
    light: bpy.props.StringProperty(  # type: ignore[valid-type]
        description="Light and settings when the object was baked"
    )
    scene: bpy.props.StringProperty(  # type: ignore[valid-type]
        description="The scene whose bake the object shows"
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
    """Register the record and add it to every object."""
    bpy.utils.register_class(ModifierRecord)
    bpy.utils.register_class(BakeRecord)
    bpy.types.Object.radiosity_bake = bpy.props.PointerProperty(type=BakeRecord)


def unregister() -> None:
    """Unregister the record's type; records stay in their files."""
    del bpy.types.Object.radiosity_bake
    bpy.utils.unregister_class(BakeRecord)
    bpy.utils.unregister_class(ModifierRecord)


def is_recorded(obj: bpy.types.Object) -> bool:
    """Whether an object has a record of a bake."""
    # Asking first: before Blender 5.0 merely reading the record would leave one in the file.
    if not obj.is_property_set("radiosity_bake"):
        return False
    return bool(obj.radiosity_bake.is_baked or obj.radiosity_bake.is_hidden)


def recorded_objects() -> list[bpy.types.Object]:
    """Every object of the file that a bake touched and Restore can bring back."""
    local = [obj for obj in bpy.data.objects if obj.library is None and not is_made(obj)]
    # The record of a library override is gone once the file was saved; its mesh stays.
    return [obj for obj in local if is_recorded(obj) or shows_lightmap(obj)]


def shows_lightmap(obj: bpy.types.Object) -> bool:
    """Whether an object's mesh is one on which a bake shows."""
    mesh = obj.data
    return isinstance(mesh, bpy.types.Mesh) and mesh.library is None and (is_made(mesh) or LAYER in mesh)


def is_baked() -> bool:
    """Whether the file shows a bake that Restore can remove."""
    return bool(recorded_objects()) or next(made_datablocks(), None) is not None


def mark_made(datablock: bpy.types.ID) -> None:
    """Mark a datablock as made by the bake, for Restore to remove."""
    datablock[MADE_MARKER] = True


def unmark_made(datablock: bpy.types.ID) -> None:
    """Remove the mark, so that Restore leaves the datablock alone."""
    datablock.pop(MADE_MARKER, None)


def is_made(datablock: bpy.types.ID) -> bool:
    """Whether a bake made this datablock."""
    return datablock.get(MADE_MARKER) is not None


def made_datablocks() -> Iterator[bpy.types.ID]:
    """Yield every datablock of this file that a bake made; linked ones are another file's."""
    for kind in _MADE_KINDS:
        yield from [block for block in getattr(bpy.data, kind) if is_made(block) and block.library is None]


def remove_datablocks(datablocks: Iterable[bpy.types.ID]) -> None:
    """Remove datablocks from the file, all at once, and the keyframes that nothing else uses."""
    blocks = list(datablocks)
    animated = [tree.animation_data for tree in blocks if isinstance(tree, bpy.types.NodeTree)]
    actions = {data.action for data in animated if data is not None and data.action is not None}
    bpy.data.batch_remove(blocks)
    bpy.data.batch_remove([action for action in actions if action.users == 0])


def record_baked(obj: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """Remember that the object shows a lightmap of this scene's bake."""
    obj.radiosity_bake.is_baked = True
    obj.radiosity_bake.scene = scene.name


def record_hiding(obj: bpy.types.Object, scene: bpy.types.Scene) -> None:
    """Remember whether the object shows in the viewport and in renders."""
    record = obj.radiosity_bake
    record.is_hidden = True
    record.hide_viewport = obj.hide_viewport
    record.hide_render = obj.hide_render
    record.scene = scene.name


def record_modifiers(obj: bpy.types.Object) -> None:
    """Remember which modifiers show, for as long as they are switched off.

    The stand-in mesh knows them too, for library overrides keep no list; but the object may get another mesh.
    """
    for modifier in obj.modifiers if obj.override_library is None else ():
        entry = obj.radiosity_bake.modifiers.add()
        entry.name = modifier.name
        entry.show_viewport, entry.show_render = modifier.show_viewport, modifier.show_render


def forget(obj: bpy.types.Object) -> None:
    """Drop the object's record, leaving no trace of it in the file."""
    obj.property_unset("radiosity_bake")
