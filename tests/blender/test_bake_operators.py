"""The panel's buttons, and the one bake behind them, carried out in full."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from radiosity_addon.base.errors import BakeError, SceneError
from radiosity_addon.blender.datablocks.bake_record import is_baked, shows_lightmap
from radiosity_addon.blender.files.cornell import build_cornell_box
from radiosity_addon.blender.files.output import OutputFolder
from radiosity_addon.blender.images.node_group import GROUP_NAME
from radiosity_addon.blender.jobs.job import run_bake
from radiosity_addon.blender.operators.bake_operators import show_result
from radiosity_addon.blender.operators.checks import look
from radiosity_addon.blender.operators.cleaning import interrupted_folders
from radiosity_addon.blender.relight import lightmap_versions
from radiosity_addon.blender.session import last_bake
from radiosity_addon.blender.session.state import session
from radiosity_addon.blender.settings.properties import look_of
from radiosity_addon.options.bake_settings import BakeSettings

QUICK = BakeSettings(resolution=32, quality="sketch")


@pytest.fixture(autouse=True)
def box(registered: None) -> bpy.types.Scene:
    """The Cornell box, with the panel set to a quick bake."""
    scene = build_cornell_box()
    scene.radiosity.resolution, scene.radiosity.quality = QUICK.resolution, QUICK.quality
    return scene


def bake() -> set[str]:
    return bpy.ops.radiosity.bake("EXEC_DEFAULT", True)


def showing() -> dict[str, str]:
    """The mesh that each object shows."""
    return {obj.name: obj.data.name for obj in bpy.data.objects if obj.type == "MESH"}


def made() -> list[str]:
    """Every datablock there is, by kind and name."""
    kinds = ("objects", "meshes", "materials", "images", "node_groups", "scenes", "cameras", "worlds")
    return sorted(f"{kind}/{block.name}" for kind in kinds for block in getattr(bpy.data, kind))


def test_an_unsaved_file_gets_packed_lightmaps(box: bpy.types.Scene) -> None:
    assert bake() == {"FINISHED"}
    images = [image for image in bpy.data.images if image.name.startswith("lightmap")]
    assert [image.packed_file is not None for image in images] == [True]
    assert tuple(images[0].size) == (32, 32)
    last = last_bake.read(bpy.context.scene)
    assert dict(last.figures)["Objects"] == "7"
    assert last.folder == ""


def test_a_saved_file_gets_a_folder_next_to_it(tmp_path: Path) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    assert bake() == {"FINISHED"}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["lightmaps", "room.blend"]
    folder = tmp_path / "lightmaps"
    assert sorted(path.name for path in folder.iterdir()) == [
        "room_Cornell Box_lightmap.exr",
        "room_Cornell Box_report.json",
    ]
    image = bpy.data.images["room_Cornell Box_lightmap.exr"]
    assert image.filepath == "//lightmaps/room_Cornell Box_lightmap.exr"
    assert Path(bpy.path.abspath(last_bake.read(bpy.context.scene).folder)) == folder.resolve()
    report = json.loads((folder / "room_Cornell Box_report.json").read_text())
    assert {entry["object"] for entry in report["objects"]} == set(showing())


def test_only_selected_objects_get_a_lightmap(box: bpy.types.Scene) -> None:
    box.radiosity.scope = "selected"
    for name in ("Floor", "Tall Block"):
        bpy.data.objects[name].select_set(True)
    assert bake() == {"FINISHED"}
    assert {obj.name for obj in bpy.data.objects if shows_lightmap(obj)} == {"Floor", "Tall Block"}


def test_nothing_selected_is_an_error_message_and_no_change(box: bpy.types.Scene) -> None:
    box.radiosity.scope = "selected"
    bpy.ops.object.select_all(action="DESELECT")
    before = made()
    # Blender turns an operator's error report into this exception for Python callers.
    with pytest.raises(RuntimeError, match="select"):
        bake()
    assert made() == before
    assert not session.running.active


@pytest.mark.parametrize("folder", ["//" + "x" * 300, "//" + "/".join(["x" * 200] * 4)])
def test_a_folder_whose_name_is_too_long_is_one_line(
    folder: str, box: bpy.types.Scene, tmp_path: Path
) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    box.radiosity.output_folder = folder
    assert interrupted_folders(bpy.context) == []
    with pytest.raises(RuntimeError, match=r"output folder.*(too long|longer)") as refusal:
        bpy.ops.radiosity.bake()
    assert len(str(refusal.value).strip().splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["room.blend"]
    found = look(bpy.context)
    assert any("output folder" in finding.message for finding in found.findings)


def test_an_unwritable_folder_is_an_error_message(box: bpy.types.Scene, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    box.radiosity.output_folder = str(tmp_path / "file")
    before = made()
    with pytest.raises(RuntimeError, match="output folder"):
        bake()
    assert made() == before


def test_undo_takes_one_step_and_redo_one(box: bpy.types.Scene) -> None:
    bpy.ops.ed.undo_push(message="Cornell Box")
    before = made()
    bake()
    after = made()
    assert is_baked()
    bpy.ops.ed.undo()
    assert made() == before
    assert last_bake.read(bpy.context.scene) is None
    bpy.ops.ed.redo()
    assert made() == after
    assert dict(last_bake.read(bpy.context.scene).figures)["Objects"] == "7"


def test_a_mesh_in_edit_mode_is_flushed(box: bpy.types.Scene) -> None:
    floor = bpy.data.objects["Floor"]
    bpy.context.view_layer.objects.active = floor
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide()
    assert bake() == {"FINISHED"}
    assert len(floor.data.polygons) == 4
    assert "Lightmap" in floor.data.uv_layers


def test_restore_brings_everything_back(box: bpy.types.Scene) -> None:
    before = made(), showing()
    assert bpy.ops.radiosity.restore() == {"CANCELLED"}
    bake()
    assert (made(), showing()) != before
    assert bpy.ops.radiosity.restore() == {"FINISHED"}
    assert (made(), showing()) == before
    assert last_bake.read(box) is None


def test_baking_twice_gives_the_same_pixels(box: bpy.types.Scene) -> None:
    bake()
    first, names = np.array(bpy.data.images["lightmap.exr"].pixels), made()
    bake()
    assert made() == names
    np.testing.assert_array_equal(np.array(bpy.data.images["lightmap.exr"].pixels), first)


def test_an_edit_of_a_baked_object_is_there_after_the_next_bake(box: bpy.types.Scene) -> None:
    def warned() -> list[str]:
        # At this resolution the blocks get few texels, which is told each time.
        return [name for name, message in last_bake.read(box).warnings if "texels" not in message]

    bake()
    bake()
    assert warned() == []
    bpy.context.view_layer.objects.active = bpy.data.objects["Tall Block"]
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.transform.translate(value=(0, 0, 1))
    lowest = min(vertex.co.z for vertex in bpy.data.objects["Tall Block"].data.vertices)
    bake()
    assert warned() == []
    mesh = bpy.data.objects["Tall Block"].data
    mesh.vertices[0].co.x += 0.5
    bake()
    assert bpy.ops.radiosity.restore() == {"FINISHED"}
    assert min(vertex.co.z for vertex in mesh.vertices) == lowest + 1


def test_what_is_shown_is_kept_when_baking_again(box: bpy.types.Scene) -> None:
    def shown() -> set[str]:
        trees = [tree for tree in bpy.data.node_groups if tree.name.startswith(GROUP_NAME)]
        results = [node for tree in trees for node in tree.nodes if node.type == "GROUP_OUTPUT"]
        return {result.inputs[0].links[0].from_node.name for result in results}

    bake()
    assert shown() == {"shine"}
    for chosen in ("matte", "lightmap"):
        box.radiosity.show = chosen
        assert shown() == {chosen}
        bake()
        assert shown() == {chosen}


def test_all_scenes_of_a_file_say_what_is_shown(box: bpy.types.Scene) -> None:
    """Materials are of the file: no scene may say something else than what they show."""
    second = bpy.data.scenes.new("Second")
    second.radiosity.show = "matte"
    assert box.radiosity.show == "matte"
    box.radiosity.show = "lightmap"
    assert second.radiosity.show == "lightmap"
    third = bpy.data.scenes.new("Third")
    bake()
    assert third.radiosity.show == "lightmap"


@pytest.mark.parametrize("baked_in", ["Box", "Third"])
def test_a_bake_that_cannot_be_published_leaves_what_is_shown(
    baked_in: str, box: bpy.types.Scene, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Of scenes with looks of their own, as new ones have."""
    box.name = "Box"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    bake()
    box.radiosity.show = "matte"
    third = bpy.data.scenes.new("Third")
    for obj in box.objects:
        third.collection.objects.link(obj)
    third.radiosity.resolution, third.radiosity.quality = box.radiosity.resolution, box.radiosity.quality
    fourth = bpy.data.scenes.new("Fourth")

    def state() -> list[object]:
        scenes = (box, third, fourth)
        trees = [tree for tree in bpy.data.node_groups if tree.name.startswith(GROUP_NAME)]
        results = [(tree.name, node) for tree in trees for node in tree.nodes if node.type == "GROUP_OUTPUT"]
        return [
            [s.is_property_set("radiosity") and s.radiosity.is_property_set("show") for s in scenes],
            [look_of(scene) for scene in scenes],
            [(name, node.inputs[0].links[0].from_node.name) for name, node in results],
        ]

    def full(*_: object) -> None:
        raise BakeError("no space left on device")

    before = state()
    assert before[:2] == [[True, False, False], ["matte", "shine", "shine"]]
    bpy.context.window.scene = bpy.data.scenes[baked_in]
    monkeypatch.setattr(lightmap_versions, "publish", full)
    with pytest.raises(RuntimeError, match="no space left"):
        bake()
    assert state() == before
    monkeypatch.undo()
    bake()
    assert len(set(state()[1])) == 1


