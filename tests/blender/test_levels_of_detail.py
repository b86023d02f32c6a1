"""Levels of detail by name: one lightmap, on the finest one, and the others show its light."""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Vector

from radiosity_addon.blender.datablocks.image_values import pixels_of
from radiosity_addon.blender.operators.export_operators import export_folder
from radiosity_addon.blender.scene_export.levels_of_detail import level_in
from radiosity_addon.blender.session import last_bake
from tests.blender.file_dump import differences_since, dump_file
from tests.blender.scenes import add_lamp, add_mesh, shader_material

pytestmark = pytest.mark.one_blender


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("Rock_LOD0", ("Rock", 0)),
        ("Rock_LOD12", ("Rock", 12)),
        ("Rock.LOD1", ("Rock", 1)),
        ("rock_lod_2", ("rock", 2)),
        ("Rock_LOD1.001", ("Rock.001", 1)),
        ("Rock", None),
        ("RockLOD1", None),
        ("Rock_LOD", None),
        ("_LOD1", None),
        ("Rock_LOD1_old", None),
    ],
)
def test_names_tell_levels(name: str, expected: tuple[str, int] | None) -> None:
    assert level_in(name) == expected


@pytest.fixture
def room(registered: None, tmp_path: Path) -> Path:
    """A saved file with a floor and a lamp."""
    add_mesh("Floor", material=shader_material("Gray", "ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5, 1)))
    add_lamp("POINT", energy=100.0, transform={"location": (0.3, -0.4, 2)})
    settings = bpy.context.scene.radiosity
    settings.resolution, settings.quality = 128, "draft"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    return tmp_path


def bake() -> set[str]:
    return bpy.ops.radiosity.bake("EXEC_DEFAULT", True)


def add_plane(name: str, cuts: int, location: tuple[float, float, float] = (0, 0, 0.5)) -> bpy.types.Object:
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=cuts, y_subdivisions=cuts, size=1.2, location=location)
    return named(name)


def add_sphere(name: str, segments: int, location: tuple[float, float, float]) -> bpy.types.Object:
    bpy.ops.mesh.primitive_uv_sphere_add(
        segments=segments, ring_count=segments // 2, radius=0.5, location=location
    )
    return named(name)


def named(name: str) -> bpy.types.Object:
    obj = bpy.context.object
    obj.name = obj.data.name = name
    return obj


def lightmap() -> np.ndarray:
    (image,) = [each for each in bpy.data.images if each.get("radiosity_page") is not None]
    return pixels_of(image)[..., :3]


def uvs(obj: bpy.types.Object) -> np.ndarray:
    layer = obj.data.uv_layers["Lightmap"]
    values = np.empty(2 * len(layer.uv), dtype=np.float32)
    layer.uv.foreach_get("vector", values)
    return values.reshape(-1, 2)


def corners(obj: bpy.types.Object) -> np.ndarray:
    """The places of an object's corners, in its own space."""
    mesh = obj.data
    return np.array([mesh.vertices[loop.vertex_index].co for loop in mesh.loops])


def light_at(uv: np.ndarray) -> np.ndarray:
    """The lightmap's light at coordinates, bilinear."""
    image = lightmap()
    height, width = image.shape[:2]
    x, y = uv[:, 0] * width - 0.5, uv[:, 1] * height - 0.5
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    across, up = (x - column)[:, None], (y - row)[:, None]
    taps = [
        image[np.clip(row + r, 0, height - 1), np.clip(column + c, 0, width - 1)]
        for r in (0, 1)
        for c in (0, 1)
    ]
    return (taps[0] * (1 - across) + taps[1] * across) * (1 - up) + (
        taps[2] * (1 - across) + taps[3] * across
    ) * up


def test_a_coarser_plane_shows_exactly_the_light_of_the_finest(room: Path) -> None:
    fine = add_plane("Shelf_LOD0", 8)
    assert bake() == {"FINISHED"}
    alone, where = lightmap().copy(), uvs(fine)
    bpy.ops.radiosity.restore()
    coarse, middle = add_plane("Shelf_LOD2", 1), add_plane("Shelf_LOD1", 3)
    before = dump_file()
    assert bake() == {"FINISHED"}
    np.testing.assert_array_equal(uvs(fine), where)
    np.testing.assert_array_equal(lightmap(), alone, "other levels neither light nor block")
    linear, *_ = np.linalg.lstsq(np.c_[corners(fine)[:, :2], np.ones(len(where))], where, rcond=None)
    for level in (coarse, middle):
        expected = np.c_[corners(level)[:, :2], np.ones(len(level.data.loops))] @ linear
        np.testing.assert_allclose(uvs(level), expected, atol=1e-6)
        assert level.material_slots[0].material == fine.material_slots[0].material
    report = json.loads((room / "lightmaps" / "room_Scene_report.json").read_text(encoding="utf-8"))
    entries = {entry["object"]: entry for entry in report["objects"]}
    assert entries["Shelf_LOD1"]["image"] == entries["Shelf_LOD0"]["image"]
    assert entries["Shelf_LOD1"]["share_of_page"] == 0.0
    (said,) = [each["message"] for each in report["notes"] if "levels of detail" in each["message"]]
    assert "'Shelf_LOD1', 'Shelf_LOD2' show the lightmap of 'Shelf_LOD0'" in said
    assert not [each for each in report["warnings"] if "levels of detail" in each["message"]]
    last = last_bake.read(bpy.context.scene)
    assert said in last.notes
    assert said not in [message for _, message in last.warnings]
    assert bpy.ops.radiosity.restore() == {"FINISHED"}
    assert differences_since(before, dump_file()) == []


@pytest.mark.parametrize("place", [(0, 0, 0.8), (1.1, 0, 0.8)], ids=["in one place", "side by side"])
def test_a_coarser_sphere_is_lit_like_the_finest(room: Path, place: tuple[float, float, float]) -> None:
    fine, coarse = add_sphere("Ball_LOD0", 32, (0, 0, 0.8)), add_sphere("Ball_LOD1", 12, place)
    assert bake() == {"FINISHED"}
    light = {}
    for obj in (fine, coarse):
        uv, mesh = uvs(obj), obj.data
        middles = np.array([uv[list(polygon.loop_indices)].mean(axis=0) for polygon in mesh.polygons])
        normals = np.array([polygon.center.normalized() for polygon in mesh.polygons])
        light[obj.name] = normals, light_at(middles)
    normals, found = light["Ball_LOD1"]
    cosine, expected = normals @ light["Ball_LOD0"][0].T, light["Ball_LOD0"][1]
    away = np.abs(found - expected[cosine.argmax(axis=1)]).max(axis=1) / expected.max()
    assert np.median(away) < 0.005
    assert away.mean() < 0.04
    # A polygon of 30° that reaches over the border of its chart shows what is within.
    within = cosine > np.cos(np.radians(22))
    low = np.where(within[..., None], expected, np.inf).min(axis=1)
    high = np.where(within[..., None], expected, -np.inf).max(axis=1)
    assert (found > low - 0.02 * expected.max()).all()
    assert (found < high + 0.02 * expected.max()).all()


def test_levels_follow_names_roles_and_selection(room: Path) -> None:
    add_plane("Shelf_LOD0", 4)
    coarse = add_plane("Shelf_LOD1", 1)
    plain, of_plain = add_plane("Box", 2, (-0.8, 0, 1)), add_plane("Box_LOD1", 1, (-0.8, 0, 1))
    own, far = (add_plane(f"Roof_LOD{number}", 1, (0, 0, 1.5)) for number in (1, 2))
    add_plane("Roof_LOD0", 3, (0, 0, 1.5)).hide_render = True
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in (coarse, own))
    bpy.context.scene.radiosity.scope = "selected"
    assert bake() == {"FINISHED"}
    shown = {
        obj.name for obj in bpy.data.objects if obj.type == "MESH" and obj.data.uv_layers.get("Lightmap")
    }
    assert shown == {"Shelf_LOD0", "Shelf_LOD1", "Roof_LOD1", "Roof_LOD2"}
    np.testing.assert_allclose(uvs(far), uvs(own), atol=1e-6)
    bpy.context.scene.radiosity.scope = "all"
    assert bake() == {"FINISHED"}
    np.testing.assert_allclose(
        np.sort(uvs(of_plain), axis=0)[[0, -1]], np.sort(uvs(plain), axis=0)[[0, -1]], atol=1e-6
    )
    coarse.radiosity_mode = "LIGHT_ONLY"
    assert bake() == {"FINISHED"}
    assert coarse.data.uv_layers.get("Lightmap") is None


