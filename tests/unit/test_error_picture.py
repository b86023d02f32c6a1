"""The error picture: a bake of the residual, signed, where the elements are wrong."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake
from radiosity_addon.bake.result.result import BakeResult
from radiosity_addon.base.errors import UsageError
from radiosity_addon.base.progress import Progress
from radiosity_addon.lightmap.images.dilate import dilate
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene
from radiosity_addon.solver import EnvironmentLight, PointLight
from tests.cornell import cornell_box
from tests.rooms import box_room, gray_scene, rectangle
from tests.unit.texel_scenes import QUAD_UV, bake_scene

LAMP_HEIGHT, SCREEN_HEIGHT, SCREEN = 1.0, 0.5, 0.265
"""A screen of half width SCREEN below a lamp: its shadow on the floor has half width 2 · SCREEN,
which is no multiple of the elements' width."""


def run(scene: BakeScene, **settings: Any) -> BakeResult:
    fractions: list[float] = []
    progress = Progress(lambda status: fractions.append(status.fraction))
    result = bake(scene, BakeSettings(**{"quality": "draft", "quantity": "residual", **settings}), progress)
    assert fractions == sorted(fractions)
    return result


def texels(result: BakeResult) -> np.ndarray:
    """The (n, 3) covered texels of the first page."""
    return np.asarray(result.pages[0].pixels[result.pages[0].coverage])


def shadowed_floor() -> BakeScene:
    floor = rectangle((-1, -1, 0), (2, 0, 0), (0, 2, 0))
    screen = rectangle((-SCREEN, -SCREEN, SCREEN_HEIGHT), (2 * SCREEN, 0, 0), (0, 2 * SCREEN, 0))
    lamp = PointLight((0, 0, LAMP_HEIGHT), 50.0)
    scene = gray_scene(np.concatenate([floor, screen]), 0.5, lights=[lamp])
    return bake_scene(scene, ("Floor", 2, QUAD_UV), ("Screen", 2, None, False))


def test_a_right_solution_has_a_black_picture() -> None:
    """Walls that emit E = 1 and reflect a half: B = 2 to what the solver leaves."""
    triangles, _ = box_room()
    scene = bake_scene(gray_scene(triangles, 0.5, 1.0), ("Room", 12))
    settings = {"method": "dense", "elements": 48, "resolution": 48}
    assert np.abs(texels(run(scene, **settings))).max() < 2e-3


@pytest.mark.parametrize("method", ["hierarchical", "dense"])
def test_the_cornell_box_errs_both_ways_alike(method: str) -> None:
    given = {"elements": 400} if method == "dense" else {}
    result = run(bake_scene(cornell_box(), ("Box", 32)), resolution=64, method=method, **given)
    found = texels(result)
    mean, size = found.mean(axis=0), np.abs(found).mean(axis=0)
    assert (found.min(axis=0) < -5 * size).all()
    assert (found.max(axis=0) > 5 * size).all()
    assert (np.abs(mean) < 0.15 * size).all()
    np.testing.assert_allclose(result.solver["error_picture"]["mean"], mean, atol=1e-6)
    np.testing.assert_allclose(result.solver["error_picture"]["mean_absolute"], size, rtol=1e-5)
    # What is lit gets some 5 W/m²: the elements miss it by little, single texels by much.
    assert 0.005 < size[0] < 0.05
    assert np.percentile(np.abs(found[:, 0]), 99) > 5 * np.median(np.abs(found[:, 0]))


def test_errors_stand_where_elements_cross_the_edge_of_a_shadow() -> None:
    """Constant elements cannot follow the edge: too bright inside the shadow, too dark outside."""
    resolution, elements = 128, 4 + 2 * 1024
    result = run(shadowed_floor(), method="dense", elements=elements, resolution=resolution)
    picture = result.pages[0].pixels[..., 0]
    center = (np.arange(resolution) + 0.5) / resolution * 2 - 1
    from_axis = np.maximum(np.abs(center)[:, None], np.abs(center)[None])
    outside = from_axis - 2 * SCREEN
    # Direct light on the floor right outside the edge, reflected; elements are about 1/16 wide.
    edge = 0.5 * 50 / (4 * np.pi) * LAMP_HEIGHT / (LAMP_HEIGHT**2 + (2 * SCREEN) ** 2) ** 1.5
    large = np.abs(picture) > 0.1 * edge
    assert large.sum() > 500
    assert (np.abs(outside[large]) < 0.1).all()
    near = np.abs(outside) < 0.02
    assert (picture[near & (outside < 0)] > 0.1 * edge).all()
    assert picture[near & (outside > 0)].mean() < -0.2 * edge
    assert np.abs(picture).max() < edge


def test_the_picture_darkens_in_first_order_with_the_elements_size() -> None:
    """Where light is smooth: a lamp above a lone floor."""
    floor = rectangle((-1, -1, 0), (2, 0, 0), (0, 2, 0))
    scene = gray_scene(floor, lights=[PointLight((0, 0, LAMP_HEIGHT), 50.0)])
    parts, sizes = bake_scene(scene, ("Floor", 2, QUAD_UV)), []
    for elements in (32, 128, 512):
        result = run(parts, method="dense", elements=elements, resolution=64)
        sizes.append(np.abs(texels(result)).mean())
    orders = np.log2(np.array(sizes[:-1]) / sizes[1:])
    np.testing.assert_allclose(orders, 1, atol=0.1)


def test_a_sky_counts_as_what_arrives() -> None:
    """An open floor under a sky: the elements have B = ρπL, and so it is."""
    floor = rectangle((-1, -1, 0), (2, 0, 0), (0, 2, 0))
    scene = gray_scene(floor, lights=[EnvironmentLight(1.0)])
    found = texels(run(bake_scene(scene, ("Floor", 2, QUAD_UV)), resolution=16))
    np.testing.assert_allclose(found, 0, atol=1e-6)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"format": "png16"}, "negative values, which format png16 cannot hold: use format exr"),
        ({"light": "direct"}, "not of its direct light: use light all"),
        ({"light": "indirect"}, "not of its indirect light: use light all"),
    ],
)
def test_what_it_cannot_be_is_refused(wrong: dict[str, str], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        BakeSettings(quantity="residual", **wrong)


def test_dilation_carries_negative_values_on() -> None:
    pixels = np.zeros((64, 64, 3), dtype=np.float32)
    coverage = np.zeros((64, 64), dtype=bool)
    coverage[:8, :8] = coverage[-8:, -8:] = True
    pixels[:8, :8], pixels[-8:, -8:] = -2.0, 3.0
    filled = dilate(pixels, coverage)
    np.testing.assert_array_equal(filled[coverage], pixels[coverage])
    np.testing.assert_array_equal(filled[8:12, :8], -2)
    assert filled.min() == -2
    assert filled.max() == 3
