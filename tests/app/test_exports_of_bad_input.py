"""Attacks on exports: what is gone, in the way, too large, too many; one line each, nothing half written."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.command_line.outdated_exports import warn_of_outdated
from radiosity_addon.blender.exporting import export, exported_lightmaps
from radiosity_addon.blender.exporting.export_scene import PREFIX, TEMPORARY
from radiosity_addon.cli import Console
from radiosity_addon.exports import Glb, read_half_exr
from radiosity_addon.files import sealed, text_of
from tests.reliability.full_disk import can_mount

from .conftest import QUICK, ROOT, Baked, add_lamp, add_quad, painted, read_pixels, save
from .test_exports import files_in

Run = Callable[..., Any]


@pytest.fixture
def folder(baked: Baked, tmp_path: Path) -> Path:
    """A bake's folder, to be changed."""
    return Path(shutil.copytree(baked.folder, tmp_path / "out"))


def refused(done: Any, *named: object) -> None:
    """One line, which names these, and nothing that is gone when it is read."""
    assert done.code in (1, 2)
    assert done.err.count("\n") == 1, done.err
    assert "internal error" not in done.err
    assert ".radiosity-" not in done.err
    for name in named:
        assert str(name) in done.err


def squares(names: Sequence[str]) -> None:
    for number, name in enumerate(names):
        x = 1.5 * number
        add_quad(name, ((x, 0, 0), (x + 1, 0, 0), (x + 1, 1, 0), (x, 1, 0)))


def test_a_baked_file_that_is_damaged_is_refused(run: Run, folder: Path) -> None:
    path = folder / "baked.blend"
    path.write_bytes(path.read_bytes()[:1000])
    refused(run("export", folder, "--forms", "glb"), path)
    assert not (folder / "export").exists()


def test_names_that_differ_in_case_alone_give_files_of_their_own(run: Run, tmp_path: Path) -> None:
    squares(("Tree", "tree", "TREE"))
    for name in ("Lamp", "lamp", "2"):
        add_lamp()
        bpy.context.scene.collection.objects[-1].name = name
    scene, out = save(tmp_path / "trees.blend"), tmp_path / "out"
    groups = [word for pair in ("Day=Lamp", "day=lamp", "2=2") for word in ("--light-group", pair)]
    done = run("bake", scene, "--output", out, *QUICK, "--atlas", "per-object", *groups, "--export", "web")
    assert (done.code, done.err) == (0, "")
    files = files_in(out / "export")
    assert len({name.casefold() for name in files}) == len(files)
    index = json.loads(files["lightmaps.json"])
    assert {entry["node"]: entry["page"] for entry in index["nodes"]} == {"Tree": 0, "tree": 1, "TREE": 2}
    assert [group["name"] for group in index["light_groups"]] == ["Day", "day", "2"]
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    baked = {group["group"]: [page["image"] for page in group["pages"]] for group in report["light_groups"]}
    for group in index["light_groups"]:
        for page, image in zip(group["pages"], baked[group["name"]], strict=True):
            exact = read_pixels(out / image)
            np.testing.assert_allclose(read_half_exr(files[page["exr"]]), exact, rtol=2**-11, atol=2**-25)


def test_a_hundred_pages_are_exported(run: Run, tmp_path: Path) -> None:
    names = [f"Square {number}" for number in range(100)]
    squares(names)
    bpy.context.scene.world = bpy.data.worlds.new("Sky")
    scene, out = save(tmp_path / "squares.blend"), tmp_path / "out"
    words = ("--resolution", "8", "--quality", "sketch", "--no-preview", "--atlas", "per-object")
    done = run("bake", scene, "--output", out, *words, "--export", "glb")
    assert (done.code, done.err) == (0, "")
    files = files_in(out / "export")
    index = json.loads(files["lightmaps.json"])
    glb = Glb.of_bytes(files["scene.glb"])
    page_of = {entry["node"]: entry["page"] for entry in index["nodes"]}
    assert sorted(page_of) == sorted(names)
    assert sorted(page_of.values()) == list(range(100))
    for node in glb.json["nodes"]:
        (primitive,) = glb.json["meshes"][node["mesh"]]["primitives"]
        texture = glb.json["materials"][primitive["material"]]["extensions"]["MOZ_lightmap"]["index"]
        uri = glb.json["images"][glb.json["textures"][texture]["source"]]["uri"]
        assert uri == index["pages"][page_of[node["name"]]]["ktx2"]
        assert uri in files


