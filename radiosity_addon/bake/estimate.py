"""What a bake will be, told before it begins: pages, texels, memory and time, by rule of thumb.

Nothing is unwrapped and no ray is traced. The rules were fitted to the Cornell box, the office and rooms of
a thousand to a million triangles (bench/results), two cores; tests hold them to a factor of 2.5 there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ..lightmap.unwrap import assign_pages, least_pages, padding_for
from ..numerics import thread_count
from ..options import BakeSettings
from ..scene import BakeScene
from .texel_memory import least_bytes, pages_of, refuse_too_large, room

FILLED = 0.85
"""What charts and the padding around them take of a page, of what there is."""

CHARTS = 6.0
"""Charts of an object whose faces look all ways; a heavy mesh has more: one for so many …"""

TRIANGLES_A_CHART = 24.0
"""… triangles (the office)."""

RAYS_A_TEXEL = {"draft": 27.0, "medium": 48.0, "high": 140.0}
"""Rays for each texel in a scene of one triangle; in others by the fourth root of their number."""

SECONDS_A_RAY = 1.0e-6
"""On two cores, with all that is done with what a ray meets."""

SOLVE_SECONDS = {"draft": 0.14, "medium": 0.25, "high": 0.5}
"""Time to solve a scene of one triangle; others by the number of triangles to the power 0.45."""

UNWRAP_SECONDS = 60e-6
"""A triangle's time to be unwrapped and found again on the page."""

CORES = 2
"""Of the machine all this was measured on; more help by the power 0.6."""

BYTES_A_RAY, BYTES_A_TRIANGLE, BYTES_A_TEXEL, BYTES_A_PIXEL, BYTES_AT_LEAST = 6.0, 1700.0, 380.0, 40.0, 30e6
"""Memory: what rays met is kept while light is swept, more of it in scenes of more triangles, by the power
0.14; faces and links; where texels lie, and their light; the pages themselves. Beyond the memory limit it
is in files."""

UNSURE = 0.8
"""Pages that follow from a density are refused before they are laid out if so much of their width would."""


@dataclass(frozen=True)
class LightmappedObject:
    """An object that is to get a lightmap.

    Parameters
    ----------
    name : str
    triangles : int
    area : float
        In world space [m²].
    scale : float
        Its texels per meter, relative to the other objects.
    """

    name: str
    triangles: int
    area: float
    scale: float = 1.0

    @property
    def surface(self) -> float:
        """Its share of the texels [m² of objects at scale 1]."""
        return self.area * self.scale**2

    @property
    def charts(self) -> float:
        """About how many charts it has."""
        return max(min(self.triangles / 2.0, CHARTS), self.triangles / TRIANGLES_A_CHART)


@dataclass(frozen=True)
class Estimate:
    """What a bake will be.

    Parameters
    ----------
    pages : tuple of int
        Each page's width and height in texels.
    texels : tuple of float
        Parallel to the objects: about how many each gets.
    memory : float
        What it takes beside what Blender has taken already [bytes], …
    files : float
        … and what does not fit into the memory limit: temporary files take it [bytes].
    seconds : float or None
        None where it depends on what is found: an error that is asked for, and methods for study.
    """

    pages: tuple[int, ...]
    texels: tuple[float, ...]
    memory: float
    files: float
    seconds: float | None