def test_undo_of_another_look_brings_the_earlier_one_back(box: bpy.types.Scene) -> None:
    def seen() -> tuple[str, str]:
        (tree,) = [tree for tree in bpy.data.node_groups if tree.name.startswith(GROUP_NAME)]
        (result,) = (node for node in tree.nodes if node.type == "GROUP_OUTPUT")
        return bpy.context.scene.radiosity.show, result.inputs[0].links[0].from_node.name

    bake()
    bpy.ops.ed.undo_push(message="baked")
    box.radiosity.show = "matte"
    bpy.ops.ed.undo_push(message="matte")
    bpy.ops.ed.undo()
    assert seen() == ("shine", "shine")
    bpy.ops.ed.redo()
    assert seen() == ("matte", "matte")


def test_the_preview_after_a_bake_has_the_light_of_the_scene(box: bpy.types.Scene) -> None:
    """The studio's light would shine on baked surfaces."""
    spaces = [area.spaces.active for screen in bpy.data.screens for area in screen.areas]
    space = next(space for space in spaces if space.type == "VIEW_3D")
    shading, context = space.shading, SimpleNamespace(space_data=space, scene=box)
    shading.type, shading.use_scene_lights, shading.use_scene_world = "SOLID", False, False
    show_result(context)
    assert (shading.type, shading.use_scene_lights, shading.use_scene_world) == ("MATERIAL", True, True)
    shading.use_scene_world = False
    show_result(context)
    assert not shading.use_scene_world


