"""What stands on a surface or close above it: the light beside it, and the light it reflects."""

from __future__ import annotations

import numpy as np

from radiosity_addon.lightmap.lighting.reconstruction import light_texels
from radiosity_addon.lightmap.texels.texel_geometry import TexelGeometry
from radiosity_addon.lightmap.transport.gather_settings import GatherSettings
from radiosity_addon.lightmap.transport.sweeps import TexelLight
from radiosity_addon.lights.light import Light
from radiosity_addon.solver import EnvironmentLight, Scene, SolverSettings, SunLight, solve
from tests.rooms import gray, rectangle
from tests.unit.texel_scenes import QUAD_UV, texel_geometry

SIZE = 24
TEXEL = 2.0 / SIZE
FLOOR = rectangle((0, 0, 0), (2, 0, 0), (0, 2, 0))


def light_of(
    baked: list[np.ndarray],
    others: list[np.ndarray],
    reflectance: list[float],
    lights: list[Light],
    glowing: bool = False,
    rays: int = 256,
) -> tuple[TexelGeometry, TexelLight]:
    """Bake rectangles, a page each; `others` have no lightmap, and glow or not. All have a reflectance."""
    triangles = np.concatenate([*baked, *others])
    part = np.repeat(np.array(reflectance), 2)[:, None] * np.ones(3)
    emission = gray(len(triangles), 0.0)
    emission[2 * len(baked) :] = float(glowing)
    scene = Scene(triangles, part, emission, lights=lights)
    uv = np.zeros((len(triangles), 3, 2), dtype=np.float32)
    uv[: 2 * len(baked)] = np.tile(QUAD_UV, (len(baked), 1, 1))
    pages = np.repeat(np.append(np.arange(len(baked)), [-1] * len(others)), 2)
    geometry = texel_geometry(scene, uv, SIZE, pages)
    local = solve(scene, SolverSettings(error=1e-3)).local_pass
    return geometry, light_texels(scene, local, geometry, GatherSettings(rays=rays))


def test_next_to_a_bar_the_sky_is_hidden_as_the_closed_form_says() -> None:
    """A black bar, a texel high, along a black floor: the open's light does not reach beside it."""
    column, height = 9, TEXEL
    at = (column + 0.5) * TEXEL
    bar = rectangle((at, -40, -0.01), (0, 80, 0), (0, 0, height + 0.01))
    back = rectangle((at, -40, -0.01), (0, 0, height + 0.01), (0, 80, 0))
    sky = EnvironmentLight(1.0 / np.pi)
    geometry, light = light_of([FLOOR], [bar, back], [0.0] * 3, [sky], rays=1024)
    irradiance = light.direct.mean(axis=1)
    for beside in (column - 1, column + 1):
        there = geometry.column == beside
        found = irradiance[there & (np.abs(geometry.row - beside) > 1)]
        near, far = 0.75 * TEXEL, 1.25 * TEXEL
        # Half of 1 − cos of the angle under which the bar is seen, a mean over the middle half.
        mean_cosine = (np.hypot(far, height) - np.hypot(near, height)) / (far - near)
        np.testing.assert_allclose(found.mean(), 0.5 * (1.0 + mean_cosine), rtol=0.0075)


def test_between_slats_a_floor_reflects_all_the_light_that_falls_on_it() -> None:
    """Black slats a hair above a floor hide half of each texel from the sun: half the light comes up."""
    sensor = rectangle((0, 0, 0.5), (0, 2, 0), (2, 0, 0))
    sun = SunLight((0, -1, -1), 1.0)
    slats, gap = [], 0.001 * TEXEL
    for column in range(SIZE):
        low = (column + 0.5) * TEXEL
        for first, second in (((0.5 * TEXEL, 0, 0), (0, 4, 0)), ((0, 4, 0), (0.5 * TEXEL, 0, 0))):
            slats.append(rectangle((low, -1, gap), first, second))
    above = []
    for hoods in ([], slats):
        reflectance = [0.5, 0.0] + [0.0] * len(hoods)
        geometry, light = light_of([FLOOR, sensor], hoods, reflectance, [sun])
        above.append(light.indirect[geometry.page == 1].mean())
    assert above[0] > 0.04
    np.testing.assert_allclose(above[1], 0.5 * above[0], rtol=0.02)


def test_where_a_glowing_plate_ends_a_hair_above_a_texel_it_lights_the_part_below() -> None:
    """The plate covers the right 0.6 of the footprints in one column; by symmetry its edge adds nothing."""
    column = 9
    plate = rectangle(((column + 0.45) * TEXEL, -4, 0.02 * TEXEL), (0, 8, 0), (8, 0, 0))
    geometry, light = light_of([FLOOR], [plate], [0.0, 0.0], [], glowing=True)
    irradiance = light.direct.mean(axis=1)
    inner = np.abs(geometry.row - column) > 1
    np.testing.assert_allclose(irradiance[inner & (geometry.column == column)].mean(), 0.6, rtol=0.05)
    np.testing.assert_allclose(irradiance[inner & (geometry.column == column + 1)], 1.0, rtol=0.005)
    assert irradiance[inner & (geometry.column == column - 1)].max() < 0.005
