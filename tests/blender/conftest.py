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
