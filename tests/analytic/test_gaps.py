"""A board a hair above a floor, under a sky: the gap is as dark as the closed form says, up to its rim."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.lighting.reconstruction import light_texels
from radiosity_addon.lightmap.transport.gather_settings import GatherSettings
from radiosity_addon.solver import EnvironmentLight, SolverSettings, solve
from tests.rooms import gray_scene, rectangle
from tests.unit.texel_scenes import QUAD_UV, texel_geometry

SIZE = 24
TEXEL = 2.0 / SIZE
RIM = 13.5 * TEXEL
GAP, THICKNESS = 0.002, 0.01


@pytest.mark.parametrize("reflectance", [0.0, 0.8])
def test_light_reaches_into_a_gap_as_far_as_the_gap_is_high(reflectance: float) -> None:
    """Floor and underside have lightmaps; the board's top and edge have none."""
    floor = rectangle((0, 0, 0), (2, 0, 0), (0, 2, 0))
    under = rectangle((RIM, -1, GAP), (0, 4, 0), (2, 0, 0))
    top = rectangle((RIM, -1, GAP + THICKNESS), (2, 0, 0), (0, 4, 0))
    edge = rectangle((RIM, -1, GAP), (0, 0, THICKNESS), (0, 4, 0))
    triangles = np.concatenate([floor, under, top, edge])
    scene = gray_scene(triangles, reflectance, lights=[EnvironmentLight(1.0 / np.pi)])
    uv = np.concatenate([QUAD_UV, QUAD_UV, np.zeros((4, 3, 2), np.float32)])
    geometry = texel_geometry(scene, uv, SIZE, np.array([0, 0, 1, 1, -1, -1, -1, -1]))
    local = solve(scene, SolverSettings(error=1e-3)).local_pass
    light = light_texels(scene, local, geometry, GatherSettings(rays=256))
    irradiance = (light.direct + light.indirect).mean(axis=1)
    depth = geometry.position[:, 0] - RIM
    # The sky shines up past the floor's own borders as well.
    inner = (np.abs(geometry.position[:, :2] - 1.0) < 1.0 - 1.8 * TEXEL).all(axis=1)
    lies = (geometry.page == 0) & inner
    # The view factor of a slot's mouth: (1 − cos ϑ)/2, ϑ the height at which its upper edge is seen.
    most = 0.5 * (1.0 - np.cos(np.arctan(GAP / 0.5 / TEXEL)))
    floor_below, floor_open = lies & (depth > 0.8 * TEXEL), lies & (depth < -0.8 * TEXEL)
    assert floor_below.sum() == 8 * (SIZE - 4)
    # One ray of a point's 256 may find the mouth; what comes in goes to and fro.
    bounces = 1.0 / (1.0 - reflectance**2)
    # So may one of a cell's 64, of texels that the board's edge divides: others see what it reflects.
    limit = bounces * (most + 1.0 / 256) + reflectance / 64
    assert irradiance[floor_below].max() < limit
    assert irradiance[floor_below].mean() < bounces * most
    underside = (geometry.page == 1) & inner & (depth > TEXEL)
    assert irradiance[underside].max() < limit
    np.testing.assert_allclose(irradiance[floor_open], 1.0, atol=0.01)
    # Half of a rim texel's footprint is in the open, beside the board's edge; half sees out of the mouth.
    rim = lies & (geometry.column == 13) & (np.abs(depth) < 1e-6)
    assert rim.sum() == SIZE - 5  # the floor's diagonal cuts one of them
    if reflectance == 0:
        expected = 0.5 * (1.0 - hidden_part(GAP + THICKNESS) + hidden_part(GAP))
        np.testing.assert_allclose(irradiance[rim].mean(), expected, rtol=0.02)


def hidden_part(height: float, width: float = 0.25 * TEXEL) -> float:
    """The part of the sky that a long wall hides from the ground beside it, a mean over its first `width`."""
    return float(0.5 * (1.0 - (np.hypot(width, height) - height) / width))
