"""Names and roles in a stand-in mesh that the user has changed: given to its original.

They are no part of the shape, so they can follow even where modifiers make the mesh: the names of the mesh,
its shape keys and its vertex groups (which Blender renames along with bones), their locks, and which UV
layers are active.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import bpy

from ..datablocks.uv_layers import give_roles, roles
from .stand_ins import Names, set_stand_in, stand_in_of


def note_names(mesh: bpy.types.Mesh, obj: bpy.types.Object) -> None:
    """Have a stand-in mesh know its names, as an object shows it."""
    known = stand_in_of(mesh)
    if known is not None:
        set_stand_in(mesh, replace(known, names=_names(mesh, obj)))


def carry_names(mesh: bpy.types.Mesh, original: bpy.types.Mesh, obj: bpy.types.Object) -> bool:
    """Give the original the names and roles that were changed since they were noted.

    Returns False where vertex groups were removed or put in another order, which is an edit of the mesh.
    """
    known = stand_in_of(mesh)
    if known is None or not known.names.mesh or original.library is not None:
        return True
    before, now = known.names, _names(mesh, obj)
    if _is_renamed(before.mesh, now.mesh):
        mesh.name = before.mesh  # the name is free then
        original.name = now.mesh
    keys, own_keys = mesh.shape_keys, original.shape_keys
    if keys is not None and own_keys is not None and _is_renamed(before.shape_keys, now.shape_keys):
        keys.name = before.shape_keys
        own_keys.name = now.shape_keys
    if now.roles != before.roles:
        give_roles(original, now.roles)
    if now.groups != before.groups and not _carry_groups(original, before.groups, now.groups):
        return False
    note_names(mesh, obj)
    return True


def _names(mesh: bpy.types.Mesh, obj: bpy.types.Object) -> Names:
    return Names(
        mesh=mesh.name,
        shape_keys="" if mesh.shape_keys is None else mesh.shape_keys.name,
        groups=tuple((group.name, group.lock_weight) for group in obj.vertex_groups),
        roles=roles(mesh),
    )


def _is_renamed(before: str, now: str) -> bool:
    """Whether somebody gave another name; Blender adds numbers where a copy or an appended file comes in."""
    return re.sub(r"\.\d+$", "", before) != re.sub(r"\.\d+$", "", now)


Groups = tuple[tuple[str, bool], ...]


def _carry_groups(original: bpy.types.Mesh, before: Groups, now: Groups) -> bool:
    """Rename, lock and add the vertex groups of the original; False if that is not what was done."""
    names = [name for name, _ in before]
    new_names = [name for name, _ in now[: len(before)]]
    if (new_names != names and sorted(new_names) == sorted(names)) or len(now) < len(before):
        return False
    with _groups_of(original) as groups:
        changed = []
        if [group.name for group in groups] != [name for name, _ in now]:  # or another stand-in was first
            pairs = zip(names, new_names, strict=True)
            changed = [(groups[old], new) for old, new in pairs if old != new and old in groups]
        for number, (group, _) in enumerate(changed):
            group.name = f"radiosity {number}"  # for new names may be old ones of others
        for group, new in changed:
            group.name = new
        for name, lock in now:
            if (name, lock) not in before:
                (groups.get(name) or groups.new(name=name)).lock_weight = lock
    return True


@contextmanager
def _groups_of(mesh: bpy.types.Mesh) -> Iterator[bpy.types.VertexGroups]:
    """Yield the vertex groups of a mesh, which Blender shows of objects only."""
    holder = bpy.data.objects.new("radiosity", mesh)
    try:
        yield holder.vertex_groups
    finally:
        bpy.data.objects.remove(holder)
