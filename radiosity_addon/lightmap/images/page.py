"""One lightmap page: its pixels, and which of them show a surface."""

from __future__ import annotations

from dataclasses import dataclass

from ...numerics import Array


@dataclass(frozen=True)
class LightmapPage:
    """One baked image.

    pixels (height, width, 3) float32: Linear RGB of the requested quantity. Row 0 is v = 0: the bottom, as in
        Blender.
    coverage (height, width) bool: True where a triangle covers part of the texel; the rest was dilated.
    """

    pixels: Array
    coverage: Array
