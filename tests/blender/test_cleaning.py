"""*Clean* deletes what bakes wrote and nothing shows; bakes outlive saving, appending and linking."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import bpy
import pytest

import radiosity_addon
from radiosity_addon.blender.datablocks.bake_record import recorded_objects
from radiosity_addon.blender.operators.cleaning import unused_lightmaps
from radiosity_addon.blender.session.state import session
from radiosity_addon.files.baked_files import digest_of_file, read_report, sealed, text_of
from tests.blender.scenes import add_lamp, add_mesh

pytestmark = pytest.mark.one_blender


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A saved room of two objects, each with a lightmap of its own: the folder, to be copied."""
    folder = tmp_path_factory.mktemp("baked")
    radiosity_addon.register()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    add_mesh("Floor")
    add_mesh("Shelf", location=(0, 0, 1), scale=(0.3, 0.3, 1))
    add_lamp("POINT", energy=100.0, transform={"location": (0, 0, 2)})
    settings = bpy.context.scene.radiosity
    settings.resolution, settings.quality, settings.atlas = 16, "sketch", "per-object"
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "room.blend"))
    assert bpy.ops.radiosity.bake("EXEC_DEFAULT", True) == {"FINISHED"}
    bpy.ops.wm.save_mainfile()
    radiosity_addon.unregister()
    return folder


@pytest.fixture
def room(registered: None, baked: Path, tmp_path: Path) -> Path:
    """The folder of a room that was baked and saved, and is open."""
    folder = tmp_path / "room"
    shutil.copytree(baked, folder)
    bpy.ops.wm.open_mainfile(filepath=str(folder / "room.blend"))
    return folder


def files(folder: Path) -> list[str]:
    return sorted(path.name for path in (folder / "lightmaps").iterdir())


def listed(folder: Path) -> list[str]:
    return sorted(read_report(folder / "lightmaps" / "room_Scene_report.json")["files"])


def clean() -> set[str]:
    return bpy.ops.radiosity.clean("EXEC_DEFAULT")


def shown() -> dict[str, str]:
    """What each baked object shows: its lightmap's file."""
    found = {}
    for obj in recorded_objects():
        (material,) = obj.data.materials
        trees = [node.node_tree for node in material.node_tree.nodes if node.type == "GROUP"]
        nodes = [node for tree in (material.node_tree, *trees) for node in tree.nodes]
        images = {node.image for node in nodes if node.type == "TEX_IMAGE" and node.image is not None}
        (image,) = images
        path = Path(bpy.path.abspath(image.filepath))
        assert path.is_file()
        assert "Lightmap" in obj.data.uv_layers
        found[obj.name] = path.name
    return found


ALL = ["room_Scene_Floor_lightmap.exr", "room_Scene_Shelf_lightmap.exr", "room_Scene_report.json"]
BOTH = {"Floor": "room_Scene_Floor_lightmap.exr", "Shelf": "room_Scene_Shelf_lightmap.exr"}


def test_what_is_shown_stays(room: Path) -> None:
    assert shown() == BOTH
    assert clean() == {"CANCELLED"}
    assert files(room) == ALL


def test_after_a_restore_the_lightmaps_go_and_nothing_else(room: Path) -> None:
    mine = room / "lightmaps" / "mine.exr"
    mine.write_text("not a bake's")
    bpy.ops.radiosity.restore()
    assert files(room) == ["mine.exr", *ALL]
    assert clean() == {"FINISHED"}
    assert files(room) == ["mine.exr", "room_Scene_report.json"]
    assert listed(room) == []
    assert clean() == {"CANCELLED"}


def test_a_file_that_somebody_changed_is_refused(room: Path) -> None:
    bpy.ops.radiosity.restore()
    painted = room / "lightmaps" / "room_Scene_Floor_lightmap.exr"
    painted.write_bytes(painted.read_bytes()[:-1] + b"!")
    assert [path.name for path in unused_lightmaps(bpy.context).changed] == ["room_Scene_Floor_lightmap.exr"]
    assert clean() == {"FINISHED"}
    assert files(room) == ["room_Scene_Floor_lightmap.exr", "room_Scene_report.json"]


