"""Exports by the command line: their files, whose they are, and what is refused."""

from __future__ import annotations

import json
import shutil
import struct
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.images.light_mixer import mixers, sliders_of
from radiosity_addon.exports import Glb, decode_rgbm, read_half_exr, read_ktx2
from radiosity_addon.files import is_outdated, lightmap_digests

from .conftest import QUICK, Baked, read_pixels, read_report, save

Run = Callable[..., object]

GLB = {"scene.glb", "scene_baked.glb", "lightmap.exr", "lightmap.ktx2", "lightmaps.json", "report.json"}
BASE = GLB - {"scene_baked.glb"}
"""What every form has."""


def files_in(folder: Path) -> dict[str, bytes]:
    """Return the files in a folder and its folders."""
    paths = [path for path in folder.rglob("*") if path.is_file()]
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


@pytest.fixture
def folder(baked: Baked, tmp_path: Path) -> Path:
    """A bake's folder, to be changed."""
    return Path(shutil.copytree(baked.folder, tmp_path / "out"))


def test_each_form_makes_its_files(run: Run, folder: Path) -> None:
    scripts = {"godot/radiosity_lightmaps.gd", "unity/RadiosityLightmaps.cs", "bevy/radiosity_lightmaps.rs"}
    for forms, files in (
        ("glb", GLB),
        ("web", GLB | {"viewer.html", "three-lightmap.js"}),
        ("godot,unity,bevy", BASE | scripts),
        ("rgbm", BASE | {"lightmap_rgbm.png"}),
    ):
        shutil.rmtree(folder / "export", ignore_errors=True)
        done = run("export", folder, "--forms", forms)
        assert (done.code, done.err) == (0, "")
        assert set(files_in(folder / "export")) == files
        assert set(read_report(folder / "export")["files"]) == files - {"report.json"}
        assert all(f"  {name}\n" in done.out for name in files - {"report.json"})


def test_the_lightmap_is_that_of_the_bake(run: Run, folder: Path) -> None:
    assert run("export", folder, "--forms", "glb", "--quiet").code == 0
    exact = read_pixels(folder / "lightmap.exr")[..., :3]
    exr = read_half_exr((folder / "export" / "lightmap.exr").read_bytes())
    np.testing.assert_allclose(exr, exact, rtol=2**-11, atol=2**-25)
    ktx2 = read_ktx2((folder / "export" / "lightmap.ktx2").read_bytes())
    assert (np.abs(ktx2 - exact).max(axis=-1) <= exact.max(axis=-1) / 512 + 1e-12).all()


def test_rgbm_is_the_lightmap_too(run: Run, folder: Path) -> None:
    assert run("export", folder, "--forms", "rgbm", "--quiet").code == 0
    index = json.loads((folder / "export" / "lightmaps.json").read_text(encoding="utf-8"))
    (page,) = index["pages"]
    assert page["rgbm"] == "lightmap_rgbm.png"
    assert "rgbm_range" in index["encodings"]["rgbm"]
    image = bpy.data.images.load(str(folder / "export" / page["rgbm"]))
    image.colorspace_settings.name, image.alpha_mode = "Non-Color", "CHANNEL_PACKED"
    pixels = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(pixels)
    encoded = np.rint(255.0 * pixels).reshape(page["height"], page["width"], 4)
    found = decode_rgbm(encoded, page["rgbm_range"])
    exact = read_pixels(folder / "lightmap.exr")[..., :3]
    brightest = np.maximum(exact.max(axis=-1), page["rgbm_range"] / 255)
    assert (np.abs(found - exact).max(axis=-1) <= brightest / 255 * 1.0001).all()

    assert run("export", folder, "--forms", "glb", "--quiet").code == 0
    index = json.loads((folder / "export" / "lightmaps.json").read_text(encoding="utf-8"))
    assert "rgbm" not in json.dumps(index)


def test_the_same_bake_gives_the_same_export(run: Run, folder: Path) -> None:
    assert run("export", folder, "--forms", "web", "--quiet").code == 0
    first = files_in(folder / "export")
    assert run("export", folder, "--forms", "web", "--quiet").code == 0
    assert files_in(folder / "export") == first