@pytest.mark.parametrize("form", ["glb", "web,godot,unity,bevy"])
def test_no_file_of_others_is_replaced(run: Run, folder: Path, form: str) -> None:
    assert run("export", folder, "--forms", form, "--quiet").code == 0
    names = sorted(files_in(folder / "export"))
    for name in names:
        shutil.rmtree(folder / "export")
        path = folder / "export" / name
        path.parent.mkdir(parents=True)
        path.write_text("mine")
        refused(run("export", folder, "--forms", form), path)
        assert files_in(folder / "export") == {name: b"mine"}


def test_a_file_that_was_changed_since_is_not_replaced(run: Run, folder: Path) -> None:
    assert run("export", folder, "--forms", "glb", "--quiet").code == 0
    with (folder / "export" / "scene.glb").open("ab") as file:
        file.write(b"mine")
    before = files_in(folder / "export")
    refused(run("export", folder, "--forms", "glb"), folder / "export" / "scene.glb")
    assert files_in(folder / "export") == before


def test_a_report_of_somebody_else_proves_nothing(run: Run, folder: Path) -> None:
    assert run("export", folder, "--forms", "glb", "--quiet").code == 0
    path = folder / "export" / "report.json"
    report = json.loads(path.read_text(encoding="utf-8"))
    report["baked"] = {"file": "../other.blend", "scene": "Scene"}
    path.write_text(text_of(sealed(report)), encoding="utf-8")
    before = files_in(folder / "export")
    refused(run("export", folder, "--forms", "glb"), path)
    assert files_in(folder / "export") == before


def test_a_place_that_is_no_folder_is_refused(run: Run, folder: Path) -> None:
    (folder / "export").write_text("mine")
    refused(run("export", folder), folder / "export")
    assert (folder / "export").read_text() == "mine"


@pytest.mark.parametrize("name", ["scene.glb", "lightmap.exr", "lightmaps.json", "report.json"])
def test_a_folder_in_the_place_of_a_file_is_refused(run: Run, folder: Path, name: str) -> None:
    (folder / "export" / name).mkdir(parents=True)
    (folder / "export" / name / "mine.txt").write_text("mine")
    refused(run("export", folder, "--forms", "godot", "--overwrite"), folder / "export" / name)
    assert files_in(folder / "export") == {f"{name}/mine.txt": b"mine"}


@pytest.mark.parametrize("words", [(), ("--overwrite", "--quantity", "radiosity")])
def test_an_export_that_would_be_refused_stops_the_bake_before_it_starts(
    run: Run, room: Path, tmp_path: Path, words: tuple[str, ...]
) -> None:
    out = tmp_path / "out"
    (out / "export").mkdir(parents=True)
    (out / "export" / "scene.glb").write_text("mine")
    done = run("bake", room, "--output", out, *QUICK, "--export", "glb", *words)
    refused(done, "radiosity" if words else out / "export" / "scene.glb")
    assert files_in(out) == {"export/scene.glb": b"mine"}


@pytest.mark.parametrize("key", ["export", "lightmaps", "files"])
@pytest.mark.parametrize("value", [None, 5, [5], {"a": 5}, "web", ["../../x"]])
def test_nonsense_in_an_export_s_report_does_no_harm(run: Run, folder: Path, key: str, value: object) -> None:
    assert run("export", folder, "--forms", "glb", "--quiet").code == 0
    path = folder / "export" / "report.json"
    report = json.loads(path.read_text(encoding="utf-8"))
    report["lightmaps"] = {}
    report[key] = value
    path.write_text(text_of(sealed(report)), encoding="utf-8")
    before = files_in(folder / "export")
    warn_of_outdated(folder, Console(quiet=True))
    done = run("export", folder, "--forms", "glb")
    if done.code:
        refused(done, folder / "export")
        assert files_in(folder / "export") == before


