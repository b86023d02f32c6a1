"""Which light group each lamp, emissive surface and world of a scene is in.

Objects and worlds have Blender's own field, which counts if a view layer of the scene lists the group, as in
Cycles. Materials and collections have a field of ours; it is read from objects and worlds too, where files of
earlier versions hold it.

The name on an instance wins, then that on the object it shows, then that on the material that emits, then
that on the innermost collection around the object, then that on the innermost around the instance. What is
dark may be in a group too.
"""

from __future__ import annotations

from typing import NamedTuple

import bpy

NAME = "radiosity_light_group"
"""Our property of materials and collections, and of objects and worlds in files of earlier versions."""


def name_on(owner: bpy.types.ID | None) -> str:
    """Return the group that our field names; "" for none."""
    return str(getattr(owner, NAME, "")).strip()


def blender_groups(scene: bpy.types.Scene) -> frozenset[str]:
    """Return the names of the light groups that the scene's view layers list."""
    return frozenset(group.name for layer in scene.view_layers for group in layer.lightgroups)


def group_on(owner: bpy.types.Object | bpy.types.World | None, listed: frozenset[str]) -> str:
    """Return the group of an object or a world: Blender's if it is listed, else ours."""
    name = getattr(owner, "lightgroup", "")
    return name if name in listed else name_on(owner)


class PlaceGroups(NamedTuple):
    """The names that hold for all that one object, or one instance of it, shows.

    Parameters
    ----------
    own, around : str
        On the object or instance itself, and on the collections around it; "" where none is.
    """

    own: str = ""
    around: str = ""

    @property
    def of_lamp(self) -> str:
        """The group of a lamp there."""
        return self.own or self.around

    def of_material(self, material: bpy.types.Material | None) -> str:
        """Return the group of what emits there by a material."""
        return self.of_group(name_on(material))

    def of_group(self, on_material: str) -> str:
        """Return the group of what emits there by a material on which a group is named, or "" is."""
        return self.own or on_material or self.around


class Membership:
    """The names in a scene, of which those on collections are read once."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        self._listed = blender_groups(scene)
        self._around: dict[bpy.types.Object, str] = {}
        collections = _collections_of(scene)
        if any(map(name_on, collections)):
            self._around = _innermost(collections)

    def at(self, shown: bpy.types.Object, owner: bpy.types.Object) -> PlaceGroups:
        """Return the names at one place.

        Parameters
        ----------
        shown, owner : bpy.types.Object
            The originals: of an instance, the object it shows and the one that makes it; else twice the
            same.
        """
        around = self._around.get(shown, "") or self._around.get(owner, "")
        return PlaceGroups(group_on(owner, self._listed) or group_on(shown, self._listed), around)


def _collections_of(scene: bpy.types.Scene) -> list[bpy.types.Collection]:
    """Return the scene's collections, outermost first, and those of no scene, which may be instanced."""
    inside = [scene.collection, *scene.collection.children_recursive]
    elsewhere = {each for other in bpy.data.scenes for each in other.collection.children_recursive}
    return [*inside, *(each for each in bpy.data.collections if each not in elsewhere)]


def _innermost(collections: list[bpy.types.Collection]) -> dict[bpy.types.Object, str]:
    """Return for each object the name on the nearest collection around it; of several the first one's."""
    parents: dict[bpy.types.Collection, list[bpy.types.Collection]] = {each: [] for each in collections}
    for each in collections:
        for child in each.children:
            parents.setdefault(child, []).append(each)
    nearest = {each: _nearest(each, parents) for each in collections}
    found: dict[bpy.types.Object, tuple[int, str]] = {}
    for each in collections:
        distance, name = nearest[each]
        for obj in each.objects:
            if name and (obj not in found or distance < found[obj][0]):
                found[obj] = distance, name
    return {obj: name for obj, (_, name) in found.items()}


def _nearest(
    collection: bpy.types.Collection, parents: dict[bpy.types.Collection, list[bpy.types.Collection]]
) -> tuple[int, str]:
    """Return how many collections further out the first name is, and the name; "" where none is."""
    level, seen, distance = [collection], {collection}, 0
    while level:
        name = next(filter(None, map(name_on, level)), "")
        if name:
            return distance, name
        level = [outer for each in level for outer in parents.get(each, ()) if outer not in seen]
        seen.update(level)
        distance += 1
    return distance, ""


def lamps_by_group(scene: bpy.types.Scene) -> dict[str, list[bpy.types.Object]]:
    """Return the lamps of each group, by its name; lamps that only instances show are not among them."""
    membership = Membership(scene)
    found: dict[str, list[bpy.types.Object]] = {}
    for obj in scene.objects:
        if obj.type == "LIGHT":
            found.setdefault(membership.at(obj, obj).of_lamp, []).append(obj)
    return found