def test_a_file_of_an_earlier_version_that_shows_the_lightmap_alone_says_so(
    box: bpy.types.Scene, tmp_path: Path
) -> None:
    box.radiosity.lightmap_only = True
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "earlier.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "earlier.blend"))
    assert bpy.context.scene.radiosity.show == "lightmap"
    bpy.context.scene.radiosity.show = "matte"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "later.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "later.blend"))
    assert bpy.context.scene.radiosity.show == "matte"


@pytest.mark.one_blender
@pytest.mark.parametrize("again", [False, True], ids=["first bake", "over an earlier one"])
def test_closing_the_bake_at_any_step_leaves_everything_as_it_was(tmp_path: Path, again: bool) -> None:
    for obj in list(bpy.data.objects):
        if obj.name not in {"Floor", "Lamp"}:
            bpy.data.objects.remove(obj)
    if again:
        bake()
    before = made(), showing(), bpy.context.scene.radiosity.last_bake
    stages = []
    while True:
        job = run_bake(bpy.context, QUICK, OutputFolder(tmp_path / "out"))
        steps = len(stages) + 1
        progress = None
        for _ in range(steps):
            progress = next(job, None)
        if progress is None:
            break
        stages.append(progress.stage)
        job.close()
        assert (made(), showing(), bpy.context.scene.radiosity.last_bake) == before
        assert list(tmp_path.iterdir()) == []
    assert {"export", "solve", "apply"} <= set(stages)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["lightmap.exr", "report.json"]


