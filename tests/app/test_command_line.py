"""The command line on whole bakes: what it writes, what its options do, and what it warns of."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.options.bake_settings import BakeSettings

from .conftest import (
    QUICK,
    Baked,
    add_lamp,
    add_quad,
    build_room,
    digest,
    painted,
    read_pixels,
    read_report,
    save,
)

Run = Callable[..., object]


# --- what a bake leaves behind ---


def test_the_bundled_box_with_one_command(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = run("bake", "--resolution", "32", "--quality", "sketch")
    assert (done.code, done.err) == (0, "")
    folder = tmp_path / "out" / "cornell"
    assert set(digest(folder)) == {"baked.blend", "lightmap.exr", "preview.png", "report.json"}
    for part in (
        "out/cornell",
        "baked.blend",
        "lightmap.exr",
        "preview.png",
        "report.json",
        "solve",
        " s\n",
        "%]",
    ):
        assert part in done.out


def test_without_a_preview(run: Run, room: Path, tmp_path: Path) -> None:
    done = run("bake", room, "--output", tmp_path / "out", *QUICK, "--keep")
    assert (done.code, done.err) == (0, "")
    files = {"baked.blend", "lightmap.exr", "lightmap.relight", "report.json"}
    assert set(digest(tmp_path / "out")) == files
    assert "preview.png" not in done.out
    assert all(f"  {name} " in done.out for name in files)
    baked = read_report(tmp_path / "out")
    assert "preview" not in baked["seconds"]
    done = run("bake", room, "--output", tmp_path / "out", "--relight", "--no-preview")
    assert (done.code, done.err) == (0, "")
    assert set(digest(tmp_path / "out")) == files
    relit = read_report(tmp_path / "out")
    # No light has changed, but of other light than the bake's these would not be known.
    for entry in baked["objects"]:
        del entry["irradiance_W_m2"], entry["illuminance_lx"]
    assert baked["solver"].pop("power_W")
    assert relit["solver"].pop("history") == []
    del baked["solver"]["history"]
    errors = [report["solver"].pop("estimated_error") for report in (baked, relit)]
    assert errors[1] == pytest.approx(errors[0], rel=0.01)
    assert all(relit[name] == baked[name] for name in ("objects", "pages", "solver", "warnings"))
    before = digest(tmp_path / "out")
    done = run("bake", room, "--output", tmp_path / "out", "--relight", *QUICK, "--opaque-glass")
    assert done.code == 2
    assert "which differ in --opaque-glass: leave these out, or bake again" in done.err
    default = str(BakeSettings().resolution)
    done = run("bake", room, "--output", tmp_path / "out", "--relight", "--resolution", default)
    assert done.code == 2
    assert "which differ in --resolution: leave these out, or bake again" in done.err
    assert digest(tmp_path / "out") == before


def test_the_report_keeps_its_contract(baked: Baked) -> None:
    report = read_report(baked.folder)
    assert json.loads(baked.copy_of_report.read_text(encoding="utf-8")) == report
    assert report["version"] == 2
    assert {entry["object"] for entry in report["objects"]} == {"Floor", "Wall", "Cube"}
    for entry in report["objects"]:
        assert entry["uv_layer"] == "Lightmap"
        assert entry["resolution"] == [32, 32]
        assert entry["atlas"] == 0
        assert (baked.folder / entry["image"]).is_file()
    solver = report["solver"]
    for name in ("elements", "links", "rays", "iterations", "residual", "closure_area_mean"):
        assert isinstance(solver[name], int | float), name
    assert set(solver["power_W"]) >= {"emitted", "absorbed", "escaped"}
    assert all(seconds >= 0 for seconds in report["seconds"].values())
    assert {"export", "unwrap", "solve", "light"} <= set(report["seconds"])


def test_the_scene_file_is_not_touched(baked: Baked) -> None:
    assert baked.scene_now == baked.scene_before
    assert set(digest(baked.scene.parent)) == {"room.blend"}


def test_baked_blend_shows_the_lightmaps_and_moves_with_its_folder(baked: Baked, tmp_path: Path) -> None:
    moved = tmp_path / "elsewhere"
    shutil.copytree(baked.folder, moved)
    bpy.ops.wm.open_mainfile(filepath=str(moved / "baked.blend"))
    image = bpy.data.images["lightmap.exr"]
    assert image.filepath == "//lightmap.exr"
    assert image.colorspace_settings.name == "Non-Color"
    assert Path(bpy.path.abspath(image.filepath)).resolve() == (moved / "lightmap.exr").resolve()
    for name in ("Floor", "Wall", "Cube"):
        assert "Lightmap" in bpy.data.objects[name].data.uv_layers


def test_restore_undoes_a_bake(run: Run, baked: Baked, tmp_path: Path) -> None:
    done = run("restore", baked.folder / "baked.blend", "--output", tmp_path / "back" / "room.blend")
    assert (done.code, done.err) == (0, "")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "back" / "room.blend"))
    assert not any(image.name.startswith("lightmap") for image in bpy.data.images)
    assert {obj.name: len(obj.data.uv_layers) for obj in bpy.data.objects if obj.type == "MESH"} == {
        "Floor": 0,
        "Wall": 0,
        "Cube": 1,
    }
    assert bpy.data.objects["Cube"].modifiers["Bevel"].show_render


# --- what the options do ---


def test_texel_values_by_quantity_and_light(run: Run, baked: Baked, tmp_path: Path) -> None:
    def texels(**options: str) -> np.ndarray:
        out = tmp_path / "-".join(options.values())
        words = [word for name, value in options.items() for word in (f"--{name}", value)]
        assert run("bake", baked.scene, "--output", out, *QUICK, *words).code == 0
        return read_pixels(out / "lightmap.exr")

    over_pi = read_pixels(baked.folder / "lightmap.exr")
    assert over_pi.max() > 0.1
    np.testing.assert_allclose(texels(quantity="irradiance"), math.pi * over_pi, rtol=1e-5, atol=1e-6)
    parts = texels(light="direct") + texels(light="indirect")
    np.testing.assert_allclose(parts, over_pi, rtol=1e-4, atol=1e-5)


def test_png16_holds_the_values_over_its_scale(run: Run, baked: Baked, tmp_path: Path) -> None:
    assert run("bake", baked.scene, "--output", tmp_path, *QUICK, "--format", "png16").code == 0
    entry = read_report(tmp_path)["objects"][0]
    assert entry["image"] == "lightmap.png"
    exact = read_pixels(baked.folder / "lightmap.exr")
    stored = read_pixels(tmp_path / "lightmap.png") * entry["scale"]
    np.testing.assert_allclose(stored, exact, atol=entry["scale"] / 65535)


def test_an_image_an_object_and_quiet_prints_nothing(run: Run, room: Path, tmp_path: Path) -> None:
    done = run("bake", room, "--output", tmp_path / "out", *QUICK, "--atlas", "per-object", "--quiet")
    assert (done.code, done.out, done.err) == (0, "", "")
    report = read_report(tmp_path / "out")
    assert {entry["object"]: entry["image"] for entry in report["objects"]} == {
        name: f"{name}.exr" for name in ("Floor", "Wall", "Cube")
    }


def test_only_named_objects_and_the_rest_still_blocks(run: Run, room: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run("bake", room, "--output", out, *QUICK, "--objects", "Floor", "--light", "direct").code == 0
    assert [entry["object"] for entry in read_report(out)["objects"]] == ["Floor"]
    # The cube's shadow, on a page that is all floor.
    pixels = read_pixels(out / "lightmap.exr")
    assert pixels[8:24, 8:24].min() < 0.01 * pixels.max()


def test_texel_density_sets_the_page(run: Run, room: Path, tmp_path: Path) -> None:
    sizes = []
    for density in (4, 16):
        out = tmp_path / str(density)
        words = ("--quality", "sketch", "--texel-density", density)
        assert run("bake", room, "--output", out, *words).code == 0
        sizes.append(read_report(out)["objects"][0]["resolution"][0])
    assert sizes[0] >= 4 * 4  # the floor is 4 m wide
    assert sizes[1] >= 2 * sizes[0]


def test_the_same_bytes_at_any_thread_count(run: Run, baked: Baked, tmp_path: Path) -> None:
    """The shared bake has as many threads as there are cores."""
    files = [(baked.folder / "lightmap.exr").read_bytes()]
    for threads in (1, 3):
        out = tmp_path / str(threads)
        assert run("bake", baked.scene, "--output", out, *QUICK, "--threads", threads).code == 0
        files.append((out / "lightmap.exr").read_bytes())
    assert files[0] == files[1] == files[2]


def test_another_seed_is_another_sampling(run: Run, baked: Baked, tmp_path: Path) -> None:
    assert run("bake", baked.scene, "--output", tmp_path, *QUICK, "--seed", 1).code == 0
    zero, one = (read_pixels(folder / "lightmap.exr") for folder in (baked.folder, tmp_path))
    assert (zero != one).any()
    np.testing.assert_allclose(zero.mean(), one.mean(), rtol=0.02)


def test_keep_uvs_keeps_the_layer(run: Run, tmp_path: Path) -> None:
    build_room()
    floor = bpy.data.objects["Floor"].data
    layer = floor.uv_layers.new(name="Lightmap")
    kept = [0.0, 0.0, 0.25, 0.0, 0.25, 0.25, 0.0, 0.25]
    layer.uv.foreach_set("vector", kept)
    scene = save(tmp_path / "kept.blend")
    out = tmp_path / "out"
    assert run("bake", scene, "--output", out, *QUICK, "--keep-uvs", "--objects", "Floor").code == 0
    bpy.ops.wm.open_mainfile(filepath=str(out / "baked.blend"))
    found = np.empty(8, dtype=np.float32)
    bpy.data.objects["Floor"].data.uv_layers["Lightmap"].uv.foreach_get("vector", found)
    np.testing.assert_allclose(found, kept, atol=1e-6)


@pytest.mark.parametrize("kind", ["glb", "gltf", "obj"])
def test_other_scene_files(kind: str, run: Run, tmp_path: Path) -> None:
    build_room()
    path = tmp_path / f"room.{kind}"
    if kind == "obj":
        bpy.ops.wm.obj_export(filepath=str(path))
    else:
        form = {"glb": "GLB", "gltf": "GLTF_SEPARATE"}[kind]
        bpy.ops.export_scene.gltf(filepath=str(path), export_format=form, export_lights=True)
    done = run("bake", path, "--output", tmp_path / "out", *QUICK, "--sky")
    assert (done.code, done.err) == (0, "")
    report = read_report(tmp_path / "out")
    assert {entry["object"] for entry in report["objects"]} == {"Floor", "Wall", "Cube"}
    assert read_pixels(tmp_path / "out" / "lightmap.exr").max() > 0.01


# --- odd scenes that bake, with a warning ---


def test_no_light_is_black_with_a_warning_and_sky_fixes_it(run: Run, tmp_path: Path) -> None:
    add_quad("Floor", ((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)))
    scene = save(tmp_path / "dark.blend")
    assert run("bake", scene, "--output", tmp_path / "dark", *QUICK).code == 0
    assert not read_pixels(tmp_path / "dark" / "lightmap.exr").any()
    assert any("light" in warning["message"] for warning in read_report(tmp_path / "dark")["warnings"])
    assert run("bake", scene, "--output", tmp_path / "sky", *QUICK, "--sky").code == 0
    # A plane under a white sky of radiance 1: H/π = 1.
    pixels = read_pixels(tmp_path / "sky" / "lightmap.exr")
    np.testing.assert_allclose(pixels[pixels.any(axis=2)], 1.0, rtol=0.01)


def test_odd_but_bakeable_scenes_warn_by_name(run: Run, tmp_path: Path) -> None:
    floor = add_quad("Floor", ((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)))
    floor.data.materials.append(None)
    needle = add_quad("Needle", ((0, 0, 1), (1, 0, 1), (2, 0, 1)))
    white = painted("Too White", (1, 1, 1, 1))
    shader = next(node for node in white.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Specular IOR Level"].default_value = 0.0  # gloss takes some of it
    needle.data.materials.append(white)
    add_lamp()
    scene = save(tmp_path / "odd.blend")
    done = run("bake", scene, "--output", tmp_path / "out", *QUICK)
    assert (done.code, done.err) == (0, "")
    warned = {warning["name"] for warning in read_report(tmp_path / "out")["warnings"]}
    assert {"Needle", "Too White"} <= warned
    assert "Too White" in done.out
