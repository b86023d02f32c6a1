"""Warnings about texels name the object that is to blame."""

from __future__ import annotations

import numpy as np

from radiosity_addon.bake.bake_warnings import small_objects
from radiosity_addon.lightmap.unwrap.dominant_object import greedy_object, share_of
from radiosity_addon.scene.bake_scene import BakeObject, BakeScene
from radiosity_addon.scene.scene import Scene

CORNER = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])


class Texels:
    """As much of a `TexelGeometry` as counts: how many texels each triangle has, and where."""

    def __init__(self, *counts: int, lines: tuple[int, ...] = ()) -> None:
        self.counts = np.array(counts)
        self.uv = np.tile(CORNER[:, :2], (len(counts), 1, 1))
        self.uv[list(lines), :, 0] = 0.5


def warnings(*counts: int) -> dict[str, str]:
    """What is said of objects of one triangle each that got so many texels."""
    count = len(counts)
    triangles = np.tile(CORNER, (count, 1, 1))
    numbers = np.zeros(1, dtype=np.int32)
    objects = [
        BakeObject(f"Object {row}", row, 1, True, numbers, numbers.reshape(1, 1).repeat(3, 1))
        for row in range(count)
    ]
    scene = BakeScene(Scene(triangles, np.zeros((count, 3)), np.zeros((count, 3))), tuple(objects))
    return {each.name: each.message for each in small_objects(scene, objects, Texels(*counts))}


def test_one_huge_object_is_named_instead_of_the_resolution() -> None:
    said = warnings(100_000, 12, 70)
    assert list(said) == ["Object 1"]
    assert "12 texels" in said["Object 1"]
    assert "'Object 0' takes 99.9 % of all texels" in said["Object 1"]
    assert "raise the resolution" not in said["Object 1"]


def test_without_one_the_resolution_is_to_be_raised() -> None:
    assert "raise the resolution" in warnings(300, 200, 50)["Object 2"]
    assert "raise the resolution" in warnings(50)["Object 0"]


def thin(lines: tuple[int, ...], glass: bool = False) -> list[tuple[str, str]]:
    """What is said of a table of 10 triangles and a house of 90, of which some are a texel wide."""
    triangles = np.tile(CORNER, (100, 1, 1))
    numbers = np.zeros(90, dtype=np.int32)
    clear = np.isin(np.arange(10), lines) if glass else None
    objects = [
        BakeObject("Table", 0, 10, True, numbers[:10], np.zeros((10, 3), np.int32), glass=clear),
        BakeObject("House", 10, 90, True, numbers, np.zeros((90, 3), np.int32)),
    ]
    scene = BakeScene(Scene(triangles, np.zeros((100, 3)), np.zeros((100, 3))), tuple(objects))
    found = small_objects(scene, objects, Texels(*[100] * 100, lines=lines))
    return [(each.name, each.message) for each in found]


def test_an_object_that_is_a_texel_wide_is_named_though_it_has_many() -> None:
    """If half of its surface is, or a twentieth of everything; the largest such surface comes first."""
    assert thin((0, 1, 2, 3)) == []
    assert thin(tuple(range(10, 14))) == []
    assert [name for name, _ in thin((*range(5), *range(10, 16)))] == ["House", "Table"]
    ((_, message),) = thin((0, 1, 2, 3, 4))
    assert message == (
        "object 'Table' is only one texel wide on 50% of its surface (1,000 texels in all): "
        "raise the resolution or its texel scale"
    )
    assert thin((0, 1, 2, 3, 4), glass=True) == []


def test_a_share_is_100_percent_only_if_it_is_all() -> None:
    assert share_of(3, 3) == "100.0 %"
    assert share_of(999_999, 1_000_000) == "more than 99.9 %"
    assert share_of(91, 100) == "91.0 %"
    assert greedy_object(["A", "B"], [91, 9]) == "A"
    assert greedy_object(["A", "B"], [90, 10]) is None
    assert greedy_object(["A"], [90]) is None
    assert greedy_object([], []) is None
