"""Faces that are not planar are lit by the normals Cycles lights them by."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest

from tests.blender.exporting import export_with, objects_by_name
from tests.blender.scenes import add_lamp, add_mesh, measure_irradiance

CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0.9), (0, 1, 0), (3, 0, 0), (4, 0, 0), (4, 1, 0.3), (3, 1, 0))
FACES = ((0, 1, 2, 3), (4, 5, 6, 7))
SMOOTH = {
    "flat": (False, False),
    "first flat": (False, True),
    "smooth": (True, True),
    "sharp edges": (True, True),
    "custom": (True, True),
    "flat with custom": (False, False),
}


def folded(case: str) -> bpy.types.Object:
    """A quad whose triangles lie at 38° to each other, and a second one."""
    obj = add_mesh("Folded", CORNERS, FACES, scale=(1.0, 1.5, 1.0))
    mesh = obj.data
    mesh.polygons.foreach_set("use_smooth", SMOOTH[case])
    if case == "sharp edges":
        mesh.edges.foreach_set("use_edge_sharp", [True] * len(mesh.edges))
    if "custom" in case:
        mesh.normals_split_custom_set([(0, 0, 1)] * len(mesh.loops))
    mesh.update()
    return obj


@pytest.mark.parametrize("case", SMOOTH)
def test_folded_quads_are_lit_as_in_cycles(case: str) -> None:
    obj = folded(case)
    sun = add_lamp("SUN", energy=2.0, angle=0.0, transform={"rotation_euler": (0.3, 0.5, 0.0)})
    export = export_with()
    normals = export.bake_scene.scene.normals[objects_by_name(export)["Folded"].rows][:2]
    np.testing.assert_allclose(np.linalg.norm(normals, axis=2), 1, rtol=1e-6)
    to_sun = np.array(sun.matrix_world.to_3x3())[:, 2]
    # Each triangle is half of the meter's page.
    expected = 2.0 * (normals @ to_sun).mean()
    assert np.ptp(normals @ to_sun, axis=1).max() < 1e-3  # custom normals are kept with 16 bits
    # Texels on the diagonal are one triangle's: 1/128 of them.
    assert measure_irradiance(obj, size=128) == pytest.approx(expected, rel=0.01)


def test_a_flat_quads_halves_have_their_own_normals() -> None:
    folded("flat")
    scene = export_with().bake_scene.scene
    np.testing.assert_allclose(scene.normals, np.repeat(scene.face_normals[:, None], 3, axis=1), atol=1e-6)
    between = math.degrees(math.acos(scene.normals[0, 0] @ scene.normals[1, 0]))
    assert between > 30
