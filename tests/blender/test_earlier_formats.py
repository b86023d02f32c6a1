"""Files that version 0.1.0 wrote are shown, relit, baked again and restored, or refused by name in one line.

Made by `tests/fixtures/make_fixtures.py` with Blender 4.2. Either way nothing is lost.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

import radiosity_addon
from radiosity_addon.bake.sidecar.sidecar import FORMAT
from radiosity_addon.blender.command_line.main import main
from tests.reliability.folders import broken_result, changes, leftovers, tree

FIXTURES = Path(__file__).resolve().parents[1] / "fixtures" / "v0.1.0"

BAKED = ("Cube", "Floor", "Panel", "Twin A", "Twin B", "Wall")
"""Objects of the fixture that have lightmaps; an instance has one too."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of everything that the version wrote, and a file of somebody else's in each place."""
    place = tmp_path / "kitchen"
    shutil.copytree(FIXTURES, place)
    for here in (place, place / "lightmaps", place / "command_line"):
        (here / "notes.txt").write_text("mine")
    return place


@pytest.fixture
def opened(registered: None, folder: Path) -> Path:
    """The file that was baked from the panel, open."""
    before = tree(folder)
    bpy.ops.wm.open_mainfile(filepath=str(folder / "kitchen.blend"))
    assert changes(before, tree(folder)) == [], "opening the file changed something on disk"
    return folder


def done_or_refused(operator: Callable[..., set[str]], *names: str) -> bool:
    """Run an operator; True if it has finished, False if it says in one line why it cannot."""
    try:
        status = operator("EXEC_DEFAULT", True)
    except RuntimeError as error:
        message = str(error).strip().removeprefix("Error: ")
        assert "Traceback" not in message
        assert len(message.splitlines()) == 1, message
        assert any(name in message for name in names), message
        return False
    assert status == {"FINISHED"}
    return True


def run(capfd: pytest.CaptureFixture[str], *words: object) -> tuple[int, str]:
    """Run the command line in this process; returns its code and what it says of errors."""
    capfd.readouterr()
    code = main([str(word) for word in words])
    told = capfd.readouterr().err
    assert "Traceback" not in told
    assert told.count("\n") <= 1, told
    assert code in (0, 1, 2)
    return code, told


def lightmaps() -> list[bpy.types.Image]:
    """The images of the open file that are in a folder of lightmaps."""
    return [image for image in bpy.data.images if Path(image.filepath_raw).suffix == ".exr"]


