"""What is not baked keeps its lightmap: other scenes of the file, and what is not selected."""

from __future__ import annotations

from pathlib import Path

import bpy
import pytest

from radiosity_addon.base.errors import BakeError
from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.apply.scopes import files_of
from radiosity_addon.blender.datablocks.bake_record import recorded_objects
from radiosity_addon.blender.files.output import OutputFolder
from radiosity_addon.blender.files.ownership import panel_names
from radiosity_addon.blender.jobs.job import run_bake
from radiosity_addon.blender.relight.relight_scene import kept_bakes
from radiosity_addon.blender.session import last_bake
from radiosity_addon.options.bake_settings import BakeSettings
from tests.blender.exporting import add_instance
from tests.blender.file_dump import differences_since, dump_file
from tests.blender.scenes import add_lamp, add_mesh, shader_material

QUICK = BakeSettings(resolution=32, quality="sketch")


@pytest.fixture(autouse=True)
def scenes(registered: None) -> tuple[bpy.types.Scene, bpy.types.Scene]:
    """Two scenes; one object is in both."""
    first = bpy.context.scene
    gray = shader_material("Gray", "ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5, 1))
    for name, x in (("A1", 0), ("A2", 3)):
        add_mesh(name, material=gray, location=(x, 0, 0))
    both = add_mesh("Both", material=gray, location=(6, 0, 0))
    add_lamp("POINT", energy=100.0, transform={"location": (0, 0, 2)})
    second = bpy.data.scenes.new("Second")
    for name, x in (("B1", 0), ("B2", 3)):
        obj = add_mesh(name, material=gray, location=(x, 0, 0))
        bpy.context.view_layer.update()  # or Blender 4.2 does not know where it is before it is exported
        first.collection.objects.unlink(obj)
        second.collection.objects.link(obj)
    second.collection.objects.link(both)
    return first, second


def bake(scene: bpy.types.Scene, output: Path | None = None, **settings: object) -> list[tuple[str, str]]:
    """Bake a scene; returns the warnings that name an object."""
    bpy.context.window.scene = scene
    wanted = BakeSettings(**{"resolution": 32, "quality": "sketch", **settings})
    job = run_bake(bpy.context, wanted, None if output is None else OutputFolder(output, panel_names(scene)))
    while True:
        try:
            next(job)
        except StopIteration as done:
            warnings = done.value.as_dict()["warnings"]
            return [(each["name"], each["message"]) for each in warnings]


def images() -> dict[str, bpy.types.Image]:
    """The image that each object shows."""
    found = {}
    for obj in recorded_objects():
        trees = [slot.material.node_tree for slot in obj.material_slots]
        (found[obj.name],) = {n.image for tree in trees for n in tree.nodes if n.type == "TEX_IMAGE"}
    return found


def test_a_bake_of_another_scene_leaves_the_first(scenes, tmp_path: Path) -> None:
    first, second = scenes
    bake(first, tmp_path)
    before = images()
    (file,) = tmp_path.glob("*.exr")
    pixels = file.read_bytes()
    warnings = bake(second, tmp_path)
    after = images()
    assert set(after) == {"A1", "A2", "Both", "B1", "B2"}
    assert after["A1"] == after["A2"] == before["A1"]
    assert after["B1"] == after["B2"] == after["Both"] != before["A1"]
    assert file.read_bytes() == pixels
    assert [name for name, message in warnings if "Scene" in message] == ["Both"]
    assert last_bake.read(first) is not None
    assert last_bake.read(second) is not None
    # And once more: what nothing shows any more is gone.
    bake(first, tmp_path)
    assert images()["B1"] == after["B1"]
    assert images()["Both"] == images()["A1"]
    assert len([image for image in bpy.data.images if "lightmap" in image.name]) == 2
    assert not any(block.name.startswith(".earlier") for block in [*bpy.data.images, *bpy.data.materials])


def test_restore_is_of_the_scene_and_the_command_line_s_of_the_file(scenes) -> None:
    first, second = scenes
    for scene in scenes:  # or world matrices are not known yet
        scene.view_layers[0].update()
    dump_file()
    before = dump_file()
    bake(first)
    bake(second)
    bpy.context.window.scene = first
    assert bpy.ops.radiosity.restore() == {"FINISHED"}
    assert set(images()) == {"B1", "B2"}
    assert last_bake.read(first) is None
    assert last_bake.read(second) is not None
    assert restore(bpy.context) == 2
    for scene in scenes:  # to ask leaves a trace, before Blender 5.0
        last_bake.forget(scene)
    assert differences_since(before, dump_file()) == []


def test_a_full_copy_of_a_baked_scene_keeps_its_lightmaps(scenes) -> None:
    first, _ = scenes
    bake(first)
    assert bpy.ops.scene.new(type="FULL_COPY") == {"FINISHED"}
    copied = bpy.context.window.scene
    copies = {obj.name for obj in copied.objects if obj.type == "MESH"}
    bpy.context.window.scene = first
    assert bpy.ops.radiosity.restore() == {"FINISHED"}
    assert len(copies) == 3
    assert set(images()) == copies
    bpy.context.window.scene = copied
    assert bpy.ops.radiosity.restore() == {"FINISHED"}
    assert images() == {}
    assert not [mesh.name for mesh in bpy.data.meshes if "Lightmap" in mesh.uv_layers]


def test_what_is_not_selected_keeps_its_lightmap(scenes) -> None:
    first, _ = scenes
    bake(first)
    before = images()
    bake(first, objects=("A1",))
    after = images()
    assert (after["A2"], after["Both"]) == (before["A2"], before["Both"])
    assert after["A1"] != before["A1"]
    bake(first, objects=("A2", "Both"))
    assert images()["A1"] == after["A1"]
    assert len([image for image in bpy.data.images if "lightmap" in image.name]) == 2
    bake(first)
    assert len(set(images().values())) == 1
    restore(bpy.context)
    assert [image.name for image in bpy.data.images if "lightmap" in image.name] == []


def test_an_instance_that_is_not_selected_keeps_its_lightmap(scenes) -> None:
    first, _ = scenes
    group = bpy.data.collections.new("Group")
    for name in ("Leaf", "Branch"):
        part = add_mesh(name)
        first.collection.objects.unlink(part)
        group.objects.link(part)
    add_instance(group, "Tree", location=(0, 5, 0))
    bake(first)
    branch = bpy.data.objects["Tree/Branch (Lightmap)"]
    before = files_of(branch)
    bake(first, objects=("Tree/Leaf",))
    assert files_of(branch) == before
    assert files_of(bpy.data.objects["Tree/Leaf (Lightmap)"]) != before
    assert files_of(bpy.data.objects["A1"]) == before
    # The selection knows stand-ins by what they stand for.
    bpy.ops.object.select_all(action="DESELECT")
    branch.select_set(True)
    first.radiosity.scope = "selected"
    first.radiosity.resolution, first.radiosity.quality = 32, "sketch"
    assert bpy.ops.radiosity.bake("EXEC_DEFAULT", True) == {"FINISHED"}
    assert files_of(bpy.data.objects["Tree/Branch (Lightmap)"]) != before
    restore(bpy.context)
    assert [obj.name for obj in bpy.data.objects if "Lightmap" in obj.name] == []
    assert not bpy.data.objects["Tree"].hide_render


def test_a_failed_bake_of_another_scene_changes_nothing(scenes, monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = scenes
    bake(first)
    bpy.context.window.scene = second
    before = dump_file()

    def fail(*_: object) -> None:
        raise BakeError("the disk is full")

    monkeypatch.setattr("radiosity_addon.blender.jobs.finish.lightmap_files", fail)
    with pytest.raises(BakeError, match="full"):
        list(run_bake(bpy.context, QUICK, None))
    assert differences_since(before, dump_file()) == []


def test_objects_of_a_deleted_scene_are_restored_with_any(scenes) -> None:
    first, second = scenes
    bake(first)
    bake(second)
    bpy.context.window.scene = first
    bpy.data.scenes.remove(second)
    assert bpy.ops.radiosity.restore() == {"FINISHED"}
    assert recorded_objects() == []
    assert not any("Lightmap" in mesh.uv_layers for mesh in bpy.data.meshes)


def test_a_kept_bake_is_relit_after_another_scene_was_baked(scenes) -> None:
    first, second = scenes
    for scene in (first, second):
        bpy.context.window.scene = scene
        settings = scene.radiosity
        settings.resolution, settings.quality = 32, "sketch"
        scene.radiosity_relight.keep = True
        if scene == first:
            # What both show is the second's then, which relighting the first cannot follow.
            scene.collection.objects.unlink(bpy.data.objects["Both"])
        else:
            lamp = add_lamp("POINT", "Other Lamp", energy=100.0, transform={"location": (0, 0, 2)})
            assert lamp.users_scene == (second,)
        assert bpy.ops.radiosity.bake("EXEC_DEFAULT", True) == {"FINISHED"}
    bpy.context.window.scene = first
    shown = images()
    before = [sum(shown[name].pixels[:]) for name in ("A1", "B1")]
    assert kept_bakes.find(first) is not None
    bpy.data.lights[0].energy *= 2
    assert bpy.ops.radiosity.relight("EXEC_DEFAULT", True) == {"FINISHED"}
    after = [sum(images()[name].pixels[:]) for name in ("A1", "B1")]
    assert after[0] > 1.2 * before[0]
    assert after[1] == before[1]
