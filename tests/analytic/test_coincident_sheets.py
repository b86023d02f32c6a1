"""Surfaces that lie in one another: no ray tells which is in front, and both show what one alone would.

The elements do not manage that: rays see both, so light is shared out among them (docs/solver.md,
*The matrix*), and in the room below they are 9 % too dark on the floors, 7 % too bright elsewhere.
What is baked asks for light anew at every texel, and the sweeps let nothing of the elements stand.
"""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake
from radiosity_addon.lightmap.images.page import LightmapPage
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.solver import PointLight
from tests.rooms import box_room, gray_scene, rectangle
from tests.unit.texel_scenes import bake_scene

FLOOR = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0))
TWINS = {
    "same": FLOOR,
    "other diagonal": rectangle((1, 0, 0), (0, 1, 0), (-1, 0, 0)),
    "tiny triangles": rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), 12),
    "twice": np.concatenate([FLOOR, FLOOR]),
}


def pages(twin: np.ndarray | None = None, baked: bool = True) -> dict[str, LightmapPage]:
    """Bake a cube with a lamp in it, and another floor in its floor."""
    room, _ = box_room()
    triangles = room if twin is None else np.concatenate([room, twin])
    lamp = PointLight((0.3, 0.6, 0.4), 10.0, radius=0.05)
    scene = gray_scene(triangles, 0.7, lights=[lamp], two_sided=True)
    parts = [("Floor", 2), ("Ceiling", 2), ("Walls", 8)]
    twins = [] if twin is None else [("Twin", len(twin), None, baked)]
    settings = BakeSettings(quality="medium", resolution=32, atlas="per-object")
    result = bake(bake_scene(scene, *parts, *twins), settings)
    named = zip(result.objects, result.pages, strict=True)
    return {item.object.name: page for item, page in named}


@pytest.fixture(scope="module")
def alone() -> dict[str, LightmapPage]:
    return pages()


def values(page: LightmapPage) -> np.ndarray:
    return page.pixels[page.coverage]


def assert_alike(found: LightmapPage, expected: LightmapPage) -> None:
    """The same in the mean, and texel by texel within the noise of medium quality."""
    mean = values(expected).mean()
    assert values(found).mean() == pytest.approx(mean, rel=2e-3)
    difference = values(found) - values(expected)
    assert np.sqrt((difference**2).mean()) < 0.01 * mean


@pytest.mark.parametrize(
    ("kind", "baked"), [("same", True), ("other diagonal", False), ("tiny triangles", True), ("twice", True)]
)
def test_a_floor_in_a_floor_changes_no_lightmap(
    alone: dict[str, LightmapPage], kind: str, baked: bool
) -> None:
    found = pages(TWINS[kind], baked)
    for name, expected in alone.items():
        assert_alike(found[name], expected)
    if kind == "same":
        np.testing.assert_array_equal(found["Twin"].coverage, alone["Floor"].coverage)
        assert_alike(found["Twin"], alone["Floor"])