def test_lightmaps_of_another_file_stay(room: Path) -> None:
    shutil.copy(room / "room.blend", room / "other.blend")
    bpy.ops.wm.open_mainfile(filepath=str(room / "other.blend"))
    bpy.ops.radiosity.restore()
    assert clean() == {"CANCELLED"}
    # It may have been moved, with what it shows to be found again.
    (room / "room.blend").unlink()
    assert clean() == {"CANCELLED"}
    assert files(room) == ALL


def test_what_a_copy_listed_with_them_shows_stays(room: Path) -> None:
    report = room / "lightmaps" / "room_Scene_report.json"
    copy = room / "lightmaps" / "baked.blend"
    shutil.copy(room / "room.blend", copy)
    told = read_report(report)
    told["files"]["baked.blend"] = {"bytes": copy.stat().st_size, "sha256": digest_of_file(copy)}
    report.write_text(text_of(sealed(told)))
    bpy.ops.radiosity.restore()
    assert clean() == {"CANCELLED"}
    copy.unlink()
    assert clean() == {"FINISHED"}


def test_a_list_that_leads_elsewhere_is_not_followed(room: Path) -> None:
    bpy.ops.radiosity.restore()
    (room / "thesis.png").write_text("years of work")
    report = room / "lightmaps" / "room_Scene_report.json"
    told = json.loads(report.read_text())
    told["files"]["../thesis.png"] = dict(told["files"]["room_Scene_Floor_lightmap.exr"])
    told["files"]["thesis.png"] = dict(told["files"]["room_Scene_Floor_lightmap.exr"])
    (room / "lightmaps" / "thesis.png").write_text("years of work")
    report.write_text(text_of(sealed(told)))
    clean()
    assert (room / "lightmaps" / "thesis.png").exists()
    assert (room / "thesis.png").exists()


def test_a_smaller_bake_leaves_earlier_lightmaps_to_clean(room: Path) -> None:
    """Files of the bake before stay listed until they are cleaned away."""
    bpy.data.objects["Shelf"].radiosity_mode = "LIGHT_ONLY"
    assert bpy.ops.radiosity.bake("EXEC_DEFAULT", True) == {"FINISHED"}
    assert listed(room) == ALL[:2]
    assert clean() == {"FINISHED"}
    assert files(room) == ["room_Scene_Floor_lightmap.exr", "room_Scene_report.json"]
    assert shown() == {"Floor": "room_Scene_Floor_lightmap.exr"}


def test_a_bake_outlives_saving_and_opening(room: Path) -> None:
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(room / "room.blend"))
    assert shown() == BOTH
    assert bpy.ops.radiosity.restore() == {"FINISHED"}
    assert recorded_objects() == []


def test_an_appended_object_brings_its_bake_along(room: Path, tmp_path: Path) -> None:
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "new.blend"))
    bpy.ops.wm.append(directory=str(room / "room.blend" / "Object"), filename="Floor")
    assert shown() == {"Floor": "room_Scene_Floor_lightmap.exr"}
    assert clean() == {"CANCELLED"}
    assert bpy.ops.radiosity.restore() == {"FINISHED"}
    assert "Lightmap" not in bpy.data.objects["Floor"].data.uv_layers
    assert files(room) == ALL


def test_a_linked_object_shows_its_bake_and_is_left_alone(room: Path, tmp_path: Path) -> None:
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "new.blend"))
    with bpy.data.libraries.load(str(room / "room.blend"), link=True) as (_, there):
        there.objects = ["Floor"]
    (floor,) = there.objects
    bpy.context.scene.collection.objects.link(floor)
    assert "Lightmap" in floor.data.uv_layers
    assert recorded_objects() == []
    assert bpy.ops.radiosity.restore() == {"CANCELLED"}
    assert "Lightmap" in floor.data.uv_layers
    assert clean() == {"CANCELLED"}


