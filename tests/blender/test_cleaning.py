"""*Clean* deletes what bakes wrote and nothing shows; bakes outlive saving, appending and linking."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import bpy
import pytest

import radiosity_addon
from radiosity_addon.blender.bake_record import recorded_objects
from radiosity_addon.blender.cleaning import unused_lightmaps
from radiosity_addon.manifest import listed
from tests.blender.scenes import add_lamp, add_mesh


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
    settings.resolution, settings.quality, settings.atlas = 16, "draft", "per-object"
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "room.blend"))
    assert bpy.ops.radiosity.bake("EXEC_DEFAULT", True) == {"FINISHED"}
    bpy.ops.wm.save_mainfile()
    radiosity_addon.unregister()
    return folder


@pytest.fixture
def room(baked: Path, tmp_path: Path) -> Iterator[Path]:
    """The folder of a room that was baked and saved, and is open."""
    folder = tmp_path / "room"
    shutil.copytree(baked, folder)
    radiosity_addon.register()
    report = folder / "lightmaps" / "report.json"
    # The bake was of the file beside it, wherever the folder was copied to.
    report.write_text(report.read_text().replace(json.dumps(str(baked))[1:-1], json.dumps(str(folder))[1:-1]))
    bpy.ops.wm.open_mainfile(filepath=str(folder / "room.blend"))
    yield folder
    radiosity_addon.unregister()


def files(folder: Path) -> list[str]:
    return sorted(path.name for path in (folder / "lightmaps").iterdir())


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


BOTH = {"Floor": "Floor.exr", "Shelf": "Shelf.exr"}


def test_what_is_shown_stays(room: Path) -> None:
    assert shown() == BOTH
    assert clean() == {"CANCELLED"}
    assert files(room) == ["Floor.exr", "Shelf.exr", "report.json"]


def test_after_a_restore_the_lightmaps_go_and_nothing_else(room: Path) -> None:
    mine = room / "lightmaps" / "mine.exr"
    mine.write_text("not a bake's")
    bpy.ops.radiosity.restore()
    assert files(room) == ["Floor.exr", "Shelf.exr", "mine.exr", "report.json"]
    assert clean() == {"FINISHED"}
    assert files(room) == ["mine.exr", "report.json"]
    assert listed(room / "lightmaps" / "report.json") == {}
    assert clean() == {"CANCELLED"}


def test_a_file_that_somebody_changed_is_refused(room: Path) -> None:
    bpy.ops.radiosity.restore()
    painted = room / "lightmaps" / "Floor.exr"
    painted.write_bytes(painted.read_bytes()[:-1] + b"!")
    assert [path.name for path in unused_lightmaps(bpy.context).changed] == ["Floor.exr"]
    assert clean() == {"FINISHED"}
    assert files(room) == ["Floor.exr", "report.json"]


def test_lightmaps_of_another_file_stay(room: Path) -> None:
    shutil.copy(room / "room.blend", room / "other.blend")
    bpy.ops.wm.open_mainfile(filepath=str(room / "other.blend"))
    bpy.ops.radiosity.restore()
    assert clean() == {"CANCELLED"}
    (room / "room.blend").unlink()
    assert clean() == {"FINISHED"}


def test_what_a_copy_beside_them_shows_stays(room: Path) -> None:
    shutil.copy(room / "room.blend", room / "lightmaps" / "baked.blend")
    bpy.ops.radiosity.restore()
    assert clean() == {"CANCELLED"}


def test_a_list_that_leads_elsewhere_is_not_followed(room: Path) -> None:
    bpy.ops.radiosity.restore()
    (room / "thesis.png").write_text("years of work")
    report = room / "lightmaps" / "report.json"
    told = json.loads(report.read_text())
    told["files"]["../thesis.png"] = dict(told["files"]["Floor.exr"])
    report.write_text(json.dumps(told))
    clean()
    assert (room / "thesis.png").exists()


def test_a_smaller_bake_leaves_earlier_lightmaps_to_clean(room: Path) -> None:
    """Files of the bake before stay listed until they are cleaned away."""
    bpy.data.objects["Shelf"].radiosity_mode = "LIGHT_ONLY"
    assert bpy.ops.radiosity.bake("EXEC_DEFAULT", True) == {"FINISHED"}
    assert sorted(listed(room / "lightmaps" / "report.json")) == ["Floor.exr", "Shelf.exr"]
    assert clean() == {"FINISHED"}
    assert files(room) == ["Floor.exr", "report.json"]
    assert shown() == {"Floor": "Floor.exr"}


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
    assert shown() == {"Floor": "Floor.exr"}
    assert clean() == {"CANCELLED"}
    assert bpy.ops.radiosity.restore() == {"FINISHED"}
    assert "Lightmap" not in bpy.data.objects["Floor"].data.uv_layers
    assert files(room) == ["Floor.exr", "Shelf.exr", "report.json"]


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


def test_opening_a_file_takes_back_a_half_published_bake(room: Path) -> None:
    """As a bake leaves it that is killed between two renamings."""
    from radiosity_addon.staging import EARLIER, JOURNAL, Staging

    good = (room / "lightmaps" / "Floor.exr").read_bytes()
    staging = Staging(room / "lightmaps")
    (staging.path / EARLIER).mkdir()
    shutil.copy(room / "lightmaps" / "Floor.exr", staging.path / EARLIER)
    (staging.path / JOURNAL).write_text(json.dumps({"names": ["Floor.exr"]}))
    (room / "lightmaps" / "Floor.exr").write_bytes(b"new")
    staging._mark.close()  # as the system does for a process that is no more
    bpy.ops.wm.open_mainfile(filepath=str(room / "room.blend"))
    assert (room / "lightmaps" / "Floor.exr").read_bytes() == good
    assert files(room) == ["Floor.exr", "Shelf.exr", "report.json"]
