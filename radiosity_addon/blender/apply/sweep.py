"""Removal of what a bake made and nothing shows any more; what the user uses of it becomes theirs."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ..datablocks.bake_record import (
    ASIDE,
    LAYER,
    ORIGINAL,
    is_made,
    is_recorded,
    made_datablocks,
    remove_datablocks,
    unmark_made,
)
from ..material_copies.material_slots import is_copy
from ..stand_ins.stand_ins import is_edited_object, moved_place, release, release_object
from .edits import EDITED

_SESSION = (bpy.types.Screen, bpy.types.WindowManager, bpy.types.WorkSpace)
"""What only looks at datablocks."""


def sweep(stand_ins: Iterable[bpy.types.Object] = ()) -> None:
    """Remove what bakes made and no object shows, and these stand-in objects.

    What something of the user's refers to is replaced by the original it stands for, or else stays as the
    user's own: a stand-in that was edited or is a parent or a target, a lightmap in a material of the user's,
    and everything that is marked as an asset or to be kept.
    """
    _remove_stand_ins(list(stand_ins))
    _remove_meshes()
    _remove_materials()
    _remove_collections()
    _remove_trees_and_images()


def _is_wanted(block: bpy.types.ID) -> bool:
    """Whether the user marked a datablock to be kept."""
    return bool(block.use_fake_user) or block.asset_data is not None


def _users(blocks: list[bpy.types.ID]) -> dict[bpy.types.ID, set[bpy.types.ID]]:
    found = bpy.data.user_map(subset=blocks) if blocks else {}
    return {
        block: {user for user in users if not isinstance(user, _SESSION)} for block, users in found.items()
    }


def _remove_stand_ins(stand_ins: list[bpy.types.Object]) -> None:
    users = _users(list(stand_ins))
    unused = []
    for obj in stand_ins:
        # A scene has all of its objects.
        others = [user for user in users.get(obj, ()) if not isinstance(user, bpy.types.Scene)]
        theirs = [user for user in others if not is_made(user)]
        placed = any(not is_made(collection) for collection in obj.users_collection)
        if is_edited_object(obj) or theirs or placed or _is_wanted(obj):
            _give_object(obj)
        else:
            unused.append(obj)
    remove_datablocks(unused)


def _give_object(obj: bpy.types.Object) -> None:
    """Make a stand-in the user's; where it still is in its instance's place it must not show as well."""
    in_place = moved_place(obj) is None
    release_object(obj)
    name = obj.name.removeprefix(ASIDE).removesuffix(EDITED).removesuffix(" (Lightmap)")
    obj.name = f"{name}{EDITED}"
    if in_place:
        obj.hide_viewport = obj.hide_render = True
    if isinstance(obj.data, bpy.types.Mesh) and is_made(obj.data):
        if obj.data.users > 1:
            obj.data = obj.data.copy()
        release(obj.data)
        obj.data.name = obj.name


def _remove_meshes() -> None:
    shown = {obj.data for obj in bpy.data.objects if obj.data is not None and _is_shown_baked(obj)}
    gone = []
    for mesh in [mesh for mesh in bpy.data.meshes if is_made(mesh) and mesh.library is None]:
        if mesh in shown:
            continue
        original = mesh.get(ORIGINAL)
        if _is_wanted(mesh) or (original is None and mesh.users):
            release(mesh)
            continue
        if mesh.users:
            mesh.user_remap(original)
        gone.append(mesh)
    # All at once: Blender looks through the whole file each time.
    remove_datablocks(gone)


def _is_shown_baked(obj: bpy.types.Object) -> bool:
    """Whether an object shows a bake, and not only shares a mesh or material with one that does."""
    return obj.library is None and (is_made(obj) or is_recorded(obj) or obj.override_library is not None)


def _remove_materials() -> None:
    shown: set[bpy.types.Material] = set()
    for mesh in bpy.data.meshes:
        if mesh.library is None and (is_made(mesh) or LAYER in mesh):
            shown.update(filter(is_copy, mesh.materials))
    for obj in bpy.data.objects:
        if _is_shown_baked(obj):
            shown.update(slot.material for slot in obj.material_slots if is_copy(slot.material))
    gone = []
    for material in [block for block in bpy.data.materials if is_made(block) and block.library is None]:
        if material in shown:
            continue
        original = material.get(ORIGINAL)
        # Edits, and with them the user's marks, have been carried to an original of this file.
        if _is_wanted(material) and (original is None or original.library is not None):
            unmark_made(material)
            material.pop(ORIGINAL, None)
            continue
        if original is not None and material.users:
            material.user_remap(original)
        gone.append(material)
    remove_datablocks(gone)


def _remove_collections() -> None:
    ours = [block for block in bpy.data.collections if is_made(block) and block.library is None]
    users = _users(list(ours))
    for collection in ours:
        if any(is_made(obj) for obj in collection.objects):
            continue
        holders = (bpy.types.Collection, bpy.types.Scene)
        if any(not isinstance(user, holders) for user in users.get(collection, ())):
            unmark_made(collection)  # somebody makes instances of it, for one
            continue
        _hand_on(collection)
        remove_datablocks([collection])


def _hand_on(collection: bpy.types.Collection) -> None:
    """Link what the user put into a collection of ours to the collections that it is in."""
    above = [
        *(scene.collection for scene in bpy.data.scenes if collection in scene.collection.children[:]),
        *(other for other in bpy.data.collections if collection in other.children[:]),
    ]
    lonely = [obj for obj in collection.objects if all(map(is_made, obj.users_collection))]
    for place in [parent for parent in above if parent.library is None]:
        for obj in lonely:
            if obj not in place.objects[:]:
                place.objects.link(obj)
        for child in collection.children:
            if child not in place.children[:]:
                place.children.link(child)


def _remove_trees_and_images() -> None:
    kinds = (bpy.types.NodeTree, bpy.types.Image)
    blocks = [block for block in made_datablocks() if isinstance(block, kinds)]
    users = _users(blocks)
    gone: set[bpy.types.ID] = set()
    while True:
        more = {
            block
            for block in blocks
            if block not in gone and not _is_wanted(block) and gone.issuperset(users.get(block, ()))
        }
        if not more:
            break
        gone |= more
    for block in blocks:
        if block not in gone and not any(is_made(user) for user in users.get(block, ())):
            unmark_made(block)
    remove_datablocks([block for block in blocks if block in gone])
