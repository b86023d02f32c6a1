"""Restore brings the whole file back exactly, at once and after saving and reloading."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import bpy
import pytest

from radiosity_addon.blender import bake_record
from radiosity_addon.blender.apply import apply_lightmaps
from radiosity_addon.blender.export import export_scene
from radiosity_addon.blender.images import write_pages
from radiosity_addon.blender.restore import restore
from radiosity_addon.settings import BakeSettings
from tests.blender.file_dump import differences, dump_file
from tests.blender.hand_bake import hand_result
from tests.blender.zoo import build_zoo


@pytest.fixture(autouse=True)
def record() -> Iterator[None]:
    """The record's type, without the rest of the add-on."""
    if hasattr(bpy.types.Object, "radiosity_bake"):
        yield
        return
    bake_record.register()
    yield
    bake_record.unregister()


def _bake(folder: Path | None, **settings: str) -> None:
    wanted = BakeSettings(**settings)
    export = export_scene(bpy.context, wanted)
    result = hand_result(export, ((0.25, 0.5, 0.75), (1.0, 2.0, 3.0)))
    apply_lightmaps(bpy.context, export, result, write_pages(result, wanted, folder), wanted)


def _tidy_dump() -> dict:
    """Dump after what Blender puts off until somebody looks is done."""
    bpy.context.view_layer.update()
    dump_file()
    return dump_file()


def test_restore_leaves_no_difference(tmp_path: Path) -> None:
    build_zoo(bpy.context)
    before = _tidy_dump()
    _bake(tmp_path)
    assert len(differences(before, dump_file())) > 100
    assert restore(bpy.context) > 0
    found = differences(before, _tidy_dump())
    if bpy.app.version < (5, 0):
        # Material.copy() counts what its nodes use twice there, until the next load.
        found = [line for line in found if not re.match(r"/(images|node_groups)/.*/users: ", line)]
    assert found == []
    assert not bake_record.is_baked()


def test_restore_after_save_and_reload_leaves_no_difference(tmp_path: Path) -> None:
    build_zoo(bpy.context)
    path = str(tmp_path / "zoo.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    before = _tidy_dump()
    _bake(None)
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert bake_record.is_baked()
    restore(bpy.context)
    assert differences(before, _tidy_dump()) == []
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert differences(before, _tidy_dump()) == []


def test_restore_of_an_unbaked_file_does_nothing() -> None:
    build_zoo(bpy.context)
    before = _tidy_dump()
    assert restore(bpy.context) == 0
    assert differences(before, _tidy_dump()) == []
