"""What overlays need of a scene's last bake, in memory for as long as the scene shows that bake."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy
import numpy as np

from .state import session

if TYPE_CHECKING:
    from ...bake.result import BakeDetails, BakeResult, PageDetails
    from ...numerics import Array
    from ...scene import BakeObject


STAND_IN_SUFFIX = " (Lightmap)"
"""What the name of an object ends with that shows the lightmap of an instance."""


@dataclass(frozen=True, eq=False, repr=False)
class KeptDetails:
    """Of one bake.

    objects: What got a lightmap.
    images: Names of the pages' images.
    bake: The scene's memory of its last bake: the details count while the scene still has it.
    megabytes: Memory of the details [MiB].
    """

    details: BakeDetails
    objects: dict[str, BakeObject]
    images: tuple[str, ...]
    bake: str
    megabytes: float

    def page_of(self, image: str) -> PageDetails | None:
        """Return what is known of an image's texels, if anything is."""
        known = dict(zip(self.images, self.details.pages, strict=False))
        return known.get(image)

    def seen(self) -> Array:
        """Return (t,) bool which of the scene's triangles are on objects with a lightmap that are shown."""
        record = self.details.links
        ends = [item.first + item.count for item in self.objects.values()]
        seen = np.zeros(max([int(record.triangle.max(initial=-1)) + 1, *ends]), dtype=bool)
        for name, item in self.objects.items():
            seen[item.rows] = _is_shown(name)
        return seen


def keep(scene: bpy.types.Scene, result: BakeResult, images: Sequence[str]) -> None:
    """Keep a bake that the scene has just remembered."""
    if result.details is not None:
        objects = {baked.object.name: baked.object for baked in result.objects}
        session.kept_details[scene.name_full] = KeptDetails(
            result.details, objects, tuple(images), scene.radiosity.last_bake, result.details.nbytes / 2**20
        )


def details_of(scene: bpy.types.Scene) -> KeptDetails | None:
    """Return what is kept of the scene's last bake; None after a reload, an undo, or without a bake."""
    found: KeptDetails | None = session.kept_details.get(scene.name_full)
    return found if found is not None and found.bake == scene.radiosity.last_bake else None


def _is_shown(name: str) -> bool:
    """Return whether an object, or the stand-in of an instance "Instancer/Object", is seen."""
    there = [bpy.data.objects.get(name + ending) for ending in ("", STAND_IN_SUFFIX)]
    return any(obj.visible_get() for obj in there if obj is not None)
