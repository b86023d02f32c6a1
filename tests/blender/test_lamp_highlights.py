"""Highlights of lamps on baked surfaces can be switched off, and everything is put back."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.base.errors import BakeError
from radiosity_addon.blender.apply.lamp_highlights import SWITCHED_OFF
from radiosity_addon.blender.apply.restore import restore
from radiosity_addon.blender.files.cornell import build_cornell_box
from radiosity_addon.blender.files.files import empty_scene
from radiosity_addon.blender.relight import lightmap_versions
from tests.blender.eevee import seen_in_eevee
from tests.blender.file_dump import differences_since, dump_file
from tests.blender.hand_bake import add_plane, bake_by_hand, principled_material, seen_from_above
from tests.blender.scenes import add_lamp

pytestmark = pytest.mark.usefixtures("registered")


@pytest.fixture
def lamp() -> bpy.types.Object:
    """Above a plane that shines and shows a lightmap."""
    add_plane(material=principled_material(Roughness=0.2))
    found = add_lamp("POINT", energy=5000.0, transform={"location": (0.3, 0.2, 2.0)})
    bake_by_hand(show="shine")
    return found


def switch(on: bool) -> None:
    bpy.context.scene.radiosity.highlights = on


def test_without_highlights_a_lamp_changes_no_pixel(lamp: bpy.types.Object, tmp_path: Path) -> None:
    with_highlight = seen_from_above(tmp_path)
    switch(False)
    without = seen_from_above(tmp_path)
    assert (with_highlight > without).all()
    switch(True)
    np.testing.assert_array_equal(seen_from_above(tmp_path), with_highlight)
    bpy.data.objects.remove(lamp)
    np.testing.assert_array_equal(seen_from_above(tmp_path), without)


EEVEE = """
import radiosity_addon
from tests.blender.scenes import add_lamp
radiosity_addon.register()
hand_bake.add_plane(material=hand_bake.principled_material(Metallic=1.0, Roughness=0.5))
hand_bake.bake_by_hand(folder=Path(sys.argv[1]), show="shine")
look()
add_lamp("SUN", energy=3.0, use_shadow=False)
look()
bpy.context.scene.radiosity.highlights = False
look()
"""


@pytest.mark.one_blender
def test_nor_in_eevee(tmp_path: Path) -> None:
    dark, highlight, without = seen_in_eevee(EEVEE, tmp_path)
    assert (highlight > 0.1).all()
    np.testing.assert_array_equal(without, dark)


def test_lamps_are_put_back_but_for_what_the_user_chose(lamp: bpy.types.Object) -> None:
    hidden = add_lamp("SPOT", energy=1.0)
    hidden.visible_glossy = False
    elsewhere = add_lamp("SUN", energy=1.0)
    bpy.data.scenes.new("Other").collection.objects.link(elsewhere)
    bpy.context.scene.collection.objects.unlink(elsewhere)
    wanted = add_lamp("POINT", energy=1.0)
    switch(False)
    assert [each.visible_glossy for each in (lamp, hidden, elsewhere, wanted)] == [False, False, True, False]
    wanted.visible_glossy = True
    bake_by_hand(show="shine")
    copy = lamp.copy()
    bpy.context.scene.collection.objects.link(copy)
    assert [each.visible_glossy for each in (lamp, wanted, copy)] == [False, True, False]
    restore(bpy.context)
    every = (lamp, hidden, elsewhere, wanted, copy)
    assert [each.visible_glossy for each in every] == [True, False, True, True, True]
    assert not any(SWITCHED_OFF in each for each in every)


def test_restore_leaves_no_trace(lamp: bpy.types.Object) -> None:
    restore(bpy.context)
    switch(True)
    before = dump_file()
    bake_by_hand(show="shine")
    switch(False)
    assert not lamp.visible_glossy
    restore(bpy.context)
    switch(True)
    assert differences_since(before) == []


def test_nothing_happens_where_no_lightmap_is_shown() -> None:
    add_plane()
    lamp = add_lamp("POINT", energy=1.0)
    switch(False)
    assert lamp.visible_glossy
    assert SWITCHED_OFF not in lamp


def test_the_next_bake_applies_it_and_a_failed_one_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = build_cornell_box()
    scene.radiosity.resolution, scene.radiosity.quality = 32, "sketch"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "room.blend"))
    switch(False)
    lamp = bpy.data.objects["Lamp"]

    def full(*_: object) -> None:
        raise BakeError("no space left on device")

    monkeypatch.setattr(lightmap_versions, "publish", full)
    with pytest.raises(RuntimeError, match="no space left"):
        bpy.ops.radiosity.bake("EXEC_DEFAULT", True)
    assert lamp.visible_glossy
    assert SWITCHED_OFF not in lamp
    monkeypatch.undo()
    bpy.ops.radiosity.bake("EXEC_DEFAULT", True)
    assert not lamp.visible_glossy
    second = bpy.data.scenes.new("Second")
    second.radiosity.highlights = True
    assert scene.radiosity.highlights
    assert lamp.visible_glossy


def test_a_linked_lamp_is_named(tmp_path: Path) -> None:
    add_lamp("POINT", energy=5.0).name = "Far"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "lamps.blend"))
    empty_scene()
    scene = build_cornell_box()
    with bpy.data.libraries.load(str(tmp_path / "lamps.blend"), link=True) as (_, wanted):
        wanted.objects = ["Far"]
    scene.collection.objects.link(wanted.objects[0])
    scene.radiosity.resolution, scene.radiosity.quality = 32, "sketch"
    switch(False)
    bpy.ops.radiosity.bake("EXEC_DEFAULT", True)
    assert "lamp 'Far' is linked, so it still makes highlights" in scene.radiosity.last_bake
