"""A floor below plates, in a gap that is lower than the leaves above it are wide."""

from __future__ import annotations

import numpy as np

from radiosity_addon.bake.pipeline import bake
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.solver import EnvironmentLight
from tests.rooms import gray_scene, rectangle
from tests.unit.texel_scenes import QUAD_UV, bake_scene

COARSE, FINE = 16, 192
HEIGHT, PLATE = 0.4, 2.0
"""Of the gap, and width of a plate [m]: two to three coarse texels, and no leaf is smaller."""


def irradiance_below_plates(resolution: int, min_area: float | None) -> np.ndarray:
    """Bake a floor of 12 m with 4 × 4 plates above its middle, which have no lightmap, under an even sky."""
    floor = rectangle((0, 0, 0), (12, 0, 0), (0, 12, 0))
    corners = [(2 + PLATE * i, 2 + PLATE * j, HEIGHT) for i in range(4) for j in range(4)]
    plates = [rectangle(corner, (PLATE, 0, 0), (0, PLATE, 0)) for corner in corners]
    triangles = np.concatenate([floor, *plates])
    scene = gray_scene(triangles, 0.8, two_sided=True, lights=[EnvironmentLight(1.0)])
    parts = ("Floor", 2, QUAD_UV), ("Plates", len(triangles) - 2, None, False)
    settings = BakeSettings(resolution=resolution, quality="draft", min_area=min_area)
    return np.asarray(bake(bake_scene(scene, *parts), settings).pages[0].pixels[..., 0], dtype=float)


def test_large_leaves_above_a_gap_answer_by_what_is_over_it() -> None:
    """The plates' edges are lit, and what is above the middle of the gap is nearly dark."""
    coarse = irradiance_below_plates(COARSE, min_area=0.5)
    block = FINE // COARSE
    fine = irradiance_below_plates(FINE, None).reshape(COARSE, block, COARSE, block).mean(axis=(1, 3))
    inner = np.ix_(range(4, 12), range(4, 12))
    expected = fine[inner]
    assert expected.mean() < 0.15 * fine.max()
    np.testing.assert_allclose(coarse[inner].mean(), expected.mean(), rtol=0.17)
    assert np.sqrt(((coarse[inner] - expected) ** 2).mean()) < 0.22 * expected.mean()
