"""What a bake yields: pages, the objects on them, and details for overlays and the report."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ...base import BakeWarning
from ...lightmap.images import LightmapPage
from ...numerics import Array
from ...scene import BakeObject
from ...solver.state import LinkRecord


@dataclass(frozen=True)
class LightGroup:
    """The lightmaps of one group's light.

    pages: Parallel to the bake's; over all groups they sum to them.
    sources: The names of the lamps, emissive materials and the world in it, each once.
    """

    name: str
    pages: tuple[LightmapPage, ...]
    sources: tuple[str, ...] = ()


@dataclass(frozen=True)
class BakedObject:
    """The lightmap of one object: its UVs and the page they point into.

    uv (count, 3, 2) float32: Per triangle corner, in [0, 1], v up; parallel to `loops`.
    page: Index into `BakeResult.pages`.
    density: Texels per meter, the median over its surface; None if it is not known.
    share: What part of its page's used texels it has; None if it is not known.
    """

    object: BakeObject
    uv: Array
    page: int
    density: float | None = None
    share: float | None = None

    @property
    def loops(self) -> Array:
        """The mesh corner (loop) of each triangle corner, (t, 3)."""
        return self.object.loops if self.object.level is None else self.object.level.loops


@dataclass(frozen=True, eq=False)
class PageDetails:
    """What is known of a page's texels besides their light.

    state (height, width) uint8: One of `TEXEL_STATES`, or `NO_TEXEL_HERE`.
    noise (height, width) float16: Estimated error of the irradiance, in units of `unit`.
    misfit (height, width) float16: Irradiance of the solver's element less that of the texel, in units of
        `unit`: what of the element's light was wrong, or too coarse.
    unit float [W/m²].
    """

    state: Array
    noise: Array
    misfit: Array
    unit: float


@dataclass(frozen=True, eq=False)
class BakeDetails:
    """What overlays show of a bake.

    pages: Parallel to the bake's; none for a bake of a residual.
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

    solver: What the report says of the solver: "method", its "settings", "elements", "links", "rays",
        "iterations", "residual", "power_W", "closure_area_mean", "history", details of the method, and in
        "glass" the names of objects that light goes through, if there are any.
    warnings: The scene's and the bake's own.
    seconds: Wall-clock time of each stage.
    atlas: Parallel to `pages`: "resolution", "texels_per_metre" of objects at texel scale 1, "utilisation"
        (the share of texels that show a surface), the number of "objects", and in "stretched" that of
        triangles whose texels are more than twice as long as wide, by reason.
    groups: Those that were requested, and one of all light that is in none of them.
    light: Parallel to `objects`: statistics of the light on their fronts, see `details.py`.
    coincident: By the names of objects that have some: triangles that are in the place of other faces.
    performance: Processor seconds of each stage and in Embree, and what rays took (`stages.py`).
    """

    pages: tuple[LightmapPage, ...]
    objects: tuple[BakedObject, ...]
    solver: dict[str, Any]
    warnings: tuple[BakeWarning, ...]
    seconds: dict[str, float] = field(default_factory=dict)
    atlas: tuple[dict[str, Any], ...] = ()
    groups: tuple[LightGroup, ...] = ()
    light: tuple[dict[str, Any], ...] = ()
    coincident: dict[str, int] = field(default_factory=dict)
    details: BakeDetails | None = None
    performance: dict[str, Any] = field(default_factory=dict)
