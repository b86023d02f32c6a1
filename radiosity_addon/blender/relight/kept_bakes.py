"""Bakes kept for relighting: in this Blender's memory, each known by a mark that its scene remembers.

The mark is saved with the file and goes back with undo, so that memory, images and a sidecar are only used
together if they are of one bake.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy

from ..datablocks.bake_record import is_made
from ..datablocks.image_marks import GROUP, MARK, PAGE
from ..session.state import session
from .relight_properties import relight_of

if TYPE_CHECKING:
    from ...bake.relight import KeptBake
    from ...numerics import Array


@dataclass(eq=False, repr=False)
class InMemory:
    """A kept bake.

    scene: The name of its scene.
    shown (s, 3): The strengths that its images show.
    """

    bake: KeptBake
    scene: str
    shown: Array


MOST_EARLIER = 1 << 30
"""Bytes of bakes in memory that no scene shows, but may show again after undo."""


def mark_of(scene: bpy.types.Scene) -> str:
    """Return the mark of the bake that a scene shows and that can be relit; "" if there is none."""
    return str(relight_of(scene).mark)


def note(scene: bpy.types.Scene, mark: str) -> None:
    """Remember the mark of a scene's new bake; "" for one that is not kept."""
    _forget(scene)
    if mark:
        scene.radiosity_relight.mark = mark


def find(scene: bpy.types.Scene | None) -> InMemory | None:
    """Return the scene's bake, if it is kept in memory."""
    return None if scene is None else session.kept_bakes.get(mark_of(scene))


def put(scene: bpy.types.Scene, mark: str, bake: KeptBake) -> InMemory:
    """Keep a scene's bake; earlier ones stay for undo, as far as there is room."""
    session.kept_bakes.pop(mark, None)
    session.kept_bakes[mark] = InMemory(bake, scene.name_full, bake.strengths)
    make_room(mark)
    return session.kept_bakes[mark]


def make_room(newest: str = "") -> None:
    """Forget the oldest of the bakes that no scene shows, except what `MOST_EARLIER` has room for."""
    shown = {newest, *map(mark_of, bpy.data.scenes)}
    earlier = [mark for mark in session.kept_bakes if mark not in shown]
    while sum(session.kept_bakes[mark].bake.nbytes for mark in earlier) > MOST_EARLIER:
        del session.kept_bakes[earlier.pop(0)]


def drop(scene: bpy.types.Scene) -> None:
    """Have the scene show no bake any more; in memory it stays for undo, if there is room."""
    _forget(scene)
    make_room()


def _forget(scene: bpy.types.Scene) -> None:
    """Have the scene remember no bake."""
    if not scene.is_property_set("radiosity_relight"):
        return
    group = scene.radiosity_relight
    group.property_unset("mark")
    group.property_unset("strengths")
    names = [prop.identifier for prop in group.bl_rna.properties if not prop.is_readonly]
    if not any(map(group.is_property_set, names)):
        scene.property_unset("radiosity_relight")


def mark_images(images: Sequence[bpy.types.Image], mark: str) -> None:
    """Have a bake's images known as its own."""
    for image in images:
        image[MARK] = mark


def images_of(mark: str) -> dict[int, bpy.types.Image]:
    """Return a bake's images of all light by page."""
    return {int(image[PAGE]): image for image in _marked(mark) if not image[GROUP]}


def group_images_of(mark: str) -> dict[str, list[bpy.types.Image]]:
    """Return the images of a bake's light groups, by group, in the order of its pages."""
    found: dict[str, list[bpy.types.Image]] = {}
    for image in sorted(_marked(mark), key=lambda image: int(image[PAGE])):
        if image[GROUP]:
            found.setdefault(image[GROUP], []).append(image)
    return found


def _marked(mark: str) -> list[bpy.types.Image]:
    own = [image for image in bpy.data.images if image.library is None and is_made(image)]
    return [image for image in own if image.get(MARK) == mark]
