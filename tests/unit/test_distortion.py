"""Faces whose texels are stretched are found, with the reason; others are not."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.unwrap import distortion
from radiosity_addon.lightmap.unwrap.atlas import AtlasInput, run_atlas

from .lightmap_meshes import box, quads, uv_sphere

SQUARE = np.array([[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]]])


def found(triangles, flat, uv, resolution=64, polygon=(0, 0)):
    uv = np.asarray(uv, dtype=np.float32)
    return distortion.stretched_faces("it", triangles, np.array(polygon), flat, uv, (0, resolution))


@pytest.mark.parametrize("factors", [(1.0, 1.0), (3.0, 1.0), (0.2, 0.7), (1.0, -5.0)])
def test_elongation_is_the_ratio_of_singular_values(factors) -> None:
    rng = np.random.default_rng(1)
    source = rng.normal(size=(50, 3, 3))
    # Flatten each triangle exactly, then scale and turn it.
    edge_1, edge_2 = source[:, 1] - source[:, 0], source[:, 2] - source[:, 0]
    x = edge_1 / np.linalg.norm(edge_1, axis=1, keepdims=True)
    z = np.cross(edge_1, edge_2)
    y = np.cross(z / np.linalg.norm(z, axis=1, keepdims=True), x)
    flat = np.stack([np.einsum("nkd,nd->nk", source, axis) for axis in (x, y)], axis=-1)
    cos, sin = np.cos(0.7), np.sin(0.7)
    target = (flat * factors) @ np.array([[cos, sin], [-sin, cos]]) + 3.0
    sizes = sorted(np.abs(factors))
    np.testing.assert_allclose(distortion.elongation(source, target), sizes[1] / sizes[0], rtol=1e-6)


def test_each_of_the_steps_that_may_stretch_is_named() -> None:
    world = np.concatenate([SQUARE, np.zeros((2, 3, 1))], axis=2)
    assert found(world, SQUARE, SQUARE * 0.5) == []
    page = found(world, SQUARE, SQUARE * (0.9, 0.3))
    assert [(each.reason, each.faces, each.share) for each in page] == [(distortion.PACKED, 2, 1.0)]
    chart = found(world, SQUARE * (0.3, 0.9), SQUARE * (0.3, 0.9))
    assert [(each.reason, each.faces) for each in chart] == [(distortion.CURVED, 2)]
    upright = world.copy()
    upright[1, 2] = (0.0, 1.0, 3.0)
    assert [each.reason for each in found(upright, SQUARE, SQUARE * 0.5)] == [distortion.BENT]


def test_what_nobody_sees_or_shares_texels_is_left_out() -> None:
    world = np.concatenate([SQUARE, np.zeros((2, 3, 1))], axis=2)
    assert found(world, SQUARE, SQUARE * (0.01, 0.0025)) == []
    assert found(world, SQUARE, SQUARE * (0.9, 0.0) + 0.5 / 64) == []


def test_what_is_stretched_is_reported_and_a_large_part_of_it_warned_of() -> None:
    lain_flat = run_atlas([AtlasInput("box", *box((1, 2, 3))), AtlasInput("ball", *uv_sphere(8, 12))], 128)
    assert lain_flat.stretched == ()
    bent, polygon = quads([[(0, 0, 0), (1, 0, 0), (1, 1, 0), (0.4, 0.4, 2.0)]])
    atlas = run_atlas([AtlasInput("bent", bent, polygon)], 128)
    assert {each.reason for each in atlas.stretched} == {distortion.BENT}
    assert any(distortion.BENT in each.message for each in atlas.warnings)
