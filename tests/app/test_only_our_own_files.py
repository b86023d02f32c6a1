"""The command line replaces only what an earlier bake of the same scene has written."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
import pytest

from .conftest import QUICK, add_lamp, add_quad, build_room, digest, read_report, save

Run = Callable[..., object]
TINY = ("--resolution", "16", "--quality", "sketch")

posix = pytest.mark.skipif(os.name == "nt", reason="links and devices of POSIX")


def build_small() -> None:
    add_quad("Floor", ((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)))
    add_lamp()
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = 16, 12


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A scene that is quick to bake and to preview."""
    build_small()
    return save(tmp_path / "scene" / "small.blend")


def files(folder: Path) -> dict[str, str]:
    """All files below a folder, hidden ones too."""
    return {
        str(path.relative_to(folder)): "link" if path.is_symlink() else path.read_bytes().hex()
        for path in folder.rglob("*")
        if not path.is_dir()
    }


@contextmanager
def nothing_changed(folder: Path) -> Iterator[None]:
    before = files(folder)
    yield
    assert files(folder) == before


def refused(done: object, *names: object, code: int = 1) -> None:
    """It ended in one line that names these, before the work."""
    assert done.code == code, done.err
    assert done.err.startswith("error: ")
    assert done.err.count("\n") == 1
    assert "solve" not in done.out
    for name in names:
        assert str(name) in done.err


# --- the bake's own names ---


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("lightmap.exr", ()),
        ("lightmap.png", ("--format", "png16")),
        ("lightmap_2.exr", ("--pages", "2")),
        ("Floor.exr", ("--atlas", "per-object")),
        ("lightmap_Day.exr", ("--light-group", "Day=Lamp")),
        ("preview.png", ()),
        ("report.json", ()),
        ("baked.blend", ()),
        ("lightmap.relight", ("--keep",)),
    ],
)
def test_a_foreign_file_is_refused_before_the_work(
    name: str, words: tuple[str, ...], run: Run, small: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / name).write_text("years of work")
    with nothing_changed(tmp_path):
        refused(run("bake", small, "--output", out, *TINY, *words), out / name, "--overwrite")
    if name in ("lightmap.exr", "report.json"):
        assert run("bake", small, "--output", out, *TINY, *words, "--overwrite").code == 0
        assert run("bake", small, "--output", out, *TINY, *words).code == 0


def test_a_result_that_somebody_worked_on_is_refused(run: Run, small: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run("bake", small, "--output", out, *TINY).code == 0
    bpy.ops.wm.open_mainfile(filepath=str(out / "baked.blend"))
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.wm.save_mainfile()
    (out / "baked.blend1").unlink(missing_ok=True)
    with nothing_changed(tmp_path):
        refused(run("bake", small, "--output", out, *TINY), out / "baked.blend", "changed")


def test_two_files_and_two_scenes_do_not_share_a_folder(run: Run, tmp_path: Path) -> None:
    build_small()
    one = save(tmp_path / "one.blend")
    two = tmp_path / "two.blend"
    shutil.copy(one, two)
    bpy.ops.wm.open_mainfile(filepath=str(one))
    bpy.context.scene.name = "Other"
    (tmp_path / "copy").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "copy" / "one.blend"))
    out = tmp_path / "out"
    assert run("bake", one, "--output", out, *TINY).code == 0
    with nothing_changed(out):
        refused(run("bake", two, "--output", out, *TINY), out / "report.json", "one.blend")
        # The same file, with another scene on top.
        shutil.copy(tmp_path / "copy" / "one.blend", one)
        refused(run("bake", one, "--output", out, *TINY), out / "report.json", "'Scene'")
    # A project that was moved as a whole goes on.
    shutil.copy(two, one)
    (tmp_path / "moved").mkdir()
    for path in (one, out):
        shutil.move(path, tmp_path / "moved" / path.name)
    assert (
        run("bake", tmp_path / "moved" / "one.blend", "--output", tmp_path / "moved" / "out", *TINY).code == 0
    )


