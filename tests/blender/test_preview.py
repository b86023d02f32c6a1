"""The preview shows the lightmaps, and the scene never notices."""

from __future__ import annotations

import re
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.base.errors import BakeError
from radiosity_addon.blender.apply.apply import apply_lightmaps
from radiosity_addon.blender.files.output import OutputFolder
from radiosity_addon.blender.images.images import set_folder, write_pages
from radiosity_addon.blender.jobs.preview import MAX_SIDE, render_preview
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.files.file_names import PREVIEW_NAME
from radiosity_addon.options.bake_settings import BakeSettings
from tests.blender.file_dump import differences, dump_file
from tests.blender.hand_bake import BASE, bake_by_hand, hand_result, principled_material, seen_from_above

pytestmark = pytest.mark.usefixtures("record")


def _square(z: float, size: float = 1.0) -> bpy.types.Object:
    mesh = bpy.data.meshes.new("Square")
    corners = [(-size, -size, z), (size, -size, z), (size, size, z), (-size, size, z)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    obj = bpy.data.objects.new("Square", mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def _camera() -> bpy.types.Object:
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location.z = 3.0
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    return camera


def _pixels(path: Path) -> np.ndarray:
    """Linear values of a PNG picture, bottom row first: (height, width, 3)."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    width, height = image.size
    pixels = np.array(image.pixels[:]).reshape(height, width, -1)[..., :3]
    bpy.data.images.remove(image)
    return pixels


def _bake(output: OutputFolder, color: tuple[float, ...]) -> None:
    settings = BakeSettings()
    export = export_scene(bpy.context, settings)
    result = hand_result(export, (color,))
    images = write_pages(result, settings, output.staging)
    set_folder(images, output.path)
    apply_lightmaps(bpy.context, export, result, images, settings)


def _small(width: int, height: int) -> None:
    bpy.context.scene.render.resolution_x = width
    bpy.context.scene.render.resolution_y = height
    bpy.context.scene.view_settings.view_transform = "Raw"


def test_the_staged_lightmap_is_seen_by_the_scene_s_camera(tmp_path: Path) -> None:
    _square(0.0, 10.0)
    _camera()
    _small(16, 8)
    with OutputFolder(tmp_path) as output:
        _bake(output, (0.25, 0.5, 1.0))
        render_preview(bpy.context, output.staging / PREVIEW_NAME, BakeSettings())
        output.publish()
    pixels = _pixels(tmp_path / PREVIEW_NAME)
    assert pixels.shape == (8, 16, 3)
    assert np.abs(pixels - 0.8 * np.array((0.25, 0.5, 1.0))).max() <= 1.01 / 255


def test_the_picture_is_matte_whatever_is_shown(tmp_path: Path) -> None:
    """A mirror, which shows its base color × lightmap there and the dark elsewhere."""
    _square(0.0, 10.0)
    bpy.data.objects["Square"].data.materials.append(principled_material(Metallic=1.0, Roughness=0.0))
    _camera()
    _small(8, 8)
    bake_by_hand(((1.0, 1.0, 1.0),), show="shine")
    render_preview(bpy.context, tmp_path / PREVIEW_NAME, BakeSettings())
    assert np.abs(_pixels(tmp_path / PREVIEW_NAME) - BASE).max() < 2 / 255
    assert not seen_from_above(tmp_path).any()


def test_without_a_camera_all_baked_objects_are_in_view(tmp_path: Path) -> None:
    """The black background surrounds them, and does not fill the picture."""
    _square(0.0)
    _square(1.0, 0.5)
    _small(48, 24)
    world = bpy.data.worlds.new("Dark")
    bpy.context.scene.world = world
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
    with OutputFolder(tmp_path) as output:
        _bake(output, (1.0, 1.0, 1.0))
        render_preview(bpy.context, output.staging / PREVIEW_NAME, BakeSettings())
        lit = _pixels(output.staging / PREVIEW_NAME)[..., 1] > 0.1
    rows, columns = np.nonzero(lit)
    assert 0.1 < lit.mean() < 0.6
    assert rows.min() > 0
    assert rows.max() < 23
    assert columns.min() > 0
    assert columns.max() < 47


def test_the_scene_and_its_render_settings_stay(tmp_path: Path) -> None:
    _square(0.0)
    _small(32, 32)
    bpy.context.view_layer.update()
    dump_file()
    before = dump_file()
    render_preview(bpy.context, tmp_path / "preview.png", BakeSettings(threads=1))
    found = differences(before, dump_file())
    if bpy.app.version < (5, 0):
        # Scene.copy() counts the users of what is in a scene twice there, until the next load.
        found = [line for line in found if not re.match(r"/objects/.*/users: ", line)]
    assert found == []


def test_large_resolutions_are_scaled_to_the_same_aspect(tmp_path: Path) -> None:
    _square(0.0)
    _small(4000, 100)
    render_preview(bpy.context, tmp_path / "preview.png", BakeSettings())
    assert _pixels(tmp_path / "preview.png").shape == (round(MAX_SIDE / 40), MAX_SIDE, 3)


def test_the_same_scene_gives_the_same_bytes(tmp_path: Path) -> None:
    _square(0.0)
    _camera()
    _small(16, 16)
    for name in ("a.png", "b.png"):
        render_preview(bpy.context, tmp_path / name, BakeSettings())
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_a_preview_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    _square(0.0)
    _small(4, 4)
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(BakeError, match=r"file.preview\.png"):
        render_preview(bpy.context, tmp_path / "file" / "preview.png", BakeSettings())
