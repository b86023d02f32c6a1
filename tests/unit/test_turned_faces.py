"""What shows its backs to the light is warned of, and nothing else is."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from radiosity_addon.bake.turned_faces import BackProbe, turned_away, turned_polygons
from radiosity_addon.lights import EnvironmentLight, SunLight
from radiosity_addon.numerics import triangle_areas
from radiosity_addon.scene import places, wound_parts
from radiosity_addon.scene.bake_scene import BakeScene
from radiosity_addon.solver import PointLight, Scene, solve
from tests.rooms import box_room, gray_scene, rectangle, solid_box
from tests.unit.test_pipeline import run
from tests.unit.texel_scenes import bake_object, bake_scene

LAMP = PointLight((0.5, 0.4, 0.6), (10.0, 5.0, 2.0), radius=0.05)


class AlwaysLit(BackProbe):
    """Takes every back for lit."""

    def __init__(self) -> None:
        pass

    def lit(self, rows: np.ndarray, least: float) -> np.ndarray:
        return np.full(len(rows), least >= 0.0)

    def hidden(self, rows: np.ndarray, reach: np.ndarray) -> np.ndarray:
        return np.zeros(len(rows), dtype=bool) & (reach > 0.0)

    def viewed(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros(len(rows)), np.zeros(len(rows))


def told(scene: BakeScene, **settings: int) -> list[str]:
    result = run(scene, quality="sketch", **settings)
    said = ("is lit from behind", "is inside out on 100% of its surface")
    return sorted(w.name for w in result.warnings if any(text in w.message for text in said))


def patches(count: int) -> Scene:
    """Equal triangles apart from each other."""
    corner = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], dtype=float)
    return gray_scene(corner + 2.0 * np.arange(count)[:, None, None], two_sided=True)


def turned(triangles: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(triangles[:, [0, 2, 1]])


def room(is_turned: bool) -> BakeScene:
    """A closed room with a screen, lit from both sides by what the walls reflect, and a solid block."""
    triangles, surface = box_room()
    wall = triangles[surface == 5]
    screen = rectangle((0.2, 0.7, 0.2), (0.5, 0, 0), (0, 0, 0.4))
    block = solid_box((0.1, 0.1, 0.1), (0.3, 0.3, 0.3))
    parts = [triangles[surface != 5], turned(wall) if is_turned else wall, screen, block]
    everything = np.concatenate(parts)
    scene = gray_scene(everything, two_sided=True, lights=[LAMP])
    names = ("Room", "Wall", "Screen", "Block")
    return bake_scene(scene, *((name, len(part)) for name, part in zip(names, parts, strict=True)))


@pytest.mark.parametrize("is_turned", [False, True])
def test_a_wall_whose_normals_point_out_of_its_room_is_warned_of(is_turned: bool) -> None:
    result = run(room(is_turned))
    names = [warning.name for warning in result.warnings if "from behind" in warning.message]
    assert names == (["Wall"] if is_turned else [])
    if is_turned:
        (message,) = (w.message for w in result.warnings if w.name == "Wall" and "behind" in w.message)
        assert message.startswith("object 'Wall' is lit from behind on 100% of its surface")
        assert [w.turned for w in result.warnings if w.turned] == [(0,)]


def tub(low: tuple[float, float, float], high: tuple[float, float, float]) -> np.ndarray:
    """A closed tub: a box with a basin of walls 5 cm thick in it; normals point out of the material."""
    lower, upper = np.array(low), np.array(high)
    inward, surface = box_room(upper - lower, 2)
    outside = turned(inward + lower)[surface != 1]
    inner = lower + 0.05
    basin, surface = box_room(np.append((upper - 0.05 - inner)[:2], upper[2] - inner[2]), 2)
    (x0, y0), (x1, y1), (a0, b0), (a1, b1), z = lower[:2], upper[:2], inner[:2], upper[:2] - 0.05, upper[2]
    strips = ((x0, y0, x1, b0), (x0, b1, x1, y1), (x0, b0, a0, b1), (a1, b0, x1, b1))
    rim = [rectangle((u0, v0, z), (u1 - u0, 0, 0), (0, v1 - v0, 0)) for u0, v0, u1, v1 in strips]
    return np.concatenate([outside, (basin + inner)[surface != 1], *rim])


@pytest.mark.parametrize("is_turned", [False, True])
@pytest.mark.parametrize("is_sunny", [False, True])
def test_closed_things_whose_normals_point_inward_are_warned_of(is_turned: bool, is_sunny: bool) -> None:
    """Also in a room a hundred times darker than what the sun lights outside."""
    walls, surface = box_room((3, 4, 2.5), 4)
    center = walls.mean(axis=1)
    window = (surface == 2) & (abs(center[:, 1] - 2) < 1) & (abs(center[:, 2] - 1.5) < 0.4)
    things = [tub((1.2, 2.4, 0.0), (2.9, 3.2, 0.55)), solid_box((1, 3.97, 1.2), (1.8, 4.0, 1.8))]
    parts = [walls[~window], *(turned(thing) if is_turned else thing for thing in things)]
    names = ["Room", "Tub", "Frame"]
    if is_sunny:
        parts.append(rectangle((-50, -50, -0.1), (100, 0, 0), (0, 100, 0)))
        names.append("Ground")
    lights = [SunLight((0.5, 0.2, -0.8), 500.0), EnvironmentLight(5.0)] if is_sunny else [LAMP]
    scene = gray_scene(np.concatenate(parts), 0.7, two_sided=True, lights=lights)
    found = bake_scene(scene, *((name, len(part)) for name, part in zip(names, parts, strict=True)))
    assert told(found, resolution=128) == (["Frame", "Tub"] if is_turned else [])


def open_frame(width: float, bar: float, depth: float) -> np.ndarray:
    """A picture's frame on the plane y = 0, open behind, in one piece; normals point outward."""
    profile = ((0.0, 0.0), (0.0, -depth), (bar, -depth), (bar, 0.0))
    rings = []
    for inset, y in profile:
        far = width - inset
        rings.append(
            [np.array((x, y, z)) for x, z in ((inset, inset), (far, inset), (far, far), (inset, far))]
        )
    triangles = []
    for outer, inner in pairwise(rings):
        for one in range(4):
            a, b, c, d = outer[one], outer[one - 3], inner[one - 3], inner[one]
            triangles += [(a, b, c), (a, c, d)]
    return np.array(triangles)


