"""Golden tests compare with Cycles: they need Blender's module and start from an empty file."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

bpy = pytest.importorskip("bpy")


@pytest.fixture(autouse=True, scope="module")
def empty_blender() -> Iterator[None]:
    """Reset the open file around each module: a bake is shared by its tests."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    yield
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