def test_an_image_that_is_missing_is_named_and_its_default_exported_as_baked(
    run: Run, tmp_path: Path
) -> None:
    squares(("Square",))
    add_lamp()
    image = bpy.data.images.new("Bricks", 4, 4)
    image.filepath_raw, image.file_format = str(tmp_path / "bricks.png"), "PNG"
    image.save()
    material = painted("Bricks", (0.2, 0.4, 0.6, 1))
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    shader = next(each for each in material.node_tree.nodes if each.type == "BSDF_PRINCIPLED")
    material.node_tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    bpy.data.objects["Square"].data.materials.append(material)
    scene, out = save(tmp_path / "square.blend"), tmp_path / "out"
    (tmp_path / "bricks.png").unlink()
    done = run("bake", scene, "--output", out, *QUICK, "--export", "glb")
    assert (done.code, done.err) == (0, "")
    assert "note: material 'Bricks': Base Color comes from image 'Bricks'" in done.out
    glb = Glb.of_bytes((out / "export" / "scene.glb").read_bytes())
    (exported,) = glb.json["materials"]
    np.testing.assert_allclose(
        exported["pbrMetallicRoughness"]["baseColorFactor"], (0.2, 0.4, 0.6, 1), atol=1e-6
    )
    assert "baseColorTexture" not in exported["pbrMetallicRoughness"]


@pytest.mark.parametrize(
    ("module", "step"),
    [(exported_lightmaps, "write_ktx2"), (export, "emissive_only"), (export, "viewer_page")],
)
def test_an_export_that_is_interrupted_changes_nothing(
    run: Run, folder: Path, module: ModuleType, step: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run("export", folder, "--forms", "web", "--quiet").code == 0
    before = files_in(folder)

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(module, step, interrupt)
    done = run("export", folder, "--forms", "web")
    assert (done.code, done.err) == (130, "error: interrupted; nothing was written\n")
    assert files_in(folder) == before
    assert not [block.name for block in bpy.data.scenes if block.get(TEMPORARY) is not None]
    assert not [block.name for block in bpy.data.objects if block.name.startswith(PREFIX)]


NEEDS_MOUNTS = pytest.mark.skipif(not can_mount(), reason="file systems cannot be mounted here")

ON_A_DISK = """
set -e
folder=$1 earlier=$2 kept=$3 free=$4
shift 4
mount -t tmpfs -o size=8m tmpfs "$folder/export"
cp -r "$earlier/." "$folder/export/"
if [ "$free" = read-only ]; then
    mount -o remount,ro "$folder/export"
else
    head -c $(( $(stat -f -c '%a * %S' "$folder/export") - free )) /dev/zero > "$folder/export/filler"
fi
code=0
"$@" || code=$?
cp -r "$folder/export" "$kept"
rm -f "$kept/filler"
exit $code
"""
"""Run a command while the folder `export` is a small disk with earlier files, and little of it is free."""


@NEEDS_MOUNTS
@pytest.mark.parametrize("free", ["read-only", 0.0, 0.2, 0.5, 0.9])
def test_a_disk_that_is_full_or_read_only(run: Run, folder: Path, tmp_path: Path, free: str | float) -> None:
    assert run("export", folder, "--forms", "glb", "--quiet").code == 0
    before = files_in(folder / "export")
    earlier, kept = Path(shutil.copytree(folder / "export", tmp_path / "earlier")), tmp_path / "kept"
    size = sum(map(len, before.values()))
    room = free if isinstance(free, str) else str(int(free * size))
    command = ["unshare", "-m", "--propagation", "private", "sh", "-c", ON_A_DISK, "sh"]
    command += [str(folder), str(earlier), str(kept), room]
    command += [sys.executable, "-m", "radiosity_addon", "export", str(folder), "--forms", "glb"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1, done.stderr
    assert done.stderr.count("\n") == 1, done.stderr
    assert str(folder / "export") in done.stderr
    assert not any(word in done.stderr for word in (".radiosity-", "Traceback", "internal error"))
    assert files_in(kept) == before
