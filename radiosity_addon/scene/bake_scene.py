"""The pipeline's input: plain arrays, no bpy.

The Blender side fills a `BakeScene` (export) and consumes a `BakeResult` (apply); the
pipeline between them knows nothing of Blender.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base import BakeWarning
from ..numerics import Array
from .scene import Scene

LIGHTMAP_UV_LAYER = "Lightmap"


@dataclass(frozen=True, eq=False)
class LevelOfDetail:
    """The mesh of an object that shows the lightmap of another one, of which it is a coarser version.

    base: The name of the other object.
    triangles (t, 3, 3): In the world.
    to_base (4, 4): Carries them to where they are if both objects have one place.
    polygon (t,), loops (t, 3): As those of `BakeObject`.
    """

    base: str
    triangles: Array
    to_base: Array
    polygon: Array
    loops: Array


@dataclass(frozen=True)
class BakeObject:
    """A run of consecutive triangles of the scene that came from one object.

    name: The original object's name, as in the report.
    first, count: Its rows of `BakeScene.scene.triangles`.
    bake: Whether it gets a lightmap; otherwise it only lights and blocks.
    polygon (count,) int32: The mesh polygon each triangle belongs to; a polygon stays in one chart.
    loops (count, 3) int32: The mesh corner (loop) of each triangle corner: UVs go back through it.
    uv (count, 3, 2) float32: The existing `Lightmap` UVs to keep; None to unwrap.
    texel_scale: Its texels per meter, relative to the other objects.
    thinning: A further factor, if a bake of part of a scene is to be like one of all of it.
    glass (count,) bool: Triangles that are glass, which get no texels; None for none.
    page: The shared page that it is to be on, from 1; 0 for any.
    level: Of a coarser level of detail, which has no triangles in the scene; None of all others.
    winding: Digest of the order in which corners go around the mesh's polygons; "" if it is not known.
    """

    name: str
    first: int
    count: int
    bake: bool
    polygon: Array
    loops: Array
    uv: Array | None = None
    texel_scale: float = 1.0
    thinning: float = 1.0
    glass: Array | None = None
    page: int = 0
    level: LevelOfDetail | None = None
    winding: str = ""

    @property
    def rows(self) -> slice:
        """The rows of its triangles in the scene."""
        return slice(self.first, self.first + self.count)

    @property
    def lit(self) -> Array:
        """(count,) bool: the triangles that get texels, if it gets a lightmap."""
        return np.ones(self.count, dtype=bool) if self.glass is None else ~self.glass


@dataclass(frozen=True)
class BakeScene:
    """A scene ready to bake: the solver's arrays, and the object of each triangle.

    scene: Triangles in world space, counter-clockwise from the front whatever the sign of the object's scale.
    objects: They partition the scene's triangles in order.
    emitter (t,) int32: Which of the emissive materials each triangle has; any number where it emits nothing.
        None treats every color of emission as a material.
    emitter_names: The names of those materials; one in several light groups occurs once for each.
    light_groups, emitter_groups: The scene's light groups of its lights and of those materials, "" for none;
        empty if the scene has no groups.
    cameras (n, 3): Where the scene's cameras are: a room has one in it.
    """

    scene: Scene
    objects: tuple[BakeObject, ...]
    warnings: tuple[BakeWarning, ...] = ()
    emitter: Array | None = None
    emitter_names: tuple[str, ...] = ()
    light_groups: tuple[str, ...] = ()
    emitter_groups: tuple[str, ...] = ()
    cameras: tuple[tuple[float, float, float], ...] = ()

    @property
    def levels(self) -> list[BakeObject]:
        """Coarser levels of detail of the objects that get a lightmap here."""
        baked = {item.name for item in self.objects if item.bake}
        return [item for item in self.objects if item.level is not None and item.level.base in baked]