def test_the_scene_s_own_textures_and_libraries_are_never_replaced(run: Run, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    picture = bpy.data.images.new("Picture", 2, 2, float_buffer=True)
    picture.filepath_raw, picture.file_format = str(out / "Floor.exr"), "OPEN_EXR"
    picture.save()
    build_small()
    library = save(out / "baked.blend")
    build_small()
    with bpy.data.libraries.load(str(library), link=True) as (_found, linked):
        linked.objects = ["Floor"]
    bpy.context.scene.collection.objects.link(linked.objects[0])
    bpy.data.images.load(str(out / "Floor.exr")).use_fake_user = True
    scene = save(tmp_path / "reads.blend")
    with nothing_changed(tmp_path):
        words = ("bake", scene, "--output", out, *TINY, "--overwrite", "--atlas", "per-object")
        refused(run(*words), out / "baked.blend", "reads")
    library.unlink()
    with nothing_changed(out):
        refused(run(*words), out / "Floor.exr", "reads")


def save_gltf(folder: Path) -> Path:
    """Write a textured quad as a .gltf with a buffer and an image beside it."""
    folder.mkdir()
    picture = bpy.data.images.new("Picture", 2, 2)
    picture.filepath_raw, picture.file_format = str(folder / "Floor.png"), "PNG"
    picture.save()
    positions = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], dtype=np.float32)
    uvs = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32)
    indices = np.array([0, 1, 2, 0, 2, 3], dtype=np.uint16)
    parts = [part.tobytes() for part in (positions, uvs, indices)]
    (folder / "the floor.bin").write_bytes(b"".join(parts))
    starts = [0, *np.cumsum([len(part) for part in parts])]
    tree = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "Floor"}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}
        ],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"uri": "Floor.png"}],
        "buffers": [{"uri": "the%20floor.bin", "byteLength": int(starts[-1])}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": int(start), "byteLength": len(part)}
            for start, part in zip(starts, parts, strict=False)
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
             "min": [-1, 0, -1], "max": [1, 0, 1]},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
    }  # fmt: skip
    (folder / "floor.gltf").write_text(json.dumps(tree))
    return folder / "floor.gltf"


def save_obj(folder: Path) -> Path:
    """Write a textured quad as an .obj with its materials and an image beside it."""
    folder.mkdir()
    picture = bpy.data.images.new("Picture", 2, 2)
    picture.filepath_raw, picture.file_format = str(folder / "Floor.png"), "PNG"
    picture.save()
    (folder / "the floor.mtl").write_text("newmtl White\nKd 1 1 1\nmap_Kd Floor.png\n")
    (folder / "floor.obj").write_text(
        "mtllib the floor.mtl\no Floor\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\n"
        "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl White\nf 1/1 2/2 3/3 4/4\n"
    )
    return folder / "floor.obj"


@pytest.mark.parametrize(("save_scene", "part"), [(save_gltf, "the floor.bin"), (save_obj, "the floor.mtl")])
def test_the_parts_of_an_imported_scene_are_never_replaced(
    save_scene: Callable[[Path], Path], part: str, run: Run, tmp_path: Path
) -> None:
    """Also where Blender packs what it imports, and reads it no more."""
    scene, out = save_scene(tmp_path / "scene"), tmp_path / "out"
    words = ("bake", scene, *TINY, "--sky", "--overwrite", "--output")
    with nothing_changed(tmp_path):
        own = (scene.parent, "--atlas", "per-object", "--format", "png16")
        refused(run(*words, *own), "Floor.png", "reads")
        refused(run(*words, out, "--report", scene.parent / part), part, code=2)


