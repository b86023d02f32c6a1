"""The solver's input contract: what is refused, and what becomes of the rest."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from radiosity_addon.base.errors import SceneError
from radiosity_addon.numerics.radiometry import MAX_REFLECTANCE
from radiosity_addon.solver import PointLight, Scene
from tests.rooms import box_room, gray, gray_scene

TRIANGLES = np.array([[[0.0, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 0, 1], [1, 1, 2], [2, 2, 3]]])


def scene(**changed: Any) -> Scene:
    given = {"triangles": TRIANGLES, "reflectance": gray(2, 0.5), "emission": gray(2, 1.0), **changed}
    return Scene(**given)


def with_value(value: float) -> np.ndarray:
    rows = gray(2, 0.5)
    rows[1, 2] = value
    return rows


@pytest.mark.parametrize("name", ["reflectance", "emission"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, -1e-9])
def test_bad_colors_are_named_with_their_triangle(name: str, value: float) -> None:
    with pytest.raises(SceneError, match=f"{name} of triangle 1 is negative, NaN or infinite"):
        scene(**{name: with_value(value)})


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_bad_corners_are_named_with_their_triangle(value: float) -> None:
    corners = TRIANGLES.copy()
    corners[1, 2, 0] = value
    with pytest.raises(SceneError, match="triangle 1"):
        scene(triangles=corners)


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("triangles", (2, 3)),
        ("triangles", (2, 4, 3)),
        ("triangles", (2, 3, 2)),
        ("reflectance", (3,)),
        ("reflectance", (3, 3)),
        ("emission", (2,)),
        ("emission", (2, 4)),
        ("normals", (2, 3)),
        ("normals", (1, 3, 3)),
        ("two_sided", (3,)),
        ("two_sided", (2, 2)),
    ],
)
def test_wrong_shapes_are_named(name: str, shape: tuple[int, ...]) -> None:
    with pytest.raises(SceneError, match=name):
        scene(**{name: np.ones(shape)})


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_normals_that_are_no_numbers_are_refused(value: float) -> None:
    normals = np.tile([0.0, 0.0, 1.0], (2, 3, 1))
    normals[1, 0, 0] = value
    with pytest.raises(SceneError, match="normal"):
        scene(normals=normals)


def test_reflectance_is_clamped_and_the_callers_array_is_not() -> None:
    given = with_value(7.0)
    assert scene(reflectance=given).reflectance[1].tolist() == [0.5, 0.5, MAX_REFLECTANCE]
    assert given[1, 2] == 7.0


def test_areas_and_normals() -> None:
    made = scene()
    assert made.areas.tolist() == [1.0, 0.0]
    assert made.face_normals.tolist() == [[0, 0, 1], [0, 0, 0]]
    np.testing.assert_array_equal(made.normals, np.repeat(made.face_normals[:, None], 3, axis=1))
    room, _ = box_room((2, 3, 4))
    inside = gray_scene(room)
    assert inside.areas.sum() == pytest.approx(2 * (6 + 8 + 12), rel=1e-15)
    to_middle = np.array([1, 1.5, 2]) - room.mean(axis=1)
    assert (np.einsum("ti,ti->t", to_middle, inside.face_normals) > 0).all()


def test_two_sided_is_spread_and_what_is_given_is_kept() -> None:
    assert scene().two_sided.tolist() == [False, False]
    assert scene(two_sided=True).two_sided.tolist() == [True, True]
    assert scene(two_sided=np.array([True, False])).two_sided.tolist() == [True, False]
    lamp = PointLight((0, 0, 1), 5.0)
    assert scene(lights=[lamp]).lights == (lamp,)
    normals = np.tile([0.0, 0.6, 0.8], (2, 3, 1))
    np.testing.assert_array_equal(scene(normals=normals).normals, normals)


def test_lists_and_float32_are_taken_and_an_empty_scene_is_one() -> None:
    made = scene(triangles=TRIANGLES.astype(np.float32).tolist(), reflectance=[[0, 0, 0], [1, 1, 1]])
    assert made.triangles.dtype == made.reflectance.dtype == np.float64
    assert len(made) == 2
    assert len(Scene(np.zeros((0, 3, 3)), np.zeros((0, 3)), np.zeros((0, 3)))) == 0
