"""A box that stands on a single sheet: what they cover of each other is dark, from both sides."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake
from radiosity_addon.lightmap.images.page import LightmapPage
from radiosity_addon.lights.sun_and_sky import Light
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.solver import EnvironmentLight, PointLight, SunLight
from tests.rooms import box_room, gray_scene, rectangle, solid_box
from tests.unit.texel_scenes import bake_scene

GROUND = rectangle((-4, -4, 0), (8, 0, 0), (0, 8, 0))
BOX = solid_box((-0.5, -0.5, 0), (0.5, 0.5, 1))
UP = np.array([0.0, 0.0, 1.0])

SKY = EnvironmentLight((1.0, 1.0, 1.0))
SUN = SunLight((0.2, 0.1, 1.0), (1.0, 1.0, 1.0))
"""Shines upwards."""

LAMP = PointLight((0.1, 0.1, -0.6), 10.0, radius=0.05)
"""Below the ground."""


def turned(triangles: np.ndarray, degrees: float, away: float) -> np.ndarray:
    """Return triangles turned about all axes, and moved away, as float32 has them."""
    angle = np.radians(degrees)
    cosine, sine = np.cos(angle), np.sin(angle)
    about_z = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]])
    moved = triangles @ (about_x @ about_z).T + (away, -away, 0.5 * away)
    return moved.astype(np.float32).astype(np.float64)


def pages(
    box: np.ndarray, ground: np.ndarray = GROUND, light: Light = SKY, degrees: float = 0.0, away: float = 0.0
) -> dict[str, LightmapPage]:
    triangles = turned(np.concatenate([ground, box]), degrees, away)
    scene = gray_scene(triangles, lights=[light], two_sided=True)
    parts = [("Ground", len(ground)), ("Bottom", 2), ("Box", len(box) - 2)]
    settings = BakeSettings(quality="draft", resolution=32, atlas="per-object", quantity="irradiance")
    result = bake(bake_scene(scene, *parts), settings)
    return {item.object.name: page for item, page in zip(result.objects, result.pages, strict=True)}


def values(page: LightmapPage) -> np.ndarray:
    return page.pixels[page.coverage]


@pytest.mark.parametrize("rise", [0.0, 1e-6, -1e-6])
@pytest.mark.parametrize(("degrees", "away"), [(0.0, 0.0), (30.0, 0.0), (30.0, 1e3)])
def test_the_underside_is_dark(rise: float, degrees: float, away: float) -> None:
    found = pages(BOX + rise * UP, degrees=degrees, away=away)
    assert values(found["Bottom"]).max() == 0.0
    assert values(found["Box"]).mean() > 1.0
    assert values(found["Ground"]).mean() > 1.0


def test_the_underside_is_dark_though_light_falls_on_its_own_back() -> None:
    """The box is open at one side; points below it are sunk into its bottom, and see that from inside.

    Of those at the open side one ray in thousands passes the bottom's edge.
    """
    opened = BOX[BOX[..., 1].max(axis=1) > -0.5]
    assert len(opened) == len(BOX) - 2
    found = pages(opened)
    assert np.quantile(values(found["Bottom"]), 0.99) == 0.0
    assert values(found["Bottom"]).mean() < 1e-4
    assert values(found["Box"]).mean() > 1.0


def test_the_underside_is_dark_though_another_box_stands_in_the_box() -> None:
    """As a mattress does in its frame: rays from the bottom enter it before they leave the frame."""
    inner = solid_box((-0.49, -0.49, 0.02), (0.49, 0.49, 1.3))
    assert values(pages(np.concatenate([BOX, inner]))["Bottom"]).max() == 0.0


def test_so_it_is_in_a_room_and_without_one_where_the_box_reaches_beyond() -> None:
    """On a floor that is a room's, the underside is dark; over the rim of a table it is lit."""
    room = box_room((6, 6, 3))[0] - (3, 3, 0)
    assert values(pages(BOX, room)["Bottom"]).max() == 0.0
    table = rectangle((-2, -2, 0), (2, 0, 0), (0, 4, 0))
    lit = pages(BOX, table)["Bottom"]
    dark = (lit.pixels.max(axis=2) == 0.0) & lit.coverage
    assert 0.4 < dark.sum() / lit.coverage.sum() < 0.6
    assert values(lit).mean() > 0.3


@pytest.mark.parametrize("light", [SUN, LAMP])
def test_neither_sun_nor_lamp_shines_through_the_ground(light: Light) -> None:
    assert values(pages(BOX, light=light)["Bottom"]).max() == 0.0


def test_the_ground_is_dark_below_the_box() -> None:
    """All texels of a ground as small as the box, which covers them."""
    ground = rectangle((-0.4, -0.4, 0), (0.8, 0, 0), (0, 0.8, 0))
    for rise in (0.0, 1e-6, -1e-6):
        assert values(pages(BOX + rise * UP, ground)["Ground"]).max() == 0.0


def test_a_millimeter_is_a_gap() -> None:
    """Seen from 1 mm above the ground, the sky is in a rim of that height only."""
    lit = values(pages(BOX + 1e-3 * UP)["Bottom"])
    assert 0.0 < lit.mean() < 0.1


def test_walls_of_neighboring_rooms_stay_lit() -> None:
    """Back to back nothing touches: both rooms are as bright as each alone."""
    room = box_room((2, 2, 2))[0]
    other = box_room((2, 2, 2))[0] + (2, 0, 0)
    triangles = np.concatenate([room, other])
    lamps = [PointLight((0.7, 1.1, 1.2), 10.0, radius=0.1), PointLight((2.7, 1.1, 1.2), 10.0, radius=0.1)]

    def baked(triangles: np.ndarray, lamps: list[PointLight]) -> np.ndarray:
        count = len(triangles)
        scene = gray_scene(triangles, lights=lamps, two_sided=True)
        settings = BakeSettings(quality="draft", resolution=32, atlas="per-object")
        parts = [(f"Room {number}", 12) for number in range(count // 12)]
        return np.array([values(page).mean() for page in bake(bake_scene(scene, *parts), settings).pages])

    alone = baked(room, lamps[:1])
    np.testing.assert_allclose(baked(triangles, lamps), alone[0], rtol=5e-3)
