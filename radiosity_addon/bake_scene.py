"""What goes into the pipeline and what comes out: plain arrays, no bpy.

The Blender side fills a `BakeScene` (export) and consumes a `BakeResult` (apply); the
pipeline between them knows nothing of Blender.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from .solver.arrays import Array
from .solver.link_record import LinkRecord
from .solver.scene import Scene

LIGHTMAP_UV_LAYER = "Lightmap"

NO_TEXEL_HERE = 255
"""The state of a pixel that shows no surface: it was filled from its neighbours."""

DIVIDED, HOODED, TOUCHED, SHUT_IN = 1, 2, 3, 4
TEXEL_STATES = (0, DIVIDED, HOODED, TOUCHED, SHUT_IN)
"""0: nothing is the matter. Geometry stands on the texel or a close rim is above it; something is close above
all of it; it ends at geometry; no light at all reaches it, for it is inside of something or behind it."""


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
    texel_scale : float
        Its texels per metre, relative to the other objects.
    """

    name: str
    first: int
    count: int
    bake: bool
    polygon: Array
    loops: Array
    uv: Array | None = None
    texel_scale: float = 1.0

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
    emitter : (t,) int32 or None
        Which of the emissive materials each triangle has; any number where it emits nothing. None
        takes every colour of emission for a material.
    emitter_names : tuple of str
        The names of those materials; one that is in several light groups is there once for each.
    light_groups, emitter_groups : tuple of str
        The light groups that the scene puts its lights and those materials in, "" where in none; nothing
        where it knows none.
    """

    scene: Scene
    objects: tuple[BakeObject, ...]
    warnings: tuple[BakeWarning, ...] = ()
    emitter: Array | None = None
    emitter_names: tuple[str, ...] = ()
    light_groups: tuple[str, ...] = ()
    emitter_groups: tuple[str, ...] = ()


@dataclass(frozen=True)
class Picture:
    """What the solution looks like so far: its elements, to be drawn as they are.

    Parameters
    ----------
    corners : (n, 3, 3) float32
        World space, counter-clockwise from the side that is seen.
    radiosity : (n, 3) float32 [W/m²]
    triangle : (n,) int32
        The scene's triangle that each is a part of.
    front : (n,) bool
        Whether it is on the triangle's front.
    """

    corners: Array
    radiosity: Array
    triangle: Array
    front: Array

    def __len__(self) -> int:
        return len(self.radiosity)

    def only(self, elements: Array) -> Picture:
        """Return the picture of some of its elements, given as (n,) bool."""
        return Picture(
            self.corners[elements], self.radiosity[elements], self.triangle[elements], self.front[elements]
        )


@dataclass(frozen=True, eq=False)
class LitSurfaces:
    """Triangles with a lightmap, and the texels on them.

    Parameters
    ----------
    corners : (t, 3, 3) float32
        World space, counter-clockwise from the front.
    uv : (t, 3, 2) float32
    page : (t,) int32
    triangle : (t,) int32
        The scene's triangle that each is.
    texels : tuple of (height, width) int32
        Per page, the number of the texel there, −1 for none. A large page may come coarser than it is.
    """

    corners: Array
    uv: Array
    page: Array
    triangle: Array
    texels: tuple[Array, ...]

    def only(self, triangles: Array) -> LitSurfaces:
        """Return those of the scene's triangles that are marked in a (scene triangles,) mask."""
        mine = triangles[self.triangle]
        return replace(
            self,
            corners=self.corners[mine],
            uv=self.uv[mine],
            page=self.page[mine],
            triangle=self.triangle[mine],
        )


@dataclass(frozen=True, eq=False)
class TexelPicture:
    """What the lightmaps look like so far.

    Parameters
    ----------
    surfaces : LitSurfaces
        The same for all pictures of a bake.
    radiosity : (n, 3) float32 [W/m²]
        Of the texels.
    """

    surfaces: LitSurfaces
    radiosity: Array


@dataclass(frozen=True)
class Progress:
    """Where a bake is: the stage's name and the overall fraction done, 0 to 1.

    While the scene is being solved some come with a picture of the solution so far, while its texels are
    being lit with one of these.
    """

    stage: str
    fraction: float
    picture: Picture | None = None
    texels: TexelPicture | None = None


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
class LightGroup:
    """The lightmaps of one group's light.

    Parameters
    ----------
    name : str
    pages : tuple of LightmapPage
        Parallel to the bake's; over all groups they sum to them.
    sources : tuple of str
        The names of the lamps, emissive materials and the world in it, each once.
    """

    name: str
    pages: tuple[LightmapPage, ...]
    sources: tuple[str, ...] = ()


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


@dataclass(frozen=True, eq=False)
class PageDetails:
    """What is known of a page's texels besides their light.

    Parameters
    ----------
    state : (height, width) uint8
        One of `TEXEL_STATES`, or `NO_TEXEL_HERE`.
    noise : (height, width) float16
        Estimated error of the irradiance, in units of `unit`.
    misfit : (height, width) float16
        Irradiance of the solver's element less that of the texel, in units of `unit`: what of the element's
        light was wrong, or too coarse.
    unit : float [W/m²]
    """

    state: Array
    noise: Array
    misfit: Array
    unit: float


@dataclass(frozen=True, eq=False)
class BakeDetails:
    """What overlays show of a bake.

    Parameters
    ----------
    links : LinkRecord
    pages : tuple of PageDetails
        Parallel to the bake's; none for a bake of a residual.
    """

    links: LinkRecord
    pages: tuple[PageDetails, ...]

    @property
    def nbytes(self) -> int:
        """Memory it takes."""
        arrays = [getattr(page, name) for page in self.pages for name in ("state", "noise", "misfit")]
        return self.links.nbytes + sum(int(array.nbytes) for array in arrays)


@dataclass(frozen=True)
class BakeResult:
    """All that a bake yields.

    Parameters
    ----------
    pages : tuple of LightmapPage
    objects : tuple of BakedObject
    solver : dict
        What the report says of the solver: "method", its "settings", "elements", "links", "rays",
        "iterations", "residual", "power_W", "closure_area_mean", "history", and what the method
        itself has to tell.
    warnings : tuple of BakeWarning
        The scene's and the bake's own.
    seconds : dict of str to float
        Wall-clock time of each stage.
    atlas : tuple of dict
        Parallel to `pages`: "resolution", "texels_per_metre" of objects at texel scale 1,
        "utilisation" (the share of texels that show a surface) and the number of "objects".
    groups : tuple of LightGroup
        Those that were asked for, and one of what is in none of them.
    light : tuple of dict
        Parallel to `objects`: statistics of the light on their fronts, see `bake_details.statistics`.
    details : BakeDetails or None
    """

    pages: tuple[LightmapPage, ...]
    objects: tuple[BakedObject, ...]
    solver: dict[str, Any]
    warnings: tuple[BakeWarning, ...]
    seconds: dict[str, float] = field(default_factory=dict)
    atlas: tuple[dict[str, float], ...] = ()
    groups: tuple[LightGroup, ...] = ()
    light: tuple[dict[str, Any], ...] = ()
    details: BakeDetails | None = None