def test_a_patient_bake_gives_the_same_pixels(box: bpy.types.Scene) -> None:
    list(run_bake(bpy.context, QUICK, None))
    expected = np.array(bpy.data.images["lightmap.exr"].pixels)
    stages = [progress.stage for progress in run_bake(bpy.context, QUICK, None, in_background=True)]
    assert {"export", "solve", "light", "apply"} <= set(stages)
    np.testing.assert_array_equal(np.array(bpy.data.images["lightmap.exr"].pixels), expected)


def test_progress_never_goes_back(tmp_path: Path) -> None:
    job = run_bake(bpy.context, QUICK, OutputFolder(tmp_path / "out"), with_copy=True)
    fractions = [progress.fraction for progress in job]
    assert fractions[0] == 0.0
    assert fractions[-1] == 1.0
    assert (np.diff(fractions) >= 0).all()


def test_a_failure_after_the_lightmaps_show_takes_them_off_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise BakeError("the disk is full")

    before = made(), showing()
    monkeypatch.setattr("radiosity_addon.blender.jobs.finish.render_preview", fail)
    with pytest.raises(BakeError, match="the disk is full"):
        list(run_bake(bpy.context, QUICK, OutputFolder(tmp_path / "out"), with_copy=True))
    assert (made(), showing()) == before
    assert list(tmp_path.iterdir()) == []


def test_an_empty_scene_is_refused_by_name() -> None:
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    with pytest.raises(SceneError, match="nothing to bake"):
        list(run_bake(bpy.context, QUICK, None))


def test_with_other_objects_the_cornell_box_goes_into_a_scene_of_its_own(box: bpy.types.Scene) -> None:
    assert bpy.ops.radiosity.add_cornell_box() == {"FINISHED"}
    assert len(bpy.data.scenes) == 2
    assert bpy.context.scene != box
    assert len(box.objects) == len(bpy.context.scene.objects) == 9


def test_what_somebody_else_wrote_is_no_last_bake(box: bpy.types.Scene) -> None:
    for text in ("", "{}", "[1]", "not json", '{"solver": {}, "seconds": "x"}'):
        box.radiosity.last_bake = text
        assert last_bake.read(box) is None


def test_the_panel_shows_what_is_said_once_next_to_many_warnings_alike(box: bpy.types.Scene) -> None:
    names = [f"slot{number}" for number in range(120)]
    missing = [{"name": name, "message": f"material '{name}': '{name}.jpg' is missing"} for name in names]
    small = {"name": "map", "message": "map: 256 px is too small"}
    solver = {"method": "hierarchical", "elements": 1, "links": 1, "rays": 1}
    report = {"objects": [], "solver": solver, "seconds": {}, "warnings": [*missing, small]}
    last_bake.remember(box, report, "")
    last = last_bake.read(box)
    assert last.warning_count == 2
    assert [name for name, _ in last.warnings] == ["slot0", "map"]


def test_a_bake_and_a_relight_say_that_the_export_is_older(
    box: bpy.types.Scene, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    older = "Warning: The export is older than the lightmaps: export again"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    assert bake() == {"FINISHED"}
    assert bpy.ops.radiosity.export() == {"FINISHED"}
    assert older not in capfd.readouterr().out
    bpy.data.lights[0].energy *= 2.0
    assert bpy.ops.radiosity.relight() == {"FINISHED"}
    assert older in capfd.readouterr().out
    assert bpy.ops.radiosity.export() == {"FINISHED"}
    box.radiosity.seed = 1
    assert older not in capfd.readouterr().out
    assert bake() == {"FINISHED"}
    assert older in capfd.readouterr().out
