"""The sides of triangles that take part in the light, and that they are stored once."""

from __future__ import annotations

import numpy as np

from radiosity_addon.scene import Faces
from radiosity_addon.solver import Scene
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from tests.rooms import box_room, gray

SHARED = ("reflectance", "emission", "opacity")


def room(two_sided: bool | np.ndarray = False) -> Scene:
    triangles, _ = box_room((2, 3, 1), 3)
    random = np.random.default_rng(1)
    return Scene(triangles, random.uniform(0, 0.9, (len(triangles), 3)), gray(len(triangles), 1.0), two_sided)


def test_fronts_of_a_whole_scene_are_not_stored_again() -> None:
    scene = room()
    hierarchy = Hierarchy(scene)
    faces = hierarchy.faces
    assert np.shares_memory(faces.corners, scene.triangles)
    assert np.shares_memory(faces.normal, scene.face_normals)
    assert np.shares_memory(faces.area, scene.areas)
    assert all(np.shares_memory(getattr(faces, name), getattr(scene, name)) for name in SHARED)
    # What elements become is no part of the scene.
    before = scene.triangles.copy(), scene.reflectance.copy()
    hierarchy.subdivide(np.array([1, 4]))
    np.testing.assert_array_equal(faces.corners, scene.triangles)
    np.testing.assert_array_equal(scene.triangles, before[0])
    np.testing.assert_array_equal(scene.reflectance, before[1])


def test_backs_are_their_fronts_turned() -> None:
    chosen = np.arange(108) % 3 == 0
    scene = room(chosen)
    given = scene.triangles.copy(), scene.face_normals.copy()
    faces, count = Faces(scene), len(scene)
    np.testing.assert_array_equal(faces.triangle, np.append(np.arange(count), np.flatnonzero(chosen)))
    np.testing.assert_array_equal(faces.corners[:count], scene.triangles)
    np.testing.assert_array_equal(faces.corners[count:], scene.triangles[chosen][:, [0, 2, 1]])
    np.testing.assert_array_equal(faces.normal[count:], -scene.face_normals[chosen])
    np.testing.assert_array_equal(faces.area[count:], scene.areas[chosen])
    np.testing.assert_array_equal(scene.triangles, given[0])
    np.testing.assert_array_equal(scene.face_normals, given[1])
