"""What follows the meshes of baked objects, and cannot where a stand-in has other data.

A stand-in that shows the result of modifiers has no shape keys, and its vertices have other numbers. Objects
with vertex parents or constraints, and drivers, may read both of the user's mesh.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import bpy
from mathutils import Matrix

from ...base import BakeWarning
from ..datablocks.bake_record import is_made
from .stand_ins import own_mesh

_DATA = "data."
"""How a driver's path from an object to its mesh begins."""


def switch_drivers_on(objects: Sequence[bpy.types.Object]) -> None:
    """Have drivers work that read something of objects and can again.

    Blender switches a driver off once a path leads nowhere, and leaves it so.
    """
    for _, driver in _drivers_reading(objects):
        if not driver.is_valid and all(_resolves(target.id, target.data_path) for target in _targets(driver)):
            driver.type = driver.type  # has Blender try again


def places(context: bpy.types.Context) -> dict[str, Matrix]:
    """Return where the objects of the view layer are, by name; of the file's own and the user's."""
    objects = [obj for obj in context.view_layer.objects if obj.library is None and not is_made(obj)]
    return {obj.name: obj.matrix_world.copy() for obj in objects}


def left_behind(context: bpy.types.Context, before: Mapping[str, Matrix]) -> tuple[BakeWarning, ...]:
    """Warn of objects that moved, and of drivers that broke, because stand-ins are shown.

    before mapping of str to Matrix: `places` without lightmaps, where the objects were baked.
    """
    moved = {
        name
        for name, place in places(context).items()
        if name in before and not nearly_equal(place, before[name])
    }
    found = {}
    for name in sorted(moved):
        parent = bpy.data.objects[name, None].parent
        if parent is None or parent.name not in moved:
            message = f"object '{name}' is displaced while lightmaps show, because a copy replaces the mesh"
            found[name] = (
                f"{message} that it follows: it was baked in its own place, and Restore moves it back"
            )
    shown = [obj for obj in context.view_layer.objects if obj.data is not None and is_made(obj.data)]
    for owner, driver in _drivers_reading(shown):
        for target in _targets(driver):
            if owner.name not in found and not is_made(owner) and _is_lost(target):
                message = f"a driver of '{owner.name}' is off until Restore: the copy that shows the lightmap"
                found[owner.name] = f"{message} of object '{target.id.name}' has no '{target.data_path}'"
    return tuple(BakeWarning(name, message) for name, message in found.items())


def nearly_equal(first: Matrix, second: Matrix) -> bool:
    """Whether two transforms agree to float32 rounding."""
    size = max(max(abs(value) for value in row) for row in second)
    return all(abs(first[i][j] - second[i][j]) <= 1e-5 * size for i in range(4) for j in range(4))


def _is_lost(target: bpy.types.DriverTarget) -> bool:
    """Whether the user's mesh has what a driver reads, but not the mesh that is shown."""
    obj, path = target.id, target.data_path
    if not isinstance(obj, bpy.types.Object) or not path.startswith(_DATA) or _resolves(obj, path):
        return False
    return _resolves(own_mesh(obj), path.removeprefix(_DATA))


def _drivers_reading(objects: Sequence[bpy.types.Object]) -> Iterator[tuple[Any, bpy.types.Driver]]:
    """Yield the file's own drivers with objects among their targets, and the datablocks they move."""
    if not objects:
        return
    wanted = set(objects)
    users = bpy.data.user_map(subset=list(wanted))
    for owner in dict.fromkeys([*objects, *(user for found in users.values() for user in found)]):
        if owner.library is not None:
            continue
        for part in (owner, getattr(owner, "node_tree", None)):
            animation = getattr(part, "animation_data", None)
            for curve in () if animation is None else animation.drivers:
                if any(target.id in wanted for target in _targets(curve.driver)):
                    yield owner, curve.driver


def _targets(driver: bpy.types.Driver) -> list[bpy.types.DriverTarget]:
    """Return the targets of which a driver reads a property."""
    return [
        target
        for variable in driver.variables
        if variable.type == "SINGLE_PROP"
        for target in variable.targets
    ]


def _resolves(block: bpy.types.ID | None, path: str) -> bool:
    """Whether a path leads to something."""
    if block is None or not path:
        return False
    try:
        block.path_resolve(path)
    except ValueError:
        return False
    return True
