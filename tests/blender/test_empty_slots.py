"""Material slots that are linked to the object and empty: they show the mesh's material, also when baked."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import pytest

from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.datablocks.bake_record import ORIGINAL
from tests.blender.edited_copies import GREEN, base_color, color_node
from tests.blender.hand_bake import add_plane, bake_by_hand, principled_material

pytestmark = pytest.mark.usefixtures("record")


def _own(obj: bpy.types.Object) -> None:
    pass


def _shared(obj: bpy.types.Object) -> None:
    twin = bpy.data.objects.new("Twin", obj.data)
    bpy.context.scene.collection.objects.link(twin)


def _modified(obj: bpy.types.Object) -> None:
    obj.modifiers.new("Array", "ARRAY")


Kind = Callable[[bpy.types.Object], None]
kinds = pytest.mark.parametrize("kind", [_own, _shared, _modified])


def _with_empty_slots(kind: Kind) -> tuple[bpy.types.Object, bpy.types.Material]:
    """A plane with two slots, both linked to it: an empty one, and one that repeats the mesh's material."""
    paint = principled_material()
    obj = add_plane("Plane", paint)
    obj.data.materials.append(paint)
    for slot in obj.material_slots:
        slot.link = "OBJECT"
    obj.material_slots[1].material = paint
    kind(obj)
    return obj, paint


def _slots(obj: bpy.types.Object) -> list[tuple[str, bpy.types.Material | None]]:
    return [(slot.link, slot.material) for slot in obj.material_slots]


@kinds
def test_the_lightmap_shows_the_mesh_s_material(kind: Kind) -> None:
    obj, paint = _with_empty_slots(kind)
    bake_by_hand()
    assert [slot.material[ORIGINAL] for slot in obj.material_slots] == [paint, paint]


@kinds
def test_they_are_empty_after_restore(kind: Kind) -> None:
    obj, paint = _with_empty_slots(kind)
    bake_by_hand()
    restore(bpy.context)
    assert _slots(obj) == [("OBJECT", None), ("OBJECT", paint)]
    assert list(obj.data.materials) == [paint, paint]


@kinds
def test_they_are_empty_after_a_second_bake_and_restore(kind: Kind) -> None:
    obj, paint = _with_empty_slots(kind)
    bake_by_hand()
    bake_by_hand()
    restore(bpy.context)
    assert _slots(obj) == [("OBJECT", None), ("OBJECT", paint)]


@kinds
def test_an_edit_there_goes_to_the_mesh_s_material(kind: Kind) -> None:
    obj, paint = _with_empty_slots(kind)
    bake_by_hand()
    color_node(obj.material_slots[0].material).default_value = GREEN
    restore(bpy.context)
    assert _slots(obj)[0] == ("OBJECT", None)
    assert base_color(paint) == pytest.approx(GREEN)


@kinds
def test_an_edit_that_conflicts_with_another_is_kept_there(kind: Kind) -> None:
    obj, paint = _with_empty_slots(kind)
    bake_by_hand()
    color_node(obj.material_slots[0].material).default_value = GREEN
    color_node(obj.material_slots[1].material).default_value = (0, 0, 1, 1)
    restore(bpy.context)
    first, second = (base_color(slot.material or paint) for slot in obj.material_slots)
    assert first == pytest.approx(GREEN)
    assert second == (0, 0, 1, 1)


@kinds
def test_a_material_assigned_there_stays(kind: Kind) -> None:
    obj, _ = _with_empty_slots(kind)
    bake_by_hand()
    mine = principled_material(name="Mine")
    obj.material_slots[0].material = mine
    restore(bpy.context)
    assert obj.material_slots[0].material == mine
