"""A sealed box in a lit room: no texel inside gets any light, exactly.

Not a small number but 0: light reaches a texel only along rays that were traced, no ray passes
a wall, and where no chain of rays leads to a lamp the hierarchy's solution is not used.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake
from radiosity_addon.bake.result.result import BakedObject, BakeResult
from radiosity_addon.lightmap.images.page import LightmapPage
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene
from radiosity_addon.solver import EnvironmentLight, PointLight
from tests.rooms import CEILING, box_room, gray, gray_scene, rectangle, solid_box
from tests.unit.texel_scenes import bake_scene, in_cell

ON_FLOOR = (1.03, 0.97, 0.0), (1.97, 2.11, 1.0)
"""Off every lattice of texels, over the floor's diagonal, and without a floor of its own."""

HANGING = (1.03, 0.97, 0.51), (1.97, 2.11, 1.5)


def sealed_box(
    low: Sequence[float], high: Sequence[float], thickness: float, light: str, floor_baked: bool = True
) -> BakeScene:
    """A room 3 m wide, and in it a box whose inner walls face inwards; `Inner` is the dark side."""
    room, surface = box_room((3, 3, 3))
    emission = gray(12, 0.0)
    lights: list[PointLight | EnvironmentLight] = []
    if light == "emissive":
        emission[2:] = 1.0  # all but the floor, which runs on inside
    elif light == "sky":
        room, emission = room[surface != CEILING], emission[surface != CEILING]
        lights = [EnvironmentLight(1.0)]
    else:
        lights = [PointLight((0.5, 0.5, 2.5), 100.0, radius=0.1)]
    bottom, top = np.array(low), np.array(high)
    stands = low[2] == 0
    inner = box_room(top - bottom)[0][2 * stands :] + bottom
    parts, triangles = [("Room", len(room), None, floor_baked), ("Inner", len(inner))], [room, inner]
    if thickness:
        out = np.array([thickness, thickness, 0 if stands else thickness])
        shell = solid_box(bottom - out, top + thickness)[2 * stands :]
        parts.append(("Shell", len(shell)))
        triangles.append(shell)
    every = np.concatenate(triangles)
    glow = np.zeros((len(every), 3))
    glow[: len(room)] = emission
    scene = gray_scene(every, 0.8, glow, two_sided=True, lights=lights)
    return bake_scene(scene, *parts)


def run(scene: BakeScene, quality: str) -> BakeResult:
    return bake(scene, BakeSettings(quality=quality, resolution=64, atlas="per-object"))


def filtered(page: LightmapPage, item: BakedObject) -> np.ndarray:
    """Bilinear look-ups all over an object's triangles, their edges and corners too."""
    weights = np.concatenate([np.random.default_rng(1).dirichlet([0.5] * 3, 500), np.eye(3)])
    spots = np.einsum("kc,tcx->tkx", weights, item.uv.astype(float)).reshape(-1, 2)
    spots = spots * len(page.pixels) - 0.5
    corner = np.floor(spots).astype(int)
    share = spots - corner
    last = len(page.pixels) - 1
    value = np.zeros((len(spots), 3))
    for right in (0, 1):
        for up in (0, 1):
            x, y = np.clip(corner + np.array([right, up]), 0, last).T
            weight = np.abs(1 - right - share[:, 0]) * np.abs(1 - up - share[:, 1])
            value += weight[:, None] * page.pixels[y, x]
    return value


def assert_sealed(scene: BakeScene, quality: str) -> None:
    result = run(scene, quality)
    names = [item.object.name for item in result.objects]
    dark = names.index("Inner")
    for number, page in enumerate(result.pages):
        if number != dark:
            assert page.pixels[page.coverage].mean() > 0.1
    page = result.pages[dark]
    assert page.coverage.sum() > 1000
    assert not page.pixels.any()
    assert not filtered(page, result.objects[dark]).any()
    if "Room" in names:
        assert_dark_floor(scene, result, names.index("Room"))


def assert_dark_floor(scene: BakeScene, result: BakeResult, number: int) -> None:
    """Texels of the room's floor that lie wholly inside a box standing on it."""
    if scene.scene.triangles[scene.objects[1].rows][..., 2].min() > 0:
        return
    page, uv = result.pages[number].pixels, result.objects[number].uv[:2].astype(float)
    # The floor is the first two triangles: its UVs are an affine map of x and y.
    world = scene.scene.triangles[:2].reshape(-1, 3).copy()
    world[:, 2] = 1.0
    mapping = np.linalg.lstsq(world, uv.reshape(-1, 2), rcond=None)[0]
    rows, columns = np.indices(page.shape[:2])
    corners = np.stack([np.stack([columns + i, rows + j], axis=-1) for i in (0, 1) for j in (0, 1)], axis=2)
    at = (corners / len(page) - mapping[2]) @ np.linalg.inv(mapping[:2])
    low, high = np.array(ON_FLOOR)[:, :2]
    whole = ((at > low) & (at < high)).all(axis=(2, 3))
    assert whole.sum() > 20
    assert not page[whole].any()


EACH_WITH_EACH = [
    ("standing", 0.0, "lamp"),
    ("standing", 0.0, "sky"),
    ("standing", 0.01, "emissive"),
    ("hanging", 0.0, "emissive"),
    ("hanging", 0.01, "lamp"),
    ("hanging", 0.01, "sky"),
]
"""Places, thicknesses and lights; any two values meet. `build.py test --full` has all three in all ways."""