@pytest.mark.parametrize("is_turned", [False, True])
def test_a_frame_that_faces_the_wall_it_hangs_on_is_warned_of(is_turned: bool) -> None:
    """Light gets into the gap behind it, so its front is not black."""
    walls, _ = box_room((3, 4, 2.5), 4)
    frame = open_frame(0.8, 0.08, 0.02) + np.array((1.1, 3.985, 0.9))
    parts = [walls, turned(frame) if is_turned else frame]
    scene = gray_scene(np.concatenate(parts), 0.7, two_sided=True, lights=[replace(LAMP, position=(1, 1, 2))])
    found = bake_scene(scene, ("Room", len(walls)), ("Frame", len(frame)))
    assert told(found, resolution=256) == (["Frame"] if is_turned else [])


def partition_that_faces_the_darker_room() -> BakeScene:
    """Its back gets several times as much light, but its front is seen, and lit."""
    walls, _ = box_room((3, 4, 2.5), 4)
    partition = rectangle((0, 2, 0), (2, 0, 0), (0, 0, 2.5), 2)
    lights = [replace(LAMP, position=(1, 3, 2))]
    parts = [walls, partition]
    scene = gray_scene(np.concatenate(parts), 0.7, two_sided=True, lights=lights)
    solved = solve(scene)
    own = slice(len(walls), None)
    front = float(solved.triangle_irradiance[own].mean())
    assert 0.05 * float(solved.back_irradiance[own].mean()) < front
    assert front < 0.5 * float(solved.back_irradiance[own].mean())
    return bake_scene(scene, ("Room", len(walls)), ("Partition", len(partition)))


@pytest.mark.parametrize(
    ("cameras", "named"),
    [
        ((), []),
        (((1, 1, 1),), []),
        (((1, 3, 1),), ["Partition"]),
        (((1, 3, 1), (1, 1, 1)), []),
        # Beyond the room's wall, which hides the partition.
        (((1, 9, 1),), []),
    ],
)
def test_what_cameras_see_only_from_behind_is_turned(
    cameras: tuple[tuple[float, float, float], ...], named: list[str]
) -> None:
    result = run(replace(partition_that_faces_the_darker_room(), cameras=cameras), quality="sketch")
    found = [(warning.name, warning.turned) for warning in result.warnings if "behind" in warning.message]
    assert found == [(name, (0, 1, 2, 3)) for name in named]


