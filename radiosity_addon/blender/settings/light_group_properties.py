"""The light group's name on objects, materials, worlds and collections, and what the panel lists of it."""

from __future__ import annotations

from typing import NamedTuple

import bpy

from ..datablocks.bake_record import is_made
from ..scene_records.light_membership import NAME, lamps_by_group, name_on, named
from ..session import facts

LONGEST_NAME = 48
"""Characters of a group's name."""

_DESCRIPTIONS = (
    (bpy.types.Object, "Light group of this lamp, or of all that this object or instance emits"),
    (bpy.types.Material, "Light group of what this material emits, on objects that name no group themselves"),
    (bpy.types.World, "Light group of this world's light"),
    (
        bpy.types.Collection,
        "Light group of the lamps and emissive objects in this collection that no nearer name puts elsewhere",
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
        group = found.get(name) or ListedGroup(name)
        found[name] = group._replace(**{kind: getattr(group, kind) + number})

    for name, lamps in lamps_by_group(scene).items():
        if name:
            count(name, "lamps", len(lamps))
    for name, _ in named(obj for obj in scene.objects if obj.type != "LIGHT"):
        count(name, "objects")
    for name, _ in named(material for material in bpy.data.materials if not is_made(material)):
        count(name, "materials")
    for name, _ in named((scene.collection, *scene.collection.children_recursive)):
        count(name, "collections")
    if name_on(scene.world):
        count(name_on(scene.world), "worlds")
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