def test_an_edited_level_is_baked_again_with_its_finest(room: Path) -> None:
    fine, coarse = add_plane("Shelf_LOD0", 4), add_plane("Shelf_LOD1", 1)
    settings, moves = bpy.context.scene.radiosity, bpy.context.scene.radiosity_relight
    settings.scope, moves.only_moved = "changed", False
    assert bake() == {"FINISHED"}
    before = uvs(coarse).copy()
    for vertex in coarse.data.vertices:
        vertex.co *= 0.5
    assert bake() == {"FINISHED"}
    spread = np.ptp(uvs(coarse), axis=0) / np.ptp(uvs(fine), axis=0)
    np.testing.assert_allclose(spread, 0.5, atol=1e-4)
    assert np.ptp(before, axis=0).max() > 0
    np.testing.assert_array_equal(
        [slot.material.name for slot in coarse.material_slots],
        [slot.material.name for slot in fine.material_slots],
    )


@pytest.mark.parametrize("place", [(0, 0, 0.8), (1.4, 0.1, 0.8)], ids=["in place", "next to it"])
def test_a_mirrored_level_is_lit_like_the_finest(room: Path, place: tuple[float, float, float]) -> None:
    """A mirror turns its faces around; they still show what is outside."""
    fine, coarse = add_sphere("Rock_LOD0", 32, (0, 0, 0.8)), add_sphere("Rock_LOD1", 23, place)
    coarse.scale.x = -1
    assert bake() == {"FINISHED"}
    # In place it shows what is there; next to it, what is at the same place of the mesh.
    side = -1.0 if place[0] == 0 else 1.0
    there, here = corners(fine), corners(coarse) * (side, 1, 1)
    nearest = ((here[:, None] - there) ** 2).sum(axis=2).argmin(axis=1)
    light, wanted = light_at(uvs(coarse)), light_at(uvs(fine))[nearest]
    off = np.abs(light - wanted).max(axis=1) / wanted.mean()
    assert np.median(off) < 0.02


