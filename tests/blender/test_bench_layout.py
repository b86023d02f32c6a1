"""The layout of benchmarks that suits a denoiser."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from bench.interior.furniture import bookcase
from bench.layout import CORNER, project_smart
from radiosity_addon.lightmap.texels import coverage_sum
from radiosity_addon.scene.bake_scene import LIGHTMAP_UV_LAYER

CUBE = np.array([[(corner >> axis) & 1 for axis in range(3)] for corner in range(8)], dtype=float)
SIDES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))


@pytest.mark.one_blender
def test_smart_islands_are_faces_of_meshes_whose_triangles_share_no_vertices() -> None:
    """Each side of a cube of single triangles is one island, and the mesh stays as it was."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    triangles = np.array([CUBE[[side[0], side[k], side[k + 1]]] for side in SIDES for k in (1, 2)])
    mesh = bpy.data.meshes.new("Soup")
    mesh.from_pydata(triangles.reshape(-1, 3).tolist(), [], np.arange(36).reshape(-1, 3).tolist())
    mesh.uv_layers.new(name=LIGHTMAP_UV_LAYER)
    obj = bpy.data.objects.new("Soup", mesh)
    bpy.context.scene.collection.objects.link(obj)

    project_smart(bpy.context.scene, 64)

    assert obj.data is mesh
    assert list(bpy.data.meshes) == [mesh]
    assert len(mesh.vertices) == 36
    assert LIGHTMAP_UV_LAYER in mesh.uv_layers
    assert CORNER not in mesh.attributes
    uv = np.empty((36, 2), dtype=np.float32)
    mesh.uv_layers[LIGHTMAP_UV_LAYER].data.foreach_get("uv", uv.reshape(-1))
    for one, other in uv.reshape(6, 2, 3, 2):
        # A side's triangles are (0, 1, 2) and (0, 2, 3) of its corners.
        np.testing.assert_allclose(one[[0, 2]], other[[0, 1]], atol=1e-6)
    along, across = uv[1::3] - uv[::3], uv[2::3] - uv[::3]
    areas = np.abs(along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]) / 2
    np.testing.assert_allclose(areas, areas[0], rtol=1e-3)
    assert areas.sum() > 0.3


@pytest.mark.one_blender
def test_boxes_that_touch_stay_apart() -> None:
    """Of a bookcase, whose books and boards touch, no island covers another."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    shape = bookcase(np.random.default_rng(0))
    mesh = bpy.data.meshes.new("Bookcase")
    mesh.from_pydata(shape.vertices.tolist(), [], shape.faces)
    mesh.uv_layers.new(name=LIGHTMAP_UV_LAYER)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Bookcase", mesh))

    project_smart(bpy.context.scene, 512)

    uv = np.empty((len(mesh.loops), 2), dtype=np.float32)
    mesh.uv_layers[LIGHTMAP_UV_LAYER].data.foreach_get("uv", uv.reshape(-1))
    mesh.calc_loop_triangles()
    triangles = np.array([uv[triangle.loops] for triangle in mesh.loop_triangles])
    assert coverage_sum(triangles, 512).max() <= 1.01
