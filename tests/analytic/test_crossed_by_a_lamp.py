"""A wide glowing sheet that goes through a wall: each point of the wall sees half a hemisphere of it."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.lighting.reconstruction import light_texels
from radiosity_addon.lightmap.transport.gather_settings import GatherSettings
from radiosity_addon.solver import Scene, SolverSettings, solve
from tests.rooms import rectangle
from tests.unit.texel_scenes import QUAD_UV, texel_geometry

SIZE, WIDTH, WIDE = 16, 2.0, 20.0
TEXEL = WIDTH / SIZE


# Not 0.5: there a ray starts a hair from the sheet, less than rays are shortened by.
@pytest.mark.parametrize("part", [0.1, 0.3, 0.8])
@pytest.mark.parametrize("shadow_rays", [1, 4])
def test_texels_through_which_a_glowing_sheet_goes_get_light_from_both_sides(
    part: float, shadow_rays: int
) -> None:
    """Of each side only what is beyond it sees anything: the rays of a few points may all start behind it."""
    wall = rectangle((0, 0, -1), (0, WIDTH, 0), (0, 0, WIDTH))
    height = part * TEXEL
    upper = rectangle((-WIDE, -WIDE, height), (2 * WIDE, 0, 0), (0, 2 * WIDE, 0))
    lower = rectangle((-WIDE, -WIDE, height), (0, 2 * WIDE, 0), (2 * WIDE, 0, 0))
    emission = np.zeros((6, 3))
    # Two colors, so that the sides are told apart as lamps.
    emission[2:4, 0], emission[4:6, 1] = 1.0, 1.0
    scene = Scene(np.concatenate([wall, upper, lower]), np.zeros((6, 3)), emission)
    uv = np.concatenate([QUAD_UV, np.zeros((4, 3, 2), np.float32)])
    geometry = texel_geometry(scene, uv, SIZE, np.array([0, 0, -1, -1, -1, -1]))
    local = solve(scene, SolverSettings(shadow_rays=shadow_rays)).local_pass
    light = light_texels(scene, local, geometry, GatherSettings(rays=16))
    crossed = np.abs(geometry.position[:, 2] - height) < 0.5 * TEXEL
    assert crossed.sum() == SIZE
    both = light.direct[:, :2].sum(axis=1)
    np.testing.assert_allclose(both[crossed], 0.5, rtol=0.02)