@pytest.mark.parametrize("shines", [False, True])
def test_a_closed_bulb_is_not_lit_from_behind(shines: bool) -> None:
    """Its inside is far brighter than the room, by its own light alone."""
    walls, _ = box_room((4, 5, 3), 2)
    bulb = solid_box((1.85, 2.35, 2.35), (2.15, 2.65, 2.65))
    scene = gray_scene(np.concatenate([walls, bulb]), 0.8, two_sided=True, lights=[] if shines else [LAMP])
    if shines:
        scene.emission[len(walls) :] = 5 * np.pi
    assert told(bake_scene(scene, ("Room", len(walls)), ("Bulb", len(bulb))), resolution=64) == []


def test_one_wall_of_an_object_counts_but_not_a_scrap_nor_what_is_dark_on_both_sides() -> None:
    scene = patches(48)
    front, back = np.ones(48), np.zeros(48)
    front[:2], back[:2] = 0.0, 1.0
    front[46:], back[46:] = 0.0, 0.05
    many = [bake_object("Mostly Right", 0, 30), bake_object("Closet", 46, 2)]
    probe = AlwaysLit()
    assert list(turned_away(many, scene, front, back, probe)) == []
    (warning,) = turned_away([bake_object("Four Walls", 0, 8)], scene, front, back, probe)
    assert warning.name == "Four Walls"
    assert "on 25% of its surface" in warning.message
    assert warning.turned == (0,)
    back[46:] = 0.5
    assert [warning.name for warning in turned_away(many, scene, front, back, probe)] == ["Closet"]


def test_parts_are_turned_as_a_whole_or_not_at_all() -> None:
    """What is lit decides, by its area; a part ends where neighbors face opposite ways."""
    wall = rectangle((0, 0, 0), (4, 0, 0), (0, 0, 4), 4)
    dark = rectangle((9, 0, 0), (1, 0, 0), (0, 0, 1), 4)
    beside = rectangle((4, 0, 0), (4, 0, 0), (0, 0, 4), 4)[:, ::-1]
    triangles = np.concatenate([wall, dark, beside])
    polygon = np.concatenate([np.tile(np.arange(16), 2), 16 + np.arange(32) // 2, 32 + np.arange(32)])
    item = replace(bake_object("Walls", 0, 96), polygon=polygon)
    unlit = np.zeros(96, dtype=bool)
    unlit[[0, 5]] = unlit[32:64] = True
    lit = np.setdiff1d(np.arange(32), [0, 5])

    def found(lit_behind: int, lit_in_front: int = 0) -> tuple[int, ...]:
        part = wound_parts(places(triangles))
        right = np.zeros(96, dtype=bool)
        right[lit[len(lit) - lit_in_front :]] = True
        return turned_polygons(item, part, triangle_areas(triangles), lit[:lit_behind], unlit, right)

    assert found(30) == found(15) == tuple(range(16))
    assert found(14) == ()
    # More than a tenth of it that is lit in front is not to go dark.
    assert found(27, lit_in_front=3) == tuple(range(16))
    assert found(26, lit_in_front=4) == ()
    # Faces that face the other way are a part of their own, though they go on where the wall ends.
    assert np.bincount(wound_parts(places(triangles))).tolist() == [32, 32, 32]


@pytest.mark.parametrize(("behind", "flips"), [(30, 16), (16, 0)])
def test_the_button_is_offered_where_it_would_flip(behind: int, flips: int) -> None:
    scene = gray_scene(rectangle((0, 0, 0), (4, 0, 0), (0, 0, 4), 4))
    front, back = np.ones(32), np.ones(32)
    front[:behind] = 0.0
    item = replace(bake_object("Wall", 0, 32), polygon=np.tile(np.arange(16), 2))
    (warning,) = turned_away([item], scene, front, back, AlwaysLit())
    assert len(warning.turned) == flips
    assert ("Flip Faces" in warning.message) == bool(flips)
    assert "Mesh → Normals → Flip" in warning.message


def test_without_light_nothing_is_turned_away() -> None:
    objects = [bake_object("Dark", 0, 2)]
    assert list(turned_away(objects, patches(2), np.zeros(2), np.zeros(2), AlwaysLit())) == []
