"""A floor that is sunlit up to a line within the texel next to a wall: what the wall gets, by integration."""

from __future__ import annotations

import numpy as np

from radiosity_addon.lightmap.lighting.reconstruction import light_texels
from radiosity_addon.lightmap.texels import TexelGeometry, uneven_texels
from radiosity_addon.lightmap.transport.gather_settings import GatherSettings
from radiosity_addon.solver import Scene, SolverSettings, SunLight, solve
from tests.rooms import rectangle
from tests.unit.texel_scenes import QUAD_UV, texel_geometry

SIZE, WIDTH, REFLECTANCE = 16, 4.0, 0.8
TEXEL = WIDTH / SIZE
EDGE = 0.74 * TEXEL
"""Where the sunlight begins: just before the border of two quarters of the texel next to the wall."""


def scene_and_texels(edge: float) -> tuple[Scene, TexelGeometry]:
    floor = rectangle((0, 0, 0), (WIDTH, 0, 0), (0, WIDTH, 0))
    wall = rectangle((0, 0, 0), (0, WIDTH, 0), (0, 0, WIDTH))
    roof = rectangle((-1, -1, 9), (edge + 1, 0, 0), (0, WIDTH + 2, 0))
    triangles = np.concatenate([floor, wall, roof])
    reflectance = np.repeat([[REFLECTANCE] * 3, [0.0] * 3], [2, 4], axis=0)
    scene = Scene(triangles, reflectance, np.zeros((6, 3)), lights=[SunLight((0, 0, -1), 1.0)])
    uv = np.concatenate([QUAD_UV, QUAD_UV, np.zeros((2, 3, 2), np.float32)])
    return scene, texel_geometry(scene, uv, SIZE, np.array([0, 0, 1, 1, -1, -1]))


def from_sunlit_floor(height: np.ndarray, across: float) -> np.ndarray:
    """Return (n,) the wall's irradiance at heights, by the midpoint rule over the floor beyond the edge."""
    x = EDGE + (np.arange(800) + 0.5) / 800 * (WIDTH - EDGE)
    y = (np.arange(800) + 0.5) / 800 * WIDTH
    patch = (WIDTH - EDGE) / 800 * WIDTH / 800
    squared = x[:, None] ** 2 + (y - across) ** 2
    return np.array(
        [(REFLECTANCE * x[:, None] * z / (np.pi * (squared + z * z) ** 2)).sum() * patch for z in height]
    )


def test_a_wall_gets_light_from_where_the_floor_next_to_it_is_sunlit() -> None:
    scene, geometry = scene_and_texels(EDGE)
    local = solve(scene, SolverSettings(error=1e-3)).local_pass
    light = light_texels(scene, local, geometry, GatherSettings(rays=1024))
    lowest = (geometry.page == 1) & (geometry.position[:, 2] < TEXEL)
    middle = lowest & (np.abs(geometry.position[:, 1] - WIDTH / 2) < WIDTH / 4)
    assert middle.sum() == SIZE // 2
    height = TEXEL * (0.25 + (np.arange(16) + 0.5) / 32)
    expected = from_sunlit_floor(height, WIDTH / 2).mean()
    np.testing.assert_allclose(light.indirect[middle].mean(), expected, rtol=0.05)


def test_texels_on_both_sides_of_an_edge_are_uneven() -> None:
    _, geometry = scene_and_texels(EDGE)
    lit = (geometry.page == 0) & (geometry.position[:, 0] > 5.2 * TEXEL)
    lamps = np.repeat(np.where(lit, 1.0, 0.0)[:, None], 3, axis=1)
    column = np.round(geometry.position[:, 0] / TEXEL - 0.5).astype(int)
    expected = (geometry.page == 0) & np.isin(column, (4, 5))
    np.testing.assert_array_equal(uneven_texels(geometry, lamps), expected)
    assert not uneven_texels(geometry, np.ones_like(lamps)).any()
