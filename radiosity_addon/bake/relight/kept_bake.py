"""A bake kept in memory, and its lightmaps for other strengths of its lights: no ray is traced.

What is kept is light-independent (geometry and reflectance): gather hits, each lamp's gain at each texel,
the hierarchy's links. Color and power of lamps, emission, and the world's color and strength may change;
anything that moves, turns or reflects differently needs a new bake.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ...base import SILENT, BakeError, BakeWarning, Progress
from ...lightmap.images import LightmapPage, Seams, presentable, texel_pages, to_quantity
from ...lightmap.lighting import estimated_error, kept_bytes, relight_texels
from ...lightmap.texels import TexelGeometry
from ...lightmap.transport import LightingRecord, RelightableTexels, TexelLight
from ...lightmap.unwrap import Atlas
from ...numerics import Array, Scratch, one_blas_thread, tiles
from ...options import BakeSettings
from ...scene import BakeScene
from ...solver.element_transport import Relightable
from ...solver.emitters import LightSources
from ..scene_diff import SceneRecord, scene_record

DAMAGED = (
    *(ValueError, KeyError, TypeError, IndexError, AttributeError, OverflowError),
    *(FloatingPointError, ZeroDivisionError, RecursionError, MemoryError, np.linalg.LinAlgError),
)
"""What computing with a sidecar can raise that is not as it was written."""


NOISIER, MORE_NOISE = 2.0, 0.01
"""Relit lightmaps whose noise is so many times that of the bake, and more by so much, cause a warning."""


@dataclass(frozen=True, eq=False)
class HierarchyReport:
    """What a bake reports of its hierarchy: the solver's part of the report, and warnings."""

    report: dict[str, Any]
    warnings: tuple[BakeWarning, ...]


@dataclass(frozen=True, eq=False)
class IncrementalState:
    """What an incremental bake needs of a kept bake after some objects moved (`rebaking.py`).

    Attributes
    ----------
    atlas : Atlas
        Where charts lie.
    traced : LightingRecord
        How texels were lit.
    solved : HierarchyReport
        Of the bake that the hierarchy was solved for.
    """

    atlas: Atlas
    traced: LightingRecord
    solved: HierarchyReport


@dataclass(frozen=True, eq=False)
class KeptBake:
    """All that relighting needs of a bake.

    Attributes
    ----------
    bake_scene, settings
        The bake's.
    solved : Relightable
    lit : RelightableTexels
    geometry, seams, rings
        The texels, what is stitched, and how far pages are dilated [texels].
    reflectance, emission : (n, 3) float64
        Of the texels as they show; emission [W/m²] as it was baked.
    moves : IncrementalState or None
        Without it nothing can be moved.
    origin : str
        The sidecar that it was read from, if it was.
    """

    bake_scene: BakeScene
    settings: BakeSettings
    solved: Relightable
    lit: RelightableTexels
    geometry: TexelGeometry
    seams: Seams | None
    rings: int
    reflectance: Array
    emission: Array
    moves: IncrementalState | None = None
    origin: str = ""

    @property
    def sources(self) -> LightSources:
        """What can be changed."""
        return self.solved.sources

    @property
    def names(self) -> tuple[str, ...]:
        """Of the sources: lamps', the world's, and emissive materials'."""
        names = [light.name for light in self.sources.lights]
        count = len(self.sources) - len(names)
        given = self.bake_scene.emitter_names or tuple(f"emission {1 + row}" for row in range(count))
        return (*names, *given[:count])

    @property
    def groups(self) -> tuple[str, ...]:
        """The light groups that the scene puts the sources in; "" where in none."""
        lights = self.bake_scene.light_groups or ("",) * len(self.sources.lights)
        count = len(self.sources) - len(lights)
        return (*lights, *(self.bake_scene.emitter_groups or ("",) * count)[:count])

    @property
    def strengths(self) -> Array:
        """(s, 3) The sources' strengths as they were baked, see `LightSources`."""
        return np.asarray(self.sources.strengths)

    @property
    def nbytes(self) -> int:
        """What the texels' part takes in memory."""
        return kept_bytes(self.lit)

    @cached_property
    def record(self) -> SceneRecord:
        """What is compared with other exports of the scene."""
        return scene_record(self.bake_scene, self.settings, self.geometry.uv)


@one_blas_thread()
def relight_pages(kept: KeptBake, strengths: Array, progress: Progress = SILENT) -> tuple[LightmapPage, ...]:
    """Compute the lightmaps for other strengths of the sources.

    Parameters
    ----------
    strengths : (s, 3) float
        See `KeptBake.strengths`.

    Raises
    ------
    SceneError
        If the sources cannot have them.
    BakeError
        If no light comes of it: the sidecar that the bake was read from is damaged.
    """
    wanted = kept.sources.checked(strengths)
    if not kept.origin:
        return _relight(kept, wanted, progress)
    try:
        return _relight(kept, wanted, progress)
    except (*DAMAGED, BakeError) as error:
        raise damaged(kept.origin) from error


def estimated_errors(kept: KeptBake, strengths: Array) -> tuple[float, float]:
    """Estimate the relative RMS error of lightmaps as they were baked, and relit with strengths (s, 3)."""
    before, now = (
        estimated_error(kept.lit, kept.solved, lights, kept.geometry.scratch)
        for lights in (kept.strengths, kept.sources.checked(strengths))
    )
    return before, now


def noise_warnings(before: float, now: float) -> tuple[BakeWarning, ...]:
    """Warn if lightmaps that were relit are noisier than the bake: its rays were for other light.

    before, now: Their `estimated_errors`.
    """
    if now <= max(NOISIER * before, before + MORE_NOISE):
        return ()
    return (
        BakeWarning(
            "scene",
            f"with these lights the noise is about {now:.1%}; it was {before:.1%} with those of the bake, "
            "which its rays were aimed at: bake again for cleaner light",
        ),
    )


def damaged(path: Path | str) -> BakeError:
    """Return the error for a sidecar that no bake has written."""
    return BakeError(f"'{path}' is not used: it is damaged; bake again")


def _relight(kept: KeptBake, wanted: Array, progress: Progress) -> tuple[LightmapPage, ...]:
    """Compute the lightmaps for strengths that are checked."""
    scratch = kept.geometry.scratch
    light = relight_texels(kept.lit, kept.geometry, kept.solved, wanted, scratch, progress.part(0.0, 0.95))
    emission = kept.sources.emission(kept.emission, kept.geometry.triangle, wanted)
    values = held_values(light, kept.reflectance, emission, kept.settings, scratch)
    pages = presentable(texel_pages(kept.geometry, values, kept.seams, kept.rings))
    progress.at(1.0)
    return pages


def held_values(
    light: TexelLight, reflectance: Array, emission: Array, settings: BakeSettings, scratch: Scratch
) -> Array:
    """Return (n, 3) float32 what texels are to hold of their light; reflectance and emission as they show."""
    values = scratch.empty(light.direct.shape, np.float32)
    parts = {"all": (light.direct, light.indirect), "direct": (light.direct,), "indirect": (light.indirect,)}
    for rows in tiles(len(values)):
        irradiance = np.add.reduce([part[rows] for part in parts[settings.light]])
        emitted = np.zeros((len(irradiance), 3)) if settings.light == "indirect" else emission[rows]
        values[rows] = to_quantity(irradiance, reflectance[rows], emitted, settings.quantity)
    return values
