"""The two ends of what is edited on a stand-in: restored, or baked again and restored."""

from __future__ import annotations

import bpy
import pytest

from radiosity_addon.blender.apply.rebake import originals_shown
from radiosity_addon.blender.apply.restore import restore_scene
from tests.blender.hand_bake import bake_by_hand


def restored() -> list[str]:
    """Return the names in the warnings."""
    return [warning.name for warning in restore_scene(bpy.context, None).warnings]


def baked_again_and_restored() -> list[str]:
    """Return the names in the warnings of both."""
    with originals_shown(bpy.context) as warnings:
        names = [warning.name for warning in warnings]
    bake_by_hand(colors=((9, 9, 9),))
    return [*names, *restored()]


AFTER = pytest.mark.parametrize("then", [restored, baked_again_and_restored], ids=["restored", "baked again"])
