"""*Changed*: new lightmaps for what differs from the last bake, and nothing else touched."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.base.errors import BakeError
from radiosity_addon.blender.datablocks.bake_record import mark_made, recorded_objects
from radiosity_addon.blender.material_copies.copy_marks import ADDED
from radiosity_addon.blender.session import last_bake
from tests.blender.file_dump import differences_since, dump_file
from tests.blender.scenes import add_lamp, add_mesh, shader_material
from tests.wording import one_says, says

pytestmark = pytest.mark.one_blender


@pytest.fixture(autouse=True)
def room(registered: None, tmp_path: Path) -> Path:
    """A saved room of three objects, baked on one page; the folder of its lightmaps."""
    add_mesh("Floor", material=shader_material("Gray", "ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5, 1)))
    add_mesh("Shelf", location=(0, 0, 1), scale=(0.3, 0.3, 1))
    add_mesh("Box", location=(1, 1, 0.5), scale=(0.2, 0.2, 1))
    add_lamp("POINT", energy=100.0, transform={"location": (0, 0, 2)})
    settings = bpy.context.scene.radiosity
    settings.resolution, settings.quality, settings.scope = 32, "sketch", "changed"
    bpy.context.scene.radiosity_relight.only_moved = False
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    assert bake() == {"FINISHED"}
    return tmp_path / "lightmaps"


def bake() -> set[str]:
    return bpy.ops.radiosity.bake("EXEC_DEFAULT", True)


def shown() -> dict[str, str]:
    """The lightmap file of every object that shows one."""
    found = {}
    for obj in recorded_objects():
        images = set()
        for material in obj.data.materials:
            trees = [
                material.node_tree,
                *(n.node_tree for n in material.node_tree.nodes if n.type == "GROUP"),
            ]
            images |= {
                node.image for tree in trees for node in tree.nodes if node.type == "TEX_IMAGE" and node.image
            }
        (image,) = images
        found[obj.name] = Path(bpy.path.abspath(image.filepath)).name
        assert (Path(bpy.path.abspath(image.filepath))).is_file()
    return found


def digests(folder: Path) -> dict[str, str]:
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.glob("*.exr")}


def uvs(name: str) -> np.ndarray:
    layer = bpy.data.objects[name].data.uv_layers["Lightmap"]
    values = np.empty(2 * len(layer.uv), dtype=np.float32)
    layer.uv.foreach_get("vector", values)
    return values


ONE_PAGE = dict.fromkeys(("Floor", "Shelf", "Box"), "room_Scene_lightmap.exr")


def test_the_first_bake_is_of_all(room: Path) -> None:
    assert shown() == ONE_PAGE


def test_without_a_change_nothing_is_done(room: Path) -> None:
    before = digests(room), bpy.context.scene.radiosity.last_bake
    assert bake() == {"CANCELLED"}
    assert (digests(room), bpy.context.scene.radiosity.last_bake) == before
    assert shown() == ONE_PAGE
    # Nor after the file was saved and opened.
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    assert bake() == {"CANCELLED"}


def test_a_moved_object_gets_a_new_lightmap_and_others_keep_theirs(room: Path) -> None:
    page, floor = digests(room)["room_Scene_lightmap.exr"], uvs("Floor")
    bpy.data.objects["Box"].location.x -= 0.5
    assert bake() == {"FINISHED"}
    assert shown() == {**ONE_PAGE, "Box": "room_Scene_lightmap_2.exr"}
    assert digests(room)["room_Scene_lightmap.exr"] == page
    np.testing.assert_array_equal(uvs("Floor"), floor)
    report = json.loads((room / "room_Scene_report.json").read_text())
    assert {entry["object"]: entry["image"] for entry in report["objects"]} == shown()
    assert [entry["image"] for entry in report["pages"]] == [
        "room_Scene_lightmap_2.exr",
        "room_Scene_lightmap.exr",
    ]
    assert {entry["object"]: entry["atlas"] for entry in report["objects"]} == {
        "Box": 0,
        "Floor": 1,
        "Shelf": 1,
    }
    last = last_bake.read(bpy.context.scene)
    assert one_says((message for _, message in last.warnings), "2 unchanged")
    # About as fine as before.
    densities = [page["texels_per_metre"] for page in report["pages"]]
    assert densities[0] == pytest.approx(densities[1], rel=0.3)
    assert bake() == {"CANCELLED"}


def test_all_lightmaps_follow_what_moved_while_that_is_kept(room: Path) -> None:
    bpy.context.scene.radiosity_relight.only_moved = True
    page, floor = digests(room)["room_Scene_lightmap.exr"], uvs("Floor")
    bpy.data.objects["Box"].location.x -= 0.5
    assert bake() == {"FINISHED"}
    assert shown() == ONE_PAGE
    assert digests(room)["room_Scene_lightmap.exr"] != page
    np.testing.assert_array_equal(uvs("Floor"), floor)
    assert bake() == {"CANCELLED"}


@pytest.mark.parametrize("scope", ["changed", "all"])
def test_a_bake_that_cannot_be_published_is_not_remembered(
    scope: str, room: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bpy.data.objects["Box"].location.x -= 0.5
    bpy.context.scene.radiosity.scope = scope
    bpy.context.view_layer.update()
    before = dump_file()
    with monkeypatch.context() as failing:

        def fail(*_: object) -> None:
            raise BakeError("the disk is full")

        failing.setattr("radiosity_addon.blender.files.output.OutputFolder.publish", fail)
        with pytest.raises(RuntimeError, match="the disk is full"):
            bake()
    assert differences_since(before, dump_file()) == []
    assert bake() == {"FINISHED"}
    assert differences_since(before, dump_file()) != []


def test_again_and_again_and_restored(room: Path) -> None:
    meshes = sorted(mesh.name for mesh in bpy.data.meshes if "(Lightmap)" not in mesh.name)
    for step in (1, 2, 3):
        bpy.data.objects["Box"].location.x -= 0.1 * step
        assert bake() == {"FINISHED"}
        assert set(shown().values()) <= {
            "room_Scene_lightmap.exr",
            "room_Scene_lightmap_2.exr",
            "room_Scene_lightmap_3.exr",
        }
    assert len([image for image in bpy.data.images if "_lightmap" in image.name]) == 2
    assert bpy.ops.radiosity.restore() == {"FINISHED"}
    assert sorted(mesh.name for mesh in bpy.data.meshes) == meshes
    assert [image.name for image in bpy.data.images if image.name.startswith("lightmap")] == []
    assert not any(name.startswith(".earlier") for name in bpy.data.meshes.keys())  # noqa: SIM118


def test_one_undo_brings_the_bake_before_back(room: Path) -> None:
    bpy.data.objects["Box"].location.x -= 0.5
    bpy.ops.ed.undo_push(message="Move")
    assert bake() == {"FINISHED"}
    bpy.ops.ed.undo()
    assert shown() == ONE_PAGE


def change_reflectance() -> None:
    material = bpy.data.materials["Gray"]
    node = next(node for node in material.node_tree.nodes if node.type == "BSDF_DIFFUSE")
    node.inputs["Color"].default_value = (0.8, 0.1, 0.1, 1)


def change_scale() -> None:
    bpy.data.objects["Floor"].radiosity_texel_scale = 2.0


def change_mesh() -> None:
    bpy.data.objects["Floor"].data.vertices[0].co.z += 0.2


@pytest.mark.parametrize("change", [change_reflectance, change_scale, change_mesh])
def test_what_counts_as_a_change(change, room: Path) -> None:
    change()
    assert bake() == {"FINISHED"}
    assert shown() == {**ONE_PAGE, "Floor": "room_Scene_lightmap_2.exr"}


def change_lamp() -> None:
    bpy.data.lights[0].energy = 50.0


def change_quality() -> None:
    bpy.context.scene.radiosity.seed = 3


@pytest.mark.parametrize("change", [change_lamp, change_quality])
def test_where_the_light_has_changed_all_are_relit(change, room: Path) -> None:
    page = digests(room)["room_Scene_lightmap.exr"]
    change()
    assert bake() == {"FINISHED"}
    assert shown() == ONE_PAGE
    assert digests(room)["room_Scene_lightmap.exr"] != page
    assert bake() == {"CANCELLED"}


def test_a_new_object_is_a_change(room: Path) -> None:
    add_mesh("New", location=(-1, -1, 0.2), scale=(0.2, 0.2, 1))
    assert bake() == {"FINISHED"}
    assert shown() == {**ONE_PAGE, "New": "room_Scene_lightmap_2.exr"}


def test_an_object_that_is_gone_is_named(room: Path, capfd: pytest.CaptureFixture[str]) -> None:
    bpy.data.objects["Shelf"].name = "Board"
    assert bake() == {"CANCELLED"}
    assert "nothing has changed" in capfd.readouterr().out
    bpy.data.objects.remove(bpy.data.objects["Board"])
    assert bake() == {"CANCELLED"}
    assert says(capfd.readouterr().out, "removed", "'Shelf'")
    bpy.data.objects["Box"].location.x -= 0.5
    assert bake() == {"FINISHED"}
    last = last_bake.read(bpy.context.scene)
    assert one_says((message for _, message in last.warnings), "removed", "Shelf")


def test_what_has_no_lightmap_is_named_until_all_is_baked(
    room: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """An object that is light only, and one that is gone, after a bake of another that changed."""
    add_mesh("Blind", location=(0, 0, 1.5), scale=(0.3, 0.3, 1)).radiosity_mode = "LIGHT_ONLY"
    bpy.context.scene.radiosity.scope = "all"
    assert bake() == {"FINISHED"}
    bpy.context.scene.radiosity.scope = "changed"
    assert bake() == {"CANCELLED"}
    bpy.data.objects["Blind"].location.x += 0.3
    bpy.data.objects.remove(bpy.data.objects["Shelf"])
    bpy.data.objects["Box"].location.x -= 0.5
    assert bake() == {"FINISHED"}
    capfd.readouterr()
    for _ in range(2):
        assert bake() == {"CANCELLED"}
        printed = capfd.readouterr().out
        assert says(printed, "removed", "'Shelf'")
        assert says(printed, "changed", "'Blind'")
    bpy.context.scene.radiosity.scope = "all"
    assert bake() == {"FINISHED"}
    bpy.context.scene.radiosity.scope = "changed"
    capfd.readouterr()
    assert bake() == {"CANCELLED"}
    assert "nothing has changed since the last bake" in capfd.readouterr().out


def test_a_cancelled_one_leaves_the_earlier_bake(room: Path) -> None:
    from radiosity_addon.blender.files.output import OutputFolder
    from radiosity_addon.blender.files.ownership import panel_names
    from radiosity_addon.blender.jobs.job import run_bake
    from radiosity_addon.blender.settings.properties import settings_of

    before = digests(room)
    bpy.data.objects["Box"].location.x -= 0.5
    output = OutputFolder(room, panel_names(bpy.context.scene))
    job = run_bake(bpy.context, settings_of(bpy.context), output, only_changed=True)
    stages = []
    while "apply" not in stages:
        stages.append(next(job).stage)
    job.close()
    assert shown() == ONE_PAGE
    assert digests(room) == before


def test_objects_with_several_lightmaps_are_all_relit(room: Path) -> None:
    """As light groups have them, which are made together."""
    image = bpy.data.images.new("lightmap_Kitchen", 4, 4)
    mark_made(image)
    (material,) = bpy.data.objects["Floor"].data.materials
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image, node[ADDED] = image, "Kitchen"  # no edit of the user's
    bpy.data.objects["Box"].location.x -= 0.5
    assert bake() == {"FINISHED"}
    assert shown() == ONE_PAGE


def test_an_export_names_what_was_edited_since(room: Path, capfd: pytest.CaptureFixture[str]) -> None:
    def said() -> str:
        capfd.readouterr()
        before = dump_file()
        assert bpy.ops.radiosity.export() == {"FINISHED"}
        assert differences_since(before, dump_file()) == []
        return capfd.readouterr().out

    assert "since the last bake" not in said()
    bpy.data.lights[0].energy = 5.0
    lamp = next(obj.name for obj in bpy.data.objects if obj.type == "LIGHT")
    bpy.data.objects["Shelf"].location.x = 0.3
    bpy.context.view_layer.update()
    named = f"changed since the last bake: 'Shelf', '{lamp}'; the lightmaps show their light of before"
    assert named in said()
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj.name == "Floor")
    bpy.context.scene.radiosity.scope = "selected"
    assert bake() == {"FINISHED"}
    assert named in said(), "the others' lightmaps are of the first bake"
    bpy.context.scene.radiosity.scope = "all"
    assert bake() == {"FINISHED"}
    assert "since the last bake" not in said()


def test_an_export_leaves_textures_alone_that_were_not_edited(
    room: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """They are looked at as finely as the bake did, whatever the panel says now."""
    rug = add_mesh("Rug", location=(0.5, 0.5, 0.1), scale=(0.3, 0.3, 1))
    rug.data.uv_layers.new(name="UVMap")
    material = shader_material("Woven", "ShaderNodeBsdfDiffuse")
    image = bpy.data.images.new("Weave", 64, 64)
    image.pixels = np.random.default_rng(2).random(4 * 64 * 64).astype(np.float32)
    image.pack()
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_DIFFUSE")
    material.node_tree.links.new(node.outputs["Color"], shader.inputs["Color"])
    rug.data.materials.append(material)
    bpy.context.scene.radiosity.scope = "all"
    assert bake() == {"FINISHED"}
    bpy.context.scene.radiosity.resolution = 64
    capfd.readouterr()
    assert bpy.ops.radiosity.export() == {"FINISHED"}
    assert "since the last bake" not in capfd.readouterr().out
