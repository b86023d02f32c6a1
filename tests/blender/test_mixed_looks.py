"""What comes from other files is shown as this file shows its own, or named where it cannot be."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.files.cornell import build_cornell_box
from radiosity_addon.blender.files.files import empty_scene
from radiosity_addon.blender.handlers import REPORTS_APPENDING
from radiosity_addon.blender.images.node_group import GROUP_NAME
from radiosity_addon.blender.jobs.inspection import inspect
from radiosity_addon.options.bake_settings import BakeSettings
from tests.blender.hand_bake import add_plane, bake_by_hand, principled_material, seen_from_above
from tests.blender.scenes import add_lamp

pytestmark = pytest.mark.usefixtures("registered")

reports_appending = pytest.mark.skipif(not REPORTS_APPENDING, reason="this Blender reports no appending")


@pytest.fixture
def matte_file(tmp_path: Path) -> Path:
    """A file with a baked object, `Far`, and a scene, `There`, that shows it matte."""
    add_plane("Far", principled_material(name="Metal", Metallic=1.0))
    bake_by_hand()
    bpy.context.scene.name = "There"
    bpy.context.scene.radiosity.show = "matte"
    path = tmp_path / "matte.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    empty_scene()
    return path


def looks() -> set[str]:
    trees = [tree for tree in bpy.data.node_groups if tree.name.startswith(GROUP_NAME)]
    results = [node for tree in trees for node in tree.nodes if node.type == "GROUP_OUTPUT"]
    return {result.inputs[0].links[0].from_node.name for result in results}


@reports_appending
@pytest.mark.parametrize("by", ["script", "operator"])
@pytest.mark.parametrize("kind", ["Object", "Scene"])
def test_what_is_appended_is_shown_as_this_file_shows_its_own(
    kind: str, by: str, matte_file: Path, tmp_path: Path
) -> None:
    add_plane("Near", principled_material())
    bake_by_hand(show="shine")
    name = {"Object": "Far", "Scene": "There"}[kind]
    if by == "operator":
        bpy.ops.wm.append(directory=f"{matte_file}/{kind}/", filename=name)
    else:
        with bpy.data.libraries.load(str(matte_file)) as (_, wanted):
            setattr(wanted, f"{kind.lower()}s", [name])
    bpy.context.view_layer.update()
    assert looks() == {"shine"}
    assert {scene.radiosity.show for scene in bpy.data.scenes} == {"shine"}
    far = bpy.data.objects["Far"]
    if kind == "Object" and by == "script":
        bpy.context.scene.collection.objects.link(far)
    bpy.data.objects["Near"].hide_render = True
    bpy.context.scene.world = None
    if kind == "Object":
        assert not seen_from_above(tmp_path).any()  # metal that has nothing to mirror
        bpy.context.scene.radiosity.show = "matte"
        assert seen_from_above(tmp_path).all()


def linked(path: Path) -> None:
    with bpy.data.libraries.load(str(path), link=True) as (_, wanted):
        wanted.objects = ["Far"]
    wanted.objects[0].location.z = -5.0
    bpy.context.scene.collection.objects.link(wanted.objects[0])


def test_a_linked_file_with_another_look_is_named(matte_file: Path) -> None:
    scene = build_cornell_box()
    scene.radiosity.resolution, scene.radiosity.quality = 32, "sketch"
    linked(matte_file)

    def named() -> bool:
        found = inspect(bpy.context, BakeSettings(resolution=32), None).findings
        return any("matte.blend' are shown differently from this file's" in each.message for each in found)

    assert named()
    bpy.ops.radiosity.bake("EXEC_DEFAULT", True)
    assert (
        "matte.blend' are shown differently from this file's, which show 'shine'" in scene.radiosity.last_bake
    )
    assert looks() == {"shine", "matte"}
    scene.radiosity.show = "matte"
    assert not named()
    bpy.ops.radiosity.bake("EXEC_DEFAULT", True)
    assert "matte.blend" not in scene.radiosity.last_bake


@reports_appending
def test_an_appended_lamp_has_the_highlights_of_this_file(tmp_path: Path) -> None:
    add_plane("Far", principled_material())
    add_lamp("POINT", energy=1.0).name = "Bulb"
    bake_by_hand()
    bpy.context.scene.radiosity.highlights = False
    assert not bpy.data.objects["Bulb"].visible_glossy
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "dull.blend"))
    empty_scene()
    bpy.ops.wm.append(directory=f"{tmp_path / 'dull.blend'}/Scene/", filename="Scene")
    assert bpy.data.objects["Bulb"].visible_glossy
    assert np.all([scene.radiosity.highlights for scene in bpy.data.scenes])
