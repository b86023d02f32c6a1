"""The bundled Cornell box is the measured one."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.files.cornell import LAMP_RADIANCE, REFLECTANCE, build_cornell_box, lamp_power
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.blender.scene_records.export_sources import Export
from radiosity_addon.lights.sun_and_sky import AreaLight
from radiosity_addon.options.bake_settings import BakeSettings

_WALLS = ["Floor", "Ceiling", "Back Wall", "Right Wall", "Left Wall"]
_BLOCKS = ["Short Block", "Tall Block"]


@pytest.fixture
def box() -> Export:
    build_cornell_box()
    return export_scene(bpy.context, BakeSettings())


def _rows(box: Export, name: str) -> slice:
    return next(obj.rows for obj in box.bake_scene.objects if obj.name == name)


def test_it_has_seven_named_objects_and_no_warnings(box: Export) -> None:
    assert [obj.name for obj in box.bake_scene.objects] == _WALLS + _BLOCKS
    assert all(obj.bake for obj in box.bake_scene.objects)
    assert box.bake_scene.warnings == ()
    assert len(box.bake_scene.scene) == 5 * 2 + 2 * 12


def test_walls_face_inwards(box: Export) -> None:
    scene = box.bake_scene.scene
    middle = np.array([0.0, 2.8, 2.7])
    for name in _WALLS:
        rows = _rows(box, name)
        to_middle = middle - scene.triangles[rows].mean(axis=1)
        assert (np.einsum("ti,ti->t", to_middle, scene.face_normals[rows]) > 0).all(), name


@pytest.mark.parametrize(("name", "height", "width"), [("Short Block", 1.65, 1.6), ("Tall Block", 3.3, 1.6)])
def test_blocks_are_closed_face_outwards_and_stand_on_the_floor(
    box: Export, name: str, height: float, width: float
) -> None:
    scene = box.bake_scene.scene
    triangles = scene.triangles[_rows(box, name)]
    vector_area = scene.face_normals[_rows(box, name)].T @ scene.areas[_rows(box, name)]
    np.testing.assert_allclose(vector_area, 0, atol=1e-5)
    volume = np.einsum("ti,ti->t", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])).sum() / 6
    assert volume == pytest.approx(height * width**2, rel=0.1)
    assert triangles[..., 2].min() == 0
    assert triangles[..., 2].max() == pytest.approx(height)


def test_its_size_is_the_measured_one(box: Export) -> None:
    triangles = box.bake_scene.scene.triangles
    np.testing.assert_allclose(np.ptp(triangles, axis=(0, 1)), (5.56, 5.592, 5.488), rtol=1e-5)
    floor = box.bake_scene.scene.areas[_rows(box, "Floor")].sum()
    assert floor == pytest.approx(0.5 * (5.528 + 5.496) * 5.592, rel=1e-5)


def test_colors_are_where_cornell_has_them(box: Export) -> None:
    scene = box.bake_scene.scene
    for name, color, side in (("Left Wall", "Red", -1), ("Right Wall", "Green", 1)):
        rows = _rows(box, name)
        np.testing.assert_allclose(scene.reflectance[rows], np.tile(REFLECTANCE[color], (2, 1)), rtol=1e-6)
        assert np.sign(scene.triangles[rows][..., 0].mean()) == side
    white = np.tile(REFLECTANCE["White"], (12, 1))
    np.testing.assert_allclose(scene.reflectance[_rows(box, "Tall Block")], white, rtol=1e-6)
    assert not scene.emission.any()


def test_its_lamp_has_the_measured_radiance_and_hangs_a_millimeter_below_the_ceiling(box: Export) -> None:
    (lamp,) = box.bake_scene.scene.lights
    assert isinstance(lamp, AreaLight)
    assert lamp.shape == "rectangle"
    assert lamp.area == pytest.approx(1.3 * 1.05, rel=1e-6)
    np.testing.assert_allclose(lamp.strength / (math.pi * lamp.area), LAMP_RADIANCE, rtol=1e-5)
    np.testing.assert_allclose(lamp.strength, lamp_power(), rtol=1e-6)
    assert lamp.position[2] == pytest.approx(5.488 - 0.001, abs=1e-6)
    down = np.cross(lamp.edge_u, lamp.edge_v)
    np.testing.assert_allclose(down / np.linalg.norm(down), (0, 0, -1), atol=1e-6)


def test_it_fills_an_empty_scene_and_leaves_a_used_one_alone() -> None:
    first = bpy.context.scene
    assert build_cornell_box() == first
    second = build_cornell_box()
    assert second != first
    assert bpy.context.scene == second
    assert len(second.objects) == len(first.objects) == 9
    assert second.camera is not None
    assert second.view_settings.view_transform == "Standard"
