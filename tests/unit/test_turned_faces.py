"""A wall that shows its back to the light is told of, and nothing else is."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.lightmap.images.turned_faces import turned_away
from radiosity_addon.scene.bake_scene import BakeScene
from radiosity_addon.solver import PointLight
from tests.rooms import box_room, gray, gray_scene, rectangle, solid_box
from tests.unit.test_pipeline import run
from tests.unit.texel_scenes import bake_object, bake_scene

LAMP = PointLight((0.5, 0.4, 0.6), (10.0, 5.0, 2.0), radius=0.05)


def room(turned: bool) -> BakeScene:
    """A closed room with a screen, lit from both sides by what the walls reflect, and a solid block."""
    triangles, surface = box_room()
    wall = triangles[surface == 5]
    screen = rectangle((0.2, 0.7, 0.2), (0.5, 0, 0), (0, 0, 0.4))
    block = solid_box((0.1, 0.1, 0.1), (0.3, 0.3, 0.3))
    parts = [triangles[surface != 5], wall[:, ::-1] if turned else wall, screen, block]
    everything = np.concatenate(parts)
    scene = gray_scene(everything, two_sided=True, lights=[LAMP])
    names = ("Room", "Wall", "Screen", "Block")
    return bake_scene(scene, *((name, len(part)) for name, part in zip(names, parts, strict=True)))


@pytest.mark.parametrize("turned", [False, True])
def test_a_wall_whose_normals_point_out_of_its_room_is_warned_of(turned: bool) -> None:
    result = run(room(turned))
    told = [warning.name for warning in result.warnings if "from behind only" in warning.message]
    assert told == (["Wall"] if turned else [])
    if turned:
        (message,) = (w.message for w in result.warnings if w.name == "Wall" and "behind" in w.message)
        assert message.startswith("object 'Wall' is lit from behind only on 100% of its surface")


def test_one_wall_of_an_object_counts_but_not_a_scrap_nor_what_is_dark_on_both_sides() -> None:
    areas = np.ones(48)
    fronts, backs = gray(48, 1.0), gray(48, 0.0)
    fronts[:2], backs[:2] = 0.0, 1.0
    fronts[46:], backs[46:] = 0.0, 0.05
    many = [bake_object("Mostly Right", 0, 30), bake_object("Closet", 46, 2)]
    assert list(turned_away(many, areas, fronts, backs)) == []
    (warning,) = turned_away([bake_object("Four Walls", 0, 8)], areas, fronts, backs)
    assert warning.name == "Four Walls"
    assert "on 25% of its surface" in warning.message
    backs[46:] = 0.5
    assert [warning.name for warning in turned_away(many, areas, fronts, backs)] == ["Closet"]


def test_without_light_nothing_is_turned_away() -> None:
    objects = [bake_object("Dark", 0, 2)]
    assert list(turned_away(objects, np.ones(2), gray(2, 0.0), gray(2, 0.0))) == []
