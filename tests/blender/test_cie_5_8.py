"""CIE 171:2006 test case 5.8 from Blender's own cube and point lamp to the pixels of the lightmap."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.jobs.job import run_bake
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import LIGHTMAP_UV_LAYER
from tests.blender.scenes import add_lamp, add_mesh, shader_material

pytestmark = [pytest.mark.usefixtures("registered"), pytest.mark.one_blender]

INDIRECT_LX = {0.2: 26.04, 0.5: 104.17, 0.8: 416.67, 0.9: 937.5, 0.95: 1979.17}
"""(Φ / S) ρ / (1 − ρ) as the CIE prints it, by the reflectance of all walls."""

FLUX = 10_000.0
EDGE = 4.0
"""A lamp of 10 000 lm in the center of a closed cube of edge 4 m; watts stand for lumens here."""

CORNERS = [(x, y, z) for z in (0.0, EDGE) for y in (0.0, EDGE) for x in (0.0, EDGE)]
INWARD = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]

# Where each wall is looked up: the middles of 16 × 16 cells, in parts of its two edges.
_CELLS = (np.arange(16) + 0.5) / 16
_S, _T = (grid.ravel()[:, None] for grid in np.meshgrid(_CELLS, _CELLS))


def _room(reflectance: float) -> bpy.types.Object:
    material = shader_material("Wall", "ShaderNodeBsdfDiffuse", Color=(reflectance,) * 3 + (1.0,))
    add_lamp("POINT", transform={"location": (EDGE / 2,) * 3}, energy=FLUX, shadow_soft_size=0.0)
    return add_mesh("Room", CORNERS, INWARD, material=material)


def _bake(room: bpy.types.Object, **settings: object) -> np.ndarray:
    """Bake, and look the walls up in the lightmap as a shader would: (6, 256, 3) irradiance."""
    wanted = BakeSettings(resolution=128, quality="draft", quantity="irradiance", **settings)
    before = set(bpy.data.images)
    for _ in run_bake(bpy.context, wanted, None):
        pass
    (image,) = set(bpy.data.images) - before
    width, height = image.size
    pixels = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    uv = np.empty(6 * 4 * 2, dtype=np.float32)
    room.data.uv_layers[LIGHTMAP_UV_LAYER].uv.foreach_get("vector", uv)
    first, second, third, fourth = uv.reshape(6, 4, 2).swapaxes(0, 1)[:, :, None]
    at = (1 - _T) * ((1 - _S) * first + _S * second) + _T * ((1 - _S) * fourth + _S * third)
    column = (at[..., 0] * width).astype(int)
    row = (at[..., 1] * height).astype(int)
    return pixels.reshape(height, width, 4)[row, column, :3].astype(np.float64)


@pytest.mark.parametrize("reflectance", INDIRECT_LX)
def test_the_mean_indirect_illuminance(reflectance: float) -> None:
    indirect = _bake(_room(reflectance), light="indirect")
    np.testing.assert_allclose(indirect.mean(axis=(0, 1)), INDIRECT_LX[reflectance], rtol=0.01)


@pytest.mark.parametrize("method", ["dense", "shooting", "two-level", "multi-level"])
def test_the_mean_indirect_illuminance_by_other_methods(method: str) -> None:
    indirect = _bake(_room(0.5), light="indirect", method=method)
    np.testing.assert_allclose(indirect.mean(axis=(0, 1)), INDIRECT_LX[0.5], rtol=0.01)


def test_the_direct_illuminance_at_every_point() -> None:
    """Local illumination, H = Φ cosθ / (4 π r²), where the lightmap is looked up."""
    direct = _bake(_room(0.5), light="direct")
    height = EDGE / 2
    squared = height**2 + ((_S - 0.5) * EDGE) ** 2 + ((_T - 0.5) * EDGE) ** 2
    expected = FLUX * height / (4 * math.pi * squared**1.5)
    # A texel is up to a pixel away from where it is looked up.
    np.testing.assert_allclose(direct, np.broadcast_to(expected, direct.shape), rtol=0.06)
    np.testing.assert_allclose(direct.mean(axis=(0, 1)), FLUX / (6 * EDGE**2), rtol=0.005)
