"""What follows a baked mesh, objects and drivers, is baked in its place, warned of and brought back."""

from __future__ import annotations

from pathlib import Path

import bpy
import pytest

from radiosity_addon.blender.apply.rebake import originals_shown
from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.scene_export.export import export_scene
from radiosity_addon.options.bake_settings import BakeSettings
from tests.blender.hand_bake import add_plane, bake_by_hand
from tests.blender.scenes import add_lamp, add_mesh, add_object

pytestmark = pytest.mark.usefixtures("record")

SMILE = 'data.shape_keys.key_blocks["Smile"].value'


def _face(modifier: str | None = "BEVEL") -> bpy.types.Object:
    """A plane with a shape key; with a modifier, its lightmap is on a copy without any."""
    face = add_plane("Face")
    face.shape_key_add(name="Basis")
    face.shape_key_add(name="Smile").data[0].co.z += 0.5
    face.data.shape_keys.key_blocks["Smile"].value = 0.5
    if modifier is not None:
        face.modifiers.new("Modifier", modifier)
    return face


def _drive(curve: bpy.types.FCurve, face: bpy.types.Object, path: str = SMILE) -> bpy.types.Driver:
    variable = curve.driver.variables.new()
    variable.name = "smile"
    variable.targets[0].id = face
    variable.targets[0].data_path = path
    curve.driver.expression = "4 * smile"
    return curve.driver


def _driven(face: bpy.types.Object) -> tuple[bpy.types.Object, bpy.types.Driver]:
    """A plane 2 m above the ground as long as its driver works."""
    driven = add_plane("Driven")
    driver = _drive(driven.driver_add("location", 2), face)
    bpy.context.view_layer.update()
    assert driven.matrix_world.translation.z == 2
    return driven, driver


def _hat() -> bpy.types.Object:
    """A plane on a corner of a beveled box; it has a child."""
    box = add_mesh("Box", ((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (0, 0, 2)), ((0, 1, 2, 3, 4),))
    box.modifiers.new("Solid", "SOLIDIFY").thickness = 0.5
    box.modifiers.new("Bevel", "BEVEL").width = 0.2
    hat = add_plane("Hat")
    hat.parent, hat.parent_type, hat.parent_vertices[0] = box, "VERTEX", 2
    add_plane("Feather").parent = hat
    add_plane("Lid").parent = box
    bpy.context.view_layer.update()
    return hat


def _exported_place(name: str) -> tuple[float, ...]:
    """Where a bake of the open scene finds an object."""
    with originals_shown(bpy.context):
        sources = export_scene(bpy.context, BakeSettings()).sources
    (source,) = (source for source in sources if source.name == name)
    return tuple(row[3] for row in source.matrix_world[:3])


def test_a_driver_that_reads_shape_keys_works_after_restore() -> None:
    driven, driver = _driven(_face())
    (warning,) = bake_by_hand().warnings
    assert warning.name == "Driven"
    assert not driver.is_valid
    assert _exported_place("Driven") == (0, 0, 2)
    assert [warning.name for warning in bake_by_hand().warnings] == ["Driven"]
    restore(bpy.context)
    assert driver.is_valid
    assert driven.matrix_world.translation.z == 2


def test_a_driver_of_anything_else_is_named_too() -> None:
    face, lamp = _face(), add_lamp("POINT")
    driver = _drive(lamp.data.driver_add("energy"), face)
    (warning,) = bake_by_hand().warnings
    assert warning.name == lamp.data.name
    assert "'Face'" in warning.message
    assert SMILE in warning.message
    restore(bpy.context)
    assert driver.is_valid
    assert lamp.data.energy == 2


def test_a_driver_works_after_a_bake_that_fails() -> None:
    driven, driver = _driven(_face())
    with pytest.raises(RuntimeError):
        bake_by_hand(failing=RuntimeError())
    assert driver.is_valid
    assert driven.matrix_world.translation.z == 2


def test_a_driver_that_never_worked_is_not_warned_of() -> None:
    face, driven = _face(), add_plane("Driven")
    driver = _drive(driven.driver_add("location", 2), face, SMILE.replace("Smile", "Frown"))
    assert bake_by_hand().warnings == ()
    restore(bpy.context)
    assert not driver.is_valid


@pytest.mark.parametrize("modifier", [None, "DISPLACE"], ids=["in place", "deformed"])
def test_drivers_go_on_where_the_mesh_has_its_shape_keys(modifier: str | None) -> None:
    driven, driver = _driven(_face(modifier))
    assert bake_by_hand().warnings == ()
    assert driver.is_valid
    assert driven.matrix_world.translation.z == 2


def test_drivers_of_library_overrides_work_after_restore(tmp_path: Path) -> None:
    _driven(_face())
    collection = bpy.data.collections.new("Cast")
    bpy.context.scene.collection.children.link(collection)
    for name in ("Face", "Driven"):
        collection.objects.link(bpy.data.objects[name])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.collections = ["Cast"]
    bpy.context.scene.collection.children.link(wanted.collections[0])
    wanted.collections[0].override_hierarchy_create(bpy.context.scene, bpy.context.view_layer)
    driven = bpy.data.objects["Driven", None]
    assert [warning.name for warning in bake_by_hand().warnings] == ["Driven"]
    restore(bpy.context)
    assert driven.animation_data.drivers[0].driver.is_valid
    assert driven.matrix_world.translation.z == 2


def test_what_hangs_on_a_vertex_is_baked_in_its_place() -> None:
    hat = _hat()
    place = tuple(hat.matrix_world.translation)
    (warning,) = bake_by_hand().warnings
    assert warning.name == "Hat"
    assert "Restore" in warning.message
    assert tuple(hat.matrix_world.translation) != place
    assert _exported_place("Hat") == place
    assert [warning.name for warning in bake_by_hand().warnings] == ["Hat"]
    restore(bpy.context)
    assert tuple(hat.matrix_world.translation) == place


def test_what_hangs_on_a_vertex_of_a_shared_mesh_stays_in_its_place() -> None:
    box, hat = add_plane("Box"), add_plane("Hat")
    add_object("Other", box.data, location=(5, 0, 0))
    hat.parent, hat.parent_type, hat.parent_vertices[0] = box, "VERTEX", 2
    bpy.context.view_layer.update()
    place = tuple(hat.matrix_world.translation)
    assert bake_by_hand().warnings == ()
    assert tuple(hat.matrix_world.translation) == place
