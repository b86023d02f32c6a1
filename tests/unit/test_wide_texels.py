"""Surfaces whose texels are too wide to tell what light falls on them: their elements answer instead."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.lighting.reconstruction import light_texels
from radiosity_addon.lightmap.transport.gather_settings import GatherSettings
from radiosity_addon.lightmap.transport.hit_table import WIDE_TEXEL
from radiosity_addon.lights.sun_and_sky import PointLight
from radiosity_addon.solver import Scene, SolverSettings, solve
from tests.rooms import gray, rectangle
from tests.unit.texel_scenes import QUAD_UV, in_cell, texel_geometry

SIZE = 24


def floor_by_a_lit_wall() -> Scene:
    """A black floor of 2 m before a white wall of 4 m, and a lamp that lights one end of the wall only."""
    floor = rectangle((0, 0, 0), (2, 0, 0), (0, 2, 0))
    wall = rectangle((-1, 2, 0), (4, 0, 0), (0, 0, 2))
    reflectance = np.concatenate([gray(2, 0.0), gray(2, 0.8)])
    return Scene(
        np.concatenate([floor, wall]), reflectance, gray(4, 0.0), lights=[PointLight((2.6, 1.7, 0.4), 20.0)]
    )


def floor_light(wall_uv: np.ndarray, wall_page: int) -> np.ndarray:
    """Return the floor's indirect irradiance with the wall's lightmap on a page of its own, or on none."""
    scene = floor_by_a_lit_wall()
    pages = np.array([0, 0, wall_page, wall_page])
    geometry = texel_geometry(scene, np.concatenate([QUAD_UV, wall_uv]), SIZE, pages)
    local = solve(scene, SolverSettings()).local_pass
    light = light_texels(scene, local, geometry, GatherSettings(rays=128))
    return np.asarray(light.indirect[geometry.page == 0].mean(axis=1))


@pytest.fixture(scope="module")
def true_light() -> np.ndarray:
    """Without a lightmap of the wall its elements answer, and gather."""
    return floor_light(QUAD_UV, -1)


@pytest.mark.parametrize(("part", "limit"), [(1.0, 0.15), (3.0 / SIZE, 0.05), (0.5 / SIZE, 0.05)])
def test_a_floor_is_lit_alike_however_few_texels_the_wall_has(
    part: float, limit: float, true_light: np.ndarray
) -> None:
    """One texel that answered for all of the wall made it 88 %, three by three 310 %; 12 % is noise."""
    light = floor_light(in_cell((0.0, 0.0), (part, part)), 1)
    assert np.sqrt(((light - true_light) ** 2).mean()) < limit * true_light.mean()


def test_the_size_of_a_texel_on_each_triangle() -> None:
    scene = floor_by_a_lit_wall()
    uv = np.concatenate([QUAD_UV, in_cell((0.0, 0.0), (0.25, 0.5))])
    geometry = texel_geometry(scene, uv, SIZE, np.array([0, 0, 1, 1]))
    np.testing.assert_allclose(geometry.texel_area[:2], (2 / SIZE) ** 2)
    np.testing.assert_allclose(geometry.texel_area[2:], 8 / (0.125 * SIZE**2))
    assert geometry.texel_size == pytest.approx(2 / SIZE)
    assert not (geometry.texel_area > (WIDE_TEXEL * geometry.texel_size) ** 2).any()