OTHERS = {*product(("standing", "hanging"), (0.0, 0.01), ("lamp", "emissive", "sky"))} - {*EACH_WITH_EACH}


@pytest.mark.parametrize(
    ("place", "thickness", "light"),
    [*EACH_WITH_EACH, *(pytest.param(*box, marks=pytest.mark.full) for box in sorted(OTHERS))],
)
def test_no_texel_in_a_sealed_box_is_lit(place: str, thickness: float, light: str) -> None:
    corners = ON_FLOOR if place == "standing" else HANGING
    assert_sealed(sealed_box(*corners, thickness, light), "draft")


@pytest.mark.parametrize(("thickness", "light"), [(0.0, "sky"), (0.01, "lamp")])
def test_nor_at_medium_quality(thickness: float, light: str) -> None:
    assert_sealed(sealed_box(*ON_FLOOR, thickness, light), "medium")


@pytest.mark.parametrize(("thickness", "light"), [(0.0, "lamp"), (0.01, "emissive"), (0.01, "sky")])
def test_nor_on_a_floor_without_a_lightmap(thickness: float, light: str) -> None:
    """Elements of the floor run on under the walls, and rays that hit it find no texels."""
    assert_sealed(sealed_box(*ON_FLOOR, thickness, light, floor_baked=False), "draft")


def test_nor_where_kept_uvs_give_one_pixel_to_walls_inside_and_outside() -> None:
    """One side of a flat box has no pixels but those that show the shell's top, which nothing touches."""
    low, high = HANGING
    scene = sealed_box(low, (*high[:2], low[2] + 0.05), 0.01, "lamp")
    room, inner, shell = scene.objects
    pixel = 1 / 64
    wide = 18.6 * pixel
    outside = [in_cell((x, y), (x + wide, y + wide)) for y in (0.0, 0.35) for x in (0.0, 0.35, 0.7)]
    beside = in_cell((wide + 0.05 * pixel, 0.0), (19 * pixel, wide))
    inside = [in_cell((x, 0.7), (x + wide, 0.7 + wide)) for x in (0.0, 0.35)]
    narrow = [in_cell((0.7, y), (0.7 + wide, y + pixel)) for y in 0.7 + 0.02 * np.arange(9)]
    uvs = (
        np.concatenate(narrow[:6]),
        np.concatenate([*inside, beside, *narrow[6:]]),
        np.concatenate([outside[number] for number in (1, 0, 2, 3, 4, 5)]),
    )
    objects = tuple(replace(item, uv=uv) for item, uv in zip((room, inner, shell), uvs, strict=True))
    result = bake(replace(scene, objects=objects), BakeSettings(quality="draft", resolution=64))
    page = result.pages[0].pixels
    assert page[1:18, 1:18].min() > 0.01
    assert not page[45:63, 1:40].any()


def test_a_wall_across_surfaces_without_lightmaps_makes_two_rooms() -> None:
    """The lit one is like a room that ends at the wall, the other black; only ceilings are baked."""
    split = 0.83
    rooms, surface = box_room((2, 1, 1))
    wall = rectangle((split, 0, 0), (0, 1, 0), (0, 0, 1))
    around = np.concatenate([rooms[surface != CEILING], wall])
    alone, surface = box_room((split, 1, 1))
    divided = _ceilings((0.0, split, 2.0), around)
    single = _ceilings((0.0, split), alone[surface != CEILING])
    assert not divided[1].pixels.any()
    lit, expected = (page.pixels[page.coverage].mean(axis=0) for page in (divided[0], single[0]))
    np.testing.assert_allclose(lit, expected, rtol=0.01)


def test_a_box_that_reaches_through_the_floor_is_dark_above_it() -> None:
    """It is open below, where the sky shines in: the backs of its walls run on from there into the dark."""
    room, surface = box_room((3, 3, 3))
    room = room[surface != CEILING]
    (left, front, _), (right, back, _) = ON_FLOOR
    box = solid_box((left, front, -0.4), (right, back, 0.6))[2:]
    triangles = np.concatenate([room, box])
    sky = [EnvironmentLight(1.0)]
    scene = gray_scene(triangles, 0.8, two_sided=True, lights=sky)
    whole = bake_scene(scene, ("Room", len(room)), ("Box", len(box)))
    result = run(whole, "draft")
    assert result.pages[0].pixels.max() > 0.5
    assert_dark_floor(whole, result, 0)


def _ceilings(ends: Sequence[float], around: np.ndarray) -> tuple[LightmapPage, ...]:
    """Bake ceilings 1 m wide and high, from each x to the next; a lamp hangs at x = 0.3."""
    above = [rectangle((x, 0, 1), (0, 1, 0), (end - x, 0, 0)) for x, end in pairwise(ends)]
    triangles = np.concatenate([around, *above])
    lamp = PointLight((0.3, 0.6, 0.4), 10.0, radius=0.05)
    scene = gray_scene(triangles, 0.7, lights=[lamp], two_sided=True)
    parts = [("Around", len(around), None, False), *((f"Ceiling {x}", 2) for x in ends[:-1])]
    return run(bake_scene(scene, *parts), "draft").pages