@pytest.mark.parametrize("moved", [("Rock_LOD1",), ("Rock_LOD0", "Rock_LOD1")])
def test_moved_levels_are_updated_in_a_bake_that_is_kept(room: Path, moved: tuple[str, ...]) -> None:
    """Coarser levels have no triangles in the scene that is solved: what moved of them is empty."""
    for name, segments in (("Rock_LOD0", 24), ("Rock_LOD1", 8)):
        add_sphere(name, segments, (0, 0, 0.8))
    assert bake() == {"FINISHED"}
    before = lightmap()
    for name in moved:
        bpy.data.objects[name].location.x += 0.4
    assert bake() == {"FINISHED"}
    assert (np.abs(lightmap() - before).max() > 0.1) == ("Rock_LOD0" in moved)


def test_levels_are_exported_with_the_lightmap_of_the_finest(room: Path) -> None:
    add_plane("Shelf_LOD0", 4)
    add_plane("Shelf_LOD1", 1).location = Vector((0, 0, 0.5))
    bpy.context.scene.radiosity.pack = "rectangles"
    assert bake() == {"FINISHED"}
    assert bpy.ops.radiosity.export() == {"FINISHED"}
    index = json.loads((export_folder(bpy.context) / "lightmaps.json").read_text(encoding="utf-8"))
    assert {entry["node"] for entry in index["nodes"]} == {"Floor", "Shelf_LOD0", "Shelf_LOD1"}


def test_a_level_that_renders_hide_is_named_by_exports(room: Path) -> None:
    add_plane("Shelf_LOD0", 8)
    hidden, away, other = (add_plane(name, 1) for name in ("Shelf_LOD1", "Shelf_LOD2", "Table_LOD1"))
    hidden.hide_render = other.hide_render = True
    collection = bpy.data.collections.new("Far")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(away)
    bpy.context.scene.collection.objects.unlink(away)
    collection.hide_render = True
    assert bake() == {"FINISHED"}
    assert bpy.ops.radiosity.export() == {"FINISHED"}
    (index,) = room.glob("lightmaps/*_export/lightmaps.json")
    notes = json.loads(index.read_text(encoding="utf-8"))["notes"]
    named = "'Shelf_LOD1', 'Shelf_LOD2'"
    assert f"levels of detail that are hidden from renders are not exported: {named}" in notes
