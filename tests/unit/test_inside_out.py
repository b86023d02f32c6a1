"""Closed parts whose normals point inward are inside out, except for rooms and cavities."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from radiosity_addon.bake.turned_faces import of_inside_out
from radiosity_addon.scene import inside_out
from radiosity_addon.scene.bake_scene import BakeScene
from radiosity_addon.solver import AreaLight, PointLight, SunLight
from tests.rooms import box_room, gray, gray_scene, rectangle, solid_box, sphere
from tests.unit.texel_scenes import bake_scene

ROOM = box_room((4, 4, 3))[0]
TABLE = solid_box((1, 1, 0), (2, 2, 0.8))
TURNED = np.ascontiguousarray(solid_box((2.5, 2.5, 0.0), (3, 3, 1))[:, ::-1])


def scene_of(*parts: np.ndarray, **more: Any) -> BakeScene:
    scene = gray_scene(np.concatenate(parts), two_sided=True, **more)
    return bake_scene(scene, *((f"{number}", len(part)) for number, part in enumerate(parts)))


def named(scene: BakeScene) -> list[str]:
    """Return the objects that are inside out, each of which must be so as a whole."""
    found = inside_out(scene)
    for item in scene.objects:
        assert found[item.rows].all() or not found[item.rows].any()
    assert [warning.name for warning in of_inside_out(scene)] == [
        item.name for item in scene.objects if found[item.rows].all()
    ]
    return [item.name for item in scene.objects if found[item.rows].all()]


def test_a_solid_whose_normals_point_inward_is_inside_out_in_a_room_and_alone() -> None:
    assert named(scene_of(ROOM, TABLE, TURNED)) == ["2"]
    assert named(scene_of(TURNED, sphere(2) + 9.0)) == ["0", "1"]
    (warning,) = of_inside_out(scene_of(ROOM, TABLE, TURNED))
    assert warning.message.startswith("object '2' is inside out on 100% of its surface")


def test_a_room_is_not() -> None:
    """With a table on its floor, a camera, or a lamp in it; a picture on a wall does not tell."""
    picture = rectangle((0, 1, 1), (0, 1, 0), (0, 0, 1))
    assert named(scene_of(ROOM, picture)) == ["0"]
    assert named(scene_of(ROOM, TABLE)) == []
    assert named(scene_of(np.concatenate([ROOM, TABLE]))) == []
    assert named(replace(scene_of(ROOM), cameras=((3.5, 0.5, 1.5),))) == []
    lamps = [PointLight((2, 2, 2), 9.0), AreaLight((2, 2, 2.9), (1, 0, 0), (0, -1, 0), 9.0)]
    for lamp in lamps:
        assert named(scene_of(ROOM, lights=[lamp])) == []


def test_things_in_its_box_make_no_room() -> None:
    """A lamp, a camera or a block next to a ball; a peg that sticks in it; a copy in its place."""
    ball = 0.9 * sphere(3)
    corner = solid_box((0.7, 0.7, 0.7), (0.8, 0.8, 0.8))
    peg = solid_box((-0.1, -0.1, 0.5), (0.1, 0.1, 2.0))
    lights = [PointLight((0.8, 0.8, 0.8), 9.0), SunLight((0, 0, -1.0), 3.0)]
    scene = scene_of(ball, corner, peg, ball, ball[:, ::-1], lights=lights)
    assert named(replace(scene, cameras=((-0.8, 0.8, 0.8),))) == ["0", "3"]


def test_a_cavity_of_a_solid_is_not() -> None:
    shell = np.concatenate([sphere(3)[:, ::-1], 0.9 * sphere(3)])
    assert named(scene_of(shell)) == []
    # The same in a room in a solid house.
    house = solid_box((-2, -2, -2), (3, 3, 3))
    room = np.ascontiguousarray(solid_box((-1.5, -1.5, -1.5), (2.5, 2.5, 2.5))[:, ::-1])
    assert named(scene_of(house, room, shell)) == []
    assert named(scene_of(house, room, shell, TURNED * 0.1)) == ["3"]


@pytest.mark.parametrize("what", ["open", "clear to rays", "shining"])
def test_only_closed_and_opaque_parts_are(what: str) -> None:
    if what == "open":
        assert named(scene_of(TURNED[:-1])) == []
    elif what == "shining":
        assert named(scene_of(TURNED, emission=1.0)) == []
        # A lamp of faces lights a room as well as any other.
        emission = np.repeat(gray(2, 1.0) * [[0.0], [1.0]], [12, 12], axis=0)
        bulb = solid_box((2.6, 2.6, 0.4), (2.7, 2.7, 0.5))
        assert named(scene_of(TURNED, bulb, emission=emission)) == []
    else:
        assert named(scene_of(TURNED, in_shadows=False)) == []


def test_a_small_part_of_an_object_counts_from_a_tenth_of_its_area() -> None:
    lid = np.ascontiguousarray(solid_box((5, 5, 1.001), (6, 6, 1.011))[:, ::-1])
    chest, hall = solid_box((5, 5, 0), (6, 6, 1)), solid_box((5, 5, 0), (9, 9, 1))
    (warning,) = of_inside_out(scene_of(np.concatenate([chest, lid])))
    assert "is inside out on 25% of its surface" in warning.message
    assert warning.turned == tuple(range(6, 12))
    assert of_inside_out(scene_of(np.concatenate([hall, lid]))) == []
    unbaked = bake_scene(gray_scene(TURNED), ("Turned", 12, None, False))
    assert of_inside_out(unbaked) == []
    assert inside_out(unbaked).all()
