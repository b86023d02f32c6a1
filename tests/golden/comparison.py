"""One row baked with ours, beside its references."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from bench.error_measure import relative_rmse
from bench.layout import objects_with_layout
from radiosity_addon.bake.pipeline import bake
from radiosity_addon.bake.result.result import BakeResult
from radiosity_addon.base.bake_warning import BakeWarning
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.lightmap.texels.rasterization import rasterize
from radiosity_addon.options.bake_settings import BakeSettings
from tests.golden import references
from tests.golden.rows import Row


@dataclass(frozen=True)
class Comparison:
    """A bake, its references, and which texels are compared.

    Parameters
    ----------
    ours : (n, n, 3) float32
        H/π [W/m²/sr]; row 0 is v = 0.
    theirs : References
    compared : (n, n) bool
        The center is inside a triangle, and Cycles wrote the texel.
    warnings : tuple of BakeWarning
    """

    ours: np.ndarray
    theirs: references.References
    compared: np.ndarray
    warnings: tuple[BakeWarning, ...]

    @property
    def relative_rmse(self) -> float:
        at = self.compared
        return relative_rmse(self.ours[at], self.theirs.first[at], self.theirs.second[at])

    @property
    def mean_ratio(self) -> float:
        """Our mean by theirs."""
        at = self.compared
        return float(self.ours[at].mean(dtype=float) / self.theirs.mean[at].mean(dtype=float))

    @property
    def exposure(self) -> float:
        """What brings the brightest of the compared texels just below white."""
        bright = self.theirs.mean[self.compared].max(axis=1)
        return 0.8 / max(float(np.quantile(bright, 0.98)), 1e-9) if len(bright) else 1.0

    def panels(self) -> list[np.ndarray]:
        """Return three (n, n, 3) pictures in [0, 1]: ours, Cycles', ten times the difference."""
        theirs = self.theirs.mean
        error = 10 * np.abs(self.ours - theirs) * self.compared[..., None]
        pages = [self.ours * (self.compared | self.theirs.coverage)[..., None], theirs, error]
        return [np.clip(page * self.exposure, 0, 1) ** (1 / 2.2) for page in pages]

    def strip(self) -> np.ndarray:
        """Return the three side by side, (n, 3 n, 3)."""
        return np.concatenate(self.panels(), axis=1)


def bake_row(row: Row, quality: str = "medium") -> BakeResult:
    """Build a row into an empty file and bake it on the layout it brings."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    row.build()
    bpy.context.scene.cycles.blur_glossy = 0.0  # as for the references (`bench/cycles.py`)
    names = tuple(obj.name for obj in objects_with_layout(bpy.context.scene))
    settings = BakeSettings(resolution=row.resolution, keep_uvs=True, quality=quality, objects=names)
    return bake(export_scene(bpy.context, settings).bake_scene, settings)


def compare(row: Row, quality: str = "medium") -> Comparison:
    """Bake a row and put it beside its references."""
    theirs = references.load(row)
    result = bake_row(row, quality)
    inside = np.zeros((row.resolution, row.resolution), dtype=bool)
    for item in result.objects:
        texels = rasterize(item.uv, row.resolution)
        inside[texels.row[texels.center_inside], texels.column[texels.center_inside]] = True
    return Comparison(result.pages[0].pixels, theirs, inside & theirs.coverage, result.warnings)
