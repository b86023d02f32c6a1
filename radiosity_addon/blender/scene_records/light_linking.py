"""Light and shadow linking, which a bake does not follow, and the warnings about them.

As Cycles takes a linked collection: what it excludes is spared; where it includes anything, all
that is not included is spared too. A collection without objects links nothing.
"""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ...base import BakeWarning

MAX_NAMED = 3
"""So many objects are named; of more, the number is given."""


def linking_warnings(obj: bpy.types.Object, what: str) -> list[BakeWarning]:
    """Say what of an object's linking is not followed; `what` it is, such as 'lamp'."""
    linking = getattr(obj, "light_linking", None)
    if linking is None:
        return []
    links = (
        (linking.receiver_collection, "light linking is ignored: it lights everything"),
        (linking.blocker_collection, "shadow linking is ignored: everything blocks it"),
    )
    warnings = []
    for collection, message in links:
        limits = _limits(collection) if collection is not None else ""
        if limits:
            warnings.append(BakeWarning(obj.name, f"{what} '{obj.name}': {message}, {limits}"))
    return warnings


def _limits(collection: bpy.types.Collection) -> str:
    """Return what a linked collection asks for; nothing where it links nothing."""
    members: dict[str, set[str]] = {"INCLUDE": set(), "EXCLUDE": set()}
    objects = zip(collection.collection_objects, collection.objects, strict=True)
    for link, obj in objects:
        members[link.light_linking.link_state].add(obj.name)
    children = zip(collection.collection_children, collection.children, strict=True)
    for link, child in children:
        members[link.light_linking.link_state].update(obj.name for obj in child.all_objects)
    included = members["INCLUDE"] - members["EXCLUDE"]
    if included:
        return f"not only {_list_of(included)}"
    if members["EXCLUDE"]:
        return f"also {_list_of(members['EXCLUDE'])}"
    return ""


def _list_of(names: Iterable[str]) -> str:
    ordered = sorted(names)
    listed = ", ".join(f"'{name}'" for name in ordered[:MAX_NAMED])
    more = len(ordered) - MAX_NAMED
    return f"{listed} and {more} more" if more > 0 else listed