def mean_of(image: bpy.types.Image) -> float:
    image.reload()
    pixels = np.empty(image.size[0] * image.size[1] * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    assert np.isfinite(pixels).all()
    return float(pixels.reshape(-1, 4)[:, :3].mean())


def shows_lightmap(obj: bpy.types.Object) -> bool:
    """Whether a material of the object reads a lightmap, itself or in a node group."""
    trees = [slot.material.node_tree for slot in obj.material_slots if slot.material is not None]
    for tree_of in trees:
        trees += [node.node_tree for node in tree_of.nodes if node.type == "GROUP" and node.node_tree]
    images = [node.image for tree_of in trees for node in tree_of.nodes if node.type == "TEX_IMAGE"]
    return any(image in lightmaps() for image in images)


def check_original() -> None:
    """The open file is the scene as it was before it was baked."""
    objects = bpy.data.objects
    assert {obj.name for obj in objects} == {*BAKED, "Instance", "Lamp", "Thing"}
    assert objects["Twin A"].data == objects["Twin B"].data
    assert [layer.name for layer in objects["Wall"].data.uv_layers] == ["UVMap"]
    uv = [tuple(entry.uv) for entry in objects["Wall"].data.uv_layers[0].data]
    assert uv == [(0, 0), (1, 0), (1, 1), (0, 1)]
    assert len(objects["Floor"].data.uv_layers) == 0
    assert [(m.type, m.show_viewport, m.show_render) for m in objects["Cube"].modifiers] == [
        ("MIRROR", True, True)
    ]
    assert len(objects["Cube"].data.vertices) == 8
    assert not objects["Instance"].hide_viewport
    assert not objects["Instance"].hide_render
    assert objects["Instance"].instance_collection is not None
    slots = {name: [slot.material.name for slot in objects[name].material_slots] for name in BAKED}
    white = {name: ["White"] for name in ("Cube", "Floor", "Twin A", "Twin B")}
    assert slots == {**white, "Wall": ["Red"], "Panel": ["Glow"]}
    assert objects["Lamp"].radiosity_light_group == "Bulbs"
    assert lightmaps() == []


def test_the_baked_file_is_shown(opened: Path) -> None:
    assert all(shows_lightmap(bpy.data.objects[name]) for name in BAKED)
    images = lightmaps()
    assert len(images) == 3
    assert all(mean_of(image) > 0 for image in images)


def test_the_baked_file_is_relit_or_refused(opened: Path) -> None:
    before, light = tree(opened), {image.name: mean_of(image) for image in lightmaps()}
    bpy.data.lights["Lamp"].energy *= 3
    if done_or_refused(bpy.ops.radiosity.relight, "lightmap.relight", "kitchen"):
        now = {image.name: mean_of(image) for image in lightmaps()}
        assert now["lightmap.exr"] > 1.5 * light["lightmap.exr"]
    else:
        assert changes(before, tree(opened)) == []
    assert (opened / "lightmaps" / "notes.txt").read_text() == "mine"
    assert leftovers(opened) == []


def test_the_baked_file_is_baked_again_or_refused(opened: Path) -> None:
    before = tree(opened)
    if done_or_refused(bpy.ops.radiosity.bake, "lightmap.exr", "report.json"):
        assert all(shows_lightmap(bpy.data.objects[name]) for name in BAKED)
        assert broken_result(opened / "lightmaps") == []
    else:
        assert changes(before, tree(opened)) == []
    assert (opened / "lightmaps" / "notes.txt").read_text() == "mine"
    assert leftovers(opened) == []
    bpy.ops.radiosity.restore("EXEC_DEFAULT", True)
    check_original()


def test_the_baked_file_is_restored(opened: Path) -> None:
    before = tree(opened)
    assert bpy.ops.radiosity.restore("EXEC_DEFAULT", True) == {"FINISHED"}
    check_original()
    assert changes(before, tree(opened)) == []


@pytest.mark.parametrize("number", range(2, FORMAT + 1))
def test_each_format_of_sidecars_is_relit_or_refused_by_name_and_restored(
    number: int, tmp_path: Path
) -> None:
    """Version 0.1.0 wrote the first format."""
    place = tmp_path / "kitchen"
    shutil.copytree(FIXTURES.parent / f"sidecar-{number}", place)
    radiosity_addon.register()
    try:
        bpy.ops.wm.open_mainfile(filepath=str(place / "kitchen.blend"))
        assert all(shows_lightmap(bpy.data.objects[name]) for name in BAKED)
        before, light = tree(place), [mean_of(image) for image in lightmaps()]
        bpy.data.lights["Lamp"].energy *= 3
        if number == FORMAT:
            assert bpy.ops.radiosity.relight("EXEC_DEFAULT", True) == {"FINISHED"}
            assert max(mean_of(image) / old for image, old in zip(lightmaps(), light, strict=True)) > 1.5
        else:
            with pytest.raises(RuntimeError, match=f"format {number}.*bake again"):
                bpy.ops.radiosity.relight("EXEC_DEFAULT", True)
            assert changes(before, tree(place)) == []
        assert bpy.ops.radiosity.restore("EXEC_DEFAULT", True) == {"FINISHED"}
        check_original()
    finally:
        radiosity_addon.unregister()


def test_a_preset_is_applied(opened: Path) -> None:
    settings = bpy.context.scene.radiosity
    settings.resolution, settings.min_area, settings.quality = 512, 0.0, "high"
    bpy.ops.script.execute_preset(filepath=str(opened / "Kitchen.py"), menu_idname="RADIOSITY_PT_presets")
    assert (settings.resolution, settings.min_area, settings.quality) == (64, 1.0, "draft")


def test_the_copy_of_the_command_line_is_shown(opened: Path) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(opened / "command_line" / "baked.blend"))
    assert all(shows_lightmap(bpy.data.objects[name]) for name in BAKED)
    assert all(mean_of(image) > 0 for image in lightmaps())


def test_the_command_line_restores_its_copy(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    before = tree(folder)
    code, told = run(
        capfd,
        "restore",
        folder / "command_line" / "baked.blend",
        "--output",
        folder / "back.blend",
        "--quiet",
    )
    assert (code, told) == (0, "")
    assert changes(before, tree(folder)) == ["new: back.blend"]
    radiosity_addon.register()
    bpy.ops.wm.open_mainfile(filepath=str(folder / "back.blend"))
    try:
        check_original()
    finally:
        radiosity_addon.unregister()


@pytest.mark.parametrize(
    "more", [("--relight",), ("--resolution", "16", "--quality", "draft", "--min-area", "1")]
)
def test_the_command_line_relights_and_bakes_its_folder(
    more: tuple[str, ...], folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Also where the .blend has moved since, as here."""
    before = tree(folder)
    code, told = run(capfd, "bake", folder / "kitchen.blend", "--output", folder / "command_line", *more)
    if code == 0:
        assert broken_result(folder / "command_line") == []
    else:
        names = [name for name in before if name.startswith("command_line/")]
        assert any(Path(name).name in told for name in names), told
        assert changes(before, tree(folder)) == []
    outside = {name: of for name, of in before.items() if Path(name).parts[0] != "command_line"}
    assert changes(outside, tree(folder, folder / "command_line")) == []
    assert (folder / "command_line" / "notes.txt").read_text() == "mine"
