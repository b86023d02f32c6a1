"""Our light group field of materials and collections, and the list of a scene's light groups."""

from __future__ import annotations

from typing import NamedTuple

import bpy

from ..datablocks.bake_record import is_made
from ..scene_records.light_membership import NAME, blender_groups, group_on, lamps_by_group, name_on
from ..session import facts

LONGEST_NAME = 48
"""Characters of a group's name."""

_DESCRIPTIONS = (
    (bpy.types.Object, "Light group in files of earlier versions; Blender's own comes first"),
    (bpy.types.Material, "Light group of what this material emits, on objects that are in no group"),
    (bpy.types.World, "Light group in files of earlier versions; Blender's own comes first"),
    (
        bpy.types.Collection,
        "Light group of the lamps and emissive objects in this collection that are in no other",
    ),
)


class ListedGroup(NamedTuple):
    """One light group of a scene, as the panel lists it: how many of each kind are in it."""

    name: str
    lamps: int = 0
    objects: int = 0
    materials: int = 0
    collections: int = 0
    worlds: int = 0


def list_groups(scene: bpy.types.Scene) -> tuple[ListedGroup, ...]:
    """Return the scene's light groups by name."""
    found: dict[str, ListedGroup] = {}

    def count(name: str, kind: str, number: int = 1) -> None:
        if not name:
            return
        group = found.get(name) or ListedGroup(name)
        found[name] = group._replace(**{kind: getattr(group, kind) + number})

    listed = blender_groups(scene)
    for name in listed:
        found[name] = ListedGroup(name)
    for name, lamps in lamps_by_group(scene).items():
        count(name, "lamps", len(lamps))
    for obj in scene.objects:
        if obj.type != "LIGHT":
            count(group_on(obj, listed), "objects")
    for material in bpy.data.materials:
        if not is_made(material):
            count(name_on(material), "materials")
    for collection in (scene.collection, *scene.collection.children_recursive):
        count(name_on(collection), "collections")
    count(group_on(scene.world, listed), "worlds")
    return tuple(found[name] for name in sorted(found, key=lambda name: (name.casefold(), name)))


def _changed(_owner: bpy.types.ID, _context: bpy.types.Context) -> None:
    facts.outdate()


def _known_names(_owner: bpy.types.ID, context: bpy.types.Context, text: str) -> list[str]:
    """Suggest the groups there are while a name is typed."""
    return [group.name for group in list_groups(context.scene) if text.casefold() in group.name.casefold()]


def register() -> None:
    """Hang the name on everything that can shine, or hold what does."""
    for kind, description in _DESCRIPTIONS:
        setattr(
            kind,
            NAME,
            bpy.props.StringProperty(
                name="Light Group",
                description=description,
                maxlen=LONGEST_NAME,
                update=_changed,
                search=_known_names,
                search_options={"SUGGESTION"},
            ),
        )


def unregister() -> None:
    """Take it away; what a file holds stays in the file."""
    for kind, _ in _DESCRIPTIONS:
        delattr(kind, NAME)
