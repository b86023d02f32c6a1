"""Objects spread evenly over pages, and page sizes that follow from a density."""

import numpy as np
import pytest

from radiosity_addon.bake import LightmappedObject, estimate_bake
from radiosity_addon.lightmap.unwrap import Limits
from radiosity_addon.lightmap.unwrap.atlas import Atlas, AtlasInput, run_atlas
from radiosity_addon.lightmap.unwrap.page_assignment import ChartTotals, assign_pages
from radiosity_addon.options import BakeSettings

from .lightmap_meshes import box, quads

pytest.importorskip("xatlas")


def boxes(sizes) -> list[AtlasInput]:
    return [AtlasInput(f"box {number}", *box(tuple(size))) for number, size in enumerate(sizes)]


def square(side: float) -> AtlasInput:
    corners = [(0, 0, 0), (side, 0, 0), (side, side, 0), (0, side, 0)]
    return AtlasInput("square", *quads(np.array([corners], dtype=float)))


def objects_per_page(atlas: Atlas) -> list[int]:
    return np.bincount([placed.page for placed in atlas.objects]).tolist()


@pytest.mark.parametrize("pages", [1, 2, 7, 40])
def test_every_object_is_on_one_page_and_no_page_exceeds_another_by_more_than_an_object(pages):
    texels = np.random.default_rng(pages).uniform(1.0, 100.0, 30)
    groups = assign_pages(texels, pages)
    assert sorted(row for group in groups for row in group) == list(range(30))
    assert all(group == sorted(group) for group in groups)
    assert len(groups) == min(pages, 30)
    filled = [texels[group].sum() for group in groups]
    assert max(filled) - min(filled) <= texels.max()


def test_objects_without_charts_do_not_make_empty_pages():
    assert assign_pages([0.0, 0.0, 5.0], 3) == [[2], [0, 1]]


@pytest.mark.parametrize("texels", [300.0, 4000.0, 1e6])
def test_at_the_density_for_so_many_texels_objects_take_as_many(texels):
    totals = ChartTotals(np.array([4.0, 2.0]), np.array([8.0, 20.0]), np.array([2.0, 9.0]), padding=2)
    assert totals.texels(totals.density(texels)).sum() == pytest.approx(texels)


def test_where_not_even_gaps_fit_more_texels_still_mean_a_higher_density():
    totals = ChartTotals(np.array([4.0]), np.array([8.0]), np.array([100.0]), padding=2)
    assert 0.0 < totals.density(10.0) < totals.density(100.0) < totals.density(1000.0)


def test_three_hundred_objects_fill_two_pages_alike():
    sides = np.random.default_rng(0).uniform(0.3, 1.5, 300)
    atlas = run_atlas([square(side) for side in sides], 256, pages=2)
    assert [page.resolution for page in atlas.pages] == [256, 256]
    per_page = np.bincount([placed.page for placed in atlas.objects], sides**2)
    np.testing.assert_allclose(per_page, per_page.mean(), rtol=0.02)
    np.testing.assert_allclose([page.density for page in atlas.pages], atlas.pages[0].density, rtol=0.02)


def test_many_small_charts_share_the_page_of_a_large_one():
    """They have as much area as the large one, but need gaps: by area alone it had a page to itself."""
    atlas = run_atlas([square(10.0), *[square(0.577)] * 299], 256, pages=2)
    assert min(objects_per_page(atlas)) > 30
    densities = [page.density for page in atlas.pages]
    assert max(densities) < 1.2 * min(densities)


@pytest.mark.parametrize("largest", [255, 257, 1023])
@pytest.mark.parametrize("kept", [False, True])
def test_sizes_from_a_density_are_multiples_of_four_at_any_limit(largest, kept):
    """At the highest density that fits, the size is the largest multiple of 4 within the limit."""
    objects = [square(2.0)]
    if kept:
        objects = [AtlasInput("square", objects[0].triangles, objects[0].polygon, uv_of(objects[0]))]
    for density in (10.0, 33.3, 0.5 * (4 * (largest // 4) - 2 * Limits().border(1)) - 0.01):
        (page,) = run_atlas(objects, texel_density=density, limits=Limits(largest=largest)).pages
        assert page.resolution % 4 == 0
        assert 2.0 * density <= page.resolution <= largest
    assert page.resolution == 4 * (largest // 4)


def uv_of(source: AtlasInput) -> np.ndarray:
    return (source.triangles[..., :2] / 2.0).astype(np.float32)


@pytest.mark.parametrize("largest", [255, 1023])
def test_pages_of_many_objects_are_multiples_of_four_and_so_are_estimated_ones(largest):
    density = 0.06 * largest
    atlas = run_atlas(boxes([(1, 1, 1)] * 60), texel_density=density, limits=Limits(largest=largest))
    items = [LightmappedObject(f"box {number}", 12, 6.0) for number in range(60)]
    estimate = estimate_bake(items, 720, BakeSettings(texel_density=density, max_resolution=largest))
    for sizes in ([page.resolution for page in atlas.pages], estimate.pages):
        assert len(sizes) > 1
        assert all(size % 4 == 0 and size <= largest for size in sizes)
        assert max(sizes) < 1.1 * min(sizes)
