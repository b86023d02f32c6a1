"""Every Blender test starts from, and leaves behind, an empty factory scene."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")


@pytest.fixture(autouse=True)
def empty_blender() -> Iterator[None]:
    """Reset the open file around each test; preferences and add-ons stay as they are."""
    _empty_file()
    yield
    _empty_file()


def _empty_file() -> None:
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


@pytest.fixture
def record() -> Iterator[None]:
    """The type of what a bake remembers, registered without the rest of the add-on."""
    from radiosity_addon.blender.datablocks import bake_record

    if hasattr(bpy.types.Object, "radiosity_bake"):
        yield
        return
    bake_record.register()
    yield
    bake_record.unregister()


@pytest.fixture
def registered() -> Iterator[None]:
    """The whole add-on, registered."""
    import radiosity_addon

    radiosity_addon.register()
    yield
    radiosity_addon.unregister()


@pytest.fixture
def room(registered: None, tmp_path: Path) -> Path:
    """The folder of a saved room that is open and set to bake quickly."""
    from tests.blender.promised import saved_room

    return saved_room(tmp_path)


@pytest.fixture
def paint(record: None) -> bpy.types.Material:
    """The material of a plane that shows a lightmap."""
    from tests.blender.hand_bake import add_plane, bake_by_hand, principled_material

    material = principled_material()
    add_plane(material=material)
    bake_by_hand()
    return material