def test_the_scene_is_as_engines_want_it(run: Run, folder: Path) -> None:
    assert run("export", folder, "--forms", "glb", "--quiet").code == 0
    glb = Glb.of_bytes((folder / "export" / "scene.glb").read_bytes())
    index = json.loads((folder / "export" / "lightmaps.json").read_text(encoding="utf-8"))
    named = {node["name"]: node for node in glb.json["nodes"]}
    assert {entry["node"] for entry in index["nodes"]} == {"Floor", "Wall", "Cube"} <= set(named)
    assert index["baked_lights"] == ["Lamp"]
    assert "KHR_lights_punctual" not in json.dumps(glb.json)
    assert "radiosity" not in json.dumps(glb.json)
    for entry in index["nodes"]:
        for primitive in glb.json["meshes"][named[entry["node"]]["mesh"]]["primitives"]:
            sets = sorted(name for name in primitive["attributes"] if name.startswith("TEXCOORD"))
            assert sets == [f"TEXCOORD_{number}" for number in range(len(sets))]
            assert len(sets) >= 2
            material = glb.json["materials"][primitive["material"]]
            assert material["extensions"]["MOZ_lightmap"]["texCoord"] == 1
    red = next(each for each in glb.json["materials"] if each["name"] == "Red")
    np.testing.assert_allclose(red["pbrMetallicRoughness"]["baseColorFactor"], (0.8, 0.1, 0.1, 1), atol=1e-6)


def test_a_bake_exports_at_once_with_room_for_filters(run: Run, room: Path, tmp_path: Path) -> None:
    done = run("bake", room, "--output", tmp_path / "out", *QUICK, "--export", "glb")
    assert (done.code, done.err) == (0, "")
    assert set(files_in(tmp_path / "out" / "export")) == GLB
    assert "texels apart" not in done.out
    done = run("bake", room, "--output", tmp_path / "out", *QUICK)
    assert done.code == 0
    assert "older than the lightmaps" in done.out
    done = run("export", tmp_path / "out", "--forms", "glb")
    assert done.code == 0
    assert "2 texels apart" in done.out


