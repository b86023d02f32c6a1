"""Every Blender test starts from, and leaves behind, an empty factory scene."""

from __future__ import annotations

from collections.abc import Iterator

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
    from radiosity_addon.blender import bake_record

    if hasattr(bpy.types.Object, "radiosity_bake"):
        yield
        return
    bake_record.register()
    yield
    bake_record.unregister()
