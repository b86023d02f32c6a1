"""Whole bakes of textured surfaces and cut-outs."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.scene.textures import SurfaceImages
from radiosity_addon.solver import AreaLight, PointLight, Scene
from tests.rooms import box_room, gray, gray_scene, rectangle
from tests.textured_rooms import furnace, image, patterned
from tests.unit.test_pipeline import run, texels
from tests.unit.texel_scenes import QUAD_UV, bake_scene, in_cell

WHOLE_PAGE = in_cell((0, 0), (1, 1))


@pytest.mark.parametrize("quantity", ["irradiance", "radiosity"])
def test_the_lightmap_of_a_textured_furnace_is_constant(quantity: str) -> None:
    """E(x) = (1 − ρ(x)) c: what arrives is c at every texel, and so is what leaves."""
    result = run(bake_scene(furnace(3.0), ("Room", 12)), quantity=quantity)
    found = texels(result)
    np.testing.assert_allclose(found.mean(), 3.0, rtol=0.005)
    # No more than the noise of the gather rays.
    assert np.sqrt(((found / 3.0 - 1) ** 2).mean()) < min(0.03, 1.2 * result.solver["estimated_error"])


def lit_floor(values: np.ndarray) -> Scene:
    floor = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
    images = SurfaceImages(values, QUAD_UV, np.ones(2, bool))
    return gray_scene(floor, 0, lights=[PointLight((0.5, 0.5, 1), 10.0)], images=images)


def test_texels_reflect_and_emit_what_the_image_shows_there() -> None:
    """Radiosity of a lone floor is E + ρH with the ρ and E of each texel, opaque or not."""
    emission = np.random.default_rng(2).random((48, 48, 3))
    baked = {}
    for quantity in ("irradiance", "radiosity"):
        for opacity in (1.0, 0.5):
            values = image(48, patterned(48), emission, opacity)
            scene = bake_scene(lit_floor(values), ("Floor", 2, WHOLE_PAGE))
            baked[quantity, opacity] = run(scene, quantity=quantity, resolution=48).pages[0].pixels
    expected = middle_halves(emission) + middle_halves(patterned(48)) * baked["irradiance", 1.0]
    assert np.sqrt(((baked["radiosity", 1.0] - expected) ** 2).mean()) < 0.05 * expected.std()
    assert baked["radiosity", 0.5] == pytest.approx(baked["radiosity", 1.0], rel=1e-5)


def middle_halves(texels: np.ndarray) -> np.ndarray:
    """Means of bilinear look-ups over the middle half of each texel: 1/16, 7/8, 1/16 along each axis."""
    for _ in range(2):
        padded = np.pad(texels, ((1, 1), (0, 0), (0, 0)), mode="edge")
        texels = (0.875 * padded[1:-1] + 0.0625 * (padded[:-2] + padded[2:])).swapaxes(0, 1)
    return texels


def fenced(cells: np.ndarray, as_geometry: bool) -> Scene:
    """A room whose floor an area lamp lights through a screen with square holes, an image or cut out."""
    count = len(cells)
    room, _ = box_room((2, 2, 1))
    lamp = AreaLight((1.0, 1.0, 0.98), (0.4, 0, 0), (0, -0.4, 0), 20.0)
    corner, edge_u, edge_v = (0.25, 0.25, 0.4), (1.5, 0, 0), (0, 1.5, 0)
    if as_geometry:
        # `rectangle` runs over edge_v first, an image over u.
        solid = np.tile(cells.T.ravel() > 0, 2)
        screen = rectangle(corner, edge_u, edge_v, count)[solid]
        triangles = np.concatenate([room, screen])
        reflectance = gray(len(triangles), 0.5)
        sides = np.arange(len(triangles)) >= len(room)
        return Scene(triangles, reflectance, gray(len(triangles), 0), two_sided=sides, lights=[lamp])
    triangles = np.concatenate([room, rectangle(corner, edge_u, edge_v)])
    textured = np.arange(len(triangles)) >= len(room)
    values = image(16 * count, 0.5, 0.0, cells.repeat(16, 0).repeat(16, 1))
    uv = np.concatenate([np.zeros((len(room), 3, 2)), QUAD_UV])
    return gray_scene(
        triangles, 0.5, two_sided=textured, lights=[lamp], images=SurfaceImages(values, uv, textured)
    )


def test_a_screen_with_holes_throws_the_shadow_of_one_cut_out_of_metal() -> None:
    cells = np.random.default_rng(8).permutation(np.arange(16) % 2).reshape(4, 4).astype(float)
    maps = []
    for as_geometry in (False, True):
        scene = fenced(cells, as_geometry)
        parts = ("Floor", 2, WHOLE_PAGE), ("Rest", len(scene) - 2, None, False)
        maps.append(run(bake_scene(scene, *parts), quantity="irradiance", resolution=48).pages[0].pixels)
    image_map, metal_map = maps
    error = np.sqrt(((image_map - metal_map) ** 2).mean()) / metal_map.mean()
    assert metal_map.std() > 0.2 * metal_map.mean()
    assert error < 0.03
    np.testing.assert_allclose(image_map.mean(), metal_map.mean(), rtol=0.01)
