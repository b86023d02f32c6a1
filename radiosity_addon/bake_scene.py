"""What goes into the pipeline and what comes out: plain arrays, no bpy.

The Blender side fills a `BakeScene` (export) and consumes a `BakeResult` (apply); the
pipeline between them knows nothing of Blender.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from .solver.arrays import Array
from .solver.scene import Scene

LIGHTMAP_UV_LAYER = "Lightmap"


@dataclass(frozen=True)
class BakeWarning:
    """Something that was not understood: whose it is, and what was used instead."""

    name: str
    message: str


@dataclass(frozen=True)
class BakeObject:
    """A run of consecutive triangles of the scene that came from one object.

    Parameters
    ----------
    name : str
        The original object's name, as the report and the user know it.
    first, count : int
        Its rows of `BakeScene.scene.triangles`.
    bake : bool
        Whether it gets a lightmap; otherwise it only lights and blocks.
    polygon : (count,) int32
        The mesh polygon each triangle belongs to; a polygon stays in one chart.
    loops : (count, 3) int32
        The mesh corner (loop) of each triangle corner: UVs go back through it.
    uv : (count, 3, 2) float32 or None
        The existing `Lightmap` UVs to keep; None to unwrap anew.
    """

    name: str
    first: int
    count: int
    bake: bool
    polygon: Array
    loops: Array
    uv: Array | None = None

    @property
    def rows(self) -> slice:
        """Where its triangles are among the scene's."""
        return slice(self.first, self.first + self.count)


@dataclass(frozen=True)
class BakeScene:
    """A scene ready to bake: the solver's arrays and whose triangles they are.

    Parameters
    ----------
    scene : Scene
        Triangles in world space, counter-clockwise from the front whatever the sign of
        the object's scale.
    objects : tuple of BakeObject
        They partition the scene's triangles in order.
    warnings : tuple of BakeWarning
    """

    scene: Scene
    objects: tuple[BakeObject, ...]
    warnings: tuple[BakeWarning, ...] = ()


@dataclass(frozen=True)
class Progress:
    """Where a bake is: the stage's name and the overall fraction done, 0 to 1."""

    stage: str
    fraction: float


@dataclass(frozen=True)
class LightmapPage:
    """One baked image.

    Parameters
    ----------
    pixels : (height, width, 3) float32
        Linear RGB of the quantity asked for. Row 0 is v = 0: the bottom, as in Blender.
    coverage : (height, width) bool
        True where a triangle covers part of the texel; the rest was dilated.
    """

    pixels: Array
    coverage: Array


@dataclass(frozen=True)
class BakedObject:
    """The lightmap of one object: its UVs and the page they point into.

    Parameters
    ----------
    object : BakeObject
    uv : (count, 3, 2) float32
        Per triangle corner, in [0, 1], v up.
    page : int
        Index into `BakeResult.pages`.
    """

    object: BakeObject
    uv: Array
    page: int


@dataclass(frozen=True)
class BakeResult:
    """All that a bake yields.

    Parameters
    ----------
    pages : tuple of LightmapPage
    objects : tuple of BakedObject
    solver : dict
        The solver's report: "elements", "links", "rays", "iterations", "residual",
        "power_W", "closure_area_mean".
    warnings : tuple of BakeWarning
        The scene's and the bake's own.
    seconds : dict of str to float
        Wall-clock time of each stage.
    """

    pages: tuple[LightmapPage, ...]
    objects: tuple[BakedObject, ...]
    solver: dict[str, Any]
    warnings: tuple[BakeWarning, ...]
    seconds: dict[str, float] = field(default_factory=dict)
