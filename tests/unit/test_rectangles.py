"""Objects in rectangles of their own: instances share their layout, to the bit, and rectangles lie apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.base.errors import BakeError
from radiosity_addon.lightmap.texels.rasterization import coverage_sum
from radiosity_addon.lightmap.unwrap.atlas import Atlas, AtlasInput, run_atlas
from radiosity_addon.lightmap.unwrap.packing import Limits
from radiosity_addon.lightmap.unwrap.rectangles import placed
from radiosity_addon.lightmap.unwrap.same_shapes import same_shapes
from radiosity_addon.options import TEXEL_STEPS

from .lightmap_meshes import box, uv_sphere

pytest.importorskip("xatlas")

PADDING = 4
LIMITS = Limits(padding=PADDING)


def instances(mesh, count: int, seed: int = 0, sizes: tuple[float, float] = (0.8, 1.1)) -> list[AtlasInput]:
    """Copies of a mesh, moved, turned and scaled."""
    rng = np.random.default_rng(seed)
    triangles, polygon = mesh
    found = []
    for number in range(count):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        turn *= np.sign(np.linalg.det(turn)) * rng.uniform(*sizes)
        found.append(AtlasInput(f"copy {number}", triangles @ turn.T + rng.normal(size=3), polygon))
    return found


def steps(atlas: Atlas, number: int) -> np.ndarray:
    """An object's corners, in steps of a texel."""
    laid = atlas.objects[number]
    return np.rint(TEXEL_STEPS * atlas.pages[laid.page].resolution * laid.uv.astype(np.float64)).astype(
        np.int64
    )


def rectangles(atlas: Atlas) -> np.ndarray:
    """(n, 4) page, and the texels that each object's rectangle begins and ends with, (n, 2, 2)."""
    corners = [steps(atlas, number) for number in range(len(atlas.objects))]
    low = np.array([each.min(axis=(0, 1)) // TEXEL_STEPS for each in corners])
    high = np.array([-(-each.max(axis=(0, 1)) // TEXEL_STEPS) for each in corners])
    return np.stack([low, high], axis=1)


def gaps(boxes: np.ndarray) -> np.ndarray:
    """The free texels between every two rectangles."""
    first, second = np.triu_indices(len(boxes), 1)
    one, other = boxes[first], boxes[second]
    return np.maximum(one[:, 0] - other[:, 1], other[:, 0] - one[:, 1]).max(axis=1)


@pytest.mark.parametrize("density", [None, 20.0])
def test_instances_have_the_same_layout_moved_by_whole_texels(density):
    objects = instances(uv_sphere(12, 6), 20)
    atlas = run_atlas(objects, 512, density, limits=LIMITS, rectangles=True)
    first = steps(atlas, 0)
    for number in range(1, len(objects)):
        moved = steps(atlas, number) - first
        assert (moved == moved[0, 0]).all()
        assert (moved[0, 0] % TEXEL_STEPS == 0).all()
    assert gaps(rectangles(atlas)).min() >= PADDING


def test_rectangles_of_any_objects_lie_apart_and_within_the_page():
    meshes = [box((1, 1, 1)), box((3, 0.1, 0.2)), uv_sphere(16, 8), box((0.3, 0.3, 5))]
    objects = [
        replace(each, name=f"{kind} {each.name}")
        for kind, mesh in enumerate(meshes)
        for each in instances(mesh, 9, kind, (0.2, 2.0))
    ]
    atlas = run_atlas(objects, 512, limits=LIMITS, rectangles=True)
    boxes = rectangles(atlas)
    assert gaps(boxes).min() >= PADDING
    assert boxes.min() >= PADDING // 2
    assert boxes.max() <= 512 - PADDING // 2
    assert not atlas.warnings
    everything = np.concatenate([laid.uv for laid in atlas.objects])
    assert coverage_sum(everything, 512).max() <= 1.0 + 1e-3
    assert atlas.pages[0].utilisation > 0.35


def test_a_density_is_kept_and_the_page_grows():
    objects = instances(box((1, 1, 1)), 30, sizes=(1.0, 1.0))
    atlas = run_atlas(objects, 64, 25.0, limits=LIMITS, rectangles=True)
    assert atlas.pages[0].resolution > 64
    for laid, source in zip(atlas.objects, objects, strict=True):
        edges = np.linalg.norm(source.triangles[:, 1] - source.triangles[:, 0], axis=1)
        flat = np.linalg.norm((laid.uv[:, 1] - laid.uv[:, 0]).astype(np.float64), axis=1)
        np.testing.assert_allclose(flat * atlas.pages[0].resolution / edges, 25.0, rtol=0.05)
    with pytest.raises(BakeError, match="lower the density"):
        run_atlas(objects, 64, 25.0, limits=Limits(64, PADDING), rectangles=True)


def test_too_small_a_page_is_crowded_and_says_so():
    atlas = run_atlas(instances(box((1, 1, 1)), 100), 16, limits=LIMITS, rectangles=True)
    (warning,) = atlas.warnings
    assert "16 px is too small" in warning.message
    uv = np.concatenate([laid.uv for laid in atlas.objects])
    assert (uv >= 0).all()
    assert (uv <= 1).all()


def test_triangles_without_area_get_a_place():
    triangles, polygon = box((1, 1, 1))
    flat = triangles.copy()
    flat[:2] = flat[0, 0]
    objects = [AtlasInput("flat", flat, polygon), AtlasInput("nothing", np.zeros((2, 3, 3)), polygon[:2])]
    atlas = run_atlas([*objects, AtlasInput("box", triangles, polygon)], 64, rectangles=True)
    assert all(np.isfinite(laid.uv).all() for laid in atlas.objects)


def test_shapes_are_told_apart():
    mesh = box((1, 2, 3))
    objects = instances(mesh, 4, sizes=(1.0, 1.0))
    triangles, polygon = objects[0].triangles, objects[0].polygon
    others = [
        AtlasInput("mirrored", triangles[:, ::-1] * (-1, 1, 1), polygon),
        AtlasInput("half", 0.5 * triangles, polygon),
        AtlasInput("stretched", triangles * (1, 1, 1.1), polygon),
        AtlasInput("painted", triangles, polygon, kind=np.arange(len(triangles))),
        AtlasInput("finer", triangles, polygon, scale=2.0),
        AtlasInput("kept", triangles, polygon, uv=np.zeros((len(triangles), 3, 2), np.float32)),
    ]
    shape = same_shapes([*objects, *others])
    assert len(set(shape[:4])) == 1
    assert len({shape[0], *shape[4:]}) == 1 + len(others)


def test_the_largest_instance_gets_what_it_is_due():
    sizes = (0.75, 1.0, 0.9)
    triangles, polygon = box((1, 1, 1))
    objects = [AtlasInput(f"{size}", size * triangles, polygon) for size in sizes]
    assert same_shapes(objects) == [1, 1, 1]


def test_rectangles_are_placed_without_overlap():
    rng = np.random.default_rng(2)
    sizes = rng.integers(1, 40, (200, 2))
    places, height = placed(sizes, 128)
    boxes = np.stack([places, places + sizes], axis=1)
    assert gaps(boxes).min() >= 0
    assert boxes[:, 1, 0].max() <= 128
    assert boxes[:, 1, 1].max() == height
    assert sizes.prod(axis=1).sum() > 0.85 * 128 * height
    assert placed(sizes, 20)[1] == np.inf