def test_what_another_form_leaves_of_earlier_lightmaps_is_named(run: Run, room: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run("bake", room, "--output", out, *QUICK, "--export", "web").code == 0
    other = run("export", out, "--forms", "godot").out
    assert "earlier lightmaps" not in other
    assert "note: viewer.html stays as an earlier export wrote it" in other
    assert (
        run("bake", room, "--output", out, *QUICK, "--seed", "1", "--export", "web,rgbm", "--quiet").code == 0
    )
    done = run("bake", room, "--output", out, *QUICK, "--padding", "4", "--export", "godot")
    for name in ("scene_baked.glb", "viewer.html", "lightmap_rgbm.png"):
        assert f"note: {name} is of earlier lightmaps" in done.out
    done = run("export", out, "--forms", "godot")
    assert "note: viewer.html is of earlier lightmaps" in done.out
    assert is_outdated_export(out)
    done = run("export", out, "--forms", "web,rgbm")
    assert "earlier" not in done.out
    assert not is_outdated_export(out)


def is_outdated_export(folder: Path) -> bool:
    """Return whether the export next to a bake is of earlier lightmaps."""
    exported, baked = read_report(folder / "export"), read_report(folder)
    return is_outdated(exported, folder / "export", lightmap_digests(baked))


def test_a_relight_makes_an_export_outdated(run: Run, room: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run("bake", room, "--output", out, *QUICK, "--keep", "--export", "glb").code == 0
    bpy.ops.wm.open_mainfile(filepath=str(room))
    bpy.data.lights["Lamp"].energy = 50.0
    save(room)
    done = run("bake", room, "--output", out, "--relight", "--no-preview")
    assert done.code == 0
    place = out / "export"
    words = f"export {out} --forms glb"
    assert f"warning: the export in {place} is older than the lightmaps: run {words}\n" in done.out
    assert run("bake", room, "--output", out, "--relight", "--export", "glb", "--quiet").code == 0
    assert not is_outdated_export(out)


def test_files_of_others_are_never_replaced(run: Run, folder: Path) -> None:
    (folder / "export").mkdir()
    (folder / "export" / "viewer.html").write_text("mine")
    done = run("export", folder)
    assert done.code == 1
    assert str(folder / "export" / "viewer.html") in done.err
    assert set(files_in(folder / "export")) == {"viewer.html"}
    assert run("export", folder, "--overwrite").code == 0


def test_a_folder_that_is_a_link_is_not_written_into(run: Run, folder: Path, tmp_path: Path) -> None:
    (folder / "export").mkdir()
    (tmp_path / "elsewhere").mkdir()
    (folder / "export" / "godot").symlink_to(tmp_path / "elsewhere")
    done = run("export", folder, "--forms", "godot", "--overwrite")
    assert done.code == 1
    assert "godot" in done.err
    assert not any((tmp_path / "elsewhere").iterdir())
    assert not files_in(folder / "export")


def changed(folder: Path) -> None:
    with (folder / "lightmap.exr").open("ab") as file:
        file.write(b"x")


@pytest.mark.parametrize(
    ("damage", "named"),
    [
        (lambda folder: (folder / "lightmap.exr").unlink(), "lightmap.exr"),
        (lambda folder: (folder / "baked.blend").unlink(), "baked.blend"),
        (lambda folder: (folder / "report.json").unlink(), "report.json"),
        (changed, "lightmap.exr"),
        (lambda folder: shutil.rmtree(folder), "out"),
    ],
)
def test_a_bake_that_is_gone_or_changed_is_refused(
    run: Run, folder: Path, damage: Callable[[Path], None], named: str
) -> None:
    assert run("export", folder, "--forms", "glb", "--quiet").code == 0
    before = files_in(folder / "export")
    damage(folder)
    done = run("export", folder, "--forms", "glb")
    assert done.code in (1, 2)
    assert done.err.count("\n") == 1
    assert named in done.err
    assert not (folder / "export").exists() or files_in(folder / "export") == before


def test_unknown_forms_are_refused(run: Run, folder: Path) -> None:
    for forms in ("unreal", "web,unreal", ""):
        done = run("export", folder, "--forms", forms)
        assert done.code == 2
        assert "godot" in done.err
    assert not (folder / "export").exists()


def test_a_quantity_that_engines_cannot_use_is_refused(run: Run, room: Path, tmp_path: Path) -> None:
    done = run(
        "bake", room, "--output", tmp_path / "out", *QUICK, "--quantity", "radiosity", "--export", "glb"
    )
    assert done.code == 1
    assert "irradiance" in done.err
    assert not (tmp_path / "out" / "export").exists()


def test_light_groups_are_mixed_and_exported_apart(run: Run, room: Path, tmp_path: Path) -> None:
    words = ("--light-group", "Kitchen=Lamp", "--export", "web")
    done = run("bake", room, "--output", tmp_path / "out", *QUICK, *words)
    assert (done.code, done.err) == (0, "")
    folder = tmp_path / "out" / "export"
    index = json.loads((folder / "lightmaps.json").read_text(encoding="utf-8"))
    groups = {group["name"]: group for group in index["light_groups"]}
    assert groups["Kitchen"]["factor"] == [1.0, 1.0, 1.0]
    images = [read_half_exr((folder / group["pages"][0]["exr"]).read_bytes()) for group in groups.values()]
    total = read_half_exr((folder / index["pages"][0]["exr"]).read_bytes())
    np.testing.assert_allclose(sum(images), total, rtol=2e-3, atol=1e-5)


def test_light_groups_are_exported_as_the_sliders_of_the_baked_file_stand(
    run: Run, room: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    words = ("--light-group", "Kitchen=Lamp", "--export", "web", "--sum-groups")
    assert run("bake", room, "--output", out, *QUICK, *words).code == 0
    index = json.loads((out / "export" / "lightmaps.json").read_text(encoding="utf-8"))
    assert index["light_groups"] == []
    assert "lightmap_Kitchen.ktx2" not in files_in(out / "export")
    whole = read_half_exr((out / "export" / "lightmap.exr").read_bytes())

    bpy.ops.wm.open_mainfile(filepath=str(out / "baked.blend"))
    (mixer,) = mixers()
    (sliders,) = [each for each in sliders_of(mixer) if each.name == "Kitchen"]
    sliders.strength.default_value, sliders.color.default_value = 2.0, (1.0, 0.5, 0.25, 1.0)
    save(out / "baked.blend")
    done = run("export", out, "--forms", "glb", "--sum-groups")
    assert (done.code, done.err) == (0, "")
    assert "note: baked.blend was changed since it was baked: it is exported as it is" in done.out
    mixed = read_half_exr((out / "export" / "lightmap.exr").read_bytes())
    np.testing.assert_allclose(mixed, whole * (2.0, 1.0, 0.5), rtol=2e-3, atol=1e-5)

    assert run("export", out, "--forms", "glb").code == 0
    index = json.loads((out / "export" / "lightmaps.json").read_text(encoding="utf-8"))
    (kitchen,) = [group for group in index["light_groups"] if group["name"] == "Kitchen"]
    assert kitchen["factor"] == [2.0, 1.0, 0.5]
    own = read_half_exr((out / "export" / kitchen["pages"][0]["exr"]).read_bytes())
    np.testing.assert_allclose(own, whole, rtol=2e-3, atol=1e-5)


def test_an_exported_scene_shows_its_lightmap_in_an_empty_blender(run: Run, folder: Path) -> None:
    assert run("export", folder, "--forms", "glb", "--quiet").code == 0
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(folder / "export" / "scene_baked.glb"))
    lit = [each for each in bpy.data.materials if each.node_tree]
    emitted = [
        node.inputs["Emission Color"].links[0].from_node
        for each in lit
        for node in each.node_tree.nodes
        if node.type == "BSDF_PRINCIPLED" and node.inputs["Emission Color"].is_linked
    ]
    assert len(emitted) == len(lit) > 0


def test_the_binary_files_have_the_lengths_they_say(run: Run, folder: Path) -> None:
    assert run("export", folder, "--forms", "glb", "--quiet").code == 0
    for name in ("scene.glb", "scene_baked.glb"):
        data = (folder / "export" / name).read_bytes()
        assert struct.unpack_from("<4sII", data) == (b"glTF", 2, len(data))


def test_what_was_edited_since_the_bake_is_named(run: Run, folder: Path) -> None:
    def said() -> list[str]:
        done = run("export", folder, "--forms", "glb")
        assert done.code == 0
        return [line for line in done.out.splitlines() if line.startswith("note: ")]

    assert not [note for note in said() if "since" in note]
    bpy.ops.wm.open_mainfile(filepath=str(folder / "baked.blend"))
    bpy.context.scene["mine"] = 1  # nothing that light depends on
    save(folder / "baked.blend")
    assert [note for note in said() if "since" in note] == [
        "note: baked.blend was changed since it was baked: it is exported as it is"
    ]
    bpy.ops.wm.open_mainfile(filepath=str(folder / "baked.blend"))
    bpy.data.objects["Cube"].location.x += 0.5
    tree = bpy.data.materials["Red"].node_tree
    shader = next(node for node in tree.nodes if node.type.startswith("BSDF"))
    shader.inputs[0].default_value = (0.1, 0.2, 0.8, 1.0)
    bpy.data.meshes["Floor"].vertices[0].co.z += 0.3
    save(folder / "baked.blend")
    (note,) = [note for note in said() if "since the last bake" in note]
    assert note == (
        "note: changed since the last bake: 'Floor', 'Wall', 'Cube'; "
        "the lightmaps show their light of before: bake again"
    )
    bpy.ops.wm.open_mainfile(filepath=str(folder / "baked.blend"))
    bpy.data.objects.remove(bpy.data.objects["Wall"])
    save(folder / "baked.blend")
    (note,) = [note for note in said() if "since the last bake" in note]
    assert note.startswith(
        "note: removed since the last bake: 'Wall'; changed since the last bake: 'Floor', 'Cube'; "
    )
