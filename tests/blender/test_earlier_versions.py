"""A file that version 0.1 baked is restored and baked again; `files/baked_by_0_1.py` says how it was made."""

from __future__ import annotations

from pathlib import Path

import bpy
import pytest

from radiosity_addon.blender.apply.restore import restore_scene
from radiosity_addon.blender.datablocks import bake_record
from tests.blender.hand_bake import bake_by_hand

pytestmark = pytest.mark.usefixtures("record")

FILE = Path(__file__).parent / "files" / "baked_by_0_1.blend"


@pytest.mark.parametrize("again", [False, True], ids=["restored", "baked again"])
def test_a_file_baked_by_0_1_is_as_before_but_for_edits(again: bool) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(FILE))
    assert bake_record.is_baked()
    if again:
        bake_by_hand(colors=((1, 2, 3),))
    warnings = restore_scene(bpy.context, None).warnings
    assert [warning.name for warning in warnings] == ([] if again else ["Edited"])
    objects = bpy.data.objects
    assert set(objects.keys()) == {"Own", "Edited", "Shared", "Twin", "Solid", "Here", "Part"}
    assert [layer.name for layer in objects["Own"].data.uv_layers] == ["UVMap", "Lightmap"]
    assert tuple(objects["Own"].data.uv_layers["Lightmap"].uv[0].vector) == (0.25, 0.75)
    assert objects["Edited"].data.vertices[0].co.z == 0.5
    assert "Tint" in objects["Edited"].data.attributes
    assert [material.name for material in objects["Edited"].data.materials] == ["Edited Paint"]
    assert objects["Shared"].data == objects["Twin"].data
    assert [(slot.link, slot.material.name) for slot in objects["Twin"].material_slots] == [
        ("OBJECT", "Of Twin")
    ]
    flags = [(each.name, each.show_viewport, each.show_render) for each in objects["Solid"].modifiers]
    assert flags == [("Solidify", True, True), ("Off", False, True)]
    assert not objects["Here"].hide_viewport
    assert not objects["Here"].hide_render
    assert sorted(mesh.name for mesh in bpy.data.meshes) == ["Edited", "Own", "Part", "Shared", "Solid"]
    assert list(bpy.data.images) == []
    assert not bake_record.is_baked()
    assert not any(key.startswith("radiosity") for mesh in bpy.data.meshes for key in mesh.keys())  # noqa: SIM118