def test_a_report_of_the_first_version_is_refused_by_name(run: Run, small: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run("bake", small, "--output", out, *TINY).code == 0
    told = read_report(out)
    scene = str(small)
    old = {key: value for key, value in told.items() if key not in ("seal", "baked")}
    old["version"], old["files"] = 1, {name: {**of, "scene": scene} for name, of in told["files"].items()}
    (out / "report.json").write_text(json.dumps(old))
    with nothing_changed(tmp_path):
        refused(run("bake", small, "--output", out, *TINY), out / "report.json", "earlier version")


def test_an_object_named_preview_has_a_lightmap_of_its_own(run: Run, tmp_path: Path) -> None:
    build_small()
    bpy.data.objects["Floor"].name = "preview"
    scene, out = save(tmp_path / "small.blend"), tmp_path / "out"
    assert run("bake", scene, "--output", out, *TINY, "--atlas", "per-object", "--format", "png16").code == 0
    (entry,) = read_report(out)["objects"]
    assert entry["image"] == "preview_2.png"
    assert set(digest(out)) == {"baked.blend", "preview.png", "preview_2.png", "report.json"}
    image = bpy.data.images.load(str(out / "preview_2.png"))
    assert tuple(image.size) == (16, 16)


# --- files that are named one by one ---


def test_a_copy_of_the_report_never_replaces_what_is_not_one(run: Run, small: Path, tmp_path: Path) -> None:
    out, notes = tmp_path / "out", tmp_path / "notes.json"
    notes.write_text('{"years": "of work"}')
    words = ("bake", small, "--output", out, *TINY, "--report")
    with nothing_changed(tmp_path):
        refused(run(*words, small), small, code=2)
        refused(run(*words, tmp_path / "scene" / ".." / "scene" / "small.blend"), "small.blend", code=2)
        refused(run(*words, notes), notes)
        for name in ("report.json", "baked.blend", "lightmap.exr", "preview.png", "lightmap.relight"):
            refused(run(*words, out / name), name)
        refused(run(*words, tmp_path / "x.svg", "--plot", tmp_path / "x.svg"), "x.svg", code=2)
    copy = tmp_path / "r.json"
    assert run(*words, copy).code == 0
    assert run(*words, copy).code == 0
    assert json.loads(copy.read_text()) == read_report(out)
    copy.write_text(copy.read_text().replace('"version": 2', '"version": 3'))
    with nothing_changed(tmp_path):
        refused(run(*words, copy), copy)
    assert run(*words, copy, "--overwrite").code == 0


@posix
def test_links_devices_and_folders_are_no_places(run: Run, small: Path, tmp_path: Path) -> None:
    (tmp_path / "victim").write_text("years of work")

    def odd_places(ending: str) -> tuple[Path, Path, Path]:
        link, pipe, folder = (tmp_path / f"{name}{ending}" for name in ("link", "pipe", "folder"))
        link.symlink_to(tmp_path / "victim")
        os.mkfifo(pipe)
        folder.mkdir()
        return link, pipe, folder

    for place in (*odd_places(".svg"), Path("/dev/null")):
        for option in ("--report", "--plot"):
            if option == "--plot" and place.suffix != ".svg":
                continue
            done = run("bake", small, "--output", tmp_path / "out", *TINY, option, place, "--overwrite")
            refused(done, place)
    for place in odd_places(".blend"):
        for verb in ("restore", "flip"):
            refused(run(verb, small, "--output", place, "--overwrite"), place)
    assert (tmp_path / "victim").read_text() == "years of work"
    assert not (tmp_path / "out").exists()
    assert Path("/dev/null").is_char_device()


def test_a_plot_replaces_nothing(run: Run, tmp_path: Path) -> None:
    build_small()
    text = bpy.data.texts.new("Picture")
    text.filepath = str(tmp_path / "read.svg")
    (tmp_path / "mine.svg").write_text("years of work")
    (tmp_path / "read.svg").write_text("years of work")
    scene, out = save(tmp_path / "small.blend"), tmp_path / "out"
    words = ("bake", scene, "--output", out, *TINY, "--plot")
    with nothing_changed(tmp_path):
        refused(run(*words, tmp_path / "read.svg", "--overwrite"), "read.svg", "reads")
        refused(run(*words, tmp_path / "mine.svg"), "mine.svg", "--overwrite")
        refused(run(*words, out / "preview.png"), "preview.png", code=2)
    assert run(*words, out / "history.svg").code == 0
    refused(run(*words, out / "history.svg"), "history.svg")
    assert run(*words, out / "history.svg", "--overwrite").code == 0


def test_restore_writes_no_file_that_is_there(run: Run, small: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run("bake", small, "--output", out, *TINY).code == 0
    baked = out / "baked.blend"
    (tmp_path / "mine.blend").write_text("years of work")
    with nothing_changed(tmp_path):
        refused(run("restore", baked, "--output", baked, "--overwrite"), "baked.blend", code=2)
        refused(run("restore", baked, "--output", tmp_path / "mine.blend"), "mine.blend", "--overwrite")
        for verb in ("restore", "flip"):
            lightmap = run(verb, baked, "--output", out / "lightmap.exr", "--overwrite")
            refused(lightmap, "lightmap.exr", "ends in .blend", code=2)
    assert run("restore", baked, "--output", tmp_path / "mine.blend", "--overwrite").code == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "mine.blend"))
    assert "Floor" in bpy.data.objects


# --- scripts ---


@pytest.mark.parametrize("allowed", [False, True])
def test_scripts_of_a_scene_are_run_only_if_allowed(allowed: bool, run: Run, tmp_path: Path) -> None:
    build_small()
    text = bpy.data.texts.new("hello.py")
    text.write(f"open({str(tmp_path / 'was here')!r}, 'w').close()")
    text.use_module = True
    scene = save(tmp_path / "scripted.blend")
    words = ("--allow-scripts",) if allowed else ()
    assert run("bake", scene, "--output", tmp_path / "out", *TINY, *words).code == 0
    assert (tmp_path / "was here").exists() == allowed
    warned = [
        entry for entry in read_report(tmp_path / "out")["warnings"] if "--allow-scripts" in entry["message"]
    ]
    assert len(warned) == (not allowed)


def test_rooms_bake_as_before(run: Run, tmp_path: Path) -> None:
    """A whole bake twice into one folder, with pages that get fewer: what is left stays ours."""
    build_room()
    scene, out = save(tmp_path / "room.blend"), tmp_path / "out"
    assert run("bake", scene, "--output", out, *QUICK, "--pages", "2").code == 0
    assert run("bake", scene, "--output", out, *QUICK).code == 0
    assert "lightmap_2.exr" in read_report(out)["files"]
    assert run("bake", scene, "--output", out, *QUICK, "--pages", "2").code == 0