def estimate_bake(objects: Sequence[LightmappedObject], triangles: int, settings: BakeSettings) -> Estimate:
    """Reckon what a bake will be.

    Parameters
    ----------
    objects : sequence of LightmappedObject
        Those that get a lightmap.
    triangles : int
        Of the whole scene, what only lights and blocks among them.
    settings : BakeSettings
    """
    pages, texels = _pages(objects, settings)
    total = sum(texels)
    rays = total * RAYS_A_TEXEL[settings.quality] * max(triangles, 1) ** 0.25
    memory = (
        BYTES_AT_LEAST
        + BYTES_A_RAY * max(triangles, 1) ** 0.14 * rays
        + BYTES_A_TRIANGLE * triangles
        + BYTES_A_TEXEL * total
        + BYTES_A_PIXEL * sum(page**2 for page in pages)
    )
    most = max(room(settings), least_bytes(pages, settings))
    seconds = None
    if settings.method == "hierarchical" and settings.relative_error is None:
        solving = SOLVE_SECONDS[settings.quality] * max(triangles, 1) ** 0.45
        gathering = SECONDS_A_RAY * rays
        cores = thread_count(settings.threads)
        seconds = UNWRAP_SECONDS * triangles + (solving + gathering) * (CORES / cores) ** 0.6
    in_memory = min(memory, most)
    return Estimate(tuple(pages), tuple(texels), in_memory, memory - in_memory, seconds)


def refuse_before_unwrapping(bake_scene: BakeScene, settings: BakeSettings) -> None:
    """Refuse pages that will not fit into the memory limit, as far as areas tell how large they get.

    Raises
    ------
    UsageError
        See `refuse_too_large`.
    """
    sizes = pages_of(settings)
    if sizes is None:
        areas = bake_scene.scene.areas
        lit = [
            LightmappedObject(item.name, item.count, float(areas[item.rows].sum()), item.texel_scale)
            for item in bake_scene.objects
            if item.bake and item.count
        ]
        sizes = estimate_bake(lit, len(bake_scene.scene), settings).pages
    if settings.texel_density is not None:
        # It is known roughly; what unwrapping finds decides.
        sizes = tuple(int(UNSURE * size) for size in sizes)
    refuse_too_large(sizes, settings)


def _pages(objects: Sequence[LightmappedObject], settings: BakeSettings) -> tuple[list[int], list[float]]:
    """Return the size of each page, and about how many texels each object gets."""
    padding = padding_for(settings.mip_levels) if settings.padding is None else settings.padding
    density = settings.texel_density
    surfaces = [item.surface for item in objects]
    if settings.atlas == "per-object":
        groups = [[number] for number in range(len(objects))]
    elif density is None:
        groups = assign_pages(surfaces, settings.pages)
    else:
        taken = sum(_taken(item, density, padding) for item in objects) / FILLED
        count = max(least_pages(sum(surfaces), density, settings.max_resolution), 1)
        count = max(count, math.ceil(taken / settings.max_resolution**2))
        groups = assign_pages(surfaces, count)
    pages, texels = [], [0.0] * len(objects)
    for group in groups:
        of_page = [objects[number] for number in group]
        if density is None:
            size, finest = settings.resolution, _density(of_page, settings.resolution, padding)
        else:
            finest = density
            side = math.sqrt(sum(_taken(item, density, padding) for item in of_page) / FILLED)
            size = min(max(4, 4 * math.ceil(side / 4)), settings.max_resolution)
        pages.append(size)
        for number in group:
            texels[number] = objects[number].surface * finest**2
    return pages, texels


def _taken(item: LightmappedObject, density: float, padding: float) -> float:
    """Return what the charts of an object take of a page, the padding around them included [texels]."""
    side = density * math.sqrt(item.surface / item.charts) if item.charts else 0.0
    return item.charts * (side + padding) ** 2


def _density(objects: Sequence[LightmappedObject], resolution: int, padding: float) -> float:
    """Return the texels per meter at which charts fill a page: Σ c (d √(A/c) + p)² = what there is."""
    square = sum(item.surface for item in objects)
    if square <= 0.0:
        return 0.0
    linear = padding * sum(math.sqrt(item.surface * item.charts) for item in objects)
    rest = padding**2 * sum(item.charts for item in objects) - FILLED * resolution**2
    if rest >= 0.0:
        # Not even the padding fits; a bake shrinks it.
        return math.sqrt(0.25 * FILLED * resolution**2 / square)
    return (math.sqrt(linear**2 - square * rest) - linear) / square
