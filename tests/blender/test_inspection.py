"""The look at a scene before it is baked: what will be baked, how large, and what is odd."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import bpy
import pytest

from radiosity_addon.base.errors import BakeError
from radiosity_addon.base.steps import drain
from radiosity_addon.blender.files.cornell import build_cornell_box
from radiosity_addon.blender.files.output import OutputFolder
from radiosity_addon.blender.jobs.inspection import ERROR, INFO, WARNING, Inspection, inspect
from radiosity_addon.blender.jobs.job import run_bake
from radiosity_addon.blender.operators import checks
from radiosity_addon.blender.session import last_bake
from radiosity_addon.blender.session.state import session
from radiosity_addon.files.file_names import BLEND_NAME, PREVIEW_NAME
from radiosity_addon.options.bake_settings import BakeSettings
from tests.blender.scenes import QUAD, add_lamp, add_mesh, set_world

pytestmark = pytest.mark.usefixtures("registered")

ROOT = Path(__file__).resolve().parents[2]
SETTINGS = BakeSettings(resolution=256)

CUBE = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
CUBE_FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def look(tmp_path: Path, settings: BakeSettings = SETTINGS) -> Inspection:
    return inspect(bpy.context, settings, tmp_path)


def odd(found: Inspection) -> dict[str, str]:
    """Messages of what is more than worth knowing, by whose it is."""
    return {finding.name: finding.message for finding in found.findings if finding.level != INFO}


def room() -> None:
    """A floor and a lamp: nothing odd."""
    add_mesh("Floor")
    add_lamp("POINT", energy=100.0, transform={"location": (0, 0, 2)})


def test_the_cornell_box_is_as_it_should_be(tmp_path: Path) -> None:
    build_cornell_box()
    found = look(tmp_path)
    assert (found.objects, found.triangles, found.scene_triangles) == (7, 34, 34)
    assert found.estimate.pages == (256,)
    assert not found.is_odd
    # A bake of it has 56,642 texels (bench/results/cornell.json).
    assert found.texels == pytest.approx(56_642, rel=0.25)


def test_nothing_is_changed_by_looking(tmp_path: Path) -> None:
    room()
    floor = bpy.data.objects["Floor"]
    floor.hide_set(True)
    names = sorted(block.name for block in bpy.data.user_map())
    look(tmp_path)
    assert sorted(block.name for block in bpy.data.user_map()) == names
    assert floor.hide_get()


def test_an_unsaved_file_is_reported() -> None:
    room()
    found = inspect(bpy.context, SETTINGS, None)
    assert ["not saved" in finding.message for finding in found.findings if finding.name == "file"] == [True]


def test_a_folder_that_cannot_be_written_is_reported(tmp_path: Path) -> None:
    room()
    (tmp_path / "file").write_text("in the way")
    found = inspect(bpy.context, SETTINGS, tmp_path / "file" / "lightmaps")
    assert found.findings[0].level == ERROR
    assert "choose another" in found.findings[0].message


@pytest.mark.parametrize(
    ("foreign", "settings"),
    [
        ("lightmap.exr", SETTINGS),
        ("Floor.exr", replace(SETTINGS, atlas="per-object")),
        ("lightmap_3.png", replace(SETTINGS, texel_density=20.0, format="png16")),
        ("lightmap_lamps.exr", replace(SETTINGS, groups=(("lamps", ("Lamp",)),))),
        ("report.json", SETTINGS),
        ("preview.png", SETTINGS),
    ],
)
def test_a_file_that_a_bake_would_not_replace_is_named_as_by_the_bake(
    foreign: str, settings: BakeSettings, tmp_path: Path
) -> None:
    room()
    (tmp_path / foreign).write_text("the user's")
    found = inspect(bpy.context, settings, tmp_path, OutputFolder(tmp_path), [BLEND_NAME, PREVIEW_NAME])
    assert found.findings[0].level == ERROR
    assert str(tmp_path / foreign) in found.findings[0].message
    assert [path.name for path in tmp_path.iterdir()] == [foreign]
    with pytest.raises(BakeError) as stopped:
        drain(run_bake(bpy.context, settings, OutputFolder(tmp_path), with_copy=True))
    assert str(stopped.value) == found.findings[0].message


def test_files_of_the_last_bake_are_replaced_and_not_odd(tmp_path: Path) -> None:
    room()
    settings = replace(SETTINGS, resolution=16, quality="sketch")
    drain(run_bake(bpy.context, settings, OutputFolder(tmp_path)))
    assert (tmp_path / "lightmap.exr").is_file()
    found = inspect(bpy.context, settings, tmp_path, OutputFolder(tmp_path))
    assert ERROR not in {finding.level for finding in found.findings}
    (tmp_path / "lightmap.exr").write_text("changed")
    found = inspect(bpy.context, settings, tmp_path, OutputFolder(tmp_path))
    assert "changed" in found.findings[0].message


def test_darkness_is_reported(tmp_path: Path) -> None:
    add_mesh("Floor")
    assert "has no light" in odd(look(tmp_path))[bpy.context.scene.name]
    assert odd(look(tmp_path, BakeSettings(sky=True))) == {}
    set_world(0.2, 0.2, 0.2)
    assert odd(look(tmp_path)) == {}


def test_hidden_objects_are_reported(tmp_path: Path) -> None:
    room()
    add_mesh("Left out", location=(3, 0, 0)).hide_render = True
    add_mesh("Unseen", location=(6, 0, 0)).hide_set(True)
    found = odd(look(tmp_path))
    assert "left out" in found["Left out"]
    assert "part of the bake" in found["Unseen"]


def test_tiny_objects_and_greedy_ones_are_reported(tmp_path: Path) -> None:
    room()
    add_mesh("Pebble", [(0.01 * x, 0.01 * y, z) for x, y, z in QUAD], location=(0, 0, 0.5))
    found = odd(look(tmp_path))
    assert "8 × 8 texels" in found["Pebble"]
    assert "of all texels" in found["Floor"]
    add_mesh("Land", [(1e4 * x, 1e4 * y, z) for x, y, z in QUAD], location=(0, 0, -1))
    found = odd(look(tmp_path))
    assert "100 %" not in found["Land"]
    assert "more than 99.9 % of all texels" in found["Land"]
    tiny = next(message for message in found.values() if "8 × 8 texels" in message)
    assert "'Land'" in tiny
    assert "raise the resolution" not in tiny


def test_uv_layers_are_reported(tmp_path: Path) -> None:
    room()
    found = look(tmp_path, BakeSettings(keep_uvs=True))
    assert "to keep" in odd(found)["Floor"]
    assert any(
        "without UVs of their own" in f.message or "becomes the first" in f.message for f in found.findings
    )
    mesh = bpy.data.objects["Floor"].data
    for number in range(8):
        mesh.uv_layers.new(name=f"UV {number}")
    full = look(tmp_path)
    assert [(f.level, f.name) for f in full.findings if "room" in f.message] == [(ERROR, "Floor")]


def test_what_is_inside_out_is_reported_unless_it_is_a_room(tmp_path: Path) -> None:
    room()
    inwards = [face[::-1] for face in CUBE_FACES]
    add_mesh("Good", CUBE, CUBE_FACES, location=(5, 0, 1))
    add_mesh("Turned", CUBE, inwards, location=(10, 0, 1))
    add_mesh("Mirrored", CUBE, CUBE_FACES, location=(15, 0, 1), scale=(-1, 1, 1))
    add_mesh("Hall", [(20 * x, 20 * y, 20 * z) for x, y, z in CUBE], inwards)
    # Its center is in the box around the turned cube, and most of it outside.
    add_mesh("Rod", [(0.1 * x, 0.1 * y, 3 * z) for x, y, z in CUBE], CUBE_FACES, location=(10, 0, 1))
    told = {name: text for name, text in odd(look(tmp_path)).items() if "inside out" in text}
    assert list(told) == ["Turned"]
    result = drain(run_bake(bpy.context, BakeSettings(resolution=64, quality="draft"), None))
    warnings = [w for w in result.as_dict()["warnings"] if "inside out" in str(w)]
    assert [told["Turned"] in str(warning) for warning in warnings] == [True]


def test_an_empty_room_with_a_camera_in_it_is_not_inside_out(tmp_path: Path) -> None:
    hall = add_mesh("Hall", CUBE, [face[::-1] for face in CUBE_FACES])
    assert "inside out" in odd(look(tmp_path))["Hall"]
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    bpy.context.scene.collection.objects.link(camera)
    camera.location = hall.location
    assert "Hall" not in odd(look(tmp_path))


def test_faces_in_one_place_are_named_with_their_number(tmp_path: Path) -> None:
    room()
    add_mesh("Box", CUBE, CUBE_FACES, location=(5, 0, 1))
    assert not [f for f in look(tmp_path).findings if "in the same place" in f.message]
    add_mesh("Copy", CUBE, CUBE_FACES, location=(5, 0, 1))
    (found,) = (f for f in look(tmp_path).findings if "in the same place" in f.message)
    assert "12 of 'Box'" in found.message
    assert "12 of 'Copy'" in found.message
    assert "Floor" not in found.message


def test_forgotten_scales_and_units_are_told_of(tmp_path: Path) -> None:
    room()
    add_mesh("Map", [(0.01 * x, 0.01 * y, z) for x, y, z in QUAD], scale=(1000, 1000, 1000))
    assert "scale of 1000 × 1000 × 1000" in odd(look(tmp_path))["Map"]
    add_mesh("Far", location=(20_000, 0, 0))
    assert "20 km" in odd(look(tmp_path))["scene"]


def test_a_black_material_is_worth_knowing(tmp_path: Path) -> None:
    room()
    material = bpy.data.materials.new("Tar")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (0, 0, 0, 1)
    for name in ("Specular IOR Level", "Specular"):
        if name in shader.inputs:
            shader.inputs[name].default_value = 0.0
    bpy.data.objects["Floor"].data.materials.append(material)
    found = [finding for finding in look(tmp_path).findings if finding.name == "Tar"]
    assert [(finding.level, "black" in finding.message) for finding in found] == [(INFO, True)]


def test_a_refusal_names_the_memory_that_is_shown(tmp_path: Path) -> None:
    build_cornell_box()
    found = look(tmp_path, replace(SETTINGS, memory_limit=0.001, resolution=16))
    (message,) = (finding.message for finding in found.findings if finding.name == "memory")
    shown = dict(checks.figures(found))["Memory"]
    assert shown == f"about {found.estimate.memory / 2**30:.1f} GiB with Blender"
    assert f"need about {found.estimate.memory / 2**30:.1f} GiB, " in message


def test_nothing_to_bake_is_an_error_not_an_exception(tmp_path: Path) -> None:
    add_lamp("POINT", energy=10.0)
    found = look(tmp_path)
    assert found.findings[0].level == ERROR
    assert "nothing to bake" in found.findings[0].message


def test_the_worst_comes_first(tmp_path: Path) -> None:
    room()
    add_mesh("Pebble", [(0.01 * x, 0.01 * y, z) for x, y, z in QUAD], location=(0, 0, 0.5))
    bpy.data.objects["Floor"].data.uv_layers.new(name="UV")
    levels = [finding.level for finding in look(tmp_path, BakeSettings(keep_uvs=True)).findings]
    assert levels == sorted(levels, key=(ERROR, WARNING, INFO).index)
    assert len(levels) >= 3


def test_many_triangles_take_a_moment_only(tmp_path: Path) -> None:
    """As many as an office has, in as many objects: the aim is two seconds, processor time."""
    room()
    for number in range(100):
        bpy.ops.mesh.primitive_uv_sphere_add(segments=20, ring_count=11, location=(3 * number, 5, 1))
    start = time.process_time()
    found = look(tmp_path)
    assert found.scene_triangles > 39_000
    assert time.process_time() - start < 2.0


def test_the_operator_reports_and_the_panel_remembers() -> None:
    build_cornell_box()
    scene = bpy.context.scene
    assert checks.last_check(scene) is None
    assert bpy.ops.radiosity.check("EXEC_DEFAULT") == {"FINISHED"}
    found = checks.last_check(scene)
    assert found.objects == 7
    assert dict(checks.figures(found))["Images"] == "1 × 512²"


def test_only_an_odd_scene_that_was_never_seen_is_looked_at_first() -> None:
    build_cornell_box()
    assert not checks.look_first(bpy.context)
    session.checks.clear()
    bpy.data.objects["Floor"].hide_set(True)
    assert checks.look_first(bpy.context)
    assert not checks.look_first(bpy.context)
    session.checks.clear()
    bpy.context.scene.radiosity.last_bake = json.dumps(
        {
            "objects": 1,
            "images": 1,
            "solver": {"method": "hierarchical", "elements": 1, "links": 1, "rays": 1},
            "seconds": 1.0,
            "warnings": [],
            "warning_count": 0,
            "folder": "",
        }
    )
    assert last_bake.read(bpy.context.scene) is not None
    assert not checks.look_first(bpy.context)


def test_the_command_line_checks_without_baking(tmp_path: Path) -> None:
    add_mesh("Floor")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "dark.blend"))
    command = [sys.executable, "-m", "radiosity_addon", "bake", str(tmp_path / "dark.blend"), "--check"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert "Objects      1" in done.stdout
    assert "has no light" in done.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["dark.blend"]
