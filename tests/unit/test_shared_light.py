"""Light of texels that many small faces share: closed forms, and relighting of what was kept."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake, bake_and_keep
from radiosity_addon.bake.relight.kept_bake import relight_pages
from radiosity_addon.lightmap.texels.shared_texels import is_collapsed
from radiosity_addon.options import BakeSettings
from radiosity_addon.scene import BakeScene
from radiosity_addon.solver import PointLight
from tests.rooms import box_room, gray_scene, solid_box
from tests.unit.texel_scenes import bake_scene

pytest.importorskip("xatlas")

LAMP = PointLight((0.5, 0.5, 0.9), (np.pi, np.pi, np.pi))
CRUMB = 4e-3


def crumbs(emission: float = 0.0, **more: object) -> BakeScene:
    """Return a room of 1 m with 25 boxes of 4 mm on its floor: 150 charts smaller than a texel."""
    room, _ = box_room()
    at = np.stack(np.meshgrid(np.linspace(0.2, 0.8, 5), np.linspace(0.2, 0.8, 5)), axis=-1).reshape(-1, 2)
    boxes = [solid_box((x, y, 0.05), (x + CRUMB, y + CRUMB, 0.05 + CRUMB)) for x, y in at]
    triangles = np.concatenate([room, *boxes])
    scene = gray_scene(triangles, 0.5, emission, **more)
    return bake_scene(scene, ("Room", 12), ("Crumbs", 12 * len(boxes)))


def shared_values(result: object) -> tuple[np.ndarray, np.ndarray]:
    """Return the pixels (k, 3) at the crumbs' collapsed triangles, and which (n,) triangles these are."""
    crumb, page = result.objects[1], result.pages[0]  # type: ignore[attr-defined]
    size = len(page.pixels)
    shared = is_collapsed(crumb.uv)
    column, row = np.floor(crumb.uv[shared, 0] * size).astype(int).T
    assert page.coverage[row, column].all()
    return page.pixels[row, column], shared


def settings(**more: object) -> BakeSettings:
    return BakeSettings(quality="draft", resolution=64, **more)  # type: ignore[arg-type]


def test_in_a_uniform_enclosure_they_are_as_bright_as_the_rest() -> None:
    """Walls that emit E = 1 and reflect a half: H/π = 2/π, on crumbs as well."""
    result = bake(crumbs(emission=1.0), settings())
    values, shared = shared_values(result)
    assert shared.sum() > 250
    np.testing.assert_allclose(values, 2 / np.pi, rtol=0.02)


def test_a_lamp_lights_them_by_the_inverse_square() -> None:
    scene = crumbs(lights=[LAMP])
    result = bake(scene, settings(light="direct"))
    values, shared = shared_values(result)
    triangles = scene.scene.triangles[12:][shared]
    up = scene.scene.face_normals[12:][shared][:, 2] > 0.9
    toward = np.array(LAMP.position) - triangles[up].mean(axis=1)
    distance = np.linalg.norm(toward, axis=1)
    expected = toward[:, 2] / distance**3
    relative = values[up, 0] / expected
    np.testing.assert_allclose(relative, np.median(relative), rtol=0.02)
    down = scene.scene.face_normals[12:][shared][:, 2] < -0.9
    assert (values[down] == 0).all()


def test_threads_change_no_byte() -> None:
    one, two = (bake(crumbs(lights=[LAMP]), settings(threads=threads)) for threads in (1, 2))
    assert one.pages[0].pixels.tobytes() == two.pages[0].pixels.tobytes()


def test_a_kept_bake_relights_them() -> None:
    result, kept = bake_and_keep(crumbs(lights=[LAMP]), settings())
    (page,) = relight_pages(kept, 2.0 * kept.strengths)
    # Sweeps end within a thousandth.
    np.testing.assert_allclose(page.pixels, 2.0 * result.pages[0].pixels, rtol=1e-3, atol=1e-6)
