"""Relighting from panel and command line: the lightmaps of a full bake, in place, or nothing at all."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np
import pytest

import radiosity_addon
from radiosity_addon.blender.command_line.main import main
from radiosity_addon.blender.datablocks.bake_record import is_made
from radiosity_addon.blender.images.images import image_scale
from radiosity_addon.blender.images.node_group import EMISSION, SCALE
from radiosity_addon.blender.material_edits.stripping import is_lightmap_node
from radiosity_addon.blender.materials.light_inputs import inputs_of
from radiosity_addon.blender.relight.relight_scene import kept_bakes
from radiosity_addon.blender.session.state import session
from radiosity_addon.files.baked_files import is_as_written
from tests.blender.edited_copies import constant_of, lightmap_node
from tests.blender.scenes import add_lamp, add_mesh, add_object, set_world, shader_material

LIGHTMAP = "baked_Scene_lightmap.exr"
REPORT = "baked_Scene_report.json"
SIDECAR = "baked_Scene_lightmap.relight"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with the room, saved before it was baked and after, with a sidecar."""
    path = tmp_path_factory.mktemp("relight")
    radiosity_addon.register()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    room()
    bpy.ops.wm.save_as_mainfile(filepath=str(path / "plain.blend"))
    bpy.context.scene.radiosity_relight.sidecar = True
    bpy.ops.wm.save_as_mainfile(filepath=str(path / "baked.blend"), relative_remap=True)
    assert bake() == {"FINISHED"}
    bpy.ops.wm.save_mainfile()
    yield path
    radiosity_addon.unregister()


@pytest.fixture
def baked(folder: Path, tmp_path: Path) -> Path:
    """A copy of that folder, its baked room opened: what is known is what file and sidecar hold."""
    shutil.copytree(folder, tmp_path / "copy")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "copy" / "baked.blend"))
    return tmp_path / "copy"


