"""Local illumination: a lamp, a surface, no shadow and no second bounce (handout §2.2.1)."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeObject, BakeScene
from radiosity_addon.solver import PointLight, Scene
from tests.rooms import gray, rectangle

REFLECTANCE = np.array([0.7, 0.4, 0.1])
POWER = np.array([90.0, 40.0, 10.0])
RESOLUTION = 128
HALF = 1.0
"""Half the side of the floor [m]."""

UV = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], dtype=np.float32)


def baked(quantity: str, light: str, position: tuple[float, float, float]) -> np.ndarray:
    """A square floor under a lamp; texel (row, column) lies at (column, row) of the floor."""
    floor = rectangle((-HALF, -HALF, 0), (2 * HALF, 0, 0), (0, 2 * HALF, 0))
    scene = Scene(floor, np.tile(REFLECTANCE, (2, 1)), gray(2, 0.0), lights=[PointLight(position, POWER)])
    loops = np.arange(6, dtype=np.int32).reshape(2, 3)
    target = BakeObject("Floor", 0, 2, True, np.zeros(2, dtype=np.int32), loops, UV)
    settings = BakeSettings(quality="draft", resolution=RESOLUTION, quantity=quantity, light=light)
    (page,) = bake(BakeScene(scene, (target,)), settings).pages
    assert page.coverage.all()
    return np.asarray(page.pixels, dtype=np.float64)


@pytest.mark.parametrize("position", [(0.3, -0.2, 0.8), (-1.4, 0.6, 0.5), (0.0, 0.0, 2.5)])
def test_a_floor_shows_f_times_intensity_times_cosine_over_distance_squared(
    position: tuple[float, float, float],
) -> None:
    """L_r = f (Φ/4π) cosθ/r² (2.14, 2.15, 2.17) at every texel, f = ρ/π (2.12), B = πL (2.11)."""
    center = ((np.arange(RESOLUTION) + 0.5) / RESOLUTION * 2 - 1) * HALF
    x, y = np.meshgrid(center, center)
    square = (x - position[0]) ** 2 + (y - position[1]) ** 2 + position[2] ** 2
    cosine = position[2] / np.sqrt(square)
    radiance = (REFLECTANCE / np.pi) * (POWER / (4 * np.pi)) * (cosine / square)[..., None]
    radiosity = baked("radiosity", "direct", position)
    # A texel is the mean over a few points of its footprint, which need not lie about its center.
    np.testing.assert_allclose(radiosity / np.pi, radiance, rtol=0.02)
    assert (radiosity / np.pi / radiance).mean() == pytest.approx(1, abs=2e-4)


def test_nothing_comes_back_to_a_lone_floor() -> None:
    position = (0.3, -0.2, 0.8)
    assert not baked("irradiance", "indirect", position).any()
    np.testing.assert_array_equal(
        baked("irradiance", "all", position), baked("irradiance", "direct", position)
    )


def test_close_to_a_lamp_a_texel_is_still_the_mean_over_its_footprint() -> None:
    """The lamp is nearer than a texel is wide: from point to point of a texel its light varies manifold."""
    position = (0.304, -0.203, 0.01)
    within = ((np.arange(32) + 0.5) / 32 - 0.5) / 2  # of the middle half of a texel (decision 0010)
    points = ((np.arange(RESOLUTION)[:, None] + 0.5 + within) / RESOLUTION * 2 - 1) * HALF
    y, x = points[:, None, :, None], points[None, :, None, :]
    square = (x - position[0]) ** 2 + (y - position[1]) ** 2 + position[2] ** 2
    expected = POWER[0] / (4 * np.pi) * (position[2] / square**1.5).mean(axis=(2, 3))
    found = baked("irradiance", "direct", position)[..., 0]
    near = expected > 0.002 * expected.max()
    assert 50 < near.sum() < 1000
    np.testing.assert_allclose(found[near], expected[near], rtol=0.02)