def test_opening_a_file_touches_nothing_and_recover_takes_a_half_published_bake_back(room: Path) -> None:
    """As a bake leaves it that is killed between two renamings."""
    from radiosity_addon.publishing.publish import EARLIER, JOURNAL, Staging

    name = "room_Scene_Floor_lightmap.exr"
    floor = room / "lightmaps" / name
    good = floor.read_bytes()
    staging = Staging(room / "lightmaps")
    (staging.path / EARLIER).mkdir()
    shutil.copy(floor, staging.path / EARLIER)
    old = digest_of_file(floor)
    floor.write_bytes(b"new")
    told = {"version": 2, "files": {name: {"new": digest_of_file(floor), "old": old}}}
    (staging.path / JOURNAL).write_text(json.dumps(told))
    staging.release()  # as the system does for a process that is no more
    before = {path: path.read_bytes() for path in room.rglob("*") if path.is_file()}
    bpy.ops.wm.open_mainfile(filepath=str(room / "room.blend"))
    assert {path: path.read_bytes() for path in room.rglob("*") if path.is_file()} == before
    assert session.interrupted
    assert bpy.ops.radiosity.recover() == {"FINISHED"}
    assert floor.read_bytes() == good
    assert files(room) == ALL
    assert not session.interrupted
    assert bpy.ops.radiosity.recover() == {"CANCELLED"}


def test_a_bake_into_the_folder_recovers_it_too(room: Path) -> None:
    from radiosity_addon.publishing.publish import EARLIER, JOURNAL, Staging

    name = "room_Scene_Floor_lightmap.exr"
    staging = Staging(room / "lightmaps")
    (staging.path / EARLIER).mkdir()
    (room / "lightmaps" / name).rename(staging.path / EARLIER / name)
    old = digest_of_file(staging.path / EARLIER / name)
    (room / "lightmaps" / name).write_bytes(b"new")
    told = {"version": 2, "files": {name: {"new": digest_of_file(room / "lightmaps" / name), "old": old}}}
    (staging.path / JOURNAL).write_text(json.dumps(told))
    staging.release()
    assert bpy.ops.radiosity.bake("EXEC_DEFAULT", True) == {"FINISHED"}
    assert files(room) == ALL
    assert not session.interrupted


@pytest.mark.parametrize("crafted", ["../../victim.exr", "/victim.exr", "victim.txt"])
def test_a_crafted_folder_is_left_as_it_is(room: Path, crafted: str) -> None:
    """Opening a received project, and baking in it, must not reach outside its folder of lightmaps."""
    from radiosity_addon.publishing.publish import EARLIER, JOURNAL, Staging

    victims = [room.parent / "victim.exr", room / "lightmaps" / "victim.txt"]
    for victim in victims:
        victim.write_text("years of work")
    staging = Staging(room / "lightmaps")
    (staging.path / EARLIER).mkdir()
    name = crafted.replace("/victim.exr", str(victims[0])) if crafted.startswith("/") else crafted
    told = {"version": 2, "names": [name], "files": {name: {"new": digest_of_file(victims[0]), "old": None}}}
    (staging.path / JOURNAL).write_text(json.dumps(told))
    staging.release()
    bpy.ops.wm.open_mainfile(filepath=str(room / "room.blend"))
    assert not session.interrupted
    assert bpy.ops.radiosity.bake("EXEC_DEFAULT", True) == {"FINISHED"}
    assert all(victim.read_text() == "years of work" for victim in victims)


def test_only_the_folder_of_a_bake_of_this_scene_is_opened(
    room: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from radiosity_addon.blender.operators import bake_operators

    opened = []
    monkeypatch.setattr(bake_operators, "show_folder", opened.append)
    assert bpy.ops.radiosity.open_folder() == {"FINISHED"}
    (room / "lightmaps" / "room_Scene_report.json").rename(room / "lightmaps" / "notes.json")
    with pytest.raises(RuntimeError, match="no bake of this scene"):
        bpy.ops.radiosity.open_folder()
    assert len(opened) == 1