def room() -> None:
    """A floor, a glowing panel, a lamp, a dark one, a sky, and a quad shown as an instance."""
    glow = shader_material("Glow", "ShaderNodeEmission", Color=(1.0, 0.6, 0.3, 1.0), Strength=3.0)
    add_mesh("Floor")
    add_mesh("Panel", material=glow, location=(0.6, 0, 1), rotation_euler=(3.1, 0.4, 0), scale=(0.3, 0.3, 1))
    add_lamp("POINT", "Bulb", {"location": (-0.5, 0.3, 1.2)}, energy=40.0, shadow_soft_size=0.1)
    add_lamp("AREA", "Dark", {"location": (0, -0.6, 1.5)}, energy=0.0, size=0.4)
    set_world(0.2, 0.3, 0.5)
    shown = bpy.data.collections.new("Shown")
    add_mesh("Wall", collection=shown, rotation_euler=(1.57, 0, 0), location=(0, 1, 0.5), scale=(1, 0.5, 1))
    empty = add_object("Instancer", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", shown
    scene = bpy.context.scene
    scene.radiosity.resolution, scene.radiosity.quality = 32, "sketch"
    scene.render.resolution_x, scene.render.resolution_y = 32, 24  # of previews


def bake() -> set[str]:
    return bpy.ops.radiosity.bake("EXEC_DEFAULT")


def relight() -> set[str]:
    return bpy.ops.radiosity.relight("EXEC_DEFAULT")


def lightmap(name: str = "") -> np.ndarray:
    """The (h, w, 3) pixels of an image: of the lightmap, if no other is named."""
    shown = [image for image in bpy.data.images if is_made(image)]
    image = bpy.data.images[name] if name else shown[0]
    pixels = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(*image.size, 4)[..., :3].astype(np.float64)


def relative(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.sqrt(((found - expected) ** 2).mean()) / expected.mean())


def change_lights() -> None:
    """Change each of them: a dark lamp shines, another dims, emission and world get other colors."""
    bpy.data.objects["Dark"].data.energy = 60.0
    bpy.data.objects["Dark"].data.color = (1.0, 0.3, 0.2)
    bpy.data.objects["Bulb"].data.energy = 10.0
    (glow,) = (node for node in bpy.data.materials["Glow"].node_tree.nodes if node.type == "EMISSION")
    glow.inputs["Color"].default_value = (0.2, 1.0, 0.4, 1.0)
    glow.inputs["Strength"].default_value = 6.0
    (sky,) = (node for node in bpy.context.scene.world.node_tree.nodes if node.type == "BACKGROUND")
    sky.inputs["Strength"].default_value = 0.25


def glowing() -> list[float]:
    """What the panel's lightmap material adds of its own."""
    (material,) = (slot.material for slot in bpy.data.objects["Panel"].material_slots)
    (scaled,) = (link.from_node for link in lightmap_node(material).inputs[EMISSION].links)
    color = constant_of(scaled.inputs["Vector"].links[0].from_node.inputs["Color"])
    strength = scaled.inputs["Scale"].links[0].from_socket
    return [component * strength.default_value for component in color.default_value[:3]]


def files(path: Path) -> dict[str, bytes]:
    """What is in a folder, the report without its times."""
    found = [file for file in sorted(path.rglob("*")) if file.is_file() and file.name != REPORT]
    return {str(file.relative_to(path)): file.read_bytes() for file in found}


def test_other_light_gives_what_a_full_bake_gives_in_place(baked: Path) -> None:
    """Measured 0.1 %; instances and what glows among them."""
    assert kept_bakes.find(bpy.context.scene) is None
    before, images = lightmap(), {image.name for image in bpy.data.images}
    shown = {obj.name: obj.data.name for obj in bpy.data.objects if obj.type == "MESH"}
    assert "Instancer/Wall (Lightmap)" in shown
    change_lights()
    assert relight() == {"FINISHED"}
    relit, glow = lightmap(), glowing()
    assert {image.name for image in bpy.data.images} == images
    assert {obj.name: obj.data.name for obj in bpy.data.objects if obj.type == "MESH"} == shown
    assert not bpy.data.images[LIGHTMAP].is_dirty
    report = json.loads((baked / "lightmaps" / REPORT).read_text())
    assert "relit" in report
    # What is told of the light is gone, and the files are still known as ours.
    assert not any("irradiance_W_m2" in entry for entry in report["objects"])
    assert not {"power_W", "estimated_error"} & report["solver"].keys()
    assert all(is_as_written(baked / "lightmaps" / name, told) for name, told in report["files"].items())
    on_disk = bpy.data.images.load(str(baked / "lightmaps" / LIGHTMAP))
    np.testing.assert_array_equal(lightmap(on_disk.name), relit)
    np.testing.assert_allclose(glow, (1.2, 6.0, 2.4), rtol=1e-5)
    assert bake() == {"FINISHED"}
    assert relative(relit, lightmap()) < 0.01
    assert relative(before, lightmap()) > 0.2
    np.testing.assert_allclose(glowing(), glow, rtol=1e-6)


def test_a_bake_is_kept_in_memory_until_restore_or_another_file(baked: Path) -> None:
    (baked / "lightmaps" / SIDECAR).unlink()
    bpy.context.scene.radiosity_relight.sidecar = False
    assert bake() == {"FINISHED"}
    assert not (baked / "lightmaps" / SIDECAR).exists()
    held = kept_bakes.find(bpy.context.scene)
    assert held is not None
    assert held.bake.names == ("Bulb", "Dark", "World", "Glow")
    before = lightmap()
    bpy.data.objects["Bulb"].data.energy *= 2.0
    assert relight() == {"FINISHED"}
    assert lightmap().mean() > 1.1 * before.mean()
    bpy.data.objects["Bulb"].data.energy /= 2.0
    assert relight() == {"FINISHED"}
    assert relative(lightmap(), before) < 1e-3
    assert bpy.ops.radiosity.restore("EXEC_DEFAULT") == {"FINISHED"}
    assert kept_bakes.find(bpy.context.scene) is None
    assert not bpy.ops.radiosity.relight.poll()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert not session.kept_bakes


def test_what_is_not_to_be_kept_is_not(baked: Path) -> None:
    bpy.context.scene.radiosity_relight.keep = bpy.context.scene.radiosity_relight.sidecar = False
    assert bake() == {"FINISHED"}
    assert kept_bakes.find(bpy.context.scene) is None
    assert not bpy.ops.radiosity.relight.poll()


def test_undo_brings_the_earlier_light_back(baked: Path) -> None:
    before = lightmap()
    bpy.ops.ed.undo_push(message="opened")
    change_lights()
    bpy.ops.ed.undo_push(message="lights changed")
    assert bpy.ops.radiosity.relight("EXEC_DEFAULT", True) == {"FINISHED"}
    relit, glow = lightmap(), glowing()
    bpy.ops.ed.undo()
    assert relative(lightmap(), before) < 1e-3
    np.testing.assert_allclose(glowing(), (3.0, 1.8, 0.9), rtol=1e-5)
    bpy.ops.ed.redo()
    np.testing.assert_allclose(lightmap(), relit, rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(glowing(), glow, rtol=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("move", "'Floor'.* moved"),
        ("paint", "'Floor'.* material"),
        ("add", "'More'"),
        ("hide", "'Panel'.* missing"),
        ("move lamp", "'Bulb'.* strength"),
        ("add lamp", "'Sun'.* new"),
    ],
)
def test_what_else_has_changed_is_named_and_nothing_is_written(
    baked: Path, change: str, message: str
) -> None:
    before, pixels = files(baked / "lightmaps"), lightmap()
    if change == "move":
        bpy.data.objects["Floor"].location.z -= 0.01
    elif change == "paint":
        red = shader_material("Red", "ShaderNodeBsdfDiffuse", Color=(0.8, 0.1, 0.1, 1.0))
        bpy.data.objects["Floor"].data.materials[0] = red
    elif change == "add":
        add_mesh("More", location=(0, 0, 3))
    elif change == "hide":
        bpy.data.objects["Panel"].hide_render = True
    elif change == "move lamp":
        bpy.data.objects["Bulb"].location.x += 0.1
    else:
        add_lamp("SUN", "Sun", energy=2.0)
    with pytest.raises(RuntimeError, match=message):
        relight()
    assert files(baked / "lightmaps") == before
    np.testing.assert_array_equal(lightmap(), pixels)


def test_a_hidden_lamp_is_dark(baked: Path) -> None:
    bpy.data.objects["Bulb"].hide_render = True
    assert relight() == {"FINISHED"}
    hidden = lightmap()
    bpy.data.objects["Bulb"].hide_render = False
    bpy.data.objects["Bulb"].data.energy = 0.0
    assert relight() == {"FINISHED"}
    np.testing.assert_allclose(lightmap(), hidden, rtol=1e-3, atol=1e-4)


@pytest.mark.parametrize("wrong", ["incomplete", "damaged", "another bake", "missing", "image"])
def test_sidecars_that_do_not_fit_are_refused(baked: Path, wrong: str) -> None:
    path = baked / "lightmaps" / SIDECAR
    content = path.read_bytes()
    message = f"{SIDECAR}.* {wrong}"
    if wrong == "incomplete":
        path.write_bytes(content[:40])
    elif wrong == "damaged":
        path.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    elif wrong == "another bake":
        kept_bakes.note(bpy.context.scene, "other")
        kept_bakes.mark_images([bpy.data.images[LIGHTMAP]], "other")
        message = "has no sidecar"
    elif wrong == "missing":
        path.unlink()
        message = "has no sidecar"
    else:
        bpy.data.images[LIGHTMAP].scale(16, 16)
        message = "was scaled"
    with pytest.raises(RuntimeError, match=message):
        relight()


def test_packed_lightmaps_are_packed_again() -> None:
    room()
    scene = bpy.context.scene
    scene.radiosity.resolution, scene.radiosity_relight.sidecar = 16, True
    radiosity_addon.register()
    assert bake() == {"FINISHED"}
    image = bpy.data.images["lightmap.exr"]
    before = bytes(image.packed_file.data)
    bpy.data.objects["Bulb"].data.energy *= 3.0
    assert relight() == {"FINISHED"}
    pixels = lightmap()
    assert bytes(image.packed_file.data) != before
    image.reload()
    np.testing.assert_array_equal(lightmap(), pixels)


def test_png_files_get_another_scale_everywhere(tmp_path: Path, folder: Path) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(folder / "plain.blend"))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    bpy.context.scene.radiosity.format, bpy.context.scene.radiosity.resolution = "png16", 16
    assert bake() == {"FINISHED"}
    image = bpy.data.images["room_Scene_lightmap.png"]
    scale, before = image_scale(image), lightmap("room_Scene_lightmap.png")
    for name in ("Bulb", "Dark"):
        bpy.data.objects[name].data.energy *= 2.0
    (glow,) = (node for node in bpy.data.materials["Glow"].node_tree.nodes if node.type == "EMISSION")
    glow.inputs["Strength"].default_value *= 2.0
    bpy.context.scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value *= 2.0
    assert relight() == {"FINISHED"}
    assert image_scale(image) == pytest.approx(2.0 * scale, rel=1e-3)
    assert relative(lightmap("room_Scene_lightmap.png"), before) < 1e-3
    inputs = [
        node.inputs[SCALE].default_value
        for material in bpy.data.materials
        if is_made(material)
        for node in material.node_tree.nodes
        if is_lightmap_node(node)
    ]
    np.testing.assert_allclose(inputs, image_scale(image), rtol=1e-5)
    report = json.loads((tmp_path / "lightmaps" / "room_Scene_report.json").read_text())
    assert {entry["scale"] for entry in report["objects"]} == {image_scale(image)}


def test_the_command_line_keeps_and_relights(folder: Path, tmp_path: Path) -> None:
    output = tmp_path / "out"
    plain = changed = tmp_path / "plain.blend"
    shutil.copy(folder / "plain.blend", plain)
    settings = ["--resolution", "32", "--quality", "sketch", "--quiet"]
    assert main(["bake", str(plain), "--output", str(output), "--keep", *settings]) == 0
    sidecar = output / "lightmap.relight"
    kept, picture = sidecar.read_bytes(), (output / "preview.png").read_bytes()
    bpy.ops.wm.open_mainfile(filepath=str(plain))
    change_lights()
    bpy.ops.wm.save_mainfile()
    relit = ["bake", str(changed), "--output", str(output), "--relight", "--quiet"]
    assert main([*relit, "--quality", "high"]) == 2
    assert main(relit) == 0
    assert sidecar.read_bytes() == kept
    assert (output / "preview.png").read_bytes() != picture
    report = json.loads((output / "report.json").read_text())
    assert {entry["object"] for entry in report["objects"]} == {"Floor", "Panel", "Instancer/Wall"}
    full = tmp_path / "full"
    assert main(["bake", str(changed), "--output", str(full), *settings]) == 0
    pages = [bpy.data.images.load(str(where / "lightmap.exr")).name for where in (output, full)]
    assert relative(*map(lightmap, pages)) < 0.01
    # What it wrote can be lit anew itself, from the panel: the sidecar lies beside it.
    bpy.ops.wm.open_mainfile(filepath=str(output / "baked.blend"))
    bpy.data.objects["Bulb"].data.energy *= 2.0
    assert relight() == {"FINISHED"}
    assert main(["bake", str(output / "baked.blend"), "--output", str(output), "--relight"]) == 2
    sidecar.unlink()
    assert main(relit) == 1


def test_a_sidecar_that_a_later_bake_left_over_is_refused(folder: Path, tmp_path: Path) -> None:
    """It put the earlier bake over the later one."""
    output, plain = tmp_path / "out", str(folder / "plain.blend")
    settings = ["--resolution", "16", "--quality", "sketch", "--quiet"]
    assert main(["bake", plain, "--output", str(output), "--keep", *settings]) == 0
    assert main(["bake", plain, "--output", str(output), "--relight", "--quiet"]) == 0
    assert main(["bake", plain, "--output", str(output), *settings]) == 0
    before = {path.name: path.read_bytes() for path in output.iterdir()}
    assert main(["bake", plain, "--output", str(output), "--relight", "--quiet"]) == 1
    assert {path.name: path.read_bytes() for path in output.iterdir()} == before


def test_sliders_are_found_for_every_light(baked: Path) -> None:
    scene = bpy.context.scene
    values = {
        name: [getattr(*slot) for slot in (inputs_of(scene, name, emits).strength,)]
        for name, emits in (("Bulb", False), ("World", False), ("Glow", True))
    }
    assert values == {"Bulb": [40.0], "World": [1.0], "Glow": [3.0]}
    assert inputs_of(scene, "Nothing", emits=False) is None


@pytest.mark.parametrize("where", ["outside", "no report", "not listed", "changed", "another scene"])
def test_relight_writes_no_file_that_its_report_does_not_list(baked: Path, where: str) -> None:
    """Wherever the image of a received file points."""
    assert bake() == {"FINISHED"}  # now it is in memory, too
    image = bpy.data.images[LIGHTMAP]
    listed = baked / "lightmaps" / LIGHTMAP
    victim = {
        "outside": baked / "texture.exr",
        "no report": baked / "pictures" / LIGHTMAP,
        "not listed": baked / "lightmaps" / "texture.exr",
    }.get(where, listed)
    if victim != listed:
        victim.parent.mkdir(exist_ok=True)
        shutil.copy(listed, victim)
        image.filepath_raw = str(victim)
    elif where == "changed":
        listed.write_bytes(listed.read_bytes() + b"\0")
    else:
        bpy.context.scene.name = "Other"
    bpy.data.objects["Bulb"].data.energy *= 2.0
    before, pixels = files(baked), lightmap()
    with pytest.raises(RuntimeError, match=victim.name):
        relight()
    assert files(baked) == before
    np.testing.assert_array_equal(lightmap(), pixels)


def test_another_file_that_shows_the_same_lightmaps_does_not_rewrite_them(baked: Path) -> None:
    """As *Save As* makes one: the first file still shows them."""
    bpy.ops.wm.save_as_mainfile(filepath=str(baked / "second.blend"))
    before = files(baked)
    with pytest.raises(RuntimeError, match="bake again"):
        relight()
    assert files(baked) == before
    assert bake() == {"FINISHED"}
    bpy.data.objects["Bulb"].data.energy *= 2.0
    assert relight() == {"FINISHED"}
    after = files(baked)
    assert {"second_Scene_lightmap.exr", "second_Scene_lightmap.relight"} <= {
        Path(name).name for name in after
    }
    assert {name: after[name] for name in before if not name.endswith(".blend")} == {
        name: held for name, held in before.items() if not name.endswith(".blend")
    }
